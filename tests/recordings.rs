//! What a recording holds, and what happens where it cannot be written.
//!
//! With `PARTWISE_KEEP=FOLDER` the recordings stay there to be looked at.
#![cfg(feature = "viewer")]

mod scene;

use std::path::{Path, PathBuf};

use partwise::record::{Layout, Overlay, RecordOptions, RecordSummary, Recorder, Sink, StepView, inspect, paths};
use scene::{PAPER_LIKE, Scene, Solved};

/// A folder that goes away, or the one asked for.
struct Folder(Option<tempfile::TempDir>, PathBuf);

impl Folder {
    fn new() -> Self {
        match std::env::var_os("PARTWISE_KEEP") {
            Some(kept) => Self(None, kept.into()),
            None => {
                let folder = tempfile::tempdir().unwrap();
                let path = folder.path().to_owned();
                Self(Some(folder), path)
            }
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.1.join(name)
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
        distance_m: &scene.distance_m,
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
fn a_recording_holds_every_documented_path_the_timelines_and_a_blueprint() {
    let folder = Folder::new();
    let path = folder.file("one.rrd");
    let summary = record_one(&path, 2);
    assert_eq!(summary.path.as_deref(), Some(path.as_path()));
    assert_eq!(summary.bytes, std::fs::metadata(&path).unwrap().len());
    let contents = inspect::read(&path).unwrap();
    assert_eq!(contents.recordings, 1);
    for wanted in paths::ALWAYS {
        assert!(contents.entities.contains_key(wanted), "{wanted} is missing of {:?}", contents.entities.keys());
    }
    for wanted in ["/viewport", "/time_panel", "/selection_panel", "/blueprint_panel"] {
        assert!(contents.blueprint.contains(wanted), "{wanted} is missing of {:?}", contents.blueprint);
    }
    let eyes = contents.blueprint.iter().filter(|p| p.ends_with("/EyeControls3D")).count();
    assert_eq!(eyes, 4, "one eye a stage");
    for mesh in [paths::BODY, paths::GARMENT, paths::DISTANCE, paths::PARTS, paths::FORCE, paths::DRAPE] {
        let components = &contents.entities[mesh].components;
        assert!(components.contains("Mesh3D:vertex_normals"), "{mesh} would be drawn unlit: {components:?}");
        assert!(components.contains("Mesh3D:triangle_indices"), "{mesh}");
    }
    let timelines = &contents.entities[paths::DRAPE].timelines;
    assert!([paths::TABLE, paths::STAGE].iter().all(|&t| timelines.contains(t)), "{timelines:?}");
    assert!(contents.entities[paths::BODY].timelines.is_empty(), "the body is logged once for all");
    let all = contents.entities.values().flat_map(|e| &e.timelines);
    assert!(all.clone().all(|t| t == paths::TABLE || t == paths::STAGE), "{:?}", all.collect::<Vec<_>>());
}
