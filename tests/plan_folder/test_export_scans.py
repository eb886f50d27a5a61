"""Scans as files, read back by OpenImageIO."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as Oiio
import pytest

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import PlanFolderError, RequirementError
from planner_core.model import Plan
from planner_core.plan_folder.scans import write_scan
from planner_core.plan_folder.usd_stage import cloud_layer, write_layer
from planner_core.plan_folder.viewer_layers import cloud_bytes
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import make_template, preview_template


def write_all(plan: Plan, engine: ScanEngine, folder: Path) -> list[Path]:
    """Every station in every format."""
    return [
        write_scan(
            plan.survey,
            station,
            engine.scan(plan.survey.template, station.position_m[None]),
            folder / f"{station.id}{suffix}",
        )
        for station in plan.stations
        for suffix in (".exr", ".png")
    ]


@pytest.fixture(scope="module")
def folder(plan: Plan, engine: ScanEngine, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scans") / "out"
    files = write_all(plan, engine, folder)
    assert sorted(files) == sorted(folder.iterdir())
    assert len(files) == 6
    return folder


def test_exr_holds_the_scan_exactly_with_pose_and_without_date(plan: Plan, engine: ScanEngine, folder: Path) -> None:
    scan = engine.scan(plan.survey.template, plan.stations[1].position_m[None])
    file = Oiio.ImageInput.open(str(folder / "S002.exr"))
    for part, expected in enumerate(
        ({"range": scan.range_m, "cosIncidence": scan.cos_incidence}, {"triangle": scan.triangle, "patch": scan.patch})
    ):
        file.seek_subimage(part, 0)
        spec = file.spec()
        pixels = file.read_image(part, 0, 0, spec.nchannels, spec.format)
        for name, values in expected.items():
            found = pixels[:, :, list(spec.channelnames).index(name)]
            np.testing.assert_array_equal(found.astype(values.dtype), values[0])
        attributes = {attribute.name: attribute.value for attribute in spec.extra_attribs}
        assert attributes["tlsplan:positionScene"] == "500006.000000 4000002.200000 101.500000"
        assert attributes["tlsplan:station"] == "S002"
        assert "DateTime" not in attributes
    file.close()


def test_preview_is_a_picture_with_more_than_one_colour(folder: Path) -> None:
    picture = Oiio.ImageBuf(str(folder / "S001.png")).get_pixels(Oiio.UINT8)
    assert picture.shape[2] == 3
    assert picture.shape[0] >= 200
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


def test_unknown_format_is_refused_before_anything_is_written(plan: Plan, engine: ScanEngine, tmp_path: Path) -> None:
    station = plan.stations[0]
    scan = engine.scan(plan.survey.template, station.position_m[None])
    with pytest.raises(RequirementError, match="e57"):
        write_scan(plan.survey, station, scan, tmp_path / "out" / "S001.e57")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("suffix", [".exr", ".png"])
def test_scan_that_cannot_be_written_is_told_with_its_file(
    plan: Plan, engine: ScanEngine, tmp_path: Path, suffix: str
) -> None:
    station = plan.stations[0]
    scan = engine.scan(plan.survey.template, station.position_m[None])
    (tmp_path / "file").touch()
    with pytest.raises(PlanFolderError, match=f"S001{suffix}: can't be written"):
        write_scan(plan.survey, station, scan, tmp_path / "file" / f"S001{suffix}")


def test_interrupted_scan_file_leaves_nothing(
    plan: Plan, engine: ScanEngine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = plan.stations[0]
    scan = engine.scan(plan.survey.template, station.position_m[None])
    begun: list[str] = []

    def stop(*_: object) -> None:
        begun.extend(path.name for path in tmp_path.iterdir())
        raise KeyboardInterrupt

    monkeypatch.setattr("planner_core.plan_folder.scans.finish", stop)
    with pytest.raises(KeyboardInterrupt):
        write_scan(plan.survey, station, scan, tmp_path / "S001.exr")
    assert any(name.startswith(".S001.partial-") for name in begun)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["hdl-64e", "pandar64", "blk360-g2:dense-plus", "rtc360:high", "vz-400i", "p50", "x7"])
def test_previews_of_a_station_stay_below_three_megabytes(
    plan: Plan, engine: ScanEngine, tmp_path: Path, name: str
) -> None:
    scanner = load_scanner(name)
    template = preview_template(make_template(scanner))
    survey = replace(plan.survey, template=template)
    station = plan.stations[0]
    scan = engine.scan(template, station.position_m[None])
    for suffix in ("exr", "png"):
        write_scan(survey, station, scan, tmp_path / f"scan.{suffix}")
    write_layer(cloud_layer(scan.range_m[0], template), tmp_path / "cloud.usdc")
    (tmp_path / "cloud.u16").write_bytes(cloud_bytes(scan.range_m[0], scan.cos_incidence[0], template))
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert np.isfinite(scan.range_m).mean() > 0.3
    assert sum(sizes.values()) < 3e6, sizes
