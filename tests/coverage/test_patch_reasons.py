"""Each reason where the building leaves no doubt which it is, and that areas add up."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.coverage import patch_reasons
from planner_core.model import Optics, PointLimits, UnreachableArea, Visibility
from planner_core.model.unseen import (
    COVERED,
    IN_SOLIDS,
    NO_RETURN,
    NO_SPOT,
    NOT_WORTH,
    OCCLUDED,
    OUT_OF_RANGE,
    OUT_OF_SCOPE,
    OUT_OF_VIEW,
    REASONS,
    TOO_FEW,
    TOO_NOISY,
    TOO_OBLIQUE,
    TOO_SPARSE,
)
from planner_core.scene.patches import patch_triangles

ROOM = ((0, 0, 0), (4, 3, 2.5))
INSIDE = [(2.0, 1.5, 1.5)]


def places(world):
    corners = patch_triangles(world.survey.scene, world.survey.patches)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners.mean(axis=1), normal / np.linalg.norm(normal, axis=1)[:, None]


def clear_of_rims(at, low, high, margin_m=0.4):
    """Places (N, 3) this far inside a room: patches nearer to a rim share samples with what the walls hide."""
    off = np.minimum(at - np.array(low), np.array(high) - at)
    return ((off > margin_m) | (np.abs(off) < 1e-3)).all(axis=1)  # on a face, the distance from that face is none


def facing_in(world, name, axis, sign):
    """Patches of a box's face that looks along sign * axis."""
    _, normal = places(world)
    return world.of(name) & (normal[:, axis] * sign > 0.9)


def rows_without(seen, dropped):
    """`seen` without the patches `dropped` (P,) bool."""
    kept = ~dropped[seen.patch]
    counts = [int(kept[a:b].sum()) for a, b in zip(seen.starts[:-1], seen.starts[1:], strict=True)]
    return Visibility(np.concatenate([[0], np.cumsum(counts)]).astype(np.int64), seen.patch[kept], seen.n_patches)


def test_bare_room_is_covered_inside_and_without_a_spot_outside(build):
    world = build.world(build.shell(*ROOM), INSIDE)
    why = world.explain()
    at, _ = places(world)
    inner = facing_in(world, "west", 0, 1) & (at[:, 1] > 0) & (at[:, 1] < 3)
    assert (why.reason_of_patch[inner] == COVERED).all()
    for name, axis, sign in (("west", 0, -1), ("south", 1, -1), ("ceiling", 2, 1), ("floor", 2, -1)):
        assert (why.reason_of_patch[facing_in(world, name, axis, sign)] == NO_SPOT).all(), name


@pytest.mark.slow
def test_faces_that_touch_another_box_are_inside_solids(build):
    cupboard = ("cupboard", (1.5, 2.5, 0), (2.5, 3, 2))  # its back on the north wall, its foot on the floor
    world = build.world([*build.shell(*ROOM), cupboard], INSIDE, patch_m2=0.02)
    why = world.explain()
    assert (why.reason_of_patch[facing_in(world, "cupboard", 1, 1)] == IN_SOLIDS).all()
    assert (why.reason_of_patch[facing_in(world, "cupboard", 2, -1)] == IN_SOLIDS).all()
    at, _ = places(world)
    behind = facing_in(world, "north", 1, -1) & (abs(at[:, 0] - 2) < 0.3) & (at[:, 2] < 1.7)
    assert behind.any()
    assert (why.reason_of_patch[behind] == IN_SOLIDS).all()
    assert (why.reason_of_patch[facing_in(world, "south", 0, 1)] == IN_SOLIDS).all()  # its end at the east wall


def test_wall_behind_a_screen_is_occluded(build):
    screen = ("screen", (0.3, 0.3, 0), (0.35, 2.7, 2.3))
    world = build.world([*build.shell(*ROOM), screen], INSIDE)
    why = world.explain()
    at, _ = places(world)
    behind = facing_in(world, "west", 0, 1) & (abs(at[:, 1] - 1.5) < 0.8) & (abs(at[:, 2] - 1.2) < 0.8)
    assert behind.any()
    assert (why.reason_of_patch[behind] == OCCLUDED).all()


@pytest.mark.slow
def test_sealed_room_has_no_spot_by_its_outline_or_by_its_ground(build):
    unreachable = build.shell((4.2, 0, 0), (7, 3, 2.5), prefix="sealed ")[1:]
    boxes = [*build.shell((0, 0, 0), (4, 3, 2.5)), ("sealed floor", (4.2, -0.2, -0.2), (7.2, 3.2, 0)), *unreachable]
    boxes = [box for box in boxes if box[0] != "sealed west"]  # the east wall of the first room is its own
    inner = lambda world: facing_in(world, "sealed east", 0, -1)  # noqa: E731
    unknown = build.world(boxes, INSIDE)
    assert (unknown.explain().reason_of_patch[inner(unknown)] == OCCLUDED).mean() > 0.5
    rooms = (build.room("a", *ROOM), build.room("b", (4.2, 0, 0), (7, 3, 2.5)))
    by_room = build.world(boxes, INSIDE, rooms=rooms)
    at, _ = places(by_room)
    within = clear_of_rims(at, (4.2, 0, 0), (7, 3, 2.5))
    assert (by_room.explain().reason_of_patch[inner(by_room) & within] == NO_SPOT).all()
    area = UnreachableArea(0, 8.0, np.array([5.5, 1.5, 0.0]), np.array([[[4.2, 0.0], [7.0, 3.0]]]))
    assert (unknown.explain(unreachable=(area,)).reason_of_patch[inner(unknown) & within] == NO_SPOT).all()


@pytest.mark.slow
def test_far_end_of_a_hall_is_out_of_range(build):
    world = build.world(build.shell((0, 0, 0), (20, 3, 2.5)), [(2, 1.5, 1.5)], scan=build.scanner(range_max_m=6.0))
    why = world.explain()
    at, _ = places(world)
    range_m = np.linalg.norm(at - world.candidates_m[0], axis=1)
    far = why.reason_of_patch == OUT_OF_RANGE
    assert facing_in(world, "east", 0, -1)[far].any()
    assert range_m[far].min() > 6.0 - 0.5  # patches share a sample within 0.4 m
    inner = facing_in(world, "floor", 2, 1) & clear_of_rims(at, (0, 0, 0), (20, 3, 2.5))
    assert (why.reason_of_patch[inner & (range_m > 6.5)] == OUT_OF_RANGE).all()


def test_asked_range_counts_as_the_scanners_own(build):
    boxes = build.shell((0, 0, 0), (20, 3, 2.5))
    world = build.world(boxes, [(2, 1.5, 1.5)], limits=PointLimits(range_m=6.0))
    at, _ = places(world)
    range_m = np.linalg.norm(at - world.candidates_m[0], axis=1)
    world.seen = rows_without(world.seen, range_m > 6.0)
    assert (world.explain().reason_of_patch[facing_in(world, "east", 0, -1)] == OUT_OF_RANGE).mean() > 0.8


def test_ceiling_above_the_field_of_view_is_said_to_be(build):
    world = build.world(build.shell(*ROOM), INSIDE, scan=build.scanner(low_deg=-60, high_deg=5))
    why = world.explain()
    at, _ = places(world)
    inner = facing_in(world, "ceiling", 2, -1) & clear_of_rims(at, *ROOM)
    assert (why.reason_of_patch[inner] == OUT_OF_VIEW).all()


def test_surface_beyond_the_asked_incidence_is_too_oblique(build):
    world = build.world(
        build.shell((0, 0, 0), (12, 3, 2.5)), [(1, 1.5, 1.5)], limits=PointLimits(incidence_rad=np.deg2rad(60))
    )
    at, normal = places(world)
    away = at - world.candidates_m[0]
    incidence = np.arccos(np.abs((away * normal).sum(axis=1)) / np.linalg.norm(away, axis=1))
    world.seen = rows_without(world.seen, incidence > np.deg2rad(60))
    why = world.explain()
    floor = facing_in(world, "floor", 2, 1) & (at[:, 0] > 5) & (at[:, 0] < 11.5) & (abs(at[:, 1] - 1.5) < 1.2)
    assert (why.reason_of_patch[floor] == TOO_OBLIQUE).all()
    assert incidence[why.reason_of_patch == TOO_OBLIQUE].min() > np.deg2rad(60 - 10)


def test_asked_spacing_makes_surface_too_sparse_and_asked_noise_too_noisy(build):
    for asked, expected in ((PointLimits(spacing_m=0.001), TOO_SPARSE), (PointLimits(noise_m=0.001), TOO_NOISY)):
        scan = replace(build.scanner(), range_noise=((1.0, 0.8, 0.002), (50.0, 0.8, 0.002)))
        world = build.world(build.shell(*ROOM), INSIDE, limits=asked, scan=scan)
        world.seen = rows_without(world.seen, np.ones(world.seen.n_patches, dtype=bool))
        at, _ = places(world)
        inner = facing_in(world, "east", 0, -1) & clear_of_rims(at, *ROOM)
        assert (world.explain(()).reason_of_patch[inner] == expected).all()


def test_surface_that_too_few_candidates_see_is_told_from_what_is_not_worth_it(build):
    both, one = [(1.0, 1.5, 1.5), (3.0, 1.5, 1.5)], [(1.0, 1.5, 1.5)]
    world = build.world(build.shell(*ROOM), one, seen_from=2)
    seen = np.bincount(world.seen.patch, minlength=world.seen.n_patches) > 0
    assert (world.explain().reason_of_patch[seen] == TOO_FEW).all()
    world = build.world(build.shell(*ROOM), both, seen_from=2)
    twice = np.bincount(world.seen.patch, minlength=world.seen.n_patches) == 2
    assert (world.explain().reason_of_patch[twice] == NOT_WORTH).all()
    assert (world.explain((0, 1)).reason_of_patch[twice] == COVERED).all()


def test_glass_returns_no_beam_and_what_is_behind_it_is_in_plain_view(build):
    pane = ("pane", (2.9, 0, 0), (2.92, 3, 2.5))
    optics = {"pane": Optics.PASSES}
    world = build.world(
        [*build.shell(*ROOM), pane], [(1, 1.5, 1.5)], optics=optics, scan=build.scanner(range_max_m=2.2)
    )
    why = world.explain()
    assert (world.reasons("pane", why) == NO_RETURN).all()
    at, _ = places(world)
    inner = facing_in(world, "east", 0, -1) & clear_of_rims(at, *ROOM)
    assert (why.reason_of_patch[inner] == OUT_OF_RANGE).all()


def test_patches_out_of_scope_have_no_reason(build):
    world = build.world(build.shell(*ROOM), INSIDE)
    scope = world.of("west")
    why = world.explain(scope=scope)
    assert (why.reason_of_patch[~scope] == OUT_OF_SCOPE).all()
    assert (why.reason_of_patch[scope] < len(REASONS)).all()
    assert sum(why.area_by_reason_m2) == pytest.approx(world.survey.patches.area_m2[scope].sum(), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_areas_add_up_whatever_is_in_the_room(build, seed):
    rng = np.random.default_rng(seed)
    boxes = build.shell(*ROOM)
    for i in range(5):
        low = rng.uniform([0, 0, 0], [3, 2, 1.5])
        boxes.append((f"box {i}", tuple(low), tuple(low + rng.uniform(0.05, 0.9, 3))))
    world = build.world(
        boxes, [(0.2, 0.2, 2.3), (3.8, 2.8, 2.4), (3.8, 0.2, 2.3)], scan=build.scanner(rows=40, columns=80)
    )
    scope = rng.random(world.seen.n_patches) < 0.8
    why = world.explain((1,), scope=scope)
    area_m2, covered = world.survey.patches.area_m2, np.zeros(scope.size, dtype=bool)
    covered[world.seen.row(1)] = True
    assert why.area_by_reason_m2[COVERED] == pytest.approx(area_m2[scope & covered].sum(), abs=1e-9)
    assert sum(why.area_by_reason_m2) == pytest.approx(area_m2[scope].sum(), abs=1e-9)
    assert sum(u.area_m2 for u in why.unseen) == pytest.approx(area_m2[scope & ~covered].sum(), abs=1e-9)
    for number, reason in enumerate(REASONS[1:], start=1):
        listed = sum(u.area_m2 for u in why.unseen if u.reason == reason)
        assert listed == pytest.approx(area_m2[why.reason_of_patch == number].sum(), abs=1e-9), reason


def test_reasons_are_the_same_bytes_twice_and_few_samples_keep_the_sums(build, monkeypatch):
    world = build.world([*build.shell(*ROOM), ("table", (1, 1, 0.7), (3, 2, 0.75))], [(2, 0.5, 1.5), (2, 2.5, 1.5)])
    first, second = world.explain(), world.explain()
    assert first.reason_of_patch.tobytes() == second.reason_of_patch.tobytes()
    monkeypatch.setattr(patch_reasons, "MAX_SAMPLES", 10)
    coarse = world.explain()
    assert sum(coarse.area_by_reason_m2) == pytest.approx(sum(first.area_by_reason_m2), abs=1e-9)
    assert coarse.area_by_reason_m2[NOT_WORTH] == first.area_by_reason_m2[NOT_WORTH]  # known of every patch


@pytest.mark.slow
@pytest.mark.parametrize("most", [1, 5, 40, 10_000])
def test_samples_are_those_of_trying_every_size_of_cube_in_turn(most, monkeypatch):
    monkeypatch.setattr(patch_reasons, "MAX_SAMPLES", most)
    rng = np.random.default_rng(most)
    n = 3000
    normal = np.eye(3)[rng.integers(0, 3, n)] * rng.choice([-1.0, 1.0], (n, 1))
    unseen = SimpleNamespace(
        element=rng.integers(0, 2, n), room=rng.integers(-1, 1, n), normal=normal, centroid_m=rng.uniform(-9, 9, (n, 3))
    )
    rows = np.sort(rng.choice(n, 2500, replace=False))
    facing = 2 * np.abs(normal).argmax(axis=1) + (normal.sum(axis=1) > 0)
    side_m = patch_reasons.SAMPLE_M
    while True:
        cube = np.floor(unseen.centroid_m / side_m).astype(np.int64)
        key = np.column_stack([unseen.element, unseen.room, facing, cube])[rows]
        group = np.unique(key, axis=0, return_inverse=True)[1].ravel()
        if group.max() < most or side_m > 1e5:
            break
        side_m *= 1.5
    samples, of_sample = patch_reasons.samples_of(unseen, rows)
    assert of_sample.tolist() == group.tolist()
    for number, sample in enumerate(samples.tolist()):
        same = rows[group == number]
        assert sample == same[same.size // 2]
