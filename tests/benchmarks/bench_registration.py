"""How often pairs of scans register, by what a planner knows of them: the campaign, its table and the rule made of it.

    python -m tests.benchmarks.bench_registration [--scenes house,duplex] [--minutes N] [--write PAGE]

Rows are appended to docs/benchmarks/registration/SCENE.csv; run the command again to resume. It works in rounds of so
many pairs a scene, so that all scenes grow alike. `--write` makes the page's tables from all rows. Not a test: nothing
here fails.
"""

from __future__ import annotations

import argparse
import csv
import os
import time
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

# Before Open3D comes in: its threads wait for each other longer than they work on clouds as small as these.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import scenes_synthetic
from planner_core.model import Doors, FloatArray, Scene
from planner_core.scene.doors import without_door_leaves
from planner_core.scene.load import load_scene
from tests.benchmarks.bench_real_buildings import put
from tests.benchmarks.registration.clouds import moved, scan
from tests.benchmarks.registration.methods import METHODS, Prepared, prepare, without_start
from tests.benchmarks.registration.pairs import COLUMNS, Pair, Stations, stations_of
from tests.benchmarks.registration.rule import later_table, read_rows, reliability_table, rules_table, shares_table

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
TABLES = ROOT / "docs" / "benchmarks" / "registration"
IFC, CORPUS = DATA / "ifc", DATA / "corpus"
SCENES: dict[str, Path | None] = {
    **dict.fromkeys(
        (
            "house",
            "basement",
            "school",
            "l-room",
            "two-rooms",
            "corridor-comb",
            "column-hall",
            "t-corridor",
            "doors-open",
            "stairwell",
            "double-height-hall",
            "atrium",
            "tunnel",
            "thin-walls",
            "glass-and-mirror",
        )
    ),
    "duplex": IFC / "duplex.ifc",
    "fzk-haus": IFC / "fzk-haus.ifc",
    "sample-house": CORPUS / "ifc-samplehouse-revit2015-ifc4.ifc",
    "renga-house": CORPUS / "ifc-house-renga.ifc",
    "openhouse": CORPUS / "ifc-openhouse-ifc4.ifc",
    "classroom": CORPUS / "ifc-classroom-uk-revit2013.ifc",
    "tested-sample": CORPUS / "ifc-tested-sample-revit2021-esp.ifc",
    "angel-house": CORPUS / "obj-angelhouse-telaviv-rhino.obj",
    "schependomlaan": CORPUS / "ifc-schependomlaan-kalkzandsteen-archicad18.ifc",
}
#: Behind the name of a building whose exterior doors are open, with ground around it.
OUTSIDE = "-outside"
SCENES |= {f"{name}{OUTSIDE}": SCENES[name] for name in ("house", "duplex", "fzk-haus", "sample-house", "renga-house")}
PAIRS_A_SCENE, PAIRS_A_ROUND = 1000, 400
"""Each round scans a scene's stations anew, which takes as long as some 400 pairs."""
#: Fewer rows make no rule that could be tested on scenes it has not seen.
ENOUGH_FOR_RULES = 5000
#: Starts that are off by at most so much: metres, degrees. Tracked: the instrument follows itself between set-ups.
STARTS = {"tracked": (0.03, 0.5), "manual": (0.15, 3.0)}
GLOBAL = {"level": True, "none": False}
#: Of pairs, that are registered without a start: it takes eight times as long as with one. Odd to the bins of overlap,
#: so that all of these come up.
GLOBAL_EVERY = 21
#: A pose found without a start that is farther off is not refined: no reach of the methods leads back from there.
LOST_MM, LOST_DEG = 1000.0, 10.0
RESULTS = tuple(
    f"{start}_{method}_{figure}" for start in (*STARTS, *GLOBAL) for method in METHODS for figure in ("mm", "deg")
)


def scene_of(name: str) -> Scene:
    of = name.removesuffix(OUTSIDE)
    path = SCENES[of]
    scene = scenes_synthetic.build(of).scene if path is None else load_scene(path)
    if of == name:
        return scene
    opened = without_door_leaves(scene, Doors.OUTSIDE)
    return replace(opened, source=replace(opened.source, doors=Doors.OUTSIDE))


class Campaign:
    """The pairs of one scene."""

    def __init__(self, name: str) -> None:
        self._seed = zlib.crc32(name.encode())
        self._table = TABLES / f"{name}.csv"
        self._stations: Stations | None = None
        self._name = name
        self._prepared: dict[int, Prepared] = {}

    def n_done(self) -> int:
        if not self._table.is_file():
            return 0
        return len(self._table.read_text(encoding="utf-8").splitlines()) - 1

    def go_on(self, n: int, until: float) -> int:
        """Register the next pairs of the scene, `n` at most; how many there were left to do."""
        if self._stations is None:
            self._stations = stations_of(scene_of(self._name), n_pairs=PAIRS_A_SCENE, seed=self._seed)
        done = self.n_done()
        pairs = self._stations.pairs[done : done + n]
        TABLES.mkdir(parents=True, exist_ok=True)
        with self._table.open("a", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            if not done:
                rows.writerow([*COLUMNS, *RESULTS])
            for number, pair in enumerate(pairs, start=done):
                if time.monotonic() > until:
                    break
                registered = self._registered(pair, with_global=number % GLOBAL_EVERY == 0)
                rows.writerow([*pair.written(), *registered])
                file.flush()
        return len(pairs)

    def _registered(self, pair: Pair, *, with_global: bool) -> list[str]:
        random = np.random.default_rng([self._seed, pair.a, pair.b])
        target, source = self._cloud(pair.a), self._cloud(pair.b)
        truth = np.linalg.inv(target.cloud.pose) @ source.cloud.pose
        starts = [(kind, truth @ moved(*limits, random)) for kind, limits in STARTS.items()]
        if with_global:
            starts += [("found", without_start(target, source, level=level)) for level in GLOBAL.values()]
        found = []
        for kind, start in starts:
            off_mm, off_deg = pose_errors(truth, start)
            lost = off_mm > LOST_MM or off_deg > LOST_DEG
            for method in METHODS.values():
                found += pose_errors(truth, start if lost else method(target, source, start, kind))
        written = [f"{value:.4g}" for value in found]
        return written + [""] * (len(RESULTS) - len(written))

    def _cloud(self, station: int) -> Prepared:
        if station not in self._prepared:
            assert self._stations is not None
            random = np.random.default_rng([self._seed, station])
            here = self._stations
            self._prepared[station] = prepare(scan(here.engine, here.scene, here.positions_m[station], random), random)
        return self._prepared[station]


def pose_errors(truth: FloatArray, found: FloatArray) -> tuple[float, float]:
    """How far off the source's sensor comes to lie, millimetres, and its turn, degrees."""
    off = np.linalg.inv(truth) @ found
    turn = np.arccos(np.clip((np.trace(off[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))
    return 1000.0 * float(np.linalg.norm(off[:3, 3])), float(np.degrees(turn))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--round", type=int, default=PAIRS_A_ROUND)
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    until = time.monotonic() + 60.0 * asked.minutes
    left = asked.scenes.split(",")
    while left and time.monotonic() < until:
        # Those with the fewest rows first; the next round begins where all have as many.
        fewest = min(Campaign(name).n_done() for name in left)
        for name in [name for name in left if Campaign(name).n_done() < fewest + asked.round]:
            begun, scene = time.monotonic(), Campaign(name)
            done = scene.n_done()
            if scene.go_on(fewest + asked.round - done, until) < fewest + asked.round - done:
                left.remove(name)
            print(f"{name}: {scene.n_done()} pairs, {time.monotonic() - begun:.0f} s", flush=True)
    if asked.write:
        write_page(asked.write)


def write_page(page: Path) -> None:
    """Make the page's tables from all rows."""
    rows = read_rows(TABLES, [*STARTS, *GLOBAL], list(METHODS))
    n_global = int((~np.isnan(rows.errors["none", "gicp"][:, 0])).sum())
    n_scenes = np.unique(rows.scene).size
    put(page, "extent", [f"{rows.scene.size} pairs of {n_scenes} scenes; {n_global} of them without a start, too."])
    put(page, "shares", shares_table(rows, list(STARTS), list(METHODS)))
    put(page, "shares without a start", shares_table(rows, list(GLOBAL), list(METHODS)))
    if rows.scene.size < ENOUGH_FOR_RULES:
        return
    put(page, "rules", rules_table(rows, list(STARTS), list(METHODS)))
    put(page, "reliability", reliability_table(rows, list(STARTS), "open3d"))
    put(page, "reliability of later rows", later_table(rows, list(STARTS), "open3d"))


if __name__ == "__main__":
    main()
