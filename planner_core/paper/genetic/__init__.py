"""Genetic selection: a population of station sets that evolves, on an OpenCL device or on the host, bit for bit alike.

`select_genetic` in `planner_core.paper.genetic.search` is the stage; docs/method/genetic-selection.md has the method.
"""

from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic.search import GeneticResult, select_genetic
from planner_core.select.problem import CoverProblem

__all__ = ["CoverProblem", "GeneticResult", "GeneticSettings", "select_genetic"]
