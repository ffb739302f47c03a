//! Meshes and points in single precision, which is what a recording holds: `#[serde(with = "single::points")]`.

use crate::mesh::TriMesh;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

fn rounded(points: &[DVec3]) -> Vec<Vec3> {
    points.iter().map(DVec3::as_vec3).collect()
}

fn widened(points: Vec<Vec3>) -> Vec<DVec3> {
    points.iter().map(Vec3::as_dvec3).collect()
}

pub(super) mod points {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(points: &[DVec3], to: S) -> Result<S::Ok, S::Error> {
        rounded(points).serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<DVec3>, D::Error> {
        Deserialize::deserialize(from).map(widened)
    }
}

pub(super) mod numbers {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(numbers: &[f64], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(numbers.iter().map(|&x| x as f32))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        Ok(Vec::<f32>::deserialize(from)?.into_iter().map(f64::from).collect())
    }
}

/// Positions and triangles; a recording shows no groups.
pub(super) mod mesh {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(mesh: &TriMesh, to: S) -> Result<S::Ok, S::Error> {
        (rounded(&mesh.positions), &mesh.triangles).serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<TriMesh, D::Error> {
        let (positions, triangles) = Deserialize::deserialize(from)?;
        Ok(TriMesh::new(widened(positions), triangles))
    }
}
