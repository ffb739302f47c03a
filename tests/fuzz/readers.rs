//! The readers, their seed inputs, and the properties of accepted inputs.

use std::fs;
use std::path::{Path, PathBuf};

use partwise::base::error_text::with_causes;
use partwise::body::BodySpec;
use partwise::drape::Refine;
use partwise::garment::fabric::{self, Fabric};
use partwise::garment::pattern;
use partwise::garment::{BUILT_IN, GarmentSpec};
use partwise::parts::range_table::RangeTable;
use partwise::scene::PanelFabrics;
use partwise::study::sweep::Plan;
use partwise::{Job, SceneSpec};

use super::fuzz;

/// The outcome of an input.
pub(crate) enum Outcome {
    Taken,
    Refused(String),
}

impl Outcome {
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Taken => "taken",
            Self::Refused(_) => "refused",
        }
    }
}

/// Words of messages that state what was found, expected or needed; the last come from the TOML and JSON parsers.
pub(crate) const INFORMATIVE: &[&str] = &[
    "expected",
    "must be",
    "found",
    "ask for",
    "give ",
    "needs",
    "let it ",
    "write ",
    "there is no",
    "cm; a body's is",
    "a sweep file has",
    "missing field",
    "duplicate",
    "invalid",
    "unknown",
    "EOF while",
    "trailing",
    "remove ",
    "overflowed",
    "out of range",
    "cannot be read",
    "are missing",
    "a line for this panel",
    "recursion limit",
    "cannot extend",
];

pub(crate) fn refused(error: &(dyn std::error::Error + 'static)) -> Result<Outcome, String> {
    Ok(Outcome::Refused(with_causes(error, ": ")))
}

pub(crate) fn check(holds: bool, what: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(format!("taken, but {what}")) }
}

fn assets(folder: &str) -> Vec<String> {
    with_ending(folder, "toml")
}

fn with_ending(folder: &str, wanted: &str) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(folder);
    let mut paths: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == wanted));
    paths.sort();
    paths.iter().map(|path| fs::read_to_string(path).unwrap()).collect()
}

#[test]
fn range_tables() {
    let mut seeds = assets("tables");
    seeds.extend(assets("tuned"));
    fuzz("range-table", 1.0, seeds, |text| {
        let table = match RangeTable::parse(text, "input.toml") {
            Ok(table) => table,
            Err(e) => return refused(&e),
        };
        check(table.levels.iter().all(|l| l.lower_cm.is_finite() && !l.upper_cm.is_nan()), "a bound is not a number")?;
        let distances: Vec<f64> = (0..200).map(|i| 1e-3 * f64::from(i)).collect();
        let levels = table.assign(&distances).0;
        check(levels.len() == distances.len(), "levels do not match distances")?;
        let again = RangeTable::parse(&table.to_toml(), "again").map_err(|e| format!("written and refused: {e}"))?;
        check(again == table, "it reads back as another")?;
        Ok(Outcome::Taken)
    });
}

#[test]
fn fabrics() {
    fuzz("fabric", 1.0, assets("fabrics"), |text| match Fabric::parse(text, "input.toml") {
        Err(e) => refused(&e),
        Ok(f) => {
            let numbers =
                [f.density_kg_per_m2, f.thickness_m, f.stretch_weft_n_per_m, f.stretch_warp_n_per_m, f.shear_n_per_m];
            check(numbers.iter().chain(&f.bending_nm).all(|x| x.is_finite() && *x > 0.0), "a constant is not above 0")?;
            check(f.poisson.is_finite() && f.friction.is_finite() && f.friction >= 0.0, "a ratio is not a number")?;
            Ok(Outcome::Taken)
        }
    });
}

#[test]
fn fabrics_of_panels() {
    let seeds = [
        "default = \"interlock\"\n[panels]\nleft_cuff = \"denim\"\n\"*sleeve*\" = \"silk\"\n",
        "[panels]\n\"**a*\" = \"wool\"\nfront = \"nowhere.toml\"\n",
    ];
    fuzz("panel-fabrics", 1.0, seeds.map(str::to_owned).to_vec(), |text| {
        match PanelFabrics::parse(text, Path::new("input.fabrics.toml")) {
            Err(e) => refused(&e),
            Ok(fabrics) => {
                for panel in ["front", "left_cuff", "right_sleeve_f", "é*"] {
                    match fabrics.of(panel) {
                        Err(e) => return refused(&e),
                        Ok(fabric) => {
                            check(fabric.is_none_or(|f| f.density_kg_per_m2 > 0.0), "a fabric weighs nothing")?;
                        }
                    }
                }
                Ok(Outcome::Taken)
            }
        }
    });
}

#[test]
fn garments() {
    fuzz("garment", 1.0, assets("garments"), |text| match GarmentSpec::from_toml(text) {
        Err(e) => refused(&e),
        Ok(spec) => {
            let again = toml::from_str::<GarmentSpec>(&toml::to_string(&spec).map_err(|e| e.to_string())?);
            check(again.is_ok_and(|again| again == spec), "it reads back as another")?;
            Ok(Outcome::Taken)
        }
    });
}

#[test]
fn bodies() {
    let mut seeds = assets("bodies");
    seeds.push(toml::to_string(&BodySpec::default()).unwrap());
    fuzz("body", 1.0, seeds, |text| {
        let spec = match BodySpec::from_toml(text) {
            Ok(spec) => spec,
            Err(e) => return refused(&e),
        };
        match spec.measures() {
            Err(e) => refused(&e),
            Ok(m) => {
                check(
                    [m.stature, m.bust, m.waist, m.hip, m.crotch_height].iter().all(|x| x.is_finite() && *x > 0.0),
                    "no length",
                )?;
                Ok(Outcome::Taken)
            }
        }
    });
}

#[test]
fn made_garments_on_made_bodies() {
    // Every accepted spec makes a mesh or is refused with the cause; each takes a quarter of a second.
    let body = toml::to_string(&BodySpec::default()).unwrap();
    let seeds = assets("garments").into_iter().map(|garment| format!("{garment}\n=====\n{body}")).collect();
    fuzz("made", 1.0 / 3000.0, seeds, |text| {
        let (garment, body) = text.split_once("\n=====\n").unwrap_or((text, ""));
        let made = GarmentSpec::from_toml(garment).and_then(|spec| {
            let body = BodySpec::from_toml(body)?;
            partwise::garment::garment(&spec, &body, Some(600))
        });
        match made {
            Err(e) => refused(&e),
            Ok(made) => {
                check(made.mesh.vertex_count() <= 600, "it has more vertices than asked for")?;
                check(made.mesh.positions.iter().all(|p| p.is_finite()), "a position is not finite")?;
                check(made.rest.areas().iter().all(|a| *a > 0.0), "a triangle has no area at rest")?;
                Ok(Outcome::Taken)
            }
        }
    });
}

#[test]
fn sweep_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/sweeps");
    fuzz("sweep", 0.2, assets("sweeps"), move |text| match Plan::parse(text, "input.toml", &folder, &Job::preview()) {
        Err(e) => refused(&e),
        Ok(plan) => {
            check(!plan.points.is_empty() && plan.repeats > 0, "it has no points")?;
            check(plan.points.iter().enumerate().all(|(i, point)| point.index == i), "points are not in order")?;
            Ok(Outcome::Taken)
        }
    });
}

#[test]
fn jobs() {
    let mut other = Job::preview();
    other.settings.refine = Refine::Converged;
    other.settings.table = partwise::parts::range_table::TableRule::Quantile { name: "q".to_owned(), levels: 5 };
    let seeds = [Job::default(), Job::preview(), other].map(|job| serde_json::to_string_pretty(&job).unwrap());
    fuzz("job", 1.0, seeds.to_vec(), |text| match serde_json::from_str::<Job>(text) {
        Err(e) => refused(&e),
        Ok(job) => {
            let again = serde_json::to_string(&job).map_err(|e| e.to_string())?;
            check(serde_json::from_str::<Job>(&again).is_ok_and(|again| again == job), "it reads back as another")?;
            Ok(Outcome::Taken)
        }
    });
}

#[test]
fn patterns() {
    // Every accepted pattern is also sewn, which takes some milliseconds.
    fuzz("pattern", 0.1, with_ending("patterns", "json"), |text| match pattern::parse(text, "input") {
        Err(e) => refused(&e),
        Ok(pattern) => match pattern::sew(&pattern, 0.04) {
            Err(e) => refused(&e),
            Ok(sewn) => {
                check(sewn.mesh.positions.iter().all(|p| p.is_finite()), "a position is not finite")?;
                check(sewn.rest.areas().iter().all(|a| *a > 0.0), "a triangle has no area at rest")?;
                check(sewn.rest.corners.len() == sewn.mesh.triangles.len(), "rest and mesh differ")?;
                let known = |v: &u32| (*v as usize) < sewn.mesh.vertex_count();
                check(sewn.mesh.triangles.as_flattened().iter().all(known), "a triangle has no vertex")?;
                check(pattern::to_svg(&pattern).ends_with("</svg>\n"), "its drawing has no end")?;
                Ok(Outcome::Taken)
            }
        },
    });
}

/// A small drawing, whose text a mutation changes more often than the much longer ones of programs.
const PIECES: &str = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n5\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nfront\n\
    0\nTEXT\n8\n1\n1\nSize: 38\n0\nPOLYLINE\n8\n14\n70\n1\n0\nVERTEX\n10\n0\n20\n0\n42\n0.2\n0\nVERTEX\n10\n40\n20\n0\n\
    0\nVERTEX\n10\n40\n20\n50\n0\nVERTEX\n10\n0\n20\n50\n0\nSEQEND\n0\nLINE\n8\n7\n10\n5\n20\n5\n11\n9\n21\n40\n\
    0\nPOINT\n8\n4\n10\n40\n20\n30\n0\nENDBLK\n0\nBLOCK\n2\nback\n0\nLWPOLYLINE\n8\n1\n70\n1\n10\n0\n20\n0\n10\n20\n20\n0\n\
    10\n20\n20\n50\n10\n0\n20\n50\n0\nLINE\n8\n6\n10\n0\n20\n0\n11\n0\n21\n50\n0\nENDBLK\n0\nENDSEC\n0\nEOF\n";
const SEWN: &str = "unit = \"cm\"\nstitches = [[\"front.1\", \"back.0\"]]\n[panels.front]\nat_cm = [0, 110, 20]\nnotches = true\n\
    [panels.back]\nat_cm = [0, 110, -18]\nside = \"back\"\nmirror = true\nturn = 10\n[labels]\nhem = [\"back.1\"]\n";

#[test]
fn pieces() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pattern/dxf");
    let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let seeds =
        ["skirt", "top"].map(|name| text(&format!("{name}.dxf")) + "=====\n" + &text(&format!("{name}.sewing.toml")));
    let small = format!("{PIECES}=====\n{SEWN}");
    fuzz("dxf", 0.2, [&seeds[..], &[small.clone(), small]].concat(), |text| {
        let (drawing, sewing) = text.split_once("=====\n").unwrap_or((text, ""));
        let sewing = (text.len() % 5 > 0).then_some(sewing);
        let pattern = match pattern::dxf::parse(drawing, sewing, "input") {
            Err(e) => return refused(&e),
            Ok(pattern) => pattern,
        };
        check(pattern.panels.iter().all(|panel| panel.signed_area() > 0.0), "a panel is turned over")?;
        check(pattern::to_svg(&pattern).ends_with("</svg>\n"), "its drawing has no end")?;
        match pattern::sew(&pattern, 0.06) {
            Err(e) => refused(&e),
            Ok(sewn) => {
                check(sewn.mesh.positions.iter().all(|p| p.is_finite()), "a position is not finite")?;
                check(sewn.rest.areas().iter().all(|a| *a > 0.0), "a triangle has no area at rest")?;
                Ok(Outcome::Taken)
            }
        }
    });
}

#[test]
fn names() {
    let seeds = BUILT_IN.iter().map(|name| format!("{name}@900")).chain(fabric::BUILT_IN.map(str::to_owned)).collect();
    fuzz("name", 0.2, seeds, |text| match SceneSpec::new("form", text.replace(['/', '\\', '.'], "")).check_names() {
        Err(e) => refused(&e),
        Ok(()) => Ok(Outcome::Taken),
    });
}
