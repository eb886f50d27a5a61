"""Sheets, edges and ways on hand-made ground: heights in cells, and steps counted here and not by the library."""

from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner_core.export.chosen import RouteLeg
from planner_core.export.occupancy import FREE, OCCUPIED, UNKNOWN, map_sheets, occupancy_maps
from planner_core.export.robot_ways import MappedGround, WayPiece, robot_ways
from planner_core.model import Floor, Survey
from planner_core.positions.free_space import FreeSpace
from planner_core.positions.local_site import Carrier
from planner_core.positions.reach import Reach, Region
from planner_core.positions.solids import Grid
from planner_core.positions.walking import Walking

CELL, STEP, HEAD = 0.05, 0.25, 1.7
AROUND = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
Heights = dict[tuple[int, int], list[tuple[float, int, bool]]]
"""Of a cell (x, y): height, floor, whether it is the floor's own ground."""


@dataclass(frozen=True)
class Site:
    """Hand-made ground. node : (x, y, height) of each."""

    ground: MappedGround
    node: list[tuple[int, int, float]]
    steps: set[tuple[int, int]]

    def cells(self, name: str) -> NDArray[np.uint8]:
        return {each.name: each.cells for each in self.ground.maps}[name]


def site_of(heights: Heights, size: tuple[int, int], elevations: tuple[float, ...], *, radius_m: float = 0.0) -> Site:
    nx, ny = size
    rows = [
        (y * nx + x, z, floor, own) for (x, y), found in sorted(heights.items(), key=lambda item: item[0][::-1])
        for z, floor, own in sorted(found)
    ]  # fmt: skip
    at: dict[int, list[int]] = {}
    for number, row in enumerate(rows):
        at.setdefault(row[0], []).append(number)
    links = np.full((len(rows), 8), -1, dtype=np.int32)
    steps = set()
    for number, (column, z, _, _) in enumerate(rows):
        x, y = column % nx, column // nx
        for direction, (dx, dy) in enumerate(AROUND):
            if not (0 <= x + dx < nx and 0 <= y + dy < ny):
                continue
            for other in at.get((y + dy) * nx + x + dx, []):
                if abs(rows[other][1] - z) <= STEP + 1e-9:
                    links[number, direction] = other
                    steps.add((number, other))
    column, z, floor, own = (np.array(values) for values in zip(*rows, strict=True))
    n = len(rows)
    space = FreeSpace(
        carrier=Carrier(radius_m=radius_m, step_m=STEP, height_m=HEAD), grid=Grid(np.zeros(2), CELL, nx, ny),
        n_floors=len(elevations), column=column, ground_m=z, headroom_m=np.full(n, np.inf),
        clearance_m=np.ones(n), clearance_cap_m=1.0, floor=floor.astype(np.int32), on_ground=own, links=links,
        can_stand=np.ones(n, dtype=bool),
    )  # fmt: skip
    everywhere = np.zeros(n, dtype=np.int32)
    region = Region(0, 1.0, (1.0,), np.zeros(3), reached=True, in_solid=False)
    reach = Reach(space, (region,), everywhere, everywhere)
    floors = tuple(
        Floor(f"F{k}", "", z, 1.0, np.zeros(0, np.int32), np.array([[0.0, 0.0], [1.0, 1.0]]), "storeys")
        for k, z in enumerate(elevations)
    )
    bare = SimpleNamespace(vertices_m=np.zeros((0, 3)), triangles=np.zeros((0, 3), int), elements=(),
                           element_of_triangle=np.zeros(0, int))  # fmt: skip
    sheets = map_sheets(space, floors, np.ones(n, dtype=bool))
    survey = cast(Survey, SimpleNamespace(scene=bare, floors=floors))
    ground = MappedGround(reach, sheets, occupancy_maps(survey, space, sheets))
    return Site(ground, [(c % nx, c // nx, h) for c, h, _, _ in rows], steps)


def level(x: range, y: range, z: float = 0.0, floor: int = 0, *, own: bool = True) -> Heights:
    return {(i, j): [(z, floor, own)] for i in x for j in y}


def joined(*parts: Heights) -> Heights:
    out: Heights = {}
    for part in parts:
        for cell, found in part.items():
            out.setdefault(cell, []).extend(found)
    return out


def flight(x: range, y: range, *, tread: int, first_m: float = 0.2, floor: int = 0) -> Heights:
    """Treads of so many cells each along x, 0.2 m up from each to the next."""
    return {
        (i, j): [(first_m + 0.2 * (k // tread), floor, False)] for k, i in enumerate(x) for j in y
    }  # fmt: skip


def way_on(site: Site, start: int, end: int) -> RouteLeg:
    path = Walking(site.ground.reach).path(*(site.ground.space.position_m()[[start, end]]))
    return RouteLeg("A", "B", path.points_m, path.length_m, ("F0",))


def pixels_along(site: Site, piece: WayPiece) -> set[int]:
    """Pixels of a piece's own map each millimetre of it, but for its very ends, which lie on borders of cells."""
    cells, out = site.ground.maps[piece.sheet].cells, set()
    for k, (a, b) in enumerate(pairwise(piece.points_m)):
        n = max(2, int(np.linalg.norm(b - a) / 1e-3))
        for step in range(n + 1):
            x, y = ((a + (b - a) * step / n) / CELL)[:2]
            ends = (k == 0 and step == 0) or (k == len(piece.points_m) - 2 and step == n)
            border = min(abs(x - round(x)), abs(y - round(y))) < 1e-6
            if not ends and not border:
                out.add(int(cells[int(y), int(x)]))
    return out


# ------------------------------------------------------------------------------------------------- edges
def test_the_floor_beside_a_flight_is_occupied_from_where_no_step_leads_up() -> None:
    beside = {cell: [found[0]] for cell, found in level(range(30), range(12)).items() if cell[1] >= 4 or cell[0] < 5}
    site = site_of({**beside, **flight(range(5, 30), range(4), tread=5)}, (30, 12), (0.0,))
    cells = site.cells("F0")
    assert (cells[4, :9] == FREE).all()  # beside the first tread, which is a step high
    assert (cells[4, 9:] == OCCUPIED).all()
    assert (cells[:4] == FREE).all(), "the flight keeps its width"
    assert (cells[5:] == FREE).all()


def test_of_split_levels_the_lower_ends_at_the_drop() -> None:
    site = site_of(joined(level(range(10), range(8)), level(range(10, 20), range(8), 0.6)), (20, 8), (0.0,))
    cells = site.cells("F0")
    assert (cells[:, 9] == OCCUPIED).all()
    assert (cells[:, :9] == FREE).all()
    assert (cells[:, 10:] == FREE).all()


def test_a_step_of_the_mover_is_no_edge() -> None:
    site = site_of(joined(level(range(10), range(8)), level(range(10, 20), range(8), STEP)), (20, 8), (0.0,))
    assert (site.cells("F0") == FREE).all()


def test_a_balcony_ends_at_its_drop() -> None:
    upper = {cell: [(3.0, 1, True)] for cell in level(range(8), range(8))}
    site = site_of(joined(level(range(20), range(8)), upper), (20, 8), (0.0, 3.0))
    cells = site.cells("F1")
    assert (cells[:, :8] == FREE).all()
    assert (cells[:, 8] == OCCUPIED).all()
    assert (cells[:, 9:] == UNKNOWN).all()
    assert (site.cells("F0") == FREE).all()


# ------------------------------------------------------------------------------------------------- sheets
def open_flight(elevations: tuple[float, ...], *, wall: range = range(0)) -> Site:
    """A flight that one can walk below from 1.8 m on, and, where there are two floors, the upper one at its head.

    wall : rows y below the flight where there is no ground.
    """
    steps = flight(range(5, 55), range(4), tread=4)  # up to 2.6 m
    ground = {cell: found for cell, found in level(range(60), range(12)).items()
              if cell not in steps or (steps[cell][0][0] >= 1.8 and cell[1] not in wall)}  # fmt: skip
    top = level(range(55, 60), range(12), 2.8, 1) if len(elevations) > 1 else {}
    return site_of(joined(ground, steps, top), (60, 12), elevations)


def test_a_flight_over_its_floor_goes_on_in_the_well_of_the_next() -> None:
    site = open_flight((0.0, 2.8))
    lower, upper = site.cells("F0"), site.cells("F1")
    cut = 5 + 4 * 8  # the tread at 1.8 m
    assert (lower[:4, :cut] == FREE).all()
    assert (lower[:4, cut] == OCCUPIED).all(), "before the underside of the stairs"
    assert (lower[:4, cut + 1 :] == FREE).all(), "one walks below"
    assert (upper[:4, cut:] == FREE).all()
    assert (upper[:4, cut - 1] == UNKNOWN).all(), "the way down"
    assert (upper[4, cut:54] == OCCUPIED).all(), "the side of the flight"
    assert {each.name for each in site.ground.maps} == {"F0", "F1"}


def test_a_flight_is_cut_along_a_whole_tread() -> None:
    site = open_flight((0.0, 2.8), wall=range(2))
    lower, upper = site.cells("F0"), site.cells("F1")
    assert (lower[:4, :37] == FREE).all()
    assert lower[0, 37] == UNKNOWN, "the way up"
    assert (lower[1:4, 37] == OCCUPIED).all(), "the underside of the stairs, and the wall beside it"
    assert (upper[:4, 37:] == FREE).all()


def test_a_flight_over_the_only_floor_has_a_sheet_of_its_own() -> None:
    site = open_flight((0.0,))
    assert [(each.name, each.over) for each in site.ground.maps] == [("F0", False), ("F0-over", True)]
    over = site.cells("F0-over")
    assert (over[:4, 37:55] == FREE).all()
    assert (over[4, 37:55] == OCCUPIED).all()
    assert (over[:4, 55] == OCCUPIED).all(), "the flight ends in the air"
    assert (site.cells("F0")[:4, 38:] == FREE).all()


def test_a_way_up_is_cut_where_its_map_changes() -> None:
    site = open_flight((0.0, 2.8))
    start = site.node.index((1, 2, 0.0))
    end = next(k for k, (x, y, z) in enumerate(site.node) if (x, y) == (58, 2) and z > 2)
    (way,), remarks = robot_ways(site.ground, (way_on(site, start, end),), np.zeros(3))
    assert remarks == ()
    assert way.as_planned
    assert [(piece.sheet, piece.floor) for piece in way.pieces] == [(0, 0), (1, 0), (1, 1)]
    border = way.pieces[0].points_m[-1]
    assert border[0] == pytest.approx(37 * CELL)
    np.testing.assert_array_equal(border, way.pieces[1].points_m[0])
    assert [pixels_along(site, piece) for piece in way.pieces] == [{FREE}] * 3


def test_a_way_below_the_stairs_is_on_the_lower_map() -> None:
    site = open_flight((0.0, 2.8))
    start, end = site.node.index((45, 10, 0.0)), site.node.index((45, 1, 0.0))
    (way,), _ = robot_ways(site.ground, (way_on(site, start, end),), np.zeros(3))
    assert [piece.sheet for piece in way.pieces] == [0]
    assert pixels_along(site, way.pieces[0]) == {FREE}


# ------------------------------------------------------------------------------------------------- ways
def test_a_way_round_an_open_corner_keeps_off_the_drop() -> None:
    well = {cell: found for cell, found in level(range(40), range(40)).items() if cell[0] < 20 or cell[1] < 20}
    site = site_of(well, (40, 40), (0.0,), radius_m=0.25)
    leg = way_on(site, site.node.index((2, 38, 0.0)), site.node.index((38, 2, 0.0)))
    past = RouteLeg("A", "B", np.array([leg.points_m[0], [1.01, 1.01, 0.0], leg.points_m[-1]]), 3.0, ("F0",))
    (way,), remarks = robot_ways(site.ground, (past,), np.zeros(3))
    assert remarks == ("the path from A to B crosses occupied cells or a drop: rerouted around them",)
    assert not way.as_planned
    np.testing.assert_array_equal(way.points_m[[0, -1]], past.points_m[[0, -1]])
    length_m = np.linalg.norm(np.diff(way.points_m, axis=0), axis=1).sum()
    assert way.length_m == pytest.approx(length_m)
    (piece,) = way.pieces
    assert pixels_along(site, piece) == {FREE}
    # The corner of the drop is at (1.0, 1.0): the carrier's body keeps off it.
    segments = [a + (b - a) * t for a, b in pairwise(way.points_m[:, :2]) for t in np.linspace(0, 1, 200)]
    assert min(np.hypot(*(point - 1.0)) for point in segments) > 0.25 - CELL


def test_a_way_along_a_drop_keeps_off_it_where_there_is_room() -> None:
    # A strip with nothing on either side; where it is narrow the plan's way is as good as any.
    for n_rows, as_planned in ((30, False), (8, True)):
        site = site_of(level(range(60), range(5, 5 + n_rows)), (60, 40), (0.0,), radius_m=0.25)
        ends = [0.1, 5.9 * CELL, 0.0], [2.9, 5.9 * CELL, 0.0]
        along_edge = [[0.1, 0.6, 0.0], ends[0], ends[1], [2.9, 0.6, 0.0]]
        leg = RouteLeg("A", "B", np.array(along_edge), 3.4, ("F0",))
        (way,), remarks = robot_ways(site.ground, (leg,), np.zeros(3))
        assert way.as_planned == as_planned
        assert bool(remarks) == (not as_planned)
        nearest_m = way.points_m[:, 1].min() - 5 * CELL
        assert nearest_m == pytest.approx(0.9 * CELL) if as_planned else nearest_m > 0.25 - CELL


def test_no_great_detour_is_made_to_keep_off_a_drop() -> None:
    # A ridge of 0.2 m leads straight over a pit; round the pit there is room.
    edge = set(range(15)) | set(range(65, 80))
    frame = {(x, y): found for (x, y), found in level(range(80), range(80)).items() if x in edge or y in edge}
    site = site_of({**frame, **level(range(15, 65), range(38, 42))}, (80, 80), (0.0,), radius_m=0.25)
    across = RouteLeg("A", "B", np.array([[0.375, 2.0, 0.0], [3.625, 2.0, 0.0]]), 3.25, ("F0",))
    (way,), remarks = robot_ways(site.ground, (across,), np.zeros(3))
    assert way.as_planned
    assert remarks == ()


def test_a_leg_without_free_ground_is_left_out_and_told() -> None:
    site = site_of(joined(level(range(10), range(8)), level(range(12, 20), range(8))), (20, 8), (0.0,))
    a, b = site.ground.space.position_m()[[site.node.index((2, 4, 0.0)), site.node.index((17, 4, 0.0))]]
    ways, remarks = robot_ways(site.ground, (RouteLeg("A", "B", np.array([a, b]), 0.75, ("F0",)),), np.zeros(3))
    assert ways == ()
    assert remarks == ("no path on free cells of the maps leads from A to B: left out of the paths",)


terrain = st.lists(st.sampled_from([(), (0.0,), (0.0,), (0.2,), (0.4,), (0.6,), (0.0, 2.0), (2.0,), (2.2,), (0.2, 2.2),
                                    (4.1, 0.0, 2.0)]), min_size=48, max_size=48)  # fmt: skip


def random_site(found: list[tuple[float, ...]], elevations: tuple[float, ...]) -> Site:
    heights: Heights = {}
    for k, tops in enumerate(found):
        # As the library has it: the ground of a floor, or a flight, which is of the floor below.
        heights[k % 8, k // 8] = [(z, int(np.searchsorted(elevations, z, "right")) - 1, z in elevations) for z in tops]
    return site_of({cell: rows for cell, rows in heights.items() if rows}, (8, 6), elevations)


@pytest.mark.slow
@given(terrain, st.sampled_from([(0.0,), (0.0, 2.2), (0.0, 4.1)]))
@settings(max_examples=40, deadline=None)
def test_a_step_leads_between_any_two_free_neighbours_of_a_map(
    found: list[tuple[float, ...]], elevations: tuple[float, ...]
) -> None:
    if not any(found):
        return
    site = random_site(found, elevations)
    of_node = site.ground.sheets.of_node
    assert (of_node >= 0).all()
    for sheet, each in enumerate(site.ground.maps):
        shown = {site.node[k][:2]: k for k in np.flatnonzero(of_node == sheet).tolist()}
        assert len(shown) == np.count_nonzero(of_node == sheet), "a cell stands for one height"
        free = {(x, y) for y, x in np.argwhere(each.cells == FREE).tolist()}
        assert free <= set(shown)
        for x, y in free:
            for dx, dy in AROUND:
                if (x + dx, y + dy) in free:
                    assert (shown[x, y], shown[x + dx, y + dy]) in site.steps
        # What is not free is the lower side of such an edge, and nothing else.
        for x, y in set(shown) - free:
            own = shown[x, y]
            around = [shown[c] for dx, dy in AROUND if (c := (x + dx, y + dy)) in shown]
            assert any((own, k) not in site.steps and site.node[k][2] > site.node[own][2] for k in around)


@pytest.mark.slow
@given(terrain, st.sampled_from([(0.0,), (0.0, 2.2)]), st.data())
@settings(max_examples=40, deadline=None)
def test_ways_never_leave_free_cells(
    found: list[tuple[float, ...]], elevations: tuple[float, ...], data: st.DataObject
) -> None:
    if sum(map(bool, found)) < 2:
        return
    site = random_site(found, elevations)
    ends = [data.draw(st.integers(0, len(site.node) - 1)) for _ in range(2)]
    leg = way_on(site, *ends)
    if not leg.walkable:
        return
    ways, remarks = robot_ways(site.ground, (leg,), np.zeros(3))
    assert bool(remarks) == (not ways or not ways[0].as_planned)
    for way in ways:
        for piece in way.pieces:
            assert pixels_along(site, piece) <= {FREE}
        if way.as_planned:
            np.testing.assert_array_equal(way.points_m, leg.points_m)


def test_a_leg_over_no_ground_at_all_is_left_out_and_told() -> None:
    site = site_of(level(range(10), range(8)), (10, 8), (0.0,))
    high = RouteLeg("", "B", np.array([[0.1, 0.1, 9.0], [0.3, 0.3, 9.0]]), 0.3, ("F0",))
    assert robot_ways(site.ground, (high,), np.zeros(3)) == (
        (),
        ("no path on free cells of the maps leads from start to B: left out of the paths",),
    )
