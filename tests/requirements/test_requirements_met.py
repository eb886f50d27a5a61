"""From words to stations: selection on a demand meets what was asked, with as few stations as any subset can."""

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from stages import demand_of

from planner_core.model import Proven
from planner_core.requirements.compliance import part_results
from planner_core.requirements.read import requirements_from
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import cover_problem
from planner_core.select.proven import select

ASKED = {
    "fine walls": {"range": "5 m", "classes": {"IfcWall*": {"coverage": "97 %", "incidence": "60 deg"}}},
    "two looks": {"coverage": "90 %", "spacing": "60 mm", "range": "4.5 m", "seen_from": 2},
    "two zones": {
        "coverage": "70 %",
        "floors": {"West": "85 %"},
        "zones": [
            {"outline": [[1005, 2000], [1008, 2000], [1008, 2004], [1005, 2004]], "range": "2.5 m"},
            {"outline": [[1000, 2000], [1003, 2000], [1003, 2004], [1000, 2004]], "range": "3 m", "seen_from": 2},
        ],
    },
}


@pytest.mark.parametrize("name", ASKED)
def test_selection_takes_as_few_stations_as_any_subset_that_meets_all(
    box: SimpleNamespace, settings_of, name: str
) -> None:
    requirements, _ = requirements_from(ASKED[name])
    wanted = settings_of(**vars(requirements))
    demand = demand_of(box.survey, wanted, box.engine, box.positions_m)
    problem = cover_problem(demand.rows.met, demand.area_m2, demand.constraints)

    def meets_all(chosen: tuple[int, ...]) -> bool:
        return all(result.met for result in part_results(demand, demand.rows.take(np.array(chosen, dtype=np.int64))))

    n = len(box.positions_m)
    fewest = next(k for k in range(n + 1) if any(meets_all(some) for some in combinations(range(n), k)))
    found = select(problem, Proven())
    assert 2 <= fewest == len(found.chosen) == found.lower_bound
    assert meets_all(tuple(found.chosen))
    assert meets_all(tuple(select_greedy(problem).chosen))
