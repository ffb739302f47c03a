//! The pieces a garment is sewn of, flat, and which part of the body each is for.
//!
//! A sewing pattern brings its panels; a garment without seams is [`cut`](super::cut).
//!
//! A piece belongs to the limb of the body that most of its vertices are nearest to, or else to the trunk with what of the limbs lies
//! under it. Source: Groß, Fuhrmann, Luckas 2003 are told the part of the body; the rule is ours.

use glam::{DVec2, DVec3};

use super::NAME;
use crate::base::quantiles::{extremes, nearest_rank};
use crate::garment::pattern::SewnGarment;
use crate::mesh::{RestShape, TriMesh};
use crate::methods::segment::{Segments, longest};
use crate::methods::{MethodInput, MethodError};

/// A piece is a limb's if that is nearest to so many of its vertices.
const OF_LIMB: f64 = 0.5;
/// A part is bounded with the units that are nearest to at least so many of its vertices.
const UNDER: f64 = 0.1;

/// One piece of cloth.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// The garment's vertex that each of its own is.
    pub vertices: Vec<u32>,
    /// Where they lie flat, m.
    pub flat: Vec<DVec2>,
    /// Its triangles by its own vertices, and which of the garment's each is.
    pub triangles: Vec<[u32; 3]>,
    /// The same triangles as the garment numbers them.
    pub of_garment: Vec<u32>,
}

/// A part of the body, what is worn on it, and the body's vertices to be bounded.
#[derive(Debug, Clone)]
pub struct BodyPart {
    /// Its pieces.
    pub pieces: Vec<usize>,
    /// Direction of its axis, upwards.
    pub axis: DVec3,
    /// What is to be bounded, m.
    pub points: Vec<DVec3>,
}

pub(super) fn unfit(reason: impl Into<String>) -> MethodError {
    MethodError::unfit(NAME, reason)
}

/// The panels of a pattern.
///
/// # Errors
/// [`MethodError::Unfit`] where the garment is not the one sewn of them.
pub fn of_pattern(sewn: &SewnGarment, garment: &TriMesh) -> Result<Vec<Piece>, MethodError> {
    if sewn.mesh.triangles.len() != garment.triangles.len() {
        return Err(unfit("the garment is not the one that its pattern is sewn to"));
    }
    let mut pieces = Vec::new();
    for (number, panel) in sewn.panels.iter().enumerate() {
        let name = sewn.mesh.groups.get(number).cloned().unwrap_or_default();
        let mut local = vec![u32::MAX; garment.vertex_count()];
        (0u32..).zip(&panel.vertices).for_each(|(i, &v)| local[v as usize] = i);
        let own = (0u32..).zip(&sewn.mesh.triangle_group).filter(|(_, group)| **group as usize == number);
        let of_garment: Vec<u32> = own.map(|(t, _)| t).collect();
        // A dart sews a panel to itself: its corners are found by where they lie flat.
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

/// How far the flat pieces are off the rest shape: 95th percentile and largest relative difference of an edge's length.
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

/// The direction in which the points of a limb spread most about their mean, upwards; without the upper third, where it joins the
/// trunk, and what counts as its own differs from left to right.
fn spread(points: &[DVec3]) -> DVec3 {
    let along = |points: &[DVec3]| {
        let mean = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let axis = longest(points.iter().map(|p| (*p - mean, 1.0)));
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

/// The parts of the body that the pieces are for.
///
/// # Errors
/// [`MethodError::Unfit`] for a body that is not closed.
pub fn parts(dressing: &MethodInput<'_>, pieces: &[Piece]) -> Result<Vec<BodyPart>, MethodError> {
    let (scene, body) = (dressing.scene, dressing.scene.body.mesh());
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
    // By limb, and the trunk after them.
    let mut of_part = vec![Vec::new(); count + 1];
    for (number, piece) in pieces.iter().enumerate() {
        let own = shares(&mut piece.vertices.iter().copied());
        let limb = (0..count).find(|&u| segments.is_limb[u] && own[u] > OF_LIMB);
        of_part[limb.unwrap_or(count)].push(number);
    }
    let taken: Vec<bool> = of_part.iter().map(|pieces| !pieces.is_empty()).collect();
    let mut all = Vec::new();
    for (limb, of) in of_part.into_iter().enumerate().filter(|(_, of)| !of.is_empty()) {
        let own = shares(&mut of.iter().flat_map(|&p| pieces[p].vertices.iter().copied()));
        // A limb with pieces of its own is not the trunk's to bound.
        let bounded = |u: usize| u == limb || (own[u] > UNDER && !(segments.is_limb[u] && taken[u]));
        let mut inside = vec![false; body.vertex_count()];
        for (triangle, &u) in body.triangles.iter().zip(&segments.of_triangle) {
            if bounded(u as usize) {
                triangle.iter().for_each(|&v| inside[v as usize] = true);
            }
        }
        let points: Vec<DVec3> = body.positions.iter().zip(inside).filter(|(_, i)| *i).map(|(p, _)| *p).collect();
        let axis = if limb < count { spread(&points) } else { DVec3::Z };
        let vertices = of.iter().flat_map(|&p| &pieces[p].vertices);
        let (low, high) = extremes(vertices.map(|&v| scene.garment.positions[v as usize].dot(axis)));
        let under = points.into_iter().filter(|p| (low..=high).contains(&p.dot(axis))).collect();
        all.push(BodyPart { pieces: of, axis, points: under });
    }
    Ok(all)
}
