//! Mechanics: what moves the PARTs and the cloth.

pub mod energy;
pub mod refine;
