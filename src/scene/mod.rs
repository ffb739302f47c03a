//! Body and garments, placed and ready for the stages.
//!
//! [`SceneSpec`] names body and garments, as files or built in. [`SceneSpec::load`] reads them in this order: the garment is
//! oriented to face away from the body, its rest shape is taken before anything moves, the garment must be near the body,
//! and vertices that start inside the body are pushed out. [`Scene::of_meshes`] does the same with meshes in memory.

mod carry;
mod details;
mod error;
mod layering;
mod loaded;
mod loading;
mod materials;
mod outfit;
mod placement;
mod poses;
mod spec;

pub use crate::body::distance::push_out::{PushOutReport, push_out};
pub use error::SceneError;
pub use loaded::{Loaded, Tailored};
pub use materials::{CutError, PanelFabrics, Swatch};
pub use outfit::{DistanceTo, Layer, Scene};
pub use placement::{Placement, closeness, facing_body};
pub(crate) use poses::{PoseReader, pose_files};
pub use spec::{DRESS_FORM, FileRole, SceneSpec};
