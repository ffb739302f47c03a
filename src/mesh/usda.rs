//! Writes meshes as the text of Universal Scene Description (`.usda`): metres, z up, the front at −y.
//!
//! The garment is a mesh with its vertex normals, its groups (the panels of a pattern) as subsets of faces, its texture coordinates
//! (the flat pattern, m) as `primvars:st` of the corners, and optional colours. Schema: UsdGeom of OpenUSD 24.

use std::fmt::{Display, Write as _};
use std::path::Path;

use glam::{DVec2, DVec3};

use super::error::MeshError;
use super::exported::{Export, write};
use super::{TriMesh, box_about};
use crate::base::math;

/// Writes a mesh as `.usda`, and the body beside it.
pub(super) fn write_usda(path: &Path, export: &Export<'_>) -> Result<(), MeshError> {
    let mut text =
        "#usda 1.0\n(\n    defaultPrim = \"drape\"\n    metersPerUnit = 1\n    upAxis = \"Z\"\n)\n\n".to_owned();
    text += "def Xform \"drape\"\n{\n";
    mesh(&mut text, "garment", export.mesh, export.texture, export.colours);
    if let Some(body) = export.body {
        mesh(&mut text, "body", body, None, None);
    }
    write(path, text + "}\n")
}

fn mesh(text: &mut String, name: &str, of: &TriMesh, texture: Option<&[[DVec2; 3]]>, colours: Option<&[[u8; 4]]>) {
    let vector = |p: &DVec3| format!("({}, {}, {})", p.x as f32, p.y as f32, p.z as f32);
    let (low, high) = box_about(of.positions.iter().copied());
    // Writing into a String cannot fail.
    let _ = writeln!(text, "    def Mesh \"{name}\"\n    {{");
    let _ = writeln!(text, "        uniform bool doubleSided = 1");
    let _ = writeln!(text, "        uniform token subdivisionScheme = \"none\"");
    list(text, "float3[] extent", [low, high].iter().map(vector), None);
    list(text, "int[] faceVertexCounts", of.triangles.iter().map(|_| 3), None);
    list(text, "int[] faceVertexIndices", of.triangles.as_flattened(), None);
    list(text, "point3f[] points", of.positions.iter().map(vector), None);
    list(text, "normal3f[] normals", of.vertex_normals().iter().map(vector), Some("vertex"));
    if let Some(texture) = texture {
        let corner = |uv: &DVec2| format!("({}, {})", uv.x as f32, uv.y as f32);
        list(text, "texCoord2f[] primvars:st", texture.as_flattened().iter().map(corner), Some("faceVarying"));
    }
    if let Some(colours) = colours {
        // Colours of USD are linear, those of the mesh sRGB (IEC 61966-2-1).
        let linear = |byte: u8| match f64::from(byte) / 255.0 {
            low if low <= 0.04045 => (low / 12.92) as f32,
            high => math::powf((high + 0.055) / 1.055, 2.4) as f32,
        };
        let colour = |c: &[u8; 4]| format!("({}, {}, {})", linear(c[0]), linear(c[1]), linear(c[2]));
        list(text, "color3f[] primvars:displayColor", colours.iter().map(colour), Some("vertex"));
    }
    if !of.groups.is_empty() {
        let _ = writeln!(text, "        uniform token subsetFamily:panel:familyType = \"partition\"");
    }
    for (g, group) in of.groups.iter().enumerate() {
        let faces = of.triangle_group.iter().enumerate().filter(|(_, of)| **of as usize == g).map(|(t, _)| t);
        let (name, shown) = (identifier(group, g), group.replace(['\\', '"'], "_"));
        let _ = writeln!(
            text,
            "        def GeomSubset \"{name}\" (\n            displayName = \"{shown}\"\n        )\n        {{"
        );
        let _ = writeln!(
            text,
            "        uniform token elementType = \"face\"\n        uniform token familyName = \"panel\""
        );
        list(text, "int[] indices", faces, None);
        let _ = writeln!(text, "        }}");
    }
    let _ = writeln!(text, "    }}");
}

/// An attribute with a list of values.
fn list<T: Display>(text: &mut String, name: &str, values: impl IntoIterator<Item = T>, interpolation: Option<&str>) {
    let _ = write!(text, "        {name} = [");
    for (k, value) in values.into_iter().enumerate() {
        let _ = write!(text, "{}{value}", if k == 0 { "" } else { ", " });
    }
    match interpolation {
        Some(kind) => text.push_str(&format!("] (\n            interpolation = \"{kind}\"\n        )\n")),
        None => text.push_str("]\n"),
    }
}

/// A name of letters, digits and underscores, as USD asks for, different for each group.
fn identifier(name: &str, number: usize) -> String {
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain == name && !name.starts_with(|c: char| c.is_ascii_digit()) { plain } else { format!("g{number}_{plain}") }
}
