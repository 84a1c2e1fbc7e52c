#!/usr/bin/env python3
"""What scripts/methods.sh cannot say in bash: meshes, tables, plots and pictures.

methods.py meshes FOLDER           writes the test meshes
methods.py left DONE ALL SECONDS   prints how long the rest of ALL will take
methods.py picture OUT PNG...      joins PNGs side by side
methods.py report FOLDER DOCS      tables, plots and bounds; exit status 1 if a bound does not hold

FOLDER is the script's work folder; DOCS is where results go.
"""

import json
import math
import pathlib
import struct
import sys
import zlib

# ----------------------------------------------------------------- test meshes


def write_obj(path, positions, normals, faces):
    """Faces list (position, normal) pairs, counted from 0."""
    lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in positions]
    lines += [f"vn {x:.7g} {y:.7g} {z:.7g}" for x, y, z in normals]
    lines += ["f " + " ".join(f"{v + 1}//{n + 1}" for v, n in face) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def sphere(radius, stacks, slices):
    """Between the poles `stacks - 1` circles of `slices` vertices; smooth normals."""
    normals = [(0.0, 1.0, 0.0)]
    for i in range(1, stacks):
        polar = math.pi * i / stacks
        for j in range(slices):
            turn = 2 * math.pi * j / slices
            normals.append((math.sin(polar) * math.sin(turn), math.cos(polar), math.sin(polar) * math.cos(turn)))
    normals.append((0.0, -1.0, 0.0))

    def at(i, j):
        if i in (0, stacks):
            return 0 if i == 0 else len(normals) - 1
        return 1 + (i - 1) * slices + j % slices

    faces = []
    for i in range(stacks):
        for j in range(slices):
            corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
            for k in ((0, 1, 2), (0, 2, 3)):
                face = [corners[m] for m in k]
                if len(set(face)) == 3:
                    faces.append([(v, v) for v in face])
    return [tuple(radius * c for c in n) for n in normals], normals, faces


def disc(radius, thickness, slices):
    """Axis along z; the two faces and the rim have normals of their own."""
    half = thickness / 2
    positions = [(0, 0, half), (0, 0, -half)]
    normals = [(0, 0, 1), (0, 0, -1)]
    faces = []
    for j in range(slices):
        turn = 2 * math.pi * j / slices
        c, s = math.cos(turn), math.sin(turn)
        positions += [(radius * c, radius * s, half), (radius * c, radius * s, -half)]
        normals.append((c, s, 0))
    for j in range(slices):
        k = (j + 1) % slices
        front, back, front_next, back_next = 2 + 2 * j, 3 + 2 * j, 2 + 2 * k, 3 + 2 * k
        here, there = 2 + j, 2 + k
        faces.append([(0, 0), (front, 0), (front_next, 0)])
        faces.append([(1, 1), (back_next, 1), (back, 1)])
        faces.append([(front, here), (back, here), (back_next, there)])
        faces.append([(front, here), (back_next, there), (front_next, there)])
    return positions, normals, faces


def plane(side):
    h = side / 2
    corners = [(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)]
    return corners, [(0, 0, 1)], [[(0, 0), (1, 0), (2, 0)], [(0, 0), (2, 0), (3, 0)]]


def meshes(folder):
    folder = pathlib.Path(folder)
    write_obj(folder / "sphere.obj", *sphere(20, 100, 100))
    write_obj(folder / "disc.obj", *disc(20, 2, 256))
    write_obj(folder / "plane.obj", *plane(60))


# -------------------------------------------------------------------- pictures


GROUND = (64, 72, 80)


def read_png(path):
    """Rows of RGB pixels of an 8-bit PNG without interlace."""
    data = path.read_bytes()
    at, packed, header = 8, b"", None
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, depth, colour, _, _, interlace = header
    if depth != 8 or colour not in (2, 6) or interlace:
        raise SystemExit(f"{path}: only 8-bit RGB and RGBA without interlace can be joined")
    n = 3 if colour == 2 else 4
    raw, stride = zlib.decompress(packed), n * width
    rows, above = [], bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        method, row = raw[start], bytearray(raw[start + 1 : start + 1 + stride])
        for i in range(stride):
            a = row[i - n] if i >= n else 0
            b, c = above[i], above[i - n] if i >= n else 0
            if method == 1:
                row[i] = (row[i] + a) & 255
            elif method == 2:
                row[i] = (row[i] + b) & 255
            elif method == 3:
                row[i] = (row[i] + (a + b) // 2) & 255
            elif method == 4:
                p = a + b - c
                near = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                row[i] = (row[i] + near) & 255
        above = row
        rows.append([over_ground(row[n * x : n * x + n]) for x in range(width)])
    return rows


def over_ground(pixel):
    """Without its alpha. The ground is that of the maps that `marmor compare` draws."""
    if len(pixel) == 3:
        return bytes(pixel)
    return bytes((c * pixel[3] + g * (255 - pixel[3]) + 127) // 255 for c, g in zip(pixel, GROUND))


def write_png(path, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    raw = b"".join(b"\0" + b"".join(row) for row in rows)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def picture(out, *sources):
    """Side by side; those less high than the highest stand at the top."""
    pictures = [read_png(pathlib.Path(p)) for p in sources]
    gap = [b"\xff\xff\xff"] * 6
    rows = []
    for y in range(max(len(p) for p in pictures)):
        row = []
        for k, p in enumerate(pictures):
            row += (gap if k else []) + (p[y] if y < len(p) else [b"\xff\xff\xff"] * len(p[0]))
        rows.append(row)
    write_png(pathlib.Path(out), rows)


# --------------------------------------------------------------------- results

COLOURS = {"samples": "#1f6fb4", "rings": "#c43c39", "mixture-3": "#1b8a3a", "mixture-4": "#7b3fa0", "volumes": "#b07d10"}
FAMILIES = {"samples": "samples", "rings": "rings", "mixture-3": "mixture, 3 moments", "mixture-4": "mixture, 4 moments", "volumes": "mixture with volumes"}
# Whose points are joined.
TRAILS = ("samples", "rings")


def table(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    return [line.split() for line in lines if line.strip() and not line.startswith("#")]


def shade_fetches(stats):
    """Fetches of the multiple term in the pass that shades."""
    return sum(
        term["per_pixel"]
        for p in stats["fetches"]["passes"]
        if p["pass"] == "shade"
        for term in p["terms"]
        if term["term"] == "multiple"
    )


class Results:
    def __init__(self, folder):
        self.folder = folder
        self.scenes = [row[0] for row in table(folder / "scenes.txt")]
        self.light_map = {row[0]: row[4] for row in table(folder / "scenes.txt")}
        self.materials = [row[0] for row in table(folder / "materials.txt")]
        self.plans = {row[0]: row for row in table(folder / "plans.txt")}
        self.rr, self.fetches, self.times = {}, {}, {}
        for scene in self.scenes:
            for material in self.materials:
                for plan in self.plans:
                    stem = folder / "plans" / f"{scene}-{material}-{plan}"
                    result = stem.with_suffix(".rr.json")
                    if result.exists():
                        key = (scene, material, plan)
                        self.rr[key] = json.loads(result.read_text(encoding="utf-8"))["rr"]
                        self.stats = json.loads(stem.with_suffix(".stats.json").read_text(encoding="utf-8"))
                        self.fetches[key] = shade_fetches(self.stats)
        rounds = {}
        for path in sorted((folder / "times").glob("*.json")):
            plan = path.stem.rsplit(".", 1)[0]
            for p in json.loads(path.read_text(encoding="utf-8"))["times"]["passes"]:
                rounds.setdefault((plan, p["pass"]), []).append(p["milliseconds"])
        # Other work only ever adds: the least is nearest to the truth.
        for (plan, name), values in rounds.items():
            self.times.setdefault(plan, {})[name] = min(values)

    def family(self, plan):
        return self.plans[plan][1]

    def label(self, plan):
        """The words of a table's row."""
        return self.plans[plan][2].replace("_", " ")

    def point(self, plan):
        """The short word beside a point of a plot; empty where the plot leaves it out."""
        word = self.plans[plan][3]
        return "" if word == "-" else word.replace("_", " ")

    def cell(self, scene, material, plan):
        key = (scene, material, plan)
        return f"{number(self.rr[key])} ({self.fetches[key]})" if key in self.rr else "–"

    def mean(self, plan, material):
        """Geometric mean over the scenes with the common light map."""
        values = [self.rr.get((s, material, plan)) for s in self.scenes if self.light_map[s] == self.light_map[self.scenes[0]]]
        if not values or None in values:
            return None
        return math.exp(sum(math.log(max(v, 1e-9)) for v in values) / len(values))


def number(value):
    return f"{value:.4f}" if value < 0.1 else f"{value:.3f}"


def markdown(head, rows, align="---:"):
    lines = ["| " + " | ".join(head) + " |", "|---" + f"|{align}" * (len(head) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


# ---------------------------------------------------------------------- bounds


def listed(word, everything):
    return everything if word == "all" else [w for w in word.split(",") if w in everything]


def check(results, bounds):
    """Rows (what, bound, found, verdict) of each bound, and whether all hold."""
    rows = []
    for plan, scenes, materials, kind, *limit in bounds:
        if plan not in results.plans:
            continue
        found = []
        if kind == "shade-ratio":
            other, least = limit
            if plan in results.times and other in results.times:
                ratio = results.times[other]["shade"] / results.times[plan]["shade"]
                verdict = "pass" if ratio >= float(least) else "**FAIL**"
                what = f"shade time of {results.label(other)} over that of {results.label(plan)}"
                rows.append((what, f"at least {least}", f"{ratio:.1f}", verdict))
            continue
        for material in listed(materials, results.materials):
            for scene in listed(scenes, results.scenes):
                key = (scene, material, plan)
                if key not in results.rr:
                    continue
                if kind == "below":
                    other = results.rr.get((scene, material, limit[0]))
                    if other is not None:
                        found.append((results.rr[key] / other, f"{material}, {scene}"))
                else:
                    value = results.rr[key] if kind == "rr" else results.fetches[key]
                    found.append((value, f"{material}, {scene}"))
        if not found:
            continue
        most = 1.0 if kind == "below" else float(limit[0])
        failing = [(v, where) for v, where in found if v > most or (kind == "below" and v == most)]
        where = f"{results.label(plan)}; {scenes.replace(',', ', ')}; {materials.replace(',', ', ')}"
        shown = (lambda v: f"{v:g}") if kind == "fetches" else number
        if kind == "below":
            what, bound = f"rr over that of {results.label(limit[0])}: {where}", "below 1"
        elif kind == "rr":
            what, bound = f"rr: {where}", f"at most {limit[0]}"
        else:
            what, bound = f"fetches: {where}", f"at most {limit[0]}"
        worst, place = max(found)
        rows.append((what, bound, f"{shown(worst)} ({place})", "**FAIL**" if failing else "pass"))
        for value, place in sorted(failing, reverse=True):
            print(f"marmor: FAIL {what}: {shown(value)} on {place}, {bound}")
    return rows, not any("FAIL" in row[3] for row in rows)


# ----------------------------------------------------------------------- plots


def escape(text):
    return text.replace("&", "&amp;").replace("<", "&lt;")


def marker(family, x, y):
    colour = COLOURS[family]
    if family == "samples":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>'
    if family == "rings":
        return f'<rect x="{x - 3.6:.1f}" y="{y - 3.6:.1f}" width="7.2" height="7.2" fill="{colour}"/>'
    if family == "volumes":
        return f'<path d="M{x:.1f} {y - 5.2:.1f}l5.2 5.2l-5.2 5.2l-5.2 -5.2z" fill="{colour}"/>'
    up = family == "mixture-3"
    dy = -5 if up else 5
    points = f"{x:.1f},{y + dy:.1f} {x - 4.8:.1f},{y - 0.7 * dy:.1f} {x + 4.8:.1f},{y - 0.7 * dy:.1f}"
    return f'<polygon points="{points}" fill="{colour}"/>'


def ticks(low, high):
    """1, 2, 5 of each decade within the range, or 1 alone where there are many."""
    found = []
    steps = (1, 2, 5) if high / low < 300 else (1,)
    for exponent in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        found += [m * 10.0**exponent for m in steps if low <= m * 10.0**exponent <= high * 1.0001]
    return found


def place_label(text, x, y, taken, frame):
    """A corner beside (x, y) where the text meets no other label or marker, or None."""
    width, height = 5.4 * len(text) + 2, 11
    x0, y0, x1, y1 = frame
    for reach in (6, 8, 10, 15, 22, 30):
        for dx, dy in ((1, 0), (-1, 0), (0, -1), (0, 1), (1, -1), (-1, -1), (1, 1), (-1, 1)):
            left = x + dx * reach - (width if dx < 0 else width / 2 if dx == 0 else 0)
            top = y + dy * (reach - 1) - (height if dy < 0 else height / 2 if dy == 0 else 0)
            box = (left, top, left + width, top + height)
            if left < x0 or top < y0 or box[2] > x1 or box[3] > y1:
                continue
            if all(box[2] <= b[0] or box[0] >= b[2] or box[3] <= b[1] or box[1] >= b[3] for b in taken):
                taken.append(box)
                return left + 1, top + 9
    return None


def panel(title, points, frame, x_range, y_range, x_title, y_title):
    """Points are (family, x, y, label); both axes are logarithmic."""
    left, top, right, bottom = frame
    across = lambda v: left + (right - left) * math.log(v / x_range[0]) / math.log(x_range[1] / x_range[0])
    down = lambda v: bottom - (bottom - top) * math.log(v / y_range[0]) / math.log(y_range[1] / y_range[0])
    svg = [f'<text x="{(left + right) / 2:.0f}" y="{top - 8}" text-anchor="middle" font-size="13" font-weight="bold">{escape(title)}</text>']
    for v in ticks(*x_range):
        svg.append(f'<line x1="{across(v):.1f}" y1="{top}" x2="{across(v):.1f}" y2="{bottom}" stroke="#e4e4e4"/>')
        svg.append(f'<text x="{across(v):.1f}" y="{bottom + 14}" text-anchor="middle" fill="#444">{v:g}</text>')
    for v in ticks(*y_range):
        svg.append(f'<line x1="{left}" y1="{down(v):.1f}" x2="{right}" y2="{down(v):.1f}" stroke="#e4e4e4"/>')
        svg.append(f'<text x="{left - 5}" y="{down(v) + 4:.1f}" text-anchor="end" fill="#444">{v:g}</text>')
    svg.append(f'<rect x="{left}" y="{top}" width="{right - left}" height="{bottom - top}" fill="none" stroke="#888"/>')
    svg.append(f'<text x="{(left + right) / 2:.0f}" y="{bottom + 29}" text-anchor="middle">{escape(x_title)}</text>')
    if y_title:
        middle = (top + bottom) / 2
        svg.append(f'<text transform="translate({left - 42} {middle:.0f}) rotate(-90)" text-anchor="middle">{escape(y_title)}</text>')
    placed = [(f, across(x), down(min(max(y, y_range[0]), y_range[1])), t) for f, x, y, t in points]
    taken = [(x - 5, y - 5, x + 5, y + 5) for _, x, y, _ in placed]
    for family in COLOURS:
        trail = sorted((x, y) for f, x, y, _ in placed if f == family)
        if family in TRAILS and len(trail) > 1:
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in trail)
            svg.append(f'<polyline points="{path}" fill="none" stroke="{COLOURS[family]}" stroke-opacity="0.4"/>')
    for family, x, y, text in placed:
        svg.append(marker(family, x, y))
        spot = place_label(text, x, y, taken, frame)
        if spot:
            svg.append(f'<text x="{spot[0]:.1f}" y="{spot[1]:.1f}" fill="{COLOURS[family]}" font-size="10">{escape(text)}</text>')
    return svg


def legend(x, y):
    svg = []
    for family, words in FAMILIES.items():
        svg.append(marker(family, x, y))
        svg.append(f'<text x="{x + 10}" y="{y + 4}">{words}</text>')
        x += 40 + 6.4 * len(words)
    return svg


def write_svg(path, width, height, title, body):
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'font-family="Helvetica, Arial, sans-serif" font-size="11" fill="#111" stroke="none">\n<title>{escape(title)}</title>\n'
        f'<rect width="{width}" height="{height}" fill="#fff"/>\n'
    )
    path.write_text(head + "\n".join(body) + "\n</svg>\n", encoding="utf-8")


def log_range(values, steps):
    """The range in which the values lie, with room for markers, ended at steps of a decade."""
    low, high = math.log10(min(values) / 1.15), math.log10(max(values) * 1.15)
    return 10 ** (math.floor(low * steps) / steps), 10 ** (math.ceil(high * steps) / steps)


def plot_fetches(results, path, material):
    """One panel a scene."""
    shown = [p for p in results.plans if results.point(p)]
    keys = [(s, material, p) for s in results.scenes for p in shown if (s, material, p) in results.rr]
    x_range = log_range([results.fetches[k] for k in keys], 10)
    y_range = log_range([results.rr[k] for k in keys], 3)
    columns = min(4, len(results.scenes))
    rows = -(-len(results.scenes) // columns)
    wide, tall = 310, 290
    body = legend(60, 22)
    body.append(f'<text x="{columns * wide + 10}" y="26" text-anchor="end" fill="#444">{material}, 200×150</text>')
    for i, scene in enumerate(results.scenes):
        x, y = 60 + wide * (i % columns), 60 + tall * (i // columns)
        points = [
            (results.family(p), results.fetches[(scene, material, p)], results.rr[(scene, material, p)], results.point(p))
            for p in shown
            if (scene, material, p) in results.rr
        ]
        title = f"{scene}" if scene.endswith(results.light_map[scene]) else f"{scene}, {results.light_map[scene]}²"
        y_title = "" if i % columns else "error rr against exact"
        body += panel(title, points, (x, y, x + wide - 45, y + tall - 65), x_range, y_range, "fetches a pixel", y_title)
    write_svg(path, columns * wide + 25, rows * tall + 45, "Error against fetches", body)


def plot_times(results, path, scene, material):
    points = []
    for plan in results.plans:
        key = (scene, material, plan)
        if key in results.rr and plan in results.times and results.point(plan):
            points.append((results.family(plan), results.times[plan]["shade"], results.rr[key], results.point(plan)))
    if not points:
        return False
    x_range, y_range = log_range([p[1] for p in points], 5), log_range([p[2] for p in points], 5)
    body = legend(60, 22)
    title = f"{scene}, {material}: error at 200×150, shade time at 800×600"
    body += panel(title, points, (65, 65, 695, 440), x_range, y_range, "time of the shade pass, ms", "error rr against exact")
    write_svg(path, 720, 485, "Error against time", body)
    return True


# ---------------------------------------------------------------------- report


def header(results):
    facts = dict(row.split("=", 1) for row in (results.folder / "facts.txt").read_text(encoding="utf-8").splitlines())
    device = results.stats["device"]
    rows = [
        ("device", device["name"]),
        ("driver", device["driver"]),
        ("cores", facts["cores"]),
        ("commit", facts["commit"]),
        ("run", facts["run"]),
    ]
    return markdown(["", "measured with"], rows, "---")


def time_table(results, plans):
    names = ["light", "reduce", "boxes", "volume", "view", "shade", "resolve"]
    rows = []
    for plan in plans:
        if plan in results.times:
            t = results.times[plan]
            row = [f"{t[n]:.1f}" if n in t else "–" for n in names]
            rows.append([results.label(plan)] + row + [f"{sum(t.get(n, 0) for n in names):.1f}"])
    return markdown(["ms"] + names + ["sum"], rows) if rows else "Not timed."


def method_table(results, families, material="marble"):
    """The short table of a method's page."""
    columns = [s for s in results.scenes if s in ("plane0", "plane60", "sphere", "disc", "statue", "statue-back")]
    rows = []
    for plan in results.plans:
        if results.family(plan) not in families or ("statue", material, plan) not in results.rr:
            continue
        times = results.times.get(plan, {})
        reduction = times.get("reduce", times.get("boxes"))
        parts = [times.get("shade"), reduction] + ([times.get("volume")] if "volumes" in families else [])
        costs = ["–" if t is None else f"{t:.1f}" for t in parts]
        errors = [number(results.rr[(s, material, plan)]) for s in columns]
        rows.append([results.label(plan), str(results.fetches[("statue", material, plan)])] + errors + costs)
    costs = ["shade, ms", "pyramid, ms"] + (["volumes, ms"] if "volumes" in families else [])
    return markdown([f"{material}: rr", "fetches"] + columns + costs, rows)


def fill(page, name, content):
    """Replaces what stands between the page's markers of this name."""
    text = page.read_text(encoding="utf-8")
    begin, end = f"<!-- table: {name} -->", f"<!-- end: {name} -->"
    if begin not in text or end not in text:
        raise SystemExit(f"{page}: the markers {begin} and {end} are missing")
    before, rest = text.split(begin, 1)
    page.write_text(f"{before}{begin}\n\n{content}\n\n{end}{rest.split(end, 1)[1]}", encoding="utf-8")


def report(folder, docs):
    folder = pathlib.Path(folder)
    results = Results(folder)
    docs = pathlib.Path(docs)
    for part in ("results", "images"):
        (docs / part).mkdir(parents=True, exist_ok=True)

    bounds, held = check(results, table(folder / "bounds.txt"))
    key_plans = ["samples-30", "rings-8", "mixture-3", "mixture-4", "mixture-3-volumes-5"]
    text = [
        "# Measured: error, fetches and time of the methods",
        "Written by `scripts/methods.sh`; do not edit. How to read it: [samples](../methods/samples.md), "
        "[rings](../methods/rings.md), [mixture](../methods/mixture.md).",
        header(results),
        "## Error",
        "rr of the multiple term alone against `exact`, one frame at 200×150, `--specular off --single off --jitter off`; "
        "in parentheses the fetches a pixel that `--stats` lists for this term. The light map has 512² texels, except where "
        "the scene's name says 1024. Scenes: `plane0` is lit straight on, `plane60` at 60°, both seen straight on, without "
        "their edges; a `sphere` of radius 20 mm; a `disc` of that radius, 2 mm thick, lit from behind; the `statue` in the "
        "default light, lit from the `front`, and from the `back`. `samples` is one noisy frame: other seeds would differ in "
        "the second figure.",
        "![Error against fetches](../images/error-fetches.svg)",
    ]
    for material in results.materials:
        rows = [
            [results.label(plan)] + [results.cell(scene, material, plan) for scene in results.scenes]
            for plan in results.plans
            if any((scene, material, plan) in results.rr for scene in results.scenes)
        ]
        text += [f"### {material}", markdown(["plan"] + results.scenes, rows)]
    rows = []
    for plan in results.plans:
        means = [results.mean(plan, material) for material in results.materials]
        if all(m is not None for m in means):
            rows.append([results.label(plan)] + [number(m) for m in means])
    text += [f"### Geometric mean over the scenes at {results.light_map[results.scenes[0]]}²", markdown(["plan"] + results.materials, rows)]
    text += [
        "## Time",
        "The statue in marble at 800×600, mean of 24 frames, ms; of these the least of 3 runs, in which the plans took turns. "
        "Passes are drained around their stamps, which costs a little; other work on the machine costs more, so compare ratios "
        "and not digits.",
        time_table(results, key_plans),
        "### Every plan",
        time_table(results, list(results.plans)),
    ]
    if plot_times(results, docs / "images" / "time-error.svg", "statue", "marble"):
        text.append("![Error against shade time](../images/time-error.svg)")
    text += ["## Bounds", markdown(["what must hold", "bound", "worst", ""], bounds, "---")]
    plot_fetches(results, docs / "images" / "error-fetches.svg", "marble")
    page = "\n\n".join(text) + "\n"
    (docs / "results" / "methods.md").write_text(page, encoding="utf-8")
    lines = ["scene,light_map,material,plan,fetches,rr"]
    lines += [f"{s},{results.light_map[s]},{m},{p},{results.fetches[(s, m, p)]},{rr:.6f}" for (s, m, p), rr in results.rr.items()]
    (docs / "results" / "methods.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for method, families in (("samples", ["samples"]), ("rings", ["rings"]), ("mixture", ["mixture-3", "mixture-4", "volumes"])):
        fill(docs / "methods" / f"{method}.md", method, method_table(results, families))
    print(page)
    print(f"marmor: written to {docs}/results and {docs}/images")
    return 0 if held else 1


def left(done, everything, seconds):
    rest = float(seconds) * (float(everything) / float(done) - 1) if float(done) else 0
    print(f"{rest / 60:.0f} min left" if rest > 90 else f"{rest:.0f} s left")


if __name__ == "__main__":
    commands = {"meshes": meshes, "left": left, "picture": picture, "report": report}
    if len(sys.argv) < 2 or sys.argv[1] not in commands:
        raise SystemExit(__doc__)
    raise SystemExit(commands[sys.argv[1]](*sys.argv[2:]))
