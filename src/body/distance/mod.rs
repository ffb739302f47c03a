//! Exact signed distance and closest points on the body.
//!
//! For a point x the closest surface point c(x) is that of its nearest triangle (`tree.rs`), by parry3d in double precision. The
//! signed distance is q(x) = ± |x − c(x)|, negative inside, its sign taken from the angle-weighted pseudo-normal at
//! c(x) (Bærentzen, Aanæs: "Signed distance computation using the angle weighted pseudonormal", IEEE TVCG 11(3), 2005);
//! its gradient ∇q = (x − c)/q is the paper's body normal e_q, whose direction cosines are cos α_q, cos β_q, cos γ_q
//! (equations 3 and 8). On the surface itself, where the quotient is undefined, the pseudo-normal stands in.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body, positive outside | m |
//! | ∇q | outward unit normal seen from x | – |
//!
//! Limits: the sign is exact for closed, consistently wound surfaces without self-intersections; where a body intersects
//! itself, points in the doubly covered pocket may read as outside. An open body has no inside: see [`Body::new_open`].

mod lattice;
mod layered_body;
mod protrusions;
mod tree;

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh as ParryMesh, TriMeshFlags, TrianglePointLocation};
use rayon::prelude::*;

pub(crate) use lattice::LATTICE_SIDE;
use lattice::Lattice;
pub(crate) use protrusions::OUTWARD;
use tree::{Nearest, Tree};

use crate::mesh::morton::along_a_curve;
use crate::mesh::winding::signed_volumes;
use crate::mesh::{Topology, TriMesh};

/// Closer than this to the surface (m), the direction to the closest point is rounding noise and the pseudo-normal is
/// used: 1e-9 m is a million times the spacing of doubles at body size, and a millionth of a cloth's thickness.
const ON_SURFACE: f64 = 1e-9;

/// Points that are asked for one after the other: in one task, each search beginning where the one before ended.
const CHUNK: usize = 128;

/// A volume under this share of the area to the power of one and a half (a sphere's is a tenth) is rounding: a sheet of two square metres is
/// then thinner than a micrometre, and neither side of it is inside.
const FLAT: f64 = 1e-6;

/// A distance to the triangle found that is off by more than this (m) from what made it the nearest was not told rightly.
const TOLD: f64 = 1e-9;

/// What can be wrong with a body.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum DistanceError {
    /// No triangle to be near to.
    #[error("the body has no triangles")]
    Empty,
    /// A boundary edge: the surface does not separate inside from outside.
    #[error("the body is not closed: {count} boundary edges, the first between vertices {a} and {b}")]
    Open { count: usize, a: u32, b: u32 },
    /// Nothing between one side and the other.
    #[error(
        "the body encloses no volume, though it is closed: expected a solid, found {area_m2:.3} m² of surface about {litres:.2e} litres; \
         are vertices at the wrong place, or is it a sheet?"
    )]
    Flat { area_m2: f64, litres: f64 },
    /// The query structure refused the mesh.
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

/// A body ready to be asked for distances; a clone shares its surface.
#[derive(Clone)]
pub struct Body {
    mesh: Arc<TriMesh>,
    shape: Arc<ParryMesh>,
    tree: Arc<Tree>,
    worn: Option<layered_body::Worn>,
    lattice: Arc<Lattice>,
}

impl std::fmt::Debug for Body {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Body").field("triangles", &self.shape.num_triangles()).finish_non_exhaustive()
    }
}

impl Body {
    /// Builds the hierarchy over a closed surface.
    pub fn new(mesh: &TriMesh) -> Result<Self, DistanceError> {
        let topology = Topology::new(mesh);
        let mut open = topology.boundary_edges();
        if let Some([a, b]) = open.next() {
            return Err(DistanceError::Open { count: open.count() + 1, a, b });
        }
        let (component, components) = topology.components();
        let volume: f64 = signed_volumes(mesh, &component, components).iter().map(|v| v.abs()).sum();
        let area: f64 = mesh.triangle_areas().iter().sum();
        if !mesh.triangles.is_empty() && volume <= FLAT * area.powf(1.5) {
            return Err(DistanceError::Flat { area_m2: area, litres: 1e3 * volume });
        }
        Self::new_open(mesh)
    }

    /// Builds the hierarchy over any surface; inside and outside are told by the normals alone, which is right near the
    /// surface and unreliable beyond its edges.
    pub fn new_open(mesh: &TriMesh) -> Result<Self, DistanceError> {
        if mesh.triangles.is_empty() {
            return Err(DistanceError::Empty);
        }
        // ORIENTED makes the pseudo-normals; nothing is merged or deleted, so triangle indices stay ours.
        let shape = || ParryMesh::with_flags(mesh.positions.clone(), mesh.triangles.clone(), TriMeshFlags::ORIENTED);
        let (shape, tree) = rayon::join(shape, || Tree::new(mesh));
        let shape = shape.map_err(|e| DistanceError::Refused(e.to_string()))?;
        Ok(Self {
            mesh: Arc::new(mesh.clone()),
            shape: Arc::new(shape),
            tree: Arc::new(tree),
            worn: None,
            lattice: Arc::default(),
        })
    }

    /// The surface, m, without what it wears.
    #[must_use]
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The nearest surface point to a finite `x`.
    #[must_use]
    pub fn nearest(&self, x: DVec3) -> SurfacePoint {
        self.outermost(x, self.bare(x, self.tree.nearest(&[x])[0]).0)
    }

    /// [`nearest`](Self::nearest) of every point, in parallel; the order, and every bit, is that of the input.
    #[must_use]
    pub fn nearest_all(&self, points: &[DVec3]) -> Vec<SurfacePoint> {
        let order = along_a_curve(points);
        let chunk = |chunk: &[u32]| {
            let here: Vec<DVec3> = chunk.iter().map(|&i| points[i as usize]).collect();
            let found = self.tree.nearest(&here);
            here.into_iter().zip(found).map(|(x, near)| self.outermost(x, self.bare(x, near).0)).collect::<Vec<_>>()
        };
        let found: Vec<SurfacePoint> = order.par_chunks(CHUNK).flat_map_iter(chunk).collect();
        let mut place = vec![0; points.len()];
        (0..).zip(&order).for_each(|(k, &i): (usize, _)| place[i as usize] = k);
        place.into_iter().map(|k| found[k]).collect()
    }

    /// The nearest point of the surface itself, and where on its triangle that is.
    fn bare(&self, x: DVec3, near: Nearest) -> (SurfacePoint, TrianglePointLocation) {
        let triangle = self.shape.triangle(near.triangle);
        let (projection, location) = triangle.project_local_point_and_get_location(x, false);
        let distance = x.distance(projection.point);
        if (distance - near.square.sqrt()).abs() > TOLD * distance.max(1.0) {
            // A sliver whose distance was rounding.
            let (projection, (triangle, location)) = self.shape.project_local_point_and_get_location(x, false);
            return (self.found(x, projection.point, (triangle, location)), location);
        }
        (self.found(x, projection.point, (near.triangle, location)), location)
    }

    fn found(&self, x: DVec3, point: DVec3, (triangle, location): (u32, TrianglePointLocation)) -> SurfacePoint {
        let offset = x - point;
        let distance = offset.length();
        let outward = self.pseudo_normal(triangle, location);
        let sign = if offset.dot(outward) <= 0.0 { -1.0 } else { 1.0 };
        let normal = if distance > ON_SURFACE { offset / (sign * distance) } else { outward };
        SurfacePoint { point, signed_distance: sign * distance, normal, triangle }
    }

    /// What of the body and what it wears is outermost at x.
    fn outermost(&self, x: DVec3, bare: SurfacePoint) -> SurfacePoint {
        self.worn.as_ref().map_or(bare, |worn| worn.outermost(x, bare))
    }

    fn pseudo_normal(&self, triangle: u32, location: TrianglePointLocation) -> DVec3 {
        let face = || self.shape.triangle(triangle).scaled_normal();
        let normal = match (location, self.shape.pseudo_normals()) {
            (TrianglePointLocation::OnVertex(i), Some(normals)) => {
                let v = self.shape.indices()[triangle as usize][i as usize];
                normals.vertices_pseudo_normal[v as usize]
            }
            (TrianglePointLocation::OnEdge(i, _), Some(normals)) => {
                normals.edges_pseudo_normal[triangle as usize][i as usize]
            }
            _ => face(),
        };
        normal.try_normalize().unwrap_or_else(|| face().normalize_or_zero())
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
    fn an_open_body_is_refused_with_its_first_edge() {
        let mut open = cube();
        open.triangles.pop();
        let error = Body::new(&open).unwrap_err();
        assert!(matches!(error, DistanceError::Open { count: 3, .. }), "{error}");
        assert!(Body::new_open(&open).is_ok());
        assert!(matches!(Body::new(&TriMesh::default()), Err(DistanceError::Empty)));
    }

    #[test]
    fn a_sheet_of_two_sides_encloses_nothing_and_is_refused() {
        let mut flat = cube();
        flat.positions.iter_mut().for_each(|p| p.z *= 1e-9);
        let error = Body::new(&flat).unwrap_err();
        assert!(matches!(error, DistanceError::Flat { .. }), "{error}");
        flat.positions.iter_mut().for_each(|p| p.z *= 1e6);
        assert!(Body::new(&flat).is_ok(), "a millimetre is enough");
    }

    #[test]
    fn triangles_without_area_in_the_body_do_no_harm() {
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
}
