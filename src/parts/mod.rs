//! Stage one: PARTs, the connected pieces of a garment at one level of distance from the body (equation 1).
//!
//! [`range_table`] holds the levels, `stage_one` the PARTs and their seams, `seeding` the farthest-point seeds by which a PART
//! is cut to an extent along the cloth.

pub mod range_table;
mod seeding;
mod stage_one;

pub use seeding::Grain;
pub use stage_one::{Part, Parts, Seam, UNASSIGNED, segment};
