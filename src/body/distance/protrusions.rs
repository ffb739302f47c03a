//! Cloth that an end of the body sticks through, taken off over that end.
//!
//! A trouser leg that is put about a leg may have the toes go through its front, a sleeve the thumb: no vertex is inside, and none
//! finds a way out, for above the foot it is up and below it down. What is wrong is told by a triangle that crosses the body where the
//! nearest way out leads back through the cloth or along it; the right way out is that of the cloth's own outer side. Each such triangle is
//! asked to go that way until it is outside; the displacements are smoothed over rings of neighbours about them (umbrella averages) and what
//! was asked restored in turn, as where vertices are pushed out (`scene::push_out`), and so again until nothing sticks through.
//!
//! Limits: only what is shorter than [`FARTHEST`] beyond the cloth is an end. Where no fewer triangles are stuck for it, or the cloth would cross
//! itself in more pairs than before, it stays as it is: a garment that was not made for the body is not what this mends.

use glam::DVec3;

use super::Body;
use crate::mesh::lattice::{lattice, place};
use crate::mesh::self_intersection::{crossing_pairs, self_intersecting_pairs};
use crate::mesh::{Topology, TriMesh, longest_side};

/// A way out of the body leads out of the cloth where its cosine with the cloth's normal is over this.
pub(crate) const OUTWARD: f64 = 0.3;

/// Deeper than this in the body a triangle is stuck, m; what is less deep is pushed out by contact.
const DEEP: f64 = 2e-3;

/// An end sticks out by no more than this, m: a foot does by its length less the heel.
const FARTHEST: f64 = 0.12;

/// Least and most stride of the march to the outside, m.
const MARCH: [f64; 2] = [2e-4, 0.01];

/// What is taken off is left so far from the body, and its neighbours, m.
const CLEAR: f64 = 4e-3;
const NEIGHBOURS_CLEAR: f64 = 1e-3;

/// Times that it is tried again, and in each the turns of smoothing and restoring, and averages in a turn.
const ROUNDS: usize = 8;
const TURNS: usize = 24;
const SWEEPS: usize = 4;

/// Rings that are smoothed: as wide as so many times the longest way, within these bounds.
const WIDE: f64 = 3.0;
const RINGS: [f64; 2] = [3.0, 24.0];

/// A triangle that the body sticks through, and how far which place of it must go.
struct Stuck {
    corners: [u32; 3],
    shares: [f64; 3],
    way: DVec3,
    far: f64,
}

impl Body {
    /// Where the vertices of `garment`, wound outward, go (m) to be off the ends that stick through it; those `held` stay. `None` where nothing
    /// sticks through, or it cannot be helped.
    pub(crate) fn taken_off_ends(&self, garment: &TriMesh, held: &[bool]) -> Option<Vec<DVec3>> {
        let mut mesh = garment.clone();
        let mut stuck = self.stuck(&mesh);
        if stuck.is_empty() {
            return None;
        }
        let itself = self_intersecting_pairs(&mesh).len();
        let topology = Topology::new(garment);
        for _ in 0..ROUNDS {
            mesh = self.take_off(&mesh, &topology, held, &stuck);
            let left = self.stuck(&mesh);
            if left.len() >= stuck.len() {
                return None;
            }
            stuck = left;
            if stuck.is_empty() {
                break;
            }
        }
        (stuck.is_empty() && self_intersecting_pairs(&mesh).len() <= itself).then_some(mesh.positions)
    }

    /// The triangles that the body sticks through.
    fn stuck(&self, mesh: &TriMesh) -> Vec<Stuck> {
        let mut triangles: Vec<u32> = crossing_pairs(mesh, self.mesh()).into_iter().map(|[t, _]| t).collect();
        triangles.dedup();
        triangles.into_iter().filter_map(|t| self.stuck_at(mesh, t as usize)).collect()
    }

    fn stuck_at(&self, mesh: &TriMesh, t: usize) -> Option<Stuck> {
        let corners = mesh.corners(t);
        let [a, b, c] = corners;
        let way = (b - a).cross(c - a).normalize_or_zero();
        let shares: Vec<[f64; 3]> = lattice(longest_side(corners)).collect();
        let places: Vec<DVec3> = shares.iter().map(|shares| place(corners, *shares)).collect();
        let near = self.nearest_all(&places);
        if !near.iter().any(|p| p.signed_distance < -DEEP && p.normal.dot(way) < OUTWARD) {
            return None;
        }
        let inside = places.iter().zip(near).zip(shares).filter(|((_, near), _)| near.signed_distance < 0.0);
        let ways = inside.filter_map(|((x, _), shares)| Some((self.outside(*x, way)?, shares)));
        let (far, shares) = ways.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Stuck { corners: mesh.triangles[t], shares, way, far: far + CLEAR })
    }

    /// How far one goes from `x` this way to be outside, m.
    fn outside(&self, x: DVec3, way: DVec3) -> Option<f64> {
        let mut gone = 0.0;
        while gone < FARTHEST {
            let distance = self.nearest(x + way * gone).signed_distance;
            if distance >= 0.0 {
                return Some(gone);
            }
            gone += (-distance).clamp(MARCH[0], MARCH[1]);
        }
        None
    }

    /// One try.
    fn take_off(&self, mesh: &TriMesh, topology: &Topology, held: &[bool], stuck: &[Stuck]) -> TriMesh {
        let region = region(mesh, topology, held, stuck);
        let x = &mesh.positions;
        let mut moves = vec![DVec3::ZERO; x.len()];
        self.restore(x, &region, held, stuck, &mut moves);
        for _ in 0..TURNS {
            for _ in 0..SWEEPS {
                let mean = |v: &u32| {
                    let around = topology.neighbours(*v);
                    around.iter().map(|&w| moves[w as usize]).sum::<DVec3>() / around.len().max(1) as f64
                };
                let means: Vec<DVec3> = region.iter().map(mean).collect();
                region.iter().zip(means).for_each(|(&v, mean)| moves[v as usize] = mean);
            }
            self.restore(x, &region, held, stuck, &mut moves);
        }
        mesh.with_positions(x.iter().zip(moves).map(|(x, moved)| *x + moved).collect())
    }

    /// What is asked of the stuck triangles, and that who moves does not move into the body.
    fn restore(&self, x: &[DVec3], region: &[u32], held: &[bool], stuck: &[Stuck], moves: &mut [DVec3]) {
        for stuck in stuck {
            let moved = place(stuck.corners.map(|v| moves[v as usize]), stuck.shares);
            let missing = (stuck.far - moved.dot(stuck.way)).max(0.0);
            for v in stuck.corners.into_iter().filter(|v| !held[*v as usize]) {
                moves[v as usize] += stuck.way * missing;
            }
        }
        let there: Vec<DVec3> = region.iter().map(|&v| x[v as usize] + moves[v as usize]).collect();
        for (&v, near) in region.iter().zip(self.nearest_all(&there)) {
            if near.signed_distance < NEIGHBOURS_CLEAR && moves[v as usize] != DVec3::ZERO {
                moves[v as usize] += near.normal * (NEIGHBOURS_CLEAR - near.signed_distance);
            }
        }
    }
}

/// The free vertices about what is stuck, ascending.
fn region(mesh: &TriMesh, topology: &Topology, held: &[bool], stuck: &[Stuck]) -> Vec<u32> {
    let far = stuck.iter().map(|stuck| stuck.far).fold(0.0, f64::max);
    let area: f64 = mesh.triangle_areas().iter().sum();
    // Of equilateral triangles with this area.
    let edge = (4.0 * area / (3.0_f64.sqrt() * mesh.triangles.len() as f64)).sqrt();
    let rings = (WIDE * far / edge).ceil().clamp(RINGS[0], RINGS[1]) as usize;
    let mut reached = held.to_vec();
    let mut region: Vec<u32> = Vec::new();
    let mut front: Vec<u32> = stuck.iter().flat_map(|stuck| stuck.corners).collect();
    for _ in 0..=rings {
        front.retain(|&v| !std::mem::replace(&mut reached[v as usize], true));
        region.extend(&front);
        front = front.iter().flat_map(|&v| topology.neighbours(v)).copied().collect();
    }
    region.sort_unstable();
    region
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::{cuboid, tube};

    #[test]
    fn a_foot_through_a_trouser_leg_is_inside_it_afterwards() {
        // As thick as an edge is long, so that no vertex need be in it, 6 cm out of the leg.
        let leg = tube(36, 28, |a, row| DVec3::new(0.08 * a.cos(), 0.08 * a.sin(), 0.4 * row / 28.0));
        let toes =
            |length: f64| Body::new(&cuboid(DVec3::new(-0.05, -0.03, 0.02), DVec3::new(length, 0.03, 0.032))).unwrap();
        let foot = toes(0.14);
        let held = vec![false; leg.positions.len()];
        assert!(foot.stuck(&leg).len() > 8);
        let taken = leg.with_positions(foot.taken_off_ends(&leg, &held).unwrap());
        assert!(foot.stuck(&taken).is_empty());
        assert!(self_intersecting_pairs(&taken).is_empty());
        assert!(taken.positions.iter().any(|x| x.x > 0.14) && taken.positions.iter().all(|x| x.x < 0.16));
        // The upper end is where it was.
        assert!(
            leg.positions.iter().zip(&taken.positions).filter(|(x, _)| x.z > 0.35).all(|(a, b)| a.distance(*b) < 1e-3)
        );
        // What reaches too far is none, and where nothing reaches through nothing moves.
        assert!(toes(0.4).taken_off_ends(&leg, &held).is_none());
        assert!(toes(0.07).taken_off_ends(&leg, &held).is_none());
        // Nor does a leg that is held.
        assert!(foot.taken_off_ends(&leg, &vec![true; held.len()]).is_none());
    }
}
