//! The garment at several resolutions: a drape goes from coarse to fine, so that full resolution is left to polish.
//!
//! Each level has a quarter of the vertices of the one before ([`Coarse`]). PARTs are those of the full garment, as far as they have
//! vertices there. Source: nested iteration (Hackbusch: "Multi-Grid Methods and Applications", 1985).

use std::sync::Arc;

use glam::DVec3;

use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::Garment;
use crate::mechanics::energy::{Cloth, EnergyError};
use crate::mesh::coarse::Coarse;
use crate::mesh::{Topology, TriMesh};
use crate::parts::{Parts, UNASSIGNED};
use crate::scene::Scene;

/// Vertices of a level over those of the next coarser.
const RATIO: usize = 4;

/// No level is made with fewer vertices than this: there is nothing left to save.
const MIN_LEVEL_VERTICES: usize = 400;

/// A coarser garment.
#[derive(Debug)]
pub(crate) struct Level {
    coarse: Arc<Coarse>,
    cloth: Cloth,
}

/// The full garment's cloth and the coarser ones, fine to coarse.
#[derive(Debug)]
pub(crate) struct Levels {
    pub(crate) cloth: Cloth,
    pub(crate) coarser: Vec<Level>,
}

impl Levels {
    /// The cloth of `scene`, `fabric` being that of what names none, and as many coarser ones as there are.
    pub(crate) fn new(scene: &Scene, fabric: &Fabric) -> Result<Self, EnergyError> {
        let fabrics = &scene.fabrics(fabric);
        Self::beside(scene, fabrics, || {
            let mut coarser: Vec<Level> = Vec::new();
            while let Some(next) = Level::below(scene, coarser.last(), fabrics) {
                coarser.push(next);
            }
            coarser
        })
    }

    /// The same garment in another fabric: how its coarser ones are meshed does not depend on it.
    pub(crate) fn recut(&self, scene: &Scene, fabric: &Fabric) -> Result<Self, EnergyError> {
        let fabrics = &scene.fabrics(fabric);
        Self::beside(scene, fabrics, || {
            let mut coarser: Vec<Level> = Vec::new();
            for level in &self.coarser {
                let coarse = Arc::clone(&level.coarse);
                coarser.extend(Level::of(scene, coarser.last(), coarse, fabrics));
            }
            coarser
        })
    }

    fn beside(
        scene: &Scene,
        fabrics: &[Fabric],
        coarser: impl FnOnce() -> Vec<Level> + Send,
    ) -> Result<Self, EnergyError> {
        let Scene { garment, topology, rest, held, .. } = scene;
        let (cloth, coarser) = rayon::join(|| Cloth::new(garment, topology, rest, fabrics, held), coarser);
        Ok(Self { cloth: cloth?, coarser })
    }

    /// What the vertices of the level of this number (1: the first coarser one) have of those of the full garment.
    pub(crate) fn restrict<T: Copy>(&self, level: usize, full: &[T]) -> Vec<T> {
        self.coarser[..level].iter().fold(full.to_vec(), |x, l| l.coarse.restrict(&x))
    }

    /// Where the full garment goes from `from` when the level of this number goes to `to`.
    pub(crate) fn prolong(&self, level: usize, from: &[DVec3], to: Vec<DVec3>) -> Vec<DVec3> {
        (1..=level).rev().fold(to, |to, l| self.coarser[l - 1].coarse.prolong(&self.restrict(l - 1, from), &to))
    }

    /// PARTs of the full garment on a level.
    pub(crate) fn parts(&self, level: usize, parts: &Parts) -> Parts {
        let label = self.coarser[..level].iter().fold(parts.part_of_vertex.clone(), |p, l| l.coarse.restrict(&p));
        let level_of = |label: u32| if label == UNASSIGNED { 0 } else { parts.parts[label as usize].level };
        Parts::from_labels(&self.coarser[level - 1].coarse.topology, &label, level_of, parts.own_extent.clone(), 0)
    }
}

impl Level {
    fn below(scene: &Scene, above: Option<&Self>, fabrics: &[Fabric]) -> Option<Self> {
        let (mesh, rest) = above.map_or((&scene.garment, &scene.rest), |a| (&a.coarse.mesh, &a.coarse.rest));
        let count = mesh.vertex_count() / RATIO;
        if count < MIN_LEVEL_VERTICES {
            return None;
        }
        Self::of(scene, above, Arc::new(Coarse::new(mesh, rest, count)?), fabrics)
    }

    fn of(scene: &Scene, above: Option<&Self>, coarse: Arc<Coarse>, fabrics: &[Fabric]) -> Option<Self> {
        let held = above.map_or_else(|| scene.is_held(), |above| above.cloth.held.clone());
        let held: Vec<u32> = (0u32..).zip(coarse.restrict(&held)).filter(|h| h.1).map(|h| h.0).collect();
        let cloth = Cloth::new(&coarse.mesh, &coarse.topology, &coarse.rest, fabrics, &held).ok()?;
        Some(Self { coarse, cloth })
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        &self.coarse.mesh
    }

    /// Mean length of an edge, m.
    pub(super) fn edge_m(&self) -> f64 {
        let Topology { edges, .. } = &self.coarse.topology;
        let at = |v: u32| self.coarse.mesh.positions[v as usize];
        edges.iter().map(|&[a, b]| at(a).distance(at(b))).sum::<f64>() / edges.len().max(1) as f64
    }

    /// What is draped at this level.
    pub(crate) fn garment(&self) -> Garment<'_> {
        Garment { mesh: &self.coarse.mesh, topology: &self.coarse.topology, cloth: &self.cloth }
    }
}
