//! An OBJ text read in one pass, every mistake with its line.
//!
//! Other readers pass over in silence what matters here: the line of a mistake, NaN, indices out of range, junk; or lose
//! what an export has to give back: polygons, groups over one set of vertices, materials, texture coordinates of their own
//! number. Understood besides: negative indices, indices that point ahead, comments behind a face, continued lines.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::error::{Keyword, LineProblem, MeshError};
use super::topology::NONE;

/// Some editors begin a text with it.
const BYTE_ORDER_MARK: char = '\u{feff}';
/// Coordinates beyond are no body's and no garment's in any unit (10 km in millimetres), and squares of much larger ones
/// overflow.
const LARGEST: f64 = 1e7;

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

impl Face {
    /// Its own among the corners of all faces.
    #[must_use]
    pub(crate) fn among<'a>(&self, corners: &'a [Corner]) -> &'a [Corner] {
        &corners[self.first as usize..(self.first + self.count) as usize]
    }
}

/// Which of so many vertices of a file some faces have.
pub(super) fn used(vertices: usize, faces: &[Face], corners: &[Corner]) -> Vec<bool> {
    let mut used = vec![false; vertices];
    faces.iter().flat_map(|face| face.among(corners)).for_each(|corner| used[corner.vertex as usize] = true);
    used
}

/// What the lines hold.
#[derive(Debug, Default)]
pub(super) struct Scan {
    /// In the file's frame.
    pub(super) positions: Vec<DVec3>,
    pub(super) textures: Vec<DVec2>,
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
    /// Whether any face is in a `g` with a name.
    has_groups: bool,
    number_of_name: BTreeMap<String, u32>,
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
        let mut scan = Self::default();
        let (mut group, mut object) = (NONE, NONE);
        // Indices may point ahead, so ranges are checked at the end; the first offence in the file is told.
        let mut ahead: Vec<Pending> = Vec::new();
        for (number, line) in logical_lines(text.trim_start_matches(BYTE_ORDER_MARK)) {
            let at = |problem| MeshError::Line { file: file.to_owned(), line: number, problem };
            // A comment begins a word; a `#` within one belongs to a name.
            let mut words = line.split_whitespace().take_while(|word| !word.starts_with('#'));
            match words.next() {
                None => {}
                Some("v") => {
                    let place = numbers(words, 3, Keyword::Vertex).map_err(at)?;
                    scan.positions.push(DVec3::from_array(place));
                }
                Some("vt") => {
                    let place = numbers(words, 1, Keyword::Texture).map_err(at)?;
                    scan.textures.push(DVec2::from_array(place));
                }
                Some("f" | "fo") => scan.face(words, number, (group, object), &mut ahead).map_err(at)?,
                Some(keyword @ ("g" | "o" | "usemtl" | "mtllib" | "s")) => {
                    let name = words.collect::<Vec<_>>().join(" ");
                    let named = |scan: &mut Self| if name.is_empty() { NONE } else { scan.name(&name) };
                    match keyword {
                        "g" => group = named(&mut scan),
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
            let there_are = scan.count(of);
            if index < 1 || index > there_are as i64 {
                let problem = LineProblem::OutOfRange { found: index, there_are, so_far, of };
                return Err(MeshError::Line { file: file.to_owned(), line, problem });
            }
        }
        Ok(scan)
    }

    /// Index of the name that groups a face: its `g` where any face of the file has one, else its `o`.
    pub(super) fn group_of(&self, face: &Face) -> u32 {
        if self.has_groups { face.group } else { face.object }
    }

    /// Number of a group's or object's name, if there is one.
    pub(super) fn number_of(&self, name: &str) -> Option<u32> {
        self.number_of_name.get(name).copied()
    }

    fn count(&self, of: Keyword) -> usize {
        if of == Keyword::Vertex { self.positions.len() } else { self.textures.len() }
    }

    fn name(&mut self, name: &str) -> u32 {
        if let Some(&number) = self.number_of_name.get(name) {
            return number;
        }
        let number = self.names.len() as u32;
        self.names.push(name.to_owned());
        self.number_of_name.insert(name.to_owned(), number);
        number
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
            let bad = || LineProblem::BadCorner { found: excerpt(word) };
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
            self.has_groups |= group != NONE;
            self.faces.push(Face { first: first as u32, count: count as u32, number, group, object });
        }
        Ok(())
    }

    fn resolve(&self, index: i64, line: usize, of: Keyword, ahead: &mut Vec<Pending>) -> Result<u32, LineProblem> {
        let so_far = self.count(of);
        let found = if index < 0 { index.saturating_add(so_far as i64 + 1) } else { index };
        if index < 0 && found < 1 {
            return Err(LineProblem::OutOfRange { found: index, there_are: so_far, so_far, of });
        }
        if found < 1 || found > so_far as i64 {
            ahead.push(Pending { line, index: found, so_far, of });
        }
        Ok(u32::try_from(found - 1).unwrap_or(NONE))
    }
}

/// The numbers of a `v` or `vt` line, at least so many and 0 for those that are not given; what comes behind (weight,
/// colour) is not needed.
fn numbers<'a, const N: usize>(
    words: impl Iterator<Item = &'a str>,
    least: usize,
    of: Keyword,
) -> Result<[f64; N], LineProblem> {
    let mut numbers = [0.0; N];
    let mut count = 0;
    for (slot, word) in numbers.iter_mut().zip(words) {
        let number = word.parse::<f64>().map_err(|_| LineProblem::NotANumber { found: excerpt(word), of })?;
        if !number.is_finite() {
            return Err(LineProblem::NotFinite { found: excerpt(word) });
        }
        if number.abs() > LARGEST {
            return Err(LineProblem::TooLarge { found: excerpt(word), limit: LARGEST });
        }
        *slot = number;
        count += 1;
    }
    if count < least {
        return Err(LineProblem::TooFew { found: count, expected: least, of });
    }
    Ok(numbers)
}

/// A word of the file as a message quotes it: the beginning of a long one.
fn excerpt(word: &str) -> String {
    const SHOWN: usize = 40;
    match word.char_indices().nth(SHOWN) {
        None => word.to_owned(),
        Some((end, _)) => format!("{} ... ({} bytes)", &word[..end], word.len()),
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
