"""Files of ../shared/data/reality whose right answer is what loading and floors make of them."""

from __future__ import annotations

import pytest

from planner_core.errors import SceneError
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from tests.reality_files import reality


@pytest.mark.parametrize(
    ("name", "refusal"),
    [
        ("glb-sparse-1e7.glb", "declares 10 000 000 values without a buffer, expected 1 000 000 at most"),
        (
            "missing_reference.usda",
            "could not be opened: 'https://example.com/.*usd'; .*no faces without them",
        ),
        ("number_with_two_points.ifc", "line 34, #27: '5.0.' is no STEP syntax"),
        ("placement_without_axis.ifc", "#23 .IfcLocalPlacement. lacks RelativePlacement"),
    ],
)
def test_file_is_refused_by_its_cause(name: str, refusal: str) -> None:
    with pytest.raises(SceneError, match=refusal) as caught:
        load_scene(reality(name))
    assert "\n" not in str(caught.value)


def test_building_whose_unit_was_lost_is_refused_with_the_unit_before_its_shapes_are_made(monkeypatch) -> None:
    monkeypatch.setattr("planner_core.scene.ifc.shapes_by", lambda *_: pytest.fail("a shape was made"))
    with pytest.raises(SceneError, match=r"placed over 15751 x 8902 x 4199 m, .* --units mm, in which it is 15\.8 m"):
        load_scene(reality("ifc-unit-assignment-lost.ifczip"))


@pytest.mark.parametrize(
    ("name", "warning"),
    [
        ("metre_room_cm_desk.usda", "is in metres with z up, and parts in 'desk.usda' are in centimetres with y up"),
        ("one_reference_missing.usda", "could not be opened: 'walls.usd'"),
        ("hall_with_space_volume.glb", "IfcSpace"),
    ],
)
def test_doubt_is_one_line(name: str, warning: str) -> None:
    lines = load_scene(reality(name)).report.warnings
    assert sum(warning in line for line in lines) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "origin"), [("two_storeys_no_slabs.ifc", "storey-elevation"), ("two_storeys_slabs.ifc", "slab")]
)
def test_storeys_without_slabs_have_the_ground_of_those_with(name: str, origin: str) -> None:
    floors = find_floors(load_scene(reality(name))).floors
    assert [floor.origin for floor in floors] == [origin] * 2
    assert [floor.elevation_m for floor in floors] == pytest.approx([0.0, 4.2], abs=0.01)
    assert [floor.ground_area_m2 for floor in floors] == pytest.approx([96.0, 96.0], abs=1.0)
