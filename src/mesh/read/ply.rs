//! PLY (Turk, 1994), text and both binary orders, parsed by `serde-ply`.
//!
//! Takes of `vertex` x, y, z and the texture coordinates under their usual names; of `face` the list `vertex_indices` (or
//! `vertex_index`), the texture coordinates of its corners (`texcoord`, as MeshLab writes them) and `group`; of `tristrips` the
//! strips of scanners, in which -1 begins a new strip. Other elements and properties are left out, and named in a remark.
//! The names of groups stand in comments, "group 0 front", as Partwise's own export has them.
//!
//! `serde-ply` trusts the numbers of elements, so they are compared with the length of the file first.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{ErrorKind, Read as _};
use std::path::Path;

use glam::{DVec2, DVec3};
use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_ply::{ElementDef, PlyFormat, PlyReader, PropertyType, ScalarType};

use crate::mesh::error::MeshError;
use crate::mesh::report::Remark;
use crate::mesh::source::{Corner, MeshSource};
use crate::mesh::topology::NONE;

/// The meaning of a property.
#[derive(Clone, Copy, PartialEq)]
enum Meaning {
    /// x, y, z of a vertex, and its two texture coordinates.
    Number(usize),
    /// Vertices of a face or of strips.
    Corners,
    /// Two texture coordinates for each corner of a face.
    Textures,
    /// Number of a face's group.
    Group,
    /// Of no use to a mesh, as normals.
    Passed,
    Unknown,
}

fn meaning(element: &str, property: &str, kind: &PropertyType) -> Meaning {
    let is_list = matches!(kind, PropertyType::List { .. });
    match (element, property, is_list) {
        ("vertex", "x", false) => Meaning::Number(0),
        ("vertex", "y", false) => Meaning::Number(1),
        ("vertex", "z", false) => Meaning::Number(2),
        ("vertex", "s" | "u" | "texture_u" | "texture_s", false) => Meaning::Number(3),
        ("vertex", "t" | "v" | "texture_v" | "texture_t", false) => Meaning::Number(4),
        ("face" | "tristrips", "vertex_indices" | "vertex_index", true) => Meaning::Corners,
        ("face", "texcoord", true) => Meaning::Textures,
        ("face", "group", false) => Meaning::Group,
        ("vertex" | "face", "nx" | "ny" | "nz" | "red" | "green" | "blue" | "alpha", _) => Meaning::Passed,
        _ => Meaning::Unknown,
    }
}

/// Reads a PLY.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<MeshSource, MeshError> {
    const END: &[u8] = b"end_header";
    let Some(end) = bytes.windows(END.len()).position(|window| window == END) else {
        return Err(MeshError::broken(
            file,
            "found no line \"end_header\", expected one after the header; the file is cut off",
        ));
    };
    // Comments may be in any encoding. A text need not end in a line end, which the parser asks for.
    let header = String::from_utf8_lossy(&bytes[..end]);
    let mut reader = PlyReader::from_reader(header.as_bytes().chain(&bytes[end..]).chain(&b"\n"[..])).map_err(|e| {
        MeshError::broken(file, format!("the header is invalid: {}; expected a PLY, export it again", e.0))
    })?;
    let mut source = MeshSource::of(file);
    let groups = reader.header().comments.iter().filter_map(|comment| {
        let (number, name) = comment.strip_prefix("group ")?.split_once(' ')?;
        Some((number.parse().ok()?, source.name(name)))
    });
    let mut rows = Rows { groups: groups.collect(), has_textures: false, source: &mut source, row: 0 };
    let mut unknown = Vec::new();
    while let Some(element) = reader.current_element().cloned() {
        let meanings = meanings(&element).map_err(|problem| MeshError::broken(file, problem))?;
        check_count(&element, reader.header().format, bytes.len() - end)
            .map_err(|problem| MeshError::broken(file, problem))?;
        let without = element.properties.iter().zip(&meanings).filter(|(_, m)| **m == Meaning::Unknown);
        unknown.extend(without.map(|(property, _)| format!("{}.{}", element.name, property.name)));
        rows.row = 0;
        let is_strip = element.name == "tristrips";
        if element.name == "vertex" {
            rows.has_textures = [3, 4].iter().all(|&k| meanings.contains(&Meaning::Number(k)));
        }
        let all = Element { rows: &mut rows, meanings: &meanings, numbers: [f64::NAN; 5], is_strip };
        (&mut &mut reader).next_value_seed(all).map_err(|e| {
            let reason = match e.0.kind() {
                ErrorKind::UnexpectedEof => "the file ends there, expected all rows; it is cut off".to_owned(),
                _ => format!("{}; expected the numbers that the header describes, so make the export again", e.0),
            };
            MeshError::broken(file, format!("{} {} of {}: {reason}", element.name, rows.row + 1, element.count))
        })?;
    }
    let has_textures = rows.has_textures;
    let count = source.positions.len();
    if let Some(face) = source.faces.iter().find(|f| source.corners_of(f).iter().any(|c| c.vertex as usize >= count)) {
        let found = source.corners_of(face).iter().map(|c| c.vertex).max().unwrap_or_default();
        let number = face.number + 1;
        return Err(MeshError::broken(
            file,
            format!("face {number}: found vertex {found}, expected one below {count}, their number"),
        ));
    }
    // A vertex with texture coordinates stands in the file once for each of them.
    if has_textures {
        source.merge_equal(0, 0);
    }
    if !unknown.is_empty() {
        source.remarks.push(Remark::Ignored { names: unknown });
    }
    source.state_groups();
    Ok(source)
}

/// The meaning of each property.
///
/// # Errors
/// Names the properties of an element that lacks its shape.
fn meanings(element: &ElementDef) -> Result<Vec<Meaning>, String> {
    let name = element.name.as_str();
    let meanings: Vec<Meaning> = element.properties.iter().map(|p| meaning(name, &p.name, &p.property_type)).collect();
    let (needed, expected): (&[Meaning], _) = match name {
        "vertex" => (&[Meaning::Number(0), Meaning::Number(1), Meaning::Number(2)], "x, y and z"),
        "face" | "tristrips" => (&[Meaning::Corners], "a list vertex_indices"),
        _ => (&[], ""),
    };
    if needed.iter().all(|m| meanings.contains(m)) {
        return Ok(meanings);
    }
    let found: Vec<&str> = element.properties.iter().map(|p| p.name.as_str()).collect();
    Err(format!("element {name}: found the properties {}, expected {expected}", found.join(", ")))
}

/// Refuses a number of rows that the `left` bytes of the file cannot hold.
fn check_count(element: &ElementDef, format: PlyFormat, left: usize) -> Result<(), String> {
    let size = |kind| match (format, kind) {
        // A digit and a blank.
        (PlyFormat::Ascii, _) => 2,
        (_, ScalarType::I8 | ScalarType::U8) => 1,
        (_, ScalarType::I16 | ScalarType::U16) => 2,
        (_, ScalarType::I32 | ScalarType::U32 | ScalarType::F32) => 4,
        (_, ScalarType::F64) => 8,
    };
    let of = |property: &serde_ply::PlyProperty| match property.property_type {
        PropertyType::Scalar(kind) | PropertyType::List { count_type: kind, .. } => size(kind),
    };
    let row: usize = element.properties.iter().map(of).sum();
    let most = left.checked_div(row).unwrap_or(0);
    if element.count <= most {
        return Ok(());
    }
    let (name, count) = (&element.name, element.count);
    Err(format!(
        "found {count} rows of {name} in the header, expected {most} at most in the rest of the file, which is cut off"
    ))
}

/// The mesh while its rows are read.
struct Rows<'a> {
    source: &'a mut MeshSource,
    /// Names of groups by number.
    groups: BTreeMap<i64, u32>,
    /// Whether vertices have texture coordinates.
    has_textures: bool,
    /// Number of rows of the element that are read.
    row: usize,
}

impl Rows<'_> {
    fn push_vertex(&mut self, [x, y, z, s, t]: [f64; 5]) -> Result<(), String> {
        self.source.push_position(DVec3::new(x, y, z))?;
        if self.has_textures {
            self.source.push_texture(DVec2::new(s, t))?;
        }
        Ok(())
    }

    fn push_face(&mut self, vertices: &[i64], textures: &[f64], group: Option<i64>) -> Result<(), String> {
        let group = match group {
            None => NONE,
            Some(number) => match self.groups.get(&number) {
                Some(&name) => name,
                None => self.source.name(&format!("group {number}")),
            },
        };
        let own = textures.len() == 2 * vertices.len();
        let first = self.source.textures.len() as u32;
        if own && !self.has_textures {
            for pair in textures.chunks_exact(2) {
                self.source.push_texture(DVec2::new(pair[0], pair[1]))?;
            }
        }
        let mut corners = Vec::with_capacity(vertices.len());
        for (k, &found) in vertices.iter().enumerate() {
            let vertex = u32::try_from(found).map_err(|_| format!("found vertex {found}, expected one from 0 on"))?;
            let texture = match (self.has_textures, own) {
                (true, _) => vertex,
                (false, true) => first + k as u32,
                (false, false) => NONE,
            };
            corners.push(Corner { vertex, texture });
        }
        self.source.push_face(corners, group, NONE);
        Ok(())
    }

    /// The triangles of strips, every second one turned round.
    fn push_strips(&mut self, vertices: &[i64]) -> Result<(), String> {
        for strip in vertices.split(|&vertex| vertex == -1) {
            for (k, triangle) in strip.windows(3).enumerate() {
                let turned = usize::from(k % 2 == 1);
                self.push_face(&[triangle[turned], triangle[1 - turned], triangle[2]], &[], None)?;
            }
        }
        Ok(())
    }
}

/// All rows of one element, and one row of it.
struct Element<'a, 'b> {
    rows: &'a mut Rows<'b>,
    meanings: &'a [Meaning],
    is_strip: bool,
    numbers: [f64; 5],
}

struct Row<'a, 'b, 'c>(&'c mut Element<'a, 'b>);

impl<'de> DeserializeSeed<'de> for Element<'_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, rows: D) -> Result<(), D::Error> {
        rows.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Element<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("rows")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut rows: A) -> Result<(), A::Error> {
        while rows.next_element_seed(Row(&mut self))?.is_some() {
            self.rows.row += 1;
        }
        Ok(())
    }
}

impl<'de> DeserializeSeed<'de> for Row<'_, '_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, row: D) -> Result<(), D::Error> {
        row.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Row<'_, '_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the properties of an element")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut row: A) -> Result<(), A::Error> {
        let Element { rows, meanings, is_strip, numbers } = self.0;
        let (mut corners, mut textures, mut group) = (Vec::new(), Vec::new(), None);
        for meaning in *meanings {
            row.next_key::<IgnoredAny>()?;
            match meaning {
                Meaning::Number(k) => numbers[*k] = row.next_value()?,
                // A list grows with the file: serde reserves a megabyte at most for a length that is only stated.
                Meaning::Corners => corners = row.next_value::<Vec<i64>>()?,
                Meaning::Textures => textures = row.next_value::<Vec<f64>>()?,
                Meaning::Group => group = Some(row.next_value()?),
                Meaning::Passed | Meaning::Unknown => drop(row.next_value::<IgnoredAny>()?),
            }
        }
        let added = match () {
            () if meanings.contains(&Meaning::Number(0)) => rows.push_vertex(*numbers),
            () if *is_strip => rows.push_strips(&corners),
            () if meanings.contains(&Meaning::Corners) => rows.push_face(&corners, &textures, group),
            () => Ok(()),
        };
        added.map_err(A::Error::custom)
    }
}
