#!/bin/sh
# Tuned tables and their figures: each of the five garments by itself, by affine maps and, as the paper asks it, by translations
# and levels alone; one table for three with two held out, twice; one for four with one held out, five times. Prints the figures as one table. Everything is computed anew, reference drapes too; the
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
hold_out held-out-1 pullover-2 low-cut-dress
hold_out held-out-2 pullover-1 long-sleeved-dress
for garment in $all; do
    hold_out "all-but-$garment" "$garment"
done
rm tuned/front.csv tuned/*/front.csv

# Columns: tuned_on, kind, garment, held_out, extent_factor, levels, cut_levels, parts, table_3_parts, translation_mm, its ratio,
# affine_mm, its ratio, model_mm, table_3_model_mm, model_ratio, own_mm, table_3_own_mm, own_ratio
awk -F, '
    FNR == 1 { next }
    FNR == 2 { printf "\n%s\n", $1 }
    {
        scaled = $5 == 1 ? "" : sprintf(" x %.2f", $5)
        printf "  %-26s %-18s %-8s %4d of %4d PARTs  bounds %.2f, %.2f  model %6.2f of %6.2f mm %.2f  own %6.2f of %6.2f mm %.2f\n",
            $2 scaled, $3, $4 == "true" ? "held out" : "", $8, $9, $11, $13, $14, $15, $16, $17, $18, $19
    }' tuned/verdicts.csv tuned/*/verdicts.csv
