#!/usr/bin/env python3
"""Error against time of every setting of frontier.toml, one panel a garment.

usage: frontier.py ROWS.csv PICTURE.png

ROWS.csv is what `partwise sweep assets/sweeps/frontier.toml --accuracy own` leaves in its folder. Needs pandas and matplotlib.
"""

import sys

import matplotlib
import pandas as pd

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

# Name, marker, and which rows.
KINDS = [
    ("paper's model, Table 3", "X", lambda r: r.model == "paper"),
    ("preview, Table 3, 6 cm (default)", "*", lambda r: (r.refine == "0") & (r.extent_cm == "6")),
    ("preview, quantile levels, 12 to 3 cm", "o", lambda r: (r.refine == "0") & r.table.str.startswith("quantile")),
    ("cascade 12, 6, 3 cm", "^", lambda r: r.extent_cm == "12>6>3"),
    ("refined 5, 20, 80, all steps", "s", lambda r: r.refine != "0"),
]
COLOURS = {"interlock": "#2a6fbb", "cotton": "#c8502d"}


def main():
    rows = pd.read_csv(sys.argv[1], dtype={"refine": str, "extent_cm": str})
    rows = rows[rows.status == "ok"]
    # The stages alone: what measures and keeps a result is no part of it.
    stages = ["time_distance_ms", "time_segment_ms", "time_mechanics_ms", "time_refine_ms"]
    rows["ms"] = rows[stages].sum(axis=1)
    garments = list(dict.fromkeys(rows.garment))
    figure, axes = plt.subplots(1, len(garments), figsize=(3.4 * len(garments), 3.8), sharey=True)
    for axis, garment in zip(axes, garments):
        for fabric, colour in COLOURS.items():
            some = rows[(rows.garment == garment) & (rows.fabric == fabric)]
            for name, marker, which in KINDS:
                kind = some[which(some)].sort_values("ms")
                line = "-" if marker in "os" else ""
                axis.loglog(kind.ms, kind.rms_mm.clip(lower=0.1), marker + line, color=colour, ms=9 if marker == "*" else 5,
                            lw=0.8, alpha=0.85, label=f"{name}, {fabric}")
        axis.axhline(10, color="grey", lw=0.6, ls=":")
        axis.set_title(garment.split("@")[0], fontsize=10)
        axis.set_xlabel("time, ms")
    axes[0].set_ylabel("RMS from its own continuation, mm")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=5, fontsize=7, frameon=False)
    figure.tight_layout(rect=(0, 0.11, 1, 1))
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
