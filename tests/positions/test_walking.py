"""Walking distances: against rooms where they are known, and networkx on the same cells."""

from functools import cache
from itertools import combinations, pairwise

import networkx as nx
import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.model import PlanSettings, Survey
from planner_core.positions.free_space import LARGEST_CELL_M, free_space
from planner_core.positions.local_site import Carrier, WalkingZone
from planner_core.positions.reach import Footing, Reach, reachability
from planner_core.positions.walking import Walking, walks_straight
from planner_core.scanner.load_scanner import load_scanner
from scenes_synthetic import build

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0)
PERSON = Carrier()


@cache
def survey_of(name: str) -> Survey:
    return make_survey(build(name).scene, SETTINGS)


@cache
def reach_in(name: str, carrier: Carrier = PERSON, *, cell_m: float = 0.05) -> Reach:
    """What is reached in a synthetic building; nobody changes it."""
    survey = survey_of(name)
    return reachability(survey, free_space(survey, carrier, cell_m=cell_m))


def some_places(reach: Reach, number: int) -> np.ndarray:
    node = np.flatnonzero(reach.reached_node & reach.space.on_ground)
    return reach.space.position_m(np.random.default_rng(5).choice(node, number, replace=False))


def grid_distances(reach: Reach, places: np.ndarray) -> np.ndarray:
    """Shortest ways from cell to neighbouring cell, by networkx."""
    space = reach.space
    position, stands = space.position_m(), reach.reached_node
    node, direction = np.nonzero((space.links >= 0) & stands[:, None])
    to = space.links[node, direction]
    both = stands[to]
    node, to = node[both], to[both]
    graph = nx.Graph()
    graph.add_weighted_edges_from(
        zip(node.tolist(), to.tolist(), np.linalg.norm(position[node] - position[to], axis=1).tolist(), strict=True)
    )
    at = [int(np.argmin(((position - place) ** 2).sum(axis=1))) for place in places]
    found = [nx.single_source_dijkstra_path_length(graph, source) for source in at]
    return np.array([[lengths.get(target, np.inf) for target in at] for lengths in found])


def round_a_corner_m(a: np.ndarray, b: np.ndarray, corner: np.ndarray, radius: float) -> float:
    """Length of the taut string from a to b round a disc, which it passes on the far side: two tangents and an arc."""
    da, db = np.linalg.norm(a - corner), np.linalg.norm(b - corner)
    between = 2 * np.pi - np.arccos(np.dot(a - corner, b - corner) / (da * db))
    arc = between - np.arccos(radius / da) - np.arccos(radius / db)
    return float(np.sqrt(da**2 - radius**2) + np.sqrt(db**2 - radius**2) + radius * arc)


def test_in_an_empty_room_distances_are_straight_lines() -> None:
    reach = reach_in("convex-room")
    places = some_places(reach, 25)
    exact = np.linalg.norm(places[:, None] - places[None], axis=2)
    # Along the slanted walls the cells are jagged: some lines are bent by millimetres.
    assert np.abs(Walking(reach).distances_m(places) - exact).max() < 0.01
    assert (Walking(reach).distances_m(places) >= exact - 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize(("a", "b"), [((1.0, 8.0), (8.0, 1.0)), ((0.5, 9.0), (6.0, 0.5)), ((2.5, 9.5), (9.5, 2.5))])
def test_round_the_corner_of_an_l_the_walk_is_that_of_a_taut_string(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    reach = reach_in("l-by-range")
    ends = np.array([[*a, 0.0], [*b, 0.0]])
    exact = round_a_corner_m(np.array(a), np.array(b), np.array([3.0, 3.0]), PERSON.radius_m)
    found = Walking(reach).distances_m(ends)[0, 1]
    pulled = Walking(reach).path(*ends).length_m
    cell = reach.space.grid.cell_m
    assert exact - 2 * cell <= pulled <= found + 1e-6
    assert found <= 1.028 * exact + 2 * cell
    assert pulled <= 1.01 * exact + 2 * cell


@pytest.mark.slow
@pytest.mark.parametrize("name", ["corridor-comb", "doors-open", "stairwell"])
def test_distances_lie_between_those_of_networkx_on_the_cells_and_their_least_possible(name: str) -> None:
    """Ways from cell to cell are up to 8.24 % longer than straight ones, ours at most 2.8 %, on the same cells."""
    reach = reach_in(name, cell_m=0.1)
    places = some_places(reach, 8)
    oracle = grid_distances(reach, places)
    found = Walking(reach).distances_m(places)
    cell = reach.space.grid.cell_m
    assert np.isfinite(oracle).all()
    assert (found >= oracle / 1.0824 - 2 * cell).all()
    assert (found <= oracle * 1.028 + 2 * cell).all()
    assert found.sum() < oracle.sum()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["corridor-comb", pytest.param("doors-open", marks=pytest.mark.slow), "stairwell"])
def test_distances_on_the_largest_cells_are_those_on_small_ones(name: str) -> None:
    """Half a metre is two cells, of which either end may be half a cell off; stairs are where most is lost."""
    fine, coarse = reach_in(name), reach_in(name, cell_m=LARGEST_CELL_M)
    roomy = np.flatnonzero(fine.reached_node & fine.space.on_ground & (fine.space.clearance_m > 0.5))
    places = fine.space.position_m(np.random.default_rng(5).choice(roomy, 12, replace=False))
    exact, found = Walking(fine).distances_m(places), Walking(coarse).distances_m(places)
    assert (found <= 1.05 * exact + 0.5).all()
    assert (found >= 0.95 * exact - 0.5).all()


@pytest.mark.slow
def test_distances_are_a_metric() -> None:
    reach = reach_in("spiral")
    places = some_places(reach, 30)
    found = Walking(reach).distances_m(places)
    assert np.array_equal(found, found.T)
    assert np.array_equal(found, Walking(reach).distances_m(places)), "the same twice"
    assert (np.diag(found) == 0).all()
    assert (found[:, None] <= found[:, :, None] + found[None] + 1e-9).all()


@pytest.mark.slow
def test_stairs_count_with_their_slope() -> None:
    """The flight has 14 treads of 0.26 m and 15 risers over 2.8 m; one walks from before it to behind it, above."""
    reach = reach_in("stairwell")
    foot, head = np.array([1.8, 0.3, 0.0]), np.array([1.8, 5.7, 2.8])
    along = np.hypot(14 * 0.26, 2.8) + (5.4 - 14 * 0.26)
    found = Walking(reach).distances_m(np.stack([foot, head]))[0, 1]
    path = Walking(reach).path(foot, head)
    assert abs(found - along) < 0.028 * along
    assert abs(path.length_m - along) < 0.02 * along
    ground = reach.space.position_m()
    for a, b in pairwise(path.points_m):
        for share in np.linspace(0.0, 1.0, 20):
            at = a + share * (b - a)
            below = ground[np.abs(ground[:, :2] - at[:2]).max(axis=1) <= 0.051]
            assert np.abs(below[:, 2] - at[2]).min() <= 0.35


def test_places_one_above_the_other_are_a_flight_of_stairs_apart() -> None:
    reach = reach_in("stairwell")
    found = Walking(reach).distances_m(np.array([[0.6, 1.0, 0.0], [0.6, 1.0, 2.8], [0.6, 1.0, 5.6]]))
    assert found[0, 1] > 2 * np.hypot(2.8, 1.0)
    assert found[0, 2] > found[0, 1] + 5.0


@pytest.mark.slow
def test_a_small_robot_turns_corners_along_walkable_cells_only() -> None:
    robot = Carrier(radius_m=0.08, step_m=0.03, height_m=0.4, stairs_height_m=0.4, opens_doors=False)
    reach = reach_in("doors-open", robot)
    walking = Walking(reach)
    places = some_places(reach, 8)
    cells, footing = reach.space.cells(), Footing(reach)
    node = footing.nodes(places)
    for a, b in combinations(range(8), 2):
        path = walking.path(places[a], places[b])
        at = np.concatenate([node[[a]], footing.nodes(path.points_m[1:-1]), node[[b]]])
        seen = walks_straight(reach.space, cells, reach.reached_node, at[:-1], at[1:])
        # What is not straight lies within a block, which is connected.
        assert (cells[at[:-1]][~seen] // 4 == cells[at[1:]][~seen] // 4).all()


@pytest.mark.slow
def test_a_path_stays_where_there_is_room_and_is_no_longer_than_the_distance() -> None:
    reach = reach_in("doors-open")
    places = some_places(reach, 8)
    walking = Walking(reach)
    found = walking.distances_m(places)
    ground = reach.space.position_m()[reach.reached_node][:, :2]
    for i in range(1, 8):
        path = walking.path(places[0], places[i])
        assert np.array_equal(path.points_m[[0, -1]], places[[0, i]])
        assert np.linalg.norm(places[0] - places[i]) - 1e-9 <= path.length_m <= found[0, i] + 1e-6
        for a, b in pairwise(path.points_m):
            for share in np.linspace(0.0, 1.0, 30):
                away = np.abs(ground - (a + share * (b - a))[:2]).max(axis=1).min()
                assert away <= 1.01 * reach.space.grid.cell_m


def test_sealed_rooms_are_infinitely_far_and_have_no_path() -> None:
    reach = reach_in("closed-rooms")
    places = np.array([[1.5, 2.0, 0.0], [1.5, 3.0, 0.0], [4.5, 2.0, 0.0], [4.5, 2.0, 9.0]])
    found = Walking(reach).distances_m(places)
    assert found[0, 1] == pytest.approx(1.0)
    assert np.isinf(found[0, 2:]).all()
    assert np.isinf(found[3]).all()
    path = Walking(reach).path(places[0], places[2])
    assert path.points_m.shape == (0, 3)
    assert np.isinf(path.length_m)


def test_a_zone_kept_out_of_is_walked_round() -> None:
    survey = survey_of("convex-room")
    square = WalkingZone(np.array([[3.0, 2.5], [4.5, 2.5], [4.5, 4.0], [3.0, 4.0]]), 0)
    ends = np.array([[2.0, 3.2, 0.0], [5.5, 3.2, 0.0]])
    corner = 2.5
    exact = 2 * np.hypot(1.0, 3.2 - corner) + 1.5
    assert Walking(reach_in("convex-room")).distances_m(ends)[0, 1] == pytest.approx(3.5, abs=1e-6)
    assert Walking(reachability(survey, free_space(survey, zones=(square,)))).path(*ends).length_m == pytest.approx(
        exact, abs=0.12
    )


def test_a_narrow_passage_joins_what_it_joins() -> None:
    """A body of 0.49 m radius in doorways of 1 m: the way is one cell wide."""
    reach = reach_in("thin-walls", Carrier(radius_m=0.47))
    found = Walking(reach).distances_m(np.array([[1.5, 2.0, 0.0], [4.5, 2.0, 0.0], [7.5, 2.0, 0.0]]))
    assert np.isfinite(found).all()
    assert found[0, 2] == pytest.approx(6.0, abs=0.15)


def test_walking_straight_agrees_with_every_cell_of_the_line() -> None:
    reach = reach_in("doors-open", cell_m=0.1)
    space = reach.space
    rng = np.random.default_rng(2)
    node = rng.choice(np.flatnonzero(reach.reached_node), (300, 2))
    sees = walks_straight(space, space.cells(), reach.reached_node, node[:, 0], node[:, 1])
    assert 20 < sees.sum() < 280
    free = set(map(tuple, space.cells()[reach.reached_node].tolist()))  # one storey: cells are nodes
    for (a, b), seen in zip(space.cells()[node].tolist(), sees.tolist(), strict=True):
        n = max(abs(b[0] - a[0]), abs(b[1] - a[1]), 1)
        shares = np.arange(n + 1)[:, None] / n
        line = np.floor(np.array(a) + shares * (np.array(b) - a) + 0.5).astype(int).tolist()
        assert seen == all(tuple(cell) in free for cell in line)


def test_the_graph_made_in_pieces_is_that_made_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    reach = reach_in("stairwell")
    whole = Walking(reach)._edges
    monkeypatch.setattr("planner_core.positions.walking._ROWS", 50)
    monkeypatch.setattr("planner_core.positions.walking._PAIRS", 300)
    monkeypatch.setattr("planner_core.positions.free_space._CHUNK", 700)
    pieces = Walking(reach)._edges
    assert whole.a.size > 3000
    for name in ("a", "b", "length_m", "bend"):
        assert getattr(pieces, name).tobytes() == getattr(whole, name).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["corridor-comb", "closed-rooms"])
def test_ways_among_few_blocks_are_those_of_the_whole_graph(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    reach = reach_in(name, cell_m=0.1)
    pairs = list(combinations(some_places(reach, 6), 2))
    walking, asked, within = Walking(reach), [], Walking._within
    monkeypatch.setattr(Walking, "_within", lambda self, *args: asked.append(within(self, *args)) or asked[-1])
    few = [walking.path(a, b) for a, b in pairs]
    assert min(blocks.size for blocks in asked) < 0.5 * walking._spot.size
    monkeypatch.setattr(Walking, "_within", lambda self, *_: np.arange(self._spot.size))
    for path, (a, b) in zip(few, pairs, strict=True):
        whole = walking.path(a, b)
        assert path.length_m == pytest.approx(whole.length_m, rel=1e-12), "inf where no way leads"
        np.testing.assert_allclose(path.points_m, whole.points_m, atol=1e-12)


def test_a_way_longer_than_blocks_were_chosen_for_is_looked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the blocks had held a detour of 100 m only."""
    reach = reach_in("corridor-comb", cell_m=0.1)
    walking, n_blocks, shortest = Walking(reach), [], Walking._shortest
    a, b = np.array([1.5, 4.0, 0.0]), np.array([7.8, 4.0, 0.0])
    expected = walking.path(a, b)

    def longer_first(self: Walking, node: np.ndarray, place: np.ndarray, blocks: np.ndarray) -> tuple:
        n_blocks.append(blocks.size)
        length, way = shortest(self, node, place, blocks)
        return (100.0 if len(n_blocks) == 1 else length), way

    monkeypatch.setattr(Walking, "_shortest", longer_first)
    assert walking.path(a, b).length_m == expected.length_m
    assert n_blocks[0] < n_blocks[1] == walking._spot.size


def test_a_way_round_a_long_wall_is_found_beyond_the_first_ellipse() -> None:
    reach = reach_in("corridor-comb", cell_m=0.1)
    # In neighbouring rooms, against the wall between them and far from their doorways.
    a, b = np.array([2.7, 5.3, 0.0]), np.array([3.45, 5.3, 0.0])
    walking = Walking(reach)
    path = walking.path(a, b)
    assert path.length_m > 5.0 * np.linalg.norm(b - a)
    assert path.length_m == pytest.approx(walking.distances_m(np.stack([a, b]))[0, 1], rel=0.03)


def test_distances_of_parts_are_those_of_one_search_over_everything() -> None:
    from scipy.sparse.csgraph import dijkstra

    reach = reach_in("closed-rooms")
    places = some_places(reach, 20)
    walking = Walking(reach)
    node, place = walking._stands(places)
    n_blocks = walking._spot.size
    whole = dijkstra(walking._graph(node, place), directed=False, indices=n_blocks + np.arange(20))[:, n_blocks:]
    whole = np.minimum(whole, whole.T)
    np.fill_diagonal(whole, 0.0)
    np.testing.assert_array_equal(walking.distances_m(places), whole)
    parts = walking.parts(places)
    assert sorted(np.concatenate(parts).tolist()) == list(range(20))
    assert [int(stops[0]) for stops in parts] == sorted(int(stops[0]) for stops in parts)
    for stops in parts:
        assert np.isfinite(whole[stops[0]]).nonzero()[0].tolist() == stops.tolist()
