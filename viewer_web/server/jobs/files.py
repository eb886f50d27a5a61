"""The files of a run, in `<plan>/runs/R001/`.

===============  ======================================================================================================
`run.json`       how the run stands: `documents.RunDocument`; appears whole, by one writer at a time
`begun.json`     stations that its search begins with, where it goes on from another run
`basis/`         plan.json and review.usda as they were when it was requested
`log.jsonl`      its messages while it worked, a line each
`output.txt`     what its process printed: nothing, unless something went wrong
`cancel`         it has to end; its text is the reason
`plan.ifc` ...   the corrected drawing that it plans and its lines, `plan.drawing.json`, and what that is raised to
`plan/`          its plan, a whole plan folder, once it has one
===============  ======================================================================================================
"""

import json
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from pydantic import ValidationError

from planner_core.errors import PlanFolderError
from planner_core.operating_system import sync
from planner_core.plan_folder.atomic import staged_file
from viewer_web.server.jobs.documents import RunDocument

RUNS = "runs"
DOCUMENT, BEGUN, BASIS, LOG, OUTPUT, CANCEL, PLAN = (
    "run.json", "begun.json", "basis", "log.jsonl", "output.txt", "cancel", "plan",
)  # fmt: skip
_ID = re.compile(r"R[0-9]{3,9}")


def is_run_id(text: str) -> bool:
    """Whether a run may have this name."""
    return _ID.fullmatch(text) is not None


def run_id(number: int) -> str:
    """Return the name of the run of this number."""
    return f"R{number:03d}"


def run_numbers(runs: Path) -> list[int]:
    """Numbers of the runs that there are, the first first."""
    if not runs.is_dir():
        return []
    return sorted(int(path.name[1:]) for path in runs.iterdir() if is_run_id(path.name) and path.is_dir())


def now() -> str:
    """The time as it is written."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def read_run(folder: Path) -> RunDocument:
    """Read how a run stands; raises `PlanFolderError` where that can't be read."""
    file = folder / DOCUMENT
    try:
        return RunDocument.model_validate_json(file.read_bytes())
    except (OSError, ValidationError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not what a run writes"
        raise PlanFolderError(f"{file}: can't be read ({why}), expected a run; delete the folder of the run") from error


def write_run(folder: Path, document: RunDocument, *, keep: bool) -> None:
    """Write how a run stands, whole or not at all. keep : have the disk hold it; raises OSError."""
    with staged_file(folder / DOCUMENT) as staging:
        staging.write_text(document.model_dump_json(indent=1) + "\n", encoding="utf-8")
        if keep:
            sync(staging)
    if keep:
        sync(folder)


def read_begun(folder: Path) -> tuple[tuple[float, ...], ...]:
    """Stations that a run begins with: (x, y, z), scene frame."""
    file = folder / BEGUN
    if not file.is_file():
        return ()
    return tuple(tuple(float(value) for value in place) for place in json.loads(file.read_text(encoding="utf-8")))


def write_begun(folder: Path, places_m: Sequence[Sequence[float]]) -> None:
    """Write the stations that a run begins with."""
    (folder / BEGUN).write_text(json.dumps([list(place) for place in places_m]) + "\n", encoding="utf-8")
