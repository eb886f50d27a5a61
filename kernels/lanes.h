/* Lanes: one name for a float and for a vector of floats, so that one source serves a packet of any width.
 *
 * Define   meaning                                                             example
 * LANES    beams a packet; 1 (scalar), 4, 8 or 16; a property of the device    -DLANES=8
 *
 * A mask is 0 or -1 in every lane, for the scalar too. All arithmetic is float32 without contraction: a product
 * is fused into a sum only where dot3 says so, since the watertight test lives on exactly negated values.
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
#define LANES_LOAD(p) (*(p))
#define LANES_STORE(x, p) (*(p) = (x))
#define MASK(condition) (-(condition))
#define ANY(mask) ((mask) != 0)
#else
typedef GLUE(float, LANES) lanes_f;
typedef GLUE(int, LANES) lanes_i;
#define LANES_LOAD(p) GLUE(vload, LANES)(0, (p))
#define LANES_STORE(x, p) GLUE(vstore, LANES)((x), 0, (p))
#define MASK(condition) (condition)
#define ANY(mask) any(mask)
#endif

/* a . b in ONE order of operations wherever a sign or a range is decided. FUSE is fma where the device has it in
 * hardware: fma(-a, b, -c) is exactly -fma(a, b, c), so that negated inputs give exactly the negated result. */
#ifdef HARDWARE_FMA
#define FUSE(a, b, c) fma((a), (b), (c))
#else
#define FUSE(a, b, c) ((a) * (b) + (c))
#endif
#define DOT3(ax, ay, az, bx, by, bz) FUSE(ax, bx, FUSE(ay, by, (az) * (bz)))

#endif
