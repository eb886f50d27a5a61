"""Demands: against the problem without limits, plain recounts in NumPy, and a box room worked out by hand."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import enough_of, floor_constraints, observations_from
from stages import demand_of, observed_from, rows_from, surveyed_as, visible_from

from planner_core.coverage.coverage import floor_of_patch, scope_of, times_seen
from planner_core.coverage.observations import Observations, observations_in_batches
from planner_core.errors import RequirementError
from planner_core.model import Paper, PartRequirement, PartResult, PointLimits, Requirements, Visibility
from planner_core.requirements import demand as demands
from planner_core.requirements import goals as goals_module
from planner_core.requirements.compliance import (
    coverage_curve,
    missed_in_words,
    part_results,
    rows_of_quality,
    times_met,
)
from planner_core.requirements.goals import Goal, Goals
from planner_core.requirements.observe_candidates import SeenPatches, _SeenSoFar, limits_of
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.patches import patch_triangles
from planner_core.select.problem import cover_problem

MIXED = {
    "limits": PointLimits(spacing_m=0.05, range_m=5.0),
    "parts": (
        PartRequirement("walls", 0.9, limits=PointLimits(incidence_rad=0.9), seen_from=2, classes=("ifcwall*",)),
        PartRequirement("slab", 0.8, limits=PointLimits(range_m=4.0), classes=("IfcSlab",)),
        PartRequirement("north", 0.7, limits=PointLimits(range_m=4.0), classes=("north ?all",)),
        PartRequirement("East", 0.85, seen_from=3, floors=("f1",)),
    ),
}


@pytest.fixture(scope="module")
def mixed(box: SimpleNamespace, settings_of) -> SimpleNamespace:
    wanted = settings_of(**MIXED)
    return SimpleNamespace(
        settings=wanted,
        demand=demand_of(box.survey, wanted, box.engine, box.positions_m),
        observations=observations_from(box.survey, wanted, box.engine, box.positions_m),
    )


def meets(observations: Observations, entry: int, asked: PointLimits) -> bool:
    return all(
        limit is None or getattr(observations, name)[entry] <= np.float32(limit)
        for name, limit in vars(asked).items()
        if name != "noise_m"
    )


@pytest.mark.parametrize(("which", "scan_mode"), [("engine", "beams"), ("engine", "patches"), ("open3d", "patches")])
@pytest.mark.parametrize("floors", [(), ("West",)])
def test_a_demand_without_limits_is_the_problem_of_floors_and_visibility(
    box: SimpleNamespace, settings_of, which: str, scan_mode: str, floors: tuple[str, ...]
) -> None:
    """As the method paper counts: whole patches."""
    plain = replace(settings_of(scan_mode=scan_mode, coverage=0.9, floors=floors), method=Paper())
    scan_engine = getattr(box, which)
    demand = demand_of(box.survey, plain, scan_engine, box.positions_m)
    assert demand.countable_share is None
    visibility = visible_from(box.survey, plain, scan_engine, box.positions_m)
    of_patch = floor_of_patch(box.survey.patches, box.survey.floor_of_triangle)
    indices = (0,) if floors else (0, 1)
    constraints = floor_constraints(of_patch, indices, scope_of(of_patch, indices, 2), 0.9)
    expected = cover_problem(visibility, box.survey.patches.area_m2, constraints)
    found = cover_problem(demand.rows.met, demand.area_m2, demand.constraints)
    for name in vars(expected):
        one, other = getattr(expected, name), getattr(found, name)
        assert one.dtype == other.dtype, name
        np.testing.assert_array_equal(one, other, err_msg=name)
    assert demand.rows.seen.patch.tobytes() == visibility.patch.tobytes()


@pytest.mark.parametrize("scan_mode", ["beams", "patches"])
def test_a_limit_that_all_sights_meet_changes_no_row(box: SimpleNamespace, settings_of, scan_mode: str) -> None:
    wanted = settings_of(scan_mode=scan_mode, limits=PointLimits(range_m=100.0))
    demand = demand_of(box.survey, wanted, box.engine, box.positions_m)
    plain = demand_of(box.survey, settings_of(scan_mode=scan_mode), box.engine, box.positions_m).rows
    assert plain.met is plain.seen
    for rows in (demand.rows.seen, demand.rows.met):
        np.testing.assert_array_equal(rows.starts, plain.seen.starts)
        np.testing.assert_array_equal(rows.patch, plain.seen.patch)


def test_known_positions_are_not_looked_around_from_again(
    box: SimpleNamespace, settings_of, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = settings_of(scan_mode="patches", **MIXED)
    whole = demand_of(box.survey, wanted, box.engine, box.positions_m)
    row = np.array([6, 0, 3])
    known = demands.KnownObservations(row, observed_from(box.survey, wanted, box.engine, box.positions_m[row]))
    observed: list[int] = []
    look = demands.observe_candidates

    def noting(survey, engine, positions_m, *rest, **how):
        observed.append(len(positions_m))
        return look(survey, engine, positions_m, *rest, **how)

    monkeypatch.setattr(demands, "observe_candidates", noting)
    again = demand_of(box.survey, wanted, box.engine, box.positions_m, known=known)
    assert observed == [len(box.positions_m) - 3]
    for one, other in ((whole.rows.seen, again.rows.seen), (whole.rows.met, again.rows.met)):
        assert (one.starts.tolist(), one.patch.tolist()) == (other.starts.tolist(), other.patch.tolist())
    np.testing.assert_array_equal(whole.countable_share, again.countable_share)
    np.testing.assert_array_equal(whole.times_met, again.times_met)
    for least, other in zip(whole.needed, again.needed, strict=True):
        for limit, figures in least.items():
            np.testing.assert_array_equal(figures, other[limit])


def wanted_of_mixed(box: SimpleNamespace) -> list[np.ndarray]:
    """Patches that each quality of `MIXED` is asked of."""
    of = ([0, 1, 2, 3, 4, 5], [0, 1, 2], [0, 1, 2, 3], [0, 4])
    return [np.isin(box.element_of_patch, elements) for elements in of]


def test_spacing_on_the_walls_of_a_box_is_range_times_step_over_cosine(box: SimpleNamespace, settings_of) -> None:
    """Rows on a wall: range x step / cos(incidence) at eye level; the patches within a limit are known beforehand."""
    limit_m = 0.03
    wanted = settings_of(limits=PointLimits(spacing_m=limit_m))
    at = box.positions_m[4]  # the middle of the room
    demand = demand_of(box.survey, wanted, box.engine, at[None])
    centre = patch_triangles(box.scene, box.survey.patches).mean(axis=1) - at
    on_wall = np.isin(box.element_of_patch, [0, 1])  # y = 4 and y = 0: straight ahead along y
    range_m = np.linalg.norm(centre, axis=1)
    step = np.deg2rad(0.5)
    across, level = np.abs(centre[:, 1]), np.hypot(centre[:, 0], centre[:, 1])
    # (x, z) on the plane y = const are y / tan(azimuth) and level tan(elevation), by either angle's derivative.
    columns = step * np.hypot(level**2 / across, centre[:, 2] * centre[:, 0] / across)
    rows = step * range_m**2 / level
    spacing = np.maximum(columns, rows)
    clear = on_wall & (np.abs(spacing / limit_m - 1) > 1e-4)
    assert clear.sum() > 500
    met = demand.times_met[0] > 0
    assert 50 < met[clear].sum() < clear.sum() - 50
    np.testing.assert_array_equal(met[clear], spacing[clear] <= limit_m)


@pytest.mark.slow
def test_stacked_rows_hold_what_meets_each_quality(mixed: SimpleNamespace, box: SimpleNamespace) -> None:
    demand, observations = mixed.demand, mixed.observations
    n_patches = box.survey.patches.n_patches
    assert demand.goals.qualities == (
        PointLimits(spacing_m=0.05, range_m=5.0),
        PointLimits(),
        PointLimits(incidence_rad=0.9),
        PointLimits(range_m=4.0),
    )
    enough = enough_of(observations, demand.countable_share, demand.goals.qualities, wanted_of_mixed(box))
    for position in range(len(box.positions_m)):
        entries = range(int(observations.starts[position]), int(observations.starts[position + 1]))
        expected = [
            quality * n_patches + observations.patch[entry]
            for quality in range(len(demand.goals.qualities))
            for entry in entries
            if enough.met[quality][entry]
        ]
        assert demand.rows.met.row(position).tolist() == expected
        here = slice(entries.start, entries.stop)
        assert demand.rows.seen.row(position).tolist() == observations.patch[here][enough.seen[here]].tolist()
    assert (np.diff(demand.rows.met.starts) < 4 * np.diff(demand.rows.seen.starts)).all()


def test_targets_are_the_goals_in_their_quality(mixed: SimpleNamespace, box: SimpleNamespace) -> None:
    demand = mixed.demand
    names = [goal.name for goal in demand.goals.each]
    assert names == ["West", "East", "overall", "walls", "slab", "north"]
    assert [constraint.fraction for constraint in demand.constraints] == [0.95, 0.85, 0.95, 0.9, 0.8, 0.7]
    assert [constraint.seen_from for constraint in demand.constraints] == [1, 3, 1, 2, 1, 1]
    elements = {"West": [3, 4], "East": [0, 1, 2], "overall": range(6), "walls": range(4), "slab": [4], "north": [0]}
    quality = {"West": 0, "East": 1, "overall": 0, "walls": 2, "slab": 3, "north": 3}
    for goal, constraint in zip(demand.goals.each, demand.constraints, strict=True):
        part = constraint.part.reshape(len(demand.goals.qualities), -1)
        expected = np.isin(box.element_of_patch, list(elements[goal.name]))
        np.testing.assert_array_equal(part[quality[goal.name]], expected, err_msg=goal.name)
        assert not np.delete(part, quality[goal.name], axis=0).any(), goal.name
    area_m2 = demand.with_counted_patches(box.survey).patches.area_m2
    np.testing.assert_array_equal(demand.area_m2.reshape(4, -1), np.tile(area_m2, (4, 1)))


@pytest.mark.slow
@pytest.mark.parametrize("chosen", [[], [4], [0, 8], [8, 0, 3, 5], list(range(9))])
def test_results_are_those_of_a_recount_over_sights(
    mixed: SimpleNamespace, box: SimpleNamespace, chosen: list[int]
) -> None:
    demand, observations = mixed.demand, mixed.observations
    results = part_results(demand, demand.rows.take(chosen))
    area = demand.with_counted_patches(box.survey).patches.area_m2
    enough = enough_of(observations, demand.countable_share, demand.goals.qualities, wanted_of_mixed(box)).seen
    for goal, result in zip(demand.goals.each, results, strict=True):
        by_all, by_chosen = np.zeros(len(area), dtype=int), np.zeros(len(area), dtype=int)
        for position in range(len(box.positions_m)):
            for entry in range(int(observations.starts[position]), int(observations.starts[position + 1])):
                if enough[entry] and meets(observations, entry, goal.limits):
                    by_all[observations.patch[entry]] += 1
                    by_chosen[observations.patch[entry]] += position in chosen
        achievable = goal.patches & (by_all >= goal.seen_from)
        assert result.achievable_area_m2 == pytest.approx(area[achievable].sum())
        assert result.covered_area_m2 == pytest.approx(area[achievable & (by_chosen >= goal.seen_from)].sum())
        assert result.total_area_m2 == pytest.approx(area[goal.patches].sum())
        assert result.met == (result.covered_area_m2 >= (goal.coverage - 1e-9) * result.achievable_area_m2)
        np.testing.assert_array_equal(demand.achievable(goal), achievable)
    assert len(missed_in_words(results)) == sum(not result.met for result in results)


def test_what_is_missed_is_reported_with_figures_that_do_not_read_as_enough() -> None:
    results = (
        PartResult("Level 1", 0.95, 200.0, 189.99, 300.0),
        PartResult("walls", 0.98, 10.0, 9.0, 12.0, seen_from=2, limits=PointLimits(spacing_m=0.006)),
        PartResult("met", 0.95, 200.0, 190.0, 300.0),
        PartResult("nothing to see", 0.95, 0.0, 0.0, 300.0),
    )
    assert missed_in_words(results) == (
        "'Level 1' is covered to just below 95 % of the 200 m2 scannable, 95 % required",
        "'walls' is covered to 90.0 % of the 10.0 m2 scannable with spacing 6 mm, 2 stations, 98 % required",
    )


def test_selection_agrees_with_results_on_what_is_achievable_and_met(mixed: SimpleNamespace) -> None:
    demand = mixed.demand
    problem = cover_problem(demand.rows.met, demand.area_m2, demand.constraints)
    assert problem.seen_from.tolist() == [goal.seen_from for goal in demand.goals.each]
    everybody = part_results(demand, demand.rows.take(np.arange(problem.n_candidates)))
    for required, least, result in zip(problem.required, problem.least, everybody, strict=True):
        ticks = result.required * result.achievable_area_m2 * 1e9
        assert least - 1 <= ticks <= required + 1
        assert result.fraction_of_achievable == 1.0


def test_what_is_asked_of_all_comes_out_of_the_stack_as_rows_of_its_own(mixed: SimpleNamespace) -> None:
    demand = mixed.demand
    rows = demand.rows.take([8, 2, 5])
    overall = rows_of_quality(demand, rows)
    assert overall.n_patches == demand.n_patches
    for position, row in enumerate([8, 2, 5]):
        stacked = demand.rows.met.row(row)
        assert overall.row(position).tolist() == stacked[stacked < demand.n_patches].tolist()
        third = rows_of_quality(demand, rows, 2).row(position) + 2 * demand.n_patches
        assert third.tolist() == stacked[(stacked >= 2 * demand.n_patches) & (stacked < 3 * demand.n_patches)].tolist()
    np.testing.assert_array_equal(times_seen(overall), times_met(demand, rows)[0])


def test_the_curve_counts_patches_once_enough_stations_met_them(box: SimpleNamespace, settings_of) -> None:
    demand = demand_of(
        box.survey, settings_of(seen_from=2, limits=PointLimits(range_m=4.0)), box.engine, box.positions_m
    )
    order = [4, 0, 8]
    curve = coverage_curve(demand, demand.rows.take(order))
    area = box.survey.patches.area_m2
    possible = np.bincount(demand.rows.met.patch, minlength=area.size) >= 2
    by_hand = []
    for n in (1, 2, 3):
        met = np.concatenate([demand.rows.met.row(row) for row in order[:n]])
        by_hand.append(area[np.bincount(met, minlength=area.size) >= 2].sum() / area[possible].sum())
    assert curve == pytest.approx(tuple(by_hand))
    assert curve[0] == 0.0 < curve[1] < curve[2] < 1.0


def test_rows_of_further_positions_are_what_a_demand_of_them_has(mixed: SimpleNamespace, box: SimpleNamespace) -> None:
    again = rows_from(box.survey, mixed.settings, box.engine, box.positions_m[[7, 1]], mixed.demand)
    expected = mixed.demand.rows.take([7, 1])
    for one, other in ((again.seen, expected.seen), (again.met, expected.met)):
        np.testing.assert_array_equal(one.starts, other.starts)
        np.testing.assert_array_equal(one.patch, other.patch)
        assert one.n_patches == other.n_patches


@pytest.mark.slow
@pytest.mark.parametrize("scan_mode", ["beams", "patches"])
def test_sights_do_not_depend_on_how_positions_are_split(
    box: SimpleNamespace, settings_of, scan_mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scanner = replace(
        load_scanner("hdl-64e"),
        range_noise=((0.5, 0.05, 0.004), (50.0, 0.05, 0.02), (0.5, 0.9, 0.001), (50.0, 0.9, 0.01)),
    )
    asked = Requirements(limits=PointLimits(noise_m=0.002))
    wanted = replace(settings_of(scan_mode=scan_mode), scanner=scanner, requirements=asked)
    heard: list[tuple[int, int]] = []
    whole = observations_from(
        box.survey, wanted, box.engine, box.positions_m, progress=lambda event: heard.append((event.done, event.total))
    )
    assert heard[-1] == (9, 9)
    assert heard == sorted(heard)
    module = "planner_core.coverage.observations"
    monkeypatch.setattr(f"{module}._BATCH_OBSERVATIONS", 1)
    monkeypatch.setattr(f"{module}._FIRST_BATCH", 2)
    batches = observations_in_batches(surveyed_as(box.survey, wanted), box.engine, box.positions_m, noise=True)
    assert [batch.starts.size - 1 for batch in batches][:2] == [2, 1]
    split = observations_from(box.survey, wanted, box.engine, box.positions_m)
    for name in ("starts", "patch", "spacing_m", "range_m", "incidence_rad", "noise_m"):
        one, other = getattr(whole, name), getattr(split, name)
        assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes()), name
    assert whole.noise_m is not None
    assert whole.noise_m.dtype == np.float32
    assert np.isfinite(whole.noise_m).any()


def test_sights_of_no_position_are_empty(box: SimpleNamespace, settings_of) -> None:
    none = observations_from(box.survey, settings_of(limits=PointLimits(range_m=4.0)), box.engine, np.zeros((0, 3)))
    assert none.starts.tolist() == [0]
    assert none.patch.size == none.range_m.size == 0


def test_a_noise_limit_needs_a_scanner_whose_noise_is_known(box: SimpleNamespace, settings_of) -> None:
    part = PartRequirement("walls", limits=PointLimits(noise_m=0.002), classes=("IfcWall",))
    with pytest.raises(RequirementError, match=r"^noise: got a limit with scanner hdl-64e, .*range noise; give"):
        demand_of(box.survey, settings_of(parts=(part,)), box.engine, box.positions_m)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"limits": PointLimits(range_m=0.5)}, r"'overall'.*range 0.5 m.*ease its range, the best is 0.9[89]\d* m"),
        (
            {"limits": PointLimits(spacing_m=0.001, range_m=50.0)},
            r"'overall'.*spacing 1 mm.*ease its spacing, the best is",
        ),
        ({"limits": PointLimits(spacing_m=0.001, range_m=0.5)}, r"'overall'.*ease several limits at once"),
        (
            {"seen_from": 10},
            r"'overall': got nothing of its 124 m2 with 10 stations from more than 9 of 9 positions, .*; require 9",
        ),
        (
            {"parts": (PartRequirement("ends", limits=PointLimits(range_m=0.6), classes=("East wall",)),)},
            r"'ends'.*of its 10.0 m2.*range",
        ),
    ],
)
def test_a_requirement_that_nobody_can_meet_is_refused_by_name(
    box: SimpleNamespace, settings_of, asked: dict[str, object], message: str
) -> None:
    with pytest.raises(RequirementError, match=message) as caught:
        demand_of(box.survey, settings_of(**asked), box.engine, box.positions_m)
    assert "\n" not in str(caught.value)


def test_a_floor_that_nobody_sees_is_no_error_where_nothing_special_is_asked(box: SimpleNamespace, settings_of) -> None:
    """As before there were limits: such floors have a warning of their own."""
    hidden = replace(box.survey, floor_of_triangle=np.array([1] * 12, dtype=np.int32))
    for asked in ({}, {"limits": PointLimits(range_m=5.0)}):
        demand = demand_of(hidden, settings_of(**asked), box.engine, box.positions_m)
        assert part_results(demand, demand.rows.take([]))[0].met


@pytest.mark.parametrize(("limit", "most"), [("_MOST_STACKED", 3), ("_MOST_TARGET_BYTES", 23)])
def test_more_stacked_patches_than_have_room_are_refused(
    box: SimpleNamespace, settings_of, monkeypatch: pytest.MonkeyPatch, limit: str, most: int
) -> None:
    """Six goals of four qualities: 4 times as many patches, 24 times for the targets."""
    n_patches = box.survey.patches.n_patches
    monkeypatch.setattr(goals_module, limit, (most + 1) * n_patches)
    demand_of(box.survey, settings_of(**MIXED), box.engine, box.positions_m[:5])
    monkeypatch.setattr(goals_module, limit, (most + 1) * n_patches - 1)
    with pytest.raises(
        RequirementError, match=r"got 6 with 4 different sets of limits on 1792 patches.*use the same limits"
    ):
        demand_of(box.survey, settings_of(**MIXED), box.engine, box.positions_m[:5])


def test_positions_that_see_nothing_at_all_are_not_blamed_on_what_is_asked(box: SimpleNamespace, settings_of) -> None:
    blind = settings_of(limits=PointLimits(range_m=5.0), seen_from=2)
    demand = demand_of(box.survey, blind, box.engine, np.array([[500.0, 0.0, 0.0]]))
    assert not demand.times_met.any()
    assert part_results(demand, demand.rows)[-1].achievable_area_m2 == 0.0


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_needed_figures_and_stacked_rows_are_those_of_plain_loops(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n_patches, n_rows = 7, 4
    rows = [np.flatnonzero(rng.random(n_patches) < 0.5).astype(np.int32) for _ in range(n_rows)]
    starts = np.cumsum([0, *(row.size for row in rows)]).astype(np.int64)
    spacing, range_m, incidence, noise = rng.choice([0.1, 0.2, 0.3, 0.4], (4, starts[-1])).astype(np.float32)
    noise[rng.random(noise.size) < 0.3] = np.nan
    observations = Observations(starts, np.concatenate(rows), n_patches, spacing, range_m, incidence, noise)
    limits = {name: rng.choice([None, 0.1, 0.2, 0.3]) for name in ("spacing_m", "range_m", "noise_m")}
    qualities = (PointLimits(**limits), PointLimits(incidence_rad=0.2))
    counted = rng.random(n_patches) < 0.6
    needed = tuple(
        {name: np.full(n_patches, np.nan, dtype=np.float32) for name in limits_of(asked)} for asked in qualities
    )
    goals = (
        Goal("overall", 0.9, qualities[0], 1, np.ones(n_patches, dtype=np.bool_)),
        Goal("part", 0.9, qualities[1], 1, counted, stated=True),
    )
    found = _SeenSoFar(Goals(Requirements(), goals, counted), n_patches, needed, keeps_parts=False)
    found.add(observations)
    rows_found = found.observations().rows
    assert rows_found.seen.patch.tolist() == observations.patch.tolist()
    sizes, stacked = np.diff(rows_found.met.starts), rows_found.met.patch

    def ok(entry: int, asked: PointLimits, but: str = "") -> bool:
        return all(
            limit is None or name == but or getattr(observations, name)[entry] <= np.float32(limit)
            for name, limit in vars(asked).items()
        )

    expected = [
        [
            p + q * n_patches
            for q, asked in enumerate(qualities)
            for e, p in zip(range(*ends), row, strict=True)
            if ok(e, asked) and (q == 0 or counted[p])
        ]
        for row, ends in zip(rows, pairwise(starts), strict=True)
    ]
    assert sizes.tolist() == [len(row) for row in expected], seed
    assert stacked.tolist() == [p for row in expected for p in row], seed
    for asked, least in zip(qualities, needed, strict=True):
        for name, figures in least.items():
            for patch in range(n_patches):
                there = [
                    float(getattr(observations, name)[e])
                    for e in range(starts[-1])
                    if observations.patch[e] == patch and ok(e, asked, but=name)
                ]
                best = min((f if np.isfinite(f) else np.inf for f in there), default=np.nan)
                np.testing.assert_equal(float(figures[patch]), best, err_msg=f"{seed} {name}")


def test_rows_without_limits_are_held_once() -> None:
    seen = Visibility(np.array([0, 1]), np.array([0], dtype=np.int32), 2)
    taken = SeenPatches(seen, seen).take([0, 0])
    assert taken.met is taken.seen
