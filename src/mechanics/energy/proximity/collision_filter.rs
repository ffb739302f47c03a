//! Collision filter: rejects or cuts steps that would make the cloth intersect itself.
//!
//! At the end of a step from x to x', and at up to three points on the way of a long one, all intersecting pairs of triangles are found
//! exactly (`mesh::self_intersection`). If a pair did not intersect at x, a long step is rejected, and the caller tries half of it. A short
//! step is cut: the corners of intersecting triangles go back towards x, half the way each time, and after a few times all
//! the way, together with their neighbours. Since x has no intersection, this terminates.
//!
//! Limits: a part that passes through completely between two checks, a few centimetres apart, is not detected. Near pairs that
//! intersect at x already, new intersections are allowed: these parts are being untangled ([`untangle`](super::untangle)).

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
    /// Vertices went back so that there is no new intersection.
    Cut,
    /// A new intersection, in a step too long to be cut.
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
        self.list.update(x);
        let Self { surface, list, .. } = &*self;
        let corners = |t: usize| surface.triangles[t].map(|v| x[v as usize]);
        let crossing = list.pairs(0.0).filter(|&[t, u]| cross(corners(t), corners(u)));
        let mut pairs: Vec<[u32; 2]> = crossing.map(|pair| pair.map(|t| t as u32)).collect();
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

    /// Checks the step from `from`, where the last one ended, to `to`, and cuts a short one with new intersections.
    pub(super) fn check(&mut self, from: &[DVec3], to: &mut [DVec3]) -> StepCheck {
        self.current(from);
        let longest = from.iter().zip(&*to).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max) / self.surface.edge_m;
        let stages = (longest / self.options.check_spacing).ceil().clamp(1.0, self.options.max_stages.max(1.0));
        let mut stage = 1.0;
        while stage < stages {
            let there: Vec<DVec3> = from.iter().zip(&*to).map(|(a, b)| a.lerp(*b, stage / stages)).collect();
            let crossing = self.crossing_at(&there);
            if !self.new_crossings(&crossing).is_empty() {
                return StepCheck::Crosses;
            }
            stage += 1.0;
        }
        let mut crossing = self.crossing_at(to);
        let mut new = self.new_crossings(&crossing);
        if !new.is_empty() && longest > self.options.max_cut_move {
            return StepCheck::Crosses;
        }
        let mut share = vec![1.0_f64; from.len()];
        for cut in 0..self.options.max_cuts {
            if new.is_empty() {
                break;
            }
            for v in self.vertices_about(new.iter(), cut.saturating_sub(self.options.max_halvings)) {
                let share = &mut share[v as usize];
                *share = if cut < self.options.max_halvings { 0.5 * *share } else { 0.0 };
            }
            let kept: Vec<DVec3> = from.iter().zip(&*to).zip(&share).map(|((a, b), s)| a.lerp(*b, *s)).collect();
            crossing = self.crossing_at(&kept);
            new = self.new_crossings(&crossing);
        }
        for ((to, from), share) in to.iter_mut().zip(from).zip(&share).filter(|(_, s)| **s < 1.0) {
            *to = from.lerp(*to, *share);
        }
        self.begin(crossing);
        if share.iter().any(|s| *s < 1.0) { StepCheck::Cut } else { StepCheck::Clear }
    }

    /// Triangles of the pairs that are not being untangled.
    fn new_crossings(&self, crossing: &[[u32; 2]]) -> Vec<u32> {
        let tangled = |t: u32| self.surface.triangles[t as usize].iter().all(|&v| self.is_tangled(v));
        crossing.iter().filter(|pair| !pair.iter().all(|&t| tangled(t))).flatten().copied().collect()
    }
}
