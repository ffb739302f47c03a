//! What a user should act upon although the numbers alone would reassure, and with what.

use std::collections::HashMap;

use glam::DVec3;

use super::Metrics;
use crate::mechanics::fit::TORN_PERCENT;
use crate::mesh::TriMesh;
use crate::mesh::bridges::Bridges;
use crate::scene::Scene;

/// A top edge that sinks farther than this (mm) has not settled, it has slid: a neckline settles by one to two centimetres.
const SANK_MM: f64 = 100.0;

/// An opening that is longer by more than this is told where the cloth is stretched too far.
const STRETCHED: f64 = 1.1;

impl Metrics {
    /// What in these figures a user should act upon, in the terms of a garment with these held vertices and groups.
    #[must_use]
    pub(crate) fn warnings(&self, scene: &Scene) -> Vec<String> {
        let mut found = Vec::new();
        if let [Slid { sank_mm, .. }, more @ ..] = self.slid.as_slice() {
            let parts: Vec<usize> = self.slid.iter().map(|slid| slid.part).collect();
            let [have, edge, holds] = if more.is_empty() {
                ["has", "its highest edge sank by", "nothing holds it; if it has a waistband"]
            } else {
                ["have", "their highest edges sank by up to", "nothing holds them; if they have waistbands"]
            };
            found.push(format!(
                "{} {have} slid down: {edge} {:.0} cm, and {holds}, {}",
                scene.named(&parts),
                0.1 * sank_mm,
                scene.how_to_hold(&parts)
            ));
        }
        if let Some(bridges) = bridges(&scene.garment).filter(|_| self.top_sank_mm > SANK_MM) {
            found.push(bridges);
        }
        if self.body_crossing_pairs > 0 {
            found.push(format!(
                "skin shows through the cloth: {} pairs of triangles of garment and body cross{}; a preview, a few steps and \
                 --no-self-contact leave that, and at rest a place that is too tight: a finer garment mesh, or more cloth, mends it",
                self.body_crossing_pairs,
                if self.penetrating_vertices == 0 { ", though no vertex is inside" } else { "" }
            ));
        }
        if self.self_intersecting_pairs > 0 {
            found.push(format!(
                "cloth goes through cloth: {} pairs of triangles cross; a preview, a few steps, --no-self-contact and the reference methods \
                 leave that, and at rest layers that were placed through each other: place them apart (`partwise check` counts them as placed)",
                self.self_intersecting_pairs
            ));
        }
        if let Some(strain) = self.strain_max.filter(|strain| 1e2 * *strain > TORN_PERCENT) {
            found.push(format!(
                "the cloth is stretched by {:.0} % somewhere, more than fabrics bear: the garment is too small there, or caught{}",
                1e2 * strain,
                self.tightest_opening.map(TightestOpening::said).unwrap_or_default()
            ));
        }
        found
    }
}

/// An opening of a garment that is stretched to be where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TightestOpening {
    /// Its length as cut, m.
    pub cut_m: f64,
    /// Its length as worn, m.
    pub worn_m: f64,
    /// Where it is above the lowest point of the body, m.
    pub height_m: f64,
}

impl TightestOpening {
    /// The opening that is stretched most at `positions` (m); `None` where none is by over a tenth.
    pub(super) fn of(scene: &Scene, positions: &[DVec3]) -> Option<Self> {
        let mut cut = HashMap::new();
        for (corners, rest) in scene.garment.triangles.iter().zip(&scene.rest.corners) {
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                cut.insert([corners[i].min(corners[j]), corners[i].max(corners[j])], rest[i].distance(rest[j]));
            }
        }
        let (low, _) = scene.body.mesh().bounds()?;
        let around = |opening: Vec<u32>| {
            let sides = || opening.iter().zip(opening.iter().cycle().skip(1));
            let at = |v: &u32| positions[*v as usize];
            Self {
                cut_m: sides().filter_map(|(a, b)| cut.get(&[*a.min(b), *a.max(b)])).sum(),
                worn_m: sides().map(|(a, b)| at(a).distance(at(b))).sum(),
                height_m: opening.iter().map(|v| at(v).z).sum::<f64>() / opening.len() as f64 - low.z,
            }
        };
        let all = scene.topology.boundary_loops().into_iter().map(around);
        let stretched = all.filter(|o| o.worn_m > STRETCHED * o.cut_m && o.cut_m > 0.0);
        stretched.max_by(|a, b| (a.worn_m / a.cut_m).total_cmp(&(b.worn_m / b.cut_m)))
    }

    fn said(self) -> String {
        let [cut, worn, height] = [self.cut_m, self.worn_m, self.height_m].map(|m| 1e2 * m);
        format!("; its opening at a height of {height:.0} cm, {cut:.1} cm as cut, is stretched to {worn:.1} cm")
    }
}

/// What to do about triangles that bridge open seams, where there are such: contact is felt at vertices, and they have none in between.
fn bridges(garment: &TriMesh) -> Option<String> {
    let Bridges { triangles, longest_m, usual_m } = Bridges::of(garment)?;
    Some(format!(
        "{triangles} of its triangles are up to {:.0} cm long, where most sides are {:.1} cm: do they bridge open seams? The body passes \
         between their corners; sew the pattern it was cut by (--pattern), or begin with the seams closed",
        1e2 * longest_m,
        1e2 * usual_m
    ))
}

/// A connected part of a garment that slid although nothing of it is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slid {
    /// Its number, from 1, as `--hold top:2` counts them.
    pub part: usize,
    /// How far its highest edge is lower than as placed, or its highest tenth where it has no edge, mm.
    pub sank_mm: f64,
}

/// How far the highest edge of each connected part is lower at `positions` (m) than as placed, mm; of a part without edges its
/// highest tenth.
fn tops_sank_mm(scene: &Scene, positions: &[DVec3]) -> Vec<f64> {
    let placed = &scene.garment.positions;
    let (part_of, parts) = scene.topology.components();
    let mut of_part = vec![Vec::new(); parts];
    (0_u32..).zip(&part_of).for_each(|(v, &part)| of_part[part as usize].push(v));
    let sank = |(top, mut all): (Option<Vec<u32>>, Vec<u32>)| {
        let top = top.unwrap_or_else(|| {
            all.sort_by(|&a, &b| placed[b as usize].z.total_cmp(&placed[a as usize].z));
            all.truncate(all.len().div_ceil(10));
            all
        });
        let sank = top.iter().map(|&v| placed[v as usize].z - positions[v as usize].z).sum::<f64>();
        1e3 * sank / top.len().max(1) as f64
    };
    scene.tops().into_iter().zip(of_part).map(sank).collect()
}

/// How far the highest edge of a garment sank, mm: of its connected parts that of the one which sank farthest. And which of them
/// slid, those that fell off left out, the one that slid farthest first.
pub(super) fn sank(scene: &Scene, positions: &[DVec3]) -> (f64, Vec<Slid>) {
    let tops = tops_sank_mm(scene, positions);
    let fallen = scene.fallen_parts(positions);
    let loose = scene.loose_parts().into_iter().filter(|part| !fallen.contains(part));
    let slid = loose.map(|part| Slid { part, sank_mm: tops[part - 1] });
    let mut slid: Vec<Slid> = slid.filter(|slid| slid.sank_mm > SANK_MM).collect();
    slid.sort_by(|a, b| b.sank_mm.total_cmp(&a.sank_mm));
    (tops.into_iter().fold(f64::NEG_INFINITY, f64::max), slid)
}
