"""Modes of a scanner: how they are named and picked, how steps become beams, and bad ones."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import Scanner
from planner_core.scanner.load_scanner import load_scanner, scan_modes, scanner_title
from planner_core.scanner.modes import ScanMode, grid_of, spacing_mode
from planner_core.scanner.template import is_full_turn, make_template

GOOD = {
    "name": "mine",
    "title": "My own",
    "source": "its manual, page 3",
    "range_min_m": 0.5,
    "range_max_m": 30,
    "elevation_deg": {"first": 90, "last": -60},
    "modes": [
        {"id": "fast", "title": "2 degrees", "step_deg": 2, "seconds": 20},
        {"id": "fine", "title": "1 by 0.5 degrees", "azimuth_step_deg": 1, "elevation_step_deg": 0.5},
        {"id": "near", "title": "100 mm at 10 m", "spacing_at_10m_mm": 100},
    ],
    "default_mode": "fast",
    "instrument_height_min_m": 1.0,
    "instrument_height_max_m": 1.8,
}


def write(tmp_path: Path, **change: object) -> Path:
    """GOOD with some fields changed; None takes a field out."""
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({k: v for k, v in {**GOOD, **change}.items() if v is not None}), encoding="utf-8")
    return path


def mode(**change: object) -> list[dict[str, object]]:
    """One mode with some fields changed; None takes a field out."""
    entry = {"id": "fast", "title": "2 degrees", "step_deg": 2, **change}
    return [{key: value for key, value in entry.items() if value is not None}]


def sizes(scanner: Scanner) -> tuple[int, int]:
    return scanner.n_azimuths, scanner.n_channels


def test_a_mode_is_named_after_a_colon(tmp_path: Path) -> None:
    """360 / 2 and 150 / 2 + 1; 360 / 1 and 150 / 0.5 + 1; 100 mm at 10 m is 0.01 rad: 628.3 and 261.8 steps."""
    path = write(tmp_path)
    assert sizes(load_scanner(path)) == (180, 76)
    assert sizes(load_scanner(f"{path}:fine")) == (360, 301)
    assert sizes(load_scanner(f"{path}:NEAR")) == (628, 263)
    assert [load_scanner(f"{path}:{m}").mode for m in ("fast", "fine", "near")] == ["fast", "fine", "near"]
    assert (load_scanner(path).seconds_per_scan, load_scanner(f"{path}:fine").seconds_per_scan) == (20, None)
    assert load_scanner(f"{path}:fine").title == "My own, 1 by 0.5 degrees"
    assert scanner_title(path) == "My own"


def test_any_spacing_may_be_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path)
    for asked in ("50mm", "50 MM", "50.0mm"):
        scanner = load_scanner(f"{path}:{asked}")
        assert scanner.mode == "50mm"
        assert sizes(scanner) == (round(2 * math.pi / 0.005), round(math.radians(150) / 0.005) + 1)
        assert scanner.seconds_per_scan is None
    assert sizes(load_scanner("rtc360:6mm")) == sizes(load_scanner("rtc360:medium"))


def test_a_default_may_be_a_spacing_and_is_not_needed_for_one_mode(tmp_path: Path) -> None:
    assert load_scanner(write(tmp_path, default_mode="50mm")).mode == "50mm"
    assert load_scanner(write(tmp_path, modes=mode(), default_mode=None)).mode == "fast"


def test_modes_are_listed_in_the_order_of_the_file(tmp_path: Path) -> None:
    assert [m.id for m in scan_modes(write(tmp_path))] == ["fast", "fine", "near"]
    assert scan_modes("pandar64") == ()
    assert [m.id for m in scan_modes("hdl-64e")] == ["channels"]


def test_a_file_name_with_a_colon_is_a_file_name(tmp_path: Path) -> None:
    path = write(tmp_path).rename(tmp_path / "my:fine")
    assert load_scanner(path).mode == "fast"
    assert load_scanner(f"{path}:fine").mode == "fine"


def test_channels_and_azimuths_of_a_mode_are_even_and_reach_both_ends(tmp_path: Path) -> None:
    template = make_template(load_scanner(f"{write(tmp_path)}:fine"))
    np.testing.assert_allclose(np.rad2deg(template.elevation_rad), np.linspace(90, -60, 301), atol=1e-12)
    assert is_full_turn(template)
    assert template.azimuth_rad[0] == 0.0


@pytest.mark.parametrize(
    ("step_deg", "field_deg", "expected"),
    [(1.0, 150.0, (360, 151)), (0.7, 150.0, (514, 215)), (7.2, 18.0, (50, 4)), (30.0, 10.0, (12, 2))],
)
def test_the_nearest_number_of_steps_is_taken(step_deg: float, field_deg: float, expected: tuple[int, int]) -> None:
    """0.7: 514.29 and 214.29. 7.2: 50 and 2.5, halves upwards: 3. 30 in 10: 0.33, but a field has both its ends."""
    step = math.radians(step_deg)
    grid = grid_of(ScanMode("a", "a", step, step), field_rad=math.radians(field_deg) * (1 + 1e-15))
    assert (grid.n_azimuths, grid.n_channels) == expected
    assert grid.n_beams == expected[0] * expected[1]


@given(step_deg=st.floats(0.001, 30), field_deg=st.floats(0.5, 180))
def test_rounding_is_off_by_half_a_step_at_most(step_deg: float, field_deg: float) -> None:
    step = math.radians(step_deg)
    grid = grid_of(ScanMode("a", "a", step, step), field_rad=math.radians(field_deg))
    assert abs(grid.n_azimuths - 360 / step_deg) <= 0.5 + 1e-9
    assert grid.n_channels == 2 or abs(grid.n_channels - 1 - field_deg / step_deg) <= 0.5 + 1e-9


@pytest.mark.parametrize(
    ("spacing", "mode"),
    [
        ("rtc360:6mm", "rtc360:medium"),
        ("rtc360:12mm", "rtc360:low"),
        ("rtc360:3.0mm", "rtc360:high"),
        ("rtc360:5mm", ""),
        ("p50:6.3mm", ""),
    ],
)
def test_a_spacing_of_one_of_the_modes_takes_its_time(spacing: str, mode: str) -> None:
    """Others have none: nobody knows how long the instrument takes for them."""
    seconds = load_scanner(spacing).seconds_per_scan
    assert seconds == (load_scanner(mode).seconds_per_scan if mode else None)
    assert (seconds is not None) == bool(mode)


@pytest.mark.parametrize("name", ["", "mm", "0mm", "-6mm", "6 cm", "6", "nanmm", "1e3mm", "99999mm", "6mm6mm", "6.mm"])
def test_what_is_no_spacing_is_none(name: str) -> None:
    assert spacing_mode(name) is None


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("rtc360:ultra", "low, medium, high, or a spacing at 10 m such as 6mm"),
        ("rtc360:", "low, medium, high"),
        ("pandar64:6mm", "one resolution alone; use pandar64"),
        ("hdl-64e:6mm", "expected channels; pick one, or hdl-64e for its default"),
        ("hdl-64e:", "expected channels"),
        ("p50:0.8mm", "at most 200000000 beams in all; pick a coarser mode or spacing, such as p50:6mm"),
        ("rtc360:0.001mm", "at most 200000000 beams"),
        ("rtc361:6mm", "got 'rtc361', expected one of blk360-g2, .*rtc360"),
        ("nowhere.json:6mm", "nowhere.json: can't be read"),
        ("a\x00b.json", "can't be read"),
        ("rtc360:" + "9" * 10_000, "expected low, medium, high"),
    ],
)
def test_a_mode_that_is_not_there_is_answered_with_what_to_do(asked: str, told: str) -> None:
    with pytest.raises(RequirementError, match=told) as caught:
        load_scanner(asked)
    assert len(str(caught.value).splitlines()) == 1
    assert len(str(caught.value)) < 400


BEAMS = {"modes": None, "default_mode": None, "n_azimuths": 8, "elevation_deg": [10, 0, -10]}


def table(**change: object) -> dict[str, object]:
    """A scanner with channels one by one, and with another table of them."""
    return {**BEAMS, "channel_modes": [{"id": "low", "title": "low", "elevation_deg": [0, -1, -5, -20], **change}]}


def test_another_table_of_channels_is_picked_by_its_name(tmp_path: Path) -> None:
    path = write(tmp_path, **table())
    plain, low = load_scanner(path), load_scanner(f"{path}:Low")
    assert (sizes(plain), plain.mode, plain.title) == ((8, 3), "", "My own")
    assert (sizes(low), low.mode, low.title) == ((8, 4), "low", "My own, low")
    np.testing.assert_allclose(np.rad2deg(make_template(low).elevation_rad), [0, -1, -5, -20], atol=1e-12)
    assert is_full_turn(make_template(low))
    (mode,) = scan_modes(path)
    assert (mode.elevation_step_rad, grid_of(mode, field_rad=1.0).n_beams) == (None, 32)


#: What is changed in GOOD, and what the message names.
BAD_MODES = [
    ({"modes": []}, "modes: got 0 of them, expected at least 1"),
    ({"modes": "fast"}, "modes: got 'fast', expected a list"),
    ({"modes": mode() * 101}, "modes: got 101 of them, expected at most 100"),
    ({"modes": ["fast"]}, r"modes\[0\]: got 'fast'"),
    ({"modes": mode() + mode()}, "mode id 'fast' twice"),
    ({"modes": mode(id=None)}, r"modes\[0\]: got no id"),
    ({"modes": mode(id="Fast!")}, r"modes\[0\].id: got"),
    ({"modes": mode(id="a" * 41)}, r"modes\[0\].id: got"),
    ({"modes": mode(id=7)}, r"modes\[0\].id: got 7"),
    ({"modes": mode(id="6mm")}, "id 6mm with another spacing"),
    ({"modes": mode(title=" ")}, r"modes\[0\].title: got ' '"),
    ({"modes": mode(colour="red")}, r"modes\[0\]: got the unknown entry 'colour'"),
    ({"modes": mode(step_deg=None)}, "no step"),
    ({"modes": mode(azimuth_step_deg=1)}, "azimuth_step_deg and step_deg"),
    ({"modes": mode(step_deg=None, azimuth_step_deg=1)}, "expected spacing_at_10m_mm, or step_deg"),
    ({"modes": mode(spacing_at_10m_mm=6)}, "spacing_at_10m_mm and step_deg"),
    ({"modes": mode(step_deg=0)}, "step_deg: got 0"),
    ({"modes": mode(step_deg=-1)}, "step_deg: got -1"),
    ({"modes": mode(step_deg=31)}, "at most 30"),
    ({"modes": mode(step_deg="1")}, "step_deg: got '1'"),
    ({"modes": mode(step_deg=True)}, "step_deg: got True"),
    ({"modes": mode(step_deg=1e-300)}, "step_deg: got 1e-300, expected more than 1e-06"),
    ({"modes": mode(step_deg=None, spacing_at_10m_mm=5e-324)}, "spacing_at_10m_mm: got 5e-324"),
    ({"modes": mode(step_deg=0.001), "default_mode": "fast"}, "at most 200000000 beams"),
    ({"modes": mode(seconds=0)}, "seconds: got 0"),
    ({"modes": mode(seconds=1e6)}, "seconds: got 1000000.0"),
    ({"default_mode": None}, "3 modes and no default_mode"),
    ({"default_mode": "slow"}, "mode 'slow'"),
    ({"default_mode": 3}, "default_mode: got 3"),
    ({"modes": None, "n_azimuths": 8, "elevation_deg": [0]}, "default_mode without modes"),
    ({"n_azimuths": 8}, "modes and n_azimuths"),
    ({"azimuth_deg": {"step": 1}}, "modes and azimuth_deg"),
    ({"azimuth_offset_deg": [0]}, "modes and azimuth_offset_deg"),
    ({"channel_modes": [{"id": "a", "title": "a", "elevation_deg": [1, 0]}]}, "modes and channel_modes"),
    ({"elevation_deg": [10, 0]}, "elevation_deg"),
    ({"elevation_deg": {"first": 90, "last": -60, "step": 1}}, "modes and channels in elevation_deg"),
    ({"elevation_deg": {"first": 90}}, "elevation_deg: got no last"),
    ({"elevation_deg": {"first": -60, "last": 90}}, "first > last"),
    ({"elevation_deg": {"first": 91, "last": 0}}, "elevation_deg.first: got 91"),
    ({"elevation_deg": {"first": 1, "last": None}}, "elevation_deg.last: got None"),
]
BAD_CHANNELS = [
    (table(id="Low"), r"channel_modes\[0\].id"),
    (table(id="6mm"), "id 6mm, a spacing"),
    (table(title=" "), r"channel_modes\[0\].title"),
    (table(elevation_deg=[]), r"channel_modes\[0\].elevation_deg: got 0 of them"),
    (table(elevation_deg=[0, 1]), "rising from 0 to 1 at channel 2"),
    (table(elevation_deg=[1, 0, 0]), "elevation_deg = 0 for channels 2 and 3"),
    (table(elevation_deg=[91, 0]), r"elevation_deg\[0\]: got 91"),
    (table(step_deg=1), "unknown entry 'step_deg'"),
    ({**table(), "n_azimuths": 66_000_000}, "channels in mode low, expected at most 200000000 beams"),
    ({**table(), "azimuth_offset_deg": [0, 1, 2]}, "channel_modes and azimuth_offset_deg"),
    ({**table(), "n_azimuths": None, "azimuth_deg": {"step": 1}}, "channel_modes and azimuth_deg"),
    ({**table(), "channel_modes": 2 * table()["channel_modes"]}, "mode id 'low' twice"),  # type: ignore[operator]
    ({**table(), "default_mode": "low"}, "default_mode without modes"),
]
BAD_FIGURES = [
    ({"angular_accuracy_arcsec": 0}, "angular_accuracy_arcsec: got 0"),
    ({"angular_accuracy_arcsec": "18"}, "angular_accuracy_arcsec"),
    ({"beam_divergence_mrad": -0.3}, "beam_divergence_mrad: got -0.3"),
    ({"beam_divergence_mrad": 350}, "at most 100"),
    ({"beam_diameter_mm": [6]}, "beam_diameter_mm"),
    ({"beam_width_at": "half"}, "'1/e', '1/e2' or 'FWHM'"),
    ({"beam_width_at": ""}, "beam_width_at"),
    ({"beam_width_at": ["1/e"]}, "beam_width_at"),
    ({"wavelength_nm": 0}, "wavelength_nm"),
    ({"dual_axis_compensator": "yes"}, "true or false"),
    ({"dual_axis_compensator": 1}, "true or false"),
    ({"ranging_accuracy": 1.0}, "ranging_accuracy: got 1.0"),
    ({"ranging_accuracy": {"ppm": 10}}, "ranging_accuracy: got no mm"),
    ({"ranging_accuracy": {"mm": 1, "ppm": -1}}, "ranging_accuracy.ppm: got -1"),
    ({"ranging_accuracy": {"mm": 1, "per_km": 1}}, "ranging_accuracy: got the unknown entry 'per_km'"),
    ({"mounting": ["upright"]}, "'upright' or 'inverted'"),
    ({"line\nbreak": 1}, "unknown entry 'line"),
]


@pytest.mark.parametrize(("change", "named"), [*BAD_MODES, *BAD_CHANNELS, *BAD_FIGURES])
def test_a_bad_entry_is_named(tmp_path: Path, change: dict[str, object], named: str) -> None:
    with pytest.raises(RequirementError, match=named) as caught:
        load_scanner(write(tmp_path, **change))
    assert len(str(caught.value).splitlines()) == 1


def test_figures_are_brought_to_metres_and_radians(tmp_path: Path) -> None:
    scanner = load_scanner(
        write(
            tmp_path,
            angular_accuracy_arcsec=18,
            ranging_accuracy={"mm": 1.2, "ppm": 10},
            beam_divergence_mrad=0.23,
            beam_diameter_mm=3.5,
            beam_width_at="FWHM",
            wavelength_nm=1550,
            dual_axis_compensator=False,
        )
    )
    assert scanner.angular_accuracy_rad == pytest.approx(8.7266e-5, rel=1e-4)
    assert scanner.ranging_accuracy == pytest.approx((0.0012, 1e-5))
    assert (scanner.beam_divergence_rad, scanner.beam_diameter_m) == pytest.approx((0.00023, 0.0035))
    assert (scanner.beam_width_at, scanner.dual_axis_compensator) == ("FWHM", False)
    assert scanner.wavelength_m == pytest.approx(1.55e-6)
