"""A scanner file as one model: data sheet, beams, modes, range noise. docs/formats/scanner.md explains its keys."""

from __future__ import annotations

import math
from collections import Counter
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from planner_core.documents import Entries, Number, YesNo
from planner_core.errors import RequirementError
from planner_core.scanner.modes import SPACING_DISTANCE_M, ScanMode, spacing_mode

#: A table larger than this is a mistake of units, or finer than a whole turn is ever scanned: it alone would need
#: gigabytes per station.
MAX_BEAMS = 200_000_000
#: Channels, or azimuths of a sector: finer than a ten-thousandth of a degree is a mistake as well.
MAX_ANGLES = 1_000_000
#: A turn that ends this near to where it began has its first beam twice, in degrees.
_TURN_SLACK_DEG = 1e-6
#: Steps that first and last may be apart by more or less than a whole number: decimal fractions of a degree.
_STEP_SLACK = 1e-6
#: A finer step is a mistake; its number of steps need not be finite.
_LEAST = 1e-6
_SEE = "compare docs/formats/scanner.md"

_Text = Annotated[str, Field(pattern=r"\S")]
_Count = Annotated[
    int,
    BeforeValidator(lambda value: int(value) if isinstance(value, float) and value.is_integer() else value),
    Field(strict=True, ge=1),
]
_Elevation = Annotated[Number, Field(ge=-90, le=90)]
_Azimuth = Annotated[Number, Field(ge=-360, le=360)]
_Positive = Annotated[Number, Field(gt=0)]
_Height = Annotated[_Positive, Field(le=100)]  # no mast is longer
_ModeId = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9.+-]{0,39}$")]
_StepDeg = Annotated[Number, Field(gt=_LEAST, le=30)]  # a wall would get a handful of points


def _whole_steps(span_deg: float, step_deg: float) -> int:
    """Return how often `step_deg` fits in `span_deg`: a whole number of times, or it is refused."""
    if span_deg / step_deg >= MAX_ANGLES:
        raise RequirementError(f"got step = {step_deg:g}, expected less than {MAX_ANGLES} steps; {_SEE}")
    steps = span_deg / step_deg
    if abs(steps - round(steps)) > _STEP_SLACK * max(1.0, steps):
        raise RequirementError(
            f"got step = {step_deg:g}, {steps:.6g} times in {span_deg:g} degrees, expected a whole number of steps; "
            "change the step or give a count"
        )
    return round(steps)


class _Even(Entries):
    """Even angles in degrees: the first, the last, and how many or what step."""

    count: Annotated[_Count, Field(le=MAX_ANGLES)] | None = None
    step: _Positive | None = None

    def n_between(self, first: float, last: float) -> int:
        """Return how many angles there are."""
        if (self.count is None) == (self.step is None):
            got = "both count and step" if self.step else "neither count nor step"
            raise RequirementError(f"got {got}, expected one of them; {_SEE}")
        return self.count or 1 + _whole_steps(abs(last - first), self.step or 1.0)


class Elevations(_Even):
    """Even channels, highest first; without count and step the vertical field of modes."""

    model_config = ConfigDict(json_schema_extra={"not": {"required": ["count", "step"]}})

    first: _Elevation
    last: _Elevation

    @model_validator(mode="after")
    def _fall(self) -> Elevations:
        n = 2 if self.is_field else self.n_between(self.first, self.last)
        if (self.first > self.last) != (n > 1):
            raise RequirementError(
                f"got {self.first:g} to {self.last:g}, expected first > last: the highest angle comes first; {_SEE}"
            )
        return self

    @property
    def is_field(self) -> bool:
        """Whether modes say how many channels there are."""
        return self.count is None and self.step is None

    def degrees(self) -> tuple[float, ...]:
        """Return the channels' elevations."""
        return tuple(np.linspace(self.first, self.last, self.n_between(self.first, self.last)).tolist())


class Azimuths(_Even):
    """A sector's even azimuths; without first and last a full turn in steps."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": ["first", "last", "count"], "maxProperties": 3},
                {"required": ["first", "last", "step"], "maxProperties": 3},
                {"required": ["step"], "maxProperties": 1},
            ]
        }
    )

    first: _Azimuth | None = None
    last: _Azimuth | None = None

    @model_validator(mode="after")
    def _less_than_a_turn(self) -> Azimuths:
        n, sector = self.beams()
        if sector is None:
            return self
        first, last = sector
        if not (first <= last and (first < last) == (n > 1)):
            raise RequirementError(
                f"got {first:g} to {last:g}, {n} in all, expected first <= last, and first < last if there is more "
                f"than one; {_SEE}"
            )
        if last - first >= 360 - _TURN_SLACK_DEG:
            raise RequirementError(
                f"got {first:g} to {last:g}: the last beam is the first again, expected less than a turn; for a full "
                'turn give n_azimuths or {"step": ...}'
            )
        return self

    def beams(self) -> tuple[int, tuple[float, float] | None]:
        """Return how many azimuths there are, and the first and the last in degrees; None: a full turn from 0."""
        if self.first is not None and self.last is not None:
            return self.n_between(self.first, self.last), (self.first, self.last)
        if self.step is None or len(self.given()) > 1:
            raise RequirementError(
                f"got {', '.join(sorted(self.given())) or 'nothing'}, "
                f"expected {{first, last, count}}, {{first, last, step}} or {{step}}; {_SEE}"
            )
        return _whole_steps(360.0, self.step), None


class ModeEntry(Entries):
    """A resolution: what an operator picks on the instrument. One of the three ways to tell its steps is needed."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": [*each]}
                for each in (["spacing_at_10m_mm"], ["step_deg"], ["azimuth_step_deg", "elevation_step_deg"])
            ]
        }
    )

    id: _ModeId
    """What --scanner NAME:ID takes."""
    title: _Text
    spacing_at_10m_mm: Annotated[Number, Field(gt=_LEAST, le=5000)] | None = None
    """Distance of neighbouring points 10 m away, the same both ways; an arc."""
    step_deg: _StepDeg | None = None
    """Angle between neighbouring beams, the same both ways."""
    azimuth_step_deg: _StepDeg | None = None
    elevation_step_deg: _StepDeg | None = None
    seconds: Annotated[_Positive, Field(le=86_400)] | None = None
    """Of a whole scan."""

    @model_validator(mode="after")
    def _steps_given_once(self) -> ModeEntry:
        given = sorted(self.given() - {"id", "title", "seconds"})
        if given not in (["spacing_at_10m_mm"], ["step_deg"], ["azimuth_step_deg", "elevation_step_deg"]):
            raise RequirementError(
                f"got {' and '.join(given) or 'no step'}, expected spacing_at_10m_mm, or step_deg, or azimuth_step_deg "
                f"and elevation_step_deg; {_SEE}"
            )
        named = spacing_mode(self.id)
        if named is not None and not math.isclose(named.azimuth_step_rad, self.mode().azimuth_step_rad, rel_tol=1e-9):
            raise RequirementError(
                f"got id {self.id} with another spacing, expected an id that is no spacing, or that spacing; {_SEE}"
            )
        return self

    def mode(self) -> ScanMode:
        """Return it in radians."""
        if self.spacing_at_10m_mm is not None:
            azimuth_rad = elevation_rad = self.spacing_at_10m_mm / 1000.0 / SPACING_DISTANCE_M
        else:
            azimuth_rad = math.radians(self.step_deg or self.azimuth_step_deg or 0.0)
            elevation_rad = math.radians(self.step_deg or self.elevation_step_deg or 0.0)
        return ScanMode(self.id, self.title, azimuth_rad, elevation_rad, self.seconds)


class ChannelMode(Entries):
    """Another table of channels, for a scanner whose channels are listed one by one; all else stays."""

    id: _ModeId
    """What --scanner NAME:ID takes."""
    title: _Text
    elevation_deg: Annotated[tuple[_Elevation, ...], Field(min_length=1)]
    """Channels in degrees, highest first."""

    def mode(self, n_azimuths: int) -> ScanMode:
        """Return it in radians, with so many azimuths in a turn."""
        elevation_rad = tuple(math.radians(angle) for angle in self.elevation_deg)
        return ScanMode(self.id, self.title, 2 * math.pi / n_azimuths, None, elevation_rad=elevation_rad)


class NoiseRow(Entries):
    """A figure of range noise."""

    range_m: Annotated[_Positive, Field(le=100_000)]
    reflectivity: Annotated[_Positive, Field(le=1)]
    sigma_mm: Annotated[_Positive, Field(le=1000)]  # a metre of noise is a mistake of units
    """One sigma."""


class RangingAccuracy(Entries):
    """Millimetres and parts per million of the range, as data sheets write `1.0 mm + 10 ppm`."""

    mm: Annotated[_Positive, Field(le=1000)]
    ppm: Annotated[Number, Field(ge=0, le=10_000)] = 0.0


def _kind(value: Any) -> str:
    return "channels" if isinstance(value, list | tuple) else "even"


_FIELD = {"elevation_deg": {"type": "object", "maxProperties": 2}}
_CHANNELS = {"elevation_deg": {"oneOf": [{"type": "array"}, {"type": "object", "minProperties": 3}]}}


def _one_of(key: str, without: tuple[str, ...], elevation: dict[str, Any]) -> dict[str, Any]:
    return {"required": [key], "not": {"anyOf": [{"required": [each]} for each in without]}, "properties": elevation}


class ScannerFile(Entries):
    """Scanner file of tlsplan. Some rules tie several values together and are beyond a schema (order of channels, whole
    numbers of steps, unique mode ids, the greatest number of beams): reading a file checks these too.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                _one_of("modes", ("n_azimuths", "azimuth_deg", "azimuth_offset_deg", "channel_modes"), _FIELD),
                _one_of("n_azimuths", ("modes", "azimuth_deg", "default_mode"), _CHANNELS),
                _one_of("azimuth_deg", ("modes", "n_azimuths", "default_mode", "channel_modes"), _CHANNELS),
            ]
        }
    )

    name: _Text
    title: _Text
    source: _Text
    """Where the figures are from."""
    range_min_m: Annotated[Number, Field(ge=0)]
    range_max_m: _Positive
    elevation_deg: Annotated[
        Annotated[tuple[_Elevation, ...], Field(min_length=1), Tag("channels")] | Annotated[Elevations, Tag("even")],
        Discriminator(_kind),
    ]
    """Channels in degrees, highest first."""
    n_azimuths: Annotated[_Count, Field(le=MAX_BEAMS)] | None = None
    azimuth_deg: Azimuths | None = None
    azimuth_offset_deg: tuple[Annotated[Number, Field(ge=-180, le=180)], ...] = ()
    mounting: Literal["upright", "inverted"] = "upright"
    instrument_height_min_m: _Height
    instrument_height_max_m: _Height
    instrument_height_usual_m: _Height | None = None
    """What a crew sets its tripod to; left out: any height of the range is as good."""
    modes: Annotated[tuple[ModeEntry, ...], Field(min_length=1, max_length=100)] | None = None
    default_mode: _Text | None = None
    """A mode's id, or a spacing at 10 m such as 6mm. Needed where there is more than one mode."""
    channel_modes: Annotated[tuple[ChannelMode, ...], Field(min_length=1, max_length=100)] = ()
    """Other tables of channels than `elevation_deg`, which is the default; for a full turn of `n_azimuths`."""
    range_noise: Annotated[tuple[NoiseRow, ...], Field(max_length=1000)] = ()
    ranging_accuracy: RangingAccuracy | None = None
    angular_accuracy_arcsec: Annotated[_Positive, Field(le=3600)] | None = None
    beam_divergence_mrad: Annotated[_Positive, Field(le=100)] | None = None
    """Full angle."""
    beam_diameter_mm: Annotated[_Positive, Field(le=1000)] | None = None
    """At the exit."""
    beam_width_at: Literal["1/e", "1/e2", "FWHM"] | None = None
    """Which definition of a beam's width divergence and diameter use."""
    wavelength_nm: Annotated[_Positive, Field(le=100_000)] | None = None
    dual_axis_compensator: YesNo | None = None
    pre_alignment: Literal["tracked", "manual", "level", "none"] = "manual"
    """How well a scan's pose is known before it is registered; tracked: the instrument follows itself."""

    @model_validator(mode="after")
    def _values_agree(self) -> ScannerFile:
        if not self.range_min_m < self.range_max_m:
            got = f"range_min_m = {self.range_min_m:g}, range_max_m = {self.range_max_m:g}"
            raise _refused(got, "range_min_m < range_max_m")
        low, high = self.instrument_height_min_m, self.instrument_height_max_m
        if not low <= high:
            got = f"instrument_height_min_m = {low:g}, instrument_height_max_m = {high:g}"
            raise _refused(got, "instrument_height_min_m <= instrument_height_max_m")
        usual = self.instrument_height_usual_m
        if usual is not None and not low <= usual <= high:
            raise _refused(f"instrument_height_usual_m = {usual:g}", f"one of the scanner's range, {low:g} to {high:g}")
        if self.modes:
            self._check_modes(self.modes)
        else:
            self._check_beams()
        for (range_m, reflectivity), n in Counter((row.range_m, row.reflectivity) for row in self.range_noise).items():
            if n > 1:
                raise _refused(
                    f"range_noise twice at {range_m:g} m and reflectivity {reflectivity:g}", "one figure for each"
                )
        return self

    def _check_modes(self, modes: tuple[ModeEntry, ...]) -> None:
        if given := sorted(self.given() & {"n_azimuths", "azimuth_deg", "azimuth_offset_deg", "channel_modes"}):
            got = f"modes and {' and '.join(given)}"
            raise _refused(got, "either: modes say the azimuths of a full turn themselves")
        if not (isinstance(self.elevation_deg, Elevations) and self.elevation_deg.is_field):
            raise _refused("modes and channels in elevation_deg", "{first, last}: modes say the step")
        _check_ids([mode.id for mode in modes])
        if self.default_mode is None and len(modes) > 1:
            raise _refused(f"{len(modes)} modes and no default_mode", "default_mode: the mode to take if none is named")

    def _check_beams(self) -> None:
        if self.default_mode is not None:
            raise _refused("default_mode without modes", "both or none")
        if (self.n_azimuths is None) == (self.azimuth_deg is None):
            got = "both n_azimuths and azimuth_deg" if self.azimuth_deg else "neither n_azimuths nor azimuth_deg"
            raise _refused(got, "n_azimuths for a full turn, or azimuth_deg, or modes")
        if isinstance(self.elevation_deg, Elevations) and self.elevation_deg.is_field:
            raise _refused("elevation_deg of first and last alone", "its count or step, or modes")
        n_channels, n_azimuths = len(self.channels_deg()), self.azimuths()[0]
        if n_channels * n_azimuths > MAX_BEAMS:
            raise _refused(f"{n_azimuths} azimuths x {n_channels} channels", f"at most {MAX_BEAMS} beams in all")
        n_offsets = len(self.azimuth_offset_deg)
        if n_offsets not in (0, n_channels):
            raise _refused(
                f"azimuth_offset_deg = a list of {n_offsets}", f"a list of {n_channels} degrees, one per channel"
            )
        _check_channels(self.channels_deg(), self.azimuth_offset_deg)
        self._check_channel_modes()

    def _check_channel_modes(self) -> None:
        """Each takes the place of `elevation_deg`; offsets are of a table of their own, so that none can be shared."""
        _check_ids([mode.id for mode in self.channel_modes])
        if self.channel_modes and (self.n_azimuths is None or self.azimuth_offset_deg):
            got = "channel_modes and " + ("azimuth_deg" if self.azimuth_deg else "azimuth_offset_deg")
            raise _refused(got, "n_azimuths of a full turn, the same for every channel")
        for mode in self.channel_modes:
            if spacing_mode(mode.id) is not None:
                raise _refused(f"channel_modes id {mode.id}, a spacing", "an id that is no spacing")
            if len(mode.elevation_deg) * (self.n_azimuths or 0) > MAX_BEAMS:
                raise _refused(f"{len(mode.elevation_deg)} channels in mode {mode.id}", f"at most {MAX_BEAMS} beams")
            _check_channels(mode.elevation_deg, ())

    def channels_deg(self) -> tuple[float, ...]:
        """Return the elevation of each channel, where there are no modes."""
        return self.elevation_deg.degrees() if isinstance(self.elevation_deg, Elevations) else self.elevation_deg

    def vertical_field(self) -> Elevations:
        """Return the field that modes divide, where there are modes."""
        assert isinstance(self.elevation_deg, Elevations)
        return self.elevation_deg

    def azimuths(self) -> tuple[int, tuple[float, float] | None]:
        """Return how many azimuths there are, and the first and the last in degrees; None: a full turn from 0."""
        return self.azimuth_deg.beams() if self.azimuth_deg else (self.n_azimuths or 0, None)


def _check_ids(ids: list[str]) -> None:
    for name, n in Counter(ids).items():
        if n > 1:
            raise _refused(f"mode id {name!r} twice", "another id for each mode")


def _check_channels(channels_deg: tuple[float, ...], offsets_deg: tuple[float, ...]) -> None:
    """Channels go from the highest to the lowest, so that rows of a scan do; none is there twice."""
    elevation_deg, offset_deg = np.array(channels_deg), np.array(offsets_deg)
    rising = np.flatnonzero(np.diff(elevation_deg) > 0)
    if rising.size:
        k = int(rising[0])
        got = f"elevation_deg rising from {elevation_deg[k]:g} to {elevation_deg[k + 1]:g} at channel {k + 2}"
        raise _refused(got, "the highest channel first; sort the channels, azimuth_offset_deg along with them")
    turned = offset_deg % 360.0 if offset_deg.size else np.zeros_like(elevation_deg)
    order = np.lexsort([turned, elevation_deg])
    twice = np.flatnonzero((np.diff(elevation_deg[order]) == 0) & (np.diff(turned[order]) == 0))
    if twice.size:
        first, second = sorted(order[twice[0] : twice[0] + 2].tolist())
        got = f"elevation_deg = {elevation_deg[first]:g} for channels {first + 1} and {second + 1}"
        raise _refused(got, "channels that differ in elevation_deg or azimuth_offset_deg")


def _refused(got: str, expected: str) -> RequirementError:
    return RequirementError(f"got {got}, expected {expected}; {_SEE}")
