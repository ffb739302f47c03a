//! Skin through cloth: where the body pokes through a triangle whose corners are all outside, they are kept farther off.
//!
//! Contact is felt at the vertices. Where the body is rounder than the cloth's mesh is fine, it reaches through the middle of a triangle. What
//! crosses is found exactly (`mesh::self_intersection`), and the corners of such a triangle are asked to keep as much farther from the
//! body as it reaches through. A few times, each after the cloth has come to rest again, are enough.
//!
//! Limits: the cloth then lies off the body by up to [`FARTHEST`] more about such a place; a body whose own triangles are larger than
//! the cloth's may need more.

use glam::DVec3;

use super::Contacts;
use crate::mesh::TriMesh;
use crate::mesh::self_intersection::crossing_pairs;

/// Least and most that a corner is raised at a time, m: a tenth of a cloth's thickness, and a thick one's.
const RAISE: [f64; 2] = [1e-4, 1e-3];

/// A corner is raised by no more than this in all, m.
const FARTHEST: f64 = 8e-3;

impl Contacts<'_> {
    /// Asks the corners of the triangles through which the body reaches at `x` to keep farther off; returns how many were raised. Takes
    /// effect with the next [`update`](Self::update).
    pub(crate) fn cover(&mut self, triangles: &[[u32; 3]], x: &[DVec3], raised: &mut Vec<f64>) -> usize {
        let Some(body) = self.body() else { return 0 };
        let garment = TriMesh::new(x.to_vec(), triangles.to_vec());
        let mut by = vec![0.0_f64; x.len()];
        for [t, u] in crossing_pairs(&garment, body.mesh()) {
            let [a, b, c] = garment.corners(t as usize);
            let plane = (b - a).cross(c - a).normalize_or_zero();
            let skin = body.mesh().corners(u as usize);
            // Out of the body, whichever way the garment is wound.
            let out = if plane.dot((skin[1] - skin[0]).cross(skin[2] - skin[0])) < 0.0 { -plane } else { plane };
            let through = skin.iter().map(|p| out.dot(*p - a)).fold(0.0, f64::max).clamp(RAISE[0], RAISE[1]);
            for v in garment.triangles[t as usize] {
                by[v as usize] = by[v as usize].max(through);
            }
        }
        raised.resize(x.len(), 0.0);
        let mut count = 0;
        for (v, (by, raised)) in by.into_iter().zip(raised).enumerate() {
            let by = by.min(FARTHEST - *raised);
            if by > 0.0 {
                *raised += by;
                self.raise(v, by);
                count += 1;
            }
        }
        count
    }
}
