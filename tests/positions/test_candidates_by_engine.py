"""Both engines admit the same positions, also where planes lie in line with the grid and flush with floors."""

import pytest
from stages import find_candidates

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import PlanSettings
from planner_core.scanner.load_scanner import load_scanner

REAL = [pytest.param("duplex", marks=pytest.mark.slow), pytest.param("fzk-haus", marks=pytest.mark.campaign)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["house", *REAL])
def test_candidates_of_a_building_do_not_depend_on_the_engine(name, real_scene):
    scene = scenes_synthetic.build(name).scene if name == "house" else real_scene(name)
    settings = PlanSettings(
        scanner=load_scanner("hdl-64e"), grid_step_m=1.0, instrument_heights_m=(1.3,), max_patch_area_m2=0.1
    )
    survey = make_survey(scene, settings)
    found = []
    for engine in ("open3d", "auto"):
        scan_engine = open_engine(scene, survey.patches, engine=engine)
        candidates = find_candidates(survey, settings, scan_engine, floors=tuple(range(len(survey.floors))))
        found.append({tuple(place) for place in candidates.position_m.round(4).tolist()})
    assert found[0], "no candidates at all"
    assert found[0] == found[1], sorted(found[0] ^ found[1])
