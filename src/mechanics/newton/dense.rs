//! A front's dense part: a panel's Cholesky factor, what it takes from the rows below, and its triangular solves.
//!
//! With L₁₁ L₁₁ᵀ = A₁₁ and L₂₁ = A₂₁ L₁₁⁻ᵀ, what is left of the rows below is A₂₂ − L₂₁ L₂₁ᵀ. Every entry is c − l₀ m₀ − l₁ m₁ − …,
//! each product and each difference rounded by IEEE 754 and never fused, in this order. The bits therefore depend neither on the
//! processor and its lanes, nor on tiles, pieces or threads. (Kernels of libraries select their instructions, fused or not, at run time.)
//!
//! Matrices are slices of whole columns, all of the same height. A matrix of many columns is cut in halves for the threads there are.

use crate::base::simd::{Lanes, Work, run};

/// Numbers in a register.
const WIDTH: usize = 8;

/// Columns that are factored one by one.
const NARROW: usize = 16;

/// Fewest products of a piece that is given to another thread: 50 µs of work.
const PRODUCTS_PER_TASK: usize = 1 << 20;

/// Share of the diagonal entry of its column below which a pivot is rounding: 512 units of single precision. A pivot is what is left of that
/// entry after some hundred to thousand subtractions, each of which rounds, and small pivots before it amplify the rounding. A smaller limit keeps
/// pivots of rounding, and steps may be infinite; a larger one replaces pivots of soft directions. Evidence: decision 22.
const LOST_PIVOT: f32 = 512.0 * f32::EPSILON;

/// Registers of rows, and columns, of a tile of a product.
const TILE_REGISTERS: usize = 2;
const TILE_COLUMNS: usize = 4;

/// Factors a panel of `height` rows, its diagonal block on top, lower half. A pivot that is zero or negative, or rounding beside the entry of
/// `diagonal` for its column, is replaced by that entry and the numbers below it by zero, as if the unknown pulled at nothing but itself: they are
/// rounding, too, and where many pivots are lost the factor may become infinite by them.
///
/// # Errors
/// The column whose pivot is not finite.
pub(super) fn factor_panel(panel: &mut [f32], height: usize, diagonal: &[f32]) -> Result<(), usize> {
    factor_below(panel, height, 0, diagonal)
}

/// The same for columns whose diagonal block begins at row `top`.
fn factor_below(panel: &mut [f32], height: usize, top: usize, diagonal: &[f32]) -> Result<(), usize> {
    let columns = panel.len() / height;
    if columns <= NARROW {
        return run(Narrow { panel, height, top, diagonal }).map_or(Ok(()), Err);
    }
    let half = (columns / 2).next_multiple_of(NARROW);
    let (left, right) = panel.split_at_mut(half * height);
    factor_below(left, height, top, diagonal)?;
    let below = top + half;
    subtract(Target { columns: right, height, skipped: below, onto: true }, left, height, below);
    factor_below(right, height, below, diagonal).map_err(|index| half + index)
}

/// Factors a few columns, one after the other; the result is the column whose pivot is not finite.
struct Narrow<'a> {
    panel: &'a mut [f32],
    height: usize,
    top: usize,
    diagonal: &'a [f32],
}

impl Work for Narrow<'_> {
    type Output = Option<usize>;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> Option<usize> {
        let Self { panel, height, top, diagonal } = self;
        for j in 0..panel.len() / height {
            let (before, rest) = panel.split_at_mut(j * height);
            let column = &mut rest[top + j..height];
            for done in before.chunks_exact(height) {
                let done = &done[top + j..];
                subtract_scaled(l, column, done, done[0]);
            }
            let (pivot, own) = (column[0], diagonal[top + j].abs());
            if !pivot.is_finite() {
                return Some(j);
            }
            if pivot <= LOST_PIVOT * own {
                column.fill(0.0);
                column[0] = own.max(f32::MIN_POSITIVE).sqrt();
                continue;
            }
            column[0] = pivot.sqrt();
            let scale = column[0].recip();
            let factor = l.splat_single(scale);
            let mut registers = column[1..].chunks_exact_mut(WIDTH);
            for c in &mut registers {
                store(l, l.mul_singles(load(l, c), factor), c);
            }
            for c in registers.into_remainder() {
                *c *= scale;
            }
        }
        None
    }
}

/// −L Lᵀ in the lower trapezoid of `update`, whose rows and columns are the rows of L from `first` on.
pub(super) fn set_product(update: &mut [f32], panel: &[f32], height: usize, first: usize) {
    let rows = height - first;
    if rows > 0 {
        subtract(Target { columns: update, height: rows, skipped: 0, onto: false }, panel, height, first);
    }
}

/// The columns that a product is subtracted from.
struct Target<'a> {
    columns: &'a mut [f32],
    height: usize,
    /// Row of the first column's diagonal entry.
    skipped: usize,
    /// Whether what the columns hold counts; zeros otherwise.
    onto: bool,
}

/// C − L Lᵀ in the lower trapezoid of C, whose diagonal begins at row `first` of the columns of L.
fn subtract(c: Target<'_>, l: &[f32], height: usize, first: usize) {
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

struct Product<'a> {
    c: Target<'a>,
    l: &'a [f32],
    height: usize,
    first: usize,
}

impl Work for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with<L: Lanes>(self, lanes: L) {
        let Self { c, l, height, first } = self;
        let (rows, columns) = (c.height - c.skipped, c.columns.len() / c.height);
        let (tile, depth) = (TILE_REGISTERS * WIDTH, l.len() / height);
        // Rows of L for the columns of C, by strips of a few, filled up with zeros.
        let mut strips = vec![0.0; columns.next_multiple_of(TILE_COLUMNS) * depth];
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
        let mut packed = vec![0.0; tile * depth];
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
fn copy_tile<L: Lanes>(l: L, to: &mut [f32], from: &[f32]) {
    if from.len() == to.len() {
        for r in 0..TILE_REGISTERS {
            store(l, load(l, &from[r * WIDTH..]), &mut to[r * WIDTH..]);
        }
    } else {
        to[..from.len()].copy_from_slice(from);
        to[from.len()..].fill(0.0);
    }
}

/// A tile of a product: `some` rows and columns from `row` on of columns of this height.
#[inline(always)]
fn multiply<L: Lanes>(
    l: L,
    (packed, strip): (&[f32], &[f32]),
    columns: &mut [f32],
    (height, row): (usize, usize),
    [rows, width]: [usize; 2],
    onto: bool,
) {
    let tile = TILE_REGISTERS * WIDTH;
    let mut sums = [[l.splat_single(0.0); TILE_REGISTERS]; TILE_COLUMNS];
    // As wide as the widest tile.
    let mut buffer = [0.0; 16];
    if onto {
        for (k, sum) in sums.iter_mut().enumerate().take(width) {
            copy_tile(l, &mut buffer[..tile], &columns[k * height + row..][..rows]);
            for (r, sum) in sum.iter_mut().enumerate() {
                *sum = load(l, &buffer[r * WIDTH..]);
            }
        }
    }
    for (a, b) in packed.chunks_exact(tile).zip(strip.chunks_exact(TILE_COLUMNS)) {
        let a: [L::Singles; TILE_REGISTERS] = std::array::from_fn(|r| load(l, &a[r * WIDTH..]));
        for k in 0..TILE_COLUMNS {
            let b = l.splat_single(b[k]);
            for r in 0..TILE_REGISTERS {
                sums[k][r] = l.sub_singles(sums[k][r], l.mul_singles(a[r], b));
            }
        }
    }
    for (k, sum) in sums.iter().enumerate().take(width) {
        let target = &mut columns[k * height + row..][..rows];
        let to = if rows == tile { &mut *target } else { &mut buffer[..] };
        for (r, sum) in sum.iter().enumerate() {
            store(l, *sum, &mut to[r * WIDTH..]);
        }
        if rows < tile {
            target.copy_from_slice(&buffer[..rows]);
        }
    }
}

/// The first numbers of a slice that holds enough for a register.
#[inline(always)]
fn load<L: Lanes>(l: L, from: &[f32]) -> L::Singles {
    l.load_singles(from.first_chunk().copied().unwrap_or_default())
}

/// Writes a register to the first numbers of a slice.
#[inline(always)]
fn store<L: Lanes>(l: L, a: L::Singles, to: &mut [f32]) {
    to[..WIDTH].copy_from_slice(&l.store_singles(a));
}

/// x ← x − share · l.
#[inline(always)]
fn subtract_scaled<L: Lanes>(l: L, x: &mut [f32], of: &[f32], share: f32) {
    let factor = l.splat_single(share);
    let of = &of[..x.len()];
    let (mut to, from) = (x.chunks_exact_mut(WIDTH), of.chunks_exact(WIDTH));
    let rest = from.remainder();
    for (x, of) in (&mut to).zip(from) {
        store(l, l.sub_singles(load(l, x), l.mul_singles(load(l, of), factor)), x);
    }
    for (x, of) in to.into_remainder().iter_mut().zip(rest) {
        *x -= *of * share;
    }
}

/// x ← L₁₁⁻¹ x; `rows` ← L₂₁ x.
pub(super) fn solve_down(panel: &[f32], height: usize, x: &mut [f32], rows: &mut Vec<f32>) {
    rows.clear();
    rows.resize(height - x.len(), 0.0);
    run(Down { panel, height, x, rows });
}

struct Down<'a> {
    panel: &'a [f32],
    height: usize,
    x: &'a mut [f32],
    rows: &'a mut [f32],
}

impl Work for Down<'_> {
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
pub(super) fn solve_up(panel: &[f32], height: usize, x: &mut [f32], rows: &[f32]) {
    run(Up { panel, height, x, rows });
}

struct Up<'a> {
    panel: &'a [f32],
    height: usize,
    x: &'a mut [f32],
    rows: &'a [f32],
}

impl Work for Up<'_> {
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
fn dot<L: Lanes>(l: L, a: &[f32], b: &[f32]) -> f32 {
    let b = &b[..a.len()];
    let (a, b) = (a.chunks_exact(2 * WIDTH), b.chunks_exact(2 * WIDTH));
    let rest = a.remainder().iter().zip(b.remainder());
    let mut sums = [l.splat_single(0.0); 2];
    for (a, b) in a.zip(b) {
        for (r, sum) in sums.iter_mut().enumerate() {
            *sum = l.add_singles(*sum, l.mul_singles(load(l, &a[r * WIDTH..]), load(l, &b[r * WIDTH..])));
        }
    }
    let mut parts = [0.0; 8];
    store(l, l.add_singles(sums[0], sums[1]), &mut parts);
    let mut total = 0.0;
    for (a, b) in rest {
        total += *a * *b;
    }
    for part in &parts[..WIDTH] {
        total += *part;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::simd::portable;

    /// A panel of a positive definite matrix with `columns` columns, and the matrix's lower entries as a function.
    fn panel(height: usize, columns: usize) -> (Vec<f32>, impl Fn(usize, usize) -> f64) {
        let entry = move |i: usize, j: usize| {
            let noise = ((i * 31 + j * 17) % 23) as f64 / 23.0 - 0.5;
            if i == j { height as f64 } else { noise }
        };
        ((0..columns).flat_map(|j| (0..height).map(move |i| entry(i, j) as f32)).collect(), entry)
    }

    /// a · b in double precision.
    fn exact(a: impl Iterator<Item = (f32, f32)>) -> f64 {
        a.map(|(a, b)| f64::from(a) * f64::from(b)).sum()
    }

    #[test]
    fn the_factor_times_its_transpose_is_the_matrix() {
        for (height, columns) in [(1, 1), (7, 3), (40, 40), (75, 33), (130, 100)] {
            let (mut l, entry) = panel(height, columns);
            factor_panel(&mut l, height, &vec![0.0; columns]).unwrap();
            // A sum of as many products as columns, none of them larger than the diagonal.
            let rounding = f64::from(f32::EPSILON) * (height * (columns + 1)) as f64;
            let at = |i: usize, j: usize| l[j * height + i];
            for (i, j) in (0..columns).flat_map(|j| (j..height).map(move |i| (i, j))) {
                let product = exact((0..=j).map(|k| (at(i, k), at(j, k))));
                assert!((product - entry(i, j)).abs() < rounding, "{height} {columns}: {i} {j}");
            }
            let rows = height - columns;
            let mut update = vec![f32::NAN; rows * rows];
            set_product(&mut update, &l, height, columns);
            for (i, j) in (0..rows).flat_map(|j| (j..rows).map(move |i| (i, j))) {
                let product = exact((0..columns).map(|k| (at(columns + i, k), at(columns + j, k))));
                assert!((f64::from(update[j * rows + i]) + product).abs() < rounding);
            }
            // L₁₁ L₁₁ᵀ x = b, and the rows below.
            let b: Vec<f32> = (0..columns).map(|i| (i % 5) as f32 - 1.7).collect();
            let (mut x, mut below) = (b.clone(), Vec::new());
            solve_down(&l, height, &mut x, &mut below);
            assert_eq!(below.len(), rows);
            for (i, below) in below.iter().enumerate() {
                let product = exact((0..columns).map(|k| (at(columns + i, k), x[k])));
                assert!((f64::from(*below) - product).abs() < rounding);
            }
            solve_up(&l, height, &mut x, &vec![0.0; rows]);
            for (i, b) in b.iter().enumerate() {
                let sum: f64 = (0..columns).map(|j| entry(i.max(j), i.min(j)) * f64::from(x[j])).sum();
                assert!((sum - f64::from(*b)).abs() < rounding, "{height} {columns}: {sum} and {b}");
            }
        }
    }

    #[test]
    fn a_pivot_that_is_not_positive_is_replaced_and_one_that_is_not_finite_named() {
        for bad in [0, 5, 20] {
            let (mut l, _) = panel(30, 25);
            l[bad * 30 + bad] = -1.0;
            factor_panel(&mut l, 30, &[30.0; 25]).unwrap();
            assert_eq!(l[bad * 30 + bad], 30_f32.sqrt());
            assert!(l[bad * 30 + bad + 1..(bad + 1) * 30].iter().all(|below| *below == 0.0));
        }
        let (mut l, _) = panel(30, 25);
        l[7 * 30 + 7] = f32::NAN;
        assert_eq!(factor_panel(&mut l, 30, &[30.0; 25]), Err(7));
    }

    #[test]
    fn pivots_of_a_singular_matrix_are_replaced_although_rounding_leaves_them_positive() {
        // G Gᵀ of a lower triangular G with fewer columns than the panel.
        let (height, columns, rank) = (60, 40, 25);
        let random = |i: usize, k: usize| ((i * 73 + k * 179 + i * k * 31) % 211) as f32 / 211.0 - 0.5;
        let at = |i: usize, k: usize| if i < k { 0.0 } else { random(i, k) + if i == k { 2.0 } else { 0.0 } };
        let entry = |i: usize, j: usize| (0..rank).map(|k| at(i, k) * at(j, k)).sum::<f32>();
        let mut l: Vec<f32> = (0..columns).flat_map(|j| (0..height).map(move |i| entry(i, j))).collect();
        let diagonal: Vec<f32> = (0..columns).map(|j| entry(j, j)).collect();
        factor_panel(&mut l, height, &diagonal).unwrap();
        for j in 0..columns {
            let column = &l[j * height + j..(j + 1) * height];
            let lost = column[0] == diagonal[j].sqrt() && column[1..].iter().all(|below| *below == 0.0);
            assert_eq!(lost, j >= rank, "{j}: {} of {}", column[0], diagonal[j].sqrt());
        }
    }

    /// Lanes of another width, and pieces for threads, give the same bits.
    #[test]
    fn the_bits_depend_on_neither_lanes_nor_pieces() {
        let all = || {
            let (height, columns) = (420, 230);
            let (mut l, _) = panel(height, columns);
            factor_panel(&mut l, height, &vec![0.0; columns]).unwrap();
            let mut update = vec![0.0; (height - columns).pow(2)];
            set_product(&mut update, &l, height, columns);
            let (mut x, mut rows) = (vec![0.3; columns], Vec::new());
            solve_down(&l, height, &mut x, &mut rows);
            solve_up(&l, height, &mut x, &rows);
            l.iter().chain(&update).chain(&x).map(|n| n.to_bits()).collect::<Vec<u32>>()
        };
        let widest = all();
        assert!(widest == portable(all));
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(all);
        assert!(widest == one_thread);
    }
}
