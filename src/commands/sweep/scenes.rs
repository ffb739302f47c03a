//! The body and garment of a point: made or read exactly as `partwise run` does, once for all points that share them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use clap::Parser;
use partwise::drape::Scene;
use partwise::shapes::BodySpec;
use partwise::sweep::{Input, Point, PointError};

use crate::commands::inputs::InputArgs;

/// The arguments of `run` that say what is draped over what.
#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct Named {
    #[command(flatten)]
    input: InputArgs,
}

/// What is draped over what, and how far apart they are.
pub(crate) struct Placed {
    /// Body, garment and rest shape.
    pub(crate) scene: Scene,
    /// Unsigned distance of each garment vertex to the body, m: what quantile tables and searches are made from.
    pub(crate) distance_m: Vec<f64>,
    /// What `run` would warn of.
    pub(crate) warnings: Vec<String>,
}

impl Placed {
    /// Makes or reads a body and a garment by their names on the command line.
    pub(crate) fn load(body: &str, garment: &str, measurements: &BodySpec) -> anyhow::Result<Self> {
        let mut arguments = vec!["--body".to_owned(), body.to_owned(), "--garment".to_owned(), garment.to_owned()];
        for (name, value) in toml::Table::try_from(measurements)? {
            if let Some(cm) = value.as_float() {
                arguments.push(format!("--measure={}={cm}", name.trim_end_matches("_cm")));
            }
        }
        let inputs = Named::try_parse_from(arguments)?.input.load()?;
        let surface = inputs.scene.body.nearest_all(&inputs.scene.garment.positions);
        let distance_m = surface.iter().map(|s| s.signed_distance.abs()).collect();
        Ok(Self { scene: inputs.scene, distance_m, warnings: inputs.warnings })
    }
}

/// Scenes by the hash of what they are made from.
#[derive(Default)]
pub(crate) struct Scenes {
    made: Mutex<BTreeMap<String, Arc<Placed>>>,
}

impl Scenes {
    /// The scene of a point. Others wait while one is made: they most likely want the same.
    pub(crate) fn of(&self, point: &Point) -> Result<Arc<Placed>, PointError> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        let id = point.scene_id();
        if let Some(placed) = made.get(&id) {
            return Ok(placed.clone());
        }
        let name = |input: &Input| input.file.as_ref().map_or(input.label.clone(), |f| f.display().to_string());
        let placed = Placed::load(&name(&point.body.input), &name(&point.garment), &point.body.measurements);
        let placed = Arc::new(placed.map_err(|e| PointError::Failed(format!("{e:#}")))?);
        made.insert(id, placed.clone());
        Ok(placed)
    }

    /// What the scenes' makers warned of, garment by garment.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        made.values().flat_map(|placed| placed.warnings.iter().cloned()).collect()
    }
}
