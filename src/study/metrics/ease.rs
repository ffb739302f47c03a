//! Ease: difference of the girths of garment and body at bust, waist, hip and hem.
//!
//! A level plane cuts the draped garment at the height of the body's bust, waist and hip (from its measurements, else from
//! [`Landmarks`]). The shortest closed curve around the trunk is measured in the triangles' rest shapes: the length of the cloth as cut,
//! independent of folds and stretch.
//!
//! ease = ∮ cloth at rest − tape girth of the body.
//!
//! With negative ease the cloth must stretch. If the curve encloses an arm, as at the bust of a pullover whose sleeves join lower, the
//! plane is lowered until the curve encloses the trunk alone. A garment that is open at the bust, as a low neckline is, or that begins a
//! little below the waist, as a skirt on the hips does, all around or in front alone, is measured at the highest plane below at which it
//! is closed, against the body at that height. The hem is the lowest edge that runs around the trunk; its length as cut is compared with a
//! tape around all of the body inside it, both legs for a skirt. Limits: the body's landmarks must be found; a garment that ends at the
//! height on one side, or encloses the arms as a cape does, has no girth; of layered garments only the innermost is measured.

use std::collections::BTreeSet;

use glam::DVec2;
use serde::Serialize;

use crate::body::girth::{Cut, Plane, SectionLoop, cuts, hull_length, section};
use crate::garment::sewing::Landmarks;
use crate::mesh::TriMesh;
use crate::scene::Scene;

/// Body and garment at one height.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct GirthEase {
    /// `bust`, `waist`, `hip` or `hem`.
    pub at: &'static str,
    /// Height above the body's lowest point, cm; below bust or waist if the garment is open or begins lower.
    pub height_cm: f64,
    /// Tape girth of the body, cm.
    pub body_cm: f64,
    /// Girth of the garment as cut, cm; `None` if it does not enclose the trunk, or encloses an arm too.
    pub garment_cm: Option<f64>,
    /// Height of that girth, cm; below `height_cm` if the sleeves join lower.
    pub garment_height_cm: Option<f64>,
    /// `garment_cm` − `body_cm`, cm.
    pub ease_cm: Option<f64>,
}

impl GirthEase {
    /// Ease at bust, waist, hip and hem of a scene draped to `positions` (m), at the heights of its measurements or else at the body's
    /// landmarks.
    pub(crate) fn all(scene: &Scene, positions: &[glam::DVec3]) -> Vec<Self> {
        let body = scene.body.mesh();
        let Some((low, _)) = body.bounds() else { return Vec::new() };
        let marks = Landmarks::of(body);
        let heights = scene.girths_at_m.map_or([marks.bust_z, marks.waist_z, marks.hip_z], |all| all.map(Some));
        let garment = scene.garment.with_positions(positions.to_vec());
        let at = |(at, z): (&'static str, Option<f64>)| {
            let marked = z?;
            let begins = !cuts(&garment, Plane::horizontal(marked)).is_empty();
            let steps = match at {
                "bust" if begins => BUST_STEPS,
                "waist" => WAIST_STEPS,
                _ => 0,
            };
            // Sleeves are passed with the body at the mark itself, which the garment covers; an opening is not covered.
            let mut of_mark = marked;
            let girth = (0..=steps).find_map(|step| {
                let z = marked - LOWER_M * f64::from(step);
                match girth(scene, &garment, (z, marks.middle), &section(body, Plane::horizontal(z))) {
                    Girth::WithArm => None,
                    Girth::None => {
                        // Open at a sleeve's end alone, the garment still covers the trunk.
                        if !covers_the_trunk(&garment, z, &marks) {
                            of_mark = z - LOWER_M;
                        }
                        None
                    }
                    Girth::Trunk(cm) => Some((cm, z)),
                }
            });
            let of_mark = if girth.is_some() { of_mark } else { marked };
            let trunk = trunk_girth(&section(body, Plane::horizontal(of_mark)), marks.middle)?;
            let (garment_cm, garment_height_cm) = (girth.map(|(cm, _)| cm), girth.map(|(_, z)| 100.0 * (z - low.z)));
            let body_cm = 100.0 * trunk;
            let ease_cm = garment_cm.map(|cm| cm - body_cm);
            Some(Self { at, height_cm: 100.0 * (of_mark - low.z), body_cm, garment_cm, garment_height_cm, ease_cm })
        };
        let girths = ["bust", "waist", "hip"].into_iter().zip(heights).filter_map(at);
        girths.chain(Self::at_hem(scene, &garment, low.z, &marks)).collect()
    }

    /// The ease at the lowest edge around the trunk; `low_z` is the lowest point of the body (m).
    fn at_hem(scene: &Scene, garment: &TriMesh, low_z: f64, marks: &Landmarks) -> Option<Self> {
        let at = |v: &u32| garment.positions[*v as usize];
        let around = |edge: &Vec<u32>| {
            let on: Vec<DVec2> = edge.iter().map(|v| at(v).truncate()).collect();
            encloses(&on, marks.middle).then(|| (edge.iter().map(|v| at(v).z).sum::<f64>() / edge.len() as f64, on))
        };
        // Of several layers, the innermost.
        let own = &scene.layers.first()?.vertices;
        let edges = scene.topology.boundary_loops().into_iter().filter(|edge| own.contains(&(edge[0] as usize)));
        let all = edges.filter_map(|edge| around(&edge).map(|(z, on)| (z, on, edge)));
        let (z, on, edge) = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let sides: BTreeSet<[u32; 2]> =
            edge.iter().zip(edge.iter().cycle().skip(1)).map(|(&a, &b)| sorted(a, b)).collect();
        let mut as_cut = 0.0;
        for (triangle, rest) in scene.garment.triangles.iter().zip(&scene.rest.corners) {
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                if sides.contains(&sorted(triangle[i], triangle[j])) {
                    as_cut += rest[i].distance(rest[j]);
                }
            }
        }
        let within = |curve: &SectionLoop| curve.closed && encloses(&on, curve.centre().truncate());
        let curves = section(scene.body.mesh(), Plane::horizontal(z));
        let body: Vec<DVec2> =
            curves.iter().filter(|c| within(c)).flat_map(|c| c.points.iter().map(|p| p.truncate())).collect();
        if body.is_empty() {
            return None;
        }
        let (height_cm, body_cm, garment_cm) = (100.0 * (z - low_z), 100.0 * hull_length(body), 100.0 * as_cut);
        let ease_cm = Some(garment_cm - body_cm);
        let (garment_cm, garment_height_cm) = (Some(garment_cm), Some(height_cm));
        Some(Self { at: "hem", height_cm, body_cm, garment_cm, garment_height_cm, ease_cm })
    }
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Distance by which a plane is lowered, m.
const LOWER_M: f64 = 0.01;
/// Tries at the bust: 18 cm reach the armholes of a T-shirt with dropped shoulders, just above the waist.
const BUST_STEPS: u32 = 18;
/// Tries at the waist: a waistband farther down is no longer near the waist.
const WAIST_STEPS: u32 = 8;

/// Result of a search for the garment's girth.
enum Girth {
    /// No closed curve encloses the trunk.
    None,
    /// The curve encloses an arm too.
    WithArm,
    /// The girth around the trunk as cut, cm.
    Trunk(f64),
}

/// The girth of a draped garment around the `middle` of the body at height `z` (m); `of_body` are the body's curves at that height.
fn girth(scene: &Scene, garment: &TriMesh, (z, middle): (f64, DVec2), of_body: &[SectionLoop]) -> Girth {
    let draped = cuts(garment, Plane::horizontal(z));
    let x = &garment.positions;
    let point = |&([a, b], share): &([u32; 2], f64)| x[a as usize].lerp(x[b as usize], share).truncate();
    let round = draped.iter().filter(|cut| cut.closed).filter_map(|cut| {
        let on: Vec<DVec2> = cut.crossings.iter().map(point).collect();
        encloses(&on, middle).then(|| (on, 100.0 * at_rest(scene, cut)))
    });
    let shortest = round.filter(|(_, cm)| cm.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((on, cm)) = shortest else { return Girth::None };
    let arm = |curve: &&SectionLoop| {
        let flat: Vec<DVec2> = curve.points.iter().map(|p| p.truncate()).collect();
        let inside = flat.iter().filter(|p| encloses(&on, **p)).count();
        curve.closed && !encloses(&flat, middle) && 2 * inside > flat.len()
    };
    if of_body.iter().any(|curve| arm(&curve)) { Girth::WithArm } else { Girth::Trunk(cm) }
}

/// Whether a garment covers the middle of the trunk at height `z` (m) both in front and behind.
fn covers_the_trunk(garment: &TriMesh, z: f64, marks: &Landmarks) -> bool {
    let (sin, cos) = marks.facing.sin_cos();
    // −y, turned to where the body faces.
    let front = DVec2::new(sin, -cos);
    let cuts = cuts(garment, Plane::horizontal(z));
    let points = cuts.iter().flat_map(|cut| &cut.crossings).map(|&([a, b], share)| {
        let [a, b] = [a, b].map(|v| garment.positions[v as usize]);
        a.lerp(b, share).truncate() - marks.middle
    });
    let on_the_middle = points.filter(|p| p.perp_dot(front).abs() < MIDDLE_M);
    let sides = on_the_middle.fold([false; 2], |[ahead, behind], p| {
        let along = p.dot(front);
        [ahead || along > 0.0, behind || along < 0.0]
    });
    sides == [true; 2]
}

/// Distance from the middle of the trunk at which a curve counts as passing it, m: more than an edge of a mesh, less than a neckline.
const MIDDLE_M: f64 = 0.03;

/// Tape length of the largest closed curve around the middle, m.
fn trunk_girth(curves: &[SectionLoop], middle: DVec2) -> Option<f64> {
    let round = |c: &&SectionLoop| {
        let on: Vec<DVec2> = c.points.iter().map(|p| p.truncate()).collect();
        c.closed && encloses(&on, middle)
    };
    curves.iter().filter(round).map(SectionLoop::tape_length).max_by(f64::total_cmp)
}

/// Whether a closed curve encloses a point: an odd number of its sides cross the ray to the right.
fn encloses(on: &[DVec2], point: DVec2) -> bool {
    let sides = on.iter().zip(on.iter().cycle().skip(1));
    let right = |(a, b): &(&DVec2, &DVec2)| {
        (a.y > point.y) != (b.y > point.y) && a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x) > point.x
    };
    sides.filter(right).count() % 2 == 1
}

/// Length of a cut in the rest shapes of its triangles, m.
fn at_rest(scene: &Scene, cut: &Cut) -> f64 {
    let ends = cut.crossings.iter().zip(cut.crossings.iter().cycle().skip(1));
    let lengths = cut.triangles.iter().zip(ends).map(|(&t, (from, to))| {
        let (triangle, corners) = (scene.garment.triangles[t as usize], scene.rest.corners[t as usize]);
        let corner = |v: u32| corners[triangle.iter().position(|&w| w == v).unwrap_or_default()];
        let place = |&([a, b], share): &([u32; 2], f64)| corner(a).lerp(corner(b), share);
        place(from).distance(place(to))
    });
    lengths.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::BodySpec;
    use crate::body::dress_form;

    #[test]
    fn a_tube_cut_wider_than_it_is_worn_has_the_ease_it_was_cut_with() {
        let spec = BodySpec::default();
        let form = dress_form(&spec).unwrap();
        let (n, rows) = (64_u32, 40_u32);
        let mut tube = TriMesh::default();
        for j in 0..rows {
            tube.positions.extend((0..n).map(|i| {
                let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
                glam::DVec3::new(0.24 * c, 0.24 * s, 1.15 - 0.35 * f64::from(j) / f64::from(rows - 1))
            }));
        }
        for (j, i) in (0..rows - 1).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let [a, b] = [j * n + i, j * n + (i + 1) % n];
            tube.triangles.extend([[a, a + n, b], [b, a + n, b + n]]);
        }
        let mut scene = Scene::of_meshes(&form, tube).unwrap();
        let placed = scene.garment.positions.clone();
        for p in scene.rest.corners.iter_mut().flatten() {
            p.x *= 0.7;
        }
        let measures = spec.measures().unwrap();
        let heights = [measures.bust_height, measures.waist_height, measures.hip_height];
        scene.girths_at_m = Some(heights);
        let found = GirthEase::all(&scene, &placed);
        let girth = 0.7 * 2.0 * f64::from(n) * 24.0 * (std::f64::consts::PI / f64::from(n)).sin();
        let named: Vec<&str> = found.iter().map(|e| e.at).collect();
        assert_eq!(named, ["bust", "waist", "hip", "hem"]);
        // The tube ends above the crotch: its hem goes around the trunk there.
        let hem = &found[3];
        assert!(
            (hem.height_cm - 80.0).abs() < 0.1 && (hem.garment_cm.unwrap() - girth).abs() < 0.05,
            "{hem:?}, {girth}"
        );
        for (ease, body_cm) in found.iter().zip([spec.bust_cm, spec.waist_cm, spec.hip_cm]) {
            assert!((ease.body_cm - body_cm).abs() < 0.5, "{ease:?}");
        }
        // Without given heights the landmarks of the body are used.
        scene.girths_at_m = None;
        for (ease, found) in found.iter().zip(GirthEase::all(&scene, &placed)) {
            assert!((ease.height_cm - found.height_cm).abs() < 8.0, "{ease:?}, {found:?}");
            assert!((ease.body_cm - found.body_cm).abs() < 5.0, "{ease:?}, {found:?}");
        }
        // A pullover whose sleeves join below the bust is measured below them, not round the arms.
        let pullover = crate::SceneSpec::new("form", "pullover-1@1500").load().unwrap().scene;
        let cut = crate::garment::GarmentSpec::by_name("pullover-1").unwrap().ease;
        let worn = GirthEase::all(&pullover, &pullover.garment.positions);
        let lower: Vec<bool> = worn[..3].iter().map(|e| e.garment_height_cm.unwrap() < e.height_cm - 0.5).collect();
        assert_eq!(lower, [true, false, false]);
        for (ease, cut) in worn.iter().zip([cut.bust_cm, cut.waist_cm, cut.hip_cm]) {
            assert!((ease.ease_cm.unwrap() - cut).abs() < 8.0, "{ease:?}, {cut} cm as cut");
        }
        // The tube begins under the bust.
        assert_eq!(found[0].garment_cm, None);
        for ease in &found[1..3] {
            assert!((ease.garment_cm.unwrap() - girth).abs() < 0.05, "{ease:?}, {girth}");
            assert!((ease.ease_cm.unwrap() - (ease.garment_cm.unwrap() - ease.body_cm)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_low_neckline_and_a_skirt_below_the_waist_have_an_ease_against_the_body_there() {
        let measures = BodySpec::default().measures().unwrap();
        let worn = |name: &str, lowered_m: f64| {
            let scene = crate::SceneSpec::new("form", name).load().unwrap().scene;
            let placed = scene.garment.positions.iter().map(|p| *p - lowered_m * glam::DVec3::Z).collect::<Vec<_>>();
            GirthEase::all(&scene, &placed)
        };
        // The neckline sinks below the bust, as it does in the drape.
        let dress = worn("low-cut-dress@1500", 0.04);
        let (bust, cut) = (&dress[0], crate::garment::GarmentSpec::by_name("low-cut-dress").unwrap().ease);
        assert!(bust.height_cm < 100.0 * measures.bust_height - 1.0, "{bust:?}");
        assert!((bust.ease_cm.unwrap() - cut.bust_cm).abs() < 15.0, "{bust:?}");
        // Above its lowest point a neckline leaves the front of the trunk bare.
        let scene = crate::SceneSpec::new("form", "low-cut-dress@1500").load().unwrap().scene;
        let marks = Landmarks::of(scene.body.mesh());
        for (height_m, covered) in [(measures.bust_height + 0.04, false), (measures.waist_height, true)] {
            assert_eq!(covers_the_trunk(&scene.garment, height_m, &marks), covered, "{height_m}");
        }
        let skirt = worn("flared-skirt@900", 0.03);
        assert_eq!(skirt[0].garment_cm, None, "a skirt has no bust");
        let waist = &skirt[1];
        let below_cm = 100.0 * measures.waist_height - waist.height_cm;
        assert!((2.0..5.0).contains(&below_cm) && waist.garment_cm.is_some(), "{waist:?}");
        // Behind, its edge is above the waist; in front, below it.
        let scene = crate::SceneSpec::new("form", "flared-skirt@900").load().unwrap().scene;
        let lowered = |p: &glam::DVec3| *p - (0.015 - 0.35 * p.y) * glam::DVec3::Z;
        let slanted: Vec<_> = scene.garment.positions.iter().map(lowered).collect();
        let waist = &GirthEase::all(&scene, &slanted)[1];
        let below_cm = 100.0 * measures.waist_height - waist.height_cm;
        assert!((2.0..8.0).contains(&below_cm) && waist.garment_cm.is_some(), "{waist:?}");
        assert_eq!(worn("flared-skirt@900", 0.15)[1].garment_cm, None, "15 cm below, that is no waist");
    }
}
