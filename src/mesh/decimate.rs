//! A mesh of fewer of its own vertices: edges collapsed onto one of their ends, the shortest first.
//!
//! A collapse keeps the surface a manifold with the same boundary loops (link condition), turns no triangle by more than 60°, makes no
//! sliver and leaves boundaries as bent as they were; afterwards edges are flipped towards Delaunay. N vertices want edges of
//! ℓ = √(2A/(√3 N)), and passes collapse what is shorter than a share of that, so the result is as even as its vertices allow.
//!
//! Source: Hoppe and others: "Mesh Optimization" (SIGGRAPH 1993) for the collapse; the rest is own. Limits: a mesh that is no manifold has none;
//! where collapses are forbidden the count is not reached.

use glam::DVec3;

use super::flip::{Rule, flip};
use super::half_edge::{HalfEdgeMesh, previous};
use super::{NONE, TriMesh, renumbered};

/// A collapse may turn no boundary further than this: cos 45°.
const STRAIGHTEST: f64 = 0.7;

/// Shape of a triangle, 4√3 A over its squared edges (1: equilateral), under which a collapse is refused, unless it was worse.
const THINNEST: f64 = 0.35;

/// Edges shorter than these shares of ℓ are collapsed, pass after pass.
const PASSES: [f64; 8] = [0.7, 0.85, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5];

/// No edge grows beyond this share of ℓ.
const LONGEST: f64 = 1.7;

/// What is left of a mesh.
#[derive(Debug, Clone)]
pub(super) struct Decimated {
    pub(super) mesh: TriMesh,
    /// The old vertex of each that is left.
    pub(super) vertices: Vec<u32>,
    /// The vertex, by its new number, that each old one ended on; [`NONE`] for one without triangles.
    pub(super) onto: Vec<u32>,
}

/// `mesh` with about `count` vertices; `None` where it is not a manifold.
pub(super) fn decimate(mesh: &TriMesh, count: usize) -> Option<Decimated> {
    let n = mesh.vertex_count();
    let area: f64 = mesh.triangle_areas().iter().sum();
    let edge = (2.0 * area / (3f64.sqrt() * count.max(1) as f64)).sqrt();
    let mut work = HalfEdgeMesh::new(mesh, vec![0; n])?;
    for h in 0..work.half_edge_count() as u32 {
        if work.twin(h) == NONE {
            let ends = [work.origin(h), work.target(h)];
            ends.into_iter().for_each(|v| work.tags[v as usize] = 1);
        }
    }
    let locked = pinched(mesh, &work);
    let mut onto: Vec<u32> = (0..n as u32).collect();
    for share in PASSES {
        if work.vertex_count() <= count {
            break;
        }
        let mut short: Vec<(f64, u32)> = (0..work.half_edge_count() as u32)
            .filter(|&h| work.is_first(h))
            .map(|h| (work.vector(h).length(), h))
            .filter(|e| e.0 < share * edge)
            .collect();
        short.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, h) in short {
            if work.vertex_count() <= count {
                break;
            }
            if work.is_alive(h) && work.vector(h).length() < share * edge {
                collapse(&mut work, h, &locked, LONGEST * edge, &mut onto);
            }
        }
    }
    flip(&mut work, Rule::Delaunay);
    let vertices: Vec<u32> = (0..n as u32).filter(|&v| work.is_vertex_alive(v)).collect();
    let number = renumbered(n, |v| work.is_vertex_alive(v as u32));
    let end = |mut v: u32| {
        while onto[v as usize] != v {
            v = onto[v as usize];
        }
        number[v as usize]
    };
    let onto = (0..n as u32).map(end).collect();
    Some(Decimated { mesh: work.compact().0, vertices, onto })
}

/// Vertices where two pieces of surface meet in a point: no walk round them sees both.
fn pinched(mesh: &TriMesh, work: &HalfEdgeMesh) -> Vec<bool> {
    let mut fans = vec![0i32; mesh.vertex_count()];
    for &v in mesh.triangles.iter().flatten() {
        fans[v as usize] += 1;
    }
    for (v, fan) in fans.iter_mut().enumerate() {
        work.around(v as u32, |_| *fan -= 1);
    }
    fans.into_iter().map(|missed| missed != 0).collect()
}

/// Collapses an edge onto the end that leaves the better triangles, if any may be.
fn collapse(work: &mut HalfEdgeMesh, h: u32, locked: &[bool], longest: f64, onto: &mut [u32]) {
    let best = [h, work.twin(h)]
        .into_iter()
        .filter(|&h| h != NONE)
        .filter_map(|h| Some((worst_shape(work, h, locked, longest)?, h)))
        .reduce(|a, b| if b.0 > a.0 { b } else { a });
    // A boundary edge has one half only; the way back along it is not looked for.
    if let Some((_, h)) = best {
        let (gone, stays) = (work.origin(h), work.target(h));
        onto[gone as usize] = stays;
        work.collapse(h, work.positions[stays as usize]);
    }
}

/// The worst shape of a triangle after `h` is collapsed onto its target; `None` where that may not be.
fn worst_shape(work: &HalfEdgeMesh, h: u32, locked: &[bool], longest: f64) -> Option<f64> {
    let (v0, v1) = (work.origin(h), work.target(h));
    if locked[v0 as usize] || locked[v1 as usize] || !work.can_collapse(h) || !straight(work, h) {
        return None;
    }
    let at = work.positions[v1 as usize];
    let mut worst = Some(f64::INFINITY);
    work.around_moved(v0, v1, at, |triangle| {
        let [from, b, c] = triangle.corners;
        let (was, is) = (shape(from, b, c), shape(at, b, c));
        let allowed = !triangle.turns && triangle.longest <= longest && (is >= THINNEST || is >= was);
        worst = worst.filter(|_| allowed).map(|worst| worst.min(is));
    });
    worst
}

/// Whether a boundary stays as it is but for a corner of less than 45°, if `h` is on one.
fn straight(work: &HalfEdgeMesh, h: u32) -> bool {
    let (v0, v1) = (work.origin(h), work.target(h));
    if !work.is_boundary(v0) {
        return true;
    }
    let at = work.positions[v0 as usize];
    let ahead = (work.positions[v1 as usize] - at).normalize_or_zero();
    let mut straight = false;
    work.around(v0, |k| {
        let before = previous(k);
        if work.twin(before) == NONE {
            let behind = (at - work.positions[work.origin(before) as usize]).normalize_or_zero();
            straight |= behind.dot(ahead) > STRAIGHTEST;
        }
    });
    straight
}

/// 4√3 A over the sum of squared edges.
fn shape(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    2.0 * 3f64.sqrt() * (b - a).cross(c - a).length() / squares.max(f64::MIN_POSITIVE)
}
