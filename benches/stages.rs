//! Each stage of a drape by size: `cargo bench --no-default-features`. Compare two builds on one idle machine, as ratios.
//!
//! Loading and placing are not timed. The garment is the built-in flared skirt in knit.

#![allow(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use divan::{Bencher, black_box};
use glam::DVec3;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh as ParryMesh, TriMeshFlags};
use partwise::drape::{Refine, unobserved};
use partwise::mechanics::energy::{Cloth, Contacts, Scratch};
use partwise::mechanics::refine::Solver;
use partwise::parts::range_table::RangeTable;
use partwise::scene::Loaded;
use partwise::study::job::Job;
use rayon::prelude::*;

const SIZES: [usize; 3] = [1000, 4000, 16_000];

fn main() {
    divan::main();
}

fn job(vertices: usize, refine: Refine) -> (Job, Loaded) {
    let mut job = Job::preview();
    job.scene.garment = format!("flared-skirt@{vertices}");
    job.settings.table = RangeTable::table_3().into();
    job.settings.refine = refine;
    let loaded = job.scene.load().unwrap();
    (job, loaded)
}

fn cloth_of(job: &Job, Loaded { scene, .. }: &Loaded) -> Cloth {
    Cloth::new(&scene.garment, &scene.topology, &scene.rest, &job.settings.fabric, &scene.held).unwrap()
}

/// First half of stage one: the closest point of the body to each vertex.
#[divan::bench(args = SIZES)]
fn closest_points(bencher: Bencher<'_, '_>, vertices: usize) {
    let (_, loaded) = job(vertices, Refine::Steps(0));
    bencher.bench(|| loaded.scene.body.nearest_all(black_box(&loaded.scene.garment.positions)));
}

/// The same by parry3d's own search, for comparison.
#[divan::bench(args = SIZES)]
fn closest_points_by_parry(bencher: Bencher<'_, '_>, vertices: usize) {
    let (_, loaded) = job(vertices, Refine::Steps(0));
    let body = loaded.scene.body.mesh();
    let shape = ParryMesh::with_flags(body.positions.clone(), body.triangles.clone(), TriMeshFlags::ORIENTED).unwrap();
    bencher.bench(|| {
        let points = black_box(&loaded.scene.garment.positions).par_iter().with_min_len(128);
        points.map(|x| shape.project_local_point_and_get_location(*x, false).0.point).collect::<Vec<_>>()
    });
}

/// Second half of stage one: levels to connected PARTs.
#[divan::bench(args = SIZES)]
fn stage_one(bencher: Bencher<'_, '_>, vertices: usize) {
    let (_, loaded) = job(vertices, Refine::Steps(0));
    let surface = loaded.scene.body.nearest_all(&loaded.scene.garment.positions);
    let distance: Vec<f64> = surface.iter().map(|s| s.signed_distance.abs()).collect();
    let table = RangeTable::table_3();
    bencher.bench(|| partwise::parts::segment(&loaded.scene.topology, black_box(&distance), &table));
}

/// The constant part of the energy, and the symbolic factorisation.
#[divan::bench(args = SIZES)]
fn setting_up(bencher: Bencher<'_, '_>, vertices: usize) {
    let (job, loaded) = job(vertices, Refine::Steps(0));
    bencher.bench(|| {
        let cloth = cloth_of(&job, &loaded);
        Solver::new(cloth.pattern())
    });
}

/// A whole preview by the PARTs of Table 3.
#[divan::bench(args = SIZES)]
fn stage_two(bencher: Bencher<'_, '_>, vertices: usize) {
    let (job, loaded) = job(vertices, Refine::Steps(0));
    bencher.bench(|| job.drape(&loaded.scene, &mut unobserved).unwrap());
}

/// The costly part of a Newton step: gradient, Hessian, factor, solution.
#[divan::bench(args = SIZES)]
fn newton_step(bencher: Bencher<'_, '_>, vertices: usize) {
    let (job, loaded) = job(vertices, Refine::Steps(0));
    let cloth = cloth_of(&job, &loaded);
    let x = &loaded.scene.garment.positions;
    let contacts: Contacts<'_> = cloth.contacts(&loaded.scene.body, x);
    let mut solver = Solver::new(cloth.pattern());
    let damped: Vec<f64> = cloth.order().iter().map(|&v| 300.0 * cloth.masses[v as usize]).collect();
    let (mut gradient, mut blocks, mut scratch) = (Vec::new(), Vec::new(), Scratch::default());
    bencher.bench_local(|| {
        cloth.evaluate(x, &contacts, &mut gradient, &mut scratch);
        cloth.hessian(x, &contacts, &mut blocks);
        let mut d: Vec<DVec3> = cloth.order().iter().map(|&v| -gradient[v as usize]).collect();
        solver.factorise(&blocks, &damped).unwrap();
        solver.solve(cloth.pattern(), &blocks, &damped, 1e-4, &mut d);
        d
    });
}

/// A whole drape to rest.
#[divan::bench(args = [1000, 4000], sample_count = 5, sample_size = 1)]
fn converged(bencher: Bencher<'_, '_>, vertices: usize) {
    let (job, loaded) = job(vertices, Refine::Converged);
    bencher.bench(|| job.drape(&loaded.scene, &mut unobserved).unwrap());
}
