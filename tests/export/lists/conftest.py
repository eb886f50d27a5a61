"""Plans of `field_plan.py`, and what writes them."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from planner_core.export.formats import Writer
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import silent

# Tests of this folder share field_plan.py; importlib's import mode puts no folder on the path.
_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import field_plan as made
finally:
    sys.path.remove(_FOLDER)


@pytest.fixture
def scene_plan() -> PlanSource:
    """In scene coordinates."""
    return made.field_plan()


@pytest.fixture
def site_plan() -> PlanSource:
    """In UTM coordinates."""
    return made.field_plan(made.site_frame())


Write = Callable[..., tuple[Path, tuple[str, ...]]]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Call with a writer, a plan and options; returns the file and the remarks."""

    def run(writer: Writer, plan: PlanSource, name: str = "out", **options: object) -> tuple[Path, tuple[str, ...]]:
        path = tmp_path / name
        return path, writer(plan, path, Options(**options), silent)  # type: ignore[arg-type]

    return run
