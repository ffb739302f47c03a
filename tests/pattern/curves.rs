//! Meshed edges of every kind lie on the curves of the format.

use glam::DVec2;
use partwise::garment::pattern::sew;
use serde_json::json;

use crate::{parse, pattern};

/// Largest distance of an outline's vertices to densely sampled points of `curve`, m.
fn farthest(points: &[DVec2], curve: impl Fn(f64) -> DVec2) -> f64 {
    let samples: Vec<DVec2> = (0..=4000).map(|i| curve(f64::from(i) / 4000.0)).collect();
    let to_curve = |p: &DVec2| {
        let to_chord = |w: &[DVec2]| {
            let d = w[1] - w[0];
            p.distance(w[0] + d * ((*p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0))
        };
        samples.windows(2).map(to_chord).fold(f64::INFINITY, f64::min)
    };
    points.iter().map(to_curve).fold(0.0, f64::max)
}

#[test]
fn meshed_edges_lie_on_their_curves_at_equal_lengths() {
    let vertices = [[0.0, 0.0], [40.0, 0.0], [40.0, 50.0], [0.0, 50.0]];
    let panel = json!({ "vertices": vertices, "edges": [
        { "endpoints": [0, 1], "curvature": { "type": "quadratic", "params": [[0.3, -0.2]] } },
        { "endpoints": [1, 2], "curvature": { "type": "cubic", "params": [[0.2, -0.15], [0.7, 0.1]] } },
        { "endpoints": [2, 3], "curvature": { "type": "circle", "params": [30.0, 0, 1] } },
        { "endpoints": [3, 0] },
    ] });
    let sewn = sew(&parse(&pattern(&json!({ "one": panel }), &json!([]))), 0.01).unwrap();
    let panel = &sewn.panels[0];
    let flat = |edge: usize| -> Vec<DVec2> {
        let vertices = panel.along(edge);
        vertices.iter().map(|v| panel.flat[panel.vertices.iter().position(|w| w == v).unwrap()]).collect()
    };
    let v = vertices.map(|v| DVec2::from_array(v) * 0.01);
    let control = |a: DVec2, b: DVec2, u: f64, w: f64| a + (b - a) * u + (b - a).perp() * w;
    let c = control(v[0], v[1], 0.3, -0.2);
    let quadratic = |t: f64| v[0].lerp(c, t).lerp(c.lerp(v[1], t), t);
    let (d, e) = (control(v[1], v[2], 0.2, -0.15), control(v[1], v[2], 0.7, 0.1));
    let cubic = |t: f64| {
        let (p, q, r) = (v[1].lerp(d, t), d.lerp(e, t), e.lerp(v[2], t));
        p.lerp(q, t).lerp(q.lerp(r, t), t)
    };
    // From (0.4, 0.5) to (0, 0.5), counter-clockwise about a centre below: it bulges upward.
    let centre = DVec2::new(0.2, 0.5 - (0.3_f64.powi(2) - 0.2_f64.powi(2)).sqrt());
    let half = (0.2_f64 / 0.3).asin();
    let circle = |t: f64| centre + 0.3 * DVec2::from_angle(std::f64::consts::FRAC_PI_2 - half + 2.0 * half * t);
    let straight = |t: f64| v[3].lerp(v[0], t);
    let curves: [&dyn Fn(f64) -> DVec2; 4] = [&quadratic, &cubic, &circle, &straight];
    for (edge, curve) in curves.into_iter().enumerate() {
        let points = flat(edge);
        assert!(points[0].distance(curve(0.0)) + points[points.len() - 1].distance(curve(1.0)) < 1e-12);
        // A thousandth of a millimetre.
        assert!(farthest(&points, curve) < 1e-6, "edge {edge}: {} m", farthest(&points, curve));
        let chords: Vec<f64> = points.windows(2).map(|w| w[0].distance(w[1])).collect();
        let (least, most) = chords.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), c| (l.min(*c), m.max(*c)));
        assert!(most <= 0.01 + 1e-12 && least > 0.98 * most, "edge {edge}: {least} to {most} m");
    }
}

#[test]
fn panels_are_placed_by_the_format_s_rotation_and_translation() {
    let panel = json!({ "translation": [10.0, 100.0, 20.0], "rotation": [0.0, 90.0, 30.0],
        "vertices": [[0.0, 0.0], [10.0, 0.0], [0.0, 20.0]],
        "edges": [{ "endpoints": [0, 1] }, { "endpoints": [1, 2] }, { "endpoints": [2, 0] }] });
    let read = parse(&pattern(&json!({ "one": panel }), &json!([])));
    // Ry by 90 degrees takes x to −z and leaves y; Rz by 30 turns y. Then y up becomes z, z to the front −y.
    let place = |x: f64, y: f64| read.panels[0].place(DVec2::new(x, y)).to_array();
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(place(0.0, 0.0), [0.1, -0.2, 1.0]), "{:?}", place(0.0, 0.0));
    assert!(near(place(0.1, 0.0), [0.1, -0.1, 1.0]), "{:?}", place(0.1, 0.0));
    assert!(near(place(0.0, 0.2), [0.0, -0.2, 1.0 + 0.2 * 0.75_f64.sqrt()]), "{:?}", place(0.0, 0.2));
}
