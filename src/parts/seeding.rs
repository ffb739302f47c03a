//! Farthest-point seeds over one connected piece of cloth, with Dijkstra's distances along its edges.
//!
//! Where a level's extent differs along weft and warp, the length of an edge is
//!
//! ```text
//! l² = (a l_u)² + (b l_v)²
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | l_u, l_v | length of an edge along weft and warp, placed | m |
//! | a, b | factors along weft and warp ([`Extent::evened`](super::range_table::Extent::evened)) | – |
//!
//! Source: own; the seeds are Gonzalez's (see `stage_one`). The direction of an edge is that of the rest shape (the warp runs up the
//! garment and along a sleeve), its length that of the placed garment; an edge between two triangles takes the mean of both directions.
//! Ties go to the lowest vertex. Limits: the direction is as accurate as the rest shape's grain.
//!
//! Not used: moving each seed to the middle of its piece (Lloyd's relaxation). On five garments at five extents it often exceeded the
//! extent, and elsewhere reduced the representable error by 0 to 6 % for up to three times the time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ordered_float::OrderedFloat;

use crate::mesh::{Csr, RestShape, Topology, TriMesh};

/// Squared lengths of every garment edge along weft and warp.
#[derive(Debug, Clone, PartialEq)]
pub struct Grain {
    /// l_u², l_v² from each vertex to its neighbours, in the order of [`Topology::neighbours`], m².
    squares: Csr<[f64; 2]>,
}

impl Grain {
    /// Takes the directions from the rest shape, which has the triangles of the mesh.
    #[must_use]
    pub fn new(mesh: &TriMesh, topology: &Topology, rest: &RestShape) -> Self {
        let of_edge: Vec<[f64; 2]> = (0..topology.edges.len()).map(|e| squares(mesh, topology, rest, e)).collect();
        let mut squares = Csr::default();
        for v in 0..mesh.vertex_count() as u32 {
            let edges = topology.neighbours(v).iter().filter_map(|&w| topology.edge_between(v, w));
            squares.push(edges.map(|e| of_edge[e]));
        }
        Self { squares }
    }
}

fn squares(mesh: &TriMesh, topology: &Topology, rest: &RestShape, edge: usize) -> [f64; 2] {
    let [a, b] = topology.edges[edge];
    let along_warp = |&t: &u32| {
        let (triangle, corners) = (mesh.triangles.get(t as usize)?, rest.corners.get(t as usize)?);
        let corner = |v: u32| triangle.iter().position(|&c| c == v).map(|i| corners[i]);
        let d = corner(b)? - corner(a)?;
        (d.length_squared() > 0.0).then(|| d.y * d.y / d.length_squared())
    };
    let shares: Vec<f64> = topology.edge_triangles[edge].iter().filter_map(along_warp).collect();
    // Without a rest direction the edge counts as diagonal.
    let warp = if shares.is_empty() { 0.5 } else { shares.iter().sum::<f64>() / shares.len() as f64 };
    let square = mesh.positions[a as usize].distance_squared(mesh.positions[b as usize]);
    [square * (1.0 - warp), square * warp]
}

/// Measures edge lengths along the cloth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ruler<'a> {
    /// The garment.
    pub(super) mesh: &'a TriMesh,
    /// Its connectivity.
    pub(super) topology: &'a Topology,
    /// The grain, with the factors for lengths along weft and warp; `None` for unscaled lengths.
    pub(super) grain: Option<(&'a Grain, [f64; 2])>,
}

impl Ruler<'_> {
    /// The neighbours of a vertex with their distances, m.
    fn neighbours(&self, v: u32) -> impl Iterator<Item = (u32, f64)> {
        let x = self.mesh.positions[v as usize];
        self.topology.neighbours(v).iter().enumerate().map(move |(i, &w)| {
            let length = match self.grain {
                None => x.distance(self.mesh.positions[w as usize]),
                Some((grain, [weft, warp])) => {
                    let [u, v] = grain.squares.of(v as usize)[i];
                    (weft * weft * u + warp * warp * v).sqrt()
                }
            };
            (w, length)
        })
    }
}

/// The nearest seed of each of these connected vertices, and the number of seeds needed so that none is farther than half of
/// `extent_m`. Each seed is placed on the vertex farthest from those before. `local` gives the index of a vertex in the list, `None`
/// for others.
pub(super) fn nearest_seeds(
    vertices: &[u32],
    local: impl Fn(u32) -> Option<usize>,
    ruler: Ruler<'_>,
    extent_m: f64,
) -> (Vec<u32>, usize) {
    // The edges inside the piece, by index in its list: neighbour and length, m.
    let mut graph = Csr::default();
    for &v in vertices {
        graph.push(ruler.neighbours(v).filter_map(|(w, length)| Some((local(w)?, length))));
    }
    let mut nearest = NearestSeed {
        distance: vec![f64::INFINITY; vertices.len()],
        seed_of_vertex: vec![0; vertices.len()],
        parent: vec![usize::MAX; vertices.len()],
    };
    let enough = |radius_m: f64| radius_m <= 0.5 * extent_m || radius_m == 0.0 || extent_m.is_nan();
    let (mut next, mut radius_m, mut seeds) = (0, f64::INFINITY, 0);
    // Every vertex is a seed at the latest where the radius is 0.
    while seeds < vertices.len() && (seeds == 0 || !enough(radius_m)) {
        nearest.add(seeds, next, &graph);
        (next, radius_m) = nearest.farthest();
        seeds += 1;
    }
    (nearest.seed_of_vertex, seeds)
}

/// The nearest seed of every vertex.
struct NearestSeed {
    distance: Vec<f64>,
    seed_of_vertex: Vec<u32>,
    /// The vertex before each on its path from the seed.
    parent: Vec<usize>,
}

impl NearestSeed {
    /// Puts a seed on a vertex; Dijkstra's algorithm over the vertices that are nearer to it than to any seed before.
    fn add(&mut self, seed: usize, at: usize, graph: &Csr<(usize, f64)>) {
        self.distance[at] = 0.0;
        self.seed_of_vertex[at] = seed as u32;
        self.parent[at] = usize::MAX;
        let mut heap = BinaryHeap::from([Reverse((OrderedFloat(0.0), at))]);
        while let Some(Reverse((OrderedFloat(d), i))) = heap.pop() {
            if d > self.distance[i] {
                continue;
            }
            for &(j, length) in graph.of(i) {
                // A vertex whose path leads through i keeps the seed of i, even if rounding makes its new path no shorter: so pieces
                // are connected.
                let follows = self.parent[j] == i && self.seed_of_vertex[j] != self.seed_of_vertex[i];
                if d + length < self.distance[j] || follows {
                    self.distance[j] = d + length;
                    self.seed_of_vertex[j] = self.seed_of_vertex[i];
                    self.parent[j] = i;
                    heap.push(Reverse((OrderedFloat(d + length), j)));
                }
            }
        }
    }

    /// The vertex farthest from all seeds, and its distance, m.
    fn farthest(&self) -> (usize, f64) {
        let farther = |best: (usize, f64), (i, &d): (usize, &f64)| if d > best.1 { (i, d) } else { best };
        self.distance.iter().enumerate().fold((0, 0.0), farther)
    }
}
