//! Patterns put on the dress form, and meshes with open seams.

use std::ops::ControlFlow;
use std::path::Path;

use partwise::body::{BodySpec, dress_form};
use partwise::drape::{Release, drape, unobserved};
use partwise::garment::pattern::{SewingPattern, read, sew, to_svg};
use partwise::garment::sewing::Landmarks;
use partwise::mechanics::refine::Stop;
use partwise::mesh::import::{Beside, ImportOptions, import_garment};
use partwise::mesh::self_intersection::self_intersecting_pairs;
use partwise::mesh::{Axis, Front, Unit};
use partwise::scene::Loaded;
use partwise::{DVec3, SceneSpec, Settings};

fn asset(name: &str) -> String {
    format!("{}/assets/patterns/{name}.json", env!("CARGO_MANIFEST_DIR"))
}

fn tshirt() -> SewingPattern {
    read(Path::new(&asset("tshirt"))).unwrap()
}

#[test]
fn landmarks_of_the_dress_form_are_found() {
    let form = dress_form(&BodySpec::default()).unwrap();
    let found = Landmarks::of(&form);
    let near = |found: Option<f64>, expected: f64, by: f64| {
        assert!(found.is_some_and(|z| (z - expected).abs() < by), "{found:?}, expected {expected}");
    };
    // Of a stature of 1.68 m: waists lie at 0.62 to 0.67 of it, armpits at 0.73 to 0.77.
    near(found.waist_z, 1.68 * 0.645, 0.045);
    near(found.armpit_z, 1.68 * 0.75, 0.035);
    near(found.arm_fall, f64::to_radians(50.0), 0.05);
    assert!(found.middle.length() < 0.02 && found.facing == 0.0, "{found:?}");
    // A turned body has a turned front.
    let turn = glam::DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let turned = Landmarks::of(&form.with_positions(form.positions.iter().map(|&p| turn * p).collect()));
    assert!((turned.facing - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{turned:?}");
    near(turned.arm_fall, f64::to_radians(50.0), 0.05);
    // A body as large as a mountain is not cut into a thousand million slices.
    let mountain = Landmarks::of(&form.with_positions(form.positions.iter().map(|&p| 1e7 * p).collect()));
    assert_eq!((mountain.waist_z, mountain.hip_z, mountain.bust_z, mountain.shoulder_z), (None, None, None, None));
}

#[test]
fn the_front_of_a_body_in_mid_step_is_where_each_foot_points() {
    let form = dress_form(&BodySpec::default()).unwrap();
    let quarter = std::f64::consts::FRAC_PI_2;
    // The left leg ahead, on its heel; the right one behind, on its toes; and the other way round.
    for left in [1.0, -1.0] {
        let step = |p: &DVec3| {
            let ahead = if p.x * left > 0.0 { 1.0 } else { -1.0 };
            let below_hip = (0.8 - p.z).max(0.0);
            // Along the foot from its ankle, forward.
            let along = -p.y - 0.02;
            let pitch = if p.z < 0.15 { 0.4 * ahead * along } else { 0.0 };
            DVec3::new(p.x, p.y - 0.35 * ahead * below_hip, p.z + pitch)
        };
        let stepping = form.with_positions(form.positions.iter().map(step).collect());
        for turn in 0..4 {
            let angle = f64::from(turn) * quarter;
            let by = glam::DMat3::from_rotation_z(angle);
            let body = stepping.with_positions(stepping.positions.iter().map(|&p| by * p).collect());
            let off = (Landmarks::of(&body).facing - angle).rem_euclid(4.0 * quarter);
            assert!(off.min(4.0 * quarter - off) < 1e-9, "left {left}, turned {angle}: off by {off}");
        }
    }
}

#[test]
fn a_pattern_turns_to_the_front_that_is_given() {
    let turned = |front| {
        let loaded = SceneSpec { edge_cm: 3.0, front, ..SceneSpec::new("form", asset("skirt")) }.load()?;
        Ok::<f64, partwise::scene::SceneError>(loaded.tailored.unwrap().put_on.arranged.turned)
    };
    assert_eq!(turned(None).unwrap(), 0.0);
    assert_eq!(turned(Some(Front::MinusY)).unwrap(), 0.0);
    assert!((turned(Some(Front::Y)).unwrap().abs() - std::f64::consts::PI).abs() < 1e-9);
    assert!((turned(Some(Front::X)).unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
    let refusal = turned(Some(Front::Z)).unwrap_err().to_string();
    assert!(refusal.contains("--front z") && refusal.contains("z is up"), "{refusal}");
}

#[test]
fn seams_of_patterns_are_closed_outside_the_body() {
    for (name, held) in [("tshirt", false), ("skirt", true)] {
        let loaded = SceneSpec { edge_cm: 2.5, ..SceneSpec::new("form", asset(name)) }.load().unwrap();
        let scene = &loaded.scene;
        let inside =
            scene.body.nearest_all(&scene.garment.positions).iter().filter(|n| n.signed_distance < 0.0).count();
        assert_eq!(inside, 0, "{name}");
        let mut strains: Vec<f64> = (scene.garment.triangles.iter().zip(&scene.rest.corners))
            .flat_map(|(t, c)| {
                let x = t.map(|v| scene.garment.positions[v as usize]);
                [(0, 1), (1, 2), (2, 0)].map(|(i, j)| x[i].distance(x[j]) / c[i].distance(c[j]) - 1.0)
            })
            .collect();
        strains.sort_by(f64::total_cmp);
        let p95 = strains[strains.len() * 95 / 100];
        assert!(p95 < 0.1, "{name}: strain P95 {p95} before any drape");
        assert_eq!(!scene.held.is_empty(), held, "{name}");
        assert!(scene.releases_held);
        let again = SceneSpec { edge_cm: 2.5, ..SceneSpec::new("form", asset(name)) }.load().unwrap();
        assert_eq!(again.scene.garment, scene.garment);
    }
}

/// The history counts the steps before and after the release once each, and both ends are rests.
#[test]
fn a_waist_is_released_where_friction_holds_it_and_stays_held_where_it_slides() {
    let loaded = SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", asset("skirt")) }.load().unwrap();
    let scene = &loaded.scene;
    for (friction, stays) in [(0.0, false), (0.8, true)] {
        let mut settings = Settings::default();
        settings.fabric.friction = friction;
        let drape = drape(scene, &settings, &mut unobserved).unwrap();
        assert_eq!(matches!(drape.release, Some(Release::Stays { .. })), stays, "{friction}: {:?}", drape.release);
        let waist_moved = scene.held.iter().any(|&v| {
            let v = v as usize;
            drape.positions[v] != scene.garment.positions[v]
        });
        assert_eq!(waist_moved, stays, "{friction}");
        let state = drape.state.unwrap();
        assert_eq!(state.stop, Stop::Converged, "{friction}");
        assert!(state.residual_over_weight < 1e-3, "{friction}: {}", state.residual_over_weight);
        assert!(state.history.iter().enumerate().all(|(k, record)| record.iteration == k), "{friction}");
        assert_eq!(state.history.len(), state.steps + 1, "{friction}");
    }
}

/// A garment with a coarser one is released on that first: where it slides there, its waist never moves at full resolution, and where it
/// stays up, full resolution begins released.
#[test]
fn a_waist_that_slides_on_coarser_cloth_is_not_released_at_full_resolution() {
    let loaded = SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", asset("skirt")) }.load().unwrap();
    let scene = &loaded.scene;
    for (has_coarser, friction) in [(false, 0.0), (true, 0.0), (true, 0.8)] {
        let mut settings = Settings::default();
        settings.fabric.friction = friction;
        if has_coarser {
            settings.solver.nested_iteration.min_vertices = scene.garment.vertex_count() / 8;
        }
        let (mut released_steps, mut held_steps) = (0, 0);
        let drape = drape(scene, &settings, &mut |step| {
            let moved = |v: &u32| step.positions[*v as usize] != scene.garment.positions[*v as usize];
            let released = scene.held.iter().any(moved);
            released_steps += usize::from(step.iteration > 0 && released);
            held_steps += usize::from(step.iteration > 0 && !released);
            ControlFlow::Continue(())
        })
        .unwrap();
        let stays = friction > 0.0;
        assert_eq!(matches!(drape.release, Some(Release::Stays { .. })), stays, "{:?}", drape.release);
        assert_eq!(released_steps > 0, stays || !has_coarser, "{has_coarser} {friction}: {released_steps}");
        assert_eq!(held_steps == 0, stays, "{has_coarser} {friction}: {held_steps}");
        assert_eq!(drape.state.unwrap().stop, Stop::Converged);
    }
}

/// A release that is interrupted ends where it is, and is neither a slide nor a garment that stays up.
#[test]
fn an_interrupted_release_has_no_result() {
    let loaded = SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", asset("skirt")) }.load().unwrap();
    let scene = &loaded.scene;
    let mut last = Vec::new();
    let drape = drape(scene, &Settings::default(), &mut |step| {
        let moved = |v: &u32| step.positions[*v as usize] != scene.garment.positions[*v as usize];
        if step.iteration == 0 || !scene.held.iter().any(moved) {
            return ControlFlow::Continue(());
        }
        last = step.positions.to_vec();
        ControlFlow::Break(())
    })
    .unwrap();
    assert_eq!((drape.release, drape.state.unwrap().stop), (None, Stop::Interrupted));
    assert!(!last.is_empty() && drape.positions == last);
    assert!(drape.warnings.iter().all(|warning| !warning.contains("stay up")), "{:?}", drape.warnings);
}

#[test]
fn an_exported_garment_keeps_its_panels_and_its_flat_pattern() {
    let loaded = SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", asset("tshirt")) }.load().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.obj");
    let moved: Vec<DVec3> = loaded.scene.garment.positions.iter().map(|p| *p + DVec3::Z).collect();
    loaded.write(&path, &moved).unwrap();
    let options = ImportOptions { unit: Some(Unit::M), up: Some(Axis::Z), ..ImportOptions::default() };
    let back = import_garment(&path, &options, &Beside::Bounds(DVec3::ZERO, DVec3::ONE)).unwrap();
    assert_eq!(back.mesh.groups, ["front", "back"]);
    assert_eq!(back.mesh.triangles, loaded.scene.garment.triangles);
    assert_eq!(back.mesh.positions, moved);
    let rest = partwise::mesh::RestShape::from_texture(&back.mesh, &back.texture, 1.0).unwrap();
    for (a, b) in rest.areas().iter().zip(loaded.scene.rest.areas()) {
        assert!((a - b).abs() < 1e-12);
    }
    let pattern = tshirt();
    assert_eq!(pattern.stitches.len(), 8);
    assert!(to_svg(&pattern).matches("<path").count() >= 2 + 2 + 16);
}

#[test]
fn a_flat_pattern_in_texture_coordinates_is_detected() {
    // As in GarmentCode's own meshes: panels placed around the body, seams bridged by long triangles, coordinates in cm.
    let pattern = tshirt();
    let sewn = sew(&pattern, 0.02).unwrap();
    let texture: Vec<_> = sewn.laid_out(&pattern).iter().map(|c| c.map(|p| 100.0 * p)).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.obj").display().to_string();
    partwise::mesh::export::write_textured(Path::new(&path), &sewn.mesh, &texture).unwrap();
    let spec = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), ..SceneSpec::new("form", &path) };
    let found = spec.load().unwrap();
    assert_eq!(found.flat_pattern.map(|p| p.unit), Some(Some(Unit::Cm)));
    let area = |rest: &partwise::mesh::RestShape| rest.areas().iter().sum::<f64>();
    assert!((area(&found.scene.rest) / area(&sewn.rest) - 1.0).abs() < 1e-9);
    assert!(found.notes().iter().any(|note| note.contains("flat pattern") && note.contains("--rest own")));
    assert_seams_closed(&found);
    let own = SceneSpec { rest: "own".into(), ..spec }.load().unwrap();
    assert!(!own.notes().iter().any(|note| note.contains("drew open seams")), "{:?}", own.notes());
    assert_eq!(own.flat_pattern, None);
    assert!(area(&own.scene.rest) > 1.2 * area(&sewn.rest), "bridges over the seams and all");
}

#[test]
fn a_mesh_with_open_seams_has_the_rest_area_of_its_pattern() {
    let sewn = sew(&tshirt(), 0.02).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.obj").display().to_string();
    partwise::mesh::export::write_mesh(Path::new(&path), &sewn.mesh).unwrap();
    let found = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), ..SceneSpec::new("form", &path) }.load().unwrap();
    let area = |rest: &partwise::mesh::RestShape| rest.areas().iter().sum::<f64>();
    let ratio = area(&found.scene.rest) / area(&sewn.rest);
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    assert!(found.notes().iter().any(|note| note.contains("open seams") && note.contains("--rest own")));
    assert_seams_closed(&found);
}

#[test]
fn a_skirt_with_open_seams_is_closed_and_held_at_its_waist() {
    let pattern = read(Path::new(&asset("skirt"))).unwrap();
    let sewn = sew(&pattern, 0.02).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.obj").display().to_string();
    partwise::mesh::export::write_textured(Path::new(&path), &sewn.mesh, &sewn.laid_out(&pattern)).unwrap();
    let spec = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), ..SceneSpec::new("form", &path) };
    let found = spec.load().unwrap();
    assert_seams_closed(&found);
    let scene = &found.scene;
    assert!(scene.releases_held && scene.held.len() > 20, "{} held", scene.held.len());
    assert!(found.notes().iter().any(|note| note.contains("held by its top edge until it is at rest")));
    for &v in &scene.held {
        let [placed, closed] = [&sewn.mesh, &scene.garment].map(|mesh| mesh.positions[v as usize].z);
        assert!((placed - closed).abs() < 0.02, "vertex {v} went from {placed} to {closed} m");
    }
    let told = SceneSpec { hold: Some("top".into()), ..spec }.load().unwrap();
    assert!(!told.scene.releases_held);
}

/// The garment, in edges of 2 cm, has no open seam, no self-intersection and no vertex inside the body.
fn assert_seams_closed(found: &Loaded) {
    assert!(found.notes().iter().any(|note| note.contains("drew open seams")), "{:?}", found.notes());
    let (garment, body) = (&found.scene.garment, &found.scene.body);
    let sides = garment.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let ends = sides.map(|side| side.map(|v| garment.positions[v as usize]));
    let longest = ends.map(|[a, b]| a.distance(b)).fold(0.0, f64::max);
    assert!(longest < 0.06, "{longest} m");
    assert!(self_intersecting_pairs(garment).is_empty());
    assert!(body.nearest_all(&garment.positions).iter().all(|near| near.signed_distance > 0.0));
}
