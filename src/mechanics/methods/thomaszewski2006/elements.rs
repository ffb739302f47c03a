//! Corotational subdivision elements: strains, forces and stiffness at the centre of each triangle.
//!
//! x = Σ N_I X_I over the control vertices of a triangle. In the cloth's coordinates (u along the weft, v along the
//! warp), with constant weights per vertex,
//!
//! F = [Σ b_u X, Σ b_v X],  x_uu = Σ w_uu X, ...,
//!
//! where b and w are the box spline's derivatives by the parameters, transformed to the cloth's coordinates by the rest shape: J = [P_s
//! P_t] of the flattened patch, and second derivatives without the curvature of the parameters themselves (Christoffel's
//! symbols of the flat patch).
//!
//! The polar decomposition F = R S gives the frame r_u, r_v, n = r_u × r_v; strains S − 1; and bending strains κ = n·x_uu
//! and so on, which are linear in X once R is fixed: one linear system a step. The force is the full gradient, including the
//! derivative of R, which is of second order in the strains. Without it coarse cloth, whose patches bend on the scale of their
//! length, rotated by itself and diverged (observed at 600 vertices). This is ours; a corotational force usually omits it.
//!
//! E = Σ A [½ C_uu ε_u² + C_uv ε_u ε_v + ½ C_vv ε_v² + ½ μ γ² + ½ B_u κ_uu² + ½ H κ_uv² + ½ B_v κ_vv²], H = 4 B_45 −
//! B_u − B_v.
//!
//! The stiffness is that with R fixed plus, ours, the stiffness of tension out of the plane, A σ⁺ n nᵀ, without which taut
//! cloth cannot take a step of tens of milliseconds.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | X | control vertices: the garment's own | m |
//! | A | rest area of the element, one quadrature point | m² |
//! | C, μ | membrane and shear stiffness | N/m |
//! | B, H | bending stiffness | N·m |

use glam::{DVec3, Mat3A, Vec3A};
use rayon::prelude::*;

use crate::garment::fabric::Fabric;
use crate::mechanics::energy::bending::bending_stiffness;
use crate::mechanics::energy::membrane::Stiffness;
use crate::mechanics::methods::implicit_euler::Elastic;
use crate::mechanics::methods::linear::Operator;
use crate::mesh::Csr;

/// Elements or vertices of one parallel task. A heuristic.
const CHUNK: usize = 256;

/// Weights of a control vertex: b_u, b_v, w_uu, w_uv, w_vv.
pub(super) type Weights = [f32; 5];

/// Constants of the fabric, in single precision.
#[derive(Debug, Clone, Copy)]
struct Constants {
    uu: f32,
    uv: f32,
    vv: f32,
    shear: f32,
    bending: [f32; 3],
}

/// The forces of an element: stresses along u and v, and bending moments along n; times its area.
#[derive(Debug, Clone, Copy, Default)]
struct ElementForce {
    along_u: Vec3A,
    along_v: Vec3A,
    n: Vec3A,
    moments: [f32; 3],
}

/// The elements of a garment.
#[derive(Debug, Clone)]
pub struct Elements {
    constants: Constants,
    areas: Vec<f32>,
    /// The control vertices of each element.
    vertices: Csr<(u32, Weights)>,
    frames: Vec<Frame>,
    /// The elements of each vertex.
    elements: Csr<(u32, Weights)>,
    strains: Vec<[f32; 3]>,
    forces: Vec<ElementForce>,
}

/// One element: its rest area, m², and its control vertices.
#[derive(Debug, Clone)]
pub(super) struct Element {
    pub(super) area: f64,
    pub(super) vertices: Vec<(u32, Weights)>,
}

impl Elements {
    pub(super) fn new(list: &[Element], vertex_count: usize, fabric: &Fabric) -> Self {
        let membrane = Stiffness::new(fabric);
        let constants = Constants {
            uu: membrane.uu as f32,
            uv: membrane.uv as f32,
            vv: membrane.vv as f32,
            shear: membrane.shear as f32,
            bending: bending_stiffness(fabric).to_array().map(|b| b as f32),
        };
        let mut vertices = Csr::default();
        list.iter().for_each(|m| vertices.push(m.vertices.iter().copied()));
        let elements = Csr::gathered(vertex_count, || {
            let numbered = (0u32..).zip(list);
            numbered.flat_map(|(e, m)| m.vertices.iter().map(move |&(v, weights)| (v, (e, weights))))
        });
        Self {
            constants,
            areas: list.iter().map(|m| m.area as f32).collect(),
            vertices,
            frames: vec![Frame::default(); list.len()],
            elements,
            strains: vec![[0.0; 3]; list.len()],
            forces: Vec::new(),
        }
    }

    /// Strains ε_u, ε_v, γ of each element at the last linearisation.
    #[must_use]
    pub fn strains(&self) -> &[[f32; 3]] {
        &self.strains
    }

    /// Number of elements.
    pub(crate) fn count(&self) -> usize {
        self.areas.len()
    }

    /// The five weighted sums of vectors of an element's vertices.
    #[inline]
    fn sums(&self, e: usize, of: impl Fn(u32) -> Vec3A) -> [Vec3A; 5] {
        let mut sums = [Vec3A::ZERO; 5];
        for (v, w) in self.vertices.of(e) {
            let x = of(*v);
            for k in 0..5 {
                sums[k] += w[k] * x;
            }
        }
        sums
    }

    /// Sums the forces of the elements on a vertex.
    #[inline]
    fn gathered(&self, v: usize, forces: &[ElementForce]) -> Vec3A {
        let mut sum = Vec3A::ZERO;
        for (e, w) in self.elements.of(v) {
            let p = &forces[*e as usize];
            let across = w[2] * p.moments[0] + w[3] * p.moments[1] + w[4] * p.moments[2];
            sum += w[0] * p.along_u + w[1] * p.along_v + across * p.n;
        }
        sum
    }
}

impl Constants {
    /// σ_u, σ_v, τ.
    #[inline]
    fn stress(&self, [e_u, e_v, g]: [f32; 3]) -> [f32; 3] {
        [self.uu * e_u + self.uv * e_v, self.uv * e_u + self.vv * e_v, self.shear * g]
    }
}

impl Elastic for Elements {
    fn linearise(&mut self, x: &[DVec3], force: &mut [DVec3]) {
        let this = &*self;
        let element_force = |e: usize, frame: &mut Frame, kept: &mut [f32; 3]| {
            // Weights of derivatives sum to zero, so differences avoid cancellation.
            let base = x[this.vertices.of(e)[0].0 as usize];
            let [f_u, f_v, x_uu, x_uv, x_vv] = this.sums(e, |v| (x[v as usize] - base).as_vec3a());
            let second = [x_uu, x_uv, x_vv];
            let (mut found, strain, stretch) = polar(f_u, f_v, second);
            let [s_u, s_v, tau] = this.constants.stress(strain);
            let [[p_uu, p_vu], [p_uv, p_vv]] = frame_stresses(stretch, [s_u, tau, s_v]);
            found.tension = positive_part([s_u, tau, s_v]);
            (*frame, *kept) = (found, strain);
            let (a, n) = (this.areas[e], found.n);
            let moments: [f32; 3] = std::array::from_fn(|k| a * this.constants.bending[k] * n.dot(second[k]));
            let [m_u, m_v] = found.in_plane(moments);
            ElementForce {
                along_u: (found.r_u * p_uu + found.r_v * p_vu) * a - n * m_u,
                along_v: (found.r_u * p_uv + found.r_v * p_vv) * a - n * m_v,
                n,
                moments,
            }
        };
        let mut frames = this.frames.clone();
        let mut strains = this.strains.clone();
        let all = frames.par_iter_mut().zip(&mut strains).enumerate().with_min_len(CHUNK);
        let forces: Vec<ElementForce> = all.map(|(e, (frame, strain))| element_force(e, frame, strain)).collect();
        force
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .for_each(|(v, f)| *f -= this.gathered(v, &forces).as_dvec3());
        (self.frames, self.strains) = (frames, strains);
    }

    fn add_diagonal(&self, diagonal: &mut [Mat3A]) {
        let c = &self.constants;
        diagonal.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(v, block)| {
            for (e, [b_u, b_v, w_uu, w_uv, w_vv]) in self.elements.of(v) {
                let (f, a) = (&self.frames[*e as usize], self.areas[*e as usize]);
                let (p, q) = (f.r_u * *b_u, f.r_v * *b_v);
                let g = f.r_v * *b_u + f.r_u * *b_v;
                let second = [w_uu, w_uv, w_vv];
                let across = (0..3).map(|k| {
                    let w = second[k] - f.gamma[k][0] * b_u - f.gamma[k][1] * b_v;
                    c.bending[k] * w * w
                });
                let across: f32 = across.sum();
                let [t_u, t, t_v] = f.tension;
                let across = across + t_u * b_u * b_u + 2.0 * t * b_u * b_v + t_v * b_v * b_v;
                let rows = [p * c.uu + q * c.uv, q * c.vv + p * c.uv, g * c.shear, f.n * across];
                let (x, y, z) = ([p.x, q.x, g.x, f.n.x], [p.y, q.y, g.y, f.n.y], [p.z, q.z, g.z, f.n.z]);
                let column = |by: [f32; 4]| (rows[0] * by[0] + rows[1] * by[1] + rows[2] * by[2] + rows[3] * by[3]) * a;
                *block += Mat3A::from_cols(column(x), column(y), column(z));
            }
        });
    }
}

impl Operator for Elements {
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]) {
        let mut forces = std::mem::take(&mut self.forces);
        let (this, c) = (&*self, &self.constants);
        let element_force = |e: usize| {
            let [d_u, d_v, d_uu, d_uv, d_vv] = this.sums(e, |v| d[v as usize]);
            let (f, a) = (&this.frames[e], this.areas[e]);
            let strain = [f.r_u.dot(d_u), f.r_v.dot(d_v), f.r_v.dot(d_u) + f.r_u.dot(d_v)];
            let [s_u, s_v, tau] = c.stress(strain);
            let (g_u, g_v) = (f.n.dot(d_u), f.n.dot(d_v));
            let [t_u, t, t_v] = f.tension;
            let second = [d_uu, d_uv, d_vv];
            let curving = |k: usize| f.n.dot(second[k]) - f.gamma[k][0] * g_u - f.gamma[k][1] * g_v;
            let moments: [f32; 3] = std::array::from_fn(|k| a * c.bending[k] * curving(k));
            let [m_u, m_v] = f.in_plane(moments);
            ElementForce {
                along_u: (f.r_u * s_u + f.r_v * tau + f.n * (t_u * g_u + t * g_v)) * a - f.n * m_u,
                along_v: (f.r_v * s_v + f.r_u * tau + f.n * (t * g_u + t_v * g_v)) * a - f.n * m_v,
                n: f.n,
                moments,
            }
        };
        (0..this.count()).into_par_iter().with_min_len(CHUNK).map(element_force).collect_into_vec(&mut forces);
        out.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(v, out)| *out = this.gathered(v, &forces));
        self.forces = forces;
    }
}

/// Smallest ratio of an element's area to its rest area in the dual basis; below it the basis is not exact but stays bounded. A
/// heuristic.
const MIN_AREA_RATIO: f32 = 0.5;

/// The corotational frame of an element, with its tension.
#[derive(Debug, Clone, Copy, Default)]
struct Frame {
    r_u: Vec3A,
    r_v: Vec3A,
    n: Vec3A,
    /// σ⁺: uu, uv, vv.
    tension: [f32; 3],
    /// Γ of x_uu, x_uv, x_vv: their tangential parts in the basis of F.
    gamma: [[f32; 2]; 3],
}

impl Frame {
    /// The part of the moments in the forces along u and v, since a rotation of n bends nothing.
    #[inline]
    fn in_plane(&self, moments: [f32; 3]) -> [f32; 2] {
        let sum =
            |i: usize| moments[0] * self.gamma[0][i] + moments[1] * self.gamma[1][i] + moments[2] * self.gamma[2][i];
        [sum(0), sum(1)]
    }
}

/// Frame, strains and stretch S of F by its polar decomposition: S = (C + √det C)/√(tr C + 2 √det C), C = FᵀF.
fn polar(f_u: Vec3A, f_v: Vec3A, second: [Vec3A; 3]) -> (Frame, [f32; 3], [f32; 3]) {
    let (uu, uv, vv) = (f_u.dot(f_u), f_u.dot(f_v), f_v.dot(f_v));
    let squared = (uu * vv - uv * uv).max(f32::MIN_POSITIVE);
    let root = squared.sqrt();
    let t = (uu + vv + 2.0 * root).sqrt();
    let [s_uu, s_uv, s_vv] = [(uu + root) / t, uv / t, (vv + root) / t];
    let r_u = (f_u * s_vv - f_v * s_uv) / root;
    let r_v = (f_v * s_uu - f_u * s_uv) / root;
    // The dual basis of F, bounded for cloth crushed to less than half its area.
    let bounded = squared.max(MIN_AREA_RATIO * MIN_AREA_RATIO);
    let (a_u, a_v) = ((f_u * vv - f_v * uv) / bounded, (f_v * uu - f_u * uv) / bounded);
    let gamma = second.map(|x| [a_u.dot(x), a_v.dot(x)]);
    let frame = Frame { r_u, r_v, n: r_u.cross(r_v), tension: [0.0; 3], gamma };
    (frame, [s_uu - 1.0, s_vv - 1.0, 2.0 * s_uv], [s_uu, s_uv, s_vv])
}

/// The stresses along u and v in components of r_u and r_v: K = 2 S T with S T + T S = σ, so that the power σ : Ṡ equals P : Ḟ and
/// no element rotates by itself. For small strains K is σ.
fn frame_stresses([s_uu, s_uv, s_vv]: [f32; 3], [a, b, c]: [f32; 3]) -> [[f32; 2]; 2] {
    let det = (s_uu * s_vv - s_uv * s_uv).max(f32::MIN_POSITIVE);
    // adj S · σ · adj S.
    let (m, n) = ([s_vv * a - s_uv * b, s_vv * b - s_uv * c], [s_uu * b - s_uv * a, s_uu * c - s_uv * b]);
    let turned = [m[0] * s_vv - m[1] * s_uv, m[1] * s_uu - m[0] * s_uv, n[1] * s_uu - n[0] * s_uv];
    // Twice T.
    let over = (s_uu + s_vv) * det;
    let [t_uu, t_uv, t_vv] = [(det * a + turned[0]) / over, (det * b + turned[1]) / over, (det * c + turned[2]) / over];
    [[s_uu * t_uu + s_uv * t_uv, s_uv * t_uu + s_vv * t_uv], [s_uu * t_uv + s_uv * t_vv, s_uv * t_uv + s_vv * t_vv]]
}

/// The tensile part of a symmetric 2×2 stress.
fn positive_part([a, b, c]: [f32; 3]) -> [f32; 3] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = (half * half + b * b).sqrt();
    let (high, low) = (mean + radius, mean - radius);
    if low >= 0.0 {
        [a, b, c]
    } else if high <= 0.0 || radius == 0.0 {
        [0.0; 3]
    } else {
        // The projector on the tensile direction is ½ (1 + (M − mean)/radius).
        let share = 0.5 * high / radius;
        [share * (radius + half), share * b, share * (radius - half)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_and_stretch_multiply_to_the_deformation_gradient() {
        let (f_u, f_v) = (Vec3A::new(1.1, 0.2, 0.3), Vec3A::new(-0.1, 0.8, 0.4));
        let second = [Vec3A::new(3.0, 1.0, -2.0); 3];
        let (frame, strain, [uu, uv, vv]) = polar(f_u, f_v, second);
        assert!((frame.r_u * uu + frame.r_v * uv - f_u).length() < 1e-6);
        assert!((frame.r_u * uv + frame.r_v * vv - f_v).length() < 1e-6);
        assert!((frame.r_u.length() - 1.0).abs() < 1e-6 && frame.r_u.dot(frame.r_v).abs() < 1e-6);
        assert_eq!(strain, [uu - 1.0, vv - 1.0, 2.0 * uv]);
        // Tangential part in the basis of F, and normal part.
        let [g_u, g_v] = frame.gamma[0];
        assert!((f_u * g_u + f_v * g_v + frame.n * frame.n.dot(second[0]) - second[0]).length() < 1e-5);
    }

    #[test]
    fn frame_stresses_have_the_power_of_the_stresses() {
        let sigma = [3.0_f32, 0.7, -1.0];
        let (f_u, f_v) = (Vec3A::new(1.1, 0.2, 0.3), Vec3A::new(-0.1, 0.8, 0.4));
        let (d_u, d_v) = (Vec3A::new(0.3, -0.2, 0.9), Vec3A::new(0.5, 0.4, -0.1));
        let h = 1e-2;
        let stretch = |t: f32| polar(f_u + d_u * t, f_v + d_v * t, [Vec3A::ZERO; 3]).2;
        let (plus, minus, (frame, _, at)) = (stretch(h), stretch(-h), polar(f_u, f_v, [Vec3A::ZERO; 3]));
        let rate: Vec<f32> = (0..3).map(|k| (plus[k] - minus[k]) / (2.0 * h)).collect();
        let power = sigma[0] * rate[0] + 2.0 * sigma[1] * rate[1] + sigma[2] * rate[2];
        let [[p_uu, p_vu], [p_uv, p_vv]] = frame_stresses(at, sigma);
        let found = (frame.r_u * p_uu + frame.r_v * p_vu).dot(d_u) + (frame.r_u * p_uv + frame.r_v * p_vv).dot(d_v);
        assert!((found - power).abs() < 2e-3 * power.abs(), "{found} expected {power}");
    }

    #[test]
    fn the_positive_part_is_the_tensile_stress() {
        assert_eq!(positive_part([2.0, 0.5, 1.0]), [2.0, 0.5, 1.0]);
        assert_eq!(positive_part([-2.0, 0.5, -1.0]), [0.0; 3]);
        // Eigenvalues 3 along (1, 1) and −1 along (1, −1).
        let part = positive_part([1.0, 2.0, 1.0]);
        assert!(part.iter().all(|p| (p - 1.5).abs() < 1e-6), "{part:?}");
    }
}
