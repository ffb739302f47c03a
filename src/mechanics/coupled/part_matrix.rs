//! A symmetric matrix of the PARTs' functions, summed element by element and factored.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, LltRef, SymbolicCholesky, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, MatMut, Par, Side};
use glam::DVec3;

use crate::mechanics::newton::SolveError;

/// Share of the diagonal that is added to it, against functions that no sample sees.
const RIDGE: f64 = 1e-9;

/// Least diagonal, N/m.
const MIN_DIAGONAL: f64 = 1e-12;

/// The factor of a [`PartMatrix`].
pub(super) struct PartFactor {
    symbolic: SymbolicCholesky<u32>,
    numbers: Vec<f64>,
    memory: MemBuffer,
    /// The right sides, column by column.
    columns: Vec<f64>,
}

impl PartFactor {
    /// Replaces the right sides, the coordinates of `b`, by the solutions.
    pub(super) fn solve(&mut self, b: &mut [DVec3]) {
        let n = b.len();
        self.columns.clear();
        (0..3).for_each(|k| self.columns.extend(b.iter().map(|b| b[k])));
        let columns = MatMut::from_column_major_slice_mut(&mut self.columns, n, 3);
        let memory = MemStack::new(&mut self.memory);
        LltRef::new(&self.symbolic, &self.numbers).solve_in_place_with_conj(Conj::No, columns, Par::Seq, memory);
        for (i, b) in b.iter_mut().enumerate() {
            *b = DVec3::new(self.columns[i], self.columns[n + i], self.columns[2 * n + i]);
        }
    }
}

/// The lower triangle by 4×4 blocks of two PARTs' functions.
pub(super) struct PartMatrix {
    first: Vec<u32>,
    count: Vec<u8>,
    part_of_unknown: Vec<u32>,
    /// Of each PART: the PARTs whose unknowns do not come after its own, with the entries of both.
    rows: Vec<Vec<(u32, [f64; 16])>>,
}

impl PartMatrix {
    /// `first` is the first unknown of each PART, `count` their number.
    pub(super) fn new(first: &[u32], count: &[u8]) -> Self {
        let mut part_of_unknown = vec![0; count.iter().map(|&count| usize::from(count)).sum()];
        for (p, (&first, &count)) in (0..).zip(first.iter().zip(count)) {
            part_of_unknown[first as usize..first as usize + usize::from(count)].fill(p);
        }
        Self { first: first.to_vec(), count: count.to_vec(), part_of_unknown, rows: vec![Vec::new(); first.len()] }
    }

    /// Adds `value(i, j)` for every pair of an element's unknowns, listed PART by PART.
    pub(super) fn add(&mut self, unknowns: &[u32], value: impl Fn(usize, usize) -> f64) {
        let mut i = 0;
        while i < unknowns.len() {
            let p = self.part_of_unknown[unknowns[i] as usize] as usize;
            let rows = usize::from(self.count[p]);
            let mut j = 0;
            while j < unknowns.len() {
                let q = self.part_of_unknown[unknowns[j] as usize];
                let columns = usize::from(self.count[q as usize]);
                if self.first[q as usize] <= self.first[p] {
                    let block = block_of(&mut self.rows[p], q);
                    for a in 0..rows {
                        for b in 0..columns {
                            block[4 * a + b] += value(i + a, j + b);
                        }
                    }
                }
                j += columns;
            }
            i += rows;
        }
    }

    /// Adds another matrix of the same unknowns.
    pub(super) fn add_matrix(&mut self, other: &Self) {
        for (row, others) in self.rows.iter_mut().zip(&other.rows) {
            for &(q, block) in others {
                let sum = block_of(row, q);
                sum.iter_mut().zip(block).for_each(|(sum, value)| *sum += value);
            }
        }
    }

    /// Calls `entry` with row, column and value of the lower triangle.
    fn each(&self, mut entry: impl FnMut(u32, u32, f64)) {
        for (p, row) in self.rows.iter().enumerate() {
            for (q, block) in row {
                for a in 0..u32::from(self.count[p]) {
                    for b in 0..u32::from(self.count[*q as usize]) {
                        let (i, j) = (self.first[p] + a, self.first[*q as usize] + b);
                        if i >= j {
                            entry(i, j, block[(4 * a + b) as usize]);
                        }
                    }
                }
            }
        }
    }

    /// A factor of the matrix with `diagonal` (N/m) added.
    ///
    /// # Errors
    /// [`SolveError`] where it is not positive definite, as with numbers that are not finite.
    pub(super) fn factor(&self, diagonal: &[f64]) -> Result<PartFactor, SolveError> {
        let mut entries = Vec::new();
        let mut sums = diagonal.to_vec();
        self.each(|i, j, value| {
            if i == j {
                sums[i as usize] += value;
            } else {
                entries.push(Triplet::new(i, j, value));
            }
        });
        entries.extend((0..).zip(&sums).map(|(i, sum)| Triplet::new(i, i, sum * (1.0 + RIDGE) + MIN_DIAGONAL)));
        let index = sums.iter().position(|sum| !(sum.is_finite() && *sum >= 0.0)).unwrap_or(0);
        factored(diagonal.len(), &entries).ok_or(SolveError::NotPositive { index })
    }
}

/// The entries with PART q in the row of a PART.
fn block_of(row: &mut Vec<(u32, [f64; 16])>, q: u32) -> &mut [f64; 16] {
    let at = row.iter().position(|block| block.0 == q).unwrap_or_else(|| {
        row.push((q, [0.0; 16]));
        row.len() - 1
    });
    &mut row[at].1
}

/// Factors a matrix given by its lower triangle; `None` where it is not positive definite.
fn factored(n: usize, entries: &[Triplet<u32, u32, f64>]) -> Option<PartFactor> {
    let matrix = SparseColMat::<u32, f64>::try_new_from_triplets(n, n, entries).ok()?;
    // Column by column on one thread: the dense kernels of supernodes depend on the processor, and so do their bits.
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
        ..Default::default()
    };
    let symbolic = factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, Default::default(), params).ok()?;
    let needs = [
        symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        symbolic.solve_in_place_scratch::<f64>(3, Par::Seq),
    ];
    let mut memory = MemBuffer::try_new(StackReq::any_of(&needs)).ok()?;
    let mut numbers = vec![0.0; symbolic.len_val()];
    symbolic
        .factorize_numeric_llt(
            &mut numbers,
            matrix.as_ref(),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .ok()?;
    Some(PartFactor { symbolic, numbers, memory, columns: Vec::new() })
}
