"""A drape in a recording of rerun-sdk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._native import Drape

if TYPE_CHECKING:
    from rerun import RecordingStream


def log(drape: Drape, *, prefix: str = "", recording: RecordingStream | None = None) -> None:
    """Logs every stage of a drape into a recording of ``rerun-sdk``, under the entity paths of ``partwise``'s own recordings.

    The caller's recording and times apply: ``rr.set_time("table", sequence=3)`` before it makes the drape step 3 of a timeline.
    ``prefix`` stands before every entity path (``/left``), to show several drapes in one recording. ``recording`` is the stream; by
    default the current one.
    """
    import rerun as rr

    def mesh(path: str, positions: Any, triangles: Any, normals: Any, **colours: Any) -> None:
        shape = rr.Mesh3D(vertex_positions=positions, triangle_indices=triangles, vertex_normals=normals, **colours)
        rr.log(prefix + path, shape, recording=recording)

    garment_normals, draped_normals, body_normals = drape._normals()
    body, body_faces = drape.body
    mesh("/body", body, body_faces, body_normals, albedo_factor=[118, 109, 103])
    undraped = (drape.undraped, drape.faces, garment_normals)
    mesh("/garment", *undraped, albedo_factor=[196, 202, 210])
    mesh("/distance/garment", *undraped, vertex_colors=drape.colours("distance"))
    (positions, triangles), normals, owner = drape._cells()
    for stage in ["parts", "force"]:
        mesh(f"/{stage}/garment", positions, triangles, normals, vertex_colors=drape.colours(stage)[owner])
    draped = (drape.positions, drape.faces, draped_normals)
    mesh("/drape/garment", *draped, albedo_factor=[118, 176, 228])
    for name, values in [("strain", drape.strain), ("pressure", drape.pressure)]:
        if values is not None:
            mesh(f"/fit/{name}/garment", *draped, vertex_colors=drape.colours(name))
    numbers = {"part_count": float(len(drape.force)), "ms/total": drape.times_ms["total"]}
    if drape.residual is not None:
        numbers["residual_over_weight"] = drape.residual
    for name, value in numbers.items():
        rr.log(f"{prefix}/numbers/{name}", rr.Scalars(value), recording=recording)
