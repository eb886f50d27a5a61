"""`tlsplan simulate`: the clouds that given stations would bring home."""

from __future__ import annotations

from pathlib import Path

import click

from ..options import (
    apply,
    engine_options,
    output_options,
    overwrite_option,
    scanner_option,
    scene_argument,
    scene_options,
    stations_option,
)


@click.command("simulate", epilog="Example:  tlsplan simulate building.ifc --stations plan/plan.json -o scans/ --format ply")
@scene_argument
@stations_option
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), required=True, metavar="FOLDER",
              help="Folder for the scans.")  # fmt: skip
@click.option("--format", "formats", type=click.Choice(["exr", "png", "ply"]), multiple=True, default=("exr", "png", "ply"),
              show_default=True, help="exr: range image; png: preview; ply: point cloud. May be repeated.")  # fmt: skip
@apply(scanner_option, scene_options, engine_options, overwrite_option, output_options)
def command(
    scene: Path,
    stations: Path,
    folder: Path,
    formats: tuple[str, ...],
    scanner: str,
    units: str | None,
    up: str | None,
    skip_bad_faces: bool,
    engine: str,
    device: str | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Simulate the scans of a station list in SCENE: range images and point clouds, one a station."""
    raise NotImplementedError
