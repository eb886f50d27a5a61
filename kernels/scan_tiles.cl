/* Scans: the first return of every beam of every position, in full.
 *
 * Purpose        The beam-exact scan of a station: range, triangle, patch and incidence a beam.
 * Define         see trace_tile.h: TILE_ROWS, TILE_COLUMNS, LANES, STACK; AHEAD: 1 where the device takes hints about memory (a
 *                CPU) and a position's results do not fit into its caches; else 0, as without
 */
#include "trace_tile.h"
#include "template.h"

#ifndef AHEAD
#define AHEAD 0
#endif

/* The lines of a packet's place, which is aligned to one lane. */
#define WRITE_AHEAD(p)                                                                                                 \
    do {                                                                                                               \
        __builtin_prefetch((const void *)(size_t)(p), 1);                                                              \
        __builtin_prefetch((const void *)(size_t)((p) + LANES - 1), 1);                                                \
    } while (0)

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
    const size_t image = (size_t)position * image_beams + first_beam;
#if AHEAD
    /* Ask for the memory of the results now: a store that misses holds up all that follow. */
    for (int p = 0; p < PACKETS; ++p) {
        const size_t to = image + place_of(places, (size_t)tile * PACKETS + p).first;
        WRITE_AHEAD(range_out + to);
        WRITE_AHEAD(triangle_out + to);
        WRITE_AHEAD(patch_out + to);
        WRITE_AHEAD(cosine_out + to);
    }
#endif
    Returns returns;
    trace_tile(&returns, boxes, children, geometry, triangles, tiles + (size_t)tile * TILE_FLOATS, own,
               rectangles + (size_t)tile * (4 * PACKETS), ox, oy, oz, range_max);
    for (int p = 0; p < PACKETS; p += TOGETHER) {
        Hit hits[TOGETHER];
        resolve_packets(hits, &returns, p, own, geometry, slot, edges, address, is_part ? whole : 0, ox, oy, oz, range_min,
                        range_max);
        EACH_PACKET(k) {
            const Hit hit = hits[k];
            const Place place = place_of(places, (size_t)tile * PACKETS + p + k);
            if (is_whole(place)) {
                const size_t to = image + place.first;
                store_lanes(hit.range, range_out + to);
                store_lanes(hit.named, triangle_out + to);
                store_lanes(hit.patch, patch_out + to);
                store_lanes(hit.cos_incidence, cosine_out + to);
                continue;
            }
            float range[LANES], cosine[LANES];
            int triangle[LANES], patch[LANES];
            store_lanes(hit.range, range);
            store_lanes(hit.named, triangle);
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
}
