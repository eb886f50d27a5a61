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
from planner_core.errors import SceneError, SceneNotFoundError, one_line
from planner_core.progress import Progress, ProgressEvent, silent

READER_OF_EXTENSION = {".dxf": "planner_core.drawings.dxf:read_dxf"}
_LIBRARY = {".dxf": "ezdxf"}


@dataclass(frozen=True)
class DrawingOptions:
    """What a user may set of drawings. unit_m : metres in a unit of each file; None: the file's, checked."""

    unit_m: tuple[float | None, ...] = ()
    patterns: Mapping[str, Kind] = field(default_factory=dict)
    """Kinds of layers and blocks by pattern."""
    heights: Heights = field(default_factory=Heights)
    doubtful: Doubtful = Doubtful.AS_OPEN


def is_drawing(path: Path) -> bool:
    """Whether a path is of a drawing, by its extension."""
    return path.suffix.lower() in READER_OF_EXTENSION or path.suffix.lower() == ".dwg"


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
    plans = []
    for path, unit_m in zip(paths, units, strict=True):
        progress(ProgressEvent("load", 0, 0, f"reading {path.name}"))
        drawing = _read(path, progress)
        progress(ProgressEvent("load", 0, 0, f"recognising walls, doors and rooms of {path.name}"))
        plans += floor_plans(drawing, unit_m=unit_m, patterns=options.patterns)
    return lifted(paths[0].stem, plans, options.heights, options.doubtful)


def _read(path: Path, progress: Progress) -> Drawing:
    suffix = path.suffix.lower()
    if not path.is_file():
        raise SceneNotFoundError(f"{path}: there is no such file; check the name and the folder.")
    if suffix == ".dwg":
        raise SceneError(
            f"{path.name}: it is a DWG file, expected DXF; save it as DXF in the program that made it, or convert it."
        )
    try:
        drawing: Drawing = child_process.run_isolated(
            READER_OF_EXTENSION[suffix],
            {"path": str(path)},
            classes=(Drawing, DrawingText, Symbol),
            limits=limits_for(path.stat().st_size),
            stage="load",
            progress=progress,
        )
    except LostChildError as lost:
        where = f" while reading {one_line(lost.place)}" if lost.place else ""
        raise SceneError(
            f"{path.name}: {_LIBRARY[suffix]} {lost}{where}, expected a floor plan; export the layers of walls, doors, "
            "windows and stairs alone."
        ) from lost
    except MemoryError as error:
        raise SceneError(
            f"{path.name}: reading it takes more memory than there is; export the layers of walls, doors, windows and "
            "stairs alone."
        ) from error
    except OSError as error:
        raise SceneNotFoundError(
            f"{path}: it can't be read ({error.strerror or error}); check its permissions."
        ) from error
    return drawing
