//! One sparse Cholesky factor, in one of two precisions, made anew in place: the multifrontal method.
//!
//! Front by front, children first (Duff, Reid: "The multifrontal solution of indefinite sparse symmetric linear equations", ACM Trans.
//! Math. Softw. 9(3), 1983): a front's panel takes the matrix's own blocks and the updates of its children; it is factored densely,
//! and what that takes from the rows below is the front's own update. Groves go side by side, each with its updates on a stack; in
//! the crown above them the threads share each front's dense part. Nothing is allocated after the first time.

use std::ops::{AddAssign, Neg, Range, SubAssign};

use faer::dyn_stack::MemBuffer;
use faer::traits::RealField;
use faer::traits::math_utils::{from_f64, zero};
use faer::{Accum, MatMut, MatRef};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::SolveError;
use super::dense::{memory, partial, subtract};
use super::symbolic::{Forest, Front, Grove};

/// The two precisions.
pub(super) trait Precision: RealField + Copy + Into<f64> + Neg<Output = Self> + AddAssign + SubAssign {}

impl Precision for f32 {}
impl Precision for f64 {}

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
pub(super) struct Factor<T> {
    pub(super) groves: Vec<Planted<T>>,
    /// Panel and update of each front of the crown.
    pub(super) crown: Vec<(Vec<T>, Vec<T>)>,
    memory: Option<MemBuffer>,
    pub(super) side: Vec<T>,
}

/// A grove's numbers.
pub(super) struct Planted<T> {
    pub(super) panels: Vec<T>,
    /// Updates that no parent has taken yet, one on top of the other, and where each begins.
    stack: Vec<T>,
    pub(super) live: Vec<(u32, usize)>,
    memory: MemBuffer,
    /// Of a solve: what it adds to the crown's unknowns, and a front's rows.
    pub(super) above: Vec<T>,
    pub(super) rows: Vec<T>,
}

impl<T: Precision> Factor<T> {
    /// Makes room where there is none yet: a solver seldom needs both precisions.
    fn plant(&mut self, forest: &Forest) -> Result<(), SolveError> {
        if self.memory.is_some() {
            return Ok(());
        }
        let unknowns = 3 * forest.order.len();
        let room = || {
            let failed = |e| SolveError::NoRoom { unknowns, reason: format!("{e:?}") };
            MemBuffer::try_new(memory::<T>()).map_err(failed)
        };
        for grove in &forest.groves {
            self.groves.push(Planted {
                panels: vec![zero::<T>(); grove.panels_len],
                stack: vec![zero::<T>(); grove.stack_len],
                live: Vec::new(),
                memory: room()?,
                above: vec![zero::<T>(); unknowns - 3 * forest.crown.1],
                rows: Vec::new(),
            });
        }
        let crown = forest.fronts[forest.crown.0..].iter();
        self.crown = crown.map(|f| (vec![zero::<T>(); f.panel_len()], vec![zero::<T>(); f.update_len()])).collect();
        self.side = vec![zero::<T>(); unknowns];
        self.memory = Some(room()?);
        Ok(())
    }

    pub(super) fn factorise(&mut self, forest: &Forest, matrix: Matrix<'_>) -> Result<(), SolveError> {
        self.plant(forest)?;
        let Self { groves, crown, memory, .. } = self;
        let done: Vec<Result<(), SolveError>> = (groves.par_iter_mut().zip(&forest.groves).with_max_len(1))
            .map(|(planted, grove)| planted.factorise(forest, grove, matrix))
            .collect();
        done.into_iter().collect::<Result<(), _>>()?;
        let Some(memory) = memory else { return Ok(()) };
        for at in 0..crown.len() {
            let (before, here) = crown.split_at_mut(at);
            let Some((panel, update)) = here.first_mut() else { break };
            let front = &forest.fronts[forest.crown.0 + at];
            let of = |&child: &u32| {
                let front = &forest.fronts[child as usize];
                let numbers = match (child as usize).checked_sub(forest.crown.0) {
                    Some(crown) => &before[crown].1[..],
                    None => left_in(groves, forest, child),
                };
                (front, &numbers[..front.update_len()])
            };
            eliminate(forest, front, matrix, panel, update, memory, || front.children.iter().map(of))?;
        }
        Ok(())
    }
}

/// The update that a front at the top of a grove has left.
fn left_in<'a, T>(groves: &'a [Planted<T>], forest: &Forest, front: u32) -> &'a [T] {
    let grove = forest.groves.partition_point(|g| g.fronts.end <= front as usize);
    let found = groves[grove].live.iter().find(|(f, _)| *f == front);
    found.map_or(&[], |&(_, at)| &groves[grove].stack[at..])
}

impl<T: Precision> Planted<T> {
    fn factorise(&mut self, forest: &Forest, grove: &Grove, matrix: Matrix<'_>) -> Result<(), SolveError> {
        let Self { panels, stack, live, memory, .. } = self;
        live.clear();
        let (mut height, mut panels) = (0, &mut panels[..]);
        for (number, front) in grove.fronts.clone().zip(&forest.fronts[grove.fronts.clone()]) {
            let (panel, rest) = panels.split_at_mut(front.panel_len());
            panels = rest;
            let taken = live.len() - front.children.len();
            let (below, above) = stack.split_at_mut(height);
            let update = &mut above[..front.update_len()];
            let children = || {
                live[taken..].iter().map(|&(child, at)| {
                    let front = &forest.fronts[child as usize];
                    (front, &below[at..at + front.update_len()])
                })
            };
            eliminate(forest, front, matrix, panel, update, memory, children)?;
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
}

/// Fills and factors a front's panel, and leaves its update.
fn eliminate<'a, T: Precision + 'a, C: Iterator<Item = (&'a Front, &'a [T])>>(
    forest: &Forest,
    front: &Front,
    matrix: Matrix<'_>,
    panel: &mut [T],
    update: &mut [T],
    memory: &mut MemBuffer,
    children: impl Fn() -> C,
) -> Result<(), SolveError> {
    let height = front.height();
    let (columns, rows) = (3 * front.columns, 3 * front.rows.len());
    panel.fill(zero());
    for entry in &forest.entries[front.entries.clone()] {
        let block = matrix.blocks[entry.block as usize];
        let block = if entry.transposed { block.transpose() } else { block };
        for (c, column) in block.to_cols_array_2d().into_iter().enumerate() {
            let at = entry.at as usize + c * height;
            panel[at..at + 3].copy_from_slice(&column.map(from_f64));
        }
    }
    for (k, &unknown) in forest.order[front.first..front.first + front.columns].iter().enumerate() {
        let shift: T = from_f64(matrix.diagonal[unknown as usize]);
        for c in 3 * k..3 * k + 3 {
            panel[c * (height + 1)] += shift;
        }
    }
    for (child, numbers) in children() {
        extend(forest, child, numbers, 0..child.inner, panel, height, 0);
    }
    let lost = |index: usize| SolveError::NotPositive { index: 3 * front.first + index };
    partial(MatMut::from_column_major_slice_mut(panel, height, columns), memory).map_err(lost)?;
    if rows > 0 {
        let panel = MatRef::from_column_major_slice(&*panel, height, columns);
        subtract(
            MatMut::from_column_major_slice_mut(update, rows, rows),
            panel.split_at_row(columns).1,
            Accum::Replace,
        );
        for (child, numbers) in children() {
            extend(forest, child, numbers, child.inner..child.rows.len(), update, rows, front.columns);
        }
    }
    Ok(())
}

/// Adds some columns of a child's update to a matrix of so many rows, whose first row is the parent's row `skip`.
fn extend<T: Precision>(
    forest: &Forest,
    child: &Front,
    update: &[T],
    columns: Range<usize>,
    into: &mut [T],
    rows: usize,
    skip: usize,
) {
    let runs = &forest.runs[child.runs.clone()];
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

/// Right sides and solutions: see `substitute.rs`.
impl<T: Precision> Factor<T> {
    /// L⁻ᵀ L⁻¹ x, in place.
    pub(super) fn solve(&mut self, forest: &Forest, x: &mut [DVec3]) {
        self.take(forest, x);
        self.forward(forest);
        self.backward(forest);
        self.give(forest, x);
    }

    /// L⁻¹ x, in the factor's own order.
    pub(super) fn lower(&mut self, forest: &Forest, x: &[DVec3]) -> Vec<f64> {
        self.take(forest, x);
        self.forward(forest);
        self.side.iter().map(|&s| s.into()).collect()
    }

    /// L⁻ᵀ y, of what is in the factor's own order.
    pub(super) fn upper(&mut self, forest: &Forest, y: &[f64]) -> Vec<DVec3> {
        self.side.iter_mut().zip(y).for_each(|(s, y)| *s = from_f64(*y));
        self.backward(forest);
        let mut x = vec![DVec3::ZERO; forest.order.len()];
        self.give(forest, &mut x);
        x
    }

    fn take(&mut self, forest: &Forest, x: &[DVec3]) {
        for (s, &old) in self.side.chunks_exact_mut(3).zip(&forest.order) {
            s.copy_from_slice(&x[old as usize].to_array().map(from_f64));
        }
    }

    fn give(&self, forest: &Forest, x: &mut [DVec3]) {
        for (s, &old) in self.side.chunks_exact(3).zip(&forest.order) {
            x[old as usize] = DVec3::new(s[0].into(), s[1].into(), s[2].into());
        }
    }
}
