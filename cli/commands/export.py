"""`tlsplan export`: a plan for others, in the format that they read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..options import apply, output_options, overwrite_option

if TYPE_CHECKING:
    from planner_core.progress import Progress


@dataclass(frozen=True)
class Written:
    """What an export wrote. remarks : one line each, for the user."""

    n_files: int
    n_bytes: int
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format of `tlsplan export`. write : plan folder, output, whether to replace it, progress."""

    title: str
    write: Callable[[Path, Path, bool, Progress], Written]


def _web(plan: Path, folder: Path, overwrite: bool, progress: Progress) -> Written:
    from viewer_web.static_export import export_viewer

    exported = export_viewer(plan, folder, overwrite=overwrite, progress=progress)
    return Written(exported.n_files, exported.n_bytes, exported.remarks)


#: By the name that --format takes.
FORMATS: dict[str, Format] = {
    "web": Format("the viewer and the plan as a folder for any static web host; works offline, read-only", _web),
}


def _list(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or ctx.resilient_parsing:
        return
    from ..output import table

    table(("format", "what it is"), [(name, each.title) for name, each in FORMATS.items()])
    ctx.exit()


@click.command("export", epilog="Example:  tlsplan export plan/ --format web -o for-the-client/")
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("--format", "name", type=click.Choice(list(FORMATS)), required=True, help="See --list.")
@click.option("-o", "--output", "target", type=click.Path(path_type=Path), required=True, metavar="PATH",
              help="What to write.")  # fmt: skip
@click.option("--list", is_flag=True, is_eager=True, expose_value=False, callback=_list,
              help="List the formats, and exit.")  # fmt: skip
@apply(overwrite_option, output_options)
def command(plan: Path, name: str, target: Path, overwrite: bool, as_json: bool, quiet: bool) -> None:
    """Write the plan folder PLAN in another format, to hand it over."""
    from .. import output
    from ..progress import ProgressReporter

    with ProgressReporter(quiet=quiet or as_json) as reporter:
        written = FORMATS[name].write(plan, target, overwrite, reporter.show)
        reporter.warn(written.remarks)
    if as_json:
        document = {"format": name, "path": str(target), "n_files": written.n_files, "n_bytes": written.n_bytes}
        output.as_json({**document, "warnings": list(written.remarks)})
    elif not quiet:
        output.say(f"{target}: {written.n_bytes / 1e6:.1f} MB in {written.n_files} files")
