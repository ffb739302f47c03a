//! Order of elimination: nested dissection by planes.
//!
//! A direct factorisation of a surface's matrix costs O(n^1.5) where the unknowns are numbered so that each half comes
//! before what separates it (George: "Nested dissection of a regular finite element mesh", SIAM J. Numer. Anal. 10(2),
//! 1973). A garment is placed in space, so a plane through the median is a good cut: of the three axes the one whose
//! separator is smallest. For a tube that is first a ring, then its generators.

use glam::DVec3;

/// This many vertices are cut no further: below it a separator costs as much as it saves.
const LEAF: usize = 24;

/// The vertices of `members` in elimination order. `neighbours[v]` are those that share a Hessian block with v.
#[must_use]
pub fn nested_dissection(members: Vec<u32>, positions: &[DVec3], neighbours: &[Vec<u32>]) -> Vec<u32> {
    let mut order = Vec::with_capacity(members.len());
    let mut side = vec![0u32; positions.len()];
    let mut next_mark = 1;
    dissect(members, positions, neighbours, &mut side, &mut next_mark, &mut order);
    order
}

fn dissect(
    mut members: Vec<u32>,
    positions: &[DVec3],
    neighbours: &[Vec<u32>],
    side: &mut [u32],
    next_mark: &mut u32,
    order: &mut Vec<u32>,
) {
    if members.len() <= LEAF {
        order.append(&mut members);
        return;
    }
    let mut best: Option<(Vec<u32>, Vec<u32>, Vec<u32>)> = None;
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        // Ties (a ring at one height) fall by index, so the cut is the same on every run.
        members.sort_by(|&a, &b| {
            positions[a as usize].dot(axis).total_cmp(&positions[b as usize].dot(axis)).then(a.cmp(&b))
        });
        let middle = members.len() / 2;
        // A fresh mark for every cut, so that one is never read as another's.
        let mark = *next_mark;
        *next_mark += 1;
        for &v in &members[middle..] {
            side[v as usize] = mark;
        }
        let (separator, low): (Vec<u32>, Vec<u32>) =
            members[..middle].iter().partition(|&&v| neighbours[v as usize].iter().any(|&w| side[w as usize] == mark));
        if best.as_ref().is_none_or(|(s, _, _)| separator.len() < s.len()) {
            best = Some((separator, low, members[middle..].to_vec()));
        }
    }
    let Some((mut separator, low, high)) = best else { return };
    dissect(low, positions, neighbours, side, next_mark, order);
    dissect(high, positions, neighbours, side, next_mark, order);
    order.append(&mut separator);
}
