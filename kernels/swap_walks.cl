/* Annealing of station sets: several walks, each exchanging one station after the other for a candidate.
 *
 * Purpose    Local search of selection (planner_core/select/swap_walks.py): sets of a fixed number of stations that miss
 *            as little as possible of what the targets require. Whole numbers alone, so that every device and the host
 *            walk the same way.
 * Algorithm  A step takes out a random station and tries up to TRIES candidates for its place. With m what the set misses
 *            in all, a candidate is taken where
 *
 *                m' - m <= t e,   e of an exponential distribution: the rule of Metropolis, exp(-(m' - m) / t), turned round
 *
 *            and the station goes back if none is. t falls step by step: heat[step * n_heats / n_steps].
 *            Three of four candidates are drawn from those that see nearly what the station sees, the others from all.
 *            m: for every target and each of the looks 1 .. seen_from that it asks for, the ticks that lack so many.
 *            NETWORK: besides, `penalty` for every component of the links among the set's stations beyond one a part,
 *            and with LOOPS for every bridge (slot_network.h); looked at only where the ticks alone would let a
 *            candidate in. Of eight candidates two are then drawn from those linked to a random station, one from all.
 * Layout     starts (N + 1), row: candidates' rows. class_of (R): rows that the same targets count are of one class.
 *            ticks (R). classes (K): bit c, target k counts class c. near (N, n_near). luck (4096): e in units of 2^-16.
 *            link_starts (N + 1), link: candidates that each is linked to.
 *
 * Define     meaning                        example
 * N_CLASSES  number of classes, 1 to 32     -DN_CLASSES=3
 * TRIES      candidates tried a step        -DTRIES=4
 * LEVELS     most looks a target asks for   -DLEVELS=1
 * NETWORK    stations are to be joined      -DNETWORK=0
 * LOOPS      without bridges, too           -DLOOPS=0
 */
#include "genetic_random.h"
#include "slot_network.h"

/* Ticks that the targets miss together, from the ticks of each class that are covered by 1 .. LEVELS looks. */
static inline long missing_of(global const long *required, global const int *seen_from, global const uint *classes,
                              int n_targets, const long *covered)
{
    long missing = 0;
    for (int k = 0; k < n_targets; ++k) {
        for (int look = 0; look < LEVELS && look < seen_from[k]; ++look) {
            long left = required[k];
            for (int c = 0; c < N_CLASSES; ++c) left -= (classes[k] >> c & 1u) != 0 ? covered[c * LEVELS + look] : 0;
            missing += max(left, 0L);
        }
    }
    return missing;
}

/* One work-item is one walk. NDRange (walks). Steps first_step .. last_step - 1 of n_steps; a walk that misses nothing
 * stops. sets (walks, n_set), distinct candidates: read and written, but for the first n_pinned, fewer than n_set. inside
 * (walks, N), count (walks, R): written, for use here alone; so are bits (walks, n_set, words), marks (walks, 5, n_set)
 * and n_in_part (walks, parts). missing (walks): written, what each set misses. */
kernel void swap_walks(global const int *starts, global const int *row, global const uchar *class_of,
                       global const long *ticks, int n_candidates, int n_rows, global const long *required,
                       global const int *seen_from, global const uint *classes, int n_targets, global const int *near,
                       int n_near, global const uint *luck, global const long *heat, int n_heats, ulong seed, int round,
                       int first_step, int last_step, int n_steps, int n_set, int n_pinned, global int *sets,
                       global uchar *inside, global ushort *count, global long *missing
#if NETWORK
                       , global const int *link_starts, global const int *link, global const uint *link_bits,
                       global const int *part, int n_parts, global const int *spared_starts, global const int *spared,
                       long penalty, global uint *bits, global int *marks, global int *n_in_part
#endif
)
{
    const int walk = get_global_id(0);
    sets += (size_t)walk * n_set;
    inside += (size_t)walk * n_candidates;
    count += (size_t)walk * n_rows;
    long covered[N_CLASSES * LEVELS], without[N_CLASSES * LEVELS], with[N_CLASSES * LEVELS];

    /* 1. How often each row is seen, and how much of each class. */
    for (int r = 0; r < n_rows; ++r) count[r] = 0;
    for (int i = 0; i < n_candidates; ++i) inside[i] = 0;
    for (int c = 0; c < N_CLASSES * LEVELS; ++c) covered[c] = 0;
    for (int place = 0; place < n_set; ++place) {
        inside[sets[place]] = 1;
        for (int e = starts[sets[place]]; e < starts[sets[place] + 1]; ++e) {
            const int looks = count[row[e]]++;
            if (looks < LEVELS) covered[class_of[row[e]] * LEVELS + looks] += ticks[row[e]];
        }
    }
    long least = missing_of(required, seen_from, classes, n_targets, covered);
#if NETWORK
    const int words = (n_set + 31) / 32, link_words = (n_candidates + 31) / 32;
    int n_parts_used = 0;
    bits += (size_t)walk * n_set * words;
    marks += (size_t)walk * 5 * n_set;
    n_in_part += (size_t)walk * n_parts;
    for (int p = 0; p < n_set * words; ++p) bits[p] = 0;
    for (int p = 0; p < n_parts; ++p) n_in_part[p] = 0;
    for (int place = 0; place < n_set; ++place) {
        link_place(bits, words, place, sets, place, link_bits, link_words);
        n_parts_used += n_in_part[part[sets[place]]]++ == 0;
    }
#if LOOPS
#define FAULTS() components_and_bridges(bits, n_set, words, sets, part, n_in_part, spared_starts, spared, marks)
#else
#define FAULTS() components_of(bits, n_set, words, marks, (global uint *)marks + n_set)
#endif
    least += penalty * (FAULTS() - n_parts_used);
#endif

    for (int step = first_step; step < last_step && least > 0; ++step) {
        /* 2. One station goes. */
        const long warmth = heat[(long)step * n_heats / n_steps];
        const int place = n_pinned + below(philox((uint4)(round, step, walk, 0), seed).x, n_set - n_pinned);
        const int out = sets[place];
        for (int c = 0; c < N_CLASSES * LEVELS; ++c) without[c] = covered[c];
        for (int e = starts[out]; e < starts[out + 1]; ++e) {
            const int r = row[e], looks = --count[r];
            if (looks < LEVELS) without[class_of[r] * LEVELS + looks] -= ticks[r];
        }
#if NETWORK
        unlink_place(bits, words, place);
        n_parts_used -= --n_in_part[part[out]] == 0;
#endif
        /* 3. One comes: the first that is let in. */
        int in = out;
        for (int draw = 1; draw <= TRIES && in == out; ++draw) {
            const uint4 x = philox((uint4)(round, step, walk, draw), seed);
#if NETWORK
            const int way = below(x.x, 8);
            int other = way == 0 ? (int)below(x.y, n_candidates) : near[(size_t)out * n_near + below(x.y, n_near)];
            if (way == 1 || way == 2) {
                const int from = sets[below(x.w, n_set)], n_links = link_starts[from + 1] - link_starts[from];
                if (n_links == 0) continue;
                other = link[link_starts[from] + below(x.y, n_links)];
            }
#else
            const int other = below(x.x, 4) != 0 ? near[(size_t)out * n_near + below(x.y, n_near)]
                                                 : (int)below(x.y, n_candidates);
#endif
            if (inside[other]) continue;
            for (int c = 0; c < N_CLASSES * LEVELS; ++c) with[c] = without[c];
            for (int e = starts[other]; e < starts[other + 1]; ++e) {
                const int r = row[e], looks = count[r];
                if (looks < LEVELS) with[class_of[r] * LEVELS + looks] += ticks[r];
            }
            long then = missing_of(required, seen_from, classes, n_targets, with);
            const long most = least + ((warmth * (long)luck[x.z >> 20]) >> 16);
            if (then > most) continue;
#if NETWORK
            sets[place] = other;
            link_place(bits, words, place, sets, n_set, link_bits, link_words);
            const int is_first = n_in_part[part[other]]++ == 0;
            then += penalty * (FAULTS() - n_parts_used - is_first);
            if (then > most) {
                unlink_place(bits, words, place);
                --n_in_part[part[other]];
                sets[place] = out;
                continue;
            }
            n_parts_used += is_first;
#endif
            in = other;
            least = then;
            for (int c = 0; c < N_CLASSES * LEVELS; ++c) covered[c] = with[c];
        }
        /* 4. Whoever it is counts. */
        for (int e = starts[in]; e < starts[in + 1]; ++e) ++count[row[e]];
        sets[place] = in;
        inside[out] = 0;
        inside[in] = 1;
#if NETWORK
        if (in == out) {
            link_place(bits, words, place, sets, n_set, link_bits, link_words);
            n_parts_used += n_in_part[part[out]]++ == 0;
        }
#endif
    }
    missing[walk] = least;
}
