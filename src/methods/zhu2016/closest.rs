//! The closest point of a triangle, by the region of its plane that a point lies over (Ericson: "Real-time collision
//! detection", 5.1.5).

use glam::DVec3;

/// The point of a triangle nearest to `p`, and its barycentric weights.
#[inline]
pub(super) fn closest([a, b, c]: [DVec3; 3], p: DVec3) -> (DVec3, [f64; 3]) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return (a + ab * t, [1.0 - t, t, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return (a + ac * t, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + (c - b) * t, [0.0, 1.0 - t, t]);
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    (a + ab * v + ac * w, [1.0 - v - w, v, w])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_region_has_its_closest_point() {
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let near = |p: DVec3| closest([a, b, c], p);
        let cases = [
            (DVec3::new(-1.0, -1.0, 2.0), a),
            (DVec3::new(2.0, -0.5, 1.0), b),
            (DVec3::new(-0.5, 3.0, 1.0), c),
            (DVec3::new(0.4, -1.0, 1.0), DVec3::new(0.4, 0.0, 0.0)),
            (DVec3::new(-1.0, 0.3, 1.0), DVec3::new(0.0, 0.3, 0.0)),
            (DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.5, 0.5, 0.0)),
            (DVec3::new(0.2, 0.3, -4.0), DVec3::new(0.2, 0.3, 0.0)),
        ];
        for (p, expected) in cases {
            let (found, weights) = near(p);
            assert!(found.distance(expected) < 1e-12, "{p}: {found}");
            let blended = a * weights[0] + b * weights[1] + c * weights[2];
            assert!(blended.distance(found) < 1e-12 && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
