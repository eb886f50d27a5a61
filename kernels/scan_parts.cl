/* Scans of a scene in parts: the first return of every beam over trees that are not all in memory at once.
 *
 * Purpose        Scenes larger than the device: planner_core/engine/parts.py brings one part after the other.
 * Algorithm      What a beam has hit so far waits in `nearest` and `named`; a part's hit takes its place if it is nearer, or
 *                as near and of a lower triangle number, which is how one tree decides (keep_first). The triangle test knows
 *                nothing of trees, so that the bits are those of one tree. A tile looks no farther than its farthest hit.
 * Layout         nearest, named (S, tiles, beams a tile): 1 / range, 0 for none; triangle of the whole scene, BESIDE_BIT.
 *                numbers (T): numbers in the whole scene of this part's triangles, ascending.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"
#include "template.h"

/* What a beam gets that hits nothing. NDRange (S times image), any local size. Every entry is written once. */
kernel void clear_scans(global float *range_out, global int *triangle_out, global int *patch_out, global float *cosine_out)
{
    const size_t i = get_global_id(0);
    range_out[i] = NAN;
    triangle_out[i] = -1;
    patch_out[i] = -1;
    cosine_out[i] = NAN;
}

/* Scan the chosen positions' view of one part.
 * One work-item is one tile of one position. NDRange (tiles, chosen positions), any local size.
 * positions (S, 3) metres, local frame; chosen: which of them. Outputs as of scan_tiles, with triangles of the whole scene.
 * Deterministic: no work-item reads what another one writes. */
kernel void scan_part(TREE_ARGUMENTS, GRID_ARGUMENTS, global const int *chosen, global const int *numbers,
                      global float *nearest, global int *named, global float *range_out, global int *triangle_out,
                      global int *patch_out, global float *cosine_out)
{
    const int tile = get_global_id(0), position = chosen[get_global_id(1)];
    const float ox = positions[3 * position], oy = positions[3 * position + 1], oz = positions[3 * position + 2];
    global const float *own = beams + (size_t)tile * (PACKETS * 3 * LANES);
    const size_t state = ((size_t)position * get_global_size(0) + tile) * (PACKETS * LANES);
    float least = INFINITY;
    for (int k = 0; k < PACKETS * LANES; ++k) least = LEAST(nearest[state + k], least);
    const float farthest = least > 0.0f ? 1.0f / least : range_max;
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, LEAST(farthest, range_max));
    const size_t image = (size_t)position * image_beams + first_beam;
    for (int p = 0; p < PACKETS; p += TOGETHER) {
        Hit hits[TOGETHER];
        resolve_packets(hits, &returns, p, own, geometry, slot, edges, address, numbers, ox, oy, oz, range_min, range_max);
        EACH_PACKET(k) {
            const Place place = place_of(places, (size_t)tile * PACKETS + p + k);
            float inverse[LANES], range[LANES], cosine[LANES];
            int met[LANES], triangle[LANES], patch[LANES];
            store_lanes(returns.inverse[p + k], inverse);
            store_lanes(returns.triangle[p + k], met);
            store_lanes(hits[k].range, range);
            store_lanes(hits[k].named, triangle);
            store_lanes(hits[k].patch, patch);
            store_lanes(hits[k].cos_incidence, cosine);
            for (int lane = 0; lane < LANES; ++lane) {
                if (met[lane] < 0) continue;
                const size_t at = state + (p + k) * LANES + lane;
                const int name = numbers[met[lane] & ~BESIDE_BIT] | (met[lane] & BESIDE_BIT);
                if (inverse[lane] < nearest[at] || (inverse[lane] == nearest[at] && name > named[at])) continue;
                nearest[at] = inverse[lane];
                named[at] = name;
                if (lane < place.begin || lane >= place.end) continue;
                const size_t to = image + place_of_lane(place, lane, columns);
                range_out[to] = range[lane];
                triangle_out[to] = triangle[lane];
                patch_out[to] = patch[lane];
                cosine_out[to] = cosine[lane];
            }
        }
    }
}
