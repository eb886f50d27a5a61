"""`tlsplan plan` on drawings, end to end."""

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from tlsplan import drawings
from tlsplan.drawings import OPTION_OF, with_drawings_lifted
from tlsplan.options import DrawingSettings, FileOptions
from tlsplan.progress import ProgressReporter

from planner_core.errors import RequirementError
from planner_core.plan_folder.drawn_files import write_drawn
from planner_core.scene.load import load_scene
from tests.drawings.drawn_buildings import draw_two_rooms, room_document

QUICK = ("--grid", "1.0", "--height", "1.5", "--patch-area", "0.2", "--coverage", "80", "--set", "work_limit=0.1",
         "--no-refine", "--verify", "0")  # fmt: skip


def test_drawing_is_planned_from_an_ifc_file_beside_the_plan(tlsplan, tmp_path: Path) -> None:
    draw_two_rooms(tmp_path / "house.dxf")
    folder, lifted = tmp_path / "new" / "out", tmp_path / "new" / "out.ifc"
    done = tlsplan("plan", tmp_path / "house.dxf", "-o", folder, "--json", *QUICK)
    assert done.returncode == 0, done.stderr
    scene = load_scene(lifted)
    assert [room.title for room in scene.rooms] == ["101 Office", "102 Kitchen"]
    document = json.loads((folder / "plan.json").read_text())
    assert document["scene"]["file"] == "out.ifc"
    where = np.array([station["position"] for station in document["stations"]])
    assert ((where > [0.2, 0.2, 1.0]) & (where < [6.3, 4.2, 2.0])).all()


def test_common_points_are_two_numbers_or_none() -> None:
    assert [drawings._point(text) for text in ("120,-34.5", "")] == [(120.0, -34.5), None]
    for wrong in ("120", "120,34,5", "a,b"):
        with pytest.raises(RequirementError, match=r"--align: got .* expected X,Y"):
            drawings._point(wrong)


def test_corrections_are_raised_as_they_are_and_never_lost(tlsplan, tmp_path: Path) -> None:
    """A storey of another height: the drawing is not read over it, and the document alone gives the IFC file."""
    draw_two_rooms(tmp_path / "house.dxf")
    drawn = room_document()
    document, ifc = tmp_path / "out.drawing.json", tmp_path / "out.ifc"
    storeys = (replace(drawn.storeys[0], room_height_m=3.2),)
    write_drawn(drawn.model_copy(update={"revision": 2, "storeys": storeys}), document)
    before = document.read_bytes()
    done = tlsplan("plan", tmp_path / "house.dxf", "-o", tmp_path / "out", "--overwrite")
    assert done.returncode != 0
    assert "out.drawing.json: holds 2 saved corrections" in done.stderr and not ifc.exists()
    done = tlsplan("plan", document, "-o", tmp_path / "out", "--scale", "1:50")
    assert "--scale: got it with out.drawing.json, which has its own" in done.stderr
    done = tlsplan("plan", document, tmp_path / "house.dxf", "-o", tmp_path / "out")
    assert "out.drawing.json: got house.dxf besides" in done.stderr
    with ProgressReporter(quiet=True) as reporter:
        for lifted in (ifc, tmp_path / "other.ifc"):
            scenes, _ = with_drawings_lifted(
                [document], FileOptions(), DrawingSettings(), lifted, reporter, overwrite=False
            )
            assert list(scenes) == [lifted]
    assert (tmp_path / "other.drawing.json").read_bytes() == before == document.read_bytes()
    assert ifc.read_bytes() == (tmp_path / "other.ifc").read_bytes()
    assert load_scene(ifc).vertices_m[:, 2].max() == pytest.approx(3.4)


@pytest.mark.slow
def test_other_commands_name_the_way(tlsplan, tmp_path: Path) -> None:
    draw_two_rooms(tmp_path / "house.dxf")
    done = tlsplan("floors", tmp_path / "house.dxf")
    assert done.returncode != 0
    assert "tlsplan plan raises it to an IFC file" in done.stderr


@pytest.mark.slow
def test_mended_file_is_kept_without_overwrite(tlsplan, tmp_path: Path) -> None:
    draw_two_rooms(tmp_path / "house.dxf")
    (tmp_path / "out.ifc").write_bytes(b"mended")
    done = tlsplan("plan", tmp_path / "house.dxf", "-o", tmp_path / "out", *QUICK)
    assert done.returncode != 0
    assert "perhaps mended since; plan from it with tlsplan plan" in done.stderr
    assert (tmp_path / "out.ifc").read_bytes() == b"mended"


@pytest.mark.parametrize(
    ("scene", "option", "message"),
    [
        ("house.dxf", ("--scale", "1:100"), "house.dxf: got a scale of a DXF, which has a unit"),
        ("house.dxf", ("--layer", "wall=NOPE*"), "layer pattern 'NOPE*': no layer or block has such a name"),
        ("house.ifc", ("--page", "2"), "--page: got it with house.ifc, which is a model"),
    ],
)
def test_options_that_would_not_count_are_refused(
    tlsplan, tmp_path: Path, scene: str, option: tuple[str, ...], message: str
) -> None:
    draw_two_rooms(tmp_path / "house.dxf")
    done = tlsplan("plan", tmp_path / scene, "-o", tmp_path / "out", *option)
    assert done.returncode in (3, 4)
    assert message in done.stderr and done.stderr.count("tlsplan: ") == 1


def test_every_option_of_drawings_is_refused_without_one() -> None:
    assert set(OPTION_OF) == {field.name for field in fields(DrawingSettings)}
