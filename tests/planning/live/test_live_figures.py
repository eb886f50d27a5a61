"""Figures of a draft: those of plan.json for the plan as it is, and what is lost with a station."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shared_plans import SETTINGS, SharedPlan
from slow_cases import all_slow_but

from planner_core.errors import PlanFolderError
from planner_core.model import REASONS, Plan, PlanSettings
from planner_core.model.unseen import NOT_WORTH
from planner_core.plan_folder.plan_json import plan_document
from planner_core.planning.live.figures import MIN_LISTED_M2
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live

Planned = Callable[[str, PlanSettings], tuple[Path, Plan]]


def close(found: Any, expected: Any, *, where: str = "") -> None:
    """Assert that two documents are the same but for rounding of figures."""
    assert type(found) is type(expected) or isinstance(found, int | float), where
    if isinstance(expected, dict):
        assert list(found) == list(expected), where
        for key, value in expected.items():
            close(found[key], value, where=f"{where}/{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for index, value in enumerate(expected):
            close(found[index], value, where=f"{where}/{index}")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, abs=2e-6), where
    else:
        assert found == expected, where


def assert_figures_are_of(live: LivePlan, document: dict[str, Any]) -> None:
    figures = live.figures(live.draft)
    found = plan_document(figures.plan)
    gaps = [{**gap, "targets": []} for gap in document["registration"]["gaps"]]  # drafts look for none, nor for joins
    document = {**document, "registration": {**document["registration"], "gaps": gaps, "joins": []}}
    for key in ("coverage", "stations", "registration", "unseen"):
        close(found[key], document[key], where=key)
    on_marks = [
        {name: value for name, value in each.items() if name != "as_set_up"}
        for each in document["requirements"]["results"]
    ]
    close(found["requirements"]["results"], on_marks, where="results")
    assert [step.station for step in figures.curve] == [step["station"] for step in document["why"]["curve"]]
    close(
        [step.covered_area_m2 for step in figures.curve],
        [step["covered_area_m2"] for step in document["why"]["curve"]],
        where="curve",
    )


@pytest.mark.slow
def test_parts_of_patches_count_as_in_the_plan(planned: Planned, tmp_path: Path) -> None:
    """By samples, a patch counts as far as candidates see it, which the folder keeps."""
    without = replace(SETTINGS["house"].requirements, network="none")  # whose stations join may stand off the grid
    written, plan = planned("two-rooms", replace(SETTINGS["house"], refine=False, requirements=without))
    folder, scene = shutil.copytree(written, tmp_path / "plan"), written.parent / "two-rooms.ifc"
    counted = plan.survey.patches.countable_share
    assert counted is not None
    assert 0 < (counted < 255).mean() < 0.5
    assert (folder / "viewer" / "counted.u8").read_bytes() == counted.tobytes()
    (folder / "viewer" / "achievable.u8").unlink()  # then positions are looked around from again
    live = open_live(folder, scene=scene, with_ground=False)
    assert_figures_are_of(live, live.document)
    (folder / "viewer" / "counted.u8").unlink()
    live = open_live(folder, scene=scene, with_ground=False)
    assert live.figures(live.draft).plan.coverage.covered_area_m2 == pytest.approx(plan.coverage.covered_area_m2)


def test_targets_join_stations_of_a_draft_and_of_a_preview_as_of_the_plan(planned: Planned) -> None:
    required = replace(SETTINGS["house"].requirements, min_strength=0.5, targets=True)
    settings = replace(SETTINGS["house"], refine=False, set_up_tolerance_m=0.0, requirements=required)
    folder, plan = planned("two-rooms", settings)
    assert plan.connected and any(link.targets_m for link in plan.links)
    live = open_live(folder, scene=folder.parent / "two-rooms.ifc", with_ground=False)
    assert_figures_are_of(live, live.document)
    last = live.draft.stations[-1]
    preview = live.preview(live.draft, last.id, last.floor, last.position_m, last.instrument_height_m or 1.7)
    assert preview.registration.connected
    assert any(link.targets_m for link in preview.links)


@pytest.mark.parametrize("name", all_slow_but(["house"], ["house", "far_plan", "asking_house"]))
def test_figures_of_the_unchanged_plan_are_those_of_plan_json(name: str, request: pytest.FixtureRequest) -> None:
    live: LivePlan = request.getfixturevalue(name)
    assert len(live.draft.stations) > 1
    assert_figures_are_of(live, live.document)


@pytest.mark.parametrize("name", all_slow_but(["house"], ["house", "far_plan"]))
def test_places_off_the_grid_have_the_figures_of_the_plan_to_the_last_bit(
    name: str, house_plan: SharedPlan, request: pytest.FixtureRequest
) -> None:
    live: LivePlan = request.getfixturevalue(name)
    plan = house_plan.plan if name == "house" else request.getfixturevalue("far")[1]
    steps = np.array([station.position_m[:2] for station in plan.stations]) / plan.settings.grid_step_m
    off_grid = np.abs(2 * steps - np.round(2 * steps)).max(axis=1) > 0.01
    assert off_grid.any()
    found = live.figures(live.draft).plan
    for station, again in zip(plan.stations, found.stations, strict=True):
        assert again.position_m.tobytes() == station.position_m.tobytes()
        assert again.covered_area_m2 == station.covered_area_m2
        assert again.own_area_m2 == station.own_area_m2
    assert found.coverage == plan.coverage
    assert found.coverage_by_floor == plan.coverage_by_floor
    assert found.links == plan.links


@pytest.mark.slow
def test_what_is_left_unseen_is_what_the_plan_holds_not_worth_a_station(
    planned: Planned, asking: PlanSettings, asking_house: LivePlan
) -> None:
    _, plan = planned("house", asking)
    found = asking_house.figures(asking_house.draft).unseen
    assert plan.why is not None
    reason = REASONS[NOT_WORTH]
    expected = [each for each in plan.why.unseen if each.reason == reason and each.area_m2 >= MIN_LISTED_M2]
    assert len(expected) > 20
    left = {(each.element, each.room, each.floor): each for each in found}
    assert len(left) == len(found)
    assert [each.area_m2 for each in found] == sorted((each.area_m2 for each in found), reverse=True)
    for surface in expected[:20]:
        same = left[(surface.element, surface.room, surface.floor)]
        assert same.area_m2 == pytest.approx(surface.area_m2)
        assert same.n_pieces == surface.n_pieces
        assert [piece.patch for piece in same.pieces] == [piece.patch for piece in surface.pieces]
        np.testing.assert_allclose(same.pieces[0].centroid_m, surface.pieces[0].centroid_m)
        np.testing.assert_array_equal(same.pieces[0].box_m, surface.pieces[0].box_m)


def test_what_stations_see_together_is_a_bit_a_patch(house: LivePlan) -> None:
    times_seen = house.figures(house.draft).plan.times_seen
    bits = [np.frombuffer(house.seen(house.draft, name), np.uint8) for name in house.draft.ids]
    seen = np.unpackbits(np.stack(bits), axis=1, count=times_seen.size, bitorder="little")
    np.testing.assert_array_equal(seen.sum(axis=0), times_seen)


@pytest.mark.slow
def test_what_stations_see_within_the_limits_of_all_follows_as_often_as_it_is_counted(asking_house: LivePlan) -> None:
    live, plan = asking_house, asking_house.figures(asking_house.draft).plan
    bits = np.stack([np.frombuffer(live.seen(live.draft, name), np.uint8) for name in live.draft.ids])
    rows = np.unpackbits(bits.reshape(len(bits), 2, -1), axis=2, count=plan.times_seen.size, bitorder="little")
    np.testing.assert_array_equal(rows[:, 1].sum(axis=0), plan.times_seen)
    assert (rows[:, 0] >= rows[:, 1]).all()
    assert rows[:, 0].sum() > rows[:, 1].sum()


@pytest.mark.slow
def test_station_taken_away_leaves_what_it_alone_saw(house: LivePlan) -> None:
    live = house
    whole = live.figures(live.draft).plan
    for station in whole.stations[:3]:
        rest = live.figures(live.draft.without(station.id))
        lost_m2 = whole.coverage.covered_area_m2 - rest.plan.coverage.covered_area_m2
        # One definition: what is its own is what coverage loses, and nothing that no candidate sees.
        assert lost_m2 == pytest.approx(station.own_area_m2, abs=1e-9)
        losses = dict(zip((each.id for each in whole.stations), whole.losses, strict=True))[station.id]
        assert losses[-1].area_m2 == pytest.approx(station.own_area_m2, abs=1e-9)
        assert station.id not in {end for link in rest.plan.links for end in (link.a, link.b)}
        kept = {other.id: other.covered_area_m2 for other in whole.stations if other.id != station.id}
        assert {other.id: other.covered_area_m2 for other in rest.plan.stations} == pytest.approx(kept)


@pytest.mark.slow
def test_folder_without_what_is_achievable_is_scanned_again(asking_folder: Path, asking_house: LivePlan) -> None:
    file = asking_folder / "viewer" / "achievable.u8"
    content = file.read_bytes()
    file.unlink()
    try:
        found = open_live(asking_folder)
    finally:
        file.write_bytes(content)
    close(
        plan_document(found.figures(found.draft).plan)["requirements"]["results"],
        plan_document(asking_house.figures(asking_house.draft).plan)["requirements"]["results"],
    )


def test_folders_that_do_not_fit_their_scene_are_refused(house_plan: SharedPlan, tmp_path: Path) -> None:
    folder, scene = house_plan.folder, house_plan.scene_file
    short = shutil.copytree(folder, tmp_path / "short")
    (short / "viewer" / "achievable.u8").write_bytes(b"\0" * 10)
    with pytest.raises(PlanFolderError, match="10 bytes, expected 1 x"):
        open_live(short, scene=scene)
    other = shutil.copytree(folder, tmp_path / "other")
    document = json.loads((other / "plan.json").read_text())
    document["settings"]["n_patches"] += 1
    (other / "plan.json").write_text(json.dumps(document))
    with pytest.raises(PlanFolderError, match="another version"):
        open_live(other, scene=scene)
    with pytest.raises(PlanFolderError, match="--scene"):
        open_live(short, scene=tmp_path / "nothing.ifc")
