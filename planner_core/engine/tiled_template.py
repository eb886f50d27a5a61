"""A beam template on the device: its tiles, and the programs that walk the tree with them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner_core.device import Buffer, Device, Program
from planner_core.engine.tiles import make_tiles
from planner_core.engine.tuning import shape_state, tile_shape
from planner_core.model import BeamTemplate


class TiledTemplate:
    """Tiles of one template in one shape; `walk` has the defines of tree.h for the scene.

    Kernels of `trace_tile.h` take the scene's arguments, then `beam_arguments`.

    A template too large for the device goes there in `scanner.template.bands`, one after the other: give each
    its `first_row` and the number of rows of the whole, so that `scan_tiles` writes it to its place in whole images.
    """

    def __init__(
        self,
        template: BeamTemplate,
        device: Device,
        *,
        walk: Mapping[str, int],
        first_row: int = 0,
        image_rows: int | None = None,
    ) -> None:
        self._shape_state = shape_state()
        self.shape = tile_shape(device)
        self._on = device
        rows, columns, lanes = self.shape
        self._defines: Mapping[str, int] = {**walk, "LANES": lanes, "TILE_ROWS": rows, "TILE_COLUMNS": columns}
        self._programs: dict[tuple[object, ...], Program] = {}
        grid = make_tiles(template, tile_rows=rows, tile_columns=columns, lanes=lanes)
        buffers = device.upload(
            "beams",
            {"tiles": grid.bounds, "beams": grid.beams, "rectangles": grid.rectangles, "places": grid.places},
        )
        self.n_tiles = grid.n_tiles
        n_rows, n_columns = template.shape
        self.beam_arguments: tuple[Buffer | np.generic, ...] = (
            *buffers.values(),
            np.int32(n_columns),
            np.int32(n_columns * (n_rows if image_rows is None else image_rows)),
            np.int32(n_columns * first_row),
            np.float32(template.range_min_m),
            np.float32(template.range_max_m),
        )

    @property
    def has_wanted_shape(self) -> bool:
        """Whether these tiles have the shape that is wanted now."""
        return self._shape_state == shape_state()

    def release(self) -> None:
        """Give the device memory back; nothing can be scanned with these tiles afterwards."""
        for item in self.beam_arguments:
            if isinstance(item, Buffer):
                item.release()

    def program(self, file: str, **more: int) -> Program:
        """Build a kernel file for tiles of this shape, and more defines of its own; a second call finds it built."""
        key = (file, *more.items())
        if key not in self._programs:
            self._programs[key] = self._on.program(file, {**self._defines, **more})
        return self._programs[key]
