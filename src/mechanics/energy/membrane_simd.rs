//! The membrane four triangles at a time: the energy and gradient of [`membrane`](super::membrane), without a branch.
//!
//! With the stresses σ of a triangle in tension and those of tension field theory
//!
//! t_u = max(σ_u, 0) where σ_v ≥ 0, k_u max(s_u, 0) where σ_v < 0, t_v likewise,
//!
//! the stresses are r σ + (1 − r) t in each of the four states: two selections instead of three branches. (The states exclude
//! each other for 0 ≤ ν < 1: where σ_u < 0 ≤ s_u, σ_v is that of s_v < 0.)
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s_u, s_v | strains along weft and warp | – |
//! | σ_u, σ_v | stresses without wrinkles | N/m |
//! | r | compression ratio | – |
//!
//! Positions and forces are padded to four lanes, so that a vertex is one load. The bits are the same on any machine; they differ
//! from those of a loop over single triangles, whose sums have another order.

use super::membrane::{MIN_STRETCH, Stiffness, Triangle};
use crate::base::simd::{Four, Lanes, Pack, Vectors};

/// Rest data of four triangles of one fabric; the last pack of a fabric is padded by triangles of no area.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrianglePack {
    /// Gradients of the shape functions of the second and third corners, 1/m: the three sum to zero.
    second: [Four; 2],
    third: [Four; 2],
    area: Four,
    vertices: [[u32; 3]; 4],
    fabric: u16,
}

impl TrianglePack {
    /// Packs all triangles, fabric by fabric, each in their order.
    pub(super) fn all(triangles: &[Triangle]) -> Vec<Self> {
        by_fours(triangles, triangles, Self::new)
    }

    fn new(four: &[Triangle]) -> Self {
        let mut pack = Self {
            second: [Four::ZERO; 2],
            third: [Four::ZERO; 2],
            area: Four::ZERO,
            vertices: [[0; 3]; 4],
            fabric: four[0].fabric,
        };
        for (i, t) in four.iter().enumerate() {
            let [_, p, q] = t.gradients;
            (pack.second[0].0[i], pack.second[1].0[i]) = (p.x, p.y);
            (pack.third[0].0[i], pack.third[1].0[i]) = (q.x, q.y);
            pack.area.0[i] = t.area;
            pack.vertices[i] = t.vertices;
        }
        pack
    }
}

/// Packs one number for each triangle in the order of [`TrianglePack::all`].
pub(super) fn packed(triangles: &[Triangle], of_each: &[f64]) -> Vec<Four> {
    by_fours(triangles, of_each, |few| Four(std::array::from_fn(|i| few.get(i).copied().unwrap_or(0.0))))
}

/// Maps groups of up to four triangles of one fabric.
fn by_fours<T: Copy, U>(triangles: &[Triangle], of_each: &[T], four: impl Fn(&[T]) -> U) -> Vec<U> {
    if triangles.iter().all(|t| t.fabric == triangles[0].fabric) {
        return of_each.chunks(4).map(four).collect();
    }
    let mut sorted: Vec<(u16, T)> = triangles.iter().map(|t| t.fabric).zip(of_each.iter().copied()).collect();
    sorted.sort_by_key(|t| t.0);
    let groups = sorted.chunk_by(|a, b| a.0 == b.0).flat_map(|same| same.chunks(4));
    groups.map(|group| four(&group.iter().map(|t| t.1).collect::<Vec<T>>())).collect()
}

/// Adds the gradient of the triangles to `gradient`, N, by the stiffness of the fabric of each; returns their energy, J.
#[inline(always)]
pub(super) fn add_gradient<L: Lanes>(
    l: L,
    (packs, ratios): (&[TrianglePack], &[Four]),
    stiffness: &[Stiffness],
    x: &[Four],
    gradient: &mut [Four],
) -> f64 {
    let mut energy = 0.0;
    let (mut left, mut left_ratios) = (packs, ratios);
    while let Some(first) = left.first() {
        let end = left.partition_point(|pack| pack.fabric == first.fabric);
        let ((same, others), (ratios, others_ratios)) = (left.split_at(end), left_ratios.split_at(end));
        energy += of_one_fabric(l, (same, ratios), &stiffness[first.fabric as usize], x, gradient);
        (left, left_ratios) = (others, others_ratios);
    }
    energy
}

#[inline(always)]
fn of_one_fabric<L: Lanes>(
    l: L,
    (packs, ratios): (&[TrianglePack], &[Four]),
    c: &Stiffness,
    x: &[Four],
    gradient: &mut [Four],
) -> f64 {
    // Equal lengths let one bounds check serve both slices.
    let gradient = &mut gradient[..x.len()];
    let (zero, one, half) = (Pack::splat(l, 0.0), Pack::splat(l, 1.0), Pack::splat(l, 0.5));
    let shortest = Pack::splat(l, MIN_STRETCH);
    let (cuu, cuv, cvv) = (Pack::splat(l, c.uu), Pack::splat(l, c.uv), Pack::splat(l, c.vv));
    let (weft, warp, shear) = (Pack::splat(l, c.weft), Pack::splat(l, c.warp), Pack::splat(l, c.shear));
    let mut energy = zero;
    for (pack, ratio) in packs.iter().zip(ratios) {
        // By value: a reference would be read and checked again after every store.
        let [t0, t1, t2, t3] = pack.vertices;
        let ((a0, b0), (a1, b1)) = (edges(l, x, t0), edges(l, x, t1));
        let ((a2, b2), (a3, b3)) = (edges(l, x, t2), edges(l, x, t3));
        let (a, b) = (Vectors::from_rows(l, [a0, a1, a2, a3]), Vectors::from_rows(l, [b0, b1, b2, b3]));
        let [pu, pv] = [Pack::load(l, &pack.second[0]), Pack::load(l, &pack.second[1])];
        let [qu, qv] = [Pack::load(l, &pack.third[0]), Pack::load(l, &pack.third[1])];
        let (area, r) = (Pack::load(l, &pack.area), Pack::load(l, ratio));
        let (fu, fv) = (a * pu + b * qu, a * pv + b * qv);
        let (lu, lv, gamma) = (fu.dot(fu).sqrt(), fv.dot(fv).sqrt(), fu.dot(fv));
        let (su, sv) = (lu - one, lv - one);
        let (sigma_u, sigma_v) = (cuu * su + cuv * sv, cuv * su + cvv * sv);
        let field_u = sigma_v.if_negative(weft * su.max(zero), sigma_u.max(zero));
        let field_v = sigma_u.if_negative(warp * sv.max(zero), sigma_v.max(zero));
        let (tu, tv) = (field_u + r * (sigma_u - field_u), field_v + r * (sigma_v - field_v));
        let (tu, tv, tau) = (area * tu, area * tv, area * (shear * gamma));
        energy = energy + (tu * su + tv * sv + tau * gamma);
        let (tu, tv) = (tu / shortest.max(lu), tv / shortest.max(lv));
        let (gu, gv) = (fu * tu + fv * tau, fv * tv + fu * tau);
        let second = (gu * pu + gv * pv).rows(l);
        let third = (gu * qu + gv * qv).rows(l);
        scatter(l, gradient, t0, second[0], third[0]);
        scatter(l, gradient, t1, second[1], third[1]);
        scatter(l, gradient, t2, second[2], third[2]);
        scatter(l, gradient, t3, second[3], third[3]);
    }
    (half * energy).sum()
}

/// Vectors from the first corner of a triangle to the others.
#[inline(always)]
fn edges<L: Lanes>(l: L, x: &[Four], [a, b, c]: [u32; 3]) -> (L::Register, L::Register) {
    let a = l.load(&x[a as usize]);
    (l.sub(l.load(&x[b as usize]), a), l.sub(l.load(&x[c as usize]), a))
}

/// Adds the gradient of a triangle at its second and third corners, and minus their sum at the first.
#[inline(always)]
fn scatter<L: Lanes>(l: L, gradient: &mut [Four], [a, b, c]: [u32; 3], second: L::Register, third: L::Register) {
    let (a, b, c) = (a as usize, b as usize, c as usize);
    gradient[a] = l.store(l.sub(l.load(&gradient[a]), l.add(second, third)));
    gradient[b] = l.store(l.add(l.load(&gradient[b]), second));
    gradient[c] = l.store(l.add(l.load(&gradient[c]), third));
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::base::simd::{Work, run};
    use crate::garment::fabric::Fabric;

    struct Packed<'a>((&'a [TrianglePack], &'a [Four]), &'a [Stiffness], &'a [Four], &'a mut [Four]);

    impl Work for Packed<'_> {
        type Output = f64;

        #[inline(always)]
        fn with<L: Lanes>(self, l: L) -> f64 {
            add_gradient(l, self.0, self.1, self.2, self.3)
        }
    }

    /// A number in −1..1 by index.
    fn noise(i: usize) -> f64 {
        (i as f64 * 12.9898).sin()
    }

    /// Triangles in tension, compressed along weft, warp and both, and with a side of no length. Seven triangles leave one lane empty. The
    /// triangles have one fabric, or two in turn.
    #[test]
    fn packs_agree_with_single_triangles() {
        let stiffness = ["cotton", "jersey"].map(|name| Stiffness::new(&Fabric::by_name(name).unwrap()));
        let rest = |i: usize| {
            let jitter = |k: usize| DVec2::new(noise(7 * i + k), noise(11 * i + k + 3)) * 2e-3;
            [jitter(0), DVec2::new(0.01, 0.0) + jitter(1), DVec2::new(0.002, 0.011) + jitter(2)]
        };
        let scales = [[1.05, 1.1], [0.8, 1.2], [1.3, 0.7], [0.6, 0.5], [1.2, 0.999], [0.0, 1.1], [1.0, 1.0]];
        for (count, fabrics) in (1..=scales.len()).flat_map(|count| [(count, 1), (count, 2)]) {
            let mut x: Vec<DVec3> = Vec::new();
            let (mut triangles, mut ratios) = (Vec::new(), Vec::new());
            for (i, scale) in scales.iter().enumerate().take(count) {
                let first = x.len() as u32;
                let mut t = Triangle::new([first, first + 1, first + 2], rest(i)).unwrap();
                ratios.push(0.1 + 0.02 * i as f64);
                t.fabric = (i % fabrics) as u16;
                triangles.push(t);
                let turned = |p: DVec2| DVec3::new(0.8 * p.x, p.y, -0.6 * p.x) + DVec3::new(0.3, 0.1, 1.2);
                x.extend(rest(i).map(|p| turned(p * DVec2::from(*scale))));
            }
            let mut expected = vec![DVec3::ZERO; x.len()];
            let one_by_one = triangles.iter().zip(&ratios);
            let energy: f64 =
                one_by_one.map(|(t, &r)| t.add_gradient(&stiffness[t.fabric as usize], r, &x, &mut expected)).sum();
            let padded: Vec<Four> = x.iter().map(|p| Four([p.x, p.y, p.z, 0.0])).collect();
            let mut gradient = vec![Four::ZERO; x.len()];
            let packs = (&*TrianglePack::all(&triangles), &*packed(&triangles, &ratios));
            let packed = run(Packed(packs, &stiffness, &padded, &mut gradient));
            assert!((packed - energy).abs() < 1e-12 * energy, "{count} triangles: {packed} J packed, {energy} J");
            for (v, (g, expected)) in gradient.iter().zip(&expected).enumerate() {
                let Four([gx, gy, gz, zero]) = *g;
                let off = DVec3::new(gx, gy, gz).distance(*expected);
                assert!(off < 1e-9 && zero == 0.0, "{count} triangles, vertex {v}: {g:?}, {expected} N");
            }
        }
    }
}
