#!/bin/sh
# Tuned tables and their figures: each of the five garments by itself, and one table for four with the fifth left out, five times; levels
# alone and with extents, judged in interlock and cotton. Prints the figures as one table. Everything is computed anew, reference
# drapes too. Needs `partwise` on the path.
set -e
cd "$(dirname "$0")/.."
XDG_CACHE_HOME=$(mktemp -d)
export XDG_CACHE_HOME
trap 'rm -r "$XDG_CACHE_HOME"' EXIT
all="pullover-1 pullover-2 flared-skirt low-cut-dress long-sleeved-dress"

partwise tune --tables 600 --out tuned --no-save >/dev/null
for left_out in $all; do
    arguments=
    for garment in $all; do
        [ "$garment" = "$left_out" ] || arguments="$arguments --garment $garment"
    done
    # shellcheck disable=SC2086 # words are wanted
    partwise tune --together $arguments --hold-out "$left_out" --tables 200 --out "tuned/all-but-$left_out" --no-save >/dev/null
done

# PARTs and errors in mm, and in brackets over Table 3's.
awk -F, '
    FNR == 1 { next }
    $1 != tuned_on { tuned_on = $1; printf "\n%s\n", $1 }
    {
        scaled = $6 == 1 ? "" : sprintf(" x %.2f", $6)
        printf "  %-26s %-18s %-10s %-8s %4d of %4d PARTs  %6.1f mm (%.2f)\n",
            $2 scaled, $3, $4, $5 == "true" ? "left out" : "", $9, $10, $11, $13
    }' tuned/verdicts.csv tuned/*/verdicts.csv
