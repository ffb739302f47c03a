//! Garments placed around the dress form, undraped.
//!
//! A [`GarmentSpec`] (a few lengths and eases) becomes a surface around the form (`cloth`), which is contoured, cut at its
//! openings (`opening`), remeshed to even triangles without a preferred diagonal, and laid flat triangle by triangle for its rest shape (`flat`).
//! Sleeves and bodice are one surface, so there is no seam between them. Positions are metres in the frame of the form.

mod cloth;
mod flat;
mod opening;
pub mod spec;

use glam::DVec3;

use crate::body::ShapeError;
use crate::body::contour::contour;
use crate::body::cut::{CLOSE, clip, onto_edge, onto_surface};
use crate::body::dress_form::DressForm;
use crate::body::measures::BodySpec;
use crate::mesh::remesh::{Density, Surface, remesh};
use crate::mesh::{RestShape, TriMesh};
use cloth::Cloth;
use flat::{Fullness, lay_flat};
use opening::Opening;
pub use spec::{BUILT_IN, Ease, GarmentRequest, GarmentSpec, Neckline, Sleeves, Support, TABLE_4_SIZES};

/// Spacing of the first contour, m: a fraction of the narrowest part, a strap or a sleeve.
const SPACING: f64 = 0.02;
/// Vertices of a garment whose spec names neither a number nor an edge length: about that of the paper's.
const DEFAULT_VERTICES: usize = 5_000;
/// A garment has at least and at most so many vertices.
const LIMITS: [usize; 2] = [400, 1_000_000];

/// A garment around the form, not yet draped.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedGarment {
    /// Its name.
    pub name: String,
    /// The mesh, m, in groups: `hem`, `neckline`, `waistband`, `cuffs`, `armholes` along the openings, else `body` or
    /// `sleeve`.
    pub mesh: TriMesh,
    /// Each triangle laid flat, m: x along the weft, y along the warp, up the garment and up the sleeve.
    pub rest: RestShape,
    /// Vertices that stay where they are worn: a skirt's upper edge. Empty where the shoulders carry.
    pub held: Vec<u32>,
}

/// The surface the remesher works on.
struct Cut<'a> {
    cloth: &'a Cloth<'a>,
    openings: &'a [Opening<'a>],
}

impl Surface for Cut<'_> {
    fn project(&self, p: DVec3, tag: u8) -> DVec3 {
        match self.openings.get(usize::from(tag).wrapping_sub(1)) {
            Some(opening) => onto_edge(self.cloth, |p| opening.at(p), p),
            None => onto_surface(self.cloth, p, CLOSE),
        }
    }
}

/// The garment `spec` around the form of `body`, with `vertices` of them if that is given.
pub fn garment(spec: &GarmentSpec, body: &BodySpec, vertices: Option<usize>) -> Result<PlacedGarment, ShapeError> {
    garment_on(spec, &DressForm::new(body)?, vertices)
}

/// [`garment`] around a form that is made already.
pub fn garment_on(spec: &GarmentSpec, form: &DressForm, vertices: Option<usize>) -> Result<PlacedGarment, ShapeError> {
    spec.check()?;
    let cloth = Cloth::new(spec, form);
    if cloth.hem < 0.05 {
        let most = spec.length_cm + 100.0 * cloth.hem - 5.0;
        return Err(ShapeError::Length { name: "length_cm", found: spec.length_cm, low: 15.0, high: most.floor() });
    }
    let density = match (vertices, spec.edge_length_cm, spec.vertices) {
        (Some(count), ..) | (None, None, Some(count)) => Density::Vertices(count),
        (None, Some(cm), _) => Density::EdgeLength(cm / 100.0),
        (None, None, None) => Density::Vertices(DEFAULT_VERTICES),
    };
    if let Density::Vertices(found) = density {
        let what = "vertices of the garment";
        if found < LIMITS[0] {
            return Err(ShapeError::TooFew { what, found, least: LIMITS[0] });
        }
        if found > LIMITS[1] {
            return Err(ShapeError::TooMany { what, found, most: LIMITS[1] });
        }
    }
    let openings = Opening::all(spec, form, &cloth);
    let m = &form.measures;
    let reach = form.anatomy.arm.centre(form.anatomy.wrist_at + 0.05).x.max(0.5 + 0.002 * spec.flare_cm);
    let depth = 0.30 + 0.0020 * spec.flare_cm + 0.15 * m.hip.max(m.bust).max(m.waist);
    // The grid is off centre, so that left and right are not meshed alike: an even mesh would fold evenly.
    let low = DVec3::new(-reach - 0.0073, -depth - 0.0031, cloth.hem - 0.045);
    let high =
        DVec3::new(reach, depth, if spec.carried_by == Support::Waist { cloth.top + 0.03 } else { cloth.top + 0.1 });
    let mut mesh = contour(&cloth, low, high, SPACING);
    let mut tags = vec![0; mesh.positions.len()];
    for (i, opening) in openings.iter().enumerate() {
        (mesh, tags) = clip(&mesh, &tags, |p| opening.at(p).value, i as u8 + 1);
    }
    let surface = Cut { cloth: &cloth, openings: &openings };
    let (mut mesh, tags) = remesh(&mesh, tags, &surface, density).ok_or(ShapeError::NotManifold { what: "garment" })?;
    group(&mut mesh, &tags, &openings, form, spec);
    let fullness = Fullness {
        share: spec.fullness,
        top: top_of_skirt(spec, form),
        hem: cloth.hem,
        axis: cloth.centre(m.waist_height),
    };
    let sleeve = mesh.groups.iter().position(|g| g == "sleeve").map(|g| g as u32);
    let arm = form.anatomy.arm.direction();
    let corners = lay_flat(
        &mesh,
        |t| {
            let cuff = mesh.groups[mesh.triangle_group[t] as usize] == "cuffs";
            if Some(mesh.triangle_group[t]) == sleeve || cuff {
                let side = mesh.corners(t).iter().map(|p| p.x).sum::<f64>().signum();
                -arm * DVec3::new(side, 1.0, 1.0)
            } else {
                DVec3::Z
            }
        },
        fullness,
    );
    let waistband = openings.iter().position(|o| matches!(o, Opening::Waistband(_))).map(|i| i as u8 + 1);
    let held = (0..tags.len() as u32).filter(|&v| Some(tags[v as usize]) == waistband).collect();
    Ok(PlacedGarment { name: spec.name.clone(), mesh, rest: RestShape::new(corners), held })
}

/// Where a skirt's fullness begins, m: at the waist, or at a dress's hip.
fn top_of_skirt(spec: &GarmentSpec, form: &DressForm) -> f64 {
    match spec.carried_by {
        Support::Waist => form.measures.waist_height,
        Support::Shoulders => form.measures.hip_height,
    }
}

/// Names each triangle: by the opening it touches, else `body` or `sleeve`.
fn group(mesh: &mut TriMesh, tags: &[u8], openings: &[Opening<'_>], form: &DressForm, spec: &GarmentSpec) {
    mesh.groups = std::iter::once("body").chain(openings.iter().map(Opening::name)).map(str::to_owned).collect();
    let sleeve = mesh.groups.len() as u32;
    if spec.sleeves.is_some() {
        mesh.groups.push("sleeve".to_owned());
    }
    let arm = &form.anatomy.arm;
    // The sleeve begins where the arm leaves the chest: past the armpit, beyond the end of the shoulder.
    let root = arm.centre(0.03).x;
    mesh.triangle_group = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let tag = triangle.iter().map(|&v| tags[v as usize]).max().unwrap_or(0);
            if tag > 0 {
                return u32::from(tag);
            }
            let middle = triangle.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0;
            let left = DVec3::new(middle.x.abs(), middle.y, middle.z);
            let t = arm.along(left);
            let near = left.distance(arm.centre(t)) < 0.14;
            if spec.sleeves.is_some() && left.x > root && t > 0.03 && near { sleeve } else { 0 }
        })
        .collect();
}
