"""Requirements in whole plans: what is asked of all, of floors, classes and zones is met, recounted from scans."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stages import find_positions
from tlsplan import inputs
from tlsplan.options import RequirementOptions

import scenes_synthetic
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, PartRequirement, Plan, PlanSettings, PointLimits, Proven, Requirements, Scope
from planner_core.planning.plan import make_plan
from planner_core.scene.patches import patch_triangles

Planned = Callable[[str, PlanSettings], Plan]


def candidates_m(plan: Plan) -> FloatArray:
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    floors = tuple(range(len(survey.floors)))
    return find_positions(survey, plan.settings, engine, floors=floors).candidates.position_m


def stations_m(plan: Plan) -> FloatArray:
    return np.stack([station.position_m for station in plan.stations])


def share(plan: Plan, part: Any, of_candidates: Any, of_stations: Any, seen_from: int = 1) -> float:
    """Covered share of the part's achievable area; `of_...` (N, P) bool, where each meets what is asked."""
    area_m2 = plan.survey.patches.area_m2
    achievable = part & (of_candidates.sum(axis=0) >= seen_from)
    covered = achievable & (of_stations.sum(axis=0) >= seen_from)
    assert achievable.any()
    return float(area_m2[covered].sum() / area_m2[achievable].sum())


def floor_of_patches(plan: Plan) -> Any:
    return plan.survey.floor_of_triangle[plan.survey.patches.triangle_of_patch]


@pytest.mark.slow
def test_parts_with_figures_of_their_own_are_met_as_scans_recount_them(
    small: PlanSettings, planned: Planned, looks: Any
) -> None:
    requirements = Requirements(
        coverage=0.8,
        network="none",
        parts=(
            PartRequirement("upper", coverage=0.9, floors=("F1",)),
            PartRequirement("walls", coverage=0.93, classes=("IfcWall*",)),
            PartRequirement("corner", coverage=0.97, zone=((-1.0, -1.0), (4.0, -1.0), (4.0, 4.0), (-1.0, 4.0))),
        ),
    )
    plan = planned("house", replace(small, requirements=requirements, method=Proven(work_limit=0.02)))
    scene = plan.survey.scene
    by_candidates, by_stations = (looks(plan, at).seen for at in (candidates_m(plan), stations_m(plan)))
    everything = np.ones(plan.survey.patches.n_patches, dtype=bool)
    floor = floor_of_patches(plan)
    element = scene.element_of_triangle[plan.survey.patches.triangle_of_patch]
    is_wall = np.array([each.kind.startswith("IfcWall") for each in scene.elements])[element]
    middle = patch_triangles(scene, plan.survey.patches).mean(axis=1)
    in_corner = (np.abs(middle[:, :2] - 1.5) <= 2.5).all(axis=1)
    shares = {
        "overall": share(plan, everything, by_candidates, by_stations),
        plan.survey.floors[0].name: share(plan, floor == 0, by_candidates, by_stations),
        "upper": share(plan, floor == 1, by_candidates, by_stations),
        "walls": share(plan, is_wall, by_candidates, by_stations),
        "corner": share(plan, in_corner, by_candidates, by_stations),
    }
    assert [r.name for r in plan.requirements] == [plan.survey.floors[0].name, "upper", "overall", "walls", "corner"]
    for result in plan.requirements:
        assert result.met
        # Beams on the margin between two patches may count for either.
        assert shares[result.name] == pytest.approx(result.fraction_of_achievable, abs=0.003)
        assert shares[result.name] >= result.required - 0.003


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "seen_from"),
    [
        pytest.param(PointLimits(range_m=3.5), 1, marks=pytest.mark.slow),
        (PointLimits(incidence_rad=1.0), 2),
        pytest.param(PointLimits(spacing_m=0.1, range_m=4.5), 1, marks=pytest.mark.slow),
    ],
)
def test_limits_and_numbers_of_looks_are_met_as_scans_recount_them(
    asked: PointLimits, seen_from: int, small: PlanSettings, planned: Planned, looks: Any
) -> None:
    requirements = Requirements(coverage=0.9, limits=asked, seen_from=seen_from)
    plan = planned("l-room", replace(small, requirements=requirements))

    def meets(at: FloatArray) -> Any:
        found = looks(plan, at)
        good = found.seen.copy()
        for name in ("spacing_m", "range_m", "incidence_rad"):
            limit = getattr(asked, name)
            if limit is not None:
                with np.errstate(invalid="ignore"):
                    good &= getattr(found, name) <= limit
        return good

    by_candidates, by_stations = meets(candidates_m(plan)), meets(stations_m(plan))
    everything = np.ones(plan.survey.patches.n_patches, dtype=bool)
    found = share(plan, everything, by_candidates, by_stations, seen_from)
    assert found == pytest.approx(plan.coverage.fraction_of_achievable, abs=0.003)
    assert found >= 0.9 - 0.003
    plain = planned("l-room", small)
    assert len(plan.stations) >= len(plain.stations)
    assert plan.coverage.achievable_area_m2 < plain.coverage.achievable_area_m2


def test_what_no_spot_can_meet_is_refused_in_one_line_with_the_limit_to_ease(small: PlanSettings) -> None:
    scene = scenes_synthetic.build("box").scene
    for requirements, words in (
        (Requirements(limits=PointLimits(spacing_m=1e-5)), ("'overall'", "spacing", "the best is")),
        (Requirements(limits=PointLimits(range_m=0.1)), ("'overall'", "range")),
        (Requirements(seen_from=500), ("500",)),
        (
            Requirements(parts=(PartRequirement("door", classes=("IfcDoor",)),)),
            ("'door'", "IfcDoor"),
        ),
    ):
        with pytest.raises(RequirementError) as refusal:
            make_plan(scene, replace(small, requirements=requirements))
        assert "\n" not in str(refusal.value)
        assert all(word in str(refusal.value) for word in words)


@pytest.mark.slow
def test_what_can_be_had_in_part_is_planned_and_the_rest_explained(small: PlanSettings, planned: Planned) -> None:
    plan = planned("l-room", replace(small, requirements=Requirements(coverage=0.9, limits=PointLimits(range_m=2.0))))
    lines = [line for line in plan.warnings if "can't be scanned with" in line]
    assert len(lines) == 1
    assert "2 m" in lines[0]
    at = plan.warnings.index(lines[0])
    assert plan.warnings[at + 1].startswith("  ")
    assert "range is at best" in plan.warnings[at + 1]
    assert plan.coverage.meets(0.9)


@pytest.fixture
def asked_for(tmp_path: Path) -> Path:
    path = tmp_path / "asked.yaml"
    path.write_text(
        "coverage: 85 %\nnetwork: none\nincidence: 80 deg\nclasses:\n  IfcSlab: {coverage: 90 %, range: 4 m}\n"
        "site: {entrances: [[1.0, 1.0, 0.0]]}\n"
    )
    return path


def test_options_take_the_place_of_entries_of_the_file(asked_for: Path) -> None:
    requirements, site = inputs.requirements_and_site(
        RequirementOptions(file=asked_for, coverage=80.0, range_="5 m", entrances=("2,1,0",)),
        deliverable="none",
        scope=Scope.ALL,
    )
    assert requirements.coverage == 0.8
    assert requirements.network == "none"
    assert requirements.limits.range_m == 5.0
    assert requirements.limits.incidence_rad == pytest.approx(np.radians(80.0))
    # Parts keep what they say themselves, and follow the option where they say nothing.
    assert requirements.parts[0].coverage == 0.9
    assert requirements.parts[0].limits.range_m == 4.0
    assert site.entrances_m == ((2.0, 1.0, 0.0),)
