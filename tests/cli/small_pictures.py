"""`tlsplan` with pictures nobody looks at: drawn small, in this process or, run as a program, in one of its own.

At their full size the pictures of a small plan take longer than the plan; tests/export looks at them.
"""

from __future__ import annotations

import pytest
from tlsplan.main import main

from planner_core.export import maps, pictures, sheet


def draw_small(patch: pytest.MonkeyPatch) -> None:
    for module in (sheet, maps, pictures):
        patch.setattr(module, "DPI", 20)
    patch.setattr(pictures, "CAP_CELLS", 80)
    patch.setattr(pictures, "OVERSAMPLING", 1)


if __name__ == "__main__":
    with pytest.MonkeyPatch.context() as own:
        draw_small(own)
        main()
