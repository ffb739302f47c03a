//! Bending's quadratic form summed up over its elements: a scalar for every pair of vertices that bend together.
//!
//! E = ½ Σ Q_ij x_i·x_j, and the rows of Q sum to zero, so the gradient is
//!
//! (Q x)_i = Σ_j Q_ij (x_j − x_i):
//!
//! what a pair adds to one vertex it takes from the other, and E = ½ Σ x_i·(Q x)_i. Differences keep digits that coordinates
//! lose: without them the energy of a skirt would be off by 10⁻¹³ J, which a line search feels.
//! The product costs a sixth of the elements one by one.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | Q_ij | sum of the elements' scalars for a pair of vertices | N/m |

use std::ops::Range;

use crate::mechanics::lanes::{Four, Lanes, Pack};

/// The pairs j < i with Q_ij, by i, two at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct Plate {
    /// First two of each i.
    starts: Vec<u32>,
    twos: Vec<Two>,
    /// Q_ii, N/m: what its pairs add up to.
    own: Vec<f64>,
}

/// Two pairs of one i.
#[derive(Debug, Clone, Copy)]
struct Two {
    others: [u32; 2],
    scalars: [f64; 2],
}

impl Plate {
    /// From the Hessian's scalars, each pair of an element once.
    pub(super) fn new(vertices: usize, hessian: impl Iterator<Item = ([u32; 2], f64)>) -> Self {
        let of_pair = |([a, b], scalar): ([u32; 2], f64)| (a.max(b), a.min(b), scalar);
        let all: Vec<(u32, u32, f64)> = hessian.map(of_pair).filter(|(i, j, _)| i != j).collect();
        let mut ends = vec![0usize; vertices + 1];
        for &(i, ..) in &all {
            ends[i as usize + 1] += 1;
        }
        for i in 0..vertices {
            ends[i + 1] += ends[i];
        }
        // In the order of their elements by i, then by j: sorts are stable, so that equal entries are summed in that order.
        let mut next = ends.clone();
        let mut by_row = vec![(0u32, 0.0f64); all.len()];
        for (i, j, scalar) in all {
            by_row[next[i as usize]] = (j, scalar);
            next[i as usize] += 1;
        }
        let mut plate = Self { starts: vec![0], own: vec![0.0; vertices], ..Self::default() };
        let mut row: Vec<(u32, f64)> = Vec::new();
        for i in 0..vertices {
            let entries = &mut by_row[ends[i]..ends[i + 1]];
            entries.sort_by_key(|e| e.0);
            row.clear();
            for same in entries.chunk_by(|a, b| a.0 == b.0) {
                let (j, scalar) = (same[0].0, same.iter().map(|e| e.1).sum());
                row.push((j, scalar));
                plate.own[i] -= scalar;
                plate.own[j as usize] -= scalar;
            }
            // Filled up by what it has already, and not by i, whose sum the product keeps to itself.
            if let (1, Some(&(j, _))) = (row.len() % 2, row.first()) {
                row.push((j, 0.0));
            }
            for two in row.as_chunks::<2>().0 {
                plate.twos.push(Two { others: two.map(|e| e.0), scalars: two.map(|e| e.1) });
            }
            plate.starts.push(plate.twos.len() as u32);
        }
        plate
    }

    /// Q_ii, N/m.
    pub(super) fn own(&self, i: usize) -> f64 {
        self.own[i]
    }

    /// Two ranges of vertices with about as many pairs each.
    pub(super) fn halves(&self) -> [Range<usize>; 2] {
        let vertices = self.starts.len().saturating_sub(1);
        let middle = self.starts.partition_point(|&s| 2 * (s as usize) < self.twos.len()).min(vertices);
        [0..middle, middle..vertices]
    }

    /// Adds the gradient of the pairs of `vertices` to `gradient`, N, which must be zero before; returns their energy, J.
    #[inline(always)]
    pub(super) fn add_gradient<L: Lanes>(
        &self,
        l: L,
        vertices: Range<usize>,
        x: &[Four],
        gradient: &mut [Four],
    ) -> f64 {
        // Of one length, so that one check of an index does for both.
        let gradient = &mut gradient[..x.len()];
        for i in vertices {
            let here = l.load(&x[i]);
            let mut sum = l.load(&gradient[i]);
            for two in &self.twos[self.starts[i] as usize..self.starts[i + 1] as usize] {
                let [j, k] = [two.others[0] as usize, two.others[1] as usize];
                // What the other gets; in this order a load is an operand and no instruction of its own.
                let push = l.mul(l.sub(here, l.load(&x[j])), l.splat(two.scalars[0]));
                sum = l.sub(sum, push);
                gradient[j] = l.store(l.add(push, l.load(&gradient[j])));
                let push = l.mul(l.sub(here, l.load(&x[k])), l.splat(two.scalars[1]));
                sum = l.sub(sum, push);
                gradient[k] = l.store(l.add(push, l.load(&gradient[k])));
            }
            gradient[i] = l.store(sum);
        }
        let mut energy = Pack::splat(l, 0.0);
        for (x, g) in x.iter().zip(&*gradient) {
            energy = energy + Pack::load(l, x) * Pack::load(l, g);
        }
        0.5 * energy.sum()
    }
}
