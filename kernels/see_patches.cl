/* Visibility: which patches the beams of a position see.
 *
 * Purpose        What planning needs of thousands of candidates, without their returns.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"
#include "patch_parts.h"

/* Patches that a tile remembers to have listed, by their low bits. */
#define RECENT 16

/* List the patches that every tile of every position sees.
 * One work-item is one tile of one position. NDRange (tiles, positions), any local size.
 * list (TILE_ROWS * TILE_COLUMNS, S, tiles) int, of which the first n_listed (S, tiles) of every tile are written: no patch
 * less than once, few more than once. patch_rows.cl takes them on. Deterministic: no work-item reads what another one writes. */
kernel void list_patches(TREE_ARGUMENTS, GRID_ARGUMENTS, global int *list, global int *n_listed)
{
    const int tile = get_global_id(0), position = get_global_id(1);
    const float ox = positions[3 * position], oy = positions[3 * position + 1], oz = positions[3 * position + 2];
    global const float *own = beams + (size_t)tile * (PACKETS * 3 * LANES);
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, range_max);
    const size_t at = (size_t)position * get_global_size(0) + tile;
    const size_t stride = get_global_size(0) * get_global_size(1);
    /* Neighbouring beams share patches: those listed lately are not listed again. */
    int recent[RECENT];
    for (int k = 0; k < RECENT; ++k) recent[k] = -1;
    int count = 0;
    for (int p = 0; p < PACKETS; p += WINDOW) {
        lanes_f range[WINDOW], weight[3][WINDOW];
        lanes_i todo[WINDOW], number[WINDOW];
        for (int k = 0; k < WINDOW; ++k) {
            range[k] = 1.0f / returns.inverse[p + k];
            todo[k] = returns.triangle[p + k];
            /* in the margin of a triangle no patch is seen */
            const lanes_i hit = returns_of(range[k], todo[k], range_min, range_max) & MASK((todo[k] & BESIDE_BIT) == 0);
            todo[k] = PICK(hit, todo[k], (lanes_i)(-1));
        }
        for (int from = 0; from < WINDOW;) {
            const int one = most_lane(todo[from]);
            if (one < 0) {
                ++from;
                continue;
            }
            const uint packets = take_triangle(todo, from, one, number);
            const int first_patch = address[2 * one], depth = address[2 * one + 1];
            if (first_patch < 0) continue; /* a mirror */
            int seen[WINDOW * LANES], n_seen = 1;
            seen[0] = 0;
            if (depth > 0) {
                const Weights weights = weights_of(lane_of(geometry, slot, one), ox, oy, oz);
                for (uint left = packets; left; left &= left - 1) {
                    const int k = lowest_bit(left);
                    global const float *d = own + (p + k) * (3 * LANES);
                    weigh_hits(&weights, LANES_LOAD(d), LANES_LOAD(d + LANES), LANES_LOAD(d + 2 * LANES), range[k],
                               &weight[0][k], &weight[1][k], &weight[2][k]);
                }
                n_seen = parts_hit(weight, number, packets, edges + 3 * (size_t)one, depth, seen);
            }
            for (int k = 0; k < n_seen; ++k) {
                const int patch = first_patch + seen[k];
                if (recent[patch % RECENT] == patch) continue;
                recent[patch % RECENT] = patch;
                list[at + stride * count++] = patch;
            }
        }
    }
    n_listed[at] = count;
}
