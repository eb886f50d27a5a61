"""Scanner specifications: those that come with the product, and files of the user's own, good and bad."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from planner_core.errors import RequirementError
from planner_core.model import Scanner
from planner_core.scanner.load_scanner import list_scanners, load_scanner
from planner_core.scanner.template import make_template

GOOD = {
    "name": "mine",
    "title": "My own",
    "source": "its manual, page 3",
    "range_min_m": 0.5,
    "range_max_m": 30,
    "n_azimuths": 8,
    "elevation_deg": [30, 0, -15.5],
    "instrument_height_min_m": 1.0,
    "instrument_height_max_m": 1.8,
}


def test_hdl_64e_is_table_2_of_the_paper() -> None:
    scanner = load_scanner("hdl-64e")
    assert (scanner.n_azimuths, scanner.n_channels, scanner.n_beams) == (4500, 64, 288_000)
    assert scanner.range_max_m == 5.0
    assert (scanner.instrument_height_min_m, scanner.instrument_height_max_m) == (0.5, 2.0)
    assert math.degrees(scanner.elevation_rad[0]) == pytest.approx(2.0)
    assert math.degrees(scanner.elevation_rad[-1]) == pytest.approx(-24.9)
    np.testing.assert_allclose(np.diff(np.rad2deg(scanner.elevation_rad)), -26.9 / 63)
    assert "2023" in scanner.source


def test_pandar64_is_the_makers_table() -> None:
    """Figures by hand from the driver's tables; its offsets are clockwise, ours counter-clockwise."""
    scanner = load_scanner("pandar64")
    assert (scanner.n_azimuths, scanner.n_channels) == (1800, 64)
    elevation, offset = np.rad2deg(scanner.elevation_rad), np.rad2deg(scanner.azimuth_offset_rad)
    for channel, up, clockwise in ((1, 14.882, -1.042), (7, 1.86, 1.042), (18, 0, -1.042), (40, -3.712, -5.208)):
        assert elevation[channel - 1] == pytest.approx(up, abs=1e-9)
        assert offset[channel - 1] == pytest.approx(-clockwise)
    assert elevation[-1] == pytest.approx(-24.897)
    assert set(np.round(offset, 3)) == {1.042, -1.042, 3.125, -3.125, 5.208, -5.208}
    assert "HesaiLidar_General_SDK" in scanner.source


def test_every_listed_scanner_loads_by_its_name() -> None:
    scanners = list_scanners()
    assert "hdl-64e" in {scanner.name for scanner in scanners}
    for scanner in scanners:
        assert load_scanner(scanner.name.upper()) == scanner


def test_a_file_of_the_users_own_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(GOOD), encoding="utf-8")
    scanner = load_scanner(path)
    assert scanner.name == "mine"
    np.testing.assert_allclose(np.rad2deg(scanner.elevation_rad), [30, 0, -15.5])
    assert scanner.n_beams == 24
    assert (scanner.azimuth_range_rad, scanner.azimuth_offset_rad, scanner.inverted) == (None, (), False)


def read(tmp_path: Path, **change: object) -> Scanner:
    """GOOD with some fields changed; None takes a field out."""
    path = tmp_path / "mine.json"
    spec = {key: value for key, value in {**GOOD, **change}.items() if value is not None}
    path.write_text(json.dumps(spec), encoding="utf-8")
    return load_scanner(path)


def test_the_examples_of_the_documentation_are_scanners(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "formats" / "scanner.md"
    sizes = []
    for example in page.read_text(encoding="utf-8").split("```json")[1:]:
        path = tmp_path / "example.json"
        path.write_text(example.split("```")[0], encoding="utf-8")
        scanner = load_scanner(path)
        sizes.append((scanner.mode, scanner.n_azimuths, scanner.n_channels))
    assert sizes == [("fast", 5236, 2183), ("", 2000, 601)]


def test_a_sector_has_both_its_ends(tmp_path: Path) -> None:
    for azimuth in ({"first": -60, "last": 30, "count": 181}, {"first": -60, "last": 30, "step": 0.5}):
        scanner = read(tmp_path, n_azimuths=None, azimuth_deg=azimuth)
        assert scanner.n_azimuths == 181
        assert scanner.azimuth_range_rad == pytest.approx((-math.pi / 3, math.pi / 6))
        degrees = np.rad2deg(make_template(scanner).azimuth_rad)
        np.testing.assert_allclose(degrees, np.linspace(-60, 30, 181))


def test_a_full_turn_may_be_given_by_its_step(tmp_path: Path) -> None:
    scanner = read(tmp_path, n_azimuths=None, azimuth_deg={"step": 0.18})
    assert (scanner.n_azimuths, scanner.azimuth_range_rad) == (2000, None)


def test_a_dome_may_be_given_by_its_step(tmp_path: Path) -> None:
    scanner = read(tmp_path, elevation_deg={"first": 90, "last": -60, "step": 0.3})
    np.testing.assert_allclose(np.rad2deg(scanner.elevation_rad), np.linspace(90, -60, 501), atol=1e-12)


def test_offsets_and_mounting_are_read(tmp_path: Path) -> None:
    scanner = read(tmp_path, elevation_deg=[30, 0, 0], azimuth_offset_deg=[1, 0, -2.5], mounting="inverted")
    np.testing.assert_allclose(np.rad2deg(scanner.azimuth_offset_rad), [1, 0, -2.5])
    assert scanner.inverted
    assert not read(tmp_path, mounting="upright").inverted


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"range_min_m": 40}, "range_min_m"),
        ({"range_max_m": "30"}, "range_max_m"),
        ({"range_max_m": None}, "no range_max_m"),
        ({"range_max_m": True}, "range_max_m"),
        ({"n_azimuths": 0}, "n_azimuths"),
        ({"n_azimuths": 4.5}, "n_azimuths"),
        ({"n_azimuths": 10**9}, "n_azimuths"),
        ({"elevation_deg": [0, 10]}, "elevation_deg"),
        ({"elevation_deg": [95, 10]}, "elevation_deg"),
        ({"elevation_deg": []}, "elevation_deg"),
        ({"elevation_deg": {"first": 1, "last": 0}}, "elevation_deg"),
        ({"elevation_deg": {"first": 1, "last": 0, "count": 1.5}}, "count"),
        ({"instrument_height_min_m": 2.5}, "instrument_height"),
        ({"title": ""}, "title"),
        ({"colour": "red"}, "colour"),
        ({"elevation_deg": [10, 0, 5]}, "rising from 0 to 5 at channel 3"),
        ({"elevation_deg": [10, 0, 0]}, "channels 2 and 3"),
        ({"elevation_deg": [10, 0, 0], "azimuth_offset_deg": [1, 2, 2]}, "channels 2 and 3"),
        ({"elevation_deg": {"first": 0, "last": 10, "count": 3}}, "first > last"),
        ({"elevation_deg": {"first": 10, "last": 0, "step": 3}}, "whole number of steps"),
        ({"elevation_deg": {"first": 10, "last": 0, "step": -1}}, "step"),
        ({"elevation_deg": {"first": 10, "last": 0, "step": 1e-300}}, "step"),
        ({"elevation_deg": {"first": 10, "last": 0, "count": 10**8}}, "count"),
        ({"elevation_deg": {"first": 91, "last": 0, "count": 3}}, "91"),
        ({"elevation_deg": 5}, "elevation_deg"),
        ({"elevation_deg": {}}, "elevation_deg: got no first"),
        ({"azimuth_deg": {"first": 0, "last": 90, "count": 4}}, "both"),
        ({"n_azimuths": None}, "neither"),
        ({"n_azimuths": None, "azimuth_deg": [0, 1]}, "azimuth_deg"),
        ({"n_azimuths": None, "azimuth_deg": {"first": 0, "count": 4}}, "azimuth_deg"),
        ({"n_azimuths": None, "azimuth_deg": {"first": 90, "last": 0, "count": 4}}, "first <= last"),
        ({"n_azimuths": None, "azimuth_deg": {"first": 0, "last": 0, "count": 4}}, "first < last"),
        ({"n_azimuths": None, "azimuth_deg": {"first": 0, "last": 360, "count": 4}}, "the first again"),
        ({"n_azimuths": None, "azimuth_deg": {"first": -200, "last": 200, "count": 4}}, "the first again"),
        ({"n_azimuths": None, "azimuth_deg": {"first": 0, "last": 90, "step": 0.7}}, "whole number of steps"),
        ({"n_azimuths": None, "azimuth_deg": {"step": 7}}, "whole number of steps"),
        ({"n_azimuths": None, "azimuth_deg": {"step": 0}}, "step"),
        ({"azimuth_offset_deg": [1, 2]}, "a list of 3 degrees"),
        ({"azimuth_offset_deg": 1}, "azimuth_offset_deg: got 1, expected a list"),
        ({"azimuth_offset_deg": [1, 2, "3"]}, "azimuth_offset_deg"),
        ({"azimuth_offset_deg": [1, 2, 270]}, "270"),
        ({"mounting": "sideways"}, "'upright' or 'inverted'"),
        ({"mounting": None, "title": 7}, "title"),
    ],
)
def test_a_bad_field_is_named(tmp_path: Path, change: dict[str, object], told: str) -> None:
    with pytest.raises(RequirementError, match=told) as caught:
        read(tmp_path, **change)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", '"hdl"', "{}", "\x00\x01"])
def test_a_file_that_describes_no_scanner_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RequirementError, match="expected"):
        load_scanner(path)


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(RequirementError, match="hdl-64e"):
        load_scanner("hdl-65e")
    with pytest.raises(RequirementError, match="can't be read"):
        load_scanner("nowhere/at-all.json")


@pytest.mark.parametrize(
    "text",
    [
        json.dumps(GOOD).replace("30", "1" + "0" * 400, 1),
        "[" * 100_000,
        json.dumps({**GOOD, "range_max_m": 0}).replace('"range_max_m": 0', '"range_max_m": 1' + "0" * 10_000),
        json.dumps(GOOD).replace('"title": "', '"title": "\\ud800'),
    ],
    ids=["huge number", "deep brackets", "endless number", "half a character"],
)
def test_what_json_readers_choke_on_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mine.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RequirementError) as refused:
        load_scanner(path)
    assert len(str(refused.value).splitlines()) == 1
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize(
    "change",
    [
        {"elevation_deg": [5, 5, 5, 0], "azimuth_offset_deg": [0, 1, 0, 0]},
        {"elevation_deg": [5, 5, 4], "azimuth_offset_deg": [180, -180, 0]},
    ],
)
def test_a_channel_that_is_there_twice_is_refused_wherever_it_is(tmp_path: Path, change: dict[str, object]) -> None:
    with pytest.raises(RequirementError, match="channels"):
        read(tmp_path, **change)
