//! Newton's method with a line search, Levenberg's damping and relaxed steps: one loop for the whole cloth.
//!
//! An iteration takes a step d that solves (H + ε M) d = −∇E over all vertices ([`FullSpace`]). It goes along d as far as Armijo's condition
//! allows, so the energy never rises; ε (Levenberg, Marquardt) falls while whole steps succeed and grows where they do not.
//!
//! **Steps are relaxed.** A step also stretches what it turns, and carries vertices into the body that did not touch before.
//! Both are local and stiff, so a trial that fails for them is first relaxed by a few iterations without a factorisation
//! ([`relax`]) and judged again, and every step that is taken is relaxed as well.
//!
//! When to stop, and what to change between iterations, is the caller's: [`refine`](super::refine) goes on to a residual.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d | step | m |
//! | t | step length, at most 1, or 2 where steps go on alike | – |
//! | ε | damping | 1/s² |
//! | M | lumped masses | kg |

mod dense;
mod extrapolation;
mod factor;
mod full_space;
mod relax;
mod saddle_escape;
mod soa;
mod solver;
mod state;
mod supernodes;
mod symbolic;
mod vectors;

pub use factor::SolveError;
pub(crate) use full_space::FullSpace;
pub(crate) use saddle_escape::{RestCheck, check_rest};
pub use solver::Solver;
pub(crate) use state::NewtonState;
pub use state::Record;
