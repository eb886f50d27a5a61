"""Explanations: the surfaces and limits named are those that geometry says, and areas add up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from oracles import observations_from
from stages import demand_of

from planner_core.model import PartRequirement, PointLimits, Requirements
from planner_core.requirements.explain import explain, shortfalls
from planner_core.scanner.load_scanner import load_scanner


@pytest.fixture(scope="module")
def west(box: SimpleNamespace) -> np.ndarray:
    """Three positions 1 m off the west wall: the east wall is 7 m away."""
    return box.positions_m[:3]


def test_nothing_is_to_be_explained_where_all_that_is_seen_meets(box: SimpleNamespace, settings_of, west) -> None:
    for asked in (PointLimits(), PointLimits(range_m=50.0)):
        assert explain(box.survey, demand_of(box.survey, settings_of(limits=asked), box.engine, west)) == ()


def test_the_far_wall_is_out_of_range_and_said_to_be(box: SimpleNamespace, settings_of, west) -> None:
    wanted = settings_of(limits=PointLimits(range_m=5.0, incidence_rad=1.5))
    demand = demand_of(box.survey, wanted, box.engine, west)
    found = {each.element: each for each in shortfalls(box.survey, demand)}
    assert found[2].area_m2 == pytest.approx(10.0)  # 4 x 2.5 m, whole
    assert (found[2].limit, found[2].floor, found[2].goal) == ("range_m", 1, "overall")
    # Its nearest point is 8 - 1.013 m from a position, its corners at most 0.05 m farther apart than patches' middles.
    assert found[2].least == pytest.approx(6.99, abs=0.05)
    assert found[2].least < found[2].greatest < np.sqrt(6.987**2 + 1.05**2 + 1.5**2)
    assert 3 not in found  # the wall beside them
    lines = explain(box.survey, demand)
    assert lines[0].startswith("requirement 'overall': ")
    assert "can't be scanned with range 5 m, incidence 85.9°" in lines[0]
    east = next(line for line in lines if "East wall" in line)
    assert east.startswith("  East wall (IfcWallStandardCase, East): 10.0 m2, range is at best 6.99 m to 7.1")
    assert east.endswith(" m, 5 m required")


def test_shortfalls_are_the_area_that_a_recount_finds_and_their_limit_admits_most(
    box: SimpleNamespace, settings_of, west
) -> None:
    asked = PointLimits(spacing_m=0.05, range_m=5.0, incidence_rad=1.1)
    wanted = settings_of(limits=asked)
    demand = demand_of(box.survey, wanted, box.engine, west)
    observations = observations_from(box.survey, wanted, box.engine, west)
    n_patches, area = demand.n_patches, box.survey.patches.area_m2
    ok = {
        name: getattr(observations, name) <= np.float32(limit)
        for name, limit in vars(asked).items()
        if limit is not None
    }
    met = np.zeros(n_patches, dtype=bool)
    met[observations.patch[np.all(list(ok.values()), axis=0)]] = True
    seen = np.zeros(n_patches, dtype=bool)
    seen[observations.patch] = True
    found = shortfalls(box.survey, demand)
    assert len(found) > 3
    causes = set()
    for element in range(6):
        missed = seen & ~met & (box.element_of_patch == element)
        told = [each for each in found if each.element == element]
        assert sum(each.area_m2 for each in told) == pytest.approx(area[missed].sum(), abs=0.01)
        if not told:
            continue
        admitted = {}
        for name in ok:
            without = np.zeros(n_patches, dtype=bool)
            without[observations.patch[np.all([kept for other, kept in ok.items() if other != name], axis=0)]] = True
            admitted[name] = area[without & missed].sum()
        best = max(admitted.values())
        assert admitted[told[0].limit] == best if best > 0 else told[0].limit == ""
        causes.add(told[0].limit)
    assert len(causes) > 1


def test_several_limits_at_once_are_said_where_no_single_one_is_to_blame(
    box: SimpleNamespace, settings_of, west
) -> None:
    demand = demand_of(box.survey, settings_of(limits=PointLimits(spacing_m=0.04, range_m=4.0)), box.engine, west)
    east = next(each for each in shortfalls(box.survey, demand) if each.element == 2)
    # 7 m away, rows are 7 x 0.0087 = 0.06 m apart: both limits are missed.
    assert east.limit == ""
    assert np.isnan(east.least)
    assert any("East wall" in line and "several limits combined" in line for line in explain(box.survey, demand))


def test_surface_met_from_too_few_candidates_is_told_apart(box: SimpleNamespace, settings_of) -> None:
    demand = demand_of(
        box.survey, settings_of(limits=PointLimits(range_m=4.2), seen_from=2), box.engine, box.positions_m[[0, 1, 4]]
    )
    few = [each for each in shortfalls(box.survey, demand) if each.limit == "seen_from"]
    times = demand.times_met[0]
    expected = box.survey.patches.area_m2[times == 1].sum()
    assert expected > 1
    assert sum(each.area_m2 for each in few) == pytest.approx(expected, abs=0.06)
    assert any("met from fewer than 2 of 3 candidates" in line for line in explain(box.survey, demand))


def test_noise_that_the_scanner_does_not_know_is_said_to_be_unknown(box: SimpleNamespace, settings_of, west) -> None:
    scanner = replace(
        load_scanner("hdl-64e"),
        range_noise=((0.1, 0.01, 0.001), (4.0, 0.01, 0.001), (0.1, 1.0, 0.001), (4.0, 1.0, 0.001)),
    )
    wanted = replace(settings_of(), scanner=scanner, requirements=Requirements(limits=PointLimits(noise_m=0.002)))
    lines = explain(box.survey, demand_of(box.survey, wanted, box.engine, west))
    assert any("East wall" in line and line.endswith("noise is not known there, 2 mm required") for line in lines)


def test_what_two_requirements_ask_alike_is_told_once(box: SimpleNamespace, settings_of, west) -> None:
    asked = PointLimits(range_m=5.0)
    parts = (
        PartRequirement("walls", limits=asked, classes=("IfcWall*",)),
        PartRequirement("walls again", limits=asked, classes=("IfcWall*",)),
        PartRequirement("closely", limits=PointLimits(range_m=4.0), classes=("IfcWall*",)),
    )
    demand = demand_of(box.survey, settings_of(limits=asked, parts=parts), box.engine, west)
    assert {each.goal for each in shortfalls(box.survey, demand)} == {"overall", "closely"}
    alone = demand_of(box.survey, settings_of(parts=parts), box.engine, west)
    assert {each.goal for each in shortfalls(box.survey, alone)} == {"walls", "closely"}


def test_a_floor_nobody_named_that_can_not_be_had_is_explained_and_no_error(
    box: SimpleNamespace, settings_of, west
) -> None:
    far = replace(box.survey, floor_of_triangle=np.array([0, 0, 0, 0, 1, 1, 0, 0, 0, 0, -1, -1], dtype=np.int32))
    demand = demand_of(far, settings_of(limits=PointLimits(range_m=5.0)), box.engine, west)
    assert not demand.achievable(demand.goals.each[1]).any()
    assert any("East wall (IfcWallStandardCase, East): 10.0 m2, range" in line for line in explain(far, demand))


def test_few_elements_are_listed_and_the_rest_summed(box: SimpleNamespace, settings_of, west) -> None:
    lines = explain(box.survey, demand_of(box.survey, settings_of(limits=PointLimits(range_m=1.2)), box.engine, west))
    assert len(lines) == 7
    assert lines[-1].startswith("  1 more elements, ") or lines[-1].startswith("  2 more elements, ")
