/* Genetic selection: everything but coverage. Docs: docs/method/genetic-selection.md.
 *
 * Purpose    The whole loop on the device: random start, mating pool, crossover, mutation, ranking, replacement, the best
 *            solution and the decision to stop. The host queues generations and looks at `state` now and then.
 * Source     López et al. 2023, section 3.6 and Table 3. planner_core/paper/genetic/operators.py is the same in NumPy, and gives
 *            the same bits: whole numbers alone, random numbers by counter (genetic_random.h).
 *
 * A generation   fill_pool -> breed -> mend -> cover (genetic_cover.cl) -> judge -> find_twins, bar_twins if asked for
 *                -> rank -> replace_worst or replace_all -> rank -> note_best. Once state[STOPPED] is set all of them
 *                return at once, so that generations queued too many change nothing.
 *
 * Layout     genes (n, W) uint, W = ceil(N / 32): bit g % 32 of word g / 32 is candidate g, bits from N on are 0.
 *            facts (3, n) long: key (greater is better), ticks covered, stations. order (n): individuals, best first.
 *            rules: RULE_ below, ulong. state: STATE_ below, int.
 */
#include "genetic_random.h"

#define RULE_SEED 0
#define RULE_GENES 1       /* N */
#define RULE_POPULATION 2  /* P */
#define RULE_PARENTS 3     /* size of the mating pool */
#define RULE_OFFSPRING 4
#define RULE_ELITE 5       /* individuals that generational replacement keeps */
#define RULE_TOURNAMENT 6  /* individuals a tournament; 0: elitist selection */
#define RULE_CROSSOVER 7   /* 1 one-point, 2 two-point, 3 uniform */
#define RULE_CROSS 8       /* numbers below these count as hits, of 2^32 */
#define RULE_MUTATE 9
#define RULE_FLIP 10
#define RULE_RATE_LOW 11   /* a random individual's rate of active genes, of 2^32 */
#define RULE_RATE_SPAN 12
#define RULE_OBJECTIVE 13  /* 0 fewest, 1 coverage-at-most-n, 2 eq9 */
#define RULE_STATIONS 14   /* for coverage-at-most-n */
#define RULE_TOTAL 15      /* ticks of all rows */
#define RULE_SHIFT 16      /* for eq9 */
#define RULE_PATIENCE 17
#define RULE_ITERATIONS 18
#define RULE_RING 19

#define STATE_ITERATION 0 /* -1 before the first ranking */
#define STATE_IMPROVED 1  /* iteration of the last improvement */
#define STATE_STOPPED 2   /* 0 runs, 1 no improvement, 2 iterations */

#define KEY 0
#define COVERED 1
#define ACTIVE 2
#define FACTS 3

static inline int words_of(global const ulong *rules) { return (int)((rules[RULE_GENES] + 31) / 32); }

static inline uint4 draw(global const ulong *rules, global const int *state, uint purpose, uint individual, uint block)
{
    return philox((uint4)((uint)(state[STATE_ITERATION] + 1), purpose, individual, block), rules[RULE_SEED]);
}

/* A word whose bits are set with the odds of `hit` of 2^32 each, without those from N on. */
static inline uint random_word(global const ulong *rules, global const int *state, uint purpose, uint individual,
                               int word, ulong hit)
{
    const int left = (int)rules[RULE_GENES] - 32 * word;
    if (hit == 0) return 0;
    const uint4 most = (uint4)((uint)(hit - 1));
    uint bits = 0;
    for (int quad = 0; quad < 8 && 4 * quad < left; ++quad) {
        const uint4 x = draw(rules, state, purpose, individual, (uint)(8 * word + quad));
        const int4 hits = (x <= most) & (int4)(1, 2, 4, 8);
        bits |= (uint)(hits.x | hits.y | hits.z | hits.w) << (4 * quad);
    }
    return left < 32 ? bits & ~(~0u << left) : bits;
}

/* Copy given individuals to the front of the population.
 * One work-item is all: they are few. NDRange (1). given (n_given, W); genes: rows before n_given are written. */
kernel void take_given(global const ulong *rules, int n_given, global const uint *given, global uint *genes)
{
    for (int word = 0; word < n_given * words_of(rules); ++word) genes[word] = given[word];
}

/* Fill the individuals after the given ones: each has a rate of active genes of its own, drawn evenly.
 * One work-item is one individual. NDRange (P - n_given). genes: rows from n_given on are written. */
kernel void start_population(global const ulong *rules, global const int *state, int n_given, global uint *genes)
{
    const int individual = get_global_id(0) + n_given, words = words_of(rules);
    const uint number = draw(rules, state, DRAW_RATE, individual, 0).x;
    const ulong rate = rules[RULE_RATE_LOW] + (((ulong)number * rules[RULE_RATE_SPAN]) >> 32);
    for (int word = 0; word < words; ++word)
        genes[(size_t)individual * words + word] = random_word(rules, state, DRAW_GENE, individual, word, rate);
}

/* Choose the mating pool: winners of tournaments, or the best.
 * One work-item is a run of places. NDRange (any). pool (n_parents) written. A tournament draws RANKS, with replacement:
 * everybody has one, so that the least rank drawn is the winner's. */
kernel void fill_pool(global const ulong *rules, global const int *state, global const int *order, global int *pool)
{
    if (state[STATE_STOPPED]) return;
    const int n_parents = (int)rules[RULE_PARENTS], size = (int)rules[RULE_TOURNAMENT];
    for (int place = get_global_id(0); place < n_parents; place += get_global_size(0)) {
        uint best = size == 0 ? (uint)place : ~0u;
        for (int block = 0; 4 * block < size; ++block) {
            const uint4 x = draw(rules, state, DRAW_TOURNAMENT, place, block);
            for (int k = 0; k < 4 && 4 * block + k < size; ++k) {
                const uint rank = below(word_of(x, k), (uint)rules[RULE_POPULATION]);
                best = rank < best ? rank : best;
            }
        }
        pool[place] = order[best];
    }
}

/* Bits of a word that lie in genes first .. end - 1. */
static inline uint segment(int word, uint first, uint end)
{
    const uint low = 32u * word;
    const uint from = first <= low ? ~0u : first >= low + 32 ? 0u : ~0u << (first - low);
    const uint to = end <= low ? 0u : end >= low + 32 ? ~0u : ~(~0u << (end - low));
    return from & to;
}

/* What the two children of a pair exchange: genes first .. end - 1, or at random. */
typedef struct {
    uint first, end;
    bool at_random;
} Exchange;

static inline Exchange exchange_of(global const ulong *rules, global const int *state, uint pair, bool crossed)
{
    const uint n = (uint)rules[RULE_GENES];
    Exchange exchange = {0, 0, false};
    if (!crossed) return exchange;
    exchange.at_random = rules[RULE_CROSSOVER] == 3;
    if (exchange.at_random) return exchange;
    const uint4 x = draw(rules, state, DRAW_CUT, pair, 0);
    if (rules[RULE_CROSSOVER] == 1) {
        exchange.first = 1 + below(x.x, n - 1);
        exchange.end = n;
        return exchange;
    }
    /* Two different ones of the n + 1 places where a chromosome can be cut, its ends included. */
    const uint a = below(x.x, n + 1), other = below(x.y, n), b = other + (other >= a);
    exchange.first = a < b ? a : b;
    exchange.end = a < b ? b : a;
    return exchange;
}

/* Cross pairs of the pool, and mutate the children.
 * One work-item is some words of some pairs. NDRange (any, any): words by pairs. offspring (n_offspring, W) written, each
 * word once; children 2 p and 2 p + 1 are those of pair p. */
kernel void breed(global const ulong *rules, global const int *state, global const int *pool, global const uint *genes,
                  global uint *offspring)
{
    if (state[STATE_STOPPED]) return;
    const int words = words_of(rules), n_offspring = (int)rules[RULE_OFFSPRING];
    const uint n_parents = (uint)rules[RULE_PARENTS];
    for (int pair = get_global_id(1); 2 * pair < n_offspring; pair += get_global_size(1)) {
        /* 1. Two different places of the pool, and what they exchange. */
        const uint4 mate = draw(rules, state, DRAW_MATE, pair, 0);
        const uint one = below(mate.x, n_parents), step = 1 + below(mate.y, n_parents - 1);
        const uint two = one + step < n_parents ? one + step : one + step - n_parents;
        global const uint *mother = genes + (size_t)pool[one] * words, *father = genes + (size_t)pool[two] * words;
        const Exchange exchange = exchange_of(rules, state, pair, mate.z < rules[RULE_CROSS]);
        for (int child = 2 * pair; child < 2 * pair + 2 && child < n_offspring; ++child) {
            const ulong flip = draw(rules, state, DRAW_MUTATE, child, 0).x < rules[RULE_MUTATE] ? rules[RULE_FLIP] : 0;
            global const uint *own = child & 1 ? father : mother, *partner = child & 1 ? mother : father;
            for (int word = get_global_id(0); word < words; word += get_global_size(0)) {
                uint swap = segment(word, exchange.first, exchange.end);
                if (exchange.at_random) swap = word_of(draw(rules, state, DRAW_MIX, pair, word / 4), word % 4);
                const uint bits = (own[word] & ~swap) | (partner[word] & swap);
                /* 2. Flip genes. */
                offspring[(size_t)child * words + word] =
                    bits ^ random_word(rules, state, DRAW_FLIP, child, word, flip);
            }
        }
    }
}

/* Set bits of a word. Operators: PoCL 3.0 leaves popcount a call. */
static inline int bits_set(uint word)
{
    word -= (word >> 1) & 0x55555555u;
    word = (word & 0x33333333u) + ((word >> 2) & 0x33333333u);
    return (int)((((word + (word >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24);
}

/* Count the stations of n individuals; one without any gets a random one.
 * One work-item is some individuals. NDRange (any). genes changed where all were 0; facts: stations written. */
kernel void mend(global const ulong *rules, global const int *state, int n, global uint *genes, global long *facts)
{
    if (state[STATE_STOPPED]) return;
    const int words = words_of(rules);
    for (int individual = get_global_id(0); individual < n; individual += get_global_size(0)) {
        global uint *own = genes + (size_t)individual * words;
        int active = 0;
        for (int word = 0; word < words; ++word) active += bits_set(own[word]);
        if (active == 0) {
            const uint gene = below(draw(rules, state, DRAW_MEND, individual, 0).x, (uint)rules[RULE_GENES]);
            own[gene / 32] = 1u << (gene % 32);
            active = 1;
        }
        facts[(size_t)n * ACTIVE + individual] = active;
    }
}

/* The key of the objectives: see planner_core/paper/genetic/objective.py. missing: ticks that targets lack, added up. */
static inline long key_of(global const ulong *rules, long covered, long active, long missing)
{
    const long n = (long)rules[RULE_GENES], total = (long)rules[RULE_TOTAL];
    if (rules[RULE_OBJECTIVE] == 2) return (long)(((ulong)covered << rules[RULE_SHIFT]) / (ulong)active);
    if (rules[RULE_OBJECTIVE] == 1) {
        const long most = (long)rules[RULE_STATIONS];
        return active <= most ? covered * (n + 1) + (n - active) : most - active;
    }
    return missing == 0 ? (n - active) * (total + 1) + covered : -(missing * (n + 1) + active);
}

/* Add up what `cover` left of each individual, and turn it into facts.
 * One work-item is some individuals. NDRange (any). sums (n, n_tiles, n_slots) ulong; facts: key and ticks written.
 * class_of (n_tiles): class of each tile's rows. counts (n_targets, n_classes): 1 where a target counts a class.
 * required (n_targets) ticks. */
kernel void judge(global const ulong *rules, global const int *state, int n, global const ulong *sums, int n_tiles,
                  int n_slots, global const int *class_of, global const uchar *counts, int n_classes,
                  global const long *required, int n_targets, global long *facts)
{
    if (state[STATE_STOPPED]) return;
    for (int individual = get_global_id(0); individual < n; individual += get_global_size(0)) {
        global const ulong *own = sums + (size_t)individual * n_tiles * n_slots;
        long covered = 0, missing = 0;
        for (int i = 0; i < n_tiles * n_slots; ++i) covered += (long)own[i];
        for (int target = 0; target < n_targets; ++target) {
            long lacks = required[target];
            for (int tile = 0; tile < n_tiles; ++tile)
                if (counts[target * n_classes + class_of[tile]])
                    for (int slot = 0; slot < n_slots; ++slot) lacks -= (long)own[tile * n_slots + slot];
            missing += lacks > 0 ? lacks : 0;
        }
        facts[(size_t)n * KEY + individual] = key_of(rules, covered, facts[(size_t)n * ACTIVE + individual], missing);
        facts[(size_t)n * COVERED + individual] = covered;
    }
}

/* Order n individuals by key, the best first; of equals the lower number.
 * One work-item ranks some individuals. NDRange (any). order (n) written, each entry once: ranks are all different. */
kernel void rank(global const int *state, global const long *facts, int n, global int *order)
{
    if (state[STATE_STOPPED]) return;
    global const long *keys = facts + (size_t)n * KEY;
    for (int individual = get_global_id(0); individual < n; individual += get_global_size(0)) {
        const long key = keys[individual];
        long better = 0;
        for (int i = 0; i < individual; ++i) better += keys[i] >= key;
        for (int i = individual + 1; i < n; ++i) better += keys[i] > key;
        order[better] = individual;
    }
}

/* Whether two individuals have the same stations; their facts are compared first. */
static inline bool are_twins(global const ulong *rules, global const uint *a, global const uint *b)
{
    for (int word = 0; word < words_of(rules); ++word)
        if (a[word] != b[word]) return false;
    return true;
}

/* Find offspring that equal an individual of the population or an offspring of lower number.
 * One work-item looks at some offspring. NDRange (any). twin (n_offspring) int written: 1 or 0. */
kernel void find_twins(global const ulong *rules, global const int *state, global const uint *genes,
                       global const long *facts, global const uint *offspring, global const long *offspring_facts,
                       global int *twin)
{
    if (state[STATE_STOPPED]) return;
    const int n = (int)rules[RULE_POPULATION], n_offspring = (int)rules[RULE_OFFSPRING], words = words_of(rules);
    for (int i = get_global_id(0); i < n_offspring; i += get_global_size(0)) {
        global const uint *own = offspring + (size_t)i * words;
        const long key = offspring_facts[i];
        int found = 0;
        for (int k = 0; k < n && !found; ++k)
            if (facts[k] == key) found = are_twins(rules, own, genes + (size_t)k * words);
        for (int k = 0; k < i && !found; ++k)
            if (offspring_facts[k] == key) found = are_twins(rules, own, offspring + (size_t)k * words);
        twin[i] = found;
    }
}

/* Give twins the least key of all: they replace nobody.
 * One work-item is some offspring. NDRange (any). offspring_facts: keys of twins changed. */
kernel void bar_twins(global const ulong *rules, global const int *state, global const int *twin,
                      global long *offspring_facts)
{
    if (state[STATE_STOPPED]) return;
    for (int i = get_global_id(0); i < (int)rules[RULE_OFFSPRING]; i += get_global_size(0))
        if (twin[i]) offspring_facts[i] = LONG_MIN;
}

/* Overwrite individual `to` of the population by offspring `from`. */
static inline void take(global const ulong *rules, global const uint *offspring, global const long *offspring_facts,
                        int from, global uint *genes, global long *facts, int to)
{
    const int words = words_of(rules);
    for (int word = 0; word < words; ++word) genes[(size_t)to * words + word] = offspring[(size_t)from * words + word];
    for (int fact = 0; fact < FACTS; ++fact)
        facts[rules[RULE_POPULATION] * fact + to] = offspring_facts[rules[RULE_OFFSPRING] * fact + from];
}

/* Stationary replacement: the best offspring takes the place of the worst individual if it is better, the second best
 * that of the second worst, and so on: what is left are the best of both together.
 * One work-item is some offspring. NDRange (any). genes, facts changed, each individual by one work-item. */
kernel void replace_worst(global const ulong *rules, global const int *state, global const int *order,
                          global const int *offspring_order, global const uint *offspring,
                          global const long *offspring_facts, global uint *genes, global long *facts)
{
    if (state[STATE_STOPPED]) return;
    const int n = (int)rules[RULE_POPULATION], n_offspring = (int)rules[RULE_OFFSPRING];
    for (int i = get_global_id(0); i < n_offspring; i += get_global_size(0)) {
        const int from = offspring_order[i], to = order[n - 1 - i];
        if (offspring_facts[from] > facts[to]) take(rules, offspring, offspring_facts, from, genes, facts, to);
    }
}

/* Generational replacement: offspring take the places of all but the best individuals.
 * One work-item is some offspring. NDRange (any). As above. */
kernel void replace_all(global const ulong *rules, global const int *state, global const int *order,
                        global const uint *offspring, global const long *offspring_facts, global uint *genes,
                        global long *facts)
{
    if (state[STATE_STOPPED]) return;
    const int n_offspring = (int)rules[RULE_OFFSPRING], n_elite = (int)rules[RULE_ELITE];
    for (int i = get_global_id(0); i < n_offspring; i += get_global_size(0))
        take(rules, offspring, offspring_facts, i, genes, facts, order[n_elite + i]);
}

/* Keep the best solution so far, count the iteration, decide whether to stop.
 * One work-item is all. NDRange (1). history (ring, 3) long: facts of the best so far after the last iterations, that of
 * iteration i in row i % ring; one row is written. best (W): its genes. */
kernel void note_best(global const ulong *rules, global int *state, global const int *order, global const uint *genes,
                      global const long *facts, global long *history, global uint *best)
{
    if (state[STATE_STOPPED]) return;
    const int iteration = state[STATE_ITERATION] + 1, words = words_of(rules);
    const int ring = (int)rules[RULE_RING];
    global long *now = history + FACTS * (iteration % ring);
    global const long *before = history + FACTS * ((iteration + ring - 1) % ring);
    const bool improved = iteration == 0 || facts[order[0]] > before[KEY];
    for (int fact = 0; fact < FACTS; ++fact)
        now[fact] = improved ? facts[rules[RULE_POPULATION] * fact + order[0]] : before[fact];
    if (improved) {
        for (int word = 0; word < words; ++word) best[word] = genes[(size_t)order[0] * words + word];
        state[STATE_IMPROVED] = iteration;
    }
    state[STATE_ITERATION] = iteration;
    if (iteration - state[STATE_IMPROVED] >= (int)rules[RULE_PATIENCE]) state[STATE_STOPPED] = 1;
    else if (iteration >= (int)rules[RULE_ITERATIONS]) state[STATE_STOPPED] = 2;
}
