//! Flips of the edges of a triangle mesh, towards even neighbour counts or the better angles.

use glam::DVec3;

use super::NONE;
use super::half_edge::{HalfEdgeMesh, previous};

/// A flip may bend no pair of triangles further than this: cos 30°.
const FLAT_ENOUGH: f64 = 0.866;

/// What a flip is to improve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// Neighbour counts, towards six (four on the boundary).
    Valence,
    /// The two angles opposite the edge, towards a sum under 180°.
    Delaunay,
}

/// Flips every inner edge that the rule would rather have the other way.
pub(crate) fn flip(mesh: &mut HalfEdgeMesh, rule: Rule) {
    let sweeps = if rule == Rule::Delaunay { 3 } else { 1 };
    for _ in 0..sweeps {
        let mut flips = 0;
        for h in 0..mesh.half_edge_count() as u32 {
            if mesh.is_first(h) && mesh.twin(h) != NONE && wants_flip(mesh, h, rule) && mesh.flip(h) {
                flips += 1;
            }
        }
        if flips == 0 {
            break;
        }
    }
}

fn wants_flip(mesh: &HalfEdgeMesh, h: u32, rule: Rule) -> bool {
    let g = mesh.twin(h);
    let (v0, v1, a, b) = (mesh.origin(h), mesh.target(h), mesh.origin(previous(h)), mesh.origin(previous(g)));
    let [p0, p1, pa, pb] = [v0, v1, a, b].map(|v| mesh.positions[v as usize]);
    let better = match rule {
        Rule::Valence => {
            let off = |v: u32, change: i64| {
                let best = if mesh.is_boundary(v) { 4 } else { 6 };
                (mesh.valence(v) as i64 + change - best).pow(2)
            };
            off(v0, -1) + off(v1, -1) + off(a, 1) + off(b, 1) < off(v0, 0) + off(v1, 0) + off(a, 0) + off(b, 0)
        }
        Rule::Delaunay => {
            let cot = |x: DVec3, y: DVec3| x.dot(y) / x.cross(y).length().max(1e-30);
            cot(p0 - pa, p1 - pa) + cot(p0 - pb, p1 - pb) < -1e-9
        }
    };
    if !better {
        return false;
    }
    // The turned pair must face the way the old pair did, and neither may become a sliver.
    let old = (p1 - p0).cross(pa - p0).normalize_or_zero() + (p0 - p1).cross(pb - p1).normalize_or_zero();
    let old = old.normalize_or_zero();
    let (first, second) = ((p0 - pa).cross(pb - pa), (p1 - pb).cross(pa - pb));
    let thin = |n: DVec3, x: f64, y: f64, z: f64| n.length() < 0.3 * x.max(y).max(z).powi(2);
    let diagonal = pa.distance(pb);
    if rule == Rule::Valence
        && (thin(first, diagonal, p0.distance(pa), p0.distance(pb))
            || thin(second, diagonal, p1.distance(pa), p1.distance(pb)))
    {
        return false;
    }
    first.normalize_or_zero().dot(old) > FLAT_ENOUGH && second.normalize_or_zero().dot(old) > FLAT_ENOUGH
}
