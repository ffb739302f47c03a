//! The elimination's plan: fronts in their order, what goes into each, and which of them are done side by side.
//!
//! Unknowns are renumbered, supernode by supernode. The tree of supernodes is cut into a top and [`Subtree`]s below it: whole
//! subtrees with about as much work each, that depend on none but themselves. Where the cut runs depends on the pattern alone, so the
//! factor has the same bits on any number of threads.

use std::ops::Range;

use super::supernodes::{Supernode, Upper, cut, postorder, supernodes, upper};
use crate::mechanics::energy::sparsity::Pattern;

/// A block of the matrix and where its first number goes in the front's panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) block: u32,
    pub(super) at: u32,
    pub(super) transposed: bool,
}

/// Rows of a front that follow each other in the parent's front too, in blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// First of them in the front's rows.
    pub(super) from: u32,
    /// And in the parent's front, whose columns come first.
    pub(super) to: u32,
    pub(super) len: u32,
}

/// A supernode's front: its columns, and the rows below them.
#[derive(Debug, Clone)]
pub(super) struct Front {
    /// First unknown in the order of elimination.
    pub(super) first: usize,
    /// Unknowns eliminated, in blocks as all here.
    pub(super) columns: usize,
    /// Its rows in [`SymbolicFactor::rows`].
    pub(super) rows: Range<usize>,
    pub(super) entries: Range<usize>,
    /// Runs of its rows, split where the parent's columns end.
    pub(super) runs: Range<usize>,
    /// How many of its rows are columns of the parent.
    pub(super) inner: usize,
    /// Fronts whose updates it takes.
    pub(super) children: Vec<u32>,
}

impl Front {
    /// Numbers of a column of its panel.
    pub(super) fn height(&self) -> usize {
        3 * (self.columns + self.rows.len())
    }

    /// Numbers in its panel.
    pub(super) fn panel_len(&self) -> usize {
        3 * self.columns * self.height()
    }

    /// Numbers in its update.
    pub(super) fn update_len(&self) -> usize {
        9 * self.rows.len() * self.rows.len()
    }
}

/// Fronts that are done one after the other on one thread.
#[derive(Debug, Clone)]
pub(super) struct Subtree {
    pub(super) fronts: Range<usize>,
    /// Its unknowns, in the order of elimination.
    pub(super) unknowns: Range<usize>,
    /// Numbers that its panels and its updates take, these one on top of the other.
    pub(super) panels_len: usize,
    pub(super) stack_len: usize,
}

/// The plan.
#[derive(Debug, Clone)]
pub(super) struct SymbolicFactor {
    /// Unknown of the pattern by its new number.
    pub(super) order: Vec<u32>,
    /// All fronts, subtrees first, then the top.
    pub(super) fronts: Vec<Front>,
    pub(super) rows: Vec<u32>,
    pub(super) entries: Vec<Entry>,
    pub(super) runs: Vec<Run>,
    pub(super) subtrees: Vec<Subtree>,
    /// First front and first unknown of the top.
    pub(super) top: (usize, usize),
}

impl SymbolicFactor {
    pub(super) fn new(pattern: &Pattern) -> Self {
        let upper = upper(pattern);
        let nodes = supernodes(pattern, &upper);
        let (subtrees, top) = cut(&nodes);
        // Nodes in their final order, and each subtree's share of them.
        let mut sequence = Vec::with_capacity(nodes.len());
        let mut ends = Vec::with_capacity(subtrees.len());
        for roots in &subtrees {
            for &root in roots {
                postorder(&nodes, root, &mut sequence);
            }
            ends.push(sequence.len());
        }
        let first_of_top = sequence.len();
        sequence.extend(top);
        let mut place = vec![0; nodes.len()];
        for (at, &s) in sequence.iter().enumerate() {
            place[s as usize] = at as u32;
        }
        let order: Vec<u32> = sequence.iter().flat_map(|&s| &nodes[s as usize].columns).copied().collect();
        let mut symbolic = Self {
            order,
            fronts: Vec::with_capacity(nodes.len()),
            rows: Vec::new(),
            entries: Vec::with_capacity(pattern.rows.len()),
            runs: Vec::new(),
            subtrees: Vec::with_capacity(subtrees.len()),
            top: (first_of_top, 0),
        };
        symbolic.fill(pattern, &upper, &nodes, &sequence, &place);
        symbolic.connect(&nodes, &sequence, &place);
        let first = |front: usize| symbolic.fronts.get(front).map_or(symbolic.order.len(), |f| f.first);
        symbolic.top.1 = first(first_of_top);
        let mut begin = 0;
        let mut all = Vec::with_capacity(ends.len());
        for end in ends {
            let (panels_len, stack_len) = symbolic.room(begin..end);
            all.push(Subtree { fronts: begin..end, unknowns: first(begin)..first(end), panels_len, stack_len });
            begin = end;
        }
        symbolic.subtrees = all;
        symbolic
    }

    /// Rows and entries of every front.
    fn fill(&mut self, pattern: &Pattern, upper: &Upper, nodes: &[Supernode], sequence: &[u32], place: &[u32]) {
        let n = self.order.len();
        let mut new = vec![0u32; n];
        for (i, &old) in self.order.iter().enumerate() {
            new[old as usize] = i as u32;
        }
        let mut seen = vec![u32::MAX; n];
        let mut local = vec![0u32; n];
        let mut first = 0;
        for (at, &s) in sequence.iter().enumerate() {
            let node = &nodes[s as usize];
            let (columns, end) = (node.columns.len(), first + node.columns.len());
            let children: Vec<u32> = node.children.iter().map(|&c| place[c as usize]).collect();
            let start = self.rows.len();
            let mut take = |row: u32, rows: &mut Vec<u32>| {
                if row as usize >= end && seen[row as usize] != at as u32 {
                    seen[row as usize] = at as u32;
                    rows.push(row);
                }
            };
            for &old in &node.columns {
                let old = old as usize;
                for &row in &pattern.rows[pattern.column(old)] {
                    take(new[row as usize], &mut self.rows);
                }
                for &(row, _) in upper.of(old) {
                    take(new[row as usize], &mut self.rows);
                }
            }
            for &child in &children {
                for k in self.fronts[child as usize].rows.clone() {
                    take(self.rows[k], &mut self.rows);
                }
            }
            self.rows[start..].sort_unstable();
            let rows = start..self.rows.len();
            for (k, &row) in self.rows[rows.clone()].iter().enumerate() {
                local[row as usize] = (columns + k) as u32;
            }
            let height = 3 * (columns + rows.len());
            let begun = self.entries.len();
            for (k, &old) in node.columns.iter().enumerate() {
                let mut put = |other: u32, block: u32, transposed: bool| {
                    let row = new[other as usize] as usize;
                    if row >= first + k {
                        let row = if row < end { row - first } else { local[row] as usize };
                        self.entries.push(Entry { block, at: (3 * (k * height + row)) as u32, transposed });
                    }
                };
                let old = old as usize;
                for block in pattern.column(old) {
                    put(pattern.rows[block], block as u32, false);
                }
                for &(row, block) in upper.of(old) {
                    put(row, block, true);
                }
            }
            let entries = begun..self.entries.len();
            self.fronts.push(Front { first, columns, rows, entries, runs: 0..0, inner: 0, children });
            first = end;
        }
    }

    /// Where every front's rows are in its parent's.
    fn connect(&mut self, nodes: &[Supernode], sequence: &[u32], place: &[u32]) {
        for (at, &s) in sequence.iter().enumerate() {
            let start = self.runs.len();
            if let Some(parent) = nodes[s as usize].parent {
                let above = &self.fronts[place[parent as usize] as usize];
                let end = above.first + above.columns;
                let rows = &self.rows[self.fronts[at].rows.clone()];
                let inner = rows.partition_point(|&row| (row as usize) < end);
                let mut below = above.rows.clone();
                for (k, &row) in rows.iter().enumerate() {
                    let to = if k < inner {
                        row as usize - above.first
                    } else {
                        // Both ascend, and all of these are there.
                        while self.rows[below.start] != row {
                            below.start += 1;
                        }
                        above.columns + below.start - above.rows.start
                    };
                    match self.runs[start..].last_mut() {
                        Some(run) if (run.to + run.len) as usize == to && k != inner => run.len += 1,
                        _ => self.runs.push(Run { from: k as u32, to: to as u32, len: 1 }),
                    }
                }
                self.fronts[at].inner = inner;
            }
            self.fronts[at].runs = start..self.runs.len();
        }
    }

    /// Numbers that the panels of some fronts take, and their updates at most.
    fn room(&self, fronts: Range<usize>) -> (usize, usize) {
        let (mut panels, mut largest, mut height) = (0, 0, 0);
        let mut live: Vec<usize> = Vec::new();
        for front in &self.fronts[fronts] {
            panels += front.panel_len();
            largest = largest.max(height + front.update_len());
            let taken: usize = live.drain(live.len() - front.children.len()..).sum();
            height = height - taken + front.update_len();
            live.push(front.update_len());
        }
        (panels, largest)
    }
}
