"""The scanner, the beams of one scan, and what comes back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, computed_field

from planner_core.documents import Number, Whole, YesNo, document
from planner_core.model.arrays import Float32Array, FloatArray, Int32Array, Int64Array
from planner_core.model.choices import PreAlignment
from planner_core.model.values import PreAlignmentWord

ENTRIES_A_PIECE = 1_000_000
"""Entries of rows that are treated together where they are many."""


_Sector = Annotated[
    tuple[Number, Number] | None,
    BeforeValidator(lambda value: value or None),
    PlainSerializer(lambda value: value or ()),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "maxItems": 2}),
    Field(json_schema_extra={"default": []}),
]


@document
@dataclass(frozen=True, kw_only=True)
class Scanner:
    """A scanner's specification, in the instrument's own frame. Channels are the rows of a scan, azimuths its columns.

    Figures that are None are not known.
    """

    name: str
    mode: str = ""
    """Which of its resolutions this is: a mode's id, or a point spacing at 10 m such as `6mm`; empty: it has one."""
    title: str
    source: str
    """Where the figures are from."""
    range_min_m: Annotated[Number, Field(ge=0)]
    range_max_m: Annotated[Number, Field(gt=0)]
    n_azimuths: Annotated[Whole, Field(ge=1)]
    elevation_rad: Annotated[tuple[Number, ...], Field(min_length=1)]
    """One angle a channel, up from the horizontal, highest first."""
    azimuth_range_rad: _Sector = None
    """First and last of `n_azimuths` even azimuths of a sector, both included, counter-clockwise from +x; empty: a full
    turn from 0."""
    azimuth_offset_rad: tuple[Number, ...] = ()
    """One angle a channel, added to its azimuths; empty: none."""
    inverted: YesNo = False
    """Hangs upside down: turned by 180 degrees about its x axis."""
    instrument_height_min_m: Number
    instrument_height_max_m: Number
    instrument_height_usual_m: Number | None = None
    """What a crew sets its tripod to; None: any height of the range is as good."""
    seconds_per_scan: Number | None = None
    """Of a whole scan in this mode."""
    range_noise: tuple[tuple[Number, Number, Number], ...] = ()
    """Rows (range in metres, reflectivity in 0..1, one sigma in metres), by reflectivity, then range."""
    ranging_accuracy: tuple[Number, Number] | None = None
    """(a, b): a range r is accurate to a + b r metres, as the maker states it."""
    angular_accuracy_rad: Number | None = None
    """Of either angle, as the maker states it."""
    beam_divergence_rad: Number | None = None
    """Full angle, by the definition of a beam's width that `beam_width_at` names."""
    beam_diameter_m: Number | None = None
    """At the exit, by the same definition."""
    beam_width_at: str = ""
    """`1/e`, `1/e2`, `FWHM`, or empty: not given."""
    wavelength_m: Number | None = None
    dual_axis_compensator: YesNo | None = None
    pre_alignment: PreAlignmentWord = PreAlignment.MANUAL
    """How well a scan's pose is known before it is registered."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def n_channels(self) -> int:
        """Number of rows of a scan."""
        return len(self.elevation_rad)

    @property
    def n_beams(self) -> int:
        """Number of beams of a scan."""
        return self.n_channels * self.n_azimuths


@dataclass(frozen=True)
class BeamTemplate:
    """All beams of one scan from the sensor's origin, as the scene sees them: also those of an inverted instrument.

    Beam (row, column): e = elevation_rad[row], a = azimuth_rad[column] + azimuth_offset_rad[row],
    direction = (cos e cos a, cos e sin a, sin e). Float64; engines round to float32 from the SAME float64 values.

    azimuth_rad : (C,) even steps, rising. elevation_rad : (R,), never rising. azimuth_offset_rad : (R,) or None: zero.
    """

    azimuth_rad: FloatArray
    elevation_rad: FloatArray
    range_min_m: float
    range_max_m: float
    azimuth_offset_rad: FloatArray | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns) of a scan."""
        return (int(self.elevation_rad.size), int(self.azimuth_rad.size))


@dataclass(frozen=True)
class RayHits:
    """First hits of N free rays. range_m : (N,) float32, NaN on a miss. triangle : (N,) int32, -1 on a miss."""

    range_m: Float32Array
    triangle: Int32Array


@dataclass(frozen=True)
class ScanBatch:
    """First returns of S scans, rows x columns each.

    range_m : (S, R, C) float32, NaN on a miss. triangle, patch : (S, R, C) int32, -1 on a miss. A beam that hits
    nothing but the rounding margin beside a triangle's edge, about 1 in 100 000, has range and triangle but no patch.
    cos_incidence : (S, R, C) float32 in [0, 1], |normal . beam|, NaN on a miss.
    """

    range_m: Float32Array
    triangle: Int32Array
    patch: Int32Array
    cos_incidence: Float32Array


@dataclass(frozen=True)
class Visibility:
    """Which patches each of N positions sees, as compressed sparse rows.

    starts : (N + 1,) int64. patch : (starts[-1],) int32, sorted and unique inside each row.
    """

    starts: Int64Array
    patch: Int32Array
    n_patches: int

    @property
    def n_positions(self) -> int:
        """Number of rows."""
        return int(self.starts.size - 1)

    def row(self, position: int) -> Int32Array:
        """Sorted patch ids that `position` sees."""
        return self.entries(int(self.starts[position]), int(self.starts[position + 1]))

    def turned(self) -> Visibility:
        """The same entries the other way round: a row of positions for each patch."""
        order = np.argsort(self.patch, kind="stable")
        position = np.repeat(np.arange(self.n_positions, dtype=np.int32), np.diff(self.starts))[order]
        starts = np.concatenate([[0], np.cumsum(np.bincount(self.patch, minlength=self.n_patches))])
        return Visibility(starts.astype(np.int64), position, self.n_positions)

    @property
    def n_entries(self) -> int:
        """Number of patches of all rows together."""
        return int(self.starts[-1])

    def entries(self, first: int, end: int) -> Int32Array:
        """Patches of some entries: `patch[first:end]`."""
        return self.patch[first:end]

    def pieces(self) -> Iterator[tuple[int, Int32Array]]:
        """All entries in pieces, each with the number of its first: temporaries stay small, and a file is streamed."""
        for first in range(0, self.n_entries, ENTRIES_A_PIECE):
            yield first, self.entries(first, min(first + ENTRIES_A_PIECE, self.n_entries))

    def positions_of(self, first: int, n: int) -> Int64Array:
        """(n,) positions whose entries these are, from `first` on."""
        low, high = np.searchsorted(self.starts, [first, first + n - 1], side="right") - 1
        bounds = np.clip(self.starts[low : high + 2], first, first + n)
        size = bounds[1:] - bounds[:-1]
        return np.repeat(np.arange(low, high + 1, dtype=np.int64), size)

    def n_seers(self) -> Int64Array:
        """(P,) number of positions that see each patch."""
        total = np.zeros(self.n_patches, dtype=np.int64)
        for _, patch in self.pieces():
            np.add.at(total, patch, 1)
        return total


@dataclass(frozen=True)
class ReturnMoments:
    """Sums over the returns on each of M patches: what F2 and point spacing are computed from, docs/method/returns.md.

    A return i lies at p_i metres from the first vertex of its patch (`patch_triangles(...)[patch, 0]`, of vertices
    rounded to float32), in the local frame's directions; its weight is w_i = 2 - cos_incidence_i.

    point_sum_m : (M, 3), sum of p_i. square_sum_m2 : (M,), sum of |p_i|^2. weight_sum : (M,), sum of w_i.
    weighted_point_sum_m : (M, 3), sum of w_i p_i. weighted_square_sum_m2 : (M,), sum of w_i |p_i|^2.
    range_sum_m : (M,). All float64. least_range_m, greatest_cos_incidence : (M,) float32.
    """

    point_sum_m: FloatArray
    square_sum_m2: FloatArray
    weight_sum: FloatArray
    weighted_point_sum_m: FloatArray
    weighted_square_sum_m2: FloatArray
    range_sum_m: FloatArray
    least_range_m: Float32Array
    greatest_cos_incidence: Float32Array


@dataclass(frozen=True)
class PatchReturns:
    """How many returns of each of N positions lie on which patches: the rows of `Visibility`, with numbers.

    starts, patch : as in `Visibility`. n_returns : (starts[-1],) int32, at least 1. moments : of the same length, or
    None where they were not requested.
    """

    starts: Int64Array
    patch: Int32Array
    n_returns: Int32Array
    moments: ReturnMoments | None
    n_patches: int

    @property
    def visibility(self) -> Visibility:
        """The patches alone; shares the arrays."""
        return Visibility(starts=self.starts, patch=self.patch, n_patches=self.n_patches)

    @property
    def mean_range_m(self) -> FloatArray:
        """(starts[-1],) float64, mean range of the returns on each patch; needs moments."""
        if self.moments is None:
            raise ValueError("mean range: got returns without moments, expected them; ask for `moments=True`")
        return self.moments.range_sum_m / self.n_returns

    def row(self, position: int) -> slice:
        """Where the entries of `position` lie in all the arrays."""
        return slice(int(self.starts[position]), int(self.starts[position + 1]))
