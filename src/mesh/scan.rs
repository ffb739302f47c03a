//! The lines of an OBJ text, checked and set straight for the reader.
//!
//! The numbers and polygons are tobj's to read. What it does not keep, or passes over in silence, is seen to here: the line
//! of every mistake, NaN, indices out of range, negative ones, corners with and without texture coordinates in one
//! file, comments behind a face, continued lines, junk, groups that cut a surface apart (it numbers vertices anew in each),
//! and the statements an export has to give back. The text handed on holds `v`, `vt` and `f` alone, counted from 1.

use std::fmt::Write as _;
use std::path::Path;

use super::error::{Keyword, LineProblem, MeshError};
use super::topology::NONE;

/// Some editors begin a text with it.
const BYTE_ORDER_MARK: char = '\u{feff}';

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
    /// Its first corner.
    pub first: u32,
    /// How many corners.
    pub count: u32,
    /// Its place among the faces of the file, from 0.
    pub number: u32,
    /// Index of its `g` name, or [`NONE`].
    pub group: u32,
    /// Index of its `o` name, or [`NONE`].
    pub object: u32,
}

/// What the lines hold.
#[derive(Debug, Default)]
pub(super) struct Scan {
    pub(super) plain: String,
    pub(super) vertices: usize,
    pub(super) textures: usize,
    pub(super) corners: Vec<Corner>,
    pub(super) faces: Vec<Face>,
    pub(super) names: Vec<String>,
    /// Grouping and material lines, each with the number of the face it stands before.
    pub(super) statements: Vec<(u32, String)>,
    /// Lines of no known keyword: how many, and the first with its number.
    pub(super) unknown: usize,
    pub(super) first_unknown: Option<(usize, String)>,
    /// Points and lines given as faces.
    pub(super) small_faces: usize,
    has_groups: bool,
}

/// A corner as written, until the whole file is known.
struct Pending {
    line: usize,
    index: i64,
    so_far: usize,
    of: Keyword,
}

impl Scan {
    /// Reads the lines of `text`; `file` is for the messages.
    pub(super) fn new(file: &Path, text: &str) -> Result<Self, MeshError> {
        let mut scan = Self { plain: String::with_capacity(text.len()), ..Self::default() };
        let (mut group, mut object) = (NONE, NONE);
        // Indices may point ahead, so ranges are checked at the end; the first offence in the file is told.
        let mut ahead: Vec<Pending> = Vec::new();
        for (number, line) in logical_lines(text.trim_start_matches(BYTE_ORDER_MARK)) {
            let at = |problem| MeshError::Line { file: file.to_owned(), line: number, problem };
            // A comment begins a word; a `#` within one belongs to a name.
            let mut words = line.split_whitespace().take_while(|word| !word.starts_with('#'));
            match words.next() {
                None => {}
                Some("v") => scan.numbers(words, "v", 3, 3, Keyword::Vertex).map_err(at)?,
                Some("vt") => scan.numbers(words, "vt", 1, 2, Keyword::Texture).map_err(at)?,
                Some("f" | "fo") => scan.face(words, number, (group, object), &mut ahead).map_err(at)?,
                Some(keyword @ ("g" | "o" | "usemtl" | "mtllib" | "s")) => {
                    let name = words.collect::<Vec<_>>().join(" ");
                    let named = |scan: &mut Self| if name.is_empty() { NONE } else { scan.name(&name) };
                    match keyword {
                        "g" => {
                            group = named(&mut scan);
                            scan.has_groups = true;
                        }
                        "o" => object = named(&mut scan),
                        _ => {}
                    }
                    let statement = if name.is_empty() { keyword.to_owned() } else { format!("{keyword} {name}") };
                    scan.statements.push((scan.faces.len() as u32, statement));
                }
                Some("vn" | "vp" | "l" | "p") => {}
                Some(_) => {
                    scan.unknown += 1;
                    scan.first_unknown.get_or_insert_with(|| (number, line.trim().chars().take(40).collect()));
                }
            }
        }
        for Pending { line, index, so_far, of } in ahead {
            let there_are = if of == Keyword::Vertex { scan.vertices } else { scan.textures };
            if index < 1 || index > there_are as i64 {
                let problem = LineProblem::OutOfRange { found: index, there_are, so_far, of };
                return Err(MeshError::Line { file: file.to_owned(), line, problem });
            }
        }
        scan.write_faces();
        Ok(scan)
    }

    /// Index of the name that groups a face: its `g` where the file has any, else its `o`.
    pub(super) fn group_of(&self, face: &Face) -> u32 {
        if self.has_groups { face.group } else { face.object }
    }

    fn name(&mut self, name: &str) -> u32 {
        let found = self.names.iter().position(|known| known == name);
        found.unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.names.len() - 1
        }) as u32
    }

    /// A `v` or `vt` line: `least` to `most` numbers are passed on, the rest (weight, colour) is not needed.
    fn numbers<'a>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        keyword: &str,
        least: usize,
        most: usize,
        of: Keyword,
    ) -> Result<(), LineProblem> {
        self.plain.push_str(keyword);
        let mut count = 0;
        for word in words.take(most) {
            let number = word.parse::<f64>().map_err(|_| LineProblem::NotANumber { found: word.to_owned(), of })?;
            if !number.is_finite() {
                return Err(LineProblem::NotFinite { found: word.to_owned() });
            }
            self.plain.push(' ');
            self.plain.push_str(word);
            count += 1;
        }
        if count < least {
            return Err(LineProblem::TooFew { found: count, expected: least, of });
        }
        (count..most).for_each(|_| self.plain.push_str(" 0"));
        self.plain.push('\n');
        *(if of == Keyword::Vertex { &mut self.vertices } else { &mut self.textures }) += 1;
        Ok(())
    }

    fn face<'a>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        line: usize,
        (group, object): (u32, u32),
        ahead: &mut Vec<Pending>,
    ) -> Result<(), LineProblem> {
        let first = self.corners.len();
        for word in words {
            let bad = || LineProblem::BadCorner { found: word.to_owned() };
            let mut parts = word.split('/');
            let vertex = parts.next().unwrap_or_default().parse::<i64>().map_err(|_| bad())?;
            let vertex = self.resolve(vertex, line, Keyword::Vertex, ahead)?;
            let texture = match parts.next() {
                None | Some("") => NONE,
                Some(part) => {
                    let texture = part.parse::<i64>().map_err(|_| bad())?;
                    self.resolve(texture, line, Keyword::Texture, ahead)?
                }
            };
            // A normal is read to be sure that it is one; the drape makes its own.
            if let Some(normal) = parts.next()
                && !normal.is_empty()
            {
                normal.parse::<i64>().map_err(|_| bad())?;
            }
            if parts.next().is_some() {
                return Err(bad());
            }
            self.corners.push(Corner { vertex, texture });
        }
        let count = self.corners.len() - first;
        if count < 3 {
            self.small_faces += 1;
            self.corners.truncate(first);
        } else {
            let number = self.faces.len() as u32;
            self.faces.push(Face { first: first as u32, count: count as u32, number, group, object });
        }
        Ok(())
    }

    fn resolve(&self, index: i64, line: usize, of: Keyword, ahead: &mut Vec<Pending>) -> Result<u32, LineProblem> {
        let so_far = if of == Keyword::Vertex { self.vertices } else { self.textures };
        let found = if index < 0 { index.saturating_add(so_far as i64 + 1) } else { index };
        if index < 0 && found < 1 {
            return Err(LineProblem::OutOfRange { found: index, there_are: so_far, so_far, of });
        }
        if found < 1 || found > so_far as i64 {
            ahead.push(Pending { line, index: found, so_far, of });
        }
        Ok(u32::try_from(found - 1).unwrap_or(NONE))
    }

    fn write_faces(&mut self) {
        for face in &self.faces {
            self.plain.push('f');
            for corner in &self.corners[face.first as usize..(face.first + face.count) as usize] {
                // Writing into a String cannot fail.
                let _ = match corner.texture {
                    NONE => write!(self.plain, " {}", corner.vertex + 1),
                    texture => write!(self.plain, " {}/{}", corner.vertex + 1, texture + 1),
                };
            }
            self.plain.push('\n');
        }
    }
}

/// Lines with their numbers from 1, those that end in a backslash joined to the next.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let Some(mut head) = line.trim_end().strip_suffix('\\') else { return Some((number + 1, line.into())) };
        let mut joined = String::new();
        loop {
            joined.push_str(head);
            joined.push(' ');
            match lines.next() {
                Some((_, next)) => match next.trim_end().strip_suffix('\\') {
                    Some(more) => head = more,
                    None => {
                        joined.push_str(next);
                        break;
                    }
                },
                None => break,
            }
        }
        Some((number + 1, joined.into()))
    })
}
