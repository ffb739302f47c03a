//! The coarse cloth's rest shape: how long the cloth is between the nodes of adjacent PARTs.
//!
//! The rest length of a coarse edge is its chord on the garment as placed times the cloth's rest over placed length along
//! it: L_pq = |X_q − X_p| · mean over T of |J_t ê_t|, where T are the garment triangles around a shortest path of garment
//! edges from node to node, ê_t is the chord's unit direction in the plane of t, and J_t = U_t P_t⁺ maps placed vectors in
//! that plane to the rest shape. So a hem with more cloth than its placed cone has room for carries it into the coarse
//! cloth. Rest and placed chords bend alike, which keeps a tight ring as tight as it is.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | X | garment vertices as placed | m |
//! | P_t, U_t | edge vectors of triangle t, placed and at rest | m |
//! | J_t | rest over placed, 2×3 | – |
//!
//! The triangle with these three lengths is laid flat and turned so that the warp agrees with that of its junction (least
//! squares over the corners). Limits: a triangle thinner than a twentieth of its longest edge is fattened to that,
//! because a sliver's stiffness across grows without bound.

use glam::{DVec2, DVec3};

use super::nodes::CoarseMesh;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::Parts;

/// Least height of a coarse triangle over its longest edge: well under that of any usable triangle (one of 5 degrees has
/// 0.09), and large enough to keep the coarse Hessian's condition within what a direct solve bears.
pub(crate) const LEAST_HEIGHT: f64 = 0.05;

/// The rest shape of each coarse triangle.
#[must_use]
pub fn coarse_rest(
    mesh: &TriMesh,
    topology: &Topology,
    rest: &RestShape,
    parts: &Parts,
    coarse: &CoarseMesh,
) -> RestShape {
    let mut walk = Walk::new(mesh, topology, parts);
    let mut edges: Vec<[u32; 2]> = coarse
        .triangles
        .iter()
        .flat_map(|&[p, q, r]| [[p, q], [q, r], [r, p]])
        .map(|[p, q]| [p.min(q), p.max(q)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let lengths: Vec<f64> = edges
        .iter()
        .map(|&[p, q]| {
            let (from, to) = (coarse.node_vertex[p as usize], coarse.node_vertex[q as usize]);
            let chord = mesh.positions[to as usize] - mesh.positions[from as usize];
            let path = walk.path(from, to, [p, q]);
            chord.length() * mean_stretch(mesh, topology, rest, &path, chord)
        })
        .collect();
    let length = |p: u32, q: u32| edges.binary_search(&[p.min(q), p.max(q)]).map_or(0.0, |e| lengths[e]);
    let corners = coarse
        .triangles
        .iter()
        .zip(&coarse.junctions)
        .map(|(&[p, q, r], &junction)| {
            let flat = lay_flat(length(p, q), length(q, r), length(r, p));
            let placed = [p, q, r].map(|n| mesh.positions[coarse.node_vertex[n as usize] as usize]);
            turn(flat, in_grain(mesh, rest, junction as usize, placed))
        })
        .collect();
    RestShape { corners }
}

/// Rest over placed length along `chord`, averaged over the triangles at the edges of `path`.
fn mean_stretch(mesh: &TriMesh, topology: &Topology, rest: &RestShape, path: &[u32], chord: DVec3) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for step in path.windows(2) {
        let Some(edge) = topology.edge_between(step[0], step[1]) else { continue };
        for &t in &topology.edge_triangles[edge] {
            if let Some(ratio) = (mesh.triangles.get(t as usize)).and_then(|_| stretch(mesh, rest, t as usize, chord)) {
                sum += ratio;
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { 1.0 }
}

/// Placed directions along weft and warp, as a map from placed vectors to the rest shape's frame: rows of J_t.
fn grain(mesh: &TriMesh, rest: &RestShape, t: usize) -> Option<[DVec3; 2]> {
    let [a, b, c] = mesh.corners(t);
    let [u, v, w] = rest.corners[t];
    let (e, f) = (b - a, c - a);
    let (g, h) = (v - u, w - u);
    // The dual vectors of e and f in the triangle's plane: e*·e = 1, e*·f = 0.
    let normal = e.cross(f);
    let square = normal.length_squared();
    if square <= 0.0 || !square.is_finite() {
        return None;
    }
    let (e_dual, f_dual) = (f.cross(normal) / square, normal.cross(e) / square);
    Some([e_dual * g.x + f_dual * h.x, e_dual * g.y + f_dual * h.y])
}

/// |J_t ê_t|.
fn stretch(mesh: &TriMesh, rest: &RestShape, t: usize, chord: DVec3) -> Option<f64> {
    let rows = grain(mesh, rest, t)?;
    let normal = mesh.double_area_vector(t).normalize_or_zero();
    let along = (chord - normal * normal.dot(chord)).try_normalize()?;
    Some(DVec2::new(rows[0].dot(along), rows[1].dot(along)).length())
}

/// The corners of a coarse triangle in the grain of its junction: what the flat triangle is turned to.
fn in_grain(mesh: &TriMesh, rest: &RestShape, junction: usize, corners: [DVec3; 3]) -> [DVec2; 3] {
    let Some(rows) = grain(mesh, rest, junction) else { return [DVec2::ZERO; 3] };
    // The coarse triangle is tilted against its junction: turn it into the junction's plane first.
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    let plane = mesh.double_area_vector(junction).normalize_or_zero();
    let tilt = if normal.dot(plane) > -0.99 && normal.length() > 0.5 && plane.length() > 0.5 {
        glam::DQuat::from_rotation_arc(normal, plane)
    } else {
        glam::DQuat::IDENTITY
    };
    corners.map(|x| {
        let e = tilt * (x - corners[0]);
        DVec2::new(rows[0].dot(e), rows[1].dot(e))
    })
}

/// A triangle with the given edge lengths: first corner at the origin, second on the x axis, third above it.
fn lay_flat(ab: f64, bc: f64, ca: f64) -> [DVec2; 3] {
    let least = LEAST_HEIGHT * ab.max(bc).max(ca);
    let ab = ab.max(least);
    let x = (ab * ab + ca * ca - bc * bc) / (2.0 * ab);
    // The triangle inequality may fail where two nodes are close and the path between them is bent.
    let height = (ca * ca - x * x).max(0.0).sqrt().max(least);
    [DVec2::ZERO, DVec2::new(ab, 0.0), DVec2::new(x, height)]
}

/// Turns `flat` about its centroid so that it matches `target` best in the least squares sense; never mirrors.
fn turn(flat: [DVec2; 3], target: [DVec2; 3]) -> [DVec2; 3] {
    let middle = |c: [DVec2; 3]| (c[0] + c[1] + c[2]) / 3.0;
    let (m, n) = (middle(flat), middle(target));
    let (mut dot, mut cross) = (0.0, 0.0);
    for (f, g) in flat.iter().zip(&target) {
        dot += (*f - m).dot(*g - n);
        cross += (*f - m).perp_dot(*g - n);
    }
    let rotation = if dot == 0.0 && cross == 0.0 { DVec2::X } else { DVec2::new(dot, cross).normalize() };
    flat.map(|f| rotation.rotate(f - m))
}

/// Shortest paths by number of edges inside two PARTs.
struct Walk<'a> {
    mesh: &'a TriMesh,
    topology: &'a Topology,
    parts: &'a Parts,
    from: Vec<u32>,
    touched: Vec<u32>,
}

/// Not reached yet.
const UNSEEN: u32 = u32::MAX;

impl<'a> Walk<'a> {
    fn new(mesh: &'a TriMesh, topology: &'a Topology, parts: &'a Parts) -> Self {
        Self { mesh, topology, parts, from: vec![UNSEEN; mesh.vertex_count()], touched: Vec::new() }
    }

    /// Vertices from `a` to `b` by breadth-first search inside `pair`; of equally short paths one that a fixed order picks.
    fn path(&mut self, a: u32, b: u32, pair: [u32; 2]) -> Vec<u32> {
        debug_assert!((a as usize) < self.mesh.vertex_count());
        for v in self.touched.drain(..) {
            self.from[v as usize] = UNSEEN;
        }
        self.from[a as usize] = a;
        self.touched.push(a);
        let mut next = 0;
        while next < self.touched.len() && self.from[b as usize] == UNSEEN {
            let v = self.touched[next];
            next += 1;
            for &w in self.topology.neighbours(v) {
                if self.from[w as usize] == UNSEEN && pair.contains(&self.parts.part_of_vertex[w as usize]) {
                    self.from[w as usize] = v;
                    self.touched.push(w);
                }
            }
        }
        if self.from[b as usize] == UNSEEN {
            return Vec::new();
        }
        let mut path = vec![b];
        let mut at = b;
        while at != a {
            at = self.from[at as usize];
            path.push(at);
        }
        path
    }
}
