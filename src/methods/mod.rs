//! Methods that the paper measures itself against, as far as their sources tell them, behind one trait.
//!
//! | name | source |
//! |---|---|
//! | [`zhu2016`] | \[19\] Zhu, Li 2016: hybrid bounding volume hierarchy, masses and springs |
//! | [`gross2003`] | \[20\] Groß, Fuhrmann, Luckas 2003: pieces laid on developable surfaces, edge-length constraints |
//! | [`thomaszewski2006`] | \[21\] Thomaszewski, Wacker, Straßer 2006: corotational subdivision finite elements |
//!
//! A [`ReferenceMethod`] takes the scene, the fabric and a [`RestRule`], and returns the draped garment with its
//! timings and counters. They all move the cloth in time until it rests, by the same rule; each file's head says what
//! its source confirms and what is our reading. What is no part of a method is the same for all: the cloth's masses,
//! areas and offset from the body, and the law of the contact forces.
//!
//! A method that cannot run on a scene says why ([`MethodError`]); none falls back to another.

pub mod friction;
pub mod gross2003;
pub mod implicit_euler;
pub mod linear;
pub mod rest;
pub mod segment;
pub mod spring_list;
pub mod thomaszewski2006;
pub mod zhu2016;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::garment::fabric::Fabric;
use crate::garment::pattern::SewnGarment;
use crate::mechanics::energy::{Cloth, EnergyError};
use crate::mesh::TriMesh;
use crate::scene::Scene;
pub use rest::{Ended, RestRule};

/// What a method drapes.
#[derive(Debug, Clone, Copy)]
pub struct MethodInput<'a> {
    /// Body and garment.
    pub scene: &'a Scene,
    /// The cloth's constants.
    pub fabric: &'a Fabric,
    /// Masses, areas, held vertices and offset of the garment; its energy is not used.
    pub cloth: &'a Cloth,
}

impl MethodInput<'_> {
    /// The methods have one stiffness, density and friction for all of a garment.
    fn of_one_fabric(&self, method: &'static str) -> Result<(), MethodError> {
        match self.cloth.fabrics.len() {
            0 | 1 => Ok(()),
            n => {
                let reason = format!("found {n} fabrics in the garment, expected one: the method as published has one");
                Err(MethodError::unfit(method, reason))
            }
        }
    }
}

/// The garment on its way, as the observer sees it.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Which part of the method it is in.
    pub stage: &'static str,
    /// Steps done.
    pub step: usize,
    /// Simulated time, s.
    pub time_s: f64,
    /// RMS speed of the vertices, m/s.
    pub rms_speed_m_per_s: f64,
    /// Positions, m.
    pub positions: &'a [DVec3],
}

/// Told of every step; may end the run.
pub(crate) type Spectator<'a> = &'a mut (dyn FnMut(&Moment<'_>) -> ControlFlow<()> + Send);

/// What a method has to show besides the garment.
#[derive(Debug, Clone)]
pub enum Exhibit {
    /// Lines in space, m: fitted quadrics, bounding surfaces. Lines of one index belong together.
    Lines(Vec<(usize, Vec<DVec3>)>),
    /// A surface, m: a limit surface.
    Surface(TriMesh),
    /// Pieces on their way: triangles in groups, and where they are at which step, m.
    Moving {
        /// Triangles, in a group for each piece.
        mesh: TriMesh,
        /// Steps, counted as the [`Moment`]s count them, and positions.
        frames: Vec<(usize, Vec<DVec3>)>,
    },
}

/// What came out of a method.
#[derive(Debug, Clone)]
pub struct MethodDrape {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Why it ended.
    pub ended: Ended,
    /// Time steps done.
    pub steps: usize,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// RMS speed of the vertices at the end, m/s.
    pub rms_speed_m_per_s: f64,
    /// Each part of the work by name, in order.
    pub times: Vec<(&'static str, Duration)>,
    /// All of it, start to end.
    pub total: Duration,
    /// What was counted, by name.
    pub counts: Vec<(&'static str, u64)>,
    /// What the method made on its way, by name; empty unless it was asked for.
    pub exhibits: Vec<(&'static str, Exhibit)>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Why a method cannot run on a scene.
#[derive(Debug, thiserror::Error)]
pub enum MethodError {
    /// The method needs something that the scene does not have.
    #[error("{method} cannot run here: {reason}")]
    Unfit {
        /// The method.
        method: &'static str,
        /// What is missing.
        reason: String,
    },
    /// The cloth cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// It flew apart.
    #[error("{method}: positions are not finite after step {step}; the time step is too long for this fabric and mesh")]
    Unstable {
        /// The method.
        method: &'static str,
        /// The step after which it was seen.
        step: usize,
    },
}

impl MethodError {
    fn unfit(method: &'static str, reason: impl Into<String>) -> Self {
        Self::Unfit { method, reason: reason.into() }
    }
}

/// The drape, or why there is none.
pub(crate) type MethodOutcome = Result<MethodDrape, MethodError>;

/// A way to drape a garment, from the placed start to rest.
pub trait ReferenceMethod: Sync {
    /// Its name: author and year.
    fn name(&self) -> &'static str;

    /// What [`drape`](Self::drape) does, on whatever thread it is called.
    ///
    /// # Errors
    /// [`MethodError`] says in one line why there is no drape.
    fn run(&self, dressing: &MethodInput<'_>, rule: &RestRule, onlooker: Spectator<'_>) -> MethodOutcome;

    /// Drapes until the garment rests by `rule`; `onlooker` is told of every step and may end it.
    ///
    /// # Errors
    /// [`MethodError`] says in one line why there is no drape.
    fn drape(&self, dressing: &MethodInput<'_>, rule: &RestRule, onlooker: Spectator<'_>) -> MethodOutcome {
        dressing.of_one_fabric(self.name())?;
        // In the pool: hundreds of short parallel loops follow.
        rayon::scope(|_| self.run(dressing, rule, onlooker))
    }
}

/// Names of the methods, in the order of the paper's references.
pub(crate) const METHODS: [&str; 3] = [zhu2016::NAME, gross2003::NAME, thomaszewski2006::NAME];

/// The method of a name, with its defaults; `exhibit` asks for what it has to show besides the garment, and `sewn` are the panels
/// of a garment that was sewn of any.
#[must_use]
pub(crate) fn by_name(name: &str, exhibit: bool, sewn: Option<&SewnGarment>) -> Option<Box<dyn ReferenceMethod>> {
    match name {
        gross2003::NAME => Some(Box::new(gross2003::Gross2003 { exhibit, sewn: sewn.cloned(), ..Default::default() })),
        zhu2016::NAME => Some(Box::new(zhu2016::Zhu2016 { exhibit, ..Default::default() })),
        thomaszewski2006::NAME => Some(Box::new(thomaszewski2006::Thomaszewski2006 { exhibit, ..Default::default() })),
        _ => None,
    }
}

/// Durations by name, in the order they were begun first, since it began.
#[derive(Debug, Clone)]
struct Stopwatch {
    began: Instant,
    parts: Vec<(&'static str, Duration)>,
}

impl Stopwatch {
    fn begin() -> Self {
        Self { began: Instant::now(), parts: Vec::new() }
    }

    /// Runs `work` on the account of `name`.
    fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let began = Instant::now();
        let out = work();
        let spent = began.elapsed();
        match self.parts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += spent,
            None => self.parts.push((name, spent)),
        }
        out
    }
}
