/* Patch addresses: which part of a triangle a hit lies on, by the rule of docs/method/patches.md.
 *
 * Purpose    The host's `planner_core.scene.patches.patch_code`, lane for lane and bit for bit.
 * Rule       Repeated bisection at the longest edge; the state is the barycentric weights and three squared edges.
 */
#ifndef TLSPLAN_PATCH_H
#define TLSPLAN_PATCH_H
#include "lanes.h"

/* Packets whose hits are looked at at a time, a divisor of 8. */
#ifndef TOGETHER
#define TOGETHER 2
#endif
/* Unrolled, since only then packets stay in registers; LLVM 14 does not see that by itself. */
#define EACH_PACKET(k) _Pragma("unroll") for (int k = 0; k < TOGETHER; ++k)

/* (2 q_ca + 2 q_bc - q_ab) / 4 in two steps. Products by powers of two are exact: fused or not, the bits are the same. */
#define DEFINE_TO_MIDDLE(name, type)                                                                                   \
    static inline type name(type qca, type qbc, type quarter)                                                         \
    {                                                                                                                 \
        _Pragma("OPENCL FP_CONTRACT ON") return 0.5f * (qca + qbc) - quarter;                                         \
    }
DEFINE_TO_MIDDLE(to_middle, lanes_f)
DEFINE_TO_MIDDLE(to_middle_1, float)

/* Where the bisection of a triangle stands: weights l0, l1, l2 and squared edges q01, q12, q20 (m^2) of the part that holds
 * each lane's hit, and the path to it. */
typedef struct {
    lanes_f l0, l1, l2, q01, q12, q20;
    lanes_i code;
} Bisection;

static inline void bisect(Bisection *at)
{
    const lanes_f l0 = at->l0, l1 = at->l1, l2 = at->l2, q01 = at->q01, q12 = at->q12, q20 = at->q20;
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
    at->l0 = PICK(first, la - lb, 2.0f * la);
    at->l1 = PICK(first, 2.0f * lb, lb - la);
    at->l2 = lc;
    at->q01 = quarter;
    at->q12 = PICK(first, qcm, qbc);
    at->q20 = PICK(first, qca, qcm);
    /* 5 */
    at->code = 2 * at->code + (1 + first);
}

/* Paths of `depth` bits, of TOGETHER packets: each step of a packet waits for the one before it, and the other packets'
 * fill the waiting. */
static inline void patch_codes(Bisection *of_packet, int depth)
{
    for (int level = 0; level < depth; ++level)
        EACH_PACKET(k) bisect(of_packet + k);
}

#endif
