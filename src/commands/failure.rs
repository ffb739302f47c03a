//! Exit codes: 2 for what the user can mend, a full disk included, 1 for the rest.

use std::error::Error;
use std::process::ExitCode;

use crate::base::files::Unreadable;
use crate::body::ShapeError;
use crate::drape::DrapeError;
use crate::garment::fabric::FabricError;
use crate::garment::pattern::PatternError;
use crate::live::LiveError;
use crate::mechanics::energy::EnergyError;
use crate::mechanics::paper::PaperError;
use crate::mesh::MeshError;
use crate::parts::range_table::TableError;
use crate::record::RecordError;
use crate::scene::SceneError;
use crate::session::EditError;
use crate::study::evaluate::EvaluateError;
use crate::study::sweep::{MergeError, PlanError, StoreError};
use crate::study::table_search::SearchError;

/// A mistake in what the user gave that no library error describes.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct UserError(String);

impl UserError {
    /// The mistake as an error to return.
    #[allow(clippy::new_ret_no_self, reason = "nobody needs the type: it only picks the exit code")]
    pub(crate) fn new(message: impl Into<String>) -> anyhow::Error {
        Self(message.into()).into()
    }
}

/// What the program ends with after this error.
pub(crate) fn exit_code(error: &anyhow::Error) -> ExitCode {
    if error.chain().any(users_own) { ExitCode::from(2) } else { ExitCode::FAILURE }
}

fn users_own(cause: &(dyn Error + 'static)) -> bool {
    // A garment of which no vertex is free, say; what the solver itself fails at is ours.
    let drape = |error: &DrapeError| !matches!(error, DrapeError::Solve(_));
    cause.downcast_ref::<RecordError>().is_some_and(RecordError::is_users)
        || cause.downcast_ref::<DrapeError>().is_some_and(drape)
        || cause.is::<EnergyError>()
        || cause.is::<UserError>()
        || cause.is::<MeshError>()
        || cause.is::<SceneError>()
        || cause.is::<PatternError>()
        || cause.is::<Unreadable>()
        || cause.is::<TableError>()
        || cause.is::<FabricError>()
        || cause.is::<ShapeError>()
        || cause.is::<PaperError>()
        || cause.is::<EditError>()
        || cause.downcast_ref::<LiveError>().is_some_and(|error| !matches!(error, LiveError::Server(_)))
        || matches!(cause.downcast_ref::<EvaluateError>(), Some(EvaluateError::Fallen | EvaluateError::Layers { .. }))
        || cause.is::<PlanError>()
        || cause.is::<SearchError>()
        || cause.is::<StoreError>()
        || cause.is::<MergeError>()
}
