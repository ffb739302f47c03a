//! [`Lanes`] as plain arrays, for processors without AVX2.

use super::{Four, Lanes};

#[derive(Debug, Clone, Copy)]
pub(super) struct Arrays;

macro_rules! lanewise {
    ($($function:ident $operator:tt)*) => {
        $(#[inline(always)]
        fn $function(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
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

    lanewise!(add + sub - mul * div /);
    shuffles!(even 0 4 2 6 odd 1 5 3 7 mixed 0 5 2 7 crossed 1 4 3 6);
    shuffles!(low 0 1 4 5 high 2 3 6 7 low_high 0 1 6 7 high_low 2 3 4 5);

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
