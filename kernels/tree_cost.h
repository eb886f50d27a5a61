/* The tree's building material: boxes of triangles, and what wide nodes cost.
 *
 * Cost       Of a tree: the sum over its nodes and blocks of the area by which beams meet them, times NODE_COST or BLOCK_COST
 *            (surface area heuristic). A node costs the same however many of its eight children are
 *            there, a block the same however many triangles. What meets a box is not a line but a tile of beams, so that
 *            boxes count as BEAM_WIDTH larger along each axis: without it, boxes far smaller than a tile look cheap.
 * Wide nodes cost[s - 1], s = 1 .. 7, is the least cost of a cluster of triangles hung into at most s places of a wide node
 *            (s = 1: as a block, or as a node of its own); cost[7] is the cluster's number of triangles. Costs of
 *            a cluster follow from those of its two halves (dynamic programming after Ylitie, Karras and Laine 2017).
 * Choices    of a cluster: bit 0: it is a block, if it hangs in one place. Three bits from 3 s - 5 on, s = 2 .. 8: how many of
 *            s places the left half gets; 0: no more than s - 1 are of use.
 */
#ifndef TLSPLAN_TREE_COST_H
#define TLSPLAN_TREE_COST_H
#include "lanes.h"

#define WIDTH 8
/* Metres. A tile of 8 x 32 HDL-64E beams is 0.1 to 0.2 m wide at 3 m; from 0.05 to 0.3 m trees are much the same. */
#define BEAM_WIDTH 0.1f
/* Of one visit, in one unit; from a half to twice the ratio trees are much the same. */
#define NODE_COST 1.0f
#define BLOCK_COST 1.0f

/* Box of triangle t. vertices (V, 3) metres, local frame; corners (T, 3) into them. w is 0. */
static inline void triangle_box(float4 *low, float4 *high, global const float *vertices, global const int *corners, int t)
{
    global const float *a = vertices + 3 * (size_t)corners[3 * (size_t)t];
    global const float *b = vertices + 3 * (size_t)corners[3 * (size_t)t + 1];
    global const float *c = vertices + 3 * (size_t)corners[3 * (size_t)t + 2];
    const float4 va = (float4)(a[0], a[1], a[2], 0.0f);
    const float4 vb = (float4)(b[0], b[1], b[2], 0.0f);
    const float4 vc = (float4)(c[0], c[1], c[2], 0.0f);
    const float4 low_ab = LEAST(va, vb), high_ab = MOST(va, vb);
    *low = LEAST(low_ab, vc);
    *high = MOST(high_ab, vc);
}

/* Half the area of a box, as a tile of beams meets it. */
static inline float met_area(float4 low, float4 high)
{
    const float4 d = high - low + BEAM_WIDTH;
    return d.x * d.y + (d.x + d.y) * d.z;
}

/* Costs of one triangle alone. */
static inline float8 triangle_cost(float area)
{
    float8 cost = BLOCK_COST * area;
    cost.s7 = 1.0f;
    return cost;
}

/* Lanes moved up by one; infinity comes after them. */
static inline float8 up_one(float8 x)
{
    float8 y = x.s00123456;
    y.s0 = INFINITY;
    return y;
}

/* Costs of two clusters' union, whose area is given; returns the choices. Ties: a block before a node, the fewest places,
 * the smallest left share. All numbers of places s = 1 .. 8 at once, lane s - 1. */
static inline uint join_costs(float8 *joint, float8 left, float8 right, float area)
{
    /* Least cost in at most s places with at least one for each half; the left one gets `share` of them. */
    float8 shifted = up_one(right), divided = left.s0 + shifted;
    int8 share = 1;
#define TRY_SHARE(k, cost)                                                                                            \
    do {                                                                                                              \
        shifted = up_one(shifted);                                                                                    \
        const float8 other = cost + shifted;                                                                          \
        share = PICK(other < divided, (int8)(k), share);                                                              \
        divided = LEAST(other, divided);                                                                              \
    } while (0)
    TRY_SHARE(2, left.s1);
    TRY_SHARE(3, left.s2);
    TRY_SHARE(4, left.s3);
    TRY_SHARE(5, left.s4);
    TRY_SHARE(6, left.s5);
    TRY_SHARE(7, left.s6);
#undef TRY_SHARE
    const float count = left.s7 + right.s7;
    const float as_node = NODE_COST * area + divided.s7;
    const float as_block = count <= (float)WIDTH ? BLOCK_COST * area : INFINITY;
    /* Least of all with no more places: prefix minima in three steps. */
    float8 least = divided;
    least.s0 = LEAST(as_block, as_node);
    const float8 one = up_one(least), of_two = LEAST(one, least);
    const float8 two = of_two.s00012345, of_four = LEAST(two, of_two);
    const float8 four = of_four.s00000123, all = LEAST(four, of_four);
    /* Where one place less costs no more, nothing is divided; into eight places always. */
    int8 bits = share << (int8)(0, 1, 4, 7, 10, 13, 16, 19);
    bits = PICK(divided < up_one(all), bits, (int8)(0));
    bits.s7 = share.s7 << 19;
    bits.s0 = as_block <= as_node;
    const int4 half4 = bits.lo | bits.hi;
    const int2 half2 = half4.lo | half4.hi;
    *joint = all;
    joint->s7 = count;
    return (uint)(half2.x | half2.y);
}

#endif
