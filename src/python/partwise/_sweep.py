"""Sweeps over any executor of ``concurrent.futures``."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from typing import TYPE_CHECKING, Any

from ._native import Error, Plan, Store, run_point
from ._plain import dumps

if TYPE_CHECKING:
    from pandas import DataFrame

ATTEMPTS = 3
"""Losses of a worker after which a point is given up, and of an executor without a row in between. A heuristic."""


class _Rows:
    """The rows of a sweep: in a folder, or in memory."""

    def __init__(self, plan: Plan, folder: str | os.PathLike[str] | None, on_row: Callable[[dict[str, Any]], None] | None) -> None:
        self.plan = plan
        self.folder = folder
        self.on_row = on_row
        self.store = None if folder is None else Store(plan, folder)
        kept = [] if self.store is None else [json.loads(row) for row in self.store.rows()]
        self.by_point: dict[int, dict[str, Any]] = {row["index"]: row for row in kept}

    def add(self, text: str) -> None:
        if self.store is not None:
            self.store.append(text)
        row = json.loads(text)
        self.by_point[row["index"]] = row
        if self.on_row is not None:
            self.on_row(row)

    def missing(self) -> list[int]:
        return [index for index in range(len(self.plan)) if index not in self.by_point]

    def frame(self) -> DataFrame:
        import pandas as pd

        rows = [self.by_point[index] for index in sorted(self.by_point)]
        return pd.DataFrame(rows, columns=self.plan.columns)


def sweep(
    spec: str | os.PathLike[str] | Mapping[str, Any],
    executor: Executor | Callable[[], Executor] | None = None,
    *,
    resume: str | os.PathLike[str] | None = None,
    accuracy: str = "own",
    on_row: Callable[[dict[str, Any]], None] | None = None,
) -> DataFrame:
    """Runs every point of a sweep and returns the rows as a frame, in the order of the plan.

    ``spec`` is a sweep file, or its contents as a dict. ``executor`` is any executor of ``concurrent.futures``: a process pool,
    Dask's ``client.get_executor()``, ``mpi4py.futures.MPIPoolExecutor()``; or a function that makes one. Without it, the points run
    here, one after the other. Workers need the package and the files that the sweep names.

    ``resume`` is a folder: every row is on disk there before the next is awaited, points with a row are not computed again, and
    failed ones are. It is the folder of ``partwise sweep --out``. ``accuracy`` is the reference of points that specify none.
    ``on_row`` is called with each new row.

    A point that fails is a row with its error. A point whose worker is lost runs again, three times at most. A broken executor (a
    process pool that lost a process) is replaced where ``executor`` is a function; otherwise ``partwise.Error`` is raised.
    ``Error`` and ``KeyboardInterrupt`` leave the finished rows in ``resume``.
    """
    if isinstance(spec, Mapping):
        plan = Plan(None, dumps(spec), accuracy)
    else:
        # Workers may have another working directory.
        plan = Plan(os.path.abspath(spec), None, accuracy)
    for note in plan.notes:
        warnings.warn(note, stacklevel=2)
    rows = _Rows(plan, resume, on_row)
    try:
        if executor is None:
            for index in rows.missing():
                rows.add(run_point(plan.point(index), plan.passes))
        elif isinstance(executor, Executor):
            _run(plan, rows, executor)
        else:
            _replacing(plan, rows, executor)
    finally:
        if rows.store is not None:
            rows.store.finish()
    return rows.frame()


def _replacing(plan: Plan, rows: _Rows, make: Callable[[], Executor]) -> None:
    """Runs the missing points, and those that a broken executor lost on a new one."""
    without_rows = 0
    while before := len(rows.missing()):
        with make() as executor:
            try:
                _run(plan, rows, executor)
            except _Broken as error:
                without_rows = without_rows + 1 if len(rows.missing()) == before else 0
                if without_rows == ATTEMPTS:
                    raise Error(f"the executor broke {ATTEMPTS} times in a row without a finished row: {error}") from error


class _Broken(Error):
    """The executor accepts no more points."""


def _run(plan: Plan, rows: _Rows, executor: Executor) -> None:
    """Runs the missing points on an executor."""
    attempts: dict[int, int] = {}
    running: dict[Future[str], int] = {}

    def submit(index: int) -> None:
        try:
            running[executor.submit(run_point, plan.point(index), plan.passes)] = index
        except (BrokenExecutor, RuntimeError) as error:
            raise _broken(rows, error) from error

    try:
        for index in rows.missing():
            submit(index)
        while running:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            broken: BaseException | None = None
            for future in done:
                index = running.pop(future)
                try:
                    row = future.result()
                except BrokenExecutor as error:
                    broken = error
                    continue
                except (Exception, CancelledError) as error:
                    attempts[index] = attempts.get(index, 0) + 1
                    if attempts[index] < ATTEMPTS:
                        submit(index)
                        continue
                    row = plan.failed(index, f"found no row after {ATTEMPTS} attempts, the last ended with {error!r}")
                rows.add(row)
            if broken is not None:
                raise _broken(rows, broken) from broken
    finally:
        for future in running:
            future.cancel()


def _broken(rows: _Rows, error: BaseException) -> _Broken:
    missing, total = len(rows.missing()), len(rows.plan)
    kept = f"the finished rows are in {rows.folder}" if rows.folder is not None else "give `resume` a folder to keep the others"
    return _Broken(
        f"the executor broke ({error}): {missing} of {total} points have no row; {kept}; call sweep again with a new executor, "
        "or with a function that makes one"
    )
