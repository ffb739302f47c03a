//! The log of finished rows on disk: rewritten atomically after each row, so an interrupted run can be resumed.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::methods::METHODS;
use super::row::{Table4Options, Table4Row};
use crate::base::atomic_file::AtomicFile;
use crate::base::files::{Unreadable, read_own};

/// Conditions of a measurement. Rows of one table have equal conditions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Conditions {
    /// Version of the program.
    pub version: String,
    /// Name of the fabric.
    pub fabric: String,
    /// Counted rounds.
    pub rounds: usize,
    /// Uncounted rounds before them.
    pub warm_up: usize,
    /// Perturbed starts.
    pub starts: u64,
    /// A simulation over time is at rest when its RMS speed stays below the first value, m/s, for the second, s.
    pub rest: [f64; 2],
    /// Worker threads.
    pub threads: usize,
    /// Name of the processor, or its architecture.
    pub machine: String,
    /// The compared methods.
    #[serde(default, rename = "entrants")]
    pub methods: Vec<String>,
}

impl Conditions {
    /// Conditions of a run on this machine.
    pub(crate) fn here(fabric: &str, options: &Table4Options) -> Self {
        // Linux alone names the processor without a library.
        let cpu_info = read_own(Path::new("/proc/cpuinfo")).unwrap_or_default();
        let cpu_info = String::from_utf8_lossy(&cpu_info);
        let model = cpu_info.lines().find_map(|line| line.strip_prefix("model name"));
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

    /// The conditions in one line.
    pub(crate) fn text(&self) -> String {
        let Self { machine, threads, fabric, rounds, warm_up, starts, rest: [speed, over], .. } = self;
        let rest = format!("rest: RMS speed under {} cm/s over {over} s", 100.0 * speed);
        let counted = format!("{rounds} counted rounds after {warm_up}; {starts} perturbed starts");
        format!("{machine}; {threads} threads; fabric {fabric}; {counted}; {rest}")
    }
}

/// Finished rows and their conditions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RowLog {
    /// Conditions of all rows.
    pub conditions: Conditions,
    /// Finished rows.
    pub rows: Vec<Table4Row>,
}

/// Why a log cannot be resumed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RowLogError {
    /// The file cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// The file is not a row log.
    #[error("{file}: found no row log of Table 4 ({reason}); choose another file with --rows-file")]
    Syntax { file: String, reason: String },
    /// The rows were measured under other conditions.
    #[error(
        "{file}: the rows were measured under other conditions: found {found}, expected {expected}; choose another file with --rows-file"
    )]
    Other { file: String, found: String, expected: String },
}

impl RowLog {
    /// Reads a log; a file that does not exist is an empty log.
    ///
    /// # Errors
    /// [`RowLogError`] if the file is not a log, or has other conditions.
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
                .map(|c| format!("version {}, {}; {}", c.version, c.text(), c.methods.join(", ")));
            return Err(RowLogError::Other { file, found, expected });
        }
        Ok(log)
    }

    /// The row of a garment at a requested size.
    pub(crate) fn find(&self, garment: &str, vertices: usize) -> Option<&Table4Row> {
        self.rows.iter().find(|row| row.garment == garment && row.asked == vertices)
    }

    /// Writes the log atomically.
    ///
    /// # Errors
    /// Errors of the disk.
    pub(crate) fn write(&self, path: &Path) -> std::io::Result<()> {
        AtomicFile::write(path, serde_json::to_string(self).map_err(std::io::Error::other)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_is_resumed_under_equal_conditions_only() {
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
        assert!(again.find("flared-skirt", 900).is_some() && again.find("flared-skirt", 901).is_none());
        let other = Conditions { threads: 99, ..here.clone() };
        assert!(matches!(RowLog::open(&path, other), Err(RowLogError::Other { .. })));
        std::fs::write(&path, "{}").unwrap();
        assert!(RowLog::open(&path, here).unwrap_err().to_string().contains("rows.json"));
    }
}
