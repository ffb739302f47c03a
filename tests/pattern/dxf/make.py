"""Writes skirt.dxf and top.dxf with ezdxf, as pattern makers' programs do: ASTM D6673, a block for each piece.

    python -m venv venv && venv/bin/pip install ezdxf
    venv/bin/python tests/pattern/dxf/make.py
"""

import math
from pathlib import Path

import ezdxf

HERE = Path(__file__).parent


def bezier(points, count=12):
    """Points of a Bezier curve without its first."""
    out = []
    for i in range(1, count + 1):
        t, level = i / count, points
        while len(level) > 1:
            level = [tuple((1 - t) * a + t * b for a, b in zip(p, q)) for p, q in zip(level, level[1:])]
        out.append(level[0])
    return out


def drawing(style, units="METRIC"):
    doc = ezdxf.new("R2000", setup=False)
    doc.header["$INSUNITS"] = 4
    for layer in ("1", "2", "3", "4", "6", "7", "8", "14"):
        doc.layers.add(layer)
    for row, text in enumerate([f"Style Name: {style}", "Author: ezdxf", f"Units: {units}", "Sample Size: 38"]):
        doc.modelspace().add_text(text, dxfattribs={"layer": "1", "insert": (0, -20 * row)})
    return doc


def piece(doc, name, outline, corners, grain, *, allowance=10, size="38", quantity="1", notches=(), fold=None, inner=()):
    """A block: the outline is the sew line (mm), the cut line lies `allowance` outside of it."""
    block = doc.blocks.new(name=f"{name}_{size}")
    for row, text in enumerate([f"Piece Name: {name}", f"Size: {size}", f"Quantity: {quantity}"]):
        block.add_text(text, dxfattribs={"layer": "1", "insert": (0, -20 * row)})
    n = len(outline)
    area = sum(outline[i][0] * outline[(i + 1) % n][1] - outline[(i + 1) % n][0] * outline[i][1] for i in range(n))

    def moved(i):
        (ax, ay), (bx, by) = outline[i - 1], outline[(i + 1) % n]
        length = math.hypot(bx - ax, by - ay) or 1
        side = allowance if area > 0 else -allowance
        return (outline[i][0] + side * (by - ay) / length, outline[i][1] - side * (bx - ax) / length)

    block.add_polyline2d([moved(i) for i in range(n)], close=True, dxfattribs={"layer": "1"})
    block.add_polyline2d(outline, close=True, dxfattribs={"layer": "14"})
    for corner in corners:
        block.add_point(corner, dxfattribs={"layer": "2"})
    for notch in notches:
        block.add_point(notch, dxfattribs={"layer": "4"})
    block.add_line(*grain, dxfattribs={"layer": "7"})
    if fold:
        block.add_line(*fold, dxfattribs={"layer": "6"})
    for line in inner:
        block.add_line(*line, dxfattribs={"layer": "8"})
    doc.modelspace().add_blockref(block.name, (0, 0), dxfattribs={"layer": "1"})


def skirt():
    """Two panels, y along the grain: the front is half of one, cut on the fold; the back is whole and has a dart line inside."""
    doc = drawing("A-line skirt")
    waist, hip, hem, length = 187, 245, 300, 560
    side = [(waist, 0)] + bezier([(waist, 0), (225, -60), (hip, -130), (hip, -200)]) + [(hem, -length)]
    curve = bezier([(hem, -length), (hem / 2, -length - 30), (0, -length - 30)])
    half = [(0, 0)] + side + curve
    piece(doc, "SKIRT FRONT", half, [(0, 0), side[0], side[-1], half[-1]], ((80, -100), (80, -450)), fold=((0, 0), (0, -length - 30)))
    left = [(-x, y) for x, y in reversed(half[1:-1])]
    whole = half[1:] + left
    corners = [side[0], side[-1], left[0], left[-1]]
    # bezier() of the hem ends at its middle, so that the mirrored half follows.
    piece(doc, "SKIRT BACK", whole, [corners[0], corners[1], left[-1], (-hem, -length)], ((80, -100), (80, -450)), notches=[(hip, -200), (-hip, -200)], inner=[((-90, 0), (-90, -110))])
    doc.saveas(HERE / "skirt.dxf")


def top():
    """A sleeveless top whose grain lies along x, in two sizes."""
    doc = drawing("Top")
    for size, wider in (("38", 0), ("42", 20)):
        for name, neck in (("FRONT", 90), ("BACK", 25)):
            armpit, tip, point = (240 + wider, -235), (175, -45), (80, 0)
            armhole = bezier([armpit, (165, -215), (165, -120), tip])
            neckline = bezier([point, (75, -neck), (40, -neck), (0, -neck)])
            right = [(0, -600), (240 + wider, -600), armpit] + armhole + [point] + neckline
            left = [(-x, y) for x, y in reversed(right[1:-1])]
            outline = right[1:] + left
            corners = [(240 + wider, -600), armpit, tip, point]
            corners += [(-x, y) for x, y in corners]
            lying = lambda points: [(y, -x) for x, y in points]
            piece(doc, name, lying(outline), lying(corners), ((-500, 0), (-200, 0)), size=size, notches=lying([(240 + wider, -400), (-240 - wider, -400)]))
    doc.saveas(HERE / "top.dxf")


skirt()
top()
