//! Where a drape starts whose cloth crosses itself there.
//!
//! Two places are known: where the drape would start, from a preview that knows nothing of cloth on cloth, and where the cloth was
//! before, mostly clear of itself: how it was placed, or put over what lies below it ([`Cloth::clear_at`](crate::mechanics::energy::Cloth)).
//!
//! 1. Where nothing crosses at the second, the start is the farthest point on the straight way from there to the first, of shares 0.7ⁿ,
//!    at which nothing does ([`clear`](Proximity::clear)).
//! 2. Where something does, the start is untangled (`untangle.rs`); where that leaves more than twice as much as crosses at the second,
//!    the drape starts from there instead, untangled in turn ([`clearer`](Proximity::clearer)).
//!
//! To start from the second wherever less crosses there was tried and is worse: coarse trousers of two layers, of which 44 pairs cross as
//! placed and 54 are left of their preview, rest in 238 steps from there, in an eighth of that time from the preview. Where it helps it
//! is not close: of 39,000 vertices in denim 36 cross as placed, and 2,103 are left.
//!
//! Limits: pairs are counted, not how deep they cross.

use glam::DVec3;

use super::Proximity;

/// A start that crosses goes back by this factor at a time,
const BACK: f64 = 0.7;

/// and is as it was placed where this share of the way still crosses.
const LEAST_SHARE: f64 = 0.02;

/// What is left of a start must cross in this many times as many pairs as where the cloth was placed, for that to be worth starting from.
const TANGLED: usize = 2;

impl Proximity {
    /// Takes `x` (m) back towards where the cloth is clear of itself, how it was placed mostly, until nothing crosses; leaves it as it is
    /// where something crosses there too.
    pub(crate) fn clear(&mut self, x: &mut Vec<DVec3>) {
        if self.passage.known(x).is_empty() || !self.passage.anew(&self.clear).is_empty() {
            return;
        }
        let end = std::mem::take(x);
        let mut share = 1.0;
        while share > LEAST_SHARE {
            share *= BACK;
            let there: Vec<DVec3> = self.clear.iter().zip(&end).map(|(a, b)| a.lerp(*b, share)).collect();
            if self.passage.anew(&there).is_empty() {
                *x = there;
                break;
            }
        }
        if x.is_empty() {
            x.clone_from(&self.clear);
        }
        self.passage.begin(Vec::new());
    }

    /// Where to start from instead of `x` (m), if less than half of what crosses at `x` crosses there. The steps then go on from there.
    pub(crate) fn clearer(&mut self, x: &[DVec3]) -> Option<Vec<DVec3>> {
        let left = self.crossings(x);
        if left == 0 {
            return None;
        }
        let there = self.passage.anew(&self.clear);
        if TANGLED * there.len() >= left {
            return None;
        }
        self.passage.begin(there);
        (self.fewest, self.since) = (usize::MAX, 0);
        Some(self.clear.to_vec())
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::mechanics::energy::Cloth;
    use crate::mesh::TriMesh;
    use crate::mesh::samples::sheet;

    /// A sheet folded over, whose upper layer is under the lower one in those rows: it crosses it where it changes sides.
    fn folded(under: impl Fn(u32) -> bool) -> TriMesh {
        sheet(14, 14, |i, j| {
            let upper = if under(j as u32) { -0.4 } else { 0.6 };
            let height = upper * ((i - 6.0) / 2.0).clamp(0.0, 1.0);
            DVec3::new(i.min(14.0 - i) + 0.3 * height, j, height) * 0.01
        })
    }

    #[test]
    fn a_start_goes_back_to_where_nothing_crosses() {
        let mesh = folded(|_| false);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        assert_eq!(cloth.proximity().crossings(&mesh.positions), 0);
        let tangled = folded(|j| j % 4 < 2).positions;
        let mut start = tangled.clone();
        let mut itself = cloth.proximity();
        itself.clear(&mut start);
        assert!(start != tangled && start != mesh.positions, "part of the way is clear as well");
        assert_eq!(cloth.proximity().crossings(&start), 0);
        assert!(itself.clearer(&start).is_none());
    }

    #[test]
    fn what_is_left_tangled_starts_from_where_much_less_crosses() {
        let mesh = folded(|j| j < 1);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        let there = cloth.proximity().crossings(&mesh.positions);
        // Over twice as much, hardly more, and as placed.
        let many = folded(|j| j % 4 < 2).positions;
        let few = folded(|j| j < 1 || j == 14).positions;
        for (left, goes) in [(&many, true), (&few, false), (&mesh.positions, false)] {
            let mut itself = cloth.proximity();
            let crossing = itself.crossings(left);
            assert_eq!(crossing > 2 * there, goes, "{crossing} and {there}");
            let mut stays = left.clone();
            itself.clear(&mut stays);
            assert_eq!(&stays, left, "where it was placed crosses too");
            let back = itself.clearer(left);
            assert_eq!(back.as_ref(), goes.then_some(&mesh.positions));
            assert_eq!(itself.crossings(back.as_ref().unwrap_or(left)), if goes { there } else { crossing });
        }
    }
}
