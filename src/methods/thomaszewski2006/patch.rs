//! The control vertices of a triangle of the limit surface and the weights of their derivatives at its middle.
//!
//! One step of Loop's subdivision around a triangle makes its middle child regular, whatever the valences of its
//! corners: the child's corners are edge points. So at the middle, where the one quadrature point is, Stam's evaluation
//! needs a single subdivision step and no eigenvectors: the twelve control vertices of the middle child as combinations
//! of the garment's vertices, times the box spline's functions. Where the patch is regular this is the same number as
//! its own box spline would give.
//!
//! Boundaries are closed by mirrored vertices: beyond the edge ab of the triangle abc lies a + b − c.
//!
//! Vertex points: (1 − n β) v + β Σ ring, β = (5/8 − (3/8 + ¼ cos 2π/n)²)/n (Loop 1987); edge points: ⅜ (a + b) + ⅛ (c
//! + d).

use glam::DVec3;

use super::box_spline::{ACROSS, AtMiddle, BESIDE, CORNER};
use crate::mesh::{NONE, Topology, TriMesh};

/// A combination of the garment's vertices.
pub(super) type Stencil = Vec<(u32, f64)>;

/// First and second derivatives by the parameters s, t of one control vertex's function: [s, t, ss, st, tt].
pub(super) type Derivatives = [f64; 5];

/// The triangles around a vertex, counter-clockwise.
#[derive(Debug, Clone, Default)]
pub(super) struct Around {
    /// Its neighbours in order; on a boundary from one edge to the other.
    pub(super) ring: Vec<u32>,
    /// Whether they close.
    pub(super) closed: bool,
}

/// Why a mesh has no limit surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Irregular {
    /// An edge of more than two triangles.
    Edge([u32; 2]),
    /// A vertex whose triangles are no single fan.
    Vertex(u32),
}

/// The fans of all vertices.
pub(super) fn around_all(mesh: &TriMesh, topology: &Topology) -> Result<Vec<Around>, Irregular> {
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

fn fan(mesh: &TriMesh, topology: &Topology, v: u32, first: u32, count: usize) -> Result<Around, Irregular> {
    if first == NONE {
        return Ok(Around::default());
    }
    // Back to where the fan begins, if it does.
    let mut start = first;
    for _ in 0..count {
        let next = after(mesh, start, v).and_then(|[w, _]| beyond(topology, start, v, w));
        match next {
            Some(t) if t != first => start = t,
            _ => break,
        }
    }
    let mut around = Around::default();
    let mut t = start;
    for turned in 1..=count {
        let Some([w, u]) = after(mesh, t, v) else { return Err(Irregular::Vertex(v)) };
        around.ring.push(w);
        match beyond(topology, t, v, u) {
            // Triangles of two orientations would turn back.
            Some(next) if next == start && turned == count => around.closed = true,
            Some(next) if next != start => t = next,
            Some(_) => break,
            None => {
                around.ring.push(u);
                return if turned == count { Ok(around) } else { Err(Irregular::Vertex(v)) };
            }
        }
    }
    if around.closed { Ok(around) } else { Err(Irregular::Vertex(v)) }
}

/// a + b − c.
fn mirrored(a: u32, b: u32, c: u32) -> Stencil {
    vec![(a, 1.0), (b, 1.0), (c, -1.0)]
}

/// The ring of a vertex with its mirrored vertices, closed.
fn extended(v: u32, around: &Around) -> Vec<Stencil> {
    let ring = &around.ring;
    let mut all: Vec<Stencil> = ring.iter().map(|&w| vec![(w, 1.0)]).collect();
    if let (false, [first, second, .., before, last]) | (false, [first, before @ second, last]) =
        (around.closed, ring.as_slice())
    {
        all.extend([mirrored(v, *last, *before), mirrored(v, *first, *second)]);
    } else if let (false, [first, last]) = (around.closed, ring.as_slice()) {
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
    let cosine = (std::f64::consts::TAU / n as f64).cos();
    (0.625 - (0.375 + 0.25 * cosine).powi(2)) / n as f64
}

/// The point of the limit surface at a vertex: (1 − n l) v + l Σ ring, l = 1/(n + 3/(8β)).
pub(super) fn limit_stencil(v: u32, around: &Around) -> Stencil {
    let ring = extended(v, around);
    let n = ring.len();
    if n == 0 {
        return vec![(v, 1.0)];
    }
    let l = 1.0 / (n as f64 + 0.375 / beta(n));
    let mut out = vec![(v, 1.0 - n as f64 * l)];
    ring.iter().for_each(|w| add(&mut out, w, l));
    out
}

/// The control vertices of a triangle with the derivatives of their functions at its middle, by s = λ₁ and t = λ₂;
/// vertices ascending.
pub(super) fn derivatives(triangle: [u32; 3], around: &[Around]) -> Option<Vec<(u32, Derivatives)>> {
    let mut sums: Vec<(u32, Derivatives)> = Vec::with_capacity(16);
    // Child coordinates μ = 1 − 2 λ.
    let (s, t) = (DVec3::new(2.0, -2.0, 0.0), DVec3::new(2.0, 0.0, -2.0));
    let mut take = |point: Stencil, f: AtMiddle| {
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
        let fan = &around[v as usize];
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
        // The child's corners are named by the garment's that they face: the edge point of ab is corner c. Beyond its side from b to c lies v's own
        // point; beside corner c next to that the edge point of v and what is across ab, beside corner b that of v and what is across ca.
        take(edge(&own, next, last, across_b), AtMiddle::of(&CORNER, [c, a, b]));
        take(vertex_point, AtMiddle::of(&ACROSS, [b, c, a]));
        take(edge(&own, across_b, next, far_b), AtMiddle::of(&BESIDE, [c, b, a]));
        take(edge(&own, across_c, last, far_c), AtMiddle::of(&BESIDE, [b, c, a]));
    }
    Some(sums)
}
