#!/usr/bin/env bash
# Wall time of `btfield synth` 512 x 512 as a user meets it: cold_start.sh BTFIELD PICTURE
# First with empty kernel caches (btfield's and PoCL's), then warm: the median of several runs.
set -euo pipefail
btfield=$1 picture=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export BTFIELD_CACHE_DIR=$work/btfield POCL_CACHE_DIR=$work/pocl

seconds() { # seconds COMMAND...: wall time, output dropped
    local begin=$EPOCHREALTIME
    "$@" >/dev/null
    awk -v a="$begin" -v b="$EPOCHREALTIME" 'BEGIN { printf "%.3f\n", b - a }'
}

median() { sort -n | awk '{ v[NR] = $1 } END { printf "%.3f (%.3f to %.3f, %d runs)\n", v[int((NR + 1) / 2)], v[1], v[NR], NR }'; }

for options in "--order 5" "--order 3 --levels 1"; do
    # shellcheck disable=SC2086  # the options are words
    "$btfield" fit "$picture" -o "$work/model.json" $options >/dev/null
    synth=("$btfield" synth "$work/model.json" -o "$work/out.png" --size 512x512)
    for _ in 1 2 3; do
        rm -rf "$BTFIELD_CACHE_DIR" "$POCL_CACHE_DIR"
        mkdir -p "$BTFIELD_CACHE_DIR" "$POCL_CACHE_DIR"
        seconds "${synth[@]}"
    done | median | sed "s/^/fit $options: synth 512x512, empty caches, seconds: /"
    for _ in 1 2 3 4 5 6 7 8 9; do
        seconds "${synth[@]}"
    done | median | sed "s/^/fit $options: synth 512x512, warm caches, seconds:  /"
done
