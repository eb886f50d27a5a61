/* Blocks: up to eight triangles side by side, made ready for one origin and tested against beams from it.
 *
 * Purpose    The geometry of the watertight beam-triangle test, shared by the tile and the single-ray traversal, which
 *            therefore agree to the last bit.
 * Algorithm  Edge functions relative to the origin (Pluecker form): with A, B, C the vertices minus the origin, a beam d
 *            passes edge BC on the side of d . (B x C). We take 2 (B x C) = (B + C) x (C - B), with C - B from the
 *            vertices themselves: its rounding error is that of a vector of length |edge|, not |B|, so that small far
 *            triangles stay sharp; and it is exactly negated when the edge is walked the other way.
 *
 *                     C                 N0 = (B + C) x (C - B)   faces A, its dot with d is A's weight
 *                    / \                N1 = (C + A) x (A - C)   faces B
 *                 N1/   \N0             N2 = (A + B) x (B - A)   faces C
 *                  /  d  \
 *                 A-------B             inside: d.N0, d.N1, d.N2 all >= 0 (all <= 0 from behind)
 *                    N2
 *
 * Watertight Exactly negated edge functions keep beams from passing through an EDGE, but round a VERTEX the signs of all its
 *            edges can come out the same, and a beam slip through (measured: 1 in 60 of beams aimed at vertices). So
 *            a value counts as inside down to minus the bound of its rounding: a beam that meets a triangle in exact
 *            arithmetic is never refused. The price: triangles are larger by about 2e-6 rad, 10 micrometres at 5 m;
 *            by more where the line of an edge passes near the origin and another vertex lies far away: as their
 *            distances, 2e-4 rad round a lawn of 300 m under a station of 2 m.
 *            A beam that runs along this margin must not see a face that lies hidden round an edge, so that such a
 *            hit counts as farther by 1 - BESIDE: any true hit at the same place comes first, and where there is none
 *            the range is 1e-5 of its value too long, 50 micrometres at 5 m, and the hit is
 *            on no patch: at the rim of a table its underside is as near as its side.
 *
 * Range      The plane is n . x = K, n the unit normal and K = n . A, so 1 / t = d . (n / K) = d . m.
 *            We compare 1 / t: no division a beam. Relative error of t: a few ulp / cos(incidence).
 *
 * Layout     block b, lane j: geometry[(b * 12 + k) * 8 + j], k = v0x v0y v0z v1x v1y v1z v2x v2y v2z nx ny nz,
 *            metres, local frame; triangle[b * 8 + j], -1 in an empty lane.
 */
#ifndef TLSPLAN_BLOCK_H
#define TLSPLAN_BLOCK_H
#include "lanes.h"

/* More than the rounding of 1 / t at all but grazing incidence, less than a scanner can tell. */
#define BESIDE 0.99999f
/* Added to the number of a triangle that was hit in its margin; no scene has 2^30 triangles. */
#define BESIDE_BIT 0x40000000

#define BLOCK_LANES 8
#define BLOCK_FLOATS 12

/* Bound of the rounding of d . N, as a share of r * e, r the distance of the farthest vertex and e the edge's length.
 * In units of 2^-24 r e: vertices minus origin and their sum 4, difference 2, cross product 8, dot product 6; 20 in all
 * are 1.2e-6. r and e are taken by `length_bound`, which is never too small. */
#define EDGE_ROUNDING 1.25e-6f

/* A computed hit lies within about 2e-6 of its distance from the triangle: twice that. */
#define NEEDLE_PAD 4e-6f

/* Rounding of the distance of the origin from a plane, as a share of the distance of the plane's triangle. */
#define PLANE_ROUNDING 2e-7f

typedef struct {
    float8 n0x, n0y, n0z, n1x, n1y, n1z, n2x, n2y, n2z; /* edge normals, turned so that inside is positive if clear */
    float8 mx, my, mz;                                  /* n / K: 1 / t = d . m */
    float8 rounding0, rounding1, rounding2;             /* bounds of the rounding of d . N: inside is >= -rounding */
    int8 clear;                                         /* -1: seen well enough from the front for the fast test */
    int8 behind;                                        /* sign bit set where the origin is behind: see TURN */
} Block;

/* (greatest + sum) / 2 of the magnitudes: between |v| and 1.23 |v|, and no root. */
static inline float8 length_bound(float8 x, float8 y, float8 z)
{
    const float8 mx = MAGNITUDE8(x), my = MAGNITUDE8(y), mz = MAGNITUDE8(z);
    const float8 mxy = MOST(mx, my);
    return 0.5f * (MOST(mxy, mz) + (mx + my + mz));
}

/* Step 1 of the test, once an origin and block: vertices minus the origin, edge normals, lengths of the edges. */
typedef struct {
    float8 ax, ay, az, bx, by, bz, cx, cy, cz;
    float8 n0x, n0y, n0z, n1x, n1y, n1z, n2x, n2y, n2z; /* for a triangle seen from the front */
    float8 length0, length1, length2;                   /* not less than the edges' */
} Edges;

static inline Edges prepare_edges(global const float *geometry, int block, float ox, float oy, float oz)
{
    global const float *g = geometry + (size_t)block * (BLOCK_FLOATS * BLOCK_LANES);
    const float8 v0x = LOAD8(g), v0y = LOAD8(g + 1 * 8), v0z = LOAD8(g + 2 * 8);
    const float8 v1x = LOAD8(g + 3 * 8), v1y = LOAD8(g + 4 * 8), v1z = LOAD8(g + 5 * 8);
    const float8 v2x = LOAD8(g + 6 * 8), v2y = LOAD8(g + 7 * 8), v2z = LOAD8(g + 8 * 8);
    Edges out;
    out.ax = v0x - ox, out.ay = v0y - oy, out.az = v0z - oz;
    out.bx = v1x - ox, out.by = v1y - oy, out.bz = v1z - oz;
    out.cx = v2x - ox, out.cy = v2y - oy, out.cz = v2z - oz;
    const float8 fx = v2x - v1x, fy = v2y - v1y, fz = v2z - v1z; /* C - B */
    const float8 gx = v0x - v2x, gy = v0y - v2y, gz = v0z - v2z; /* A - C */
    const float8 hx = v1x - v0x, hy = v1y - v0y, hz = v1z - v0z; /* B - A */
    const float8 px = out.bx + out.cx, py = out.by + out.cy, pz = out.bz + out.cz;
    const float8 qx = out.cx + out.ax, qy = out.cy + out.ay, qz = out.cz + out.az;
    const float8 rx = out.ax + out.bx, ry = out.ay + out.by, rz = out.az + out.bz;
    out.n0x = py * fz - pz * fy, out.n0y = pz * fx - px * fz, out.n0z = px * fy - py * fx;
    out.n1x = qy * gz - qz * gy, out.n1y = qz * gx - qx * gz, out.n1z = qx * gy - qy * gx;
    out.n2x = ry * hz - rz * hy, out.n2y = rz * hx - rx * hz, out.n2z = rx * hy - ry * hx;
    out.length0 = length_bound(fx, fy, fz);
    out.length1 = length_bound(gx, gy, gz);
    out.length2 = length_bound(hx, hy, hz);
    return out;
}

/* x where its triangle is seen from the front, -x, exactly, where from behind. */
#define TURN(x, behind) as_float8(as_int8(x) ^ (behind))

/* Step 2. A triangle is `clear` when its volume A . N0 exceeds the sum of the roundings of its edge functions, times r:
 * then a beam inside has a positive sum of them, and its plane gives a sound t. Others (edge-on, needles, no area) take
 * the two-sided test of `needle_inverse_range`. */
static inline Block finish_block(const Edges *e, global const float *geometry, int block)
{
    global const float *g = geometry + (size_t)block * (BLOCK_FLOATS * BLOCK_LANES);
    const float8 nx = LOAD8(g + 9 * 8), ny = LOAD8(g + 10 * 8), nz = LOAD8(g + 11 * 8);
    Block out;
    const float8 plane = dot3_8(nx, ny, nz, e->ax, e->ay, e->az);
    out.behind = as_int8(plane) & (int)0x80000000;
    out.n0x = TURN(e->n0x, out.behind), out.n0y = TURN(e->n0y, out.behind), out.n0z = TURN(e->n0z, out.behind);
    out.n1x = TURN(e->n1x, out.behind), out.n1y = TURN(e->n1y, out.behind), out.n1z = TURN(e->n1z, out.behind);
    out.n2x = TURN(e->n2x, out.behind), out.n2y = TURN(e->n2y, out.behind), out.n2z = TURN(e->n2z, out.behind);
    const float8 reach_a = length_bound(e->ax, e->ay, e->az), reach_b = length_bound(e->bx, e->by, e->bz);
    const float8 reach_c = length_bound(e->cx, e->cy, e->cz), reach_ab = MOST(reach_a, reach_b);
    const float8 reach = MOST(reach_ab, reach_c), unit = EDGE_ROUNDING * reach;
    out.rounding0 = unit * e->length0;
    out.rounding1 = unit * e->length1;
    out.rounding2 = unit * e->length2;
    const float8 volume = dot3_8(e->ax, e->ay, e->az, out.n0x, out.n0y, out.n0z);
    out.clear = volume > (out.rounding0 + out.rounding1 + out.rounding2) * reach;
    const float8 scale = 1.0f / plane;
    out.mx = nx * scale;
    out.my = ny * scale;
    out.mz = nz * scale;
    return out;
}

static inline Block prepare_block(global const float *geometry, int block, float ox, float oy, float oz)
{
    const Edges edges = prepare_edges(geometry, block, ox, oy, oz);
    return finish_block(&edges, geometry, block);
}

/* Range in which beams d are inside a triangle's box along one axis, narrowing [*enter, *leave]. a, b, c: the vertices
 * minus the origin along it. The pad keeps a flat box from being missed, and 0 * infinity from arising. */
static inline void clip_axis(float a, float b, float c, float pad, lanes_f d, lanes_f *enter, lanes_f *leave)
{
    const float ab_low = LEAST(a, b), ab_high = MOST(a, b);
    const float low = LEAST(ab_low, c) - pad, high = MOST(ab_high, c) + pad;
    const lanes_f to_low = low / d, to_high = high / d;
    const lanes_f first = LEAST(to_low, to_high), last = MOST(to_low, to_high);
    *enter = MOST(first, *enter);
    *leave = LEAST(last, *leave);
}

/* t of beams d with the plane of a triangle, or with the line of its longest edge where rounding may put the plane
 * farther off than the triangle is wide: a needle is hardly more than that line, and seen edge-on has no other range. The
 * weights u, v, w would not do: a needle's are rounding and no more, and put a hit anywhere between its ends. Nor do they
 * tell a beam beyond a needle's end, in the plane of needle and origin: `*past` are beams that lie farther beyond the
 * longest edge's ends than 1/100 of its length and the rounding. g: the triangle's lane. */
static inline lanes_f needle_range(global const float *g, float ox, float oy, float oz, lanes_f dx, lanes_f dy,
                                   lanes_f dz, lanes_i *past)
{
    const float ax = g[0] - ox, ay = g[8] - oy, az = g[16] - oz;
    const float fx = g[48] - g[24], fy = g[56] - g[32], fz = g[64] - g[40]; /* C - B */
    const float gx = g[0] - g[48], gy = g[8] - g[56], gz = g[16] - g[64];   /* A - C */
    const float hx = g[24] - g[0], hy = g[32] - g[8], hz = g[40] - g[16];   /* B - A */
    const float ff = dot3_1(fx, fy, fz, fx, fy, fz), gg = dot3_1(gx, gy, gz, gx, gy, gz);
    const float hh = dot3_1(hx, hy, hz, hx, hy, hz), most = MOST(ff, gg), longest = MOST(most, hh);
    /* 1: the plane; off by PLANE_ROUNDING reach / |d . n| */
    const float nx = g[72], ny = g[80], nz = g[88];
    const lanes_f dn = dot3_lanes(dx, dy, dz, nx, ny, nz);
    const lanes_f to_plane = dot3_1(nx, ny, nz, ax, ay, az) / dn;
    /* 2: the line q + k e, q its nearest point to the origin: q . e = 0. Where it is nearest to t d,
     * (t d - q - k e) . d = (t d - q - k e) . e = 0. */
    const bool is_h = hh == longest, is_g = gg == longest;
    const float ex = is_h ? hx : is_g ? gx : fx, ey = is_h ? hy : is_g ? gy : fy, ez = is_h ? hz : is_g ? gz : fz;
    const int start = is_h ? 0 : is_g ? 48 : 24; /* the vertex that e begins in */
    const float sx = g[start] - ox, sy = g[start + 8] - oy, sz = g[start + 16] - oz;
    const float along = dot3_1(sx, sy, sz, ex, ey, ez) / longest;
    const lanes_f dq = dot3_lanes(dx, dy, dz, sx - along * ex, sy - along * ey, sz - along * ez);
    const lanes_f de = dot3_lanes(dx, dy, dz, ex, ey, ez);
    const lanes_f sine2 = (longest - de * de) / longest;
    const lanes_f to_line = dq / sine2;
    /* 3: the width is that of the area by the longest edge */
    const float wx = gy * hz - gz * hy, wy = gz * hx - gx * hz, wz = gx * hy - gy * hx;
    const float width2 = dot3_1(wx, wy, wz, wx, wy, wz) / longest;
    const float off2 = PLANE_ROUNDING * PLANE_ROUNDING * (dot3_1(ax, ay, az, ax, ay, az) + longest);
    const lanes_i flat = MASK(dn * dn * width2 > off2);
    const lanes_f range = PICK(flat, to_plane, to_line);
    /* 4: x, place along the edge, from its middle to longest / 2. NaN, of a beam along it, compares false: not past it. */
    const lanes_f x = range * de - (along + 0.5f) * longest, slope2 = PICK(flat, dn * dn, sine2 * sine2);
    const lanes_f beyond = PICK(MASK(x < 0.0f), -x, x) - 0.51f * longest;
    const lanes_f slack2 = PICK(flat, (lanes_f)(off2), off2 + width2 * sine2); /* the line may be the far side */
    *past = MASK(beyond > 0.0f) & MASK(beyond * beyond * slope2 > 16.0f * slack2 * longest);
    return range;
}

/* Range of whatever the origin itself lies on, metres. */
#define ON_SURFACE 1e-6f

/* Whether the origin lies on a triangle, to rounding. Then it blocks every beam, as in Embree: a scanner in a wall's face
 * sees nothing, and no candidate stands there. */
static inline bool holds_origin(global const float *g, float ox, float oy, float oz)
{
    const float ax = g[0] - ox, ay = g[8] - oy, az = g[16] - oz;
    const float bx = g[24] - ox, by = g[32] - oy, bz = g[40] - oz;
    const float cx = g[48] - ox, cy = g[56] - oy, cz = g[64] - oz;
    const float nx = g[72], ny = g[80], nz = g[88];
    const float size_a = MAGNITUDE(ax) + MAGNITUDE(ay) + MAGNITUDE(az);
    const float size_b = MAGNITUDE(bx) + MAGNITUDE(by) + MAGNITUDE(bz);
    const float size_c = MAGNITUDE(cx) + MAGNITUDE(cy) + MAGNITUDE(cz);
    const float size_ab = MOST(size_a, size_b), size = MOST(size_ab, size_c);
    const float off = dot3_1(nx, ny, nz, ax, ay, az);
    if (MAGNITUDE(off) > PLANE_ROUNDING * size) return false;
    /* twice the areas that the origin parts the triangle into; a triangle without area has no normal and no answer */
    const float of_a = dot3_1(nx, ny, nz, by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx);
    const float of_b = dot3_1(nx, ny, nz, cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax);
    const float of_c = dot3_1(nx, ny, nz, ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx);
    const float least = -PLANE_ROUNDING * size * size;
    return nx * nx + ny * ny + nz * nz > 0.5f && of_a >= least && of_b >= least && of_c >= least;
}

/* 1 / t of beams d with a triangle that is not clear; 0 where they miss. u, v, w are the edge functions, `rounding` their
 * bounds. Hit from both sides, if the beam meets the triangle's box too: edge-on, u, v and w vanish in its whole plane.
 * t is kept inside the box. Wrong case: a beam within some 1e-6 rad of the plane of a triangle seen edge-on may be
 * stopped by the box where it passes the triangle. */
static inline lanes_f needle_inverse_range(global const float *geometry, int block, int lane, float ox, float oy,
                                           float oz, lanes_f dx, lanes_f dy, lanes_f dz, lanes_f u, lanes_f v,
                                           lanes_f w, float rounding_u, float rounding_v, float rounding_w)
{
    global const float *g = geometry + (size_t)block * (BLOCK_FLOATS * BLOCK_LANES) + lane;
    if (holds_origin(g, ox, oy, oz)) return (lanes_f)(1.0f / ON_SURFACE);
    const float ax = g[0] - ox, ay = g[8] - oy, az = g[16] - oz;
    const float bx = g[24] - ox, by = g[32] - oy, bz = g[40] - oz;
    const float cx = g[48] - ox, cy = g[56] - oy, cz = g[64] - oz;
    const lanes_i front = MASK(u >= -rounding_u) & MASK(v >= -rounding_v) & MASK(w >= -rounding_w);
    const lanes_i back = MASK(u <= rounding_u) & MASK(v <= rounding_v) & MASK(w <= rounding_w);
    /* The box, larger by what a beam may be off at that distance */
    const float size_a = MAGNITUDE(ax) + MAGNITUDE(ay) + MAGNITUDE(az);
    const float size_b = MAGNITUDE(bx) + MAGNITUDE(by) + MAGNITUDE(bz);
    const float size_c = MAGNITUDE(cx) + MAGNITUDE(cy) + MAGNITUDE(cz);
    const float size_ab = MOST(size_a, size_b), pad = NEEDLE_PAD * MOST(size_ab, size_c);
    lanes_f enter = 0.0f, leave = 1e30f;
    clip_axis(ax, bx, cx, pad, dx, &enter, &leave);
    clip_axis(ay, by, cy, pad, dy, &enter, &leave);
    clip_axis(az, bz, cz, pad, dz, &enter, &leave);
    lanes_i past;
    const lanes_f own = needle_range(g, ox, oy, oz, dx, dy, dz, &past);
    const lanes_f not_before = MOST(own, enter), range = LEAST(not_before, leave);
    /* An origin within the pad of the triangle has no range. NaN, of a beam along a needle: where it enters the box. */
    const lanes_i hit = (front | back) & ~past & MASK(enter <= leave) & MASK(range > 0.0f);
    return PICK(hit, 1.0f / range, (lanes_f)(0.0f));
}

#endif
