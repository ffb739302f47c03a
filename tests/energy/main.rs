//! Every term of the energy against finite differences, and what must not change under a rigid motion.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod derivatives;
mod invariance;
mod patch;
mod two_fabrics;
