//! A sparse Cholesky factor in single precision, recomputed in place by the multifrontal method.
//!
//! Front by front, children first (Duff, Reid: "The multifrontal solution of indefinite sparse symmetric linear equations", ACM Trans.
//! Math. Softw. 9(3), 1983): a front's panel takes the matrix's own blocks and the updates of its children; it is factored densely,
//! and the product of its rows below the diagonal block is the front's own update. Subtrees go side by side, each with its updates on a stack; in
//! the top above them the threads share each front's dense part. Nothing is allocated after the first time.

use std::collections::TryReserveError;
use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::dense::{factor_panel, set_product, solve_down, solve_up};
use super::symbolic::{Front, Subtree, SymbolicFactor};

/// Why a linear system cannot be solved.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// Out of memory.
    #[error("no memory to factorise the Hessian of {unknowns} unknowns ({reason}): take a garment of fewer vertices")]
    NoRoom {
        /// Scalar unknowns.
        unknowns: usize,
        /// The message of the allocator.
        reason: String,
    },
    /// A pivot is not finite.
    #[error(
        "the forces of the cloth are not finite (unknown {index}): expected finite positions; check that rest shape and garment have the \
         same unit"
    )]
    NotPositive {
        /// Scalar unknown in elimination order.
        index: usize,
    },
}

/// The matrix A + D to factor.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    /// Blocks of A, N/m.
    pub(super) blocks: &'a [DMat3],
    /// D, a number for each unknown, N/m.
    pub(super) diagonal: &'a [f64],
}

/// The factor's numbers.
#[derive(Default)]
pub(super) struct Factor {
    subtrees: Vec<SubtreeFactor>,
    /// Panel and update of each front of the top.
    top: Vec<(Vec<f32>, Vec<f32>)>,
    right_side: Vec<f32>,
}

/// A subtree's numbers.
struct SubtreeFactor {
    panels: Vec<f32>,
    /// Updates that no parent has taken yet, one on top of the other, and where each begins.
    stack: Vec<f32>,
    live: Vec<(u32, usize)>,
    /// Of a solve: what it adds to the top's unknowns, and a front's rows.
    above: Vec<f32>,
    rows: Vec<f32>,
}

impl Factor {
    /// Allocates at the first use: a solver may be analysed and never used.
    fn allocate(&mut self, symbolic: &SymbolicFactor) -> Result<(), SolveError> {
        let unknowns = 3 * symbolic.order.len();
        if self.right_side.len() == unknowns {
            return Ok(());
        }
        let room = |numbers: usize| -> Result<Vec<f32>, SolveError> {
            let mut all = Vec::new();
            let failed = |e: TryReserveError| SolveError::NoRoom { unknowns, reason: e.to_string() };
            all.try_reserve_exact(numbers).map_err(failed)?;
            all.resize(numbers, 0.0);
            Ok(all)
        };
        for subtree in &symbolic.subtrees {
            self.subtrees.push(SubtreeFactor {
                panels: room(subtree.panels_len)?,
                stack: room(subtree.stack_len)?,
                live: Vec::new(),
                above: room(unknowns - 3 * symbolic.top.1)?,
                rows: Vec::new(),
            });
        }
        for front in &symbolic.fronts[symbolic.top.0..] {
            self.top.push((room(front.panel_len())?, room(front.update_len())?));
        }
        self.right_side = room(unknowns)?;
        Ok(())
    }

    pub(super) fn factorise(&mut self, symbolic: &SymbolicFactor, matrix: Matrix<'_>) -> Result<(), SolveError> {
        self.allocate(symbolic)?;
        let Self { subtrees, top, .. } = self;
        let done: Vec<Result<(), SolveError>> = (subtrees.par_iter_mut().zip(&symbolic.subtrees).with_max_len(1))
            .map(|(factor, subtree)| factor.factorise(symbolic, subtree, matrix))
            .collect();
        done.into_iter().collect::<Result<(), _>>()?;
        for at in 0..top.len() {
            let (before, here) = top.split_at_mut(at);
            let Some((panel, update)) = here.first_mut() else { break };
            let front = &symbolic.fronts[symbolic.top.0 + at];
            let of = |&child: &u32| {
                let front = &symbolic.fronts[child as usize];
                let numbers = match (child as usize).checked_sub(symbolic.top.0) {
                    Some(top) => &before[top].1[..],
                    None => left_in(subtrees, symbolic, child),
                };
                (front, &numbers[..front.update_len()])
            };
            eliminate(symbolic, front, matrix, panel, update, || front.children.iter().map(of))?;
        }
        Ok(())
    }

    /// L⁻ᵀ L⁻¹ x, in place.
    pub(super) fn solve(&mut self, symbolic: &SymbolicFactor, x: &mut [DVec3]) {
        self.take(symbolic, x);
        self.forward(symbolic);
        self.backward(symbolic);
        self.give(symbolic, x);
    }

    /// L⁻¹ x, in the factor's own order.
    pub(super) fn lower(&mut self, symbolic: &SymbolicFactor, x: &[DVec3]) -> Vec<f64> {
        self.take(symbolic, x);
        self.forward(symbolic);
        self.right_side.iter().map(|&s| s.into()).collect()
    }

    /// L⁻ᵀ y, of what is in the factor's own order.
    pub(super) fn upper(&mut self, symbolic: &SymbolicFactor, y: &[f64]) -> Vec<DVec3> {
        self.right_side.iter_mut().zip(y).for_each(|(s, y)| *s = *y as f32);
        self.backward(symbolic);
        let mut x = vec![DVec3::ZERO; symbolic.order.len()];
        self.give(symbolic, &mut x);
        x
    }

    fn take(&mut self, symbolic: &SymbolicFactor, x: &[DVec3]) {
        for (s, &old) in self.right_side.chunks_exact_mut(3).zip(&symbolic.order) {
            s.copy_from_slice(&x[old as usize].to_array().map(|number| number as f32));
        }
    }

    fn give(&self, symbolic: &SymbolicFactor, x: &mut [DVec3]) {
        for (s, &old) in self.right_side.chunks_exact(3).zip(&symbolic.order) {
            x[old as usize] = DVec3::new(s[0].into(), s[1].into(), s[2].into());
        }
    }

    /// L⁻¹ of `right_side`, in the order of elimination.
    fn forward(&mut self, symbolic: &SymbolicFactor) {
        let Self { subtrees, top, right_side, .. } = self;
        let (mut own, high) = by_subtree(symbolic, right_side);
        (subtrees.par_iter_mut().zip(&symbolic.subtrees).zip(&mut own).with_max_len(1))
            .for_each(|((factor, subtree), own)| factor.forward(symbolic, subtree, own));
        for factor in &mut *subtrees {
            for &(root, _) in &factor.live {
                for &row in &symbolic.rows[symbolic.fronts[root as usize].rows.clone()] {
                    let at = 3 * (row as usize - symbolic.top.1);
                    for (x, more) in high[at..at + 3].iter_mut().zip(&mut factor.above[at..at + 3]) {
                        *x -= std::mem::take(more);
                    }
                }
            }
        }
        let mut rows = Vec::new();
        for (front, (panel, _)) in symbolic.fronts[symbolic.top.0..].iter().zip(&*top) {
            let at = 3 * (front.first - symbolic.top.1);
            solve_down(panel, front.height(), &mut high[at..at + 3 * front.columns], &mut rows);
            for (&row, some) in symbolic.rows[front.rows.clone()].iter().zip(rows.chunks_exact(3)) {
                let at = 3 * (row as usize - symbolic.top.1);
                take(&mut high[at..], some);
            }
        }
    }

    /// L⁻ᵀ of `right_side`, in the order of elimination.
    fn backward(&mut self, symbolic: &SymbolicFactor) {
        let Self { subtrees, top, right_side, .. } = self;
        let (mut own, high) = by_subtree(symbolic, right_side);
        let mut rows = Vec::new();
        for (front, (panel, _)) in symbolic.fronts[symbolic.top.0..].iter().zip(&*top).rev() {
            gather(symbolic, front, &mut rows, |row| &high[3 * (row - symbolic.top.1)..]);
            let at = 3 * (front.first - symbolic.top.1);
            solve_up(panel, front.height(), &mut high[at..at + 3 * front.columns], &rows);
        }
        let high = &*high;
        (subtrees.par_iter_mut().zip(&symbolic.subtrees).zip(&mut own).with_max_len(1))
            .for_each(|((factor, subtree), own)| factor.backward(symbolic, subtree, own, high));
    }
}

/// The unknowns of each subtree, and the top's.
fn by_subtree<'a>(symbolic: &SymbolicFactor, right_side: &'a mut [f32]) -> (Vec<&'a mut [f32]>, &'a mut [f32]) {
    let (mut low, high) = right_side.split_at_mut(3 * symbolic.top.1);
    let mut own = Vec::with_capacity(symbolic.subtrees.len());
    for subtree in &symbolic.subtrees {
        let (one, others) = low.split_at_mut(3 * subtree.unknowns.len());
        own.push(one);
        low = others;
    }
    (own, high)
}

/// The update that a front at the top of a subtree has left.
fn left_in<'a>(subtrees: &'a [SubtreeFactor], symbolic: &SymbolicFactor, front: u32) -> &'a [f32] {
    let subtree = symbolic.subtrees.partition_point(|g| g.fronts.end <= front as usize);
    let found = subtrees[subtree].live.iter().find(|(f, _)| *f == front);
    found.map_or(&[], |&(_, at)| &subtrees[subtree].stack[at..])
}

impl SubtreeFactor {
    fn factorise(
        &mut self,
        symbolic: &SymbolicFactor,
        subtree: &Subtree,
        matrix: Matrix<'_>,
    ) -> Result<(), SolveError> {
        let Self { panels, stack, live, .. } = self;
        live.clear();
        let (mut height, mut panels) = (0, &mut panels[..]);
        for (number, front) in subtree.fronts.clone().zip(&symbolic.fronts[subtree.fronts.clone()]) {
            let (panel, rest) = panels.split_at_mut(front.panel_len());
            panels = rest;
            let taken = live.len() - front.children.len();
            let (below, above) = stack.split_at_mut(height);
            let update = &mut above[..front.update_len()];
            let children = || {
                live[taken..].iter().map(|&(child, at)| {
                    let front = &symbolic.fronts[child as usize];
                    (front, &below[at..at + front.update_len()])
                })
            };
            eliminate(symbolic, front, matrix, panel, update, children)?;
            let base = live.get(taken).map_or(height, |&(_, at)| at);
            live.truncate(taken);
            if base < height {
                stack.copy_within(height..height + front.update_len(), base);
            }
            live.push((number as u32, base));
            height = base + front.update_len();
        }
        Ok(())
    }

    /// `own` are the subtree's unknowns; what it takes from the top's is summed up in `above`.
    fn forward(&mut self, symbolic: &SymbolicFactor, subtree: &Subtree, own: &mut [f32]) {
        let Self { panels, above, rows, .. } = self;
        let mut panels = &panels[..];
        for front in &symbolic.fronts[subtree.fronts.clone()] {
            let (panel, rest) = panels.split_at(front.panel_len());
            panels = rest;
            let at = 3 * (front.first - subtree.unknowns.start);
            solve_down(panel, front.height(), &mut own[at..at + 3 * front.columns], rows);
            for (&row, some) in symbolic.rows[front.rows.clone()].iter().zip(rows.chunks_exact(3)) {
                match (row as usize).checked_sub(subtree.unknowns.end) {
                    None => {
                        let at = 3 * (row as usize - subtree.unknowns.start);
                        take(&mut own[at..], some);
                    }
                    Some(_) => {
                        let at = 3 * (row as usize - symbolic.top.1);
                        for (x, more) in above[at..at + 3].iter_mut().zip(some) {
                            *x += *more;
                        }
                    }
                }
            }
        }
    }

    fn backward(&mut self, symbolic: &SymbolicFactor, subtree: &Subtree, own: &mut [f32], high: &[f32]) {
        let Self { panels, rows, .. } = self;
        let mut panels = &panels[..];
        for front in symbolic.fronts[subtree.fronts.clone()].iter().rev() {
            let (rest, panel) = panels.split_at(panels.len() - front.panel_len());
            panels = rest;
            gather(symbolic, front, rows, |row| match row.checked_sub(subtree.unknowns.end) {
                None => &own[3 * (row - subtree.unknowns.start)..],
                Some(_) => &high[3 * (row - symbolic.top.1)..],
            });
            let at = 3 * (front.first - subtree.unknowns.start);
            solve_up(panel, front.height(), &mut own[at..at + 3 * front.columns], rows);
        }
    }
}

/// Fills and factors a front's panel, and leaves its update.
fn eliminate<'a, C: Iterator<Item = (&'a Front, &'a [f32])>>(
    symbolic: &SymbolicFactor,
    front: &Front,
    matrix: Matrix<'_>,
    panel: &mut [f32],
    update: &mut [f32],
    children: impl Fn() -> C,
) -> Result<(), SolveError> {
    let height = front.height();
    let (columns, rows) = (3 * front.columns, 3 * front.rows.len());
    panel.fill(0.0);
    for entry in &symbolic.entries[front.entries.clone()] {
        let block = matrix.blocks[entry.block as usize];
        let block = if entry.transposed { block.transpose() } else { block };
        for (c, column) in block.to_cols_array_2d().into_iter().enumerate() {
            let at = entry.at as usize + c * height;
            panel[at..at + 3].copy_from_slice(&column.map(|number| number as f32));
        }
    }
    for (k, &unknown) in symbolic.order[front.first..front.first + front.columns].iter().enumerate() {
        let shift = matrix.diagonal[unknown as usize] as f32;
        for c in 3 * k..3 * k + 3 {
            panel[c * (height + 1)] += shift;
        }
    }
    let diagonal: Vec<f32> = panel.iter().copied().step_by(height + 1).collect();
    for (child, numbers) in children() {
        extend(symbolic, child, numbers, 0..child.inner, panel, height, 0);
    }
    let lost = |index: usize| SolveError::NotPositive { index: 3 * front.first + index };
    factor_panel(panel, height, &diagonal).map_err(lost)?;
    if rows > 0 {
        set_product(update, panel, height, columns);
        for (child, numbers) in children() {
            extend(symbolic, child, numbers, child.inner..child.rows.len(), update, rows, front.columns);
        }
    }
    Ok(())
}

/// Adds columns of a child's update to a matrix whose first row is the parent's row `skip`.
fn extend(
    symbolic: &SymbolicFactor,
    child: &Front,
    update: &[f32],
    columns: Range<usize>,
    into: &mut [f32],
    rows: usize,
    skip: usize,
) {
    let runs = &symbolic.runs[child.runs.clone()];
    let height = 3 * child.rows.len();
    let mut first = 0;
    for k in columns {
        while runs[first].from as usize + runs[first].len as usize <= k {
            first += 1;
        }
        let to = 3 * (runs[first].to as usize + k - runs[first].from as usize - skip);
        for c in 0..3 {
            let source = &update[(3 * k + c) * height..][..height];
            let target = &mut into[(to + c) * rows..][..rows];
            for run in &runs[first..] {
                let [from, to] = [run.from, run.to].map(|at| 3 * at as usize);
                let end = from + 3 * run.len as usize;
                let begin = from.max(3 * k + c);
                let target = &mut target[to + begin - from - 3 * skip..];
                for (t, s) in target.iter_mut().zip(&source[begin..end]) {
                    *t += *s;
                }
            }
        }
    }
}

/// x ← x − less, as many as these are.
fn take(x: &mut [f32], less: &[f32]) {
    x.iter_mut().zip(less).for_each(|(x, less)| *x -= *less);
}

/// The unknowns of a front's rows.
fn gather<'a>(symbolic: &SymbolicFactor, front: &Front, rows: &mut Vec<f32>, of: impl Fn(usize) -> &'a [f32]) {
    rows.clear();
    for &row in &symbolic.rows[front.rows.clone()] {
        rows.extend_from_slice(&of(row as usize)[..3]);
    }
}
