#!/bin/sh
# Instructions that two drapes take on one thread, counted by callgrind: seconds depend on the machine and on what else it does, these
# do not. A drape may take half as many again as when its count was written down (in AVX2's registers); more is a regression, much less
# a reason to write down the new one. `tests/instructions.sh target/debug/partwise` after `cargo build`
set -eu
program=$1
XDG_CACHE_HOME=$(mktemp -d)
export XDG_CACHE_HOME
trap 'rm -r "$XDG_CACHE_HOME"' EXIT

# check GARMENT FABRIC MILLIONS
check() {
    garment=$1 fabric=$2 known=$3
    set -- --garment "$garment" --fabric "$fabric" --threads 1 --no-save
    # Once without being counted, so that body and garment are in the cache.
    "$program" "$@" >/dev/null
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$@" >/dev/null 2>"$XDG_CACHE_HOME/counted"
    now=$(sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$XDG_CACHE_HOME/counted")
    [ -n "$now" ] || { cat "$XDG_CACHE_HOME/counted"; exit 1; }
    echo "$garment in $fabric: $((now / 1000000)) million instructions, $known when this was written"
    [ "$((now / 1000000))" -le "$((known * 3 / 2))" ] || { echo "more than half as many again"; exit 1; }
}

check flared-skirt@400 interlock 1520
check low-cut-dress@400 interlock 1866
