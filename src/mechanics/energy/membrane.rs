//! Membrane: the energy of stretching and shearing each triangle.
//!
//! With F = [F_u F_v] the deformation gradient of a triangle (columns: the images of the weft and warp unit vectors),
//!
//! ψ = ½ C_uu s_u² + C_uv s_u s_v + ½ C_vv s_v² + ½ μ γ²,  s_u = |F_u| − 1, s_v = |F_v| − 1, γ = F_u·F_v,
//!
//! and the energy is Σ A ψ. The stiffness of a uniaxial pull along the warp is C_vv − C_uv²/C_uu, the measured k_v:
//! C_uu = k_u/(1−ν²), C_vv = k_v/(1−ν²), C_uv = ν √(k_u k_v)/(1−ν²). The material is orthotropic with an independent shear
//! stiffness, as cloth is (Wang, O'Brien, Ramamoorthi: "Data-driven elastic models for cloth", SIGGRAPH 2011). The strain is that of
//! length, after Baraff, Witkin ("Large steps in cloth simulation", SIGGRAPH 1998), not Green's: it does not soften under
//! compression, so a triangle does not invert.
//!
//! Where a stress σ_u = C_uu s_u + C_uv s_v or σ_v would be compressive, the cloth forms wrinkles finer than the mesh. The energy is
//! r ψ + (1 − r) ψ_t with the compression ratio r and ψ_t the relaxed energy of tension field theory (Pipkin: "The relaxed energy
//! density for isotropic elastic membranes", IMA J. Appl. Math. 36, 1986): ψ in tension, ½ k_v s_v² or ½ k_u s_u² where one direction
//! is compressed, zero where both are. It is convex in the strains with continuous stress, and the stiffness of a uniaxial pull remains k_u
//! or k_v.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | r | compression ratio: share of the stiffness left under compression, 0.1 | – |
//! | A | rest area | m² |
//! | k_u, k_v | uniaxial stiffness along weft and warp | N/m |
//! | μ | shear stiffness | N/m |
//! | B | smallest bending stiffness | N·m |
//! | ν | Poisson's ratio, the geometric mean of both directions | – |
//! | b_i | gradient of the shape function of corner i | 1/m |
//!
//! There are two Hessians (`HessianKind`). The projected one drops the negative stiffness that compression and shear have out of the plane
//! (Teran and others: "Robust quasistatic finite elements and flesh simulation", SCA 2005, for the principle); in tension it is exact
//! up to terms of strain times stiffness within the plane. The true one is exact up to buckling: it cuts the compressive stress
//! out of the plane at the buckling stress of a triangle. Folds as narrow as a triangle, of half wave √(2A), buckle at B π²/2A. As
//! long as the stress stays well below that, the bending makes the whole matrix positive definite. The true Hessian contains the soft
//! directions in which cloth folds, where the projected one is too stiff and Newton's method takes short steps.
//!
//! A sliver, of height h under ℓ/50 over its longest side ℓ, would be stiffer across than its neighbours by ℓ/h, and would invert when a
//! corner moves by h, which stops a solver. It is given the height ℓ/50, with its longest side along the weft and r = 0, so that it
//! resists stretch along that side, and across it only beyond that height. A counts as a fiftieth of the area at that height: beyond it the
//! sliver is then as stiff across as a triangle as high as ℓ, and not fifty times as stiff.
//!
//! Limits: constants are those at zero strain; the stiffening of a measured curve is not modelled. Slivers have no grain, no shear
//! stiffness where they are closed, and may open by ℓ/50.

use glam::{DMat3, DVec2, DVec3};

use crate::base::math;
use crate::garment::fabric::Fabric;
pub(crate) use crate::mesh::outer;
use crate::mesh::rest::{SLIVER, raised};

/// One triangle's rest data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Rest area A, m²; of a sliver a fiftieth of the area at its raised height, which does not count as mass.
    pub area: f64,
    /// Gradients b_i of the shape functions, 1/m.
    pub gradients: [DVec2; 3],
    /// Whether it is a sliver, whose height is raised.
    pub sliver: bool,
    /// Whether its rest shape is a guess.
    pub guessed: bool,
    /// Number of its fabric.
    pub fabric: u16,
}

/// Membrane stiffness, N/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    pub(crate) uu: f64,
    pub(crate) uv: f64,
    pub(crate) vv: f64,
    pub(crate) shear: f64,
    /// Uniaxial k_u and k_v.
    pub(super) weft: f64,
    pub(super) warp: f64,
    poisson: f64,
    /// Compressive stress that the true Hessian keeps, times the area of the triangle, N·m.
    buckling: f64,
}

impl Stiffness {
    /// The stiffness of a fabric with these uniaxial constants.
    #[must_use]
    pub fn new(fabric: &Fabric) -> Self {
        let least_bending = fabric.bending_nm.into_iter().fold(f64::INFINITY, f64::min);
        let buckling = BUCKLING_SHARE * std::f64::consts::PI.powi(2) * least_bending / 2.0;
        Self::of(
            fabric.stretch_weft_n_per_m,
            fabric.stretch_warp_n_per_m,
            fabric.shear_n_per_m,
            fabric.poisson,
            buckling,
        )
    }

    fn of(k_u: f64, k_v: f64, shear: f64, nu: f64, buckling: f64) -> Self {
        let d = 1.0 - nu * nu;
        let (uu, uv, vv) = (k_u / d, nu * (k_u * k_v).sqrt() / d, k_v / d);
        Self { uu, uv, vv, shear, weft: k_u, warp: k_v, poisson: nu, buckling }
    }

    /// The same with no constant above `cap` (N/m); `None` where none is.
    #[must_use]
    pub(crate) fn capped(&self, cap: f64) -> Option<Self> {
        let stiffer = self.weft.max(self.warp).max(self.shear) > cap;
        let (weft, warp, shear) = (self.weft.min(cap), self.warp.min(cap), self.shear.min(cap));
        stiffer.then(|| Self::of(weft, warp, shear, self.poisson, self.buckling))
    }

    /// The tangent at strains s_u, s_v. The energy is quadratic within each of the four states, so the tangent also gives the
    /// stresses and the energy.
    fn tangent(&self, r: f64, su: f64, sv: f64) -> Tangent {
        let (tu, tv) = (self.uu * su + self.uv * sv, self.uv * su + self.vv * sv);
        let q = 1.0 - r;
        let (uu, uv, vv) = (r * self.uu, r * self.uv, r * self.vv);
        if tu >= 0.0 && tv >= 0.0 {
            Tangent { uu: self.uu, uv: self.uv, vv: self.vv }
        } else if tu < 0.0 && sv > 0.0 {
            Tangent { uu, uv, vv: vv + q * self.warp }
        } else if tv < 0.0 && su > 0.0 {
            Tangent { uu: uu + q * self.weft, uv, vv }
        } else {
            Tangent { uu, uv, vv }
        }
    }
}

/// Compression ratio of the mesh: share of the stiffness left under compression. Real cloth buckles: a strip of B = 10 µN·m supported at
/// every centimetre buckles between its supports under B π²/ℓ² = 1 N/m, a hundredth of the stress of a woven fabric at 2 %
/// compression, into wrinkles finer than the mesh. A tenth removes most of that stress and keeps the triangles in shape; with the
/// full stiffness a stiff woven fabric locks into facets.
pub(crate) const COMPRESSION_RATIO: f64 = 0.1;

/// Share of the buckling stress that the true Hessian keeps. With 0.3 the whole matrix is sometimes indefinite, with 0.1 hardly ever.
const BUCKLING_SHARE: f64 = 0.1;

/// The second derivatives that a Hessian contains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HessianKind {
    /// Without negative curvature: positive semi-definite.
    Projected,
    /// Exact up to the buckling stress of a triangle; possibly indefinite.
    UpToBuckling,
    /// Exact.
    True,
}

/// Stiffness of a strained state.
#[derive(Debug, Clone, Copy)]
struct Tangent {
    uu: f64,
    uv: f64,
    vv: f64,
}

/// Stretch below which |F_u| has no direction; the strain is then constant to first order.
pub(super) const MIN_STRETCH: f64 = 1e-12;

impl Triangle {
    /// Rest data of a triangle with flat corners `rest`; `None` where it has no area.
    #[must_use]
    pub fn new(vertices: [u32; 3], rest: [DVec2; 3]) -> Option<Self> {
        let [a, b, c] = rest;
        let double = (b - a).perp_dot(c - a);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        if !double.is_finite() || double.abs() <= 1e-12 * longest {
            return None;
        }
        let (sliver, [a, b, c]) = raised(rest);
        let double = (b - a).perp_dot(c - a);
        let share = if sliver { SLIVER } else { 1.0 };
        // ∇N_i is the opposite side rotated by 90 degrees, over twice the signed area.
        let gradient = |p: DVec2, q: DVec2| (q - p).perp() / double;
        Some(Self {
            vertices,
            area: 0.5 * double.abs() * share,
            gradients: [gradient(b, c), gradient(c, a), gradient(a, b)],
            sliver,
            guessed: false,
            fabric: 0,
        })
    }

    /// Compression ratio r: [`COMPRESSION_RATIO`], zero for a sliver.
    #[must_use]
    pub(crate) fn compression_ratio(&self) -> f64 {
        if self.sliver { 0.0 } else { COMPRESSION_RATIO }
    }

    /// Whether its rest shape is that of the cloth, so that its strain can be reported.
    #[must_use]
    pub(crate) fn has_strain(&self) -> bool {
        !self.sliver && !self.guessed
    }

    /// Length of its longest side at rest, m.
    #[must_use]
    pub(crate) fn longest_side_m(&self) -> f64 {
        let [_, p, q] = self.gradients;
        self.gradients.iter().map(|b| b.length()).fold(0.0, f64::max) / p.perp_dot(q).abs()
    }

    /// F_u and F_v.
    #[must_use]
    pub fn deformation(&self, x: &[DVec3]) -> [DVec3; 2] {
        let [a, b, c] = self.vertices.map(|v| x[v as usize]);
        let [_, p, q] = self.gradients;
        // The gradients sum to zero, so two edges suffice.
        [(b - a) * p.x + (c - a) * q.x, (b - a) * p.y + (c - a) * q.y]
    }

    /// Energy A ψ, J: with [`add_gradient`](Self::add_gradient) the reference for four triangles at a time.
    #[cfg(test)]
    pub(crate) fn energy(&self, c: &Stiffness, r: f64, x: &[DVec3]) -> f64 {
        let [fu, fv] = self.deformation(x);
        let (su, sv, gamma) = (fu.length() - 1.0, fv.length() - 1.0, fu.dot(fv));
        let k = c.tangent(r, su, sv);
        self.area * (0.5 * k.uu * su * su + k.uv * su * sv + 0.5 * k.vv * sv * sv + 0.5 * c.shear * gamma * gamma)
    }

    /// Adds the gradient of the energy to `gradient`, N; returns the energy.
    #[cfg(test)]
    pub(crate) fn add_gradient(&self, c: &Stiffness, r: f64, x: &[DVec3], gradient: &mut [DVec3]) -> f64 {
        let [fu, fv] = self.deformation(x);
        let (lu, lv) = (fu.length(), fv.length());
        let (su, sv, gamma) = (lu - 1.0, lv - 1.0, fu.dot(fv));
        let k = c.tangent(r, su, sv);
        let (tu, tv, tau) = (k.uu * su + k.uv * sv, k.uv * su + k.vv * sv, c.shear * gamma);
        let pu = self.area * (fu * (tu / lu.max(MIN_STRETCH)) + fv * tau);
        let pv = self.area * (fv * (tv / lv.max(MIN_STRETCH)) + fu * tau);
        for (&v, b) in self.vertices.iter().zip(&self.gradients) {
            gradient[v as usize] += pu * b.x + pv * b.y;
        }
        self.area * 0.5 * (tu * su + tv * sv + tau * gamma)
    }

    /// The Hessian as the blocks (0,0), (1,1), (2,2), (1,0), (2,0), (2,1), N/m.
    #[must_use]
    pub(crate) fn hessian(&self, c: &Stiffness, r: f64, x: &[DVec3], kind: HessianKind) -> [DMat3; 6] {
        let [huu, huv, hvv] = self.by_gradient(c, r, x, kind);
        let block = |i: usize, j: usize| {
            let (p, q) = (self.gradients[i] * self.area, self.gradients[j]);
            huu * (p.x * q.x) + hvv * (p.y * q.y) + huv * (p.x * q.y) + huv.transpose() * (p.y * q.x)
        };
        [block(0, 0), block(1, 1), block(2, 2), block(1, 0), block(2, 0), block(2, 1)]
    }

    /// Second derivatives of ψ by F_u and F_v: uu, uv, vv, N/m.
    pub(crate) fn by_gradient(&self, c: &Stiffness, r: f64, x: &[DVec3], kind: HessianKind) -> [DMat3; 3] {
        let [fu, fv] = self.deformation(x);
        let (lu, lv) = (fu.length().max(MIN_STRETCH), fv.length().max(MIN_STRETCH));
        let (u, v) = (fu / lu, fv / lv);
        let k = c.tangent(r, lu - 1.0, lv - 1.0);
        let (su, sv) = (lu - 1.0, lv - 1.0);
        let (tu, tv, tau) = (k.uu * su + k.uv * sv, k.uv * su + k.vv * sv, c.shear * fu.dot(fv));
        let n = fu.cross(fv).normalize_or_zero();
        let (wu, wv) = (n.cross(u), n.cross(v));
        let stress = [tu / lu, tv / lv, tau];
        let no_less_than = |least: f64| {
            let (a, b, t) = positive_part(stress[0] - least, stress[1] - least, tau);
            [a + least, b + least, t]
        };
        // Stresses u, v and shear that act out of the plane and within it.
        let (out_of_plane, in_plane) = match kind {
            HessianKind::True => (stress, stress),
            HessianKind::UpToBuckling => (no_less_than(-c.buckling / self.area), stress),
            HessianKind::Projected => (no_less_than(0.0), [stress[0].max(0.0), stress[1].max(0.0), 0.0]),
        };
        let nn = outer(n, n);
        let [a, b, t] = out_of_plane;
        let huu = outer(u, u) * k.uu + outer(fv, fv) * c.shear + outer(wu, wu) * in_plane[0] + nn * a;
        let hvv = outer(v, v) * k.vv + outer(fu, fu) * c.shear + outer(wv, wv) * in_plane[1] + nn * b;
        let huv = outer(u, v) * k.uv + outer(fv, fu) * c.shear + (DMat3::IDENTITY - nn) * in_plane[2] + nn * t;
        [huu, huv, hvv]
    }

    /// The diagonal blocks of the projected [`hessian`](Self::hessian), N/m.
    pub(crate) fn diagonal_blocks(&self, c: &Stiffness, r: f64, x: &[DVec3]) -> [DMat3; 3] {
        let [huu, huv, hvv] = self.by_gradient(c, r, x, HessianKind::Projected);
        let both = huv + huv.transpose();
        self.gradients.map(|g| (huu * (g.x * g.x) + hvv * (g.y * g.y) + both * (g.x * g.y)) * self.area)
    }
}

/// The nearest positive semi-definite matrix to [[a, t], [t, b]], as (a, b, t).
fn positive_part(a: f64, b: f64, t: f64) -> (f64, f64, f64) {
    let (mean, half) = (0.5 * (a + b), 0.5 * (a - b));
    let radius = math::hypot(half, t);
    if mean >= radius {
        return (a, b, t);
    }
    let top = mean + radius;
    if top <= 0.0 {
        return (0.0, 0.0, 0.0);
    }
    // Eigenvector of `top` has the squared components (1 ± half/radius)/2 and product t/(2 radius).
    (top * 0.5 * (1.0 + half / radius), top * 0.5 * (1.0 - half / radius), top * 0.5 * t / radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_sliver_is_as_stiff_across_as_a_triangle_as_high_as_its_side() {
        let fabric = Fabric::by_name("denim").unwrap();
        let stiffness = Stiffness::new(&Fabric { stretch_warp_n_per_m: fabric.stretch_weft_n_per_m, ..fabric });
        // Stiffness of the tip, N/m, 10 % above its height at rest.
        let across = |height: f64, rest_height: f64| {
            let side = 0.01;
            let rest = [DVec2::ZERO, DVec2::new(side, 0.0), DVec2::new(0.5 * side, height * side)];
            let triangle = Triangle::new([0, 1, 2], rest).unwrap();
            let x = [DVec3::ZERO, DVec3::X * side, DVec3::new(0.5, 1.1 * rest_height, 0.0) * side];
            let r = triangle.compression_ratio();
            (triangle.hessian(&stiffness, r, &x, HessianKind::True)[2].y_axis.y, triangle.longest_side_m())
        };
        let (regular, _) = across(1.0, 1.0);
        for height in [1e-2, 1e-4, 1e-5] {
            let (sliver, longest) = across(height, SLIVER);
            assert!((sliver / regular - 1.0).abs() < 0.01, "{height}: {sliver} N/m, not {regular}");
            assert!((longest - 0.01).abs() < 1e-12, "{longest}");
        }
    }
}
