"""The routes of drawings: what was recognised, its rooms and lines, and corrections."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from planner_core.drawings.drawn_lines import DrawnLines
from planner_core.plan_folder.drawn_files import DrawnFiles, read_drawn_file, write_drawn, write_lines
from tests.drawings.drawn_buildings import room_document
from viewer_web.server.app import create_app
from viewer_web.server.serve import drawing_side
from viewer_web.server.session import Session

from .conftest import TOKEN, send

Ask = Callable[..., httpx.Response]
DRAWN = room_document()


def application(plan_folder: Path, built_app: Path, *, read_only: bool = False) -> Ask:
    session = Session(plan_folder, read_only=read_only)
    app = create_app(
        plan_folder, token=TOKEN, session=session, routers=[drawing_side(session).router], built_app=built_app
    )
    return lambda *arguments, **named: send(app, *arguments, **named)


@pytest.fixture
def files(plan_folder: Path) -> DrawnFiles:
    found = DrawnFiles.beside(plan_folder)
    write_drawn(DRAWN, found.document)
    write_lines([DrawnLines(np.array([[0.0, 0.0], [4.4, 0.0]]), np.array([0, 2]))], found)
    return found


def correction(base: int, **changes: Any) -> dict[str, Any]:
    return {"base_revision": base, "drawing": {**DRAWN.model_dump(mode="json", by_alias=True), **changes}}


def test_plan_of_a_model_has_no_drawing(plan_folder: Path, built_app: Path) -> None:
    ask = application(plan_folder, built_app)
    answer = ask("/api/drawing").json()
    assert (answer["drawing"], answer["rooms"], answer["has_plan"]) == (None, [], True)
    assert ask("/api/drawing/lines/0").json() == {"lines": [], "picture": None}
    assert ask("/api/drawing/picture/0").status_code == 404
    assert ask("/api/drawing", "POST", body=correction(0)).status_code == 404


def test_drawing_comes_with_its_rooms_and_lines(plan_folder: Path, built_app: Path, files: DrawnFiles) -> None:
    ask = application(plan_folder, built_app)
    answer = ask("/api/drawing").json()
    assert (answer["file"], answer["may_correct"]) == ("plan.drawing.json", True)
    assert answer["drawing"] == DRAWN.model_dump(mode="json", by_alias=True)
    ((room,),) = answer["rooms"]
    assert (room["name"], room["long_name"]) == ("7", "Store")
    assert sorted(map(tuple, room["outline"])) == [(0.2, 0.2), (0.2, 3.2), (4.2, 0.2), (4.2, 3.2)]
    assert ask("/api/drawing/lines/0").json() == {"lines": [[0, 0, 4400, 0]], "picture": None}
    files.picture(0).write_bytes(b"picture")
    assert ask("/api/drawing/picture/0").content == b"picture"


def test_correction_is_saved_and_two_pages_do_not_overwrite_each_other(
    plan_folder: Path, built_app: Path, files: DrawnFiles
) -> None:
    ask = application(plan_folder, built_app)
    body = correction(0)
    body["drawing"]["storeys"][0]["walls"].pop()
    saved = ask("/api/drawing", "POST", body=body)
    assert (saved.status_code, saved.json()["drawing"]["revision"], saved.json()["rooms"]) == (200, 1, [[]])
    assert len(read_drawn_file(files.document).storeys[0].walls) == 3
    late = ask("/api/drawing", "POST", body=correction(0))
    assert late.status_code == 409
    assert "another page saved corrections meanwhile" in late.json()["message"]
    assert len(read_drawn_file(files.document).storeys[0].walls) == 3


@pytest.mark.parametrize(
    ("changes", "status", "message"),
    [
        ({"files": [{"name": "b.dxf", "sha256": "1" * 64}]}, 422, "got those of b.dxf, expected those of house.dxf"),
        ({"scale": 0}, 422, "drawing.scale"),
        ({"door_height_m": 3.0}, 422, "room height: got 2.8 m, expected at least the head of doors"),
    ],
)
def test_what_makes_no_sense_is_refused_in_words(
    plan_folder: Path, built_app: Path, files: DrawnFiles, changes: dict[str, Any], status: int, message: str
) -> None:
    answer = application(plan_folder, built_app)("/api/drawing", "POST", body=correction(0, **changes))
    assert (answer.status_code, message in answer.json()["message"]) == (status, True)
    assert read_drawn_file(files.document) == DRAWN


def test_damaged_file_and_read_only_are_stated(plan_folder: Path, built_app: Path, files: DrawnFiles) -> None:
    assert (
        application(plan_folder, built_app, read_only=True)("/api/drawing", "POST", body=correction(0)).status_code
        == 403
    )
    files.document.write_text('{"schema": "tlsplan:drawing:9"}')
    answer = application(plan_folder, built_app)("/api/drawing")
    assert answer.status_code == 422
    assert answer.json()["message"].startswith("plan.drawing.json: got the schema 'tlsplan:drawing:9'")


def test_drawing_without_a_plan_is_shown_and_corrected(tmp_path: Path, built_app: Path) -> None:
    write_drawn(DRAWN, tmp_path / "floor.drawing.json")
    ask = application(tmp_path / "floor", built_app)
    assert ask("/api/drawing").json()["has_plan"] is False
    assert ask("/api/session").status_code == 503
    assert ask("/api/drawing", "POST", body=correction(0, north_deg=10.0)).status_code == 200
    assert read_drawn_file(tmp_path / "floor.drawing.json").north_deg == 10.0
