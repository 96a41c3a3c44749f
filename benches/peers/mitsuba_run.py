#!/usr/bin/env python3
"""Renders an exported folder with Mitsuba 3, kernels cold and then warm, and says what each took.

usage: mitsuba_run.py FOLDER OUT.exr --samples N --seed N [--threads N] [--once]

The first picture waits for kernels to be compiled (or read from Dr.Jit's cache on disk); the second finds them ready. The second is
kept, and its seconds are what efficiency is counted with. With --once there is only one.
"""

import argparse
import time

import numpy
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
import drjit  # after the variant is chosen

# Paths in flight at once: more pays no longer, and takes memory.
LANES = 1 << 23


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("out")
    parser.add_argument("--samples", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--once", action="store_true")
    options = parser.parse_args()

    start = time.perf_counter()
    scene = mi.load_file(f"{options.folder}/scene.xml", spp=str(options.samples), seed="0")
    print(f"LOAD_SECONDS {time.perf_counter() - start:.4f}")
    if options.threads and options.threads != drjit.thread_count():
        drjit.set_thread_count(options.threads)  # not before: with fewer than three, loading waits for itself

    for name, seed in (("COLD", options.seed + 500_000), ("WARM", options.seed))[options.once :]:
        start = time.perf_counter()
        pixels = render(scene, options.samples, seed)
        print(f"{name}_SECONDS {time.perf_counter() - start:.4f}", flush=True)
    mi.Bitmap(pixels.astype(numpy.float32)).write(options.out)


def render(scene, samples, seed):
    """In passes of equal size, as many as keep to LANES."""
    width, height = scene.sensors()[0].film().crop_size()
    most = max(1, LANES // (width * height))
    passes = -(-samples // most)
    while samples % passes:
        passes += 1
    total = 0
    for k in range(passes):
        picture = numpy.array(mi.render(scene, spp=samples // passes, seed=seed * 1000 + k))
        total = total + picture.astype(numpy.float64)
    return total / passes


main()
