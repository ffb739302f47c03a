"""Python values as JSON."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._native import Error


def plain(value: Any, place: str) -> Any:
    """``value`` as JSON has it: NumPy's numbers and arrays, tuples and paths included. Infinity is the string ``inf``."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        if value == math.inf:
            return "inf"
        raise Error(f"{place}: found {value}, expected a number, or inf for the open end of a range table")
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {str(key): plain(entry, f"{place}.{key}") for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry, f"{place}[{k}]") for k, entry in enumerate(value)]
    raise Error(f"{place}: found {type(value).__name__}, expected plain data: numbers, text, lists and dicts")


def dumps(values: Mapping[str, Any]) -> str:
    """A mapping as JSON."""
    return json.dumps({key: plain(value, key) for key, value in values.items()})
