"""Scans without a plan, written to a folder: what is in the files, and that no scan is held whole."""

import resource
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO as Oiio
import pytest
import trimesh
from cloud_room import SCANNER, SHAPE, STATIONS_M, expected_scan, write_room

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.errors import ExportError, OutputExistsError, RequirementError
from planner_core.export.clouds.points import STAGE, Clouds
from planner_core.export.clouds.simulated import FORMATS, simulated_clouds, write_simulated_scans
from planner_core.model import PlanSettings, Station, Survey
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scanner.template import make_template
from planner_core.scene.load import LoadOptions, load_scene

SETTINGS = PlanSettings(scanner=SCANNER, max_patch_area_m2=0.5)
N_BEAMS = SHAPE[0] * SHAPE[1]


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    path = write_room(tmp_path_factory.mktemp("simulated") / "room.obj")
    return make_survey(load_scene(path, options=LoadOptions(metres_per_unit=1.0, up_axis="Z")), SETTINGS)


def clouds_of(survey: Survey, progress: Progress = silent) -> Clouds:
    stations = [
        Station(name, "F0", order, np.array(at) - survey.scene.offset_m, instrument_height_m=1.5)
        for order, (name, at) in enumerate(STATIONS_M.items(), start=1)
    ]
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    return simulated_clouds(survey, SETTINGS, stations, engine, progress=progress)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.slow
def test_every_station_has_the_points_and_images_of_the_room(survey: Survey, tmp_path: Path) -> None:
    folder = tmp_path / "scans"
    written = write_simulated_scans(clouds_of(survey), FORMATS, folder)
    assert [scan.station_id for scan in written] == ["S001", "S002"]
    assert names(folder) == sorted(name for scan in written for name in scan.files)
    for scan in written:
        expected = expected_scan(scan.station_id)
        hit = np.isfinite(expected.range_m)
        assert scan.files == tuple(f"{scan.station_id}.{suffix}" for suffix in FORMATS)
        assert (scan.n_beams, scan.n_returns) == (N_BEAMS, hit.sum())
        points = np.asarray(trimesh.load(folder / f"{scan.station_id}.ply", process=False).vertices)
        np.testing.assert_allclose(points, expected.scene_m[hit], atol=2e-5)
        with OpenEXR.File(str(folder / f"{scan.station_id}.exr"), separate_channels=True) as file:
            returns = file.parts[0]
            np.testing.assert_allclose(returns.channels["range"].pixels, expected.range_m, atol=2e-5)
            assert returns.header["tlsplan:coordinates"] == "scene coordinates, no CRS"
            at_m = np.array(returns.header["tlsplan:positionScene"].split(), float)
            np.testing.assert_allclose(at_m, STATIONS_M[scan.station_id], atol=1e-6)
            assert float(returns.header["tlsplan:instrumentHeight"]) == 1.5
        picture = Oiio.ImageBuf(str(folder / f"{scan.station_id}.png")).get_pixels(Oiio.UINT8)
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


@pytest.mark.slow
def test_formats_asked_for_are_the_files_of_all_formats(survey: Survey, tmp_path: Path) -> None:
    everything = write_simulated_scans(clouds_of(survey), FORMATS, tmp_path / "all")
    for formats in (("png",), ("ply", "exr")):
        folder = tmp_path / formats[0]
        some = write_simulated_scans(clouds_of(survey), formats, folder)
        assert names(folder) == sorted(f"{name}.{suffix}" for name in STATIONS_M for suffix in formats)
        for path in folder.iterdir():
            assert path.read_bytes() == (tmp_path / "all" / path.name).read_bytes()
        assert [scan.n_returns for scan in some] == [scan.n_returns for scan in everything]


def test_progress_counts_the_beams_of_every_pass_to_the_end(survey: Survey, tmp_path: Path) -> None:
    events: list[ProgressEvent] = []
    clouds = replace(clouds_of(survey, events.append), block_beams=20 * SHAPE[1])
    write_simulated_scans(clouds, FORMATS, tmp_path / "scans")
    done = [event.done for event in events]
    assert done == sorted(set(done))
    assert {event.total for event in events} == {done[-1]} == {2 * 2 * N_BEAMS}
    assert {event.stage for event in events} == {STAGE}
    assert [event.note for event in events[:: len(events) - 1]] == ["S001", "S002"]


class Stop:
    """Does something in place of the progress after some blocks."""

    def __init__(self, after: int, act: Callable[[], None]) -> None:
        self.left, self.act = after, act

    def __call__(self, event: ProgressEvent) -> None:
        self.left -= 1
        if self.left < 0:
            self.act()


def interrupt() -> None:
    raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize("after", [0, 12, 35])  # within either pass and station, of 10 blocks each
def test_an_interrupt_leaves_what_was_there_before_and_nothing_else(survey: Survey, tmp_path: Path, after: int) -> None:
    for overwrite in (False, True):
        clouds = replace(clouds_of(survey, Stop(after, interrupt)), block_beams=8 * SHAPE[1])
        with pytest.raises(KeyboardInterrupt):
            write_simulated_scans(clouds, FORMATS, tmp_path / "scans", overwrite=overwrite)
        assert names(tmp_path) == (["scans"] if overwrite else [])
        if not overwrite:
            (tmp_path / "scans").mkdir()
            (tmp_path / "scans" / "S001.ply").write_text("older")
    assert (tmp_path / "scans" / "S001.ply").read_text() == "older"
    assert names(tmp_path / "scans") == ["S001.ply"]


@pytest.mark.parametrize(("after", "room"), [(0, 0), (35, 200_000)])
def test_a_full_disk_is_told_in_one_line_and_leaves_nothing(
    survey: Survey, tmp_path: Path, after: int, room: int
) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    fill = Stop(after, lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1])))
    clouds = replace(clouds_of(survey, fill), block_beams=8 * SHAPE[1])
    try:
        with pytest.raises(ExportError, match=r"scans: can't be written \(.*nothing was changed") as caught:
            write_simulated_scans(clouds, FORMATS, tmp_path / "scans")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "\n" not in str(caught.value)
    assert names(tmp_path) == []


def test_a_folder_that_holds_something_is_replaced_only_when_told(survey: Survey, tmp_path: Path) -> None:
    (tmp_path / "scans").mkdir()
    (tmp_path / "scans" / "S009.ply").write_text("older")
    with pytest.raises(OutputExistsError, match="--overwrite"):
        write_simulated_scans(clouds_of(survey), ("png",), tmp_path / "scans")
    assert names(tmp_path / "scans") == ["S009.ply"]
    write_simulated_scans(clouds_of(survey), ("png",), tmp_path / "scans", overwrite=True)
    assert names(tmp_path / "scans") == ["S001.png", "S002.png"]


@pytest.mark.parametrize("formats", [(), ("ply", "e57")])
def test_another_format_or_none_is_refused_before_any_beam(
    survey: Survey, tmp_path: Path, formats: tuple[str, ...]
) -> None:
    with pytest.raises(RequirementError, match="expected some of exr, png, ply"):
        write_simulated_scans(clouds_of(survey, Stop(0, interrupt)), formats, tmp_path / "scans")
    assert names(tmp_path) == []


@pytest.mark.slow
@pytest.mark.parametrize("formats", [("exr", "png"), pytest.param(("ply",), marks=pytest.mark.slow)])
def test_memory_does_not_grow_with_the_number_of_beams(
    survey: Survey, tmp_path: Path, formats: tuple[str, ...]
) -> None:
    n_columns, n_few, n_many = 60, 3_000, 6_000  # previews of either have 1500 rows
    peak = []
    for n_rows in (n_few, n_few, n_many):  # the first one pays for what is loaded and built once
        elevation = tuple(np.deg2rad(np.linspace(90, -60, n_rows)).tolist())
        template = make_template(replace(SCANNER, n_azimuths=n_columns, elevation_rad=elevation))
        clouds = clouds_of(replace(survey, template=template))
        clouds = replace(clouds, block_beams=125 * n_columns)
        tracemalloc.start()
        write_simulated_scans(clouds, formats, tmp_path / f"{len(peak)}")
        peak.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # Any array of the whole scan has at least a byte a beam; a row has an elevation, and some texts of it.
    assert peak[2] - peak[1] < (n_many - n_few) * (n_columns / 2 + 100)
