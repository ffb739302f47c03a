//! The triangle mesh under change: half-edges stored three to a triangle, with split, collapse and flip.
//!
//! Half-edge h = 3t + i runs from its origin to the origin of the next one of its triangle; its twin runs back in the
//! neighbouring triangle and is [`NONE`] on a boundary. Every operation keeps the surface manifold with the same genus
//! and the same number of boundary loops (for the collapse: the link condition; Dey, Edelsbrunner, Guha, Nekhayev, 1999).
//! Inner edges are flipped towards even neighbour counts, or towards the Delaunay condition.

use glam::DVec3;

use super::{NONE, TriMesh, renumbered, retain};

/// A collapse may turn no triangle by more than 60°: the least cosine. A heuristic.
const MAX_TURN: f64 = 0.5;
/// A flip may turn neither triangle of the pair by more than 30° from their mean normal: the least cosine. A heuristic.
const MAX_FLIP_TURN: f64 = 0.866;
/// A flip by valence may make no triangle lower than this share of its longest side. A heuristic.
const MIN_FLIP_HEIGHT: f64 = 0.3;
/// Passes of Delaunay flips at most. A flip may violate the condition at a neighbouring edge.
const MAX_DELAUNAY_PASSES: usize = 3;

/// A triangle one of whose corners moves.
pub(crate) struct Moved {
    /// The corners before, the moving one first, m.
    pub(crate) corners: [DVec3; 3],
    /// Whether the triangle turns too far, or is left without area.
    pub(crate) turns: bool,
    /// Its longer side at the moving corner afterwards, m.
    pub(crate) longest: f64,
}

/// A manifold triangle mesh that can be split, collapsed and flipped.
#[derive(Debug, Clone, Default)]
pub(crate) struct HalfEdgeMesh {
    /// Vertex positions, m.
    pub(crate) positions: Vec<DVec3>,
    /// Which cut a boundary vertex lies on, from 1; 0 inside.
    pub(crate) tags: Vec<u8>,
    origin: Vec<u32>,
    twin: Vec<u32>,
    out: Vec<u32>,
    living: usize,
}

impl HalfEdgeMesh {
    /// Links the triangles; `None` if an edge has more than two triangles, or two of the same direction.
    pub(crate) fn new(mesh: &TriMesh, tags: Vec<u8>) -> Option<Self> {
        let count = 3 * mesh.triangles.len();
        let origin: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
        let mut halves: Vec<(u32, u32, u32)> = (0..count as u32)
            .map(|h| {
                let (a, b) = (origin[h as usize], origin[next(h) as usize]);
                (a.min(b), a.max(b), h)
            })
            .collect();
        halves.sort_unstable();
        let mut twin = vec![NONE; count];
        for run in halves.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            match *run {
                [_] => {}
                [(.., g), (.., h)] if origin[g as usize] != origin[h as usize] => {
                    twin[g as usize] = h;
                    twin[h as usize] = g;
                }
                _ => return None,
            }
        }
        let mut out = vec![NONE; mesh.positions.len()];
        for (h, &v) in origin.iter().enumerate() {
            out[v as usize] = h as u32;
        }
        let living = out.iter().filter(|&&h| h != NONE).count();
        Some(Self { positions: mesh.positions.clone(), tags, origin, twin, out, living })
    }

    pub(crate) fn half_edge_count(&self) -> usize {
        self.origin.len()
    }

    /// How many vertices have triangles.
    pub(crate) fn vertex_count(&self) -> usize {
        self.living
    }

    pub(crate) fn is_alive(&self, h: u32) -> bool {
        self.origin[h as usize] != NONE
    }

    pub(crate) fn origin(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    pub(crate) fn target(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    pub(crate) fn twin(&self, h: u32) -> u32 {
        self.twin[h as usize]
    }

    pub(crate) fn vector(&self, h: u32) -> DVec3 {
        self.positions[self.target(h) as usize] - self.positions[self.origin(h) as usize]
    }

    pub(crate) fn is_vertex_alive(&self, v: u32) -> bool {
        self.out[v as usize] != NONE
    }

    pub(crate) fn is_boundary(&self, v: u32) -> bool {
        self.tags[v as usize] != 0
    }

    /// One of each pair of half-edges.
    pub(crate) fn is_first(&self, h: u32) -> bool {
        self.is_alive(h) && (self.twin(h) == NONE || h < self.twin(h))
    }

    /// Calls `f` with every half-edge that leaves `v`.
    pub(crate) fn around(&self, v: u32, mut f: impl FnMut(u32)) {
        let start = self.out[v as usize];
        if start == NONE {
            return;
        }
        let mut h = start;
        loop {
            f(h);
            h = self.twin(previous(h));
            if h == start {
                return;
            }
            if h == NONE {
                break;
            }
        }
        h = start;
        while self.twin(h) != NONE {
            h = next(self.twin(h));
            f(h);
        }
    }

    /// Calls `f` with every neighbour of `v`.
    pub(crate) fn neighbours(&self, v: u32, mut f: impl FnMut(u32)) {
        self.around(v, |h| {
            f(self.target(h));
            let p = previous(h);
            if self.twin(p) == NONE {
                f(self.origin(p));
            }
        });
    }

    fn adjacent(&self, a: u32, b: u32) -> bool {
        let mut found = false;
        self.neighbours(a, |w| found |= w == b);
        found
    }

    fn pair(&mut self, g: u32, h: u32) {
        if g != NONE {
            self.twin[g as usize] = h;
        }
        if h != NONE {
            self.twin[h as usize] = g;
        }
    }

    /// Puts a vertex at the middle of an edge.
    pub(crate) fn split(&mut self, h0: u32) {
        let (h1, h2) = (next(h0), previous(h0));
        let (v0, v1, a) = (self.origin(h0), self.origin(h1), self.origin(h2));
        let g0 = self.twin(h0);
        let m = self.positions.len() as u32;
        self.positions.push(0.5 * (self.positions[v0 as usize] + self.positions[v1 as usize]));
        self.tags.push(if g0 == NONE { self.tags[v0 as usize] } else { 0 });
        self.living += 1;
        let k0 = self.origin.len() as u32;
        let outer = self.twin(h1);
        self.origin.extend([m, v1, a]);
        self.twin.extend([NONE; 3]);
        self.origin[h1 as usize] = m;
        self.pair(k0 + 1, outer);
        self.pair(h1, k0 + 2);
        self.out.push(k0);
        self.out[v0 as usize] = h0;
        self.out[v1 as usize] = k0 + 1;
        self.out[a as usize] = h2;
        if g0 == NONE {
            return;
        }
        let (g1, g2) = (next(g0), previous(g0));
        let b = self.origin(g2);
        let l0 = self.origin.len() as u32;
        let outer = self.twin(g1);
        self.origin.extend([m, v0, b]);
        self.twin.extend([NONE; 3]);
        self.origin[g1 as usize] = m;
        self.pair(l0 + 1, outer);
        self.pair(g1, l0 + 2);
        self.pair(h0, l0);
        self.pair(k0, g0);
        self.out[b as usize] = g2;
    }

    /// Whether collapsing `h` onto its target keeps the surface a manifold.
    pub(crate) fn can_collapse(&self, h: u32) -> bool {
        let (v0, v1) = (self.origin(h), self.target(h));
        let g = self.twin(h);
        if self.is_boundary(v0) && (!self.is_boundary(v1) || g != NONE) {
            return false;
        }
        let has_twin = g != NONE;
        let mut common = 0;
        self.neighbours(v0, |w| common += usize::from(self.adjacent(w, v1)));
        if common != 1 + usize::from(has_twin) || has_twin && self.origin(previous(h)) == self.origin(previous(g)) {
            return false;
        }
        let leaf = |h: u32| self.twin(next(h)) == NONE && self.twin(previous(h)) == NONE;
        !(leaf(h) || has_twin && leaf(g))
    }

    /// Removes the origin of `h`, joining it to the target, which moves to `at`.
    pub(crate) fn collapse(&mut self, h: u32, at: DVec3) {
        let (v0, v1) = (self.origin(h), self.target(h));
        let g = self.twin(h);
        let mut leaving = Vec::with_capacity(8);
        self.around(v0, |k| leaving.push(k));
        for k in leaving {
            self.origin[k as usize] = v1;
        }
        self.positions[v1 as usize] = at;
        self.out[v0 as usize] = NONE;
        self.living -= 1;
        for side in [h, g] {
            if side == NONE {
                continue;
            }
            // Of this side's triangle (v0, v1, a) or (v1, v0, b), join the two outer neighbours.
            let (n, p) = (next(side), previous(side));
            let apex = self.origin(p);
            let (outer_n, outer_p) = (self.twin(n), self.twin(p));
            self.pair(outer_n, outer_p);
            // `outer_n` runs from the apex to v1 (or the other way round on the far side, where both ends are v1 now).
            self.out[apex as usize] = if outer_n == NONE { next(outer_p) } else { outer_n };
            self.out[v1 as usize] = if outer_p == NONE { next(outer_n) } else { outer_p };
            for k in [side, n, p] {
                self.origin[k as usize] = NONE;
                self.twin[k as usize] = NONE;
            }
        }
    }

    /// Whether `h` is the first half of an edge between two triangles.
    fn is_inner(&self, h: u32) -> bool {
        self.is_first(h) && self.twin(h) != NONE
    }

    /// The ends of an inner edge, and the two vertices opposite to it.
    fn diamond(&self, h: u32) -> [u32; 4] {
        [self.origin(h), self.target(h), self.origin(previous(h)), self.origin(previous(self.twin(h)))]
    }

    /// Whether the angles opposite an inner edge add up to more than 180°.
    fn violates_delaunay(&self, h: u32) -> bool {
        let [p0, p1, pa, pb] = self.diamond(h).map(|v| self.positions[v as usize]);
        let cot = |x: DVec3, y: DVec3| x.dot(y) / x.cross(y).length().max(1e-30);
        cot(p0 - pa, p1 - pa) + cot(p0 - pb, p1 - pb) < -1e-9
    }

    /// Whether the pair still faces the same way after a flip, and neither triangle is lower than a share of its longest side.
    fn may_flip(&self, h: u32, min_height: f64) -> bool {
        let [p0, p1, pa, pb] = self.diamond(h).map(|v| self.positions[v as usize]);
        let old = (p1 - p0).cross(pa - p0).normalize_or_zero() + (p0 - p1).cross(pb - p1).normalize_or_zero();
        let old = old.normalize_or_zero();
        let diagonal = pa.distance(pb);
        let fits = |normal: DVec3, apex: DVec3| {
            let longest = diagonal.max(apex.distance(pa)).max(apex.distance(pb));
            normal.length() >= min_height * longest.powi(2) && normal.normalize_or_zero().dot(old) > MAX_FLIP_TURN
        };
        fits((p0 - pa).cross(pb - pa), p0) && fits((p1 - pb).cross(pa - pb), p1)
    }

    /// Replaces an inner edge by one between the two opposite vertices; false if these are neighbours already.
    pub(crate) fn flip(&mut self, h0: u32) -> bool {
        let g0 = self.twin(h0);
        let (h1, h2, g1, g2) = (next(h0), previous(h0), next(g0), previous(g0));
        let (v0, v1, a, b) = (self.origin(h0), self.origin(g0), self.origin(h2), self.origin(g2));
        if self.adjacent(a, b) {
            return false;
        }
        let (th1, th2, tg1, tg2) = (self.twin(h1), self.twin(h2), self.twin(g1), self.twin(g2));
        for (h, v) in [(h0, b), (h1, a), (h2, v0), (g0, a), (g1, b), (g2, v1)] {
            self.origin[h as usize] = v;
        }
        self.pair(h1, th2);
        self.pair(h2, tg1);
        self.pair(g1, tg2);
        self.pair(g2, th1);
        self.out[v0 as usize] = h2;
        self.out[v1 as usize] = g2;
        self.out[a as usize] = h1;
        self.out[b as usize] = g1;
        true
    }

    /// Calls `f` with every triangle at `v` that does not contain `gone`, as it is when `v` moves to `to`, m.
    pub(crate) fn around_moved(&self, v: u32, gone: u32, to: DVec3, mut f: impl FnMut(Moved)) {
        let from = self.positions[v as usize];
        self.around(v, |h| {
            let ends = [self.target(h), self.origin(previous(h))];
            if !ends.contains(&gone) {
                let [b, c] = ends.map(|v| self.positions[v as usize]);
                let (old, new) = ((b - from).cross(c - from), (b - to).cross(c - to));
                let turns = new.dot(old) < MAX_TURN * new.length() * old.length() || new.length_squared() <= 0.0;
                f(Moved { corners: [from, b, c], turns, longest: b.distance(to).max(c.distance(to)) });
            }
        });
    }

    /// The remaining triangles and vertices, renumbered in order, with the vertices' tags.
    pub(crate) fn compact(&self) -> (TriMesh, Vec<u8>) {
        let number = renumbered(self.out.len(), |v| self.out[v] != NONE);
        let (mut positions, mut tags) = (self.positions.clone(), self.tags.clone());
        retain(&mut positions, |v| number[v] != NONE);
        retain(&mut tags, |v| number[v] != NONE);
        let triangles = self
            .origin
            .chunks_exact(3)
            .filter(|t| t[0] != NONE)
            .map(|t| [0, 1, 2].map(|i| number[t[i] as usize]))
            .collect();
        (TriMesh::new(positions, triangles), tags)
    }
}

/// The next half-edge of the same triangle.
pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The previous half-edge of the same triangle.
pub(crate) fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// Flips inner edges where that brings the neighbour counts of the four vertices nearer to six (four on the boundary).
///
/// Neighbours are counted once for all vertices, then updated with every flip: counting them around four vertices for
/// every edge of a large mesh is bound by memory.
pub(crate) fn flip_by_valence(mesh: &mut HalfEdgeMesh) {
    let mut excess: Vec<i64> =
        (0..mesh.positions.len() as u32).map(|v| if mesh.is_boundary(v) { -4 } else { -6 }).collect();
    for h in (0..mesh.half_edge_count() as u32).filter(|&h| mesh.is_first(h)) {
        excess[mesh.origin(h) as usize] += 1;
        excess[mesh.target(h) as usize] += 1;
    }
    for h in 0..mesh.half_edge_count() as u32 {
        if !mesh.is_inner(h) {
            continue;
        }
        let [v0, v1, a, b] = mesh.diamond(h).map(|v| v as usize);
        let changes = [(v0, -1), (v1, -1), (a, 1), (b, 1)];
        let squares = |by: i64| changes.iter().map(|&(v, change)| (excess[v] + by * change).pow(2)).sum::<i64>();
        if squares(1) < squares(0) && mesh.may_flip(h, MIN_FLIP_HEIGHT) && mesh.flip(h) {
            changes.iter().for_each(|&(v, change)| excess[v] += change);
        }
    }
}

/// Flips inner edges whose opposite angles add up to more than 180°.
pub(crate) fn flip_to_delaunay(mesh: &mut HalfEdgeMesh) {
    for _ in 0..MAX_DELAUNAY_PASSES {
        let mut flips = 0;
        for h in 0..mesh.half_edge_count() as u32 {
            let flipped = mesh.is_inner(h) && mesh.violates_delaunay(h) && mesh.may_flip(h, 0.0) && mesh.flip(h);
            flips += usize::from(flipped);
        }
        if flips == 0 {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    /// Σ (neighbours − those it should have)², from the triangles alone.
    fn uneven(mesh: &HalfEdgeMesh) -> i64 {
        let mut over: Vec<i64> = mesh.tags.iter().map(|&tag| if tag == 0 { -6 } else { -4 }).collect();
        for v in 0..over.len() as u32 {
            mesh.neighbours(v, |_| over[v as usize] += 1);
        }
        over.iter().map(|over| over * over).sum()
    }

    #[test]
    fn flips_by_valence_even_out_the_neighbour_counts() {
        let n: u32 = 12;
        let mut crossed = sheet(n, n, |i, j| DVec3::new(i, j, 0.0) * 0.01);
        // Every other diagonal the other way: eight neighbours and four by turns.
        for (square, pair) in (0..).zip(crossed.triangles.as_chunks_mut::<2>().0) {
            let [[a, b, d], [_, _, c]] = *pair;
            if (square + square / n).is_multiple_of(2) {
                *pair = [[a, b, c], [b, d, c]];
            }
        }
        let rim = |p: &DVec3| u8::from([p.x, p.y].iter().any(|&x| x < 1e-9 || x > 0.01 * f64::from(n) - 1e-9));
        let tags = crossed.positions.iter().map(rim).collect();
        let mut mesh = HalfEdgeMesh::new(&crossed, tags).unwrap();
        let before = uneven(&mesh);
        flip_by_valence(&mut mesh);
        let after = uneven(&mesh);
        assert!(after < before / 3, "{before} to {after}");
        // A second pass recounts the neighbours; it improves on the first only if the counts of the first were right.
        flip_by_valence(&mut mesh);
        assert!(uneven(&mesh) <= after, "{after} to {}", uneven(&mesh));
    }
}
