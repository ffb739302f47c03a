//! The lanes of AVX2.

use std::arch::x86_64::__m256d;

use pulp::x86::V3;

use super::{Four, Lanes};

impl Lanes for V3 {
    type Register = __m256d;

    #[inline(always)]
    fn load(self, four: &Four) -> __m256d {
        pulp::cast(four.0)
    }

    #[inline(always)]
    fn store(self, a: __m256d) -> Four {
        Four(pulp::cast(a))
    }

    #[inline(always)]
    fn splat(self, a: f64) -> __m256d {
        self.avx._mm256_set1_pd(a)
    }

    #[inline(always)]
    fn add(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_add_pd(a, b)
    }

    #[inline(always)]
    fn sub(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_sub_pd(a, b)
    }

    #[inline(always)]
    fn mul(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_mul_pd(a, b)
    }

    #[inline(always)]
    fn div(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_div_pd(a, b)
    }

    #[inline(always)]
    fn sqrt(self, a: __m256d) -> __m256d {
        self.avx._mm256_sqrt_pd(a)
    }

    #[inline(always)]
    fn max(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_max_pd(a, b)
    }

    #[inline(always)]
    fn where_negative(self, test: __m256d, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_blendv_pd(b, a, test)
    }

    #[inline(always)]
    fn even(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_unpacklo_pd(a, b)
    }

    #[inline(always)]
    fn odd(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_unpackhi_pd(a, b)
    }

    #[inline(always)]
    fn mixed(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_shuffle_pd::<0b1010>(a, b)
    }

    #[inline(always)]
    fn crossed(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_shuffle_pd::<0b0101>(a, b)
    }

    #[inline(always)]
    fn low(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_permute2f128_pd::<0x20>(a, b)
    }

    #[inline(always)]
    fn high(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_permute2f128_pd::<0x31>(a, b)
    }

    #[inline(always)]
    fn low_high(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_permute2f128_pd::<0x30>(a, b)
    }

    #[inline(always)]
    fn high_low(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_permute2f128_pd::<0x21>(a, b)
    }
}
