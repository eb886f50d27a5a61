"""Layers: one figure a patch, in whole steps: what the browser paints. The form of a plan folder's own layers.

Input figures in metres or degrees, inf where there is none; output uint16 steps, 65535 for none, and for `times_seen`
uint8 as in viewer/patches.u8. The layers and their steps are those of `planner_core.plan_folder.viewer_layers`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Int32Array, UInt8Array
from planner_core.plan_folder.viewer_files import MAX_TIMES_SEEN, NOT_ACHIEVABLE
from planner_core.plan_folder.viewer_layers import Layer

TIMES_SEEN = "times_seen"


def times_seen_bytes(n_met: Int32Array, achievable: BoolArray) -> UInt8Array:
    """(N,) uint8: how many stations see a patch, at most 254; 255 where no candidate can."""
    return np.where(achievable, np.minimum(n_met, MAX_TIMES_SEEN), NOT_ACHIEVABLE).astype(np.uint8)


def layer_named(name: str, layers: Mapping[str, Layer]) -> Layer | None:
    """Return the layer of that id; None for `times_seen`, which has no figures.

    Raises
    ------
    RequirementError
        The plan has no such layer; those that it has are named.
    """
    if name == TIMES_SEEN:
        return None
    if name not in layers:
        raise RequirementError(f"layer: got {name!r}, expected one of {', '.join((TIMES_SEEN, *layers))}")
    return layers[name]
