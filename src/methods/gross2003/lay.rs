//! Pieces laid on the bounding surfaces, all at once and without stretch.
//!
//! A piece is moved in the plane of its unrolled surface as a whole, by the turn and the shift that bring it nearest to where the
//! garment is worn: min Σ |R p + t − q|² over its vertices, p where they lie flat, q where the surface before the worn vertex
//! unrolls to (Procrustes in the plane, in closed form). Then it is rolled back, and no length on the cloth changes.
//!
//! Source: Groß, Fuhrmann, Luckas 2003, as far as told: laid isometrically, simultaneously. By what a piece finds its place is our
//! reading; theirs is told by feature points of body and piece.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::developable::Developable;
use super::pieces::{BodyPart, Piece};

/// Where a piece's vertices lie on the surface, m; `worn` is the garment as placed.
#[must_use]
pub(crate) fn laid(piece: &Piece, surface: &Developable, worn: &[DVec3]) -> Vec<DVec3> {
    let at = |v: &u32| worn[*v as usize];
    let mean = piece.vertices.iter().map(at).sum::<DVec3>() / piece.vertices.len().max(1) as f64;
    let middle = surface.sum_at(mean);
    let to: Vec<DVec2> = piece.vertices.iter().map(|v| surface.unrolled(at(v), middle)).collect();
    // A panel that the file draws from its wrong side is turned over first.
    let turned: Vec<DVec2> = piece.flat.iter().map(|p| DVec2::new(-p.x, p.y)).collect();
    let (own, over) = (moved(&piece.flat, &to), moved(&turned, &to));
    let off = |x: &[DVec2]| x.iter().zip(&to).map(|(x, to)| x.distance_squared(*to)).sum::<f64>();
    let best = if off(&own) <= off(&over) { own } else { over };
    best.into_iter().map(|p| surface.rolled(p, middle)).collect()
}

/// Points turned and shifted to be nearest to others.
fn moved(from: &[DVec2], to: &[DVec2]) -> Vec<DVec2> {
    let n = from.len().max(1) as f64;
    let mean = |points: &[DVec2]| points.iter().sum::<DVec2>() / n;
    let (a, b) = (mean(from), mean(to));
    let pairs = || from.iter().zip(to).map(|(p, q)| (*p - a, *q - b));
    let (cos, sin) = pairs().fold((0.0, 0.0), |(c, s), (p, q)| (c + p.dot(q), s + p.perp_dot(q)));
    let turn = DVec2::new(cos, sin).normalize_or(DVec2::X);
    from.iter().map(|p| b + turn.rotate(*p - a)).collect()
}

/// All pieces, each on its part's surface.
#[must_use]
pub fn all_laid(pieces: &[Piece], parts: &[BodyPart], surfaces: &[Developable], worn: &[DVec3]) -> Vec<Vec<DVec3>> {
    let surface = |number: usize| parts.iter().position(|part| part.pieces.contains(&number)).map(|i| &surfaces[i]);
    let own = |piece: &Piece| piece.vertices.iter().map(|&v| worn[v as usize]).collect();
    pieces
        .par_iter()
        .enumerate()
        .map(|(number, piece)| surface(number).map_or_else(|| own(piece), |s| laid(piece, s, worn)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_cut_from_a_cylinder_goes_back_to_where_it_was_worn() {
        let ring = |z: f64| {
            (0..360).map(move |k| DVec2::from_angle(f64::from(k).to_radians()).extend(0.0) * 0.15 + DVec3::Z * z)
        };
        let points: Vec<DVec3> = [0.0, 0.2, 0.4].into_iter().flat_map(ring).collect();
        let surface = Developable::around(&points, DVec3::Z, &points, 0.0).unwrap();
        let middle = surface.sum_at(DVec3::new(0.0, -1.0, 0.2));
        let flat: Vec<DVec2> = (0..40).map(|k| DVec2::new(0.01 * f64::from(k % 8), 0.05 * f64::from(k / 8))).collect();
        let worn: Vec<DVec3> = flat.iter().map(|p| surface.rolled(*p, middle)).collect();
        for turned_over in [false, true] {
            // Drawn turned, shifted, and perhaps from the wrong side.
            let drawn = flat.iter().map(|p| DVec2::from_angle(0.7).rotate(*p) + DVec2::new(3.0, -1.0));
            let drawn: Vec<DVec2> = drawn.map(|p| if turned_over { DVec2::new(-p.x, p.y) } else { p }).collect();
            let piece = Piece {
                name: String::new(),
                vertices: (0..40).collect(),
                flat: drawn,
                triangles: Vec::new(),
                of_garment: Vec::new(),
            };
            let found = laid(&piece, &surface, &worn);
            assert!(found.iter().zip(&worn).all(|(a, b)| a.distance(*b) < 1e-9));
        }
    }
}
