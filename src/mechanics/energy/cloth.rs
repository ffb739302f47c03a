//! The energy of a garment, E(x) = gravity + membrane + bending + contact + friction, with its gradient and Hessian.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x | vertex positions | m |
//! | E | energy | J |
//! | ∇E | gradient, the negative force | N |
//! | ∇²E | Hessian in 3×3 blocks | N/m |
//! | m_i | mass of vertex i: areal density times a third of the rest areas of its triangles | kg |
//! | g | gravitational acceleration, [`GRAVITY`] | m/s² |
//!
//! Gravity is Σ m_i g z_i. Heights count from the origin, so the zero of the energy is arbitrary; the Hessian of gravity is zero.
//!
//! **Evaluation** takes most of the time of a drape. Triangles and bending pairs are divided into two halves, one for each of two
//! cores and always the same two, so sums have the same bits on any number of threads. Each half adds to its own gradient; gravity and
//! contact are added where the two are joined. Nothing is allocated once the [`Scratch`] has grown to the garment.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::bending::Bending;
use super::contact::Contacts;
use super::error::EnergyError;
use super::face_contacts::FaceContacts;
use super::friction::Friction;
use super::membrane::{HessianKind, Stiffness, Triangle};
use super::membrane_simd::{self, TrianglePack, packed};
use super::proximity::Proximity;
use super::proximity::surface::Surface;
use super::sparsity::{HELD, HessianLayout, Pattern};
use crate::GRAVITY;
use crate::base::pool::VERTICES_PER_TASK;
use crate::base::simd::{Four, Lanes, Work, run};
use crate::body::distance::Body;
use crate::garment::fabric::{Fabric, at_vertices};
use crate::mechanics::solver_options::SolverOptions;
use crate::mesh::{RestShape, Topology, TriMesh};

/// Contact pressure that compresses half the thickness of the cloth, Pa. 2 kPa is the pressure of a tight elastic garment (compression
/// stockings: 2 to 5 kPa), so a looser garment stays well off the skin.
const HALF_THICKNESS_PRESSURE: f64 = 2000.0;

/// Smallest radius of curvature of the body at which contact at vertices also keeps triangles outside, m: the ridge of a shoulder, the
/// apex of the bust.
pub(crate) const MIN_BODY_RADIUS_M: f64 = 0.03;

/// Largest distance that a coarse mesh adds to the offset, m: the gap that cloth simulators commonly keep.
const MAX_SAG_M: f64 = 3e-3;

/// Buffers of an evaluation, reused by the next.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// Positions, padded.
    x: Vec<Four>,
    /// The gradient of each half, padded.
    halves: [Vec<Four>; 2],
}

/// The constant data of the energy of one garment in its fabrics.
#[derive(Debug, Clone)]
pub struct Cloth {
    /// Mass of each vertex, kg.
    pub masses: Vec<f64>,
    /// Rest area of each vertex, m².
    pub areas: Vec<f64>,
    /// Whether each vertex is held.
    pub held: Vec<bool>,
    /// Weight of the whole garment, N.
    pub weight: f64,
    /// Distance each vertex keeps from the body, m.
    pub offsets: Vec<f64>,
    /// Largest of these distances, m.
    pub offset: f64,
    /// Thickness of the cloth at each vertex, m.
    pub thickness: Arc<Vec<f64>>,
    /// Coulomb friction at each vertex, against the body and against the cloth.
    pub friction: Arc<Vec<f64>>,
    /// The fabrics, in the order that the triangles number them.
    pub fabrics: Arc<Vec<Fabric>>,
    /// Rest data of the triangles.
    pub triangles: Arc<Vec<Triangle>>,
    /// The bending elements.
    pub(crate) bending: Arc<Bending>,
    /// Options of the solver that brings it to rest.
    pub solver: SolverOptions,
    /// Membrane stiffness of each fabric.
    stiffness: Vec<Stiffness>,
    /// The triangles by fours, and their compression ratios.
    packs: Arc<Vec<TrianglePack>>,
    packed_ratios: Arc<Vec<Four>>,
    placed: Arc<Vec<DVec3>>,
    /// Positions that an intersecting start returns to, m.
    clear: Arc<Vec<DVec3>>,
    layout: Arc<OnceLock<HessianLayout>>,
    surface: Arc<OnceLock<Arc<Surface>>>,
}

impl Cloth {
    /// Precomputes everything that does not depend on positions. `fabric` is one fabric, or all fabrics that the rest shape numbers; `held`
    /// vertices do not move.
    ///
    /// # Errors
    /// [`EnergyError`] names the faulty triangle or vertex.
    pub fn new(
        mesh: &TriMesh,
        topology: &Topology,
        rest: &RestShape,
        fabric: &(impl AsRef<[Fabric]> + ?Sized),
        held: &[u32],
    ) -> Result<Self, EnergyError> {
        let n = mesh.vertex_count();
        let fabrics = fabric.as_ref();
        if rest.corners.len() != mesh.triangles.len() {
            return Err(EnergyError::RestCount { rest: rest.corners.len(), mesh: mesh.triangles.len() });
        }
        let cut_from = 1 + rest.cut_from.iter().copied().max().map_or(0, usize::from);
        if cut_from > fabrics.len() {
            return Err(EnergyError::Fabrics { cut_from, given: fabrics.len() });
        }
        let mut is_held = vec![false; n];
        for &vertex in held {
            *is_held.get_mut(vertex as usize).ok_or(EnergyError::Held { vertex, count: n })? = true;
        }
        let triangles = mesh
            .triangles
            .iter()
            .zip(&rest.corners)
            .enumerate()
            .map(|(triangle, (&v, &c))| {
                let made = Triangle::new(v, c).ok_or(EnergyError::Degenerate { triangle })?;
                Ok(Triangle { fabric: rest.fabric_of(triangle) as u16, guessed: rest.is_guessed(triangle), ..made })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut areas = vec![0.0; n];
        let mut by_fabric = vec![vec![0.0; n]; fabrics.len()];
        for (t, area) in triangles.iter().zip(rest.areas()) {
            for &v in &t.vertices {
                areas[v as usize] += area.abs() / 3.0;
                by_fabric[t.fabric as usize][v as usize] += area.abs() / 3.0;
            }
        }
        // A vertex of no triangle has no mass: it is held.
        for (h, &area) in is_held.iter_mut().zip(&areas) {
            *h |= area == 0.0;
        }
        let mut masses = vec![0.0; n];
        for (areas, fabric) in by_fabric.iter().zip(fabrics) {
            masses.iter_mut().zip(areas).for_each(|(mass, area)| *mass += area * fabric.density_kg_per_m2);
        }
        let bending = Bending::new(mesh, topology, rest, fabrics);
        let thickness = at_vertices(mesh, rest, fabrics, |fabric| fabric.thickness_m);
        let sag = sag(mesh);
        let offsets: Vec<f64> = thickness.iter().map(|thickness| thickness + sag).collect();
        if !is_held.contains(&false) {
            return Err(EnergyError::NothingFree { count: n });
        }
        let placed = Arc::new(mesh.positions.clone());
        let ratios: Vec<f64> = triangles.iter().map(Triangle::compression_ratio).collect();
        Ok(Self {
            packs: Arc::new(TrianglePack::all(&triangles)),
            packed_ratios: Arc::new(packed(&triangles, &ratios)),
            weight: GRAVITY * masses.iter().sum::<f64>(),
            masses,
            areas,
            held: is_held,
            offset: offsets.iter().copied().fold(0.0, f64::max),
            offsets,
            thickness: Arc::new(thickness),
            friction: Arc::new(at_vertices(mesh, rest, fabrics, |fabric| fabric.friction)),
            fabrics: Arc::new(fabrics.to_vec()),
            triangles: Arc::new(triangles),
            bending: Arc::new(bending),
            solver: SolverOptions::default(),
            stiffness: fabrics.iter().map(Stiffness::new).collect(),
            clear: Arc::clone(&placed),
            placed,
            layout: Arc::new(OnceLock::new()),
            surface: Arc::new(OnceLock::new()),
        })
    }

    /// Unknowns and pattern of the Hessian, computed at the first use.
    #[must_use]
    pub(crate) fn layout(&self) -> &HessianLayout {
        self.layout.get_or_init(|| self.layout_with(&self.placed, std::iter::empty()))
    }

    /// The layout of a Hessian that has blocks for these pairs of vertices as well, ordered for the positions `x`.
    pub(crate) fn layout_with(&self, x: &[DVec3], pairs: impl Iterator<Item = [u32; 2]>) -> HessianLayout {
        HessianLayout::new(x, &self.triangles, &self.bending, &self.held, pairs)
    }

    /// The unknown vertices in elimination order.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.layout().order
    }

    /// The block pattern of the Hessian.
    #[must_use]
    pub fn pattern(&self) -> &Pattern {
        &self.layout().pattern
    }

    /// The same cloth with its membrane stiffness capped, so that a length of `height_m` (m) that hangs by its own weight stretches by `strain`.
    /// `None` where no fabric is that stiff, or height or strain is zero.
    #[must_use]
    pub(crate) fn softened(&self, height_m: f64, strain: f64) -> Option<Self> {
        let cap = self.weight / self.areas.iter().sum::<f64>() * height_m / strain;
        let softer: Vec<_> = self.stiffness.iter().map(|stiffness| stiffness.capped(cap)).collect();
        if !(cap > 0.0 && cap.is_finite() && softer.iter().any(Option::is_some)) {
            return None;
        }
        let stiffness = softer.iter().zip(&self.stiffness).map(|(softer, own)| softer.unwrap_or(*own)).collect();
        Some(Self { stiffness, ..self.clone() })
    }

    /// The same cloth with these options of the solver.
    #[must_use]
    pub fn with_solver(self, solver: SolverOptions) -> Self {
        Self { solver, ..self }
    }

    /// The same cloth with `x` (m) in place of the placement as the positions that an intersecting start returns to.
    #[must_use]
    pub(crate) fn clear_at(self, x: Vec<DVec3>) -> Self {
        Self { clear: Arc::new(x), ..self }
    }

    /// Number of vertices, held or free.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.masses.len()
    }

    /// Initial contact stiffness κ, N/m³; of several fabrics that of the thinnest.
    #[must_use]
    pub fn contact_stiffness(&self) -> f64 {
        HALF_THICKNESS_PRESSURE / (0.5 * self.offsets.iter().copied().fold(f64::INFINITY, f64::min))
    }

    /// The membrane stiffness of a triangle.
    pub(crate) fn stiffness_of(&self, triangle: &Triangle) -> &Stiffness {
        &self.stiffness[triangle.fabric as usize]
    }

    /// Contact places within its triangles, none yet.
    pub(crate) fn face_contacts(&self) -> FaceContacts {
        FaceContacts::new(Arc::clone(&self.triangles), Arc::clone(&self.thickness), self.solver.face_contact)
    }

    /// Contacts of this cloth with a body, before the first update.
    pub(crate) fn new_contacts<'b>(&self, body: &'b Body) -> Contacts<'b> {
        let friction = Friction::new(Arc::clone(&self.friction));
        let stiffness = self.contact_stiffness();
        Contacts::new(
            body,
            [&self.areas, &self.offsets],
            &self.held,
            stiffness,
            friction,
            self.face_contacts(),
            self.solver.body_contact,
        )
    }

    /// Contacts of this cloth with a body at `x`, friction anchored at the points of contact.
    #[must_use]
    pub fn contacts<'b>(&self, body: &'b Body, x: &[DVec3]) -> Contacts<'b> {
        self.contacts_from_distances(body, x, false, &[], std::iter::empty())
    }

    /// The same by tangent planes: see [`Contacts::by_planes`].
    #[must_use]
    pub(crate) fn contacts_by_planes<'b>(&self, body: &'b Body, x: &[DVec3]) -> Contacts<'b> {
        self.contacts_from_distances(body, x, true, &[], std::iter::empty())
    }

    /// The same, [by planes](Contacts::by_planes) or not, where the signed distances (m) of the vertices at `at` are known already.
    #[must_use]
    pub(crate) fn contacts_from_distances<'b>(
        &self,
        body: &'b Body,
        x: &[DVec3],
        by_planes: bool,
        at: &[DVec3],
        distance_m: impl Iterator<Item = f64>,
    ) -> Contacts<'b> {
        let contacts = self.new_contacts(body);
        let contacts = if by_planes { contacts.by_planes() } else { contacts };
        let mut contacts = contacts.with_distances(at, distance_m);
        contacts.update(x);
        contacts.refresh(x);
        contacts
    }

    /// Contact of this cloth with itself. Call [`Contacts::refresh`] before use.
    #[must_use]
    pub fn proximity(&self) -> Proximity {
        let surface = self.surface.get_or_init(|| Arc::new(Surface::new(&self.triangles, self.vertex_count())));
        let of_vertices = [&self.thickness, &self.friction].map(Arc::clone);
        Proximity::new(Arc::clone(surface), [&self.placed, &self.clear].map(Arc::clone), of_vertices, &self.solver)
    }

    /// E at `x`, J; `contacts` must have been updated at `x`.
    #[must_use]
    pub fn energy(&self, x: &[DVec3], contacts: &Contacts) -> f64 {
        self.evaluate(x, contacts, &mut Vec::new(), &mut Scratch::default())
    }

    /// ∇E at `x`, N, zero at held vertices; returns E, J. `contacts` must have been updated at `x`.
    pub fn gradient(&self, x: &[DVec3], contacts: &Contacts, gradient: &mut Vec<DVec3>) -> f64 {
        self.evaluate(x, contacts, gradient, &mut Scratch::default())
    }

    /// [`gradient`](Self::gradient) with buffers to reuse.
    pub fn evaluate(&self, x: &[DVec3], contacts: &Contacts, gradient: &mut Vec<DVec3>, scratch: &mut Scratch) -> f64 {
        let elastic = self.elastic(x, scratch);
        self.with_contact(x, contacts, elastic, gradient, scratch)
    }

    /// Updates `contacts` at `x`, and [evaluates](Self::evaluate) there; the elastic energy beside the update.
    pub(crate) fn evaluate_at(
        &self,
        x: &[DVec3],
        contacts: &mut Contacts,
        gradient: &mut Vec<DVec3>,
        scratch: &mut Scratch,
    ) -> f64 {
        let ((), elastic) = rayon::join(|| contacts.update(x), || self.elastic(x, scratch));
        self.with_contact(x, contacts, elastic, gradient, scratch)
    }

    /// Energy of membrane and bending at `x`, J; their gradient stays in `scratch`.
    fn elastic(&self, x: &[DVec3], scratch: &mut Scratch) -> f64 {
        let Scratch { x: padded, halves: [one, other] } = scratch;
        padded.resize(x.len(), Four::ZERO);
        let chunks = padded.par_chunks_mut(VERTICES_PER_TASK).zip(x.par_chunks(VERTICES_PER_TASK));
        chunks.for_each(|(to, x)| to.iter_mut().zip(x).for_each(|(to, p)| *to = Four([p.x, p.y, p.z, 0.0])));
        let middle = self.packs.len() / 2;
        let ((first, second), (ratios, other_ratios)) =
            (self.packs.split_at(middle), self.packed_ratios.split_at(middle));
        let [above, below] = self.bending.matrix.halves();
        let x_of_all = &*padded;
        let half = |packs, vertices, gradient| Half { cloth: self, packs, vertices, x: x_of_all, gradient };
        let (a, b) =
            rayon::join(|| run(half((first, ratios), above, one)), || run(half((second, other_ratios), below, other)));
        a + b
    }

    /// The energy with gravity, contact and friction, J, and its gradient.
    fn with_contact(
        &self,
        x: &[DVec3],
        contacts: &Contacts,
        elastic: f64,
        gradient: &mut Vec<DVec3>,
        Scratch { x: padded, halves: [one, other] }: &Scratch,
    ) -> f64 {
        let weight = self.join(padded, [one, other], gradient);
        contacts.add_gradient(gradient);
        contacts.friction.add_gradient(x, gradient);
        let with_itself = contacts.proximity.as_ref().map_or(0.0, |p| p.add_gradient(x, &self.held, gradient));
        let between_yarns = self.bending.friction.add_gradient(x, &self.held, gradient);
        weight + elastic + contacts.energy() + contacts.friction.energy(x) + with_itself + between_yarns
    }

    /// Adds the gradients of both halves and of gravity, zero at held vertices; returns the energy of gravity.
    fn join(&self, x: &[Four], [one, other]: [&[Four]; 2], gradient: &mut Vec<DVec3>) -> f64 {
        gradient.resize(x.len(), DVec3::ZERO);
        let halves = one.par_chunks(VERTICES_PER_TASK).zip(other.par_chunks(VERTICES_PER_TASK));
        let own = self.masses.par_chunks(VERTICES_PER_TASK).zip(self.held.par_chunks(VERTICES_PER_TASK));
        let chunks = gradient.par_chunks_mut(VERTICES_PER_TASK).zip(x.par_chunks(VERTICES_PER_TASK));
        let weights = chunks.zip(halves).zip(own).map(|(((gradient, x), (one, other)), (masses, held))| {
            let mut energy = 0.0;
            let vertices = x.iter().zip(one).zip(other).zip(masses).zip(held);
            for (out, ((((x, Four(a)), Four(b)), &mass), &held)) in gradient.iter_mut().zip(vertices) {
                let weight = mass * GRAVITY;
                energy += weight * x.0[2];
                *out = if held { DVec3::ZERO } else { DVec3::new(a[0] + b[0], a[1] + b[1], a[2] + b[2] + weight) };
            }
            energy
        });
        weights.collect::<Vec<f64>>().into_iter().sum()
    }

    /// Blocks of the projected Hessian at `x`, N/m, in the order of [`pattern`](Self::pattern): positive semi-definite.
    pub fn hessian(&self, x: &[DVec3], contacts: &Contacts, blocks: &mut Vec<DMat3>) {
        self.hessian_in(self.layout(), HessianKind::Projected, x, contacts, blocks);
    }

    /// Blocks of a Hessian at `x`, N/m, in the order of any layout.
    pub(crate) fn hessian_in(
        &self,
        layout: &HessianLayout,
        kind: HessianKind,
        x: &[DVec3],
        contacts: &Contacts,
        blocks: &mut Vec<DMat3>,
    ) {
        blocks.clear();
        blocks.extend(layout.bending_blocks.iter().map(|&b| DMat3::from_diagonal(DVec3::splat(b))));
        for (t, slots) in self.triangles.iter().zip(&layout.triangle_slots) {
            let parts = t.hessian(self.stiffness_of(t), t.compression_ratio(), x, kind);
            for (slot, part) in slots.iter().zip(&parts) {
                if slot.block != HELD {
                    blocks[slot.block as usize] += if slot.transposed { part.transpose() } else { *part };
                }
            }
        }
        for (v, block) in contacts.hessian().chain(contacts.friction.hessian(x)) {
            let i = layout.unknown[v as usize];
            if i != HELD {
                blocks[layout.pattern.starts[i as usize] as usize] += block;
            }
        }
        for (gap, block) in contacts.proximity.iter().flat_map(|p| p.hessian(x)) {
            layout.add(&layout.free(gap.members()), block, blocks);
        }
        for bent in self.bending.friction.bent(x) {
            layout.add_element(bent.vertices(), |i, j| bent.block(i, j), blocks);
        }
    }

    /// The diagonal block of each vertex in the projected Hessian plus ε M at `x`, N/m.
    pub(crate) fn diagonal_blocks(&self, x: &[DVec3], contacts: &Contacts, damping: f64, blocks: &mut Vec<DMat3>) {
        let scalar = |(v, mass): (usize, &f64)| self.bending.matrix.diagonal(v) + damping * mass;
        blocks.clear();
        blocks.extend(self.masses.iter().enumerate().map(scalar).map(|s| DMat3::from_diagonal(DVec3::splat(s))));
        for t in &*self.triangles {
            for (&v, block) in t.vertices.iter().zip(t.diagonal_blocks(self.stiffness_of(t), t.compression_ratio(), x))
            {
                blocks[v as usize] += block;
            }
        }
        for (v, block) in contacts.hessian().chain(contacts.friction.hessian(x)) {
            blocks[v as usize] += block;
        }
        for (gap, block) in contacts.proximity.iter().flat_map(|p| p.hessian(x)) {
            for (v, w) in gap.members() {
                blocks[v as usize] += block * (w * w);
            }
        }
        for bent in self.bending.friction.bent(x) {
            for (i, &v) in bent.vertices().iter().enumerate() {
                blocks[v as usize] += bent.block(i, i);
            }
        }
    }
}

/// Membrane and bending of half the triangles and half the bending pairs.
struct Half<'a> {
    cloth: &'a Cloth,
    packs: (&'a [TrianglePack], &'a [Four]),
    vertices: Range<usize>,
    x: &'a [Four],
    gradient: &'a mut Vec<Four>,
}

impl Work for Half<'_> {
    type Output = f64;

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> f64 {
        self.gradient.clear();
        self.gradient.resize(self.x.len(), Four::ZERO);
        let bending = self.cloth.bending.matrix.add_gradient(l, self.vertices, self.x, self.gradient);
        bending + membrane_simd::add_gradient(l, self.packs, &self.cloth.stiffness, self.x, self.gradient)
    }
}

#[cfg(test)]
impl Cloth {
    /// A cloth in a built-in fabric whose mesh is its rest shape.
    pub(crate) fn sample(mesh: &TriMesh, fabric: &str, held: &[u32]) -> Self {
        let (topology, rest) = (Topology::new(mesh), RestShape::from_edges(mesh).unwrap());
        Self::new(mesh, &topology, &rest, &Fabric::by_name(fabric).unwrap(), held).unwrap()
    }
}

/// Depth to which a round body passes through the triangles of a mesh whose vertices touch it, m. A triangle
/// of side l, and so of circumradius l/√3, sags by l²/(6 R) over a sphere of radius R.
fn sag(mesh: &TriMesh) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        sum += a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        count += 3.0;
    }
    (sum / f64::max(count, 1.0) / (6.0 * MIN_BODY_RADIUS_M)).min(MAX_SAG_M)
}
