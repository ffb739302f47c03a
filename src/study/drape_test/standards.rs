//! Specimen, mesh and start of a drape test, and the radii of the standards.

use crate::garment::fabric::FabricError;
use crate::mechanics::energy::EnergyError;
use crate::mechanics::refine::SolveError;
use crate::mesh::rest::RestError;

/// Radii of a standard's specimen and disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Standard {
    /// Name on the command line.
    pub name: &'static str,
    /// Radius of the specimen, m.
    pub specimen_m: f64,
    /// Radius of the disc, m.
    pub disc_m: f64,
}

/// The drape tests of BS 5058 and ISO 9073-9 (specimens 24, 30 and 36 cm across for limp, medium and stiff cloth on a disc of 18 cm) and of
/// JIS L 1096 (25.4 cm on 12.7 cm).
pub(crate) const STANDARDS: [Standard; 4] = [
    Standard { name: "iso-30", specimen_m: 0.15, disc_m: 0.09 },
    Standard { name: "iso-24", specimen_m: 0.12, disc_m: 0.09 },
    Standard { name: "iso-36", specimen_m: 0.18, disc_m: 0.09 },
    Standard { name: "jis", specimen_m: 0.127, disc_m: 0.0635 },
];

/// Least rows across the rim: fewer cannot fold.
const MIN_ROWS: usize = 4;

/// Least width of the rim, m, and largest radius of a specimen, m. Beyond them the test is not one of cloth.
const MIN_RIM_M: f64 = 0.005;
const MAX_SPECIMEN_M: f64 = 1.0;

/// Why a drape test failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DrapeTestError {
    /// The specimen is too coarse to fold.
    #[error("{rows} rows of cells across the rim cannot fold; expected at least {MIN_ROWS}")]
    TooCoarse {
        /// Rows asked for.
        rows: usize,
    },
    /// The diameters are not those of a specimen that overhangs a disc.
    #[error(
        "found a specimen {specimen_cm} cm across on a disc {disc_cm} cm across, expected a disc of at least {} cm and a specimen at least {} cm \
         wider, of at most {} cm; are the two exchanged, or in another unit?",
        200.0 * MIN_RIM_M, 200.0 * MIN_RIM_M, 200.0 * MAX_SPECIMEN_M
    )]
    Radii {
        /// Diameter of the specimen, cm.
        specimen_cm: f64,
        /// Diameter of the disc, cm.
        disc_cm: f64,
    },
    /// No such fabric.
    #[error(transparent)]
    Fabric(#[from] FabricError),
    /// The specimen has no rest shape.
    #[error(transparent)]
    Rest(#[from] RestError),
    /// The energy cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The solver failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The table cannot be read or written.
    #[error("assets/cusick/targets.csv: {0}")]
    Csv(#[from] csv::Error),
}

/// Specimen, mesh and start of a drape test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DrapeTest {
    /// Radius of the specimen, m.
    pub specimen_m: f64,
    /// Radius of the disc, m.
    pub disc_m: f64,
    /// Rows of cells from the disc's edge to the rim.
    pub rows: usize,
    /// Angle by which weft and warp are turned through the mesh, rad.
    pub turned: f64,
    /// Number of the start, from 0: the phases of its waves.
    pub start: u32,
}

impl Default for DrapeTest {
    /// The first standard with edges of half a centimetre.
    fn default() -> Self {
        Self { specimen_m: STANDARDS[0].specimen_m, disc_m: STANDARDS[0].disc_m, rows: 12, turned: 0.0, start: 0 }
    }
}

impl DrapeTest {
    /// Refuses radii and meshes that are no drape test.
    ///
    /// # Errors
    /// [`DrapeTestError::TooCoarse`] and [`DrapeTestError::Radii`].
    pub(crate) fn check(&self) -> Result<(), DrapeTestError> {
        if self.rows < MIN_ROWS {
            return Err(DrapeTestError::TooCoarse { rows: self.rows });
        }
        let rim = self.specimen_m - self.disc_m;
        if rim >= MIN_RIM_M && self.disc_m >= MIN_RIM_M && self.specimen_m <= MAX_SPECIMEN_M {
            return Ok(());
        }
        Err(DrapeTestError::Radii { specimen_cm: 200.0 * self.specimen_m, disc_cm: 200.0 * self.disc_m })
    }
}
