//! Representable error: what one motion per PART cannot hold of a reference, whatever the mechanics.
//!
//! With u_i the displacement of vertex i from its start to the reference, and X_i its start,
//!
//! - translation: u_i ≈ mean of u over the PART, the least squares answer;
//! - affine: u_i ≈ b_p + A_p X_i, least squares over the PART;
//! - blended: the same two with the coupled model's blending weights, least squares over the whole garment.
//!
//! The RMS of the remainder splits a table's fault from a model's. The blended affine one is what the coupled model's PARTs could hold
//! at best, before its relaxations. Source: design of the accuracy report; the least squares fits are textbook.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::quantile::ErrorSummary;
use crate::mechanics::coupled::{Motion, Motions, Weights};
use crate::mesh::Topology;
use crate::parts::{Parts, UNASSIGNED};

/// Ridge of the affine fit relative to the spread of a PART: it leaves the direction across a flat PART undetermined at no
/// cost to the others (its error is this share of the fit).
const RIDGE: f64 = 1e-9;

/// What the best motion of each kind leaves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Representable {
    /// RMS with one translation a PART, mm.
    pub translation_rms_mm: f64,
    /// RMS with one affine displacement a PART, mm.
    pub affine_rms_mm: f64,
    /// RMS with one translation a PART, blended over the seams, mm.
    pub blended_translation_rms_mm: f64,
    /// RMS with one affine displacement a PART, blended over the seams, mm.
    pub blended_affine_rms_mm: f64,
}

/// The errors of `parts` for the displacement from `start` to `reference`. A vertex in no PART keeps still, or where motions are blended,
/// goes with the nearest; one that is `held` keeps still.
#[must_use]
pub fn representable(
    topology: &Topology,
    parts: &Parts,
    held: &[bool],
    start: &[DVec3],
    reference: &[DVec3],
) -> Representable {
    let u: Vec<DVec3> = reference.iter().zip(start).map(|(r, s)| *r - *s).collect();
    let means: Vec<DVec3> = parts.map(|_, part| mean(&part.vertices, &u));
    let gradients: Vec<DMat3> = parts.map(|p, part| {
        let middle = mean(&part.vertices, start);
        let (mut normal, mut right) = (DMat3::ZERO, DMat3::ZERO);
        for &v in &part.vertices {
            let (x, change) = (start[v as usize] - middle, u[v as usize] - means[p]);
            normal += outer(x, x);
            right += outer(change, x);
        }
        let spread = normal.x_axis.x + normal.y_axis.y + normal.z_axis.z;
        if spread <= 0.0 {
            return DMat3::ZERO;
        }
        right * (normal + DMat3::from_diagonal(DVec3::splat(RIDGE * spread))).inverse()
    });
    let middles: Vec<DVec3> = parts.map(|_, part| mean(&part.vertices, start));
    let rms = |guess: &dyn Fn(usize) -> DVec3| {
        let errors: Vec<f64> = (0..u.len()).map(|v| u[v].distance(guess(v))).collect();
        ErrorSummary::of(&errors).rms_mm
    };
    let part_of = |v: usize| parts.part_of_vertex[v] as usize;
    let still = |v: usize| parts.part_of_vertex[v] == UNASSIGNED;
    let weights = Weights::new(topology, start, parts).without(held);
    let blended = |motion| {
        let fit = Motions::new(parts, weights.clone(), start, motion).nearest(start, &u);
        fit.map_or(f64::NAN, |fit| rms(&|v| fit[v]))
    };
    Representable {
        translation_rms_mm: rms(&|v| if still(v) { DVec3::ZERO } else { means[part_of(v)] }),
        affine_rms_mm: rms(&|v| {
            if still(v) {
                return DVec3::ZERO;
            }
            let p = part_of(v);
            means[p] + gradients[p] * (start[v] - middles[p])
        }),
        blended_translation_rms_mm: blended(Motion::Translation),
        blended_affine_rms_mm: blended(Motion::Affine),
    }
}

fn mean(vertices: &[u32], values: &[DVec3]) -> DVec3 {
    vertices.iter().map(|&v| values[v as usize]).sum::<DVec3>() / vertices.len() as f64
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
