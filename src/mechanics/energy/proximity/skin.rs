//! What the search for gaps needs to know of a cloth, made once: which triangle looks for which vertices and edges.

use crate::mechanics::energy::membrane::Triangle;

use super::gap::NONE;

/// The surface of a cloth, each vertex and each edge owned by one triangle.
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Ends of each edge, ascending.
    pub(super) edges: Vec<[u32; 2]>,
    /// The corners opposite an edge, of its first two triangles; [`NONE`] where it has one.
    pub(super) wings: Vec<[u32; 2]>,
    /// How many triangles each edge has.
    pub(super) edge_triangles: Vec<u32>,
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
    /// First of each vertex's neighbours, and one past the last.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    /// Mean length of an edge at rest, m.
    pub(super) edge_m: f64,
}

impl Skin {
    pub(crate) fn new(triangles: &[Triangle], vertices: usize) -> Self {
        let mut sides: Vec<([u32; 2], u32)> = (0u32..)
            .zip(triangles)
            .flat_map(|(t, triangle)| {
                let [a, b, c] = triangle.vertices;
                [[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], t))
            })
            .collect();
        sides.sort_unstable();
        let mut skin = Self {
            triangles: triangles.iter().map(|t| t.vertices).collect(),
            edges: Vec::new(),
            wings: Vec::new(),
            edge_triangles: Vec::new(),
            edge_areas: Vec::new(),
            vertex_areas: vec![0.0; vertices],
            vertex_triangles: vec![0; vertices],
            own_vertices: vec![[NONE; 3]; triangles.len()],
            own_edges: vec![[NONE; 3]; triangles.len()],
            frail: vec![false; vertices],
            starts: Vec::new(),
            neighbours: Vec::new(),
            edge_m: 0.0,
        };
        for of_edge in sides.chunk_by(|a, b| a.0 == b.0) {
            let (edge, owner) = of_edge[0];
            push(&mut skin.own_edges[owner as usize], skin.edges.len() as u32);
            skin.edges.push(edge);
            let mut wings = [NONE; 2];
            for (wing, (_, t)) in wings.iter_mut().zip(of_edge) {
                *wing = opposite(triangles[*t as usize].vertices, edge);
            }
            skin.wings.push(wings);
            skin.edge_triangles.push(of_edge.len() as u32);
            skin.edge_areas.push(of_edge.iter().map(|(_, t)| triangles[*t as usize].area / 3.0).sum());
        }
        for (t, triangle) in triangles.iter().enumerate() {
            for &v in &triangle.vertices {
                skin.frail[v as usize] |= triangle.sliver;
                if skin.vertex_triangles[v as usize] == 0 {
                    push(&mut skin.own_vertices[t], v);
                }
                skin.vertex_triangles[v as usize] += 1;
                skin.vertex_areas[v as usize] += triangle.area / 3.0;
            }
        }
        skin.link(vertices);
        let total: f64 = skin.vertex_areas.iter().sum();
        // Of equilateral triangles with this area.
        skin.edge_m = (4.0 * total / (3.0_f64.sqrt() * triangles.len().max(1) as f64)).sqrt();
        skin
    }

    fn link(&mut self, vertices: usize) {
        let mut pairs: Vec<[u32; 2]> = self.edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        pairs.sort_unstable();
        self.starts = vec![0; vertices + 1];
        for [a, _] in &pairs {
            self.starts[*a as usize + 1] += 1;
        }
        for v in 0..vertices {
            self.starts[v + 1] += self.starts[v];
        }
        self.neighbours = pairs.into_iter().map(|[_, b]| b).collect();
    }

    /// The vertices that share an edge with `v`, ascending.
    pub(super) fn neighbours(&self, v: u32) -> &[u32] {
        &self.neighbours[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
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
