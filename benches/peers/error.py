"""How noisy a picture is."""

import numpy
import OpenEXR

LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
# Added to the squared reference, so that black pixels do not decide.
FLOOR = 1e-2
# Share of the pixels, the worst ones, that is left out: a single firefly would drown the rest.
LEFT_OUT = 1e-3


def read(path):
    channels = OpenEXR.File(str(path)).channels()
    for name in ("RGB", "RGBA"):
        if name in channels:
            return channels[name].pixels[..., :3].astype(numpy.float64)
    return numpy.stack([channels[name].pixels for name in "RGB"], -1).astype(numpy.float64)


def rel_mse(picture, reference):
    """Mean over pixels of (picture − reference)² / (luminance of the reference² + FLOOR), without the worst of them."""
    squared = ((picture - reference) ** 2).mean(-1) / ((reference @ LUMINANCE) ** 2 + FLOOR)
    squared = numpy.sort(squared, axis=None)
    return float(squared[: max(1, int(squared.size * (1 - LEFT_OUT)))].mean())


def mean_luminance(picture):
    return float((picture @ LUMINANCE).mean())
