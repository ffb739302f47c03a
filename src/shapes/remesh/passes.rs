//! Split, collapse, flip and the last few vertices.

use super::Surface;
use super::half_edge::{HalfEdgeMesh, NONE, previous};

/// A collapse may turn no triangle further than this: cos 60°.
const LARGEST_TURN: f64 = 0.5;
/// A flip may bend no pair of triangles further than this: cos 30°.
const FLAT_ENOUGH: f64 = 0.866;

/// What a flip is to improve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    /// Neighbour counts, towards six (four on the boundary).
    Valence,
    /// The two angles opposite the edge, towards a sum under 180°.
    Delaunay,
}

/// Edges and their lengths relative to the local size, m, for which `keep` holds, in order of `key`.
fn edges(mesh: &HalfEdgeMesh, surface: &dyn Surface, keep: impl Fn(f64) -> bool) -> Vec<(f64, u32)> {
    let mut found = Vec::new();
    for h in 0..mesh.half_edge_count() as u32 {
        if mesh.is_first(h) {
            let length = relative_length(mesh, surface, h);
            if keep(length) {
                found.push((length, h));
            }
        }
    }
    found
}

fn relative_length(mesh: &HalfEdgeMesh, surface: &dyn Surface, h: u32) -> f64 {
    let e = mesh.vector(h);
    e.length() / surface.relative_size(mesh.positions[mesh.origin(h) as usize] + 0.5 * e)
}

/// Splits every edge longer than `limit`, longest first.
pub(super) fn split(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, limit: f64) {
    let mut long = edges(mesh, surface, |length| length > limit);
    long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, h) in long {
        split_on_surface(mesh, surface, h);
    }
}

fn split_on_surface(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, h: u32) {
    mesh.split(h);
    let m = mesh.positions.len() - 1;
    mesh.positions[m] = surface.project(mesh.positions[m], mesh.tags[m]);
}

/// Collapses edges shorter than `limit`, shortest first, unless an edge longer than `longest` would come of it.
pub(super) fn collapse(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, limit: f64, longest: f64) {
    let mut short = edges(mesh, surface, |length| length < limit);
    short.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (_, h) in short {
        // An earlier collapse may have removed the edge, or made it longer.
        if mesh.is_alive(h) && relative_length(mesh, surface, h) < limit {
            try_collapse(mesh, surface, h, longest);
        }
    }
}

fn try_collapse(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, h: u32, longest: f64) -> bool {
    let g = mesh.twin(h);
    // Of a boundary and an inner vertex the inner one goes.
    let h = if g != NONE && mesh.is_boundary(mesh.origin(h)) && !mesh.is_boundary(mesh.target(h)) { g } else { h };
    if !mesh.can_collapse(h) {
        return false;
    }
    let (v0, v1) = (mesh.origin(h), mesh.target(h));
    let (p0, p1) = (mesh.positions[v0 as usize], mesh.positions[v1 as usize]);
    let keeps_target = mesh.is_boundary(v1) && !mesh.is_boundary(v0);
    let at = if keeps_target { p1 } else { surface.project(0.5 * (p0 + p1), mesh.tags[v1 as usize]) };
    let size = surface.relative_size(at);
    let mut fine = true;
    for (v, other) in [(v0, v1), (v1, v0)] {
        mesh.around(v, |k| {
            let (b, c) = (mesh.target(k), mesh.origin(previous(k)));
            if b == other || c == other {
                return;
            }
            let (pb, pc) = (mesh.positions[b as usize], mesh.positions[c as usize]);
            let old = (pb - mesh.positions[v as usize]).cross(pc - mesh.positions[v as usize]);
            let new = (pb - at).cross(pc - at);
            fine &= new.dot(old) >= LARGEST_TURN * new.length() * old.length() && new.length_squared() > 0.0;
            fine &= pb.distance(at).max(pc.distance(at)) <= longest * size;
        });
    }
    if fine {
        mesh.collapse(h, at);
    }
    fine
}

/// Splits the longest or collapses the shortest edges until there are `count` vertices (or no edge can go).
pub(super) fn trim(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, count: usize) {
    while mesh.vertex_count() != count {
        let before = mesh.vertex_count();
        let mut all = edges(mesh, surface, |_| true);
        if before < count {
            all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (_, h) in all.into_iter().take(count - before) {
                split_on_surface(mesh, surface, h);
            }
        } else {
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for (_, h) in all {
                if mesh.vertex_count() == count {
                    break;
                }
                if mesh.is_alive(h) {
                    try_collapse(mesh, surface, h, f64::INFINITY);
                }
            }
        }
        if mesh.vertex_count() == before {
            break;
        }
    }
}

/// Flips every inner edge that the rule would rather have the other way.
pub(super) fn flip(mesh: &mut HalfEdgeMesh, rule: Rule) {
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
            let cot = |x: glam::DVec3, y: glam::DVec3| x.dot(y) / x.cross(y).length().max(1e-30);
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
    let thin = |n: glam::DVec3, x: f64, y: f64, z: f64| n.length() < 0.3 * x.max(y).max(z).powi(2);
    let diagonal = pa.distance(pb);
    if rule == Rule::Valence
        && (thin(first, diagonal, p0.distance(pa), p0.distance(pb))
            || thin(second, diagonal, p1.distance(pa), p1.distance(pb)))
    {
        return false;
    }
    first.normalize_or_zero().dot(old) > FLAT_ENOUGH && second.normalize_or_zero().dot(old) > FLAT_ENOUGH
}
