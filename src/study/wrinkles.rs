//! Wrinkle measures: the paper's displacement difference of adjacent PARTs, and mean curvature.
//!
//! The paper measures a wrinkle at the seam of two adjacent PARTs by the difference of their displacements, |D_p − D_q|. A
//! fold has curvature: the mean curvature of the drape, H_i = |Σ_j (cot α_ij + cot β_ij)(x_i − x_j)| / (4 A_i), with α, β the angles
//! opposite edge i–j and A_i the vertex's mixed area (Meyer, Desbrun, Schröder, Barr: "Discrete differential-geometry operators
//! for triangulated 2-manifolds", 2003). Both are reported per seam, and Spearman's rank correlation
//! states their agreement.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | D | displacement of a PART | m |
//! | H | mean curvature, without sign | 1/m |
//! | A | mixed area: the vertex's Voronoi cell, cut at obtuse triangles | m² |
//!
//! Limits: H includes the curvature of the body below; on the edge of the cloth it is undefined, and the mean of the inner
//! neighbours is used.

use glam::DVec3;
use serde::Serialize;

use crate::mesh::{Topology, TriMesh};
use crate::parts::Parts;

/// Both measures of one seam.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct SeamWrinkle {
    /// The two PARTs.
    pub parts: [u32; 2],
    /// |D_p − D_q|, mm.
    pub displacement_difference_mm: f64,
    /// Mean of H over the ends of the seam's edges, 1/m.
    pub mean_curvature_per_m: f64,
}

/// Wrinkles of a drape.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Wrinkles {
    /// One entry per seam, in the order of [`Parts::seams`].
    pub seams: Vec<SeamWrinkle>,
    /// H of each vertex, 1/m.
    pub vertex_curvature_per_m: Vec<f64>,
    /// Spearman's rank correlation of the two measures over the seams; `None` for fewer than three seams or a constant
    /// measure.
    pub rank_correlation: Option<f64>,
}

/// Measures the drape at `positions` (m) with one displacement `part_displacement` (m) a PART.
pub(crate) fn measure(
    mesh: &TriMesh,
    topology: &Topology,
    parts: &Parts,
    part_displacement: &[DVec3],
    positions: &[DVec3],
) -> Wrinkles {
    let curvature = mean_curvature(&mesh.with_positions(positions.to_vec()), topology);
    let of = |p: u32| part_displacement.get(p as usize).copied().unwrap_or(DVec3::ZERO);
    let seams: Vec<SeamWrinkle> = parts
        .seams
        .iter()
        .map(|seam| {
            let ends = seam.edges.iter().flat_map(|&e| topology.edges[e as usize]);
            let sum: f64 = ends.map(|v| curvature[v as usize]).sum();
            SeamWrinkle {
                parts: seam.parts,
                displacement_difference_mm: 1e3 * of(seam.parts[0]).distance(of(seam.parts[1])),
                mean_curvature_per_m: sum / (2 * seam.edges.len()).max(1) as f64,
            }
        })
        .collect();
    let differences: Vec<f64> = seams.iter().map(|s| s.displacement_difference_mm).collect();
    let curvatures: Vec<f64> = seams.iter().map(|s| s.mean_curvature_per_m).collect();
    Wrinkles { rank_correlation: rank_correlation(&differences, &curvatures), seams, vertex_curvature_per_m: curvature }
}

/// H of each vertex, 1/m; zero for a vertex of no triangle.
pub(crate) fn mean_curvature(mesh: &TriMesh, topology: &Topology) -> Vec<f64> {
    let mut laplacian = vec![DVec3::ZERO; mesh.vertex_count()];
    let mut areas = vec![0.0; mesh.vertex_count()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(t);
        for (&v, share) in triangle.iter().zip(mixed_areas(corners)) {
            areas[v as usize] += share;
        }
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (a, b) = (corners[i] - corners[k], corners[j] - corners[k]);
            let sine = a.cross(b).length();
            if sine <= 0.0 {
                continue;
            }
            let pull = (corners[i] - corners[j]) * (a.dot(b) / sine);
            laplacian[triangle[i] as usize] += pull;
            laplacian[triangle[j] as usize] -= pull;
        }
    }
    let edge = topology.boundary_vertices();
    let inner: Vec<f64> = laplacian
        .iter()
        .zip(&areas)
        .zip(&edge)
        .map(|((l, &a), &edge)| if edge || a <= 0.0 { 0.0 } else { l.length() / (4.0 * a) })
        .collect();
    (0..inner.len())
        .map(|v| {
            if !edge[v] {
                return inner[v];
            }
            let known = topology.neighbours(v as u32).iter().filter(|&&w| !edge[w as usize]);
            let (sum, count) = known.fold((0.0, 0), |(s, n), &w| (s + inner[w as usize], n + 1));
            if count > 0 { sum / f64::from(count) } else { 0.0 }
        })
        .collect()
}

/// Mixed area of each corner of a triangle, m²: its Voronoi cell; in an obtuse triangle half the area for the obtuse corner and a
/// quarter for the others.
fn mixed_areas(corners: [DVec3; 3]) -> [f64; 3] {
    let side = |i: usize, j: usize| corners[j % 3] - corners[i % 3];
    let area = 0.5 * side(0, 1).cross(side(0, 2)).length();
    let cosine = [0, 1, 2].map(|i| side(i, i + 1).dot(side(i, i + 2)));
    if area <= 0.0 || cosine.iter().any(|&c| c < 0.0) {
        return cosine.map(|c| if c < 0.0 { 0.5 * area } else { 0.25 * area });
    }
    // cot = cosine / (2 area), so |e|² cot / 8 is |e|² cosine / (16 area).
    [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        (side(i, j).length_squared() * cosine[k] + side(i, k).length_squared() * cosine[j]) / (16.0 * area)
    })
}

/// Spearman's rank correlation, ties at their mean rank.
pub(crate) fn rank_correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.len() != b.len() || a.len() < 3 {
        return None;
    }
    let (p, q) = (ranks(a), ranks(b));
    let middle = (a.len() as f64 + 1.0) / 2.0;
    let product = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(x, y)| (x - middle) * (y - middle)).sum::<f64>();
    let scale = (product(&p, &p) * product(&q, &q)).sqrt();
    (scale > 0.0).then(|| product(&p, &q) / scale)
}

/// Ranks from 1, ties at their mean.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for run in order.chunk_by(|&i, &j| values[i] == values[j]) {
        let rank = first as f64 + (run.len() as f64 + 1.0) / 2.0;
        for &i in run {
            ranks[i] = rank;
        }
        first += run.len();
    }
    ranks
}
