//! References on disk: a converged drape is paid for once.
//!
//! The key of a reference is the BLAKE3 hash of everything it depends on: the crate's version and the file format's, the
//! garment's positions and triangles, the rest shape, the fabric, the body, the held vertices, the start and the solver's
//! options, as [`sealed`] bytes: numbers by their bits, lists with their lengths, so two inputs never share a key.
//!
//! A file is the key and the reference, [`sealed`]. It is written whole or not at all, so a reader never sees
//! half of one. A file that does not match its hash, its key or its garment is no error: the reference is computed again,
//! and the caller gets a warning to show.

use std::path::PathBuf;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::checksum::{self, Kind};
use crate::base::files::{read_own, user_cache};
use crate::garment::fabric::Fabric;
use crate::mesh::{RestShape, TriMesh};

/// First bytes of a file, and part of every key; the digit goes up with the format and with the mechanics, so that a drape
/// of an older solver is never taken for the reference of a newer one.
const KIND: &Kind = b"PWREF\x004\n";

/// What a reference depends on.
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
    /// Vertices that do not move.
    pub held: &'a [u32],
    /// Where the solve starts, m.
    pub start: &'a [DVec3],
    /// The solver's options, written out in full.
    pub options: &'a str,
}

/// The name of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReferenceKey(blake3::Hash);

impl ReferenceKey {
    /// Hashes everything a reference depends on.
    #[must_use]
    pub(crate) fn new(input: &ReferenceInput<'_>) -> Self {
        fn mesh(mesh: &TriMesh) -> (&[DVec3], &[[u32; 3]]) {
            (&mesh.positions, &mesh.triangles)
        }
        // What a fabric is called changes nothing.
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
    #[must_use]
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

/// A reference and how it was come by.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    /// The reference.
    pub reference: Reference,
    /// Whether it was on disk.
    pub cached: bool,
    /// What went wrong with the disk, if anything: worth showing, not worth stopping for.
    pub warnings: Vec<String>,
}

/// A directory of references.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReferenceCache {
    directory: PathBuf,
}

impl ReferenceCache {
    /// References in `directory`, which is made when the first is written.
    #[must_use]
    pub fn new(directory: impl Into<PathBuf>) -> Self {
        Self { directory: directory.into() }
    }

    /// `references` in the user's cache ([`user_cache`]); `None` where the user has no home.
    #[must_use]
    pub(crate) fn in_user_cache() -> Option<Self> {
        user_cache("references").map(Self::new)
    }

    /// The reference of `key` for a garment of `vertices`: from disk, or else computed and kept.
    ///
    /// # Errors
    /// Whatever `compute` fails with; the disk's failures are warnings.
    pub(crate) fn get_or_compute<E>(
        &self,
        key: &ReferenceKey,
        vertices: usize,
        compute: impl FnOnce() -> Result<Reference, E>,
    ) -> Result<Found, E> {
        let path = self.directory.join(key.file_name());
        let mut warnings = Vec::new();
        match read_own(&path) {
            Ok(bytes) => match checksum::open::<([u8; blake3::OUT_LEN], Reference)>(KIND, &bytes) {
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
