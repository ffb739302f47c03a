//! The rows of a contest on disk: written whole after each, so that what is done is kept and the rest can be done later.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{METHODS, Table4Options, Table4Row};
use crate::base::atomic_file::WholeFile;
use crate::base::files::{Unreadable, read_own};

/// What rows must have in common to stand in one table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Conditions {
    /// Version of the program.
    pub version: String,
    /// The fabric's name.
    pub fabric: String,
    /// Counted rounds.
    pub rounds: usize,
    /// Rounds before them.
    pub warm_up: usize,
    /// Perturbed starts.
    pub starts: u64,
    /// RMS speed under which what moves in time rests, m/s, and for how long, s.
    pub rest: [f64; 2],
    /// Worker threads.
    pub threads: usize,
    /// What the machine calls itself.
    pub machine: String,
    /// Who takes part.
    #[serde(default, rename = "entrants")]
    pub methods: Vec<String>,
}

impl Conditions {
    /// Those of a run on this machine.
    #[must_use]
    pub(crate) fn here(fabric: &str, options: &Table4Options) -> Self {
        // Only Linux tells without asking a library; elsewhere the architecture must do.
        let told = read_own(Path::new("/proc/cpuinfo")).unwrap_or_default();
        let told = String::from_utf8_lossy(&told);
        let model = told.lines().find_map(|line| line.strip_prefix("model name"));
        let machine = model.map_or(std::env::consts::ARCH, |m| m.trim_start_matches([' ', '\t', ':'])).to_owned();
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            fabric: fabric.to_owned(),
            rounds: options.rounds,
            warm_up: options.warm_up,
            starts: options.starts,
            rest: [options.rule.speed_m_per_s, options.rule.over_s],
            threads: rayon::current_num_threads(),
            machine,
            methods: METHODS.map(|e| e.name().to_owned()).to_vec(),
        }
    }

    /// In one line.
    #[must_use]
    pub(crate) fn said(&self) -> String {
        let Self { machine, threads, fabric, rounds, warm_up, starts, rest: [speed, over], .. } = self;
        let rest = format!("rest: RMS speed under {} cm/s over {over} s", 100.0 * speed);
        let counted = format!("{rounds} counted rounds after {warm_up}; {starts} perturbed starts");
        format!("{machine}; {threads} threads; fabric {fabric}; {counted}; {rest}")
    }
}

/// Rows and what they have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RowLog {
    /// What they have in common.
    pub conditions: Conditions,
    /// The rows so far.
    pub rows: Vec<Table4Row>,
}

/// Why a log cannot be gone on with.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub(crate) enum RowLogError {
    /// It cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// It is no log.
    #[error("{file}: this is no log of a contest ({reason}); choose another file with --rows-file")]
    Syntax { file: String, reason: String },
    /// Its rows were made under other conditions.
    #[error(
        "{file}: its rows were made under other conditions: found {found}, expected {expected}; choose another file with --rows-file"
    )]
    Other { file: String, found: String, expected: String },
}

impl RowLog {
    /// The log in a file, or an empty one where there is none.
    ///
    /// # Errors
    /// [`RowLogError`] where the file is none, or of other conditions.
    pub(crate) fn open(path: &Path, conditions: Conditions) -> Result<Self, RowLogError> {
        if !path.exists() {
            return Ok(Self { conditions, rows: Vec::new() });
        }
        let file = path.display().to_string();
        let bytes = read_own(path).map_err(|e| Unreadable::new(path, &e))?;
        let log: Self = serde_json::from_slice(&bytes)
            .map_err(|e| RowLogError::Syntax { file: file.clone(), reason: e.to_string() })?;
        if log.conditions != conditions {
            let [found, expected] = [&log.conditions, &conditions]
                .map(|c| format!("version {}, {}; {}", c.version, c.said(), c.methods.join(", ")));
            return Err(RowLogError::Other { file, found, expected });
        }
        Ok(log)
    }

    /// Whether a row is there.
    #[must_use]
    pub(crate) fn has(&self, garment: &str, vertices: usize) -> bool {
        self.rows.iter().any(|row| row.garment == garment && row.asked == vertices)
    }

    /// Writes it whole.
    ///
    /// # Errors
    /// Those of the disk.
    pub(crate) fn write(&self, path: &Path) -> std::io::Result<()> {
        WholeFile::write(path, serde_json::to_string(self).map_err(std::io::Error::other)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_journal_goes_on_under_its_own_conditions_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.json");
        let here = Conditions::here("interlock", &Table4Options::default());
        let mut log = RowLog::open(&path, here.clone()).unwrap();
        assert!(log.rows.is_empty());
        let row = Table4Row { garment: "flared-skirt".to_owned(), asked: 900, vertices: 901, ..Table4Row::default() };
        log.rows.push(row);
        log.write(&path).unwrap();
        let again = RowLog::open(&path, here.clone()).unwrap();
        assert_eq!(again, log);
        assert!(again.has("flared-skirt", 900) && !again.has("flared-skirt", 901));
        let other = Conditions { threads: 99, ..here.clone() };
        assert!(matches!(RowLog::open(&path, other), Err(RowLogError::Other { .. })));
        std::fs::write(&path, "{}").unwrap();
        assert!(RowLog::open(&path, here).unwrap_err().to_string().contains("rows.json"));
    }
}
