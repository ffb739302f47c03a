"""Sweeps over executors: none, processes, Dask with a killed worker; resume; failures; interrupts."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import partwise as pw
import pytest
from conftest import run

SPEC: dict[str, Any] = {
    "name": "levels of a skirt",
    "base": {"garment": "flared-skirt@400"},
    "grid": {"tables": ["table-3", {"quantile": [3, 5, 10]}], "fabrics": ["cotton", "interlock"]},
}


def without_times(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.drop(columns=[name for name in rows.columns if name.startswith("time_")])


def same(a: pd.DataFrame, b: pd.DataFrame) -> None:
    pd.testing.assert_frame_equal(without_times(a), without_times(b))


@pytest.fixture(scope="module")
def single() -> pd.DataFrame:
    return pw.sweep(SPEC, accuracy="none")


def processes(count: int, start: str = "spawn") -> ProcessPoolExecutor:
    return ProcessPoolExecutor(count, mp_context=multiprocessing.get_context(start))


def test_a_sweep_is_a_frame_of_the_rows_of_the_command_line(single: pd.DataFrame, program: str, tmp_path: Path) -> None:
    assert list(single["status"]) == ["ok"] * 8 and list(single["index"]) == list(range(8))
    file = tmp_path / "spec.toml"
    file.write_text(
        'name = "levels of a skirt"\n[base]\ngarment = "flared-skirt@400"\n[grid]\n'
        'tables = ["table-3", { quantile = [3, 5, 10] }]\nfabrics = ["cotton", "interlock"]\n'
    )
    run(program, "sweep", str(file), "--accuracy", "none", "--no-save", "--out", str(tmp_path / "out"))
    same(pw.sweep(file, accuracy="none"), single)
    # The folder of the command line is one that Python resumes, without anything to compute.
    found: list[dict[str, Any]] = []
    rows = pw.sweep(file, accuracy="none", resume=tmp_path / "out", on_row=found.append)
    assert not found
    same(rows, single)


@pytest.mark.parametrize("start", ["spawn", "fork"])
def test_processes_give_the_rows_of_a_single_run(single: pd.DataFrame, start: str) -> None:
    # A forked process inherits a pool of threads that do not exist in it.
    with processes(2, start) as pool:
        same(pw.sweep(SPEC, pool, accuracy="none"), single)


def test_an_interrupt_keeps_the_finished_rows(single: pd.DataFrame, tmp_path: Path) -> None:
    def stop(row: dict[str, Any]) -> None:
        if row["index"] == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        pw.sweep(SPEC, accuracy="none", resume=tmp_path / "rows", on_row=stop)
    lines = (tmp_path / "rows" / "rows.jsonl").read_text().splitlines()
    assert 3 <= len(lines) < 8
    new: list[dict[str, Any]] = []
    same(pw.sweep(SPEC, accuracy="none", resume=tmp_path / "rows", on_row=new.append), single)
    assert len(new) == 8 - len(lines)


def test_a_broken_pool_is_replaced_by_a_function_and_reported_otherwise(single: pd.DataFrame, tmp_path: Path) -> None:
    made: list[ProcessPoolExecutor] = []

    def make() -> Executor:
        made.append(processes(2))
        if len(made) == 1:
            made[0].submit(signal.raise_signal, signal.SIGKILL)
        return made[-1]

    same(pw.sweep(SPEC, make, accuracy="none"), single)
    assert len(made) == 2
    pool = processes(2)
    broken = pool.submit(signal.raise_signal, signal.SIGKILL)
    assert broken.exception() is not None
    with pytest.raises(pw.Error, match="the executor broke .*8 of 8 points have no row"):
        pw.sweep(SPEC, pool, accuracy="none", resume=tmp_path / "rows")
    same(pw.sweep(SPEC, accuracy="none", resume=tmp_path / "rows"), single)


class Losing(Executor):
    """Loses every worker that computes a certain point."""

    def __init__(self, index: int) -> None:
        self.index = index
        self.tried = 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if json.loads(args[0])["index"] == self.index:
            self.tried += 1
            future.set_exception(OSError("the worker is gone"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_point_that_loses_its_worker_three_times_is_a_failed_row(single: pd.DataFrame) -> None:
    executor = Losing(4)
    rows = pw.sweep(SPEC, executor, accuracy="none")
    assert executor.tried == 3 and list(rows["status"]) == ["ok"] * 4 + ["error"] + ["ok"] * 3
    assert "no row after 3 attempts" in rows["error"][4] and "the worker is gone" in rows["error"][4]
    same(rows.drop(4)[["point", "result_hash"]], single.drop(4)[["point", "result_hash"]])


def test_unusable_specs_are_refused() -> None:
    for spec, found in [
        ({**SPEC, "colour": 3}, "unknown field `colour`"),
        ({**SPEC, "base": {"garmnet": "flared-skirt"}}, "unknown key `garmnet`, did you mean `garment`"),
        ({**SPEC, "grid": {"tables": ["table-4"]}}, "table: found"),
        ({"name": "nothing"}, "found no points"),
        ("none.toml", "cannot be read"),
    ]:
        with pytest.raises(pw.Error, match=found):
            pw.sweep(spec)  # type: ignore[arg-type]
    with pytest.raises(pw.Error, match="expected none, canonical or own"):
        pw.sweep(SPEC, accuracy="other")


def test_a_point_that_fails_is_a_row() -> None:
    skirt = {"garment": "flared-skirt@400"}
    spec = {"name": "fails", "points": [{**skirt, "options": {"hold": "collar"}}, skirt]}
    rows = pw.sweep(spec, accuracy="none")
    assert list(rows["status"]) == ["error", "ok"] and "collar" in rows["error"][0]


@pytest.fixture
def client() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as client:
        yield client


def test_dask_with_a_killed_worker_gives_every_row_of_a_single_run(client: Any, tmp_path: Path) -> None:
    fabrics = ["cotton", "denim", "interlock", "jersey", "ponte", "rib-knit", "silk", "tablecloth", "trouser", "wool"]
    spec = {
        "name": "two hundred points",
        "base": {"garment": "flared-skirt@400"},
        "grid": {"tables": [{"quantile": list(range(1, 21))}], "fabrics": fabrics},
    }
    workers = client.run(os.getpid)
    assert len(workers) == 3
    done = 0

    def kill(row: dict[str, Any]) -> None:
        nonlocal done
        done += 1
        if done == 60:
            os.kill(next(iter(workers.values())), signal.SIGKILL)

    rows = pw.sweep(spec, client.get_executor(), accuracy="none", resume=tmp_path / "rows", on_row=kill)
    assert len(rows) == 200 and set(rows["status"]) == {"ok"}
    assert client.run(os.getpid) != workers
    same(rows, pw.sweep(spec, accuracy="none"))
