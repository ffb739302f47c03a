//! To come.

pub mod paper;
