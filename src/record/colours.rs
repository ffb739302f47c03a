//! Colours of the PARTs: the hue says the level, from blue next to the body over green and yellow to red, the shade tells the
//! PARTs of a level and its neighbours apart; stable from table to table.
//!
//! Greedy colouring of the PART adjacency graph, large PARTs first. A PART wants the shade that most of its vertices had
//! in the step before; where that is too near a neighbour's colour, or there was no step before, it takes the shade used least in
//! its level among those far from its neighbours', or the farthest. Ties go to the first.
//!
//! Limits: with more neighbours than there are shades two may be alike; neighbours then differ as far as it goes. Of twenty levels
//! two next to each other differ by fifteen degrees of hue.

use super::colour_map::{Rgb, oklch};
use crate::mesh::{Topology, TriMesh};
use crate::study::metrics::LevelCount;

/// The body: darker than any cloth and than the pale end of the colour maps, lighter than the ground.
pub(super) const BODY: Rgb = [118, 109, 103];
/// The garment as loaded.
pub(super) const CLOTH: Rgb = [196, 202, 210];
/// The displaced garment.
pub(super) const DRAPED: Rgb = [118, 176, 228];
/// Connected parts of it besides the first, garments over each other for one.
const OVER: [Rgb; 3] = [[226, 190, 132], [158, 196, 150], [206, 148, 172]];
/// What lies in no level.
const OUTSIDE: Rgb = [128, 128, 128];

/// Hues of the lines of a plot.
pub(super) const HUES: usize = 12;
/// Colours this far apart (see `difference`) are told apart at a glance; farther is no better.
const FAR_ENOUGH: u32 = 12_000;
/// Nearer than this they are not told apart side by side.
const CLEAR: u32 = 5_000;
/// Hues of the first and the last level, degrees.
const LEVEL_HUES: [f64; 2] = [280.0, -15.0];
/// Lightness and chroma of the shades of a level.
const SHADES: [(f64, f64); 5] = [(0.76, 0.125), (0.60, 0.14), (0.88, 0.08), (0.50, 0.12), (0.68, 0.07)];

/// A colour for each vertex of the displaced garment: its connected parts are told apart where there are few enough.
pub(super) fn by_part(garment: &TriMesh) -> Vec<Rgb> {
    let (part, count) = Topology::new(garment).components();
    let of = |part: u32| match part.checked_sub(1) {
        Some(next) if count <= 1 + OVER.len() => OVER[next as usize % OVER.len()],
        _ => DRAPED,
    };
    part.into_iter().map(of).collect()
}

/// A colour for each vertex of the displaced garment by its fabric.
pub(super) fn by_fabric(fabric_of_vertex: &[u16]) -> Vec<Rgb> {
    fabric_of_vertex.iter().map(|&fabric| of_layer(fabric.into())).collect()
}

/// The colour of garment number `k` of an outfit, inner to outer.
pub(super) fn of_layer(k: usize) -> Rgb {
    k.checked_sub(1).map_or(DRAPED, |next| OVER[next % OVER.len()])
}

/// Twelve hues of one lightness for the lines of a plot and the dots of a scatter; neighbouring entries lie far apart.
pub(super) fn palette() -> Vec<Rgb> {
    // 5 and 12 share no factor, so this visits every hue, 150° at a time.
    (0..HUES).map(|i| oklch(0.76, 0.14, 30.0 * ((5 * i) % HUES) as f64)).collect()
}

/// Where each level stands among those that hold vertices, from 0 for the nearest to 1 for the farthest; its hue.
pub(super) fn places(levels: &[LevelCount]) -> Vec<Option<f64>> {
    let held = levels.iter().filter(|level| level.vertices > 0).count();
    let mut rank = 0;
    let place = |level: &LevelCount| {
        (level.vertices > 0).then(|| {
            rank += 1;
            (f64::from(rank) - 1.0) / (held.max(2) - 1) as f64
        })
    };
    levels.iter().map(place).collect()
}

/// The level of each PART, by index: PARTs are numbered level by level. [`None`] beyond the last: what lies in no level.
pub(super) fn level_of_part(levels: &[LevelCount], parts: usize) -> Vec<Option<usize>> {
    let by_level = levels.iter().enumerate().flat_map(|(index, level)| std::iter::repeat_n(Some(index), level.parts));
    by_level.chain(std::iter::repeat(None)).take(parts).collect()
}

/// A shade of the level at this place.
pub(super) fn shade(place: Option<f64>, shade: u8) -> Rgb {
    let Some(place) = place else { return OUTSIDE };
    let (lightness, chroma) = SHADES[usize::from(shade) % SHADES.len()];
    oklch(lightness, chroma, LEVEL_HUES[0] + place * (LEVEL_HUES[1] - LEVEL_HUES[0]))
}

/// The middle shade of each level's hue, red, green and blue, for a legend beside the views.
#[must_use]
pub fn level_colours(levels: &[LevelCount]) -> Vec<[u8; 3]> {
    places(levels).into_iter().map(|place| shade(place, 1)).collect()
}

/// PARTs and how they are seen.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PartColours {
    /// Number of each PART's shade within its level.
    pub(super) shade: Vec<u8>,
    /// The colours.
    pub(super) colour: Vec<Rgb>,
}

/// Shade and colour of each PART.
///
/// `part_of_vertex`: PART of each vertex. `levels`: what makes them, for their hues. `triangles`: whose edges make two PARTs
/// neighbours. `before`: shade of each vertex in the previous step (empty, or of another length: none).
pub(super) fn colour_parts(
    part_of_vertex: &[u32],
    part_count: usize,
    levels: &[LevelCount],
    triangles: &[[u32; 3]],
    before: &[u8],
) -> PartColours {
    let of_level = places(levels);
    let level_of_part = level_of_part(levels, part_count);
    let place: Vec<Option<f64>> = level_of_part.iter().map(|level| level.and_then(|l| of_level[l])).collect();
    let neighbours = adjacency(part_of_vertex, part_count, triangles);
    let mut size = vec![0usize; part_count];
    let mut votes = vec![[0u32; SHADES.len()]; part_count];
    let remembered = before.len() == part_of_vertex.len();
    for (v, &part) in part_of_vertex.iter().enumerate() {
        size[part as usize] += 1;
        if remembered {
            votes[part as usize][usize::from(before[v]) % SHADES.len()] += 1;
        }
    }
    let mut order: Vec<usize> = (0..part_count).collect();
    order.sort_by_key(|&p| (std::cmp::Reverse(size[p]), p));
    let mut chosen: Vec<Option<u8>> = vec![None; part_count];
    // The last count is theirs that lie in no level.
    let mut used = vec![[0usize; SHADES.len()]; levels.len() + 1];
    for part in order {
        let level = level_of_part[part].unwrap_or(levels.len());
        let taken: Vec<Rgb> =
            neighbours[part].iter().filter_map(|&n| Some(shade(place[n as usize], chosen[n as usize]?))).collect();
        let best = (0..SHADES.len()).max_by_key(|&c| {
            let own = shade(place[part], c as u8);
            let distance = taken.iter().map(|&t| difference(own, t)).min().unwrap_or(u32::MAX).min(FAR_ENOUGH);
            let clear = distance >= CLEAR;
            let vote = if clear { votes[part][c] } else { 0 };
            (clear, vote, distance, std::cmp::Reverse(used[level][c]), std::cmp::Reverse(c))
        });
        let best = best.unwrap_or(0);
        used[level][best] += 1;
        chosen[part] = Some(best as u8);
    }
    let shades: Vec<u8> = chosen.into_iter().map(|c| c.unwrap_or(0)).collect();
    let colour = shades.iter().zip(place).map(|(&c, place)| shade(place, c)).collect();
    PartColours { shade: shades, colour }
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

    /// Levels of so many PARTs.
    fn levels(parts: &[usize]) -> Vec<LevelCount> {
        let level = |(index, &parts): (usize, &usize)| LevelCount {
            level: index + 1,
            lower_cm: index as f64,
            upper_cm: index as f64 + 1.0,
            vertices: 10 * parts,
            parts,
            ..LevelCount::default()
        };
        parts.iter().enumerate().map(level).collect()
    }

    #[test]
    fn the_lines_of_a_plot_have_no_two_alike() {
        let colours = palette();
        for (i, &a) in colours.iter().enumerate() {
            for &b in &colours[i + 1..] {
                assert!(difference(a, b) > 800, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_level_has_a_hue_and_its_parts_have_shades_of_it() {
        // Two PARTs in each of three levels, an empty level in between.
        let levels = levels(&[2, 0, 2, 2]);
        assert_eq!(places(&levels), [Some(0.0), None, Some(0.5), Some(1.0)]);
        assert_eq!(level_of_part(&levels, 7), [Some(0), Some(0), Some(2), Some(2), Some(3), Some(3), None]);
        let parts: Vec<u32> = (0..14).map(|v| v / 2).collect();
        let colours = colour_parts(&parts, 7, &levels, &strip(6), &[]);
        let leading = |c: Rgb| (0..3).max_by_key(|&i| c[i]).unwrap();
        let channels: Vec<usize> = colours.colour.iter().take(6).map(|&c| leading(c)).collect();
        assert_eq!(channels, [2, 2, 1, 1, 0, 0], "blue, green, red: {:?}", colours.colour);
        assert_eq!(colours.colour[6], OUTSIDE);
        for pair in colours.colour.windows(2) {
            assert!(difference(pair[0], pair[1]) >= CLEAR, "{pair:?}");
        }
        // Whatever level and shade, a cloth is told from the body beside it.
        for place in (0..=20).map(|i| f64::from(i) / 20.0) {
            for number in 0..SHADES.len() as u8 {
                let colour = shade(Some(place), number);
                assert!(difference(colour, BODY) >= CLEAR, "{place} {number}: {colour:?}");
            }
        }
    }

    #[test]
    fn a_moved_border_keeps_the_colours() {
        let triangles = strip(11);
        let levels = levels(&[1, 1, 1, 1]);
        let parts = |borders: [u32; 3]| -> Vec<u32> {
            (0..24).map(|v| borders.iter().filter(|&&b| v / 2 >= b).count() as u32).collect()
        };
        let first = parts([3, 6, 9]);
        let colours = colour_parts(&first, 4, &levels, &triangles, &[]);
        for pair in colours.colour.windows(2) {
            assert!(difference(pair[0], pair[1]) >= CLEAR, "{pair:?}");
        }
        let before: Vec<u8> = first.iter().map(|&p| colours.shade[p as usize]).collect();
        assert_eq!(colour_parts(&parts([4, 6, 8]), 4, &levels, &triangles, &before), colours);
    }

    #[test]
    fn neighbours_in_one_level_are_told_apart_while_its_shades_last() {
        // A fan: vertex 0 in the middle of 30 others, each a PART of its own, all in one level.
        let triangles: Vec<[u32; 3]> = (1..30).map(|i| [0, i, i + 1]).collect();
        let parts: Vec<u32> = (0..31).collect();
        let colours = colour_parts(&parts, 31, &levels(&[31]), &triangles, &[]).colour;
        for &[a, b, c] in &triangles {
            assert_ne!(colours[a as usize], colours[b as usize]);
            assert_ne!(colours[b as usize], colours[c as usize]);
        }
    }
}
