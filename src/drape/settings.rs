//! What a run is given: the scene, the model and its dials.

use crate::distance::Body;
use crate::fabric::Fabric;
use crate::mechanics::coupled::CoupledOptions;
use crate::mechanics::paper::PaperOptions;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::range_table::RangeTable;

/// What is draped over what; stays the same while tables and fabrics vary.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The body's surface, m.
    pub body_mesh: TriMesh,
    /// The same, ready for distance queries.
    pub body: Body,
    /// The garment as placed, undraped, m.
    pub garment: TriMesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest shape.
    pub rest: RestShape,
    /// Vertices that stay where they are worn (a waistband's edge).
    pub held: Vec<u32>,
}

/// The two models of stage two.
#[derive(Debug, Clone, PartialEq)]
pub enum Model {
    /// Equations (2) to (9) as read in [`paper`](crate::mechanics::paper): every PART for itself.
    Paper(PaperOptions),
    /// All PARTs at once, as the nodes of a coarse cloth: see [`coupled`](crate::mechanics::coupled).
    Coupled(CoupledOptions),
}

impl Model {
    /// The name on the command line.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Paper(_) => "paper",
            Self::Coupled(_) => "coupled",
        }
    }
}

/// How far to go at full resolution after stage two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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

/// The dials of one run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The range table of stage one.
    pub table: RangeTable,
    /// PARTs with fewer vertices join a neighbour; 1 keeps the paper's definition.
    pub min_part: usize,
    /// The model of stage two.
    pub model: Model,
    /// Steps at full resolution.
    pub refine: Refine,
    /// The cloth.
    pub fabric: Fabric,
}
