"""`tlsplan tlsplib`: the library of problems with proven answers; docs/tlsplib describes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..options import quiet_option

if TYPE_CHECKING:
    from tlsplib.library import Library

_FOLDER = Path("docs/tlsplib")


def _shared(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command, and the instances it is about."""
    options = (
        click.argument("names", nargs=-1, metavar="[NAME]..."),
        click.option(
            "--library", "folder", type=click.Path(path_type=Path, file_okay=False), default=_FOLDER,
            show_default=True, metavar="FOLDER", help="Folder of the library.",
        ),
        click.option(
            "--gallery", type=click.Path(path_type=Path, file_okay=False, exists=True), metavar="FOLDER",
            help="Office-like polygons of the art-gallery set, for the instances made from them. [default: these are "
            "left out]",
        ),
    )  # fmt: skip
    for option in reversed(options):
        function = option(function)
    return function


@click.group("tlsplib", epilog="Example:  tlsplan tlsplib check rooms")
def command() -> None:
    """Library of scan planning problems with proven answers: make, solve, check and rank them.

    NAMEs are instances, or what their names begin with. [default: all]
    """


@command.command("generate", epilog="Example:  tlsplan tlsplib generate rooms -o instances/")
@_shared
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, file_okay=False), required=True, metavar="FOLDER",
    help="Folder of the instances to write; those that are there and right stay.",
)  # fmt: skip
@quiet_option
def generate(names: tuple[str, ...], folder: Path, gallery: Path | None, output: Path, quiet: bool) -> None:
    """Write instances from their geometry, each of the digest that the library names."""
    from .. import output as screen

    library = _opened(folder, gallery)
    n_made = n_there = 0
    for name, there in library.generate(names, output):
        n_made, n_there = n_made + (not there), n_there + there
        if not quiet and not there:
            screen.say(name)
    if not quiet:
        screen.say(f"{n_made} written, {n_there} already there: {output}{_left_out(library, names)}")


@command.command("solve", epilog="Example:  tlsplan tlsplib solve rooms --solver proven --solver highs")
@_shared
@click.option("--solver", "solvers", multiple=True, metavar="NAME", help="Solver to run; may repeat. [default: all]")
@click.option("--again", is_flag=True, help="Replace results. [default: what is missing is added]")
def solve(names: tuple[str, ...], folder: Path, gallery: Path | None, solvers: tuple[str, ...], again: bool) -> None:
    """Run solvers, note results, and certify better plans and bounds."""
    from tlsplib.library import known_solvers

    from .. import output as screen

    library = _opened(folder, gallery)
    library.solve(names, known_solvers(solvers), again=again, tell=screen.say)


@command.command("check", epilog="Example:  tlsplan tlsplib check --gallery agp/")
@_shared
@quiet_option
def check(names: tuple[str, ...], folder: Path, gallery: Path | None, quiet: bool) -> None:
    """Check certificates by the checker alone, and that they prove the library's results."""
    from .. import output as screen

    library = _opened(folder, gallery)
    n_checked = n_proven = 0
    for name, stations, bound in library.check(names):
        n_checked, n_proven = n_checked + 1, n_proven + (stations == bound)
        if not quiet:
            screen.say(f"{name}: {stations} stations, at least {bound}")
    if not quiet:
        screen.say(f"{n_checked} certificates hold, {n_proven} plans are proven{_left_out(library, names)}")


@command.command("rank", epilog="Example:  tlsplan tlsplib rank --write docs/tlsplib/results.md")
@_shared
@click.option("--write", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help="Page to write.")
def rank(names: tuple[str, ...], folder: Path, gallery: Path | None, write: Path | None) -> None:
    """Rank solvers by what they found, class by class."""
    from tlsplib.page import page, ranking

    from .. import output as screen

    library = _opened(folder, gallery)
    if write is not None:
        write.write_text(page(library.listed(), library.results()), encoding="utf-8")
        return
    header, rows = ranking(library.listed(), library.results(), names)
    screen.table(header, rows)


def _opened(folder: Path, gallery: Path | None) -> Library:
    from tlsplib.library import Library

    from planner_core.errors import SceneError

    if not (folder / "library.json").exists():
        raise SceneError(f"{folder}: got no library.json in it, expected the library's folder; pass --library FOLDER")
    return Library(folder, gallery)


def _left_out(library: Library, names: tuple[str, ...]) -> str:
    n = library.n_left_out(names)
    return f"; {n} left out, pass --gallery to have them, too" if n else ""
