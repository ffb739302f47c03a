//! Cloth keeps off cloth.
//!
//! Where two places of a garment are nearer than the offset h, they push each other apart as the body pushes cloth:
//!
//! E = Σ ½ κ A (h − n·Σ w x)²  over the gaps with n·Σ w x < h,
//!
//! a gap being a vertex and the nearest point of a triangle, or the nearest points of two edges; w are the shares of its four vertices,
//! which add up to zero. Which gaps there are, their shares and their normals are those of the last [`refresh`](Proximity::refresh) and
//! stay in between, as the anchors of friction do: the energy is then quadratic in pieces, its gradient and Hessian exact, and a
//! state that repeats itself under a refresh is at rest with the true distances. Friction holds the two places together along
//! the plane by the same law as on the body ([`friction`](super::friction)).
//!
//! What faces what changes by jumps: two edges do so between their ends alone, and who comes to face another one begins anew. Cloth that
//! lies where it jumps has no state that repeats itself, and goes to and fro between two for ever. Asked to fade,
//! gaps come and go by a share of their stiffness at a refresh, so that it rests where a mean of both pushes (Filippov's solution of an
//! equation whose right side jumps).
//!
//! A penalty alone lets cloth through. So every step is looked at before it is taken (`passage.rs`): one that would cross is made shorter
//! or cut where it does, and there are gaps the next time. A garment without a crossing stays without; one that crosses to begin with goes
//! back towards where it is known not to (`start.rs`), or finds its own way out (`untangle.rs`).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | h | offset: the thickness of the cloth, and at least what its mesh can tell | m |
//! | w | shares of a gap's vertices, positive on the one side | – |
//! | n | unit normal from the second place to the first | – |
//! | κ | stiffness: pressure over what is missing to h | N/m³ |
//! | A | rest area that the gap stands for | m² |
//!
//! Between two fabrics thickness and friction are their mean, and less offset is kept where the garment was placed nearer to itself. Limits: a
//! gap that closes for lack of stiffness grows stiffer only from refresh to refresh.

mod collision_filter;
mod gap;
mod place;
mod search;
mod start;
mod surface;
mod untangle;
mod verlet_list;

use std::sync::Arc;

use glam::{DMat3, DVec3};

use collision_filter::Passage;
pub(crate) use collision_filter::StepCheck;
pub use gap::Gap;
pub(in crate::mechanics) use place::touching_between;
pub(super) use place::{Place, offset};
pub(crate) use surface::Skin;

use crate::mesh::NONE;

/// Pressure that takes up half the offset, Pa: a garment's layers lie on each other by their weight, some 2 Pa each; where more is
/// needed a gap grows stiffer.
const HALF_OFFSET_PRESSURE: f64 = 200.0;

/// Gaps are looked for this many times farther than the offset: what a step closes is felt within it.
const REACH: f64 = 2.5;

/// Share of the mean edge that the offset is at least, so that what touches is told from what crosses.
const LEAST_OF_EDGE: f64 = 0.1;

/// But no mesh is so coarse that its cloth keeps farther off itself than this, m, if it is thinner.
const LEAST_OF_ANY: f64 = 4e-3;

/// Share of it that the offset is at most: two triangles apart, a cloth is no nearer to itself.
const MOST_OF_EDGE: f64 = 0.25;

/// A gap left with less than this share of the offset grows stiffer.
const NARROW: f64 = 0.25;

/// By this factor.
const STIFFER: f64 = 2.0;

/// At most so many times as stiff as it began.
const MOST_STIFF: f64 = 64.0;

/// Refreshes without fewer crossings after which what crosses is left as it is.
const PATIENCE: usize = 40;

/// How far apart a cloth is kept, by its thickness at each vertex.
#[derive(Debug, Clone)]
struct Apart {
    thickness: Arc<Vec<f64>>,
    /// Least and most offset on this mesh, m.
    bounds: [f64; 2],
}

impl Apart {
    /// h, m, of two places whose thicknesses (m) have this mean.
    fn offset(&self, thickness: f64) -> f64 {
        thickness.clamp(self.bounds[0], self.bounds[1])
    }

    /// κ, N/m³, where the offset is this one, m.
    fn stiffness(offset: f64) -> f64 {
        HALF_OFFSET_PRESSURE / (0.5 * offset)
    }

    /// Most of all offsets, m.
    fn most(&self) -> f64 {
        self.offset(self.thickness.iter().copied().fold(0.0, f64::max))
    }
}

/// The gaps of a cloth with itself.
#[derive(Debug, Clone)]
pub struct Proximity {
    skin: Arc<Skin>,
    placed: Arc<Vec<DVec3>>,
    clear: Arc<Vec<DVec3>>,
    apart: Apart,
    friction: Arc<Vec<f64>>,
    gaps: Vec<Gap>,
    passage: Passage,
    /// Share of its stiffness by which a gap comes or goes at a refresh.
    fade: f64,
    /// Fewest crossings so far, and how many refreshes ago they were fewer than before.
    fewest: usize,
    since: usize,
}

impl Proximity {
    /// None looked for yet: how the cloth was placed, and where it goes back to where a start crosses; thickness (m) and friction of each
    /// vertex.
    pub(super) fn new(
        skin: Arc<Skin>,
        [placed, clear]: [Arc<Vec<DVec3>>; 2],
        [thickness, friction]: [Arc<Vec<f64>>; 2],
    ) -> Self {
        let least = (LEAST_OF_EDGE * skin.edge_m).min(LEAST_OF_ANY);
        let apart = Apart { thickness, bounds: [least, (MOST_OF_EDGE * skin.edge_m).max(least)] };
        let passage = Passage::new(Arc::clone(&skin), REACH * apart.most());
        Self {
            skin,
            placed,
            clear,
            apart,
            friction,
            gaps: Vec::new(),
            passage,
            fade: 1.0,
            fewest: usize::MAX,
            since: 0,
        }
    }

    /// Looks for gaps at `x` (m); those that were there before go on.
    pub(crate) fn refresh(&mut self, x: &[DVec3]) {
        self.refresh_with(x, Vec::new());
    }

    /// The same with these gaps to the body beside those of the cloth with itself.
    pub(super) fn refresh_with(&mut self, x: &[DVec3], to_body: Vec<Gap>) {
        let Self { skin, placed, apart, friction, passage, .. } = self;
        let most = apart.most();
        let mut gaps = search::gaps(skin, passage.near(x), x, placed, apart, REACH * most);
        let crossing = passage.known(x);
        self.since = if crossing.len() < self.fewest { 0 } else { self.since + 1 };
        self.fewest = self.fewest.min(crossing.len());
        if !crossing.is_empty() {
            let patient = self.since < PATIENCE;
            let back = patient.then(|| untangle::gaps(skin, x, crossing, Apart::stiffness(most)));
            // About a crossing nobody knows which side is the right one.
            gaps.retain(|gap| !gap.members().any(|(v, _)| passage.is_tangled(v)));
            gaps.extend(back.into_iter().flatten());
        }
        gaps.extend(to_body);
        gaps.sort_unstable_by_key(|gap| gap.key);
        if self.fade < 1.0 {
            gap::stay(&self.gaps, &mut gaps);
        }
        let fade = self.fade;
        let mut before = self.gaps.iter().peekable();
        for gap in &mut gaps {
            while before.next_if(|b| b.key < gap.key).is_some() {}
            let again = before.next_if(|b| b.key == gap.key);
            gap.from = gap.across(x);
            if gap.key.kind == gap::Kind::Crossing {
                continue;
            }
            match again {
                Some(before) => gap.continues(before, x, fade),
                None => gap.stiffness *= fade,
            }
            let depth = gap.depth(x);
            gap.limit = gap.mean(friction) * gap.stiffness * depth.max(0.0);
            // The pressure that is there stays as it is; what grows is how fast it grows from here on.
            if depth > (1.0 - NARROW) * gap.goal && fade == 1.0 {
                gap.stiffness *= STIFFER.min(MOST_STIFF * gap.first / gap.stiffness);
            }
            gap.slip =
                if gap.limit > 0.0 { gap.slip.clamp_length_max(super::friction::ELASTIC_SLIP) } else { DVec3::ZERO };
        }
        self.gaps = gaps;
    }

    /// From now on gaps come and go by this share of their stiffness at a refresh; 1 for at once.
    pub(crate) fn fade(&mut self, share: f64) {
        self.fade = share;
    }

    /// Adds the gradient (N) at `x`, but where a vertex is `held`; returns the energy, J.
    pub(super) fn add_gradient(&self, x: &[DVec3], held: &[bool], gradient: &mut [DVec3]) -> f64 {
        let mut energy = 0.0;
        for gap in &self.gaps {
            let (of_gap, force) = gap.push(x);
            if of_gap > 0.0 {
                energy += of_gap;
                for (v, w) in gap.members().filter(|(v, _)| !held[*v as usize]) {
                    gradient[v as usize] -= force * w;
                }
            }
        }
        energy
    }

    /// Each pressing gap's Hessian: block (v, w) is the matrix (N/m) times the shares of v and w.
    pub(super) fn hessian<'a>(&'a self, x: &'a [DVec3]) -> impl Iterator<Item = (&'a Gap, DMat3)> + 'a {
        self.gaps.iter().filter_map(|gap| Some((gap, gap.hessian(x)?)))
    }

    /// Pairs of vertices that a gap couples.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.gaps
            .iter()
            .flat_map(|gap| {
                let v = gap.key.vertices;
                (1..v.len()).flat_map(move |i| (0..i).map(move |j| [v[i], v[j]]))
            })
            .filter(|[a, b]| *a != NONE && *b != NONE)
    }

    /// Gaps that press at `x`.
    #[must_use]
    pub fn pressing(&self, x: &[DVec3]) -> usize {
        self.gaps.iter().filter(|gap| gap.depth(x) > 0.0).count()
    }

    /// All gaps of the cloth with itself, what crosses left out.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = &Gap> {
        self.gaps.iter().filter(|gap| matches!(gap.key.kind, gap::Kind::Vertex | gap::Kind::Edges))
    }

    /// What the gaps that press at `x` push with, N, normal to each.
    pub fn forces(&self, x: &[DVec3]) -> impl Iterator<Item = DVec3> {
        self.gaps.iter().map(|gap| gap.normal * (gap.stiffness * gap.depth(x).max(0.0)))
    }

    /// Looks at the step from `from`, where the last one ended, to `to`: see [`StepCheck`].
    pub(crate) fn look(&mut self, from: &[DVec3], to: &mut [DVec3]) -> StepCheck {
        self.passage.look(from, to)
    }

    /// Puts the cloth from `x` to another place (m), if it crosses itself no more there; whether it did.
    pub(super) fn put(&mut self, x: &[DVec3], there: &[DVec3]) -> bool {
        let crossing = self.passage.anew(there);
        let put = crossing.len() <= self.passage.known(x).len();
        if put {
            self.passage.begin(crossing);
        }
        put
    }

    /// Pairs of triangles that cross at `x`, where the last step ended.
    pub(crate) fn crossings(&mut self, x: &[DVec3]) -> usize {
        self.passage.known(x).len()
    }
}
