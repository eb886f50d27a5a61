"""The list of reproduced figures, in the paper's order, with what the paper found."""

from __future__ import annotations

from . import eq9, fig02, fig04, fig05, fig06, fig07, fig11, fig12, fig13, fig14, fig15, fig16, fig17, regime
from .figure import Figure

FIGURES: tuple[Figure, ...] = (
    Figure(
        "fig02",
        "Fig. 2: cutting triangles by their longest edge",
        "where the edge to be cut is taken in turn or at random, triangles degenerate into segments, and with the "
        "precision of floating-point numbers returns may be lost; cutting the longest edge avoids that.",
        fig02.run,
        "200 000 beams instead of two million",
        verdict=fig02.verdict,
    ),
    Figure(
        "fig04",
        "Fig. 4: the mean distance of six kinds of point sets in a triangle",
        "quasi-random points come close to what a scan should give, with a mean distance similar to that of an even "
        "grid. Points in a part of the triangle, or few of them, are heavily penalised; so that sparse scans gathered "
        "in a small area do not score well, the vertices count among the points.",
        fig04.run,
        "50 seeds instead of 500",
    ),
    Figure(
        "fig05",
        "Fig. 5: F1 and F2 over a level, F2 with and without its second sum",
        "with the reference distances of reached polygons taken off, F2 also says how much a scan reaches; without, it "
        "penalises scans that reach more polygons.",
        fig05.run,
        "a grid of 0.75 m instead of 0.25 m; scans have their 4500 columns",
        verdict=fig05.verdict,
    ),
    Figure(
        "f2-regime",
        "Eq. 2: when F2 rewards reaching a patch",
        "the number of reached polygons is part of F2, so that scans that reach few are penalised; polygons covered by "
        "a few points are heavily penalised, too. Which of both prevails it does not say.",
        regime.run,
        "24 positions for each number of columns instead of 200",
        verdict=regime.verdict,
        revision=2,
    ),
    Figure(
        "fig06",
        "Fig. 6: occupancy grids of overlapping circles",
        "the accuracy of the overlap measured on a grid depends on how fine the grid is, and on the number of points "
        "sampled of the other scans.",
        fig06.run,
        "39 distances instead of 399",
    ),
    Figure(
        "fig07",
        "Fig. 7: points of the Halton sequence and pseudo-random points on a mesh",
        "points of the Halton sequence are spread significantly more evenly over a polygon than uniform random ones.",
        fig07.run,
        "20 seeds instead of 200",
    ),
    Figure(
        "fig11",
        "Fig. 11: the best 30 positions of the basement by F2",
        "most of the positions that a greedy choice takes by F2 are surrounded by dense geometry; still they cover "
        "most of the scene. Small enclosed rooms are not scanned, since they have fewer polygons.",
        fig11.run,
        "a grid of 0.75 m instead of 0.5 m; scans have their 4500 columns",
        verdict=fig11.verdict,
    ),
    Figure(
        "eq9",
        "Eq. 9: coverage over the number of stations",
        "dividing the number of reached polygons by the number of active stations orients the genetic algorithm "
        "towards the most polygons with the fewest scans.",
        eq9.run,
        "a grid of 1 m instead of 0.5 m, and 5 seeds instead of 20; scans have their 4500 columns",
        verdict=eq9.verdict,
    ),
    Figure(
        "fig12",
        "Fig. 12: local search, simulated annealing and tabu search",
        "local search ends early in local optima; annealing may worsen for a while and comes lower; tabu search, begun "
        "anew where it is stuck, comes lowest in F2 (not in F1) but crowds where polygons are dense.",
        fig12.run,
        "starts of a grid of 3.5 m at one height instead of 0.5 m at all; scans have their 4500 columns",
        verdict=fig12.verdict,
        revision=2,
    ),
    Figure(
        "fig13",
        "Fig. 13: each spatial search with genetic selection after it",
        "tabu search needs fewer stations, most of them gathered in the main room; local search and annealing give a "
        "higher variety, more stations and a better coverage of enclosed rooms, and only with annealing the small "
        "rooms at the sides are scanned. Stations are alike in F1 and F2. Gaps let lower levels be scanned.",
        fig13.run,
        "starts of a grid of 5 m at one height instead of 0.5 m at all, 20 iterations of the searches instead of 60 "
        "and 5 seeds of the selection instead of 20; scans have their 4500 columns",
        verdict=fig13.verdict,
        revision=2,
    ),
    Figure(
        "fig14",
        "Fig. 14: overlap of scattered stations, before and after repair",
        "stations chosen for coverage alone overlap little; stations are added until 20, 40 or 60 % of every scan's "
        "circle is covered by others and all stations form one set.",
        fig14.run,
        "positions at one height; radii and overlaps are the paper's, and scans have their 4500 columns",
        verdict=fig14.verdict,
    ),
    Figure(
        "fig15",
        "Fig. 15: spatial searches, plain and memoised",
        "remembering what a place of the lattice is worth makes the searches significantly faster, the time of judging "
        "places in advance included; except those that are soon stuck in local optima or can't begin anew.",
        fig15.run,
        "4 starts of the grid at one height instead of all; scans have their 4500 columns",
        verdict=fig15.verdict,
    ),
    Figure(
        "fig16",
        "Fig. 16: genetic selection on the device and on the host",
        "the whole genetic algorithm on a graphics card is significantly faster than the multi-core version on the "
        "host, since nothing is transferred before and after every evaluation.",
        fig16.run,
        "a grid of 1 m, 150 iterations and populations up to 500; scans have their 4500 columns",
        verdict=fig16.verdict,
    ),
    Figure(
        "fig17",
        "Fig. 17: fixed and variable height among walls with holes",
        "searching heights of 1 to 2 m besides places finds better positions than a fixed height; all the positions "
        "that a greedy choice takes by F2 are next to holes of the walls, which lets them reach more polygons.",
        fig17.run,
        "a grid of 0.4 m instead of 0.1 m in plan; scans have their 4500 and 1800 columns",
        verdict=fig17.verdict,
    ),
)
