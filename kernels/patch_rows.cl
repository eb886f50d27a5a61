/* Rows: from what the tiles of a position list to its patches, sorted and each once.
 *
 * Purpose    Joins the lists of see_patches.cl and the records of patch_returns.cl position by position, on the device:
 *            the host never touches a byte a patch.
 * Algorithm  One bit a patch. Nobody else writes the bits of a work-item: it owns a slice of one position's patches, reads
 *            all of the position's lists and takes what lies in its slice. So there are no atomics, and the order of
 *            writing does not matter. The set bits in order are the row.
 *
 *              lists of tiles  7 3 | 3 9 | 9      slice 0: patches 0..31    slice 1: patches 32..63
 *              bits            0001000101...      row: 3 7 9
 *
 * Layout     list (..., S, tiles) int: the first n_listed (S, tiles) entries of every tile are patches. First entries of all
 *            tiles lie together, then all second ones: few tiles have many, so that little of the memory is ever touched.
 *            bits (S, words) uint: bit p % 32 of word p / 32 is patch p.
 */
#pragma OPENCL FP_CONTRACT OFF

typedef struct {
    int first, last; /* words first .. last - 1 */
} Slice;

/* Slices differ by a word at most. */
static inline Slice own_slice(int words)
{
    const long slice = get_global_id(0), slices = get_global_size(0);
    const Slice own = {(int)(words * slice / slices), (int)(words * (slice + 1) / slices)};
    return own;
}

/* Set bits of a word. Operators: PoCL 3.0 leaves popcount a call. */
static inline int bits_set(uint word)
{
    word -= (word >> 1) & 0x55555555u;
    word = (word & 0x33333333u) + ((word >> 2) & 0x33333333u);
    return (int)((((word + (word >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24);
}

/* Set the bits of the patches that a position's tiles list.
 * One work-item is one slice of one position. NDRange (slices, S), any local size. Writes every word of `bits` and
 * n_set (S, slices), the number of bits set. Deterministic: see above. */
kernel void mark_rows(global const int *list, global const int *n_listed, int tiles, int words, global uint *bits,
                      global int *n_set)
{
    const int position = get_global_id(1);
    const Slice own = own_slice(words);
    global uint *mine = bits + (size_t)position * words;
    const size_t stride = (size_t)tiles * get_global_size(1);
    for (int word = own.first; word < own.last; ++word) mine[word] = 0;
    for (int tile = 0; tile < tiles; ++tile) {
        const size_t at = (size_t)position * tiles + tile;
        const int count = n_listed[at];
        for (int k = 0; k < count; ++k) {
            const int patch = list[at + stride * k], word = patch >> 5;
            if (word >= own.first && word < own.last) mine[word] |= 1u << (patch & 31);
        }
    }
    int count = 0;
    for (int word = own.first; word < own.last; ++word)
        if (mine[word] != 0) count += bits_set(mine[word]);
    n_set[position * (int)get_global_size(0) + get_global_id(0)] = count;
}

/* Write the patches of the set bits, in order.
 * One work-item is one slice of one position, the same slices as in mark_rows. NDRange (slices, S), any local size.
 * start (S, slices): where its patches begin in `row`; before (S, words): how many of `row` come before a word's, written
 * for words that have any. Deterministic: every entry is written once. */
kernel void write_rows(global const uint *bits, int words, global const int *start, global int *row, global int *before)
{
    const int position = get_global_id(1);
    const Slice own = own_slice(words);
    global const uint *mine = bits + (size_t)position * words;
    int at = start[position * (int)get_global_size(0) + get_global_id(0)];
    for (int word = own.first; word < own.last; ++word) {
        uint left = mine[word];
        if (left == 0) continue;
        before[(size_t)position * words + word] = at;
        for (; left != 0; left &= left - 1) {
            /* The number of a lone bit is the exponent of its float. */
            const float lowest = (float)(left & -left);
            row[at++] = 32 * word + (as_int(lowest) >> 23) - 127;
        }
    }
}

#define SUMS 10

/* Where a patch stands in `row`: what comes before its word, and the set bits below its own. */
static inline int place_in_row(global const uint *bits, global const int *before, int patch)
{
    const int word = patch >> 5;
    return before[word] + bits_set(bits[word] & ((1u << (patch & 31)) - 1));
}

/* Add up the records of a position's tiles, see patch_returns.cl, in the order of tiles.
 * One work-item is one slice of one position, the same slices as in mark_rows. NDRange (slices, S), any local size.
 * Writes the entries of its patches in row_returns (row). Deterministic: one order; and sums are of integers. */
kernel void add_counts(global const int *list, global const int *n_listed, int tiles, int words,
                       global const uint *bits, global const int *before, global const int *start,
                       global const int *n_set, global const int *n_returns, global int *row_returns)
{
    const int position = get_global_id(1), part = position * (int)get_global_size(0) + get_global_id(0);
    const Slice own = own_slice(words);
    const size_t stride = (size_t)tiles * get_global_size(1);
    for (int at = start[part]; at < start[part] + n_set[part]; ++at) row_returns[at] = 0;
    for (int tile = 0; tile < tiles; ++tile) {
        const size_t first = (size_t)position * tiles + tile, end = first + stride * n_listed[first];
        for (size_t k = first; k < end; k += stride) {
            const int patch = list[k], word = patch >> 5;
            if (word < own.first || word >= own.last) continue;
            row_returns[place_in_row(bits + (size_t)position * words, before + (size_t)position * words, patch)] +=
                n_returns[k];
        }
    }
}

/* The same with moments: also row_power (row), row_sums (row, SUMS), row_extremes (row, 2). */
kernel void add_moments(global const int *list, global const int *n_listed, int tiles, int words,
                        global const uint *bits, global const int *before, global const int *start,
                        global const int *n_set, global const int *n_returns, global const int *power,
                        global const long *sums, global const float *extremes, global int *row_returns,
                        global int *row_power, global long *row_sums, global float *row_extremes)
{
    const int position = get_global_id(1), part = position * (int)get_global_size(0) + get_global_id(0);
    const Slice own = own_slice(words);
    const size_t stride = (size_t)tiles * get_global_size(1);
    for (int at = start[part]; at < start[part] + n_set[part]; ++at) {
        row_returns[at] = 0;
        for (int k = 0; k < SUMS; ++k) row_sums[(size_t)at * SUMS + k] = 0;
        row_extremes[2 * (size_t)at] = INFINITY;
        row_extremes[2 * (size_t)at + 1] = 0.0f;
    }
    for (int tile = 0; tile < tiles; ++tile) {
        const size_t first = (size_t)position * tiles + tile, end = first + stride * n_listed[first];
        for (size_t k = first; k < end; k += stride) {
            const int patch = list[k], word = patch >> 5;
            if (word < own.first || word >= own.last) continue;
            const size_t at =
                place_in_row(bits + (size_t)position * words, before + (size_t)position * words, patch);
            row_returns[at] += n_returns[k];
            row_power[at] = power[k];
            for (int sum = 0; sum < SUMS; ++sum) row_sums[at * SUMS + sum] += sums[k * SUMS + sum];
            const float least = extremes[2 * k], greatest = extremes[2 * k + 1];
            if (least < row_extremes[2 * at]) row_extremes[2 * at] = least;
            if (greatest > row_extremes[2 * at + 1]) row_extremes[2 * at + 1] = greatest;
        }
    }
}
