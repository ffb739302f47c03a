//! What the search for gaps needs to know of a cloth, made once: which triangle looks for which vertices and edges.

use crate::mechanics::energy::membrane::Triangle;
use crate::mesh::{NONE, Topology};

/// The surface of a cloth, each vertex and each edge owned by one triangle.
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Its edges, and which vertices are neighbours.
    pub(super) topology: Topology,
    /// The corners opposite an edge, of its first two triangles; [`NONE`] where it has one.
    pub(super) wings: Vec<[u32; 2]>,
    /// A third of the rest area of an edge's triangles, m².
    pub(super) edge_areas: Vec<f64>,
    /// A third of the rest area of a vertex's triangles, m².
    pub(super) vertex_areas: Vec<f64>,
    /// How many triangles each vertex has.
    pub(super) vertex_triangles: Vec<u32>,
    /// The vertices that a triangle owns, [`NONE`] behind.
    pub(super) own_vertices: Vec<[u32; 3]>,
    /// The edges that a triangle owns, [`NONE`] behind.
    pub(super) own_edges: Vec<[u32; 3]>,
    /// Whether a sliver is at each vertex.
    pub(super) frail: Vec<bool>,
    /// Mean length of an edge at rest, m.
    pub(super) edge_m: f64,
}

impl Skin {
    pub(crate) fn new(triangles: &[Triangle], vertices: usize) -> Self {
        let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices).collect();
        let topology = Topology::of(&corners, vertices);
        let mut skin = Self {
            wings: Vec::with_capacity(topology.edges.len()),
            edge_areas: vec![0.0; topology.edges.len()],
            vertex_areas: vec![0.0; vertices],
            vertex_triangles: vec![0; vertices],
            own_vertices: vec![[NONE; 3]; triangles.len()],
            own_edges: vec![[NONE; 3]; triangles.len()],
            frail: vec![false; vertices],
            edge_m: 0.0,
            triangles: corners,
            topology,
        };
        for (e, (edge, at)) in (0..).zip(skin.topology.edges.iter().zip(&skin.topology.edge_triangles)) {
            push(&mut skin.own_edges[at[0] as usize], e);
            skin.wings
                .push(at.map(|t| skin.triangles.get(t as usize).map_or(NONE, |corners| opposite(*corners, *edge))));
        }
        for (t, triangle) in triangles.iter().enumerate() {
            let [a, b, c] = triangle.vertices;
            for e in [[a, b], [b, c], [c, a]].into_iter().filter_map(|[a, b]| skin.topology.edge_between(a, b)) {
                skin.edge_areas[e] += triangle.area / 3.0;
            }
            for &v in &triangle.vertices {
                skin.frail[v as usize] |= triangle.sliver;
                if skin.vertex_triangles[v as usize] == 0 {
                    push(&mut skin.own_vertices[t], v);
                }
                skin.vertex_triangles[v as usize] += 1;
                skin.vertex_areas[v as usize] += triangle.area / 3.0;
            }
        }
        let total: f64 = skin.vertex_areas.iter().sum();
        // Of equilateral triangles with this area.
        skin.edge_m = (4.0 * total / (3.0_f64.sqrt() * triangles.len().max(1) as f64)).sqrt();
        skin
    }
}

/// The corner of a triangle that is at neither end of its edge.
fn opposite(corners: [u32; 3], edge: [u32; 2]) -> u32 {
    corners.into_iter().find(|v| !edge.contains(v)).unwrap_or(NONE)
}

/// Puts one more into a list of at most three.
fn push(list: &mut [u32; 3], new: u32) {
    if let Some(free) = list.iter_mut().find(|v| **v == NONE) {
        *free = new;
    }
}
