"""Writes the files that tests/formats reads, with the programs that users have.

    python -m venv venv && venv/bin/pip install trimesh meshio plyfile pygltflib bpy
    venv/bin/python tests/formats/make.py

A body 1.7 m tall, a tapered ellipsoid with a head, and a tube of cloth about it: two groups, texture coordinates. One shape in
every file, so that each can be compared with the others.
"""

import json
import math
import sys
from pathlib import Path

import meshio
import numpy as np
import plyfile
import pygltflib
import trimesh

FILES = Path(__file__).parent / "files"


def body():
    """Vertices in m, z up, and triangles, closed and wound outward."""
    around, rows = 12, 14
    vertices = [[0.0, 0.0, 0.0]]
    for j in range(1, rows):
        z = 1.7 * j / rows
        r = 0.16 if j < 11 else 0.09
        vertices += [
            [r * math.cos(2 * math.pi * i / around), 0.7 * r * math.sin(2 * math.pi * i / around), z] for i in range(around)
        ]
    vertices.append([0.0, 0.0, 1.7])
    top = len(vertices) - 1
    ring = lambda j, i: 1 + (j - 1) * around + i % around
    faces = [[0, ring(1, i + 1), ring(1, i)] for i in range(around)]
    for j in range(1, rows - 1):
        for i in range(around):
            a, b, c, d = ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)
            faces += [[a, b, c], [a, c, d]]
    faces += [[ring(rows - 1, i), ring(rows - 1, i + 1), top] for i in range(around)]
    return np.array(vertices), np.array(faces)


def cloth():
    """A tube about the body: vertices, triangles, the group of each triangle (0 or 1), texture coordinates of each corner, m."""
    around, rows, radius = 16, 5, 0.2
    vertices = [
        [radius * math.cos(2 * math.pi * i / around), radius * math.sin(2 * math.pi * i / around), 0.7 + 0.08 * j]
        for j in range(rows + 1)
        for i in range(around)
    ]
    step = 2 * radius * math.sin(math.pi / around)
    faces, groups, flat = [], [], []
    for j in range(rows):
        for i in range(around):
            a, b = j * around + i, j * around + (i + 1) % around
            c, d = b + around, a + around
            corners = {a: (i, j), b: (i + 1, j), c: (i + 1, j + 1), d: (i, j + 1)}
            for face in ([a, b, c], [a, c, d]):
                faces.append(face)
                groups.append(int(i >= around // 2))
                flat.append([[step * corners[v][0], 0.08 * corners[v][1]] for v in face])
    return np.array(vertices), np.array(faces), np.array(groups), np.array(flat)


def y_up(vertices):
    return np.stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]], axis=1)


def with_trimesh(name, vertices, faces):
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    (FILES / f"{name}-trimesh-binary.ply").write_bytes(trimesh.exchange.ply.export_ply(mesh, encoding="binary"))
    (FILES / f"{name}-trimesh-text.ply").write_bytes(trimesh.exchange.ply.export_ply(mesh, encoding="ascii"))
    (FILES / f"{name}-trimesh-binary.stl").write_bytes(trimesh.exchange.stl.export_stl(mesh))
    (FILES / f"{name}-trimesh-text.stl").write_text(trimesh.exchange.stl.export_stl_ascii(mesh))
    trimesh.Trimesh(y_up(vertices), faces, process=False).export(FILES / f"{name}-trimesh.glb")


def main():
    FILES.mkdir(exist_ok=True)
    vertices, faces = body()
    x, triangles, groups, flat = cloth()
    with_trimesh("body", vertices, faces)
    with_trimesh("cloth", x, triangles)

    # One scene of several meshes, in centimetres although glTF prescribes metres.
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.Trimesh(100 * y_up(vertices), faces, process=False), node_name="avatar", geom_name="avatar")
    scene.add_geometry(trimesh.Trimesh(100 * y_up(x), triangles, process=False), node_name="shirt", geom_name="shirt")
    scene.export(FILES / "scene-trimesh-cm.glb")

    # As people save SMPL's vertices and faces, and SMPL's own model file.
    np.savez(FILES / "body-numpy.npz", v=vertices.astype(np.float32), f=faces.astype(np.uint32))
    np.savez_compressed(
        FILES / "model-numpy.npz",
        v_template=y_up(vertices),
        f=np.asfortranarray(faces.astype(np.int64)),
        shapedirs=np.zeros((len(vertices), 3, 2)),
        kintree_table=np.array([[0, 1], [1, 2]]),
        bs_type=np.array("lrotmin", dtype=object),
    )
    np.savez(FILES / "poses-numpy.npz", poses=np.zeros((4, 156)), betas=np.zeros(16), trans=np.zeros((4, 3)))
    np.savez(FILES / "sequence-numpy.npz", vertices=np.stack([vertices] * 3), faces=faces)
    np.savez(FILES / "vertices-numpy.npz", vertices=vertices)
    np.savez(FILES / "objects-numpy.npz", v=vertices.astype(object), f=faces)

    meshio.Mesh(vertices, [("triangle", faces)]).write(FILES / "body-meshio.ply", binary=True)
    meshio.Mesh(vertices, [("triangle", faces)]).write(FILES / "body-meshio.stl", binary=True)

    # Big-endian, with colours, a property of no known meaning, and texture coordinates of vertices; points without faces.
    table = np.zeros(
        len(x),
        dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("quality", "f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")],
    )
    for axis, name in enumerate("xyz"):
        table[name] = x[:, axis]
    face = np.empty(len(triangles), dtype=[("vertex_index", "i4", (3,)), ("texcoord", "f4", (6,))])
    face["vertex_index"] = triangles
    face["texcoord"] = flat.reshape(-1, 6)
    elements = [plyfile.PlyElement.describe(table, "vertex"), plyfile.PlyElement.describe(face, "face")]
    plyfile.PlyData(elements, byte_order=">").write(str(FILES / "cloth-plyfile-big-endian.ply"))
    plyfile.PlyData(elements[:1], text=True).write(str(FILES / "points-plyfile.ply"))

    embedded()
    blender(vertices, faces, x, triangles, groups, flat)


def embedded():
    """A `.gltf` by pygltflib: data URI, triangle strip, sparse accessor, skin whose joint moves the cloth up by 1 m, mirrored node."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 2, 0]], dtype=np.float32)
    joints = np.zeros((5, 4), dtype=np.uint8)
    weights = np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (5, 1))
    moved = np.array([[0, 0, 5]], dtype=np.float32)
    parts = [corners, joints, weights, np.array([4], dtype=np.uint32), moved]
    blob, views = b"", []
    for part in parts:
        views.append(pygltflib.BufferView(buffer=0, byteOffset=len(blob), byteLength=part.nbytes))
        blob += part.tobytes()
    accessor = pygltflib.Accessor
    gltf = pygltflib.GLTF2(
        scene=0,
        scenes=[pygltflib.Scene(nodes=[0, 1, 2])],
        nodes=[
            pygltflib.Node(name="skinned", mesh=0, skin=0),
            pygltflib.Node(name="joint", translation=[0, 1, 0]),
            pygltflib.Node(name="mirrored", mesh=0, scale=[-1, 1, 1], translation=[0, 0, 3]),
        ],
        skins=[pygltflib.Skin(joints=[1])],
        meshes=[
            pygltflib.Mesh(
                primitives=[
                    pygltflib.Primitive(attributes=pygltflib.Attributes(POSITION=0, JOINTS_0=1, WEIGHTS_0=2), mode=5)
                ]
            )
        ],
        accessors=[
            accessor(
                bufferView=0,
                componentType=5126,
                count=5,
                type="VEC3",
                min=[0, 0, 0],
                max=[2, 2, 5],
                sparse=pygltflib.Sparse(
                    count=1,
                    indices=pygltflib.AccessorSparseIndices(bufferView=3, componentType=5125),
                    values=pygltflib.AccessorSparseValues(bufferView=4),
                ),
            ),
            accessor(bufferView=1, componentType=5121, count=5, type="VEC4"),
            accessor(bufferView=2, componentType=5126, count=5, type="VEC4"),
        ],
        bufferViews=views,
        buffers=[pygltflib.Buffer(byteLength=len(blob))],
    )
    gltf.set_binary_blob(blob)
    gltf.convert_buffers(pygltflib.BufferFormat.DATAURI)
    gltf.save(str(FILES / "embedded-pygltflib.gltf"))


def blender(vertices, faces, x, triangles, groups, flat):
    """Blender's own exporters: two objects, the cloth with two materials and a UV map."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)

    def add(name, points, polygons):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(points.tolist(), [], polygons.tolist())
        thing = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(thing)
        return thing

    avatar, shirt = add("avatar", vertices, faces), add("shirt", x, triangles)
    layer = shirt.data.uv_layers.new(name="flat")
    layer.data.foreach_set("uv", flat.reshape(-1))
    for name in ("front", "back"):
        shirt.data.materials.append(bpy.data.materials.new(name))
    shirt.data.polygons.foreach_set("material_index", groups.tolist())
    shirt.data.update()
    only = lambda thing: [t.select_set(t == thing) for t in (avatar, shirt)]
    bpy.ops.export_scene.gltf(filepath=str(FILES / "scene-blender.glb"), export_format="GLB")
    only(shirt)
    bpy.context.view_layer.objects.active = shirt
    bpy.ops.wm.ply_export(filepath=str(FILES / "cloth-blender.ply"), export_selected_objects=True, export_uv=True)
    bpy.ops.wm.ply_export(
        filepath=str(FILES / "cloth-blender-text.ply"), export_selected_objects=True, ascii_format=True, export_uv=False
    )
    bpy.ops.wm.stl_export(filepath=str(FILES / "cloth-blender.stl"), export_selected_objects=True)
    bpy.ops.wm.stl_export(filepath=str(FILES / "scene-blender-text.stl"), ascii_format=True, use_batch=False)


if __name__ == "__main__":
    sys.exit(main())
