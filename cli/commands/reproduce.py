"""`tlsplan reproduce`: the figures of the method paper, from our own runs."""

from __future__ import annotations

from pathlib import Path

import click

from ..options import overwrite_option, quiet_option, seed_option


@click.command("reproduce", epilog="Example:  tlsplan reproduce fig12 -o reproduction/")
@click.argument("names", nargs=-1, metavar="[FIGURE]...")
@click.option(
    "-o", "--output", "folder", type=click.Path(path_type=Path, file_okay=False), default=Path("reproduction"),
    show_default=True, metavar="FOLDER", help="Folder of pages, pictures and numbers to write.",
)  # fmt: skip
@click.option("--full", is_flag=True, help="Sizes of the paper, which take hours. [default: sizes that take minutes]")
@click.option(
    "--resume", is_flag=True, help="Skip figures whose page is of the same settings; replace the other pages."
)
@seed_option
@overwrite_option
@quiet_option
def command(
    names: tuple[str, ...], folder: Path, full: bool, resume: bool, seed: int, overwrite: bool, quiet: bool
) -> None:
    """Reproduce FIGUREs of the method paper; `all` runs every one; without FIGURE, list them."""
    from paper_figures.figure import Bench
    from paper_figures.figures import FIGURES
    from paper_figures.page import is_current, write_index, write_page

    from planner_core.errors import OutputExistsError, RequirementError
    from planner_core.plan_folder.atomic import scratch_folder

    from .. import output
    from ..progress import ProgressReporter

    known = {figure.name: figure for figure in FIGURES}
    if not names:
        output.table(("figure", "content"), [(figure.name, figure.title) for figure in FIGURES])
        return
    unknown = [name for name in names if name not in known and name != "all"]
    if unknown:
        raise RequirementError(f"figure {unknown[0]!r} is not known; expected all or one of {', '.join(known)}.")
    wanted = list(known) if "all" in names else list(dict.fromkeys(names))
    if resume:
        wanted = [name for name in wanted if not is_current(folder, known[name], full=full, seed=seed)]
    taken = [name for name in wanted if (folder / f"{name}.md").exists()]
    if taken and not (overwrite or resume):
        raise OutputExistsError(f"{folder / taken[0]}.md exists; pass --overwrite to replace it.")
    folder.mkdir(parents=True, exist_ok=True)
    shown: set[str] = set()
    for name in wanted:
        figure = known[name]
        # A figure that fails or is interrupted leaves nothing: its files move in only when all of them are there.
        with scratch_folder(folder / name) as staging, ProgressReporter(quiet=quiet, shown=shown) as reporter:
            bench = Bench(folder=staging, full=full, seed=seed, progress=reporter.show, warn=reporter.warn)
            outcome = figure.run(bench)
            write_page(bench.folder, figure, outcome, full=full, seed=seed)
            # The numbers come last: with them the figure counts as done.
            for file in sorted(bench.folder.iterdir(), key=lambda file: file.suffix == ".json"):
                file.replace(folder / file.name)
        if not quiet:
            output.say(f"{name}: agrees: {outcome.agrees}; {folder / name}.md")
        write_index(folder, FIGURES)
    if not wanted and not quiet:
        output.say(f"all figures are of these settings; {folder / 'index.md'}")
