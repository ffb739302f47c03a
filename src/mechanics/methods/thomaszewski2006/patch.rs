//! The control vertices of a triangle of the limit surface and the weights of their derivatives at its centre.
//!
//! One step of Loop's subdivision around a triangle makes its middle child regular for any valences of its
//! corners: the child's corners are edge points. At the centre, the one quadrature point, Stam's evaluation therefore
//! needs a single subdivision step and no eigenvectors: the twelve control vertices of the middle child as combinations
//! of the garment's vertices, times the box spline's functions. On a regular patch the result equals that of
//! its own box spline.
//!
//! Boundaries are closed by mirrored vertices: beyond the edge ab of the triangle abc lies a + b − c.
//!
//! Vertex points: (1 − n β) v + β Σ ring, β = (5/8 − (3/8 + ¼ cos 2π/n)²)/n (Loop 1987); edge points: ⅜ (a + b) + ⅛ (c
//! + d).
//!
//! The twelve functions of a regular patch are quartic box splines. With the barycentric coordinates p, q, r of a triangle, twelve
//! times the functions of the corner p, of the vertex across the edge pq, and of the vertex beside p next to that one are the
//! polynomials [`CORNER`], [`ACROSS`] and [`BESIDE`]; the others follow by symmetry (Stam: "Evaluation of Loop subdivision surfaces",
//! SIGGRAPH 1998 course notes; Loop: "Smooth subdivision surfaces based on triangles", 1987).

use glam::{DMat3, DVec3};

use crate::base::math;
use crate::mesh::{NONE, Topology, TriMesh};

/// A combination of the garment's vertices.
pub(super) type Stencil = Vec<(u32, f64)>;

/// First and second derivatives by the parameters s, t of one control vertex's function: [s, t, ss, st, tt].
pub(super) type Derivatives = [f64; 5];

/// The neighbours of a vertex, counter-clockwise.
#[derive(Debug, Clone, Default)]
pub(super) struct VertexFan {
    /// The neighbours in order; on a boundary from one edge to the other.
    pub(super) ring: Vec<u32>,
    /// Whether the fan is closed.
    pub(super) closed: bool,
}

/// Why a mesh has no limit surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Irregular {
    /// An edge with more than two triangles.
    Edge([u32; 2]),
    /// A vertex whose triangles do not form a single fan.
    Vertex(u32),
}

/// The fans of all vertices.
pub(super) fn all_fans(mesh: &TriMesh, topology: &Topology) -> Result<Vec<VertexFan>, Irregular> {
    if let Some(at) = topology.edge_valence.iter().position(|&v| v > 2) {
        return Err(Irregular::Edge(topology.edges[at]));
    }
    let n = mesh.vertex_count();
    let mut first = vec![NONE; n];
    let mut count = vec![0usize; n];
    for (t, triangle) in (0u32..).zip(&mesh.triangles) {
        for &v in triangle {
            first[v as usize] = if first[v as usize] == NONE { t } else { first[v as usize] };
            count[v as usize] += 1;
        }
    }
    (0..n as u32).map(|v| fan(mesh, topology, v, first[v as usize], count[v as usize])).collect()
}

/// The vertices of triangle `t` that follow `v`.
fn after(mesh: &TriMesh, t: u32, v: u32) -> Option<[u32; 2]> {
    let triangle = mesh.triangles[t as usize];
    let i = triangle.iter().position(|&c| c == v)?;
    Some([triangle[(i + 1) % 3], triangle[(i + 2) % 3]])
}

/// The other triangle at the edge from `v` to `w`.
pub(super) fn beyond(topology: &Topology, t: u32, v: u32, w: u32) -> Option<u32> {
    let [s, other] = topology.edge_triangles[topology.edge_between(v, w)?];
    [s, other].into_iter().find(|&s| s != t && s != NONE)
}

fn fan(mesh: &TriMesh, topology: &Topology, v: u32, first: u32, count: usize) -> Result<VertexFan, Irregular> {
    if first == NONE {
        return Ok(VertexFan::default());
    }
    // Back to the first triangle of an open fan.
    let mut start = first;
    for _ in 0..count {
        let next = after(mesh, start, v).and_then(|[w, _]| beyond(topology, start, v, w));
        match next {
            Some(t) if t != first => start = t,
            _ => break,
        }
    }
    let mut fan = VertexFan::default();
    let mut t = start;
    for turned in 1..=count {
        let Some([w, u]) = after(mesh, t, v) else { return Err(Irregular::Vertex(v)) };
        fan.ring.push(w);
        match beyond(topology, t, v, u) {
            Some(next) if next == start && turned == count => fan.closed = true,
            Some(next) if next != start => t = next,
            // Back too early, which inconsistent orientations cause.
            Some(_) => break,
            None => {
                fan.ring.push(u);
                return if turned == count { Ok(fan) } else { Err(Irregular::Vertex(v)) };
            }
        }
    }
    if fan.closed { Ok(fan) } else { Err(Irregular::Vertex(v)) }
}

/// a + b − c.
fn mirrored(a: u32, b: u32, c: u32) -> Stencil {
    vec![(a, 1.0), (b, 1.0), (c, -1.0)]
}

/// The ring of a vertex with its mirrored vertices, closed.
fn extended(v: u32, fan: &VertexFan) -> Vec<Stencil> {
    let ring = &fan.ring;
    let mut all: Vec<Stencil> = ring.iter().map(|&w| vec![(w, 1.0)]).collect();
    if let (false, [first, second, .., before, last]) | (false, [first, before @ second, last]) =
        (fan.closed, ring.as_slice())
    {
        all.extend([mirrored(v, *last, *before), mirrored(v, *first, *second)]);
    } else if let (false, [first, last]) = (fan.closed, ring.as_slice()) {
        all.extend([mirrored(v, *last, *first), mirrored(v, *first, *last)]);
    }
    all
}

fn add(to: &mut Stencil, from: &Stencil, share: f64) {
    for &(v, w) in from {
        match to.iter_mut().find(|(known, _)| *known == v) {
            Some((_, sum)) => *sum += share * w,
            None => to.push((v, share * w)),
        }
    }
}

fn combined(parts: &[(&Stencil, f64)]) -> Stencil {
    let mut out = Stencil::new();
    parts.iter().for_each(|(part, share)| add(&mut out, part, *share));
    out
}

/// Loop's β for a valence.
fn beta(n: usize) -> f64 {
    let cosine = math::cos(std::f64::consts::TAU / n as f64);
    (0.625 - (0.375 + 0.25 * cosine).powi(2)) / n as f64
}

/// The point of the limit surface at a vertex: (1 − n l) v + l Σ ring, l = 1/(n + 3/(8β)).
pub(super) fn limit_stencil(v: u32, fan: &VertexFan) -> Stencil {
    let ring = extended(v, fan);
    let n = ring.len();
    if n == 0 {
        return vec![(v, 1.0)];
    }
    let l = 1.0 / (n as f64 + 0.375 / beta(n));
    let mut out = vec![(v, 1.0 - n as f64 * l)];
    ring.iter().for_each(|w| add(&mut out, w, l));
    out
}

/// The control vertices of a triangle with the derivatives of their functions at its centre, by s = λ₁ and t = λ₂;
/// vertices ascending.
pub(super) fn derivatives(triangle: [u32; 3], fans: &[VertexFan]) -> Option<Vec<(u32, Derivatives)>> {
    let mut sums: Vec<(u32, Derivatives)> = Vec::with_capacity(16);
    // Child coordinates μ = 1 − 2 λ.
    let (s, t) = (DVec3::new(2.0, -2.0, 0.0), DVec3::new(2.0, 0.0, -2.0));
    let mut take = |point: Stencil, f: CentreJet| {
        let d = [f.along(s), f.along(t), f.twice(s, s), f.twice(s, t), f.twice(t, t)];
        for (v, w) in point {
            let at = sums.binary_search_by_key(&v, |known| known.0).unwrap_or_else(|at| {
                sums.insert(at, (v, [0.0; 5]));
                at
            });
            sums[at].1.iter_mut().zip(d).for_each(|(sum, d)| *sum += w * d);
        }
    };
    for k in 0..3 {
        let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
        let v = triangle[a];
        let fan = &fans[v as usize];
        let ring = extended(v, fan);
        let n = ring.len();
        let i = fan.ring.iter().position(|&w| w == triangle[b])?;
        let at = |j: usize| &ring[(i + n + j - 2) % n];
        // Counter-clockwise about v: far, across ab, b, c, across ca, far.
        let [far_b, across_b, next, last, across_c, far_c] = [0, 1, 2, 3, 4, 5].map(at);
        let own: Stencil = vec![(v, 1.0)];
        let beta = beta(n);
        let mut vertex_point: Stencil = vec![(v, 1.0 - n as f64 * beta)];
        ring.iter().for_each(|w| add(&mut vertex_point, w, beta));
        let edge = |p: &Stencil, q: &Stencil, c: &Stencil, d: &Stencil| {
            combined(&[(p, 0.375), (q, 0.375), (c, 0.125), (d, 0.125)])
        };
        // Corners of the child are named by the opposite corner of the triangle: the edge point of ab is corner c. Across its side from b
        // to c lies the vertex point of v; beside corner c next to it the edge point of v and the vertex across ab; beside corner b that
        // of v and the vertex across ca.
        take(edge(&own, next, last, across_b), CentreJet::of(&CORNER, [c, a, b]));
        take(vertex_point, CentreJet::of(&ACROSS, [b, c, a]));
        take(edge(&own, across_b, next, far_b), CentreJet::of(&BESIDE, [c, b, a]));
        take(edge(&own, across_c, last, far_c), CentreJet::of(&BESIDE, [b, c, a]));
    }
    Some(sums)
}

/// A term: coefficient and the powers of p, q and r.
type Term = (f64, [i32; 3]);

/// The function of the corner p.
const CORNER: [Term; 15] = [
    (6.0, [4, 0, 0]),
    (24.0, [3, 0, 1]),
    (24.0, [2, 0, 2]),
    (8.0, [1, 0, 3]),
    (1.0, [0, 0, 4]),
    (24.0, [3, 1, 0]),
    (60.0, [2, 1, 1]),
    (36.0, [1, 1, 2]),
    (6.0, [0, 1, 3]),
    (24.0, [2, 2, 0]),
    (36.0, [1, 2, 1]),
    (12.0, [0, 2, 2]),
    (8.0, [1, 3, 0]),
    (6.0, [0, 3, 1]),
    (1.0, [0, 4, 0]),
];

/// The function of the vertex across the edge from p to q.
const ACROSS: [Term; 9] = [
    (2.0, [0, 3, 1]),
    (1.0, [0, 4, 0]),
    (6.0, [1, 2, 1]),
    (6.0, [1, 3, 0]),
    (6.0, [2, 1, 1]),
    (12.0, [2, 2, 0]),
    (2.0, [3, 0, 1]),
    (6.0, [3, 1, 0]),
    (1.0, [4, 0, 0]),
];

/// The function of the vertex beside p, next to the one across the edge from p to q.
const BESIDE: [Term; 2] = [(1.0, [4, 0, 0]), (2.0, [3, 1, 0])];

/// Value, gradient and second derivatives of a function at the centre of the triangle, by the barycentric
/// coordinates of corners 0, 1, 2.
#[derive(Debug, Clone, Copy)]
struct CentreJet {
    value: f64,
    gradient: DVec3,
    second: DMat3,
}

impl CentreJet {
    /// The polynomial `terms` with the corners `p`, `q`, `r` for its coordinates.
    fn of(terms: &[Term], [p, q, r]: [usize; 3]) -> Self {
        let third = 1.0 / 3.0_f64;
        let mut out = Self { value: 0.0, gradient: DVec3::ZERO, second: DMat3::ZERO };
        for &(coefficient, powers) in terms {
            let mut by_corner = [0; 3];
            (by_corner[p], by_corner[q], by_corner[r]) = (powers[0], powers[1], powers[2]);
            let c = coefficient / 12.0;
            // Each coordinate is a third, so a term is a third to the power of its degree.
            let degree: i32 = powers.iter().sum();
            out.value += c * third.powi(degree);
            for i in 0..3 {
                let di = f64::from(by_corner[i]);
                out.gradient[i] += c * di * third.powi(degree - 1);
                for (j, &power) in by_corner.iter().enumerate() {
                    let dj = f64::from(power - i32::from(i == j));
                    out.second.col_mut(j)[i] += c * di * dj * third.powi(degree - 2);
                }
            }
        }
        out
    }

    /// The derivative along a direction in barycentric coordinates.
    fn along(&self, a: DVec3) -> f64 {
        self.gradient.dot(a)
    }

    /// The second derivative along two directions.
    fn twice(&self, a: DVec3, b: DVec3) -> f64 {
        a.dot(self.second * b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every function with its lattice point: corner 0 at (0, 0), 1 at (1, 0), 2 at (0, 1).
    fn patch() -> Vec<(CentreJet, [f64; 2])> {
        let at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0_f64]];
        let plus = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| [a[0] + b[0] - c[0], a[1] + b[1] - c[1]];
        let mut all = Vec::new();
        for p in 0..3 {
            let [q, r] = [(p + 1) % 3, (p + 2) % 3];
            all.push((CentreJet::of(&CORNER, [p, q, r]), at[p]));
            let across = plus(at[p], at[q], at[r]);
            all.push((CentreJet::of(&ACROSS, [p, q, r]), across));
            // Beside p next to the vertex across pq, and beside q next to it.
            all.push((CentreJet::of(&BESIDE, [p, q, r]), plus(at[p], across, at[q])));
            all.push((CentreJet::of(&BESIDE, [q, p, r]), plus(at[q], across, at[p])));
        }
        all
    }

    #[test]
    fn the_twelve_functions_reproduce_quadratic_polynomials() {
        let patch = patch();
        let sum = |f: &dyn Fn(&CentreJet) -> f64, g: &dyn Fn([f64; 2]) -> f64| -> f64 {
            patch.iter().map(|(n, at)| f(n) * g(*at)).sum()
        };
        let (s, t) = (DVec3::new(-1.0, 1.0, 0.0), DVec3::new(-1.0, 0.0, 1.0));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} expected {b}");
        near(sum(&|n| n.value, &|_| 1.0), 1.0);
        near(sum(&|n| n.value, &|p| p[0]), 1.0 / 3.0);
        near(sum(&|n| n.along(s), &|_| 1.0), 0.0);
        near(sum(&|n| n.along(s), &|p| p[0]), 1.0);
        near(sum(&|n| n.along(t), &|p| p[0]), 0.0);
        near(sum(&|n| n.along(t), &|p| p[1]), 1.0);
        near(sum(&|n| n.twice(s, s), &|p| p[0]), 0.0);
        near(sum(&|n| n.twice(s, s), &|p| p[0] * p[0]), 2.0);
        near(sum(&|n| n.twice(s, t), &|p| p[0] * p[1]), 1.0);
        near(sum(&|n| n.twice(t, t), &|p| p[0] * p[1]), 0.0);
        near(sum(&|n| n.twice(s, t), &|p| p[1] * p[1]), 0.0);
    }
}
