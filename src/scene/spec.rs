//! Body and garments by name or file, with all options of loading them: plain data that flags, sweep files and scripts fill.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::layering::coincident;
use super::loaded::{Loaded, Tailored, Unplaced};
use super::materials::{Cut, CutError, FABRICS_ENDING, files_named_in};
use super::placement::{closeness, facing_body};
use super::{DistanceTo, Scene, SceneError};
use crate::base::files::{has_ending, names_a_file, read_text, stem};
use crate::body::BodySpec;
use crate::body::distance::{Body, DistanceError};
use crate::garment::fabric::Fabric;
use crate::garment::pattern::{self, DEFAULT_EDGE_M, SewnGarment, dxf};
use crate::garment::sewing::{draw_shut, put_on};
use crate::garment::{GarmentRequest, GarmentSpec, MeshCache};
use crate::mesh::flat_pattern::FlatPattern;
use crate::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use crate::mesh::{Axis, Frame, Front, MeshSource, RestShape, Unit, retain};

/// The name of the built-in body.
pub const DRESS_FORM: &str = "form";

/// The rest shape that takes texture coordinates where they are a flat pattern, and the garment's own edges elsewhere.
const REST_AUTO: &str = "auto";

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
    fn layer_name(&self) -> String {
        if names_a_file(&self.garment) {
            let stem = stem(&self.garment);
            return stem.strip_suffix("_specification").map_or(stem.clone(), str::to_owned);
        }
        self.garment.split('@').next().unwrap_or_default().to_owned()
    }

    /// Each garment by itself, inner to outer.
    fn layers(&self) -> impl Iterator<Item = Self> + '_ {
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

    fn is_a_pattern(&self) -> bool {
        has_ending(self.garment.as_ref(), "json") || dxf::is_dxf(self.garment.as_ref())
    }

    /// Whether the garment is a mesh from a file: any file that is neither a description nor a pattern. The reader detects the
    /// format by the content.
    fn is_a_mesh(&self) -> bool {
        names_a_file(&self.garment) && !is_toml(&self.garment) && !self.is_a_pattern()
    }

    /// The built-in or described garment, and the number of vertices in its name.
    fn described(&self) -> Result<(GarmentSpec, Option<usize>), SceneError> {
        if names_a_file(&self.garment) {
            let spec = GarmentSpec::from_toml(&read_text(self.garment.as_ref())?);
            return Ok((spec.map_err(SceneError::in_file(&self.garment))?, None));
        }
        let request: GarmentRequest = self.garment.parse()?;
        Ok((GarmentSpec::by_name(&request.name)?, request.vertices))
    }

    /// Whether the body is a mesh from a file.
    fn body_is_a_mesh(&self) -> bool {
        names_a_file(&self.body) && !is_toml(&self.body)
    }

    /// The measurements of the dress form, from the body's file where it has them.
    pub(crate) fn form(&self) -> Result<BodySpec, SceneError> {
        if !is_toml(&self.body) {
            return Ok(self.measurements.clone());
        }
        BodySpec::from_toml(&read_text(self.body.as_ref())?).map_err(SceneError::in_file(&self.body))
    }

    /// The options of the body's file.
    pub(super) fn body_options(&self) -> ImportOptions {
        ImportOptions {
            group: self.body_group.clone(),
            unit: self.body_unit.or(self.unit),
            up: self.body_up.or(self.up),
            weld: self.weld,
            open_body: self.open_body,
            source: self.in_memory.get(&self.body).cloned(),
        }
    }

    /// The options of the garment's file.
    fn garment_options(&self) -> ImportOptions {
        ImportOptions {
            group: self.garment_group.clone(),
            unit: self.garment_unit.or(self.unit),
            up: self.garment_up.or(self.up),
            weld: self.weld,
            open_body: self.open_body,
            source: self.in_memory.get(&self.garment).cloned(),
        }
    }

    /// Reads or makes body and garments.
    ///
    /// # Errors
    /// [`SceneError`] names the file, its line or the name, and the remedy.
    pub fn load(&self) -> Result<Loaded, SceneError> {
        self.load_with(&MeshCache::default())
    }

    /// [`load`](Self::load) with the built-in form and garments from a cache.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn load_with(&self, meshes: &MeshCache) -> Result<Loaded, SceneError> {
        self.check_names()?;
        // Built-in garments depend on the form's measurements, not on its mesh, so both are made at once.
        let (body, made) = rayon::join(|| self.load_body(meshes), || self.make_garment(meshes));
        let (body, imported_body) = body?;
        let mut unplaced = self.unplaced(&body, imported_body.as_ref(), made)?;
        let mut layers = vec![unplaced.layer(self.layer_name(), (0, 0))];
        for spec in self.layers().skip(1) {
            let outer = spec.unplaced(&body, imported_body.as_ref(), spec.make_garment(meshes))?;
            let (coincident, vertices) = (coincident(&unplaced.mesh, &outer.mesh), outer.mesh.vertex_count());
            // Contact cannot determine which of the two is outside, and the solve takes minutes.
            if 2 * coincident > vertices {
                return Err(SceneError::about(&spec.garment)(SceneError::Coincident { coincident, vertices }));
            }
            let before = (unplaced.mesh.vertex_count(), unplaced.mesh.triangles.len());
            unplaced.add_outer(outer);
            layers.push(unplaced.layer(spec.layer_name(), before));
        }
        let (mut scene, mut pushed_out) = Scene::place(body, unplaced.mesh, unplaced.rest, self.push_out)
            .map_err(SceneError::about(&self.garment))?;
        (scene.layers, scene.distance_to) = (layers, self.distance_to);
        scene.own_fabrics = unplaced.cut.fabrics;
        scene.releases_held = self.hold.is_none() && unplaced.tailored.is_some();
        scene.held = match &self.hold {
            None => unplaced.held,
            Some(edges) => scene.edges(edges).map_err(SceneError::about(&self.garment))?,
        };
        // Built-in garments have no protrusions in them.
        if self.push_out && self.layers().any(|spec| spec.is_a_mesh() || spec.is_a_pattern()) {
            pushed_out.protrusion_move_m = scene.pull_off_protrusions();
        }
        let form = if self.body_is_a_mesh() { None } else { self.form()?.measures().ok() };
        scene.girths_at_m = form.map(|m| [m.bust_height, m.waist_height, m.hip_height]);
        let reports = imported_body.iter().chain(&unplaced.imported).map(|i| i.report.clone()).collect();
        let mut hold_notes = self.hold.as_ref().map(|names| scene.ambiguous_edges(names)).unwrap_or_default();
        hold_notes.extend((!scene.releases_held).then(|| scene.hold_details()).flatten());
        Ok(Loaded {
            scene,
            body_name: stem(&self.body),
            garment_name: self.garment_name(),
            reports,
            pushed_out,
            tailored: unplaced.tailored,
            flat_pattern: unplaced.flat_pattern,
            swatches: unplaced.cut.swatches,
            imported: unplaced.imported,
            hold_notes,
        })
    }

    /// The innermost garment with its fabrics.
    fn unplaced(
        &self,
        body: &Body,
        imported_body: Option<&Imported>,
        made: Option<Result<Unplaced, SceneError>>,
    ) -> Result<Unplaced, SceneError> {
        let mut unplaced = match made {
            Some(made) => made,
            None if self.is_a_pattern() => self.tailor(body, imported_body),
            None => self.load_garment(body, imported_body),
        }?;
        let given = self.fabrics.first().map(|name| Fabric::by_name(name)).transpose().map_err(CutError::from)?;
        let Unplaced { mesh, rest, .. } = &mut unplaced;
        unplaced.cut = Cut::new(&self.layer_name(), given, self.names_of_fabrics(), mesh, rest)?;
        Ok(unplaced)
    }

    pub(super) fn load_body(&self, meshes: &MeshCache) -> Result<(Body, Option<Imported>), SceneError> {
        let new = if self.open_body { Body::new_open } else { Body::new };
        if self.body_is_a_mesh() {
            let imported = import_body(self.body.as_ref(), &self.body_options())?;
            return Ok((new(&imported.mesh)?, Some(imported)));
        }
        let form = meshes.dress_form(&self.form()?).map_err(|source| match names_a_file(&self.body) {
            true => SceneError::in_file(&self.body)(source),
            false => SceneError::Measurements(source),
        })?;
        Ok((new(&form)?, None))
    }

    /// A built-in or described garment; `None` for a mesh or a pattern.
    fn make_garment(&self, meshes: &MeshCache) -> Option<Result<Unplaced, SceneError>> {
        let make = || {
            if self.body_is_a_mesh() {
                return Err(SceneError::NotCutForIt { body: self.body.clone() });
            }
            let (spec, vertices) = self.described()?;
            let made = meshes.garment(&spec, &self.form()?, vertices)?;
            Ok(Unplaced { held: made.held, ..Unplaced::new(made.mesh, made.rest) })
        };
        (!self.is_a_mesh() && !self.is_a_pattern()).then(make)
    }

    /// A garment mesh from a file.
    fn load_garment(&self, body: &Body, imported_body: Option<&Imported>) -> Result<Unplaced, SceneError> {
        let bounds = body.mesh().bounds().ok_or(DistanceError::Empty)?;
        let closeness = |points: &[DVec3]| closeness(body, points);
        let beside = match imported_body {
            Some(body) => Beside::Body { frame: &body.report.frame, bounds, closeness: &closeness },
            None => Beside::Bounds(bounds.0, bounds.1),
        };
        let mut imported = import_garment(self.garment.as_ref(), &self.garment_options(), &beside)?;
        imported.turn_outward(&facing_body(&imported.mesh, body));
        let auto = self.rest == REST_AUTO;
        let flat_pattern = if auto { FlatPattern::find(&imported.mesh, &imported.texture) } else { None };
        let rest = self.imported_rest(&mut imported, flat_pattern)?;
        if self.push_out {
            draw_shut(&mut imported, &rest, body);
        }
        let mesh = imported.mesh.clone();
        Ok(Unplaced { imported: Some(imported), flat_pattern, ..Unplaced::new(mesh, rest) })
    }

    /// A sewing pattern, sewn and put on the body.
    fn tailor(&self, body: &Body, imported_body: Option<&Imported>) -> Result<Unplaced, SceneError> {
        let front = self.front.map(|front| front_of(front, imported_body)).transpose()?;
        let pattern = pattern::read(self.garment.as_ref())?;
        let put_on = put_on(&pattern, body, 0.01 * self.edge_cm, front).map_err(SceneError::about(&self.garment))?;
        let SewnGarment { mesh, rest, .. } = &put_on.garment;
        let (mesh, rest, held) = (mesh.clone(), rest.clone(), put_on.held.clone());
        Ok(Unplaced { held, tailored: Some(Tailored { pattern, put_on }), ..Unplaced::new(mesh, rest) })
    }

    /// The rest shape of a garment from a file, which loses the triangles that have no area in it.
    fn imported_rest(
        &self,
        imported: &mut Imported,
        flat_pattern: Option<FlatPattern>,
    ) -> Result<RestShape, SceneError> {
        let about = SceneError::about;
        let mut name = self.garment.as_str();
        let of_texture =
            |scale: f64| RestShape::texture_of(&imported.mesh, &imported.texture, scale).map_err(about(&self.garment));
        let mut rest = match (self.rest.as_str(), flat_pattern) {
            (REST_AUTO, Some(pattern)) => of_texture(pattern.metres_per_unit)?,
            (how @ (REST_AUTO | "own"), _) => imported.own_rest(how == REST_AUTO),
            ("texture", _) => of_texture(1.0)?,
            (file, _) => {
                let frame = &imported.report.frame;
                let (unit, up, source) = (Some(frame.unit), Some(frame.up), self.in_memory.get(file).cloned());
                let options = ImportOptions { unit, up, source, ..self.garment_options() };
                let other = import_garment(file.as_ref(), &options, &Beside::File(frame))?;
                let shape = imported.in_the_shape_of(&other)?;
                name = file;
                RestShape::edges_of(&shape)
            }
        };
        let flat = rest.without_area();
        if flat.iter().all(|&flat| flat) {
            return rest.checked().map_err(about(name));
        }
        imported.drop_triangles(&flat);
        retain(&mut rest.corners, |t| !flat[t]);
        imported.remark_on(&rest);
        Ok(rest)
    }
}

/// The horizontal direction of an axis of the body's file.
fn front_of(front: Front, body: Option<&Imported>) -> Result<DVec2, SceneError> {
    let frame = body.map_or_else(Frame::default, |body| body.report.frame.clone());
    let ahead = frame.to_metres(front.direction()).normalize_or_zero();
    if ahead.z == 0.0 { Ok(ahead.truncate()) } else { Err(SceneError::FrontIsUp { front, up: frame.up }) }
}

fn is_toml(name: &str) -> bool {
    has_ending(name.as_ref(), "toml")
}
