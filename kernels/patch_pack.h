/* Packs: LANES patches side by side, the samples on them, and whether a beam of the scanner can meet those.
 *
 * Purpose    kernels/sample_patches.cl loads groups of patches as packs and places their samples; patch_walk.h closes
 *            those that are hidden.
 * Patches    A patch is (triangle, code), docs/method/patches.md: bisecting the triangle by the code gives the weights
 *            of the patch's vertices a, b, c, exactly. A sample has weights at a, b, c: a place, minus the origin.
 * View       VIEW_ below: limits of the scanner. "Signed square" of s is s |s|: comparisons of angles without a root.
 *
 * Define         meaning                                               example
 * LANES          patches side by side, 1 or 8                          -DLANES=8
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

typedef struct {
    lanes_f x, y, z; /* sample minus origin, metres */
    lanes_i open;    /* -1: within view and nothing hides it so far */
} Sample;

typedef struct {
    lanes_f far;   /* 1 + slack: what hides the lane's samples has p . m above it */
    lanes_f reach; /* not less than the distance of the samples, metres: rounding grows with it */
    lanes_i own;   /* triangle; -1 in an empty lane */
    lanes_i patch;
    lanes_f vx, vy, vz, ex, ey, ez, fx, fy, fz; /* vertex 0 minus origin, edges 01 and 02 */
    lanes_f a1, a2, b1, b2, c1, c2;             /* weights of vertices 1 and 2 at the patch's vertices a, b, c: exact */
} Pack;

/* What every function below needs of the scene and the launch. */
typedef struct {
    global const float *boxes, *geometry, *edges, *group_box, *pattern, *view;
    global const int *children, *triangles, *slot, *address, *order, *groups;
    float ox, oy, oz;
} Launch;

static inline lanes_f signed_square(lanes_f x)
{
    return PICK(MASK(x < 0.0f), -(x * x), x * x);
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
    pack->reach = 0.0f;
    /* what lies in the patch's own plane is off it by the rounding of coordinates: farther along a grazing beam */
    const lanes_f slack = at->view[VIEW_SLACK] + at->view[VIEW_ROUNDING] / from_plane;
    pack->far = 1.0f + LEAST(slack, SLACK_MOST);
}

/* Sample with weights (wb, wc) of the patch's vertices b and c. */
static inline Sample place(const Pack *pack, lanes_f wb, lanes_f wc)
{
    const lanes_f wa = 1.0f - wb - wc;
    const lanes_f l1 = wa * pack->a1 + wb * pack->b1 + wc * pack->c1;
    const lanes_f l2 = wa * pack->a2 + wb * pack->b2 + wc * pack->c2;
    Sample out;
    out.x = pack->vx + (l1 * pack->ex + l2 * pack->fx);
    out.y = pack->vy + (l1 * pack->ey + l2 * pack->fy);
    out.z = pack->vz + (l1 * pack->ez + l2 * pack->fz);
    out.open = 0;
    return out;
}

/* Sets `open` where the sample lies within range, field of view and greatest incidence. Both ends of all are within. */
static inline void look(Sample *at, Pack *pack, global const float *view)
{
    const lanes_f across2 = at->x * at->x + at->y * at->y, range2 = across2 + at->z * at->z;
    const lanes_f height = signed_square(at->z);
    const lanes_f ahead = signed_square(view[VIEW_AZIMUTH_X] * at->x + view[VIEW_AZIMUTH_Y] * at->y);
    const lanes_f nx = pack->ey * pack->fz - pack->ez * pack->fy, ny = pack->ez * pack->fx - pack->ex * pack->fz;
    const lanes_f nz = pack->ex * pack->fy - pack->ey * pack->fx, volume = dot3_lanes(at->x, at->y, at->z, nx, ny, nz);
    at->open = MASK(pack->own >= 0) & MASK(range2 >= view[VIEW_RANGE_MIN2]) & MASK(range2 <= view[VIEW_RANGE_MAX2]) &
               MASK(height >= view[VIEW_LOW] * range2) & MASK(height <= view[VIEW_HIGH] * range2) &
               MASK(ahead >= view[VIEW_AZIMUTH] * across2) &
               MASK(volume * volume >= view[VIEW_LEAST_COS2] * range2 * (nx * nx + ny * ny + nz * nz));
    const lanes_f ax = magnitude(at->x), ay = magnitude(at->y), az = magnitude(at->z);
    const lanes_f axy = MOST(ax, ay), most = MOST(axy, az), reach = 0.5f * (most + (ax + ay + az));
    pack->reach = MOST(reach, pack->reach);
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

/* Box of a lane's patch. */
static inline Extent patch_extent(const Pack *pack, int lane)
{
    float c[9], low[3], high[3];
    patch_corners(c, pack, lane);
    for (int k = 0; k < 3; ++k) {
        const float least = LEAST(c[k], c[3 + k]), most = MOST(c[k], c[3 + k]);
        low[k] = LEAST(least, c[6 + k]), high[k] = MOST(most, c[6 + k]);
    }
    return make_extent(low[0], low[1], low[2], high[0], high[1], high[2]);
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

#endif
