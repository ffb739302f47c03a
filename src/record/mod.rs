//! Recordings of a drape for the Rerun viewer. The only module that uses Rerun.
//!
//! A [`Recorder`] takes plain meshes and slices; [`paths`] lists the contents of a recording. Triangles are logged once, and later
//! steps send only the changes.

mod blueprint;
mod charts;
mod compare;
mod drape_tests;
mod error;
mod eye;
mod layout;
mod legend;
mod live;
mod meshes;
mod method;
mod native;
mod open_recording;
mod overlay;
mod page;
mod panel;
mod part_marks;
pub mod paths;
mod recorder;
mod remote;
mod scatter;
mod sinks;
mod step;
mod tabs;
pub mod web;
mod wrinkles;
mod writer;

pub use crate::picture::colour::Overlay;
pub(crate) use compare::{Colours, Compared};
pub(crate) use drape_tests::{DrapeTestRecording, NamedOutline};
pub use error::RecordError;
pub use layout::{Layout, Tab};
pub(crate) use live::{LiveEncoder, LiveShape, PinnedView, eyes, outlines, rest_colours};
pub(crate) use method::MethodView;
pub use open_recording::{RecordOptions, RecordSummary};
pub(crate) use overlay::PatternView;
pub use page::Limits;
pub(crate) use page::{Connection, Hosts, Refused, Server, file, name_of_run, query, whole};
pub use panel::Panel;
pub use recorder::Recorder;
pub(crate) use scatter::{Picture, ScatterPoint};
pub use sinks::Sink;
pub(crate) use step::OutfitView;
pub use step::StepView;
pub(crate) use wrinkles::{FoldView, WrinkleView};

#[cfg(test)]
mod tests;
