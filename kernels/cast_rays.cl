/* Free rays: first hits of rays that share nothing, a ray a work-item.
 *
 * Purpose    Checks of candidates, picks, random rays: whatever is not a grid of beams from one origin.
 * Algorithm  The tree is walked front to back; a ray meets eight boxes at a time (slabs) and eight triangles at a time.
 *            The triangle test is that of the tiles (block.h), in the same order of operations: same beam, same bits.
 *
 * Define         meaning
 * LANES          1 here: a packet is one ray
 * STACK          see tree.h
 */
#include "block.h"
#include "tree.h"

/* A component nearer to zero than this would turn 0 * infinity into NaN in the slab test. At 1e-18 a box a hundred
 * kilometres away stays finite (1e5 / 1e-18 = 1e23), and the ray is moved by less than 1e-13 m there. */
#define LEAST_COMPONENT 1e-18f

/* A hit may lie some ulp of its range outside its triangle and so outside its box; boxes grow by this share of the
 * distance to the scene's farthest point. Rounding of the test: a few 6e-8. */
#define BOX_SHARE 1e-6f

/* The same for the product of origin and inverse direction, which is rounded by itself. */
#define ORIGIN_SHARE 2e-7f

#define NEAR_SLACK 1.00001f

static inline float off_zero(float x)
{
    return x >= LEAST_COMPONENT || x <= -LEAST_COMPONENT ? x : (x < 0.0f ? -LEAST_COMPONENT : LEAST_COMPONENT);
}

/* Where a ray enters and leaves boxes along one axis: box * in - from_in, larger at both ends by the pad. */
typedef struct {
    float in, from_in, out, from_out;
} Slab;

static inline Slab slab_of(float o, float d, float pad)
{
    const float inverse = 1.0f / off_zero(d), signed_pad = d < 0.0f ? -pad : pad;
    Slab slab;
    slab.in = inverse;
    slab.from_in = (o + signed_pad) * inverse;
    slab.out = inverse * NEAR_SLACK;
    slab.from_out = (o - signed_pad) * slab.out;
    return slab;
}

static inline float8 along(float8 box, float inverse, float from)
{
    _Pragma("OPENCL FP_CONTRACT ON") return box * inverse - from;
}

/* First hits of N rays.
 * One work-item is one ray. NDRange (N rounded up to the local size). rays (N, 6): origin and UNIT direction, metres, local
 * frame. scene_sphere: centre and radius of the scene. range_out (N) metres, NaN on a miss; triangle_out (N), -1 on a miss.
 * Hits at 0 < range <= range_max. Equal ranges: the lower triangle number. Deterministic. */
kernel void cast_rays(global const float *boxes, global const int *children, global const float *geometry,
                      global const int *triangles, global const float *rays, int n_rays, float range_max,
                      float4 scene_sphere, global float *range_out, global int *triangle_out)
{
    const int ray = get_global_id(0);
    if (ray >= n_rays) return;
    const float ox = rays[6 * ray], oy = rays[6 * ray + 1], oz = rays[6 * ray + 2];
    const float dx = rays[6 * ray + 3], dy = rays[6 * ray + 4], dz = rays[6 * ray + 5];
    const float pad = BOX_SHARE * (MAGNITUDE(scene_sphere.x - ox) + MAGNITUDE(scene_sphere.y - oy) +
                                   MAGNITUDE(scene_sphere.z - oz) + scene_sphere.w) +
                      ORIGIN_SHARE * (MAGNITUDE(ox) + MAGNITUDE(oy) + MAGNITUDE(oz));
    const Slab x = slab_of(ox, dx, pad), y = slab_of(oy, dy, pad), z = slab_of(oz, dz, pad);
    const int inx = dx < 0.0f ? 24 : 0, iny = dy < 0.0f ? 32 : 8, inz = dz < 0.0f ? 40 : 16;
    const int outx = 24 - inx, outy = 40 - iny, outz = 56 - inz;

    float best = (1.0f / range_max) * 0.99999f;
    float far = NEAR_SLACK / best;
    int found = -1;
    Stack stack;
    stack.size = 0;
    int child = 0;
    for (;;) {
        if (child >= 0) {
            global const float *b = boxes + (size_t)child * (6 * NODE_CHILDREN);
            const float8 ex = along(LOAD8(b + inx), x.in, x.from_in), lx = along(LOAD8(b + outx), x.out, x.from_out);
            const float8 ey = along(LOAD8(b + iny), y.in, y.from_in), ly = along(LOAD8(b + outy), y.out, y.from_out);
            const float8 ez = along(LOAD8(b + inz), z.in, z.from_in), lz = along(LOAD8(b + outz), z.out, z.from_out);
            const float8 exy = MOST(ex, ey), ez0 = MOST(ez, 0.0f), enter = MOST(exy, ez0);
            const float8 lxy = LEAST(lx, ly), leave = LEAST(lxy, lz);
            const int8 keep = (enter <= leave) & (enter <= far);
            const int nearest = push_farther(&stack, child, keep, enter);
            if (nearest == NO_CHILD) goto next;
            child = children[child * NODE_CHILDREN + (nearest & 7)];
            continue;
        }
        {
        const int index = ~child;
        const Block block = prepare_block(geometry, index, ox, oy, oz);
        const float8 u = dot3_8(dx, dy, dz, block.n0x, block.n0y, block.n0z);
        const float8 v = dot3_8(dx, dy, dz, block.n1x, block.n1y, block.n1z);
        const float8 w = dot3_8(dx, dy, dz, block.n2x, block.n2y, block.n2z);
        const float8 plane = dot3_8(dx, dy, dz, block.mx, block.my, block.mz);
        const int8 truly = (u >= 0.0f) & (v >= 0.0f) & (w >= 0.0f);
        const float8 flat = PICK(truly, plane, plane * BESIDE);
        const int8 inside = (u >= -block.rounding0) & (v >= -block.rounding1) & (w >= -block.rounding2) & (flat >= best) & block.clear & (LOAD8I(triangles + (size_t)index * BLOCK_LANES) >= 0);
        /* the clear ones, all at once: mostly one lane, and the lowest triangle of several at one range */
        const float8 hits = PICK(inside, flat, (float8)(0.0f));
        const float4 most4 = MOST(hits.lo, hits.hi);
        const float2 most2 = MOST(most4.lo, most4.hi);
        const float nearest = MOST(most2.x, most2.y);
        if (nearest >= best) {
            for (int lanes = bits8(hits == nearest); lanes; lanes &= lanes - 1) {
                const int triangle = triangles[index * BLOCK_LANES + lowest_bit(lanes)];
                const bool first = nearest > best || triangle < found;
                found = first ? triangle : found;
                best = nearest, far = NEAR_SLACK / best;
            }
        }
        if (any8(~block.clear)) {
            const float *us = (const float *)&u, *vs = (const float *)&v, *ws = (const float *)&w;
            const float *roundings = (const float *)&block.rounding0;
            const int *clear = (const int *)&block.clear;
            for (int j = 0; j < BLOCK_LANES; ++j) {
                const int triangle = triangles[index * BLOCK_LANES + j];
                if (clear[j] || triangle < 0) continue;
                const float inverse = needle_inverse_range(geometry, index, j, ox, oy, oz, dx, dy, dz, us[j], vs[j],
                                                           ws[j], roundings[j], roundings[8 + j], roundings[16 + j]);
                if (inverse > best || (inverse == best && triangle < found)) {
                    best = inverse, far = NEAR_SLACK / best;
                    found = triangle;
                }
            }
        }
        }
    next:
        for (;;) {
            if (stack.size == 0) goto done;
            const int at = --stack.size, key = stack.key[at];
            if (key > as_int(far)) continue;
            child = children[stack.from[at] * NODE_CHILDREN + (key & 7)];
            break;
        }
    }
done:;
    const float range = 1.0f / best;
    const bool hit = found >= 0 && range <= range_max;
    range_out[ray] = hit ? range : NAN;
    triangle_out[ray] = hit ? found : -1;
}
