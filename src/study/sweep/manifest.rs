//! The manifest of a folder of rows: the sweep's identity, its points, and the shard.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::point::VERSION;
use super::point::content_id;
use super::{Plan, PlanError, StoreError, disk};

/// Name of the manifest in a sweep's folder.
pub(super) const MANIFEST: &str = "plan.json";

/// A shard of a sweep: every n-th point, so that shards have similar costs even if an axis changes the cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// Shard `index` (from 1) of `count`.
    ///
    /// # Errors
    /// [`PlanError::Shard`] unless 1 ≤ index ≤ count.
    pub(crate) fn new(index: usize, count: usize) -> Result<Self, PlanError> {
        if index == 0 || index > count {
            return Err(PlanError::Shard { found: format!("{index}/{count}") });
        }
        Ok(Self { index, count })
    }

    /// Whether the point of this number is in the shard.
    pub(crate) fn holds(self, point: usize) -> bool {
        point % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = PlanError;

    fn from_str(text: &str) -> Result<Self, PlanError> {
        let wrong = || PlanError::Shard { found: text.to_owned() };
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let number = |t: &str| t.trim().parse().map_err(|_| wrong());
        Self::new(number(index)?, number(count)?)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl TryFrom<String> for Shard {
    type Error = PlanError;

    fn try_from(text: String) -> Result<Self, PlanError> {
        text.parse()
    }
}

/// A point as the manifest lists it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Listed {
    /// Content hash.
    pub id: String,
    /// Label of the point in messages.
    pub label: String,
}

/// The identity of a sweep and all its points, independent of the shard.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The sweep's name.
    pub name: String,
    /// The program's version.
    pub partwise: String,
    /// Hash of the points, ids and labels, in order.
    pub plan: String,
    /// The shard of this folder; `None` for all points.
    pub shard: Option<Shard>,
    /// Every point of the sweep, in order.
    pub points: Vec<Listed>,
}

/// Whether a text is a content hash of 32 hexadecimal digits and thus safe as a file name.
pub(crate) fn is_id(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

impl Manifest {
    /// The manifest of a plan or of a shard of it.
    #[must_use]
    pub fn of(plan: &Plan, shard: Option<Shard>) -> Self {
        let points: Vec<Listed> = plan.points.iter().map(|p| Listed { id: p.id.clone(), label: p.label() }).collect();
        Self { name: plan.name.clone(), partwise: VERSION.to_owned(), plan: content_id(&points), shard, points }
    }

    /// Number of points of the shard.
    pub(crate) fn share(&self) -> usize {
        (0..self.points.len()).filter(|&i| self.holds(i)).count()
    }

    /// Whether the point of this number is in the shard.
    pub(crate) fn holds(&self, point: usize) -> bool {
        self.shard.is_none_or(|s| s.holds(point))
    }

    /// The number of each point by its id.
    pub(super) fn places(&self) -> BTreeMap<&str, usize> {
        self.points.iter().enumerate().map(|(i, p)| (p.id.as_str(), i)).collect()
    }

    /// Name, version, number of points and hash, for messages about two different sweeps.
    pub(crate) fn identity(&self) -> String {
        let Self { name, partwise, plan, points, .. } = self;
        let shard = self.shard.map_or(String::new(), |s| format!(", shard {s}"));
        format!(
            "sweep \"{name}\" of partwise {partwise}, {} points, plan {}{shard}",
            points.len(),
            plan.chars().take(8).collect::<String>()
        )
    }

    /// Reads the manifest of a folder; `None` if the file does not exist.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>, StoreError> {
        let path = folder.join(MANIFEST);
        let Some(bytes) = disk::read_if_there(&path)? else { return Ok(None) };
        let manifest: Self = match serde_json::from_slice(&bytes) {
            Ok(manifest) => manifest,
            Err(e) => return Err(StoreError::Damaged { path, line: e.line(), message: e.to_string() }),
        };
        // Ids become file names, and the manifest may come from an untrusted source.
        if let Some(wrong) = manifest.points.iter().find(|point| !is_id(&point.id)) {
            return Err(StoreError::BadId { path, found: wrong.id.clone() });
        }
        Ok(Some(manifest))
    }

    /// Writes the manifest atomically.
    pub(super) fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let path = folder.join(MANIFEST);
        let text = serde_json::to_string_pretty(self);
        let mut text = text.map_err(|e| StoreError::io(&path, "cannot be written")(e.into()))?;
        text.push('\n');
        disk::make(&path, text.as_bytes())
    }
}
