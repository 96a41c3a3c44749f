#!/usr/bin/env python3
"""Writes interior.toml, a room lit through its window: python3 scenes/make_interior.py > scenes/interior.toml"""

import random

from boxes import Scene

random.seed(11)
scene = Scene()
box, quad, sphere = scene.box, scene.quad, scene.sphere

# The room: 5.2 m wide (x), 2.8 m high, 5.6 m deep (z from 0 at the back to 5.6). The window is in the left wall.
WIDTH, HEIGHT, DEPTH, WALL = 5.2, 2.8, 5.6, 0.3
quad((0, 0, DEPTH), (WIDTH, 0, 0), (0, 0, -DEPTH), "floor")
quad((0, HEIGHT, 0), (WIDTH, 0, 0), (0, 0, DEPTH), "ceiling")
quad((0, 0, 0), (WIDTH, 0, 0), (0, HEIGHT, 0), "wall")
quad((WIDTH, 0, DEPTH), (-WIDTH, 0, 0), (0, HEIGHT, 0), "wall")
quad((WIDTH, 0, 0), (0, 0, DEPTH), (0, HEIGHT, 0), "accent")
# So that no light comes round the wall: floor and ceiling end where it does.
z0, z1, y0, y1 = 1.5, 3.7, 0.75, 2.35
box((-WALL, 0, -0.02), (0, HEIGHT, z0), "wall")
box((-WALL, 0, z1), (0, HEIGHT, DEPTH + 0.02), "wall")
box((-WALL, 0, z0), (0, y0, z1), "wall")
box((-WALL, y1, z0), (0, HEIGHT, z1), "wall")
# Sill, frame and cross of the window; no pane.
box((-0.25, y0, z0 - 0.08), (0.14, y0 + 0.04, z1 + 0.08), "paint")
frame = 0.05
for z in (z0, (z0 + z1 - frame) / 2, z1 - frame):
    box((-0.22, y0 + 0.04, z), (-0.16, y1, z + frame), "paint")
for y in (y0 + 0.04, 1.75, y1 - frame):
    box((-0.22, y, z0), (-0.16, y + frame, z1), "paint")
# Skirting boards.
box((0, 0, 0), (WIDTH, 0.09, 0.02), "paint")
box((WIDTH - 0.02, 0, 0), (WIDTH, 0.09, DEPTH), "paint")

# A table with three stools, a bowl's worth of fruit, a vase and a brass ball.
tx, tz = 2.25, 2.55
box((tx - 0.85, 0.70, tz - 0.5), (tx + 0.85, 0.75, tz + 0.5), "wood")
for x in (tx - 0.78, tx + 0.70):
    for z in (tz - 0.43, tz + 0.35):
        box((x, 0, z), (x + 0.08, 0.70, z + 0.08), "wood")
for x, z, turn in ((1.75, 3.45, 12), (2.95, 3.35, -20), (2.4, 1.55, 5)):
    around = {"turn": turn, "about": (x, z)}
    box((x - 0.2, 0.42, z - 0.2), (x + 0.2, 0.46, z + 0.2), "wood", **around)
    for dx in (-0.18, 0.13):
        for dz in (-0.18, 0.13):
            box((x + dx, 0, z + dz), (x + dx + 0.05, 0.42, z + dz + 0.05), "wood", **around)
for x, z, radius, name in (
    (tx + 0.10, tz + 0.10, 0.045, "orange"),
    (tx + 0.19, tz + 0.14, 0.042, "orange"),
    (tx + 0.13, tz + 0.21, 0.040, "lemon"),
    (tx + 0.27, tz + 0.05, 0.040, "apple"),
):
    sphere((x, 0.75 + radius, z), radius, name)
sphere((tx - 0.38, 0.75 + 0.14, tz + 0.02), 0.14, "glaze")
sphere((tx - 0.05, 0.75 + 0.06, tz - 0.20), 0.06, "brass")
sphere((tx + 0.55, 0.75 + 0.09, tz - 0.05), 0.09, "mirror")

# A shelf at the back wall, with books.
sx0, sx1, depth = 3.0, 4.9, 0.3
for y in (0.0, 0.42, 0.84, 1.26, 1.68):
    box((sx0, y, 0.02), (sx1, y + 0.03, depth), "oak")
for x in (sx0, sx1 - 0.03):
    box((x, 0, 0.02), (x + 0.03, 1.71, depth), "oak")
BOOKS = ["red", "ochre", "navy", "cream", "green", "grey"]
for shelf in range(4):
    x, y = sx0 + 0.04, 0.42 * shelf + 0.03
    while x < sx1 - 0.12:
        if random.random() < 0.12:
            x += random.uniform(0.08, 0.25)
            continue
        width, height, back = random.uniform(0.02, 0.06), random.uniform(0.2, 0.34), random.uniform(0.2, 0.26)
        if x + width > sx1 - 0.04:
            break
        box((x, y, 0.03), (x + width - 0.002, y + height, 0.03 + back), random.choice(BOOKS))
        x += width
sphere((3.3, 1.71 + 0.11, 0.16), 0.11, "glaze")
sphere((4.55, 1.71 + 0.08, 0.17), 0.08, "brass")

# A sofa at the accent wall, a rug, and two pictures at the back wall.
box((4.25, 0.10, 1.5), (5.15, 0.42, 3.7), "fabric")
box((4.93, 0.42, 1.5), (5.17, 0.85, 3.7), "fabric")
box((4.25, 0.42, 1.36), (5.17, 0.60, 1.5), "fabric")
box((4.25, 0.42, 3.7), (5.17, 0.60, 3.84), "fabric")
box((4.25, 0.10, 1.36), (5.15, 0.42, 1.5), "fabric")
box((4.25, 0.10, 3.7), (5.15, 0.42, 3.84), "fabric")
box((4.62, 0.43, 1.62), (4.90, 0.82, 2.02), "ochre", turn=-8, about=(4.76, 1.82))
quad((0.9, 0.012, 4.1), (2.9, 0, 0), (0, 0, -3.0), "rug")
quad((1.05, 0.014, 3.95), (2.6, 0, 0), (0, 0, -2.7), "rug-inside")
for x, width, name in ((0.7, 0.75, "navy"), (1.75, 0.75, "red")):
    box((x, 1.15, 0), (x + width, 2.1, 0.03), "oak")
    quad((x + 0.05, 1.2, 0.032), (width - 0.1, 0, 0), (0, 0.85, 0), "cream")
    quad((x + 0.2, 1.42, 0.034), (width - 0.4, 0, 0), (0, 0.4, 0), name)

scene.light(type="sun", azimuth=272, elevation=33, irradiance=28, angle=0.53, color=(1, 0.93, 0.82))

scene.write(
    "A room lit through its window by sky and sun alone. Written by make_interior.py: change it there.",
    """
[render]
size = [960, 540]
samples = 1024
bounces = 24

[camera]
position = [2.35, 1.5, 5.45]
target = [2.55, 1.12, 0]
vfov = 52

[environment]
type = "gradient"
bottom = [0.9, 0.85, 0.75]
top = [3.4, 4.7, 7.2]

[output]
file = "interior.png"
exposure = 0.6

[materials]
floor = { type = "pbr", base_color = { image = "../assets/oak.png", repeat = [3, 3] }, roughness = 0.45 }
wall = { type = "diffuse", color = [0.80, 0.78, 0.74] }
ceiling = { type = "diffuse", color = [0.85, 0.85, 0.84] }
accent = { type = "diffuse", color = [0.30, 0.42, 0.40] }
paint = { type = "diffuse", color = [0.83, 0.83, 0.82] }
wood = { type = "pbr", base_color = [0.36, 0.20, 0.10], roughness = 0.4 }
oak = { type = "diffuse", color = [0.45, 0.30, 0.17] }
fabric = { type = "diffuse", color = [0.36, 0.37, 0.40] }
rug = { type = "diffuse", color = [0.42, 0.12, 0.09] }
rug-inside = { type = "diffuse", color = [0.62, 0.52, 0.40] }
orange = { type = "pbr", base_color = [0.85, 0.32, 0.03], roughness = 0.4 }
lemon = { type = "pbr", base_color = [0.85, 0.70, 0.08], roughness = 0.4 }
apple = { type = "pbr", base_color = [0.55, 0.05, 0.03], roughness = 0.3 }
glaze = { type = "pbr", base_color = [0.10, 0.22, 0.35], roughness = 0.15 }
brass = { type = "metal", color = [0.90, 0.68, 0.32], roughness = 0.3 }
mirror = { type = "metal", color = [0.9, 0.9, 0.9], fuzz = 0 }
red = { type = "diffuse", color = [0.45, 0.07, 0.06] }
ochre = { type = "diffuse", color = [0.62, 0.42, 0.12] }
navy = { type = "diffuse", color = [0.06, 0.10, 0.25] }
cream = { type = "diffuse", color = [0.75, 0.70, 0.58] }
green = { type = "diffuse", color = [0.10, 0.26, 0.14] }
grey = { type = "diffuse", color = [0.30, 0.30, 0.31] }
""",
)
