"""`tlsplan scene`: write one of the synthetic scenes, to try things on."""

from __future__ import annotations

from pathlib import Path

import click

from ..options import overwrite_option, quiet_option, seed_option

_CAMPUS, _CAMPUS_TRIANGLES = "campus", 1_000_000


@click.command("scene", epilog="Example:  tlsplan scene house -o house.ifc")
@click.argument("name", required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE",
              help="File to write: .ifc, .obj, .ply, .stl, .glb, .usd, .usda or .usdc.")  # fmt: skip
@click.option("--triangles", type=int, metavar="N", default=None,
              help="Number of triangles of the scene campus (ply, obj, glb or usdz only). [1000000]")  # fmt: skip
@click.option("--on-map", is_flag=True,
              help="Georeferenced: with map conversion and CRS (ifc only).")  # fmt: skip
@seed_option
@overwrite_option
@quiet_option
def command(
    name: str | None,
    output: Path | None,
    triangles: int | None,
    on_map: bool,
    seed: int,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Write the synthetic scene NAME to a file; without NAME, list all scenes."""
    import scenes_synthetic
    from planner_core.errors import OutputExistsError, RequirementError

    from .. import output as printer

    known = (*scenes_synthetic.names(), _CAMPUS)
    if name is None and (output is not None or triangles is not None):
        raise click.UsageError("Missing argument 'NAME': which scene? `tlsplan scene` lists them.")
    if name is None:
        for each in known:
            printer.say(each)
        return
    if name not in known:
        raise RequirementError(f"scene {name!r} is not known; expected one of {', '.join(known)}.")
    if triangles is not None and name != _CAMPUS:
        raise RequirementError(f"--triangles: got scene {name!r}, expected {_CAMPUS}; other scenes have one size only.")
    path = output if output is not None else Path(f"{name}{'.ply' if name == _CAMPUS else '.ifc'}")
    if on_map and (name == _CAMPUS or path.suffix.lower() != ".ifc"):
        raise RequirementError(
            f"--on-map: got {path}, expected an .ifc file, the only format with a map conversion; name it .ifc"
        )
    if path.exists() and not overwrite:
        raise OutputExistsError(f"{path} exists; pass --overwrite to replace it.")
    if name == _CAMPUS:
        done = _write_campus(path, _CAMPUS_TRIANGLES if triangles is None else triangles, seed, quiet=quiet)
    else:
        built = scenes_synthetic.build(name, seed=seed)
        done = f"wrote {scenes_synthetic.write(scenes_synthetic.on_map(built) if on_map else built, path)}"
    if not quiet:
        printer.say(done)


def _write_campus(path: Path, n_triangles: int, seed: int, *, quiet: bool) -> str:
    from scenes_synthetic.campus import write_campus

    from ..progress import ProgressReporter

    with ProgressReporter(quiet=quiet) as reporter:
        campus = write_campus(path, n_triangles=n_triangles, seed=seed, progress=reporter.show)
    count = "1 building" if len(campus.buildings) == 1 else f"{len(campus.buildings)} buildings"
    return f"wrote {path}: {count}, {campus.n_triangles} triangles"
