//! Mechanics: what moves the PARTs and the cloth.

mod columns;
pub mod coupled;
pub(crate) mod curvature;
pub mod energy;
pub mod fit;
pub mod folds;
pub(crate) mod newton;
pub mod paper;
pub(crate) mod principal;
pub mod reactions;
pub mod refine;
