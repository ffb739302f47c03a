//! Body and garment: the arguments shared by every command that needs them, and reading them.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use partwise::distance::Body;
use partwise::drape::Scene;
use partwise::mesh::export::{write_imported, write_mesh};
use partwise::mesh::fit::check_near;
use partwise::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use partwise::mesh::push_out::push_out;
use partwise::mesh::{Axis, RestShape, Topology, TriMesh, Unit};
use partwise::shapes::body::dress_form;
use partwise::shapes::garment::{GarmentRequest, GarmentSpec, garment};

use super::failure::UserError;
use super::measurements::MeasurementArgs;

/// The built-in body.
const DRESS_FORM: &str = "form";
/// Pushed-out vertices come to rest this far from the body, m: a thick knit's thickness.
const PUSHED_CLEARANCE: f64 = 1e-3;

/// Body and garment.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Body and garment")]
pub(crate) struct InputArgs {
    /// Body: `form` (the built-in dress form) or an OBJ file
    #[arg(long, value_name = "form|FILE.obj", default_value = DRESS_FORM)]
    body: String,
    /// Garment: pullover-1, pullover-2, flared-skirt, low-cut-dress, long-sleeved-dress, any of them @VERTICES, a TOML
    /// spec, or an OBJ file
    #[arg(long, value_name = "NAME[@VERTICES]|FILE", default_value = "low-cut-dress")]
    garment: String,
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
    /// Rest shape of the garment: `own` edges, its `texture` coordinates in metres, or an OBJ file of the same faces
    #[arg(long, value_name = "own|texture|FILE.obj")]
    rest: Option<String>,
    /// Hold an edge of the garment where it is: `top` (the highest edge, a waistband) or the edges of a group of the file
    #[arg(long, value_name = "top|GROUP")]
    hold: Option<String>,
    /// Leave garment vertices that start inside the body where they are
    #[arg(long)]
    no_push_out: bool,
    #[command(flatten)]
    measurements: MeasurementArgs,
}

/// Everything read, ready for the stages.
pub(crate) struct Inputs {
    /// What is draped over what.
    pub(crate) scene: Scene,
    /// What the body is called.
    pub(crate) body_name: String,
    /// What the garment is called: names the recording.
    pub(crate) garment_name: String,
    /// What to act upon.
    pub(crate) warnings: Vec<String>,
    /// What was guessed, found and repaired.
    pub(crate) notes: Vec<String>,
    imported: Option<Imported>,
}

impl Inputs {
    /// Writes the garment at `positions`; one that came from a file keeps its faces, groups and texture coordinates.
    pub(crate) fn export(&self, path: &Path, positions: &[glam::DVec3]) -> anyhow::Result<()> {
        match &self.imported {
            Some(imported) => write_imported(path, imported, positions)?,
            None => write_mesh(path, &self.scene.garment.with_positions(positions.to_vec()))?,
        }
        Ok(())
    }
}

struct Placed {
    mesh: TriMesh,
    rest: RestShape,
    held: Vec<u32>,
    imported: Option<Imported>,
}

impl InputArgs {
    /// The files behind the arguments, for `--watch`.
    pub(crate) fn files(&self) -> Vec<&Path> {
        let rest = self.rest.as_deref().unwrap_or_default();
        let named = [self.body.as_str(), &self.garment, rest].into_iter().filter(|v| looks_like_a_file(v));
        named.map(Path::new).chain(self.measurements.file()).collect()
    }

    /// The same arguments with body and garment from elsewhere, if given, and nothing pushed out.
    pub(crate) fn unmended(&self, body: Option<&str>, garment: Option<&str>) -> Self {
        let own = self.clone();
        Self {
            body: body.map_or(own.body, str::to_owned),
            garment: garment.map_or(own.garment, str::to_owned),
            no_push_out: true,
            ..self.clone()
        }
    }

    /// Reads or makes body and garment.
    pub(crate) fn load(&self) -> anyhow::Result<Inputs> {
        let mut notes = Vec::new();
        let mut warnings = Vec::new();
        let (body_mesh, body_import) = self.load_body(&mut notes)?;
        let body = if self.open_body { Body::new_open(&body_mesh)? } else { Body::new(&body_mesh)? };
        let placed = self.load_garment(&body_mesh, &body, body_import.as_ref(), &mut notes)?;
        let mut mesh = placed.mesh;
        check_near(&mesh, &body).with_context(|| self.garment.clone())?;
        if !self.no_push_out {
            let (pushed, report) = push_out(&mesh, &body, PUSHED_CLEARANCE);
            if !report.is_clean() {
                warnings.push(report.to_string());
            } else if report.found_inside > 0 {
                notes.push(report.to_string());
            }
            mesh = pushed;
        }
        let topology = Topology::new(&mesh);
        let held = match &self.hold {
            None => placed.held,
            Some(what) => held_edge(&mesh, &topology, what).with_context(|| self.garment.clone())?,
        };
        Ok(Inputs {
            scene: Scene { body_mesh, body, garment: mesh, topology, rest: placed.rest, held },
            body_name: stem(&self.body),
            garment_name: self.garment_name(),
            warnings,
            notes,
            imported: placed.imported,
        })
    }

    fn garment_name(&self) -> String {
        if looks_like_a_file(&self.garment) {
            return stem(&self.garment);
        }
        self.garment.split('@').next().unwrap_or_default().to_owned()
    }

    fn options(&self, group: Option<&String>) -> ImportOptions {
        ImportOptions {
            group: group.cloned(),
            unit: self.unit,
            up: self.up,
            weld: self.weld,
            open_body: self.open_body,
        }
    }

    fn load_body(&self, notes: &mut Vec<String>) -> anyhow::Result<(TriMesh, Option<Imported>)> {
        if looks_like_a_file(&self.body) {
            let imported = import_body(Path::new(&self.body), &self.options(self.body_group.as_ref()))?;
            notes.push(imported.report.to_string().trim_end().to_owned());
            return Ok((imported.mesh.clone(), Some(imported)));
        }
        if self.body != DRESS_FORM {
            return Err(UserError::new(format!(
                "no body is called `{}`; expected `{DRESS_FORM}` (the built-in dress form) or an OBJ file",
                self.body
            )));
        }
        let form = dress_form(&self.measurements.spec()?).with_context(|| self.measurements.place())?;
        Ok((form, None))
    }

    fn load_garment(
        &self,
        body: &TriMesh,
        shape: &Body,
        body_import: Option<&Imported>,
        notes: &mut Vec<String>,
    ) -> anyhow::Result<Placed> {
        if Path::new(&self.garment).extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
            let beside = match (body_import, body.bounds()) {
                (Some(body), _) => Beside::File(body.frame()),
                (None, Some((lo, hi))) => Beside::Bounds(lo, hi),
                (None, None) => return Err(UserError::new("the body has no vertices")),
            };
            let options = self.options(self.garment_group.as_ref());
            let mut imported = import_garment(Path::new(&self.garment), &options, &beside)?;
            imported.face_away_from(shape);
            notes.push(imported.report.to_string().trim_end().to_owned());
            let rest = self.imported_rest(&imported)?;
            return Ok(Placed { mesh: imported.mesh.clone(), rest, held: Vec::new(), imported: Some(imported) });
        }
        if body_import.is_some() {
            return Err(UserError::new(format!(
                "the built-in garments are cut for the dress form, not for {}; give --garment an OBJ file placed around that \
                 body, or leave --body out and give its measurements (--bust, --waist, ...)",
                self.body
            )));
        }
        let (spec, vertices) = if looks_like_a_file(&self.garment) {
            let spec = GarmentSpec::from_toml(&read_text(Path::new(&self.garment))?)
                .with_context(|| format!("{} cannot be used", self.garment))?;
            (spec, None)
        } else {
            let request: GarmentRequest = self.garment.parse()?;
            (GarmentSpec::by_name(&request.name)?, request.vertices)
        };
        let made = garment(&spec, &self.measurements.spec()?, vertices)?;
        Ok(Placed { mesh: made.mesh, rest: made.rest, held: made.held, imported: None })
    }

    fn imported_rest(&self, imported: &Imported) -> anyhow::Result<RestShape> {
        let garment = || self.garment.clone();
        Ok(match self.rest.as_deref() {
            None | Some("own") => RestShape::from_edges(&imported.mesh).with_context(garment)?,
            Some("texture") => RestShape::from_texture(&imported.mesh, &imported.texture, 1.0).with_context(garment)?,
            Some(file) => {
                let frame = imported.frame();
                let options = ImportOptions {
                    unit: Some(frame.unit),
                    up: Some(frame.up),
                    ..self.options(self.garment_group.as_ref())
                };
                let other = import_garment(Path::new(file), &options, &Beside::File(frame))?;
                let shape = imported.in_the_shape_of(&other)?;
                RestShape::from_mesh(&imported.mesh, &shape).with_context(|| file.to_owned())?
            }
        })
    }
}

/// The vertices of the highest edge, or of the edges that a group lies on.
fn held_edge(mesh: &TriMesh, topology: &Topology, what: &str) -> anyhow::Result<Vec<u32>> {
    let height = |edge: &[u32]| edge.iter().map(|&v| mesh.positions[v as usize].z).sum::<f64>() / edge.len() as f64;
    if what == "top" {
        let highest = topology.boundary_loops().into_iter().max_by(|a, b| height(a).total_cmp(&height(b)));
        return highest.ok_or_else(|| UserError::new("--hold top: the garment has no edge to hold"));
    }
    let Some(group) = mesh.groups.iter().position(|g| g == what) else {
        return Err(UserError::new(format!(
            "--hold: found no group \"{what}\" in the garment, expected `top`{}",
            or_one_of(&mesh.groups)
        )));
    };
    let on_edge = topology.boundary_vertices();
    let mut held: Vec<u32> = (mesh.triangles.iter().zip(&mesh.triangle_group))
        .filter(|&(_, &g)| g as usize == group)
        .flat_map(|(triangle, _)| *triangle)
        .filter(|&v| on_edge[v as usize])
        .collect();
    held.sort_unstable();
    held.dedup();
    Ok(held)
}

/// The groups to choose from, the first of many.
fn or_one_of(groups: &[String]) -> String {
    const SHOWN: usize = 20;
    if groups.is_empty() {
        return ", as its file has no groups (lines that begin with g or o)".to_owned();
    }
    let shown = groups.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = if groups.len() > SHOWN { format!(" and {} more", groups.len() - SHOWN) } else { String::new() };
    format!(" or one of {shown}{more}")
}

/// Whether an argument names a file rather than something built in.
pub(crate) fn looks_like_a_file(argument: &str) -> bool {
    argument.contains(['/', '\\', '.'])
}

/// Reads a text file, saying which one could not be read.
pub(crate) fn read_text(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).map_err(|e| {
        UserError::new(format!("{}: cannot be read: {e}; check the path and its permissions", path.display()))
    })
}

fn stem(argument: &str) -> String {
    let path = PathBuf::from(argument);
    path.file_stem().map_or_else(|| argument.to_owned(), |s| s.to_string_lossy().into_owned())
}
