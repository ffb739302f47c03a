//! Marks on PARTs: a dot with a tooltip, and an arrow for the force. A mesh as a whole has one tooltip only, its path.

use glam::DVec3;
use rerun::{Arrows3D, Color, Points3D, Radius};

use super::eye::Eye;
use super::meshes::single;
use super::panel::range_cm;
use crate::picture::colour::legend::number;
use crate::picture::colour::palette::level_of_part;
use crate::study::metrics::LevelCount;

/// More dots than this would hide the PARTs.
const MAX_DOTS: usize = 400;
/// Radius of up to `FEW_DOTS` dots on screen, points; more dots are smaller.
const DOT_RADIUS: f32 = 1.4;
const FEW_DOTS: f32 = 100.0;
const MIN_DOT_RADIUS: f32 = 0.6;
/// Height of dots above the cloth, m.
const ABOVE_M: f64 = 0.003;
/// Length of the longest arrow over the garment's height.
const LONGEST_ARROW: f64 = 0.16;
/// More arrows than this are drawn smaller.
const MANY_ARROWS: f64 = 150.0;

/// For each PART the vertex nearest the front of its middle, as the eye sees it. The centroid of a ring would be inside the body.
fn anchors(eye: &Eye, placed: &[DVec3], part_of_vertex: &[u32], parts: usize) -> Vec<DVec3> {
    let toward = eye.toward;
    let mut sums = vec![(DVec3::ZERO, 0.0, f64::NEG_INFINITY); parts];
    for (&p, &x) in part_of_vertex.iter().zip(placed) {
        let (sum, count, front) = &mut sums[p as usize];
        *sum += x;
        *count += 1.0;
        *front = front.max(x.dot(toward));
    }
    let mut nearest = vec![(f64::INFINITY, DVec3::ZERO); parts];
    for (&p, &x) in part_of_vertex.iter().zip(placed) {
        let (sum, count, front) = sums[p as usize];
        let middle = sum / count;
        let distance = x.distance_squared(middle + toward * (front - middle.dot(toward)));
        if distance < nearest[p as usize].0 {
            nearest[p as usize] = (distance, x);
        }
    }
    nearest.into_iter().map(|(_, x)| x).collect()
}

/// The tooltip of each PART: number, level, size and force.
pub(super) fn tooltips(part_of_vertex: &[u32], part_force_n: &[DVec3], levels: &[LevelCount]) -> Vec<String> {
    let parts = part_force_n.len();
    let mut vertices = vec![0_usize; parts];
    part_of_vertex.iter().for_each(|&p| vertices[p as usize] += 1);
    let level_of_part = level_of_part(levels, parts);
    let tooltip = |p: usize| {
        let level = match level_of_part[p].map(|index| &levels[index]) {
            Some(l) => format!("level {} ({} cm)", l.level, range_cm(l.lower_cm, l.upper_cm)),
            None => "no level".to_owned(),
        };
        let force = number(1e3 * part_force_n[p].length());
        format!("PART {} of {parts}, {level}: {} vertices, {force} mN", p + 1, vertices[p])
    };
    (0..parts).map(tooltip).collect()
}

/// A dot per PART; none if there are too many.
pub(super) fn dots(eye: &Eye, placed: &[DVec3], part_of_vertex: &[u32], tooltips: Vec<String>) -> Points3D {
    let parts = tooltips.len();
    if parts > MAX_DOTS {
        return Points3D::new([[0.0_f32; 3]; 0]);
    }
    let anchors = anchors(eye, placed, part_of_vertex, parts);
    Points3D::new(anchors.into_iter().map(|x| single(x + ABOVE_M * eye.toward)))
        .with_labels(tooltips)
        .with_show_labels(false)
        .with_colors([Color::from_rgb(22, 24, 28)])
        .with_radii([Radius::new_ui_points(
            (DOT_RADIUS * (FEW_DOTS / parts as f32).sqrt()).clamp(MIN_DOT_RADIUS, DOT_RADIUS),
        )])
}

/// An arrow per PART. A force of `full_n` newtons has the longest arrow.
pub(super) fn arrows(
    eye: &Eye,
    placed: &[DVec3],
    part_of_vertex: &[u32],
    part_force_n: &[DVec3],
    full_n: f64,
) -> Arrows3D {
    let parts = part_force_n.len();
    let height = 2.0 * eye.half_height;
    let small = (MANY_ARROWS / parts as f64).sqrt().clamp(0.4, 1.0);
    let longest = LONGEST_ARROW * height * small;
    // In front of the cloth, so that an arrow along it is not half hidden.
    let anchors = anchors(eye, placed, part_of_vertex, parts);
    let origins = anchors.into_iter().map(|x| single(x + 0.035 * height * eye.toward));
    let vectors = part_force_n.iter().map(|f| {
        let length = (f.length() / full_n).min(1.25) * longest;
        single(f.normalize_or_zero() * length)
    });
    Arrows3D::from_vectors(vectors)
        .with_origins(origins)
        .with_radii([(0.0045 * height * small) as f32])
        .with_colors([Color::from_rgb(238, 240, 243)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tooltip_has_number_level_size_and_force() {
        let level = |level: usize, lower_cm: f64, parts: usize| LevelCount {
            level,
            lower_cm,
            upper_cm: lower_cm + 0.5,
            extent: None,
            vertices: 2 * parts,
            parts,
        };
        let levels = [level(1, 0.0, 1), level(2, 0.5, 0), level(3, 1.0, 1)];
        assert_eq!(
            tooltips(&[0, 0, 0, 1, 2], &[DVec3::X * 0.25, DVec3::Z, DVec3::ZERO], &levels),
            [
                "PART 1 of 3, level 1 (0 – 0.5 cm): 3 vertices, 250 mN",
                "PART 2 of 3, level 3 (1 – 1.5 cm): 1 vertices, 1000 mN",
                "PART 3 of 3, no level: 1 vertices, 0 mN",
            ]
        );
    }
}
