"""The independent check against areas that follow from drawings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared_plans import SharedPlan

from planner_core.coverage.survey import make_survey
from planner_core.documents import read_as, to_document
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import (
    IndependentCheck,
    Optics,
    Plan,
    PlanSettings,
    PointLimits,
    Requirements,
    Scanner,
    Scene,
    VisibilityMode,
)
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.independent_check import check_independently, with_independent_check
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from tests.coverage.conftest import BOX_FACES, box_corners, shell

N_POINTS = 40_000
#: Clear space of 6 x 4 x 3 m, in walls that overlap: outside faces and wall ends are seen by nobody.
ROOM_BOXES = shell((0.0, 0.0, 0.0), (6.0, 4.0, 3.0), thick=0.3)
HIGH = (6.0, 4.0, 3.0)
ROOM_M2 = 2 * (6 * 4 + 6 * 3 + 4 * 3)
PILLAR = ("pillar", (2.8, 1.8, 0.0), (3.2, 2.2, 3.0))


def scene_of(boxes: list[tuple[str, tuple[float, ...], tuple[float, ...]]]) -> Scene:
    corners = np.concatenate([box_corners(low, high) for _, low, high in boxes])
    faces = np.concatenate([BOX_FACES + 8 * number for number in range(len(boxes))])
    return scene_from_arrays(corners, faces)


ROOM = scene_of(ROOM_BOXES)


def all_round() -> Scanner:
    """A scanner that looks everywhere but straight down, with fine steps."""
    return replace(
        load_scanner("hdl-64e"), elevation_rad=tuple(np.linspace(np.pi / 2, -np.pi / 2, 361).tolist()), n_azimuths=720,
        range_min_m=0.0, range_max_m=50.0, instrument_height_usual_m=None,
    )  # fmt: skip


def low_only() -> Scanner:
    """Sees no floor within its own height."""
    return replace(all_round(), elevation_rad=tuple(np.linspace(np.pi / 2, -np.pi / 4, 271).tolist()))


def evaluated(
    scene: Scene,
    at_m: list[tuple[float, float, float]],
    scanner: Scanner,
    scan_mode: VisibilityMode = VisibilityMode.AUTO,
    **asked: object,
) -> Plan:
    requirements = Requirements(network="none", scope="all", **asked)  # type: ignore[arg-type]
    settings = PlanSettings(
        scanner=scanner, requirements=requirements, grid_step_m=2.0, instrument_heights_m=(1.5,), special_places=False,
        scan_mode=scan_mode,
    )  # fmt: skip
    stations = [GivenStation(f"T{i}", np.array(at) + scene.offset_m, None, None) for i, at in enumerate(at_m)]
    return evaluate_stations(scene, settings, stations)


def check_of(plan: Plan, *, n_points: int = N_POINTS, **asked: object) -> IndependentCheck:
    """With some requirements replaced, of which the plan's own figures say nothing then."""
    requirements = replace(plan.settings.requirements, **asked)  # type: ignore[arg-type]
    plan = replace(plan, settings=replace(plan.settings, requirements=requirements))
    return check_independently(plan, open_engine(plan.survey.scene, plan.survey.patches), n_points=n_points)


def judged(*scene_stations_scanner: object, **asked: object) -> IndependentCheck:
    return check_of(evaluated(*scene_stations_scanner, **asked))  # type: ignore[arg-type]


def is_within(figure_judged: float, truth: float, error: float) -> bool:
    """Of a check that is right, four errors are exceeded once in 16 000."""
    return abs(figure_judged - truth) <= 4 * error


@pytest.mark.slow
def test_a_closed_room_is_seen_whole_and_nothing_else_is() -> None:
    found = judged(ROOM, [(2.0, 1.5, 1.5)], all_round())
    assert is_within(found.covered_m2.judged, ROOM_M2, found.covered_m2.error)
    assert found.covered_m2.error < 0.01 * ROOM_M2
    # Within half a millimetre of an edge, which of two faces hides the other is Open3D's to say.
    assert found.share.judged > 0.999
    # What the plan counts reaches into the walls.
    assert found.covered_m2.planned > ROOM_M2


@pytest.mark.slow
def test_a_cone_below_the_scanner_is_not_seen() -> None:
    found = judged(ROOM, [(3.0, 2.0, 1.5)], low_only())
    # 45 degrees down from 1.5 m: a disc of that radius on the floor; other candidates see it.
    assert is_within(found.covered_m2.judged, ROOM_M2 - np.pi * 1.5**2, found.covered_m2.error)
    assert is_within(found.achievable_m2.judged, ROOM_M2, found.achievable_m2.error)


@pytest.mark.slow
def test_range_and_incidence_count_at_the_point() -> None:
    at = np.array([3.0, 2.0, 1.5])
    found = judged(ROOM, [tuple(at)], all_round(), limits=PointLimits(range_m=2.5, incidence_rad=np.deg2rad(40.0)))
    # Discs around the feet of the perpendiculars, cut by the walls' edges, on a fine grid of each wall.
    truth_m2 = 0.0
    for axis in range(3):
        u, v = (k for k in range(3) if k != axis)
        grid = np.stack(np.meshgrid(*(np.linspace(0.0, HIGH[k], 1201) for k in (u, v)), indexing="ij"))
        across = np.hypot(grid[0] - at[u], grid[1] - at[v])
        for wall in (0.0, HIGH[axis]):
            away = abs(wall - at[axis])
            counts = (np.hypot(across, away) <= 2.5) & (np.arctan2(across, away) <= np.deg2rad(40.0))
            truth_m2 += counts.mean() * HIGH[u] * HIGH[v]
    assert is_within(found.covered_m2.judged, truth_m2, found.covered_m2.error)


@pytest.mark.slow
def test_a_pillar_hides_what_lies_behind_it() -> None:
    scene = scene_of([*ROOM_BOXES, PILLAR])
    at = (1.0, 2.0, 1.5)
    found = judged(scene, [at], all_round())
    # In plan, the shadow between the pillar's near corners, as seen from the station, up to the walls: a trapezoid.
    slope = 0.2 / (2.8 - at[0])
    half = [slope * (x - at[0]) for x in (2.8, 6.0)]
    shadow_m2 = (half[0] + half[1]) * (6.0 - 2.8)
    # Floor and ceiling lose it, with the pillar's footprint, the east wall its end; the pillar's west face is seen.
    truth_m2 = ROOM_M2 - 2 * shadow_m2 - 2 * half[1] * 3.0 + 0.4 * 3.0
    assert is_within(found.covered_m2.judged, truth_m2, found.covered_m2.error)


def test_glass_that_beams_pass_hides_nothing_and_is_not_seen() -> None:
    scene = scene_of([*ROOM_BOXES, PILLAR])
    is_pillar = np.arange(scene.n_triangles) >= scene.n_triangles - 12
    scene = replace(scene, optics_of_triangle=np.where(is_pillar, Optics.PASSES, Optics.RETURNS).astype(np.uint8))
    found = judged(scene, [(1.0, 2.0, 1.5)], all_round())
    assert is_within(found.covered_m2.judged, ROOM_M2, found.covered_m2.error)


@pytest.mark.slow
def test_what_only_a_station_sees_is_scannable_as_evaluate_has_it() -> None:
    found = judged(ROOM, [(3.0, 2.0, 2.5)], all_round(), limits=PointLimits(range_m=1.0))
    # From 1.5 m nobody is within a metre of the ceiling.
    disc_m2 = np.pi * (1.0 - 0.5**2)
    assert is_within(found.covered_m2.judged, disc_m2, found.covered_m2.error)
    assert found.covered_m2.planned == pytest.approx(disc_m2, rel=0.1)


@pytest.mark.slow
def test_overlap_is_what_both_see_of_what_the_one_with_more_sees_or_by_jaccard_of_what_either_sees() -> None:
    plan = evaluated(ROOM, [(1.5, 2.0, 1.4), (4.5, 2.0, 0.9)], low_only(), overlap_measure="jaccard")
    discs_m2 = [np.pi * 1.4**2, np.pi * 0.9**2]
    # The discs lie apart: each sees the other's, and together they see the room.
    both_m2 = ROOM_M2 - sum(discs_m2)
    (link,) = check_of(plan).links
    assert (link.a, link.b) == ("T0", "T1")
    assert is_within(link.overlap.judged, both_m2 / ROOM_M2, link.overlap.error)
    assert link.overlap.planned == pytest.approx(link.overlap.judged, abs=0.02)
    (share,) = check_of(plan, overlap_measure="smaller-share").links
    assert is_within(share.overlap.judged, both_m2 / (ROOM_M2 - min(discs_m2)), share.overlap.error)
    assert link.overlap.judged < share.overlap.judged - 4 * link.overlap.error


@pytest.mark.slow
@pytest.mark.parametrize("measure", ["smaller-share", "jaccard"])
def test_of_what_is_seen_as_required_overlap_counts_points_within_the_limits(measure: str) -> None:
    at_m, most_m = [(2.0, 2.0, 1.5), (3.5, 2.0, 1.0)], 2.4
    asked = {"limits": PointLimits(range_m=most_m), "overlap_measure": measure}
    plan = evaluated(ROOM, at_m, all_round(), overlap_of="seen-as-required", **asked)
    # Of the room's six faces, on a fine grid: what lies within range of either, and of both.
    near_m2 = np.zeros(2)
    both_m2 = 0.0
    for axis in range(3):
        u, v = (k for k in range(3) if k != axis)
        steps = [(np.arange(900) + 0.5) * HIGH[k] / 900 for k in (u, v)]
        grid = np.stack(np.meshgrid(*steps, indexing="ij"))
        for wall in (0.0, HIGH[axis]):
            away_m = [np.hypot(np.hypot(grid[0] - p[u], grid[1] - p[v]), wall - p[axis]) for p in np.array(at_m)]
            near = [away <= most_m for away in away_m]
            face_m2 = HIGH[u] * HIGH[v]
            near_m2 += [each.mean() * face_m2 for each in near]
            both_m2 += float((near[0] & near[1]).mean()) * face_m2
    whole_m2 = near_m2.sum() - both_m2 if measure == "jaccard" else near_m2.max()
    (link,) = check_of(plan).links
    assert is_within(link.overlap.judged, both_m2 / whole_m2, link.overlap.error)
    assert 0.2 < both_m2 / whole_m2 < 0.9
    assert link.overlap.planned == pytest.approx(link.overlap.judged, abs=0.05)
    # All of the room is seen from both.
    (all_seen,) = check_of(plan, overlap_of="all-seen").links
    assert all_seen.overlap.judged > 0.999


@pytest.mark.slow
def test_points_meet_what_is_asked_from_so_many_stations() -> None:
    scene = scene_of([*ROOM_BOXES, PILLAR])
    plan = evaluated(scene, [(1.0, 2.0, 1.5), (5.0, 2.0, 1.5)], all_round())
    once, twice = check_of(plan), check_of(plan, seen_from=2)
    single = [check_of(replace(plan, stations=(one,), links=())).covered_m2.judged for one in plan.stations]
    # Inclusion and exclusion.
    tolerance_m2 = 4 * 3 * once.covered_m2.error
    assert twice.covered_m2.judged == pytest.approx(sum(single) - once.covered_m2.judged, abs=tolerance_m2)
    assert twice.covered_m2.judged < min(single)


def test_too_few_points_are_refused(box_plan: SharedPlan) -> None:
    plan = box_plan.plan
    with pytest.raises(RequirementError, match="got 10 points, expected at least 100"):
        check_independently(plan, open_engine(plan.survey.scene, plan.survey.patches), n_points=10)


@pytest.mark.slow
def test_a_plan_that_says_too_much_is_told_so() -> None:
    """By beams whole patches count, which overlap the walls: some per cent too much. By samples nothing is off."""
    for scan_mode, n_lines in ((VisibilityMode.BEAMS, 1), (VisibilityMode.PATCHES, 0)):
        settings = PlanSettings(
            scanner=all_round(), requirements=Requirements(network="none", scope="all"), scan_mode=scan_mode,
            grid_step_m=1.0, instrument_heights_m=(1.5,), special_places=False, max_patch_area_m2=0.16,
        )  # fmt: skip
        engine = open_engine(ROOM, make_survey(ROOM, settings).patches)
        plan = make_plan(ROOM, settings)
        assert plan.independent_check is None
        assert with_independent_check(plan, engine, n_points=0) is plan
        found = with_independent_check(plan, engine, n_points=20_000)
        lines = [line for line in found.warnings if line.startswith("judge: 20000 random points have covered")]
        assert len(lines) == n_lines, lines
        check = found.independent_check
        assert check is not None
        assert is_within(check.achievable_m2.judged, ROOM_M2, check.achievable_m2.error)
        # What the points say is in the plan's document, and comes back as it was.
        back = read_as(IndependentCheck, to_document(check), "", remedy="")
        assert back.share.judged == pytest.approx(check.share.judged, abs=1e-9)
        assert (back.n_points, len(back.links)) == (20_000, len(plan.links))


@pytest.mark.slow
def test_surface_that_a_station_stands_in_the_plane_of_is_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a centimetre off a wall's face, neighbouring columns meet it metres apart: no patch of it holds beams."""
    wall = ("wall", (2.0, 4.0, 0.0), (6.0, 4.2, 3.0))
    floor = ("floor", (0.0, 2.0, -0.2), (7.0, 6.0, 0.0))
    scene = scene_of([floor, wall])
    plan = evaluated(scene, [(0.5, 3.995, 1.5)], load_scanner("rtc360"))
    told = check_of(plan, n_points=8_000).covered_m2
    monkeypatch.setattr("planner_core.planning.independent_check.LEAST_RETURNS", 0.0)
    by_sight_alone = check_of(plan, n_points=8_000).covered_m2
    assert by_sight_alone.error < 1.0
    assert is_within(by_sight_alone.judged - told.judged, 4.0 * 3.0, by_sight_alone.error)


@pytest.mark.slow
def test_floor_between_the_rows_of_a_coarse_scanner_is_seen_as_far_as_patches_hold_beams() -> None:
    """From 0.3 m above a floor its rows meet it 0.2 m apart at 3 m, 0.6 m at 5 m; patches are up to 0.28 m wide."""
    floor = scene_of([("floor", (-5.0, -5.0, -0.2), (5.0, 5.0, 0.0))])
    plan = evaluated(floor, [(0.0, 0.0, 0.3)], load_scanner("hdl-64e"), VisibilityMode.PATCHES)
    found = check_of(plan, n_points=15_000).covered_m2
    assert found.planned < 0.9 * np.pi * 5.0**2
    assert abs(found.judged - found.planned) < 4.0 * found.error
