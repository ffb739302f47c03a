//! \[21\] B. Thomaszewski, M. Wacker, W. Straßer: "A consistent bending model for cloth simulation with corotational
//! subdivision finite elements", SCA 2006, 107–116.
//!
//! Confirmed by the source: Loop subdivision finite elements, so that the displacement is C¹ and patches have twelve
//! control vertices; one-point quadrature; membrane and bending strains of a thin shell, corotated for each element by
//! a polar decomposition, so that each implicit step is one linear system; conjugate gradients.
//!
//! Our reading: where valences are not six, one subdivision step in place of Stam's eigenvectors, which gives the same at the one
//! quadrature point (`patch.rs`); boundaries by mirrored vertices; the fabric's orthotropic constants
//! ([`elements`]); backward Euler and block Jacobi ([`integrate`](super::implicit_euler)); lumped masses; penalty contact with
//! Coulomb friction at the control vertices, by this project's own distance; damping by the air; the stiffness
//! of tension out of the plane.
//!
//! The garment's vertices are the control vertices, and the result is their positions. The limit surface lies inside their
//! folds by an eighth of edge² over radius (1.5 mm for edges of 15 mm at a radius of 2 cm) and is an exhibit.
//!
//! Limits: cloth has the same stiffness in compression as in tension, so it buckles no finer than its mesh and otherwise carries
//! compression that real cloth cannot. Contact is at the control vertices alone. Zigzags of control vertices about a smooth surface
//! are invisible to the one quadrature point; on meshes with edges of 4 cm and more they occur, and the strain of the garment's own
//! triangles then exceeds the surface's by far.

pub mod elements;
mod patch;
mod rest_patch;

use glam::DVec3;
use rayon::prelude::*;

use super::implicit_euler::{EulerSettings, Integration, integrate};
use super::method::{
    Exhibit, MethodDrape, MethodError, MethodInput, MethodOutcome, Observer, ReferenceMethod, RestRule, Stopwatch,
};
use elements::{Element, Elements};
use patch::{Irregular, VertexFan, all_fans, derivatives, limit_stencil};
use rest_patch::flattened;

/// The method's name.
pub(crate) const NAME: &str = "thomaszewski2006";

/// The method with its parameters.
#[derive(Debug, Clone, Default)]
pub struct Thomaszewski2006 {
    /// Time step, damping and accuracy.
    pub settings: EulerSettings,
    /// Whether to return the limit surface.
    pub exhibit: bool,
}

impl ReferenceMethod for Thomaszewski2006 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn run(&self, input: &MethodInput<'_>, rule: &RestRule, observer: Observer<'_>) -> MethodOutcome {
        let mut watch = Stopwatch::begin();
        let MethodInput { scene, fabric, cloth } = input;
        let fans = watch.time("patches", || fans(input))?;
        let mut elements = watch.time("patches", || elements_of(input, &fans))?;
        let mut body = watch.time("contact", || cloth.contacts_by_planes(&scene.body, &scene.garment.positions));
        let integration = Integration { method: NAME, settings: &self.settings, rule, friction: fabric.friction };
        let draped = integrate(input, integration, &mut elements, &mut body, watch, observer)?;
        let irregular = fans.iter().filter(|fan| fan.ring.len() != if fan.closed { 6 } else { 4 }).count();
        let of_patches = [("elements", elements.count() as u64), ("irregular vertices", irregular as u64)];
        let exhibits = if self.exhibit {
            let surface = scene.garment.with_positions(limit(&fans, &draped.positions));
            vec![("limit surface", Exhibit::Surface(surface))]
        } else {
            Vec::new()
        };
        let counts = of_patches.into_iter().chain(draped.counts).collect();
        Ok(MethodDrape { counts, exhibits, ..draped })
    }
}

/// The fans of a garment's vertices.
fn fans(input: &MethodInput<'_>) -> Result<Vec<VertexFan>, MethodError> {
    all_fans(&input.scene.garment, &input.scene.topology).map_err(|irregular| {
        let reason = match irregular {
            Irregular::Edge([a, b]) => {
                format!("the edge between vertices {} and {} has more than two triangles", a + 1, b + 1)
            }
            Irregular::Vertex(v) => format!("the triangles at vertex {} do not form a single fan", v + 1),
        };
        MethodError::unfit(NAME, format!("{reason}, so there is no subdivision surface"))
    })
}

/// The elements of a garment.
///
/// # Errors
/// [`MethodError::Unfit`] for a mesh without a limit surface, or a patch that folds over when flattened.
pub fn elements_of_garment(input: &MethodInput<'_>) -> Result<Elements, MethodError> {
    elements_of(input, &fans(input)?)
}

fn elements_of(input: &MethodInput<'_>, fans: &[VertexFan]) -> Result<Elements, MethodError> {
    let MethodInput { scene, fabric, cloth } = input;
    let elements: Result<Vec<Element>, MethodError> = (0..scene.garment.triangles.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|t| {
            let flat = flattened(t, &scene.garment, &scene.rest, &scene.topology, fans);
            let found = derivatives(scene.garment.triangles[t], fans);
            let reason = || format!("the patch of triangle {} has no flat rest shape", t + 1);
            let element = found.and_then(|found| rest_patch::element(&found, &flat));
            element.ok_or_else(|| MethodError::unfit(NAME, reason()))
        })
        .collect();
    Ok(Elements::new(&elements?, cloth.vertex_count(), fabric))
}

/// The limit surface at the vertices.
fn limit(fans: &[VertexFan], x: &[DVec3]) -> Vec<DVec3> {
    let at = |(v, fan): (u32, &VertexFan)| limit_stencil(v, fan).iter().map(|(w, share)| x[*w as usize] * *share).sum();
    (0u32..).zip(fans).map(at).collect()
}
