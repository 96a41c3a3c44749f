"""Patterns on a grid of pixels, without a seam where they run around."""
import numpy as np


def step(edge, x, width):
    """0 below the edge and 1 above, smooth over `width`."""
    t = np.clip((x - edge) / width + 0.5, 0, 1)
    return t * t * (3 - 2 * t)


def mix(a, b, t):
    return np.asarray(a) * (1 - t[..., None]) + np.asarray(b) * t[..., None]


def noise(shape, size, seed, fall=2.0, stretch=1):
    """Tileable noise of mean 0 and deviation 1: a spectrum that falls from wavelength `size` (pixels) on, `stretch` times
    as long across."""
    rng = np.random.default_rng(seed)
    fy, fx = np.fft.fftfreq(shape[0])[:, None], stretch * np.fft.rfftfreq(shape[1])[None]
    spectrum = 1 / (1 + (np.hypot(fx, fy) * size) ** (2 * fall)) ** 0.5
    spectrum[0, 0] = 0
    phase = np.exp(2j * np.pi * rng.random(spectrum.shape))
    field = np.fft.irfft2(spectrum * phase, s=shape)
    return field / field.std()


def cells(x, y, columns, seed):
    """Distances to the nearest and second nearest of points jittered on a unit grid, and the number of the nearest's cell.
    x repeats after `columns`."""
    rng = np.random.default_rng(seed)
    rows = int(np.ceil(y.max())) + 3
    jitter = 0.15 + 0.7 * rng.random((rows, columns, 2))
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    first, second = np.full(x.shape, 9.0), np.full(x.shape, 9.0)
    which = np.zeros(x.shape, int)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            cx, cy = ix + dx, np.clip(iy + dy, -1, rows - 2)
            point = jitter[(cy + 1) % rows, cx % columns]
            d = np.hypot(cx + point[..., 0] - x, cy + point[..., 1] - y)
            second = np.where(d < first, first, np.minimum(second, d))
            which = np.where(d < first, (cy + 1) * columns + cx % columns, which)
            first = np.minimum(first, d)
    return first, second, which


def soften(field, pixels):
    """Gaussian blur around u; rows are left out of it at the ends of v, which no one sees."""
    fy, fx = np.fft.fftfreq(field.shape[0])[:, None], np.fft.rfftfreq(field.shape[1])[None]
    return np.fft.irfft2(np.fft.rfft2(field) * np.exp(-2 * (np.pi * pixels) ** 2 * (fx ** 2 + fy ** 2)), s=field.shape)


def half(image):
    """Each 2 x 2 pixels as their mean."""
    rows, columns, channels = image.shape
    return image.reshape(rows // 2, 2, columns // 2, 2, channels).mean((1, 3))


def normals_from(height, across, along):
    """Tangent-space normals of a height in cm; `across` and `along` are the cm that a pixel spans. Green points up."""
    du = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / (2 * across)
    dv = -np.gradient(height, axis=0) / along
    n = np.stack([-du, -dv, np.ones_like(du)], 2)
    return n / np.linalg.norm(n, axis=2, keepdims=True) * 0.5 + 0.5
