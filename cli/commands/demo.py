"""`tlsplan demo`: the shortest way to see what the product does."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from ..options import MethodOptions, apply, engine_options, output_options, overwrite_option, problem_options

if TYPE_CHECKING:
    from scenes_synthetic.model import SyntheticScene

#: Of the search for fewer stations; `plan` has fifteen times as much.
_WORK_LIMIT = 5.0


@click.command("demo", epilog="Example:  tlsplan demo   then   tlsplan view demo-plan/")
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), default=Path("demo-plan"), show_default=True,
              metavar="FOLDER", help="Plan folder to write, with the building beside it as <FOLDER>.ifc.")  # fmt: skip
@apply(problem_options, engine_options, overwrite_option, output_options)
def command(folder: Path, overwrite: bool, **values: Any) -> None:
    """Plan a synthetic two-storey house and write the plan folder."""
    import scenes_synthetic
    from planner_core.errors import OutputExistsError
    from planner_core.plan_folder.folder import check_output

    from . import plan as plan_command

    check_output(folder, overwrite=overwrite)
    scene = folder.with_name(f"{folder.name}.ifc")
    house = scenes_synthetic.build("house")
    if scene.exists() and not overwrite and not _is(scene, house):  # a run that was interrupted leaves the same file
        raise OutputExistsError(f"{scene}: exists, expected a free name for the demo's building; pass --overwrite")
    scenes_synthetic.write(house, scene)
    # Seconds, not minutes: the bound stays a little lower than `plan` would prove.
    choosing = MethodOptions(assignments=(f"work_limit={_WORK_LIMIT:g}",))
    plan_command.run([scene], folder, overwrite=overwrite, choosing=choosing, **values)


def _is(file: Path, scene: SyntheticScene) -> bool:
    """Whether a file is, to the byte, what the scene is written as."""
    import scenes_synthetic

    with TemporaryDirectory() as aside:
        return (
            file.is_file() and file.read_bytes() == scenes_synthetic.write(scene, Path(aside, file.name)).read_bytes()
        )
