//! Steps that take no cloth through cloth.
//!
//! Where a step from x to x' ends, and a few times on its way where it is long, all pairs of triangles that cross are found, exactly
//! (`mesh::triangle_crossing`). If one did not cross at x, a long step is refused, and tried again half as long; a short one is cut: the
//! corners that cross go back towards where they came from, half the way each time, and after a few times all the way, their
//! neighbours with them. As x has no crossing, this ends.
//!
//! Limits: what passes through whole between two looks, a few centimetres apart, is not seen. Where x crosses already, about what
//! crosses there new crossings are let be: they are on their way out ([`untangle`](super::untangle)).

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::surface::Skin;
use super::verlet_list::Near;
use crate::mesh::each_once;
use crate::mesh::triangle_crossing::cross;

/// A step whose longest move is more than so many edges is not cut but refused: to cut it would tear the cloth.
const LONG: f64 = 1.0;

/// A longer one is looked at on its way, so many edges apart but no more often than this: cloth that passes through cloth crosses
/// it for as long as it is round.
const APART: f64 = 2.0;
const MOST_STAGES: f64 = 4.0;

/// Times that crossing corners go back half the way; after that all the way, and their neighbours with them.
const HALVINGS: usize = 4;

/// Times that a step is cut, at most.
const CUTS: usize = 16;

/// Rings of neighbours about what crosses that are left alone.
const RINGS: usize = 2;

/// What there is to say of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StepCheck {
    /// Nothing crosses that did not before.
    Clear,
    /// Vertices went back, so that nothing does.
    Cut,
    /// Something does, and the step is too long to be cut.
    Crosses,
}

/// What crosses, and where.
#[derive(Debug, Clone)]
pub(super) struct Passage {
    skin: Arc<Skin>,
    near: Near,
    /// Pairs of triangles that cross where the last step ended; `None` before the first.
    crossing: Option<Vec<[u32; 2]>>,
    /// Whether each vertex is about what crosses there; empty where nothing does.
    tangled: Vec<bool>,
}

impl Passage {
    /// None looked at yet; what is [`near`](Self::near) is so within `reach`, m.
    pub(super) fn new(skin: Arc<Skin>, reach: f64) -> Self {
        let near = Near::new(Arc::clone(&skin), reach);
        Self { skin, near, crossing: None, tangled: Vec::new() }
    }

    /// Which triangles are near each other at `x`, m.
    pub(super) fn near(&mut self, x: &[DVec3]) -> &Near {
        self.near.hold_for(x);
        &self.near
    }

    /// Pairs of triangles that cross at `x`, where the last step ended.
    pub(super) fn known(&mut self, x: &[DVec3]) -> &[[u32; 2]] {
        if self.crossing.is_none() {
            let crossing = self.anew(x);
            self.begin(crossing);
        }
        self.crossing.as_deref().unwrap_or_default()
    }

    /// Whether a vertex is about what crosses.
    pub(super) fn is_tangled(&self, v: u32) -> bool {
        self.tangled.get(v as usize).copied().unwrap_or(false)
    }

    /// The next step begins where these pairs cross.
    pub(super) fn begin(&mut self, crossing: Vec<[u32; 2]>) {
        self.tangled.clear();
        if !crossing.is_empty() {
            self.tangled.resize(self.skin.vertex_areas.len(), false);
            for v in self.around(crossing.iter().flatten(), RINGS) {
                self.tangled[v as usize] = true;
            }
        }
        self.crossing = Some(crossing);
    }

    /// Pairs that cross at `x`, wherever the last step ended.
    pub(super) fn anew(&mut self, x: &[DVec3]) -> Vec<[u32; 2]> {
        self.near.hold_for(x);
        let Self { skin, near, .. } = &*self;
        let corners = |t: usize| skin.triangles[t].map(|v| x[v as usize]);
        let crossing = near.pairs(0.0).filter(|&[t, u]| cross(corners(t), corners(u)));
        let mut pairs: Vec<[u32; 2]> = crossing.map(|pair| pair.map(|t| t as u32)).collect();
        // A sliver turns over at a breath, and then crosses its neighbours by as much as it is high.
        pairs.retain(|pair| {
            let [a, b] = pair.map(|t| self.skin.triangles[t as usize]);
            let frail = |corners: [u32; 3]| corners.iter().any(|&v| self.skin.frail[v as usize]);
            let beside = |v: u32| self.skin.topology.neighbours(v).iter().any(|w| b.contains(w));
            let near = a.iter().any(|v| b.contains(v) || beside(*v));
            !(near && (frail(a) || frail(b)))
        });
        pairs
    }

    /// The corners of some triangles and so many rings of neighbours, ascending.
    fn around<'a>(&self, triangles: impl Iterator<Item = &'a u32>, rings: usize) -> Vec<u32> {
        let mut found = each_once(triangles.flat_map(|&t| self.skin.triangles[t as usize]));
        for _ in 0..rings {
            let next: Vec<u32> = found.iter().flat_map(|&v| self.skin.topology.neighbours(v)).copied().collect();
            found = each_once(found.into_iter().chain(next));
        }
        found
    }

    /// Looks at the step from `from`, where the last one ended, to `to`. A short one that crosses where it did not before is cut.
    pub(super) fn look(&mut self, from: &[DVec3], to: &mut [DVec3]) -> StepCheck {
        self.known(from);
        let longest = from.iter().zip(&*to).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max) / self.skin.edge_m;
        let stages = (longest / APART).ceil().clamp(1.0, MOST_STAGES);
        let mut stage = 1.0;
        while stage < stages {
            let there: Vec<DVec3> = from.iter().zip(&*to).map(|(a, b)| a.lerp(*b, stage / stages)).collect();
            let crossing = self.anew(&there);
            if !self.appeared(&crossing).is_empty() {
                return StepCheck::Crosses;
            }
            stage += 1.0;
        }
        let mut crossing = self.anew(to);
        let mut new = self.appeared(&crossing);
        if !new.is_empty() && longest > LONG {
            return StepCheck::Crosses;
        }
        let mut share = vec![1.0_f64; from.len()];
        for look in 0..CUTS {
            if new.is_empty() {
                break;
            }
            for v in self.around(new.iter(), look.saturating_sub(HALVINGS)) {
                let share = &mut share[v as usize];
                *share = if look < HALVINGS { 0.5 * *share } else { 0.0 };
            }
            let kept: Vec<DVec3> = from.iter().zip(&*to).zip(&share).map(|((a, b), s)| a.lerp(*b, *s)).collect();
            crossing = self.anew(&kept);
            new = self.appeared(&crossing);
        }
        for ((to, from), share) in to.iter_mut().zip(from).zip(&share).filter(|(_, s)| **s < 1.0) {
            *to = from.lerp(*to, *share);
        }
        self.begin(crossing);
        if share.iter().any(|s| *s < 1.0) { StepCheck::Cut } else { StepCheck::Clear }
    }

    /// Triangles of pairs that are not on their way out.
    fn appeared(&self, crossing: &[[u32; 2]]) -> Vec<u32> {
        let tangled = |t: u32| self.skin.triangles[t as usize].iter().all(|&v| self.is_tangled(v));
        crossing.iter().filter(|pair| !pair.iter().all(|&t| tangled(t))).flatten().copied().collect()
    }
}
