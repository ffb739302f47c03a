//! The flat pieces of a garment, the part of the body that each covers, and their place on its bounding surface.
//!
//! A sewing pattern has its panels; a garment without seams is [`cut`](super::cut). A piece belongs to the limb that most of its
//! vertices are nearest to, else to the trunk together with the parts of limbs below it.
//!
//! All pieces are laid at once and without stretch. In the plane of the unrolled surface a piece is moved rigidly to the least squares
//! fit to the placed garment: min Σ |R p + t − q|² over its vertices, p flat, q the unrolled projection of the placed vertex
//! (Procrustes in the plane, in closed form). Then it is rolled back, and no length on the cloth changes.
//!
//! Source: Groß, Fuhrmann, Luckas 2003, as far as described: pieces are laid isometrically and simultaneously, on a part of the body
//! and by feature points of body and piece that the user gives. Both rules here are ours.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::developable::Developable;
use crate::base::quantiles::{extremes, nearest_rank};
use crate::garment::pattern::SewnGarment;
use crate::mechanics::methods::method::{MethodError, MethodInput};
use crate::mechanics::methods::segment::{Segments, principal_axis};
use crate::mesh::{RestShape, TriMesh};

/// The method's name.
pub(crate) const NAME: &str = "gross2003";

/// Share of a piece's vertices nearest to a limb above which it belongs to the limb. A heuristic.
const LIMB_SHARE: f64 = 0.5;
/// Share of a part's vertices nearest to a unit above which the part's surface bounds the unit. A heuristic.
const BOUNDED_SHARE: f64 = 0.1;

/// One piece of cloth.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// The garment's vertex of each of the piece's vertices.
    pub vertices: Vec<u32>,
    /// Their flat positions, m.
    pub flat: Vec<DVec2>,
    /// Its triangles, by its own vertices.
    pub triangles: Vec<[u32; 3]>,
    /// The garment's number of each triangle.
    pub of_garment: Vec<u32>,
}

/// A part of the body with the pieces that cover it.
#[derive(Debug, Clone)]
pub struct BodyPart {
    /// The pieces, by number.
    pub pieces: Vec<usize>,
    /// Direction of the part's axis, upwards.
    pub axis: DVec3,
    /// The vertices of the body that its surface must bound, m.
    pub points: Vec<DVec3>,
}

pub(super) fn unfit(reason: impl Into<String>) -> MethodError {
    MethodError::unfit(NAME, reason)
}

/// The panels of a pattern.
///
/// # Errors
/// [`MethodError::Unfit`] for a garment made from another pattern.
pub fn of_pattern(sewn: &SewnGarment, garment: &TriMesh) -> Result<Vec<Piece>, MethodError> {
    if sewn.mesh.triangles.len() != garment.triangles.len() {
        return Err(unfit("the garment was not made from this pattern"));
    }
    let mut pieces = Vec::new();
    for (number, panel) in sewn.panels.iter().enumerate() {
        let name = sewn.mesh.groups.get(number).cloned().unwrap_or_default();
        let mut local = vec![u32::MAX; garment.vertex_count()];
        (0u32..).zip(&panel.vertices).for_each(|(i, &v)| local[v as usize] = i);
        let own = (0u32..).zip(&sewn.mesh.triangle_group).filter(|(_, group)| **group as usize == number);
        let of_garment: Vec<u32> = own.map(|(t, _)| t).collect();
        // A dart sews a panel to itself, so a vertex may occur twice; the flat position selects the corner.
        let corner = |v: u32, at: DVec2| {
            let same = |i: &usize| panel.vertices[*i] == v && panel.flat[*i].distance_squared(at) < 1e-18;
            if panel.flat[local[v as usize] as usize] == at {
                local[v as usize]
            } else {
                (0..panel.vertices.len()).find(same).map_or(local[v as usize], |i| i as u32)
            }
        };
        let triangle = |&t: &u32| {
            let (corners, places) = (garment.triangles[t as usize], sewn.flat[t as usize]);
            [0, 1, 2].map(|k| corner(corners[k], places[k]))
        };
        let triangles = of_garment.iter().map(triangle).collect();
        let (vertices, flat) = (panel.vertices.clone(), panel.flat.clone());
        pieces.push(Piece { name, vertices, flat, triangles, of_garment });
    }
    Ok(pieces)
}

/// 95th percentile and maximum of the relative difference between the edge lengths of flat pieces and rest shape.
#[must_use]
pub fn distortion(pieces: &[Piece], rest: &RestShape) -> [f64; 2] {
    let mut off: Vec<f64> = Vec::new();
    for piece in pieces {
        for (triangle, &t) in piece.triangles.iter().zip(&piece.of_garment) {
            let (own, corners) = (triangle.map(|v| piece.flat[v as usize]), rest.corners[t as usize]);
            off.extend((0..3).map(|i| {
                let j = (i + 1) % 3;
                (own[i].distance(own[j]) / corners[i].distance(corners[j]) - 1.0).abs()
            }));
        }
    }
    [nearest_rank(&off, 0.95), off.iter().copied().fold(0.0, f64::max)]
}

/// The principal axis of a limb, upwards. The upper third is left out: it joins the trunk, and its segmentation differs between left
/// and right.
fn limb_axis(points: &[DVec3]) -> DVec3 {
    let along = |points: &[DVec3]| {
        let mean = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let axis = principal_axis(points.iter().map(|p| (*p - mean, 1.0)));
        if axis.z < 0.0 { -axis } else { axis }
    };
    let first = along(points);
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.dot(first).total_cmp(&b.dot(first)));
    let (low, high) = match sorted.as_slice() {
        [low, .., high] => (low.dot(first), high.dot(first)),
        _ => return first,
    };
    sorted.retain(|p| p.dot(first) < low + (high - low) * 2.0 / 3.0);
    along(&sorted)
}

/// The parts of the body that the pieces cover.
///
/// # Errors
/// [`MethodError::Unfit`] for a body that is not closed.
pub fn parts(input: &MethodInput<'_>, pieces: &[Piece]) -> Result<Vec<BodyPart>, MethodError> {
    let (scene, body) = (input.scene, input.scene.body.mesh());
    let segments = Segments::of_closed(body, "part").map_err(unfit)?;
    let count = segments.is_limb.len();
    let unit = |t: u32| segments.of_triangle[t as usize] as usize;
    let nearest: Vec<usize> =
        scene.body.nearest_all(&scene.garment.positions).iter().map(|near| unit(near.triangle)).collect();
    let shares = |vertices: &mut dyn Iterator<Item = u32>| {
        let mut found = vec![0usize; count];
        vertices.for_each(|v| found[nearest[v as usize]] += 1);
        let all = found.iter().sum::<usize>().max(1) as f64;
        found.into_iter().map(|n| n as f64 / all).collect::<Vec<f64>>()
    };
    // Indexed by limb; the trunk comes last.
    let mut of_part = vec![Vec::new(); count + 1];
    for (number, piece) in pieces.iter().enumerate() {
        let own = shares(&mut piece.vertices.iter().copied());
        let limb = (0..count).find(|&u| segments.is_limb[u] && own[u] > LIMB_SHARE);
        of_part[limb.unwrap_or(count)].push(number);
    }
    let taken: Vec<bool> = of_part.iter().map(|pieces| !pieces.is_empty()).collect();
    let mut all = Vec::new();
    for (limb, of) in of_part.into_iter().enumerate().filter(|(_, of)| !of.is_empty()) {
        let own = shares(&mut of.iter().flat_map(|&p| pieces[p].vertices.iter().copied()));
        // The trunk's surface does not bound a limb that has pieces.
        let bounded = |u: usize| u == limb || (own[u] > BOUNDED_SHARE && !(segments.is_limb[u] && taken[u]));
        let mut inside = vec![false; body.vertex_count()];
        for (triangle, &u) in body.triangles.iter().zip(&segments.of_triangle) {
            if bounded(u as usize) {
                triangle.iter().for_each(|&v| inside[v as usize] = true);
            }
        }
        let points: Vec<DVec3> = body.positions.iter().zip(inside).filter(|(_, i)| *i).map(|(p, _)| *p).collect();
        let axis = if limb < count { limb_axis(&points) } else { DVec3::Z };
        let vertices = of.iter().flat_map(|&p| &pieces[p].vertices);
        let (low, high) = extremes(vertices.map(|&v| scene.garment.positions[v as usize].dot(axis)));
        let under = points.into_iter().filter(|p| (low..=high).contains(&p.dot(axis))).collect();
        all.push(BodyPart { pieces: of, axis, points: under });
    }
    Ok(all)
}

/// Positions of a piece's vertices on the surface, m.
fn lay(piece: &Piece, surface: &Developable, placed: &[DVec3]) -> Vec<DVec3> {
    let at = |v: &u32| placed[*v as usize];
    let mean = piece.vertices.iter().map(at).sum::<DVec3>() / piece.vertices.len().max(1) as f64;
    let origin = surface.arc_at(mean);
    let to: Vec<DVec2> = piece.vertices.iter().map(|v| surface.unrolled(at(v), origin)).collect();
    // A panel that the file draws from its wrong side must be mirrored.
    let mirrored: Vec<DVec2> = piece.flat.iter().map(|p| DVec2::new(-p.x, p.y)).collect();
    let (own, over) = (rigid_fit(&piece.flat, &to), rigid_fit(&mirrored, &to));
    let off = |x: &[DVec2]| x.iter().zip(&to).map(|(x, to)| x.distance_squared(*to)).sum::<f64>();
    let best = if off(&own) <= off(&over) { own } else { over };
    best.into_iter().map(|p| surface.rolled(p, origin)).collect()
}

/// Points moved rigidly to the least squares fit to others.
fn rigid_fit(from: &[DVec2], to: &[DVec2]) -> Vec<DVec2> {
    let n = from.len().max(1) as f64;
    let mean = |points: &[DVec2]| points.iter().sum::<DVec2>() / n;
    let (a, b) = (mean(from), mean(to));
    let pairs = || from.iter().zip(to).map(|(p, q)| (*p - a, *q - b));
    let (cos, sin) = pairs().fold((0.0, 0.0), |(c, s), (p, q)| (c + p.dot(q), s + p.perp_dot(q)));
    let turn = DVec2::new(cos, sin).normalize_or(DVec2::X);
    from.iter().map(|p| b + turn.rotate(*p - a)).collect()
}

/// All pieces, each on the surface of its body part, m.
#[must_use]
pub fn lay_all(pieces: &[Piece], parts: &[BodyPart], surfaces: &[Developable], placed: &[DVec3]) -> Vec<Vec<DVec3>> {
    let surface = |number: usize| parts.iter().position(|part| part.pieces.contains(&number)).map(|i| &surfaces[i]);
    let own = |piece: &Piece| piece.vertices.iter().map(|&v| placed[v as usize]).collect();
    pieces
        .par_iter()
        .enumerate()
        .map(|(number, piece)| surface(number).map_or_else(|| own(piece), |s| lay(piece, s, placed)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_cut_from_a_cylinder_returns_to_its_place() {
        let ring = |z: f64| {
            (0..360).map(move |k| DVec2::from_angle(f64::from(k).to_radians()).extend(0.0) * 0.15 + DVec3::Z * z)
        };
        let points: Vec<DVec3> = [0.0, 0.2, 0.4].into_iter().flat_map(ring).collect();
        let surface = Developable::around(&points, DVec3::Z, &points, 0.0).unwrap();
        let origin = surface.arc_at(DVec3::new(0.0, -1.0, 0.2));
        let flat: Vec<DVec2> = (0..40).map(|k| DVec2::new(0.01 * f64::from(k % 8), 0.05 * f64::from(k / 8))).collect();
        let placed: Vec<DVec3> = flat.iter().map(|p| surface.rolled(*p, origin)).collect();
        for mirrored in [false, true] {
            // Drawn rotated, shifted, and once from the wrong side.
            let drawn = flat.iter().map(|p| DVec2::from_angle(0.7).rotate(*p) + DVec2::new(3.0, -1.0));
            let drawn: Vec<DVec2> = drawn.map(|p| if mirrored { DVec2::new(-p.x, p.y) } else { p }).collect();
            let piece = Piece {
                name: String::new(),
                vertices: (0..40).collect(),
                flat: drawn,
                triangles: Vec::new(),
                of_garment: Vec::new(),
            };
            let found = lay(&piece, &surface, &placed);
            assert!(found.iter().zip(&placed).all(|(a, b)| a.distance(*b) < 1e-9));
        }
    }
}
