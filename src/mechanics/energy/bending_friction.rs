//! Friction between yarns in bending: the hysteresis that a KES-FB2 test reports as 2HB.
//!
//! A yarn slides over the yarns that it crosses once the moment of the cloth exceeds HB, half the width of the hysteresis loop. On the
//! way from the flat cloth to a curvature κ the friction dissipates HB κ per area, at any speed. A drape is one such increment, so
//! the dissipation is a potential beside the elastic energy ½ B κ² (`bending`):
//!
//! E = Σ A_i (√(q² + m²) − m), q² = H_u² |x_uu|² + 2 H_u H_v |x_uv|² + H_v² |x_vv|², m = ½ (H_u + H_v) w.
//!
//! For a cylinder q is H_u κ along the weft, H_v κ along the warp and ½ (H_u + H_v) κ on the bias. The moment is H q/√(q² + m²): an elastic
//! stiffness H/w below the width w, Coulomb's H beyond. E is convex in the positions, so its Hessian is positive semi-definite.
//! Where a moment stays below H the cloth stays flat up to a curvature of the order of w.
//!
//! Sources: 2HB after Kawabata: "The standardization and analysis of hand evaluation" (1980); Coulomb elements beside an elastic plate
//! after Lahey and Heppler: "Mechanical modeling of fabrics in bending" (J. Appl. Mech. 71, 2004) and Ngo Ngoc and Boivin: "Nonlinear cloth
//! simulation" (INRIA RR-5099, 2004).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | H_u, H_v | Coulomb moment HB per length along weft and warp, half of 2HB | N |
//! | x_uu, x_uv, x_vv | second derivatives of the position | 1/m |
//! | A_i | area of the ring of vertex i | m² |
//! | w | curvature at which friction is near its limit, [`WIDTH_PER_M`] | 1/m |
//!
//! Limits: every drape begins from flat cloth; a crease that unbends on the way to rest gets its friction back. Hinges of triangles without
//! an inner vertex have no friction, nor do the previews by PARTs.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::bending_matrix::ROWS_PER_TASK;
use super::membrane::outer;
use crate::garment::fabric::Fabric;

/// w, 1/m. Smaller is closer to Coulomb's law and stiffens flat cloth by H/w more; larger lets flat cloth sag. A cantilever that bends by 20/m
/// at its clamp ends 1.1 % from its closed form at 0.3, 5 % at 1 and 17 % at 3 (`tests/closed_forms/cantilever.rs`); one of twice the length 2.2 %
/// at 0.3. Drape tests take as many steps at 0.1 as at 0.3.
const WIDTH_PER_M: f64 = 0.1;

/// Friction of the rings of a cloth; empty where no fabric has any.
#[derive(Debug, Clone, Default)]
pub(crate) struct BendingFriction {
    rings: Vec<Ring>,
}

/// Friction of one bending element.
#[derive(Debug, Clone)]
struct Ring {
    vertices: Vec<u32>,
    /// Weights of x_uu, x_uv, x_vv at each vertex, 1/m².
    weights: Vec<DVec3>,
    /// A²·(H_u², 2 H_u H_v, H_v²), N²·m⁴.
    squares: DVec3,
    /// A m, N·m.
    width: f64,
}

/// A ring at some positions.
pub(super) struct BentRing<'a> {
    ring: &'a Ring,
    /// The second derivatives, each times its square, N²·m³.
    forces: [DVec3; 3],
    /// A √(q² + m²), N·m.
    root: f64,
    /// E, J.
    energy: f64,
}

impl BendingFriction {
    /// Adds the ring of `vertices` with these weights of the second derivatives (1/m²); `shares` are its areas of each fabric, m².
    pub(super) fn push(
        &mut self,
        vertices: &[u32],
        weights: &[DVec3],
        fabrics: &[Fabric],
        shares: impl Iterator<Item = f64>,
    ) {
        let (mut weft, mut warp) = (0.0, 0.0);
        for (Fabric { bending_friction_n: [u, v], .. }, share) in fabrics.iter().zip(shares) {
            weft += share * u;
            warp += share * v;
        }
        if weft > 0.0 || warp > 0.0 {
            self.rings.push(Ring {
                vertices: vertices.to_vec(),
                weights: weights.to_vec(),
                squares: DVec3::new(weft * weft, 2.0 * weft * warp, warp * warp),
                width: 0.5 * (weft + warp) * WIDTH_PER_M,
            });
        }
    }

    /// Every ring at the positions `x`, m.
    pub(super) fn bent(&self, x: &[DVec3]) -> Vec<BentRing<'_>> {
        self.rings.par_iter().with_min_len(ROWS_PER_TASK).map(|ring| ring.at(x)).collect()
    }

    /// Adds the gradient (N) at the vertices that are not `held`; returns E, J.
    pub(super) fn add_gradient(&self, x: &[DVec3], held: &[bool], gradient: &mut [DVec3]) -> f64 {
        let mut energy = 0.0;
        for bent in self.bent(x) {
            energy += bent.energy;
            for (i, &v) in bent.vertices().iter().enumerate().filter(|(_, v)| !held[**v as usize]) {
                gradient[v as usize] += bent.pull(i) / bent.root;
            }
        }
        energy
    }
}

impl Ring {
    fn at(&self, x: &[DVec3]) -> BentRing<'_> {
        let mut second = [DVec3::ZERO; 3];
        for (&v, w) in self.vertices.iter().zip(&self.weights) {
            for (d, w) in second.iter_mut().zip(w.to_array()) {
                *d += x[v as usize] * w;
            }
        }
        let square = self.squares.dot(DVec3::from(second.map(DVec3::length_squared)));
        let root = (square + self.width * self.width).sqrt();
        let squares = self.squares.to_array();
        // The difference of root and width would lose digits.
        let energy = square / (root + self.width);
        BentRing { ring: self, forces: std::array::from_fn(|k| squares[k] * second[k]), root, energy }
    }
}

impl BentRing<'_> {
    pub(super) fn vertices(&self) -> &[u32] {
        &self.ring.vertices
    }

    /// The Hessian between members i and j, N/m.
    pub(super) fn block(&self, i: usize, j: usize) -> DMat3 {
        let Ring { weights, squares, .. } = self.ring;
        let scalar = (*squares * weights[i]).dot(weights[j]) / self.root;
        let other = self.pull(j) / self.root.powi(3);
        DMat3::from_diagonal(DVec3::splat(scalar)) - outer(self.pull(i), other)
    }

    /// Root times the gradient at member i, N²·m.
    fn pull(&self, i: usize) -> DVec3 {
        let ([u, m, v], w) = (self.forces, self.ring.weights[i]);
        u * w.x + m * w.y + v * w.z
    }
}
