//! Columns that are eliminated together: the elimination tree of a block pattern and its supernodes.
//!
//! The factor's column j has the rows of the pattern's column and those of every column whose first row is j; that first row is its
//! parent in the elimination tree (Liu: "The role of elimination trees in sparse factorization", SIAM J. Matrix Anal. Appl. 11(1),
//! 1990). A column whose rows are its child's but for itself goes with it; then columns are put together that are not quite alike,
//! as long as few zeros are stored for it (Ashcraft, Grimes: "The influence of relaxed supernode partitions on the multifrontal
//! method", ACM Trans. Math. Softw. 15(4), 1989): a dense kernel is worth more than the zeros cost.
//!
//! All of it is in blocks of 3 by 3: a ninth of the work that scalars would take.
//!
//! The tree is cut into subtrees of about as much work each, and the top above them.

use crate::mechanics::energy::sparsity::Pattern;
use crate::mesh::{Csr, NONE, renumbered};

/// Largest share of zeros at which supernodes are merged, by number of columns.
const MAX_ZEROS: [(usize, f64); 4] = [(8, 0.5), (16, 0.2), (32, 0.1), (usize::MAX, 0.03)];

/// A subtree has at most this share of all the work.
const MAX_WORK_SHARE: f64 = 1.0 / 12.0;

/// Least work of a subtree that gets a thread, in multiplications of blocks.
const MIN_WORK: f64 = 2e5;

/// Columns that are eliminated together.
#[derive(Debug, Clone, Default)]
pub(super) struct Supernode {
    /// Its columns, as numbered in the pattern, in their order of elimination.
    pub(super) columns: Vec<u32>,
    /// Rows below them.
    pub(super) rows: usize,
    /// The supernodes that come right before it in the tree.
    pub(super) children: Vec<u32>,
    pub(super) parent: Option<u32>,
    /// Blocks stored that are zero.
    zeros: usize,
}

/// A pattern's upper half by rows: the columns before i that meet row i, and their blocks.
pub(super) type Upper = Csr<(u32, u32)>;

/// Of a pattern; columns ascend.
pub(super) fn upper(pattern: &Pattern) -> Upper {
    // The diagonal is no part of it.
    let below = |j: usize| pattern.column(j).skip(1).map(move |block| (pattern.rows[block], (j as u32, block as u32)));
    Csr::gathered(pattern.unknowns(), || (0..pattern.unknowns()).flat_map(below))
}

/// Parent of each column, and how many rows its factor has below the diagonal.
fn elimination_tree(upper: &Upper, n: usize) -> (Vec<u32>, Vec<u32>) {
    let mut parent = vec![NONE; n];
    let mut ancestor = vec![NONE; n];
    for i in 0..n {
        for &(j, _) in upper.of(i) {
            let mut at = j as usize;
            while at != i {
                let next = std::mem::replace(&mut ancestor[at], i as u32);
                if next == NONE {
                    parent[at] = i as u32;
                    break;
                }
                at = next as usize;
            }
        }
    }
    // Row i of the factor is the part of the tree between i and the columns that meet row i.
    let mut rows = vec![0; n];
    let mut seen = vec![NONE; n];
    for i in 0..n {
        seen[i] = i as u32;
        for &(j, _) in upper.of(i) {
            let mut at = j as usize;
            while seen[at] != i as u32 {
                seen[at] = i as u32;
                rows[at] += 1;
                at = parent[at] as usize;
            }
        }
    }
    (parent, rows)
}

/// The supernodes, children before parents.
pub(super) fn supernodes(pattern: &Pattern, upper: &Upper) -> Vec<Supernode> {
    let n = pattern.unknowns();
    let (parent, rows) = elimination_tree(upper, n);
    // The child whose rows are those of its parent and the parent.
    let mut alike = vec![NONE; n];
    for j in 0..n {
        if parent[j] != NONE && rows[j] == rows[parent[j] as usize] + 1 {
            alike[parent[j] as usize] = j as u32;
        }
    }
    let mut nodes: Vec<Supernode> = Vec::new();
    let mut open: Vec<Supernode> = vec![Supernode::default(); n];
    for j in 0..n {
        let mut node = std::mem::take(&mut open[j]);
        node.columns.push(j as u32);
        node.rows = rows[j] as usize;
        match parent[j] {
            p if p != NONE && alike[p as usize] == j as u32 => {
                let Supernode { columns, mut children, .. } = node;
                let above = &mut open[p as usize];
                above.columns = columns;
                children.append(&mut above.children);
                above.children = children;
            }
            p => {
                relax(&mut node, &mut nodes);
                if p != NONE {
                    open[p as usize].children.push(nodes.len() as u32);
                }
                nodes.push(node);
            }
        }
    }
    tidy(nodes)
}

/// Takes those children in that cost few zeros; they are left without columns.
fn relax(node: &mut Supernode, nodes: &mut [Supernode]) {
    let mut children = std::mem::take(&mut node.children);
    children.sort_by_key(|&c| std::cmp::Reverse(nodes[c as usize].rows));
    for c in children {
        let child = &mut nodes[c as usize];
        let (more, columns) = (child.columns.len(), child.columns.len() + node.columns.len());
        let zeros = node.zeros + child.zeros + more * (node.columns.len() + node.rows - child.rows);
        let stored = columns * (columns + 1) / 2 + columns * node.rows;
        let bound = MAX_ZEROS.iter().find(|(most, _)| columns <= *most).map_or(0.0, |(_, share)| *share);
        if zeros as f64 <= bound * stored as f64 {
            let mut taken = std::mem::take(child);
            taken.columns.append(&mut node.columns);
            node.columns = taken.columns;
            node.children.append(&mut taken.children);
            node.zeros = zeros;
        } else {
            node.children.push(c);
        }
    }
}

/// Without those that were taken in, and with parents.
fn tidy(mut nodes: Vec<Supernode>) -> Vec<Supernode> {
    let number = renumbered(nodes.len(), |s| !nodes[s].columns.is_empty());
    nodes.retain(|node| !node.columns.is_empty());
    for s in 0..nodes.len() {
        let mut children = std::mem::take(&mut nodes[s].children);
        for c in &mut children {
            *c = number[*c as usize];
            nodes[*c as usize].parent = Some(s as u32);
        }
        children.sort_unstable();
        nodes[s].children = children;
    }
    nodes
}

/// Multiplications of blocks that a front takes.
fn work(node: &Supernode) -> f64 {
    let (columns, rows) = (node.columns.len() as f64, node.rows as f64);
    columns * (columns * columns / 3.0 + columns * rows + rows * rows)
}

/// Subtrees by subtrees, and the nodes above them, children before parents.
pub(super) fn cut(nodes: &[Supernode]) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut total: Vec<f64> = nodes.iter().map(work).collect();
    for s in 0..nodes.len() {
        total[s] += nodes[s].children.iter().map(|&c| total[c as usize]).sum::<f64>();
    }
    let mut trees: Vec<u32> = (0..nodes.len() as u32).filter(|&s| nodes[s as usize].parent.is_none()).collect();
    let most = (MAX_WORK_SHARE * trees.iter().map(|&s| total[s as usize]).sum::<f64>()).max(MIN_WORK);
    let mut top = Vec::new();
    let heaviest = |trees: &[u32]| {
        let heavy = (0..trees.len()).filter(|&i| total[trees[i] as usize] > most);
        heavy.max_by(|&i, &j| total[trees[i] as usize].total_cmp(&total[trees[j] as usize]))
    };
    while let Some(i) = heaviest(&trees) {
        let s = trees[i];
        top.push(s);
        trees.splice(i..=i, nodes[s as usize].children.iter().copied());
    }
    top.sort_unstable();
    let mut subtrees: Vec<Vec<u32>> = Vec::new();
    let mut filled = f64::INFINITY;
    for s in trees {
        if filled + total[s as usize] > most {
            subtrees.push(Vec::new());
            filled = 0.0;
        }
        filled += total[s as usize];
        if let Some(subtree) = subtrees.last_mut() {
            subtree.push(s);
        }
    }
    (subtrees, top)
}

/// The nodes of a subtree, children right before what is above them.
pub(super) fn postorder(nodes: &[Supernode], root: u32, out: &mut Vec<u32>) {
    // The other way round: a node, then its children's subtrees from the last to the first.
    let begin = out.len();
    let mut open = vec![root];
    while let Some(s) = open.pop() {
        out.push(s);
        open.extend(&nodes[s as usize].children);
    }
    out[begin..].reverse();
}
