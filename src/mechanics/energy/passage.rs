//! Passages: vertices that a step would carry through the body to its other side.
//!
//! Contact sees only where a step ends: a vertex that a step of 6 cm carries through a wrist ends outside, on the wrong side of the arm,
//! and the sleeve is caught. The straight way of a vertex from x to x' is sampled; it is a passage where it starts outside, enters the
//! body at a sample e, and
//!
//! n(e) · n(x') < 0,
//!
//! with n the outward normal at the nearest point of the body. The [collision filter](super::proximity) holds such vertices back at the
//! sample before e.
//!
//! Limits: limbs thinner than the spacing of the samples are missed, and so are ways between vertices. Relaxation moves vertices along
//! curves, which count as straight.

use glam::DVec3;

use crate::body::distance::Body;

/// Spacing of the samples, m: a finger is over twice as thick.
const SPACING_M: f64 = 5e-3;

/// Those of the vertices `near` that a step leads through `body`, each with the share of its move that leads up to the body.
pub(super) fn passages(body: &Body, near: &[u32], from: &[DVec3], to: &[DVec3]) -> Vec<(u32, f64)> {
    let ends = |v: u32| (from[v as usize], to[v as usize]);
    let long = |v: &u32| ends(*v).0.distance(ends(*v).1) > 2.0 * SPACING_M;
    let mut near: Vec<u32> = near.iter().copied().filter(long).collect();
    let middles: Vec<DVec3> = near.iter().map(|&v| ends(v).0.midpoint(ends(v).1)).collect();
    let mut found = body.nearest_all(&middles).into_iter();
    // A way of length L has no point inside the body if its middle is farther from it than L/2.
    near.retain(|&v| found.next().is_some_and(|m| m.signed_distance < 0.5 * ends(v).0.distance(ends(v).1)));
    let passage = |v: u32| {
        let (a, b) = ends(v);
        let samples = (a.distance(b) / SPACING_M).ceil() as usize;
        let way: Vec<DVec3> = (0..=samples).map(|k| a.lerp(b, k as f64 / samples as f64)).collect();
        let found = body.nearest_all(&way);
        let entry = found.iter().position(|sample| sample.signed_distance < 0.0).filter(|&k| k > 0)?;
        let through = found[entry].normal.dot(found[samples].normal) < 0.0;
        through.then(|| (v, (entry - 1) as f64 / samples as f64))
    };
    near.into_iter().filter_map(passage).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;

    #[test]
    fn only_ways_through_the_body_are_passages() {
        // An arm 4 cm thick.
        let body = Body::new(&cuboid(DVec3::new(-0.02, -0.02, -0.5), DVec3::new(0.02, 0.02, 0.5))).unwrap();
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        // Through the arm; from inside it; into it; beside it; along its surface; into it by less than two samples.
        let from = [at(0.03, 0.0), at(0.01, 0.0), at(0.03, 0.0), at(0.03, 0.03), at(0.021, 0.02), at(0.021, 0.0)];
        let to = [at(-0.03, 0.0), at(-0.03, 0.0), at(0.01, 0.0), at(-0.03, 0.03), at(0.021, -0.02), at(0.0195, 0.0)];
        let found = passages(&body, &[0, 1, 2, 3, 4, 5], &from, &to);
        assert_eq!(found.iter().map(|(v, _)| *v).collect::<Vec<_>>(), [0]);
        // The way enters the arm after 1 cm of its 6.
        let free = 0.06 * found[0].1;
        assert!((0.01 - SPACING_M..=0.01).contains(&free), "{free} m");
    }
}
