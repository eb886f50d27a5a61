"""`tlsplan scene`: write one of the synthetic scenes, to try things on."""

from __future__ import annotations

from pathlib import Path

import click

from ..options import overwrite_option, seed_option


@click.command("scene", epilog="Example:  tlsplan scene house -o house.ifc")
@click.argument("name", required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE",
              help="File to write; its ending chooses among ifc, obj, ply, stl, glb, usd, usda, usdc.")  # fmt: skip
@seed_option
@overwrite_option
def command(name: str | None, output: Path | None, seed: int, overwrite: bool) -> None:
    """Write the synthetic scene NAME to a file; without NAME, list the scenes there are."""
    import scenes_synthetic
    from planner_core.errors import OutputExistsError, RequirementError

    from .. import output as printer

    if name is None:
        for known in scenes_synthetic.names():
            printer.say(known)
        return
    if name not in scenes_synthetic.names():
        raise RequirementError(f"scene {name!r} is not known; expected one of {', '.join(scenes_synthetic.names())}.")
    path = output if output is not None else Path(f"{name}.ifc")
    if path.exists() and not overwrite:
        raise OutputExistsError(f"{path} exists; pass --overwrite to replace it.")
    synthetic = scenes_synthetic.build(name, seed=seed)
    scenes_synthetic.write(synthetic, path)
    printer.say(f"wrote {path}")
