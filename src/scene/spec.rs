//! Body and garment by name or file, and what is asked of them: plain data that flags, sweep files and scripts fill.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{DistanceTo, SceneError};
use crate::base::files::{has_ending, names_a_file, read_text, stem};
use crate::body::BodySpec;
use crate::garment::pattern::DEFAULT_EDGE_M;
use crate::garment::{GarmentRequest, GarmentSpec};
use crate::mesh::import::ImportOptions;
use crate::mesh::{Axis, Unit};

/// The name of the built-in body.
pub const DRESS_FORM: &str = "form";

/// The rest shape that is looked for.
pub(super) const REST_AUTO: &str = "auto";

/// Rest shapes that are no file.
const REST_SHAPES: [&str; 3] = [REST_AUTO, "own", "texture"];

/// The field in which a file is named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is named as its field")]
pub enum FileRole {
    Body,
    Garment,
    Fabric,
    FabricsFile,
    Rest,
    Table,
}

/// What is draped over what. The default is the low-cut dress on the dress form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSpec {
    /// `form` (the built-in dress form), a TOML file of its measurements, or an OBJ file.
    pub body: String,
    /// A built-in garment, `name` or `name@vertices`, a TOML file that describes one, an OBJ file placed around the body, or a sewing
    /// pattern (JSON as GarmentCode writes it).
    pub garment: String,
    /// Garments worn over it, inner to outer, each named as it is.
    pub over: Vec<String>,
    /// Fabrics of the garments, inner to outer, each a built-in name or a file; empty where all are of that of the settings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fabrics: Vec<String>,
    /// TOML file that names the fabrics of the garment's panels; where it is not given, `GARMENT.fabrics.toml` beside the garment's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fabrics_file: Option<String>,
    /// What distances count to where garments are worn over each other.
    pub distance_to: DistanceTo,
    /// One group or object of the body's file alone.
    pub body_group: Option<String>,
    /// One group or object of the garment's file alone.
    pub garment_group: Option<String>,
    /// Length of the edges that a sewing pattern is meshed with, cm.
    pub edge_cm: f64,
    /// Unit of the files; guessed from the body where it is not given.
    pub unit: Option<Unit>,
    /// Up axis of the files; guessed from the body where it is not given.
    pub up: Option<Axis>,
    /// Whether a body that is not closed is accepted, inside and outside told by its normals.
    pub open_body: bool,
    /// Whether vertices at exactly the same place are joined.
    pub weld: bool,
    /// Rest shape of a garment from a file: `own` edges, its `texture` coordinates in metres, an OBJ file of the same faces, or `auto`: the
    /// texture coordinates where they are the flat pattern, in whatever unit, else its own edges.
    pub rest: String,
    /// Edges held where they are, separated by commas: `top` (the highest), `top:2` (the highest of the second connected part) or those of a
    /// group; without it what a built-in garment holds.
    pub hold: Option<String>,
    /// Whether garment vertices that start inside the body are pushed out.
    pub push_out: bool,
    /// Measurements of the dress form, which built-in garments are made to.
    pub measurements: BodySpec,
}

impl Default for SceneSpec {
    fn default() -> Self {
        Self {
            body: DRESS_FORM.to_owned(),
            garment: "low-cut-dress".to_owned(),
            over: Vec::new(),
            fabrics: Vec::new(),
            fabrics_file: None,
            distance_to: DistanceTo::default(),
            body_group: None,
            garment_group: None,
            edge_cm: 100.0 * DEFAULT_EDGE_M,
            unit: None,
            up: None,
            open_body: false,
            weld: false,
            rest: REST_AUTO.to_owned(),
            hold: None,
            push_out: true,
            measurements: BodySpec::default(),
        }
    }
}

impl SceneSpec {
    /// A body and a garment, each a name or a file; everything else as it comes.
    #[must_use]
    pub fn new(body: impl Into<String>, garment: impl Into<String>) -> Self {
        Self { body: body.into(), garment: garment.into(), ..Self::default() }
    }

    /// The files it names.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let named = self.file_names().into_iter().filter(|(role, _)| {
            // These and the files that they name in turn are found as the loader finds them.
            !matches!(role, FileRole::Fabric | FileRole::FabricsFile)
        });
        named.map(|(_, name)| PathBuf::from(name)).chain(self.files_of_fabrics()).collect()
    }

    /// Every value that the loader opens as a file, with the field it stands in. A new field does not compile until it is listed
    /// here: servers refuse whatever this returns beyond the files they were started with.
    #[must_use]
    pub fn file_names(&self) -> Vec<(FileRole, &str)> {
        let Self {
            body,
            garment,
            over,
            fabrics,
            fabrics_file,
            rest,
            // Names of groups within a file that is named elsewhere.
            body_group: _,
            garment_group: _,
            hold: _,
            // Numbers and choices.
            distance_to: _,
            edge_cm: _,
            unit: _,
            up: _,
            open_body: _,
            weld: _,
            push_out: _,
            measurements: _,
        } = self;
        let mut named = vec![(FileRole::Body, body), (FileRole::Garment, garment)];
        named.extend(over.iter().map(|garment| (FileRole::Garment, garment)));
        named.extend(fabrics.iter().map(|fabric| (FileRole::Fabric, fabric)));
        named.retain(|(_, name)| names_a_file(name));
        // Opened whatever they look like.
        named.extend(fabrics_file.iter().map(|file| (FileRole::FabricsFile, file)));
        named.extend((!REST_SHAPES.contains(&rest.as_str())).then_some((FileRole::Rest, rest)));
        named.into_iter().map(|(role, name)| (role, name.as_str())).collect()
    }

    /// What the garment is called where one name will do, a recording's for one.
    #[must_use]
    pub(crate) fn garment_name(&self) -> String {
        if !self.over.is_empty() {
            return self.layers().map(|layer| layer.layer_name()).collect::<Vec<_>>().join("-under-");
        }
        self.layer_name()
    }

    /// What the garment itself is called, whatever is worn over it.
    pub(super) fn layer_name(&self) -> String {
        if names_a_file(&self.garment) {
            let stem = stem(&self.garment);
            return stem.strip_suffix("_specification").map_or(stem.clone(), str::to_owned);
        }
        self.garment.split('@').next().unwrap_or_default().to_owned()
    }

    /// Each garment by itself, inner to outer.
    pub(super) fn layers(&self) -> impl Iterator<Item = Self> + '_ {
        let one = |(k, garment): (usize, &String)| Self {
            garment: garment.clone(),
            over: Vec::new(),
            fabrics: self.fabrics.get(k).into_iter().cloned().collect(),
            ..self.clone()
        };
        std::iter::once(&self.garment).chain(&self.over).enumerate().map(one)
    }

    /// Finds names that mean nothing before any time is spent.
    pub fn check_names(&self) -> Result<(), SceneError> {
        if self.body != DRESS_FORM && !names_a_file(&self.body) {
            return Err(SceneError::UnknownBody { found: self.body.clone() });
        }
        self.check_fabrics()?;
        for layer in self.layers().filter(|layer| !names_a_file(&layer.garment)) {
            layer.described()?;
        }
        Ok(())
    }

    /// Whether the garment is a sewing pattern.
    #[must_use]
    pub(crate) fn is_a_pattern(&self) -> bool {
        has_ending(self.garment.as_ref(), "json")
    }

    /// Whether the garment is a mesh from a file, as any is that is neither a description nor a pattern: its reader knows other formats
    /// by what is in them.
    pub(super) fn is_a_mesh(&self) -> bool {
        names_a_file(&self.garment) && !is_toml(&self.garment) && !self.is_a_pattern()
    }

    /// The built-in or described garment, and how many vertices are asked of it.
    pub(super) fn described(&self) -> Result<(GarmentSpec, Option<usize>), SceneError> {
        if names_a_file(&self.garment) {
            let spec = GarmentSpec::from_toml(&read_text(self.garment.as_ref())?);
            return Ok((spec.map_err(SceneError::in_file(&self.garment))?, None));
        }
        let request: GarmentRequest = self.garment.parse()?;
        Ok((GarmentSpec::by_name(&request.name)?, request.vertices))
    }

    /// Whether the body is a mesh from a file.
    pub(super) fn body_is_a_mesh(&self) -> bool {
        names_a_file(&self.body) && !is_toml(&self.body)
    }

    /// The form's measurements, where the body is a file of them from there.
    pub(crate) fn form(&self) -> Result<BodySpec, SceneError> {
        if !is_toml(&self.body) {
            return Ok(self.measurements.clone());
        }
        BodySpec::from_toml(&read_text(self.body.as_ref())?).map_err(SceneError::in_file(&self.body))
    }

    pub(super) fn import_options(&self, group: Option<&String>) -> ImportOptions {
        ImportOptions {
            group: group.cloned(),
            unit: self.unit,
            up: self.up,
            weld: self.weld,
            open_body: self.open_body,
        }
    }
}

fn is_toml(name: &str) -> bool {
    has_ending(name.as_ref(), "toml")
}
