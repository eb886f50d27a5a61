"""Models that nobody here made: the floors found in each, with a picture, and the stations that crews would carry.

    python tests/benchmarks/bench_real_buildings.py [--write docs/benchmarks/real-buildings.md] [--floors-only]

Floors: against what is expected by hand (tests/scene/real_buildings.py). Plans: of the usual settings and `--effort
quick`, each in a process of its own, which tells its time and its greatest memory; for scanners that crews have. The
models lie in ../shared/data. Plans that were made are kept below build/, and made once. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from planner_core.errors import SceneError
from planner_core.model import FloatArray, Scene
from planner_core.scene.floors import FloorReport, find_floors
from planner_core.scene.level_surfaces import WALL_CUT_M, cut_length
from planner_core.scene.load import LoadOptions, load_scene
from tests.scene.real_buildings import EXPECTED

REPOSITORY = Path(__file__).resolve().parents[2]
DATA = REPOSITORY.parent / "shared" / "data"
PICTURES = REPOSITORY / "docs" / "images" / "real-buildings"
STORE = REPOSITORY / "build" / "real-buildings"
BLOCK = "schependomlaan, eight files"
PLANNED = {
    "duplex": [DATA / "ifc" / "duplex.ifc"],
    "fzk-haus": [DATA / "ifc" / "fzk-haus.ifc"],
    "sample house": [DATA / "corpus" / "ifc-samplehouse-revit2015-ifc4.ifc"],
    "Angel house": [DATA / "corpus" / "obj-angelhouse-telaviv-rhino.obj"],
    BLOCK: [DATA / "corpus" / name for name in EXPECTED[BLOCK].files],
}
SCANNERS = ("rtc360", "blk360-g2", "x7", "focus-premium-70")
#: Those of the two large buildings, which take minutes each.
SCANNERS_OF = {"Angel house": SCANNERS[:1], BLOCK: SCANNERS[:1]}


# ------------------------------------------------------------------------------------------------ floors
def floors_of(name: str) -> tuple[Scene, FloorReport]:
    files = [DATA / "corpus" / file for file in EXPECTED[name].files or (name,)]
    scene = load_scene(files, options=LoadOptions(up_axis=EXPECTED[name].up))
    return scene, find_floors(scene)


def floor_row(name: str, report: FloorReport, scene: Scene) -> str:
    expected = EXPECTED[name]
    found = [(floor.name, floor.elevation_m + float(scene.offset_m[2])) for floor in report.floors]
    right = [n for n, _ in found] == [n for n, _ in expected.floors] and np.allclose(
        [z for _, z in found], [z for _, z in expected.floors], atol=0.1
    )
    listed = "; ".join(
        f"{floor.name} {z:.2f} m, {floor.ground_area_m2:.0f} m²"
        for floor, (_, z) in zip(report.floors, found, strict=True)
    )
    picture = f"[picture](../images/real-buildings/{picture_name(name)})"
    return f"| {name} | {listed or 'none: refused'} | {'yes' if right else '**no**'} | {expected.why} | {picture} |"


def picture_name(name: str) -> str:
    return f"{re.sub('[^a-z0-9]+', '-', name.lower())}.png"


def draw(name: str, scene: Scene, report: FloorReport) -> None:
    """Two sections with the floors' heights, and each floor from above: walls cut, ground filled."""
    corners_m = scene.vertices_m[scene.triangles]
    n_views = 2 + len(report.floors)
    n_columns = min(4, n_views)
    n_rows = -(-n_views // n_columns)
    figure, grid = plt.subplots(n_rows, n_columns, figsize=(5 * n_columns, 3.6 * n_rows), squeeze=False)
    axes: list[Axes] = list(grid.ravel())
    for axis, view in ((1, axes[0]), (0, axes[1])):
        _draw_section(view, corners_m, axis, report)
    for floor, view in zip(report.floors, axes[2:], strict=False):
        ground = corners_m[floor.ground_triangles][:, :, :2]
        view.add_collection(PolyCollection(list(ground), facecolors="#b7dfbe", edgecolors="none"))
        if not len(ground):
            low, high = floor.bounds_m
            view.fill([low[0], high[0], high[0], low[0]], [low[1], low[1], high[1], high[1]], color="#e6f0d8")
        view.add_collection(LineCollection(_segments(corners_m, floor.elevation_m + WALL_CUT_M), lw=0.5, colors="k"))
        view.set_title(f"{floor.id} {floor.name}, {floor.origin}", fontsize=8)
    for view in axes:
        view.autoscale()
        view.set_aspect("equal")
        view.axis("off")
    PICTURES.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURES / picture_name(name), dpi=60, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def _segments(corners_m: FloatArray, height_m: float) -> list[FloatArray]:
    return list(cut_length(corners_m, height_m)[1])


def _draw_section(view: Axes, corners_m: FloatArray, axis: int, report: FloorReport) -> None:
    """What a vertical plane through the middle cuts."""
    turned = corners_m[:, :, [1, 2, 0] if axis == 0 else [0, 2, 1]]
    at_m = float(np.median(turned[:, :, 2])) + 0.137  # off the round figures that walls stand at
    view.add_collection(LineCollection(_segments(turned, at_m), lw=0.5, colors="k"))
    for number, floor in enumerate(report.floors):
        view.axhline(floor.elevation_m, color=f"C{number}", lw=1)
        view.text(
            0, floor.elevation_m, floor.name, color=f"C{number}", transform=view.get_yaxis_transform(), fontsize=8
        )
    view.set_title(f"section across {'xy'[axis]}", fontsize=8)


# ------------------------------------------------------------------------------------------------- plans
def planned(title: str, files: list[Path], scanner: str) -> dict[str, Any]:
    """Figures of one plan; made in a process of its own unless they are there."""
    store = STORE / f"{picture_name(title)[:-4]}-{scanner}.json"
    if store.is_file():
        found: dict[str, Any] = json.loads(store.read_text())
        return found
    folder = STORE / store.stem
    command = [sys.executable, "-m", "tlsplan", "plan", *map(str, files), "-o", str(folder), "--overwrite"]
    command += ["--scanner", scanner, "--effort", "quick"]
    began = time.monotonic()
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    writing_began = None
    assert process.stderr is not None
    for line in process.stderr:
        if writing_began is None and line.startswith("export:"):
            writing_began = time.monotonic()
    _, status, used = os.wait4(process.pid, 0)  # of this process alone
    code, ended = os.waitstatus_to_exitcode(status), time.monotonic()
    if code:
        raise SystemExit(f"{' '.join(command)} ended with {code}")
    document = json.loads((folder / "plan.json").read_text())
    figures = {
        "stations": len(document["stations"]),
        "ground_m2": sum(floor["ground_area_m2"] for floor in document["floors"]),
        "coverage": document["coverage"]["fraction_of_achievable"],
        "groups": len(document["registration"]["networks"]),
        "field_s": (document.get("field_time") or {}).get("total_s"),
        "cpu_s": used.ru_utime + used.ru_stime,
        "writing": 0.0 if writing_began is None else (ended - writing_began) / (ended - began),
        "peak_mb": used.ru_maxrss / 1024,
        "mb": sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 2**20,
    }
    store.write_text(json.dumps(figures))
    return figures


def plan_row(title: str, scanner: str, plan: dict[str, Any]) -> str:
    per_1000 = 1000 * plan["stations"] / plan["ground_m2"]
    field = "" if plan["field_s"] is None else f"{plan['field_s'] / 60:.0f}"
    return (
        f"| {title}, {plan['ground_m2']:.0f} m² | {scanner} | {plan['stations']} | {per_1000:.0f} | "
        f"{100 * plan['coverage']:.1f} | {plan['groups']} | {field} | {plan['cpu_s']:.0f} | "
        f"{100 * plan['writing']:.0f} | {plan['mb']:.0f} | {plan['peak_mb']:.0f} |"
    )


# -------------------------------------------------------------------------------------------------- page
def put(page: Path, name: str, rows: list[str]) -> None:
    """Replace what stands between the page's marks of that name."""
    text = page.read_text(encoding="utf-8")
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    head, _, rest = text.partition(begin)
    _, _, tail = rest.partition(end)
    page.write_text(head + begin + "\n".join(rows) + "\n" + end + tail, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--floors-only", action="store_true")
    asked = parser.parse_args()
    mpl.use("Agg")
    rows = ["| file | floors found | as expected | why | |", "|---|---|---|---|---|"]
    for name in EXPECTED:
        try:
            scene, report = floors_of(name)
        except SceneError as error:
            rows.append(f"| {name} | refused: {error} | **no** | {EXPECTED[name].why} | |")
            continue
        draw(name, scene, report)
        rows.append(floor_row(name, report, scene))
        print(rows[-1], flush=True)
    if asked.write:
        put(asked.write, "floors", rows)
    if asked.floors_only:
        return
    STORE.mkdir(parents=True, exist_ok=True)
    rows = [
        "| model, ground | scanner | stations | per 1000 m² | covered % | groups | field min | processor s | "
        "writing % | folder MB | memory MB |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for title, files in PLANNED.items():
        for scanner in SCANNERS_OF.get(title, SCANNERS):
            rows.append(plan_row(title, scanner, planned(title, files, scanner)))
            print(rows[-1], flush=True)
            if asked.write:
                put(asked.write, "plans", rows)


if __name__ == "__main__":
    main()
