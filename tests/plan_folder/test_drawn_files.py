"""Corrections of a drawing beside a plan: saved whole, one after another, of this drawing alone."""

from dataclasses import replace

import numpy as np
import pytest

from planner_core.drawings.drawn_building import DrawnBuilding, DrawnFile
from planner_core.drawings.drawn_lines import DrawnLines
from planner_core.errors import RequirementError
from planner_core.plan_folder.drawn_files import (
    DrawnFiles,
    read_drawn_file,
    read_lines,
    save_correction,
    write_drawn,
    write_lines,
)
from tests.drawings.drawn_buildings import room_document

DRAWN = room_document()
WALL = DRAWN.storeys[0].walls[0]


@pytest.fixture
def plan(tmp_path):
    folder = tmp_path / "plan"
    folder.mkdir()
    write_drawn(DRAWN, DrawnFiles.beside(folder).document)
    return folder


def corrected(name: str) -> DrawnBuilding:
    return DRAWN.model_copy(update={"storeys": (replace(DRAWN.storeys[0], name=name),)})


def test_corrections_are_on_disk_and_an_overtaken_one_changes_nothing(plan):
    saved = save_correction(plan, 0, corrected("Ground"))
    assert saved is not None and saved.revision == 1
    assert save_correction(plan, 0, corrected("Cellar")) is None
    kept = read_drawn_file(DrawnFiles.beside(plan).document)
    assert (kept.revision, kept.storeys[0].name) == (1, "Ground")
    assert [path.name for path in plan.parent.iterdir() if path.is_file()] == ["plan.drawing.json"]


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        (
            DRAWN.model_copy(update={"files": (DrawnFile("other.dxf", "1" * 64),)}),
            "corrections: got those of other.dxf, expected those of house.dxf",
        ),
        (DRAWN.model_copy(update={"storeys": DRAWN.storeys * 2}), "corrections: got 2 storeys, expected 1"),
        (
            DRAWN.model_copy(
                update={"storeys": (replace(DRAWN.storeys[0], walls=(replace(WALL, outline=((0.0, 0.0),) * 4),)),)}
            ),
            "wall W1: got .*, expected a simple outline",
        ),
    ],
)
def test_what_can_not_be_saved_leaves_the_file_as_it_was(plan, sent, message):
    before = DrawnFiles.beside(plan).document.read_bytes()
    with pytest.raises(RequirementError, match=message):
        save_correction(plan, 0, sent)
    assert DrawnFiles.beside(plan).document.read_bytes() == before


@pytest.mark.parametrize(
    ("content", "message"), [(b"{", "it is no JSON"), (b"\xff", "it is no JSON"), (b"[]", "got the schema None")]
)
def test_damaged_document_is_one_line(plan, content, message):
    path = DrawnFiles.beside(plan).document
    path.write_bytes(content)
    with pytest.raises(RequirementError, match=message):
        read_drawn_file(path)


def test_lines_are_kept_to_a_millimetre(tmp_path):
    points_m = np.array([[0.0, 0.0], [1.0004, 0.0], [1.0, 2.5], [-3.0, 1.0], [-3.0, 2.0]])
    files = DrawnFiles.beside(tmp_path / "plan")
    write_lines([DrawnLines(points_m, np.array([0, 3, 5]))], files)
    assert read_lines(files.lines, 0)["lines"] == [[0, 0, 1000, 0, 0, 2500], [-3000, 1000, 0, 1000]]
    assert read_lines(files.lines, 1) == {"lines": [], "picture": None} == read_lines(tmp_path / "none.json", 0)
