"""`tlsplan export`: names, options and coordinates as they are said on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from oldest_plan import floor, oldest_plan, station
from tlsplan.commands.export import command

from planner_core.errors import CoordinatesError, OutputExistsError, RequirementError
from planner_core.export.formats import FORMATS

Export = Callable[..., Result]


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """A plan of one station, with nothing but its plan.json."""
    document = oldest_plan(
        floors=[floor("F0", 0.0, name="Ground floor", bounds=[[0, 0], [10, 8]])],
        stations=[station("S001", "F0", 1, [5.0, 4.0, 1.6], instrument_height_m=1.6)],
        registration={"threshold": 0.3, "connected": True, "links": []},
    )
    folder = tmp_path / "plan"
    folder.mkdir()
    (folder / "plan.json").write_text(json.dumps(document))
    return folder


@pytest.fixture
def export(plan: Path, tmp_path: Path) -> Export:
    """Call the command on the plan; -o is `out.csv` of the test's folder."""

    def run(*arguments: str, names: str = "csv") -> Result:
        return CliRunner().invoke(command, [str(plan), "--format", names, "-o", str(tmp_path / "out.csv"), *arguments])

    return run


def first_line(tmp_path: Path) -> list[str]:
    return (tmp_path / "out.csv").read_text().splitlines()[0].split(",")


def test_the_list_names_every_format_and_what_read_it() -> None:
    listed = CliRunner().invoke(command, ["--list"])
    assert listed.exit_code == 0
    for each in FORMATS.values():
        (line,) = [line for line in listed.output.splitlines() if line.split()[0] == each.name]
        assert each.title in line
        assert each.verified_with in line


def test_the_help_has_formats_and_coordinates_apart() -> None:
    text = CliRunner().invoke(command, ["--help"]).output
    at = [
        text.index(word)
        for word in ("Options:", "--overwrite", "Options of formats:", "--columns", "Coordinates:", "--crs")
    ]
    assert at == sorted(at)


def test_a_file_is_written_and_told(export: Export, tmp_path: Path) -> None:
    told = export("--origin", "100,200,30", "--rotation", "90")
    assert told.exit_code == 0, told.output
    assert first_line(tmp_path)[:4] == ["S001", "96.0000", "205.0000", "30.0000"]
    assert "coordinates: local site coordinates, no CRS" in told.output
    assert "kB in 1 file" in told.output


def test_scene_coordinates_are_said_to_be_none_of_a_crs(export: Export) -> None:
    assert "coordinates: scene coordinates, no CRS" in export().output


def test_json_tells_coordinates_and_doubts(export: Export, tmp_path: Path) -> None:
    told = export("--json", "--crs", "25832", "--origin", "5438260,458870,110", "--accept-implausible")
    document = json.loads(told.stdout)
    assert (document["format"], document["n_files"]) == ("csv", 1)
    assert document["n_bytes"] == (tmp_path / "out.csv").stat().st_size
    assert document["coordinates"].startswith("EPSG:25832")
    assert any("look swapped" in line for line in document["warnings"])
    assert any("vertical datum" in line for line in document["notes"])


def test_control_points_place_the_plan(export: Export, tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    points.write_text("name,x,y,z,E,N,H\nA,0,0,0,100,200,30\nB,10,0,0,100,210,30\nC,10,8,0,92,210,30\n")
    told = export("--control-points", str(points), "--fixed-scale", "--residual-limit", "0.001")
    assert told.exit_code == 0, told.output
    assert first_line(tmp_path)[:4] == ["S001", "96.0000", "205.0000", "30.0000"]
    assert "3 control points, 4 parameters" in told.output


def test_several_formats_are_a_folder(export: Export, tmp_path: Path) -> None:
    assert export(names="csv, gsi16").exit_code == 0
    assert sorted(path.name for path in (tmp_path / "out.csv").iterdir()) == [
        "pack.json", "stations-16.gsi", "stations.csv",
    ]  # fmt: skip


def test_a_format_that_fails_is_named_and_the_others_are_written(
    export: Export, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Eight digits hold 99 999.999 m: GSI-8 refuses the site's coordinates, and the list of stations is written."""
    far = ("--crs", "EPSG:25832", "--origin", "458870,5438260,110")
    result = export("--json", *far, names="gsi8,csv")
    assert result.exit_code == 8, result.output
    (failed,) = json.loads(result.stdout)["failed"]
    assert failed.startswith("gsi8: ")
    assert sorted(path.name for path in (tmp_path / "out.csv").iterdir()) == ["pack.json", "stations.csv"]
    assert "gsi8: " in result.stderr + capfd.readouterr().err


def test_nothing_is_replaced_unasked(export: Export) -> None:
    assert export().exit_code == 0
    assert isinstance(export().exception, OutputExistsError)
    assert export("--overwrite").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--paper", "A4"], "--paper: none of the chosen formats uses it"),
        (["--noise"], "--noise: none of the chosen formats uses it"),
        (["--parameters", "5"], "is not one of"),
        (["--residual-limit", "0"], "expected more than 0 m"),
    ],
)
def test_options_that_say_nothing_here_are_refused(export: Export, arguments: list[str], told: str) -> None:
    result = export(*arguments)
    assert (result.exit_code, told in result.output) == (2, True), result.output


@pytest.mark.parametrize(
    ("names", "told"), [("cvs", "'cvs' is not one of"), ("web,csv", "export it alone"), ("", "''")]
)
def test_names_of_no_format_are_refused(export: Export, names: str, told: str) -> None:
    result = export(names=names)
    assert (result.exit_code, told in result.output) == (2, True), result.output


@pytest.mark.parametrize(
    ("arguments", "error", "told"),
    [
        (["--rotation", "3"], CoordinatesError, "--rotation: got it without --origin"),
        (["--scale", "1"], CoordinatesError, "--scale: got it without --origin"),
        (["--fixed-scale"], CoordinatesError, "--fixed-scale: got it without --control-points"),
        (["--parameters", "7"], CoordinatesError, "--parameters: got it without --control-points"),
        (["--origin", "1,2"], RequirementError, "expected E,N,H"),
        (["--origin", "1,2,3", "--scene-coordinates"], CoordinatesError, "got both"),
        (
            ["--crs", "25832", "--origin", "5438260,458870,110"],
            CoordinatesError,
            "look swapped; exchange them; --accept-implausible",
        ),
        (["--crs", "25832", "--origin", "458870000,5438260000,110000"], CoordinatesError, "taken as millimetres"),
        (["--crs", "EPSG:1"], CoordinatesError, "not a known coordinate reference system"),
        (["--control-points", "no-such.csv"], CoordinatesError, "no such file"),
    ],
)
def test_coordinates_that_make_no_sense_are_one_line(
    export: Export, tmp_path: Path, arguments: list[str], error: type[Exception], told: str
) -> None:
    result = export(*arguments)
    assert isinstance(result.exception, error)
    assert told in str(result.exception)
    assert "\n" not in str(result.exception)
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize("option", ["--origin", "--subtract"])
def test_the_coordinates_that_a_refusal_suggests_are_taken(export: Export, option: str) -> None:
    refused = str(export(option, "1,2").exception)
    example = refused.rpartition("such as ")[2]
    assert example.count(",") == 2
    assert export(option, example).exit_code == 0
