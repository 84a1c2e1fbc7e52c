#!/usr/bin/env bash
# The window under 30 minutes of scripted input: nothing leaks, and no frame takes longer than a second. What is done is
# drawn by chance from a fixed seed: drags of the camera, the light and the divider, the wheel, keys, sizes; in the second
# half the betta plays. It is done in rounds of about a minute that are all alike. Exits 1 where a bound does not hold.
#
# Memory is what the program and its driver have asked for and not given back, as jemalloc counts it. What the system says
# the process holds (VmRSS) is printed, too, but grows without a leak: glibc keeps holes where shaders were compiled, and a
# block of device memory counts as far as it was ever touched. lavapipe draws without threads of its own (LP_NUM_THREADS=0),
# since with them what is asked for goes up and down by more, and less regularly: that hides leaks.
#
# The bound is for the time of the clock. On a virtual machine that is the host's as well: what it took of the CPUs is printed
# beside each slow frame (stolen.py), and where it took much a run says nothing of the program: run it again.
#
#   scripts/view_soak.sh [MINUTES]
#   MARMOR_SOAK_VALIDATION=1 scripts/view_soak.sh 5
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$MARMOR_ROOT"

minutes=${1:-30}
case $minutes in
    '' | *[!0-9]* | 0) complain "usage: scripts/view_soak.sh [MINUTES]"; exit 2 ;;
esac
marmor_setup --test
build_marmor
marmor=$CARGO_TARGET_DIR/release/marmor
jemalloc=$(jemalloc_file)
folder=$(mktemp -d)
mkfifo "$folder/said"
server='' viewer='' listener=''
finish() {
    for process in $viewer $listener $server; do kill "$process" 2>/dev/null || true; done
    rm -rf "$folder"
}
trap finish EXIT

Xvfb -displayfd 1 -nolisten tcp -noreset -screen 0 1280x800x24 >"$folder/display" 2>/dev/null &
server=$!
for _ in $(seq 100); do
    [ ! -s "$folder/display" ] || break
    sleep 0.1
done
DISPLAY=:$(cat "$folder/display")
export DISPLAY
unset WAYLAND_DISPLAY WAYLAND_SOCKET

# Acts of a round.
ROUND=200
failed=0
between() { echo $(($1 + RANDOM % ($2 - $1 + 1))); }

# How often which key was pressed in this round.
declare -A pressed
press() {
    pressed[$1]=$((${pressed[$1]:-0} + 1))
    xdotool key "$1"
}

# What keys have changed is as it was at the start, and what comes is what came then.
new_round() {
    local key
    for key in s 1 2 c F1 space; do
        [ $((${pressed[$key]:-0} % 2)) -eq 0 ] || press "$key"
    done
    while [ $((${pressed[m]:-0} % 5)) -ne 0 ]; do press m; done
    xdotool windowsize "$window" 640 480
    lap
    memory
    pressed=()
    RANDOM=2007
}

# Each method in turn, without single scattering and with it, moving and still: more pipelines than are kept in reserve, so
# that each round has some made anew.
lap() {
    for _ in 1 2; do
        xdotool key 2
        for _ in $(seq 5); do
            xdotool key m sleep 0.4 mousemove 100 100 mousedown 1 mousemove_relative 5 3 sleep 0.2 mouseup 1 sleep 0.6
        done
    done
    sleep 2
}

# Notes what the viewer holds: bytes asked for, kB held, and what it says of its pipelines.
memory() {
    local asked held
    asked=$(sed -n 's/^Allocated: \([0-9]*\),.*/\1/p' "$folder/log" | tail -n 1)
    held=$(sed -n 's/^VmRSS:[[:space:]]*\([0-9]*\) kB/\1/p' "/proc/$viewer/status")
    printf '%s %s %s\n' "$asked" "$held" \
        "$(sed -n 's/.* \([0-9]* pipelines made.*\)/\1/p' "$folder/log" | tail -n 1)" >>"$folder/memory"
}

act() {
    local x y
    x=$(between 20 380) y=$(between 20 280)
    case $(between 1 40) in
        [1-9]) drag 1 "$x" "$y" ;;
        1[0-6]) drag 3 "$x" "$y" ;;
        17 | 18) drag 2 "$x" "$y" ;;
        # Wherever the divider stands, some of these meet it.
        19 | 2[0-2]) drag 1 $((200 + $(between -4 4))) "$y" ;;
        2[3-7]) xdotool mousemove "$x" "$y" click "$(between 4 5)" ;;
        28) press m ;;
        29 | 30) press s ;;
        31) press "$(between 1 2)" ;;
        # Without multiple scattering, and with it again.
        32) xdotool key 3 sleep 0.5 key 3 ;;
        33) xdotool key bracketleft sleep 0.5 key bracketright ;;
        34) press c ;;
        35) press F1 ;;
        36) press f ;;
        37 | 38) press "$1" ;;
        39) xdotool windowsize "$window" "$(between 480 800)" "$(between 320 500)" ;;
        40) sleep 2 ;;
    esac
}

# drag BUTTON X Y
drag() {
    xdotool mousemove "$2" "$3" mousedown "$1"
    for _ in $(seq 6); do
        xdotool mousemove_relative --sync -- "$(between 2 9)" "$(between -6 -2)" sleep 0.03
    done
    xdotool mouseup "$1"
}

# phase SECONDS KEY ARGUMENTS...: a window for so long, with KEY among what is pressed.
phase() {
    local seconds=$1 key=$2 acts=0 start status=0 closed
    shift 2
    say "view $*, $seconds s"
    python3 scripts/stolen.py <"$folder/said" >"$folder/log" &
    listener=$!
    # Its totals alone, after each 4 MiB that were asked for.
    LP_NUM_THREADS=${LP_NUM_THREADS:-0} MALLOC_CONF=stats_interval:4194304,stats_interval_opts:gmdablxeh LD_PRELOAD=$jemalloc \
        "$marmor" view "$@" -vv --in-motion half --frames-averaged 8 --saves "$folder" \
        ${MARMOR_SOAK_VALIDATION:+--validation} 2>"$folder/said" &
    viewer=$!
    window=$(timeout 60 xdotool search --sync --onlyvisible --name '^marmor$' | head -n 1)
    xdotool windowfocus --sync "$window"
    : >"$folder/memory"
    start=$SECONDS
    while [ $((SECONDS - start)) -lt "$seconds" ]; do
        if ! kill -0 "$viewer" 2>/dev/null; then
            wait "$listener" || true
            complain "the window has gone:"
            tail -n 5 "$folder/log" >&2
            wait "$viewer" || true
            viewer='' listener='' failed=1
            return
        fi
        [ $((acts % ROUND)) -ne 0 ] || new_round
        acts=$((acts + 1))
        act "$key"
    done
    xdotool windowfocus --sync "$window" key ctrl+q
    for _ in $(seq 60); do
        kill -0 "$viewer" 2>/dev/null || break
        sleep 1
    done
    kill "$viewer" 2>/dev/null || true
    wait "$viewer" || status=$?
    wait "$listener" || true
    viewer='' listener=''
    closed=$(grep -o 'closed: .*' "$folder/log" || true)
    say "${closed:-not closed}"
    python3 - "$folder/memory" "$folder/log" "$status" "$closed" "${MARMOR_SOAK_VALIDATION:-}" <<'CHECK' || failed=1
import re, statistics, sys
path, log, status, closed, validation = sys.argv[1:]
asked, held, tallies = [], [], []
for line in open(path):
    of_heap, of_system, tally = line.split(" ", 2)
    asked.append(int(of_heap) / 2**20)
    held.append(int(of_system) / 2**10)
    tallies.append(tally.strip())
print("MiB asked for:", " ".join(f"{x:.1f}" for x in asked))
print("MiB held:", " ".join(f"{x:.0f}" for x in held))
print("pipelines made:", " ".join(tally.split(" ")[0] for tally in tallies))
print("at the end:", tallies[-1] if tallies else "nothing")
faults = [] if status == "0" else [f"exit code {status}"]
counts = (re.match(r"Allocated: (\d+),", line) for line in open(log))
counts = [int(count[1]) / 2**20 for count in counts if count]
if validation:
    print("memory is not judged: the layer has its own")
elif len(asked) < 8:
    faults.append(f"{len(asked)} rounds are too few to see whether memory grows")
else:
    # After a quarter that warms up, the mean of the first half of what is left, and of the second: each of some rounds.
    begin = len(counts) // 4
    middle = (begin + len(counts)) // 2
    before, after = statistics.mean(counts[begin:middle]), statistics.mean(counts[middle:])
    print(f"asked for on average: {before:.1f}, then {after:.1f} MiB, at most 8 more")
    if after - before >= 8:
        faults.append(f"memory grows by {after - before:.1f} MiB")
said = re.search(r"the longest (\d+) ms, (\d+) validation", closed)
if not said:
    faults.append("it did not close by itself")
else:
    slow = [re.search(r"frame \d+.*was slow: (\d+) ms.*", line) for line in open(log)]
    slow = sorted((line for line in slow if line), key=lambda line: -int(line[1]))
    print("the slowest frames:", *(line[0] for line in slow[:5]), sep="\n  ")
    if int(said[1]) >= 1000:
        faults.append(f"a frame took {said[1]} ms")
    if said[2] != "0":
        faults.append(f"{said[2]} validation messages")
print("FAILED: " + ", ".join(faults) if faults else "ok")
sys.exit(bool(faults))
CHECK
}

phase $((30 * minutes)) p statue-5k --window 640x480 --multiple mixture
phase $((30 * minutes)) space betta --window 640x480 --multiple mixture
exit "$failed"
