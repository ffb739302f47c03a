//! Writes a mesh as PLY, binary and little-endian: positions in double precision, polygons, and where it has them vertex colours,
//! texture coordinates of the corners (`texcoord`, as MeshLab writes them) and groups, named in comments.

use std::path::Path;

use super::error::MeshError;
use super::exported::write;
use super::source::MeshSource;
use super::topology::NONE;

/// Writes the faces of `source`, with a colour (red, green, blue, opacity) for each of its vertices. `frame` describes the unit and
/// the up axis.
pub(super) fn write_ply(
    path: &Path,
    source: &MeshSource,
    frame: &str,
    colours: Option<&[[u8; 4]]>,
) -> Result<(), MeshError> {
    let all: Vec<u32> = (0..source.faces.len() as u32).collect();
    let (names, group) = source.groups(&all);
    let has_textures = source.corners.iter().any(|corner| corner.texture != NONE);
    let most = source.faces.iter().map(|face| face.count).max().unwrap_or_default();
    // A byte counts the corners, and the two texture coordinates of each, if it can.
    let wide = 2 * most > 255;
    let count = if wide { "uint" } else { "uchar" };
    let mut header = format!("ply\nformat binary_little_endian 1.0\ncomment {} {frame}\n", env!("CARGO_PKG_NAME"));
    header.extend(names.iter().enumerate().map(|(g, name)| format!("comment group {g} {name}\n")));
    header += &format!(
        "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
        source.positions.len()
    );
    if colours.is_some() {
        header.extend(["red", "green", "blue", "alpha"].map(|channel| format!("property uchar {channel}\n")));
    }
    header += &format!("element face {}\nproperty list {count} uint vertex_indices\n", source.faces.len());
    if has_textures {
        header += &format!("property list {count} float texcoord\n");
    }
    if !names.is_empty() {
        header += "property int group\n";
    }
    let mut bytes = (header + "end_header\n").into_bytes();
    for (v, position) in source.positions.iter().enumerate() {
        bytes.extend(position.to_array().into_iter().flat_map(f64::to_le_bytes));
        bytes.extend(colours.iter().flat_map(|colours| colours[v]));
    }
    let length = |bytes: &mut Vec<u8>, count: u32| match wide {
        true => bytes.extend(count.to_le_bytes()),
        false => bytes.push(count as u8),
    };
    for (f, face) in source.faces.iter().enumerate() {
        let corners = source.corners_of(face);
        length(&mut bytes, face.count);
        bytes.extend(corners.iter().flat_map(|corner| corner.vertex.to_le_bytes()));
        if has_textures {
            // A face without texture coordinates has an empty list.
            let textures = || corners.iter().filter_map(|corner| source.textures.get(corner.texture as usize));
            let complete = textures().count() == corners.len();
            length(&mut bytes, if complete { 2 * face.count } else { 0 });
            let numbers = textures().filter(|_| complete).flat_map(|uv| [uv.x as f32, uv.y as f32]);
            bytes.extend(numbers.flat_map(f32::to_le_bytes));
        }
        bytes.extend(group.get(f).iter().flat_map(|group| (**group as i32).to_le_bytes()));
    }
    write(path, bytes)
}
