//! Small scenes for the methods.

use std::ops::ControlFlow;

use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::methods::{MethodDrape, MethodError, MethodInput, ReferenceMethod, RestRule};
use partwise::mesh::{RestShape, TriMesh};
use partwise::{DVec3, Scene};

use crate::fixtures::{far_away, flipped};

/// A rectangle over the sides `u` and `v` from the origin; its normal is v × u.
pub(crate) fn rectangle(u: DVec3, v: DVec3, nu: u32, nv: u32) -> TriMesh {
    flipped(crate::fixtures::rectangle(u, v, nu, nv))
}

/// Cloth that hangs free, its vertices `held` fixed.
pub(crate) fn hanging(garment: TriMesh, held: Vec<u32>) -> Scene {
    let rest = RestShape::from_edges(&garment).unwrap();
    Scene { held, ..Scene::new(far_away(), garment, rest) }
}

/// Drapes a scene by a method.
pub(crate) fn drape(
    method: &dyn ReferenceMethod,
    scene: &Scene,
    fabric: &Fabric,
    rule: &RestRule,
) -> Result<MethodDrape, MethodError> {
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, fabric, &scene.held)?;
    method.drape(&MethodInput { scene, fabric, cloth: &cloth }, rule, &mut |_| ControlFlow::Continue(()))
}

/// A rule strict enough for a comparison with a closed form.
pub(crate) const STILL: RestRule = RestRule { speed_m_per_s: 1e-5, over_s: 0.5, limit_s: 60.0 };
