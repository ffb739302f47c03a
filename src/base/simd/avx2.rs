//! [`Lanes`] as AVX2 registers.

use std::arch::x86_64::{__m256, __m256d};

use pulp::x86::V3;

use super::{Four, Lanes};

macro_rules! intrinsics {
    ($type:ty: $($function:ident $intrinsic:ident $(::<$imm:literal>)?)*) => {
        $(#[inline(always)]
        fn $function(self, a: $type, b: $type) -> $type {
            self.avx.$intrinsic$(::<$imm>)?(a, b)
        })*
    };
}

impl Lanes for V3 {
    type Register = __m256d;
    type Singles = __m256;

    intrinsics!(__m256: add_singles _mm256_add_ps sub_singles _mm256_sub_ps mul_singles _mm256_mul_ps);

    intrinsics!(__m256d: add _mm256_add_pd sub _mm256_sub_pd mul _mm256_mul_pd div _mm256_div_pd max _mm256_max_pd);
    intrinsics!(__m256d: even _mm256_unpacklo_pd odd _mm256_unpackhi_pd);
    intrinsics!(__m256d: mixed _mm256_shuffle_pd::<0b1010> crossed _mm256_shuffle_pd::<0b0101>);
    intrinsics!(__m256d: low _mm256_permute2f128_pd::<0x20> high _mm256_permute2f128_pd::<0x31>);
    intrinsics!(__m256d: low_high _mm256_permute2f128_pd::<0x30> high_low _mm256_permute2f128_pd::<0x21>);

    #[inline(always)]
    fn load_singles(self, all: [f32; 8]) -> __m256 {
        pulp::cast(all)
    }

    #[inline(always)]
    fn store_singles(self, a: __m256) -> [f32; 8] {
        pulp::cast(a)
    }

    #[inline(always)]
    fn splat_single(self, a: f32) -> __m256 {
        self.avx._mm256_set1_ps(a)
    }

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
    fn sqrt(self, a: __m256d) -> __m256d {
        self.avx._mm256_sqrt_pd(a)
    }

    #[inline(always)]
    fn where_negative(self, test: __m256d, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_blendv_pd(b, a, test)
    }
}
