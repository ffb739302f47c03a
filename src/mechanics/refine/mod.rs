//! Refinement: from any start to the drape, by Newton's method at full resolution.
//!
//! The loop is a state machine (`settle`):
//!
//! ```text
//!                   tangled? starts
//!                          │
//!      far from rest and stiff, or freed of self-contact?
//!                  yes │        │ no
//!                  softened → descent ⇄ equilibrium → converged, or unsettled
//! ```
//!
//! | state | what it does | file |
//! |---|---|---|
//! | starts | settles cloth that intersects itself from up to three starts | `starts`, `energy::proximity` |
//! | softened | steps with capped stiffness, or without self-contact, until the residual is small | `softening` |
//! | descent | steps with the true stiffness | `newton::state`; damping in `damping`, cycles in `cycle_damping`, no progress in `stall` |
//! | equilibrium | forces balance: resolves penetrations, updates contact places, checks the rest | `face_contact_phase`, `rest_phase` |
//!
//! A step is one of `mechanics::newton`. A run stops where the residual ‖∇E‖₂ over the free vertices, divided by the garment's weight,
//! is under the tolerance, no vertex is inside the body, and the equilibrium is stable: the residual is also small at a saddle of the energy
//! and where cloth slides slowly (`newton::saddle_escape`).
//!
//! Every tolerance, limit and switch is an option of the cloth's solver ([`SolverOptions`](super::solver_options::SolverOptions)).

mod cycle_damping;
mod damping;
mod face_contact_phase;
mod rest_phase;
mod settle;
mod softening;
mod stall;
mod starts;
mod types;

use glam::DVec3;

use super::energy::{Cloth, Contacts};
pub use super::newton::{Record, SolveError, Solver};
use crate::base::pool::within_awake_pool;
use crate::body::distance::Body;
pub(crate) use types::Observer;
pub use types::{RefineOptions, Refined, Step, Stop};

/// Settles `cloth` on `body` from the vertex positions `start` (m), one for each vertex, held ones included.
///
/// `observer` sees the start and the cloth after every step; where it breaks off, what there is by then is returned with
/// [`Stop::Interrupted`]. Runs in rayon's pool; the bits do not depend on its size.
///
/// # Errors
/// [`SolveError`] where the start holds positions that are not finite.
pub fn refine(
    cloth: &Cloth,
    body: &Body,
    start: Vec<DVec3>,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    let contacts = cloth.contacts(body, &start);
    refine_with(cloth, contacts, start, options, observer)
}

/// [`refine`] with contacts made by the caller: [`Contacts::none`] for a cloth that hangs free, or those of an earlier state,
/// whose anchors of friction and stiffness then go on.
///
/// # Errors
/// As [`refine`].
pub fn refine_with(
    cloth: &Cloth,
    contacts: Contacts<'_>,
    start: Vec<DVec3>,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    // No tree of triangles can be built from positions that are not finite.
    if let Some(vertex) = start.iter().position(|x| !x.is_finite()) {
        return Err(SolveError::NotPositive { index: 3 * vertex });
    }
    // Inside the pool: a join from outside it suspends the caller, and each of hundreds of gradients is a join.
    within_awake_pool(|| starts::settle_from(cloth, &contacts, start, options, observer))
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::mesh::samples::sheet;

    #[test]
    fn a_start_that_is_not_finite_is_refused() {
        let mesh = sheet(3, 3, |i, j| DVec3::new(i, 0.0, j) * 0.05);
        let cloth = Cloth::sample(&mesh, "jersey", &[12, 13, 14, 15]);
        let mut start = mesh.positions.clone();
        start[5].y = f64::NAN;
        let options = RefineOptions { self_contact: true, ..RefineOptions::default() };
        let refused = refine_with(&cloth, Contacts::none(), start, &options, &mut |_| ControlFlow::Continue(()));
        assert!(matches!(refused, Err(SolveError::NotPositive { index: 15 })), "{refused:?}");
    }
}
