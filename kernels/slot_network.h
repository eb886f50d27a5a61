/* Whether a set of stations hangs together: components and bridges of the links among its places.
 *
 * Purpose    kernels/swap_walks.cl asks it of sets that change by one station a step. planner_core/select/network.py says
 *            what counts and does the same on the host.
 * Layout     bits (n_set, words), words = n_set / 32 rounded up: bit p % 32 of word p / 32 of row q, places p and q are
 *            linked. link_bits (N, link_words): the same of candidates. n_in_part (parts): places of each part.
 *            spared_starts (N + 1), spared: bridges of the candidates' graph itself, which no choice of stations avoids.
 */
#ifndef TLSPLAN_SLOT_NETWORK_H
#define TLSPLAN_SLOT_NETWORK_H

static inline int lowest_bit(uint word) { return 31 - (int)clz(word & (0u - word)); }

/* Clear the links of one place. */
static inline void unlink_place(global uint *bits, int words, int place)
{
    for (int w = 0; w < words; ++w) {
        for (uint left = bits[place * words + w]; left != 0; left &= left - 1)
            bits[(w * 32 + lowest_bit(left)) * words + place / 32] &= ~(1u << (place & 31));
        bits[place * words + w] = 0;
    }
}

/* Set the links of the candidate at one place, which has none, to those at the first n places. */
static inline void link_place(global uint *bits, int words, int place, global const int *sets, int n,
                              global const uint *link_bits, int link_words)
{
    global const uint *linked = link_bits + (size_t)sets[place] * link_words;
    for (int p = 0; p < n; ++p) {
        if (p == place || (linked[sets[p] / 32] >> (sets[p] & 31) & 1u) == 0) continue;
        bits[place * words + p / 32] |= 1u << (p & 31);
        bits[p * words + place / 32] |= 1u << (place & 31);
    }
}

static inline int linked_from(global const uint *row, int first, int n)
{
    for (int w = first / 32; w * 32 < n; ++w) {
        const uint left = w == first / 32 ? row[w] & (~0u << (first & 31)) : row[w];
        if (left != 0) return w * 32 + lowest_bit(left);
    }
    return n;
}

/* Components of the places. queue (n_set), seen (words): for use here alone. */
static inline int components_of(global const uint *bits, int n_set, int words, global int *queue, global uint *seen)
{
    int components = 0;
    for (int w = 0; w < words; ++w) seen[w] = 0;
    for (int root = 0; root < n_set; ++root) {
        if ((seen[root / 32] >> (root & 31) & 1u) != 0) continue;
        ++components;
        seen[root / 32] |= 1u << (root & 31);
        queue[0] = root;
        for (int head = 0, tail = 1; head < tail; ++head) {
            global const uint *row = bits + queue[head] * words;
            for (int w = 0; w < words; ++w) {
                uint fresh = row[w] & ~seen[w];
                seen[w] |= fresh;
                for (; fresh != 0; fresh &= fresh - 1) queue[tail++] = w * 32 + lowest_bit(fresh);
            }
        }
    }
    return components;
}

/* Components, and bridges that might be avoided: links whose failure splits a component, in parts of three places or
 * more, but for bridges of the candidates' graph. Depth first, without recursion (Tarjan 1974): a link to a place from
 * which nothing before it can be reached another way is a bridge. marks (4, n_set): for use here alone. */
static inline int components_and_bridges(global const uint *bits, int n_set, int words, global const int *sets,
                                         global const int *part, global const int *n_in_part,
                                         global const int *spared_starts, global const int *spared, global int *marks)
{
    global int *found = marks, *low = marks + n_set, *parent = marks + 2 * n_set, *next = marks + 3 * n_set;
    int faults = 0, time = 0;
    for (int p = 0; p < n_set; ++p) found[p] = 0;
    for (int root = 0; root < n_set; ++root) {
        if (found[root] != 0) continue;
        ++faults;
        found[root] = low[root] = ++time;
        parent[root] = -1;
        next[root] = 0;
        for (int p = root; p >= 0;) {
            const int other = linked_from(bits + p * words, next[p], n_set);
            if (other < n_set) {
                next[p] = other + 1;
                if (found[other] == 0) {
                    found[other] = low[other] = ++time;
                    parent[other] = p;
                    next[other] = 0;
                    p = other;
                } else if (other != parent[p]) {
                    low[p] = min(low[p], found[other]);
                }
                continue;
            }
            const int above = parent[p];
            if (above >= 0) {
                low[above] = min(low[above], low[p]);
                if (low[p] > found[above] && n_in_part[part[sets[p]]] > 2) {
                    int avoidable = 1;
                    for (int e = spared_starts[sets[p]]; e < spared_starts[sets[p] + 1]; ++e)
                        if (spared[e] == sets[above]) avoidable = 0;
                    faults += avoidable;
                }
            }
            p = above;
        }
    }
    return faults;
}

#endif
