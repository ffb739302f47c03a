//! To rest at full resolution: Newton steps until the residual is under the tolerance, stiff cloth soft to begin with.

use glam::DVec3;

use super::cycle_damping::CycleDamping;
use super::{Observer, RefineOptions, Refined, STEP_LIMIT, Step, Stop};
use crate::GRAVITY;
use crate::body::distance::Body;
use crate::mechanics::energy::{Cloth, Contacts, Covered};
use crate::mechanics::newton::{NewtonState, Rest, SolveError, Solver, StepLimits, Tangent, Whole};
use crate::mesh::box_about;

/// Bounds of the damping ε, 1/s². A garment swings at some 20/s² (g over its length), so 1 hardly slows it; at 1e4 a step
/// under gravity is a millimetre.
const LEAST_DAMPING: f64 = 1.0;
const MOST_DAMPING: f64 = 1e4;

/// Stiff cloth begins soft where the residual is over this share of ‖m g‖₂, the residual of cloth that nothing carries yet. A
/// drape that has settled before is well under it.
const FAR_FROM_REST: f64 = 0.5;

/// Residual over weight under which damping falls faster: only the softest ways to move are left, and those it holds back most.
pub(super) const CLOSE: f64 = 1e-2;

/// Residual over weight under which one looks again for skin through the cloth, once there was some: before it has come to rest with what
/// was found so far.
const COVERING: f64 = 3e-2;

/// Steps in which the cloth must come to rest with what covers the skin; else it is let go. The longest took 24, in a pair of trousers.
const PATIENCE: usize = 80;

/// Residual over weight at which the softened cloth has done its part.
const SOFT_TOLERANCE: f64 = 1e-2;

/// Times the length of a step that one may go which goes on like the one before, near rest: see `newton::onward`. With 2 the five garments
/// at ten sizes, knit and woven, took 354 steps together, with 1 363.
const FARTHEST: f64 = 2.0;

/// Looks at a rest whether it lasts, at most: see `newton::ways_out`. Without them the same twenty took 327 steps, and four of them were
/// saddles or still moved; with four one still did, and from other previews with eight.
const LOOKS: usize = 16;

/// Iterations of a relaxation at the start and after a step.
const RELAXING: usize = 20;

/// Relaxations of a start that crosses itself, at most.
const UNTANGLING: usize = 60;

/// Iterations for a trial that failed. With 25 the five garments and two plain skirts of 4,000 and 16,000 vertices, all knit, take
/// 42 steps together, with 60 31, with 80 34 (damping from 100).
const RELAXING_TRIAL: usize = 60;

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
    // In the pool: a join from outside it puts the caller to sleep, and a gradient, of which there are hundreds, is one.
    rayon::scope(|_| settle(cloth, contacts, start, options, observer))
}

fn settle(
    cloth: &Cloth,
    mut contacts: Contacts<'_>,
    mut start: Vec<DVec3>,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    let limit = options.max_steps.unwrap_or(STEP_LIMIT).min(STEP_LIMIT);
    if options.self_contact && limit > 0 {
        let mut itself = cloth.proximity();
        itself.clear(&mut start);
        contacts.proximity = Some(itself);
        contacts.update(&start);
        contacts.refresh(&start);
    }
    let pace =
        StepLimits { longest_move_m: options.longest_move_m, relaxing: RELAXING, relaxing_trial: RELAXING_TRIAL };
    let height = extent(&start);
    let mut descent = NewtonState::new(cloth, contacts, start, options.damping);
    let softened =
        if far_from_rest(cloth, descent.residual) { cloth.softened(height, options.soft_strain) } else { None };
    let mut soft = softened.is_some();
    if let Some(softened) = &softened {
        descent.cloth = softened;
        descent.evaluate();
    }
    if limit > 0 {
        descent.untangle_or_go_back(UNTANGLING, RELAXING);
    }
    let mut tangent = Whole::default();
    // Whether the energy is new to these positions: at the start, and when the cloth gets its true stiffness.
    let mut fresh = true;
    let mut history = vec![descent.record(0, None, soft)];
    let mut iteration = 0;
    let mut looks = 0;
    // The step before which covering asked for something, while it has not come to rest with that.
    let mut covering: Option<usize> = None;
    let mut swing = CycleDamping::default();
    let stop = loop {
        if observer(&seen(&descent, iteration, false)).is_break() {
            break Stop::Interrupted;
        }
        if !soft && descent.residual < options.tolerance {
            if !descent.contacts.keep_out(&descent.x) {
                let NewtonState { contacts, x, .. } = &mut descent;
                let covered = if options.self_contact { contacts.cover(cloth, x) } else { Covered::Done };
                covering = (covered != Covered::Done).then_some(iteration);
                match covered {
                    Covered::Places => swing.anew(&mut descent),
                    Covered::Moved => {
                        swing.anew(&mut descent);
                        descent.damping = options.damping;
                    }
                    Covered::Done if !options.lasting || looks == LOOKS || iteration >= limit => break Stop::Converged,
                    Covered::Done => {
                        looks += 1;
                        if looks == 1 && observer(&seen(&descent, iteration, true)).is_break() {
                            break Stop::Interrupted;
                        }
                        match descent.look(&mut tangent, looks > 1, RELAXING)? {
                            Rest::Lasts => break Stop::Converged,
                            Rest::Moves => {}
                            Rest::Left => swing.anew(&mut descent),
                        }
                        descent.damping = LEAST_DAMPING;
                    }
                }
            }
            descent.contacts.update(&descent.x);
            descent.contacts.refresh(&descent.x);
            descent.evaluate();
        }
        if iteration >= limit {
            break Stop::StepsDone;
        }
        if covering.is_some_and(|since| iteration > since + PATIENCE) {
            covering = None;
            descent.contacts.uncover();
            descent.contacts.refresh(&descent.x);
            descent.evaluate();
        }
        if !soft && descent.residual < COVERING && descent.contacts.cover_more(cloth, &descent.x) > 0 {
            descent.contacts.refresh(&descent.x);
            descent.evaluate();
        }
        if std::mem::take(&mut fresh) {
            let analysed = tangent.solver.take();
            let analyse = || analysed.unwrap_or_else(|| Solver::new(cloth.pattern()));
            tangent.solver = Some(descent.relax(RELAXING, analyse));
        }
        descent.farthest = if !soft && descent.residual < CLOSE { FARTHEST } else { 1.0 };
        let advance = descent.advance(&mut tangent, pace)?;
        iteration += usize::from(advance.accepted);
        // A bearing Hessian may point nowhere useful, and the softened cloth need not settle.
        let astray = !advance.accepted && !tangent.pause();
        if astray && !soft {
            break Stop::Stalled;
        }
        if soft && (astray || descent.residual < SOFT_TOLERANCE) {
            soft = false;
            fresh = true;
            descent.cloth = cloth;
            descent.damping = options.damping;
            descent.evaluate();
        } else if advance.share >= 1.0 {
            let less = if descent.residual < CLOSE { 0.1 } else { 0.5 };
            descent.damping = (descent.damping * less).max(LEAST_DAMPING);
        } else if advance.share < 0.3 {
            descent.damping = (descent.damping * 2.0).min(MOST_DAMPING);
        }
        swing.after(&mut descent, advance.back);
        if advance.accepted {
            history.push(descent.record(iteration, Some(advance), soft));
        }
    };
    if soft {
        descent.cloth = cloth;
        descent.evaluate();
    }
    Ok(Refined {
        energy: descent.energy,
        residual_over_weight: descent.residual,
        steps: iteration,
        history,
        stop,
        contact_stiffness: descent.contacts.stiffness(),
        positions: descent.x,
    })
}

/// `x` relaxed until nothing crosses, in a few rounds; `None` where something still does.
pub(crate) fn untangled(cloth: &Cloth, mut contacts: Contacts<'_>, x: Vec<DVec3>) -> Option<Vec<DVec3>> {
    contacts.proximity = Some(cloth.proximity());
    contacts.update(&x);
    contacts.refresh(&x);
    let mut descent = NewtonState::new(cloth, contacts, x, RefineOptions::default().damping);
    descent.untangle(UNTANGLING, RELAXING);
    let left = descent.contacts.proximity.as_mut().map_or(0, |itself| itself.crossings(&descent.x));
    (left == 0).then_some(descent.x)
}

/// Whether a residual is that of cloth which nothing carries yet.
fn far_from_rest(cloth: &Cloth, residual: f64) -> bool {
    let free = cloth.masses.iter().zip(&cloth.held).filter(|(_, held)| !**held);
    let squares: f64 = free.map(|(m, _)| m * m).sum();
    residual > FAR_FROM_REST * GRAVITY * squares.sqrt() / cloth.weight
}

fn seen<'a>(descent: &'a NewtonState<'_, '_>, iteration: usize, at_rest: bool) -> Step<'a> {
    Step {
        iteration,
        energy: descent.energy,
        residual_over_weight: descent.residual,
        contacts: descent.contacts.touches().len(),
        positions: &descent.x,
        at_rest,
    }
}

/// The longest side of the box about `x`, m: about the length that hangs, whichever way the cloth lies as yet.
fn extent(x: &[DVec3]) -> f64 {
    let (low, high) = box_about(x.iter().copied());
    (high - low).max_element().max(0.0)
}
