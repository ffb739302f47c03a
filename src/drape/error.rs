//! Why there is no drape.

use crate::mechanics::coupled::CoupledError;
use crate::mechanics::energy::EnergyError;
use crate::mechanics::paper::PaperError;
use crate::mechanics::refine::SolveError;
use crate::parts::range_table::TableError;
use crate::scene::SceneError;

/// Why nothing came out.
#[derive(Debug, thiserror::Error)]
pub enum DrapeError {
    /// The distances make no table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A garment cannot be put over another.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The equations refused their input.
    #[error(transparent)]
    Paper(#[from] PaperError),
    /// The PARTs could not be solved together.
    #[error(transparent)]
    Coupled(#[from] CoupledError),
    /// The cloth cannot be set up at full resolution.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The cloth cannot be solved at full resolution.
    #[error(transparent)]
    Solve(#[from] SolveError),
}
