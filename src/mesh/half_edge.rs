//! The triangle mesh under change: half-edges stored three to a triangle, with the four local operations on them.
//!
//! Half-edge h = 3t + i runs from its origin to the origin of the next one of its triangle; its twin runs back in the
//! neighbouring triangle and is [`NONE`] on a boundary. Every operation keeps the surface manifold with the same genus
//! and the same number of boundary loops (for the collapse: the link condition; Dey, Edelsbrunner, Guha, Nekhayev, 1999).

use glam::DVec3;

use super::{NONE, TriMesh, renumbered, retain};

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

    /// The two vertices opposite an edge.
    pub(crate) fn opposite(&self, h: u32) -> (u32, Option<u32>) {
        let g = self.twin(h);
        (self.origin(previous(h)), (g != NONE).then(|| self.origin(previous(g))))
    }

    /// Whether collapsing `h` onto its target keeps the surface a manifold.
    pub(crate) fn can_collapse(&self, h: u32) -> bool {
        let (v0, v1) = (self.origin(h), self.target(h));
        let g = self.twin(h);
        if self.is_boundary(v0) && (!self.is_boundary(v1) || g != NONE) {
            return false;
        }
        let (a, b) = self.opposite(h);
        let mut common = 0;
        self.neighbours(v0, |w| common += usize::from(self.adjacent(w, v1)));
        if common != 1 + usize::from(b.is_some()) || Some(a) == b {
            return false;
        }
        let leaf = |h: u32| self.twin(next(h)) == NONE && self.twin(previous(h)) == NONE;
        !(leaf(h) || g != NONE && leaf(g))
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

    /// Turns an inner edge to join the two opposite vertices; false where they are joined already.
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

    /// The living triangles and vertices, renumbered in order, with the vertices' tags.
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
