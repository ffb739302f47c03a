//! Distances of a garment as placed, which no table changes.

use std::sync::Arc;

use crate::body::distance::SurfacePoint;
use crate::mechanics::coupled::Bands;
use crate::scene::{Scene, SceneError};

/// How far the garment as placed is from what it is over, and along itself. No table changes it.
#[derive(Debug, Clone)]
pub(crate) struct Distances {
    /// Closest points on it.
    pub(crate) surface: Vec<SurfacePoint>,
    /// Equation (1) takes the distance without its sign: a vertex inside is as far from the surface as one outside.
    pub(crate) unsigned_m: Vec<f64>,
    /// Along the cloth: bands of the PARTs of the last table.
    pub(crate) bands: Arc<Bands>,
}

impl Distances {
    pub(crate) fn of(scene: &Scene) -> Result<Self, SceneError> {
        Ok(Self::from_surface(scene.surface()?))
    }

    /// To the body, and what it wears.
    pub(super) fn to_body(scene: &Scene) -> Self {
        Self::from_surface(scene.body.nearest_all(&scene.garment.positions))
    }

    fn from_surface(surface: Vec<SurfacePoint>) -> Self {
        let unsigned_m = surface.iter().map(|s| s.signed_distance.abs()).collect();
        Self { surface, unsigned_m, bands: Arc::default() }
    }
}
