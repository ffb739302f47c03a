//! A garment without seams, cut into pieces and laid flat.
//!
//! The built-in garments have no seams. They are cut along mesh edges where sleeve and bodice meet (by the mesh's
//! groups) and where front and back meet, at the sides, on the shoulders and along the arms. Each piece is flattened from its rest
//! shape as isometrically as possible (`laid_flat`); a bodice with a bust has no exact plane pattern, and the remaining strain is
//! reported ([`distortion`](super::pieces::distortion)).
//!
//! Source: ours; Groß, Fuhrmann, Luckas 2003 start from pattern pieces.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::pieces::{Piece, unfit};
use crate::garment::sewing::laid_flat;
use crate::mechanics::methods::method::{MethodError, MethodInput};
use crate::mesh::{Csr, RestShape, Topology, TriMesh, each_once, pieces};

/// Smallest share of the garment's triangles in a piece; a smaller one joins its neighbour. A heuristic.
const MIN_SHARE: f64 = 0.02;

/// Cuts a garment into flat pieces.
///
/// # Errors
/// [`MethodError::Unfit`] for a mesh without the groups of a built-in garment, and for a piece that folds over when flattened.
pub fn cut(input: &MethodInput<'_>) -> Result<Vec<Piece>, MethodError> {
    let (garment, topology) = (&input.scene.garment, &input.scene.topology);
    let known = |group: &&String| ["body", "sleeve", "hem"].contains(&group.as_str());
    if garment.groups.iter().filter(known).count() < 2 {
        return Err(unfit(
            "it starts from pattern pieces, and this mesh has no seams; give a sewing pattern (--pattern) or a built-in garment",
        ));
    }
    let of_sleeve: Vec<bool> = garment.groups.iter().map(|g| g == "sleeve" || g == "cuffs").collect();
    let middle = |t: usize| garment.corners(t).into_iter().sum::<DVec3>() / 3.0;
    let sleeve = |t: usize| of_sleeve[garment.triangle_group[t] as usize];
    // Three tubes, bodice, right and left sleeve, each with a line between its front and its back.
    let tube = |t: usize| if sleeve(t) { 1 + usize::from(middle(t).x > 0.0) } else { 0 };
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for t in 0..garment.triangles.len() {
        let (k, y) = (tube(t), middle(t).y);
        (low[k], high[k]) = (low[k].min(y), high[k].max(y));
    }
    let lines = front_back_lines(garment, &tube, [low, high]);
    let label: Vec<usize> = (0..garment.triangles.len())
        .map(|t| {
            let k = tube(t);
            let p = middle(t);
            2 * k + usize::from(p.y > lines[k].at(if k == 0 { p.z } else { p.x.abs() }))
        })
        .collect();
    let label = join_small(label, topology);
    let mut pieces = Vec::new();
    for (number, triangles) in components(&label, topology).into_iter().enumerate() {
        let name =
            ["front", "back", "right sleeve, front", "right sleeve, back", "left sleeve, front", "left sleeve, back"]
                [label[triangles[0] as usize]];
        pieces.push(flattened(input, format!("{}: {name}", number + 1), &triangles)?);
    }
    Ok(pieces)
}

/// The line between front and back along a tube, y = a + b t with t along the tube: [a, b].
#[derive(Debug, Clone, Copy, Default)]
struct Line([f64; 2]);

impl Line {
    fn at(self, along: f64) -> f64 {
        self.0[0] + self.0[1] * along
    }
}

/// For each tube the line through the middles between front and back, by least squares over slices of 4 cm.
fn front_back_lines(garment: &TriMesh, tube: &dyn Fn(usize) -> usize, [low, high]: [[f64; 3]; 2]) -> [Line; 3] {
    let mut slices = [const { BTreeMap::<i64, [f64; 2]>::new() }; 3];
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
            return Line([0.5 * (low[k] + high[k]), 0.0]);
        }
        let (ma, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let (mut aa, mut ay) = (0.0, 0.0);
        for (a, y) in points {
            aa += (a - ma) * (a - ma);
            ay += (a - ma) * (y - my);
        }
        let slope = ay / aa;
        Line([my - slope * ma, slope])
    })
}

/// The triangles of each inner edge.
fn edge_pairs(topology: &Topology) -> impl Iterator<Item = [u32; 2]> + '_ {
    topology.edge_triangles.iter().zip(&topology.edge_valence).filter(|(_, v)| **v == 2).map(|(t, _)| *t)
}

/// Connected sets of triangles of one label, ordered by their first triangle.
fn components(label: &[usize], topology: &Topology) -> Vec<Vec<u32>> {
    let across = || edge_pairs(topology).flat_map(|[s, t]| [(s, t), (t, s)]);
    let neighbours = Csr::gathered(label.len(), across);
    let mut all = pieces(label.len(), |t| neighbours.of(t), |s, t| label[s] == label[t]);
    all.iter_mut().for_each(|piece| piece.sort_unstable());
    all
}

/// Labels with small islands joined to the label of their longest border.
fn join_small(mut label: Vec<usize>, topology: &Topology) -> Vec<usize> {
    for _ in 0..4 {
        let mut changed = false;
        for island in components(&label, topology) {
            if island.len() as f64 >= MIN_SHARE * label.len() as f64 {
                continue;
            }
            let own = label[island[0] as usize];
            let mut border = [0usize; 6];
            for [s, t] in edge_pairs(topology) {
                for (a, b) in [(s, t), (t, s)] {
                    if island.binary_search(&a).is_ok() && label[b as usize] != own {
                        border[label[b as usize]] += 1;
                    }
                }
            }
            let into = (0..6).max_by_key(|&k| (border[k], Reverse(k))).filter(|&k| border[k] > 0);
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

/// A set of triangles as a flat piece.
fn flattened(input: &MethodInput<'_>, name: String, of_garment: &[u32]) -> Result<Piece, MethodError> {
    let scene = input.scene;
    let vertices = each_once(of_garment.iter().flat_map(|&t| scene.garment.triangles[t as usize]));
    let local = |v: u32| vertices.binary_search(&v).unwrap_or_default() as u32;
    let triangles: Vec<[u32; 3]> = of_garment.iter().map(|&t| scene.garment.triangles[t as usize].map(local)).collect();
    let mesh = TriMesh::new(vertices.iter().map(|&v| scene.garment.positions[v as usize]).collect(), triangles.clone());
    let rest = RestShape::new(of_garment.iter().map(|&t| scene.rest.corners[t as usize]).collect());
    // Started from its projection along the mean normal, in which a front or a half sleeve has no fold.
    let outward = (0..triangles.len()).map(|t| mesh.double_area_vector(t)).sum::<DVec3>().normalize_or(DVec3::Y);
    let up = if outward.z.abs() > 0.9 { DVec3::X } else { DVec3::Z };
    let right = up.cross(outward).normalize_or(DVec3::X);
    let up = outward.cross(right);
    let projected = mesh.positions.iter().map(|p| DVec3::new(p.dot(right), p.dot(up), 0.0)).collect::<Vec<_>>();
    let flat: Vec<DVec2> = laid_flat(&mesh, &rest, &projected).into_iter().map(DVec3::truncate).collect();
    let inverted = triangles.iter().filter(|t| {
        let [a, b, c] = t.map(|v| flat[v as usize]);
        (b - a).perp_dot(c - a) <= 0.0
    });
    let folded = inverted.count();
    if folded * 50 > triangles.len() {
        return Err(unfit(format!("piece {name} does not lie flat: {folded} of its triangles are inverted")));
    }
    Ok(Piece { name, vertices, flat, triangles, of_garment: of_garment.to_vec() })
}
