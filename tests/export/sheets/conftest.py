"""The house of sheet_house.py, planned once; and its sheets, in site coordinates and in those of the scene."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from planner_core.coordinates.request import FrameRequest
from planner_core.export.options import Options
from planner_core.export.sheets.html_page import write_html
from planner_core.export.sheets.sheet_set import write_pdf
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import silent

# Tests of this folder share sheet_house.py and sheet_reading.py; importlib's import mode puts no folder on the path.
_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import sheet_house as house
    import sheet_reading as reading
finally:
    sys.path.remove(_FOLDER)

ORIGIN_M, ROTATION_RAD = (691_000.0, 5_334_000.0, 512.0), 0.35
FRAME = FrameRequest(crs="EPSG:25832", origin_m=ORIGIN_M, rotation_rad=ROTATION_RAD)


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep these tests on one worker, so that the house is planned once."""
    for item in items:
        if item.path.parent == Path(__file__).parent:
            item.add_marker(pytest.mark.xdist_group("sheet house"))


@pytest.fixture(scope="session")
def sheet_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return house.write_plan(tmp_path_factory.mktemp("sheets"))


@pytest.fixture(scope="session")
def site_plan(sheet_folder: Path) -> PlanSource:
    """In UTM coordinates, turned."""
    return open_plan(sheet_folder, frame=FRAME)


@pytest.fixture(scope="session")
def scene_plan(sheet_folder: Path) -> PlanSource:
    return open_plan(sheet_folder)


Sheets = Callable[..., "reading.Pdf"]


@pytest.fixture(scope="session")
def pdf_of(tmp_path_factory: pytest.TempPathFactory) -> Sheets:
    """Call with a plan and options, on A4 by default; returns what a PDF reader finds. Each is written once."""
    folder = tmp_path_factory.mktemp("pdf")
    written: dict[tuple[int, Options], tuple[PlanSource, reading.Pdf]] = {}  # the plan is held for its id

    def write(plan: PlanSource, **options: Any) -> reading.Pdf:
        key = id(plan), Options(**{"paper": "A4", **options})
        if key not in written:
            path = folder / f"{len(written)}.pdf"
            written[key] = plan, reading.Pdf(path, write_pdf(plan, path, key[1], silent))
        return written[key][1]

    return write


@pytest.fixture(scope="session")
def html_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Call with a plan and options; returns the page."""
    path = tmp_path_factory.mktemp("html") / "sheets.html"

    def write(plan: PlanSource, **options: Any) -> str:
        write_html(plan, path, Options(**options), silent)
        return path.read_text(encoding="utf-8")

    return write


@pytest.fixture(scope="session")
def site_sheets(site_plan: PlanSource, pdf_of: Sheets) -> "reading.Pdf":
    """The house in site coordinates on A4."""
    return pdf_of(site_plan)


@pytest.fixture
def rename_station() -> Callable[[Any, str, str], None]:
    """Call with plan.json's document, an id and a new one."""
    return house.rename_station


@pytest.fixture
def edited(sheet_folder: Path, tmp_path: Path) -> Callable[..., PlanSource]:
    """Call with a function that edits plan.json; returns that plan, the rest as it was."""

    def make(edit: Callable[[dict[str, Any]], None]) -> PlanSource:
        return open_plan(house.edited(sheet_folder, tmp_path / "edited", edit))

    return make
