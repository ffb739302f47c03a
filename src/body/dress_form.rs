//! The dress form as a mesh.
//!
//! The solid of `anatomy` is contoured, remeshed to triangles of even shape that are smaller where limbs are thin, and corrected
//! until its girths are those requested. The figure stands on z = 0, looks along −y, its left is +x. Lengths in metres.
//!
//! # Girths
//! Rays from the centre of a section are followed to the surface by Newton's method on the field; the tape's length is the
//! perimeter of the convex hull of their ends. Each girth has one factor on its radius, multiplied by requested/found until all
//! agree; neighbouring girths hardly influence each other, so a few rounds suffice. The mesh's chords are a little shorter than
//! the solid's curves, so the same correction is repeated with girths measured on the mesh.

use glam::{DVec2, DVec3};

use super::anatomy::{Anatomy, Factors, ankle_height, calf_height, thigh_height, underbust_height};
use super::contour::{contour, onto_surface};
use super::girth::{Plane, hull_length, loop_around};
use super::measures::ShapeError;
pub use super::measures::{BodySpec, Measures};
use super::solid::{Solid, Sweep};
use crate::base::math;
use crate::mesh::TriMesh;
use crate::mesh::remesh::{Density, Surface, remesh};

/// Default number of triangles.
pub(crate) const DEFAULT_TRIANGLES: usize = 15_000;
/// Grid spacing of the contour, m: a quarter of the thinnest part, a hand.
const SPACING: f64 = 0.012;
/// Length, m, below which a Newton step onto the surface is the last.
const CONVERGED: f64 = 1e-7;
/// Rounds of correction with girths measured on the mesh.
const MESH_ROUNDS: usize = 2;

/// Rays per girth; their polygon in a circle is shorter by (π/N)²/6 = 0.04 %.
const RAYS: usize = 64;
/// Rounds of correction on the solid; each reduces the error about tenfold.
const SOLID_ROUNDS: usize = 7;

/// A form that can be meshed and dressed.
#[derive(Debug, Clone)]
pub struct DressForm {
    /// Its measurements.
    pub measures: Measures,
    /// Its solid.
    pub(crate) anatomy: Anatomy,
}

impl DressForm {
    /// The solid whose girths are those of `spec`.
    pub fn new(spec: &BodySpec) -> Result<Self, ShapeError> {
        let measures = spec.measures()?;
        let factors: Factors = fit(&measures, &[1.0; 11]);
        let anatomy = Anatomy::new(&measures, &factors);
        let Anatomy { trunk, neck, arm, leg, .. } = &anatomy;
        if ![trunk, neck, arm, leg].into_iter().all(Sweep::ascends) {
            return Err(ShapeError::NotManifold { what: "body" });
        }
        Ok(Self { measures, anatomy })
    }

    /// The planes and requested lengths of all girths.
    #[must_use]
    pub fn girths(&self) -> [GirthMark; 11] {
        girth_marks(&self.measures, &self.anatomy)
    }

    /// A closed mesh of about `triangles` triangles (rounded to an even number).
    ///
    /// # Errors
    /// [`ShapeError::TooFew`] under 2,000 triangles, [`ShapeError::NotManifold`] if the surface cannot be meshed.
    pub fn mesh(&self, triangles: usize) -> Result<TriMesh, ShapeError> {
        if triangles < 2_000 {
            return Err(ShapeError::TooFew { what: "triangles of the body", found: triangles, least: 2_000 });
        }
        let m = &self.measures;
        let reach = self.anatomy.arm.centre(self.anatomy.wrist_at + 0.25 * m.scale()).x;
        let depth = 0.18 * m.scale() + 0.3 * m.bust.max(m.waist).max(m.hip) / 2.0;
        let (low, high) = (DVec3::new(-reach, -depth, -0.03), DVec3::new(reach, depth, m.stature + 0.04));
        let rough = contour(&self.anatomy, low, high, SPACING);
        let tags = vec![0; rough.positions.len()];
        // A closed surface of genus 0 has F = 2 (V − 2).
        let density = Density::Vertices(triangles / 2 + 2);
        let (mut mesh, _) = remesh(&rough, tags, self, density).ok_or(ShapeError::NotManifold { what: "body" })?;
        self.correct(&mut mesh);
        Ok(mesh)
    }

    /// Moves the vertices onto a solid that is corrected by the girths of the mesh.
    fn correct(&self, mesh: &mut TriMesh) {
        let mut bias = [1.0; 11];
        for _ in 0..MESH_ROUNDS {
            for (bias, mark) in bias.iter_mut().zip(self.girths()) {
                if let Some(found) = loop_around(mesh, mark.plane) {
                    *bias *= (mark.requested / found.tape_length()).clamp(0.95, 1.05);
                }
            }
            let corrected = Anatomy::new(&self.measures, &fit(&self.measures, &bias));
            for p in &mut mesh.positions {
                *p = onto_surface(&corrected, *p, CONVERGED);
            }
        }
    }
}

/// Finer at wrists, hands, ankles, head, crotch and armpits than on the trunk.
impl Surface for DressForm {
    fn project(&self, p: DVec3, _tag: u8) -> DVec3 {
        onto_surface(&self.anatomy, p, CONVERGED)
    }

    fn relative_size(&self, p: DVec3) -> f64 {
        let (m, Anatomy { arm, leg, trunk, wrist_at, .. }) = (&self.measures, &self.anatomy);
        let scale = m.scale();
        // From shoulder to wrist the radius halves, and the edge length with it; similarly towards the feet.
        let mirrored = DVec3::new(p.x.abs(), p.y, p.z);
        let t = arm.along(mirrored) / wrist_at;
        let off_axis = (mirrored - arm.centre(t * wrist_at)).length();
        let on_arm = 1.0 - smooth_step(0.10, 0.16, off_axis / scale);
        let arm = 1.0 - 0.52 * on_arm * smooth_step(0.1, 0.95, t);
        let ankle = 1.0 - 0.35 * (1.0 - smooth_step(0.15, 0.6, p.z / scale));
        let head = 1.0 - 0.15 * smooth_step(-0.05, 0.0, p.z - (m.stature - 0.2 * scale));
        // Crotch and armpits are saddles narrower than an edge of the trunk.
        let crotch = DVec3::new(0.0, leg.centre(m.crotch_height).y, m.crotch_height);
        let pit = trunk.centre(m.axilla_height) + trunk.section(m.axilla_height)[2] * DVec3::X;
        let saddle =
            |at: DVec3, finer: f64| 1.0 - finer * (1.0 - smooth_step(0.03, 0.12, mirrored.distance(at) / scale));
        let saddle = saddle(crotch, 0.55).min(saddle(pit, 0.4));
        arm.min(ankle).min(head).min(saddle)
    }
}

fn smooth_step(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The dress form of these measurements, closed, about `DEFAULT_TRIANGLES` triangles.
pub fn dress_form(spec: &BodySpec) -> Result<TriMesh, ShapeError> {
    DressForm::new(spec)?.mesh(DEFAULT_TRIANGLES)
}

/// A girth of the body: its plane and its requested length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GirthMark {
    /// The measurement's name, as in [`BodySpec`] without `_cm`.
    pub name: &'static str,
    /// Its plane; the origin is the section's centre.
    pub plane: Plane,
    /// Requested length, m.
    pub requested: f64,
}

/// Every girth of the form, trunk first, then limbs downward; limbs are the left ones.
pub(super) fn girth_marks(m: &Measures, form: &Anatomy) -> [GirthMark; 11] {
    let across = |name, sweep: &Sweep, at: f64, normal, requested| {
        let plane = Plane { origin: sweep.centre(at), normal };
        GirthMark { name, plane, requested }
    };
    let trunk = |name, z, requested| across(name, &form.trunk, z, DVec3::Z, requested);
    let leg = |name, z, requested| across(name, &form.leg, z, DVec3::Z, requested);
    let arm = |name, t, requested| across(name, &form.arm, t, form.arm.direction(), requested);
    [
        trunk("bust", m.bust_height, m.bust),
        trunk("underbust", underbust_height(m), m.underbust),
        trunk("waist", m.waist_height, m.waist),
        trunk("hip", m.hip_height, m.hip),
        across("neck", &form.neck, form.neck_at, form.neck.direction(), m.neck),
        leg("thigh", thigh_height(m), m.thigh),
        leg("knee", m.knee_height, m.knee),
        leg("calf", calf_height(m), m.calf),
        leg("ankle", ankle_height(m), m.ankle),
        arm("biceps", form.biceps_at, m.biceps),
        arm("wrist", form.wrist_at, m.wrist),
    ]
}

/// Tape girth of the section of a solid by `plane` around the plane's origin, m.
fn solid_girth(solid: &dyn Solid, plane: Plane, guess: f64) -> f64 {
    let [u, v] = plane.axes();
    let points = (0..RAYS)
        .map(|i| {
            let (sin, cos) = math::sin_cos(std::f64::consts::TAU * i as f64 / RAYS as f64);
            DVec2::new(cos, sin) * ray(solid, plane.origin, cos * u + sin * v, guess)
        })
        .collect();
    hull_length(points)
}

/// Distance from `origin`, inside, along `direction` to the surface, m.
pub(crate) fn ray(solid: &dyn Solid, origin: DVec3, direction: DVec3, guess: f64) -> f64 {
    let mut r = guess;
    // Newton steps of at most 0.3 of the guess, so that a small slope does not lead onto another limb.
    for _ in 0..40 {
        let at = solid.at(origin + r * direction);
        let slope = at.gradient.dot(direction).max(0.25);
        let step = (-at.value / slope).clamp(-0.3 * guess, 0.3 * guess);
        r = (r + step).max(0.1 * guess);
        if step.abs() < 1e-6 {
            break;
        }
    }
    r
}

/// The factors at which the solid has the requested girths times `bias`.
fn fit(m: &Measures, bias: &Factors) -> Factors {
    let mut factors = [1.0; 11];
    for _ in 0..SOLID_ROUNDS {
        let form = Anatomy::new(m, &factors);
        let marks = girth_marks(m, &form);
        for ((factor, mark), bias) in factors.iter_mut().zip(&marks).zip(bias) {
            let found = solid_girth(&form, mark.plane, 0.8 * mark.requested / std::f64::consts::TAU);
            *factor *= (bias * mark.requested / found).clamp(0.7, 1.4);
        }
    }
    factors
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn any_value_of_any_measurement_is_meshed_or_refused() {
        let names = toml::Table::try_from(BodySpec::default()).unwrap().keys().cloned().collect::<Vec<_>>();
        let optional = ["shoulder_length", "arm_length", "cervicale_height", "acromion_height", "axilla_height"];
        let heights = ["bust_height", "waist_height", "hip_height", "crotch_height", "knee_height"];
        let names: Vec<&str> =
            names.iter().map(|name| name.trim_end_matches("_cm")).chain(optional).chain(heights).collect();
        assert_eq!(names.len(), 22);
        // The ends of the ranges come out of the refusals.
        let ends = |name: &str| match BodySpec::default().with(name, f64::NAN).unwrap().measures() {
            Err(ShapeError::Measurement { low_cm, high_cm, .. }) => [low_cm, high_cm],
            other => panic!("{name}: {other:?}"),
        };
        let mut cases: Vec<(f64, &str, f64)> =
            vec![(168.0, "crotch_height", 49.0), (220.0, "arm_length", 28.1), (220.0, "knee_height", 23.3)];
        for &name in &names {
            for cm in [0.0, -1.0, 1e-300, 1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(BodySpec::default().with(name, cm).unwrap().measures().is_err(), "{name} = {cm}");
            }
            let [low, high] = ends(name);
            cases.extend([low, high].map(|cm| (168.0, name, cm)));
        }
        cases.par_iter().for_each(|&(stature, name, cm)| {
            let spec = BodySpec { stature_cm: stature, ..BodySpec::default() }.with(name, cm).unwrap();
            let Ok(mesh) = DressForm::new(&spec).and_then(|form| form.mesh(2_000)) else { return };
            let known = |v: &u32| (*v as usize) < mesh.positions.len();
            assert!(mesh.triangles.iter().flatten().all(known), "{name} = {cm} at {stature}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{name} = {cm} at {stature}");
        });
        let refused = DressForm::new(&BodySpec::default().with("crotch_height", 49.0).unwrap()).unwrap_err();
        assert!(refused.to_string().contains("expected 12 cm or more above knee_height"), "{refused}");
    }
}
