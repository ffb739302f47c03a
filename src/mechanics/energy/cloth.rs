//! A garment ready to be evaluated: E, ∇E and the positive part of ∇²E.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x | vertex positions | m |
//! | E | energy | J |
//! | ∇E | gradient, minus the force | N |
//! | ∇²E | Hessian in 3×3 blocks | N/m |

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::EnergyError;
use super::bending::Bending;
use super::contact::Contacts;
use super::friction::Friction;
use super::layout::HessianLayout;
use super::membrane::{Stiffness, Triangle};
use super::membrane_simd::{TrianglePack, packed};
use super::proximity::{Proximity, Skin};
use super::sparsity::Pattern;
use crate::GRAVITY;
use crate::base::simd::Four;
use crate::body::distance::Body;
use crate::garment::fabric::{Fabric, at_vertices};
use crate::mesh::{RestShape, Topology, TriMesh};

/// Contact pressure that takes up half the cloth's thickness, Pa: 2 kPa is what a tight elastic garment presses with
/// (compression stockings reach 2 to 5 kPa), so a looser one stays well off the skin.
const HALF_THICKNESS_PRESSURE: f64 = 2000.0;

/// The tightest body the vertices alone keep off the triangles between them, m: a shoulder's ridge, a bust's apex.
const TIGHTEST_RADIUS: f64 = 0.03;

/// No mesh is so coarse that its cloth floats farther than this from the body, m: the gap cloth simulators commonly keep.
const LARGEST_SAG: f64 = 3e-3;

/// The unchanging part of the energy of one garment in its fabrics.
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
    /// Most of them, m.
    pub offset: f64,
    /// Thickness of the cloth at each vertex, m.
    pub thickness: Arc<Vec<f64>>,
    /// Coulomb friction at each vertex, against the body and against itself.
    pub friction: Arc<Vec<f64>>,
    /// What it is cut from, as the triangles number them.
    pub fabrics: Arc<Vec<Fabric>>,
    /// The triangles' rest data.
    pub triangles: Arc<Vec<Triangle>>,
    /// Share of each triangle's stiffness that is left under compression.
    pub slack: Arc<Vec<f64>>,
    /// The rings that bend.
    pub bending: Arc<Bending>,
    /// Of each fabric.
    pub(super) stiffness: Vec<Stiffness>,
    /// The triangles by fours, and their slack.
    pub(super) packs: Arc<Vec<TrianglePack>>,
    pub(super) packed_slack: Arc<Vec<Four>>,
    placed: Arc<Vec<DVec3>>,
    /// Where to go back to where a start crosses.
    clear: Arc<Vec<DVec3>>,
    layout: Arc<OnceLock<HessianLayout>>,
    skin: Arc<OnceLock<Arc<Skin>>>,
}

impl Cloth {
    /// Precomputes everything that does not depend on positions. `fabric` is one, or all that the rest shape numbers; `held`
    /// vertices do not move.
    ///
    /// # Errors
    /// [`EnergyError`] names the triangle or vertex that is wrong.
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
                Ok(Triangle { fabric: rest.fabric_of(triangle) as u16, ..made })
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
        // A vertex of no triangle has no mass and nothing to balance: it keeps still.
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
        let slack: Vec<f64> = triangles.iter().map(Triangle::slack).collect();
        Ok(Self {
            packs: Arc::new(TrianglePack::all(&triangles)),
            packed_slack: Arc::new(packed(&triangles, &slack)),
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
            slack: Arc::new(slack),
            bending: Arc::new(bending),
            stiffness: fabrics.iter().map(Stiffness::new).collect(),
            clear: Arc::clone(&placed),
            placed,
            layout: Arc::new(OnceLock::new()),
            skin: Arc::new(OnceLock::new()),
        })
    }

    /// Unknowns and pattern of the Hessian, made when first asked for.
    #[must_use]
    pub(crate) fn layout(&self) -> &HessianLayout {
        self.layout.get_or_init(|| {
            HessianLayout::new(&self.placed, &self.triangles, &self.bending, &self.held, std::iter::empty())
        })
    }

    /// The unknown vertices in elimination order.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.layout().order
    }

    /// Where the Hessian's blocks are.
    #[must_use]
    pub fn pattern(&self) -> &Pattern {
        &self.layout().pattern
    }

    /// The same cloth with its membrane no stiffer than what lets a length of `height_m` (m) of it stretch by `strain` where
    /// it hangs by its weight; `None` where it is not that stiff, or no height or strain is given.
    #[must_use]
    pub(crate) fn softened(&self, height_m: f64, strain: f64) -> Option<Self> {
        let most = self.weight / self.areas.iter().sum::<f64>() * height_m / strain;
        let softer: Vec<_> = self.stiffness.iter().map(|stiffness| stiffness.capped(most)).collect();
        if !(most > 0.0 && most.is_finite() && softer.iter().any(Option::is_some)) {
            return None;
        }
        let stiffness = softer.iter().zip(&self.stiffness).map(|(softer, own)| softer.unwrap_or(*own)).collect();
        Some(Self { stiffness, ..self.clone() })
    }

    /// The same cloth with another share of its membrane stiffness left under compression, triangle by triangle; slivers keep none.
    #[must_use]
    pub(crate) fn with_slack(mut self, mut slack: Vec<f64>) -> Self {
        slack.iter_mut().zip(&*self.triangles).filter(|(_, t)| t.sliver).for_each(|(slack, _)| *slack = 0.0);
        self.packed_slack = Arc::new(packed(&self.triangles, &slack));
        self.slack = Arc::new(slack);
        self
    }

    /// The same cloth, which goes back towards `x` (m) where a start crosses itself, instead of how it was placed.
    #[must_use]
    pub(crate) fn clear_at(self, x: Vec<DVec3>) -> Self {
        Self { clear: Arc::new(x), ..self }
    }

    /// Number of vertices, held or free.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.masses.len()
    }

    /// Contact stiffness κ to begin with, N/m³; of several fabrics for the thinnest.
    #[must_use]
    pub fn contact_stiffness(&self) -> f64 {
        HALF_THICKNESS_PRESSURE / (0.5 * self.offsets.iter().copied().fold(f64::INFINITY, f64::min))
    }

    /// The membrane stiffness of a triangle.
    pub(crate) fn stiffness_of(&self, triangle: &Triangle) -> &Stiffness {
        &self.stiffness[triangle.fabric as usize]
    }

    /// Contacts of this cloth with a body, found at `x`, friction anchored where it touches there.
    #[must_use]
    pub fn contacts<'b>(&self, body: &'b Body, x: &[DVec3]) -> Contacts<'b> {
        self.found(self.untouched(body), x)
    }

    /// The same by tangent planes: see [`Contacts::by_planes`].
    #[must_use]
    pub(crate) fn contacts_by_planes<'b>(&self, body: &'b Body, x: &[DVec3]) -> Contacts<'b> {
        self.found(self.untouched(body).by_planes(), x)
    }

    /// Where this cloth meets itself; ask [`Contacts::refresh`] before use.
    #[must_use]
    pub fn proximity(&self) -> Proximity {
        let skin = self.skin.get_or_init(|| Arc::new(Skin::new(&self.triangles, self.vertex_count())));
        let of_vertices = [&self.thickness, &self.friction].map(Arc::clone);
        Proximity::new(Arc::clone(skin), [&self.placed, &self.clear].map(Arc::clone), of_vertices)
    }

    /// The layout of a Hessian with blocks for these pairs of vertices as well, ordered as the cloth lies at `x`.
    pub(crate) fn layout_with(&self, x: &[DVec3], pairs: impl Iterator<Item = [u32; 2]>) -> HessianLayout {
        HessianLayout::new(x, &self.triangles, &self.bending, &self.held, pairs)
    }

    pub(super) fn untouched<'b>(&self, body: &'b Body) -> Contacts<'b> {
        let friction = Friction::new(Arc::clone(&self.friction));
        Contacts::new(body, [&self.areas, &self.offsets], &self.held, self.contact_stiffness(), friction)
    }

    pub(super) fn found<'b>(&self, mut contacts: Contacts<'b>, x: &[DVec3]) -> Contacts<'b> {
        contacts.update(x);
        contacts.refresh(x);
        contacts
    }
}

#[cfg(test)]
impl Cloth {
    /// Of a mesh that is at rest as it lies, in a built-in fabric.
    pub(crate) fn sample(mesh: &TriMesh, fabric: &str, held: &[u32]) -> Self {
        let (topology, rest) = (Topology::new(mesh), RestShape::from_edges(mesh).unwrap());
        Self::new(mesh, &topology, &rest, &Fabric::by_name(fabric).unwrap(), held).unwrap()
    }
}

/// How far a round body reaches through the triangles of a mesh whose vertices touch it, m: contact is felt at the vertices
/// alone. A triangle of side l, and so of circumradius l/√3, sags by l²/(6 R) over a sphere of radius R.
fn sag(mesh: &TriMesh) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        sum += a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        count += 3.0;
    }
    (sum / f64::max(count, 1.0) / (6.0 * TIGHTEST_RADIUS)).min(LARGEST_SAG)
}
