#!/usr/bin/env bash
# Makes the recordings in this folder anew: one small file a garment.
# With `rerun` (pip install rerun-sdk==0.36.3) and Pillow at hand it takes their pictures too.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release
partwise="${CARGO_TARGET_DIR:-target}/release/partwise"
for garment in pullover-1 pullover-2 flared-skirt low-cut-dress long-sleeved-dress; do
    "$partwise" --garment "$garment@1300" --fabric jersey --no-iterations --save "recordings/gallery/$garment.rrd"
    if command -v rerun >/dev/null; then
        python3 tests/screenshot.py "recordings/gallery/$garment.rrd" "recordings/gallery/$garment.png"
    fi
done
