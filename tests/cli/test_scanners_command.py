"""`tlsplan scanners` says what a scanner's file says."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from tlsplan.commands.scanners import command, reference_page

from planner_core.scanner.load_scanner import load_scanner


def test_json_has_every_figure_of_pandar64() -> None:
    document = json.loads(CliRunner().invoke(command, ["--json"]).stdout)
    found = next(s for s in document["scanners"] if s["name"] == "pandar64")
    assert (found["n_azimuths"], found["n_channels"], found["mounting"]) == (1800, 64, "upright")
    assert (found["elevation_min_deg"], found["elevation_max_deg"]) == (-24.897, 14.882)
    assert found["azimuth_range_deg"] is None
    assert found["azimuth_offset_deg"][14] == -5.208
    assert (found["instrument_height_min_m"], found["instrument_height_max_m"]) == (0.5, 2.0)


def test_table_shows_sectors_and_mounting(monkeypatch: pytest.MonkeyPatch) -> None:
    hanging = replace(load_scanner("hdl-64e"), azimuth_range_rad=(-0.5, 0.5), inverted=True)
    monkeypatch.setattr("planner_core.scanner.load_scanner.list_scanners", lambda: (hanging,))
    line = CliRunner().invoke(command, []).stdout.splitlines()[1]
    assert "-28.6 to 28.6" in line
    assert line.endswith("inverted")


def test_json_has_the_modes_of_a_survey_scanner() -> None:
    document = json.loads(CliRunner().invoke(command, ["--json"]).stdout)
    found = next(s for s in document["scanners"] if s["name"] == "rtc360")
    assert (found["mode"], found["seconds_per_scan"]) == ("medium", 111.0)
    assert [(m["id"], m["n_azimuths"], m["n_channels"], m["seconds"]) for m in found["modes"]] == [
        ("low", 5236, 2183, 86.0),
        ("medium", 10472, 4364, 111.0),
        ("high", 20944, 8728, 162.0),
    ]
    assert found["ranging_accuracy"] == {"constant_m": 0.001, "per_metre": 1e-05}
    assert found["beam_divergence_rad"] is None
    assert found["range_noise"] == []


def test_table_lists_the_modes() -> None:
    lines = CliRunner().invoke(command, []).stdout.splitlines()
    rtc360 = next(line for line in lines if line.startswith("rtc360"))
    assert "low medium high" in rtc360
    assert "10472 x 4364" in rtc360


def test_the_page_on_scanners_is_the_files_that_come_along() -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "reference" / "scanners.md"
    remedy = "run `python -m tlsplan.commands.scanners docs/reference/scanners.md`"
    assert page.read_text(encoding="utf-8") == reference_page(), remedy
