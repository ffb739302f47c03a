//! Joins the rows of shards. The result equals that of a single run bit for bit, except for timings.

use std::path::{Path, PathBuf};

use super::{Existing, Manifest, MergeError, Row, Store, store};

/// Largest number of missing points that an error lists.
const MAX_LISTED: usize = 10;

/// Joins the sweeps of `folders` into a new one in `out`; returns its rows.
///
/// The folders may be shards or partial runs. A point with several rows takes the first; the others must agree with it except for
/// timings.
///
/// # Errors
/// [`MergeError`]: folders of different sweeps or versions, points that are missing or on which two disagree, rows already
/// in `out`.
pub(crate) fn merge(folders: &[PathBuf], out: &Path) -> Result<Vec<Row>, MergeError> {
    let (manifest, rows) = join(folders)?;
    let mut store = Store::open(out, manifest, Existing::Refuse)?;
    store.extend(rows)?;
    Ok(store.finish()?)
}

/// The joined rows in the order of the plan, and their manifest.
pub fn join(folders: &[PathBuf]) -> Result<(Manifest, Vec<Row>), MergeError> {
    let (first, rest) = folders.split_first().ok_or(MergeError::Nothing)?;
    let (manifest, rows) = store::read(first)?;
    let manifest = Manifest { shard: None, ..manifest };
    let mut joined: Vec<Option<(Row, &Path)>> = vec![None; manifest.points.len()];
    for row in rows {
        let place = row.index;
        joined[place] = Some((row, first));
    }
    for folder in rest {
        let (other, rows) = store::read(folder)?;
        let other = Manifest { shard: None, ..other };
        if other != manifest {
            let (found, expected) = (other.identity(), manifest.identity());
            return Err(MergeError::OtherPlan { first: first.clone(), second: folder.clone(), found, expected });
        }
        for row in rows {
            let place = row.index;
            match &joined[place] {
                None => joined[place] = Some((row, folder)),
                Some((mine, from)) => agree(mine, from, &row, folder, &manifest)?,
            }
        }
    }
    let missing: Vec<usize> = (0..joined.len()).filter(|&i| joined[i].is_none()).collect();
    if !missing.is_empty() {
        let name = |&i: &usize| format!("{i} ({})", manifest.points[i].label);
        let mut list: Vec<String> = missing.iter().take(MAX_LISTED).map(name).collect();
        if missing.len() > MAX_LISTED {
            list.push(format!("and {} more", missing.len() - MAX_LISTED));
        }
        return Err(MergeError::Missing { count: missing.len(), total: joined.len(), list });
    }
    Ok((manifest, joined.into_iter().flatten().map(|(row, _)| row).collect()))
}

fn agree(mine: &Row, from: &Path, other: &Row, folder: &Path, manifest: &Manifest) -> Result<(), MergeError> {
    let columns = mine.differences(other);
    if columns.is_empty() {
        return Ok(());
    }
    Err(MergeError::Disagree {
        index: mine.index,
        label: manifest.points[mine.index].label.clone(),
        first: from.to_owned(),
        second: folder.to_owned(),
        columns,
    })
}
