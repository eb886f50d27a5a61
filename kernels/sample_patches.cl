/* Patch mode: which sample points of every patch a position sees, whatever the scanner's resolution.
 *
 * Purpose    Visibility for scanners of 10^7 beams and more, docs/method/patch-mode.md. Range, incidence and spacing follow
 *            on the host from the samples that are seen.
 * Algorithm  A group of up to 16 patches that lie together has a box. Its shaft, the hull of the box and the origin, walks
 *            the tree once and meets the triangles that can hide anything of it. A triangle whose cone from the origin
 *            holds the whole box behind it hides the group at once; consecutive groups try the last such triangle first.
 *            What is left meets the samples, LANES patches side by side, until none of them is left to hide (any hit).
 *            After shaft culling (Haines & Wallace 1991) and the packets of trace_tile.h.
 *
 *                  .---- box ----.        p: sample minus origin; NOT normalised, so that the target is at 1:
 *                 /  . samples .  \       a triangle with m = n / K hides it where p . m > 1 + slack and p is inside
 *                o -----------------      its edges. All of it is linear in p: a box is tested by centre and half size.
 *
 * Samples    pattern[2 s], pattern[2 s + 1]: weights of the patch's second and third vertex; the first RIM samples are cast
 *            always, the other FINE ones where a patch is seen in part, or not at all while its family is seen.
 *            family: patches of one triangle whose codes agree but for the last 4 bits; never split between groups.
 * Marks      one uint a patch: bit s, sample s is seen; REFINED where all were cast.
 * Groups     group g: groups[3 g] rank of its first triangle in `order`, [3 g + 1] its first code there, [3 g + 2] patches,
 *            which run on through the triangles of `order`. group_box[6 g + k]: least x y z, greatest x y z of it, metres.
 * View       see VIEW_ below; "signed square" of s is s |s|: comparisons of angles without a root.
 *
 * Define         meaning                                               example
 * LANES          patches side by side, 1 or 8                          -DLANES=8
 * STACK          see tree.h
 */
#include "block.h"
#include "tree.h"

#define GROUP_PATCHES 16
#define PACKS (GROUP_PATCHES / LANES)
#define RIM 7
#define FINE 21
#define REFINED 0x80000000u
#define ALL_RIM 0x7fu

/* A prepared triangle that hides a whole box: the samples' own test has slack of at most SLACK_MOST. */
#define SLACK_MOST 1e-3f
#define COVER_SLACK 2e-3f

/* Hits may lie some ulp outside their triangle and box: shafts are larger by this share of the distance. */
#define SHAFT_PAD 1e-5f

/* Blocks remembered from the walk for the second pattern; where there are more, the tree is walked again. */
#define MOST_BLOCKS 96

#define VIEW_RANGE_MIN2 0  /* m^2 */
#define VIEW_RANGE_MAX2 1  /* m^2 */
#define VIEW_LOW 2         /* signed square of the sine of the least elevation */
#define VIEW_HIGH 3        /* ... of the greatest */
#define VIEW_AZIMUTH_X 4   /* middle of the azimuths: cosine, */
#define VIEW_AZIMUTH_Y 5   /* sine, */
#define VIEW_AZIMUTH 6     /* and signed square of the cosine of half their width; -2 for a full turn */
#define VIEW_LEAST_COS2 7  /* square of the cosine of the greatest incidence */
#define VIEW_STEPS 8       /* azimuth step times elevation step, rad^2 */
#define VIEW_RETURNS 9     /* expected returns below which a patch does not count as seen */
#define VIEW_SLACK 10      /* share of the range within which a surface does not hide the target */
#define VIEW_ROUNDING 11   /* rounding of the scene's coordinates, m */

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
    lanes_f halves;                             /* 2 ^ depth: patches of the triangle */
} Pack;

typedef struct {
    float cx, cy, cz, hx, hy, hz; /* centre minus origin, half sizes */
    float low[3], high[3];        /* hull of the box and the origin, minus the origin */
    float plane[4][3];            /* inward normals of the pyramid; zero where the box is too wide for one */
    float reach;                  /* distance of the farthest corner, not less */
} Shaft;

/* What every function below needs of the scene and the launch. */
typedef struct {
    global const float *boxes, *geometry, *edges, *group_box, *pattern, *view;
    global const int *children, *triangles, *slot, *address, *order, *groups;
    float ox, oy, oz;
} Launch;

/* A triangle that hid a group, ready for the next one. */
typedef struct {
    float n[9], m[3], rounding[3];
    bool known;
} Blocker;

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
    const int *each = (const int *)&mask;
    int any = 0;
    for (int lane = 0; lane < LANES; ++lane) any |= each[lane];
    return any != 0;
}

/* Least and greatest of p . v over the box, as middle and spread. */
#define SPREAD8(shaft, x, y, z) ((shaft)->hx * MAGNITUDE8(x) + (shaft)->hy * MAGNITUDE8(y) + (shaft)->hz * MAGNITUDE8(z))
#define MIDDLE8(shaft, x, y, z) dot3_8((shaft)->cx, (shaft)->cy, (shaft)->cz, x, y, z)

static inline Shaft make_shaft(global const float *box, float ox, float oy, float oz)
{
    Shaft s;
    const float x0 = box[0] - ox, y0 = box[1] - oy, z0 = box[2] - oz;
    const float x1 = box[3] - ox, y1 = box[4] - oy, z1 = box[5] - oz;
    s.cx = 0.5f * (x0 + x1), s.cy = 0.5f * (y0 + y1), s.cz = 0.5f * (z0 + z1);
    s.hx = 0.5f * (x1 - x0), s.hy = 0.5f * (y1 - y0), s.hz = 0.5f * (z1 - z0);
    const float to_centre = sqrt(s.cx * s.cx + s.cy * s.cy + s.cz * s.cz);
    const float radius = sqrt(s.hx * s.hx + s.hy * s.hy + s.hz * s.hz);
    s.reach = (to_centre + radius) * 1.0001f;
    const float pad = SHAFT_PAD * s.reach;
    s.hx += pad, s.hy += pad, s.hz += pad;
    s.low[0] = LEAST(x0, 0.0f) - pad, s.low[1] = LEAST(y0, 0.0f) - pad, s.low[2] = LEAST(z0, 0.0f) - pad;
    s.high[0] = MOST(x1, 0.0f) + pad, s.high[1] = MOST(y1, 0.0f) + pad, s.high[2] = MOST(z1, 0.0f) + pad;
    for (int k = 0; k < 4; ++k) s.plane[k][0] = s.plane[k][1] = s.plane[k][2] = 0.0f;
    if (!(to_centre > 1.2f * radius + 1e-6f)) return s;
    /* A frame about the axis; the box's corners in the plane one metre along it. */
    const float per = 1.0f / to_centre, ax = s.cx * per, ay = s.cy * per, az = s.cz * per;
    const bool level = ax * ax + ay * ay > 0.02f;
    float rx = level ? -ay : 0.0f, ry = level ? ax : -az, rz = level ? 0.0f : ay; /* z x axis, or x x axis */
    const float per_r = 1.0f / sqrt(rx * rx + ry * ry + rz * rz);
    rx *= per_r, ry *= per_r, rz *= per_r;
    const float ux = ay * rz - az * ry, uy = az * rx - ax * rz, uz = ax * ry - ay * rx;
    const float8 sx = (float8)(-1, 1, -1, 1, -1, 1, -1, 1), sy = (float8)(-1, -1, 1, 1, -1, -1, 1, 1);
    const float8 sz = (float8)(-1, -1, -1, -1, 1, 1, 1, 1);
    const float8 px = s.cx + s.hx * sx, py = s.cy + s.hy * sy, pz = s.cz + s.hz * sz;
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

/* Which children of a node the shaft can meet; *key gets their squared distances from the origin. */
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
    *key = dot3_8(gx, gy, gz, gx, gy, gz);
    return keep;
}

/* Whether the last blocker hides this box too. */
static inline bool still_hides(const Blocker *b, const Shaft *s)
{
    if (!b->known) return false;
    for (int k = 0; k < 3; ++k) {
        const float x = b->n[3 * k], y = b->n[3 * k + 1], z = b->n[3 * k + 2];
        const float least = s->cx * x + s->cy * y + s->cz * z -
                            (s->hx * MAGNITUDE(x) + s->hy * MAGNITUDE(y) + s->hz * MAGNITUDE(z));
        if (!(least > 2.0f * b->rounding[k] * s->reach)) return false;
    }
    const float x = b->m[0], y = b->m[1], z = b->m[2];
    return s->cx * x + s->cy * y + s->cz * z - (s->hx * MAGNITUDE(x) + s->hy * MAGNITUDE(y) + s->hz * MAGNITUDE(z)) >
           1.0f + COVER_SLACK;
}

/* Which triangles of a block can hide part of the box (`meets`), which hide all of it (`covers`). */
static inline void cull_block(const Block *b, const Shaft *s, int8 *meets, int8 *covers)
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

/* Close the samples of one pack that triangle j of a block hides. */
static inline lanes_i hides(const Block *block, int j, int index, const Sample *target, const Pack *pack, const Launch *at)
{
    const float *n = (const float *)block; /* n0x .. n2z, mx .. mz, rounding0 .. 2: eight lanes each */
    const lanes_f u = dot3_lanes(target->x, target->y, target->z, n[j], n[8 + j], n[16 + j]);
    const lanes_f v = dot3_lanes(target->x, target->y, target->z, n[24 + j], n[32 + j], n[40 + j]);
    const lanes_f w = dot3_lanes(target->x, target->y, target->z, n[48 + j], n[56 + j], n[64 + j]);
    const float rounding_u = n[96 + j], rounding_v = n[104 + j], rounding_w = n[112 + j];
    if (((const int *)&block->clear)[j]) {
        const lanes_f depth = dot3_lanes(target->x, target->y, target->z, n[72 + j], n[80 + j], n[88 + j]);
        return MASK(u >= -rounding_u * pack->reach) & MASK(v >= -rounding_v * pack->reach) &
               MASK(w >= -rounding_w * pack->reach) & MASK(depth > pack->far);
    }
    const lanes_f range = sqrt(target->x * target->x + target->y * target->y + target->z * target->z), per = 1.0f / range;
    const lanes_f inverse =
        needle_inverse_range(at->geometry, index, j, at->ox, at->oy, at->oz, target->x * per, target->y * per, target->z * per, u * per, v * per,
                             w * per, rounding_u, rounding_v, rounding_w);
    return MASK(inverse * range > pack->far);
}

/* Test the samples against one block. Returns whether any is still open. */
static inline bool test_block(Sample *samples, const Pack *packs, int n_packs, int per_pack, bool whole, Blocker *last,
                              int index, const Shaft *shaft, const Launch *at, bool *met)
{
    const Block block = prepare_block(at->geometry, index, at->ox, at->oy, at->oz);
    int8 meets8, covers8;
    cull_block(&block, shaft, &meets8, &covers8);
    *met = any8(meets8);
    if (!*met) return true;
    const int *meets = (const int *)&meets8, *covers = (const int *)&covers8;
    const float *n = (const float *)&block;
    bool open = true;
    for (int j = 0; j < BLOCK_LANES; ++j) {
        const int triangle = at->triangles[index * BLOCK_LANES + j];
        if (!meets[j] || triangle < 0) continue;
        if (covers[j] && whole) {
            for (int k = 0; k < 9; ++k) last->n[k] = n[8 * k + j];
            for (int k = 0; k < 3; ++k) last->m[k] = n[72 + 8 * k + j], last->rounding[k] = n[96 + 8 * k + j];
            last->known = true;
            return false;
        }
        lanes_i left = 0;
        for (int p = 0; p < n_packs; ++p) {
            const lanes_i other = MASK(packs[p].own != triangle);
            for (int k = p * per_pack; k < (p + 1) * per_pack; ++k) {
                const lanes_i hidden = other & hides(&block, j, index, &samples[k], &packs[p], at);
                samples[k].open &= ~hidden;
                left |= samples[k].open;
            }
        }
        open = any_lane(left);
        if (!open) return false;
    }
    return open;
}

/* Walk the tree with the shaft. Returns false where nothing of the group is left open: all of it is hidden.
 * blocks[0 .. *n_blocks - 1]: those that can hide something; *n_blocks is past MOST_BLOCKS where there are more. */
static inline bool walk(Sample *samples, const Pack *packs, int n_packs, int per_pack, bool whole, Blocker *last,
                        int *blocks, int *n_blocks, const Launch *at, const Shaft *shaft)
{
    Stack stack;
    stack.size = 1;
    stack.child[0] = 0;
    stack.near2[0] = 0.0f;
    *n_blocks = 0;
    while (stack.size > 0) {
        const int child = stack.child[--stack.size];
        if (child >= 0) {
            float8 key;
            const int8 keep = cull_node(child, shaft, at, &key);
            if (any8(keep)) push_children(&stack, at->children, child, keep, key);
            continue;
        }
        bool met;
        if (!test_block(samples, packs, n_packs, per_pack, whole, last, ~child, shaft, at, &met)) return false;
        if (met) {
            if (*n_blocks < MOST_BLOCKS) blocks[*n_blocks] = ~child;
            *n_blocks += 1;
        }
    }
    return true;
}

/* Weights of vertices 1 and 2 at the patch's own vertices, by the rule of docs/method/patches.md. Halves of halves are
 * exact in float32 as long as the depth is below 24, and so are the weights. */
static inline void find_patch(Pack *pack, lanes_i code, lanes_i depth, int deepest, lanes_f q01, lanes_f q12, lanes_f q20)
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
    lanes_f corner8[13], squared8[3];
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
        global const float *g = at->geometry + (size_t)(s / BLOCK_LANES) * (BLOCK_FLOATS * BLOCK_LANES) + s % BLOCK_LANES;
        for (int k = 0; k < 12; ++k) corner[k * LANES + lane] = g[k * BLOCK_LANES];
        corner[12 * LANES + lane] = (float)(1 << depth[lane]);
        for (int k = 0; k < 3; ++k) squared[k * LANES + lane] = at->edges[3 * triangle + k];
        if (lane + 1 < left && ++*code == 1 << depth[lane]) {
            *code = 0;
            ++*rank;
        }
    }
    pack->vx = corner8[0] - at->ox, pack->vy = corner8[1] - at->oy, pack->vz = corner8[2] - at->oz;
    pack->ex = corner8[3] - corner8[0], pack->ey = corner8[4] - corner8[1], pack->ez = corner8[5] - corner8[2];
    pack->fx = corner8[6] - corner8[0], pack->fy = corner8[7] - corner8[1], pack->fz = corner8[8] - corner8[2];
    pack->halves = corner8[12];
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
static inline Sample place(const Pack *pack, float wb, float wc)
{
    const float wa = 1.0f - wb - wc;
    const lanes_f l1 = wa * pack->a1 + wb * pack->b1 + wc * pack->c1, l2 = wa * pack->a2 + wb * pack->b2 + wc * pack->c2;
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

/* Returns to be expected of lane's patch, of which a share is seen: area cos / range^2 over the solid angle of a beam. */
static inline float expected_returns(const Pack *pack, int lane, float share, global const float *view)
{
    const Sample centre = place(pack, 1.0f / 3.0f, 1.0f / 3.0f);
#define OF(v) (((const float *)&(v))[lane])
    const float x = OF(centre.x), y = OF(centre.y), z = OF(centre.z);
    const float ex = OF(pack->ex), ey = OF(pack->ey), ez = OF(pack->ez), fx = OF(pack->fx), fy = OF(pack->fy), fz = OF(pack->fz);
    const float volume = x * (ey * fz - ez * fy) + y * (ez * fx - ex * fz) + z * (ex * fy - ey * fx);
    const float across2 = x * x + y * y, range2 = across2 + z * z;
    const float halves = OF(pack->halves);
#undef OF
    return MAGNITUDE(volume) * share / (2.0f * halves * range2 * sqrt(across2) * view[VIEW_STEPS]);
}

/* Bits of the samples of one pack that are open. */
static inline void collect(uint *bits, const Sample *samples, int n_samples, int first_bit)
{
    for (int k = 0; k < n_samples; ++k) {
        const int *open = (const int *)&samples[k].open;
        for (int lane = 0; lane < LANES; ++lane) bits[lane] |= (open[lane] != 0 ? 1u : 0u) << (first_bit + k);
    }
}

/* Cast the second pattern for the lanes in `wanted`, at the blocks that the first one met. */
static inline void refine(uint *bits, Pack *pack, lanes_i wanted, const int *blocks, int n_blocks, const Shaft *shaft,
                          const Launch *at)
{
    Sample samples[FINE];
    lanes_i left = 0;
    for (int k = 0; k < FINE; ++k) {
        samples[k] = place(pack, at->pattern[2 * (RIM + k)], at->pattern[2 * (RIM + k) + 1]);
        look(&samples[k], pack, at->view);
        samples[k].open &= wanted;
        left |= samples[k].open;
    }
    bool open = any_lane(left), met;
    int again[MOST_BLOCKS];
    if (n_blocks > MOST_BLOCKS && open)
        open = walk(samples, pack, 1, FINE, false, 0, again, &n_blocks, at, shaft);
    else
        for (int k = 0; k < n_blocks && open; ++k)
            open = test_block(samples, pack, 1, FINE, false, 0, blocks[k], shaft, at, &met);
    if (open) collect(bits, samples, FINE, RIM);
    const int *all = (const int *)&wanted;
    for (int lane = 0; lane < LANES; ++lane)
        if (all[lane]) bits[lane] |= REFINED;
}

/* Which patches want the second pattern: seen in part, or not at all while a patch of the family is seen. Patches of one
 * triangle in a group are one family: a group holds no more than one of a large triangle. */
static inline bool disagree(int *wanted, const uint *bits, const Pack *packs, int n_packs)
{
    int own[GROUP_PATCHES];
    for (int i = 0; i < n_packs * LANES; ++i) own[i] = ((const int *)&packs[i / LANES].own)[i % LANES];
    bool any = false;
    for (int first = 0; first < n_packs * LANES;) {
        int end = first;
        uint family = 0;
        for (; end < n_packs * LANES && own[end] == own[first]; ++end) family |= bits[end];
        for (; first < end; ++first) {
            wanted[first] = own[first] >= 0 && family != 0 && bits[first] != ALL_RIM ? -1 : 0;
            any |= wanted[first] != 0;
        }
    }
    return any;
}

/* Marks of one group of patches from one origin. */
static inline void see_group(global uint *marks, int group, Blocker *last, const Launch *at)
{
    /* 1: all of it out of range, or behind the triangle that hid the group before */
    const Shaft shaft = make_shaft(at->group_box + 6 * (size_t)group, at->ox, at->oy, at->oz);
    const float gx = MAGNITUDE(shaft.cx) - shaft.hx, gy = MAGNITUDE(shaft.cy) - shaft.hy, gz = MAGNITUDE(shaft.cz) - shaft.hz;
    const float dx = MOST(gx, 0.0f), dy = MOST(gy, 0.0f), dz = MOST(gz, 0.0f);
    if (dx * dx + dy * dy + dz * dz > at->view[VIEW_RANGE_MAX2] || still_hides(last, &shaft)) return;
    /* 2: the first pattern */
    Pack packs[PACKS];
    Sample samples[PACKS * RIM];
    int rank = at->groups[3 * group], code = at->groups[3 * group + 1];
    const int n_patches = at->groups[3 * group + 2], n_packs = (n_patches + LANES - 1) / LANES;
    lanes_i left = 0;
    for (int p = 0; p < n_packs; ++p) {
        load_pack(&packs[p], &rank, &code, n_patches - p * LANES, at);
        for (int k = p * RIM; k < (p + 1) * RIM; ++k) {
            samples[k] = place(&packs[p], at->pattern[2 * (k - p * RIM)], at->pattern[2 * (k - p * RIM) + 1]);
            look(&samples[k], &packs[p], at->view);
            left |= samples[k].open;
        }
    }
    if (!any_lane(left)) return;
    int blocks[MOST_BLOCKS], n_blocks;
    if (!walk(samples, packs, n_packs, RIM, true, last, blocks, &n_blocks, at, &shaft)) return;
    /* 3: the second one where samples disagree. Something is seen, so the walk was complete and `blocks` is, too. */
    uint bits[GROUP_PATCHES];
    lanes_i wanted[PACKS];
    for (int i = 0; i < GROUP_PATCHES; ++i) bits[i] = 0;
    for (int p = 0; p < n_packs; ++p) collect(bits + p * LANES, samples + p * RIM, RIM, 0);
    if (disagree((int *)wanted, bits, packs, n_packs))
        for (int p = 0; p < n_packs; ++p)
            if (any_lane(wanted[p])) refine(bits + p * LANES, &packs[p], wanted[p], blocks, n_blocks, &shaft, at);
    /* 4: what a beam can land on */
    for (int i = 0; i < n_patches; ++i) {
        const uint seen = bits[i] & ~REFINED;
        if (seen == 0) continue;
        const float share = (float)popcount(seen) / (bits[i] & REFINED ? (float)(RIM + FINE) : (float)RIM);
        if (expected_returns(&packs[i / LANES], i % LANES, share, at->view) < at->view[VIEW_RETURNS]) continue;
        marks[((const int *)&packs[i / LANES].patch)[i % LANES]] = bits[i];
    }
}

/* Mark the samples of all patches that every position sees.
 * One work-item is a run of groups of one position. NDRange (runs, positions), any local size. marks (S, n_patches) uint,
 * zeroed by the host; a patch belongs to one group, and only its work-item writes it. positions (S, 3) metres, local frame.
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
    Blocker last;
    last.known = false;
    const int first = run * groups_a_run, past = first + groups_a_run, end = past < n_groups ? past : n_groups;
    global uint *mine = marks + (size_t)position * n_patches;
    for (int group = first; group < end; ++group) see_group(mine, group, &last, &at);
}
