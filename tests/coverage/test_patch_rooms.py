"""Rooms of patches against the boxes that the house is built of, and regions of free floor against its rooms."""

import json
from dataclasses import replace

import numpy as np
import pytest
from shared_plans import SharedPlan

from planner_core.coverage.patch_rooms import rooms_of_patches
from planner_core.engine.patch_samples import places_of
from planner_core.model import FloatArray, PlanRooms, Survey
from planner_core.plan_folder.carry_over import foreign_entries
from planner_core.positions.free_space import FreeSpace, free_space

#: Linings lie before the bare wall that a room of the source ends at, and patches reach into doorways.
_BEYOND_M = 0.3


@pytest.fixture(scope="module")
def survey(house_plan: SharedPlan) -> Survey:
    return house_plan.plan.survey


@pytest.fixture(scope="module")
def space(survey: Survey) -> FreeSpace:
    return free_space(survey, cell_m=0.1)


@pytest.fixture(scope="module")
def centroids_m(survey: Survey) -> FloatArray:
    every = np.arange(survey.patches.n_patches, dtype=np.int32)
    return places_of(survey.scene, survey.patches, every).corners_m.mean(axis=1)


def test_patches_lie_in_the_rooms_of_the_source_and_those_not_required_in_none(
    survey: Survey, space: FreeSpace, centroids_m: FloatArray
) -> None:
    required = np.ones(survey.patches.n_patches, dtype=bool)
    required[::7] = False
    found = rooms_of_patches(survey, space, required)
    by_id = {room.source_id: room for room in survey.scene.rooms}
    assert {room.source_id for room in found.rooms} == set(by_id)
    assert (found.room_of_patch[::7] == -1).all()
    for number, room in enumerate(found.rooms):
        source = by_id[room.source_id]
        inside = centroids_m[found.room_of_patch == number]
        assert room.name == source.title and inside.size
        low_m, high_m = source.box_m
        assert ((inside >= low_m - _BEYOND_M) & (inside <= high_m + _BEYOND_M)).all(), room.name
        np.testing.assert_array_equal(room.box_m, [inside.min(axis=0), inside.max(axis=0)])
        assert (low_m[:2] <= room.label_m[:2]).all() and (room.label_m[:2] <= high_m[:2]).all(), room.name
        floor = next(floor for floor in survey.floors if floor.id == room.floor)
        assert abs(room.label_m[2] - floor.elevation_m) < 0.1


def test_regions_of_free_floor_are_each_of_one_room_of_a_house_whose_file_names_none(
    survey: Survey, space: FreeSpace
) -> None:
    required = np.ones(survey.patches.n_patches, dtype=bool)
    of_source = rooms_of_patches(survey, space, required)
    nameless = replace(survey, scene=replace(survey.scene, rooms=()))
    regions = rooms_of_patches(nameless, space, required)
    assert {(room.name, room.source_id) for room in regions.rooms} == {("", "")}
    area_m2 = survey.patches.area_m2
    both = (of_source.room_of_patch >= 0) & (regions.room_of_patch >= 0)
    assert area_m2[both].sum() > 0.9 * area_m2[of_source.room_of_patch >= 0].sum()
    # Open stairs and long halls are several regions; none is more than one room, but for the surfaces in its doorways.
    together = np.zeros((len(regions.rooms), len(of_source.rooms)))
    np.add.at(together, (regions.room_of_patch[both], of_source.room_of_patch[both]), area_m2[both])
    assert together.max(axis=1).sum() > 0.9 * together.sum(), together.round(1)


def test_a_plan_folder_has_the_rooms_by_patch(house_plan: SharedPlan) -> None:
    viewer, rooms = house_plan.folder / "viewer", house_plan.plan.rooms
    assert isinstance(rooms, PlanRooms)
    written = json.loads((viewer / "layers.json").read_text())["rooms"]
    of_patch = np.frombuffer((viewer / written["file"]).read_bytes(), dtype="<u2").astype(np.int64)
    np.testing.assert_array_equal(np.where(of_patch == written["none"], -1, of_patch), rooms.room_of_patch)
    assert [room["name"] for room in written["list"]] == [room.name for room in rooms.rooms]
    # It is the plan's own file: replaced with it, and in copies for the web.
    assert f"viewer/{written['file']}" not in foreign_entries(house_plan.folder)
    np.testing.assert_allclose([room["label"] for room in written["list"]], [r.label_m for r in rooms.rooms], atol=6e-4)
