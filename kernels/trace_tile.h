/* Tiles: first hits of a tile of neighbouring beams that share one origin.
 *
 * Purpose    The traversal below every beam-exact scan; what becomes of the hits is the business of the .cl files.
 * Algorithm  A tile of TILE_ROWS x TILE_COLUMNS beams walks the tree once. The children of a node are culled eight at a time by
 *            the four planes of the tile's pyramid and by distance; each gets its rectangle in the plane one metre along
 *            the tile's axis. A child or block is looked at only if its rectangle meets that of a packet whose farthest
 *            hit lies behind it: a tile across a table's edge does not look at what lies hidden below the table for the
 *            sake of the beams that pass it. The triangles of a block are culled eight at a time by the tile's corner
 *            directions and each is tested against the packets that it meets; a triangle that covers the whole tile
 *            needs no edge test. After METHOD 2 of the project's design notes; docs/method/scan-engine.md.
 *
 *              corner 3 +-------------+ corner 2      corners: the tile's bounding rectangle in the plane one metre along
 *                       | . . . . . . |               its axis, a little enlarged; planes through the origin and
 *                       | . . beams . |               two neighbouring corners, normals inward
 *              corner 0 +-------------+ corner 1
 *
 * Indices    packet p of tile k: where its beams lie in the image of a scan, template.h tells;
 *            beams[((k * PACKETS + p) * 3 + axis) * LANES + lane]; tiles[k * 40 + ...]: planes 4 x 3, corners 4 x 3,
 *            a zero, axis, right, up (3 x 3), 6 spare; rectangles[(k * 4 + s) * PACKETS + p]: least x, greatest x, least y, greatest y of packet p's
 *            beams in the plane one metre along the axis, x to the right and y up.
 *
 * Define         meaning                                            example
 * TILE_ROWS      rows of beams a tile                               -DTILE_ROWS=4
 * TILE_COLUMNS   columns of beams a tile, a multiple of LANES       -DTILE_COLUMNS=32
 *                (rows times columns: a multiple of 8 LANES)
 * LANES, STACK   see lanes.h, tree.h
 */
#ifndef TLSPLAN_TRACE_TILE_H
#define TLSPLAN_TRACE_TILE_H
#include "hit.h"
#include "tree.h"

#define PACKETS_ACROSS (TILE_COLUMNS / LANES)
#define PACKETS (TILE_ROWS * PACKETS_ACROSS)
/* Nodes on the way from the root to a block, at most: see tree.h. */
#define LEVELS (STACK / 7 + 1)
#define PACKETS_A_GROUP (PACKETS < 32 ? PACKETS : 32)
#define PACKET_GROUPS ((PACKETS + 31) / 32)
#define TILE_FLOATS 40
#if PACKETS % 8 != 0
#error "rectangles of packets are compared eight at a time: TILE_ROWS * TILE_COLUMNS must be a multiple of 8 * LANES"
#endif

/* Distances are compared with 1e-5 to spare: a hit's rounded range may fall short of its box by some ulp. */
#define NEAR_SLACK 1.00001f

typedef struct {
    lanes_f inverse[PACKETS]; /* 1 / range of the first hit so far; at first 1 / range_max, less a little */
    lanes_i triangle[PACKETS];
    /* Smallest of `inverse`: nothing farther than 1 / least matters any more to the packet or the tile. */
    float8 least_of_packet[PACKETS / 8]; /* lane e of k is packet 8 k + e */
    float least;
} Returns;

/* Keep the nearer hit; at one and the same range the lower triangle number, so that order does not matter. */
static inline void keep_first(Returns *out, int p, lanes_f inverse, lanes_i inside, lanes_i triangle)
{
    const lanes_f best = out->inverse[p];
    const lanes_i have = out->triangle[p];
    const lanes_i better = MASK(inverse > best) | (MASK(inverse == best) & MASK(triangle < have));
    const lanes_i take = inside & better;
    out->inverse[p] = PICK(take, inverse, best);
    out->triangle[p] = PICK(take, triangle, have);
}

#if LANES >= 8
/* Smallest of the lanes that leave a packet eight. */
static inline float8 eight_of(lanes_f packet)
{
#if LANES == 16
    return LEAST(packet.lo, packet.hi);
#else
    return packet;
#endif
}
#endif

/* Smallest lane of each of eight packets. */
static inline float8 least_of_eight(const lanes_f *inverse)
{
#if LANES >= 8
    float8 halves[4], quarters[2];
    for (int k = 0; k < 4; ++k) {
        const float8 first = eight_of(inverse[2 * k]), second = eight_of(inverse[2 * k + 1]);
        const float8 low = (float8)(first.lo, second.lo);
        const float8 high = (float8)(first.hi, second.hi);
        halves[k] = LEAST(low, high);
    }
    for (int k = 0; k < 2; ++k) {
        const float8 low = (float8)(halves[2 * k].s01, halves[2 * k].s45, halves[2 * k + 1].s01, halves[2 * k + 1].s45);
        const float8 high = (float8)(halves[2 * k].s23, halves[2 * k].s67, halves[2 * k + 1].s23, halves[2 * k + 1].s67);
        quarters[k] = LEAST(low, high);
    }
    const float8 low = (float8)(quarters[0].s0246, quarters[1].s0246);
    const float8 high = (float8)(quarters[0].s1357, quarters[1].s1357);
    return LEAST(low, high);
#else
    float8 out;
    float *least = (float *)&out;
    for (int e = 0; e < 8; ++e) {
        const float *each = (const float *)(inverse + e);
        least[e] = each[0];
        for (int lane = 1; lane < LANES; ++lane) least[e] = LEAST(least[e], each[lane]);
    }
    return out;
#endif
}

/* After hits on the packets 8 k .. 8 k + 7 for which bit k of `changed` is set. */
static inline void update_least(Returns *out, uint changed)
{
    for (int k = 0; k < PACKETS / 8; ++k)
        if (changed >> k & 1) out->least_of_packet[k] = least_of_eight(out->inverse + 8 * k);
    float8 least8 = out->least_of_packet[0];
    for (int k = 1; k < PACKETS / 8; ++k) least8 = LEAST(least8, out->least_of_packet[k]);
    const float4 least4 = LEAST(least8.lo, least8.hi);
    const float2 least2 = LEAST(least4.lo, least4.hi);
    out->least = LEAST(least2.x, least2.y);
}

/* Which triangles of a block can return a beam of the tile (`meets`), which cover all of it (`covers`).
 * A beam is a positive sum of the corners c, with c . axis = 1, whose weights add up to at most 1: so the values at
 * the corners bound d . N from both sides, and d . m from above. */
static inline void cull_block(const Block *block, global const float *corners, float least, int8 *meets, int8 *covers,
                              float8 *inverse)
{
    float8 low0 = INFINITY, low1 = INFINITY, low2 = INFINITY;
    float8 high0 = -INFINITY, high1 = -INFINITY, high2 = -INFINITY, nearest = -INFINITY;
    for (int c = 0; c < 4; ++c) {
        const float x = corners[3 * c], y = corners[3 * c + 1], z = corners[3 * c + 2];
        const float8 u = dot3_8(x, y, z, block->n0x, block->n0y, block->n0z);
        const float8 v = dot3_8(x, y, z, block->n1x, block->n1y, block->n1z);
        const float8 w = dot3_8(x, y, z, block->n2x, block->n2y, block->n2z);
        low0 = LEAST(u, low0), high0 = MOST(u, high0);
        low1 = LEAST(v, low1), high1 = MOST(v, high1);
        low2 = LEAST(w, low2), high2 = MOST(w, high2);
        const float8 near = dot3_8(x, y, z, block->mx, block->my, block->mz);
        nearest = MOST(near, nearest);
    }
    /* 4: a corner is up to 3.3 long, and the bound of the rounding is for unit length */
    const float8 slack0 = 4.0f * block->rounding0, slack1 = 4.0f * block->rounding1, slack2 = 4.0f * block->rounding2;
    const int8 front = (high0 >= -slack0) & (high1 >= -slack1) & (high2 >= -slack2);
    const int8 back = (low0 <= slack0) & (low1 <= slack1) & (low2 <= slack2);
    *inverse = PICK(block->clear, nearest * NEAR_SLACK, (float8)(INFINITY));
    const int8 in_reach = *inverse >= least;
    *meets = PICK(block->clear, front & in_reach, front | back);
    *covers = block->clear & (low0 > slack0) & (low1 > slack1) & (low2 > slack2);
}

/* Bounding rectangles of a block's triangles in the plane one metre along the tile's axis. */
typedef struct {
    float8 x0, x1, y0, y1;
} Span;

/* Rounding of x / z is some 1e-5 where z > (|x| + |y|) / 5, and triangles count as larger by some 2e-6 rad. */
#define SPAN_PAD 1e-4f
/* The same for a box, whose z is exacter: 1e-6 of its distance. */
#define BOX_BESIDE 0.02f

static inline void grow_span(Span *span, int8 *bounded, global const float *g, float ox, float oy, float oz,
                             global const float *frame)
{
    const float8 vx = LOAD8(g) - ox, vy = LOAD8(g + 8) - oy, vz = LOAD8(g + 16) - oz;
    const float8 z = dot3_8(frame[0], frame[1], frame[2], vx, vy, vz);
    const float8 right = dot3_8(frame[3], frame[4], frame[5], vx, vy, vz);
    const float8 up = dot3_8(frame[6], frame[7], frame[8], vx, vy, vz);
    const float8 per_z = 1.0f / z, x = right * per_z, y = up * per_z;
    *bounded &= z > 0.2f * (MAGNITUDE8(right) + MAGNITUDE8(up));
    span->x0 = LEAST(x, span->x0), span->x1 = MOST(x, span->x1);
    span->y0 = LEAST(y, span->y0), span->y1 = MOST(y, span->y1);
}

/* Triangles beside or behind the tile's axis, and those that are not clear, get the whole plane. */
static inline Span span_block(global const float *geometry, int index, int8 clear, float ox, float oy, float oz,
                              global const float *frame)
{
    global const float *g = geometry + (size_t)index * (BLOCK_FLOATS * BLOCK_LANES);
    Span span = {1e30f, -1e30f, 1e30f, -1e30f};
    int8 bounded = clear;
    for (int vertex = 0; vertex < 3; ++vertex) grow_span(&span, &bounded, g + 24 * vertex, ox, oy, oz, frame);
    span.x0 = PICK(bounded, span.x0 - SPAN_PAD, (float8)(-1e30f));
    span.x1 = PICK(bounded, span.x1 + SPAN_PAD, (float8)(1e30f));
    span.y0 = PICK(bounded, span.y0 - SPAN_PAD, (float8)(-1e30f));
    span.y1 = PICK(bounded, span.y1 + SPAN_PAD, (float8)(1e30f));
    return span;
}

/* Packets that triangle j may return a beam of: rectangles meet, and it is not farther than all their hits. Bit p of
 * group g is packet 32 g + p. */
static inline uint packets_met(const Returns *out, const Span *span, const float8 *inverse, int j,
                               global const float *rectangles, int group)
{
    const float *s = (const float *)span;
    const float x0 = s[j], x1 = s[8 + j], y0 = s[16 + j], y1 = s[24 + j], nearest = ((const float *)inverse)[j];
    int8 met = 0;
    for (int p = 0; p < PACKETS_A_GROUP; p += 8) {
        if (PACKETS % 32 != 0 && 32 * group + p >= PACKETS) break; /* the last group is not full */
        global const float *r = rectangles + 32 * group + p;
        const int8 meets = (LOAD8(r) <= x1) & (LOAD8(r + PACKETS) >= x0) & (LOAD8(r + 2 * PACKETS) <= y1) &
                           (LOAD8(r + 3 * PACKETS) >= y0) & (out->least_of_packet[4 * group + p / 8] <= nearest);
        met |= meets & ((int8)(1, 2, 4, 8, 16, 32, 64, 128) << p);
    }
    const int4 met4 = met.lo | met.hi;
    const int2 met2 = met4.lo | met4.hi;
    return (uint)(met2.x | met2.y);
}

/* Test the packets of tile `beams` against the triangles of one block. */
static inline void test_block(Returns *out, global const float *geometry, global const int *triangles, int index,
                              global const float *beams, global const float *corners, global const float *rectangles,
                              float ox, float oy, float oz)
{
    const Block block = prepare_block(geometry, index, ox, oy, oz);
    int8 meets8, covers8;
    float8 inverse8;
    cull_block(&block, corners, out->least, &meets8, &covers8, &inverse8);
    meets8 &= LOAD8I(triangles + (size_t)index * BLOCK_LANES) >= 0;
    if (!any8(meets8)) return;
    const Span span = span_block(geometry, index, block.clear, ox, oy, oz, corners + 13);
    const int *meets = (const int *)&meets8, *covers = (const int *)&covers8, *clear = (const int *)&block.clear;
    const float *n = (const float *)&block; /* n0x .. n2z, mx .. mz, rounding0 .. 2: eight lanes each */
    uint changed = 0;
    for (int lanes = bits8(meets8); lanes; lanes &= lanes - 1) {
        const int j = lowest_bit(lanes);
        const int triangle = triangles[index * BLOCK_LANES + j];
        const float ux = n[j], uy = n[8 + j], uz = n[16 + j];
        const float vx = n[24 + j], vy = n[32 + j], vz = n[40 + j];
        const float wx = n[48 + j], wy = n[56 + j], wz = n[64 + j];
        const float mx = n[72 + j], my = n[80 + j], mz = n[88 + j];
        const float rounding_u = n[96 + j], rounding_v = n[104 + j], rounding_w = n[112 + j];
        for (int group = 0; group < PACKET_GROUPS; ++group) {
            for (uint met = packets_met(out, &span, &inverse8, j, rectangles, group); met; met &= met - 1) {
                const int p = 32 * group + lowest_bit(met);
                global const float *d = beams + p * (3 * LANES);
                const lanes_f dx = LANES_LOAD(d), dy = LANES_LOAD(d + LANES), dz = LANES_LOAD(d + 2 * LANES);
                changed |= 1u << (p / 8);
                if (covers[j]) {
                    keep_first(out, p, dot3_lanes(dx, dy, dz, mx, my, mz), (lanes_i)(-1), (lanes_i)(triangle));
                    continue;
                }
                const lanes_f u = dot3_lanes(dx, dy, dz, ux, uy, uz);
                const lanes_f v = dot3_lanes(dx, dy, dz, vx, vy, vz);
                const lanes_f w = dot3_lanes(dx, dy, dz, wx, wy, wz);
                if (clear[j]) {
                    const lanes_i inside = MASK(u >= -rounding_u) & MASK(v >= -rounding_v) & MASK(w >= -rounding_w);
                    const lanes_i truly = MASK(u >= 0.0f) & MASK(v >= 0.0f) & MASK(w >= 0.0f);
                    const lanes_f inverse = dot3_lanes(dx, dy, dz, mx, my, mz);
                    const lanes_i named = PICK(truly, (lanes_i)(triangle), (lanes_i)(triangle | BESIDE_BIT));
                    keep_first(out, p, PICK(truly, inverse, inverse * BESIDE), inside, named);
                } else {
                    const lanes_f inverse = needle_inverse_range(geometry, index, j, ox, oy, oz, dx, dy, dz, u, v, w,
                                                                 rounding_u, rounding_v, rounding_w);
                    keep_first(out, p, inverse, MASK(inverse > 0.0f), (lanes_i)(triangle));
                }
            }
        }
    }
    if (changed) update_least(out, changed);
}

static inline float8 gap(float8 below, float8 above)
{
    const float8 outside = MOST(below, above);
    return MOST(outside, 0.0f);
}

/* A direction, and which corner of a box lies farthest along it: indices into its six faces. */
typedef struct {
    float x, y, z;
    int far_x, far_y, far_z, near_x, near_y, near_z;
} Way;

static inline Way way_of(global const float *v)
{
    Way way = {v[0], v[1], v[2]};
    way.far_x = v[0] > 0.0f ? 3 : 0, way.near_x = 3 - way.far_x;
    way.far_y = v[1] > 0.0f ? 4 : 1, way.near_y = 5 - way.far_y;
    way.far_z = v[2] > 0.0f ? 5 : 2, way.near_z = 7 - way.far_z;
    return way;
}

#define FARTHEST_ALONG(way, box) dot3_8((way).x, (way).y, (way).z, box[(way).far_x], box[(way).far_y], box[(way).far_z])
#define NEAREST_ALONG(way, box) dot3_8((way).x, (way).y, (way).z, box[(way).near_x], box[(way).near_y], box[(way).near_z])

/* A tile's planes and axes. */
typedef struct {
    Way plane[4], axis, right, up;
} TileFrame;

/* Bounding rectangles of boxes in the plane one metre along the axis; the whole plane for those beside or behind it. */
static inline Span span_boxes(const float8 *box, const TileFrame *frame)
{
    const float8 z0 = NEAREST_ALONG(frame->axis, box), z1 = FARTHEST_ALONG(frame->axis, box);
    const float8 x0 = NEAREST_ALONG(frame->right, box), x1 = FARTHEST_ALONG(frame->right, box);
    const float8 y0 = NEAREST_ALONG(frame->up, box), y1 = FARTHEST_ALONG(frame->up, box);
    const float8 wide_x = MOST(MAGNITUDE8(x0), MAGNITUDE8(x1)), wide_y = MOST(MAGNITUDE8(y0), MAGNITUDE8(y1));
    const int8 bounded = z0 > BOX_BESIDE * (wide_x + wide_y);
    const float8 near = 1.0f / z0, far = 1.0f / z1;
    Span span;
    span.x0 = PICK(bounded, x0 * PICK(x0 > 0.0f, far, near) - SPAN_PAD, (float8)(-1e30f));
    span.x1 = PICK(bounded, x1 * PICK(x1 > 0.0f, near, far) + SPAN_PAD, (float8)(1e30f));
    span.y0 = PICK(bounded, y0 * PICK(y0 > 0.0f, far, near) - SPAN_PAD, (float8)(-1e30f));
    span.y1 = PICK(bounded, y1 * PICK(y1 > 0.0f, near, far) + SPAN_PAD, (float8)(1e30f));
    return span;
}

/* Which children of a node the tile's pyramid can meet nearer than 1 / least; *key gets their squared distances, *span
 * their rectangles. */
static inline int8 cull_node(global const float *boxes, int node, const TileFrame *frame, float least, float ox, float oy,
                             float oz, float8 *key, Span *span)
{
    global const float *b = boxes + (size_t)node * (6 * NODE_CHILDREN);
    float8 box[6]; /* x0 y0 z0 x1 y1 z1 minus the origin */
    box[0] = LOAD8(b) - ox, box[1] = LOAD8(b + 1 * 8) - oy, box[2] = LOAD8(b + 2 * 8) - oz;
    box[3] = LOAD8(b + 3 * 8) - ox, box[4] = LOAD8(b + 4 * 8) - oy, box[5] = LOAD8(b + 5 * 8) - oz;
    const float8 gapx = gap(box[0], -box[3]);
    const float8 gapy = gap(box[1], -box[4]);
    const float8 gapz = gap(box[2], -box[5]);
    const float8 near2 = dot3_8(gapx, gapy, gapz, gapx, gapy, gapz);
    int8 keep = near2 * (least * least) <= NEAR_SLACK;
    for (int c = 0; c < 4; ++c) keep &= FARTHEST_ALONG(frame->plane[c], box) >= 0.0f;
    *key = near2;
    *span = span_boxes(box, frame);
    return keep;
}

/* Whether a box with this rectangle, lane 0 of `span`, and squared distance can return a beam of any packet. */
static inline bool meets_packet(const Returns *out, const float *span, float near2, global const float *rectangles)
{
    int8 open = 0;
    for (int p = 0; p < PACKETS; p += 8) {
        global const float *r = rectangles + p;
        const float8 least = out->least_of_packet[p / 8];
        open |= (LOAD8(r) <= span[8]) & (LOAD8(r + PACKETS) >= span[0]) & (LOAD8(r + 2 * PACKETS) <= span[24]) &
                (LOAD8(r + 3 * PACKETS) >= span[16]) & (near2 * (least * least) <= NEAR_SLACK);
    }
    return any8(open);
}

/* Walk the tree with one tile. */
static inline void trace_tile(Returns *out, global const float *boxes, global const int *children,
                              global const float *geometry, global const int *triangles, global const float *tile,
                              global const float *beams, global const float *rectangles, float ox, float oy, float oz,
                              float range_max)
{
    /* 1: nothing found. A little less than 1 / range_max, so that `resolve` decides about the limit itself. */
    const float limit = (1.0f / range_max) * 0.99999f;
    for (int p = 0; p < PACKETS; ++p) {
        out->inverse[p] = limit;
        out->triangle[p] = -1;
    }
    for (int k = 0; k < PACKETS / 8; ++k) out->least_of_packet[k] = limit;
    out->least = limit;
    /* 2: front to back. Invariant: what is not on the stack can't change `out`. A node's children lie on the stack above
     * those of its parents, so that as many nodes are open as the tree has levels. */
    TileFrame frame;
    for (int c = 0; c < 4; ++c) frame.plane[c] = way_of(tile + 3 * c);
    frame.axis = way_of(tile + 25), frame.right = way_of(tile + 28), frame.up = way_of(tile + 31);
    Span spans[LEVELS];
    int nodes[LEVELS];
    Stack stack;
    stack.size = 0;
    int child = 0, level = 0;
    for (;;) {
        if (child < 0) {
            test_block(out, geometry, triangles, ~child, beams, tile + 12, rectangles, ox, oy, oz);
        } else {
            float8 key;
            const int8 keep = cull_node(boxes, child, &frame, out->least, ox, oy, oz, &key, &spans[level]);
            nodes[level] = child;
            push_children(&stack, level, keep, key);
        }
        for (;;) {
            if (stack.size == 0) return;
            const int at = --stack.size, lane = stack.key[at] & 7;
            const float near2 = as_float(stack.key[at] & ~7);
            level = stack.from[at];
            const float *span = (const float *)&spans[level] + lane;
            if (near2 * (out->least * out->least) > NEAR_SLACK) continue;
            if (!meets_packet(out, span, near2, rectangles)) continue;
            child = children[nodes[level] * NODE_CHILDREN + lane];
            if (PREFETCH && at > 0) {
                const int next = nodes[stack.from[at - 1]] * NODE_CHILDREN + (stack.key[at - 1] & 7);
                fetch_ahead(children[next], boxes, geometry, children, triangles);
            }
            ++level;
            break;
        }
    }
}

/* The hits of packets p .. p + TOGETHER - 1 of the tile `beams`. */
static inline void resolve_packets(Hit *hits, const Returns *returns, int p, global const float *beams,
                                   global const float *geometry, global const int *slot, global const float *edges,
                                   global const int *address, global const int *whole, float ox, float oy, float oz,
                                   float range_min, float range_max)
{
    Beams together[TOGETHER];
    EACH_PACKET(k) {
        global const float *d = beams + (p + k) * (3 * LANES);
        together[k].dx = LANES_LOAD(d), together[k].dy = LANES_LOAD(d + LANES), together[k].dz = LANES_LOAD(d + 2 * LANES);
        together[k].inverse = returns->inverse[p + k], together[k].triangle = returns->triangle[p + k];
    }
    resolve(hits, together, geometry, slot, edges, address, whole, ox, oy, oz, range_min, range_max);
}

#define TREE_ARGUMENTS                                                                                                 \
    global const float *boxes, global const int *children, global const float *geometry, global const int *triangles, \
        global const int *slot, global const float *edges, global const int *address
#define GRID_ARGUMENTS                                                                                                \
    global const float *tiles, global const float *beams, global const float *rectangles,                             \
        global const int *places, int columns, int image_beams, int first_beam, float range_min, float range_max,     \
        global const float *positions

#endif
