//! Triangles that bridge open seams, and their rest shape.
//!
//! A garment sewn before it is put on, as GarmentCode exports it, has one vertex for both sides of a seam, half-way between
//! panels that float around the body. The triangles along its seams are many times as long as all others, and their shape
//! is not that of the cloth. All others keep theirs, since a panel is as flat as it was cut. Sides of a bridging triangle
//! longer than twice the median are shortened to the median, so that the seam is closed at rest.
//!
//! Limits: a strip one triangle wide along the seams is accurate to a few millimetres, and its grain is unknown. Panels less
//! than two sides apart keep that much excess cloth in the seam. The shape is a guess, so these triangles are left out of the
//! strains that results report.

use glam::DVec2;

use super::{RestShape, TriMesh, sides};
use crate::base::quantiles::nearest_rank;

/// A mesh has bridges if its longest side exceeds the median this many times. A heuristic: no remesher leaves such sides.
const BRIDGE_RATIO: f64 = 5.0;
/// And if it exceeds this, m. A heuristic.
const BRIDGE_LENGTH: f64 = 0.1;

/// Largest share of long triangles. Seams are lines; a larger share comes from the meshing (one polygon of thousands of corners, a
/// mesh with fine details only). GarmentCode's T-shirt of 7,166 vertices has 7 %.
const MAX_LONG_SHARE: f64 = 1.0 / 3.0;

/// In a mesh with bridges, sides longer than this many times the median are shortened. A heuristic.
const LONG_RATIO: f64 = 2.0;

/// Least ratio of a shortened side to the base of its triangle, which keeps the triangle from collapsing.
const MIN_LEG_RATIO: f64 = 0.75;

/// The triangles that bridge a garment's open seams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bridges {
    /// Number of triangles.
    pub triangles: usize,
    /// Longest of their sides, m.
    pub longest_m: f64,
    /// Median length of all sides, m.
    pub usual_m: f64,
}

impl Bridges {
    /// The bridges of `mesh`; `None` if it has none.
    pub(crate) fn of(mesh: &TriMesh) -> Option<Self> {
        let all: Vec<[f64; 3]> = (0..mesh.triangles.len()).map(|t| sides(mesh.corners(t))).collect();
        let usual_m = nearest_rank(all.as_flattened(), 0.5);
        let longest_m = all.as_flattened().iter().copied().fold(0.0, f64::max);
        let triangles = all.iter().filter(|sides| sides.iter().any(|s| *s > LONG_RATIO * usual_m)).count();
        let few = triangles as f64 <= MAX_LONG_SHARE * all.len() as f64;
        (few && longest_m > BRIDGE_LENGTH.max(BRIDGE_RATIO * usual_m)).then_some(Self { triangles, longest_m, usual_m })
    }

    /// Replaces the shape of the bridging triangles in `rest`, the rest shape from the mesh's own edges, and marks it as guessed.
    pub(crate) fn shut(self, rest: &mut RestShape) {
        rest.guessed = vec![false; rest.corners.len()];
        for (corners, guessed) in rest.corners.iter_mut().zip(&mut rest.guessed) {
            let own = sides(corners.map(|p| p.extend(0.0)));
            let long = own.map(|s| s > LONG_RATIO * self.usual_m);
            if let Some(shaped) = long.contains(&true).then(|| self.shaped(own, long)).flatten() {
                *corners = turned_like(*corners, shaped, long);
                *guessed = true;
            }
        }
    }

    /// Side lengths with the long ones shortened; `None` if they form no triangle.
    fn shaped(self, own: [f64; 3], long: [bool; 3]) -> Option<[f64; 3]> {
        let base = own.iter().zip(long).filter(|(_, long)| !long).map(|(s, _)| *s).fold(0.0, f64::max);
        let leg = self.usual_m.max(MIN_LEG_RATIO * base);
        let to: [f64; 3] = std::array::from_fn(|k| if long[k] { leg } else { own[k] });
        let longest = to.iter().copied().fold(0.0, f64::max);
        (to.iter().sum::<f64>() > 2.0 * longest * 1.02).then_some(to)
    }
}

/// A triangle of these side lengths, with the direction of `was` along its first side that is not long, or else along its first.
fn turned_like(was: [DVec2; 3], lengths: [f64; 3], long: [bool; 3]) -> [DVec2; 3] {
    // Side k lies opposite corner k.
    let k = (0..3).find(|&k| !long[k]).unwrap_or(0);
    let (base, left, right) = (lengths[k], lengths[(k + 2) % 3], lengths[(k + 1) % 3]);
    let [from, to] = [was[(k + 1) % 3], was[(k + 2) % 3]];
    let along = (to - from).normalize_or(DVec2::X);
    // The corner over the base: `left` from its start, `right` from its end.
    let s = (base * base + left * left - right * right) / (2.0 * base);
    let h = (left * left - s * s).max(0.0).sqrt();
    let mut out = [DVec2::ZERO; 3];
    out[(k + 1) % 3] = from;
    out[(k + 2) % 3] = from + along * base;
    out[k] = from + along * s + along.perp() * h;
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::longest_side;
    use crate::mesh::samples::sheet;
    use glam::DVec3;

    /// Two squares of 10 cm a foot apart, in sides of a centimetre, joined along one edge by a row of vertices half-way.
    fn bridged() -> TriMesh {
        // Ten rows up, ten down.
        sheet(10, 20, |i, row| {
            DVec3::new(i, 15.0 * (1.0 + (row - 10.0).clamp(-1.0, 1.0)), 10.0 - (row - 10.0).abs()) * 0.01
        })
    }

    #[test]
    fn a_bridged_seam_is_closed_at_rest_and_the_rest_unchanged() {
        let mesh = bridged();
        let found = Bridges::of(&mesh).unwrap();
        assert_eq!(found.triangles, 40, "{found:?}");
        let own = RestShape::edges_of(&mesh);
        let mut rest = own.clone();
        found.shut(&mut rest);
        let area: f64 = rest.areas().iter().sum();
        // Two squares of 10 by 9 cm and two rows of nearly a centimetre.
        assert!((area - 0.02).abs() < 0.0008, "{area} m²");
        for (t, (own, now)) in own.corners.iter().zip(&rest.corners).enumerate() {
            let longest = longest_side(now.map(|p| p.extend(0.0)));
            assert!(longest < 0.016, "triangle {t}: {longest} m");
            let bridges = sides(own.map(|p| p.extend(0.0))).into_iter().any(|s| s > 0.1);
            assert_eq!(own == now, !bridges, "triangle {t}");
            assert_eq!(rest.is_guessed(t), bridges, "triangle {t}");
            let [a, b, c] = *now;
            assert!((b - a).perp_dot(c - a) > 0.0, "triangle {t} is turned over");
        }
    }

    #[test]
    fn a_mesh_of_even_triangles_or_of_long_ones_throughout_has_no_bridges() {
        let mut mesh = bridged();
        for p in &mut mesh.positions {
            p.y *= 0.05;
        }
        assert_eq!(Bridges::of(&mesh), None);
        // A disc that is one polygon, cut into triangles between its corners: all of them long.
        let corner = |i: u32| {
            let (y, x) = (std::f64::consts::TAU * f64::from(i) / 500.0).sin_cos();
            DVec3::new(0.3 * x, 0.3 * y, 0.0)
        };
        let fan = (1..499).map(|i| [0, i, i + 1]).collect();
        assert_eq!(Bridges::of(&TriMesh::new((0..500).map(corner).collect(), fan)), None);
    }
}
