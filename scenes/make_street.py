#!/usr/bin/env python3
"""Writes street.toml, a night street of 2000 lamps: python3 scenes/make_street.py > scenes/street.toml"""

import random

from boxes import Scene

random.seed(5)
scene = Scene()
box, quad, sphere = scene.box, scene.quad, scene.sphere
LAMPS = 2000
HALF = 4.0  # of the road, m; pavements are 2.5 m more
FRONT = HALF + 2.5  # where the houses stand
NEAR, FAR = 14.0, -110.0

# Road and pavements.
quad((-HALF, 0, NEAR), (2 * HALF, 0, 0), (0, 0, FAR - NEAR), "asphalt")
for side in (-1, 1):
    box((min(side * HALF, side * FRONT), 0, FAR), (max(side * HALF, side * FRONT), 0.14, NEAR), "pavement")
for k in range(20):
    z = 10 - 6 * k
    quad((-0.08, 0.004, z), (0.16, 0, 0), (0, 0, -2.5), "paint")

lamps = 0


def bulb(center, radius, material):
    global lamps
    sphere(center, radius, material)
    lamps += 1


def panel(origin, u, v, material):
    global lamps
    quad(origin, u, v, material)
    lamps += 1


def facade(side, z0, z1, height, material):
    """A house whose front looks at the road, with rows of windows; some are lit."""
    x = side * FRONT
    box((min(x, x + side * 6), 0, z1), (max(x, x + side * 6), height, z0), material)
    # u × v has to point at the road.
    along = -side

    def pane(z_low, y, width, tall, name, lit):
        origin = (x - side * 0.02, y, z_low if along < 0 else z_low + width)
        edges = ((0, 0, width if along < 0 else -width), (0, tall, 0))
        (panel if lit else quad)(origin, *edges, name)

    # The shop, and above it a lamp that shines on its door.
    shop = random.choice(["shop-warm", "shop-white", "shop-pink", "shop-mint"])
    pane(z1 + 0.8, 0.6, z0 - z1 - 2.6, 1.9, shop, True)
    pane(z0 - 1.4, 0.14, 0.9, 2.3, "door", False)
    scene.light(
        type="spot",
        position=(x - side * 0.35, 3.0, z0 - 0.95),
        direction=(side * 0.15, -1, 0),
        intensity=10.0,
        inner=25,
        outer=50,
        color=random.choice([(1, 0.75, 0.45), (1, 0.9, 0.75), (0.75, 0.9, 1)]),
    )
    global lamps
    lamps += 1
    floors = int((height - 3.6) / 2.9)
    columns = int((z0 - z1 - 0.6) / 1.7)
    step = (z0 - z1) / columns
    for floor in range(floors):
        for column in range(columns):
            lit = random.random() < 0.34
            name = random.choice(["window-warm", "window-warm", "window-amber", "window-cool"]) if lit else "glass-dark"
            pane(z1 + (column + 0.5) * step - 0.5, 3.9 + 2.9 * floor, 1.0, 1.5, name, lit)
    # A sign that stands out of the wall, seen from both sides.
    if random.random() < 0.75:
        name = random.choice(["neon-red", "neon-blue", "neon-green", "neon-violet"])
        low, tall, wide, z = random.uniform(3.2, 4.6), random.uniform(1.6, 3.2), 0.8, random.uniform(z1 + 1, z0 - 1)
        inner = x - side * 0.25
        left = min(inner, inner - side * wide)
        box((left - 0.04, low - 0.04, z - 0.06), (left + wide + 0.04, low + tall + 0.04, z + 0.06), "black")
        panel((left, low, z + 0.065), (wide, 0, 0), (0, tall, 0), name)
        panel((left + wide, low, z - 0.065), (-wide, 0, 0), (0, tall, 0), name)


for side in (-1, 1):
    z = NEAR - random.uniform(0, 3)
    while z > FAR + 12:
        width = random.uniform(7.5, 12)
        facade(side, z, z - width, random.uniform(9.5, 19), random.choice(["brick", "plaster", "stone", "slate"]))
        z -= width
# A tower ends the street.
box((-FRONT - 6, 0, FAR - 8), (FRONT + 6, 26, FAR), "slate")

# Street lanterns.
for k in range(9):
    for side in (-1, 1):
        z = 4 - 12 * k - (6 if side > 0 else 0)
        x = side * (HALF + 0.5)
        box((x - 0.05, 0.14, z - 0.05), (x + 0.05, 4.3, z + 0.05), "black")
        box((x - 0.12, 4.26, z - 0.12), (x + 0.12, 4.3, z + 0.12), "black")
        bulb((x, 4.48, z), 0.17, "lantern")

# The rest of the lamps hang on strings from house to house.
STRINGS = 26
COLORS = ["bulb-warm", "bulb-warm", "bulb-red", "bulb-blue", "bulb-green", "bulb-gold"]
rest = LAMPS - lamps
for k in range(STRINGS):
    count = rest // STRINGS + (k < rest % STRINGS)
    z = 3.0 - 4.2 * k
    slant = random.uniform(-2, 2)
    top, sag = random.uniform(5.6, 6.6), random.uniform(0.7, 1.2)
    plain = random.random() < 0.5
    for i in range(count):
        t = (i + 0.5) / count
        x = -FRONT + 2 * FRONT * t
        y = top - sag * (1 - (2 * t - 1) ** 2)
        bulb((x, y, z + slant * (t - 0.5)), 0.035, "bulb-warm" if plain else random.choice(COLORS))
assert lamps == LAMPS, lamps

# What stands in the street: bollards, crates and three polished balls.
for k in range(14):
    for side in (-1, 1):
        z = 7 - 4.0 * k
        sphere((side * (HALF + 0.25), 0.14 + 0.22, z), 0.22, "stone")
for x, z, size, turn in ((2.6, 2.5, 0.55, 20), (3.1, 2.9, 0.4, -15), (-3.2, -1.5, 0.6, 35), (2.7, 2.55, 0.35, 50)):
    low = 0.55 if size == 0.35 else 0
    box((x - size / 2, low, z - size / 2), (x + size / 2, low + size, z + size / 2), "crate", turn=turn, about=(x, z))
sphere((-2.3, 0.45, 2.2), 0.45, "chrome")
sphere((-1.4, 0.25, 3.4), 0.25, "copper")
sphere((1.5, 0.3, 0.2), 0.3, "copper")

EMISSIVE = {
    "lantern": ((1, 0.72, 0.42), 40),
    "bulb-warm": ((1, 0.70, 0.38), 50),
    "bulb-gold": ((1, 0.55, 0.15), 45),
    "bulb-red": ((1, 0.10, 0.06), 40),
    "bulb-blue": ((0.12, 0.25, 1), 45),
    "bulb-green": ((0.12, 1, 0.25), 30),
    "window-warm": ((1, 0.70, 0.38), 0.9),
    "window-amber": ((1, 0.52, 0.20), 0.7),
    "window-cool": ((0.65, 0.82, 1), 0.6),
    "shop-warm": ((1, 0.70, 0.38), 1.1),
    "shop-white": ((0.95, 0.97, 1), 0.8),
    "shop-pink": ((1, 0.35, 0.60), 0.9),
    "shop-mint": ((0.45, 1, 0.80), 0.7),
    "neon-red": ((1, 0.06, 0.08), 2.5),
    "neon-blue": ((0.08, 0.30, 1), 2.5),
    "neon-green": ((0.10, 1, 0.35), 1.6),
    "neon-violet": ((0.60, 0.12, 1), 2.5),
}
emissive = "\n".join(
    f'{name} = {{ type = "emissive", color = {list(color)}, strength = {strength} }}' for name, (color, strength) in EMISSIVE.items()
)
scene.write(
    f"A street at night with {LAMPS} lamps: bulbs on strings, lit windows, signs, lanterns and spots.\nWritten by make_street.py: change it there.",
    f"""
[render]
size = [960, 540]
samples = 1024
bounces = 12

[camera]
position = [-0.9, 1.7, 9.5]
target = [0.5, 3.0, -20]
vfov = 46

[environment]
type = "color"
color = [0.004, 0.006, 0.014]

[output]
file = "street.png"
exposure = 0.4

[materials]
asphalt = {{ type = "pbr", base_color = [0.05, 0.05, 0.055], roughness = 0.32 }}
pavement = {{ type = "diffuse", color = [0.22, 0.21, 0.20] }}
paint = {{ type = "diffuse", color = [0.6, 0.6, 0.55] }}
brick = {{ type = "diffuse", color = [0.32, 0.13, 0.09] }}
plaster = {{ type = "diffuse", color = [0.52, 0.46, 0.36] }}
stone = {{ type = "diffuse", color = [0.36, 0.35, 0.33] }}
slate = {{ type = "diffuse", color = [0.17, 0.18, 0.21] }}
door = {{ type = "diffuse", color = [0.12, 0.06, 0.04] }}
crate = {{ type = "diffuse", color = [0.42, 0.28, 0.15] }}
black = {{ type = "diffuse", color = [0.02, 0.02, 0.02] }}
glass-dark = {{ type = "pbr", base_color = [0.02, 0.02, 0.025], roughness = 0.12 }}
chrome = {{ type = "metal", color = [0.85, 0.86, 0.88], roughness = 0.1 }}
copper = {{ type = "metal", color = [0.93, 0.60, 0.48], roughness = 0.3 }}
{emissive}
""",
)
