/* Hits: from (1 / t, triangle) of a packet to range, incidence and patch.
 *
 * Layout     slot[t]: where triangle t lies, block * 8 + lane. edges[3 t + 0, 1, 2]: squared edges 01, 12, 20, m^2.
 *            address[2 t]: first patch, -1 where the surface gives no return (a mirror); address[2 t + 1]: depth.
 *            whole[t]: number of triangle t in the whole scene, or NULL: the same. Geometry: see block.h.
 */
#ifndef TLSPLAN_HIT_H
#define TLSPLAN_HIT_H
#include "block.h"
#include "patch.h"

typedef struct {
    lanes_f range;         /* metres; NaN on a miss */
    lanes_f cos_incidence; /* |n . d|; NaN on a miss */
    lanes_i triangle;      /* -1 on a miss */
    lanes_i named;         /* the same by its number in the whole scene, glass included */
    lanes_i patch;         /* -1 on a miss and for a hit in the margin of its triangle, see block.h */
} Hit;

/* The beams of one packet, and their first hits: 1 / range, and triangle with BESIDE_BIT or -1. */
typedef struct {
    lanes_f dx, dy, dz, inverse;
    lanes_i triangle;
} Beams;

/* A triangle's own numbers: see block.h. */
static inline global const float *lane_of(global const float *geometry, global const int *slot, int triangle)
{
    const int s = slot[triangle];
    return geometry + (size_t)(s / BLOCK_LANES) * (BLOCK_FLOATS * BLOCK_LANES) + s % BLOCK_LANES;
}

/* What turns hits on one triangle into weights of its vertices. They come from the hit point relative to vertex 0, whose error
 * is some ulp of t: exacter than from the edge functions of a far triangle. */
typedef struct {
    float ax, ay, az, ux, uy, uz, vx, vy, vz, scale;
} Weights;

static inline Weights weights_of(global const float *g, float ox, float oy, float oz)
{
#define AT(k) g[(k) * BLOCK_LANES]
    const float nx = AT(9), ny = AT(10), nz = AT(11);
    const float ex = AT(3) - AT(0), ey = AT(4) - AT(1), ez = AT(5) - AT(2);
    const float fx = AT(6) - AT(0), fy = AT(7) - AT(1), fz = AT(8) - AT(2);
    /* l1 = n . (p x f) / n . (e x f) = p . (f x n) / ..., l2 = n . (e x p) / ... = p . (n x e) / ... */
    Weights out;
    out.ux = fy * nz - fz * ny, out.uy = fz * nx - fx * nz, out.uz = fx * ny - fy * nx;
    out.vx = ny * ez - nz * ey, out.vy = nz * ex - nx * ez, out.vz = nx * ey - ny * ex;
    out.scale = 1.0f / dot3_1(ex, ey, ez, out.ux, out.uy, out.uz);
    out.ax = ox - AT(0), out.ay = oy - AT(1), out.az = oz - AT(2);
#undef AT
    return out;
}

static inline void weigh_hits(const Weights *w, lanes_f dx, lanes_f dy, lanes_f dz, lanes_f range, lanes_f *l0, lanes_f *l1,
                              lanes_f *l2)
{
    const lanes_f px = dx * range + w->ax, py = dy * range + w->ay, pz = dz * range + w->az;
    *l1 = dot3_lanes(px, py, pz, w->ux, w->uy, w->uz) * w->scale;
    *l2 = dot3_lanes(px, py, pz, w->vx, w->vy, w->vz) * w->scale;
    *l0 = 1.0f - *l1 - *l2;
}

/* Which hits of a packet are returns. A surface nearer than range_min has blocked the beam. Both limits are
 * returns. */
static inline lanes_i returns_of(lanes_f range, lanes_i triangle, float range_min, float range_max)
{
    return MASK(triangle >= 0) & MASK(range >= range_min) & MASK(range <= range_max);
}

/* Patches and cosines of the lanes that hit `triangle`, other lanes get values of no meaning. */
static inline void resolve_triangle(const Beams *beams, const Hit *hits, global const float *geometry,
                                    global const int *slot, global const float *edges, int triangle, int first_patch,
                                    int depth, float ox, float oy, float oz, lanes_i *patch, lanes_f *cosine)
{
    global const float *g = lane_of(geometry, slot, triangle);
#define AT(k) g[(k) * BLOCK_LANES]
    const float nx = AT(9), ny = AT(10), nz = AT(11);
    EACH_PACKET(k) {
        const lanes_f along_normal = dot3_lanes(beams[k].dx, beams[k].dy, beams[k].dz, nx, ny, nz);
        const lanes_f magnitude = PICK(MASK(along_normal < 0.0f), -along_normal, along_normal);
        cosine[k] = LEAST(magnitude, 1.0f);
    }
    if (depth == 0) {
        EACH_PACKET(k) patch[k] = first_patch;
        return;
    }
#undef AT
    const Weights weights = weights_of(g, ox, oy, oz);
    Bisection of_packet[TOGETHER];
    EACH_PACKET(k) {
        weigh_hits(&weights, beams[k].dx, beams[k].dy, beams[k].dz, hits[k].range, &of_packet[k].l0, &of_packet[k].l1,
                   &of_packet[k].l2);
        of_packet[k].q01 = edges[3 * triangle], of_packet[k].q12 = edges[3 * triangle + 1];
        of_packet[k].q20 = edges[3 * triangle + 2], of_packet[k].code = 0;
    }
    patch_codes(of_packet, depth);
    EACH_PACKET(k) patch[k] = first_patch + of_packet[k].code;
}

/* All lanes of TOGETHER packets. */
static inline void resolve(Hit *hits, const Beams *beams, global const float *geometry, global const int *slot,
                           global const float *edges, global const int *address, global const int *whole, float ox, float oy,
                           float oz, float range_min, float range_max)
{
    lanes_i beside[TOGETHER];
    lanes_i todo[TOGETHER];
    EACH_PACKET(k) {
        const lanes_f range = 1.0f / beams[k].inverse;
        const lanes_i triangle = beams[k].triangle;
        const lanes_i hit = returns_of(range, triangle, range_min, range_max);
        hits[k].range = PICK(hit, range, (lanes_f)(NAN));
        beside[k] = hit & MASK((triangle & BESIDE_BIT) != 0);
        hits[k].triangle = PICK(hit, triangle & ~BESIDE_BIT, (lanes_i)(-1));
        hits[k].cos_incidence = NAN;
        hits[k].patch = -1;
        hits[k].named = -1;
        todo[k] = hits[k].triangle;
    }
    /* Neighbouring beams mostly share a triangle: one pass a distinct triangle, with its lookups done once. */
    for (;;) {
        lanes_i any = todo[0];
        for (int k = 1; k < TOGETHER; ++k) any = MOST(any, todo[k]);
        const int one = most_lane(any);
        if (one < 0) break;
        const int first_patch = address[2 * one], depth = address[2 * one + 1];
        if (first_patch < 0) { /* no longer a hit, and no later triangle takes its lanes */
            EACH_PACKET(k) {
                const lanes_i mine = MASK(hits[k].triangle == one);
                hits[k].range = PICK(mine, (lanes_f)(NAN), hits[k].range);
                hits[k].triangle = PICK(mine, (lanes_i)(-1), hits[k].triangle);
            }
        } else {
            lanes_i patch[TOGETHER];
            lanes_f cosine[TOGETHER];
            const int name = whole ? whole[one] : one;
            resolve_triangle(beams, hits, geometry, slot, edges, one, first_patch, depth, ox, oy, oz, patch, cosine);
            EACH_PACKET(k) {
                const lanes_i mine = MASK(hits[k].triangle == one);
                hits[k].patch = PICK(mine, patch[k], hits[k].patch);
                hits[k].cos_incidence = PICK(mine, cosine[k], hits[k].cos_incidence);
                hits[k].named = PICK(mine, name, hits[k].named);
            }
        }
        EACH_PACKET(k) todo[k] = PICK(MASK(todo[k] == one), (lanes_i)(-1), todo[k]);
    }
    EACH_PACKET(k) hits[k].patch = PICK(beside[k], (lanes_i)(-1), hits[k].patch);
}

#endif
