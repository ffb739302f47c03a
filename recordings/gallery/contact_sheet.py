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
# Left, top, right, bottom of a 3D view, as shares of the window: the first (undraped) and the fourth (drape), which stand in one row or,
# of what is wider than high, in two.
VIEWS = {
    1: {"undraped": (0.0, 0.085, 0.19, 0.735), "drape": (0.572, 0.085, 0.762, 0.735)},
    2: {"undraped": (0.0, 0.085, 0.38, 0.395), "drape": (0.382, 0.43, 0.762, 0.735)},
}
# Of a view in two rows so much width over height is shown.
SHOWN = 1.1
# Width of a cell and its height in a row of gowns and of pullovers, pixels: all seven are as wide as the README shows them.
WIDTH, HEIGHTS = 190, {1: 366, 2: 190}
# The viewer's title bars, and the ground of its views.
TITLE, GROUND = (33, 33, 33), (31, 34, 39)
COLUMNS = [
    ("undraped", "undraped", "front", ["--refine", "0"]),
    ("undraped, side", "undraped", "side", ["--refine", "0"]),
    ("preview", "drape", "front", ["--refine", "0"]),
    ("preview, side", "drape", "side", ["--refine", "0"]),
    ("converged", "drape", "front", []),
    ("converged, side", "drape", "side", []),
    ("converged, back", "drape", "back", []),
]


def rows_of(image):
    """In how many rows the views stand: title bars between them are seen at half height."""
    across = range(int(0.05 * image.width), int(0.7 * image.width), 8)
    share = lambda y: sum(image.getpixel((x, y)) == TITLE for x in across) / len(across)
    return 2 if any(share(y) > 0.5 for y in range(int(0.35 * image.height), int(0.5 * image.height))) else 1


def cut(image, view):
    """The view, and in how many rows it stood."""
    rows = rows_of(image)
    left, top, right, bottom = VIEWS[rows][view]
    left, top, right, bottom = left * image.width, top * image.height, right * image.width, bottom * image.height
    if rows == 2:
        middle, half = 0.5 * (left + right), 0.5 * SHOWN * (bottom - top)
        left, right = middle - half, middle + half
    return image.crop([round(b) for b in (left, top, right, bottom)]), rows


def worn(cell):
    """Whether there is a garment: it is coloured, body and ground are not."""
    pixels = list(cell.resize((60, 60)).getdata())
    return sum(max(p) - min(p) > 50 for p in pixels) > 0.05 * len(pixels)


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
                for _ in range(5):
                    subprocess.run([sys.executable, shoot, "--rerun", rerun, "--size", "1600x900", recording, shot], check=True)
                    cell, rows_there = cut(Image.open(shot).convert("RGB"), view)
                    # A slow machine may not have drawn this view's garment yet.
                    if worn(cell):
                        break
                cells.append((cell, rows_there))
            rows.append((garment, cells, HEIGHTS[cells[0][1]]))
    sheet = Image.new("RGB", (WIDTH * len(COLUMNS), sum(height + 24 for _, _, height in rows)), "white")
    draw = ImageDraw.Draw(sheet)
    top = 0
    for garment, cells, height in rows:
        for c, (cell, _) in enumerate(cells):
            scale = min(WIDTH / cell.width, height / cell.height)
            shown = cell.resize((round(scale * cell.width), round(scale * cell.height)), Image.Resampling.LANCZOS)
            sheet.paste(GROUND, (c * WIDTH, top + 24, (c + 1) * WIDTH, top + 24 + height))
            sheet.paste(shown, (c * WIDTH + (WIDTH - shown.width) // 2, top + 24 + (height - shown.height) // 2))
            draw.text((c * WIDTH + 8, top + 6), f"{garment}: {COLUMNS[c][0]}", fill="black")
        top += height + 24
    # A palette shows the same in half the bytes.
    palette = sheet.quantize(256, kmeans=4)
    sheet.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(picture, optimize=True)


if __name__ == "__main__":
    main()
