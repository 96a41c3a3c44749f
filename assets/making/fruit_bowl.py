"""Pears in a fluted bowl, on a round board."""
import numpy as np

from .images import to_srgb, write_png
from .patterns import cells, mix, noise, step
from .shapes import CM, Surface, lathe, lengths, spline, tube


def bowl_mesh(material):
    """Inside and outside in one profile; the flutes swell towards the rim."""
    profile = spline([(0, 1.1), (2.2, 1.15), (4.2, 1.7), (6.6, 3.3), (8.6, 5.6), (9.6, 7.3), (9.95, 7.55), (10.1, 7.3),
                      (9.2, 5.3), (7.1, 2.7), (4.7, .95), (4.0, .7), (3.9, .1), (3.6, 0), (3.3, .15), (3.1, .5), (0, .55)], 34)
    flutes, columns = 18, 90
    points = lathe(profile, columns)
    angle = 2 * np.pi * np.arange(columns) / columns
    swell = np.clip((profile[:, 0] - 4.6) / 5, 0, 1)[:, None] ** 1.2
    points[..., :2] *= (1 + .055 * swell * abs(np.cos(angle * flutes / 2)) ** .7)[..., None]
    points[..., 2] += .28 * swell * (abs(np.cos(angle * flutes / 2)) - .5)
    along = lengths(profile)
    surface = Surface()
    # The profile runs inside first and outwards: turned round, so that the faces look out of the clay.
    surface.grid(points[::-1], flutes * np.arange(columns + 1) / columns, (1 - along / along[-1])[::-1])
    return surface.object("Bowl", [material])


def celadon_texture():
    """One flute: glaze pools in the hollow, dark, and runs thin on the ridge and the rim, light."""
    shape = (128, 64)
    u = np.broadcast_to((np.arange(64) + .5) / 64, shape)
    v = np.broadcast_to(1 - (np.arange(128)[:, None] + .5) / 128, shape)
    thin = abs(np.cos(np.pi * u)) ** .7 * np.clip(1 - abs(v - .5) / .38, 0, 1)
    rim = np.exp(-((v - .5) / .02) ** 2)
    depth = np.clip(1.25 - .8 * thin - 1.0 * rim, .1, 1.4)
    return write_png("celadon.png", to_srgb(np.array([.66, .62, .50]) * np.exp(-np.array([1.35, .55, .72]) * depth[..., None])))


def pear_mesh(name, materials, place, lean, turn, size, seed):
    rng = np.random.default_rng(seed)
    profile = spline([(0, .35), (.5, .12), (1.2, 0), (2.3, .45), (3.1, 1.6), (3.35, 3.0), (2.95, 4.5), (2.1, 5.9), (1.55, 7.0), (1.25, 7.8),
                      (.85, 8.3), (.3, 8.42), (0, 8.3)], 22)
    columns = 28
    points = lathe(profile, columns)
    angle = 2 * np.pi * np.arange(columns) / columns
    lumps = sum(a * np.cos(k * angle + p) for k, a, p in zip((1, 2, 3), rng.normal(0, .018, 3), 6.28 * rng.random(3)))
    points[..., :2] *= (1 + lumps)[:, None]
    bend = .045 * np.clip(points[..., 2] - 2, 0, None) ** 1.6
    points[..., 0] += bend
    stem = spline([(0, 0, 7.9), (.02, 0, 8.6), (.15, .08, 9.3), (.45, .18, 9.9)], 9)
    stem[:, 0] += .045 * (stem[:, 2] - 2) ** 1.6
    stalk = tube(stem, np.interp(np.arange(9), [0, 2, 6, 8], [.2, .12, .12, .19]), 10)
    stalk = np.concatenate([stalk, np.broadcast_to(stem[-1], (1, 10, 3))])

    def placed(p):
        (cx, sx), (cz, sz) = ((np.cos(a), np.sin(a)) for a in np.radians((lean, turn)))
        p = (p - [0, 0, 3.2]) * size
        p = np.stack([p[..., 0], cx * p[..., 1] - sx * p[..., 2], sx * p[..., 1] + cx * p[..., 2]], -1)
        return np.stack([cz * p[..., 0] - sz * p[..., 1], sz * p[..., 0] + cz * p[..., 1], p[..., 2]], -1) + place

    surface = Surface()
    along = lengths(profile)
    surface.grid(placed(points), np.arange(columns + 1) / columns, along / along[-1])
    surface.grid(placed(stalk), np.linspace(0, 1, 11), np.linspace(0, 1, 10), material=1)
    return surface.object(name, materials)


def pear_texture():
    shape = (256, 512)
    u = np.broadcast_to((np.arange(512) + .5) / 512, shape)
    v = np.broadcast_to(1 - (np.arange(256)[:, None] + .5) / 256, shape)
    cloud, patch = noise(shape, 120, 21), noise(shape, 26, 22)
    color = mix([.42, .46, .055], [.62, .47, .06], step(.0, cloud + 1.5 * (v - .4), 3))
    blush = step(.55, .5 * np.cos(2 * np.pi * (u - .3)) + .14 * cloud + .05 * patch + .35 - .5 * abs(v - .45), .9)
    color = mix(color, [.50, .075, .03], .85 * blush)
    near, _, which = cells(u * 64, v * 30, 64, 23)
    sizes = np.random.default_rng(24).random(which.max() + 1)[which]
    color = mix(color, [.30, .19, .06], .75 * (1 - step(.10 + .16 * sizes, near, .12)))
    russet = np.clip(step(.93, v, .06) + (1 - step(.06, v, .08)), 0, 1) * (.75 + .25 * np.clip(patch, -1, 1))
    color = mix(color, [.20, .115, .035], np.clip(russet, 0, 1))
    return write_png("pear.png", np.rint(to_srgb(color) * 127) / 127)


def board_mesh(material):
    """A round board whose top is at height 0."""
    edge = spline([(26.9, 0), (27.35, -.02), (27.75, -.12), (28, -.5), (28, -1.4), (27.75, -1.88), (27.35, -1.98), (26.9, -2)], 14)
    profile = np.vstack([(0, 0), edge, (0, -2)])
    points = lathe(profile, 72)[::-1]
    surface = Surface()
    surface.grid(points, np.zeros(73), np.zeros(len(profile)))
    # Sawn from one piece: the texture is seen from above, drawn out over the edge.
    surface.uvs = [(surface.points[i][0] / 57 + .5, surface.points[i][1] / 57 + .5) for face in surface.faces for i in face]
    thing = surface.object("Board", [material])
    thing.location = (-8 * CM, 3 * CM, 0)
    return thing


def oak_texture():
    """Five staves side by side, each with its own grain along it, and pores."""
    shape = (512, 512)
    across = np.broadcast_to((np.arange(512)[:, None] + .5) / 512, shape)
    stave = np.floor(across * 5).astype(int)
    rng = np.random.default_rng(41)
    shade, shift = rng.normal(0, .16, 5)[stave], rng.integers(0, 512, 5)[stave]
    columns = (np.arange(512)[None] + shift) % 512
    rows = np.broadcast_to(np.arange(512)[:, None], shape)
    wide, fine = noise(shape, 40, 42, 2.0, 9)[rows, columns], noise(shape, 6, 43, 1.5, 26)[rows, columns]
    rings = .5 + .5 * np.sin(2 * np.pi * (across * 34 + .75 * wide))
    color = mix([.30, .165, .075], [.135, .062, .024], np.clip(.28 + .42 * rings ** 2 + .10 * fine + shade, 0, 1))
    pores = step(1.15, fine - .3 * rings, .7)
    joint = 1 - step(.018, abs(across * 5 - np.rint(across * 5)), .012)
    color = mix(color, [.05, .022, .009], np.clip(.55 * pores + .8 * joint, 0, 1))
    return write_png("oak.png", np.rint(to_srgb(color) * 63) / 63)
