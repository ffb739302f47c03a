//! Bending: the cost of curvature across each inner edge.
//!
//! Quadratic bending of an inextensible surface (Bergou, Wardetzky, Harmon, Zorin, Grinspun: "A quadratic bending model
//! for inextensible surfaces", SGP 2006). For an inner edge (x₀, x₁) with opposite corners x₂, x₃,
//!
//! E = ½ · 3B/(A₀ + A₁) · |Σ c_i x_i|²,
//!
//! c₀ = cot α₀₃ + cot α₀₄, c₁ = cot α₀₁ + cot α₀₂, c₂ = −cot α₀₁ − cot α₀₃, c₃ = −cot α₀₂ − cot α₀₄, with α₀₁, α₀₂ the rest
//! angles at x₀ and α₀₃, α₀₄ those at x₁, in the first and second triangle. Summed over edges it approximates ½ ∫ B κ² dA on
//! a developable surface. The Hessian is constant: a scalar per pair of vertices times the identity.
//!
//! B is a fabric's stiffness in the direction across the edge, from its three measured directions by
//! B(φ) = a + b cos 2φ + c cos 4φ, φ the angle of that direction from the weft.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A₀, A₁ | rest areas of the two triangles | m² |
//! | B | bending stiffness | N·m |
//! | c_i | cotangent weights | – |
//!
//! Limits: the energy is exact in the limit of isometric deformation and flat rest; the direction of bending is that
//! across the mesh edge, so a strongly orthotropic fabric bends as the mean over the edges a fold crosses.

use glam::{DVec2, DVec3};

/// One inner edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// x₀, x₁ (the edge), x₂, x₃ (the opposite corners).
    pub vertices: [u32; 4],
    /// Cotangent weights c_i.
    pub weights: [f64; 4],
    /// 3B/(A₀ + A₁), N/m.
    pub stiffness: f64,
}

/// A triangle as a hinge sees it: the edge's two ends and the opposite corner, flat.
#[derive(Debug, Clone, Copy)]
pub struct Wing {
    /// Edge ends and opposite corner in the triangle's flat frame, m.
    pub corners: [DVec2; 3],
}

impl Wing {
    fn cotangents(&self) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let cot = |p: DVec2, q: DVec2| p.dot(q) / p.perp_dot(q).abs();
        [cot(b - a, c - a), cot(a - b, c - b)]
    }

    fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).perp_dot(c - a).abs()
    }

    /// cos 2φ and cos 4φ of the direction across the edge.
    fn across(&self) -> [f64; 2] {
        let edge = (self.corners[1] - self.corners[0]).normalize_or_zero();
        // Turning by 90 degrees changes the sign of cos 2φ and not that of cos 4φ.
        let cos2 = -(edge.x * edge.x - edge.y * edge.y);
        [cos2, 2.0 * cos2 * cos2 - 1.0]
    }
}

impl Hinge {
    /// From both triangles' flat frames and the stiffness along weft, bias and warp (N·m).
    #[must_use]
    pub fn new(vertices: [u32; 4], wings: [Wing; 2], bending_nm: [f64; 3]) -> Self {
        let [[c01, c03], [c02, c04]] = [wings[0].cotangents(), wings[1].cotangents()];
        let weights = [c03 + c04, c01 + c02, -c01 - c03, -c02 - c04];
        let [weft, bias, warp] = bending_nm;
        let (p, q) = (wings[0].across(), wings[1].across());
        let (cos2, cos4) = (0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]));
        let b =
            0.25 * (weft + 2.0 * bias + warp) + 0.5 * (weft - warp) * cos2 + 0.25 * (weft - 2.0 * bias + warp) * cos4;
        Self { vertices, weights, stiffness: 3.0 * b / (wings[0].area() + wings[1].area()) }
    }

    /// Σ c_i x_i, m.
    #[must_use]
    pub fn curvature_vector(&self, x: &[DVec3]) -> DVec3 {
        self.vertices.iter().zip(&self.weights).map(|(&v, &w)| x[v as usize] * w).sum()
    }

    /// Energy, J.
    #[must_use]
    pub fn energy(&self, x: &[DVec3]) -> f64 {
        0.5 * self.stiffness * self.curvature_vector(x).length_squared()
    }

    /// Adds the gradient, N; returns the energy.
    pub fn add_gradient(&self, x: &[DVec3], gradient: &mut [DVec3]) -> f64 {
        let k = self.curvature_vector(x);
        for (&v, &w) in self.vertices.iter().zip(&self.weights) {
            gradient[v as usize] += k * (w * self.stiffness);
        }
        0.5 * self.stiffness * k.length_squared()
    }

    /// The Hessian's scalar for the local pair (i, j), N/m.
    #[must_use]
    pub fn hessian(&self, i: usize, j: usize) -> f64 {
        self.stiffness * self.weights[i] * self.weights[j]
    }
}
