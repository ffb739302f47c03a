//! Representable error: what remains when each PART takes the mean of a reference displacement over its vertices.
//!
//! With one displacement a PART, no mechanics can come closer to the reference, in the root mean square over vertices; so it
//! splits a table's fault from the model's. A vertex in no PART keeps still, and its whole displacement remains.
//!
//! ```text
//! e² = (1/n) Σ_k Σ_{i ∈ S_k} |u_i − ū_k|²
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u_i | reference displacement of vertex i | m |
//! | ū_k | its mean over PART k | m |
//! | e | representable error | m |

use glam::DVec3;

use super::{Parts, UNASSIGNED};

/// The representable error e of these PARTs, m, for one reference displacement (m) per vertex; 0 for a garment without
/// vertices. Displacements beyond the list's end count as zero.
#[must_use]
pub fn representable_rms_m(parts: &Parts, displacement: &[DVec3]) -> f64 {
    let of = |v: u32| displacement.get(v as usize).copied().unwrap_or(DVec3::ZERO);
    let mut sum = 0.0;
    for part in &parts.parts {
        let mean = part.vertices.iter().map(|&v| of(v)).sum::<DVec3>() / part.vertices.len() as f64;
        sum += part.vertices.iter().map(|&v| of(v).distance_squared(mean)).sum::<f64>();
    }
    let still = parts.part_of_vertex.iter().zip(0u32..).filter(|&(&p, _)| p == UNASSIGNED);
    sum += still.map(|(_, v)| of(v).length_squared()).sum::<f64>();
    (sum / parts.part_of_vertex.len().max(1) as f64).sqrt()
}
