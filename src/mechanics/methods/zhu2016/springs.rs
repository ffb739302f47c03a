//! The garment as masses and springs, with structural and bending springs by
//! `spring_list`.
//!
//! Provot's limiting (Provot: "Deformation constraints in a mass-spring model to describe rigid cloth behaviour",
//! Graphics Interface 1995): after a step, a structural spring longer than (1 + τ) L is shortened to that length by
//! moving its ends, each in proportion to the other's mass; several sweeps over all springs a step.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k | spring stiffness | N/m |
//! | L | rest length | m |
//! | τ | elongation limit, 0.1 | – |

use glam::{DVec3, Mat3A, Vec3A};
use rayon::prelude::*;

use crate::mechanics::methods::implicit_euler::Elastic;
use crate::mechanics::methods::linear::{BlockRows, Operator};
use crate::mechanics::methods::method::MethodInput;
use crate::mechanics::methods::spring_list::{Spring, springs};
use crate::mesh::Csr;

/// Most sweeps of Provot's limiting after a step; it ends earlier once no spring is too long. A heuristic.
const MAX_SWEEPS: usize = 30;
/// Vertices of one parallel task. A heuristic.
const CHUNK: usize = 256;

/// A spring in the list of one of its vertices.
#[derive(Debug, Clone, Copy, Default)]
struct HalfSpring {
    other: u32,
    block: u32,
    rest: f32,
    stiffness: f32,
}

/// The longest length of a structural spring.
#[derive(Debug, Clone, Copy)]
struct Limit {
    ends: [u32; 2],
    longest: f64,
    /// Share of a correction that moves the first end.
    share: f64,
}

/// All springs of a garment.
#[derive(Debug, Clone)]
pub(crate) struct Springs {
    /// The springs of each vertex.
    springs: Csr<HalfSpring>,
    limits: Vec<Limit>,
    matrix: BlockRows,
}

impl Springs {
    /// Springs of the garment by its rest shape.
    pub(crate) fn new(input: &MethodInput<'_>, strain_limit: f64) -> Self {
        let MethodInput { scene, fabric, cloth } = input;
        let [structural, bending] = springs(&scene.garment.triangles, &scene.topology, &scene.rest, fabric);
        let edges = structural.len();
        let springs = [structural, bending].concat();
        let matrix = BlockRows::new(cloth.vertex_count(), springs.iter().map(|s| (s.ends[0], s.ends[1])));
        let limits = (springs[..edges].iter())
            .filter(|s| s.ends.iter().any(|&v| !cloth.held[v as usize]))
            .map(|&Spring { ends, rest, .. }| {
                let [a, b] = ends.map(|v| v as usize);
                let share = match (cloth.held[a], cloth.held[b]) {
                    (true, _) => 0.0,
                    (_, true) => 1.0,
                    _ => cloth.masses[b] / (cloth.masses[a] + cloth.masses[b]),
                };
                Limit { ends, longest: rest * (1.0 + strain_limit), share }
            })
            .collect();
        // Each spring is in the lists of both its ends.
        let ends =
            |s: &Spring| [(s.ends[0], s.ends[1]), (s.ends[1], s.ends[0])].map(|ends| (ends, s.rest, s.stiffness));
        let half = |((own, other), rest, stiffness): ((u32, u32), f64, f64)| {
            let row = matrix.columns.range(own as usize);
            let block = matrix.at(own, other).map_or(0, |k| k - row.start as u32);
            (own, HalfSpring { other, block, rest: rest as f32, stiffness: stiffness as f32 })
        };
        let springs = Csr::gathered(cloth.vertex_count(), || springs.iter().flat_map(ends).map(half));
        Self { springs, limits, matrix }
    }
}

impl Operator for Springs {
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]) {
        self.matrix.times(d, out);
    }
}

impl Elastic for Springs {
    fn add_diagonal(&self, diagonal: &mut [Mat3A]) {
        for (sum, &k) in diagonal.iter_mut().zip(&self.matrix.diagonal) {
            *sum += self.matrix.blocks[k as usize];
        }
    }

    fn linearise(&mut self, x: &[DVec3], force: &mut [DVec3]) {
        let Self { springs, matrix, .. } = self;
        let BlockRows { columns, diagonal, blocks } = matrix;
        let rows = columns.starts();
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
                for spring in springs.of(v) {
                    let to = (x[spring.other as usize] - x[v]).as_vec3a();
                    let length = to.length();
                    let n = to / length.max(f32::MIN_POSITIVE);
                    sum += n * (spring.stiffness * (length - spring.rest));
                    // Under compression the geometric stiffness across the spring is negative; it is left out.
                    let across = (1.0 - spring.rest / length).max(0.0);
                    let along = n * (1.0 - across);
                    let mut block = Mat3A::from_cols(along * n.x, along * n.y, along * n.z);
                    block.x_axis.x += across;
                    block.y_axis.y += across;
                    block.z_axis.z += across;
                    block *= spring.stiffness;
                    own += block;
                    blocks[row + spring.block as usize] -= block;
                }
                blocks[(diagonal[v] - base) as usize] += own;
                *force += sum.as_dvec3();
            }
        });
    }

    fn limit(&mut self, x: &mut [DVec3]) -> Option<u64> {
        let mut corrections = 0;
        for _ in 0..MAX_SWEEPS {
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
        Some(corrections)
    }
}
