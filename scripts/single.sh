#!/usr/bin/env bash
# Measures the march of single scattering against the traced reference: error, fetches, time. Writes
# docs/results/single.md and .csv, a plot and a picture in docs/images, and the tables in
# docs/methods/single.md. Exits 1 where a bound below does not hold.
#
#   scripts/single.sh [--quick] [--fresh] [--out DIR]
#
#   --quick    marble and the main plans only
#   --fresh    traces the references anew, which are kept in DIR otherwise
#   --out DIR  work folder (out/single)
#
# The references of a full run take about 6 minutes on 2 cores, once; the rest 4. They are kept by name
# alone: a change of the meshes or of the reference itself wants --fresh.
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
# shellcheck source=scripts/measure.sh
. "$(dirname "${BASH_SOURCE[0]}")/measure.sh"
cd "$MARMOR_ROOT"

# name, its reference, mesh, light, camera, side of the light map
scenes='
sphere           sphere       sphere.obj  40,35    -28,4   512
sphere-side      sphere-side  sphere.obj  120,10   0,5     512
disc-front       disc-front   disc.obj    40,35    0,0     512
disc             disc         disc.obj    170,10   0,0     512
disc-1024        disc         disc.obj    170,10   0,0     1024
statue           statue       statue      40,35    -28,4   512
statue-1024      statue       statue      40,35    -28,4   1024
statue-front     statue-front statue      -28,20   -28,4   1024
statue-back      statue-back  statue      -140,35  -28,4   1024
'

materials='
marble
skin1
ketchup
'

# name, family in the plot, words in the tables, word in the plot, arguments
plans='
linear-2   linear   2_samples            2   --single 2
linear-4   linear   4_samples            4   --single 4
linear-6   linear   6_samples            6   --single 6
linear-8   linear   8_samples            8   --single 8
linear-12  linear   12_samples           12  --single 12
linear-16  linear   16_samples           16  --single 16
linear-32  linear   32_samples           32  --single 32
nearest-4  nearest  4,_nearest_texel     4   --single 4 --exits nearest
nearest-8  nearest  8,_nearest_texel     8   --single 8 --exits nearest
nearest-16 nearest  16,_nearest_texel    16  --single 16 --exits nearest
depth-4    depth    4,_depth_buffer      4   --single 4 --exits depth
depth-8    depth    8,_depth_buffer      8   --single 8 --exits depth
depth-16   depth    16,_depth_buffer     16  --single 16 --exits depth
'
quick_without='^(linear-(2|6|32)|nearest-4|nearest-16|depth-4|depth-16)$'

# What must hold: plan, scenes, materials, and rr X or fetches N, as in scripts/methods.sh.
bounds='
linear-8  sphere,sphere-side,disc-front            marble,skin1  rr 0.015
linear-8  disc,disc-1024                           marble,skin1  rr 0.015
linear-8  statue-1024                              marble        rr 0.04
linear-8  statue-1024                              skin1         rr 0.04
linear-8  sphere,sphere-side,disc-front,disc       ketchup       rr 0.05
linear-8  statue-1024                              ketchup       rr 0.05
linear-8  all                                      all           fetches 8
'

measure_begin out/single traced "$@"

# render OUT MESH LIGHT CAMERA ARGUMENTS... : single scattering alone.
render() {
    local out=$1 mesh=$2 light=$3 camera=$4
    shift 4
    "$marmor" render -q -o "$out" "$(mesh_of "$mesh")" --light="$light" --camera="$camera" \
        --size 200x150 --specular off --multiple none --jitter off "$@"
}

# ------------------------------------------------------------ traced references

rows "$materials" | while read -r material; do
    rows "$scenes" | while read -r _ reference mesh light camera _; do
        file=$folder/traced/$reference-$material
        [ ! -e "$file.exr" ] || continue
        # The map tells the reference nothing.
        render "$file.part.exr" "$mesh" "$light" "$camera" --material "$material" --light-map 16 \
            --single traced </dev/null
        mv "$file.part.exr" "$file.exr"
        say "traced: $reference in $material"
    done
done

# ------------------------------------------------------------------------- plans

rows "$materials" | while read -r material; do
    rows "$scenes" | while read -r name reference mesh light camera map; do
        rows "$plans" | while read -r plan _ _ _ arguments; do
            stem=$folder/plans/$name-$material-$plan
            # shellcheck disable=SC2086 # the arguments are meant to split
            render "$stem.exr" "$mesh" "$light" "$camera" --material "$material" --light-map "$map" \
                $arguments --stats "$stem.stats.json" </dev/null
            "$marmor" compare "$folder/traced/$reference-$material.exr" "$stem.exr" --json \
                >"$stem.rr.json" </dev/null
            rm -f "$stem.exr"
        done
        say "plans: $name in $material"
    done
done

# ------------------------------------------------------------------------- times

# All plans in turn, three times: the report takes the least, since other work only ever adds. With jitter, so that
# the light map moves and each frame draws it.
for round in 1 2 3; do
    rows "$plans" | while read -r plan _ _ _ arguments; do
        # shellcheck disable=SC2086 # the arguments are meant to split
        "$marmor" render -q -o "$folder/timed.exr" --size 800x600 --specular off --multiple none \
            --jitter all --frames-averaged 24 --stats "$folder/times/$plan.$round.json" $arguments </dev/null
    done
    say "times: round $round of 3"
done
rm -f "$folder/timed.exr"

# ---------------------------------------------------------------------- pictures

# traced | march | difference of the statue's head in skin, lit from behind.
shot() {
    "$marmor" render -q -o "$1" --camera=-28,8,125 --size 200x200 --specular off --multiple none \
        --material skin1 --light=-140,35 --light-map 1024 --jitter off --exposure 6 "${@:2}"
}

mkdir -p docs/images
if [ ! -e "$folder/traced/shot.png" ]; then
    shot "$folder/shot.part.png" --single traced
    mv "$folder/shot.part.png" "$folder/traced/shot.png"
fi
shot "$folder/pictures/march.png" --single 8
"$marmor" compare "$folder/traced/shot.png" "$folder/pictures/march.png" \
    --map "$folder/pictures/difference.png" >/dev/null
python3 scripts/methods.py picture docs/images/method-single.png "$folder/traced/shot.png" \
    "$folder/pictures/march.png" "$folder/pictures/difference.png"

python3 scripts/single.py "$folder" docs
