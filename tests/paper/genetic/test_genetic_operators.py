"""The operators of both engines: what they do, and that what they draw is distributed as it must be.

Seeds are fixed, so every test decides the same way always; chi-square tests ask for p > 0.001.
"""

import numpy as np
import pytest
from scipy import stats

from planner_core.paper.genetic import GeneticSettings

P_LEAST = 1e-3


def settings(**changes):
    return GeneticSettings(**{"population": 500, "n_parents": 250, "seed": 11, **changes})


# ------------------------------------------------------------------------------------------- start
def test_start_draws_a_rate_of_active_genes_for_every_individual(operators):
    active = operators(settings(population=2000), 200).start().sum(axis=1)
    # Rates are uniform on 0 .. 1: so are the numbers of active genes on 0 .. N (a mixture of binomials), except that
    # nobody has none.
    counts = np.bincount(np.minimum(active * 10 // 201, 9), minlength=10)
    assert stats.chisquare(counts).pvalue > P_LEAST
    assert active.min() >= 1


@pytest.mark.parametrize("expected", [5.0, 60.0, 170.0])
def test_start_has_as_many_active_genes_as_were_asked_for(operators, expected):
    active = operators(settings(population=1000, expected_active=expected), 200).start().sum(axis=1)
    spread = active.std() / np.sqrt(active.size)
    assert abs(active.mean() - expected) < 4 * spread + 0.1


def test_start_activates_all_genes_equally_often(operators):
    genes = operators(settings(population=2000, expected_active=20), 97).start()
    assert stats.chisquare(genes.sum(axis=0)).pvalue > P_LEAST


def test_start_mends_individuals_without_stations_by_one_random_gene(operators):
    genes = operators(settings(population=4000, expected_active=1e-9), 10).start()
    assert (genes.sum(axis=1) == 1).all()
    assert stats.chisquare(genes.sum(axis=0)).pvalue > P_LEAST


# --------------------------------------------------------------------------------------- selection
@pytest.mark.parametrize("size", [1, 2, 5])
def test_tournament_wins_are_distributed_by_rank(operators, size):
    n = 20
    chosen = settings(population=n, n_parents=n, tournament_size=size)
    made = operators(chosen, 4)
    order = np.random.default_rng(1).permutation(n)
    pools = np.concatenate([made.pool(iteration, order) for iteration in range(1, 201)])
    rank_of = np.argsort(order)
    counts = np.bincount(rank_of[pools], minlength=n)
    # The winner has rank r when all draws are at least r, but not all at least r + 1.
    r = np.arange(n)
    expected = ((n - r) / n) ** size - ((n - r - 1) / n) ** size
    few = np.cumsum(expected[::-1])[::-1] * counts.sum() < 8
    first = int(np.argmax(few)) if few.any() else n
    observed = np.append(counts[:first], counts[first:].sum()) if first < n else counts
    wanted = np.append(expected[:first], expected[first:].sum()) if first < n else expected
    keep = wanted > 0
    assert stats.chisquare(observed[keep], wanted[keep] * counts.sum()).pvalue > P_LEAST


def test_elitist_selection_takes_the_best(operators):
    order = np.random.default_rng(2).permutation(500)
    pool = operators(settings(selection="elitist"), 4).pool(1, order)
    assert pool.tolist() == order[:250].tolist()


# --------------------------------------------------------------------------------------- crossover
def parents(n_genes, n_parents=250):
    """Parent k has gene g active if bit (g % 8) of k is set: whose gene it is can be read off groups of eight."""
    k = np.arange(n_parents)[:, None]
    return (k >> (np.arange(n_genes) % 8)[None, :] & 1).astype(bool)


def without_mutation(**changes):
    return settings(population=250, individual_mutation_rate=0.0, **changes)


@pytest.mark.slow
def test_crossover_mates_two_different_places_of_the_pool_evenly(operators):
    n = 6
    made = operators(settings(population=n, n_parents=n, crossover_rate=0.0, individual_mutation_rate=0.0), n)
    genes = np.eye(n, dtype=bool)  # child's only gene names its parent
    pairs = np.zeros((n, n))
    for iteration in range(1, 401):
        child = np.argmax(made.breed(iteration, genes, np.arange(n)), axis=1)
        np.add.at(pairs, (child[::2], child[1::2]), 1)
    assert np.trace(pairs) == 0
    assert stats.chisquare(pairs[~np.eye(n, dtype=bool)]).pvalue > P_LEAST


@pytest.mark.parametrize("crossover", ["one-point", "two-point", "uniform"])
def test_crossover_keeps_every_gene_of_the_pair(operators, crossover):
    made = operators(without_mutation(crossover=crossover, crossover_rate=1.0), 75)
    genes = np.random.default_rng(3).random((250, 75)) < 0.3
    genes[:, 0] = True
    # Who the parents are, is seen without crossing: mating does not depend on the crossover.
    plain = operators(without_mutation(crossover=crossover, crossover_rate=0.0), 75)
    pair = plain.breed(4, genes, np.arange(250)).reshape(-1, 2, 75)
    children = made.breed(4, genes, np.arange(250)).reshape(-1, 2, 75)
    assert (children.sum(axis=1) == pair.sum(axis=1)).all()
    assert (children != pair).any()


def test_crossover_happens_as_often_as_asked(operators):
    genes = parents(128)
    n_crossed = n_pairs = 0
    crossed = operators(without_mutation(crossover="uniform", crossover_rate=0.8), 128)
    plain = operators(without_mutation(crossover="uniform", crossover_rate=0.0), 128)
    for iteration in range(1, 9):
        a = plain.breed(iteration, genes, np.arange(250)).reshape(-1, 2, 128)
        b = crossed.breed(iteration, genes, np.arange(250)).reshape(-1, 2, 128)
        n_crossed += int((a != b).any(axis=(1, 2)).sum())
        n_pairs += len(a)
    assert stats.binomtest(n_crossed, n_pairs, 0.8).pvalue > P_LEAST


def exchanged_genes(operators, crossover, n_genes, iterations):
    """(pairs, N): where children differ from their parents, for parents that differ everywhere."""
    made = operators(settings(population=2, n_parents=2, crossover=crossover, crossover_rate=1.0,
                              individual_mutation_rate=0.0), n_genes)  # fmt: skip
    plain = operators(settings(population=2, n_parents=2, crossover=crossover, crossover_rate=0.0,
                               individual_mutation_rate=0.0), n_genes)  # fmt: skip
    alternating = np.arange(n_genes) % 2 == 0
    genes = np.stack([alternating, ~alternating])
    swaps = []
    for iteration in range(1, iterations + 1):
        before = plain.breed(iteration, genes, np.arange(2))
        after = made.breed(iteration, genes, np.arange(2))
        assert ((before != after)[0] == (before != after)[1]).all()
        swaps.append((before != after)[0])
    return np.array(swaps)


@pytest.mark.slow
def test_one_point_crossover_cuts_everywhere_equally_often(operators):
    swaps = exchanged_genes(operators, "one-point", 9, 400)
    # A tail from the cut on: never all, never nothing.
    assert (np.diff(swaps.astype(int), axis=1).clip(max=0) == 0).all()
    cuts = np.argmax(swaps, axis=1)
    assert set(cuts.tolist()) == set(range(1, 9))
    assert stats.chisquare(np.bincount(cuts, minlength=9)[1:]).pvalue > P_LEAST


@pytest.mark.slow
def test_two_point_crossover_exchanges_every_segment_equally_often(operators):
    swaps = exchanged_genes(operators, "two-point", 5, 600)
    padded = np.pad(swaps.astype(int), ((0, 0), (1, 1)))
    edges = np.abs(np.diff(padded, axis=1))
    assert (edges.sum(axis=1) == 2).all()
    segments = {}
    for row in edges:
        ends = tuple(np.flatnonzero(row).tolist())
        segments[ends] = segments.get(ends, 0) + 1
    assert len(segments) == 15  # two of six places
    assert stats.chisquare(list(segments.values())).pvalue > P_LEAST


@pytest.mark.slow
def test_uniform_crossover_exchanges_every_gene_half_of_the_time_independently(operators):
    swaps = exchanged_genes(operators, "uniform", 70, 300)
    assert stats.chisquare([swaps.sum(), (~swaps).sum()]).pvalue > P_LEAST
    # Neighbours, genes a word apart and genes of one block of random numbers go apart as often as together.
    for apart in (1, 4, 32):
        together = int((swaps[:, apart:] == swaps[:, :-apart]).sum())
        assert stats.binomtest(together, swaps[:, apart:].size, 0.5).pvalue > P_LEAST


# ---------------------------------------------------------------------------------------- mutation
def flips(operators, n_genes, iterations, **changes):
    """(offspring, N): what mutation flips, in parents that have every second gene."""
    chosen = settings(population=250, crossover_rate=0.0, **changes)
    made = operators(chosen, n_genes)
    genes = np.tile(np.arange(n_genes) % 2 == 0, (250, 1))
    return np.concatenate([made.breed(i, genes, np.arange(250)) != genes[0] for i in range(1, iterations + 1)])


def test_mutation_befalls_as_many_individuals_as_asked(operators):
    flipped = flips(operators, 40, 8, individual_mutation_rate=0.1, gene_mutation_rate=0.5)
    assert stats.binomtest(int(flipped.any(axis=1).sum()), len(flipped), 0.1).pvalue > P_LEAST


def test_mutation_flips_as_many_genes_as_asked_wherever_they_are(operators):
    flipped = flips(operators, 45, 8, individual_mutation_rate=1.0, gene_mutation_rate=0.02)
    assert stats.binomtest(int(flipped.sum()), flipped.size, 0.02).pvalue > P_LEAST
    assert stats.chisquare(flipped.sum(axis=0)).pvalue > P_LEAST
    # Genes flip one by one: the number in an individual is binomial.
    counts = np.bincount(np.minimum(flipped.sum(axis=1), 4), minlength=5)
    odds = stats.binom.pmf(np.arange(4), 45, 0.02)
    assert stats.chisquare(counts, np.append(odds, 1 - odds.sum()) * len(flipped)).pvalue > P_LEAST


@pytest.mark.parametrize(("individual", "gene"), [(0.0, 1.0), (1.0, 0.0)])
def test_mutation_of_rate_zero_changes_nothing(operators, individual, gene):
    flipped = flips(operators, 33, 2, individual_mutation_rate=individual, gene_mutation_rate=gene)
    assert not flipped.any()


def test_mutation_of_rate_one_flips_everything(operators):
    flipped = flips(operators, 33, 1, individual_mutation_rate=1.0, gene_mutation_rate=1.0)
    assert flipped.all()


def test_offspring_without_stations_get_one_random_gene(operators):
    chosen = settings(population=250, crossover_rate=0.0, individual_mutation_rate=1.0, gene_mutation_rate=1.0)
    made = operators(chosen, 12)
    everything = np.full((250, 12), True)
    children = np.concatenate([made.breed(i, everything, np.arange(250)) for i in range(1, 5)])
    assert (children.sum(axis=1) == 1).all()
    assert stats.chisquare(children.sum(axis=0)).pvalue > P_LEAST


# ------------------------------------------------------------------------------------- replacement
def labelled(n, first, n_genes=12):
    """Chromosomes that are their own number."""
    return (np.arange(first, first + n)[:, None] >> np.arange(n_genes) & 1).astype(bool)


@pytest.mark.parametrize("seed", range(4))
def test_stationary_replacement_leaves_the_best_of_both(operators, seed):
    rng = np.random.default_rng(seed)
    key, offspring_key = rng.integers(-5, 5, 30), rng.integers(-5, 5, 20)
    made = operators(settings(population=30, n_parents=20), 12)
    genes, left = made.replace(labelled(30, 1), key, labelled(20, 100), offspring_key)
    assert sorted(left) == sorted(np.concatenate([key, offspring_key]))[-30:]
    # Chromosomes go with their keys.
    of_label = dict(zip(range(1, 31), key, strict=True)) | dict(zip(range(100, 120), offspring_key, strict=True))
    labels = genes @ (1 << np.arange(12))
    assert [of_label[label] for label in labels.tolist()] == left.tolist()
    assert len(set(labels.tolist())) == 30


def test_stationary_replacement_keeps_individuals_that_offspring_only_equal(operators):
    made = operators(settings(population=6, n_parents=4), 12)
    genes, _ = made.replace(labelled(6, 1), np.full(6, 7), labelled(4, 100), np.full(4, 7))
    assert (genes == labelled(6, 1)).all()


def test_distinct_replacement_turns_away_what_is_there_already(operators):
    made = operators(settings(population=4, n_parents=4, distinct=True), 12)
    # Keys belong to chromosomes: 1 .. 4 are in the population; of 3, 100, 100 and 101 only one 100 and 101 may enter.
    offspring = np.concatenate([labelled(1, 3), labelled(1, 100), labelled(2, 100)])
    genes, left = made.replace(labelled(4, 1), np.array([1, 2, 30, 4]), offspring, np.array([30, 100, 100, 101]))
    assert sorted((genes @ (1 << np.arange(12))).tolist()) == [3, 4, 100, 101]
    assert sorted(left.tolist()) == [4, 30, 100, 101]


@pytest.mark.parametrize("n_elite", [0, 3])
def test_generational_replacement_keeps_the_elite_alone(operators, n_elite):
    rng = np.random.default_rng(5)
    key, offspring_key = rng.permutation(30), rng.permutation(30 - n_elite) - 100
    made = operators(settings(population=30, n_parents=20, replacement="generational", n_elite=n_elite), 12)
    genes, left = made.replace(labelled(30, 1), key, labelled(30 - n_elite, 100), offspring_key)
    labels = set((genes @ (1 << np.arange(12))).tolist())
    elite = {int(i) + 1 for i in np.argsort(-key)[:n_elite]}
    assert labels == elite | set(range(100, 130 - n_elite))
    assert sorted(left) == sorted([*offspring_key, *np.sort(key)[30 - n_elite :]])
