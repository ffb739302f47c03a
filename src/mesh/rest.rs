//! The rest shape of a garment: the shape of each triangle when it was cut from the cloth.
//!
//! Strain is measured against it (design: own edges, a second mesh, or the pattern in the texture coordinates). Each
//! triangle is kept by itself, in the plane of its cloth, since a garment as a whole does not lie flat: x runs along
//! the weft, y along the warp. Where only the shape in space is known, the warp is taken to run with gravity, as
//! patterns are cut: y is the projection of the upward direction into the triangle, x = y × n.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | corners | corners of a triangle in its flat frame | m |
//! | s | metres per unit of the texture coordinates | m |
//!
//! Limits: a triangle that lies flat (normal within 1e-6 of the vertical) has no projection of the upward direction; the second
//! horizontal axis stands in. Texture coordinates that mirror a piece are mirrored back, triangle by triangle.

use glam::{DVec2, DVec3};

use super::TriMesh;

/// A triangle whose height is less than this share of its longest edge has no usable shape: with f64 corners its
/// strain would be rounding noise.
const FLAT: f64 = 1e-6;
/// A triangle whose height is less than this share of its longest side is a sliver, and bears loads as if it were that high: less
/// than half a millimetre in a mesh of 2 cm.
pub(crate) const SLIVER: f64 = 0.02;
/// Texture coordinates are taken as metric if they hold between a quarter of and four times the area in space: cloth
/// placed undraped is off by tens of percent, a 0-to-1 atlas by orders of magnitude.
const METRIC_AREA_RATIO: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// Errors of a rest shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum RestError {
    /// A triangle without shape.
    #[error(
        "{count} triangles of the rest shape have no area, the first is number {}: expected triangles \
         with an area; repair the mesh, or take another rest shape",
        first + 1
    )]
    NoArea { count: usize, first: usize },
    /// Corners without texture coordinates.
    #[error(
        "{count} of {of} triangles have no texture coordinates, so they hold no pattern; expected one at every corner; \
         take the rest shape from the edges instead"
    )]
    NoTexture { count: usize, of: usize },
    /// Texture coordinates of some other scale.
    #[error(
        "the texture coordinates are no metric pattern: with {metres_per_unit} m a unit they hold {ratio:.3e} times the \
         garment's area, expected 0.25 to 4; name their unit, or take the rest shape from the edges"
    )]
    NotMetric { metres_per_unit: f64, ratio: f64 },
}

/// Each triangle's corners in its own flat frame, m: x along the weft, y along the warp, counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct RestShape {
    /// Corners of each triangle, in the order of the mesh's triangles and of their corners, m.
    pub corners: Vec<[DVec2; 3]>,
    /// Index of the fabric that each triangle is cut from; empty if all are cut from the first.
    pub cut_from: Vec<u16>,
    /// Whether the shape of each triangle is a guess (`mesh::bridges`); empty if none is.
    pub guessed: Vec<bool>,
}

impl RestShape {
    /// Triangles of these corners (m), all cut from one fabric.
    pub(crate) fn new(corners: Vec<[DVec2; 3]>) -> Self {
        Self { corners, cut_from: Vec::new(), guessed: Vec::new() }
    }

    /// Index of the fabric that a triangle is cut from.
    #[must_use]
    pub fn fabric_of(&self, triangle: usize) -> usize {
        self.cut_from.get(triangle).map_or(0, |&fabric| fabric.into())
    }

    /// Whether the shape of a triangle is a guess.
    pub(crate) fn is_guessed(&self, triangle: usize) -> bool {
        self.guessed.get(triangle).copied().unwrap_or(false)
    }

    /// The mesh as it stands, at rest: own edges, warp along gravity.
    pub fn from_edges(mesh: &TriMesh) -> Result<Self, RestError> {
        Self::edges_of(mesh).checked()
    }

    /// [`from_edges`](Self::from_edges) without the check for area.
    pub(crate) fn edges_of(mesh: &TriMesh) -> Self {
        Self::new((0..mesh.triangles.len()).map(|t| flatten(mesh.corners(t))).collect())
    }

    /// The pattern in the texture coordinates of each triangle corner, u along the weft and v along the warp;
    /// `None` for a triangle without. `metres_per_unit` is the length of one unit of them, m.
    ///
    /// # Errors
    /// [`RestError::NoTexture`], [`RestError::NoArea`], [`RestError::NotMetric`] where the pattern's area is far
    /// from the garment's.
    pub fn from_texture(
        mesh: &TriMesh,
        texture: &[Option<[DVec2; 3]>],
        metres_per_unit: f64,
    ) -> Result<Self, RestError> {
        Self::texture_of(mesh, texture, metres_per_unit)?.checked()
    }

    /// [`from_texture`](Self::from_texture) without the check for area.
    pub(crate) fn texture_of(
        mesh: &TriMesh,
        texture: &[Option<[DVec2; 3]>],
        metres_per_unit: f64,
    ) -> Result<Self, RestError> {
        let of = mesh.triangles.len();
        let known = texture.iter().take(of).filter(|corners| corners.is_some()).count();
        if known < of {
            return Err(RestError::NoTexture { count: of - known, of });
        }
        let corners = texture.iter().take(of).flatten().map(|corners| {
            let [a, b, c] = corners.map(|p| p * metres_per_unit);
            let mirrored = (b - a).perp_dot(c - a) < 0.0;
            [a, b, c].map(|p| if mirrored { DVec2::new(-p.x, p.y) } else { p })
        });
        let rest = Self::new(corners.collect());
        let ratio = rest.areas().iter().sum::<f64>() / mesh.triangle_areas().iter().sum::<f64>();
        if !METRIC_AREA_RATIO.contains(&ratio) {
            return Err(RestError::NotMetric { metres_per_unit, ratio });
        }
        Ok(rest)
    }

    /// Rest area of each triangle, m².
    #[must_use]
    pub fn areas(&self) -> Vec<f64> {
        self.corners.iter().map(|[a, b, c]| 0.5 * (b - a).perp_dot(c - a)).collect()
    }

    /// Whether each triangle is without area.
    pub(crate) fn without_area(&self) -> Vec<bool> {
        let flat = |&[a, b, c]: &[DVec2; 3]| {
            let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            let area = (b - a).perp_dot(c - a);
            area.is_nan() || area <= FLAT * longest
        };
        self.corners.iter().map(flat).collect()
    }

    /// Number of slivers.
    pub(crate) fn slivers(&self) -> usize {
        self.corners.iter().filter(|corners| raised(**corners).0).count()
    }

    pub(crate) fn checked(self) -> Result<Self, RestError> {
        let flat = self.without_area();
        match flat.iter().position(|&flat| flat) {
            Some(first) => Err(RestError::NoArea { count: flat.iter().filter(|&&flat| flat).count(), first }),
            None => Ok(self),
        }
    }
}

/// Whether a triangle is a sliver, and its corners; those of a sliver are raised to a fiftieth of its longest side, which lies along
/// the weft.
pub(crate) fn raised(rest: [DVec2; 3]) -> (bool, [DVec2; 3]) {
    let sides = [0, 1, 2].map(|i| rest[(i + 1) % 3].distance(rest[i]));
    let i = (0..3).fold(0, |longest, i| if sides[i] > sides[longest] { i } else { longest });
    let [a, b, c] = [0, 1, 2].map(|k| rest[(i + k) % 3]);
    let double = (b - a).perp_dot(c - a);
    if double.abs() >= SLIVER * sides[i] * sides[i] {
        return (false, rest);
    }
    let foot = (c - a).dot((b - a) / sides[i]);
    let mut higher = [DVec2::ZERO; 3];
    higher[(i + 1) % 3] = DVec2::new(sides[i], 0.0);
    higher[(i + 2) % 3] = DVec2::new(foot, SLIVER * sides[i] * double.signum());
    (true, higher)
}

/// A triangle in its plane, its first corner at the origin, y along the upward direction.
fn flatten([a, b, c]: [DVec3; 3]) -> [DVec2; 3] {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let along = |up: DVec3| (up - up.dot(normal) * normal).try_normalize().filter(|_| normal.cross(up).length() > 1e-6);
    let Some(y) = along(DVec3::Z).or_else(|| along(DVec3::Y)) else { return [DVec2::ZERO; 3] };
    let x = y.cross(normal);
    [a, b, c].map(|p| DVec2::new((p - a).dot(x), (p - a).dot(y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64) -> TriMesh {
        // In the xz plane, seen from -y: x to the right, z up.
        let p = |x: f64, z: f64| DVec3::new(side * x, 0.0, side * z);
        TriMesh::new(vec![p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0)], vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn the_warp_runs_up_and_the_weft_to_the_right() {
        let rest = RestShape::from_edges(&square(2.0)).unwrap();
        assert_eq!(rest.corners[0], [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(2.0, 2.0)]);
        assert_eq!(rest.areas(), [2.0, 2.0]);
    }

    #[test]
    fn lengths_and_sides_survive_in_any_position() {
        let corners = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.5, -0.1, 0.4), DVec3::new(0.3, 0.4, 0.9)];
        let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        let [a, b, c] = RestShape::from_edges(&mesh).unwrap().corners[0];
        for ((i, j), (p, q)) in [((0, 1), (a, b)), ((1, 2), (b, c)), ((2, 0), (c, a))] {
            assert!(((corners[i] - corners[j]).length() - (p - q).length()).abs() < 1e-15);
        }
        assert!((b - a).perp_dot(c - a) > 0.0);
        let lying = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
        assert_eq!(RestShape::from_edges(&lying).unwrap().corners[0], [DVec2::ZERO, DVec2::X, DVec2::Y]);
    }

    #[test]
    fn texture_coordinates_are_the_pattern_where_they_are_metric() {
        let mesh = square(1.0);
        let texture = |t: &[u32; 3]| t.map(|v| DVec2::new(mesh.positions[v as usize].x, mesh.positions[v as usize].z));
        // In centimetres, the second triangle mirrored.
        let mut corners: Vec<_> = mesh.triangles.iter().map(|t| Some(texture(t).map(|p| 110.0 * p))).collect();
        corners[1] = corners[1].map(|c| c.map(|p| DVec2::new(-p.x, p.y)));
        let rest = RestShape::from_texture(&mesh, &corners, 0.01).unwrap();
        assert!(rest.areas().iter().all(|a| (a - 0.605).abs() < 1e-12), "{:?}", rest.areas());
        let atlas = RestShape::from_texture(&mesh, &corners, 1e-4).unwrap_err();
        assert!(matches!(atlas, RestError::NotMetric { .. }), "{atlas}");
        corners[0] = None;
        assert_eq!(RestShape::from_texture(&mesh, &corners, 0.01), Err(RestError::NoTexture { count: 1, of: 2 }));
    }

    #[test]
    fn triangles_without_area_are_refused() {
        let mut flat = square(1.0);
        flat.positions[3] = flat.positions[2];
        assert_eq!(RestShape::from_edges(&flat), Err(RestError::NoArea { count: 1, first: 1 }));
        flat.positions[3] = DVec3::NAN;
        assert_eq!(RestShape::from_edges(&flat), Err(RestError::NoArea { count: 1, first: 1 }));
    }
}
