//! Skin through cloth: where the body reaches through a triangle whose corners are all outside, places within it are kept off as well.
//!
//! Contact is felt at the vertices. Where the body is rounder than the cloth's mesh is fine, it reaches through the middle of a triangle. What
//! crosses is found exactly (`mesh::self_intersection`). In each such triangle and those beside it the places of a lattice that are deepest
//! in the body become contacts of their own (`proximity::place`): they push the three corners by their shares, with friction, and let go as a
//! vertex does. Where a triangle's places all are outside and it crosses still, they keep farther off. Each time follows when the cloth has
//! come to rest again. An end of the body that sticks through is taken inside first (`distance::ends`).
//!
//! Limits: what is too tight to be covered is let go again, and counted by whoever asks.

use glam::DVec3;

use super::membrane::Triangle;
use super::proximity::{Gap, Place, offset};
use super::{Cloth, Contacts};
use crate::body::distance::{Body, pull_off_protrusions};
use crate::mesh::TriMesh;
use crate::mesh::lattice::lattice;
use crate::mesh::self_intersection::crossing_pairs;

/// It is raised by so much at a time, and in all, m.
const RAISE: f64 = 3e-4;
const FARTHEST: f64 = 4e-3;

/// Pressure that takes up half of it, Pa: that of the contact at vertices.
const HALF_OFFSET_PRESSURE: f64 = 2000.0;

/// New places in a triangle at a time, and how far apart they are at least, in its longest side.
const AT_A_TIME: usize = 6;
const APART: f64 = 0.2;

/// Share of what it keeps under which a place is near.
const NEAR: f64 = 0.5;

/// Rounds that brought nothing after which it ends.
const IDLE: usize = 3;

/// Times that an end of the body is taken inside, at most.
const ENDS: usize = 3;

/// The places that keep off the body, and what covering has done so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cover {
    places: Vec<Place>,
    fewest: Option<usize>,
    idle: usize,
    ends: usize,
    given_up: bool,
}

/// What covering asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Covered {
    /// Nothing: no skin is through the cloth, or nothing helps.
    Done,
    /// Places are kept off that were not before, or farther, or are let go.
    Places,
    /// The cloth was taken off an end of the body, and is far from rest.
    Moved,
}

impl Contacts<'_> {
    /// Covers the skin that is through the cloth at `x` (m), where it rests. Takes effect with the next [`update`](Self::update) and
    /// [`refresh`](Self::refresh).
    pub(crate) fn cover(&mut self, cloth: &Cloth, x: &mut Vec<DVec3>) -> Covered {
        let Some(body) = self.body() else { return Covered::Done };
        if self.cover.given_up {
            return Covered::Done;
        }
        let garment = mesh_of(cloth, std::mem::take(x));
        let pairs = crossing_pairs(&garment, body.mesh());
        if !pairs.is_empty() && self.cover.ends < ENDS {
            self.cover.ends += 1;
            let taken = pull_off_protrusions(body, &garment, &cloth.held);
            let itself = self.proximity.as_mut();
            if let Some(taken) = taken.filter(|taken| itself.is_none_or(|p| p.put(&garment.positions, taken))) {
                *x = taken;
                return Covered::Moved;
            }
        }
        *x = garment.positions;
        let changed = self.cover.around(cloth, body, x, &pairs);
        if changed > 0 { Covered::Places } else { Covered::Done }
    }

    /// Lets all places go, for good, where the cloth does not come to rest with them.
    pub(crate) fn uncover(&mut self) {
        self.cover = Cover { given_up: true, ..Cover::default() };
    }

    /// The same near rest, where places had to be kept off before: adds what is through the cloth by now. How many places are new.
    pub(crate) fn cover_more(&mut self, cloth: &Cloth, x: &[DVec3]) -> usize {
        let (false, false, Some(body)) = (self.cover.given_up, self.cover.places.is_empty(), self.body()) else {
            return 0;
        };
        let garment = mesh_of(cloth, x.to_vec());
        let mut crossing: Vec<u32> = crossing_pairs(&garment, body.mesh()).into_iter().map(|[t, _]| t).collect();
        crossing.dedup();
        crossing.into_iter().map(|t| self.cover.add(cloth, &cloth.triangles[t as usize], body, x, true)).sum()
    }
}

fn mesh_of(cloth: &Cloth, x: Vec<DVec3>) -> TriMesh {
    TriMesh::new(x, cloth.triangles.iter().map(|t| t.vertices).collect())
}

impl Cover {
    /// The gaps to `body` at `x` (m).
    pub(super) fn gaps(&self, body: Option<&Body>, x: &[DVec3]) -> Vec<Gap> {
        let Some(body) = body else { return Vec::new() };
        let kept = (0..).zip(&self.places).filter(|(_, place)| place.stiffness > 0.0);
        kept.filter_map(|(number, place)| place.gap(number, body, x)).collect()
    }

    /// Keeps places about these `pairs` of triangles that cross off the body; returns how many are new, farther off or let go.
    fn around(&mut self, cloth: &Cloth, body: &Body, x: &[DVec3], pairs: &[[u32; 2]]) -> usize {
        let fewer = self.fewest.is_none_or(|fewest| pairs.len() < fewest);
        self.idle = if fewer { 0 } else { self.idle + 1 };
        self.fewest = Some(self.fewest.map_or(pairs.len(), |fewest| fewest.min(pairs.len())));
        if pairs.is_empty() {
            return 0;
        }
        let mut crosses = vec![false; cloth.triangles.len()];
        pairs.iter().for_each(|[t, _]| crosses[*t as usize] = true);
        let crossing = || cloth.triangles.iter().zip(&crosses).filter(|(_, crosses)| **crosses).map(|(t, _)| t);
        if self.idle >= IDLE {
            self.given_up = true;
            return self.let_go(crossing());
        }
        let mut at_corner = vec![false; x.len()];
        crossing().flat_map(|t| t.vertices).for_each(|v| at_corner[v as usize] = true);
        let beside = |t: &Triangle| t.vertices.iter().filter(|v| at_corner[**v as usize]).count() > 1;
        let mut changed = 0;
        for (t, &crosses) in cloth.triangles.iter().zip(&crosses).filter(|(t, _)| beside(t)) {
            let new = self.add(cloth, t, body, x, crosses);
            changed += if new == 0 && crosses { self.raise(cloth, t) } else { new };
        }
        changed
    }

    /// Keeps the places of a triangle off that are deepest in the body; how many are new.
    fn add(&mut self, cloth: &Cloth, triangle: &Triangle, body: &Body, x: &[DVec3], crosses: bool) -> usize {
        let (corners, longest) = (triangle.vertices, triangle.longest_side_m());
        let offset = offset(cloth, triangle);
        let stiffness = 2.0 * HALF_OFFSET_PRESSURE / offset * triangle.area / 3.0;
        let all: Vec<Place> = lattice(longest).map(|shares| Place { corners, shares, offset, stiffness }).collect();
        let at: Vec<DVec3> = all.iter().map(|place| place.at(x)).collect();
        let found = body.nearest_all(&at);
        let out = found.iter().zip(0..).filter(|(near, i)| all[*i].leads_out(near, x));
        let mut deepest: Vec<(f64, usize)> = out.map(|(near, i)| (near.signed_distance, i)).collect();
        deepest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let of_triangle: Vec<Place> = self.places.iter().filter(|p| p.corners == corners).copied().collect();
        let mut added: Vec<DVec3> = Vec::new();
        for (distance, i) in deepest {
            let first = crosses && added.is_empty() && distance < offset;
            let wanted = first || distance < NEAR * offset;
            let known = || of_triangle.iter().any(|p| p.shares == all[i].shares);
            if !wanted || added.len() == AT_A_TIME {
                break;
            }
            if added.iter().all(|p| p.distance(at[i]) > APART * longest) && !known() {
                added.push(at[i]);
                self.places.push(all[i]);
            }
        }
        added.len()
    }

    /// Keeps the places of a triangle farther off; how many.
    fn raise(&mut self, cloth: &Cloth, triangle: &Triangle) -> usize {
        let most = offset(cloth, triangle) + FARTHEST;
        let of_triangle = self.places.iter_mut().filter(|p| p.corners == triangle.vertices && p.offset < most);
        of_triangle.map(|place| place.offset += RAISE).count()
    }

    /// A place too tight to be covered is not stretched for it; how many are let go.
    fn let_go<'t>(&mut self, tight: impl Iterator<Item = &'t Triangle>) -> usize {
        let tight: Vec<[u32; 3]> = tight.map(|t| t.vertices).collect();
        let given_up = self.places.iter_mut().filter(|place| tight.contains(&place.corners));
        given_up.map(|place| place.stiffness = 0.0).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::cuboid;

    /// A box of this half width and depth under z = 0.
    fn post(half: f64) -> Body {
        let (at, half) = (DVec3::new(0.014, 0.01, 0.0), DVec3::new(half, half, 0.0));
        Body::new(&cuboid(at - half - DVec3::Z * 0.3, at + half)).unwrap()
    }

    /// Two triangles of 3 cm with the post 1.5 mm through both.
    fn pierced() -> (Cloth, Vec<DVec3>) {
        let at = |x: f64, y: f64| DVec3::new(x, y, -1.5e-3);
        let x = vec![at(0.0, 0.0), at(0.03, 0.0), at(0.0, 0.03), at(0.03, 0.03)];
        let mesh = TriMesh::new(x.clone(), vec![[0, 1, 2], [2, 1, 3]]);
        (Cloth::sample(&mesh, "jersey", &[3]), x)
    }

    /// Contacts that cover the post, by now slid along it, and where the cloth is.
    fn covered<'b>(cloth: &Cloth, body: &'b Body, mut x: Vec<DVec3>) -> (Contacts<'b>, Vec<DVec3>) {
        let mut contacts = cloth.contacts(body, &x);
        contacts.proximity = Some(cloth.proximity());
        assert!(contacts.touches().is_empty(), "no corner touches");
        assert_eq!(contacts.cover(cloth, &mut x), Covered::Places);
        contacts.refresh(&x);
        // One more refresh, for friction to have a pressure.
        contacts.refresh(&x);
        let slid = x.iter().enumerate().map(|(i, p)| *p + DVec3::new(2e-4, 1e-4 * i as f64, 5e-5)).collect();
        (contacts, slid)
    }

    fn force(cloth: &Cloth, contacts: &Contacts<'_>, x: &[DVec3]) -> Vec<DVec3> {
        let (mut with, mut without) = (Vec::new(), Vec::new());
        cloth.gradient(x, contacts, &mut with);
        cloth.gradient(x, &Contacts::none(), &mut without);
        with.iter().zip(&without).map(|(a, b)| *a - *b).collect()
    }

    #[test]
    fn gradient_and_blocks_of_what_is_kept_off_are_those_of_its_energy() {
        let (body, (cloth, x)) = (post(0.005), pierced());
        let (contacts, x) = covered(&cloth, &body, x);
        let pressing = contacts.proximity.as_ref().unwrap().pressing(&x);
        assert!(pressing > 1, "{pressing}");
        let energy = |x: &[DVec3]| cloth.energy(x, &contacts) - cloth.energy(x, &Contacts::none());
        let told = force(&cloth, &contacts, &x);
        assert_eq!(told[3], DVec3::ZERO, "it is held");
        let largest = told.iter().map(|f| f.length()).fold(0.0, f64::max);
        let (mut blocks, mut without) = (Vec::new(), Vec::new());
        cloth.hessian(&x, &contacts, &mut blocks);
        cloth.hessian(&x, &Contacts::none(), &mut without);
        blocks.iter_mut().zip(without).for_each(|(a, b)| *a -= b);
        let step = 1e-8;
        for (i, &v) in cloth.order().iter().enumerate() {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let moved = |s: f64| {
                    let mut x = x.clone();
                    x[v as usize] += axis * s;
                    x
                };
                let slope = (energy(&moved(step)) - energy(&moved(-step))) / (2.0 * step);
                assert!((slope - told[v as usize].dot(axis)).abs() < 1e-5 * largest, "vertex {v}: {slope}");
                let (ahead, behind) = (force(&cloth, &contacts, &moved(step)), force(&cloth, &contacts, &moved(-step)));
                let mut d = vec![DVec3::ZERO; cloth.order().len()];
                d[i] = axis;
                let mut change = Vec::new();
                cloth.multiply(&blocks, &d, &mut change);
                let scale = change.iter().map(|f| f.length()).fold(1.0, f64::max);
                for (&w, change) in cloth.order().iter().zip(&change) {
                    let measured = (ahead[w as usize] - behind[w as usize]) / (2.0 * step);
                    assert!(measured.distance(*change) < 1e-4 * scale, "{v} {w}: {measured} and {change}");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_covered_is_let_go() {
        let (body, (cloth, mut x)) = (post(0.005), pierced());
        let (mut contacts, _) = covered(&cloth, &body, x.clone());
        // Nothing moves, so nothing comes of it.
        let rounds = (0..200).take_while(|_| contacts.cover(&cloth, &mut x) != Covered::Done).count();
        assert!((IDLE - 1..200).contains(&rounds), "{rounds}");
        contacts.refresh(&x);
        assert_eq!(contacts.proximity.as_ref().unwrap().pressing(&x), 0);
    }
}
