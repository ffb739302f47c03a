//! Cutting PARTs to a largest extent along the cloth (`--max-extent`).
//!
//! A level of an undraped garment is often a ring, and a ring that moves as one cannot fold. Each PART is cut by
//! farthest-point seeds (Gonzalez 1985: "Clustering to minimize the maximum intercluster distance", Theoretical Computer
//! Science 38): the first seed is the PART's lowest vertex, the next always the vertex farthest from all seeds, until none is
//! farther than half the extent; every vertex goes to its nearest seed. Distance runs along garment edges inside the
//! PART (Dijkstra), so two vertices of a piece are at most one extent apart along the cloth, and the pieces are connected.
//!
//! Limits: a path along edges is up to 15 % longer than the geodesic on a regular triangulation, so pieces come out that much
//! smaller than asked, never larger. Non-positive extents make every vertex a PART; an infinite one or NaN cuts nothing.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::mesh::{Topology, TriMesh};

use super::{Parts, UNASSIGNED};

impl Parts {
    /// The same PARTs, each cut until none is wider than `extent_m` metres along the cloth.
    #[must_use]
    pub fn cut_to_extent(&self, mesh: &TriMesh, topology: &Topology, extent_m: f64) -> Self {
        let mut place = vec![0u32; self.part_of_vertex.len()];
        for part in &self.parts {
            for (&v, i) in part.vertices.iter().zip(0..) {
                place[v as usize] = i;
            }
        }
        let pieces = self.map(|number, part| {
            let inside = |w: u32| self.part_of_vertex[w as usize] == number as u32;
            let local = |w: u32| inside(w).then(|| place[w as usize] as usize);
            nearest_seeds(&part.vertices, local, mesh, topology, (extent_m, usize::MAX)).unwrap_or_default()
        });
        let mut label = vec![UNASSIGNED; self.part_of_vertex.len()];
        let mut level_of_label = Vec::new();
        for (part, (seed_of_vertex, seeds)) in self.parts.iter().zip(&pieces) {
            let first = level_of_label.len() as u32;
            for (&v, &seed) in part.vertices.iter().zip(seed_of_vertex) {
                label[v as usize] = first + seed;
            }
            level_of_label.extend(std::iter::repeat_n(part.level, *seeds));
        }
        let level_of = |label: u32| level_of_label[label as usize];
        Self::from_labels(topology, &label, level_of, self.parts_per_level.len(), self.hole_vertices)
    }
}

/// The nearest seed of each of these connected vertices, and how many seeds it takes. `local` is the place of a vertex in the
/// list, `None` for others; with more than `most` seeds it gives up.
pub(crate) fn nearest_seeds(
    vertices: &[u32],
    local: impl Fn(u32) -> Option<usize>,
    mesh: &TriMesh,
    topology: &Topology,
    (extent_m, most): (f64, usize),
) -> Option<(Vec<u32>, usize)> {
    let mut distance = vec![f64::INFINITY; vertices.len()];
    let mut seed_of_vertex = vec![0u32; vertices.len()];
    let mut seeds = 0;
    let mut next = 0;
    let mut heap: BinaryHeap<Reverse<(Order, usize)>> = BinaryHeap::new();
    loop {
        distance[next] = 0.0;
        seed_of_vertex[next] = seeds as u32;
        heap.push(Reverse((Order(0.0), next)));
        while let Some(Reverse((Order(d), i))) = heap.pop() {
            if d > distance[i] {
                continue;
            }
            let v = vertices[i];
            for &w in topology.neighbours(v) {
                let Some(j) = local(w) else { continue };
                let far = d + mesh.positions[v as usize].distance(mesh.positions[w as usize]);
                if far < distance[j] {
                    distance[j] = far;
                    seed_of_vertex[j] = seeds as u32;
                    heap.push(Reverse((Order(far), j)));
                }
            }
        }
        seeds += 1;
        // The first of the farthest, so that ties do not depend on anything but the numbering.
        let farthest = |best: usize, i: usize| if distance[i] > distance[best] { i } else { best };
        next = (0..distance.len()).fold(0, farthest);
        if distance[next] <= 0.5 * extent_m || distance[next] == 0.0 || extent_m.is_nan() {
            return Some((seed_of_vertex, seeds));
        }
        if seeds >= most {
            return None;
        }
    }
}

/// A finite, non-negative distance with a total order, for the heap.
#[derive(PartialEq, Clone, Copy)]
struct Order(f64);

impl Eq for Order {}

impl PartialOrd for Order {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Order {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}
