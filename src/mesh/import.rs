//! Imports a body or a garment from a mesh file: converts it to metres with z up and repairs it as far as is safe.
//!
//! The mesh has the vertices of the file that a face uses, in the order of the file: corners that differ only in their
//! texture coordinate share a vertex. Vertices are welded by position only on request, because welding can make a clean
//! mesh non-manifold. Polygons are cut into triangles; degenerate triangles, duplicates and unused vertices are dropped;
//! neighbours are turned to agree; a body is turned to face outward.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::bridges::Bridges;
use super::duplicates::{duplicate_parts, first_triangles, same_place};
use super::error::MeshError;
use super::frame::{Axis, Declared, Frame, Unit, guess_frame, guess_frame_around, guess_frame_worn};
use super::health::Findings;
use super::report::{MeshReport, Remark, Repair};
use super::rest::RestShape;
use super::source::{Corner, MeshSource};
use super::topology::{NONE, Topology};
use super::{TriMesh, box_about, longest_side, polygon, renumbered, retain, winding};

/// Ratio of a triangle's longest sides at rest and as worn, either way, from which a remark is made. A heuristic:
/// stretched or gathered cloth is off by tens of percent, a triangle of a torn pattern by more than this.
const MAX_SIZE_RATIO: f64 = 4.0;

/// Most triangles about one vertex of a garment. Bending couples all neighbours of a vertex with each other, so that a step
/// costs the cube of their number: a fan of 500 triangles takes 3 s to rest, one of 1,000 16 s, one of 4,000 87 s.
/// Poles of garments have up to 128.
pub const MAX_GARMENT_FAN: usize = 500;

/// Most triangles about one vertex of a body, of which `check` compares every pair: 1 s. The caps of bodies cut off at the
/// neck are fans of some hundreds.
pub const MAX_BODY_FAN: usize = 4_000;

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
    /// The contents, where they are in memory; the file is not read then, and its name stands in messages only.
    pub source: Option<Arc<MeshSource>>,
}

/// The body that a garment is imported for.
#[derive(Clone, Copy)]
pub enum Beside<'a> {
    /// A file of this frame, which the garment shares.
    File(&'a Frame),
    /// A body from a file of this frame, within these bounds (m, z up). The garment's frame is the one in which it lies about the
    /// body.
    Body {
        /// Frame of the body's file.
        frame: &'a Frame,
        /// Corners of the body's box, m, z up.
        bounds: (DVec3, DVec3),
        /// How closely points (m, z up) lie about the body: 1 where on it, near 0 where far from it or deep inside.
        closeness: &'a dyn Fn(&[DVec3]) -> f64,
    },
    /// A body within these bounds (m, z up); the garment's frame is the one that fits it best.
    Bounds(DVec3, DVec3),
}

/// Imports a body.
///
/// # Errors
/// [`MeshError`]: a file that is missing, of no known format, empty, or malformed; a group that is not there; a unit that
/// cannot be guessed; [`MeshError::BodyOpen`] where it has a boundary and `open_body` is not set.
pub fn import_body(file: &Path, options: &ImportOptions) -> Result<Imported, MeshError> {
    let mut imported = Imported::new(file, options, MAX_BODY_FAN, |source| {
        guess_frame(&source.used_positions(), options.unit, options.up, source.declared)
            .map_err(|height| MeshError::UnknownScale { file: file.to_owned(), height })
    })?;
    imported.face_outward();
    if let Some(edge) = Topology::new(&imported.mesh).boundary_edges().next() {
        let (edges, loops) = (imported.report.boundary_edges, imported.report.boundary_loops);
        if !options.open_body {
            let number = imported.file_vertices();
            let [a, b] = edge.map(|v| number[v as usize] as usize + 1);
            let hint = open_hint(&imported.report, options);
            return Err(MeshError::BodyOpen { file: file.to_owned(), edges, loops, a, b, hint });
        }
        imported.report.remarks.push(Remark::Open { edges, loops });
    }
    Ok(imported)
}

/// Imports a garment for a body.
///
/// # Errors
/// [`MeshError`]: a file that is missing, of no known format, empty, or malformed; a group that is not there; no frame that
/// puts it around the body.
pub fn import_garment(file: &Path, options: &ImportOptions, body: &Beside<'_>) -> Result<Imported, MeshError> {
    Imported::new(file, options, MAX_GARMENT_FAN, |source| match (body, options.unit, options.up) {
        (_, Some(unit), Some(up)) => Ok(Frame::given(unit, up)),
        (Beside::File(frame), unit, up) => Ok(Frame {
            unit: unit.unwrap_or(frame.unit),
            up: up.unwrap_or(frame.up),
            guessed: frame.guessed,
            reason: "as the body".to_owned(),
        }),
        (&Beside::Body { frame, bounds, closeness }, unit, up) => {
            let declared = source.declared.map(|declared| (declared.frame(), declared.reason()));
            let own = declared.as_ref().map_or((frame, "as the body"), |(frame, reason)| (frame, reason));
            guess_frame_worn(&source.used_positions(), own, bounds, closeness, (unit, up))
                .ok_or_else(|| no_frame(file, source, bounds))
        }
        (&Beside::Bounds(lo, hi), unit, up) => {
            guess_frame_around(&source.used_positions(), (lo, hi), unit, up, source.declared)
                .ok_or_else(|| no_frame(file, source, (lo, hi)))
        }
    })
}

fn no_frame(file: &Path, source: &MeshSource, (low, high): (DVec3, DVec3)) -> MeshError {
    let own = box_about(source.used_positions());
    MeshError::NoFrame { file: file.to_owned(), garment: own.1 - own.0, body_m: high - low }
}

/// Suggests a remedy for an open body: welding, or choosing the body's group.
fn open_hint(report: &MeshReport, options: &ImportOptions) -> String {
    let mut hint = String::new();
    for remark in &report.remarks {
        if let Remark::Coincident { vertices } = remark {
            hint += &format!("{vertices} vertices lie exactly on another: try --weld. ");
        }
    }
    if report.groups > 1 && options.group.is_none() {
        hint += &format!("The file has {} groups: choose the body with --body-group. ", report.groups);
    }
    hint
}

/// An imported mesh, its report and its source.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The mesh: metres, z up.
    pub mesh: TriMesh,
    /// Counts, repairs and remarks.
    pub report: MeshReport,
    /// The file, for the export.
    pub source: MeshSource,
    /// Texture coordinates of the corners of each triangle, `None` if a corner has none; empty where the file has none.
    pub texture: Vec<Option<[DVec2; 3]>>,
    /// Index into [`MeshSource::faces`] of the face that each triangle was cut from.
    face: Vec<u32>,
    /// Mesh vertex of each file vertex, or [`NONE`] where no triangle uses it.
    pub(super) mesh_vertex: Vec<u32>,
}

impl Imported {
    /// Reads a file, whose frame is `frame_of` its contents, and repairs it. Refuses more than `max_fan` triangles about one vertex.
    fn new(
        file: &Path,
        options: &ImportOptions,
        max_fan: usize,
        frame_of: impl FnOnce(&MeshSource) -> Result<Frame, MeshError>,
    ) -> Result<Self, MeshError> {
        let mut source = match &options.source {
            Some(source) => source.named(file),
            None => MeshSource::read(file)?,
        };
        let mut repairs = Vec::new();
        if let Some(name) = &options.group {
            let left_out = source.choose_group(name)?;
            repairs.push(Repair::GroupChosen { name: name.clone(), left_out });
        }
        let empty = |source: &MeshSource, faces| MeshError::Empty {
            file: file.to_owned(),
            vertices: source.positions.len(),
            faces,
        };
        if source.faces.is_empty() {
            return Err(empty(&source, 0));
        }
        let frame = frame_of(&source)?;
        let positions: Vec<DVec3> = source.positions.iter().map(|&p| frame.to_metres(p)).collect();
        let used = source.used_vertices();
        let (place, mut coincident) = same_place(&positions, &used);
        let mesh_vertex = if options.weld { place.clone() } else { (0..positions.len() as u32).collect() };
        let (name, faces) = (file.display().to_string(), source.faces.len());
        let report = MeshReport { file: name, frame, faces, repairs, ..MeshReport::default() };
        let mesh = TriMesh::new(positions, Vec::new());
        let mut imported = Self { mesh, report, source, texture: Vec::new(), face: Vec::new(), mesh_vertex };

        let vertices = imported.source.merged;
        imported.repaired(vertices, Repair::Merged { vertices });
        let [quads, larger, degenerate] = imported.triangulate();
        imported.repaired(quads + larger, Repair::PolygonsCut { quads, larger });
        if options.weld {
            let vertices = std::mem::take(&mut coincident);
            imported.repaired(vertices, Repair::Welded { vertices });
        }
        imported.repaired(degenerate, Repair::DegenerateDropped { triangles: degenerate });
        let triangles = imported.keep(&first_triangles(&imported.mesh.triangles));
        imported.repaired(triangles, Repair::DuplicatesDropped { triangles });
        if coincident > 0
            && let Some(found) = duplicate_parts(&imported.mesh.triangles, &imported.face, &place)
        {
            coincident -= found.stand_in.len();
            found.stand_in.iter().for_each(|(&v, &kept)| imported.mesh_vertex[v as usize] = kept);
            let triangles = imported.keep(&found.keep);
            imported.repaired(triangles, Repair::DuplicatePartsDropped { parts: found.parts, triangles });
        }
        if imported.face.is_empty() {
            return Err(empty(&imported.source, imported.source.faces.len()));
        }
        let vertices = used.iter().filter(|&&used| !used).count();
        imported.repaired(vertices, Repair::UnusedDropped { vertices });
        imported.drop_unused_vertices();
        imported.check_fans(max_fan)?;
        (imported.mesh.groups, imported.mesh.triangle_group) = imported.source.groups(&imported.face);
        imported.report.groups = imported.mesh.groups.len();
        let count = imported.source.small_faces;
        imported.remark(count, Remark::SmallFaces { count });
        let remarks = std::mem::take(&mut imported.source.remarks);
        imported.report.remarks.extend(remarks);
        imported.remark_on_frame();

        let (turned, patches) = winding::agree(&imported.mesh);
        turned.iter().for_each(|&t| imported.turn(t));
        imported.repaired(turned.len(), Repair::WindingTurned { triangles: turned.len() });
        imported.remark(coincident, Remark::Coincident { vertices: coincident });
        imported.remark(patches, Remark::OneSided { patches });
        imported.report_topology();
        Ok(imported)
    }

    /// Cuts the faces into triangles of different vertices; returns the numbers of quads, of larger polygons and of degenerate
    /// triangles.
    fn triangulate(&mut self) -> [usize; 3] {
        let (mut quads, mut larger, mut degenerate) = (0, 0, 0);
        for (number, face) in self.source.faces.iter().enumerate() {
            quads += usize::from(face.count == 4);
            larger += usize::from(face.count > 4);
            // Consecutive equal corners are one corner of the outline.
            let mut outline = self.source.corners_of(face).to_vec();
            let vertex = |corner: &Corner| self.mesh_vertex[corner.vertex as usize];
            outline.dedup_by_key(|corner| vertex(corner));
            while outline.len() > 1 && vertex(&outline[0]) == vertex(&outline[outline.len() - 1]) {
                outline.pop();
            }
            degenerate += (face.count as usize - outline.len()).min(face.count as usize - 2);
            let places: Vec<DVec3> = outline.iter().map(|c| self.mesh.positions[vertex(c) as usize]).collect();
            for corners in polygon::triangulate(&places) {
                let [a, b, c] = corners.map(|i| vertex(&outline[i]));
                if a == b || b == c || c == a {
                    degenerate += 1;
                    continue;
                }
                self.mesh.triangles.push([a, b, c]);
                self.face.push(number as u32);
                if !self.source.textures.is_empty() {
                    let [a, b, c] = corners.map(|i| self.source.textures.get(outline[i].texture as usize).copied());
                    self.texture.push(a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]));
                }
            }
        }
        [quads, larger, degenerate]
    }

    /// The file vertex, from 0, of each mesh vertex: the first of those welded into it.
    #[must_use]
    pub fn file_vertices(&self) -> Vec<u32> {
        let mut file_vertices = vec![NONE; self.mesh.vertex_count()];
        for (file_vertex, &v) in self.mesh_vertex.iter().enumerate().rev().filter(|(_, v)| **v != NONE) {
            file_vertices[v as usize] = file_vertex as u32;
        }
        file_vertices
    }

    /// Positions by file vertex, in the file's frame, for the mesh's vertices at `positions` (m). Vertices that no triangle uses keep
    /// the position of the file.
    #[must_use]
    pub(crate) fn in_file(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let place = |(v, own): (&u32, &DVec3)| {
            positions.get(*v as usize).map_or(*own, |&position| self.report.frame.to_file(position))
        };
        self.mesh_vertex.iter().zip(&self.source.positions).map(place).collect()
    }

    /// This mesh at the positions of `other`, a file of the same faces that holds the rest shape.
    pub fn in_the_shape_of(&self, other: &Self) -> Result<TriMesh, MeshError> {
        let (ours, theirs) = (&self.source, &other.source);
        let differs =
            |difference| MeshError::OtherTopology { file: theirs.file.clone(), other: ours.file.clone(), difference };
        if ours.faces.len() != theirs.faces.len() {
            return Err(differs(format!("{} faces, expected {}", theirs.faces.len(), ours.faces.len())));
        }
        // An export leaves out the vertices that no face uses, so vertices are compared by their rank among the others.
        let ranks = [ours, theirs].map(|source| {
            let used = source.used_vertices();
            renumbered(used.len(), |v| used[v])
        });
        let vertices = |source: &MeshSource, face, rank: &[u32]| -> Vec<u32> {
            source.corners_of(face).iter().map(|c| rank[c.vertex as usize]).collect()
        };
        let mut pairs = ours.faces.iter().zip(&theirs.faces);
        if let Some(i) = pairs.position(|(a, b)| vertices(ours, a, &ranks[0]) != vertices(theirs, b, &ranks[1])) {
            return Err(differs(format!("face {} has other vertices", i + 1)));
        }
        // The polygons agree. The triangles are those of `self`: another shape may cut its quads along other diagonals.
        let ranked: Vec<u32> =
            other.mesh_vertex.iter().zip(&ranks[1]).filter(|(_, r)| **r != NONE).map(|(v, _)| *v).collect();
        let place = |&v: &u32| other.mesh.positions.get(*ranked.get(ranks[0][v as usize] as usize)? as usize).copied();
        let positions: Option<Vec<DVec3>> = self.file_vertices().iter().map(place).collect();
        Ok(self.mesh.with_positions(positions.ok_or_else(|| differs("vertices are missing".to_owned()))?))
    }

    /// The positions (m) of the file's vertices, if its faces are these triangles of the mesh `name`, in this order.
    ///
    /// # Errors
    /// [`MeshError::OtherTopology`] names the first face that differs.
    pub(crate) fn positions_of(&self, triangles: &[[u32; 3]], name: &str) -> Result<Vec<DVec3>, MeshError> {
        let source = &self.source;
        let differs =
            |difference| MeshError::OtherTopology { file: source.file.clone(), other: name.into(), difference };
        if source.faces.len() != triangles.len() {
            return Err(differs(format!("{} faces, expected {}", source.faces.len(), triangles.len())));
        }
        let same = |(face, triangle): (_, &[u32; 3])| source.corners_of(face).iter().map(|c| c.vertex).eq(*triangle);
        if let Some(i) = source.faces.iter().zip(triangles).position(|pair| !same(pair)) {
            return Err(differs(format!("face {} has other vertices", i + 1)));
        }
        let place = |&v: &u32| self.mesh.positions.get(v as usize).copied();
        let positions: Option<Vec<DVec3>> = self.mesh_vertex.iter().map(place).collect();
        positions.ok_or_else(|| differs("vertices are missing".to_owned()))
    }

    /// The mesh itself as rest shape. If `shut`, the triangles that bridge open seams get the size of the others.
    pub(crate) fn own_rest(&mut self, shut: bool) -> RestShape {
        let mut rest = RestShape::edges_of(&self.mesh);
        if let Some(bridges) = Bridges::of(&self.mesh).filter(|_| shut) {
            bridges.shut(&mut rest);
            let Bridges { triangles, longest_m, usual_m } = bridges;
            self.report.repairs.push(Repair::BridgesShut { triangles, longest_m, usual_m });
        }
        rest
    }

    /// Drops triangles (not all), the vertices that only they use, and the faces of which nothing is left.
    pub(crate) fn drop_triangles(&mut self, drop: &[bool]) {
        let Some(first) = drop.iter().position(|&drop| drop) else { return };
        let first = self.file_face(first);
        let mut left = vec![true; self.source.faces.len()];
        self.face.iter().zip(drop).filter(|(_, drop)| **drop).for_each(|(&f, _)| left[f as usize] = false);
        let triangles = self.keep(&drop.iter().map(|drop| !drop).collect::<Vec<_>>());
        self.face.iter().for_each(|&f| left[f as usize] = true);
        let number = renumbered(left.len(), |f| left[f]);
        self.face.iter_mut().for_each(|f| *f = number[*f as usize]);
        retain(&mut self.source.faces, |f| left[f]);
        self.drop_unused_vertices();
        self.report.repairs.push(Repair::NoAreaDropped { triangles, first });
        self.report_topology();
    }

    /// Keeps the marked triangles and returns the number dropped.
    fn keep(&mut self, keep: &[bool]) -> usize {
        retain(&mut self.mesh.triangles, |t| keep[t]);
        retain(&mut self.mesh.triangle_group, |t| keep[t]);
        retain(&mut self.texture, |t| keep[t]);
        retain(&mut self.face, |t| keep[t]);
        keep.len() - self.face.len()
    }

    /// Drops the vertices that no triangle uses.
    fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.mesh.vertex_count()];
        self.mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
        let number = renumbered(used.len(), |v| used[v]);
        retain(&mut self.mesh.positions, |v| used[v]);
        self.mesh.triangles.as_flattened_mut().iter_mut().for_each(|v| *v = number[*v as usize]);
        self.mesh_vertex.iter_mut().filter(|v| **v != NONE).for_each(|v| *v = number[*v as usize]);
    }

    /// Refuses a vertex of more than `max_fan` triangles, which an edge of as many triangles has, too.
    fn check_fans(&self, max_fan: usize) -> Result<(), MeshError> {
        let mut triangles = vec![0; self.mesh.vertex_count()];
        self.mesh.triangles.as_flattened().iter().for_each(|&v| triangles[v as usize] += 1);
        let Some(v) = triangles.iter().position(|&triangles| triangles > max_fan) else { return Ok(()) };
        let vertex = self.file_vertices()[v] as usize;
        let (file, at, triangles) = (self.source.file.clone(), self.source.positions[vertex], triangles[v]);
        Err(MeshError::Fan { file, vertex: vertex + 1, at, triangles, max_fan })
    }

    /// Turns the triangles that face inward, which are whole connected parts.
    pub fn turn_outward(&mut self, inward: &[bool]) {
        let (component, count) = Topology::new(&self.mesh).components();
        let mut turned = vec![false; count];
        for t in (0..inward.len()).filter(|&t| inward[t]) {
            turned[component[self.mesh.triangles[t][0] as usize] as usize] = true;
            self.turn(t);
        }
        let components = turned.iter().filter(|&&turned| turned).count();
        self.repaired(components, Repair::TurnedOutward { components });
    }

    /// Turns the connected parts that enclose a negative volume.
    fn face_outward(&mut self) {
        let (component, count) = Topology::new(&self.mesh).components();
        let volumes = winding::signed_volumes(&self.mesh, &component, count);
        let part = |triangle: &[u32; 3]| component[triangle[0] as usize] as usize;
        let inward: Vec<bool> = self.mesh.triangles.iter().map(|triangle| volumes[part(triangle)] < 0.0).collect();
        self.turn_outward(&inward);
    }

    /// Reverses one triangle and its texture coordinates.
    fn turn(&mut self, t: usize) {
        self.mesh.triangles[t].swap(1, 2);
        if let Some(Some(corners)) = self.texture.get_mut(t) {
            corners.swap(1, 2);
        }
    }

    /// The file's face, from 1, of a triangle.
    fn file_face(&self, triangle: usize) -> usize {
        self.source.faces[self.face[triangle] as usize].number as usize + 1
    }

    /// Remarks on slivers of the rest shape, and on triangles of another size at rest than as worn.
    pub(crate) fn remark_on(&mut self, rest: &RestShape) {
        let triangles = rest.slivers();
        self.remark(triangles, Remark::Slivers { triangles });
        let at_rest = rest.corners.iter().map(|c| longest_side(c.map(|p| p.extend(0.0))));
        let sizes = at_rest.enumerate().map(|(t, rest)| (t, rest, longest_side(self.mesh.corners(t))));
        let off: Vec<(f64, usize, f64, f64)> = sizes
            .map(|(t, rest, worn)| ((rest / worn).max(worn / rest), t, rest, worn))
            .filter(|(ratio, ..)| *ratio > MAX_SIZE_RATIO)
            .collect();
        if let Some(&(_, t, rest_m, worn_m)) = off.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
            let (triangles, first) = (off.len(), self.file_face(t));
            self.report.remarks.push(Remark::OtherThanWorn { triangles, first, rest_m, worn_m });
        }
    }

    /// Remarks on a frame other than the one that the format prescribes.
    fn remark_on_frame(&mut self) {
        let Frame { unit, up, .. } = self.report.frame;
        let Some(Declared { format, unit: declared_unit, up: declared_up }) = self.source.declared else { return };
        if (unit, up) != (declared_unit, declared_up) {
            self.report.remarks.push(Remark::OtherThanDeclared { format, declared_unit, declared_up, unit, up });
        }
    }

    /// Counts vertices, triangles, parts and boundaries, and remarks on irregular edges, vertices and triangles.
    fn report_topology(&mut self) {
        let topology = Topology::new(&self.mesh);
        let findings = Findings::new(&self.mesh, &topology);
        let report = &mut self.report;
        report.vertices = self.mesh.vertex_count();
        report.triangles = self.mesh.triangles.len();
        report.components = topology.components().1;
        report.boundary_edges = topology.boundary_edges().count();
        report.boundary_loops = topology.boundary_loops().len();
        let is_of_topology =
            |r: &Remark| matches!(r, Remark::NonManifold { .. } | Remark::Pinched { .. } | Remark::NoArea { .. });
        report.remarks.retain(|remark| !is_of_topology(remark));
        let Findings { non_manifold_edges: edges, pinched_vertices: vertices, no_area: triangles } = findings;
        self.remark(edges, Remark::NonManifold { edges });
        self.remark(vertices, Remark::Pinched { vertices });
        self.remark(triangles, Remark::NoArea { triangles });
    }

    /// Reports a repair of `count` things, if there are any.
    fn repaired(&mut self, count: usize, repair: Repair) {
        if count > 0 {
            self.report.repairs.push(repair);
        }
    }

    /// Reports a remark on `count` things, if there are any.
    fn remark(&mut self, count: usize, remark: Remark) {
        if count > 0 {
            self.report.remarks.push(remark);
        }
    }
}
