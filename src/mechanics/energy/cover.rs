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

/// Rounds that brought nothing after which it ends.
const IDLE: usize = 2;

/// A corner is raised by no more than this in all, m.
const FARTHEST: f64 = 4e-3;

/// What covering has done so far.
#[derive(Debug, Default)]
pub(crate) struct Covered {
    raised_m: Vec<f64>,
    fewest: Option<usize>,
    idle: usize,
}

impl Contacts<'_> {
    /// Asks the corners of the triangles through which the body reaches at `x` to keep farther off; returns how many were raised. Takes
    /// effect with the next [`update`](Self::update).
    pub(crate) fn cover(&mut self, triangles: &[[u32; 3]], x: &[DVec3], so_far: &mut Covered) -> usize {
        let Some(body) = self.body() else { return 0 };
        let garment = TriMesh::new(x.to_vec(), triangles.to_vec());
        let mut by = vec![0.0_f64; x.len()];
        let pairs = crossing_pairs(&garment, body.mesh());
        // A place too tight to be covered is not stretched for it.
        let fewer = so_far.fewest.is_none_or(|fewest| pairs.len() < fewest);
        so_far.idle = if fewer { 0 } else { so_far.idle + 1 };
        so_far.fewest = Some(so_far.fewest.map_or(pairs.len(), |fewest| fewest.min(pairs.len())));
        if so_far.idle >= IDLE {
            return 0;
        }
        for [t, u] in pairs {
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
        so_far.raised_m.resize(x.len(), 0.0);
        let mut count = 0;
        for (v, (by, raised)) in by.into_iter().zip(&mut so_far.raised_m).enumerate() {
            let by = by.min(FARTHEST - *raised);
            if by > 0.0 {
                *raised += by;
                self.raise(v, by);
                count += 1;
            }
        }
        count
    }

    /// Raises the distance that a vertex keeps by so much, m; takes effect with the next [`update`](Self::update).
    fn raise(&mut self, v: usize, by: f64) {
        self.offsets[v] += by;
        // What was far enough from the old distance may be near to the new one.
        self.answer[v] = f64::NEG_INFINITY;
        self.leave[v] = if self.held[v] { f64::INFINITY } else { f64::NEG_INFINITY };
    }
}
