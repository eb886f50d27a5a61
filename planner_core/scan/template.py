"""The beam template: all beams of one scan as azimuths and elevations, the same for every station.

Radians; azimuth counter-clockwise from +x seen from above, elevation up from the horizontal; row 0 is the highest.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BeamTemplate, FloatArray, Scanner


def make_template(scanner: Scanner) -> BeamTemplate:
    """Beams of `scanner`: its channels by `n_azimuths` azimuths, evenly from 0 (the full turn itself excluded)."""
    return BeamTemplate(
        azimuth_rad=np.arange(scanner.n_azimuths, dtype=np.float64) * (2.0 * np.pi / scanner.n_azimuths),
        elevation_rad=np.array(scanner.elevation_rad, dtype=np.float64),
        range_min_m=scanner.range_min_m,
        range_max_m=scanner.range_max_m,
    )


def directions(template: BeamTemplate) -> FloatArray:
    """Unit directions (rows, columns, 3) float64 of all beams: (cos e cos a, cos e sin a, sin e).

    Engines round these very values to float32; they never compute directions of their own.
    """
    elevation, azimuth = template.elevation_rad[:, None], template.azimuth_rad[None, :]
    out = np.empty((*template.shape, 3))
    out[..., 0] = np.cos(elevation) * np.cos(azimuth)
    out[..., 1] = np.cos(elevation) * np.sin(azimuth)
    out[..., 2] = np.sin(elevation)
    return out
