/* Scans: the first return of every beam of every position, in full.
 *
 * Purpose        The beam-exact scan of a station: range, triangle, patch and incidence a beam.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"

/* Scan every position.
 * One work-item is one tile of one position. NDRange (tiles, positions), any local size.
 * positions (S, 3) metres, local frame. range_out, cosine_out (S, rows, columns) float; triangle_out, patch_out the same,
 * int. Every entry is written once: NaN and -1 on a miss. Deterministic: no work-item reads what another one writes. */
kernel void scan_tiles(TREE_ARGUMENTS, GRID_ARGUMENTS, global float *range_out, global int *triangle_out,
                       global int *patch_out, global float *cosine_out)
{
    const int tile = get_global_id(0), position = get_global_id(1);
    const float ox = positions[3 * position], oy = positions[3 * position + 1], oz = positions[3 * position + 2];
    global const float *own = beams + (size_t)tile * (PACKETS * 3 * LANES);
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, range_max);
    const int row0 = tile / tiles_across * TILE_ROWS, column0 = tile % tiles_across * TILE_COLUMNS;
    for (int p = 0; p < PACKETS; ++p) {
        const int row = row0 + p / PACKETS_ACROSS, column = column0 + p % PACKETS_ACROSS * LANES;
        if (row >= rows || column >= columns) continue;
        global const float *d = own + p * (3 * LANES);
        const Hit hit = resolve(geometry, slot, edges, address, ox, oy, oz, LANES_LOAD(d), LANES_LOAD(d + LANES),
                                LANES_LOAD(d + 2 * LANES), returns.inverse[p], returns.triangle[p], range_min, range_max);
        const size_t to = ((size_t)position * rows + row) * columns + column;
        if (column + LANES <= columns) {
            LANES_STORE(hit.range, range_out + to);
            LANES_STORE(hit.triangle, triangle_out + to);
            LANES_STORE(hit.patch, patch_out + to);
            LANES_STORE(hit.cos_incidence, cosine_out + to);
            continue;
        }
        float range[LANES], cosine[LANES];
        int triangle[LANES], patch[LANES];
        LANES_STORE(hit.range, range);
        LANES_STORE(hit.triangle, triangle);
        LANES_STORE(hit.patch, patch);
        LANES_STORE(hit.cos_incidence, cosine);
        for (int lane = 0; column + lane < columns; ++lane) {
            range_out[to + lane] = range[lane];
            triangle_out[to + lane] = triangle[lane];
            patch_out[to + lane] = patch[lane];
            cosine_out[to + lane] = cosine[lane];
        }
    }
}
