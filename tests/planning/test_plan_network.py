"""Networks of whole plans, recomputed with networkx from the plan's own links."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import networkx as nx
import numpy as np
import open3d as o3d
import pytest
from stages import find_positions, make_pool

from planner_core.engine.open_engine import open_engine
from planner_core.model import Plan, PlanSettings, Requirements
from planner_core.planning.pool import Pool
from planner_core.select.greedy import select_greedy

Planned = Callable[[str, PlanSettings], Plan]


def graph_of(plan: Plan) -> "nx.Graph[str]":
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(station.id for station in plan.stations)
    asked = plan.settings.requirements
    graph.add_edges_from(
        (link.a, link.b)
        for link in plan.links
        if link.overlap >= asked.overlap and not link.strength < asked.min_strength
    )
    return graph


def overlap_of(one: np.ndarray, other: np.ndarray, area_m2: np.ndarray) -> float:
    shared = area_m2[one & other].sum()
    return float(min(shared / area_m2[one].sum(), shared / area_m2[other].sum()))


def candidate_graph(plan: Plan) -> tuple["nx.Graph[int]", Pool]:
    """Links between all candidates, and the candidates, as found anew."""
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    at = find_positions(survey, plan.settings, engine, floors=(0,)).candidates
    none = np.zeros(0, dtype=np.int64)
    pool = make_pool(survey, plan.settings, engine, at, given=none, kept=none)
    assert pool.links is not None
    whole: nx.Graph[int] = nx.Graph()
    whole.add_nodes_from(range(at.floor.size))
    for one in range(at.floor.size):
        whole.add_edges_from((one, int(k)) for k in pool.links.neighbour[pool.links.row(one)])
    return whole, pool


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene", ["corridor-comb", *(pytest.param(name, marks=pytest.mark.slow) for name in ("l-room", "two-rooms"))]
)
def test_stations_are_one_network_and_the_links_are_what_scans_have_in_common(
    scene: str, small: PlanSettings, planned: Planned, looks: Callable[..., object]
) -> None:
    plan = planned(scene, small)
    assert nx.is_connected(graph_of(plan))
    assert plan.connected
    assert plan.registration is not None
    assert {frozenset(network.stations) for network in plan.registration.networks} == {
        frozenset(part) for part in nx.connected_components(graph_of(plan))
    }
    seen = looks(plan, np.stack([s.position_m for s in plan.stations])).seen  # type: ignore[attr-defined]
    area_m2 = plan.survey.patches.area_m2
    told = {frozenset((link.a, link.b)): link.overlap for link in plan.links}
    for i, k in combinations(range(len(plan.stations)), 2):
        found = overlap_of(seen[i], seen[k], area_m2)
        pair = frozenset((plan.stations[i].id, plan.stations[k].id))
        assert told.get(pair, 0.0) == pytest.approx(found, abs=0.01) if found > 0.06 else pair is not None


@pytest.mark.slow
def test_loops_leave_no_link_that_all_hangs_on(small: PlanSettings, planned: Planned) -> None:
    def asking(network: str) -> PlanSettings:
        return replace(small, requirements=Requirements(coverage=0.9, network=network))

    joined, loops = (planned("corridor-comb", asking(network)) for network in ("connected", "redundant"))
    assert nx.is_connected(graph_of(loops))
    whole, pool = candidate_graph(loops)
    at_m = pool.candidates.position_m
    station = {s.id: int(np.linalg.norm(at_m - s.position_m, axis=1).argmin()) for s in loops.stations}
    unavoidable = {frozenset(pair) for pair in nx.bridges(whole)}
    left = [(a, b) for a, b in nx.bridges(graph_of(loops)) if frozenset((station[a], station[b])) not in unavoidable]
    assert left == []
    # The case is one where it matters.
    assert len(list(nx.bridges(graph_of(joined)))) > len(list(nx.bridges(graph_of(loops))))
    assert len(loops.stations) >= len(joined.stations)


@pytest.mark.slow
def test_no_network_asked_for_takes_no_more_stations_and_tells_no_gaps(small: PlanSettings, planned: Planned) -> None:
    free = planned("corridor-comb", replace(small, requirements=Requirements(coverage=0.9, network="none")))
    joined = planned("corridor-comb", small)
    assert len(free.stations) < len(joined.stations)
    assert not nx.is_connected(graph_of(free))
    assert not any("register" in line for line in free.warnings)
    _check_targets(free)


def _check_targets(plan: Plan) -> None:
    """Targets of gaps lie on surface that both stations see, by Open3D."""
    assert plan.registration is not None
    scene, at_m = plan.survey.scene, {station.id: station.position_m for station in plan.stations}
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(scene.vertices_m.astype(np.float32), scene.triangles.astype(np.uint32))
    found = [gap for gap in plan.registration.gaps if gap.targets_m]
    assert found
    for gap in found:
        for end in (gap.best.a, gap.best.b):
            away_m = np.array(gap.targets_m) - at_m[end]
            range_m = np.linalg.norm(away_m, axis=1)
            rays = np.column_stack([np.tile(at_m[end], (3, 1)), away_m / range_m[:, None]]).astype(np.float32)
            hit_m = caster.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
            assert hit_m == pytest.approx(range_m, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["two-rooms", "corridor-comb", pytest.param("doors-open", marks=pytest.mark.slow)])
def test_joining_inside_the_choice_takes_no_more_stations_than_joining_afterwards(
    scene: str, small: PlanSettings, planned: Planned
) -> None:
    plan = planned(scene, small)
    whole, pool = candidate_graph(plan)
    assert pool.links is not None
    chosen = set(select_greedy(pool.problem).chosen)
    # Afterwards: the two nearest pieces of each part are joined by the shortest way, until there is one piece.
    for part in nx.connected_components(whole):
        pieces = [set(p) for p in nx.connected_components(whole.subgraph(chosen & part))]
        while len(pieces) > 1:
            way = min(
                (nx.shortest_path(whole, a, b) for p, q in combinations(pieces, 2) for a in p for b in q), key=len
            )
            chosen |= set(way)
            pieces = [set(p) for p in nx.connected_components(whole.subgraph(chosen & part))]
    assert len(plan.stations) <= len(chosen)
    parts = {int(pool.links.part[c]) for c in chosen}
    # Nor does it leave more networks.
    assert nx.number_connected_components(graph_of(plan)) <= len(parts)


@pytest.mark.slow
def test_spots_that_nobody_can_be_registered_with_are_no_way_round_the_network(
    small: PlanSettings, planned: Planned
) -> None:
    # At 1.7 m this scanner sees neither floor nor ceiling from the middle of a room: nothing tells the height.
    plan = planned("two-rooms", replace(small, instrument_heights_m=(1.3, 1.7)))
    assert nx.is_connected(graph_of(plan))
    assert all(result.met for result in plan.requirements)
