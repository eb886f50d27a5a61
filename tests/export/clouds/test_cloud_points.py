"""Blocks and points of simulated clouds, against a room whose every beam is computed by hand."""

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from cloud_room import FRAME, REFLECTIVITY, SCANNER, SHAPE, STATIONS_M, edited_plan, expected_scan, to_site
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import ExportError, RequirementError
from planner_core.export.clouds.points import Clouds, ScanBlock, cloud_stations, open_clouds, thinning_step
from planner_core.export.options import Options
from planner_core.model import BeamTemplate, FloatArray, ScanBatch
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import ProgressEvent

FIELDS = ("range_m", "cos_incidence", "intensity", "triangle", "patch")


def whole(clouds: Clouds, station: int = 0) -> dict[str, np.ndarray]:
    """All blocks of a station, one under the other."""
    blocks = list(clouds.blocks(clouds.stations[station]))
    return {name: np.concatenate([getattr(block, name) for block in blocks]) for name in FIELDS}


@pytest.mark.parametrize("station", [0, 1])
def test_a_scan_has_the_ranges_angles_and_intensities_of_the_room(source: PlanSource, station: int) -> None:
    clouds = open_clouds(source, Options())
    found, expected = whole(clouds, station), expected_scan(clouds.stations[station].id)
    assert found["range_m"].shape == SHAPE
    np.testing.assert_allclose(found["range_m"], expected.range_m, atol=2e-5)
    np.testing.assert_allclose(found["cos_incidence"], expected.cosine, atol=1e-6)
    np.testing.assert_allclose(found["intensity"], REFLECTIVITY * expected.cosine, atol=1e-6)
    assert (found["triangle"] >= 0).all()


def test_points_lie_on_the_walls_in_the_scene_and_on_the_site(source: PlanSource) -> None:
    clouds = open_clouds(source, Options())
    (points,) = clouds.points(clouds.stations[1])
    expected = expected_scan("S002")
    at = points.row, points.column
    np.testing.assert_allclose(points.scene_m, expected.scene_m[at], atol=2e-5)
    np.testing.assert_allclose(points.site_m, to_site(expected.scene_m[at]), atol=2e-5)
    np.testing.assert_allclose(points.from_sensor_m + np.array(STATIONS_M["S002"]), points.scene_m, atol=1e-9)
    np.testing.assert_allclose(np.cos(points.incidence_rad), expected.cosine[at], atol=1e-6)
    np.testing.assert_allclose(points.elevation_rad, expected.elevation_rad[at], atol=1e-12)


def test_beams_without_return_are_in_the_grid_and_not_among_the_points(plan_folder: Path, tmp_path: Path) -> None:
    source = open_plan(edited_plan(plan_folder, tmp_path, range_max_m=2.5))
    clouds = open_clouds(source, Options())
    found = whole(clouds)
    missed = np.isnan(found["range_m"])
    np.testing.assert_array_equal(missed, np.isnan(np.where(expected_scan("S001").range_m > 2.5, np.nan, 1.0)))
    assert 0 < missed.sum() < missed.size
    assert (found["triangle"][missed] == -1).all()
    assert np.isnan(found["intensity"][missed]).all()
    assert sum(len(points) for points in clouds.points(clouds.stations[0])) == (~missed).sum()


@pytest.mark.parametrize("most", [None, 900])
def test_points_of_a_hanging_scanner_with_offset_channels_lie_on_the_walls(
    plan_folder: Path, tmp_path: Path, most: int | None
) -> None:
    offsets = np.random.default_rng(0).uniform(-0.1, 0.1, SHAPE[0])
    scanner = replace(SCANNER, inverted=True, azimuth_offset_rad=tuple(offsets))
    folder = edited_plan(plan_folder, tmp_path, inverted=True, azimuth_offset_rad=list(offsets))
    clouds = open_clouds(open_plan(folder), Options(max_points=most))
    (points,) = clouds.points(clouds.stations[0])
    at = points.row * clouds.step, points.column * clouds.step
    np.testing.assert_allclose(points.scene_m, expected_scan("S001", scanner).scene_m[at], atol=2e-5)
    assert points.elevation_rad.max() == pytest.approx(np.radians(60))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("block_beams", [1, 7 * SHAPE[1] + 3])
def test_the_size_of_blocks_changes_no_bit(source: PlanSource, block_beams: int, noise: bool) -> None:
    clouds = open_clouds(source, Options(noise=noise, seed=3))
    small = replace(clouds, block_beams=block_beams)
    one, other = whole(clouds), whole(small)
    for name in FIELDS:
        np.testing.assert_array_equal(one[name], other[name])
    sizes = [block.range_m.shape[0] for block in small.blocks(clouds.stations[0])]
    assert max(sizes) == max(1, block_beams // SHAPE[1])


def test_beams_of_several_blocks_are_cast_at_once_and_never_more(source: PlanSource) -> None:
    clouds = replace(open_clouds(source, Options()), block_beams=SHAPE[1])
    n_cast: list[int] = []

    class Counting:
        warnings = ()

        def scan(self, template: BeamTemplate, positions_m: FloatArray) -> ScanBatch:
            n_cast.append(template.shape[0])
            return clouds.engine.scan(template, positions_m)

    counted = whole(replace(clouds, scan_engine=cast(ScanEngine, Counting())))
    assert (max(n_cast), sum(n_cast)) == (8, SHAPE[0])
    np.testing.assert_array_equal(counted["range_m"], whole(clouds)["range_m"])


@pytest.mark.slow
def test_noisy_points_are_the_same_whatever_the_blocks(source: PlanSource) -> None:
    clouds = open_clouds(source, Options(noise=True))
    (one,) = clouds.points(clouds.stations[0])
    rows = list(replace(clouds, block_beams=1).points(clouds.stations[0]))
    np.testing.assert_array_equal(one.site_m, np.concatenate([points.site_m for points in rows]))
    np.testing.assert_array_equal(one.row, np.concatenate([points.row for points in rows]))


@pytest.mark.parametrize("noise", [False, True])
def test_a_thinned_cloud_is_every_nth_row_and_column_of_the_whole(source: PlanSource, noise: bool) -> None:
    options = Options(noise=noise, seed=5)
    everything = whole(open_clouds(source, options))
    thinned = open_clouds(source, replace(options, max_points=700))
    assert thinned.step == 7
    found = whole(thinned)
    for name in FIELDS:
        np.testing.assert_array_equal(found[name], everything[name][::7, ::7])
    assert found["range_m"].size <= 700
    assert "one row and column of beams in 7, 11 x 58 of 76 x 400" in " ".join(thinned.remarks())


def test_an_unthinned_cloud_makes_no_remark(source: PlanSource) -> None:
    clouds = open_clouds(source, Options(max_points=SHAPE[0] * SHAPE[1]))
    whole(clouds)
    assert clouds.remarks() == clouds.engine.warnings


@pytest.mark.slow
@given(st.integers(1, 400), st.integers(1, 400), st.integers(1, 200_000))
@settings(max_examples=300, deadline=None)
def test_the_step_of_thinning_is_the_least_that_does(n_rows: int, n_columns: int, most: int) -> None:
    def n_left(step: int) -> int:
        return len(range(0, n_rows, step)) * len(range(0, n_columns, step))

    steps = range(1, max(n_rows, n_columns) + 1)
    assert thinning_step((n_rows, n_columns), most) == next(step for step in steps if n_left(step) <= most)


def test_progress_counts_the_beams_of_all_stations_to_the_end(source: PlanSource) -> None:
    events: list[ProgressEvent] = []
    clouds = replace(open_clouds(source, Options()), progress=events.append, block_beams=SHAPE[1] * 20)
    for station in clouds.stations:
        for _ in clouds.blocks(station):
            pass
    done = [event.done for event in events]
    assert done == sorted(set(done))
    assert done[-1] == events[-1].total == 2 * SHAPE[0] * SHAPE[1]
    assert [events[0].note, events[-1].note] == ["S001", "S002"]


def test_blocks_are_made_when_asked_for_one_at_a_time(source: PlanSource) -> None:
    events: list[ProgressEvent] = []
    clouds = replace(open_clouds(source, Options()), progress=events.append, block_beams=SHAPE[1])
    blocks = clouds.blocks(clouds.stations[0])
    first, second = next(blocks), next(blocks)
    assert isinstance(first, ScanBlock)
    assert (first.first_row, second.first_row, len(events)) == (0, 1, 1)


def test_stations_are_those_asked_for_in_visiting_order(source: PlanSource) -> None:
    def ids(options: Options) -> list[str]:
        return [station.id for station in cloud_stations(source, options)]

    everyone = [station.id for station in source.stations]
    assert sorted(everyone) == ["S001", "S002"]
    assert ids(Options()) == everyone
    assert ids(Options(stations=tuple(reversed(everyone)))) == everyone
    assert ids(Options(stations=("S002",))) == ["S002"]
    assert ids(Options(floors=("f0",))) == everyone
    with pytest.raises(RequirementError, match="'S009', expected one of S001, S002"):
        ids(Options(stations=("S009",)))
    with pytest.raises(RequirementError, match="floor: got 'attic'"):
        ids(Options(floors=("attic",)))


def test_a_plan_without_stations_is_refused(source: PlanSource) -> None:
    with pytest.raises(ExportError, match="no station"):
        cloud_stations(replace(source, stations=()), Options())


def test_no_points_at_all_can_not_be_asked_for(source: PlanSource) -> None:
    with pytest.raises(RequirementError, match="max_points: got 0"):
        open_clouds(source, Options(max_points=0))


def test_a_missing_scene_is_named(plan_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = edited_plan(plan_folder, tmp_path / "moved")
    (folder.parent / "room.obj").rename(tmp_path / "elsewhere.obj")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ExportError, match=r"room\.obj is not found.*--scene"):
        open_clouds(open_plan(folder, frame=FRAME), Options())
    found = open_plan(folder, scene=tmp_path / "elsewhere.obj")
    assert len(open_clouds(found, Options()).stations) == 2
