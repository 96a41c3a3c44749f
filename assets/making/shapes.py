"""Meshes of turned and drawn parts. Lengths are centimetres here and metres in Blender; +Z is up."""
import bpy
import numpy as np

CM = 0.01


class Surface:
    """Vertices, faces and a UV for each corner; grids are closed around where `around`."""

    def __init__(self):
        self.points, self.faces, self.uvs, self.materials = [], [], [], []

    def grid(self, points, u, v, around=True, material=0):
        """points[row][column]; u has one more entry than columns where closed. A row of equal points becomes a pole."""
        rows, columns, _ = points.shape
        start = len(self.points)
        self.points += [tuple(p) for p in points.reshape(-1, 3)]
        pole = [bool(np.ptp(points[r], axis=0).max() < 1e-9) for r in range(rows)]
        for r in range(rows - 1):
            for c in range(columns if around else columns - 1):
                d = (c + 1) % columns
                corners = [(r, c, c), (r, d, c + 1), (r + 1, d, c + 1), (r + 1, c, c)]
                if pole[r]:
                    corners.pop(1)
                elif pole[r + 1]:
                    corners.pop(2)
                # All corners of a pole are one vertex, so that it has one normal.
                self.faces.append([start + i * columns + (0 if pole[i] else j) for i, j, _ in corners])
                self.uvs += [(u[k], v[i]) for i, _, k in corners]
                self.materials.append(material)

    def object(self, name, materials):
        mesh = bpy.data.meshes.new(name)
        used = sorted({i for face in self.faces for i in face})
        at = {old: new for new, old in enumerate(used)}
        mesh.from_pydata([tuple(CM * c for c in self.points[i]) for i in used], [],
                         [[at[i] for i in face] for face in self.faces])
        layer = mesh.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", np.array(self.uvs, np.float32).ravel())
        for material in materials:
            mesh.materials.append(material)
        mesh.polygons.foreach_set("material_index", self.materials)
        mesh.shade_smooth()
        mesh.update()
        thing = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(thing)
        return thing


def spline(points, n):
    """n points along a centripetal Catmull-Rom curve (Barry and Goldman 1988) through `points`, evenly spaced by length."""
    p = np.asarray(points, float)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    knots = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1) ** 0.5)])
    fine = []
    for i in range(1, len(p) - 2):
        t = np.linspace(knots[i], knots[i + 1], 40, endpoint=i == len(p) - 3)[:, None]
        k, q = knots[i - 1:i + 3], p[i - 1:i + 3]

        def between(a, b, ta, tb):
            return ((tb - t) * a + (t - ta) * b) / (tb - ta)

        a1, a2, a3 = (between(q[j], q[j + 1], k[j], k[j + 1]) for j in range(3))
        fine.append(between(between(a1, a2, k[0], k[2]), between(a2, a3, k[1], k[3]), k[1], k[2]))
    fine = np.concatenate(fine)
    length = lengths(fine)
    even = np.linspace(0, length[-1], n)
    return np.stack([np.interp(even, length, fine[:, j]) for j in range(fine.shape[1])], 1)


def lengths(points):
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def lathe(profile, columns):
    angle = 2 * np.pi * np.arange(columns) / columns
    r, z = profile[:, :1], profile[:, 1:]
    return np.stack([r * np.cos(angle), r * np.sin(angle), z + 0 * angle], 2)


def tube(path, radius, columns):
    """Rings about a path in space; `radius` is one number or one for each point."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent, [0.31, 0.95, 0.05])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(tangent, side)
    angle = 2 * np.pi * np.arange(columns) / columns
    ring = side[:, None] * np.cos(angle)[:, None] + other[:, None] * np.sin(angle)[:, None]
    return path[:, None] + ring * np.broadcast_to(radius, len(path))[:, None, None]
