"""Which candidates can be registered with each other, and how the chosen ones have to hang together.

Made by `planner_core.register.candidate_links` from overlap and strength of links; selection only sees a graph.
"""

from __future__ import annotations

from dataclasses import dataclass

from planner_core.model import Int32Array, Int64Array


@dataclass(frozen=True)
class Network:
    """A graph over N candidates. Chosen candidates of one part must be joined by links between chosen candidates.

    starts, neighbour : CSR rows, (N + 1,) int64 and int32, sorted, symmetric, without loops.
    part : (N,) int32, connected component of the whole graph: no plan can join two parts, so none has to.
    loops : the chosen ones of a part must stay joined when any one link between them fails (no bridges), where there
    are three or more of them.
    """

    starts: Int64Array
    neighbour: Int32Array
    part: Int32Array
    loops: bool = False

    @property
    def n_candidates(self) -> int:
        """Number of candidates."""
        return int(self.starts.size - 1)

    def neighbours(self, candidate: int) -> Int32Array:
        """Sorted candidates that one is linked to."""
        return self.neighbour[self.starts[candidate] : self.starts[candidate + 1]]
