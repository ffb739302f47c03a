//! `--picture`: the result of a run, or of every point of a sweep, as PNG.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser as _};

use super::console::progress;
use super::runtime::{refuse, write};
use super::solved::Solved;
use super::sweep::recording::labels;
use super::sweep::store::{PointStore, StoredPoint, StoredScene};
use crate::base::files::has_ending;
use crate::garment::sewing::Landmarks;
use crate::picture::colour::Overlay;
use crate::picture::{Figure, Quantity, Sheet, Subject, Viewpoint};
use crate::study::metrics::LevelCount;
use crate::study::sweep::{Row, Status};

/// Most figures of one sheet; more are too small to compare.
const MAX_FIGURES: usize = 240;

/// Arguments of a picture.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Picture")]
pub(crate) struct PictureArgs {
    /// Draw the result into this PNG file: body and garment in the light, one figure for each --picture-of and --eye. It needs no
    /// viewer and no graphics card
    #[arg(long, value_name = "FILE.png", value_parser = PathBufValueParser::new().try_map(png_file))]
    pub(crate) picture: Option<PathBuf>,
    /// Side of the body that a figure shows: `front`, `side` (the wearer's left), `back`, `flat` (the panels of a sewing pattern), or
    /// the direction to the eye, z up, such as 1,-2,0.5; several give several figures
    #[arg(long, value_name = "front|side|back|flat|X,Y,Z", default_values_t = [Viewpoint::Front], allow_hyphen_values = true)]
    eye: Vec<Viewpoint>,
    /// Colours of a figure: `drape`, `placed` (before draping), `distance` (cm), `parts`, `force` (N), `strain` (%), `pressure` (kPa),
    /// `folds` (excess length, %), `error` (mm, with --accuracy); several give several figures
    #[arg(long, value_name = "WHAT", default_values = [Quantity::Drape.name()], value_parser = quantity)]
    picture_of: Vec<Quantity>,
}

/// Parses the name of a picture.
fn png_file(path: PathBuf) -> Result<PathBuf, String> {
    if has_ending(&path, "png") {
        return Ok(path);
    }
    Err(format!("found `{}`, expected a name that ends in `.png`: pictures are written as PNG", path.display()))
}

fn quantity(name: &str) -> Result<Quantity, String> {
    let found = Quantity::ALL.into_iter().find(|quantity| quantity.name() == name);
    found.ok_or_else(|| format!("found `{name}`, expected one of {}", Quantity::ALL.map(Quantity::name).join(", ")))
}

impl PictureArgs {
    /// The picture as an output, for the check of all outputs.
    pub(crate) fn output(&self) -> (&'static str, Option<&Path>) {
        ("--picture", self.picture.as_deref())
    }

    /// Refuses, before anything is computed, colours that a run or a sweep will not have, `without`, and panels of a garment that is no
    /// `pattern`.
    pub(crate) fn check_before(&self, pattern: bool, without: &[(Quantity, &str)]) -> anyhow::Result<()> {
        if self.picture.is_some() && self.eye.contains(&Viewpoint::Flat) && !pattern {
            refuse!("--eye flat: found no sewing pattern, expected a run with a single --pattern FILE.json");
        }
        let missing = without.iter().find(|(quantity, _)| self.picture.is_some() && self.picture_of.contains(quantity));
        if let Some((quantity, why)) = missing {
            let name = quantity.name();
            refuse!("--picture-of {name}: found {why}, expected a run that computes it");
        }
        Ok(())
    }

    /// Draws a draped garment, if a picture was requested; returns the line that names it.
    pub(crate) fn draw_run(&self, solved: &Solved) -> anyhow::Result<Option<String>> {
        let Some(path) = &self.picture else { return Ok(None) };
        let subject = subject_of_run(solved);
        self.check(&subject)?;
        let figure = |quantity, eye| self.named(subject.figure(quantity, eye, None), eye);
        let rows: Vec<Vec<Figure<'_>>> =
            self.picture_of.iter().map(|&q| self.eye.iter().map(|&eye| figure(q, eye)).collect()).collect();
        // One list of eyes or quantities is one row.
        let rows = if self.eye.len() == 1 { vec![rows.into_iter().flatten().collect()] } else { rows };
        let title = format!("{} on {}", solved.loaded.garment_name, solved.loaded.body_name);
        write_sheet(&Sheet { title, rows }, path).map(Some)
    }

    /// Draws a garment in several poses, a row for each eye and quantity, if a picture was requested.
    pub(crate) fn draw_runs(&self, all: &[Solved]) -> anyhow::Result<Option<String>> {
        let Some(path) = self.picture.as_ref().filter(|_| !all.is_empty()) else { return Ok(None) };
        let facing = Landmarks::of(all[0].loaded.scene.body.mesh()).facing;
        let subjects: Vec<Subject<'_>> =
            all.iter().map(|solved| Subject { facing, ..subject_of_run(solved) }).collect();
        subjects.iter().try_for_each(|subject| self.check(subject))?;
        let mut rows = Vec::new();
        for &quantity in &self.picture_of {
            let high = Subject::common_high(&subjects, quantity);
            for &eye in &self.eye {
                // All figures are seen from the front of the first pose.
                let row = subjects.iter().zip(all).map(|(subject, solved)| {
                    let mut figure = self.named(subject.figure(quantity, eye, high), eye);
                    figure.caption = format!("{}: {}", solved.loaded.body_name, figure.caption);
                    figure
                });
                rows.push(row.collect());
            }
        }
        let title = all[0].loaded.garment_name.clone();
        write_sheet(&Sheet { title, rows }, path).map(Some)
    }

    /// Draws the points of a sweep, if a picture was requested; returns the line that names it.
    pub(crate) fn draw_sweep(&self, name: &str, rows: &[Row], store: &PointStore) -> anyhow::Result<Option<String>> {
        let Some(path) = &self.picture else { return Ok(None) };
        let each = self.picture_of.len() * self.eye.len();
        let done: Vec<&Row> = rows.iter().filter(|row| row.status == Status::Ok).collect();
        let shown = &done[..done.len().min(MAX_FIGURES / each.max(1))];
        let mut points: Vec<(usize, StoredPoint)> = Vec::new();
        let mut scenes: Vec<(String, StoredScene, f64)> = Vec::new();
        for (at, row) in shown.iter().enumerate() {
            let Some(point) = store.point(&row.point) else { continue };
            if !scenes.iter().any(|(id, ..)| *id == point.scene) {
                let Some(scene) = store.scene(&point.scene) else { continue };
                let facing = Landmarks::of(&scene.body).facing;
                scenes.push((point.scene.clone(), scene, facing));
            }
            points.push((at, point));
        }
        let captions = captions(shown);
        let subjects: Vec<(usize, Subject<'_>)> = points
            .iter()
            .filter_map(|(at, point)| {
                let (_, scene, facing) = scenes.iter().find(|(id, ..)| *id == point.scene)?;
                Some((*at, subject_of_point(scene, point, *facing)))
            })
            .collect();
        if subjects.is_empty() {
            refuse!("--picture: found no stored point, expected one with a result");
        }
        let (places, subjects): (Vec<usize>, Vec<Subject<'_>>) = subjects.into_iter().unzip();
        subjects.iter().try_for_each(|subject| self.check(subject))?;
        let highs: Vec<Option<f64>> = self.picture_of.iter().map(|&q| Subject::common_high(&subjects, q)).collect();
        let mut figures: Vec<Vec<Figure<'_>>> = Vec::new();
        for (&at, subject) in places.iter().zip(&subjects) {
            let mut of_point = Vec::new();
            for (&quantity, &high) in self.picture_of.iter().zip(&highs) {
                for &eye in &self.eye {
                    let mut figure = subject.figure(quantity, eye, high);
                    figure.caption =
                        if each == 1 { captions[at].clone() } else { format!("{}: {}", captions[at], figure.caption) };
                    of_point.push(figure);
                }
            }
            figures.push(of_point);
        }
        let title = name.to_owned();
        let sheet = match each {
            1 => Sheet::arranged(title, figures.into_iter().flatten().collect()),
            _ => Sheet { title, rows: figures },
        };
        let mut line = write_sheet(&sheet, path)?;
        if shown.len() < done.len() {
            line += &format!(", the first {} of {} points", shown.len(), done.len());
        }
        Ok(Some(line))
    }

    /// A figure whose caption names the side only where there are several.
    fn named<'a>(&self, mut figure: Figure<'a>, eye: Viewpoint) -> Figure<'a> {
        if self.eye.len() == 1 {
            let side = format!(", {eye}");
            figure.caption = figure.caption.strip_suffix(&side).unwrap_or(&figure.caption).to_owned();
        }
        figure
    }

    /// Refuses a quantity that a subject has not.
    fn check(&self, subject: &Subject<'_>) -> anyhow::Result<()> {
        if let Some(missing) = self.picture_of.iter().find(|&&quantity| !subject.has(quantity)) {
            let with: Vec<&str> = Quantity::ALL.into_iter().filter(|&q| subject.has(q)).map(Quantity::name).collect();
            refuse!(
                "--picture-of {}: found none, because this run does not compute it; expected one of {}",
                missing.name(),
                with.join(", ")
            );
        }
        Ok(())
    }
}

fn subject_of_run(solved: &Solved) -> Subject<'_> {
    let (scene, drape) = (&solved.loaded.scene, &solved.drape);
    let flat = solved.loaded.tailored.as_ref().map(|tailored| tailored.put_on.garment.unsewn(&tailored.pattern));
    Subject {
        body: scene.body.mesh(),
        placed: &scene.garment,
        draped: scene.garment.with_positions(drape.positions.clone()),
        facing: Landmarks::of(scene.body.mesh()).facing,
        distances_m: &drape.distance,
        levels: LevelCount::all(&drape.table, &drape.parts),
        part_of_vertex: &drape.parts.part_of_vertex,
        part_force_n: drape.outcomes.iter().map(|outcome| outcome.force_n).collect(),
        overlays: solved.overlays(),
        flat,
    }
}

fn subject_of_point<'a>(scene: &'a StoredScene, point: &'a StoredPoint, facing: f64) -> Subject<'a> {
    let overlay = |name, unit, values| Overlay { name, unit, values, positions: None };
    let overlays = [
        overlay("error", "mm", &point.error_mm[..]),
        overlay("strain", "%", &point.strain_percent),
        overlay("pressure", "kPa", &point.pressure_kpa),
    ];
    Subject {
        body: &scene.body,
        placed: &scene.garment,
        draped: scene.garment.with_positions(point.positions.clone()),
        facing,
        distances_m: &scene.distances_m,
        levels: point.levels.clone(),
        part_of_vertex: &point.part_of_vertex,
        part_force_n: (&point.force_n[..]).into(),
        overlays: overlays.into_iter().filter(|overlay| !overlay.values.is_empty()).collect(),
        flat: None,
    }
}

/// The captions of rows: garment and body where they differ, the settings that differ, PARTs, and the error where it was measured.
fn captions(rows: &[&Row]) -> Vec<String> {
    let varies = |of: fn(&Row) -> &String| rows.windows(2).any(|pair| of(pair[0]) != of(pair[1]));
    let (garments, bodies) = (varies(|row| &row.garment), varies(|row| &row.body));
    let caption = |(row, label): (&&Row, String)| {
        let mut words = Vec::new();
        words.extend(bodies.then(|| stem(&row.body)));
        words.extend(garments.then(|| stem(&row.garment)));
        // Without a setting that differs the label is the table's name.
        words.extend((!(garments || bodies) || label != row.table).then_some(label));
        match &row.metrics {
            // On several bodies the fit counts.
            Some(metrics) if bodies => {
                let eases = metrics
                    .eases_cm()
                    .into_iter()
                    .filter_map(|(at, cm)| Some(format!("{at} {:+.0}", cm?.round() + 0.0)));
                words.extend(eases.take(3));
            }
            Some(metrics) => {
                words.push(format!("{} PARTs", metrics.part_count));
                words.extend(metrics.error_mm().map(|mm| format!("{mm:.1} mm")));
            }
            None => (),
        }
        words.join(", ")
    };
    rows.iter().zip(labels(rows)).map(caption).collect()
}

fn stem(label: &str) -> String {
    Path::new(label).file_stem().map_or_else(|| label.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn write_sheet(sheet: &Sheet<'_>, path: &Path) -> anyhow::Result<String> {
    let count = sheet.rows.iter().map(Vec::len).sum::<usize>();
    let bar = progress(Some(count as u64), "picture");
    let png = sheet.png(&mut || bar.inc(1));
    bar.finish_and_clear();
    write(path, png?, "--picture")?;
    Ok(format!("picture: {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_colours_and_pictures_are_checked() {
        assert_eq!(quantity("parts"), Ok(Quantity::Parts));
        assert!(quantity("heat").unwrap_err().contains("expected one of drape, placed"));
        assert!(png_file(PathBuf::from("a.PNG")).is_ok());
        assert!(png_file(PathBuf::from("a.jpg")).unwrap_err().contains("`.png`"));
    }

    #[test]
    fn captions_name_the_settings_that_differ() {
        let row = |body: &str, table: &str| Row { body: body.to_owned(), table: table.to_owned(), ..Row::default() };
        let [a, b] = ["table-3", "quantile 10"].map(|table| row("form", table));
        assert_eq!(captions(&[&a, &b]), ["table-3", "quantile 10"]);
        let [c, d] = ["EU 34", "EU 36"].map(|body| row(body, "table-3"));
        assert_eq!(captions(&[&c, &d]), ["EU 34", "EU 36"]);
    }
}
