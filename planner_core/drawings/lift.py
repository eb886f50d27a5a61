"""From drawings, a storey each or several, the lowest first, to a `DrawnBuilding`, which is raised to a `Building`.

The scene of a plan is then that IFC file, so that everything that planning, viewer and exports do with IFC applies:
docs/decisions/0021-drawings.md.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path

import numpy as np

from planner_core import child_process
from planner_core.child_process import LostChildError, limits_for
from planner_core.drawings.alignment import moved, over
from planner_core.drawings.building import Building, Doubtful, Heights
from planner_core.drawings.drawing import Drawing, DrawingText, Symbol
from planner_core.drawings.drawn_building import DrawnBuilding, DrawnFile, drawn_building, raised
from planner_core.drawings.drawn_lines import DrawnLines
from planner_core.drawings.floor_plan import FloorPlan, floor_plans
from planner_core.drawings.layer_names import Kind, kind_of_name
from planner_core.drawings.scales import PageScale, cropped, scaled, stated_ratio, with_mark, without_mark
from planner_core.errors import SceneError, SceneNotFoundError, grouped, one_line
from planner_core.model import FloatArray
from planner_core.progress import Progress, ProgressEvent, silent

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"})
_READERS = {
    "dxf": ("planner_core.drawings.dxf:read_dxf", "ezdxf", "export the layers of walls, doors and windows alone"),
    "pdf": ("planner_core.drawings.pdf:read_pdf", "PDFium", "print the layers of walls, doors and windows alone"),
    "picture": (
        "planner_core.drawings.pictures:read_picture",
        "OpenImageIO",
        "save it smaller, or crop it to the plan",
    ),
}
"""Function, library, and what to do about a file that is too much for it, by form."""


Box = tuple[float, float, float, float]
MOST_POINTS = 1_000_000
"""Of lines that are recognised; twice as many took minutes and gigabytes."""
_NAMED = 8
"""Names of layers in a message."""


@dataclass(frozen=True)
class DrawingOptions:
    """What a user may set of drawings."""

    unit_m: tuple[float | None, ...] = ()
    """Metres in a unit of each file, of DXF; None: the file's, checked. Empty: so of all."""
    scales: tuple[PageScale, ...] = ()
    """Of each file, of pages and pictures. Empty: none. So with the next two."""
    pages: tuple[tuple[int, ...], ...] = ()
    """Pages of each PDF from 1, a storey each; none: the only one."""
    parts: tuple[tuple[Box, ...], ...] = ()
    """Boxes x1, y1, x2, y2 of each file, a storey each: of a page from its upper left corner, of DXF as it is."""
    common_points: tuple[tuple[float, float] | None, ...] = ()
    """A point of each file, as of `parts`, that lies over that of the first; None: storeys are moved by their walls."""
    patterns: Mapping[str, Kind] = field(default_factory=dict)
    """Kinds of layers and blocks by pattern, each of which some layer or block fits."""
    office_patterns: Mapping[str, Kind] = field(default_factory=dict)
    """The same for all drawings of an office, after `patterns`: some of them fit."""
    heights: Heights = field(default_factory=Heights)
    doubtful: Doubtful = Doubtful.AS_OPEN


def is_drawing(path: Path) -> bool:
    """Whether a path is of a drawing, by its extension."""
    return bool(_form(path))


def _form(path: Path) -> str:
    """`dxf`, `dwg`, `pdf` or `picture`; empty: no drawing."""
    suffix = path.suffix.lower()
    return "picture" if suffix in PICTURES else suffix[1:] if suffix in (".dxf", ".dwg", ".pdf") else ""


@dataclass(frozen=True)
class PlanPicture:
    """The picture of a storey. from_picture : as of a `FloorPlan`. box_m : x0, y0, x1, y1 of what it shows."""

    path: Path
    page: int
    """Of a PDF, from 1; 0: the file is a picture."""
    from_picture: FloatArray
    box_m: Box

    def write(self, to: Path) -> None:
        """Write that part of it as PNG; raises OSError."""
        arguments = {
            "path": str(self.path),
            "page": self.page,
            "to": str(to),
            "matrix": self.from_picture.tolist(),
            "box_m": list(self.box_m),
        }
        limits = limits_for(self.path.stat().st_size)
        child_process.run_isolated(
            "planner_core.drawings.plan_picture:write_plan_picture",
            arguments,
            classes=(),
            limits=limits,
            stage="load",
            progress=silent,
        )


@dataclass(frozen=True)
class Recognised:
    """What was found in drawings. lines : of each storey, all that is drawn there."""

    drawn: DrawnBuilding
    lines: tuple[DrawnLines, ...]
    pictures: tuple[PlanPicture | None, ...]
    """Of storeys that were recognised in a picture."""
    warnings: tuple[str, ...]


def lift_drawings(
    paths: Sequence[Path], options: DrawingOptions = DrawingOptions(), *, progress: Progress = silent
) -> Building:
    """Read drawings and raise them to one building; as `recognised`, and raises what it raises."""
    found = recognised(paths, options, progress=progress)
    building = raised(found.drawn)
    return replace(building, warnings=(*found.warnings, *building.warnings))


def recognised(
    paths: Sequence[Path], options: DrawingOptions = DrawingOptions(), *, progress: Progress = silent
) -> Recognised:
    """Read drawings and recognise their storeys.

    Parameters
    ----------
    paths
        A storey each, or several where the drawing has walls at several heights; the lowest first.

    Raises
    ------
    SceneError
        A file can't be used; the message names the reason and the remedy.
    SceneNotFoundError
        There is no such file.
    MissingPackageError
        The format's library is not installed.
    """
    plans: list[FloorPlan] = []
    names: set[str] = set()
    files: list[DrawnFile] = []
    pictures: list[PlanPicture | None] = []
    common: FloatArray | None = None
    for number, path in enumerate(paths):
        pages: Sequence[int] = (options.pages[number] if options.pages else ()) or (0,)
        parts: Sequence[Box | None] = (options.parts[number] if options.parts else ()) or (None,)
        for page, part in product(pages, parts):
            progress(ProgressEvent("load", 0, 0, f"reading {path.name}"))
            drawing = _read(path, page, progress)
            names |= {*drawing.layers, *(part for symbol in drawing.symbols for part in symbol.name.split("/"))}
            progress(ProgressEvent("load", 0, 0, f"recognising walls, doors and rooms of {path.name}"))
            found, point = _plans(drawing, number, part, options)
            if point is not None and common is not None:
                found = [moved(plan, common - point) for plan in found]
            elif plans and (drawing.page_height is not None or part != parts[0]) and point is None:
                found[0], line = over(plans[-1], found[0], path.name)
                found[0] = replace(found[0], warnings=(*found[0].warnings, line))
            common = point if common is None else common
            plans += found
            pictures += [_picture(path, page, plan) for plan in found]
        files.append(DrawnFile(path.name, hashlib.sha256(path.read_bytes()).hexdigest()))
    _check_patterns(options, names)
    return Recognised(
        drawn_building(paths[0].stem, plans, files, options.heights, options.doubtful),
        tuple(plan.lines for plan in plans),
        tuple(pictures),
        tuple(line for plan in plans for line in plan.warnings),
    )


def _picture(path: Path, page: int, plan: FloorPlan) -> PlanPicture | None:
    points = plan.lines.points_m
    if plan.from_picture is None or not len(points):
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    box_m = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    return PlanPicture(path, max(page, 1) if _form(path) == "pdf" else 0, plan.from_picture, box_m)


def _plans(
    drawing: Drawing, number: int, part: Box | None, options: DrawingOptions
) -> tuple[list[FloorPlan], FloatArray | None]:
    """Recognise one drawing, of the file of a number; and where the point is that it has in common with others."""
    unit_m = options.unit_m[number] if options.unit_m else None
    at = options.common_points[number] if options.common_points else None
    if part is not None:
        drawing = cropped(drawing, part)
    if at is not None:
        drawing = with_mark(drawing, at)
    scale = options.scales[number] if options.scales else PageScale()
    _check_size(drawing, unit_m, scale)
    of_office = {each: kind for each, kind in options.office_patterns.items() if each not in options.patterns}
    patterns = {**options.patterns, **of_office}
    _check_number(drawing, patterns)
    if drawing.page_height is not None:
        drawing, unit_m = _in_metres(drawing, scale), 1.0
    drawing, mark = without_mark(drawing) if at is not None else (drawing, None)
    plans = floor_plans(drawing, unit_m=unit_m, patterns=patterns)
    return plans, None if mark is None else mark * (unit_m or drawing.unit_m or 1.0)


def _check_number(drawing: Drawing, patterns: Mapping[str, Kind]) -> None:
    """Refuse more lines than recognition has time and memory for: hatches, furniture and surroundings."""
    kept = np.array([kind_of_name(name, patterns) != Kind.IGNORED for name in drawing.layers], dtype=np.bool_)
    counts = np.bincount(drawing.layer_of_stroke, weights=np.diff(drawing.starts), minlength=len(kept)) * kept
    if counts.sum() > MOST_POINTS:
        most = [one_line(drawing.layers[row]) for row in np.argsort(-counts, kind="stable")[:3].tolist()]
        raise SceneError(
            f"{drawing.name}: its lines have {grouped(int(counts.sum()))} points, most of them on {', '.join(most)}, "
            f"expected at most {grouped(MOST_POINTS)}; leave out the layers of hatches, furniture and surroundings, "
            "such as --layer ignored=NAME, or name a --part."
        )


def _check_size(drawing: Drawing, unit_m: float | None, scale: PageScale) -> None:
    """Refuse a scale of what has a unit, and a unit of what has a scale: neither would count."""
    if drawing.page_height is None and scale != PageScale():
        raise SceneError(
            f"{drawing.name}: got a scale of a DXF, which has a unit, expected none; pass --units, or name the page or "
            "picture that the scale is of, such as --scale upper.pdf=1:100."
        )
    if drawing.page_height is not None and unit_m is not None:
        raise SceneError(
            f"{drawing.name}: got a unit of a page or picture, which has a scale, expected none; pass --scale, or name "
            "the file that the unit is of, such as --units ground.dxf=mm."
        )


def _check_patterns(options: DrawingOptions, names: Collection[str]) -> None:
    """Refuse patterns that no layer or block has: what they name would be read as if they were not there."""

    def fits(pattern: str) -> bool:
        return any(fnmatchcase(name.casefold(), pattern.casefold()) for name in names)

    shown = ", ".join(sorted(names)[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
    for pattern in options.patterns:
        if not fits(pattern):
            raise SceneError(
                f"layer pattern {pattern!r}: no layer or block has such a name, expected one of {one_line(shown)}; "
                "correct it."
            )
    if options.office_patterns and not any(map(fits, options.office_patterns)):
        raise SceneError(
            f"--layers: no layer or block has a name of its {len(options.office_patterns)} patterns, expected some of "
            f"{one_line(shown)}; give the file of these drawings, or leave it out."
        )


def _in_metres(drawing: Drawing, scale: PageScale) -> Drawing:
    """A page or a picture by the user's scale, else by the one that it states, with a warning."""
    stated = stated_ratio(drawing) if scale == PageScale() else None
    if stated is None:
        return scaled(drawing, scale)
    ratio, where = stated
    line = f"{drawing.name}: its scale is 1:{ratio:g} by {where}; if that is wrong, pass --scale."
    drawing = scaled(drawing, PageScale(ratio=ratio))
    return replace(drawing, warnings=(*drawing.warnings, line))


def _read(path: Path, page: int, progress: Progress) -> Drawing:
    form = _form(path)
    if not path.is_file():
        raise SceneNotFoundError(f"{path}: there is no such file; check the name and the folder.")
    if form == "dwg":
        raise SceneError(
            f"{path.name}: it is a DWG file, expected DXF; save it as DXF in the program that made it, or convert it."
        )
    if page and form != "pdf":
        raise SceneError(f"{path.name}: got page {page} of a file without pages, expected a PDF; leave out --page.")
    function, library, remedy = _READERS[form]
    try:
        drawing: Drawing = child_process.run_isolated(
            function,
            {"path": str(path), "page": page} if form == "pdf" else {"path": str(path)},
            classes=(Drawing, DrawingText, Symbol),
            limits=limits_for(path.stat().st_size),
            stage="load",
            progress=progress,
        )
    except LostChildError as lost:
        where = f" while reading {one_line(lost.place)}" if lost.place else ""
        raise SceneError(f"{path.name}: {library} {lost}{where}, expected a floor plan; {remedy}.") from lost
    except MemoryError as error:
        raise SceneError(f"{path.name}: reading it takes more memory than there is; {remedy}.") from error
    except OSError as error:
        raise SceneNotFoundError(
            f"{path}: it can't be read ({error.strerror or error}); check its permissions."
        ) from error
    return drawing
