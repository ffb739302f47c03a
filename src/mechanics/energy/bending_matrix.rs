//! Bending's quadratic form summed up over its elements: a scalar for every pair of vertices that bend together.
//!
//! E = ½ Σ Q_ij x_i·x_j, and the rows of Q sum to zero, so the gradient is
//!
//! (Q x)_i = Σ_j Q_ij (x_j − x_i):
//!
//! what a pair adds to one vertex it takes from the other, and E = ½ Σ x_i·(Q x)_i. Differences keep digits that coordinates
//! lose: without them the energy of a skirt would be off by 10⁻¹³ J, which a line search feels.
//! The product costs a sixth of the elements one by one.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | Q_ij | sum of the elements' scalars for a pair of vertices | N/m |

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::base::simd::{Four, Lanes, Pack};
use crate::mesh::Lists;

/// The pairs j < i with Q_ij, by i, two at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct Plate {
    twos: Lists<Two>,
    /// Q_ii, N/m: what its pairs add up to.
    own: Vec<f64>,
}

/// Two pairs of one i.
#[derive(Debug, Clone, Copy)]
struct Two {
    others: [u32; 2],
    scalars: [f64; 2],
}

/// Vertices that a thread takes at a time.
const CHUNK: usize = 256;

/// The pairs j < i of the elements that i is in, each with its place there, by twos; equal ones summed in the order of the elements.
fn gather<'a>(
    i: u32,
    elements: impl Iterator<Item = (&'a (&'a [u32], &'a [DVec3], DVec3), usize)>,
    row: &mut Vec<(u32, f64)>,
    twos: &mut Lists<Two>,
) {
    row.clear();
    for ((vertices, weights, stiffness), at) in elements {
        for (k, &j) in vertices.iter().enumerate().filter(|(_, j)| **j < i) {
            row.push((j, (weights[at.max(k)] * *stiffness).dot(weights[at.min(k)])));
        }
    }
    // Sorts are stable, so that equal entries stay in their order.
    row.sort_by_key(|e| e.0);
    row.dedup_by(|later, first| {
        let same = later.0 == first.0;
        if same {
            first.1 += later.1;
        }
        same
    });
    // Filled up by what it has already, and not by i, whose sum the product keeps to itself.
    if let (1, Some(&(j, _))) = (row.len() % 2, row.first()) {
        row.push((j, 0.0));
    }
    twos.push(row.as_chunks::<2>().0.iter().map(|two| Two { others: two.map(|e| e.0), scalars: two.map(|e| e.1) }));
}

impl Plate {
    /// From elements: vertices, weights and stiffness of each.
    pub(super) fn new(vertices: usize, elements: &[(&[u32], &[DVec3], DVec3)]) -> Self {
        // Each vertex's elements in their order, and its place in them.
        let of = Lists::gathered(vertices, || {
            let numbered = (0u32..).zip(elements);
            numbered.flat_map(|(e, element)| (0u32..).zip(element.0).map(move |(k, &v)| (v, (e, k))))
        });
        let numbers: Vec<usize> = (0..vertices).collect();
        let rows: Vec<Lists<Two>> = (numbers.par_chunks(CHUNK))
            .map(|chunk| {
                let (mut twos, mut row) = (Lists::default(), Vec::new());
                for &i in chunk {
                    let own = of.of(i).iter().map(|&(e, k)| (&elements[e as usize], k as usize));
                    gather(i as u32, own, &mut row, &mut twos);
                }
                twos
            })
            .collect();
        let mut plate = Self { own: vec![0.0; vertices], ..Self::default() };
        rows.into_iter().for_each(|twos| plate.twos.append(twos));
        for i in 0..vertices {
            for two in plate.twos.of(i) {
                for (j, scalar) in two.others.into_iter().zip(two.scalars) {
                    plate.own[i] -= scalar;
                    plate.own[j as usize] -= scalar;
                }
            }
        }
        plate
    }

    /// Every pair j < i as [i, j] with Q_ij, N/m; a few twice, the second time with nothing.
    pub(super) fn pairs(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        let both = move |i: usize, two: &Two| [0, 1].map(|k| ([i as u32, two.others[k]], two.scalars[k]));
        (0..self.own.len()).flat_map(move |i| self.twos.of(i).iter().flat_map(move |two| both(i, two)))
    }

    /// Q_ii, N/m.
    pub(super) fn own(&self, i: usize) -> f64 {
        self.own[i]
    }

    /// Two ranges of vertices with about as many pairs each: as much work for [`add_gradient`](Self::add_gradient).
    pub(super) fn halves(&self) -> [Range<usize>; 2] {
        let (vertices, all) = (self.twos.len(), self.twos.entries().len());
        let middle = self.twos.starts().partition_point(|&s| 2 * (s as usize) < all).min(vertices);
        [0..middle, middle..vertices]
    }

    /// Adds the gradient of the pairs of `vertices` (each with those before it) to `gradient`, N, which must be zero before; returns their energy, J.
    #[inline(always)]
    pub(super) fn add_gradient<L: Lanes>(
        &self,
        l: L,
        vertices: Range<usize>,
        x: &[Four],
        gradient: &mut [Four],
    ) -> f64 {
        // Of one length, so that one check of an index does for both.
        let gradient = &mut gradient[..x.len()];
        for i in vertices {
            let here = l.load(&x[i]);
            let mut sum = l.load(&gradient[i]);
            for two in self.twos.of(i) {
                let [j, k] = [two.others[0] as usize, two.others[1] as usize];
                // What the other gets; in this order a load is an operand and no instruction of its own.
                let push = l.mul(l.sub(here, l.load(&x[j])), l.splat(two.scalars[0]));
                sum = l.sub(sum, push);
                gradient[j] = l.store(l.add(push, l.load(&gradient[j])));
                let push = l.mul(l.sub(here, l.load(&x[k])), l.splat(two.scalars[1]));
                sum = l.sub(sum, push);
                gradient[k] = l.store(l.add(push, l.load(&gradient[k])));
            }
            gradient[i] = l.store(sum);
        }
        let mut energy = Pack::splat(l, 0.0);
        for (x, g) in x.iter().zip(&*gradient) {
            energy = energy + Pack::load(l, x) * Pack::load(l, g);
        }
        0.5 * energy.sum()
    }
}
