"""`tlsplan tune`: measure which shape of beam tiles suits an OpenCL device, and keep the answer for this user."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..options import device_option, json_option, quiet_option

if TYPE_CHECKING:
    from planner_core.model import FloatArray
    from scenes_synthetic.model import SyntheticScene

INSTRUMENT_HEIGHT_M = 1.5
"""In the middle of every room."""


@click.command("tune", epilog="Example:  tlsplan tune --device nvidia")
@device_option
@click.option("--quick", is_flag=True, help="Try the first three shapes only: seconds instead of a minute.")
@json_option
@quiet_option
def command(device: str | None, quick: bool, as_json: bool, quiet: bool) -> None:
    """Measure which shape of beam tiles scans fastest on a device, and keep it for all later runs.

    Beams are cast in tiles and packets; their best shape differs from device to device. Scans of a synthetic house are
    timed in each shape, which takes a minute or so, most of it compiling. Results of scans and plans do not depend
    on the shape. A new driver or version of tlsplan asks for measuring anew; until then the shipped shape is used.
    """
    from dataclasses import replace

    import numpy as np

    from planner_core.device import open_device
    from planner_core.scan import tuning
    from planner_core.scan.measure_shapes import measure_shapes
    from planner_core.scan.opencl import OpenCLEngine
    from planner_core.scan.scanners import load_scanner
    from planner_core.scan.template import make_template
    from planner_core.scene.patches import make_patches
    from scenes_synthetic import build

    from .. import environment, output
    from ..progress import ProgressReporter

    environment.check_caches_are_kept(tuning.CACHE_VARIABLE)
    opened = open_device(device)
    house = build("house")
    engine = OpenCLEngine(house.scene, make_patches(house.scene, max_area_m2=0.04), opened)
    template = replace(make_template(load_scanner("hdl-64e")), range_max_m=np.inf)
    shapes = tuning.shapes_to_try(opened)[: 3 if quick else None]
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        times = measure_shapes(engine, template, _middles(house), shapes, progress=reporter.show)
    best = times.best()
    named = {name_of(shape): ms for shape, ms in times.milliseconds.items()}
    file = tuning.keep_shape(opened, best, named)
    if as_json:
        output.as_json(
            {
                "device": opened.label,
                "tile_rows": best[0],
                "tile_columns": best[1],
                "lanes": best[2],
                "milliseconds": {name: round(ms, 4) for name, ms in named.items()},
                "refused": {name_of(shape): why for shape, why in times.refused.items()},
                "file": str(file),
            }
        )
        return
    if quiet:
        return
    output.table(
        ("tile and packet", "ms a scan"),
        [(name, f"{ms:.2f}") for name, ms in sorted(named.items(), key=lambda row: row[1])],
    )
    for shape, why in times.refused.items():
        output.say(f"{name_of(shape)} does not run here: {why}")
    output.say()
    output.say(f"{opened.label}: {name_of(best)} from now on, kept in {file}")


def name_of(shape: tuple[int, int, int]) -> str:
    """Return a shape in words, as `doctor` shows it too."""
    rows, columns, lanes = shape
    return f"{rows} x {columns} beams, packets of {lanes}"


def _middles(house: SyntheticScene) -> FloatArray:
    """One position a room, (R, 3), local frame: the middle of its outline."""
    import numpy as np

    middles = [(*np.mean(room.outline_m, axis=0), room.floor_m + INSTRUMENT_HEIGHT_M) for room in house.rooms]
    return np.array(middles, dtype=np.float64)
