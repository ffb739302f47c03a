//! Garments placed around the dress form, undraped.
//!
//! A [`GarmentSpec`] (a few lengths and eases) becomes a surface around the form (`cloth`), which is contoured, clipped at its
//! openings (`opening`), remeshed to even triangles without a preferred diagonal, and flattened triangle by triangle for its
//! rest shape. Sleeves and bodice are one surface without a seam. Positions are metres in the frame of the form.
//!
//! # Rest shape
//! Each triangle is flattened in its own frame, x along the weft, y along the warp. The warp runs up the garment: along z on
//! bodice and skirt, along the arm on a sleeve, projected into the triangle; the weft is warp × n, so that weft × warp = n. On
//! the shoulders, where the projection of z is short, the weft is taken along x. Without fullness the flat triangle is congruent
//! to the placed one. With fullness φ an edge's weft component is s times as long, s = 1 + φ (z_top − z)/length at the edge's
//! middle z, and the three lengths make the flat triangle. Neighbouring triangles agree on the length of their common edge
//! exactly.

mod cloth;
mod opening;
mod spec;

use glam::{DVec2, DVec3};

use crate::body::contour::{CONVERGED, clip, contour, onto_edge, onto_surface};
use crate::body::dress_form::DressForm;
use crate::body::measures::{BodySpec, ShapeError};
use crate::mesh::remesh::{Density, Surface, remesh};
use crate::mesh::{RestShape, TriMesh};
use cloth::Cloth;
use opening::Opening;
pub use spec::{BUILT_IN, Ease, GarmentRequest, GarmentSpec, Neckline, Sleeves, Support, TABLE_4_SIZES};

/// Grid spacing of the contour, m: a fraction of the narrowest part, a strap or a sleeve.
const SPACING: f64 = 0.02;
/// Default number of vertices, about that of the paper's garments.
const DEFAULT_VERTICES: usize = 5_000;
/// Least and largest number of vertices.
const VERTEX_RANGE: [usize; 2] = [400, 1_000_000];

/// n_z² above which a triangle has its weft along x. A heuristic.
const LEVEL: f64 = 0.5;

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
    /// Vertices that keep their positions: a skirt's upper edge. Empty for garments that hang from the shoulders.
    pub held: Vec<u32>,
}

/// The clipped surface, for the remesher.
struct Cut<'a> {
    cloth: &'a Cloth<'a>,
    openings: &'a [Opening<'a>],
}

impl Surface for Cut<'_> {
    fn project(&self, p: DVec3, tag: u8) -> DVec3 {
        match self.openings.get(usize::from(tag).wrapping_sub(1)) {
            Some(opening) => onto_edge(self.cloth, |p| opening.at(p), p),
            None => onto_surface(self.cloth, p, CONVERGED),
        }
    }
}

/// The garment `spec` around the form of `body`; `vertices` overrides the number in the spec.
pub fn garment(spec: &GarmentSpec, body: &BodySpec, vertices: Option<usize>) -> Result<PlacedGarment, ShapeError> {
    garment_on(spec, &DressForm::new(body)?, vertices)
}

/// [`garment`] around an existing form.
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
        if found < VERTEX_RANGE[0] {
            return Err(ShapeError::TooFew { what, found, least: VERTEX_RANGE[0] });
        }
        if found > VERTEX_RANGE[1] {
            return Err(ShapeError::TooMany { what, found, most: VERTEX_RANGE[1] });
        }
    }
    let openings = Opening::all(spec, form, &cloth);
    let m = &form.measures;
    let reach = form.anatomy.arm.centre(form.anatomy.wrist_at + 0.05).x.max(0.5 + 0.002 * spec.flare_cm);
    let depth = 0.30 + 0.0020 * spec.flare_cm + 0.15 * m.hip.max(m.bust).max(m.waist);
    // The grid is off centre, so that left and right are meshed differently: a symmetric mesh would fold symmetrically.
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
    let arm = form.anatomy.arm.direction();
    let corners = flattened(
        &mesh,
        |t| {
            if ["sleeve", "cuffs"].contains(&mesh.groups[mesh.triangle_group[t] as usize].as_str()) {
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

/// Height at which the fullness starts, m: the waist of a skirt, the hip of a dress.
fn top_of_skirt(spec: &GarmentSpec, form: &DressForm) -> f64 {
    match spec.carried_by {
        Support::Waist => form.measures.waist_height,
        Support::Shoulders => form.measures.hip_height,
    }
}

/// Groups the triangles: by the opening they touch, else `body` or `sleeve`.
fn group(mesh: &mut TriMesh, tags: &[u8], openings: &[Opening<'_>], form: &DressForm, spec: &GarmentSpec) {
    mesh.groups = std::iter::once("body").chain(openings.iter().map(Opening::name)).map(str::to_owned).collect();
    let sleeve = mesh.groups.len() as u32;
    if spec.sleeves.is_some() {
        mesh.groups.push("sleeve".to_owned());
    }
    let arm = &form.anatomy.arm;
    // The sleeve starts where the arm leaves the chest: past the armpit, beyond the end of the shoulder.
    let root = arm.centre(0.03).x;
    mesh.triangle_group = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let tag = triangle.iter().map(|&v| tags[v as usize]).max().unwrap_or(0);
            if tag > 0 {
                return u32::from(tag);
            }
            let centroid = triangle.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0;
            let left = DVec3::new(centroid.x.abs(), centroid.y, centroid.z);
            let t = arm.along(left);
            let near = left.distance(arm.centre(t)) < 0.14;
            if spec.sleeves.is_some() && left.x > root && t > 0.03 && near { sleeve } else { 0 }
        })
        .collect();
}

/// The excess of the rest shape over the placed garment.
#[derive(Debug, Clone, Copy)]
struct Fullness {
    /// φ, excess width of the hem as a share.
    share: f64,
    /// Height at which it starts, m.
    top: f64,
    /// Height at which it is reached, m.
    hem: f64,
    /// Axis of the skirt: the weft runs around it.
    axis: DVec3,
}

/// The flat corners of every triangle, m. `up` is the warp direction of each triangle before projection.
fn flattened(mesh: &TriMesh, up: impl Fn(usize) -> DVec3, fullness: Fullness) -> Vec<[DVec2; 3]> {
    (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            let n = (b - a).cross(c - a).normalize_or_zero();
            let warp = if n.z * n.z > LEVEL {
                n.cross(DVec3::X).normalize_or_zero()
            } else {
                let d = up(t);
                (d - d.dot(n) * n).normalize_or_zero()
            };
            let weft = warp.cross(n);
            let flat = |p: DVec3| DVec2::new((p - a).dot(weft), (p - a).dot(warp));
            let placed = [DVec2::ZERO, flat(b), flat(c)];
            if fullness.share <= 0.0 {
                return placed;
            }
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| fullness.edge(p, q));
            // p₀ at the origin, p₁ along x, p₂ from the three lengths (law of cosines), rotated to the direction of the placed edge.
            let x = (ab * ab + ca * ca - bc * bc) / (2.0 * ab);
            let y = (ca * ca - x * x).max(0.0).sqrt();
            let s = fullness.stretch(0.5 * (a.z + b.z));
            let turn = DVec2::new(placed[1].x * s, placed[1].y).normalize_or(DVec2::X);
            [DVec2::ZERO, turn * ab, turn.rotate(DVec2::new(x, y))]
        })
        .collect()
}

impl Fullness {
    fn stretch(&self, z: f64) -> f64 {
        1.0 + self.share * ((self.top - z) / (self.top - self.hem)).clamp(0.0, 1.0)
    }

    /// Rest length of an edge.
    fn edge(&self, p: DVec3, q: DVec3) -> f64 {
        let middle = 0.5 * (p + q) - self.axis;
        let around = DVec3::new(-middle.y, middle.x, 0.0).normalize_or_zero();
        let (d, s) = (q - p, self.stretch(0.5 * (p.z + q.z)));
        (d.length_squared() + (s * s - 1.0) * d.dot(around).powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_without_fullness_are_congruent_and_with_it_wider() {
        let (a, b, c) = (DVec3::new(1.0, 0.0, 0.5), DVec3::new(1.0, 0.1, 0.5), DVec3::new(1.0, 0.0, 0.6));
        let mesh = TriMesh::new(vec![a, b, c], vec![[0, 1, 2]]);
        let none = Fullness { share: 0.0, top: 1.0, hem: 0.0, axis: DVec3::ZERO };
        let flat = flattened(&mesh, |_| DVec3::Z, none)[0];
        for (i, (p, q)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            assert!((flat[i].distance(flat[(i + 1) % 3]) - p.distance(q)).abs() < 1e-12);
        }
        // The warp runs up: the upper corner has the larger y; the winding stays.
        assert!(flat[2].y > flat[0].y + 0.09);
        assert!((flat[1] - flat[0]).perp_dot(flat[2] - flat[0]) > 0.0);
        let full = flattened(&mesh, |_| DVec3::Z, Fullness { share: 0.4, ..none })[0];
        // Half way down, 0.4 of fullness is 0.2: the horizontal edge grows by it (to the cosine of half its angle).
        assert!((full[0].distance(full[1]) - 0.12).abs() < 1e-4);
        assert!((full[0].distance(full[2]) - 0.1).abs() < 1e-12);
    }
}
