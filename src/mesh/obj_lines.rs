//! The lines of an OBJ text: one pass prepares them for `tobj`, which parses all numbers.
//!
//! `tobj` gets the `v`, `vt` and `f` lines alone, continued lines joined, comments, weights and colours cut off. It numbers
//! vertices by their first use, so a polygon over all of them comes first and keeps the numbers of the file. The pass
//! records what `tobj` drops: grouping and material statements, and which corners have a texture coordinate. Nothing that
//! a file names is opened.
//!
//! `tobj` reports a mistake without its line, and accepts NaN. Only a text with a mistake is therefore read again, by
//! [`first_mistake`]; so is one with texture indices that `tobj` does not check.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::error::{Keyword, LineProblem, MeshError};
use super::topology::NONE;
use crate::base::files::Unreadable;

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

/// One polygon of the file.
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

impl Face {
    /// Its own among the corners of all faces.
    pub(crate) fn among<'a>(&self, corners: &'a [Corner]) -> &'a [Corner] {
        &corners[self.first as usize..(self.first + self.count) as usize]
    }
}

/// Marks the vertices, of `vertices` in the file, that are corners of `faces`.
pub(super) fn used(vertices: usize, faces: &[Face], corners: &[Corner]) -> Vec<bool> {
    let mut used = vec![false; vertices];
    faces.iter().flat_map(|face| face.among(corners)).for_each(|corner| used[corner.vertex as usize] = true);
    used
}

/// The contents of an OBJ file.
#[derive(Debug, Default)]
pub(super) struct ObjContents {
    /// In the file's frame.
    pub(super) positions: Vec<DVec3>,
    pub(super) textures: Vec<DVec2>,
    pub(super) corners: Vec<Corner>,
    pub(super) faces: Vec<Face>,
    pub(super) names: Vec<String>,
    /// Grouping and material lines, each with the number of the face it stands before.
    pub(super) statements: Vec<(u32, String)>,
    /// Number of lines with an unknown keyword, and the first of them with its line number.
    pub(super) unknown: usize,
    pub(super) first_unknown: Option<(usize, String)>,
    /// Number of faces of fewer than three corners.
    pub(super) small_faces: usize,
    /// Whether any face has a `g` name.
    has_groups: bool,
    number_of_name: BTreeMap<String, u32>,
}

/// The lines that `tobj` parses, and what it does not return.
#[derive(Debug, Default)]
struct Prepared {
    text: String,
    vertices: usize,
    textures: usize,
    /// Group and object of each face line.
    groups: Vec<(u32, u32)>,
    /// Whether each corner has a texture coordinate.
    textured: Vec<bool>,
    /// Whether a corner has a form that `tobj` accepts, or overflows on, where the index may not exist.
    unchecked: bool,
}

impl Prepared {
    fn line<'a>(&mut self, keyword: &str, words: impl Iterator<Item = &'a str>) {
        self.text.push_str(keyword);
        for word in words {
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
    }

    /// Adds a face and returns the number of its corners.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>, groups: (u32, u32)) -> usize {
        let first = self.textured.len();
        self.text.push('f');
        for corner in words {
            let texture = corner.split_once('/').map_or("", |(_, texture)| texture);
            let textured = !texture.is_empty() && !texture.starts_with('/');
            self.textured.push(textured);
            self.unchecked |= textured && !texture.starts_with(|c| matches!(c, '1'..='9'))
                || corner.bytes().filter(|&b| b == b'/').count() > 2;
            self.text.push(' ');
            self.text.push_str(corner);
        }
        self.text.push('\n');
        self.groups.push(groups);
        self.textured.len() - first
    }

    /// The vertices, texture coordinates and faces; the first face is the one over all vertices.
    fn parse(&self) -> Result<tobj::Mesh, tobj::LoadError> {
        let mut all = String::from("f");
        let count = if self.vertices == 0 { 0 } else { self.vertices.max(self.textures) };
        for i in 1..=count {
            // Writing into a String cannot fail.
            let _ = write!(all, " {}/{}", i.min(self.vertices), i.min(self.textures).max(1));
        }
        all.push('\n');
        let mut lines = std::io::Read::chain(all.as_bytes(), self.text.as_bytes());
        let no_materials = |_: &Path| Ok(Default::default());
        let (models, _) = tobj::load_obj_buf(&mut lines, &tobj::LoadOptions::default(), no_materials)?;
        // No statement begins a second model.
        Ok(models.into_iter().next().map(|model| model.mesh).unwrap_or_default())
    }
}

impl ObjContents {
    /// Reads the lines of `text`; `file` is for the messages.
    pub(super) fn new(file: &Path, text: &str) -> Result<Self, MeshError> {
        let text = text.trim_start_matches(BYTE_ORDER_MARK);
        let mut contents = Self::default();
        let mut prepared = Prepared { text: String::with_capacity(text.len()), ..Prepared::default() };
        let (mut group, mut object, mut face_count) = (NONE, NONE, 0);
        for (number, line) in logical_lines(text) {
            let mut words = words(&line);
            match words.next() {
                None | Some("vn" | "vp" | "l" | "p") => {}
                Some("v") => {
                    prepared.vertices += 1;
                    prepared.line("v", words.take(3));
                }
                Some("vt") => {
                    prepared.textures += 1;
                    // The second coordinate is optional; tobj takes the first two numbers.
                    prepared.line("vt", words.chain(["0"]));
                }
                Some("f" | "fo") => face_count += u32::from(prepared.face(words, (group, object)) > 2),
                Some(keyword @ ("g" | "o" | "usemtl" | "mtllib" | "s")) => {
                    let name = words.collect::<Vec<_>>().join(" ");
                    match keyword {
                        "g" => group = contents.name(&name),
                        "o" => object = contents.name(&name),
                        _ => {}
                    }
                    let statement = if name.is_empty() { keyword.to_owned() } else { format!("{keyword} {name}") };
                    contents.statements.push((face_count, statement));
                }
                Some(_) => {
                    contents.unknown += 1;
                    contents.first_unknown.get_or_insert_with(|| (number, line.trim().chars().take(40).collect()));
                }
            }
        }
        let mistake =
            || first_mistake(text).map(|(line, problem)| MeshError::Line { file: file.to_owned(), line, problem });
        let no_textures = prepared.textures == 0 && prepared.textured.contains(&true);
        if (prepared.unchecked || no_textures)
            && let Some(mistake) = mistake()
        {
            return Err(mistake);
        }
        let unreadable = |e: tobj::LoadError| Unreadable { path: file.to_owned(), reason: e.to_string() }.into();
        let mesh = prepared.parse().map_err(|e| mistake().unwrap_or_else(|| unreadable(e)))?;
        if !mesh.positions.iter().chain(&mesh.texcoords).all(|x| x.abs() <= MAX_COORDINATE)
            && let Some(mistake) = mistake()
        {
            return Err(mistake);
        }
        contents.take(&mesh, &prepared);
        Ok(contents)
    }

    /// Takes over what `tobj` has parsed.
    fn take(&mut self, mesh: &tobj::Mesh, prepared: &Prepared) {
        self.positions = mesh.positions.as_chunks().0.iter().copied().map(DVec3::from_array).collect();
        self.textures = mesh.texcoords.as_chunks().0.iter().copied().map(DVec2::from_array).collect();
        // The list is empty where all faces are triangles.
        let arity = |face: usize| mesh.face_arities.get(face).map_or(3, |&n| n as usize);
        let all = arity(0);
        let mut end = all;
        for (i, &(group, object)) in prepared.groups.iter().enumerate() {
            let first = end;
            end += arity(i + 1);
            if end - first < 3 {
                self.small_faces += 1;
                continue;
            }
            let (number, count) = (self.faces.len() as u32, (end - first) as u32);
            self.faces.push(Face { first: self.corners.len() as u32, count, number, group, object });
            self.has_groups |= group != NONE;
            self.corners.extend((first..end).map(|k| Corner {
                vertex: mesh.indices[k],
                texture: if prepared.textured[k - all] { mesh.texcoord_indices[k] } else { NONE },
            }));
        }
    }

    /// Index of the name that groups a face: its `g` where any face of the file has one, else its `o`.
    pub(super) fn group_of(&self, face: &Face) -> u32 {
        if self.has_groups { face.group } else { face.object }
    }

    /// Index of the name of a group or an object, if the file has it.
    pub(super) fn number_of(&self, name: &str) -> Option<u32> {
        self.number_of_name.get(name).copied()
    }

    /// Index of `name`, which is added if it is new; [`NONE`] for no name.
    fn name(&mut self, name: &str) -> u32 {
        if name.is_empty() {
            return NONE;
        }
        if let Some(number) = self.number_of(name) {
            return number;
        }
        let number = self.names.len() as u32;
        self.names.push(name.to_owned());
        self.number_of_name.insert(name.to_owned(), number);
        number
    }
}

/// The first mistake of a text, with its line; `None` where every number and every index is usable.
fn first_mistake(text: &str) -> Option<(usize, LineProblem)> {
    let count = |keyword| logical_lines(text).filter(|(_, line)| words(line).next() == Some(keyword)).count();
    let there_are = [count("v"), count("vt")];
    let mut so_far = [0, 0];
    logical_lines(text).find_map(|(number, line)| {
        let mut words = words(&line);
        let problem = match words.next()? {
            "v" => {
                so_far[0] += 1;
                bad_number(words.take(3), 3, Keyword::Vertex)
            }
            "vt" => {
                so_far[1] += 1;
                bad_number(words.take(2), 1, Keyword::Texture)
            }
            "f" | "fo" => words.find_map(|word| bad_corner(word, so_far, there_are)),
            _ => None,
        };
        Some((number, problem?))
    })
}

/// What is wrong with some coordinates, of which `expected` must be given.
fn bad_number<'a>(words: impl Iterator<Item = &'a str>, expected: usize, of: Keyword) -> Option<LineProblem> {
    let mut count = 0;
    for word in words {
        match word.parse::<f64>() {
            Err(_) => return Some(LineProblem::NotANumber { found: excerpt(word), of }),
            Ok(x) if !x.is_finite() => return Some(LineProblem::NotFinite { found: excerpt(word) }),
            Ok(x) if x.abs() > MAX_COORDINATE => {
                return Some(LineProblem::TooLarge { found: excerpt(word), limit: MAX_COORDINATE });
            }
            Ok(_) => count += 1,
        }
    }
    (count < expected).then_some(LineProblem::TooFew { found: count, expected, of })
}

/// What is wrong with a corner; `so_far` and `there_are` count vertices and texture coordinates above it and in all.
fn bad_corner(word: &str, so_far: [usize; 2], there_are: [usize; 2]) -> Option<LineProblem> {
    let parts: Vec<&str> = word.split('/').collect();
    let well_formed = |(k, part): (usize, &&str)| k > 0 && part.is_empty() || part.parse::<i64>().is_ok();
    if parts.len() > 3 || !parts.iter().enumerate().all(well_formed) {
        return Some(LineProblem::BadCorner { found: excerpt(word) });
    }
    // A normal is not used, so it need not exist.
    for (k, of) in [Keyword::Vertex, Keyword::Texture].into_iter().enumerate() {
        let Some(found) = parts.get(k).and_then(|part| part.parse::<i64>().ok()) else { continue };
        let (so_far, there_are) = (so_far[k], there_are[k]);
        let index = if found < 0 { found.saturating_add(so_far as i64 + 1) } else { found };
        if index < 1 || index > there_are as i64 {
            return Some(LineProblem::OutOfRange { found, there_are, so_far, of });
        }
    }
    None
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
fn words(line: &str) -> impl Iterator<Item = &str> {
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
