"""What the scripts beside this file write their scenes with: quads, boxes, spheres and lights, one a line."""

import math


def numbers(values):
    return "[" + ", ".join(f"{round(v, 4) + 0.0:g}" for v in values) + "]"


def fields(**keys):
    def text(value):
        if isinstance(value, (list, tuple)):
            return numbers(value)
        if isinstance(value, bool):
            return str(value).lower()
        return f'"{value}"' if isinstance(value, str) and not value.startswith("{") else f"{value}"

    return "{ " + ", ".join(f"{key} = {text(value)}" for key, value in keys.items()) + " }"


class Scene:
    """Lists of shapes and lights; `write` prints them, and then the given text, as a scene file."""

    def __init__(self):
        self.quads, self.spheres, self.lights = [], [], []

    def quad(self, origin, u, v, material):
        self.quads.append(fields(origin=origin, u=u, v=v, material=material))

    def sphere(self, center, radius, material):
        self.spheres.append(fields(center=center, radius=radius, material=material))

    def light(self, **keys):
        self.lights.append(fields(**keys))

    def box(self, low, high, material, turn=0.0, about=(0.0, 0.0)):
        """Six quads that face outwards, turned by `turn` degrees about the vertical through `about` (x, z)."""
        cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))

        def turned(v):
            return (cos * v[0] + sin * v[2], v[1], cos * v[2] - sin * v[0])

        def placed(p):
            x, y, z = turned((p[0] - about[0], p[1], p[2] - about[1]))
            return (x + about[0], y, z + about[1])

        (x0, y0, z0), (x1, y1, z1) = low, high
        dx, dy, dz = (x1 - x0, 0, 0), (0, y1 - y0, 0), (0, 0, z1 - z0)
        for origin, u, v in (
            ((x0, y0, z0), dz, dy),
            ((x1, y0, z0), dy, dz),
            ((x0, y0, z0), dx, dz),
            ((x0, y1, z0), dz, dx),
            ((x0, y0, z0), dy, dx),
            ((x0, y0, z1), dx, dy),
        ):
            self.quad(placed(origin), turned(u), turned(v), material)

    def write(self, comment, text):
        print("#:schema rayo.schema.json")
        for line in comment.splitlines():
            print(f"# {line}")
        for name, lines in (("quad", self.quads), ("sphere", self.spheres), ("light", self.lights)):
            if lines:
                print(f"\n{name} = [")
                for line in lines:
                    print(f"  {line},")
                print("]")
        print(text.rstrip())
