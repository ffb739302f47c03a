//! Folds drawn on a preview: the excess length that [`folds`](super::folds) finds, as waves of the surface.
//!
//! Where PARTs are wider than a fold, a preview of a flared skirt is a straight tube: its cloth is compressed around the tube instead of
//! folded. In a region that closes around a vertical axis, with θ the angle about the axis, the surface is moved along its normal by
//!
//! d = a cos(N θ − φ) + max(0, a − g),  a = k(ℓ)/(N |∇θ|).
//!
//! k is the slope of a sine wave whose arc length is ℓ times its chord: so sections keep their length at rest. The second term keeps folds
//! out of the body: those with less room than their amplitude stand outwards. The number of folds N minimises bending and lifting together:
//!
//! E(N) = N² Σ ½ B κ²(k) |∇θ|² A + N⁻² Σ ¼ T |∂(k/|∇θ|)/∂t|² A,  N ≥ Σ k/|∇θ| A / Σ g A,
//!
//! the first sum the bending of the waves, the second the work against the tension along them, as their crests are inclined; the bound says
//! that on average they have room. φ puts the crests that point inwards where the room is largest.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ℓ | length across the folds at rest, over that in the preview | – |
//! | k, a | largest slope and amplitude of the wave | –, m |
//! | κ² | mean square curvature of a sine wave of unit wave number | – |
//! | g | room: distance to the body less the offset of contact | m |
//! | A, B | rest area of a triangle, mean bending stiffness | m², N·m |
//! | T | tension along the folds: weight of the cloth below, ρ g (z − z of the hem) | N/m |
//! | ∂/∂t | derivative along the folds | 1/m |
//!
//! Source: own; the balance of bending and tension after Cerda and Mahadevan ("Geometry and physics of wrinkling", 2003), drawing a known
//! excess after Rémillard and Kry ("Embedded thin shells for wrinkle simulation", 2013). No constant is fitted: flared skirts get 8 and 9
//! folds and drape with 8, dresses 5 and 6 and drape with 4 to 6. Limits: regions that close around a vertical axis only (skirts, not sleeves); one number of folds a
//! region; sine waves, so folds do not overhang; garments of several layers show none.

use std::f64::consts::{PI, TAU};

use std::sync::{Arc, LazyLock};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::coupled::Clearance;
use super::energy::Cloth;
use super::energy::membrane::Triangle;
use super::folds::{Folds, compression};
use super::sine_waves::SineWaves;
use crate::GRAVITY;
use crate::base::math;
use crate::body::distance::{Body, SurfacePoint};
use crate::garment::fabric::Fabric;
use crate::mesh::{Topology, TriMesh};

/// Excess length from which cloth folds: below it compression and rounding of the mesh look alike. Folds grow from here to twice of it.
const MIN_EXCESS: f64 = 0.05;

/// Largest excess length that is drawn: it makes waves of slope 12.
const MAX_EXCESS: f64 = 0.85;

/// Averages over neighbours that smooth the excess, which varies from triangle to triangle. Heuristic: smoothing the amplitude as well shortens
/// hems by 2 to 5 %.
const SMOOTHING: usize = 10;

/// Slices of a region, of which each has a middle, and sectors around it, nearly all of which a closed region occupies. Heuristic.
const SLICES: usize = 12;
const SECTORS: usize = 24;
const MIN_SECTORS: usize = 22;

/// Least mean |cos| between the direction across the folds and ∇θ: with less, folds do not run along the axis. Heuristic.
const MIN_ALIGNMENT: f64 = 0.8;

/// Times that the waves are drawn: after each but the last their excess length is corrected by the length that is missing across them.
const PASSES: usize = 3;

/// Edges of the mesh that a fold needs at least.
const EDGES_PER_FOLD: f64 = 6.0;

/// Least number of vertices in a parallel task.
const MIN_TASK: usize = 512;

static WAVES: LazyLock<SineWaves> = LazyLock::new(SineWaves::new);

/// Data of a cloth for drawing its folds.
#[derive(Debug, Clone)]
pub(crate) struct FoldableCloth {
    triangles: Arc<Vec<Triangle>>,
    fabrics: Arc<Vec<Fabric>>,
    areas: Vec<f64>,
    offsets: Vec<f64>,
    held: Vec<bool>,
}

impl From<&Cloth> for FoldableCloth {
    fn from(cloth: &Cloth) -> Self {
        Self {
            triangles: Arc::clone(&cloth.triangles),
            fabrics: Arc::clone(&cloth.fabrics),
            areas: cloth.areas.clone(),
            offsets: cloth.offsets.clone(),
            held: cloth.held.clone(),
        }
    }
}

/// A preview with its folds.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldedSurface {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Number of folds of each region that has some.
    pub counts: Vec<usize>,
}

/// Draws the `folds` of `cloth` on its `preview`, over `body`.
pub(crate) fn folded_surface(
    cloth: &FoldableCloth,
    topology: &Topology,
    body: &Body,
    preview: &TriMesh,
    folds: &Folds,
) -> FoldedSurface {
    let x = &preview.positions;
    let mut excess: Vec<f64> = folds.excess_percent.iter().map(|percent| 0.01 * percent).collect();
    for _ in 0..SMOOTHING {
        excess = averaged(topology, &excess);
    }
    let waves = &*WAVES;
    let normals = preview.vertex_normals();
    let mut moves = vec![0.0; x.len()];
    let mut counts = Vec::new();
    let nowhere = SurfacePoint { point: DVec3::ZERO, signed_distance: 0.0, normal: DVec3::ZERO, triangle: 0 };
    let mut surface = vec![nowhere; x.len()];
    for region in regions(topology, &excess) {
        let Some(ring) = Ring::new(cloth, topology, x, &region, folds) else { continue };
        let at: Vec<DVec3> = region.iter().map(|&v| x[v as usize]).collect();
        let mut room = vec![f64::INFINITY; x.len()];
        for (&v, near) in region.iter().zip(body.nearest_all(&at)) {
            room[v as usize] = (near.signed_distance - cloth.offsets[v as usize]).max(0.0);
            surface[v as usize] = near;
        }
        let mut reach = vec![0.0; x.len()];
        ring.reach(&region, &excess, waves, &mut reach);
        let Some(count) = ring.count(cloth, x, &excess, &reach, &room, waves) else { continue };
        let n = count as f64;
        let phase = ring.phase(cloth, &region, &room, n);
        let wave = |&v: &u32| math::cos(n * ring.angle[v as usize] - phase);
        let wave: Vec<f64> = region.par_iter().with_min_len(MIN_TASK).map(wave).collect();
        for pass in 0..PASSES {
            for (&v, wave) in region.iter().zip(&wave) {
                let v = v as usize;
                let amplitude = reach[v] / n;
                moves[v] = amplitude * wave + (amplitude - room[v]).max(0.0);
            }
            if pass + 1 == PASSES {
                break;
            }
            let drawn = ring.drawn_share(&drawn(x, &normals, &moves));
            for &v in &region {
                let e = &mut excess[v as usize];
                *e = 1.0 - (1.0 - *e) * drawn.at(x[v as usize].z);
            }
            ring.reach(&region, &excess, waves, &mut reach);
        }
        counts.push(count);
    }
    let mut positions = drawn(x, &normals, &moves);
    let still: Vec<bool> = moves.iter().zip(&cloth.held).map(|(&d, &held)| held || d == 0.0).collect();
    positions.iter_mut().zip(x).zip(&still).filter(|(_, still)| **still).for_each(|((moved, x), _)| *moved = *x);
    Clearance::new(x, &surface).push_out(body, &still, &cloth.offsets, &mut positions);
    FoldedSurface { positions, counts }
}

/// The surface moved along its normals, m.
fn drawn(x: &[DVec3], normals: &[DVec3], moves: &[f64]) -> Vec<DVec3> {
    x.iter().zip(normals).zip(moves).map(|((x, n), d)| *x + *n * *d).collect()
}

/// Half of each value and half of the mean over its neighbours.
fn averaged(topology: &Topology, values: &[f64]) -> Vec<f64> {
    let of_vertex = |(v, &value): (usize, &f64)| {
        let near = topology.neighbours(v as u32);
        let sum: f64 = near.iter().map(|&w| values[w as usize]).sum();
        if near.is_empty() { value } else { 0.5 * (value + sum / near.len() as f64) }
    };
    values.par_iter().with_min_len(4 * MIN_TASK).enumerate().map(of_vertex).collect()
}

/// Connected vertices whose excess is over [`MIN_EXCESS`].
fn regions(topology: &Topology, excess: &[f64]) -> Vec<Vec<u32>> {
    let mut seen: Vec<bool> = excess.iter().map(|&e| e < MIN_EXCESS).collect();
    let mut regions = Vec::new();
    for first in 0..excess.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut region = vec![first as u32];
        let mut next = 0;
        while let Some(&v) = region.get(next) {
            next += 1;
            for &w in topology.neighbours(v) {
                if !std::mem::replace(&mut seen[w as usize], true) {
                    region.push(w);
                }
            }
        }
        regions.push(region);
    }
    regions
}

/// A region that closes around a vertical axis.
struct Ring<'a> {
    triangles: Vec<&'a Triangle>,
    /// ∇θ in each, 1/m.
    around: Vec<DVec3>,
    /// Of the compressed triangles: index, direction of the compression in the rest shape, and height z, m.
    compressed: Vec<(u32, DVec2, f64)>,
    /// θ of each vertex of the region.
    angle: Vec<f64>,
    /// |∇θ|, 1/m, at its vertices.
    gradient: Vec<f64>,
    slices: Slices,
    /// Most folds that the mesh can show.
    max_count: f64,
}

impl<'a> Ring<'a> {
    /// `None` where the region does not close, or its folds run otherwise.
    fn new(cloth: &'a FoldableCloth, topology: &Topology, x: &[DVec3], region: &[u32], folds: &Folds) -> Option<Self> {
        let mut inside = vec![false; x.len()];
        region.iter().for_each(|&v| inside[v as usize] = true);
        let heights = region.iter().map(|&v| x[v as usize].z);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let slices = Slices { low, scale: (SLICES - 1) as f64 / (high - low).max(f64::MIN_POSITIVE) };
        let mut sums = [(DVec2::ZERO, 0.0); SLICES];
        for &v in region {
            let (below, share) = slices.at(x[v as usize].z);
            for (k, part) in [(below, 1.0 - share), (below + 1, share)] {
                let weight = part * cloth.areas[v as usize];
                sums[k] = (sums[k].0 + x[v as usize].truncate() * weight, sums[k].1 + weight);
            }
        }
        let middles = sums.map(|(sum, weight)| sum / weight.max(f64::MIN_POSITIVE));
        let theta = |&v: &u32| {
            let p = x[v as usize];
            let (below, share) = slices.at(p.z);
            math::angle(p.truncate() - middles[below].lerp(middles[below + 1], share))
        };
        let thetas: Vec<f64> = region.par_iter().with_min_len(MIN_TASK).map(theta).collect();
        let mut angle = vec![0.0; x.len()];
        let mut occupied = [false; SECTORS];
        for (&v, theta) in region.iter().zip(thetas) {
            angle[v as usize] = theta;
            occupied[((theta + PI) / TAU * SECTORS as f64) as usize % SECTORS] = true;
        }
        if occupied.iter().filter(|&&o| o).count() < MIN_SECTORS {
            return None;
        }
        let whole = |t: &&Triangle| !t.sliver && t.vertices.iter().all(|&v| inside[v as usize]);
        let triangles: Vec<&Triangle> = cloth.triangles.iter().filter(whole).collect();
        let of_triangle = |t: &&Triangle| {
            let [a, b, c] = t.vertices.map(|v| angle[v as usize]);
            let around = gradient(x, t, turn(b - a), turn(c - a));
            (around, compression(t.deformation(x)))
        };
        let found: Vec<_> = triangles.par_iter().with_min_len(MIN_TASK).map(of_triangle).collect();
        let height = |t: &Triangle| t.vertices.iter().map(|&v| x[v as usize].z).sum::<f64>() / 3.0;
        let folded = (0..).zip(triangles.iter().zip(&found)).filter(|(_, (_, (_, (excess, _))))| *excess >= MIN_EXCESS);
        let compressed = folded.map(|(i, (t, (_, (_, v2))))| (i, *v2, height(t))).collect();
        let around = found.into_iter().map(|(around, _)| around).collect();
        let gradient = vec![0.0; x.len()];
        let mut ring = Self { triangles, around, compressed, angle, gradient, slices, max_count: 0.0 };
        let mut areas = vec![0.0; x.len()];
        let (mut aligned, mut all) = (0.0, 0.0);
        for (t, gradient) in ring.triangles.iter().zip(&ring.around) {
            let size = gradient.length();
            for v in t.vertices.map(|v| v as usize) {
                ring.gradient[v] += t.area * size;
                areas[v] += t.area;
                let weight = t.area * folds.excess_percent[v];
                aligned += weight * (folds.across[v].dot(*gradient) / size.max(f64::MIN_POSITIVE)).abs();
                all += weight;
            }
        }
        for (gradient, area) in ring.gradient.iter_mut().zip(&areas) {
            *gradient = if *area > 0.0 { (*gradient / area).max(f64::MIN_POSITIVE.sqrt()) } else { f64::INFINITY };
        }
        // Also of a vertex, |∇θ| grows without limit towards the axis.
        if aligned < MIN_ALIGNMENT * all || region.iter().any(|&v| ring.gradient[v as usize] == f64::INFINITY) {
            return None;
        }
        let across = |[a, b]: &[u32; 2]| {
            (inside[*a as usize] && inside[*b as usize])
                .then(|| turn(ring.angle[*b as usize] - ring.angle[*a as usize]).abs())
        };
        let steps: Vec<f64> = topology.edges.iter().filter_map(across).collect();
        ring.max_count = TAU / (EDGES_PER_FOLD * steps.iter().sum::<f64>() / steps.len().max(1) as f64);
        Some(ring)
    }

    /// N a at each vertex of the region, m.
    fn reach(&self, region: &[u32], excess: &[f64], waves: &SineWaves, out: &mut [f64]) {
        for &v in region {
            let e = excess[v as usize].min(MAX_EXCESS);
            let grown = ((e - MIN_EXCESS) / MIN_EXCESS).clamp(0.0, 1.0);
            out[v as usize] = grown * waves.slope((1.0 - e).recip()) / self.gradient[v as usize];
        }
    }

    /// Length across the folds in `drawn` over that at rest, by the height of the preview. Waves of few edges are shorter than sine waves.
    fn drawn_share(&self, drawn: &[DVec3]) -> BySlice {
        let mut share = BySlice { slices: self.slices, sums: [(0.0, 0.0); SLICES] };
        for &(i, v2, z) in &self.compressed {
            let t = self.triangles[i as usize];
            let [fu, fv] = t.deformation(drawn);
            share.add(z, (fu * v2.x + fv * v2.y).length(), t.area);
        }
        share
    }

    /// N; `None` where there is nothing to fold.
    fn count(
        &self,
        cloth: &FoldableCloth,
        x: &[DVec3],
        excess: &[f64],
        reach: &[f64],
        room: &[f64],
        waves: &SineWaves,
    ) -> Option<usize> {
        let (mut bending, mut lifting, mut amplitude, mut space) = (0.0, 0.0, 0.0, 0.0);
        for (t, &around) in self.triangles.iter().zip(&self.around) {
            let vertices = t.vertices.map(|v| v as usize);
            let mean = |values: &[f64]| vertices.iter().map(|&v| values[v]).sum::<f64>() / 3.0;
            let fabric = &cloth.fabrics[t.fabric as usize];
            let size = around.length().max(f64::MIN_POSITIVE);
            let [a, b, c] = vertices.map(|v| reach[v]);
            let slope = gradient(x, t, b - a, c - a);
            let along = slope.reject_from(around);
            let height = vertices.iter().map(|&v| x[v].z).sum::<f64>() / 3.0 - self.slices.low;
            let tension = fabric.density_kg_per_m2 * GRAVITY * height;
            let k = mean(reach) * size;
            bending += 0.5 * fabric.mean_bending_nm() * waves.square_curvature(k) * size * size * t.area;
            // Of the preview's area: ¼ is the mean of ½ cos².
            lifting += 0.25 * tension * along.length_squared() * (1.0 - mean(excess).min(MAX_EXCESS)) * t.area;
            amplitude += mean(reach) * t.area;
            space += mean(room) * t.area;
        }
        if bending <= 0.0 || amplitude <= 0.0 {
            return None;
        }
        let count = (lifting / bending).sqrt().sqrt().max(amplitude / space.max(f64::MIN_POSITIVE));
        let count = count.min(self.max_count).round();
        (count >= 2.0).then_some(count as usize)
    }

    /// φ: the phase at which crests that point inwards have the most room.
    fn phase(&self, cloth: &FoldableCloth, region: &[u32], room: &[f64], n: f64) -> f64 {
        let (mut re, mut im) = (0.0, 0.0);
        for v in region.iter().map(|&v| v as usize) {
            let (sin, cos) = math::sin_cos(n * self.angle[v]);
            (re, im) = (re + cloth.areas[v] * room[v] * cos, im + cloth.areas[v] * room[v] * sin);
        }
        math::atan2(im, re) + PI
    }
}

/// Horizontal slices of a region, each vertex shared by two.
#[derive(Clone, Copy)]
struct Slices {
    /// z of its lowest vertex, m.
    low: f64,
    /// Slices for each metre above it.
    scale: f64,
}

impl Slices {
    /// The slice at height z, and the share of the next one.
    fn at(&self, z: f64) -> (usize, f64) {
        let at = ((z - self.low) * self.scale).clamp(0.0, (SLICES - 1) as f64);
        let below = (at as usize).min(SLICES - 2);
        (below, at - below as f64)
    }
}

/// Mean values of the slices of a region.
struct BySlice {
    slices: Slices,
    /// Weighted sum and weight.
    sums: [(f64, f64); SLICES],
}

impl BySlice {
    fn add(&mut self, z: f64, value: f64, weight: f64) {
        let (below, share) = self.slices.at(z);
        for (k, part) in [(below, 1.0 - share), (below + 1, share)] {
            self.sums[k] = (self.sums[k].0 + part * weight * value, self.sums[k].1 + part * weight);
        }
    }

    /// The mean at height z; 1 where nothing was added.
    fn at(&self, z: f64) -> f64 {
        let (below, share) = self.slices.at(z);
        let mean = |k: usize| if self.sums[k].1 > 0.0 { self.sums[k].0 / self.sums[k].1 } else { 1.0 };
        (1.0 - share) * mean(below) + share * mean(below + 1)
    }
}

/// A difference of angles, in −π to π.
fn turn(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// Gradient of a linear function on a triangle at x, from its differences along two edges.
fn gradient(x: &[DVec3], t: &Triangle, by_u: f64, by_v: f64) -> DVec3 {
    let [a, b, c] = t.vertices.map(|v| x[v as usize]);
    let (u, v) = (b - a, c - a);
    let (uu, uv, vv) = (u.length_squared(), u.dot(v), v.length_squared());
    let determinant = uu * vv - uv * uv;
    if determinant <= f64::MIN_POSITIVE {
        return DVec3::ZERO;
    }
    (u * (vv * by_u - uv * by_v) + v * (uu * by_v - uv * by_u)) / determinant
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::garment::fabric::Fabric;
    use crate::mechanics::folds::folds;
    use crate::mesh::RestShape;
    use crate::mesh::samples::{cuboid, tube};

    const ROWS: u32 = 30;
    const AROUND: u32 = 96;
    const HEIGHT_M: f64 = 0.6;

    /// A tube whose radius grows from `top` to `hem` (m), turned by an angle.
    fn flared(top: f64, hem: f64, turned: f64) -> TriMesh {
        tube(AROUND, ROWS, |angle, row| {
            let share = row / f64::from(ROWS);
            (math::unit(angle + turned) * (hem + (top - hem) * share)).extend(HEIGHT_M * share)
        })
    }

    /// A skirt with a hem of 40 cm radius at rest, previewed as a tube of 20 cm over a post of half this width (m).
    fn skirt(bending_nm: f64, post: f64, turned: f64) -> (Cloth, FoldedSurface, f64) {
        let fabric = Fabric { bending_nm: [bending_nm; 3], ..Fabric::by_name("jersey").unwrap() };
        let (rest, tube) = (flared(0.15, 0.4, turned), flared(0.15, 0.2, turned));
        let topology = Topology::new(&tube);
        let cloth = Cloth::new(&tube, &topology, &RestShape::from_edges(&rest).unwrap(), &fabric, &[]).unwrap();
        let body = Body::new(&cuboid(DVec3::new(-post, -post, -0.1), DVec3::new(post, post, 0.7))).unwrap();
        let drawn = folded_surface(&(&cloth).into(), &topology, &body, &tube, &folds(&cloth, &tube.positions));
        let inside = body.nearest_all(&drawn.positions).iter().filter(|near| near.signed_distance <= 0.0).count();
        assert_eq!(inside, 0);
        let hem = |v: usize| drawn.positions[v % AROUND as usize];
        let length = (0..AROUND as usize).map(|v| hem(v).distance(hem(v + 1))).sum();
        (cloth, drawn, length)
    }

    #[test]
    fn a_flared_tube_folds_to_its_length_at_rest() {
        let (_, drawn, hem_m) = skirt(1e-5, 0.02, 0.0);
        assert_eq!(drawn.counts.len(), 1);
        // 2.51 m at rest, 1.26 m in the preview.
        assert!((hem_m / (TAU * 0.4) - 1.0).abs() < 0.05, "hem of {hem_m} m");
        let (_, turned, turned_m) = skirt(1e-5, 0.02, 0.3);
        assert_eq!(turned.counts, drawn.counts);
        assert!((turned_m - hem_m).abs() < 0.01 * hem_m);
    }

    #[test]
    fn stiffer_cloth_has_fewer_folds_and_less_room_makes_more() {
        let count = |bending_nm, post| skirt(bending_nm, post, 0.0).1.counts[0] as f64;
        let soft = count(1e-6, 0.02);
        // N grows as B^(−1/4): sixteen times the stiffness has half as many.
        assert!((count(16e-6, 0.02) / soft - 0.5).abs() < 0.1, "{soft} folds");
        assert!(count(16e-6, 0.11) > count(16e-6, 0.02));
    }

    #[test]
    fn an_unstrained_tube_and_a_flap_stay_as_they_are() {
        let mesh = flared(0.15, 0.4, 0.0);
        let topology = Topology::new(&mesh);
        let fabric = Fabric::by_name("jersey").unwrap();
        let body = Body::new(&cuboid(DVec3::splat(-0.05), DVec3::splat(0.05))).unwrap();
        let cloth = Cloth::new(&mesh, &topology, &RestShape::from_edges(&mesh).unwrap(), &fabric, &[]).unwrap();
        let none = folds(&cloth, &mesh.positions);
        let drawn = folded_surface(&(&cloth).into(), &topology, &body, &mesh, &none);
        assert!(drawn.counts.is_empty() && drawn.positions == mesh.positions);
        // Half of a tube does not close: squeezed to half its width, it has excess and no folds.
        let half = crate::mesh::samples::sheet(24, 12, |i, j| (math::unit(PI * i / 24.0) * 0.2).extend(j * 0.03));
        let squeeze = |p: &DVec3| *p * DVec3::new(0.5, 0.5, 1.0);
        let squeezed = half.with_positions(half.positions.iter().map(squeeze).collect());
        let topology = Topology::new(&half);
        let cloth = Cloth::new(&half, &topology, &RestShape::from_edges(&half).unwrap(), &fabric, &[]).unwrap();
        let excess = folds(&cloth, &squeezed.positions);
        assert!(excess.excess_percent.iter().all(|&e| e > 40.0));
        let drawn = folded_surface(&(&cloth).into(), &topology, &body, &squeezed, &excess);
        assert!(drawn.counts.is_empty() && drawn.positions == squeezed.positions);
    }
}
