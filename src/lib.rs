//! Partwise drapes a garment over a body by the two-stage PART model of Luo, Jiang and Cong ("Two-stage discrete
//! mechanical model in three-dimensional space for garment simulation") and streams every stage to the Rerun viewer.
//!
//! # Frame and units
//! Right-handed, z up (against gravity); metres, kilograms, seconds, newtons inside. Range tables alone are written in
//! centimetres, as in the paper. A name that carries another unit says so (`_mm`, `_cm`, `_kpa`, `_ms`).
//!
//! # Module map
//! Data flows one way:
//! [`mesh`] → [`distance`] → [`parts`] → [`mechanics`] → [`drape`] → `record` → the command line.
//! [`shapes`] makes the built-in body and garments, [`range_table`] and [`fabric`] hold the two inputs a user tunes,
//! [`accuracy`] measures a result against a reference. Only `record` knows Rerun; only the binary knows clap.

pub mod accuracy;
pub mod assess;
pub mod distance;
pub mod drape;
pub mod fabric;
pub mod mechanics;
pub mod mesh;
pub mod parts;
pub mod range_table;
#[cfg(feature = "viewer")]
pub mod record;
pub mod sealed;
pub mod shapes;
pub mod sweep;
pub mod table_search;
pub mod whole_file;
pub mod wrinkles;

pub use glam::DVec3;

/// Gravitational acceleration, m/s². The paper's value ("g (= 9.8 N/kg)", section 2.2).
pub const GRAVITY: f64 = 9.8;
