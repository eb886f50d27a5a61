/* Patch addresses: which part of a triangle a hit lies on, by the rule of docs/method/patches.md.
 *
 * Purpose    The host's `planner_core.scene.patches.patch_code`, lane for lane and bit for bit.
 * Rule       Repeated bisection at the longest edge; the state is the barycentric weights and three squared edges.
 */
#ifndef TLSPLAN_PATCH_H
#define TLSPLAN_PATCH_H
#include "lanes.h"

/* Path of `depth` bits. l0, l1, l2 weights; q01, q12, q20 squared edges in m^2, float32 from the host. */
static inline lanes_i patch_code(lanes_f l0, lanes_f l1, lanes_f l2, lanes_f q01, lanes_f q12, lanes_f q20, int depth)
{
    lanes_i code = 0;
    for (int level = 0; level < depth; ++level) {
        /* 1, 2: name the longest edge ab; a tie goes to 01, then 12, then 20 */
        const lanes_i is01 = MASK(q01 >= q12) & MASK(q01 >= q20);
        const lanes_i is12 = MASK(q12 >= q20);
        const lanes_f la = select(select(l2, l1, is12), l0, is01);
        const lanes_f lb = select(select(l0, l2, is12), l1, is01);
        const lanes_f lc = select(select(l1, l0, is12), l2, is01);
        const lanes_f qab = select(select(q20, q12, is12), q01, is01);
        const lanes_f qbc = select(select(q01, q20, is12), q12, is01);
        const lanes_f qca = select(select(q12, q01, is12), q20, is01);
        /* 3, 4: m is the middle of ab; child 0 = (a, m, c), child 1 = (m, b, c) */
        const lanes_f qcm = (2.0f * qca + 2.0f * qbc - qab) / 4.0f;
        const lanes_i first = MASK(la >= lb);
        l0 = select(2.0f * la, la - lb, first);
        l1 = select(lb - la, 2.0f * lb, first);
        l2 = lc;
        q01 = qab / 4.0f;
        q12 = select(qbc, qcm, first);
        q20 = select(qcm, qca, first);
        /* 5 */
        code = 2 * code + (1 + first);
    }
    return code;
}

#endif
