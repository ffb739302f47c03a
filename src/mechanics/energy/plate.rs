//! Bending's quadratic form summed up over its elements, as a spring for every pair of vertices that bend together.
//!
//! E = ½ Σ Q_ij x_i·x_j, and the rows of Q sum to zero, so the gradient is
//!
//! (Q x)_i = Σ_j Q_ij (x_j − x_i):
//!
//! what a pair adds to one vertex it takes from the other, and differences keep digits that coordinates lose. E = ½ Σ x_i·(Q x)_i.
//! The product costs a sixth of the elements one by one.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | Q_ij | sum of the elements' scalars for a pair of vertices | N/m |

use std::ops::Range;

use crate::mechanics::lanes::{Four, Lanes, Pack};

/// The pairs j < i with Q_ij, by i.
#[derive(Debug, Clone, Default)]
pub(super) struct Plate {
    /// First pair of each i.
    starts: Vec<u32>,
    others: Vec<u32>,
    scalars: Vec<f64>,
    /// Q_ii, N/m: what its pairs add up to.
    own: Vec<f64>,
}

impl Plate {
    /// From the Hessian's scalars, each pair of an element once.
    pub(super) fn new(vertices: usize, hessian: impl Iterator<Item = ([u32; 2], f64)>) -> Self {
        let of_pair = |([a, b], scalar): ([u32; 2], f64)| (a.max(b), a.min(b), scalar);
        let mut all: Vec<(u32, u32, f64)> = hessian.map(of_pair).filter(|(i, j, _)| i != j).collect();
        // Stable, so that equal entries are summed in the order of their elements.
        all.sort_by_key(|&(i, j, _)| (i, j));
        let mut plate = Self { starts: vec![0; vertices + 1], own: vec![0.0; vertices], ..Self::default() };
        for same in all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let scalar: f64 = same.iter().map(|e| e.2).sum();
            plate.others.push(same[0].1);
            plate.scalars.push(scalar);
            plate.own[same[0].0 as usize] -= scalar;
            plate.own[same[0].1 as usize] -= scalar;
            plate.starts[same[0].0 as usize + 1] += 1;
        }
        for v in 0..vertices {
            plate.starts[v + 1] += plate.starts[v];
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
        let middle = self.starts.partition_point(|&s| 2 * (s as usize) < self.others.len()).min(vertices);
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
            let mut sum = l.splat(0.0);
            let row = self.starts[i] as usize..self.starts[i + 1] as usize;
            for (&j, &scalar) in self.others[row.clone()].iter().zip(&self.scalars[row]) {
                let j = j as usize;
                let pull = l.mul(l.sub(l.load(&x[j]), here), l.splat(scalar));
                sum = l.add(sum, pull);
                gradient[j] = l.store(l.sub(l.load(&gradient[j]), pull));
            }
            gradient[i] = l.store(l.add(l.load(&gradient[i]), sum));
        }
        let mut energy = Pack::splat(l, 0.0);
        for (x, g) in x.iter().zip(&*gradient) {
            energy = energy + Pack::load(l, x) * Pack::load(l, g);
        }
        0.5 * energy.sum()
    }
}
