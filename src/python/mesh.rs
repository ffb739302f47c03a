//! Meshes from NumPy arrays and from files.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;
use numpy::{PyArray2, PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::call;
use super::error::{Error, exception};
use crate::mesh::MeshSource;

/// A mesh in any unit and up axis, both of which are guessed where a job does not name them.
#[pyclass(frozen, module = "partwise")]
pub(super) struct Mesh {
    pub(super) source: Arc<MeshSource>,
}

#[pymethods]
impl Mesh {
    #[new]
    fn new(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> PyResult<Self> {
        let vertices = array(vertices, "vertices", "f", "float64 or float32")?;
        let faces = array(faces, "faces", "iu", "integers")?;
        let [_, 3] = vertices.shape()[..] else {
            let found = shape(&vertices);
            return Err(Error::new_err(format!("vertices: found the shape {found}, expected (number of vertices, 3)")));
        };
        let [_, corners @ 3..=64] = faces.shape()[..] else {
            let found = shape(&faces);
            let expected = "(number of faces, 3), or another number of corners from 3 to 64";
            return Err(Error::new_err(format!("faces: found the shape {found}, expected {expected}")));
        };
        let positions = numbers::<f64>(&vertices, "float64")?;
        let positions = positions.as_chunks::<3>().0.iter().copied().map(DVec3::from_array).collect();
        let faces = numbers::<i64>(&faces, "int64")?;
        let source = MeshSource::of_arrays(positions, &faces, corners).map_err(|e| exception(&e))?;
        Ok(Self { source: Arc::new(source) })
    }

    /// The path of the file, or `None` for arrays.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        Some(self.source.file.clone()).filter(|file| !file.as_os_str().is_empty())
    }

    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, &self.source.positions)
    }

    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let count = self.source.faces.first().map_or(3, |face| face.count);
        if let Some((number, other)) = self.source.faces.iter().enumerate().find(|(_, face)| face.count != count) {
            let expected = "as many corners as in the first face; the `faces` of a drape are its triangles";
            let found = format!("face {number} has {} corners", other.count);
            return Err(Error::new_err(format!("{found}, expected {count}, {expected}")));
        }
        let corners = self.source.faces.iter().flat_map(|face| self.source.corners_of(face));
        rows(py, corners.map(|corner| corner.vertex).collect(), count as usize)
    }

    fn __repr__(&self) -> String {
        let MeshSource { positions, faces, .. } = &*self.source;
        format!("<partwise.Mesh: {} vertices, {} faces>", positions.len(), faces.len())
    }
}

/// Reads a mesh file (OBJ, PLY, STL, glTF, `.npz`), with its groups and texture coordinates.
#[pyfunction]
pub(super) fn load(py: Python<'_>, path: PathBuf) -> PyResult<Mesh> {
    let source = call::run(py, |_| MeshSource::read(&path).map_err(|e| exception(&e)))?;
    Ok(Mesh { source: Arc::new(source) })
}

/// Any array-like of two dimensions whose kind of numbers is one of `kinds`.
fn array<'py>(
    given: &Bound<'py, PyAny>,
    name: &str,
    kinds: &str,
    expected: &str,
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = given.py().import("numpy")?.call_method1("asarray", (given,))?.cast_into::<PyUntypedArray>()?;
    let kind: String = array.dtype().getattr("kind")?.extract()?;
    if !kinds.contains(&kind) {
        let found: Bound<'_, PyString> = array.dtype().str()?;
        return Err(Error::new_err(format!("{name}: found the dtype {found}, expected {expected}")));
    }
    Ok(array)
}

fn shape(array: &Bound<'_, PyUntypedArray>) -> String {
    array.getattr("shape").map_or_else(|_| format!("{:?}", array.shape()), |shape| shape.to_string())
}

/// The entries of an array as `dtype`, row after row.
fn numbers<T: numpy::Element + Copy>(array: &Bound<'_, PyUntypedArray>, dtype: &str) -> PyResult<Vec<T>> {
    let numpy = array.py().import("numpy")?;
    let whole = numpy.call_method1("ascontiguousarray", (array, dtype))?.cast_into::<PyArray2<T>>()?;
    Ok(whole.to_vec()?)
}

/// An array of vectors, one a row, which cannot be written to.
pub(super) fn vectors<'py>(py: Python<'py>, vectors: &[DVec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    rows(py, vectors.iter().flat_map(DVec3::to_array).collect(), 3)
}

/// An array of rows, which cannot be written to. The numbers are moved, not copied.
pub(super) fn rows<T: numpy::Element>(
    py: Python<'_>,
    numbers: Vec<T>,
    columns: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = numbers.len() / columns;
    let array = numpy::PyArray1::from_vec(py, numbers).reshape([count, columns])?;
    read_only(&array)?;
    Ok(array)
}

/// Forbids writing to an array: a drape would not see the change.
pub(super) fn read_only(array: &Bound<'_, PyAny>) -> PyResult<()> {
    array.call_method1("setflags", (false,)).map(drop)
}
