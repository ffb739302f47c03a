//! Starts of a refinement: one, or for tangled cloth up to three.
//!
//! Cloth whose start and clear positions both intersect themselves may end with cloth through cloth, and which start leads there is chance.
//! It is therefore settled from one start after the other, until an end has no intersection and does not stall:
//!
//! | start | what happens first |
//! |---|---|
//! | clear positions, freed | steps without self-contact until near rest: the membrane undoes most of the tangle |
//! | clear positions | steps with self-contact, whose gaps pull intersections apart (`energy::proximity::untangle`) |
//! | the start as given | the same |
//!
//! The last one is the first where it has no more intersections than the clear positions. If every end fails, the one with the fewest
//! intersections is the result.
//!
//! Limits: the observer sees the steps from each start, each time numbered from zero. With `RefineOptions::max_steps` all steps are taken from the
//! first start.

use glam::DVec3;

use super::settle::{settle, step_limit};
use super::types::{Observer, RefineOptions, Refined, Stop};
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::newton::SolveError;

/// A start.
struct Start {
    /// Positions, m.
    positions: Vec<DVec3>,
    /// Whether the cloth has no self-contact until it is near rest.
    freed: bool,
}

/// Settles `cloth` from `start` (m): [`refine_with`](super::refine_with) within rayon's pool.
pub(super) fn settle_from(
    cloth: &Cloth,
    contacts: &Contacts<'_>,
    start: Vec<DVec3>,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    let (first, others) = starts(cloth, start, options);
    let mut settled = |start: Start| settle(cloth, contacts.clone(), start.positions, start.freed, options, observer);
    let mut best = settled(first)?;
    let mut steps = best.steps;
    for start in others {
        if failure(&best) == (0, false) || matches!(best.stop, Stop::Interrupted | Stop::StepsDone) {
            break;
        }
        let refined = settled(start)?;
        steps += refined.steps;
        if refined.stop == Stop::Interrupted || failure(&refined) < failure(&best) {
            best = refined;
        }
    }
    Ok(Refined { steps, ..best })
}

/// Pairs of triangles that intersect, and whether the end is no rest.
fn failure(refined: &Refined) -> (usize, bool) {
    (refined.crossings, matches!(refined.stop, Stop::Stalled | Stop::Unsettled(_)))
}

/// The first start and, for tangled cloth, the others.
fn starts(cloth: &Cloth, mut start: Vec<DVec3>, options: &RefineOptions) -> (Start, Vec<Start>) {
    let mut others = Vec::new();
    if options.self_contact && step_limit(cloth, options) > 0 {
        let mut proximity = cloth.proximity();
        if let Some(clear_has_fewer) = proximity.retreat(&mut start) {
            let clear = |freed| Start { positions: proximity.clear().to_vec(), freed };
            if clear_has_fewer {
                return (clear(true), vec![clear(false), Start { positions: start, freed: false }]);
            }
            others = vec![clear(true), clear(false)];
        }
    }
    (Start { positions: start, freed: false }, others)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use crate::mesh::samples::folded;

    /// Starts of a cloth placed as `placed`, from `start`: whether each is the placement, and freed.
    fn starts_of(placed: &TriMesh, start: &TriMesh) -> Vec<(bool, bool)> {
        let cloth = Cloth::sample(placed, "jersey", &[]);
        let (first, others) = starts(&cloth, start.positions.clone(), &RefineOptions::default());
        std::iter::once(first).chain(others).map(|s| (s.positions == placed.positions, s.freed)).collect()
    }

    #[test]
    fn only_tangled_cloth_has_several_starts_that_with_fewer_intersections_first() {
        let [clear, once, often] = [folded(|_| false), folded(|j| j < 1), folded(|j| j % 4 < 2)];
        assert_eq!(starts_of(&clear, &clear), [(true, false)]);
        assert_eq!(starts_of(&clear, &often), [(false, false)], "the start retreats");
        assert_eq!(starts_of(&once, &often), [(true, true), (true, false), (false, false)]);
        assert_eq!(starts_of(&often, &once), [(false, false), (true, true), (true, false)]);
    }
}
