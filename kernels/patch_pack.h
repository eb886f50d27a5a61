/* Packs: LANES patches side by side, the samples on them, and whether a beam of the scanner can meet those.
 *
 * Purpose    kernels/sample_patches.cl loads groups of patches as packs and places the samples of those that need it;
 *            patch_walk.h closes samples that are hidden.
 * Patches    A patch is (triangle, code), docs/method/patches.md: bisecting the triangle by the code gives the weights
 *            of the patch's vertices a, b, c, exactly. A sample has weights at a, b, c: a place, minus the origin.
 * Slots      Samples of a patch lie in 32 slots, LANES of them a packet: the RIM ones of the first pattern, a spare one
 *            like the last of them, the FINE ones of the second, two spare ones like the last.
 * View       VIEW_ below: limits of the scanner. "Signed square" of s is s |s|: comparisons of angles without a root.
 *
 * Define         meaning                                               example
 * LANES          patches side by side, samples a packet: 1 or 8        -DLANES=8
 */
#ifndef TLSPLAN_PATCH_PACK_H
#define TLSPLAN_PATCH_PACK_H
#include "shaft.h"

/* Rows and columns that a patch must span for a beam to be expected on it: then one meets it half of the time. */
#define LEAST_SPAN 0.5f

#define VIEW_RANGE_MIN2 0  /* m^2 */
#define VIEW_RANGE_MAX2 1  /* m^2 */
#define VIEW_LOW 2         /* signed square of the sine of the least elevation */
#define VIEW_HIGH 3        /* ... of the greatest */
#define VIEW_AZIMUTH_X 4   /* middle of the azimuths: cosine, */
#define VIEW_AZIMUTH_Y 5   /* sine, */
#define VIEW_AZIMUTH 6     /* and signed square of the cosine of half their width; -2 for a full turn */
#define VIEW_LEAST_COS2 7  /* square of the cosine of the greatest incidence */
#define VIEW_COLUMN 8      /* azimuth step, rad */
#define VIEW_ROW 9         /* elevation step, rad */
#define VIEW_RETURNS 10    /* expected returns below which a patch does not count as seen */
#define VIEW_SLACK 11      /* share of the range within which a surface does not hide the target */
#define VIEW_ROUNDING 12   /* rounding of the scene's coordinates, m */

/* Samples of the first pattern and of the second. */
#define RIM 7
#define FINE 22
#define SLOTS 32
#define FIRST_FINE 8
#define PACKETS (SLOTS / LANES)

#define GROUP_PATCHES 16
#define PACKS (GROUP_PATCHES / LANES)
#define PACK_BITS ((1u << LANES) - 1u)

typedef struct {
    lanes_f x, y, z; /* samples minus origin, metres */
    lanes_f reach;   /* not less than the distance of the slot's samples, metres: rounding grows with it */
    lanes_i open;    /* -1: within view and nothing hides it so far */
} Packet;

/* One patch's samples. */
typedef struct {
    Packet packets[PACKETS];
    float far;  /* 1 + slack: what hides its samples has p . m above it */
    int own;    /* triangle */
    uint live;  /* packets that have an open sample, a bit each */
} Target;

/* Weights of all slots; -1 where it is not a spare one. */
typedef struct {
    lanes_f b[PACKETS], c[PACKETS];
    lanes_i real[PACKETS];
} Slots;

/* LANES patches. */
typedef struct {
    lanes_f far, reach; /* as in Target; not less than the distance of the samples, metres */
    lanes_i own;        /* triangle; -1 in an empty lane */
    lanes_i patch;
    lanes_f corner[3][3];                      /* of the triangle that holds all samples, minus the origin */
    lanes_f west, east, south, north, deepest;   /* rectangle of its image, shaft.h */
    lanes_f vx, vy, vz, ex, ey, ez, fx, fy, fz; /* vertex 0 minus origin, edges 01 and 02 */
    lanes_f a1, a2, b1, b2, c1, c2;             /* weights of vertices 1 and 2 at the patch's vertices a, b, c: exact */
} Pack;

/* What every function below needs of the scene and the launch. */
typedef struct {
    global const float *boxes, *geometry, *edges, *group_box, *pattern, *view;
    global const int *children, *triangles, *slot, *address, *order, *groups;
    float ox, oy, oz;
    Slots slots;
} Launch;

static inline lanes_f signed_square(lanes_f x)
{
    return PICK(MASK(x < 0.0f), -(x * x), x * x);
}

static inline bool any_lane(lanes_i mask)
{
#if LANES == 1
    return mask != 0;
#else
    return any8(mask);
#endif
}

/* Samples with weights (wb, wc) of the patches' vertices b and c. */
static inline void place(const Pack *pack, float wb, float wc, lanes_f *x, lanes_f *y, lanes_f *z)
{
    const float wa = 1.0f - wb - wc;
    const lanes_f l1 = wa * pack->a1 + wb * pack->b1 + wc * pack->c1;
    const lanes_f l2 = wa * pack->a2 + wb * pack->b2 + wc * pack->c2;
    *x = pack->vx + (l1 * pack->ex + l2 * pack->fx);
    *y = pack->vy + (l1 * pack->ey + l2 * pack->fy);
    *z = pack->vz + (l1 * pack->ez + l2 * pack->fz);
}

static inline float greatest_lane(lanes_f x)
{
#if LANES == 1
    return x;
#else
    const float4 most4 = MOST(x.lo, x.hi);
    const float2 most2 = MOST(most4.lo, most4.hi);
    return MOST(most2.x, most2.y);
#endif
}

/* From the reach of each slot's own sample to what it counts with: the first pattern's samples with the greatest of
 * theirs, the second's with that and those that are a multiple of eight slots away. So it is for any LANES. */
static inline void spread_reach(Packet *packets)
{
#if LANES == 8
    const float rim = greatest_lane(packets[0].reach);
    const lanes_f second = MOST(packets[2].reach, packets[1].reach), fine = MOST(packets[3].reach, second);
    packets[0].reach = rim;
    packets[1].reach = packets[2].reach = packets[3].reach = MOST(fine, rim);
#else
    float rim = packets[0].reach;
    for (int slot = 1; slot < FIRST_FINE; ++slot) rim = MOST(packets[slot].reach, rim);
    for (int slot = 0; slot < FIRST_FINE; ++slot) packets[slot].reach = rim;
    for (int slot = FIRST_FINE; slot < 2 * FIRST_FINE; ++slot) {
        float most = rim;
        for (int same = slot; same < SLOTS; same += 8) most = MOST(packets[same].reach, most);
        for (int same = slot; same < SLOTS; same += 8) packets[same].reach = most;
    }
#endif
}

static inline lanes_f magnitude(lanes_f x)
{
    return PICK(MASK(x < 0.0f), -x, x);
}

/* Weights of vertices 1 and 2 at the patch's own vertices, by the rule of docs/method/patches.md. Halves of halves are
 * exact in float32 as long as the depth is below 24, and so are the weights. */
static inline void find_patch(Pack *pack, lanes_i code, lanes_i depth, int deepest, lanes_f q01, lanes_f q12,
                              lanes_f q20)
{
    lanes_f a1 = 0.0f, a2 = 0.0f, b1 = 1.0f, b2 = 0.0f, c1 = 0.0f, c2 = 1.0f;
    for (int level = 0; level < deepest; ++level) {
        const lanes_i live = MASK(depth > level);
        const lanes_i second = MASK(((code >> ((depth - 1 - level) & 31)) & 1) != 0);
        const lanes_i is01 = MASK(q01 >= q12) & MASK(q01 >= q20), is12 = MASK(q12 >= q20);
        const lanes_f ra1 = PICK(is01, a1, PICK(is12, b1, c1)), ra2 = PICK(is01, a2, PICK(is12, b2, c2));
        const lanes_f rb1 = PICK(is01, b1, PICK(is12, c1, a1)), rb2 = PICK(is01, b2, PICK(is12, c2, a2));
        const lanes_f rc1 = PICK(is01, c1, PICK(is12, a1, b1)), rc2 = PICK(is01, c2, PICK(is12, a2, b2));
        const lanes_f qab = PICK(is01, q01, PICK(is12, q12, q20)), qbc = PICK(is01, q12, PICK(is12, q20, q01));
        const lanes_f qca = PICK(is01, q20, PICK(is12, q01, q12));
        const lanes_f qcm = (2.0f * qca + 2.0f * qbc - qab) / 4.0f;
        const lanes_f m1 = 0.5f * (ra1 + rb1), m2 = 0.5f * (ra2 + rb2);
        a1 = PICK(live, PICK(second, m1, ra1), a1), a2 = PICK(live, PICK(second, m2, ra2), a2);
        b1 = PICK(live, PICK(second, rb1, m1), b1), b2 = PICK(live, PICK(second, rb2, m2), b2);
        c1 = PICK(live, rc1, c1), c2 = PICK(live, rc2, c2);
        q01 = qab / 4.0f;
        q12 = PICK(second, qbc, qcm);
        q20 = PICK(second, qcm, qca);
    }
    pack->a1 = a1, pack->a2 = a2, pack->b1 = b1, pack->b2 = b2, pack->c1 = c1, pack->c2 = c2;
}

/* The next LANES patches of a group, from triangle order[*rank] and *code on; `left` of them are there, the other lanes
 * repeat the last one and belong to no triangle. */
static inline void load_pack(Pack *pack, int *rank, int *code, int left, const Launch *at)
{
    /* Vectors that are filled lane by lane: an array of ints need not be aligned to be read as one. */
    lanes_i own8, patch8, path8, depth8;
    lanes_f corner8[12], squared8[3];
    int *own = (int *)&own8, *patch = (int *)&patch8, *path = (int *)&path8, *depth = (int *)&depth8;
    float *corner = (float *)corner8, *squared = (float *)squared8;
    int deepest = 0;
    for (int lane = 0; lane < LANES; ++lane) {
        const int triangle = at->order[*rank];
        const bool real = lane < left;
        own[lane] = real ? triangle : -1;
        path[lane] = *code;
        patch[lane] = at->address[2 * triangle] + *code;
        depth[lane] = at->address[2 * triangle + 1];
        deepest = depth[lane] > deepest ? depth[lane] : deepest;
        const int s = at->slot[triangle];
        const size_t first = (size_t)(s / BLOCK_LANES) * (BLOCK_FLOATS * BLOCK_LANES);
        global const float *g = at->geometry + first + s % BLOCK_LANES;
        for (int k = 0; k < 12; ++k) corner[k * LANES + lane] = g[k * BLOCK_LANES];
        for (int k = 0; k < 3; ++k) squared[k * LANES + lane] = at->edges[3 * triangle + k];
        if (lane + 1 < left && ++*code == 1 << depth[lane]) {
            *code = 0;
            ++*rank;
        }
    }
    pack->vx = corner8[0] - at->ox, pack->vy = corner8[1] - at->oy, pack->vz = corner8[2] - at->oz;
    pack->ex = corner8[3] - corner8[0], pack->ey = corner8[4] - corner8[1], pack->ez = corner8[5] - corner8[2];
    pack->fx = corner8[6] - corner8[0], pack->fy = corner8[7] - corner8[1], pack->fz = corner8[8] - corner8[2];
    pack->own = own8;
    pack->patch = patch8;
    const lanes_f plane = dot3_lanes(pack->vx, pack->vy, pack->vz, corner8[9], corner8[10], corner8[11]);
    const lanes_f from_plane = PICK(MASK(plane < 0.0f), -plane, plane);
    find_patch(pack, path8, depth8, deepest, squared8[0], squared8[1], squared8[2]);
    /* what lies in the patch's own plane is off it by the rounding of coordinates: farther along a grazing beam */
    const lanes_f slack = at->view[VIEW_SLACK] + at->view[VIEW_ROUNDING] / from_plane;
    pack->far = 1.0f + LEAST(slack, SLACK_MOST);
}

/* Bit i is lane i of a mask. */
static inline uint bits_of(lanes_i mask)
{
#if LANES == 1
    return mask & 1;
#else
    return bits8(mask);
#endif
}

/* The triangles that hold all samples of the patches and, where the shaft has an image, their rectangles in it. */
static inline void find_corners(Pack *pack, const Shaft *shaft, global const float *pattern)
{
    pack->reach = 0.0f;
    for (int v = 0; v < 3; ++v) {
        lanes_f *p = pack->corner[v];
        place(pack, pattern[3 * v], pattern[3 * v + 1], p, p + 1, p + 2);
        const lanes_f x = magnitude(p[0]), y = magnitude(p[1]), z = magnitude(p[2]), xy = MOST(x, y);
        const lanes_f reach = 0.5f * (MOST(xy, z) + (x + y + z));
        pack->reach = MOST(reach, pack->reach);
    }
    pack->west = pack->south = -WIDE, pack->east = pack->north = pack->deepest = WIDE;
    if (!shaft->has_image) return;
    pack->west = pack->south = WIDE, pack->east = pack->north = pack->deepest = -WIDE;
    for (int v = 0; v < 3; ++v) {
        const lanes_f depth = shaft->sign * pack->corner[v][shaft->depth], per = 1.0f / depth;
        const lanes_f right = pack->corner[v][shaft->right] * per, up = pack->corner[v][shaft->up] * per;
        pack->west = LEAST(right, pack->west), pack->east = MOST(right, pack->east);
        pack->south = LEAST(up, pack->south), pack->north = MOST(up, pack->north);
        pack->deepest = MOST(depth, pack->deepest);
    }
}

/* Weights by slot, from pattern[3 s], [3 s + 1] by sample. */
static inline void load_slots(Slots *to, global const float *pattern)
{
    for (int slot = 0; slot < SLOTS; ++slot) {
        const bool first = slot < FIRST_FINE;
        const int sample = first ? LEAST(slot, RIM - 1) : LEAST(slot - FIRST_FINE, FINE - 1) + RIM;
        ((float *)to->b)[slot] = pattern[3 * sample], ((float *)to->c)[slot] = pattern[3 * sample + 1];
        ((int *)to->real)[slot] = (first ? slot < RIM : slot - FIRST_FINE < FINE) ? -1 : 0;
    }
}

/* Samples of a lane's patch, open where they lie within range, field of view and greatest incidence. Both ends of all
 * are within. */
static inline void place_samples(Target *to, const Pack *pack, int lane, const Slots *slots,
                                 global const float *view)
{
#define OF(v) (((const float *)&(v))[lane])
    const float vx = OF(pack->vx), vy = OF(pack->vy), vz = OF(pack->vz);
    const float ex = OF(pack->ex), ey = OF(pack->ey), ez = OF(pack->ez);
    const float fx = OF(pack->fx), fy = OF(pack->fy), fz = OF(pack->fz);
    const float a1 = OF(pack->a1), b1 = OF(pack->b1), c1 = OF(pack->c1);
    const float a2 = OF(pack->a2), b2 = OF(pack->b2), c2 = OF(pack->c2);
    to->far = OF(pack->far), to->own = ((const int *)&pack->own)[lane], to->live = 0;
#undef OF
    const float nx = ey * fz - ez * fy, ny = ez * fx - ex * fz, nz = ex * fy - ey * fx;
    const float least_facing = view[VIEW_LEAST_COS2], normal2 = nx * nx + ny * ny + nz * nz;
    for (int k = 0; k < PACKETS; ++k) {
        Packet *p = &to->packets[k];
        const lanes_f wb = slots->b[k], wc = slots->c[k], wa = 1.0f - wb - wc;
        const lanes_f l1 = wa * a1 + wb * b1 + wc * c1, l2 = wa * a2 + wb * b2 + wc * c2;
        const lanes_f x = vx + (l1 * ex + l2 * fx), y = vy + (l1 * ey + l2 * fy), z = vz + (l1 * ez + l2 * fz);
        const lanes_f across2 = x * x + y * y, range2 = across2 + z * z, height = signed_square(z);
        const lanes_f ahead = signed_square(view[VIEW_AZIMUTH_X] * x + view[VIEW_AZIMUTH_Y] * y);
        const lanes_f volume = dot3_lanes(x, y, z, nx, ny, nz);
        p->x = x, p->y = y, p->z = z;
        p->open = slots->real[k] & MASK(range2 >= view[VIEW_RANGE_MIN2]) & MASK(range2 <= view[VIEW_RANGE_MAX2]) &
                  MASK(height >= view[VIEW_LOW] * range2) & MASK(height <= view[VIEW_HIGH] * range2) &
                  MASK(ahead >= view[VIEW_AZIMUTH] * across2) &
                  MASK(volume * volume >= least_facing * range2 * normal2);
        const lanes_f ax = magnitude(x), ay = magnitude(y), az = magnitude(z);
        const lanes_f axy = MOST(ax, ay), most = MOST(axy, az);
        p->reach = 0.5f * (most + (ax + ay + az));
        to->live |= any_lane(p->open) ? 1u << k : 0;
    }
    spread_reach(to->packets);
}

/* Corners of a lane's patch minus the origin, (x, y, z) each. */
static inline void patch_corners(float *corners, const Pack *pack, int lane)
{
#define OF(v) (((const float *)&(v))[lane])
    const float l1[3] = {OF(pack->a1), OF(pack->b1), OF(pack->c1)}, l2[3] = {OF(pack->a2), OF(pack->b2), OF(pack->c2)};
    for (int k = 0; k < 3; ++k) {
        corners[3 * k] = OF(pack->vx) + (l1[k] * OF(pack->ex) + l2[k] * OF(pack->fx));
        corners[3 * k + 1] = OF(pack->vy) + (l1[k] * OF(pack->ey) + l2[k] * OF(pack->fy));
        corners[3 * k + 2] = OF(pack->vz) + (l1[k] * OF(pack->ez) + l2[k] * OF(pack->fz));
    }
#undef OF
}

/* Returns to be expected of a lane's patch, a share of it seen: area cos / range^2 over the solid angle of a beam. None
 * where it spans too little of a row or column, as a table top at eye level does: beams may pass on both sides. */
static inline float expected_returns(const Pack *pack, int lane, float share, global const float *view)
{
    float c[9];
    patch_corners(c, pack, lane);
    const float x = (c[0] + c[3] + c[6]) / 3.0f, y = (c[1] + c[4] + c[7]) / 3.0f, z = (c[2] + c[5] + c[8]) / 3.0f;
    const float across2 = x * x + y * y, across = sqrt(across2), range2 = across2 + z * z;
    float left = INFINITY, right = -INFINITY, low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 3; ++k) {
        const float sideways = x * c[3 * k + 1] - y * c[3 * k];
        const float up = across2 * c[3 * k + 2] - z * (x * c[3 * k] + y * c[3 * k + 1]);
        left = LEAST(sideways, left), right = MOST(sideways, right), low = LEAST(up, low), high = MOST(up, high);
    }
    const float ex = c[3] - c[0], ey = c[4] - c[1], ez = c[5] - c[2];
    const float fx = c[6] - c[0], fy = c[7] - c[1], fz = c[8] - c[2];
    const float volume = x * (ey * fz - ez * fy) + y * (ez * fx - ex * fz) + z * (ex * fy - ey * fx);
    if (!(across2 > 1e-8f * range2)) return volume != 0.0f ? INFINITY : 0.0f; /* straight up all columns meet */
    /* at the centre, of directions across the beam: radians of azimuth and of elevation */
    const float columns = (right - left) / (across2 * view[VIEW_COLUMN]);
    const float rows = (high - low) / (across * range2 * view[VIEW_ROW]);
    if (!(columns >= LEAST_SPAN) || !(rows >= LEAST_SPAN)) return 0.0f;
    return MAGNITUDE(volume) * share / (2.0f * range2 * across * view[VIEW_COLUMN] * view[VIEW_ROW]);
}

/* Patches of a pack, a bit each, of which too few returns are to be expected even where they are seen whole: those that
 * `expected_returns` leaves no doubt about, in squares, which need no root. */
static inline uint hardly_met(const Pack *pack, global const float *view)
{
    const float returns = view[VIEW_RETURNS], column = view[VIEW_COLUMN], row = view[VIEW_ROW];
    if (!(returns > 0.0f)) return 0;
    lanes_f x[3], y[3], z[3];
    for (int v = 0; v < 3; ++v) place(pack, v == 1 ? 1.0f : 0.0f, v == 2 ? 1.0f : 0.0f, x + v, y + v, z + v);
    const lanes_f cx = (x[0] + x[1] + x[2]) / 3.0f, cy = (y[0] + y[1] + y[2]) / 3.0f;
    const lanes_f cz = (z[0] + z[1] + z[2]) / 3.0f;
    const lanes_f across2 = cx * cx + cy * cy, range2 = across2 + cz * cz;
    lanes_f left = INFINITY, right = -INFINITY, low = INFINITY, high = -INFINITY;
    for (int v = 0; v < 3; ++v) {
        const lanes_f sideways = cx * y[v] - cy * x[v], up = across2 * z[v] - cz * (cx * x[v] + cy * y[v]);
        left = LEAST(sideways, left), right = MOST(sideways, right), low = LEAST(up, low), high = MOST(up, high);
    }
    const lanes_f ex = x[1] - x[0], ey = y[1] - y[0], ez = z[1] - z[0];
    const lanes_f fx = x[2] - x[0], fy = y[2] - y[0], fz = z[2] - z[0];
    const lanes_f volume = cx * (ey * fz - ez * fy) + cy * (ez * fx - ex * fz) + cz * (ex * fy - ey * fx);
    const float doubt = 0.999f, columns = doubt * LEAST_SPAN * column, rows = doubt * LEAST_SPAN * row;
    const lanes_f beam = (2.0f * doubt * returns * column * row) * range2, of_row = rows * range2;
    return bits_of(MASK(across2 > 1e-7f * range2) &
                   (MASK(right - left < columns * across2) |
                    MASK((high - low) * (high - low) < of_row * of_row * across2) |
                    MASK(volume * volume < beam * beam * across2)));
}

#endif
