//! Arguments for body, measurements, garment and fabric, shared by the commands that need a scene.

use std::path::{Path, PathBuf};

use crate::SceneSpec;
use crate::base::files::{has_ending, read_text};
use crate::body::BodySpec;
use crate::garment::MeshCache;
use crate::garment::fabric::{DEFAULT_FABRIC, Fabric};
use crate::mesh::{Axis, Front, Unit};
use crate::scene::{CutError, DistanceTo, Loaded, SceneError};
use anyhow::Context as _;
use clap::Args;

use super::runtime::{self, refuse};

/// Body and garment.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Body and garment")]
pub(crate) struct InputArgs {
    /// Body: `form` (the built-in dress form), a TOML file of its measurements, or a mesh file (OBJ, PLY, STL, glTF, .npz); for `run` also
    /// a folder of mesh files, the poses of one body
    #[arg(long, value_name = "form|FILE", default_value_t = SceneSpec::default().body)]
    body: String,
    /// Garment: pullover-1, pullover-2, flared-skirt, low-cut-dress or long-sleeved-dress, each optionally with @VERTICES; a TOML
    /// specification, a mesh file, or a sewing pattern (JSON, DXF). Several garments are layered in the given order, innermost first
    #[arg(long, value_name = "NAME[@VERTICES]|FILE", default_values_t = [SceneSpec::default().garment])]
    garment: Vec<String>,
    /// Distances of layered garments: to the `body`, or to the nearest surface `below`, body or garment
    #[arg(long, value_name = "body|below", default_value_t = SceneSpec::default().distance_to)]
    distance_to: DistanceTo,
    /// Sewing pattern to sew around the body, in place of --garment: JSON in the GarmentCode format, or a DXF (ASTM D6673, AAMA) with
    /// FILE.sewing.toml beside it
    #[arg(long, value_name = "FILE.json|FILE.dxf", conflicts_with = "garment", value_parser = pattern_file)]
    pattern: Option<String>,
    /// TOML file with a fabric for each panel or group: `default = "interlock"`, then under `[panels]` lines such as
    /// `left_cuff = "denim"` or `"sleeve*" = "rib.toml"` (relative to this file) [default: NAME.fabrics.toml beside NAME.json or NAME.obj]
    #[arg(long, value_name = "FILE.toml")]
    fabrics: Option<String>,
    /// Edge length of the mesh of a sewing pattern
    #[arg(long, value_name = "CM", default_value_t = SceneSpec::default().edge_cm)]
    edge_length: f64,
    /// Use only this group or object of the body's file
    #[arg(long, value_name = "GROUP")]
    body_group: Option<String>,
    /// Use only this group or object of the garment's file
    #[arg(long, value_name = "GROUP")]
    garment_group: Option<String>,
    /// Unit of both files: m, dm, cm, mm, in, ft [default: guessed for each file, the body's from its height and the garment's from how
    /// it lies about the body]
    #[arg(long)]
    unit: Option<Unit>,
    /// Up axis of both files: x, y, z [default: guessed for each file]
    #[arg(long, value_name = "AXIS")]
    up: Option<Axis>,
    /// Unit of the body's file, if it is not --unit
    #[arg(long, value_name = "UNIT")]
    body_unit: Option<Unit>,
    /// Up axis of the body's file, if it is not --up
    #[arg(long, value_name = "AXIS")]
    body_up: Option<Axis>,
    /// Unit of the garments' files, if it is not --unit
    #[arg(long, value_name = "UNIT")]
    garment_unit: Option<Unit>,
    /// Up axis of the garments' files, if it is not --up
    #[arg(long, value_name = "AXIS")]
    garment_up: Option<Axis>,
    /// Axis of the body's file that its front points along, such as z or -y; a sewing pattern is turned to it [default: found from
    /// trunk and feet]
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    front: Option<Front>,
    /// Accept a body mesh that is not closed; its normals then separate inside from outside
    #[arg(long)]
    open_body: bool,
    /// Merge vertices of a mesh that have exactly the same position
    #[arg(long)]
    weld: bool,
    /// Rest shape of the garment: its `own` edges, its `texture` coordinates in metres, a mesh file of the same faces, or `auto`:
    /// the texture coordinates if they are the flat sewing pattern, in any unit, otherwise the garment's own edges
    #[arg(long, value_name = "auto|own|texture|FILE", default_value_t = SceneSpec::default().rest)]
    rest: String,
    /// Edges of the garment that stay fixed: `top` (its highest edge, such as a waistband), `top:2` (the highest edge of its second
    /// connected part) or the edges of a group; several with commas [default: the waistband of a built-in skirt, otherwise nothing]
    #[arg(long, value_name = "top|top:N|GROUP")]
    hold: Option<String>,
    /// Do not move garment vertices that start inside the body out of it
    #[arg(long)]
    no_push_out: bool,
    /// Generate the built-in form and garments instead of reading them from the user's cache folder
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    pub(crate) measurements: MeasurementArgs,
}

impl InputArgs {
    /// The scene that the arguments specify.
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
            body_unit: self.body_unit,
            body_up: self.body_up,
            garment_unit: self.garment_unit,
            garment_up: self.garment_up,
            front: self.front,
            open_body: self.open_body,
            weld: self.weld,
            rest: self.rest.clone(),
            hold: self.hold.clone(),
            push_out: self.pushes_out(),
            measurements: self.measurements.spec()?,
            ..SceneSpec::default()
        })
    }

    /// Whether the garment is a single sewing pattern.
    pub(crate) fn is_a_pattern(&self) -> bool {
        self.pattern.is_some() || matches!(&self.garment[..], [one] if has_ending(one.as_ref(), "json"))
    }

    /// The body as it was given.
    pub(crate) fn body(&self) -> &str {
        &self.body
    }

    /// Whether vertices that start inside the body are moved out of it.
    pub(crate) fn pushes_out(&self) -> bool {
        !self.no_push_out
    }

    /// The cache of built-in meshes.
    pub(crate) fn meshes(&self) -> MeshCache {
        if self.no_cache { MeshCache::default() } else { MeshCache::in_user_cache() }
    }

    /// Loads a scene. An error about measurements names the flags and the file that they came from.
    pub(crate) fn load(&self, spec: &SceneSpec) -> anyhow::Result<Loaded> {
        let loaded = spec.load_with(&self.meshes()).map_err(|error| match error {
            SceneError::Measurements(source) => {
                let flags = "--bust, --waist, --measure and similar flags";
                let file = self.measurements.measurements.as_deref();
                let place = file.map_or(flags.to_owned(), |file| format!("{}, or {flags}", file.display()));
                anyhow::Error::new(source).context(place)
            }
            other => anyhow::Error::new(other),
        })?;
        runtime::check_memory(loaded.scene.garment.vertex_count())?;
        Ok(loaded)
    }
}

fn pattern_file(name: &str) -> Result<String, String> {
    if ["json", "dxf"].iter().any(|ending| has_ending(name.as_ref(), ending)) {
        return Ok(name.to_owned());
    }
    Err(format!(
        "found `{name}`, expected a file that ends in `.json` or `.dxf`; use --garment for a mesh or a description"
    ))
}

/// Measurements of the built-in dress form, in centimetres. The defaults are European size 38.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Dress form (centimetres; defaults are European size 38)")]
pub(crate) struct MeasurementArgs {
    /// TOML file of measurements; the flags below take precedence
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) measurements: Option<PathBuf>,
    /// Height of the crown
    #[arg(long, value_name = "CM")]
    stature: Option<f64>,
    /// Girth of the bust
    #[arg(long, value_name = "CM")]
    bust: Option<f64>,
    /// Girth right below the bust
    #[arg(long, value_name = "CM")]
    underbust: Option<f64>,
    /// Girth of the waist
    #[arg(long, value_name = "CM")]
    waist: Option<f64>,
    /// Girth of the hip
    #[arg(long, value_name = "CM")]
    hip: Option<f64>,
    /// Any other measurement by its name in the file, e.g. `--measure neck=33`
    #[arg(long = "measure", value_name = "NAME=CM", value_parser = measurement)]
    others: Vec<(String, f64)>,
}

fn measurement(text: &str) -> Result<(String, f64), String> {
    let (name, cm) = text.split_once('=').ok_or("expected NAME=CM, e.g. neck=33")?;
    let cm = cm.trim().parse().map_err(|_| format!("found `{cm}`, expected a number of centimetres"))?;
    Ok((name.trim().to_owned(), cm))
}

impl MeasurementArgs {
    /// The measurements of the file, overridden by the flags.
    pub(crate) fn spec(&self) -> anyhow::Result<BodySpec> {
        let mut spec = match &self.measurements {
            None => BodySpec::default(),
            Some(file) => BodySpec::from_toml(&read_text(file)?).with_context(|| format!("{}", file.display()))?,
        };
        let flags = [
            ("stature", self.stature),
            ("bust", self.bust),
            ("underbust", self.underbust),
            ("waist", self.waist),
            ("hip", self.hip),
        ];
        let given = flags.into_iter().filter_map(|(name, cm)| Some((name, cm?)));
        for (name, cm) in given.chain(self.others.iter().map(|(name, cm)| (name.as_str(), *cm))) {
            spec = spec.with(name, cm)?;
        }
        Ok(spec)
    }
}

/// The fabrics.
#[derive(Debug, Clone, Args)]
pub(crate) struct FabricArgs {
    /// Fabric: a built-in name or a TOML file. For layered garments one for all, or one for each --garment in the same order; use
    /// --fabrics for the fabrics of single panels [default: interlock]
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) fabric: Vec<String>,
}

impl FabricArgs {
    /// The fabric of every panel that has no other.
    pub(crate) fn first(&self) -> anyhow::Result<Fabric> {
        Ok(Fabric::by_name(self.fabric.first().map_or(DEFAULT_FABRIC, String::as_str))?)
    }

    /// Refuses more than one fabric, for commands that use one.
    pub(crate) fn check_single(&self, command: &str) -> anyhow::Result<()> {
        match self.fabric.len() {
            0 | 1 => Ok(()),
            found => refuse!("{command}: found {found} times --fabric, expected one for all"),
        }
    }

    /// Assigns the garments of `spec` their fabrics, if several were given.
    pub(crate) fn assign(&self, spec: SceneSpec) -> anyhow::Result<SceneSpec> {
        if self.fabric.len() < 2 {
            return Ok(spec);
        }
        let spec = SceneSpec { fabrics: self.fabric.clone(), ..spec };
        spec.check_names()?;
        Ok(spec)
    }

    /// Refuses a fabric that no panel uses.
    pub(crate) fn check_used(&self, loaded: &Loaded) -> anyhow::Result<()> {
        let [fabric] = &self.fabric[..] else { return Ok(()) };
        if loaded.scene.takes_the_settings_fabric() {
            return Ok(());
        }
        let mut by: Vec<&str> = loaded.swatches.iter().filter_map(|swatch| swatch.by.as_deref()).collect();
        by.dedup();
        Err(SceneError::from(CutError::Unfit(format!(
            "--fabric {fabric}: found nothing to cut from it, every panel has its own ({}); take --fabric away, or `default` there",
            by.join(", ")
        )))
        .into())
    }

    /// The arguments that name files.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.fabric.iter().filter(|name| crate::base::files::names_a_file(name)).map(Path::new)
    }
}
