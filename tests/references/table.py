#!/usr/bin/env python3
"""Writes the table of docs/validation.md from what `rayo validate` found.

usage: tests/references/table.py validation/results.json

rayo against each other renderer, as mean ratio / block median / FLIP, and the widest FLIP among the others.
"""
import json
import pathlib
import re
import sys

PEERS = ["blender", "mitsuba", "povray"]


def cell(scene, inexact, image, reference):
    pair = next((p for p in scene["pairs"] if p["image"] == image and p["reference"] == reference), None)
    if pair is None:
        return "–"
    star = "\\*" if {image, reference} & inexact else ""
    return f"{pair['mean_ratio']:.4f} / {pair['block_median']:.4f} / {pair['ldr_flip']:.4f}{star}"


def main():
    results = json.loads(pathlib.Path(sys.argv[1]).read_text())
    programs, samples, rows = {}, set(), []
    for scene in results["scenes"]:
        inexact = {p["renderer"] for p in scene["pictures"] if p["notes"]}
        programs |= {p["renderer"]: p["program"] for p in scene["pictures"]}
        samples |= {p["samples"] for p in scene["pictures"]}
        others = [p["ldr_flip"] for p in scene["pairs"] if p["image"] != "rayo"]
        cells = [cell(scene, inexact, "rayo", peer) for peer in PEERS]
        rows.append(f"| {scene['name']} | " + " | ".join(cells) + f" | {max(others):.4f} |")
    names = ", ".join(programs[p] for p in PEERS)
    text = (f"rayo against {names}; {max(samples)} samples per pixel each, noise included. In a cell: mean ratio / median error of 8 × 8 "
            "blocks / FLIP. A star: the export had to approximate something (`NOTES.md` in each export says what).\n\n"
            "| scene | Blender Cycles | Mitsuba 3 | POV-Ray | greatest FLIP among the others |\n|---|---|---|---|---|\n" + "\n".join(rows))
    page = pathlib.Path(__file__).parents[2] / "docs" / "validation.md"
    old = page.read_text()
    new = re.sub(r"<!-- table -->.*?(?=\n## )", lambda _: "<!-- table -->\n\n" + text + "\n", old, flags=re.S)
    page.write_text(new)


main()
