"""Noise of simulated returns: how far a measured range and direction are off, and which beams come back too weak.

A scanner's own figures, ranges and the share of light sent back -> one sigma, signal, seeded deviates. Metres, radians.
docs/method/range-noise.md has the model and its reasons.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from planner_core.errors import ExportError
from planner_core.model import BoolArray, FloatArray, Scanner
from planner_core.scanner.range_noise import range_noise_m

REACHES_WHITE = 0.9
"""Reflectivity of the surface, met head on, up to which a scanner's greatest range is taken to hold: data sheets that
name one name 80 to 95 %."""

_DEVIATES = 3
"""Of a beam: range, azimuth, elevation."""
_WORDS = 4
"""64-bit words that one count of Philox yields: a beam has a count of its own."""


@dataclass(frozen=True)
class NoiseModel:
    """How a scanner's returns scatter, by its own figures.

    angle_sigma_rad : of either angle; 0 where the scanner's accuracy is not known. least_signal : reflectivity x
    cos(incidence) / range^2, per square metre, below which nothing comes back.
    """

    scanner: Scanner
    angle_sigma_rad: float
    least_signal: float

    def range_sigma_m(self, range_m: FloatArray, returned: FloatArray) -> FloatArray:
        """One sigma of each range.

        Parameters
        ----------
        range_m : (N,), metres. returned : (N,), share of light sent back: reflectivity x cos(incidence), in (0, 1].

        Notes
        -----
        Where the scanner's table of range noise reaches, it is `range_noise_m`, as requirements are judged by. Beyond,
        the nearest figure, and where the signal is weaker than there, larger by the square root of the ratio, as noise
        of counted photons is. A scanner without table: its ranging accuracy a + b r, taken as one sigma.
        """
        if not self.scanner.range_noise:
            constant_m, by_range = self.scanner.ranging_accuracy or (0.0, 0.0)
            return np.asarray(constant_m + by_range * range_m, dtype=np.float64)
        sigma = range_noise_m(self.scanner, range_m, reflectivity=returned)
        unknown = np.isnan(sigma)
        if unknown.any():
            sigma[unknown] = _beyond_table_m(self.scanner, range_m[unknown], returned[unknown])
        return sigma

    def beyond_table(self, range_m: FloatArray, returned: FloatArray) -> BoolArray:
        """(N,) whether the scanner has a table of range noise that does not reach there."""
        if not self.scanner.range_noise:
            return np.zeros(range_m.shape, dtype=np.bool_)
        return np.asarray(np.isnan(range_noise_m(self.scanner, range_m, reflectivity=returned)))

    def comes_back(self, range_m: FloatArray, returned: FloatArray) -> BoolArray:
        """(N,) whether the return is strong enough to be measured; ranges may be NaN, which are not."""
        return np.asarray(returned >= self.least_signal * range_m**2)


def noise_model(scanner: Scanner) -> NoiseModel:
    """Make the model of a scanner's figures.

    Raises
    ------
    ExportError
        The scanner has neither a table of range noise nor a ranging accuracy.
    """
    if not scanner.range_noise and scanner.ranging_accuracy is None:
        raise ExportError(
            f"noise: scanner {scanner.name} has no figures of range noise or ranging accuracy, expected one of them; "
            "leave --noise out, or plan with a scanner file that has `range_noise`"
        )
    # What the data sheet gives a figure for is measured, however weak it is.
    weakest = [reflectivity / range_m**2 for range_m, reflectivity, _ in scanner.range_noise if range_m > 0]
    return NoiseModel(
        scanner=scanner,
        angle_sigma_rad=scanner.angular_accuracy_rad or 0.0,
        least_signal=min([REACHES_WHITE / scanner.range_max_m**2, *weakest]),
    )


def _beyond_table_m(scanner: Scanner, range_m: FloatArray, returned: FloatArray) -> FloatArray:
    """Sigma where the table does not reach: first by range in each of its reflectivities, then by reflectivity."""
    table = np.array(scanner.range_noise, dtype=np.float64)
    known = np.unique(table[:, 1])
    by_reflectivity = np.stack([_held_by_range(table[table[:, 1] == one], range_m) for one in known])
    held = np.clip(returned, known[0], known[-1])
    above = np.clip(np.searchsorted(known, held), 1, max(known.size - 1, 1))
    above = np.minimum(above, known.size - 1)
    below = np.maximum(above - 1, 0)
    gap = known[above] - known[below]
    share = np.divide(held - known[below], gap, out=np.zeros(range_m.shape), where=gap > 0)
    low = np.take_along_axis(by_reflectivity, below[None], axis=0)[0]
    high = np.take_along_axis(by_reflectivity, above[None], axis=0)[0]
    weaker = np.sqrt(np.maximum(1.0, known[0] / returned))
    return np.asarray((low + share * (high - low)) * weaker)


def _held_by_range(rows: FloatArray, range_m: FloatArray) -> FloatArray:
    """Rows of one reflectivity, by range -> sigma: held nearer, growing with range farther (signal falls as r^-2)."""
    sigma = np.interp(range_m, rows[:, 0], rows[:, 2])
    return np.asarray(sigma * np.maximum(1.0, range_m / rows[-1, 0]))


def deviates(seed: int, station_id: str, *, first_beam: int, n_beams: int) -> FloatArray:
    """(n_beams, 3) standard normal deviates of range, azimuth and elevation of a station's beams.

    Beam k has the same deviates in whatever block, order or number of threads it is computed: they are a function of
    (seed, station, k).

    Notes
    -----
    Philox4x64-10 (Salmon et al. 2011) as NumPy has it, keyed by seed and station, counting beams; two of its words
    make two deviates by Box and Muller (1958).
    """
    key = np.array([seed & 0xFFFFFFFFFFFFFFFF, _number_of(station_id)], dtype=np.uint64)
    counter = np.array([first_beam, 0, 0, 0], dtype=np.uint64)
    words = np.random.Philox(key=key, counter=counter).random_raw(_WORDS * n_beams).reshape(n_beams, _WORDS)
    # 53 bits each, in (0, 1]: the logarithm of 0 is none.
    uniform = ((words >> np.uint64(11)) + np.uint64(1)).astype(np.float64) * 2.0**-53
    out = np.empty((n_beams, _DEVIATES))
    length = np.sqrt(-2.0 * np.log(uniform[:, 0::2]))
    turn = 2.0 * np.pi * uniform[:, 1::2]
    out[:, 0] = length[:, 0] * np.cos(turn[:, 0])
    out[:, 1] = length[:, 1] * np.cos(turn[:, 1])
    out[:, 2] = length[:, 1] * np.sin(turn[:, 1])
    return out


def _number_of(station_id: str) -> int:
    """64 bits of a station's id: its noise does not depend on what other stations there are."""
    return int.from_bytes(hashlib.sha256(station_id.encode()).digest()[:8], "little")
