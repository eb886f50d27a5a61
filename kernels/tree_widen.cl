/* Building the tree, last stage: binary nodes become nodes of eight children (tree.h) and blocks (block.h).
 *
 * Algorithm  From the root down, level by level, along the choices of tree_cost.h; then blocks are filled, and boxes follow
 *            from the blocks up.
 * Indices    The binary tree: see tree_merge.cl. nodes (N): the binary node that every wide node is; blocks (B): that every
 *            block is. Nodes of a level are neighbours, and so are the children of a node that are nodes, and those that
 *            are blocks. Launched by planner_core.engine.tree. NDRange (n_chunks) unless said otherwise, any local size.
 *
 * Define   meaning                                                                             example
 * FLOAT64  1: normals and edges are computed here, in float64; 0: the host has done so         -DFLOAT64=1
 */
#include "chunks.h"
#include "tree_cost.h"

/* Levels a launch at most; more take one more launch. */
#define MAX_LEVELS 62
#if FLOAT64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif

#define BINARY_ARGUMENTS global const int *halves, global const uint *choices, int n_triangles
#define BINARY halves, choices, n_triangles

static inline bool is_block(BINARY_ARGUMENTS, int id) { return id < n_triangles || (choices[id - n_triangles] & 1); }

/* Children of the wide node that binary node `root` becomes, left to right; returns how many. A root that is a block is
 * its own child: a tree begins with a node. */
static inline int open_node(int *found, BINARY_ARGUMENTS, int root)
{
    if (is_block(BINARY, root)) {
        found[0] = root;
        return 1;
    }
    int stack[WIDTH], places[WIDTH];
    int size = 1, count = 0;
    stack[0] = root;
    places[0] = WIDTH;
    while (size > 0) {
        const int node = stack[--size] - n_triangles;
        int room = node < 0 ? 1 : places[size];
        int share = 0;
        while (room > 1 && (share = (int)(choices[node] >> (3 * room - 5) & 7u)) == 0) --room;
        if (room == 1) {
            found[count++] = node + n_triangles;
            continue;
        }
        stack[size] = halves[2 * node + 1];
        places[size++] = room - share;
        stack[size] = halves[2 * node];
        places[size++] = share;
    }
    return count;
}

/* counts (n_chunks + 1, 2) written from row 1 on: children that are nodes, that are blocks, of nodes [first, first + n). */
kernel void count_children(BINARY_ARGUMENTS, global const int *nodes, int first, int n, global int *counts)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    int n_inner = 0, n_blocks = 0;
    const int end = first + first_of(chunk + 1, n_chunks, n);
    for (int i = first + first_of(chunk, n_chunks, n); i < end; ++i) {
        int found[WIDTH];
        const int count = open_node(found, BINARY, nodes[i]);
        for (int j = 0; j < count; ++j) {
            const bool block = is_block(BINARY, found[j]);
            n_blocks += block;
            n_inner += !block;
        }
    }
    counts[2 * chunk + 2] = n_inner;
    counts[2 * chunk + 3] = n_blocks;
}

DEFINE_SUM_COUNTS

/* Children of nodes [first, end): nodes are written from *node on, blocks from *block on, which are moved on. */
static inline void list_run(BINARY_ARGUMENTS, global int *nodes, int first, int end, global int *first_child,
                            global int *blocks, int *node, int *block)
{
    for (int i = first; i < end; ++i) {
        int found[WIDTH];
        const int count = open_node(found, BINARY, nodes[i]);
        first_child[2 * i] = *node;
        first_child[2 * i + 1] = *block;
        for (int j = 0; j < count; ++j) {
            if (is_block(BINARY, found[j]))
                blocks[(*block)++] = found[j];
            else
                nodes[(*node)++] = found[j];
        }
    }
}

/* nodes from next_node on and blocks from next_block on written: the children of nodes [first, first + n); first_child
 * (N, 2) written: of each of these its first child that is a node, that is a block. counts: summed. */
kernel void list_children(BINARY_ARGUMENTS, global int *nodes, int first, int n, global const int *counts, int next_node,
                          int next_block, global int *first_child, global int *blocks)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    int node = next_node + counts[2 * chunk + 2], block = next_block + counts[2 * chunk + 3];
    list_run(BINARY, nodes, first + first_of(chunk, n_chunks, n), first + first_of(chunk + 1, n_chunks, n), first_child,
             blocks, &node, &block);
}

/* The same for one level after the other, as long as they have at most `few` nodes; node 0 is the root. NDRange (1).
 * levels (2 + MAX_LEVELS) written: how many levels, the blocks so far, and the nodes of the level after each. */
kernel void list_levels(BINARY_ARGUMENTS, global int *nodes, int first, int n, int next_block, int few,
                        global int *first_child, global int *blocks, global int *levels)
{
    int level = 0, node = first + n, block = next_block;
    if (first == 0) nodes[0] = 2 * n_triangles - 2;
    for (; n > 0 && n <= few && level < MAX_LEVELS; ++level) {
        list_run(BINARY, nodes, first, first + n, first_child, blocks, &node, &block);
        first += n;
        n = node - first;
        levels[2 + level] = n;
    }
    levels[0] = level;
    levels[1] = block;
}

#if FLOAT64
/* Normal and squared edges of triangle t, as NumPy computes them in planner_core.engine.traced_surfaces and .scene.patches, to the
 * last bit: the same float64 operations in the same order, none contracted. No area: a normal of zeros. */
static inline void measure_triangle(float *normal, global float *edges, const float *v)
{
    double p[3], q[3], r[3]; /* v1 - v0, v2 - v1, v2 - v0 */
    for (int k = 0; k < 3; ++k) {
        p[k] = (double)v[3 + k] - (double)v[k];
        q[k] = (double)v[6 + k] - (double)v[3 + k];
        r[k] = (double)v[6 + k] - (double)v[k];
    }
    edges[0] = (float)(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    edges[1] = (float)(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    edges[2] = (float)(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    const double x = p[1] * r[2] - p[2] * r[1];
    const double y = p[2] * r[0] - p[0] * r[2];
    const double z = p[0] * r[1] - p[1] * r[0];
    const double length = sqrt(x * x + y * y + z * z);
    normal[0] = length > 0.0 ? (float)(x / length) : 0.0f;
    normal[1] = length > 0.0 ? (float)(y / length) : 0.0f;
    normal[2] = length > 0.0 ? (float)(z / length) : 0.0f;
}
#endif

/* Triangles below binary node `root`, eight at most, left to right; returns how many. */
static inline int gather_block(int *held, BINARY_ARGUMENTS, global const int *order, int root)
{
    int stack[WIDTH];
    int size = 1, count = 0;
    stack[0] = root;
    while (size > 0) {
        const int id = stack[--size];
        if (id < n_triangles) {
            held[count++] = order[id];
        } else {
            stack[size++] = halves[2 * (id - n_triangles) + 1];
            stack[size++] = halves[2 * (id - n_triangles)];
        }
    }
    return count;
}

/* geometry (B, 12, 8), triangle (B, 8), slot (T), block_box (B, 2) (low, high) written, every entry once. An empty lane
 * repeats the last triangle and is numbered -1. edges (T, 3) m2: written where FLOAT64; else not touched, and normals (T, 3)
 * read. */
kernel void fill_blocks(global const float *vertices, global const int *corners, global const int *order,
                        global const float *normals, BINARY_ARGUMENTS, global const int *blocks, int n_blocks,
                        global float *geometry, global int *triangle, global int *slot, global float *edges,
                        global float4 *block_box)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    const int end = first_of(chunk + 1, n_chunks, n_blocks);
    for (int b = first_of(chunk, n_chunks, n_blocks); b < end; ++b) {
        int held[WIDTH];
        const int count = gather_block(held, BINARY, order, blocks[b]);
        global float *to = geometry + 12 * WIDTH * (size_t)b;
        float4 low = INFINITY, high = -INFINITY;
        float lane[12];
        for (int j = 0; j < WIDTH; ++j) {
            if (j < count) {
                const size_t t = held[j];
                for (int v = 0; v < 3; ++v) {
                    global const float *from = vertices + 3 * (size_t)corners[3 * t + v];
                    for (int k = 0; k < 3; ++k) lane[3 * v + k] = from[k];
                    const float4 at = (float4)(from[0], from[1], from[2], 0.0f);
                    low = LEAST(at, low);
                    high = MOST(at, high);
                }
#if FLOAT64
                measure_triangle(lane + 9, edges + 3 * t, lane);
#else
                for (int k = 0; k < 3; ++k) lane[9 + k] = normals[3 * t + k];
#endif
                slot[t] = b * WIDTH + j;
            }
            for (int k = 0; k < 12; ++k) to[k * WIDTH + j] = lane[k];
            triangle[WIDTH * (size_t)b + j] = j < count ? held[j] : -1;
        }
        block_box[2 * b] = low;
        block_box[2 * b + 1] = high;
    }
}

/* boxes (N, 6, 8), children (N, 8) and node_box (N, 2) (low, high) of nodes [first, first + n) written: of one level, after
 * all below it; or of several, by one work-item. */
kernel void write_nodes(BINARY_ARGUMENTS, global const int *nodes, int first, int n, global const int *first_child,
                        global const float4 *block_box, global float4 *node_box, global float *boxes,
                        global int *children)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    const int end = first + first_of(chunk + 1, n_chunks, n);
    /* from the last one up: children have higher numbers */
    for (int i = end - 1; i >= first + first_of(chunk, n_chunks, n); --i) {
        int found[WIDTH];
        const int count = open_node(found, BINARY, nodes[i]);
        int node = first_child[2 * i], block = first_child[2 * i + 1];
        float4 all_low = INFINITY, all_high = -INFINITY;
        global float *to = boxes + 6 * WIDTH * (size_t)i;
        for (int j = 0; j < WIDTH; ++j) {
            /* Inside out: no test passes an unused child. */
            float4 low = 1e30f, high = -1e30f;
            int child = 0;
            if (j < count) {
                const bool is_leaf = is_block(BINARY, found[j]);
                low = is_leaf ? block_box[2 * block] : node_box[2 * node];
                high = is_leaf ? block_box[2 * block + 1] : node_box[2 * node + 1];
                child = is_leaf ? ~block++ : node++;
                all_low = LEAST(low, all_low);
                all_high = MOST(high, all_high);
            }
            to[j] = low.x, to[8 + j] = low.y, to[16 + j] = low.z;
            to[24 + j] = high.x, to[32 + j] = high.y, to[40 + j] = high.z;
            children[WIDTH * (size_t)i + j] = child;
        }
        node_box[2 * i] = all_low;
        node_box[2 * i + 1] = all_high;
    }
}
