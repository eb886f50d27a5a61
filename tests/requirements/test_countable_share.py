"""What counts of patches, against plain loops over samples and areas that follow from a drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles import enough_of, observations_from
from slow_cases import all_slow_but
from stages import demand_of, observed_from, rows_from

import scenes_synthetic
from planner_core.coverage.observations import observations_meeting, observed_enough
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import PartRequirement, PlanSettings, PointLimits, Requirements, Survey
from planner_core.requirements.demand import KnownObservations
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(
    scanner=load_scanner("rtc360"), requirements=Requirements(network="none", scope="all"), max_patch_area_m2=0.16
)


@pytest.fixture(scope="module", params=["opencl", "open3d"])
def rooms(request: pytest.FixtureRequest) -> tuple[Survey, ScanEngine]:
    survey = make_survey(scenes_synthetic.build("two-rooms").scene, SETTINGS)
    return survey, open_engine(survey.scene, survey.patches, engine=request.param)


def positions_of(survey: Survey, n: int) -> np.ndarray:
    low, high = survey.floors[0].bounds_m
    x = np.linspace(low[0] + 0.8, high[0] - 0.8, n)
    return np.stack(
        [x, np.full(n, (low[1] + high[1]) / 2 + 0.3), np.full(n, survey.floors[0].elevation_m + 1.7)], axis=1
    )


@pytest.mark.parametrize(
    "asked",
    [
        Requirements(network="none"),
        Requirements(
            network="none",
            limits=PointLimits(range_m=4.0, incidence_rad=1.2),
            parts=(PartRequirement("near", 0.5, limits=PointLimits(range_m=2.0)),),
        ),
    ],
    ids=["plain", "limits"],
)
def test_rows_areas_and_looks_later_on_are_those_of_plain_loops(
    rooms: tuple[Survey, ScanEngine], asked: Requirements
) -> None:
    survey, engine = rooms
    settings = replace(SETTINGS, requirements=asked)
    at = positions_of(survey, 5)
    demand = demand_of(survey, settings, engine, at)
    observations = observations_from(survey, settings, engine, at)
    assert demand.countable_share is not None
    enough = enough_of(observations, demand.countable_share, demand.goals.qualities)
    # Samples and points of their own say the same of what is cut, but for their coarseness.
    cut = enough.by_samples < 255
    assert 0.02 < cut.mean() < 0.5
    assert (demand.countable_share[~cut] == 255).all()
    off = (demand.countable_share[cut].astype(int) - enough.by_samples[cut]) / 255
    assert np.abs(off).max() < 0.3
    assert abs(off.mean()) < 0.03
    assert 0 < (~enough.seen).sum() < 0.5 * enough.seen.size
    assert demand.rows.seen.patch.tolist() == observations.patch[enough.seen].tolist()
    # Whatever one position meets, one sees enough of.
    meets = np.any([observations_meeting(observations, each) for each in demand.goals.qualities], axis=0)
    assert set(np.unique(demand.rows.met.patch % survey.patches.n_patches)) == set(observations.patch[meets])
    n_met = sum(int(met.sum()) for met in enough.met)
    assert demand.rows.met.patch.size == n_met
    counting = demand.with_counted_patches(survey)
    area_m2 = survey.patches.area_m2 * demand.countable_share / 255
    np.testing.assert_allclose(counting.patches.area_m2, area_m2)
    np.testing.assert_allclose(demand.area_m2.reshape(len(demand.goals.qualities), -1)[-1], area_m2)
    later = observations_from(counting, settings, engine, at)
    assert later.patch.tolist() == demand.rows.seen.patch.tolist()
    assert observed_enough(observations, demand.countable_share).starts.tolist() == later.starts.tolist()
    # Positions of later keep to what counts, whether the survey knows it or the demand alone; so does a demand anew.
    for known in (counting, survey):
        rows = rows_from(known, settings, engine, at, demand)
        assert rows.met.patch.tolist() == demand.rows.met.patch.tolist()
    again = demand_of(counting, settings, engine, at[:2])
    np.testing.assert_array_equal(again.countable_share, demand.countable_share)


@pytest.mark.slow
def test_what_was_looked_at_before_counts_with_the_rest(rooms: tuple[Survey, ScanEngine]) -> None:
    survey, engine = rooms
    settings = replace(SETTINGS, requirements=Requirements(network="none", limits=PointLimits(range_m=4.0)))
    at = positions_of(survey, 6)
    whole = demand_of(survey, settings, engine, at)
    row = np.array([4, 1])
    known = KnownObservations(row, observed_from(survey, settings, engine, at[row]))
    again = demand_of(survey, settings, engine, at, known=known)
    np.testing.assert_array_equal(again.countable_share, whole.countable_share)
    for one, other in ((again.rows.seen, whole.rows.seen), (again.rows.met, whole.rows.met)):
        assert (one.starts.tolist(), one.patch.tolist()) == (other.starts.tolist(), other.patch.tolist())
    # All of them, in another order than asked for.
    order = np.array([4, 1, 0, 5, 3, 2])
    turned = demand_of(
        survey, settings, engine, at, known=KnownObservations(order, observed_from(survey, settings, engine, at[order]))
    )
    np.testing.assert_array_equal(turned.countable_share, whole.countable_share)
    assert turned.rows.met.patch.tolist() == whole.rows.met.patch.tolist()
    some = demand_of(survey, settings, engine, at[row])
    assert some.countable_share is not None
    assert (some.countable_share != whole.countable_share).any()


@pytest.mark.parametrize("patch_m2", all_slow_but([0.04], [0.16, 0.04, 0.01]))
def test_a_closed_room_has_the_area_of_its_drawing(patch_m2: float) -> None:
    """`box`: 6 x 4 x 2.7 m clear, in slabs and walls that reach 0.2 m further: whole patches have more."""
    settings = replace(SETTINGS, max_patch_area_m2=patch_m2)
    survey = make_survey(scenes_synthetic.build("box").scene, settings)
    engine = open_engine(survey.scene, survey.patches)
    height = survey.floors[0].elevation_m + 1.7
    grid = np.array([[x, y, height] for x in np.linspace(0.5, 5.5, 6) for y in np.linspace(0.5, 3.5, 4)])
    demand = demand_of(survey, settings, engine, grid)
    area_m2 = demand.with_counted_patches(survey).patches.area_m2[demand.times_met[0] > 0]
    truth_m2 = 2 * (6 * 4 + 6 * 2.7 + 4 * 2.7)
    # A hundred large patches are cut here: chance is as much again.
    assert area_m2.sum() == pytest.approx(truth_m2, rel=0.002 if patch_m2 > 0.1 else 0.001)
    whole_m2 = survey.patches.area_m2[demand.times_met[0] > 0].sum()
    assert whole_m2 > 1.005 * area_m2.sum()
