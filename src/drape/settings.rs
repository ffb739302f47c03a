//! Settings of a drape: everything but its scene. Plain data with one set of defaults.

use serde::{Deserialize, Serialize};

use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::{CoupledOptions, Motion};
use crate::mechanics::paper::PaperOptions;
use crate::mechanics::solver_options::SolverOptions;
use crate::parts::range_table::{METRES_PER_CM, RangeTable, TableError, TableRule};

/// Extents PARTs are cut to unless asked otherwise, cm: none, so that the table alone makes them.
pub const DEFAULT_EXTENTS_CM: &[f64] = &[];

/// The two models of stage two.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Equations (2) to (9) as read in [`paper`](crate::mechanics::paper): every PART for itself.
    Paper(PaperOptions),
    /// All PARTs at once: see [`coupled`](crate::mechanics::coupled).
    Coupled(CoupledOptions),
}

impl Default for Model {
    fn default() -> Self {
        Self::Coupled(CoupledOptions::default()).with_extents_cm(DEFAULT_EXTENTS_CM)
    }
}

impl Model {
    /// The name on the command line.
    #[must_use]
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Paper(_) => "paper",
            Self::Coupled(_) => "coupled",
        }
    }

    /// The model of this name with its defaults.
    #[must_use]
    pub(crate) fn by_name(name: &str) -> Option<Self> {
        match name {
            "paper" => Some(Self::Paper(PaperOptions::default())),
            "coupled" => Some(Self::default()),
            _ => None,
        }
    }

    /// Cut to these extents along the cloth, coarse to fine; the paper's model has none.
    #[must_use]
    pub fn with_extents_cm(mut self, extents_cm: &[f64]) -> Self {
        if let Self::Coupled(options) = &mut self {
            options.extents_m = extents_cm.iter().map(|cm| cm / 100.0).collect();
        }
        self
    }

    /// The extents, cm.
    #[must_use]
    pub(crate) fn extents_cm(&self) -> Vec<f64> {
        match self {
            Self::Paper(_) => Vec::new(),
            // A hundred times what was centimetres is off by an ulp.
            Self::Coupled(options) => {
                options.extents_m.iter().map(|m| (m / METRES_PER_CM * 1e6).round() / 1e6).collect()
            }
        }
    }

    /// The same model with this motion of its PARTs; the paper's model has one displacement a PART in any case.
    #[must_use]
    pub(crate) fn with_motion(mut self, motion: Motion) -> Self {
        if let Self::Coupled(options) = &mut self {
            options.motion = motion;
        }
        self
    }

    /// How its PARTs move.
    #[must_use]
    pub fn motion(&self) -> Motion {
        match self {
            Self::Paper(_) => Motion::Translation,
            Self::Coupled(options) => options.motion,
        }
    }

    /// How far `run` goes after stage two unless asked otherwise: the paper stops there.
    #[must_use]
    pub(crate) fn default_refine(&self) -> Refine {
        match self {
            Self::Paper(_) => Refine::Steps(0),
            Self::Coupled(_) => Refine::Converged,
        }
    }
}

/// How far to go at full resolution after stage two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refine {
    /// At most this many Newton steps; 0 is the two-stage scheme alone.
    Steps(usize),
    /// Until the residual force is under 1e-3 of the weight: the reference drape.
    #[default]
    Converged,
}

impl std::fmt::Display for Refine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Steps(n) => write!(f, "{n}"),
            Self::Converged => f.write_str("converged"),
        }
    }
}

impl std::str::FromStr for Refine {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "converged" => Ok(Self::Converged),
            steps => steps
                .parse()
                .map(Self::Steps)
                .map_err(|_| format!("found `{text}`, expected a number of steps or `converged`")),
        }
    }
}

/// The dials of one drape. The default is the paper's table, the coupled model and a knit, refined until it rests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// The range table of stage one.
    pub table: TableRule,
    /// PARTs with fewer vertices join a neighbour; 1 keeps the paper's definition.
    pub min_part: usize,
    /// The model of stage two.
    pub model: Model,
    /// Steps at full resolution.
    pub refine: Refine,
    /// The cloth.
    pub fabric: Fabric,
    /// Whether steps at full resolution keep cloth off cloth.
    pub self_contact: bool,
    /// Options of the solver at full resolution, for experiments.
    pub solver: SolverOptions,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            table: RangeTable::table_3().into(),
            min_part: 1,
            model: Model::default(),
            refine: Refine::default(),
            fabric: Fabric::default(),
            self_contact: true,
            solver: SolverOptions::default(),
        }
    }
}

impl Settings {
    /// The same with the table that its rule makes at these distances (m), rows that no longer depend on them.
    ///
    /// # Errors
    /// [`TableError`] where the distances make no table.
    pub(crate) fn resolved(&self, distances_m: &[f64]) -> Result<Self, TableError> {
        Ok(Self { table: self.table.resolve(distances_m)?.into(), ..self.clone() })
    }
}
