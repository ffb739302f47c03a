//! Closing of seams by as-rigid-as-possible steps: from panels placed around the body to a garment on it.
//!
//! A sewn mesh has one vertex for both sides of a seam, at the mean of two positions that may be half a metre apart. The cloth
//! regains its shape by as-rigid-as-possible steps (Sorkine, Alexa: "As-rigid-as-possible surface modeling", SGP 2007; its
//! planar form by Liu, Zhang, Xu, Gotsman, Gortler, SGP 2008). With F_t the 3×2 map from the flat triangle t to its position,
//!
//! E = Σ_t A_t |F_t − R_t|² + Σ_c w |x_c − y_c|² + Σ_i m |x_i − x'_i|²
//!
//! is minimised in turn over R_t and over x (a sparse solve with three right-hand sides). R_t is the isometry nearest to F_t by a
//! polar decomposition; where triangles resist compression by a share c alone, R_t keeps 1 − c of it. A vertex nearer to the body than the
//! gap is attracted to y_c, the point at the gap above its nearest body point, and is free again once the cloth pulls it away. No vertex moves farther in a step than a limb is thick,
//! so that none passes through one. There is no friction and no bending. Gravity acts only on a skirt that hangs from its held
//! waist (− Σ γ A_i z_i, added to E). The result is a placement, not a drape.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A_t | rest area | m² |
//! | w | weight of a contact, [`CONTACT`] | – |
//! | c | resistance to compression, as a share of that to stretch | – |
//! | m | weight of the proximal term, [`PROXIMAL`], for vertices that nothing else fixes | – |
//! | x' | positions before the step | m |
//! | γ | weight over stiffness, [`HANGING`] | 1/m |
//!
//! Source: the two papers; contacts are ours. Limits: cloth may pass through cloth.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, LltRef, SymbolicCholesky, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, Mat, Par, Side};
use glam::{DMat2, DVec2, DVec3};

use crate::body::distance::Body;
use crate::mesh::{RestShape, TriMesh};

/// w. A vertex's own weight is about 3.5, so a step closes most of the gap and cloth still slides along the body. A heuristic.
const CONTACT: f64 = 3.0;

/// m. A heuristic, small enough not to slow the steps.
const PROXIMAL: f64 = 1e-3;

/// Largest displacement of a vertex in one step, m; a wrist is 5 cm thick.
const MAX_STEP: f64 = 0.02;

/// γ, 1/m: half a metre of hanging cloth stretches by a fortieth.
const HANGING: f64 = 0.1;

/// Proximal weight of vertices that keep their places.
const HELD: f64 = 1e3;

/// Most steps of [`laid_flat`], and the displacement, m, at which they end.
const MAX_FLATTENING_STEPS: usize = 100;
const FLAT_CONVERGED: f64 = 2e-5;

/// Vertices whose place or height is kept while seams close.
#[derive(Debug, Clone, Copy)]
pub(super) enum Hold<'a> {
    /// None.
    Nothing,
    /// These vertices do not sink.
    Height(&'a [u32]),
    /// These vertices keep their places, and the others hang.
    Place(&'a [u32]),
}

impl<'a> Hold<'a> {
    /// The vertices.
    pub(super) fn vertices(self) -> &'a [u32] {
        match self {
            Self::Nothing => &[],
            Self::Height(vertices) | Self::Place(vertices) => vertices,
        }
    }
}

/// Options of [`close`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Closing<'a> {
    /// Vertices that keep their place or height.
    pub(super) hold: Hold<'a>,
    /// Share of its resistance that a triangle has against compression.
    pub(super) compression: f64,
    /// Distance kept from the body, m.
    pub(super) gap: f64,
    /// Most steps.
    pub(super) max_steps: usize,
    /// Steps end when no vertex moves farther, m.
    pub(super) converged: f64,
}

/// The constant part of the problem: triangles, gradients and the matrix.
struct System {
    triangles: Vec<[u32; 3]>,
    /// Weights of the corners in the two columns of F.
    gradients: Vec<[DVec2; 3]>,
    areas: Vec<f64>,
    /// Lower half of Σ A ∇ᵀ∇, sorted by column.
    entries: Vec<Triplet<u32, u32, f64>>,
}

impl System {
    fn new(mesh: &TriMesh, rest: &RestShape, held: &[u32]) -> Self {
        let (mut gradients, mut areas) = (Vec::new(), Vec::new());
        let mut terms: Vec<((u32, u32), f64)> = (0..mesh.vertex_count() as u32).map(|v| ((v, v), PROXIMAL)).collect();
        for (triangle, &[a, b, c]) in mesh.triangles.iter().zip(&rest.corners) {
            let inverse = DMat2::from_cols(b - a, c - a).inverse();
            let (of_b, of_c) = (inverse.row(0), inverse.row(1));
            let of = [-of_b - of_c, of_b, of_c];
            let area = 0.5 * (b - a).perp_dot(c - a);
            for i in 0..3 {
                for j in 0..3 {
                    if triangle[i] >= triangle[j] {
                        terms.push(((triangle[j], triangle[i]), area * of[i].dot(of[j])));
                    }
                }
            }
            gradients.push(of);
            areas.push(area);
        }
        terms.extend(held.iter().map(|&v| ((v, v), HELD)));
        // A stable sort keeps the order of the sums.
        terms.sort_by_key(|term| term.0);
        let mut entries: Vec<Triplet<u32, u32, f64>> = Vec::new();
        for ((column, row), value) in terms {
            match entries.last_mut() {
                Some(last) if (last.col, last.row) == (column, row) => last.val += value,
                _ => entries.push(Triplet::new(row, column, value)),
            }
        }
        Self { triangles: mesh.triangles.clone(), gradients, areas, entries }
    }

    /// Adds gravity.
    fn hang(&self, side: &mut [DVec3]) {
        for (triangle, area) in self.triangles.iter().zip(&self.areas) {
            triangle.iter().for_each(|&v| side[v as usize].z -= HANGING * area / 3.0);
        }
    }

    /// Right-hand side: Σ A ∇ᵀ R + m x'.
    fn right_side(&self, x: &[DVec3], nearest: impl Fn(DVec3, DVec3) -> [DVec3; 2]) -> Vec<DVec3> {
        let mut side: Vec<DVec3> = x.iter().map(|x| PROXIMAL * *x).collect();
        for ((triangle, of), area) in self.triangles.iter().zip(&self.gradients).zip(&self.areas) {
            let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
            for (&i, of) in triangle.iter().zip(of) {
                u += x[i as usize] * of.x;
                v += x[i as usize] * of.y;
            }
            let [u, v] = nearest(u, v);
            for (&i, of) in triangle.iter().zip(of) {
                side[i as usize] += *area * (u * of.x + v * of.y);
            }
        }
        side
    }
}

/// R S' of F = R S: the singular values of S' are 1 for stretches, and 1 − (1 − c) (1 − s) for a compression s.
fn nearest_in_space(u: DVec3, v: DVec3, compression: f64) -> [DVec3; 2] {
    let (a, b, c) = (u.dot(u), u.dot(v), v.dot(v));
    // Eigenvalues of S² = FᵀF, and its eigenvectors by half the angle of their axes.
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = (half * half + b * b).sqrt();
    let ratio = |square: f64| {
        let s = square.max(0.0).sqrt();
        if s > 1.0 { 1.0 / s } else { 1.0 + compression * (1.0 - s) / s.max(1e-9) }
    };
    let (p, q) = (ratio(mean + radius), ratio(mean - radius));
    let (cos, sin) = if radius > 0.0 { (half / radius, b / radius) } else { (1.0, 0.0) };
    let (middle, spread) = (0.5 * (p + q), 0.5 * (p - q));
    let (xx, xy, yy) = (middle + spread * cos, spread * sin, middle - spread * cos);
    [u * xx + v * xy, u * xy + v * yy]
}

/// Closes the seams of a garment at `start` (m); returns the positions and the number of steps.
pub(super) fn close(
    mesh: &TriMesh,
    rest: &RestShape,
    body: &Body,
    start: &[DVec3],
    options: Closing<'_>,
) -> (Vec<DVec3>, usize) {
    let n = start.len();
    let (held, hangs) = (options.hold.vertices(), matches!(options.hold, Hold::Place(_)));
    let placed = if hangs { held } else { &[] };
    let mut system = System::new(mesh, rest, placed);
    let diagonal: Vec<usize> =
        (system.entries.iter().enumerate()).filter(|(_, e)| e.row == e.col).map(|(i, _)| i).collect();
    let own: Vec<f64> = diagonal.iter().map(|&i| system.entries[i].val).collect();
    let mut x = start.to_vec();
    let mut symbolic: Option<SymbolicCholesky<u32>> = None;
    for step in 0..options.max_steps {
        let mut side = system.right_side(&x, |u, v| nearest_in_space(u, v, options.compression));
        placed.iter().for_each(|&v| side[v as usize] += HELD * x[v as usize]);
        if hangs {
            system.hang(&mut side);
        }
        for (v, near) in body.nearest_all(&x).iter().enumerate() {
            let touches = near.signed_distance < options.gap;
            system.entries[diagonal[v]].val = own[v] + if touches { CONTACT } else { 0.0 };
            if touches {
                side[v] += CONTACT * (near.point + options.gap * near.normal);
            }
        }
        let Some(solved) = solve(&system.entries, n, &side, &mut symbolic) else { return (x, step) };
        let before = x.clone();
        for (x, to) in x.iter_mut().zip(solved) {
            *x += (to - *x).clamp_length_max(MAX_STEP);
        }
        held.iter().map(|&v| v as usize).for_each(|v| x[v].z = x[v].z.max(start[v].z));
        let farthest = x.iter().zip(&before).map(|(x, before)| x.distance(*before)).fold(0.0, f64::max);
        if farthest < options.converged {
            return (x, step + 1);
        }
    }
    (x, options.max_steps)
}

/// A surface flattened as isometrically as possible: E without contacts, from positions in the plane z = 0 (m), with the nearest
/// rotations in the plane for R, which unfold triangles that the start has inverted.
pub(crate) fn laid_flat(mesh: &TriMesh, rest: &RestShape, start: &[DVec3]) -> Vec<DVec3> {
    let system = System::new(mesh, rest, &[]);
    let mut x = start.to_vec();
    let mut symbolic = None;
    for _ in 0..MAX_FLATTENING_STEPS {
        let side = system.right_side(&x, nearest_rotation);
        let Some(next) = solve(&system.entries, x.len(), &side, &mut symbolic) else { return x };
        let farthest = x.iter().zip(&next).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        x = next;
        if farthest < FLAT_CONVERGED {
            break;
        }
    }
    x
}

/// The rotation in the plane nearest to F: its angle is that of (tr F, F₂₁ − F₁₂).
fn nearest_rotation(u: DVec3, v: DVec3) -> [DVec3; 2] {
    let turn = DVec2::new(u.x + v.y, u.y - v.x).normalize_or(DVec2::X);
    [turn.extend(0.0), turn.perp().extend(0.0)]
}

/// A smoothed surface: (M + ℓ² L) y = M x, one implicit step of the heat equation, with areas M and stiffness L of the rest
/// shape. Waves shorter than ℓ (m) are damped.
pub(super) fn faired(mesh: &TriMesh, rest: &RestShape, x: &[DVec3], length: f64) -> Vec<DVec3> {
    let mut system = System::new(mesh, rest, &[]);
    let mut mass = vec![0.0; x.len()];
    for (triangle, area) in mesh.triangles.iter().zip(&system.areas) {
        triangle.iter().for_each(|&v| mass[v as usize] += area / (3.0 * length * length));
    }
    let diagonal = system.entries.iter_mut().filter(|e| e.row == e.col);
    diagonal.zip(&mass).for_each(|(entry, mass)| entry.val += mass);
    let side: Vec<DVec3> = x.iter().zip(&mass).map(|(x, mass)| (PROXIMAL + mass) * *x).collect();
    solve(&system.entries, x.len(), &side, &mut None).unwrap_or_else(|| x.to_vec())
}

/// Three functions over the rest shape that are harmonic up to the small proximal term, with these values at some vertices; `None` where the
/// system cannot be factorised.
pub(super) fn harmonic(mesh: &TriMesh, rest: &RestShape, values: &[(u32, DVec3)]) -> Option<Vec<DVec3>> {
    let held: Vec<u32> = values.iter().map(|(v, _)| *v).collect();
    let system = System::new(mesh, rest, &held);
    let mut side = vec![DVec3::ZERO; mesh.vertex_count()];
    values.iter().for_each(|&(v, value)| side[v as usize] = HELD * value);
    solve(&system.entries, side.len(), &side, &mut None)
}

/// One solve with three right-hand sides; `None` where the matrix is not positive definite.
fn solve(
    entries: &[Triplet<u32, u32, f64>],
    n: usize,
    side: &[DVec3],
    symbolic: &mut Option<SymbolicCholesky<u32>>,
) -> Option<Vec<DVec3>> {
    let matrix = SparseColMat::<u32, f64>::try_new_from_triplets(n, n, entries).ok()?;
    let symbolic = match symbolic {
        Some(symbolic) => symbolic,
        // Column by column: the dense kernels of supernodes depend on the processor, and so do their bits.
        None => {
            let supernodal_flop_ratio_threshold = SupernodalThreshold::FORCE_SIMPLICIAL;
            let params = CholeskySymbolicParams { supernodal_flop_ratio_threshold, ..Default::default() };
            let analysed =
                factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, Default::default(), params).ok()?;
            symbolic.insert(analysed)
        }
    };
    let needs = [
        symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        symbolic.solve_in_place_scratch::<f64>(3, Par::Seq),
    ];
    let mut memory = MemBuffer::try_new(StackReq::any_of(&needs)).ok()?;
    let memory = MemStack::new(&mut memory);
    let mut numbers = vec![0.0; symbolic.len_val()];
    let of = (matrix.as_ref(), Side::Lower);
    symbolic
        .factorize_numeric_llt(&mut numbers, of.0, of.1, Default::default(), Par::Seq, memory, Default::default())
        .ok()?;
    let mut solved = Mat::from_fn(n, 3, |i, k| side[i][k]);
    LltRef::new(symbolic, &numbers).solve_in_place_with_conj(Conj::No, solved.as_mut(), Par::Seq, memory);
    Some((0..n).map(|i| DVec3::new(solved[(i, 0)], solved[(i, 1)], solved[(i, 2)])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    #[test]
    fn a_strip_of_a_cylinder_is_flattened_without_strain() {
        // A third of a cylinder of 10 cm, as the eye sees it from the front, a few triangles turned over.
        let flat = sheet(12, 8, |i, j| DVec3::new(0.2 * (i / 12.0 - 0.5), 0.02 * j, 0.0));
        let rest = RestShape::new((0..flat.triangles.len()).map(|t| flat.corners(t).map(DVec3::truncate)).collect());
        let around = |p: &DVec3| DVec3::new(0.1 * (p.x / 0.1).sin(), -0.1 * (p.x / 0.1).cos(), p.y);
        let mesh = flat.with_positions(flat.positions.iter().map(around).collect());
        let mut seen: Vec<DVec3> = mesh.positions.iter().map(|p| DVec3::new(p.x, p.z, 0.0)).collect();
        seen.swap(30, 31);
        let flat = laid_flat(&mesh, &rest, &seen);
        for (t, own) in mesh.triangles.iter().zip(&rest.corners) {
            for k in 0..3 {
                let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
                let off = flat[a].distance(flat[b]) / own[k].distance(own[(k + 1) % 3]) - 1.0;
                assert!(off.abs() < 2e-3, "{off}");
            }
        }
    }

    #[test]
    fn stretches_are_taken_back_and_compressions_by_a_share() {
        let turned = [DVec3::new(0.0, 0.6, 0.8), DVec3::new(1.0, 0.0, 0.0)];
        let with = |s: [[f64; 2]; 2], c: f64| {
            let [u, v] = [0, 1].map(|k| turned[0] * s[0][k] + turned[1] * s[1][k]);
            nearest_in_space(u, v, c)
        };
        let is = |[u, v]: [DVec3; 2], s: [[f64; 2]; 2]| {
            let [p, q] = [0, 1].map(|k| turned[0] * s[0][k] + turned[1] * s[1][k]);
            assert!((u - p).length() + (v - q).length() < 1e-12, "{u} {v}");
        };
        let one = [[1.0, 0.0], [0.0, 1.0]];
        is(with(one, 0.1), one);
        is(with([[1.3, 0.2], [0.2, 1.4]], 0.1), one);
        is(with([[1.7, 0.0], [0.0, 0.5]], 0.1), [[1.0, 0.0], [0.0, 0.55]]);
        is(with([[1.3, 0.2], [0.2, 0.4]], 1.0), one);
        // Stretched along one diagonal and compressed along the other.
        is(with([[0.85, 0.35], [0.35, 0.85]], 0.1), [[0.775, 0.225], [0.225, 0.775]]);
        assert!(nearest_in_space(DVec3::X, DVec3::X, 1.0).iter().all(|c| c.is_finite()));
    }
}
