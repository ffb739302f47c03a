//! The triangles of a cloth for the search of gaps. Each vertex and each edge is owned by one triangle, so that it is searched once.

use crate::mechanics::energy::membrane::Triangle;
use crate::mesh::{NONE, Topology};

/// Topology and rest areas of a cloth.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) topology: Topology,
    /// The corners opposite an edge in its first two triangles; [`NONE`] at the boundary.
    pub(super) wings: Vec<[u32; 2]>,
    /// A third of the rest area of the triangles at an edge, m².
    pub(super) edge_areas: Vec<f64>,
    /// A third of the rest area of the triangles at a vertex, m².
    pub(super) vertex_areas: Vec<f64>,
    /// Number of triangles at each vertex.
    pub(super) vertex_triangles: Vec<u32>,
    /// The vertices that a triangle owns, padded by [`NONE`].
    pub(super) own_vertices: Vec<[u32; 3]>,
    /// The edges that a triangle owns, padded by [`NONE`].
    pub(super) own_edges: Vec<[u32; 3]>,
    /// Whether a sliver touches each vertex.
    pub(super) near_sliver: Vec<bool>,
    /// Mean length of an edge at rest, m.
    pub(super) edge_m: f64,
}

impl Surface {
    pub(crate) fn new(triangles: &[Triangle], vertices: usize) -> Self {
        let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices).collect();
        let topology = Topology::of(&corners, vertices);
        let mut surface = Self {
            wings: Vec::with_capacity(topology.edges.len()),
            edge_areas: vec![0.0; topology.edges.len()],
            vertex_areas: vec![0.0; vertices],
            vertex_triangles: vec![0; vertices],
            own_vertices: vec![[NONE; 3]; triangles.len()],
            own_edges: vec![[NONE; 3]; triangles.len()],
            near_sliver: vec![false; vertices],
            edge_m: 0.0,
            triangles: corners,
            topology,
        };
        for (e, (edge, at)) in (0..).zip(surface.topology.edges.iter().zip(&surface.topology.edge_triangles)) {
            push(&mut surface.own_edges[at[0] as usize], e);
            surface
                .wings
                .push(at.map(|t| surface.triangles.get(t as usize).map_or(NONE, |corners| opposite(*corners, *edge))));
        }
        for (t, triangle) in triangles.iter().enumerate() {
            let [a, b, c] = triangle.vertices;
            for e in [[a, b], [b, c], [c, a]].into_iter().filter_map(|[a, b]| surface.topology.edge_between(a, b)) {
                surface.edge_areas[e] += triangle.area / 3.0;
            }
            for &v in &triangle.vertices {
                surface.near_sliver[v as usize] |= triangle.sliver;
                if surface.vertex_triangles[v as usize] == 0 {
                    push(&mut surface.own_vertices[t], v);
                }
                surface.vertex_triangles[v as usize] += 1;
                surface.vertex_areas[v as usize] += triangle.area / 3.0;
            }
        }
        let total: f64 = surface.vertex_areas.iter().sum();
        // The edge of equilateral triangles with the mean area.
        surface.edge_m = (4.0 * total / (3.0_f64.sqrt() * triangles.len().max(1) as f64)).sqrt();
        surface
    }
}

/// The corner of a triangle opposite an edge.
fn opposite(corners: [u32; 3], edge: [u32; 2]) -> u32 {
    corners.into_iter().find(|v| !edge.contains(v)).unwrap_or(NONE)
}

/// Appends to a list of at most three.
fn push(list: &mut [u32; 3], new: u32) {
    if let Some(free) = list.iter_mut().find(|v| **v == NONE) {
        *free = new;
    }
}
