#!/usr/bin/env python3
"""Evaluates the range tables of dial.toml: error against the bound of their PARTs, time against the converged drape.

usage: dial.py ROWS.csv [PICTURE.png]

ROWS.csv is written by `partwise sweep assets/sweeps/dial.toml --accuracy own`. Needs pandas, and matplotlib for the picture.
A row is good if its error is at most 1.5 times the bound (blended affine maps, against its own equilibrium) plus 3 mm.
"""

import sys

import pandas as pd

STAGES = ["time_distance_ms", "time_segment_ms", "time_mechanics_ms", "time_refine_ms"]
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
    rows["ms"] = rows[STAGES].sum(axis=1)
    rest = rows[rows.refine == "converged"].set_index(["garment", "fabric"])
    previews = rows[(rows.refine != "converged") & (rows.model != "paper")].copy()
    previews["bound_mm"] = previews.own_affine_rms_mm
    previews["good"] = previews.rms_mm <= 1.5 * previews.bound_mm + 3
    key = list(zip(previews.garment, previews.fabric))
    previews["share"] = [ms / rest.ms[k] for ms, k in zip(previews.ms, key)]
    for (garment, fabric), some in previews.groupby(["garment", "fabric"], sort=False):
        spearman = some.rms_mm.rank().corr(some.bound_mm.rank())
        end = rest.loc[(garment, fabric)]
        print(f"{garment} in {fabric}: rank correlation of error and bound {spearman:.2f}; "
              f"at rest after {end.ms:.0f} ms, {end.refine_steps:.0f} steps")
        columns = ["table", "part_count", "rms_mm", "bound_mm", "canonical_rms_mm", "representable_rms_mm", "ms", "share", "good"]
        print(some[columns].round(2).to_string(index=False), end="\n\n")
    inside = int(rows.penetrating_vertices.sum())
    print(f"{int(previews.good.sum())} of {len(previews)} rows are good; largest error {previews.rms_mm.max():.0f} mm; "
          f"{inside} vertices inside; {len(failed)} failed")
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
            some = rows[(rows.garment == garment) & (rows.fabric == fabric)]
            for name, marker, which in KINDS:
                kind = some[which(some) & ((some.model == "paper") == (marker == "X")) & (some.refine != "converged")]
                kind = kind.sort_values("part_count")
                axis.loglog(kind.ms, kind.rms_mm.clip(lower=0.1), marker + ("-" if marker in "o^" else ""), color=colour,
                            ms=8 if marker == "*" else 5, lw=0.8, alpha=0.85, label=f"{name}, {fabric}")
            end = some[some.refine == "converged"]
            for ms in end.ms:
                axis.axvline(ms, color=colour, lw=0.8, ls=":")
        axis.set_title(garment.split("@")[0], fontsize=10)
        axis.set_xlabel("time, ms (dotted: at rest)")
    axes[0].set_ylabel("RMS from its own continuation, mm")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=5, fontsize=7, frameon=False)
    figure.tight_layout(rect=(0, 0.11, 1, 1))
    figure.savefig(picture, dpi=96)


if __name__ == "__main__":
    main()
