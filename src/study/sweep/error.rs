//! Errors of a sweep: its file, its rows on disk, the merge of shards. A failed point is not an error but a row.

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use crate::base::files::Unreadable;

/// Why a sweep file is refused. The user can correct all of these.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum PlanError {
    /// The sweep file cannot be read.
    #[error(transparent)]
    Unreadable(Unreadable),
    /// A file named in it cannot be read.
    #[error("{place}: {path}: cannot be read: {source}; paths count from the folder of the sweep file")]
    Read { place: String, path: PathBuf, source: io::Error },
    /// The text is not TOML, or a key is missing, unknown or of another type.
    #[error(
        "{place}: {message}; a sweep file has name = \"...\", and [grid] with lists (tables = [...]) or [[points]] one by \
         one (table = ...), or both; [base] holds what all share"
    )]
    Syntax { place: String, message: String },
    /// A value is not allowed.
    #[error("{place}: {key}: found {found}, expected {expected}")]
    Value { place: String, key: &'static str, found: String, expected: String },
    /// A range table, fabric, body or garment cannot be read or made.
    #[error("{place}: {key}: {source}")]
    Input { place: String, key: &'static str, source: Box<dyn Error + Send + Sync> },
    /// The plan has no points.
    #[error(
        "{name}: found no points, expected [grid] or at least one [[points]]; an empty [grid] is one point of [base]"
    )]
    Empty { name: String },
    /// The plan has too many points.
    #[error("{name}: found {found} points, expected at most {limit}; split the sweep or shorten an axis")]
    TooMany { name: String, found: usize, limit: usize },
    /// A job has settings without a key in a sweep file.
    #[error("{label}: a sweep file cannot express it: {why}")]
    Unsayable { label: String, why: String },
    /// The shard is invalid.
    #[error("shard: found \"{found}\", expected i/n with 1 <= i <= n, for example 2/3")]
    Shard { found: String },
}

impl PlanError {
    /// Converts an error about the input of `key` at `place`.
    pub(super) fn input<E: Error + Send + Sync + 'static>(place: &str, key: &'static str) -> impl FnOnce(E) -> Self {
        move |source| Self::Input { place: place.to_owned(), key, source: Box::new(source) }
    }
}

/// Why the rows on disk cannot be read, written or resumed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum StoreError {
    /// Reading, or preparing to write, failed.
    #[error("{path}: {doing}: {source}; check the path, its permissions and the room on its disk")]
    Io { path: PathBuf, doing: &'static str, source: io::Error },
    /// A row could not be written, usually because the disk is full.
    #[error(
        "{path}: a row cannot be written: {source}; the {kept} rows before it are intact: make room and go on with --resume"
    )]
    Write { path: PathBuf, kept: usize, source: io::Error },
    /// Another process holds the lock.
    #[error("{path}: another process is writing this sweep; wait for it, or give this one another folder")]
    Locked { path: PathBuf },
    /// Rows exist, and resuming was not requested.
    #[error("{path}: found {rows} rows of a sweep, expected none; go on with --resume, or choose another folder")]
    Exists { path: PathBuf, rows: usize },
    /// The rows belong to another sweep.
    #[error(
        "{path}: found {found}, expected {expected}: an input of the results has changed (sweep file, a file it names, \
         shard or program); choose another folder, or keep the rows the two have in common with --adopt"
    )]
    OtherPlan { path: PathBuf, found: String, expected: String },
    /// A line before the last one is not a row; this cannot result from an interrupted write.
    #[error("{path}:{line}: not a row of this sweep: {message}; remove the line to compute its point again")]
    Damaged { path: PathBuf, line: usize, message: String },
    /// An id is not a hash, so it must not become a file name.
    #[error(
        "{path}: found the point id {found:?}, expected 32 hexadecimal digits; it is not what `partwise sweep` wrote"
    )]
    BadId { path: PathBuf, found: String },
    /// Rows exist without the manifest of their sweep.
    #[error("{path}: found rows but no plan.json beside them, expected both; put it back, or choose another folder")]
    Orphans { path: PathBuf },
    /// The folder has no sweep.
    #[error("{path}: found no sweep, expected a folder that `partwise sweep` wrote")]
    Missing { path: PathBuf },
}

impl StoreError {
    /// Converts an error of the file system at `path`.
    pub(super) fn io(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), doing, source }
    }
}

/// Why shards cannot be joined.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum MergeError {
    /// The list of folders is empty.
    #[error("found no folders to join, expected those that `partwise sweep --shard i/n` wrote")]
    Nothing,
    /// A shard cannot be read, or the result cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The shards belong to different sweeps.
    #[error("{second}: found {found}, expected {expected} as in {first}; join shards of one sweep by one version only")]
    OtherPlan { first: PathBuf, second: PathBuf, found: String, expected: String },
    /// Points without a row in any shard.
    #[error("{count} of {total} points are missing: {}; run their shards to the end with --resume", list.join("; "))]
    Missing { count: usize, total: usize, list: Vec<String> },
    /// Two shards have different results for one point.
    #[error(
        "point {index} ({label}): {first} and {second} disagree in {}; one of them was made by another program or on a \
         machine with other arithmetic: leave one out", columns.join(", ")
    )]
    Disagree { index: usize, label: String, first: PathBuf, second: PathBuf, columns: Vec<String> },
}
