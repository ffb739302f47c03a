#!/bin/sh
# Tuned tables and their figures: each of the five garments by itself, by affine maps and, as the paper asks it, by translations
# and levels alone; one table for four with the fifth left out, five times. Takes an hour or more on two cores. Prints the figures as one
# table. Everything is computed anew, reference drapes too; the
# fronts are large and left out. Needs `partwise` on the path.
set -e
cd "$(dirname "$0")/.."
XDG_CACHE_HOME=$(mktemp -d)
export XDG_CACHE_HOME
trap 'rm -r "$XDG_CACHE_HOME"' EXIT
all="pullover-1 pullover-2 flared-skirt low-cut-dress long-sleeved-dress"

# hold_out FOLDER GARMENT...: a table for all garments but these
hold_out() {
    folder=$1
    shift
    arguments=
    for garment in $all; do
        case " $* " in
        *" $garment "*) arguments="$arguments --hold-out $garment" ;;
        *) arguments="$arguments --garment $garment" ;;
        esac
    done
    # shellcheck disable=SC2086 # words are wanted
    partwise tune --together $arguments --out "tuned/$folder" --no-save >/dev/null
}

partwise tune --out tuned --no-save >/dev/null
partwise tune --motion translation --levels-only --out tuned/translations --no-save >/dev/null
for garment in $all; do
    hold_out "all-but-$garment" "$garment"
done
rm tuned/front.csv tuned/*/front.csv

# Errors in mm, and over Table 3's: of translations, of affine maps, of the model to the canonical drape and to its own rest.
awk -F, '
    FNR == 1 { next }
    FNR == 2 { printf "\n%s\n", $1 }
    {
        scaled = $5 == 1 ? "" : sprintf(" x %.2f", $5)
        printf "  %-26s %-18s %-8s %4d of %4d PARTs  %6.1f (%.2f) %6.1f (%.2f) %6.1f (%.2f) %6.1f (%.2f)\n",
            $2 scaled, $3, $4 == "true" ? "left out" : "", $8, $9, $10, $11, $12, $13, $14, $16, $17, $19
    }' tuned/verdicts.csv tuned/*/verdicts.csv
