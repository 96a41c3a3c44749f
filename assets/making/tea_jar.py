"""The tea jar: turned parts from the foot up, then two rings; one texture, whose v runs along the profile."""
import numpy as np

from .images import to_srgb, write_png
from .patterns import cells, half, mix, noise, normals_from, soften, step
from .shapes import Surface, lathe, lengths, spline, tube

# name, material, (radius, height) points, rings, share of the texture's height
JAR = [
    ("foot", "brass", [(0, .6), (4.4, .6), (4.62, .45), (4.75, .06), (4.95, 0), (5.5, 0), (5.72, .12), (5.8, .4), (5.72, .75),
                       (5.5, .95), (5.42, 1.1), (5.5, 1.25), (5.45, 1.4), (5.2, 1.48)], 28, .12),
    ("body", "glaze", [(5.1, 1.44), (5.5, 2.2), (6.5, 4.2), (8.0, 7.2), (8.95, 10.2), (9.15, 12.6), (8.6, 14.9), (7.1, 16.9),
                       (5.5, 18.1), (4.75, 18.8), (4.6, 19.5)], 40, .52),
    ("collar", "brass", [(4.55, 19.4), (4.85, 19.42), (5.0, 19.52), (5.02, 19.7), (4.85, 19.8), (4.8, 19.9), (4.85, 20.0), (5.02, 20.1),
                         (5.0, 20.28), (4.8, 20.36), (4.5, 20.36)], 22, .07),
    ("lid", "glaze", [(4.4, 20.3), (5.3, 20.32), (5.6, 20.42), (5.68, 20.62), (5.5, 20.82), (4.9, 21.25), (3.6, 21.95), (2.1, 22.5),
                      (1.2, 22.75), (.8, 22.8)], 26, .14),
    ("finial", "brass", [(.75, 22.7), (1.15, 22.78), (1.2, 22.92), (1.0, 23.05), (.6, 23.2), (.46, 23.5), (.6, 23.8), (1.0, 24.15),
                         (1.18, 24.6), (1.05, 25.05), (.7, 25.35), (.42, 25.45), (.4, 25.62), (.3, 25.78), (0, 25.83)], 30, .09),
    ("rings", "brass", None, 0, .06),
]
JAR_SIZE = 1024
COBALT, WHITE = np.array([.012, .035, .23]), np.array([.76, .755, .70])
BRASS, TARNISH = np.array([.83, .60, .26]), np.array([.24, .125, .045])


def jar_bands():
    """(name, material, profile, v at its lower end, v at its upper end)."""
    bands, v = [], 0.0
    for name, material, points, rings, share in JAR:
        profile = None if points is None else spline(points, rings)
        bands.append((name, material, profile, v, v + share))
        v += share
    return bands


def jar_mesh(material):
    surface, columns = Surface(), 64
    u = np.arange(columns + 1) / columns
    for name, _, profile, low, high in jar_bands():
        if profile is None:
            continue
        along = lengths(profile)
        inset = 4 / JAR_SIZE
        surface.grid(lathe(profile, columns), u, low + inset + (high - low - 2 * inset) * along / along[-1])
    low, high = [(low, high) for name, _, _, low, high in jar_bands() if name == "rings"][0]
    v = np.linspace(low + .01, high - .01, 13)
    for side in (1, -1):
        # A lug on the shoulder and a ring that hangs from it, leaning on the body.
        lug = spline([(8.2, 15.35), (8.95, 15.75), (9.35, 15.45), (9.2, 14.95), (8.7, 14.75)], 13)
        path = np.stack([side * lug[:, 0], 0 * lug[:, 0], lug[:, 1]], 1)
        surface.grid(tube(path, np.interp(np.arange(13), [0, 6, 12], [.55, .34, .5]), 16), np.linspace(0, .3, 17), v)
        turn = 2 * np.pi * np.arange(49) / 48
        x = 9.72 + .42 * (np.cos(turn) - 1) * -.5
        ring = np.stack([side * x, 1.75 * np.sin(turn), 13.45 + 1.85 * np.cos(turn)], 1)
        points = tube(ring, .27, 12)
        points[-1] = points[0]
        surface.grid(points, np.linspace(.3, .9, 13), np.concatenate([np.linspace(v[0], v[-1], 25), np.linspace(v[-1], v[0], 25)[1:]]))
    return surface.object("Tea jar", [material])


def lines(t, positions, half):
    """Thin bands at `positions` of t."""
    return np.max([1 - step(half, abs(t - p), .006) for p in positions], axis=0)


def petals(x, t, soft):
    """Upright petals, t from 0 at the root to 1 at the tip; x counts petals. Outline, vein and wash."""
    f, there = abs(x - np.floor(x) - .5), (t > 0) & (t < 1)
    t = np.clip(t, 0, 1)
    edge = .46 * np.sqrt(1 - t ** 2.6) * (.82 + .18 * np.sin(np.pi * t))
    inside = step(0, edge - f, soft)
    outline = inside * (1 - step(.075, edge - f, soft))
    inner = step(.15, edge - f, soft) * step(.12, t, .05)
    vein = inner * (1 - step(.022, f, soft)) * (1 - step(.7, t, .1))
    wash = inner * (.18 + .6 * (1 - t) ** 2)
    return np.clip(outline + vein + wash, 0, 1) * there


def waves(x, y, soft):
    """Seigaiha: rows of circles, each row before the one above and shifted by half; x counts circles, y rows (half a radius)."""
    ink, done = np.zeros(x.shape), np.zeros(x.shape, bool)
    row = np.floor(y).astype(int)
    for back in (2, 1, 0, -1):  # The lowest row in reach is in front.
        r = row - back
        cx = np.floor(x - .5 * (r % 2)) + .5 + .5 * (r % 2)
        d = np.hypot(x - cx, (y - r) * .25) / .5
        inside = (d < 1) & ~done
        ring = np.max([1 - step(h, abs(d - c), soft) for c, h in ((.95, .055), (.68, .05), (.42, .045))], axis=0)
        ring = np.maximum(ring, 1 - step(.2, d, soft))
        ink = np.where(inside, ring, ink)
        done |= inside
    return ink


FRET = np.array([[int(c) for c in row] for row in (
    "111111110", "100000010", "101111010", "101001010", "101101010", "100001010", "111111011")])


def fret(x, t):
    """A key pattern; x counts its units, t runs from 0 to 1."""
    rows, columns = FRET.shape
    big = np.kron(FRET[::-1], np.ones((16, 16)))
    return big[np.clip((t * rows * 16).astype(int), 0, rows * 16 - 1), ((x % 1) * columns * 16).astype(int)] * (t > 0) * (t < 1)


def jar_textures():
    n = JAR_SIZE
    shape = (n, n)
    u = np.broadcast_to((np.arange(n) + .5) / n, shape)
    v = np.broadcast_to(1 - (np.arange(n)[:, None] + .5) / n, shape)
    ink, brass, engraved = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for name, material, _, low, high in jar_bands():
        here = (v >= low) & (v < high)
        t = (v - low) / (high - low)
        if material == "brass":
            brass[here] = 1
            if name == "foot":
                engraved = np.where(here, lines(t, (.71, .735), .006), engraved)
        elif name == "body":
            drawn = lines(t, (.035, .05, .215, .235, .665, .685, .822, .837, .985), .0035)
            drawn = np.maximum(drawn, petals(20 * u, (t - .055) / .155, .05))
            sea = waves(22 * u, (t - .235) / .43 * 15, .05) * step(.24, t, .003) * (1 - step(.66, t, .003))
            drawn = np.maximum(drawn, .92 * sea)
            drawn = np.maximum(drawn, fret(30 * u, (t - .70) / .108))
            collar = step(.845, t, .004) * (1 - step(.975, t, .004))
            dots = np.hypot((24 * u) % 1 - .5, (t - .885) / .035) < .36
            small = np.hypot((24 * u + .5) % 1 - .5, (t - .93) / .03) < .25
            drawn = np.maximum(drawn, collar * (1 - (dots | small)))
            ink = np.where(here, drawn, ink)
        else:
            drawn = np.maximum(lines(t, (.235, .345, .94), .006), (t > .255) * (t < .33) * ((40 * u) % 1 < .5) * .9)
            drawn = np.maximum(drawn, petals(14 * u, (t - .36) / .56, .04))
            ink = np.where(here, drawn, ink)
    ink = np.clip(soften(ink, 1.1), 0, 1) * (1 - brass)

    brush, cloud, grain = noise(shape, 60, 1), noise(shape, 260, 2), noise(shape, 7, 3, 1.2)
    crack1, crack2, _ = cells(u * 42, v * 36, 42, 4)
    crackle = (1 - step(.035, crack2 - crack1, .03)) * step(.1, noise(shape, 180, 5), .8)
    speck, _, which = cells(u * 90, v * 80, 90, 6)
    specks = (1 - step(.075, speck, .06)) * (np.random.default_rng(7).random(which.max() + 1)[which] < .05)
    dimple, _, _ = cells(u * 64, v * 72, 64, 8)
    worn = step(.35, .8 * noise(shape, 110, 9) + .3 * noise(shape, 24, 10, 3), 1.3)

    glaze = mix(np.broadcast_to(WHITE, shape + (3,)), [.30, .24, .17], np.clip(.30 * crackle + .85 * specks, 0, 1))
    density = np.clip(ink * (.95 + .05 * brush), 0, 1)
    # Cobalt under the glaze absorbs: colours mix as transmittances do.
    glaze = glaze * np.exp(np.log(COBALT / WHITE) * (density ** 1.1)[..., None])
    metal = mix(BRASS, TARNISH, np.clip(.62 * worn + .9 * soften(engraved, .8), 0, 1))
    color = mix(glaze, metal, brass)
    rough_glaze = .085 + .02 * cloud.clip(-1, 1) + .04 * ink + .25 * crackle * .4
    rough_metal = .19 + .30 * worn + .03 * grain
    roughness = np.clip(rough_glaze * (1 - brass) + rough_metal * brass, .04, 1)

    height_glaze = .004 * soften(ink, 1.6) - .003 * soften(crackle, .8) + .0035 * noise(shape, 90, 11, 3)
    height_metal = .032 * np.minimum(dimple, .6) ** 2 - .02 * soften(engraved, .8) + .0004 * grain
    height = height_glaze * (1 - brass) + height_metal * brass
    normal = normals_from(height, 2 * np.pi * 7 / n, 44 / n)

    # Only the drawing is worth the full size and, of the colours, no more than 40 steps.
    metal_rough = half(np.stack([np.ones(shape), roughness, brass], 2))
    metal_rough[..., 1] = np.rint(metal_rough[..., 1] * 63) / 63
    return (write_png("tea-jar-base-color.png", np.rint(to_srgb(color) * 40) / 40),
            write_png("tea-jar-metal-rough.png", metal_rough), write_png("tea-jar-normal.png", half(normal)))
