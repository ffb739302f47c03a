//! Which triangles of a cloth are near each other.
//!
//! All pairs whose boxes were nearer than `reach` + `slack` where the list was made. As long as no vertex has moved from there by more than
//! half the slack it holds every pair whose boxes are nearer than `reach`, so near rest, where steps are short, one list serves many
//! (L. Verlet: "Computer 'experiments' on classical fluids", Phys. Rev. 159, 1967, section II). Where only some vertices have moved
//! farther, only the pairs of their triangles are found anew. Boxes against boxes by parry3d's bounding volume hierarchy.
//!
//! What is asked of a pair decides for itself, and pairs are sorted: answers do not depend on when the list was made.

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;

use super::surface::Skin;

/// Slack, in mean edges: more is made anew less often, and takes longer to go through.
const SLACK: f64 = 0.5;

/// Pairs of triangles that are near, where the list was made and a little way from there.
#[derive(Debug, Clone)]
pub(super) struct Near {
    skin: Arc<Skin>,
    reach: f64,
    slack: f64,
    /// Where each vertex was when the pairs of its triangles were found, m; empty before the first time.
    made_at: Vec<DVec3>,
    /// Smaller number first, sorted.
    pairs: Vec<[u32; 2]>,
    /// About each triangle where it was asked for last.
    boxes: Vec<Aabb>,
}

impl Near {
    /// None looked for yet; pairs count whose boxes are nearer than `reach`, m.
    pub(super) fn new(skin: Arc<Skin>, reach: f64) -> Self {
        let slack = SLACK * skin.edge_m;
        Self { skin, reach, slack, made_at: Vec::new(), pairs: Vec::new(), boxes: Vec::new() }
    }

    /// Makes the list hold for `x` (m).
    pub(super) fn hold_for(&mut self, x: &[DVec3]) {
        let Self { skin, slack, made_at, pairs, boxes, .. } = self;
        boxes.clear();
        boxes.extend(skin.triangles.iter().map(|t| bounds(t, x)));
        let most = 0.25 * *slack * *slack;
        let has_moved: Vec<bool> = match made_at.len() == x.len() {
            true => made_at.iter().zip(x).map(|(before, now)| before.distance_squared(*now) > most).collect(),
            false => vec![true; x.len()],
        };
        made_at.resize(x.len(), DVec3::ZERO);
        for ((before, now), _) in made_at.iter_mut().zip(x).zip(&has_moved).filter(|(_, moved)| **moved) {
            *before = *now;
        }
        let is_new: Vec<bool> = skin.triangles.iter().map(|t| t.iter().any(|&v| has_moved[v as usize])).collect();
        let new: Vec<u32> = (0..).zip(&is_new).filter(|(_, new)| **new).map(|(t, _)| t).collect();
        if !new.is_empty() {
            pairs.retain(|pair| pair.iter().all(|&t| !is_new[t as usize]));
            let found = self.found(&new, &is_new);
            self.pairs.extend(found);
            // Stable sorting knows that these are two sorted runs.
            self.pairs.sort();
        }
    }

    /// The pairs of which one at least is `new`, sorted.
    fn found(&self, new: &[u32], is_new: &[bool]) -> Vec<[u32; 2]> {
        let Self { skin, made_at, reach, slack, .. } = self;
        let around = |t: u32| bounds(&skin.triangles[t as usize], made_at);
        let boxes: Vec<Aabb> = new.iter().map(|&t| around(t)).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        let mut found: Vec<[u32; 2]> = (0..skin.triangles.len() as u32)
            .into_par_iter()
            .with_min_len(64)
            .flat_map_iter(|t| {
                let near = around(t).loosened(reach + slack);
                let all = tree.intersect_aabb(&near).map(|i| new[i as usize]);
                let wanted = all.filter(|&u| if is_new[t as usize] { t < u } else { t != u });
                wanted.map(|u| [t.min(u), t.max(u)]).collect::<Vec<_>>()
            })
            .collect();
        found.par_sort_unstable();
        found
    }

    /// The pairs whose boxes are nearer than this where they were asked for last, at most `reach`, m; sorted.
    pub(super) fn pairs(&self, nearer: f64) -> impl ParallelIterator<Item = [usize; 2]> + '_ {
        let close = move |[t, u]: &[usize; 2]| self.boxes[*t].loosened(nearer).intersects(&self.boxes[*u]);
        self.pairs.par_iter().with_min_len(512).map(|pair| pair.map(|t| t as usize)).filter(close)
    }

    /// The box about a triangle where it was asked for last.
    pub(super) fn bounds(&self, t: usize) -> &Aabb {
        &self.boxes[t]
    }
}

fn bounds(triangle: &[u32; 3], x: &[DVec3]) -> Aabb {
    let [a, b, c] = triangle.map(|v| x[v as usize]);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::energy::Cloth;
    use crate::mesh::samples::sheet;

    /// Every pair, box against box.
    fn brute(skin: &Skin, x: &[DVec3], nearer: f64) -> Vec<[usize; 2]> {
        let boxes: Vec<Aabb> = skin.triangles.iter().map(|t| bounds(t, x)).collect();
        let all = (0..boxes.len()).flat_map(|t| (t + 1..boxes.len()).map(move |u| [t, u]));
        all.filter(|&[t, u]| boxes[t].loosened(nearer).intersects(&boxes[u])).collect()
    }

    /// Rolled up step by step, the whole of it moving, one end of it, or next to nothing.
    #[test]
    fn however_the_cloth_moves_the_pairs_are_those_of_brute_force() {
        let mesh = sheet(14, 14, |i, j| DVec3::new(i, j, 0.0) * 0.01);
        let skin = Arc::new(Skin::new(&Cloth::sample(&mesh, "jersey", &[]).triangles, mesh.vertex_count()));
        let flat = mesh.positions;
        let mut near = Near::new(Arc::clone(&skin), 3e-3);
        let mut lists = Vec::new();
        let moves = [
            (0.0, 0.0),
            (0.0, 1e-4),
            (0.3, 0.0),
            (0.301, 1e-4),
            (1.2, 0.0),
            (1.6, 0.0),
            (1.601, 0.0),
            (0.2, 0.0),
            (0.2, 0.5),
        ];
        for (turns, shift) in moves {
            let rolled = |p: &DVec3| {
                let along = (p.x - 0.07).max(0.0);
                let (sin, cos) = (along * turns * 90.0).sin_cos();
                let radius = 0.01 / (1.0 + turns) * (1.0 + 20.0 * along);
                DVec3::new(p.x.min(0.07) + radius * sin + shift, p.y, radius * (1.0 - cos))
            };
            let x: Vec<DVec3> = flat.iter().map(rolled).collect();
            near.hold_for(&x);
            for nearer in [0.0, 3e-3] {
                assert_eq!(near.pairs(nearer).collect::<Vec<_>>(), brute(&skin, &x, nearer), "{turns} {shift}");
            }
            lists.push(near.made_at.iter().zip(&x).filter(|(before, now)| before == now).count());
        }
        // Some lists went on, some were made anew, and some in part.
        let all = flat.len();
        assert!(lists.contains(&0) && lists.contains(&all) && lists.iter().any(|n| (1..all).contains(n)), "{lists:?}");
    }
}
