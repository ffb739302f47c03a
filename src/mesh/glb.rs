//! Writes meshes as binary glTF (`.glb`) for viewers and try-on programs.
//!
//! Metres, y up, the body's front at +z, counter-clockwise from outside, as glTF 2.0 requires (Khronos Group, 2021, sections
//! 3.4 and 4.4). Positions, vertex normals and texture coordinates are in single precision, optional colours in eight bits. A
//! vertex with several texture coordinates is stored once for each. Each group is a primitive with a material of its name, and
//! materials are double-sided. Texture coordinates count from above, so v of the mesh is written as 1 − v.

use std::path::Path;

use glam::{DVec2, DVec3};
use indexmap::IndexSet;
use serde_json::{Value, json};

use super::error::MeshError;
use super::exported::{Export, write};
use super::{TriMesh, box_about};

/// Codes of the format for chunk types, component types and buffer targets.
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BINARY_CHUNK: u32 = 0x004E_4942;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_BYTE: u32 = 5121;
const ARRAY: u32 = 34962;
const ELEMENTS: u32 = 34963;

/// Writes a mesh as `.glb`, and the body beside it.
pub(super) fn write_glb(path: &Path, export: &Export<'_>) -> Result<(), MeshError> {
    write(path, bytes(export))
}

#[derive(Default)]
struct Builder {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
}

impl Builder {
    /// Adds numbers of four bytes each, as an accessor with these properties; returns its index.
    fn push(&mut self, numbers: impl IntoIterator<Item = [u8; 4]>, target: u32, mut accessor: Value) -> usize {
        let offset = self.binary.len();
        self.binary.extend(numbers.into_iter().flatten());
        let length = self.binary.len() - offset;
        accessor["bufferView"] = json!(self.views.len());
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "target": target }));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn material(&mut self, name: &str) -> usize {
        let surface = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.9 });
        self.materials.push(json!({ "name": name, "doubleSided": true, "pbrMetallicRoughness": surface }));
        self.materials.len() - 1
    }

    /// Adds a mesh and its materials.
    fn mesh(
        &mut self,
        name: &str,
        mesh: &TriMesh,
        texture: Option<&[[DVec2; 3]]>,
        colours: Option<&[[u8; 4]]>,
    ) -> Value {
        // A vertex of the file for each vertex of the mesh and each texture coordinate that it has, in the order of the mesh.
        let single = |uv: DVec2| [uv.x as f32, 1.0 - uv.y as f32].map(f32::to_bits);
        let corner = |(k, &v): (usize, &u32)| (v, texture.map(|texture| single(texture[k / 3][k % 3])));
        let corners = mesh.triangles.as_flattened().iter().enumerate().map(corner);
        let mut vertices: IndexSet<(u32, Option<[u32; 2]>)> = corners.clone().collect();
        if texture.is_none() {
            vertices = (0..mesh.vertex_count() as u32).map(|v| (v, None)).collect();
        }
        vertices.sort_unstable();
        let upright = |p: DVec3| [p.x as f32, p.z as f32, -p.y as f32];
        let normals = mesh.vertex_normals();
        let of_vertices = |list: &[DVec3]| -> Vec<[u8; 4]> {
            vertices.iter().flat_map(|(v, _)| upright(list[*v as usize])).map(f32::to_le_bytes).collect()
        };
        let (places, normals) = (of_vertices(&mesh.positions), of_vertices(&normals));
        let (low, high) = box_about(vertices.iter().map(|(v, _)| mesh.positions[*v as usize]));
        let [low, high] = [DVec3::new(low.x, high.y, low.z), DVec3::new(high.x, low.y, high.z)].map(upright);
        let n = vertices.len();
        let vectors = json!({ "componentType": FLOAT, "count": n, "type": "VEC3", "min": low, "max": high });
        let mut attributes = json!({ "POSITION": self.push(places, ARRAY, vectors) });
        let vectors = json!({ "componentType": FLOAT, "count": n, "type": "VEC3" });
        attributes["NORMAL"] = json!(self.push(normals, ARRAY, vectors));
        if texture.is_some() {
            let numbers = vertices.iter().flat_map(|(_, uv)| uv.unwrap_or_default().map(u32::to_le_bytes));
            let accessor = json!({ "componentType": FLOAT, "count": n, "type": "VEC2" });
            attributes["TEXCOORD_0"] = json!(self.push(numbers, ARRAY, accessor));
        }
        if let Some(colours) = colours {
            let accessor = json!({ "componentType": UNSIGNED_BYTE, "normalized": true, "count": n, "type": "VEC4" });
            let numbers = vertices.iter().map(|(v, _)| colours[*v as usize]);
            attributes["COLOR_0"] = json!(self.push(numbers, ARRAY, accessor));
        }
        let indices: Vec<u32> = corners.filter_map(|c| vertices.get_index_of(&c)).map(|i| i as u32).collect();
        let groups = if mesh.groups.is_empty() { vec![name] } else { mesh.groups.iter().map(String::as_str).collect() };
        let mut primitives = Vec::new();
        for (g, group) in groups.into_iter().enumerate() {
            let of_group = |t: usize| mesh.triangle_group.get(t).is_none_or(|&group| group as usize == g);
            let triangles = indices.as_chunks::<3>().0.iter().enumerate().filter(|(t, _)| of_group(*t));
            let indices: Vec<u32> = triangles.flat_map(|(_, triangle)| *triangle).collect();
            if indices.is_empty() {
                continue;
            }
            let accessor = json!({ "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR" });
            let indices = self.push(indices.into_iter().map(u32::to_le_bytes), ELEMENTS, accessor);
            let material = self.material(group);
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": material }));
        }
        json!({ "name": name, "primitives": primitives })
    }
}

fn bytes(export: &Export<'_>) -> Vec<u8> {
    let mut builder = Builder::default();
    let mut meshes = vec![builder.mesh("garment", export.mesh, export.texture, export.colours)];
    meshes.extend(export.body.map(|body| builder.mesh("body", body, None, None)));
    let names = ["garment", "body"].iter().take(meshes.len()).enumerate();
    let nodes: Vec<Value> = names.map(|(mesh, name)| json!({ "mesh": mesh, "name": name })).collect();
    let Builder { binary, views, accessors, materials } = builder;
    let document = json!({
        "asset": { "version": "2.0", "generator": env!("CARGO_PKG_NAME") },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": binary.len() }],
    });
    let mut text = document.to_string().into_bytes();
    // Chunks end at multiples of four; the numbers do by themselves.
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
        let colours = Some(&[[1, 2, 3, 255]; 3][..]);
        let file = bytes(&Export { mesh: &mesh, imported: None, texture: None, colours, body: None });
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
        let length = word(12);
        assert_eq!((word(16), length % 4), (JSON_CHUNK as usize, 0));
        let document: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
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
        assert_eq!(document["accessors"][0]["min"], json!([0.0, 0.0, 0.0]));
        assert_eq!(&binary[72..76], &[1, 2, 3, 255]);
    }
}
