"""Shapes of packets and tiles that suit a device; results never depend on them."""

from __future__ import annotations

from planner_core.device import Device

#: Rows and columns of beams a tile and beams a packet, by kind of device. CPU: measured on PoCL 3.0 (AVX2),
#: docs/benchmarks/scan.md. Others are unmeasured: a scalar packet lets a GPU's own lanes be the packet.
_TILE_SHAPE = {"cpu": (8, 32, 8)}
_DEFAULT_TILE_SHAPE = (4, 8, 1)


def tile_shape(device: Device) -> tuple[int, int, int]:
    """Rows and columns of beams a tile, and beams a packet, that suit the device."""
    return _TILE_SHAPE.get(device.kind, _DEFAULT_TILE_SHAPE)
