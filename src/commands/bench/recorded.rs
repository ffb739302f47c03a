//! A row of the comparison as a recording: its drapes side by side, coloured by how far they are from the canonical one, and times over
//! errors and over vertices.

use std::path::{Path, PathBuf};

use crate::record::{Colours, Compared, Layout, Overlay, Picture, Range, RecordOptions, Recorder, ScatterPoint, Sink};
use crate::scene::Scene;
use crate::study::accuracy::vertex_errors;
use crate::study::table4::{ComparedMethod, DrapedRow, METHODS, MethodResult, Table4Row};

/// Share of the distances that the colours tell apart; what is beyond takes the last.
const TOLD_APART: f64 = 0.75;

/// Writes a row's recording into a folder; `rows` are all so far, this one among them.
pub(super) fn record(
    folder: &Path,
    draped_row: &DrapedRow,
    scene: &Scene,
    rows: &[Table4Row],
) -> anyhow::Result<PathBuf> {
    let DrapedRow { row, draped, canonical } = draped_row;
    let name = format!("{}-{}", row.garment, row.asked);
    let path = folder.join(format!("{name}.rrd"));
    let titles = METHODS.map(ComparedMethod::title);
    let said = |(entry, title): (&MethodResult, &str)| match entry.error {
        None => format!("{title}: {:.0} ms, {:.1} mm off", entry.median_ms, entry.canonical_rms_mm),
        Some(_) => format!("{title}: cannot run here"),
    };
    let mut recorder = Recorder::open(RecordOptions {
        sinks: vec![Sink::File(path.clone())],
        name: format!("{name}: Table 4"),
        layout: Layout {
            table4: true,
            compare: row.entries.iter().zip(titles).map(said).collect(),
            ..Layout::default()
        },
        ..RecordOptions::default()
    })?;
    recorder.body(0, scene.body.mesh())?;
    recorder.garment(0, &scene.garment)?;
    let apart_mm = |x: &Vec<_>| vertex_errors(x, canonical).into_iter().map(|m| 1e3 * m).collect::<Vec<f64>>();
    let off_mm: Vec<Option<Vec<f64>>> = draped.iter().map(|x| x.as_ref().map(apart_mm)).collect();
    let range = Range::to_quantile(off_mm.iter().flatten().flatten().copied(), TOLD_APART);
    for (slot, (x, off_mm)) in draped.iter().zip(&off_mm).enumerate() {
        let (Some(x), Some(values)) = (x, off_mm) else { continue };
        let colours = Colours::Overlay(Overlay { name: "distance", unit: "mm", values }, range);
        recorder.compare(&Compared { index: 0, slot, caption: "", draped: x, colours })?;
    }
    let points = |of: &Table4Row, place: fn(&Table4Row, usize) -> [f64; 2], named: bool| {
        let ran = (0..of.entries.len()).filter(|&i| of.entries[i].error.is_none());
        let point = |i: usize| {
            let [x, y] = place(of, i);
            ScatterPoint { label: titles[i], x, y, group: i, named }
        };
        ran.map(point).collect::<Vec<_>>()
    };
    let errors = points(row, |row, i| [row.entries[i].median_ms, row.entries[i].canonical_rms_mm], true);
    recorder.scatter(0, Picture::of_error("time, ms"), &errors)?;
    let growth = |of: &Table4Row| points(of, |row, i| [row.vertices as f64, row.entries[i].median_ms], false);
    recorder.scatter(0, Picture::of_growth(), &rows.iter().flat_map(growth).collect::<Vec<_>>())?;
    recorder.finish()?;
    Ok(path)
}
