"""The examples of the guide, as they are printed; types of the package."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

GUIDE = Path(__file__).parents[2] / "docs" / "guide" / "python.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", GUIDE.read_text(), re.M | re.S)


def test_the_examples_of_the_guide_run(files: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    pytest.importorskip("rerun")
    monkeypatch.chdir(tmp_path)
    shutil.copy(files[0], "me.obj")
    shutil.copy(files[1], "shirt.obj")
    Path("levels.toml").write_text('name = "levels"\n[base]\ngarment = "flared-skirt@400"\n[grid]\ntables = ["table-3"]\n')
    # As scripts: workers import the main module.
    for number, block in enumerate(blocks("python")):
        Path(f"example_{number}.py").write_text(block)
        done = subprocess.run([sys.executable, f"example_{number}.py"], capture_output=True, text=True)
        assert done.returncode == 0, block + done.stderr
    assert Path("draped.obj").exists() and Path("rows/rows.csv").exists()


def test_the_array_script_of_slurm_computes_its_shard(program: str, tmp_path: Path) -> None:
    script = next(block for block in blocks("sh") if "SLURM_ARRAY_TASK_ID" in block)
    (tmp_path / "array.sh").write_text(script)
    (tmp_path / "levels.toml").write_text(
        'name = "levels"\n[base]\ngarment = "flared-skirt@400"\n[grid]\ntables = ["table-3", { quantile = [3, 5] }]\n'
    )
    (tmp_path / "partwise").symlink_to(Path(program).resolve())
    for task in ["1", "2"]:
        task_of = {"SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_COUNT": "2", "SLURM_CPUS_PER_TASK": "1"}
        environment = {**os.environ, **task_of, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
        subprocess.run(["bash", "array.sh"], cwd=tmp_path, env=environment, check=True, capture_output=True)
    merge = [str(tmp_path / "partwise"), "merge", "part-1", "part-2", "--out", "whole", "--no-save"]
    subprocess.run(merge, cwd=tmp_path, check=True, capture_output=True)
    assert len((tmp_path / "whole" / "rows.csv").read_text().splitlines()) == 4


def test_the_package_is_typed(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "user.py").write_text(blocks("python")[0] + "reveal_type(drape.positions)\nreveal_type(drape.residual)\n")
    check = ["-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", os.devnull]
    for target in [["-p", "partwise"], ["user.py"]]:
        done = subprocess.run([sys.executable, *check, *target], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout
    assert "float64" in done.stdout and "float | None" in done.stdout, done.stdout
    assert done.returncode == 0, done.stdout
