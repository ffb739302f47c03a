//! Joining small PARTs (`--min-part N`): the smallest PART under N vertices goes to the neighbour with the longest common
//! seam, until none is left that has a neighbour.
//!
//! Ties go to the lower number throughout, so the result does not depend on the machine. The joined PART keeps the level of the
//! one that took it. Limits: a small PART that is a garment component of its own has no neighbour and stays.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::mesh::{Topology, TriMesh};

use super::{Parts, UNASSIGNED};

impl Parts {
    /// PARTs of at least `min_vertices` wherever there is a neighbour to join.
    #[must_use]
    pub fn join_small(&self, topology: &Topology, mesh: &TriMesh, min_vertices: usize) -> Self {
        let mut border: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); self.parts.len()];
        for (seam, &length) in self.seams.iter().zip(&self.seam_lengths_m(mesh)) {
            let [p, q] = seam.parts;
            border[p as usize].insert(q, length);
            border[q as usize].insert(p, length);
        }
        let mut size: Vec<usize> = self.parts.iter().map(|p| p.vertices.len()).collect();
        let mut owner: Vec<u32> = (0..self.parts.len() as u32).collect();
        let mut small: BinaryHeap<_> = size.iter().zip(0u32..).map(|(&s, p)| Reverse((s, p))).collect();
        while let Some(Reverse((s, p))) = small.pop() {
            let i = p as usize;
            if s >= min_vertices {
                break;
            }
            if owner[i] != p || size[i] != s {
                continue;
            }
            // Strictly longer wins, so of equal seams the lower number.
            let longest = |best: Option<(u32, f64)>, (&q, &l): (&u32, &f64)| match best {
                Some((_, b)) if l <= b => best,
                _ => Some((q, l)),
            };
            let Some((q, _)) = border[i].iter().fold(None, longest) else { continue };
            owner[i] = q;
            size[q as usize] += s;
            for (r, length) in std::mem::take(&mut border[i]) {
                border[r as usize].remove(&p);
                if r != q {
                    *border[r as usize].entry(q).or_insert(0.0) += length;
                    *border[q as usize].entry(r).or_insert(0.0) += length;
                }
            }
            small.push(Reverse((size[q as usize], q)));
        }
        let root = |mut p: u32| {
            while owner[p as usize] != p {
                p = owner[p as usize];
            }
            p
        };
        let label: Vec<u32> =
            self.part_of_vertex.iter().map(|&p| if p == UNASSIGNED { UNASSIGNED } else { root(p) }).collect();
        let level_of = |label: u32| self.parts[label as usize].level;
        Self::from_labels(topology, &label, level_of, self.own_extent.clone(), self.hole_vertices)
    }
}
