/* The walk that closes samples: targets, the triangles that hid much lately, and the tree.
 *
 * Purpose    kernels/sample_patches.cl hands it the samples of a group and reads off which are still open.
 * Algorithm  A target is samples that are tested together, in packets of LANES, with their box. The shaft of the group
 *            walks the tree; each triangle that the shaft meets is tested against the targets' boxes, then the
 *            open samples of those that it meets. A sample p is hidden where it lies within its edge planes
 *            and p . m > 1 + slack, m = n / K of its plane (block.h). The walk ends when nothing is open: any
 *            hit does. A triangle that closed much is remembered and tried first on what comes next.
 *
 * Define         meaning                                               example
 * LANES          samples a packet, 1 or 8                              -DLANES=8
 * STACK          see tree.h
 */
#ifndef TLSPLAN_PATCH_WALK_H
#define TLSPLAN_PATCH_WALK_H
#include "patch_pack.h"

/* Samples of the first pattern and of the second, and packets of either. */
#define RIM 7
#define FINE 22
#define FINE_PACKETS ((FINE + LANES - 1) / LANES)
#define MOST_PACKETS (RIM > FINE_PACKETS ? RIM : FINE_PACKETS)

/* A triangle that is done with so many packets at once is tried first on the next groups; so many blocks of them are
 * remembered. Measured: 1 to 7 packets, 1 to 4 blocks differ by some percent. */
#define WORTH_KEEPING 3
#define RECENT_BLOCKS 2

/* Samples that are tested together: the first pattern of LANES patches, or the second of one. */
typedef struct {
    Pack pack;
    Extent extent;
    Sample samples[MOST_PACKETS];
    int live[MOST_PACKETS], n_live; /* packets that have an open sample */
    bool covered;                   /* one triangle hides all of the extent */
} Target;

/* Triangles that hid much lately: neighbours are often hidden by the same. */
typedef struct {
    Block block[RECENT_BLOCKS];
    int triangle[RECENT_BLOCKS * BLOCK_LANES];
    int next;
} Recent;

static inline bool any_lane(lanes_i mask)
{
#if LANES == 8
    return any8(mask);
#else
    const int *each = (const int *)&mask;
    int any = 0;
    for (int lane = 0; lane < LANES; ++lane) any |= each[lane];
    return any != 0;
#endif
}

/* Which samples of a packet a triangle that is not clear hides (lane j of block `index`). */
static inline lanes_i needle_hides(const float *n, int j, int index, const Sample *s, const Pack *pack,
                                   const Launch *at)
{
    const lanes_f range = sqrt(s->x * s->x + s->y * s->y + s->z * s->z), per = 1.0f / range;
    const lanes_f x = s->x * per, y = s->y * per, z = s->z * per;
    const lanes_f u = dot3_lanes(x, y, z, n[j], n[8 + j], n[16 + j]);
    const lanes_f v = dot3_lanes(x, y, z, n[24 + j], n[32 + j], n[40 + j]);
    const lanes_f w = dot3_lanes(x, y, z, n[48 + j], n[56 + j], n[64 + j]);
    const lanes_f inverse = needle_inverse_range(at->geometry, index, j, at->ox, at->oy, at->oz, x, y, z, u, v, w,
                                                 n[96 + j], n[104 + j], n[112 + j]);
    return MASK(inverse * range > pack->far);
}

/* Close the samples of a target that triangle j of a block hides. Returns how many packets are done with by that. */
static inline int close_samples(Target *t, const Block *block, int j, int index, int triangle, const Launch *at)
{
    const float *n = (const float *)block; /* n0x .. n2z, mx .. mz, rounding0 .. 2: eight lanes each */
    const float ux = n[j], uy = n[8 + j], uz = n[16 + j], vx = n[24 + j], vy = n[32 + j], vz = n[40 + j];
    const float wx = n[48 + j], wy = n[56 + j], wz = n[64 + j], mx = n[72 + j], my = n[80 + j], mz = n[88 + j];
    const lanes_f least_u = -n[96 + j] * t->pack.reach, least_v = -n[104 + j] * t->pack.reach;
    const lanes_f least_w = -n[112 + j] * t->pack.reach, far = t->pack.far;
    const lanes_i other = MASK(t->pack.own != triangle);
    const bool clear = ((const int *)&block->clear)[j] != 0;
    int n_live = 0;
    for (int k = 0; k < t->n_live; ++k) {
        const int packet = t->live[k];
        Sample *s = &t->samples[packet];
        const lanes_f x = s->x, y = s->y, z = s->z;
        lanes_i hidden = MASK(dot3_lanes(x, y, z, ux, uy, uz) >= least_u) &
                         MASK(dot3_lanes(x, y, z, vx, vy, vz) >= least_v) &
                         MASK(dot3_lanes(x, y, z, wx, wy, wz) >= least_w) &
                         MASK(dot3_lanes(x, y, z, mx, my, mz) > far) & other;
        if (!clear) hidden = other & needle_hides(n, j, index, s, &t->pack, at);
        const lanes_i open = s->open & ~hidden;
        s->open = open;
        t->live[n_live] = packet;
        n_live += any_lane(open) ? 1 : 0;
    }
    const int closed = t->n_live - n_live;
    t->n_live = n_live;
    return closed;
}

/* Remember triangle j of a block. */
static inline void remember(Recent *recent, const Block *block, int j, int triangle)
{
    const float *from = (const float *)block;
    const int at = recent->next % BLOCK_LANES;
    Block *into = &recent->block[recent->next / BLOCK_LANES];
    float *to = (float *)into;
    for (int k = 0; k < 15; ++k) to[8 * k + at] = from[8 * k + j];
    ((int *)&into->clear)[at] = -1;
    recent->triangle[recent->next] = triangle;
    recent->next = (recent->next + 1) % (RECENT_BLOCKS * BLOCK_LANES);
}

/* Test targets against a block of triangles[0 .. 7]. Returns how many have open samples left. */
static inline int test_block(Target *targets, int n_targets, const Block *block, int index, const int *triangles,
                             Recent *recent, const Launch *at)
{
    int n_open = 0;
    for (int i = 0; i < n_targets; ++i) {
        Target *t = &targets[i];
        if (t->n_live == 0) continue;
        int8 meets8, covers8;
        cull_block(block, &t->extent, &meets8, &covers8);
        if (any8(meets8)) {
            const int *meets = (const int *)&meets8, *covers = (const int *)&covers8;
            const int *clear = (const int *)&block->clear;
            for (int j = 0; j < BLOCK_LANES && t->n_live > 0; ++j) {
                if (!meets[j] || triangles[j] < 0) continue;
                int closed = t->n_live;
                if (covers[j]) {
                    t->n_live = 0;
                    t->covered = true;
                } else
                    closed = close_samples(t, block, j, index, triangles[j], at);
                if (recent != 0 && closed >= WORTH_KEEPING && clear[j]) remember(recent, block, j, triangles[j]);
            }
        }
        n_open += t->n_live > 0 ? 1 : 0;
    }
    return n_open;
}

/* Walk the tree with the shaft until nothing is left open. */
static inline void walk(Target *targets, int n_targets, Recent *recent, const Shaft *shaft, const Launch *at)
{
    Stack stack;
    stack.size = 0;
    int n_open = n_targets;
    for (int child = 0; child != NO_CHILD && n_open > 0; child = pop_child(&stack, at->children)) {
        int8 covers, meets;
        if (child >= 0) {
            float8 key;
            const int8 keep = cull_node(child, shaft, at->boxes, at->ox, at->oy, at->oz, &key);
            if (any8(keep)) push_children(&stack, child, keep, key);
            continue;
        }
        const Block block = prepare_block(at->geometry, ~child, at->ox, at->oy, at->oz);
        cull_block(&block, &shaft->extent, &meets, &covers);
        if (!any8(meets)) continue;
        int triangles[BLOCK_LANES];
        for (int j = 0; j < BLOCK_LANES; ++j) triangles[j] = at->triangles[~child * BLOCK_LANES + j];
        n_open = test_block(targets, n_targets, &block, ~child, triangles, recent, at);
    }
}

/* The box of a target's samples, and the list of its packets that have an open one. */
static inline void bound(Target *t, int n_packets)
{
    lanes_f x0 = 1e30f, y0 = 1e30f, z0 = 1e30f, x1 = -1e30f, y1 = -1e30f, z1 = -1e30f;
    t->n_live = 0;
    for (int k = 0; k < n_packets; ++k) {
        const Sample *s = &t->samples[k];
        x0 = LEAST(s->x, x0), y0 = LEAST(s->y, y0), z0 = LEAST(s->z, z0);
        x1 = MOST(s->x, x1), y1 = MOST(s->y, y1), z1 = MOST(s->z, z1);
        t->live[t->n_live] = k;
        t->n_live += any_lane(s->open) ? 1 : 0;
    }
    const float *px0 = (const float *)&x0, *py0 = (const float *)&y0, *pz0 = (const float *)&z0;
    const float *px1 = (const float *)&x1, *py1 = (const float *)&y1, *pz1 = (const float *)&z1;
    float lx = px0[0], ly = py0[0], lz = pz0[0], hx = px1[0], hy = py1[0], hz = pz1[0];
    for (int lane = 1; lane < LANES; ++lane) {
        lx = LEAST(px0[lane], lx), ly = LEAST(py0[lane], ly), lz = LEAST(pz0[lane], lz);
        hx = MOST(px1[lane], hx), hy = MOST(py1[lane], hy), hz = MOST(pz1[lane], hz);
    }
    t->extent = make_extent(lx, ly, lz, hx, hy, hz);
    t->covered = false;
}

/* Whether one of the triangles that hid much lately hides all of a box. */
static inline bool hidden_by_recent(const Recent *recent, const Extent *e)
{
    int8 meets, covers, any = 0;
    for (int k = 0; k < RECENT_BLOCKS; ++k) {
        cull_block(&recent->block[k], e, &meets, &covers);
        any |= covers;
    }
    return any8(any);
}

/* Test targets against the triangles that hid much lately. Returns how many have open samples left. */
static inline int test_recent(Target *targets, int n_targets, const Recent *recent, const Launch *at)
{
    int n_open = n_targets;
    for (int k = 0; k < RECENT_BLOCKS && n_open > 0; ++k)
        n_open = test_block(targets, n_targets, &recent->block[k], -1, recent->triangle + BLOCK_LANES * k, 0, at);
    return n_open;
}

#endif
