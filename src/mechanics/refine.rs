//! Refinement: from any start to the drape, by Newton's method at full resolution.
//!
//! The steps are those of `mechanics::newton` in all vertices. Stops where the residual ‖∇E‖₂ over the free vertices, divided
//! by the garment's weight, is under the tolerance and no vertex is inside the body, and where the equilibrium is stable: the residual is also
//! small at a saddle of the energy and where cloth slides slowly. Stability is therefore checked, and a saddle is left
//! (`newton::saddle_escape`); this costs one to two steps and the steps to the next rest.
//!
//! **Stiff cloth begins soft.** A woven membrane lets a step go only as far as its triangles stay as long as they are to a part
//! in thousands, so it creeps into its folds a millimetre at a time. Far from rest it is therefore first settled with its stiffness
//! capped at what its own weight strains by [`RefineOptions::soft_strain`]; with a few millimetres left to go, it continues
//! with its true stiffness. Each of the two energies falls; [`Record::softened`] says which one a step belongs to.
//!
//! **Cycles are damped.** Normals of gaps and anchors of friction are constant during a step and renewed after it, and the set of gaps changes
//! discontinuously. Two states may each lead to the other. Where the renewal is continuous, half steps converge to the mean of both
//! (Krasnoselskii's iteration, 1955). Where it is not, gaps are under-relaxed ([`proximity`](super::energy::Proximity)). A cycle is
//! detected by consecutive steps that oppose each other, or by a few steps that end near where they began, in either case without a
//! smaller residual.

use std::ops::ControlFlow;

use glam::DVec3;

use super::energy::{Cloth, Contacts, FaceUpdate};
use super::newton::{FullSpace, NewtonState, RestCheck, StepLimits, check_rest};
pub use super::newton::{Record, SolveError, Solver};
use crate::GRAVITY;
use crate::body::distance::Body;
use crate::mesh::box_about;

/// Bounds of the damping ε, 1/s². A garment swings at some 20/s² (g over its length), so 1 hardly slows it; at 1e4 a step
/// under gravity is a millimetre.
const MIN_DAMPING: f64 = 1.0;
const MAX_DAMPING: f64 = 1e4;

/// Residual, over ‖m g‖₂ (that of cloth in free fall), above which stiff cloth is softened first. A drape that was at rest before is well
/// below it. Heuristic.
const FAR_FROM_REST: f64 = 0.5;

/// Residual over weight below which damping falls faster: only the softest directions are left, which damping slows most. Heuristic.
const NEAR_REST: f64 = 1e-2;

/// Residual over weight below which contact places are added before the cloth rests with the present ones. Heuristic.
const FACE_CONTACT_RESIDUAL: f64 = 3e-2;

/// Steps after which contact places are removed if the cloth does not rest with them. The most observed are 24, in a pair of
/// trousers.
const MAX_FACE_CONTACT_STEPS: usize = 80;

/// Residual over weight at which the softened cloth gets its true stiffness. Heuristic.
const SOFT_TOLERANCE: f64 = 1e-2;

/// Largest extrapolation of a step near rest: see `newton::extrapolation`. With 2 the five garments at ten sizes, knit and woven, take 354
/// steps together, with 1 363.
const MAX_EXTRAPOLATION: f64 = 2.0;

/// Most checks of an equilibrium: see `newton::saddle_escape`. Without them the same twenty take 327 steps, and four of them end at saddle
/// points or still move; with four checks one still does, and from other previews with eight.
const MAX_REST_CHECKS: usize = 16;

/// Iterations of a relaxation at the start and after a step.
const RELAX_ITERATIONS: usize = 20;

/// Most relaxations of an intersecting start. Heuristic.
const MAX_UNTANGLING_ROUNDS: usize = 60;

/// Iterations of the relaxation of a rejected trial. With 25 the five garments and two plain skirts of 4,000 and 16,000 vertices, all knit, take
/// 42 steps together, with 60 31, with 80 34 (damping from 100).
const TRIAL_RELAX_ITERATIONS: usize = 60;

/// Consecutive opposing steps that count as a cycle near rest, and farther from it. Heuristic.
const MAX_OPPOSING: usize = 3;
const MAX_OPPOSING_FAR: usize = 8;

/// Ratio to the least residual so far below which a residual is progress, which ends a cycle. Heuristic.
const PROGRESS_RATIO: f64 = 0.9;

/// Residual over weight above which steps do not count as a cycle. Heuristic.
const MAX_CYCLE_RESIDUAL: f64 = 0.1;

/// Steps that count as a cycle if they end near where they began. Heuristic.
const WINDOW: usize = 8;
/// The distance from there, over the way travelled. Heuristic.
const RETURN_SHARE: f64 = 0.3;

/// Least share of a step that is taken. Heuristic.
const MIN_STEP_SHARE: f64 = 0.125;
/// Least under-relaxation of gaps. Heuristic.
const MIN_UNDER_RELAXATION: f64 = 1.0 / 64.0;

/// When to stop, and how carefully to go.
#[derive(Debug, Clone, PartialEq)]
pub struct RefineOptions {
    /// At most this many steps; `None` for as many as it takes (see `STEP_LIMIT`).
    pub max_steps: Option<usize>,
    /// Residual over weight that counts as converged.
    pub tolerance: f64,
    /// Damping ε to begin with, 1/s².
    pub damping: f64,
    /// Longest move of a vertex in one step, m.
    pub longest_move_m: f64,
    /// Strain under its own hanging weight that stiff cloth may have to begin with; 0 for its true stiffness throughout.
    pub soft_strain: f64,
    /// Whether cloth is kept apart from cloth: see `proximity`.
    pub self_contact: bool,
    /// Whether a rest must last: hardly anything moves by the next step, and no way leads out on which the energy falls.
    pub lasting: bool,
    /// Residual over weight to which a rest is continued with its own contacts; `None` ends there. For checks of a rest.
    pub continued_to: Option<f64>,
}

/// No run takes more steps than this.
pub(crate) const STEP_LIMIT: usize = 2000;

impl Default for RefineOptions {
    fn default() -> Self {
        Self {
            max_steps: None,
            tolerance: 1e-3,
            damping: 300.0,
            longest_move_m: 0.1,
            soft_strain: 0.005,
            self_contact: true,
            lasting: true,
            continued_to: None,
        }
    }
}

/// One step, as the observer sees it.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// Steps done: 0 for the start.
    pub iteration: usize,
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over the weight.
    pub residual_over_weight: f64,
    /// Vertices within the offset of the body.
    pub contacts: usize,
    /// Positions, m.
    pub positions: &'a [DVec3],
    /// Whether the forces balance; set once, before the check of stability.
    pub at_rest: bool,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The residual is under the tolerance, and the cloth rests by every criterion of [`rest`](super::rest).
    Converged,
    /// The residual is under the tolerance, but this criterion of rest keeps failing.
    Unsettled(&'static str),
    /// The steps asked for are done.
    StepsDone,
    /// The observer said so.
    Interrupted,
    /// No step lowers the energy any more, though the residual is over the tolerance: rounding is reached before.
    Stalled,
}

/// Where a run ended.
#[derive(Debug, Clone)]
pub struct Refined {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over the weight.
    pub residual_over_weight: f64,
    /// Steps done.
    pub steps: usize,
    /// Every step, the start first.
    pub history: Vec<Record>,
    /// Why it ended.
    pub stop: Stop,
    /// Contact stiffness κ at the end, N/m³: more than to begin with, if vertices had to be kept out.
    pub contact_stiffness: f64,
}

/// Called after every step; may end the run.
pub(crate) type Observer<'a> = &'a mut (dyn FnMut(&Step<'_>) -> ControlFlow<()> + Send);

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
    // Inside the pool: a join from outside it suspends the caller, and each of hundreds of gradients is a join.
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
        let mut proximity = cloth.proximity();
        proximity.retreat(&mut start);
        contacts.proximity = Some(proximity);
        contacts.update(&start);
        contacts.refresh(&start);
    }
    let limits = StepLimits {
        longest_move_m: options.longest_move_m,
        relaxing: RELAX_ITERATIONS,
        relaxing_trial: TRIAL_RELAX_ITERATIONS,
    };
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
        descent.untangle_or_restart(MAX_UNTANGLING_ROUNDS, RELAX_ITERATIONS);
    }
    let mut tangent = FullSpace::default();
    // Whether the start of an energy is still to be relaxed: at the start, and when the cloth gets its true stiffness.
    let mut fresh = true;
    let mut history = vec![descent.record(0, None, soft)];
    let mut iteration = 0;
    let mut rest_checks = 0;
    let (mut tolerance, mut continued_to) = (options.tolerance, options.continued_to);
    // The criterion of rest that failed at the last check.
    let mut failed = "";
    // The step at which the contact places changed, until the cloth rests with them.
    let mut face_contacts_since: Option<usize> = None;
    let mut cycles = CycleDamping::default();
    let stop = loop {
        if observer(&seen(&descent, iteration, false)).is_break() {
            break Stop::Interrupted;
        }
        if !soft && descent.residual < tolerance {
            if !descent.contacts.resolve_penetrations(&descent.x) {
                let NewtonState { contacts, x, .. } = &mut descent;
                let update =
                    if options.self_contact { contacts.update_face_contacts(x) } else { FaceUpdate::Unchanged };
                face_contacts_since = (update != FaceUpdate::Unchanged).then_some(iteration);
                match update {
                    FaceUpdate::Places => cycles.reset(&mut descent),
                    FaceUpdate::Moved => {
                        cycles.reset(&mut descent);
                        descent.damping = options.damping;
                    }
                    FaceUpdate::Unchanged if !options.lasting || iteration >= limit => {
                        break Stop::Converged;
                    }
                    FaceUpdate::Unchanged if rest_checks == MAX_REST_CHECKS => match continued_to.take() {
                        Some(residual) => tolerance = residual,
                        None => break Stop::Unsettled(failed),
                    },
                    FaceUpdate::Unchanged => {
                        rest_checks += 1;
                        if rest_checks == 1 && observer(&seen(&descent, iteration, true)).is_break() {
                            break Stop::Interrupted;
                        }
                        match check_rest(&mut descent, rest_checks > 1, RELAX_ITERATIONS)? {
                            RestCheck::Rests => match continued_to.take() {
                                Some(residual) => tolerance = residual,
                                None => break Stop::Converged,
                            },
                            RestCheck::Fails(criterion) => failed = criterion.name,
                            RestCheck::Escaped => {
                                failed = "lowest curvature";
                                cycles.reset(&mut descent);
                            }
                        }
                        descent.damping = MIN_DAMPING;
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
        if face_contacts_since.is_some_and(|since| iteration > since + MAX_FACE_CONTACT_STEPS) {
            face_contacts_since = None;
            descent.contacts.remove_face_contacts();
            descent.contacts.refresh(&descent.x);
            descent.evaluate();
        }
        if !soft && descent.residual < FACE_CONTACT_RESIDUAL && descent.contacts.extend_face_contacts(&descent.x) > 0 {
            descent.contacts.refresh(&descent.x);
            descent.evaluate();
        }
        if std::mem::take(&mut fresh) {
            let analysed = tangent.solver.take();
            let analyse = || analysed.unwrap_or_else(|| Solver::new(cloth.pattern()));
            tangent.solver = Some(descent.relax(RELAX_ITERATIONS, analyse));
        }
        descent.max_extrapolation = if !soft && descent.residual < NEAR_REST { MAX_EXTRAPOLATION } else { 1.0 };
        let advance = descent.advance(&mut tangent, limits)?;
        iteration += usize::from(advance.accepted);
        // The true Hessian may give no direction of descent, and the softened cloth need not converge.
        let astray = !advance.accepted && !tangent.fall_back();
        if astray && !soft {
            break if descent.residual < tolerance && !failed.is_empty() {
                Stop::Unsettled(failed)
            } else {
                Stop::Stalled
            };
        }
        if soft && (astray || descent.residual < SOFT_TOLERANCE) {
            soft = false;
            fresh = true;
            descent.cloth = cloth;
            descent.damping = options.damping;
            descent.evaluate();
        } else if advance.share >= 1.0 {
            let less = if descent.residual < NEAR_REST { 0.1 } else { 0.5 };
            descent.damping = (descent.damping * less).max(MIN_DAMPING);
        } else if advance.share < 0.3 {
            descent.damping = (descent.damping * 2.0).min(MAX_DAMPING);
        }
        cycles.after_step(&mut descent, advance.opposes);
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
    descent.untangle(MAX_UNTANGLING_ROUNDS, RELAX_ITERATIONS);
    let left = descent.contacts.proximity.as_mut().map_or(0, |proximity| proximity.crossings(&descent.x));
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

/// The longest side of the box about `x`, m: about the hanging length, in whichever direction the cloth lies.
fn extent(x: &[DVec3]) -> f64 {
    let (low, high) = box_about(x.iter().copied());
    (high - low).max_element().max(0.0)
}

/// Detects cycles and damps them.
#[derive(Debug)]
struct CycleDamping {
    /// Residual over weight, the least so far.
    least: f64,
    /// Consecutive opposing steps since then.
    opposing: usize,
    /// Share of its stiffness that a gap gains or loses.
    under_relaxation: f64,
    /// Where the round began, where the last step ended, and how many steps and how far it is by now (‖Δx‖₂, m).
    from: Vec<DVec3>,
    last: Vec<DVec3>,
    steps: usize,
    travelled: f64,
}

impl Default for CycleDamping {
    fn default() -> Self {
        let (from, last) = (Vec::new(), Vec::new());
        Self { least: f64::INFINITY, opposing: 0, under_relaxation: 1.0, from, last, steps: 0, travelled: 0.0 }
    }
}

impl CycleDamping {
    /// Accounts for a step, which opposes the previous one or does not.
    fn after_step(&mut self, descent: &mut NewtonState<'_, '_>, opposes: bool) {
        self.opposing = if opposes { self.opposing + 1 } else { 0 };
        let residual = descent.residual;
        if residual < PROGRESS_RATIO * self.least || residual > MAX_CYCLE_RESIDUAL {
            (self.least, self.opposing) = (residual, 0);
            descent.step_share = (2.0 * descent.step_share).min(1.0);
            self.from.clear();
            return;
        }
        let returns = self.returns(&descent.x);
        if returns || self.opposing >= if residual < NEAR_REST { MAX_OPPOSING } else { MAX_OPPOSING_FAR } {
            self.opposing = 0;
            self.from.clear();
            self.damp(descent);
        }
    }

    /// Restarts with whole steps and without under-relaxation.
    fn reset(&mut self, descent: &mut NewtonState<'_, '_>) {
        *self = Self::default();
        descent.step_share = 1.0;
        if let Some(proximity) = &mut descent.contacts.proximity {
            proximity.set_under_relaxation(1.0);
        }
    }

    /// Whether the last steps together returned to where they began.
    fn returns(&mut self, x: &[DVec3]) -> bool {
        if self.from.is_empty() {
            (self.steps, self.travelled) = (0, 0.0);
            self.from.extend_from_slice(x);
        } else {
            self.steps += 1;
            self.travelled += distance(x, &self.last);
        }
        self.last.clear();
        self.last.extend_from_slice(x);
        if self.steps < WINDOW {
            return false;
        }
        let returns = distance(x, &self.from) < RETURN_SHARE * self.travelled;
        self.from.clear();
        returns
    }

    /// Shortens steps; if they are shortest already, under-relaxes the gaps, with whole steps again.
    fn damp(&mut self, descent: &mut NewtonState<'_, '_>) {
        if descent.step_share > MIN_STEP_SHARE && self.under_relaxation == 1.0 {
            descent.step_share *= 0.5;
        } else if let Some(proximity) = &mut descent.contacts.proximity {
            self.under_relaxation = (0.5 * self.under_relaxation).max(MIN_UNDER_RELAXATION);
            proximity.set_under_relaxation(self.under_relaxation);
            descent.step_share = 1.0;
        }
    }
}

/// ‖a − b‖₂, m.
fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum::<f64>().sqrt()
}
