/* Hits: from (1 / t, triangle) of a packet to range, incidence and patch.
 *
 * Layout     slot[t]: where triangle t lies, block * 8 + lane. edges[3 t + 0, 1, 2]: squared edges 01, 12, 20, m^2.
 *            address[2 t]: first patch, -1 where the surface gives no return (a mirror); address[2 t + 1]: depth.
 *            Geometry: see block.h.
 */
#ifndef TLSPLAN_HIT_H
#define TLSPLAN_HIT_H
#include "block.h"
#include "patch.h"

typedef struct {
    lanes_f range;         /* metres; NaN on a miss */
    lanes_f cos_incidence; /* |n . d|; NaN on a miss */
    lanes_i triangle;      /* -1 on a miss */
    lanes_i patch;         /* -1 on a miss and for a hit in the margin of its triangle, see block.h */
} Hit;

/* Patch and cosine of the lanes that hit `triangle`, other lanes get values of no meaning. Weights come from the hit
 * point relative to vertex 0, whose error is some ulp of t: exacter than from the edge functions of a far triangle. */
static inline void resolve_triangle(global const float *geometry, global const int *slot, global const float *edges,
                                    global const int *address, int triangle, float ox, float oy, float oz, lanes_f dx,
                                    lanes_f dy, lanes_f dz, lanes_f range, lanes_i *patch, lanes_f *cosine)
{
    const int s = slot[triangle];
    global const float *g = geometry + (size_t)(s / BLOCK_LANES) * (BLOCK_FLOATS * BLOCK_LANES) + s % BLOCK_LANES;
#define AT(k) g[(k) * BLOCK_LANES]
    const float nx = AT(9), ny = AT(10), nz = AT(11);
    const lanes_f along_normal = dot3_lanes(dx, dy, dz, nx, ny, nz);
    const lanes_f magnitude = PICK(MASK(along_normal < 0.0f), -along_normal, along_normal);
    *cosine = LEAST(magnitude, 1.0f);
    const int depth = address[2 * triangle + 1];
    if (depth == 0) {
        *patch = address[2 * triangle];
        return;
    }
    const float ex = AT(3) - AT(0), ey = AT(4) - AT(1), ez = AT(5) - AT(2);
    const float fx = AT(6) - AT(0), fy = AT(7) - AT(1), fz = AT(8) - AT(2);
    /* l1 = n . (p x f) / n . (e x f) = p . (f x n) / ..., l2 = n . (e x p) / ... = p . (n x e) / ... */
    const float ux = fy * nz - fz * ny, uy = fz * nx - fx * nz, uz = fx * ny - fy * nx;
    const float vx = ny * ez - nz * ey, vy = nz * ex - nx * ez, vz = nx * ey - ny * ex;
    const float scale = 1.0f / dot3_1(ex, ey, ez, ux, uy, uz);
    const lanes_f px = dx * range + (ox - AT(0)), py = dy * range + (oy - AT(1)), pz = dz * range + (oz - AT(2));
#undef AT
    const lanes_f l1 = dot3_lanes(px, py, pz, ux, uy, uz) * scale;
    const lanes_f l2 = dot3_lanes(px, py, pz, vx, vy, vz) * scale;
    *patch = address[2 * triangle] + patch_code(1.0f - l1 - l2, l1, l2, edges[3 * triangle], edges[3 * triangle + 1],
                                                edges[3 * triangle + 2], depth);
}

/* All lanes of a packet. A surface nearer than range_min has blocked the beam: no return. Both limits are returns. */
static inline Hit resolve(global const float *geometry, global const int *slot, global const float *edges,
                          global const int *address, float ox, float oy, float oz, lanes_f dx, lanes_f dy, lanes_f dz,
                          lanes_f inverse, lanes_i triangle, float range_min, float range_max)
{
    const lanes_f range = 1.0f / inverse;
    const lanes_i hit = MASK(triangle >= 0) & MASK(range >= range_min) & MASK(range <= range_max);
    Hit out;
    out.range = PICK(hit, range, (lanes_f)(NAN));
    const lanes_i beside = hit & MASK((triangle & BESIDE_BIT) != 0);
    out.triangle = PICK(hit, triangle & ~BESIDE_BIT, (lanes_i)(-1));
    out.cos_incidence = NAN;
    out.patch = -1;
    /* Neighbouring beams mostly share a triangle: one pass a distinct triangle, with its lookups done once. */
    int todo[LANES];
    *(lanes_i *)todo = out.triangle;
    for (int lane = 0; lane < LANES; ++lane) {
        const int one = todo[lane];
        if (one < 0) continue;
        const lanes_i mine = MASK(out.triangle == one);
        if (address[2 * one] < 0) { /* no longer a hit, and no later triangle takes its lanes */
            out.range = PICK(mine, (lanes_f)(NAN), out.range);
            out.triangle = PICK(mine, (lanes_i)(-1), out.triangle);
        } else {
            lanes_i patch;
            lanes_f cosine;
            resolve_triangle(geometry, slot, edges, address, one, ox, oy, oz, dx, dy, dz, range, &patch, &cosine);
            out.patch = PICK(mine, patch, out.patch);
            out.cos_incidence = PICK(mine, cosine, out.cos_incidence);
        }
        for (int next = lane; next < LANES; ++next)
            if (todo[next] == one) todo[next] = -1;
    }
    out.patch = PICK(beside, (lanes_i)(-1), out.patch);
    return out;
}

#endif
