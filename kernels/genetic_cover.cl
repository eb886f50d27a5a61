/* Coverage of a population: for every individual the weight of the rows that its stations see together.
 *
 * Purpose    The fitness of genetic selection. Whole numbers: the same on every device, in any order.
 * Algorithm  Rows of surface are bits. A tile is TILE words of them, for all candidates side by side, so that it stays in
 *            cache while many individuals pass. The words of an individual's stations are OR-ed in registers; then bit b
 *            of ALL lanes at once is made a mask (0 or ~0) that lets the weights of these rows through:
 *
 *                word   lane 0  lane 1  ...        mask = -(word >> b & 1)         sum += mask & weight[b]
 *
 *            which costs a few operations for LANES rows, whatever the weights; looking through set bits costs that each.
 * Layout     row r of a tile is bit r / TILE of word r % TILE. bits (n_tiles, N, TILE) uint. weights (n_tiles, PARTS, 32,
 *            TILE) uint: low 24 bits of the ticks, and where PARTS is 2 those above: sums of 256 stay below 2^32.
 *
 * Define   meaning                                                          example
 * LANES    words side by side, a property of the device: 1, 4 or 8          -DLANES=8
 * DEPTH    vectors a work-item, at most 8: 32 DEPTH weights add up in a lane  -DDEPTH=8
 * TILE     words a tile, a multiple of LANES * DEPTH                        -DTILE=64
 * PARTS    1 where no weight needs more than 24 bits, else 2                -DPARTS=2
 */
#define GLUE2(a, b) a##b
#define GLUE(a, b) GLUE2(a, b)

#if LANES == 1
typedef uint lanes_u;
#define ADD_UP(x) ((ulong)(x))
#else
typedef GLUE(uint, LANES) lanes_u;
#if LANES == 4
#define ADD_UP(x) ((ulong)(x).s0 + (x).s1 + (x).s2 + (x).s3)
#else
#define ADD_UP(x) ((ulong)(x).s0 + (x).s1 + (x).s2 + (x).s3 + (x).s4 + (x).s5 + (x).s6 + (x).s7)
#endif
#endif

#define LOAD(p) (*(global const lanes_u *)(p))
#define STATE_STOPPED 2
#define PART_BITS 24

/* One work-item is LANES * DEPTH words of one tile, for a run of individuals. NDRange (slots, runs, n_tiles), slots =
 * TILE / (LANES * DEPTH). list (n, N): active candidates, the first n_listed (n) of each; sums (n, n_tiles, slots) written,
 * each entry once: ticks. */
kernel void cover(global const int *state, global const uint *bits, global const uint *weights, int n_candidates,
                  global const int *list, global const int *n_listed, int n, global ulong *sums)
{
    if (state[STATE_STOPPED]) return;
    const int slot = get_global_id(0), tile = get_global_id(2), n_tiles = get_global_size(2);
    const int runs = get_global_size(1), run = get_global_id(1);
    const int first = (int)((long)n * run / runs), end = (int)((long)n * (run + 1) / runs);
    const int at = slot * LANES * DEPTH;
    global const uint *own_bits = bits + (size_t)tile * n_candidates * TILE + at;
    global const uint *own_weights = weights + (size_t)tile * PARTS * 32 * TILE + at;
    for (int individual = first; individual < end; ++individual) {
        /* 1. What its stations see together. */
        lanes_u seen[DEPTH];
        for (int d = 0; d < DEPTH; ++d) seen[d] = (lanes_u)(0);
        global const int *mine = list + (size_t)individual * n_candidates;
        const int n_active = n_listed[individual];
        for (int k = 0; k < n_active; ++k) {
            global const uint *word = own_bits + (size_t)mine[k] * TILE;
#pragma unroll
            for (int d = 0; d < DEPTH; ++d) seen[d] |= LOAD(word + d * LANES);
        }
        /* 2. What that weighs. */
        lanes_u low = (lanes_u)(0), high = (lanes_u)(0);
#pragma unroll
        for (int d = 0; d < DEPTH; ++d)
            for (int bit = 0; bit < 32; ++bit) {
                const lanes_u mask = (lanes_u)(0) - (seen[d] >> bit & 1u);
                low += mask & LOAD(own_weights + bit * TILE + d * LANES);
#if PARTS == 2
                high += mask & LOAD(own_weights + (32 + bit) * TILE + d * LANES);
#endif
            }
        sums[((size_t)individual * n_tiles + tile) * get_global_size(0) + slot] =
            ADD_UP(low) + (ADD_UP(high) << PART_BITS);
    }
}
