//! Numbers of a glTF document: accessors over views of buffers (section 3.6), each bound checked.

use std::borrow::Cow;
use std::cell::Cell;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::document::{Accessor, Buffer, Document, SparseView};
use crate::mesh::read::obj::excerpt;

/// Nodes may draw the same data several times: at most this many times the length of the file, in bytes.
const MAX_REPEATS: usize = 16;

/// The contents of the buffers.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    /// The contents, or the reason that they are not read; it matters only where a mesh needs them.
    contents: Vec<Result<Cow<'a, [u8]>, String>>,
    /// Bytes that may still be read.
    budget: Cell<usize>,
}

impl<'a> Buffers<'a> {
    /// The buffers of a file of `length` bytes with the binary chunk `binary`.
    pub(super) fn new(document: &'a Document, length: usize, binary: Option<&'a [u8]>) -> Self {
        let content = |(number, buffer): (usize, &'a Buffer)| match (&buffer.uri, binary) {
            (None, Some(binary)) if number == 0 => Ok(binary.into()),
            (None, _) => {
                Err(format!("buffer {number}: found no data in the file, expected the binary chunk of a .glb"))
            }
            (Some(uri), _) => embedded(uri).map(Cow::from).map_err(|problem| format!("buffer {number}: {problem}")),
        };
        let contents = document.buffers.iter().enumerate().map(content).collect();
        Self { document, contents, budget: Cell::new(MAX_REPEATS.saturating_mul(length)) }
    }

    /// The elements of an accessor of `N` components; normalised integers from -1 or 0 to 1.
    ///
    /// # Errors
    /// Names the accessor.
    pub(super) fn read<const N: usize>(&self, index: usize, kind: &str) -> Result<Vec<[f64; N]>, String> {
        self.elements(index, kind).map_err(|problem| format!("accessor {index}: {problem}"))
    }

    fn elements<const N: usize>(&self, index: usize, kind: &str) -> Result<Vec<[f64; N]>, String> {
        let accessors = &self.document.accessors;
        let accessor = accessors.get(index).ok_or_else(|| missing("accessors", accessors.len()))?;
        let Accessor { component_type, normalized, count, .. } = *accessor;
        if accessor.kind != kind {
            return Err(format!("found the type {}, expected {kind}", excerpt(&accessor.kind)));
        }
        let size = size_of(component_type)?;
        let left = count.checked_mul(N * size).and_then(|bytes| self.budget.get().checked_sub(bytes)).ok_or_else(|| {
            format!("found {count} elements, expected fewer: the meshes draw more than {MAX_REPEATS} times the bytes of the file")
        })?;
        self.budget.set(left);
        let number = |bytes: &[u8]| {
            let value = component(component_type, bytes);
            match component_type {
                BYTE if normalized => (value / 127.0).max(-1.0),
                UNSIGNED_BYTE if normalized => value / 255.0,
                SHORT if normalized => (value / 32767.0).max(-1.0),
                UNSIGNED_SHORT if normalized => value / 65535.0,
                _ => value,
            }
        };
        let element = |bytes: &[u8]| std::array::from_fn(|k| number(&bytes[k * size..(k + 1) * size]));
        let mut elements = match accessor.buffer_view {
            None => vec![[0.0; N]; count],
            Some(view) => {
                let bytes = self.slices(view, accessor.byte_offset, count, N * size)?;
                bytes.map(element).collect()
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let SparseView { buffer_view, byte_offset, component_type } = sparse.indices;
            let size_of_index = size_of(component_type)?;
            let places = self.slices(buffer_view, byte_offset, sparse.count, size_of_index)?;
            let SparseView { buffer_view, byte_offset, .. } = sparse.values;
            let values = self.slices(buffer_view, byte_offset, sparse.count, N * size)?;
            for (place, value) in places.zip(values) {
                let place = component(component_type, place) as usize;
                let expected = || format!("found the sparse index {place}, expected one below {count}");
                *elements.get_mut(place).ok_or_else(expected)? = element(value);
            }
        }
        Ok(elements)
    }

    /// `count` pieces of `size` bytes of a view, from an offset on.
    fn slices(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, String> {
        let views = &self.document.buffer_views;
        let view = views.get(view).ok_or_else(|| missing("views", views.len()))?;
        let buffer = self.contents.get(view.buffer).ok_or_else(|| missing("buffers", self.contents.len()))?;
        let buffer = buffer.as_ref().map_err(Clone::clone)?;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(format!("found a stride of {stride} bytes, expected {size} or more, the size of an element"));
        }
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| buffer.get(view.byte_offset..end)).and_then(|bytes| bytes.get(offset..));
        let needed =
            if count == 0 { Some(0) } else { (count - 1).checked_mul(stride).and_then(|all| all.checked_add(size)) };
        match (bytes, needed) {
            (Some(bytes), Some(needed)) if needed <= bytes.len() => {
                Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
            }
            _ => Err(format!(
                "found {count} elements of {size} bytes, expected no more than its view and buffer hold ({} bytes); the file is cut off",
                buffer.len()
            )),
        }
    }
}

/// An index past a list.
pub(super) fn missing(what: &str, count: usize) -> String {
    format!("found an index past the {what}, expected one below {count}")
}

/// The bytes in a `data:` URI. Any other URI is refused, and not opened.
fn embedded(uri: &str) -> Result<Vec<u8>, String> {
    let Some(data) = uri.strip_prefix("data:") else {
        let found = excerpt(uri);
        return Err(format!(
            "found its data in another file, \"{found}\", which is not opened; export everything in one .glb"
        ));
    };
    let data = data.split_once(";base64,").map(|(_, data)| data).ok_or("found a data URI, expected one in base64")?;
    STANDARD.decode(data).map_err(|e| format!("the base64 of its data URI is invalid: {e}; expected it whole"))
}

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Bytes of a component.
fn size_of(component_type: u32) -> Result<usize, String> {
    match component_type {
        BYTE | UNSIGNED_BYTE => Ok(1),
        SHORT | UNSIGNED_SHORT => Ok(2),
        UNSIGNED_INT | FLOAT => Ok(4),
        found => Err(format!("found the component type {found}, expected one of 5120 to 5123, 5125 and 5126")),
    }
}

/// The number in as many bytes as [`size_of`] gives.
fn component(component_type: u32, bytes: &[u8]) -> f64 {
    match (component_type, bytes) {
        (BYTE, &[a]) => f64::from(a as i8),
        (SHORT, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (UNSIGNED_SHORT, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (UNSIGNED_INT, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (FLOAT, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        (_, bytes) => f64::from(bytes[0]),
    }
}
