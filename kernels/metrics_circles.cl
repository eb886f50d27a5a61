/* F3 of all pairs of positions: the share of a position's circle that another one's covers, in plan.
 *
 * Purpose    The paper's Eq. 3 for every pair, docs/method/f3-overlap.md.
 * Algorithm  Two circles with radii r, s whose middles are d apart share two segments on either side of their chord:
 *
 *                 .--.-.--.          d_r = (d^2 + r^2 - s^2) / 2 d, d_s = d - d_r: middles to chord, signed
 *                /  ( | )  \         area = r^2 acos(d_r / r) - d_r h + s^2 acos(d_s / s) - d_s h,  h = sqrt(r^2 - d_r^2)
 *                \  ( | )  /         d >= r + s: nothing; d <= |r - s|: the smaller circle, where the form above fails
 *                 '--'-'--'
 *
 * Precision  REAL; float32 is off by 1e-6 of a circle at most.
 *
 * Define     meaning                                                       example
 * DOUBLES    1: float64 throughout, 0: float32                             -DDOUBLES=1
 */
#if DOUBLES
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double real;
#define PI M_PI
#else
typedef float real;
#define PI M_PI_F
#endif
#pragma OPENCL FP_CONTRACT OFF

/* Area of a circle of radius r beyond a chord at the signed distance `to_chord` from its middle. */
static inline real segment(real r, real to_chord)
{
    const real share = to_chord / r;
    const real within = share > (real)1 ? (real)1 : share < (real)-1 ? (real)-1 : share;
    return r * r * (acos(within) - within * sqrt((real)1 - within * within));
}

/* Shares of circles that other ones cover.
 * One work-item is one row of the result. NDRange (n), any local size. position (n, 2) and radius (n) real, m; floor (n)
 * int: circles of different floors share nothing. Writes share (n, n) real: [i, j], shared area / area of i's circle. */
kernel void share_circles(global const real *position, global const real *radius, global const int *floor_of, int n,
                          global real *share)
{
    const size_t i = get_global_id(0);
    const real x = position[2 * i], y = position[2 * i + 1], r = radius[i];
    for (size_t j = 0; j < (size_t)n; ++j) {
        const real dx = position[2 * j] - x, dy = position[2 * j + 1] - y, s = radius[j];
        const real d = sqrt(dx * dx + dy * dy);
        real area = (real)0;
        if (floor_of[j] == floor_of[i] && d < r + s) {
            if (d <= fabs(r - s)) {
                area = (r < s ? r * r : s * s) * (real)PI;
            } else {
                const real d_r = (d * d + r * r - s * s) / (d + d);
                area = segment(r, d_r) + segment(s, d - d_r);
            }
        }
        share[i * n + j] = area / (r * r * (real)PI);
    }
}
