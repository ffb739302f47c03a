//! Four doubles at a time, in AVX2 registers where the processor has them, with the same bits on every x86-64.
//!
//! A plain x86-64 build may assume SSE2 only, which has two lanes. Hot loops are therefore written once over [`Lanes`], and [`run`]
//! selects the implementation at run time: AVX2 ([`V3`](pulp::x86::V3)) or arrays. Both do the same operations in the same order,
//! each rounded by IEEE 754 and never fused, hence the same bits.
//!
//! A function runs in AVX2 only if it is inlined into [`run`]: it must be `#[inline(always)]` and free of closures.

#[cfg(target_arch = "x86_64")]
mod avx2;

use std::ops::{Add, Div, Mul, Sub};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Four doubles as one register holds them: four scalars, or a vector and a zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub(crate) struct Four(pub(crate) [f64; 4]);

impl Four {
    pub(crate) const ZERO: Self = Self([0.0; 4]);
}

/// The operations of a processor on four doubles.
pub(crate) trait Lanes: Copy {
    /// Its register type.
    type Register: Copy;
    /// The same for eight numbers of single precision.
    type Singles: Copy;

    fn load(self, four: &Four) -> Self::Register;
    fn store(self, a: Self::Register) -> Four;
    fn splat(self, a: f64) -> Self::Register;
    fn add(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn sub(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn mul(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn div(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn sqrt(self, a: Self::Register) -> Self::Register;
    /// a where a > b, else b.
    fn max(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// a where the sign of `test` is set, else b.
    fn where_negative(self, test: Self::Register, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₀ b₀ a₂ b₂].
    fn even(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₁ b₁ a₃ b₃].
    fn odd(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₀ b₁ a₂ b₃].
    fn mixed(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₁ b₀ a₃ b₂].
    fn crossed(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₀ a₁ b₀ b₁].
    fn low(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₂ a₃ b₂ b₃].
    fn high(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₀ a₁ b₂ b₃].
    fn low_high(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// [a₂ a₃ b₀ b₁].
    fn high_low(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn load_singles(self, all: [f32; 8]) -> Self::Singles;
    fn store_singles(self, a: Self::Singles) -> [f32; 8];
    fn splat_single(self, a: f32) -> Self::Singles;
    fn add_singles(self, a: Self::Singles, b: Self::Singles) -> Self::Singles;
    fn sub_singles(self, a: Self::Singles, b: Self::Singles) -> Self::Singles;
    fn mul_singles(self, a: Self::Singles, b: Self::Singles) -> Self::Singles;
}

/// [`Lanes`] as plain arrays, for processors without AVX2.
#[derive(Debug, Clone, Copy)]
struct Arrays;

macro_rules! lanewise {
    ($type:ty: $($function:ident $operator:tt)*) => {
        $(#[inline(always)]
        fn $function(self, a: $type, b: $type) -> $type {
            std::array::from_fn(|i| a[i] $operator b[i])
        })*
    };
}

macro_rules! shuffles {
    ($($function:ident $i:literal $j:literal $k:literal $l:literal)*) => {
        $(#[inline(always)]
        fn $function(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
            // Indices from 4 on are lanes of b.
            let both = [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]];
            [both[$i], both[$j], both[$k], both[$l]]
        })*
    };
}

impl Lanes for Arrays {
    type Register = [f64; 4];
    type Singles = [f32; 8];

    lanewise!([f64; 4]: add + sub - mul * div /);
    lanewise!([f32; 8]: add_singles + sub_singles - mul_singles *);
    shuffles!(even 0 4 2 6 odd 1 5 3 7 mixed 0 5 2 7 crossed 1 4 3 6);
    shuffles!(low 0 1 4 5 high 2 3 6 7 low_high 0 1 6 7 high_low 2 3 4 5);

    #[inline(always)]
    fn load_singles(self, all: [f32; 8]) -> [f32; 8] {
        all
    }

    #[inline(always)]
    fn store_singles(self, a: [f32; 8]) -> [f32; 8] {
        a
    }

    #[inline(always)]
    fn splat_single(self, a: f32) -> [f32; 8] {
        [a; 8]
    }

    #[inline(always)]
    fn load(self, four: &Four) -> [f64; 4] {
        four.0
    }

    #[inline(always)]
    fn store(self, a: [f64; 4]) -> Four {
        Four(a)
    }

    #[inline(always)]
    fn splat(self, a: f64) -> [f64; 4] {
        [a; 4]
    }

    #[inline(always)]
    fn sqrt(self, a: [f64; 4]) -> [f64; 4] {
        a.map(f64::sqrt)
    }

    #[inline(always)]
    fn max(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        // As the instruction does: b where either is NaN.
        std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn where_negative(self, test: [f64; 4], a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|i| if test[i].is_sign_negative() { a[i] } else { b[i] })
    }
}

/// A computation over [`Lanes`].
pub(crate) trait Work {
    type Output;

    /// Must be `#[inline(always)]`.
    fn with<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Environment variable that selects the arrays on any processor, to compare their bits with those of the registers.
const PORTABLE: &str = "PARTWISE_PORTABLE";

/// Whether the arrays are selected.
static IS_PORTABLE: LazyLock<AtomicBool> = LazyLock::new(|| AtomicBool::new(std::env::var_os(PORTABLE).is_some()));

/// Does `work` with the arrays selected in all threads: for tests, whose results do not depend on it.
#[cfg(test)]
pub(crate) fn portable<R>(work: impl FnOnce() -> R) -> R {
    IS_PORTABLE.store(true, Ordering::Relaxed);
    let done = work();
    IS_PORTABLE.store(false, Ordering::Relaxed);
    done
}

/// Runs `work` in the widest lanes of this processor.
pub(crate) fn run<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new().filter(|_| !IS_PORTABLE.load(Ordering::Relaxed)) {
        return v3.vectorize(Avx2 { v3, work });
    }
    work.with(Arrays)
}

#[cfg(target_arch = "x86_64")]
struct Avx2<W> {
    v3: pulp::x86::V3,
    work: W,
}

#[cfg(target_arch = "x86_64")]
impl<W: Work> pulp::NullaryFnOnce for Avx2<W> {
    type Output = W::Output;

    #[inline(always)]
    fn call(self) -> W::Output {
        self.work.with(self.v3)
    }
}

/// A register together with its lanes, so that formulas can use operators.
#[derive(Clone, Copy)]
pub(crate) struct Pack<L: Lanes> {
    pub(crate) lanes: L,
    pub(crate) register: L::Register,
}

impl<L: Lanes> Pack<L> {
    #[inline(always)]
    pub(crate) fn new(lanes: L, register: L::Register) -> Self {
        Self { lanes, register }
    }

    #[inline(always)]
    pub(crate) fn load(lanes: L, four: &Four) -> Self {
        Self::new(lanes, lanes.load(four))
    }

    #[inline(always)]
    pub(crate) fn splat(lanes: L, a: f64) -> Self {
        Self::new(lanes, lanes.splat(a))
    }

    #[inline(always)]
    pub(crate) fn store(self) -> Four {
        self.lanes.store(self.register)
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self::new(self.lanes, self.lanes.sqrt(self.register))
    }

    /// `self` where it is greater than b, else b.
    #[inline(always)]
    pub(crate) fn max(self, b: Self) -> Self {
        Self::new(self.lanes, self.lanes.max(self.register, b.register))
    }

    /// a where `self` is negative, else b.
    #[inline(always)]
    pub(crate) fn if_negative(self, a: Self, b: Self) -> Self {
        Self::new(self.lanes, self.lanes.where_negative(self.register, a.register, b.register))
    }

    /// Sum of the four.
    #[inline(always)]
    pub(crate) fn sum(self) -> f64 {
        let Four([a, b, c, d]) = self.store();
        (a + b) + (c + d)
    }
}

macro_rules! operator {
    ($trait:ident, $function:ident) => {
        impl<L: Lanes> $trait for Pack<L> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, b: Self) -> Self {
                Self::new(self.lanes, self.lanes.$function(self.register, b.register))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<L: Lanes> Mul<f64> for Pack<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, b: f64) -> Self {
        self * Self::splat(self.lanes, b)
    }
}

/// Four vectors, by coordinate.
#[derive(Clone, Copy)]
pub(crate) struct Vectors<L: Lanes> {
    pub(crate) x: Pack<L>,
    pub(crate) y: Pack<L>,
    pub(crate) z: Pack<L>,
}

impl<L: Lanes> Vectors<L> {
    #[inline(always)]
    pub(crate) fn load(l: L, [x, y, z]: &[Four; 3]) -> Self {
        Self { x: Pack::load(l, x), y: Pack::load(l, y), z: Pack::load(l, z) }
    }

    #[inline(always)]
    pub(crate) fn store(self) -> [Four; 3] {
        [self.x.store(), self.y.store(), self.z.store()]
    }

    /// From registers that hold one vector each; their fourth lane is ignored.
    #[inline(always)]
    pub(crate) fn from_rows(l: L, [a, b, c, d]: [L::Register; 4]) -> Self {
        let (ab, cd) = (l.even(a, b), l.even(c, d));
        let (x, z) = (l.low(ab, cd), l.high(ab, cd));
        let y = l.low(l.odd(a, b), l.odd(c, d));
        Self { x: Pack::new(l, x), y: Pack::new(l, y), z: Pack::new(l, z) }
    }

    /// Registers that hold one vector and a zero each.
    #[inline(always)]
    pub(crate) fn rows(self, l: L) -> [L::Register; 4] {
        let (x, y, z) = (self.x.register, self.y.register, self.z.register);
        let zero = l.splat(0.0);
        let (xy, xy_odd) = (l.even(x, y), l.odd(x, y));
        let (z, z_odd) = (l.even(z, zero), l.odd(z, zero));
        [l.low(xy, z), l.low(xy_odd, z_odd), l.high(xy, z), l.high(xy_odd, z_odd)]
    }

    /// From interleaved coordinates: x y z x | y z x y | z x y z.
    #[inline(always)]
    pub(crate) fn from_flat(l: L, [a, b, c]: &[Four; 3]) -> Self {
        let (a, b, c) = (l.load(a), l.load(b), l.load(c));
        let (xy, zx, yz) = (l.low_high(a, b), l.high_low(a, c), l.low_high(b, c));
        let (x, y, z) = (l.mixed(xy, zx), l.crossed(xy, yz), l.mixed(zx, yz));
        Self { x: Pack::new(l, x), y: Pack::new(l, y), z: Pack::new(l, z) }
    }

    /// Interleaved coordinates, as [`from_flat`](Self::from_flat) reads them.
    #[inline(always)]
    pub(crate) fn flat(self, l: L) -> [Four; 3] {
        let (x, y, z) = (self.x.register, self.y.register, self.z.register);
        let (xy, zx, yz) = (l.even(x, y), l.mixed(z, x), l.odd(y, z));
        [l.store(l.low(xy, zx)), l.store(l.low_high(yz, xy)), l.store(l.high(zx, yz))]
    }

    #[inline(always)]
    pub(crate) fn dot(self, b: Self) -> Pack<L> {
        self.x * b.x + self.y * b.y + self.z * b.z
    }
}

macro_rules! by_coordinate {
    ($trait:ident, $function:ident) => {
        impl<L: Lanes> $trait for Vectors<L> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, b: Self) -> Self {
                Self { x: self.x.$function(b.x), y: self.y.$function(b.y), z: self.z.$function(b.z) }
            }
        }
    };
}
by_coordinate!(Add, add);
by_coordinate!(Sub, sub);

impl<L: Lanes> Mul<Pack<L>> for Vectors<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, b: Pack<L>) -> Self {
        Self { x: self.x * b, y: self.y * b, z: self.z * b }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    struct Everything;

    impl Work for Everything {
        type Output = Vec<Four>;

        fn with<L: Lanes>(self, l: L) -> Vec<Four> {
            let a = l.load(&Four([1.3, -0.2, 4.7, 1.0 / 3.0]));
            let b = l.load(&Four([-7.1, 0.3, 5.9, 1e-3]));
            let c = l.load(&Four([0.7, 12.5, -0.0, 2.0]));
            let mut all = vec![l.add(a, b), l.sub(a, b), l.mul(a, b), l.div(a, b), l.max(a, b), l.sqrt(l.mul(a, a))];
            all.extend([l.where_negative(c, a, b), l.splat(0.1), l.even(a, b), l.odd(a, b), l.mixed(a, b)]);
            all.extend([l.crossed(a, b), l.low(a, b), l.high(a, b), l.low_high(a, b), l.high_low(a, b)]);
            let flat = [a, b, c].map(|v| l.store(v));
            let vectors = Vectors::from_flat(l, &flat);
            assert_eq!(vectors.flat(l), flat);
            let rows = vectors.rows(l).map(|row| l.store(row));
            assert_eq!(rows[1].0, [flat[0].0[3], flat[1].0[0], flat[1].0[1], 0.0]);
            assert_eq!(Vectors::from_rows(l, rows.map(|row| l.load(&row))).flat(l), flat);
            all.into_iter().map(|v| l.store(v)).collect()
        }
    }

    #[test]
    fn arrays_and_registers_agree_to_the_bit() {
        let by_arrays = Everything.with(Arrays);
        for (i, (a, b)) in by_arrays.iter().zip(&run(Everything)).enumerate() {
            assert_eq!(a.0.map(f64::to_bits), b.0.map(f64::to_bits), "operation {i}: {a:?} and {b:?}");
        }
    }
}
