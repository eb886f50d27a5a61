/* Parts: which patches of a triangle the hits of a whole tile lie on.
 *
 * Purpose    What `resolve` (hit.h) gives hit by hit, for visibility, which asks for the patches alone: the same, bit for bit.
 * Algorithm  All hits on one triangle of WINDOW packets go down together, part by part of the triangle, depth first. A part's
 *            edges are the same for all its hits: they are scalars, and a packet's step is one comparison. Steps of
 *            packets do not wait for one another.
 *
 * Define     meaning                                                                   example
 * WINDOW     packets whose hits are looked at together, at most 32, a divisor of a tile's  -DWINDOW=8
 */
#ifndef TLSPLAN_PATCH_PARTS_H
#define TLSPLAN_PATCH_PARTS_H
#include "hit.h"

#ifndef WINDOW
#define WINDOW (PACKETS <= 32 ? PACKETS : PACKETS % 32 == 0 ? 32 : PACKETS % 16 == 0 ? 16 : 8)
#endif
/* Depth at most: a scene has less than 2^31 patches. */
#define DEEPEST 30

/* A part of a triangle after `level` bisections. */
typedef struct {
    float q01, q12, q20; /* squared edges, m^2 */
    int number;          /* 1 is the whole, 2 n and 2 n + 1 are the children of n: 2^level + code */
    int level;
    int slot0, slot1, slot2; /* where the weights of its vertices 0, 1, 2 are */
    uint packets;            /* those that hit it, by bit */
} Part;

/* One bisection of a part: *second becomes child 1, and *part child 0, with the packets that hit them. weight and number
 * (that of the part that a lane's hit lies on) of those hits go on to the child's. */
static inline void part_at_middle(Part *part, Part *second, lanes_f (*weight)[WINDOW], lanes_i *number)
{
    /* 1, 2: name the longest edge ab; a tie goes to 01, then 12, then 20 */
    const float q01 = part->q01, q12 = part->q12, q20 = part->q20;
    const bool is12 = q12 >= q20, is01 = q01 >= MOST(q12, q20);
    const int a = is01 ? part->slot0 : is12 ? part->slot1 : part->slot2;
    const int b = is01 ? part->slot1 : is12 ? part->slot2 : part->slot0;
    const int c = is01 ? part->slot2 : is12 ? part->slot0 : part->slot1;
    const float qab = is01 ? q01 : is12 ? q12 : q20;
    const float qbc = is01 ? q12 : is12 ? q20 : q01;
    const float qca = is01 ? q20 : is12 ? q01 : q12;
    /* 3, 4: m is the middle of ab; child 0 = (a, m, c), child 1 = (m, b, c) */
    const float quarter = 0.25f * qab, qcm = to_middle_1(qca, qbc, quarter);
    const lanes_i own = part->number, child = 2 * own;
    lanes_i in_first = 0, in_second = 0;
    for (uint left = part->packets; left; left &= left - 1) {
        const int k = lowest_bit(left);
        const lanes_i bit = (int)(left & -left);
        const lanes_f la = weight[a][k], lb = weight[b][k];
        const lanes_i mine = MASK(number[k] == own), first = MASK(la >= lb);
        weight[a][k] = PICK(mine, PICK(first, la - lb, 2.0f * la), la);
        weight[b][k] = PICK(mine, PICK(first, 2.0f * lb, lb - la), lb);
        /* 5 */
        number[k] = PICK(mine, PICK(first, child, child + 1), number[k]);
        in_first |= mine & first & bit;
        in_second |= mine & ~first & bit;
    }
    part->q01 = quarter, part->q12 = qcm, part->q20 = qca;
    part->number *= 2, part->level += 1;
    part->slot0 = a, part->slot1 = b, part->slot2 = c;
    part->packets = any_bits(in_first);
    *second = *part;
    second->q12 = qbc, second->q20 = qcm;
    second->number += 1;
    second->packets = any_bits(in_second);
}

/* Which parts of a triangle, bisected `depth` times, hold the hits whose `number` is 1: *seen gets their codes, each once;
 * returns how many. weight[i][k]: of vertex i, packet k; overwritten, as `number` is. q: squared edges 01, 12, 20, m^2, float32
 * from the host. packets: those with such hits, by bit, at least one. */
static inline int parts_hit(lanes_f (*weight)[WINDOW], lanes_i *number, uint packets, global const float *q, int depth,
                            int *seen)
{
    Part waiting[DEEPEST + 1];
    Part part = {q[0], q[1], q[2], 1, 0, 0, 1, 2, packets};
    int n_waiting = 0, n_seen = 0;
    for (;;) {
        if (part.level < depth) {
            part_at_middle(&part, &waiting[n_waiting], weight, number);
            n_waiting += waiting[n_waiting].packets != 0;
            if (part.packets) continue;
        } else {
            seen[n_seen++] = part.number - (1 << depth);
        }
        if (n_waiting == 0) return n_seen;
        part = waiting[--n_waiting];
    }
}

/* Packets `from` .. WINDOW - 1 of which a lane is on triangle `one`, by bit. `number` becomes 1 in those lanes and 0 in the
 * others; they are taken off `todo`, which is -1 where nothing is left to do. */
static inline uint take_triangle(lanes_i *todo, int from, int one, lanes_i *number)
{
    lanes_i packets = 0;
    for (int k = from; k < WINDOW; ++k) {
        const lanes_i mine = MASK(todo[k] == one);
        packets |= mine & (1 << k);
        number[k] = mine & 1;
        todo[k] |= mine;
    }
    return any_bits(packets);
}

#endif
