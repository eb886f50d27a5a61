"""Scanner specifications: the one of the paper, and files of the user's own, good and bad."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from planner_core.errors import RequirementError
from planner_core.scan.scanners import list_scanners, load_scanner
from planner_core.scan.template import directions, make_template

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


def test_every_listed_scanner_loads_by_its_name() -> None:
    scanners = list_scanners()
    assert "hdl-64e" in {scanner.name for scanner in scanners}
    for scanner in scanners:
        assert load_scanner(scanner.name.upper()) == scanner


def test_template_has_the_highest_channel_first_and_azimuth_from_zero() -> None:
    template = make_template(load_scanner("hdl-64e"))
    beams = directions(template)
    assert beams.shape == (64, 4500, 3)
    np.testing.assert_allclose(np.linalg.norm(beams, axis=2), 1.0, atol=1e-15)
    assert np.all(np.diff(beams[:, 0, 2]) < 0)
    assert template.azimuth_rad[0] == 0.0
    assert template.azimuth_rad[-1] == pytest.approx(2 * math.pi * 4499 / 4500)
    # Counter-clockwise from +x: a quarter turn is +y.
    np.testing.assert_allclose(beams[0, 1125, :2], [0.0, math.cos(math.radians(2))], atol=1e-12)


def test_a_file_of_the_users_own_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(GOOD), encoding="utf-8")
    scanner = load_scanner(path)
    assert scanner.name == "mine"
    np.testing.assert_allclose(np.rad2deg(scanner.elevation_rad), [30, 0, -15.5])
    assert scanner.n_beams == 24


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"range_min_m": 40}, "range_min_m"),
        ({"range_max_m": "30"}, "range_max_m"),
        ({"range_max_m": None}, "range_max_m"),
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
    ],
)
def test_a_bad_field_is_named(tmp_path: Path, change: dict[str, object], told: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(json.dumps({**GOOD, **change}), encoding="utf-8")
    with pytest.raises(RequirementError, match=told) as caught:
        load_scanner(path)
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
