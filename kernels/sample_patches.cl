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
 * View       see VIEW_ below; "signed square" of s is s |s|: comparisons of angles without a root.
 *
 * Define         meaning                                               example
 * LANES          patches side by side, 1 or 8                          -DLANES=8
 * STACK          see tree.h
 */
#include "block.h"
#include "tree.h"

#define GROUP_PATCHES 16
#define RIM 7
#define FINE 22
#define PACKS (GROUP_PATCHES / LANES)
#define FINE_PACKETS ((FINE + LANES - 1) / LANES)
#define MOST_PACKETS (RIM > FINE_PACKETS ? RIM : FINE_PACKETS)
#define ALL_RIM 0x7fu

/* A prepared triangle that hides a whole box: the samples' own test has slack of at most SLACK_MOST. */
#define SLACK_MOST 1e-3f
#define COVER_SLACK 2e-3f

/* Hits may lie some ulp outside their triangle and box: shafts are larger by this share of the distance. */
#define SHAFT_PAD 1e-5f

/* Rows and columns that a patch must span for a beam to be expected on it: then one meets it half of the time. */
#define LEAST_SPAN 0.5f

/* A triangle that is done with so many packets at once is tried first on the next groups; so many blocks of them are
 * remembered. Measured: 1 to 7 packets, 1 to 4 blocks differ by some percent. */
#define WORTH_KEEPING 3
#define RECENT_BLOCKS 2

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
static inline int8 cull_node(int node, const Shaft *s, const Launch *at, float8 *key)
{
    const float ox = at->ox, oy = at->oy, oz = at->oz;
    global const float *b = at->boxes + (size_t)node * (6 * NODE_CHILDREN);
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
            const int8 keep = cull_node(child, shaft, at, &key);
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
