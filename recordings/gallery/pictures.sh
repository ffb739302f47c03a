#!/usr/bin/env bash
# Makes the pictures of this folder that the program draws itself.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build
partwise="${CARGO_TARGET_DIR:-$PWD/target}/debug/partwise"
gallery=recordings/gallery
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT

run() { "$partwise" "$@" --no-save --force > /dev/null; }
run --garment low-cut-dress --picture $gallery/dress.png \
    --picture-of distance --picture-of parts --picture-of force --picture-of drape
run --garment flared-skirt --fabric cotton --picture $gallery/skirt.png --eye front --eye side --eye back
run --pattern assets/patterns/tshirt.json --fabric cotton --picture $gallery/pattern.png \
    --eye flat --eye front --picture-of parts --picture-of strain
run --garment pullover-1 --garment flared-skirt --fabric interlock --fabric denim \
    --picture $gallery/layers.png --eye front --eye side --eye back
run sweep $gallery/parts.toml --out "$scratch/parts" --picture $gallery/parts.png --picture-of parts
run sweep $gallery/wardrobe.toml --out "$scratch/wardrobe" --picture $gallery/wardrobe.png \
    --eye front --eye side --eye back
run sweep assets/sweeps/sizes.toml --out "$scratch/sizes" --picture $gallery/sizes.png --picture-of strain
cargo run -q --no-default-features --example pose_form -- "$scratch/poses"
run --from-body form --body "$scratch/poses" --garment pullover-2 --picture $gallery/poses.png
