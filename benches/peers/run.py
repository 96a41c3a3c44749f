#!/usr/bin/env python3
"""Races rayo against Blender Cycles and Mitsuba 3 on the same processor: error against time, memory, start-up.

    python3.11 benches/peers/run.py             everything: hours
    python3.11 benches/peers/run.py --quick     small and rough: minutes

Installs the peers into a virtual environment inside the output folder, unless --python names a Python that has them (bpy, mitsuba,
OpenEXR, numpy, matplotlib; for --rays embreex too). Every scene goes to the peers through `rayo export`. Each renderer's own converged
picture is rendered once and kept; then all renderers take turns. docs/performance.md says what the numbers mean.
"""

import argparse
import datetime
import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PACKAGES = ["bpy==5.0.1", "mitsuba==3.9.1", "embreex==4.4.0.post1", "OpenEXR>=3.3", "numpy", "matplotlib"]
MODULES = ["bpy", "mitsuba", "OpenEXR", "numpy", "matplotlib"]

# Scenes of the project that are shots too, with the size they have here.
SCENES = {"cover": (480, 270), "interior": (480, 270), "street": (480, 270)}
ORDER = ["cover", "cornell", "manylights", "helmet", "flight", "glasstable", "attenuation", "interior", "street"]
RENDERERS = ["rayo", "cycles", "mitsuba"]
TARGETS = {"cycles": "blender", "mitsuba": "mitsuba"}
REFERENCE_SEED = 900


def main():
    options = read_options()
    into_python_with_peers(options)
    # Only now: these need what has just been installed.
    sys.path.insert(0, str(HERE))
    import report

    bench = Bench(options)
    shots = [shot for name in options.shots or ORDER if (shot := bench.prepare(name))]
    if not shots:
        sys.exit("no shot to render")
    for shot in shots:
        for renderer in shot["renderers"]:
            bench.reference(shot, renderer)
    bench.measure(shots)
    report.write(bench.out)
    if options.rays:
        race_rays(options)


def read_options():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, epilog="shots: " + ", ".join(ORDER)
    )
    parser.add_argument("shots", nargs="*", metavar="SHOT", help="names, or scene files; default: all")
    parser.add_argument("--output", type=Path, default=ROOT / "target/bench-peers", metavar="FOLDER")
    parser.add_argument("--python", metavar="FILE", help="a Python that has the peers and what plots need")
    parser.add_argument("--rayo", type=Path, metavar="FILE", help="binary; default: built here with --release")
    parser.add_argument("--renderers", default=",".join(RENDERERS), help="some of " + ",".join(RENDERERS))
    parser.add_argument("--samples", help="per pixel, one after the other; default: 4,16,64 (quick: 4,16)")
    parser.add_argument("--repeat", type=int, help="how often; default: 5 (quick: 2)")
    parser.add_argument("--reference-samples", type=int, help="of the converged pictures; default: 2048 (quick: 256)")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--uniform", action="store_true", help="rayo, too, takes the same number of samples for every pixel")
    parser.add_argument("--rays", action="store_true", help="then race rays and trees against Embree, too: rays.md")
    parser.add_argument("--quick", action="store_true", help="pictures of half the width and height, few samples")
    options = parser.parse_args()
    quick = options.quick
    options.samples = [int(n) for n in (options.samples or ("4,16" if quick else "4,16,64")).split(",")]
    options.repeat = options.repeat or (2 if quick else 5)
    options.reference_samples = options.reference_samples or (256 if quick else 2048)
    options.renderers = [name for name in RENDERERS if name in options.renderers.split(",")]
    options.output = options.output.resolve()
    return options


def into_python_with_peers(options):
    """Goes on in a Python that has what is needed."""
    if os.environ.get("RAYO_BENCH_STAGE"):
        missing = [name for name in MODULES if importlib.util.find_spec(name) is None]
        if missing:
            sys.exit(f"{sys.executable} lacks {', '.join(missing)}")
        return
    python = options.python
    if not python:
        python = options.output / "venv/bin/python"
        stamp = options.output / "venv/packages"
        if not stamp.is_file() or stamp.read_text() != "\n".join(PACKAGES):
            if sys.version_info[:2] != (3, 11):
                sys.exit("Blender's module needs Python 3.11: start this with python3.11, or give --python")
            options.output.mkdir(parents=True, exist_ok=True)
            subprocess.run([sys.executable, "-m", "venv", options.output / "venv"], check=True)
            subprocess.run([python, "-m", "pip", "install", *PACKAGES], check=True)
            stamp.write_text("\n".join(PACKAGES))
    python = str(python)
    if os.sep in python:
        python = os.path.abspath(python)
    os.environ["RAYO_BENCH_STAGE"] = "2"
    if "DRJIT_LIBLLVM_PATH" not in os.environ and (library := newest_llvm()):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
    os.execvp(python, [python, *sys.argv])


def newest_llvm():
    """LLVM's library, where the loader would not find it by itself."""
    found = []
    for folder in ("/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib"):
        for file in Path(folder).glob("libLLVM*.so*"):
            if match := re.match(r"libLLVM-?(\d+)?\.so\.?(\d+)?", file.name):
                found.append((int(match[1] or match[2] or 0), file))
    return max(found)[1] if found else None


def race_rays(options):
    """`cargo bench --bench rays` with the Embree that is among the packages."""
    folders = [Path(folder) / "embreex.libs" for folder in sys.path]
    library = next((file for folder in folders for file in sorted(folder.glob("libembree4*"))), None)
    if not library:
        sys.exit(f"{sys.executable} lacks embreex, whose Embree rays are raced against")
    say("rays and trees against Embree")
    flags = ["--reps", "3", "--builds", "1"] if options.quick else ["--reps", "7", "--builds", "5"]
    command = ["cargo", "bench", "--locked", "--bench", "rays", "--", *flags]
    said = subprocess.run(command, cwd=ROOT, env=os.environ | {"RAYO_EMBREE": str(library)}, stdout=subprocess.PIPE, text=True)
    if said.returncode != 0:
        sys.exit(f"cargo bench --bench rays ended with {said.returncode}")
    (options.output / "rays.md").write_text(said.stdout)
    say(f"wrote {options.output}/rays.md")


class Bench:
    def __init__(self, options):
        import error

        self.error = error
        self.options = options
        self.out = options.output
        self.references = {}
        for folder in ("scenes", "exports", "references", "runs"):
            (self.out / folder).mkdir(parents=True, exist_ok=True)
        self.rayo = options.rayo.resolve() if options.rayo else self.build()

    def build(self):
        subprocess.run(["cargo", "build", "--release", "--locked"], cwd=ROOT, check=True)
        return ROOT / "target/release/rayo"

    # Shots

    def prepare(self, name):
        """Writes the scene with the settings of the race, and exports it; `None` where its files are not there."""
        file = Path(name) if name.endswith(".toml") else HERE / f"shots/{name}.toml"
        if not name.endswith(".toml") and name in SCENES:
            file = ROOT / f"scenes/{name}.toml"
        if not file.is_file():
            sys.exit(f"there is no shot {name}: {file} is not a file")
        name = file.stem
        text = file.read_text()
        render = tomllib.loads(text).get("render", {})
        width, height = SCENES.get(name) or render.get("size", (480, 270))
        if self.options.quick:
            width, height = width // 2, height // 2
        try:
            text = with_found_files(text, file.parent)
        except FileNotFoundError as missing:
            say(f"{name}: skipped, {missing}")
            return None
        head = [
            "[render]",
            f"size = [{width}, {height}]",
            f"bounces = {toml(render.get('bounces', 16))}",
            'filter = { type = "box", width = 1.0 }',
            f"threads = {self.options.threads}",
            "[output]",
            f'file = "{name}.exr"',
            'depth = "float"',
        ]
        text = without_section(without_section(text, "render"), "output")
        scene = self.out / f"scenes/{name}.toml"
        scene.write_text(text.rstrip() + "\n\n" + "\n".join(head) + "\n")
        renderers, notes = [], {}
        for renderer in self.options.renderers:
            if renderer in TARGETS:
                notes[renderer] = self.export(scene, name, renderer)
                if any(note.startswith("dropped") for note in notes[renderer]):
                    say(f"{name}: without {renderer}, which lacks something of it (see exports/{name}-{renderer}/NOTES.md)")
                    continue
            renderers.append(renderer)
        digest = hashlib.sha256(text.encode() + f"{width}x{height}".encode()).hexdigest()[:12]
        return {"name": name, "scene": scene, "size": [width, height], "renderers": renderers, "notes": notes, "digest": digest}

    def export(self, scene, name, renderer):
        folder = self.folder(name, renderer)
        command = [self.rayo, "export", scene, "--to", TARGETS[renderer], "-o", folder]
        said = subprocess.run(command, check=True, capture_output=True, text=True)
        lines = (said.stdout + said.stderr).splitlines()
        return [line for line in lines if line.startswith(("approximated:", "dropped:"))]

    def folder(self, name, renderer):
        return self.out / f"exports/{name}-{renderer}"

    # Runs

    def render(self, shot, renderer, samples, seed, picture, once=False):
        """One process: what it took and wrote."""
        threads = str(self.options.threads)
        common = ["--samples", str(samples), "--seed", str(seed), "--threads", threads]
        stats = picture.with_suffix(".json")
        folder = self.folder(shot["name"], renderer)
        if renderer == "rayo":
            command = [self.rayo, "render", shot["scene"], "-q", "-o", picture, "--stats", stats, *common]
            command += ["--uniform"] * self.options.uniform
        elif renderer == "cycles":
            command = [sys.executable, folder / "scene.py", "--output", picture, *common]
        else:
            command = [sys.executable, HERE / "mitsuba_run.py", folder, picture, *common, *["--once"] * once]
        log, taken = picture.with_suffix(".log"), picture.with_suffix(".took")
        load = os.getloadavg()[0]
        spawn = [sys.executable, "-IS", ROOT / "benches/spawn.py", taken, log]
        subprocess.run([str(part) for part in spawn + command], check=True)
        took = json.loads(taken.read_text())
        said = log.read_text(errors="replace")
        if took["exit"] != 0 or not picture.is_file():
            sys.exit(f"{renderer} failed on {shot['name']} ({took['exit']}); the end of {log}:\n" + said[-2000:])
        run = {"process_seconds": took["seconds"], "peak_bytes": took["peak_bytes"], "load_before": load}
        if renderer == "rayo":
            counts = json.loads(stats.read_text())
            phases = counts["seconds"]
            run["render_seconds"] = phases["render"]
            run["phases"] = phases
            run["rays"] = counts["rays"]["total"]
        elif renderer == "cycles":
            run["render_seconds"] = spoken(said, "RENDER_SECONDS")
        else:
            run["render_seconds"] = spoken(said, "WARM_SECONDS")
            if not once:
                run["cold_seconds"] = spoken(said, "COLD_SECONDS")
                run["process_seconds"] -= run["render_seconds"]
        return run

    def reference(self, shot, renderer):
        """The renderer's own converged picture, rendered where it is not there yet."""
        samples = self.options.reference_samples
        file = self.out / f"references/{shot['name']}-{renderer}-{samples}-{shot['digest']}.exr"
        if not file.is_file():
            say(f"{shot['name']}: converged picture of {renderer}, {samples} samples")
            part = file.with_name("part-" + file.name)
            self.render(shot, renderer, samples, REFERENCE_SEED, part, once=True)
            part.rename(file)
        self.references[shot["name"], renderer] = self.error.read(file)

    def measure(self, shots):
        runs = []
        picture = self.out / "runs/picture.exr"
        for shot in shots:
            name = shot["name"]
            for repeat in range(self.options.repeat):
                for place, samples in enumerate(self.options.samples):
                    turn = (repeat + place) % len(shot["renderers"])
                    for renderer in shot["renderers"][turn:] + shot["renderers"][:turn]:
                        picture.unlink(missing_ok=True)
                        run = self.render(shot, renderer, samples, 1 + repeat, picture)
                        found, reference = self.error.read(picture), self.references[name, renderer]
                        run |= {"shot": name, "renderer": renderer, "samples": samples, "repeat": repeat}
                        run["rel_mse"] = self.error.rel_mse(found, reference)
                        run["mean_ratio"] = self.error.mean_luminance(found) / self.error.mean_luminance(reference)
                        runs.append(run)
                        say(
                            f"{name:12} {renderer:8} {samples:4} samples: {run['render_seconds']:7.2f} s "
                            f"({run['process_seconds']:6.2f} s in all), relMSE {run['rel_mse']:.3e}"
                        )
                self.save(shots, runs)

    def save(self, shots, runs):
        options = self.options
        results = {
            "date": datetime.date.today().isoformat(),
            "machine": {"processor": processor(), "threads": options.threads, "system": platform.platform()},
            "versions": self.versions(),
            "settings": {
                "samples": options.samples,
                "repeat": options.repeat,
                "reference_samples": options.reference_samples,
                "quick": options.quick,
            },
            "shots": [{key: shot[key] for key in ("name", "size", "renderers", "notes")} for shot in shots],
            "runs": runs,
        }
        file = self.out / "results.json"
        part = file.with_suffix(".part")
        part.write_text(json.dumps(results, indent=1) + "\n")
        part.rename(file)

    def versions(self):
        from importlib.metadata import version

        commit = ""
        if shutil.which("git"):
            said = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True)
            commit = said.stdout.strip()
        rayo = subprocess.run([self.rayo, "--version"], capture_output=True, text=True).stdout.split()[-1]
        return {
            "rayo": f"{rayo} {commit}".strip(),
            "cycles": f"Blender {version('bpy')} Cycles",
            "mitsuba": f"Mitsuba {version('mitsuba')} llvm_ad_rgb",
        }


# Text of scene files


def without_section(text, name):
    """Up to the next line that begins with a bracket."""
    return re.sub(rf"(?m)^\[{name}\][^\n]*\n(?:(?!\[)[^\n]*(?:\n|\Z))*", "", text)


def with_found_files(text, base):
    """File names made absolute; they start from the folder of the scene, or from that of the sample assets."""
    assets = os.environ.get("RAYO_SAMPLE_ASSETS")

    def absolute(match):
        for folder in filter(None, (base, assets)):
            if (file := Path(folder) / match[2]).is_file():
                return f'{match[1]}"{file.resolve()}"'
        raise FileNotFoundError(f"{match[2]} is not there; RAYO_SAMPLE_ASSETS " + (f"is {assets}" if assets else "does not name a folder"))

    return re.sub(r'(?<![\w-])((?:file|image)\s*=\s*)"([^"]+)"', absolute, without_section(text, "output"))


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {item}" for key, item in value.items()) + " }"
    return str(value)


def spoken(said, name):
    match = re.search(rf"^{name} ([\d.]+)", said, re.MULTILINE)
    if not match:
        sys.exit(f"no {name} in what a peer said:\n{said[-2000:]}")
    return float(match[1])


def processor():
    try:
        return re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())[1]
    except (OSError, TypeError):
        return platform.processor() or "unknown"


def say(line):
    print(line, flush=True)


if __name__ == "__main__":
    main()
