#!/usr/bin/env bash
# Measures the methods for multiple scattering against `exact`: error, fetches, time. Writes
# docs/results/methods.md and .csv, the plots and pictures in docs/images, and the tables in
# docs/methods/*.md. Exits 1 where a bound below does not hold.
#
#   scripts/methods.sh [--quick] [--fresh] [--out DIR]
#
#   --quick    marble and the main plans only
#   --fresh    renders the exact pictures anew, which are kept in DIR otherwise
#   --out DIR  work folder (out/methods)
#
# The exact pictures of a full run take about 40 minutes on 2 cores, once; the rest 15 (--quick: 10
# and 3). They are
# kept by name alone: a change of the light map, the meshes or `exact` itself wants --fresh.
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
# shellcheck source=scripts/measure.sh
. "$(dirname "${BASH_SOURCE[0]}")/measure.sh"
cd "$MARMOR_ROOT"

# name, mesh, light, camera, side of the light map, cost of `exact` in seconds on 2 cores
scenes='
plane0        plane.obj   0,0      0,0,56  512   110
plane60       plane.obj   60,0     0,0,56  512   110
sphere        sphere.obj  40,35    -28,4   512   60
disc          disc.obj    170,10   0,0     512   60
statue        statue      40,35    -28,4   512   20
statue-front  statue      -28,20   -28,4   512   20
statue-back   statue      -140,35  -28,4   512   20
statue-1024   statue      40,35    -28,4   1024  80
'

materials='
marble
skin1
wholemilk
ketchup
'

# name, family in the plots, words in the tables, word in the plots (- for none), arguments;
# with --quick those whose names match `quick_without` are left out.
plans='
samples-8            samples    samples_8                        8        --multiple samples --samples 8
samples-16           samples    samples_16                       16       --multiple samples --samples 16
samples-30           samples    samples_30                       30       --multiple samples --samples 30
samples-60           samples    samples_60                       60       --multiple samples --samples 60
rings-4              rings      rings_4                          4        --multiple rings --rings 4
rings-5              rings      rings_5                          5        --multiple rings --rings 5
rings-6              rings      rings_6                          6        --multiple rings --rings 6
rings-7              rings      rings_7                          7        --multiple rings --rings 7
rings-8              rings      rings_8                          8        --multiple rings --rings 8
rings-9              rings      rings_9                          9        --multiple rings --rings 9
rings-10             rings      rings_10                         10       --multiple rings --rings 10
mixture-3            mixture-3  mixture,_3_moments               3        --multiple mixture --moments 3
mixture-3-second     mixture-3  mixture,_3,_every_second_level   3/2      --multiple mixture --moments 3 --level-step 2
mixture-3-closed     mixture-3  mixture,_3,_closed_weights       -        --multiple mixture --moments 3 --weights closed
mixture-3-fitted     mixture-3  mixture,_3,_fitted_weights       -        --multiple mixture --moments 3 --weights fitted
mixture-4            mixture-4  mixture,_4_moments               4        --multiple mixture --moments 4
mixture-4-most-2     mixture-4  mixture,_4_at_2_levels           4_at_2   --multiple mixture --moments 4 --fourth-levels 2
mixture-4-most-3     mixture-4  mixture,_4_at_3_levels           4_at_3   --multiple mixture --moments 4 --fourth-levels 3
mixture-4-from-1     mixture-4  mixture,_4_from_level_1          4_from_1 --multiple mixture --moments 4 --fourth-from 1
mixture-4-from-2     mixture-4  mixture,_4_from_level_2          4_from_2 --multiple mixture --moments 4 --fourth-from 2
mixture-4-from-3     mixture-4  mixture,_4_from_level_3          4_from_3 --multiple mixture --moments 4 --fourth-from 3
mixture-4-second     mixture-4  mixture,_4,_every_second_level   4/2      --multiple mixture --moments 4 --level-step 2
mixture-3-volumes-3  volumes    mixture,_3,_3_volumes            3+3      --multiple mixture --moments 3 --volumes 3
mixture-3-volumes-4  volumes    mixture,_3,_4_volumes            3+4      --multiple mixture --moments 3 --volumes 4
mixture-3-volumes-5  volumes    mixture,_3,_5_volumes            3+5      --multiple mixture --moments 3 --volumes 5
mixture-4-volumes-4  volumes    mixture,_4,_4_volumes            4+4      --multiple mixture --moments 4 --volumes 4
mixture-4-volumes-5  volumes    mixture,_4,_5_volumes            4+5      --multiple mixture --moments 4 --volumes 5
'
quick_without='^(samples-60|rings-[579]|mixture-3-fitted|mixture-4-from-[13]|mixture-4-volumes-4)$'

# What must hold: plan, scenes, materials, and
#   rr X          the error is at most X
#   fetches N     no more than N fetches a pixel
#   below PLAN    the error is less than that of PLAN
#   shade-ratio PLAN X   the statue's shade pass takes PLAN at least X times as long
bounds='
# Moments alone: of scenes where few surfaces hide others.
mixture-3               plane0,plane60,sphere,disc               marble,skin1,wholemilk  rr 0.02
mixture-3               plane0,plane60,sphere,disc,statue-front  ketchup                 rr 0.09
mixture-3               statue-front                             marble,skin1,wholemilk  rr 0.08
mixture-3               all                                      all                     fetches 9
mixture-3               statue                                   marble                  shade-ratio samples-30 4
mixture-4               plane0,plane60,sphere,disc               marble,skin1,wholemilk  rr 0.015
mixture-4               plane0,plane60,sphere,disc,statue-front  ketchup                 rr 0.06
mixture-4               statue-front                             marble,skin1,wholemilk  rr 0.05
mixture-4               all                                      all                     fetches 18
mixture-4               all                                      all                     below samples-16
# With volumes: of all.
mixture-3-volumes-5     plane0,plane60,sphere,disc               marble,skin1,wholemilk  rr 0.02
mixture-3-volumes-5     statue,statue-front                      marble,skin1,wholemilk  rr 0.08
mixture-3-volumes-5     plane0,plane60,sphere,disc,statue        ketchup                 rr 0.09
mixture-3-volumes-5     all                                      all                     fetches 9
mixture-3-volumes-5     statue                                   marble                  shade-ratio samples-30 4
mixture-4-volumes-5     plane0,plane60,sphere,disc               marble,skin1,wholemilk  rr 0.015
mixture-4-volumes-5     statue,statue-front                      marble,skin1,wholemilk  rr 0.05
mixture-4-volumes-5     statue-1024                              marble,skin1,wholemilk  rr 0.04
mixture-4-volumes-5     plane0,plane60,sphere,disc,statue        ketchup                 rr 0.06
mixture-4-volumes-5     all                                      all                     fetches 18
mixture-4-volumes-5     all                                      all                     below samples-16
'

measure_begin out/methods exact "$@"

# render OUT SCENE-ROW... : the arguments that all pictures to compare share.
render() {
    local out=$1 mesh=$3 light=$4 camera=$5 map=$6
    shift 7
    "$marmor" render -q -o "$out" "$(mesh_of "$mesh")" --light="$light" --camera="$camera" \
        --light-map "$map" --size 200x150 --specular off --single off --jitter off "$@"
}

# ---------------------------------------------------------------- exact pictures

# Those that are missing: a material before each row of a scene.
missing=$(rows "$materials" | while read -r material; do
    rows "$scenes" | while read -r name rest; do
        [ -e "$folder/exact/$name-$material.exr" ] || printf '%s %s %s\n' "$material" "$name" "$rest"
    done
done)
if [ -n "$missing" ]; then
    count=$(printf '%s\n' "$missing" | wc -l)
    all=$(printf '%s\n' "$missing" | awk '{ sum += $NF } END { print sum }')
    say "exact: $((count)) pictures to render, about $((all / 60 + 1)) min on 2 idle cores"
    done_count=0 done_cost=0 start=$SECONDS
    while read -r material name mesh light camera map cost; do
        render "$folder/exact.part.exr" "$name" "$mesh" "$light" "$camera" "$map" "$cost" \
            --material "$material" --multiple exact </dev/null
        mv "$folder/exact.part.exr" "$folder/exact/$name-$material.exr"
        done_count=$((done_count + 1)) done_cost=$((done_cost + cost))
        say "exact: $done_count of $((count)), $name in $material; $(python3 scripts/methods.py \
            left "$done_cost" "$all" $((SECONDS - start)))"
    done <<MISSING
$missing
MISSING
fi

# ------------------------------------------------------------------------- plans

# measure MATERIAL SCENE-ROW... : every plan of one scene in one material.
measure() {
    local material=$1 name=$2 plan arguments stem
    shift
    rows "$plans" | while read -r plan _ _ _ arguments; do
        stem=$folder/plans/$name-$material-$plan
        # shellcheck disable=SC2086 # the arguments are meant to split
        render "$stem.exr" "$@" --material "$material" $arguments --stats "$stem.stats.json" </dev/null
        "$marmor" compare "$folder/exact/$name-$material.exr" "$stem.exr" --json >"$stem.rr.json" </dev/null
        rm -f "$stem.exr"
    done
}

rows "$materials" | while read -r material; do
    rows "$scenes" | while read -r name mesh light camera map cost; do
        measure "$material" "$name" "$mesh" "$light" "$camera" "$map" "$cost" </dev/null
        say "plans: $name in $material"
    done
done

# ------------------------------------------------------------------------- times

# All plans in turn, three times: the report takes the least, since other work only ever adds. With jitter, so that
# the light map moves and each frame draws it.
for round in 1 2 3; do
    rows "$plans" | while read -r plan _ _ _ arguments; do
        # shellcheck disable=SC2086 # the arguments are meant to split
        "$marmor" render -q -o "$folder/timed.exr" --size 800x600 --specular off --single off --jitter all \
            --frames-averaged 24 --stats "$folder/times/$plan.$round.json" $arguments </dev/null
    done
    say "times: round $round of 3"
done
rm -f "$folder/timed.exr"

# ---------------------------------------------------------------------- pictures

# exact | method | difference of the statue's upper half, in marble. The difference of two PNGs
# is good to half a step in 255, which is enough to look at.
shot() {
    "$marmor" render -q -o "$1" --camera=-28,8,125 --size 200x200 --specular off --single off \
        --jitter off --exposure 1 "${@:2}"
}

mkdir -p docs/images
if [ ! -e "$folder/exact/shot.png" ]; then
    say 'exact: the picture for the pages, 2 to 3 min on 2 cores'
    shot "$folder/shot.part.png" --multiple exact
    mv "$folder/shot.part.png" "$folder/exact/shot.png"
fi
while read -r method arguments; do
    # shellcheck disable=SC2086 # the arguments are meant to split
    shot "$folder/pictures/$method.png" --multiple $arguments </dev/null
    "$marmor" compare "$folder/exact/shot.png" "$folder/pictures/$method.png" \
        --map "$folder/pictures/$method-difference.png" >/dev/null </dev/null
    python3 scripts/methods.py picture "docs/images/method-$method.png" "$folder/exact/shot.png" \
        "$folder/pictures/$method.png" "$folder/pictures/$method-difference.png"
done <<'SHOTS'
samples samples --samples 30
rings rings --rings 8
mixture mixture --moments 3
mixture-volumes mixture --moments 3 --volumes 5
SHOTS

python3 scripts/methods.py report "$folder" docs
