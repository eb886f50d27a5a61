/* Building the tree, second stage: clusters along the Morton curve are merged, pair by pair, into one binary tree.
 *
 * Algorithm  PLOC (Meister and Bittner 2018): every cluster finds the nearest of its neighbours along the curve; those that
 *            find each other merge; the others wait for the next round. Two changes. Distance is not the area of the union
 *            alone: long unions count as larger (COMPACT), since boxes that reach far in depth keep a scan from meeting
 *            what is in front first. And distances that differ in their last bits alone are equal; among equals the pair
 *            decides whose places differ least as numbers i ^ j. Regular meshes have no end of equal distances; with the
 *            lower place as the tie-break ONE pair a round would merge in a row of them, so every second pair does.
 * Progress   The pair of least (distance, i ^ j) of all is mutual: every round merges.
 * Treelets   What is clustered is split anew, 64 units at a time (tree_treelet.h): when two clusters together have more, each
 *            of them becomes one unit of the next level. That is noted in a root's choices, and done when all clusters are
 *            merged: a level's treelets share nothing, so that they are one launch.
 * Launches   While there are many clusters a round is four launches and a count that the host waits for. The last some
 *            thousands take dozens of rounds of little work: one work-item does them in one launch.
 * Indices    Leaf i of the binary tree is triangle order[i]; inner node k has the number n_triangles + k and the halves
 *            halves[2 k], halves[2 k + 1]; a node's number is greater than those of its halves until it is built anew.
 *            Clusters: boxes (6, stride), see tree_clusters.h; id (n), number in the binary tree; size (n), level times 128
 *            plus units.
 *            Launched by planner_core.engine.tree. NDRange (n_chunks) unless said otherwise, any local size.
 *
 * Define   meaning                                                              example
 * PAD      see tree_clusters.h; at least radius + LANES                         -DPAD=32
 * LANES    clusters that look for neighbours side by side                       -DLANES=8
 */
#include "chunks.h"
#include "tree_clusters.h"
#include "tree_treelet.h"

#if LANES == 1
#define LANE_NUMBERS 0
#define BITS(x) as_int(x)
#elif LANES == 8
#define LANE_NUMBERS ((int8)(0, 1, 2, 3, 4, 5, 6, 7))
#define BITS(x) as_int8(x)
#else
#error "LANES must be 1 or 8"
#endif
#define FARTHEST 0x7fffffff
/* Share of the squared diagonal in the distance. 0: a tenth more blocks met in a scan; 0.15 to 1: much the same. */
#define COMPACT 0.3f

/* A packet of neighbours begins anywhere. */
typedef lanes_f lanes_anywhere __attribute__((aligned(4)));
#define LOAD_ANYWHERE(p) (*(global const lanes_anywhere *)(p))

/* The nearest of the clusters [from, end), from a multiple of LANES. */
static inline void find_for(global const float *boxes, int stride, int n, int radius, int coarse, int from, int end,
                            global int *nearest)
{
    global const float *x0 = boxes + PAD, *y0 = x0 + stride, *z0 = y0 + stride;
    global const float *x1 = z0 + stride, *y1 = x1 + stride, *z1 = y1 + stride;
    for (int i = from; i < end; i += LANES) {
        const lanes_f ax0 = LOAD_ANYWHERE(x0 + i), ay0 = LOAD_ANYWHERE(y0 + i), az0 = LOAD_ANYWHERE(z0 + i);
        const lanes_f ax1 = LOAD_ANYWHERE(x1 + i), ay1 = LOAD_ANYWHERE(y1 + i), az1 = LOAD_ANYWHERE(z1 + i);
        const lanes_i place = i + LANE_NUMBERS;
        lanes_i best = FARTHEST, best_pair = FARTHEST;
        for (int offset = -radius; offset <= radius; ++offset) {
            if (offset == 0) continue;
            const int j = i + offset;
            const lanes_f bx0 = LOAD_ANYWHERE(x0 + j), by0 = LOAD_ANYWHERE(y0 + j), bz0 = LOAD_ANYWHERE(z0 + j);
            const lanes_f bx1 = LOAD_ANYWHERE(x1 + j), by1 = LOAD_ANYWHERE(y1 + j), bz1 = LOAD_ANYWHERE(z1 + j);
            const lanes_f x = MOST(ax1, bx1) - LEAST(ax0, bx0);
            const lanes_f y = MOST(ay1, by1) - LEAST(ay0, by0);
            const lanes_f z = MOST(az1, bz1) - LEAST(az0, bz0);
            const lanes_f size = x * y + (x + y) * z + COMPACT * (x * x + y * y + z * z);
            const lanes_i other = place + offset;
            const lanes_i there = MASK(other >= 0) & MASK(other < n);
            /* Floats that are not negative have the order of their bits. */
            const lanes_i distance = PICK(there, BITS(size) >> coarse, (lanes_i)(FARTHEST));
            const lanes_i pair = place ^ other;
            const lanes_i nearer = MASK(distance < best) | (MASK(distance == best) & MASK(pair < best_pair));
            best = PICK(nearer, distance, best);
            best_pair = PICK(nearer, pair, best_pair);
        }
        const lanes_i found = place ^ best_pair;
        const int *each = (const int *)&found;
        for (int lane = 0; lane < LANES && i + lane < n; ++lane) nearest[i + lane] = each[lane];
    }
}

/* nearest (n) written: the nearest within `radius` places to either side. `coarse`: last bits of a distance that do not
 * count. n >= 2. */
kernel void find_nearest(global const float *boxes, int stride, int n, int radius, int coarse, global int *nearest)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0), n_packets = (n + LANES - 1) / LANES;
    find_for(boxes, stride, n, radius, coarse, first_of(chunk, n_chunks, n_packets) * LANES,
             first_of(chunk + 1, n_chunks, n_packets) * LANES, nearest);
}

/* counts (n_chunks + 1, 2) written from row 1 on: clusters that this chunk hands on, merged ones among them. */
kernel void count_merges(global const int *nearest, int n, global int *counts)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    int kept = 0, merged = 0;
    const int end = first_of(chunk + 1, n_chunks, n);
    for (int i = first_of(chunk, n_chunks, n); i < end; ++i) {
        const int j = nearest[i];
        const bool mutual = nearest[j] == i;
        kept += !mutual || i < j;
        merged += mutual && i < j;
    }
    counts[2 * chunk + 2] = kept;
    counts[2 * chunk + 3] = merged;
}

DEFINE_SUM_COUNTS

#define UNITS_OF(size) ((size) & 127)
#define LEVEL_OF(size) ((size) & ~127)
#define NEXT_LEVEL 128

/* Make a cluster one unit: a treelet that is to be built anew, with those of its level. */
static inline void note_treelet(TREE_ARGUMENTS, int id, int size)
{
    if (UNITS_OF(size) > 1) choices[id - n_triangles] = UNIT | PENDING | (uint)(size / NEXT_LEVEL);
}

/* Size of the union of clusters a and b, once noted is what becomes a unit: the one of the lower level does, and both do
 * where their units are too many for one treelet. */
static inline int join_sizes(TREE_ARGUMENTS, int a, int b, int a_size, int b_size)
{
    if (LEVEL_OF(a_size) < LEVEL_OF(b_size)) {
        note_treelet(TREE, a, a_size);
        a_size = LEVEL_OF(b_size) | 1;
    } else if (LEVEL_OF(b_size) < LEVEL_OF(a_size)) {
        note_treelet(TREE, b, b_size);
        b_size = LEVEL_OF(a_size) | 1;
    }
    const int n_units = UNITS_OF(a_size) + UNITS_OF(b_size);
    if (n_units <= TREELET) return LEVEL_OF(a_size) | n_units;
    note_treelet(TREE, a, a_size);
    note_treelet(TREE, b, b_size);
    return (LEVEL_OF(a_size) + NEXT_LEVEL) | 2;
}

/* Clusters of a round. */
typedef struct {
    global float *boxes;
    global int *id, *size;
} Clusters;

/* Merge clusters [from, end): what they become is written from place `to` on, inner nodes from `node` on, in the order of
 * their left halves. Returns the place after the last. */
static inline int merge_run(TREE_ARGUMENTS, Clusters now, Clusters then, int stride, int from, int end,
                            global const int *nearest, int to, int node)
{
    for (int i = from; i < end; ++i) {
        const int j = nearest[i];
        const bool mutual = nearest[j] == i;
        if (mutual && j < i) continue;
        global const float *a = now.boxes + PAD + i, *b = now.boxes + PAD + j;
        const float4 a_low = (float4)(a[0], a[stride], a[2 * stride], 0.0f);
        const float4 a_high = (float4)(a[3 * stride], a[4 * stride], a[5 * stride], 0.0f);
        const float4 b_low = (float4)(b[0], b[stride], b[2 * stride], 0.0f);
        const float4 b_high = (float4)(b[3 * stride], b[4 * stride], b[5 * stride], 0.0f);
        float4 low = a_low, high = a_high;
        int number = now.id[i], count = now.size[i];
        if (mutual) {
            low = LEAST(a_low, b_low);
            high = MOST(a_high, b_high);
            number = n_triangles + node;
            halves[2 * node] = now.id[i];
            halves[2 * node + 1] = now.id[j];
            choices[node] = 0;
            count = join_sizes(TREE, now.id[i], now.id[j], now.size[i], now.size[j]);
        }
        global float *box = then.boxes + PAD + to;
        box[0] = low.x, box[stride] = low.y, box[2 * stride] = low.z;
        box[3 * stride] = high.x, box[4 * stride] = high.y, box[5 * stride] = high.z;
        then.id[to] = number;
        then.size[to] = count;
        ++to;
        node += mutual;
    }
    return to;
}

/* Merge, and close the gaps. counts: of the chunks, summed. Inner nodes from `first_node` on are written; to_...: the
 * clusters of the next round, every entry once. */
kernel void merge_clusters(TREE_ARGUMENTS, global float *boxes, global int *id, global int *size, int stride, int n,
                           global const int *nearest, global const int *counts, int first_node, global float *to_boxes,
                           global int *to_id, global int *to_size)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    const Clusters now = {boxes, id, size}, then = {to_boxes, to_id, to_size};
    if (chunk == 0) clear_pads(to_boxes, stride, counts[0]);
    merge_run(TREE, now, then, stride, first_of(chunk, n_chunks, n), first_of(chunk + 1, n_chunks, n), nearest,
              counts[2 * chunk + 2], first_node + counts[2 * chunk + 3]);
}

/* The remaining rounds, until one of n >= 1 clusters is left, which is a treelet, too. NDRange (1). coarse_first, step,
 * coarsest and slow_share: planner_core.engine.tree. n_levels (1) written: levels of treelets. */
kernel void merge_rest(TREE_ARGUMENTS, global float *boxes, global int *id, global int *size, int stride, int n,
                       global int *nearest, int first_node, global float *to_boxes, global int *to_id,
                       global int *to_size, int radius, int late_radius, int late, int coarse, int coarse_first,
                       int step, int coarsest, int slow_share, global int *n_levels)
{
    Clusters now = {boxes, id, size}, then = {to_boxes, to_id, to_size};
    int node = first_node;
    while (n > 1) {
        find_for(now.boxes, stride, n, n > late ? radius : late_radius, coarse, 0, n, nearest);
        const int left = merge_run(TREE, now, then, stride, 0, n, nearest, 0, node), merged = n - left;
        node += merged;
        n = left;
        clear_pads(then.boxes, stride, n);
        coarse = merged * slow_share < n ? LEAST(coarse + step, coarsest) : coarse_first;
        const Clusters other = now;
        now = then;
        then = other;
    }
    note_treelet(TREE, now.id[0], now.size[0]);
    n_levels[0] = now.size[0] / NEXT_LEVEL + 1;
}

/* Nodes whose choices a work-item looks at side by side. */
#define NODE_RUN 16

/* List of every node the level whose treelet it is the root of, -1: none. Read apart from `choices`, which others write. */
kernel void list_treelets(int n_nodes, global const uint *choices, global int *level_of)
{
    for (int node = get_global_id(0); node < n_nodes; node += get_global_size(0)) {
        const bool is_root = (choices[node] & (UNIT | PENDING)) == (UNIT | PENDING);
        level_of[node] = is_root ? (int)(choices[node] & ~(UNIT | PENDING)) : -1;
    }
}

/* Build the treelets of one level anew, after all of those below. Roots have high numbers, so that runs of nodes are dealt
 * to the work-items in turn. */
kernel void build_treelets(TREE_ARGUMENTS, global const int *level_of, int level)
{
    const int step = NODE_RUN * get_global_size(0);
    for (int first = NODE_RUN * get_global_id(0); first < n_triangles - 1; first += step) {
        const int end = LEAST(first + NODE_RUN, n_triangles - 1);
        for (int node = first; node < end; ++node)
            if (level_of[node] == level) finish_treelet(TREE, node);
    }
}
