"""Lengths on the command line: metres, or with a unit; against figures worked out by hand."""

import click
import pytest
from click.testing import CliRunner
from tlsplan.inputs import numbers
from tlsplan.options import METRES_PER_UNIT, clearance_option, grid_option, height_option

from planner_core.errors import RequirementError


@click.command()
@grid_option
@height_option
@clearance_option
def lengths(grid_step_m: float, heights_m: tuple[float, ...], clearance_m: float) -> None:
    click.echo(" ".join(f"{value:.6f}" for value in (grid_step_m, clearance_m, *heights_m)))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "0.500000 0.400000"),
        (["--grid", "0.25"], "0.250000 0.400000"),
        (["--grid", "2ft", "--clearance", "18in"], "0.609600 0.457200"),
        (["--height", "5ft 3in", "--height", "4' 6\""], "0.500000 0.400000 1.600200 1.371600"),
        (["--clearance", "0"], "0.500000 0.000000"),
    ],
)
def test_options_take_feet_and_inches(arguments: list[str], told: str) -> None:
    result = CliRunner().invoke(lengths, arguments)
    assert result.exit_code == 0, result.output
    assert result.output.strip() == told


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--grid", "1in"], "got 1in, expected 0.05 m or more; give metres, or the unit: 20in"),
        (["--grid", "2 furlongs"], "its unit 'furlongs' is not known there"),
        (["--clearance", "-1ft"], "expected 0 m or more"),
        (["--height", "nan"], "expected a number of metres"),
    ],
)
def test_lengths_that_do_not_do_are_refused_in_one_line(arguments: list[str], line: str) -> None:
    result = CliRunner().invoke(lengths, arguments)
    assert result.exit_code == 2
    assert line in " ".join(result.output.split())


def test_places_take_a_unit_by_number() -> None:
    assert numbers("4ft,1.5,0", "--entrance", "X,Y,Z", (3,)) == pytest.approx([1.2192, 1.5, 0.0])
    with pytest.raises(RequirementError, match="expected X,Y,Z in metres"):
        numbers("4ft,1.5", "--entrance", "X,Y,Z", (3,))


def test_scene_units_know_both_feet() -> None:
    assert METRES_PER_UNIT["ftUS"] * 3937 == pytest.approx(1200.0, rel=1e-15)
    assert METRES_PER_UNIT["ft"] == 0.3048
