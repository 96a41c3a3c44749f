#!/usr/bin/env python3
"""Makes the textures and models in this folder: small, plain, and unlike their own mirror image.

usage: python make_assets.py        (numpy)

| file | what |
|---|---|
| chart.png | 8 x 8 cells, each of its own colour, with an F in the corner and a ramp of greys below |
| leaf.png | a disk with a soft edge and a notch: alpha from 0 to 1 |
| letter.glb | a solid F, 3 x 5 x 1 cells, flat faces, UV across its front |
| block.glb | a cube of edge 1 about the origin, flat faces |
| pebble.glb | an icosahedron divided once, 80 faces, smooth normals |
| hill.obj | 24 x 24 quads of a wavy field with a colour at every vertex, no material |
| paint.glb | the same field as glTF with COLOR_0 |
| shapes.obj, .mtl | a table, a textured box and a cone of Lambert (illum 1) materials |
| stage.glb | a floor and a step, a camera, and a point, a spot and a directional light |

The same bytes come out each time.
"""
import json
import math
import os
import struct
import zlib

import numpy as np

FOLDER = os.path.dirname(os.path.abspath(__file__))
F_CELLS = {(0, y) for y in range(5)} | {(1, 4), (2, 4), (1, 2)}  # columns from the left, rows from below


def write(name, data):
    with open(os.path.join(FOLDER, name), "wb") as file:
        file.write(data if isinstance(data, bytes) else data.encode())


def png(name, pixels):
    """8-bit RGB or RGBA, rows from the top."""
    height, width, channels = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    write(name, b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def chart():
    size, cell = 128, 16
    y, x = np.mgrid[0:size, 0:size]
    column, row = x // cell, y // cell
    picture = np.stack([40 + 26 * column, 40 + 26 * row, 60 + 150 * ((column + row) % 2)], -1)
    picture[row == 7] = (2 * x[row == 7])[:, None]
    f = np.zeros((size, size), bool)
    for a, b in F_CELLS:  # 4 texels a cell, upright in the top left corner
        f |= (x // 4 == a + 2) & (y // 4 == 6 - b)
    picture[f] = 250
    return picture


def leaf():
    size = 64
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    alpha = np.clip((0.9 - np.hypot(x, y)) / 0.35, 0, 1)
    alpha[(x > 0.1) & (np.abs(y) < 0.18)] = 0
    color = np.stack([90 + 60 * x, 160 + 60 * y, np.full_like(x, 60)], -1)
    return np.concatenate([color, 255 * alpha[..., None]], -1)


class Glb:
    """A glTF document that grows an accessor at a time."""

    def __init__(self):
        self.blob = b""
        self.json = {"asset": {"version": "2.0", "generator": "rayo validation assets"}, "scene": 0, "scenes": [{"nodes": []}],
                     "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "materials": []}

    def accessor(self, array, target):
        array = np.ascontiguousarray(array)
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[1 if array.ndim == 1 else array.shape[1]]
        accessor = {"bufferView": len(self.json["bufferViews"]), "count": len(array), "type": kind,
                    "componentType": 5125 if array.dtype == np.uint32 else 5126}
        if target == 34962 and kind == "VEC3":
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": array.nbytes, "target": target})
        self.json["accessors"].append(accessor)
        self.blob += array.tobytes()
        return len(self.json["accessors"]) - 1

    def mesh(self, name, triangles, material, **attributes):
        named = {key: self.accessor(np.asarray(value, np.float32), 34962) for key, value in attributes.items()}
        indices = self.accessor(np.asarray(triangles, np.uint32).ravel(), 34963)
        self.json["meshes"].append({"name": name, "primitives": [{"attributes": named, "indices": indices, "material": material}]})
        self.node(name, mesh=len(self.json["meshes"]) - 1)

    def material(self, name, color, metallic=0.0, roughness=1.0):
        pbr = {"baseColorFactor": [*color, 1], "metallicFactor": metallic, "roughnessFactor": roughness}
        self.json["materials"].append({"name": name, "pbrMetallicRoughness": pbr, "doubleSided": True})
        return len(self.json["materials"]) - 1

    def node(self, name, **rest):
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]))
        self.json["nodes"].append({"name": name, **rest})

    def save(self, name):
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        total = 12 + 8 + len(text) + 8 + len(blob)
        write(name, struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text
              + struct.pack("<I4s", len(blob), b"BIN\0") + blob)


def letter():
    """Faces only between a cell that is there and one that is not; UV is the place on the front."""
    sides = [((0, 0, 1), [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]), ((0, 0, -1), [(1, 0, 0), (0, 0, 0), (0, 1, 0), (1, 1, 0)]),
             ((1, 0, 0), [(1, 0, 1), (1, 0, 0), (1, 1, 0), (1, 1, 1)]), ((-1, 0, 0), [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)]),
             ((0, 1, 0), [(0, 1, 1), (1, 1, 1), (1, 1, 0), (0, 1, 0)]), ((0, -1, 0), [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)])]
    positions, uvs, triangles = [], [], []
    for a, b in sorted(F_CELLS):
        for (dx, dy, dz), corners in sides:
            if dz == 0 and (a + dx, b + dy) in F_CELLS:
                continue
            first = len(positions)
            for x, y, z in corners:
                positions.append(((a + x - 1.5) / 5, (b + y) / 5, (z - 0.5) / 5))
                uvs.append(((a + x) / 5, 1 - (b + y) / 5))
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    glb = Glb()
    glb.mesh("Letter", triangles, glb.material("Letter", (0.8, 0.8, 0.8)), POSITION=positions, TEXCOORD_0=uvs)
    glb.save("letter.glb")


def box(low, high):
    """Eight corners of a box, and twelve triangles that face outward."""
    corners = [tuple(high[i] if bits >> i & 1 else low[i] for i in range(3)) for bits in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def block():
    corners, triangles = box((-0.5,) * 3, (0.5,) * 3)
    glb = Glb()
    glb.mesh("Block", triangles, glb.material("Block", (0.8, 0.8, 0.8)), POSITION=corners)
    glb.save("block.glb")


def pebble():
    golden = (1 + math.sqrt(5)) / 2
    points = [p for a in (-1, 1) for b in (-golden, golden) for p in ((0, a, b), (a, b, 0), (b, 0, a))]
    points = [np.array(p) / math.hypot(1, golden) for p in points]
    edge = min(np.linalg.norm(points[0] - p) for p in points[1:]) * 1.01
    near = lambda i, j: np.linalg.norm(points[i] - points[j]) < edge
    faces = [(i, j, k) for i in range(12) for j in range(i + 1, 12) for k in range(j + 1, 12) if near(i, j) and near(j, k) and near(i, k)]
    middles = {}

    def middle(i, j):
        key = (min(i, j), max(i, j))
        if key not in middles:
            m = points[i] + points[j]
            middles[key] = len(points)
            points.append(m / np.linalg.norm(m))
        return middles[key]

    triangles = []
    for i, j, k in faces:
        if np.dot(np.cross(points[j] - points[i], points[k] - points[i]), points[i]) < 0:
            j, k = k, j
        a, b, c = middle(i, j), middle(j, k), middle(k, i)
        triangles += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
    glb = Glb()
    glb.mesh("Pebble", triangles, glb.material("Pebble", (0.8, 0.8, 0.8)), POSITION=points, NORMAL=points)
    glb.save("pebble.glb")


def hill():
    """Positions, colours and quads of a wavy field of 2 m."""
    n = 24
    points, colors = [], []
    for row in range(n + 1):
        for column in range(n + 1):
            x, z = 2 * column / n - 1, 2 * row / n - 1
            points.append((x, 0.12 * math.sin(5 * x + 1) * math.cos(4 * z), z))
            colors.append((round(0.1 + 0.8 * column / n, 4), round(0.1 + 0.8 * row / n, 4), round(0.5 + 0.4 * math.sin(9 * x * z), 4)))
    at = lambda row, column: row * (n + 1) + column
    quads = [(at(r, c), at(r + 1, c), at(r + 1, c + 1), at(r, c + 1)) for r in range(n) for c in range(n)]
    return points, colors, quads


def fields():
    points, colors, quads = hill()
    lines = ["# positions and linear colours"]
    lines += ["v %.6g %.6g %.6g %g %g %g" % (*p, *c) for p, c in zip(points, colors)]
    lines += ["f " + " ".join(str(i + 1) for i in quad) for quad in quads]
    write("hill.obj", "\n".join(lines) + "\n")
    glb = Glb()
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    glb.mesh("Field", triangles, glb.material("Paint", (1, 1, 1)), POSITION=points, COLOR_0=colors)
    glb.save("paint.glb")


def shapes():
    lines = ["mtllib shapes.mtl"]
    count = 0

    def add(name, material, points, faces, uvs=None):
        nonlocal count
        lines.append(f"o {name}")
        lines.extend("v %.6g %.6g %.6g" % tuple(p) for p in points)
        if uvs:
            lines.extend("vt %g %g" % uv for uv in uvs)
        lines.append(f"usemtl {material}")
        for face in faces:
            corners = [f"{count + i + 1}/{k + 1}" if uvs else str(count + i + 1) for k, i in enumerate(face)]
            lines.append("f " + " ".join(corners))
        count += len(points)

    def quads(low, high):
        corners, _ = box(low, high)
        return corners, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]

    add("table", "oak", *quads((-1.6, -0.1, -1.1), (1.6, 0, 1.1)))
    add("box", "chart", *quads((-1.1, 0, -0.5), (-0.1, 1, 0.5)), uvs=[(0, 0), (1, 0), (1, 1), (0, 1)])
    ring = [(0.7 + 0.5 * math.cos(a), 0, 0.1 + 0.5 * math.sin(a)) for a in np.arange(24) * math.tau / 24]
    add("cone", "clay", ring + [(0.7, 1.1, 0.1)], [((i + 1) % 24, i, 24) for i in range(24)] + [tuple(range(24))])
    write("shapes.obj", "\n".join(lines) + "\n")
    write("shapes.mtl", "newmtl oak\nKd 0.55 0.35 0.2\nillum 1\n\nnewmtl chart\nKd 1 1 1\nmap_Kd chart.png\nillum 1\n\n"
          "newmtl clay\nKd 0.7 0.3 0.2\nillum 1\n")


def stage():
    glb = Glb()
    floor, step = glb.material("Floor", (0.7, 0.7, 0.7)), glb.material("Step", (0.3, 0.5, 0.8))
    glb.mesh("Floor", [(0, 1, 2), (0, 2, 3)], floor, POSITION=[(-3, 0, 2), (3, 0, 2), (3, 0, -3), (-3, 0, -3)])
    corners, triangles = box((-0.4, 0, -0.9), (0.5, 0.7, -0.2))
    glb.mesh("Step", triangles, step, POSITION=corners)
    tilt = lambda axis, degrees: [*(math.sin(math.radians(degrees) / 2) * np.array(axis)), math.cos(math.radians(degrees) / 2)]
    glb.json["cameras"] = [{"name": "View", "type": "perspective", "perspective": {"yfov": math.radians(38), "aspectRatio": 4 / 3, "znear": 0.1}}]
    glb.node("View", camera=0, translation=[0, 2.2, 4.6], rotation=tilt((1, 0, 0), -24))
    lights = [{"name": "Bulb", "type": "point", "color": [1, 0.7, 0.4], "intensity": 1.5},
              {"name": "Stage", "type": "spot", "color": [0.5, 0.8, 1], "intensity": 9.0, "spot": {"innerConeAngle": 0.15, "outerConeAngle": 0.3}},
              {"name": "Moon", "type": "directional", "color": [0.6, 0.7, 1], "intensity": 0.25}]
    glb.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    glb.json["extensionsUsed"] = ["KHR_lights_punctual"]
    light = lambda i: {"KHR_lights_punctual": {"light": i}}
    glb.node("Bulb", translation=[-1.3, 0.8, 0.2], extensions=light(0))
    glb.node("Stage", translation=[1.4, 2.6, 0.4], rotation=tilt((1, 0, 0), -90), extensions=light(1))
    glb.node("Moon", rotation=tilt((0.6, 0.8, 0), -50), extensions=light(2))
    glb.save("stage.glb")


png("chart.png", chart())
png("leaf.png", leaf())
letter()
block()
pebble()
fields()
shapes()
stage()
