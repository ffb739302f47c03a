//! PARTs and their seams: made from distances, joined, and cut to an extent along the cloth.
//!
//! A vertex i with unsigned distance d_i belongs to level k of the range table where V_L ≤ d_i < V_H; a PART is a maximal
//! set of vertices of one level connected by garment edges. PARTs are numbered by level, then by smallest vertex index, so
//! that a table gives the same numbers on any machine. Two PARTs are adjacent where a garment edge connects them; these edges are
//! their seam. The line between two PARTs runs through the triangles with corners in both: from midpoint to midpoint of the two
//! cut edges, which is half the third edge; where three PARTs meet in a triangle, from each midpoint to the centroid.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d_i | distance of vertex i from the body, unsigned | m |
//! | S_k | vertices of PART k | – |
//!
//! **Joining** (`--min-part N`): the smallest PART under N vertices joins the neighbour with the longest common seam, until no PART
//! under N has a neighbour. Ties go to the lower number. The joined PART keeps the level of the neighbour.
//!
//! **Cutting**: a level of an undraped garment is often a ring, and a ring that moves as one PART cannot fold. Each PART is cut by
//! farthest-point seeds (Gonzalez 1985: "Clustering to minimize the maximum intercluster distance", Theoretical Computer
//! Science 38): the first seed is the PART's lowest vertex, the next is the vertex farthest from all seeds, until none is
//! farther than half the extent; every vertex joins its nearest seed. Distances are Dijkstra's along garment edges inside the
//! PART, so two vertices of a piece are at most one extent apart along the cloth, and pieces are connected. Where a
//! level's extent differs along weft and warp, lengths are scaled so that it is the same along both ([`Extent::evened`]).
//!
//! Source: Luo, Jiang, Cong, section 2.1; joining and cutting are ours. Limits: connectivity is by garment edges alone, so two layers
//! that touch without sharing vertices stay apart; a table as fine as the distance noise yields many single-vertex PARTs, which are
//! counted; a small PART that is a whole component of the garment has no neighbour and stays. A path along edges is up to 15 % longer
//! than the geodesic on a regular triangulation, so pieces come out that much smaller than the extent, never larger. A non-positive
//! extent makes every vertex a PART; an infinite one or NaN cuts nothing.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use rayon::prelude::*;

use super::range_table::{Extent, RangeTable};
use super::seeding::{Grain, Ruler, nearest_seeds};
use crate::mesh::{RestShape, Topology, TriMesh, pieces};

/// The PART number of a vertex outside every level.
pub const UNASSIGNED: u32 = u32::MAX;

/// One PART.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its level: index into the table's effective levels, from 0.
    pub level: u32,
    /// Its vertices S_k, ascending, never empty.
    pub vertices: Vec<u32>,
}

/// The garment edges between two PARTs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seam {
    /// The two PARTs, smaller number first.
    pub parts: [u32; 2],
    /// The garment edges that connect them (indices into [`Topology::edges`]), ascending, never empty.
    pub edges: Vec<u32>,
}

/// A garment cut into PARTs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// PART of each vertex, or [`UNASSIGNED`].
    pub part_of_vertex: Vec<u32>,
    /// The PARTs, by level, then by smallest vertex.
    pub parts: Vec<Part>,
    /// The seams, by PART numbers.
    pub seams: Vec<Seam>,
    /// Vertices outside every level of the table.
    pub unassigned: usize,
    /// Vertices whose distance lies in a hole of the table as printed.
    pub hole_vertices: usize,
    /// PARTs of a single vertex.
    pub singletons: usize,
    /// Number of PARTs at each level, empty levels included.
    pub parts_per_level: Vec<usize>,
    /// Levels whose extent the range table sets: [`Parts::cut_to_table`] cuts them, [`Parts::cut_to_extent`] does not.
    pub own_extent: Vec<bool>,
}

/// Cuts a garment by its vertices' distances to the body (m; a negative one, inside the body, counts by its magnitude).
/// O(n log n) in the number of edges.
#[must_use]
pub fn segment(topology: &Topology, distances_m: &[f64], table: &RangeTable) -> Parts {
    let unsigned: Vec<f64> = distances_m.iter().map(|d| d.abs()).collect();
    let (level_of_vertex, hole_vertices) = table.assign(&unsigned);
    let label: Vec<u32> = level_of_vertex.iter().map(|l| l.map_or(UNASSIGNED, |l| l as u32)).collect();
    let own_extent = table.effective_levels().iter().map(|l| l.extent.is_some()).collect();
    Parts::from_labels(topology, &label, |label| label, own_extent, hole_vertices)
}

impl Parts {
    /// Number of PARTs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Whether there is no PART at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// PARTs as the connected pieces of equal label; `level_of` gives the level of a label.
    pub(crate) fn from_labels(
        topology: &Topology,
        label: &[u32],
        level_of: impl Fn(u32) -> u32,
        own_extent: Vec<bool>,
        hole_vertices: usize,
    ) -> Self {
        let n = label.len();
        let mut found = pieces(n, |v| topology.neighbours(v as u32), |v, w| label[v] == label[w]);
        found.retain(|piece| label[piece[0] as usize] != UNASSIGNED);
        let part = |mut vertices: Vec<u32>| {
            vertices.sort_unstable();
            Part { level: level_of(label[vertices[0] as usize]), vertices }
        };
        let mut parts: Vec<Part> = found.into_iter().map(part).collect();
        // Pieces are found by smallest vertex; the stable sort keeps that order within a level.
        parts.sort_by_key(|p| p.level);
        let mut part_of_vertex = vec![UNASSIGNED; n];
        let mut parts_per_level = vec![0; own_extent.len()];
        for (p, part) in (0..).zip(&parts) {
            part.vertices.iter().for_each(|&v| part_of_vertex[v as usize] = p);
            parts_per_level.get_mut(part.level as usize).into_iter().for_each(|count| *count += 1);
        }
        Self {
            seams: seams(topology, &part_of_vertex),
            unassigned: part_of_vertex.iter().filter(|&&p| p == UNASSIGNED).count(),
            hole_vertices,
            singletons: parts.iter().filter(|p| p.vertices.len() == 1).count(),
            parts_per_level,
            own_extent,
            part_of_vertex,
            parts,
        }
    }

    /// The connected pieces of new labels, with the levels' extents and the hole count of these PARTs.
    fn relabelled(&self, topology: &Topology, label: &[u32], level_of: impl Fn(u32) -> u32) -> Self {
        Self::from_labels(topology, label, level_of, self.own_extent.clone(), self.hole_vertices)
    }

    /// One value per PART from its number and itself, in parallel, in order.
    pub(crate) fn map<T: Send>(&self, f: impl Fn(usize, &Part) -> T + Sync) -> Vec<T> {
        self.parts.par_iter().with_min_len(16).enumerate().map(|(i, p)| f(i, p)).collect()
    }

    /// Index of the seam between two PARTs.
    #[must_use]
    pub fn seam_between(&self, p: u32, q: u32) -> Option<usize> {
        self.seams.binary_search_by_key(&[p.min(q), p.max(q)], |s| s.parts).ok()
    }

    /// Length of each seam on the garment, m, in the order of [`Parts::seams`].
    #[must_use]
    pub fn seam_lengths_m(&self, mesh: &TriMesh) -> Vec<f64> {
        let mut lengths = vec![0.0; self.seams.len()];
        let mut add = |p: u32, q: u32, length: f64| {
            if let Some(seam) = self.seam_between(p, q) {
                lengths[seam] += length;
            }
        };
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let part = triangle.map(|v| self.part_of_vertex[v as usize]);
            if part[0] == part[1] && part[1] == part[2] {
                continue;
            }
            let corner = mesh.corners(t);
            let centroid = (corner[0] + corner[1] + corner[2]) / 3.0;
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                if part[i] == part[j] {
                    // Edges j–k and k–i are cut; the line between them is half of edge i–j.
                    add(part[k], part[i], 0.5 * corner[i].distance(corner[j]));
                } else if part[j] != part[k] && part[k] != part[i] {
                    add(part[i], part[j], centroid.distance(0.5 * (corner[i] + corner[j])));
                }
            }
        }
        lengths
    }

    /// PARTs of at least `min_vertices` wherever there is a neighbour to join.
    #[must_use]
    pub fn join_small(&self, topology: &Topology, mesh: &TriMesh, min_vertices: usize) -> Self {
        let mut border: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); self.len()];
        for (seam, &length) in self.seams.iter().zip(&self.seam_lengths_m(mesh)) {
            let [p, q] = seam.parts;
            border[p as usize].insert(q, length);
            border[q as usize].insert(p, length);
        }
        let mut size: Vec<usize> = self.parts.iter().map(|p| p.vertices.len()).collect();
        let mut owner: Vec<u32> = (0..self.len() as u32).collect();
        let mut small: BinaryHeap<_> = size.iter().zip(0u32..).map(|(&s, p)| Reverse((s, p))).collect();
        while let Some(Reverse((s, p))) = small.pop() {
            let i = p as usize;
            if s >= min_vertices {
                break;
            }
            if owner[i] != p || size[i] != s {
                continue;
            }
            // Only a strictly longer seam wins, so of equal ones the lower number does.
            let longest = |best: Option<(u32, f64)>, (&q, &l): (&u32, &f64)| match best {
                Some((_, b)) if l <= b => best,
                _ => Some((q, l)),
            };
            let Some((q, _)) = border[i].iter().fold(None, longest) else { continue };
            owner[i] = q;
            size[q as usize] += s;
            for (r, length) in std::mem::take(&mut border[i]) {
                border[r as usize].remove(&p);
                if r != q {
                    *border[r as usize].entry(q).or_insert(0.0) += length;
                    *border[q as usize].entry(r).or_insert(0.0) += length;
                }
            }
            small.push(Reverse((size[q as usize], q)));
        }
        let root = |&(mut p): &u32| {
            while p != UNASSIGNED && owner[p as usize] != p {
                p = owner[p as usize];
            }
            p
        };
        let label: Vec<u32> = self.part_of_vertex.iter().map(root).collect();
        self.relabelled(topology, &label, |label| self.parts[label as usize].level)
    }

    /// The same PARTs, cut where their level in the table has an extent.
    #[must_use]
    pub fn cut_to_table(&self, mesh: &TriMesh, topology: &Topology, rest: &RestShape, table: &RangeTable) -> Self {
        let levels = table.effective_levels();
        let extents: Vec<Extent> = levels.iter().map(|l| l.extent.unwrap_or(Extent::UNCUT)).collect();
        let uneven = extents.iter().any(|e| e.evened().0 != [1.0, 1.0]);
        let grain = uneven.then(|| Grain::new(mesh, topology, rest));
        let extent_of = |p: usize| extents.get(self.parts[p].level as usize).unwrap_or(&Extent::UNCUT).evened();
        self.cut(mesh, topology, grain.as_ref(), extent_of)
    }

    /// The same PARTs, each cut until none is wider than `extent_m` along the cloth. PARTs of levels with an extent of
    /// their own stay as they are.
    #[must_use]
    pub fn cut_to_extent(&self, mesh: &TriMesh, topology: &Topology, extent_m: f64) -> Self {
        self.cut_some_to_extent(mesh, topology, extent_m, &vec![true; self.len()])
    }

    /// As [`cut_to_extent`](Self::cut_to_extent), for the `chosen` PARTs alone.
    pub(crate) fn cut_some_to_extent(
        &self,
        mesh: &TriMesh,
        topology: &Topology,
        extent_m: f64,
        chosen: &[bool],
    ) -> Self {
        let own = |p: usize| self.own_extent.get(self.parts[p].level as usize) == Some(&true);
        let extent_of = |p| ([1.0, 1.0], if own(p) || !chosen[p] { f64::INFINITY } else { extent_m });
        self.cut(mesh, topology, None, extent_of)
    }

    /// Cuts each PART to an extent (m) that holds after lengths along weft and warp are multiplied by two factors.
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
        let mut index_in_part = vec![0u32; self.part_of_vertex.len()];
        for part in &self.parts {
            (0..).zip(&part.vertices).for_each(|(i, &v)| index_in_part[v as usize] = i);
        }
        let pieces = self.map(|number, part| {
            let inside = |w: u32| self.part_of_vertex[w as usize] == number as u32;
            let local = |w: u32| inside(w).then(|| index_in_part[w as usize] as usize);
            let (factors, extent_m) = extent_of(number);
            let grain = grain.filter(|_| factors != [1.0, 1.0]).map(|grain| (grain, factors));
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
        self.relabelled(topology, &label, |label| level_of_label[label as usize])
    }
}

/// The seams of a labelling, sorted by their pair of PARTs.
fn seams(topology: &Topology, part_of_vertex: &[u32]) -> Vec<Seam> {
    let mut crossing: Vec<([u32; 2], u32)> = Vec::new();
    for (e, edge) in topology.edges.iter().enumerate() {
        let [p, q] = edge.map(|v| part_of_vertex[v as usize]);
        if p != q && p != UNASSIGNED && q != UNASSIGNED {
            crossing.push(([p.min(q), p.max(q)], e as u32));
        }
    }
    crossing.sort_unstable();
    let group = |g: &[([u32; 2], u32)]| Seam { parts: g[0].0, edges: g.iter().map(|&(_, e)| e).collect() };
    crossing.chunk_by(|a, b| a.0 == b.0).map(group).collect()
}
