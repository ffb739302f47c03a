//! Mesh quality metrics: the figures that `partwise check` prints for a body and for a garment.

use serde::Serialize;

use super::self_intersection::self_intersecting_pairs;
use super::{Topology, TriMesh, winding};
use crate::base::math;
use crate::base::quantiles::Percentiles;

/// A triangle lower than this share of its longest edge counts as without area: with coordinates of seven digits its normal
/// is noise.
const NO_AREA: f64 = 1e-6;

/// Irregular edges, vertices and triangles of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Findings {
    /// Edges of three triangles and more.
    pub(super) non_manifold_edges: usize,
    /// Vertices with more than two boundary edges.
    pub(super) pinched_vertices: usize,
    /// Triangles without area.
    pub(super) no_area: usize,
}

impl Findings {
    pub(super) fn new(mesh: &TriMesh, topology: &Topology) -> Self {
        let mut boundary = vec![0u32; mesh.vertex_count()];
        topology.boundary_edges().flatten().for_each(|v| boundary[v as usize] += 1);
        let no_area = |&t: &usize| {
            let [a, b, c] = mesh.corners(t);
            let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            mesh.double_area_vector(t).length() <= NO_AREA * longest
        };
        Self {
            non_manifold_edges: topology.edge_valence.iter().filter(|&&v| v > 2).count(),
            pinched_vertices: boundary.iter().filter(|&&edges| edges > 2).count(),
            no_area: (0..mesh.triangles.len()).filter(no_area).count(),
        }
    }
}

/// Quality metrics of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names are the documentation")]
pub struct Health {
    pub vertices: usize,
    pub triangles: usize,
    pub components: usize,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Loops they form.
    pub boundary_loops: usize,
    pub closed: bool,
    /// Edges of three triangles and more.
    pub non_manifold_edges: usize,
    /// Vertices where the boundary touches itself.
    pub pinched_vertices: usize,
    /// Edges whose two triangles run the same way.
    pub disagreeing_edges: usize,
    pub no_area: usize,
    /// Pairs of triangles that cross, counted exactly.
    pub self_intersecting_pairs: usize,
    pub area_m2: f64,
    /// Enclosed volume, m³; of closed meshes alone.
    pub volume_m3: Option<f64>,
    /// Smallest angle of each triangle, degrees.
    pub min_angle_deg: Percentiles,
    pub edge_length_m: Percentiles,
}

/// Computes the metrics of a mesh; O(n log n).
#[must_use]
pub fn health(mesh: &TriMesh) -> Health {
    let topology = Topology::new(mesh);
    let findings = Findings::new(mesh, &topology);
    let (component, components) = topology.components();
    let boundary_edges = topology.boundary_edges().count();
    let closed = boundary_edges == 0 && !mesh.triangles.is_empty();
    let length = |&[a, b]: &[u32; 2]| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    let angles: Vec<f64> = (0..mesh.triangles.len()).map(|t| min_angle(mesh, t)).collect();
    let lengths: Vec<f64> = topology.edges.iter().map(length).collect();
    Health {
        vertices: mesh.vertex_count(),
        triangles: mesh.triangles.len(),
        components,
        boundary_edges,
        boundary_loops: topology.boundary_loops().len(),
        closed,
        non_manifold_edges: findings.non_manifold_edges,
        pinched_vertices: findings.pinched_vertices,
        disagreeing_edges: winding::disagreeing_edges(mesh, &topology),
        no_area: findings.no_area,
        self_intersecting_pairs: self_intersecting_pairs(mesh).len(),
        area_m2: mesh.triangle_areas().iter().sum(),
        volume_m3: closed.then(|| winding::signed_volumes(mesh, &component, components).iter().sum()),
        min_angle_deg: Percentiles::of(&angles),
        edge_length_m: Percentiles::of(&lengths),
    }
}

fn min_angle(mesh: &TriMesh, t: usize) -> f64 {
    let corners = mesh.corners(t);
    let angle = |k: usize| {
        let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
        // The tangent is accurate near zero, where the cosine is not.
        math::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
    };
    angle(0).min(angle(1)).min(angle(2))
}

impl Health {
    /// Name and value of each metric, as rows of a table.
    #[must_use]
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let closed = match self.volume_m3 {
            Some(volume) => format!("yes, {:.2} litres", 1e3 * volume),
            None => format!("no, {} boundary edges in {} loops", self.boundary_edges, self.boundary_loops),
        };
        let winding = match self.disagreeing_edges {
            0 => "consistent".to_owned(),
            edges => format!("turns over at {edges} edges"),
        };
        vec![
            ("vertices", self.vertices.to_string()),
            ("triangles", self.triangles.to_string()),
            ("connected parts", self.components.to_string()),
            ("closed", closed),
            ("area", format!("{:.3} m²", self.area_m2)),
            ("winding", winding),
            ("self-intersecting pairs", self.self_intersecting_pairs.to_string()),
            ("non-manifold edges", self.non_manifold_edges.to_string()),
            ("pinched boundary vertices", self.pinched_vertices.to_string()),
            ("triangles without area", self.no_area.to_string()),
            ("smallest angles, degrees", self.min_angle_deg.text(1.0, 1)),
            ("edge lengths, mm", self.edge_length_m.text(1e3, 1)),
        ]
    }
}
