//! Sweeps for Python: the plan, one point in a worker, and the rows on disk. The loop over an executor is Python's.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;

use super::call;
use super::error::{Error, exception};
use crate::garment::MeshCache;
use crate::study::accuracy::ReferenceCache;
use crate::study::job::{Against, Job};
use crate::study::sweep::{self, Bench, Existing, Manifest, Row, Scenes};

/// Scenes that a worker keeps. A heuristic: points of a sweep with the same scene are neighbours.
const MAX_SCENES: usize = 4;

/// The scenes of this process.
static SCENES: Mutex<Option<Arc<Scenes>>> = Mutex::new(None);

/// The points of a sweep.
#[pyclass(frozen, module = "partwise")]
pub(super) struct Plan {
    plan: sweep::Plan,
}

fn point_of(text: &str) -> PyResult<sweep::Point> {
    serde_json::from_str(text).map_err(|e| exception(&e))
}

fn line(row: &Row) -> PyResult<String> {
    serde_json::to_string(row).map_err(|e| exception(&e))
}

fn lines(rows: &[Row]) -> PyResult<Vec<String>> {
    rows.iter().map(line).collect()
}

#[pymethods]
impl Plan {
    /// Reads a sweep file, or the text of one as JSON with paths relative to the working directory.
    #[new]
    fn new(file: Option<PathBuf>, json: Option<&str>, accuracy: &str) -> PyResult<Self> {
        let accuracy: Against = accuracy.parse().map_err(Error::new_err)?;
        let start = Job { accuracy, ..Job::preview() };
        let plan = match (file, json) {
            (Some(file), _) => sweep::Plan::read(&file, &start).map_err(|e| exception(&e))?,
            (None, json) => {
                let value: serde_json::Value = serde_json::from_str(json.unwrap_or("{}")).map_err(|e| exception(&e))?;
                let text = toml::to_string(&value).map_err(|e| exception(&e))?;
                let folder = std::env::current_dir().unwrap_or_default();
                sweep::Plan::parse(&text, "spec", &folder, &start).map_err(|e| exception(&e))?
            }
        };
        Ok(Self { plan })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.plan.name
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.plan.notes.clone()
    }

    /// Untimed and timed passes of a point.
    #[getter]
    fn passes(&self) -> (usize, usize) {
        (self.plan.warm_up, self.plan.repeats)
    }

    /// Names of the columns of a row.
    #[getter]
    fn columns(&self) -> Vec<String> {
        sweep::columns()
    }

    fn __len__(&self) -> usize {
        self.plan.points.len()
    }

    /// A point as JSON.
    fn point(&self, index: usize) -> PyResult<String> {
        serde_json::to_string(self.get(index)?).map_err(|e| exception(&e))
    }

    fn label(&self, index: usize) -> PyResult<String> {
        Ok(self.get(index)?.label())
    }

    /// The row, as JSON, of a point that has no result.
    fn failed(&self, index: usize, error: &str) -> PyResult<String> {
        line(&Row::failed(self.get(index)?, error))
    }
}

impl Plan {
    fn get(&self, index: usize) -> PyResult<&sweep::Point> {
        let count = self.plan.points.len();
        let point = self.plan.points.get(index);
        point.ok_or_else(|| Error::new_err(format!("point: found {index}, expected less than {count}")))
    }
}

/// The row of a point, both as JSON.
#[pyfunction]
pub(super) fn run_point(py: Python<'_>, point: &str, passes: (usize, usize)) -> PyResult<String> {
    let point = point_of(point)?;
    let row = call::run(py, |stop| {
        let bench = Bench::new(ReferenceCache::in_user_cache(), stop).with_meshes(MeshCache::in_user_cache());
        Ok(bench.with_scenes(scenes()).row(&point, passes, |_, _, _| Ok(())))
    })?;
    line(&row.ok_or_else(|| Error::new_err("interrupted"))?)
}

/// The scenes of this process, without those of earlier points where they are many.
fn scenes() -> Arc<Scenes> {
    let mut shared = SCENES.lock().unwrap_or_else(PoisonError::into_inner);
    let many = |scenes: &Arc<Scenes>| scenes.lock().unwrap_or_else(PoisonError::into_inner).len() >= MAX_SCENES;
    if shared.as_ref().is_none_or(many) {
        *shared = Some(Arc::default());
    }
    shared.clone().unwrap_or_default()
}

/// The rows of a sweep in a folder, as `partwise sweep --out DIR --resume` keeps them.
#[pyclass(frozen, module = "partwise")]
pub(super) struct Store {
    store: Mutex<Option<sweep::Store>>,
}

#[pymethods]
impl Store {
    #[new]
    fn new(plan: &Plan, folder: PathBuf) -> PyResult<Self> {
        let existing = Existing::Resume { retry_failed: true, adopt: false };
        let store = sweep::Store::open(&folder, Manifest::of(&plan.plan, None), existing);
        Ok(Self { store: Mutex::new(Some(store.map_err(|e| exception(&e))?)) })
    }

    /// The rows so far.
    fn rows(&self) -> PyResult<Vec<String>> {
        self.open().as_ref().map_or_else(|| Ok(Vec::new()), |store| lines(&store.rows))
    }

    /// Writes a row; it is on disk when this returns.
    fn append(&self, py: Python<'_>, row: &str) -> PyResult<()> {
        let row: Row = serde_json::from_str(row).map_err(|e| exception(&e))?;
        py.detach(|| match &mut *self.open() {
            Some(store) => store.append(row).map_err(|e| exception(&e)),
            None => Err(Error::new_err("the rows of this sweep are complete")),
        })
    }

    /// Puts the rows into the order of the plan, writes the CSV and releases the folder.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| match self.open().take() {
            Some(store) => store.finish().map(drop).map_err(|e| exception(&e)),
            None => Ok(()),
        })
    }
}

impl Store {
    fn open(&self) -> MutexGuard<'_, Option<sweep::Store>> {
        self.store.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
