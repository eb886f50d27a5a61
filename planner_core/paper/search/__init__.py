"""Spatial search: positions move to better ones nearby, by local search, simulated annealing or tabu search.

`search` in `planner_core.paper.search.improve` is the stage; docs/method/spatial-search.md has the method.
"""

from planner_core.model.spatial_search import SearchSettings
from planner_core.paper.search.agents import SearchHistory, SearchResult
from planner_core.paper.search.improve import search
from planner_core.paper.search.landscape import Fitness

__all__ = ["Fitness", "SearchHistory", "SearchResult", "SearchSettings", "search"]
