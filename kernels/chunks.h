/* Chunks: work on n elements divided among work-items that each take a run of neighbours.
 *
 * A CPU gets some chunks a core, a GPU thousands (planner_core.device.sort). Results do not depend on their number: what
 * chunks hand on are counts, and the counts' prefix sums give every element its place in one long row.
 */
#ifndef TLSPLAN_CHUNKS_H
#define TLSPLAN_CHUNKS_H

/* First of the n elements of a chunk; first_of(n_chunks, ...) = n. */
static inline int first_of(int chunk, int n_chunks, int n) { return (int)((ulong)n * (ulong)chunk / (ulong)n_chunks); }

/* One work-item sums the counts of all chunks, two kinds of them. NDRange (1). counts (n_chunks + 1, 2) in place: row 0
 * gets the totals, row c + 1 (the counts of chunk c) the sums of the chunks before c. */
#define DEFINE_SUM_COUNTS                                                                                             \
    kernel void sum_counts(global int *counts, int n_chunks)                                                          \
    {                                                                                                                 \
        int first = 0, second = 0;                                                                                    \
        for (int c = 1; c <= n_chunks; ++c) {                                                                         \
            const int own_first = counts[2 * c], own_second = counts[2 * c + 1];                                      \
            counts[2 * c] = first;                                                                                    \
            counts[2 * c + 1] = second;                                                                               \
            first += own_first;                                                                                       \
            second += own_second;                                                                                     \
        }                                                                                                             \
        counts[0] = first;                                                                                            \
        counts[1] = second;                                                                                           \
    }

#endif
