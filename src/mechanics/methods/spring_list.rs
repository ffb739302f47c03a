//! Springs of a mass-spring garment, with constants derived from the fabric.
//!
//! Structural springs along the edges: k = Y Σ A_t / L², the sum over the edge's triangles, which makes a mesh of any
//! triangles as stiff in tension as a membrane of stiffness Y (Van Gelder: "Approximate simulation of elastic membranes
//! by triangulated spring meshes", J. Graphics Tools 3(2), 1998). Y varies from the fabric's k_u to its k_v with the
//! square of the edge's direction cosines.
//!
//! Bending springs connect the far corners of two triangles with a common edge, at their flat distance L. Bent to a
//! curvature κ that distance shortens by κ² L³/24, so the energy is proportional to κ⁴; k_b is such that at a radius of 2 cm, that of
//! a garment's fold, the springs in all directions store the energy of a plate with the fabric's mean bending stiffness B: ½ B
//! κ² A = ½ k_b (κ² L³/24)² · 35/128 (the mean of cos⁸). No bending spring is stiffer than the edge it spans; otherwise it
//! would pull in the plane.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k, k_b | spring stiffness | N/m |
//! | L | rest length | m |
//! | Y | membrane stiffness along the edge | N/m |

use crate::garment::fabric::Fabric;
use crate::mesh::{RestShape, Topology};

/// Radius at which bending springs store the energy of the fabric, m: that of a garment's fold. A heuristic.
const FOLD_RADIUS: f64 = 0.02;
/// Mean of cos⁸ over all directions.
const MEAN_COS_8: f64 = 35.0 / 128.0;

/// A spring between two vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spring {
    /// Its ends.
    pub ends: [u32; 2],
    /// Rest length, m.
    pub rest: f64,
    /// Stiffness, N/m.
    pub stiffness: f64,
}

/// The sums over the triangles of an edge.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    length: f64,
    area: f64,
    weight: f64,
    stiffness: f64,
    /// Triangles so far, and the far corner of the last: its vertex, and its place along the edge and off it, m.
    count: u32,
    far: u32,
    tip: [f64; 2],
}

/// Structural springs, one for each edge in the topology's order, and bending springs.
pub(crate) fn springs(
    triangles: &[[u32; 3]],
    topology: &Topology,
    rest: &RestShape,
    fabric: &Fabric,
) -> [Vec<Spring>; 2] {
    let mut edges = vec![Edge::default(); topology.edges.len()];
    let mut bends: Vec<([u32; 2], f64, f64, usize)> = Vec::new();
    for (triangle, corners) in triangles.iter().zip(&rest.corners) {
        let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (a, b) = (triangle[i], triangle[j]);
            let along = corners[j] - corners[i];
            let length = along.length();
            let weft = (along.x / length).powi(2);
            let Some(number) = topology.edge_between(a, b) else { continue };
            let edge = &mut edges[number];
            edge.length += length;
            edge.area += area;
            edge.weight += 1.0;
            edge.stiffness += weft * fabric.stretch_weft_n_per_m + (1.0 - weft) * fabric.stretch_warp_n_per_m;
            // The far corner in the frame of the edge: along it from its smaller vertex, and off it.
            let from = if a < b { corners[i] } else { corners[j] };
            let axis = if a < b { along } else { -along } / length;
            let to = corners[k] - from;
            let tip = [to.dot(axis), to.perp_dot(axis).abs()];
            if edge.count == 1 {
                let flat = ((tip[0] - edge.tip[0]).powi(2) + (tip[1] + edge.tip[1]).powi(2)).sqrt();
                bends.push(([edge.far, triangle[k]], flat, edge.area / 3.0, number));
            }
            edge.count += 1;
            edge.far = triangle[k];
            edge.tip = tip;
        }
    }
    let plate = fabric.mean_bending_nm();
    let of_edge = |e: &Edge| {
        let length = e.length / e.weight;
        (length, e.stiffness / e.weight * e.area / (length * length))
    };
    let bending = bends.iter().filter(|(ends, ..)| ends[0] != ends[1]).map(|&(ends, flat, area, edge)| {
        let shortening = flat.powi(3) / (24.0 * FOLD_RADIUS);
        let stiffness = plate * area / (MEAN_COS_8 * shortening * shortening);
        Spring { ends, rest: flat, stiffness: stiffness.min(of_edge(&edges[edge]).1) }
    });
    let structural = topology.edges.iter().zip(&edges).map(|(&ends, e)| {
        let (rest, stiffness) = of_edge(e);
        Spring { ends, rest, stiffness }
    });
    [structural.collect(), bending.collect()]
}
