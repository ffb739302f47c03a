//! What a sweep keeps of every point beside its row, so that its recording can be put together at the end, after any
//! interruption, and from shards: the drape, the PARTs and their forces, in single precision as a recording holds them.
//!
//! | file in the sweep's folder | what |
//! |---|---|
//! | `points/ID.point` | one point, by its content hash |
//! | `scenes/ID.scene` | body, garment and distances that points share |
//!
//! A point's file is written before its row; one that is missing or damaged is computed again.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{DVec3, Vec3};
use partwise::drape::Drape;
use partwise::figures::LevelCount;
use partwise::mesh::TriMesh;
use partwise::scene::Scene;
use serde::{Deserialize, Serialize};

use super::codec::{self, Kind};

/// Points or vectors in single precision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Points(Vec<[f32; 3]>);

impl Points {
    fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        Self(points.into_iter().map(|p| p.as_vec3().to_array()).collect())
    }

    /// In double precision again.
    pub(crate) fn wide(&self) -> Vec<DVec3> {
        self.0.iter().map(|p| Vec3::from_array(*p).as_dvec3()).collect()
    }
}

/// A triangle mesh without its groups.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Surface(Points, Vec<[u32; 3]>);

impl Surface {
    fn of(mesh: &TriMesh) -> Self {
        Self(Points::of(mesh.positions.iter().copied()), mesh.triangles.clone())
    }

    /// As a mesh.
    pub(crate) fn mesh(&self) -> TriMesh {
        TriMesh::new(self.0.wide(), self.1.clone())
    }
}

/// Numbers in double precision again.
pub(crate) fn wide(numbers: &[f32]) -> Vec<f64> {
    numbers.iter().copied().map(f64::from).collect()
}

fn narrow(numbers: &[f64]) -> Vec<f32> {
    numbers.iter().map(|&x| x as f32).collect()
}

/// Body and garment as a recording shows them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptScene {
    /// The body, m.
    pub(crate) body: Surface,
    /// The garment, undraped, m.
    pub(crate) garment: Surface,
    /// Unsigned distance of each garment vertex to the body, m.
    pub(crate) distance_m: Vec<f32>,
}

/// One point as a recording shows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptPoint {
    /// Id of its scene; first, so that it can be read alone.
    pub(crate) scene: String,
    /// The levels of its table.
    pub(crate) levels: Vec<LevelCount>,
    /// Resultant force on each PART, N.
    pub(crate) force_n: Points,
    /// PART of each vertex.
    pub(crate) part_of_vertex: Vec<u32>,
    /// The displaced garment, m.
    pub(crate) positions: Points,
    /// Distance of each vertex to the reference drape, mm; empty where nobody asked.
    pub(crate) error_mm: Vec<f32>,
}

impl Kind for KeptScene {
    const KIND: &'static [u8; 8] = b"PWSCENE2";
}

impl Kind for KeptPoint {
    const KIND: &'static [u8; 8] = b"PWPOINT3";
}

impl KeptScene {
    fn of(scene: &Scene) -> Self {
        Self {
            body: Surface::of(scene.body.mesh()),
            garment: Surface::of(&scene.garment),
            distance_m: narrow(&scene.distances_m()),
        }
    }
}

impl KeptPoint {
    /// What is kept of a drape in the scene of this id.
    pub(crate) fn of(scene: String, drape: &Drape, error_mm: &[f64]) -> Self {
        Self {
            scene,
            levels: LevelCount::all(&drape.table, &drape.parts),
            force_n: Points::of(drape.outcomes.iter().map(|o| o.force_n)),
            part_of_vertex: drape.parts.part_of_vertex.clone(),
            positions: Points::of(drape.positions.iter().copied()),
            error_mm: narrow(error_mm),
        }
    }
}

/// Where points and scenes are kept.
#[derive(Debug)]
pub(crate) enum PointStore {
    /// In a sweep's folder; who writes a scene, which several jobs may want at once, takes the lock.
    Folder(PathBuf, Mutex<()>),
    /// In memory, for a handful of points.
    Memory(Mutex<(BTreeMap<String, KeptScene>, BTreeMap<String, KeptPoint>)>),
}

type Kept = (BTreeMap<String, KeptScene>, BTreeMap<String, KeptPoint>);

fn open(kept: &Mutex<Kept>) -> MutexGuard<'_, Kept> {
    kept.lock().unwrap_or_else(PoisonError::into_inner)
}

fn point_path(folder: &Path, id: &str) -> PathBuf {
    folder.join("points").join(format!("{id}.point"))
}

fn scene_path(folder: &Path, id: &str) -> PathBuf {
    folder.join("scenes").join(format!("{id}.scene"))
}

impl PointStore {
    /// A store in memory.
    pub(crate) fn in_memory() -> Self {
        Self::Memory(Mutex::default())
    }

    /// A store in a sweep's folder; it is made with the first point.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self::Folder(folder.to_owned(), Mutex::default())
    }

    /// Keeps a point and its scene.
    pub(crate) fn put(&self, id: &str, point: KeptPoint, scene: &Scene) -> io::Result<()> {
        self.put_both(id, point, || KeptScene::of(scene))
    }

    fn put_both(&self, id: &str, point: KeptPoint, scene: impl FnOnce() -> KeptScene) -> io::Result<()> {
        match self {
            Self::Folder(folder, lock) => {
                let path = scene_path(folder, &point.scene);
                let writing = lock.lock().unwrap_or_else(PoisonError::into_inner);
                if !path.exists() {
                    write(&path, &scene())?;
                }
                drop(writing);
                write(&point_path(folder, id), &point)
            }
            Self::Memory(kept) => {
                let (scenes, points) = &mut *open(kept);
                scenes.entry(point.scene.clone()).or_insert_with(scene);
                points.insert(id.to_owned(), point);
                Ok(())
            }
        }
    }

    /// A point, if it is there and whole.
    pub(crate) fn point(&self, id: &str) -> Option<KeptPoint> {
        match self {
            Self::Folder(folder, _) => codec::read(&fs::read(point_path(folder, id)).ok()?),
            Self::Memory(kept) => open(kept).1.get(id).cloned(),
        }
    }

    /// The scene of a point, by id, without reading the whole of it.
    pub(crate) fn scene_of(&self, id: &str) -> Option<String> {
        match self {
            Self::Folder(folder, _) => {
                let mut head = Vec::new();
                fs::File::open(point_path(folder, id)).ok()?.take(256).read_to_end(&mut head).ok()?;
                codec::first_text::<KeptPoint>(&head)
            }
            Self::Memory(kept) => Some(open(kept).1.get(id)?.scene.clone()),
        }
    }

    /// A scene, if it is there and whole.
    pub(crate) fn scene(&self, id: &str) -> Option<KeptScene> {
        match self {
            Self::Folder(folder, _) => codec::read(&fs::read(scene_path(folder, id)).ok()?),
            Self::Memory(kept) => open(kept).0.get(id).cloned(),
        }
    }

    /// Takes over what another sweep's folder holds of a point; false where it has nothing whole.
    pub(crate) fn adopt(&self, from: &Self, id: &str) -> io::Result<bool> {
        let Some(point) = from.point(id) else { return Ok(false) };
        let Some(scene) = from.scene(&point.scene) else { return Ok(false) };
        self.put_both(id, point, || scene).map(|()| true)
    }
}

fn write<T: Kind>(path: &Path, value: &T) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    codec::write(path, value)
}
