"""The genetic operators in NumPy: what kernels/genetic_population.cl does, bit for bit, on rows of booleans.

Chromosomes are (n, N) bool, one row an individual, one column a candidate. Random numbers go by counter
(`paper.genetic.philox`): which ones an operator draws is part of its definition, and the same on the device.

Source: López et al. 2023, section 3.6; readings of it in docs/method/genetic-selection.md.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic.philox import Draws, Purpose, below, threshold

#: Key of offspring that must not replace anybody: below all keys of `planner_core.paper.genetic.objective`.
BARRED = np.iinfo(np.int64).min


def rate_range(settings: GeneticSettings, n_genes: int) -> tuple[int, int]:
    """Least rate of active genes of random individuals and the span above it, of 2^32; the mean is the rate required.

    Rates are drawn evenly from 0 to twice the mean; from 2 mean - 1 to 1 where the mean is above a half.
    """
    wanted = n_genes / 2 if settings.expected_active is None else settings.expected_active
    mean = min(wanted / n_genes, 1.0)
    low, high = threshold(max(0.0, 2 * mean - 1)), threshold(min(1.0, 2 * mean))
    return low, high - low


def random_individuals(draws: Draws, settings: GeneticSettings, individuals: Int64Array, n_genes: int) -> BoolArray:
    """(len(individuals), N) random chromosomes; those without any active gene are left to `mend`."""
    low, span = rate_range(settings, n_genes)
    number = draws.numbers(0, Purpose.RATE, individuals, 1)
    rate = np.uint64(low) + ((number[:, 0] * np.uint64(span)) >> np.uint64(32))
    return draws.hits(0, Purpose.GENE, individuals, n_genes, rate)


def mend(draws: Draws, iteration: int, genes: BoolArray) -> None:
    """Activate one random gene of every individual that has none, in place."""
    empty = np.flatnonzero(~genes.any(axis=1))
    if empty.size:
        genes[empty, below(draws.numbers(iteration, Purpose.MEND, empty, 1)[:, 0], genes.shape[1])] = True


def rank(key: Int64Array) -> Int64Array:
    """Individuals by key, the best first; of equals the lower number."""
    return np.argsort(~key, kind="stable")  # ~key is -key - 1, which no number overflows


def mating_pool(draws: Draws, settings: GeneticSettings, iteration: int, order: Int64Array) -> Int64Array:
    """(n_parents,) individuals: winners of tournaments, drawn with replacement, or the best.

    A tournament draws ranks: everybody has one, and the least rank drawn is the winner's.
    """
    if settings.selection == "elitist":
        return order[: settings.n_parents]
    places = np.arange(settings.n_parents)
    drawn = draws.numbers(iteration, Purpose.TOURNAMENT, places, settings.tournament_size)
    winners: Int64Array = order[below(drawn, order.size).min(axis=1)]
    return winners


def exchanged(draws: Draws, settings: GeneticSettings, iteration: int, pairs: Int64Array, n_genes: int) -> BoolArray:
    """(len(pairs), N): which genes the two children of a pair exchange where they are crossed."""
    gene = np.arange(n_genes)
    if settings.crossover == "uniform":
        words = draws.numbers(iteration, Purpose.MIX, pairs, -(-n_genes // 32))
        return (words[:, gene // 32] >> (gene % 32).astype(np.uint64) & np.uint64(1)).astype(bool)
    cut = draws.numbers(iteration, Purpose.CUT, pairs, 2)
    if settings.crossover == "one-point":
        return gene >= 1 + below(cut[:, :1], n_genes - 1)
    # Two different ones of the n + 1 places where a chromosome can be cut, its ends included.
    one, two = below(cut[:, :1], n_genes + 1), below(cut[:, 1:], n_genes)
    two = two + (two >= one)
    return (gene >= np.minimum(one, two)) & (gene < np.maximum(one, two))


def breed(draws: Draws, settings: GeneticSettings, iteration: int, genes: BoolArray, pool: Int64Array) -> BoolArray:
    """(n_offspring, N) children of random pairs of the pool, crossed, mutated and mended."""
    n_offspring, n_parents = settings.n_offspring, settings.n_parents
    pairs = np.arange(-(-n_offspring // 2))
    mate = draws.numbers(iteration, Purpose.MATE, pairs, 3)
    one = below(mate[:, 0], n_parents)
    two = (one + 1 + below(mate[:, 1], n_parents - 1)) % n_parents
    crossed = mate[:, 2:] < threshold(settings.crossover_rate)
    swap = exchanged(draws, settings, iteration, pairs, genes.shape[1]) & crossed
    mother, father = genes[pool[one]], genes[pool[two]]
    children = np.stack([np.where(swap, father, mother), np.where(swap, mother, father)], axis=1)
    offspring: BoolArray = children.reshape(-1, genes.shape[1])[:n_offspring]
    mutate(draws, settings, iteration, offspring)
    mend(draws, iteration, offspring)
    return offspring


def mutate(draws: Draws, settings: GeneticSettings, iteration: int, offspring: BoolArray) -> None:
    """Flip genes of some individuals, in place."""
    number = draws.numbers(iteration, Purpose.MUTATE, np.arange(len(offspring)), 1)[:, 0]
    chosen = np.flatnonzero(number < threshold(settings.individual_mutation_rate))
    limit = np.full(chosen.size, threshold(settings.gene_mutation_rate), dtype=np.uint64)
    offspring[chosen] ^= draws.hits(iteration, Purpose.FLIP, chosen, offspring.shape[1], limit)


def bar_twins(genes: BoolArray, offspring: BoolArray, offspring_key: Int64Array) -> None:
    """Give the least key of all to offspring that equal an individual or an offspring of lower number, in place."""
    known = {row.tobytes() for row in np.packbits(genes, axis=1)}
    for index, row in enumerate(np.packbits(offspring, axis=1)):
        if row.tobytes() in known:
            offspring_key[index] = BARRED
        known.add(row.tobytes())


def places_of_offspring(
    settings: GeneticSettings, order: Int64Array, key: Int64Array, offspring_key: Int64Array
) -> tuple[Int64Array, Int64Array]:
    """Which offspring take the places of which individuals.

    Stationary: the best offspring that of the worst individual if it is better, the second best that of the second
    worst, and so on; what is left are the best of both together. Generational: all but the `n_elite` best.
    """
    if settings.replacement == "generational":
        return np.arange(settings.n_offspring), order[settings.n_elite :]
    offspring, worst = rank(offspring_key), order[::-1][: settings.n_offspring]
    better = offspring_key[offspring] > key[worst]
    return offspring[better], worst[better]
