"""Kernels on a GPU, in eight minutes, on a machine from which nothing can be fetched.

    python -m tests.benchmarks.bench_gpu pack FOLDER
    python3 tests/benchmarks/bench_gpu.py run FOLDER --write results.json [--quick] [--cpu]
    python -m tests.benchmarks.bench_gpu page results.json --write docs/benchmarks/gpu.md

`pack` needs the development environment: it keeps scenes, stations, selection problems, and what Open3D and this
machine's processor compute of them. `run` needs this checkout, the folder, and Python with NumPy and numba, for tests
also pytest and hypothesis; it unpacks the wheels in the folder, pyopencl above all (`make bench-gpu-pack`). It finds
the GPU's driver, also where no loader names it, and does each step in a process of its own within a limit of time: what
fails or takes too long costs its own rows. `--cpu` takes a processor in place of a GPU, `--quick` does less of all.

Times are by the clock, medians; kernels are compiled before the clock starts. Not a test: nothing here can fail.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
#: Drivers of GPUs, and where they lie on machines whose loader does not know them.
DRIVERS = ("libnvidia-opencl.so.1", "libamdocl64.so", "libigdrcl.so")
FOLDERS = (
    "/usr/local/nvidia/lib64",
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib64",
    "/opt/rocm/lib",
    "/usr/local/cuda/lib64",
)
#: Seconds that each step may take, in the order of steps, and all together.
LIMITS_S = {"check": 150, "kernels": 60, "tune": 110, "scale": 60, "scans": 130, "genetic": 60, "tests": 60}
ALL_S = 470.0
#: Below tests/: those of kernels that need neither Open3D nor files of buildings.
TESTS = ("engine", "kernels/test_patch_header.py", "device/test_sort.py", "paper/genetic")
GOAL_CANDIDATES = 10_000
OFFICES = {"synthetic office": (36, 3), "finely tessellated office": (16, 20)}
Rows = list[dict[str, Any]]


# ------------------------------------------------------------------------------------------------- pack
def pack(folder: Path) -> None:
    """Keep what `run` needs."""
    import numpy as np

    from planner_core.device import open_device
    from planner_core.engine.open3d import Open3DEngine
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scanner.template import make_template
    from planner_core.scene.load import load_scene
    from planner_core.scene.patches import make_patches
    from tests.benchmarks import bench_scan
    from tests.benchmarks.bench_genetic import house, tasks
    from tests.benchmarks.offices import office

    folder.mkdir(parents=True, exist_ok=True)
    duplex = bench_scan.IFC_FOLDER / "duplex.ifc"
    scenes = {name: office(*size, seed=1) for name, size in OFFICES.items()}
    scenes["duplex" if duplex.exists() else "house"] = load_scene(duplex) if duplex.exists() else house()
    for name, scene in scenes.items():
        inside = bench_scan.stations_of(scene, GOAL_CANDIDATES, bench_scan.raycasting_of(scene))
        oracle = Open3DEngine(scene, make_patches(scene, max_area_m2=bench_scan.PATCH_AREA_M2))
        scan = oracle.scan(make_template(load_scanner("hdl-64e")), inside[:2])
        held = {"stations": inside, "triangle": scan.triangle, "range_m": scan.range_m.astype(np.float32)}
        if name not in OFFICES:
            fields = ("vertices_m", "triangles", "element_of_triangle", "optics_of_triangle")
            held |= {field: getattr(scene, field) for field in fields if getattr(scene, field) is not None}
        np.savez_compressed(folder / f"{name}.scene.npz", **held)
    for each in tasks(open_device(), quick=False):
        np.savez_compressed(folder / f"{each.name}.problem.npz", **vars(each.problem))
    (folder / "kernels.json").write_text(exercised("cpu"), encoding="utf-8")


def exercised(kind: str) -> str:
    """Names of all kernels, and a hash of what they compute, as JSON."""
    command = [sys.executable, str(ROOT / "tests" / "kernels" / "exercise_kernels.py"), kind]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit((done.stderr.strip().splitlines() or ["no message"])[-1])
    return done.stdout.strip().splitlines()[-1]


# -------------------------------------------------------------------------------------------------- run
def run(folder: Path, only: list[str], *, quick: bool, on_cpu: bool) -> dict[str, Any]:
    """Do these steps; rows by step, each with the seconds that it took and why it ended early."""
    found: dict[str, Any] = {"date": time.strftime("%Y-%m-%d"), "steps": {}}
    with tempfile.TemporaryDirectory() as scratch:
        env = surroundings(folder, Path(scratch), on_cpu=on_cpu)
        deadline = time.monotonic() + ALL_S
        for step, limit_s in ((step, LIMITS_S[step]) for step in only):
            started = time.monotonic()
            left_s = min(limit_s, deadline - started)
            command = [sys.executable, "-m", "tests.benchmarks.bench_gpu", "step", str(folder), "--step", step]
            rows, ended = child([*command, *(["--quick"] if quick else [])], env, left_s)
            took_s = round(time.monotonic() - started, 1)
            found["steps"][step] = {"rows": rows, "ended": ended, "seconds": took_s}
            print(f"{step}: {took_s} s, {len(rows)} rows{'; ' + ended if ended else ''}", flush=True)
    return found


def surroundings(folder: Path, scratch: Path, *, on_cpu: bool) -> dict[str, str]:
    """The environment of steps: wheels unpacked, packages under the names they are installed by, a driver named."""
    for wheel in sorted((folder / "wheels").glob("*.whl")):
        zipfile.ZipFile(wheel).extractall(scratch / "site")
    packages = scratch / "packages"
    (packages / "planner_core").mkdir(parents=True)
    for entry in (ROOT / "planner_core").iterdir():
        (packages / "planner_core" / entry.name).symlink_to(entry)
    for name, target in (
        ("planner_core/kernels", "kernels"),
        ("scenes_synthetic", "scenes_synthetic"),
        ("tests", "tests"),
    ):
        (packages / name).symlink_to(ROOT / target)
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (packages, scratch / "site")))}
    env |= {"TLSPLAN_CACHE": str(scratch / "cache"), "TLSPLAN_GPU_SCRATCH": str(scratch)}
    folders = [*os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep), *FOLDERS]
    libraries = [path for name in DRIVERS for each in folders if (path := Path(each, name)).exists()]
    if libraries and not on_cpu:
        vendors = scratch / "vendors"
        vendors.mkdir()
        (vendors / "gpu.icd").write_text(f"{libraries[0]}\n")
        env["OCL_ICD_VENDORS"] = str(vendors)
    return env


def child(command: list[str], env: dict[str, str], limit_s: float) -> tuple[Rows, str]:
    """Rows that a step printed, a line each, and why it ended early."""
    if limit_s <= 0:
        return [], "no time was left"
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        group = subprocess.Popen(
            command, env=env, stdout=out, stderr=err, cwd=env["TLSPLAN_GPU_SCRATCH"], start_new_session=True
        )
        try:
            code = group.wait(limit_s)
            ended = "" if code == 0 else f"ended with {code}: "
        except subprocess.TimeoutExpired:
            os.killpg(group.pid, signal.SIGKILL)
            ended = f"not done after {limit_s:.0f} s: "
        out.seek(0), err.seek(0)
        rows = [json.loads(line) for line in out if line.startswith("{")]
        last = (err.read().strip().splitlines() or [""])[-1][:300]
    return rows, f"{ended}{last}" if ended else ""


def row(**values: Any) -> None:
    """Print a row of a step."""
    print(
        json.dumps({key: round(value, 6) if isinstance(value, float) else value for key, value in values.items()}),
        flush=True,
    )


def median_ms(work: Callable[[], object], rounds: int) -> float:
    """The first call, which compiles, does not count."""
    work()
    times = []
    for _ in range(rounds):
        started = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - started))
    return sorted(times)[len(times) // 2]


class Subject:
    """One of the packed scenes."""

    def __init__(self, folder: Path, name: str) -> None:
        import numpy as np

        from planner_core.scene.patches import make_patches
        from tests.benchmarks.offices import office, scene_of

        self.held = dict(np.load(folder / f"{name}.scene.npz"))
        self.stations = self.held["stations"]
        self.scene = (
            office(*OFFICES[name], seed=1)
            if name in OFFICES
            else scene_of(self.held["vertices_m"], self.held["triangles"])
        )
        self.scene.__dict__.update(
            {k: v for k, v in self.held.items() if k in ("element_of_triangle", "optics_of_triangle")}
        )
        self.patches = make_patches(self.scene, max_area_m2=0.04)


def check(folder: Path, *, quick: bool) -> None:
    """The device, and what `tlsplan doctor` finds of it; compiles all kernels."""
    import numpy

    from planner_core.device.choice import in_order_of_preference, list_devices, problem_of_device
    from tests.benchmarks.offices import processor

    for info in in_order_of_preference(list_devices()):
        started = time.perf_counter()
        problem = problem_of_device(info, anew=True)
        row(
            device=info.name, platform=info.platform, version=info.version, kind=info.kind, units=info.n_compute_units,
            memory_gib=info.memory_bytes / 2**30, problem=problem, seconds=time.perf_counter() - started,
            processor=processor(), n_cores=os.cpu_count(), python=platform.python_version(), numpy=numpy.__version__,
        )  # fmt: skip


def kernels(folder: Path, *, quick: bool) -> None:
    """Whether every kernel computes what it does on a processor, to the bit."""
    ours, theirs = json.loads(exercised("gpu")), json.loads((folder / "kernels.json").read_text(encoding="utf-8"))
    pairs = zip(ours["each"], theirs["each"], strict=True)
    others = [f"{number} {mine}" for number, (mine, its) in enumerate(pairs) if mine != its]
    row(n_kernels=len(ours["kernels"]), same_bits=ours["results"] == theirs["results"], others=others)


def tune(folder: Path, *, quick: bool) -> None:
    """The shape of tiles that suits the device: kept for the next steps, as by `tlsplan tune`."""
    from planner_core.device import open_device
    from planner_core.engine import patch_mode
    from planner_core.engine.opencl import OpenCLEngine
    from planner_core.engine.patch_mode import PatchMode
    from planner_core.engine.tuning import keep_shape, measure_shapes, shapes_to_try, tile_shape
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scanner.template import make_template

    device, subject = open_device(), Subject(folder, "synthetic office")
    engine = OpenCLEngine(subject.scene, subject.patches, device)
    template, at = make_template(load_scanner("hdl-64e")), subject.stations[: 8 if quick else 256]
    milliseconds: dict[str, float] = {}
    best = shipped = tile_shape(device)
    deadline = time.monotonic() + 0.8 * LIMITS_S["tune"]
    for shape in shapes_to_try(device)[: 2 if quick else None]:
        if time.monotonic() > deadline:
            break
        ms = measure_shapes(engine, template, at, [shape], n_rounds=3).milliseconds[shape]
        row(shape="x".join(map(str, shape)), milliseconds=ms, is_shipped=shape == shipped)
        best = best if milliseconds and ms >= min(milliseconds.values()) else shape
        milliseconds[str(shape)] = ms
    keep_shape(device, best, milliseconds)
    mode, rtc360 = PatchMode(engine, subject.scene, subject.patches), make_template(load_scanner("rtc360"))
    for groups in (64, 16, 4, 1):
        patch_mode._GROUPS_A_RUN = {device.kind: groups}
        ms = median_ms(partial(mode.visible_patches, rtc360, at[:32]), 2) / len(at[:32])
        row(groups_of_patches=groups, milliseconds=ms)


def scale(folder: Path, *, quick: bool) -> None:
    """The goal: what 10 000 candidates of an HDL-64E see in 2.6 million triangles, tree included."""
    from dataclasses import replace

    import numpy as np

    from planner_core.device import open_device
    from planner_core.engine.opencl import OpenCLEngine
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scanner.template import make_template

    device, subject = open_device(), Subject(folder, "synthetic office" if quick else "finely tessellated office")
    n_candidates = 8 if quick else GOAL_CANDIDATES
    candidates = np.resize(subject.stations, (n_candidates, 3))
    for range_m in (5.0, np.inf):
        template = replace(make_template(load_scanner("hdl-64e")), range_max_m=range_m)
        OpenCLEngine(subject.scene, subject.patches, device).visible_patches(template, candidates[:4])  # compiles
        started = time.perf_counter()
        engine = OpenCLEngine(subject.scene, subject.patches, device)
        built = time.perf_counter()
        seen = engine.visible_patches(template, candidates)
        done = time.perf_counter()
        row(
            n_candidates=n_candidates, n_triangles=subject.scene.n_triangles, range_m=min(range_m, 1e9),
            tree_s=built - started, visibility_s=done - built, n_seen=int(seen.patch.size),
            n_beams=int(np.prod(template.shape)),
        )  # fmt: skip


def scans(folder: Path, *, quick: bool) -> None:
    """Trees, all results of scans, visibility, free rays and patch mode; agreement with Open3D."""
    from planner_core.device import open_device

    device = open_device()
    names = [file.name.removesuffix(".scene.npz") for file in sorted(folder.glob("*.scene.npz"))]
    for name in names:
        if not (quick and name.startswith("finely")):
            scan_scene(Subject(folder, name), name, device, quick=quick)


def scan_scene(subject: Subject, scene: str, device: Any, *, quick: bool) -> None:
    """The rows of one scene."""
    from dataclasses import replace

    import numpy as np

    from planner_core.engine.opencl import OpenCLEngine
    from planner_core.engine.patch_mode import PatchMode
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scanner.template import make_template
    from tests.benchmarks.offices import dome

    rounds, many = (1, 4) if quick else (3, 256)
    hdl, pandar, rtc360 = (make_template(load_scanner(each)) for each in ("hdl-64e", "pandar64", "rtc360"))
    engine = OpenCLEngine(subject.scene, subject.patches, device)
    at = np.resize(subject.stations, (many, 3))
    scan = engine.scan(hdl, subject.stations[:2])
    same = scan.triangle == subject.held["triangle"]
    apart_m = np.abs(scan.range_m - subject.held["range_m"])[same & (scan.triangle >= 0)]
    what = "beams that end on another triangle than Open3D's"
    row(scene=scene, what=what, share=float((~same).mean()), range_apart_mm=1e3 * float(apart_m.max()))
    row(scene=scene, what="tree", ms=median_ms(partial(OpenCLEngine, subject.scene, subject.patches, device), 3))
    templates = {"HDL-64E, 5 m": replace(hdl, range_max_m=5.0), "HDL-64E, no limit": replace(hdl, range_max_m=np.inf)}
    templates |= {"Pandar64, no limit": replace(pandar, range_max_m=np.inf), "dome of 2000 x 833": dome()}
    for what, template in templates.items():
        n_beams = int(np.prod(template.shape))
        row(
            scene=scene,
            what=what,
            n_beams=n_beams,
            scan_ms=median_ms(partial(engine.scan, template, at[:1]), 2 * rounds),
            of_eight_ms=median_ms(partial(engine.scan, template, at[:8]), rounds) / len(at[:8]),
            visibility_ms=median_ms(partial(engine.visible_patches, template, at), rounds) / many,
        )
    rng = np.random.default_rng(3)
    origins = rng.uniform(subject.scene.vertices_m.min(axis=0), subject.scene.vertices_m.max(axis=0), (300_000, 3))
    packed = np.concatenate([origins, rng.normal(size=origins.shape)], axis=1).astype(np.float32)
    packed[:, 3:] /= np.linalg.norm(packed[:, 3:], axis=1, keepdims=True)
    rays_ms = median_ms(partial(engine.cast_prepared, packed, range_max_m=np.inf), rounds)
    row(scene=scene, what="300 000 free rays", ms=rays_ms)
    mode, few = PatchMode(engine, subject.scene, subject.patches), at[:16]
    patches_ms = median_ms(partial(mode.visible_patches, rtc360, few), 1) / len(few)
    row(scene=scene, what="patch mode, RTC360 6 mm, a position", ms=patches_ms)


def genetic(folder: Path, *, quick: bool) -> None:
    """The method paper's figure 16: the loop on the device and on the host's cores, the same trajectory."""
    from dataclasses import replace

    import numpy as np

    from planner_core.device import open_device
    from planner_core.paper.genetic import GeneticSettings, select_genetic
    from planner_core.select.problem import CoverProblem

    device = open_device()
    generations = 4 if quick else 100
    base = GeneticSettings(max_iterations=generations, patience=generations + 1, expected_active=100.0)
    for population in (100,) if quick else (100, 500, 2000):
        for file in sorted(folder.glob("*.problem.npz"))[: 1 if quick else None]:
            name, problem = file.name.removesuffix(".problem.npz"), CoverProblem(**dict(np.load(file)))
            settings = replace(base, population=population, n_parents=population // 2)
            n_evaluations = population + generations * settings.n_offspring
            best, times = [], {}
            for engine in ("device", "host"):
                select_genetic(
                    problem,
                    replace(settings, max_iterations=1),
                    engine=engine,
                    device=device if engine == "device" else None,
                )
                started = time.perf_counter()
                result = select_genetic(problem, settings, engine=engine, device=device if engine == "device" else None)
                times[engine] = time.perf_counter() - started
                best.append(result.chosen)
            row(
                problem=name, n_candidates=problem.n_candidates, n_rows=problem.n_rows,
                population=population, n_evaluations=n_evaluations, device_s=times["device"], host_s=times["host"],
                same_set=bool(np.array_equal(*best)),
            )  # fmt: skip


def tests(folder: Path, *, quick: bool) -> None:
    """The suite's tests of kernels."""
    tree = Path(os.environ["TLSPLAN_GPU_SCRATCH"]) / "suite"
    for name in TESTS[1:2] if quick else TESTS:
        source, target = ROOT / "tests" / name, tree / "tests" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("*ifc*")) if source.is_dir() else shutil.copy(
            source, target
        )
    for each in ("machines/gpu/conftest.py", "slow_cases.py"):
        shutil.copy(ROOT / "tests" / each, tree / "tests")
    shutil.copy(ROOT / "pyproject.toml", tree)
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", "-p", "no:cacheprovider", "tests"]
    try:
        printed = subprocess.run(
            command, cwd=tree, capture_output=True, check=False, timeout=LIMITS_S["tests"] - 5
        ).stdout
        counts = ""
    except subprocess.TimeoutExpired as cut:
        printed = cut.stdout or b""
        counts = f"cut off: {printed.count(b'.')} passed, {printed.count(b'F') + printed.count(b'E')} failed until then"
    lines = printed.decode(errors="replace").strip().splitlines() or ["no output"]
    failed = [line[:200] for line in lines if line.startswith(("FAILED", "ERROR"))]
    row(counts=counts or lines[-1], failed=failed[:40])


STEPS = {each.__name__: each for each in (check, kernels, tune, scale, scans, genetic, tests)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["pack", "run", "page", "step"])
    parser.add_argument("path", type=Path)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--step", choices=STEPS)
    parser.add_argument("--only", nargs="+", choices=STEPS, help="these steps; the others stay as the file has them")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--cpu", action="store_true")
    options = parser.parse_args()
    if options.what == "pack":
        pack(options.path)
    elif options.what == "step":
        STEPS[options.step](options.path, quick=options.quick)
    else:
        if options.what == "run":
            found = run(options.path.resolve(), options.only or list(STEPS), quick=options.quick, on_cpu=options.cpu)
            if options.only and options.write is not None and options.write.exists():
                before = json.loads(options.write.read_text(encoding="utf-8"))
                found["steps"] = {**before["steps"], **found["steps"]}
            text = json.dumps(found, indent=1) + "\n"
        else:
            from tests.benchmarks.gpu_page import page

            text = page(json.loads(options.path.read_text(encoding="utf-8")))
        if options.write is None:
            print(text)
        else:
            options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
