//! Rows as text and back, one a line; and which lines a crash can have torn.

use std::path::Path;

use super::row::json_line;
use super::{Manifest, Row, Status, StoreError, disk};

/// The rows as JSON lines.
pub(super) fn json_text(rows: &[Row]) -> Vec<u8> {
    rows.iter().flat_map(json_line).collect()
}

/// The rows of a sweep. A bad last line was torn and is left out; the id counts, not the number, so that rows find their place.
pub(super) fn read_rows(path: &Path, manifest: &Manifest) -> Result<Vec<Row>, StoreError> {
    let bytes = disk::read_if_there(path)?.unwrap_or_default();
    let places = manifest.places();
    let damaged = |line, message| StoreError::Damaged { path: path.to_owned(), line, message };
    let mut rows: Vec<Row> = Vec::new();
    let mut seen = vec![false; manifest.points.len()];
    let mut bad: Option<(usize, String)> = None;
    for (i, line) in bytes.split_inclusive(|&b| b == b'\n').enumerate() {
        // Only the last line can lack its end, and only the last may be bad: then it was torn.
        if let Some((line, message)) = bad {
            return Err(damaged(line, message));
        }
        let parsed = match line.strip_suffix(b"\n") {
            None => Err("the line has no end".to_owned()),
            Some(line) => serde_json::from_slice(line).map_err(|e| e.to_string()).and_then(|row: Row| {
                let whole = (row.figures.is_some() && row.timing.is_some()) == (row.status == Status::Ok);
                if whole { Ok(row) } else { Err("its status and its figures do not agree".to_owned()) }
            }),
        };
        match parsed {
            Err(message) => bad = Some((i + 1, message)),
            Ok(mut row) => {
                // The id counts, not the number: a crash while rows are adopted leaves new numbers beside the old plan.
                let place = places.get(row.point.as_str());
                let Some(&place) = place.filter(|&&i| !std::mem::replace(&mut seen[i], true)) else {
                    let message =
                        if place.is_some() { "its point has a row before" } else { "its point is not in plan.json" };
                    return Err(damaged(i + 1, message.to_owned()));
                };
                row.index = place;
                rows.push(row);
            }
        }
    }
    Ok(rows)
}
