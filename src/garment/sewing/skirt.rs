//! Wide skirts of garments with shoulders, hung around the trunk below the waist.
//!
//! The halves of a dress's circle skirt stand before and behind the body and reach beyond the hands, so that closed from there the skirt
//! lies over the hands. Cloth above the skirt is closed first; the skirt then starts in folds around the trunk, as a skirt without
//! shoulders does ([`tube`](super::tube)).
//!
//! The skirt is what lies below the shortest level set at rest of
//!
//! Δs = 0, s = 0 on the other edges, 1 on the hem,
//!
//! of those below which the cloth is a tube. A level set of s is a waist seam where there is one.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s | share of the way from the other edges to the hem | – |
//!
//! Source: own. Limits: a slit is part of the hem, so that the cloth beside it starts compressed, with intersections that closing or the drape must take
//! apart. A skirt that is not one tube below its waist is not found.

use glam::DVec3;

use super::arap::harmonic;
use super::landmarks::Landmarks;
use super::tube::{Tube, edges_of_tube, lengths_along};
use crate::mesh::{RestShape, Topology, TriMesh, each_once};

/// Level sets that are measured.
const LEVELS: usize = 100;

/// How many of the shortest level sets are tried: is what lies below one a tube?
const TRIES: usize = 10;

/// Least ratio of the lengths of hem and waist of a wide skirt. Half a circle of 50 cm below a waist of 75 cm has 3.1. A heuristic.
const MIN_WIDENING: f64 = 2.5;

/// The wide skirt of a garment with shoulders.
pub(super) struct Skirt {
    mesh: TriMesh,
    rest: RestShape,
    /// The garment's vertices of which the skirt consists.
    vertices: Vec<u32>,
    /// Its upper edge and its hem, by its own vertices.
    edges: [Vec<u32>; 2],
    /// Lengths of the level set and of the hem, m.
    lengths: [f64; 2],
    /// Share of the way from the level set to the hem.
    shares: Vec<f64>,
    /// The garment without it.
    upper: (TriMesh, RestShape),
}

impl Skirt {
    /// Finds the wide skirt of a garment as placed, which begins at the height `highest_z` (m) or below; `None` where it has none.
    pub(super) fn of(mesh: &TriMesh, rest: &RestShape, highest_z: f64) -> Option<Self> {
        let mut loops = Topology::new(mesh).boundary_loops();
        let height = |edge: &[u32]| edge.iter().map(|&v| mesh.positions[v as usize].z).sum::<f64>() / edge.len() as f64;
        let lowest = (0..loops.len()).min_by(|&i, &j| height(&loops[i]).total_cmp(&height(&loops[j])))?;
        let hem = loops.swap_remove(lowest);
        let of_hem = lengths_along(mesh, rest, &hem).last().copied()?;
        let ends = |edge: &[u32], s: f64| edge.iter().map(|&v| (v, DVec3::splat(s))).collect::<Vec<_>>();
        let fixed = loops.iter().flat_map(|edge| ends(edge, 0.0)).chain(ends(&hem, 1.0)).collect::<Vec<_>>();
        let s: Vec<f64> = harmonic(mesh, rest, &fixed)?.iter().map(|s| s.x).collect();
        let lengths = level_lengths(mesh, rest, &s);
        let mut by_length: Vec<usize> = (0..LEVELS).filter(|&k| MIN_WIDENING * lengths[k] <= of_hem).collect();
        by_length.sort_by(|&a, &b| lengths[a].total_cmp(&lengths[b]));
        let below = by_length.iter().take(TRIES).map(|&k| Self::below(mesh, rest, &s, level(k), [lengths[k], of_hem]));
        let skirt = below.flatten().next()?;
        let top = &skirt.edges[0];
        let top_z = top.iter().map(|&v| skirt.mesh.positions[v as usize].z).sum::<f64>() / top.len() as f64;
        (top_z <= highest_z).then_some(skirt)
    }

    /// The part of a garment below the level set; `None` where it is no tube.
    fn below(mesh: &TriMesh, rest: &RestShape, s: &[f64], level: f64, lengths: [f64; 2]) -> Option<Self> {
        let is_below: Vec<bool> = mesh.triangles.iter().map(|t| t.iter().all(|&v| s[v as usize] >= level)).collect();
        let of = |below: bool| {
            let chosen = || (0..is_below.len()).filter(|&t| is_below[t] == below);
            let triangles: Vec<[u32; 3]> = chosen().map(|t| mesh.triangles[t]).collect();
            (triangles, RestShape::new(chosen().map(|t| rest.corners[t]).collect()))
        };
        let (triangles, skirt_rest) = of(true);
        let vertices = each_once(triangles.iter().flatten().copied());
        let mut own = vec![0; s.len()];
        vertices.iter().enumerate().for_each(|(i, &v)| own[v as usize] = i as u32);
        let triangles = triangles.iter().map(|t| t.map(|v| own[v as usize])).collect();
        let skirt = TriMesh::new(vertices.iter().map(|&v| mesh.positions[v as usize]).collect(), triangles);
        let shares: Vec<f64> = vertices.iter().map(|&v| (s[v as usize] - level) / (1.0 - level)).collect();
        let [a, b] = edges_of_tube(&skirt)?;
        let edges = if shares[a[0] as usize] < shares[b[0] as usize] { [a, b] } else { [b, a] };
        let (triangles, upper_rest) = of(false);
        let upper = (TriMesh::new(mesh.positions.clone(), triangles), upper_rest);
        Some(Self { mesh: skirt, rest: skirt_rest, vertices, edges, lengths, shares, upper })
    }

    /// The garment without its skirt, whose vertices are left in it, and its rest shape.
    pub(super) fn upper(&self) -> (&TriMesh, &RestShape) {
        (&self.upper.0, &self.upper.1)
    }

    /// Vertices of the garment above the skirt and on its upper edge.
    pub(super) fn vertices_above(&self) -> Vec<u32> {
        each_once(self.upper.0.triangles.iter().flatten().copied())
    }

    /// Hangs the skirt of a garment at `x` (m) around `body` below the edge at which it begins, at least `gap` (m) from the trunk; `false` where
    /// that edge does not run around the trunk once.
    pub(super) fn hang(&self, x: &mut [DVec3], body: &TriMesh, landmarks: &Landmarks, gap: f64) -> bool {
        let laid: Vec<DVec3> = self.edges[0].iter().map(|&v| x[self.vertices[v as usize] as usize]).collect();
        let tube = Tube {
            mesh: &self.mesh,
            rest: &self.rest,
            edges: self.edges.each_ref().map(Vec::as_slice),
            lengths: self.lengths,
            shares: &self.shares,
        };
        let Some(hung) = tube.hung_below(&laid, tube.start_z(&laid), body, landmarks, gap) else { return false };
        self.vertices.iter().zip(hung).for_each(|(&v, hung)| x[v as usize] = hung);
        true
    }
}

/// s of a level set.
fn level(k: usize) -> f64 {
    (k as f64 + 0.5) / LEVELS as f64
}

/// Lengths of the level sets at rest, m.
fn level_lengths(mesh: &TriMesh, rest: &RestShape, s: &[f64]) -> Vec<f64> {
    let mut lengths = vec![0.0; LEVELS];
    for (triangle, corners) in mesh.triangles.iter().zip(&rest.corners) {
        let mut ends: [usize; 3] = [0, 1, 2];
        let of = triangle.map(|v| s[v as usize]);
        ends.sort_by(|&i, &j| of[i].total_cmp(&of[j]));
        let ([low, middle, high], [a, b, c]) = (ends.map(|i| of[i]), ends.map(|i| corners[i]));
        let first = (low * LEVELS as f64 - 0.5).ceil().max(0.0) as usize;
        for (k, length) in lengths.iter_mut().enumerate().skip(first).take_while(|(k, _)| level(*k) < high) {
            let at = level(k);
            let long = a.lerp(c, (at - low) / (high - low));
            let short = if at < middle {
                a.lerp(b, (at - low) / (middle - low))
            } else {
                b.lerp(c, (at - middle) / (high - middle))
            };
            *length += long.distance(short);
        }
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::tube;
    use crate::mesh::self_intersection::self_intersecting_pairs;

    /// A dress in rows of 2 cm: a bodice of 40 cm, narrower towards a waist of 12 cm radius at the height of 1 m, and a skirt of 40 cm that is
    /// wider by `widening` cm at its hem.
    fn dress(widening: f64) -> TriMesh {
        tube(60, 40, |a, j| {
            let radius = if j < 20.0 { 0.12 + 0.001 * (20.0 - j) } else { 0.12 + 0.01 * widening * (j - 20.0) / 20.0 };
            DVec3::new(radius * a.cos(), radius * a.sin(), 1.4 - 0.02 * j)
        })
    }

    #[test]
    fn the_skirt_of_a_dress_begins_at_its_waist_and_a_narrow_one_is_none() {
        let mesh = dress(40.0);
        let skirt = Skirt::of(&mesh, &RestShape::from_edges(&mesh).unwrap(), 1.1).unwrap();
        let above = skirt.vertices_above();
        let last_row = (above.len() - 1) / 60;
        assert!(above.iter().enumerate().all(|(i, &v)| i == v as usize) && (19..=22).contains(&last_row), "{last_row}");
        assert_eq!(above.len() + skirt.vertices.len(), mesh.vertex_count() + skirt.edges[0].len());
        assert!(
            Skirt::of(&mesh, &RestShape::from_edges(&mesh).unwrap(), 0.9).is_none(),
            "a skirt begins below the given height"
        );
        let mesh = dress(10.0);
        assert!(Skirt::of(&mesh, &RestShape::from_edges(&mesh).unwrap(), 1.1).is_none());
    }

    #[test]
    fn a_skirt_that_stands_in_two_halves_is_hung_around_the_trunk_below_the_waist() {
        let (body, mesh) = (tube(60, 90, |a, j| DVec3::new(0.1 * a.cos(), 0.1 * a.sin(), 0.02 * j)), dress(40.0));
        let rest = RestShape::from_edges(&mesh).unwrap();
        let skirt = Skirt::of(&mesh, &rest, 1.1).unwrap();
        let above = skirt.vertices_above();
        let mut x = mesh.positions.clone();
        skirt
            .vertices
            .iter()
            .filter(|v| !above.contains(v))
            .for_each(|&v| x[v as usize].y += 0.3 * x[v as usize].y.signum());
        assert!(skirt.hang(&mut x, &body, &Landmarks::of(&body), 0.004));
        assert!(above.iter().all(|&v| x[v as usize] == mesh.positions[v as usize]), "the bodice stays");
        assert!(x.iter().all(|x| x.truncate().length() > 0.1), "nothing is inside the trunk");
        // 40 cm down and 40 cm wider: 57 cm of cloth in folds.
        let hem = x[40 * 60].z - 1.0;
        assert!((-0.6..-0.5).contains(&hem), "{hem}");
        assert_eq!(self_intersecting_pairs(&mesh.with_positions(x)).len(), 0);
    }

    #[test]
    fn level_sets_have_their_lengths() {
        let mesh = tube(60, 20, |a, j| DVec3::new(0.1 * a.cos(), 0.1 * a.sin(), 0.02 * j));
        let s: Vec<f64> = mesh.positions.iter().map(|x| x.z / 0.4).collect();
        let around = 60.0 * 0.2 * (std::f64::consts::PI / 60.0).sin();
        for length in level_lengths(&mesh, &RestShape::from_edges(&mesh).unwrap(), &s) {
            assert!((length - around).abs() < 1e-9, "{length}");
        }
    }
}
