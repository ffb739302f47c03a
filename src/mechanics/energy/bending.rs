//! Bending: the cost of the cloth's second derivatives along weft and warp.
//!
//! A quadratic fitted over the flattened ring of each inner vertex gives x_uu, x_uv and x_vv as fixed combinations of
//! the ring's positions. For a cloth that bends without stretching |x_uu|, |x_vv| are its curvatures, and
//!
//! E = Σ ½ A_i (B_u |x_uu|² + H |x_uv|² + B_v |x_vv|²), H = 4 B_45 − B_u − B_v,
//!
//! is a thin plate's energy whose stiffness towards weft, bias and warp is the measured B_u, B_45, B_v: exact for a
//! cylinder in any direction on any mesh. It is quadratic in x (as in Bergou, Wardetzky, Harmon, Zorin, Grinspun: "A quadratic
//! bending model for inextensible surfaces", SGP 2006), so its Hessian is constant: a scalar per pair of vertices. One
//! hinge per edge would be cheaper, but is up to three times too stiff, depending on the direction of the edges.
//!
//! A triangle without an inner vertex (a corner, a belt one triangle wide) is in no ring; each of its edges has a hinge,
//! ½ 2B/(A₀ + A₁) |Σ c_i x_i|² with the cotangent weights c_i of the same paper. This is too stiff: B/(A₀ + A₁) over all edges gives a sheet of equilateral
//! triangles the stiffness B, and a belt 0.9 B.
//!
//! Where fabrics meet, a ring or hinge has their mean by area. Along the seam this is exact. Across it, where the softer side would bend
//! more, it is an upper bound; a real seam with its allowances is stiffer than the cloth beside it, too.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A_i | rest area, each triangle's shared among its inner vertices | m² |
//! | B_u, B_45, B_v | bending stiffness along weft, bias and warp | N·m |
//! | x_uu, x_uv, x_vv | second derivatives of the position | 1/m |
//!
//! Limits: flat rest; one stiffness at all curvatures. Friction between yarns is a separate term (`bending_friction`).

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::bending_friction::BendingFriction;
use super::bending_matrix::BendingMatrix;
use super::vertex_ring::VertexRing;
use crate::garment::fabric::Fabric;
use crate::mesh::{RestShape, Topology, TriMesh};

/// Least H as a share of B_u + B_v, so that a saddle has a positive energy. Heuristic.
const MIN_TWIST: f64 = 0.1;

/// All bending elements of a cloth, as rows of weights over a few vertices each, and their sum as a matrix.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bending {
    elements: Vec<Element>,
    vertices: Vec<u32>,
    weights: Vec<DVec3>,
    /// The sum of all elements.
    pub(super) matrix: BendingMatrix,
    /// Friction between yarns.
    pub(super) friction: BendingFriction,
}

/// One ring or hinge: its range of the weights, and its stiffness A·(B_u, H, B_v), N·m³.
#[derive(Debug, Clone, Copy)]
struct Element {
    start: u32,
    end: u32,
    stiffness: DVec3,
}

impl Bending {
    /// The rings and hinges of a mesh in its rest shape.
    #[must_use]
    pub(crate) fn new(mesh: &TriMesh, topology: &Topology, rest: &RestShape, fabrics: &[Fabric]) -> Self {
        let stiffness: Vec<DVec3> = fabrics.iter().map(bending_stiffness).collect();
        let rings = VertexRing::all(mesh, rest);
        let mut bending = Self::default();
        let mut share = vec![vec![0.0; mesh.vertex_count()]; fabrics.len()];
        let mut bare = vec![false; mesh.triangles.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let corners = voronoi(rest.corners[t]);
            let inner = || triangle.iter().zip(corners).filter(|&(&v, _)| rings[v as usize].is_some());
            let sum: f64 = inner().map(|(_, part)| part).sum();
            bare[t] = sum == 0.0;
            let [a, b, c] = rest.corners[t];
            let area = 0.5 * (b - a).perp_dot(c - a).abs();
            let share = &mut share[rest.fabric_of(t)];
            for (&v, part) in inner() {
                share[v as usize] += area * part / sum;
            }
        }
        let weights_of = |ring: &Option<VertexRing>| ring.as_ref().and_then(VertexRing::second_derivatives);
        let weights: Vec<Option<Vec<DVec3>>> = rings.par_iter().with_min_len(64).map(weights_of).collect();
        for (v, (ring, weights)) in rings.iter().zip(weights).enumerate() {
            if let (Some(ring), Some(weights)) = (ring, weights) {
                let whole = stiffness.iter().zip(&share).map(|(stiffness, share)| *stiffness * share[v]).sum();
                bending.push_ring(v as u32, ring, weights, whole);
                bending.add_friction(fabrics, share.iter().map(|share| share[v]));
            }
        }
        let mean: Vec<f64> = fabrics.iter().map(Fabric::mean_bending_nm).collect();
        let inner = topology.edges.iter().zip(&topology.edge_triangles).zip(&topology.edge_valence);
        for ((&edge, &[s, t]), &valence) in inner {
            if valence > 1 && (bare[s as usize] || bare[t as usize]) {
                bending.push_hinge(mesh, rest, edge, [s, t], &mean);
            }
        }
        bending.matrix = BendingMatrix::new(mesh.vertex_count(), &bending.elements().collect::<Vec<_>>());
        bending
    }

    fn push_ring(&mut self, centre: u32, ring: &VertexRing, weights: Vec<DVec3>, stiffness: DVec3) {
        let start = self.vertices.len() as u32;
        self.vertices.push(centre);
        self.weights.push(-weights.iter().copied().sum::<DVec3>());
        self.vertices.extend(&ring.neighbours);
        self.weights.extend(weights);
        self.elements.push(Element { start, end: self.vertices.len() as u32, stiffness });
    }

    /// Gives the last ring its friction.
    fn add_friction(&mut self, fabrics: &[Fabric], shares: impl Iterator<Item = f64>) {
        if let Some(Element { start, .. }) = self.elements.last() {
            let (vertices, weights) = (&self.vertices[*start as usize..], &self.weights[*start as usize..]);
            self.friction.push(vertices, weights, fabrics, shares);
        }
    }

    fn push_hinge(&mut self, mesh: &TriMesh, rest: &RestShape, [a, b]: [u32; 2], wings: [u32; 2], mean: &[f64]) {
        let mut weights = [0.0; 4];
        let mut vertices = [a, b, a, b];
        let (mut area, mut excess) = (0.0, 0.0);
        let of_first = mean[rest.fabric_of(wings[0] as usize)];
        for (k, t) in wings.map(|t| t as usize).into_iter().enumerate() {
            let at = |v: u32| mesh.triangles[t].iter().position(|&c| c == v);
            let (Some(i), Some(j)) = (at(a), at(b)) else { return };
            let tip = 3 - i - j;
            let [p, q, r] = [i, j, tip].map(|c| rest.corners[t][c]);
            let cot = |s: DVec2, t: DVec2| s.dot(t) / s.perp_dot(t).abs();
            let (at_a, at_b) = (cot(q - p, r - p), cot(p - q, r - q));
            weights[0] += at_b;
            weights[1] += at_a;
            weights[2 + k] = -at_a - at_b;
            vertices[2 + k] = mesh.triangles[t][tip];
            let own = 0.5 * (q - p).perp_dot(r - p).abs();
            area += own;
            excess += own * (mean[rest.fabric_of(t)] - of_first);
        }
        let b_mean = of_first + excess / area;
        let start = self.vertices.len() as u32;
        self.vertices.extend(vertices);
        self.weights.extend(weights.map(|w| DVec3::X * w));
        self.elements.push(Element { start, end: start + 4, stiffness: DVec3::X * (2.0 * b_mean / area) });
    }

    /// Vertices, weights of x_uu, x_uv, x_vv, and stiffness A·(B_u, H, B_v) of every element.
    pub(crate) fn elements(&self) -> impl Iterator<Item = (&[u32], &[DVec3], DVec3)> + '_ {
        (0..self.len()).map(|i| self.element(i))
    }

    /// One of [`elements`](Self::elements).
    pub(crate) fn element(&self, i: usize) -> (&[u32], &[DVec3], DVec3) {
        let Element { start, end, stiffness } = self.elements[i];
        let range = start as usize..end as usize;
        (&self.vertices[range.clone()], &self.weights[range], stiffness)
    }

    /// Number of elements.
    pub(crate) fn len(&self) -> usize {
        self.elements.len()
    }

    /// Energy of all elements one by one, J: the reference for [`BendingMatrix`].
    #[cfg(test)]
    pub(crate) fn energy(&self, x: &[DVec3]) -> f64 {
        let energy = |(vertices, weights, stiffness): (&[u32], &[DVec3], DVec3)| {
            let mut d = [DVec3::ZERO; 3];
            for (&v, w) in vertices.iter().zip(weights) {
                for (d, w) in d.iter_mut().zip(w.to_array()) {
                    *d += x[v as usize] * w;
                }
            }
            0.5 * stiffness.dot(DVec3::from(d.map(DVec3::length_squared)))
        };
        self.elements().map(energy).sum()
    }
}

/// (B_u, H, B_v), N·m.
pub(crate) fn bending_stiffness(fabric: &Fabric) -> DVec3 {
    let [weft, bias, warp] = fabric.bending_nm;
    DVec3::new(weft, (4.0 * bias - weft - warp).max(MIN_TWIST * (weft + warp)), warp)
}

/// Share of each corner in the area of a triangle: its Voronoi cell, or halves and quarters where the cell leaves the triangle (Meyer,
/// Desbrun, Schröder, Barr: "Discrete differential-geometry operators for triangulated 2-manifolds", 2003). With a third each, the weight
/// of a vertex would depend on its valence, and a strip would bend more at vertices of low valence.
fn voronoi(corners: [DVec2; 3]) -> [f64; 3] {
    let side = |i: usize| (corners[(i + 2) % 3] - corners[(i + 1) % 3]).length_squared();
    let squares = [side(0), side(1), side(2)];
    let total: f64 = squares.iter().sum();
    if let Some(obtuse) = (0..3).find(|&i| 2.0 * squares[i] > total) {
        return std::array::from_fn(|i| if i == obtuse { 0.5 } else { 0.25 });
    }
    // Cell of corner i: (b² cot B + c² cot C)/8 with cot B = (a² + c² − b²)/4A; over A, up to the factor common to all.
    let part = |i: usize| {
        let (b, c) = (squares[(i + 1) % 3], squares[(i + 2) % 3]);
        b * (total - 2.0 * b) + c * (total - 2.0 * c)
    };
    let parts = [part(0), part(1), part(2)];
    parts.map(|p| p / parts.iter().sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    /// Subdivides a triangle into three by a point next to its first side.
    fn cut(mesh: &mut TriMesh, t: usize) {
        let ([a, b, c], [at_a, at_b, at_c]) = (mesh.triangles[t], mesh.corners(t));
        let (middle, m) = (0.5 * (at_a + at_b), mesh.positions.len() as u32);
        mesh.positions.push(middle.lerp(at_c, 1e-3));
        mesh.triangles[t] = [a, m, c];
        mesh.triangles.extend([[m, b, c], [a, b, m]]);
    }

    #[test]
    fn a_subdivided_sliver_does_not_stiffen_the_bending() {
        let mut mesh = sheet(6, 6, |i, j| DVec3::new(i, 0.0, j) * 0.01);
        let stiffest = |mesh: &TriMesh| {
            let rest = RestShape::from_edges(mesh).unwrap();
            let denim = Fabric::by_name("denim").unwrap();
            let bending = Bending::new(mesh, &Topology::new(mesh), &rest, &[denim]);
            bending.elements().flat_map(|(_, w, k)| w.iter().map(move |w| k.dot(*w * *w))).fold(0.0, f64::max)
        };
        let plain = stiffest(&mesh);
        cut(&mut mesh, 30);
        cut(&mut mesh, 73);
        assert!(stiffest(&mesh) < 100.0 * plain, "{} N/m, without {plain}", stiffest(&mesh));
    }
}
