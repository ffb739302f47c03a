//! The rows of a sweep on disk, one folder per sweep or shard.
//!
//! | file | contents |
//! |---|---|
//! | `plan.json` | identity of the sweep ([`Manifest`]) |
//! | `rows.jsonl` | one line per row, appended and synced after every point; the other files derive from it |
//! | `rows.csv` | the same rows as a table, written on resume and at the end |
//! | `lock` | locked by the writing process; the operating system releases it at the end of the process |
//!
//! While a sweep runs, lines are in the order in which points finish; at the end one rename puts them into the order of the plan.
//! An incomplete last line (killed process, full disk) is dropped on resume and its point computed again. An invalid line before
//! valid ones cannot result from a crash and is an error. By default, a resumed sweep computes failed points again, because lack of
//! memory or disk space may have been the cause.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::disk::{self, Journal, make, take_lock};
use super::manifest::MANIFEST;
use super::row::json_line;
use super::{Manifest, Medium, Row, Status, StoreError, csv_text};

/// Name of the JSON lines in a sweep's folder.
pub(crate) const JSON_LINES: &str = "rows.jsonl";
/// Name of the CSV in a sweep's folder.
pub(crate) const CSV: &str = "rows.csv";
const LOCK: &str = "lock";

/// Treatment of existing rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Existing {
    /// Existing rows are an error.
    #[default]
    Refuse,
    /// Points with a row are skipped. A folder without rows is allowed.
    Resume {
        /// Compute failed points again.
        retry_failed: bool,
        /// If the rows belong to another plan, keep the rows of the common points instead of refusing.
        adopt: bool,
    },
}

/// The rows of one sweep, open for writing.
pub struct Store {
    /// The identity of the sweep.
    pub(crate) manifest: Manifest,
    folder: PathBuf,
    /// The rows so far, in the order of writing.
    pub(crate) rows: Vec<Row>,
    done: Vec<bool>,
    journal: Journal,
    _lock: File,
}

impl Store {
    /// Opens the folder for the rows of `manifest`; creates it if it does not exist.
    pub fn open(folder: &Path, manifest: Manifest, existing: Existing) -> Result<Self, StoreError> {
        Self::open_on(folder, manifest, existing, &|file| Box::new(file))
    }

    /// As [`open`](Self::open), with `medium` between the journal and its file.
    pub(crate) fn open_on(
        folder: &Path,
        manifest: Manifest,
        existing: Existing,
        medium: &Medium<'_>,
    ) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(StoreError::io(folder, "cannot be made a folder"))?;
        let lock = take_lock(&folder.join(LOCK))?;
        let rows = match Manifest::read(folder)? {
            None if disk::read_if_there(&folder.join(JSON_LINES))?.is_some_and(|bytes| !bytes.is_empty()) => {
                return Err(StoreError::Orphans { path: folder.join(JSON_LINES) });
            }
            None => Vec::new(),
            Some(found) => left_over(folder, &found, &manifest, existing)?,
        };
        let lines = folder.join(JSON_LINES);
        // Rows are replaced before the manifest: a crash in between leaves the old plan with fewer rows.
        make(&lines, &json_text(&rows))?;
        manifest.write(folder)?;
        make(&folder.join(CSV), &csv_text(&rows))?;
        let mut done = vec![false; manifest.points.len()];
        for row in &rows {
            done[row.index] = true;
        }
        let journal = Journal::open(lines, medium)?;
        Ok(Self { manifest, folder: folder.to_owned(), rows, done, journal, _lock: lock })
    }

    /// Whether the point of this number is in the shard and has no row yet.
    pub(crate) fn lacks(&self, point: usize) -> bool {
        self.manifest.holds(point) && self.done.get(point) == Some(&false)
    }

    /// Appends a row and returns once it is on disk.
    ///
    /// # Errors
    /// [`StoreError::Write`]; all earlier rows stay intact. A second row for a point is [`StoreError::Damaged`].
    pub fn append(&mut self, row: Row) -> Result<(), StoreError> {
        if !self.lacks(row.index) || self.manifest.points[row.index].id != row.point {
            let (path, line) = (self.journal.path.clone(), self.rows.len() + 1);
            return Err(StoreError::Damaged { path, line, message: format!("point {} was not asked for", row.index) });
        }
        self.journal.append(&json_line(&row), self.rows.len())?;
        self.done[row.index] = true;
        self.rows.push(row);
        Ok(())
    }

    /// Adds many rows in one atomic write, for `merge`.
    pub(super) fn extend(&mut self, rows: Vec<Row>) -> Result<(), StoreError> {
        self.rows.extend(rows);
        disk::replace(&self.journal.path, &json_text(&self.rows))
    }

    /// Puts the lines into the order of the plan and writes the CSV. Files that are up to date are not written.
    ///
    /// # Errors
    /// [`StoreError::Io`]; the rows are unchanged then.
    pub(crate) fn finish(mut self) -> Result<Vec<Row>, StoreError> {
        self.rows.sort_by_key(|r| r.index);
        make(&self.journal.path, &json_text(&self.rows))?;
        make(&self.folder.join(CSV), &csv_text(&self.rows))?;
        Ok(self.rows)
    }
}

/// The manifest and rows of a folder, without taking its lock; an incomplete last line is left out.
pub(crate) fn read(folder: &Path) -> Result<(Manifest, Vec<Row>), StoreError> {
    let manifest = Manifest::read(folder)?.ok_or_else(|| StoreError::Missing { path: folder.join(MANIFEST) })?;
    let rows = read_rows(&folder.join(JSON_LINES), &manifest)?;
    Ok((manifest, rows))
}

/// The rows that a resumed sweep keeps.
fn left_over(folder: &Path, found: &Manifest, wanted: &Manifest, how: Existing) -> Result<Vec<Row>, StoreError> {
    let path = folder.join(JSON_LINES);
    let mut rows = read_rows(&path, found)?;
    let Existing::Resume { retry_failed, adopt } = how else {
        if rows.is_empty() {
            return Ok(rows);
        }
        return Err(StoreError::Exists { path, rows: rows.len() });
    };
    if (&found.plan, &found.partwise, found.shard) != (&wanted.plan, &wanted.partwise, wanted.shard) {
        if !adopt && !rows.is_empty() {
            let (found, expected) = (found.identity(), wanted.identity());
            return Err(StoreError::OtherPlan { path: folder.join(MANIFEST), found, expected });
        }
        // A point with another label is computed again, because its row would keep the old label.
        let places = wanted.places();
        rows.retain_mut(|row| {
            let place = places.get(row.point.as_str()).copied().filter(|&i| wanted.holds(i));
            let same = place.is_some_and(|i| wanted.points[i] == found.points[row.index]);
            row.index = place.unwrap_or(row.index);
            same
        });
    }
    rows.retain(|r| r.status == Status::Ok || !retry_failed);
    Ok(rows)
}

/// The rows as JSON lines.
fn json_text(rows: &[Row]) -> Vec<u8> {
    rows.iter().flat_map(json_line).collect()
}

/// The rows of a sweep without an incomplete last line. Rows are assigned to points by id.
fn read_rows(path: &Path, manifest: &Manifest) -> Result<Vec<Row>, StoreError> {
    let bytes = disk::read_if_there(path)?.unwrap_or_default();
    let places = manifest.places();
    let damaged = |line, message| StoreError::Damaged { path: path.to_owned(), line, message };
    let mut rows: Vec<Row> = Vec::new();
    let mut seen = vec![false; manifest.points.len()];
    let mut bad: Option<(usize, String)> = None;
    for (i, line) in bytes.split_inclusive(|&b| b == b'\n').enumerate() {
        // Only the last line may be incomplete or invalid.
        if let Some((line, message)) = bad {
            return Err(damaged(line, message));
        }
        let parsed = match line.strip_suffix(b"\n") {
            None => Err("the line has no end".to_owned()),
            Some(line) => serde_json::from_slice(line).map_err(|e| e.to_string()).and_then(|row: Row| {
                let whole = (row.metrics.is_some() && row.timing.is_some()) == (row.status == Status::Ok);
                if whole { Ok(row) } else { Err("its status and its metrics do not agree".to_owned()) }
            }),
        };
        match parsed {
            Err(message) => bad = Some((i + 1, message)),
            Ok(mut row) => {
                // The id decides, not the number: a crash during adoption leaves new numbers beside the old plan.
                let place = places.get(row.point.as_str());
                let Some(&place) = place.filter(|&&i| !std::mem::replace(&mut seen[i], true)) else {
                    let message =
                        if place.is_some() { "its point has an earlier row" } else { "its point is not in plan.json" };
                    return Err(damaged(i + 1, message.to_owned()));
                };
                row.index = place;
                rows.push(row);
            }
        }
    }
    Ok(rows)
}
