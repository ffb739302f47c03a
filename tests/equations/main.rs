//! Equations (2) to (9) of the paper on cases worked by hand: flat patches over flat faces, so that every angle, area and
//! distance is known exactly.
#![allow(clippy::unwrap_used)] // in what the tests share, too

use glam::{DQuat, DVec3};
use partwise::GRAVITY;
use partwise::body::distance::{Body, SurfacePoint};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::paper::{
    BodyForce, Clearance, Contactless, Cosine, LineForce, PaperError, PaperOptions, PaperResult, PaperWarning,
    PartForces, Untouched, Volume, solve,
};
use partwise::mesh::{Topology, TriMesh};
use partwise::parts::range_table::RangeTable;
use partwise::parts::{Parts, segment};

mod balance;
mod fabrics;
mod readings;
mod strip;

const THICKNESS: f64 = 0.001;
const DENSITY: f64 = 0.2;
const WARP: f64 = 50.0;
/// Side of the square patches, m.
const SIDE: f64 = 0.1;

fn cloth() -> Fabric {
    Fabric {
        name: "test cloth".into(),
        source: "made up for round figures".into(),
        density_kg_per_m2: DENSITY,
        thickness_m: THICKNESS,
        stretch_weft_n_per_m: 30.0,
        stretch_warp_n_per_m: WARP,
        shear_n_per_m: 10.0,
        poisson: 0.3,
        bending_nm: [1e-5; 3],
        bending_friction_n: [0.0; 2],
        friction: 0.3,
    }
}

/// A closed box with the given half sizes, turned about the origin, then moved.
fn block(half: DVec3, turn: DQuat, centre: DVec3) -> TriMesh {
    let sign = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |i: usize| centre + turn * (half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2)));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh::new((0..8).map(corner).collect(), triangles)
}

/// A flat grid of `nu` by `nv` squares from `origin` along `u` and `v`; its normal is u × v.
fn patch(origin: DVec3, u: DVec3, v: DVec3, nu: usize, nv: usize) -> TriMesh {
    let at = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=nv {
        for i in 0..=nu {
            positions.push(origin + u * (i as f64 / nu as f64) + v * (j as f64 / nv as f64));
            if i < nu && j < nv {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    TriMesh::new(positions, triangles)
}

struct Case {
    garment: TriMesh,
    topology: Topology,
    body: Body,
    surface: Vec<SurfacePoint>,
    parts: Parts,
}

impl Case {
    fn new(garment: TriMesh, body: &TriMesh, bounds_cm: &[f64]) -> Self {
        let topology = Topology::new(&garment);
        let body = Body::new(body).unwrap();
        let surface = body.nearest_all(&garment.positions);
        let d: Vec<f64> = surface.iter().map(|s| s.signed_distance).collect();
        let parts = segment(&topology, &d, &RangeTable::from_bounds("test", bounds_cm).unwrap());
        Self { garment, topology, body, surface, parts }
    }

    fn solve(&self, options: &PaperOptions) -> PaperResult {
        solve(&self.garment, &self.topology, &self.body, &self.surface, &self.parts, &cloth(), options).unwrap()
    }
}

const ONE_LEVEL: [f64; 2] = [0.0, f64::INFINITY];

/// A floor with its top face at z = 0.
fn floor() -> TriMesh {
    block(DVec3::new(1.0, 1.0, 0.5), DQuat::IDENTITY, DVec3::new(0.0, 0.0, -0.5))
}

/// A square of two triangles over the floor: y level, rising along x by `degrees`, its lowest edge 4 mm up.
fn tilted(degrees: f64) -> Case {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let garment = patch(DVec3::new(0.0, 0.0, 0.004), DVec3::new(cos, 0.0, sin) * SIDE, DVec3::Y * SIDE, 1, 1);
    Case::new(garment, &floor(), &ONE_LEVEL)
}

fn given(q_f: f64, p_f: f64) -> PaperOptions {
    let (body_force, line_force) = (BodyForce::Given(q_f), LineForce::Given(p_f));
    PaperOptions { body_force, line_force, untouched: Untouched::Contactless, ..PaperOptions::default() }
}

#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 + 1e-9 * expected.abs(), "found {found}, expected {expected}");
}

#[track_caller]
fn close3(found: DVec3, expected: [f64; 3]) {
    (0..3).for_each(|i| close(found[i], expected[i]));
}
