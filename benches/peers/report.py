#!/usr/bin/env python3
"""Tables and plots of a race: report.py FOLDER, where results.json is; writes results.md and PNG files beside it."""

import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from statistics import median

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # the backend comes first
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

COLORS = {"rayo": "#c8402f", "cycles": "#2f6fc8", "mitsuba": "#3a9a5b"}
TITLES = {"rayo": "rayo", "cycles": "Cycles", "mitsuba": "Mitsuba (warm)"}


def write(folder):
    folder = Path(folder)
    race = Race(json.loads((folder / "results.json").read_text()))
    (folder / "results.md").write_text(page(race))
    for shot in race.shots:
        figure, axes = plt.subplots(figsize=(6, 4.2), layout="constrained")
        draw_error(axes, race, shot)
        axes.legend(frameon=False)
        save(figure, folder / f"error-{shot}.png")
    columns = min(3, len(race.shots))
    rows = -(-len(race.shots) // columns)
    figure, grid = plt.subplots(rows, columns, figsize=(4.4 * columns, 3.4 * rows), layout="constrained", squeeze=False)
    for axes, shot in zip(grid.flat, race.shots):
        draw_error(axes, race, shot)
    for axes in list(grid.flat)[len(race.shots) :]:
        axes.set_axis_off()
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    save(figure, folder / "error.png")
    bars(race, "peak_bytes", 2**-20, "peak memory of the process, MiB", folder / "memory.png")
    bars(race, "start_seconds", 1, "process without the render call, s", folder / "start-up.png")
    print(f"wrote {folder}/results.md and plots")


class Race:
    def __init__(self, results):
        self.results = results
        self.counts = results["settings"]["samples"]
        self.by_key = defaultdict(list)
        for run in results["runs"]:
            run["start_seconds"] = run["process_seconds"] - run["render_seconds"]
            run["build_seconds"] = run["phases"]["build"] if "phases" in run else 0.0
            run["built_and_rendered"] = run["build_seconds"] + run["render_seconds"]
            self.by_key[run["shot"], run["renderer"], run["samples"]].append(run)
        self.shots = [shot["name"] for shot in results["shots"] if any(run["shot"] == shot["name"] for run in results["runs"])]
        self.renderers = [name for name in COLORS if any(run["renderer"] == name for run in results["runs"])]

    def runs(self, shot, renderer, samples=None):
        if samples is not None:
            return self.by_key[shot, renderer, samples]
        return [run for count in self.counts for run in self.by_key[shot, renderer, count]]

    def middle(self, shot, renderer, field, samples=None):
        runs = [run[field] for run in self.runs(shot, renderer, samples) if field in run]
        return median(runs) if runs else None

    def ratio(self, shot, peer):
        """How many times as efficient rayo is: median, least and most over the repeats of the geometric mean over sample counts."""
        # Cycles builds its trees within the render call.
        field = "built_and_rendered" if peer == "cycles" else "render_seconds"
        by_repeat = defaultdict(list)
        for samples in self.counts:
            theirs = {run["repeat"]: run["rel_mse"] * run[field] for run in self.runs(shot, peer, samples)}
            for run in self.runs(shot, "rayo", samples):
                if run["repeat"] in theirs:
                    by_repeat[run["repeat"]].append(theirs[run["repeat"]] / (run["rel_mse"] * run[field]))
        ratios = [geometric_mean(values) for values in by_repeat.values()]
        return (median(ratios), min(ratios), max(ratios)) if ratios else None


def geometric_mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


# Tables


def page(race):
    results = race.results
    versions, machine, settings = results["versions"], results["machine"], results["settings"]
    loads = [run["load_before"] for run in results["runs"]]
    lines = [
        "# rayo and its peers",
        "",
        f"{results['date']}; {machine['processor']}, {machine['threads']} threads; {machine['system']}  ",
        "; ".join(versions[name] if name != "rayo" else f"rayo {versions[name]}" for name in race.renderers) + "  ",
        f"samples {', '.join(map(str, race.counts))}; {settings['repeat']} repeats, interleaved; converged pictures of "
        f"{settings['reference_samples']} samples; load of the machine before runs {median(loads):.1f} in the middle, {max(loads):.1f} at most",
    ]
    if settings["quick"]:
        lines += ["", "**A quick run**: small pictures, few repeats. Good for trying the instrument, not for conclusions."]
    peers = [name for name in race.renderers if name != "rayo"]
    if "rayo" in race.renderers and peers:
        lines += ["", "## Efficiency, as a multiple of the peer's", ""]
        lines += ["Median over repeats, least and most in brackets; each repeat is the geometric mean over the sample counts.", ""]
        rows, all_ratios = [], {peer: [] for peer in peers}
        for shot in race.shots:
            row = [shot]
            for peer in peers:
                ratio = race.ratio(shot, peer)
                if ratio:
                    all_ratios[peer].append(ratio[0])
                row.append("{:.2f} ({:.2f} to {:.2f})".format(*ratio) if ratio else "–")
            rows.append(row)
        rows.append(["**geometric mean**", *(f"**{geometric_mean(r):.2f}**" if (r := all_ratios[p]) else "–" for p in peers)])
        rows.append(["least", *(f"{min(r):.2f}" if (r := all_ratios[p]) else "–" for p in peers)])
        lines += table(["shot", *(f"over {TITLES[p]}" for p in peers)], rows)
    lines += ["", "## Render seconds and relMSE", "", "Medians; of rayo also, after the plus, what building took.", ""]
    rows = []
    for shot in race.shots:
        for samples in race.counts:
            row = [shot, samples]
            for name in race.renderers:
                seconds = race.middle(shot, name, "render_seconds", samples)
                error = race.middle(shot, name, "rel_mse", samples)
                build = race.middle(shot, name, "build_seconds", samples)
                row.append("–" if seconds is None else f"{seconds:.2f}{f' + {build:.2f}' if build else ''} s, {error:.2e}")
            rows.append(row)
    lines += table(["shot", "samples", *(TITLES[name] for name in race.renderers)], rows)
    least = min(race.counts)
    lines += [
        "",
        f"## Whole process at {least} samples",
        "",
        "Medians: seconds from start to file written (of these before and after the render call), peak memory.",
        "",
    ]
    rows = []
    for shot in race.shots:
        row = [shot]
        for name in race.renderers:
            whole = race.middle(shot, name, "process_seconds", least)
            if whole is None:
                row.append("–")
                continue
            start = race.middle(shot, name, "start_seconds", least)
            memory = race.middle(shot, name, "peak_bytes", least) / 2**20
            row.append(f"{whole:.2f} s ({start:.2f} s), {memory:.0f} MiB")
        rows.append(row)
    lines += table(["shot", *(TITLES[name].replace(" (warm)", " (cold)") for name in race.renderers)], rows)
    if "mitsuba" in race.renderers:
        lines += [
            "",
            "## Mitsuba's first picture",
            "",
            "Medians at the fewest samples: the render call with kernels to make, and with kernels made.",
            "",
        ]
        rows = []
        for shot in race.shots:
            cold = race.middle(shot, "mitsuba", "cold_seconds", least)
            if cold is not None:
                rows.append([shot, f"{cold:.2f} s", f"{race.middle(shot, 'mitsuba', 'render_seconds', least):.2f} s"])
        lines += table(["shot", "cold", "warm"], rows)
    lines += ["", "## What the peers were told differently", ""]
    for shot in results["shots"]:
        for peer, notes in shot["notes"].items():
            lines += [f"- {shot['name']}, {TITLES[peer].removesuffix(' (warm)')}: {note}" for note in notes]
    return "\n".join(lines) + "\n"


def table(head, rows):
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return ["| " + " | ".join(map(str, line)) + " |" for line in lines]


# Plots


def draw_error(axes, race, shot):
    for name in race.renderers:
        runs = race.runs(shot, name)
        if not runs:
            continue
        axes.plot([run["built_and_rendered"] for run in runs], [run["rel_mse"] for run in runs], ".", ms=4, color=COLORS[name], alpha=0.35)
        middle = [
            (race.middle(shot, name, "built_and_rendered", n), race.middle(shot, name, "rel_mse", n), n)
            for n in race.counts
            if race.runs(shot, name, n)
        ]
        axes.plot([m[0] for m in middle], [m[1] for m in middle], "o-", ms=5, color=COLORS[name], label=TITLES[name])
        for x, y, samples in middle:
            axes.annotate(str(samples), (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7, color=COLORS[name])
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(FixedLocator(round_numbers(*axis.get_view_interval())))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", alpha=0.25)
    axes.set_title(shot)
    axes.set_xlabel("render seconds (of rayo with building)")
    axes.set_ylabel("relMSE")


def round_numbers(low, high):
    """Of 1, 2, 5 a decade, or 1, 1.5, 2, 3, 5, 7 where there are few; at most a dozen."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for digits in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 5, 7)):
        ticks = [digit * 10.0**k for k in decades for digit in digits if low <= digit * 10.0**k <= high]
        if len(ticks) >= 3:
            return ticks
    return ticks


def bars(race, field, factor, label, file):
    """At the fewest samples, where what is not rendering weighs most."""
    least = min(race.counts)
    figure, axes = plt.subplots(figsize=(1.6 + 1.0 * len(race.shots), 3.6), layout="constrained")
    width = 0.8 / len(race.renderers)
    for k, name in enumerate(race.renderers):
        values = [(i, race.middle(shot, name, field, least)) for i, shot in enumerate(race.shots)]
        values = [(i, value * factor) for i, value in values if value is not None]
        axes.bar(
            [i + (k - (len(race.renderers) - 1) / 2) * width for i, _ in values],
            [value for _, value in values],
            width * 0.92,
            color=COLORS[name],
            label=TITLES[name].removesuffix(" (warm)"),
        )
    axes.set_xticks(range(len(race.shots)), race.shots, rotation=25 if len(race.shots) > 4 else 0)
    axes.set_ylabel(label)
    axes.grid(True, axis="y", alpha=0.25)
    axes.set_axisbelow(True)
    axes.legend(frameon=False)
    save(figure, file)


def save(figure, file):
    figure.savefig(file, dpi=130)
    plt.close(figure)


if __name__ == "__main__":
    write(sys.argv[1])
