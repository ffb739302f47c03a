//! Triangles that bridge open seams, and what they are at rest.
//!
//! A garment that was sewn before it was put on, as GarmentCode writes it, has one vertex for both sides of a seam, half-way between panels
//! that float about the body: the triangles along its seams are many times as long as all others and say nothing of the cloth. The others do,
//! for a panel is still as flat as it was cut. A bridging triangle is taken to be like its neighbours: sides that are longer than
//! twice what half of all sides are become as long as these, so that at rest the seam is shut.
//!
//! Limits: a strip one triangle wide along the seams is known to a few millimetres, and its grain not at all. Where panels begin less than two
//! sides apart the seam keeps that much cloth too many.

use glam::DVec2;

use super::import::Imported;
use super::report::Repair;
use super::{RestShape, TriMesh, sides};
use crate::base::quantiles::nearest_rank;

/// A mesh has bridges where a side is longer than so many times the usual, and than this, m: no remesher leaves such.
const BRIDGE: f64 = 5.0;
const BRIDGE_M: f64 = 0.1;

/// Seams are lines: where more than this share of all triangles are so long, they are how the mesh is drawn (one polygon of thousands
/// of corners, a mesh that is fine in its details alone), not bridges. GarmentCode's T-shirt of 7,166 vertices has 7 %.
const MOST_SHARE: f64 = 1.0 / 3.0;

/// Where it has, sides longer than so many times the usual are theirs.
const LONG: f64 = 2.0;

/// Least length of a leg over the base of a triangle that is given shape, so that it has some height.
const LEG: f64 = 0.75;

/// What bridges a garment's open seams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bridges {
    /// How many triangles.
    pub triangles: usize,
    /// Longest of their sides, m.
    pub longest_m: f64,
    /// What half of all sides are at most, m.
    pub usual_m: f64,
}

impl Imported {
    /// The mesh as it stands, at rest; with what bridges open seams `shut`, and told, if that is asked.
    pub(crate) fn own_rest(&mut self, shut: bool) -> RestShape {
        let mut rest = RestShape::edges_of(&self.mesh);
        if let Some(bridges) = Bridges::of(&self.mesh).filter(|_| shut) {
            bridges.shut(&mut rest);
            let Bridges { triangles, longest_m, usual_m } = bridges;
            self.report.repairs.push(Repair::BridgesShut { triangles, longest_m, usual_m });
        }
        rest
    }
}

impl Bridges {
    /// Those of `mesh`; `None` where it has none.
    #[must_use]
    pub(crate) fn of(mesh: &TriMesh) -> Option<Self> {
        let all: Vec<[f64; 3]> = (0..mesh.triangles.len()).map(|t| sides(mesh.corners(t))).collect();
        let usual_m = nearest_rank(all.as_flattened(), 0.5);
        let longest_m = all.as_flattened().iter().copied().fold(0.0, f64::max);
        let triangles = all.iter().filter(|sides| sides.iter().any(|s| *s > LONG * usual_m)).count();
        let few = triangles as f64 <= MOST_SHARE * all.len() as f64;
        (few && longest_m > BRIDGE_M.max(BRIDGE * usual_m)).then_some(Self { triangles, longest_m, usual_m })
    }

    /// Gives the triangles that bridge a shape at rest: `rest` is the mesh's own (m), and is changed there.
    pub(crate) fn shut(self, rest: &mut RestShape) {
        for corners in &mut rest.corners {
            let own = sides(corners.map(|p| p.extend(0.0)));
            let long = own.map(|s| s > LONG * self.usual_m);
            if let Some(shaped) = long.contains(&true).then(|| self.shaped(own, long)).flatten() {
                *corners = turned_like(*corners, shaped, long);
            }
        }
    }

    /// Sides of a triangle whose long ones are none.
    fn shaped(self, own: [f64; 3], long: [bool; 3]) -> Option<[f64; 3]> {
        let base = own.iter().zip(long).filter(|(_, long)| !long).map(|(s, _)| *s).fold(0.0, f64::max);
        let leg = self.usual_m.max(LEG * base);
        let to: [f64; 3] = std::array::from_fn(|k| if long[k] { leg } else { own[k] });
        let longest = to.iter().copied().fold(0.0, f64::max);
        (to.iter().sum::<f64>() > 2.0 * longest * 1.02).then_some(to)
    }
}

/// A triangle of these sides, turned as `was` is along a side that is not long, or else along its first.
fn turned_like(was: [DVec2; 3], [a, b, c]: [f64; 3], long: [bool; 3]) -> [DVec2; 3] {
    // Side k lies opposite corner k.
    let k = (0..3).find(|&k| !long[k]).unwrap_or(0);
    let lengths = [a, b, c];
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
    fn a_bridged_seam_is_shut_at_rest_and_all_else_as_it_was() {
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
            let [a, b, c] = *now;
            assert!((b - a).perp_dot(c - a) > 0.0, "triangle {t} is turned over");
        }
    }

    #[test]
    fn a_mesh_of_even_or_of_long_triangles_throughout_has_none() {
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
