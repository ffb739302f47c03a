//! Errors of a sweep: its file, its rows on disk, the merge of shards. A point that fails is none of
//! these: it is a row.

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use crate::base::files::Unreadable;

/// A sweep file that cannot be used. The user can mend all of these.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum PlanError {
    /// The sweep file cannot be read.
    #[error(transparent)]
    Unreadable(Unreadable),
    /// A file that it names cannot be read.
    #[error("{place}: {path}: cannot be read: {source}; paths count from the folder of the sweep file")]
    Read { place: String, path: PathBuf, source: io::Error },
    /// Not TOML, or a key that is missing, unknown or of another type.
    #[error(
        "{place}: {message}; a sweep file has name = \"...\", and [grid] with lists (tables = [...]) or [[points]] one by \
         one (table = ...), or both; [base] holds what all share"
    )]
    Syntax { place: String, message: String },
    /// A value that will not do.
    #[error("{place}: {key}: found {found}, expected {expected}")]
    Value { place: String, key: &'static str, found: String, expected: String },
    /// A range table, fabric, body or garment that cannot be read or made.
    #[error("{place}: {key}: {source}")]
    Input { place: String, key: &'static str, source: Box<dyn Error + Send + Sync> },
    /// Nothing to do.
    #[error(
        "{name}: found no points, expected [grid] or at least one [[points]]; an empty [grid] is one point of [base]"
    )]
    Empty { name: String },
    /// More than anybody means.
    #[error("{name}: found {found} points, expected at most {limit}; split the sweep or shorten an axis")]
    TooMany { name: String, found: usize, limit: usize },
    /// A job that a sweep file has no keys for.
    #[error("{label}: a sweep file cannot say it: {why}")]
    Unsayable { label: String, why: String },
    /// An invalid shard.
    #[error("shard: found \"{found}\", expected i/n with 1 <= i <= n, for example 2/3")]
    Shard { found: String },
}

impl PlanError {
    /// What to make of an error about the input that `key` names at `place`.
    pub(super) fn input<E: Error + Send + Sync + 'static>(place: &str, key: &'static str) -> impl FnOnce(E) -> Self {
        move |source| Self::Input { place: place.to_owned(), key, source: Box::new(source) }
    }
}

/// Rows on disk that cannot be read, written or gone on with.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum StoreError {
    /// Reading, or preparing to write, failed.
    #[error("{path}: {doing}: {source}; check the path, its permissions and the room on its disk")]
    Io { path: PathBuf, doing: &'static str, source: io::Error },
    /// A row could not be written: a full disk, most often.
    #[error(
        "{path}: a row cannot be written: {source}; the {kept} rows before it are intact: make room and go on with --resume"
    )]
    Write { path: PathBuf, kept: usize, source: io::Error },
    /// Another process has it.
    #[error("{path}: another process is writing this sweep; wait for it, or give this one another folder")]
    Locked { path: PathBuf },
    /// There are rows already and nobody said to go on.
    #[error("{path}: found {rows} rows of a sweep, expected none; go on with --resume, or choose another folder")]
    Exists { path: PathBuf, rows: usize },
    /// Rows of another sweep.
    #[error(
        "{path}: found {found}, expected {expected}: what determines a result has changed (sweep file, a file it names, \
         shard or program); choose another folder, or keep the rows the two have in common with --adopt"
    )]
    OtherPlan { path: PathBuf, found: String, expected: String },
    /// A line in the middle that is no row: not a torn end, which is mended, but something else's work.
    #[error("{path}:{line}: not a row of this sweep: {message}; remove the line to compute its point again")]
    Damaged { path: PathBuf, line: usize, message: String },
    /// An id that is no hash: it must not become a file name.
    #[error(
        "{path}: found the point id {found:?}, expected 32 hexadecimal digits; it is not what `partwise sweep` wrote"
    )]
    BadId { path: PathBuf, found: String },
    /// Rows nobody can tell the sweep of.
    #[error("{path}: found rows but no plan.json beside them, expected both; put it back, or choose another folder")]
    Orphans { path: PathBuf },
    /// No sweep there.
    #[error("{path}: found no sweep, expected a folder that `partwise sweep` wrote")]
    Missing { path: PathBuf },
}

impl StoreError {
    /// What to make of a system's error at `path`.
    pub(super) fn io(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), doing, source }
    }
}

/// Shards that cannot be joined.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum MergeError {
    /// Nothing given.
    #[error("found no folders to join, expected those that `partwise sweep --shard i/n` wrote")]
    Nothing,
    /// One of them cannot be read, or the result not written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Two sweeps.
    #[error("{second}: found {found}, expected {expected} as in {first}; join shards of one sweep by one version only")]
    OtherPlan { first: PathBuf, second: PathBuf, found: String, expected: String },
    /// Points nobody computed.
    #[error("{count} of {total} points are missing: {}; run their shards to the end with --resume", list.join("; "))]
    Missing { count: usize, total: usize, list: Vec<String> },
    /// The same point computed twice, with different results.
    #[error(
        "point {index} ({label}): {first} and {second} disagree in {}; one of them was made by another program or on a \
         machine with other arithmetic: leave one out", columns.join(", ")
    )]
    Disagree { index: usize, label: String, first: PathBuf, second: PathBuf, columns: Vec<String> },
}
