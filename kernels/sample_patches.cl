/* Patch mode: which sample points of every patch a position sees, whatever the scanner's resolution.
 *
 * Purpose    Visibility for scanners of 10^7 beams and more, docs/method/patch-mode.md. Range, incidence and spacing
 *            follow on the host from the samples that are seen.
 * Algorithm  A group of up to 16 patches that lie together has a box. Its shaft, the hull of the box and the origin,
 *            walks the tree and meets the triangles that can hide anything of it; those close samples, LANES
 *            patches side by side, until none is left open (any hit). A triangle whose cone from the origin holds a
 *            whole box behind it closes all of that box at once. What closed much of the last groups is tried first.
 *
 *                  .---- box ----.        p: sample minus origin, NOT normalised, so that the target is at 1: a
 *                 /  . samples .  \       triangle with m = n / K hides it where p . m > 1 + slack and p is inside its
 *                o -----------------      edges. All of it is linear in p: a box is tested by its centre and half size.
 *
 * Samples    pattern[3 s], [3 s + 1]: weights of the patch's second and third vertex; [3 s + 2]: share of the patch
 *            that the sample stands for. The first RIM samples are cast always, the other FINE ones where not all of
 *            those are seen: a patch that one triangle hides whole is never asked for them.
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

#define GROUP_PATCHES 16
#define PACKS (GROUP_PATCHES / LANES)
#define ALL_RIM 0x7fu

/* Patch `lane` of a pack in all lanes, with the second pattern as its samples. */
static inline void spread(Target *to, const Pack *from, int lane, const Launch *at)
{
    const float *values = (const float *)from;
    lanes_f *all = (lanes_f *)&to->pack;
    for (int k = 0; k < (int)(sizeof(Pack) / sizeof(lanes_f)); ++k) all[k] = values[k * LANES + lane];
    for (int packet = 0; packet < FINE_PACKETS; ++packet) {
        lanes_f wb = 0.0f, wc = 0.0f;
        lanes_i real = 0;
        for (int i = 0; i < LANES; ++i) {
            const int k = packet * LANES + i < FINE ? packet * LANES + i : FINE - 1;
            ((float *)&wb)[i] = at->pattern[3 * (RIM + k)];
            ((float *)&wc)[i] = at->pattern[3 * (RIM + k) + 1];
            ((int *)&real)[i] = packet * LANES + i < FINE ? -1 : 0;
        }
        to->samples[packet] = place(&to->pack, wb, wc);
        look(&to->samples[packet], &to->pack, at->view);
        to->samples[packet].open &= real;
    }
    bound(to, FINE_PACKETS);
}

/* Add the second pattern to the bits of a group's patches that are not seen whole. */
static inline void refine(uint *bits, const Target *packs, int n_patches, Recent *recent, const Shaft *shaft,
                          const Launch *at)
{
    Target targets[GROUP_PATCHES];
    int patch[GROUP_PATCHES], n = 0;
    for (int i = 0; i < n_patches; ++i) {
        const Target *pack = &packs[i / LANES];
        if (bits[i] == ALL_RIM || pack->covered) continue;
        const Extent own = patch_extent(&pack->pack, i % LANES);
        if (hidden_by_recent(recent, &own)) continue;
        spread(&targets[n], &pack->pack, i % LANES, at);
        patch[n] = i;
        n += targets[n].n_live > 0 ? 1 : 0;
    }
    if (test_recent(targets, n, recent, at) > 0) walk(targets, n, recent, shaft, at);
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < targets[i].n_live; ++k) {
            const int packet = targets[i].live[k];
            const int *open = (const int *)&targets[i].samples[packet].open;
            for (int lane = 0; lane < LANES; ++lane)
                bits[patch[i]] |= (open[lane] != 0 ? 1u : 0u) << ((RIM + packet * LANES + lane) & 31);
        }
}

/* Share of a patch that the samples in `bits` stand for. */
static inline float share_of(uint bits, global const float *pattern)
{
    if (bits == ALL_RIM) return 1.0f;
    float share = 0.0f;
    for (int s = 0; s < RIM + FINE; ++s) share += bits >> s & 1u ? pattern[3 * s + 2] : 0.0f;
    return share;
}

/* Marks of one group of patches from one origin. */
static inline void see_group(global uint *marks, int group, Recent *recent, const Launch *at)
{
    /* 1: all of it out of range, or behind a triangle that hid its neighbours */
    const Shaft shaft = make_shaft(at->group_box + 6 * (size_t)group, at->ox, at->oy, at->oz);
    const Extent *e = &shaft.extent;
    const float gx = MAGNITUDE(e->cx) - e->hx, gy = MAGNITUDE(e->cy) - e->hy, gz = MAGNITUDE(e->cz) - e->hz;
    const float dx = MOST(gx, 0.0f), dy = MOST(gy, 0.0f), dz = MOST(gz, 0.0f);
    if (dx * dx + dy * dy + dz * dz > at->view[VIEW_RANGE_MAX2] || hidden_by_recent(recent, e)) return;
    /* 2: the first pattern */
    Target packs[PACKS];
    int rank = at->groups[3 * group], code = at->groups[3 * group + 1], n_open = 0;
    const int n_patches = at->groups[3 * group + 2], n_packs = (n_patches + LANES - 1) / LANES;
    for (int p = 0; p < n_packs; ++p) {
        Target *t = &packs[p];
        load_pack(&t->pack, &rank, &code, n_patches - p * LANES, at);
        for (int k = 0; k < RIM; ++k) {
            t->samples[k] = place(&t->pack, at->pattern[3 * k], at->pattern[3 * k + 1]);
            look(&t->samples[k], &t->pack, at->view);
        }
        bound(t, RIM);
        n_open += t->n_live > 0 ? 1 : 0;
    }
    if (n_open > 0 && test_recent(packs, n_packs, recent, at) > 0) walk(packs, n_packs, recent, &shaft, at);
    uint bits[GROUP_PATCHES];
    for (int i = 0; i < GROUP_PATCHES; ++i) bits[i] = 0;
    for (int p = 0; p < n_packs; ++p)
        for (int k = 0; k < packs[p].n_live; ++k) {
            const int packet = packs[p].live[k];
            const int *open = (const int *)&packs[p].samples[packet].open;
            for (int lane = 0; lane < LANES; ++lane) bits[p * LANES + lane] |= (open[lane] != 0 ? 1u : 0u) << packet;
        }
    /* 3: the second one where the first did not see all */
    refine(bits, packs, n_patches, recent, &shaft, at);
    /* 4: what a beam can land on */
    for (int i = 0; i < n_patches; ++i) {
        if (bits[i] == 0) continue;
        const Pack *pack = &packs[i / LANES].pack;
        const float returns = expected_returns(pack, i % LANES, share_of(bits[i], at->pattern), at->view);
        if (returns >= at->view[VIEW_RETURNS]) marks[((const int *)&pack->patch)[i % LANES]] = bits[i];
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
