"""What viewers paint on patches besides coverage: figures by patch, what each station sees, reasons, the achievable.

Plan, ScanEngine -> files of `viewer/`; docs/formats/stage.md holds their layout. The stations are observed from
once more, as their candidates were when the plan was made: by beams or by samples of patches.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.coverage.observations import Observations, observations_in_batches, observations_meeting
from planner_core.documents import to_document
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    REASONS,
    BeamTemplate,
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Loss,
    Plan,
    PlanRooms,
    PointLimits,
    Scanner,
)
from planner_core.model.unseen import OUT_OF_SCOPE
from planner_core.plan_folder.usd_names import station_prim_names

# -------------------------------------------------------------------------------------------------------- viewer files
# The browser's binary files: clouds as quantised range images (.cloud) and the plan's patches (.u8).
# Layouts: docs/formats/stage.md. The browser rebuilds a point from the station, the beam template and the range.

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


def packed_cloud(range_m: Float32Array, cos_incidence: Float32Array, template: BeamTemplate) -> bytes:
    """`cloud_bytes` in a twelfth of the space: each value less the one before it in its row, deflated (RFC 1950).

    Without noise neighbours hardly differ. Arguments are those of `cloud_bytes`.
    """
    content = cloud_bytes(range_m, cos_incidence, template)
    n_rows, n_columns = template.shape
    n_ranges = 2 * n_rows * n_columns
    values = np.frombuffer(content, "<u2", n_rows * n_columns), np.frombuffer(content, np.uint8, offset=n_ranges)
    differences = (np.diff(each.reshape(template.shape), axis=1, prepend=each.dtype.type(0)) for each in values)
    return zlib.compress(b"".join(each.tobytes() for each in differences))


def patches_bytes(times_seen: Int32Array, achievable: BoolArray) -> bytes:
    """One byte a patch: number of stations that see it, at most 254; 255 where no candidate can."""
    counted = np.minimum(times_seen, MAX_TIMES_SEEN)
    return np.where(achievable, counted, NOT_ACHIEVABLE).astype(np.uint8).tobytes()


# ------------------------------------------------------------------------------------------------------- viewer layers
SCHEMA = "tlsplan/layers/1"
UInt16Array = NDArray[np.uint16]
_MOST_STEPS = NONE - 1
#: Below `viewer/`.
_PIECES = "pieces.i32"
_ROOMS = "rooms.u16"
#: Steps are 1, 2 or 5 times a power of ten.
_ROUND = (1, 2, 5, 10)


@dataclass(frozen=True)
class Layer:
    """A figure by patch, held as a whole number of steps."""

    id: str
    title: str
    unit: str
    step: float

    @property
    def file(self) -> str:
        """Name of the file below `viewer/`."""
        return f"layers/{self.id}.u16"

    def quantised(self, figures: FloatArray) -> UInt16Array:
        """Steps (P,) of figures (P,) in the layer's unit, at most 65534; `NONE` where they are not finite."""
        known = np.isfinite(figures)
        steps = np.minimum(np.rint(np.where(known, figures, 0.0) / self.step), _MOST_STEPS)
        return np.where(known, steps, NONE).astype(np.uint16)


def layers_of(scanner: Scanner) -> tuple[Layer, ...]:
    """Layers that a plan with this scanner has: noise only where the scanner's figures know it.

    Steps follow from the scanner alone, so that what is computed while somebody moves a station has the same.
    """
    layers = (
        Layer("range", "Best range", "m", _round_step(scanner.range_max_m)),
        Layer("incidence", "Best incidence", "deg", 0.002),
        Layer("spacing", "Point spacing of all stations", "m", 0.00005),
    )
    if not scanner.range_noise:
        return layers
    most_m = max(sigma_m for _, _, sigma_m in scanner.range_noise)
    return (*layers, Layer("noise", "Least range noise (one sigma)", "m", _round_step(most_m)))


def _round_step(most: float) -> float:
    """The least round step of which 65534 reach `most`."""
    power = np.floor(np.log10(most / _MOST_STEPS))
    return next(step for step in (float(f"{n}e{power:.0f}") for n in _ROUND) if step * _MOST_STEPS >= most)


class LayerFigures:
    """The figures of layers, station by station: the least of each, and for spacing that of all points together.

    Densities 1 / spacing^2 add; they are added in the order of the stations, so that the same stations give the same
    last bit.
    """

    def __init__(self, layers: tuple[Layer, ...], n_patches: int) -> None:
        self._least = {layer.id: np.full(n_patches, np.inf) for layer in layers if layer.id != "spacing"}
        self._density = np.zeros(n_patches)
        self._seen = np.zeros(n_patches, dtype=np.bool_)

    def add(self, observations: Observations) -> None:
        """Add what ONE station sees; noise of observations that do not know it stays unknown."""
        patch = observations.patch
        self._seen[patch] = True
        with np.errstate(divide="ignore"):
            self._density[patch] += observations.spacing_m.astype(np.float64) ** -2.0
        for layer, least in self._least.items():
            figures = _figures(observations, layer)
            if figures is not None:
                least[patch] = np.fmin(least[patch], figures)

    def of(self, layer: Layer) -> FloatArray:
        """(P,) float64 in the layer's unit; inf where no station sees the patch, or the figure is not known."""
        if layer.id != "spacing":
            return self._least[layer.id]
        with np.errstate(divide="ignore"):
            spacing_m = self._density**-0.5
        # Seen, but along the surface: as wide as the layer can tell.
        return np.where(self._seen, np.minimum(spacing_m, layer.step * _MOST_STEPS), np.inf)


def _figures(observations: Observations, layer: str) -> FloatArray | None:
    if layer == "range":
        return observations.range_m.astype(np.float64)
    if layer == "incidence":
        return np.degrees(observations.incidence_rad.astype(np.float64))
    return None if observations.noise_m is None else observations.noise_m.astype(np.float64)


def seen_bytes(seen: Int32Array, met: Int32Array, n_patches: int) -> bytes:
    """One bit a patch, the first in the lowest bit of the first byte: 1 for those of `seen`, then anew for those of
    `met`, on which the station meets what is required of all; once where `met` is `seen`, as without limits.
    """
    rows = (seen,) if met is seen else (seen, met)
    bits = np.zeros((len(rows), n_patches), dtype=np.bool_)
    for row, patch in zip(bits, rows, strict=True):
        row[patch] = True
    return np.packbits(bits, axis=1, bitorder="little").tobytes()


def lost_bytes(losses: Sequence[Loss]) -> bytes:
    """What requirements would lose without a station: uint32 number of patches of each, then the patches of each."""
    sizes = np.array([loss.patch.size for loss in losses], dtype="<u4")
    return sizes.tobytes() + b"".join(loss.patch.astype("<u4").tobytes() for loss in losses)


def layer_file_names(plan: Plan) -> tuple[str, ...]:
    """Names of all that `layer_files` makes, below the plan folder."""
    return (
        *(f"viewer/seen/{name}.bits" for name in station_prim_names(plan.stations)),
        *_lost_by_station(plan),
        *(f"viewer/{layer.file}" for layer in layers_of(plan.settings.scanner)),
        *(f"viewer/{name}" for name in _by_patch(plan)),
        "viewer/layers.json",
    )


def layer_files(plan: Plan, engine: ScanEngine, figures: LayerFigures | None = None) -> Iterator[tuple[str, bytes]]:
    """Names and contents, in the order of `layer_file_names`; one station's observations are held at a time, or a few.

    `figures`, of all layers of the plan and empty, takes them all for the caller.

    Raises
    ------
    RequirementError, DeviceError
        See `planner_core.coverage.observations.observations_in_batches`.
    """
    layers, n_patches = layers_of(plan.settings.scanner), plan.survey.patches.n_patches
    figures = figures or LayerFigures(layers, n_patches)
    names, limits = iter(station_prim_names(plan.stations)), plan.settings.requirements.limits
    for observations in _observations_of_stations(plan, engine):
        figures.add(observations)
        seen = observations.patch
        met = seen if limits == PointLimits() else seen[observations_meeting(observations, limits)]
        yield f"viewer/seen/{next(names)}.bits", seen_bytes(seen, met, n_patches)
    yield from _lost_by_station(plan).items()
    for layer in layers:
        yield f"viewer/{layer.file}", layer.quantised(figures.of(layer)).astype("<u2").tobytes()
    for name, content in _by_patch(plan).items():
        yield f"viewer/{name}", content
    yield "viewer/layers.json", (json.dumps(_document(plan), indent=2, ensure_ascii=False) + "\n").encode()


def _observations_of_stations(plan: Plan, engine: ScanEngine) -> Iterator[Observations]:
    """One station after the other."""
    positions_m = np.array([station.position_m for station in plan.stations]).reshape(-1, 3)
    noise = bool(plan.survey.scanner.range_noise)
    for batch in observations_in_batches(plan.survey, engine, positions_m, noise=noise):
        for first, end in pairwise(batch.starts.tolist()):
            part = slice(first, end)
            yield Observations(
                starts=np.array([0, end - first], dtype=np.int64),
                patch=batch.patch[part],
                n_patches=batch.n_patches,
                spacing_m=batch.spacing_m[part],
                range_m=batch.range_m[part],
                incidence_rad=batch.incidence_rad[part],
                noise_m=None if batch.noise_m is None else batch.noise_m[part],
            )


def _lost_by_station(plan: Plan) -> dict[str, bytes]:
    """Names and contents; none where nobody worked it out."""
    names = station_prim_names(plan.stations)
    return {f"viewer/lost/{name}.u32": lost_bytes(losses) for name, losses in zip(names, plan.losses, strict=False)}


def _by_patch(plan: Plan) -> dict[str, bytes]:
    """Names and contents of what the plan knows by patch itself, without what was not computed."""
    files = {}
    if plan.why is not None:
        files["reason.u8"] = plan.why.reason_of_patch.tobytes()
        if plan.why.piece_of_patch is not None:
            files[_PIECES] = plan.why.piece_of_patch.astype("<i4").tobytes()
    if plan.rooms is not None:
        files[_ROOMS] = (plan.rooms.room_of_patch & NONE).astype("<u2").tobytes()
    if plan.times_met is not None:
        files["achievable.u8"] = plan.times_met.tobytes()
    if plan.survey.patches.countable_share is not None:
        files["counted.u8"] = plan.survey.patches.countable_share.tobytes()
    return files


def _document(plan: Plan) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "n_patches": plan.survey.patches.n_patches,
        "layers": [
            {
                "id": layer.id,
                "title": layer.title,
                "unit": layer.unit,
                "step": layer.step,
                "none": NONE,
                "file": layer.file,
                "better": "low",
            }
            for layer in layers_of(plan.settings.scanner)
        ],
        "reasons": [] if plan.why is None else list(REASONS),
        "out_of_scope": OUT_OF_SCOPE,
        "counted": None if plan.survey.patches.countable_share is None else "counted.u8",
        "pieces": None if plan.why is None or plan.why.piece_of_patch is None else _PIECES,
        "rooms": None if plan.rooms is None else _rooms_document(plan.rooms),
        "qualities": [to_document(limits) for limits in plan.qualities],
    }


def _rooms_document(rooms: PlanRooms) -> dict[str, Any]:
    """Rooms by their number in the file; local frame, to the millimetre."""
    return {
        "file": _ROOMS,
        "none": NONE,
        "list": [
            {
                "name": room.name,
                "source_id": room.source_id,
                "floor": room.floor,
                "label": np.round(room.label_m, 3).tolist(),
                "box": np.round(room.box_m, 3).tolist(),
            }
            for room in rooms.rooms
        ],
    }
