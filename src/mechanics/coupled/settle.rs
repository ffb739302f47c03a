//! Newton's method for the coarse cloth, with trial points put back onto the body.
//!
//! As [`refine`](crate::mechanics::refine): (∇²E⁺ + ε M) d = −∇E, Armijo's condition, ε down with success and up without.
//! Two things differ, because a coarse node stands for a hand's breadth of cloth and meets the body suddenly:
//!
//! - A trial point that a full step throws into the body is not judged there, where contact alone would refuse it and
//!   with it the step of every other node: each node that got more than twice as deep is first moved out along ∇q to
//!   that depth, or to a quarter of the offset.
//! - Contact is soft: the pressure of a garment's weight moves a node by millimetres, not by a fraction of one. The
//!   push-out after the blend takes those back.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d | step | m |
//! | ε | damping | 1/s² |
//! | M | lumped masses | kg |

use glam::DVec3;

use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::refine::{Record, SolveError, Solver};

/// Armijo's constant: the share of the predicted decrease that a step must bring.
const ARMIJO: f64 = 1e-4;

/// Shorter steps than this are rounding.
const SHORTEST_STEP: f64 = 1e-4;

/// Depth that a trial point may have whatever it had before, over the contact offset.
const ALLOWED: f64 = 0.25;

/// Longest move of a node in one step, m: about the extent of a PART, over which the Hessian says nothing any more.
const LONGEST_MOVE: f64 = 0.1;

/// Longest move of the last step where the residual ends a solve, m: many nodes that fall freely have a small one, too.
const NEAR: f64 = 1e-2;

/// Range of the damping ε, 1/s²: from next to nothing to a millimetre's fall a step.
const DAMPING: [f64; 2] = [1e-2, 1e4];

/// Damping under which a step's length is the cloth's own: at 1/s² it would let a free node fall ten metres.
const FREE_DAMPING: f64 = 1.0;

/// A coarse cloth at rest, or as near as the steps brought it.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    /// Node positions, m.
    pub(super) positions: Vec<DVec3>,
    /// Every step, the start first.
    pub(super) history: Vec<Record>,
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    pub(super) tolerance: f64,
    pub(super) max_steps: usize,
    pub(super) damping: f64,
    pub(super) least_move_m: f64,
}

/// Settles `cloth` from `start` against `contacts`, which must be up to date there.
pub(super) fn settle(
    cloth: &Cloth,
    contacts: &mut Contacts<'_>,
    start: Vec<DVec3>,
    goal: Goal,
) -> Result<Settled, SolveError> {
    let mut solver = Solver::new(&cloth.pattern)?;
    let mut x = start;
    let mut trial = x.clone();
    let (mut gradient, mut blocks, mut direction) = (Vec::new(), Vec::new(), Vec::new());
    let mut energy = cloth.gradient(&x, contacts, &mut gradient);
    let mut damping = goal.damping;
    let mut history = vec![Record {
        iteration: 0,
        energy,
        residual_over_weight: norm(&gradient) / cloth.weight,
        step_length: 0.0,
        largest_move_m: 0.0,
        damping,
        softened: false,
    }];
    for iteration in 1..=goal.max_steps {
        let near = |h: &Record| h.residual_over_weight < goal.tolerance && h.largest_move_m < NEAR;
        if iteration > 1 && history.last().is_some_and(near) {
            break;
        }
        cloth.hessian(&x, contacts, &mut blocks);
        let diagonal: Vec<f64> = cloth.order.iter().map(|&v| cloth.masses[v as usize] * damping).collect();
        direction.clear();
        direction.extend(cloth.order.iter().map(|&v| -gradient[v as usize]));
        solver.solve(&cloth.pattern, &blocks, &diagonal, true, &mut direction)?;
        let slope: f64 = cloth.order.iter().zip(&direction).map(|(&v, d)| gradient[v as usize].dot(*d)).sum();
        let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
        let first = (LONGEST_MOVE / longest).min(1.0);
        let depth = depths(contacts, x.len());
        let mut t = first;
        let accepted = loop {
            for (&v, d) in cloth.order.iter().zip(&direction) {
                trial[v as usize] = x[v as usize] + *d * t;
            }
            contacts.update(&trial);
            if put_back(contacts, &depth, ALLOWED * cloth.offset, &mut trial) {
                contacts.update(&trial);
            }
            if cloth.energy(&trial, contacts) <= energy + ARMIJO * t * slope {
                break true;
            }
            t *= 0.5;
            if t < SHORTEST_STEP * first {
                break false;
            }
        };
        if accepted {
            std::mem::swap(&mut x, &mut trial);
        } else {
            contacts.update(&x);
        }
        if t >= first {
            damping *= 0.5;
        } else if t < 0.3 * first {
            damping *= 2.0;
        }
        // A whole, hardly damped step under the goal's length: what is left to move shows in no preview.
        let still = t >= 1.0 && longest < goal.least_move_m && damping <= FREE_DAMPING;
        let done = still || !accepted && damping >= DAMPING[1];
        damping = damping.clamp(DAMPING[0], DAMPING[1]);
        contacts.friction_refresh(&x);
        energy = cloth.gradient(&x, contacts, &mut gradient);
        history.push(Record {
            iteration,
            energy,
            residual_over_weight: norm(&gradient) / cloth.weight,
            step_length: if accepted { t } else { 0.0 },
            largest_move_m: if accepted { t * longest } else { 0.0 },
            damping,
            softened: false,
        });
        if done {
            break;
        }
    }
    Ok(Settled { positions: x, history })
}

/// Depth of each node below the contact offset, m; zero where it does not touch.
fn depths(contacts: &Contacts<'_>, nodes: usize) -> Vec<f64> {
    let mut depth = vec![0.0; nodes];
    for touch in contacts.touches() {
        depth[touch.vertex as usize] = touch.depth;
    }
    depth
}

/// Moves what is more than twice as deep as it was to that depth, or to `allowed`; returns whether anything moved.
fn put_back(contacts: &Contacts<'_>, before: &[f64], allowed: f64, x: &mut [DVec3]) -> bool {
    let mut moved = false;
    for touch in contacts.touches() {
        let most = allowed.max(2.0 * before[touch.vertex as usize]);
        if touch.depth > most {
            x[touch.vertex as usize] += touch.normal * (touch.depth - most);
            moved = true;
        }
    }
    moved
}

/// ‖g‖₂, N.
fn norm(gradient: &[DVec3]) -> f64 {
    gradient.iter().map(|g| g.length_squared()).sum::<f64>().sqrt()
}
