//! Errors of a validation.

use crate::garment::fabric::FabricError;
use crate::mechanics::energy::EnergyError;
use crate::mechanics::refine::SolveError;
use crate::study::drape_test::DrapeTestError;

/// Why a validation failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ValidationError {
    /// The cases do not parse.
    #[error("assets/validation/cases.csv: {0}")]
    Csv(#[from] csv::Error),
    /// A case names no known test.
    #[error("assets/validation/cases.csv: found the test `{test}`, expected a standard or a strip")]
    Test {
        /// Its name.
        test: String,
    },
    /// A fabric does not parse.
    #[error(transparent)]
    Fabric(#[from] FabricError),
    /// A drape test failed.
    #[error(transparent)]
    Drape(#[from] DrapeTestError),
    /// A strip cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// A strip did not rest.
    #[error(transparent)]
    Solve(#[from] SolveError),
}
