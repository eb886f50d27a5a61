"""The registry of shared options: one definition each, so that every command spells and documents them alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

import click

from planner_core.requirements.deliverables import DEFAULT_DELIVERABLE, DELIVERABLES, NO_DELIVERABLE
from planner_core.scanner import DEFAULT_SCANNER, PAPER_SCANNER

F = TypeVar("F", bound=Callable[..., Any])

METRES_PER_UNIT = {
    "m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "ftUS": 1200.0 / 3937.0, "in": 0.0254,
}  # fmt: skip


class Length(click.ParamType[float]):
    """A length of an option: metres, or with its unit, such as `20in` or `5ft 3in`. Gives metres."""

    name = "length"

    def __init__(self, *, least: float, most: float = math.inf, least_open: bool = False) -> None:
        self._least, self._most, self._least_open = least, most, least_open

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return metres; refuse what is no length, and one that is out of range."""
        from planner_core.errors import RequirementError
        from planner_core.requirements.quantities import coordinate_m

        try:
            metres = coordinate_m(value)
        except RequirementError as error:
            self.fail(str(error), param, ctx)
        if not self._least <= metres <= self._most or (self._least_open and metres == self._least):
            least = f"more than {self._least:g}" if self._least_open else f"{self._least:g}"
            most = "" if math.isinf(self._most) else f" to {self._most:g}"
            or_more = " or more" if math.isinf(self._most) and not self._least_open else ""
            self.fail(f"got {value}, expected {least}{most} m{or_more}; give metres, or the unit: 20in", param, ctx)
        return metres


class RenamedChoice(click.Choice[str]):
    """A choice that takes words of earlier versions. earlier : these, and what they are now."""

    def __init__(self, choices: Sequence[str], earlier: Mapping[str, str]) -> None:
        super().__init__(choices)
        self._earlier = earlier

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word of now."""
        return super().convert(self._earlier.get(value, value), param, ctx)


class OfFile(click.ParamType[tuple[str, str]]):
    """A choice for all scene files, `mm`, or for one, `arch.obj=mm`. Gives the file, or empty text, and the choice."""

    name = "choice"

    def __init__(self, choices: Sequence[str]) -> None:
        self._choice = click.Choice(choices)

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        """Return the form that help shows."""
        return f"[FILE=]{self._choice.get_metavar(param, ctx)}"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        """Return file and choice; refuse what is no choice."""
        file, _, choice = str(value).rpartition("=")
        return file, self._choice.convert(choice, param, ctx)


class TextOfFile(click.ParamType[tuple[str, str]]):
    """A text for all drawings, `1:100`, or for one, `upper.pdf=1:50`. Gives the file, or empty text, and the text."""

    name = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        """Return file and text."""
        file, _, text = str(value).rpartition("=")
        return file, text


class SchedulerAddress(click.ParamType[str]):
    """Where workers are: refused before anything is loaded where nobody can be."""

    name = "scheduler"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return it as it is; whether there is a scheduler shows when it is called."""
        from planner_core.cluster.connection import n_local_workers
        from planner_core.errors import ClusterError

        try:
            n_local_workers(str(value))
        except ClusterError as error:
            self.fail(str(error).removeprefix("scheduler: "), param, ctx)
        return str(value)


scene_argument = click.argument(
    "scenes", metavar="SCENE...", nargs=-1, required=True, type=click.Path(path_type=Path, readable=False)
)
plan_scene_option = click.option(
    "--scene", type=click.Path(path_type=Path), multiple=True, metavar="FILE",
    help="Scene file of the plan; may be repeated, for a scene of several files. [default: its path when planned, else "
    "beside the plan]",
)  # fmt: skip

scanner_option = click.option(
    "--scanner", default=None, metavar="NAME[:MODE]|FILE[:MODE]",
    help="Scanner: a name and mode listed by `tlsplan scanners`, or your own specification file. [default: "
    f"{DEFAULT_SCANNER}]",
)  # fmt: skip
preset_option = click.option(
    "--preset", type=click.Choice(["paper"]), default=None,
    help=f"Set of defaults. paper: the robot of the method paper, as with --method paper: scanner {PAPER_SCANNER}, "
    f"deliverable {NO_DELIVERABLE}, any scanner height; overridden by other options.",
)  # fmt: skip
verify_option = click.option(
    "--verify", "n_verify", type=click.IntRange(min=0), default=None, metavar="POINTS",
    help="Verify coverage and overlap with this many independent sample points, cast by Open3D; 200000 for about "
    "0.1 %, 0 for no verification. [default: 20000; 0 with --preset paper]",
)  # fmt: skip
units_option = click.option(
    "--units", type=OfFile(list(METRES_PER_UNIT)), multiple=True,
    help="Length unit of the scene file, for formats without one (OBJ, PLY, STL); ftUS: the US survey foot; of one of "
    "several files: arch.obj=mm. [default: the file's, else m]",
)  # fmt: skip
up_option = click.option(
    "--up", type=OfFile(["y", "z"]), multiple=True,
    help="Up axis of the scene file; of one of several files: arch.obj=y. [default: the file's; y for glTF, z for "
    "others]",
)  # fmt: skip
skip_bad_faces_option = click.option(
    "--skip-bad-faces", is_flag=True, help="Drop and count faces with missing vertices instead of refusing the file."
)
glass_option = click.option(
    "--glass", type=click.Choice(["stop", "pass", "return"]), default="stop", show_default=True,
    help="Effect of glass on beams, for files that mark glass. stop: beams end at glass without a return; pass: beams "
    "go through; return: glass returns beams like a wall.",
)  # fmt: skip
doors_option = click.option(
    "--doors", type=RenamedChoice(["open", "closed", "all"], {"shut": "closed"}), default="open", show_default=True,
    help="State of doors during scanning, for files that mark doors (IFC). open: interior doors open, exterior doors "
    "closed, but for those with planned ground on both sides, as to a loggia; closed: all closed; all: all open. "
    "Leaves of open doors are left out, frames stay.",
)  # fmt: skip
door_open_option = click.option(
    "--door-open", "doors_open", multiple=True, metavar="GLOBALID",
    help="This door (its IFC GlobalId) is open, whatever --doors is; may be repeated.",
)  # fmt: skip
join_option = click.option(
    "--join", type=click.Choice(["inside", "outside"]), default="inside", show_default=True,
    help="Where stations may stand that register rooms with each other. outside: outdoors, too, for dwellings and "
    "wings that no interior door joins; all doors are open.",
)  # fmt: skip
door_closed_option = click.option(
    "--door-closed", "doors_closed", multiple=True, metavar="GLOBALID",
    help="This door (its IFC GlobalId) is closed, whatever --doors is; may be repeated.",
)  # fmt: skip
scale_option = click.option(
    "--scale", "scales", type=TextOfFile(), multiple=True, metavar="[FILE=]1:N",
    help="Scale of a drawn page, or of a picture that states its resolution; of one of several files: upper.pdf=1:50.",
)  # fmt: skip
scale_by_option = click.option(
    "--scale-by", "scales_by", type=TextOfFile(), multiple=True, metavar="[FILE=]LENGTH,X1,Y1,X2,Y2",
    help="Two points of a drawn page or picture and their distance: 2.4m,120,300,480,300. Points are pixels of a "
    "picture, or points of a page, from its upper left corner.",
)  # fmt: skip
corners_option = click.option(
    "--corners", type=TextOfFile(), multiple=True, metavar="[FILE=]WIDTH,HEIGHT,X1,Y1,...,X4,Y4",
    help="Four corners of a rectangle of known size in a photographed drawing, clockwise from the upper left: takes "
    "its perspective away and gives its scale.",
)  # fmt: skip
page_option = click.option(
    "--page", "pages", type=TextOfFile(), multiple=True, metavar="[FILE=]N[,N...]",
    help="Page of a PDF that holds the plan; several pages are storeys from the lowest. [default: the only page]",
)  # fmt: skip
part_option = click.option(
    "--part", "parts", type=TextOfFile(), multiple=True, metavar="[FILE=]X1,Y1,X2,Y2[;...]",
    help="Box that holds the plan, of several on a page or in a drawing; points as for --scale-by, of DXF coordinates; "
    "several boxes are storeys from the lowest.",
)  # fmt: skip
align_option = click.option(
    "--align", "common_points", type=TextOfFile(), multiple=True, metavar="[FILE=]X,Y",
    help="A point that the drawings of several storeys share, such as the corner of a shaft; of each file. [default: "
    "pages and pictures are moved over each other by their walls]",
)  # fmt: skip
layer_option = click.option(
    "--layer", "layers", multiple=True, metavar="KIND=PATTERN",
    help="Contents of a drawing's layers and blocks with such a name: wall, door, window, stair, room, text or "
    "ignored, as in wall=A-MUR*; may be repeated. [default: by words of six languages]",
)  # fmt: skip
layers_option = click.option(
    "--layers", "layers_file", type=click.Path(path_type=Path, readable=False), default=None, metavar="FILE",
    help="An office's names of layers and blocks (YAML or JSON): patterns by kind, after those of --layer; see "
    "docs/formats/layers.md.",
)  # fmt: skip
room_height_option = click.option(
    "--room-height", "room_m", type=Length(least=0.05, most=100.0), default=None, metavar="LENGTH",
    help="Height of rooms that a drawing shows, up to their suspended ceilings. [default: up to the slab of the next "
    "storey, of the highest 2.8]",
)  # fmt: skip
door_height_option = click.option(
    "--door-height", "door_m", type=Length(least=0.05, most=100.0), default=2.1, show_default=True, metavar="LENGTH",
    help="Head of the doors that a drawing shows.",
)  # fmt: skip
sill_height_option = click.option(
    "--sill-height", "sill_m", type=Length(least=0.0, most=100.0), default=0.9, show_default=True, metavar="LENGTH",
    help="Sill of the windows that a drawing shows.",
)  # fmt: skip
storey_height_option = click.option(
    "--storey-height", "storey_m", type=Length(least=0.05, most=100.0), default=None, metavar="LENGTH",
    help="Height from floor to floor of storeys that are drawn. [default: the drawing's levels, else room height and "
    "0.2 m]",
)  # fmt: skip
doubtful_option = click.option(
    "--doubtful", type=click.Choice(["as-open", "as-wall"]), default="as-open", show_default=True,
    help="What a drawing's doubtful elements count as, such as gaps in walls without a door.",
)  # fmt: skip
engine_option = click.option(
    "--engine", type=click.Choice(["auto", "opencl", "open3d"]), default="auto", show_default=True,
    help="Scan engine. auto: OpenCL, or Open3D with a warning if no OpenCL device is usable.",
)  # fmt: skip
device_option = click.option(
    "--device", default=None, metavar="NAME",
    help="OpenCL device: number or part of its name, see `tlsplan doctor`. [default: the fastest by `tlsplan tune`, "
    "else the first GPU, else the first device]",
)  # fmt: skip
scheduler_option = click.option(
    "--scheduler", type=SchedulerAddress(), default=None, metavar="tcp://HOST:PORT|local[:N]",
    help="Dask scheduler whose workers do part of the work; what is written stays the same. local: N workers on this "
    "machine. Needs the extra tlsplan[cluster]; see docs/howto/cluster.md.",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON on standard output.")
quiet_option = click.option("-q", "--quiet", is_flag=True, help="No progress and no summary; warnings and errors only.")
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace existing output.")
floor_option = click.option(
    "--floor", "floors", multiple=True, metavar="ID|NAME",
    help="Floor to plan, see `tlsplan floors`; may be repeated. [default: all]",
)  # fmt: skip
grid_option = click.option(
    "--grid", "grid_step_m", type=Length(least=0.05), default=0.5, show_default=True, metavar="LENGTH",
    help="Spacing of candidate positions, such as 0.5 (metres) or 20in.",
)  # fmt: skip
height_option = click.option(
    "--height", "heights_m", type=Length(least=0.1), multiple=True, metavar="LENGTH",
    help="Instrument height above the floor, such as 1.6 (metres) or 5ft 3in; may be repeated, then the best is chosen "
    "per station. [default: what crews set the scanner's tripod to; a robot's range in steps of 0.4 m]",
)  # fmt: skip
clearance_option = click.option(
    "--clearance", "clearance_m", type=Length(least=0.0), default=0.4, show_default=True, metavar="LENGTH",
    help="Minimum distance from the sensor to walls and furniture, such as 0.4 or 18in.",
)  # fmt: skip
patch_area_option = click.option(
    "--patch-area", "max_patch_area_m2", type=click.FloatRange(min=1e-5), default=0.04, show_default=True,
    metavar="M2", help="Maximum area of a surface patch, the unit in which coverage is counted.",
)  # fmt: skip
scan_mode_option = click.option(
    "--scan-mode", type=click.Choice(["auto", "beams", "patches"]), metavar="MODE", default="auto", show_default=True,
    help="How visibility is computed. beams: every beam of the scan; patches: lines of sight to samples of every "
    "patch, of which the part that is seen counts, at a cost independent of the scanner's resolution; auto: patches, "
    "and with --preset paper beams below four million per scan.",
)  # fmt: skip
requirements_option = click.option(
    "--requirements", "file", type=click.Path(path_type=Path, readable=False), default=None, metavar="FILE",
    help="Requirements file (YAML or JSON): requirements by floor, class and zone, and the site; see "
    "docs/formats/requirements.md. Options override its entries.",
)  # fmt: skip
scope_option = click.option(
    "--scope", type=click.Choice(["auto", "interior", "exterior", "all"]), default=None,
    help="What is surveyed, and where stations stand. interior: what is seen from rooms with outer doors and windows "
    "shut; exterior: facades, roofs and terrain, from outdoors; all; auto: interior, or all if the model has no "
    "enclosed rooms. [default: auto; all with --preset paper]",
)  # fmt: skip
no_cover_option = click.option(
    "--no-cover", "no_cover", multiple=True, metavar="CLASS",
    help="Class of elements that are obstacles, but need not be covered: an IFC class with those below it, a pattern "
    "such as IfcWall*, or name=*pattern*; may be repeated; none: all are to be covered. [default: "
    "IfcFurnishingElement; none with --preset paper]",
)  # fmt: skip
leave_out_option = click.option(
    "--leave-out", "leave_out", multiple=True, metavar="CLASS",
    help="Class of elements that are not in the scene at all, as --no-cover has them; may be repeated.",
)  # fmt: skip
deliverable_option = click.option(
    "--deliverable", type=click.Choice(list(DELIVERABLES), case_sensitive=False), default=None, metavar="NAME",
    help=f"Purpose of the scans: {', '.join(DELIVERABLES)}. Sets point spacing, range, incidence, noise and overlap "
    "where neither options nor the requirements file do; the value any lifts a limit. See docs/method/deliverables.md. "
    f"[default: {DEFAULT_DELIVERABLE}]",
)  # fmt: skip
coverage_option = click.option(
    "--coverage", type=click.FloatRange(min=0, min_open=True, max=100), default=None, metavar="PERCENT",
    help="Required coverage of the scannable area, overall and per floor. [default: 95]",
)  # fmt: skip
overlap_option = click.option(
    "--overlap", type=click.FloatRange(min=0, max=100), default=None, metavar="PERCENT",
    help="Minimum overlap of a link between two stations, where a contract names one. [default: none]",
)  # fmt: skip
pre_alignment_option = click.option(
    "--pre-alignment", type=click.Choice(["tracked", "manual", "level", "none"]), default=None,
    help="Where registration starts. tracked: the instrument follows itself between set-ups; manual: scans are placed "
    "by hand; level: they are only level; none. See docs/method/registration.md. [default: the scanner's]",
)  # fmt: skip
link_probability_option = click.option(
    "--link-probability", type=click.FloatRange(min=0, max=100, max_open=True), default=None, metavar="PERCENT",
    help="Least probability with which the two scans of a link register. [default: 99]",
)  # fmt: skip
doors_change_option = click.option(
    "--doors-change", is_flag=True, default=None,
    help="Doors may be opened and shut from scan to scan: links have to hold with open doors shut, too, during the "
    "scan of either station or of both. Stations in a doorway keep it open.",
)  # fmt: skip
targets_option = click.option(
    "--targets/--no-targets", default=None,
    help="Join what no common surface joins by three targets that both stations see; the plan states where. "
    "[default: with --join outside alone]",
)  # fmt: skip
overlap_measure_option = click.option(
    "--overlap-measure", type=click.Choice(["smaller-share", "jaccard"]), default=None,
    help="Measure of overlap. smaller-share: what both stations see, as a share of what the one sees that sees more; "
    "jaccard: as a share of what either sees. See docs/method/registration.md. [default: smaller-share]",
)  # fmt: skip
overlap_of_option = click.option(
    "--overlap-of", type=click.Choice(["all-seen", "seen-as-required"]), default=None,
    help="Surface that overlap is counted on. all-seen: all that a station sees; seen-as-required: where it meets the "
    "limits required of all (spacing, range, incidence, noise). [default: all-seen]",
)  # fmt: skip


class _NetworkKind(click.Choice[str]):
    """Choices of --network; words of earlier versions are taken as well."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the choice that a word means."""
        now = {"joined": "connected", "loops": "redundant"}.get(str(value), value)
        return super().convert(now, param, ctx)


network_option = click.option(
    "--network", type=_NetworkKind(["connected", "redundant", "none"]), default=None,
    help="Required network of links between stations. connected: one network, as far as the building allows; "
    "redundant: still connected when any one link fails; none: not required. [default: connected]",
)  # fmt: skip
spacing_option = click.option(
    "--spacing", default=None, metavar="LENGTH", help="Maximum point spacing on surfaces, such as 6mm."
)
max_range_option = click.option(
    "--max-range", "range_", default=None, metavar="LENGTH", help="Maximum range, such as 20m."
)
max_incidence_option = click.option(
    "--max-incidence", "incidence", default=None, metavar="ANGLE",
    help="Maximum angle of incidence, such as 65deg.",
)  # fmt: skip
max_noise_option = click.option(
    "--max-noise", "noise", default=None, metavar="LENGTH",
    help="Maximum range noise (one sigma), such as 2mm; for scanners with a specified range noise.",
)  # fmt: skip
seen_from_option = click.option(
    "--seen-from", type=click.IntRange(min=1), default=None, metavar="NUMBER",
    help="Minimum number of stations that see each surface. [default: 1]",
)  # fmt: skip
entrance_option = click.option(
    "--entrance", "entrances", multiple=True, metavar="X,Y,Z",
    help="Building entrance: a ground point in scene coordinates; may be repeated. [default: one assumed in each of "
        "the largest spaces of a floor]",
)  # fmt: skip
scan_seconds_option = click.option(
    "--seconds-per-scan", type=click.FloatRange(min=0), default=None, metavar="SECONDS",
    help="Duration of one scan. [default: that of the scanner's mode]",
)  # fmt: skip
set_up_option = click.option(
    "--set-up", "set_up_s", type=click.FloatRange(min=0), default=60.0, show_default=True, metavar="SECONDS",
    help="Set-up time per station, without scanning.",
)  # fmt: skip
set_up_tolerance_option = click.option(
    "--set-up-tolerance", "set_up_tolerance_m", type=Length(least=0.0), default=0.1, show_default=True,
    metavar="LENGTH", help="Set-up tolerance in plan, half of it in height: the network of stations holds within it, "
    "and coverage is stated for it. 0: exactly on the mark.",
)  # fmt: skip
objective_option = click.option(
    "--objective", type=click.Choice(["fewest", "coverage", "time"]), default="fewest", show_default=True,
    help="What is optimised. fewest: fewest stations; coverage: most coverage with --max-stations; time: least field "
    "time.",
)  # fmt: skip
max_stations_option = click.option(
    "--max-stations", type=click.IntRange(min=1), default=None, metavar="NUMBER",
    help="Maximum number of stations, with --objective coverage.",
)  # fmt: skip
refine_option = click.option(
    "--refine/--no-refine", default=True, show_default=True,
    help="Search for better positions off the grid once stations are chosen.",
)  # fmt: skip
scanned_option = click.option(
    "--scanned", type=click.Path(path_type=Path, readable=False), default=None, metavar="FILE",
    help="Stations already scanned (CSV or plan.json): they count towards coverage and are not visited again.",
)  # fmt: skip
locked_option = click.option(
    "--locked", type=click.Path(path_type=Path, readable=False), default=None, metavar="FILE",
    help="Stations that must be in the plan (CSV or plan.json).",
)  # fmt: skip
keep_option = click.option(
    "--keep", "kept", type=click.Path(path_type=Path, readable=False), default=None, metavar="FILE",
    help="Stations of an earlier plan (CSV or plan.json) to keep as far as possible when planning again.",
)  # fmt: skip
forbid_option = click.option(
    "--forbid", "forbidden", multiple=True, metavar="X,Y,Z[,RADIUS]",
    help="Keep stations at least RADIUS (0.5) from this point in scene coordinates, metres or with units; may be "
    "repeated.",
)  # fmt: skip
method_option = click.option(
    "--method", type=click.Choice(["proven", "greedy", "paper"]), default="proven", show_default=True,
    help="Planning method. proven: fewest stations as one connected network, with a proven lower bound, in minutes; "
    "greedy: one station after the other, in seconds, without a network; paper: the pipeline of the method paper.",
)  # fmt: skip
effort_option = click.option(
    "--effort", type=click.Choice(["quick", "normal", "proof"]), default="normal", show_default=True,
    help="How long method proven goes on. quick: a first plan and a quick bound, without search off the grid; normal: "
    "minutes; proof: twenty times that, for the tightest bound. Ctrl-C ends it with the best plan so far.",
)  # fmt: skip
time_limit_option = click.option(
    "--time-limit", "time_limit_s", type=click.FloatRange(min=0), default=None, metavar="SECONDS",
    help="Time limit of method proven, which then ends with the best plan so far; two runs may differ. [default: a "
        "work limit, the same in every run]",
)  # fmt: skip
search_option = click.option(
    "--search", type=click.Choice(["ls", "sa", "ts", "none"]), default=None,
    help="Spatial search of method paper: local search, simulated annealing, tabu search or none. [default: sa]",
)  # fmt: skip
set_option = click.option(
    "--set", "assignments", multiple=True, metavar="NAME=VALUE",
    help="Option of the method, such as spatial.step_m=0.1, see --method-options; may be repeated.",
)  # fmt: skip


def _print_method_options(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or ctx.resilient_parsing:
        return
    from planner_core.model import Paper, Proven
    from planner_core.model.options import as_text, option_list

    from .output import table

    for method in (Proven(), Paper()):
        table((f"option of --method {method.name}", "default"), [(n, as_text(v)) for n, v in option_list(method)])
    ctx.exit()


method_options_option = click.option(
    "--method-options", is_flag=True, is_eager=True, expose_value=False, callback=_print_method_options,
    help="List the options of --set with their defaults, and exit.",
)  # fmt: skip
seed_option = click.option("--seed", type=int, default=0, show_default=True, help="Random seed.")
stations_option = click.option(
    "--stations", type=click.Path(path_type=Path, readable=False), required=True, metavar="FILE",
    help="Station list in scene coordinates: CSV (id, x_m, y_m, z_m ...) or a plan.json.",
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
    """How to read scene files: the values of `scene_options`."""

    units: tuple[tuple[str, str], ...] = ()
    """File and unit; the file is empty where it holds for all."""
    up: tuple[tuple[str, str], ...] = ()
    skip_bad_faces: bool = False
    glass: str = "stop"
    doors: str = "open"
    doors_open: tuple[str, ...] = ()
    doors_closed: tuple[str, ...] = ()
    join: str = "inside"
    leave_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class DrawingSettings:
    """How to read and raise drawings: the values of `drawing_options`."""

    scales: tuple[tuple[str, str], ...] = ()
    """File and scale; the file is empty where it holds for all. So with the next two."""
    scales_by: tuple[tuple[str, str], ...] = ()
    corners: tuple[tuple[str, str], ...] = ()
    pages: tuple[tuple[str, str], ...] = ()
    parts: tuple[tuple[str, str], ...] = ()
    common_points: tuple[tuple[str, str], ...] = ()
    layers: tuple[str, ...] = ()
    layers_file: Path | None = None
    room_m: float | None = None
    door_m: float = 2.1
    sill_m: float = 0.9
    storey_m: float | None = None
    doubtful: str = "as-open"


@dataclass(frozen=True)
class RequirementOptions:
    """Requirements of the command line: the values of `requirement_options`."""

    file: Path | None = None
    deliverable: str | None = None
    scope: str | None = None
    no_cover: tuple[str, ...] = ()
    coverage: float | None = None
    overlap: float | None = None
    pre_alignment: str | None = None
    link_probability: float | None = None
    doors_change: bool | None = None
    targets: bool | None = None
    overlap_measure: str | None = None
    overlap_of: str | None = None
    network: str | None = None
    spacing: str | None = None
    range_: str | None = None
    incidence: str | None = None
    noise: str | None = None
    seen_from: int | None = None
    floors: tuple[str, ...] = ()
    entrances: tuple[str, ...] = ()


@dataclass(frozen=True)
class PriorStations:
    """Prior stations: the values of `prior_options`."""

    scanned: Path | None = None
    locked: Path | None = None
    kept: Path | None = None
    forbidden: tuple[str, ...] = ()


@dataclass(frozen=True)
class MethodOptions:
    """How stations are chosen: the values of `method_choice`."""

    method: str = "proven"
    objective: str = "fewest"
    max_stations: int | None = None
    refine: bool = True
    effort: str = "normal"
    time_limit_s: float | None = None
    search: str | None = None
    assignments: tuple[str, ...] = ()


DEFAULT_FILE_OPTIONS = FileOptions()
DEFAULT_DRAWING_SETTINGS = DrawingSettings()
NO_PRIOR_STATIONS = PriorStations()
DEFAULT_METHOD_OPTIONS = MethodOptions()


def _gathered(name: str, into: type[Any], *options: Callable[[F], F]) -> Callable[[F], F]:
    """Return a decorator that adds options; the command gets their values as one dataclass, `name`."""
    names = [field.name for field in fields(into)]

    def decorate(function: F) -> F:
        @wraps(function)
        def command(*arguments: Any, **values: Any) -> Any:
            gathered = into(**{field: values.pop(field) for field in names})
            return function(*arguments, **{name: gathered}, **values)

        return apply(*options)(cast(F, command))

    return decorate


scene_options = _gathered(
    "reading",
    FileOptions,
    units_option,
    up_option,
    skip_bad_faces_option,
    glass_option,
    doors_option,
    door_open_option,
    door_closed_option,
    join_option,
    leave_out_option,
)
drawing_options = _gathered(
    "drawn", DrawingSettings, scale_option, scale_by_option, corners_option, page_option, part_option,
    align_option, layer_option, layers_option, room_height_option, door_height_option, sill_height_option,
    storey_height_option, doubtful_option,
)  # fmt: skip
requirement_options = _gathered(
    "asking", RequirementOptions, requirements_option, deliverable_option, scope_option, no_cover_option,
    coverage_option, overlap_option, pre_alignment_option, link_probability_option, doors_change_option,
    targets_option, overlap_measure_option, overlap_of_option, network_option, spacing_option, max_range_option,
    max_incidence_option, max_noise_option, seen_from_option, floor_option, entrance_option,
)  # fmt: skip
prior_options = _gathered("prior_stations", PriorStations, scanned_option, locked_option, keep_option, forbid_option)
method_choice = apply(
    _gathered(
        "choosing", MethodOptions, method_option, objective_option, max_stations_option, refine_option,
        effort_option, time_limit_option, search_option, set_option,
    ),
    method_options_option,
)  # fmt: skip
problem_options = apply(
    scanner_option, preset_option, requirement_options, grid_option, height_option, clearance_option, patch_area_option,
    scan_mode_option, scan_seconds_option, set_up_option, set_up_tolerance_option, seed_option,
)  # fmt: skip
engine_options = apply(engine_option, device_option)
output_options = apply(json_option, quiet_option)
