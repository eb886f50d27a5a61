"""How long scans take in each shape of tiles and packets, on one device: what `tlsplan tune` chooses by.

Input an engine on the device, beams and positions (local frame, metres); output milliseconds a position by shape.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.engine.tuning import Shape, use_shape
from planner_core.errors import DeviceError
from planner_core.model import BeamTemplate, FloatArray
from planner_core.progress import Progress, ProgressEvent, silent

#: Another shape has to be faster by this to take the place of the first one: less is noise, and a plain answer is
#: worth more than a percent.
_WORTH_A_CHANGE = 0.97


@dataclass(frozen=True)
class ShapeTimes:
    """Milliseconds a position of `visible_patches`, the least of all rounds; shapes that did not build, with why."""

    milliseconds: dict[Shape, float]
    refused: dict[Shape, str]

    def best(self) -> Shape:
        """Return the fastest shape; the first one measured where no other is clearly faster."""
        first = next(iter(self.milliseconds))
        fastest = min(self.milliseconds, key=lambda shape: self.milliseconds[shape])
        clearly = self.milliseconds[fastest] < _WORTH_A_CHANGE * self.milliseconds[first]
        return fastest if clearly else first


def measure_shapes(
    engine: ScanEngine,
    template: BeamTemplate,
    positions_m: FloatArray,
    shapes: Sequence[Shape],
    *,
    n_rounds: int = 5,
    clock: Callable[[], float] = time.perf_counter,
    progress: Progress = silent,
) -> ShapeTimes:
    """Time `visible_patches`, which is what planning spends its scans on, in every shape.

    Shapes take turns, so that whatever else the machine does meanwhile hits all of them; the least time of a shape is
    the one that was disturbed least. Programs are built and tiles made before the clock starts.

    Parameters
    ----------
    positions_m
        (S, 3), scanned together.
    clock
        Seconds that only go forward; wall time, or processor time on a busy machine.

    Raises
    ------
    DeviceError
        No shape builds.
    """
    least: dict[Shape, float] = {}
    refused: dict[Shape, str] = {}
    for round_ in range(n_rounds):
        for index, shape in enumerate(shapes):
            if shape in refused:
                continue
            with use_shape(shape):
                try:
                    engine.visible_patches(template, positions_m[:1])
                    started_s = clock()
                    engine.visible_patches(template, positions_m)
                    elapsed_s = clock() - started_s
                except DeviceError as error:
                    refused[shape] = str(error)
                    continue
            least[shape] = min(least.get(shape, np.inf), 1e3 * elapsed_s / positions_m.shape[0])
            progress(ProgressEvent("tune", round_ * len(shapes) + index + 1, n_rounds * len(shapes), str(shape)))
    if not least:
        raise DeviceError(
            f"tuning: none of {len(shapes)} tile shapes runs on {engine.device}, expected at least one: "
            f"{next(iter(refused.values()), 'none was given')}"
        )
    return ShapeTimes({shape: ms for shape, ms in least.items() if shape not in refused}, refused)
