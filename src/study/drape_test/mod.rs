//! Simulation of the Cusick drape test, which measures the drape coefficient of a fabric.
//!
//! A circle of cloth is clamped on a smaller disc; its rim hangs free and folds. The drape coefficient is
//!
//! DC = (A_p − A_d)/(A_s − A_d), the areas of the drape's shadow, of the disc and of the flat specimen
//!
//! (BS 5058; Cusick: "The measurement of fabric drape", J. Text. Inst. 59, 1968): 0 hangs straight down, 1 is a board. The
//! disc clamps the cloth, so its rim alone is computed, without contact. The radii depend on the standard ([`STANDARDS`]), and a
//! coefficient is comparable only among equal radii.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A_p, A_d, A_s | shadow, disc, specimen | m² |
//! | DC | drape coefficient | – |
//!
//! Limits: no contact between folds, nor with the edge of the disc. A fabric with several equilibria gives the one reached from a
//! flat start with millimetre waves of two to nine nodes; other starts have other phases. A laboratory takes the mean of six drapes.

mod drape;
mod outline;
mod shadow;
mod specimen;
mod standards;
mod table;

pub(crate) use drape::Drape;
pub(crate) use outline::{Figure, to_svg};
pub(crate) use standards::{DrapeTest, DrapeTestError, STANDARDS, Standard};
pub(crate) use table::{Drapes, table_csv};

#[cfg(test)]
mod tests;
