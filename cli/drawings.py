"""Drawings among the files of a scene: raised to one IFC file, which takes their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .inputs import of_each
from .options import METRES_PER_UNIT, DrawingSettings, FileOptions

if TYPE_CHECKING:
    from planner_core.drawings.building import Building
    from planner_core.drawings.lift import DrawingOptions
    from planner_core.plan_folder.drawn_files import DrawnFiles

    from .progress import ProgressReporter

#: Of `DrawingSettings`, by field.
OPTION_OF = {
    "scales": "--scale",
    "scales_by": "--scale-by",
    "corners": "--corners",
    "pages": "--page",
    "parts": "--part",
    "common_points": "--align",
    "layers": "--layer",
    "layers_file": "--layers",
    "room_m": "--room-height",
    "door_m": "--door-height",
    "sill_m": "--sill-height",
    "storey_m": "--storey-height",
    "doubtful": "--doubtful",
}
_DEFAULT = DrawingSettings()


def with_drawings_lifted(
    scenes: Sequence[Path],
    reading: FileOptions,
    drawn: DrawingSettings,
    lifted: Path,
    reporter: ProgressReporter,
    *,
    overwrite: bool,
) -> tuple[Sequence[Path], FileOptions]:
    """Write the drawings among the scene's files as one IFC file, `lifted`, which takes their place.

    Raises
    ------
    OutputExistsError
        There is another file of this name, which people may have mended.
    SceneError
        A drawing can't be used.
    RequirementError
        Options of drawings without a drawing.
    """
    from planner_core.drawings.lift import is_drawing
    from planner_core.errors import RequirementError
    from planner_core.plan_folder.drawn_files import DrawnFiles, is_drawn_file

    drawings = [path for path in scenes if is_drawing(path) or is_drawn_file(path)]
    corrected = [path for path in drawings if is_drawn_file(path)]
    idle = [option for name, option in OPTION_OF.items() if getattr(drawn, name) != getattr(_DEFAULT, name)]
    if idle and (corrected or not drawings):
        what = f"{corrected[0].name}, which has its own" if corrected else f"{scenes[0].name}, which is a model"
        raise RequirementError(f"{idle[0]}: got it with {what}, expected a drawing (DXF, PDF or picture); leave it out")
    if not drawings:
        return scenes, reading
    units = dict(zip(scenes, of_each(scenes, reading.units, "--units"), strict=True))
    files = DrawnFiles.of(lifted.with_suffix(".drawing.json"))
    if corrected:
        if len(drawings) > 1:
            raise RequirementError(
                f"{corrected[0].name}: got {drawings[0 if drawings[1] in corrected else 1].name} besides, expected the "
                "corrected drawing alone, which holds all storeys; leave the others out"
            )
        _lift_corrected(corrected[0], files, reporter, overwrite=overwrite)
    else:
        _lift_recognised(drawings, _drawing_options(drawings, units, drawn), files, reporter, overwrite=overwrite)
    others = [path for path in scenes if path not in drawings]
    of_others = tuple((str(path), units[path]) for path in others if units[path])
    return [lifted, *others], replace(reading, units=of_others)


def _lift_recognised(
    drawings: Sequence[Path],
    options: DrawingOptions,
    files: DrawnFiles,
    reporter: ProgressReporter,
    *,
    overwrite: bool,
) -> None:
    from planner_core.drawings.drawn_building import raised
    from planner_core.drawings.lift import recognised
    from planner_core.errors import OutputExistsError
    from planner_core.plan_folder.drawn_files import read_drawn_file, write_drawn, write_lines

    if files.document.exists() and (revision := read_drawn_file(files.document).revision):
        raise OutputExistsError(
            f"{files.document}: holds {revision} saved {'correction' if revision == 1 else 'corrections'}, which a new "
            f"reading of the drawing would lose; go on with tlsplan view {files.document}, or tlsplan plan, or delete "
            "it"
        )
    found = recognised(drawings, options, progress=reporter.show)
    building = raised(found.drawn)
    reporter.warn((*found.warnings, *building.warnings))
    _write_lifted(building, files.ifc, overwrite=overwrite)
    write_drawn(found.drawn, files.document)
    write_lines(found.lines, files, found.pictures)
    if any(opening.doubtful for storey in found.drawn.storeys for opening in storey.openings):
        reporter.warn([f"doubtful gaps can be settled in the browser: tlsplan view {files.document}"])


def _lift_corrected(corrected: Path, files: DrawnFiles, reporter: ProgressReporter, *, overwrite: bool) -> None:
    from planner_core.drawings.drawn_building import raised
    from planner_core.plan_folder.drawn_files import DrawnFiles, copy_drawn, read_drawn_file

    building = raised(read_drawn_file(corrected))
    reporter.warn(building.warnings)
    _write_lifted(building, files.ifc, overwrite=overwrite)
    copy_drawn(DrawnFiles.of(corrected.resolve()), DrawnFiles.of(files.document.resolve()))


def _drawing_options(drawings: Sequence[Path], units: dict[Path, str], drawn: DrawingSettings) -> DrawingOptions:
    from planner_core.drawings.building import Doubtful, Heights
    from planner_core.drawings.layer_names import layer_patterns, patterns_by_kind
    from planner_core.drawings.lift import DrawingOptions
    from planner_core.drawings.scales import page_scale
    from planner_core.requirements.quantities import coordinate_m
    from planner_core.requirements.yaml_or_json import read_document

    office = drawn.layers_file and read_document(drawn.layers_file, of="layers", such_as="wall: [A-MUR*, L-01]")
    scales, scales_by, corners, pages, parts, common = (
        of_each(drawings, given, option)
        for given, option in (
            (getattr(drawn, name), OPTION_OF[name])
            for name in ("scales", "scales_by", "corners", "pages", "parts", "common_points")
        )
    )
    return DrawingOptions(
        scales=tuple(
            page_scale(coordinate_m, scale=ratio or None, scale_by=by or None, corners=four or None)
            for ratio, by, four in zip(scales, scales_by, corners, strict=True)
        ),
        unit_m=tuple(METRES_PER_UNIT[units[path]] if units[path] else None for path in drawings),
        pages=tuple(_pages(text) for text in pages),
        parts=tuple(_parts(text) for text in parts),
        common_points=tuple(_point(text) for text in common),
        patterns=layer_patterns(drawn.layers),
        office_patterns=patterns_by_kind(office or {}, f"{drawn.layers_file}: "),
        heights=Heights(
            room_m=drawn.room_m,
            door_m=drawn.door_m,
            sill_m=drawn.sill_m,
            window_head_m=max(drawn.door_m, drawn.sill_m + 0.3),
            storey_m=drawn.storey_m,
        ),
        doubtful=Doubtful(drawn.doubtful),
    )


def _pages(text: str) -> tuple[int, ...]:
    from planner_core.errors import RequirementError

    words = text.split(",") if text else []
    if not all(word.strip().isdecimal() and int(word) > 0 for word in words):
        raise RequirementError(f"--page: got {text!r}, expected numbers of pages from 1, such as 2 or 1,2; correct it")
    return tuple(int(word) for word in words)


def _parts(text: str) -> tuple[tuple[float, float, float, float], ...]:
    from planner_core.errors import RequirementError

    boxes = []
    for box in text.split(";") if text else []:
        try:
            x1, y1, x2, y2 = (float(word) for word in box.split(","))
        except ValueError as error:
            raise RequirementError(
                f"--part: got {text!r}, expected X1,Y1,X2,Y2, such as 50,60,500,400; correct it"
            ) from error
        boxes.append((x1, y1, x2, y2))
    return tuple(boxes)


def _point(text: str) -> tuple[float, float] | None:
    from planner_core.errors import RequirementError

    if not text:
        return None
    try:
        x, y = (float(word) for word in text.split(","))
    except ValueError as error:
        raise RequirementError(f"--align: got {text!r}, expected X,Y, such as 120,340; correct it") from error
    return x, y


def _write_lifted(building: Building, path: Path, *, overwrite: bool) -> None:
    from planner_core.drawings.ifc_file import write_building
    from planner_core.errors import OutputExistsError
    from planner_core.plan_folder.atomic import staged_file

    path.parent.mkdir(parents=True, exist_ok=True)
    with staged_file(path) as staged:
        write_building(building, staged)
        if path.exists() and not overwrite and path.read_bytes() != staged.read_bytes():
            raise OutputExistsError(
                f"{path}: exists and is not what the drawing gives, perhaps mended since; plan from it with tlsplan "
                f"plan {path}, or pass --overwrite to replace it"
            )
