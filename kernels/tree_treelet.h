/* Treelets: parts of the binary tree, of at most TREELET units, built anew from the top.
 *
 * Purpose    Clustering leaves blocks of eight little more than half full, and a block costs the same however full it is.
 *            Splits that count blocks fill them; and near the root, where clusters are large, they part better than
 *            neighbourhood along a curve does.
 * Algorithm  Sweep: units sorted by centroid along each axis; every split of each order is tried. Its cost is the sum over
 *            both sides of area times the number of blocks that the side's triangles need (tree_cost.h has the area).
 * Units      A triangle is a unit, and so is every treelet when it is finished: treelets of treelets reach up to the root.
 *            A unit that is a treelet has bit UNIT in the choices of its root; until it is built anew bit PENDING, too, and
 *            its level.
 * Layout     units (T) float8: at first the box of every leaf of the binary tree, low.xyz0 high.xyz0. A finished treelet
 *            needs those of its leaves no longer: its box takes the place of its first leaf's, its costs (tree_cost.h) that
 *            of its last leaf's. Other names: see tree_merge.cl.
 */
#ifndef TLSPLAN_TREE_TREELET_H
#define TLSPLAN_TREE_TREELET_H
#include "tree_cost.h"

/* 8 times 8 triangles are one full node. A split is kept as the bits of a ulong: not more than 64. A power of two. */
#define TREELET 64
#define UNIT 0x80000000u
#define PENDING 0x40000000u

#define TREE_ARGUMENTS int n_triangles, global int *halves, global uint *choices, global float8 *units
#define TREE n_triangles, halves, choices, units

typedef struct {
    float8 box[TREELET];                /* of the units: low, -high, so that a union is one minimum */
    int weight[TREELET];                /* their triangles */
    int unit[TREELET];                  /* their numbers in the binary tree */
    int inner[TREELET];                 /* inner nodes above them, the treelet's root first */
    uchar sorted[3][TREELET];           /* units along each axis; a node owns the same range of all three */
    int count;
} Treelet;

static inline int first_leaf(TREE_ARGUMENTS, int id)
{
    while (id >= n_triangles) id = halves[2 * (id - n_triangles)];
    return id;
}

static inline int last_leaf(TREE_ARGUMENTS, int id)
{
    while (id >= n_triangles) id = halves[2 * (id - n_triangles) + 1];
    return id;
}

static inline void add_unit(Treelet *treelet, TREE_ARGUMENTS, int id)
{
    const int n = treelet->count++;
    const float8 box = units[first_leaf(TREE, id)];
    treelet->box[n] = (float8)(box.lo, -box.hi);
    treelet->weight[n] = id < n_triangles ? 1 : (int)units[last_leaf(TREE, id)].s7;
    treelet->unit[n] = id;
}

/* What hangs below inner node `root`. */
static inline void gather_treelet(Treelet *treelet, TREE_ARGUMENTS, int root)
{
    int stack[TREELET];
    int size = 1, n_inner = 0;
    stack[0] = n_triangles + root;
    treelet->count = 0;
    while (size > 0) {
        const int id = stack[--size], node = id - n_triangles;
        if (node < 0 || (node != root && (choices[node] & UNIT))) {
            add_unit(treelet, TREE, id);
        } else {
            treelet->inner[n_inner++] = node;
            stack[size++] = halves[2 * node + 1];
            stack[size++] = halves[2 * node];
        }
    }
}

/* Sort along the axes. A key is the centroid, from the lowest one on, with the unit's number in place of its last bits,
 * so that no two are equal; the rank is how many keys are smaller. */
static inline void sort_treelet(Treelet *treelet)
{
    const int n = treelet->count, packs = (n + 7) / 8;
    float4 origin = treelet->box[0].lo - treelet->box[0].hi;
    for (int i = 1; i < n; ++i) {
        const float4 centre = treelet->box[i].lo - treelet->box[i].hi;
        origin = LEAST(centre, origin);
    }
    int8 keys[3][TREELET / 8];
    for (int i = 0; i < 8 * packs; ++i) {
        const float4 at = i < n ? treelet->box[i].lo - treelet->box[i].hi - origin : (float4)(INFINITY);
        const int4 key = (as_int4(at) & ~(TREELET - 1)) | i;
        ((int *)keys[0])[i] = key.x;
        ((int *)keys[1])[i] = key.y;
        ((int *)keys[2])[i] = key.z;
    }
    for (int a = 0; a < 3; ++a) {
        for (int i = 0; i < n; ++i) {
            const int8 own = ((const int *)keys[a])[i];
            int8 smaller = 0; /* minus how many, since true is -1 */
            for (int p = 0; p < packs; ++p) smaller += keys[a][p] < own;
            const int4 half4 = smaller.lo + smaller.hi;
            const int2 half2 = half4.lo + half4.hi;
            treelet->sorted[a][-(half2.x + half2.y)] = (uchar)i;
        }
    }
}

/* Half the area of a box (low, -high), as `met_area`. */
static inline float met_area8(float8 box)
{
    const float4 d = BEAM_WIDTH - (box.lo + box.hi);
    return d.x * d.y + (d.x + d.y) * d.z;
}

/* One side of a split, as it grows along an axis. */
typedef struct {
    float8 box;
    int weight;
} Side;

/* Add a unit; returns what the side costs. */
static inline float grow(Side *side, const Treelet *treelet, int k)
{
    side->weight += treelet->weight[k];
    side->box = LEAST(treelet->box[k], side->box);
    return met_area8(side->box) * (float)((side->weight + WIDTH - 1) / WIDTH);
}

/* Keep a split if it is cheaper. No branch: it would be a guess. */
static inline void keep_split(float *best, int *left, float cost, int i)
{
    const int cheaper = -(cost < *best);
    *left = (i & cheaper) | (*left & ~cheaper);
    *best = LEAST(cost, *best);
}

/* The cheapest split of the n units from `first` on: returns how many go left along *axis. Ties: the lower axis, then
 * the smaller left side. The three axes side by side, since each step waits for the one before it. */
static inline int find_split(const Treelet *treelet, int first, int n, int *axis)
{
    const uchar *xs = treelet->sorted[0] + first, *ys = treelet->sorted[1] + first, *zs = treelet->sorted[2] + first;
    float right_x[TREELET], right_y[TREELET], right_z[TREELET];
    Side x = {INFINITY, 0}, y = {INFINITY, 0}, z = {INFINITY, 0};
    for (int i = n - 1; i > 0; --i) {
        right_x[i] = grow(&x, treelet, xs[i]);
        right_y[i] = grow(&y, treelet, ys[i]);
        right_z[i] = grow(&z, treelet, zs[i]);
    }
    x.box = y.box = z.box = INFINITY;
    x.weight = y.weight = z.weight = 0;
    float best_x = INFINITY, best_y = INFINITY, best_z = INFINITY;
    int left_x = 1, left_y = 1, left_z = 1;
    for (int i = 1; i < n; ++i) {
        keep_split(&best_x, &left_x, grow(&x, treelet, xs[i - 1]) + right_x[i], i);
        keep_split(&best_y, &left_y, grow(&y, treelet, ys[i - 1]) + right_y[i], i);
        keep_split(&best_z, &left_z, grow(&z, treelet, zs[i - 1]) + right_z[i], i);
    }
    const bool is_y = best_y < best_x, is_z = best_z < (is_y ? best_y : best_x);
    *axis = is_z ? 2 : is_y;
    return is_z ? left_z : is_y ? left_y : left_x;
}

/* Bring the first `left` units along `axis` to the front of the other two orders, which stay sorted on both sides. */
static inline void part_orders(Treelet *treelet, int first, int n, int axis, int left)
{
    ulong goes_left = 0;
    for (int i = 0; i < left; ++i) goes_left |= 1UL << treelet->sorted[axis][first + i];
    for (int a = 0; a < 3; ++a) {
        if (a == axis) continue;
        uchar *sorted = treelet->sorted[a] + first;
        uchar rest[TREELET];
        int n_left = 0, n_rest = 0;
        for (int i = 0; i < n; ++i) {
            const uchar k = sorted[i];
            const int is_left = (int)(goes_left >> k & 1UL);
            sorted[n_left] = k;
            rest[n_rest] = k;
            n_left += is_left;
            n_rest += 1 - is_left;
        }
        for (int i = 0; i < n_rest; ++i) sorted[n_left + i] = rest[i];
    }
}

/* Split from the top. Node k is parted into parts[k][0] and [1]: >= 0: a node, greater than k; < 0: ~unit. Returns how many
 * nodes. */
static inline int split_treelet(Treelet *treelet, int (*parts)[2])
{
    uchar first[TREELET], count[TREELET];
    int n_nodes = 1;
    first[0] = 0;
    count[0] = (uchar)treelet->count;
    for (int k = 0; k < n_nodes; ++k) {
        const int from = first[k], n = count[k];
        int left = 1, axis = 0;
        if (n > 2) {
            left = find_split(treelet, from, n, &axis);
            part_orders(treelet, from, n, axis, left);
        }
        for (int side = 0; side < 2; ++side) {
            const int at = side ? from + left : from, size = side ? n - left : left;
            if (size == 1) {
                parts[k][side] = ~(int)treelet->sorted[0][at];
            } else {
                first[n_nodes] = (uchar)at;
                count[n_nodes] = (uchar)size;
                parts[k][side] = n_nodes++;
            }
        }
    }
    return n_nodes;
}

/* Costs of a unit. */
static inline float8 unit_cost(const Treelet *treelet, TREE_ARGUMENTS, int k)
{
    if (treelet->unit[k] >= n_triangles) return units[last_leaf(TREE, treelet->unit[k])];
    return triangle_cost(met_area8(treelet->box[k]));
}

/* Build the treelet below inner node `root` anew, and make it a unit. Its inner nodes keep their numbers, the root among
 * them, and get new halves and choices. */
static inline void finish_treelet(TREE_ARGUMENTS, int root)
{
    Treelet treelet;
    gather_treelet(&treelet, TREE, root);
    sort_treelet(&treelet);
    int parts[TREELET][2];
    float8 box[TREELET], cost[TREELET];
    for (int k = split_treelet(&treelet, parts) - 1; k >= 0; --k) {
        const int node = treelet.inner[k];
        float8 part_box[2], part_cost[2];
        for (int side = 0; side < 2; ++side) {
            const int part = parts[k][side];
            part_box[side] = part >= 0 ? box[part] : treelet.box[~part];
            part_cost[side] = part >= 0 ? cost[part] : unit_cost(&treelet, TREE, ~part);
            halves[2 * node + side] = part >= 0 ? n_triangles + treelet.inner[part] : treelet.unit[~part];
        }
        box[k] = LEAST(part_box[0], part_box[1]);
        choices[node] = join_costs(&cost[k], part_cost[0], part_cost[1], met_area8(box[k]));
    }
    choices[root] |= UNIT;
    units[first_leaf(TREE, n_triangles + root)] = (float8)(box[0].lo, -box[0].hi);
    units[last_leaf(TREE, n_triangles + root)] = cost[0];
}

#endif
