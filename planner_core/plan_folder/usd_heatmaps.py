"""The stage's heat maps: a colour a face for each figure, which the variants of `usd_building` choose from.

Plan, and the layers by patch that its folder holds already -> stage/heatmaps.usdc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Plan
from planner_core.plan_folder.face_results import required_faces
from planner_core.plan_folder.palette import (
    NOT_ACHIEVABLE,
    NOT_REQUIRED,
    PATCH_COLOURS_SRGB,
    UNSEEN,
    linear_from_srgb,
    patch_colour_index,
    range_ramp_srgb,
)
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    Sdf,
    int_array,
    new_layer,
    over,
    put,
    put_primvar,
    set_stage_metadata,
    vec3f_array,
)
from planner_core.plan_folder.usd_building import VARIANTS
from planner_core.plan_folder.usd_names import MeshPlace, mesh_places
from planner_core.plan_folder.viewer_files import NONE
from planner_core.plan_folder.viewer_layers import layers_of

_N_STEPS = 16
#: A figure's colours end where so much of its faces is below; the others have the last one.
_SHOWN_SHARE = 0.95


@dataclass(frozen=True, eq=False)
class HeatMap:
    """index : (T,) int32, colour of each face, into `colours` (K, 3), sRGB. high : where the ramp ends, NaN: none."""

    variant: str
    index: Int32Array
    colours: FloatArray
    unit: str = ""
    high: float = math.nan


def heat_maps(plan: Plan, folder: Path) -> tuple[HeatMap, ...]:
    """Make the maps of a plan from the layers in its folder's `viewer/`; of a figure a face has its patches' mean."""
    first = plan.survey.patches.first_patch[:-1]
    achievable = np.logical_or.reduceat(plan.achievable, first)
    required = required_faces(plan)
    times = np.maximum.reduceat(plan.times_seen, first).astype(np.int32)
    maps = [HeatMap("times_seen", patch_colour_index(times, achievable, required), PATCH_COLOURS_SRGB)]
    for layer in layers_of(plan.settings.scanner):
        if layer.id in VARIANTS:
            steps = np.fromfile(folder / "viewer" / layer.file, dtype="<u2")
            mean = _mean(np.where(steps == NONE, np.nan, steps * layer.step), first)
            high = 90.0 if layer.unit == "deg" else _round_end(mean)
            maps.append(
                HeatMap(layer.id, _ramp_index(mean, high, achievable, required), _ramp_colours(), layer.unit, high)
            )
    return tuple(maps)


def _mean(values: FloatArray, first: np.ndarray) -> FloatArray:
    """(T,) mean of each face's patches that have a figure; NaN where none has."""
    known = np.isfinite(values)
    n = np.add.reduceat(known.astype(np.int64), first)
    total = np.add.reduceat(np.where(known, values, 0.0), first)
    return np.where(n > 0, total / np.maximum(n, 1), np.nan)


def _round_end(values: FloatArray) -> float:
    """The end of a ramp: 1, 2 or 5 times a power of ten that `_SHOWN_SHARE` of the values don't exceed."""
    known = values[np.isfinite(values)]
    most = float(np.quantile(known, _SHOWN_SHARE)) if known.size else 1.0
    power = 10.0 ** math.floor(math.log10(max(most, 1e-6)))
    return next(end for end in (power, 2.0 * power, 5.0 * power, 10.0 * power) if end >= most * (1 - 1e-9))


def _ramp_colours() -> FloatArray:
    ramp = range_ramp_srgb()
    return np.vstack([NOT_ACHIEVABLE, UNSEEN, ramp[np.linspace(0, len(ramp) - 1, _N_STEPS).astype(int)], NOT_REQUIRED])


def _ramp_index(values: FloatArray, high: float, achievable: BoolArray, required: BoolArray | None) -> Int32Array:
    known = np.isfinite(values)
    step = np.clip(np.where(known, values, 0.0) / high * _N_STEPS, 0, _N_STEPS - 1).astype(np.int32)
    index = np.where(known, step + 2, np.where(achievable, 1, 0))
    if required is not None:
        index[~required] = _N_STEPS + 2
    return index.astype(np.int32)


def heatmaps_layer(plan: Plan, folder: Path) -> Layer:
    """Return the layer; folder : of the plan, which has `viewer/layers` already."""
    layer, maps = new_layer(), heat_maps(plan, folder)
    with Sdf.ChangeBlock():
        set_stage_metadata(layer, "Plan")
        root = over(layer, "/Plan")
        for each in maps:
            if math.isfinite(each.high):
                put(root, f"tlsplan:{VARIANTS[each.variant]}High", TYPES.Double, each.high)
                put(root, f"tlsplan:{VARIANTS[each.variant]}Unit", TYPES.String, each.unit)
        _author_maps(layer, maps, mesh_places(plan.survey.scene))
    return layer


def _author_maps(layer: Layer, maps: tuple[HeatMap, ...], places: tuple[MeshPlace, ...]) -> None:
    colours = {each.variant: vec3f_array(linear_from_srgb(each.colours)) for each in maps}  # one of each in the file
    for place in places:
        mesh = over(layer, place.path)
        for each in maps:
            name = VARIANTS[each.variant]
            put_primvar(mesh, name, TYPES.Color3fArray, colours[each.variant], "uniform")
            put(mesh, f"primvars:{name}:indices", TYPES.IntArray, int_array(each.index[place.triangles]))
