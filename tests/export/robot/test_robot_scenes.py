"""Ways over the maps of whole scenes, ours and others': no line of one meets a cell that is not free."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.export.chosen import RouteLeg
from planner_core.export.occupancy import FREE, entered, map_sheets, occupancy_maps
from planner_core.export.robot_ways import MappedGround, robot_ways
from planner_core.model import PlanSettings, Requirements, Scanner, Scene
from planner_core.positions.free_space import FreeSpace, free_space
from planner_core.positions.reach import reachability
from planner_core.positions.walking import Walking
from planner_core.scene.load import load_scene

SCANNER = Scanner(
    name="few", title="few beams", source="made up", range_min_m=0.3, range_max_m=20.0, n_azimuths=8,
    elevation_rad=(0.0,), instrument_height_min_m=1.5, instrument_height_max_m=1.5,
)  # fmt: skip
pytestmark = pytest.mark.slow  # random terrain of test_ledges.py is in the quick tier
AROUND = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
N_WAYS = 12


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("double-height-hall", "duplex")]
MORE = [pytest.param(name, marks=pytest.mark.campaign) for name in ("atrium", "fzk-haus")]


@pytest.fixture(scope="module", params=["house", *SLOW, *MORE])
def ground(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, real_scene: Callable[[str], Scene]
) -> MappedGround:
    if request.param in ("duplex", "fzk-haus"):
        scene = real_scene(request.param)
    else:
        path = tmp_path_factory.mktemp("scenes") / f"{request.param}.ifc"
        scene = load_scene(scenes_synthetic.write(scenes_synthetic.build(request.param), path))
    settings = PlanSettings(scanner=SCANNER, requirements=Requirements(coverage=0.5), max_patch_area_m2=25.0)
    survey = make_survey(scene, settings)
    space = free_space(survey)
    reach = reachability(survey, space)
    sheets = map_sheets(space, survey.floors, entered(reach))
    return MappedGround(reach, sheets, occupancy_maps(survey, space, sheets))


def legs_of(ground: MappedGround) -> list[RouteLeg]:
    """Ways between places drawn at random, in pairs on any floors."""
    stand = np.flatnonzero(ground.reach.reached_node)
    ends = np.random.default_rng(5).choice(stand, size=(N_WAYS, 2))
    walking, at = Walking(ground.reach), ground.space.position_m()
    paths = [walking.path(at[a], at[b]) for a, b in ends.tolist()]
    return [RouteLeg("A", "B", path.points_m, path.length_m, ()) for path in paths if path.points_m.size]


def test_no_way_meets_a_cell_that_is_not_free(ground: MappedGround) -> None:
    legs = legs_of(ground)
    assert legs
    ways, _ = robot_ways(ground, tuple(legs), np.zeros(3))
    assert len(ways) == len(legs)
    for way in ways:
        for before, after in pairwise(way.pieces):
            np.testing.assert_array_equal(before.points_m[-1], after.points_m[0])
        for piece in way.pieces:
            each = ground.maps[piece.sheet]
            inner = np.concatenate(
                [a + (b - a) * np.linspace(0, 1, 400)[:, None] for a, b in pairwise(piece.points_m)]
            )[1:-1, :2]
            index = (inner - each.low_m) / each.cell_m
            inside = (np.abs(index - np.round(index)) > 1e-6).all(axis=1)  # borders belong to either side
            x, y = np.floor(index[inside]).astype(int).T
            assert (each.cells[y, x] == FREE).all()


def test_of_free_neighbours_none_is_a_step_too_high(ground: MappedGround) -> None:
    space = ground.space
    for sheet, each in enumerate(ground.maps):
        z = heights(space, ground.sheets.of_node == sheet)
        free = each.cells == FREE
        assert not np.isnan(z[free]).any()
        for dx, dy in AROUND:
            here, there = (
                (slice(max(-d, 0), z.shape[k] - max(d, 0)) for k, d in ((0, dy), (1, dx))),
                (slice(max(d, 0), z.shape[k] - max(-d, 0)) for k, d in ((0, dy), (1, dx))),
            )
            a, b = tuple(here), tuple(there)
            both = free[a] & free[b]
            assert (np.abs(z[a][both] - z[b][both]) <= space.carrier.step_m + 2e-3).all()


def heights(space: FreeSpace, shown: np.ndarray) -> np.ndarray:
    """(ny, nx) ground of the nodes shown, NaN elsewhere."""
    z = np.full((space.grid.ny, space.grid.nx), np.nan)
    z.flat[space.column[shown]] = space.ground_m[shown]
    return z
