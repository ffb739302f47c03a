//! The drape against closed forms: a hanging strip, a cantilever, and Coulomb's slip angle.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod bench;
mod cantilever;
mod crease;
mod fit;
mod friction;
mod strip;
mod threads;
