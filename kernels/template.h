/* Template: where the beams of a tile's packets lie in the image of a scan.
 *
 * Purpose    Tiles hold neighbours in direction, which need not be neighbours in the image: rows may be shifted against
 *            one another, a turn ends where it began, and the last tile of a row is seldom full. The host
 *            (planner_core/engine/tiles.py) decides; kernels that write a beam's result or count it ask here.
 * Layout     places[(k * PACKETS + p) * 2 + ...] for packet p of tile k: 0: where lane 0 lies, row * columns + column;
 *            column may be negative where lane 0 is no beam; 1: bytes begin, end, wrap. Lanes from begin to before end are
 *            beams, every beam of the template in one packet alone; the others repeat a beam of the tile and are
 *            nobody's. Lanes from wrap on have passed the end of the turn and lie a row's length before.
 */
#ifndef TLSPLAN_TEMPLATE_H
#define TLSPLAN_TEMPLATE_H

typedef struct {
    int first, begin, end, wrap;
} Place;

static inline Place place_of(global const int *places, size_t packet)
{
    const int lanes = places[2 * packet + 1];
    const Place place = {places[2 * packet], lanes & 255, (lanes >> 8) & 255, (lanes >> 16) & 255};
    return place;
}

/* Whether all lanes are beams, one after the other in the image. */
static inline bool is_whole(Place place)
{
    return place.begin == 0 && place.end == LANES && place.wrap == LANES;
}

/* Place of a lane's beam in the image; lane from place.begin to before place.end. */
static inline int place_of_lane(Place place, int lane, int columns)
{
    return place.first + lane - (lane < place.wrap ? 0 : columns);
}

#endif
