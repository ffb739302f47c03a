//! A scene with its origin: guesses, findings and repairs of its files, and writing the result back.

use std::path::Path;

use glam::DVec3;

use super::layering::join;
use super::materials::{Cut, Swatch};
use super::{Layer, PushOutReport, Scene};
use crate::garment::pattern::SewingPattern;
use crate::garment::sewing::PutOn;
use crate::mesh::Export;
use crate::mesh::export::export;
use crate::mesh::flat_pattern::FlatPattern;
use crate::mesh::import::Imported;
use crate::mesh::report::{MeshReport, Repair};
use crate::mesh::{Frame, MeshError, RestShape, TriMesh};

/// A scene with its origin.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The body and the garments on it.
    pub scene: Scene,
    /// The name of the body.
    pub body_name: String,
    /// The name of the garments.
    pub garment_name: String,
    /// Guesses, findings and repairs in each file, the body's first.
    pub reports: Vec<MeshReport>,
    /// The repair of vertices that started inside the body.
    pub pushed_out: PushOutReport,
    /// The sewing pattern of the garment.
    pub tailored: Option<Tailored>,
    /// The flat pattern found in the texture coordinates.
    pub flat_pattern: Option<FlatPattern>,
    /// The fabrics that were assigned.
    pub swatches: Vec<Swatch>,
    pub(super) imported: Option<Imported>,
    /// Notes on the names of held edges.
    pub(super) hold_notes: Vec<String>,
}

/// A garment made of a sewing pattern.
#[derive(Debug, Clone)]
pub struct Tailored {
    /// The pattern as in its file.
    pub pattern: SewingPattern,
    /// The garment, sewn and put on the body.
    pub put_on: PutOn,
}

impl Loaded {
    /// The frame of the garment's file, if it is a mesh.
    #[must_use]
    pub(crate) fn garment_frame(&self) -> Option<&Frame> {
        self.imported.as_ref().map(|imported| &imported.report.frame)
    }

    /// Repairs of the garment's mesh.
    pub(crate) fn repairs(&self) -> &[Repair] {
        self.imported.as_ref().map_or(&[], |imported| &imported.report.repairs)
    }

    /// Findings that the user should act on.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        if self.pushed_out.is_clean() { Vec::new() } else { vec![self.pushed_out.to_string()] }
    }

    /// Guesses, findings and repairs.
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
        notes.extend(self.hold_notes.iter().cloned());
        notes.extend(self.swatches.iter().map(|swatch| format!("cut: {swatch}")));
        if self.pushed_out.is_clean() && (self.pushed_out.found_inside > 0 || self.pushed_out.protrusion_move_m > 0.0) {
            notes.push(self.pushed_out.to_string());
        }
        notes
    }

    /// The positions (m) of this garment's vertices in `draped`, a file with the faces that [`write`](Self::write) gives it.
    ///
    /// # Errors
    /// [`MeshError::OtherTopology`] names the first face that differs.
    pub fn positions_in(&self, draped: &Self) -> Result<Vec<DVec3>, MeshError> {
        let Some(theirs) = &draped.imported else { return Ok(draped.scene.garment.positions.clone()) };
        match &self.imported {
            // Triangles of the scene: its polygons may be cut along other diagonals in another shape.
            Some(ours) => Ok(ours.in_the_shape_of(theirs)?.positions),
            None => theirs.positions_of(&self.scene.garment.triangles, &self.garment_name),
        }
    }

    /// The garment at `positions` (m) by the vertices of its file, in the unit and axes of the file; a garment without a file as it is.
    #[must_use]
    pub fn in_file(&self, positions: &[DVec3]) -> Vec<DVec3> {
        self.imported.as_ref().map_or_else(|| positions.to_vec(), |imported| imported.in_file(positions))
    }

    /// Writes the garment at `positions` (m) as glTF, PLY or USD where the path ends in `.glb`, `.ply` or `.usda`, else as OBJ. Groups
    /// and texture coordinates are those of the garment's file; a garment of a pattern has its panels and the flat pattern. OBJ and
    /// PLY keep the polygons, unit and axes of the file, too.
    ///
    /// # Errors
    /// [`MeshError`]: a file that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>, positions: &[DVec3]) -> Result<(), MeshError> {
        self.write_with(path.as_ref(), positions, None, false)
    }

    /// [`write`](Self::write) with a colour for each vertex, and in glTF and USD with the body, if wanted.
    pub(crate) fn write_with(
        &self,
        path: &Path,
        positions: &[DVec3],
        colours: Option<&[[u8; 4]]>,
        with_body: bool,
    ) -> Result<(), MeshError> {
        let mesh = self.scene.garment.with_positions(positions.to_vec());
        let of_file = |imported: &Imported| -> Option<Vec<_>> {
            let corners = &imported.texture;
            corners.iter().any(Option::is_some).then(|| corners.iter().map(|c| c.unwrap_or_default()).collect())
        };
        let texture = match (&self.imported, &self.tailored) {
            (Some(imported), _) => of_file(imported),
            (None, Some(Tailored { pattern, put_on })) => Some(put_on.garment.laid_out(pattern)),
            (None, None) => None,
        };
        let body = with_body.then(|| self.scene.body.mesh());
        let (imported, texture) = (self.imported.as_ref(), texture.as_deref());
        export(path, &Export { mesh: &mesh, imported, texture, colours, body })
    }
}

/// A garment before it is placed on the body.
pub(super) struct Unplaced {
    pub(super) mesh: TriMesh,
    pub(super) rest: RestShape,
    pub(super) held: Vec<u32>,
    /// Whether they are released once the garment is at rest.
    pub(super) releases_held: bool,
    pub(super) cut: Cut,
    pub(super) tailored: Option<Tailored>,
    pub(super) imported: Option<Imported>,
    pub(super) flat_pattern: Option<FlatPattern>,
}

impl Unplaced {
    pub(super) fn new(mesh: TriMesh, rest: RestShape) -> Self {
        let (held, cut) = (Vec::new(), Cut::default());
        Self { mesh, rest, held, releases_held: false, cut, tailored: None, imported: None, flat_pattern: None }
    }

    /// The layer of the vertices and triangles after the given counts.
    pub(super) fn layer(&self, name: String, (vertices, triangles): (usize, usize)) -> Layer {
        Layer { name, vertices: vertices..self.mesh.vertex_count(), triangles: triangles..self.mesh.triangles.len() }
    }

    /// Adds a garment that is worn over it. Files and patterns then describe only a part of the mesh and are dropped.
    pub(super) fn add_outer(&mut self, outer: Self) {
        let triangles = [&self.mesh, &outer.mesh].map(|mesh| mesh.triangles.len());
        self.cut.join(outer.cut, &outer.rest, &mut self.rest, triangles);
        let before = join(&mut self.mesh, &mut self.rest, outer.mesh, outer.rest);
        self.held.extend(outer.held.iter().map(|v| v + before));
        (self.tailored, self.imported, self.flat_pattern) = (None, None, None);
        self.releases_held = false;
    }
}
