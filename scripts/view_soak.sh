#!/usr/bin/env bash
# The window under 30 minutes of scripted input: nothing leaks, and no frame takes longer than a second. What is done is
# drawn by chance from a fixed seed: drags of the camera, the light and the divider, the wheel, keys, sizes; in the second
# half the betta plays. Prints memory every 10 s; exits 1 where a bound does not hold.
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
folder=$(mktemp -d)
server='' viewer=''
finish() {
    for process in $viewer $server; do kill "$process" 2>/dev/null || true; done
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

failed=0
RANDOM=2007
between() { echo $(($1 + RANDOM % ($2 - $1 + 1))); }

# Another size is rare: each makes all images of the picture anew.
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
        28) xdotool key m ;;
        29 | 30) xdotool key s ;;
        31) xdotool key "$(between 1 3)" ;;
        32) xdotool key bracketleft ;;
        33) xdotool key bracketright ;;
        34) xdotool key c ;;
        35) xdotool key F1 ;;
        36) xdotool key f ;;
        37 | 38) xdotool key "$1" ;;
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
    local seconds=$1 key=$2 sampled=0 start status=0 closed
    shift 2
    say "view $*, $seconds s"
    "$marmor" view "$@" -vv --frames-averaged 8 --saves "$folder" \
        ${MARMOR_SOAK_VALIDATION:+--validation} 2>"$folder/log" &
    viewer=$!
    window=$(timeout 60 xdotool search --sync --onlyvisible --name '^marmor$' | head -n 1)
    xdotool windowfocus --sync "$window"
    : >"$folder/memory"
    start=$SECONDS
    while [ $((SECONDS - start)) -lt "$seconds" ]; do
        if ! kill -0 "$viewer" 2>/dev/null; then
            complain "the window has gone:"
            tail -n 5 "$folder/log" >&2
            wait "$viewer" || true
            viewer='' failed=1
            return
        fi
        act "$key"
        if [ $((SECONDS - start)) -ge "$sampled" ]; then
            sampled=$((SECONDS - start + 10))
            sed -n 's/^VmRSS:[[:space:]]*\([0-9]*\) kB/\1/p' "/proc/$viewer/status" >>"$folder/memory"
        fi
    done
    xdotool windowfocus --sync "$window" key ctrl+q
    for _ in $(seq 60); do
        kill -0 "$viewer" 2>/dev/null || break
        sleep 1
    done
    kill "$viewer" 2>/dev/null || true
    wait "$viewer" || status=$?
    viewer=''
    closed=$(grep -o 'closed: .*' "$folder/log" || true)
    say "${closed:-not closed}; the slowest frames:"
    { grep 'was slow: ' "$folder/log" || true; } | sed 's/^.*frame/frame/' | sort -t: -k2 -rn | head -n 5
    python3 - "$folder/memory" "$status" "$closed" <<'CHECK' || failed=1
import re, statistics, sys
path, status, closed = sys.argv[1:]
memory = [int(line) / 1024 for line in open(path)]
print("MiB:", " ".join(f"{x:.0f}" for x in memory))
faults = [] if status == "0" else [f"exit code {status}"]
fifth = len(memory) // 5
if fifth < 1:
    faults.append(f"{len(memory)} samples are too few to see whether memory grows")
else:
    # The first fifth is warm-up: every method and size is met for the first time there.
    before = statistics.median(memory[fifth:2 * fifth])
    after = statistics.median(memory[-fifth:])
    most = max(8, 0.03 * before)
    print(f"from {before:.1f} to {after:.1f} MiB, at most {most:.1f} more")
    if after - before >= most:
        faults.append(f"memory grows by {after - before:.1f} MiB")
said = re.search(r"the longest (\d+) ms, (\d+) validation", closed)
if not said:
    faults.append("it did not close by itself")
else:
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
