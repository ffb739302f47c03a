//! A body in several poses: files of the same vertices and faces, read one by one, and the garment carried from each to the next.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::carry::Motion;
use super::spec::SceneSpec;
use super::{Scene, SceneError};
use crate::base::files::{has_ending, stem};
use crate::body::distance::push_out::push_out;
use crate::body::distance::{Body, pull_off_protrusions};
use crate::garment::MeshCache;
use crate::mesh::import::{ImportOptions, Imported, import_body};
use crate::mesh::{MeshError, TriMesh};

/// Endings of the files in a folder that are bodies.
const BODIES: [&str; 6] = ["obj", "ply", "stl", "glb", "gltf", "npz"];

/// Distance from the body, m, of carried vertices that would lie inside it: the solver starts without contact there.
const CLEARANCE: f64 = 1e-3;

/// Reads the poses of a body.
#[derive(Debug)]
pub(crate) struct PoseReader {
    /// The first pose as it was read; `None` for the built-in form.
    first: Option<Imported>,
    body: TriMesh,
    options: ImportOptions,
    open: bool,
    name: String,
}

impl PoseReader {
    /// A reader of poses of the body of `spec`.
    ///
    /// # Errors
    /// [`SceneError`] about that body.
    pub(crate) fn new(spec: &SceneSpec, meshes: &MeshCache) -> Result<Self, SceneError> {
        let (body, first) = spec.load_body(meshes)?;
        // The guesses of the first pose hold for all: a body that crouches is not smaller.
        let frame = first.as_ref().map(|first| first.report.frame.clone()).unwrap_or_default();
        let options = ImportOptions { unit: Some(frame.unit), up: Some(frame.up), ..spec.body_options() };
        Ok(Self { first, body: body.mesh().clone(), options, open: spec.open_body, name: spec.body.clone() })
    }

    /// The body in the pose of a file.
    ///
    /// # Errors
    /// [`SceneError`]: a file that cannot be read, or that has other vertices or faces than the first pose.
    pub(crate) fn read(&self, file: &Path) -> Result<Body, SceneError> {
        let options = ImportOptions { source: None, ..self.options.clone() };
        let pose = import_body(file, &options)?;
        let counts =
            |mesh: &TriMesh| format!("{} vertices and {} triangles", mesh.vertex_count(), mesh.triangles.len());
        let [found, expected] = [&pose.mesh, &self.body].map(counts);
        if found != expected {
            let (file, other) = (file.to_owned(), PathBuf::from(&self.name));
            return Err(
                MeshError::OtherTopology { file, other, difference: format!("{found}, expected {expected}") }.into()
            );
        }
        let mesh = match &self.first {
            Some(first) => first.in_the_shape_of(&pose)?,
            None => self.body.with_positions(pose.positions_of(&self.body.triangles, &self.name)?),
        };
        Ok(if self.open { Body::new_open(&mesh)? } else { Body::new(&mesh)? })
    }
}

/// The poses that a path names: the files of a folder in the order of their numbers, or the file itself.
///
/// # Errors
/// [`SceneError`] for a folder that cannot be read or has no body.
pub(crate) fn pose_files(path: &str) -> Result<Vec<PathBuf>, SceneError> {
    let path = Path::new(path);
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let unreadable = |source| SceneError::PoseFolder { folder: path.to_owned(), source };
    let entries = std::fs::read_dir(path).map_err(unreadable)?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, _>>().map_err(unreadable)?;
    files.retain(|file| file.is_file() && BODIES.iter().any(|ending| has_ending(file, ending)));
    files.sort_by(|a, b| by_numbers(&stem(&a.to_string_lossy()), &stem(&b.to_string_lossy())).then(a.cmp(b)));
    if files.is_empty() {
        return Err(SceneError::NoPoses { folder: path.to_owned() });
    }
    Ok(files)
}

/// Compares names with the numbers in them by value: `pose2` before `pose10`.
fn by_numbers(a: &str, b: &str) -> Ordering {
    let pieces = |text: &str| -> Vec<(String, u128)> {
        let same = |a: &char, b: &char| a.is_ascii_digit() == b.is_ascii_digit();
        let letters: Vec<char> = text.chars().collect();
        let piece = |piece: &[char]| {
            let text: String = piece.iter().collect();
            text.parse().map_or((text, 0), |number| (String::new(), number))
        };
        letters.chunk_by(same).map(piece).collect()
    };
    pieces(a).cmp(&pieces(b))
}

impl Scene {
    /// The scene with `body`, its own body in another pose with the same vertices and faces, and the garment carried there from `draped` (m), where it lies on this scene's body.
    /// Vertices that come to lie inside the body are pushed out.
    #[must_use]
    pub fn in_pose(&self, body: Body, draped: &[DVec3]) -> Self {
        let motion = Motion::new(self.body.mesh(), &body.mesh().positions);
        let carried = self.garment.with_positions(motion.carry(draped));
        let (mut garment, _) = push_out(&carried, &body, CLEARANCE);
        if let Some(pulled) = pull_off_protrusions(&body, &garment, &self.is_held()) {
            garment.positions = pulled;
        }
        Self { body, garment, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_sort_by_value() {
        let mut names = ["pose10", "pose2", "b", "pose2b", "a12", "pose02"];
        names.sort_by(|a, b| by_numbers(a, b));
        assert_eq!(names, ["a12", "b", "pose2", "pose02", "pose2b", "pose10"]);
    }

    #[test]
    fn a_folder_lists_its_bodies_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().display().to_string();
        assert!(pose_files(&path).unwrap_err().to_string().contains("no body"));
        for name in ["10.obj", "9.obj", "notes.txt"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = pose_files(&path).unwrap();
        assert_eq!(found, ["9.obj", "10.obj"].map(|name| folder.path().join(name)));
    }
}
