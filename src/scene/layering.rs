//! An outer garment put over an inner one, and two garments joined to one mesh.
//!
//! The nearest point of the body to a vertex of the outer garment is c. Along the outward normal at c the garments below are
//! left for the last time at distance d. The vertex moves outward until it is d plus a clearance away, and its neighbours
//! follow smoothly, as for vertices that start inside the body ([`push_out`](crate::body::distance::push_out)). Triangles
//! that still cross the garments below are then lifted off step by step.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c | point of the body nearest to the vertex | m |
//! | d | distance from c at which the ray leaves the garments below | m |
//!
//! Limits: a garment is over or under another as a whole.

use std::collections::HashSet;

use glam::DVec3;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{FeatureId, TriMesh as ParryMesh};

use crate::body::distance::push_out::neighbour_mean;
use crate::body::distance::{Body, DistanceError, SurfacePoint};
use crate::mesh::self_intersection::crossing_pairs;
use crate::mesh::{RestShape, Topology, TriMesh};

/// Distance, m, at which an outer garment starts outside the inner one: the sag of the triangles of both, and some
/// thicknesses. A heuristic.
const CLEARANCE: f64 = 6e-3;

/// Garments farther from the body than this, m, do not move an outer one.
const MAX_RAY: f64 = 0.5;

/// Most sheets that a ray passes.
const MAX_SHEETS: usize = 16;

/// Least distance from the body of the point where a ray meets a sheet, as a share of the ray's length. It is 1 but for
/// rounding where the body is convex; below, the sheet belongs to another part of the body. A heuristic.
const OWN_SHARE: f64 = 0.8;

/// Offset behind a sheet at which the search for the next one starts, m.
const RAY_OFFSET: f64 = 1e-6;

/// Rounds of moving outward and smoothing, and averaging passes in each round. Heuristics.
const PUSH_ROUNDS: usize = 12;
const SMOOTHING_PASSES: usize = 3;

/// Distance, m, by which crossing triangles are lifted at a time, and the most times.
const LIFT: f64 = 1.5e-3;
const MAX_LIFTS: usize = 40;

/// Moves `outer` out of `inner`, both placed around `body`.
pub(super) fn put_over(outer: &mut TriMesh, inner: &TriMesh, body: &Body) -> Result<(), DistanceError> {
    let below = ParryMesh::new(inner.positions.clone(), inner.triangles.clone())
        .map_err(|e| DistanceError::Refused(format!("{e:?}")))?;
    let topology = Topology::new(outer);
    let mut displacement = vec![DVec3::ZERO; outer.vertex_count()];
    for _ in 0..PUSH_ROUNDS {
        let moved: Vec<DVec3> = outer.positions.iter().zip(&displacement).map(|(x, d)| *x + *d).collect();
        let missing_of = |nearest: &SurfacePoint| {
            let left = last_sheet(nearest.point, nearest.normal, inner, &below, body);
            nearest.normal * (left + CLEARANCE - nearest.signed_distance).max(0.0)
        };
        let missing: Vec<DVec3> = body.nearest_all(&moved).iter().map(missing_of).collect();
        if missing.iter().all(|m| *m == DVec3::ZERO) {
            break;
        }
        let bound: Vec<DVec3> = displacement.iter().zip(&missing).map(|(d, more)| *d + *more).collect();
        displacement.clone_from(&bound);
        for _ in 0..SMOOTHING_PASSES {
            let averaged = |v| 0.5 * (displacement[v] + neighbour_mean(&topology, &displacement, v as u32));
            displacement = (0..displacement.len()).map(averaged).collect();
        }
        // Smoothing must not shorten the displacement of a vertex that had to move.
        for ((d, bound), missing) in displacement.iter_mut().zip(&bound).zip(&missing) {
            if *missing != DVec3::ZERO && d.length_squared() < bound.length_squared() {
                *d = *bound;
            }
        }
    }
    outer.positions.iter_mut().zip(displacement).for_each(|(x, d)| *x += d);
    lift_off(outer, inner);
    Ok(())
}

/// Moves triangles of `outer` that cross `inner` to its outer side in small steps, neighbours with them.
pub(super) fn lift_off(outer: &mut TriMesh, inner: &TriMesh) {
    let topology = Topology::new(outer);
    for _ in 0..MAX_LIFTS {
        let crossing = crossing_pairs(outer, inner);
        if crossing.is_empty() {
            break;
        }
        let mut outward = vec![DVec3::ZERO; outer.vertex_count()];
        for [t, u] in crossing {
            let normal = inner.double_area_vector(u as usize).normalize_or_zero();
            outer.triangles[t as usize].iter().for_each(|&v| outward[v as usize] += normal);
        }
        let lifts: Vec<DVec3> = outward.iter().map(|sum| sum.normalize_or_zero() * LIFT).collect();
        for (v, x) in outer.positions.iter_mut().enumerate() {
            *x += if lifts[v] == DVec3::ZERO { 0.5 * neighbour_mean(&topology, &lifts, v as u32) } else { lifts[v] };
        }
    }
}

/// Distance from `c` along `outward`, m, at which the ray leaves the last of the sheets it passes. A sheet met from its outer
/// side ends the ray (out of an arm it may meet a skirt), and so does a sheet of another part of the body.
fn last_sheet(c: DVec3, outward: DVec3, inner: &TriMesh, below: &ParryMesh, body: &Body) -> f64 {
    let (mut last, mut from) = (f64::NEG_INFINITY, 0.0);
    for _ in 0..MAX_SHEETS {
        let ray = Ray::new(c + outward * from, outward);
        let Some(hit) = below.cast_local_ray_and_get_normal(&ray, MAX_RAY - from, false) else { break };
        let FeatureId::Face(t) = hit.feature else { break };
        let at = from + hit.time_of_impact;
        let leaving = inner.double_area_vector(t as usize % inner.triangles.len()).dot(outward) > 0.0;
        if !leaving || body.nearest(c + outward * at).signed_distance < OWN_SHARE * at {
            break;
        }
        (last, from) = (at, at + RAY_OFFSET);
        if from >= MAX_RAY {
            break;
        }
    }
    last
}

/// Number of vertices of `outer` that lie exactly on one of `inner`.
pub(super) fn coincident(inner: &TriMesh, outer: &TriMesh) -> usize {
    let bits = |p: &DVec3| p.to_array().map(f64::to_bits);
    let taken: HashSet<[u64; 3]> = inner.positions.iter().map(bits).collect();
    outer.positions.iter().filter(|p| taken.contains(&bits(p))).count()
}

/// Appends `more` to `mesh`, with its groups; returns the number of vertices there were before.
pub(super) fn join(mesh: &mut TriMesh, rest: &mut RestShape, mut more: TriMesh, more_rest: RestShape) -> u32 {
    for mesh in [&mut *mesh, &mut more] {
        if mesh.groups.is_empty() {
            mesh.groups.push("garment".to_owned());
            mesh.triangle_group = vec![0; mesh.triangles.len()];
        }
    }
    let (n, groups) = (mesh.vertex_count() as u32, mesh.groups.len() as u32);
    // A name that exists already gets a number, so that both groups can be named.
    for name in more.groups {
        let taken = |name: &String| mesh.groups.contains(name);
        let numbered = (2..).map(|k| format!("{name}-{k}")).find(|name| !taken(name)).unwrap_or_default();
        mesh.groups.push(if taken(&name) { numbered } else { name });
    }
    mesh.triangle_group.extend(more.triangle_group.iter().map(|g| g + groups));
    mesh.positions.extend(more.positions);
    if !(rest.guessed.is_empty() && more_rest.guessed.is_empty()) {
        rest.guessed.resize(mesh.triangles.len(), false);
        rest.guessed.extend((0..more.triangles.len()).map(|t| more_rest.is_guessed(t)));
    }
    mesh.triangles.extend(more.triangles.iter().map(|t| t.map(|v| v + n)));
    rest.corners.extend(more_rest.corners);
    n
}
