//! Split, collapse and the last few vertices.

use super::Surface;
use crate::mesh::NONE;
use crate::mesh::half_edge::HalfEdgeMesh;

/// Lengths of the edges relative to the local size, m, for which `keep` holds, with the edges.
fn edges(mesh: &HalfEdgeMesh, surface: &dyn Surface, keep: impl Fn(f64) -> bool) -> Vec<(f64, u32)> {
    let all = (0..mesh.half_edge_count() as u32).filter(|&h| mesh.is_first(h));
    all.map(|h| (relative_length(mesh, surface, h), h)).filter(|(length, _)| keep(*length)).collect()
}

fn relative_length(mesh: &HalfEdgeMesh, surface: &dyn Surface, h: u32) -> f64 {
    let e = mesh.vector(h);
    e.length() / surface.relative_size(mesh.positions[mesh.origin(h) as usize] + 0.5 * e)
}

/// Splits every edge longer than `limit`, longest first.
pub(crate) fn split(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, limit: f64) {
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
pub(crate) fn collapse(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, limit: f64, longest: f64) {
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
        mesh.around_moved(v, other, at, |triangle| fine &= !triangle.turns && triangle.longest <= longest * size);
    }
    if fine {
        mesh.collapse(h, at);
    }
    fine
}

/// Splits the longest or collapses the shortest edges until there are `count` vertices (or no edge can go).
pub(crate) fn trim(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, count: usize) {
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
