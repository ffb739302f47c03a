//! A front's dense part: a panel's Cholesky factor, what it takes from the rows below, and its triangular solves.
//!
//! With L₁₁ L₁₁ᵀ = A₁₁ and L₂₁ = A₂₁ L₁₁⁻ᵀ, what is left of the rows below is A₂₂ − L₂₁ L₂₁ᵀ. Every entry is c − l₀ m₀ − l₁ m₁ − …,
//! each product and each difference rounded by IEEE 754 and never fused, in this order. The bits therefore depend neither on the
//! processor and its lanes, nor on tiles, pieces or threads. (Kernels of libraries select their instructions, fused or not, at run time.)
//!
//! Matrices are slices of whole columns, all of the same height. A matrix of many columns is cut in halves for the threads there are.

use std::ops::{AddAssign, DivAssign, Mul, Neg, SubAssign};

use crate::base::simd::{Four, Lanes, Work, run};

/// The two precisions, and their arithmetic by registers.
pub(super) trait Precision:
    Copy
    + Default
    + Send
    + Sync
    + PartialOrd
    + Into<f64>
    + Neg<Output = Self>
    + Mul<Output = Self>
    + AddAssign
    + SubAssign
    + DivAssign
{
    type Register<L: Lanes>: Copy;
    /// Numbers in a register.
    const WIDTH: usize;

    fn of(number: f64) -> Self;
    fn sqrt(self) -> Self;
    fn recip(self) -> Self;
    /// The first numbers of a slice that holds enough for a register.
    fn load<L: Lanes>(l: L, from: &[Self]) -> Self::Register<L>;
    fn store<L: Lanes>(l: L, a: Self::Register<L>, to: &mut [Self]);
    fn splat<L: Lanes>(l: L, a: Self) -> Self::Register<L>;
    fn plus<L: Lanes>(l: L, a: Self::Register<L>, b: Self::Register<L>) -> Self::Register<L>;
    fn minus<L: Lanes>(l: L, a: Self::Register<L>, b: Self::Register<L>) -> Self::Register<L>;
    fn times<L: Lanes>(l: L, a: Self::Register<L>, b: Self::Register<L>) -> Self::Register<L>;
}

macro_rules! precision {
    ($type:ident, $register:ident, $width:literal, $load:expr, $store:expr, $splat:ident $add:ident $sub:ident $mul:ident) => {
        impl Precision for $type {
            type Register<L: Lanes> = L::$register;
            const WIDTH: usize = $width;

            #[inline(always)]
            fn of(number: f64) -> Self {
                number as Self
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn recip(self) -> Self {
                1.0 / self
            }

            #[inline(always)]
            fn load<L: Lanes>(l: L, from: &[Self]) -> L::$register {
                let all: [Self; $width] = from.first_chunk().copied().unwrap_or_default();
                $load(l, all)
            }

            #[inline(always)]
            fn store<L: Lanes>(l: L, a: L::$register, to: &mut [Self]) {
                to[..$width].copy_from_slice(&$store(l, a));
            }

            #[inline(always)]
            fn splat<L: Lanes>(l: L, a: Self) -> L::$register {
                l.$splat(a)
            }

            #[inline(always)]
            fn plus<L: Lanes>(l: L, a: L::$register, b: L::$register) -> L::$register {
                l.$add(a, b)
            }

            #[inline(always)]
            fn minus<L: Lanes>(l: L, a: L::$register, b: L::$register) -> L::$register {
                l.$sub(a, b)
            }

            #[inline(always)]
            fn times<L: Lanes>(l: L, a: L::$register, b: L::$register) -> L::$register {
                l.$mul(a, b)
            }
        }
    };
}

#[inline(always)]
fn load_singles<L: Lanes>(l: L, all: [f32; 8]) -> L::Singles {
    l.load_singles(all)
}

#[inline(always)]
fn store_singles<L: Lanes>(l: L, a: L::Singles) -> [f32; 8] {
    l.store_singles(a)
}

#[inline(always)]
fn load_doubles<L: Lanes>(l: L, all: [f64; 4]) -> L::Register {
    l.load(&Four(all))
}

#[inline(always)]
fn store_doubles<L: Lanes>(l: L, a: L::Register) -> [f64; 4] {
    l.store(a).0
}

precision!(f32, Singles, 8, load_singles, store_singles, splat_single add_singles sub_singles mul_singles);
precision!(f64, Register, 4, load_doubles, store_doubles, splat add sub mul);

/// Columns that are factored one by one.
const NARROW: usize = 16;

/// Fewest products of a piece that is given to another thread: 50 µs of work.
const PRODUCTS_PER_TASK: usize = 1 << 20;

/// Registers of rows, and columns, of a tile of a product.
const TILE_REGISTERS: usize = 2;
const TILE_COLUMNS: usize = 4;

/// Factors a panel of `height` rows, its diagonal block on top, lower half. The error is the column whose pivot is not positive.
pub(super) fn factor_panel<T: Precision>(panel: &mut [T], height: usize) -> Result<(), usize> {
    factor_below(panel, height, 0)
}

/// The same for columns whose diagonal block begins at row `top`.
fn factor_below<T: Precision>(panel: &mut [T], height: usize, top: usize) -> Result<(), usize> {
    let columns = panel.len() / height;
    if columns <= NARROW {
        return run(Narrow { panel, height, top }).map_or(Ok(()), Err);
    }
    let half = (columns / 2).next_multiple_of(NARROW);
    let (left, right) = panel.split_at_mut(half * height);
    factor_below(left, height, top)?;
    let below = top + half;
    subtract(Target { columns: right, height, skipped: below, onto: true }, left, height, below);
    factor_below(right, height, below).map_err(|index| half + index)
}

/// Factors a few columns, one after the other; the result is the column whose pivot is not positive.
struct Narrow<'a, T> {
    panel: &'a mut [T],
    height: usize,
    top: usize,
}

impl<T: Precision> Work for Narrow<'_, T> {
    type Output = Option<usize>;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> Option<usize> {
        let Self { panel, height, top } = self;
        for j in 0..panel.len() / height {
            let (before, rest) = panel.split_at_mut(j * height);
            let column = &mut rest[top + j..height];
            for done in before.chunks_exact(height) {
                let done = &done[top + j..];
                subtract_scaled(l, column, done, done[0]);
            }
            let pivot = column[0];
            // Not positive, or NaN.
            if !(pivot > T::default() && pivot.into().is_finite()) {
                return Some(j);
            }
            let root = pivot.sqrt();
            let scale = root.recip();
            column[0] = root;
            let factor = T::splat(l, scale);
            let mut registers = column[1..].chunks_exact_mut(T::WIDTH);
            for c in &mut registers {
                T::store(l, T::times(l, T::load(l, c), factor), c);
            }
            for c in registers.into_remainder() {
                *c = *c * scale;
            }
        }
        None
    }
}

/// −L Lᵀ in the lower trapezoid of `update`, whose rows and columns are the rows of L from `first` on.
pub(super) fn set_product<T: Precision>(update: &mut [T], panel: &[T], height: usize, first: usize) {
    let rows = height - first;
    if rows > 0 {
        subtract(Target { columns: update, height: rows, skipped: 0, onto: false }, panel, height, first);
    }
}

/// The columns that a product is subtracted from.
struct Target<'a, T> {
    columns: &'a mut [T],
    height: usize,
    /// Row of the first column's diagonal entry.
    skipped: usize,
    /// Whether what the columns hold counts; zeros otherwise.
    onto: bool,
}

/// C − L Lᵀ in the lower trapezoid of C, whose diagonal begins at row `first` of the columns of L.
fn subtract<T: Precision>(c: Target<'_, T>, l: &[T], height: usize, first: usize) {
    let columns = c.columns.len() / c.height;
    let products = columns * (height - first) * (l.len() / height);
    if products > PRODUCTS_PER_TASK && columns >= 2 * NARROW {
        // The right half has the shorter columns.
        let half = (2 * columns / 5).next_multiple_of(NARROW);
        let (left, right) = c.columns.split_at_mut(half * c.height);
        let left = Target { columns: left, ..c };
        let right = Target { columns: right, skipped: c.skipped + half, ..c };
        rayon::join(|| subtract(left, l, height, first), || subtract(right, l, height, first + half));
        return;
    }
    if products > 0 {
        run(Product { c, l, height, first });
    }
}

struct Product<'a, T> {
    c: Target<'a, T>,
    l: &'a [T],
    height: usize,
    first: usize,
}

impl<T: Precision> Work for Product<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, lanes: L) {
        let Self { c, l, height, first } = self;
        let (rows, columns) = (c.height - c.skipped, c.columns.len() / c.height);
        let (tile, depth) = (TILE_REGISTERS * T::WIDTH, l.len() / height);
        // Rows of L for the columns of C, by strips of a few, filled up with zeros.
        let mut strips = vec![T::default(); columns.next_multiple_of(TILE_COLUMNS) * depth];
        for (s, strip) in strips.chunks_exact_mut(TILE_COLUMNS * depth).enumerate() {
            let from = first + s * TILE_COLUMNS;
            let width = TILE_COLUMNS.min(columns - s * TILE_COLUMNS);
            for (to, column) in strip.as_chunks_mut::<TILE_COLUMNS>().0.iter_mut().zip(l.chunks_exact(height)) {
                match column[from..].first_chunk() {
                    Some(all) if width == TILE_COLUMNS => *to = *all,
                    _ => to[..width].copy_from_slice(&column[from..from + width]),
                }
            }
        }
        let mut packed = vec![T::default(); tile * depth];
        for i in (0..rows).step_by(tile) {
            let some = tile.min(rows - i);
            for (to, column) in packed.chunks_exact_mut(tile).zip(l.chunks_exact(height)) {
                copy_tile(lanes, to, &column[first + i..][..some]);
            }
            // Columns whose diagonal lies above the end of these rows.
            let wanted = columns.min(i + some);
            for (s, strip) in strips.chunks_exact(TILE_COLUMNS * depth).enumerate().take(wanted.div_ceil(TILE_COLUMNS))
            {
                let j = s * TILE_COLUMNS;
                let target = &mut c.columns[j * c.height..];
                multiply(
                    lanes,
                    (&packed, strip),
                    target,
                    (c.height, c.skipped + i),
                    [some, TILE_COLUMNS.min(columns - j)],
                    c.onto,
                );
            }
        }
    }
}

/// Copies rows of a column into a tile, filled up with zeros. Whole tiles go by registers: a call of `memcpy` costs more than their copy.
#[inline(always)]
fn copy_tile<T: Precision, L: Lanes>(l: L, to: &mut [T], from: &[T]) {
    if from.len() == to.len() {
        for r in 0..TILE_REGISTERS {
            T::store(l, T::load(l, &from[r * T::WIDTH..]), &mut to[r * T::WIDTH..]);
        }
    } else {
        to[..from.len()].copy_from_slice(from);
        to[from.len()..].fill(T::default());
    }
}

/// A tile of a product: `some` rows and columns from `row` on of columns of this height.
#[inline(always)]
fn multiply<T: Precision, L: Lanes>(
    l: L,
    (packed, strip): (&[T], &[T]),
    columns: &mut [T],
    (height, row): (usize, usize),
    [rows, width]: [usize; 2],
    onto: bool,
) {
    let tile = TILE_REGISTERS * T::WIDTH;
    let mut sums = [[T::splat(l, T::default()); TILE_REGISTERS]; TILE_COLUMNS];
    // As wide as the widest tile.
    let mut buffer = [T::default(); 16];
    if onto {
        for (k, sum) in sums.iter_mut().enumerate().take(width) {
            copy_tile(l, &mut buffer[..tile], &columns[k * height + row..][..rows]);
            for (r, sum) in sum.iter_mut().enumerate() {
                *sum = T::load(l, &buffer[r * T::WIDTH..]);
            }
        }
    }
    for (a, b) in packed.chunks_exact(tile).zip(strip.chunks_exact(TILE_COLUMNS)) {
        let a: [T::Register<L>; TILE_REGISTERS] = std::array::from_fn(|r| T::load(l, &a[r * T::WIDTH..]));
        for k in 0..TILE_COLUMNS {
            let b = T::splat(l, b[k]);
            for r in 0..TILE_REGISTERS {
                sums[k][r] = T::minus(l, sums[k][r], T::times(l, a[r], b));
            }
        }
    }
    for (k, sum) in sums.iter().enumerate().take(width) {
        let target = &mut columns[k * height + row..][..rows];
        let to = if rows == tile { &mut *target } else { &mut buffer[..] };
        for (r, sum) in sum.iter().enumerate() {
            T::store(l, *sum, &mut to[r * T::WIDTH..]);
        }
        if rows < tile {
            target.copy_from_slice(&buffer[..rows]);
        }
    }
}

/// x ← x − share · l.
#[inline(always)]
fn subtract_scaled<T: Precision, L: Lanes>(l: L, x: &mut [T], of: &[T], share: T) {
    let factor = T::splat(l, share);
    let of = &of[..x.len()];
    let (mut to, from) = (x.chunks_exact_mut(T::WIDTH), of.chunks_exact(T::WIDTH));
    let rest = from.remainder();
    for (x, of) in (&mut to).zip(from) {
        T::store(l, T::minus(l, T::load(l, x), T::times(l, T::load(l, of), factor)), x);
    }
    for (x, of) in to.into_remainder().iter_mut().zip(rest) {
        *x -= *of * share;
    }
}

/// x ← L₁₁⁻¹ x; `rows` ← L₂₁ x.
pub(super) fn solve_down<T: Precision>(panel: &[T], height: usize, x: &mut [T], rows: &mut Vec<T>) {
    rows.clear();
    rows.resize(height - x.len(), T::default());
    run(Down { panel, height, x, rows });
}

struct Down<'a, T> {
    panel: &'a [T],
    height: usize,
    x: &'a mut [T],
    rows: &'a mut [T],
}

impl<T: Precision> Work for Down<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) {
        let Self { panel, height, x, rows } = self;
        let n = x.len();
        for (j, column) in panel.chunks_exact(height).enumerate() {
            x[j] /= column[j];
            let share = x[j];
            subtract_scaled(l, &mut x[j + 1..], &column[j + 1..n], share);
            subtract_scaled(l, rows, &column[n..], -share);
        }
    }
}

/// x ← L₁₁⁻ᵀ (x − L₂₁ᵀ rows).
pub(super) fn solve_up<T: Precision>(panel: &[T], height: usize, x: &mut [T], rows: &[T]) {
    run(Up { panel, height, x, rows });
}

struct Up<'a, T> {
    panel: &'a [T],
    height: usize,
    x: &'a mut [T],
    rows: &'a [T],
}

impl<T: Precision> Work for Up<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) {
        let Self { panel, height, x, rows } = self;
        let n = x.len();
        for (j, column) in panel.chunks_exact(height).enumerate().rev() {
            let (below, after) = (dot(l, &column[n..], rows), dot(l, &column[j + 1..n], &x[j + 1..]));
            x[j] -= below;
            x[j] -= after;
            x[j] /= column[j];
        }
    }
}

/// a · b, in the partial sums of two registers; their number depends on the precision alone.
#[inline(always)]
fn dot<T: Precision, L: Lanes>(l: L, a: &[T], b: &[T]) -> T {
    let b = &b[..a.len()];
    let (a, b) = (a.chunks_exact(2 * T::WIDTH), b.chunks_exact(2 * T::WIDTH));
    let rest = a.remainder().iter().zip(b.remainder());
    let mut sums = [T::splat(l, T::default()); 2];
    for (a, b) in a.zip(b) {
        for (r, sum) in sums.iter_mut().enumerate() {
            *sum = T::plus(l, *sum, T::times(l, T::load(l, &a[r * T::WIDTH..]), T::load(l, &b[r * T::WIDTH..])));
        }
    }
    let mut parts = [T::default(); 8];
    T::store(l, T::plus(l, sums[0], sums[1]), &mut parts);
    let mut total = T::default();
    for (a, b) in rest {
        total += *a * *b;
    }
    for part in &parts[..T::WIDTH] {
        total += *part;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::simd::portable;

    /// A panel of a positive definite matrix with `columns` columns, and the matrix's lower entries as a function.
    fn panel<T: Precision>(height: usize, columns: usize) -> (Vec<T>, impl Fn(usize, usize) -> f64) {
        let entry = move |i: usize, j: usize| {
            let noise = ((i * 31 + j * 17) % 23) as f64 / 23.0 - 0.5;
            if i == j { height as f64 } else { noise }
        };
        ((0..columns).flat_map(|j| (0..height).map(move |i| T::of(entry(i, j)))).collect(), entry)
    }

    #[test]
    fn the_factor_times_its_transpose_is_the_matrix() {
        for (height, columns) in [(1, 1), (7, 3), (40, 40), (75, 33), (130, 100)] {
            let (mut l, entry) = panel::<f64>(height, columns);
            factor_panel(&mut l, height).unwrap();
            let at = |i: usize, j: usize| l[j * height + i];
            for (i, j) in (0..columns).flat_map(|j| (j..height).map(move |i| (i, j))) {
                let product: f64 = (0..=j).map(|k| at(i, k) * at(j, k)).sum();
                assert!((product - entry(i, j)).abs() < 1e-10, "{height} {columns}: {i} {j}");
            }
            let rows = height - columns;
            let mut update = vec![f64::NAN; rows * rows];
            set_product(&mut update, &l, height, columns);
            for (i, j) in (0..rows).flat_map(|j| (j..rows).map(move |i| (i, j))) {
                let product: f64 = (0..columns).map(|k| at(columns + i, k) * at(columns + j, k)).sum();
                assert!((update[j * rows + i] + product).abs() < 1e-10);
            }
            // L₁₁ L₁₁ᵀ x = b, and the rows below.
            let b: Vec<f64> = (0..columns).map(|i| (i % 5) as f64 - 1.7).collect();
            let (mut x, mut below) = (b.clone(), Vec::new());
            solve_down(&l, height, &mut x, &mut below);
            assert_eq!(below.len(), rows);
            for (i, below) in below.iter().enumerate() {
                let product: f64 = (0..columns).map(|k| at(columns + i, k) * x[k]).sum();
                assert!((below - product).abs() < 1e-10);
            }
            solve_up(&l, height, &mut x, &vec![0.0; rows]);
            for (i, b) in b.iter().enumerate() {
                let sum: f64 = (0..columns).map(|j| entry(i.max(j), i.min(j)) * x[j]).sum();
                assert!((sum - b).abs() < 1e-9, "{height} {columns}: {sum} and {b}");
            }
        }
    }

    #[test]
    fn a_pivot_that_is_not_positive_is_named() {
        for bad in [0, 5, 20] {
            let (mut l, _) = panel::<f32>(30, 25);
            l[bad * 30 + bad] = -1.0;
            assert_eq!(factor_panel(&mut l, 30), Err(bad));
        }
    }

    /// Lanes of another width, and pieces for threads, give the same bits.
    #[test]
    fn the_bits_depend_on_neither_lanes_nor_pieces() {
        fn all<T: Precision>() -> Vec<u64> {
            let (height, columns) = (420, 230);
            let (mut l, _) = panel::<T>(height, columns);
            factor_panel(&mut l, height).unwrap();
            let mut update = vec![T::default(); (height - columns).pow(2)];
            set_product(&mut update, &l, height, columns);
            let (mut x, mut rows) = (vec![T::of(0.3); columns], Vec::new());
            solve_down(&l, height, &mut x, &mut rows);
            solve_up(&l, height, &mut x, &rows);
            l.iter().chain(&update).chain(&x).map(|&n| Into::<f64>::into(n).to_bits()).collect()
        }
        let both = || (all::<f32>(), all::<f64>());
        let widest = both();
        assert!(widest == portable(both));
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(both);
        assert!(widest == one_thread);
    }
}
