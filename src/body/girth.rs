//! Girths: sections of a mesh by a plane, and their lengths.
//!
//! Every triangle whose corners lie on both sides of the plane gives one segment between two crossed edges; segments
//! that share an edge are joined to loops (or chains, where the mesh is open). The girth along the surface is the loop's
//! length; a tape laid around it spans hollows, so the tape's girth is that of the loop's convex hull in the plane
//! (Andrew's monotone chain, 1979). All lengths in metres. A vertex exactly on the plane counts as above it.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::mesh::TriMesh;

/// A plane by a point and its unit normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// A point of the plane, m.
    pub origin: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

impl Plane {
    /// The horizontal plane at height `z`, m.
    #[must_use]
    pub fn horizontal(z: f64) -> Self {
        Self { origin: DVec3::new(0.0, 0.0, z), normal: DVec3::Z }
    }

    /// Two unit vectors that span the plane.
    pub(crate) fn axes(&self) -> [DVec3; 2] {
        let (u, v) = self.normal.any_orthonormal_pair();
        [u, v]
    }
}

/// One curve in which a plane cuts a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionLoop {
    /// Its crossings with the mesh's edges, in order, m.
    pub points: Vec<DVec3>,
    /// Whether the last point joins the first.
    pub closed: bool,
    /// The plane it lies in.
    pub plane: Plane,
}

impl SectionLoop {
    /// Length along the surface, m.
    pub(crate) fn length(&self) -> f64 {
        let inner: f64 = self.points.windows(2).map(|w| w[0].distance(w[1])).sum();
        match (self.closed, self.points.first(), self.points.last()) {
            (true, Some(&first), Some(&last)) => inner + last.distance(first),
            _ => inner,
        }
    }

    /// Length of a tape pulled tight around it, m.
    #[must_use]
    pub fn tape_length(&self) -> f64 {
        let [u, v] = self.plane.axes();
        hull_length(self.points.iter().map(|p| DVec2::new(p.dot(u), p.dot(v))).collect())
    }

    /// Mean of its points, m.
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        self.points.iter().sum::<DVec3>() / self.points.len().max(1) as f64
    }
}

/// Perimeter of the convex hull of points in a plane, m.
pub(crate) fn hull_length(points: Vec<DVec2>) -> f64 {
    let [lower, upper] = chains(points);
    let length = |chain: &[DVec2]| chain.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
    length(&lower) + length(&upper)
}

/// Corners of the convex hull of points in a plane, counter-clockwise.
pub(crate) fn hull(points: Vec<DVec2>) -> Vec<DVec2> {
    // Each chain ends where the other begins.
    let without_last = |chain: &Vec<DVec2>| chain[..chain.len().saturating_sub(1)].to_vec();
    chains(points).iter().flat_map(without_last).collect()
}

/// Length of a closed curve of corners in a plane, m.
pub(crate) fn perimeter(corners: &[DVec2]) -> f64 {
    (0..corners.len()).map(|i| corners[i].distance(corners[(i + 1) % corners.len()])).sum()
}

/// The lower and the upper chain of the hull.
fn chains(mut points: Vec<DVec2>) -> [Vec<DVec2>; 2] {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let mut half = |reverse: bool| -> Vec<DVec2> {
        if reverse {
            points.reverse();
        }
        let mut chain: Vec<DVec2> = Vec::new();
        for &p in &points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    [half(false), half(true)]
}

/// One curve in which a plane cuts a mesh, by the edges it crosses.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cut {
    /// The crossed edges in order, each with its end above the plane first, and the position of the crossing from there as a share
    /// of the edge.
    pub(crate) crossings: Vec<([u32; 2], f64)>,
    /// The triangle between each crossing and the next; of a closed curve also that from the last to the first.
    pub(crate) triangles: Vec<u32>,
    /// Whether the last crossing joins the first.
    pub(crate) closed: bool,
}

/// All curves in which `plane` cuts `mesh`, in the order of their first crossed edge.
#[must_use]
pub fn section(mesh: &TriMesh, plane: Plane) -> Vec<SectionLoop> {
    let point = |&([a, b], share): &([u32; 2], f64)| mesh.positions[a as usize].lerp(mesh.positions[b as usize], share);
    let of = |cut: Cut| SectionLoop { points: cut.crossings.iter().map(point).collect(), closed: cut.closed, plane };
    cuts(mesh, plane).into_iter().map(of).collect()
}

/// The curves of a [`section`] by crossed edges.
pub(crate) fn cuts(mesh: &TriMesh, plane: Plane) -> Vec<Cut> {
    let height: Vec<f64> = mesh.positions.iter().map(|&p| (p - plane.origin).dot(plane.normal)).collect();
    let above = |v: u32| height[v as usize] >= 0.0;
    // Consistent winding makes every segment run from an edge going down to an edge going up, and its successor's first edge
    // is its last.
    let mut links: BTreeMap<[u32; 2], ([u32; 2], u32)> = BTreeMap::new();
    for (t, &[a, b, c]) in (0..).zip(&mesh.triangles) {
        let (mut down, mut up) = (None, None);
        for (i, j) in [(a, b), (b, c), (c, a)] {
            match (above(i), above(j)) {
                (true, false) => down = Some([i, j]),
                (false, true) => up = Some([j, i]),
                _ => {}
            }
        }
        if let (Some(down), Some(up)) = (down, up) {
            links.insert(down, (up, t));
        }
    }
    let crossing = |edge: [u32; 2]| {
        let [above, below] = edge.map(|v| height[v as usize]);
        (edge, above / (above - below))
    };
    // Open chains first, from edges that end no segment; the rest are loops.
    let ends: std::collections::BTreeSet<[u32; 2]> = links.values().map(|(next, _)| *next).collect();
    let starts: Vec<[u32; 2]> = links.keys().filter(|k| !ends.contains(*k)).copied().collect();
    let mut found = Vec::new();
    let mut starts = starts.into_iter();
    while let Some(start) = starts.next().or_else(|| links.keys().next().copied()) {
        let mut cut = Cut { crossings: vec![crossing(start)], triangles: Vec::new(), closed: false };
        let mut at = start;
        while let Some((next, triangle)) = links.remove(&at) {
            cut.triangles.push(triangle);
            if next == start {
                cut.closed = true;
                break;
            }
            cut.crossings.push(crossing(next));
            at = next;
        }
        found.push(cut);
    }
    found
}

/// The closed curve of a section with its centre nearest to the plane's origin.
#[must_use]
pub fn loop_around(mesh: &TriMesh, plane: Plane) -> Option<SectionLoop> {
    section(mesh, plane)
        .into_iter()
        .filter(|l| l.closed)
        .min_by(|a, b| a.centre().distance(plane.origin).total_cmp(&b.centre().distance(plane.origin)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::tube;

    /// An open prism of n sides and radius r between z = 0 and 1, standing at `x`.
    fn prism(n: u32, r: f64, x: f64) -> TriMesh {
        tube(n, 1, |a, z| DVec3::new(x + r * a.cos(), r * a.sin(), z))
    }

    #[test]
    fn the_girth_of_a_prism_is_that_of_its_polygon() {
        let loops = section(&prism(12, 0.5, 0.0), Plane::horizontal(0.3));
        assert_eq!(loops.len(), 1);
        let exact = 12.0 * 2.0 * 0.5 * (std::f64::consts::PI / 12.0).sin();
        assert!(loops[0].closed);
        assert!((loops[0].length() - exact).abs() < 1e-12);
        assert!((loops[0].tape_length() - exact).abs() < 1e-12);
    }

    #[test]
    fn two_prisms_give_two_loops_and_a_vertical_plane_two_chains() {
        let mut mesh = prism(8, 0.2, 0.0);
        let other = prism(8, 0.2, 1.0);
        let shift = mesh.positions.len() as u32;
        mesh.positions.extend(&other.positions);
        mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + shift)));
        assert_eq!(section(&mesh, Plane::horizontal(0.5)).len(), 2);
        let near = loop_around(&mesh, Plane { origin: DVec3::new(1.0, 0.0, 0.5), normal: DVec3::Z }).unwrap();
        assert!((near.centre().x - 1.0).abs() < 1e-9);
        let chains = section(&prism(8, 0.2, 0.0), Plane { origin: DVec3::new(0.01, 0.0, 0.0), normal: DVec3::X });
        assert_eq!(chains.len(), 2);
        assert!(chains.iter().all(|c| !c.closed && (c.length() - 1.0).abs() < 1e-9));
    }

    #[test]
    fn the_tape_length_spans_hollows() {
        let star = [(0.0, 0.0), (2.0, 0.0), (1.0, 0.5), (2.0, 1.0), (0.0, 1.0)];
        assert!((hull_length(star.iter().map(|&(x, y)| DVec2::new(x, y)).collect()) - 6.0).abs() < 1e-12);
    }
}
