#!/usr/bin/env bash
# The Python package as a user installs it: builds the wheel, installs it into a fresh environment, and runs its tests.
# `tests/python/run.sh [PROGRAM]`: the program whose bits and messages are compared, and the interpreters, by default `python3`, in PYTHONS.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/debug/partwise}")
for python in ${PYTHONS:-python3}; do
    environment=target/ci-python/$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    rm -rf "$environment"
    "$python" -m venv "$environment"
    pip=("$environment/bin/pip" --disable-pip-version-check install --quiet)
    # maturin builds into target/ too, so that dependencies are compiled once.
    "${pip[@]}" ".[sweep,rerun]"
    "${pip[@]}" pytest mypy distributed "rerun-sdk[notebook]==0.36.3" nbclient nbformat ipykernel
    (cd tests/python && PARTWISE=$program "../../$environment/bin/python" -m pytest -q -p no:cacheprovider .)
done
