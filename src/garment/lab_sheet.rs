//! Fabrics from the sheets of a laboratory: the Kawabata system (KES) and Fabric Assurance by Simple Testing (FAST).
//!
//! | sheet | constant | source |
//! |---|---|---|
//! | KES B, gf·cm²/cm | bending stiffness, 1 = 98.0665 µN·m | definition of the unit |
//! | KES 2HB, gf·cm/cm | friction between yarns HB, half of it, 1 = 9.80665 mN | Kawabata 1980 |
//! | KES G, gf/(cm·deg) | shear stiffness, 1 = 56.19 N/m: gf/cm over π/180 rad | definition of the unit |
//! | KES WT, gf·cm/cm², EM, % | membrane stiffness k = 2 WT/EM²: the chord of the loading curve by its work | WT = ½ k EM² |
//! | KES LT, WT | without EM: EM = 2 WT/(LT · 500 gf/cm) | LT = WT/(½ F EM), Kawabata 1980 |
//! | KES W, mg/cm², T, mm | areal density, 1 = 0.01 kg/m²; thickness | definition of the unit |
//! | FAST C, mm, W, g/m² | bending stiffness W g C³ | Peirce 1930; CSIRO FAST manual 1990 |
//! | FAST E5, E20, E100, % | membrane stiffness between the loads 5 and 20 gf/cm: 14.71 N/m over E20 − E5 | CSIRO FAST manual 1990 |
//! | FAST EB5, % | shear stiffness 123/EB5 N/m | CSIRO FAST manual 1990 |
//!
//! The bending stiffness on the bias is the mean of warp and weft, Poisson's ratio 0.3 and friction 0.3 where the sheet has none; each of these
//! is reported as assumed. FAST has no hysteresis.
//!
//! Limits: 2HG, the hysteresis in shear, is read and has no counterpart in the model. The chord of a strongly curved tension curve is stiffer
//! than its beginning, where garments are loaded.

use std::collections::BTreeMap;

use super::fabric::{Fabric, FabricError};
use crate::GRAVITY;

/// One gram-force, N.
const GRAM_FORCE_N: f64 = 9.806_65e-3;

/// Largest load of a KES-FB1 tension test, gf/cm.
const KES_LOAD: f64 = 500.0;

/// Poisson's ratio and friction of a sheet without them: those of the built-in fabrics.
const POISSON: f64 = 0.3;
const FRICTION: f64 = 0.3;

/// System of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LabSystem {
    /// Kawabata's evaluation system.
    Kes,
    /// Fabric Assurance by Simple Testing.
    Fast,
}

/// A quantity of a sheet.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    /// Values of cloth, in the unit; a value outside is refused.
    range: [f64; 2],
    /// Whether the sheet must have it.
    required: bool,
    /// Whether warp and weft differ.
    directed: bool,
    /// Other units in use, with the size of this unit in them.
    others: &'static [(f64, &'static str)],
}

const fn quantity(
    name: &'static str,
    unit: &'static str,
    range: [f64; 2],
    [required, directed]: [bool; 2],
    others: &'static [(f64, &'static str)],
) -> Quantity {
    Quantity { name, unit, range, required, directed, others }
}

const SHARE: &[(f64, &str)] = &[(0.01, "a share")];
const LENGTH: &[(f64, &str)] = &[(0.1, "cm"), (1000.0, "µm"), (0.001, "m")];

/// Factor by which the ranges of apparel cloth are widened at each end. A value outside is refused; one that only the widening admits is
/// doubted if another unit explains it.
const WIDENED: f64 = 3.0;

/// Largest 2HB/(2B), 1/cm, that is not doubted: three times that of the cotton broad, the largest found. The cloth would keep a curvature of
/// this size.
const MAX_RESIDUAL_CURVATURE: f64 = 1.6;

/// See [`WIDENED`].
const KES: [Quantity; 9] = [
    quantity("B", "gf·cm²/cm", [0.001, 3.0], [true, true], &[(98.0665, "µN·m"), (9.806_65, "mN·cm²/cm")]),
    quantity("2HB", "gf·cm/cm", [0.0, 3.0], [false, true], &[(9.806_65, "mN·m/m")]),
    quantity("G", "gf/(cm·deg)", [0.05, 15.0], [true, true], &[(56.19, "N/m"), (9.806_65, "mN/(cm·deg)")]),
    quantity("2HG", "gf/cm", [0.0, 40.0], [false, true], &[(9.806_65, "mN/cm")]),
    quantity("LT", "–", [0.2, 1.5], [false, true], &[(100.0, "%")]),
    quantity("WT", "gf·cm/cm²", [0.3, 150.0], [true, true], &[(9.806_65, "mN·cm/cm²"), (98.0665, "µJ/cm²")]),
    quantity("EM", "%", [0.2, 150.0], [false, true], SHARE),
    quantity("T", "mm", [0.03, 10.0], [true, false], LENGTH),
    quantity("W", "mg/cm²", [1.0, 150.0], [true, false], &[(10.0, "g/m²"), (0.01, "kg/m²")]),
];

/// See [`KES`].
const FAST: [Quantity; 7] = [
    quantity("E5", "%", [0.0, 60.0], [true, true], SHARE),
    quantity("E20", "%", [0.02, 100.0], [true, true], SHARE),
    quantity("E100", "%", [0.05, 150.0], [false, true], SHARE),
    quantity("EB5", "%", [0.2, 60.0], [true, false], SHARE),
    quantity("C", "mm", [3.0, 100.0], [true, true], LENGTH),
    quantity("W", "g/m²", [10.0, 1500.0], [true, false], &[(0.1, "mg/cm²"), (0.001, "kg/m²")]),
    quantity("T2", "mm", [0.03, 10.0], [true, false], LENGTH),
];

/// Why a sheet is no fabric.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub(crate) enum LabSheetError {
    /// The sheet does not parse.
    #[error(
        "{file}, line {line}: {found}; expected `quantity,warp,weft` with a number in each, for example `B,0.118,0.097`"
    )]
    Line { file: String, line: u64, found: String },
    /// A quantity that the system does not have.
    #[error("{file}, line {line}: found the quantity `{found}`, expected one of {known}")]
    Unknown { file: String, line: u64, found: String, known: String },
    /// A quantity twice.
    #[error("{file}, line {line}: found {name} a second time, expected it once; remove one line")]
    Twice { file: String, line: u64, name: &'static str },
    /// A required quantity is missing.
    #[error("{file}: found no {missing}, which a fabric needs; add a line `{missing},WARP,WEFT`")]
    Missing { file: String, missing: &'static str },
    /// A value that no cloth has.
    #[error("{file}, line {line}: {name} {direction} is {found}, expected {low} to {high} {unit}{mistake}")]
    Range {
        file: String,
        line: u64,
        name: &'static str,
        direction: &'static str,
        found: f64,
        low: f64,
        high: f64,
        unit: &'static str,
        mistake: Box<str>,
    },
    /// Values that contradict each other.
    #[error("{file}: {what}")]
    Contradiction { file: String, what: String },
    /// The constants are out of range.
    #[error(transparent)]
    Fabric(#[from] FabricError),
}

/// A fabric from a sheet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FromSheet {
    pub(crate) fabric: Fabric,
    /// The fabric as a file.
    pub(crate) toml: String,
    /// Constants that the sheet does not have.
    pub(crate) assumed: Vec<String>,
    /// Values that cloth can have, and that another unit would make usual.
    pub(crate) doubts: Vec<String>,
}

/// Warp and weft of each quantity, in the units of the sheet.
type Values = BTreeMap<&'static str, [f64; 2]>;

/// Reads a sheet (CSV of quantity, warp, weft; a single value stands for both) and converts it. `file` is named in errors.
///
/// # Errors
/// [`LabSheetError`] names the line and the quantity.
pub(crate) fn from_csv(system: LabSystem, text: &str, file: &str, name: &str) -> Result<FromSheet, LabSheetError> {
    let quantities = match system {
        LabSystem::Kes => &KES[..],
        LabSystem::Fast => &FAST[..],
    };
    let (values, mut doubts) = read(quantities, text, file)?;
    if let Some(missing) = quantities.iter().find(|q| q.required && !values.contains_key(q.name)) {
        return Err(LabSheetError::Missing { file: file.to_owned(), missing: missing.name });
    }
    let mut assumed = vec![
        format!("bending stiffness on the bias: the mean of warp and weft, which {} does not measure", system.name()),
        format!("Poisson's ratio {POISSON} and friction {FRICTION}, as of the built-in fabrics"),
    ];
    let pair = |name: &str| values.get(name).copied();
    let of = |name: &str| pair(name).unwrap_or_default();
    let [warp, weft] = match system {
        LabSystem::Kes => [0, 1].map(|k| kes(k, pair, &mut assumed)),
        LabSystem::Fast => [0, 1].map(|k| fast(k, of)),
    };
    let [mut warp, mut weft] = [warp, weft];
    for (direction, constants) in [("warp", &mut warp), ("weft", &mut weft)] {
        let k = constants.stretch_n_per_m;
        if !(k.is_finite() && k > 0.0) {
            let what = format!(
                "E20 {direction} is not above E5, so the cloth has no membrane stiffness; are the columns exchanged?"
            );
            return Err(LabSheetError::Contradiction { file: file.to_owned(), what });
        }
    }
    doubts.extend(doubtful_friction(of("2HB"), of("B"), file));
    if system == LabSystem::Fast || pair("2HB").is_none() {
        assumed.push("no friction between yarns in bending (2HB), so the cloth bends elastically".to_owned());
    }
    let (density, thickness) = match system {
        LabSystem::Kes => (0.01 * of("W")[0], 1e-3 * of("T")[0]),
        LabSystem::Fast => (1e-3 * of("W")[0], 1e-3 * of("T2")[0]),
    };
    let fabric = Fabric {
        name: name.to_owned(),
        source: format!("{} sheet {file}. Assumed: {}.", system.name(), assumed.join("; ")),
        density_kg_per_m2: density,
        thickness_m: thickness,
        stretch_weft_n_per_m: weft.stretch_n_per_m,
        stretch_warp_n_per_m: warp.stretch_n_per_m,
        shear_n_per_m: 0.5 * (warp.shear_n_per_m + weft.shear_n_per_m),
        poisson: POISSON,
        bending_nm: [weft.bending_nm, 0.5 * (weft.bending_nm + warp.bending_nm), warp.bending_nm],
        bending_friction_n: [weft.friction_n, warp.friction_n],
        friction: FRICTION,
    };
    fabric.check(file)?;
    let toml = toml::to_string(&fabric).map_err(|error| LabSheetError::Contradiction {
        file: file.to_owned(),
        what: format!("the fabric cannot be written as TOML: {error}"),
    })?;
    Ok(FromSheet { fabric, toml, assumed, doubts })
}

impl LabSystem {
    fn name(self) -> &'static str {
        match self {
            Self::Kes => "KES",
            Self::Fast => "FAST",
        }
    }
}

/// Constants along one direction.
struct Along {
    stretch_n_per_m: f64,
    shear_n_per_m: f64,
    bending_nm: f64,
    friction_n: f64,
}

/// The constants along direction `k` of a KES sheet.
fn kes(k: usize, pair: impl Fn(&str) -> Option<[f64; 2]>, assumed: &mut Vec<String>) -> Along {
    let of = |name: &str| pair(name).map(|values| values[k]);
    let work = of("WT").unwrap_or_default();
    // gf·cm/cm² over gf/cm is a share.
    let linearity = of("LT").unwrap_or(1.0);
    let extension = of("EM").map_or(2.0 * work / (linearity * KES_LOAD), |percent| 0.01 * percent);
    if k == 0 && of("EM").is_none() && of("LT").is_none() {
        assumed.push("a straight tension curve (LT 1), since the sheet has neither EM nor LT".to_owned());
    }
    Along {
        stretch_n_per_m: 2.0 * work * 100.0 * GRAM_FORCE_N / (extension * extension),
        shear_n_per_m: of("G").unwrap_or_default() * 100.0 * GRAM_FORCE_N / 1f64.to_radians(),
        bending_nm: of("B").unwrap_or_default() * 1e-2 * GRAM_FORCE_N,
        friction_n: 0.5 * of("2HB").unwrap_or_default() * GRAM_FORCE_N,
    }
}

/// The constants along direction `k` of a FAST sheet.
fn fast(k: usize, of: impl Fn(&str) -> [f64; 2]) -> Along {
    let stretch = 0.01 * (of("E20")[k] - of("E5")[k]);
    Along {
        stretch_n_per_m: 1500.0 * GRAM_FORCE_N / stretch,
        shear_n_per_m: 123.0 / of("EB5")[k],
        bending_nm: 1e-3 * of("W")[0] * GRAVITY * (1e-3 * of("C")[k]).powi(3),
        friction_n: 0.0,
    }
}

/// Reads the lines of a sheet.
fn read(quantities: &[Quantity], text: &str, file: &str) -> Result<(Values, Vec<String>), LabSheetError> {
    let (mut values, mut doubts) = (Values::new(), Vec::new());
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    for record in reader.records() {
        let record = record.map_err(|error| LabSheetError::Line {
            file: file.to_owned(),
            line: error.position().map_or(0, csv::Position::line),
            found: error.to_string(),
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let cells: Vec<&str> = record.iter().collect();
        let header = cells.first().is_some_and(|cell| cell.eq_ignore_ascii_case("quantity"));
        if header || cells.iter().all(|cell| cell.is_empty()) {
            continue;
        }
        let found = |found: String| LabSheetError::Line { file: file.to_owned(), line, found };
        let name = cells[0];
        let Some(quantity) = quantities.iter().find(|q| q.name.eq_ignore_ascii_case(name)) else {
            let known = quantities.iter().map(|q| q.name).collect::<Vec<_>>().join(", ");
            return Err(LabSheetError::Unknown { file: file.to_owned(), line, found: name.to_owned(), known });
        };
        let given = cells[1..].iter().filter(|cell| !cell.is_empty());
        let numbers = given
            .map(|cell| cell.parse::<f64>().map_err(|_| found(format!("found `{cell}`, which is no number"))))
            .collect::<Result<Vec<f64>, _>>()?;
        let pair = match numbers[..] {
            [both] => [both, both],
            [warp, weft] if quantity.directed => [warp, weft],
            _ => return Err(found(format!("found {} values of {name}", numbers.len()))),
        };
        for (direction, value) in ["warp", "weft"].into_iter().zip(pair) {
            doubts.extend(check(quantity, direction, value, file, line)?);
        }
        if values.insert(quantity.name, pair).is_some() {
            return Err(LabSheetError::Twice { file: file.to_owned(), line, name: quantity.name });
        }
    }
    Ok((values, doubts))
}

/// Refuses a value that no cloth has, and doubts one that apparel cloth has in another unit alone; names that unit.
fn check(
    quantity: &Quantity,
    direction: &'static str,
    value: f64,
    file: &str,
    line: u64,
) -> Result<Option<String>, LabSheetError> {
    let [low, high] = quantity.range;
    if (low..=high).contains(&value) {
        let usual = low * WIDENED..=high / WIDENED;
        let others = quantity.others.iter().filter(|(size, _)| usual.contains(&(value / size)));
        let others: Vec<String> = others.map(|(size, unit)| format!("{unit} (a factor of {size:.4})")).collect();
        let is_doubtful = !usual.contains(&value) && !others.is_empty();
        return Ok(is_doubtful.then(|| {
            let (name, unit, others) = (quantity.name, quantity.unit, others.join(" or "));
            format!("{file}, line {line}: {name} {direction} is {value} {unit}, unusual for apparel cloth; is it in {others}?")
        }));
    }
    let explains = |(size, unit): &(f64, &'static str)| {
        let converted = value / size;
        (low..=high).contains(&converted).then_some((converted, *size, *unit))
    };
    let best = quantity.others.iter().find_map(explains);
    let mistake = best.map_or_else(String::new, |(converted, size, unit)| {
        format!("; is it in {unit}, a factor of {size:.4}? That would be {converted:.4} {}", quantity.unit)
    });
    Err(LabSheetError::Range {
        file: file.to_owned(),
        line,
        name: quantity.name,
        direction,
        found: value,
        low,
        high,
        unit: quantity.unit,
        mistake: mistake.into(),
    })
}

/// A doubt about friction and bending stiffness (warp and weft) that do not belong to one cloth.
fn doubtful_friction(hysteresis: [f64; 2], stiffness: [f64; 2], file: &str) -> Option<String> {
    let residual = (0..2).map(|k| hysteresis[k] / (2.0 * stiffness[k])).filter(|curvature| curvature.is_finite());
    let residual = residual.fold(0.0, f64::max);
    (residual > MAX_RESIDUAL_CURVATURE).then(|| {
        format!(
            "{file}: 2HB is {:.1} times B, so the cloth would keep a curvature of {residual:.1}/cm, expected at most {MAX_RESIDUAL_CURVATURE}/cm; is 2HB in \
             mN·m/m, a factor of 9.8066, or B in another unit?",
            2.0 * residual
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHEET: &str = "quantity,warp,weft\n# cotton broad\nB,0.118,0.09\n2HB,0.124,0.1\nG,0.8,0.7\n2HG,2.0,2.1\nLT,0.7,0.6\n\
                         WT,12.0,15.0\nEM,6.0,9.0\nT,0.497\nW,12.38\n";
    const SIMPLE: &str = "E5,0.3,0.5\nE20,1.1,1.6\nE100,3.0,4.0\nEB5,4.1\nC,18,15\nW,160\nT2,0.5\n";

    fn kes(text: &str) -> Result<FromSheet, LabSheetError> {
        from_csv(LabSystem::Kes, text, "s.csv", "broad")
    }

    fn error(text: &str) -> String {
        kes(text).unwrap_err().to_string()
    }

    #[test]
    fn a_kes_sheet_is_converted_unit_by_unit() {
        let FromSheet { fabric, toml, assumed, .. } = kes(SHEET).unwrap();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-3, "{a} for {b}");
        near(fabric.bending_nm[2], 1.1572e-5);
        near(fabric.bending_nm[1], 0.5 * (fabric.bending_nm[0] + fabric.bending_nm[2]));
        near(fabric.bending_friction_n[1], 6.080e-4);
        near(fabric.shear_n_per_m, 0.75 * 56.19);
        near(fabric.density_kg_per_m2, 0.1238);
        near(fabric.thickness_m, 4.97e-4);
        // 2·12 gf·cm/cm² over 0.06².
        near(fabric.stretch_warp_n_per_m, 24.0 * 0.980_665 / 0.0036);
        assert_eq!(Fabric::parse(&toml, "f").unwrap(), fabric);
        assert_eq!(assumed.len(), 2);
        // Without EM it follows from LT: 2·12/(0.7·500).
        let without = kes(&SHEET.replace("EM,6.0,9.0\n", "")).unwrap().fabric;
        near(without.stretch_warp_n_per_m, 24.0 * 0.980_665 / (24.0f64 / 350.0).powi(2));
    }

    #[test]
    fn a_fast_sheet_is_converted_and_says_that_it_has_no_hysteresis() {
        let sheet = from_csv(LabSystem::Fast, SIMPLE, "s.csv", "suiting").unwrap();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-3, "{a} for {b}");
        near(sheet.fabric.bending_nm[2], 0.16 * 9.806_65 * 0.018f64.powi(3));
        near(sheet.fabric.shear_n_per_m, 30.0);
        near(sheet.fabric.stretch_weft_n_per_m, 14.71 / 0.011);
        assert!(sheet.assumed.iter().any(|line| line.contains("2HB")), "{:?}", sheet.assumed);
        let flat = SIMPLE.replace("E20,1.1,1.6", "E20,1.1,0.4");
        assert!(
            from_csv(LabSystem::Fast, &flat, "s.csv", "x").unwrap_err().to_string().contains("weft is not above E5")
        );
    }

    #[test]
    fn wrong_units_are_recognised_by_their_factor() {
        for (line, wrong, unit, value) in [
            ("B,0.118,0.09", "B,11.6,8.8", "µN·m, a factor of 98.0665", "0.1183 gf·cm²/cm"),
            ("2HB,0.124,0.1", "2HB,12.16,9.8", "mN·m/m, a factor of 9.806", "1.2400 gf·cm/cm"),
            ("G,0.8,0.7", "G,45.0,39.0", "N/m, a factor of 56.19", "0.8009 gf/(cm·deg)"),
            ("W,12.38", "W,1238", "g/m², a factor of 10", "123.8000 mg/cm²"),
            ("WT,12.0,15.0", "WT,400,147", "mN·cm/cm², a factor of 9.806", "40.7886"),
            ("T,0.497", "T,497", "µm", "0.4970 mm"),
        ] {
            let text = error(&SHEET.replace(line, wrong));
            assert!(text.contains(unit) && text.contains(value), "{text}");
        }
    }

    #[test]
    fn values_that_another_unit_would_make_usual_are_doubted_and_taken() {
        assert_eq!(kes(SHEET).unwrap().doubts, [""; 0]);
        assert_eq!(from_csv(LabSystem::Fast, SIMPLE, "s.csv", "x").unwrap().doubts, [""; 0]);
        for (line, wrong, expected) in [
            (
                "B,0.118,0.09",
                "B,1.157,0.09",
                "B warp is 1.157 gf·cm²/cm, unusual for apparel cloth; is it in µN·m (a factor of 98.0665) or mN·cm²/cm (a factor of 9.8066)?",
            ),
            (
                "G,0.8,0.7",
                "G,0.8,6.9",
                "line 5: G weft is 6.9 gf/(cm·deg), unusual for apparel cloth; is it in mN/(cm·deg) (a factor of 9.8066)?",
            ),
            ("2HB,0.124,0.1", "2HB,0.7,0.98", "2HB is 10.9 times B, so the cloth would keep a curvature of 5.4/cm"),
        ] {
            let sheet = kes(&SHEET.replace(line, wrong)).unwrap();
            assert!(sheet.doubts.len() == 1 && sheet.doubts[0].contains(expected), "{:?}", sheet.doubts);
        }
    }

    #[test]
    fn faulty_sheets_are_refused_with_line_and_quantity() {
        assert!(error(&SHEET.replace("G,0.8,0.7\n", "")).contains("found no G"));
        assert!(
            error(&SHEET.replace("2HB,0.124,0.1", "2HB,-0.1,0.1"))
                .contains("line 4: 2HB warp is -0.1, expected 0 to 3")
        );
        assert!(error(&SHEET.replace("0.497", "NaN")).contains("T warp is NaN"));
        assert!(error(&SHEET.replace("0.497", "inf")).contains("T warp is inf"));
        assert!(error(&SHEET.replace("0.497", "thin")).contains("found `thin`, which is no number"));
        assert!(error(&SHEET.replace("W,12.38", "W,12.38,12.40")).contains("found 2 values of W"));
        assert!(error(&SHEET.replace("W,12.38", "W")).contains("found 0 values of W"));
        assert!(error(&format!("{SHEET}B,0.1,0.1\n")).contains("line 12: found B a second time"));
        assert!(error(&format!("{SHEET}SMD,0.1,0.1\n")).contains("`SMD`, expected one of B, 2HB"));
        assert!(error("").contains("found no B"));
    }
}
