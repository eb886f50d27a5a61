"""Genetic selection: a population of station sets that evolves, on an OpenCL device or on the host, bit for bit alike.

`select_genetic` in `planner_core.genetic.search` is the stage; docs/method/genetic-selection.md has the method.
"""

from planner_core.genetic.problem import CoverRows
from planner_core.genetic.search import GeneticResult, select_genetic
from planner_core.genetic.settings import GeneticSettings

__all__ = ["CoverRows", "GeneticResult", "GeneticSettings", "select_genetic"]
