#!/usr/bin/env python3
"""The part of a drape that a garment without folds cannot have, mm RMS: the least error of stage two.

usage: unfolded.py PLACED.obj DRAPED.obj

Both files have the same vertices, z up, in metres. The placed garment is cut into connected rings 4 cm high; around each ring, the
displacement is fitted by waves of at most two periods and their linear change with height, which move, tilt and flatten the ring. What
remains are folds. Needs numpy.
"""

import sys
from collections import defaultdict

import numpy as np

RING_M = 0.04
PERIODS = 2


def main():
    placed, edges = read(sys.argv[1])
    draped, _ = read(sys.argv[2])
    print(f"{1e3 * np.sqrt(folds(placed, edges, draped - placed).mean()):.1f} mm")


def read(path):
    points, edges = [], []
    for line in open(path):
        if line.startswith("v "):
            points.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("f "):
            corners = [int(c.split("/")[0]) - 1 for c in line.split()[1:]]
            edges += zip(corners, corners[1:] + corners[:1])
    return np.array(points), edges


def folds(placed, edges, moved):
    """Squared displacement of each vertex that waves of few periods leave, m²."""
    ring = np.floor((placed[:, 2] - placed[:, 2].min()) / RING_M).astype(int)
    neighbours = defaultdict(list)
    for a, b in edges:
        if ring[a] == ring[b]:
            neighbours[a].append(b)
            neighbours[b].append(a)
    left, seen = np.zeros(len(placed)), np.zeros(len(placed), bool)
    for first in range(len(placed)):
        if seen[first]:
            continue
        piece, seen[first] = [first], True
        for v in piece:
            fresh = [w for w in neighbours[v] if not seen[w]]
            seen[fresh] = True
            piece += dict.fromkeys(fresh)
        from_middle = placed[piece] - placed[piece].mean(0)
        angle, height = np.arctan2(from_middle[:, 1], from_middle[:, 0]), from_middle[:, 2]
        waves = [np.ones(len(piece)), height]
        for n in range(1, PERIODS + 1):
            for wave in (np.cos(n * angle), np.sin(n * angle)):
                waves += [wave, height * wave]
        waves = np.stack(waves, 1)
        if len(piece) < 3 * waves.shape[1]:
            waves = waves[:, :1]
        u = moved[piece]
        left[piece] = ((u - waves @ np.linalg.lstsq(waves, u, rcond=None)[0]) ** 2).sum(1)
    return left


if __name__ == "__main__":
    main()
