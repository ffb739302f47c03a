//! L y = b, and Lᵀ x = y: front by front, groves side by side, each adding to the crown's unknowns in a memory of its own.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::traits::math_utils::{one, zero};
use faer::{Accum, ColMut, ColRef, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::factor::{Factor, Planted, Precision};
use super::symbolic::{Forest, Front, Grove};

impl<T: Precision> Factor<T> {
    /// L⁻¹ of what is in `side`, numbered anew.
    pub(super) fn forward(&mut self, forest: &Forest) {
        let Self { groves, crown, side, .. } = self;
        let (mut own, high) = by_grove(forest, side);
        (groves.par_iter_mut().zip(&forest.groves).zip(&mut own).with_max_len(1))
            .for_each(|((planted, grove), own)| planted.forward(forest, grove, own));
        for planted in &mut *groves {
            for &(root, _) in &planted.live {
                for &row in &forest.rows[forest.fronts[root as usize].rows.clone()] {
                    let at = 3 * (row as usize - forest.crown.1);
                    for (x, more) in high[at..at + 3].iter_mut().zip(&mut planted.above[at..at + 3]) {
                        *x -= std::mem::replace(more, zero());
                    }
                }
            }
        }
        let mut rows = Vec::new();
        for (front, (panel, _)) in forest.fronts[forest.crown.0..].iter().zip(&*crown) {
            let at = 3 * (front.first - forest.crown.1);
            down(front, panel, &mut high[at..at + 3 * front.columns], &mut rows);
            for (&row, some) in forest.rows[front.rows.clone()].iter().zip(rows.chunks_exact(3)) {
                let at = 3 * (row as usize - forest.crown.1);
                take(&mut high[at..], some);
            }
        }
    }

    /// L⁻ᵀ of what is in `side`, numbered anew.
    pub(super) fn backward(&mut self, forest: &Forest) {
        let Self { groves, crown, side, .. } = self;
        let (mut own, high) = by_grove(forest, side);
        let mut rows = Vec::new();
        for (front, (panel, _)) in forest.fronts[forest.crown.0..].iter().zip(&*crown).rev() {
            gather(forest, front, &mut rows, |row| &high[3 * (row - forest.crown.1)..]);
            let at = 3 * (front.first - forest.crown.1);
            up(front, panel, &mut high[at..at + 3 * front.columns], &rows);
        }
        let high = &*high;
        (groves.par_iter_mut().zip(&forest.groves).zip(&mut own).with_max_len(1))
            .for_each(|((planted, grove), own)| planted.backward(forest, grove, own, high));
    }
}

/// The unknowns of each grove, and the crown's.
fn by_grove<'a, T>(forest: &Forest, side: &'a mut [T]) -> (Vec<&'a mut [T]>, &'a mut [T]) {
    let (mut low, high) = side.split_at_mut(3 * forest.crown.1);
    let mut own = Vec::with_capacity(forest.groves.len());
    for grove in &forest.groves {
        let (one, others) = low.split_at_mut(3 * grove.unknowns.len());
        own.push(one);
        low = others;
    }
    (own, high)
}

impl<T: Precision> Planted<T> {
    /// `own` are the grove's unknowns; what it takes from the crown's is summed up in `above`.
    fn forward(&mut self, forest: &Forest, grove: &Grove, own: &mut [T]) {
        let Self { panels, above, rows, .. } = self;
        let mut panels = &panels[..];
        for front in &forest.fronts[grove.fronts.clone()] {
            let (panel, rest) = panels.split_at(front.panel_len());
            panels = rest;
            let at = 3 * (front.first - grove.unknowns.start);
            down(front, panel, &mut own[at..at + 3 * front.columns], rows);
            for (&row, some) in forest.rows[front.rows.clone()].iter().zip(rows.chunks_exact(3)) {
                match (row as usize).checked_sub(grove.unknowns.end) {
                    None => {
                        let at = 3 * (row as usize - grove.unknowns.start);
                        take(&mut own[at..], some);
                    }
                    Some(_) => {
                        let at = 3 * (row as usize - forest.crown.1);
                        for (x, more) in above[at..at + 3].iter_mut().zip(some) {
                            *x += *more;
                        }
                    }
                }
            }
        }
    }

    fn backward(&mut self, forest: &Forest, grove: &Grove, own: &mut [T], high: &[T]) {
        let Self { panels, rows, .. } = self;
        let mut panels = &panels[..];
        for front in forest.fronts[grove.fronts.clone()].iter().rev() {
            let (rest, panel) = panels.split_at(panels.len() - front.panel_len());
            panels = rest;
            gather(forest, front, rows, |row| match row.checked_sub(grove.unknowns.end) {
                None => &own[3 * (row - grove.unknowns.start)..],
                Some(_) => &high[3 * (row - forest.crown.1)..],
            });
            let at = 3 * (front.first - grove.unknowns.start);
            up(front, panel, &mut own[at..at + 3 * front.columns], rows);
        }
    }
}

/// x ← x − less, as many as these are.
fn take<T: Precision>(x: &mut [T], less: &[T]) {
    x.iter_mut().zip(less).for_each(|(x, less)| *x -= *less);
}

/// The unknowns of a front's rows.
fn gather<'a, T: Precision + 'a>(forest: &Forest, front: &Front, rows: &mut Vec<T>, of: impl Fn(usize) -> &'a [T]) {
    rows.clear();
    for &row in &forest.rows[front.rows.clone()] {
        rows.extend_from_slice(&of(row as usize)[..3]);
    }
}

/// x ← L₁₁⁻¹ x; `rows` ← L₂₁ x.
fn down<T: Precision>(front: &Front, panel: &[T], x: &mut [T], rows: &mut Vec<T>) {
    let n = x.len();
    let panel = MatRef::from_column_major_slice(panel, front.height(), n);
    let (top, bottom) = panel.split_at_row(n);
    solve_lower_triangular_in_place(top, MatMut::from_column_major_slice_mut(x, n, 1), Par::Seq);
    rows.clear();
    rows.resize(bottom.nrows(), zero());
    if !rows.is_empty() {
        let (x, rows) = (ColRef::from_slice(&*x), ColMut::from_slice_mut(rows));
        matmul(rows, Accum::Replace, bottom, x, one(), Par::Seq);
    }
}

/// x ← L₁₁⁻ᵀ (x − L₂₁ᵀ rows).
fn up<T: Precision>(front: &Front, panel: &[T], x: &mut [T], rows: &[T]) {
    let n = x.len();
    let panel = MatRef::from_column_major_slice(panel, front.height(), n);
    let (top, bottom) = panel.split_at_row(n);
    if !rows.is_empty() {
        matmul(
            ColMut::from_slice_mut(x),
            Accum::Add,
            bottom.transpose(),
            ColRef::from_slice(rows),
            -one::<T>(),
            Par::Seq,
        );
    }
    solve_upper_triangular_in_place(top.transpose(), MatMut::from_column_major_slice_mut(x, n, 1), Par::Seq);
}
