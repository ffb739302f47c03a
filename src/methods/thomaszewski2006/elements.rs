//! Corotational subdivision elements: strains, forces and stiffness at the middle of each triangle.
//!
//! x = Σ N_I X_I over the control vertices of a triangle. In the cloth's coordinates (u along the weft, v along the
//! warp), with constant weights per vertex,
//!
//! F = [Σ b_u X, Σ b_v X],  x_uu = Σ w_uu X, ...,
//!
//! where b and w are the box spline's derivatives by the parameters, taken to the cloth's by the rest shape: J = [P_s
//! P_t] of the patch laid flat, and second derivatives without what the parameters' own curving puts in (Christoffel's
//! symbols of the flat patch).
//!
//! Polar decomposition F = R S gives the frame r_u, r_v, n = r_u × r_v; strains S − 1; and bending strains κ = n·x_uu
//! and so on, which are linear in X once R is fixed: one linear system a step. The force is the whole gradient, with
//! what R's turning adds, which is of second order in the strains: without it coarse cloth, whose patches bend by their
//! own length, turned by itself and flew off (seen at 600 vertices). Ours; a corotational force as usual leaves it out.
//!
//! E = Σ A [½ C_uu ε_u² + C_uv ε_u ε_v + ½ C_vv ε_v² + ½ μ γ² + ½ B_u κ_uu² + ½ H κ_uv² + ½ B_v κ_vv²], H = 4 B_45 −
//! B_u − B_v.
//!
//! The stiffness is that with R fixed, and, ours, what tension adds across the plane, A σ⁺ n nᵀ, without which a taut
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

use super::strain::{Frame, polar, positive_part, pulls};
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::bending::bending_stiffness;
use crate::mechanics::energy::membrane::Stiffness;
use crate::mesh::Lists;
use crate::methods::implicit_euler::Elastic;
use crate::methods::linear::Operator;

/// Elements, or vertices, of one task.
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

/// What an element pulls with: stresses along u and v, and bending moments along n; times its area.
#[derive(Debug, Clone, Copy, Default)]
struct Pull {
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
    vertices: Lists<(u32, Weights)>,
    frames: Vec<Frame>,
    /// The elements of each vertex.
    elements: Lists<(u32, Weights)>,
    strains: Vec<[f32; 3]>,
    pulls: Vec<Pull>,
}

/// One element on its way in: its area, and its control vertices.
#[derive(Debug, Clone)]
pub(super) struct Made {
    pub(super) area: f64,
    pub(super) vertices: Vec<(u32, Weights)>,
}

impl Elements {
    pub(super) fn new(made: &[Made], vertex_count: usize, fabric: &Fabric) -> Self {
        let membrane = Stiffness::new(fabric);
        let constants = Constants {
            uu: membrane.uu as f32,
            uv: membrane.uv as f32,
            vv: membrane.vv as f32,
            shear: membrane.shear as f32,
            bending: bending_stiffness(fabric).to_array().map(|b| b as f32),
        };
        let mut vertices = Lists::default();
        made.iter().for_each(|m| vertices.push(m.vertices.iter().copied()));
        let elements = Lists::gathered(vertex_count, || {
            let numbered = (0u32..).zip(made);
            numbered.flat_map(|(e, m)| m.vertices.iter().map(move |&(v, weights)| (v, (e, weights))))
        });
        Self {
            constants,
            areas: made.iter().map(|m| m.area as f32).collect(),
            vertices,
            frames: vec![Frame::default(); made.len()],
            elements,
            strains: vec![[0.0; 3]; made.len()],
            pulls: Vec::new(),
        }
    }

    /// Strains ε_u, ε_v, γ of each element where it was last looked at.
    #[must_use]
    pub fn strains(&self) -> &[[f32; 3]] {
        &self.strains
    }

    /// Number of elements.
    #[must_use]
    pub(crate) fn count(&self) -> usize {
        self.areas.len()
    }

    /// The five sums of an element's weights with vectors of its vertices.
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

    /// Sums up what the elements pull a vertex with.
    #[inline]
    fn gathered(&self, v: usize, pulls: &[Pull]) -> Vec3A {
        let mut sum = Vec3A::ZERO;
        for (e, w) in self.elements.of(v) {
            let p = &pulls[*e as usize];
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
        let pull = |e: usize, frame: &mut Frame, kept: &mut [f32; 3]| {
            // All weights sum to nothing: differences keep the digits.
            let base = x[this.vertices.of(e)[0].0 as usize];
            let [f_u, f_v, x_uu, x_uv, x_vv] = this.sums(e, |v| (x[v as usize] - base).as_vec3a());
            let second = [x_uu, x_uv, x_vv];
            let (mut found, strain, stretch) = polar(f_u, f_v, second);
            let [s_u, s_v, tau] = this.constants.stress(strain);
            let [[p_uu, p_vu], [p_uv, p_vv]] = pulls(stretch, [s_u, tau, s_v]);
            found.tension = positive_part([s_u, tau, s_v]);
            (*frame, *kept) = (found, strain);
            let (a, n) = (this.areas[e], found.n);
            let moments: [f32; 3] = std::array::from_fn(|k| a * this.constants.bending[k] * n.dot(second[k]));
            let [m_u, m_v] = found.in_plane(moments);
            Pull {
                along_u: (found.r_u * p_uu + found.r_v * p_vu) * a - n * m_u,
                along_v: (found.r_u * p_uv + found.r_v * p_vv) * a - n * m_v,
                n,
                moments,
            }
        };
        let mut frames = this.frames.clone();
        let mut strains = this.strains.clone();
        let all = frames.par_iter_mut().zip(&mut strains).enumerate().with_min_len(CHUNK);
        let pulls: Vec<Pull> = all.map(|(e, (frame, strain))| pull(e, frame, strain)).collect();
        force
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .for_each(|(v, f)| *f -= this.gathered(v, &pulls).as_dvec3());
        (self.frames, self.strains) = (frames, strains);
    }

    fn add_own(&self, own: &mut [Mat3A]) {
        let c = &self.constants;
        own.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(v, own)| {
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
                *own += Mat3A::from_cols(column(x), column(y), column(z));
            }
        });
    }
}

impl Operator for Elements {
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]) {
        let mut pulls = std::mem::take(&mut self.pulls);
        let (this, c) = (&*self, &self.constants);
        let pull = |e: usize| {
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
            Pull {
                along_u: (f.r_u * s_u + f.r_v * tau + f.n * (t_u * g_u + t * g_v)) * a - f.n * m_u,
                along_v: (f.r_v * s_v + f.r_u * tau + f.n * (t * g_u + t_v * g_v)) * a - f.n * m_v,
                n: f.n,
                moments,
            }
        };
        (0..this.count()).into_par_iter().with_min_len(CHUNK).map(pull).collect_into_vec(&mut pulls);
        out.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(v, out)| *out = this.gathered(v, &pulls));
        self.pulls = pulls;
    }
}
