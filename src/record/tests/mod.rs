//! The contents of recordings.
//!
//! With `PARTWISE_KEEP=FOLDER` the recordings are kept there for inspection.

#[path = "../../../tests/inspect/mod.rs"]
mod inspect;
mod scene;
mod served;

use std::path::{Path, PathBuf};

use super::wrinkles::WrinkleView;
use super::{
    Colours, Compared, Layout, Overlay, Picture, RecordError, RecordOptions, RecordSummary, Recorder, ScatterPoint,
    Sink, StepView, Tab, paths,
};
use scene::{PAPER_LIKE, Scene, Solved};

/// A temporary folder, or that of `PARTWISE_KEEP`.
struct Folder {
    path: PathBuf,
    _temporary: tempfile::TempDir,
}

impl Folder {
    fn new() -> Self {
        let temporary = tempfile::tempdir().unwrap();
        let path = std::env::var_os("PARTWISE_KEEP").map_or_else(|| temporary.path().to_owned(), Into::into);
        Self { path, _temporary: temporary }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

fn options(path: &Path, layout: Layout) -> RecordOptions {
    RecordOptions {
        sinks: vec![Sink::File(path.to_owned())],
        name: "flared dress".into(),
        layout,
        ..RecordOptions::default()
    }
}

fn step<'a>(index: i64, scene: &'a Scene, solved: &'a Solved, overlays: &'a [Overlay<'a>]) -> StepView<'a> {
    StepView {
        index,
        distances_m: &scene.distances_m,
        part_of_vertex: &solved.part_of_vertex,
        part_force_n: &solved.part_force_n,
        draped: &scene.draped,
        panel: &solved.panel,
        scalars: &[],
        overlays,
    }
}

fn record_one(path: &Path, fineness: u32) -> RecordSummary {
    let scene = Scene::new(fineness);
    let solved = scene.solve("Table 3", &PAPER_LIKE);
    let mut recorder = Recorder::open(options(path, Layout::default())).unwrap();
    recorder.body(0, &scene.body).unwrap();
    recorder.garment(0, &scene.garment).unwrap();
    recorder.step(&step(0, &scene, &solved, &[])).unwrap();
    recorder.finish().unwrap()
}

#[test]
fn a_recording_has_every_documented_path_the_timelines_and_a_blueprint() {
    let folder = Folder::new();
    let path = folder.file("one.rrd");
    let summary = record_one(&path, 2);
    assert_eq!(summary.path.as_deref(), Some(path.as_path()));
    assert_eq!(summary.bytes, std::fs::metadata(&path).unwrap().len());
    let contents = inspect::read(&path);
    assert_eq!(contents.recordings, 1);
    let bars = ["levels", "distance", "force"]
        .map(|of| ["bar", "ticks"].map(|leaf| format!("{}/{of}/{leaf}", paths::STAGES_LEGEND)));
    let others = [paths::BODY, paths::GARMENT, paths::DISTANCE, paths::PARTS, paths::FORCE, paths::FORCE_ARROWS];
    let others = others.into_iter().chain([
        paths::DRAPE,
        paths::REPORT,
        paths::PART_DOTS,
        "/numbers/part_count",
        "/legend/stages/table",
    ]);
    for wanted in others.chain(bars.as_flattened().iter().map(String::as_str)) {
        assert!(contents.entities.contains_key(wanted), "{wanted} is missing of {:?}", contents.entities.keys());
    }
    for wanted in ["/viewport", "/time_panel", "/selection_panel", "/blueprint_panel"] {
        assert!(contents.blueprint.contains_key(wanted), "{wanted} is missing of {:?}", contents.blueprint);
    }
    let views: Vec<&str> = contents.blueprint.keys().filter_map(|p| p.strip_suffix("/EyeControls3D")).collect();
    assert_eq!(views.len(), 4, "one eye a stage");
    for view in views {
        let background = &contents.blueprint[&format!("{view}/Background")];
        assert!(background.contains("Background:kind"), "{background:?}");
        assert!(!background.contains("Background:color"), "a fixed colour is wrong in one of the viewer's themes");
    }
    for mesh in [paths::BODY, paths::GARMENT, paths::DISTANCE, paths::PARTS, paths::FORCE, paths::DRAPE] {
        let components = &contents.entities[mesh].components;
        assert!(components.contains("Mesh3D:vertex_normals"), "{mesh} would be drawn unlit: {components:?}");
        assert!(components.contains("Mesh3D:triangle_indices"), "{mesh}");
    }
    let timelines = &contents.entities[paths::DRAPE].timelines;
    assert!([paths::TABLE, paths::STAGE].iter().all(|&t| timelines.contains(t)), "{timelines:?}");
    assert!(contents.entities[paths::BODY].timelines.is_empty(), "the body is static");
    let all = contents.entities.values().flat_map(|e| &e.timelines);
    assert!(all.clone().all(|t| t == paths::TABLE || t == paths::STAGE), "{:?}", all.collect::<Vec<_>>());
}

#[test]
fn a_sweep_logs_the_triangles_once_and_has_all_tables() {
    let folder = Folder::new();
    let scene = Scene::new(2);
    let tables: Vec<(String, Vec<f64>)> = [1.0, 0.7, 0.4, 1.6]
        .iter()
        .map(|&f| (format!("Table 3 × {f}"), PAPER_LIKE.iter().map(|b| b * f).collect()))
        .chain([("three levels".to_owned(), vec![2.0, 9.0])])
        .collect();
    let record = |name: &str, count: usize| {
        let layout = Layout {
            several_tables: count > 1,
            error: true,
            compare: tables.iter().take(4).map(|(name, _)| name.clone()).collect(),
            scatter: true,
            opens_on: match name {
                "sweep-side.rrd" => Tab::SideBySide,
                "sweep-numbers.rrd" => Tab::Numbers,
                _ => Tab::Stages,
            },
            ..Layout::default()
        };
        let mut recorder = Recorder::open(options(&folder.file(name), layout)).unwrap();
        recorder.body(0, &scene.body).unwrap();
        recorder.garment(0, &scene.garment).unwrap();
        let mut points = Vec::new();
        for (i, (name, bounds)) in tables.iter().take(count).enumerate() {
            let mut solved = scene.solve(name, bounds);
            let ms = 1.0 + 0.9 * i as f64;
            solved.panel.timings_ms[3].1 = ms;
            let error: Vec<f64> = scene.distances_m.iter().map(|d| 1e3 * d / ms).collect();
            let rms = (error.iter().map(|e| e * e).sum::<f64>() / error.len() as f64).sqrt();
            let overlays = [Overlay { name: "error", unit: "mm", values: &error, positions: None }];
            let scalars = [("error/rms_mm", rms)];
            recorder.step(&StepView { scalars: &scalars, ..step(i as i64, &scene, &solved, &overlays) }).unwrap();
            let caption = format!("{} PARTs · {ms:.1} ms · {rms:.0} mm", solved.part_force_n.len());
            let (draped, part_of_vertex) = (&scene.draped, &solved.part_of_vertex);
            if i < 4 {
                let levels = &solved.panel.levels;
                let compared = Compared {
                    index: 0,
                    slot: i,
                    caption: &caption,
                    draped,
                    colours: Colours::Parts { part_of_vertex, levels },
                };
                recorder.compare(&compared).unwrap();
            }
            points.push(ScatterPoint { label: name, x: ms, y: rms, group: 0, named: true });
        }
        recorder.scatter(0, Picture::of_error("time, ms"), &points).unwrap();
        recorder.finish().unwrap()
    };
    let one = record("sweep-one.rrd", 1);
    let five = record("sweep.rrd", 5);
    if std::env::var_os("PARTWISE_KEEP").is_some() {
        record("sweep-side.rrd", 5);
        record("sweep-numbers.rrd", 5);
    }
    let contents = inspect::read(&five.path.unwrap());
    for fixed in [paths::BODY, paths::GARMENT, paths::PARTS, paths::DRAPE, "/error/garment"] {
        assert!(contents.entities[fixed].components.contains("Mesh3D:triangle_indices"), "{fixed}");
    }
    assert_eq!(contents.entities[paths::BODY].fixed_rows, 1);
    assert_eq!(contents.entities[paths::DISTANCE].rows, 1, "the distance is the same for every table");
    let dictionary = include_str!("../../../docs/columns.md");
    for column in &contents.entities[paths::ROWS].components {
        let name = column.rsplit(':').next().unwrap();
        assert!(name == "Table" || dictionary.contains(&format!("`{name}`")), "docs/columns.md lacks {name}");
    }
    for path in ["/numbers/part_count", "/numbers/ms/mechanics", "/numbers/error/rms_mm", paths::ROWS] {
        assert!(contents.entities[path].timelines.contains(paths::TABLE), "{path}");
        let named = path == paths::ROWS || contents.entities[path].components.contains("SeriesLines:names");
        assert!(named, "the line {path} has no name");
    }
    for slot in 0..4 {
        assert!(contents.entities.contains_key(&format!("{}/{slot}/garment", paths::COMPARE)));
    }
    assert!(contents.entities.contains_key("/scatter/points"));
    // Each further table logs a vertex's drape (24 bytes) and colours. Triangles and positions as loaded, 24 + 24 bytes for each of five
    // meshes and thirteen times that for the cells, are not logged again.
    let per_vertex = (five.raw_bytes - one.raw_bytes) / (4 * scene.garment.positions.len() as u64);
    assert!(per_vertex < 700, "{per_vertex} bytes a vertex and table");
    assert!(five.bytes as f64 <= 1.3 * five.raw_bytes as f64, "{} of {} bytes", five.bytes, five.raw_bytes);
}

#[test]
fn all_stages_are_on_the_solvers_timeline_and_overlays_have_legends() {
    let folder = Folder::new();
    let scene = Scene::new(2);
    let solved = scene.solve("Table 3", &PAPER_LIKE);
    let fit = vec!["strain".to_owned(), "pressure".to_owned()];
    let layout = Layout { iterations: true, fit, wrinkles: true, opens_on: Tab::Fit, ..Layout::default() };
    let mut recorder = Recorder::open(options(&folder.file("solver.rrd"), layout)).unwrap();
    recorder.body(0, &scene.body).unwrap();
    recorder.garment(0, &scene.garment).unwrap();
    for i in 0..40 {
        let left = 0.8f64.powi(i);
        let mix = |(&a, &b): (&glam::DVec3, &glam::DVec3)| a.lerp(b, 1.0 - left);
        let at: Vec<glam::DVec3> = scene.garment.positions.iter().zip(&scene.draped).map(mix).collect();
        recorder.iteration(i.into(), 2.0 + left, left, (i % 4 == 0).then_some(at.as_slice())).unwrap();
    }
    let strain: Vec<f64> = scene.draped.iter().map(|p| 8.0 * (1.4 - p.z).max(0.0)).collect();
    let pressure: Vec<f64> = scene.distances_m.iter().map(|d| (0.02 - d).max(0.0) * 60.0).collect();
    let overlays = [
        Overlay { name: "strain", unit: "%", values: &strain, positions: None },
        Overlay { name: "pressure", unit: "kPa", values: &pressure, positions: None },
    ];
    recorder.step(&step(0, &scene, &solved, &overlays)).unwrap();
    let part = &solved.part_of_vertex;
    let edges = scene.garment.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let joining = edges.filter(|&[a, b]| a < b && part[a as usize] != part[b as usize]);
    let jumps_mm: Vec<([u32; 2], f64)> = joining.map(|edge| (edge, f64::from(edge[0]))).collect();
    assert!(!jumps_mm.is_empty());
    let curvature_per_m = vec![1.0; scene.draped.len()];
    let (draped, curvature_per_m) = (scene.draped.as_slice(), curvature_per_m.as_slice());
    let view = WrinkleView { index: 0, draped, jumps_mm: &jumps_mm, curvature_per_m };
    recorder.wrinkles(&view).unwrap();
    let error = recorder.wrinkles(&WrinkleView { curvature_per_m: &[], ..view }).unwrap_err();
    assert!(matches!(error, RecordError::Mismatch { .. }), "{error}");
    let contents = inspect::read(&recorder.finish().unwrap().path.unwrap());
    for path in ["/wrinkles/seams/lines", "/wrinkles/curvature/garment"] {
        assert!(contents.entities.contains_key(path), "{path}");
    }
    for path in ["seams/bar", "curvature/ticks"] {
        assert!(contents.entities.contains_key(&format!("{}/{path}", paths::WRINKLES_LEGEND)), "{path}");
    }
    for path in [paths::ENERGY, paths::RESIDUAL] {
        assert_eq!(contents.entities[path].rows, 40);
        assert_eq!(contents.entities[path].timelines.iter().collect::<Vec<_>>(), [paths::ITERATION]);
    }
    // Every tab has data on the timeline that the recording opens on.
    for path in [paths::PARTS, paths::FORCE, paths::REPORT, "/fit/strain/garment"] {
        assert!(contents.entities[path].timelines.contains(paths::ITERATION), "{path}");
    }
    assert!(contents.entities[paths::DRAPE].timelines.contains(paths::ITERATION));
    // A mesh at every fourth iteration, that of the step, and the result at the last iteration.
    assert_eq!(contents.entities[paths::DRAPE].rows, 10 + 1 + 1);
    for name in ["strain", "pressure"] {
        assert!(contents.entities.contains_key(&format!("{}/{name}/garment", paths::FIT)), "{name}");
        for leaf in ["bar", "ticks"] {
            assert!(contents.entities.contains_key(&format!("{}/{name}/{leaf}", paths::FIT_LEGEND)), "{name} {leaf}");
        }
    }
}

#[test]
fn a_watched_recording_accepts_new_steps_and_new_meshes() {
    let folder = Folder::new();
    let (small, large) = (Scene::new(1), Scene::new(2));
    let mut options = options(&folder.file("watched.rrd"), Layout { several_tables: true, ..Layout::default() });
    options.replaceable = true;
    let mut recorder = Recorder::open(options).unwrap();
    for (index, scene) in [&small, &small, &large].into_iter().enumerate() {
        let index = index as i64;
        let solved = scene.solve("Table 3", &PAPER_LIKE);
        recorder.body(index, &scene.body).unwrap();
        recorder.garment(index, &scene.garment).unwrap();
        recorder.step(&step(index, scene, &solved, &[])).unwrap();
    }
    recorder.notice(2, "table.toml, line 4: upper value 3 below lower value 5").unwrap();
    let contents = inspect::read(&recorder.finish().unwrap().path.unwrap());
    assert_eq!(contents.entities[paths::BODY].rows, 1, "the body is unchanged");
    assert_eq!(contents.entities[paths::GARMENT].rows, 2, "the garment changed once");
    assert_eq!(contents.entities[paths::DRAPE].fixed_rows, 0, "static data cannot be replaced at a step");
    assert_eq!(contents.entities[paths::REPORT].rows, 4, "three steps and the message");
}

#[test]
fn without_a_sink_nothing_is_recorded() {
    let scene = Scene::new(1);
    let solved = scene.solve("Table 3", &PAPER_LIKE);
    let mut recorder = Recorder::open(RecordOptions::default()).unwrap();
    recorder.body(0, &scene.body).unwrap();
    recorder.garment(0, &scene.garment).unwrap();
    recorder.step(&step(0, &scene, &solved, &[])).unwrap();
    assert_eq!(recorder.finish().unwrap(), RecordSummary::default());
}

#[test]
fn a_recording_that_is_not_finished_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.rrd");
    let mut recorder = Recorder::open(options(&path, Layout::default())).unwrap();
    recorder.body(0, &Scene::new(1).body).unwrap();
    drop(recorder);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_step_that_does_not_fit_the_garment_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::new(1);
    let solved = scene.solve("Table 3", &PAPER_LIKE);
    let mut recorder = Recorder::open(options(&folder.path().join("x.rrd"), Layout::default())).unwrap();
    recorder.garment(0, &scene.garment).unwrap();
    let short = StepView { draped: &scene.draped[1..], ..step(0, &scene, &solved, &[]) };
    let error = recorder.step(&short).unwrap_err();
    let count = scene.draped.len();
    assert!(error.to_string().contains(&format!("{} values for {count} vertices", count - 1)), "{error}");
}
