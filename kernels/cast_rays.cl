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

#define NEAR_SLACK 1.00001f

static inline float off_zero(float x)
{
    return x >= LEAST_COMPONENT || x <= -LEAST_COMPONENT ? x : (x < 0.0f ? -LEAST_COMPONENT : LEAST_COMPONENT);
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
    const float ix = 1.0f / off_zero(dx), iy = 1.0f / off_zero(dy), iz = 1.0f / off_zero(dz);
    const float px = scene_sphere.x - ox, py = scene_sphere.y - oy, pz = scene_sphere.z - oz;
    const float pad = BOX_SHARE * (sqrt(px * px + py * py + pz * pz) + scene_sphere.w);
    /* Index of the slab that the ray enters first, by axis. */
    const int inx = dx < 0.0f ? 3 : 0, iny = dy < 0.0f ? 4 : 1, inz = dz < 0.0f ? 5 : 2;
    const int outx = 3 - inx, outy = 5 - iny, outz = 7 - inz;
    const float padx = dx < 0.0f ? -pad : pad, pady = dy < 0.0f ? -pad : pad, padz = dz < 0.0f ? -pad : pad;

    float best = (1.0f / range_max) * 0.99999f;
    int found = -1;
    Stack stack;
    stack.size = 1;
    stack.child[0] = 0;
    stack.near2[0] = 0.0f;
    while (stack.size > 0) {
        const int at = --stack.size;
        if (stack.near2[at] * best > NEAR_SLACK) continue;
        const int child = stack.child[at];
        if (child >= 0) {
            global const float *b = boxes + (size_t)child * (6 * NODE_CHILDREN);
            const float8 ex = (LOAD8(b + 8 * inx) - (ox + padx)) * ix, lx = (LOAD8(b + 8 * outx) - (ox - padx)) * ix;
            const float8 ey = (LOAD8(b + 8 * iny) - (oy + pady)) * iy, ly = (LOAD8(b + 8 * outy) - (oy - pady)) * iy;
            const float8 ez = (LOAD8(b + 8 * inz) - (oz + padz)) * iz, lz = (LOAD8(b + 8 * outz) - (oz - padz)) * iz;
            const float8 exy = MOST(ex, ey), ez0 = MOST(ez, 0.0f), enter = MOST(exy, ez0);
            const float8 lxy = LEAST(lx, ly), leave = LEAST(lxy, lz);
            const int8 keep = (enter <= leave * NEAR_SLACK) & (enter * best <= NEAR_SLACK);
            if (any8(keep)) push_children(&stack, children, child, keep, enter);
            continue;
        }
        const int index = ~child;
        const Block block = prepare_block(geometry, index, ox, oy, oz);
        const float8 u = dot3_8(dx, dy, dz, block.n0x, block.n0y, block.n0z);
        const float8 v = dot3_8(dx, dy, dz, block.n1x, block.n1y, block.n1z);
        const float8 w = dot3_8(dx, dy, dz, block.n2x, block.n2y, block.n2z);
        const float8 plane = dot3_8(dx, dy, dz, block.mx, block.my, block.mz);
        const int8 truly = (u >= 0.0f) & (v >= 0.0f) & (w >= 0.0f);
        const float8 flat = PICK(truly, plane, plane * BESIDE);
        const int8 inside = (u >= -block.rounding0) & (v >= -block.rounding1) & (w >= -block.rounding2) & (flat >= best) & block.clear;
        const int8 maybe = inside | ~block.clear;
        if (!any8(maybe)) continue;
        const float *inverses = (const float *)&flat, *us = (const float *)&u, *vs = (const float *)&v, *ws = (const float *)&w;
        const float *roundings = (const float *)&block.rounding0;
        const int *tries = (const int *)&maybe, *clear = (const int *)&block.clear;
        for (int j = 0; j < BLOCK_LANES; ++j) {
            const int triangle = triangles[index * BLOCK_LANES + j];
            if (!tries[j] || triangle < 0) continue;
            const float inverse = clear[j] ? inverses[j]
                                           : needle_inverse_range(geometry, index, j, ox, oy, oz, dx, dy, dz, us[j],
                                                                  vs[j], ws[j], roundings[j], roundings[8 + j], roundings[16 + j]);
            if (inverse > best || (inverse == best && triangle < found)) {
                best = inverse;
                found = triangle;
            }
        }
    }
    const float range = 1.0f / best;
    const bool hit = found >= 0 && range <= range_max;
    range_out[ray] = hit ? range : NAN;
    triangle_out[ray] = hit ? found : -1;
}
