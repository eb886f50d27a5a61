"""How much of cut patches is seen, against areas of a drawing and a plain loop over Open3D's rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stages import visible_from

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.coverage.visibility_threshold import points_of, shares_of_cut_patches
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_samples import places_of
from planner_core.model import PlanSettings, Requirements, Survey, Visibility
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(
    scanner=load_scanner("rtc360"), requirements=Requirements(network="none", scope="all"), max_patch_area_m2=0.04
)


def seen_from(survey: Survey, positions_m: np.ndarray, engine: str) -> tuple[Visibility, np.ndarray, np.ndarray]:
    """Rows, patches of them, and their shares."""
    opened = open_engine(survey.scene, survey.patches, engine=engine)
    rows = visible_from(survey, SETTINGS, opened, positions_m)
    patches = np.unique(rows.patch).astype(np.int32)
    # The samples' shares say no more than who looks first.
    share = (rows.patch % 200).astype(np.uint8)
    return rows, patches, shares_of_cut_patches(survey, opened, positions_m, rows, share, patches)


@pytest.mark.parametrize("engine", ["opencl", "open3d"])
@pytest.mark.parametrize("origin_m", [0.0, 4_500_000.0])
def test_what_walls_leave_of_a_floor_is_the_area_of_the_drawing(engine: str, origin_m: float) -> None:
    """`box`: 6 x 4 x 2.7 m clear. Every patch that the walls cut is cut on the same line."""
    scene = scenes_synthetic.build("box").scene
    moved = replace(scene, offset_m=scene.offset_m + origin_m)
    survey = make_survey(moved, SETTINGS)
    at = np.array([[x, y, 1.7] for x in (0.7, 3.1, 5.3) for y in (0.7, 3.3)])
    _, patches, share = seen_from(survey, at, engine)
    area_m2 = float((survey.patches.area_m2[patches] * share / 255).sum())
    assert area_m2 == pytest.approx(2 * (6 * 4 + 6 * 2.7 + 4 * 2.7), rel=0.001)
    assert 0.05 < (share < 255).mean() < 0.5


@pytest.mark.slow
def test_shares_are_those_of_many_random_points() -> None:
    """Two rooms from two places: 2000 points a patch, each looked at by itself."""
    survey = make_survey(scenes_synthetic.build("two-rooms").scene, SETTINGS)
    at = np.array([[2.2, 1.9, 1.7], [7.1, 2.4, 1.7]])
    _, patches, share = seen_from(survey, at, "open3d")
    casting = Open3DEngine(survey.scene, survey.patches)
    rng = np.random.default_rng(5)
    cut = np.flatnonzero(share < 255)[::7]
    assert cut.size > 30
    corners_m = places_of(survey.scene, survey.patches, patches[cut]).corners_m
    u, v = rng.random((2, cut.size, 2000))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    edge = corners_m[:, 1:] - corners_m[:, :1]
    points_m = corners_m[:, :1] + u[..., None] * edge[:, None, 0] + v[..., None] * edge[:, None, 1]
    seen = np.zeros(points_m.shape[:2], dtype=np.bool_)
    for position_m in at:
        away_m = (points_m - position_m).reshape(-1, 3)
        low = np.arctan2(away_m[:, 2], np.hypot(away_m[:, 0], away_m[:, 1])) >= survey.template.elevation_rad.min()
        free = ~casting.are_hidden(position_m, away_m * (1 - 1e-4))
        seen |= (free & low).reshape(seen.shape)
    off = share[cut] / 255 - seen.mean(axis=1)
    assert np.abs(off).max() < 0.15  # 32 points of an even lattice
    assert abs(off.mean()) < 0.02  # and what is too much on one is too little on another


def test_no_patches_have_no_shares() -> None:
    survey = make_survey(scenes_synthetic.build("box").scene, SETTINGS)
    engine = open_engine(survey.scene, survey.patches)
    rows = Visibility(np.zeros(2, dtype=np.int64), np.empty(0, dtype=np.int32), survey.patches.n_patches)
    none = np.empty(0, dtype=np.int32)
    assert shares_of_cut_patches(survey, engine, np.ones((1, 3)), rows, none.astype(np.uint8), none).size == 0


def test_points_even_out_over_patches_that_are_cut_alike() -> None:
    """Of a triangle, 1 - (1 - t)^2 has a weight below t; 32 points of one patch miss that by up to a fifth, in turn."""
    u, v = points_of(np.arange(1000, dtype=np.int32))
    assert (u >= 0).all() and (v >= 0).all() and (u + v <= 1).all()
    most_of_one = 0.0
    for t in np.linspace(0.03, 0.97, 48):
        off = np.stack([(weight < t).mean(axis=1) - (1 - (1 - t) ** 2) for weight in (u, v, 1 - u - v)])
        assert np.abs(off.mean(axis=1)).max() < 0.004
        most_of_one = max(most_of_one, float(np.abs(off).max()))
    assert 0.05 < most_of_one < 0.2
