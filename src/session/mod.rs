//! A session: one owner of a scene that several clients edit.
//!
//! Every accepted edit makes a **state** with a number. Its PARTs and forces are known when [`Session::submit`] returns. A
//! [`Worker`], on a separate thread, then computes the newest state alone, in tasks short enough that the next edit does
//! not wait. Each result names the state that it belongs to:
//!
//! | an edit of | recomputes | keeps |
//! |---|---|---|
//! | the table, extents, the gap rule | PARTs, stage two | body, garment, distances, cloth, the drape at rest |
//! | the fabric | cloth, stage two, the drape at rest unless it rested in that fabric before | body, garment, distances, PARTs |
//! | a measurement, the garment | all | nothing |
//!
//! **Warm starts.** Both stages are always computed from the undraped garment, in milliseconds, as `run` does. The drape at rest
//! continues from the previous one. A rest does not depend on the range table, so an edit of the table keeps it, and a fabric
//! of the last few reuses its own ([`AtRest::reused`]). Without warm starts every result is the same as that of `run`, bit for bit.
//!
//! An impossible edit is refused with an error message, at once or when its computation fails, and the last good state remains.
//! The session uses no socket, viewer or file. Limits: an edit of measurements or garment starts cold, because the meshes differ.

mod edit;
mod handle;
mod results;
mod state;
mod task;
mod worker;

pub use edit::{Edit, EditError, FabricEdit, TableEdit, preset_names};
pub use handle::Session;
pub use results::{AtRest, Finished, LoadedScene, Pin, Preview, Refusal, Segmented, Snapshot, TrailPoint};
pub use worker::Worker;
