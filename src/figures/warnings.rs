//! What a user should act upon although the numbers alone would reassure, and with what.

use glam::DVec3;

use super::Figures;
use crate::mechanics::fit::TORN_PERCENT;
use crate::mesh::TriMesh;
use crate::quantile::nearest_rank;
use crate::scene::Scene;

/// A top edge that sinks farther than this (mm) has not settled, it has slid: a neckline settles by one to two centimetres.
const SANK_MM: f64 = 100.0;

/// Triangles this many times as long as half of them are, and longer than this (m), bridge something: no remesher leaves such.
const BRIDGE: f64 = 5.0;
const BRIDGE_M: f64 = 0.1;

impl Figures {
    /// What in these figures a user should act upon, in the terms of a garment with these held vertices and groups.
    #[must_use]
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        let mut found = Vec::new();
        if self.top_sank_mm > SANK_MM && scene.held.is_empty() {
            let parts = scene.topology.components().1;
            let parts = if parts > 1 {
                format!(", of its {parts} connected parts top:1 to top:{parts}")
            } else {
                String::new()
            };
            let groups = match scene.garment.groups.as_slice() {
                [] => parts,
                groups => format!("{parts}, or one of its groups: {}", groups.join(", ")),
            };
            found.push(format!(
                "the garment has slid down: its highest edge sank by {:.0} cm, and nothing holds it; if it has a waistband, hold \
                 that (--hold top{groups})",
                0.1 * self.top_sank_mm
            ));
        }
        if let Some(bridges) = bridges(&scene.garment).filter(|_| self.top_sank_mm > SANK_MM) {
            found.push(bridges);
        }
        if self.body_crossing_pairs > 0 {
            found.push(format!(
                "skin shows through the cloth: {} pairs of triangles of garment and body cross{}; contact is felt at vertices, so \
                 a finer garment mesh mends it",
                self.body_crossing_pairs,
                if self.penetrating_vertices == 0 { ", though no vertex is inside" } else { "" }
            ));
        }
        if let Some(strain) = self.strain_max.filter(|strain| 1e2 * *strain > TORN_PERCENT) {
            found.push(format!(
                "the cloth is stretched by {:.0} % somewhere, more than fabrics bear: the garment is too small there, or caught",
                1e2 * strain
            ));
        }
        found
    }
}

/// What to do about triangles that bridge open seams, where there are such: contact is felt at vertices, and they have none in between.
fn bridges(garment: &TriMesh) -> Option<String> {
    let at = |v: u32| garment.positions[v as usize];
    let longest = |t: &[u32; 3]| (0..3).map(|i| at(t[i]).distance(at(t[(i + 1) % 3]))).fold(0.0, f64::max);
    let lengths: Vec<f64> = garment.triangles.iter().map(longest).collect();
    let usual = nearest_rank(&lengths, 0.5);
    let far: Vec<f64> = lengths.into_iter().filter(|l| *l > BRIDGE_M && *l > BRIDGE * usual).collect();
    let most = far.iter().copied().fold(0.0, f64::max);
    (!far.is_empty()).then(|| {
        format!(
            "{} of its triangles are up to {:.0} cm long, where most are {:.1} cm: do they bridge open seams? The body passes between their \
             corners; sew the pattern it was cut by (--pattern), or begin with the seams closed",
            far.len(),
            1e2 * most,
            1e2 * usual
        )
    })
}

/// How far the highest edge, or the highest tenth of a garment without edges, is lower at `positions` (m) than as placed, mm.
pub(super) fn top_sank_mm(scene: &Scene, positions: &[DVec3]) -> f64 {
    let placed = &scene.garment.positions;
    let top = scene.edge("top").unwrap_or_else(|_| {
        let mut highest: Vec<u32> = (0..placed.len() as u32).collect();
        highest.sort_by(|&a, &b| placed[b as usize].z.total_cmp(&placed[a as usize].z));
        highest.truncate(placed.len().div_ceil(10));
        highest
    });
    let sank = top.iter().map(|&v| placed[v as usize].z - positions[v as usize].z).sum::<f64>();
    1e3 * sank / top.len().max(1) as f64
}
