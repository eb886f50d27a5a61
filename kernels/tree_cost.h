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

/* Costs of two clusters' union, whose area is given; returns the choices. Ties: a block before a node, the fewest places,
 * the smallest left share. */
static inline uint join_costs(float8 *joint, float8 left8, float8 right8, float area)
{
    const float *left = (const float *)&left8, *right = (const float *)&right8;
    float *cost = (float *)joint;
    uint choices = 0;
    float divided[WIDTH + 1]; /* least cost in at most s places with at least one for each half */
    for (int s = 2; s <= WIDTH; ++s) {
        float best = left[0] + right[s - 2];
        uint share = 1;
        for (int k = 2; k < s; ++k) {
            const float other = left[k - 1] + right[s - k - 1];
            if (other < best) best = other, share = k;
        }
        divided[s] = best;
        choices |= share << (3 * s - 5);
    }
    const float count = left[WIDTH - 1] + right[WIDTH - 1];
    const float as_node = NODE_COST * area + divided[WIDTH];
    const float as_block = count <= (float)WIDTH ? BLOCK_COST * area : INFINITY;
    if (as_block <= as_node) choices |= 1;
    cost[0] = LEAST(as_block, as_node);
    for (int s = 2; s < WIDTH; ++s) {
        const bool divide = divided[s] < cost[s - 2];
        cost[s - 1] = divide ? divided[s] : cost[s - 2];
        if (!divide) choices &= ~(7u << (3 * s - 5));
    }
    cost[WIDTH - 1] = count;
    return choices;
}

#endif
