"""The registry of shared options: one definition each, so that every command spells and documents them alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])

METRES_PER_UNIT = {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}

scene_argument = click.argument("scene", type=click.Path(path_type=Path, readable=False))

scanner_option = click.option(
    "--scanner", default="hdl-64e", show_default=True, metavar="NAME[:MODE]|FILE[:MODE]",
    help="Scanner by name (`tlsplan scanners` lists them and their modes) or your own specification file.",
)  # fmt: skip
units_option = click.option(
    "--units", type=click.Choice(list(METRES_PER_UNIT)), default=None,
    help="Unit of the scene file, where it does not say so itself (OBJ, PLY, STL). [default: as the file says, else m]",
)  # fmt: skip
up_option = click.option(
    "--up", type=click.Choice(["y", "z"]), default=None,
    help="Up axis of the scene file. [default: as the file says; glTF y, others z]",
)  # fmt: skip
skip_bad_faces_option = click.option(
    "--skip-bad-faces", is_flag=True, help="Drop (and count) faces that name vertices the file does not have."
)
glass_option = click.option(
    "--glass", type=click.Choice(["stop", "pass", "return"]), default="stop", show_default=True,
    help="What glass does to beams, where the file says what is glass. stop: they end there, so that nothing seen "
    "through glass is relied on; pass: they go through; return: they come back, as from a wall.",
)  # fmt: skip
engine_option = click.option(
    "--engine", type=click.Choice(["auto", "opencl", "open3d"]), default="auto", show_default=True,
    help="What casts the beams. auto: OpenCL; Open3D, said aloud, where there is no OpenCL device.",
)  # fmt: skip
device_option = click.option(
    "--device", default=None, metavar="NAME",
    help="OpenCL device by number or part of its name (see `tlsplan doctor`). [default: the first GPU, else CPU]",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON on standard output.")
quiet_option = click.option("-q", "--quiet", is_flag=True, help="No progress and no summary; warnings and errors stay.")
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace the output where it exists.")
floor_option = click.option(
    "--floor", "floors", multiple=True, metavar="ID|NAME",
    help="Plan only this floor (`tlsplan floors` lists them); may be repeated. [default: all]",
)  # fmt: skip
grid_option = click.option(
    "--grid", "grid_step_m", type=click.FloatRange(min=0.05), default=0.5, show_default=True, metavar="METRES",
    help="Spacing of candidate positions.",
)  # fmt: skip
height_option = click.option(
    "--height", "heights_m", type=click.FloatRange(min=0.1), multiple=True, metavar="METRES",
    help="Instrument height to try; may be repeated. [default: the scanner's range in steps of 0.4 m]",
)  # fmt: skip
clearance_option = click.option(
    "--clearance", "clearance_m", type=click.FloatRange(min=0.0), default=0.4, show_default=True, metavar="METRES",
    help="Smallest distance from the sensor to walls and furniture.",
)  # fmt: skip
patch_area_option = click.option(
    "--patch-area", "max_patch_area_m2", type=click.FloatRange(min=1e-5), default=0.04, show_default=True,
    metavar="M2", help="Largest patch, the unit in which coverage is counted.",
)  # fmt: skip
scan_mode_option = click.option(
    "--scan-mode", type=click.Choice(["auto", "beams", "patches"]), metavar="MODE", default="auto", show_default=True,
    help="What candidates are judged by. beams: every beam; patches: samples of every patch, at a cost that does not "
    "depend on the scanner's resolution. auto: patches from four million beams a scan on.",
)  # fmt: skip
coverage_option = click.option(
    "--coverage", "coverage_percent", type=click.FloatRange(min=0, min_open=True, max=100), default=95.0,
    show_default=True, metavar="PERCENT", help="Coverage asked for, of the achievable area, overall and on each floor.",
)  # fmt: skip
overlap_option = click.option(
    "--overlap", "overlap_percent", type=click.FloatRange(min=0, max=100), default=30.0, show_default=True,
    metavar="PERCENT", help="Overlap at which two stations count as linked.",
)  # fmt: skip
method_option = click.option(
    "--method", type=click.Choice(["greedy", "proven", "paper"]), default="greedy", show_default=True,
    help="How stations are chosen. greedy: one after the other, in seconds; proven: fewer, and a bound on how few "
    "there can be, in a minute or so; paper: the pipeline of the method paper.",
)  # fmt: skip
time_limit_option = click.option(
    "--time-limit", "time_limit_s", type=click.FloatRange(min=0), default=None, metavar="SECONDS",
    help="Method proven: stop after so long with the best plan so far. Two runs may then differ. [default: a limit of "
    "work, the same for every run]",
)  # fmt: skip
search_option = click.option(
    "--search", type=click.Choice(["ls", "sa", "ts", "none"]), default=None,
    help="Spatial search of method paper: local search, simulated annealing, tabu search. [default: sa]",
)  # fmt: skip
set_option = click.option(
    "--set", "assignments", multiple=True, metavar="NAME=VALUE",
    help="An option of the method, such as spatial.step_m=0.1; may be repeated. --method-options lists them.",
)  # fmt: skip


def _as_text(value: Any) -> str:
    """Return a default as --set takes it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ",".join(f"{part:g}" for part in value) if isinstance(value, tuple) else str(value).lower()


def _print_method_options(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or ctx.resilient_parsing:
        return
    from planner_core.method_options import option_list
    from planner_core.paper import PaperSettings
    from planner_core.select.proven import SelectionSettings

    from .output import table

    for method, settings in (("proven", SelectionSettings()), ("paper", PaperSettings())):
        table((f"option of --method {method}", "default"), [(n, _as_text(v)) for n, v in option_list(settings)])
    ctx.exit()


method_options_option = click.option(
    "--method-options", is_flag=True, is_eager=True, expose_value=False, callback=_print_method_options,
    help="List the options that --set takes, with their defaults, and exit.",
)  # fmt: skip
seed_option = click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything random.")
stations_option = click.option(
    "--stations", type=click.Path(path_type=Path, readable=False), required=True, metavar="FILE",
    help="Stations in scene coordinates: CSV (id, x_m, y_m, z_m ...) or a plan.json.",
)  # fmt: skip


def apply(*options: Callable[[F], F]) -> Callable[[F], F]:
    """Return a decorator that applies the options so that `--help` lists them in the order given."""

    def decorate(function: F) -> F:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


@dataclass(frozen=True)
class FileOptions:
    """How to read a scene file: the values of `scene_options`."""

    units: str | None = None
    up: str | None = None
    skip_bad_faces: bool = False
    glass: str = "stop"


AS_THE_FILE_SAYS = FileOptions()


def scene_options(function: F) -> F:
    """Add the options on reading the scene file; the command gets their values as one `FileOptions`, `reading`."""
    names = [field.name for field in fields(FileOptions)]

    @wraps(function)
    def command(*arguments: Any, **values: Any) -> Any:
        reading = FileOptions(**{name: values.pop(name) for name in names})
        return function(*arguments, reading=reading, **values)

    gathered: Any = apply(units_option, up_option, skip_bad_faces_option, glass_option)(command)
    return gathered  # type: ignore[no-any-return]


problem_options = apply(
    scanner_option, coverage_option, overlap_option, floor_option, grid_option, height_option, clearance_option,
    patch_area_option, scan_mode_option, seed_option,
)  # fmt: skip
method_choice = apply(method_option, time_limit_option, search_option, set_option, method_options_option)
engine_options = apply(engine_option, device_option)
output_options = apply(json_option, quiet_option)
