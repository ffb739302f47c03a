//! OBJ files: polygons, groups and texture coordinates in the unit and axes of the file, from which an export is written.
//!
//! One pass over the lines checks every number and index, so the first mistake in the order of the file is the one
//! reported, and records grouping and material statements. `tobj` then parses a text of `v`, `vt` and `f` lines alone:
//! continued lines joined, comments, weights and colours cut off, indices counted from 1.
//!
//! `tobj` numbers vertices by their first use, so a polygon over all of them comes first and keeps the numbers of the
//! file. A corner without a texture coordinate gets one after the last of the file. Nothing that a file names is opened.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};
use indexmap::IndexSet;

use super::error::MeshError;
use super::topology::NONE;
use super::{each_once, retain};
use crate::base::files::{MAX_MESH, Unreadable, bounded};

/// Name of the triangles without a group in a file that has groups.
const UNGROUPED: &str = "(none)";
/// Some editors begin a text with it.
const BYTE_ORDER_MARK: char = '\u{feff}';
/// Largest magnitude of a coordinate: 10 km in millimetres, larger than any body in any unit. The squares of much larger
/// ones overflow.
const MAX_COORDINATE: f64 = 1e7;

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

/// The contents of an OBJ file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ObjSource {
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
    /// Grouping and material lines, each with the number of the face it stands before.
    pub statements: Vec<(u32, String)>,
    names: IndexSet<String>,
    /// Whether any face has a `g` name.
    has_groups: bool,
    /// Number of lines with an unknown keyword, and the first of them with its line number.
    pub(super) unknown: usize,
    pub(super) first_unknown: Option<(usize, String)>,
    /// Number of faces of fewer than three corners.
    pub(super) small_faces: usize,
}

impl ObjSource {
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

    /// The same under another name.
    pub(super) fn named(&self, file: &Path) -> Self {
        Self { file: file.to_owned(), ..self.clone() }
    }

    /// Reads a file.
    pub(crate) fn read(file: &Path) -> Result<Self, MeshError> {
        let bytes = bounded(file, MAX_MESH).map_err(|e| Unreadable::new(file, &e))?;
        if let Some(found) = other_format(file, &bytes) {
            return Err(MeshError::NotObj { file: file.to_owned(), found });
        }
        // Comments and names may be in any encoding; numbers are ASCII in all of them.
        let text = String::from_utf8_lossy(&bytes);
        // Line ends of Mac OS 9 and earlier.
        if text.contains('\r') && !text.contains('\n') {
            return Self::parse(file, &text.replace('\r', "\n"));
        }
        Self::parse(file, &text)
    }

    fn parse(file: &Path, text: &str) -> Result<Self, MeshError> {
        let text = text.trim_start_matches(BYTE_ORDER_MARK);
        let mut source = Self { file: file.to_owned(), ..Self::default() };
        let count = |keyword| logical_lines(text).filter(|(_, line)| words(line).next() == Some(keyword)).count();
        let total = [count("v"), count("vt")];
        // The polygon over all vertices and texture coordinates, the one of no corner included.
        let all = if total[0] == 0 { 0 } else { total[0].max(total[1] + 1) };
        let mut prepared = String::with_capacity(text.len());
        prepared.push('f');
        for i in 1..=all {
            // Writing into a String cannot fail.
            let _ = write!(prepared, " {}/{}", i.min(total[0]), i.min(total[1] + 1));
        }
        prepared.push('\n');
        let (mut group, mut object, mut first, mut above) = (NONE, NONE, 0, [0; 2]);
        for (number, line) in logical_lines(text) {
            let mistake = |problem| MeshError::Line { file: file.to_owned(), line: number, problem };
            let mut words = words(&line);
            match words.next() {
                None | Some("vn" | "vp" | "l" | "p") => {}
                Some("v") => {
                    above[0] += 1;
                    coordinates(words.clone().take(3), 3, "vertex (v x y z)").map_err(mistake)?;
                    push_line(&mut prepared, "v", words.take(3));
                }
                Some("vt") => {
                    above[1] += 1;
                    coordinates(words.clone().take(2), 1, "texture coordinate (vt u v)").map_err(mistake)?;
                    // The second coordinate is optional; tobj takes the first two numbers.
                    push_line(&mut prepared, "vt", words.take(2).chain(["0"]));
                }
                Some("f" | "fo") => {
                    let (start, mut count) = (prepared.len(), 0);
                    prepared.push('f');
                    for word in words {
                        let [vertex, texture] = corner(word, above, total).map_err(mistake)?;
                        let _ = write!(prepared, " {vertex}/{texture}");
                        count += 1;
                    }
                    prepared.push('\n');
                    if count < 3 {
                        source.small_faces += 1;
                        prepared.truncate(start);
                        continue;
                    }
                    source.faces.push(Face { first, count, number: source.faces.len() as u32, group, object });
                    source.has_groups |= group != NONE;
                    first += count;
                }
                Some(keyword @ ("g" | "o" | "usemtl" | "mtllib" | "s")) => {
                    let name = words.collect::<Vec<_>>().join(" ");
                    let statement = if name.is_empty() { keyword.to_owned() } else { format!("{keyword} {name}") };
                    source.statements.push((source.faces.len() as u32, statement));
                    let current = match keyword {
                        "g" => &mut group,
                        "o" => &mut object,
                        _ => continue,
                    };
                    *current = if name.is_empty() { NONE } else { source.names.insert_full(name).0 as u32 };
                }
                Some(_) => {
                    source.unknown += 1;
                    source.first_unknown.get_or_insert_with(|| (number, line.trim().chars().take(40).collect()));
                }
            }
        }
        push_line(&mut prepared, "vt", ["0", "0"]);
        let options = tobj::LoadOptions::default();
        let (models, _) = tobj::load_obj_buf(&mut prepared.as_bytes(), &options, |_| Ok(Default::default()))
            .map_err(|e| Unreadable { path: file.to_owned(), reason: e.to_string() })?;
        // No statement begins a second model.
        let mesh = models.into_iter().next().map(|model| model.mesh).unwrap_or_default();
        source.positions = mesh.positions.as_chunks().0.iter().copied().map(DVec3::from_array).collect();
        source.textures = mesh.texcoords.as_chunks().0.iter().copied().map(DVec2::from_array).collect();
        source.textures.truncate(total[1]);
        let indices = mesh.indices.iter().zip(&mesh.texcoord_indices).skip(all);
        let known = |texture: u32| if (texture as usize) < total[1] { texture } else { NONE };
        source.corners = indices.map(|(&vertex, &texture)| Corner { vertex, texture: known(texture) }).collect();
        Ok(source)
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

fn push_line<'a>(text: &mut String, keyword: &str, words: impl IntoIterator<Item = &'a str>) {
    text.push_str(keyword);
    text.extend(words.into_iter().flat_map(|word| [" ", word]));
    text.push('\n');
}

/// Checks the coordinates of a `statement`, of which `expected` must be given.
fn coordinates<'a>(words: impl Iterator<Item = &'a str>, expected: usize, statement: &str) -> Result<(), String> {
    const REMEDY: &str = "the export that wrote it went wrong, make it again";
    let mut found = 0;
    for word in words {
        match word.parse::<f64>() {
            Err(_) => return Err(format!("found \"{}\", expected a number for a {statement}", excerpt(word))),
            Ok(x) if !x.is_finite() => {
                return Err(format!("found the coordinate {}, expected a finite number; {REMEDY}", excerpt(word)));
            }
            Ok(x) if x.abs() > MAX_COORDINATE => {
                return Err(format!(
                    "found the coordinate {}, expected at most {MAX_COORDINATE:e} either way: no body or garment is that large \
                     in any unit; {REMEDY}",
                    excerpt(word)
                ));
            }
            Ok(_) => found += 1,
        }
    }
    if found < expected {
        return Err(format!("found {found} numbers, expected {expected} for a {statement}"));
    }
    Ok(())
}

/// Vertex and texture coordinate of a corner, from 1, of `total` in the file and `above` before the line; one past the
/// last for no texture coordinate.
fn corner(word: &str, above: [usize; 2], total: [usize; 2]) -> Result<[usize; 2], String> {
    let parts: Vec<&str> = word.split('/').collect();
    let well_formed = |(k, part): (usize, &&str)| k > 0 && part.is_empty() || part.parse::<i64>().is_ok();
    if parts.len() > 3 || !parts.iter().enumerate().all(well_formed) {
        let found = excerpt(word);
        return Err(format!("found the corner \"{found}\", expected v, v/vt, v//vn or v/vt/vn with whole numbers"));
    }
    let mut corner = [0, total[1] + 1];
    // A normal is not used, so it need not exist.
    for (k, plural) in ["vertices", "texture coordinates"].into_iter().enumerate() {
        let Some(found) = parts.get(k).and_then(|part| part.parse::<i64>().ok()) else { continue };
        let (above, total) = (above[k], total[k]);
        let index = if found < 0 { found.saturating_add(above as i64 + 1) } else { found };
        corner[k] = index.max(0) as usize;
        if !(1..=total).contains(&corner[k]) {
            let range = match (total, above) {
                (0, _) => format!("no index, as the file has no {plural}"),
                (_, 0) => format!("1 to {total}, the {plural} of the file"),
                _ => format!("1 to {total}, the {plural} of the file, or -1 to -{above} counted back from here"),
            };
            return Err(format!("found {found}, expected {range}"));
        }
    }
    Ok(corner)
}

/// A word of the file as a message quotes it: the beginning of a long one.
fn excerpt(word: &str) -> String {
    const SHOWN: usize = 40;
    match word.char_indices().nth(SHOWN) {
        None => word.to_owned(),
        Some((end, _)) => format!("{} ... ({} bytes)", &word[..end], word.len()),
    }
}

/// The words of a line without its comment, which begins a word: a `#` within a word belongs to a name.
fn words(line: &str) -> impl Iterator<Item = &str> + Clone {
    line.split_whitespace().take_while(|word| !word.starts_with('#'))
}

/// Lines with their numbers from 1, those that end in a backslash joined to the next.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let Some(mut head) = line.trim_end().strip_suffix('\\') else { return Some((number + 1, line.into())) };
        let mut joined = String::new();
        loop {
            joined.push_str(head);
            joined.push(' ');
            let Some((_, next)) = lines.next() else { break };
            let Some(more) = next.trim_end().strip_suffix('\\') else {
                joined.push_str(next);
                break;
            };
            head = more;
        }
        Some((number + 1, joined.into()))
    })
}

/// The format of a file that is not an OBJ, recognised by its first bytes; DXF also by the extension, as its text has no signature.
fn other_format(file: &Path, bytes: &[u8]) -> Option<&'static str> {
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(512)]).into_owned();
    let text = head.trim_start();
    let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let binary_stl = || {
        let count = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        count.is_some_and(|n| bytes.len() as u64 == 84 + 50 * u64::from(n))
    };
    let is_gltf = starts(b"glTF") || text.starts_with('{') && String::from_utf8_lossy(bytes).contains("\"asset\"");
    let is_dxf =
        starts(b"AutoCAD Binary DXF") || text.starts_with('0') && text.contains("SECTION") || extension == "dxf";
    let formats = [
        (is_gltf, "a glTF scene"),
        (text.starts_with("solid") && text.contains("facet") || binary_stl(), "an STL mesh"),
        (text.starts_with("ply\n") || text.starts_with("ply\r"), "a PLY mesh"),
        (starts(b"Kaydara FBX"), "an FBX scene"),
        (is_dxf, "a DXF drawing"),
        (starts(b"PK\x03\x04"), "a ZIP archive (3MF, or a packed OBJ)"),
        (starts(b"BLENDER"), "a Blender scene"),
        (text.starts_with("OFF") || text.starts_with("COFF"), "an OFF mesh"),
        (text.starts_with("<?xml") || text.starts_with("<COLLADA"), "an XML file (COLLADA?)"),
        (bytes.contains(&0), "binary data"),
    ];
    formats.into_iter().find(|(matches, _)| *matches).map(|(_, name)| name)
}
