//! Every term of the energy against finite differences, and what must not change under a rigid motion.

mod derivatives;
mod invariance;
mod patch;
