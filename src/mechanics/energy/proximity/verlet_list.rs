//! Pairs of near triangles of a cloth: a Verlet list.
//!
//! The list holds all pairs whose boxes were nearer than `reach` + `margin` when it was built. As long as no vertex has moved by more than
//! half the margin it contains every pair whose boxes are nearer than `reach`. Near rest, where steps are short, one list serves many steps
//! (L. Verlet: "Computer 'experiments' on classical fluids", Phys. Rev. 159, 1967, section II). If some vertices have moved farther,
//! only the pairs of their triangles are rebuilt. Boxes are intersected by parry3d's bounding volume hierarchy.
//!
//! Pairs are filtered by their present distance and sorted, so results do not depend on when the list was built.

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;

use super::surface::Surface;

/// The list, with its margin.
#[derive(Debug, Clone)]
pub(super) struct VerletList {
    surface: Arc<Surface>,
    reach: f64,
    margin: f64,
    /// Position of each vertex when the pairs of its triangles were found, m; empty before the first use.
    built_at: Vec<DVec3>,
    /// Smaller number first, sorted.
    pairs: Vec<[u32; 2]>,
    /// Box of each triangle at the last query.
    boxes: Vec<Aabb>,
}

impl VerletList {
    /// An empty list for pairs whose boxes are nearer than `reach`, m, searched again after moves of half the `margin`, m.
    pub(super) fn new(surface: Arc<Surface>, reach: f64, margin: f64) -> Self {
        Self { surface, reach, margin, built_at: Vec::new(), pairs: Vec::new(), boxes: Vec::new() }
    }

    /// Updates the list for the positions `x` (m).
    pub(super) fn update(&mut self, x: &[DVec3]) {
        let Self { surface, margin, built_at, pairs, boxes, .. } = self;
        boxes.clear();
        boxes.extend(surface.triangles.iter().map(|t| bounds(t, x)));
        let limit = 0.25 * *margin * *margin;
        let has_moved: Vec<bool> = match built_at.len() == x.len() {
            true => built_at.iter().zip(x).map(|(before, now)| before.distance_squared(*now) > limit).collect(),
            false => vec![true; x.len()],
        };
        built_at.resize(x.len(), DVec3::ZERO);
        for ((before, now), _) in built_at.iter_mut().zip(x).zip(&has_moved).filter(|(_, moved)| **moved) {
            *before = *now;
        }
        let is_new: Vec<bool> = surface.triangles.iter().map(|t| t.iter().any(|&v| has_moved[v as usize])).collect();
        let new: Vec<u32> = (0..).zip(&is_new).filter(|(_, new)| **new).map(|(t, _)| t).collect();
        if !new.is_empty() {
            pairs.retain(|pair| pair.iter().all(|&t| !is_new[t as usize]));
            let found = self.found(&new, &is_new);
            self.pairs.extend(found);
            // The stable sort merges two sorted runs.
            self.pairs.sort();
        }
    }

    /// The pairs with at least one `new` triangle, sorted.
    fn found(&self, new: &[u32], is_new: &[bool]) -> Vec<[u32; 2]> {
        let Self { surface, built_at, reach, margin, .. } = self;
        let around = |t: u32| bounds(&surface.triangles[t as usize], built_at);
        let boxes: Vec<Aabb> = new.iter().map(|&t| around(t)).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        let mut found: Vec<[u32; 2]> = (0..surface.triangles.len() as u32)
            .into_par_iter()
            .with_min_len(64)
            .flat_map_iter(|t| {
                let near = around(t).loosened(reach + margin);
                let all = tree.intersect_aabb(&near).map(|i| new[i as usize]);
                let wanted = all.filter(|&u| if is_new[t as usize] { t < u } else { t != u });
                wanted.map(|u| [t.min(u), t.max(u)]).collect::<Vec<_>>()
            })
            .collect();
        found.par_sort_unstable();
        found
    }

    /// The pairs whose boxes are nearer than this (m, at most `reach`) at the last query, sorted.
    pub(super) fn pairs(&self, nearer: f64) -> impl ParallelIterator<Item = [usize; 2]> + '_ {
        let close = move |[t, u]: &[usize; 2]| self.boxes[*t].loosened(nearer).intersects(&self.boxes[*u]);
        self.pairs.par_iter().with_min_len(512).map(|pair| pair.map(|t| t as usize)).filter(close)
    }

    /// The box of a triangle at the last query.
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

    /// All pairs by comparing every two boxes.
    fn brute(surface: &Surface, x: &[DVec3], nearer: f64) -> Vec<[usize; 2]> {
        let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| bounds(t, x)).collect();
        let all = (0..boxes.len()).flat_map(|t| (t + 1..boxes.len()).map(move |u| [t, u]));
        all.filter(|&[t, u]| boxes[t].loosened(nearer).intersects(&boxes[u])).collect()
    }

    /// The cloth is rolled up step by step; the whole of it moves, one end of it, or hardly anything.
    #[test]
    fn pairs_after_any_move_are_those_of_brute_force() {
        let mesh = sheet(14, 14, |i, j| DVec3::new(i, j, 0.0) * 0.01);
        let surface = Arc::new(Surface::new(&Cloth::sample(&mesh, "jersey", &[]).triangles, mesh.vertex_count()));
        let flat = mesh.positions;
        let mut list = VerletList::new(Arc::clone(&surface), 3e-3, 0.5 * surface.edge_m);
        let mut unmoved = Vec::new();
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
            list.update(&x);
            for nearer in [0.0, 3e-3] {
                assert_eq!(list.pairs(nearer).collect::<Vec<_>>(), brute(&surface, &x, nearer), "{turns} {shift}");
            }
            unmoved.push(list.built_at.iter().zip(&x).filter(|(before, now)| before == now).count());
        }
        // Some updates keep the list, some rebuild it, and some rebuild a part.
        let all = flat.len();
        assert!(
            unmoved.contains(&0) && unmoved.contains(&all) && unmoved.iter().any(|n| (1..all).contains(n)),
            "{unmoved:?}"
        );
    }
}
