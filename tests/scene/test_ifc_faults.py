"""Files that end IfcOpenShell's process are refused before it is asked, by a line that names what is wrong."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest

from planner_core.errors import SceneError
from planner_core.scene.ifc_faults import check_references
from planner_core.scene.load import load_scene
from tests.reality_files import reality
from tests.scene import broken_ifc


@pytest.fixture(scope="session")
def building_text(tmp_path_factory, write_building) -> str:
    path = tmp_path_factory.mktemp("building") / "building.ifc"
    write_building(path)
    return path.read_text()


@pytest.mark.parametrize("name", broken_ifc.REFUSED)
def test_fault_is_named_before_shapes_are_made(tmp_path, building_text, name, monkeypatch):
    monkeypatch.setattr("ifcopenshell.geom.iterator", lambda *_, **__: pytest.fail("shapes were made"))
    change, expected = broken_ifc.REFUSED[name]
    path = tmp_path / "broken.ifc"
    path.write_text(change(building_text))
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert re.search(expected, message), message
    assert message.startswith("broken.ifc: ")
    assert "\n" not in message


@pytest.mark.parametrize("name", broken_ifc.READ)
def test_file_that_ends_nothing_is_read(tmp_path, building_text, name):
    path = tmp_path / "odd.ifc"
    path.write_text(broken_ifc.READ[name](building_text))
    assert load_scene(path).n_triangles > 50


@pytest.mark.parametrize(
    ("ifc_class", "slot", "value", "expected"),
    [
        ("IfcLocalPlacement", 1, "$", r"#\d+ \(IfcLocalPlacement\) lacks RelativePlacement, which its schema requires"),
        ("IfcProductDefinitionShape", 2, "$", r"#\d+ \(IfcProductDefinitionShape\) lacks Representations"),
        ("IfcUnitAssignment", 0, "5", r"#\d+ \(IfcUnitAssignment\) has an attribute of another type"),
        ("IfcBuildingStorey", 9, "'x'", r"#\d+ \(IfcBuildingStorey\) has an attribute of another type"),
        ("IfcBuildingStorey", 5, "#1", r"#1 \(Ifc\w+\) is named where its schema has another class"),
        ("IfcRelContainedInSpatialStructure", 5, "5", r"#\d+ \(Ifc\w+\) has an attribute of another type"),
    ],
)
def test_fault_of_contents_names_the_entity_and_no_type_of_python(
    tmp_path, building_text, ifc_class, slot, value, expected
):
    path = tmp_path / "broken.ifc"
    number = broken_ifc.instance(building_text, ifc_class)
    path.write_text(broken_ifc.changed(building_text, number, slot, value))
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert re.search(expected, message), message
    assert "object" not in message and "NoneType" not in message and "\n" not in message
    assert message.endswith("correct it, or check the file with an IFC validator and export it again.")


@pytest.mark.parametrize(("slot", "expected"), [(1, "lacks RelativePlacement"), (None, "no placement .*: IfcOpening")])
def test_opening_that_nothing_places_is_named(tmp_path, building_text, slot, expected):
    path, opening = tmp_path / "uncut.ifc", broken_ifc.instance(building_text, "IfcOpeningElement")
    if slot is None:
        path.write_text(broken_ifc.changed(building_text, opening, 5, "$"))
        (message,) = load_scene(path).report.warnings
    else:
        placement = broken_ifc.slots(building_text, opening)[5]
        path.write_text(broken_ifc.changed(building_text, placement, slot, "$"))
        with pytest.raises(SceneError, match=rf"of opening {opening} ") as caught:
            load_scene(path)
        message = str(caught.value)
    assert re.search(expected, message), message


def test_room_that_nothing_places_is_named(tmp_path, building_text):
    path = tmp_path / "unplaced.ifc"
    path.write_text(broken_ifc.changed(building_text, broken_ifc.instance(building_text, "IfcSpace"), 5, "$"))
    (line,) = (line for line in load_scene(path).report.warnings if "placement" in line)
    assert "1 product has no placement" in line and "IfcSpace Room" in line


def test_placement_without_axes_is_named():
    with pytest.raises(SceneError, match=r"#23 \(IfcLocalPlacement\) lacks RelativePlacement"):
        load_scene(reality("placement_without_axis.ifc"))


def test_file_of_nothing_but_rooms_says_what_it_holds():
    with pytest.raises(SceneError, match=r"it holds 3 IfcSpace, .* and no element with a surface"):
        load_scene(reality("rooms_only.ifc"))


# ------------------------------------------------------------------------------------------------ references
def lines(references: dict[int, list[int]]) -> bytes:
    """Instances and what they name, in any order and with blanks in odd places."""
    rng = random.Random(1)
    written = [
        f"#{n}{rng.choice(['', ' ', chr(10)])}= A(({','.join(f'#{m}' for m in names)}));"
        for n, names in references.items()
    ]
    return "\n".join(rng.sample(written, len(written))).encode()


def walked(references: dict[int, list[int]], start: int, way: tuple[int, ...] = ()) -> tuple[bool, float]:
    """Whether a way from `start` comes back to itself, and how many instances are below it, one by one."""
    if start in way:
        return True, 0.0
    below = [walked(references, n, (*way, start)) for n in references.get(start, []) if n in references]
    return any(loop for loop, _ in below), 1.0 + sum(n for _, n in below)


@pytest.mark.slow
def test_loops_and_parts_are_those_of_a_walk(monkeypatch):
    """Against a walk along every way, on small random graphs."""
    rng = np.random.default_rng(7)
    told = set()
    for _ in range(300):
        numbers = rng.choice(10**6, size=7, replace=False).tolist()
        references = {n: rng.choice([*numbers, 10**7], size=rng.integers(0, 3)).tolist() for n in numbers}
        loops, n_parts = walked(references, numbers[0])
        monkeypatch.setattr("planner_core.scene.ifc_faults.MOST_IN_A_SHAPE", n_parts - 0.5 if not loops else np.inf)
        with pytest.raises(SceneError) as caught:
            if loops or n_parts:
                check_references(Path("a.ifc"), lines(references), {numbers[0]})
        assert ("made of itself" in str(caught.value)) == loops
        told.add(loops)
        if not loops:
            monkeypatch.setattr("planner_core.scene.ifc_faults.MOST_IN_A_SHAPE", n_parts)
            check_references(Path("a.ifc"), lines(references), {numbers[0]})
    assert told == {True, False}


def test_loop_that_no_shape_needs_is_let_be():
    references = {1: [2], 2: [3], 3: [], 10: [11], 11: [10]}
    check_references(Path("a.ifc"), lines(references), {1})
    with pytest.raises(SceneError, match=r"a\.ifc: #1[01] \(A\) is made of itself"):
        check_references(Path("a.ifc"), lines(references), {10})


def test_longest_chain_that_is_read(monkeypatch):
    monkeypatch.setattr("planner_core.scene.ifc_faults.MOST_IN_A_CHAIN", 5)
    chain = {n: [n + 1] for n in range(1, 9)} | {9: []}
    check_references(Path("a.ifc"), lines(chain), {4})
    with pytest.raises(SceneError, match=r"#3 \(A\) stands on a chain of more than 5 instances"):
        check_references(Path("a.ifc"), lines(chain), {3})
