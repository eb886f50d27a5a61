"""`tlsplan scanners` says what a scanner's file says."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner
from tlsplan.commands.scanners import command

from planner_core.scan import scanners
from planner_core.scan.scanners import load_scanner


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
    monkeypatch.setattr(scanners, "list_scanners", lambda: (hanging,))
    line = CliRunner().invoke(command, []).stdout.splitlines()[1]
    assert "-28.6 to 28.6" in line
    assert line.endswith("inverted")
