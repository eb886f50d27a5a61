"""Previews: what is worked out on a few patches is what the figures of the changed draft say of all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles import observations_from
from shared_plans import SharedPlan

from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import PointLimits
from planner_core.planning.live.draft import Draft, DraftStation
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live
from planner_core.planning.live.pairs import PairFinder
from planner_core.planning.live.preview import Preview
from planner_core.planning.live.station_observations import StationObserver

EASY = settings(
    max_examples=15,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
share = st.floats(0.0, 1.0, allow_nan=False)


@pytest.fixture(params=["plain", "asking"])
def live(request: pytest.FixtureRequest) -> LivePlan:
    name = {"plain": "house", "asking": "asking_house"}[request.param]
    found: LivePlan = request.getfixturevalue(name)
    return found


def somewhere(live: LivePlan, floor: int, x: float, y: float) -> tuple[float, float]:
    """A place of the floor's bounds, and a little beyond, by shares of them."""
    low, high = live.survey.floors[floor].bounds_m
    at_m = low - 0.5 + np.array([x, y]) * (high - low + 1.0)
    return float(at_m[0]), float(at_m[1])


def assert_is_of_its_draft(live: LivePlan, before: Draft, preview: Preview, layer: str) -> None:
    figures = live.figures(preview.draft).plan
    station = next(each for each in figures.stations if each.id == preview.station.id)
    for found, expected in zip(
        (preview.overall, *preview.floors), (figures.coverage, *figures.coverage_by_floor), strict=True
    ):
        assert found.achievable_area_m2 == pytest.approx(expected.achievable_area_m2, abs=1e-9)
        assert found.covered_area_m2 == pytest.approx(expected.covered_area_m2, abs=1e-9)
        assert found.total_area_m2 == pytest.approx(expected.total_area_m2, abs=1e-9)
    for found, result in zip(preview.goals, figures.requirements, strict=True):
        assert found.achievable_area_m2 == pytest.approx(result.achievable_area_m2, abs=1e-9)
        assert found.covered_area_m2 == pytest.approx(result.covered_area_m2, abs=1e-9)
    assert preview.covered_m2 == pytest.approx(station.covered_area_m2, abs=1e-9)
    assert preview.own_m2 == pytest.approx(station.own_area_m2, abs=1e-9)
    mine = {frozenset((link.a, link.b)): link for link in figures.links if preview.station.id in (link.a, link.b)}
    assert {frozenset((link.a, link.b)) for link in preview.links} == set(mine)
    for link in preview.links:
        same = mine[frozenset((link.a, link.b))]
        assert (link.overlap, link.strength, link.weak_motion) == (same.overlap, same.strength, same.weak_motion)
    assert preview.registration.connected == figures.connected
    networks = {frozenset(network.stations) for network in preview.registration.networks}
    assert networks == {frozenset(network.stations) for network in figures.registration.networks}
    # Painting the difference over the old draft gives the new one.
    times, values = live.times_seen(before), live.layer(before, layer)
    assert (np.diff(preview.patch.astype(np.int64)) > 0).all()
    assert ((times[preview.patch] != preview.times_seen) | (values[preview.patch] != preview.values)).all()
    times[preview.patch], values[preview.patch] = preview.times_seen, preview.values
    np.testing.assert_array_equal(times, live.times_seen(preview.draft))
    np.testing.assert_array_equal(values, live.layer(preview.draft, layer))


@EASY
@given(
    which=st.integers(0, 100),
    x=share,
    y=share,
    layer=st.sampled_from(["times_seen", "range", "incidence", "spacing"]),
)
def test_preview_of_a_moved_station_is_what_its_draft_is_worth(
    live: LivePlan, which: int, x: float, y: float, layer: str
) -> None:
    station = live.draft.stations[which % len(live.draft.stations)]
    floor = [each.id for each in live.survey.floors].index(station.floor)
    preview = live.preview(live.draft, station.id, station.floor, somewhere(live, floor, x, y), 1.5, layer=layer)
    assert_is_of_its_draft(live, live.draft, preview, layer)


@pytest.mark.slow
@EASY
@given(moves=st.lists(st.tuples(st.integers(0, 100), share, share), min_size=2, max_size=4), x=share, y=share)
def test_preview_of_a_new_station_is_what_its_draft_is_worth_after_any_moves(
    house: LivePlan, moves: list[tuple[int, float, float]], x: float, y: float
) -> None:
    draft = house.draft
    for which, to_x, to_y in moves:
        station = draft.stations[which % len(draft.stations)]
        floor = [each.id for each in house.survey.floors].index(station.floor)
        draft = house.preview(draft, station.id, station.floor, somewhere(house, floor, to_x, to_y), 1.4).draft
    preview = house.preview(draft, None, "F1", somewhere(house, 1, x, y), 1.5, layer="spacing")
    assert len(preview.draft.stations) == len(draft.stations) + 1
    assert_is_of_its_draft(house, draft, preview, "spacing")


def test_preview_where_the_station_stands_changes_nothing(house: LivePlan) -> None:
    for station in house.draft.stations[:3]:
        assert station.instrument_height_m is not None
        preview = house.preview(
            house.draft, station.id, station.floor, station.position_m, station.instrument_height_m, layer="range"
        )
        moved_m = np.abs(preview.station.at_m - station.at_m).max()
        assert moved_m <= 1e-4  # places are rounded
        if moved_m == 0:
            assert preview.patch.size == 0


@pytest.mark.slow
def test_preview_does_not_depend_on_what_was_asked_before(house_plan: SharedPlan, house: LivePlan) -> None:
    station = house.draft.stations[0]
    where = somewhere(house, 0, 0.4, 0.6)
    later = house.preview(house.draft, station.id, "F0", where, 1.5, layer="spacing")
    first = open_live(house_plan.folder).preview(house.draft, station.id, "F0", where, 1.5, layer="spacing")
    np.testing.assert_array_equal(later.patch, first.patch)
    np.testing.assert_array_equal(later.values, first.values)
    assert (later.overall, later.own_m2, later.links, later.spot) == (
        first.overall,
        first.own_m2,
        first.links,
        first.spot,
    )


def test_station_dragged_to_and_fro_is_scanned_once_a_place(house: LivePlan) -> None:
    station = house.draft.stations[0]
    places = [somewhere(house, 0, 0.2, 0.3), somewhere(house, 0, 0.25, 0.3)]
    for where in places:
        house.preview(house.draft, station.id, "F0", where, 1.5)
    before = house.n_scans
    for where in places * 3:
        house.preview(house.draft, station.id, "F0", where, 1.5)
    assert house.n_scans == before


@pytest.mark.slow
def test_draft_without_stations_covers_nothing(house: LivePlan) -> None:
    figures = house.figures(Draft(()))
    assert figures.plan.coverage.covered_area_m2 == 0
    assert figures.plan.coverage.achievable_area_m2 == house.figures(house.draft).plan.coverage.achievable_area_m2
    assert figures.curve == ()
    assert figures.plan.connected
    assert len(figures.unseen) > 0
    preview = house.preview(Draft(()), None, "F0", somewhere(house, 0, 0.5, 0.5), 1.5)
    assert preview.overall.covered_area_m2 > 0
    assert preview.links == ()


def test_walk_through_a_draft_leaves_out_what_is_scanned(house: LivePlan) -> None:
    stations = house.draft.stations
    whole = house.walk(house.draft)
    assert sorted(whole.route.order.tolist()) == list(range(len(stations)))
    done = Draft((replace(stations[0], fixed=True), *stations[1:]))
    rest = house.walk(done)
    assert 0 not in {end for leg in rest.route.legs for end in (leg.a, leg.b)}
    assert rest.field_time.set_up_s == whole.field_time.set_up_s * (len(stations) - 1) / len(stations)
    nobody = house.walk(Draft(()))
    assert nobody.route.length_m == 0
    assert nobody.field_time.total_s in (0.0, None)


@pytest.mark.slow
def test_walk_begins_at_the_entrance_of_the_review(house: LivePlan) -> None:
    ground_m = house.reach.space.position_m(np.flatnonzero(house.reach.reached_node))
    offset_m = house.survey.scene.offset_m
    assert house.walk(house.draft).route.start_m is None
    for at_m in (ground_m[0], ground_m[-1]):
        x, y, z = (at_m + offset_m).tolist()
        walk = house.walk(replace(house.draft, entrances_m=((x, y, z), tuple((ground_m[5] + offset_m).tolist()))))
        assert walk.route.start_m == pytest.approx(at_m)
        assert walk.route.legs[0].a == -1
        np.testing.assert_allclose(walk.route.legs[0].points_m[0], at_m, atol=0.3)


def test_looks_of_a_draft_are_held_where_few_can_be_remembered(house_plan: SharedPlan) -> None:
    live = open_live(house_plan.folder)
    live._observer = StationObserver(live.survey, live._engine, live._demand.goals.qualities, kept_bytes=1)
    station = live.draft.stations[0]
    for x in (0.2, 0.3):
        live.preview(live.draft, station.id, "F0", somewhere(live, 0, x, 0.5), 1.5)
    assert live.n_scans == 2


# ------------------------------------------------------------------------------------------- against other code
@pytest.mark.slow
def test_links_are_the_same_from_either_end(house: LivePlan) -> None:
    survey = house.survey
    engine = open_engine(survey.scene, survey.patches)
    observer = StationObserver(survey, engine, (PointLimits(),))
    stations = [(each.id, observer.observe(each.position_m)) for each in house.draft.stations]
    none_known = np.zeros(survey.patches.n_patches, dtype=bool)
    forth = PairFinder(survey, survey.patches.area_m2, none_known, min_overlap=0.05).links(stations)
    back = PairFinder(survey, survey.patches.area_m2, none_known, min_overlap=0.05).links(stations[::-1])
    figures = {frozenset((link.a, link.b)): (link.overlap, link.strength, link.weak_motion) for link in forth}
    assert figures == {frozenset((link.a, link.b)): (link.overlap, link.strength, link.weak_motion) for link in back}
    assert forth == house.figures(house.draft).plan.links


def test_layers_are_the_best_of_all_stations(asking_house: LivePlan) -> None:
    live = asking_house
    survey = live.survey
    engine = open_engine(survey.scene, survey.patches)
    at = np.array([each.position_m for each in live.draft.stations])
    observations = observations_from(survey, live.settings, engine, at)
    for name, figures in (
        ("range", observations.range_m),
        ("incidence", np.degrees(observations.incidence_rad.astype(float))),
    ):
        step = live.layers[name].step
        best = np.full(survey.patches.n_patches, np.inf)
        for patch, figure in zip(observations.patch.tolist(), figures.tolist(), strict=True):
            best[patch] = min(best[patch], figure)
        expected = np.where(np.isfinite(best), np.minimum(np.rint(best / step), 65534), 65535)
        np.testing.assert_array_equal(live.layer(live.draft, name), expected)
    density = np.zeros(survey.patches.n_patches)
    for patch, spacing_m in zip(observations.patch.tolist(), observations.spacing_m.tolist(), strict=True):
        density[patch] += 1.0 / spacing_m**2
    found = live.layer(live.draft, "spacing")
    assert ((found == 65535) == (density == 0)).all()
    seen = density > 0
    np.testing.assert_allclose(
        found[seen] * live.layers["spacing"].step, density[seen] ** -0.5, atol=live.layers["spacing"].step
    )


@pytest.mark.slow
def test_rows_of_both_engines_agree(asking_house: LivePlan, asking_folder: Path) -> None:
    other = open_live(asking_folder, engine="open3d", with_ground=False)
    ours, theirs = asking_house.figures(asking_house.draft).plan, other.figures(other.draft).plan
    area_m2 = asking_house.survey.patches.area_m2
    differs = (ours.times_seen > 0) != (theirs.times_seen > 0)
    assert area_m2[differs].sum() < 0.002 * area_m2[ours.times_seen > 0].sum()
    assert ours.coverage.fraction_of_achievable == pytest.approx(theirs.coverage.fraction_of_achievable, abs=2e-3)


@pytest.mark.slow
def test_requirements_of_limits_are_counted_by_station(asking_house: LivePlan) -> None:
    live = asking_house
    survey = live.survey
    engine = open_engine(survey.scene, survey.patches)
    asked = live.settings.requirements
    assert asked.limits != PointLimits()
    times = np.zeros(survey.patches.n_patches, dtype=int)
    for station in live.draft.stations:
        observations = observations_from(survey, live.settings, engine, station.at_m[None])
        meets = (observations.range_m <= asked.limits.range_m) & (
            observations.incidence_rad <= asked.limits.incidence_rad
        )
        times[observations.patch[meets]] += 1
    figures = live.figures(live.draft).plan
    np.testing.assert_array_equal(figures.times_seen, times)
    painted = live.times_seen(live.draft)
    np.testing.assert_array_equal(painted[figures.achievable], times[figures.achievable])
    assert (painted[~figures.achievable] == 255).all()


def test_unknown_stations_floors_and_layers_are_named_with_those_there_are(house: LivePlan) -> None:
    station = house.draft.stations[0]
    with pytest.raises(RequirementError, match="expected one of"):
        house.preview(house.draft, "S999", "F0", (1.0, 1.0), 1.5)
    with pytest.raises(RequirementError, match="F0"):
        house.preview(house.draft, station.id, "cellar", (1.0, 1.0), 1.5)
    with pytest.raises(RequirementError, match="times_seen, range"):
        house.preview(house.draft, station.id, "F0", (1.0, 1.0), 1.5, layer="colour")
    with pytest.raises(RequirementError, match="finite"):
        house.preview(house.draft, station.id, "F0", (float("nan"), 1.0), 1.5)
    with pytest.raises(RequirementError, match="twice"):
        Draft((DraftStation("A", "F0", (0, 0, 0), 1.5), DraftStation("A", "F0", (1, 0, 0), 1.5)))
