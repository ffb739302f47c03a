//! Collision filter: shortens steps, where they would make the cloth intersect itself, for those parts alone.
//!
//! A step from x to x' is followed in stages. At the end of each, all intersecting pairs of triangles are found exactly
//! (`mesh::self_intersection`). Corners of pairs that did not intersect at x go back towards the stage before, half the way each time, and
//! after a few times all the way, together with their neighbours; there they stay while the rest of the cloth goes on. Since x has no
//! intersection, this terminates.
//!
//! Limits: a part that passes through completely between two stages, a few centimetres apart, is not detected. Near pairs that
//! intersect at x already, new intersections are allowed: these parts are being untangled ([`untangle`](super::untangle)). A long step after
//! which more pairs intersect than before is rejected, and the caller tries half of it.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::surface::Surface;
use super::verlet_list::VerletList;
use crate::mechanics::solver_options::CollisionFilterOptions;
use crate::mesh::each_once;
use crate::mesh::self_intersection::cross;

/// Result of the check of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StepCheck {
    /// No new intersection.
    Clear,
    /// Vertices of a short step went back so that there is no new intersection.
    Cut,
    /// Parts of a long step were held back so that there is no new intersection; its energy may have risen.
    HeldBack,
    /// More intersections than before, after a long step of cloth that is being untangled.
    Crosses,
}

/// The filter, with the intersections where the last step ended.
#[derive(Debug, Clone)]
pub(super) struct CollisionFilter {
    surface: Arc<Surface>,
    list: VerletList,
    options: CollisionFilterOptions,
    /// Pairs of triangles that intersect where the last step ended; `None` before the first.
    crossing: Option<Vec<[u32; 2]>>,
    /// Whether each vertex is near one of these pairs; empty without pairs.
    tangled: Vec<bool>,
}

impl CollisionFilter {
    /// A filter that reads the near triangles from this list.
    pub(super) fn new(surface: Arc<Surface>, list: VerletList, options: CollisionFilterOptions) -> Self {
        Self { surface, list, options, crossing: None, tangled: Vec::new() }
    }

    /// The list of near triangles at `x`, m.
    pub(super) fn list(&mut self, x: &[DVec3]) -> &VerletList {
        self.list.update(x);
        &self.list
    }

    /// Pairs of triangles that intersect at `x`, where the last step ended.
    pub(super) fn current(&mut self, x: &[DVec3]) -> &[[u32; 2]] {
        if self.crossing.is_none() {
            let crossing = self.crossing_at(x);
            self.begin(crossing);
        }
        self.crossing.as_deref().unwrap_or_default()
    }

    /// Whether a vertex is near an intersecting pair.
    pub(super) fn is_tangled(&self, v: u32) -> bool {
        self.tangled.get(v as usize).copied().unwrap_or(false)
    }

    /// Sets the pairs that intersect where the next step begins.
    pub(super) fn begin(&mut self, crossing: Vec<[u32; 2]>) {
        self.tangled.clear();
        if !crossing.is_empty() {
            self.tangled.resize(self.surface.vertex_areas.len(), false);
            for v in self.vertices_about(crossing.iter().flatten(), self.options.tangled_rings) {
                self.tangled[v as usize] = true;
            }
        }
        self.crossing = Some(crossing);
    }

    /// Pairs of triangles that intersect at `x`.
    pub(super) fn crossing_at(&mut self, x: &[DVec3]) -> Vec<[u32; 2]> {
        let overlapping = self.list.overlapping(x);
        let corners = |t: u32| self.surface.triangles[t as usize].map(|v| x[v as usize]);
        let crossing = overlapping.into_par_iter().with_min_len(512).filter(|&[t, u]| cross(corners(t), corners(u)));
        let mut pairs: Vec<[u32; 2]> = crossing.collect();
        pairs.sort_unstable();
        // A sliver inverts by rounding, and then intersects its neighbours by its own height.
        pairs.retain(|pair| {
            let [a, b] = pair.map(|t| self.surface.triangles[t as usize]);
            let near_sliver = |corners: [u32; 3]| corners.iter().any(|&v| self.surface.near_sliver[v as usize]);
            let beside = |v: u32| self.surface.topology.neighbours(v).iter().any(|w| b.contains(w));
            let near = a.iter().any(|v| b.contains(v) || beside(*v));
            !(near && (near_sliver(a) || near_sliver(b)))
        });
        pairs
    }

    /// The corners of these triangles and this many rings of neighbours, ascending.
    fn vertices_about<'a>(&self, triangles: impl Iterator<Item = &'a u32>, rings: usize) -> Vec<u32> {
        let mut found = each_once(triangles.flat_map(|&t| self.surface.triangles[t as usize]));
        for _ in 0..rings {
            let next: Vec<u32> = found.iter().flat_map(|&v| self.surface.topology.neighbours(v)).copied().collect();
            found = each_once(found.into_iter().chain(next));
        }
        found
    }

    /// Checks the step from `from`, where the last one ended, to `to`, and holds back the parts that would intersect, and those vertices that
    /// may go only up to a share of their move.
    pub(super) fn check(&mut self, from: &[DVec3], to: &mut [DVec3], shares: &[(u32, f64)]) -> StepCheck {
        self.current(from);
        let longest = from.iter().zip(&*to).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max) / self.surface.edge_m;
        let stages = (longest / self.options.check_spacing).ceil().max(1.0);
        let is_long = longest > self.options.max_cut_move;
        let mut limits = vec![1.0_f64; from.len()];
        for &(v, share) in shares {
            limits[v as usize] = share;
        }
        let at = |limits: &[f64], share: f64| -> Vec<DVec3> {
            from.iter().zip(&*to).zip(limits).map(|((a, b), limit)| a.lerp(*b, limit.min(share))).collect()
        };
        let mut crossing = Vec::new();
        let mut stage = 1.0;
        while stage <= stages {
            let [before, share] = [(stage - 1.0) / stages, stage / stages];
            for cut in 0.. {
                crossing = self.crossing_at(&at(&limits, share));
                let new = self.new_crossings(&crossing);
                if new.is_empty() || cut == self.options.max_cuts {
                    break;
                }
                let back = if cut < self.options.max_halvings { 0.5 } else { 0.0 };
                let near = self.vertices_about(new.iter(), cut.saturating_sub(self.options.max_halvings));
                for v in near {
                    let limit = &mut limits[v as usize];
                    *limit = limit.min(before + back * (limit.min(share) - before).max(0.0));
                }
            }
            stage += 1.0;
        }
        if is_long && crossing.len() > self.crossing.as_ref().map_or(0, Vec::len) {
            return StepCheck::Crosses;
        }
        let kept = at(&limits, 1.0);
        let cut = limits.iter().any(|limit| *limit < 1.0);
        if cut {
            to.copy_from_slice(&kept);
        }
        self.begin(crossing);
        match (cut, is_long) {
            (false, _) => StepCheck::Clear,
            (true, false) => StepCheck::Cut,
            (true, true) => StepCheck::HeldBack,
        }
    }

    /// Triangles of the pairs that are not being untangled.
    fn new_crossings(&self, crossing: &[[u32; 2]]) -> Vec<u32> {
        let tangled = |t: u32| self.surface.triangles[t as usize].iter().all(|&v| self.is_tangled(v));
        crossing.iter().filter(|pair| !pair.iter().all(|&t| tangled(t))).flatten().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::energy::Cloth;
    use crate::mesh::samples::sheet;

    #[test]
    fn a_vertex_that_may_go_half_the_way_goes_as_far() {
        let mesh = sheet(20, 20, |i, j| DVec3::new(i, j, 0.0) * 0.01);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        let surface = Arc::new(Surface::new(&cloth.triangles, mesh.vertex_count()));
        let options = CollisionFilterOptions::default();
        let list = VerletList::new(Arc::clone(&surface), 1e-3, 0.5 * surface.edge_m);
        let mut filter = CollisionFilter::new(surface, list, options);
        let mut to: Vec<DVec3> = mesh.positions.iter().map(|x| *x + DVec3::new(0.0, 0.0, 0.05)).collect();
        let middle = 10 * 21 + 10;
        assert_eq!(filter.check(&mesh.positions, &mut to, &[(middle as u32, 0.5)]), StepCheck::HeldBack);
        assert!((to[middle].z - 0.025).abs() < 1e-12);
        assert!(to.iter().enumerate().all(|(v, x)| v == middle || x.z == 0.05));
    }

    #[test]
    fn a_long_step_holds_back_only_the_part_that_would_intersect() {
        // A sheet of 15 by 41 vertices folded over: two layers 6 mm apart, edges of 1 cm.
        let mesh = sheet(14, 40, |i, j| DVec3::new(i.min(14.0 - i), j, 0.6 * ((i - 6.0) / 2.0).clamp(0.0, 1.0)) * 0.01);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        let surface = Arc::new(Surface::new(&cloth.triangles, mesh.vertex_count()));
        let options = CollisionFilterOptions::default();
        let edge_m = surface.edge_m;
        let list = VerletList::new(Arc::clone(&surface), 1e-3, 0.5 * edge_m);
        let mut filter = CollisionFilter::new(Arc::clone(&surface), list, options);
        let from = &mesh.positions;
        // All of it moves by 5 cm along the fold; the upper layer also goes through the lower one at one end.
        let moved = |p: &DVec3| {
            let down = 0.03 * (1.0 - p.y / 0.06).max(0.0);
            *p + DVec3::new(0.0, 0.05, if p.z > 0.005 { -down } else { 0.0 })
        };
        let wanted: Vec<DVec3> = from.iter().map(moved).collect();
        assert!(!filter.crossing_at(&wanted).is_empty());
        let mut to = wanted.clone();
        assert_eq!(filter.check(from, &mut to, &[]), StepCheck::HeldBack);
        assert!(filter.crossing_at(&to).is_empty());
        let kept = from.iter().zip(&to).zip(&wanted).filter(|((p, _), _)| p.y > 0.3);
        assert!(kept.clone().count() > 100 && kept.into_iter().all(|((_, to), wanted)| to == wanted));
        let moves: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a.distance(*b)).collect();
        assert!(moves.iter().any(|m| *m < 0.03), "nothing was held back");
        // A short step is cut.
        let mut short: Vec<DVec3> = from.iter().zip(&wanted).map(|(a, b)| a.lerp(*b, 0.25)).collect();
        short.iter_mut().zip(from).for_each(|(to, from)| to.y = from.y);
        filter.begin(Vec::new());
        assert_eq!(filter.check(from, &mut short, &[]), StepCheck::Cut);
        assert!(filter.crossing_at(&short).is_empty());
    }
}
