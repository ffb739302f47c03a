//! Body and garment: the arguments shared by every command that needs them.

use crate::SceneSpec;
use crate::base::files::has_ending;
use crate::garment::MeshCache;
use crate::mesh::{Axis, Unit};
use crate::scene::{DistanceTo, Loaded, SceneError};
use clap::Args;

use super::MeasurementArgs;

/// Body and garment.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Body and garment")]
pub(crate) struct InputArgs {
    /// Body: `form` (the built-in dress form), a TOML file of its measurements, or an OBJ file
    #[arg(long, value_name = "form|FILE", default_value_t = SceneSpec::default().body)]
    body: String,
    /// Garment: pullover-1, pullover-2, flared-skirt, low-cut-dress, long-sleeved-dress, any of them @VERTICES, a TOML
    /// spec, an OBJ file, or a sewing pattern (JSON). Given several times, garments are worn over each other, inner to outer
    #[arg(long, value_name = "NAME[@VERTICES]|FILE", default_values_t = [SceneSpec::default().garment])]
    garment: Vec<String>,
    /// What distances count to where garments are worn over each other: the `body`, or what lies `below`, whichever is nearer
    #[arg(long, value_name = "body|below", default_value_t = SceneSpec::default().distance_to)]
    distance_to: DistanceTo,
    /// Sew this pattern (JSON as GarmentCode writes it) and put it on the body, in place of --garment
    #[arg(long, value_name = "FILE.json", conflicts_with = "garment", value_parser = pattern_file)]
    pattern: Option<String>,
    /// TOML file that names the fabrics of a garment's panels, or groups: `default = "interlock"`, and under `[panels]` lines such as
    /// `left_cuff = "denim"` or `"sleeve*" = "rib.toml"` (a file beside it) [default: NAME.fabrics.toml beside NAME.json or NAME.obj]
    #[arg(long, value_name = "FILE.toml")]
    fabrics: Option<String>,
    /// Length of the edges that a pattern is meshed with
    #[arg(long, value_name = "CM", default_value_t = SceneSpec::default().edge_cm)]
    edge_length: f64,
    /// Take one group or object of the body's file
    #[arg(long, value_name = "GROUP")]
    body_group: Option<String>,
    /// Take one group or object of the garment's file
    #[arg(long, value_name = "GROUP")]
    garment_group: Option<String>,
    /// Unit of the files: m, dm, cm, mm, in, ft [default: guessed from the body's height]
    #[arg(long)]
    unit: Option<Unit>,
    /// Up axis of the files: x, y, z [default: guessed from the body]
    #[arg(long, value_name = "AXIS")]
    up: Option<Axis>,
    /// Accept a body that is not closed, and tell inside from outside by its normals
    #[arg(long)]
    open_body: bool,
    /// Join garment and body vertices that lie at exactly the same place
    #[arg(long)]
    weld: bool,
    /// Rest shape of the garment: `own` edges, its `texture` coordinates in metres, an OBJ file of the same faces, or `auto`: the
    /// texture coordinates where they are the flat pattern it was cut by, in whatever unit, else its own edges
    #[arg(long, value_name = "auto|own|texture|FILE.obj", default_value_t = SceneSpec::default().rest)]
    rest: String,
    /// Hold edges of the garment where they are: `top` (its highest edge, a waistband, say), `top:2` (the highest of its second connected
    /// part) or those that a group of its file lies on; several with commas [default: the waistband of a built-in skirt; of a file nothing]
    #[arg(long, value_name = "top|top:N|GROUP")]
    hold: Option<String>,
    /// Leave garment vertices that start inside the body where they are
    #[arg(long)]
    no_push_out: bool,
    /// Make the built-in form and garment anew instead of reading those made before from the user's cache folder
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    pub(crate) measurements: MeasurementArgs,
}

impl InputArgs {
    /// What the flags ask for.
    pub(crate) fn spec(&self) -> anyhow::Result<SceneSpec> {
        Ok(SceneSpec {
            body: self.body.clone(),
            garment: self.pattern.as_ref().or(self.garment.first()).cloned().unwrap_or_default(),
            over: self.garment.iter().skip(1).cloned().collect(),
            fabrics: Vec::new(),
            fabrics_file: self.fabrics.clone(),
            distance_to: self.distance_to,
            edge_cm: self.edge_length,
            body_group: self.body_group.clone(),
            garment_group: self.garment_group.clone(),
            unit: self.unit,
            up: self.up,
            open_body: self.open_body,
            weld: self.weld,
            rest: self.rest.clone(),
            hold: self.hold.clone(),
            push_out: !self.no_push_out,
            measurements: self.measurements.spec()?,
        })
    }

    /// Where built-in meshes are kept.
    pub(crate) fn meshes(&self) -> MeshCache {
        if self.no_cache { MeshCache::default() } else { MeshCache::in_user_cache() }
    }

    /// Loads a scene of these flags, saying where measurements that make no body were given.
    pub(crate) fn load(&self, spec: &SceneSpec) -> anyhow::Result<Loaded> {
        spec.load_with(&self.meshes()).map_err(|error| match error {
            SceneError::Measurements(source) => anyhow::Error::new(source).context(self.measurements.place()),
            other => other.into(),
        })
    }
}

/// By its ending a garment's file is known for what it is.
fn pattern_file(name: &str) -> Result<String, String> {
    if has_ending(name.as_ref(), "json") {
        return Ok(name.to_owned());
    }
    Err(format!("found `{name}`, expected a file that ends in `.json`; a mesh or a description is a --garment"))
}
