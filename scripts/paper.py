"""The paper's table of a run of `marmor bench --only paper/`, as Markdown."""

import json
import sys

run = json.load(open(sys.argv[1]))
header = run["header"]
cases = {case["name"].removeprefix("paper/"): case for case in run["cases"]}
meshes = ["1K", "5K", "20K"]
methods = list(dict.fromkeys(name.split(", ", 1)[1] for name in cases))


def median(case, name):
    for item in case["passes"]:
        if item["pass"] == name:
            return item["time"]["median"]
    return 0.0


def floor(case):
    for item in case["passes"]:
        if item["pass"] == "shade":
            return item["time"]["median"] / item["floor"]
    return 0.0


print("# The paper's table")
print()
print(f"`scripts/paper.sh`, {header['date']}, commit {header['commit']}: {header['device']}, {header['driver']}, {header['cpu']}, "
      f"{header['cores']} cores; {run['frames']} frames a case.")
any_case = next(iter(cases.values()))
print(f"The statue close up at {any_case['size'][0]}x{any_case['size'][1]}, {100 * any_case['covered']:.0f} % covered, marble, "
      f"light map {any_case['light_map']}², light moving: everything is drawn in every frame.")
print()
print("| frames a second | " + " | ".join(f"{mesh} triangles" for mesh in meshes) + " | fetches | over rings |")
print("|---|" + "---:|" * (len(meshes) + 2))
base = cases["20K, rings 8 + single 8"]["wall"]["median"]
for method in methods:
    row = [cases[f"{mesh}, {method}"] for mesh in meshes]
    rates = " | ".join(f"{1000 / case['wall']['median']:.2f}" for case in row)
    print(f"| {method} | {rates} | {row[-1]['fetches']} | {base / row[-1]['wall']['median']:.2f} |")
print()
print("*Over rings*: frames a second with 20K triangles, over those of `rings 8 + single 8`.")
print()
passes = list(dict.fromkeys(item["pass"] for case in cases.values() for item in case["passes"]))
print("| 20K triangles, ms | " + " | ".join(passes) + " | frame | shade over its fetches alone |")
print("|---|" + "---:|" * (len(passes) + 2))
for method in methods:
    case = cases[f"20K, {method}"]
    times = " | ".join(f"{median(case, name):.1f}" if median(case, name) else "-" for name in passes)
    print(f"| {method} | {times} | {case['device']['median']:.1f} | {floor(case):.2f} |")
print()
print("The paper says 30 to 100 frames a second for 1K to 20K triangles by rings, on an nVidia G80 (2007), and 50 % fewer by 30 "
      "samples. Here samples fall further behind: R_d takes 18 exponentials a sample, which a CPU does not hide behind its fetches.")
