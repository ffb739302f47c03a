//! The ring of triangles about an inner vertex, flattened in the frame of weft and warp, and the second derivatives fitted over it.
//!
//! **Flattening.** Each triangle brings its own flat shape. About an inner vertex these shapes are laid side by side. Where their angles
//! do not sum to 2π (a dart, a rest shape that is not flat) all angles are scaled until they do. The frame is turned so that the
//! weft is the mean of the wefts of the triangles, taken as lines: a panel sewn on upside down counts the same.
//!
//! **Fit.** f(p) − f(0) ≈ g·p + ½ f_uu p_u² + f_uv p_u p_v + ½ f_vv p_v², by least squares with 1/|p|² as the weight of a
//! spoke, gives f_uu, f_uv, f_vv as fixed combinations of the values at the ends of the spokes: the weights, 1/m², with which
//! [`Bending`](super::bending::Bending) sums positions.
//!
//! Limits: where a sliver is subdivided two vertices may be a micrometre apart, and the fit would couple them 10⁸ times as stiffly as
//! others. The weights of such a ring are scaled down ([`MIN_SPOKE`], [`MAX_WEIGHT`]), so the cloth bends too softly there.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::base::math;
use crate::mesh::{RestShape, TriMesh};

/// Ridge of the least squares, relative to the trace. A ring of four spokes does not determine x_uv, which then stays zero; a good ring
/// changes by less than this.
const RIDGE: f64 = 1e-6;

/// Shortest spoke of a regular ring, in mean spokes. A ring with a shorter one lies at a sliver: its weights are scaled until none exceeds
/// [`MAX_WEIGHT`] over the square of the mean. Regular rings exceed that too; limiting them as well makes a cantilever bend too softly.
const MIN_SPOKE: f64 = 0.02;

/// See [`MIN_SPOKE`]. Of two garments with subdivided slivers both converge at 10 and one at 50; with all short spokes omitted, the other.
const MAX_WEIGHT: f64 = 10.0;

/// The ring of an inner vertex.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VertexRing {
    /// The neighbours, counter-clockwise.
    pub neighbours: Vec<u32>,
    /// Position of each relative to the vertex, m: x along the weft, y along the warp.
    pub spokes: Vec<DVec2>,
}

/// One triangle seen from one of its corners.
#[derive(Debug, Clone, Copy)]
struct Slice {
    from: u32,
    to: u32,
    /// The spokes to `from` and `to` in the flat frame of the triangle, m.
    spokes: [DVec2; 2],
}

impl VertexRing {
    /// The ring of each vertex; `None` at the boundary, at a vertex of no triangle, and where the mesh is non-manifold.
    #[must_use]
    pub(crate) fn all(mesh: &TriMesh, rest: &RestShape) -> Vec<Option<Self>> {
        let mut slices: Vec<Vec<Slice>> = vec![Vec::new(); mesh.vertex_count()];
        for (triangle, flat) in mesh.triangles.iter().zip(&rest.corners) {
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let spokes = [flat[j] - flat[i], flat[k] - flat[i]];
                slices[triangle[i] as usize].push(Slice { from: triangle[j], to: triangle[k], spokes });
            }
        }
        slices.par_iter().with_min_len(256).map(|around| Self::closed(around)).collect()
    }

    /// The ring of these triangles; `None` if they do not form one closed ring.
    fn closed(around: &[Slice]) -> Option<Self> {
        let first = around.first()?;
        let mut at = first;
        let mut turned = Vec::with_capacity(around.len());
        let mut angle = 0.0;
        for step in 0..around.len() {
            turned.push((at, angle));
            angle += math::atan2(at.spokes[0].perp_dot(at.spokes[1]).abs(), at.spokes[0].dot(at.spokes[1]));
            let mut next = around.iter().filter(|s| s.from == at.to);
            let (found, another) = (next.next()?, next.next());
            if another.is_some() || (found.from == first.from) != (step + 1 == around.len()) {
                return None;
            }
            at = found;
        }
        let scale = std::f64::consts::TAU / angle;
        // The mean of doubled angles is the mean of lines without a direction.
        let turn: DVec2 =
            turned.iter().map(|(s, beta)| math::unit(2.0 * (math::angle(s.spokes[0]) - beta * scale))).sum();
        let weft = 0.5 * math::angle(turn);
        let spokes = turned.iter().map(|(s, beta)| math::unit(beta * scale + weft) * s.spokes[0].length());
        Some(Self { neighbours: turned.iter().map(|(s, _)| s.from).collect(), spokes: spokes.collect() })
    }

    /// Weights of x_uu, x_uv, x_vv at the ends of the spokes; the weight of the centre is minus their sum. `None` where the spokes determine none.
    pub(super) fn second_derivatives(&self) -> Option<Vec<DVec3>> {
        let spokes = &self.spokes;
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
        // No ridge on the gradient, so that a flat cloth has no curvature at any slope.
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
        if spokes.iter().all(|p| p.length() > MIN_SPOKE * scale) {
            return Some(weights);
        }
        let largest = weights.iter().map(|w| w.length()).fold(0.0, f64::max);
        Some(weights.into_iter().map(|w| w * (MAX_WEIGHT * per_area / largest).min(1.0)).collect())
    }
}

/// The lower factor L of a symmetric matrix L Lᵀ; `None` where it is not positive definite. A library's factorisation is slower at this size.
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
