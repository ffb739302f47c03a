//! Duplicates in a file: triangles over the same vertices, and connected parts that coincide face by face, exported twice
//! or doubled to be seen from both sides.
//!
//! Layers at exactly the same positions have no order: neither is the outer one, and no contact separates them. The first
//! part is kept, and the vertices of the others stand for those they coincide with, so that an export moves all of them.
//!
//! Limits: a part is a duplicate if all its faces coincide with kept ones; a part that extends beyond them is kept.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec3;

use super::{Topology, each_once};

/// Connected parts that coincide with others.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct DuplicateParts {
    /// Whether each triangle is kept.
    pub(super) keep: Vec<bool>,
    /// Number of parts that are not.
    pub(super) parts: usize,
    /// Each vertex of these parts, with the kept one at the same position.
    pub(super) stand_in: BTreeMap<u32, u32>,
}

/// The first used vertex at exactly the position of each vertex, and the number of used vertices that coincide with an
/// earlier one.
pub(super) fn same_place(positions: &[DVec3], used: &[bool]) -> (Vec<u32>, usize) {
    // Adding zero turns -0 into 0.
    let key = |v: u32| (positions[v as usize] + 0.0).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).filter(|&v| used[v as usize]).collect();
    order.sort_by_key(|&v| (key(v), v));
    let mut first: Vec<u32> = (0..positions.len() as u32).collect();
    let mut count = 0;
    for run in order.chunk_by(|&a, &b| key(a) == key(b)) {
        run.iter().for_each(|&v| first[v as usize] = run[0]);
        count += run.len() - 1;
    }
    (first, count)
}

/// Whether each triangle is the first over its three vertices in any order.
pub(super) fn first_triangles(triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut keys: Vec<([u32; 3], usize)> = triangles.iter().copied().zip(0..).collect();
    keys.iter_mut().for_each(|(key, _)| key.sort_unstable());
    keys.sort_unstable();
    let mut first = vec![true; triangles.len()];
    keys.windows(2).filter(|pair| pair[0].0 == pair[1].0).for_each(|pair| first[pair[1].1] = false);
    first
}

/// The duplicate parts among `triangles`, each cut from a `face` of the file, those of one face side by side. Vertices at one
/// position have the same `place`. `None` without duplicates.
pub(super) fn duplicate_parts(triangles: &[[u32; 3]], face: &[u32], place: &[u32]) -> Option<DuplicateParts> {
    // Faces, not triangles: a quad and its duplicate may be cut along different diagonals.
    let mut end = 0;
    let ranges = face.chunk_by(|a, b| a == b).map(|run| {
        end += run.len();
        end - run.len()..end
    });
    let faces: Vec<Range<usize>> = ranges.collect();
    let corners = |of: &Range<usize>| triangles[of.clone()].as_flattened();
    let key = |of: &Range<usize>| each_once(corners(of).iter().map(|&v| place[v as usize]));
    let mut keys: Vec<Vec<u32>> = faces.iter().map(key).collect();
    keys.sort_unstable();
    keys.windows(2).any(|pair| pair[0] == pair[1]).then_some(())?;
    let (part_of, parts) = Topology::of(triangles, place.len()).components();
    let mut of_part: Vec<Vec<Range<usize>>> = vec![Vec::new(); parts];
    for of in faces {
        of_part[part_of[corners(&of)[0] as usize] as usize].push(of);
    }
    let mut kept: BTreeMap<Vec<u32>, Range<usize>> = BTreeMap::new();
    let mut found = DuplicateParts { keep: vec![true; triangles.len()], parts: 0, stand_in: BTreeMap::new() };
    for part in of_part.iter().filter(|part| !part.is_empty()) {
        if !part.iter().all(|of| kept.contains_key(&key(of))) {
            for of in part {
                kept.entry(key(of)).or_insert_with(|| of.clone());
            }
            continue;
        }
        found.parts += 1;
        for of in part {
            found.keep[of.clone()].fill(false);
            let below = corners(&kept[&key(of)]);
            let counterpart = |v: u32| below.iter().copied().find(|&b| place[b as usize] == place[v as usize]);
            found.stand_in.extend(corners(of).iter().filter_map(|&v| Some((v, counterpart(v)?))));
        }
    }
    (found.parts > 0).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coincident_part_is_a_duplicate_unless_it_extends_beyond() {
        // A quad, the same quad with other vertices and cut along the other diagonal, and a triangle on half of the first.
        let place = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2];
        let (triangles, face) = ([[0, 1, 2], [0, 2, 3], [5, 6, 7], [7, 4, 5], [9, 8, 10]], [0, 0, 1, 1, 2]);
        let found = duplicate_parts(&triangles, &face, &place).unwrap();
        assert_eq!((found.keep, found.parts), (vec![true, true, false, false, true], 1));
        assert_eq!(found.stand_in.into_iter().collect::<Vec<_>>(), [(4, 0), (5, 1), (6, 2), (7, 3)]);
        assert_eq!(duplicate_parts(&triangles[..2], &face[..2], &place), None);
        // The opposite winding, and a part that extends beyond the first.
        let found = duplicate_parts(&[[0, 1, 2], [9, 8, 10]], &[0, 1], &place).unwrap();
        assert_eq!((found.keep, found.parts), (vec![true, false], 1));
        assert_eq!(duplicate_parts(&[[0, 1, 2], [4, 5, 6], [4, 6, 7]], &[0, 1, 2], &place), None);
    }
}
