//! Connected parts that a file holds twice, face on face: a part exported twice, or faces doubled to be seen from both sides.
//!
//! Layers at exactly the same places have no order: nothing can say which is the outer one, and no contact takes them apart. The first is
//! kept, and the vertices of the others stand for those they lie on, so that an export moves all of them.
//!
//! Limits: a part counts as double where all its faces lie on kept ones; a part that is larger than what it lies on is kept.

use std::collections::BTreeMap;
use std::ops::Range;

use super::Topology;

/// What lies on something else.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Twins {
    /// Whether each triangle stays.
    pub(super) keep: Vec<bool>,
    /// Connected parts that do not.
    pub(super) parts: usize,
    /// Their vertices, each once, with the kept one at the same place.
    pub(super) stand_in: BTreeMap<u32, u32>,
}

/// The doubles among `triangles`, of which each is cut from a `face` of the file, those of one face side by side; `place` has one number for all
/// vertices at one place. `None` where there are none.
pub(super) fn twins(triangles: &[[u32; 3]], face: &[u32], place: &[u32]) -> Option<Twins> {
    // Faces, not triangles: a quad and its double may be cut along different diagonals.
    let mut faces: Vec<Range<usize>> = Vec::new();
    for (t, number) in face.iter().enumerate() {
        match faces.last_mut() {
            Some(last) if face[last.start] == *number => last.end = t + 1,
            _ => faces.push(t..t + 1),
        }
    }
    let corners = |of: &Range<usize>| triangles[of.clone()].as_flattened();
    let key = |of: &Range<usize>| {
        let mut key: Vec<u32> = corners(of).iter().map(|&v| place[v as usize]).collect();
        key.sort_unstable();
        key.dedup();
        key
    };
    let mut keys: Vec<Vec<u32>> = faces.iter().map(key).collect();
    keys.sort_unstable();
    keys.windows(2).any(|pair| pair[0] == pair[1]).then_some(())?;
    let (part_of, parts) = Topology::of(triangles, place.len()).components();
    let mut of_part: Vec<Vec<Range<usize>>> = vec![Vec::new(); parts];
    for of in faces {
        of_part[part_of[corners(&of)[0] as usize] as usize].push(of);
    }
    let mut kept: BTreeMap<Vec<u32>, Range<usize>> = BTreeMap::new();
    let mut found = Twins { keep: vec![true; triangles.len()], parts: 0, stand_in: BTreeMap::new() };
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
            let at_the_place = |v: u32| below.iter().copied().find(|&b| place[b as usize] == place[v as usize]);
            found.stand_in.extend(corners(of).iter().filter_map(|&v| Some((v, at_the_place(v)?))));
        }
    }
    (found.parts > 0).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_on_another_is_double_and_one_that_goes_on_is_not() {
        // A quad; the same with vertices of its own and cut along the other diagonal; a triangle on a half of the first.
        let place = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2];
        let (triangles, face) = ([[0, 1, 2], [0, 2, 3], [5, 6, 7], [7, 4, 5], [9, 8, 10]], [0, 0, 1, 1, 2]);
        let found = twins(&triangles, &face, &place).unwrap();
        assert_eq!((found.keep, found.parts), (vec![true, true, false, false, true], 1));
        assert_eq!(found.stand_in.into_iter().collect::<Vec<_>>(), [(4, 0), (5, 1), (6, 2), (7, 3)]);
        assert_eq!(twins(&triangles[..2], &face[..2], &place), None);
        // The other way round, and one that goes on beyond what it lies on.
        let found = twins(&[[0, 1, 2], [9, 8, 10]], &[0, 1], &place).unwrap();
        assert_eq!((found.keep, found.parts), (vec![true, false], 1));
        assert_eq!(twins(&[[0, 1, 2], [4, 5, 6], [4, 6, 7]], &[0, 1, 2], &place), None);
    }
}
