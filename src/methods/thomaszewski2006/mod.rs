//! \[21\] B. Thomaszewski, M. Wacker, W. Straßer: "A consistent bending model for cloth simulation with corotational
//! subdivision finite elements", SCA 2006, 107–116.
//!
//! Confirmed by the source: Loop subdivision finite elements, so that the displacement is C¹ and patches have twelve
//! control vertices; one-point quadrature; membrane and bending strains of a thin shell, corotated for each element by
//! a polar decomposition, so that each implicit step is one linear system; conjugate gradients.
//!
//! Our reading: where valences are not six, one subdivision step in place of Stam's eigenvectors, which at the one
//! quadrature point gives the same (`patch.rs`); boundaries by mirrored vertices; the fabric's orthotropic constants
//! ([`elements`]); backward Euler and block Jacobi ([`march`](super::implicit_euler)); lumped masses; penalty contact with
//! Coulomb friction at the control vertices, through this project's own body queries; damping by the air; the stiffness
//! of tension across the plane.
//!
//! The garment's vertices are the control vertices, and they are what is returned; the limit surface lies inside their
//! folds by an eighth of edge² over radius (a millimetre and a half where edges of 15 mm bend about 2 cm) and is shown
//! on request.
//!
//! Limits: cloth bears compression as it bears tension, so it buckles no finer than its mesh and holds up where it
//! cannot. Contact at the control vertices alone. One quadrature point does not see control vertices that zigzag about
//! a smooth surface: on coarse meshes, edges of 4 cm and more, they do, and the strain of the garment's own triangles
//! is then well over the surface's.

mod box_spline;
pub mod elements;
mod patch;
mod rest_patch;
mod strain;

use glam::DVec3;
use rayon::prelude::*;

use super::implicit_euler::{Course, Pacing, march};
use super::{
    MethodInput, Exhibit, MethodDrape, MethodError, MethodOutcome, ReferenceMethod, RestRule, Spectator, Stopwatch,
};
use elements::{Elements, Made};
use patch::{Around, Irregular, around_all, derivatives, limit_stencil};
use rest_patch::laid_flat;

/// The method's name.
pub(crate) const NAME: &str = "thomaszewski2006";

/// The method with its dials.
#[derive(Debug, Clone, Default)]
pub struct Thomaszewski2006 {
    /// How it is moved in time.
    pub pacing: Pacing,
    /// Whether the limit surface is to be shown.
    pub exhibit: bool,
}

impl ReferenceMethod for Thomaszewski2006 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn run(&self, dressing: &MethodInput<'_>, rule: &RestRule, onlooker: Spectator<'_>) -> MethodOutcome {
        let mut watch = Stopwatch::begin();
        let MethodInput { scene, fabric, cloth } = dressing;
        let around = watch.time("patches", || fans(dressing))?;
        let mut elements = watch.time("patches", || elements_of(dressing, &around))?;
        let mut body = watch.time("contact", || cloth.contacts_by_planes(&scene.body, &scene.garment.positions));
        let course = Course { method: NAME, pacing: &self.pacing, rule, friction: fabric.friction };
        let marched = march(dressing, course, (&mut elements, &mut body), watch, onlooker)?;
        let irregular = around.iter().filter(|a| a.ring.len() != if a.closed { 6 } else { 4 }).count();
        let of_patches = [("elements", elements.count() as u64), ("irregular vertices", irregular as u64)];
        let exhibits = if self.exhibit {
            let surface = scene.garment.with_positions(limit(&around, &marched.positions));
            vec![("limit surface", Exhibit::Surface(surface))]
        } else {
            Vec::new()
        };
        let counts = of_patches.into_iter().chain(marched.counts).collect();
        Ok(MethodDrape { counts, exhibits, ..marched })
    }
}

/// The fans of a garment's vertices.
fn fans(dressing: &MethodInput<'_>) -> Result<Vec<Around>, MethodError> {
    let scene = dressing.scene;
    around_all(&scene.garment, &scene.topology).map_err(|irregular| {
        let reason = match irregular {
            Irregular::Edge([a, b]) => {
                format!("the edge between vertices {} and {} has more than two triangles", a + 1, b + 1)
            }
            Irregular::Vertex(v) => format!("the triangles at vertex {} are no single fan", v + 1),
        };
        MethodError::unfit(NAME, format!("{reason}, so there is no subdivision surface"))
    })
}

/// The elements of a garment.
///
/// # Errors
/// [`MethodError::Unfit`] where the mesh has no limit surface, or the patch of a triangle folds over itself where it is
/// laid flat.
pub fn elements_of_garment(dressing: &MethodInput<'_>) -> Result<Elements, MethodError> {
    elements_of(dressing, &fans(dressing)?)
}

fn elements_of(dressing: &MethodInput<'_>, around: &[Around]) -> Result<Elements, MethodError> {
    let MethodInput { scene, fabric, cloth } = dressing;
    let made: Result<Vec<Made>, MethodError> = (0..scene.garment.triangles.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|t| {
            let flat = laid_flat(t, &scene.garment, &scene.rest, &scene.topology, around);
            let found = derivatives(scene.garment.triangles[t], around);
            let reason = || format!("the patch of triangle {} has no rest shape that lies flat", t + 1);
            let made = found.and_then(|found| rest_patch::element(&found, &flat));
            made.ok_or_else(|| MethodError::unfit(NAME, reason()))
        })
        .collect();
    Ok(Elements::new(&made?, cloth.vertex_count(), fabric))
}

/// The limit surface at the vertices.
fn limit(around: &[Around], x: &[DVec3]) -> Vec<DVec3> {
    let at = |(v, fan): (u32, &Around)| limit_stencil(v, fan).iter().map(|(w, share)| x[*w as usize] * *share).sum();
    (0u32..).zip(around).map(at).collect()
}
