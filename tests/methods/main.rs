//! The paper's reference methods against closed forms, and against the project's own drape.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../fixtures/mod.rs"]
mod fixtures;

mod gross2003;
mod scenes;
mod thomaszewski2006;
mod zhu2016;
