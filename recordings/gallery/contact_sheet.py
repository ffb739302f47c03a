#!/usr/bin/env python3
"""The five garments on the form, undraped, preview and converged, front and side, cut from the real viewer into one picture.

usage: contact_sheet.py PARTWISE RERUN PICTURE

Takes a recording of each with `partwise run` (full size, jersey), opens it in the headless viewer, and cuts out the view that
counts. Needs Pillow and rerun-sdk==0.36.3.
"""

import os
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw

GARMENTS = ["pullover-1", "pullover-2", "flared-skirt", "low-cut-dress", "long-sleeved-dress"]
# Left, top, right, bottom of a 3D view, as shares of the window: the first (undraped) and the fourth (drape).
VIEWS = {"undraped": (0.0, 0.085, 0.19, 0.735), "drape": (0.572, 0.085, 0.762, 0.735)}
# Width of a cell, pixels: all seven are as wide as the README shows them.
WIDTH = 190
COLUMNS = [
    ("undraped", "undraped", "front", ["--refine", "0"]),
    ("undraped, side", "undraped", "side", ["--refine", "0"]),
    ("preview", "drape", "front", ["--refine", "0"]),
    ("preview, side", "drape", "side", ["--refine", "0"]),
    ("converged", "drape", "front", []),
    ("converged, side", "drape", "side", []),
    ("converged, back", "drape", "back", []),
]


def main():
    partwise, rerun, picture = sys.argv[1:]
    here = os.path.dirname(os.path.abspath(__file__))
    shoot = os.path.join(here, "..", "..", "tests", "screenshot.py")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for garment in GARMENTS:
            cells = []
            for i, (_, view, seen_from, flags) in enumerate(COLUMNS):
                recording, shot = os.path.join(folder, "r.rrd"), os.path.join(folder, f"{i}.png")
                subprocess.run([partwise, "--garment", garment, "--fabric", "jersey", "--no-iterations", "--seen-from",
                                seen_from, "--save", recording, *flags], check=True, capture_output=True)
                subprocess.run([sys.executable, shoot, "--rerun", rerun, "--size", "1600x900", recording, shot], check=True)
                image = Image.open(shot).convert("RGB")
                left, top, right, bottom = VIEWS[view]
                box = [left * image.width, top * image.height, right * image.width, bottom * image.height]
                cell = image.crop([round(b) for b in box])
                cells.append(cell.resize((WIDTH, WIDTH * cell.height // cell.width)))
            rows.append((garment, cells))
    width, height = rows[0][1][0].size
    sheet = Image.new("RGB", (width * len(COLUMNS), (height + 24) * len(rows)), "white")
    draw = ImageDraw.Draw(sheet)
    for r, (garment, cells) in enumerate(rows):
        for c, cell in enumerate(cells):
            sheet.paste(cell, (c * width, r * (height + 24) + 24))
            draw.text((c * width + 8, r * (height + 24) + 6), f"{garment}: {COLUMNS[c][0]}", fill="black")
    # A palette shows the same in half the bytes.
    palette = sheet.quantize(256, kmeans=4)
    sheet.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(picture, optimize=True)


if __name__ == "__main__":
    main()
