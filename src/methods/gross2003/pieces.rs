//! The pieces a garment is sewn of, flat, and which part of the body each is for.
//!
//! A sewing pattern brings its panels. The built-in garments are surfaces without a seam: they are cut along the mesh's edges where
//! sleeve and bodice meet (by the mesh's groups) and where front and back meet, at the sides, on the shoulders and along the arms, and
//! each piece is laid flat from its rest shape, as isometrically as possible (`sewing`): a bodice with a bust has no exact plane
//! pattern, and what is left of strain is told.
//!
//! A piece belongs to the limb of the body that most of its vertices are nearest to, or else to the trunk with what of the limbs lies
//! under it. Source: Groß, Fuhrmann, Luckas 2003 begin with pattern pieces and are told the part of the body; both rules are ours.

use glam::{DVec2, DVec3};

use super::NAME;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::methods::segment::{Segments, longest};
use crate::methods::{Dressing, MethodError};
use crate::pattern::SewnGarment;
use crate::sewing::laid_flat;

/// A piece of fewer triangles than this share of the garment's is joined to its neighbour.
const LEAST_SHARE: f64 = 0.02;
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

fn unfit(reason: impl Into<String>) -> MethodError {
    MethodError::Unfit { method: NAME, reason: reason.into() }
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

/// A garment without seams, cut into pieces and laid flat.
///
/// # Errors
/// [`MethodError::Unfit`] where nothing tells sleeve from bodice, or a piece does not open out.
pub fn cut(dressing: &Dressing<'_>) -> Result<Vec<Piece>, MethodError> {
    let (garment, topology) = (&dressing.scene.garment, &dressing.scene.topology);
    let known = |group: &&String| ["body", "sleeve", "hem"].contains(&group.as_str());
    if garment.groups.iter().filter(known).count() < 2 {
        return Err(unfit(
            "it starts from pattern pieces, and this mesh has no seams; give a sewing pattern (--pattern) or a built-in garment",
        ));
    }
    let of_sleeve: Vec<bool> = garment.groups.iter().map(|g| g == "sleeve" || g == "cuffs").collect();
    let middle = |t: usize| garment.corners(t).into_iter().sum::<DVec3>() / 3.0;
    let sleeve = |t: usize| of_sleeve[garment.triangle_group[t] as usize];
    // Which of three tubes: bodice, right sleeve, left sleeve; each has a line that parts its front from its back.
    let tube = |t: usize| if sleeve(t) { 1 + usize::from(middle(t).x > 0.0) } else { 0 };
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for t in 0..garment.triangles.len() {
        let (k, y) = (tube(t), middle(t).y);
        (low[k], high[k]) = (low[k].min(y), high[k].max(y));
    }
    let side = parting(garment, &tube, [low, high]);
    let label: Vec<usize> = (0..garment.triangles.len())
        .map(|t| {
            let k = tube(t);
            let p = middle(t);
            2 * k + usize::from(p.y > side[k].at(if k == 0 { p.z } else { p.x.abs() }))
        })
        .collect();
    let label = joined(label, topology);
    let mut pieces = Vec::new();
    for (number, triangles) in components(&label, topology).into_iter().enumerate() {
        let name =
            ["front", "back", "right sleeve, front", "right sleeve, back", "left sleeve, front", "left sleeve, back"]
                [label[triangles[0] as usize]];
        pieces.push(opened(dressing, format!("{}: {name}", number + 1), &triangles)?);
    }
    Ok(pieces)
}

/// y of the line between front and back along a tube: a parabola through the middles of its slices.
#[derive(Debug, Clone, Copy, Default)]
struct Parting([f64; 2]);

impl Parting {
    fn at(self, along: f64) -> f64 {
        self.0[0] + self.0[1] * along
    }
}

/// For each tube the line through the middles between front and back, by least squares over slices of 4 cm.
fn parting(garment: &TriMesh, tube: &dyn Fn(usize) -> usize, [low, high]: [[f64; 3]; 2]) -> [Parting; 3] {
    let mut slices = [const { std::collections::BTreeMap::<i64, [f64; 2]>::new() }; 3];
    for t in 0..garment.triangles.len() {
        let p = garment.corners(t).into_iter().sum::<DVec3>() / 3.0;
        let k = tube(t);
        let along = if k == 0 { p.z } else { p.x.abs() };
        let slice = slices[k].entry((along / 0.04).floor() as i64).or_insert([f64::INFINITY, f64::NEG_INFINITY]);
        *slice = [slice[0].min(p.y), slice[1].max(p.y)];
    }
    [0, 1, 2].map(|k| {
        let points: Vec<(f64, f64)> =
            slices[k].iter().map(|(i, [a, b])| ((*i as f64 + 0.5) * 0.04, 0.5 * (a + b))).collect();
        let n = points.len() as f64;
        if points.len() < 3 {
            return Parting([0.5 * (low[k] + high[k]), 0.0]);
        }
        let (ma, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let (mut aa, mut ay) = (0.0, 0.0);
        for (a, y) in points {
            aa += (a - ma) * (a - ma);
            ay += (a - ma) * (y - my);
        }
        let slope = ay / aa;
        Parting([my - slope * ma, slope])
    })
}

/// Triangles across each edge.
fn beside(topology: &Topology) -> impl Iterator<Item = [u32; 2]> + '_ {
    topology.edge_triangles.iter().zip(&topology.edge_valence).filter(|(_, v)| **v == 2).map(|(t, _)| *t)
}

/// Connected sets of triangles of one label, by their first triangle.
fn components(label: &[usize], topology: &Topology) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); label.len()];
    for [s, t] in beside(topology).filter(|[s, t]| label[*s as usize] == label[*t as usize]) {
        neighbours[s as usize].push(t);
        neighbours[t as usize].push(s);
    }
    let mut seen = vec![false; label.len()];
    let mut all = Vec::new();
    for seed in 0..label.len() as u32 {
        if std::mem::replace(&mut seen[seed as usize], true) {
            continue;
        }
        let mut found = vec![seed];
        let mut next = 0;
        while next < found.len() {
            for &t in &neighbours[found[next] as usize] {
                if !std::mem::replace(&mut seen[t as usize], true) {
                    found.push(t);
                }
            }
            next += 1;
        }
        found.sort_unstable();
        all.push(found);
    }
    all
}

/// Labels with small islands joined to what they border on most.
fn joined(mut label: Vec<usize>, topology: &Topology) -> Vec<usize> {
    for _ in 0..4 {
        let mut changed = false;
        for island in components(&label, topology) {
            if island.len() as f64 >= LEAST_SHARE * label.len() as f64 {
                continue;
            }
            let own = label[island[0] as usize];
            let mut border = [0usize; 6];
            for [s, t] in beside(topology) {
                for (a, b) in [(s, t), (t, s)] {
                    if island.binary_search(&a).is_ok() && label[b as usize] != own {
                        border[label[b as usize]] += 1;
                    }
                }
            }
            let into = (0..6).max_by_key(|&k| (border[k], std::cmp::Reverse(k))).filter(|&k| border[k] > 0);
            if let Some(into) = into {
                island.iter().for_each(|&t| label[t as usize] = into);
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    label
}

/// A set of triangles as a piece, laid flat.
fn opened(dressing: &Dressing<'_>, name: String, of_garment: &[u32]) -> Result<Piece, MethodError> {
    let scene = dressing.scene;
    let mut vertices: Vec<u32> = of_garment.iter().flat_map(|&t| scene.garment.triangles[t as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let local = |v: u32| vertices.binary_search(&v).unwrap_or_default() as u32;
    let triangles: Vec<[u32; 3]> = of_garment.iter().map(|&t| scene.garment.triangles[t as usize].map(local)).collect();
    let mesh = TriMesh::new(vertices.iter().map(|&v| scene.garment.positions[v as usize]).collect(), triangles.clone());
    let rest = RestShape { corners: of_garment.iter().map(|&t| scene.rest.corners[t as usize]).collect() };
    // Seen from where its normals point to on the whole, which sets a front or a half sleeve out without a fold.
    let outward = (0..triangles.len()).map(|t| mesh.double_area_vector(t)).sum::<DVec3>().normalize_or(DVec3::Y);
    let up = if outward.z.abs() > 0.9 { DVec3::X } else { DVec3::Z };
    let right = up.cross(outward).normalize_or(DVec3::X);
    let up = outward.cross(right);
    let seen = mesh.positions.iter().map(|p| DVec3::new(p.dot(right), p.dot(up), 0.0)).collect::<Vec<_>>();
    let flat: Vec<DVec2> = laid_flat(&mesh, &rest, &seen).into_iter().map(DVec3::truncate).collect();
    let turned_over = triangles.iter().filter(|t| {
        let [a, b, c] = t.map(|v| flat[v as usize]);
        (b - a).perp_dot(c - a) <= 0.0
    });
    let folded = turned_over.count();
    if folded * 50 > triangles.len() {
        return Err(unfit(format!("piece {name} does not open out flat: {folded} of its triangles lie turned over")));
    }
    Ok(Piece { name, vertices, flat, triangles, of_garment: of_garment.to_vec() })
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
    [crate::quantile::nearest_rank(&off, 0.95), off.iter().copied().fold(0.0, f64::max)]
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
pub fn parts(dressing: &Dressing<'_>, pieces: &[Piece]) -> Result<Vec<BodyPart>, MethodError> {
    let (scene, body) = (dressing.scene, dressing.scene.body.mesh());
    let topology = Topology::new(body);
    let open = topology.boundary_edges().count();
    if open > 0 {
        return Err(unfit(format!("the body is not closed ({open} boundary edges), so no part of it has an inside")));
    }
    let segments = Segments::new(body, &topology);
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
        let along =
            of.iter().flat_map(|&p| &pieces[p].vertices).map(|&v| scene.garment.positions[v as usize].dot(axis));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let under = points.into_iter().filter(|p| (low..=high).contains(&p.dot(axis))).collect();
        all.push(BodyPart { pieces: of, axis, points: under });
    }
    Ok(all)
}
