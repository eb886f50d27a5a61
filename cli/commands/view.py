"""`tlsplan view`: show a plan folder in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..options import DEFAULT_DRAWING_SETTINGS, DrawingSettings, FileOptions, apply, drawing_options, units_option

if TYPE_CHECKING:
    from viewer_web.server.jobs.runs import LeftRun


@click.command("view", epilog="Example:  tlsplan view plan/")
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("--port", type=click.IntRange(0, 65535), help="Port to listen on. [default: any free one]")
@click.option("--host", metavar="ADDRESS",
              help="Address to listen on; any but loopback lets others on the network read the plan. "
              "[default: 127.0.0.1]")  # fmt: skip
@click.option("--keep-links", is_flag=True,
              help="The same addresses at each start with this option: tokens, port and host are kept in the user's "
              "cache folder, for this plan folder. --port and --host replace those kept.")  # fmt: skip
@click.option("--allow-host", "allowed_hosts", multiple=True, metavar="NAME",
              help="Additional host name to accept, for a proxy or a tunnel; may be repeated.")  # fmt: skip
@click.option("--scene", type=click.Path(path_type=Path), multiple=True, metavar="FILE",
              help="Scene file, for live figures while editing; may be repeated, for a scene of several files. "
              "[default: its path when planned]")  # fmt: skip
@click.option("--read-only", is_flag=True, help="No changes to the review, no runs.")
@click.option("--comment-only", is_flag=True,
              help="Comments and verdicts only: no edited stations, no runs, no sign-off.")  # fmt: skip
@click.option("--no-live", is_flag=True, help="No live figures: saves memory and time.")
@click.option("--no-browser", is_flag=True, help="Print the address without opening a browser.")
@apply(units_option, drawing_options)
def command(
    plan: Path,
    port: int | None,
    host: str | None,
    keep_links: bool,
    allowed_hosts: tuple[str, ...],
    scene: tuple[Path, ...],
    read_only: bool,
    comment_only: bool,
    no_live: bool,
    no_browser: bool,
    units: tuple[tuple[str, str], ...],
    drawn: DrawingSettings,
) -> None:
    """Show the plan folder PLAN in the browser, served until Ctrl-C.

    PLAN may be a drawing (DXF, PDF, picture), or a drawing file such as floor.drawing.json: it is corrected before it
    is planned. The options from --units on are of drawings.

    The printed address contains a token: anyone who has it can read the plan and change its review. With the second
    address one can read, comment and give verdicts, and no more.
    """
    from planner_core.cache import CACHE_VARIABLE
    from planner_core.drawings.lift import is_drawing
    from planner_core.errors import PlanFolderError, RequirementError, one_line
    from planner_core.plan_folder.drawn_files import DrawnFiles, is_drawn_file, read_drawn_file
    from planner_core.plan_folder.plan_json import read_plan_json
    from planner_core.plan_folder.plan_settings import find_scene
    from planner_core.review.store import ReviewStore
    from viewer_web.server.live_worker import opening_goes_on
    from viewer_web.server.serve import serve

    from .. import output
    from ..environment import check_caches_are_kept, leave_at_once

    shown = plan

    def ready(address: str) -> None:
        output.say(f"{shown} is shown at {address}   (Ctrl-C ends it)")
        if not no_browser:
            click.launch(address)

    def comment_address(address: str) -> None:
        output.say(f"for comments and verdicts only: {address}")

    def kept(file: Path) -> None:
        output.say(f"kept for the next start with --keep-links, until you delete {file}")

    def warn(line: str) -> None:
        click.echo(f"warning: {one_line(line)}", err=True)

    if is_drawing(plan):
        plan = shown = _recognised(plan, FileOptions(units=units), drawn)
    elif units or drawn != DEFAULT_DRAWING_SETTINGS:
        raise RequirementError(f"options of drawings: got them with {plan}, expected a drawing; leave them out")
    if is_drawn_file(plan):
        read_drawn_file(plan)  # a broken one is refused here, not by an empty page
        plan = DrawnFiles.of(plan.resolve()).plan_folder
        no_live = no_live or not plan.is_dir()
    else:
        document = read_plan_json(plan)  # so is a broken plan
        if scene:
            find_scene(plan, document, scenes=scene)  # and the wrong building
        try:
            ReviewStore(plan).current()
        except PlanFolderError as error:  # the plan can be viewed without
            warn(str(error))
    if keep_links:
        try:
            check_caches_are_kept(CACHE_VARIABLE)
        except RequirementError as error:  # caches go with this process
            warn(f"links are not kept: {error}")
            keep_links = False
    left: list[LeftRun] = []
    try:
        serve(
            plan,
            host=host,
            port=port,
            on_ready=ready,
            allowed_hosts=allowed_hosts,
            scene=scene,
            read_only=read_only,
            comment_only=comment_only,
            on_comment_address=comment_address,
            live=not no_live,
            keep_links=keep_links,
            on_left=left.append,
            on_kept=kept,
            on_warning=warn,
        )
    except KeyboardInterrupt:
        output.say("stopped")
        for run in left:
            output.say(_left_in_words(run))
        if opening_goes_on():
            leave_at_once(0)


def _recognised(drawing: Path, reading: FileOptions, drawn: DrawingSettings) -> Path:
    """Read a drawing as `tlsplan plan` does, to the drawing file in the current directory."""
    from ..drawings import with_drawings_lifted
    from ..progress import ProgressReporter

    lifted = Path(f"{drawing.stem}-plan.ifc")
    with ProgressReporter(quiet=False) as reporter:
        with_drawings_lifted([drawing], reading, drawn, lifted, reporter, overwrite=False)
    return lifted.with_suffix(".drawing.json")


def _left_in_words(left: LeftRun) -> str:
    if left.is_ending:
        return f"run {left.run} was cancelled: if it has a plan so far, it still writes it to {left.plan}"
    return (
        f"run {left.run} continues, and writes its plan to {left.plan}; start `tlsplan view` again to see or cancel it"
    )
