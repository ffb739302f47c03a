//! Segmentation of the body into trunk, hip, head and limbs.
//!
//! The geodesic distance from the body's highest vertex is cut into bands; the connected pieces of a band are its
//! rings, and rings of neighbouring bands that touch form a graph (a Reeb graph; Reeb 1946, for bodies Hilaga and
//! others: "Topology matching", SIGGRAPH 2001). A unit ends where the graph branches, at armpits and crotch. A unit too
//! short to be a limb joins its parent. A unit between two branchings, the torso, is cut once more at the waist, its narrowest
//! ring: trunk and hip.
//!
//! Our reading: the source says that arms, legs, trunk and hip are segmented, not how.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use glam::{DMat3, DVec3};
use ordered_float::OrderedFloat;

use crate::mesh::{Csr, Dijkstra, NONE, Topology, TriMesh, outer, pieces};

/// Bands from the highest vertex to the farthest. More bands resolve shorter limbs, and leave fewer triangles a ring. A heuristic.
const BANDS: f64 = 56.0;
/// Fewest bands of a unit; shorter ones join a neighbour. A heuristic.
const MIN_BANDS: usize = 5;
/// Smallest share of its band's area that a ring has; smaller ones are noise. A heuristic.
const MIN_SHARE: f64 = 0.02;

/// The units of a body.
#[derive(Debug, Clone)]
pub(crate) struct Segments {
    /// Unit of each triangle.
    pub of_triangle: Vec<u32>,
    /// Whether each unit is a limb or the head: one with a free end.
    pub is_limb: Vec<bool>,
}

/// A ring: a connected piece of a band.
#[derive(Debug, Clone, Default)]
struct Ring {
    band: usize,
    area: f64,
    parents: BTreeSet<usize>,
    children: BTreeSet<usize>,
}

impl Segments {
    /// The units of a closed body. For an open one the error says that no `part` of it has an inside.
    pub(super) fn of_closed(mesh: &TriMesh, part: &str) -> Result<Self, String> {
        let topology = Topology::new(mesh);
        match topology.boundary_edges().count() {
            0 => Ok(Self::new(mesh, &topology)),
            open => Err(format!("the body is not closed ({open} boundary edges), so no {part} of it has an inside")),
        }
    }

    /// The units of any body; each component has its own.
    pub(crate) fn new(mesh: &TriMesh, topology: &Topology) -> Self {
        let distance = geodesics(mesh, topology);
        let farthest = distance.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        let edge =
            topology.edges.iter().map(|&[a, b]| length(mesh, a, b)).sum::<f64>() / topology.edges.len().max(1) as f64;
        let width = (farthest / BANDS).max(1.5 * edge);
        let band_of = |t: &[u32; 3]| {
            let mean = t.iter().map(|&v| distance[v as usize]).sum::<f64>() / 3.0;
            if mean.is_finite() { (mean / width) as usize } else { usize::MAX }
        };
        let band: Vec<usize> = mesh.triangles.iter().map(band_of).collect();
        let (ring_of, rings) = rings(mesh, topology, &band);
        let unit_of_ring = units(&rings);
        let count = unit_of_ring.iter().max().map_or(0, |m| m + 1);
        // A unit with other units before and after it lies between two branchings.
        let (mut has_children, mut has_parents) = (vec![false; count], vec![false; count]);
        for (ring, &unit) in rings.iter().zip(&unit_of_ring) {
            has_children[unit] |= ring.children.iter().any(|&c| unit_of_ring[c] != unit);
            has_parents[unit] |= ring.parents.iter().any(|&p| unit_of_ring[p] != unit);
        }
        let is_limb = has_children.iter().zip(has_parents).map(|(on, from)| !(*on && from)).collect();
        let of_triangle = ring_of.iter().map(|&r| unit_of_ring[r] as u32).collect();
        Self { of_triangle, is_limb }
    }
}

fn length(mesh: &TriMesh, a: u32, b: u32) -> f64 {
    mesh.positions[a as usize].distance(mesh.positions[b as usize])
}

/// Distance along edges from the highest vertex, m; components without it have their own highest.
fn geodesics(mesh: &TriMesh, topology: &Topology) -> Vec<f64> {
    let mut distance = vec![f64::INFINITY; mesh.vertex_count()];
    let mut by_height: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
    by_height.sort_by_key(|&v| (Reverse(OrderedFloat(mesh.positions[v as usize].z)), v));
    let mut dijkstra = Dijkstra::new(topology, &mesh.positions);
    for start in by_height {
        if distance[start as usize].is_finite() || topology.neighbours(start).is_empty() {
            continue;
        }
        dijkstra.run(&[start], f64::INFINITY, |_| true);
        dijkstra.reached.iter().for_each(|&v| distance[v as usize] = dijkstra.distance[v as usize]);
    }
    distance
}

/// The ring of each triangle, and the rings with their neighbours; noise joins the ring with the longest common border.
fn rings(mesh: &TriMesh, topology: &Topology, band: &[usize]) -> (Vec<usize>, Vec<Ring>) {
    let n = mesh.triangles.len();
    let joined = || {
        let inner = topology.edge_triangles.iter().zip(&topology.edge_valence);
        inner.filter(|(pair, valence)| **valence > 1 && pair[1] != NONE).map(|(pair, _)| *pair)
    };
    let beside = Csr::gathered(n, || joined().flat_map(|[s, t]| [(s, t), (t, s)]));
    let areas = mesh.triangle_areas();
    let mut band = band.to_vec();
    // Noise takes the band of its neighbour; the next round makes it part of that ring.
    for round in 0.. {
        let (ring_of, mut rings) = flood(&beside, &band, &areas);
        let mut of_band = std::collections::BTreeMap::<usize, f64>::new();
        rings.iter().for_each(|r| *of_band.entry(r.band).or_default() += r.area);
        let mut border = vec![std::collections::BTreeMap::<usize, usize>::new(); rings.len()];
        for t in 0..n {
            for s in beside.of(t).iter().map(|&s| s as usize).filter(|&s| ring_of[s] != ring_of[t]) {
                *border[ring_of[t]].entry(band[s]).or_default() += 1;
            }
        }
        let noise = |r: usize| rings[r].area < MIN_SHARE * of_band[&rings[r].band] && !border[r].is_empty();
        if round < 3 && (0..rings.len()).any(noise) {
            for t in 0..n {
                if noise(ring_of[t]) {
                    let longest = border[ring_of[t]].iter().max_by_key(|(band, count)| (**count, Reverse(**band)));
                    band[t] = longest.map_or(band[t], |(band, _)| *band);
                }
            }
            continue;
        }
        for t in 0..n {
            for &s in beside.of(t) {
                let (a, b) = (ring_of[t], ring_of[s as usize]);
                if rings[a].band < rings[b].band {
                    rings[a].children.insert(b);
                    rings[b].parents.insert(a);
                }
            }
        }
        return (ring_of, rings);
    }
    (Vec::new(), Vec::new())
}

/// Connected pieces of bands.
fn flood(beside: &Csr<u32>, band: &[usize], areas: &[f64]) -> (Vec<usize>, Vec<Ring>) {
    let mut ring_of = vec![0; band.len()];
    let mut rings: Vec<Ring> = Vec::new();
    for piece in pieces(band.len(), |t| beside.of(t), |t, s| band[t] == band[s]) {
        let mut ring = Ring { band: band[piece[0] as usize], ..Ring::default() };
        for t in piece.into_iter().map(|t| t as usize) {
            ring.area += areas[t];
            ring_of[t] = rings.len();
        }
        rings.push(ring);
    }
    (ring_of, rings)
}

/// The unit of each ring.
fn units(rings: &[Ring]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rings.len()).collect();
    order.sort_by_key(|&r| (rings[r].band, r));
    let mut chain = vec![usize::MAX; rings.len()];
    let mut chains: Vec<Vec<usize>> = Vec::new();
    for &r in &order {
        let only = |set: &BTreeSet<usize>| (set.len() == 1).then(|| set.iter().next().copied()).flatten();
        let parent = only(&rings[r].parents).filter(|&p| only(&rings[p].children) == Some(r));
        match parent.map(|p| chain[p]).filter(|&c| c != usize::MAX) {
            Some(c) => {
                chain[r] = c;
                chains[c].push(r);
            }
            None => {
                chain[r] = chains.len();
                chains.push(vec![r]);
            }
        }
    }
    join_short(rings, &mut chain, &mut chains);
    cut_waists(rings, &mut chain, &mut chains);
    // Renumbered without the empty ones.
    let mut number = vec![usize::MAX; chains.len()];
    let mut next = 0;
    order.iter().for_each(|&r| {
        if number[chain[r]] == usize::MAX {
            number[chain[r]] = next;
            next += 1;
        }
    });
    chain.iter().map(|&c| number[c]).collect()
}

/// The principal axis of weighted points about the origin, by power iteration on their covariance.
pub(super) fn principal_axis(points: impl Iterator<Item = (DVec3, f64)>) -> DVec3 {
    let mut covariance = DMat3::ZERO;
    for (p, w) in points {
        covariance += outer(p, p) * w;
    }
    let mut axis = DVec3::new(0.31, 0.17, 1.0);
    for _ in 0..200 {
        axis = (covariance * axis).normalize_or(DVec3::Z);
    }
    axis
}

/// Joins short chains to a neighbour: the one before them, else one after.
fn join_short(rings: &[Ring], chain: &mut [usize], chains: &mut [Vec<usize>]) {
    for c in 0..chains.len() {
        if chains[c].is_empty() || chains[c].len() >= MIN_BANDS {
            continue;
        }
        let neighbours = |pick: fn(&Ring) -> &BTreeSet<usize>| {
            chains[c].iter().flat_map(move |&r| pick(&rings[r])).map(|&r| chain[r]).filter(|&other| other != c)
        };
        let longest = |found: Vec<usize>| found.into_iter().max_by_key(|&other| (chains[other].len(), Reverse(other)));
        let into =
            longest(neighbours(|r| &r.parents).collect()).or_else(|| longest(neighbours(|r| &r.children).collect()));
        if let Some(into) = into {
            let moved = std::mem::take(&mut chains[c]);
            moved.iter().for_each(|&r| chain[r] = into);
            chains[into].extend(moved);
        }
    }
}

/// Cuts chains between two branchings at the narrowest band of their middle half.
fn cut_waists(rings: &[Ring], chain: &mut [usize], chains: &mut Vec<Vec<usize>>) {
    for c in 0..chains.len() {
        let has_children = |r: &usize| rings[*r].children.iter().any(|&k| chain[k] != c);
        let has_parents = |r: &usize| rings[*r].parents.iter().any(|&k| chain[k] != c);
        let (true, true) = (chains[c].iter().any(has_children), chains[c].iter().any(has_parents)) else { continue };
        if chains[c].len() < 2 * MIN_BANDS {
            continue;
        }
        let bands: BTreeSet<usize> = chains[c].iter().map(|&r| rings[r].band).collect();
        let (Some(&first), Some(&last)) = (bands.first(), bands.last()) else { continue };
        let area =
            |band: usize| -> f64 { chains[c].iter().filter(|&&r| rings[r].band == band).map(|&r| rings[r].area).sum() };
        let quarter = (last - first) / 4;
        let waist = (first + quarter..=last - quarter).min_by(|&a, &b| area(a).total_cmp(&area(b)));
        let Some(waist) = waist else { continue };
        let (above, below): (Vec<usize>, Vec<usize>) = chains[c].iter().partition(|&&r| rings[r].band <= waist);
        below.iter().for_each(|&r| chain[r] = chains.len());
        chains[c] = above;
        chains.push(below);
    }
}
