"""Drawings of buildings whose truth is known: walls, doors, windows, rooms and plans from them.

    python -m tests.benchmarks.bench_drawings [--write docs/benchmarks/drawings.md] [--only walls]

1. floors of duplex, fzk-haus and the synthetic school, drawn from their meshes by ezdxf (tests/drawings), and of that
   by ezdxf's add-on as PDF and as picture, are read back and compared with the section that they were drawn from;
2. seven floors of MLSTRUCT-FP as pictures, beside their 384 rectangles of walls;
3. plans from drawings beside those from the IFC without furniture, and their stations evaluated on that.

The models and pictures lie in ../shared/data. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ezdxf
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import shapely
from ezdxf import bbox
from ezdxf.addons.drawing import Frontend, RenderContext
from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration
from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
from scipy.sparse.csgraph import shortest_path

from planner_core.drawings.drawing import Drawing
from planner_core.drawings.dxf import read_dxf
from planner_core.drawings.floor_plan import FloorPlan, floor_plans
from planner_core.drawings.openings import OpeningKind
from planner_core.drawings.pdf import read_pdf
from planner_core.drawings.pictures import read_picture
from planner_core.drawings.scales import PageScale, scaled
from planner_core.model import Scene
from planner_core.scene.load import load_scene
from scenes_synthetic import build, write
from tests.drawings.drawn_buildings import draw, openings_at

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FLOORS = (
    ("duplex", "level 1", 1.2),
    ("duplex", "level 2", 4.3),
    ("fzk-haus", "ground floor", 1.2),
    ("school", "F0", 1.2),
)
SCALE = 50
NEAR_M = 0.02


# ------------------------------------------------------------------------------------------- round trips
def walls_of(plan: FloorPlan) -> Any:
    return shapely.union_all([piece.area for piece in plan.walls])


def figures(plan: FloorPlan, truth: Any, scene: Scene, z_m: float) -> list[str]:
    """Overlap, outlines farther off than 2 cm, and doors, windows, rooms found of those that there are."""
    walls = walls_of(plan)
    move = np.array(truth.bounds[:2]) - walls.bounds[:2]
    walls = shapely.transform(walls, lambda at: at + move)
    share = walls.intersection(truth).area / walls.union(truth).area
    off_m = walls.boundary.difference(truth.boundary.buffer(NEAR_M)).length
    off_m += truth.boundary.difference(walls.boundary.buffer(NEAR_M)).length
    kinds = [opening.kind for opening in plan.openings]
    rooms = sum(low[2] < z_m < high[2] for low, high in (room.box_m for room in scene.rooms))
    return [
        f"{share:.3f}",
        f"{off_m:.2f}",
        f"{kinds.count(OpeningKind.DOOR)} of {len(openings_at(scene, 'IfcDoor', z_m))}",
        f"{kinds.count(OpeningKind.WINDOW)} of {len(openings_at(scene, 'IfcWindow', z_m))}",
        f"{len(plan.rooms)} ({rooms})",
    ]


def rendered(source: Path, target: Path) -> None:
    """Draw a DXF in millimetres at 1:50 by ezdxf's add-on for matplotlib."""
    document = ezdxf.readfile(source)
    box = bbox.extents(document.modelspace())
    mm_of_inch = 25.4 * SCALE
    width, height = (box.size.x + 1000) / mm_of_inch, (box.size.y + 1000) / mm_of_inch
    figure = plt.figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    look = Configuration(color_policy=ColorPolicy.BLACK, background_policy=BackgroundPolicy.WHITE)
    Frontend(RenderContext(document), MatplotlibBackend(axes), config=look).draw_layout(
        document.modelspace(), finalize=False
    )
    axes.set_xlim(box.extmin.x - 500, box.extmin.x - 500 + width * mm_of_inch)
    axes.set_ylim(box.extmin.y - 500, box.extmin.y - 500 + height * mm_of_inch)
    axes.set_aspect("equal", adjustable="datalim")
    figure.savefig(target, dpi=200)
    plt.close(figure)


def page(drawing: Drawing) -> FloorPlan:
    return floor_plans(scaled(drawing, PageScale(ratio=SCALE)), unit_m=1.0)[0]


def round_trips(folder: Path, scenes: dict[str, Scene]) -> Iterator[str]:
    yield (
        "| floor | drawn by | overlap of walls | outlines off by more than 2 cm, m "
        "| doors | windows | rooms (in the IFC) |"
    )
    yield "|---|---|---|---|---|---|---|"
    for name, floor, z_m in FLOORS:
        scene = scenes[name]
        path = folder / f"{name}-{z_m}.dxf"
        truth = draw(scene, z_m, path)
        plans = {"ezdxf, DXF with layers": floor_plans(read_dxf(str(path)))[0]}
        for suffix in ("pdf", "png"):
            rendered(path, path.with_suffix(f".{suffix}"))
        plans["ezdxf's add-on, PDF of one pen"] = page(read_pdf(str(path.with_suffix(".pdf"))))
        plans["ezdxf's add-on, PNG of 200 dpi"] = page(read_picture(str(path.with_suffix(".png"))))
        for way, plan in plans.items():
            yield " | ".join([f"| {name}, {floor}", way, *figures(plan, truth, scene, z_m)]) + " |"


# ---------------------------------------------------------------------------------------------- MLSTRUCT-FP
def pictures() -> Iterator[str]:
    yield "| floor | layer | overlap | recall | precision | walls, m² |"
    yield "|---|---|---|---|---|---|"
    truth = json.loads((DATA / "plans2d" / "fp.json").read_text())
    for floor, entry in truth["floor"].items():
        drawing = read_picture(str(DATA / "plans2d" / entry["image"]))
        assert drawing.page_height is not None
        points = drawing.points - [0.0, drawing.page_height, 0.0]
        in_metres = Drawing(**{**drawing.__dict__, "points": points / entry["scale"], "page_height": None})
        (plan,) = floor_plans(in_metres, unit_m=1.0)
        walls = walls_of(plan)
        rects = [r for r in truth["rect"].values() if str(r["floorID"]) == floor]
        true = shapely.union_all([shapely.Polygon(list(zip(r["x"], r["y"], strict=True))) for r in rects])
        low, high = in_metres.points[:, :2].min(axis=0), in_metres.points[:, :2].max(axis=0)
        true = true.intersection(shapely.box(*low, *high))  # one picture is cut off before its walls are
        both = walls.intersection(true).area
        layer = plan.warnings[0].partition("on layer ")[2].partition(" ")[0].rstrip(";")
        yield (
            f"| {floor} | {layer} | {both / walls.union(true).area:.3f} | {both / true.area:.3f} | "
            f"{both / walls.area:.3f} | {true.area:.1f} |"
        )


# ---------------------------------------------------------------------------------------------- plans
def tlsplan(*words: object) -> dict[str, Any]:
    command = [sys.executable, "-m", "tlsplan", *map(str, words), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # 3: what can't be met is reported
    found: dict[str, Any] = json.loads(done.stdout)
    return found


BUILDINGS: tuple[tuple[str, tuple[str, ...], str | None], ...] = (
    ("duplex", ("--leave-out", "IfcFurnishingElement"), "2.6"),
    ("fzk-haus", (), None),
    ("house", ("--leave-out", "IfcFurniture"), None),
)
"""Names, options of the plan from the IFC, and the height of its suspended ceilings, metres."""


def plans(folder: Path) -> Iterator[str]:
    yield "| building | plan from | stations | coverage, % | of the IFC, % | path, m | links | without a path, % |"
    yield "|---|---|---|---|---|---|---|---|"
    for name, bare, ceiling in BUILDINGS:
        ifc = DATA / "ifc" / f"{name}.ifc"
        if not ifc.is_file():
            ifc = folder / f"{name}.ifc"
            write(build(name), ifc)
        of_ifc = folder / f"{name}-ifc"
        whole = tlsplan("plan", ifc, *bare, "-o", of_ifc, "--effort", "quick")
        drawn = folder / f"{name}.dxf"
        subprocess.run(
            [sys.executable, "-m", "tlsplan", "export", str(of_ifc), "--format", "dxf", "-o", str(drawn)], check=True
        )
        yield _row(name, "its IFC", whole, "")
        for height in (None, ceiling) if ceiling else (None,):
            words = ("--room-height", height) if height else ()
            of_drawing = folder / f"{name}-drawing{height or ''}"
            lifted = tlsplan("plan", drawn, "-o", of_drawing, "--effort", "quick", *words)
            judged = tlsplan("evaluate", ifc, *bare, "--stations", of_drawing / "plan.json")
            yield _row(name, " ".join(["our DXF of it", *words]), lifted, percent(judged))


def _row(name: str, way: str, document: dict[str, Any], on_ifc: str) -> str:
    length_m, n_links, lost = path_lengths(document)
    return (
        f"| {name} | {way} | {len(document['stations'])} | {percent(document)} | {on_ifc} | {length_m:.1f} | "
        f"{n_links:.2f} | {100 * lost:.0f} |"
    )


def path_lengths(document: dict[str, Any]) -> tuple[float, float, float]:
    """Mean shortest path between stations through links that register, metres and links; share of pairs without one."""
    at = np.array([station["position"] for station in document["stations"]])
    row_of = {station["id"]: row for row, station in enumerate(document["stations"])}
    rules = document["registration"]
    metres, links = np.zeros((len(at), len(at))), np.zeros((len(at), len(at)))
    for link in rules["links"]:
        if link["probability"] < rules["min_probability"] or link["strength"] < rules["min_strength"]:
            continue
        a, b = row_of[link["a"]], row_of[link["b"]]
        metres[a, b], links[a, b] = np.linalg.norm(at[a] - at[b]), 1.0
    pairs = np.triu_indices(len(at), 1)
    length_m, n_links = (shortest_path(each, directed=False)[pairs] for each in (metres, links))
    is_joined = np.isfinite(length_m)
    return float(length_m[is_joined].mean()), float(n_links[is_joined].mean()), float(1.0 - is_joined.mean())


def percent(document: dict[str, Any]) -> str:
    return f"{100 * document['coverage']['fraction_of_achievable']:.1f}"


def put(page: Path, mark: str, rows: list[str]) -> None:
    """Write rows between the page's comments of a name."""
    begin, end = f"<!-- {mark} -->\n", f"<!-- end {mark} -->"
    head, _, rest = page.read_text(encoding="utf-8").partition(begin)
    _, _, tail = rest.partition(end)
    page.write_text(head + begin + "\n".join(rows) + "\n" + end + tail, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--only", choices=["walls", "pictures", "plans"])
    given = parser.parse_args()
    mpl.use("Agg")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        school = folder / "school.ifc"
        write(build("school"), school)
        scenes = {"school": load_scene(school)}
        scenes |= {name: load_scene(DATA / "ifc" / f"{name}.ifc") for name in ("duplex", "fzk-haus")}
        for mark, rows in (("walls", round_trips(folder, scenes)), ("pictures", pictures()), ("plans", plans(folder))):
            made = []
            for row in rows if given.only in (None, mark) else ():
                made.append(row)
                print(row, flush=True)
            if given.write and made:
                put(given.write, mark, made)


if __name__ == "__main__":
    main()
