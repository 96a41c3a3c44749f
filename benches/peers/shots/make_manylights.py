#!/usr/bin/env python3
"""Writes manylights.toml: python3 benches/peers/shots/make_manylights.py > benches/peers/shots/manylights.toml"""

import random

random.seed(3)

LAMPS, BALLS, COLORS = 400, 30, 24


def triple(values):
    return "[" + ", ".join(f"{round(v, 3):g}" for v in values) + "]"


print("""\
# 400 small lamps of different colours over a floor with balls. Written by make_manylights.py: change it there.

[render]
size = [480, 270]
samples = 1024
bounces = 8
filter = { type = "box", width = 1.0 }

[camera]
position = [0, 5, 13]
target = [0, 0.4, 0]
vfov = 38

[output]
file = "manylights.png"
exposure = 0.5

[materials]
floor = { type = "diffuse", color = [0.6, 0.6, 0.6] }
metal = { type = "metal", color = [0.8, 0.8, 0.85], roughness = 0.3, fresnel = "constant", multiscatter = false }""")
for k in range(COLORS):
    print(f'lamp-{k} = {{ type = "emissive", color = {triple(random.uniform(4, 18) for _ in range(3))} }}')
print("""
[[quad]]
origin = [-12, 0, 12]
u = [24, 0, 0]
v = [0, 0, -24]
material = "floor\"""")
balls = []
while len(balls) < BALLS:
    radius = random.uniform(0.3, 0.8)
    x, z = random.uniform(-7, 7), random.uniform(-7, 7)
    if all((x - a) ** 2 + (z - b) ** 2 > (radius + c + 0.05) ** 2 for a, b, c in balls):
        balls.append((x, z, radius))
        material = random.choice(["floor", "metal"])
        print(f'\n[[sphere]]\ncenter = {triple((x, radius, z))}\nradius = {radius:.3f}\nmaterial = "{material}"')
lamps = 0
while lamps < LAMPS:
    x, y, z = random.uniform(-8, 8), random.uniform(0.3, 3), random.uniform(-8, 8)
    if all((x - a) ** 2 + (y - c) ** 2 + (z - b) ** 2 > (c + 0.06) ** 2 for a, b, c in balls):
        lamps += 1
        print(f'\n[[sphere]]\ncenter = {triple((x, y, z))}\nradius = 0.04\nmaterial = "lamp-{random.randrange(COLORS)}"')
