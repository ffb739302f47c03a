//! Arrays of NumPy in one archive (`numpy.savez`, `numpy.savez_compressed`): vertices and faces, as SMPL's users save them.
//!
//! | array | names | shape |
//! |---|---|---|
//! | vertices | `v`, `vertices`, `verts`, `v_posed`, `v_template` | (n, 3) or (1, n, 3), floats |
//! | faces | `f`, `faces`, `triangles` | (m, corners), integers from 0 |
//!
//! The first name that is there counts; the model file of SMPL has its template and its faces. Archives of poses (`poses`, `betas`)
//! have no vertices, and are refused. Pickled objects are never read.

use std::io::{Cursor, Read};
use std::path::Path;

use glam::DVec3;
use zip::ZipArchive;

use super::obj::excerpt;
use crate::base::files::listed;
use crate::mesh::error::MeshError;
use crate::mesh::source::{Corner, MeshSource};
use crate::mesh::topology::NONE;

const VERTICES: [&str; 5] = ["v", "vertices", "verts", "v_posed", "v_template"];
const FACES: [&str; 3] = ["f", "faces", "triangles"];
/// Arrays of SMPL's family that describe a pose of a body and not its surface.
const POSES: [&str; 5] = ["poses", "pose", "betas", "body_pose", "trans"];

/// Most numbers of an array, five million vertices, and most bytes of its header. A compressed file may hold a thousand times its
/// length.
const MAX_NUMBERS: usize = 16 << 20;
const MAX_HEADER: usize = 1 << 16;

/// Most corners of a face.
const MAX_CORNERS: usize = 64;

type Archive<'a> = ZipArchive<Cursor<&'a [u8]>>;

/// Whether an archive holds arrays.
pub(super) fn has_arrays(bytes: &[u8]) -> bool {
    Archive::new(Cursor::new(bytes)).is_ok_and(|archive| archive.file_names().any(|name| name.ends_with(".npy")))
}

/// Reads an `.npz`.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<MeshSource, MeshError> {
    read(file, bytes).map_err(|problem| MeshError::broken(file, problem))
}

fn read(file: &Path, bytes: &[u8]) -> Result<MeshSource, String> {
    let mut archive =
        Archive::new(Cursor::new(bytes)).map_err(|e| format!("the archive is invalid: {e}; expected it whole"))?;
    let mut names: Vec<String> =
        archive.file_names().filter_map(|n| n.strip_suffix(".npy")).map(str::to_owned).collect();
    names.sort();
    let named = |known: &[&'static str]| known.iter().copied().find(|known| names.iter().any(|name| name == known));
    let (Some(vertices), Some(faces)) = (named(&VERTICES), named(&FACES)) else {
        let remedy = match (named(&VERTICES), named(&POSES)) {
            (None, Some(_)) => {
                "these are poses of a body model, which have no surface: pose the model, and save its vertices and faces"
            }
            (Some(_), _) => "vertices alone have no surface: save the model's faces with them (of SMPL its f)",
            (None, None) => "save a mesh",
        };
        return Err(format!(
            "found the arrays {}, expected vertices (one of {}) and faces (one of {}); {remedy}, as by numpy.savez(\"body.npz\", \
             v=vertices, f=faces)",
            listed(&names),
            VERTICES.join(", "),
            FACES.join(", ")
        ));
    };
    let mut source = MeshSource::of(file);
    let at = |name: &'static str| move |problem| format!("array {name}: {problem}");
    let Array { shape, numbers } = Array::read(&mut archive, vertices).map_err(at(vertices))?;
    let ([_, 3] | [1, _, 3]) = shape[..] else {
        return Err(format!(
            "array {vertices}: found the shape {shape:?}, expected (n, 3); save one mesh, not a sequence"
        ));
    };
    for (row, &position) in numbers.as_chunks::<3>().0.iter().enumerate() {
        source.push_position(DVec3::from_array(position)).map_err(|e| format!("array {vertices}, row {row}: {e}"))?;
    }
    let Array { shape, numbers } = Array::read(&mut archive, faces).map_err(at(faces))?;
    let [_, corners @ 3..=MAX_CORNERS] = shape[..] else {
        return Err(format!(
            "array {faces}: found the shape {shape:?}, expected (m, 3), or another number of corners up to {MAX_CORNERS}"
        ));
    };
    let count = source.positions.len();
    for (row, face) in numbers.chunks_exact(corners).enumerate() {
        if let Some(found) = face.iter().find(|&&v| !(v >= 0.0 && v < count as f64 && v.fract() == 0.0)) {
            return Err(format!(
                "array {faces}, row {row}: found vertex {found}, expected a whole number from 0 to below {count}"
            ));
        }
        source.push_face(face.iter().map(|&v| Corner { vertex: v as u32, texture: NONE }), NONE, NONE);
    }
    Ok(source)
}

/// An array of numbers, in the order of rows.
struct Array {
    shape: Vec<usize>,
    numbers: Vec<f64>,
}

impl Array {
    /// Reads `NAME.npy` of an archive (NumPy's format, versions 1 to 3).
    fn read(archive: &mut Archive<'_>, name: &str) -> Result<Self, String> {
        let mut entry =
            archive.by_name(&format!("{name}.npy")).map_err(|e| format!("{e}; expected it in the archive"))?;
        let mut bytes = |count: usize| {
            let mut bytes = Vec::new();
            match (&mut entry).take(count as u64).read_to_end(&mut bytes) {
                Ok(found) if found == count => Ok(bytes),
                Ok(found) => Err(format!("found {found} bytes, expected {count}; the file is cut off")),
                Err(e) => Err(format!("cannot be unpacked: {e}; expected it whole")),
            }
        };
        let start = bytes(8)?;
        let length = match &start[..] {
            [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _] => bytes(2)?,
            [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _] => bytes(4)?,
            _ => return Err("found no array of NumPy's format 1 to 3, expected one".to_owned()),
        };
        let length = length.iter().rev().fold(0, |sum, &byte| sum << 8 | usize::from(byte));
        if length > MAX_HEADER {
            return Err(format!("found a header of {length} bytes, expected {MAX_HEADER} at most"));
        }
        let header = String::from_utf8_lossy(&bytes(length)?).into_owned();
        let header = Header::parse(&header)?;
        let (size, shape) = (header.size, header.shape.clone());
        let count = shape.iter().try_fold(1_usize, |all, &n| all.checked_mul(n));
        let expected = || format!("found the shape {shape:?}, expected {MAX_NUMBERS} numbers at most");
        let bytes = bytes(size * count.filter(|&count| count <= MAX_NUMBERS).ok_or_else(expected)?)?;
        let number = |bytes: &[u8]| {
            let mut buffer = [0; 8];
            buffer[..size].copy_from_slice(bytes);
            if header.is_big {
                buffer[..size].reverse();
            }
            header.number(buffer)
        };
        let mut numbers: Vec<f64> = bytes.chunks_exact(size).map(number).collect();
        if let (true, [rows, columns]) = (header.by_columns, &shape[..]) {
            numbers = (0..rows * columns).map(|i| numbers[i % columns * rows + i / columns]).collect();
        } else if header.by_columns && shape.len() > 2 {
            return Err(format!(
                "found the shape {shape:?} in Fortran's order, expected C's; save numpy.ascontiguousarray of it"
            ));
        }
        Ok(Self { shape, numbers })
    }
}

/// The header of an array: a Python dictionary such as `{'descr': '<f8', 'fortran_order': False, 'shape': (6890, 3), }`.
struct Header {
    /// `f`, `i` or `u`.
    kind: u8,
    /// Bytes of a number.
    size: usize,
    is_big: bool,
    by_columns: bool,
    shape: Vec<usize>,
}

impl Header {
    fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("found the header \"{}\", expected a type, an order and a shape", excerpt(text.trim()));
        let value = |key: &str| {
            text.split_once(key).and_then(|(_, rest)| rest.split_once(':')).map(|(_, rest)| rest.trim_start())
        };
        let descr = value("'descr'").ok_or_else(wrong)?;
        let descr = descr.strip_prefix('\'').and_then(|rest| rest.split_once('\'')).map(|(descr, _)| descr);
        let (kind, size, is_big) = match descr.map(str::as_bytes) {
            Some(&[order @ (b'<' | b'>' | b'|' | b'='), kind @ b'f', size @ (b'4' | b'8')])
            | Some(&[order @ (b'<' | b'>' | b'|' | b'='), kind @ (b'i' | b'u'), size @ (b'1' | b'2' | b'4' | b'8')]) => {
                (kind, usize::from(size - b'0'), order == b'>')
            }
            Some([_, b'O', ..]) => {
                return Err(
                    "found pickled Python objects, which are not read, expected numbers; save an array of floats"
                        .to_owned(),
                );
            }
            _ => {
                let found = excerpt(descr.unwrap_or("of several fields"));
                return Err(format!(
                    "found the type {found}, expected float32, float64 or integers; save it by astype"
                ));
            }
        };
        let by_columns = value("'fortran_order'").ok_or_else(wrong)?.starts_with("True");
        let shape = value("'shape'").and_then(|rest| rest.strip_prefix('(')?.split_once(')')).ok_or_else(wrong)?.0;
        let numbers = shape.split(',').map(str::trim).filter(|number| !number.is_empty());
        let shape = numbers.map(|number| number.trim_end_matches('L').parse().ok()).collect::<Option<_>>();
        Ok(Self { kind, size, is_big, by_columns, shape: shape.ok_or_else(wrong)? })
    }

    /// The number in the bytes of one, least significant byte first.
    fn number(&self, b: [u8; 8]) -> f64 {
        match (self.kind, self.size) {
            (b'f', 4) => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            (b'f', _) => f64::from_le_bytes(b),
            (b'u', _) => u64::from_le_bytes(b) as f64,
            // The sign is the highest bit of the last byte.
            (_, size) => {
                let unused = 64 - 8 * size as u32;
                (i64::from_le_bytes(b) << unused >> unused) as f64
            }
        }
    }
}
