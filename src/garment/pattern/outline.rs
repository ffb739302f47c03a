//! The outlines of all panels divided into vertices, the two sides of a stitch into as many, and which of them are one when sewn.

use super::{EdgeAt, SewingPattern};
use glam::DVec2;

/// A panel's outline in vertices, in the order of its loop.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    /// Where they lie, m.
    pub(super) points: Vec<DVec2>,
    /// The first vertex of each edge, and one past the last.
    pub(super) starts: Vec<usize>,
    /// Which vertex of the sewn garment each is, by any numbers.
    pub(super) class: Vec<u32>,
}

impl Outline {
    /// Places in the outline of the vertices of an edge, both ends among them.
    pub(super) fn along(&self, edge: usize) -> Vec<usize> {
        (self.starts[edge]..=self.starts[edge + 1]).map(|i| i % self.points.len()).collect()
    }
}

/// How many parts each edge of each panel is divided into at this length (m): of a stitch, the greater number of its sides.
pub(super) fn divisions(pattern: &SewingPattern, edge_m: f64) -> Vec<Vec<usize>> {
    let own = |length: f64| ((length / edge_m).ceil() as usize).max(1);
    let of_panel = |panel: &super::PatternPanel| panel.edges.iter().map(|e| own(e.curve.length())).collect();
    let mut counts: Vec<Vec<usize>> = pattern.panels.iter().map(of_panel).collect();
    for stitch in &pattern.stitches {
        let count = |at: EdgeAt, counts: &Vec<Vec<usize>>| counts[at.panel][at.edge];
        let most = stitch.sides.map(|side| count(side, &counts)).into_iter().max().unwrap_or(1);
        for side in stitch.sides {
            counts[side.panel][side.edge] = most;
        }
    }
    // A loop of two edges needs a third vertex.
    for counts in &mut counts {
        if counts.iter().sum::<usize>() < 3 {
            counts.iter_mut().for_each(|c| *c = 2);
        }
    }
    counts
}

/// Outlines of all panels, sewn by class.
pub(super) fn outlines(pattern: &SewingPattern, counts: &[Vec<usize>]) -> Vec<Outline> {
    let mut all = Vec::new();
    let mut next = 0;
    for (panel, counts) in pattern.panels.iter().zip(counts) {
        let (mut points, mut starts) = (Vec::new(), vec![0]);
        for (edge, &count) in panel.edges.iter().zip(counts) {
            let divided = edge.curve.divided(count);
            points.extend(&divided[..count]);
            starts.push(points.len());
        }
        let class = (next..next + points.len() as u32).collect();
        next += points.len() as u32;
        all.push(Outline { points, starts, class });
    }
    let mut root: Vec<u32> = (0..next).collect();
    for stitch in &pattern.stitches {
        let [a, b] = stitch.sides.map(|side| {
            let outline = &all[side.panel];
            outline.along(side.edge).into_iter().map(|i| outline.class[i]).collect::<Vec<_>>()
        });
        for (i, &one) in a.iter().enumerate() {
            let other = if stitch.right_wrong { b[i] } else { b[b.len() - 1 - i] };
            let (one, other) = (find(&root, one), find(&root, other));
            root[one.max(other) as usize] = one.min(other);
        }
    }
    for outline in &mut all {
        outline.class.iter_mut().for_each(|c| *c = find(&root, *c));
    }
    all
}

fn find(root: &[u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        v = root[v as usize];
    }
    v
}
