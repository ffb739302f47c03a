//! Disk cache of built-in meshes: making a form and a garment takes a second, reading them a few milliseconds.
//!
//! The name of an entry is the hash of everything that determines the mesh: the specs as JSON (numbers with digits that parse to the
//! same bits), the version of the crate, and the architecture of the machine, which may round differently. An entry contains a
//! checksum and the hashed text, and is written atomically. If an entry or its folder is damaged, the mesh is computed again, with the
//! same bits.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::builtin::{GarmentSpec, PlacedGarment, garment};
use crate::base::checksum::{self, Tag};
use crate::base::files::{read_own, user_cache};
use crate::body::ShapeError;
use crate::body::dress_form::{BodySpec, DEFAULT_TRIANGLES, dress_form};
use crate::mesh::{RestShape, TriMesh};

/// First bytes of an entry, and part of every name. The number rises with the format and with every change of the mesher's
/// results, so that an older mesh is never used for a newer one.
const TAG: &Tag = b"PWMESH03";
/// Most entries, the newest: a sweep over measurements makes a form for each.
const MAX_ENTRIES: usize = 64;

/// Positions, triangles, groups and their triangles; rest corners and held vertices, of a garment.
type Stored = (Vec<DVec3>, Vec<[u32; 3]>, Vec<String>, Vec<u32>, Vec<[DVec2; 3]>, Vec<u32>);

/// A folder of cached meshes, or none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MeshCache(Option<PathBuf>);

impl MeshCache {
    /// A cache in `folder`, which is created with the first entry.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self(Some(folder.into()))
    }

    /// The user's cache (`meshes`, beside the references); none where the user has no home folder.
    #[must_use]
    pub fn in_user_cache() -> Self {
        Self(user_cache("meshes"))
    }

    /// [`dress_form`], cached.
    pub fn dress_form(&self, spec: &BodySpec) -> Result<TriMesh, ShapeError> {
        let make = || {
            let (mesh, rest) = (dress_form(spec)?, RestShape::new(Vec::new()));
            Ok(PlacedGarment { name: String::new(), mesh, rest, held: Vec::new() })
        };
        Ok(self.get_or_make(&("form", spec, DEFAULT_TRIANGLES), make)?.mesh)
    }

    /// [`garment`], cached.
    pub fn garment(
        &self,
        spec: &GarmentSpec,
        body: &BodySpec,
        vertices: Option<usize>,
    ) -> Result<PlacedGarment, ShapeError> {
        let made = self.get_or_make(&("garment", spec, body, vertices), || garment(spec, body, vertices))?;
        Ok(PlacedGarment { name: spec.name.clone(), ..made })
    }

    fn get_or_make(
        &self,
        of: &impl Serialize,
        make: impl FnOnce() -> Result<PlacedGarment, ShapeError>,
    ) -> Result<PlacedGarment, ShapeError> {
        let (Some(folder), Ok(of)) = (&self.0, serde_json::to_string(of)) else { return make() };
        let of = format!("{} {} {of}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
        let path = folder.join(format!("{}.mesh", checksum::hash(TAG, &of).to_hex()));
        let found = read_own(&path).ok().and_then(|bytes| checksum::decode::<(String, Stored)>(TAG, &bytes));
        if let Some((found_of, stored)) = found
            && found_of == of
        {
            return Ok(unpack(stored));
        }
        let made = make()?;
        // A mesh that cannot be stored is made again the next time.
        let _ = store(folder, &path, &of, &made);
        Ok(made)
    }
}

fn store(folder: &Path, path: &Path, of: &str, made: &PlacedGarment) -> std::io::Result<()> {
    let PlacedGarment { mesh, rest, held, .. } = made;
    let stored = (&mesh.positions, &mesh.triangles, &mesh.groups, &mesh.triangle_group, &rest.corners, held);
    checksum::write(path, TAG, &(of, stored))?;
    let mut kept: Vec<(SystemTime, PathBuf)> = std::fs::read_dir(folder)?
        .filter_map(|entry| entry.ok().filter(|e| e.path().extension().is_some_and(|ending| ending == "mesh")))
        .filter_map(|entry| Some((entry.metadata().ok()?.modified().ok()?, entry.path())))
        .collect();
    kept.sort();
    kept.iter().rev().skip(MAX_ENTRIES).try_for_each(|(_, path)| std::fs::remove_file(path))
}

fn unpack((positions, triangles, groups, triangle_group, corners, held): Stored) -> PlacedGarment {
    let mesh = TriMesh { positions, triangles, groups, triangle_group };
    PlacedGarment { name: String::new(), mesh, rest: RestShape::new(corners), held }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A skirt of as few vertices as possible.
    fn skirt(cache: &MeshCache) -> PlacedGarment {
        let spec = GarmentSpec::by_name("flared-skirt").unwrap();
        cache.garment(&spec, &BodySpec::default(), Some(400)).unwrap()
    }

    fn entries(folder: &Path) -> Vec<PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    }

    #[test]
    fn a_cached_mesh_equals_the_made_one_and_a_damaged_entry_is_made_anew() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::new(folder.path().join("meshes"));
        let made = skirt(&MeshCache::default());
        assert_eq!([skirt(&cache), skirt(&cache)], [made.clone(), made.clone()]);
        let [entry] = entries(&folder.path().join("meshes")).try_into().unwrap();
        // Whether an entry is read at all shows by one that holds another mesh under the right text.
        let whole = std::fs::read(&entry).unwrap();
        let (of, mut stored) = checksum::decode::<(String, Stored)>(TAG, &whole).unwrap();
        stored.0[0].x = 9.0;
        let other = checksum::encode(TAG, &(&of, &stored)).unwrap();
        std::fs::write(&entry, &other).unwrap();
        assert_eq!(skirt(&cache).mesh.positions[0].x, 9.0);
        let mut flipped = other.clone();
        flipped[200] ^= 1;
        let foreign = checksum::encode(TAG, &(format!("{of} "), &stored)).unwrap();
        for damaged in [&flipped[..], &other[..300], b"", b"PWMESH03 and more", &foreign[..]] {
            std::fs::write(&entry, damaged).unwrap();
            assert_eq!(skirt(&cache), made);
            assert_eq!(std::fs::read(&entry).unwrap(), whole, "it is kept anew");
        }
    }

    #[test]
    fn an_unwritable_folder_is_ignored_and_old_entries_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let made = skirt(&MeshCache::default());
        // A file in the place of the folder, so that no entry can be written.
        std::fs::write(folder.path().join("file"), "").unwrap();
        assert_eq!(skirt(&MeshCache::new(folder.path().join("file"))), made);
        assert_eq!(skirt(&MeshCache::new(folder.path().join("file/below"))), made);
        // The folder of an entry where the entry should be.
        let cache = MeshCache::new(folder.path().join("meshes"));
        skirt(&cache);
        let [entry] = entries(&folder.path().join("meshes")).try_into().unwrap();
        std::fs::remove_file(&entry).unwrap();
        std::fs::create_dir(&entry).unwrap();
        assert_eq!(skirt(&cache), made);
        std::fs::remove_dir(&entry).unwrap();
        for i in 0..MAX_ENTRIES + 3 {
            std::fs::write(folder.path().join(format!("meshes/{i}.mesh")), "").unwrap();
        }
        skirt(&cache);
        let left = entries(&folder.path().join("meshes"));
        assert!(left.len() == MAX_ENTRIES && left.contains(&entry), "{}", left.len());
    }

    #[test]
    fn two_threads_make_one_entry() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::new(folder.path());
        let both = std::thread::scope(|scope| {
            let both = [0, 1].map(|_| scope.spawn(|| skirt(&cache)));
            both.map(|made| made.join().unwrap())
        });
        assert_eq!(both[0], both[1]);
        assert_eq!(entries(folder.path()).len(), 1);
    }
}
