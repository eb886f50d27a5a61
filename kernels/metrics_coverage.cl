/* F1 of sets of positions: how many distinct patches any position of a set reaches, and their area.
 *
 * Purpose    The paper's Eq. 1 for many sets over the same positions, docs/method/f1.md.
 * Algorithm  A bit a patch. A work-item owns a slice of the patches for one set: it ORs in what lies in the slice of every
 *            row of the set, then counts bits and adds up areas.
 *
 *              rows of the set   3 7 | 3 9 40        slice 0: patches 0..31   slice 1: patches 32..63
 *              bits              0001000101...       slice 0 counts 3, slice 1 counts 1
 *
 * Layout     starts (N + 1) long, patch (M) int: rows of positions, sorted, each once. of_set (K + 1) int, chosen int: rows of
 *            sets. Areas are whole multiples of a power of two: they add up to the same in any order.
 *
 * Define     meaning                                                       example
 * WORDS      words of 32 patches a slice; results do not depend on it      -DWORDS=512
 */

/* Set bits of a word. Operators: PoCL 3.0 leaves popcount a call. */
static inline int bits_set(uint word)
{
    word -= (word >> 1) & 0x55555555u;
    word = (word & 0x33333333u) + ((word >> 2) & 0x33333333u);
    return (int)((((word + (word >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24);
}

/* First of the entries low .. high - 1 of a sorted row that is not below `least`; high where all are. */
static inline long first_from(global const int *patch, long low, long high, long least)
{
    while (low < high) {
        const long middle = low + (high - low) / 2;
        if (patch[middle] < least)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Patches that sets reach, and their area.
 * One work-item is one slice of one set. NDRange (slices, K), any local size. area (n_patches) ulong.
 * Writes count (K, slices) int and reached (K, slices) ulong, every entry. Deterministic: whole numbers. */
kernel void measure_sets(global const long *starts, global const int *patch, global const int *of_set,
                         global const int *chosen, global const ulong *area, global int *count, global ulong *reached)
{
    const size_t slice = get_global_id(0), set = get_global_id(1), slices = get_global_size(0);
    const long first = (long)slice * 32 * WORDS, end = first + 32 * WORDS;
    uint bits[WORDS];
    for (int word = 0; word < WORDS; ++word) bits[word] = 0u;
    for (int k = of_set[set]; k < of_set[set + 1]; ++k) {
        const long last = starts[chosen[k] + 1];
        for (long at = first_from(patch, starts[chosen[k]], last, first); at < last && patch[at] < end; ++at) {
            const int place = (int)(patch[at] - first);
            bits[place / 32] |= 1u << (place % 32);
        }
    }
    int n = 0;
    ulong sum = 0ul;
    for (int word = 0; word < WORDS; ++word) {
        n += bits_set(bits[word]);
        for (uint left = bits[word]; left != 0u; left &= left - 1u) {
            /* the place of the lowest bit: the number of bits below it */
            sum += area[first + 32 * word + bits_set((left & (0u - left)) - 1u)];
        }
    }
    count[set * slices + slice] = n;
    reached[set * slices + slice] = sum;
}
