#!/bin/sh
# Distances of hybrid and rays from full wave, and the assumptions of the hybrid one at a time. From the
# root of the repository, with the directory for the results; some 30 minutes on two cores. A result
# that is there is not computed again.
set -eu
out=${1:-full-wave}
batwing=${BATWING:-target/release/batwing}
here=data/studies/full-wave
mkdir -p "$out/designs"
# Designs that differ from D1 in one thing.
d1=data/designs/d1.toml
cp data/designs/d[123].toml "$out/designs/"
cp data/gallery/d3-by-waves/design.toml "$out/designs/optimum.toml"
sed '/^sphere_radius_mm/d; /^width_mm/d; s/^height_mm = 1.0/meridian_mm = [[0, 1.1], [1.7, 0.12], [1.7, 0]]/' \
    $d1 >"$out/designs/roof.toml"
sed 's/^index = 1.41/index = 1.1/' $d1 >"$out/designs/low-index.toml"
sed 's/^size_mm = \[1.0, 1.0\]/size_mm = [0.1, 1.0]/' $d1 >"$out/designs/narrow-chip.toml"
sed 's/^size_mm = \[1.0, 1.0\]/size_mm = [1.0, 1.0]\noffset_mm = [0.5, 0.0]/' $d1 >"$out/designs/off-axis.toml"
row() { # design rings width further arguments
    design=$1 rings=$2 width=$3
    shift 3
    folder="$out/$design-${rings}x$width"
    [ -f "$folder/full_wave.json" ] ||
        "$batwing" --quiet full-wave "$out/designs/$design.toml" --rings "$rings" \
            --ring-width-um "$width" --paths 1e6 --out "$folder" "$@" >/dev/null
}
for design in d1 d2 d3; do
    for width in 2 3 5; do
        row $design 8 $width --sources 400 --separate
    done
done
row d1 16 2 --sources 400 --separate
row roof 8 3 --sources 400 --separate
row low-index 8 3 --sources 400 --separate
row off-axis 8 3 --sources 400
row narrow-chip 8 3 --sources 400
row optimum 8 3 --sources 400
for design in d1 d2 d3; do
    row $design 3 10 --sources 400
done
row d1 3 20 --sources 400
row d1 16 5
row d1 8 10
row d1 2 50
python3 $here/table.py "$out"
