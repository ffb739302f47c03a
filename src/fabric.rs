//! Fabrics: the measured constants of a cloth, with their source.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ρ | areal density | kg/m² |
//! | k_u, k_v | membrane stiffness along weft and warp | N/m |
//! | μ | in-plane shear stiffness | N/m |
//! | ν | Poisson's ratio, couples weft and warp | – |
//! | B | bending stiffness along weft, on the bias and along warp | N·m |
//! | μ_f | Coulomb friction against the body | – |

use serde::{Deserialize, Serialize};

/// The constants of one fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// What it is called on the command line and in reports.
    pub name: String,
    /// Where the figures come from.
    pub source: String,
    /// Areal density ρ, kg/m².
    pub density_kg_per_m2: f64,
    /// Thickness, m: also how far its middle surface stays off the body.
    pub thickness_m: f64,
    /// Membrane stiffness along the weft k_u, N/m.
    pub stretch_weft_n_per_m: f64,
    /// Membrane stiffness along the warp k_v, N/m.
    pub stretch_warp_n_per_m: f64,
    /// Shear stiffness μ, N/m.
    pub shear_n_per_m: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Bending stiffness along weft, at 45 degrees and along warp, N·m.
    pub bending_nm: [f64; 3],
    /// Coulomb friction coefficient against the body.
    pub friction: f64,
}
