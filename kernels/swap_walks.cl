/* Annealing of station sets: several walks, each exchanging one station after the other for a candidate.
 *
 * Purpose    Local search of selection (planner_core/select/swap_walks.py): sets of a fixed number of stations that miss
 *            as little as possible of what the targets require. Whole numbers alone, so that every device and the host
 *            walk the same way.
 * Algorithm  A step takes out a random station and tries up to TRIES candidates for its place. With m what the targets miss
 *            in all, a candidate is taken where
 *
 *                m' - m <= t e,   e of an exponential distribution: the rule of Metropolis, exp(-(m' - m) / t), turned round
 *
 *            and the station goes back if none is. t falls step by step: heat[step * n_heats / n_steps].
 *            Three of four candidates are drawn from those that see nearly what the station sees, the others from all.
 * Layout     starts (N + 1), row: candidates' rows. class_of (R): rows that the same targets count are of one class.
 *            ticks (R). classes (K): bit c, target k counts class c. near (N, n_near). luck (4096): e in units of 2^-16.
 *
 * Define     meaning                        example
 * N_CLASSES  number of classes, 1 to 32     -DN_CLASSES=3
 * TRIES      candidates tried a step        -DTRIES=4
 */
#include "genetic_random.h"

/* Ticks that the targets miss together, from the ticks covered of each class. */
static inline long missing_of(global const long *required, global const uint *classes, int n_targets, const long *covered)
{
    long missing = 0;
    for (int k = 0; k < n_targets; ++k) {
        long left = required[k];
        for (int c = 0; c < N_CLASSES; ++c) left -= (classes[k] >> c & 1u) != 0 ? covered[c] : 0;
        missing += max(left, 0L);
    }
    return missing;
}

/* One work-item is one walk. NDRange (walks). Steps first_step .. last_step - 1 of n_steps; a walk that misses nothing
 * stops. sets (walks, n_set), distinct candidates: read and written. inside (walks, N), count (walks, R): written, for use
 * here alone. missing (walks): written, what each set misses. */
kernel void swap_walks(global const int *starts, global const int *row, global const uchar *class_of,
                       global const long *ticks, int n_candidates, int n_rows, global const long *required,
                       global const uint *classes, int n_targets, global const int *near, int n_near,
                       global const uint *luck, global const long *heat, int n_heats, ulong seed, int round,
                       int first_step, int last_step, int n_steps, int n_set, global int *sets, global uchar *inside,
                       global ushort *count, global long *missing)
{
    const int walk = get_global_id(0);
    sets += (size_t)walk * n_set;
    inside += (size_t)walk * n_candidates;
    count += (size_t)walk * n_rows;
    long covered[N_CLASSES], without[N_CLASSES], with[N_CLASSES];

    /* 1. How often each row is seen, and how much of each class. */
    for (int r = 0; r < n_rows; ++r) count[r] = 0;
    for (int i = 0; i < n_candidates; ++i) inside[i] = 0;
    for (int c = 0; c < N_CLASSES; ++c) covered[c] = 0;
    for (int place = 0; place < n_set; ++place) {
        inside[sets[place]] = 1;
        for (int e = starts[sets[place]]; e < starts[sets[place] + 1]; ++e)
            if (count[row[e]]++ == 0) covered[class_of[row[e]]] += ticks[row[e]];
    }
    long least = missing_of(required, classes, n_targets, covered);

    for (int step = first_step; step < last_step && least > 0; ++step) {
        /* 2. One station goes. */
        const long warmth = heat[(long)step * n_heats / n_steps];
        const int place = below(philox((uint4)(round, step, walk, 0), seed).x, n_set), out = sets[place];
        for (int c = 0; c < N_CLASSES; ++c) without[c] = covered[c];
        for (int e = starts[out]; e < starts[out + 1]; ++e) {
            const int r = row[e];
            if (--count[r] == 0) without[class_of[r]] -= ticks[r];
        }
        /* 3. One comes: the first that is let in. */
        int in = out;
        for (int draw = 1; draw <= TRIES && in == out; ++draw) {
            const uint4 x = philox((uint4)(round, step, walk, draw), seed);
            const int other = below(x.x, 4) != 0 ? near[(size_t)out * n_near + below(x.y, n_near)]
                                                 : (int)below(x.y, n_candidates);
            if (inside[other]) continue;
            for (int c = 0; c < N_CLASSES; ++c) with[c] = without[c];
            for (int e = starts[other]; e < starts[other + 1]; ++e) {
                const int r = row[e];
                if (count[r] == 0) with[class_of[r]] += ticks[r];
            }
            const long then = missing_of(required, classes, n_targets, with);
            if (then - least > (warmth * (long)luck[x.z >> 20]) >> 16) continue;
            in = other;
            least = then;
            for (int c = 0; c < N_CLASSES; ++c) covered[c] = with[c];
        }
        /* 4. Whoever it is counts. */
        for (int e = starts[in]; e < starts[in + 1]; ++e) ++count[row[e]];
        sets[place] = in;
        inside[out] = 0;
        inside[in] = 1;
    }
    missing[walk] = least;
}
