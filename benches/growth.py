#!/usr/bin/env python3
"""How rayo's time and memory grow: with triangles, instances, lights, pixels, bounces and threads.

    python3 benches/growth.py             everything, up to ten million triangles: ten minutes or so
    python3 benches/growth.py --quick     smaller ends, each once: a minute

Needs numpy and matplotlib. Scenes are made here, from fixed seeds. Writes growth.md, growth.json and a plot for each.
docs/performance.md says how to read them.
"""

import argparse
import datetime
import json
import math
import os
import platform
import re
import struct
import subprocess
import sys
from pathlib import Path
from statistics import median

try:
    import matplotlib
    import numpy
except ImportError as missing:
    sys.exit(f"{missing}: pip install numpy matplotlib, or use the Python of benches/peers (target/bench-peers/venv/bin/python)")

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # the backend comes first
from matplotlib.ticker import FuncFormatter, NullFormatter

ROOT = Path(__file__).resolve().parent.parent
SEED = 17
FITTED = 3  # points at the large end
SERIES = {
    "load": ("load", "#8a8a8a"),
    "build": ("build", "#2f6fc8"),
    "render": ("render", "#c8402f"),
    # of all threads, for the whole process: as good as the same on a busy machine
    "cpu": ("processor", "#3c9a5f"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("axes", nargs="*", metavar="AXIS", help="some of " + ", ".join(AXES) + "; default: all")
    parser.add_argument("--output", type=Path, default=ROOT / "target/bench-growth", metavar="FOLDER")
    parser.add_argument("--rayo", type=Path, metavar="FILE", help="binary; default: built here with --release")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--repeat", type=int, help="how often; default: 3 (quick: 1)")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    if unknown := set(options.axes) - set(AXES):
        parser.error(f"unknown: {', '.join(unknown)}")
    if not options.rayo:
        subprocess.run(["cargo", "build", "--release", "--locked"], cwd=ROOT, check=True)
        options.rayo = ROOT / "target/release/rayo"
    options.repeat = options.repeat or (1 if options.quick else 3)
    options.output.mkdir(parents=True, exist_ok=True)
    file = options.output / "growth.json"
    # Axes that are not asked for again keep what they had.
    results = json.loads(file.read_text()) if file.is_file() else {}
    for name in options.axes or AXES:
        axis = AXES[name]
        points = [measure(options, axis, x) for x in axis.ends(options.quick, options)]
        results[name] = {
            "date": datetime.date.today().isoformat(),
            "quick": options.quick,
            "repeat": options.repeat,
            "threads": options.threads,
            "system": f"{processor()}, {platform.system()}",
            "points": points,
        }
        file.write_text(json.dumps(results, indent=1) + "\n")
    for name, result in results.items():
        plot(options.output, name, result["points"])
    (options.output / "growth.md").write_text(page(results))
    print(f"wrote {options.output}/growth.md and plots")


def measure(options, axis, x):
    """Medians over the repeats."""
    scene = options.output / "scene.toml"
    text, flags = axis.scene(options.output, x)
    scene.write_text(text)
    flags = {"threads": options.threads, **flags}
    runs = [run(options, scene, [f"--{key}={value}" for key, value in flags.items()]) for _ in range(options.repeat)]
    point = {"x": x} | {key: median(run[key] for run in runs) for key in runs[0]}
    seconds = " ".join(f"{key} {point[key]:.3f} s," for key in SERIES)
    print(f"{axis.title:24} {x:>10}: {seconds} {point['peak_bytes'] / 2**20:.0f} MiB", flush=True)
    return point


def run(options, scene, flags):
    picture, stats = options.output / "picture.exr", options.output / "stats.json"
    taken, log = options.output / "taken.json", options.output / "log.txt"
    spawn = [sys.executable, "-IS", ROOT / "benches/spawn.py", taken, log]
    command = [options.rayo.resolve(), "render", scene, "-q", "-o", picture, "--stats", stats, *flags]
    subprocess.run([str(part) for part in spawn + command], check=True)
    took = json.loads(taken.read_text())
    if took["exit"] != 0:
        sys.exit(f"rayo failed ({took['exit']}) on {scene}:\n{log.read_text()}")
    said = json.loads(stats.read_text())
    kinds = ("bvh_bytes", "geometry_bytes", "texture_bytes")
    return {
        **{key: said["seconds"][key] for key in ("load", "build", "render")},
        "cpu": took["cpu_seconds"],
        "process": took["seconds"],
        "peak_bytes": took["peak_bytes"],
        "kept_bytes": sum(said["scene"][kind] for kind in kinds) + said["film_bytes"],
    }


# What grows


class Axis:
    """`scene(folder, x)` gives the text of a scene file and flags; `allowed` says how fast it may grow."""

    def __init__(self, title, scene, full, quick, allowed):
        self.title, self.scene, self.full, self.quick, self.allowed = title, scene, full, quick, allowed

    def ends(self, quick, options):
        ends = self.quick if quick else self.full
        return ends(options) if callable(ends) else ends


SKY = """
[environment]
type = "gradient"
bottom = [0.6, 0.55, 0.5]
top = [0.5, 0.7, 1.0]
"""


def triangles(folder, count):
    """Hills, over which the camera looks."""
    side = max(1, round(math.sqrt(count / 2)))
    random = numpy.random.default_rng(SEED)
    s = numpy.linspace(-1, 1, side + 1, dtype=numpy.float32)
    x, z = numpy.meshgrid(s, s)
    y = 0.08 * numpy.sin(7 * x + 1) * numpy.cos(5 * z) + 0.03 * numpy.sin(19 * x * z + 3 * z)
    y += (0.5 / side) * random.random(y.shape, dtype=numpy.float32)
    positions = numpy.stack([x, y, z], -1).reshape(-1, 3).astype(numpy.float32)
    corner = (numpy.arange(side, dtype=numpy.uint32)[:, None] * (side + 1) + numpy.arange(side, dtype=numpy.uint32)).ravel()
    below = corner + side + 1
    cells = numpy.stack([corner, below, corner + 1, corner + 1, below, below + 1], -1)
    write_glb(folder / "mesh.glb", positions, cells.ravel())
    text = f"""{SKY}
[camera]
position = [0, 0.9, 2.1]
target = [0, -0.05, 0]
vfov = 42
[[model]]
file = "mesh.glb"
"""
    return text, {"size": "256x256", "samples": 8, "bounces": 4}


def instances(folder, count):
    """Balls of 960 triangles in a square, however many, seen whole."""
    side = math.ceil(math.sqrt(count))
    random = numpy.random.default_rng(SEED)
    number = numpy.arange(count)
    jitter = random.uniform(-0.2, 0.2, (count, 2))
    place = numpy.zeros((count, 3), numpy.float32)
    place[:, 0] = number % side + jitter[:, 0] - 0.5 * (side - 1)
    place[:, 2] = number // side + jitter[:, 1] - 0.5 * (side - 1)
    turn = random.normal(size=(count, 4)).astype(numpy.float32)
    turn /= numpy.linalg.norm(turn, axis=1, keepdims=True)
    size = random.uniform(0.2, 0.45, (count, 1)).repeat(3, 1).astype(numpy.float32)
    write_glb(folder / "mesh.glb", *ball(32, 16), instances=(place, turn, size))
    text = f"""{SKY}
[camera]
position = [0, {1.0 * side}, {1.25 * side}]
target = [0, 0, 0]
vfov = 42
[[model]]
file = "mesh.glb"
"""
    return text, {"size": "256x256", "samples": 8, "bounces": 4}


def lights(folder, count):
    """Glowing triangles of the same area in all, over a floor with a ball."""
    random = numpy.random.default_rng(SEED)
    middle = random.uniform((-3, 0.6, -3), (3, 2.5, 3), (count, 1, 3))
    corners = random.normal(size=(count, 3, 3))
    area = 0.5 * numpy.linalg.norm(numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners *= numpy.sqrt(0.5 / count / area)[:, None, None]
    positions = (middle + corners).reshape(-1, 3).astype(numpy.float32)
    write_glb(folder / "mesh.glb", positions, numpy.arange(3 * count, dtype=numpy.uint32), emission=20)
    text = """
[camera]
position = [0, 4, 8]
target = [0, 0.6, 0]
vfov = 42
[materials]
floor = { type = "diffuse", color = 0.6 }
[[quad]]
origin = [-5, 0, 5]
u = [10, 0, 0]
v = [0, 0, -10]
material = "floor"
[[sphere]]
center = [0, 0.7, 0]
radius = 0.7
material = "floor"
[[model]]
file = "mesh.glb"
"""
    return text, {"size": "256x256", "samples": 8, "bounces": 2}


def scene_of(name, flags):
    """One of the project's scenes."""

    def scene(_folder, x):
        file = ROOT / "scenes" / name
        text = re.sub(r'"(\.\./assets/[^"]+)"', lambda match: f'"{(file.parent / match[1]).resolve()}"', file.read_text())
        return text, flags(x)

    return scene


AXES = {
    "triangles": Axis(
        "triangles",
        triangles,
        [10**3, 10**4, 10**5, 10**6, 10**7],
        [10**3, 10**4, 10**5],
        {"load": "1", "build": "1 (n log n)", "render": "0 (log n, and caches)", "bytes": "1"},
    ),
    "instances": Axis(
        "instances",
        instances,
        [1, 10, 10**2, 10**3, 10**4, 10**5, 10**6],
        [1, 10**2, 10**4],
        {"load": "1", "build": "1 (n log n)", "render": "0 (log n, and caches)", "bytes": "1"},
    ),
    "lights": Axis(
        "glowing triangles",
        lights,
        [1, 10, 10**2, 10**3, 10**4, 10**5],
        [1, 10**2, 10**4],
        {"load": "1", "build": "1 (n log n)", "render": "0 (log n, and caches)", "bytes": "1"},
    ),
    "pixels": Axis(
        "pixels",
        scene_of("cornell.toml", lambda n: {"size": f"{math.isqrt(n)}x{math.isqrt(n)}", "samples": 4, "bounces": 8}),
        [64**2, 128**2, 256**2, 512**2, 1024**2, 2048**2],
        [64**2, 128**2, 256**2],
        {"load": "0", "build": "0", "render": "1", "bytes": "1"},
    ),
    "bounces": Axis(
        "bounces",
        scene_of("interior.toml", lambda n: {"size": "240x135", "samples": 8, "bounces": n}),
        [1, 2, 4, 8, 16, 32, 64],
        [1, 4, 16],
        {"load": "0", "build": "0", "render": "1 at first, 0 where paths end by themselves", "bytes": "0"},
    ),
    "threads": Axis(
        "threads",
        scene_of("still-life.toml", lambda n: {"size": "320x200", "samples": 16, "threads": n}),
        lambda options: powers(options.threads),
        lambda options: powers(options.threads),
        {"load": "0 or less", "build": "0 or less", "render": "−1", "bytes": "0"},
    ),
}


def powers(most):
    return sorted({min(2**k, most) for k in range(most.bit_length() + 1)})


# Meshes


def ball(columns, rows):
    """2 · columns · (rows − 1) triangles."""
    v, u = numpy.meshgrid(numpy.linspace(0, math.pi, rows + 1), numpy.linspace(0, 2 * math.pi, columns, endpoint=False), indexing="ij")
    positions = numpy.stack([numpy.sin(v) * numpy.cos(u), numpy.cos(v), numpy.sin(v) * numpy.sin(u)], -1).reshape(-1, 3)
    corners = []
    for i in range(rows):
        for j in range(columns):
            a, b = i * columns + j, i * columns + (j + 1) % columns
            if i > 0:
                corners += [a, b, a + columns]
            if i < rows - 1:
                corners += [b, b + columns, a + columns]
    return positions.astype(numpy.float32), numpy.array(corners, numpy.uint32)


def write_glb(file, positions, indices, instances=None, emission=None):
    """One mesh, one material; with `instances` (places, turns, sizes), by EXT_mesh_gpu_instancing."""
    data, views, accessors = [], [], []

    def add(array, kind, component, **more):
        offset = sum(map(len, data))
        data.append(numpy.ascontiguousarray(array).tobytes())
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(data[-1])})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind, **more})
        return len(accessors) - 1

    bounds = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
    primitive = {
        "attributes": {"POSITION": add(positions, "VEC3", 5126, **bounds)},
        "indices": add(indices, "SCALAR", 5125),
        "material": 0,
    }
    node = {"mesh": 0}
    material = {"pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.55, 0.45, 1], "metallicFactor": 0}}
    used = []
    if instances:
        names = (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3"))
        attributes = {name: add(array, kind, 5126) for (name, kind), array in zip(names, instances)}
        node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
        used.append("EXT_mesh_gpu_instancing")
    if emission:
        material["emissiveFactor"], material["doubleSided"] = [1, 0.9, 0.75], True
        material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": emission}}
        used.append("KHR_materials_emissive_strength")
    blob = b"".join(data)
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": used,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    if not used:
        del document["extensionsUsed"]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    with open(file, "wb") as out:
        out.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(blob)))
        out.write(struct.pack("<I4s", len(text), b"JSON") + text)
        out.write(struct.pack("<I4s", len(blob), b"BIN\0") + blob)


# What is made of it


def exponent(points, key):
    """Slope of log y over log x, by least squares through the points at the large end."""
    points = [p for p in points if p["x"] > 0 and p[key] > 0][-FITTED:]
    if len(points) < 2:
        return math.nan
    x, y = (numpy.log([p[k] for p in points]) for k in ("x", key))
    return float(numpy.polyfit(x, y, 1)[0])


def signed(value):
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "−")


def page(results):
    lines = ["# How rayo grows", ""]
    lines += [f"Seconds and bytes are y = c · xᵏ with the k of the table, fitted to the last {FITTED} points.", ""]
    lines += [
        "| with | from … to | load | build | render | processor | memory | may be: load, build, render, memory |",
        "|---|---|---:|---:|---:|---:|---:|---|",
    ]
    for name, result in results.items():
        points, allowed = result["points"], AXES[name].allowed
        found = [signed(exponent(points, key)) for key in (*SERIES, "peak_bytes")]
        ends = f"{points[0]['x']:,} … {points[-1]['x']:,}".replace(",", " ")
        lines.append(f"| {AXES[name].title} | {ends} | " + " | ".join(found) + f" | {'; '.join(allowed.values())} |")
    for name, result in results.items():
        quick = " **Quick: smaller ends.**" if result["quick"] else ""
        lines += ["", f"## {AXES[name].title.capitalize()}", ""]
        lines += [f"{result['date']}; {result['system']}, {result['threads']} threads; medians of {result['repeat']}.{quick}", ""]
        lines += [
            "| " + AXES[name].title + " | load, s | build, s | render, s | processor, s | process, s | peak, MiB | scene and film, MiB |",
            "|---:" * 8 + "|",
        ]
        for p in result["points"]:
            numbers = [f"{p[key]:.3f}" for key in (*SERIES, "process")] + [f"{p[key] / 2**20:.1f}" for key in ("peak_bytes", "kept_bytes")]
            lines.append(f"| {p['x']:,} | ".replace(",", " ") + " | ".join(numbers) + " |")
    return "\n".join(lines) + "\n"


def plot(folder, name, points):
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
    x = [p["x"] for p in points]
    for key, (label, color) in SERIES.items():
        left.plot(x, [p[key] for p in points], "o-", ms=4, color=color, label=f"{label}: {signed(exponent(points, key))}")
    for key, label, color in (("peak_bytes", "peak of the process", "#c8402f"), ("kept_bytes", "scene and film", "#2f6fc8")):
        right.plot(x, [p[key] / 2**20 for p in points], "o-", ms=4, color=color, label=f"{label}: {signed(exponent(points, key))}")
    for axes, label in ((left, "seconds"), (right, "MiB")):
        axes.set_xscale("log", base=2 if max(x) <= 64 else 10)
        axes.set_yscale("log")
        if max(x) <= 64:
            axes.set_xticks(x, [str(n) for n in x])
            axes.minorticks_off()
        axes.set_xlabel(AXES[name].title)
        axes.set_ylabel(label)
        low, high = axes.get_ylim()
        axes.set_ylim(low / 1.5, high * 1.5)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.grid(True, alpha=0.25)
        axes.legend(
            frameon=False,
            fontsize=8,
            loc="lower left",
            bbox_to_anchor=(-0.02, 1.0),
            ncols=2,
            title="exponent",
            title_fontsize=8,
            alignment="left",
        )
    figure.savefig(folder / f"growth-{name}.png", dpi=80)
    plt.close(figure)


def processor():
    try:
        return re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())[1]
    except (OSError, TypeError):
        return platform.processor() or "unknown"


if __name__ == "__main__":
    main()
