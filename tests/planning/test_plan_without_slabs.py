"""Storeys without slabs are planned as with them: the plane that people stand on ends beams and is scanned."""

from dataclasses import replace
from pathlib import Path

import pytest

from planner_core.errors import RequirementError
from planner_core.model import Greedy, PlanSettings
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from tests.reality_files import reality
from tests.scene.floor_scenes import scene_of


@pytest.mark.slow
def test_storeys_without_slabs_are_asked_for_what_they_are_with_slabs(small: PlanSettings) -> None:
    def asked_m2(path: Path) -> list[float]:
        settings = replace(small, method=Greedy(), grid_step_m=2.0)
        return [c.achievable_area_m2 for c in make_plan(load_scene(path), settings).coverage_by_floor]

    slabs, none = (asked_m2(reality(f"two_storeys_{name}.ifc")) for name in ("slabs", "no_slabs"))
    assert none == pytest.approx(slabs, rel=0.02)


def test_walls_that_enclose_nothing_are_refused_with_what_to_load() -> None:
    walls = [("south", "IfcWall", 0, (0, 0, 0), (14, 0.2, 3)), ("north", "IfcWall", 0, (0, 9, 0), (14, 9.2, 3))]
    scene = scene_of(walls, (("Ground", 0.0),))
    with pytest.raises(RequirementError, match="walls enclose nothing there: load the file that has all walls"):
        make_plan(scene, PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=4.0, grid_step_m=1.0))
