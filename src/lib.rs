//! Partwise drapes a garment over a body by the two-stage PART model of Luo, Jiang and Cong ("Two-stage discrete
//! mechanical model in three-dimensional space for garment simulation") and streams every stage to the Rerun viewer.
//!
//! # Frame and units
//! Right-handed, z up (against gravity); metres, kilograms, seconds, newtons inside. Range tables alone are written in
//! centimetres, as in the paper. A name that carries another unit says so (`_mm`, `_cm`, `_kpa`, `_ms`).
//!
//! # Draping a mesh
//! A [`SceneSpec`] names body and garment: built in, as here, or OBJ files (`SceneSpec::new("me.obj", "shirt.obj")`),
//! whose unit and up axis are guessed, and said in the notes.
//!
//! ```
//! use partwise::{SceneSpec, Settings, drape};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("draped.obj");
//! let input = SceneSpec::new("form", "flared-skirt@600").load()?;
//! input.notes().iter().chain(&input.warnings()).for_each(|line| eprintln!("{line}"));
//! let settings = Settings { refine: drape::Refine::Steps(2), ..Settings::default() };
//! let draped = drape::drape(&input.scene, &settings, &mut drape::unobserved)?;
//! println!("{} PARTs in {:?}", draped.parts.len(), draped.times.total);
//! input.write(path, &draped.positions)?;
//! # Ok(())
//! # }
//! ```
//!
//! `Settings::default()` without the third line goes on until the drape rests. A [`Job`] is the same as plain data,
//! with what is to be measured; `examples/` drapes an OBJ, sweeps tables, and records into a Rerun stream of one's own.
//!
//! # Module map
//! Data flows one way:
//! [`mesh`] → [`distance`] → [`scene`] → [`parts`] → [`mechanics`] → [`drape()`](drape::drape) → [`job`] → `record` →
//! the command line. [`shapes`] makes the built-in body and garments, [`pattern`] reads sewing patterns and [`sewing`] puts
//! them on, [`range_table`] and [`fabric`] hold the two inputs a user tunes, [`accuracy`] measures a result against a
//! reference, [`figures`] are what everybody reads of it, [`sweep`] runs jobs by the hundred, [`session`]
//! keeps one that is edited while it is draped. Only `record` knows Rerun; only the binary knows clap.

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
pub mod methods;
pub mod parts;
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
