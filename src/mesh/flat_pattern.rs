//! Recognises texture coordinates that are the flat pattern of a garment, and their unit.
//!
//! The map from the texture coordinates of a triangle to its corners in space has singular values σ₁ ≥ σ₂, metres per unit.
//! Undraped cloth has one scale s, with σ₁ and σ₂ within a few percent of it except along open seams and where it is stretched.
//! An atlas made for pictures is unfolded at any scale and stretched everywhere.
//!
//! s is the median of √(σ₁ σ₂), weighted by area in the pattern, or the unit (m, dm, cm, mm, in) within `UNIT_TOLERANCE` of it.
//! The coordinates are a pattern if triangles of `MIN_SHARE` of the area are within `SCALE_TOLERANCE` of s, and if the area
//! fits into the box around the coordinates: a tiled texture overlaps itself. Panels may lie over one another, each drawn from its own
//! origin, if s is a unit, each fits into its own box, and they have `MIN_PANEL` triangles in the mean.
//!
//! Limits: a garment modelled as a cylinder and unrolled counts as a pattern, which it is.

use glam::DVec2;

use super::{Topology, TriMesh, Unit};

/// Largest deviation of σ/s from 1 in undraped cloth. A heuristic.
const SCALE_TOLERANCE: f64 = 0.03;
/// Least share of the area within the tolerance: a garment has up to a third along open seams and in stretched cloth.
const MIN_SHARE: f64 = 0.6;
/// Largest deviation of s from a unit that replaces it. A heuristic.
const UNIT_TOLERANCE: f64 = 0.03;

/// Least mean number of triangles of panels that lie over one another; the tiles of a texture have one or two. A heuristic.
const MIN_PANEL: usize = 16;

/// A flat pattern found in texture coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatPattern {
    /// Metres in one unit of the texture coordinates.
    pub metres_per_unit: f64,
    /// The unit of that length, if there is one.
    pub unit: Option<Unit>,
    /// Share of the pattern's area within the tolerance.
    pub share: f64,
}

impl FlatPattern {
    /// The pattern in the texture coordinates of a mesh; `None` if any triangle has none or they are no pattern.
    pub(crate) fn find(mesh: &TriMesh, texture: &[Option<[DVec2; 3]>]) -> Option<Self> {
        if texture.is_empty() {
            return None;
        }
        let mut found: Vec<(f64, f64, [f64; 2])> = Vec::with_capacity(mesh.triangles.len());
        let mut whole = 0.0;
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (t, corners) in texture.iter().enumerate().take(mesh.triangles.len()) {
            let [a, b, c] = (*corners)?;
            let [p, q, r] = mesh.corners(t);
            let flat = (b - a).perp_dot(c - a);
            // Weighted by area in the pattern, where triangles that bridge an open seam are small.
            let area = 0.5 * flat.abs();
            whole += area;
            (low, high) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
            if flat == 0.0 {
                continue;
            }
            // Columns of F from the edges, and the eigenvalues of FᵀF by their sum and product.
            let u = ((q - p) * (c - a).y - (r - p) * (b - a).y) / flat;
            let v = ((r - p) * (b - a).x - (q - p) * (c - a).x) / flat;
            let (half, product) = (0.5 * (u.length_squared() + v.length_squared()), u.cross(v).length());
            let apart = (half * half - product * product).max(0.0).sqrt();
            let sigma = [(half + apart).sqrt(), (half - apart).max(0.0).sqrt()];
            if product.is_finite() && product > 0.0 {
                found.push((product.sqrt(), area, sigma));
            }
        }
        let overlaps = whole > (1.0 + SCALE_TOLERANCE) * (high - low).element_product();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half: f64 = 0.5 * found.iter().map(|f| f.1).sum::<f64>();
        let mut below = 0.0;
        let median = found.iter().find(|f| {
            below += f.1;
            below >= half
        })?;
        let units = [Unit::M, Unit::Dm, Unit::Cm, Unit::Mm, Unit::In];
        let unit = units.into_iter().find(|unit| (median.0 / unit.metres() - 1.0).abs() < UNIT_TOLERANCE);
        if overlaps && (unit.is_none() || whole > (1.0 + SCALE_TOLERANCE) * room_of_panels(texture, &mesh.triangles)?) {
            return None;
        }
        let scale = unit.map_or(median.0, Unit::metres);
        let near = |f: &&(f64, f64, [f64; 2])| f.2.iter().all(|sigma| (sigma / scale - 1.0).abs() < SCALE_TOLERANCE);
        let share = found.iter().filter(near).map(|f| f.1).sum::<f64>() / whole;
        (share >= MIN_SHARE).then_some(Self { metres_per_unit: scale, unit, share })
    }
}

/// Total area of the boxes around the panels: triangles joined by corners of one vertex at one place. `None` if the panels are small.
fn room_of_panels(texture: &[Option<[DVec2; 3]>], triangles: &[[u32; 3]]) -> Option<f64> {
    let corner = |(vertex, place): (u32, DVec2)| (vertex, place.to_array().map(f64::to_bits), place);
    let corners: Vec<_> = (texture.iter().flatten().zip(triangles))
        .flat_map(|(places, vertices)| std::array::from_fn::<_, 3, _>(|k| corner((vertices[k], places[k]))))
        .collect();
    let key = |i: &u32| (corners[*i as usize].0, corners[*i as usize].1);
    let mut order: Vec<u32> = (0..corners.len() as u32).collect();
    order.sort_unstable_by_key(key);
    let mut node = vec![0; corners.len()];
    let mut nodes = 0;
    for same in order.chunk_by(|a, b| key(a) == key(b)) {
        same.iter().for_each(|&i| node[i as usize] = nodes);
        nodes += 1;
    }
    let (panel, panels) = Topology::of(node.as_chunks().0, nodes as usize).components();
    if corners.len() < 3 * MIN_PANEL * panels {
        return None;
    }
    let mut boxes = vec![(DVec2::INFINITY, DVec2::NEG_INFINITY); panels];
    for (node, (.., place)) in node.iter().zip(&corners) {
        let (low, high) = &mut boxes[panel[*node as usize] as usize];
        (*low, *high) = (low.min(*place), high.max(*place));
    }
    Some(boxes.iter().map(|(low, high)| (*high - *low).element_product()).sum())
}

impl std::fmt::Display for FlatPattern {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let unit = match self.unit {
            Some(unit) => format!("in {unit}"),
            None => format!("at {:.4} m a unit", self.metres_per_unit),
        };
        write!(
            f,
            "its texture coordinates are the flat pattern it was cut by, {unit}: {:.0} % of it lies so; rest shape taken from them \
             (--rest own takes the edges as they are)",
            100.0 * self.share
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;
    use glam::DVec3;

    /// A grid of 10 × 10 squares rolled up to a quarter of a cylinder, its flat corners, and those stretched by `stretch` along x.
    fn rolled(scale: f64, stretch: f64) -> (TriMesh, Vec<Option<[DVec2; 3]>>) {
        let flat = |i: f64, j: f64| DVec2::new(i, j) * 0.03;
        let mesh = sheet(10, 10, |i, j| {
            let p = flat(i, j);
            DVec3::new(0.2 * (p.x / 0.2).sin(), p.y, 0.2 * (p.x / 0.2).cos())
        });
        let of = |v: u32| flat(f64::from(v % 11), f64::from(v / 11)) * DVec2::new(stretch, 1.0) / scale;
        let texture = mesh.triangles.iter().map(|t| Some(t.map(of))).collect();
        (mesh, texture)
    }

    #[test]
    fn a_pattern_is_found_in_any_unit_and_an_atlas_is_none() {
        for (scale, unit) in [(1.0, Some(Unit::M)), (0.01, Some(Unit::Cm)), (0.001, Some(Unit::Mm)), (0.73, None)] {
            let (mesh, texture) = rolled(scale, 1.0);
            let found = FlatPattern::find(&mesh, &texture).unwrap();
            assert_eq!(found.unit, unit);
            assert!((found.metres_per_unit / scale - 1.0).abs() < 0.01 && found.share > 0.99, "{found:?}");
        }
        let (mesh, texture) = rolled(1.0, 1.2);
        assert_eq!(FlatPattern::find(&mesh, &texture), None);
        let (mesh, mut texture) = rolled(1.0, 1.0);
        texture[3] = None;
        assert_eq!(FlatPattern::find(&mesh, &texture), None);
        assert_eq!(FlatPattern::find(&TriMesh::default(), &[]), None);
        // One square for every cell.
        let (mesh, texture) = rolled(1.0, 1.0);
        let tiled = |corners: &Option<[DVec2; 3]>| {
            corners.map(|c| {
                let cell = (c[0].min(c[1]).min(c[2]) / 0.03).round();
                c.map(|p| p / 0.03 - cell)
            })
        };
        assert_eq!(FlatPattern::find(&mesh, &texture.iter().map(tiled).collect::<Vec<_>>()), None);
    }

    #[test]
    fn panels_that_lie_over_one_another_are_a_pattern_and_tiles_are_none() {
        // Two panels of the quarter cylinder, sewn along the column in the middle, each drawn from its own origin in centimetres.
        let (mesh, texture) = rolled(0.01, 1.0);
        let second = |corners: &[DVec2; 3]| corners.iter().all(|p| p.x > 14.9);
        let shifted = |corners: &[DVec2; 3]| corners.map(|p| p - DVec2::X * if second(corners) { 15.0 } else { 0.0 });
        let over: Vec<_> = texture.iter().flatten().map(|corners| Some(shifted(corners))).collect();
        let found = FlatPattern::find(&mesh, &over).unwrap();
        assert_eq!(found.unit, Some(Unit::Cm));
        assert!(found.share > 0.99, "{found:?}");
        // In no unit, panels over one another are not distinguishable from an atlas.
        let odd = |corners: &Option<[DVec2; 3]>| corners.map(|corners| corners.map(|p| 1.37 * p));
        assert_eq!(FlatPattern::find(&mesh, &over.iter().map(odd).collect::<Vec<_>>()), None);
        // Each triangle as a separate tile, in centimetres.
        let tile = |corners: &Option<[DVec2; 3]>| corners.map(|c| c.map(|p| p - c[0].min(c[1]).min(c[2])));
        assert_eq!(FlatPattern::find(&mesh, &texture.iter().map(tile).collect::<Vec<_>>()), None);
    }

    #[test]
    fn open_seams_do_not_hide_the_pattern() {
        let (mut mesh, texture) = rolled(0.01, 1.0);
        mesh.positions[..22].iter_mut().for_each(|p| p.z += 0.3);
        let found = FlatPattern::find(&mesh, &texture).unwrap();
        assert_eq!(found.unit, Some(Unit::Cm));
        assert!(found.share < 0.95);
    }
}
