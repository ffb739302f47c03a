//! Cache of reference drapes on disk.
//!
//! The key of a reference is the BLAKE3 hash of everything it depends on: the crate's version and the file format's, the
//! garment's positions and triangles, the rest shape, the fabric, the body, the held vertices, the start and the solver's
//! options, serialised by postcard: numbers by their bits, lists with their lengths, so that different inputs have
//! different keys.
//!
//! A file holds the key and the reference with a checksum and is written atomically. A file that does not match its
//! checksum, its key or its garment is no error: the reference is computed again, with a warning.

use std::path::PathBuf;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::checksum::{self, Tag};
use crate::base::files::{read_own, user_cache};
use crate::garment::fabric::Fabric;
use crate::mesh::{RestShape, TriMesh};

/// First bytes of a file, and part of every key. Increment the digit with each change of the format or of the mechanics, so
/// that a drape of an older solver does not serve as reference of a newer one.
const KIND: &Tag = b"PWREF\x005\n";

/// All inputs of a reference.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReferenceInput<'a> {
    /// The garment.
    pub garment: &'a TriMesh,
    /// Its rest shape.
    pub rest: &'a RestShape,
    /// Its fabrics.
    pub fabrics: &'a [Fabric],
    /// The body.
    pub body: &'a TriMesh,
    /// Held vertices.
    pub held: &'a [u32],
    /// Start positions, m.
    pub start: &'a [DVec3],
    /// The solver's options, written out in full.
    pub options: &'a str,
}

/// Hash of the inputs of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReferenceKey(blake3::Hash);

impl ReferenceKey {
    /// Hashes all inputs of a reference.
    pub(crate) fn new(input: &ReferenceInput<'_>) -> Self {
        fn mesh(mesh: &TriMesh) -> (&[DVec3], &[[u32; 3]]) {
            (&mesh.positions, &mesh.triangles)
        }
        // The name of a fabric does not affect the result.
        let nameless = |fabric: &Fabric| Fabric { name: String::new(), source: String::new(), ..fabric.clone() };
        let fabrics: Vec<Fabric> = input.fabrics.iter().map(nameless).collect();
        let (version, rest) = (env!("CARGO_PKG_VERSION"), &input.rest.corners);
        let solve = (mesh(input.body), input.start, input.options);
        if let [fabric] = &fabrics[..] {
            let cloth = (mesh(input.garment), rest, fabric, input.held);
            return Self(checksum::hash(KIND, &(version, cloth, solve)));
        }
        let cloth = (mesh(input.garment), rest, (&input.rest.cut_from, fabrics), input.held);
        Self(checksum::hash(KIND, &(version, cloth, solve)))
    }

    /// File name in the cache.
    pub(crate) fn file_name(&self) -> String {
        format!("{}.drape", self.0.to_hex())
    }
}

/// A converged drape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Reference {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Energy, J.
    pub energy_j: f64,
    /// Residual force over weight.
    pub residual_over_weight: f64,
    /// Steps it took.
    pub steps: u64,
    /// Seconds it took when it was computed.
    pub seconds: f64,
}

/// A reference, from disk or computed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    /// The reference.
    pub reference: Reference,
    /// Whether the reference was read from disk.
    pub cached: bool,
    /// Failures of the disk; they do not stop the computation.
    pub warnings: Vec<String>,
}

/// A directory of references.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReferenceCache {
    directory: PathBuf,
}

impl ReferenceCache {
    /// A cache in `directory`, which is created with the first file.
    #[must_use]
    pub fn new(directory: impl Into<PathBuf>) -> Self {
        Self { directory: directory.into() }
    }

    /// The folder `references` of the user's cache ([`user_cache`]); `None` without a home folder.
    pub(crate) fn in_user_cache() -> Option<Self> {
        user_cache("references").map(Self::new)
    }

    /// Reads the reference of `key` for a garment of `vertices` from disk, or computes and writes it.
    ///
    /// # Errors
    /// Errors of `compute`. Failures of the disk are warnings.
    pub(crate) fn get_or_compute<E>(
        &self,
        key: &ReferenceKey,
        vertices: usize,
        compute: impl FnOnce() -> Result<Reference, E>,
    ) -> Result<Found, E> {
        let path = self.directory.join(key.file_name());
        let mut warnings = Vec::new();
        match read_own(&path) {
            Ok(bytes) => match checksum::decode::<([u8; blake3::OUT_LEN], Reference)>(KIND, &bytes) {
                Some((of, reference)) if of == *key.0.as_bytes() && reference.positions.len() == vertices => {
                    return Ok(Found { reference, cached: true, warnings });
                }
                _ => {
                    warnings.push(format!("a cached reference is damaged and was computed again: {}", path.display()));
                }
            },
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => warnings.push(format!("a cached reference cannot be read ({e}): {}", path.display())),
        }
        let reference = compute()?;
        if let Err(e) = checksum::write(&path, KIND, &(key.0.as_bytes(), &reference)) {
            warnings.push(format!("the reference cannot be kept for the next run ({e}): {}", path.display()));
        }
        Ok(Found { reference, cached: false, warnings })
    }
}
