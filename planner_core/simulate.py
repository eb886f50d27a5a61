"""Simulated scans of given positions, one after the other: what the scanner would return there.

Input an open engine, the beams of one scan, positions (local frame, metres); output a `ScanBatch` a position.
"""

from __future__ import annotations

from collections.abc import Iterator

from planner_core.model import BeamTemplate, FloatArray, ScanBatch
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scan.engine import ScanEngine, check_positions


def simulate_scans(
    engine: ScanEngine, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent
) -> Iterator[ScanBatch]:
    """Scan from each of positions (S, 3), the sensor's origin, in their order.

    Yields batches of one scan each: memory holds one scan at a time, 16 bytes a beam, however many positions there
    are. Misses are range NaN, triangle and patch -1.

    Raises
    ------
    RequirementError
        Positions of another shape, or not finite; before the first scan.
    """
    positions = check_positions(positions_m)
    return _scans(engine, template, positions, progress)


def _scans(
    engine: ScanEngine, template: BeamTemplate, positions_m: FloatArray, progress: Progress
) -> Iterator[ScanBatch]:
    for index in range(positions_m.shape[0]):
        yield engine.scan(template, positions_m[index : index + 1])
        progress(ProgressEvent("simulate", index + 1, positions_m.shape[0]))
