//! Table 4 as text (times beside the printed ones, errors, growth exponents) and as CSV.

use super::methods::{METHODS, printed_ms};
use super::row::{MethodResult, Table4Row};
use super::silhouette::Silhouette;

/// A table of text cells.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Cells {
    /// Heading of the table.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// As many cells as columns.
    pub rows: Vec<Vec<String>>,
}

/// Tables of times, ratios, errors, states, silhouettes and ends, a line a row.
pub(crate) fn tables(rows: &[Table4Row]) -> Vec<Cells> {
    let cell = |row: &Table4Row, name: &str, text: &dyn Fn(&MethodResult) -> String| {
        let entry = row.entries.iter().find(|e| e.method == name);
        entry.map_or("–".to_owned(), |e| if e.error.is_some() { "–".to_owned() } else { text(e) })
    };
    let names: Vec<&str> = METHODS.iter().map(|e| e.name()).collect();
    let table = |title: &str,
                 last: &[&str],
                 text: &dyn Fn(&MethodResult) -> String,
                 end: &dyn Fn(&Table4Row) -> Vec<String>| Cells {
        title: title.to_owned(),
        header: ["garment", "vertices"].iter().chain(&names).chain(last).map(|&s| s.to_owned()).collect(),
        rows: rows
            .iter()
            .map(|row| {
                let own = names.iter().map(|name| cell(row, name, text));
                [row.garment.clone(), row.vertices.to_string()].into_iter().chain(own).chain(end(row)).collect()
            })
            .collect(),
    };
    let printed = |row: &Table4Row| match printed_ms(&row.garment, row.asked) {
        Some(ms) => ms.iter().map(|ms| format!("{ms:.0}")).collect(),
        None => vec!["–".to_owned(); 4],
    };
    let nothing = |_: &Table4Row| Vec::new();
    vec![
        table(
            "time to drape, ms: median ± interquartile range; on the right what the paper printed (Core i5 650, 2010)",
            &["[19]", "[20]", "[21]", "proposed"],
            &|e| format!("{} ± {}", short(e.median_ms), short(e.spread_ms)),
            &printed,
        ),
        table(
            "time over the converged drape's, round by round: median ± interquartile range",
            &[],
            &|e| format!("{} ± {}", short(e.ratio), short(e.ratio_spread)),
            &nothing,
        ),
        table(
            "error, mm RMS: to the canonical drape / to where it would settle itself; spread: canonical drapes of other starts",
            &["spread"],
            &|e| format!("{} / {}", short(e.canonical_rms_mm), short(e.own_rms_mm)),
            &|row| vec![row.spread_mm.map_or("–".to_owned(), short)],
        ),
        table(
            "state: residual of the common energy over the weight; strain, 95 % and largest; vertices in the body",
            &[],
            &|e| {
                let strain = format!("{:.1}/{:.1} %", 100.0 * e.strain_p95, 100.0 * e.strain_max);
                format!("{:.0e}; {strain}; {}", e.residual_over_weight, e.penetrating_vertices)
            },
            &nothing,
        ),
        table(
            "hem height; girths near the hem, half way and below armpits or top, cm",
            &["canonical"],
            &|e| silhouette_text(&e.silhouette),
            &|row| vec![silhouette_text(&row.canonical)],
        ),
        table("how it ended, and after how many steps", &[], &|e| format!("{}, {}", e.ended, e.steps), &nothing),
    ]
}

/// Hem and girths, cm.
fn silhouette_text(of: &Silhouette) -> String {
    let cm = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.1}"));
    format!("{}; {}", cm(of.hem_cm), of.girths_cm.map(cm).join(", "))
}

/// About three significant digits.
fn short(x: f64) -> String {
    let digits = match x.abs() {
        0.0 | 100.0.. => 0,
        10.0.. => 1,
        0.1.. => 2,
        _ => 3,
    };
    format!("{x:.digits$}")
}

/// For every garment with at least three sizes: the exponent p of each method in time ~ verticesᵖ, by least squares in
/// logarithms.
pub(crate) fn exponents(rows: &[Table4Row]) -> Option<Cells> {
    let mut garments: Vec<&str> = rows.iter().map(|r| r.garment.as_str()).collect();
    garments.sort_unstable();
    garments.dedup();
    let mut found = Vec::new();
    for garment in garments {
        let of: Vec<&Table4Row> = rows.iter().filter(|r| r.garment == garment).collect();
        if of.len() < 3 {
            continue;
        }
        let mut cells = vec![garment.to_owned(), of.len().to_string()];
        cells.extend(METHODS.iter().map(|method| {
            let points = of.iter().filter_map(|row| {
                let entry = row.entries.iter().find(|e| e.method == method.name() && e.error.is_none())?;
                Some(((row.vertices as f64).ln(), entry.median_ms.ln()))
            });
            slope(&points.collect::<Vec<_>>()).map_or("–".to_owned(), |[p, error]| format!("{p:.2} ± {error:.2}"))
        }));
        found.push(cells);
    }
    let header = ["garment", "sizes"].into_iter().chain(METHODS.iter().map(|e| e.name())).map(str::to_owned).collect();
    let title = "exponent p of time ~ verticesᵖ, least squares in logarithms ± standard error".to_owned();
    (!found.is_empty()).then_some(Cells { title, header, rows: found })
}

/// Slope of the line through points by least squares, and its standard error.
fn slope(points: &[(f64, f64)]) -> Option<[f64; 2]> {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let (xx, xy) = points.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - mx).powi(2), xy + (x - mx) * (y - my)));
    let left: f64 = points.iter().map(|(x, y)| (y - my - xy / xx * (x - mx)).powi(2)).sum();
    (points.len() > 2 && xx > 0.0).then(|| [xy / xx, (left / (n - 2.0) / xx).sqrt()])
}

/// CSV columns of one result. A failed method has its name and its error only.
fn columns(row: &Table4Row, e: &MethodResult) -> [(&'static str, String); 25] {
    let optional = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let number = |x: f64| if e.error.is_some() { String::new() } else { x.to_string() };
    let [near_hem, half_way, near_top] = e.silhouette.girths_cm.map(optional);
    let times: Vec<String> = e.times_ms.iter().map(|ms| format!("{ms:.3}")).collect();
    [
        ("garment", row.garment.clone()),
        ("vertices", row.vertices.to_string()),
        ("entrant", e.method.clone()),
        ("median_ms", number(e.median_ms)),
        ("spread_ms", number(e.spread_ms)),
        ("ratio_to_converged", number(e.ratio)),
        ("ratio_spread", number(e.ratio_spread)),
        ("canonical_rms_mm", number(e.canonical_rms_mm)),
        ("own_rms_mm", number(e.own_rms_mm)),
        ("canonical_spread_mm", optional(row.spread_mm)),
        ("residual_over_weight", number(e.residual_over_weight)),
        ("strain_p95", number(e.strain_p95)),
        ("strain_max", number(e.strain_max)),
        ("hem_cm", optional(e.silhouette.hem_cm)),
        ("girth_near_hem_cm", near_hem),
        ("girth_half_way_cm", half_way),
        ("girth_near_top_cm", near_top),
        ("canonical_hem_cm", optional(row.canonical.hem_cm)),
        ("penetrating_vertices", number(e.penetrating_vertices as f64)),
        ("penetration_mm", number(e.penetration_mm)),
        ("ended", e.ended.clone()),
        ("steps", number(e.steps as f64)),
        ("simulated_s", optional(e.simulated_s)),
        ("times_ms", times.join(" ")),
        ("error", e.error.clone().unwrap_or_default()),
    ]
}

/// CSV with a header and a line for every method of every row.
///
/// # Errors
/// Errors of the CSV writer.
pub(crate) fn csv_lines(rows: &[Table4Row]) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns(&Table4Row::default(), &MethodResult::default()).map(|(name, _)| name))?;
    for (row, entry) in rows.iter().flat_map(|row| row.entries.iter().map(move |entry| (row, entry))) {
        writer.write_record(columns(row, entry).map(|(_, cell)| cell))?;
    }
    let bytes = writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(vertices: usize) -> Table4Row {
        let entries = METHODS.iter().enumerate().map(|(i, e)| MethodResult {
            method: e.name().to_owned(),
            median_ms: (vertices as f64).powf(1.0 + 0.25 * i as f64),
            error: (i == 1).then(|| "cannot, as it is".to_owned()),
            ..MethodResult::default()
        });
        Table4Row {
            garment: "flared-skirt".to_owned(),
            asked: vertices,
            vertices,
            spread_mm: Some(3.0),
            canonical: Silhouette { hem_cm: Some(61.25), girths_cm: [Some(190.0), Some(120.0), None] },
            entries: entries.collect(),
        }
    }

    #[test]
    fn exponents_are_those_of_the_powers() {
        let rows = [row(1000), row(4000), row(16000)];
        let found = exponents(&rows).unwrap();
        assert_eq!(found.rows[0][..5], ["flared-skirt", "3", "1.00 ± 0.00", "–", "1.50 ± 0.00"]);
        assert!(exponents(&rows[..2]).is_none());
    }

    #[test]
    fn every_table_has_a_cell_for_every_column_and_a_dash_for_a_failed_method() {
        let rows = [row(3613), row(1000)];
        for table in tables(&rows) {
            assert!(table.rows.iter().all(|cells| cells.len() == table.header.len()), "{}", table.title);
            assert_eq!(table.rows[0][3], "–");
        }
        let hem = tables(&rows).into_iter().find(|t| t.title.starts_with("hem")).unwrap();
        assert_eq!(hem.rows[0].last().unwrap(), "61.2; 190.0, 120.0, –");
        assert_eq!(tables(&rows)[0].rows[0][8..], ["824", "929", "979", "686"]);
        let csv = csv_lines(&rows).unwrap();
        assert_eq!(csv.lines().count(), 1 + 2 * METHODS.len());
        assert!(csv.contains("\"cannot, as it is\""), "{csv}");
    }
}
