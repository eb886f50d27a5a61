"""What `bench_planning.py` plans: scenes with settings, smallest first, and what is known of them.

Three groups. `puzzle`: all surfaces inside, by a scanner that looks everywhere, where the fewest stations are known.
`scene`: every synthetic building and the real ones, with the HDL-64E. `constraint`: what has a mark of ten minutes.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import scenes_synthetic
from planner_core.model import PlanSettings, Proven, Requirements, Scanner, Scene
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import LoadOptions, load_scene
from scenes_synthetic.campus import write_campus

IFC_FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "ifc"
REAL = ("duplex", "fzk-haus")
FAR_M = 100.0
HEIGHT_M = 1.5
#: Work limits of one selection, about seconds of one core.
PUZZLE_WORK, SCENE_WORK, TARGET_WORK = 10.0, 6.0, 300.0
#: Of the other two targets, which are harder to prove.
FZK_WORK, BASEMENT_WORK = 300.0, 300.0
#: The cover alone is no target: it gets so much of it.
TARGET_COVER_WORK = 10.0
#: Of large buildings that a mark is set for: what 15 minutes of CPU time allow, or from where on more brought nothing.
LARGE_WORK = {"school": 300.0, "campus": 150.0, "atrium": 250.0, "office": 300.0}
#: Part of the area that a puzzle asks for: walls that meet hide slivers, by rounding, that no puzzle means.
PUZZLE_COVERAGE = 0.999
PUZZLE_BEAM_DEG = 0.05
CAMPUS_TRIANGLES = 300_000
#: Made of the same rooms as `corridor-comb`, in files of another kind: the same problem again.
COPIES = ("georeferenced", "millimetres-y-up", "broken-faces")
#: By what a scene is worth beside others, small ones first.
SMALL = (
    "box", "two-rooms", "l-room", "convex-room", "thin-walls", "glass-and-mirror", "closed-rooms", "doors-open",
    "doors-shut", "stairwell", "column-hall", "comb-gallery", "l-by-range", "t-corridor", "hole-walls", "spiral",
    "plus-corridor", "corridor-comb", *COPIES, "without-slabs", "house", "double-height-hall",
)  # fmt: skip
LARGE = ("facade", "tunnel", "atrium")
#: Where the method paper's spatial search is run, too: one to four minutes of CPU time each.
SEARCHED = ("corridor-comb", "hole-walls")  # and the duplex, doors open


@dataclass(frozen=True)
class Case:
    """One row. known_best : fewest stations that see all of it, by the scene's own proof; None: not known."""

    group: str
    scene: str
    settings: PlanSettings
    doors: str = "open"
    work: float = SCENE_WORK
    """Limit for stations that are connected. cover_work : for those that only cover."""
    cover_work: float = SCENE_WORK
    told: str = ""
    """What is unlike the group's other rows, for readers."""
    known_best: int | None = field(default=None)
    search: bool = False
    """Whether the method paper's spatial search is run, too: some sixty scans a candidate, minutes in small scenes."""

    @property
    def key(self) -> str:
        """Name of the row: no two have the same."""
        return f"{self.group}: {self.scene}{', ' + self.told if self.told else ''}"

    def load(self) -> Scene | None:
        """Load the scene as `tlsplan plan` does; None where a real one is not here."""
        options = LoadOptions(glass="stop", doors=self.doors)
        if self.scene in REAL:
            path = IFC_FOLDER / f"{self.scene}.ifc"
            return load_scene(path, options=options) if path.exists() else None
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{self.scene}.ifc"
            if self.scene == "campus":
                path = path.with_suffix(".ply")
                write_campus(path, n_triangles=CAMPUS_TRIANGLES)
            else:
                scenes_synthetic.write(scenes_synthetic.build(self.scene), path)
            return load_scene(path, options=options)


def cases() -> list[Case]:
    """All rows, in the order in which they are worked out."""
    return [*_puzzles(), *_scenes(), *_constraints(), *_large()]


def _puzzles() -> Iterator[Case]:
    for name in scenes_synthetic.names():
        truth = scenes_synthetic.build(name).truth if name in SMALL else None
        if truth is None or name in COPIES:
            continue
        if truth.n_stations is not None:
            yield _puzzle(name, truth.n_stations, FAR_M, "")
        for range_m, number in truth.n_stations_at_range:
            yield _puzzle(name, number, range_m, f"range {range_m:g} m")


def _puzzle(name: str, best: int, range_m: float, told: str) -> Case:
    asked = Requirements(coverage=PUZZLE_COVERAGE)
    settings = PlanSettings(
        scanner=_everywhere(range_m),
        requirements=asked,
        method=Proven(),
        scan_mode="patches",
        instrument_heights_m=(HEIGHT_M,),
    )
    return Case("puzzle", name, settings, told=told, work=PUZZLE_WORK, cover_work=PUZZLE_WORK, known_best=best)


def _everywhere(range_m: float) -> Scanner:
    """Looks in all directions, and so finely that angles of incidence do not matter; patches are sampled."""
    half_turn = round(180.0 / PUZZLE_BEAM_DEG)
    return Scanner(
        name="everywhere",
        title="Looks everywhere",
        source="none: an ideal scanner",
        range_min_m=0.0,
        range_max_m=range_m,
        n_azimuths=2 * half_turn,
        elevation_rad=tuple(math.radians(90.0 - PUZZLE_BEAM_DEG * step) for step in range(half_turn + 1)),
        instrument_height_min_m=0.5,
        instrument_height_max_m=2.0,
    )


def _scenes() -> Iterator[Case]:
    for name in SMALL:
        yield Case("scene", name, _usual(), search=name in SEARCHED)
    for name in REAL:
        for doors in ("open", "shut"):
            settings = _usual(instrument_heights_m=(HEIGHT_M,))
            told, search = f"doors {doors}, height {HEIGHT_M:g} m", (name, doors) == ("duplex", "open")
            yield Case("scene", name, settings, doors=doors, told=told, search=search)


def _constraints() -> Iterator[Case]:
    one = {"instrument_heights_m": (HEIGHT_M,)}
    for level in ("Level 2", "Level 1"):
        settings = _usual(**one, grid_step_m=0.4, requirements=Requirements(floors=(level,)))
        yield Case(
            "target",
            "duplex",
            settings,
            told=f"{level.lower()}, grid 0.4 m",
            work=TARGET_WORK,
            cover_work=TARGET_COVER_WORK,
        )
    for name, work in (("fzk-haus", FZK_WORK), ("basement", BASEMENT_WORK)):
        yield Case("target", name, _usual(**one), told="grid 0.5 m", work=work, cover_work=TARGET_COVER_WORK)


def _large() -> Iterator[Case]:
    for name in LARGE:
        yield Case("scene", name, _usual(), told="", work=LARGE_WORK.get(name, SCENE_WORK))
    coarse = {"grid_step_m": 1.0, "instrument_heights_m": (1.3,)}
    for name, settings, told in (
        ("school", _usual(**coarse), "grid 1 m, height 1.3 m"),
        ("campus", _usual(**{**coarse, "grid_step_m": 2.0}), "300 000 triangles, grid 2 m, height 1.3 m"),
        ("office", _usual(grid_step_m=1.0), "grid 1 m"),
    ):
        yield Case("scene", name, settings, told=told, work=LARGE_WORK[name])


def _usual(**other: object) -> PlanSettings:
    return PlanSettings(scanner=load_scanner("hdl-64e"), method=Proven(), **other)  # type: ignore[arg-type]
