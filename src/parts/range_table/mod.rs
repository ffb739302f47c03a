//! Range tables: the lower and upper values of the distance that cut a garment into PARTs (equation 1, Table 3).
//!
//! A table is an ordered list of levels `[V_L, V_H)`. Equation (1) prints `≤` on both sides; with shared bounds that
//! would put a vertex into two levels, so the upper value belongs to the level above. Where two neighbouring levels leave a
//! hole (Table 3 has one, 3 to 3.5 cm) a [`GapRule`] assigns it.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | V_L, V_H | lower and upper value of a level, as printed | cm |
//! | d | distance of a garment vertex from the body, unsigned | m |
//! | extent | largest width and height of a PART of the level along the cloth; optional, not in the paper | cm |
//!
//! Limits: distances below the first lower value or at and above a finite last upper value belong to no level; the vertices
//! there are reported as unassigned.

mod format;
mod level;
mod table;

pub(crate) use level::METRES_PER_CM;
pub use level::{BoundProblem, Extent, GapRule, Level, TableError};
pub(crate) use table::{MAX_LEVELS, TABLE_3};
pub use table::{RangeTable, TableRule};
