//! Writes one mesh as binary glTF (`.glb`) for viewers and try-on programs.
//!
//! Metres, y up, the body's front at +z, counter-clockwise from outside, as glTF 2.0 requires (Khronos Group, 2021, sections
//! 3.4 and 4.4). Positions and vertex normals are in single precision, optional colours in eight bits. The material is
//! double-sided.

use std::path::Path;

use glam::DVec3;
use serde_json::json;

use super::TriMesh;
use super::error::MeshError;
use super::export::write;

/// Codes of the format for chunk types, component types and buffer targets.
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BINARY_CHUNK: u32 = 0x004E_4942;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_BYTE: u32 = 5121;
const ARRAY: u32 = 34962;
const ELEMENTS: u32 = 34963;

/// Writes a mesh (m, z up) as `.glb`, with an optional colour for each vertex (red, green, blue, opacity).
///
/// # Errors
/// [`MeshError::WrongCount`] where there are not as many colours as vertices, [`MeshError::Unwritable`].
pub(crate) fn write_glb(path: &Path, mesh: &TriMesh, colours: Option<&[[u8; 4]]>) -> Result<(), MeshError> {
    let expected = mesh.vertex_count();
    if let Some(found) = colours.map(<[_]>::len).filter(|&found| found != expected) {
        return Err(MeshError::WrongCount { found, expected });
    }
    write(path, bytes(mesh, colours))
}

fn bytes(mesh: &TriMesh, colours: Option<&[[u8; 4]]>) -> Vec<u8> {
    let upright = |p: &DVec3| [p.x as f32, p.z as f32, -p.y as f32];
    let places: Vec<[f32; 3]> = mesh.positions.iter().map(upright).collect();
    let normals: Vec<[f32; 3]> = mesh.vertex_normals().iter().map(upright).collect();
    let bound = |pick: fn(f32, f32) -> f32, start: f32| {
        places.iter().fold([start; 3], |bound, p| [0, 1, 2].map(|k| pick(bound[k], p[k])))
    };
    let (low, high) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
    let mut binary: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut push = |part: Vec<u8>, target: u32| {
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": part.len(), "target": target }));
        binary.extend(part);
    };
    let floats = |list: &[[f32; 3]]| list.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    push(floats(&places), ARRAY);
    push(floats(&normals), ARRAY);
    push(mesh.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect(), ELEMENTS);
    let (n, corners) = (places.len(), 3 * mesh.triangles.len());
    let mut accessors = vec![
        json!({ "bufferView": 0, "componentType": FLOAT, "count": n, "type": "VEC3", "min": low, "max": high }),
        json!({ "bufferView": 1, "componentType": FLOAT, "count": n, "type": "VEC3" }),
        json!({ "bufferView": 2, "componentType": UNSIGNED_INT, "count": corners, "type": "SCALAR" }),
    ];
    let mut attributes = json!({ "POSITION": 0, "NORMAL": 1 });
    if let Some(colours) = colours {
        push(colours.as_flattened().to_vec(), ARRAY);
        accessors.push(json!({
            "bufferView": 3, "componentType": UNSIGNED_BYTE, "normalized": true, "count": n, "type": "VEC4"
        }));
        attributes["COLOR_0"] = json!(3);
    }
    let document = json!({
        "asset": { "version": "2.0", "generator": env!("CARGO_PKG_NAME") },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "garment" }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": 2, "material": 0 }] }],
        "materials": [{ "doubleSided": true, "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 } }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": binary.len() }],
    });
    let mut text = document.to_string().into_bytes();
    // Chunks end at multiples of four; positions, normals, indices and colours do by themselves.
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = Vec::with_capacity(28 + text.len() + binary.len());
    let word = |file: &mut Vec<u8>, value: u32| file.extend(value.to_le_bytes());
    file.extend(b"glTF");
    word(&mut file, 2);
    word(&mut file, (28 + text.len() + binary.len()) as u32);
    for (kind, chunk) in [(JSON_CHUNK, text), (BINARY_CHUNK, binary)] {
        word(&mut file, chunk.len() as u32);
        word(&mut file, kind);
        file.extend(chunk);
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunk_lengths_and_contents_agree_with_the_header() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, -2.0, 3.0)];
        let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        let file = bytes(&mesh, Some(&[[1, 2, 3, 255]; 3]));
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
        let length = word(12);
        assert_eq!((word(16), length % 4), (JSON_CHUNK as usize, 0));
        let document: serde_json::Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
        let binary = &file[28 + length..];
        assert_eq!(word(20 + length), binary.len());
        assert_eq!(word(24 + length), BINARY_CHUNK as usize);
        assert_eq!(document["buffers"][0]["byteLength"], binary.len());
        let end: u64 =
            document["bufferViews"].as_array().unwrap().iter().map(|v| v["byteLength"].as_u64().unwrap()).sum();
        assert_eq!(end as usize, binary.len());
        // y up, the front at +z.
        let third: Vec<f32> =
            (0..3).map(|k| f32::from_le_bytes(binary[24 + 4 * k..28 + 4 * k].try_into().unwrap())).collect();
        assert_eq!(third, [0.0, 3.0, 2.0]);
        assert_eq!(document["accessors"][0]["max"], json!([1.0, 3.0, 2.0]));
        assert_eq!(&binary[84..88], &[1, 2, 3, 255]);
    }
}
