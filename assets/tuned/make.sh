#!/bin/sh
# Tuned tables and their figures: each of the five garments by itself, then three together with two held out, twice. About
# half an hour on two cores; the fronts stay behind, they are large. Needs `partwise` on the path.
set -e
cd "$(dirname "$0")/.."
partwise tune --out tuned --no-save
partwise tune --together --garment pullover-1 --garment flared-skirt --garment long-sleeved-dress \
    --hold-out pullover-2 --hold-out low-cut-dress --out tuned/held-out-1 --no-save
partwise tune --together --garment pullover-2 --garment flared-skirt --garment low-cut-dress \
    --hold-out pullover-1 --hold-out long-sleeved-dress --out tuned/held-out-2 --no-save
rm tuned/front.csv tuned/held-out-1/front.csv tuned/held-out-2/front.csv
