//! The outline of a drape seen from above, and its nodes.
//!
//! The outline is the distance r(θ) from the axis to the farthest point of the drape in [`DIRECTIONS`] directions, at least the disc's
//! radius. Nodes are its maxima. Its harmonics
//!
//! r(θ) = a₀ + Σ a_n cos(n θ − φ_n)
//!
//! tell how even the nodes are: the share of the largest a_n² in Σ a_n² is 1 where all nodes have one height and one spacing.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | r, a_n | distance from the axis, amplitude of a harmonic | m |
//! | θ | direction | rad |
//!
//! Limits: what lies between the axis and the outline is not seen, such as a fold that turns back under itself.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::base::math;
use crate::mesh::TriMesh;

/// Directions of an outline, every half degree: a node of the finest drapes observed is 25 degrees wide.
pub(crate) const DIRECTIONS: usize = 720;

/// Rise of a maximum over the minima beside it that counts as a node, m. A laboratory sees no flatter one.
const PROMINENCE_M: f64 = 1e-3;

/// Harmonics that are computed: twice the nodes of the softest fabric observed.
const HARMONICS: usize = 24;

/// Distance of the drape from the axis in each direction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outline {
    /// r(θ) at θ = 2π k / [`DIRECTIONS`], m.
    pub radius_m: Vec<f64>,
}

/// Nodes of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nodes {
    /// Number of maxima.
    pub count: usize,
    /// Mean height of the maxima minus that of the minima, m; 0 without nodes.
    pub depth_m: f64,
    /// Share of the largest harmonic, 0 to 1; 0 for a circle.
    pub evenness: f64,
}

impl Outline {
    /// The outline of `drape` with a disc of radius `disc` (m) about the origin.
    pub(crate) fn of(drape: &TriMesh, disc: f64) -> Self {
        let mut radius_m = vec![disc; DIRECTIONS];
        let flat: Vec<DVec2> = drape.positions.iter().map(|p| p.truncate()).collect();
        for t in &drape.triangles {
            for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
                pass(flat[a as usize], flat[b as usize], &mut radius_m);
            }
        }
        Self { radius_m }
    }

    /// Number, depth and evenness of the nodes.
    pub(crate) fn nodes(&self) -> Nodes {
        let (peaks, valleys) = self.extrema();
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let depth_m = if peaks.is_empty() { 0.0 } else { mean(&peaks) - mean(&valleys) };
        let squares = self.amplitudes().map(|a| a * a);
        let (largest, sum) = (squares.iter().copied().fold(0.0, f64::max), squares.iter().sum::<f64>());
        Nodes { count: peaks.len(), depth_m, evenness: if sum > 0.0 { largest / sum } else { 0.0 } }
    }

    /// a₁ to a_[`HARMONICS`], m.
    pub(crate) fn amplitudes(&self) -> [f64; HARMONICS] {
        std::array::from_fn(|k| {
            let wave = |i: usize| math::unit(TAU * ((k + 1) * i % DIRECTIONS) as f64 / DIRECTIONS as f64);
            let sum: DVec2 = self.radius_m.iter().enumerate().map(|(i, r)| *r * wave(i)).sum();
            2.0 / DIRECTIONS as f64 * sum.length()
        })
    }

    /// Heights of the maxima and of the minima that differ from their neighbours by the prominence.
    fn extrema(&self) -> (Vec<f64>, Vec<f64>) {
        let (mut peaks, mut valleys) = (Vec::new(), Vec::new());
        let (mut low, mut high, mut rising) = (f64::INFINITY, f64::NEG_INFINITY, false);
        // Two rounds: the first finds a start, the second counts.
        for (i, &r) in self.radius_m.iter().chain(&self.radius_m).enumerate() {
            (low, high) = (low.min(r), high.max(r));
            let counts = i >= self.radius_m.len();
            if rising && r < high - PROMINENCE_M {
                if counts {
                    peaks.push(high);
                }
                (rising, low) = (false, r);
            } else if !rising && r > low + PROMINENCE_M {
                if counts {
                    valleys.push(low);
                }
                (rising, high) = (true, r);
            }
        }
        (peaks, valleys)
    }

    /// The points of the outline, m.
    pub(crate) fn points(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.radius_m.iter().enumerate().map(|(k, r)| *r * math::unit(TAU * k as f64 / DIRECTIONS as f64))
    }
}

/// Raises the radius of every direction that the edge from `a` to `b` passes.
fn pass(a: DVec2, b: DVec2, radius_m: &mut [f64]) {
    let step = TAU / DIRECTIONS as f64;
    let (a, b) = if a.perp_dot(b) < 0.0 { (b, a) } else { (a, b) };
    let (area, along) = (a.perp_dot(b), b - a);
    if area <= 0.0 {
        return;
    }
    let from = math::angle(a) / step;
    let to = from + math::atan2(area, a.dot(b)) / step;
    for k in from.ceil() as i64..=to.floor() as i64 {
        let direction = math::unit(k as f64 * step);
        let slot = &mut radius_m[k.rem_euclid(DIRECTIONS as i64) as usize];
        *slot = slot.max(area / direction.perp_dot(along));
    }
}

/// One figure of a drawing: outlines over one another, with the circles of their test.
pub(crate) struct Figure<'a> {
    /// The line below it.
    pub title: String,
    /// Radius of the disc, m.
    pub disc_m: f64,
    /// Radius of the flat specimen, m.
    pub specimen_m: f64,
    /// Radius of the circle whose shadow has the measured coefficient, m.
    pub measured_m: Option<f64>,
    /// The outlines with their names; a single one needs none.
    pub outlines: Vec<(String, &'a Outline)>,
}

/// Most figures side by side.
const COLUMNS: usize = 4;

/// Drawing of figures in true size, in rows of [`COLUMNS`]: the disc a solid grey circle, the flat specimen a dashed one, the measured coefficient
/// a dashed black one, each outline in its own colour with a line of the legend.
pub(crate) fn to_svg(figures: &[Figure<'_>]) -> String {
    const COLOURS: [&str; 6] = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf"];
    const LINE_MM: f64 = 9.0;
    const MARGIN_MM: f64 = 5.0;
    let farthest = |figure: &Figure<'_>| {
        let radii = figure.outlines.iter().flat_map(|(_, outline)| &outline.radius_m);
        radii.copied().fold(figure.specimen_m.max(figure.measured_m.unwrap_or_default()), f64::max)
    };
    let reach = 1e3 * figures.iter().map(farthest).fold(0.0, f64::max) + MARGIN_MM;
    let lines = 1 + figures.iter().map(|figure| figure.outlines.len()).max().unwrap_or_default();
    let (side, height) = (2.0 * reach, 2.0 * reach + LINE_MM * lines as f64 + MARGIN_MM);
    let columns = figures.len().clamp(1, COLUMNS);
    let (width, full) = (side * columns as f64, height * figures.len().div_ceil(columns) as f64);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.1}mm\" height=\"{full:.1}mm\" viewBox=\"0 0 {width:.1} {full:.1}\" \
         fill=\"none\" stroke-width=\"0.6\" font-family=\"sans-serif\" font-size=\"7\">\n\
         <rect width=\"{width:.1}\" height=\"{full:.1}\" fill=\"white\"/>\n"
    );
    for (i, figure) in figures.iter().enumerate() {
        let (x, y) = (reach + side * (i % columns) as f64, reach + height * (i / columns) as f64);
        out += &format!("<g transform=\"translate({x:.1} {y:.1})\">\n");
        let circles = [(Some(figure.disc_m), "#888", "none"), (Some(figure.specimen_m), "#888", "2 2")];
        for (radius, colour, dash) in circles.into_iter().chain([(figure.measured_m, "black", "5 2")]) {
            let Some(radius) = radius else { continue };
            out += &format!("<circle r=\"{:.2}\" stroke=\"{colour}\" stroke-dasharray=\"{dash}\"/>\n", 1e3 * radius);
        }
        let mut line = reach;
        let mut text = |out: &mut String, colour: &str, text: &str| {
            line += LINE_MM;
            let text = text.replace('&', "&amp;").replace('<', "&lt;");
            *out += &format!("<text x=\"{:.1}\" y=\"{line:.1}\" fill=\"{colour}\">{text}</text>\n", MARGIN_MM - reach);
        };
        text(&mut out, "black", &figure.title);
        for (i, (name, outline)) in figure.outlines.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let points: Vec<String> = outline.points().map(|p| format!("{:.2},{:.2}", 1e3 * p.x, -1e3 * p.y)).collect();
            out += &format!("<polygon points=\"{}\" stroke=\"{colour}\"/>\n", points.join(" "));
            text(&mut out, colour, name);
        }
        out += "</g>\n";
    }
    out + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: f64, amplitude: f64) -> Outline {
        let radius = |k: usize| 0.12 + amplitude * (n * TAU * k as f64 / DIRECTIONS as f64).cos();
        Outline { radius_m: (0..DIRECTIONS).map(radius).collect() }
    }

    #[test]
    fn nodes_are_counted_once_around_with_their_depth_and_evenness() {
        for n in [1, 2, 7] {
            let nodes = wave(f64::from(n), 0.01).nodes();
            assert_eq!(nodes.count, n as usize);
            assert!((nodes.depth_m - 0.02).abs() < 1e-4, "{nodes:?}");
            assert!((nodes.evenness - 1.0).abs() < 1e-12, "{nodes:?}");
        }
        let flat = wave(5.0, 4e-4).nodes();
        assert_eq!((flat.count, flat.depth_m), (0, 0.0));
        let both = wave(5.0, 0.01).radius_m.iter().zip(wave(3.0, 0.01).radius_m).map(|(a, b)| a + b).collect();
        assert!((Outline { radius_m: both }.nodes().evenness - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_outline_of_a_polygon_is_its_distance_in_every_direction() {
        let corners = [0.0, 0.3, 1.4, 3.0, 4.9].map(|angle: f64| (0.2 * math::unit(angle)).extend(-angle));
        let triangles = (1..4).map(|i| [0, i, i + 1]).collect();
        let outline = Outline::of(&TriMesh::new(corners.to_vec(), triangles), 0.05);
        for (k, r) in outline.radius_m.iter().enumerate() {
            let direction = math::unit(TAU * k as f64 / DIRECTIONS as f64);
            let sides = (0..5).map(|i| [corners[i], corners[(i + 1) % 5]].map(glam::DVec3::truncate));
            let near = sides.filter_map(|[p, q]| {
                let along = q - p;
                let distance = p.perp_dot(along) / direction.perp_dot(along);
                (distance > 0.0).then_some(distance)
            });
            let expected = near.fold(f64::INFINITY, f64::min).max(0.05);
            assert!((r - expected).abs() < 1e-12, "direction {k}: {r} for {expected}");
        }
    }

    #[test]
    fn each_figure_has_its_own_circles_and_names() {
        let one = wave(5.0, 0.01);
        let figure = |disc_m, measured_m| Figure {
            title: "1 < 2".to_owned(),
            disc_m,
            specimen_m: 0.15,
            measured_m,
            outlines: vec![("a<b".to_owned(), &one), ("c".to_owned(), &one)],
        };
        let svg = to_svg(&[figure(0.09, None), figure(0.0635, Some(0.1))]);
        let count = |text: &str| svg.matches(text).count();
        assert_eq!([count("<polygon"), count("<circle"), count("<text")], [4, 5, 6]);
        assert_eq!([count("r=\"90.00\""), count("r=\"63.50\""), count("r=\"100.00\"")], [1, 1, 1]);
        assert!(svg.contains(">a&lt;b<") && svg.contains(">1 &lt; 2<") && svg.ends_with("</svg>\n"));
    }
}
