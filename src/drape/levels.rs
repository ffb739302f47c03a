//! The garment at several resolutions: a drape goes from coarse to fine, so that full resolution is left to polish.
//!
//! Each level has a quarter of the vertices of the one before ([`Coarse`]). Source: nested iteration (Hackbusch: "Multi-Grid Methods and Applications", 1985).

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::mechanics::energy::{Cloth, EnergyError};
use crate::mesh::coarse::Coarse;
use crate::scene::Scene;

use super::settings::Settings;

/// Vertices of a level over those of the next coarser.
const RATIO: usize = 4;

/// The cloth of `scene` in the fabric of `settings`, for their solver, with these vertices held.
pub(super) fn cloth_of(scene: &Scene, settings: &Settings, held: &[u32]) -> Result<Cloth, EnergyError> {
    let Scene { garment, topology, rest, .. } = scene;
    let cloth = Cloth::new(garment, topology, rest, &scene.fabrics(&settings.fabric), held)?;
    Ok(cloth.with_solver(settings.solver))
}

/// A coarser garment.
#[derive(Debug)]
pub(crate) struct Level {
    coarse: Arc<Coarse>,
    cloth: Cloth,
}

/// The full garment's cloth and the coarser ones, fine to coarse. The coarser ones are made at the first use: stage two needs
/// none.
#[derive(Debug)]
pub(crate) struct Levels {
    pub(crate) cloth: Cloth,
    coarser: OnceLock<Vec<Level>>,
}

impl Levels {
    /// The cloth of `scene` in the fabric of `settings`, for their solver.
    pub(crate) fn new(scene: &Scene, settings: &Settings) -> Result<Self, EnergyError> {
        Ok(Self { cloth: cloth_of(scene, settings, &scene.held)?, coarser: OnceLock::new() })
    }

    /// The same garment in another fabric: how its coarser ones are meshed does not depend on it.
    pub(crate) fn recut(&self, scene: &Scene, settings: &Settings) -> Result<Self, EnergyError> {
        let levels = Self::new(scene, settings)?;
        if let Some(made) = self.coarser.get() {
            let mut coarser: Vec<Level> = Vec::new();
            for level in made {
                let coarse = Arc::clone(&level.coarse);
                coarser.extend(Level::of(scene, coarser.last(), coarse, &levels.cloth));
            }
            return Ok(Self { coarser: OnceLock::from(coarser), ..levels });
        }
        Ok(levels)
    }

    /// The coarser ones that are brought to rest first; `scene` is that of the full garment.
    pub(crate) fn coarser(&self, scene: &Scene) -> &[Level] {
        self.coarser.get_or_init(|| {
            let mut coarser: Vec<Level> = Vec::new();
            while let Some(next) = Level::below(scene, coarser.last(), &self.cloth) {
                coarser.push(next);
            }
            coarser
        })
    }

    /// The first of them, which have been made: there is a number for the last.
    fn made(&self, count: usize) -> &[Level] {
        self.coarser.get().map_or(&[], |coarser| &coarser[..count])
    }

    /// What the vertices of the level of this number (1: the first coarser one) have of those of the full garment.
    pub(crate) fn restrict<T: Copy>(&self, level: usize, full: &[T]) -> Vec<T> {
        self.made(level).iter().fold(full.to_vec(), |x, l| l.coarse.restrict(&x))
    }

    /// Where the full garment goes from `from` when the level of this number goes to `to`.
    pub(crate) fn prolong(&self, level: usize, from: &[DVec3], to: Vec<DVec3>) -> Vec<DVec3> {
        self.made(level)
            .iter()
            .enumerate()
            .rev()
            .fold(to, |to, (finer, l)| l.coarse.prolong(&self.restrict(finer, from), &to))
    }
}

impl Level {
    fn below(scene: &Scene, above: Option<&Self>, full: &Cloth) -> Option<Self> {
        let (mesh, rest) = above.map_or((&scene.garment, &scene.rest), |a| (&a.coarse.mesh, &a.coarse.rest));
        let count = mesh.vertex_count() / RATIO;
        if count < full.solver.nested_iteration.min_vertices {
            return None;
        }
        Self::of(scene, above, Arc::new(Coarse::new(mesh, rest, count)?), full)
    }

    fn of(scene: &Scene, above: Option<&Self>, coarse: Arc<Coarse>, full: &Cloth) -> Option<Self> {
        let held = above.map_or_else(|| scene.is_held(), |above| above.cloth.held.clone());
        let held: Vec<u32> = (0u32..).zip(coarse.restrict(&held)).filter(|h| h.1).map(|h| h.0).collect();
        let cloth = cloth_on(&coarse, full, &held)?;
        Some(Self { coarse, cloth })
    }

    /// Its cloth with nothing held, in the fabrics of the `full` one.
    pub(crate) fn released(&self, full: &Cloth) -> Option<Cloth> {
        cloth_on(&self.coarse, full, &[])
    }

    /// Its cloth.
    pub(crate) fn cloth(&self) -> &Cloth {
        &self.cloth
    }
}

/// The cloth of a coarser garment, in the fabrics of the `full` one.
fn cloth_on(coarse: &Coarse, full: &Cloth, held: &[u32]) -> Option<Cloth> {
    let cloth = Cloth::new(&coarse.mesh, &coarse.topology, &coarse.rest, &*full.fabrics, held).ok()?;
    Some(cloth.with_solver(full.solver))
}
