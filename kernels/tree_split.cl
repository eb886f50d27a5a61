/* Building the tree: one level of binary splits by the surface area heuristic.
 *
 * Purpose    The host calls this level by level, then merges binary nodes to wide ones (planner_core.scan.tree).
 * Algorithm  Binned SAH (Wald 2007): BINS bins of the centroids along each axis; the cost of a side is its area times
 *            the number of BLOCKS of eight triangles it needs, since a block costs the same however full it is.
 * Indices    node k of the level owns order[start[k] .. start[k] + count[k]).
 *
 * Define   meaning                                                                  example
 * BINS     bins an axis                                                             -DBINS=16
 */
#pragma OPENCL FP_CONTRACT OFF

#define BLOCK_LANES 8
/* Cost of a node in units of a block's: what a split has to save before a block of eight or fewer is divided. */
#define NODE_COST 0.25f

typedef struct {
    float low[3], high[3];
    int count;
} Bin;

/* Operators rather than built-ins: see lanes.h. */
static inline float least(float a, float b) { return a < b ? a : b; }
static inline float most(float a, float b) { return a > b ? a : b; }

static inline void clear_bin(Bin *bin)
{
    for (int a = 0; a < 3; ++a) bin->low[a] = 1e30f, bin->high[a] = -1e30f;
    bin->count = 0;
}

static inline void grow_bin(Bin *bin, const Bin *by)
{
    for (int a = 0; a < 3; ++a) {
        bin->low[a] = least(bin->low[a], by->low[a]);
        bin->high[a] = most(bin->high[a], by->high[a]);
    }
    bin->count += by->count;
}

static inline float half_area(const Bin *bin)
{
    const float x = bin->high[0] - bin->low[0], y = bin->high[1] - bin->low[1], z = bin->high[2] - bin->low[2];
    return bin->count == 0 ? 0.0f : x * y + y * z + z * x;
}

static inline float side_cost(const Bin *bin)
{
    return half_area(bin) * (float)((bin->count + BLOCK_LANES - 1) / BLOCK_LANES);
}

/* Bin of a centroid. `scale` is a little less than BINS / extent, so that the greatest falls into the last bin. */
static inline int bin_of(float centroid, float low, float scale)
{
    const int bin = (int)((centroid - low) * scale);
    return bin < 0 ? 0 : (bin < BINS ? bin : BINS - 1);
}

/* Twice the centroid of a box along one axis. */
static inline float centroid_of(global const float *boxes, int triangle, int axis)
{
    return boxes[6 * triangle + axis] + boxes[6 * triangle + 3 + axis];
}

/* Split the nodes of one level.
 * One work-item is one node. NDRange (n_nodes), any local size. boxes (T, 6) x0 y0 z0 x1 y1 z1 of the triangles, metres,
 * local frame. order (T) triangle numbers, reordered in place: the left side first. node_box (n_nodes, 6) written.
 * left_count (n_nodes) written: triangles of the left child, 0 for a leaf. Deterministic: a node is split by one
 * work-item in one order. */
kernel void split_nodes(global const float *boxes, global int *order, global const int *start, global const int *count,
                        global float *node_box, global int *left_count)
{
    const int node = get_global_id(0);
    const int first = start[node], n = count[node];
    /* 1: bounds of the boxes and of the centroids */
    Bin all;
    clear_bin(&all);
    float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f};
    for (int i = first; i < first + n; ++i) {
        const int triangle = order[i];
        for (int a = 0; a < 3; ++a) {
            all.low[a] = least(all.low[a], boxes[6 * triangle + a]);
            all.high[a] = most(all.high[a], boxes[6 * triangle + 3 + a]);
            const float centroid = centroid_of(boxes, triangle, a);
            low[a] = least(low[a], centroid);
            high[a] = most(high[a], centroid);
        }
    }
    all.count = n;
    for (int a = 0; a < 3; ++a) node_box[6 * node + a] = all.low[a], node_box[6 * node + 3 + a] = all.high[a];
    left_count[node] = 0;
    if (n <= 1) return;
    /* 2: fill the bins of all axes in one pass */
    Bin bins[3][BINS];
    float scale[3];
    for (int a = 0; a < 3; ++a) {
        scale[a] = high[a] - low[a] > 1e-30f ? 0.9999f * BINS / (high[a] - low[a]) : 0.0f;
        for (int b = 0; b < BINS; ++b) clear_bin(&bins[a][b]);
    }
    for (int i = first; i < first + n; ++i) {
        const int triangle = order[i];
        Bin one;
        for (int a = 0; a < 3; ++a) one.low[a] = boxes[6 * triangle + a], one.high[a] = boxes[6 * triangle + 3 + a];
        one.count = 1;
        for (int a = 0; a < 3; ++a) grow_bin(&bins[a][bin_of(one.low[a] + one.high[a], low[a], scale[a])], &one);
    }
    /* 3: the cheapest cut; a tie goes to the lower axis, then the lower bin */
    float best = INFINITY;
    int axis = -1, cut = 0;
    for (int a = 0; a < 3; ++a) {
        if (scale[a] == 0.0f) continue;
        float right_cost[BINS];
        Bin side;
        clear_bin(&side);
        for (int b = BINS - 1; b > 0; --b) {
            grow_bin(&side, &bins[a][b]);
            right_cost[b] = side_cost(&side);
        }
        clear_bin(&side);
        for (int b = 1; b < BINS; ++b) {
            grow_bin(&side, &bins[a][b - 1]);
            const float cost = side_cost(&side) + right_cost[b];
            if (side.count > 0 && side.count < n && cost < best) best = cost, axis = a, cut = b;
        }
    }
    /* 4: a leaf, where one block does and a split would not pay */
    const float area = half_area(&all);
    if (n <= BLOCK_LANES && (axis < 0 || best + NODE_COST * area >= area)) return;
    /* 5: all centroids in one place: halves, in the order that is there */
    if (axis < 0) {
        left_count[node] = n / 2;
        return;
    }
    /* 6: partition in place */
    int i = first, j = first + n - 1;
    while (i <= j) {
        if (bin_of(centroid_of(boxes, order[i], axis), low[axis], scale[axis]) < cut) {
            ++i;
        } else {
            const int swap = order[i];
            order[i] = order[j];
            order[j--] = swap;
        }
    }
    left_count[node] = i - first;
}
