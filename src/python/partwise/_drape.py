"""One drape from keyword arguments."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

from . import _native
from ._native import Drape, Error, Mesh
from ._plain import dumps

Source = Mesh | str | os.PathLike[str]


def quantile(levels: int) -> dict[str, int]:
    """A range table of ``levels`` levels, each with equally many vertices of the garment."""
    return {"quantile": levels}


def drape(
    body: Source | None = None,
    garment: Source | Sequence[Source] | None = None,
    *,
    rest: Source | None = None,
    scene: Mapping[str, Any] | None = None,
    **keywords: Any,
) -> Drape:
    """Drapes a garment over a body.

    ``body`` and ``garment`` are meshes, files, or built-in names (``form``, ``flared-skirt@4000``); several garments are
    layered, inner to outer. The result has the bits of ``partwise`` on the command line.

    Keywords, all optional:

    - ``table``: ``table-3`` (the default), the name of a tuned table, a TOML file, ``quantile(20)``, or rows
      ``[[lower, upper], ...]`` in cm;
    - ``fabric``: a built-in name, a TOML file, or all constants as a dict;
    - ``refine``: Newton steps at full resolution, or ``"converged"`` (the default);
    - ``model`` (``coupled``, ``paper``), ``motion`` (``affine``, ``translation``), ``max_extent_cm``, ``min_part``, ``gap``,
      ``self_contact``, ``measurements`` (of the form, cm);
    - ``rest``: the rest shape, a mesh of the same faces, or ``own``, ``texture``, ``auto``;
    - ``scene``: further keys of the scene, such as ``{"unit": "cm", "up": "y", "hold": "top", "open_body": True}``;
    - ``settings``, ``seed``, ``accuracy`` (``none``, ``canonical``, ``own``), ``spread_starts``: the fields of a job.

    Raises ``partwise.Error`` for unusable input, with the message of the command line, and ``KeyboardInterrupt`` at Ctrl-C.
    """
    scene = dict(scene or {})
    meshes: dict[str, Mesh] = {}

    def name(source: Source, role: str) -> str:
        if not isinstance(source, Mesh):
            if not isinstance(source, str | os.PathLike):
                raise Error(f"{role}: found {type(source).__name__}, expected a partwise.Mesh, a file or a name")
            return os.fspath(source)
        key = str(source.path or f"arrays/{role}")
        meshes[key] = source
        return key

    if body is not None:
        scene["body"] = name(body, "body")
    if garment is not None:
        garments = garment if isinstance(garment, list | tuple) else [garment]
        if not garments:
            raise Error("garment: found an empty list, expected at least one garment")
        roles = ["garment", *(f"garment-{k}" for k in range(2, len(garments) + 1))]
        scene["garment"], *scene["over"] = [name(source, role) for source, role in zip(garments, roles)]
    if rest is not None:
        scene["rest"] = name(rest, "rest")
    table = keywords.get("table")
    if table is not None and not isinstance(table, str | os.PathLike | Mapping):
        keywords["table"] = {"levels": table}
    result = _native.drape(dumps({"scene": scene, **keywords}), meshes)
    for text in result.warnings:
        warnings.warn(text, stacklevel=2)
    return result
