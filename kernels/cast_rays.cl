/* Free rays: first hits of rays that share nothing, a ray a work-item.
 *
 * Purpose    Checks of candidates, picks, random rays: whatever is not a grid of beams from one origin.
 * Algorithm  The tree is walked front to back; a ray meets eight boxes at a time (slabs) and eight triangles at a time.
 *            The triangle test is that of the tiles (block.h), in the same order of operations: same beam, same bits.
 *
 *            A walk waits for memory and for its own last step most of the time, so that a processor that looks ahead
 *            (a CPU) takes a wave of them at once: all that are at a node meet their nodes, then all that are at a block
 *            meet their blocks, then each goes on to its next child, or makes room for the next ray. Waits overlap, and
 *            a loop over nodes alone has no branch that the processor could guess wrong.
 *
 * Define         meaning                                              example
 * LANES          1 here: a packet is one ray                          -DLANES=1
 * RAYS           rays a work-item                                     -DRAYS=256
 * WALKS          how many of them are under way at once               -DWALKS=32
 * PAIRS          1: children of two nodes are sorted side by side;    -DPAIRS=1
 *                for devices that take 16 lanes
 * STACK          see tree.h
 * INVERSE        1: 1 / range goes out as well, to be compared        -DINVERSE=1
 *                with hits in other trees; else 0, as without
 */
#include "block.h"
#include "tree.h"

/* A component nearer to zero than this would turn 0 * infinity into NaN in the slab test. At 1e-18 a box a hundred
 * kilometres away stays finite (1e5 / 1e-18 = 1e23), and the ray is moved by less than 1e-13 m there. */
#define LEAST_COMPONENT 1e-18f

/* A hit may lie some ulp of its range outside its triangle and so outside its box, one of a needle by NEEDLE_PAD: boxes grow
 * by this share of the distance to the scene's farthest point. 1.75: a vertex's sum of coordinates over its distance.
 * Rounding of the test: a few 6e-8. */
#define BOX_SHARE (1.75f * NEEDLE_PAD)

/* The same for the product of origin and inverse direction, which is rounded by itself. */
#define ORIGIN_SHARE 2e-7f

#define NEAR_SLACK 1.00001f

static inline float off_zero(float x)
{
    return x >= LEAST_COMPONENT || x <= -LEAST_COMPONENT ? x : (x < 0.0f ? -LEAST_COMPONENT : LEAST_COMPONENT);
}

/* Where a ray enters and leaves boxes along one axis: box * in - from_in, larger at both ends by the pad. */
typedef struct {
    float in, from_in, out, from_out;
} Slab;

static inline Slab slab_of(float o, float d, float pad)
{
    const float inverse = 1.0f / off_zero(d), signed_pad = d < 0.0f ? -pad : pad;
    Slab slab;
    slab.in = inverse;
    slab.from_in = (o + signed_pad) * inverse;
    slab.out = inverse * NEAR_SLACK;
    slab.from_out = (o - signed_pad) * slab.out;
    return slab;
}

static inline float8 along(float8 box, float inverse, float from)
{
    _Pragma("OPENCL FP_CONTRACT ON") return box * inverse - from;
}

/* Number of a walk of the wave; of a wave of one, what the compiler knows. */
#define WALK(number) (WALKS == 1 ? 0 : (number))

/* One ray on its way through the tree. */
typedef struct {
    float ox, oy, oz, dx, dy, dz;
    Slab x, y, z;
    int in_x, in_y, in_z, out_x, out_y, out_z; /* offsets in a node of the faces it enters and leaves by */
    float best; /* 1 / range of the first hit so far; at first 1 / range_max, less a little */
    float far;  /* farther than this nothing matters any more */
    int found;  /* the triangle, -1 for none */
    int child;  /* what is to be met next: a node, or ~block */
    int ray;
    float rounding; /* not less than any edge function's, a metre of its edge */
    Stack stack;
} Walk;

static inline void start_walk(Walk *walk, global const float *rays, int ray, float best, float far, float4 sphere)
{
    const float ox = rays[6 * ray], oy = rays[6 * ray + 1], oz = rays[6 * ray + 2];
    const float dx = rays[6 * ray + 3], dy = rays[6 * ray + 4], dz = rays[6 * ray + 5];
    /* not less than the distance of any vertex */
    const float reach = MAGNITUDE(sphere.x - ox) + MAGNITUDE(sphere.y - oy) + MAGNITUDE(sphere.z - oz) + sphere.w;
    const float pad = BOX_SHARE * reach + ORIGIN_SHARE * (MAGNITUDE(ox) + MAGNITUDE(oy) + MAGNITUDE(oz));
    walk->ox = ox, walk->oy = oy, walk->oz = oz, walk->dx = dx, walk->dy = dy, walk->dz = dz;
    walk->x = slab_of(ox, dx, pad), walk->y = slab_of(oy, dy, pad), walk->z = slab_of(oz, dz, pad);
    walk->in_x = dx < 0.0f ? 24 : 0, walk->in_y = dy < 0.0f ? 32 : 8, walk->in_z = dz < 0.0f ? 40 : 16;
    walk->out_x = 24 - walk->in_x, walk->out_y = 40 - walk->in_y, walk->out_z = 56 - walk->in_z;
    walk->best = best;
    walk->far = far;
    walk->found = -1;
    walk->child = 0;
    walk->ray = ray;
    /* `finish_block` takes at most 1.23 of a vertex's distance */
    walk->rounding = 1.3f * EDGE_ROUNDING * reach;
    walk->stack.size = 0;
}

/* Take the nearest child off the stack; false where the walk is at its end. */
static inline bool next_child(Walk *walk, global const int *children)
{
    Stack *stack = &walk->stack;
    const int far = as_int(walk->far); /* of positive floats the order is that of their bits */
    int at = stack->size;
    do {
        if (at == 0) return false;
    } while (stack->key[--at] > far);
    stack->size = at;
    walk->child = children[stack->from[at] * NODE_CHILDREN + (stack->key[at] & 7)];
    return true;
}

/* Keys of the stack of the children that a walk at a node meets; -1 for the others. */
static inline int8 met_children(const Walk *walk, global const float *boxes)
{
    global const float *b = boxes + (size_t)walk->child * (6 * NODE_CHILDREN);
    const Slab x = walk->x, y = walk->y, z = walk->z;
    const float8 ex = along(LOAD8(b + walk->in_x), x.in, x.from_in), lx = along(LOAD8(b + walk->out_x), x.out, x.from_out);
    const float8 ey = along(LOAD8(b + walk->in_y), y.in, y.from_in), ly = along(LOAD8(b + walk->out_y), y.out, y.from_out);
    const float8 ez = along(LOAD8(b + walk->in_z), z.in, z.from_in), lz = along(LOAD8(b + walk->out_z), z.out, z.from_out);
    const float8 exy = MOST(ex, ey), ez0 = MOST(ez, 0.0f), enter = MOST(exy, ez0);
    const float8 lxy = LEAST(lx, ly), leave = LEAST(lxy, lz);
    const int8 keep = (enter <= leave) & (enter <= walk->far);
    return PICK(keep, named_keys(enter), (int8)(-1));
}

#if PAIRS
/* As sort8, both halves by themselves. */
static inline int16 sort8_twice(int16 x)
{
#define EXCHANGE_TWICE(swapped, upper)                                                                                \
    do {                                                                                                              \
        const int16 other = swapped, greater = MOST(x, other), smaller = LEAST(x, other);                             \
        x = PICK((int16)((int8)upper, (int8)upper), smaller, greater);                                                \
    } while (0)
    EXCHANGE_TWICE(x.s1032547698badcfe, (0, -1, -1, 0, 0, -1, -1, 0));
    EXCHANGE_TWICE(x.s23016745ab89efcd, (0, 0, -1, -1, -1, -1, 0, 0));
    EXCHANGE_TWICE(x.s1032547698badcfe, (0, -1, 0, -1, -1, 0, -1, 0));
    EXCHANGE_TWICE(x.s45670123cdef89ab, (0, 0, 0, 0, -1, -1, -1, -1));
    EXCHANGE_TWICE(x.s23016745ab89efcd, (0, 0, -1, -1, 0, 0, -1, -1));
    EXCHANGE_TWICE(x.s1032547698badcfe, (0, -1, 0, -1, 0, -1, 0, -1));
#undef EXCHANGE_TWICE
    return x;
}
#endif

/* Meet the nodes that n walks are at: what they meet of them goes onto their stacks. */
static inline void meet_nodes(Walk *walks, const int *named, int n, global const float *boxes)
{
    int i = 0;
#if PAIRS
    for (; i + 1 < n; i += 2) {
        Walk *a = &walks[named[i]], *b = &walks[named[i + 1]];
        const int8 met_a = met_children(a, boxes), met_b = met_children(b, boxes);
        const int16 sorted = sort8_twice((int16)(met_a, met_b));
        push_sorted(&a->stack, a->child, met_a >= 0, sorted.lo);
        push_sorted(&b->stack, b->child, met_b >= 0, sorted.hi);
    }
#endif
    for (; i < n; ++i) {
        Walk *walk = &walks[WALK(named[i])];
        const int8 met = met_children(walk, boxes);
        push_sorted(&walk->stack, walk->child, met >= 0, sort8(met));
    }
}

/* Keep a hit if it is nearer, or as near on a lower triangle. */
static inline void keep_hit(Walk *walk, float inverse, int triangle)
{
    if (inverse > walk->best || (inverse == walk->best && triangle < walk->found)) {
        walk->best = inverse;
        walk->far = NEAR_SLACK / inverse;
        walk->found = triangle;
    }
}

/* Meet the triangles of a block. */
static inline void meet_block(Walk *walk, global const float *geometry, global const int *triangles)
{
    const int index = ~walk->child;
    global const int *named = triangles + (size_t)index * BLOCK_LANES;
    const float dx = walk->dx, dy = walk->dy, dz = walk->dz;
    /* 1: the edge functions alone tell that most blocks are missed, with a bound that suits any of the scene's triangles */
    const Edges edges = prepare_edges(geometry, index, walk->ox, walk->oy, walk->oz);
    const float8 front_u = dot3_8(dx, dy, dz, edges.n0x, edges.n0y, edges.n0z);
    const float8 front_v = dot3_8(dx, dy, dz, edges.n1x, edges.n1y, edges.n1z);
    const float8 front_w = dot3_8(dx, dy, dz, edges.n2x, edges.n2y, edges.n2z);
    const float8 most_u = walk->rounding * edges.length0, most_v = walk->rounding * edges.length1;
    const float8 most_w = walk->rounding * edges.length2;
    const int8 front = (front_u >= -most_u) & (front_v >= -most_v) & (front_w >= -most_w);
    const int8 back = (front_u <= most_u) & (front_v <= most_v) & (front_w <= most_w);
    if (!any8(front | back)) return;
    /* 2: the clear ones at once. Mostly one lane has the nearest hit; of several the lowest triangle counts. */
    const Block block = finish_block(&edges, geometry, index);
    const float8 u = TURN(front_u, block.behind), v = TURN(front_v, block.behind), w = TURN(front_w, block.behind);
    const float8 plane = dot3_8(dx, dy, dz, block.mx, block.my, block.mz);
    const int8 held = LOAD8I(named) >= 0;
    const int8 truly = (u >= 0.0f) & (v >= 0.0f) & (w >= 0.0f);
    const int8 inside = (u >= -block.rounding0) & (v >= -block.rounding1) & (w >= -block.rounding2);
    const float8 flat = PICK(truly, plane, plane * BESIDE);
    const float8 hits = PICK(inside & block.clear & held, flat, (float8)(0.0f));
    const float4 most4 = MOST(hits.lo, hits.hi);
    const float2 most2 = MOST(most4.lo, most4.hi);
    const float nearest = MOST(most2.x, most2.y);
    if (nearest >= walk->best) {
        int lanes = bits8(hits == nearest), lowest = named[lowest_bit(lanes)];
        while (lanes &= lanes - 1) {
            const int other = named[lowest_bit(lanes)];
            lowest = LEAST(other, lowest);
        }
        keep_hit(walk, nearest, lowest);
    }
    /* 3: the others one by one */
    const int8 other = held & ~block.clear;
    if (!any8(other)) return;
    const float *us = (const float *)&u, *vs = (const float *)&v, *ws = (const float *)&w;
    const float *roundings = (const float *)&block.rounding0;
    for (int lanes = bits8(other); lanes; lanes &= lanes - 1) {
        const int j = lowest_bit(lanes);
        keep_hit(walk,
                 needle_inverse_range(geometry, index, j, walk->ox, walk->oy, walk->oz, dx, dy, dz, us[j], vs[j], ws[j],
                                      roundings[j], roundings[8 + j], roundings[16 + j]),
                 named[j]);
    }
}

#ifndef INVERSE
#define INVERSE 0
#endif
#if INVERSE
#define INVERSE_ARGUMENT , global float *inverse_out
#else
#define INVERSE_ARGUMENT
#endif

/* First hits of N rays.
 * One work-item is RAYS rays, of which it has WALKS under way at a time. NDRange (N / RAYS, rounded up). rays (N, 6): origin
 * and UNIT direction, metres, local frame. scene_sphere: centre and radius of the scene. range_out (N) metres, NaN on a
 * miss; triangle_out (N), -1 on a miss. Hits at 0 < range <= range_max. Equal ranges: the lower triangle number.
 * Deterministic: a ray's hit does not depend on the others. */
kernel void cast_rays(global const float *boxes, global const int *children, global const float *geometry,
                      global const int *triangles, global const float *rays, int n_rays, float range_max,
                      float4 scene_sphere, global float *range_out, global int *triangle_out INVERSE_ARGUMENT)
{
    const int first = get_global_id(0) * RAYS, end = LEAST(first + RAYS, n_rays);
    const float best = (1.0f / range_max) * 0.99999f, far = NEAR_SLACK / best;
    Walk walks[WALKS];
    int at_node[WALKS], at_block[WALKS], under_way[WALKS];
    int next = first, n_nodes = 0, n_blocks = 0;
    for (; n_nodes < WALKS && next < end; ++n_nodes) {
        start_walk(&walks[n_nodes], rays, next++, best, far, scene_sphere);
        at_node[n_nodes] = n_nodes;
    }
    while (n_nodes + n_blocks > 0) {
        meet_nodes(walks, at_node, n_nodes, boxes);
        for (int i = 0; i < n_blocks; ++i) meet_block(&walks[WALK(at_block[i])], geometry, triangles);
        const int n = n_nodes + n_blocks;
        for (int i = 0; i < n_nodes; ++i) under_way[i] = at_node[i];
        for (int i = 0; i < n_blocks; ++i) under_way[n_nodes + i] = at_block[i];
        n_nodes = 0, n_blocks = 0;
        for (int i = 0; i < n; ++i) {
            Walk *walk = &walks[WALK(under_way[i])];
            if (!next_child(walk, children)) {
                const float range = 1.0f / walk->best;
                const bool hit = walk->found >= 0 && range <= range_max;
                range_out[walk->ray] = hit ? range : NAN;
                triangle_out[walk->ray] = hit ? walk->found : -1;
#if INVERSE
                inverse_out[walk->ray] = walk->best;
#endif
                if (next == end) continue;
                start_walk(walk, rays, next++, best, far, scene_sphere);
            }
            fetch_ahead(walk->child, boxes, geometry, children, triangles);
            at_node[n_nodes] = at_block[n_blocks] = under_way[i];
            const bool is_block = walk->child < 0;
            n_nodes += !is_block;
            n_blocks += is_block;
        }
    }
}
