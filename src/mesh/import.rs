//! Imports a body or a garment from OBJ: converts it to metres with z up and repairs it as far as is safe.
//!
//! The mesh has the vertices of the file that a face uses, in the order of the file: corners that differ only in their
//! texture coordinate share a vertex. Vertices are welded by position only on request, because welding can make a clean
//! mesh non-manifold.

use std::collections::BTreeSet;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::cleanup::Cleaned;
use super::error::MeshError;
use super::frame::{Axis, Frame, Unit};
use super::frame_guess::{guess_frame, guess_frame_around};
use super::obj_lines::{Face, ObjContents, used};
use super::obj_source::{ObjSource, read};
use super::orientation::face_outward;
use super::report::{MeshReport, Remark, Repair};
use super::topology::{NONE, Topology};
use super::{TriMesh, each_once};

/// Name of the triangles without a group in a file that has groups.
const UNGROUPED: &str = "(none)";

/// Options of an import.
#[derive(Debug, Clone, Default)]
pub struct ImportOptions {
    /// Import only this group or object.
    pub group: Option<String>,
    /// Unit of the file; guessed where it is not given.
    pub unit: Option<Unit>,
    /// Up axis of the file; guessed where it is not given.
    pub up: Option<Axis>,
    /// Weld vertices at exactly the same position.
    pub weld: bool,
    /// Accept a body with a boundary.
    pub open_body: bool,
}

/// The body that a garment is imported for.
#[derive(Debug, Clone)]
pub enum Beside<'a> {
    /// A body from a file of this frame, which the garment shares.
    File(&'a Frame),
    /// A body within these bounds (m, z up); the garment's frame is the one that fits it best.
    Bounds(DVec3, DVec3),
}

/// An imported mesh, its report and its source.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The mesh: metres, z up.
    pub mesh: TriMesh,
    /// Counts, repairs and remarks.
    pub report: MeshReport,
    /// The file, for the export.
    pub source: ObjSource,
    /// Texture coordinates of the corners of each triangle; `None` if a corner has none.
    pub texture: Vec<Option<[DVec2; 3]>>,
    /// Index into [`ObjSource::faces`] of the face that each triangle was cut from.
    pub(super) face: Vec<u32>,
}

impl Imported {
    /// The frame the file was read in.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.source.frame
    }

    /// This mesh at the positions of `other`, a file of the same faces that holds the rest shape.
    pub fn in_the_shape_of(&self, other: &Self) -> Result<TriMesh, MeshError> {
        let differs = |difference: String| MeshError::OtherTopology {
            file: other.source.file.clone(),
            other: self.source.file.clone(),
            difference,
        };
        let (ours, theirs) = (&self.source, &other.source);
        if ours.faces.len() != theirs.faces.len() {
            return Err(differs(format!("{} faces, expected {}", theirs.faces.len(), ours.faces.len())));
        }
        for (i, (a, b)) in ours.faces.iter().zip(&theirs.faces).enumerate() {
            let vertices =
                |source: &ObjSource, face| source.corners_of(face).iter().map(|c| c.vertex).collect::<Vec<_>>();
            if vertices(ours, a) != vertices(theirs, b) {
                return Err(differs(format!("face {} has other vertices", i + 1)));
            }
        }
        // The polygons agree. The triangles are those of `self`: another shape may cut its quads along other diagonals.
        let place = |&v: &u32| theirs.mesh_vertex.get(v as usize).and_then(|&w| other.mesh.positions.get(w as usize));
        let positions: Option<Vec<DVec3>> = ours.file_vertices().iter().map(|v| place(v).copied()).collect();
        Ok(self.mesh.with_positions(positions.ok_or_else(|| differs("vertices are missing".to_owned()))?))
    }
}

/// Imports a body.
///
/// # Errors
/// [`MeshError`]: a file that is missing, not an OBJ, empty, or malformed; a group that is not there; a unit that
/// cannot be guessed; [`MeshError::BodyOpen`] where it has a boundary and `open_body` is not set.
pub fn import_body(file: &Path, options: &ImportOptions) -> Result<Imported, MeshError> {
    let contents = read(file)?;
    let faces = chosen_faces(file, &contents, options)?;
    let frame = guess_frame(&used_positions(&contents, &faces), options.unit, options.up)
        .map_err(|height| MeshError::UnknownScale { file: file.to_owned(), height })?;
    let mut imported = build(file, contents, faces, frame, options)?;
    face_outward(&mut imported);
    let topology = Topology::new(&imported.mesh);
    if let Some([a, b]) = topology.boundary_edges().next() {
        let (edges, loops) = (imported.report.boundary_edges, imported.report.boundary_loops);
        if !options.open_body {
            let number = imported.source.file_vertices();
            let [a, b] = [a, b].map(|v| number[v as usize] as usize + 1);
            let hint = open_hint(&imported.report, options);
            return Err(MeshError::BodyOpen { file: imported.source.file, edges, loops, a, b, hint });
        }
        imported.report.remarks.push(Remark::Open { edges, loops });
    }
    Ok(imported)
}

/// Imports a garment for a body.
///
/// # Errors
/// [`MeshError`]: a file that is missing, not an OBJ, empty, or malformed; a group that is not there; no frame that
/// puts it around the body.
pub fn import_garment(file: &Path, options: &ImportOptions, body: &Beside<'_>) -> Result<Imported, MeshError> {
    let contents = read(file)?;
    let faces = chosen_faces(file, &contents, options)?;
    let frame = match (body, options.unit, options.up) {
        (_, Some(unit), Some(up)) => Frame::given(unit, up),
        (Beside::File(frame), unit, up) => Frame {
            unit: unit.unwrap_or(frame.unit),
            up: up.unwrap_or(frame.up),
            guessed: frame.guessed,
            reason: "as the body".to_owned(),
        },
        (&Beside::Bounds(lo, hi), unit, up) => {
            guess_frame_around(&used_positions(&contents, &faces), (lo, hi), unit, up)
                .ok_or_else(|| MeshError::NoFrame { file: file.to_owned() })?
        }
    };
    build(file, contents, faces, frame, options)
}

/// Suggests a remedy for an open body: welding, or choosing the body's group.
fn open_hint(report: &MeshReport, options: &ImportOptions) -> String {
    let apart = report.remarks.iter().find_map(|remark| match remark {
        Remark::Coincident { vertices } => Some(*vertices),
        _ => None,
    });
    let mut hint = String::new();
    if let Some(vertices) = apart {
        hint += &format!("{vertices} vertices lie exactly on another: try --weld. ");
    }
    if report.groups > 1 && options.group.is_none() {
        hint += &format!("The file has {} groups: choose the body with --body-group. ", report.groups);
    }
    hint
}

fn chosen_faces(file: &Path, contents: &ObjContents, options: &ImportOptions) -> Result<Vec<Face>, MeshError> {
    let faces = match &options.group {
        None => contents.faces.clone(),
        Some(asked) => {
            let wanted = contents.number_of(asked);
            let chosen =
                contents.faces.iter().filter(|face| wanted.is_some_and(|w| face.group == w || face.object == w));
            let chosen: Vec<Face> = chosen.copied().collect();
            if chosen.is_empty() {
                let used: BTreeSet<u32> = contents.faces.iter().flat_map(|face| [face.group, face.object]).collect();
                let available =
                    (0u32..).zip(&contents.names).filter(|(i, _)| used.contains(i)).map(|(_, name)| name.clone());
                let (file, asked) = (file.to_owned(), asked.clone());
                return Err(MeshError::UnknownGroup { file, asked, available: available.collect() });
            }
            chosen
        }
    };
    if faces.is_empty() {
        let file = file.to_owned();
        return Err(MeshError::Empty { file, vertices: contents.positions.len(), faces: 0 });
    }
    Ok(faces)
}

fn used_positions(contents: &ObjContents, faces: &[Face]) -> Vec<DVec3> {
    let used = used(contents.positions.len(), faces, &contents.corners);
    contents.positions.iter().zip(used).filter(|&(_, used)| used).map(|(&p, _)| p).collect()
}

fn build(
    file: &Path,
    contents: ObjContents,
    faces: Vec<Face>,
    frame: Frame,
    options: &ImportOptions,
) -> Result<Imported, MeshError> {
    let placed: Vec<DVec3> = contents.positions.iter().map(|&p| frame.to_metres(p)).collect();
    let mut repairs = Vec::new();
    let mut remarks = Vec::new();
    if let Some(name) = &options.group {
        repairs.push(Repair::GroupChosen { name: name.clone(), left_out: contents.faces.len() - faces.len() });
    }
    let cleaned = Cleaned::new(&placed, &contents.corners, &faces, options.weld, &mut repairs);
    if cleaned.triangles.is_empty() {
        let (file, vertices) = (file.to_owned(), contents.positions.len());
        return Err(MeshError::Empty { file, vertices, faces: faces.len() });
    }
    let group: Vec<u32> = cleaned.face.iter().map(|&f| contents.group_of(&faces[f as usize])).collect();
    let (groups, triangle_group) = named_groups(&group, &contents.names);
    let texture = cleaned.corner.iter().map(|corners| {
        let known = corners.map(|c| contents.corners[c as usize].texture);
        known.iter().all(|&t| t != NONE).then(|| known.map(|t| contents.textures[t as usize]))
    });
    let texture: Vec<_> = texture.collect();
    let mesh = TriMesh { positions: cleaned.positions, triangles: cleaned.triangles, groups, triangle_group };
    if contents.small_faces > 0 {
        remarks.push(Remark::SmallFaces { count: contents.small_faces });
    }
    if let Some((line, text)) = contents.first_unknown.clone() {
        remarks.push(Remark::UnknownLines { count: contents.unknown, line, text });
    }
    let report = MeshReport {
        file: file.display().to_string(),
        frame: frame.clone(),
        vertices: mesh.vertex_count(),
        triangles: mesh.triangles.len(),
        faces: faces.len(),
        components: 0,
        groups: mesh.groups.len(),
        boundary_edges: 0,
        boundary_loops: 0,
        repairs,
        remarks,
    };
    let source = ObjSource {
        file: file.to_owned(),
        frame,
        corners: contents.corners,
        faces,
        statements: contents.statements,
        positions: contents.positions,
        textures: contents.textures,
        mesh_vertex: cleaned.mesh_vertex,
    };
    let mut imported = Imported { mesh, report, source, texture, face: cleaned.face };
    imported.make_agree(cleaned.coincident);
    Ok(imported)
}

/// Names of the groups that have triangles, in the order of the file, and the index of each triangle's group.
fn named_groups(group: &[u32], names: &[String]) -> (Vec<String>, Vec<u32>) {
    let used = each_once(group.iter().copied());
    if used == [NONE] {
        return (Vec::new(), Vec::new());
    }
    let name = |&g: &u32| names.get(g as usize).map_or(UNGROUPED, String::as_str).to_owned();
    let place = |g: &u32| used.partition_point(|u| u < g) as u32;
    (used.iter().map(name).collect(), group.iter().map(place).collect())
}
