//! Bending's quadratic form as a sparse matrix: one scalar for every pair of vertices that share an element.
//!
//! E = ½ Σ Q_ij x_i·x_j. The rows of Q sum to zero, so the gradient is
//!
//! (Q x)_i = Σ_j Q_ij (x_j − x_i),
//!
//! each pair adds opposite amounts to its two vertices, and E = ½ Σ x_i·(Q x)_i. Differences keep digits that coordinates
//! lose: without them the energy of a skirt has an error of 10⁻¹³ J, which disturbs a line search.
//! The product costs a sixth of a loop over the elements.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | Q_ij | sum of the scalars of the elements for a pair of vertices | N/m |

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::base::simd::{Four, Lanes, Pack};
use crate::mesh::Csr;

/// The entries Q_ij with j < i, by row, two at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct BendingMatrix {
    rows: Csr<EntryPair>,
    /// Q_ii, N/m: minus the sum of the other entries of the row.
    diagonal: Vec<f64>,
}

/// Two entries of one row.
#[derive(Debug, Clone, Copy)]
struct EntryPair {
    columns: [u32; 2],
    scalars: [f64; 2],
}

/// Rows, or rings, that a thread takes at a time.
pub(super) const ROWS_PER_TASK: usize = 256;

/// Appends row i from the elements that contain i, each with the position of i in it. Contributions are summed in the order of the elements.
fn gather<'a>(
    i: u32,
    elements: impl Iterator<Item = (&'a (&'a [u32], &'a [DVec3], DVec3), usize)>,
    row: &mut Vec<(u32, f64)>,
    rows: &mut Csr<EntryPair>,
) {
    row.clear();
    for ((vertices, weights, stiffness), at) in elements {
        for (k, &j) in vertices.iter().enumerate().filter(|(_, j)| **j < i) {
            row.push((j, (weights[at.max(k)] * *stiffness).dot(weights[at.min(k)])));
        }
    }
    // The sort is stable.
    row.sort_by_key(|e| e.0);
    row.dedup_by(|later, first| {
        let same = later.0 == first.0;
        if same {
            first.1 += later.1;
        }
        same
    });
    // An odd row is padded by a column it has already: the product keeps x_i and the sum of row i in registers.
    if let (1, Some(&(j, _))) = (row.len() % 2, row.first()) {
        row.push((j, 0.0));
    }
    rows.push(row.as_chunks::<2>().0.iter().map(|e| EntryPair { columns: e.map(|e| e.0), scalars: e.map(|e| e.1) }));
}

impl BendingMatrix {
    /// Sums elements, each given by its vertices, weights and stiffness.
    pub(super) fn new(vertices: usize, elements: &[(&[u32], &[DVec3], DVec3)]) -> Self {
        // Elements of each vertex in their order, and the position of the vertex in them.
        let of = Csr::gathered(vertices, || {
            let numbered = (0u32..).zip(elements);
            numbered.flat_map(|(e, element)| (0u32..).zip(element.0).map(move |(k, &v)| (v, (e, k))))
        });
        let numbers: Vec<usize> = (0..vertices).collect();
        let chunks: Vec<Csr<EntryPair>> = (numbers.par_chunks(ROWS_PER_TASK))
            .map(|chunk| {
                let (mut rows, mut row) = (Csr::default(), Vec::new());
                for &i in chunk {
                    let own = of.of(i).iter().map(|&(e, k)| (&elements[e as usize], k as usize));
                    gather(i as u32, own, &mut row, &mut rows);
                }
                rows
            })
            .collect();
        let mut matrix = Self { diagonal: vec![0.0; vertices], ..Self::default() };
        chunks.into_iter().for_each(|rows| matrix.rows.append(rows));
        for i in 0..vertices {
            for two in matrix.rows.of(i) {
                for (j, scalar) in two.columns.into_iter().zip(two.scalars) {
                    matrix.diagonal[i] -= scalar;
                    matrix.diagonal[j as usize] -= scalar;
                }
            }
        }
        matrix
    }

    /// Every pair [i, j] with j < i, and Q_ij (N/m); a few pairs appear twice, the second time with zero.
    pub(super) fn pairs(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        let both = move |i: usize, two: &EntryPair| [0, 1].map(|k| ([i as u32, two.columns[k]], two.scalars[k]));
        (0..self.diagonal.len()).flat_map(move |i| self.rows.of(i).iter().flat_map(move |two| both(i, two)))
    }

    /// Q_ii, N/m.
    pub(super) fn diagonal(&self, i: usize) -> f64 {
        self.diagonal[i]
    }

    /// Two ranges of rows with about as many entries each.
    pub(super) fn halves(&self) -> [Range<usize>; 2] {
        let (vertices, all) = (self.rows.len(), self.rows.entries().len());
        let middle = self.rows.starts().partition_point(|&s| 2 * (s as usize) < all).min(vertices);
        [0..middle, middle..vertices]
    }

    /// Adds the gradient of the entries in the rows of `vertices` to `gradient` (N), which must be zero before; returns their energy, J.
    #[inline(always)]
    pub(super) fn add_gradient<L: Lanes>(
        &self,
        l: L,
        vertices: Range<usize>,
        x: &[Four],
        gradient: &mut [Four],
    ) -> f64 {
        // Equal lengths let one bounds check serve both slices.
        let gradient = &mut gradient[..x.len()];
        for i in vertices {
            let here = l.load(&x[i]);
            let mut sum = l.load(&gradient[i]);
            for two in self.rows.of(i) {
                let [j, k] = [two.columns[0] as usize, two.columns[1] as usize];
                // In this order of operands each load is folded into an arithmetic instruction.
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
