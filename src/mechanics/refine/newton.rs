//! Newton's method with a line search and Levenberg damping.

use glam::DVec3;

use super::{Observer, Record, RefineOptions, Refined, STEP_LIMIT, SolveError, Solver, Step, Stop};
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
    mut contacts: Contacts<'_>,
    start: Vec<DVec3>,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    let mut solver = Solver::new(&cloth.pattern)?;
    let masses: Vec<f64> = cloth.order.iter().map(|&v| cloth.masses[v as usize]).collect();
    let mut x = start;
    let (mut gradient, mut blocks, mut direction) = (Vec::new(), Vec::new(), Vec::new());
    let mut energy = cloth.gradient(&x, &contacts, &mut gradient);
    let mut residual = norm(&gradient) / cloth.weight;
    let mut damping = options.damping;
    let limit = options.max_steps.unwrap_or(STEP_LIMIT).min(STEP_LIMIT);
    let mut history = vec![Record {
        iteration: 0,
        energy,
        residual_over_weight: residual,
        step_length: 0.0,
        largest_move_m: 0.0,
        damping,
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
        if residual < options.tolerance {
            if contacts.penetration().0 == 0 {
                break Stop::Converged;
            }
            contacts.stiffen(4.0);
            contacts.update(&x);
            contacts.friction_refresh(&x);
            energy = cloth.gradient(&x, &contacts, &mut gradient);
        }
        if iteration >= limit {
            break Stop::StepsDone;
        }
        // After a step, `trial` holds the positions it was taken from.
        cloth.hessian_after((iteration > 0).then_some(&trial), &x, &contacts, &mut blocks);
        let diagonal: Vec<f64> = masses.iter().map(|m| m * damping).collect();
        solver.factorise(&cloth.pattern, &blocks, &diagonal)?;
        direction.clear();
        direction.extend(cloth.order.iter().map(|&v| -gradient[v as usize]));
        solver.solve(&mut direction);
        let slope: f64 = cloth.order.iter().zip(&direction).map(|(&v, d)| gradient[v as usize].dot(*d)).sum();
        let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
        let first = (options.longest_move_m / longest).min(1.0);
        let mut t = first;
        let accepted = loop {
            for (&v, d) in cloth.order.iter().zip(&direction) {
                trial[v as usize] = x[v as usize] + *d * t;
            }
            contacts.update(&trial);
            let there = cloth.energy(&trial, &contacts);
            if there <= energy + ARMIJO * t * slope {
                break true;
            }
            t *= 0.5;
            if t < SHORTEST_STEP {
                break false;
            }
        };
        if !accepted {
            contacts.update(&x);
            break Stop::Stalled;
        }
        std::mem::swap(&mut x, &mut trial);
        iteration += 1;
        contacts.friction_refresh(&x);
        energy = cloth.gradient(&x, &contacts, &mut gradient);
        residual = norm(&gradient) / cloth.weight;
        if t >= first {
            damping = (damping * 0.5).max(LEAST_DAMPING);
        } else if t < 0.3 * first {
            damping = (damping * 2.0).min(MOST_DAMPING);
        }
        history.push(Record {
            iteration,
            energy,
            residual_over_weight: residual,
            step_length: t,
            largest_move_m: t * longest,
            damping,
        });
    };
    Ok(Refined { positions: x, energy, residual_over_weight: residual, steps: iteration, history, stop })
}

/// ‖g‖₂, N.
fn norm(gradient: &[DVec3]) -> f64 {
    gradient.iter().map(|g| g.length_squared()).sum::<f64>().sqrt()
}
