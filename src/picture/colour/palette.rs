//! Colours of the recording: PARTs, fabrics, layers, and the lines of plots.
//!
//! A PART's hue is its level's, from blue next to the body over green and yellow to red; its shade distinguishes it from the other PARTs
//! of the level. The colours are stable from table to table.
//!
//! Method: greedy colouring of the PART adjacency graph, large PARTs first. A PART takes the shade that most of its vertices had
//! in the previous step. If that is too close to a neighbour's colour, or there was no previous step, it takes the shade that its level uses
//! least among those far from its neighbours' colours, or the farthest. Ties go to the first shade.
//!
//! Limits: with more neighbours than shades two may look alike; neighbours then differ as far as possible. Adjacent levels of twenty
//! differ by fifteen degrees of hue.

use std::borrow::Cow;

use super::map::{Rgb, oklch};
use crate::mesh::{Topology, TriMesh};
use crate::parts::UNASSIGNED;
use crate::study::metrics::LevelCount;

/// The body: darker than any cloth and than the pale end of the colour maps, lighter than the background.
pub(crate) const BODY: Rgb = [118, 109, 103];
/// The garment as loaded.
pub(crate) const CLOTH: Rgb = [196, 202, 210];
/// The draped garment.
pub(crate) const DRAPED: Rgb = [118, 176, 228];
/// Further fabrics, layers and connected components of it.
const FURTHER: [Rgb; 3] = [[226, 190, 132], [158, 196, 150], [206, 148, 172]];
/// Vertices in no level.
const OUTSIDE: Rgb = [128, 128, 128];

/// Number of hues for the lines of a plot.
pub(crate) const HUES: usize = 12;
/// Colour difference (see `difference`) beyond which a larger one is no easier to see. A heuristic.
const FAR_ENOUGH: u32 = 12_000;
/// Least colour difference of two adjacent areas that look different. A heuristic.
const CLEAR: u32 = 5_000;
/// Hues of the first and the last level, degrees.
const LEVEL_HUES: [f64; 2] = [280.0, -15.0];
/// Lightness and chroma of the shades of a level.
const SHADES: [(f64, f64); 5] = [(0.76, 0.125), (0.60, 0.14), (0.88, 0.08), (0.50, 0.12), (0.68, 0.07)];

/// Colour of each vertex of the draped garment: one per connected component, if there are few enough.
pub(crate) fn by_component(garment: &TriMesh) -> Vec<Rgb> {
    let (component, count) = Topology::new(garment).components();
    let few = count <= 1 + FURTHER.len();
    component.into_iter().map(|k| if few { of_layer(k as usize) } else { DRAPED }).collect()
}

/// Colour of layer or fabric number `k`.
pub(crate) fn of_layer(k: usize) -> Rgb {
    k.checked_sub(1).map_or(DRAPED, |further| FURTHER[further % FURTHER.len()])
}

/// Twelve hues of one lightness for the lines of a plot and the dots of a scatter; consecutive entries are far apart.
pub(crate) fn palette() -> Vec<Rgb> {
    // 5 and 12 share no factor, so this visits every hue, 150° at a time.
    (0..HUES).map(|i| oklch(0.76, 0.14, 30.0 * ((5 * i) % HUES) as f64)).collect()
}

/// Position of each level among those that hold vertices, from 0 for the nearest to 1 for the farthest.
pub(crate) fn level_positions(levels: &[LevelCount]) -> Vec<Option<f64>> {
    let count = levels.iter().filter(|level| level.vertices > 0).count();
    let mut ranks = 0..count;
    let position = |level: &LevelCount| {
        let rank = if level.vertices > 0 { ranks.next()? } else { return None };
        Some(rank as f64 / (count.max(2) - 1) as f64)
    };
    levels.iter().map(position).collect()
}

/// Index of the level of each PART: PARTs are numbered level by level. [`None`] beyond the last: the vertices in no level.
pub(crate) fn level_of_part(levels: &[LevelCount], parts: usize) -> Vec<Option<usize>> {
    let by_level = levels.iter().enumerate().flat_map(|(index, level)| std::iter::repeat_n(Some(index), level.parts));
    by_level.chain(std::iter::repeat(None)).take(parts).collect()
}

/// A shade of the level at a position.
pub(crate) fn shade(position: Option<f64>, shade: u8) -> Rgb {
    let Some(position) = position else { return OUTSIDE };
    let (lightness, chroma) = SHADES[usize::from(shade) % SHADES.len()];
    oklch(lightness, chroma, LEVEL_HUES[0] + position * (LEVEL_HUES[1] - LEVEL_HUES[0]))
}

/// The middle shade of each level's hue, red, green and blue, for a legend beside the views.
pub(crate) fn level_colours(levels: &[LevelCount]) -> Vec<Rgb> {
    level_positions(levels).into_iter().map(|position| shade(position, 1)).collect()
}

/// The PART of each vertex, with one further PART, number `parts`, for the vertices in no level, if there are any.
pub(crate) fn with_outside(part_of_vertex: &[u32], parts: usize) -> Cow<'_, [u32]> {
    if !part_of_vertex.contains(&UNASSIGNED) {
        return part_of_vertex.into();
    }
    part_of_vertex.iter().map(|&p| if p == UNASSIGNED { parts as u32 } else { p }).collect()
}

/// Colour of each vertex by its PART, as in the view of PARTs, for a mesh that is exported. `part_of_vertex` may hold [`UNASSIGNED`].
pub(crate) fn by_parts(garment: &TriMesh, part_of_vertex: &[u32], parts: usize, levels: &[LevelCount]) -> Vec<[u8; 4]> {
    let part_of_vertex = with_outside(part_of_vertex, parts);
    let all = parts + usize::from(part_of_vertex.contains(&(parts as u32)));
    colour_parts(&part_of_vertex, all, levels, &garment.triangles, &[]).of_vertices.into_iter().map(opaque).collect()
}

/// Red, green, blue and full opacity.
pub(crate) fn opaque([red, green, blue]: Rgb) -> [u8; 4] {
    [red, green, blue, 255]
}

/// Shades and colours of PARTs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PartColours {
    /// Shade of each vertex's PART, an index into the shades of a level.
    pub(crate) vertex_shade: Vec<u8>,
    /// Colour of each vertex's PART.
    pub(crate) of_vertices: Vec<Rgb>,
}

/// Colours the PARTs.
///
/// `part_of_vertex`: PART of each vertex. `levels`: the levels of the PARTs. `triangles`: their edges make PARTs
/// neighbours. `before`: shade of each vertex in the previous step; ignored if its length differs.
pub(crate) fn colour_parts(
    part_of_vertex: &[u32],
    part_count: usize,
    levels: &[LevelCount],
    triangles: &[[u32; 3]],
    before: &[u8],
) -> PartColours {
    let of_level = level_positions(levels);
    let level_of_part = level_of_part(levels, part_count);
    let position: Vec<Option<f64>> = level_of_part.iter().map(|level| level.and_then(|l| of_level[l])).collect();
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
    // The last count is of the vertices in no level.
    let mut used = vec![[0usize; SHADES.len()]; levels.len() + 1];
    for part in order {
        let level = level_of_part[part].unwrap_or(levels.len());
        let taken: Vec<Rgb> =
            neighbours[part].iter().filter_map(|&n| Some(shade(position[n as usize], chosen[n as usize]?))).collect();
        let best = (0..SHADES.len()).max_by_key(|&c| {
            let own = shade(position[part], c as u8);
            let distance = taken.iter().map(|&t| difference(own, t)).min().unwrap_or(u32::MAX).min(FAR_ENOUGH);
            let clear = distance >= CLEAR;
            let vote = if clear { votes[part][c] } else { 0 };
            (clear, vote, distance, std::cmp::Reverse(used[level][c]), std::cmp::Reverse(c))
        });
        let best = best.unwrap_or(0);
        used[level][best] += 1;
        chosen[part] = Some(best as u8);
    }
    let shade_of = |part: u32| chosen[part as usize].unwrap_or(0);
    let colours: Vec<Rgb> = (0..part_count).map(|part| shade(position[part], shade_of(part as u32))).collect();
    PartColours {
        vertex_shade: part_of_vertex.iter().map(|&p| shade_of(p)).collect(),
        of_vertices: part_of_vertex.iter().map(|&p| colours[p as usize]).collect(),
    }
}

/// Squared difference of two colours, with the weights of T. Riemersma's "redmean" at mid red.
fn difference(a: Rgb, b: Rgb) -> u32 {
    let d = |i: usize| u32::from(a[i].abs_diff(b[i])).pow(2);
    (5 * d(0) + 8 * d(1) + 5 * d(2)) / 2
}

/// The PARTs that share an edge of a triangle with each PART.
fn adjacency(part_of_vertex: &[u32], part_count: usize, triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let joined = edges.map(|edge| edge.map(|v| part_of_vertex[v as usize])).filter(|[p, q]| p != q);
    let mut pairs: Vec<[u32; 2]> = joined.flat_map(|[p, q]| [[p, q], [q, p]]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut neighbours = vec![Vec::new(); part_count];
    for [p, q] in pairs {
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

    /// Levels with these numbers of PARTs.
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
    fn lines_of_a_plot_differ_in_colour() {
        let colours = palette();
        for (i, &a) in colours.iter().enumerate() {
            for &b in &colours[i + 1..] {
                assert!(difference(a, b) > 800, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_level_has_a_hue_and_its_parts_have_its_shades() {
        // Two PARTs in each of three levels, an empty level in between.
        let levels = levels(&[2, 0, 2, 2]);
        assert_eq!(level_positions(&levels), [Some(0.0), None, Some(0.5), Some(1.0)]);
        assert_eq!(level_of_part(&levels, 7), [Some(0), Some(0), Some(2), Some(2), Some(3), Some(3), None]);
        let parts: Vec<u32> = (0..14).map(|v| v / 2).collect();
        let colours = colour_parts(&parts, 7, &levels, &strip(6), &[]).of_vertices;
        let colours: Vec<Rgb> = colours.into_iter().step_by(2).collect();
        let leading = |c: Rgb| (0..3).max_by_key(|&i| c[i]).unwrap();
        let channels: Vec<usize> = colours.iter().take(6).map(|&c| leading(c)).collect();
        assert_eq!(channels, [2, 2, 1, 1, 0, 0], "blue, green, red: {colours:?}");
        assert_eq!(colours[6], OUTSIDE);
        for pair in colours.windows(2) {
            assert!(difference(pair[0], pair[1]) >= CLEAR, "{pair:?}");
        }
        // Every shade of every level differs from the body.
        for place in (0..=20).map(|i| f64::from(i) / 20.0) {
            for number in 0..SHADES.len() as u8 {
                let colour = shade(Some(place), number);
                assert!(difference(colour, BODY) >= CLEAR, "{place} {number}: {colour:?}");
            }
        }
    }

    #[test]
    fn colours_persist_when_a_border_moves() {
        let triangles = strip(11);
        let levels = levels(&[1, 1, 1, 1]);
        let parts = |borders: [u32; 3]| -> Vec<u32> {
            (0..24).map(|v| borders.iter().filter(|&&b| v / 2 >= b).count() as u32).collect()
        };
        let (first, second) = (parts([3, 6, 9]), parts([4, 6, 8]));
        let before = colour_parts(&first, 4, &levels, &triangles, &[]);
        let of_parts = |of_vertex: &[u32], colours: &PartColours| -> Vec<Rgb> {
            (0..4).map(|part| colours.of_vertices[of_vertex.iter().position(|&p| p == part).unwrap()]).collect()
        };
        let colours = of_parts(&first, &before);
        for pair in colours.windows(2) {
            assert!(difference(pair[0], pair[1]) >= CLEAR, "{pair:?}");
        }
        let after = colour_parts(&second, 4, &levels, &triangles, &before.vertex_shade);
        assert_eq!(of_parts(&second, &after), colours);
    }

    #[test]
    fn neighbours_in_one_level_differ_while_there_are_enough_shades() {
        // A fan: vertex 0 in the middle of 30 others, 31 PARTs of one level.
        let triangles: Vec<[u32; 3]> = (1..30).map(|i| [0, i, i + 1]).collect();
        let parts: Vec<u32> = (0..31).collect();
        let colours = colour_parts(&parts, 31, &levels(&[31]), &triangles, &[]).of_vertices;
        for &[a, b, c] in &triangles {
            assert_ne!(colours[a as usize], colours[b as usize]);
            assert_ne!(colours[b as usize], colours[c as usize]);
        }
    }

    #[test]
    fn exported_parts_differ_from_each_other_and_from_vertices_outside() {
        let garment = TriMesh::new(
            vec![glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y, glam::DVec3::ONE],
            vec![[0, 1, 2], [1, 3, 2]],
        );
        let colours = by_parts(&garment, &[0, 1, 1, UNASSIGNED], 2, &levels(&[1, 1]));
        assert_eq!((colours.len(), colours[1]), (4, colours[2]));
        assert!(colours[0] != colours[1] && colours[3] != colours[0] && colours[3] != colours[1], "{colours:?}");
    }
}
