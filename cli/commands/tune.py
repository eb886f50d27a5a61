"""`tlsplan tune`: measure which OpenCL device is fastest, and which shape of beam tiles suits it; keep the answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from ..options import device_option, json_option, quiet_option

if TYPE_CHECKING:
    from pathlib import Path

    from planner_core.device import Device
    from planner_core.engine.tuning import ShapeTimes
    from planner_core.model import FloatArray
    from scenes_synthetic.model import SyntheticScene

    from ..progress import ProgressReporter

INSTRUMENT_HEIGHT_M = 1.5
"""In the middle of every room."""


@click.command("tune", epilog="Example:  tlsplan tune   or   tlsplan tune --device nvidia")
@device_option
@click.option("--quick", is_flag=True, help="First three shapes only: seconds instead of a minute per device.")
@json_option
@quiet_option
def command(device: str | None, quick: bool, as_json: bool, quiet: bool) -> None:
    """Find the fastest OpenCL device and tile shape for scans, and save them for later runs.

    Beams are cast in tiles and packets; their best shape differs from device to device. Scans of a synthetic house are
    timed in each shape on every device that works, or on the one that --device names, which takes a minute or so each,
    most of it compiling. Without --device the fastest one becomes the default. Results of scans and plans do not depend
    on the shape. After an update of the driver or of tlsplan, run it again; until then the shipped shape is used.
    """
    from planner_core.cache import CACHE_VARIABLE, check_keeps
    from planner_core.device import keep_fastest, list_devices, open_device, problem_of_device
    from planner_core.errors import RequirementError

    from .. import environment, output
    from ..progress import ProgressReporter

    environment.check_caches_are_kept(CACHE_VARIABLE)
    check_keeps()
    infos = list_devices()
    problems = [problem_of_device(info) for info in infos] if device is None else []
    names = [str(index) for index, why in enumerate(problems) if not why] if device is None else [device]
    if not names:
        open_device()  # its error has the reason and the remedy
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        tuned = {name: _tune(open_device(name), quick, reporter) for name in names}
    fastest = min(tuned, key=lambda name: tuned[name].least_ms)
    if device is None:
        try:
            keep_fastest(infos, int(fastest))
        except OSError as error:
            raise RequirementError(
                f"cache folder: can't be written ({error.strerror}), expected a writable one for the fastest device; "
                f"set {CACHE_VARIABLE} to one"
            ) from error
    if as_json:
        output.as_json({"fastest": tuned[fastest].label, "devices": [each.document() for each in tuned.values()]})
        return
    if quiet:
        return
    for each in tuned.values():
        each.show()
    for info, why in zip(infos, problems, strict=False):
        if why:
            output.say(f"{info.name} ({info.platform}) was left out: {why}")
    if device is None:
        output.say(f"default from now on: {tuned[fastest].label}")


@dataclass(frozen=True)
class _Tuned:
    """Shapes measured on one device."""

    label: str
    best: tuple[int, int, int]
    times: ShapeTimes
    file: Path

    @property
    def least_ms(self) -> float:
        return self.times.milliseconds[self.best]

    def document(self) -> dict[str, object]:
        rows, columns, lanes = self.best
        return {
            "device": self.label,
            "tile_rows": rows,
            "tile_columns": columns,
            "lanes": lanes,
            "milliseconds": {name_of(shape): round(ms, 4) for shape, ms in self.times.milliseconds.items()},
            "refused": {name_of(shape): why for shape, why in self.times.refused.items()},
            "file": str(self.file),
        }

    def show(self) -> None:
        from .. import output

        times = sorted(self.times.milliseconds.items(), key=lambda row: row[1])
        output.table(("tile and packet", "ms per scan"), [(name_of(shape), f"{ms:.2f}") for shape, ms in times])
        for shape, why in self.times.refused.items():
            output.say(f"{name_of(shape)} does not run here: {why}")
        output.say()
        output.say(f"{self.label}: {name_of(self.best)} from now on, saved in {self.file}")
        output.say()


def _tune(opened: Device, quick: bool, reporter: ProgressReporter) -> _Tuned:
    from dataclasses import replace

    import numpy as np

    from planner_core.engine import tuning
    from planner_core.engine.opencl import OpenCLEngine
    from planner_core.engine.tuning import measure_shapes
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scanner.template import make_template
    from planner_core.scene.patches import make_patches
    from scenes_synthetic import build

    house = build("house")
    engine = OpenCLEngine(house.scene, make_patches(house.scene, max_area_m2=0.04), opened)
    template = replace(make_template(load_scanner("hdl-64e")), range_max_m=np.inf)
    shapes = tuning.shapes_to_try(opened)[: 3 if quick else None]
    times = measure_shapes(engine, template, _middles(house), shapes, progress=reporter.show)
    best = times.best()
    named = {name_of(shape): ms for shape, ms in times.milliseconds.items()}
    return _Tuned(opened.label, best, times, tuning.keep_shape(opened, best, named))


def name_of(shape: tuple[int, int, int]) -> str:
    """Return a shape in words, as `doctor` shows it too."""
    rows, columns, lanes = shape
    return f"{rows} x {columns} beams, packets of {lanes}"


def _middles(house: SyntheticScene) -> FloatArray:
    """One position a room, (R, 3), local frame: the middle of its outline."""
    import numpy as np

    middles = [(*np.mean(room.outline_m, axis=0), room.floor_m + INSTRUMENT_HEIGHT_M) for room in house.rooms]
    return np.array(middles, dtype=np.float64)
