//! The contents of a recording, read back.

#![allow(dead_code, reason = "each test reads some of the fields")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::Path;

use rerun::{ChunkStore, ChunkStoreConfig};

/// The data at one entity path.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Entity {
    /// Names of its components (`Mesh3D:vertex_positions`).
    pub(crate) components: BTreeSet<String>,
    /// Timelines of its rows; none where all data are static.
    pub(crate) timelines: BTreeSet<String>,
    /// Rows with a time.
    pub(crate) rows: usize,
    /// Static rows.
    pub(crate) fixed_rows: usize,
}

/// The contents of an `.rrd` file.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Contents {
    /// The data at each path of the recording.
    pub(crate) entities: BTreeMap<String, Entity>,
    /// Names of the components at each path of the blueprint.
    pub(crate) blueprint: BTreeMap<String, BTreeSet<String>>,
    /// Recordings in the file.
    pub(crate) recordings: usize,
}

/// Reads a recording.
pub(crate) fn read(path: &Path) -> Contents {
    let mut file = File::open(path).unwrap();
    let stores = ChunkStore::from_rrd_reader(&ChunkStoreConfig::ALL_DISABLED, &mut file).unwrap();
    let mut contents = Contents::default();
    for (id, store) in &stores {
        contents.recordings += usize::from(id.is_recording());
        for chunk in store.iter_physical_chunks() {
            let name = chunk.entity_path().to_string();
            let components = chunk.components().keys().map(ToString::to_string);
            if !id.is_recording() {
                contents.blueprint.entry(name).or_default().extend(components);
                continue;
            }
            let entity = contents.entities.entry(name).or_default();
            let rows = if chunk.is_static() { &mut entity.fixed_rows } else { &mut entity.rows };
            *rows += chunk.num_rows();
            entity.timelines.extend(chunk.timelines().keys().map(ToString::to_string));
            entity.components.extend(components);
        }
    }
    contents
}
