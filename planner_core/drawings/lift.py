"""From drawings, a storey each or several, the lowest first, to a `Building` that is ready to be written as IFC4.

The scene of a plan is then that IFC file, so that everything that planning, viewer and exports do with IFC applies:
docs/decisions/0021-drawings.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from planner_core import child_process
from planner_core.child_process import LostChildError, limits_for
from planner_core.drawings.building import Building, Doubtful, Heights, lifted
from planner_core.drawings.drawing import Drawing, DrawingText, Symbol
from planner_core.drawings.floor_plan import floor_plans
from planner_core.drawings.layer_names import Kind
from planner_core.drawings.scales import PageScale, scaled
from planner_core.errors import SceneError, SceneNotFoundError, one_line
from planner_core.progress import Progress, ProgressEvent, silent

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"})
_READERS = {
    "dxf": ("planner_core.drawings.dxf:read_dxf", "ezdxf", "export the layers of walls, doors and windows alone"),
    "picture": (
        "planner_core.drawings.pictures:read_picture",
        "OpenImageIO",
        "save it smaller, or crop it to the plan",
    ),
}
"""Function, library, and what to do about a file that is too much for it, by form."""


@dataclass(frozen=True)
class DrawingOptions:
    """What a user may set of drawings."""

    unit_m: tuple[float | None, ...] = ()
    """Metres in a unit of each file, of DXF; None: the file's, checked. Empty: so of all."""
    scales: tuple[PageScale, ...] = ()
    """Of each file, of pages and pictures. Empty: none."""
    patterns: Mapping[str, Kind] = field(default_factory=dict)
    """Kinds of layers and blocks by pattern."""
    heights: Heights = field(default_factory=Heights)
    doubtful: Doubtful = Doubtful.AS_OPEN


def is_drawing(path: Path) -> bool:
    """Whether a path is of a drawing, by its extension."""
    return bool(_form(path))


def _form(path: Path) -> str:
    """`dxf`, `dwg` or `picture`; empty: no drawing."""
    suffix = path.suffix.lower()
    return "picture" if suffix in PICTURES else suffix[1:] if suffix in (".dxf", ".dwg") else ""


def lift_drawings(
    paths: Sequence[Path], options: DrawingOptions = DrawingOptions(), *, progress: Progress = silent
) -> Building:
    """Read drawings and raise them to one building.

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
    units = options.unit_m or (None,) * len(paths)
    scales = options.scales or (PageScale(),) * len(paths)
    plans = []
    for path, unit_m, scale in zip(paths, units, scales, strict=True):
        progress(ProgressEvent("load", 0, 0, f"reading {path.name}"))
        drawing = _read(path, progress)
        if drawing.page_height is not None:
            drawing, unit_m = scaled(drawing, scale, is_picture=_form(path) == "picture"), 1.0
        progress(ProgressEvent("load", 0, 0, f"recognising walls, doors and rooms of {path.name}"))
        plans += floor_plans(drawing, unit_m=unit_m, patterns=options.patterns)
    return lifted(paths[0].stem, plans, options.heights, options.doubtful)


def _read(path: Path, progress: Progress) -> Drawing:
    form = _form(path)
    if not path.is_file():
        raise SceneNotFoundError(f"{path}: there is no such file; check the name and the folder.")
    if form == "dwg":
        raise SceneError(
            f"{path.name}: it is a DWG file, expected DXF; save it as DXF in the program that made it, or convert it."
        )
    function, library, remedy = _READERS[form]
    try:
        drawing: Drawing = child_process.run_isolated(
            function,
            {"path": str(path)},
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
