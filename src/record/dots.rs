//! A dot on each PART, which says what it is when one hovers over it: a mesh as a whole can only tell its path.

use glam::DVec3;
use rerun::{Color, Points3D, Radius};

use super::colours::level_of_part;
use super::eye::Eye;
use super::legend::number;
use super::meshes::single;
use super::panel::range_cm;
use super::{Open, RecordError, StepView, paths};

/// More dots than this would hide the PARTs.
const MOST: usize = 400;
/// Radius on screen, points, of so many; more are smaller, or they would look like a rash.
const RADIUS: f32 = 1.4;
const FEW: f32 = 100.0;
const SMALLEST: f32 = 0.6;
/// Height above the cloth, m.
const ABOVE_M: f64 = 0.003;

/// For each PART the vertex nearest the eye's side of its middle: the centroid of a ring lies inside the body.
pub(super) fn anchors(eye: &Eye, placed: &[DVec3], part_of_vertex: &[u32], parts: usize) -> Vec<DVec3> {
    let toward = eye.toward;
    let mut sum = vec![(DVec3::ZERO, 0.0, f64::NEG_INFINITY); parts];
    for (&p, &x) in part_of_vertex.iter().zip(placed) {
        let (total, count, front) = &mut sum[p as usize];
        *total += x;
        *count += 1.0;
        *front = front.max(x.dot(toward));
    }
    let mut best = vec![(f64::INFINITY, DVec3::ZERO); parts];
    for (&p, &x) in part_of_vertex.iter().zip(placed) {
        let (total, count, front) = sum[p as usize];
        let middle = total / count;
        let wanted = middle + toward * (front - middle.dot(toward));
        let off = x.distance_squared(wanted);
        if off < best[p as usize].0 {
            best[p as usize] = (off, x);
        }
    }
    best.into_iter().map(|(_, x)| x).collect()
}

/// What each PART is, in a line.
pub(super) fn told(step: &StepView<'_>) -> Vec<String> {
    let parts = step.part_force_n.len();
    let mut vertices = vec![0_usize; parts];
    step.part_of_vertex.iter().for_each(|&p| vertices[p as usize] += 1);
    let levels = level_of_part(&step.panel.levels, parts);
    let tell = |p: usize| {
        let level = match levels[p].map(|index| &step.panel.levels[index]) {
            Some(l) => format!("level {} ({} cm)", l.level, range_cm(l.lower_cm, l.upper_cm)),
            None => "no level".to_owned(),
        };
        let force = number(1e3 * step.part_force_n[p].length());
        format!("PART {} of {parts}, {level}: {} vertices, {force} mN", p + 1, vertices[p])
    };
    (0..parts).map(tell).collect()
}

pub(super) fn log(open: &Open, step: &StepView<'_>, told: Vec<String>) -> Result<(), RecordError> {
    let parts = step.part_force_n.len();
    if parts > MOST {
        return open.log(paths::PART_DOTS, &Points3D::new([[0.0_f32; 3]; 0]));
    }
    let places = anchors(&open.eye, &open.garment.positions, step.part_of_vertex, parts);
    let dots = Points3D::new(places.into_iter().map(|x| single(x + ABOVE_M * open.eye.toward)))
        .with_labels(told)
        .with_show_labels(false)
        .with_colors([Color::from_rgb(22, 24, 28)])
        .with_radii([Radius::new_ui_points((RADIUS * (FEW / parts as f32).sqrt()).clamp(SMALLEST, RADIUS))]);
    open.log(paths::PART_DOTS, &dots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Panel;
    use crate::study::metrics::LevelCount;

    #[test]
    fn a_part_is_told_by_number_level_size_and_force() {
        let level = |level: usize, lower_cm: f64, parts: usize| LevelCount {
            level,
            lower_cm,
            upper_cm: lower_cm + 0.5,
            extent: None,
            vertices: 2 * parts,
            parts,
        };
        let panel = Panel { levels: vec![level(1, 0.0, 1), level(2, 0.5, 0), level(3, 1.0, 1)], ..Panel::default() };
        let step = StepView {
            index: 0,
            distance_m: &[],
            part_of_vertex: &[0, 0, 0, 1, 2],
            part_force_n: &[DVec3::X * 0.25, DVec3::Z, DVec3::ZERO],
            draped: &[],
            panel: &panel,
            scalars: &[],
            overlays: &[],
        };
        assert_eq!(
            told(&step),
            [
                "PART 1 of 3, level 1 (0 – 0.5 cm): 3 vertices, 250 mN",
                "PART 2 of 3, level 3 (1 – 1.5 cm): 1 vertices, 1000 mN",
                "PART 3 of 3, no level: 1 vertices, 0 mN",
            ]
        );
    }
}
