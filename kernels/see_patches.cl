/* Visibility: which patches the beams of a position see.
 *
 * Purpose        What planning needs of thousands of candidates, without their returns.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"

/* Mark the patches that every position sees.
 * One work-item is one tile of one position. NDRange (tiles, positions), any local size.
 * marks (S, n_patches) bytes; the host zeroes it; 1 where a return lies on the patch. Deterministic: work-items that
 * write the same byte write the same value. A padded beam repeats a real one of its tile and marks nothing new. */
kernel void mark_patches(TREE_ARGUMENTS, GRID_ARGUMENTS, global uchar *marks, int n_patches)
{
    const int tile = get_global_id(0), position = get_global_id(1);
    const float ox = positions[3 * position], oy = positions[3 * position + 1], oz = positions[3 * position + 2];
    global const float *own = beams + (size_t)tile * (PACKETS * 3 * LANES);
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, range_max);
    global uchar *mine = marks + (size_t)position * n_patches;
    for (int p = 0; p < PACKETS; ++p) {
        global const float *d = own + p * (3 * LANES);
        const Hit hit = resolve(geometry, slot, edges, address, ox, oy, oz, LANES_LOAD(d), LANES_LOAD(d + LANES),
                                LANES_LOAD(d + 2 * LANES), returns.inverse[p], returns.triangle[p], range_min, range_max);
        int patch[LANES];
        LANES_STORE(hit.patch, patch);
        for (int lane = 0; lane < LANES; ++lane)
            if (patch[lane] >= 0) mine[patch[lane]] = 1;
    }
}
