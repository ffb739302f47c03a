//! From names and files to a scene, and back to a file.

use std::path::Path;

use glam::DVec3;

use super::layers::join;
use super::materials::{Cut, Swatch};
use super::spec::REST_AUTO;
use super::{Layer, PushOutReport, Scene, SceneError, SceneSpec, facing_body};
use crate::base::files::{has_ending, names_a_file, stem};
use crate::body::distance::Body;
use crate::garment::MeshCache;
use crate::garment::pattern::{SewingPattern, SewnGarment};
use crate::garment::sewing::{PutOn, draw_shut, put_on};
use crate::mesh::export::{write_imported, write_mesh, write_textured};
use crate::mesh::flat_pattern::FlatPattern;
use crate::mesh::glb::write_glb;
use crate::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use crate::mesh::report::MeshReport;
use crate::mesh::{MeshError, RestShape, TriMesh, retain};

/// A scene with its origin.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// What is draped over what.
    pub scene: Scene,
    /// What the body is called.
    pub body_name: String,
    /// What the garment is called.
    pub garment_name: String,
    /// What was guessed, found and repaired in each file, the body's first.
    pub reports: Vec<MeshReport>,
    /// What was pushed out of the body.
    pub pushed_out: PushOutReport,
    /// The sewing pattern it was made of, and how it was put on.
    pub tailored: Option<Tailored>,
    /// The pattern that was found in its texture coordinates.
    pub flat_pattern: Option<FlatPattern>,
    /// Heights at which the built-in form has its bust, waist and hip girths, m.
    pub girths_at_m: Option<[f64; 3]>,
    /// What it is cut from, where that was said.
    pub swatches: Vec<Swatch>,
    imported: Option<Imported>,
}

/// A garment made of a sewing pattern.
#[derive(Debug, Clone)]
pub struct Tailored {
    /// The pattern, as its file has it.
    pub pattern: SewingPattern,
    /// The garment, sewn and put on the body.
    pub put_on: PutOn,
}

/// A garment before it meets the body.
struct Unplaced {
    mesh: TriMesh,
    rest: RestShape,
    held: Vec<u32>,
    cut: Cut,
    tailored: Option<Tailored>,
    imported: Option<Imported>,
    pattern: Option<FlatPattern>,
}

impl Unplaced {
    fn new(mesh: TriMesh, rest: RestShape) -> Self {
        let (held, cut) = (Vec::new(), Cut::default());
        Self { mesh, rest, held, cut, tailored: None, imported: None, pattern: None }
    }

    /// What follows on so many vertices and triangles.
    fn layer(&self, name: String, (vertices, triangles): (usize, usize)) -> Layer {
        Layer { name, vertices: vertices..self.mesh.vertex_count(), triangles: triangles..self.mesh.triangles.len() }
    }

    /// Adds another garment, worn over it; what came of files and patterns is then that of several, and is left behind.
    fn put_on(&mut self, outer: Self) {
        let triangles = [&self.mesh, &outer.mesh].map(|mesh| mesh.triangles.len());
        self.cut.join(outer.cut, &outer.rest, &mut self.rest, triangles);
        let before = join(&mut self.mesh, &mut self.rest, outer.mesh, outer.rest);
        self.held.extend(outer.held.iter().map(|v| v + before));
        (self.tailored, self.imported, self.pattern) = (None, None, None);
    }
}

impl SceneSpec {
    /// Reads or makes body and garment.
    ///
    /// # Errors
    /// [`SceneError`] names the file, its line or the name, and what to do.
    pub fn load(&self) -> Result<Loaded, SceneError> {
        self.load_with(&MeshCache::default())
    }

    /// [`load`](Self::load) with the built-in form and garments taken from `meshes` where they are there.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn load_with(&self, meshes: &MeshCache) -> Result<Loaded, SceneError> {
        self.check_names()?;
        // What is made is cut for the form's measurements, not for its mesh: both at once.
        let (body, made) = rayon::join(|| self.load_body(meshes), || self.make_garment(meshes));
        let (body, of_body) = body?;
        let mut unplaced = self.unplaced(&body, of_body.as_ref(), made)?;
        let mut layers = vec![unplaced.layer(self.layer_name(), (0, 0))];
        for spec in self.layers().skip(1) {
            let outer = spec.unplaced(&body, of_body.as_ref(), spec.make_garment(meshes))?;
            let before = (unplaced.mesh.vertex_count(), unplaced.mesh.triangles.len());
            unplaced.put_on(outer);
            layers.push(unplaced.layer(spec.layer_name(), before));
        }
        let (mut scene, mut pushed_out) = Scene::place(body, unplaced.mesh, unplaced.rest, self.push_out)
            .map_err(SceneError::about(&self.garment))?;
        (scene.layers, scene.distance_to) = (layers, self.distance_to);
        scene.own_fabrics = unplaced.cut.fabrics;
        scene.held = match &self.hold {
            None => {
                scene.let_go = unplaced.tailored.is_some();
                unplaced.held
            }
            Some(what) => scene.edges(what).map_err(SceneError::about(&self.garment))?,
        };
        // What is made for the form needs not be asked.
        if self.push_out && self.layers().any(|spec| spec.is_a_mesh() || spec.is_a_pattern()) {
            pushed_out.off_ends_m = scene.take_off_ends();
        }
        let form = if self.body_is_a_mesh() { None } else { self.form()?.measures().ok() };
        let reports = of_body.iter().chain(&unplaced.imported).map(|i| i.report.clone()).collect();
        Ok(Loaded {
            scene,
            body_name: stem(&self.body),
            garment_name: self.garment_name(),
            reports,
            pushed_out,
            tailored: unplaced.tailored,
            flat_pattern: unplaced.pattern,
            swatches: unplaced.cut.swatches,
            girths_at_m: form.map(|m| [m.bust_height, m.waist_height, m.hip_height]),
            imported: unplaced.imported,
        })
    }

    /// The garment, without what is worn over it.
    fn unplaced(
        &self,
        body: &Body,
        of_body: Option<&Imported>,
        made: Option<Result<Unplaced, SceneError>>,
    ) -> Result<Unplaced, SceneError> {
        let mut unplaced = match made {
            Some(made) => made,
            None if self.is_a_pattern() => self.tailor(body),
            None => self.load_garment(body, of_body),
        }?;
        unplaced.cut = self.cut(&unplaced.mesh, &mut unplaced.rest)?;
        Ok(unplaced)
    }

    fn load_body(&self, meshes: &MeshCache) -> Result<(Body, Option<Imported>), SceneError> {
        let new = if self.open_body { Body::new_open } else { Body::new };
        if !self.body_is_a_mesh() {
            let of_numbers = !names_a_file(&self.body);
            let form = meshes.dress_form(&self.form()?).map_err(|source| match of_numbers {
                true => SceneError::Measurements(source),
                false => SceneError::in_file(&self.body)(source),
            })?;
            return Ok((new(&form)?, None));
        }
        let imported = import_body(self.body.as_ref(), &self.import_options(self.body_group.as_ref()))?;
        Ok((new(&imported.mesh)?, Some(imported)))
    }

    /// A garment that is no mesh from a file; `None` where it is one.
    fn make_garment(&self, meshes: &MeshCache) -> Option<Result<Unplaced, SceneError>> {
        if self.is_a_mesh() || self.is_a_pattern() {
            return None;
        }
        let make = || {
            if self.body_is_a_mesh() {
                return Err(SceneError::NotCutForIt { body: self.body.clone() });
            }
            let (spec, vertices) = self.described()?;
            let made = meshes.garment(&spec, &self.form()?, vertices)?;
            Ok(Unplaced { held: made.held, ..Unplaced::new(made.mesh, made.rest) })
        };
        Some(make())
    }

    fn load_garment(&self, body: &Body, of_body: Option<&Imported>) -> Result<Unplaced, SceneError> {
        let beside = match (of_body, body.mesh().bounds()) {
            (Some(body), _) => Beside::File(body.frame()),
            (None, Some((low, high))) => Beside::Bounds(low, high),
            (None, None) => return Err(crate::body::distance::DistanceError::Empty.into()),
        };
        let options = self.import_options(self.garment_group.as_ref());
        let mut imported = import_garment(self.garment.as_ref(), &options, &beside)?;
        imported.turn_outward(&facing_body(&imported.mesh, body));
        let pattern = if self.rest == REST_AUTO { FlatPattern::find(&imported.mesh, &imported.texture) } else { None };
        let rest = self.imported_rest(&mut imported, pattern)?;
        if self.push_out {
            draw_shut(&mut imported, &rest, body);
        }
        let mesh = imported.mesh.clone();
        Ok(Unplaced { imported: Some(imported), pattern, ..Unplaced::new(mesh, rest) })
    }

    /// A sewing pattern, sewn and put on the body.
    fn tailor(&self, body: &Body) -> Result<Unplaced, SceneError> {
        let pattern = SewingPattern::read(self.garment.as_ref())?;
        let put_on = put_on(&pattern, body, 0.01 * self.edge_cm).map_err(SceneError::about(&self.garment))?;
        let SewnGarment { mesh, rest, .. } = &put_on.garment;
        let (mesh, rest, held) = (mesh.clone(), rest.clone(), put_on.held.clone());
        Ok(Unplaced { held, tailored: Some(Tailored { pattern, put_on }), ..Unplaced::new(mesh, rest) })
    }

    /// The rest shape of a garment, which loses the triangles that have no area in it.
    fn imported_rest(&self, imported: &mut Imported, pattern: Option<FlatPattern>) -> Result<RestShape, SceneError> {
        let about = SceneError::about;
        let mut name = self.garment.as_str();
        let of_texture =
            |scale: f64| RestShape::texture_of(&imported.mesh, &imported.texture, scale).map_err(about(&self.garment));
        let mut rest = match (self.rest.as_str(), pattern) {
            (REST_AUTO, Some(pattern)) => of_texture(pattern.metres_per_unit)?,
            (how @ (REST_AUTO | "own"), _) => imported.own_rest(how == REST_AUTO),
            ("texture", _) => of_texture(1.0)?,
            (file, _) => {
                let frame = imported.frame();
                let options = ImportOptions {
                    unit: Some(frame.unit),
                    up: Some(frame.up),
                    ..self.import_options(self.garment_group.as_ref())
                };
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

impl Loaded {
    /// What to act upon.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        if self.pushed_out.is_clean() { Vec::new() } else { vec![self.pushed_out.to_string()] }
    }

    /// What was guessed, found and repaired.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes: Vec<String> = self.reports.iter().map(|r| r.to_string().trim_end().to_owned()).collect();
        if let Some(pattern) = &self.flat_pattern {
            notes.push(format!("{}: {pattern}", self.garment_name));
        }
        if let Some(Tailored { pattern, put_on }) = &self.tailored {
            let of_both = pattern.notes.iter().cloned().chain(put_on.notes());
            notes.extend(of_both.map(|note| format!("{}: {note}", self.garment_name)));
        }
        notes.extend(self.swatches.iter().map(|swatch| format!("cut: {swatch}")));
        if self.pushed_out.is_clean() && (self.pushed_out.found_inside > 0 || self.pushed_out.off_ends_m > 0.0) {
            notes.push(self.pushed_out.to_string());
        }
        notes
    }

    /// Writes the garment at `positions` (m) as OBJ, or as glTF where the path ends in `.glb`. As OBJ, one that came from a file keeps its
    /// faces, groups and texture coordinates, and one of a pattern has its panels as groups and the flat pattern as texture coordinates.
    pub fn write(&self, path: impl AsRef<Path>, positions: &[DVec3]) -> Result<(), MeshError> {
        if has_ending(path.as_ref(), "glb") {
            return write_glb(path.as_ref(), &self.scene.garment.with_positions(positions.to_vec()), None);
        }
        match (&self.imported, &self.tailored) {
            (Some(imported), _) => write_imported(path.as_ref(), imported, positions),
            (None, Some(Tailored { pattern, put_on })) => {
                let laid_out = put_on.garment.laid_out(pattern);
                write_textured(path.as_ref(), &self.scene.garment.with_positions(positions.to_vec()), &laid_out)
            }
            (None, None) => write_mesh(path.as_ref(), &self.scene.garment.with_positions(positions.to_vec())),
        }
    }
}
