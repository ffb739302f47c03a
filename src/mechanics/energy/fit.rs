//! The second derivatives at a ring's centre, from a quadratic fitted over its spokes.
//!
//! f(p) − f(0) ≈ g·p + ½ f_uu p_u² + f_uv p_u p_v + ½ f_vv p_v², least squares with 1/|p|² as a spoke's weight, gives f_uu, f_uv, f_vv
//! as fixed combinations of the values on the spokes' ends: the weights, 1/m², that [`Bending`](super::bending::Bending) sums positions with.
//!
//! Limits: a spoke weighs as the inverse square of its length. Where a sliver is cut again two vertices may be a micrometre apart,
//! and would be tied 10⁸ times as stiffly as others: such a ring counts less ([`SHORT`], [`MOST`]), so cloth bends too softly there.

use glam::{DVec2, DVec3};

/// Ridge of the least squares, relative to the diagonal: a ring of four spokes does not determine x_uv, which then stays
/// zero; a good ring changes by less than this.
const RIDGE: f64 = 1e-6;

/// Where a spoke is no longer than this share of the mean, the ring is one at a sliver, and is scaled until none of its weights is above
/// [`MOST`] over the mean's square. Sound rings reach that too: bounded as well, a cantilever bends too softly.
const SHORT: f64 = 0.02;

/// See [`SHORT`]. Of two garments with slivers cut again both come to rest at 10, one at 50; without such spokes, the other.
const MOST: f64 = 10.0;

/// Weights of x_uu, x_uv, x_vv on the spokes' ends; the centre's is minus their sum; `None` where they fix none.
pub(super) fn second_derivatives(spokes: &[DVec2]) -> Option<Vec<DVec3>> {
    let scale = spokes.iter().map(|p| p.length()).sum::<f64>() / spokes.len() as f64;
    let rows: Vec<([f64; 5], f64)> = spokes
        .iter()
        .map(|p| {
            let q = *p / scale;
            ([q.x, q.y, 0.5 * q.x * q.x, q.x * q.y, 0.5 * q.y * q.y], 1.0 / q.length_squared())
        })
        .collect();
    let mut normal = [[0.0; 5]; 5];
    for (row, weight) in &rows {
        for i in 0..5 {
            for j in 0..5 {
                normal[i][j] += weight * row[i] * row[j];
            }
        }
    }
    let trace: f64 = (0..5).map(|i| normal[i][i]).sum();
    // None on the gradient, so that a flat cloth, however it lies, has no curvature.
    for (i, row) in normal.iter_mut().enumerate().skip(2) {
        row[i] += RIDGE * trace;
    }
    let factor = cholesky(normal)?;
    let per_area = 1.0 / (scale * scale);
    let fit = |(row, weight): &([f64; 5], f64)| {
        let [_, _, uu, uv, vv] = substitute(&factor, row.map(|r| r * weight));
        DVec3::new(uu, uv, vv) * per_area
    };
    let weights: Vec<DVec3> = rows.iter().map(fit).collect();
    if spokes.iter().all(|p| p.length() > SHORT * scale) {
        return Some(weights);
    }
    let most = weights.iter().map(|w| w.length()).fold(0.0, f64::max);
    Some(weights.into_iter().map(|w| w * (MOST * per_area / most).min(1.0)).collect())
}

/// The lower factor L of a symmetric matrix L Lᵀ; `None` where it is not positive. Too small, and one a vertex, for a library's.
fn cholesky(mut m: [[f64; 5]; 5]) -> Option<[[f64; 5]; 5]> {
    for j in 0..5 {
        for i in j..5 {
            let sum: f64 = (0..j).map(|k| m[i][k] * m[j][k]).sum();
            let left = m[i][j] - sum;
            if i > j {
                m[i][j] = left / m[j][j];
            } else if left > 0.0 {
                m[j][j] = left.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(m)
}

/// Solves L Lᵀ x = b.
fn substitute(l: &[[f64; 5]; 5], mut b: [f64; 5]) -> [f64; 5] {
    for i in 0..5 {
        let sum: f64 = (0..i).map(|k| l[i][k] * b[k]).sum();
        b[i] = (b[i] - sum) / l[i][i];
    }
    for i in (0..5).rev() {
        let sum: f64 = (i + 1..5).map(|k| l[k][i] * b[k]).sum();
        b[i] = (b[i] - sum) / l[i][i];
    }
    b
}
