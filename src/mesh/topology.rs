//! Edges, neighbours, boundary loops and edge distances of a triangle mesh, in a deterministic order.
//!
//! Edges are sorted by (smaller vertex, larger vertex); neighbours are sorted by index; so everything that iterates over
//! them sums in the same order on any number of threads.

use std::collections::BTreeMap;

use glam::DVec3;

use super::csr::Csr;
use super::{TriMesh, pieces};

/// No index: no triangle on that side of an edge, no further vertex in a list of fixed length, no parent in a tree.
pub const NONE: u32 = u32::MAX;

/// The connectivity of a [`TriMesh`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Topology {
    /// Vertex pairs, smaller index first, sorted.
    pub edges: Vec<[u32; 2]>,
    /// The first two triangles at each edge (by index); [`NONE`] where there is no second.
    pub edge_triangles: Vec<[u32; 2]>,
    /// How many triangles share each edge: 1 boundary, 2 inside, more is non-manifold.
    pub edge_valence: Vec<u32>,
    neighbours: Csr<u32>,
}

impl Topology {
    /// Reads the connectivity off the triangles.
    #[must_use]
    pub fn new(mesh: &TriMesh) -> Self {
        Self::of(&mesh.triangles, mesh.vertex_count())
    }

    /// The connectivity of triangles over a number of vertices.
    pub(crate) fn of(triangles: &[[u32; 3]], vertices: usize) -> Self {
        // The larger end and the triangle of each side, by its smaller end.
        let side = |i: u32, j: u32, t: u32| (i.min(j), (i.max(j), t));
        let sides = || {
            let triangles = triangles.iter().zip(0..);
            triangles.flat_map(move |(&[a, b, c], t)| [side(a, b, t), side(b, c, t), side(c, a, t)])
        };
        let mut halves = Csr::gathered(vertices, sides);
        let mut topology = Self::default();
        for a in 0..vertices as u32 {
            let halves = halves.of_mut(a as usize);
            halves.sort_unstable();
            for &(b, t) in &*halves {
                if topology.edges.last() == Some(&[a, b]) {
                    let last = topology.edges.len() - 1;
                    if topology.edge_valence[last] == 1 {
                        topology.edge_triangles[last][1] = t;
                    }
                    topology.edge_valence[last] += 1;
                } else {
                    topology.edges.push([a, b]);
                    topology.edge_triangles.push([t, NONE]);
                    topology.edge_valence.push(1);
                }
            }
        }
        drop(halves);
        // Edges come sorted by (a, b): first the smaller neighbours of each vertex, then the larger, each ascending.
        let edges = &topology.edges;
        let smaller = || edges.iter().map(|&[a, b]| (b, a));
        topology.neighbours = Csr::gathered(vertices, || smaller().chain(edges.iter().map(|&[a, b]| (a, b))));
        topology
    }

    /// Vertices joined to `v` by an edge, ascending.
    #[must_use]
    pub fn neighbours(&self, v: u32) -> &[u32] {
        self.neighbours.of(v as usize)
    }

    /// Index of the edge between two vertices.
    pub(crate) fn edge_between(&self, a: u32, b: u32) -> Option<usize> {
        self.edges.binary_search(&[a.min(b), a.max(b)]).ok()
    }

    /// The edges of one triangle, ascending.
    pub(crate) fn boundary_edges(&self) -> impl Iterator<Item = [u32; 2]> {
        self.edges.iter().zip(&self.edge_valence).filter(|(_, valence)| **valence == 1).map(|(edge, _)| *edge)
    }

    /// Whether each vertex lies on a boundary edge.
    #[must_use]
    pub fn boundary_vertices(&self) -> Vec<bool> {
        let mut on = vec![false; self.neighbours.len()];
        self.boundary_edges().flatten().for_each(|v| on[v as usize] = true);
        on
    }

    /// Component number of each vertex (by smallest vertex index) and how many components there are.
    #[must_use]
    pub fn components(&self) -> (Vec<u32>, usize) {
        let n = self.neighbours.len();
        let all = pieces(n, |v| self.neighbours.of(v), |_, _| true);
        let mut component = vec![NONE; n];
        for (number, piece) in (0..).zip(&all) {
            piece.iter().for_each(|&v| component[v as usize] = number);
        }
        (component, all.len())
    }

    /// Boundary loops as vertex cycles, each starting at its smallest vertex, ordered by it. A pinched boundary vertex
    /// (more than two boundary edges) is walked through at its lowest unused edge.
    #[must_use]
    pub fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let mut links: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for [a, b] in self.boundary_edges() {
            links.entry(a).or_default().push(b);
            links.entry(b).or_default().push(a);
        }
        let mut loops = Vec::new();
        // All edges before the last start are used.
        let mut from = 0;
        while let Some(start) = links.range(from..).find(|(_, ends)| !ends.is_empty()).map(|(&start, _)| start) {
            from = start;
            let mut cycle = vec![start];
            let mut at = start;
            while let Some(ends) = links.get_mut(&at).filter(|ends| !ends.is_empty()) {
                let next = ends.remove(0);
                if let Some(back) = links.get_mut(&next)
                    && let Some(i) = back.iter().position(|&v| v == at)
                {
                    back.remove(i);
                }
                if next == start {
                    break;
                }
                cycle.push(next);
                at = next;
            }
            loops.push(cycle);
        }
        loops
    }
}

/// Buckets of a [`Dijkstra`] at most; the last one holds all vertices that are farther.
const MAX_BUCKETS: usize = 1 << 16;

/// Edges whose mean length is the width of a bucket.
const SAMPLED_EDGES: usize = 256;

/// Dijkstra's algorithm along the edges of a mesh, its memory kept from run to run.
///
/// Vertices wait in buckets of equal width for a heap: within a bucket a vertex may be visited more than once, and the distances are
/// the same. Source: Meyer and Sanders: "Δ-stepping: a parallelizable shortest path algorithm" (2003).
pub(crate) struct Dijkstra<'a> {
    pub(crate) topology: &'a Topology,
    /// Positions of the vertices, m.
    pub(crate) positions: &'a [DVec3],
    /// Distance of each vertex from the nearest source, m; infinite if not reached.
    pub(crate) distance: Vec<f64>,
    /// The nearest source of each.
    pub(crate) source: Vec<u32>,
    /// The vertices reached, sources first.
    pub(crate) reached: Vec<u32>,
    /// Vertices with the distances at which they were added; all empty between runs.
    buckets: Vec<Vec<(f64, u32)>>,
    /// Buckets in 1 m.
    buckets_per_m: f64,
}

impl<'a> Dijkstra<'a> {
    pub(crate) fn new(topology: &'a Topology, positions: &'a [DVec3]) -> Self {
        let n = positions.len();
        let (distance, source) = (vec![f64::INFINITY; n], vec![0; n]);
        let edges = topology.edges.iter().step_by(topology.edges.len() / SAMPLED_EDGES + 1);
        let (sum, count) = edges.fold((0.0, 0.0), |(sum, count), &[a, b]| {
            (sum + positions[a as usize].distance(positions[b as usize]), count + 1.0)
        });
        let buckets_per_m = count / f64::max(sum, f64::MIN_POSITIVE);
        Self { topology, positions, distance, source, reached: Vec::new(), buckets: Vec::new(), buckets_per_m }
    }

    /// Computes the distances from `sources` over `allowed` vertices, below `limit`, m.
    pub(crate) fn run(&mut self, sources: &[u32], limit: f64, allowed: impl Fn(u32) -> bool) {
        for v in self.reached.drain(..) {
            self.distance[v as usize] = f64::INFINITY;
        }
        for &v in sources {
            self.distance[v as usize] = 0.0;
            self.source[v as usize] = v;
            self.reached.push(v);
            self.add(0.0, v);
        }
        let mut at = 0;
        while at < self.buckets.len() {
            let Some((d, v)) = self.buckets[at].pop() else {
                at += 1;
                continue;
            };
            if d > self.distance[v as usize] {
                continue;
            }
            for &w in self.topology.neighbours(v) {
                let there = d + self.positions[v as usize].distance(self.positions[w as usize]);
                let before = self.distance[w as usize];
                if there < limit && there < before && allowed(w) {
                    if before == f64::INFINITY {
                        self.reached.push(w);
                    }
                    self.distance[w as usize] = there;
                    self.source[w as usize] = self.source[v as usize];
                    self.add(there, w);
                }
            }
        }
    }

    fn add(&mut self, distance: f64, v: u32) {
        let bucket = ((distance * self.buckets_per_m) as usize).min(MAX_BUCKETS - 1);
        if bucket >= self.buckets.len() {
            self.buckets.resize_with(bucket + 1, Vec::new);
        }
        self.buckets[bucket].push((distance, v));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> TriMesh {
        TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y], vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn a_square_has_five_edges_and_one_loop() {
        let topology = Topology::new(&square());
        assert_eq!(topology.edges, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(topology.edge_valence, [1, 2, 1, 1, 1]);
        assert_eq!(topology.neighbours(0), [1, 2, 3]);
        assert_eq!(topology.neighbours(2), [0, 1, 3]);
        assert_eq!(topology.boundary_loops(), [vec![0, 1, 2, 3]]);
        assert_eq!(topology.components().1, 1);
    }

    #[test]
    fn distances_from_buckets_are_the_shortest_along_edges() {
        // A folded sheet of 30 by 30 with uneven edges, against relaxation until nothing changes (Bellman and Ford).
        let at = |i: f64, j: f64| DVec3::new(i + 0.4 * (3.0 * j).sin(), j * j / 30.0, (0.7 * i * j).sin());
        let mesh = crate::mesh::samples::sheet(30, 30, at);
        let topology = Topology::new(&mesh);
        let mut dijkstra = Dijkstra::new(&topology, &mesh.positions);
        for (sources, limit) in [(vec![0, 700], f64::INFINITY), (vec![444], 6.0)] {
            dijkstra.run(&sources, limit, |v| v % 11 != 3);
            let mut expected = vec![f64::INFINITY; mesh.vertex_count()];
            sources.iter().for_each(|&v| expected[v as usize] = 0.0);
            let mut changes = true;
            while std::mem::take(&mut changes) {
                for (a, b) in topology.edges.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
                    let length = mesh.positions[a as usize].distance(mesh.positions[b as usize]);
                    let there = expected[a as usize] + length;
                    if b % 11 != 3 && there < limit && there < expected[b as usize] {
                        (expected[b as usize], changes) = (there, true);
                    }
                }
            }
            assert_eq!(dijkstra.distance, expected);
            assert_eq!(dijkstra.reached.len(), expected.iter().filter(|d| d.is_finite()).count());
        }
    }

    #[test]
    fn areas_add_up() {
        let mesh = square();
        assert_eq!(mesh.triangle_areas(), [0.5, 0.5]);
        assert!((mesh.vertex_areas().iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!(mesh.vertex_normals().iter().all(|n| (*n - DVec3::Z).length() < 1e-15));
    }
}
