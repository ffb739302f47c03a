//! The quartic box spline of a regular patch of Loop's subdivision: its twelve functions at the middle of the triangle,
//! with derivatives.
//!
//! With the barycentric coordinates p, q, r of a triangle, twelve times the functions of its own corner p, of the
//! vertex across the edge pq, and of the vertex beside p next to that one are the polynomials [`CORNER`], [`ACROSS`]
//! and [`BESIDE`]; the twelve are these by symmetry (Stam: "Evaluation of Loop subdivision surfaces", SIGGRAPH 1998
//! course notes; Loop: "Smooth subdivision surfaces based on triangles", 1987).

use glam::{DMat3, DVec3};

/// A term: coefficient and the powers of p, q and r.
type Term = (f64, [i32; 3]);

/// Of the corner p.
pub(super) const CORNER: [Term; 15] = [
    (6.0, [4, 0, 0]),
    (24.0, [3, 0, 1]),
    (24.0, [2, 0, 2]),
    (8.0, [1, 0, 3]),
    (1.0, [0, 0, 4]),
    (24.0, [3, 1, 0]),
    (60.0, [2, 1, 1]),
    (36.0, [1, 1, 2]),
    (6.0, [0, 1, 3]),
    (24.0, [2, 2, 0]),
    (36.0, [1, 2, 1]),
    (12.0, [0, 2, 2]),
    (8.0, [1, 3, 0]),
    (6.0, [0, 3, 1]),
    (1.0, [0, 4, 0]),
];

/// Of the vertex across the edge from p to q.
pub(super) const ACROSS: [Term; 9] = [
    (2.0, [0, 3, 1]),
    (1.0, [0, 4, 0]),
    (6.0, [1, 2, 1]),
    (6.0, [1, 3, 0]),
    (6.0, [2, 1, 1]),
    (12.0, [2, 2, 0]),
    (2.0, [3, 0, 1]),
    (6.0, [3, 1, 0]),
    (1.0, [4, 0, 0]),
];

/// Of the vertex beside p, next to the one across the edge from p to q.
pub(super) const BESIDE: [Term; 2] = [(1.0, [4, 0, 0]), (2.0, [3, 1, 0])];

/// A function at the middle of the triangle: its value, its gradient and its second derivatives by the barycentric
/// coordinates of corners 0, 1, 2.
#[derive(Debug, Clone, Copy)]
pub(super) struct AtMiddle {
    pub(super) value: f64,
    pub(super) gradient: DVec3,
    pub(super) second: DMat3,
}

impl AtMiddle {
    /// The polynomial of `terms` with corner `p` for its p, and so on.
    pub(super) fn of(terms: &[Term], [p, q, r]: [usize; 3]) -> Self {
        let third = 1.0 / 3.0_f64;
        let mut out = Self { value: 0.0, gradient: DVec3::ZERO, second: DMat3::ZERO };
        for &(coefficient, powers) in terms {
            let mut by_corner = [0; 3];
            (by_corner[p], by_corner[q], by_corner[r]) = (powers[0], powers[1], powers[2]);
            let c = coefficient / 12.0;
            // All coordinates are a third, so a term is a third to the power of its degree.
            let degree: i32 = powers.iter().sum();
            out.value += c * third.powi(degree);
            for i in 0..3 {
                let di = f64::from(by_corner[i]);
                out.gradient[i] += c * di * third.powi(degree - 1);
                for (j, &power) in by_corner.iter().enumerate() {
                    let dj = f64::from(power - i32::from(i == j));
                    out.second.col_mut(j)[i] += c * di * dj * third.powi(degree - 2);
                }
            }
        }
        out
    }

    /// Its derivative along a direction in barycentric coordinates.
    pub(super) fn along(&self, a: DVec3) -> f64 {
        self.gradient.dot(a)
    }

    /// Its second derivative along two.
    pub(super) fn twice(&self, a: DVec3, b: DVec3) -> f64 {
        a.dot(self.second * b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every function with its place on the lattice: corners 0 at (0, 0), 1 at (1, 0), 2 at (0, 1).
    fn patch() -> Vec<(AtMiddle, [f64; 2])> {
        let at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0_f64]];
        let plus = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| [a[0] + b[0] - c[0], a[1] + b[1] - c[1]];
        let mut all = Vec::new();
        for p in 0..3 {
            let [q, r] = [(p + 1) % 3, (p + 2) % 3];
            all.push((AtMiddle::of(&CORNER, [p, q, r]), at[p]));
            let across = plus(at[p], at[q], at[r]);
            all.push((AtMiddle::of(&ACROSS, [p, q, r]), across));
            // Beside p next to the vertex across pq, and beside q next to it.
            all.push((AtMiddle::of(&BESIDE, [p, q, r]), plus(at[p], across, at[q])));
            all.push((AtMiddle::of(&BESIDE, [q, p, r]), plus(at[q], across, at[p])));
        }
        all
    }

    #[test]
    fn twelve_functions_hold_constants_lines_and_parabolas() {
        let patch = patch();
        let sum = |f: &dyn Fn(&AtMiddle) -> f64, g: &dyn Fn([f64; 2]) -> f64| -> f64 {
            patch.iter().map(|(n, at)| f(n) * g(*at)).sum()
        };
        let (s, t) = (DVec3::new(-1.0, 1.0, 0.0), DVec3::new(-1.0, 0.0, 1.0));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} expected {b}");
        near(sum(&|n| n.value, &|_| 1.0), 1.0);
        near(sum(&|n| n.value, &|p| p[0]), 1.0 / 3.0);
        near(sum(&|n| n.along(s), &|_| 1.0), 0.0);
        near(sum(&|n| n.along(s), &|p| p[0]), 1.0);
        near(sum(&|n| n.along(t), &|p| p[0]), 0.0);
        near(sum(&|n| n.along(t), &|p| p[1]), 1.0);
        near(sum(&|n| n.twice(s, s), &|p| p[0]), 0.0);
        near(sum(&|n| n.twice(s, s), &|p| p[0] * p[0]), 2.0);
        near(sum(&|n| n.twice(s, t), &|p| p[0] * p[1]), 1.0);
        near(sum(&|n| n.twice(t, t), &|p| p[0] * p[1]), 0.0);
        near(sum(&|n| n.twice(s, t), &|p| p[1] * p[1]), 0.0);
    }
}
