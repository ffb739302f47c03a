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
    others: Vec<[u32; 2]>,
    scalars: Vec<[f64; 2]>,
}

impl Plate {
    /// From the Hessian's scalars, each pair of an element once.
    pub(super) fn new(vertices: usize, hessian: impl Iterator<Item = ([u32; 2], f64)>) -> Self {
        let of_pair = |([a, b], scalar): ([u32; 2], f64)| (a.max(b), a.min(b), scalar);
        let mut all: Vec<(u32, u32, f64)> = hessian.map(of_pair).filter(|(i, j, _)| i != j).collect();
        // Stable, so that equal entries are summed in the order of their elements.
        all.sort_by_key(|&(i, j, _)| (i, j));
        let mut plate = Self { starts: vec![0], ..Self::default() };
        let mut sums = all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).peekable();
        for i in 0..vertices as u32 {
            let mut row: Vec<(u32, f64)> = Vec::new();
            while let Some(same) = sums.next_if(|same| same[0].0 == i) {
                row.push((same[0].1, same.iter().map(|e| e.2).sum()));
            }
            if row.len() % 2 == 1 {
                row.push((i, 0.0));
            }
            for two in row.as_chunks::<2>().0 {
                plate.others.push(two.map(|e| e.0));
                plate.scalars.push(two.map(|e| e.1));
            }
            plate.starts.push(plate.others.len() as u32);
        }
        plate
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
            for (&[j, k], &[of_j, of_k]) in self.others[row.clone()].iter().zip(&self.scalars[row]) {
                let (j, k) = (j as usize, k as usize);
                let pull = l.mul(l.sub(l.load(&x[j]), here), l.splat(of_j));
                sum = l.add(sum, pull);
                gradient[j] = l.store(l.sub(l.load(&gradient[j]), pull));
                let pull = l.mul(l.sub(l.load(&x[k]), here), l.splat(of_k));
                sum = l.add(sum, pull);
                gradient[k] = l.store(l.sub(l.load(&gradient[k]), pull));
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
