"""The browser's binary files: clouds as quantised range images (.u16) and the plan's patches (.u8).

Layouts: docs/formats/stage.md. The browser rebuilds a point from the station, the beam template and the range.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import (
    BeamTemplate,
    BoolArray,
    Float32Array,
    Int32Array,
)

MAX_TIMES_SEEN = 254
NOT_ACHIEVABLE = 255
#: In a layer: no station sees the patch, or the figure is not known.
NONE = 65535
_STEPS = 65535


def range_step_m(template: BeamTemplate) -> float:
    """Metres of one step of a quantised range: the scanner's range over 65535."""
    return template.range_max_m / _STEPS


def cloud_bytes(range_m: Float32Array, cos_incidence: Float32Array, template: BeamTemplate) -> bytes:
    """Pack one scan: rows x columns uint16 range, then rows x columns uint8 intensity.

    range_m, cos_incidence : (R, C) float32, NaN on a miss. A return is never written as 0, which means no return.
    """
    hit = np.isfinite(range_m)
    steps = np.rint(np.where(hit, range_m, 0).astype(np.float64) / range_step_m(template))
    quantised = np.where(hit, np.clip(steps, 1, _STEPS), 0).astype("<u2")
    intensity = np.rint(255 * np.abs(np.where(hit, cos_incidence, 0))).astype(np.uint8)
    return bytes(quantised.tobytes() + intensity.tobytes())


def patches_bytes(times_seen: Int32Array, achievable: BoolArray) -> bytes:
    """One byte a patch: number of stations that see it, at most 254; 255 where no candidate can."""
    counted = np.minimum(times_seen, MAX_TIMES_SEEN)
    return np.where(achievable, counted, NOT_ACHIEVABLE).astype(np.uint8).tobytes()
