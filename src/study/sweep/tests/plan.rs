//! Sweep files: points, their order and ids, and error messages.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::Job;
use crate::drape::Refine;
use crate::garment::fabric::Fabric;
use crate::parts::range_table::{RangeTable, TableRule};
use crate::study::sweep::{Plan, sweep_file};

fn parse(text: &str) -> Plan {
    Plan::parse(text, "s.toml", Path::new(""), &Job::preview()).unwrap()
}

fn error_text_of(text: &str) -> String {
    Plan::parse(text, "s.toml", Path::new(""), &Job::preview()).unwrap_err().to_string()
}

#[test]
fn the_grid_comes_in_the_order_written_the_last_axis_fastest() {
    let plan = parse(
        r#"
        name = "order"
        [base]
        refine = "converged"
        [grid]
        seeds = [3, 1]
        garments = ["flared-skirt", "pullover-1"]
        sizes = [900, 500]
        tables = [{ scale = [2, 0.5] }]
        [[points]]
        table = { quantile = 7 }
        extent_cm = [12, 6]
        options = { rest = "texture", weld = true, "newton.damping" = 30 }
        "#,
    );
    let found: Vec<_> =
        plan.points.iter().map(|p| (p.garment.as_str(), p.job.settings.table.name(), p.job.seed)).collect();
    let skirt = |table, seed| ("flared-skirt@900", table, seed);
    assert_eq!(
        found[..5],
        [
            skirt("table-3 x2", 3),
            skirt("table-3 x2", 1),
            skirt("table-3 x0.5", 3),
            skirt("table-3 x0.5", 1),
            ("flared-skirt@500", "table-3 x2", 3)
        ]
    );
    assert_eq!(found[15], ("pullover-1@500", "table-3 x0.5", 1));
    let last = &plan.points[16];
    assert_eq!(
        (last.options_text().as_str(), last.job.scene.rest.as_str(), last.job.scene.weld),
        ("accuracy=none newton.damping=30 rest=texture weld=true", "texture", true)
    );
    assert_eq!(last.job.settings.solver.newton.damping, 30.0);
    assert_eq!(
        (last.job.settings.refine, last.extent_text().as_str(), &last.job.settings.table),
        (Refine::Converged, "12>6", &TableRule::Quantile { name: "quantile 7".into(), levels: 7 })
    );
    assert!(plan.points.iter().enumerate().all(|(i, p)| p.index == i && p.job.settings.refine == Refine::Converged));
    let ids: BTreeSet<_> = plan.points.iter().map(|p| &p.id).collect();
    assert_eq!((ids.len(), plan.repeats, plan.warm_up), (17, 1, 0));
}

#[test]
fn the_papers_sizes_go_by_name() {
    let plan =
        parse("name = \"n\"\n[grid]\ngarments = [\"flared-skirt\", \"pullover-1\"]\nsizes = [\"smaller\", \"larger\"]");
    let found: Vec<_> = plan.points.iter().map(|p| p.garment.as_str()).collect();
    assert_eq!(found, ["flared-skirt@3613", "flared-skirt@3920", "pullover-1@4710", "pullover-1@5103"]);
}

#[test]
fn sizes_are_the_bodies_of_all_points_and_grade_the_girths_that_are_left_out() {
    let plan = parse(
        r#"
        name = "sizes"
        [base]
        garment = "flared-skirt@900"
        [grid]
        fabrics = ["interlock", "cotton"]
        [sizes]
        list = [36, { name = "curvy", bust = 94.7, hip = 102.1, stature = 170 }]
        "#,
    );
    let found: Vec<_> = plan.points.iter().map(|p| (p.body.as_str(), p.job.settings.fabric.name.as_str())).collect();
    assert_eq!(found, [("EU 36", "interlock"), ("EU 36", "cotton"), ("curvy", "interlock"), ("curvy", "cotton")]);
    let of = |index: usize| &plan.points[index].job.scene.measurements;
    assert_eq!((of(0).bust_cm, of(0).waist_cm, of(0).hip_cm), (84.0, 68.0, 92.0));
    let curvy = of(2);
    assert_eq!((curvy.stature_cm, curvy.waist_cm), (170.0, 72.0));
    assert!((curvy.thigh_cm - 61.6).abs() < 1e-9 && (curvy.biceps_cm - 30.6).abs() < 1e-9);
    // Sizes alone are a grid.
    assert_eq!(parse("name = \"s\"\n[sizes]\nlist = [34, 36, 38]").points.len(), 3);
    for (text, expected) in [
        ("[sizes]\nlist = [35]", "s.toml:3: sizes: found 35, expected a European size (32, 34"),
        ("[sizes]\nlist = [{ bust = 90 }]", "name = "),
        ("[sizes]\nlist = [{ name = \"a\", bust = 900 }]", "bust is 900 cm"),
        ("[base]\nbody = \"form\"\n[sizes]\nlist = [36]", "found a body beside [sizes]"),
        ("[grid]\nbodies = [\"form\"]\n[sizes]\nlist = [36]", "s.toml:3: body: found a body beside [sizes]"),
        ("[sizes]\nlist = []", "found no points"),
    ] {
        let error = error_text_of(&format!("name = \"s\"\n{text}"));
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn points_of_one_garment_and_body_share_a_scene() {
    let plan = parse(
        "name = \"n\"\n[grid]\nbodies = [\"form\", { bust = 99 }]\ngarments = [\"flared-skirt\", \"pullover-1\"]\nseeds = [0, 1, 2]\noptions = [{}, { weld = true }]",
    );
    let scenes: BTreeSet<_> = plan.points.iter().map(crate::study::sweep::Point::scene_id).collect();
    assert_eq!((plan.points.len(), scenes.len()), (24, 8));
}

#[test]
fn equal_points_are_left_out_with_a_note() {
    let plan =
        parse("name = \"n\"\n[grid]\ntables = [\"table-3\", { scale = [1, 2] }]\nextents_cm = [0, \"none\", 0.0, 5]");
    assert_eq!(plan.points.len(), 4);
    assert_eq!(plan.notes.len(), 8);
    assert!(plan.notes[2].contains("the same as point 0") && plan.notes[2].contains("table-3 x1"), "{:?}", plan.notes);
}

#[test]
fn parts_follow_the_table_and_move_by_affine_maps_by_default() {
    let plan = parse("name = \"n\"\n[grid]\nmotions = [\"affine\", \"translation\"]\nextents_cm = [\"none\", 8]");
    let found: Vec<_> = plan.points.iter().map(|p| (p.extent_text(), p.job.settings.model.motion().name())).collect();
    let [none, eight] = ["none", "8"].map(str::to_owned);
    let expected = [(none.clone(), "affine"), (none, "translation"), (eight.clone(), "affine"), (eight, "translation")];
    assert_eq!(found, expected);
    assert!(
        plan.points[1].label().contains("extent none, motion translation, min-part 1"),
        "{}",
        plan.points[1].label()
    );
    let ids: BTreeSet<_> = plan.points.iter().map(|p| &p.id).collect();
    assert_eq!(ids.len(), 4);
    // Keys that a file leaves out have the first of these values.
    assert_eq!(parse("name = \"n\"\n[grid]").points[0].id, plan.points[0].id);
    // The paper's PARTs have one displacement each, independent of `motion`.
    let paper = parse("name = \"n\"\n[base]\nmodel = \"paper\"\n[grid]\nmotions = [\"affine\", \"translation\"]");
    assert_eq!((paper.points.len(), paper.points[0].job.settings.model.motion().name()), (1, "translation"));
}

#[test]
fn ids_are_made_of_contents_not_of_names_or_timings() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("a.obj", "v 0 0 0");
    write("b.obj", "v 0 0 0");
    write("t.toml", "name = \"t\"\nunit = \"cm\"\nlevels = [[0, 1], [1, inf]]");
    write("u.toml", "# the same\nname = \"u\"\nunit = \"cm\"\nlevels = [[0.0, 1.0], [1.0, inf]]");
    let id = |text: &str| {
        let plan = Plan::parse(&format!("name = \"n\"\n{text}\n[[points]]"), "s.toml", folder.path(), &Job::preview())
            .unwrap();
        plan.points[0].id.clone()
    };
    assert_eq!(id("[base]\ngarment = \"a.obj\""), id("repeats = 9\nwarm_up = 2\n[base]\ngarment = \"b.obj\""));
    assert_eq!(id("[base]\ntable = \"t.toml\""), id("[base]\ntable = \"u.toml\""));
    assert_eq!(id("[base]\nbody = { bust = 92 }"), id("[base]\nbody = { bust = 92.0, name = \"x\", of = \"form\" }"));
    write("w.toml", "bust_cm = 92");
    assert_eq!(id("[base]\nbody = { bust = 92 }"), id("[base]\nbody = \"w.toml\""));
    assert_eq!(id("[base]\nbody = { waist = 75, of = \"w.toml\" }"), id("[base]\nbody = { bust = 92, waist = 75 }"));
    assert_eq!(id("[base]\ntable = { levels = 38 }").len(), 32);
    let before = id("[base]\ngarment = \"a.obj\"");
    write("a.obj", "v 0 0 1");
    let ids = [
        before,
        id("[base]\ngarment = \"a.obj\""),
        id(""),
        id("[base]\nseed = 1"),
        id("[base]\noptions = { weld = true }"),
        id("[base]\nbody = { bust = 93 }"),
    ];
    assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), 6);
}

#[test]
fn table_entries_make_the_named_tables() {
    let plan = parse(
        r#"
        name = "tables"
        [grid]
        tables = ["table-3", { levels = [5, 38], scale = [0.5, 2] }, { geometric = 4, first_cm = 1, last_cm = 4 }, { quantile = 3, name = "thirds" }]
        "#,
    );
    let distances: Vec<f64> = (0..300).map(|i| 0.0003 * f64::from(i)).collect();
    let made: Vec<_> = plan.points.iter().map(|p| p.job.settings.table.resolve(&distances).unwrap()).collect();
    let names: Vec<_> = made.iter().map(|t| (t.name.as_str(), t.levels.len())).collect();
    assert_eq!(
        names,
        [
            ("table-3", 19),
            ("table-3 5 levels x0.5", 5),
            ("table-3 5 levels x2", 5),
            ("table-3 38 levels x0.5", 38),
            ("table-3 38 levels x2", 38),
            ("geometric 4 1-4 cm", 4),
            ("thirds", 3),
        ]
    );
    assert_eq!(made[5].levels.iter().map(|l| l.upper_cm).collect::<Vec<_>>(), [1.0, 2.0, 4.0, f64::INFINITY]);
    assert!(plan.points[6].job.settings.table.resolve(&[]).is_err());
}

#[test]
fn bad_files_are_refused_with_place_cause_and_remedy() {
    let point = "name = \"n\"\n[[points]]\n";
    let grid = "name = \"n\"\n[grid]\n";
    for (text, start, words) in [
        ("name = 3".to_owned(), "s.toml:1: ", "expected a string"),
        ("nom = \"x\"".to_owned(), "s.toml:1: ", "nom"),
        (format!("{point}colour = 1"), "s.toml:3: ", "colour"),
        (format!("{grid}table = \"table-3\""), "s.toml:3: ", "tables"),
        (format!("{grid}tables = \"table-3\""), "s.toml:3: ", "sequence"),
        (format!("{grid}tables = []"), "s.toml:3: tables: found an empty list", "at least one"),
        (format!("{grid}seeds = [\n1,\n-2]"), "s.toml:5: seed: found -2", "whole number"),
        (format!("{grid}tables = [\"table-3\",\n{{ scael = 2 }}]"), "s.toml:4: table: found", "scael"),
        (format!("{point}table = \"table-4\""), "s.toml:3: table: found \"table-4\"", "\"table-3\", a file"),
        (
            format!("{point}table = {{ scale = 0 }}"),
            "s.toml:3: table: the factor of a scaled table: found 0",
            "positive",
        ),
        (format!("{point}table = {{ scale = [1, 2] }}"), "s.toml:3: table: found", "[grid] as tables"),
        (format!("{point}table = {{ quantile = 3, scale = 2 }}"), "s.toml:3: table: found", "quantile"),
        (format!("{point}table = {{ quantile = 0 }}"), "s.toml:3: table: found", "at least 1"),
        (
            format!("{point}table = {{ geometric = 2 }}"),
            "s.toml:3: table: the number of levels of a geometric table: found 2",
            "at least 3",
        ),
        (format!("{point}table = {{ geometric = 4294967296 }}"), "s.toml:3: table: found", "at most 10000"),
        (format!("{point}table = \"no/such.toml\""), "s.toml:3: no/such.toml: cannot be read", "folder"),
        (format!("{point}garment = \"no.obj\""), "s.toml:3: no.obj: cannot be read", "folder"),
        (format!("{point}garment = \"flared-skirt@900\"\nsize = 800"), "s.toml:4: size: found 800", "skirt@900"),
        (format!("{point}garment = \"sari\""), "s.toml:3: garment: no garment is called `sari`", "flared-skirt"),
        (format!("{point}garment = \"flared-skirt@many\""), "s.toml:3: garment: ", "no number of vertices"),
        (format!("{point}fabric = \"steel\""), "s.toml:3: fabric: no fabric is called `steel`", "jersey"),
        (format!("{point}fabric = \"no/steel.toml\""), "s.toml:3: no/steel.toml: cannot be read", "folder"),
        (format!("{point}model = \"rubber\""), "s.toml:3: model: found \"rubber\"", "coupled"),
        (format!("{point}extent_cm = [3, 6]"), "s.toml:3: extent_cm: found [3, 6]", "falling"),
        (format!("{point}extent_cm = -1"), "s.toml:3: extent_cm: found -1", "none"),
        (format!("{point}motion = \"rigid\""), "s.toml:3: motion: found \"rigid\"", "translation"),
        (format!("{point}refine = \"fully\""), "s.toml:3: refine: found \"fully\"", "converged"),
        (format!("{point}min_part = 0"), "s.toml:3: min_part: found 0", "1 for"),
        (format!("{point}body = {{ bust = \"wide\" }}"), "s.toml:3: body: found", "centimetres"),
        (format!("{point}options = {{ a = [1] }}"), "s.toml:3: options: found", "name = value"),
        (format!("{point}options = {{ speed = 3 }}"), "s.toml:3: options: found", "speed"),
        (format!("{point}options = {{ \"newton.dampin\" = 3 }}"), "s.toml:3: options: found", "newton.damping,"),
        (format!("{point}options = {{ \"newton.damping\" = \"much\" }}"), "s.toml:3: options: found", "a number"),
        (format!("{point}options = {{ unit = \"furlong\" }}"), "s.toml:3: options: found", "furlong"),
        (format!("{point}options = {{ accuracy = \"high\" }}"), "s.toml:3: options: found", "canonical"),
        (format!("{point}options = {{ rest = \"a.obj\" }}"), "s.toml:3: options: found", "name no file"),
        (format!("{point}options = {{ fabrics = [\"a.toml\"] }}"), "s.toml:3: options: found", "name no file"),
        (format!("{point}options = {{ fabrics_file = \"a\" }}"), "s.toml:3: options: found", "beside the garment"),
        (format!("{point}body = {{ chest = 92 }}"), "s.toml:3: body: the spec", "chest"),
        (format!("{point}body = {{ bust = 920 }}"), "s.toml:3: body: bust is 920 cm", "from 60 to 150"),
        (format!("{point}body = \"mannequin\""), "s.toml:3: body: found \"mannequin\"", "\"form\", a mesh file"),
        ("name = \"n\"\nrepeats = 0\n[grid]".to_owned(), "s.toml:2: repeats: found 0", "at least 1"),
        ("name = \"n\"\nrepeats = 1000000\n[grid]".to_owned(), "s.toml:2: repeats: found 1000000", "at most 100"),
        ("name = \"n\"\nwarm_up = 101\n[grid]".to_owned(), "s.toml:2: warm_up: found 101", "0 and at most 100"),
        ("name = \"n\"".to_owned(), "s.toml: found no points", "[grid]"),
    ] {
        let message = error_text_of(&text);
        assert!(message.starts_with(start) && message.contains(words), "{text}\n-> {message}");
    }
    let axis = (0..1001).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let message = error_text_of(&format!("{grid}seeds = [{axis}]\nrefine = [{axis}]"));
    assert!(message.contains("found 1002001 points"), "{message}");
}

#[test]
fn the_sweeps_that_come_along_are_sound() {
    for (file, count) in [
        ("table-3-variations", 50),
        ("extents-and-refinement", 49),
        ("tables-by-kind", 52),
        ("figure-8", 10),
        ("sizes", 8),
    ] {
        let plan = Plan::read(Path::new(&format!("assets/sweeps/{file}.toml")), &Job::preview()).unwrap();
        assert_eq!((plan.points.len(), plan.notes.len()), (count, 0), "{file}: {:?}", plan.notes);
        assert!(plan.about.contains(&format!("= {count} points")), "{file}");
    }
}

#[test]
fn jobs_written_as_a_sweep_file_are_its_points() {
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("a shirt.obj");
    fs::write(&obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let table = |levels: &str| {
        let text = format!("name = \"mine\"\nunit = \"cm\"\ngap = \"own-level\"\nlevels = {levels}\n");
        TableRule::from(RangeTable::parse(&text, "t.toml").unwrap())
    };
    let mut jobs = vec![Job::default(); 4];
    jobs[1].settings.table = table("[[0, 0.1], [0.3, inf, 6, inf]]");
    jobs[1].settings.model = jobs[1].settings.model.clone().with_extents_cm(&[24.0, 12.0]);
    jobs[1].scene.measurements = jobs[1].scene.measurements.clone().with("waist", 76.5).unwrap();
    jobs[2].settings.table = table("[[0, 0.7], [0.7, inf]]");
    jobs[2].settings.fabric = Fabric { name: "my \"own\"".to_owned(), friction: 0.123, ..Fabric::default() };
    jobs[2].settings.refine = Refine::Steps(3);
    jobs[2].seed = 7;
    jobs[3].scene.garment = obj.to_str().unwrap().to_owned();
    jobs[3].scene.weld = true;
    jobs[3].settings.table = TableRule::Quantile { name: "quantile 9".to_owned(), levels: 9 };
    let named: Vec<(String, Job)> =
        jobs.iter().enumerate().map(|(i, job)| (format!("state {i}"), job.clone())).collect();
    let text = sweep_file("pinned", &named).unwrap();
    let found = parse(&text);
    let meant = Plan::of_jobs("pinned", jobs.clone()).unwrap();
    let ids = |plan: &Plan| plan.points.iter().map(|p| p.id.clone()).collect::<Vec<_>>();
    assert_eq!(ids(&found), ids(&meant), "{text}");
    let names: Vec<&str> = found.points.iter().map(|p| p.job.settings.table.name()).collect();
    assert_eq!(names, ["table-3", "mine", "mine, state 2", "quantile 9"], "one name, one table");
    assert!(text.contains("[base]\nbody = ") || text.contains("[base]\nmin_part = 1"), "{text}");
    // A setting without a key is an error and is not dropped silently.
    let mut odd = jobs[0].clone();
    odd.scene.rest = obj.to_str().unwrap().to_owned();
    let message = sweep_file("pinned", &[("state 9".to_owned(), odd)]).unwrap_err().to_string();
    assert!(message.contains("state 9") && message.contains("rest"), "{message}");
    assert!(error_text_of("name = \"x\"\n[grid]\ntables = [{ name = \"t\", rows = [[1, 0]] }]").contains("row 1"));
    assert!(error_text_of("name = \"x\"\n[grid]\nfabrics = [{ name = \"t\" }]").contains("s.toml:3"));
}
