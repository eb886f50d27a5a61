"""Options of station lists as they are said on the command line."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from tlsplan.commands.export import command

from planner_core.errors import ExportError, RequirementError

Export = Callable[..., Result]
SENSOR = ("--instrument", "sensor")


@pytest.fixture
def export(written_plan: Callable[..., Path], tmp_path: Path) -> Export:
    """Call the command on a plan written by hand; -o is `out` of the test's folder."""

    def run(name: str, *arguments: str) -> Result:
        target = str(tmp_path / "out")
        return CliRunner().invoke(
            command, [str(written_plan()), "--format", name, "-o", target, "--overwrite", *arguments]
        )

    return run


def lines(tmp_path: Path) -> list[str]:
    return (tmp_path / "out").read_bytes().decode().split("\r\n")[:-1]


def test_columns_separator_and_decimals_are_taken(export: Export, tmp_path: Path) -> None:
    asked = ("--columns", "pnez", "--separator", "semicolon", "--decimals", "2", *SENSOR)
    assert export("csv", *asked).exit_code == 0
    assert lines(tmp_path) == ["S001;4.00;5.00;1.60", "S002;3.00;2.00;4.30", "S003;3.00;7.00;4.50"]


def test_a_profile_is_taken_by_name(export: Export, tmp_path: Path) -> None:
    assert export("csv", "--columns", "Trimble-Access", *SENSOR).exit_code == 0
    assert lines(tmp_path)[0] == "S001,4.0000,5.0000,1.6000,F0"


def test_what_is_taken_off_is_three_numbers(export: Export, tmp_path: Path) -> None:
    assert export("csv", "--columns", "XYZ", "--subtract", "5,4,-1", *SENSOR).exit_code == 0
    assert lines(tmp_path)[0] == "0.0000,0.0000,2.6000"
    refused = export("csv", "--subtract", "5,4", *SENSOR)
    assert isinstance(refused.exception, RequirementError)
    assert "--subtract: got '5,4'" in str(refused.exception)


def test_the_unit_of_gsi_is_taken(export: Export, tmp_path: Path) -> None:
    assert export("gsi16", "--gsi-unit", "mm", *SENSOR).exit_code == 0
    assert "81..10+0000000000005000" in lines(tmp_path)[1]


def test_a_station_of_unknown_height_is_named(export: Export) -> None:
    for name in ("csv", "gsi8", "gsi16"):
        refused = export(name)
        assert isinstance(refused.exception, ExportError), name
        assert "S003" in str(refused.exception)
        assert "\n" not in str(refused.exception)


def test_options_of_other_formats_are_refused(export: Export) -> None:
    refused = export("landxml", "--columns", "PENZD")
    assert refused.exit_code == 2
    assert "--columns: none of the chosen formats uses it" in refused.output
