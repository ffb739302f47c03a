//! Newton's method with a line search and Levenberg damping.

use glam::DVec3;

use super::relax::Relaxation;
use super::tangent::{State, Tangent};
use super::{Observer, Record, RefineOptions, Refined, STEP_LIMIT, SolveError, Solver, Step, Stop};
use crate::GRAVITY;
use crate::distance::Body;
use crate::mechanics::energy::{Cloth, Contacts};

/// Armijo's constant: the share of the predicted decrease that a step must bring.
const ARMIJO: f64 = 1e-4;

/// Shorter steps than this are rounding.
const SHORTEST_STEP: f64 = 1e-6;

/// Bounds of the damping ε, 1/s². A garment swings at some 20/s² (g over its length), so 1 hardly slows it; at 1e4 a step
/// under gravity is a millimetre.
const LEAST_DAMPING: f64 = 1.0;
const MOST_DAMPING: f64 = 1e4;

/// Stiff cloth begins soft where the residual is over this share of ‖m g‖₂, the residual of cloth that nothing carries yet. A
/// drape that has settled before is well under it.
const FAR_FROM_REST: f64 = 0.5;

/// Residual over weight under which damping falls faster: only the softest ways to move are left, and those it holds back most.
const CLOSE: f64 = 1e-2;

/// Residual over weight at which the softened cloth has done its part.
const SOFT_TOLERANCE: f64 = 1e-2;

/// Iterations of a relaxation at the start and after a step.
const RELAXING: usize = 20;

/// Iterations for a trial that failed: it has further to go, and a step cut short costs another factorisation. With 25 the five
/// garments and two plain skirts of 4,000 and 16,000 vertices, all knit, take 42 steps together, with 60 31, with 80 34
/// (damping from 100).
const RELAXING_TRIAL: usize = 60;

/// Lengths of a step that are tried relaxed; what is shorter is cut for another reason.
const RELAXED_TRIALS: usize = 2;

/// Settles `cloth` on `body` from `start`.
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

/// [`refine`] with contacts made by the caller: [`Contacts::none`] for a cloth that hangs free.
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
    start: Vec<DVec3>,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    // Analysed with the first step: a preview takes none.
    let mut solver = None;
    let masses: Vec<f64> = cloth.order.iter().map(|&v| cloth.masses[v as usize]).collect();
    let mut x = start;
    let (mut gradient, mut direction) = (Vec::new(), Vec::new());
    let mut energy = cloth.gradient(&x, &contacts, &mut gradient);
    let mut residual = norm(&gradient) / cloth.weight;
    let unborne = GRAVITY * masses.iter().map(|m| m * m).sum::<f64>().sqrt() / cloth.weight;
    let mut soft =
        if residual > FAR_FROM_REST * unborne { cloth.softened(extent(&x), options.soft_strain) } else { None };
    if let Some(soft) = &soft {
        energy = soft.gradient(&x, &contacts, &mut gradient);
        residual = norm(&gradient) / cloth.weight;
    }
    let mut damping = options.damping;
    let mut tangent = Tangent::default();
    let mut relaxation = Relaxation::default();
    // Whether the energy is new to these positions: at the start, and when the cloth gets its true stiffness.
    let mut fresh = true;
    let limit = options.max_steps.unwrap_or(STEP_LIMIT).min(STEP_LIMIT);
    let mut history = vec![Record {
        iteration: 0,
        energy,
        residual_over_weight: residual,
        step_length: 0.0,
        largest_move_m: 0.0,
        damping,
        softened: soft.is_some(),
    }];
    let mut trial = x.clone();
    let mut iteration = 0;
    let stop = loop {
        let step = Step {
            iteration,
            energy,
            residual_over_weight: residual,
            contacts: contacts.touches().len(),
            positions: &x,
        };
        if observer(&step).is_break() {
            break Stop::Interrupted;
        }
        if soft.is_none() && residual < options.tolerance {
            if contacts.penetration(&x).0 == 0 {
                break Stop::Converged;
            }
            contacts.stiffen(4.0);
            contacts.update(&x);
            contacts.friction_refresh(&x);
            energy = cloth.gradient(&x, &contacts, &mut gradient);
            residual = norm(&gradient) / cloth.weight;
        }
        if iteration >= limit {
            break Stop::StepsDone;
        }
        let now = soft.as_ref().unwrap_or(cloth);
        let diagonal: Vec<f64> = masses.iter().map(|m| m * damping).collect();
        if std::mem::take(&mut fresh) {
            now.hessian(&x, &contacts, &mut tangent.blocks);
            relaxation.prepare(now, &contacts, &tangent.blocks, &diagonal);
            let relax = || relaxation.run(now, &mut contacts, &mut x, RELAXING);
            let analyse = || solver.take().map_or_else(|| Solver::new(&cloth.pattern), Ok);
            solver = Some(rayon::join(relax, analyse).1?);
            contacts.friction_refresh(&x);
            energy = now.gradient(&x, &contacts, &mut gradient);
        }
        let here = State { cloth: now, x: &x, contacts: &contacts, gradient: &gradient };
        let solver = match &mut solver {
            Some(solver) => solver,
            none => none.insert(Solver::new(&cloth.pattern)?),
        };
        tangent.direction(&here, solver, &diagonal, &mut direction)?;
        relaxation.prepare(now, &contacts, &tangent.blocks, &diagonal);
        let slope: f64 = cloth.order.iter().zip(&direction).map(|(&v, d)| gradient[v as usize].dot(*d)).sum();
        let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
        let first = (options.longest_move_m / longest).min(1.0);
        let mut t = first;
        let mut relaxed = 0;
        let accepted = loop {
            trial.clone_from(&x);
            for (&v, d) in cloth.order.iter().zip(&direction) {
                trial[v as usize] += *d * t;
            }
            contacts.update(&trial);
            let most = energy + ARMIJO * t * slope;
            if now.energy(&trial, &contacts) <= most {
                break true;
            }
            relaxed += 1;
            if relaxed <= RELAXED_TRIALS && relaxation.run(now, &mut contacts, &mut trial, RELAXING_TRIAL) <= most {
                break true;
            }
            t *= 0.5;
            if t < SHORTEST_STEP {
                break false;
            }
        };
        let mut largest_move_m = 0.0;
        if accepted {
            relaxation.run(now, &mut contacts, &mut trial, RELAXING);
            std::mem::swap(&mut x, &mut trial);
            largest_move_m = x.iter().zip(&trial).map(|(x, before)| x.distance(*before)).fold(0.0, f64::max);
            iteration += 1;
        } else {
            contacts.update(&x);
            // A bearing Hessian may point nowhere useful, and the softened cloth need not settle.
            if !tangent.pause() && soft.take().is_none() {
                break Stop::Stalled;
            }
        }
        contacts.friction_refresh(&x);
        energy = soft.as_ref().unwrap_or(cloth).gradient(&x, &contacts, &mut gradient);
        residual = norm(&gradient) / cloth.weight;
        if soft.is_some() && residual < SOFT_TOLERANCE {
            soft = None;
            fresh = true;
            damping = options.damping;
            energy = cloth.gradient(&x, &contacts, &mut gradient);
            residual = norm(&gradient) / cloth.weight;
        } else if t >= first {
            damping = (damping * if residual < CLOSE { 0.1 } else { 0.5 }).max(LEAST_DAMPING);
        } else if t < 0.3 * first {
            damping = (damping * 2.0).min(MOST_DAMPING);
        }
        if accepted {
            history.push(Record {
                iteration,
                energy,
                residual_over_weight: residual,
                step_length: t,
                largest_move_m,
                damping,
                softened: soft.is_some(),
            });
        }
    };
    if soft.is_some() {
        energy = cloth.gradient(&x, &contacts, &mut gradient);
        residual = norm(&gradient) / cloth.weight;
    }
    let contact_stiffness = contacts.stiffness();
    Ok(Refined {
        positions: x,
        energy,
        residual_over_weight: residual,
        steps: iteration,
        history,
        stop,
        contact_stiffness,
    })
}

/// The longest side of the box about `x`, m: about the length that hangs, whichever way the cloth lies as yet.
fn extent(x: &[DVec3]) -> f64 {
    let bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = x.iter().fold(bounds, |(low, high), p| (low.min(*p), high.max(*p)));
    (high - low).max_element().max(0.0)
}

/// ‖g‖₂, N.
fn norm(gradient: &[DVec3]) -> f64 {
    gradient.iter().map(|g| g.length_squared()).sum::<f64>().sqrt()
}
