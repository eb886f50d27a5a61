"""Layers: one figure a patch, in whole steps: what the browser paints. The form of a plan folder's own layers.

Input figures in metres or degrees, inf where there is none; output uint16 steps, 65535 for none, and for `times_seen`
uint8 as in viewer/patches.u8. docs/formats/stage.md.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner_core.errors import PlanFolderError, RequirementError
from planner_core.export.viewer_files import MAX_TIMES_SEEN, NOT_ACHIEVABLE
from planner_core.model import BoolArray, FloatArray, Int32Array, UInt8Array

UInt16Array = NDArray[np.uint16]

TIMES_SEEN = "times_seen"
NONE = 65535
"""Of a layer: seen by no station, or not known."""


def steps_of(plan_folder: Path) -> dict[str, float]:
    """Read what one step of each layer of a plan folder is, in the layer's unit; none where it has no layers.

    Raises
    ------
    PlanFolderError
        Their list can't be read.
    """
    path = plan_folder / "viewer" / "layers.json"
    if not path.is_file():
        return {}
    try:
        layers = json.loads(path.read_text(encoding="utf-8"))["layers"]
        steps = {str(layer["id"]): float(layer["step"]) for layer in layers}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise PlanFolderError(f"{path}: can't be read ({error!r}), expected the list of layers; plan again") from error
    if not all(math.isfinite(step) and step > 0 for step in steps.values()):
        raise PlanFolderError(f"{path}: got a step that is none, expected more than 0; plan again")
    return steps


def in_steps(figures: FloatArray, step: float) -> UInt16Array:
    """(N,) uint16: figures over the step, rounded; the largest step where they are more."""
    known = np.isfinite(figures)
    steps = np.rint(np.where(known, figures, 0.0) / step)
    return np.where(known, np.clip(steps, 0, NONE - 1), NONE).astype(np.uint16)


def times_seen_bytes(n_met: Int32Array, achievable: BoolArray) -> UInt8Array:
    """(N,) uint8: how many stations see a patch, at most 254; 255 where no candidate can."""
    return np.where(achievable, np.minimum(n_met, MAX_TIMES_SEEN), NOT_ACHIEVABLE).astype(np.uint8)


def check_layer(layer: str, steps: Mapping[str, float]) -> None:
    """Refuse layers that the plan does not have.

    Raises
    ------
    RequirementError
        Naming those that it has.
    """
    if layer != TIMES_SEEN and layer not in steps:
        raise RequirementError(f"layer: got {layer!r}, expected one of {', '.join((TIMES_SEEN, *steps))}")
