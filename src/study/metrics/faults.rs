//! Faults of a drape: parts that slid down, openings that are stretched, triangles that bridge open seams.

use std::cell::LazyCell;
use std::collections::HashMap;

use glam::DVec3;

use crate::garment::sewing::Landmarks;
use crate::mesh::TriMesh;
use crate::mesh::bridges::Bridges;
use crate::scene::Scene;

/// A top edge that sinks farther than this has slid, mm. A neckline settles by 10 to 20 mm; a smaller limit would report it.
pub(super) const SANK_MM: f64 = 100.0;

/// Least height of the top of a hood's edge above the neck's end of the shoulders, m. A hood falls back without the garment sliding. A heuristic:
/// a stand-up collar is lower.
const HOOD_M: f64 = 0.1;

/// Least ratio of worn to cut length of a stretched opening. Heuristic; a smaller ratio names openings that are merely snug.
const STRETCHED: f64 = 1.1;

/// A stretched opening of a garment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TightestOpening {
    /// Length as cut, m.
    pub cut_m: f64,
    /// Length as worn, m.
    pub worn_m: f64,
    /// Mean height above the lowest point of the body, m.
    pub height_m: f64,
}

impl TightestOpening {
    /// The opening stretched most at `positions` (m); `None` if no opening is stretched by a tenth.
    pub(super) fn of(scene: &Scene, positions: &[DVec3]) -> Option<Self> {
        let mut cut = HashMap::new();
        for (corners, rest) in scene.garment.triangles.iter().zip(&scene.rest.corners) {
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                cut.insert([corners[i].min(corners[j]), corners[i].max(corners[j])], rest[i].distance(rest[j]));
            }
        }
        let (low, _) = scene.body.mesh().bounds()?;
        let measure = |opening: Vec<u32>| {
            let sides = || opening.iter().zip(opening.iter().cycle().skip(1));
            let at = |v: &u32| positions[*v as usize];
            Self {
                cut_m: sides().filter_map(|(a, b)| cut.get(&[*a.min(b), *a.max(b)])).sum(),
                worn_m: sides().map(|(a, b)| at(a).distance(at(b))).sum(),
                height_m: opening.iter().map(|v| at(v).z).sum::<f64>() / opening.len() as f64 - low.z,
            }
        };
        let all = scene.topology.boundary_loops().into_iter().map(measure);
        let stretched = all.filter(|o| o.worn_m > STRETCHED * o.cut_m && o.cut_m > 0.0);
        stretched.max_by(|a, b| (a.worn_m / a.cut_m).total_cmp(&(b.worn_m / b.cut_m)))
    }

    pub(super) fn text(self) -> String {
        let [cut, worn, height] = [self.cut_m, self.worn_m, self.height_m].map(|m| 1e2 * m);
        format!("; its opening at a height of {height:.0} cm, {cut:.1} cm as cut, is stretched to {worn:.1} cm")
    }
}

/// A warning about triangles that bridge open seams: contact acts at vertices, so the body passes between their corners.
pub(super) fn bridges(garment: &TriMesh) -> Option<String> {
    let Bridges { triangles, longest_m, usual_m } = Bridges::of(garment)?;
    Some(format!(
        "{triangles} of its triangles are up to {:.0} cm long, with a usual side of {:.1} cm: they may bridge open seams, and the body passes \
         between their corners; sew the pattern it was cut by (--pattern), or start with closed seams",
        1e2 * longest_m,
        1e2 * usual_m
    ))
}

/// A connected part of a garment without held vertices that slid down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlidPart {
    /// Number of the part, from 1, as in `--hold top:2`.
    pub part: usize,
    /// Descent since placement, mm: of its highest edge; without one of its highest tenth, with a hood of the cloth between armpits and neck.
    pub sank_mm: f64,
}

/// Whether these connected parts, numbered from 1, are placed with their highest edges above the bust: they hang from the shoulders, not
/// from the waist. None for a body without a bust.
pub(super) fn begins_above_the_bust(scene: &Scene, parts: &[usize]) -> Option<bool> {
    let bust_z = Landmarks::of(scene.body.mesh()).bust_z?;
    let tops = scene.tops();
    let edges = parts.iter().filter_map(|part| tops.get(part - 1)?.as_deref()).filter(|edge| !edge.is_empty());
    let mean_z =
        |edge: &[u32]| edge.iter().map(|&v| scene.garment.positions[v as usize].z).sum::<f64>() / edge.len() as f64;
    edges.map(mean_z).reduce(f64::max).map(|z| z > bust_z)
}

/// Descent of the highest edge of each connected part from its placement to `positions` (m), mm; without an edge of its highest
/// tenth, with a hood of the cloth between armpits and neck.
fn tops_sank_mm(scene: &Scene, positions: &[DVec3]) -> Vec<f64> {
    let placed = &scene.garment.positions;
    let (part_of, parts) = scene.topology.components();
    let mut of_part = vec![Vec::new(); parts];
    (0_u32..).zip(&part_of).for_each(|(v, &part)| of_part[part as usize].push(v));
    let height = |v: &u32| placed[*v as usize].z;
    let sank_mm = |of: &[u32]| {
        let sank = of.iter().map(|v| height(v) - positions[*v as usize].z).sum::<f64>();
        1e3 * sank / of.len().max(1) as f64
    };
    // Landmarks cut the body by more than a hundred planes, and most garments stay up.
    let landmarks = LazyCell::new(|| Landmarks::of(scene.body.mesh()));
    let sank = |(top, mut all): (Option<Vec<u32>>, Vec<u32>)| {
        let top = top.unwrap_or_else(|| {
            all.sort_by(|a, b| height(b).total_cmp(&height(a)));
            all[..all.len().div_ceil(10)].to_vec()
        });
        let of_top = sank_mm(&top);
        if of_top > SANK_MM
            && let Landmarks { armpit_z: Some(armpit), shoulder_z: Some(shoulder), .. } = *landmarks
            && top.iter().any(|v| height(v) > shoulder + HOOD_M)
        {
            all.retain(|v| (armpit..shoulder).contains(&height(v)));
            return sank_mm(&all);
        }
        of_top
    };
    scene.tops().into_iter().zip(of_part).map(sank).collect()
}

/// The largest descent of a connected part's top edge, mm, and the parts that slid, by falling descent. Parts that fell off the
/// body are omitted.
pub(super) fn sinking(scene: &Scene, positions: &[DVec3]) -> (f64, Vec<SlidPart>) {
    let tops = tops_sank_mm(scene, positions);
    let fallen = scene.fallen_parts(positions);
    let loose = scene.loose_parts().into_iter().filter(|part| !fallen.contains(part));
    let slid = loose.map(|part| SlidPart { part, sank_mm: tops[part - 1] });
    let mut slid: Vec<SlidPart> = slid.filter(|slid| slid.sank_mm > SANK_MM).collect();
    slid.sort_by(|a, b| b.sank_mm.total_cmp(&a.sank_mm));
    (tops.into_iter().fold(f64::NEG_INFINITY, f64::max), slid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hood_that_falls_back_has_not_slid() {
        let mut scene = crate::SceneSpec::new("form", "pullover-1@2000").load().unwrap().scene;
        let shoulder = Landmarks::of(scene.body.mesh()).shoulder_z.unwrap();
        let collar = scene.tops()[0].clone().unwrap();
        // Half of the neckline stands up as a hood, and lies on the back at rest.
        let draped = scene.garment.positions.clone();
        collar.iter().step_by(2).for_each(|&v| scene.garment.positions[v as usize].z = shoulder + 0.4);
        assert_eq!(sinking(&scene, &draped).1, []);
        let lower: Vec<DVec3> = draped.iter().map(|p| *p - DVec3::Z * 0.15).collect();
        assert!((sinking(&scene, &lower).1[0].sank_mm - 150.0).abs() < 1e-6);
    }

    #[test]
    fn a_garment_on_the_shoulders_is_told_from_one_at_the_waist() {
        for (name, on_shoulders) in [("low-cut-dress@900", true), ("flared-skirt@900", false)] {
            let scene = crate::SceneSpec::new("form", name).load().unwrap().scene;
            assert_eq!(begins_above_the_bust(&scene, &[1]), Some(on_shoulders), "{name}");
        }
    }
}
