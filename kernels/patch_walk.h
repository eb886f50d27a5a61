/* The walk that closes samples: a group's patches, the triangles that hid much lately, and the tree.
 *
 * Purpose    kernels/sample_patches.cl hands it a group with its samples and reads off which are still open.
 * Algorithm  The shaft of the group walks the tree. Of each block that it meets only those triangles are made ready
 *            whose rectangle overlaps that of a patch with an open sample. Each is tested against the outermost samples
 *            of those patches, LANES of them side by side, which tells the patches that it hides whole and those that
 *            it does not meet; of the others the open packets are tested. A sample p is hidden where it lies within a
 *            triangle's edge planes and p . m > 1 + slack, m = n / K of its plane (block.h). The walk ends when nothing
 *            is open: any hit does. What closed a patch is remembered and tried first on what comes next.
 *
 * Define         meaning                                               example
 * LANES          samples a packet, 1 or 8                              -DLANES=8
 * STACK          see tree.h
 */
#ifndef TLSPLAN_PATCH_WALK_H
#define TLSPLAN_PATCH_WALK_H
#include "patch_pack.h"

/* A triangle that is done with so many patches of a group is tried first on the next groups; so many blocks of them are
 * remembered. Measured: docs/method/patch-mode.md. */
#define WORTH_KEEPING 1
#define RECENT_BLOCKS 4

typedef struct {
    Pack packs[PACKS];
    Target targets[GROUP_PATCHES]; /* of open patches */
    Shaft shaft;
    uint open;  /* patches that have an open sample, a bit each */
    int n_wide; /* of them when the shaft's rectangle was made */
} Group;

/* Triangles that hid much lately: neighbours are often hidden by the same. */
typedef struct {
    Block block[RECENT_BLOCKS];
    int triangle[RECENT_BLOCKS * BLOCK_LANES];
    int next;
} Recent;

static inline int count_bits(uint bits)
{
    bits -= (bits >> 1) & 0x55555555u;
    bits = (bits & 0x33333333u) + ((bits >> 2) & 0x33333333u);
    return (int)((((bits + (bits >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24);
}

/* Which samples of a packet a triangle that is not clear hides (lane j of block `index`). */
static inline lanes_i needle_hides(const float *n, int j, int index, const Packet *s, float far, const Launch *at)
{
    const lanes_f range = sqrt(s->x * s->x + s->y * s->y + s->z * s->z), per = 1.0f / range;
    const lanes_f x = s->x * per, y = s->y * per, z = s->z * per;
    const lanes_f u = dot3_lanes(x, y, z, n[j], n[8 + j], n[16 + j]);
    const lanes_f v = dot3_lanes(x, y, z, n[24 + j], n[32 + j], n[40 + j]);
    const lanes_f w = dot3_lanes(x, y, z, n[48 + j], n[56 + j], n[64 + j]);
    const lanes_f inverse = needle_inverse_range(at->geometry, index, j, at->ox, at->oy, at->oz, x, y, z, u, v, w,
                                                 n[96 + j], n[104 + j], n[112 + j]);
    return MASK(inverse * range > far);
}

/* Close the samples of a patch that triangle j of a block, another than its own, hides. Returns whether it hid any. */
static inline bool close_samples(Target *t, const Block *block, int j, int index, const Launch *at)
{
    const float *n = (const float *)block; /* n0x .. n2z, mx .. mz, rounding0 .. 2: eight lanes each */
    const float ux = n[j], uy = n[8 + j], uz = n[16 + j], vx = n[24 + j], vy = n[32 + j], vz = n[40 + j];
    const float wx = n[48 + j], wy = n[56 + j], wz = n[64 + j], mx = n[72 + j], my = n[80 + j], mz = n[88 + j];
    const float rounding0 = -n[96 + j], rounding1 = -n[104 + j], rounding2 = -n[112 + j], far = t->far;
    const bool clear = ((const int *)&block->clear)[j] != 0;
    uint live = t->live;
    lanes_i closed = 0;
    for (int k = 0; k < PACKETS; ++k) {
        if (!(live >> k & 1)) continue;
        Packet *s = &t->packets[k];
        const lanes_f x = s->x, y = s->y, z = s->z, reach = s->reach;
        lanes_i hidden = MASK(dot3_lanes(x, y, z, ux, uy, uz) >= rounding0 * reach) &
                         MASK(dot3_lanes(x, y, z, vx, vy, vz) >= rounding1 * reach) &
                         MASK(dot3_lanes(x, y, z, wx, wy, wz) >= rounding2 * reach) &
                         MASK(dot3_lanes(x, y, z, mx, my, mz) > far);
        if (!clear) hidden = needle_hides(n, j, index, s, far, at);
        const lanes_i open = s->open & ~hidden;
        closed |= s->open & hidden;
        s->open = open;
        live &= ~(any_lane(open) ? 0u : 1u << k);
    }
    t->live = live;
    return any_lane(closed);
}

/* Draw the rectangle of a lane's patch in to its open samples. */
static inline void fit_patch(Pack *pack, int lane, const Target *t, const Shaft *shaft)
{
    lanes_f west = WIDE, east = -WIDE, south = WIDE, north = -WIDE, deepest = -WIDE;
    for (int k = 0; k < PACKETS; ++k) {
        if (!(t->live >> k & 1)) continue;
        const lanes_f *p = &t->packets[k].x;
        const lanes_i open = t->packets[k].open;
        const lanes_f depth = shaft->sign * p[shaft->depth], per = 1.0f / depth;
        const lanes_f right = p[shaft->right] * per, up = p[shaft->up] * per;
        west = PICK(open & MASK(right < west), right, west), east = PICK(open & MASK(right > east), right, east);
        south = PICK(open & MASK(up < south), up, south), north = PICK(open & MASK(up > north), up, north);
        deepest = PICK(open & MASK(depth > deepest), depth, deepest);
    }
    ((float *)&pack->west)[lane] = -greatest_lane(-west), ((float *)&pack->east)[lane] = greatest_lane(east);
    ((float *)&pack->south)[lane] = -greatest_lane(-south), ((float *)&pack->north)[lane] = greatest_lane(north);
    ((float *)&pack->deepest)[lane] = greatest_lane(deepest);
}

/* Which of a group's patches triangle j of a block, a clear one, can hide part of, and which it hides whole. */
static inline uint test_corners(const Pack *packs, uint patches, const Block *block, int j, int triangle, uint *covered)
{
    const float *n = (const float *)block;
    const float size = MAGNITUDE(n[72 + j]) + MAGNITUDE(n[80 + j]) + MAGNITUDE(n[88 + j]);
    uint met = 0;
    *covered = 0;
    for (int p = 0; p < PACKS; ++p) {
        const Pack *pack = &packs[p];
        if ((patches >> p * LANES & PACK_BITS) == 0) continue;
        lanes_i beside = 0, covers = MASK(pack->own != triangle);
        for (int k = 0; k < 4; ++k) {
            lanes_f least, most;
            for (int v = 0; v < 3; ++v) {
                const lanes_f at = dot3_lanes(pack->corner[v][0], pack->corner[v][1], pack->corner[v][2],
                                              n[24 * k + j], n[24 * k + 8 + j], n[24 * k + 16 + j]);
                least = v == 0 ? at : LEAST(at, least);
                most = v == 0 ? at : MOST(at, most);
            }
            if (k < 3) {
                const lanes_f slack = (2.0f * pack->reach) * n[96 + 8 * k + j];
                beside |= MASK(most < -slack);
                covers &= MASK(least > slack);
            } else {
                const lanes_f pad = SHAFT_PAD * pack->reach * size;
                beside |= MASK(most + pad <= 1.0f);
                covers &= MASK(least - pad > 1.0f + COVER_SLACK);
            }
        }
        met |= bits_of(MASK(pack->own != triangle) & ~beside) << p * LANES;
        *covered |= bits_of(covers) << p * LANES;
    }
    return met;
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

/* Test triangle j of a block against `patches` of a group, a bit each. Returns how many are done with by that. */
static inline int test_triangle(Group *group, const Block *block, int j, int index, int triangle, uint patches,
                                const Launch *at)
{
    const uint before = group->open;
    patches &= before;
    if (((const int *)&block->clear)[j] != 0) {
        uint covered;
        patches &= test_corners(group->packs, patches, block, j, triangle, &covered);
        patches &= ~covered;
        group->open &= ~covered;
    }
    for (uint left = patches; left != 0; left &= left - 1) {
        const int i = lowest_bit(left);
        Target *t = &group->targets[i];
        if (t->own == triangle) continue;
        if (!close_samples(t, block, j, index, at)) continue;
        if (t->live == 0)
            group->open &= ~(1u << i);
        else if (group->shaft.has_image)
            fit_patch(&group->packs[i / LANES], i % LANES, t, &group->shaft);
    }
    return count_bits(before & ~group->open);
}

/* The rectangle round the open patches. */
static inline void fit_shaft(Group *group)
{
    Shaft *s = &group->shaft;
    group->n_wide = count_bits(group->open);
    if (!s->has_image) return;
    s->west = s->south = WIDE, s->east = s->north = s->deepest = -WIDE;
    for (uint left = group->open; left != 0; left &= left - 1) {
        const int i = lowest_bit(left), lane = i % LANES;
        const Pack *pack = &group->packs[i / LANES];
#define OF(v) ((const float *)&(v))[lane]
        s->west = LEAST(OF(pack->west), s->west), s->east = MOST(OF(pack->east), s->east);
        s->south = LEAST(OF(pack->south), s->south), s->north = MOST(OF(pack->north), s->north);
        s->deepest = MOST(OF(pack->deepest), s->deepest);
#undef OF
    }
    const float right = MOST(s->east, -s->west), up = MOST(s->north, -s->south);
    s->oblique = 1.0f + right + up;
}

/* Patches, a bit each, whose rectangle a triangle's overlaps. */
static inline uint overlapped(const Pack *packs, const Images *images, int j)
{
#define OF(v) ((const float *)&images->v)[j]
    const float west = OF(west), east = OF(east), south = OF(south), north = OF(north), nearest = OF(nearest);
#undef OF
    uint bits = 0;
    for (int p = 0; p < PACKS; ++p)
        bits |= bits_of(MASK(packs[p].east >= west) & MASK(packs[p].west <= east) & MASK(packs[p].north >= south) &
                        MASK(packs[p].south <= north) & MASK(packs[p].deepest * DEPTH_PAD >= nearest))
                << p * LANES;
    return bits;
}

static inline void test_block(Group *group, int index, Recent *recent, const Launch *at)
{
    Images images;
    const int8 meets = project_block(at->geometry, index, &group->shaft, &images);
    uint patches[BLOCK_LANES], any = 0, triangles = bits8(meets);
    for (uint left = triangles; left != 0; left &= left - 1) {
        const int j = lowest_bit(left);
        patches[j] = overlapped(group->packs, &images, j) & group->open;
        any |= patches[j];
    }
    if (any == 0) return;
    const Block block = prepare_block(at->geometry, index, at->ox, at->oy, at->oz);
    for (uint left = triangles; left != 0; left &= left - 1) {
        const int j = lowest_bit(left), triangle = at->triangles[index * BLOCK_LANES + j];
        if (triangle < 0 || (patches[j] & group->open) == 0) continue;
        const int closed = test_triangle(group, &block, j, index, triangle, patches[j], at);
        if (closed >= WORTH_KEEPING && ((const int *)&block.clear)[j] != 0) remember(recent, &block, j, triangle);
    }
    if (4 * count_bits(group->open) <= 3 * group->n_wide) fit_shaft(group);
}

/* Walk the tree with the shaft until nothing is left open. */
static inline void walk(Group *group, Recent *recent, const Launch *at)
{
    Stack stack;
    stack.size = 0;
    fit_shaft(group);
    for (int child = 0; child != NO_CHILD && group->open != 0; child = pop_child(&stack, at->children)) {
        if (child >= 0) {
            float8 key;
            const int8 keep = cull_node(child, &group->shaft, at->boxes, at->ox, at->oy, at->oz, &key);
            if (any8(keep)) push_children(&stack, child, keep, key);
        } else
            test_block(group, ~child, recent, at);
    }
}

#endif
