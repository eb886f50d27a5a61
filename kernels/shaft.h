/* Shafts: what of the tree can hide a box from an origin, and what hides all of it.
 *
 * Purpose    kernels/sample_patches.cl asks it of the boxes of groups of patches and of their samples.
 * Algorithm  A shaft is the hull of a box and the origin. It is bounded by the box round it and, where the box is far
 *            enough for its size, by the four planes of a pyramid. A triangle (block.h) has three edge planes through
 *            the origin and its own plane, all linear in a point: a box is tested by its centre and half sizes.
 *
 * Define         meaning                                               example
 * LANES          see lanes.h, by way of block.h
 * STACK          see tree.h
 */
#ifndef TLSPLAN_SHAFT_H
#define TLSPLAN_SHAFT_H
#include "block.h"
#include "tree.h"

/* A prepared triangle that hides a whole box: the samples' own test has slack of at most SLACK_MOST. */
#define SLACK_MOST 1e-3f
#define COVER_SLACK 2e-3f

/* Hits may lie some ulp outside their triangle and box: shafts are larger by this share of the distance. */
#define SHAFT_PAD 1e-5f

/* A box from the origin: what can hide all of it, or none of it. */
typedef struct {
    float cx, cy, cz, hx, hy, hz; /* centre minus origin, half sizes */
    float reach;                  /* distance of the farthest corner, not less */
} Extent;

/* The hull of a box and the origin: all beams from the origin to the box. */
typedef struct {
    Extent extent;
    float low[3], high[3]; /* the box round it, minus the origin */
    float plane[4][3];     /* inward normals of the pyramid; zero where the box is too wide for one */
} Shaft;

/* Least and greatest of p . v over the box, as middle and spread. */
#define SPREAD8(e, x, y, z) ((e)->hx * MAGNITUDE8(x) + (e)->hy * MAGNITUDE8(y) + (e)->hz * MAGNITUDE8(z))
#define MIDDLE8(e, x, y, z) dot3_8((e)->cx, (e)->cy, (e)->cz, x, y, z)

static inline Extent make_extent(float x0, float y0, float z0, float x1, float y1, float z1)
{
    Extent e;
    e.cx = 0.5f * (x0 + x1), e.cy = 0.5f * (y0 + y1), e.cz = 0.5f * (z0 + z1);
    e.hx = 0.5f * (x1 - x0), e.hy = 0.5f * (y1 - y0), e.hz = 0.5f * (z1 - z0);
    const float to_centre = sqrt(e.cx * e.cx + e.cy * e.cy + e.cz * e.cz);
    e.reach = (to_centre + sqrt(e.hx * e.hx + e.hy * e.hy + e.hz * e.hz)) * 1.0001f;
    const float pad = SHAFT_PAD * e.reach;
    e.hx += pad, e.hy += pad, e.hz += pad;
    return e;
}

static inline Shaft make_shaft(global const float *box, float ox, float oy, float oz)
{
    Shaft s;
    const Extent e = make_extent(box[0] - ox, box[1] - oy, box[2] - oz, box[3] - ox, box[4] - oy, box[5] - oz);
    s.extent = e;
    s.low[0] = LEAST(e.cx - e.hx, 0.0f), s.low[1] = LEAST(e.cy - e.hy, 0.0f), s.low[2] = LEAST(e.cz - e.hz, 0.0f);
    s.high[0] = MOST(e.cx + e.hx, 0.0f), s.high[1] = MOST(e.cy + e.hy, 0.0f), s.high[2] = MOST(e.cz + e.hz, 0.0f);
    const float to_centre = sqrt(e.cx * e.cx + e.cy * e.cy + e.cz * e.cz), radius = e.reach - to_centre;
    for (int k = 0; k < 4; ++k) s.plane[k][0] = s.plane[k][1] = s.plane[k][2] = 0.0f;
    if (!(to_centre > 1.2f * radius + 1e-6f)) return s;
    /* A frame about the axis; the box's corners in the plane one metre along it. */
    const float per = 1.0f / to_centre, ax = e.cx * per, ay = e.cy * per, az = e.cz * per;
    const bool level = ax * ax + ay * ay > 0.02f;
    float rx = level ? -ay : 0.0f, ry = level ? ax : -az, rz = level ? 0.0f : ay; /* z x axis, or x x axis */
    const float per_r = 1.0f / sqrt(rx * rx + ry * ry + rz * rz);
    rx *= per_r, ry *= per_r, rz *= per_r;
    const float ux = ay * rz - az * ry, uy = az * rx - ax * rz, uz = ax * ry - ay * rx;
    /* the box's eight corners */
    const float8 sx = (float8)(-1, 1, -1, 1, -1, 1, -1, 1), sy = (float8)(-1, -1, 1, 1, -1, -1, 1, 1);
    const float8 sz = (float8)(-1, -1, -1, -1, 1, 1, 1, 1);
    const float8 px = e.cx + e.hx * sx, py = e.cy + e.hy * sy, pz = e.cz + e.hz * sz;
    const float8 ahead = dot3_8(px, py, pz, ax, ay, az);
    const float8 right = dot3_8(px, py, pz, rx, ry, rz) / ahead, up = dot3_8(px, py, pz, ux, uy, uz) / ahead;
    const float *each_ahead = (const float *)&ahead, *each_right = (const float *)&right, *each_up = (const float *)&up;
    float least = each_ahead[0], west = each_right[0], east = west, south = each_up[0], north = south;
    for (int k = 1; k < 8; ++k) {
        least = LEAST(each_ahead[k], least);
        west = LEAST(each_right[k], west), east = MOST(each_right[k], east);
        south = LEAST(each_up[k], south), north = MOST(each_up[k], north);
    }
    if (!(least > 0.2f * to_centre)) return s;
    west -= SHAFT_PAD, east += SHAFT_PAD, south -= SHAFT_PAD, north += SHAFT_PAD;
    s.plane[0][0] = rx - west * ax, s.plane[0][1] = ry - west * ay, s.plane[0][2] = rz - west * az;
    s.plane[1][0] = east * ax - rx, s.plane[1][1] = east * ay - ry, s.plane[1][2] = east * az - rz;
    s.plane[2][0] = ux - south * ax, s.plane[2][1] = uy - south * ay, s.plane[2][2] = uz - south * az;
    s.plane[3][0] = north * ax - ux, s.plane[3][1] = north * ay - uy, s.plane[3][2] = north * az - uz;
    return s;
}

/* Which children of a node the shaft can meet; *key gets the order in which to visit them, the least first. */
static inline int8 cull_node(int node, const Shaft *s, global const float *boxes, float ox, float oy, float oz,
                             float8 *key)
{
    global const float *b = boxes + (size_t)node * (6 * NODE_CHILDREN);
    float8 box[6];
    box[0] = LOAD8(b) - ox, box[1] = LOAD8(b + 1 * 8) - oy, box[2] = LOAD8(b + 2 * 8) - oz;
    box[3] = LOAD8(b + 3 * 8) - ox, box[4] = LOAD8(b + 4 * 8) - oy, box[5] = LOAD8(b + 5 * 8) - oz;
    int8 keep = (box[0] <= s->high[0]) & (box[3] >= s->low[0]) & (box[1] <= s->high[1]) & (box[4] >= s->low[1]) &
                (box[2] <= s->high[2]) & (box[5] >= s->low[2]);
    if (!any8(keep)) return keep;
    for (int c = 0; c < 4; ++c) {
        const float x = s->plane[c][0], y = s->plane[c][1], z = s->plane[c][2];
        keep &= dot3_8(x, y, z, box[x > 0.0f ? 3 : 0], box[y > 0.0f ? 4 : 1], box[z > 0.0f ? 5 : 2]) >= 0.0f;
    }
    const float8 bx = MOST(box[0], -box[3]), by = MOST(box[1], -box[4]), bz = MOST(box[2], -box[5]);
    const float8 gx = MOST(bx, 0.0f), gy = MOST(by, 0.0f), gz = MOST(bz, 0.0f);
    /* near and large first: what takes much of the view from the origin hides much of the group */
    const float8 wx = box[3] - box[0], wy = box[4] - box[1], wz = box[5] - box[2];
    const float8 area = dot3_8(wx, wy, wz, wy, wz, wx);
    *key = dot3_8(gx, gy, gz, gx, gy, gz) / (area * area + 1e-6f);
    return keep;
}

/* Which triangles of a block can hide part of the box (`meets`), which hide all of it (`covers`). */
static inline void cull_block(const Block *b, const Extent *s, int8 *meets, int8 *covers)
{
    const float8 slack0 = (2.0f * s->reach) * b->rounding0, slack1 = (2.0f * s->reach) * b->rounding1;
    const float8 slack2 = (2.0f * s->reach) * b->rounding2;
    const float8 middle0 = MIDDLE8(s, b->n0x, b->n0y, b->n0z), spread0 = SPREAD8(s, b->n0x, b->n0y, b->n0z);
    const float8 middle1 = MIDDLE8(s, b->n1x, b->n1y, b->n1z), spread1 = SPREAD8(s, b->n1x, b->n1y, b->n1z);
    const float8 middle2 = MIDDLE8(s, b->n2x, b->n2y, b->n2z), spread2 = SPREAD8(s, b->n2x, b->n2y, b->n2z);
    const float8 depth = MIDDLE8(s, b->mx, b->my, b->mz), deep = SPREAD8(s, b->mx, b->my, b->mz);
    const int8 beside = (middle0 + spread0 < -slack0) | (middle1 + spread1 < -slack1) | (middle2 + spread2 < -slack2);
    const int8 turned = (middle0 - spread0 > slack0) | (middle1 - spread1 > slack1) | (middle2 - spread2 > slack2);
    const int8 before = depth + deep <= 1.0f;
    *meets = ~PICK(b->clear, beside | before, beside & turned);
    *covers = b->clear & (middle0 - spread0 > slack0) & (middle1 - spread1 > slack1) & (middle2 - spread2 > slack2) &
              (depth - deep > 1.0f + COVER_SLACK);
}

#endif
