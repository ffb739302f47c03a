//! What a recording holds: read back to test it, and to see that it was written to the end.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::Path;

use rerun::{ChunkStore, ChunkStoreConfig};

use super::error::RecordError;

/// What lies at one entity path.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Entity {
    /// Names of its components (`Mesh3D:vertex_positions`).
    pub components: BTreeSet<String>,
    /// Timelines it has rows on; none where all is static.
    pub timelines: BTreeSet<String>,
    /// Rows with a time.
    pub rows: usize,
    /// Rows without: logged once for all.
    pub fixed_rows: usize,
}

/// The contents of an `.rrd` file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contents {
    /// What lies at each path of the recording.
    pub entities: BTreeMap<String, Entity>,
    /// Paths of the blueprint.
    pub blueprint: BTreeSet<String>,
    /// Recordings in the file.
    pub recordings: usize,
}

/// Reads a recording.
///
/// # Errors
/// An unreadable file, or one that is no recording.
pub fn read(path: &Path) -> Result<Contents, RecordError> {
    let mut file = File::open(path).map_err(|source| RecordError::Unreadable { path: path.to_owned(), source })?;
    let stores = ChunkStore::from_rrd_reader(&ChunkStoreConfig::ALL_DISABLED, &mut file)
        .map_err(|e| RecordError::NotARecording { path: path.to_owned(), reason: format!("{e:#}") })?;
    let mut contents = Contents::default();
    for (id, store) in &stores {
        contents.recordings += usize::from(id.is_recording());
        for chunk in store.iter_physical_chunks() {
            let name = chunk.entity_path().to_string();
            if !id.is_recording() {
                contents.blueprint.insert(name);
                continue;
            }
            let entity = contents.entities.entry(name).or_default();
            let rows = if chunk.is_static() { &mut entity.fixed_rows } else { &mut entity.rows };
            *rows += chunk.num_rows();
            entity.timelines.extend(chunk.timelines().keys().map(ToString::to_string));
            entity.components.extend(chunk.components().keys().map(ToString::to_string));
        }
    }
    Ok(contents)
}
