//! The paper's Table 4, repeated: every method on the same garments, with time and error side by side.
//!
//! A row is a garment at a size. The compared methods are the three [reference methods](crate::mechanics::methods), the paper's own
//! equations, the coupled model's two stages alone, and these two stages followed by refinement to convergence. All
//! drape the same scene in the same fabric on the same threads. Rounds are interleaved (each method once a round, after
//! an uncounted warm-up round), so a disturbance of the machine affects all methods alike. Ratios are taken round by
//! round.
//!
//! Time is measured from the loaded scene to the draped positions. For our models it is the sum of the four stages, without
//! later measurements; for a reference method it includes the method's own preparation, but not the masses and areas of
//! the cloth.
//!
//! | metric | meaning |
//! |---|---|
//! | median, spread | of the counted rounds, ms; the spread is the interquartile range |
//! | ratio | median of the method's time over the converged drape's, round by round, with its interquartile range |
//! | canonical error | RMS distance of the vertices to the canonical drape, which is refined from the undraped start, mm |
//! | own error | RMS distance to the equilibrium that Newton's method reaches from the result, mm |
//! | hem, girths | height of the lowest edge, lengths of level sections, cm; beside those of the canonical drape |
//! | residual | ‖∇E‖ of this project's energy over the weight, less the forces that friction can hold |
//!
//! A garment has several equilibria. Each row states the RMS distance between canonical drapes from perturbed starts; an
//! error below that distance does not rank methods.

mod methods;
mod row;
mod row_log;
mod silhouette;
mod table;

pub(crate) use methods::{ComparedMethod, METHODS, TEN_ROWS};
pub(crate) use row::{DrapedRow, MethodResult, Table4Error, Table4Options, Table4Row, row};
pub(crate) use row_log::{Conditions, RowLog};
pub(crate) use table::{csv_lines, exponents, tables};

#[cfg(test)]
mod tests;
