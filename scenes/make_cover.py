#!/usr/bin/env python3
"""Writes cover.toml, the final scene of "Ray Tracing in One Weekend": python3 scenes/make_cover.py > scenes/cover.toml"""

import math
import random

random.seed(7)

HEADER = """\
#:schema rayo.schema.json
# The final scene of "Ray Tracing in One Weekend". Written by make_cover.py: change it there.

[render]
size = [1200, 675]
samples = 128

[camera]
position = [13, 2, 3]
target = [0, 0, 0]
vfov = 20
aperture = 0.1
focus = 10.0

[environment]
type = "gradient"
bottom = [1, 1, 1]
top = [0.5, 0.7, 1.0]

[output]
file = "cover.png"
"""

spheres = []
materials = []


def triple(values):
    return "[" + ", ".join(f"{v:.4g}" for v in values) + "]"


def sphere(center, radius, name, **keys):
    if name not in (m[0] for m in materials):
        materials.append((name, keys))
    spheres.append((center, radius, name))


sphere((0, -1000, 0), 1000, "ground", type='"diffuse"', color=triple([0.5] * 3))
glass = {"type": '"dielectric"', "ior": 1.5}

for a in range(-11, 11):
    for b in range(-11, 11):
        choice = random.random()
        center = (a + 0.9 * random.random(), 0.2, b + 0.9 * random.random())
        if math.dist(center, (4, 0.2, 0)) <= 0.9:
            continue
        name = f"s{len(spheres)}"
        if choice < 0.8:
            color = [random.random() * random.random() for _ in range(3)]
            sphere(center, 0.2, name, type='"diffuse"', color=triple(color))
        elif choice < 0.95:
            color = [random.uniform(0.5, 1) for _ in range(3)]
            sphere(center, 0.2, name, type='"metal"', color=triple(color), fuzz=f"{random.uniform(0, 0.5):.3g}")
        else:
            sphere(center, 0.2, "glass", **glass)

sphere((0, 1, 0), 1, "glass", **glass)
sphere((-4, 1, 0), 1, "brown", type='"diffuse"', color=triple([0.4, 0.2, 0.1]))
sphere((4, 1, 0), 1, "mirror", type='"metal"', color=triple([0.7, 0.6, 0.5]), fuzz=0)

print(HEADER)
print("[materials]")
for name, keys in materials:
    print(f"{name} = {{ " + ", ".join(f"{key} = {value}" for key, value in keys.items()) + " }")
for center, radius, name in spheres:
    print(f'\n[[sphere]]\ncenter = {triple(center)}\nradius = {radius}\nmaterial = "{name}"')
