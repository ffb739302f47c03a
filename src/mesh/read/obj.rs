//! Wavefront OBJ, text.
//!
//! One pass over the lines checks every number and index, so the first mistake in the order of the file is the one
//! reported, and records grouping and material statements. `tobj` then parses a text of `v`, `vt` and `f` lines alone:
//! continued lines joined, comments, weights and colours cut off, indices counted from 1.
//!
//! `tobj` numbers vertices by their first use, so a polygon over all of them comes first and keeps the numbers of the
//! file. A corner without a texture coordinate gets one after the last of the file. Nothing that a file names is opened.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};

use crate::base::files::Unreadable;
use crate::mesh::error::MeshError;
use crate::mesh::report::Remark;
use crate::mesh::source::{Corner, Face, MAX_COORDINATE, MeshSource};
use crate::mesh::topology::NONE;

/// Some editors begin a text with it.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Reads an OBJ.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<MeshSource, MeshError> {
    // Comments and names may be in any encoding; numbers are ASCII in all of them.
    let text = String::from_utf8_lossy(bytes);
    // Line ends of Mac OS 9 and earlier.
    if text.contains('\r') && !text.contains('\n') {
        return parse_text(file, &text.replace('\r', "\n"));
    }
    parse_text(file, &text)
}

fn parse_text(file: &Path, text: &str) -> Result<MeshSource, MeshError> {
    let text = text.trim_start_matches(BYTE_ORDER_MARK);
    let mut source = MeshSource::of(file);
    let (mut unknown, mut first_unknown) = (0, None);
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
                source.add_face(Face { first, count, number: 0, group, object });
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
                *current = source.name(&name);
            }
            Some(_) => {
                unknown += 1;
                first_unknown.get_or_insert_with(|| (number, line.trim().chars().take(40).collect()));
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
    if let Some((line, text)) = first_unknown {
        source.remarks.push(Remark::UnknownLines { count: unknown, line, text });
    }
    Ok(source)
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
pub(super) fn excerpt(word: &str) -> String {
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
