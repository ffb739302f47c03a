//! Carries a draped garment along when its body moves to another pose of the same mesh.
//!
//! The body's surface is divided into connected patches. Patch k moves by the rigid map that fits its vertices best,
//!
//! T_k(x) = q_k + R_k (x − p_k),
//!
//! p_k and q_k its centres before and after, R_k the polar factor of Σ (b_i − q)(a_i − p)ᵀ + ρ² Σ m_i n_iᵀ over its vertices and their
//! neighbours, p and q their centres (Kabsch, Acta Cryst. A32, 1976; the normals make a flat patch determinate). A point of the garment moves by their blend
//!
//! y = Σ w_k T_k(x) / Σ w_k,  w_k = (|x − p_k|² + ε²)^−p  (Shepard, "A two-dimensional interpolation function", 1968).
//!
//! The blend is a smooth map of space: cloth does not tear, and layers keep their order. Near the skin the nearest patch decides; a hem
//! between two legs follows both.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a_i, b_i | vertices of the body before and after | m |
//! | n_i, m_i | their unit normals | – |
//! | ρ | radius of a patch, [`PATCH_M`] | m |
//! | ε, p | blending length [`BLEND_M`], power [`POWER`] | m, – |
//!
//! Limits: the result is a start for the solver, not a drape. Where two parts of the body are nearer to each other than ε, cloth between
//! them follows both. A part that turns by more than half a turn between two poses turns the short way.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::mesh::{Topology, TriMesh, each_once, outer};

/// ρ, m: half the width of a limb, so that a patch lies on one side of it. Smaller patches follow the skin more closely and cost time.
const PATCH_M: f64 = 0.035;
/// ε, m, and p. A smaller ε follows single patches; with a smaller p distant limbs count more. Heuristics.
const BLEND_M: f64 = 0.02;
const POWER: i32 = 3;
/// Ratio of |x − p_k|² + ε² to the least one beyond which a patch is left out: its weight is a hundred-thousandth of the largest.
const FAR: f64 = 46.4;
/// Steps of the polar decomposition, which converges quadratically.
const POLAR_STEPS: usize = 20;

/// A patch of the body and its motion.
#[derive(Debug, Clone, Copy)]
struct Patch {
    before: DVec3,
    after: DVec3,
    rotation: DMat3,
}

/// The motion of a body from one pose to another.
#[derive(Debug, Clone)]
pub(crate) struct Motion(Vec<Patch>);

impl Motion {
    /// The motion of a body to these positions of its vertices.
    pub(crate) fn new(body: &TriMesh, after: &[DVec3]) -> Self {
        let moved = body.with_positions(after.to_vec());
        let (normals, moved_normals) = (body.vertex_normals(), moved.vertex_normals());
        let topology = Topology::new(body);
        let patch = |own: &Vec<u32>| {
            // With the neighbours a patch of one vertex has a rotation, too.
            let around = own.iter().flat_map(|&v| topology.neighbours(v)).chain(own).copied();
            let all: Vec<usize> = each_once(around).into_iter().map(|v| v as usize).collect();
            let own: Vec<usize> = own.iter().map(|&v| v as usize).collect();
            let mean = |of: &[DVec3], vertices: &[usize]| {
                vertices.iter().map(|&v| of[v]).sum::<DVec3>() / vertices.len() as f64
            };
            let (p, q) = (mean(&body.positions, &all), mean(after, &all));
            let covariance = all.iter().fold(DMat3::ZERO, |sum, &v| {
                let turned = outer(moved_normals[v], normals[v]) * (PATCH_M * PATCH_M);
                sum + outer(after[v] - q, body.positions[v] - p) + turned
            });
            let rotation = nearest_rotation(covariance);
            Patch { before: mean(&body.positions, &own), after: mean(after, &own), rotation }
        };
        Self(patches(body, &topology).iter().map(patch).collect())
    }

    /// The points (m) after the motion.
    pub(crate) fn carry(&self, points: &[DVec3]) -> Vec<DVec3> {
        points.par_iter().with_min_len(64).map(|&x| self.carried(x)).collect()
    }

    fn carried(&self, x: DVec3) -> DVec3 {
        let square = |patch: &Patch| x.distance_squared(patch.before) + BLEND_M * BLEND_M;
        let nearest = self.0.iter().map(square).fold(f64::INFINITY, f64::min);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for patch in &self.0 {
            let square = square(patch);
            if square <= FAR * nearest {
                let weight = (nearest / square).powi(POWER);
                sum += (patch.after + patch.rotation * (x - patch.before)) * weight;
                weights += weight;
            }
        }
        if weights > 0.0 { sum / weights } else { x }
    }
}

/// Connected patches of vertices within [`PATCH_M`] of their first one, which cover the surface.
fn patches(body: &TriMesh, topology: &Topology) -> Vec<Vec<u32>> {
    let mut taken = vec![false; body.vertex_count()];
    let mut patches = Vec::new();
    for seed in 0..body.vertex_count() as u32 {
        if std::mem::replace(&mut taken[seed as usize], true) {
            continue;
        }
        let centre = body.positions[seed as usize];
        let mut patch = vec![seed];
        let mut next = 0;
        while let Some(&v) = patch.get(next) {
            for &w in topology.neighbours(v) {
                let near = body.positions[w as usize].distance_squared(centre) < PATCH_M * PATCH_M;
                if near && !std::mem::replace(&mut taken[w as usize], true) {
                    patch.push(w);
                }
            }
            next += 1;
        }
        patches.push(patch);
    }
    patches
}

/// The rotation nearest to a matrix of positive determinant: R ← (R + R⁻ᵀ)/2 (Higham, "Computing the polar decomposition", 1986).
/// Another matrix gives no rotation.
fn nearest_rotation(matrix: DMat3) -> DMat3 {
    let size = matrix.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
    // A vertex or two on a line determine no rotation.
    if matrix.determinant() <= 1e-9 * size.powi(3) {
        return DMat3::IDENTITY;
    }
    let mut rotation = matrix * (1.0 / size);
    for _ in 0..POLAR_STEPS {
        rotation = (rotation + rotation.inverse().transpose()) * 0.5;
    }
    rotation
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math;
    use crate::mesh::samples::tube;

    /// An upright limb of 1 m.
    fn limb() -> TriMesh {
        tube(24, 60, |a, row| DVec3::new(0.05 * math::cos(a), 0.05 * math::sin(a), row / 60.0))
    }

    #[test]
    fn a_rigid_motion_carries_every_point_rigidly() {
        let body = limb();
        let turn = math::rotation(DVec3::new(1.0, 2.0, 0.5).normalize(), 1.2);
        let rigid = |p: &DVec3| turn * *p + DVec3::new(0.3, -0.2, 0.1);
        let motion = Motion::new(&body, &body.positions.iter().map(rigid).collect::<Vec<_>>());
        let points = [DVec3::new(0.06, 0.0, 0.4), DVec3::new(0.5, 0.1, -0.3), DVec3::ZERO];
        for (point, carried) in points.iter().zip(motion.carry(&points)) {
            assert!(rigid(point).distance(carried) < 1e-9, "{point}");
        }
    }

    #[test]
    fn a_sleeve_around_a_bending_limb_keeps_its_lengths_and_its_distance() {
        let body = limb();
        // The upper half bends by a right angle about y, over 30 cm in the middle.
        let bend = |p: DVec3| {
            let share = ((p.z - 0.35) / 0.3).clamp(0.0, 1.0);
            let angle = std::f64::consts::FRAC_PI_2 * share;
            let radius = 0.3 / std::f64::consts::FRAC_PI_2;
            let (sin, cos) = math::sin_cos(angle);
            let past = (p.z - 0.65).max(0.0);
            let (x, z) = (radius - (radius - p.x) * cos + past, 0.35 + (radius - p.x) * sin);
            let low = p.z.min(0.35) - 0.35;
            DVec3::new(if share > 0.0 { x } else { p.x }, p.y, if share > 0.0 { z } else { 0.35 + low })
        };
        let after: Vec<DVec3> = body.positions.iter().map(|&p| bend(p)).collect();
        let sleeve =
            tube(24, 60, |a, row| DVec3::new(0.06 * math::cos(a), 0.06 * math::sin(a), 0.1 + 0.8 * row / 60.0));
        let carried = sleeve.with_positions(Motion::new(&body, &after).carry(&sleeve.positions));
        let worst =
            carried.positions.iter().zip(&sleeve.positions).map(|(y, x)| y.distance(bend(*x))).fold(0.0, f64::max);
        // The bend itself stretches the outer side by a third; the blend stays within a few millimetres of it.
        assert!(worst < 0.004, "{worst}");
    }

    #[test]
    fn cloth_between_two_limbs_that_part_is_not_torn() {
        let [left, right] = [-0.1, 0.1].map(|x| {
            let mut limb = limb();
            limb.positions.iter_mut().for_each(|p| p.x += x);
            limb
        });
        let n = left.vertex_count() as u32;
        let mut body = left.clone();
        body.positions.extend(&right.positions);
        body.triangles.extend(right.triangles.iter().map(|t| t.map(|v| v + n)));
        let apart = |p: &DVec3| *p + DVec3::new(0.0, 0.2 * p.x.signum() * (1.0 - p.z), 0.0);
        let motion = Motion::new(&body, &body.positions.iter().map(apart).collect::<Vec<_>>());
        // A row of points 5 mm apart, from one limb to the other.
        let row: Vec<DVec3> = (0..=80).map(|i| DVec3::new(-0.2 + 0.005 * f64::from(i), -0.07, 0.2)).collect();
        let carried = motion.carry(&row);
        let longest = carried.windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
        assert!(longest < 0.04, "{longest}");
        assert!((carried[20].y - row[20].y + 0.16).abs() < 0.03 && (carried[60].y - row[60].y - 0.16).abs() < 0.03);
    }

    #[test]
    fn the_nearest_rotation_of_a_stretched_one_is_itself() {
        let turn = math::rotation(DVec3::Z, 2.0);
        let stretched = turn * DMat3::from_diagonal(DVec3::new(3.0, 0.2, 1.0));
        assert!((nearest_rotation(stretched) - turn).to_cols_array().iter().all(|x| x.abs() < 1e-12));
        assert_eq!(nearest_rotation(DMat3::ZERO), DMat3::IDENTITY);
    }
}
