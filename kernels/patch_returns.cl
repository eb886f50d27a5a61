/* Returns: how many of a scan's beams lie on every patch, and the sums that its evenness is computed from.
 *
 * Purpose    Counts and moments of thousands of scans without their returns: docs/method/returns.md.
 * Algorithm  A tile keeps one record a patch that it hits and adds its own hits to it; patch_rows.cl adds the records of
 *            a position's tiles. Sums are of integers: every hit's contribution is rounded by itself and integers add up
 *            to the same in any order, so that tiles, batches, bands and cores leave no trace in the bits.
 *
 *              hit p, |p - a| <= 2^power          a: first vertex of the patch, the centre of its moments
 *              x = (p - a) / 2^power              2^power: the least power of two above its longest edge
 *              q = nearest integer to x 2^20      sum of q over hits: int a lane of the tile, long in a record
 *
 * Layout     record r of tile k of position s: entry (r S + s) tiles + k of list, n_returns; with MOMENTS also of power,
 *            sums (10 long: x y z, |x|^2, w, w x, w y, w z, w |x|^2, range) and extremes (least range, greatest cosine),
 *            w = 2 - |cos incidence|.
 *
 * Define     meaning                                                       example
 * MOMENTS    0: counts only; 1: sums and extremes too                      -DMOMENTS=1
 * others     see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"
#include "template.h"

#define LIST (TILE_ROWS * TILE_COLUMNS)
/* Places of the table that finds a patch's record: a power of two, at least twice the records. */
#define PLACES (LIST <= 32 ? 64 : LIST <= 128 ? 256 : LIST <= 256 ? 512 : LIST <= 512 ? 1024 : 4096)
#if LIST > 2048
#error "a tile can have 2048 beams at most: TILE_ROWS * TILE_COLUMNS"
#endif

typedef struct {
    short record[PLACES]; /* -1: free */
    int size;             /* records so far */
} Table;

/* The record of a patch; `size` grows where it is new. */
static inline int find_record(Table *table, global int *list, size_t stride, int patch)
{
    int place = (int)(((uint)patch * 2654435769u) >> 16) & (PLACES - 1);
    for (;; place = (place + 1) & (PLACES - 1)) {
        const int record = table->record[place];
        if (record < 0) {
            table->record[place] = (short)table->size;
            list[stride * table->size] = patch;
            return table->size++;
        }
        if (list[stride * record] == patch) return record;
    }
}

/* Mask of the lanes that are beams; the others pad the tile. */
static inline lanes_i real_lanes(Place place)
{
    lanes_i real = -1;
    if (place.begin == 0 && place.end == LANES) return real;
    int *each = (int *)&real;
    for (int lane = 0; lane < LANES; ++lane) each[lane] = -(lane >= place.begin && lane < place.end);
    return real;
}

/* How many lanes a mask has. */
static inline int count_lanes(lanes_i mask)
{
    const int *each = (const int *)&mask;
    int count = 0;
    for (int lane = 0; lane < LANES; ++lane) count -= each[lane];
    return count;
}

#if MOMENTS
#define SUMS 10
#define WHOLES (SUMS + 1)
/* Contributions are whole multiples of 1 / UNIT. */
#define UNIT 1048576.0f
/* A hit counts as at most this far from the first vertex along an axis, in units of 2^power, and its square as at most
 * this: only rounding puts one farther, and integers stay below 2^22. */
#define FARTHEST 1.25f
#define GREATEST_SQUARE 1.99f

/* What turns a hit into coordinates of its patch. */
typedef struct {
    float cx, cy, cz; /* origin minus first vertex */
    float scale;      /* 2^-power */
} Frame;

/* The frame of patch `code` of a triangle. A patch's corners have whole multiples of 2^-depth for weights: exact. */
static inline Frame frame_of(global const float *geometry, global const int *slot, global const float *edges,
                             int triangle, int code, int depth, float ox, float oy, float oz, int *power)
{
    /* weights of vertices 1 and 2 in the corners of the part, by patch.h's rule */
    float a1 = 0, a2 = 0, b1 = 1, b2 = 0, c1 = 0, c2 = 1;
    float q01 = edges[3 * triangle], q12 = edges[3 * triangle + 1], q20 = edges[3 * triangle + 2];
    for (int level = depth - 1; level >= 0; --level) {
        const bool is01 = q01 >= q12 && q01 >= q20, is12 = q12 >= q20;
        const float qab = is01 ? q01 : is12 ? q12 : q20;
        const float qbc = is01 ? q12 : is12 ? q20 : q01;
        const float qca = is01 ? q20 : is12 ? q01 : q12;
        const float p1 = is01 ? a1 : is12 ? b1 : c1, p2 = is01 ? a2 : is12 ? b2 : c2;
        const float r1 = is01 ? b1 : is12 ? c1 : a1, r2 = is01 ? b2 : is12 ? c2 : a2;
        const float s1 = is01 ? c1 : is12 ? a1 : b1, s2 = is01 ? c2 : is12 ? a2 : b2;
        const float qcm = (2.0f * qca + 2.0f * qbc - qab) / 4.0f;
        const float m1 = 0.5f * (p1 + r1), m2 = 0.5f * (p2 + r2);
        const bool second = (code >> level) & 1;
        a1 = second ? m1 : p1, a2 = second ? m2 : p2;
        b1 = second ? r1 : m1, b2 = second ? r2 : m2;
        c1 = s1, c2 = s2;
        q01 = qab / 4.0f;
        q12 = second ? qbc : qcm;
        q20 = second ? qcm : qca;
    }
    const int s = slot[triangle];
    global const float *g = geometry + (size_t)(s / BLOCK_LANES) * (BLOCK_FLOATS * BLOCK_LANES) + s % BLOCK_LANES;
#define AT(k) g[(k) * BLOCK_LANES]
    Frame out;
    out.cx = (ox - AT(0)) - (a1 * (AT(3) - AT(0)) + a2 * (AT(6) - AT(0)));
    out.cy = (oy - AT(1)) - (a1 * (AT(4) - AT(1)) + a2 * (AT(7) - AT(1)));
    out.cz = (oz - AT(2)) - (a1 * (AT(5) - AT(2)) + a2 * (AT(8) - AT(2)));
#undef AT
    /* A float below 2^k has exponent k - 1; the root of one below 2^k is below 2^ceil(k / 2). */
    const float q = MOST(MOST(q01, q12), q20);
    const int above = ((as_int(q) >> 23) & 255) - 126;
    const int half_up = (above + 1) >> 1;
    *power = MOST(half_up, -60);
    out.scale = as_float((127 - *power) << 23);
    return out;
}

/* Packets after which sums go over to the record: an int holds 512 integers below 2^22. */
#define SPILL 512

/* What the hits on one patch add up to, lane by lane. */
typedef struct {
    lanes_i whole[WHOLES]; /* as `sums`, the range as whole metres and a remainder */
    lanes_f least, greatest;
    Frame frame;
} Sums;

/* Nearest integers to x, |x| < 2^22: adding 1.5 2^23 leaves the integer in the low bits. No conversion built-in, which
 * PoCL 3.0 leaves a call. */
static inline lanes_i nearest(lanes_f x)
{
    const lanes_f shifted = x + 12582912.0f;
#if LANES == 1
    return as_int(shifted) - 0x4b400000;
#else
    return GLUE(as_int, LANES)(shifted) - 0x4b400000;
#endif
}

static inline lanes_f clamp_lanes(lanes_f x)
{
    const lanes_f low = MOST(x, -FARTHEST);
    return LEAST(low, FARTHEST);
}

/* Add the hits in the lanes of `mine`. */
static inline void add_hits(Sums *sums, const Hit *hit, lanes_i mine, lanes_f dx, lanes_f dy, lanes_f dz)
{
    const Frame *frame = &sums->frame;
    const lanes_f x = clamp_lanes((dx * hit->range + frame->cx) * frame->scale);
    const lanes_f y = clamp_lanes((dy * hit->range + frame->cy) * frame->scale);
    const lanes_f z = clamp_lanes((dz * hit->range + frame->cz) * frame->scale);
    const lanes_f sum = x * x + y * y + z * z, w = 2.0f - hit->cos_incidence;
    const lanes_f square = LEAST(sum, GREATEST_SQUARE);
    const lanes_f metres = (hit->range + 12582912.0f) - 12582912.0f;
    lanes_i *whole = sums->whole;
    whole[0] += nearest(x * UNIT) & mine;
    whole[1] += nearest(y * UNIT) & mine;
    whole[2] += nearest(z * UNIT) & mine;
    whole[3] += nearest(square * UNIT) & mine;
    whole[4] += nearest(w * UNIT) & mine;
    whole[5] += nearest(w * x * UNIT) & mine;
    whole[6] += nearest(w * y * UNIT) & mine;
    whole[7] += nearest(w * z * UNIT) & mine;
    whole[8] += nearest(w * square * UNIT) & mine;
    whole[9] += nearest(metres) & mine;
    whole[10] += nearest((hit->range - metres) * UNIT) & mine;
    const lanes_f near = PICK(mine, hit->range, (lanes_f)(INFINITY));
    const lanes_f steep = PICK(mine, hit->cos_incidence, (lanes_f)(0.0f));
    sums->least = LEAST(near, sums->least);
    sums->greatest = MOST(steep, sums->greatest);
}

static inline void clear_sums(Sums *sums)
{
    for (int k = 0; k < WHOLES; ++k) sums->whole[k] = 0;
    sums->least = INFINITY;
    sums->greatest = 0.0f;
}

/* Begin a record and its sums. */
static inline void start_sums(Sums *from, global long *sums, global float *extremes)
{
    clear_sums(from);
    for (int k = 0; k < SUMS; ++k) sums[k] = 0;
    extremes[0] = INFINITY, extremes[1] = 0.0f;
}

/* Add the sums to their record and begin anew. */
static inline void spill_sums(Sums *from, global long *sums, global float *extremes)
{
    long total[WHOLES];
    for (int k = 0; k < WHOLES; ++k) {
        const int *each = (const int *)&from->whole[k];
        total[k] = 0;
        for (int lane = 0; lane < LANES; ++lane) total[k] += each[lane];
    }
    total[SUMS - 1] = (total[SUMS - 1] << 20) + total[SUMS];
    for (int k = 0; k < SUMS; ++k) sums[k] += total[k];
    const float *ranges = (const float *)&from->least, *cosines = (const float *)&from->greatest;
    float least = extremes[0], greatest = extremes[1];
    for (int lane = 0; lane < LANES; ++lane) {
        least = LEAST(ranges[lane], least);
        greatest = MOST(cosines[lane], greatest);
    }
    extremes[0] = least, extremes[1] = greatest;
    clear_sums(from);
}

#define MOMENT_ARGUMENTS , global int *power, global long *sums, global float *extremes
#else
#define MOMENT_ARGUMENTS
#endif

/* Sum the returns of every tile of every position by patch.
 * One work-item is one tile of one position. NDRange (tiles, positions), any local size.
 * Writes the first n_listed (S, tiles) records of every tile, in the order of their first hits: layout above. Beams that
 * only pad a tile count for nothing. Deterministic: no work-item reads what another one writes. */
kernel void sum_returns(TREE_ARGUMENTS, GRID_ARGUMENTS, global int *list, global int *n_listed,
                        global int *n_returns MOMENT_ARGUMENTS)
{
    const int tile = get_global_id(0), position = get_global_id(1);
    const float ox = positions[3 * position], oy = positions[3 * position + 1], oz = positions[3 * position + 2];
    global const float *own = beams + (size_t)tile * (PACKETS * 3 * LANES);
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, range_max);
    const size_t at = (size_t)position * get_global_size(0) + tile;
    const size_t stride = get_global_size(0) * get_global_size(1);
    global int *patches = list + at, *counts = n_returns + at;
    Table table;
    table.size = 0;
    for (int place = 0; place < PLACES; ++place) table.record[place] = -1;
#if MOMENTS
    Sums records[LIST];
    global long *own_sums = sums + at * SUMS;
    global float *own_extremes = extremes + at * 2;
#endif
    Hit hits[TOGETHER];
    for (int p = 0; p < PACKETS; ++p) {
        if (p % TOGETHER == 0)
            resolve_packets(hits, &returns, p, own, geometry, slot, edges, address, 0, ox, oy, oz, range_min, range_max);
        const Hit hit = hits[p % TOGETHER];
        const Place place = place_of(places, (size_t)tile * PACKETS + p);
        global const float *d = own + p * (3 * LANES);
        const lanes_f dx = LANES_LOAD(d), dy = LANES_LOAD(d + LANES), dz = LANES_LOAD(d + 2 * LANES);
        const lanes_i real = real_lanes(place);
        /* Neighbouring beams mostly share a patch: one pass a distinct patch, as in `resolve`. */
        int todo[LANES], triangle[LANES];
        store_lanes(hit.patch, todo);
        store_lanes(hit.triangle, triangle);
        for (int lane = place.begin; lane < place.end; ++lane) {
            const int one = todo[lane];
            if (one < 0) continue;
            const int known = table.size, record = find_record(&table, patches, stride, one);
            if (record == known) {
                counts[stride * record] = 0;
#if MOMENTS
                const int of = triangle[lane];
                int exponent;
                start_sums(&records[record], own_sums + stride * record * SUMS, own_extremes + stride * record * 2);
                records[record].frame = frame_of(geometry, slot, edges, of, one - address[2 * of], address[2 * of + 1],
                                                 ox, oy, oz, &exponent);
                power[at + stride * record] = exponent;
#endif
            }
            const lanes_i mine = MASK(hit.patch == one) & real;
            for (int next = lane; next < LANES; ++next)
                if (todo[next] == one) todo[next] = -1;
            counts[stride * record] += count_lanes(mine);
#if MOMENTS
            add_hits(&records[record], &hit, mine, dx, dy, dz);
#endif
        }
#if MOMENTS
        if (p + 1 == PACKETS || (p + 1) % SPILL == 0)
            for (int record = 0; record < table.size; ++record)
                spill_sums(&records[record], own_sums + stride * record * SUMS, own_extremes + stride * record * 2);
#endif
    }
    n_listed[at] = table.size;
}
