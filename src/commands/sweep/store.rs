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
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::base::checksum::{self, Tag, write};
use crate::base::files::{self, read_own};
use crate::drape::Drape;
use crate::mesh::TriMesh;
use crate::parts::UNASSIGNED;
use crate::scene::Scene;
use crate::study::metrics::LevelCount;
use crate::study::sweep::is_id;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::single;

const POINT: &Tag = b"PWPOINT5";
const SCENE: &Tag = b"PWSCENE3";

/// Body and garment as a recording shows them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptScene {
    /// The body, m.
    #[serde(with = "single::mesh")]
    pub(crate) body: TriMesh,
    /// The garment, undraped, m.
    #[serde(with = "single::mesh")]
    pub(crate) garment: TriMesh,
    /// Unsigned distance of each garment vertex to the body, m.
    #[serde(with = "single::numbers")]
    pub(crate) distance_m: Vec<f64>,
}

/// One point as a recording shows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptPoint {
    /// Id of its scene; the first field, so that it can be told from the head of a file.
    pub(crate) scene: String,
    /// The levels of its table.
    pub(crate) levels: Vec<LevelCount>,
    /// Resultant force on each PART, N.
    #[serde(with = "single::points")]
    pub(crate) force_n: Vec<DVec3>,
    /// PART of each vertex.
    pub(crate) part_of_vertex: Vec<u32>,
    /// The displaced garment, m.
    #[serde(with = "single::points")]
    pub(crate) positions: Vec<DVec3>,
    /// Distance of each vertex to the reference drape, mm; empty where nobody asked.
    #[serde(with = "single::numbers")]
    pub(crate) error_mm: Vec<f64>,
}

impl KeptScene {
    fn of(scene: &Scene) -> io::Result<Self> {
        let (body, garment) = (scene.body.mesh().clone(), scene.garment.clone());
        Ok(Self { body, garment, distance_m: scene.distances_m().map_err(io::Error::other)? })
    }

    /// Whether every index points at something: a file may be somebody else's.
    fn is_sound(&self) -> bool {
        let whole = |mesh: &TriMesh| mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < mesh.vertex_count());
        whole(&self.body) && whole(&self.garment) && self.distance_m.len() == self.garment.vertex_count()
    }
}

impl KeptPoint {
    /// What is kept of a drape in the scene of this id.
    pub(crate) fn of(scene: String, drape: &Drape, error_mm: &[f64]) -> Self {
        Self {
            scene,
            levels: LevelCount::all(&drape.table, &drape.parts),
            force_n: drape.outcomes.iter().map(|o| o.force_n).collect(),
            part_of_vertex: drape.parts.part_of_vertex.clone(),
            positions: drape.positions.clone(),
            error_mm: error_mm.to_vec(),
        }
    }

    /// Magnitude of the force on each vertex's PART, N.
    pub(crate) fn force_of_vertex(&self) -> Vec<f64> {
        let of = |&part: &u32| self.force_n.get(part as usize).map_or(0.0, |f| f.length());
        self.part_of_vertex.iter().map(of).collect()
    }

    /// Whether every index points at something, levels and PARTs add up, and the scene's id is one.
    fn is_sound(&self) -> bool {
        let parts = self.force_n.len();
        let counted = self.levels.iter().try_fold(0_usize, |sum, level| sum.checked_add(level.parts));
        is_id(&self.scene)
            && self.levels.iter().enumerate().all(|(i, level)| level.level == i + 1)
            && counted == Some(parts)
            && self.part_of_vertex.len() == self.positions.len()
            && self.part_of_vertex.iter().all(|&part| (part as usize) < parts || part == UNASSIGNED)
            && (self.error_mm.is_empty() || self.error_mm.len() == self.positions.len())
    }
}

/// Where points and scenes are kept.
#[derive(Debug)]
pub(crate) enum PointStore {
    /// In a sweep's folder; who writes a scene, which several jobs may want at once, takes the lock.
    Folder(PathBuf, Mutex<()>),
    /// In memory, for a handful of points.
    Memory(Mutex<Kept>),
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

    fn put_both(&self, id: &str, point: KeptPoint, scene: impl FnOnce() -> io::Result<KeptScene>) -> io::Result<()> {
        match self {
            Self::Folder(folder, lock) => {
                let writing = lock.lock().unwrap_or_else(PoisonError::into_inner);
                // One that is there and damaged is written again: for ever in the way of --resume otherwise.
                if self.scene(&point.scene).is_none() {
                    write(&scene_path(folder, &point.scene), SCENE, &scene()?)?;
                }
                drop(writing);
                write(&point_path(folder, id), POINT, &point)
            }
            Self::Memory(kept) => {
                let (scenes, points) = &mut *open(kept);
                if !scenes.contains_key(&point.scene) {
                    scenes.insert(point.scene.clone(), scene()?);
                }
                points.insert(id.to_owned(), point);
                Ok(())
            }
        }
    }

    /// A point, if it is there and whole.
    pub(crate) fn point(&self, id: &str) -> Option<KeptPoint> {
        match self {
            Self::Folder(folder, _) => {
                checksum::decode(POINT, &read_own(&point_path(folder, id)).ok()?).filter(KeptPoint::is_sound)
            }
            Self::Memory(kept) => open(kept).1.get(id).cloned(),
        }
    }

    /// The scene of a point, by id, without reading the whole of it.
    pub(crate) fn scene_of(&self, id: &str) -> Option<String> {
        match self {
            Self::Folder(folder, _) => {
                let mut head = Vec::new();
                files::open(&point_path(folder, id)).ok()?.take(256).read_to_end(&mut head).ok()?;
                checksum::first_field(POINT, &head).filter(|scene: &String| is_id(scene))
            }
            Self::Memory(kept) => Some(open(kept).1.get(id)?.scene.clone()),
        }
    }

    /// A scene, if it is there and whole.
    pub(crate) fn scene(&self, id: &str) -> Option<KeptScene> {
        match self {
            Self::Folder(folder, _) => {
                checksum::decode(SCENE, &read_own(&scene_path(folder, id)).ok()?).filter(KeptScene::is_sound)
            }
            Self::Memory(kept) => open(kept).0.get(id).cloned(),
        }
    }

    /// Takes over what another sweep's folder holds of a point; false where it has nothing whole.
    pub(crate) fn adopt(&self, from: &Self, id: &str) -> io::Result<bool> {
        let Some(point) = from.point(id) else { return Ok(false) };
        let Some(scene) = from.scene(&point.scene) else { return Ok(false) };
        self.put_both(id, point, || Ok(scene)).map(|()| true)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const SCENE_ID: &str = "0123456789abcdef0123456789abcdef";

    fn scene() -> KeptScene {
        let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X * 0.5, DVec3::Y * 0.25], vec![[0, 1, 2]]);
        KeptScene { body: mesh.clone(), garment: mesh, distance_m: vec![0.5, 0.25, 0.125] }
    }

    fn point() -> KeptPoint {
        let (lower_cm, upper_cm) = (0.0, f64::INFINITY);
        KeptPoint {
            scene: SCENE_ID.to_owned(),
            levels: vec![LevelCount { level: 1, lower_cm, upper_cm, extent: None, vertices: 2, parts: 1 }],
            force_n: vec![DVec3::Z * -0.5],
            part_of_vertex: vec![0, 0, UNASSIGNED],
            positions: scene().garment.positions,
            error_mm: vec![0.5, 1.0, 2.0],
        }
    }

    #[test]
    fn what_is_kept_reads_back_and_a_truncated_scene_is_written_again() {
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
        assert_eq!(store.scene(SCENE_ID), Some(scene()), "--resume would fail for ever");
    }

    #[test]
    fn indices_that_point_nowhere_and_ids_that_are_paths_read_as_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let store = PointStore::in_folder(folder.path());
        let spoil: [fn(&mut KeptPoint); 6] = [
            |p| p.scene = "outside".to_owned(),
            |p| p.levels[0].level = 7,
            |p| p.levels[0].parts = 2,
            |p| p.part_of_vertex[0] = 3,
            |p| p.force_n.clear(),
            |p| p.error_mm.truncate(1),
        ];
        for (i, spoil) in spoil.into_iter().enumerate() {
            let mut spoilt = point();
            spoil(&mut spoilt);
            write(&point_path(folder.path(), "b"), POINT, &spoilt).unwrap();
            assert_eq!(store.point("b"), None, "{i}");
        }
        let outside = KeptPoint { scene: "../../outside".to_owned(), ..point() };
        write(&point_path(folder.path(), "b"), POINT, &outside).unwrap();
        assert_eq!((store.scene_of("b"), store.point("b")), (None, None));
        let mut far = scene();
        far.garment.triangles[0][2] = 3;
        write(&scene_path(folder.path(), SCENE_ID), SCENE, &far).unwrap();
        assert_eq!(store.scene(SCENE_ID), None);
    }
}
