#!/usr/bin/env python3
"""The report of scripts/single.sh: tables, a plot and bounds; exit status 1 if a bound does not hold.

single.py FOLDER DOCS

FOLDER is the script's work folder; DOCS is where results go.
"""

import json
import pathlib
import sys

import methods

FAMILIES = {"linear": "bilinear tap", "nearest": "nearest texel", "depth": "depth buffer"}


class Results(methods.Results):
    """Those of scripts/single.sh; a scene has its reference as the second column."""

    def __init__(self, folder):
        super().__init__(folder)
        self.light_map = {row[0]: row[5] for row in methods.table(folder / "scenes.txt")}
        for key in self.fetches:
            stats = folder / "plans" / f"{key[0]}-{key[1]}-{key[2]}.stats.json"
            terms = [t for p in json.loads(stats.read_text(encoding="utf-8"))["fetches"]["passes"] for t in p["terms"]]
            self.fetches[key] = sum(t["per_pixel"] for t in terms if t["term"] == "single")


def plot(results, path, material):
    """Error against samples, one panel a scene."""
    # The families of the plot, in place of those of scripts/methods.py.
    methods.FAMILIES = FAMILIES
    methods.COLOURS = {"linear": "#c8501e", "nearest": "#2f6fb0", "depth": "#6a6a6a"}
    methods.TRAILS = tuple(FAMILIES)
    keys = list(results.rr)
    x_range = methods.log_range([results.fetches[k] for k in keys], 10)
    y_range = methods.log_range([results.rr[k] for k in keys if k[1] == material], 3)
    columns, wide, tall = 4, 310, 290
    rows = -(-len(results.scenes) // columns)
    body = methods.legend(60, 22)
    body.append(f'<text x="{columns * wide + 10}" y="26" text-anchor="end" fill="#444">{material}, 200×150</text>')
    for i, scene in enumerate(results.scenes):
        x, y = 60 + wide * (i % columns), 60 + tall * (i // columns)
        points = [
            (results.family(p), results.fetches[(scene, material, p)], results.rr[(scene, material, p)], results.point(p))
            for p in results.plans
            if (scene, material, p) in results.rr
        ]
        map_side = results.light_map[scene]
        title = scene if scene.endswith(map_side) else f"{scene}, {map_side}²"
        y_title = "" if i % columns else "error rr against rays"
        frame = (x, y, x + wide - 45, y + tall - 65)
        body += methods.panel(title, points, frame, x_range, y_range, "samples, each a fetch", y_title)
    methods.write_svg(path, columns * wide + 25, rows * tall + 45, "Error against samples", body)


def times(results, plans):
    names = ["light", "back", "view", "shade", "resolve"]
    rows = [
        [results.label(plan)] + [f"{results.times[plan].get(name, 0):.1f}" for name in names]
        for plan in plans
        if plan in results.times
    ]
    return methods.markdown(["ms"] + names, rows)


def main(folder, docs):
    folder, docs = pathlib.Path(folder), pathlib.Path(docs)
    results = Results(folder)
    bounds, held = methods.check(results, methods.table(folder / "bounds.txt"))
    text = [
        "# Measured: single scattering",
        "Written by `scripts/single.sh`; do not edit. How to read it: [single](../methods/single.md).",
        methods.header(results),
        "## Error",
        "rr of single scattering alone against `--single traced`, one frame at 200×150, `--specular off --multiple none "
        "--jitter off`. The light map has 512² texels, but 1024² for `disc-1024`, `statue-1024`, `statue-front`, `statue-back`. A `sphere` "
        "of radius 20 mm, lit as the statue is and from the `side`; a `disc` of that radius, 2 mm thick, lit from the `front` "
        "and from behind; the `statue` in the default light, from the `front`, and from the `back`.",
        "![Error against samples](../images/error-single.svg)",
    ]
    for material in results.materials:
        rows = [
            [results.label(plan)] + [methods.number(results.rr[(scene, material, plan)]) for scene in results.scenes]
            for plan in results.plans
        ]
        text += [f"### {material}", methods.markdown(["rr"] + results.scenes, rows)]
    text += [
        "## Time",
        "The statue in marble at 800×600, single scattering alone, mean of 24 frames, ms; of these the least of 3 runs, in which "
        "the plans took turns. Of `shade` 1.5 ms are shading without any scattering.",
        times(results, results.plans),
        "## Bounds",
        methods.markdown(["what must hold", "bound", "worst", ""], bounds, "---"),
    ]
    (docs / "images").mkdir(parents=True, exist_ok=True)
    (docs / "results").mkdir(parents=True, exist_ok=True)
    plot(results, docs / "images" / "error-single.svg", "marble")
    page = "\n\n".join(text) + "\n"
    (docs / "results" / "single.md").write_text(page, encoding="utf-8")
    lines = ["scene,light_map,material,plan,fetches,rr"]
    lines += [f"{s},{results.light_map[s]},{m},{p},{results.fetches[(s, m, p)]},{rr:.6f}" for (s, m, p), rr in results.rr.items()]
    (docs / "results" / "single.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    columns = [s for s in results.scenes if s not in ("sphere-side", "disc-1024", "statue-front")]
    rows = []
    for plan in results.plans:
        errors = [methods.number(results.rr[(s, "marble", plan)]) for s in columns]
        shade = results.times.get(plan, {}).get("shade")
        rows.append([results.label(plan)] + errors + ["–" if shade is None else f"{shade:.1f}"])
    methods.fill(docs / "methods" / "single.md", "single", methods.markdown(["marble: rr"] + columns + ["shade, ms"], rows))
    print(page)
    print(f"marmor: written to {docs}/results and {docs}/images")
    return 0 if held else 1


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    raise SystemExit(main(*sys.argv[1:]))
