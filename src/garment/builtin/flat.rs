//! The rest shape: each triangle laid flat in its own frame, x along the weft, y along the warp.
//!
//! The warp runs up the garment: along z on bodice and skirt, along the arm on a sleeve, projected into the triangle; the weft is
//! warp × n, so that weft × warp = n. On the shoulders, where z has no projection to speak of, the weft is taken along x. Without
//! fullness the flat triangle is congruent to the placed one. With fullness φ an edge's weft component is s times as long, s = 1 + φ (z_top − z)/length
//! at the edge's middle z; the three lengths then make the flat triangle. Neighbouring triangles agree on their common edge exactly.

use glam::{DVec2, DVec3};

use crate::mesh::TriMesh;

/// A triangle this level (n_z² above it) has its weft along x.
const LEVEL: f64 = 0.5;

/// How much more cloth the rest shape has than the placed garment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fullness {
    /// φ, extra cloth in the hem as a share.
    pub(super) share: f64,
    /// Where it begins, m.
    pub(super) top: f64,
    /// Where it is reached, m.
    pub(super) hem: f64,
    /// Axis of the skirt: the weft runs around it.
    pub(super) axis: DVec3,
}

/// The flat corners of every triangle, m. `up` is the direction of the warp before projection, for each triangle.
pub(super) fn lay_flat(mesh: &TriMesh, up: impl Fn(usize) -> DVec3, fullness: Fullness) -> Vec<[DVec2; 3]> {
    (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            let n = (b - a).cross(c - a).normalize_or_zero();
            let warp = if n.z * n.z > LEVEL {
                n.cross(DVec3::X).normalize_or_zero()
            } else {
                let d = up(t);
                (d - d.dot(n) * n).normalize_or_zero()
            };
            let weft = warp.cross(n);
            let flat = |p: DVec3| DVec2::new((p - a).dot(weft), (p - a).dot(warp));
            let placed = [DVec2::ZERO, flat(b), flat(c)];
            if fullness.share <= 0.0 {
                return placed;
            }
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| fullness.edge(p, q));
            // p₀ at the origin, p₁ along x, p₂ from the three lengths (law of cosines), turned to where the placed edge points.
            let x = (ab * ab + ca * ca - bc * bc) / (2.0 * ab);
            let y = (ca * ca - x * x).max(0.0).sqrt();
            let s = fullness.stretch(0.5 * (a.z + b.z));
            let turn = DVec2::new(placed[1].x * s, placed[1].y).normalize_or(DVec2::X);
            [DVec2::ZERO, turn * ab, turn.rotate(DVec2::new(x, y))]
        })
        .collect()
}

impl Fullness {
    fn stretch(&self, z: f64) -> f64 {
        1.0 + self.share * ((self.top - z) / (self.top - self.hem)).clamp(0.0, 1.0)
    }

    /// Rest length of an edge.
    fn edge(&self, p: DVec3, q: DVec3) -> f64 {
        let middle = 0.5 * (p + q) - self.axis;
        let around = DVec3::new(-middle.y, middle.x, 0.0).normalize_or_zero();
        let (d, s) = (q - p, self.stretch(0.5 * (p.z + q.z)));
        (d.length_squared() + (s * s - 1.0) * d.dot(around).powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_fullness_triangles_are_congruent_and_with_it_wider() {
        let (a, b, c) = (DVec3::new(1.0, 0.0, 0.5), DVec3::new(1.0, 0.1, 0.5), DVec3::new(1.0, 0.0, 0.6));
        let mesh = TriMesh::new(vec![a, b, c], vec![[0, 1, 2]]);
        let none = Fullness { share: 0.0, top: 1.0, hem: 0.0, axis: DVec3::ZERO };
        let flat = lay_flat(&mesh, |_| DVec3::Z, none)[0];
        for (i, (p, q)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            assert!((flat[i].distance(flat[(i + 1) % 3]) - p.distance(q)).abs() < 1e-12);
        }
        // The warp runs up: the upper corner has the larger y; the winding stays.
        assert!(flat[2].y > flat[0].y + 0.09);
        assert!((flat[1] - flat[0]).perp_dot(flat[2] - flat[0]) > 0.0);
        let full = lay_flat(&mesh, |_| DVec3::Z, Fullness { share: 0.4, ..none })[0];
        // Half way down, 0.4 of fullness is 0.2: the horizontal edge grows by it (to the cosine of half its angle).
        assert!((full[0].distance(full[1]) - 0.12).abs() < 1e-4);
        assert!((full[0].distance(full[2]) - 0.1).abs() < 1e-12);
    }
}
