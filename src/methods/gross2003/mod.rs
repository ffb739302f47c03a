//! \[20\] C. Groß, A. Fuhrmann, V. Luckas: "Automatic pre-positioning of virtual clothing", Spring Conference on Computer Graphics
//! 2003, 99–108.
//!
//! Confirmed by the source: parts of the body get developable bounding surfaces, cones and cylinders; pattern pieces are laid on the
//! unrolled surfaces and rolled back isometrically, all at once; seams are closed by springs whose rest length goes to zero; then a
//! model of masses with edge-length constraints in place of stiff forces, in large steps, until the speed falls under a tolerance;
//! collision by a distance field.
//!
//! Our reading: sections of the bounding surfaces ([`developable`]); how a garment without seams is cut ([`cut`](mod@cut)) and where a piece
//! belongs ([`pieces`]); how a piece finds its place ([`lay`]); the band of the constraints, bending, friction ([`verlet`]). Gravity begins when
//! the seams are shut. What is held (a waistband) is drawn to where it is worn as the seams are. The distance is this project's own, by
//! tangent planes. Steps of 1 ms and 2 sweeps: the source speaks of large steps, but sweeps that have not converged let cloth sag, and at
//! the same cost a pullover of 4,710 vertices ended 51 mm from the canonical drape in steps of 10 ms with 20 sweeps, 13 mm in steps of
//! 2.5 ms with 5, 10 mm in these. Cutting and flattening are not counted: the source's pieces come flat.
//!
//! Limits: cloth of constraints bears no shear of its own and does not stretch by its stiffness; it ends where the pieces were sewn
//! together on the body, which need not be where it was placed.

pub mod cut;
pub mod developable;
pub mod lay;
pub mod pieces;
pub mod verlet;

use std::time::Instant;

use glam::DVec3;

use super::rest::{Ended, Rest};
use super::spring_list::springs;
use super::{
    MethodInput, Exhibit, MethodDrape, MethodError, MethodOutcome, Moment, ReferenceMethod, RestRule, Spectator, Stopwatch,
};
use crate::garment::pattern::SewnGarment;
use crate::mechanics::energy::Cloth;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::scene::Scene;
use developable::Developable;
use pieces::{Piece, distortion, parts, unfit};
use verlet::{Sheet, Tempo};

/// The method's name.
pub(crate) const NAME: &str = "gross2003";

/// Distance that bounding surfaces keep from the body beyond the cloth's, m.
const CLEARANCE: f64 = 0.005;
/// Seams are merged when none is wider than this, m.
const SHUT: f64 = 2e-3;
/// Frames of the exhibit are so far apart, s.
const FRAME_S: f64 = 0.05;

/// The method with its dials.
#[derive(Debug, Clone)]
pub struct Gross2003 {
    /// How the cloth is moved.
    pub tempo: Tempo,
    /// Time in which the seams' rest lengths go to zero, s, and how long they may take to get there.
    pub closing_s: [f64; 2],
    /// The garment's panels, of a pattern.
    pub sewn: Option<SewnGarment>,
    /// Whether surfaces and pieces are to be shown.
    pub exhibit: bool,
}

impl Default for Gross2003 {
    fn default() -> Self {
        let tempo = Tempo { step_s: 1e-3, damping_per_s: 6.0, sweeps: 2, band: [0.02, 0.02] };
        Self { tempo, closing_s: [0.5, 1.0], sewn: None, exhibit: false }
    }
}

/// The pieces as one mesh that is not sewn.
struct Apart {
    mesh: TriMesh,
    rest: RestShape,
    /// The garment's vertex of each.
    of: Vec<u32>,
    /// Pairs to be sewn, and how far apart they were laid, m.
    seams: Vec<([u32; 2], f64)>,
}

impl ReferenceMethod for Gross2003 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn run(&self, dressing: &MethodInput<'_>, rule: &RestRule, onlooker: Spectator<'_>) -> MethodOutcome {
        let MethodInput { scene, fabric, cloth } = dressing;
        let cutting = Instant::now();
        let pieces = match &self.sewn {
            Some(sewn) => pieces::of_pattern(sewn, &scene.garment)?,
            None => cut::cut(dressing)?,
        };
        let mut notes = Vec::new();
        if self.sewn.is_none() {
            let [p95, most] = distortion(&pieces, &scene.rest).map(|share| 100.0 * share);
            notes.push(format!(
                "cut into {} pieces and laid flat in {:.0} ms, not counted; their edges are {p95:.1} % (P95), {most:.0} % at most off \
                 the rest shape, which has no exact plane pattern",
                pieces.len(),
                1e3 * cutting.elapsed().as_secs_f64()
            ));
        }
        let mut watch = Stopwatch::begin();
        let worn = &scene.garment.positions;
        let parts = watch.time("bounding surfaces", || parts(dressing, &pieces))?;
        let surfaces: Vec<Developable> = watch.time("bounding surfaces", || {
            let around = |part: &pieces::BodyPart| {
                let own: Vec<DVec3> =
                    part.pieces.iter().flat_map(|&p| &pieces[p].vertices).map(|&v| worn[v as usize]).collect();
                let found = Developable::around(&part.points, part.axis, &own, cloth.offset + CLEARANCE);
                let names = || part.pieces.iter().map(|&p| pieces[p].name.clone()).collect::<Vec<_>>().join("; ");
                found.ok_or_else(|| unfit(format!("no cone or cylinder bounds the part of the body under {}", names())))
            };
            parts.iter().map(around).collect::<Result<_, _>>()
        })?;
        let laid = watch.time("laying", || lay::all_laid(&pieces, &parts, &surfaces, worn));
        let apart = watch.time("laying", || Apart::new(&pieces, laid, scene));
        let held_apart: Vec<u32> =
            (0u32..).zip(&apart.of).filter(|(_, v)| cloth.held[**v as usize]).map(|p| p.0).collect();
        let pieces_cloth =
            watch.time("laying", || Cloth::new(&apart.mesh, &Topology::new(&apart.mesh), &apart.rest, fabric, &[]))?;
        let mut closing = watch.time("closing", || {
            let [edges, bends] = springs(&apart.mesh.triangles, &Topology::new(&apart.mesh), &apart.rest, fabric);
            let start = apart.mesh.positions.clone();
            let body = pieces_cloth.contacts_by_planes(&scene.body, &start);
            Sheet::new(start, (&pieces_cloth.masses, &pieces_cloth.held), [edges, bends], body, fabric.friction)
        });
        let mut frames = vec![(0, apart.mesh.positions.clone())];
        let h = self.tempo.step_s;
        let (mut steps, mut time_s, mut interrupted) = (0usize, 0.0, false);
        let mut merged = apart.merged(&closing.x, worn);
        while !interrupted
            && time_s < self.closing_s[1]
            && (time_s < self.closing_s[0] || apart.open(&closing.x) > SHUT)
        {
            time_s += h;
            steps += 1;
            let left = (1.0 - time_s / self.closing_s[0]).max(0.0);
            watch.time("closing", || {
                // Without a pull of its own a piece keeps none of its way: it is carried by its seams.
                closing.step(&self.tempo, false, |x, weights| apart.pull(x, weights, left, (&held_apart, worn)));
            });
            merged = apart.merged(&closing.x, worn);
            if self.exhibit && time_s > FRAME_S * (frames.len() as f64 - 1e-6) {
                frames.push((steps, closing.x.clone()));
            }
            let moment = moment("closing", steps, time_s, closing.rms_speed(), &merged)?;
            interrupted = onlooker(&moment).is_break();
        }
        let gap = apart.open(&closing.x);
        if gap > SHUT {
            notes.push(format!("seams up to {:.1} mm open when they were merged", 1e3 * gap));
        }
        let (closing_steps, mut corrections) = (steps, closing.corrections);
        let mut sheet = watch.time("positioning", || {
            let pair = springs(&scene.garment.triangles, &scene.topology, &scene.rest, fabric);
            for (x, (held, worn)) in merged.iter_mut().zip(cloth.held.iter().zip(worn)) {
                *x = if *held { *worn } else { *x };
            }
            let body = cloth.contacts_by_planes(&scene.body, &merged);
            Sheet::new(merged, (&cloth.masses, &cloth.held), pair, body, fabric.friction)
        });
        let mut rest = Rest::new(*rule);
        let mut ended = interrupted.then_some(Ended::Interrupted);
        while ended.is_none() {
            watch.time("positioning", || sheet.step(&self.tempo, true, |_, _| ()));
            steps += 1;
            let speed = sheet.rms_speed();
            ended = rest.after(h, speed);
            let at = time_s + rest.time_s();
            let moment = moment("positioning", steps, at, speed, &sheet.x)?;
            if onlooker(&moment).is_break() {
                ended = ended.or(Some(Ended::Interrupted));
            }
        }
        corrections += sheet.corrections;
        let total = watch.began.elapsed();
        let exhibits = if self.exhibit { exhibited(&surfaces, apart.mesh.clone(), frames) } else { Vec::new() };
        Ok(MethodDrape {
            ended: ended.unwrap_or(Ended::Interrupted),
            steps,
            simulated_s: time_s + rest.time_s(),
            rms_speed_m_per_s: sheet.rms_speed(),
            positions: sheet.x,
            times: watch.parts,
            total,
            counts: [
                ("pieces", pieces.len() as u64),
                ("bounding surfaces", surfaces.len() as u64),
                ("seam pairs", apart.seams.len() as u64),
                ("closing steps", closing_steps as u64),
                ("length corrections", corrections),
            ]
            .to_vec(),
            exhibits,
            notes,
        })
    }
}

fn exhibited(
    surfaces: &[Developable],
    mesh: TriMesh,
    frames: Vec<(usize, Vec<DVec3>)>,
) -> Vec<(&'static str, Exhibit)> {
    let of = |(i, surface): (usize, &Developable)| surface.outline().into_iter().map(move |line| (i, line));
    let lines = surfaces.iter().enumerate().flat_map(of).collect();
    vec![("bounding surfaces", Exhibit::Lines(lines)), ("pieces", Exhibit::Moving { mesh, frames })]
}

/// What the onlooker sees; an error where there is nothing to be seen.
fn moment<'a>(
    stage: &'static str,
    step: usize,
    time_s: f64,
    rms_speed_m_per_s: f64,
    positions: &'a [DVec3],
) -> Result<Moment<'a>, MethodError> {
    let unstable = !positions.iter().all(|x| x.is_finite());
    if unstable {
        return Err(MethodError::Unstable { method: NAME, step });
    }
    Ok(Moment { stage, step, time_s, rms_speed_m_per_s, positions })
}

impl Apart {
    fn new(pieces: &[Piece], laid: Vec<Vec<DVec3>>, scene: &Scene) -> Self {
        let mut mesh = TriMesh::default();
        let (mut of, mut corners) = (Vec::new(), Vec::new());
        for (number, (piece, places)) in pieces.iter().zip(laid).enumerate() {
            let first = of.len() as u32;
            mesh.groups.push(piece.name.clone());
            mesh.positions.extend(places);
            mesh.triangles.extend(piece.triangles.iter().map(|t| t.map(|v| first + v)));
            mesh.triangle_group.extend(std::iter::repeat_n(number as u32, piece.triangles.len()));
            of.extend(&piece.vertices);
            corners.extend(piece.of_garment.iter().map(|&t| scene.rest.corners[t as usize]));
        }
        let mut copies: Vec<Vec<u32>> = vec![Vec::new(); scene.garment.vertex_count()];
        (0u32..).zip(&of).for_each(|(i, &v)| copies[v as usize].push(i));
        let length = |[a, b]: [u32; 2]| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
        let pairs = copies.iter().flat_map(|copies| copies.windows(2).map(|w| [w[0], w[1]]));
        let seams = pairs.map(|pair| (pair, length(pair))).collect();
        Self { mesh, rest: RestShape::new(corners), of, seams }
    }

    /// The widest seam, m.
    fn open(&self, x: &[DVec3]) -> f64 {
        self.seams.iter().map(|([a, b], _)| x[*a as usize].distance(x[*b as usize])).fold(0.0, f64::max)
    }

    /// Seams no longer than their share of what they were, and held vertices no farther from where they are worn.
    fn pull(&self, x: &mut [DVec3], weights: &[f64], left: f64, (held, worn): (&[u32], &[DVec3])) {
        for &([a, b], length) in &self.seams {
            let [a, b] = [a, b].map(|v| v as usize);
            let way = x[b] - x[a];
            let excess = way.length() - left * length;
            if excess > 0.0 {
                let correction = way.normalize_or_zero() * (excess / (weights[a] + weights[b]));
                x[a] += correction * weights[a];
                x[b] -= correction * weights[b];
            }
        }
        for &v in held {
            let (goal, start) = (worn[self.of[v as usize] as usize], self.mesh.positions[v as usize]);
            x[v as usize] = goal + (start - goal) * left;
        }
    }

    /// The garment: each vertex at the mean of its copies, or where it is worn if it has none.
    fn merged(&self, x: &[DVec3], worn: &[DVec3]) -> Vec<DVec3> {
        let mut sums = vec![(DVec3::ZERO, 0.0); worn.len()];
        for (x, &v) in x.iter().zip(&self.of) {
            let sum = &mut sums[v as usize];
            *sum = (sum.0 + *x, sum.1 + 1.0);
        }
        sums.iter().zip(worn).map(|((sum, count), worn)| if *count > 0.0 { *sum / *count } else { *worn }).collect()
    }
}
