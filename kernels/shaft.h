/* Shafts: what of the tree can hide a group of patches from an origin, and what hides all of a box.
 *
 * Purpose    kernels/sample_patches.cl asks it of groups of patches.
 * Algorithm  Along the axis in which a group is farthest, everything before the origin has an image at depth 1: a point
 *            (depth, right, up) lies at (right / depth, up / depth). What hides a patch overlaps its image and does not
 *            lie deeper. Images of triangles are bounded by rectangles, eight triangles at a time; a box of the tree is
 *            tested against the four planes through the origin and the sides of the group's rectangle.
 *
 *                 depth 1                       A group round the origin itself has no image: then the box round it and
 *              up ^  .--.                       the origin is all that is asked of, and every triangle may overlap.
 *                 | |'. | triangle's rectangle
 *                 |  '--'
 *                 +------> right
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

/* Nothing is left out as too deep that is deeper by less than this share. */
#define DEPTH_PAD 1.0001f

/* A group has an image where all of it is deeper than this share of its reach. */
#define LEAST_DEPTH 1e-3f

#define WIDE 1e30f

/* A box from the origin: what can hide all of it, or none of it. */
typedef struct {
    float cx, cy, cz, hx, hy, hz; /* centre minus origin, half sizes */
    float reach;                  /* distance of the farthest corner, not less */
} Extent;

/* All beams from the origin to a group. */
typedef struct {
    bool has_image;
    int depth, right, up;            /* which of x, y, z */
    float sign;                      /* of the depth */
    float odepth, oright, oup;       /* the origin */
    float west, east, south, north;  /* the group's rectangle */
    float deepest;
    float oblique;                   /* not less than 1 + right + up, without signs */
    float low[3], high[3];           /* without image: the box round the group and the origin, minus the origin */
} Shaft;

/* Rectangles of a block's triangles, padded, and their least depths. */
typedef struct {
    float8 west, east, south, north, nearest;
} Images;

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

/* The shaft of a box; its rectangle is for the caller to set. */
static inline Shaft make_shaft(const Extent *e, float ox, float oy, float oz)
{
    Shaft s;
    const float c[3] = {e->cx, e->cy, e->cz}, h[3] = {e->hx, e->hy, e->hz}, o[3] = {ox, oy, oz};
    float most = -WIDE;
    s.depth = 0;
    for (int k = 0; k < 3; ++k) {
        const float nearest = MAGNITUDE(c[k]) - h[k];
        s.depth = nearest > most ? k : s.depth;
        most = MOST(nearest, most);
        s.low[k] = LEAST(c[k] - h[k], 0.0f), s.high[k] = MOST(c[k] + h[k], 0.0f);
    }
    s.right = s.depth == 0 ? 1 : 0, s.up = s.depth == 2 ? 1 : 2;
    s.sign = c[s.depth] < 0.0f ? -1.0f : 1.0f;
    s.odepth = o[s.depth], s.oright = o[s.right], s.oup = o[s.up];
    s.has_image = most > LEAST_DEPTH * e->reach;
    s.west = s.south = -WIDE, s.east = s.north = s.deepest = WIDE;
    return s;
}

/* Which children of a node the shaft can meet; *key gets the order in which to visit them, the least first. */
static inline int8 cull_node(int node, const Shaft *s, global const float *boxes, float ox, float oy, float oz,
                             float8 *key)
{
    global const float *b = boxes + (size_t)node * (6 * NODE_CHILDREN);
    int8 keep;
    float8 box[6];
    box[0] = LOAD8(b) - ox, box[1] = LOAD8(b + 1 * 8) - oy, box[2] = LOAD8(b + 2 * 8) - oz;
    box[3] = LOAD8(b + 3 * 8) - ox, box[4] = LOAD8(b + 4 * 8) - oy, box[5] = LOAD8(b + 5 * 8) - oz;
    if (s->has_image) {
        const float8 below = box[s->depth], above = box[s->depth + 3];
        const bool ahead = s->sign > 0.0f;
        const float8 least = ahead ? below : -above, greatest = ahead ? above : -below;
        const float limit = s->deepest * DEPTH_PAD;
        const float8 near = MOST(least, 0.0f), far = LEAST(greatest, limit);
        /* the padded box's sides at the depth where they stand out most */
        const float west = s->west - SHAFT_PAD, east = s->east + SHAFT_PAD;
        const float south = s->south - SHAFT_PAD, north = s->north + SHAFT_PAD;
        keep = (greatest >= 0.0f) & (least <= limit) & (box[s->right + 3] >= west * (west > 0.0f ? near : far)) &
               (box[s->right] <= east * (east > 0.0f ? far : near)) &
               (box[s->up + 3] >= south * (south > 0.0f ? near : far)) &
               (box[s->up] <= north * (north > 0.0f ? far : near));
    } else
        keep = (box[0] <= s->high[0]) & (box[3] >= s->low[0]) & (box[1] <= s->high[1]) & (box[4] >= s->low[1]) &
               (box[2] <= s->high[2]) & (box[5] >= s->low[2]);
    const float8 bx = MOST(box[0], -box[3]), by = MOST(box[1], -box[4]), bz = MOST(box[2], -box[5]);
    const float8 gx = MOST(bx, 0.0f), gy = MOST(by, 0.0f), gz = MOST(bz, 0.0f);
    /* near and large first: what takes much of the view from the origin hides much of the group */
    const float8 wx = box[3] - box[0], wy = box[4] - box[1], wz = box[5] - box[2];
    const float8 area = dot3_8(wx, wy, wz, wy, wz, wx);
    *key = dot3_8(gx, gy, gz, gx, gy, gz) / (area * area + 1e-6f);
    return keep;
}

/* Images of a block's triangles; returns which can hide anything of the shaft. One that is partly behind the origin may
 * lie anywhere. The pad is for the margins of the triangle test (block.h): a beam counts as inside down to weights of
 * -share, share the sum of rounding x reach / volume, which is as much of the image's size for a triangle that is not
 * clear. With z the depths, 1 + right + up < `oblique` and the cross product of the image's edges:
 *     volume = 2 z0 z1 z2 cross,   reach < 1.23 oblique z,   edges < 1.23 (size z + oblique (greatest z - least z)). */
static inline int8 project_block(global const float *geometry, int block, const Shaft *s, Images *out)
{
    if (!s->has_image) {
        out->west = out->south = out->nearest = -WIDE, out->east = out->north = WIDE;
        return -1;
    }
    global const float *g = geometry + (size_t)block * (BLOCK_FLOATS * BLOCK_LANES);
    global const float *to_depth = g + s->depth * 8, *to_right = g + s->right * 8, *to_up = g + s->up * 8;
    float8 depth[3], right[3], up[3], per[3];
    for (int v = 0; v < 3; ++v) {
        depth[v] = s->sign * (LOAD8(to_depth + 24 * v) - s->odepth);
        per[v] = 1.0f / depth[v];
        right[v] = (LOAD8(to_right + 24 * v) - s->oright) * per[v];
        up[v] = (LOAD8(to_up + 24 * v) - s->oup) * per[v];
    }
#define LEAST3(x) LEAST(x[2], LEAST(x[1], x[0]))
#define MOST3(x) MOST(x[2], MOST(x[1], x[0]))
    const float8 nearest = LEAST3(depth), farthest = MOST3(depth), ratio = farthest * MOST3(per);
    const float8 west = LEAST3(right), east = MOST3(right), south = LEAST3(up), north = MOST3(up);
    const int8 before = nearest > 1e-6f;
    const float8 size = (east - west) + (north - south), oblique = s->oblique + size;
    const float8 cross = (right[1] - right[0]) * (up[2] - up[0]) - (right[2] - right[0]) * (up[1] - up[0]);
    const float8 steep = oblique * ratio, whole = ratio * size;
    const float8 edges = size + (steep - oblique), turned = MAGNITUDE8(cross);
    const float8 by_cross = (4.0f * EDGE_ROUNDING) * (steep * steep) * edges / turned;
    const float8 share = LEAST(by_cross, 1.0f), pad = whole * share + SHAFT_PAD * ratio;
    out->west = PICK(before, west - pad, -WIDE), out->east = PICK(before, east + pad, WIDE);
    out->south = PICK(before, south - pad, -WIDE), out->north = PICK(before, north + pad, WIDE);
    out->nearest = nearest - share * (farthest - nearest);
    return (farthest > 0.0f) & (out->nearest <= s->deepest * DEPTH_PAD) & (out->west <= s->east) &
           (out->east >= s->west) & (out->south <= s->north) & (out->north >= s->south);
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
