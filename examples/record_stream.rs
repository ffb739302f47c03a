//! Logs a drape into a Rerun stream of the application:
//! `cargo run --example record_stream -- out.rrd`

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example prints")]

use std::error::Error;

use partwise::mesh::TriMesh;
use partwise::{DVec3, SceneSpec, Settings, drape};
use rerun::{Mesh3D, RecordingStreamBuilder};

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "drape.rrd".to_owned());
    let recording = RecordingStreamBuilder::new("my_application").save(&out)?;
    let input = SceneSpec::new("form", "flared-skirt@900").load()?;
    recording.log_static("world/body", &shape(input.scene.body.mesh()))?;
    recording.set_time_sequence("state", 0);
    recording.log("world/garment", &shape(&input.scene.garment))?;
    let draped = drape::drape(&input.scene, &Settings::default(), &mut |step| {
        recording.set_time_sequence("iteration", i64::try_from(step.iteration).unwrap_or(i64::MAX));
        // `flush_blocking` reports a failed recording; the drape goes on without it.
        let _ = recording.log("solver/residual_over_weight", &rerun::Scalars::single(step.residual_over_weight));
        std::ops::ControlFlow::Continue(())
    })?;
    recording.set_time_sequence("state", 1);
    recording.log("world/garment", &shape(&input.scene.garment.with_positions(draped.positions)))?;
    recording.flush_blocking()?;
    println!("{out}");
    Ok(())
}

/// Converts a mesh to Rerun's.
fn shape(mesh: &TriMesh) -> Mesh3D {
    let single = |points: &[DVec3]| points.iter().map(|p| p.as_vec3().to_array()).collect::<Vec<_>>();
    Mesh3D::new(single(&mesh.positions))
        .with_triangle_indices(mesh.triangles.iter().copied())
        .with_vertex_normals(single(&mesh.vertex_normals()))
}
