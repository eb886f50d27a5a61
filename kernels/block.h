/* Blocks: up to eight triangles side by side, made ready for one origin and tested against beams from it.
 *
 * Purpose    The geometry of the watertight beam-triangle test, shared by the tile and the single-ray traversal, which
 *            therefore agree to the last bit.
 * Algorithm  Edge functions relative to the origin (Pluecker form): with A, B, C the vertices minus the origin, a beam d
 *            passes edge BC on the side of d . (B x C). We take 2 (B x C) = (B + C) x (C - B): exactly negated when the
 *            edge is walked the other way (sum symmetric, difference antisymmetric, no contraction), and its
 *            rounding error is that of a vector of length |edge|, not |B|, so that small far triangles stay sharp.
 *
 *                     C                 N0 = (B + C) x (C - B)   faces A, its dot with d is A's weight
 *                    / \                N1 = (C + A) x (A - C)   faces B
 *                 N1/   \N0             N2 = (A + B) x (B - A)   faces C
 *                  /  d  \
 *                 A-------B             inside: d.N0, d.N1, d.N2 all >= 0 (all <= 0 from behind)
 *                    N2
 *
 *            Range: the plane is n . x = K, n the unit normal and K = n . A, so 1 / t = d . (n / K) = d . m.
 *            We compare 1 / t: no division a beam. Relative error of t: a few ulp / cos(incidence).
 *
 * Layout     block b, lane j: geometry[(b * 12 + k) * 8 + j], k = v0x v0y v0z v1x v1y v1z v2x v2y v2z nx ny nz,
 *            metres, local frame; triangle[b * 8 + j], -1 in an empty lane.
 */
#ifndef TLSPLAN_BLOCK_H
#define TLSPLAN_BLOCK_H
#include "lanes.h"

#define BLOCK_LANES 8
#define BLOCK_FLOATS 12

/* Rounding of an edge function d . N is below 8 ulp of r * e, r the distance of the farthest vertex and e the longest
 * edge (2 roundings a component of the sum and the difference, 2 of the cross product, 3 of the dot; |N| <= 2 r e):
 * 8 * 2 * 6e-8 = 1e-6. Twice that, so that a sign beyond the bound is the true sign. */
#define EDGE_ROUNDING 2e-6f

typedef struct {
    float8 n0x, n0y, n0z, n1x, n1y, n1z, n2x, n2y, n2z; /* edge normals, turned so that inside is >= 0 if clear */
    float8 mx, my, mz;                                  /* n / K: 1 / t = d . m */
    float8 rounding;                                    /* bound of the rounding of d . N for |d| = 1 */
    int8 clear;                                         /* -1: seen well enough from the front for the fast test */
} Block;

/* Step 1 of the test, once an origin and block. A triangle is `clear` when its volume A . N0 exceeds three times the
 * rounding of the edge functions, times r: then no beam can find all three signs turned round, and inside is >= 0.
 * Others (edge-on, needles, no area) take the two-sided test of `needle_inverse_range`. */
static inline Block prepare_block(global const float *geometry, int block, float ox, float oy, float oz)
{
    global const float *g = geometry + (size_t)block * (BLOCK_FLOATS * BLOCK_LANES);
    const float8 v0x = LOAD8(g), v0y = LOAD8(g + 1 * 8), v0z = LOAD8(g + 2 * 8);
    const float8 v1x = LOAD8(g + 3 * 8), v1y = LOAD8(g + 4 * 8), v1z = LOAD8(g + 5 * 8);
    const float8 v2x = LOAD8(g + 6 * 8), v2y = LOAD8(g + 7 * 8), v2z = LOAD8(g + 8 * 8);
    const float8 nx = LOAD8(g + 9 * 8), ny = LOAD8(g + 10 * 8), nz = LOAD8(g + 11 * 8);
    const float8 ax = v0x - ox, ay = v0y - oy, az = v0z - oz;
    const float8 bx = v1x - ox, by = v1y - oy, bz = v1z - oz;
    const float8 cx = v2x - ox, cy = v2y - oy, cz = v2z - oz;
    const float8 fx = v2x - v1x, fy = v2y - v1y, fz = v2z - v1z; /* C - B */
    const float8 gx = v0x - v2x, gy = v0y - v2y, gz = v0z - v2z; /* A - C */
    const float8 hx = v1x - v0x, hy = v1y - v0y, hz = v1z - v0z; /* B - A */
    const float8 px = bx + cx, py = by + cy, pz = bz + cz;
    const float8 qx = cx + ax, qy = cy + ay, qz = cz + az;
    const float8 rx = ax + bx, ry = ay + by, rz = az + bz;
    Block out;
    const float8 plane = dot3_8(nx, ny, nz, ax, ay, az);
    /* Turned round, exactly, where the origin is behind: its sign bit flips the edge normals'. */
    const int8 behind = as_int8(plane) & (int)0x80000000;
#define TURN(x) as_float8(as_int8(x) ^ behind)
    out.n0x = TURN(py * fz - pz * fy);
    out.n0y = TURN(pz * fx - px * fz);
    out.n0z = TURN(px * fy - py * fx);
    out.n1x = TURN(qy * gz - qz * gy);
    out.n1y = TURN(qz * gx - qx * gz);
    out.n1z = TURN(qx * gy - qy * gx);
    out.n2x = TURN(ry * hz - rz * hy);
    out.n2y = TURN(rz * hx - rx * hz);
    out.n2z = TURN(rx * hy - ry * hx);
#undef TURN
    /* |x| + |y| + |z| bounds a length from above without a root, by a factor of 1.73 at most. */
#define LENGTH(x, y, z) (MAGNITUDE8(x) + MAGNITUDE8(y) + MAGNITUDE8(z))
    const float8 reach_ab = MOST(LENGTH(ax, ay, az), LENGTH(bx, by, bz)), reach_c = LENGTH(cx, cy, cz);
    const float8 edge_ab = MOST(LENGTH(fx, fy, fz), LENGTH(gx, gy, gz)), edge_c = LENGTH(hx, hy, hz);
#undef LENGTH
    const float8 reach = MOST(reach_ab, reach_c);
    out.rounding = EDGE_ROUNDING * reach * MOST(edge_ab, edge_c);
    const float8 volume = dot3_8(ax, ay, az, out.n0x, out.n0y, out.n0z);
    out.clear = volume > 3.0f * out.rounding * reach;
    const float8 scale = 1.0f / plane;
    out.mx = nx * scale;
    out.my = ny * scale;
    out.mz = nz * scale;
    return out;
}

/* One vertex of lane `lane`, minus the origin, along d. */
static inline lanes_f along(global const float *g, int vertex, int lane, float ox, float oy, float oz, lanes_f dx,
                            lanes_f dy, lanes_f dz)
{
    const float x = g[(3 * vertex + 0) * BLOCK_LANES + lane] - ox;
    const float y = g[(3 * vertex + 1) * BLOCK_LANES + lane] - oy;
    const float z = g[(3 * vertex + 2) * BLOCK_LANES + lane] - oz;
    return dot3_lanes(dx, dy, dz, x, y, z);
}

/* 1 / t of beams d with a triangle that is not clear; 0 where they miss. Weights u, v, w are the edge functions. Hit from
 * both sides; t is the weighted mean of the vertices' distances along d, which stays between them however thin the
 * triangle is. No area at all (u = v = w = 0): a miss; the neighbours that share its edges are hit instead. */
static inline lanes_f needle_inverse_range(global const float *geometry, int block, int lane, float ox, float oy,
                                           float oz, lanes_f dx, lanes_f dy, lanes_f dz, lanes_f u, lanes_f v,
                                           lanes_f w)
{
    global const float *g = geometry + (size_t)block * (BLOCK_FLOATS * BLOCK_LANES);
    const lanes_f depth = u * along(g, 0, lane, ox, oy, oz, dx, dy, dz) + v * along(g, 1, lane, ox, oy, oz, dx, dy, dz) +
                          w * along(g, 2, lane, ox, oy, oz, dx, dy, dz);
    const lanes_f inverse = ((u + v) + w) / depth;
    const lanes_i inside = (MASK(u >= 0.0f) & MASK(v >= 0.0f) & MASK(w >= 0.0f)) |
                           (MASK(u <= 0.0f) & MASK(v <= 0.0f) & MASK(w <= 0.0f));
    /* 1e30: an origin ON the triangle has depth 0 and no range. NaN compares false. */
    const lanes_i ahead = MASK(inverse > 0.0f) & MASK(inverse < 1e30f);
    return PICK(inside & ahead, inverse, (lanes_f)(0.0f));
}

#endif
