#!/usr/bin/env python3
"""Number of folds around the hem of a garment, and its length in cm.

usage: hem_folds.py GARMENT.obj...

z up, in metres. The hem is the border of the mesh whose mean height is least. Along it, a fold is a maximum of the distance from its middle
that rises by at least 1 cm over the minima beside it.
"""

import sys
from collections import Counter, defaultdict
from math import dist, hypot

PROMINENCE_M = 0.01


def main():
    for path in sys.argv[1:]:
        points, edges = read(path)
        hem = min(loops(edges), key=lambda loop: sum(points[v][2] for v in loop) / len(loop))
        ring = [points[v] for v in hem]
        length = sum(dist(a, b) for a, b in zip(ring, ring[1:] + ring[:1]))
        print(f"{path}: {folds(ring)} folds, {100 * length:.0f} cm")


def read(path):
    points, edges = [], Counter()
    for line in open(path):
        if line.startswith("v "):
            points.append([float(x) for x in line.split()[1:4]])
        elif line.startswith("f "):
            corners = [int(c.split("/")[0]) - 1 for c in line.split()[1:]]
            edges.update(tuple(sorted(e)) for e in zip(corners, corners[1:] + corners[:1]))
    return points, edges


def loops(edges):
    """Closed borders: edges of one triangle, joined end to end."""
    beside = defaultdict(list)
    for (a, b), triangles in edges.items():
        if triangles == 1:
            beside[a].append(b)
            beside[b].append(a)
    while (first := next((v for v, ends in beside.items() if ends), None)) is not None:
        loop = [first]
        while beside[loop[-1]]:
            following = beside[loop[-1]].pop()
            beside[following].remove(loop[-1])
            if following == first:
                break
            loop.append(following)
        yield loop


def folds(ring):
    middle = [sum(p[k] for p in ring) / len(ring) for k in (0, 1)]
    radius = [hypot(p[0] - middle[0], p[1] - middle[1]) for p in ring]
    low, high, rising, count = float("inf"), float("-inf"), False, 0
    # Two rounds: the first finds a start, the second counts.
    for i, r in enumerate(radius + radius):
        low, high = min(low, r), max(high, r)
        if rising and r < high - PROMINENCE_M:
            count += i >= len(radius)
            rising, low = False, r
        elif not rising and r > low + PROMINENCE_M:
            rising, high = True, r
    return count


main()
