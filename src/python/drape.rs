//! One drape: a job is built from the keyword arguments and run.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use serde::Serialize;

use super::error::{Error, exception};
use super::mesh::{Mesh, read_only, rows, vectors};
use super::{call, keywords};
use crate::drape::{ClothState, StageTimes};
use crate::garment::MeshCache;
use crate::mechanics::refine::{Step, Stop};
use crate::mesh::TriMesh;
use crate::parts::UNASSIGNED;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::of_drape;
use crate::scene::Loaded;
use crate::study::accuracy::ReferenceCache;
use crate::study::job::Job;
use crate::study::sweep::result_hash;

/// Arrays that are made at their first use; later reads return the same ones.
struct Arrays {
    positions: PyOnceLock<Py<PyArray2<f64>>>,
    faces: PyOnceLock<Py<PyArray2<u32>>>,
    parts: PyOnceLock<Py<PyArray1<i32>>>,
    force: PyOnceLock<Py<PyArray2<f64>>>,
}

impl Arrays {
    fn new() -> Self {
        Self {
            positions: PyOnceLock::new(),
            faces: PyOnceLock::new(),
            parts: PyOnceLock::new(),
            force: PyOnceLock::new(),
        }
    }
}

/// A draped garment: positions in metres with z up, and the result of every stage.
#[pyclass(frozen, module = "partwise")]
pub(super) struct Drape {
    job: Job,
    loaded: Loaded,
    result: crate::drape::Drape,
    metrics: PyOnceLock<String>,
    arrays: Arrays,
}

/// Positions and triangles.
type MeshArrays = (Py<PyArray2<f64>>, Py<PyArray2<u32>>);

/// Whether `stop` is set, as an observer answers.
pub(super) fn listen(stop: &AtomicBool) -> ControlFlow<()> {
    if stop.load(Ordering::SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Runs the job of `keywords` (JSON), in which the names of `meshes` stand for meshes in memory.
#[pyfunction]
pub(super) fn drape(py: Python<'_>, keywords: &str, meshes: BTreeMap<String, Py<Mesh>>) -> PyResult<Drape> {
    let meshes = meshes.into_iter().map(|(name, mesh)| (name, mesh.get().source.clone())).collect();
    let job = keywords::job(keywords, meshes)?;
    let (loaded, result) = call::run(py, |stop| {
        let loaded = job.scene.load_with(&MeshCache::in_user_cache()).map_err(|e| exception(&e))?;
        let result = job.drape(&loaded.scene, &mut |_: &Step<'_>| listen(stop)).map_err(|e| exception(&e))?;
        Ok((loaded, result))
    })?;
    Ok(Drape { job, loaded, result, metrics: PyOnceLock::new(), arrays: Arrays::new() })
}

#[pymethods]
impl Drape {
    #[getter]
    fn positions(&self, py: Python<'_>) -> PyResult<Py<PyArray2<f64>>> {
        once(py, &self.arrays.positions, || vectors(py, &self.result.positions))
    }

    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, &self.loaded.in_file(&self.result.positions))
    }

    #[getter]
    fn faces(&self, py: Python<'_>) -> PyResult<Py<PyArray2<u32>>> {
        once(py, &self.arrays.faces, || triangles(py, &self.loaded.scene.garment))
    }

    #[getter]
    fn undraped<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, &self.loaded.scene.garment.positions)
    }

    #[getter]
    fn preview<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, &self.result.preview)
    }

    #[getter]
    fn body(&self, py: Python<'_>) -> PyResult<MeshArrays> {
        arrays(py, self.loaded.scene.body.mesh())
    }

    #[getter]
    fn distance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        values(py, self.result.distance.clone())
    }

    #[getter]
    fn parts(&self, py: Python<'_>) -> PyResult<Py<PyArray1<i32>>> {
        let number = |&part: &u32| if part == UNASSIGNED { -1 } else { i32::try_from(part).unwrap_or(i32::MAX) };
        once(py, &self.arrays.parts, || values(py, self.result.parts.part_of_vertex.iter().map(number).collect()))
    }

    #[getter]
    fn levels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        values(py, self.result.parts.parts.iter().map(|part| part.level).collect())
    }

    #[getter]
    fn force(&self, py: Python<'_>) -> PyResult<Py<PyArray2<f64>>> {
        let forces: Vec<DVec3> = self.result.outcomes.iter().map(|outcome| outcome.force_n).collect();
        once(py, &self.arrays.force, || vectors(py, &forces))
    }

    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let moves: Vec<DVec3> = self.result.outcomes.iter().map(|outcome| outcome.displacement).collect();
        vectors(py, &moves)
    }

    #[getter]
    fn contact<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        values(py, self.result.outcomes.iter().map(|outcome| outcome.contact).collect())
    }

    #[getter]
    fn strain<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        self.state().map(|state| values(py, state.fit.strain_percent.clone())).transpose()
    }

    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        self.state().map(|state| values(py, state.fit.pressure_kpa.clone())).transpose()
    }

    #[getter]
    fn residual(&self) -> Option<f64> {
        self.state().map(|state| state.residual_over_weight)
    }

    #[getter]
    fn energy(&self) -> Option<f64> {
        self.state().map(|state| state.energy)
    }

    #[getter]
    fn steps(&self) -> usize {
        self.state().map_or(0, |state| state.steps)
    }

    #[getter]
    fn converged(&self) -> bool {
        self.state().is_some_and(|state| state.stop == Stop::Converged)
    }

    #[getter]
    fn times_ms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let StageTimes { distance, segment, cloth, mechanics, refine, total } = self.result.times;
        let times = PyDict::new(py);
        let named = [
            ("distance", distance),
            ("segment", segment),
            ("cloth", cloth),
            ("mechanics", mechanics),
            ("refine", refine),
            ("total", total),
        ];
        for (name, time) in named {
            times.set_item(name, 1e3 * time.as_secs_f64())?;
        }
        Ok(times)
    }

    #[getter]
    fn result_hash(&self) -> String {
        result_hash(&self.result.positions)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.loaded.garment_name
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        [self.loaded.warnings(), self.result.warnings.clone()].concat()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.loaded.notes()
    }

    #[getter]
    fn job<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        dict(py, &json(&self.job)?)
    }

    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let measured = self.metrics.get_or_try_init(py, || {
            call::run(py, |stop| {
                let cache = ReferenceCache::in_user_cache();
                let observer = &mut |_: &Step<'_>| listen(stop);
                let measured = self.job.measure(&self.loaded.scene, &self.result, cache.as_ref(), observer);
                json(&measured.map_err(|e| exception(&e))?.metrics)
            })
        });
        dict(py, measured?)
    }

    /// Writes the draped garment.
    fn export(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        call::run(py, |_| self.loaded.write(&path, &self.result.positions).map_err(|e| exception(&e)))
    }

    /// The colour of each vertex by a quantity, RGBA, as in a recording.
    fn colours<'py>(&self, py: Python<'py>, quantity: &str) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let Some(colours) = of_drape(&self.loaded.scene.garment, &self.result, quantity) else {
            let expected = "distance, parts or force, or with the coupled model strain, pressure or folds";
            return Err(Error::new_err(format!("quantity: found `{quantity}`, expected {expected}")));
        };
        rows(py, colours.into_iter().flatten().collect(), 4)
    }

    /// The undraped garment with one cell for each vertex, for colours with crisp borders: positions and triangles, normals, and the
    /// garment's vertex of each vertex.
    fn _cells<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(MeshArrays, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u32>>)> {
        let cells = CellMesh::new(&self.loaded.scene.garment);
        Ok((arrays(py, &cells.mesh)?, vectors(py, &cells.normals)?, values(py, cells.owner)?))
    }

    /// Vertex normals of the undraped garment, of the draped one, and of the body.
    fn _normals<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyArray2<f64>>; 3]> {
        let scene = &self.loaded.scene;
        let draped = scene.garment.with_positions(self.result.positions.clone());
        let normals = |mesh: &TriMesh| vectors(py, &mesh.vertex_normals());
        Ok([normals(&scene.garment)?, normals(&draped)?, normals(scene.body.mesh())?])
    }

    fn __repr__(&self) -> String {
        let (vertices, parts) = (self.result.positions.len(), self.result.parts.len());
        let state = match self.state() {
            None => "not solved at full resolution".to_owned(),
            Some(state) => {
                format!("residual {:.1e} of the weight after {} steps", state.residual_over_weight, state.steps)
            }
        };
        format!("<partwise.Drape of {}: {vertices} vertices, {parts} PARTs, {state}>", self.loaded.garment_name)
    }
}

impl Drape {
    fn state(&self) -> Option<&ClothState> {
        self.result.state.as_ref()
    }
}

/// JSON as Python's own types.
fn dict<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}

fn json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| exception(&e))
}

fn arrays(py: Python<'_>, mesh: &TriMesh) -> PyResult<MeshArrays> {
    Ok((vectors(py, &mesh.positions)?.unbind(), triangles(py, mesh)?.unbind()))
}

fn triangles<'py>(py: Python<'py>, mesh: &TriMesh) -> PyResult<Bound<'py, PyArray2<u32>>> {
    rows(py, mesh.triangles.as_flattened().to_vec(), 3)
}

/// An array of one value for each entry, which cannot be written to. The numbers are moved, not copied.
fn values<T: numpy::Element>(py: Python<'_>, numbers: Vec<T>) -> PyResult<Bound<'_, PyArray1<T>>> {
    let array = PyArray1::from_vec(py, numbers);
    read_only(&array)?;
    Ok(array)
}

/// The array of `slot`, made if this is its first use.
fn once<'py, T>(
    py: Python<'py>,
    slot: &PyOnceLock<Py<T>>,
    make: impl FnOnce() -> PyResult<Bound<'py, T>>,
) -> PyResult<Py<T>> {
    Ok(slot.get_or_try_init(py, || make().map(Bound::unbind))?.clone_ref(py))
}
