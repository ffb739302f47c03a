//! Where the tree of supernodes is cut: groves of about as much work each, and the crown above them.

use super::supernodes::Supernode;

/// A grove has at most this share of all the work.
const SHARE: f64 = 1.0 / 12.0;

/// What is less work than this, in multiplications of blocks, is not worth a thread.
const LEAST_WORK: f64 = 2e5;

/// Multiplications of blocks that a front takes.
fn work(node: &Supernode) -> f64 {
    let (columns, rows) = (node.columns.len() as f64, node.rows as f64);
    columns * (columns * columns / 3.0 + columns * rows + rows * rows)
}

/// Subtrees by groves, and the nodes above them, children before parents.
pub(super) fn cut(nodes: &[Supernode]) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut total: Vec<f64> = nodes.iter().map(work).collect();
    for s in 0..nodes.len() {
        total[s] += nodes[s].children.iter().map(|&c| total[c as usize]).sum::<f64>();
    }
    let mut trees: Vec<u32> = (0..nodes.len() as u32).filter(|&s| nodes[s as usize].parent.is_none()).collect();
    let most = (SHARE * trees.iter().map(|&s| total[s as usize]).sum::<f64>()).max(LEAST_WORK);
    let mut crown = Vec::new();
    let heaviest = |trees: &[u32]| {
        let heavy = (0..trees.len()).filter(|&i| total[trees[i] as usize] > most);
        heavy.max_by(|&i, &j| total[trees[i] as usize].total_cmp(&total[trees[j] as usize]))
    };
    while let Some(i) = heaviest(&trees) {
        let s = trees[i];
        crown.push(s);
        trees.splice(i..=i, nodes[s as usize].children.iter().copied());
    }
    crown.sort_unstable();
    let mut groves: Vec<Vec<u32>> = Vec::new();
    let mut filled = f64::INFINITY;
    for s in trees {
        if filled + total[s as usize] > most {
            groves.push(Vec::new());
            filled = 0.0;
        }
        filled += total[s as usize];
        if let Some(grove) = groves.last_mut() {
            grove.push(s);
        }
    }
    (groves, crown)
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
