"""Drapes: arrays in and out, bits of the command line, errors, interrupts, threads, memory."""

from __future__ import annotations

import inspect
import json
import os
import re
import resource
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import partwise as pw
import pytest
from conftest import run

Meshes = tuple[pw.Mesh, pw.Mesh]


def test_the_example_of_the_readme(meshes: Meshes) -> None:
    body, skirt = meshes
    drape = pw.drape(body, skirt, fabric="cotton", table=pw.quantile(20), refine=0, scene={"hold": "top"})
    vertices, parts = len(drape.positions), len(drape.force)
    assert drape.positions.shape == (vertices, 3) and drape.positions.dtype == np.float64
    assert drape.parts.shape == drape.distance.shape == (vertices,)
    assert drape.parts.max() + 1 == parts == len(drape.displacement) == len(drape.contact) == len(drape.levels)
    assert drape.faces.max() < vertices and drape.residual is not None
    assert drape.positions is drape.positions and not drape.positions.flags.writeable
    assert drape.metrics["part_count"] == parts
    assert np.isfinite(drape.positions).all() and drape.times_ms["total"] > 0.0
    assert drape.job["settings"]["fabric"]["name"] == "cotton"


def test_the_bits_are_those_of_the_command_line(program: str, files: tuple[str, str], meshes: Meshes, tmp_path: Path) -> None:
    body, skirt = files
    command = ["--body", body, "--garment", skirt, "--fabric", "cotton", "--refine", "3", "--hold", "top", "--no-save"]
    run(program, *command, "--export", str(tmp_path / "cli.obj"))
    keywords: dict[str, Any] = {"fabric": "cotton", "refine": 3, "scene": {"hold": "top"}}
    exported = pw.load(tmp_path / "cli.obj").vertices
    for given in [meshes, files, (Path(body), pw.load(skirt))]:
        drape = pw.drape(*given, **keywords)
        assert drape.vertices.tobytes() == exported.tobytes()
    drape.export(tmp_path / "python.obj")
    assert (tmp_path / "python.obj").read_bytes() == (tmp_path / "cli.obj").read_bytes()
    assert pw.drape(**drape.job).result_hash == drape.result_hash


def test_float32_lists_and_strided_arrays_are_the_same_mesh(meshes: Meshes) -> None:
    skirt = meshes[1]
    wide = np.zeros((len(skirt.vertices), 6))
    wide[:, ::2] = skirt.vertices
    for vertices, faces in [
        (wide[:, ::2], skirt.faces.astype(np.int16)),
        (skirt.vertices.tolist(), skirt.faces.tolist()),
        (np.asfortranarray(skirt.vertices), np.asfortranarray(skirt.faces.astype(np.uint64))),
    ]:
        again = pw.Mesh(vertices, faces)
        assert again.vertices.tobytes() == skirt.vertices.tobytes() and (again.faces == skirt.faces).all()
    single = skirt.vertices.astype(np.float32)
    assert (pw.Mesh(single, skirt.faces).vertices == single).all()


def test_the_vertices_of_a_drape_have_the_order_and_unit_of_the_input(meshes: Meshes) -> None:
    body, skirt = meshes
    in_cm = [pw.Mesh(100.0 * np.vstack([mesh.vertices, [[0.0, 0.0, 3.0]]]), mesh.faces) for mesh in meshes]
    drape, metres = pw.drape(*in_cm, refine=0), pw.drape(body, skirt, refine=0)
    assert drape.vertices.shape == (len(skirt.vertices) + 1, 3)
    assert abs(drape.vertices[:-1] - 100.0 * metres.positions).max() < 1.0
    assert (drape.vertices[-1] == [0.0, 0.0, 300.0]).all()


TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.parametrize(
    ("vertices", "faces", "found"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], "vertices: found the shape (3, 2), expected (number of vertices, 3)"),
        (np.zeros(9), [[0, 1, 2]], "vertices: found the shape (9,), expected"),
        (TRIANGLE.astype(int), [[0, 1, 2]], "vertices: found the dtype int64, expected float64 or float32"),
        (TRIANGLE.astype(complex), [[0, 1, 2]], "vertices: found the dtype complex128"),
        (np.array([["a"] * 3] * 3), [[0, 1, 2]], "vertices: found the dtype <U1"),
        (TRIANGLE, [[0.0, 1.0, 2.0]], "faces: found the dtype float64, expected integers"),
        (TRIANGLE, [[True, False, True]], "faces: found the dtype bool, expected integers"),
        (TRIANGLE, [[0, 1]], "faces: found the shape (1, 2), expected (number of faces, 3)"),
        (TRIANGLE, [[0, 1, 3]], "faces[0, 2]: found 3, expected 0 to 2, the vertices of the mesh"),
        (TRIANGLE, [[0, -1, 2]], "faces[0, 1]: found -1, expected 0 to 2"),
        (np.where(TRIANGLE > 0, np.nan, TRIANGLE), [[0, 1, 2]], "vertices[1, 0]: found NaN, expected a finite number"),
        (np.where(TRIANGLE > 0, np.inf, TRIANGLE), [[0, 1, 2]], "vertices[1, 0]: found inf, expected a finite number"),
        (np.zeros((0, 3)), [[0, 1, 2]], "faces[0, 0]: found 0, expected no index, as the mesh has no vertices"),
        (None, [[0, 1, 2]], "vertices: found the dtype object"),
    ],
)
def test_unusable_arrays_are_refused(vertices: Any, faces: Any, found: str) -> None:
    with pytest.raises(pw.Error, match=re.escape(found)):
        pw.Mesh(vertices, faces)


def test_the_messages_are_those_of_the_command_line(program: str, meshes: Meshes, files: tuple[str, str], tmp_path: Path) -> None:
    body, skirt = meshes
    with pytest.raises(pw.Error, match="arrays/body: the body is not closed: 3 boundary edges in 1 loops"):
        pw.drape(pw.Mesh(body.vertices, body.faces[1:]), skirt)
    with pytest.raises(pw.Error, match="the mesh is empty"):
        pw.drape(body, pw.Mesh(TRIANGLE, np.zeros((0, 3), int)))
    with pytest.raises(pw.Error, match="unknown field `fabrik`, did you mean `fabric`\\?"):
        pw.drape(body, skirt, fabrik="cotton")
    with pytest.raises(pw.Error, match="or a field of a job: scene, settings, seed, accuracy, spread_starts"):
        pw.drape(body, skirt, zzz=1)
    with pytest.raises(pw.Error, match="unknown field `colour`"):
        pw.drape(body, skirt, scene={"colour": 3})
    with pytest.raises(pw.Error, match="unknown field `min`"):
        pw.drape(body, skirt, settings={"min": 3})
    with pytest.raises(pw.Error, match="expected finite extents|max_extent_cm"):
        pw.drape(body, skirt, max_extent_cm=[6, 12])
    with pytest.raises(pw.Error, match="body: found int, expected a partwise.Mesh, a file or a name"):
        pw.drape(3, skirt)  # type: ignore[arg-type]
    with pytest.raises(pw.Error, match="expected plain data"):
        pw.drape(body, skirt, fabric=object())
    missing = str(tmp_path / "none.obj")
    for keywords, flags in [
        ({"fabric": "coton"}, ["--fabric", "coton"]),
        ({"garment": missing}, ["--garment", missing]),
        ({"garment": "flared-skrt"}, ["--garment", "flared-skrt"]),
        ({"fabric": missing}, ["--fabric", missing]),
    ]:
        with pytest.raises(pw.Error) as caught:
            pw.drape(**keywords)
        with pytest.raises(Exception) as failed:
            run(program, *flags, "--no-save")
        assert str(caught.value) in failed.value.stderr.replace("\n  ", " "), failed.value.stderr


def test_a_panic_is_an_exception() -> None:
    from partwise import _native

    with pytest.raises(pw.Error, match="the computation panicked: as requested"):
        _native.panics()


def test_ctrl_c_ends_a_drape() -> None:
    # A shell without job control starts background processes with SIGINT ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    began = threading.Event()

    def interrupt() -> None:
        began.wait()
        threading.Event().wait(1.0)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        began.set()
        # Some ten seconds where it is not interrupted.
        pw.drape("form", "low-cut-dress@20000", fabric="denim")
    thread.join()
    assert len(pw.drape(garment="flared-skirt@400", refine=0).positions) > 300


def test_four_threads_give_the_bits_of_one() -> None:
    def hash_of(fabric: str) -> str:
        return pw.drape(garment="flared-skirt@400", fabric=fabric, refine=2).result_hash

    fabrics = ["cotton", "denim", "silk", "interlock"]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(hash_of, 4 * fabrics))
    assert together == 4 * [hash_of(fabric) for fabric in fabrics]


def test_other_python_threads_run_during_a_drape() -> None:
    turns = 0
    stop = threading.Event()

    def count() -> None:
        nonlocal turns
        while not stop.wait(0.001):
            turns += 1

    thread = threading.Thread(target=count)
    thread.start()
    before = turns
    pw.drape(garment="low-cut-dress@1500")
    assert turns > before
    stop.set()
    thread.join()


def test_a_thousand_drapes_leak_nothing(meshes: Meshes) -> None:
    body, skirt = meshes

    def drapes(count: int) -> int:
        for _ in range(count):
            drape = pw.drape(body, skirt, table=pw.quantile(3), refine=0)
            assert drape.positions.shape[1] == drape.force.shape[1] == 3 and drape.job
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    warm = drapes(100)
    grown = drapes(900) - warm
    # A drape of 600 vertices holds some 2 MB, the body included: a leak of each would be more than a GB.
    assert grown < 50_000, f"{grown} kB"


def test_the_stubs_have_the_members_of_the_module() -> None:
    from partwise import _native

    text = (Path(pw.__file__).parent / "_native.pyi").read_text()
    for kind in [_native.Mesh, _native.Drape, _native.Plan, _native.Store]:
        stub = text.split(f"class {kind.__name__}")[1].split("\n@final")[0]
        members = {name for name in vars(kind) if not name.startswith("__")}
        assert members == set(re.findall(r"^    def ((?!__)\w+)\(", stub, re.M))
    assert inspect.getdoc(pw.drape)
    json.dumps(pw.drape(garment="flared-skirt@400", refine=0).job)
