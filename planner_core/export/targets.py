"""Where formats are written to: what may be replaced, and the record that every folder of ours holds."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from planner_core.errors import ExportError, OutputExistsError, PlannerError
from planner_core.plan_folder.carry_over import foreign_entries
from planner_core.plan_folder.plan_source import PlanSource

RECORD = "pack.json"
"""In every folder that is exported: what it is of and which files are its own, so that only such are replaced."""
SCHEMA = "tlsplan/pack/1"
#: Its name in the last release: folders of then are replaced, too.
_EARLIER_RECORD = "handover.json"


@contextlib.contextmanager
def target_guarded(plan: PlanSource, target: Path) -> Iterator[None]:
    """Turn errors of the operating system into what they mean: of the plan's folder, or of the target.

    Raises
    ------
    ExportError
        A file can't be read or written.
    """
    try:
        yield
    except PlannerError:
        raise
    except OSError as error:
        missing = Path(os.fsdecode(error.filename)) if isinstance(error, FileNotFoundError) and error.filename else None
        if missing is not None and missing.is_relative_to(plan.folder):
            raise ExportError(
                f"{missing}: can't be read ({error.strerror}), expected a whole plan folder; plan again"
            ) from error
        raise ExportError(
            f"{target}: can't be written ({error.strerror or error}), nothing was changed; check the free space and "
            "the permissions"
        ) from error


def check_file(target: Path, *, overwrite: bool) -> None:
    """Refuse a target that is no file, or is there and is not to be replaced; raises `OutputExistsError`."""
    if target.is_symlink():
        raise OutputExistsError(f"{target}: is a link, expected a file of its own; name what it leads to")
    if target.is_dir():
        raise OutputExistsError(f"{target}: is a folder, expected a file to write; name a file in it")
    if target.exists() and not (overwrite and target.is_file()):
        raise OutputExistsError(f"{target}: exists, expected a free name; give another or pass --overwrite")


def check_is_no_source(plan: PlanSource, target: Path) -> None:
    """Refuse to replace what the plan is made of, its scene and its own files; raises `OutputExistsError`."""
    if not target.exists():
        return
    target = target.resolve()
    folder = plan.folder.resolve()
    inside = target.relative_to(folder).as_posix() if target.is_relative_to(folder) else ""
    is_scene = plan.has_scene() and target in [path.resolve() for path in plan.scene_paths()]
    if is_scene or (inside and inside not in foreign_entries(folder)):
        raise OutputExistsError(f"{target}: is what the plan is made of, expected a name of its own; give another")


def check_folder(target: Path, *, overwrite: bool) -> None:
    """Refuse a target that is no folder, or one that is not empty, but for what `overwrite` may replace.

    Raises
    ------
    OutputExistsError
        With the remedy.
    """
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise OutputExistsError(f"{target}: is not a folder, expected one to write; give another name")
    if not target.is_dir() or not any(target.iterdir()):
        return
    record = _record_of(target)
    if not record.is_file():
        raise OutputExistsError(
            f"{target}: holds files that were not exported from a plan; give another name or empty it yourself"
        )
    if not overwrite:
        raise OutputExistsError(f"{target}: exists, expected a free name; give another or pass --overwrite")
    others = sorted(set(_files(target)) - _recorded(record) - {record.name})
    if others:
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        raise OutputExistsError(
            f"{target}: holds {others[0]}{more}, which was not exported and would be deleted, expected none; "
            "move it away"
        )


def _files(folder: Path) -> dict[str, int]:
    """Bytes of all files below, by path."""
    paths = (path for path in sorted(folder.rglob("*")) if path.is_symlink() or not path.is_dir())
    return {path.relative_to(folder).as_posix(): path.lstat().st_size for path in paths}


def _record_of(folder: Path) -> Path:
    earlier = folder / _EARLIER_RECORD
    return earlier if earlier.is_file() else folder / RECORD


def _recorded(record: Path) -> set[str]:
    """Files that the record of a folder names."""
    try:
        return set(json.loads(record.read_text(encoding="utf-8"))["files"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise OutputExistsError(
            f"{record}: can't be read ({type(error).__name__}), expected the record of what was exported; "
            "give another name or empty the folder yourself"
        ) from error


def size_of(target: Path) -> tuple[int, int]:
    """Files and bytes."""
    files = [target] if target.is_file() else [path for path in target.rglob("*") if path.is_file()]
    return len(files), sum(path.stat().st_size for path in files)


def write_record(
    plan: PlanSource, formats: Mapping[str, str], staging: Path, subtracted_m: Mapping[str, list[float]]
) -> None:
    """Write down what the folder holds: of which plan, in which coordinates, and files with their bytes.

    subtracted_m : of files whose coordinates are less than the site's, by name: E, N, H taken off. Metres, as all
    figures of the record; `unit` is that of the files, of those formats that can be in feet.
    """
    frame = plan.frame
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "plan": plan.title,
        "plan_sha256": hashlib.sha256(((plan.planned or plan).folder / "plan.json").read_bytes()).hexdigest(),
        "coordinates": frame.crs_line,
        "crs": frame.crs,
        "vertical_crs": frame.vertical_crs,
        "unit": frame.unit.symbol,
        "source": frame.source,
        "residuals_m": [round(value, 6) for value in frame.residuals_m],
        "notes": list(frame.notes),
        "warnings": list(frame.warnings),
        "scene_to_site": [[float(value) for value in row] for row in frame.matrix],
        "subtracted_m": dict(subtracted_m),
        "formats": dict(formats),
        "files": _files(staging),
    }
    (staging / RECORD).write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
