"""Candidates between parts of the network: found where one walks from part to part, and only where they join these."""

from dataclasses import replace

import numpy as np
import pytest
from stages import find_positions, make_pool

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, FloatArray, PlacedDoor, PlanSettings, PriorStation, Proven, Role
from planner_core.planning import between_parts
from planner_core.planning.between_parts import with_joining_candidates
from planner_core.planning.plan import _beside_the_survey
from planner_core.planning.pool import Pool
from planner_core.positions.allowed_positions import KINDS, AllowedPositions
from planner_core.scanner.load_scanner import load_scanner

pytestmark = pytest.mark.opencl
#: In scene coordinates.
DOOR_M = np.array([4.06, 2.0])


class Nowhere:
    """A scope that admits no station."""

    outdoors_m = 0.0

    def admits(self, ground_m: FloatArray) -> BoolArray:
        return np.zeros(len(ground_m), dtype=bool)


@pytest.fixture(scope="module")
def two_rooms() -> tuple[Pool, AllowedPositions, ScanEngine]:
    """Two rooms without candidates within a metre of the door between them: two parts."""
    scene = scenes_synthetic.build("two-rooms").scene
    settings = PlanSettings(scanner=load_scanner("hdl-64e"), method=Proven(), max_patch_area_m2=0.2)
    survey = make_survey(scene, settings)
    engine = open_engine(survey.scene, survey.patches, engine="opencl")
    places = find_positions(survey, settings, engine)
    plan_m = places.candidates.position_m[:, :2]
    door_m = plan_m[places.kind == KINDS.index("doorway")][0]
    places = places.keeping(np.flatnonzero(np.linalg.norm(plan_m - door_m, axis=1) > 1.0))
    none = np.zeros(0, dtype=np.int64)
    return make_pool(survey, settings, engine, places.candidates, given=none, kept=none), places, engine


def n_parts(pool: Pool) -> int:
    assert pool.links is not None
    return np.unique(pool.links.part[~pool.excluded]).size


@pytest.mark.slow
def test_places_in_a_doorway_without_candidates_join_two_rooms(
    two_rooms: tuple[Pool, AllowedPositions, ScanEngine],
) -> None:
    pool, places, engine = two_rooms
    assert n_parts(pool) == 2
    joined = with_joining_candidates(pool, places, engine)
    assert n_parts(joined) == 1
    more_m = joined.candidates.position_m[pool.n_candidates :, :2] + pool.survey.scene.offset_m[:2]
    assert (np.linalg.norm(more_m - DOOR_M, axis=1) < 2.2).all()
    assert joined.links is not None and pool.links is not None
    for row in range(pool.n_candidates, joined.n_candidates):
        linked = joined.links.neighbour[joined.links.row(row)]
        assert set(pool.links.part[linked[linked < pool.n_candidates]].tolist()) == {0, 1}, "each joins by itself"
    assert joined.constraints is pool.constraints, "places that come later change no requirement"
    assert with_joining_candidates(joined, places, engine) is joined, "one part has nothing to join"


@pytest.mark.slow
def test_they_may_be_out_of_scope_but_not_where_nobody_may_stand(
    two_rooms: tuple[Pool, AllowedPositions, ScanEngine], monkeypatch: pytest.MonkeyPatch
) -> None:
    pool, places, engine = two_rooms
    unsurveyed = replace(places, site=replace(places.site, scope=Nowhere()))
    assert n_parts(with_joining_candidates(pool, unsurveyed, engine)) == 1
    monkeypatch.setattr(type(places.site), "in_zone", lambda _, plan_m, __: np.ones(len(plan_m), dtype=bool))
    assert with_joining_candidates(pool, places, engine) is pool


def test_stations_out_of_scope_are_named_but_not_those_that_somebody_gave(
    two_rooms: tuple[Pool, AllowedPositions, ScanEngine],
) -> None:
    pool, places, _ = two_rooms
    at, given = pool.take(np.arange(3)), PriorStation("G1", (0.0, 0.0, 1.6), Role.LOCKED)
    unsurveyed = replace(places.site, scope=Nowhere(), prior=(given,))
    (line,) = _beside_the_survey(unsurveyed, at, ["S002", "G1", "S001"])
    assert line.startswith("stations S001, S002 stand out of scope, on the way between parts of the survey")
    assert not list(_beside_the_survey(places.site, at, ["S001", "S002", "S003"]))


def test_nothing_is_tried_in_a_shut_door(
    two_rooms: tuple[Pool, AllowedPositions, ScanEngine], monkeypatch: pytest.MonkeyPatch
) -> None:
    """People open it on their way; scans do not pass."""
    pool, places, engine = two_rooms
    foot_m, half_m = np.append(DOOR_M, 0.0) - pool.survey.scene.offset_m, np.array([0.1, 0.5, 0.0])
    door = PlacedDoor(0, np.stack([foot_m - half_m, foot_m + half_m]), np.array([1.0, 0.0]))
    monkeypatch.setattr(between_parts, "placed_doors", lambda scene: [door])
    monkeypatch.setattr(between_parts, "rows_from", lambda *_, **__: pytest.fail("scans in a shut door"))
    assert with_joining_candidates(pool, places, engine) is pool
