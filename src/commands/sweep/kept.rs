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
use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use partwise::mesh::TriMesh;
use partwise::parts::UNASSIGNED;
use partwise::sealed::{self, Kind};
use partwise::sweep::is_id;
use partwise::whole_file::WholeFile;
use serde::{Deserialize, Serialize};

use super::single;

const POINT: &Kind = b"PWPOINT3";
const SCENE: &Kind = b"PWSCENE2";

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
    /// Lower and upper value of each level, cm.
    pub(crate) levels_cm: Vec<[f64; 2]>,
    /// Width and height each level's PARTs are cut to by the table, cm; zeros for a level without an extent of its own.
    pub(crate) extents_cm: Vec<[f64; 2]>,
    /// Level of each PART.
    pub(crate) level_of_part: Vec<u32>,
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
    /// Whether every index points at something: a file may be somebody else's.
    fn is_sound(&self) -> bool {
        let whole = |mesh: &TriMesh| mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < mesh.vertex_count());
        whole(&self.body) && whole(&self.garment) && self.distance_m.len() == self.garment.vertex_count()
    }
}

impl KeptPoint {
    /// Whether every index points at something, and the scene's id is one.
    fn is_sound(&self) -> bool {
        let parts = self.level_of_part.len();
        is_id(&self.scene)
            && self.extents_cm.len() == self.levels_cm.len()
            && self.level_of_part.iter().all(|&level| (level as usize) < self.levels_cm.len())
            && self.force_n.len() == parts
            && self.part_of_vertex.len() == self.positions.len()
            && self.part_of_vertex.iter().all(|&part| (part as usize) < parts || part == UNASSIGNED)
            && (self.error_mm.is_empty() || self.error_mm.len() == self.positions.len())
    }
}

/// Where points and scenes are kept.
#[derive(Debug)]
pub(crate) enum Shelf {
    /// In a sweep's folder.
    Folder(PathBuf),
    /// In memory, for a handful of points.
    Memory(Mutex<(BTreeMap<String, KeptScene>, BTreeMap<String, KeptPoint>)>),
}

impl Shelf {
    /// A shelf in memory.
    pub(crate) fn in_memory() -> Self {
        Self::Memory(Mutex::default())
    }

    /// A shelf in a sweep's folder; it is made with the first point.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self::Folder(folder.to_owned())
    }

    fn point_path(folder: &Path, id: &str) -> PathBuf {
        folder.join("points").join(format!("{id}.point"))
    }

    fn scene_path(folder: &Path, id: &str) -> PathBuf {
        folder.join("scenes").join(format!("{id}.scene"))
    }

    /// Keeps a point.
    pub(crate) fn put_point(&self, id: &str, point: KeptPoint) -> io::Result<()> {
        match self {
            Self::Folder(folder) => write(&Self::point_path(folder, id), POINT, &point),
            Self::Memory(kept) => {
                kept.lock().unwrap_or_else(PoisonError::into_inner).1.insert(id.to_owned(), point);
                Ok(())
            }
        }
    }

    /// Keeps a scene, unless it is there already.
    pub(crate) fn put_scene(&self, id: &str, scene: impl FnOnce() -> KeptScene) -> io::Result<()> {
        match self {
            Self::Folder(folder) => {
                // One that is there and damaged is written again: for ever in the way of --resume otherwise.
                let whole = self.scene(id).is_some();
                if whole { Ok(()) } else { write(&Self::scene_path(folder, id), SCENE, &scene()) }
            }
            Self::Memory(kept) => {
                kept.lock().unwrap_or_else(PoisonError::into_inner).0.entry(id.to_owned()).or_insert_with(scene);
                Ok(())
            }
        }
    }

    /// A point, if it is there and whole.
    pub(crate) fn point(&self, id: &str) -> Option<KeptPoint> {
        match self {
            Self::Folder(folder) => {
                sealed::open(POINT, &fs::read(Self::point_path(folder, id)).ok()?).filter(KeptPoint::is_sound)
            }
            Self::Memory(kept) => kept.lock().unwrap_or_else(PoisonError::into_inner).1.get(id).cloned(),
        }
    }

    /// The scene of a point, by id, without reading the whole of it.
    pub(crate) fn scene_of(&self, id: &str) -> Option<String> {
        match self {
            Self::Folder(folder) => {
                let mut head = Vec::new();
                let file = fs::File::open(Self::point_path(folder, id)).ok()?;
                file.take(256).read_to_end(&mut head).ok()?;
                sealed::peek(POINT, &head).filter(|scene: &String| is_id(scene))
            }
            Self::Memory(kept) => Some(kept.lock().unwrap_or_else(PoisonError::into_inner).1.get(id)?.scene.clone()),
        }
    }

    /// A scene, if it is there and whole.
    pub(crate) fn scene(&self, id: &str) -> Option<KeptScene> {
        match self {
            Self::Folder(folder) => {
                sealed::open(SCENE, &fs::read(Self::scene_path(folder, id)).ok()?).filter(KeptScene::is_sound)
            }
            Self::Memory(kept) => kept.lock().unwrap_or_else(PoisonError::into_inner).0.get(id).cloned(),
        }
    }

    /// Takes over what another sweep's folder holds of a point; false where it has nothing whole.
    pub(crate) fn adopt(&self, from: &Self, id: &str) -> io::Result<bool> {
        let Some(point) = from.point(id) else { return Ok(false) };
        let Some(scene) = from.scene(&point.scene) else { return Ok(false) };
        self.put_scene(&point.scene, || scene)?;
        self.put_point(id, point)?;
        Ok(true)
    }
}

fn write(path: &Path, kind: &Kind, value: &impl Serialize) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    WholeFile::write(path, sealed::seal(kind, value)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE_ID: &str = "0123456789abcdef0123456789abcdef";

    fn scene() -> KeptScene {
        let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X * 0.5, DVec3::Y * 0.25], vec![[0, 1, 2]]);
        KeptScene { body: mesh.clone(), garment: mesh, distance_m: vec![0.5, 0.25, 0.125] }
    }

    fn point() -> KeptPoint {
        KeptPoint {
            scene: SCENE_ID.to_owned(),
            levels_cm: vec![[0.0, f64::INFINITY]],
            extents_cm: vec![[0.0; 2]],
            level_of_part: vec![0],
            force_n: vec![DVec3::Z * -0.5],
            part_of_vertex: vec![0, 0, UNASSIGNED],
            positions: scene().garment.positions,
            error_mm: vec![0.5, 1.0, 2.0],
        }
    }

    #[test]
    fn what_is_kept_reads_back_and_a_truncated_scene_is_written_again() {
        let folder = tempfile::tempdir().unwrap();
        let shelf = Shelf::in_folder(folder.path());
        shelf.put_scene(SCENE_ID, scene).unwrap();
        shelf.put_point("a", point()).unwrap();
        assert_eq!((shelf.scene(SCENE_ID), shelf.point("a")), (Some(scene()), Some(point())));
        assert_eq!(shelf.scene_of("a").as_deref(), Some(SCENE_ID));
        let path = Shelf::scene_path(folder.path(), SCENE_ID);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert_eq!(shelf.scene(SCENE_ID), None);
        shelf.put_scene(SCENE_ID, scene).unwrap();
        assert_eq!(shelf.scene(SCENE_ID), Some(scene()), "--resume would fail for ever");
    }

    #[test]
    fn indices_that_point_nowhere_and_ids_that_are_paths_read_as_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let shelf = Shelf::in_folder(folder.path());
        let spoil: [fn(&mut KeptPoint); 5] = [
            |p| p.scene = "../../outside".to_owned(),
            |p| p.level_of_part = vec![7],
            |p| p.part_of_vertex[0] = 3,
            |p| p.force_n.clear(),
            |p| p.error_mm.truncate(1),
        ];
        for (i, spoil) in spoil.into_iter().enumerate() {
            let mut spoilt = point();
            spoil(&mut spoilt);
            shelf.put_point("b", spoilt).unwrap();
            assert_eq!(shelf.point("b"), None, "{i}");
        }
        shelf.put_point("b", KeptPoint { scene: "../../outside".to_owned(), ..point() }).unwrap();
        assert_eq!(shelf.scene_of("b"), None);
        let mut far = scene();
        far.garment.triangles[0][2] = 3;
        shelf.put_scene(SCENE_ID, || far).unwrap();
        assert_eq!(shelf.scene(SCENE_ID), None);
    }
}
