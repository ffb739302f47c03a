//! Garments worn over each other, inner to outer, as one cloth of several parts.
//!
//! Their meshes lie side by side in one [`TriMesh`]: PARTs, energy and contact need nothing more, since no PART goes from one to another and
//! cloth keeps off cloth. What is needed is a start in which the outer one is outside. Along the way out of the body, from the point
//! c that is nearest to a vertex of the outer garment, the inner garment is met at a distance d; the vertex is moved outward until it is
//! d and a clearance away, and its neighbours follow smoothly, as for what starts inside the body (`push_out.rs`).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c | point of the body nearest to the vertex | m |
//! | d | where the way out from c meets the garments below | m |
//!
//! Limits: one fabric for all; where folds of the inner garment meet the way out several times, only the first counts.

use glam::DVec3;
use parry3d_f64::query::{Ray, RayCast, RayIntersection};
use parry3d_f64::shape::{FeatureId, TriMesh as ParryMesh};

use super::SceneError;
use crate::distance::{Body, DistanceError, SurfacePoint};
use crate::mesh::{RestShape, Topology, TriMesh};

/// An outer garment begins so far outside the inner one, m: the sag of triangles of both, and some thicknesses.
const CLEARANCE: f64 = 6e-3;

/// Garments farther off the body than this are not felt from it, m.
const FARTHEST: f64 = 0.5;

/// Rounds of moving out and smoothing, and averages in each.
const ROUNDS: usize = 12;
const SWEEPS: usize = 3;

/// Moves `outer` out of the way of `inner`, both placed around `body`.
pub(super) fn put_over(outer: &mut TriMesh, inner: &TriMesh, body: &Body) -> Result<(), SceneError> {
    let refused = |e| SceneError::from(DistanceError::Refused(format!("{e:?}")));
    let below = ParryMesh::new(inner.positions.clone(), inner.triangles.clone()).map_err(refused)?;
    let topology = Topology::new(outer);
    let mut moves = vec![DVec3::ZERO; outer.vertex_count()];
    for _ in 0..ROUNDS {
        let there: Vec<DVec3> = outer.positions.iter().zip(&moves).map(|(x, m)| *x + *m).collect();
        let missing = missing(&there, inner, &below, body);
        if missing.iter().all(|m| *m == DVec3::ZERO) {
            break;
        }
        let bound: Vec<DVec3> = moves.iter().zip(&missing).map(|(m, more)| *m + *more).collect();
        moves.clone_from(&bound);
        for _ in 0..SWEEPS {
            let mean = |v: usize| {
                let neighbours = topology.neighbours(v as u32);
                neighbours.iter().map(|&w| moves[w as usize]).sum::<DVec3>() / neighbours.len().max(1) as f64
            };
            moves = (0..moves.len()).map(|v| 0.5 * (moves[v] + mean(v))).collect();
        }
        // What had to move moves at least as far.
        for ((m, bound), missing) in moves.iter_mut().zip(&bound).zip(&missing) {
            if *missing != DVec3::ZERO && m.length_squared() < bound.length_squared() {
                *m = *bound;
            }
        }
    }
    outer.positions.iter_mut().zip(moves).for_each(|(x, m)| *x += m);
    Ok(())
}

/// What each vertex has to move outward, m.
fn missing(x: &[DVec3], inner: &TriMesh, below: &ParryMesh, body: &Body) -> Vec<DVec3> {
    let found = body.nearest_all(x);
    let missing = |nearest: &SurfacePoint| {
        let out = nearest.normal;
        let met = below.cast_local_ray_and_get_normal(&Ray::new(nearest.point, out), FARTHEST, false);
        // Met from within: out of an arm one may come upon the outside of a skirt.
        let from_within = |met: &RayIntersection| match met.feature {
            FeatureId::Face(t) => inner.double_area_vector(t as usize % inner.triangles.len()).dot(out) > 0.0,
            _ => false,
        };
        let wanted = met.filter(from_within).map_or(f64::NEG_INFINITY, |met| met.time_of_impact + CLEARANCE);
        out * (wanted - nearest.signed_distance).max(0.0)
    };
    found.iter().map(missing).collect()
}

/// Puts `more` beside `mesh`, with its groups; returns how many vertices there were before.
pub(super) fn join(mesh: &mut TriMesh, rest: &mut RestShape, more: TriMesh, more_rest: RestShape) -> u32 {
    let n = mesh.vertex_count() as u32;
    let named = |mesh: &mut TriMesh| {
        if mesh.groups.is_empty() {
            mesh.groups.push("garment".to_owned());
            mesh.triangle_group = vec![0; mesh.triangles.len()];
        }
    };
    let mut more = more;
    named(mesh);
    named(&mut more);
    let groups = mesh.groups.len() as u32;
    // A name that is there already gets a number, so that each stays findable.
    for name in more.groups {
        let taken = |name: &String| mesh.groups.contains(name);
        let numbered = (2..).map(|k| format!("{name}-{k}")).find(|name| !taken(name)).unwrap_or_default();
        mesh.groups.push(if taken(&name) { numbered } else { name });
    }
    mesh.triangle_group.extend(more.triangle_group.iter().map(|g| g + groups));
    mesh.positions.extend(more.positions);
    mesh.triangles.extend(more.triangles.iter().map(|t| t.map(|v| v + n)));
    rest.corners.extend(more_rest.corners);
    n
}
