/* Coverage of a population: for every individual the weight of the rows that its stations see together.
 *
 * Purpose    The fitness of genetic selection. Whole numbers: the same on every device, in any order.
 * Algorithm  Rows of surface are bits. A tile is TILE words of them, for all candidates side by side, so that it stays in
 *            cache while many individuals pass. The words of an individual's stations are OR-ed in registers, without
 *            those that see nothing of the tile; then bit b of ALL lanes at once is made a mask (0 or ~0) that lets the
 *            weights of these rows through:
 *
 *                word   lane 0  lane 1  ...        mask = -(word >> b & 1)         sum += mask & weight[b]
 *
 *            which costs a few operations for LANES rows, whatever the weights; looking through set bits costs that each.
 * Layout     row i of a tile is bit i / TILE of word i % TILE. bits (n_tiles, N, TILE) uint. weights (n_tiles, 32, TILE)
 *            uint below 2^27, so that 32 of them add up in 32 bits; in units of 2^shift ticks, shift (n_tiles): rows that
 *            weigh more are in more than one tile. near (n_tiles, W) uint: bit g, candidate g sees anything of the tile.
 *
 * Define   meaning                                                 example
 * LANES    words side by side, a property of the device: 1, 4, 8   -DLANES=8
 * DEPTH    vectors a work-item                                     -DDEPTH=8
 * TILE     words a tile, a multiple of LANES * DEPTH               -DTILE=64
 */
#define GLUE2(a, b) a##b
#define GLUE(a, b) GLUE2(a, b)

#if LANES == 1
typedef uint lanes_u;
#define MASK(condition) ((uint)-(condition))
#elif LANES == 4
typedef uint4 lanes_u;
#define MASK(condition) as_uint4(condition)
#else
typedef uint8 lanes_u;
#define MASK(condition) as_uint8(condition)
#endif

#define LOAD(p) (*(global const lanes_u *)(p))
#define STATE_STOPPED 2

/* Add up the lanes, in 64 bits. */
static inline ulong add_lanes(lanes_u x)
{
#if LANES == 1
    return x;
#elif LANES == 4
    return (ulong)x.s0 + x.s1 + x.s2 + x.s3;
#else
    return ((ulong)x.s0 + x.s1 + x.s2 + x.s3) + ((ulong)x.s4 + x.s5 + x.s6 + x.s7);
#endif
}

/* One work-item is LANES * DEPTH words of one tile, for a run of individuals. NDRange (slots, runs, n_tiles), slots =
 * TILE / (LANES * DEPTH). genes (n, W): see genetic_population.cl; sums (n, n_tiles, slots) written, each entry once:
 * ticks. */
kernel void cover(global const int *state, global const uint *bits, global const uint *weights,
                  global const int *shift, global const uint *near, int n_candidates, global const uint *genes, int n,
                  global ulong *sums)
{
    if (state[STATE_STOPPED]) return;
    const int slot = get_global_id(0), tile = get_global_id(2), n_tiles = get_global_size(2);
    const int runs = get_global_size(1), run = get_global_id(1), n_words = (n_candidates + 31) / 32;
    const int first = (int)((long)n * run / runs), end = (int)((long)n * (run + 1) / runs);
    const int at = slot * LANES * DEPTH;
    global const uint *own_bits = bits + (size_t)tile * n_candidates * TILE + at;
    global const uint *own_weights = weights + (size_t)tile * 32 * TILE + at;
    for (int individual = first; individual < end; ++individual) {
        /* 1. What its stations see together. */
        lanes_u seen[DEPTH];
        for (int d = 0; d < DEPTH; ++d) seen[d] = (lanes_u)(0);
        for (int word = 0; word < n_words; ++word) {
            uint active = genes[(size_t)individual * n_words + word] & near[tile * n_words + word];
            for (; active != 0; active &= active - 1) {
                /* The number of a lone bit is the exponent of its float. */
                const int gene = 32 * word + (int)(as_uint((float)(active & -active)) >> 23) - 127;
                global const uint *own = own_bits + (size_t)gene * TILE;
#pragma unroll
                for (int d = 0; d < DEPTH; ++d) seen[d] |= LOAD(own + d * LANES);
            }
        }
        /* 2. What that weighs. */
        ulong sum = 0;
        for (int d = 0; d < DEPTH; ++d) {
            const lanes_u word = seen[d];
            lanes_u part = (lanes_u)(0);
#pragma unroll
            for (int bit = 0; bit < 32; ++bit)
                part += MASK((word & (1u << bit)) != 0u) & LOAD(own_weights + bit * TILE + d * LANES);
            sum += add_lanes(part);
        }
        sums[((size_t)individual * n_tiles + tile) * get_global_size(0) + slot] = sum << shift[tile];
    }
}
