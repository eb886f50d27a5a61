/* Stable radix sort of 64-bit keys, each with a 32-bit value.
 *
 * Purpose    Orders triangles along the Morton curve (planner_core.engine.tree); of use for anything that needs an order.
 * Algorithm  Least significant digit first. A pass counts the digits of every chunk, turns the counts into places, and
 *            moves the elements there, chunk by chunk in order: the result is THE stable order, whatever the chunks.
 * Indices    chunk c owns elements [first_of(c), first_of(c + 1)); counts[digit * n_chunks + c].
 *
 * Define      meaning                                        example
 * DIGIT_BITS  bits a pass; 2^DIGIT_BITS counters a chunk     -DDIGIT_BITS=8
 */
#include "chunks.h"

#define DIGITS (1 << DIGIT_BITS)
#define DIGIT(key, shift) ((uint)((key) >> (shift)) & (DIGITS - 1))

/* One work-item counts the digits of one chunk. NDRange (n_chunks). counts (DIGITS, n_chunks) written. */
kernel void count_digits(global const ulong *keys, int n, int shift, global uint *counts)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    uint count[DIGITS];
    for (int d = 0; d < DIGITS; ++d) count[d] = 0;
    const int end = first_of(chunk + 1, n_chunks, n);
    for (int i = first_of(chunk, n_chunks, n); i < end; ++i) ++count[DIGIT(keys[i], shift)];
    for (int d = 0; d < DIGITS; ++d) counts[d * n_chunks + chunk] = count[d];
}

/* One work-item turns one digit's counts into places among the elements of that digit. NDRange (DIGITS). counts in
 * place; totals (DIGITS) written: elements of the digit. */
kernel void place_digits(global uint *counts, int n_chunks, global uint *totals)
{
    const int digit = get_global_id(0);
    uint sum = 0;
    for (int c = 0; c < n_chunks; ++c) {
        const uint count = counts[digit * n_chunks + c];
        counts[digit * n_chunks + c] = sum;
        sum += count;
    }
    totals[digit] = sum;
}

/* One work-item moves the elements of one chunk. NDRange (n_chunks). to_keys (n), to_values (n) written, each entry
 * once. */
kernel void move_elements(global const ulong *keys, global const int *values, int n, int shift,
                          global const uint *counts, global const uint *totals, global ulong *to_keys,
                          global int *to_values)
{
    const int chunk = get_global_id(0), n_chunks = get_global_size(0);
    uint place[DIGITS];
    uint sum = 0;
    for (int d = 0; d < DIGITS; ++d) {
        place[d] = sum + counts[d * n_chunks + chunk];
        sum += totals[d];
    }
    const int end = first_of(chunk + 1, n_chunks, n);
    for (int i = first_of(chunk, n_chunks, n); i < end; ++i) {
        const ulong key = keys[i];
        const uint at = place[DIGIT(key, shift)]++;
        to_keys[at] = key;
        to_values[at] = values[i];
    }
}
