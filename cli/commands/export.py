"""`tlsplan export`: a plan for others, in the formats that they read."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..coordinates import COORDINATE_OPTIONS, coordinate_options, frame_request
from ..formats_reference import option_of
from ..options import Length, apply, output_options, overwrite_option, plan_scene_option, scheduler_option

if TYPE_CHECKING:
    from planner_core.coordinates.request import FrameRequest
    from planner_core.export.options import Options
    from planner_core.export.write import Written
    from planner_core.plan_folder.plan_source import PlanSource
    from planner_core.progress import Progress

WEB = "web"
_WEB_TITLE = "the viewer and the plan as a folder for any static web host; works offline, read-only"


def _ids(_: click.Context, __: click.Parameter, text: str | None) -> tuple[str, ...]:
    names = tuple(name.strip() for name in (text or "").split(",") if name.strip())
    if text is not None and not names:
        raise click.BadParameter("names no station, expected ids such as S001,S002; leave the option out for all")
    return names


def _bare_numbers(_: click.Context, option: click.Parameter, text: str | None) -> tuple[float, ...] | None:
    from ..inputs import numbers

    if text is not None and set(text.casefold()) - set("0123456789.,+-e "):
        raise click.BadParameter(f"got {text!r}, expected E,N,H without a unit: they are in that of the coordinates.")
    return None if text is None else tuple(numbers(text, option.opts[0], "E,N,H", (3,)))


#: Options of formats: one line each, named as the field of `planner_core.export.options.Options` that it sets.
#: Where it is not given, the field's own default holds.
FORMAT_OPTIONS: dict[str, Callable[[Any], Any]] = {
    "columns": click.option(
        "--columns", metavar="LETTERS|NAME", default=None,
        help="Columns of station lists: letters such as PNEZD, or a program by name, such as trimble-access. [PENZD]",
    ),
    "separator": click.option(
        "--separator", type=click.Choice(["comma", "semicolon", "tab", "space"]), default=None,
        help="Column separator of station lists. [that of the columns chosen]",
    ),
    "decimals": click.option(
        "--decimals", type=click.IntRange(0, 6), default=None, help="Decimals in station lists. [4: 0.1 mm, 0.0001 ft]"
    ),
    "subtract": click.option(
        "--subtract", metavar="E,N,H", default=None, callback=_bare_numbers,
        help="Subtracted from coordinates in CSV and GSI, in their unit, for programs limited to small ones. [0,0,0]",
    ),
    "gsi_unit": click.option(
        "--gsi-unit", type=click.Choice(["mm", "0.1mm", "0.001ft", "0.0001ft"]), default=None,
        help="Resolution of GSI. [mm or 0.001ft for GSI-8, 0.1mm or 0.0001ft for GSI-16]",
    ),
    "geojson_crs": click.option(
        "--geojson-crs", type=click.Choice(["wgs84", "local"]), default=None,
        help="Coordinates of GeoJSON: longitude and latitude, or the site's own, which few programs read. [wgs84]",
    ),
    "kml_heights": click.option(
        "--kml-heights", type=click.Choice(["relative", "absolute"]), default=None,
        help="Heights of KML: above the lowest floor, set on the ground, or above sea level. [relative]",
    ),
    "instrument": click.option(
        "--instrument", type=click.Choice(["ground", "sensor"]), default=None,
        help="Height in formats with a single one: ground point or sensor. [ground]",
    ),
    "floors": click.option(
        "--floor", "floors", multiple=True, metavar="ID|NAME", help="Floor to export; may be repeated. [all]"
    ),
    "paper": click.option("--paper", type=click.Choice(["A4", "A3"]), default=None, help="Paper size of sheets. [A3]"),
    "cut_m": click.option(
        "--cut-m", type=Length(least=0.1, most=10), default=None, metavar="LENGTH",
        help="Height of the section plane of drawings above the floor, such as 4ft. [1.2]",
    ),
    "max_topics": click.option(
        "--max-topics", type=click.IntRange(min=0), default=None,
        help="Maximum rooms and elements with a BCF topic of their own, most unseen first. [50]",
    ),
    "noise": click.option(
        "--noise", is_flag=True, default=None, help="Add the scanner's range noise and dropouts to point clouds."
    ),
    "seed": click.option("--seed", type=click.IntRange(min=0), default=None, help="Random seed of the noise. [0]"),
    "max_points": click.option(
        "--max-points", type=click.IntRange(min=1), default=None,
        help="Maximum points per station; beams are thinned evenly. [all]",
    ),
    "stations": click.option(
        "--stations", default=None, callback=_ids, metavar="ID[,ID...]",
        help="Stations whose point clouds are written. [all]"
    ),
}  # fmt: skip


def _format_options(function: Any) -> Any:
    for option in reversed(FORMAT_OPTIONS.values()):
        function = option(function)
    return function


def _list(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or ctx.resilient_parsing:
        return
    from planner_core.export.formats import FORMATS

    from ..output import table

    rows = [(each.name, each.title, "the scene" if each.needs_scene else "", each.verified_with)
            for each in FORMATS.values()]  # fmt: skip
    table(("format", "content", "also needs", "verified with"), [(WEB, _WEB_TITLE, "", "browsers"), *rows])
    ctx.exit()


def _names(_: click.Context, __: click.Parameter, text: str) -> tuple[str, ...]:
    from planner_core.export.formats import ALL, FORMATS

    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in (WEB, ALL, *FORMATS):
            raise click.BadParameter(f"{name!r} is not one of {', '.join((WEB, *FORMATS, ALL))}.")
    if WEB in names and len(names) > 1:
        raise click.BadParameter(f"{WEB} writes a folder of its own: export it alone.")
    return names


class _Sectioned(click.Command):
    """A command whose help separates options of formats, of coordinates, and the rest."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options under headings."""
        sections: dict[str, list[tuple[str, str]]] = {"Options": [], "Options of formats": [], "Coordinates": []}
        for option in self.get_params(ctx):
            row = option.get_help_record(ctx)
            if row is None or isinstance(option, click.Argument):
                continue
            of_formats = "Options of formats" if option.name in FORMAT_OPTIONS else "Options"
            sections["Coordinates" if option.name in COORDINATE_OPTIONS else of_formats].append(row)
        for heading, rows in sections.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


@click.command(
    "export",
    cls=_Sectioned,
    epilog="Example:  tlsplan export plan/ --format all -o pack/ --crs EPSG:25832 --control-points points.csv",
)
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("--format", "names", required=True, callback=_names, metavar="NAME[,NAME...]|all",
              help="Format, see --list; several, or all, go into one folder under their standard names.")  # fmt: skip
@click.option("-o", "--output", "target", type=click.Path(path_type=Path), required=True, metavar="PATH",
              help="File or folder to write.")  # fmt: skip
@plan_scene_option
@click.option("--as-planned", is_flag=True,
              help="Export the plan as it was made, without what its review changed.")  # fmt: skip
@click.option("--list", is_flag=True, is_eager=True, expose_value=False, callback=_list,
              help="List the formats, and exit.")  # fmt: skip
@_format_options
@coordinate_options
@apply(scheduler_option, overwrite_option, output_options)
def command(
    plan: Path,
    names: tuple[str, ...],
    target: Path,
    scene: tuple[Path, ...],
    as_planned: bool,
    scheduler: str | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    **values: Any,
) -> None:
    """Export the plan folder PLAN, as its review leaves it, to formats of other programs, and sheets for the crew."""
    from planner_core.executor import spread_over

    from .. import inputs, output
    from ..progress import ProgressReporter

    options, frame = _options(names, values), frame_request(values)
    _check_scheduler(names, scheduler)
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        if names == (WEB,):
            written = _web(plan, target, overwrite, reporter.show)
        else:
            with inputs.opened_cluster(scheduler, reporter) as cluster, spread_over(cluster):
                written = _export(names, plan, target, options, overwrite, as_planned, scene, frame, reporter.show)
        reporter.warn((*(f"not written: {each}" for each in written.failed), *written.remarks))
    if as_json:
        document = {"format": ",".join(names), "path": str(target)}
        sizes = {"n_files": written.n_files, "n_bytes": written.n_bytes}
        words = {"coordinates": written.coordinates, "notes": list(written.notes), "warnings": list(written.remarks),
                 "failed": list(written.failed)}  # fmt: skip
        output.as_json({**document, **sizes, **words})
    elif not quiet:
        for line in (f"coordinates: {written.coordinates}", *written.notes) if written.coordinates else ():
            output.say(line)
        output.say(f"{target}: {_size(written.n_bytes)} in {written.n_files} file{'s' if written.n_files > 1 else ''}")
    if written.failed:
        raise click.exceptions.Exit(8)


def _size(n_bytes: int) -> str:
    return f"{n_bytes / 1e6:.1f} MB" if n_bytes >= 100_000 else f"{n_bytes / 1e3:.1f} kB"


def _export(
    names: tuple[str, ...],
    plan: Path,
    target: Path,
    options: Options,
    overwrite: bool,
    as_planned: bool,
    scene: tuple[Path, ...],
    frame: FrameRequest,
    progress: Progress,
) -> Written:
    from planner_core.export.formats import ALL
    from planner_core.export.reviewed import opened_as_reviewed
    from planner_core.export.write import check_export, export_pack, export_plan

    common: dict[str, Any] = {"scene": scene, "frame": frame, "progress": progress}
    is_pack = len(names) > 1 or names[0] == ALL

    def check(source: PlanSource) -> None:
        check_export(names, source, target, options, is_pack=is_pack, overwrite=overwrite)

    with contextlib.ExitStack() as stack:
        source: Path | PlanSource = plan
        remarks: tuple[str, ...] = ()
        if not as_planned:
            source, remarks = stack.enter_context(opened_as_reviewed(plan, names, check=check, **common))
        if is_pack:
            written = export_pack(names, source, target, options, overwrite=overwrite, **common)
        else:
            written = export_plan(names[0], source, target, options, overwrite=overwrite, **common)
    return replace(written, remarks=(*written.remarks, *remarks))


def _web(plan: Path, folder: Path, overwrite: bool, progress: Progress) -> Written:
    from planner_core.export.write import Written
    from viewer_web.static_export import export_viewer

    exported = export_viewer(plan, folder, overwrite=overwrite, progress=progress)
    return Written(folder, exported.n_files, exported.n_bytes, exported.remarks)


def _check_scheduler(names: tuple[str, ...], scheduler: str | None) -> None:
    """Refuse workers where they would have nothing to do."""
    from planner_core.export.formats import FORMATS, formats_named

    if scheduler is not None and not any(each.by_station for each in formats_named([n for n in names if n != WEB])):
        spread = ", ".join(each.name for each in FORMATS.values() if each.by_station)
        raise click.UsageError(
            f"--scheduler: got it with {', '.join(names)}, expected a cloud with a file per station ({spread}); leave "
            "it out."
        )


def _options(names: tuple[str, ...], values: dict[str, Any]) -> Options:
    """Return the options of formats; refuses what none of the chosen formats takes."""
    from planner_core.export.formats import formats_named
    from planner_core.export.options import Options

    given = {name: values[name] for name in FORMAT_OPTIONS if values[name] not in (None, ())}
    taken = {field for each in formats_named([n for n in names if n != WEB]) for field in each.options}
    for name in given:
        if name not in taken:
            raise click.UsageError(f"{option_of(name)}: none of the chosen formats uses it ({', '.join(names)}).")
    return Options(**given)
