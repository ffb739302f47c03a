"""Fixtures: meshes as files and as arrays, and the program to compare with. `PARTWISE` is its path."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import partwise as pw
import pytest


@pytest.fixture(scope="session", autouse=True)
def caches() -> Iterator[None]:
    """Caches of meshes and references that no other run has, for workers too."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        yield


@pytest.fixture(scope="session")
def program() -> str:
    path = os.environ.get("PARTWISE", str(Path(__file__).parents[2] / "target" / "debug" / "partwise"))
    if not Path(path).exists():
        pytest.skip("PARTWISE names no program to compare with")
    return path


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """The dress form and a skirt about it as OBJ files."""
    folder = tmp_path_factory.mktemp("meshes")
    drape = pw.drape("form", "flared-skirt@600", refine=0)
    for name, (vertices, faces) in [("body", drape.body), ("garment", (drape.undraped, drape.faces))]:
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces.tolist()]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    return str(folder / "body.obj"), str(folder / "garment.obj")


@pytest.fixture(scope="session")
def meshes(files: tuple[str, str]) -> tuple[pw.Mesh, pw.Mesh]:
    """The same in memory."""
    body, garment = (pw.load(file) for file in files)
    return pw.Mesh(body.vertices, body.faces), pw.Mesh(garment.vertices, garment.faces)


def run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout
