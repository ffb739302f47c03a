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

use super::packed::{Packer, Unpacker};

const POINT: &[u8; 8] = b"PWPOINT2";
const SCENE: &[u8; 8] = b"PWSCENE1";

/// Body and garment as a recording shows them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KeptScene {
    /// The body, m.
    pub(crate) body: TriMesh,
    /// The garment, undraped, m.
    pub(crate) garment: TriMesh,
    /// Unsigned distance of each garment vertex to the body, m.
    pub(crate) distance_m: Vec<f64>,
}

/// One point as a recording shows it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KeptPoint {
    /// Id of its scene.
    pub(crate) scene: String,
    /// Lower and upper value of each level, cm.
    pub(crate) levels_cm: Vec<[f64; 2]>,
    /// Width and height each level's PARTs are cut to by the table, cm; zeros for a level without an extent of its own.
    pub(crate) extents_cm: Vec<[f64; 2]>,
    /// Level of each PART.
    pub(crate) level_of_part: Vec<u32>,
    /// Resultant force on each PART, N.
    pub(crate) force_n: Vec<DVec3>,
    /// PART of each vertex.
    pub(crate) part_of_vertex: Vec<u32>,
    /// The displaced garment, m.
    pub(crate) positions: Vec<DVec3>,
    /// Distance of each vertex to the reference drape, mm; empty where nobody asked.
    pub(crate) error_mm: Vec<f64>,
}

impl KeptPoint {
    fn pack(&self) -> Packer {
        let mut packer = Packer::new(POINT);
        packer.text(&self.scene);
        packer.doubles(self.levels_cm.as_flattened());
        packer.doubles(self.extents_cm.as_flattened());
        packer.whole(&self.level_of_part);
        packer.points(&self.force_n);
        packer.whole(&self.part_of_vertex);
        packer.points(&self.positions);
        packer.singles(&self.error_mm);
        packer
    }

    fn unpack(bytes: &[u8]) -> Option<Self> {
        let mut unpacker = Unpacker::new(bytes, POINT)?;
        Some(Self {
            scene: unpacker.text()?,
            levels_cm: unpacker.doubles()?.as_chunks().0.to_vec(),
            extents_cm: unpacker.doubles()?.as_chunks().0.to_vec(),
            level_of_part: unpacker.whole()?,
            force_n: unpacker.points()?,
            part_of_vertex: unpacker.whole()?,
            positions: unpacker.points()?,
            error_mm: unpacker.singles()?,
        })
    }
}

impl KeptScene {
    fn pack(&self) -> Packer {
        let mut packer = Packer::new(SCENE);
        for mesh in [&self.body, &self.garment] {
            packer.points(&mesh.positions);
            packer.triples(&mesh.triangles);
        }
        packer.singles(&self.distance_m);
        packer
    }

    fn unpack(bytes: &[u8]) -> Option<Self> {
        let mut unpacker = Unpacker::new(bytes, SCENE)?;
        let mut mesh = || Some(TriMesh::new(unpacker.points()?, unpacker.triples()?));
        let (body, garment) = (mesh()?, mesh()?);
        Some(Self { body, garment, distance_m: unpacker.singles()? })
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
            Self::Folder(folder) => write(&Self::point_path(folder, id), point.pack()),
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
                let path = Self::scene_path(folder, id);
                if path.exists() { Ok(()) } else { write(&path, scene().pack()) }
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
            Self::Folder(folder) => KeptPoint::unpack(&fs::read(Self::point_path(folder, id)).ok()?),
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
                Unpacker::unchecked(&head, POINT)?.text()
            }
            Self::Memory(kept) => Some(kept.lock().unwrap_or_else(PoisonError::into_inner).1.get(id)?.scene.clone()),
        }
    }

    /// A scene, if it is there and whole.
    pub(crate) fn scene(&self, id: &str) -> Option<KeptScene> {
        match self {
            Self::Folder(folder) => KeptScene::unpack(&fs::read(Self::scene_path(folder, id)).ok()?),
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

fn write(path: &Path, packer: Packer) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    packer.write(path).map(|_| ())
}
