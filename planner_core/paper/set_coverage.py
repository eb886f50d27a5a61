"""F1 of many sets of positions: the number of distinct patches that any position of a set reaches, and their area.

Input `Visibility` rows, patch areas (m^2), sets of row numbers; output a count and an area a set. On an OpenCL device
(`kernels/metrics_coverage.cl`) or in NumPy, to the same bits: areas are added up as whole multiples of a power of two.

References
----------
López et al. 2023, Eq. 1. docs/method/f1.md. For one set, `planner_core.coverage.coverage` has plain functions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Device
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int32Array, Int64Array, Visibility

#: Words of 32 patches that a work-item ORs: few searches in rows on a CPU, registers that suffice elsewhere.
_WORDS = {"cpu": 512}
_DEFAULT_WORDS = 32
#: Sets a launch, which bounds what is kept by set and slice.
_SETS_AT_ONCE = 4096
#: Bits of the whole numbers that all areas together may have.
_AREA_BITS = 61

PositionSet = Sequence[int] | Int64Array


class SetCoverage:
    """F1 of sets over the rows of one `Visibility`.

    Parameters
    ----------
    patch_area_m2 : (P,)
    device
        Where to count; None: the host. The rows stay in its memory.

    Raises
    ------
    RequirementError
        Areas of another number than there are patches, or negative or not finite.
    DeviceMemoryError
        The rows do not fit.
    """

    def __init__(self, visibility: Visibility, patch_area_m2: FloatArray, *, device: Device | None = None) -> None:
        if patch_area_m2.shape != (visibility.n_patches,):
            raise RequirementError(
                f"patch_area_m2: got shape {patch_area_m2.shape}, expected ({visibility.n_patches},); "
                "take the areas of the same patches"
            )
        total = float(patch_area_m2.sum())
        if not (np.isfinite(total) and (patch_area_m2 >= 0).all()):
            raise RequirementError("patch_area_m2: got negative or endless areas, expected square metres")
        self._visibility, self._on = visibility, device
        # A power of two, so that turning sums back into square metres rounds once.
        self._units_per_m2 = 2.0 ** (_AREA_BITS - int(np.ceil(np.log2(max(total, 1e-30)))))
        self._area = np.rint(patch_area_m2 * self._units_per_m2).astype(np.uint64)
        if device is not None:
            self._words = _WORDS.get(device.kind, _DEFAULT_WORDS)
            self._program = device.program("metrics_coverage.cl", {"WORDS": self._words})
            self._rows = device.upload(
                "F1: rows", {"starts": visibility.starts, "patch": visibility.patch, "area": self._area}
            )

    def of(self, sets: Sequence[PositionSet]) -> tuple[Int64Array, FloatArray]:
        """(K,) int64 distinct patches and (K,) float64 their area in m^2 of K sets of row numbers.

        Raises
        ------
        RequirementError
            A row that does not exist.
        DeviceError
            The device fails.
        """
        rows = [np.asarray(one, dtype=np.int64).reshape(-1) for one in sets]
        for index, one in enumerate(rows):
            if one.size and not (one.min() >= 0 and one.max() < self._visibility.n_positions):
                raise RequirementError(
                    f"set {index}: got rows {one.min()} to {one.max()}, expected 0 to "
                    f"{self._visibility.n_positions - 1}; number positions as in the visibility"
                )
        if not rows:
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        parts = []
        for at in range(0, len(rows), _SETS_AT_ONCE):
            some = rows[at : at + _SETS_AT_ONCE]
            parts.append(self._on_host(some) if self._on is None else self._on_device(self._on, some))
        count = np.concatenate([part[0] for part in parts])
        area = np.concatenate([part[1] for part in parts])
        return count, area.astype(np.float64) / self._units_per_m2

    def _on_host(self, sets: list[Int64Array]) -> tuple[Int64Array, NDArray[np.uint64]]:
        count, area = np.zeros(len(sets), dtype=np.int64), np.zeros(len(sets), dtype=np.uint64)
        seen = np.zeros(self._visibility.n_patches, dtype=np.bool_)
        for index, rows in enumerate(sets):
            seen[:] = False
            for row in rows:
                seen[self._visibility.row(int(row))] = True
            count[index] = np.count_nonzero(seen)
            area[index] = self._area[seen].sum()
        return count, area

    def _on_device(self, device: Device, sets: list[Int64Array]) -> tuple[Int64Array, NDArray[np.uint64]]:
        n_slices = -(-self._visibility.n_patches // (32 * self._words))
        of_set: Int32Array = np.cumsum([0, *(rows.size for rows in sets)]).astype(np.int32)
        given = device.upload("F1: sets", {"of_set": of_set, "chosen": np.concatenate(sets).astype(np.int32)})
        count = np.empty((len(sets), n_slices), dtype=np.int32)
        area = np.empty((len(sets), n_slices), dtype=np.uint64)
        with device.outputs("F1: figures", {"count": count, "area": area}) as out:
            self._program.run(
                "measure_sets",
                (n_slices, len(sets)),
                *(self._rows["starts"], self._rows["patch"], given["of_set"], given["chosen"], self._rows["area"]),
                *(out["count"], out["area"]),
            )
        return count.sum(axis=1, dtype=np.int64), area.sum(axis=1, dtype=np.uint64)
