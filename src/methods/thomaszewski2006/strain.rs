//! Where an element stands and what its stresses pull with: polar decomposition, and the force that belongs to it.

use glam::Vec3A;

/// Share of its rest area under which an element's own basis is no longer followed.
const LEAST_AREA: f32 = 0.5;

/// An element as it stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Frame {
    pub(super) r_u: Vec3A,
    pub(super) r_v: Vec3A,
    pub(super) n: Vec3A,
    /// σ⁺: uu, uv, vv.
    pub(super) tension: [f32; 3],
    /// Γ of x_uu, x_uv, x_vv: their parts in the surface, by F's own basis.
    pub(super) gamma: [[f32; 2]; 3],
}

impl Frame {
    /// What moments take from the pulls along u and v: turning n costs no bending.
    #[inline]
    pub(super) fn in_plane(&self, moments: [f32; 3]) -> [f32; 2] {
        let sum =
            |i: usize| moments[0] * self.gamma[0][i] + moments[1] * self.gamma[1][i] + moments[2] * self.gamma[2][i];
        [sum(0), sum(1)]
    }
}

/// Frame, strains and stretch S of F by its polar decomposition: S = (C + √det C)/√(tr C + 2 √det C), C = FᵀF.
pub(super) fn polar(f_u: Vec3A, f_v: Vec3A, second: [Vec3A; 3]) -> (Frame, [f32; 3], [f32; 3]) {
    let (uu, uv, vv) = (f_u.dot(f_u), f_u.dot(f_v), f_v.dot(f_v));
    let squared = (uu * vv - uv * uv).max(f32::MIN_POSITIVE);
    let root = squared.sqrt();
    let t = (uu + vv + 2.0 * root).sqrt();
    let [s_uu, s_uv, s_vv] = [(uu + root) / t, uv / t, (vv + root) / t];
    let r_u = (f_u * s_vv - f_v * s_uv) / root;
    let r_v = (f_v * s_uu - f_u * s_uv) / root;
    // The dual basis of F; cloth crushed to less than half its area has none to speak of.
    let held = squared.max(LEAST_AREA * LEAST_AREA);
    let (a_u, a_v) = ((f_u * vv - f_v * uv) / held, (f_v * uu - f_u * uv) / held);
    let gamma = second.map(|x| [a_u.dot(x), a_v.dot(x)]);
    let frame = Frame { r_u, r_v, n: r_u.cross(r_v), tension: [0.0; 3], gamma };
    (frame, [s_uu - 1.0, s_vv - 1.0, 2.0 * s_uv], [s_uu, s_uv, s_vv])
}

/// What the stresses pull with along u and v, each by r_u and r_v: K = 2 S T with S T + T S = σ, so that F's power σ :
/// Ṡ is P : Ḟ and nothing turns by itself. For small strains K is σ.
pub(super) fn pulls([s_uu, s_uv, s_vv]: [f32; 3], [a, b, c]: [f32; 3]) -> [[f32; 2]; 2] {
    let det = (s_uu * s_vv - s_uv * s_uv).max(f32::MIN_POSITIVE);
    // adj S · σ · adj S.
    let (m, n) = ([s_vv * a - s_uv * b, s_vv * b - s_uv * c], [s_uu * b - s_uv * a, s_uu * c - s_uv * b]);
    let turned = [m[0] * s_vv - m[1] * s_uv, m[1] * s_uu - m[0] * s_uv, n[1] * s_uu - n[0] * s_uv];
    // Twice T.
    let over = (s_uu + s_vv) * det;
    let [t_uu, t_uv, t_vv] = [(det * a + turned[0]) / over, (det * b + turned[1]) / over, (det * c + turned[2]) / over];
    [[s_uu * t_uu + s_uv * t_uv, s_uv * t_uu + s_vv * t_uv], [s_uu * t_uv + s_uv * t_vv, s_uv * t_uv + s_vv * t_vv]]
}

/// The part of a symmetric 2×2 matrix that pulls.
pub(super) fn positive_part([a, b, c]: [f32; 3]) -> [f32; 3] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = (half * half + b * b).sqrt();
    let (high, low) = (mean + radius, mean - radius);
    if low >= 0.0 {
        [a, b, c]
    } else if high <= 0.0 || radius == 0.0 {
        [0.0; 3]
    } else {
        // The projector on the pulling direction is ½ (1 + (M − mean)/radius).
        let share = 0.5 * high / radius;
        [share * (radius + half), share * b, share * (radius - half)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_and_the_stretch_make_up_what_they_are_of() {
        let (f_u, f_v) = (Vec3A::new(1.1, 0.2, 0.3), Vec3A::new(-0.1, 0.8, 0.4));
        let second = [Vec3A::new(3.0, 1.0, -2.0); 3];
        let (frame, strain, [uu, uv, vv]) = polar(f_u, f_v, second);
        assert!((frame.r_u * uu + frame.r_v * uv - f_u).length() < 1e-6);
        assert!((frame.r_u * uv + frame.r_v * vv - f_v).length() < 1e-6);
        assert!((frame.r_u.length() - 1.0).abs() < 1e-6 && frame.r_u.dot(frame.r_v).abs() < 1e-6);
        assert_eq!(strain, [uu - 1.0, vv - 1.0, 2.0 * uv]);
        // The part of a vector in the surface, by F's own basis, and the part across it.
        let [g_u, g_v] = frame.gamma[0];
        assert!((f_u * g_u + f_v * g_v + frame.n * frame.n.dot(second[0]) - second[0]).length() < 1e-5);
    }

    #[test]
    fn pulls_have_the_power_of_the_stresses() {
        let sigma = [3.0_f32, 0.7, -1.0];
        let (f_u, f_v) = (Vec3A::new(1.1, 0.2, 0.3), Vec3A::new(-0.1, 0.8, 0.4));
        let (d_u, d_v) = (Vec3A::new(0.3, -0.2, 0.9), Vec3A::new(0.5, 0.4, -0.1));
        let h = 1e-2;
        let stretch = |t: f32| polar(f_u + d_u * t, f_v + d_v * t, [Vec3A::ZERO; 3]).2;
        let (plus, minus, (frame, _, at)) = (stretch(h), stretch(-h), polar(f_u, f_v, [Vec3A::ZERO; 3]));
        let rate: Vec<f32> = (0..3).map(|k| (plus[k] - minus[k]) / (2.0 * h)).collect();
        let power = sigma[0] * rate[0] + 2.0 * sigma[1] * rate[1] + sigma[2] * rate[2];
        let [[p_uu, p_vu], [p_uv, p_vv]] = pulls(at, sigma);
        let found = (frame.r_u * p_uu + frame.r_v * p_vu).dot(d_u) + (frame.r_u * p_uv + frame.r_v * p_vv).dot(d_v);
        assert!((found - power).abs() < 2e-3 * power.abs(), "{found} expected {power}");
    }

    #[test]
    fn the_positive_part_keeps_what_pulls() {
        assert_eq!(positive_part([2.0, 0.5, 1.0]), [2.0, 0.5, 1.0]);
        assert_eq!(positive_part([-2.0, 0.5, -1.0]), [0.0; 3]);
        // Eigenvalues 3 along (1, 1) and −1 along (1, −1).
        let part = positive_part([1.0, 2.0, 1.0]);
        assert!(part.iter().all(|p| (p - 1.5).abs() < 1e-6), "{part:?}");
    }
}
