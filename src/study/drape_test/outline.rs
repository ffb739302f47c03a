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

/// Drawing of outlines over one another in true size, with the disc and the flat specimen; a colour and a line of the legend for each.
pub(crate) fn to_svg(outlines: &[(String, &Outline)], disc_m: f64, specimen_m: f64) -> String {
    const COLOURS: [&str; 6] = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf"];
    const LINE_MM: f64 = 6.0;
    let reach = 1e3 * outlines.iter().flat_map(|(_, o)| &o.radius_m).copied().fold(specimen_m, f64::max) + 5.0;
    let (side, height) = (2.0 * reach, 2.0 * reach + LINE_MM * (outlines.len() as f64 + 0.5));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{side:.1}mm\" height=\"{height:.1}mm\" \
         viewBox=\"{:.1} {:.1} {side:.1} {height:.1}\" fill=\"none\" stroke-width=\"0.5\" font-family=\"sans-serif\" font-size=\"4\">\n\
         <rect x=\"{:.1}\" y=\"{:.1}\" width=\"{side:.1}\" height=\"{height:.1}\" fill=\"white\"/>\n",
        -reach, -reach, -reach, -reach
    );
    for (radius, dash) in [(disc_m, "none"), (specimen_m, "2 2")] {
        out += &format!("<circle r=\"{:.2}\" stroke=\"#888\" stroke-dasharray=\"{dash}\"/>\n", 1e3 * radius);
    }
    for (i, (name, outline)) in outlines.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let points: Vec<String> = outline.points().map(|p| format!("{:.2},{:.2}", 1e3 * p.x, -1e3 * p.y)).collect();
        let name = name.replace('&', "&amp;").replace('<', "&lt;");
        let (x, y) = (2.0 - reach, reach + LINE_MM * (i as f64 + 0.75));
        out += &format!("<polygon points=\"{}\" stroke=\"{colour}\"/>\n", points.join(" "));
        out += &format!("<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{colour}\" stroke=\"none\">{name}</text>\n");
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
    fn the_drawing_names_every_outline() {
        let one = wave(5.0, 0.01);
        let svg = to_svg(&[("a<b".to_owned(), &one), ("c".to_owned(), &one)], 0.09, 0.15);
        assert_eq!(svg.matches("<polygon").count(), 2);
        assert!(svg.contains("a&lt;b") && svg.ends_with("</svg>\n"));
    }
}
