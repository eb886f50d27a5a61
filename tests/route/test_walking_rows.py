"""Walking distances a row at a time, against those of all places at once; and a plan of least time over them."""

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.model import PlanSettings, Visibility
from planner_core.positions.free_space import free_space
from planner_core.positions.reach import Reach, reachability
from planner_core.positions.walking import Walking
from planner_core.route.least_time import LeastTimeSettings, WalkingDistances, least_time
from planner_core.scanner.load_scanner import load_scanner
from planner_core.select.problem import Constraint, cover_problem
from scenes_synthetic import build


def reach_in(name: str) -> Reach:
    survey = make_survey(build(name).scene, PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0))
    return reachability(survey, free_space(survey))


@pytest.mark.parametrize("name", ["corridor-comb", "stairwell", "closed-rooms"])
def test_rows_are_the_walking_distances_of_single_places(name: str) -> None:
    """Places that see each other may shorten ways of all at once round a corner: by the 2.8 % that graphs are long."""
    reach = reach_in(name)
    rng = np.random.default_rng(5)
    node = rng.choice(np.flatnonzero(reach.reached_node), 12, replace=False)
    places = np.concatenate([reach.space.position_m(node), [[500.0, 0.0, 0.0]]])
    walking = Walking(reach)
    whole, rows = walking.distances_m(places), walking.from_each(places)
    found = np.array([rows.row(k) for k in range(13)])
    assert np.array_equal(np.isfinite(found[:12]), np.isfinite(whole[:12]))
    assert np.isinf(found[12]).all(), "no ground there"
    both = np.isfinite(whole[:12])
    assert (found[:12][both] >= whole[:12][both] - 1e-9).all()
    assert (found[:12][both] <= 1.028 * whole[:12][both] + 1e-9).all()


@pytest.mark.slow
def test_least_time_walks_round_walls_and_not_through_them() -> None:
    """A room of the comb must be seen, and something that three spots see: one beyond the wall, one in the corridor.

    The spot beyond the wall is nearest in a straight line; the way there leads out of the room and into the next.
    """
    reach = reach_in("corridor-comb")
    places = np.array([[2.6, 4.0, 0.0], [3.6, 4.0, 0.0], [2.0, 0.8, 0.0], [11.0, 0.8, 0.0]])
    assert np.linalg.norm(places[1] - places[0]) < np.linalg.norm(places[2] - places[0])
    starts, patch = np.array([0, 1, 2, 3, 4]), np.array([0, 1, 1, 1], dtype=np.int32)
    problem = cover_problem(Visibility(starts, patch, 2), np.ones(2), (Constraint(np.ones(2, dtype=bool), 1.0),))
    walks = WalkingDistances(Walking(reach).from_each(places), np.zeros(4, dtype=np.int32))
    found = least_time(problem, [0, 3], walks, LeastTimeSettings(180.0, n_kicks=4), fewest=2)
    assert set(found.chosen) == {0, 2}
    assert found.walk_m == pytest.approx(Walking(reach).distances_m(places)[0, 2], rel=0.028)
