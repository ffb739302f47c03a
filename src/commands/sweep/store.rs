//! The stored points of a sweep: drape, PARTs and forces, in the single precision of a recording. The recording of a sweep is made
//! from them at the end, also after an interruption and from shards.
//!
//! | file in the sweep's folder | contents |
//! |---|---|
//! | `points/ID.point` | one point, by its content hash |
//! | `scenes/ID.scene` | body, garment and distances that points share |
//!
//! The file of a point is written before its row. A point with a missing or damaged file is computed again.

use std::collections::BTreeMap;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crate::base::checksum::{self, Tag, write};
use crate::base::files::{self, read_own};
use crate::drape::Drape;
use crate::garment::MeshCache;
use crate::mesh::TriMesh;
use crate::parts::UNASSIGNED;
use crate::scene::Scene;
use crate::study::accuracy::ReferenceCache;
use crate::study::metrics::LevelCount;
use crate::study::sweep::{Bench, Point, PointError, Row, is_id};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::commands::runtime::interrupt_flag;

const POINT: &Tag = b"PWPOINT7";
const SCENE: &Tag = b"PWSCENE3";

/// Body and garment of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct StoredScene {
    /// The body, m.
    #[serde(serialize_with = "write_mesh", deserialize_with = "read_mesh")]
    pub(crate) body: TriMesh,
    /// The garment, undraped, m.
    #[serde(serialize_with = "write_mesh", deserialize_with = "read_mesh")]
    pub(crate) garment: TriMesh,
    /// Unsigned distance of each garment vertex to the body, m.
    #[serde(serialize_with = "write_numbers", deserialize_with = "read_numbers")]
    pub(crate) distances_m: Vec<f64>,
}

/// A point of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct StoredPoint {
    /// Id of the scene; the first field, so that it can be read from the first bytes of a file.
    pub(crate) scene: String,
    /// The levels of the table.
    pub(crate) levels: Vec<LevelCount>,
    /// Resultant force on each PART, N.
    #[serde(serialize_with = "write_points", deserialize_with = "read_points")]
    pub(crate) force_n: Vec<DVec3>,
    /// PART of each vertex.
    pub(crate) part_of_vertex: Vec<u32>,
    /// The draped garment, m.
    #[serde(serialize_with = "write_points", deserialize_with = "read_points")]
    pub(crate) positions: Vec<DVec3>,
    /// Distance of each vertex to the reference drape, mm; empty if not measured.
    #[serde(serialize_with = "write_numbers", deserialize_with = "read_numbers")]
    pub(crate) error_mm: Vec<f64>,
    /// Largest strain at each vertex, %; empty without a state at full resolution.
    #[serde(serialize_with = "write_numbers", deserialize_with = "read_numbers")]
    pub(crate) strain_percent: Vec<f64>,
    /// Pressure on the body at each vertex, kPa; empty without a state at full resolution.
    #[serde(serialize_with = "write_numbers", deserialize_with = "read_numbers")]
    pub(crate) pressure_kpa: Vec<f64>,
}

impl StoredScene {
    fn of(scene: &Scene) -> io::Result<Self> {
        let (body, garment) = (scene.body.mesh().clone(), scene.garment.clone());
        Ok(Self { body, garment, distances_m: scene.distances_m().map_err(io::Error::other)? })
    }

    /// Whether every index is in range; a file may come from another program.
    fn is_valid(&self) -> bool {
        let whole = |mesh: &TriMesh| mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < mesh.vertex_count());
        whole(&self.body) && whole(&self.garment) && self.distances_m.len() == self.garment.vertex_count()
    }
}

impl StoredPoint {
    /// The point of a drape in the scene with id `scene`.
    pub(crate) fn of(scene: String, drape: &Drape, error_mm: &[f64]) -> Self {
        let fit = drape.state.as_ref().map(|state| &state.fit);
        Self {
            scene,
            levels: LevelCount::all(&drape.table, &drape.parts),
            force_n: drape.outcomes.iter().map(|o| o.force_n).collect(),
            part_of_vertex: drape.parts.part_of_vertex.clone(),
            positions: drape.positions.clone(),
            error_mm: error_mm.to_vec(),
            strain_percent: fit.map_or_else(Vec::new, |fit| fit.strain_percent.clone()),
            pressure_kpa: fit.map_or_else(Vec::new, |fit| fit.pressure_kpa.clone()),
        }
    }

    /// Magnitude of the force on each vertex's PART, N.
    pub(crate) fn force_of_vertex(&self) -> Vec<f64> {
        let of = |&part: &u32| self.force_n.get(part as usize).map_or(0.0, |f| f.length());
        self.part_of_vertex.iter().map(of).collect()
    }

    /// Whether every index is in range, the levels contain all PARTs, and the scene has a valid id.
    fn is_valid(&self) -> bool {
        let parts = self.force_n.len();
        let counted = self.levels.iter().try_fold(0_usize, |sum, level| sum.checked_add(level.parts));
        is_id(&self.scene)
            && self.levels.iter().enumerate().all(|(i, level)| level.level == i + 1)
            && counted == Some(parts)
            && self.part_of_vertex.len() == self.positions.len()
            && self.part_of_vertex.iter().all(|&part| (part as usize) < parts || part == UNASSIGNED)
            && [&self.error_mm, &self.strain_percent, &self.pressure_kpa]
                .iter()
                .all(|values| values.is_empty() || values.len() == self.positions.len())
    }
}

/// The storage of points and scenes.
#[derive(Debug)]
pub(crate) enum PointStore {
    /// The folder of a sweep. The lock is held while a scene is written, because several jobs may share one.
    Folder(PathBuf, Mutex<()>),
    /// Memory, for a few points.
    Memory(Mutex<Stored>),
}

type Stored = (BTreeMap<String, StoredScene>, BTreeMap<String, StoredPoint>);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn point_path(folder: &Path, id: &str) -> PathBuf {
    folder.join("points").join(format!("{id}.point"))
}

fn scene_path(folder: &Path, id: &str) -> PathBuf {
    folder.join("scenes").join(format!("{id}.scene"))
}

impl PointStore {
    pub(crate) fn in_memory() -> Self {
        Self::Memory(Mutex::default())
    }

    /// The store in a sweep's folder, which is created with the first point.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self::Folder(folder.to_owned(), Mutex::default())
    }

    /// Stores a point and its scene.
    pub(crate) fn put(&self, id: &str, point: StoredPoint, scene: &Scene) -> io::Result<()> {
        self.put_both(id, point, || StoredScene::of(scene))
    }

    fn put_both(
        &self,
        id: &str,
        point: StoredPoint,
        scene: impl FnOnce() -> io::Result<StoredScene>,
    ) -> io::Result<()> {
        match self {
            Self::Folder(folder, writing) => {
                let writing = lock(writing);
                // A damaged scene is written again; otherwise --resume would never succeed.
                if self.scene(&point.scene).is_none() {
                    write(&scene_path(folder, &point.scene), SCENE, &scene()?)?;
                }
                drop(writing);
                write(&point_path(folder, id), POINT, &point)
            }
            Self::Memory(stored) => {
                let (scenes, points) = &mut *lock(stored);
                if !scenes.contains_key(&point.scene) {
                    scenes.insert(point.scene.clone(), scene()?);
                }
                points.insert(id.to_owned(), point);
                Ok(())
            }
        }
    }

    /// A point, if its file exists and is intact.
    pub(crate) fn point(&self, id: &str) -> Option<StoredPoint> {
        match self {
            Self::Folder(folder, _) => {
                checksum::decode(POINT, &read_own(&point_path(folder, id)).ok()?).filter(StoredPoint::is_valid)
            }
            Self::Memory(stored) => lock(stored).1.get(id).cloned(),
        }
    }

    /// The id of a point's scene, from the first bytes of the point's file.
    pub(crate) fn scene_of(&self, id: &str) -> Option<String> {
        match self {
            Self::Folder(folder, _) => {
                let mut head = Vec::new();
                files::open(&point_path(folder, id)).ok()?.take(256).read_to_end(&mut head).ok()?;
                checksum::first_field(POINT, &head).filter(|scene: &String| is_id(scene))
            }
            Self::Memory(stored) => Some(lock(stored).1.get(id)?.scene.clone()),
        }
    }

    /// A scene, if its file exists and is intact.
    pub(crate) fn scene(&self, id: &str) -> Option<StoredScene> {
        match self {
            Self::Folder(folder, _) => {
                checksum::decode(SCENE, &read_own(&scene_path(folder, id)).ok()?).filter(StoredScene::is_valid)
            }
            Self::Memory(stored) => lock(stored).0.get(id).cloned(),
        }
    }

    /// Copies a point from another store; false if it is missing or damaged there.
    pub(crate) fn adopt(&self, from: &Self, id: &str) -> io::Result<bool> {
        let Some(point) = from.point(id) else { return Ok(false) };
        let Some(scene) = from.scene(&point.scene) else { return Ok(false) };
        self.put_both(id, point, || Ok(scene)).map(|()| true)
    }
}

/// Computes points and stores them.
pub(crate) struct StoringBench<'a> {
    pub(crate) bench: Bench<'static>,
    store: &'a PointStore,
    failed: Mutex<Option<io::Error>>,
    storing_us: AtomicU64,
}

impl<'a> StoringBench<'a> {
    /// A bench with its points in `store` and its reference drapes in `cache`.
    pub(crate) fn new(store: &'a PointStore, cache: Option<ReferenceCache>) -> Self {
        let bench = Bench::new(cache, interrupt_flag()).with_meshes(MeshCache::in_user_cache());
        Self { bench, store, failed: Mutex::default(), storing_us: AtomicU64::new(0) }
    }

    /// The error of a store that failed, such as a full disk.
    pub(crate) fn take_error(&self) -> Option<io::Error> {
        lock(&self.failed).take()
    }

    /// Time spent storing points, ms.
    pub(crate) fn storing_ms(&self) -> f64 {
        self.storing_us.load(Ordering::Relaxed) as f64 / 1e3
    }

    /// The row of a point, which is stored first; `passes` are the untimed and the timed ones.
    pub(crate) fn row(&self, point: &Point, passes: (usize, usize)) -> Option<Row> {
        if lock(&self.failed).is_some() {
            return None;
        }
        self.bench.row(point, passes, |loaded, drape, measured| {
            let started = Instant::now();
            let stored = StoredPoint::of(point.scene_id(), drape, &measured.error_mm);
            let put = self.store.put(&point.id, stored, &loaded.scene);
            self.storing_us.fetch_add(started.elapsed().as_micros() as u64, Ordering::Relaxed);
            put.map_err(|error| {
                // A point that is not stored gets no row. Most likely the disk is full, and further points would fail as well.
                *lock(&self.failed) = Some(error);
                PointError::Interrupted
            })
        })
    }
}

// Meshes and numbers are stored in single precision.

fn narrow(points: &[DVec3]) -> Vec<Vec3> {
    points.iter().map(DVec3::as_vec3).collect()
}

fn widen(points: Vec<Vec3>) -> Vec<DVec3> {
    points.iter().map(Vec3::as_dvec3).collect()
}

fn write_points<S: Serializer>(points: &[DVec3], to: S) -> Result<S::Ok, S::Error> {
    narrow(points).serialize(to)
}

fn read_points<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<DVec3>, D::Error> {
    Deserialize::deserialize(from).map(widen)
}

fn write_numbers<S: Serializer>(numbers: &[f64], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(numbers.iter().map(|&x| x as f32))
}

fn read_numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    Ok(Vec::<f32>::deserialize(from)?.into_iter().map(f64::from).collect())
}

/// Writes positions and triangles; a recording has no groups.
fn write_mesh<S: Serializer>(mesh: &TriMesh, to: S) -> Result<S::Ok, S::Error> {
    (narrow(&mesh.positions), &mesh.triangles).serialize(to)
}

fn read_mesh<'de, D: Deserializer<'de>>(from: D) -> Result<TriMesh, D::Error> {
    let (positions, triangles) = Deserialize::deserialize(from)?;
    Ok(TriMesh::new(widen(positions), triangles))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const SCENE_ID: &str = "0123456789abcdef0123456789abcdef";

    fn scene() -> StoredScene {
        let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X * 0.5, DVec3::Y * 0.25], vec![[0, 1, 2]]);
        StoredScene { body: mesh.clone(), garment: mesh, distances_m: vec![0.5, 0.25, 0.125] }
    }

    fn point() -> StoredPoint {
        let (lower_cm, upper_cm) = (0.0, f64::INFINITY);
        StoredPoint {
            scene: SCENE_ID.to_owned(),
            levels: vec![LevelCount { level: 1, lower_cm, upper_cm, extent: None, vertices: 2, parts: 1 }],
            force_n: vec![DVec3::Z * -0.5],
            part_of_vertex: vec![0, 0, UNASSIGNED],
            positions: scene().garment.positions,
            error_mm: vec![0.5, 1.0, 2.0],
            strain_percent: vec![1.0, 2.0, 4.0],
            pressure_kpa: vec![0.0, 0.5, 0.25],
        }
    }

    #[test]
    fn a_stored_point_reads_back_and_a_truncated_scene_is_written_again() {
        let folder = tempfile::tempdir().unwrap();
        let store = PointStore::in_folder(folder.path());
        store.put_both("a", point(), || Ok(scene())).unwrap();
        assert_eq!((store.scene(SCENE_ID), store.point("a")), (Some(scene()), Some(point())));
        assert_eq!(store.scene_of("a").as_deref(), Some(SCENE_ID));
        let path = scene_path(folder.path(), SCENE_ID);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert_eq!(store.scene(SCENE_ID), None);
        store.put_both("a", point(), || Ok(scene())).unwrap();
        assert_eq!(store.scene(SCENE_ID), Some(scene()), "--resume would never succeed");
    }

    #[test]
    fn indices_out_of_range_and_ids_that_are_paths_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let store = PointStore::in_folder(folder.path());
        let spoil: [fn(&mut StoredPoint); 7] = [
            |p| p.scene = "outside".to_owned(),
            |p| p.levels[0].level = 7,
            |p| p.levels[0].parts = 2,
            |p| p.part_of_vertex[0] = 3,
            |p| p.force_n.clear(),
            |p| p.error_mm.truncate(1),
            |p| p.strain_percent.truncate(1),
        ];
        for (i, spoil) in spoil.into_iter().enumerate() {
            let mut spoilt = point();
            spoil(&mut spoilt);
            write(&point_path(folder.path(), "b"), POINT, &spoilt).unwrap();
            assert_eq!(store.point("b"), None, "{i}");
        }
        let outside = StoredPoint { scene: "../../outside".to_owned(), ..point() };
        write(&point_path(folder.path(), "b"), POINT, &outside).unwrap();
        assert_eq!((store.scene_of("b"), store.point("b")), (None, None));
        let mut far = scene();
        far.garment.triangles[0][2] = 3;
        write(&scene_path(folder.path(), SCENE_ID), SCENE, &far).unwrap();
        assert_eq!(store.scene(SCENE_ID), None);
    }
}
