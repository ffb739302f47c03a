//! Blending weights: how much of each PART's motion a vertex takes.
//!
//! w_p(v) = κ(δ_p(v)/r b_p) / Σ_q κ(δ_q(v)/r b_q), κ(t) = (1 − t)² for t < 1, else 0,
//!
//! with δ_p(v) the distance from v to PART p along garment edges, zero on p itself, and b_p p's half-width: how far its innermost
//! vertex is from its seams. So two PARTs share a seam in halves, with one slope on both sides of it, and no farther
//! than a neighbour is wide does anything reach. The weights of a vertex sum to one.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | δ_p | distance to PART p along the cloth, as placed | m |
//! | b_p | half-width of PART p | m |
//!
//! Source: own; a partition of unity after Shepard ("A two-dimensional interpolation function for irregularly-spaced data", ACM
//! 1968), with a limit to its reach. Tried: three quarters to twice the half-width; half of it folds less well (10 mm instead of 4 on a
//! skirt in 343 PARTs), twice takes more time for the same. Limits: a vertex in no PART goes with the nearest along the cloth.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::{Csr, Dijkstra, Topology};
use crate::parts::{Parts, UNASSIGNED};

/// r: reach of a PART in half-widths. With 0.75 local steps take a tenth less time, and one of 120 settings of the dial ends 2 mm farther off; with
/// 1 and weights under 3 % left out, they take as long.
const REACH: f64 = 0.85;

/// The PARTs that move each vertex, and by how much; sorted by PART.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Weights(Csr<(u32, f64)>);

/// The vertices around a PART that it moves as well, with their kernel κ.
type Band = Arc<Vec<(u32, f64)>>;

/// Bands of the PARTs of the last table of a garment, by their vertices: two tables of a drag share most PARTs. A band depends on the
/// garment and on these vertices alone, so the bits do not depend on what is kept.
#[derive(Debug, Default)]
pub(crate) struct Bands(Mutex<HashMap<Vec<u32>, Band>>);

impl Bands {
    /// Weights of every vertex of the garment that the bands belong to; one of a piece of garment without any PART has none.
    pub(super) fn weights(&self, topology: &Topology, placed: &[DVec3], parts: &Parts) -> Weights {
        let owner = owners(topology, placed, parts);
        let mut members = vec![Vec::new(); parts.len()];
        for (v, &p) in owner.iter().enumerate().filter(|&(_, &p)| p != UNASSIGNED) {
            members[p as usize].push(v as u32);
        }
        // Not locked while it computes: a waiting thread may begin another table of the garment.
        let known: Vec<Option<Band>> = {
            let kept = self.lock();
            members.iter().map(|members| kept.get(members).cloned()).collect()
        };
        let bands: Vec<Band> = members
            .par_iter()
            .zip(known)
            .enumerate()
            .map_init(
                || None,
                |dijkstra, (p, (members, known))| {
                    known.unwrap_or_else(|| {
                        let dijkstra = dijkstra.get_or_insert_with(|| Dijkstra::new(topology, placed));
                        Arc::new(band(dijkstra, &owner, p as u32, members))
                    })
                },
            )
            .collect();
        let own = || (0..).zip(&owner).filter(|(_, p)| **p != UNASSIGNED).map(|(v, &p)| (v, (p, 1.0)));
        let around = || (0..).zip(&bands).flat_map(|(p, band)| band.iter().map(move |&(v, kernel)| (v, (p, kernel))));
        let rows = Csr::gathered(owner.len(), || own().chain(around()));
        *self.lock() = members.into_iter().zip(bands).collect();
        let mut weights = Weights::default();
        let mut row: Vec<(u32, f64)> = Vec::new();
        for v in 0..owner.len() {
            row.clear();
            row.extend_from_slice(rows.of(v));
            let sum: f64 = row.iter().map(|e| e.1).sum();
            row.sort_unstable_by_key(|e| e.0);
            weights.0.push(row.iter().map(|&(p, kernel)| (p, kernel / sum)));
        }
        weights
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Vec<u32>, Band>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Weights {
    /// Weights of every vertex; one of a piece of garment without any PART has none.
    #[must_use]
    pub fn new(topology: &Topology, placed: &[DVec3], parts: &Parts) -> Self {
        Bands::default().weights(topology, placed, parts)
    }

    /// Number of vertices.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// PARTs and weights of a vertex, by PART number.
    #[must_use]
    pub fn of(&self, v: usize) -> &[(u32, f64)] {
        self.0.of(v)
    }

    /// The same with no weight at the vertices that are held.
    #[must_use]
    pub(crate) fn without(self, held: &[bool]) -> Self {
        if !held.contains(&true) {
            return self;
        }
        let mut weights = Self::default();
        for (v, &held) in held.iter().enumerate() {
            weights.0.push(if held { &[] } else { self.of(v) }.iter().copied());
        }
        weights
    }
}

/// The PART of each vertex; one that lies in no level goes with the nearest PART along the cloth, if there is one.
fn owners(topology: &Topology, placed: &[DVec3], parts: &Parts) -> Vec<u32> {
    let mut owner = parts.part_of_vertex.clone();
    if parts.unassigned > 0 {
        let sources: Vec<u32> = (0..owner.len() as u32).filter(|&v| owner[v as usize] != UNASSIGNED).collect();
        let mut dijkstra = Dijkstra::new(topology, placed);
        dijkstra.run(&sources, f64::INFINITY, |_| true);
        for &v in &dijkstra.reached {
            owner[v as usize] = parts.part_of_vertex[dijkstra.source[v as usize] as usize];
        }
    }
    owner
}

/// Vertices outside PART p within its reach, and κ there.
fn band(dijkstra: &mut Dijkstra<'_>, owner: &[u32], p: u32, members: &[u32]) -> Vec<(u32, f64)> {
    let (placed, topology) = (dijkstra.positions, dijkstra.topology);
    let inside = |v: u32| owner[v as usize] == p;
    let across = |v: u32| topology.neighbours(v).iter().copied().filter(|&w| !inside(w));
    let seam: Vec<u32> = members.iter().copied().filter(|&v| across(v).next().is_some()).collect();
    let crossing = seam.iter().flat_map(|&v| across(v).map(move |w| (v, w)));
    let lengths = crossing.map(|(v, w)| placed[v as usize].distance(placed[w as usize]));
    let (sum, count) = lengths.fold((0.0, 0.0), |(s, c), l| (s + l, c + 1.0));
    if count == 0.0 {
        return Vec::new();
    }
    // The seam runs half an edge beyond the PART's own vertices.
    let half = 0.5 * sum / count;
    dijkstra.run(&seam, f64::INFINITY, inside);
    let half_width = half + dijkstra.reached.iter().map(|&v| dijkstra.distance[v as usize]).fold(0.0, f64::max);
    let reach = REACH * half_width;
    dijkstra.run(&seam, half + reach, |v| !inside(v));
    let kernel = |v: u32| {
        let t = (dijkstra.distance[v as usize] - half).max(0.0) / reach;
        (!inside(v)).then_some((v, (1.0 - t) * (1.0 - t)))
    };
    dijkstra.reached.iter().filter_map(|&v| kernel(v)).collect()
}
