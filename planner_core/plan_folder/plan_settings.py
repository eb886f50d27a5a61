"""From plan.json back to what the plan was made from: `PlanSettings`, `LoadOptions`, and the scene files.

Input the document of `planner_core.plan_folder.plan_json.read_plan_json`. Whoever plans the found scene again with the
settings read here gets the same document, but for its droppable keys.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner_core.documents import read_as
from planner_core.errors import PlanFolderError
from planner_core.model import PlanSettings, Requirements
from planner_core.model.options import method_of
from planner_core.model.planning import PlanParameters, fields_of
from planner_core.plan_folder.plan_model.document import PlanDocument
from planner_core.scene.load import LoadOptions

ScenePaths = Path | Sequence[Path] | None
"""Where scene files are, by the user: all, some, or none of them."""


def settings_of(document: Mapping[str, Any]) -> PlanSettings:
    """Read the settings that a plan was made with.

    Notes
    -----
    `scan_mode` is the one that was used, `beams` or `patches`, where it was left to `auto`.

    Raises
    ------
    PlanFolderError
        A value is not as it is written; its place is named.
    RequirementError
        A setting of the document makes no sense, as of one that was edited.
    """
    plan = _plan_of(document)
    return PlanSettings(
        scanner=plan.scanner,
        requirements=Requirements(**fields_of(Requirements, plan.requirements)),
        method=method_of(plan.method, plan.method_options.items()),
        seed=plan.seed,
        site=plan.site,
        **fields_of(PlanParameters, plan.settings),
    )


def load_options_of(document: Mapping[str, Any]) -> tuple[LoadOptions, ...]:
    """Read the options that each file of the scene was loaded with; raises `PlanFolderError` as `settings_of` does."""
    scene = _plan_of(document).scene
    if scene.load_options is None:
        return (LoadOptions(glass=scene.glass, doors=scene.doors),)
    return (scene.load_options, *(file.load_options for file in scene.other_files))


def _plan_of(document: Mapping[str, Any]) -> PlanDocument:
    return read_as(PlanDocument, document, "plan.json: ", remedy="plan again", error=PlanFolderError)


def find_scene(plan_folder: Path, document: Mapping[str, Any], scenes: ScenePaths = None) -> tuple[Path, ...]:
    """Find the scene files that a plan was made from, and check that they still are those files.

    Searched for in `scenes`; without that at their paths in plan.json, beside the plan folder, and in the
    working directory.

    Raises
    ------
    PlanFolderError
        There is none of one, or only one of other contents.
    """
    given = _given(plan_folder, document, scenes)
    return tuple(given.get(file.sha256) or _found(plan_folder, file) for file in _planned_files(plan_folder, document))


@dataclass(frozen=True)
class _PlannedFile:
    """A scene file as plan.json names it. way : where it was, seen from the folder; empty: not known."""

    name: str
    sha256: str
    way: str


def _planned_files(plan_folder: Path, document: Mapping[str, Any]) -> list[_PlannedFile]:
    scene, source = document["scene"], document.get("source")
    rows = [scene, *scene.get("other_files", ())]
    ways = [""] * len(rows) if source is None else [source["path"], *source.get("other_paths", ())]
    if len(ways) != len(rows):
        raise PlanFolderError(
            f"{plan_folder}: its plan.json has {len(ways)} paths for {len(rows)} scene files, expected one each; plan "
            "again"
        )
    return [_PlannedFile(str(row["file"]), str(row["sha256"]), str(way)) for row, way in zip(rows, ways, strict=True)]


def _given(plan_folder: Path, document: Mapping[str, Any], scenes: ScenePaths) -> dict[str, Path]:
    """SHA-256 -> the user's files, each one of the plan's."""
    given = {}
    planned = _planned_files(plan_folder, document)
    names = ", ".join(file.name for file in planned)
    for path in () if scenes is None else (scenes,) if isinstance(scenes, Path) else scenes:
        if not path.is_file():
            raise PlanFolderError(f"{path}: no such file, expected the scene {names}; check --scene")
        digest = _sha256(path)
        if digest not in {file.sha256 for file in planned}:
            named = [file for file in planned if file.name == path.name] or planned
            expected = f"{named[0].name} of SHA-256 {named[0].sha256[:12]}..." if len(named) == 1 else f"one of {names}"
            raise PlanFolderError(
                f"{path}: is not the file that {plan_folder} was planned on, expected {expected}; give that one with "
                "--scene, or plan again"
            )
        given[digest] = path
    return given


def _found(plan_folder: Path, file: _PlannedFile) -> Path:
    others = []
    for path in _places_of(plan_folder, file):
        if path.is_file():
            if _sha256(path) == file.sha256:
                return path
            others.append(path)
    if others:
        raise PlanFolderError(
            f"{others[0]}: has changed since {plan_folder} was planned, expected {file.name} of SHA-256 "
            f"{file.sha256[:12]}...; plan again, or give the original file with --scene"
        )
    raise PlanFolderError(
        f"{plan_folder}: its scene {file.name} is not found at its path, beside the folder or in the working "
        "directory; give it with --scene"
    )


def _places_of(plan_folder: Path, file: _PlannedFile) -> Iterator[Path]:
    # The way was written from where the folder really is, see `planner_core.plan_folder.plan_json`.
    folder = plan_folder.resolve()
    if file.way:
        yield folder / file.way
    yield folder.parent / file.name
    yield Path.cwd() / file.name


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise PlanFolderError(
            f"{path}: can't be read ({error.strerror or error}), expected the scene; check its permissions"
        ) from error
