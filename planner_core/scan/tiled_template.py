"""A beam template on the device: its tiles, and the programs that walk the tree with them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner_core.device import Buffer, Device, Program
from planner_core.model import BeamTemplate
from planner_core.scan.tiles import make_tiles
from planner_core.scan.tuning import tile_shape


class TiledTemplate:
    """Tiles of one template in one shape. Kernels of `trace_tile.h` take `scene_arguments`, then `beam_arguments`."""

    def __init__(self, template: BeamTemplate, device: Device, *, stack: int) -> None:
        self.template, self.shape = template, tile_shape(device)
        self._on = device
        rows, columns, lanes = self.shape
        self._defines: Mapping[str, int] = {"LANES": lanes, "STACK": stack, "TILE_ROWS": rows, "TILE_COLUMNS": columns}
        grid = make_tiles(template, tile_rows=rows, tile_columns=columns, lanes=lanes)
        buffers = device.upload("beams", {"tiles": grid.bounds, "beams": grid.beams, "rectangles": grid.rectangles})
        self.n_tiles = grid.n_tiles
        self.beam_arguments: tuple[Buffer | np.generic, ...] = (
            *buffers.values(),
            np.int32(template.shape[0]),
            np.int32(template.shape[1]),
            np.int32(grid.tiles_across),
            np.float32(template.range_min_m),
            np.float32(template.range_max_m),
        )

    def fits(self, template: BeamTemplate) -> bool:
        """Whether these are the tiles of this very template, in the shape that is wanted now."""
        return self.template is template and self.shape == tile_shape(self._on)

    def program(self, file: str) -> Program:
        """Build a kernel file for tiles of this shape; a second call finds it built."""
        return self._on.program(file, self._defines)
