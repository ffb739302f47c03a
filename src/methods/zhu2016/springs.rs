//! The garment as masses and springs.
//!
//! Structural springs along the edges: k = Y Σ A_t / L², the sum over the edge's triangles, which makes a mesh of any
//! triangles as stiff in tension as a membrane of stiffness Y (Van Gelder: "Approximate simulation of elastic membranes
//! by triangulated spring meshes", J. Graphics Tools 3(2), 1998). Y goes from the fabric's k_u to its k_v with the
//! square of the edge's direction cosines.
//!
//! Bending springs between the far corners of two triangles with a common edge, at their flat distance L. Bent to a
//! curvature κ that distance shortens by κ² L³/24, so the energy goes by κ⁴; k_b is such that at a radius of 2 cm, a
//! garment fold's, the springs in all directions hold as much as a plate of the fabric's mean bending stiffness B: ½ B
//! κ² A = ½ k_b (κ² L³/24)² · 35/128 (the mean of cos⁸). No bending spring is stiffer than the edge it spans, or it
//! would pull in the plane.
//!
//! Provot's limiting (Provot: "Deformation constraints in a mass-spring model to describe rigid cloth behaviour",
//! Graphics Interface 1995): after a step, a structural spring that is longer than (1 + τ) L is shortened to that by
//! moving its ends, each by the other's share of the mass; sweeps over all of them, a few a step.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k, k_b | spring stiffness | N/m |
//! | L | rest length | m |
//! | Y | membrane stiffness along the edge | N/m |
//! | τ | elongation limit, 0.1 | – |

use glam::{DVec3, Mat3A, Vec3A};
use rayon::prelude::*;

use crate::methods::Dressing;
use crate::methods::linear::{BlockRows, Operator};
use crate::methods::march::Elastic;

/// Radius at which bending springs hold what the fabric does, m.
const FOLD_RADIUS: f64 = 0.02;
/// Mean of cos⁸ over all directions.
const MEAN_COS_8: f64 = 35.0 / 128.0;
/// Sweeps of Provot's limiting after a step.
const SWEEPS: usize = 30;
/// Vertices of one task.
const CHUNK: usize = 256;

/// A spring as its first vertex sees it.
#[derive(Debug, Clone, Copy)]
struct Arm {
    other: u32,
    block: u32,
    rest: f32,
    stiffness: f32,
}

/// A structural spring for the limiting.
#[derive(Debug, Clone, Copy)]
struct Limit {
    ends: [u32; 2],
    longest: f64,
    /// Share of a correction that the first end takes.
    share: f64,
}

/// All springs of a garment.
#[derive(Debug, Clone)]
pub struct Springs {
    starts: Vec<u32>,
    arms: Vec<Arm>,
    limits: Vec<Limit>,
    matrix: BlockRows,
}

/// An edge on its way to a spring.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    length: f64,
    area: f64,
    weight: f64,
    stiffness: f64,
    /// Triangles met so far, and the far corner of the first.
    count: u32,
    far: u32,
    tip: [f64; 2],
}

impl Springs {
    /// Springs of the garment by its rest shape.
    #[must_use]
    pub fn new(dressing: &Dressing<'_>, strain_limit: f64) -> Self {
        let Dressing { scene, fabric, cloth } = dressing;
        let mut edges = vec![Edge::default(); scene.topology.edges.len()];
        let mut bends: Vec<([u32; 2], f64, f64, usize)> = Vec::new();
        for (triangle, corners) in scene.garment.triangles.iter().zip(&scene.rest.corners) {
            let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let (a, b) = (triangle[i], triangle[j]);
                let along = corners[j] - corners[i];
                let length = along.length();
                let weft = (along.x / length).powi(2);
                let Some(number) = scene.topology.edge_between(a, b) else { continue };
                let edge = &mut edges[number];
                edge.length += length;
                edge.area += area;
                edge.weight += 1.0;
                edge.stiffness += weft * fabric.stretch_weft_n_per_m + (1.0 - weft) * fabric.stretch_warp_n_per_m;
                // The far corner in the edge's own frame: along it from its smaller vertex, and off it.
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
        let [weft, bias, warp] = fabric.bending_nm;
        let plate = 0.25 * (weft + 2.0 * bias + warp);
        let of_edge = |e: &Edge| {
            let length = e.length / e.weight;
            (length, e.stiffness / e.weight * e.area / (length * length))
        };
        let bending = bends.iter().filter(|(ends, ..)| ends[0] != ends[1]).map(|&(ends, flat, area, over)| {
            let shortening = flat.powi(3) / (24.0 * FOLD_RADIUS);
            let stiffness = plate * area / (MEAN_COS_8 * shortening * shortening);
            (ends, flat, stiffness.min(of_edge(&edges[over]).1))
        });
        let structural = scene.topology.edges.iter().zip(&edges).map(|(&ends, e)| (ends, of_edge(e).0, of_edge(e).1));
        let springs: Vec<([u32; 2], f64, f64)> = structural.chain(bending).collect();
        let matrix = BlockRows::new(cloth.vertex_count(), springs.iter().map(|(e, ..)| (e[0], e[1])));
        let limits = (springs[..edges.len()].iter())
            .filter(|(e, ..)| e.iter().any(|&v| !cloth.held[v as usize]))
            .map(|&(ends, rest, _)| {
                let [a, b] = ends.map(|v| v as usize);
                let share = match (cloth.held[a], cloth.held[b]) {
                    (true, _) => 0.0,
                    (_, true) => 1.0,
                    _ => cloth.masses[b] / (cloth.masses[a] + cloth.masses[b]),
                };
                Limit { ends, longest: rest * (1.0 + strain_limit), share }
            })
            .collect();
        let (starts, arms) = arms(&springs, &matrix);
        Self { starts, arms, limits, matrix }
    }

    /// Number of springs of both kinds.
    #[must_use]
    pub fn count(&self) -> usize {
        self.arms.len() / 2
    }
}

/// The springs by the vertex that sees them.
fn arms(springs: &[([u32; 2], f64, f64)], matrix: &BlockRows) -> (Vec<u32>, Vec<Arm>) {
    let rows = matrix.rows();
    let mut starts = vec![0u32; rows + 1];
    for v in springs.iter().flat_map(|(ends, ..)| ends) {
        starts[*v as usize + 1] += 1;
    }
    for v in 0..rows {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut arms = vec![Arm { other: 0, block: 0, rest: 0.0, stiffness: 0.0 }; 2 * springs.len()];
    for &([a, b], rest, stiffness) in springs {
        for (own, other) in [(a, b), (b, a)] {
            let block = matrix.at(own, other).map_or(0, |k| k - matrix.starts[own as usize]);
            arms[next[own as usize] as usize] = Arm { other, block, rest: rest as f32, stiffness: stiffness as f32 };
            next[own as usize] += 1;
        }
    }
    (starts, arms)
}

impl Operator for Springs {
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]) {
        self.matrix.times(d, out);
    }
}

impl Elastic for Springs {
    fn add_own(&self, own: &mut [Mat3A]) {
        for (own, &k) in own.iter_mut().zip(&self.matrix.diagonal) {
            *own += self.matrix.blocks[k as usize];
        }
    }

    fn linearise(&mut self, x: &[DVec3], force: &mut [DVec3]) {
        let Self { starts, arms, matrix, .. } = self;
        let BlockRows { starts: rows, diagonal, blocks, .. } = matrix;
        blocks.fill(Mat3A::ZERO);
        let mut tasks = Vec::with_capacity(force.len() / CHUNK + 1);
        let mut left = blocks.as_mut_slice();
        for (chunk, force) in force.chunks_mut(CHUNK).enumerate() {
            let (first, last) = (chunk * CHUNK, chunk * CHUNK + force.len());
            let (own, rest) = left.split_at_mut((rows[last] - rows[first]) as usize);
            left = rest;
            tasks.push((first, force, own));
        }
        tasks.into_par_iter().for_each(|(first, force, blocks)| {
            let base = rows[first];
            for (k, force) in force.iter_mut().enumerate() {
                let v = first + k;
                let row = (rows[v] - base) as usize;
                let mut sum = Vec3A::ZERO;
                let mut own = Mat3A::ZERO;
                for arm in &arms[starts[v] as usize..starts[v + 1] as usize] {
                    let to = (x[arm.other as usize] - x[v]).as_vec3a();
                    let length = to.length();
                    let n = to / length.max(f32::MIN_POSITIVE);
                    sum += n * (arm.stiffness * (length - arm.rest));
                    // Across itself a spring under compression would push sideways: that part is left out.
                    let across = (1.0 - arm.rest / length).max(0.0);
                    let along = n * (1.0 - across);
                    let mut block = Mat3A::from_cols(along * n.x, along * n.y, along * n.z);
                    block.x_axis.x += across;
                    block.y_axis.y += across;
                    block.z_axis.z += across;
                    block *= arm.stiffness;
                    own += block;
                    blocks[row + arm.block as usize] -= block;
                }
                blocks[(diagonal[v] - base) as usize] += own;
                *force += sum.as_dvec3();
            }
        });
    }

    fn limit(&mut self, _from: &[DVec3], x: &mut [DVec3], _held: &[bool]) -> u64 {
        let mut corrections = 0;
        for _ in 0..SWEEPS {
            let before = corrections;
            for limit in &self.limits {
                let [a, b] = limit.ends.map(|v| v as usize);
                let to = x[b] - x[a];
                let squared = to.length_squared();
                if squared > limit.longest * limit.longest {
                    let excess = to * (1.0 - limit.longest / squared.sqrt());
                    x[a] += excess * limit.share;
                    x[b] -= excess * (1.0 - limit.share);
                    corrections += 1;
                }
            }
            if corrections == before {
                break;
            }
        }
        corrections
    }
}
