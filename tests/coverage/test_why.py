"""What stations add, the curve, and the list of the unseen, against sums in plain NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.coverage.patch_reasons import surfaces_of
from planner_core.coverage.why import _piece, steepest_curve
from planner_core.model import REASONS, Link, Visibility
from planner_core.model.unseen import NOT_WORTH
from planner_core.scene.patches import patch_triangles

ROOMS = [((0, 0, 0), (4, 3, 2.5)), ((4.1, 0, 0), (8, 3, 2.5))]


@pytest.fixture(scope="module")
def flat(build):
    """Two rooms with a doorway in the wall between them, four candidates in each."""
    boxes = build.shell((0, 0, 0), (8, 3, 2.5))
    boxes += [("left of door", (4, 0, 0), (4.1, 1, 2.5)), ("right of door", (4, 2, 0), (4.1, 3, 2.5))]
    spots = [(x, y, 1.5) for x in (1.0, 3.0, 5.0, 7.0) for y in (0.8, 2.2)]
    rooms = [build.room(name, low, high) for name, (low, high) in zip("ab", ROOMS, strict=True)]
    return build.world(boxes, spots, rooms=rooms, scan=build.scanner(rows=60, columns=120))


def seen_by(world, stations):
    out = np.zeros((len(stations), world.seen.n_patches), dtype=bool)
    for i, station in enumerate(stations):
        out[i, world.seen.row(station)] = True
    return out


@pytest.mark.slow
def test_own_area_is_what_goes_when_the_station_goes(flat):
    stations = (0, 3, 6)
    why, seen = flat.explain(stations), seen_by(flat, stations)
    area_m2 = flat.survey.patches.area_m2
    for i, reason in enumerate(why.stations):
        without = np.delete(seen, i, axis=0).any(axis=0)
        assert reason.own_area_m2 == pytest.approx(area_m2[seen.any(axis=0) & ~without].sum(), abs=1e-9)
        assert reason.own_parts[0].area_m2 <= reason.own_area_m2
        areas = [part.area_m2 for part in reason.own_parts]
        assert areas == sorted(areas, reverse=True)


def test_own_parts_name_the_element_and_the_room(flat):
    (only,) = flat.explain((0,)).stations
    scene, area_m2 = flat.survey.scene, flat.survey.patches.area_m2
    seen = seen_by(flat, (0,))[0]
    at = patch_triangles(scene, flat.survey.patches).mean(axis=1)
    for part in only.own_parts:
        mine = seen & flat.of(scene.elements[part.element].name)
        low, high = ROOMS[part.room]
        within = ((at > np.array(low) - 0.01) & (at < np.array(high) + 0.01)).all(axis=1)
        assert part.area_m2 == pytest.approx(area_m2[mine & within].sum(), rel=0.02)  # faces in the doorway aside


def test_only_links_that_count_are_named(flat):
    links = (
        Link("S0", "S3", 0.5, 0.2, probability=0.999),
        Link("S0", "S6", 0.1, 0.2, probability=0.9),
        Link("S3", "S6", 0.5, 0.0001),
    )
    linked = {reason.station: reason.linked for reason in flat.explain((0, 3, 6), links=links).stations}
    assert linked == {"S0": ("S3",), "S3": ("S0",), "S6": ()}


def test_best_spot_is_that_of_a_search_over_all_candidates(flat):
    why = flat.explain((0,))
    area_m2, room_of = flat.survey.patches.area_m2, {}
    seen = seen_by(flat, range(8))
    missed = why.reason_of_patch == NOT_WORTH
    listed = [u for u in why.unseen if u.reason == "not worth a station"]
    assert listed
    for surface in listed:
        room_of.setdefault(surface.element, set()).add(surface.room)
    for surface in listed:
        spot = surface.best_position
        assert np.array_equal(spot.position_m, flat.candidates_m[spot.candidate])
        assert spot.adds_m2 == pytest.approx(area_m2[seen[spot.candidate] & missed].sum(), abs=1e-9)
        if len(room_of[surface.element]) == 1:
            mine = missed & flat.of(flat.survey.scene.elements[surface.element].name)
            most = max(area_m2[row & mine].sum() for row in seen)
            assert spot.sees_m2 == pytest.approx(most, abs=1e-9)
    assert all(u.best_position is None for u in why.unseen if u.reason != "not worth a station")


def test_pieces_lie_in_their_boxes_and_do_not_exceed_their_surface(flat):
    corners = patch_triangles(flat.survey.scene, flat.survey.patches)
    unseen = flat.explain((0,)).unseen
    assert [surface.area_m2 for surface in unseen] == sorted((surface.area_m2 for surface in unseen), reverse=True)
    for surface in unseen:
        assert len(surface.pieces) == min(surface.n_pieces, 5)
        assert sum(piece.area_m2 for piece in surface.pieces) <= surface.area_m2 + 1e-9
        if surface.n_pieces <= 5:
            assert sum(piece.area_m2 for piece in surface.pieces) == pytest.approx(surface.area_m2, abs=1e-9)
        for piece in surface.pieces:
            low, high = piece.box_m
            assert (piece.centroid_m >= low - 1e-9).all()
            assert (piece.centroid_m <= high + 1e-9).all()
            assert (corners[piece.patch] >= low - 1e-5).all()
            assert (corners[piece.patch] <= high + 1e-5).all()


def test_piece_of_slivers_without_area_lies_amid_them(flat):
    unseen = surfaces_of(flat.survey, np.arange(8, dtype=np.int32))
    piece = _piece(replace(unseen, area_m2=np.zeros(8)), np.arange(8))
    np.testing.assert_allclose(piece.centroid_m, unseen.centroid_m.mean(axis=0))
    assert piece.area_m2 == 0.0


def test_patches_are_of_the_piece_that_is_told_of_them(flat):
    why = flat.explain((0,))
    area_m2, told = flat.survey.patches.area_m2, set()
    for surface in why.unseen:
        for piece in surface.pieces:
            mine = np.flatnonzero(why.piece_of_patch == piece.patch)
            assert piece.patch in mine
            assert mine.size == piece.n_patches
            assert area_m2[mine].sum() == pytest.approx(piece.area_m2, abs=1e-9)
            assert {REASONS[k] for k in why.reason_of_patch[mine]} == {surface.reason}
            told.add(piece.patch)
    assert set(np.unique(why.piece_of_patch)) - {-1} == told


@st.composite
def observations(draw):
    n_patches = draw(st.integers(1, 12))
    rows = draw(st.lists(st.sets(st.integers(0, n_patches - 1)), min_size=1, max_size=5))
    patch = np.concatenate([np.array(sorted(row), dtype=np.int32) for row in rows])
    starts = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    area_m2 = np.array(draw(st.lists(st.integers(1, 9), min_size=n_patches, max_size=n_patches)), dtype=np.float64)
    return rows, Visibility(starts, patch, n_patches), area_m2


def curve_by_looking_at_all(rows, area_m2, seen_from):
    """Stations, and what is covered, where each step looks at every station that is left."""
    looks, left, out = dict.fromkeys(range(area_m2.size), 0), list(range(len(rows))), []
    while left:
        best = max(left, key=lambda index: (sum(area_m2[p] for p in rows[index] if looks[p] < seen_from), -index))
        left.remove(best)
        for patch in rows[best]:
            looks[patch] += 1
        out.append((f"S{best}", sum(area_m2[p] for p, n in looks.items() if n >= seen_from)))
    return out


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(observations(), st.integers(1, 3))
def test_curve_is_that_of_looking_at_every_station_again(drawn, seen_from):
    rows, visibility, area_m2 = drawn
    ids = [f"S{i}" for i in range(len(rows))]
    curve = steepest_curve(visibility, ids, area_m2, np.ones(area_m2.size, dtype=bool), seen_from)
    expected = curve_by_looking_at_all(rows, area_m2, seen_from)
    assert [(step.station, step.covered_area_m2) for step in curve] == expected
    for step in curve:
        assert step.fraction_of_achievable == step.covered_area_m2 / area_m2.sum()
