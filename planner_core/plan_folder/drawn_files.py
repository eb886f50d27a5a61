"""The files of a drawn building beside the plan that is made from it.

=========================  =========================================================================================
`PLAN.drawing.json`        `DrawnBuilding`: as recognised, then as corrected; revisions count corrections
`PLAN.drawing-lines.json`  all that is drawn, under the walls in the viewer: of each storey lines of x, y in
                           millimetres, the first corner and then steps
`PLAN.drawing-1.png` ...   the picture that a storey was recognised in, as its plan
`PLAN.ifc`                 the building raised, which is planned
=========================  =========================================================================================

Each appears whole or not at all.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner_core.drawings.drawn_building import DrawnBuilding, raised, read_drawn
from planner_core.drawings.drawn_lines import DrawnLines
from planner_core.drawings.ifc_file import write_building
from planner_core.drawings.lift import PlanPicture
from planner_core.errors import PlanFolderError, RequirementError, SceneError
from planner_core.operating_system import sync
from planner_core.plan_folder.atomic import locked_folder, staged_file

SUFFIX = ".drawing.json"
LINES_SCHEMA = "tlsplan:drawing-lines:1"
MOST_BYTES = 64 * 1024 * 1024


@dataclass(frozen=True)
class DrawnFiles:
    """Where the files of a plan folder's drawn building are."""

    document: Path
    lines: Path
    ifc: Path

    def picture(self, storey: int) -> Path:
        """Where the picture of a storey is, counted from 0."""
        return self.lines.with_name(f"{self.lines.name.removesuffix('-lines.json')}-{storey + 1}.png")

    @classmethod
    def beside(cls, plan_folder: Path) -> DrawnFiles:
        """Return those of a plan folder."""
        return cls.of(plan_folder.resolve().with_name(f"{plan_folder.resolve().name}{SUFFIX}"))

    @property
    def plan_folder(self) -> Path:
        """The plan folder of this name, which may not be there yet."""
        return self.document.with_name(self.document.name.removesuffix(SUFFIX))

    @classmethod
    def of(cls, document: Path) -> DrawnFiles:
        """Return those of the document of this name."""
        name = document.name.removesuffix(SUFFIX)
        return cls(document, document.with_name(f"{name}.drawing-lines.json"), document.with_name(f"{name}.ifc"))


def is_drawn_file(path: Path) -> bool:
    """Whether a path is of the document of a drawn building, by its name."""
    return path.name.endswith(SUFFIX)


def read_drawn_file(path: Path) -> DrawnBuilding:
    """Read the document of a drawn building.

    Raises
    ------
    RequirementError
        It is not one, or not of this version; in one line.
    """
    return read_drawn(_json(path, "a drawn building"), f"{path.name}: ")


def read_lines(path: Path, storey: int) -> dict[str, Any]:
    """Read `lines` and `picture` of a storey; empty and None where there is no such file or storey.

    Raises
    ------
    RequirementError
        The file can't be read.
    """
    if not path.is_file():
        return {"lines": [], "picture": None}
    found = _json(path, "the lines of a drawing")
    storeys: Any = found.get("storeys") if isinstance(found, dict) and found.get("schema") == LINES_SCHEMA else None
    if not isinstance(storeys, list):
        raise RequirementError(f"{path.name}: it has no lines of {LINES_SCHEMA}; delete it, or plan the drawing again")
    found_storey: dict[str, Any] = storeys[storey] if 0 <= storey < len(storeys) else {"lines": [], "picture": None}
    return found_storey


def _json(path: Path, what: str) -> object:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise RequirementError(f"{path}: is larger than {MOST_BYTES >> 20} MiB, expected {what}; give another file")
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        if isinstance(error, RequirementError):
            raise
        why = (error.strerror or str(error)) if isinstance(error, OSError) else "it is no JSON"
        raise RequirementError(f"{path}: can't be read ({why}), expected {what}; restore it, or delete it") from error


def write_drawn(drawn: DrawnBuilding, path: Path) -> None:
    """Write the document of a drawn building; raises OSError."""
    with staged_file(path) as staged:
        staged.write_text(
            json.dumps(drawn.model_dump(mode="json", by_alias=True), ensure_ascii=False, separators=(",", ":")) + "\n",
            encoding="utf-8",
        )
        sync(staged)


def write_lines(lines: Sequence[DrawnLines], files: DrawnFiles, pictures: Sequence[PlanPicture | None] = ()) -> None:
    """Write lines and pictures of each storey; raises OSError."""
    boxes_m = [None if each is None else each.box_m for each in pictures] or [None] * len(lines)
    for storey, picture in enumerate(pictures):
        if picture is not None:
            with staged_file(files.picture(storey)) as staged:
                picture.write(staged)
    storeys = [{"lines": each.in_mm(), "picture": box_m} for each, box_m in zip(lines, boxes_m, strict=True)]
    document = {"schema": LINES_SCHEMA, "storeys": storeys}
    with staged_file(files.lines) as staged:
        staged.write_text(json.dumps(document, separators=(",", ":")) + "\n", encoding="utf-8")


def copy_drawn(source: DrawnFiles, target: DrawnFiles) -> None:
    """Copy the document, the lines and the pictures of a drawn building; raises OSError."""
    n_storeys = len(read_drawn_file(source.document).storeys)
    pairs = [(source.document, target.document), (source.lines, target.lines)]
    pairs += [(source.picture(storey), target.picture(storey)) for storey in range(n_storeys)]
    for here, there in pairs:
        if here.is_file() and here != there:
            with staged_file(there) as staged:
                shutil.copyfile(here, staged)


def write_raised(files: DrawnFiles) -> None:
    """Make the IFC file of a drawn building anew from its document.

    Raises
    ------
    RequirementError, SceneError, MissingPackageError
        As `read_drawn_file`, `raised` and `write_building` do.
    OSError
        The file can't be written.
    """
    building = raised(read_drawn_file(files.document))
    with staged_file(files.ifc) as staged:
        write_building(building, staged)


def save_correction(plan_folder: Path, base_revision: int, drawn: DrawnBuilding) -> DrawnBuilding | None:
    """Save what people corrected, as the next revision; None: another one was saved after `base_revision`.

    Parameters
    ----------
    drawn
        As corrected; its own revision does not count.

    Raises
    ------
    RequirementError
        It makes no sense, as `read_drawn`; or it is of another drawing than the plan.
    PlanFolderError
        It can't be written, and nothing was changed.
    """
    path = DrawnFiles.beside(plan_folder).document
    with locked_folder(path.parent):  # there may be no plan yet
        known = read_drawn_file(path)
        if known.revision != base_revision:
            return None
        if [file.sha256 for file in drawn.files] != [file.sha256 for file in known.files]:
            names = [", ".join(file.name for file in each.files) or "no drawing" for each in (drawn, known)]
            raise RequirementError(
                f"corrections: got those of {names[0]}, expected those of {names[1]}, by their SHA-256; reload the page"
            )
        if len(drawn.storeys) != len(known.storeys):
            raise RequirementError(
                f"corrections: got {len(drawn.storeys)} storeys, expected {len(known.storeys)}; reload the page"
            )
        saved = read_drawn(
            {**drawn.model_dump(mode="json", by_alias=True), "revision": base_revision + 1}, "corrections: "
        )
        try:
            raised(saved)
        except SceneError as error:  # what can't be raised is not saved
            raise RequirementError(f"corrections: {error}") from error
        try:
            write_drawn(saved, path)
            sync(path.parent)
        except OSError as error:
            raise PlanFolderError(
                f"{path}: can't be written ({error.strerror or error}), nothing was saved; check the free space and "
                "the permissions"
            ) from error
        return saved
