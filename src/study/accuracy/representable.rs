//! Representable error: the part of a reference displacement that no motion of the PARTs can represent, independent of the
//! mechanics.
//!
//! With u_i the displacement of vertex i from its start to the reference, and X_i its start,
//!
//! - translation: u_i ≈ mean of u over the PART, the least squares answer;
//! - affine: u_i ≈ b_p + A_p X_i, least squares over the PART, where it has more than three vertices;
//! - blended: the same two with the coupled model's blending weights, least squares over the whole garment.
//!
//! The RMS of the remainder separates the error of a range table from the error of a model. The blended affine error is the best
//! that the coupled model can reach before its relaxation. Source: textbook least squares.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::moments::Moments;
use super::summary::{MM_PER_M, rms_mm};
use crate::mechanics::coupled::{Motion, Motions, Weights};
use crate::mesh::Topology;
use crate::parts::{Parts, UNASSIGNED};

/// RMS remainders of the best motions, by kind of motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Representable {
    /// RMS with one translation a PART, mm.
    pub translation_rms_mm: f64,
    /// RMS with one affine displacement a PART, mm.
    pub affine_rms_mm: f64,
    /// RMS with one translation a PART, blended over the seams, mm.
    pub blended_translation_rms_mm: f64,
    /// RMS with one affine displacement a PART, blended over the seams, mm.
    pub blended_affine_rms_mm: f64,
}

/// The representable errors of `parts` for the displacement from `start` to `reference` (m). A vertex in no PART stays in place, or
/// follows the nearest PARTs where motions are blended. A held vertex stays in place.
pub(crate) fn representable(
    topology: &Topology,
    parts: &Parts,
    held: &[bool],
    start: &[DVec3],
    reference: &[DVec3],
) -> Representable {
    let u: Vec<DVec3> = reference.iter().zip(start).map(|(r, s)| *r - *s).collect();
    let weights = Weights::new(topology, start, parts).without(held);
    let blended = |motion| {
        let fit = Motions::new(parts, weights.clone(), start, motion).nearest(start, &u);
        fit.map_or(f64::NAN, |fit| rms_mm(&u, &fit))
    };
    Representable {
        translation_rms_mm: MM_PER_M * unblended_rms_m(parts, start, &u, Motion::Translation),
        affine_rms_mm: MM_PER_M * unblended_rms_m(parts, start, &u, Motion::Affine),
        blended_translation_rms_mm: blended(Motion::Translation),
        blended_affine_rms_mm: blended(Motion::Affine),
    }
}

/// The RMS remainder of the displacement `u` from `start` with one unblended motion per PART, m; 0 for a garment without vertices.
fn unblended_rms_m(parts: &Parts, start: &[DVec3], u: &[DVec3], motion: Motion) -> f64 {
    let squared = |vertices: &[u32]| {
        let mut sums = Moments::default();
        Moments::of_each(vertices, start, u).iter().for_each(|m| sums += m);
        sums.error(motion)
    };
    let moved: f64 = parts.parts.iter().map(|part| squared(&part.vertices)).sum();
    let still = parts.part_of_vertex.iter().zip(u).filter(|(p, _)| **p == UNASSIGNED);
    let still: f64 = still.map(|(_, u)| u.length_squared()).sum();
    ((moved + still) / u.len().max(1) as f64).sqrt()
}
