//! The state of a mesh in figures, and of a body and a garment together.

use super::{Topology, TriMesh};

/// A triangle lower than this share of its longest edge has no area worth the name.
const NO_AREA: f64 = 1e-9;

/// What is wrong with a mesh, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Findings {
    /// Edges of three triangles and more.
    pub non_manifold_edges: usize,
    /// Vertices with more than two boundary edges.
    pub pinched_vertices: usize,
    /// Triangles without area.
    pub no_area: usize,
}

impl Findings {
    /// Counts.
    #[must_use]
    pub fn new(mesh: &TriMesh, topology: &Topology) -> Self {
        let mut boundary = vec![0u32; mesh.vertex_count()];
        for (edge, _) in topology.edges.iter().zip(&topology.edge_valence).filter(|&(_, &v)| v == 1) {
            edge.iter().for_each(|&v| boundary[v as usize] += 1);
        }
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
