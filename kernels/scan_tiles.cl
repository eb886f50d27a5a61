/* Scans: the first return of every beam of every position, in full.
 *
 * Purpose        The beam-exact scan of a station: range, triangle, patch and incidence a beam.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK
 */
#include "trace_tile.h"
#include "template.h"

/* Numbers of the engine's triangles as those of the whole scene: where glass was left out they are others. -1 stays. */
static inline lanes_i in_whole_scene(lanes_i triangle, global const int *whole, int is_part)
{
    if (!is_part) return triangle;
    int number[LANES];
    store_lanes(triangle, number);
    for (int lane = 0; lane < LANES; ++lane) number[lane] = number[lane] < 0 ? -1 : whole[number[lane]];
    return *(lanes_i_anywhere *)number;
}

/* Scan every position.
 * One work-item is one tile of one position. NDRange (tiles, positions), any local size.
 * positions (S, 3) metres, local frame. range_out, cosine_out (S, image) float; triangle_out, patch_out the same, int;
 * the template's own beams begin at first_beam of each image. whole (T) int, read where is_part: number of each triangle in
 * the whole scene. Every one of them is written once: NaN and -1 on a miss.
 * Deterministic: no work-item reads what another one writes. */
kernel void scan_tiles(TREE_ARGUMENTS, GRID_ARGUMENTS, global const int *whole, int is_part, global float *range_out,
                       global int *triangle_out, global int *patch_out, global float *cosine_out)
{
    const int tile = get_global_id(0), position = get_global_id(1);
    const float ox = positions[3 * position], oy = positions[3 * position + 1], oz = positions[3 * position + 2];
    global const float *own = beams + (size_t)tile * (PACKETS * 3 * LANES);
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, range_max);
    const size_t image = (size_t)position * image_beams + first_beam;
    for (int p = 0; p < PACKETS; ++p) {
        const Place place = place_of(places, (size_t)tile * PACKETS + p);
        if (place.begin == place.end) continue;
        global const float *d = own + p * (3 * LANES);
        const Hit hit = resolve(geometry, slot, edges, address, ox, oy, oz, LANES_LOAD(d), LANES_LOAD(d + LANES),
                                LANES_LOAD(d + 2 * LANES), returns.inverse[p], returns.triangle[p], range_min, range_max);
        const lanes_i named = in_whole_scene(hit.triangle, whole, is_part);
        if (is_whole(place)) {
            const size_t to = image + place.first;
            store_lanes(hit.range, range_out + to);
            store_lanes(named, triangle_out + to);
            store_lanes(hit.patch, patch_out + to);
            store_lanes(hit.cos_incidence, cosine_out + to);
            continue;
        }
        float range[LANES], cosine[LANES];
        int triangle[LANES], patch[LANES];
        store_lanes(hit.range, range);
        store_lanes(named, triangle);
        store_lanes(hit.patch, patch);
        store_lanes(hit.cos_incidence, cosine);
        for (int lane = place.begin; lane < place.end; ++lane) {
            const size_t to = image + place_of_lane(place, lane, columns);
            range_out[to] = range[lane];
            triangle_out[to] = triangle[lane];
            patch_out[to] = patch[lane];
            cosine_out[to] = cosine[lane];
        }
    }
}
