"""Free space: against exact plans of rooms, SciPy's distance transform, and Open3D's distances."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from planner_core.coverage.survey import make_survey
from planner_core.errors import RequirementError
from planner_core.model import PlanSettings, Scene, Survey
from planner_core.positions.free_space import (
    CELL_M,
    LARGEST_CELL_M,
    NEIGHBOURS,
    FreeSpace,
    components,
    free_space,
    half_links,
    spread,
)
from planner_core.positions.local_site import Carrier, WalkingZone
from planner_core.positions.outlines import over_polygon
from planner_core.positions.solids import Grid, find_solids, footprints
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from scenes_synthetic import build

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def survey_of(scene: Scene) -> Survey:
    return make_survey(scene, PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0))


@cache
def survey_in(name: str) -> Survey:
    """Of a synthetic building; nobody changes it."""
    return survey_of(build(name).scene)


@cache
def stairwell() -> FreeSpace:
    """Of a person; nobody changes it."""
    return free_space(survey_in("stairwell"))


def boxes(*solids: Box) -> Scene:
    """A scene of closed boxes, given by their corners."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    points = [np.array(low) + corner * (np.array(high) - np.array(low)) for low, high in solids]
    all_points = np.concatenate([p[triangles].reshape(-1, 3) for p in points])
    return scene_from_arrays(all_points, np.arange(len(all_points)).reshape(-1, 3))


ROOM: tuple[Box, ...] = (
    ((-0.2, -0.2, -0.2), (6.2, 4.2, 0.0)),
    ((-0.2, -0.2, 2.6), (6.2, 4.2, 2.8)),
    ((-0.2, -0.2, 0.0), (6.2, 0.0, 2.6)),
    ((-0.2, 4.0, 0.0), (6.2, 4.2, 2.6)),
    ((-0.2, 0.0, 0.0), (0.0, 4.0, 2.6)),
    ((6.0, 0.0, 0.0), (6.2, 4.0, 2.6)),
)


@cache
def room_with(*solids: Box) -> Survey:
    """A room of 6 x 4 m, 2.6 m high, its floor at 0, with solids in it."""
    return survey_of(boxes(*ROOM, *solids))


def stands_at(space: FreeSpace, x: float, y: float, z: float = 0.0) -> bool:
    away = np.abs(space.position_m() - [x, y, z]).max(axis=1)
    node = int(np.argmin(away))
    return bool(away[node] <= space.grid.cell_m and space.can_stand[node])


def joined(space: FreeSpace, *places: tuple[float, float, float]) -> bool:
    label = components(space.links, space.can_stand)
    position = space.position_m()
    at = {int(label[np.argmin(((position - place) ** 2).sum(axis=1))]) for place in places}
    return len(at) == 1 and -1 not in at


# ------------------------------------------------------------------------------------------------ footprints
def clipped_heights(triangle: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[float, float] | None:
    """Least and greatest height of a triangle over a rectangle in plan, by clipping it plane by plane."""
    polygon = [np.array(p) for p in triangle]
    for axis in (0, 1):
        for sign, bound in ((1.0, low[axis]), (-1.0, -high[axis])):
            kept = []
            for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                da, db = sign * a[axis] - bound, sign * b[axis] - bound
                if da >= 0:
                    kept.append(a)
                if (da >= 0) != (db >= 0):
                    kept.append(a + (b - a) * (da / (da - db)))
            polygon = kept
            if not polygon:
                return None
    z = [p[2] for p in polygon]
    return min(z), max(z)


coordinate = st.floats(-0.5, 2.5, width=32)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(hnp.arrays(np.float64, (3, 3), elements=coordinate), st.booleans())
def test_footprints_equal_the_triangle_clipped_to_each_cell(triangle: np.ndarray, upright: bool) -> None:
    if upright:
        triangle = triangle.copy()
        triangle[2, :2] = 0.25 * triangle[0, :2] + 0.75 * triangle[1, :2]
    grid = Grid(low_m=np.array([0.013, -0.021]), cell_m=0.5, nx=4, ny=4)
    found = {
        int(c): (low, high)
        for part in footprints(triangle[None], grid)
        for c, low, high in zip(part.column, part.low_m, part.high_m, strict=True)
    }
    (ax, ay), (bx, by) = (triangle[1:] - triangle[0])[:, :2]
    plan_area = abs(ax * by - ay * bx)
    steep = np.ptp(triangle[:, 2]) * 1e-6 + 1e-6
    for column in range(16):
        low = grid.low_m + grid.cell_m * np.array([column % 4, column // 4])
        for shrink in (1e-6, -1e-6):  # a triangle that only grazes a cell may count or not
            wanted = clipped_heights(triangle, low + shrink, low + grid.cell_m - shrink)
            if shrink > 0 and wanted is not None:
                assert column in found
                if upright or plan_area > 1e-2:
                    assert found[column][0] <= wanted[0] + steep
                    assert found[column][1] >= wanted[1] - steep
            if shrink < 0 and wanted is None:
                assert column not in found
            if shrink < 0 and column in found:
                assert wanted is not None
                if upright or plan_area > 1e-2:
                    assert found[column][0] >= wanted[0] - 1e3 * steep
                    assert found[column][1] <= wanted[1] + 1e3 * steep


def test_solids_of_a_column_merge_over_gaps_of_a_step_and_keep_wider_ones_apart() -> None:
    def sheet(z: float) -> list[list[float]]:
        return [[-1.0, -1.0, z], [3.0, -1.0, z], [-1.0, 3.0, z]]

    corners = np.array([sheet(z) for z in (0.0, 0.15, 0.3, 1.0, 1.21, 2.5)])
    grid = Grid(low_m=np.zeros(2), cell_m=0.5, nx=1, ny=1)
    solids = find_solids(corners, np.ones(6, bool), np.array([-1, -1, 4, -1, -1, -1], np.int32), grid, step_m=0.2)
    assert solids.bottom_m.tolist() == [0.0, 1.0, 1.21, 2.5]
    assert solids.top_m.tolist() == [0.3, 1.0, 1.21, 2.5]
    assert solids.ground_floor.tolist() == [4, -1, -1, -1]
    assert np.allclose(solids.headroom_m(), [0.7, 0.21, 1.29, np.inf])
    assert solids.first_above(np.zeros(4, np.int64), np.array([-5.0, 0.3, 1.1, 9.0])).tolist() == [0, 1, 2, -1]


# ------------------------------------------------------------------------------------------------ clearance
@settings(max_examples=40, deadline=None)
@given(hnp.arrays(bool, (12, 15), elements=st.sampled_from([True, False, False, False])))
def test_spreading_over_an_open_plan_is_the_exact_distance_transform(blocked: np.ndarray) -> None:
    """Every cell has a node here, so nothing but the propagation itself is tested."""
    ny, nx = blocked.shape
    cell = np.array([[x, y] for y in range(ny) for x in range(nx)], dtype=np.int64)
    links = np.full((nx * ny, 8), -1, dtype=np.int32)
    for direction, (dx, dy) in enumerate(NEIGHBOURS):
        to = cell + np.array([dx, dy])
        inside = ((to >= 0) & (to < [nx, ny])).all(axis=1)
        links[inside, direction] = (to[:, 1] * nx + to[:, 0])[inside]
    source = np.where(blocked.ravel(), np.cumsum(blocked.ravel()) - 1, -1)
    place = cell[blocked.ravel()].astype(float)
    distance, owner = spread(links, cell, source, place, reach_cells=100.0)
    if not blocked.any():
        assert np.isinf(distance).all()
        assert (owner == -1).all()
        return
    exact = ndimage.distance_transform_edt(~blocked).ravel()
    # A cell can be out of line with the source it would need from its neighbours: a known rare error, below 0.1 cells.
    assert np.abs(distance - exact).max() <= 0.1
    assert np.allclose(distance, np.sqrt(((cell - place[owner]) ** 2).sum(axis=1)))


@pytest.mark.parametrize(("dx", "dy"), [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
def test_spreading_follows_a_corridor_one_cell_wide_in_every_direction(dx: int, dy: int) -> None:
    cell = np.arange(6)[:, None] * np.array([[dx, dy]])
    onward = int(np.flatnonzero(([dx, dy] == NEIGHBOURS).all(axis=1))[0])
    links = np.full((6, 8), -1, dtype=np.int32)
    links[:-1, onward] = np.arange(1, 6)
    source = np.where(np.arange(6) == 0, 0, -1)
    distance, _ = spread(links, cell, source, np.zeros((1, 2)), reach_cells=4.5)
    assert np.allclose(distance, [k * np.hypot(dx, dy) if k * np.hypot(dx, dy) <= 4.5 else np.inf for k in range(6)])


def test_clearance_is_the_distance_transform_of_the_room() -> None:
    space = free_space(room_with(((2.0, 1.5, 0.0), (3.0, 2.5, 2.6)), ((4.6, 0.8, 0.0), (5.0, 3.1, 0.9))))
    floor = space.floor_map(0)
    inside = np.isfinite(floor.ground_m)
    ny, nx = inside.shape
    x, y = space.grid.centre_m(np.arange(nx * ny)).T.reshape(2, ny, nx)
    room = inside & (x > 0) & (x < 6) & (y > 0) & (y < 4)
    room &= ~((x > 2) & (x < 3) & (y > 1.5) & (y < 2.5))
    room &= ~((x > 4.6) & (x < 5) & (y > 0.8) & (y < 3.1))
    exact = np.minimum(ndimage.distance_transform_edt(room) * space.grid.cell_m, space.clearance_cap_m)
    assert room.sum() > 8000
    assert np.abs(floor.clearance_m - exact)[room].max() <= 0.1 * space.grid.cell_m


# ------------------------------------------------------------------------------------------------ what is walked
def test_a_person_stands_in_the_room_and_not_in_its_walls_nor_within_the_radius_of_them() -> None:
    space = free_space(room_with())
    assert stands_at(space, 3.0, 2.0)
    assert stands_at(space, 0.3, 2.0)
    assert not stands_at(space, 0.15, 2.0)
    plan = space.position_m()[space.can_stand]
    assert (plan[:, 0] > 0.25 - 0.04).all()
    assert (plan[:, 0] < 5.75 + 0.04).all()
    area = space.can_stand.sum() * space.cell_m2
    rim = 2 * (5.5 + 3.5) * 0.71 * space.grid.cell_m
    assert abs(area - 5.5 * 3.5) <= rim


@pytest.mark.slow
@pytest.mark.parametrize(
    ("low_z", "high_z", "walks"),
    [(0.0, 0.15, True), (0.0, 0.25, True), (0.0, 0.3, False), (0.7, 0.75, False), (1.6, 1.7, False), (1.75, 1.8, True)],
)
def test_a_bar_across_the_room_is_stepped_over_ducked_or_in_the_way(low_z: float, high_z: float, walks: bool) -> None:
    space = free_space(room_with(((2.9, 0.0, low_z), (3.1, 4.0, high_z))))
    assert joined(space, (1.0, 2.0, 0.0), (5.0, 2.0, 0.0)) == walks


def test_a_sheet_that_no_plumb_line_meets_is_an_obstacle() -> None:
    sheet = ((3.0, 0.0, 0.0), (3.0005, 4.0, 2.0))
    assert not joined(free_space(room_with(sheet)), (1.0, 2.0, 0.0), (5.0, 2.0, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(("gap_m", "walks"), [(0.4, False), (0.6, True)])
def test_a_gap_is_walked_where_the_body_fits(gap_m: float, walks: bool) -> None:
    space = free_space(room_with(((2.9, 0.0, 0.0), (3.1, 2.0, 2.6)), ((2.9, 2.0 + gap_m, 0.0), (3.1, 4.0, 2.6))))
    assert joined(space, (1.0, 2.0, 0.0), (5.0, 2.0, 0.0)) == walks
    robot = Carrier(radius_m=0.15, step_m=0.03, height_m=0.5, opens_doors=False)
    small = free_space(room_with(((2.9, 0.0, 0.0), (3.1, 2.0, 2.6)), ((2.9, 2.0 + gap_m, 0.0), (3.1, 4.0, 2.6))), robot)
    assert joined(small, (1.0, 2.0, 0.0), (5.0, 2.0, 0.0))


@pytest.mark.slow
def test_a_robot_drives_under_a_table_and_stops_at_a_threshold() -> None:
    robot = Carrier(radius_m=0.2, step_m=0.03, height_m=0.6, opens_doors=False)
    table = ((2.5, 0.0, 0.7), (3.5, 4.0, 0.75))
    threshold = ((2.5, 0.0, 0.0), (2.6, 4.0, 0.05))
    ends = ((1.0, 2.0, 0.0), (5.0, 2.0, 0.0))
    assert joined(free_space(room_with(table), robot), *ends)
    assert not joined(free_space(room_with(table)), *ends)
    assert not joined(free_space(room_with(threshold), robot), *ends)
    assert joined(free_space(room_with(threshold)), *ends)


def test_table_tops_are_no_ground_to_stand_on() -> None:
    space = free_space(room_with(((2.0, 1.0, 0.0), (4.0, 3.0, 0.6))))
    assert space.ground_m.max() <= 0.01


@pytest.mark.parametrize(("rise_m", "walks"), [(0.8, True), (1.4, False)])
def test_a_ramp_is_walked_up_to_the_steepest_slope(rise_m: float, walks: bool) -> None:
    """A wedge of 2 m and a platform behind it, in a room of 6 m: 22 and 35 degrees, the limit is 25."""
    a, b, c = (2.0, 0.0), (4.0, 0.0), (6.0, 0.0)
    quads = [
        [(a[0], 0.0, 0.0), (a[0], 4.0, 0.0), (b[0], 4.0, rise_m), (b[0], 0.0, rise_m)],
        [(b[0], 0.0, rise_m), (b[0], 4.0, rise_m), (c[0], 4.0, rise_m), (c[0], 0.0, rise_m)],
    ]
    wedge = np.array([[q[i] for i in t] for q in quads for t in ((0, 1, 2), (0, 2, 3))], dtype=float)
    low = tuple((lo, (hi[0], hi[1], hi[2] + 2.0) if hi[2] > 0 else hi) for lo, hi in ROOM)
    shell = boxes(*(((lo[0], lo[1], lo[2] + 2.0), hi) if lo[2] == 2.6 else (lo, hi) for lo, hi in low))
    corners = np.concatenate([shell.vertices_m[shell.triangles], wedge]).reshape(-1, 3)
    survey = survey_of(scene_from_arrays(corners, np.arange(len(corners)).reshape(-1, 3)))
    space = free_space(survey)
    up = space.position_m()[space.can_stand & (space.ground_m > 0.5 * rise_m)]
    assert bool(len(up)) or not walks
    assert joined(space, (1.0, 2.0, 0.0), (5.0, 2.0, rise_m)) == walks


#: A platform 0.6 m high in the west of the room, and steps up to it in a corner.
PLATFORM: tuple[Box, ...] = (
    ((0.0, 0.0, 0.0), (3.0, 4.0, 0.6)),
    ((3.0, 0.0, 0.0), (3.3, 1.0, 0.4)),
    ((3.3, 0.0, 0.0), (3.6, 1.0, 0.2)),
)


def test_a_drop_is_no_obstacle_and_no_way_down() -> None:
    space = free_space(room_with(*PLATFORM))
    assert stands_at(space, 2.95, 3.0, 0.6)
    assert not stands_at(space, 3.1, 3.0, 0.0)
    assert joined(space, (1.0, 3.0, 0.6), (5.0, 3.0, 0.0))
    node, direction = np.nonzero(space.links >= 0)
    rise = np.abs(space.ground_m[node] - space.ground_m[space.links[node, direction]])
    assert rise.max() < 0.21


def test_one_ducks_on_stairs_and_not_on_the_floor() -> None:
    over_platform, over_floor = ((2.0, 0.0, 2.4), (2.2, 4.0, 2.5)), ((4.0, 0.0, 1.8), (4.2, 4.0, 1.9))
    ends = ((1.0, 3.0, 0.6), (5.0, 3.0, 0.0))
    tall = Carrier(height_m=1.9)
    assert joined(free_space(room_with(*PLATFORM, over_platform), tall), *ends)
    assert not joined(
        free_space(room_with(*PLATFORM, over_platform), Carrier(height_m=1.9, stairs_height_m=1.9)), *ends
    )
    assert not joined(free_space(room_with(*PLATFORM, over_floor), tall), *ends)


def test_zones_keep_out_of_their_floor_only_and_access_keeps_in() -> None:
    survey, free = survey_in("stairwell"), stairwell()
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    kept_out = free_space(survey, zones=(WalkingZone(square, 0),))
    kept_in = free_space(survey, zones=(WalkingZone(square, 1, access=True),))
    plan = free.position_m()[:, :2]
    inside = over_polygon(plan, square)
    assert (inside & free.can_stand & (free.floor == 0)).sum() > 100
    assert np.array_equal(kept_out.can_stand, free.can_stand & ~(inside & (free.floor == 0)))
    assert np.array_equal(kept_in.can_stand, free.can_stand & (inside | (free.floor != 1)))


def test_a_scene_in_bands_of_rows_gives_the_same_free_space(monkeypatch: pytest.MonkeyPatch) -> None:
    survey = survey_in("thin-walls")
    whole = free_space(survey)
    monkeypatch.setattr("planner_core.positions.solids._BAND_PAIRS", 3000)
    banded = free_space(survey)
    assert banded.ground_m.tobytes() == whole.ground_m.tobytes()
    assert banded.links.tobytes() == whole.links.tobytes()
    assert banded.clearance_m.tobytes() == whole.clearance_m.tobytes()


def test_a_scene_in_chunks_of_nodes_gives_the_same_free_space(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = stairwell()
    monkeypatch.setattr("planner_core.positions.free_space._CHUNK", 700)
    chunked = free_space(survey_in("stairwell"))
    assert chunked.ground_m.tobytes() == whole.ground_m.tobytes()
    assert chunked.links.tobytes() == whole.links.tobytes()
    numbers = components(whole.links, whole.can_stand)
    monkeypatch.undo()
    assert np.array_equal(numbers, components(whole.links, whole.can_stand))


def test_components_join_only_within_the_same_number() -> None:
    space = free_space(room_with())
    half = (space.position_m()[:, 0] > 3.0).astype(np.int64)
    stands = space.can_stand
    assert components(space.links, stands).max() == 0
    assert np.array_equal(components(space.links, stands, within=half), np.where(stands, half, -1))
    one, other = half_links(space.links, stands, between=half)
    assert (half[one] != half[other]).all()
    node, direction = np.nonzero((space.links >= 0) & stands[:, None])
    to = space.links[node, direction]
    assert 2 * one.size == (stands[to] & (half[node] != half[to])).sum()


# ------------------------------------------------------------------------------------------------ large sites
def house(door_m: float) -> np.ndarray:
    """(K, 3, 3) triangles of a house of two rooms of 3 x 4 m, and a doorway between them at (3.1, 2)."""
    across = ((3.0, 0.0, 0.0), (3.2, 2.0 - 0.5 * door_m, 2.6)), ((3.0, 2.0 + 0.5 * door_m, 0.0), (3.2, 4.0, 2.6))
    scene = boxes(*ROOM, *across)
    return scene.vertices_m[scene.triangles]


def site_of(*houses: tuple[np.ndarray, float, tuple[float, float]]) -> Survey:
    """Houses, each turned by an angle in degrees and moved."""
    placed = []
    for corners, angle_deg, (x, y) in houses:
        cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
        placed.append(corners @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) + [x, y, 0.0])
    points = np.concatenate(placed).reshape(-1, 3)
    return survey_of(scene_from_arrays(points, np.arange(len(points)).reshape(-1, 3)))


def are_joined(survey: Survey, space: FreeSpace, angle_deg: float, at: tuple[float, float]) -> bool:
    """Whether one walks from room to room in the house there."""
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    rooms = [(cos * x - sin * 2.0 + at[0], sin * x + cos * 2.0 + at[1], 0.0) for x in (1.5, 4.7)]
    local = [np.array(room) - survey.scene.offset_m for room in rooms]
    assert all(stands_at(space, *room.tolist()) for room in local)
    return joined(space, *((float(x), float(y), float(z)) for x, y, z in local))


def test_houses_a_kilometre_apart_keep_their_doorways() -> None:
    far = (1003.37, 998.71)
    survey = site_of((house(0.9), 0.0, (0.0, 0.0)), (house(0.9), 27.0, far))
    space = free_space(survey)
    assert are_joined(survey, space, 0.0, (0.0, 0.0))
    assert are_joined(survey, space, 27.0, far)
    # What lies between them takes no memory, so their cells are as small as those of one house.
    assert space.grid.cell_m == CELL_M
    assert space.n_nodes < 3 * free_space(room_with()).n_nodes


@pytest.mark.parametrize(
    ("angle_deg", "shift"),
    [(0.0, (0.0, 0.0)), (0.0, (0.06, 0.11)), (12.0, (0.12, 0.03)), (27.0, (0.19, 0.21)), (45.0, (0.0, 0.0))],
)
def test_the_largest_cells_keep_doorways_wider_than_0_6_m(
    angle_deg: float, shift: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner_core.positions.free_space._MAX_COVERED", 1)
    far = (300.0 + shift[0], 300.0 + shift[1])
    survey = site_of((house(0.6), 0.0, (0.0, 0.0)), (house(0.6), angle_deg, far))
    space = free_space(survey)
    assert space.grid.cell_m == LARGEST_CELL_M
    assert are_joined(survey, space, angle_deg, far)


def test_the_largest_cells_keep_stairs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner_core.positions.free_space.MAX_CELLS", 1)
    monkeypatch.setattr("planner_core.positions.free_space._MAX_COVERED", 1)
    space = free_space(survey_in("stairwell"))
    assert space.grid.cell_m == LARGEST_CELL_M
    assert joined(space, (0.6, 1.0, 0.0), (0.6, 1.0, 2.8), (0.6, 1.0, 5.6))


@pytest.mark.slow
@pytest.mark.parametrize("radius_m", [0.15, 0.25, 0.45])
@pytest.mark.parametrize("most", [7e3, 1e5, 1e7])
def test_cells_grow_with_what_is_covered_by_whole_fractions_of_the_radius(
    radius_m: float, most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two slabs from above and below, and the upper and lower ends of the walls, outer and inner."""
    survey, carrier = site_of((house(0.9), 0.0, (0.0, 0.0))), Carrier(radius_m=radius_m)
    monkeypatch.setattr("planner_core.positions.free_space.MAX_CELLS", 1)
    monkeypatch.setattr("planner_core.positions.free_space._MAX_COVERED", most)
    cell_m, largest_m = free_space(survey, carrier).grid.cell_m, max(radius_m, LARGEST_CELL_M)
    parts = round(largest_m / cell_m)
    covered_m2 = 4 * 6.4 * 4.4 + 4 * (6.4 + 4.0) * 0.2 + 2 * 2 * 0.2 * 3.1
    assert CELL_M <= cell_m <= largest_m * (1 + 1e-12)
    if cell_m > CELL_M:
        assert cell_m == pytest.approx(largest_m / parts, rel=1e-12)
        assert parts * cell_m >= radius_m
        assert covered_m2 / cell_m**2 <= most * (1 + 1e-9) or parts == 1
        assert covered_m2 / (largest_m / (parts + 1)) ** 2 > most


@pytest.mark.slow
def test_of_terrain_round_a_site_what_lies_within_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The house stands on a meadow of 100 x 100 m, which lies a storey lower and is no floor."""
    corner = [[-50.0, -50.0, -3.0], [50.0, -50.0, -3.0], [50.0, 50.0, -3.0], [-50.0, 50.0, -3.0]]
    meadow = np.array(corner)[[[0, 1, 2], [0, 2, 3]]]
    survey = site_of((house(0.9), 0.0, (0.0, 0.0)), (meadow, 0.0, (0.0, 0.0)))
    survey = dataclasses.replace(survey, floors=tuple(f for f in survey.floors if f.ground_area_m2 < 100.0))
    assert len(survey.floors) == 1
    monkeypatch.setattr("planner_core.positions.free_space.MAX_CELLS", 1)
    # 122 m2 of house, and of either triangle at most the 8.4 x 6.4 m looked at: 0.25 m in 2.3 parts. Of it all: in 0.4.
    monkeypatch.setattr("planner_core.positions.free_space._MAX_COVERED", 20_000)
    assert free_space(survey).grid.cell_m == 0.125


def test_a_map_of_every_so_many_cells_shows_the_middle_ones() -> None:
    space = stairwell()
    fine = space.floor_map(1)
    for every in (2, 3, 7):
        coarse = space.floor_map(1, every=every)
        for field in dataclasses.fields(fine):
            whole = getattr(fine, field.name)[every // 2 :: every, every // 2 :: every]
            assert np.array_equal(getattr(coarse, field.name), whole, equal_nan=whole.dtype != bool)


@pytest.mark.slow
def test_links_go_both_ways_and_climb_a_step_at_most() -> None:
    space = free_space(survey_of(build("double-height-hall").scene))
    node, direction = np.nonzero(space.links >= 0)
    to = space.links[node, direction]
    assert node.size > 100_000
    assert (space.links[to, (direction + 4) % 8] == node).all()
    assert np.abs(space.ground_m[to] - space.ground_m[node]).max() <= space.carrier.step_m + 1e-3
    assert (space.cells()[to] - space.cells()[node] == NEIGHBOURS[direction]).all()


def test_a_map_shows_its_floor_and_its_stairs_up_to_head_height() -> None:
    space = stairwell()
    for index, low_m in enumerate((0.0, 2.8, 5.6)):
        ground_m = space.floor_map(index).ground_m
        shown = ground_m[np.isfinite(ground_m)]
        assert low_m - 0.3 <= shown.min() <= low_m + 1e-6
        assert shown.max() <= low_m + 1.7 + 1e-6
        assert (shown > low_m + 1.0).any() == (index < 2)


def test_a_floor_without_slab_is_walked_indoors_only() -> None:
    scene = build("without-slabs")
    space = free_space(survey_of(scene.scene))
    assert all(floor.origin == "storey-elevation" for floor in survey_of(scene.scene).floors)
    plan = space.position_m()[space.can_stand][:, :2]
    (x0, y0, _), (x1, y1, _) = scene.truth.extents_m
    assert ((plan > [x0, y0]) & (plan < [x1, y1])).all()
    assert 0.75 * sum(scene.truth.floor_area_m2.values()) < space.can_stand.sum() * space.cell_m2


def test_round_an_l_shaped_storey_without_slab_nothing_is_walked() -> None:
    """Its ground is the plane inside its bounds, a square; what has no roof of it lies outdoors."""
    scene = build("l-by-range").scene
    elements = tuple(dataclasses.replace(e, kind="IfcRoof") if e.name == "Ceiling" else e for e in scene.elements)
    kept = np.array([element.name != "Floor" for element in elements])[scene.element_of_triangle]
    survey = survey_of(
        scene_from_arrays(
            scene.vertices_m,
            scene.triangles[kept],
            element_of_triangle=scene.element_of_triangle[kept],
            elements=elements,
            storeys=scene.storeys,
        )
    )
    assert survey.floors[0].origin == "storey-elevation"
    space = free_space(survey)
    assert stands_at(space, 1.5, 1.5)
    plan = space.position_m()[space.can_stand]
    assert not ((plan[:, 0] > 3.3) & (plan[:, 1] > 3.3)).any()


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"radius_m": -1.0}, "radius_m"),
        ({"step_m": float("nan")}, "step_m"),
        ({"height_m": 0.3}, "height_m"),
        ({"max_slope_rad": 2.0}, "max_slope_rad"),
    ],
)
def test_movers_that_make_no_sense_are_refused_by_name(wrong: dict[str, float], named: str) -> None:
    with pytest.raises(RequirementError, match=named):
        Carrier(**wrong)  # type: ignore[arg-type]


def test_wrong_zones_and_cells_are_refused() -> None:
    survey = room_with()
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    with pytest.raises(RequirementError, match="zone's floor: got 7"):
        free_space(survey, zones=(WalkingZone(square, 7),))
    with pytest.raises(RequirementError, match="at least three finite corners"):
        WalkingZone(square[:2], 0)
    with pytest.raises(RequirementError, match="cell_m"):
        free_space(survey, cell_m=0.0)
