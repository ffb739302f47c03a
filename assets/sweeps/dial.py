#!/usr/bin/env python3
"""Evaluates the range tables of dial.toml: error to the canonical drape against the PART count and the bound of the PARTs.

usage: dial.py ROWS.csv [PICTURE.png]

ROWS.csv is written by `partwise sweep assets/sweeps/dial.toml --accuracy canonical`. Needs pandas, and matplotlib for the picture.
A row is near its bound if its error is at most 1.5 times the bound (affine maps of its PARTs) plus 3 mm. Times are printed where the rows
have them.
"""

import sys

import pandas as pd

COLOURS = {"interlock": "#2a6fbb", "cotton": "#c8502d"}
KINDS = [
    ("paper's model, Table 3", "X", lambda r: r.model == "paper"),
    ("Table 3, and scaled", "*", lambda r: r.table.str.startswith("table-3")),
    ("quantile levels, 3 to 40", "o", lambda r: r.table.str.startswith("quantile")),
    ("Table 3 with extents 24, 12, 6 cm", "^", lambda r: r.table.str.contains("tables/")),
    ("tuned", "D", lambda r: r.table.str.contains("tuned/")),
]


def main():
    rows = pd.read_csv(sys.argv[1], dtype={"refine": str})
    failed = rows[rows.status != "ok"]
    rows = rows[rows.status == "ok"].copy()
    previews = rows[(rows.refine != "converged") & (rows.model != "paper")].copy()
    previews["error_mm"] = previews.canonical_rms_mm
    previews["bound_mm"] = previews.representable_affine_rms_mm
    previews["near"] = previews.error_mm <= 1.5 * previews.bound_mm + 3
    columns = ["table", "part_count", "error_mm", "bound_mm", "near"]
    if "time_mechanics_ms" in rows:
        previews["ms"] = previews.time_mechanics_ms
        columns.append("ms")
    tuned = previews.table.str.contains("tuned/")
    for (garment, fabric), some in previews.groupby(["garment", "fabric"], sort=False):
        families = {
            "quantile levels": some[some.table.str.startswith("quantile")],
            "extents of Table 3": some[(some.table == "table-3") | some.table.str.contains("tables/")],
        }
        ranks = [f"{name} {f.error_mm.rank().corr(f.part_count.rank()):.2f}" for name, f in families.items()]
        print(f"{garment} in {fabric}: rank correlation of error and PARTs: {', '.join(ranks)}")
        print(some.sort_values("part_count")[columns].round(2).to_string(index=False), end="\n\n")
    inside = int(rows.penetrating_vertices.sum())
    print(f"{int(previews.near[~tuned].sum())} of {int((~tuned).sum())} rows without tuned tables are near their bound; "
          f"largest error {previews.error_mm.max():.0f} mm; {inside} vertices inside; {len(failed)} failed")
    if len(sys.argv) > 2:
        draw(rows, sys.argv[2])


def draw(rows, picture):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    garments = list(dict.fromkeys(rows.garment))
    figure, axes = plt.subplots(1, len(garments), figsize=(3.4 * len(garments), 3.8), sharey=True)
    for axis, garment in zip(axes, garments):
        for fabric, colour in COLOURS.items():
            some = rows[(rows.garment == garment) & (rows.fabric == fabric) & (rows.refine != "converged")]
            for name, marker, which in KINDS:
                kind = some[which(some) & ((some.model == "paper") == (marker == "X"))].sort_values("part_count")
                axis.loglog(kind.part_count, kind.canonical_rms_mm, marker + ("-" if marker in "o^" else ""), color=colour,
                            ms=8 if marker == "*" else 5, lw=0.8, alpha=0.85, label=f"{name}, {fabric}")
        axis.set_title(garment.split("@")[0], fontsize=10)
        axis.set_xlabel("PARTs")
    axes[0].set_ylabel("RMS distance to the canonical drape, mm")
    ticks = [2, 5, 10, 20, 50, 100]
    axes[0].set_yticks(ticks, [str(tick) for tick in ticks])
    axes[0].minorticks_off()
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=5, fontsize=7, frameon=False)
    figure.tight_layout(rect=(0, 0.11, 1, 1))
    figure.savefig(picture, dpi=96)


if __name__ == "__main__":
    main()
