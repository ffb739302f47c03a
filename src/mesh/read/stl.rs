//! STL (3D Systems, 1989), text and binary: loose triangles.
//!
//! Corners at exactly the same position become one vertex. A text may hold several solids, whose names are object names. The
//! normals are not used: most programs ignore them, too.

use std::path::Path;

use glam::DVec3;

use super::obj::excerpt;
use crate::mesh::error::MeshError;
use crate::mesh::source::{Corner, MeshSource};
use crate::mesh::topology::NONE;

/// Bytes before the triangles of a binary file, and of a triangle: normal and corners in single precision, two unused bytes.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Whether the length of a file is the one that a binary STL's header states. Many binary files begin with "solid", too.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let stated = bytes.get(HEADER - 4..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    stated.is_some_and(|count| bytes.len() as u64 == HEADER as u64 + TRIANGLE as u64 * u64::from(count))
}

/// Reads an STL.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<MeshSource, MeshError> {
    let mut source = MeshSource::of(file);
    if is_binary(bytes) {
        for (number, triangle) in bytes[HEADER..].chunks_exact(TRIANGLE).enumerate() {
            let number_at = |at: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|k| triangle[at + k])));
            for corner in [12, 24, 36] {
                let position = DVec3::new(number_at(corner), number_at(corner + 4), number_at(corner + 8));
                let wrong = |problem| MeshError::broken(file, format!("triangle {}: {problem}", number + 1));
                source.push_position(position).map_err(wrong)?;
            }
            push_last(&mut source, 3, NONE);
        }
    } else {
        text(&mut source, &String::from_utf8_lossy(bytes))?;
    }
    source.merge_equal(0, 0);
    source.state_groups();
    Ok(source)
}

/// Adds a face of the last positions.
fn push_last(source: &mut MeshSource, count: u32, object: u32) {
    let end = source.positions.len() as u32;
    source.push_face((end - count..end).map(|vertex| Corner { vertex, texture: NONE }), NONE, object);
}

fn text(source: &mut MeshSource, text: &str) -> Result<(), MeshError> {
    let (mut object, mut count) = (NONE, 0);
    for (number, line) in text.lines().enumerate() {
        let wrong = |problem| MeshError::Line { file: source.file.clone(), line: number + 1, problem };
        let mut words = line.split_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("solid") => object = source.name(&words.collect::<Vec<_>>().join(" ")),
            Some("vertex") => {
                let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
                let position = match numbers.as_deref() {
                    Some(&[x, y, z]) => DVec3::new(x, y, z),
                    _ => return Err(wrong(format!("found \"{}\", expected vertex and three numbers", excerpt(line)))),
                };
                let file = source.file.clone();
                source.push_position(position).map_err(|problem| MeshError::Line {
                    file,
                    line: number + 1,
                    problem,
                })?;
                count += 1;
            }
            Some("endloop") => push_last(source, std::mem::take(&mut count), object),
            None | Some("facet" | "outer" | "endfacet" | "endsolid") => {}
            Some(_) => {
                let expected = "solid, facet, outer, vertex, endloop, endfacet or endsolid";
                return Err(wrong(format!("found \"{}\", expected a line of an STL: {expected}", excerpt(line))));
            }
        }
    }
    if count > 0 {
        let problem = "found the end of the file within a facet, expected endloop; the file is cut off".to_owned();
        return Err(MeshError::Line { file: source.file.clone(), line: text.lines().count(), problem });
    }
    Ok(())
}
