#!/usr/bin/env bash
# Makes the recordings in this folder anew: one small file a garment, two of the five so that the folder stays small.
# With `rerun` (pip install rerun-sdk==0.36.3) and Pillow at hand it takes the README's first picture too.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build
partwise="${CARGO_TARGET_DIR:-target}/debug/partwise"
for garment in pullover-1 flared-skirt; do
    "$partwise" --garment "$garment@2000" --fabric jersey --no-iterations --save "recordings/gallery/$garment.rrd"
done
if command -v rerun >/dev/null; then
    picture=recordings/gallery/low-cut-dress.png
    "$partwise" --save recordings/low-cut-dress.rrd
    python3 tests/screenshot.py --size 1600x900 recordings/low-cut-dress.rrd "$picture"
    # A palette shows the same in half the bytes.
    python3 - "$picture" <<'PYTHON'
import sys
from PIL import Image

shown = Image.open(sys.argv[1]).convert("RGB").resize((1200, 675), Image.Resampling.LANCZOS)
palette = shown.quantize(256, kmeans=4)
shown.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(sys.argv[1], optimize=True)
PYTHON
fi
