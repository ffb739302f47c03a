//! Isotropic remeshing of a surface given by a field, to a vertex count or an edge length.
//!
//! Botsch, Kobbelt, "A Remeshing Approach to Multiresolution Modeling" (SGP 2004): split edges longer than 4/3 of the
//! target length ℓ, collapse those shorter than 4/5 ℓ, flip edges towards six neighbours a vertex (four on a boundary),
//! move each vertex to the weighted centroid of its triangles within the tangent plane, project it back to the surface; repeat.
//! The count N follows from the area A by N ≈ 2A/(√3 ℓ²); ℓ is corrected by √(N/N*) between rounds, and the last few
//! vertices are split or collapsed off one by one, so the count is met exactly.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ℓ | target edge length | m |
//! | N, N* | number of vertices, and the wanted number | – |
//! | A_t, c_t | area and centroid of triangle t | m², m |
//! | s | target edge length relative to the rest of the surface | – |
//! | n, Π | area-weighted normal, projection onto the surface | – |
//!
//! Relaxation moves x to Π(x + (I − n nᵀ)(c − x)) with c = Σ w_t c_t / Σ w_t, w_t = A_t / s⁴ (a centroidal Voronoi step for
//! the density s⁻⁴; Du, Faber, Gunzburger 1999). Boundary vertices move to the middle of their two neighbours on the boundary.
//!
//! Boundary vertices slide along their cut and stay on it. Limits: features sharper than ℓ are lost.

use glam::DVec3;
use rayon::prelude::*;

use super::half_edge::{HalfEdgeMesh, flip_by_valence, flip_to_delaunay, previous};
use super::morton::mesh_along_a_curve;
use super::{NONE, TriMesh};

use crate::base::math;

/// The surface that is meshed.
pub(crate) trait Surface: Sync {
    /// The point of the surface near `p`, m; for a `tag` above 0 the point of that cut's edge near it.
    fn project(&self, p: DVec3, tag: u8) -> DVec3;
    /// Target edge length at `p` relative to the rest of the surface.
    fn relative_size(&self, _p: DVec3) -> f64 {
        1.0
    }
}

/// The density of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Density {
    /// This many vertices, exactly.
    Vertices(usize),
    /// Edges of about this length, m.
    EdgeLength(f64),
}

/// Rounds of split, collapse, flip and relaxation before the count is corrected; each at most doubles the resolution.
const FIRST_ROUNDS: usize = 3;
/// Rounds that correct the edge length towards the wanted count.
const COUNT_ROUNDS: usize = 3;
/// Passes of flips and relaxation after the last split or collapse.
const FINAL_PASSES: usize = 4;
/// Number of vertices from which on they are renumbered along a curve; smaller meshes fit into the caches in any order.
const MIN_RENUMBERED: usize = 32_768;

/// Remeshes `mesh`, whose boundary vertices carry tags, to the given density. `None` where it is not a manifold, before or
/// after: a surface folded onto itself loses triangles whose vertices others still name.
pub(crate) fn remesh(
    mesh: &TriMesh,
    tags: Vec<u8>,
    surface: &dyn Surface,
    density: Density,
) -> Option<(TriMesh, Vec<u8>)> {
    let mut work = HalfEdgeMesh::new(mesh, tags)?;
    // Σ area/relative² is the area in units of the target edge for any relative sizes.
    let area: f64 = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            0.5 * mesh.double_area_vector(t).length() / surface.relative_size((a + b + c) / 3.0).powi(2)
        })
        .sum();
    let mut edge = match density {
        Density::EdgeLength(length) => length,
        Density::Vertices(count) => (2.0 * area / (3f64.sqrt() * count as f64)).sqrt(),
    };
    let start = (area / (work.vertex_count() as f64)).sqrt();
    let refining = math::log2(start / edge).ceil().max(0.0) as usize;
    for _ in 0..FIRST_ROUNDS + refining {
        round(&mut work, surface, edge);
    }
    if let Density::Vertices(count) = density {
        for _ in 0..COUNT_ROUNDS {
            edge *= (work.vertex_count() as f64 / count as f64).sqrt();
            round(&mut work, surface, edge);
        }
        for _ in 0..2 {
            trim(&mut work, surface, count);
            flip_by_valence(&mut work);
            relax(&mut work, surface);
        }
        trim(&mut work, surface, count);
    }
    for _ in 0..FINAL_PASSES {
        flip_to_delaunay(&mut work);
        relax(&mut work, surface);
    }
    flip_to_delaunay(&mut work);
    let (mesh, tags) = work.compact();
    if mesh.triangles.iter().flatten().any(|&v| v == NONE) || !mesh.positions.iter().all(|p| p.is_finite()) {
        return None;
    }
    Some(if mesh.vertex_count() < MIN_RENUMBERED { (mesh, tags) } else { mesh_along_a_curve(&mesh, &tags) })
}

fn round(work: &mut HalfEdgeMesh, surface: &dyn Surface, edge: f64) {
    split(work, surface, edge * 4.0 / 3.0);
    collapse(work, surface, edge * 4.0 / 5.0, edge * 4.0 / 3.0);
    flip_by_valence(work);
    relax(work, surface);
}

/// Edges whose length relative to the local size, m, `keep` accepts; the shortest first, or the longest.
fn edges(mesh: &HalfEdgeMesh, surface: &dyn Surface, longest_first: bool, keep: impl Fn(f64) -> bool) -> Vec<u32> {
    let all = (0..mesh.half_edge_count() as u32).filter(|&h| mesh.is_first(h));
    let sign = if longest_first { -1.0 } else { 1.0 };
    let lengths = all.map(|h| (relative_length(mesh, surface, h), h)).filter(|(length, _)| keep(*length));
    let mut sorted: Vec<(f64, u32)> = lengths.map(|(length, h)| (sign * length, h)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    sorted.into_iter().map(|(_, h)| h).collect()
}

fn relative_length(mesh: &HalfEdgeMesh, surface: &dyn Surface, h: u32) -> f64 {
    let e = mesh.vector(h);
    e.length() / surface.relative_size(mesh.positions[mesh.origin(h) as usize] + 0.5 * e)
}

/// Splits every edge longer than `limit`, longest first.
fn split(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, limit: f64) {
    for h in edges(mesh, surface, true, |length| length > limit) {
        split_on_surface(mesh, surface, h);
    }
}

fn split_on_surface(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, h: u32) {
    mesh.split(h);
    let m = mesh.positions.len() - 1;
    mesh.positions[m] = surface.project(mesh.positions[m], mesh.tags[m]);
}

/// Collapses edges shorter than `limit`, shortest first, unless an edge longer than `longest` would result.
fn collapse(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, limit: f64, longest: f64) {
    for h in edges(mesh, surface, false, |length| length < limit) {
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
fn trim(mesh: &mut HalfEdgeMesh, surface: &dyn Surface, count: usize) {
    while mesh.vertex_count() != count {
        let before = mesh.vertex_count();
        let all = edges(mesh, surface, before < count, |_| true);
        if before < count {
            for h in all.into_iter().take(count - before) {
                split_on_surface(mesh, surface, h);
            }
        } else {
            for h in all {
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

/// Moves every vertex once.
fn relax(mesh: &mut HalfEdgeMesh, surface: &dyn Surface) {
    let moved: Vec<DVec3> = (0..mesh.positions.len() as u32)
        .into_par_iter()
        .with_min_len(256)
        .map(|v| {
            let p = mesh.positions[v as usize];
            if !mesh.is_vertex_alive(v) {
                return p;
            }
            let target = if mesh.is_boundary(v) { along_boundary(mesh, v) } else { centroid(mesh, surface, v) };
            surface.project(target, mesh.tags[v as usize])
        })
        .collect();
    mesh.positions = moved;
}

fn centroid(mesh: &HalfEdgeMesh, surface: &dyn Surface, v: u32) -> DVec3 {
    let p = mesh.positions[v as usize];
    let (mut normal, mut sum, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    mesh.around(v, |h| {
        let (b, c) = (mesh.vector(h), -mesh.vector(previous(h)));
        let area = b.cross(c);
        let middle = (b + c) / 3.0;
        let weight = area.length() / surface.relative_size(p + middle).powi(4);
        normal += area;
        sum += weight * middle;
        total += weight;
    });
    let n = normal.normalize_or_zero();
    if total <= 0.0 {
        return p;
    }
    let step = sum / total;
    p + step - step.dot(n) * n
}

fn along_boundary(mesh: &HalfEdgeMesh, v: u32) -> DVec3 {
    let p = mesh.positions[v as usize];
    let mut sum = DVec3::ZERO;
    mesh.around(v, |h| {
        if mesh.twin(h) == NONE {
            sum += mesh.vector(h);
        }
        let before = previous(h);
        if mesh.twin(before) == NONE {
            sum -= mesh.vector(before);
        }
    });
    // Half-way to the mean of the two neighbours, so that the loop does not oscillate.
    p + 0.25 * sum
}
