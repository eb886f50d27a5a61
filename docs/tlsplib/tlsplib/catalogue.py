"""The instances of the library: their names, what they are made from, and what is required.

A name has kind, number and what is special: `rooms-09-links`. Nothing in here may change for an instance that is
published: its digest is in library.json. Classes go by candidates: small up to 130, medium up to 300, large beyond.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner_core.errors import SceneError

from .gallery import plan_of
from .instance import Instance
from .plans import PLANS, Survey, instance_of
from .scanned import Scan, scanned

SMALL, MEDIUM = 130, 300
#: Plans of this seed and beyond are large: they are made on demand.
LARGE_SEED = 61


@dataclass(frozen=True)
class Entry:
    """One instance. generator : of a plan, with its arguments; or `gallery`, a file and its unit; or a scan."""

    name: str
    generator: str
    survey: Survey
    arguments: dict[str, Any] = field(default_factory=dict)
    scan: Scan | None = None

    @property
    def is_kept(self) -> bool:
        """Whether the library holds its file: not what is made from polygons of others, nor what is made large."""
        return not self.needs_gallery and self.arguments.get("seed", 0) < LARGE_SEED

    @property
    def needs_gallery(self) -> bool:
        """Whether it is made from a file of the art-gallery set."""
        return self.generator == "gallery"


def class_of(instance: Instance) -> str:
    """Class by size."""
    n = instance.n_candidates
    return "small" if n <= SMALL else "medium" if n <= MEDIUM else "large"


def make(entry: Entry, *, gallery: Path | None = None) -> Instance:
    """Make an instance from its geometry.

    Raises
    ------
    SceneError
        The art-gallery set is not at the path given, or has other files.
    """
    if entry.scan is not None:
        return scanned(entry.name, entry.scan, entry.survey)
    about = {"generator": entry.generator, **entry.arguments}
    if not entry.needs_gallery:
        plan = PLANS[entry.generator](**entry.arguments)
        return instance_of(entry.name, entry.generator, about, plan, entry.survey)
    path = None if gallery is None else gallery / f"{entry.arguments['file']}.graphml.xz"
    if path is None or not path.exists():
        raise SceneError(
            f"{entry.name}: got no {path or 'folder of the art-gallery set'}, expected it; get office_like_instances "
            "of KaiKobbe/dispersive_agp_solver and give its folder by --gallery"
        )
    plan = plan_of(path, unit_cm=entry.arguments["unit_cm"])
    return instance_of(entry.name, "gallery", about, plan, entry.survey)


def entries() -> list[Entry]:
    """All, in the order of the page."""
    return [*_rooms(), *_offices(), *_halls(), *_galleries(), *_scans()]


_REQUIRED: dict[str, dict[str, int]] = {
    "whole": {},
    "links": {"overlap": 25},
    "zones": {"zone": 80},
    "zones-links": {"zone": 80, "overlap": 25},
    "classes": {"whole": 0, "floor": 90, "wall": 95},
    "twice": {"twice": 50},
}


def _plans(
    generator: str, numbers: Iterable[int], required: str, survey: dict[str, int], **size: int
) -> Iterator[Entry]:
    for seed in numbers:
        settings = Survey(**{"grid": 150, "most": 800, **survey, **_REQUIRED[required]})
        yield Entry(f"{generator}-{seed:02d}-{required}", generator, settings, {"seed": seed, **size})


def _rooms() -> Iterator[Entry]:
    flat = {"width": 1500, "depth": 1200, "largest_m2": 25}
    for required, numbers in (("whole", range(1, 9)), ("links", range(9, 17)), ("zones-links", range(17, 23))):
        yield from _plans("rooms", numbers, required, {}, **flat)
    yield from _plans("rooms", range(23, 28), "classes", {}, **flat)
    yield from _plans("rooms", range(28, 33), "twice", {}, width=1000, depth=900, largest_m2=25)
    floor = {"width": 3000, "depth": 2000, "largest_m2": 40}
    yield from _plans("rooms", range(41, 44), "whole", {"grid": 175, "most": 1000}, **floor)
    yield from _plans("rooms", range(44, 47), "links", {"grid": 175, "most": 1000}, **floor)
    usual: dict[str, int] = {}
    for seed, required, survey, width, depth in (
        (51, "links", usual, 3200, 2500),
        (52, "links", usual, 2800, 2000),
        (61, "whole", usual, 5000, 3000),
        (62, "links", usual, 5000, 3000),
        (63, "whole", {"grid": 175}, 8000, 6000),
        (64, "links", usual, 8000, 6000),
        (65, "links", {"grid": 125, "patch": 75}, 9000, 7500),
    ):
        wide = {"width": width, "depth": depth, "largest_m2": 40}
        yield from _plans("rooms", [seed], required, {"most": 1000, **survey}, **wide)


def _offices() -> Iterator[Entry]:
    wing = {"length": 2000, "corridor": 200, "depth": 450}
    for required, numbers in (("whole", range(1, 7)), ("links", range(7, 13)), ("zones", range(13, 17))):
        yield from _plans("offices", numbers, required, {"most": 1000}, **wing)
    long = {"length": 5000, "corridor": 250, "depth": 550}
    yield from _plans("offices", range(41, 43), "whole", {"grid": 175, "most": 1200}, **long)
    yield from _plans("offices", range(43, 44), "links", {"grid": 175, "most": 1200}, **long)
    yield from _plans("offices", [51], "links", {"most": 1200}, **long)
    yield from _plans("offices", [61], "links", {"grid": 125, "most": 1200}, **{**long, "length": 16000})


def _halls() -> Iterator[Entry]:
    store = {"width": 2500, "depth": 1500, "n_pillars": 10, "n_shelves": 8}
    for required, numbers in (("whole", range(1, 6)), ("links", range(6, 11)), ("twice", range(11, 13))):
        yield from _plans("hall", numbers, required, {"grid": 200, "most": 1000}, **store)
    for seed, required, width, depth, n_pillars, n_shelves in (
        (51, "links", 3600, 2500, 20, 16),
        (61, "whole", 6000, 3500, 60, 50),
        (62, "links", 7500, 5000, 100, 80),
    ):
        size = {"width": width, "depth": depth, "n_pillars": n_pillars, "n_shelves": n_shelves}
        yield from _plans("hall", [seed], required, {"grid": 200, "most": 1000}, **size)


#: File, centimetres of its unit, grid, side of a surface, range.
_SMALL_GALLERIES = (
    ("general_40_20", 100, 200, 100, 1000), ("simple_40_13", 150, 200, 100, 1000), ("simple_40_5", 130, 200, 100, 1000),
    ("general_80_1", 75, 250, 125, 1200), ("general_80_18", 80, 250, 125, 1200), ("general_80_7", 65, 250, 125, 1200),
    ("simple_80_9", 70, 250, 125, 1200), ("simple_120_14", 50, 350, 150, 1500), ("simple_120_18", 55, 350, 150, 1500),
    ("simple_120_7", 50, 350, 150, 1500), ("general_160_10", 50, 450, 200, 2000),
    ("general_240_16", 35, 550, 250, 2000), ("general_240_20", 35, 600, 250, 2000),
    ("simple_200_9", 40, 550, 250, 2000),
)  # fmt: skip
_MEDIUM_GALLERIES = (
    ("general_40_20", 100, 125, 100, 800), ("simple_80_9", 100, 250, 125, 1200), ("general_80_1", 100, 250, 125, 1200),
    ("simple_120_14", 75, 350, 150, 1500),
)  # fmt: skip
_LARGE_GALLERIES = (("simple_120_14", 105, 200, 125, 1200),)


def _galleries() -> Iterator[Entry]:
    for files, required, fine in (
        (_SMALL_GALLERIES, "whole", ""),
        (_SMALL_GALLERIES, "links", ""),
        (_MEDIUM_GALLERIES, "whole", "-fine"),
        (_LARGE_GALLERIES, "whole", "-large"),
    ):
        for file, unit, grid, patch, most in files:
            overlap = 15 if required == "links" else 0  # at 25 % half of the stations have no link
            survey = Survey(grid=grid, most=most, patch=patch, clear=20, overlap=overlap)
            name = f"gallery-{file.replace('_', '-')}{fine}-{required}"
            yield Entry(name, "gallery", survey, {"file": file, "unit_cm": unit})


def _scans() -> Iterator[Entry]:
    for name, scan, required in (
        ("house-whole", Scan("house", 0.8, 5.0), {"zone": 95}),
        ("house-links", Scan("house", 0.8, 8.0), {"whole": 90, "overlap": 30}),
        ("comb-whole", Scan("corridor-comb", 0.6, 5.0), {}),
        ("comb-links", Scan("corridor-comb", 0.8, 5.0), {"overlap": 30}),
        ("hole-walls-whole", Scan("hole-walls", 0.8, 8.0), {}),
        ("hole-walls-twice", Scan("hole-walls", 0.8, 8.0), {"twice": 70}),
        ("stairwell-links", Scan("stairwell", 0.6, 6.0), {"overlap": 20}),
        ("hall-whole", Scan("double-height-hall", 1.0, 8.0), {}),
        ("hall-twice", Scan("double-height-hall", 1.0, 8.0), {"twice": 70}),
        ("house-fine-whole", Scan("house", 0.35, 5.0, patch_m2=0.5), {}),
    ):
        survey = Survey(grid=round(100 * scan.grid_m), most=round(100 * scan.range_m), **required)
        yield Entry(f"scan-{name}", "scan", survey, scan=scan)
