"""Commands on several files of one building: units and up axis of one of them, and words on what does not fit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tlsplan.inputs import load
from tlsplan.options import FileOptions

from planner_core.errors import RequirementError
from planner_core.progress import silent
from tests.reality_files import reality

BOX = """v 0 0 {z}
v {w} 0 {z}
v {w} {w} {z}
v 0 {w} {z}
f 1 2 3
f 1 3 4
"""


@pytest.fixture
def slabs(tmp_path: Path) -> tuple[Path, Path]:
    """A slab of 10 m in metres, and one 3 m above it in millimetres."""
    low, high = tmp_path / "low.obj", tmp_path / "high.obj"
    low.write_text(BOX.format(z=0, w=10))
    high.write_text(BOX.format(z=3000, w=10_000))
    return low, high


def test_units_of_one_file(slabs: tuple[Path, Path]) -> None:
    expected = [[0.0, 0.0, 0.0], [10.0, 10.0, 3.0]]
    for units in ((("high.obj", "mm"),), (("", "m"), (str(slabs[1]), "mm")), (("", "mm"), ("low.obj", "m"))):
        scene = load(slabs, FileOptions(units=units), progress=silent)
        np.testing.assert_allclose([scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)], expected)


def test_up_axis_of_one_file(slabs: tuple[Path, Path]) -> None:
    slabs[1].write_text("v 0 3 0\nv 10 3 0\nv 10 3 -10\nv 0 3 -10\nf 1 2 3\nf 1 3 4\n")
    scene = load(slabs, FileOptions(up=(("high.obj", "y"),)), progress=silent)
    np.testing.assert_allclose(scene.vertices_m.max(axis=0), [10.0, 10.0, 3.0])


def test_options_of_no_file_and_of_one_twice_are_refused(slabs: tuple[Path, Path]) -> None:
    with pytest.raises(
        RequirementError, match=r"--units: got hihg\.obj=mm, expected one of the scene's files \(low\.obj,"
    ):
        load(slabs, FileOptions(units=(("hihg.obj", "mm"),)), progress=silent)
    with pytest.raises(
        RequirementError, match=r"--up: got y and z, expected one; name the file of each, such as --up low"
    ):
        load(slabs, FileOptions(up=(("", "y"), ("", "z"))), progress=silent)


def test_closed_doors_are_those_that_plan_json_names_shut(slabs: tuple[Path, Path]) -> None:
    scene = load(slabs, FileOptions(doors="closed", units=(("high.obj", "mm"),)), progress=silent)
    assert scene.source.doors == "shut"


def test_single_doors_are_refused_where_the_scene_has_none(tlsplan, slabs: tuple[Path, Path]) -> None:
    for option in ("--door-open", "--door-closed", "--door-shut"):
        done = tlsplan("floors", slabs[0], option, "0w$5Bz2Kf9yR4Q_x7LmN1c")
        assert done.returncode == 3, done.stderr
        assert "door: got '0w$5Bz2Kf9yR4Q_x7LmN1c', expected the GlobalId of one of the 0 doors" in done.stderr


def test_floors_of_several_files(tlsplan, slabs: tuple[Path, Path]) -> None:
    done = tlsplan("floors", *slabs, "--units", "high.obj=mm", "--json")
    assert done.returncode == 0, done.stderr
    (floor,) = json.loads(done.stdout)["floors"]
    assert floor["ground_area_m2"] == pytest.approx(100.0) and floor["other_levels"] == []
    refused = tlsplan("floors", *slabs, "--units", "high.obj=yards")
    assert refused.returncode != 0
    assert "yards" in refused.stderr and "Traceback" not in refused.stderr


@pytest.mark.slow
def test_floors_that_are_longer_than_any_building_have_a_line(tlsplan, tmp_path: Path) -> None:
    # A deck of 470 m: a house of 12 m in inches that was read in metres has walls and ceiling as high as that.
    site = tmp_path / "site.obj"
    site.write_text(BOX.format(z=0, w=470) + BOX.format(z=9, w=470).replace("1 2 3", "5 6 7").replace("1 3 4", "5 7 8"))
    done = tlsplan("floors", site, "--json")
    assert done.returncode == 0, done.stderr
    assert any("floors are 470 m long, expected 3 to 400 m" in line for line in json.loads(done.stdout)["warnings"])


def test_levels_of_a_floor_beside_its_own_are_listed(tlsplan) -> None:
    done = tlsplan("floors", reality("mezzanine.ifc"))
    assert done.returncode == 0, done.stderr
    assert "F0  EG: 34.8 m2 of its ground at 2.800 m" in done.stdout
