//! Ease: by how much a garment is wider than the body where a tailor measures both.
//!
//! At the height of the body's bust, waist and hip (those it is made by, else [`Landmarks`]) the draped garment is cut by a level plane. Of the closed curves round
//! the trunk the shortest is followed through the triangles' rest shapes, so that what is told is the cloth as it was cut, along the
//! line where it lies, whatever folds or stretches there:
//!
//! ease = ∮ cloth at rest − girth of the body by tape.
//!
//! Negative ease is cloth that has to stretch. Where the curve goes round the arms too, as a pullover's does at the bust if its sleeves join lower,
//! it is followed under the armholes, where a tailor measures the chest. Limits: for bodies whose landmarks are found; a garment that is open
//! there, ends there on one side, or goes round the arms as a cape does, has no girth; of garments over each other the innermost is told.

use glam::DVec2;
use serde::Serialize;

use crate::body::girth::{Cut, Plane, SectionLoop, cuts, section};
use crate::garment::sewing::Landmarks;
use crate::mesh::TriMesh;
use crate::scene::Scene;

/// Body and garment at one height.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GirthEase {
    /// `bust`, `waist` or `hip`.
    pub at: &'static str,
    /// Height above the body's lowest point, cm.
    pub height_cm: f64,
    /// Girth of the body, by tape, cm.
    pub body_cm: f64,
    /// Girth of the garment as it was cut, cm; `None` where it does not go round the body there, or round the arms too.
    pub garment_cm: Option<f64>,
    /// Height where that was measured, cm: lower than `height_cm` where the sleeves join lower.
    pub garment_height_cm: Option<f64>,
    /// The difference, cm.
    pub ease_cm: Option<f64>,
}

impl GirthEase {
    /// Bust, waist and hip of a scene draped to `positions` (m), from the top: at these heights (m), or where the body is found to have them.
    #[must_use]
    pub(crate) fn all(scene: &Scene, heights_m: Option<[f64; 3]>, positions: &[glam::DVec3]) -> Vec<Self> {
        let body = scene.body.mesh();
        let Some((low, _)) = body.bounds() else { return Vec::new() };
        let marks = Landmarks::of(body);
        let heights = heights_m.map_or([marks.bust_z, marks.waist_z, marks.hip_z], |all| all.map(Some));
        let garment = scene.garment.with_positions(positions.to_vec());
        let at = |(at, z): (&'static str, Option<f64>)| {
            let z = z?;
            let of_body = section(body, Plane::horizontal(z));
            let trunk = around(&of_body, marks.middle, SectionLoop::tape_length)?;
            let steps = if at == "bust" { LOWER_STEPS } else { 0 };
            let girth = (0..=steps).find_map(|step| {
                let z = z - LOWER_M * f64::from(step);
                let arms = if step == 0 { &of_body } else { &section(body, Plane::horizontal(z)) };
                match girth(scene, &garment, (z, marks.middle), arms) {
                    Girth::OfArmsToo => None,
                    Girth::None => Some(None),
                    Girth::Of(cm) => Some(Some((cm, z))),
                }
            });
            let girth = girth.flatten();
            let (garment_cm, garment_height_cm) = (girth.map(|(cm, _)| cm), girth.map(|(_, z)| 100.0 * (z - low.z)));
            let body_cm = 100.0 * trunk;
            let ease_cm = garment_cm.map(|cm| cm - body_cm);
            Some(Self { at, height_cm: 100.0 * (z - low.z), body_cm, garment_cm, garment_height_cm, ease_cm })
        };
        ["bust", "waist", "hip"].into_iter().zip(heights).filter_map(at).collect()
    }
}

/// Where sleeves join below the bust, the garment is looked at lower by so much, m, so many times.
const LOWER_M: f64 = 0.01;
const LOWER_STEPS: u32 = 12;

/// What a garment goes round.
enum Girth {
    None,
    /// The trunk and an arm.
    OfArmsToo,
    /// The trunk alone, as cut, cm.
    Of(f64),
}

/// The girth of a draped garment round the `middle` of a body at height `z` (m), given the body's own curves there.
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
    if of_body.iter().any(|curve| arm(&curve)) { Girth::OfArmsToo } else { Girth::Of(cm) }
}

/// The largest of the closed curves round the middle, measured.
fn around(curves: &[SectionLoop], middle: DVec2, length: impl Fn(&SectionLoop) -> f64) -> Option<f64> {
    let round = |c: &&SectionLoop| {
        let on: Vec<DVec2> = c.points.iter().map(|p| p.truncate()).collect();
        c.closed && encloses(&on, middle)
    };
    curves.iter().filter(round).map(length).max_by(f64::total_cmp)
}

/// Whether a closed curve goes round a point: an odd number of its sides cross the ray to the right.
fn encloses(on: &[DVec2], point: DVec2) -> bool {
    let sides = on.iter().zip(on.iter().cycle().skip(1));
    let right = |(a, b): &(&DVec2, &DVec2)| {
        (a.y > point.y) != (b.y > point.y) && a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x) > point.x
    };
    sides.filter(right).count() % 2 == 1
}

/// Length of a cut in the triangles as they were cut from the cloth, m.
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
        let found = GirthEase::all(&scene, Some(heights), &placed);
        let girth = 0.7 * 2.0 * f64::from(n) * 24.0 * (std::f64::consts::PI / f64::from(n)).sin();
        let named: Vec<&str> = found.iter().map(|e| e.at).collect();
        assert_eq!(named, ["bust", "waist", "hip"]);
        for (ease, body_cm) in found.iter().zip([spec.bust_cm, spec.waist_cm, spec.hip_cm]) {
            assert!((ease.body_cm - body_cm).abs() < 0.5, "{ease:?}");
        }
        // Somebody else's body is asked where it is widest and narrowest.
        for (ease, found) in found.iter().zip(GirthEase::all(&scene, None, &placed)) {
            assert!((ease.height_cm - found.height_cm).abs() < 8.0, "{ease:?}, {found:?}");
            assert!((ease.body_cm - found.body_cm).abs() < 5.0, "{ease:?}, {found:?}");
        }
        // A pullover whose sleeves join below the bust is measured below them, not round the arms.
        let pullover = crate::SceneSpec::new("form", "pullover-1@1500").load().unwrap().scene;
        let cut = crate::garment::GarmentSpec::by_name("pullover-1").unwrap().ease;
        let worn = GirthEase::all(&pullover, Some(heights), &pullover.garment.positions);
        let lower: Vec<bool> = worn.iter().map(|e| e.garment_height_cm.unwrap() < e.height_cm - 0.5).collect();
        assert_eq!(lower, [true, false, false]);
        for (ease, cut) in worn.iter().zip([cut.bust_cm, cut.waist_cm, cut.hip_cm]) {
            assert!((ease.ease_cm.unwrap() - cut).abs() < 8.0, "{ease:?}, {cut} cm as cut");
        }
        // The tube begins under the bust.
        assert_eq!(found[0].garment_cm, None);
        for ease in &found[1..] {
            assert!((ease.garment_cm.unwrap() - girth).abs() < 0.05, "{ease:?}, {girth}");
            assert!((ease.ease_cm.unwrap() - (ease.garment_cm.unwrap() - ease.body_cm)).abs() < 1e-12);
        }
    }
}
