//! Colours of a mesh that leaves the program without a recording: those that the views show.

use super::colour_map::{ColourMap, Rgb};
use super::colours::colour_parts;
use super::overlay::{Overlay, own_range};
use super::step::covering;
use crate::mesh::TriMesh;
use crate::study::metrics::LevelCount;

/// Red, green, blue and opacity.
type Rgba = [u8; 4];

/// PARTs as in the view of them: the hue says the level, the shade tells neighbours apart.
///
/// `part_of_vertex`: PART of each vertex of `garment`, or [`UNASSIGNED`](crate::parts::UNASSIGNED), of `parts`; `levels`: what makes them.
#[must_use]
pub(crate) fn by_parts(garment: &TriMesh, part_of_vertex: &[u32], parts: usize, levels: &[LevelCount]) -> Vec<Rgba> {
    let part_of_vertex = covering(part_of_vertex, parts);
    let all = parts + usize::from(part_of_vertex.contains(&(parts as u32)));
    let chosen = colour_parts(&part_of_vertex, all, levels, &garment.triangles, &[]);
    part_of_vertex.iter().map(|&p| opaque(chosen.colour[p as usize])).collect()
}

/// Values as in the views of the fit, by a scale of their own.
#[must_use]
pub(crate) fn by_values(overlay: &Overlay<'_>) -> Vec<Rgba> {
    ColourMap::ALARM.colours(overlay.values, own_range(overlay)).into_iter().map(opaque).collect()
}

fn opaque([red, green, blue]: Rgb) -> Rgba {
    [red, green, blue, 255]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::UNASSIGNED;
    use glam::DVec3;

    #[test]
    fn parts_differ_and_more_strain_is_another_colour() {
        let garment = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE], vec![[0, 1, 2], [1, 3, 2]]);
        let level =
            |level, vertices, parts| LevelCount { level, lower_cm: 0.0, upper_cm: 1.0, extent: None, vertices, parts };
        let colours = by_parts(&garment, &[0, 1, 1, UNASSIGNED], 2, &[level(1, 1, 1), level(2, 2, 1)]);
        assert_eq!((colours.len(), colours[1]), (4, colours[2]));
        assert!(colours[0] != colours[1] && colours[3] != colours[0] && colours[3] != colours[1], "{colours:?}");
        let strain = by_values(&Overlay { name: "strain", unit: "%", values: &[0.0, 2.0, 4.0, 40.0] });
        assert!(strain.windows(2).all(|two| two[0] != two[1]) && strain.iter().all(|c| c[3] == 255), "{strain:?}");
        let calm = by_values(&Overlay { name: "strain", unit: "%", values: &[0.0, 0.1, 0.0, 0.1] });
        assert!(calm[1][0].abs_diff(calm[0][0]) < 16, "a tenth of a per cent is no alarm: {calm:?}");
    }
}
