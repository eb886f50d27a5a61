"""Links of a draft by the overlap that its plan names: those of a plan of the same stations, and sets of patches."""

from __future__ import annotations

import json
import shutil
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from stages import rows_from

from planner_core.engine.open_engine import open_engine
from planner_core.network.links import overlap_links, surface_of_patches
from planner_core.planning.live.draft import Draft
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live
from planner_core.requirements.compliance import rows_of_overlap

WAYS = [(measure, of) for measure in ("smaller-share", "jaccard") for of in ("all-seen", "seen-as-required")]
_SLOW = [pytest.param(way, marks=pytest.mark.slow) for way in WAYS[1:3]]


@pytest.fixture(scope="module", params=[WAYS[0], WAYS[3], *_SLOW], ids="-".join)
def live(
    request: pytest.FixtureRequest,
    asking_folder: Path,
    asking_house: LivePlan,
    tmp_path_factory: pytest.TempPathFactory,
) -> LivePlan:
    """A plan whose requirements limit range and incidence, opened as if it had been asked to measure so."""
    if request.param == WAYS[0]:
        return asking_house
    measure, of = request.param
    folder = tmp_path_factory.mktemp("overlap") / "plan"
    shutil.copytree(asking_folder, folder)
    document = json.loads((folder / "plan.json").read_text())
    document["requirements"] |= {"overlap_measure": measure, "overlap_of": of}
    (folder / "plan.json").write_text(json.dumps(document))
    return open_live(folder, scene=asking_folder.parent / "house.ifc")


@pytest.mark.slow
def test_links_of_a_draft_are_those_of_a_plan_bit_by_bit_and_of_sets(live: LivePlan) -> None:
    asked, survey = live.settings.requirements, live.survey
    at_m = np.array([station.position_m for station in live.draft.stations])
    engine = open_engine(survey.scene, survey.patches)
    rows = rows_from(survey, live.settings, engine, at_m, live._demand)
    counted = rows_of_overlap(live._demand, rows, asked.overlap_of)
    plan = live.figures(live.draft).plan
    surface = surface_of_patches(survey.scene, survey.patches, np.ones(survey.patches.n_patches, dtype=bool))
    measure = asked.overlap_measure
    start = live.settings.pre_alignment
    expected = overlap_links(
        counted, survey.patches.area_m2, live.draft.ids, surface, at_m, measure=measure, pre_alignment=start
    )
    assert plan.links == expected
    assert len(expected) > 3
    sets = [set(counted.row(number).tolist()) for number in range(len(live.draft.stations))]
    told = {(link.a, link.b): link.overlap for link in plan.links}
    area_m2 = survey.patches.area_m2
    for i, j in combinations(range(len(sets)), 2):
        one, other = (float(area_m2[list(each)].sum()) for each in (sets[i], sets[j]))
        both = float(area_m2[list(sets[i] & sets[j])].sum())
        share = both / (one + other - both if asked.overlap_measure == "jaccard" else max(one, other))
        if share > 0.0501:
            assert told[live.draft.ids[i], live.draft.ids[j]] == pytest.approx(share, abs=1e-6)


@pytest.mark.slow
def test_a_station_dragged_back_to_its_place_has_the_same_links(live: LivePlan) -> None:
    station = live.draft.stations[0]
    links = live.preview(live.draft, station.id, station.floor, station.position_m, 1.5).links
    own = [link for link in live.figures(live.draft).plan.links if station.id in (link.a, link.b)]
    assert {frozenset((link.a, link.b)): link.overlap for link in links} == {
        frozenset((link.a, link.b)): link.overlap for link in own
    }
    assert len(own) > 0


@pytest.mark.slow
def test_ways_to_measure_differ(live: LivePlan, asking_house: LivePlan) -> None:
    usual = asking_house.figures(asking_house.draft).plan.links
    asked = live.settings.requirements
    same = live.figures(Draft(asking_house.draft.stations)).plan.links == usual
    assert same == ((asked.overlap_measure, asked.overlap_of) == WAYS[0])
