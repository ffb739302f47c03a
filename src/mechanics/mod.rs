//! Stage two: the motion of PARTs and cloth under gravity, the body and their own stiffness.

pub mod coupled;
pub(crate) mod curvature;
pub mod energy;
pub mod fit;
pub mod folded_surface;
pub mod folds;
pub(crate) mod linear_algebra;
pub mod methods;
pub(crate) mod newton;
pub mod paper;
pub mod reactions;
pub mod refine;
pub mod rest;
mod sine_waves;
pub mod solver_options;
