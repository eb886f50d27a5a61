/* Treelets: the lowest parts of the binary tree, of at most TREELET triangles, built anew from the top.
 *
 * Purpose    Clustering leaves blocks of eight little more than half full, and a block costs the same however full it is.
 *            Splits that count blocks fill them.
 * Algorithm  Sweep: triangles sorted by centroid along each axis; every split of each order is tried. Its cost is the sum
 *            over both sides of area times the number of blocks that the side needs (tree_cost.h has the area).
 *
 * Define   meaning                                                        example
 * TREELET  triangles of a treelet at most: 8 times 8, one full node       -DTREELET=64
 */
#ifndef TLSPLAN_TREE_TREELET_H
#define TLSPLAN_TREE_TREELET_H
#include "tree_cost.h"

#if TREELET != 64
#error "a split is kept as the bits of one ulong, and keys end in six bits: TREELET must be 64"
#endif

#define TREE_ARGUMENTS                                                                                               \
    global const float *vertices, global const int *corners, global const int *order, int n_triangles,               \
        global int *children, global uint *choices
#define TREE vertices, corners, order, n_triangles, children, choices

typedef struct {
    float4 low[TREELET], high[TREELET]; /* boxes of the triangles */
    int leaf[TREELET];                  /* their numbers as leaves of the binary tree */
    int inner[TREELET];                 /* numbers of the inner nodes, the treelet's root first */
    uchar sorted[3][TREELET];           /* triangles along each axis; a node owns the same range of all three */
    int count;
} Treelet;

/* What hangs below inner node `root`. */
static inline void gather_treelet(Treelet *treelet, TREE_ARGUMENTS, int root)
{
    int stack[TREELET];
    int size = 1, n_inner = 0, n = 0;
    stack[0] = n_triangles + root;
    while (size > 0) {
        const int id = stack[--size];
        if (id < n_triangles) {
            triangle_box(&treelet->low[n], &treelet->high[n], vertices, corners, order[id]);
            treelet->leaf[n++] = id;
        } else {
            const int node = id - n_triangles;
            treelet->inner[n_inner++] = node;
            stack[size++] = children[2 * node + 1];
            stack[size++] = children[2 * node];
        }
    }
    treelet->count = n;
}

/* Sort along the axes. A key is the centroid, from the lowest one on, with the triangle's number in place of its last bits,
 * so that no two are equal; the rank is how many keys are smaller. */
static inline void sort_treelet(Treelet *treelet)
{
    const int n = treelet->count, packs = (n + 7) / 8;
    float4 origin = treelet->low[0] + treelet->high[0];
    for (int i = 1; i < n; ++i) {
        const float4 centre = treelet->low[i] + treelet->high[i];
        origin = LEAST(centre, origin);
    }
    int8 keys[3][TREELET / 8];
    for (int i = 0; i < 8 * packs; ++i) {
        const float4 at = i < n ? treelet->low[i] + treelet->high[i] - origin : (float4)(INFINITY);
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

static inline float blocks_of(int n) { return (float)((n + WIDTH - 1) / WIDTH); }

/* The cheapest split of the n triangles from `first` on: returns how many go left along *axis. Ties: the lower axis, then
 * the smaller left side. */
static inline int find_split(const Treelet *treelet, int first, int n, int *axis)
{
    float best = INFINITY;
    int left = 1;
    *axis = 0;
    for (int a = 0; a < 3; ++a) {
        const uchar *sorted = treelet->sorted[a] + first;
        float right_cost[TREELET];
        float4 low = INFINITY, high = -INFINITY;
        for (int i = n - 1; i > 0; --i) {
            const int k = sorted[i];
            low = LEAST(treelet->low[k], low);
            high = MOST(treelet->high[k], high);
            right_cost[i] = met_area(low, high) * blocks_of(n - i);
        }
        low = INFINITY, high = -INFINITY;
        for (int i = 1; i < n; ++i) {
            const int k = sorted[i - 1];
            low = LEAST(treelet->low[k], low);
            high = MOST(treelet->high[k], high);
            const float cost = met_area(low, high) * blocks_of(i) + right_cost[i];
            if (cost < best) best = cost, left = i, *axis = a;
        }
    }
    return left;
}

/* Bring the first `left` triangles along `axis` to the front of the other two orders, which stay sorted on both sides. */
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

/* Split from the top. Node k gets the parts parts[k][]: >= 0: node, greater than k; < 0: ~triangle. Returns how many nodes. */
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

/* Build the treelet below inner node `root` anew. The numbers of its inner nodes stay, the root's among them, and get new
 * children and choices; `cost` (8) of the root is written. */
static inline void rebuild_treelet(float *cost, TREE_ARGUMENTS, int root)
{
    Treelet treelet;
    gather_treelet(&treelet, TREE, root);
    sort_treelet(&treelet);
    int parts[TREELET][2];
    const int n_nodes = split_treelet(&treelet, parts);
    float4 low[TREELET], high[TREELET];
    float costs[TREELET][WIDTH];
    for (int k = n_nodes - 1; k >= 0; --k) {
        const int node = treelet.inner[k];
        float4 side_low[2], side_high[2];
        float alone[2][WIDTH];
        const float *side_cost[2];
        for (int side = 0; side < 2; ++side) {
            const int c = parts[k][side];
            side_low[side] = c >= 0 ? low[c] : treelet.low[~c];
            side_high[side] = c >= 0 ? high[c] : treelet.high[~c];
            children[2 * node + side] = c >= 0 ? n_triangles + treelet.inner[c] : treelet.leaf[~c];
            side_cost[side] = c >= 0 ? costs[c] : alone[side];
            if (c < 0) triangle_cost(alone[side], met_area(side_low[side], side_high[side]));
        }
        low[k] = LEAST(side_low[0], side_low[1]);
        high[k] = MOST(side_high[0], side_high[1]);
        choices[node] = join_costs(costs[k], side_cost[0], side_cost[1], met_area(low[k], high[k]));
    }
    for (int s = 0; s < WIDTH; ++s) cost[s] = costs[0][s];
}

#endif
