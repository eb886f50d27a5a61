"""From plan.json back to what the plan was made from: `PlanSettings`, `LoadOptions`, and the scene file.

Input the document of `planner_core.plan_folder.plan_json.read_plan_json`. Whoever plans the found scene again with the
settings read here gets the same document, but for its droppable keys.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from planner_core.documents import read_as
from planner_core.errors import PlanFolderError
from planner_core.model import PlanSettings
from planner_core.model.options import method_of
from planner_core.plan_folder.plan_model.document import PlanDocument
from planner_core.scene.load import LoadOptions


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
    settings: PlanSettings = plan.settings.read(
        scanner=plan.scanner.read(),
        requirements=plan.requirements.read(),
        method=method_of(plan.method, plan.method_options.items()),
        seed=plan.seed,
        site=plan.site.read(),
    )
    return settings


def load_options_of(document: Mapping[str, Any]) -> LoadOptions:
    """Read the options that the scene was loaded with; raises `PlanFolderError` as `settings_of` does."""
    scene = _plan_of(document).scene
    if scene.load_options is None:
        return LoadOptions(glass=scene.glass, doors=scene.doors)
    options: LoadOptions = scene.load_options.read()
    return options


def _plan_of(document: Mapping[str, Any]) -> PlanDocument:
    return read_as(PlanDocument, document, "plan.json: ", remedy="plan again", error=PlanFolderError)


def find_scene(plan_folder: Path, document: Mapping[str, Any], told: Path | None = None) -> Path:
    """Find the scene file that a plan was made from, and check that it still is that file.

    Looked for where the user says; without that where plan.json says it was, beside the plan folder, and in the working
    directory.

    Raises
    ------
    PlanFolderError
        There is none, or only one of other contents.
    """
    name, digest = str(document["scene"]["file"]), str(document["scene"]["sha256"])
    if told is not None:
        if not told.is_file():
            raise PlanFolderError(f"{told}: no such file, expected the scene {name}; check --scene")
        if _sha256(told) != digest:
            raise PlanFolderError(
                f"{told}: is not the file that {plan_folder} was planned on, expected {name} of SHA-256 "
                f"{digest[:12]}...; give that one with --scene, or plan again"
            )
        return told
    others = []
    for path in _places_of_scene(plan_folder, document, name):
        if path.is_file():
            if _sha256(path) == digest:
                return path
            others.append(path)
    if others:
        raise PlanFolderError(
            f"{others[0]}: has changed since {plan_folder} was planned, expected {name} of SHA-256 {digest[:12]}...; "
            "plan again, or give the original file with --scene"
        )
    raise PlanFolderError(
        f"{plan_folder}: its scene {name} is not found at its path, beside the folder or in the working directory; "
        "give it with --scene"
    )


def _places_of_scene(plan_folder: Path, document: Mapping[str, Any], name: str) -> Iterator[Path]:
    # The way was written from where the folder really is, see `planner_core.plan_folder.plan_json`.
    folder = plan_folder.resolve()
    if document.get("source") is not None:
        yield folder / str(document["source"]["path"])
    yield folder.parent / name
    yield Path.cwd() / name


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise PlanFolderError(
            f"{path}: can't be read ({error.strerror or error}), expected the scene; check its permissions"
        ) from error
