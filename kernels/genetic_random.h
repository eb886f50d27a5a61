/* Random numbers by counter: Philox4x32-10, the same in planner_core/paper/genetic/philox.py.
 *
 * Purpose    A number is a function of (seed, iteration, purpose, individual, draw), in whole numbers alone: the same on
 *            every device, in any order, with nothing carried on.
 * Source     Salmon, Moraes, Dror, Shaw 2011: constants and rounds of Philox4x32 with 10 rounds.
 */
#ifndef TLSPLAN_GENETIC_RANDOM_H
#define TLSPLAN_GENETIC_RANDOM_H

/* planner_core.paper.genetic.philox.Purpose */
#define DRAW_RATE 0
#define DRAW_GENE 1
#define DRAW_TOURNAMENT 2
#define DRAW_MATE 3
#define DRAW_CUT 4
#define DRAW_MIX 5
#define DRAW_MUTATE 6
#define DRAW_FLIP 7
#define DRAW_MEND 8

static inline uint4 philox(uint4 x, ulong seed)
{
    uint k0 = (uint)seed, k1 = (uint)(seed >> 32);
    for (int round = 0; round < 10; ++round) {
        const ulong p0 = (ulong)x.x * 0xD2511F53u, p1 = (ulong)x.z * 0xCD9E8D57u;
        x = (uint4)((uint)(p1 >> 32) ^ x.y ^ k0, (uint)p1, (uint)(p0 >> 32) ^ x.w ^ k1, (uint)p0);
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    return x;
}

/* 0 .. n - 1, each within n / 2^32 of equally often. */
static inline uint below(uint number, uint n) { return (uint)(((ulong)number * n) >> 32); }

static inline uint word_of(uint4 x, int word) { return word == 0 ? x.x : word == 1 ? x.y : word == 2 ? x.z : x.w; }

#endif
