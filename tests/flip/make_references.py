#!/usr/bin/env python3
"""Writes references.json beside this script: FLIP of small computed pictures, by the authors' own program.

    pip install flip-evaluator==1.7 numpy && python3 make_references.py

The pictures are made of whole numbers alone, so that the Rust test (src/compare/flip/tests.rs) makes the same.
Small pictures are stored with their whole maps, row by row; of large ones, every `step`-th pixel.
"""
import importlib.metadata
import json
import pathlib

import flip_evaluator
import numpy as np


def noise(x, y, channel, seed):
    """0 to 255: an integer hash (constants after "lowbias32", C. Wellons)."""
    n = (x * 73856093 ^ y * 19349663 ^ channel * 83492791 ^ seed * 2654435761) & 0xFFFFFFFF
    n ^= n >> 16
    n = n * 0x7FEB352D & 0xFFFFFFFF
    n ^= n >> 15
    n = n * 0x846CA68B & 0xFFFFFFFF
    n ^= n >> 16
    return n >> 24


# For each case the reference and the image, as functions of x, y and channel, in 256ths of display white.
CASES = {
    "noise on grey": (20, 14, lambda x, y, c: 64, lambda x, y, c: 48 + noise(x, y, c, 1) // 8),
    "an edge moved by a pixel": (24, 12, lambda x, y, c: 200 if x < 12 else 20, lambda x, y, c: 200 if x < 13 else 20),
    "colours turned": (16, 16, lambda x, y, c: 16 * ((x * (c + 1) + y) % 16), lambda x, y, c: 16 * ((x * (3 - c) + y) % 16)),
    "points, some lost": (
        22, 13,
        lambda x, y, c: 255 if noise(x, y, 0, 2) < 24 else 4,
        lambda x, y, c: 255 if noise(x, y, 0, 2) < 12 else 4,
    ),
    "high dynamic range": (
        18, 15,
        lambda x, y, c: (1 + noise(x, y, c, 3)) << (noise(x, y, 3, 3) // 20),
        lambda x, y, c: (1 + noise(x, y, c, 4)) << (noise(x, y, 3, 3) // 20),
    ),
    "narrower than the filters": (5, 3, lambda x, y, c: noise(x, y, c, 5), lambda x, y, c: noise(x, y, c, 6)),
    "a bright lamp over dark noise": (
        90, 150,
        lambda x, y, c: 60000 if (x - 45) ** 2 + (y - 70) ** 2 < 100 else 1 + noise(x, y, c, 7) // 16 + x // 4,
        lambda x, y, c: 55000 if (x - 45) ** 2 + (y - 71) ** 2 < 100 else 1 + noise(x, y, c, 8) // 16 + x // 4,
    ),
}


def picture(width, height, value):
    pixels = [[[value(x, y, c) for c in range(3)] for x in range(width)] for y in range(height)]
    return np.array(pixels, np.float32) / 256


def main():
    cases = []
    for name, (width, height, reference, image) in CASES.items():
        b, a = picture(width, height, reference), picture(width, height, image)
        case = {"name": name, "width": width, "height": height, "step": 1 if width * height < 1000 else 97}
        for kind, (b, a) in {"ldr": (b.clip(0, 1), a.clip(0, 1)), "hdr": (b, a)}.items():
            errors, mean, parameters = flip_evaluator.evaluate(b, a, kind, inputsRGB=False, applyMagma=False)
            errors = errors.ravel().tolist()
            case[kind + "_mean"] = round(float(np.mean(errors, dtype=np.float64)), 7)
            case[kind] = [round(e, 6) for e in errors[:: case["step"]]]
        case["exposures"] = [parameters[key] for key in ("startExposure", "stopExposure", "numExposures")]
        cases.append(case)
    versions = {name: importlib.metadata.version(name) for name in ("flip-evaluator", "numpy")}
    body = ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
    text = f'{{"made by": "make_references.py", "versions": {json.dumps(versions)}, "cases": [\n{body}\n]}}\n'
    pathlib.Path(__file__).with_name("references.json").write_text(text)


main()
