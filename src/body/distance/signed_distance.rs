//! Exact signed distance and closest points on the body.
//!
//! For a point x the closest surface point c(x) is the closest point of its nearest triangle ([`Tree`]), by parry3d in double
//! precision. The signed distance is q(x) = ± |x − c(x)|, negative inside; its sign is that of the angle-weighted
//! pseudo-normal at c(x) (Bærentzen, Aanæs: "Signed distance computation using the angle weighted pseudonormal", IEEE TVCG
//! 11(3), 2005). Its gradient ∇q = (x − c)/q is the paper's body normal e_q, whose direction cosines are cos α_q, cos β_q,
//! cos γ_q (equations 3 and 8). On the surface itself the quotient is undefined, and the pseudo-normal is used.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body, positive outside | m |
//! | ∇q | outward unit normal seen from x | – |
//! | d | signed distance to a cloth that covers the body, negative behind it | m |
//! | R | depth behind the cloth that counts as inside, [`COVER_DEPTH`] | m |
//!
//! # A covered body
//! For an outer garment, an inner garment is an obstacle like the skin. [`Body::covered_by`] makes a body whose distance q' is that
//! to the outermost of skin and cloth:
//!
//! q' = d  where x is behind the cloth by less than R, else the smaller of q and |d|.
//!
//! Past the edge of the cloth, or deeper behind it than R, the cloth is an obstacle without an inside.
//!
//! # Limits
//! The sign is exact for closed, consistently wound surfaces without self-intersections. Where a body intersects itself,
//! points in the doubly covered pocket may count as outside. An open body has no inside: see [`Body::new_open`]. The sides of
//! a covering cloth are those of its normals; in a pleat the nearest sheet decides.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use glam::{DVec3, IVec3};
use parry3d_f64::partitioning::Bvh;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{Triangle, TrianglePointLocation};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::tree::{Nearest, Tree};
use crate::base::math;
use crate::mesh::morton::along_a_curve;
use crate::mesh::self_intersection::{crossing_pairs_in, tree_of};
use crate::mesh::winding::signed_volumes;
use crate::mesh::{Csr, Topology, TriMesh};

/// Below this distance to the surface, m, the direction to the closest point is rounding noise and the pseudo-normal is
/// used. 1e-9 m is a million times the spacing of doubles at body size, and a millionth of a cloth's thickness.
const ON_SURFACE: f64 = 1e-9;

/// Points per parallel task. Within a task each search starts at the triangle of the point before.
const CHUNK: usize = 128;

/// Least volume of a closed body over its area to the power of 3/2 (a sphere has a tenth). Below it the volume is rounding:
/// a sheet of two square metres is then thinner than a micrometre, and neither of its sides is inside.
const MIN_VOLUME_RATIO: f64 = 1e-6;

/// Largest difference, m, between the tree's distance to a triangle and parry's. Beyond it the triangle is a sliver whose
/// distance the tree could not resolve, and the tree is searched again by parry's distances.
const TREE_TOLERANCE: f64 = 1e-9;

/// R, m: several steps of a drape. A vertex farther behind a cloth did not get there by being pushed.
const COVER_DEPTH: f64 = 0.02;

/// Spacing of the lattice whose distances a body caches, m.
pub(crate) const LATTICE_SIDE: f64 = 5e-3;

/// A surface that no distance can be measured to.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum DistanceError {
    /// The mesh has no triangles.
    #[error("the body has no triangles")]
    Empty,
    /// A boundary edge: the surface does not separate inside from outside.
    #[error("the body is not closed: {count} boundary edges, the first between vertices {a} and {b}")]
    Open { count: usize, a: u32, b: u32 },
    /// A closed surface without a volume.
    #[error(
        "the body encloses no volume, though it is closed: expected a solid, found {area_m2:.3} m² of surface about {litres:.2e} litres; \
         are vertices at the wrong place, or is it a sheet?"
    )]
    Flat { area_m2: f64, litres: f64 },
    /// The query structure rejected the mesh.
    #[error("the body cannot be searched: {0}")]
    Refused(String),
}

/// The point of the body nearest to some x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The nearest point c(x), m.
    pub point: DVec3,
    /// q(x), m: negative inside.
    pub signed_distance: f64,
    /// ∇q(x): the outward unit normal of the body as seen from x.
    pub normal: DVec3,
    /// The triangle of the body that c(x) lies on.
    pub triangle: u32,
}

/// A body prepared for distance queries; a clone shares its surface.
#[derive(Clone)]
pub struct Body {
    mesh: Arc<TriMesh>,
    /// The triangles at each vertex, ascending.
    fans: Arc<Csr<u32>>,
    tree: Arc<Tree>,
    cover: Option<Cover>,
    /// Signed distances at lattice points that were computed before, m. A value depends on its point alone, so the cache
    /// does not change results.
    lattice: Arc<Mutex<FxHashMap<IVec3, f64>>>,
    /// The boxes of the triangles, made at the first use.
    boxes: Arc<OnceLock<Bvh>>,
}

/// A cloth that covers a body.
#[derive(Debug, Clone)]
struct Cover {
    cloth: Box<Body>,
    on_boundary: Vec<bool>,
}

impl std::fmt::Debug for Body {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Body").field("triangles", &self.mesh.triangles.len()).finish_non_exhaustive()
    }
}

impl Body {
    /// Builds the hierarchy over a closed surface.
    pub fn new(mesh: &TriMesh) -> Result<Self, DistanceError> {
        {
            // Freed before the hierarchy is built, which takes as much memory.
            let topology = Topology::new(mesh);
            let mut open = topology.boundary_edges();
            if let Some([a, b]) = open.next() {
                return Err(DistanceError::Open { count: open.count() + 1, a, b });
            }
            let (component, components) = topology.components();
            let volume: f64 = signed_volumes(mesh, &component, components).iter().map(|v| v.abs()).sum();
            let area: f64 = mesh.triangle_areas().iter().sum();
            if !mesh.triangles.is_empty() && volume <= MIN_VOLUME_RATIO * area * area.sqrt() {
                return Err(DistanceError::Flat { area_m2: area, litres: 1e3 * volume });
            }
        }
        Self::new_open(mesh)
    }

    /// Builds the hierarchy over any surface. Its normals alone separate inside from outside, which is right near the
    /// surface and unreliable beyond its edges.
    pub fn new_open(mesh: &TriMesh) -> Result<Self, DistanceError> {
        if mesh.triangles.is_empty() {
            return Err(DistanceError::Empty);
        }
        let corners = || mesh.triangles.iter().zip(0..).flat_map(|(triangle, t)| triangle.map(|v| (v, t)));
        let fans = || Csr::gathered(mesh.vertex_count(), corners);
        let (fans, tree) = rayon::join(fans, || Tree::new(mesh));
        let (mesh, fans, tree) = (Arc::new(mesh.clone()), Arc::new(fans), Arc::new(tree));
        Ok(Self { mesh, fans, tree, cover: None, lattice: Arc::default(), boxes: Arc::default() })
    }

    /// The body half-way to another pose, `other`: each vertex at the mean of both. `None` where they are not one mesh.
    pub(crate) fn half_way(&self, other: &Self) -> Option<Self> {
        if self.mesh.triangles != other.mesh.triangles {
            return None;
        }
        let pairs = self.mesh.positions.iter().zip(&other.mesh.positions);
        Self::new_open(&self.mesh.with_positions(pairs.map(|(a, b)| a.midpoint(*b)).collect())).ok()
    }

    /// The same body under `cloth`, whose normals point outward. A cover that was there before is replaced.
    ///
    /// # Errors
    /// [`DistanceError`] where the cloth has no triangles.
    pub(crate) fn covered_by(&self, cloth: &TriMesh) -> Result<Self, DistanceError> {
        let on_boundary = Topology::new(cloth).boundary_vertices();
        let cover = Some(Cover { cloth: Box::new(Self::new_open(cloth)?), on_boundary });
        Ok(Self { cover, lattice: Arc::default(), ..self.clone() })
    }

    /// The surface, m, without a covering cloth.
    #[must_use]
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Pairs of a triangle of `cloth` and one of the body, without a covering cloth, that cross; sorted.
    #[must_use]
    pub fn crossing_pairs(&self, cloth: &TriMesh) -> Vec<[u32; 2]> {
        crossing_pairs_in(cloth, &self.mesh, self.boxes.get_or_init(|| tree_of(&self.mesh)))
    }

    /// The nearest surface point to a finite `x`.
    #[must_use]
    pub fn nearest(&self, x: DVec3) -> SurfacePoint {
        self.outermost(x, self.tree.nearest(&[x])[0])
    }

    /// [`nearest`](Self::nearest) of every point, in parallel; the order, and every bit, is that of the input.
    #[must_use]
    pub fn nearest_all(&self, points: &[DVec3]) -> Vec<SurfacePoint> {
        self.nearest_all_from(points, &[])
    }

    /// [`nearest_all`](Self::nearest_all), to the same bits, by searches that start at these triangles, one for each point: sooner where they
    /// are those of points near by.
    pub(crate) fn nearest_all_from(&self, points: &[DVec3], hints: &[u32]) -> Vec<SurfacePoint> {
        let order = along_a_curve(points);
        let chunk = |chunk: &[u32]| {
            let here: Vec<DVec3> = chunk.iter().map(|&i| points[i as usize]).collect();
            let hints: Vec<u32> = chunk.iter().filter_map(|&i| hints.get(i as usize).copied()).collect();
            let found = self.tree.nearest_from(&here, &hints);
            here.into_iter().zip(found).map(|(x, candidate)| self.outermost(x, candidate)).collect::<Vec<_>>()
        };
        let found: Vec<SurfacePoint> = order.par_chunks(CHUNK).flat_map_iter(chunk).collect();
        let mut place = vec![0; points.len()];
        (0..).zip(&order).for_each(|(k, &i): (usize, _)| place[i as usize] = k);
        place.into_iter().map(|k| found[k]).collect()
    }

    /// Signed distances (m) at these points of the lattice of spacing [`LATTICE_SIDE`], in their order. Contact needs them
    /// around every vertex that touches, and later drapes and metrics need the same ones again.
    pub(crate) fn at_lattice(&self, points: &[IVec3]) -> Vec<f64> {
        let known: Vec<Option<f64>> = {
            let known = self.lock_lattice();
            points.iter().map(|i| known.get(i).copied()).collect()
        };
        let unknown = points.iter().zip(&known).filter(|(_, distance)| distance.is_none());
        let mut missing: Vec<IVec3> = unknown.map(|(i, _)| *i).collect();
        missing.sort_unstable_by_key(IVec3::to_array);
        missing.dedup();
        let at: Vec<DVec3> = missing.iter().map(|i| i.as_dvec3() * LATTICE_SIDE).collect();
        let found = self.nearest_all(&at).into_iter().map(|near| near.signed_distance);
        let mut lattice = self.lock_lattice();
        lattice.extend(missing.into_iter().zip(found));
        let stored = |i: &IVec3| lattice.get(i).copied().unwrap_or_default();
        points.iter().zip(known).map(|(i, distance)| distance.unwrap_or_else(|| stored(i))).collect()
    }

    fn lock_lattice(&self) -> MutexGuard<'_, FxHashMap<IVec3, f64>> {
        self.lattice.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The nearest point of the outermost of skin and covering cloth; `candidate` is the skin's nearest triangle.
    fn outermost(&self, x: DVec3, candidate: Nearest) -> SurfacePoint {
        let (skin, _) = self.on_skin(x, candidate);
        let Some(Cover { cloth: body, on_boundary }) = &self.cover else { return skin };
        let (cloth, location) = body.on_skin(x, body.tree.nearest(&[x])[0]);
        // Past a boundary edge of the cloth there is no side behind it.
        let past_edge = location.barycentric_coordinates().is_some_and(|weights| {
            let corners = body.mesh.triangles[cloth.triangle as usize];
            let mut carrying = corners.iter().zip(weights).filter(|(_, weight)| *weight > 0.0).map(|(v, _)| *v);
            weights.contains(&0.0) && carrying.all(|v| on_boundary[v as usize])
        });
        let distance = cloth.signed_distance.abs();
        if !past_edge && cloth.signed_distance < 0.0 && distance < COVER_DEPTH {
            return cloth;
        }
        if skin.signed_distance <= distance {
            return skin;
        }
        SurfacePoint { signed_distance: distance, normal: (x - cloth.point).normalize_or(cloth.normal), ..cloth }
    }

    /// The nearest point of the surface without its cover, and its place on the triangle.
    fn on_skin(&self, x: DVec3, candidate: Nearest) -> (SurfacePoint, TrianglePointLocation) {
        let mut triangle = candidate.triangle;
        let project = |triangle| self.triangle(triangle).project_local_point_and_get_location(x, false);
        let (mut projection, mut location) = project(triangle);
        let distance = x.distance(projection.point);
        if (distance - candidate.square.sqrt()).abs() > TREE_TOLERANCE * distance.max(1.0) {
            triangle = self.tree.nearest_by(x, |triangle| x.distance_squared(project(triangle).0.point));
            (projection, location) = project(triangle);
        }
        let offset = x - projection.point;
        let distance = offset.length();
        let outward = self.pseudo_normal(triangle, location);
        let sign = if offset.dot(outward) <= 0.0 { -1.0 } else { 1.0 };
        let normal = if distance > ON_SURFACE { offset / (sign * distance) } else { outward };
        (SurfacePoint { point: projection.point, signed_distance: sign * distance, normal, triangle }, location)
    }

    fn triangle(&self, triangle: u32) -> Triangle {
        let [a, b, c] = self.mesh.corners(triangle as usize);
        Triangle::new(a, b, c)
    }

    /// The normal whose side of a point of `triangle` is outside: that of the triangle, the sum of those at an edge, or the sum of those at
    /// a vertex, each times its angle there.
    fn pseudo_normal(&self, triangle: u32, location: TrianglePointLocation) -> DVec3 {
        let corners = self.mesh.triangles[triangle as usize];
        let corner = |i: u32| corners[i as usize % 3];
        let unit = |t: u32| self.mesh.double_area_vector(t as usize).normalize_or_zero();
        let normal = match location {
            TrianglePointLocation::OnVertex(i) => {
                let v = corner(i);
                self.fans.of(v as usize).iter().map(|&t| unit(t) * self.angle(t, v)).sum()
            }
            TrianglePointLocation::OnEdge(i, _) => {
                let (a, b) = (corner(i), corner(i + 1));
                let shared = |t: &&u32| self.mesh.triangles[**t as usize].contains(&b);
                self.fans.of(a as usize).iter().filter(shared).map(|&t| unit(t)).sum()
            }
            _ => DVec3::ZERO,
        };
        normal.try_normalize().unwrap_or_else(|| unit(triangle))
    }

    /// The angle of a triangle at its vertex `v`, rad.
    fn angle(&self, triangle: u32, v: u32) -> f64 {
        let here = self.mesh.positions[v as usize];
        let others = self.mesh.triangles[triangle as usize].into_iter().filter(|&w| w != v);
        let mut sides = others.map(|w| self.mesh.positions[w as usize] - here);
        match (sides.next(), sides.next()) {
            (Some(u), Some(w)) => math::atan2(u.cross(w).length(), u.dot(w)),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;

    /// The unit cube [0, 1]³.
    fn cube() -> TriMesh {
        cuboid(DVec3::ZERO, DVec3::ONE)
    }

    #[test]
    fn distances_to_a_cube_are_those_of_geometry() {
        let body = Body::new(&cube()).unwrap();
        let above = body.nearest(DVec3::new(0.3, 0.6, 1.5));
        assert!((above.signed_distance - 0.5).abs() < 1e-15);
        assert!((above.normal - DVec3::Z).length() < 1e-15);
        let inside = body.nearest(DVec3::new(0.3, 0.6, 0.9));
        assert!((inside.signed_distance + 0.1).abs() < 1e-15);
        assert!((inside.normal - DVec3::Z).length() < 1e-12);
        let off_corner = body.nearest(DVec3::new(2.0, 2.0, 2.0));
        assert!((off_corner.signed_distance - 3f64.sqrt()).abs() < 1e-15);
        let on_face = body.nearest(DVec3::new(1.0, 0.4, 0.3));
        assert!(on_face.signed_distance.abs() < 1e-12);
        assert!((on_face.normal - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn half_way_to_a_larger_cube_is_one_between_and_another_mesh_has_none() {
        let cube = Body::new(&cube()).unwrap();
        let larger = Body::new(&cuboid(DVec3::ZERO, DVec3::splat(3.0))).unwrap();
        let half = cube.half_way(&larger).unwrap();
        assert_eq!(half.mesh().positions, cuboid(DVec3::ZERO, DVec3::splat(2.0)).positions);
        let mut open = cube.mesh().clone();
        open.triangles.pop();
        assert!(cube.half_way(&Body::new_open(&open).unwrap()).is_none());
    }

    #[test]
    fn an_open_body_is_rejected_with_its_first_edge() {
        let mut open = cube();
        open.triangles.pop();
        let error = Body::new(&open).unwrap_err();
        assert!(matches!(error, DistanceError::Open { count: 3, .. }), "{error}");
        assert!(Body::new_open(&open).is_ok());
        assert!(matches!(Body::new(&TriMesh::default()), Err(DistanceError::Empty)));
    }

    #[test]
    fn a_flat_closed_sheet_is_rejected() {
        let mut flat = cube();
        flat.positions.iter_mut().for_each(|p| p.z *= 1e-9);
        let error = Body::new(&flat).unwrap_err();
        assert!(matches!(error, DistanceError::Flat { .. }), "{error}");
        flat.positions.iter_mut().for_each(|p| p.z *= 1e6);
        assert!(Body::new(&flat).is_ok(), "a millimetre is enough");
    }

    #[test]
    fn triangles_without_area_leave_distances_unchanged() {
        // The top of the cube with a vertex in the middle of its diagonal, used by one side alone: a triangle without
        // area closes the gap.
        let mut mesh = cube();
        mesh.positions.push(DVec3::new(0.5, 0.5, 1.0));
        // Triangles 2 and 3 are the top, [4, 5, 7] and [4, 7, 6].
        mesh.triangles.extend([[4, 5, 8], [8, 5, 7], [4, 8, 7]]);
        mesh.triangles.remove(2);
        let body = Body::new(&mesh).unwrap();
        for (x, expected) in [
            (DVec3::new(0.25, 0.25, 1.5), 0.5),
            (DVec3::new(0.5, 0.5, 1.25), 0.25),
            (DVec3::new(0.5, 0.5, 0.75), -0.25),
            (DVec3::new(0.75, 0.75, 0.9), -0.1),
        ] {
            let near = body.nearest(x);
            assert!((near.signed_distance - expected).abs() < 1e-12, "{x}: {near:?}");
            assert!((near.normal - DVec3::Z).length() < 1e-12, "{x}: {near:?}");
        }
    }

    #[test]
    fn cached_lattice_values_equal_fresh_distances_and_a_covered_body_has_its_own() {
        let body = Body::new(&cuboid(DVec3::ZERO, DVec3::splat(0.02))).unwrap();
        let points = [IVec3::new(2, 2, 6), IVec3::new(-1, 2, 2), IVec3::new(2, 2, 6), IVec3::new(2, 1, 3)];
        let exact = |body: &Body| points.map(|i| body.nearest(i.as_dvec3() * LATTICE_SIDE).signed_distance);
        assert_eq!(body.at_lattice(&points[..2]), exact(&body)[..2]);
        assert_eq!(body.clone().at_lattice(&points), exact(&body));
        let lid = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(0.01 + x, 0.01 + y, 0.024));
        let covered = body.covered_by(&TriMesh::new(lid.to_vec(), vec![[0, 1, 2]])).unwrap();
        assert_eq!(covered.at_lattice(&points), exact(&covered));
        assert_ne!(exact(&covered), exact(&body));
        assert_eq!(body.at_lattice(&points), exact(&body));
    }

    /// A square of two triangles at height z, facing up.
    fn sheet(half: f64, z: f64) -> TriMesh {
        let at = |x: f64, y: f64| DVec3::new(half * x, half * y, z);
        let corners = vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn distances_above_below_and_past_the_edge_of_a_covering_cloth() {
        // Skin at 0, cloth 3 mm above its middle.
        let body = Body::new_open(&sheet(1.0, 0.0)).unwrap().covered_by(&sheet(0.1, 3e-3)).unwrap();
        for (x, y, z, expected) in [
            (0.0, 0.01, 5e-3, 2e-3),
            // Between cloth and skin: inside, at the distance to the cloth.
            (0.0, 0.01, 1e-3, -2e-3),
            // Inside the skin too.
            (0.0, 0.01, -4e-3, -7e-3),
            // Deeper than the covering depth: the distance to the skin.
            (0.0, 0.01, -0.03, -0.03),
            // Past its edge, below it: the skin is nearest, and the point is outside.
            (0.15, 0.0, 1e-3, 1e-3),
            // Past its edge and high up.
            (0.13, 0.01, 0.043, 0.043),
        ] {
            let near = body.nearest(DVec3::new(x, y, z));
            assert!((near.signed_distance - expected).abs() < 1e-12, "{x} {z}: {near:?}");
            assert!((near.normal - DVec3::Z).length() < 1e-9, "{x} {z}: {near:?}");
        }
        // Beside the edge, nearer to it than to the skin: an unsigned obstacle.
        let beside = body.nearest(DVec3::new(0.101, 0.0, 3e-3));
        assert!(
            (beside.signed_distance - 1e-3).abs() < 1e-12 && (beside.normal - DVec3::X).length() < 1e-9,
            "{beside:?}"
        );
        let all = [DVec3::new(0.0, 0.01, 5e-3), DVec3::new(0.0, 0.01, -0.03), DVec3::new(0.0, 0.01, 1e-3)];
        let one_by_one: Vec<_> = all.iter().map(|x| body.nearest(*x)).collect();
        assert_eq!(body.nearest_all(&all), one_by_one);
    }
}
