//! Distances along the edges of a mesh.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;
use ordered_float::OrderedFloat;

use super::Topology;

/// Dijkstra's algorithm along the edges of a mesh, its memory kept from run to run.
pub(crate) struct Flow<'a> {
    pub(crate) topology: &'a Topology,
    /// Where the vertices are, m.
    pub(crate) placed: &'a [DVec3],
    /// Of each vertex that was reached, m.
    pub(crate) distance: Vec<f64>,
    /// The nearest source of each.
    pub(crate) source: Vec<u32>,
    /// Who was reached, sources first.
    pub(crate) reached: Vec<u32>,
    heap: BinaryHeap<Reverse<(OrderedFloat<f64>, u32)>>,
}

impl<'a> Flow<'a> {
    pub(crate) fn new(topology: &'a Topology, placed: &'a [DVec3]) -> Self {
        let n = placed.len();
        let (distance, source) = (vec![f64::INFINITY; n], vec![0; n]);
        Self { topology, placed, distance, source, reached: Vec::new(), heap: BinaryHeap::new() }
    }

    /// Distances, m, from `sources` over what is `allowed`, as far as `most`.
    pub(crate) fn run(&mut self, sources: &[u32], most: f64, allowed: impl Fn(u32) -> bool) {
        for v in self.reached.drain(..) {
            self.distance[v as usize] = f64::INFINITY;
        }
        for &v in sources {
            self.distance[v as usize] = 0.0;
            self.source[v as usize] = v;
            self.reached.push(v);
            self.heap.push(Reverse((OrderedFloat(0.0), v)));
        }
        while let Some(Reverse((OrderedFloat(d), v))) = self.heap.pop() {
            if d > self.distance[v as usize] {
                continue;
            }
            for &w in self.topology.neighbours(v) {
                let there = d + self.placed[v as usize].distance(self.placed[w as usize]);
                let before = self.distance[w as usize];
                if there < most && there < before && allowed(w) {
                    if before == f64::INFINITY {
                        self.reached.push(w);
                    }
                    self.distance[w as usize] = there;
                    self.source[w as usize] = self.source[v as usize];
                    self.heap.push(Reverse((OrderedFloat(there), w)));
                }
            }
        }
    }
}
