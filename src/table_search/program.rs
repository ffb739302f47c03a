//! The dynamic program over candidate bounds: least error for every number of PARTs.

use super::front::{Front, FrontPoint};
use super::intervals::Cost;

/// The Pareto front from `costs` (row a: levels [a, a + 1), [a, a + 2), ...) and the inner bounds in cm.
pub(super) fn front(costs: &[Vec<Cost>], inner_cm: &[f64], max_parts: usize) -> Front {
    let bins = costs.len();
    let width = max_parts + 1;
    // error[b * width + p]: E(b, p); from[...]: the lower bound of its last level.
    let mut error = vec![f64::INFINITY; (bins + 1) * width];
    let mut from = vec![0u32; (bins + 1) * width];
    error[0] = 0.0;
    for upper in 1..=bins {
        let (before, after) = error.split_at_mut(upper * width);
        let (after, from) = (&mut after[..width], &mut from[upper * width..(upper + 1) * width]);
        for lower in 0..upper {
            let cost = costs[lower][upper - lower - 1];
            let parts = cost.parts as usize;
            if parts > max_parts {
                continue;
            }
            let reach = &before[lower * width..(lower + 1) * width - parts];
            for ((best, from), &below) in after[parts..].iter_mut().zip(&mut from[parts..]).zip(reach) {
                // Strictly less: of equals the lowest bound stays, which is the table with fewer levels.
                if below + cost.error < *best {
                    *best = below + cost.error;
                    *from = lower as u32;
                }
            }
        }
    }
    let mut points = Vec::new();
    let mut least = f64::INFINITY;
    for parts in 0..=max_parts {
        let squared = error[bins * width + parts];
        if squared < least {
            least = squared;
            let inner_bounds_cm = bounds(costs, &from, inner_cm, parts, width);
            points.push(FrontPoint { parts, rms_m: squared.max(0.0).sqrt(), inner_bounds_cm, extent_m: None });
        }
    }
    Front { points }
}

/// The inner bounds of the best table with `parts` PARTs, read back from the end.
fn bounds(costs: &[Vec<Cost>], from: &[u32], inner_cm: &[f64], mut parts: usize, width: usize) -> Vec<f64> {
    let mut upper = costs.len();
    let mut found = Vec::new();
    while upper > 0 {
        let lower = from[upper * width + parts] as usize;
        parts -= costs[lower][upper - lower - 1].parts as usize;
        if lower > 0 {
            found.push(inner_cm[lower - 1]);
        }
        upper = lower;
    }
    found.reverse();
    found
}
