"""The search on scenes: valid is where candidates are, F2 is the metric's, and no method makes it worse."""

from dataclasses import replace

import numpy as np
import pytest
from stages import find_candidates, tripods_of

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Element, PlanSettings, Scene
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search import SearchSettings, search
from planner_core.paper.search.station_fitness import StationFitness, height_limits_m
from planner_core.scanner.load_scanner import load_scanner

HDL = load_scanner("hdl-64e")
SMALL = replace(HDL, n_azimuths=90, elevation_rad=HDL.elevation_rad[::8])
SETTINGS = PlanSettings(scanner=SMALL, max_patch_area_m2=0.1, grid_step_m=1.0)


class Opened:
    def __init__(self, scene: Scene, settings: PlanSettings = SETTINGS, engine: str = "auto") -> None:
        self.settings = settings
        self.survey = make_survey(scene, settings)
        self.engine = open_engine(scene, self.survey.patches, engine=engine)
        self.distribution = PointDistribution(scene, self.survey.patches, self.engine)

    def fitness(self, floor: int = 0, **options) -> StationFitness:
        return StationFitness(
            tripods_of(self.survey, self.settings, self.engine), self.distribution, floor=floor, **options
        )

    def candidates(self, floor: int = 0) -> np.ndarray:
        return find_candidates(self.survey, self.settings, self.engine, floors=(floor,), n_halvings=0).position_m


def with_plate(scene: Scene, middle_m, *, half_m: float) -> Scene:
    """The scene and a level square without thickness, as an element of its own."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half_m + np.array(middle_m)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32) + np.int32(scene.vertices_m.shape[0])
    return replace(
        scene,
        vertices_m=np.concatenate([scene.vertices_m, corners]),
        triangles=np.concatenate([scene.triangles, triangles]),
        element_of_triangle=np.append(scene.element_of_triangle, np.full(2, len(scene.elements), dtype=np.int32)),
        elements=(*scene.elements, Element("Plate", "IfcPlate", "Plate", 0)),
    )


@pytest.fixture(scope="module")
def rooms() -> Opened:
    return Opened(scenes_synthetic.build("two-rooms").scene)


@pytest.fixture(scope="module")
def house() -> Opened:
    return Opened(scenes_synthetic.build("house").scene)


def test_every_candidate_is_valid_and_its_values_are_the_metrics(rooms) -> None:
    fitness, place = rooms.fitness(), rooms.candidates()[::7]
    beside = place + np.array([0, 0, 1.6])  # too high for the scanner
    valid, f1, f2 = fitness.evaluate(np.concatenate([beside, place]))
    assert valid.tolist() == [False] * len(place) + [True] * len(place)
    expected = rooms.distribution.of(rooms.survey.template, place)
    np.testing.assert_array_equal(f1[len(place) :], expected.n_patches)
    np.testing.assert_array_equal(f2[len(place) :], expected.f2_m2)
    assert np.isinf(f2[: len(place)]).all()
    assert fitness.n_scans == len(place)


@pytest.mark.slow
@pytest.mark.parametrize("floor", [0, 1])
def test_of_a_fine_grid_the_candidates_and_no_others_are_valid(house, floor: int) -> None:
    """The grid's columns are walked by another code; here they are found again by asking about every grid point."""
    fitness = house.fitness(floor)
    found = house.candidates(floor)
    low, high = house.survey.floors[floor].bounds_m
    x = np.unique(found[:, 0])
    y = np.unique(found[:, 1])
    grid = np.array([(a, b, c) for a in x for b in y for c in np.unique(found[:, 2])])
    assert len(grid) > len(found) and (x >= low[0]).all() and (x <= high[0]).all()
    valid = grid[fitness.is_valid(grid)]
    assert {tuple(p) for p in valid.round(6).tolist()} == {tuple(p) for p in found.round(6).tolist()}


def test_a_table_is_no_ground_to_stand_on(rooms) -> None:
    """Its top is taken for what lies between sensor and ground, however the height above it would suit."""
    spot = rooms.candidates()[0]
    table = with_plate(rooms.survey.scene, [*spot[:2], 0.7], half_m=0.5)
    at = np.array([[*spot[:2], 1.7]])
    assert rooms.fitness().is_valid(at).all()
    for published in (False, True):
        assert not Opened(table).fitness(published_tests=published).is_valid(at).any()


def test_the_published_tests_can_decide_instead(rooms) -> None:
    """0.15 m above the sensor, a shelf: without headroom for ours, of no concern to the paper's."""
    low = np.array([[1.0, 1.5, 0.9]])
    assert rooms.fitness().is_valid(low).all()
    opened = Opened(with_plate(rooms.survey.scene, [1.0, 1.5, 1.05], half_m=0.2))
    assert not opened.fitness().is_valid(low).any()
    assert opened.fitness(published_tests=True).is_valid(low).all()


def test_heights_are_the_scanners_or_those_given() -> None:
    low, high = HDL.instrument_height_min_m, HDL.instrument_height_max_m
    assert height_limits_m(SETTINGS.heights) == (low, high)
    assert height_limits_m(replace(SETTINGS, instrument_heights_m=(1.6, 1.2)).heights) == (1.2, 1.6)
    least, most = height_limits_m(replace(SETTINGS, instrument_heights_m=(1.5,)).heights)
    assert least < 1.5 < most and most - least <= 0.31


@pytest.mark.slow
@pytest.mark.parametrize("method", ["ls", "sa", "ts"])
@pytest.mark.parametrize("fixed_height", [False, True])
def test_no_method_makes_f2_worse_and_all_end_at_candidates(rooms, method, fixed_height) -> None:
    fitness, place = rooms.fitness(), rooms.candidates()
    starts = place[:: len(place) // 5]
    options = SearchSettings(max_iterations=12, max_without_improvement=4, fixed_height=fixed_height)
    found = search(method, starts, fitness, options, bounds_m=fitness.bounds_m)
    assert found.found.all()
    before = rooms.distribution.of(rooms.survey.template, starts).f2_m2
    after = rooms.distribution.of(rooms.survey.template, found.position_m)
    np.testing.assert_allclose(found.history.position_m[0], starts, rtol=0, atol=1e-9)  # grids lie on the lattice
    np.testing.assert_allclose(found.history.f2[0], before, rtol=1e-6)
    np.testing.assert_array_equal(found.f2, after.f2_m2)
    np.testing.assert_array_equal(found.f1, after.n_patches)
    assert (found.f2 <= found.history.f2[0]).all() and found.f2.mean() < before.mean()
    assert fitness.is_valid(found.position_m).all()
    assert fitness.n_scans <= found.n_evaluations
    if fixed_height:
        np.testing.assert_allclose(found.position_m[:, 2], starts[:, 2], atol=1e-9)


@pytest.mark.slow
def test_the_same_search_gives_the_same_bytes_and_the_engine_hardly_matters(rooms) -> None:
    starts = rooms.candidates()[::40]
    options = SearchSettings(max_iterations=5)
    other = Opened(rooms.survey.scene, engine="open3d")
    ways = []
    for opened in (rooms, rooms, other):
        fitness = opened.fitness()
        ways.append(search("ls", starts, fitness, options, bounds_m=fitness.bounds_m))
    np.testing.assert_array_equal(ways[0].history.position_m, ways[1].history.position_m)
    np.testing.assert_array_equal(ways[0].f2, ways[1].f2)
    np.testing.assert_allclose(ways[0].history.f2[0], ways[2].history.f2[0], rtol=1e-3)
