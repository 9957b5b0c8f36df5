#!/bin/sh
# Distances of hybrid and rays from full wave: three reliefs, rings of 2 to 10 µm. From the root of the
# repository, with the directory for the results; some 15 minutes on two cores. Prints the table.
set -eu
out=${1:-full-wave}
batwing=${BATWING:-target/release/batwing}
row() { # design rings width
    folder="$out/$1-$2x$3"
    [ -f "$folder/full_wave.json" ] ||
        "$batwing" --quiet full-wave "data/designs/$1.toml" --rings "$2" --ring-width-um "$3" \
            --paths 1e6 --out "$folder"
    printf '%s %s %s ' "$1" "$2" "$3"
    python3 - "$folder/full_wave.json" <<'PY'
import json, sys
found = json.load(open(sys.argv[1]))["comparison"]
print(f"{found['balance']:.0e}", end="")
for width in (1.0, 2.5, 5.0):
    for model in ("hybrid", "rays"):
        d = next(d for d in found["distances"] if d["model"] == model and d["bin_deg"] == width)
        print(f" {100 * d['rms']:.1f}±{100 * d['noise']:.1f}", end="")
print()
PY
}
# The assumptions of the hybrid one at a time, in two small domes.
separate() { # design rings width
    echo "$1, $2 rings of $3 um"
    "$batwing" full-wave "data/designs/$1.toml" --rings "$2" --ring-width-um "$3" --sources 60 \
        --tolerance 1e-4 --paths 2e5 --separate --out "$out/separate-$1" | sed -n '/^variant/,/^written/p'
}
separate d1 4 3
separate d2 6 2
echo "design rings um balance hybrid-1 rays-1 hybrid-2.5 rays-2.5 hybrid-5 rays-5"
for design in d1 d2 d3; do
    for width in 2 3 5; do
        row "$design" 8 "$width"
    done
done
for width in 2 5; do
    row d1 16 "$width"
done
for design in d1 d2 d3; do
    row "$design" 8 10
done
