//! Garments that are tubes, such as skirts, hung around the trunk: the start from which their seams are closed.
//!
//! The panels of a skirt stand before and behind the body, a wide one's up to the shoulders and through each other and the hands. A garment with
//! two edges and no shoulders needs no such start. It is put around the trunk by two coordinates over its rest shape:
//!
//! s with Δs = 0, s = 0 on the top edge, 1 on the hem; θ = arg(c − mean of c over the hem) with Δc = 0, c = e^(iθ) on the top edge,
//!
//! at a height D s below the top edge, in the direction θ on the convex hull of the trunk's curves between. Where θ and s are monotone, the
//! start does not intersect itself. Where the garment is wider than the trunk it is laid in regular folds ([`waves`](super::waves)), as wide at the top edge as
//! [`FOLD_WIDTH_M`]; its girth grows evenly from one edge to the other.
//!
//! c decreases towards the hem while its mean does not; without subtracting the mean, θ would be nearly constant at the hem of a long garment.
//!
//! **The top edge** lies at the height nearest to its own where its length spans the trunk's tape girth, or at the waist where it spans none,
//! outside the hull by
//!
//! d = max((C − G) / 2π, gap),
//!
//! since a convex curve moved outwards by d grows by 2πd. Its vertices keep their distances along the edge, but for one common factor,
//! and it is turned so that they move least.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s, θ | share of the way from the top edge to the hem, and direction from the middle of the trunk | –, rad |
//! | D | area over the mean of both edges' lengths | m |
//! | C | length of the top edge at rest | m |
//! | G | tape girth of the trunk there | m |
//! | d | distance from the hull | m |
//!
//! Source: own; harmonic coordinates as in the parametrisation of surfaces (Floater, Hormann: "Surface parameterization: a tutorial and survey",
//! 2005). Limits: the top edge lies in a plane until the drape is released. θ need not be monotone, as c comes from a mesh and only its mean over the
//! hem is subtracted; a function θ with a jump of 2π across a cut would be. A garment whose top edge does
//! not run around the trunk once is not hung.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::arap::harmonic;
use super::landmarks::Landmarks;
use super::waves::Waves;
use crate::base::math;
use crate::body::girth::{hull, perimeter};
use crate::mesh::{RestShape, Topology, TriMesh};

/// Turns of the edge that are tried: a millimetre apart.
const TURNS: usize = 1000;

/// Width of a fold at the top edge, m. Steps at full resolution of a skirt of one and a half circles (26,000 vertices) and of an asymmetric
/// circle skirt in knit: 15 and 6; with 4 cm 28 and 48; with 12 cm no rest in 130 s, and 22. Without folds 122 and 8.
const FOLD_WIDTH_M: f64 = 0.06;

/// A closed curve by its corners, with the length up to each.
struct Curve {
    corners: Vec<DVec2>,
    ends: Vec<f64>,
}

impl Curve {
    /// A convex `hull`, counter-clockwise, moved outwards by `distance` (m); each corner is cut by a chord.
    fn about(hull: &[DVec2], distance: f64) -> Self {
        let mut corners = Vec::with_capacity(2 * hull.len());
        for (i, &a) in hull.iter().enumerate() {
            let b = hull[(i + 1) % hull.len()];
            // Counter-clockwise, so the outside is on the right.
            let out = distance * (a - b).perp().normalize_or_zero();
            corners.extend([a + out, b + out]);
        }
        let mut ends = Vec::with_capacity(corners.len());
        let mut length = 0.0;
        for (i, a) in corners.iter().enumerate() {
            length += a.distance(corners[(i + 1) % corners.len()]);
            ends.push(length);
        }
        Self { corners, ends }
    }

    fn length(&self) -> f64 {
        self.ends.last().copied().unwrap_or_default()
    }

    /// The point at a share of the length, counter-clockwise.
    fn at(&self, share: f64) -> DVec2 {
        let along = share.rem_euclid(1.0) * self.length();
        let side = self.ends.partition_point(|end| *end <= along).min(self.corners.len() - 1);
        let from = if side == 0 { 0.0 } else { self.ends[side - 1] };
        let [a, b] = [side, (side + 1) % self.corners.len()].map(|i| self.corners[i]);
        a.lerp(b, ((along - from) / (self.ends[side] - from).max(f64::MIN_POSITIVE)).min(1.0))
    }

    /// The point in a direction from `middle`, which is inside.
    fn towards(&self, middle: DVec2, direction: DVec2) -> DVec2 {
        let ahead = |side: usize| {
            let [a, b] = [side, (side + 1) % self.corners.len()].map(|i| self.corners[i] - middle);
            let [from, to] = [direction.perp_dot(a), direction.perp_dot(b)];
            (from <= 0.0 && to > 0.0).then(|| middle + a.lerp(b, from / (from - to)))
        };
        (0..self.corners.len()).find_map(ahead).unwrap_or(middle)
    }
}

/// Positions (m) of a tube hung around `body` from its top edge `top`, at least `gap` (m) from the trunk; `None` for a garment that is no
/// tube, or whose top edge does not run around the trunk once.
pub(super) fn hung_around(
    mesh: &TriMesh,
    rest: &RestShape,
    top: &[u32],
    body: &TriMesh,
    landmarks: &Landmarks,
    gap: f64,
) -> Option<Vec<DVec3>> {
    let hem = other_edge(mesh, top)?;
    let ends = [top, &hem[..]].map(|edge| lengths_along(mesh, rest, edge));
    let [of_top, of_hem] = ends.each_ref().map(|ends| ends.last().copied().unwrap_or_default());
    let placed: Vec<DVec3> = top.iter().map(|&v| mesh.positions[v as usize]).collect();
    let (z, hull) = fitting(body, landmarks, of_top, placed.iter().map(|x| x.z).sum::<f64>() / placed.len() as f64)?;
    let outwards = ((of_top - perimeter(&hull)) / TAU).max(gap);
    let laid = laid(&placed, &ends[0], &Curve::about(&hull, outwards), landmarks.middle)?;
    let laid: Vec<DVec3> = laid.iter().map(|x| x.extend(z)).collect();
    let of_edge = |edge: &[u32], s: f64| edge.iter().map(|&v| (v, DVec3::splat(s))).collect::<Vec<_>>();
    let shares = harmonic(mesh, rest, &[of_edge(top, 0.0), of_edge(&hem, 1.0)].concat())?;
    let shares: Vec<f64> = shares.iter().map(|s| s.x).collect();
    Tube { mesh, rest, edges: [top, &hem], lengths: [of_top, of_hem], shares: &shares }
        .hung_below(&laid, z, body, landmarks, gap)
}

/// A tube with its upper edge and its hem, their lengths, m, and the share of the way between them at each vertex.
pub(super) struct Tube<'a> {
    pub(super) mesh: &'a TriMesh,
    pub(super) rest: &'a RestShape,
    pub(super) edges: [&'a [u32]; 2],
    pub(super) lengths: [f64; 2],
    pub(super) shares: &'a [f64],
}

impl Tube<'_> {
    /// D, m.
    fn height_m(&self) -> f64 {
        2.0 * self.rest.areas().iter().sum::<f64>() / self.lengths.iter().sum::<f64>()
    }

    /// Height (m) of s = 0 for a top edge at `laid` (m), along which s need not be 0.
    pub(super) fn start_z(&self, laid: &[DVec3]) -> f64 {
        let height_m = self.height_m();
        let of = |(&v, x): (&u32, &DVec3)| x.z + height_m * self.shares[v as usize];
        self.edges[0].iter().zip(laid).map(of).sum::<f64>() / laid.len() as f64
    }

    /// Positions (m) of the tube around `body` in folds below its top edge, which lies at `laid` (m), with s = 0 at the height `z` (m); `None`
    /// where that edge does not run around the trunk once.
    pub(super) fn hung_below(
        &self,
        laid: &[DVec3],
        z: f64,
        body: &TriMesh,
        landmarks: &Landmarks,
        gap: f64,
    ) -> Option<Vec<DVec3>> {
        let Self { mesh, rest, edges: [top, hem], lengths: [of_top, of_hem], shares } = *self;
        let middle = landmarks.middle;
        if turns(laid, middle).abs().round() != 1.0 {
            return None;
        }
        let unit = |x: &DVec3| (x.truncate() - middle).normalize_or_zero().extend(0.0);
        let mut directions = harmonic(mesh, rest, &top.iter().copied().zip(laid.iter().map(unit)).collect::<Vec<_>>())?;
        let mean = hem.iter().map(|&v| directions[v as usize]).sum::<DVec3>() / hem.len() as f64;
        directions.iter_mut().for_each(|c| *c -= mean);
        let height_m = self.height_m();
        let hull = hull_at(body, landmarks, z)?;
        let outwards = ((of_top - perimeter(&hull)) / TAU).max(gap);
        let folds = (of_top / FOLD_WIDTH_M).round().max(1.0);
        let level = |(height, hull): (f64, Vec<DVec2>)| {
            let curve = Curve::about(&hull, outwards);
            let share = ((z - height) / height_m).min(1.0);
            let waves = Waves::new(folds, curve.length(), of_top + share * (of_hem - of_top));
            (height, curve, waves)
        };
        let levels: Vec<(f64, Curve, Waves)> = hulls_below(body, landmarks, z, hull).into_iter().map(level).collect();
        let at = |(share, direction): (&f64, &DVec3)| {
            let z = z - height_m * share;
            let below = levels.partition_point(|(height, ..)| *height > z).min(levels.len() - 1);
            let above = below.saturating_sub(1);
            let [upper, lower] = [above, below].map(|level| levels[level].0);
            let between = if upper > lower { ((upper - z) / (upper - lower)).min(1.0) } else { 0.0 };
            let along = math::atan2(direction.y, direction.x) / TAU;
            let [upper, lower] = [above, below].map(|level| {
                let (_, curve, waves) = &levels[level];
                let (around, out) = waves.at(along);
                let outwards = math::unit(TAU * around);
                curve.towards(middle, outwards) + out * outwards
            });
            upper.lerp(lower, between).extend(z)
        };
        let mut x: Vec<DVec3> = shares.iter().zip(&directions).map(at).collect();
        top.iter().zip(laid).for_each(|(&v, laid)| x[v as usize] = *laid);
        Some(x)
    }
}

/// The edge of a tube that is not `top`; `None` for another garment.
fn other_edge(mesh: &TriMesh, top: &[u32]) -> Option<Vec<u32>> {
    let [a, b] = edges_of_tube(mesh)?;
    if a == top { Some(b) } else { (b == top).then_some(a) }
}

/// Both edges of a tube; `None` for another mesh.
pub(super) fn edges_of_tube(mesh: &TriMesh) -> Option<[Vec<u32>; 2]> {
    let topology = Topology::new(mesh);
    let is_tube = mesh.vertex_count() + mesh.triangles.len() == topology.edges.len() && topology.components().1 == 1;
    topology.boundary_loops().try_into().ok().filter(|_| is_tube)
}

/// Places (m) along `curve` of a closed edge placed at `placed` (m), with these lengths up to the end of each side, turned so that they move least;
/// `None` where the edge does not run around `middle` once.
fn laid(placed: &[DVec3], ends: &[f64], curve: &Curve, middle: DVec2) -> Option<Vec<DVec2>> {
    let around = turns(placed, middle);
    if around.abs().round() != 1.0 {
        return None;
    }
    let length = *ends.last()?;
    let shares: Vec<f64> = std::iter::once(0.0).chain(ends.iter().map(|end| around.signum() * end / length)).collect();
    let turned = |turn: f64| placed.iter().zip(&shares).map(move |(x, share)| (x, curve.at(turn + share)));
    let moved = |turn: f64| turned(turn).map(|(x, to)| x.truncate().distance_squared(to)).sum::<f64>();
    let all = (0..TURNS).map(|k| k as f64 / TURNS as f64).map(|turn| (moved(turn), turn));
    let (_, turn) = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(turned(turn).map(|(_, to)| to).collect())
}

/// Heights (m) from `z` down, and the hull of all curves of the trunk from there up to `z`, where it is `hull`.
fn hulls_below(body: &TriMesh, landmarks: &Landmarks, z: f64, hull_at_z: Vec<DVec2>) -> Vec<(f64, Vec<DVec2>)> {
    let mut heights: Vec<f64> = landmarks.trunk_heights().filter(|height| *height < z).collect();
    heights.reverse();
    let mut hulls = vec![(z, hull_at_z)];
    for height in heights {
        let above = hulls[hulls.len() - 1].1.iter().copied();
        let here = landmarks.trunk_at(body, height).map(|curve| curve.points).unwrap_or_default();
        hulls.push((height, hull(above.chain(here.iter().map(|p| p.truncate())).collect())));
    }
    hulls
}

/// Turns of a closed curve about `middle`, counter-clockwise.
fn turns(x: &[DVec3], middle: DVec2) -> f64 {
    let about = |i: usize| x[i % x.len()].truncate() - middle;
    (0..x.len()).map(|i| math::atan2(about(i).perp_dot(about(i + 1)), about(i).dot(about(i + 1)))).sum::<f64>() / TAU
}

/// Rest length of the closed `edge` up to the end of each of its sides, m.
pub(super) fn lengths_along(mesh: &TriMesh, rest: &RestShape, edge: &[u32]) -> Vec<f64> {
    let mut next = vec![None; mesh.vertex_count()];
    for (i, &v) in edge.iter().enumerate() {
        next[v as usize] = Some((edge[(i + 1) % edge.len()], i));
    }
    let mut lengths = vec![0.0; edge.len()];
    for (triangle, corners) in mesh.triangles.iter().zip(&rest.corners) {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            for (from, to) in [(i, j), (j, i)] {
                if let Some((end, side)) = next[triangle[from] as usize]
                    && end == triangle[to]
                {
                    lengths[side] = corners[i].distance(corners[j]);
                }
            }
        }
    }
    lengths
        .iter()
        .scan(0.0, |sum, length| {
            *sum += length;
            Some(*sum)
        })
        .collect()
}

/// The height (m) nearest to `height` at which `length` spans the trunk, or the waist's, and the hull of the trunk there.
fn fitting(body: &TriMesh, landmarks: &Landmarks, length: f64, height: f64) -> Option<(f64, Vec<DVec2>)> {
    let mut heights: Vec<f64> = landmarks.trunk_heights().collect();
    heights.sort_by(|a, b| (a - height).abs().total_cmp(&(b - height).abs()));
    let fits = |found: &(f64, Vec<DVec2>)| perimeter(&found.1) <= length;
    let at = |z: f64| Some((z, hull_at(body, landmarks, z)?));
    heights.into_iter().filter_map(at).find(fits).or_else(|| landmarks.waist_z.and_then(at))
}

/// Hull of the trunk at the height `z`, m.
fn hull_at(body: &TriMesh, landmarks: &Landmarks, z: f64) -> Option<Vec<DVec2>> {
    Some(hull(landmarks.trunk_at(body, z)?.points.iter().map(|p| p.truncate()).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::tube;
    use crate::mesh::self_intersection::self_intersecting_pairs;

    #[test]
    fn a_curve_moved_outwards_grows_by_the_circle_and_is_followed_at_its_length() {
        let square = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        let curve = Curve::about(&square, 0.1);
        let length = curve.length();
        // Four corners, each cut by a chord instead of a quarter of a circle.
        assert!((length - (4.0 + 4.0 * 0.1 * 2f64.sqrt())).abs() < 1e-12, "{length}");
        assert!(curve.at(0.0).distance(DVec2::new(0.0, -0.1)) < 1e-12);
        assert!(curve.at(0.5 / length).distance(DVec2::new(0.5, -0.1)) < 1e-12);
        assert!(curve.at(-0.5 / length).distance(curve.at(1.0 - 0.5 / length)) < 1e-12);
    }

    /// A trunk of 10 cm radius.
    fn trunk() -> TriMesh {
        tube(60, 90, |a, j| DVec3::new(0.1 * a.cos(), 0.1 * a.sin(), 0.02 * j))
    }

    /// A skirt of 40 cm in rows of 2 cm: a cone from a circle of 12 cm radius to one of 12 + `widening` cm.
    fn skirt(widening: f64) -> TriMesh {
        tube(60, 20, |a, j| {
            let radius = 0.12 + 0.01 * widening * j / 20.0;
            DVec3::new(radius * a.cos(), radius * a.sin(), 1.0 - 0.02 * j)
        })
    }

    #[test]
    fn a_skirt_as_two_panels_far_above_the_waist_is_hung_around_the_trunk_without_an_intersection() {
        let (body, at_rest) = (trunk(), skirt(20.0));
        let rest = RestShape::from_edges(&at_rest).unwrap();
        let top: Vec<u32> = (0..60).collect();
        // The front panel 30 cm before the body, the back behind it, both half a metre too high and turned by a fifth of a radian.
        let apart = |x: &DVec3| DVec3::new(x.x - 0.2 * x.y, x.y + 0.2 * x.x + 0.3 * x.y.signum(), x.z + 0.5);
        let mesh = at_rest.with_positions(at_rest.positions.iter().map(apart).collect());
        let x = hung_around(&mesh, &rest, &top, &body, &Landmarks::of(&body), 0.004).unwrap();
        for &v in &top {
            let x = x[v as usize];
            assert!((x.truncate().length() - 0.12).abs() < 1e-3, "{x}");
        }
        assert!(x.iter().all(|x| x.truncate().length() > 0.11));
        let hem = x[20 * 60].z - x[0].z;
        assert!((hem + 0.44).abs() < 0.04, "{hem}");
        let below = |v: usize| x[v].z - x[v + 60].z;
        assert!((0..20 * 60).all(|v| below(v) > 0.0), "heights fall from row to row");
        assert!(self_intersecting_pairs(&mesh.with_positions(x.clone())).is_empty());
    }

    #[test]
    fn the_hem_of_a_long_garment_goes_around_a_trunk_without_symmetry() {
        let egg = |a: f64| 0.1 + 0.03 * a.cos();
        let body = tube(60, 90, |a, j| DVec3::new(egg(a) * a.cos(), egg(a) * a.sin(), 0.02 * j));
        let mesh = tube(60, 60, |a, j| DVec3::new(0.15 * a.cos(), 0.15 * a.sin(), 1.3 - 0.02 * j));
        let rest = RestShape::from_edges(&mesh).unwrap();
        let (top, landmarks) = ((0..60).collect::<Vec<_>>(), Landmarks::of(&body));
        let x = hung_around(&mesh, &rest, &top, &body, &landmarks, 0.004).unwrap();
        let out = |i: usize| x[60 * 60 + i % 60].truncate() - landmarks.middle;
        assert!((0..60).all(|i| out(i).perp_dot(out(i + 1)) > 0.0));
    }

    #[test]
    fn an_edge_keeps_its_distances_and_one_beside_the_body_is_not_laid() {
        let (body, at_rest) = (trunk(), skirt(0.0));
        let rest = RestShape::from_edges(&at_rest).unwrap();
        let (top, landmarks) = ((0..60).collect::<Vec<u32>>(), Landmarks::of(&body));
        let flattened = |x: &DVec3| DVec3::new(1.6 * x.x, 2.5 * x.y, x.z);
        let mesh = at_rest.with_positions(at_rest.positions.iter().map(flattened).collect());
        let x = hung_around(&mesh, &rest, &top, &body, &landmarks, 0.004).unwrap();
        for (x, at) in x.iter().zip(&at_rest.positions).take(60) {
            assert!(x.truncate().distance(at.truncate()) < 2e-3, "{x} {at}");
        }
        let aside = mesh.with_positions(mesh.positions.iter().map(|x| *x + DVec3::X).collect());
        assert!(hung_around(&aside, &rest, &top, &body, &landmarks, 0.004).is_none());
        assert!(hung_around(&mesh, &rest, &[], &body, &landmarks, 0.004).is_none());
    }
}
