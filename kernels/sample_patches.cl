/* Patch mode: which sample points of every patch a position sees, whatever the scanner's resolution.
 *
 * Purpose    Visibility for scanners of 10^7 beams and more, docs/method/patch-mode.md. Range, incidence and spacing
 *            follow on the host from the samples that are seen.
 * Algorithm  A group of up to 16 patches that lie together has a box. What closed some of the last groups is tried
 *            first, on the box and then on the patches; a triangle whose cone from the origin holds all samples of a
 *            patch behind it closes them at once. For what is left the shaft, all beams from the origin to the group,
 *            walks the tree and meets the triangles that can hide anything of it; those close samples, LANES of a patch
 *            side by side, until none is left open (any hit).
 *
 *                  .---- box ----.        p: sample minus origin, NOT normalised, so that the target is at 1: a
 *                 /  . samples .  \       triangle with m = n / K hides it where p . m > 1 + slack and p is inside its
 *                o -----------------      edges. All of it is linear in p: a box is tested by its centre and half size.
 *
 * Samples    pattern[3 s], [3 s + 1]: weights of the patch's second and third vertex; [3 s + 2]: share of the patch
 *            that the sample stands for. The FINE ones after the first RIM count where not all of those are seen. All
 *            lie within the triangle of the first three.
 * Marks      one uint a patch: bit s, sample s is seen.
 * Groups     groups[3 g]: rank of group g's first triangle in `order`; [3 g + 1]: its first code there; [3 g + 2]: its
 *            patches, which run on through the triangles of `order`. group_box[6 g + k]: least, greatest x y z, metres.
 * View       VIEW_ in patch_pack.h.
 *
 * Define         meaning                                               example
 * LANES          patches side by side, 1 or 8                          -DLANES=8
 * STACK          see tree.h
 */
#include "patch_walk.h"

#define ALL_RIM 0x7fu

/* Share of a patch that the samples in `bits` stand for. */
static inline float share_of(uint bits, global const float *pattern)
{
    if (bits == ALL_RIM) return 1.0f;
    float share = 0.0f;
    for (int s = 0; s < RIM + FINE; ++s) share += bits >> s & 1u ? pattern[3 * s + 2] : 0.0f;
    return share;
}

/* Bits of a patch's open samples; of the second pattern only where the first is not seen whole. */
static inline uint open_samples(const Target *t)
{
    uint slots = 0;
    for (int k = 0; k < PACKETS; ++k) slots |= bits_of(t->packets[k].open) << k * LANES;
    const uint first = slots & ALL_RIM;
    return first == ALL_RIM ? first : first | (slots >> FIRST_FINE << RIM);
}

/* Marks of one group of patches from one origin. */
static inline void see_group(global uint *marks, int number, Recent *recent, const Launch *at)
{
    /* 1: all of it out of range, or behind a triangle that hid its neighbours */
    global const float *box = at->group_box + 6 * (size_t)number;
    const Extent e = make_extent(box[0] - at->ox, box[1] - at->oy, box[2] - at->oz, box[3] - at->ox, box[4] - at->oy,
                                 box[5] - at->oz);
    const float gx = MAGNITUDE(e.cx) - e.hx, gy = MAGNITUDE(e.cy) - e.hy, gz = MAGNITUDE(e.cz) - e.hz;
    const float dx = MOST(gx, 0.0f), dy = MOST(gy, 0.0f), dz = MOST(gz, 0.0f);
    if (dx * dx + dy * dy + dz * dz > at->view[VIEW_RANGE_MAX2]) return;
    int8 meets[RECENT_BLOCKS], covers, any = 0;
    for (int k = 0; k < RECENT_BLOCKS; ++k) {
        cull_block(&recent->block[k], &e, &meets[k], &covers);
        any |= covers;
    }
    if (any8(any)) return;
    /* 2: its patches, less those that no beam can land on and those that such a triangle hides */
    Group group;
    group.open = 0;
    group.shaft = make_shaft(&e, at->ox, at->oy, at->oz);
    int rank = at->groups[3 * number], code = at->groups[3 * number + 1];
    const int n_patches = at->groups[3 * number + 2];
    for (int p = 0; p < PACKS; ++p) {
        Pack *pack = &group.packs[p];
        if (p * LANES < n_patches) {
            load_pack(pack, &rank, &code, n_patches - p * LANES, at);
            find_corners(pack, &group.shaft, at->pattern);
            group.open |= (~hardly_met(pack, at->view) & PACK_BITS) << p * LANES;
        } else
            *pack = group.packs[p - 1];
    }
    group.open &= (1u << n_patches) - 1u;
    uint met[RECENT_BLOCKS * BLOCK_LANES];
    for (int k = 0; k < RECENT_BLOCKS; ++k) {
        const int *each = (const int *)&meets[k];
        for (int j = 0; j < BLOCK_LANES; ++j) {
            const int i = k * BLOCK_LANES + j;
            met[i] = 0;
            if (!each[j] || recent->triangle[i] < 0 || group.open == 0) continue;
            uint covered;
            met[i] = test_corners(group.packs, group.open, &recent->block[k], j, recent->triangle[i], &covered);
            group.open &= ~covered;
        }
    }
    /* 3: the samples of the others */
    for (uint left = group.open; left != 0; left &= left - 1) {
        const int i = lowest_bit(left);
        place_samples(&group.targets[i], &group.packs[i / LANES], i % LANES, &at->slots, at->view);
        if (group.targets[i].live == 0) group.open &= ~(1u << i);
    }
    for (int i = 0; i < RECENT_BLOCKS * BLOCK_LANES; ++i)
        if ((met[i] & group.open) != 0)
            test_triangle(&group, &recent->block[i / BLOCK_LANES], i % BLOCK_LANES, -1, recent->triangle[i], met[i],
                          at);
    if (group.open != 0) walk(&group, recent, at);
    /* 4: what a beam can land on */
    for (uint left = group.open; left != 0; left &= left - 1) {
        const int i = lowest_bit(left);
        const uint bits = open_samples(&group.targets[i]);
        const Pack *pack = &group.packs[i / LANES];
        const float returns = expected_returns(pack, i % LANES, share_of(bits, at->pattern), at->view);
        if (returns >= at->view[VIEW_RETURNS]) marks[((const int *)&pack->patch)[i % LANES]] = bits;
    }
}

/* Mark the samples of all patches that every position sees.
 * One work-item is a run of groups of one position. NDRange (runs, positions), any local size. marks (S, n_patches)
 * uint, zeroed by the host; a patch is in one group, whose work-item alone writes it. positions (S, 3) m, local frame.
 * Deterministic: the blocker kept from group to group only spares work. */
kernel void sample_patches(global const float *boxes, global const int *children, global const float *geometry,
                           global const int *triangles, global const int *slot, global const float *edges,
                           global const int *address, global const int *order, global const int *groups,
                           global const float *group_box, int n_groups, int groups_a_run, global const float *pattern,
                           global const float *view, global const float *positions, global uint *marks, int n_patches)
{
    const int run = get_global_id(0), position = get_global_id(1);
    Launch at;
    at.boxes = boxes, at.children = children, at.geometry = geometry, at.triangles = triangles, at.slot = slot;
    at.edges = edges, at.address = address, at.order = order, at.groups = groups, at.group_box = group_box;
    at.pattern = pattern, at.view = view;
    at.ox = positions[3 * position], at.oy = positions[3 * position + 1], at.oz = positions[3 * position + 2];
    load_slots(&at.slots, pattern);
    Recent recent;
    for (int i = 0; i < RECENT_BLOCKS; ++i) {
        float *nothing = (float *)&recent.block[i];
        for (int k = 0; k < 15 * BLOCK_LANES; ++k) nothing[k] = 0.0f;
        recent.block[i].clear = -1;
    }
    recent.next = 0;
    for (int j = 0; j < RECENT_BLOCKS * BLOCK_LANES; ++j) recent.triangle[j] = -1;
    const int first = run * groups_a_run, past = first + groups_a_run, end = past < n_groups ? past : n_groups;
    global uint *mine = marks + (size_t)position * n_patches;
    for (int group = first; group < end; ++group) see_group(mine, group, &recent, &at);
}
