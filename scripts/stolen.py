#!/usr/bin/env python3
"""Copies what marmor says at -vv, and adds to each slow frame how long the host had each of the CPUs meanwhile.

The host of a virtual machine may run others on its CPUs (`steal` in /proc/stat, proc(5)). What that takes is time of the
clock, and none of the program's: on a machine of its own it is 0.
"""

import collections
import os
import re
import sys
import threading
import time

INTERVAL = 0.02  # s
TICKS = os.sysconf("SC_CLK_TCK")  # a second


def stolen():
    """Milliseconds that the host had of each CPU since the machine started."""
    with open("/proc/stat", encoding="ascii") as stat:
        lines = [line.split() for line in stat if re.match(r"cpu\d", line)]
    return [1e3 * int(line[8]) / TICKS for line in lines]


# The time (s), and what was stolen until then (ms), of the last minute.
samples = collections.deque([(time.monotonic(), stolen())], maxlen=int(60 / INTERVAL))


def sample():
    while True:
        time.sleep(INTERVAL)
        samples.append((time.monotonic(), stolen()))


threading.Thread(target=sample, daemon=True).start()
for line in sys.stdin:
    slow = re.search(r"was slow: (\d+) ms", line)
    if slow:
        begin = time.monotonic() - int(slow[1]) / 1e3
        samples.append((time.monotonic(), stolen()))
        within = [taken for at, taken in list(samples) if at >= begin]
        lost = [f"{now - then:.0f}" for then, now in zip(within[0], within[-1])]
        line = f"{line.rstrip()}; stolen of the CPUs: {', '.join(lost)} ms\n"
    sys.stdout.write(line)
    sys.stdout.flush()
