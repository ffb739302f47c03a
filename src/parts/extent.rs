//! Cutting PARTs to a largest extent along the cloth: the range table's own, level by level, or the run's (`--max-extent`) for
//! levels that have none.
//!
//! A level of an undraped garment is often a ring, and a ring that moves as one cannot fold. Each PART is cut by
//! farthest-point seeds (Gonzalez 1985: "Clustering to minimize the maximum intercluster distance", Theoretical Computer
//! Science 38): the first seed is the PART's lowest vertex, the next always the vertex farthest from all seeds, until none is
//! farther than half the extent; every vertex goes to its nearest seed. Distance runs along garment edges inside the
//! PART (Dijkstra), so two vertices of a piece are at most one extent apart along the cloth, and the pieces are connected. Where a
//! level's extent is taller than wide, or wider than tall, lengths along the grain are scaled so that it is as wide as tall.
//!
//! Limits: a path along edges is up to 15 % longer than the geodesic on a regular triangulation, so pieces come out that much
//! smaller than asked, never larger. Non-positive extents make every vertex a PART; an infinite one or NaN cuts nothing.

use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::range_table::RangeTable;

use super::grain::{Grain, Ruler};
use super::seeding::nearest_seeds;
use super::{Parts, UNASSIGNED};

/// What cuts nothing.
const UNCUT: ([f64; 2], f64) = ([1.0, 1.0], f64::INFINITY);

impl Parts {
    /// The same PARTs, cut where their level in the table has an extent: what stage one makes of a table with extents.
    #[must_use]
    pub fn cut_to_table(&self, mesh: &TriMesh, topology: &Topology, rest: &RestShape, table: &RangeTable) -> Self {
        let levels = table.effective_levels();
        let extent = |level: u32| levels.get(level as usize)?.extent.map(|e| e.evened());
        let uneven = levels.iter().any(|l| l.extent.is_some_and(|e| e.evened().0 != UNCUT.0));
        let grain = uneven.then(|| Grain::new(mesh, topology, rest));
        self.cut(mesh, topology, grain.as_ref(), |p| extent(self.parts[p].level).unwrap_or(UNCUT))
    }

    /// The same PARTs, each cut until none is wider than `extent_m` metres along the cloth. PARTs of levels with an extent of
    /// their own stay as they are.
    #[must_use]
    pub fn cut_to_extent(&self, mesh: &TriMesh, topology: &Topology, extent_m: f64) -> Self {
        self.cut_some_to_extent(mesh, topology, extent_m, &vec![true; self.len()])
    }

    /// As [`cut_to_extent`](Self::cut_to_extent), those PARTs alone that are `chosen`.
    pub(crate) fn cut_some_to_extent(
        &self,
        mesh: &TriMesh,
        topology: &Topology,
        extent_m: f64,
        chosen: &[bool],
    ) -> Self {
        let own = |p: usize| self.own_extent.get(self.parts[p].level as usize) == Some(&true);
        self.cut(mesh, topology, None, |p| if own(p) || !chosen[p] { UNCUT } else { ([1.0, 1.0], extent_m) })
    }

    /// Each PART cut to its own extent, m, after lengths along weft and warp are multiplied.
    fn cut(
        &self,
        mesh: &TriMesh,
        topology: &Topology,
        grain: Option<&Grain>,
        extent_of: impl Fn(usize) -> ([f64; 2], f64) + Sync,
    ) -> Self {
        if (0..self.len()).all(|p| extent_of(p).1 == f64::INFINITY) {
            return self.clone();
        }
        let mut place = vec![0u32; self.part_of_vertex.len()];
        for part in &self.parts {
            for (&v, i) in part.vertices.iter().zip(0..) {
                place[v as usize] = i;
            }
        }
        let pieces = self.map(|number, part| {
            let inside = |w: u32| self.part_of_vertex[w as usize] == number as u32;
            let local = |w: u32| inside(w).then(|| place[w as usize] as usize);
            let (factors, extent_m) = extent_of(number);
            let grain = grain.filter(|_| factors != UNCUT.0).map(|grain| (grain, factors));
            nearest_seeds(&part.vertices, local, Ruler { mesh, topology, grain }, extent_m)
        });
        let mut label = vec![UNASSIGNED; self.part_of_vertex.len()];
        let mut level_of_label = Vec::new();
        for (part, (seed_of_vertex, seeds)) in self.parts.iter().zip(&pieces) {
            let first = level_of_label.len() as u32;
            for (&v, &seed) in part.vertices.iter().zip(seed_of_vertex) {
                label[v as usize] = first + seed;
            }
            level_of_label.extend(std::iter::repeat_n(part.level, *seeds));
        }
        let level_of = |label: u32| level_of_label[label as usize];
        Self::from_labels(topology, &label, level_of, self.own_extent.clone(), self.hole_vertices)
    }
}
