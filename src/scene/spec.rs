//! Body and garments by name or file, with all options of loading them: plain data that flags, sweep files and scripts fill.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::materials::{CutError, FABRICS_ENDING, files_named_in};
use super::{DistanceTo, SceneError};
use crate::base::files::{has_ending, names_a_file, read_text, stem};
use crate::body::BodySpec;
use crate::garment::pattern::{DEFAULT_EDGE_M, dxf};
use crate::garment::{GarmentRequest, GarmentSpec};
use crate::mesh::{Axis, Front, MeshSource, Unit};

/// The name of the built-in body.
pub const DRESS_FORM: &str = "form";

/// The rest shape that takes texture coordinates where they are a flat pattern, and the garment's own edges elsewhere.
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

/// A body and the garments on it, by name or file. The default is the low-cut dress on the dress form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSpec {
    /// `form` (the built-in dress form), a TOML file of its measurements, or a mesh file.
    pub body: String,
    /// A built-in garment, `name` or `name@vertices`, a TOML file that describes one, a mesh file placed around the body, or a
    /// sewing pattern (JSON as GarmentCode writes it).
    pub garment: String,
    /// Garments worn over it, inner to outer, each given like `garment`.
    pub over: Vec<String>,
    /// Fabrics of the garments, inner to outer, each a built-in name or a file; empty where all take the fabric of the settings.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fabrics: Vec<String>,
    /// TOML file that names the fabrics of the garment's panels; by default `GARMENT.fabrics.toml` beside the garment's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fabrics_file: Option<String>,
    /// The surface that distances are measured to where garments are worn over each other.
    pub distance_to: DistanceTo,
    /// The only group or object of the body's file that is read.
    pub body_group: Option<String>,
    /// The only group or object of the garment's file that is read.
    pub garment_group: Option<String>,
    /// Edge length of the mesh of a sewing pattern, cm.
    pub edge_cm: f64,
    /// Unit of both files, where `body_unit` and `garment_unit` name no other; by default guessed for each file.
    pub unit: Option<Unit>,
    /// Up axis of both files, where `body_up` and `garment_up` name no other; by default guessed for each file.
    pub up: Option<Axis>,
    /// Unit of the body's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_unit: Option<Unit>,
    /// Up axis of the body's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_up: Option<Axis>,
    /// Unit of the garments' files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub garment_unit: Option<Unit>,
    /// Up axis of the garments' files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub garment_up: Option<Axis>,
    /// Axis of the body's file that its front points along, for sewing patterns; by default found from the body's shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front: Option<Front>,
    /// Whether a body that is not closed is accepted; its normals then separate inside from outside.
    pub open_body: bool,
    /// Whether vertices at exactly the same position are merged.
    pub weld: bool,
    /// Rest shape of a garment from a file: its `own` edges, its `texture` coordinates in metres, a mesh file of the same faces,
    /// or `auto`: the texture coordinates where they are the flat pattern, in any unit, else its own edges.
    pub rest: String,
    /// Edges whose vertices keep their positions, separated by commas: `top` (the highest), `top:2` (the highest of the second
    /// connected part) or those of a group. By default those that a built-in garment holds.
    pub hold: Option<String>,
    /// Whether garment vertices that start inside the body are pushed out.
    pub push_out: bool,
    /// Measurements of the dress form, which built-in garments are made to.
    pub measurements: BodySpec,
    /// Meshes in memory by the file names that stand for them above. They are no part of the plain data.
    #[serde(skip)]
    pub in_memory: BTreeMap<String, Arc<MeshSource>>,
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
            body_unit: None,
            body_up: None,
            garment_unit: None,
            garment_up: None,
            front: None,
            open_body: false,
            weld: false,
            rest: REST_AUTO.to_owned(),
            hold: None,
            push_out: true,
            measurements: BodySpec::default(),
            in_memory: BTreeMap::new(),
        }
    }
}

impl SceneSpec {
    /// A body and a garment, each a name or a file; all else by default.
    #[must_use]
    pub fn new(body: impl Into<String>, garment: impl Into<String>) -> Self {
        Self { body: body.into(), garment: garment.into(), ..Self::default() }
    }

    /// The files it names.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let named = self.file_names().into_iter().filter(|(role, _)| {
            // `files_of_fabrics` finds these and the files that they name.
            !matches!(role, FileRole::Fabric | FileRole::FabricsFile)
        });
        named
            .map(|(_, name)| PathBuf::from(name))
            .chain(self.files_of_fabrics())
            .chain(self.files_of_sewing())
            .collect()
    }

    /// The files that say how patterns of pieces are sewn.
    fn files_of_sewing(&self) -> impl Iterator<Item = PathBuf> {
        let patterns = std::iter::once(&self.garment).chain(&self.over).map(Path::new).filter(|path| dxf::is_dxf(path));
        patterns.map(dxf::sewing_file).filter(|path| path.is_file())
    }

    /// Every value that the loader opens as a file, with its field. A new field does not compile until it is listed here, because
    /// servers refuse all files that they were not started with.
    #[must_use]
    pub fn file_names(&self) -> Vec<(FileRole, &str)> {
        let Self {
            body,
            garment,
            over,
            fabrics,
            fabrics_file,
            rest,
            // Names of groups within a file.
            body_group: _,
            garment_group: _,
            hold: _,
            // Numbers and choices.
            distance_to: _,
            edge_cm: _,
            unit: _,
            up: _,
            body_unit: _,
            body_up: _,
            garment_unit: _,
            garment_up: _,
            front: _,
            open_body: _,
            weld: _,
            push_out: _,
            measurements: _,
            in_memory: _,
        } = self;
        let mut named = vec![(FileRole::Body, body), (FileRole::Garment, garment)];
        named.extend(over.iter().map(|garment| (FileRole::Garment, garment)));
        named.extend(fabrics.iter().map(|fabric| (FileRole::Fabric, fabric)));
        named.retain(|(_, name)| names_a_file(name));
        // These are files under any name.
        named.extend(fabrics_file.iter().map(|file| (FileRole::FabricsFile, file)));
        named.extend((!REST_SHAPES.contains(&rest.as_str())).then_some((FileRole::Rest, rest)));
        named.into_iter().map(|(role, name)| (role, name.as_str())).collect()
    }

    /// All files that assign fabrics to the garments.
    pub(crate) fn files_of_fabrics(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> =
            self.fabrics.iter().filter(|name| names_a_file(name)).map(PathBuf::from).collect();
        for path in self.layers().filter_map(|layer| layer.names_of_fabrics()) {
            files.extend(files_named_in(&path));
            files.push(path);
        }
        files
    }

    /// The file that names the fabrics of the garment's panels: the one that is given, or one beside the garment's.
    pub(crate) fn names_of_fabrics(&self) -> Option<PathBuf> {
        if self.fabrics_file.is_some() || !names_a_file(&self.garment) {
            return self.fabrics_file.as_ref().map(PathBuf::from);
        }
        let stems = [stem(&self.garment), self.layer_name()].into_iter();
        stems
            .map(|stem| Path::new(&self.garment).with_file_name(format!("{stem}.{FABRICS_ENDING}")))
            .find(|path| path.is_file())
    }

    /// One name for all garments, for example of a recording.
    pub(crate) fn garment_name(&self) -> String {
        self.layers().map(|layer| layer.layer_name()).collect::<Vec<_>>().join("-under-")
    }

    /// The name of the innermost garment.
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

    /// Reports unknown names before anything is read or made.
    pub fn check_names(&self) -> Result<(), SceneError> {
        if self.body != DRESS_FORM && !names_a_file(&self.body) {
            return Err(SceneError::UnknownBody { found: self.body.clone() });
        }
        let (fabrics, garments) = (self.fabrics.len(), 1 + self.over.len());
        if let Some(file) = self.fabrics_file.as_ref().filter(|_| garments > 1) {
            return Err(SceneError::from(CutError::Unfit(format!(
                "--fabrics {file}: found {garments} garments, expected one; put a file beside each garment's own, GARMENT.{FABRICS_ENDING}"
            ))));
        }
        if fabrics != 0 && fabrics != garments {
            return Err(SceneError::from(CutError::Unfit(format!(
                "found {fabrics} fabrics for {garments} garments, expected one for all, or one for each in the same order"
            ))));
        }
        for layer in self.layers().filter(|layer| !names_a_file(&layer.garment)) {
            layer.described()?;
        }
        Ok(())
    }

    pub(super) fn is_a_pattern(&self) -> bool {
        has_ending(self.garment.as_ref(), "json") || dxf::is_dxf(self.garment.as_ref())
    }

    /// Whether the garment is a mesh from a file: any file that is neither a description nor a pattern. The reader detects the
    /// format by the content.
    pub(super) fn is_a_mesh(&self) -> bool {
        names_a_file(&self.garment) && !is_toml(&self.garment) && !self.is_a_pattern()
    }

    /// The built-in or described garment, and the number of vertices in its name.
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

    /// The measurements of the dress form, from the body's file where it has them.
    pub(crate) fn form(&self) -> Result<BodySpec, SceneError> {
        if !is_toml(&self.body) {
            return Ok(self.measurements.clone());
        }
        BodySpec::from_toml(&read_text(self.body.as_ref())?).map_err(SceneError::in_file(&self.body))
    }
}

fn is_toml(name: &str) -> bool {
    has_ending(name.as_ref(), "toml")
}
