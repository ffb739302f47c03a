//! The session as a state machine: the results that each edit recomputes and keeps, superseded states, refused edits. No socket,
//! and a thread in one test only.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use partwise::garment::MeshCache;
use partwise::session::{Edit, Session, Snapshot, Worker};
use partwise::study::accuracy::rms_mm;
use partwise::{Job, SceneSpec, Settings, drape};

/// A small garment, which drapes quickly.
const GARMENT: &str = "flared-skirt@900";

fn job() -> Job {
    Job { scene: SceneSpec::new("form", GARMENT), ..Job::default() }
}

fn edit(json: &str) -> Edit {
    serde_json::from_str(json).unwrap()
}

/// A session whose first state is complete.
fn settled(warm: bool) -> (Session, Worker) {
    let session = Session::new(job(), warm);
    let mut worker = Worker::new(MeshCache::in_user_cache());
    let done = work(&session, &mut worker);
    assert_eq!((done.state, done.finished.as_ref().unwrap().state), (1, 1));
    (session, worker)
}

/// Runs all tasks.
fn work(session: &Session, worker: &mut Worker) -> Snapshot {
    while worker.advance(session) {}
    let now = session.snapshot();
    assert!(now.idle);
    now
}

const TWO_LEVELS: &str = r#"{"table": {"levels": [[0, 2], [2, "inf"]]}}"#;

#[test]
fn a_bound_moves_parts_at_once_and_keeps_distances_cloth_and_rest() {
    let (session, mut worker) = settled(true);
    let before = session.snapshot();
    assert_eq!(session.submit(&edit(TWO_LEVELS), None).unwrap(), 2);
    // Before any task of the worker.
    let at_once = session.snapshot();
    let segmented = at_once.segmented.as_ref().unwrap();
    assert_eq!((segmented.state, at_once.finished.as_ref().unwrap().state), (2, 1));
    assert!(segmented.parts.len() < before.segmented.as_ref().unwrap().parts.len());
    assert!(Arc::ptr_eq(&segmented.loaded_scene, before.loaded_scene.as_ref().unwrap()));
    // The body carries the whole skirt, however it is segmented.
    let total = |s: &Snapshot| s.segmented.as_ref().unwrap().force_n.iter().map(|f| f.z).sum::<f64>();
    assert_eq!(segmented.force_n.len(), segmented.parts.len());
    let (rest, was) = (at_once.rest.as_ref().unwrap(), before.rest.as_ref().unwrap());
    assert!(rest.reused && rest.state == 2 && Arc::ptr_eq(&rest.positions, &was.positions));
    let done = work(&session, &mut worker);
    let finished = done.finished.as_ref().unwrap();
    assert!(finished.state == 2 && Arc::ptr_eq(&finished.loaded_scene, before.loaded_scene.as_ref().unwrap()));
    let preview = done.preview.as_ref().unwrap();
    assert!(preview.state == 2 && preview.done);
    assert!((total(&done) - total(&at_once)).abs() < 1e-12);
    assert!(finished.preview_error_mm.unwrap() > 0.1);
    assert_eq!(done.trail.iter().map(|p| p.state).collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn a_fabric_keeps_the_parts_and_starts_at_the_previous_drape() {
    let (session, mut worker) = settled(true);
    let before = session.snapshot();
    let steps: Arc<Mutex<Vec<(bool, bool, f64)>>> = Arc::default();
    let (handle, log) = (session.clone(), Arc::clone(&steps));
    session.listen(move |_| {
        if let Some(rest) = handle.snapshot().rest.as_ref().filter(|rest| rest.state == 2) {
            log.lock().unwrap().push((rest.balanced, rest.done, rest.residual_over_weight));
        }
    });
    session.submit(&edit(r#"{"fabric": "ponte"}"#), None).unwrap();
    let at_once = session.snapshot();
    let parts = |s: &Snapshot| Arc::clone(&s.segmented.as_ref().unwrap().parts);
    assert!(Arc::ptr_eq(&parts(&at_once), &parts(&before)));
    assert_eq!(at_once.rest.as_ref().unwrap().state, 1, "another fabric rests elsewhere");
    let done = work(&session, &mut worker);
    let rest = done.rest.as_ref().unwrap();
    assert!(rest.state == 2 && rest.warm && rest.done && rest.residual_over_weight < 1e-3);
    let steps = steps.lock().unwrap();
    let balanced = steps.iter().find(|rest| rest.0).unwrap();
    assert!(!balanced.1 && balanced.2 < 1e-3, "published before the test for stability: {steps:?}");
    assert!(steps.iter().skip_while(|rest| !rest.0).all(|rest| rest.0), "once balanced, it stays balanced: {steps:?}");
    assert_eq!(done.finished.as_ref().unwrap().metrics.penetrating_vertices, 0);
    assert!(rms_mm(&rest.positions, &before.rest.as_ref().unwrap().positions) > 0.1);
}

#[test]
fn an_earlier_fabric_reuses_its_rest_and_the_next_fabric_starts_from_it() {
    let (session, mut worker) = settled(true);
    let interlock = session.snapshot().rest.unwrap();
    let fabric = |name: &str| edit(&format!(r#"{{"fabric": "{name}"}}"#));
    session.submit(&fabric("ponte"), None).unwrap();
    let ponte = work(&session, &mut worker).rest.unwrap();
    // The forces are those of the PARTs of the newer table.
    session.submit(&edit(TWO_LEVELS), None).unwrap();
    session.submit(&fabric("interlock"), None).unwrap();
    let at_once = session.snapshot();
    let rest = at_once.rest.as_ref().unwrap();
    assert!(rest.reused && rest.done && rest.state == 4 && Arc::ptr_eq(&rest.positions, &interlock.positions));
    let total = |s: &Snapshot| s.segmented.as_ref().unwrap().force_n.iter().map(|f| f.z).sum::<f64>();
    let done = work(&session, &mut worker);
    assert_eq!(total(&done), total(&at_once));
    assert_eq!(done.finished.as_ref().unwrap().drape.positions, *interlock.positions);
    let keep_first = |first: &mut Option<Arc<Vec<partwise::DVec3>>>, snapshot: Snapshot| {
        let rest = snapshot.rest.filter(|rest| rest.state == snapshot.state && !rest.reused);
        *first = first.take().or(rest.map(|rest| Arc::clone(&rest.positions)));
    };
    let first: Arc<Mutex<Option<Arc<Vec<partwise::DVec3>>>>> = Arc::default();
    let (handle, log) = (session.clone(), Arc::clone(&first));
    session.listen(move |_| keep_first(&mut log.lock().unwrap(), handle.snapshot()));
    session.submit(&fabric("rib-knit"), None).unwrap();
    work(&session, &mut worker);
    let first = first.lock().unwrap().take().unwrap();
    let off = |other: &[partwise::DVec3]| rms_mm(&first, other);
    assert!(off(&interlock.positions) < off(&ponte.positions), "it starts from the current drape");
    // Other settings of self-contact and another form have another rest.
    for change in
        [r#"{"fabric": "ponte", "self_contact": false}"#, r#"{"fabric": "ponte", "measurements": {"waist": 76}}"#]
    {
        session.submit(&edit(change), None).unwrap();
        assert!(session.snapshot().rest.is_none_or(|rest| rest.state < session.snapshot().state), "{change}");
        work(&session, &mut worker);
    }
}

#[test]
fn a_fabric_is_refused_if_every_panel_has_its_own_and_accepted_for_another_garment() {
    let own = SceneSpec { fabrics: vec!["denim".to_owned()], ..job().scene };
    let session = Session::new(Job { scene: own, ..job() }, true);
    let mut worker = Worker::new(MeshCache::in_user_cache());
    work(&session, &mut worker);
    let error = session.submit(&edit(r#"{"fabric": "ponte"}"#), None).unwrap_err().to_string();
    assert!(error.contains("fabric") && error.contains("all have their own"), "{error}");
    session.submit(&edit(r#"{"garment": "pullover-1@600", "fabric": "ponte"}"#), None).unwrap();
    let done = work(&session, &mut worker);
    let scene = &done.finished.as_ref().unwrap().loaded_scene.input.scene;
    assert_eq!(scene.fabric_names(&done.job.settings.fabric), "ponte");
}

#[test]
fn a_measurement_makes_another_form_and_refits_the_garment() {
    let (session, mut worker) = settled(true);
    session.submit(&edit(r#"{"measurements": {"waist": 76}}"#), None).unwrap();
    let done = work(&session, &mut worker);
    let loaded_scene = done.loaded_scene.as_ref().unwrap();
    assert_eq!((loaded_scene.generation, loaded_scene.spec.measurements.waist_cm), (2, 76.0));
    assert_eq!(done.finished.as_ref().unwrap().state, 2);
}

#[test]
fn without_warm_starts_a_session_is_a_run_bit_for_bit() {
    let (session, mut worker) = settled(false);
    for change in [TWO_LEVELS, r#"{"fabric": "denim"}"#, r#"{"max_extent_cm": [24, 12]}"#] {
        session.submit(&edit(change), None).unwrap();
        let done = work(&session, &mut worker);
        let scene = &done.loaded_scene.as_ref().unwrap().input.scene;
        let run = drape::drape(scene, &done.job.settings, &mut drape::unobserved).unwrap();
        let finished = done.finished.as_ref().unwrap();
        assert_eq!(finished.drape.preview, run.preview, "{change}");
        assert_eq!(finished.drape.positions, run.positions, "{change}");
        assert_eq!(finished.drape.parts, run.parts, "{change}");
        assert_eq!(finished.metrics, partwise::study::metrics::Metrics::of(scene, &run), "{change}");
    }
}

#[test]
fn both_stages_equal_those_of_a_run_after_warm_edits() {
    let (session, mut worker) = settled(true);
    for bound in [1.0, 1.5, 3.0, 2.0] {
        let change = edit(&format!(r#"{{"table": {{"levels": [[0, {bound}], [{bound}, "inf"]]}}}}"#));
        session.submit(&change, None).unwrap();
        worker.advance(&session);
    }
    let done = work(&session, &mut worker);
    let scene = &done.loaded_scene.as_ref().unwrap().input.scene;
    let settings = Settings { refine: drape::Refine::Steps(0), ..done.job.settings.clone() };
    let run = drape::drape(scene, &settings, &mut drape::unobserved).unwrap();
    assert_eq!(done.finished.as_ref().unwrap().drape.preview, run.preview);
}

#[test]
fn a_newer_edit_supersedes_an_older_one() {
    let (session, mut worker) = settled(true);
    for bound in [1.0, 1.5, 3.0] {
        let change = edit(&format!(r#"{{"table": {{"levels": [[0, {bound}], [{bound}, "inf"]]}}}}"#));
        session.submit(&change, Some(7)).unwrap();
    }
    session.submit(&edit(r#"{"fabric": "ponte"}"#), None).unwrap();
    let done = work(&session, &mut worker);
    // No edit is lost: the last state has the last of each.
    assert_eq!((done.state, done.superseded), (5, 3));
    assert_eq!(done.finished.as_ref().unwrap().drape.table.levels[0].upper_cm, 3.0);
    assert_eq!(done.job.settings.fabric.name, "ponte");
    // The drag is one step of undo.
    assert_eq!((done.undo, done.redo), (2, 0));
    session.undo().unwrap();
    session.undo().unwrap();
    assert_eq!(*session.snapshot().job, job());
    assert!(session.undo().unwrap_err().to_string().contains("undo"));
    session.redo().unwrap();
    assert_eq!(session.snapshot().segmented.as_ref().unwrap().table.levels[0].upper_cm, 3.0);
    assert_eq!(work(&session, &mut worker).finished.as_ref().unwrap().state, 8);
}

#[test]
fn an_edit_during_a_step_interrupts_the_work_and_results_keep_their_state() {
    let (session, mut worker) = settled(true);
    let seen: Arc<Mutex<Vec<(u64, u64)>>> = Arc::default();
    let (handle, log, edits) = (session.clone(), Arc::clone(&seen), AtomicUsize::new(0));
    session.listen(move |_| {
        let now = handle.snapshot();
        if let Some(preview) = &now.preview {
            log.lock().unwrap().push((now.state, preview.state));
            // The first step of the second state's preview submits the third.
            if preview.state == 2 && edits.fetch_add(1, Ordering::SeqCst) == 0 {
                handle.submit(&edit(r#"{"gap": "extend-upper"}"#), None).unwrap();
            }
        }
    });
    session.submit(&edit(r#"{"table": "flared-skirt-levels"}"#), None).unwrap();
    let done = work(&session, &mut worker);
    let seen = seen.lock().unwrap();
    let of_second = seen.iter().filter(|(_, preview)| *preview == 2).count();
    // One step was published, and is still the newest preview before the third state's own first step.
    assert!(of_second >= 1 && seen.iter().all(|(state, preview)| preview <= state), "{seen:?}");
    assert_eq!((done.state, done.preview.as_ref().unwrap().state), (done.finished.as_ref().unwrap().state, done.state));
    assert!(done.superseded >= 1);
}

#[test]
fn a_bad_edit_is_refused_and_the_last_good_state_remains() {
    let (session, mut worker) = settled(true);
    for (change, words) in [
        (r#"{"table": {"levels": [[90, 95]]}}"#, "none of the garment's vertices"),
        (r#"{"garment": "kimono"}"#, "kimono"),
        (r#"{"measurements": {"bust": 20}}"#, "bust"),
        (r#"{"table": {"quantile": 0}}"#, "levels"),
    ] {
        let error = session.submit(&edit(change), None).unwrap_err().to_string();
        assert!(error.contains(words), "{change}: {error}");
        let now = session.snapshot();
        assert!(now.state == 1 && now.idle && *now.job == job(), "{change}");
    }
    // A missing file is detected only by the worker.
    assert_eq!(session.submit(&edit(r#"{"garment": "nowhere.obj"}"#), None).unwrap(), 2);
    session.submit(&edit(TWO_LEVELS), None).unwrap();
    let done = work(&session, &mut worker);
    let refused = done.refused.as_ref().unwrap();
    assert!(refused.sentence.contains("nowhere.obj"), "{}", refused.sentence);
    assert_eq!((refused.state, refused.back_to, done.finished.as_ref().unwrap().state), (3, Some(4), 4));
    // The later table remains; the missing garment does not, and undo does not restore it.
    assert_eq!((done.job.scene.garment.as_str(), done.job.settings.table.name()), (GARMENT, "edited"));
    session.undo().unwrap();
    assert_eq!(session.snapshot().job.scene.garment, GARMENT);
}

#[test]
fn a_panic_in_the_worker_refuses_the_edit_and_the_session_goes_on() {
    let (session, mut worker) = settled(true);
    let armed = Arc::new(std::sync::atomic::AtomicBool::new(false));
    let trap = Arc::clone(&armed);
    // Listeners run on the worker's thread, in the middle of its work.
    session.listen(move |_| assert!(!trap.swap(false, Ordering::SeqCst), "the trap of this test"));
    for (change, state) in [(r#"{"fabric": "denim"}"#, 2), (r#"{"garment": "pullover-1@600"}"#, 4)] {
        assert_eq!(session.submit(&edit(change), None).unwrap(), state);
        armed.store(true, Ordering::SeqCst);
        let done = work(&session, &mut worker);
        let refused = done.refused.as_ref().unwrap();
        assert_eq!((refused.state, refused.back_to), (state, Some(state + 1)), "{}", refused.sentence);
        assert!(refused.sentence.contains("fault of the program") && !refused.sentence.contains("trap"));
        assert_eq!((&*done.job, done.finished.as_ref().unwrap().state), (&job(), state + 1));
    }
    session.submit(&edit(r#"{"fabric": "denim"}"#), None).unwrap();
    let done = work(&session, &mut worker);
    assert!(done.refused.is_none() && done.finished.as_ref().unwrap().state == 6);
}

#[test]
fn an_edit_of_a_measurement_that_makes_no_form_is_refused_at_once() {
    let (session, _) = settled(true);
    let refused = session.submit(&edit(r#"{"measurements": {"crotch_height": 49}}"#), None).unwrap_err().to_string();
    assert!(refused.contains("crotch_height") && refused.contains("knee_height"), "{refused}");
    assert_eq!(session.snapshot().state, 1);
}

#[test]
fn a_reload_of_broken_files_keeps_the_previous_scene() {
    let folder = tempfile::tempdir().unwrap();
    let form = folder.path().join("me.toml");
    std::fs::write(&form, "waist_cm = 74\n").unwrap();
    let job = Job { scene: SceneSpec::new(form.to_str().unwrap(), GARMENT), ..Job::default() };
    let session = Session::new(job.clone(), true);
    let mut worker = Worker::new(MeshCache::in_user_cache());
    let before = work(&session, &mut worker);
    std::fs::write(&form, "waist_cm = 7\n").unwrap();
    session.reload(job.clone()).unwrap();
    let after = work(&session, &mut worker);
    assert!(after.refused.as_ref().unwrap().sentence.contains("me.toml"));
    assert!(Arc::ptr_eq(after.loaded_scene.as_ref().unwrap(), before.loaded_scene.as_ref().unwrap()));
    std::fs::write(&form, "waist_cm = 78\n").unwrap();
    session.reload(job).unwrap();
    let repaired = work(&session, &mut worker);
    assert!(repaired.refused.is_none() && repaired.loaded_scene.as_ref().unwrap().generation == 2);
}

#[test]
fn a_first_state_that_fails_is_refused_and_the_next_edit_repairs_it() {
    let session = Session::new(Job { scene: SceneSpec::new("form", "nowhere.obj"), ..Job::default() }, true);
    let mut worker = Worker::new(MeshCache::in_user_cache());
    let done = work(&session, &mut worker);
    assert_eq!(done.refused.as_ref().unwrap().back_to, None);
    session.submit(&edit(&format!(r#"{{"garment": "{GARMENT}"}}"#)), None).unwrap();
    assert!(work(&session, &mut worker).finished.is_some());
}

#[test]
fn a_pin_keeps_its_state() {
    let (session, mut worker) = settled(true);
    let id = session.pin(Some("as it was".to_owned())).unwrap();
    session.submit(&edit(r#"{"fabric": "ponte"}"#), None).unwrap();
    assert!(session.pin(None).unwrap_err().to_string().contains("no drape"));
    let done = work(&session, &mut worker);
    let pin = &done.pins[0];
    assert_eq!(
        (pin.id, pin.state, pin.label.as_str(), pin.job.settings.fabric.name.as_str()),
        (id, 1, "as it was", "interlock")
    );
    assert!(pin.numbers.preview_error_mm.unwrap() > 0.0);
    assert!(*pin.positions != *done.rest.as_ref().unwrap().positions);
    assert!(session.unpin(id) && !session.unpin(id));
}

#[test]
fn a_worker_thread_runs_until_the_session_is_closed() {
    let session = Session::new(job(), true);
    let worker = {
        let session = session.clone();
        std::thread::spawn(move || Worker::new(MeshCache::in_user_cache()).run(&session))
    };
    let mut now = session.snapshot();
    while !now.idle {
        now = session.newer_than(now.serial, std::time::Duration::from_secs(60));
    }
    session.close();
    worker.join().unwrap();
    assert_eq!(now.finished.unwrap().state, 1);
}

#[test]
fn held_vertices_are_released_and_reported_as_run_does() {
    let garment = format!("{}/assets/patterns/skirt.json", env!("CARGO_MANIFEST_DIR"));
    let job = Job { scene: SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", garment) }, ..Job::default() };
    let session = Session::new(job.clone(), false);
    let mut worker = Worker::new(MeshCache::in_user_cache());
    let done = work(&session, &mut worker);
    let run = drape::drape(&job.scene.load().unwrap().scene, &job.settings, &mut drape::unobserved).unwrap();
    let finished = &done.finished.as_ref().unwrap().drape;
    assert!(run.release.is_some());
    assert_eq!((finished.release, &finished.positions), (run.release, &run.positions));
    assert_eq!(finished.warnings, run.warnings);
}
