/* Patch addresses: which part of a triangle a hit lies on, by the rule of docs/method/patches.md.
 *
 * Purpose    The host's `planner_core.scene.patches.patch_code`, lane for lane and bit for bit.
 * Rule       Repeated bisection at the longest edge; the state is the barycentric weights and three squared edges.
 */
#ifndef TLSPLAN_PATCH_H
#define TLSPLAN_PATCH_H
#include "lanes.h"

/* (2 q_ca + 2 q_bc - q_ab) / 4 in two steps. Products by powers of two are exact: fused or not, the bits are the same. */
static inline lanes_f to_middle(lanes_f qca, lanes_f qbc, lanes_f quarter)
{
    _Pragma("OPENCL FP_CONTRACT ON") return 0.5f * (qca + qbc) - quarter;
}

/* Path of `depth` bits. l0, l1, l2 weights; q01, q12, q20 squared edges in m^2, float32 from the host. */
static inline lanes_i patch_code(lanes_f l0, lanes_f l1, lanes_f l2, lanes_f q01, lanes_f q12, lanes_f q20, int depth)
{
    lanes_i code = 0;
    for (int level = 0; level < depth; ++level) {
        /* 1, 2: name the longest edge ab; a tie goes to 01, then 12, then 20 */
        const lanes_f others = MOST(q12, q20);
        const lanes_i is01 = MASK(q01 >= others);
        const lanes_i is12 = MASK(q12 >= q20);
        const lanes_f la = PICK(is01, l0, PICK(is12, l1, l2));
        const lanes_f lb = PICK(is01, l1, PICK(is12, l2, l0));
        const lanes_f lc = PICK(is01, l2, PICK(is12, l0, l1));
        const lanes_f qab = PICK(is01, q01, PICK(is12, q12, q20));
        const lanes_f qbc = PICK(is01, q12, PICK(is12, q20, q01));
        const lanes_f qca = PICK(is01, q20, PICK(is12, q01, q12));
        /* 3, 4: m is the middle of ab; child 0 = (a, m, c), child 1 = (m, b, c) */
        const lanes_f quarter = 0.25f * qab, qcm = to_middle(qca, qbc, quarter);
        const lanes_i first = MASK(la >= lb);
        l0 = PICK(first, la - lb, 2.0f * la);
        l1 = PICK(first, 2.0f * lb, lb - la);
        l2 = lc;
        q01 = quarter;
        q12 = PICK(first, qcm, qbc);
        q20 = PICK(first, qca, qcm);
        /* 5 */
        code = 2 * code + (1 + first);
    }
    return code;
}

#endif
