//! Panels laid out beside each other, and the pattern drawn as SVG.

use std::fmt::Write as _;

use glam::DVec2;

use super::curve::Curve;
use super::panel_mesh::{box_about, is_within};
use super::panels::{EdgeAt, PatternPanel, SewingPattern};

/// Distance between two panels, m.
const GAP: f64 = 0.04;

/// Width over height of the drawing that the panels should fill.
const ASPECT: f64 = 1.8;

/// Most first panels and most panels in a row that are tried; a file may have thousands.
const MAX_TRIED: usize = 48;

/// Margin around the panels, mm.
const MARGIN: f64 = 30.0;
/// Length of the arrow along the grain, mm.
const GRAIN: f64 = 60.0;
/// Height of a panel, mm, below which the arrow stands beside the name.
const LOW: f64 = 150.0;

/// Colours of seams in turn: Okabe and Ito's, which remain distinct in red-green colour blindness.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7a5195"];

/// The offset of each panel, m, that lays the panels beside each other, upright and in rows; the lower left corner of all is
/// the origin.
#[must_use]
pub fn laid_out(pattern: &SewingPattern) -> Vec<DVec2> {
    let boxes: Vec<[DVec2; 2]> = pattern.panels.iter().map(|panel| box_about(panel.points())).collect();
    let sizes: Vec<DVec2> = boxes.iter().map(|[low, high]| high - low).collect();
    // Row widths are sums of consecutive panels; the layout that is drawn largest at this aspect ratio wins.
    let sums = |first: usize| {
        sizes[first..].iter().scan(-GAP, |sum, size| {
            *sum += size.x + GAP;
            Some(*sum)
        })
    };
    let shown = |rows: &Rows| (ASPECT / rows.size.x).min(1.0 / rows.size.y);
    let candidates = (0..sizes.len().min(MAX_TRIED))
        .flat_map(|first| sums(first).take(MAX_TRIED))
        .map(|width| in_rows(&sizes, width));
    let Some(Rows { corners, size: DVec2 { y: height, .. } }) =
        candidates.reduce(|best, other| if shown(&other) > shown(&best) { other } else { best })
    else {
        return Vec::new();
    };
    let mut offsets: Vec<DVec2> = corners.iter().zip(&boxes).map(|(corner, [low, _])| corner - low).collect();
    // The first row on top.
    for ((offset, [low, _]), size) in offsets.iter_mut().zip(&boxes).zip(&sizes) {
        let y = offset.y + low.y;
        offset.y = height - y - size.y - low.y;
    }
    offsets
}

/// Boxes placed one after the other in rows, the first row at 0.
struct Rows {
    /// Lower left corner of each.
    corners: Vec<DVec2>,
    /// Size of all together.
    size: DVec2,
}

/// Places boxes in rows of at most `width`, or of a single wider box.
fn in_rows(sizes: &[DVec2], width: f64) -> Rows {
    let (mut cursor, mut row, mut widest) = (DVec2::ZERO, 0.0_f64, 0.0_f64);
    let mut place = |size: &DVec2| {
        if cursor.x > 0.0 && cursor.x + size.x > width * (1.0 + 1e-9) {
            cursor = DVec2::new(0.0, cursor.y + row + GAP);
            row = 0.0;
        }
        let corner = cursor;
        cursor.x += size.x + GAP;
        (row, widest) = (row.max(size.y), widest.max(corner.x + size.x));
        corner
    };
    let corners = sizes.iter().map(&mut place).collect();
    Rows { corners, size: DVec2::new(widest, cursor.y + row) }
}

/// The pattern as an SVG drawing in its true size (a millimetre of the drawing is a millimetre of cloth): panels with grain and
/// labels, edges as the curves they are with small grey numbers, and seams with a number and a colour that are the same on both sides. The longer side
/// of a gathered seam has its excess length in per cent.
#[must_use]
pub fn to_svg(pattern: &SewingPattern) -> String {
    let offsets = laid_out(pattern);
    let points = || {
        let of_panel =
            |(panel, offset): (&PatternPanel, &DVec2)| panel.points().map(|p| p + offset).collect::<Vec<_>>();
        pattern.panels.iter().zip(&offsets).flat_map(of_panel)
    };
    let high = points().fold(DVec2::ZERO, DVec2::max) * 1e3;
    let (width, height) = (high.x + 2.0 * MARGIN, high.y + 2.0 * MARGIN);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.1}mm\" height=\"{height:.1}mm\" \
         viewBox=\"0 0 {width:.1} {height:.1}\" font-family=\"sans-serif\">"
    );
    let _ = writeln!(out, "<title>{}</title>", escaped(&pattern.name));
    let _ = writeln!(out, "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>");
    let onto = |p: DVec2| DVec2::new(MARGIN + 1e3 * p.x, height - MARGIN - 1e3 * p.y);
    for (panel, &offset) in pattern.panels.iter().zip(&offsets) {
        let mut path = String::new();
        let start = onto(panel.edges[0].curve.start() + offset);
        let _ = write!(path, "M{:.3} {:.3}", start.x, start.y);
        panel.edges.iter().for_each(|e| path += &command(&e.curve, offset, &onto));
        let _ = writeln!(out, "<path d=\"{path}Z\" fill=\"#f4f1ea\" stroke=\"#333\" stroke-width=\"1\"/>");
        let outline: Vec<DVec2> = panel.points().collect();
        let middle = onto(middle(&outline) + offset);
        // The grain, along y: above the name, beside it where a panel is low.
        let size = size(&outline);
        let low = size.y < LOW;
        let (x, y, length) = if low {
            (middle.x - 0.25 * size.x, middle.y + 0.3 * size.y, 0.6 * size.y)
        } else {
            (middle.x, middle.y - 8.0, GRAIN)
        };
        let _ = writeln!(
            out,
            "<path d=\"M{x:.1} {y:.1}v-{length:.1}m-4 8l4 -8l4 8M{x:.1} {y:.1}m-4 -8l4 8l4 -8\" fill=\"none\" stroke=\"#999\"/>"
        );
        let label = panel.label.as_ref().map(|l| format!(" ({})", escaped(l))).unwrap_or_default();
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{}\" text-anchor=\"middle\">{}{label}</text>",
            middle.x,
            middle.y + if low { 3.0 } else { 8.0 },
            if low { 9 } else { 14 },
            escaped(&panel.name)
        );
        for line in &panel.drawn {
            let points: Vec<String> =
                line.iter().map(|p| onto(*p + offset)).map(|p| format!("{:.3} {:.3}", p.x, p.y)).collect();
            let _ =
                writeln!(out, "<path d=\"M{}\" fill=\"none\" stroke=\"#999\" stroke-width=\"0.6\"/>", points.join("L"));
        }
        for (number, edge) in panel.edges.iter().enumerate() {
            // As `panel.edge` in the lists of seams.
            text(&mut out, inward(&outline, &edge.curve, 6e-3) + offset, &onto, 10.0, "#777", &number.to_string());
            if let Some(label) = &edge.label {
                text(&mut out, inward(&outline, &edge.curve, 24e-3) + offset, &onto, 8.0, "#777", &escaped(label));
            }
        }
    }
    for (number, stitch) in pattern.stitches.iter().enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        let gathering = pattern.gathering(stitch) - 1.0;
        let [a, b] = pattern.lengths(stitch);
        for (side, longer) in stitch.sides.iter().zip([a >= b, b > a]) {
            let EdgeAt { panel, edge } = *side;
            let (panel, offset) = (&pattern.panels[panel], offsets[panel]);
            let curve = &panel.edges[edge].curve;
            let start = onto(curve.start() + offset);
            let drawn = command(curve, offset, &onto);
            let _ = writeln!(
                out,
                "<path d=\"M{:.3} {:.3}{drawn}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"/>",
                start.x, start.y
            );
            let outline: Vec<DVec2> = panel.points().collect();
            let mut name = (number + 1).to_string();
            if longer && gathering > SewingPattern::GATHERED {
                let _ = write!(name, " +{:.0} %", 100.0 * gathering);
            }
            if stitch.right_wrong {
                name += " turned over";
            }
            text(&mut out, inward(&outline, curve, 12e-3) + offset, &onto, 11.0, colour, &name);
        }
    }
    out += "</svg>\n";
    out
}

fn text(out: &mut String, at: DVec2, onto: &impl Fn(DVec2) -> DVec2, size: f64, colour: &str, text: &str) {
    let p = onto(at);
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{size}\" fill=\"{colour}\" text-anchor=\"middle\" \
         dominant-baseline=\"middle\">{text}</text>",
        p.x, p.y
    );
}

/// The path command of a curve from its start.
fn command(curve: &Curve, offset: DVec2, onto: &impl Fn(DVec2) -> DVec2) -> String {
    let at = |p: DVec2| {
        let p = onto(p + offset);
        format!("{:.3} {:.3}", p.x, p.y)
    };
    match curve {
        Curve::Line { b, .. } => format!("L{}", at(*b)),
        Curve::Quadratic { c, b, .. } => format!("Q{} {}", at(*c), at(*b)),
        Curve::Cubic { c, d, b, .. } => format!("C{} {} {}", at(*c), at(*d), at(*b)),
        Curve::Polyline { points } => points[1..].iter().map(|p| format!("L{}", at(*p))).collect(),
        Curve::Arc { b, radius, turn, .. } => {
            // y points down on the page, which inverts the sweep flag.
            let (large, sweep) = (u8::from(turn.abs() > std::f64::consts::PI), u8::from(*turn < 0.0));
            format!("A{0:.3} {0:.3} 0 {large} {sweep} {1}", 1e3 * radius, at(*b))
        }
    }
}

/// A point beside the middle of a curve, inside the panel.
fn inward(outline: &[DVec2], curve: &Curve, by: f64) -> DVec2 {
    let [a, p, b] = [0.49, 0.5, 0.51].map(|t| curve.at(t));
    let normal = (b - a).perp().normalize_or_zero();
    let positive = outline.windows(2).map(|w| w[0].perp_dot(w[1])).sum::<f64>() > 0.0;
    // In a low panel, keep clear of the name in its middle.
    let by = by.min(2e-4 * size(outline).y);
    p + normal * if positive { by } else { -by }
}

/// Width and height of a panel, mm.
fn size(outline: &[DVec2]) -> DVec2 {
    let [low, high] = box_about(outline.iter().copied());
    1e3 * (high - low)
}

/// The position of the panel's name: the centre of its box, or the mean of its points where that lies outside.
fn middle(outline: &[DVec2]) -> DVec2 {
    let [low, high] = box_about(outline.iter().copied());
    let p = 0.5 * (low + high);
    let n = outline.len();
    let sides: Vec<[DVec2; 2]> = (0..n).map(|i| [outline[i], outline[(i + 1) % n]]).collect();
    if is_within(p, &sides) { p } else { outline.iter().sum::<DVec2>() / n as f64 }
}

fn escaped(text: &str) -> String {
    let plain = crate::base::error_text::without_control(text);
    plain.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
