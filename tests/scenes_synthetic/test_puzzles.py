"""Puzzles: their proofs hold, the areas computed from the plan are right, and our scan agrees with them."""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scenes_synthetic
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BeamTemplate, Greedy, PlanSettings, Requirements
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.patches import make_patches
from scenes_synthetic.model import KnownView, SyntheticScene
from scenes_synthetic.plan_view import Edge, edges_of, exact, floor_area, in_circle, sights

PUZZLES = ("convex-room", "l-by-range", "t-corridor", "plus-corridor", "comb-gallery", "spiral", "column-hall")
COARSE = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=180),
    requirements=Requirements(coverage=0.8),
    grid_step_m=1.5,
    instrument_heights_m=(1.3,),
    max_patch_area_m2=0.5,
    method=Greedy(),
)


def edges(synthetic: SyntheticScene) -> list[Edge]:
    """Inner edges of the plan, read off the parts' own foot prints."""
    outline = synthetic.rooms[0].outline_m
    found = edges_of(outline, [f"Wall {k}" for k in range(len(outline))])
    for part in synthetic.parts:
        if part.kind == "IfcColumn":
            (x0, y0, _), (x1, y1, _) = part.solid.bounds_m.tolist()
            found += edges_of(((x0, y0), (x1, y0), (x1, y1), (x0, y1)), [part.name] * 4)
    return found


def segments(synthetic: SyntheticScene) -> np.ndarray:
    """(E, 2, 2) float64: the same edges as numbers."""
    return np.array([(e.start, e.end) for e in edges(synthetic)], dtype=np.float64)


def is_free(a: np.ndarray, b: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """(N, M) bool: no wall crosses the way from a (N, 2) to b (M, 2); shares no code with `sights`."""
    way = b[None] - a[:, None]
    free = np.ones(way.shape[:2], dtype=bool)
    for start, end in walls:
        run = end - start
        side = [run[0] * (p[:, 1] - start[1]) - run[1] * (p[:, 0] - start[0]) for p in (a, b)]
        turn = [way[..., 0] * (c[1] - a[:, 1, None]) - way[..., 1] * (c[0] - a[:, 0, None]) for c in (start, end)]
        free &= ~((side[0][:, None] * side[1][None] < 0) & (turn[0] * turn[1] < 0))
    return free


def spots_in_the_room(synthetic: SyntheticScene, step_m: float) -> np.ndarray:
    """(N, 2): a grid over the floor, centred, without the columns."""
    low, high = (
        np.asarray(synthetic.rooms[0].outline_m).min(axis=0),
        np.asarray(synthetic.rooms[0].outline_m).max(axis=0),
    )
    axes = [np.arange(a + step_m / 2, b, step_m) + 1e-3 for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    x, y = grid.T
    inside = np.zeros(len(grid), dtype=bool)
    for (x0, y0), (x1, y1) in segments(synthetic):
        if y0 != y1:
            inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return grid[inside]


def surface_samples(synthetic: SyntheticScene) -> np.ndarray:
    """(M, 2): places a millimetre before every wall, its ends among them, and on the floor."""
    walls = segments(synthetic)
    share = np.array([0.001, 0.1, 0.3, 0.5, 0.7, 0.9, 0.999])
    at = walls[:, None, 0] + share[None, :, None] * (walls[:, 1] - walls[:, 0])[:, None]
    run = walls[:, 1] - walls[:, 0]
    inwards = np.stack([-run[:, 1], run[:, 0]], axis=1) / np.linalg.norm(run, axis=1, keepdims=True)
    inwards[len(synthetic.rooms[0].outline_m) :] *= -1  # columns: the room lies outside
    return np.vstack([(at + 1e-3 * inwards[:, None]).reshape(-1, 2), spots_in_the_room(synthetic, 0.5)])


@pytest.fixture(scope="module", params=PUZZLES)
def puzzle(request: pytest.FixtureRequest) -> SyntheticScene:
    return scenes_synthetic.build(request.param)


# ------------------------------------------------------------------------------------------------- fewest stations
def test_the_best_stations_of_a_puzzle_see_every_sample_of_its_surface(puzzle: SyntheticScene) -> None:
    stations = np.array(puzzle.truth.stations_m)[:, :2]
    assert len(stations) == puzzle.truth.n_stations
    assert is_free(stations, surface_samples(puzzle), segments(puzzle)).any(axis=0).all()


def test_exhaustive_search_finds_no_plan_of_fewer_stations(puzzle: SyntheticScene) -> None:
    assert puzzle.truth.n_stations is not None
    if puzzle.truth.n_stations == 1:
        return  # nothing is fewer
    spots = spots_in_the_room(puzzle, 0.75)
    seen = is_free(spots, surface_samples(puzzle), segments(puzzle))
    for chosen in itertools.combinations(range(0, len(spots), 2), puzzle.truth.n_stations - 2):
        rest = ~seen[list(chosen)].any(axis=0)
        assert not seen[:, rest].all(axis=1).any(), f"{spots[list(chosen)]} and one more see everything"


@pytest.mark.slow
def test_no_place_sees_two_witnesses(puzzle: SyntheticScene) -> None:
    witnesses = np.array(puzzle.truth.witnesses_m).reshape(-1, 3)[:, :2]
    if puzzle.name == "column-hall":
        assert len(witnesses) == 0  # proven by the faces of a column instead
        return
    assert len(witnesses) == puzzle.truth.n_stations
    if puzzle.name == "convex-room":
        return
    # The regions that see them, as polygons of rational corners: no two overlap, nor do their sights cross.
    fans = [[(s.start, s.end) for s in sights(edges(puzzle), exact(tuple(w)))] for w in witnesses]
    for (a, fan_a), (b, fan_b) in itertools.combinations(zip(witnesses, fans, strict=True), 2):
        common = sum(common_area(exact(tuple(a)), t, exact(tuple(b)), u) for t in fan_a for u in fan_b)
        assert common == 0, f"{a} and {b} can be seen from one place"


Corner = tuple[Fraction, Fraction]


def common_area(a: Corner, side_a: tuple[Corner, Corner], b: Corner, side_b: tuple[Corner, Corner]) -> Fraction:
    """Area that two triangles share, exactly: one is cut by the sides of the other."""
    polygon = [a, *side_a]
    clip = [b, *side_b]
    for start, end in zip(clip, [*clip[1:], clip[0]], strict=True):
        side = [(end[0] - start[0]) * (p[1] - start[1]) - (end[1] - start[1]) * (p[0] - start[0]) for p in polygon]
        kept: list[Corner] = []
        for k, p in enumerate(polygon):
            before = polygon[k - 1]
            if (side[k] > 0 > side[k - 1]) or (side[k] < 0 < side[k - 1]):
                t = side[k - 1] / (side[k - 1] - side[k])
                kept.append((before[0] + t * (p[0] - before[0]), before[1] + t * (p[1] - before[1])))
            if side[k] >= 0:
                kept.append(p)
        polygon = kept
        if len(polygon) < 3:
            return Fraction(0)
    turns = [p[0] * q[1] - p[1] * q[0] for p, q in zip(polygon, [*polygon[1:], polygon[0]], strict=True)]
    return sum(turns, Fraction(0)) / 2


def test_two_stations_leave_nothing_of_the_column_hall_unseen() -> None:
    hall = scenes_synthetic.build("column-hall")
    first, second = (exact(station[:2]) for station in hall.truth.stations_m)
    seen = [sights(edges(hall), spot) for spot in (first, second)]
    common = sum(common_area(first, (s.start, s.end), second, (t.start, t.end)) for s, t in itertools.product(*seen))
    together = floor_area(seen[0], first) + floor_area(seen[1], second) - common
    assert together == 12 * 7 - 3
    for edge in edges(hall):
        stretches = sorted(sorted((s.start, s.end)) for fan in seen for s in fan if s.edge == edge)
        reached = min(edge.start, edge.end)
        for low, high in stretches:
            assert low <= reached, edge
            reached = max(reached, high)
        assert reached == max(edge.start, edge.end), edge


@pytest.mark.parametrize(("name", "ends"), [("l-by-range", 2), ("t-corridor", 3), ("plus-corridor", 4)])
def test_a_short_range_needs_as_many_stations_as_far_ends(name: str, ends: int) -> None:
    puzzle = scenes_synthetic.build(name)
    range_m, n_stations = puzzle.truth.n_stations_at_range[0]
    assert n_stations == ends
    corners = np.asarray(puzzle.rooms[0].outline_m)
    gaps = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    # Needed: that many corners, no two of which are within reach of one station.
    assert any(
        gaps[np.ix_(group, group)][np.triu_indices(ends, 1)].min() > 2 * range_m
        for group in map(list, itertools.combinations(range(len(corners)), ends))
    )
    # Enough: some that many spots of the middle line reach every corner that they see, at the worst height.
    spots = spots_in_the_room(puzzle, 0.5)
    samples = surface_samples(puzzle)
    reach = np.linalg.norm(spots[:, None] - samples[None], axis=2) < math.sqrt(range_m**2 - 1.5**2)
    seen = is_free(spots, samples, segments(puzzle)) & reach
    middle = np.flatnonzero(np.abs(spots - np.median(corners, axis=0)).min(axis=1) < 2.0)
    assert covers(seen[middle], ends)


def covers(seen: np.ndarray, n: int) -> bool:
    """Whether n rows together see all columns: whoever sees the hardest column first."""
    if seen.shape[1] == 0:
        return True
    if n == 0:
        return False
    hardest = int(np.argmin(seen.sum(axis=0)))
    return any(covers(seen[:, ~seen[row]], n - 1) for row in np.flatnonzero(seen[:, hardest])[::3])


# ----------------------------------------------------------------------------------------------------- areas
@given(x=st.integers(1, 69), y=st.integers(1, 59))
@settings(max_examples=40, deadline=None)
def test_exact_sights_agree_with_samples(x: int, y: int) -> None:
    outline = ((0.0, 0.0), (7.0, 0.0), (7.0, 3.0), (3.0, 3.0), (3.0, 6.0), (0.0, 6.0))
    if x >= 30 and y >= 30:
        x, y = x // 3, y // 3
    room = edges_of(outline, [f"Wall {k}" for k in range(6)])
    spot = exact((x / 10, y / 10))
    walls = np.array([(e.start, e.end) for e in room], dtype=np.float64)
    grid = np.stack(np.meshgrid(np.arange(0.025, 7, 0.05), np.arange(0.025, 6, 0.05)), axis=-1).reshape(-1, 2)
    grid = grid[(grid < 3.0).any(axis=1)]
    share = is_free(np.array([spot], dtype=np.float64), grid, walls).mean()
    assert float(floor_area(sights(room, spot), spot)) == pytest.approx(share * 30.0, abs=0.15)


@pytest.mark.parametrize(
    ("radius", "area"), [(5.0, 12.0), (0.5, math.pi / 4), (1.0, math.pi), (2.0, 4 * (math.pi / 3 + math.sqrt(3) / 2))]
)
def test_circle_cuts_a_rectangle_to_its_closed_form(radius: float, area: float) -> None:
    corners = [(-3.0, -1.0), (3.0, -1.0), (3.0, 1.0), (-3.0, 1.0)]
    found = sum(in_circle(a, b, radius) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))
    assert found == pytest.approx(area, rel=1e-12)


# ------------------------------------------------------------------------------------------------------ scans
def dense(range_m: float) -> BeamTemplate:
    """Beams all round, a milliradian apart in patch mode's arithmetic; it casts none of them."""
    return BeamTemplate(
        azimuth_rad=np.arange(60_000) * (2 * np.pi / 60_000),
        elevation_rad=np.linspace(np.pi / 2, -np.pi / 2, 30_001),
        range_min_m=0.0,
        range_max_m=1000.0 if math.isinf(range_m) else range_m,
    )


@pytest.mark.parametrize("engine_name", ["opencl", pytest.param("open3d", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [*PUZZLES, "closed-rooms"])
def test_scan_sees_the_areas_that_the_plan_says(name: str, engine_name: str) -> None:
    puzzle = scenes_synthetic.build(name)
    assert puzzle.truth.views
    scene = puzzle.scene
    patches = make_patches(scene, max_area_m2=0.04)
    mode = PatchMode(open_engine(scene, patches, engine=engine_name), scene, patches)
    element = scene.element_of_triangle[patches.triangle_of_patch]
    for view in puzzle.truth.views:
        seen = mode.see(dense(view.range_m), np.array([view.station_m]))
        area_m2 = patches.area_m2[seen.patch]
        found = np.bincount(element[seen.patch], seen.share * area_m2, len(puzzle.parts))
        # A patch that lies across the edge of what is seen is known by its samples only.
        across = np.bincount(element[seen.patch], area_m2 * (seen.share < 1), len(puzzle.parts))
        for part, area, slack in zip(puzzle.parts, found, 0.12 * across + 0.01, strict=True):
            exact_m2 = view.visible_area_m2.get(part.name, 0.0)
            assert abs(area - exact_m2) < slack, (
                f"{part.name} from {view.station_m}, {view.range_m}: {area}, {exact_m2}"
            )


@pytest.mark.slow
@pytest.mark.opencl
@pytest.mark.parametrize("name", [pytest.param("l-by-range", marks=pytest.mark.slow), "comb-gallery"])
def test_beams_measure_the_areas_that_the_plan_says(name: str) -> None:
    puzzle = scenes_synthetic.build(name)
    engine = open_engine(puzzle.scene, make_patches(puzzle.scene, max_area_m2=100.0), engine="opencl")
    for view in puzzle.truth.views:
        for part, (area, slack) in measured_by_beams(puzzle, engine, view).items():
            assert abs(area - view.visible_area_m2.get(part, 0.0)) < slack, (part, view.station_m)


def measured_by_beams(puzzle: SyntheticScene, engine: ScanEngine, view: KnownView) -> dict[str, tuple[float, float]]:
    """Area by part, and how wrong it may be at its edges.

    Each beam stands for its solid angle times range squared over the cosine of incidence; an edge of what is seen may
    cut the widest such spot anywhere.
    """
    n = 1000
    step = np.pi / n
    template = replace(
        dense(view.range_m),
        azimuth_rad=(np.arange(2 * n) + 0.5) * step,
        elevation_rad=np.pi / 2 - (np.arange(n) + 0.5) * step,
    )
    batch = engine.scan(template, np.array([view.station_m]))
    hit = batch.triangle[0] >= 0
    solid_angle = np.broadcast_to((np.cos(template.elevation_rad) * step**2)[:, None], hit.shape)
    range_m, cosine = batch.range_m[0][hit].astype(np.float64), batch.cos_incidence[0][hit].astype(np.float64)
    element = puzzle.scene.element_of_triangle[batch.triangle[0][hit]]
    area = np.bincount(element, solid_angle[hit] * range_m**2 / cosine, len(puzzle.parts))
    widest = np.zeros(len(puzzle.parts))
    np.maximum.at(widest, element, step * range_m / cosine)
    return {
        part.name: (float(area[k]), 0.01 + 2.7 * float(widest[k]) + 0.002 * float(area[k]))
        for k, part in enumerate(puzzle.parts)
    }


@pytest.mark.slow
def test_puzzle_plans_without_error_and_inside_its_room(puzzle: SyntheticScene) -> None:
    plan = make_plan(puzzle.scene, COARSE)
    for x, y, _ in (station.position_m for station in plan.stations):
        above = [((y0 > y) != (y1 > y)) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)
                 for (x0, y0), (x1, y1) in segments(puzzle).tolist()]  # fmt: skip
        assert sum(above) % 2 == 1, (x, y)
    walls_and_slabs_m2 = puzzle.truth.floor_area_m2["Room"] * 2 + puzzle.truth.wall_area_m2["Room"]
    columns_m2 = sum(4 * 2.7 - 2 for part in puzzle.parts if part.kind == "IfcColumn")
    # Patches on the seam of room and wall's foot count whole; outer faces would more than double the area.
    assert plan.coverage.achievable_area_m2 < 1.35 * (walls_and_slabs_m2 + columns_m2)
    assert plan.coverage.fraction_of_achievable >= 0.8
    assert 1 <= plan.lower_bound <= len(plan.stations)
