"""Floors of the real models: expected by hand from the files' storeys and sections, never from our own output.

The table is the one of docs/benchmarks/real-buildings.md.
"""

import numpy as np
import pytest

from planner_core.scene.floors import find_floors
from planner_core.scene.load import LoadOptions, load_scene
from tests.scene.real_buildings import EXPECTED

#: Of each kind of evidence one: storeys without slabs, walls or slabs alone, a trade, no storeys, y up.
QUICK = {
    "ifc-openhouse-ifc4.ifc", "ifc-munich-roof-bricscad.ifc",
    "ifc-schependomlaan-kanaalplaatvloer-archicad18.ifc", "gltf-habitat-simple-room.glb",
}  # fmt: skip
#: Minutes to read.
LARGE = {
    "ifc-schependomlaan-houten-kozijnen-archicad18.ifc", "ifc-schependomlaan-linden-frames-tekla20.ifc",
    "schependomlaan, eight files",
}  # fmt: skip
NAMES = [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.campaign if name in LARGE else pytest.mark.slow)
    for name in EXPECTED
]


@pytest.mark.parametrize("name", NAMES)
def test_floors_are_what_people_stand_on(name, corpus_file):
    expected = EXPECTED[name]
    files = [corpus_file(file) for file in expected.files or (name,)]
    scene = load_scene(files, options=LoadOptions(up_axis=expected.up))
    report = find_floors(scene)
    found = [(f.name, f.elevation_m + scene.offset_m[2]) for f in report.floors]
    assert [n for n, _ in found] == [n for n, _ in expected.floors]
    assert [z for _, z in found] == pytest.approx([z for _, z in expected.floors], abs=0.1)
    if expected.bounds_m:
        bounds_m = [(f.bounds_m + scene.offset_m[:2]).ravel() for f in report.floors]
        assert np.array(bounds_m) == pytest.approx(np.array(expected.bounds_m), abs=0.1)
    if not expected.floors:
        assert any("no floor found" in line and "trade" in line for line in report.warnings)
