//! Principal values and directions of a symmetric 3×3 matrix, by Jacobi's rotations (Golub, Van Loan: "Matrix Computations", 8.5).

use glam::{DMat3, DVec3};

/// Eigenvalues and unit eigenvectors of a symmetric matrix, by Jacobi's rotations; three sweeps more than it ever takes.
pub(crate) fn principal(m: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let mut m = m.to_cols_array_2d();
    let mut v = [DVec3::X, DVec3::Y, DVec3::Z];
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = t.hypot(1.0).recip();
            let s = t * c;
            for row in &mut m {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (a, b) = (m[p], m[q]);
            m[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
            m[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
            (v[p], v[q]) = (v[p] * c - v[q] * s, v[p] * s + v[q] * c);
        }
    }
    ([m[0][0], m[1][1], m[2][2]], v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::outer;

    #[test]
    fn a_matrix_is_put_together_again_from_its_principal_values() {
        let m = DMat3::from_cols(DVec3::new(2.0, -1.0, 0.3), DVec3::new(-1.0, 1.5, 0.7), DVec3::new(0.3, 0.7, -0.4));
        let (values, vectors) = principal(m);
        let again = (0..3).fold(DMat3::ZERO, |sum, k| {
            let v = vectors[k];
            sum + outer(v, v) * values[k]
        });
        assert!((again - m).to_cols_array().iter().all(|d| d.abs() < 1e-12), "{again}");
    }
}
