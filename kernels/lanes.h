/* Lanes: one name for a float and for a vector of floats, so that one source serves a packet of any width.
 *
 * Define   meaning                                                             example
 * LANES    beams a packet; 1 (scalar), 4, 8 or 16; a property of the device    -DLANES=8
 *
 * A mask is 0 or -1 in every lane, for the scalar too. All arithmetic is float32 without contraction: a product
 * is fused into a sum only inside dot3, since the watertight test lives on exactly negated values.
 */
#ifndef TLSPLAN_LANES_H
#define TLSPLAN_LANES_H
#pragma OPENCL FP_CONTRACT OFF

#ifndef LANES
#error "LANES is not defined"
#endif

#define GLUE2(a, b) a##b
#define GLUE(a, b) GLUE2(a, b)

#if LANES == 1
typedef float lanes_f;
typedef int lanes_i;
#define MASK(condition) (-(condition))
#else
typedef GLUE(float, LANES) lanes_f;
typedef GLUE(int, LANES) lanes_i;
#define MASK(condition) (condition)
#endif

/* Memory that is aligned to one lane alone. */
typedef lanes_f lanes_f_anywhere __attribute__((aligned(4)));
typedef lanes_i lanes_i_anywhere __attribute__((aligned(4)));
#define DEFINE_STORE(space, type, lanes)                                                                              \
    static inline void __attribute__((overloadable)) store_lanes(lanes x, space type *p)                              \
    {                                                                                                                 \
        *(space lanes##_anywhere *)p = x;                                                                             \
    }
DEFINE_STORE(global, float, lanes_f)
DEFINE_STORE(global, int, lanes_i)
DEFINE_STORE(private, float, lanes_f)
DEFINE_STORE(private, int, lanes_i)

/* Where p is aligned to the whole vector, as all arrays of ours are. */
#define LANES_LOAD(p) (*(global const lanes_f *)(p))
#define LOAD8(p) (*(global const float8 *)(p))
#define LOAD8I(p) (*(global const int8 *)(p))
/* Eight ints to private memory that is aligned to an int alone. */
typedef int8 int8_anywhere __attribute__((aligned(4)));
#define STORE8I(x, p) (*(int8_anywhere *)(p) = (x))

/* Operators instead of built-in functions. PoCL 3.0 (LLVM 14) leaves select, fmin, fmax, fma, vload and the like as
 * CALLS on CPUs whose features its library was not built for: more than half of a scan's time. An operator is an
 * instruction everywhere. NaN: LEAST and MOST return b. */
#define PICK(mask, yes, no) ((mask) ? (yes) : (no))
#define LEAST(a, b) (((a) < (b)) ? (a) : (b))
#define MOST(a, b) (((a) > (b)) ? (a) : (b))
#define MAGNITUDE(x) as_float(as_int(x) & 0x7fffffff)
#define MAGNITUDE8(x) as_float8(as_int8(x) & 0x7fffffff)

static inline bool any8(int8 mask)
{
    const int4 half4 = mask.lo | mask.hi;
    const int2 half2 = half4.lo | half4.hi;
    return (half2.x | half2.y) != 0;
}

/* All lanes joined by `join`, a macro of two. */
#if LANES == 1
#define JOIN_LANES(x, join) return x
#elif LANES == 2
#define JOIN_LANES(x, join) return join(x.x, x.y)
#elif LANES == 4
#define JOIN_LANES(x, join)                                                                                            \
    const int2 x2 = join(x.lo, x.hi);                                                                                  \
    return join(x2.x, x2.y)
#elif LANES == 8
#define JOIN_LANES(x, join)                                                                                            \
    const int4 x4 = join(x.lo, x.hi);                                                                                  \
    const int2 x2 = join(x4.lo, x4.hi);                                                                                \
    return join(x2.x, x2.y)
#else
#define JOIN_LANES(x, join)                                                                                            \
    const int8 x8 = join(x.lo, x.hi);                                                                                  \
    const int4 x4 = join(x8.lo, x8.hi);                                                                                \
    const int2 x2 = join(x4.lo, x4.hi);                                                                                \
    return join(x2.x, x2.y)
#endif
#define EITHER(a, b) ((a) | (b))

/* Bits that are set in any lane. */
static inline int any_bits(lanes_i x)
{
    JOIN_LANES(x, EITHER);
}

/* Greatest lane. */
static inline int most_lane(lanes_i x)
{
    JOIN_LANES(x, MOST);
}

/* Bit j is lane j of a mask. */
static inline int bits8(int8 mask)
{
    const int8 bits = mask & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    const int4 half4 = bits.lo | bits.hi;
    const int2 half2 = half4.lo | half4.hi;
    return half2.x | half2.y;
}

/* Number of the lowest set bit; bits is not 0. A power of two as a float has its number as exponent: no call. */
static inline int lowest_bit(uint bits)
{
    const float power = (float)(int)(bits & -bits);
    return (int)(as_uint(power) >> 23 & 255u) - 127;
}

/* a . b in ONE order of operations wherever a sign or a range is decided. Contraction is allowed HERE alone: the
 * rounding of a fused product is as symmetric as that of a plain one, so that negated inputs give exactly the negated
 * result, whether the device fuses or not. */
#define DEFINE_DOT3(name, type)                                                                                       \
    static inline type name(type ax, type ay, type az, type bx, type by, type bz)                                     \
    {                                                                                                                 \
        _Pragma("OPENCL FP_CONTRACT ON") return ax * bx + (ay * by + az * bz);                                        \
    }
DEFINE_DOT3(dot3_lanes, lanes_f)
DEFINE_DOT3(dot3_8, float8)
DEFINE_DOT3(dot3_1, float)

#endif
