"""Drapes a garment over a body by the two-stage PART model.

    import partwise as pw

    body, shirt = pw.Mesh(vertices, faces), pw.load("shirt.obj")
    drape = pw.drape(body, shirt, fabric="cotton", table=pw.quantile(20), refine=0)
    drape.positions, drape.parts, drape.force, drape.residual
    pw.log(drape)

Results are in metres, kilograms and newtons, z up. Each function runs without the GIL, and Ctrl-C ends it. Errors are
``partwise.Error``.
"""

from ._drape import drape, quantile
from ._log import log
from ._native import Drape, Error, Mesh, __version__, load
from ._sweep import sweep

__all__ = ["Drape", "Error", "Mesh", "__version__", "drape", "load", "log", "quantile", "sweep"]
