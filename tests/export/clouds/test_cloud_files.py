"""Clouds as files, read back by readers that are not ours, and compared with the room on paper."""

import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import e57
import laspy
import numpy as np
import open3d
import OpenEXR
import OpenImageIO
import pye57
import pyproj
import pytest
import trimesh
from cloud_room import (
    FRAME,
    ORIGIN_M,
    REFLECTIVITY,
    ROTATION_RAD,
    SHAPE,
    STATIONS_M,
    edited_plan,
    expected_scan,
    to_site,
)
from numpy.typing import NDArray

from planner_core.export.clouds.e57 import rotation_of
from planner_core.export.clouds.exr import _Preview
from planner_core.export.clouds.points import ScanBlock, open_clouds
from planner_core.export.formats import FORMATS
from planner_core.export.options import Options
from planner_core.export.write import export_plan
from planner_core.plan_folder.plan_source import PlanSource, open_plan

Floats = NDArray[np.float64]
TOGETHER = ("e57", "las", "laz", "ply")
SPLIT = ("e57-split", "las-split", "laz-split", "ply-split", "exr")
#: Half a step of 0.1 mm, and the engines' float32 ranges.
STEP_M = 5e-5 + 2e-5
N_BEAMS = SHAPE[0] * SHAPE[1]


def write(source: PlanSource, folder: Path, name: str, options: Options = Options()) -> Path:  # noqa: B008 - frozen
    """Write a format under its standard name."""
    target = folder / FORMATS[name].file_name
    export_plan(name, source, target, options)
    return target


@pytest.fixture(scope="module")
def files(source: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Every format, in site coordinates, without noise."""
    folder = tmp_path_factory.mktemp("files")
    return {name: write(source, folder, name) for name in (*TOGETHER, *SPLIT)}


def ids_in_order(source: PlanSource) -> list[str]:
    return [station.id for station in source.stations]


def expected_site(source: PlanSource) -> Floats:
    """(2 N, 3) points of all stations in their order, on the site."""
    return np.concatenate([to_site(expected_scan(name).scene_m).reshape(-1, 3) for name in ids_in_order(source)])


def expected_of_all(source: PlanSource, what: str) -> Floats:
    return np.concatenate([getattr(expected_scan(name), what).ravel() for name in ids_in_order(source)])


# --------------------------------------------------------------------------------------------------- E57
def posed(scene_m: Floats, station_id: str) -> Floats:
    """On the site as a pose has it: turned and shifted, with true distances around the station."""
    at = np.array(STATIONS_M[station_id])
    cos, sin = np.cos(ROTATION_RAD), np.sin(ROTATION_RAD)
    way = scene_m.reshape(-1, 3) - at
    turned = np.stack([cos * way[:, 0] - sin * way[:, 1], sin * way[:, 0] + cos * way[:, 1], way[:, 2]], axis=1)
    return turned + to_site(at)


def test_e57_read_by_a_rust_reader_has_the_points_on_the_site(source: PlanSource, files: dict[str, Path]) -> None:
    cloud = e57.read_points(str(files["e57"]))
    expected = np.concatenate([posed(expected_scan(name).scene_m, name) for name in ids_in_order(source)])
    np.testing.assert_allclose(np.asarray(cloud.points), expected, atol=STEP_M)
    intensity = np.asarray(cloud.intensity).ravel()
    np.testing.assert_allclose(intensity, REFLECTIVITY * expected_of_all(source, "cosine"), atol=1e-5)


def test_e57_read_by_pye57_has_scans_with_poses_rows_and_columns(source: PlanSource, files: dict[str, Path]) -> None:
    file = pye57.E57(str(files["e57"]))
    assert file.scan_count == 2
    for index, name in enumerate(ids_in_order(source)):
        header = file.get_header(index)
        assert header["name"].value() == name
        np.testing.assert_allclose(header.translation, to_site(np.array(STATIONS_M[name])), atol=1e-9)
        turned = header.rotation_matrix @ np.array([1.0, 0.0, 0.0])
        np.testing.assert_allclose(turned, [np.cos(ROTATION_RAD), np.sin(ROTATION_RAD), 0.0], atol=1e-12)
        scan = file.read_scan(index, intensity=True, row_column=True, transform=False)
        own = np.stack([scan["cartesianX"], scan["cartesianY"], scan["cartesianZ"]], axis=1)
        expected = (expected_scan(name).scene_m - np.array(STATIONS_M[name]))[scan["rowIndex"], scan["columnIndex"]]
        np.testing.assert_allclose(own, expected, atol=STEP_M)
        assert (scan["rowIndex"].astype(int) * SHAPE[1] + scan["columnIndex"]).tolist() == list(range(N_BEAMS))
        low, high = own.min(axis=0), own.max(axis=0)
        np.testing.assert_allclose([header.xMinimum, header.yMinimum, header.zMinimum], low, atol=1e-9)
        np.testing.assert_allclose([header.xMaximum, header.yMaximum, header.zMaximum], high, atol=1e-9)
        assert (header.rowMaximum, header.columnMaximum) == (SHAPE[0] - 1, SHAPE[1] - 1)
    file.close()


def test_e57_names_the_crs_and_of_scene_coordinates_says_that_there_is_none(
    files: dict[str, Path], scene_source: PlanSource, tmp_path: Path
) -> None:
    def told(path: Path) -> tuple[str, str]:
        file = pye57.E57(str(path))
        texts = file.root["coordinateMetadata"].value(), file.get_header(0)["description"].value()
        file.close()
        return texts

    wkt, description = told(files["e57"])
    crs = pyproj.CRS.from_wkt(wkt)
    assert [part.to_epsg() for part in crs.sub_crs_list] == [25832, 7837]
    assert "coordinates: " in description
    assert "25832" in description
    wkt, description = told(write(scene_source, tmp_path, "e57"))
    assert wkt == ""
    assert "scene coordinates, no CRS" in description


def test_e57_guids_tell_scans_apart_and_are_the_same_again(
    source: PlanSource, files: dict[str, Path], tmp_path: Path
) -> None:
    def guids(path: Path) -> list[str]:
        file = pye57.E57(str(path))
        found = [file.root["guid"].value()] + [file.get_header(k)["guid"].value() for k in range(file.scan_count)]
        file.close()
        return found

    first = guids(files["e57"])
    assert len(set(first)) == 3
    noisy = guids(write(source, tmp_path, "e57", Options(noise=True)))
    assert not set(first) & set(noisy)


@pytest.mark.parametrize("seed", range(6))
def test_rotation_is_the_quaternion_of_any_turn(seed: int) -> None:
    from scipy.spatial.transform import Rotation

    turn = Rotation.random(random_state=seed)
    if seed < 4:  # half turns, where one component or the other is all there is
        turn = Rotation.from_quat(np.eye(4)[seed])
    matrix = np.eye(4)
    matrix[:3, :3] = turn.as_matrix() * 1.0003
    w, x, y, z = rotation_of(matrix)
    assert w >= 0
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), turn.as_matrix(), atol=1e-12)


# --------------------------------------------------------------------------------------------------- LAS
def test_las_read_by_laspy_has_points_angles_and_stations(source: PlanSource, files: dict[str, Path]) -> None:
    cloud = laspy.read(files["las"])
    xyz = np.stack([cloud.x, cloud.y, cloud.z], axis=1)
    np.testing.assert_allclose(xyz, expected_site(source), atol=STEP_M)
    np.testing.assert_allclose(cloud["range"], expected_of_all(source, "range_m"), atol=2e-5)
    cosine = expected_of_all(source, "cosine")
    np.testing.assert_allclose(np.cos(np.radians(cloud["incidence"])), cosine, atol=1e-6)
    np.testing.assert_allclose(cloud.intensity / 65535, REFLECTIVITY * cosine, atol=1e-5)
    np.testing.assert_allclose(
        cloud.scan_angle * 0.006, 90 + np.degrees(expected_of_all(source, "elevation_rad")), atol=0.0031
    )
    assert cloud.point_source_id.tolist() == [1] * N_BEAMS + [2] * N_BEAMS
    assert cloud["row"].tolist() == 2 * np.repeat(range(SHAPE[0]), SHAPE[1]).tolist()
    assert cloud["column"].tolist() == 2 * SHAPE[0] * list(range(SHAPE[1]))
    assert set(cloud.return_number) == set(cloud.number_of_returns) == set(cloud.synthetic) == {1}
    assert set(cloud.gps_time) == {0.0}


def test_las_header_is_what_the_specification_says(source: PlanSource, files: dict[str, Path]) -> None:
    """By the tables of LAS 1.4 R15, byte by byte, without any library."""
    raw = files["las"].read_bytes()
    assert raw[:4] == b"LASF"
    encoding = struct.unpack_from("<H", raw, 6)[0]
    assert encoding == 0b10000  # WKT, GPS week time
    assert raw[24:26] == bytes([1, 4])
    assert struct.unpack_from("<HH", raw, 90) == (0, 0)  # no date
    header_size, points_at, n_vlrs = struct.unpack_from("<HII", raw, 94)
    point_format, record_size = struct.unpack_from("<BH", raw, 104)
    assert (header_size, point_format, record_size) == (375, 6, 30 + 12)
    assert struct.unpack_from("<6I", raw, 107) == (0,) * 6  # legacy counts, of older formats
    scale, offset = struct.unpack_from("<3d", raw, 131), struct.unpack_from("<3d", raw, 155)
    assert scale == (0.0001,) * 3
    box = struct.unpack_from("<6d", raw, 179)
    expected = expected_site(source)
    np.testing.assert_allclose(box[0::2], expected.max(axis=0), atol=STEP_M)
    np.testing.assert_allclose(box[1::2], expected.min(axis=0), atol=STEP_M)
    n_points, *by_return = struct.unpack_from("<16Q", raw, 247)
    assert (n_points, by_return[0], sum(by_return)) == (2 * N_BEAMS, 2 * N_BEAMS, 2 * N_BEAMS)
    assert len(raw) == points_at + n_points * record_size
    at, found = header_size, {}
    for _ in range(n_vlrs):
        user, record, size = struct.unpack_from("<2x16sHH", raw, at)
        found[user.rstrip(b"\0"), record] = raw[at + 54 : at + 54 + size]
        at += 54 + size
    assert at == points_at
    crs = pyproj.CRS.from_wkt(found[b"LASF_Projection", 2112].rstrip(b"\0").decode())
    assert [part.to_epsg() for part in crs.sub_crs_list] == [25832, 7837]
    assert b"groundSite" in found[b"LASF_Spec", 3]
    names = [found[b"LASF_Spec", 4][192 * k + 4 : 192 * k + 36].rstrip(b"\0") for k in range(4)]
    assert names == [b"range", b"incidence", b"row", b"column"]
    assert [found[b"LASF_Spec", 4][192 * k + 3] for k in range(4)] == [0] * 4  # no least and greatest are told
    last = points_at + (n_points - 1) * record_size
    steps = np.array(struct.unpack_from("<3i", raw, last))
    np.testing.assert_allclose(steps * scale + offset, expected[-1], atol=STEP_M)
    assert struct.unpack_from("<H", raw, last + 20)[0] == 2  # point source id


def test_laz_holds_the_very_points_of_las_in_less_space(files: dict[str, Path]) -> None:
    plain, packed = laspy.read(files["las"]), laspy.read(files["laz"])
    np.testing.assert_array_equal(packed.points.array, plain.points.array)
    assert packed.header.parse_crs() == plain.header.parse_crs() is not None
    assert files["laz"].stat().st_size < 0.4 * files["las"].stat().st_size


def test_las_in_scene_coordinates_says_so_and_has_no_crs(scene_source: PlanSource, tmp_path: Path) -> None:
    cloud = laspy.read(write(scene_source, tmp_path, "las"))
    assert cloud.header.parse_crs() is None
    assert [vlr.record_data for vlr in cloud.vlrs if b"scene coordinates, no CRS" in getattr(vlr, "record_data", b"")]
    np.testing.assert_allclose(
        np.stack([cloud.x, cloud.y, cloud.z], axis=1)[:N_BEAMS],
        expected_scan(ids_in_order(scene_source)[0]).scene_m.reshape(-1, 3),
        atol=STEP_M,
    )


# --------------------------------------------------------------------------------------------------- PLY
def test_ply_read_by_open3d_and_trimesh_has_points_and_figures(source: PlanSource, files: dict[str, Path]) -> None:
    expected = expected_site(source)
    cloud = open3d.t.io.read_point_cloud(str(files["ply"]))
    np.testing.assert_allclose(cloud.point.positions.numpy(), expected, atol=2e-5)
    np.testing.assert_allclose(np.asarray(trimesh.load(files["ply"], process=False).vertices), expected, atol=2e-5)

    def figure(name: str) -> Any:
        return cloud.point[name].numpy().ravel()

    np.testing.assert_allclose(figure("range"), expected_of_all(source, "range_m"), atol=2e-5)
    np.testing.assert_allclose(figure("cos_incidence"), expected_of_all(source, "cosine"), atol=1e-6)
    np.testing.assert_allclose(figure("intensity"), REFLECTIVITY * expected_of_all(source, "cosine"), atol=1e-6)
    assert figure("station").tolist() == [1] * N_BEAMS + [2] * N_BEAMS
    assert figure("row")[:N_BEAMS].tolist() == np.repeat(range(SHAPE[0]), SHAPE[1]).tolist()
    assert figure("triangle").max() < 12
    assert figure("patch").min() >= 0


def test_ply_header_tells_the_crs_and_where_each_station_stood(files: dict[str, Path]) -> None:
    header = files["ply"].read_bytes().partition(b"end_header\n")[0].decode("ascii")
    assert "EPSG:25832" in header
    assert header.count("comment tlsplan station ") == 2
    assert "instrumentHeight 1.6000" in header
    assert max(len(line) for line in header.splitlines()) < 1024  # some readers have no more room


def test_ply_of_fewer_points_than_beams_is_read_whole(plan_folder: Path, tmp_path: Path) -> None:
    source = open_plan(edited_plan(plan_folder, tmp_path / "near", range_max_m=2.5), frame=FRAME)
    path = write(source, tmp_path, "ply")
    n_points = len(trimesh.load(path, process=False).vertices)
    assert 0 < n_points < 2 * N_BEAMS
    header, _, points = path.read_bytes().partition(b"end_header\n")
    assert f"element vertex {n_points}\n".encode() in header
    assert len(points) == 56 * n_points


# --------------------------------------------------------------------------------------------------- EXR
def test_exr_read_by_openexr_has_the_grid_of_beams(source: PlanSource, files: dict[str, Path]) -> None:
    for name in ids_in_order(source):
        expected = expected_scan(name)
        with OpenEXR.File(str(files["exr"] / f"{name}.exr"), separate_channels=True) as file:
            returns, surfaces = file.parts
            assert (returns.name(), surfaces.name()) == ("returns", "surfaces")
            assert sorted(returns.channels) == ["cosIncidence", "intensity", "range"]
            np.testing.assert_allclose(returns.channels["range"].pixels, expected.range_m, atol=2e-5)
            np.testing.assert_allclose(returns.channels["cosIncidence"].pixels, expected.cosine, atol=1e-6)
            intensity = returns.channels["intensity"].pixels
            np.testing.assert_allclose(intensity, REFLECTIVITY * expected.cosine, atol=1e-6)
            triangle = surfaces.channels["triangle"].pixels
            assert triangle.dtype == np.uint32
            assert triangle.shape == SHAPE
            assert triangle.max() < 12
            header = returns.header
            np.testing.assert_allclose(
                np.array(header["tlsplan:positionSite"].split(), float), to_site(np.array(STATIONS_M[name])), atol=1e-4
            )
            matrix = np.array(header["tlsplan:sceneToSite"].split(), float).reshape(4, 4)
            np.testing.assert_allclose(matrix[:3, 3], ORIGIN_M)
            assert header["tlsplan:crs"] == "EPSG:25832"
            assert header["tlsplan:scanner"] == "test"
            assert len(header["tlsplan:elevations"].split()) == SHAPE[0]


def test_exr_header_and_ranges_alone_give_the_points(source: PlanSource, files: dict[str, Path]) -> None:
    """By what docs/formats/scans.md says, and nothing else."""
    with OpenEXR.File(str(files["exr"] / "S002.exr"), separate_channels=True) as file:
        part = file.parts[0]
        told = {key.removeprefix("tlsplan:"): value for key, value in part.header.items() if key.startswith("tlsplan:")}
        range_m = part.channels["range"].pixels.astype(float)
    elevation = np.array(told["elevations"].split(), float)[:, None]
    azimuth = np.array(told["azimuths"].split(), float)[:, None] + np.arange(SHAPE[1]) * float(told["azimuthStep"])
    level = range_m * np.cos(elevation)
    way = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), range_m * np.sin(elevation)], axis=-1)
    scene_m = np.array(told["positionScene"].split(), float) + way
    np.testing.assert_allclose(scene_m, expected_scan("S002").scene_m, atol=2e-5)
    matrix = np.array(told["sceneToSite"].split(), float).reshape(4, 4)
    np.testing.assert_allclose(
        scene_m @ matrix[:3, :3].T + matrix[:3, 3], to_site(expected_scan("S002").scene_m), atol=3e-5
    )


def test_exr_marks_beams_without_return(plan_folder: Path, tmp_path: Path) -> None:
    source = open_plan(edited_plan(plan_folder, tmp_path / "near", range_max_m=2.5), frame=FRAME)
    with OpenEXR.File(str(write(source, tmp_path, "exr") / "S001.exr"), separate_channels=True) as file:
        missed = np.isnan(file.parts[0].channels["range"].pixels)
        assert 0 < missed.sum() < missed.size
        np.testing.assert_array_equal(file.parts[1].channels["patch"].pixels == 2**32 - 1, missed)


def test_exr_folder_has_a_preview_a_station_and_nothing_else(source: PlanSource, files: dict[str, Path]) -> None:
    names = sorted(path.name for path in files["exr"].iterdir())
    assert names == ["S001.exr", "S001.png", "S002.exr", "S002.png", "pack.json"]
    rgb = OpenImageIO.ImageBuf(str(files["exr"] / "S001.png")).get_pixels(OpenImageIO.UINT8)
    assert rgb.shape[1] == SHAPE[1]
    assert len(np.unique(rgb.reshape(-1, 3), axis=0)) > 50
    # The room is 6 m, the scanner reaches 20 m, and all colours are there: near ones are light, far ones dark.
    sums = rgb.sum(axis=2, dtype=int)
    nearest, farthest = (find(expected_scan("S001").range_m) for find in (np.argmin, np.argmax))
    rows = rgb.shape[0] // SHAPE[0]
    light, dark = (sums[rows * (at // SHAPE[1]), at % SHAPE[1]] for at in (nearest, farthest))
    assert light > 2.5 * dark


# ----------------------------------------------------------------------------------- what holds for all
@pytest.mark.slow
@pytest.mark.parametrize(
    ("grid", "expected"),
    [
        ((76, 400), (228, 400)),  # rows are repeated, see `preview_rgb`
        ((64, 4500), (256, 1500)),
        ((300, 6000), (300, 1500)),
        pytest.param((4364, 10472), (624, 1496), marks=pytest.mark.slow),
        ((9000, 600), (1500, 600)),
    ],
)
def test_previews_have_the_shape_of_what_is_seen_and_a_size_to_look_at(
    source: PlanSource, grid: tuple[int, int], expected: tuple[int, int]
) -> None:
    clouds = open_clouds(source, Options(max_points=1))
    template = replace(
        clouds.template, azimuth_rad=np.linspace(0, 6, grid[1]), elevation_rad=np.linspace(1, -1, grid[0])
    )
    preview = _Preview(replace(clouds, template=template))
    for first, last in ((0, grid[0] // 3), (grid[0] // 3, grid[0])):
        figures = np.ones((last - first, grid[1]), dtype=np.float32)
        ids = np.zeros(figures.shape, dtype=np.int32)
        preview.take(ScanBlock(clouds.stations[0], template, first, figures.astype(float), figures, figures, ids, ids))
    assert preview.rgb().shape == (*expected, 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*TOGETHER, *SPLIT])
def test_clouds_written_again_have_the_same_bytes(
    source: PlanSource, files: dict[str, Path], tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Other blocks, as a later version or another machine may have them.
    monkeypatch.setattr("planner_core.export.clouds.points._BLOCK_BEAMS", 5 * SHAPE[1])
    again = write(source, tmp_path, name)
    paths = [files[name]] if files[name].is_file() else sorted(files[name].iterdir())
    for path in paths:
        other = again if files[name].is_file() else again / path.name
        assert path.read_bytes() == other.read_bytes(), path.name


READ: dict[str, Callable[[Path], Floats]] = {
    ".e57": lambda path: np.asarray(e57.read_points(str(path)).points),
    ".las": lambda path: np.asarray(laspy.read(path).xyz),
    ".laz": lambda path: np.asarray(laspy.read(path).xyz),
    ".ply": lambda path: np.asarray(trimesh.load(path, process=False).vertices),
}


@pytest.mark.parametrize("name", TOGETHER)
def test_one_file_a_station_holds_the_points_of_the_one_file_of_all(
    source: PlanSource, files: dict[str, Path], name: str
) -> None:
    folder, suffix = files[f"{name}-split"], files[name].suffix
    assert sorted(path.name for path in folder.iterdir()) == [f"S001{suffix}", f"S002{suffix}", "pack.json"]
    apart = np.concatenate([READ[suffix](folder / f"{station}{suffix}") for station in ids_in_order(source)])
    np.testing.assert_allclose(apart, READ[suffix](files[name]), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", TOGETHER)
def test_a_cloud_of_one_station_thinned_has_no_more_points_than_asked_for(
    source: PlanSource, tmp_path: Path, name: str
) -> None:
    path = write(source, tmp_path, name, Options(stations=("S002",), max_points=500))
    points = READ[path.suffix](path)
    assert 300 < len(points) <= 500
    expected = to_site(expected_scan("S002").scene_m)[::8, ::8].reshape(-1, 3)
    # A pose has no scale: 250 ppm of some metres.
    np.testing.assert_allclose(points, expected, atol=STEP_M + (2e-3 if name == "e57" else 0))


@pytest.mark.slow
@pytest.mark.parametrize("name", TOGETHER)
def test_a_station_that_sees_nothing_leaves_a_file_that_can_be_read(
    plan_folder: Path, tmp_path: Path, name: str
) -> None:
    source = open_plan(edited_plan(plan_folder, tmp_path / "blind", range_min_m=0.01, range_max_m=0.02))
    path = write(source, tmp_path, name)
    if name == "e57":
        file = pye57.E57(str(path))
        assert [file.get_header(k).point_count for k in range(2)] == [0, 0]
        file.close()
    elif name == "ply":
        assert b"element vertex 0\n" in path.read_bytes()
    else:
        assert len(READ[path.suffix](path)) == 0


def test_e57_says_that_a_grids_scale_is_not_in_it(source: PlanSource, scene_source: PlanSource, tmp_path: Path) -> None:
    options = Options(max_points=50)
    written = export_plan("e57", source, tmp_path / "a.e57", options)
    assert any("scale of 0.99975" in remark for remark in written.remarks)
    written = export_plan("e57", scene_source, tmp_path / "b.e57", options)
    assert not any("scale" in remark for remark in written.remarks)


def test_las_files_of_one_site_have_one_offset(source: PlanSource, files: dict[str, Path]) -> None:
    offsets = {tuple(laspy.open(path).header.offsets) for path in files["las-split"].glob("*.las")}
    assert len(offsets) == 1


def test_las_refuses_stations_farther_apart_than_it_can_hold(source: PlanSource, tmp_path: Path) -> None:
    from planner_core.errors import ExportError

    east_m = source.stations[1].site_m + np.array([500_000.0, 0, 0])
    far = replace(source.stations[1], position_m=source.frame.to_scene(east_m))
    spread = replace(source, stations=(source.stations[0], far))
    with pytest.raises(ExportError, match="reach over 5000"):
        write(spread, tmp_path, "las")
    assert not list(tmp_path.iterdir())


def test_a_station_of_unknown_height_tells_no_ground(source: PlanSource, tmp_path: Path) -> None:
    given = replace(source.stations[0], instrument_height_m=np.nan)
    one = replace(source, stations=(given,))
    options = Options(max_points=100)
    for name in (*TOGETHER, "exr"):
        written = write(one, tmp_path, name, options)
        raw = b"".join(
            path.read_bytes() for path in ([written] if written.is_file() else sorted(written.glob("*.exr")))
        )
        assert b"nan" not in raw.lower(), name
        assert b"groundSite" not in raw, name
        assert b"positionSite" in raw, name
