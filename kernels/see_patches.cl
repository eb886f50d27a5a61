/* Visibility: which patches the beams of a position see.
 *
 * Purpose        What planning needs of thousands of candidates, without their returns.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"

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
    for (int p = 0; p < PACKETS; ++p) {
        global const float *d = own + p * (3 * LANES);
        const Hit hit = resolve(geometry, slot, edges, address, ox, oy, oz, LANES_LOAD(d), LANES_LOAD(d + LANES),
                                LANES_LOAD(d + 2 * LANES), returns.inverse[p], returns.triangle[p], range_min, range_max);
        int patch[LANES];
        store_lanes(hit.patch, patch);
        for (int lane = 0; lane < LANES; ++lane) {
            const int one = patch[lane];
            if (one < 0 || recent[one % RECENT] == one) continue;
            recent[one % RECENT] = one;
            list[at + stride * count++] = one;
        }
    }
    n_listed[at] = count;
}
