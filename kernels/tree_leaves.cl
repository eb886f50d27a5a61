/* Building the tree, first stage: the triangles' order along the Morton curve, and their boxes.
 *
 * Layout     vertices (V, 3) float32, metres, local frame; corners (T, 3) int32 into them. Launched by
 *            planner_core.engine.tree. NDRange (n_chunks) unless said otherwise, any local size.
 * Algorithm  Morton code: the bits of the three coordinates of a triangle's centroid, in turn. Cells are cubes.
 *
 * Define       meaning                                                     example
 * MORTON_BITS  bits a coordinate, at most 21                               -DMORTON_BITS=18
 * PAD          see tree_clusters.h                                         -DPAD=32
 */
#include "chunks.h"
#include "tree_clusters.h"
#include "tree_cost.h"

/* Bounds of twice the centroids of one chunk. bounds (n_chunks, 2) written: low, high. */
kernel void bound_centroids(global const float *vertices, global const int *corners, int n, global float4 *bounds)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    float4 least = INFINITY, most = -INFINITY;
    const int end = first_of(chunk + 1, n_chunks, n);
    for (int i = first_of(chunk, n_chunks, n); i < end; ++i) {
        float4 low, high;
        triangle_box(&low, &high, vertices, corners, i);
        const float4 centre = low + high;
        least = LEAST(centre, least);
        most = MOST(centre, most);
    }
    bounds[2 * chunk] = least;
    bounds[2 * chunk + 1] = most;
}

/* One work-item joins the bounds of all chunks. NDRange (1). grid (1) written: lowest corner; w: cells a metre. */
kernel void join_bounds(global const float4 *bounds, int n_chunks, global float4 *grid)
{
    float4 low = bounds[0], high = bounds[1];
    for (int c = 1; c < n_chunks; ++c) {
        low = LEAST(bounds[2 * c], low);
        high = MOST(bounds[2 * c + 1], high);
    }
    const float4 d = high - low;
    const float xy = MOST(d.x, d.y), extent = MOST(xy, d.z);
    /* A little less than the number of cells, so that the greatest falls into the last one. */
    low.w = extent > 1e-30f ? 0.999999f * (float)(1 << MORTON_BITS) / extent : 0.0f;
    grid[0] = low;
}

/* Two zeros after each of the low 21 bits. */
static inline ulong spread(int x)
{
    ulong v = (ulong)x & 0x1fffff;
    v = (v | v << 32) & 0x001f00000000ffffUL;
    v = (v | v << 16) & 0x001f0000ff0000ffUL;
    v = (v | v << 8) & 0x100f00f00f00f00fUL;
    v = (v | v << 4) & 0x10c30c30c30c30c3UL;
    v = (v | v << 2) & 0x1249249249249249UL;
    return v;
}

/* keys (T) written: Morton codes; order (T) written: 0, 1, 2 ... */
kernel void make_keys(global const float *vertices, global const int *corners, int n, global const float4 *grid,
                      global ulong *keys, global int *order)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    const float4 origin = grid[0];
    const int end = first_of(chunk + 1, n_chunks, n);
    for (int i = first_of(chunk, n_chunks, n); i < end; ++i) {
        float4 low, high;
        triangle_box(&low, &high, vertices, corners, i);
        const float4 at = (low + high - origin) * origin.w;
        keys[i] = spread((int)at.x) << 2 | spread((int)at.y) << 1 | spread((int)at.z);
        order[i] = i;
    }
}

/* The first clusters: single triangles in their order along the curve. boxes (6, stride), columns from PAD on, x0 y0 z0
 * x1 y1 z1; id (T) = 0, 1, 2 ..., size (T) = 1 and units (T) = boxes (tree_treelet.h) written. */
kernel void make_leaves(global const float *vertices, global const int *corners, int n, global const int *order,
                        global float *boxes, int stride, global int *id, global int *size,
                        global float8 *units)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    const int end = first_of(chunk + 1, n_chunks, n);
    global float *x0 = boxes + PAD, *x1 = x0 + 3 * stride;
    if (chunk == 0) clear_pads(boxes, stride, n);
    for (int i = first_of(chunk, n_chunks, n); i < end; ++i) {
        float4 low, high;
        triangle_box(&low, &high, vertices, corners, order[i]);
        x0[i] = low.x, x0[stride + i] = low.y, x0[2 * stride + i] = low.z;
        x1[i] = high.x, x1[stride + i] = high.y, x1[2 * stride + i] = high.z;
        id[i] = i;
        size[i] = 1;
        units[i] = (float8)(low, high);
    }
}
