//! What is draped over what: a body, a garment placed around it, and the garment's rest shape, ready for the stages.
//!
//! [`SceneSpec`] names them, as files or built in, and [`SceneSpec::load`] reads them, in the order that keeps them right:
//! the garment is turned to face away from the body, its rest shape is taken before anything moves, it must be near the
//! body, and what starts inside is pushed out. [`Scene::of_meshes`] does the same with meshes in memory.

mod error;
mod hold;
mod layers;
mod load;
mod materials;
mod placement;
mod push_out;
mod spec;

pub use error::SceneError;
pub use hold::Fallen;
pub use layers::{DistanceTo, Layer};
pub use load::{Loaded, Tailored};
pub use materials::{CutError, PanelFabrics, Swatch};
pub use placement::{FARTHEST, Placement, facing_body};
pub use push_out::{PushOutReport, push_out};
pub use spec::{DRESS_FORM, FileRole, SceneSpec};

use crate::body::distance::{Body, SurfacePoint};
use crate::garment::fabric::Fabric;
use crate::mesh::{RestShape, Topology, TriMesh};
use placement::check_near;

/// Pushed-out vertices come to rest this far from the body, m: a thick knit's thickness.
const PUSHED_CLEARANCE: f64 = 1e-3;

/// What is draped over what; stays the same while tables and fabrics vary.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The body, ready for distance queries; its mesh is [`Body::mesh`].
    pub body: Body,
    /// The garment as placed, undraped, m.
    pub garment: TriMesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest shape.
    pub rest: RestShape,
    /// Vertices that stay where they are worn (a waistband's edge).
    pub held: Vec<u32>,
    /// Whether they are let go once the garment rests, to see whether it stays up by itself.
    pub let_go: bool,
    /// The garments that it is made of, inner to outer; mostly one.
    pub layers: Vec<Layer>,
    /// What its distances count to.
    pub distance_to: DistanceTo,
    /// The fabrics that its rest shape numbers; `None` is that of the settings, which is all there is unless something else was asked.
    pub own_fabrics: Vec<Option<Fabric>>,
}

impl Scene {
    /// A body and a garment placed around it, both in metres with z up; the garment is at rest as it stands.
    ///
    /// # Errors
    /// [`SceneError`]: a body that is not closed, triangles without area, a garment nowhere near the body.
    pub fn of_meshes(body: &TriMesh, mut garment: TriMesh) -> Result<Self, SceneError> {
        let body = Body::new(body)?;
        let turn = facing_body(&garment, &body);
        garment.triangles.iter_mut().zip(turn).filter(|(_, turn)| *turn).for_each(|(t, _)| t.swap(1, 2));
        let rest = RestShape::from_edges(&garment)?;
        Ok(Self::place(body, garment, rest, true)?.0)
    }

    /// One garment as it is, where it is, nothing held.
    #[must_use]
    pub fn new(body: Body, garment: TriMesh, rest: RestShape) -> Self {
        let name = "garment".to_owned();
        let layer = Layer { name, vertices: 0..garment.vertex_count(), triangles: 0..garment.triangles.len() };
        let (layers, distance_to) = (vec![layer], DistanceTo::Body);
        let topology = Topology::new(&garment);
        let own_fabrics = vec![None];
        Self { body, topology, garment, rest, held: Vec::new(), let_go: false, layers, distance_to, own_fabrics }
    }

    /// Puts them together, nothing held; what starts inside the body is pushed out if asked.
    fn place(body: Body, garment: TriMesh, rest: RestShape, push: bool) -> Result<(Self, PushOutReport), SceneError> {
        check_near(&garment, &body)?;
        let (garment, report) =
            if push { push_out(&garment, &body, PUSHED_CLEARANCE) } else { (garment, PushOutReport::default()) };
        Ok((Self::new(body, garment, rest), report))
    }

    /// Takes the garment off over the ends of the body that stick through it; the longest way that a vertex went, m.
    fn take_off_ends(&mut self) -> f64 {
        let Some(taken) = self.body.taken_off_ends(&self.garment, &self.is_held()) else { return 0.0 };
        let farthest = self.garment.positions.iter().zip(&taken).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        self.garment.positions = taken;
        farthest
    }

    /// Whether each garment vertex is held.
    #[must_use]
    pub(crate) fn is_held(&self) -> Vec<bool> {
        let mut held = vec![false; self.garment.vertex_count()];
        for &v in &self.held {
            // One that does not exist is the cloth's to refuse.
            if let Some(held) = held.get_mut(v as usize) {
                *held = true;
            }
        }
        held
    }

    /// The nearest point of what each garment vertex, as placed, is over: the body, or what [`DistanceTo`] says.
    ///
    /// # Errors
    /// [`SceneError`] where a garment is no surface that a distance can be measured to.
    pub(crate) fn surface(&self) -> Result<Vec<SurfacePoint>, SceneError> {
        let mut surface = self.body.nearest_all(&self.garment.positions);
        if self.distance_to == DistanceTo::Below {
            self.nearer_below(&mut surface)?;
        }
        Ok(surface)
    }

    /// Unsigned distance of each garment vertex to what it is over, m: equation (1) takes it without its sign, as a vertex inside is
    /// as far from the surface as one outside.
    ///
    /// # Errors
    /// As [`surface`](Self::surface).
    pub fn distances_m(&self) -> Result<Vec<f64>, SceneError> {
        Ok(self.surface()?.iter().map(|s| s.signed_distance.abs()).collect())
    }
}
