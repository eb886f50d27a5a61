"""Places of targets, on the walls of a room that two sensors see in part; which pairs of many have such places."""

import itertools
from types import SimpleNamespace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.model import Element, Link, Requirements, Visibility
from planner_core.network.links import SharedSurface
from planner_core.network.targets import joined_by_targets, target_pairs, target_places
from planner_core.scanner.load_scanner import load_scanner

ROOM_M = (8.0, 6.0, 3.0)


class InPlainView:
    """Nothing is between anything."""

    def cast_rays(self, origin_m, direction, *, range_max_m):
        return SimpleNamespace(range_m=np.linalg.norm(direction, axis=1))


def a_survey():
    """Each patch a triangle of its own, of a wall."""
    patches = SimpleNamespace(
        triangle_of_patch=np.arange(ALL.size),
        first_patch=np.arange(ALL.size + 1),
        area_m2=np.full(ALL.size, 0.0625),
        triangle_area_m2=np.full(ALL.size, 0.0625),
    )
    scene = SimpleNamespace(
        elements=[Element("wall", "IfcWall", "1", 0)],
        element_of_triangle=np.zeros(ALL.size, dtype=np.int32),
        open_doors=(),
    )
    return SimpleNamespace(scene=scene, patches=patches, scanner=load_scanner("rtc360"))


def everything(_sensor_m, places_m):
    return np.ones(len(places_m), dtype=bool)


SENSORS_M = np.array([[2.0, 2.0, 1.6], [5.0, 4.0, 1.9]])


def room() -> SharedSurface:
    """A patch each 0.25 m of floor, ceiling and walls of a room."""
    centroids, normals = [], []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        steps = [np.arange(0.125, ROOM_M[k], 0.25) for k in others]
        grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        for end in (0.0, ROOM_M[axis]):
            at = np.empty((len(grid), 3))
            at[:, axis], at[:, others] = end, grid
            centroids.append(at)
            normals.append(np.tile(np.eye(3)[axis], (len(grid), 1)))
    return SharedSurface(np.concatenate(centroids), np.concatenate(normals))


ROOM = room()
ALL = np.ones(len(ROOM.centroid_m), dtype=bool)


def off_line_m(places_m: np.ndarray) -> float:
    """Least height of the triangle, by Heron's formula."""
    sides = [float(np.linalg.norm(places_m[i] - places_m[i - 1])) for i in range(3)]
    half = sum(sides) / 2
    area = np.sqrt(max(half * np.prod([half - side for side in sides]), 0.0))
    return float(2 * area / max(sides))


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), share=st.floats(0.002, 1.0), turn=st.floats(0.0, 6.28))
def test_targets_hang_on_common_walls_where_both_measure_them_well_and_hold_a_scan(seed, share, turn):
    common = np.random.default_rng(seed).random(ALL.size) < share
    places_m = target_places(common, ROOM, SENSORS_M, everything)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    turned = SharedSurface(ROOM.centroid_m @ rotation.T, ROOM.normal @ rotation.T)
    assert target_places(common, turned, SENSORS_M @ rotation.T, everything) == pytest.approx(
        places_m @ rotation.T, abs=1e-9
    )
    if not places_m.size:
        return
    for place_m in places_m:
        patch = int(np.linalg.norm(ROOM.centroid_m - place_m, axis=1).argmin())
        assert common[patch]
        assert ROOM.centroid_m[patch] == pytest.approx(place_m)
        assert ROOM.normal[patch, 2] == 0.0
        assert 0.4 <= place_m[2] <= 2.7
        for sensor_m in SENSORS_M:
            away_m = place_m - sensor_m
            cosine = abs(away_m @ ROOM.normal[patch]) / np.linalg.norm(away_m)
            assert np.degrees(np.arccos(cosine)) <= 60.0 + 1e-6
    assert off_line_m(places_m) >= 0.75 - 1e-9


def hold_by_definition(places_m: np.ndarray, sensors_m: np.ndarray) -> bool:
    """Two of three targets are apart by 3 m and 0.6 times the range, level; the third is 0.75 m off their line."""
    first, second, _ = places_m
    range_m = np.linalg.norm(sensors_m - (first + second) / 2, axis=1).max()
    return np.hypot(*(second - first)[:2]) >= max(3.0, 0.6 * range_m) and off_line_m(places_m) >= 0.75 - 1e-9


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), share=st.floats(0.0005, 0.05))
def test_pairs_of_many_are_those_whose_common_patches_hold_three(seed, share):
    random = np.random.default_rng(seed)
    # Heights alike, so that the reach of a pair is that of each.
    position_m = np.column_stack([random.uniform(0.5, 7.5, 6), random.uniform(0.5, 5.5, 6), np.full(6, 1.6)])
    rows = [np.flatnonzero(random.random(ALL.size) < share).astype(np.int32) for _ in position_m]
    common = np.flatnonzero(random.random(ALL.size) < share).astype(np.int32)  # else few have any in common
    rows = [np.union1d(row, common).astype(np.int32) for row in rows]
    starts = np.concatenate([[0], np.cumsum([row.size for row in rows])]).astype(np.int64)
    seen, survey, engine = Visibility(starts, np.concatenate(rows), ALL.size), a_survey(), InPlainView()
    part = np.array([0, 0, 1, 2, 2, 3], dtype=np.int32)
    found = set(map(tuple, target_pairs(seen, ROOM, survey, engine, position_m, part).tolist()))
    for one, other in itertools.combinations(range(6), 2):
        both = np.zeros_like(ALL)
        both[np.intersect1d(rows[one], rows[other])] = True
        sensors_m = position_m[[one, other]]
        places_m = target_places(both, ROOM, sensors_m, everything, makes_link=True)
        assert ((one, other) in found) == (part[one] != part[other] and places_m.size > 0)
        assert not places_m.size or hold_by_definition(places_m, sensors_m)


def test_targets_join_all_that_is_apart_by_as_few_pairs_and_a_pair_is_listed_once():
    """As a draft lists links: of the station that is moved first, though it is the last."""
    position_m = np.array([[1.0, 1.0, 1.6], [7.0, 1.0, 1.6], [4.0, 5.0, 1.6], [4.0, 3.0, 1.6]])
    ids, wall = ("S001", "S002", "S003", ""), np.flatnonzero(ROOM.centroid_m[:, 1] == ROOM_M[1]).astype(np.int32)
    seen = Visibility(np.arange(5) * wall.size, np.tile(wall, 4), ALL.size)
    strong, weak = Link("S001", "S002", 0.9, 0.5, probability=1.0), Link("", "S001", 0.9, 0.0, probability=0.1)
    of = (a_survey(), Requirements(), seen, ROOM, ids, position_m, InPlainView())
    joined = joined_by_targets((strong, weak), *of)
    assert len({frozenset((link.a, link.b)) for link in joined}) == len(joined)
    assert joined[0] == strong
    by_targets = [link for link in joined if link.targets_m]
    graph = nx.Graph([(link.a, link.b) for link in (strong, *by_targets)])
    assert len(by_targets) == 2 and set(graph) == set(ids) and nx.is_connected(graph)
    for link in by_targets:
        sensors_m = position_m[[ids.index(link.a), ids.index(link.b)]]
        assert hold_by_definition(np.array(link.targets_m), sensors_m)
        assert link.counts(Requirements().link_limits)
    assert joined_by_targets(joined, *of) == joined


def test_no_target_hangs_on_a_face_that_is_smaller_than_it():
    position_m = np.array([[1.0, 1.0, 1.6], [7.0, 5.0, 1.6]])
    seen = Visibility(np.array([0, 1, 2]) * ALL.size, np.tile(np.arange(ALL.size, dtype=np.int32), 2), ALL.size)
    survey, part = a_survey(), np.arange(2, dtype=np.int32)
    assert target_pairs(seen, ROOM, survey, InPlainView(), position_m, part).tolist() == [[0, 1]]
    survey.patches.triangle_area_m2 = np.full(ALL.size, 0.01)
    assert target_pairs(seen, ROOM, survey, InPlainView(), position_m, part).size == 0


def test_a_whole_room_has_targets_that_are_far_apart():
    places_m = target_places(ALL, ROOM, SENSORS_M, everything)
    assert off_line_m(places_m) > 3.0


@pytest.mark.parametrize(
    "common",
    [
        np.zeros_like(ALL),
        ROOM.normal[:, 2] != 0.0,  # floor and ceiling
        np.linalg.norm(ROOM.centroid_m - [0.0, 2.0, 1.5], axis=1) < 0.7,  # too near to each other
        (ROOM.centroid_m[:, 0] == 0.0) & (np.abs(ROOM.centroid_m[:, 2] - 1.375) < 0.01),  # on one line
        np.linalg.norm(ROOM.centroid_m[:, :2] - [8.0, 0.0], axis=1) < 0.3,  # two walls, seen askew from afar
    ],
)
def test_there_are_none_where_none_would_hold(common):
    assert target_places(common, ROOM, SENSORS_M, everything).shape == (0, 3)


def test_there_are_none_out_of_sight_of_a_target():
    far_m = SENSORS_M[1] + np.array([0.0, 25.0, 0.0])
    assert target_places(ALL, ROOM, np.stack([SENSORS_M[0], far_m]), everything).shape == (0, 3)


def test_there_are_none_that_something_hides():
    def behind(_sensor_m, places_m):
        return places_m[:, 0] < 4.0

    places_m = target_places(ALL, ROOM, SENSORS_M, behind)
    assert (places_m[:, 0] < 4.0).all()
    assert off_line_m(places_m) > 2.0
