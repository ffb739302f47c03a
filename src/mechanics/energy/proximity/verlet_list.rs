//! Pairs of near triangles of a cloth: a Verlet list.
//!
//! The list holds all pairs whose boxes were nearer than `reach` + `margin` when it was built. As long as no vertex has moved by more than
//! half the margin it contains every pair whose boxes are nearer than `reach`. Near rest, where steps are short, one list serves many steps
//! (L. Verlet: "Computer 'experiments' on classical fluids", Phys. Rev. 159, 1967, section II). Boxes are intersected by parry3d's
//! bounding volume hierarchy, traversed against itself.
//!
//! Pairs are filtered by their present distance and sorted, so results do not depend on when the list was built.

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use rayon::prelude::*;

use super::surface::Surface;

/// The list, with its margin.
#[derive(Debug, Clone)]
pub(super) struct VerletList {
    surface: Arc<Surface>,
    reach: f64,
    margin: f64,
    /// Positions that the list was made for, m; empty before the first use.
    built_at: Vec<DVec3>,
    /// Smaller number first, sorted.
    pairs: Vec<[u32; 2]>,
    /// Box of each triangle at the last query.
    boxes: Vec<Aabb>,
    tree: Bvh,
}

impl VerletList {
    /// An empty list for pairs whose boxes are nearer than `reach`, m, searched again after moves of half the `margin`, m.
    pub(super) fn new(surface: Arc<Surface>, reach: f64, margin: f64) -> Self {
        Self { surface, reach, margin, built_at: Vec::new(), pairs: Vec::new(), boxes: Vec::new(), tree: Bvh::new() }
    }

    /// Updates the list for the positions `x` (m).
    pub(super) fn update(&mut self, x: &[DVec3]) {
        if !self.holds_at(x) {
            self.built_at.clear();
            self.built_at.extend_from_slice(x);
            self.pairs = self.found(self.reach + self.margin);
            // By one number: a single comparison.
            self.pairs.par_sort_unstable_by_key(|[t, u]| u64::from(*t) << 32 | u64::from(*u));
        }
    }

    /// The pairs whose boxes overlap at `x` (m), in any order. A step is checked at many places, for each of which no list is made.
    pub(super) fn overlapping(&mut self, x: &[DVec3]) -> Vec<[u32; 2]> {
        if self.holds_at(x) { self.pairs(0.0).map(|pair| pair.map(|t| t as u32)).collect() } else { self.found(0.0) }
    }

    /// Computes the boxes at `x`; returns whether the list contains all near pairs there.
    fn holds_at(&mut self, x: &[DVec3]) -> bool {
        let Self { surface, margin, built_at, boxes, .. } = self;
        boxes.clear();
        boxes.extend(surface.triangles.iter().map(|t| bounds(t, x)));
        let limit = 0.25 * *margin * *margin;
        built_at.len() == x.len() && built_at.iter().zip(x).all(|(before, now)| before.distance_squared(*now) <= limit)
    }

    /// The pairs whose present boxes are nearer than this, m: boxes enlarged by half of it overlap. The tree is built once, and its boxes
    /// are updated, because neighbours in the cloth stay neighbours.
    fn found(&mut self, nearer: f64) -> Vec<[u32; 2]> {
        let Self { boxes, tree, .. } = self;
        let around = boxes.iter().map(|of| of.loosened(0.5 * nearer));
        if tree.is_empty() {
            *tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &around.collect::<Vec<_>>());
        } else {
            around.zip(0..).for_each(|(of, t)| tree.insert_or_update_partially(of, t, 0.0));
            tree.refit_without_opt();
        }
        let mut found = Vec::new();
        let workspace = &mut BvhWorkspace::default();
        tree.traverse_bvtt_single_tree::<false>(workspace, &mut |t, u| found.push([t.min(u), t.max(u)]));
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

    fn brute_pairs(surface: &Surface, x: &[DVec3]) -> Vec<[u32; 2]> {
        brute(surface, x, 0.0).into_iter().map(|pair| pair.map(|t| t as u32)).collect()
    }

    /// The cloth is rolled up step by step; the whole of it moves, one end of it, or hardly anything.
    #[test]
    fn pairs_after_any_move_are_those_of_brute_force() {
        let mesh = sheet(14, 14, |i, j| DVec3::new(i, j, 0.0) * 0.01);
        let surface = Arc::new(Surface::new(&Cloth::sample(&mesh, "jersey", &[]).triangles, mesh.vertex_count()));
        let flat = mesh.positions;
        let mut list = VerletList::new(Arc::clone(&surface), 3e-3, 0.5 * surface.edge_m);
        let mut made = Vec::new();
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
            // Before the update, of positions that the list does not hold for.
            let mut before = list.overlapping(&x);
            before.sort_unstable();
            assert_eq!(before, brute_pairs(&surface, &x));
            list.update(&x);
            for nearer in [0.0, 3e-3] {
                assert_eq!(list.pairs(nearer).collect::<Vec<_>>(), brute(&surface, &x, nearer), "{turns} {shift}");
            }
            let mut after = list.overlapping(&x);
            after.sort_unstable();
            assert_eq!(after, before);
            made.push(list.built_at == x);
        }
        assert!(made.contains(&true) && made.contains(&false), "{made:?}");
    }
}
