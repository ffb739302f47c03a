//! Colours of the PARTs: distinct between neighbours, stable from table to table.
//!
//! Greedy colouring of the PART adjacency graph, large PARTs first. A PART wants the colour that most of its vertices had
//! in the step before; where a neighbour has it already, or there was no step before, it takes the colour used
//! least among those far from its neighbours', or the farthest. Ties go to the first.
//!
//! Limits: with more neighbours than the palette has colours two may share one; neighbours then differ as far as it goes.

use super::colour_map::{Rgb, oklch};

/// The body: a matte grey with a trace of skin, so that the garment keeps the colour.
pub(super) const BODY: Rgb = [186, 178, 172];
/// The garment as loaded.
pub(super) const CLOTH: Rgb = [196, 202, 210];
/// The displaced garment.
pub(super) const DRAPED: Rgb = [118, 176, 228];

/// Hues of the palette; its first so many entries are of one lightness.
pub(super) const HUES: usize = 12;
/// Colours this far apart (see `difference`) are told apart at a glance; farther is no better.
const FAR_ENOUGH: u32 = 12_000;

/// Twelve hues in three lightnesses; neighbouring entries lie far apart.
pub(super) fn palette() -> Vec<Rgb> {
    let mut colours = Vec::with_capacity(3 * HUES);
    for (lightness, chroma, turn) in [(0.76, 0.14, 0.0), (0.88, 0.09, 12.0), (0.60, 0.15, 20.0)] {
        for i in 0..HUES {
            // 5 and 12 share no factor, so this visits every hue, 150° at a time.
            colours.push(oklch(lightness, chroma, turn + 30.0 * ((5 * i) % HUES) as f64));
        }
    }
    colours
}

/// Index into [`palette`] for each PART.
///
/// `part_of_vertex`: PART of each vertex. `triangles`: whose edges make two PARTs neighbours. `before`: palette index
/// of each vertex in the previous step (empty, or of another length: none).
pub(super) fn colour_parts(
    part_of_vertex: &[u32],
    part_count: usize,
    triangles: &[[u32; 3]],
    before: &[u8],
) -> Vec<u8> {
    let colours = palette();
    let neighbours = adjacency(part_of_vertex, part_count, triangles);
    let mut size = vec![0usize; part_count];
    let mut votes = vec![0u32; part_count * colours.len()];
    let remembered = before.len() == part_of_vertex.len();
    for (v, &part) in part_of_vertex.iter().enumerate() {
        size[part as usize] += 1;
        if remembered {
            votes[part as usize * colours.len() + before[v] as usize] += 1;
        }
    }
    let mut order: Vec<usize> = (0..part_count).collect();
    order.sort_by_key(|&p| (std::cmp::Reverse(size[p]), p));
    let mut chosen: Vec<Option<u8>> = vec![None; part_count];
    let mut used = vec![0usize; colours.len()];
    for part in order {
        let taken: Vec<Rgb> =
            neighbours[part].iter().filter_map(|&n| chosen[n as usize]).map(|c| colours[c as usize]).collect();
        let votes = &votes[part * colours.len()..(part + 1) * colours.len()];
        let best = (0..colours.len()).max_by_key(|&c| {
            let distance = taken.iter().map(|&t| difference(colours[c], t)).min().unwrap_or(u32::MAX);
            let free = distance > 0;
            let vote = if free { votes[c] } else { 0 };
            (vote, distance.min(FAR_ENOUGH), std::cmp::Reverse(used[c]), std::cmp::Reverse(c))
        });
        let best = best.unwrap_or(0);
        used[best] += 1;
        chosen[part] = Some(best as u8);
    }
    chosen.into_iter().map(|c| c.unwrap_or(0)).collect()
}

/// Squared difference of two colours, red and blue weighted as T. Riemersma's "redmean" does at mid red.
fn difference(a: Rgb, b: Rgb) -> u32 {
    let d = |i: usize| u32::from(a[i].abs_diff(b[i])).pow(2);
    (5 * d(0) + 8 * d(1) + 5 * d(2)) / 2
}

fn adjacency(part_of_vertex: &[u32], part_count: usize, triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut pairs = Vec::new();
    for &[a, b, c] in triangles {
        for (i, j) in [(a, b), (b, c), (c, a)] {
            let (p, q) = (part_of_vertex[i as usize], part_of_vertex[j as usize]);
            if p != q {
                pairs.push((p, q));
                pairs.push((q, p));
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    let mut neighbours = vec![Vec::new(); part_count];
    for (p, q) in pairs {
        neighbours[p as usize].push(q);
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `n` squares: vertices 2i and 2i+1 at x = i.
    fn strip(n: u32) -> Vec<[u32; 3]> {
        (0..n).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect()
    }

    #[test]
    fn the_palette_has_no_two_alike() {
        let colours = palette();
        for (i, &a) in colours.iter().enumerate() {
            for &b in &colours[i + 1..] {
                assert!(difference(a, b) > 800, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn neighbours_differ_and_a_moved_border_keeps_the_colours() {
        let triangles = strip(11);
        let parts = |borders: [u32; 3]| -> Vec<u32> {
            (0..24).map(|v| borders.iter().filter(|&&b| v / 2 >= b).count() as u32).collect()
        };
        let first = parts([3, 6, 9]);
        let colours = colour_parts(&first, 4, &triangles, &[]);
        for k in 0..3 {
            assert_ne!(colours[k], colours[k + 1]);
        }
        let before: Vec<u8> = first.iter().map(|&p| colours[p as usize]).collect();
        assert_eq!(colour_parts(&parts([4, 6, 8]), 4, &triangles, &before), colours);
        // Two PARTs joined into one keep the larger one's colour; the rest keeps its own.
        let joined: Vec<u32> = parts([4, 6, 8]).iter().map(|&p| p.saturating_sub(1)).collect();
        let after = colour_parts(&joined, 3, &triangles, &before);
        assert_eq!(after[1..], colours[2..]);
    }

    #[test]
    fn a_neighbour_never_shares_a_colour_while_the_palette_lasts() {
        // A fan: vertex 0 in the middle of 30 others, each a PART of its own.
        let triangles: Vec<[u32; 3]> = (1..30).map(|i| [0, i, i + 1]).collect();
        let parts: Vec<u32> = (0..31).collect();
        let colours = colour_parts(&parts, 31, &triangles, &[]);
        for &[a, b, c] in &triangles {
            assert_ne!(colours[a as usize], colours[b as usize]);
            assert_ne!(colours[b as usize], colours[c as usize]);
        }
    }
}
