//! glTF 2.0 (Khronos Group, 2021), `.glb` and `.gltf`: the triangles of the default scene as it shows them.
//!
//! Each node with a mesh is an object; a mesh of several primitives has their materials as groups. A vertex v of a mesh is placed
//! by its node's matrix M, or by the skin of the node, in the pose that the joints have in the file:
//!
//! ```text
//! v' = v + Σᵢ wᵢ tᵢ           morph targets t with the weights w of the file (section 3.7.2.2)
//! x  = M v'                   or
//! x  = Σⱼ wⱼ Gⱼ Bⱼ v'         joint matrices G, inverse bind matrices B (section 3.7.3.3)
//! ```
//!
//! Vertices that differ in normal or texture coordinate alone become one vertex. Texture coordinates count from below, as in other
//! formats. Buffers are in the file or in `data:` URIs; no other URI is opened.
//!
//! Limits: compressed meshes (Draco, meshopt) are refused; animations are passed over. The document is read by `serde_json`, which
//! limits its depth; the nodes are walked without recursion.

mod accessor;
mod document;

use std::path::Path;

use glam::{DMat4, DQuat, DVec2, DVec3, DVec4};

use super::obj::excerpt;
use crate::mesh::error::MeshError;
use crate::mesh::frame::Declared;
use crate::mesh::source::{Corner, MeshSource};
use crate::mesh::topology::NONE;
use crate::mesh::{Axis, Unit};
use accessor::{Buffers, missing};
use document::{Document, Mesh, Node, Primitive};

/// Extensions that a file may require although they are not read: they change how a surface looks, not its shape. Integers as
/// positions are read.
const HARMLESS: [&str; 5] =
    ["KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_punctual"];

/// Modes of primitives whose corners are triangles.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Reads a glTF file.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<MeshSource, MeshError> {
    read(file, bytes).map_err(|problem| MeshError::broken(file, problem))
}

fn read(file: &Path, bytes: &[u8]) -> Result<MeshSource, String> {
    let (text, binary) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
    let document: Document = serde_json::from_slice(text)
        .map_err(|e| format!("the JSON is invalid: {e}; expected glTF 2.0, export it again"))?;
    if document.asset.version.split('.').next() != Some("2") {
        let found = excerpt(&document.asset.version);
        return Err(format!("found glTF of version \"{found}\", expected 2.0; export it again"));
    }
    let is_known = |extension: &&String| HARMLESS.iter().any(|known| extension.starts_with(known));
    if let Some(extension) = document.extensions_required.iter().find(|extension| !is_known(extension)) {
        let found = excerpt(extension);
        return Err(format!("the file requires the extension {found}, expected none; export it without compression"));
    }
    let mut source = MeshSource::of(file);
    source.declared = Some(Declared { format: "glTF", unit: Unit::M, up: Axis::Y });
    let loader = Loader {
        buffers: Buffers::new(&document, bytes.len(), binary),
        placed: placed(&document.nodes)?,
        document: &document,
    };
    let is_drawn = loader.drawn()?;
    for number in (0..document.nodes.len()).filter(|&number| is_drawn[number]) {
        loader.draw(&mut source, number).map_err(|problem| format!("node {number}: {problem}"))?;
    }
    source.state_groups();
    Ok(source)
}

/// The JSON and the binary chunk of a `.glb` (section 4.4).
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let chunk = |at: usize, kind: &[u8]| {
        let length = word(at).filter(|_| bytes.get(at + 4..at + 8) == Some(kind))? as usize;
        Some((length, bytes.get(at + 8..)?.get(..length)))
    };
    let cut = "the file ends within a chunk, expected the length in its header; it is cut off";
    match chunk(12, b"JSON") {
        Some((length, Some(text))) => match chunk(20 + length, b"BIN\0") {
            Some((_, None)) => Err(cut.to_owned()),
            binary => Ok((text, binary.and_then(|(_, bytes)| bytes))),
        },
        Some((_, None)) => Err(cut.to_owned()),
        None => Err("found a binary glTF without a JSON chunk, expected glTF 2.0; export it again".to_owned()),
    }
}

/// The matrix of each node in the scene; `None` of nodes that are their own ancestors.
fn placed(nodes: &[Node]) -> Result<Vec<Option<DMat4>>, String> {
    let mut has_parent = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(|node| &node.children) {
        let slot = has_parent.get_mut(*child).ok_or_else(|| missing("nodes", nodes.len()))?;
        if std::mem::replace(slot, true) {
            return Err(format!("node {child}: found two parents, expected one"));
        }
    }
    let mut placed = vec![None; nodes.len()];
    let mut open: Vec<(usize, DMat4)> =
        (0..nodes.len()).filter(|&n| !has_parent[n]).map(|n| (n, DMat4::IDENTITY)).collect();
    while let Some((number, parent)) = open.pop() {
        let node = &nodes[number];
        let own = node.matrix.map_or_else(
            || {
                let scale = DVec3::from_array(node.scale.unwrap_or([1.0; 3]));
                let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
                let translation = DVec3::from_array(node.translation.unwrap_or_default());
                DMat4::from_scale_rotation_translation(scale, rotation, translation)
            },
            |matrix| DMat4::from_cols_array(&matrix),
        );
        let matrix = parent * own;
        placed[number] = Some(matrix);
        open.extend(node.children.iter().map(|&child| (child, matrix)));
    }
    Ok(placed)
}

struct Loader<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    placed: Vec<Option<DMat4>>,
}

impl Loader<'_> {
    /// Whether each node is in the default scene; all are, in a file without scenes.
    fn drawn(&self) -> Result<Vec<bool>, String> {
        let Document { scene, scenes, nodes, .. } = self.document;
        let Some(scene) = scenes.get(scene.unwrap_or(0)) else {
            return if scenes.is_empty() { Ok(vec![true; nodes.len()]) } else { Err(missing("scenes", scenes.len())) };
        };
        let mut drawn = vec![false; nodes.len()];
        let mut open = scene.nodes.clone();
        while let Some(node) = open.pop() {
            let slot = drawn.get_mut(node).ok_or_else(|| missing("nodes", nodes.len()))?;
            if !std::mem::replace(slot, true) {
                open.extend(&nodes[node].children);
            }
        }
        Ok(drawn)
    }

    /// Adds the mesh of a node.
    fn draw(&self, source: &mut MeshSource, number: usize) -> Result<(), String> {
        let Document { nodes, meshes, materials, .. } = self.document;
        let node = &nodes[number];
        let Some(index) = node.mesh else { return Ok(()) };
        let mesh = meshes.get(index).ok_or_else(|| missing("meshes", meshes.len()))?;
        let matrix = self.placed[number].ok_or("found it among its own ancestors, expected a tree of nodes")?;
        let name = node.name.as_ref().or(mesh.name.as_ref()).filter(|name| !name.trim().is_empty());
        let object = source.name(name.map_or(&format!("mesh {index}"), |name| name));
        let (first, corner) = (source.positions.len(), source.corners.len());
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let material = primitive.material.and_then(|m| materials.get(m)).and_then(|m| m.name.as_ref());
            let group = match material.filter(|name| !name.trim().is_empty()) {
                _ if mesh.primitives.len() == 1 => object,
                Some(material) => source.name(material),
                None => source.name(&format!("primitive {k}")),
            };
            let at = |problem| format!("mesh {index}, primitive {k}: {problem}");
            let placed = self.positions(node, mesh, primitive, matrix).map_err(at)?;
            self.primitive(source, primitive, &placed, matrix.determinant() < 0.0, [group, object]).map_err(at)?;
        }
        source.merge_equal(first, corner);
        Ok(())
    }

    /// Positions of the vertices of a primitive in the scene.
    fn positions(&self, node: &Node, mesh: &Mesh, of: &Primitive, matrix: DMat4) -> Result<Vec<DVec3>, String> {
        let vector = |index| Ok::<_, String>(self.buffers.read::<3>(index, "VEC3")?.into_iter().map(DVec3::from_array));
        let position = of.attributes.get("POSITION").ok_or("found no POSITION, expected one")?;
        let mut positions: Vec<DVec3> = vector(*position)?.collect();
        let weights = node.weights.as_ref().unwrap_or(&mesh.weights);
        for (target, &weight) in of.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            if let Some(&target) = target.get("POSITION") {
                positions.iter_mut().zip(vector(target)?).for_each(|(p, moved)| *p += weight * moved);
            }
        }
        let skin = (node.skin, of.attributes.get("JOINTS_0"), of.attributes.get("WEIGHTS_0"));
        let (Some(skin), Some(&joints), Some(&weights)) = skin else {
            return Ok(positions.into_iter().map(|p| matrix.transform_point3(p)).collect());
        };
        let matrices = self.skin(skin)?;
        let influences =
            self.buffers.read::<4>(joints, "VEC4")?.into_iter().zip(self.buffers.read::<4>(weights, "VEC4")?);
        let mut posed = Vec::with_capacity(positions.len());
        for (p, (joints, weights)) in positions.into_iter().zip(influences) {
            let mut x = DVec4::ZERO;
            for (&joint, &weight) in joints.iter().zip(&weights).filter(|(_, weight)| **weight != 0.0) {
                let joint = matrices.get(joint as usize).ok_or_else(|| missing("joints", matrices.len()))?;
                x += weight * (*joint * p.extend(1.0));
            }
            // Weights need not add up to 1 exactly.
            posed.push(if x.w == 0.0 { matrix.transform_point3(p) } else { x.truncate() / x.w });
        }
        Ok(posed)
    }

    /// G B of each joint of a skin.
    fn skin(&self, index: usize) -> Result<Vec<DMat4>, String> {
        let skins = &self.document.skins;
        let skin = skins.get(index).ok_or_else(|| missing("skins", skins.len()))?;
        let mut matrices = Vec::with_capacity(skin.joints.len());
        for &joint in &skin.joints {
            let placed = self.placed.get(joint).copied().flatten();
            matrices.push(placed.ok_or_else(|| missing("nodes", self.placed.len()))?);
        }
        if let Some(inverse) = skin.inverse_bind_matrices {
            let inverse = self.buffers.read::<16>(inverse, "MAT4")?;
            matrices.iter_mut().zip(&inverse).for_each(|(m, inverse)| *m *= DMat4::from_cols_array(inverse));
        }
        Ok(matrices)
    }

    /// Adds the triangles of a primitive, turned round if its node mirrors them.
    fn primitive(
        &self,
        source: &mut MeshSource,
        of: &Primitive,
        positions: &[DVec3],
        mirrored: bool,
        [group, object]: [u32; 2],
    ) -> Result<(), String> {
        let (first, first_texture) = (source.positions.len() as u32, source.textures.len() as u32);
        positions.iter().try_for_each(|&p| source.push_position(p))?;
        let mut textures = 0;
        if let Some(&texture) = of.attributes.get("TEXCOORD_0") {
            let coordinates = self.buffers.read::<2>(texture, "VEC2")?;
            textures = coordinates.len() as u32;
            coordinates.iter().try_for_each(|&[u, v]| source.push_texture(DVec2::new(u, 1.0 - v)))?;
        }
        let count = positions.len() as u32;
        let indices: Vec<u32> = match of.indices {
            None => (0..count).collect(),
            Some(indices) => self.buffers.read::<1>(indices, "SCALAR")?.into_iter().map(|[i]| i as u32).collect(),
        };
        if let Some(found) = indices.iter().find(|&&i| i >= count) {
            return Err(format!("found vertex {found}, expected one below {count}, their number"));
        }
        let corner =
            |i: u32| Corner { vertex: first + i, texture: if i < textures { first_texture + i } else { NONE } };
        let mut push = |[a, b, c]: [u32; 3], turned: bool| {
            let corners = if turned { [a, c, b] } else { [a, b, c] };
            source.push_face(corners.map(corner), group, object);
        };
        match of.mode.unwrap_or(TRIANGLES) {
            TRIANGLES => indices.as_chunks().0.iter().for_each(|&triangle| push(triangle, mirrored)),
            STRIP => {
                let triangles = indices.windows(3).enumerate();
                triangles.for_each(|(k, w)| push([w[0], w[1], w[2]], mirrored ^ (k % 2 == 1)));
            }
            FAN => indices.windows(2).skip(1).for_each(|w| push([indices[0], w[0], w[1]], mirrored)),
            _ => source.small_faces += indices.len(),
        }
        Ok(())
    }
}
