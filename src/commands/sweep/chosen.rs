//! What tells the points of one garment apart, and which few of them stand side by side.

use crate::study::sweep::Row;

/// Views side by side at most: more are too narrow to see a garment in.
pub(crate) const MOST: usize = 6;

/// And at least, where there are so many rows: two that nothing beats say little about the rest.
const FEWEST: usize = 4;

/// The error a row is judged by, mm.
pub(crate) fn error_mm(row: &Row) -> Option<f64> {
    row.metrics.as_ref()?.error_mm()
}

/// The time a row took, ms.
pub(crate) fn total_ms(row: &Row) -> Option<f64> {
    Some(row.timing.as_ref()?.time_total_ms)
}

/// The table's name, and whatever else differs within the rows.
pub(crate) fn labels(rows: &[&Row]) -> Vec<String> {
    let fields = |row: &Row| {
        [
            row.table.clone(),
            row.model.clone(),
            row.fabric.clone(),
            if row.extent_cm == "none" { "not cut".to_owned() } else { format!("{} cm", row.extent_cm) },
            row.motion.clone(),
            format!("min {}", row.min_part),
            if row.refine == "converged" { row.refine.clone() } else { format!("{} steps", row.refine) },
            format!("seed {}", row.seed),
            row.options.clone(),
        ]
    };
    let all: Vec<[String; 9]> = rows.iter().map(|row| fields(row)).collect();
    let varies: Vec<bool> = (0..9).map(|i| all.windows(2).any(|pair| pair[0][i] != pair[1][i])).collect();
    let some = varies.contains(&true);
    let label = |fields: &[String; 9]| {
        let kept = fields.iter().zip(&varies).enumerate().filter(|(i, (_, v))| **v || (*i == 0 && !some));
        kept.map(|(_, (field, _))| field.as_str()).collect::<Vec<_>>().join(", ")
    };
    all.iter().map(label).collect()
}

/// Up to [`MOST`] rows, ascending: all where they are so few, else the first (the table everything is compared with),
/// and an even choice from those that no other row beats in both PART count and error; if those are few, those whose
/// PART counts lie farthest from the chosen. All are deterministic figures, so that shards choose alike.
pub(crate) fn choose(rows: &[&Row]) -> Vec<usize> {
    if rows.len() <= MOST {
        return (0..rows.len()).collect();
    }
    let metrics: Vec<Option<(usize, f64)>> =
        rows.iter().map(|row| Some((row.metrics.as_ref()?.part_count, error_mm(row).unwrap_or(0.0)))).collect();
    let beaten = |mine: (usize, f64)| {
        metrics
            .iter()
            .flatten()
            .any(|&(parts, error)| parts <= mine.0 && error <= mine.1 && (parts < mine.0 || error < mine.1))
    };
    let known = rows.iter().any(|row| error_mm(row).is_some());
    let mut front: Vec<usize> = (1..rows.len()).filter(|&i| metrics[i].is_some_and(|f| !known || !beaten(f))).collect();
    front.sort_by_key(|&i| metrics[i].map(|f| f.0));
    front.dedup_by_key(|i| metrics[*i].map(|f| (f.0, f.1.to_bits())));
    let room = MOST - 1;
    let mut chosen = vec![0];
    if front.len() <= room {
        chosen.extend(front);
    } else {
        chosen.extend((0..room).map(|i| front[i * (front.len() - 1) / (room - 1)]));
    }
    chosen.sort_unstable();
    chosen.dedup();
    let apart = |i: usize, chosen: &[usize]| {
        let parts = |i: usize| metrics[i].map(|f| (f.0.max(1) as f64).ln());
        let gaps = chosen.iter().map(|&c| Some((parts(i)? - parts(c)?).abs()));
        gaps.flatten().fold(f64::INFINITY, f64::min)
    };
    while chosen.len() < FEWEST {
        let others = (0..rows.len()).filter(|i| metrics[*i].is_some() && !chosen.contains(i));
        // Of equals the first.
        let Some(next) = others.rev().max_by(|&a, &b| apart(a, &chosen).total_cmp(&apart(b, &chosen))) else { break };
        chosen.push(next);
        chosen.sort_unstable();
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::metrics::Metrics;

    fn row(table: &str, parts: usize, error: f64) -> Row {
        Row {
            table: table.to_owned(),
            metrics: Some(Metrics { part_count: parts, canonical_rms_mm: Some(error), ..Metrics::default() }),
            extent_cm: "8".to_owned(),
            ..Row::default()
        }
    }

    #[test]
    fn the_first_and_what_nothing_beats() {
        let rows = [
            row("a", 10, 5.0),
            row("b", 20, 6.0),
            row("c", 5, 9.0),
            row("d", 30, 1.0),
            row("e", 31, 1.0),
            row("f", 40, 2.0),
            row("g", 50, 2.0),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        // The last fills up: its PART count lies farthest from the three.
        assert_eq!(choose(&rows), [0, 2, 3, 6]);
        let many: Vec<Row> = (0..40).map(|i| row("t", 10 + i, 50.0 - i as f64)).collect();
        let many: Vec<&Row> = many.iter().collect();
        let chosen = choose(&many);
        assert_eq!(chosen.len(), MOST);
        assert_eq!((chosen[0], chosen[5]), (0, 39));
        assert_eq!(choose(&many[..3]), [0, 1, 2]);
        assert!(choose(&[]).is_empty());
    }

    #[test]
    fn labels_hold_what_differs_and_nothing_else() {
        let mut rows = [row("a", 1, 1.0), row("b", 1, 1.0)];
        assert_eq!(labels(&rows.iter().collect::<Vec<_>>()), ["a", "b"]);
        rows[1].extent_cm = "none".to_owned();
        assert_eq!(labels(&rows.iter().collect::<Vec<_>>()), ["a, 8 cm", "b, not cut"]);
        assert_eq!(labels(&[&rows[0]]), ["a"]);
    }
}
