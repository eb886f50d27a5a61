"""What of a patch counts, and when it counts as seen: docs/method/coverage.md.

Patches end inside walls, below floors and behind furniture. Of each, what candidates together can see counts, and a
position sees the patch where it sees enough of that. At half, as much is rounded up as down for positions that nobody
chose; a plan chooses those for which more is rounded up, so that it is a little more than half.
"""

from __future__ import annotations

import numpy as np

from planner_core.engine.patch_samples import UInt32Array, share_of
from planner_core.model import BoolArray, Int32Array, UInt8Array

#: `Patches.countable_share` of a patch that counts whole.
WHOLE = 255
#: Part of what counts that is enough, eleven twentieths: at which areas of plans are those of independent checks, see
#: docs/decisions/0014-what-counts-as-covered.md.
_ENOUGH, _OF = 11, 20


def shares_of(part: UInt32Array) -> UInt8Array:
    """(M,) uint8: how much of its patch each part is, in 255ths; of any part at least one."""
    share = np.rint(WHOLE * share_of(part))
    return np.where(part > 0, np.maximum(share, 1), 0).astype(np.uint8)


def sees_enough(share: UInt8Array, countable_share: UInt8Array) -> BoolArray:
    """(M,) bool: whether shares (M,) are enough of what counts of their patches, (M,)."""
    enough: BoolArray = _OF * share.astype(np.int32) >= _ENOUGH * countable_share.astype(np.int32)
    return enough


def most_countable(best: Int32Array) -> Int32Array:
    """(P,) the most that may count of patches of which one position sees `best` (P,) and no other more: enough of it
    is seen then.
    """
    return best * _OF // _ENOUGH
