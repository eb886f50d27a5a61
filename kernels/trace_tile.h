/* Tiles: first hits of a tile of neighbouring beams that share one origin.
 *
 * Purpose    The traversal below every beam-exact scan; what becomes of the hits is the business of the .cl files.
 * Algorithm  A tile of TILE_ROWS x TILE_COLUMNS beams walks the tree once. Nodes are culled eight at a time by the four
 *            planes of the tile's pyramid and by distance; the triangles of a block eight at a time by the tile's four
 *            corner directions. What is left meets all packets of the tile; a triangle that covers the whole tile needs
 *            no edge test. After METHOD 2 of the project's design notes.
 *
 *              corner 3 +-------------+ corner 2      corners: the tile's bounding rectangle in the plane one metre along
 *                       | . . . . . . |               its axis, a little enlarged; planes through the origin and
 *                       | . . beams . |               two neighbouring corners, normals inward
 *              corner 0 +-------------+ corner 1
 *
 * Indices    packet p of tile k: where its beams lie in the image of a scan, template.h tells;
 *            beams[((k * PACKETS + p) * 3 + axis) * LANES + lane]; tiles[k * 40 + ...]: planes 4 x 3, corners 4 x 3,
 *            1e30 where the tile is too wide to be bounded (else 0), axis, right, up (3 x 3; zero if too wide), 6
 *            spare; rectangles[(k * 4 + s) * PACKETS + p]: least x, greatest x, least y, greatest y of packet p's
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
#define TILE_FLOATS 40
#if PACKETS % 8 != 0
#error "rectangles of packets are compared eight at a time: TILE_ROWS * TILE_COLUMNS must be a multiple of 8 * LANES"
#endif

/* Distances are compared with 1e-5 to spare: a hit's rounded range may fall short of its box by some ulp. */
#define NEAR_SLACK 1.00001f

typedef struct {
    lanes_f inverse[PACKETS]; /* 1 / range of the first hit so far; at first 1 / range_max, less a little */
    lanes_i triangle[PACKETS];
    float least; /* smallest of `inverse`: nothing farther than 1 / least matters any more */
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

static inline void update_least(Returns *out)
{
    lanes_f least = out->inverse[0];
    for (int p = 1; p < PACKETS; ++p) least = LEAST(least, out->inverse[p]);
    const float *each = (const float *)&least;
    float smallest = each[0];
    for (int lane = 1; lane < LANES; ++lane) smallest = LEAST(smallest, each[lane]);
    out->least = smallest;
}

/* Which triangles of a block can return a beam of the tile (`meets`), which cover all of it (`covers`).
 * A beam is a positive sum of the corners c, with c . axis = 1, whose weights add up to at most 1: so the values at
 * the corners bound d . N from both sides, and d . m from above. */
static inline void cull_block(const Block *block, global const float *corners, float least, int8 *meets, int8 *covers)
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
    const int8 in_reach = nearest * NEAR_SLACK + corners[12] >= least;
    *meets = PICK(block->clear, front & in_reach, front | back);
    *covers = block->clear & (low0 > slack0) & (low1 > slack1) & (low2 > slack2);
}

/* Bounding rectangles of a block's triangles in the plane one metre along the tile's axis. */
typedef struct {
    float8 x0, x1, y0, y1;
} Span;

/* Rounding of x / z is some 1e-5 where z > (|x| + |y|) / 5, and triangles count as larger by some 2e-6 rad. */
#define SPAN_PAD 1e-4f

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

/* Numbers of the packets whose rectangle meets that of lane j; returns how many. */
static inline int packets_met(int *met, const Span *span, int j, global const float *rectangles)
{
    const float *s = (const float *)span;
    const float x0 = s[j], x1 = s[8 + j], y0 = s[16 + j], y1 = s[24 + j];
    int count = 0;
    for (int p = 0; p < PACKETS; p += 8) {
        global const float *r = rectangles + p;
        const int8 meets = (LOAD8(r) <= x1) & (LOAD8(r + PACKETS) >= x0) & (LOAD8(r + 2 * PACKETS) <= y1) &
                           (LOAD8(r + 3 * PACKETS) >= y0);
        const int *each = (const int *)&meets;
        for (int k = 0; k < 8; ++k) {
            met[count] = p + k;
            count -= each[k];
        }
    }
    return count;
}

/* Test the packets of tile `beams` against the triangles of one block. */
static inline void test_block(Returns *out, global const float *geometry, global const int *triangles, int index,
                              global const float *beams, global const float *corners, global const float *rectangles,
                              float ox, float oy, float oz)
{
    const Block block = prepare_block(geometry, index, ox, oy, oz);
    int8 meets8, covers8;
    cull_block(&block, corners, out->least, &meets8, &covers8);
    if (!any8(meets8)) return;
    const Span span = span_block(geometry, index, block.clear, ox, oy, oz, corners + 13);
    int met[PACKETS + 1];
    const int *meets = (const int *)&meets8, *covers = (const int *)&covers8, *clear = (const int *)&block.clear;
    const float *n = (const float *)&block; /* n0x .. n2z, mx .. mz, rounding0 .. 2: eight lanes each */
    for (int j = 0; j < BLOCK_LANES; ++j) {
        const int triangle = triangles[index * BLOCK_LANES + j];
        if (!meets[j] || triangle < 0) continue;
        const float ux = n[j], uy = n[8 + j], uz = n[16 + j];
        const float vx = n[24 + j], vy = n[32 + j], vz = n[40 + j];
        const float wx = n[48 + j], wy = n[56 + j], wz = n[64 + j];
        const float mx = n[72 + j], my = n[80 + j], mz = n[88 + j];
        const float rounding_u = n[96 + j], rounding_v = n[104 + j], rounding_w = n[112 + j];
        if (covers[j]) {
            for (int p = 0; p < PACKETS; ++p) {
                global const float *d = beams + p * (3 * LANES);
                const lanes_f dx = LANES_LOAD(d), dy = LANES_LOAD(d + LANES), dz = LANES_LOAD(d + 2 * LANES);
                keep_first(out, p, dot3_lanes(dx, dy, dz, mx, my, mz), (lanes_i)(-1), (lanes_i)(triangle));
            }
            continue;
        }
        const int n_met = packets_met(met, &span, j, rectangles);
        for (int k = 0; k < n_met; ++k) {
            const int p = met[k];
            global const float *d = beams + p * (3 * LANES);
            const lanes_f dx = LANES_LOAD(d), dy = LANES_LOAD(d + LANES), dz = LANES_LOAD(d + 2 * LANES);
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
    update_least(out);
}

static inline float8 gap(float8 below, float8 above)
{
    const float8 outside = MOST(below, above);
    return MOST(outside, 0.0f);
}

/* Which children of a node the tile's pyramid can meet nearer than 1 / least; *key gets their squared distances. */
static inline int8 cull_node(global const float *boxes, int node, global const float *planes, float least, float ox,
                             float oy, float oz, float8 *key)
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
    for (int c = 0; c < 4; ++c) {
        /* the corner of the box that lies farthest inwards */
        const float x = planes[3 * c], y = planes[3 * c + 1], z = planes[3 * c + 2];
        keep &= dot3_8(x, y, z, box[x > 0.0f ? 3 : 0], box[y > 0.0f ? 4 : 1], box[z > 0.0f ? 5 : 2]) >= 0.0f;
    }
    *key = near2;
    return keep;
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
    out->least = limit;
    /* 2: front to back. Invariant: what is not on the stack can't change `out`. */
    Stack stack;
    stack.size = 1;
    stack.child[0] = 0;
    stack.near2[0] = 0.0f;
    while (stack.size > 0) {
        const int at = --stack.size;
        if (stack.near2[at] * (out->least * out->least) > NEAR_SLACK) continue;
        const int child = stack.child[at];
        if (child < 0) {
            test_block(out, geometry, triangles, ~child, beams, tile + 12, rectangles, ox, oy, oz);
        } else {
            float8 key;
            const int8 keep = cull_node(boxes, child, tile, out->least, ox, oy, oz, &key);
            push_children(&stack, children, child, keep, key);
        }
    }
}

#define TREE_ARGUMENTS                                                                                                 \
    global const float *boxes, global const int *children, global const float *geometry, global const int *triangles, \
        global const int *slot, global const float *edges, global const int *address
#define GRID_ARGUMENTS                                                                                                \
    global const float *tiles, global const float *beams, global const float *rectangles,                             \
        global const int *places, int columns, int image_beams, int first_beam, float range_min, float range_max,     \
        global const float *positions

#endif
