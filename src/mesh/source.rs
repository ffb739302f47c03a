//! The polygons of a mesh file of any format, in the unit and axes of the file, with groups and texture coordinates.
//!
//! Every reader of [`read`](super::read) makes one, the import repairs it, and an export is written from it.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};
use indexmap::IndexSet;

use super::error::MeshError;
use super::frame::Declared;
use super::report::Remark;
use super::topology::NONE;
use super::{TriMesh, each_once, retain};

/// Name of the triangles without a group in a file that has groups.
const UNGROUPED: &str = "(none)";
/// Largest magnitude of a coordinate: 10 km in millimetres, larger than any body in any unit. The squares of much larger
/// ones overflow.
pub(super) const MAX_COORDINATE: f64 = 1e7;

/// One corner of a face: a vertex and a texture coordinate of the file, from 0; [`NONE`] where there is no coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner {
    /// Vertex of the file, from 0.
    pub vertex: u32,
    /// Texture coordinate of the file, from 0, or [`NONE`].
    pub texture: u32,
}

/// One polygon of the file, of three or more corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Index of its first corner.
    pub first: u32,
    /// Number of its corners.
    pub count: u32,
    /// Its index among the polygons of the file, from 0.
    pub number: u32,
    /// Index of its `g` name, or [`NONE`].
    pub group: u32,
    /// Index of its `o` name, or [`NONE`].
    pub object: u32,
}

/// The contents of a mesh file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshSource {
    /// The file read.
    pub file: PathBuf,
    /// Positions by file vertex, in the file's frame.
    pub positions: Vec<DVec3>,
    /// Texture coordinates of the file.
    pub textures: Vec<DVec2>,
    /// Corners of all faces, face after face.
    pub corners: Vec<Corner>,
    /// The faces of three or more corners; those of the chosen group, if one was chosen.
    pub faces: Vec<Face>,
    /// Grouping and material lines as in an OBJ, each with the number of the face it stands before.
    pub statements: Vec<(u32, String)>,
    names: IndexSet<String>,
    /// Whether any face has a group.
    has_groups: bool,
    /// The unit and axis that the format prescribes.
    pub(super) declared: Option<Declared>,
    /// Number of vertices that were merged into another because the format stores one for each corner.
    pub(super) merged: usize,
    /// Contents that the mesh does not take from the file.
    pub(super) remarks: Vec<Remark>,
    /// Number of faces of fewer than three corners.
    pub(super) small_faces: usize,
}

impl MeshSource {
    /// An empty mesh of a file.
    pub(super) fn of(file: &Path) -> Self {
        Self { file: file.to_owned(), ..Self::default() }
    }

    /// A mesh in memory: positions in any unit and axes, and faces of `corners` vertices each, from 0.
    ///
    /// # Errors
    /// [`MeshError::Array`] names the first entry that is not a coordinate or an index.
    pub fn of_arrays(positions: Vec<DVec3>, faces: &[i64], corners: usize) -> Result<Self, MeshError> {
        let wrong = |problem| MeshError::Array { problem };
        for (v, position) in positions.iter().enumerate() {
            let bad = position.to_array().into_iter().position(|x| x.is_nan() || x.abs() > MAX_COORDINATE);
            if let Some(axis) = bad {
                let found = position[axis];
                let expected = format!("a finite number of at most {MAX_COORDINATE:e} either way");
                return Err(wrong(format!("vertices[{v}, {axis}]: found {found}, expected {expected}")));
            }
        }
        let index = |(k, &found): (usize, &i64)| {
            let vertex = usize::try_from(found).ok().filter(|&v| v < positions.len());
            vertex.map(|v| Corner { vertex: v as u32, texture: NONE }).ok_or_else(|| {
                let expected = match positions.len() {
                    0 => "no index, as the mesh has no vertices".to_owned(),
                    count => format!("0 to {}, the vertices of the mesh", count - 1),
                };
                wrong(format!("faces[{}, {}]: found {found}, expected {expected}", k / corners, k % corners))
            })
        };
        let corners_of_faces = faces.iter().enumerate().map(index).collect::<Result<Vec<_>, _>>()?;
        let count = corners as u32;
        let face = |number: u32| Face { first: number * count, count, number, group: NONE, object: NONE };
        let faces = (0..(faces.len() / corners) as u32).map(face).collect();
        Ok(Self { positions, corners: corners_of_faces, faces, ..Self::default() })
    }

    /// The triangles of a mesh, with texture coordinates of their corners.
    pub(super) fn of_mesh(mesh: &TriMesh, texture: Option<&[[DVec2; 3]]>) -> Self {
        let mut source = Self { positions: mesh.positions.clone(), ..Self::default() };
        source.textures = texture.map(<[_]>::as_flattened).unwrap_or_default().to_vec();
        let names: Vec<u32> = mesh.groups.iter().map(|name| source.name(name)).collect();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let group = mesh.triangle_group.get(t).map_or(NONE, |&group| names[group as usize]);
            let texture = |k: usize| if texture.is_some() { (3 * t + k) as u32 } else { NONE };
            let corners = (0..3).map(|k| Corner { vertex: triangle[k], texture: texture(k) });
            source.push_face(corners, group, NONE);
        }
        source
    }

    /// The same under another name.
    pub(super) fn named(&self, file: &Path) -> Self {
        Self { file: file.to_owned(), ..self.clone() }
    }

    /// The index of a group's or an object's name, [`NONE`] for an empty one. Blanks and control characters become one blank each, and
    /// marks that begin a comment of an OBJ or continue its line go, so that every name can be written to one.
    pub(super) fn name(&mut self, name: &str) -> u32 {
        let words = name.split(|c: char| c.is_whitespace() || c.is_control());
        let plain =
            words.map(|word| word.trim_start_matches('#').trim_end_matches('\\')).filter(|word| !word.is_empty());
        let name = plain.collect::<Vec<_>>().join(" ");
        if name.is_empty() { NONE } else { self.names.insert_full(name).0 as u32 }
    }

    /// Adds a face; one of fewer than three corners is counted only.
    pub(super) fn push_face(&mut self, corners: impl IntoIterator<Item = Corner>, group: u32, object: u32) {
        let first = self.corners.len();
        self.corners.extend(corners);
        if self.corners.len() < first + 3 {
            self.corners.truncate(first);
            self.small_faces += 1;
            return;
        }
        let count = (self.corners.len() - first) as u32;
        self.add_face(Face { first: first as u32, count, number: 0, group, object });
    }

    /// Adds a face and numbers it; its corners stand in [`corners`](Self::corners) or are added next.
    pub(super) fn add_face(&mut self, face: Face) {
        self.has_groups |= face.group != NONE;
        self.faces.push(Face { number: self.faces.len() as u32, ..face });
    }

    /// Adds a position, which must be a coordinate of a body or a garment.
    ///
    /// # Errors
    /// Names the number.
    pub(super) fn push_position(&mut self, position: DVec3) -> Result<(), String> {
        // Adding zero turns -0 into 0, so that equal positions have equal bits.
        self.positions.push(checked(position)? + 0.0);
        Ok(())
    }

    /// Adds a texture coordinate.
    ///
    /// # Errors
    /// Names the number.
    pub(super) fn push_texture(&mut self, texture: DVec2) -> Result<(), String> {
        self.textures.push(checked(texture.extend(0.0))?.truncate());
        Ok(())
    }

    /// Adds the statements `g` and `o` where the group and the object of the faces change, for a format that has no such lines.
    pub(super) fn state_groups(&mut self) {
        let (mut group, mut object) = (NONE, NONE);
        for (number, face) in self.faces.iter().enumerate() {
            for (keyword, current, now) in [("o", &mut object, face.object), ("g", &mut group, face.group)] {
                if std::mem::replace(current, now) != now {
                    let name = self.names.get_index(now as usize).map_or("", String::as_str);
                    self.statements.push((number as u32, format!("{keyword} {name}").trim_end().to_owned()));
                }
            }
        }
    }

    /// Merges the vertices from `first` on that have the same position, for a format that stores one for each normal or texture
    /// coordinate; `corner` is the first corner of their faces.
    pub(super) fn merge_equal(&mut self, first: usize, corner: usize) {
        let mut numbers: IndexSet<[u64; 3]> = IndexSet::with_capacity((self.positions.len() - first) / 2);
        let bits = |p: &DVec3| p.to_array().map(f64::to_bits);
        let number: Vec<usize> = self.positions[first..].iter().map(|p| numbers.insert_full(bits(p)).0).collect();
        for corner in &mut self.corners[corner..] {
            corner.vertex = (first + number[corner.vertex as usize - first]) as u32;
        }
        self.merged += number.len() - numbers.len();
        self.positions.truncate(first);
        self.positions.extend(numbers.iter().map(|bits| DVec3::from_array(bits.map(f64::from_bits))));
    }

    /// Keeps the faces of the group or object called `name`; returns the number of the others.
    pub(super) fn choose_group(&mut self, name: &str) -> Result<usize, MeshError> {
        let (all, faces) = (self.faces.len(), std::mem::take(&mut self.faces));
        let wanted = self.names.get_index_of(name).map(|i| i as u32);
        let is_chosen = |face: &&Face| wanted.is_some_and(|w| face.group == w || face.object == w);
        self.faces = faces.iter().filter(is_chosen).copied().collect();
        if self.faces.is_empty() {
            let used = each_once(faces.iter().flat_map(|face| [face.group, face.object]));
            let available = used.iter().filter_map(|&i| self.names.get_index(i as usize).cloned()).collect();
            return Err(MeshError::UnknownGroup { file: self.file.clone(), asked: name.to_owned(), available });
        }
        Ok(all - self.faces.len())
    }

    /// The corners of one face.
    #[must_use]
    pub fn corners_of(&self, face: &Face) -> &[Corner] {
        &self.corners[face.first as usize..(face.first + face.count) as usize]
    }

    /// Whether each vertex of the file is a corner of a face.
    pub(super) fn used_vertices(&self) -> Vec<bool> {
        let mut used = vec![false; self.positions.len()];
        let corners = self.faces.iter().flat_map(|face| self.corners_of(face));
        corners.for_each(|corner| used[corner.vertex as usize] = true);
        used
    }

    /// The positions of these vertices.
    pub(super) fn used_positions(&self) -> Vec<DVec3> {
        let (mut positions, used) = (self.positions.clone(), self.used_vertices());
        retain(&mut positions, |v| used[v]);
        positions
    }

    /// Names of the groups of some faces, in the order of the file, and the index of each face's group: its `g` where any face
    /// of the file has one, else its `o`. Both are empty where no face has a name.
    pub(super) fn groups(&self, faces: &[u32]) -> (Vec<String>, Vec<u32>) {
        let name =
            |&f: &u32| if self.has_groups { self.faces[f as usize].group } else { self.faces[f as usize].object };
        let used = each_once(faces.iter().map(name));
        if used == [NONE] {
            return (Vec::new(), Vec::new());
        }
        let text = |&i: &u32| self.names.get_index(i as usize).map_or(UNGROUPED, String::as_str).to_owned();
        let place = |f| used.partition_point(|&u| u < name(f)) as u32;
        (used.iter().map(text).collect(), faces.iter().map(place).collect())
    }
}

/// A position whose coordinates are finite and of a magnitude that bodies and garments have.
///
/// # Errors
/// Names the coordinate.
pub(super) fn checked(position: DVec3) -> Result<DVec3, String> {
    match position.to_array().into_iter().find(|x| x.is_nan() || x.abs() > MAX_COORDINATE) {
        None => Ok(position),
        Some(found) => Err(format!(
            "found the coordinate {found}, expected a finite number of at most {MAX_COORDINATE:e} either way; the export that wrote \
             it went wrong, make it again"
        )),
    }
}
