//! Patterns as DXF: `dxf/make.py` wrote `skirt.dxf` and `top.dxf` with ezdxf.

use std::fs;
use std::path::PathBuf;

use partwise::SceneSpec;
use partwise::garment::pattern::dxf::parse;
use partwise::garment::pattern::{Curve, SewingPattern, read, read_unsewn, to_svg};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/pattern/dxf").join(name)
}

fn text(name: &str) -> String {
    fs::read_to_string(path(name)).unwrap()
}

fn lengths_cm(pattern: &SewingPattern, panel: usize) -> Vec<f64> {
    let length = |curve: &Curve| match curve {
        Curve::Line { a, b } => a.distance(*b),
        Curve::Polyline { points } => points.windows(2).map(|side| side[0].distance(side[1])).sum(),
        other => panic!("{other:?}"),
    };
    pattern.panels[panel].edges.iter().map(|edge| 100.0 * length(&edge.curve)).collect()
}

#[test]
fn half_a_skirt_cut_on_the_fold_is_as_large_as_a_whole_one() {
    let skirt = read(&path("skirt.dxf")).unwrap();
    let [back, front] = &skirt.panels[..] else { panic!("{} panels", skirt.panels.len()) };
    assert!((back.signed_area() - front.signed_area()).abs() < 1e-9 && back.signed_area() > 0.0);
    let (mut whole, mut unfolded) = (lengths_cm(&skirt, 0), lengths_cm(&skirt, 1));
    // Waist, side, hem, side; the front begins at another corner.
    unfolded.rotate_right(1);
    let (waist, hem) = (whole[0], whole[2]);
    assert!((waist - 37.4).abs() < 1e-6 && (60.0..61.0).contains(&hem), "{whole:?}");
    assert!((whole[1] - whole[3]).abs() < 1e-6);
    whole.iter_mut().zip(&unfolded).for_each(|(a, b)| *a -= b);
    assert!(whole.iter().all(|difference| difference.abs() < 1e-6), "{whole:?}");
    let notes = skirt.notes.join("\n");
    assert!(notes.contains("SKIRT FRONT: unfolded along its mirror line"), "{notes}");
    assert_eq!(skirt.panels[1].edges[3].label.as_deref(), Some("lower_interface"));
}

#[test]
fn a_grain_along_x_is_turned_up_and_one_size_is_taken() {
    let top = read(&path("top.dxf")).unwrap();
    assert_eq!(top.panels.len(), 2);
    for panel in &top.panels {
        assert_eq!(panel.edges.len(), 8);
        let area = panel.signed_area();
        assert!((0.24..0.26).contains(&area), "{area}");
    }
    // The hem, 48 cm in size 38, is at the bottom.
    assert!((lengths_cm(&top, 0)[7] - 48.0).abs() < 1e-9);
    let larger = parse(&text("top.dxf"), Some(&text("top.sewing.toml").replace("\"38\"", "\"42\"")), "top").unwrap();
    assert!((lengths_cm(&larger, 0)[7] - 52.0).abs() < 1e-9);
    // Without a named size, the sample size counts.
    let sample = parse(&text("top.dxf"), Some(&text("top.sewing.toml").replace("size = \"38\"", "")), "top").unwrap();
    assert_eq!(sample.panels, top.panels);
    assert!(
        sample.notes.iter().any(|note| note.contains("took size 38, the sample size, of 38, 42")),
        "{:?}",
        sample.notes
    );
}

#[test]
fn a_drawing_alone_has_its_pieces_and_numbered_edges() {
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("skirt.dxf");
    fs::copy(path("skirt.dxf"), &alone).unwrap();
    let message = read(&alone).unwrap_err().to_string();
    for part in ["skirt.dxf", "skirt.sewing.toml", "which edges are sewn", "--svg"] {
        assert!(message.contains(part), "no \"{part}\" in: {message}");
    }
    let pieces = read_unsewn(&alone).unwrap();
    assert_eq!((pieces.panels.len(), pieces.stitches.len()), (2, 0));
    let svg = to_svg(&pieces);
    for number in 0..4 {
        assert_eq!(svg.matches(&format!(">{number}</text>")).count(), 2, "{number}");
    }
    // Cut line, dart line and notches are drawn.
    assert!(svg.matches("stroke-width=\"0.6\"").count() >= 6);
}

#[test]
fn notches_divide_edges_on_request_and_mirror_images_are_other_panels() {
    let sewing = "[panels.back]\npiece = \"skirt back\"\nat_cm = [0, 70, -17]\nnotches = true\n";
    let notched = parse(&text("skirt.dxf"), Some(sewing), "skirt").unwrap();
    assert_eq!(notched.panels[0].edges.len(), 6);
    let of = |mirror| {
        let sewing = format!("size = \"38\"\n[panels.FRONT]\nat_cm = [0, 110, 18]\nmirror = {mirror}\n");
        parse(&text("top.dxf"), Some(&sewing), "top").unwrap()
    };
    let (plain, mirrored) = (of(false), of(true));
    assert!((plain.panels[0].signed_area() - mirrored.panels[0].signed_area()).abs() < 1e-12);
    let mut lengths = lengths_cm(&mirrored, 0);
    lengths.reverse();
    let same =
        |by: usize| lengths.iter().cycle().skip(by).zip(lengths_cm(&plain, 0)).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!((0..8).any(same), "{lengths:?}");
}

#[test]
fn seams_meet_and_the_garment_is_put_on() {
    for (name, seams) in [("skirt", 2), ("top", 4)] {
        let spec = SceneSpec::new("form", path(&format!("{name}.dxf")).to_string_lossy());
        assert!(spec.files().contains(&path(&format!("{name}.sewing.toml"))), "{:?}", spec.files());
        let loaded = spec.load().unwrap();
        let put_on = &loaded.tailored.as_ref().unwrap().put_on;
        assert_eq!(put_on.garment.seams.len(), seams);
        assert_eq!(loaded.scene.topology.components().1, 1, "{name}");
        assert_eq!(loaded.scene.garment.groups, ["back", "front"]);
        assert!(loaded.pushed_out.is_clean(), "{name}: {}", loaded.pushed_out);
    }
}

/// The message about the skirt with edits of its drawing and of its TOML file.
fn refusal(drawing: impl Fn(String) -> String, sewing: impl Fn(String) -> String) -> String {
    parse(&drawing(text("skirt.dxf")), Some(&sewing(text("skirt.sewing.toml"))), "skirt").unwrap_err().to_string()
}

fn says(message: &str, parts: &[&str]) {
    parts.iter().for_each(|part| assert!(message.contains(part), "no \"{part}\" in: {message}"));
}

/// An entity moved from one layer to another: the value after group code 8.
fn layer(text: &str, from: &str, to: &str) -> String {
    text.replace(&format!("\n  8\n{from}\n"), &format!("\n  8\n{to}\n"))
}

#[test]
fn drawings_of_other_kinds_are_refused_with_their_reason() {
    let same = |text: String| text;
    says(
        &refusal(|t| layer(&layer(&t, "1", "CUT"), "14", "SEW"), same),
        &["the layers", "CUT", "layer 1", "14", "ASTM D6673"],
    );
    says(&refusal(|t| t.replace("POLYLINE\n", "SPLINE\n"), same), &["found a SPLINE on layer", "polylines"]);
    says(
        &refusal(|t| layer(&t, "6", "9").replace("SKIRT FRONT", "ANOTHER"), same),
        &["panel front", "no piece SKIRT FRONT"],
    );
    says(&refusal(|t| t.replace("Metric", "").replace("METRIC", "ENGLISH"), same), &["largest piece", "in in", "unit"]);
    says(&refusal(|_| String::new(), same), &["neither blocks nor entities"]);
    says(&refusal(|_| "{\"pattern\": 1}".to_owned(), same), &["line 1", "group code"]);
    says(&refusal(|t| t[..t.len() / 2].to_owned() + "\n 10\n", same), &["expected"]);
    says(&refusal(|t| t.replacen("\n 10\n", "\n 10\nx", 60), same), &["for code 10", "a number"]);
}

#[test]
fn open_outlines_and_gaps_are_told_apart() {
    let block = |points: &[[f64; 2]]| {
        let mut text = "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nfront\n0\nPOLYLINE\n8\n1\n70\n0\n".to_owned();
        for [x, y] in points {
            text += &format!("0\nVERTEX\n8\n1\n10\n{x}\n20\n{y}\n");
        }
        text + "0\nSEQEND\n0\nENDBLK\n0\nENDSEC\n0\nEOF\n"
    };
    let square = |x: f64| [[0.0, 0.0], [400.0, 0.0], [400.0, 500.0], [0.0, 500.0], [x, 0.0]];
    let closed = parse(&block(&square(2.0)), None, "square").unwrap();
    assert!(closed.notes.iter().any(|note| note.contains("closed a gap of 2.0 mm")), "{:?}", closed.notes);
    for note in ["states no unit: took millimetres", "no sew line (layer 14)", "no grain line (layer 7)"] {
        assert!(closed.notes.iter().any(|found| found.contains(note)), "{note}: {:?}", closed.notes);
    }
    assert!((closed.panels[0].signed_area() - 0.2).abs() < 2e-3);
    let open = parse(&block(&square(40.0)), None, "square").unwrap_err().to_string();
    says(&open, &["piece front", "open", "gap of 40.0 mm", "(40.000, 0.000)", "(0.000, 0.000)", "close it"]);
    // The other way round, it is the same piece.
    let mut reversed = square(0.0);
    reversed.reverse();
    assert!(parse(&block(&reversed), None, "square").unwrap().panels[0].signed_area() > 0.0);
}

#[test]
fn mistakes_in_the_sewing_file_name_their_place() {
    let same = |text: String| text;
    let sewn = |from: &str, to: &str| refusal(same, |t| t.replacen(from, to, 1));
    says(&sewn("front.2", "front.9"), &["stitch 0", "edge 9 of panel front", "0 to 3"]);
    says(&sewn("front.2", "frnt.2"), &["stitch 0", "the panel \"frnt\"", "back, front"]);
    says(&sewn("front.2", "front"), &["stitch 0", "PANEL.EDGE"]);
    says(&sewn("front.2", "back.1"), &["stitch 0", "both sides"]);
    says(&sewn("front.0", "front.2"), &["stitches 0 and 1 both sew edge 2 of panel front"]);
    says(&sewn("at_cm", "at"), &["unknown field `at`", "at_cm"]);
    says(&sewn("SKIRT FRONT", "SKRIT FRONT"), &["panel front", "no piece SKRIT FRONT", "SKIRT FRONT, SKIRT BACK"]);
    says(&sewn("stitches", "size = \"40\"\nstitches"), &["no size \"40\"", "38"]);
    says(&sewn("\"front.3\"", "\"front.8\""), &["label lower_interface", "edge 8"]);
    says(&sewn("[0, 74, 18]", "[0, 74, 1e9]"), &["panel front", "1000000000", "centimetres"]);
    let text = text("skirt.sewing.toml");
    let (stitches, _) = text.split_once("[panels.front]").unwrap();
    says(&refusal(same, |_| stitches.replace("stitches", "# ").to_owned()), &["[panels.NAME]", "SKIRT FRONT"]);
    let twice = self::text("skirt.dxf").replace("Quantity: 1", "Quantity: 2");
    let pattern = parse(&twice, Some(&text), "skirt").unwrap();
    let note = "piece SKIRT FRONT: its quantity is 2, expected 1, the number of its panels";
    assert!(pattern.notes.iter().any(|found| found == note), "{:?}", pattern.notes);
}
