//! Partwise drapes a garment over a body by the two-stage PART model of Luo, Jiang and Cong ("Two-stage discrete
//! mechanical model in three-dimensional space for garment simulation") and streams every stage to the Rerun viewer.
//!
//! # Frame and units
//! Right-handed, z up (against gravity); metres, kilograms, seconds, newtons inside. Range tables alone are written in
//! centimetres, as in the paper. A name that carries another unit says so (`_mm`, `_cm`, `_kpa`, `_ms`).
//!
//! # Draping a mesh
//! A [`SceneSpec`] names a body and a garment: built-in ones, as here, or mesh files (`SceneSpec::new("me.obj",
//! "shirt.obj")`), whose unit and up axis are guessed and reported in the notes.
//!
//! ```
//! use partwise::{SceneSpec, Settings, drape::Refine};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("draped.obj");
//! let input = SceneSpec::new("form", "flared-skirt@600").load()?;
//! let settings = Settings { refine: Refine::Steps(2), ..Settings::default() };
//! let draped = input.scene.drape(&settings)?;
//! println!("{} PARTs in {:?}", draped.parts.len(), draped.times.total);
//! input.write(path, &draped.positions)?;
//! # Ok(())
//! # }
//! ```
//!
//! `Settings::default()` continues until the garment is at rest. [`drape::drape`] takes an observer as well, which is
//! called after each step and can stop the run; `rayon::ThreadPool::install` chooses the threads. A [`Job`] holds the
//! same as plain data, with the metrics to compute. `examples/` drapes a mesh file, sweeps tables, and records into an
//! existing Rerun stream.
//!
//! # Modules
//! Data flows one way: [`mesh`] → [`body`] → [`garment`] → [`scene`] → [`parts`] → [`mechanics`] →
//! [`drape`](mod@drape) → [`study`] → `record`. [`parts::range_table`] and [`garment::fabric`] hold the two inputs to
//! tune, [`mechanics::methods`] the paper's reference methods, [`study`] metrics, accuracy, sweeps and the table search,
//! [`session`] a scene that is edited while it is draped. Only `record` imports Rerun.

#![cfg_attr(
    not(feature = "cli"),
    allow(dead_code, unused_imports, reason = "the command line uses what the library does not export")
)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod base;
pub mod body;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod commands;
pub mod drape;
pub mod garment;
#[cfg(feature = "viewer")]
pub mod live;
pub mod mechanics;
pub mod mesh;
pub mod parts;
#[doc(hidden)]
pub mod picture;
#[cfg(feature = "python")]
mod python;
#[cfg(feature = "viewer")]
pub mod record;
pub mod scene;
pub mod session;
pub mod study;

pub use drape::Settings;
pub use glam::DVec3;
pub use scene::{Scene, SceneSpec};
pub use study::job::Job;

/// Gravitational acceleration, m/s². The paper's value ("g (= 9.8 N/kg)", section 2.2).
pub const GRAVITY: f64 = 9.8;
