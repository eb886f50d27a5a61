/* Evenness of scans (F2): how far the returns on every patch are from one another, and the reference for that.
 *
 * Purpose    The last step of docs/method/f2.md, from the moments of patch_returns.cl to one sum a run of patches.
 * Algorithm  Corners of a patch by halving its triangle (docs/method/patches.md); its three vertices join the moments; the
 *            double sum over pairs is n W2 - 2 W1.M1 + M2 W, about the first vertex.
 * Precision  float64 throughout, but for the squared edges that decide the halving: those are float32 as everywhere.
 *            Corners are exact: float32 vertices, halved at most 28 times.
 * Layout     vertices (V, 3) float m, triangles (T, 3) int, first_patch (T + 1) int, depth (T) uchar.
 */
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#pragma OPENCL FP_CONTRACT OFF

typedef struct {
    double x, y, z;
} Point;

typedef struct {
    Point v[3];
} Corners;

typedef struct {
    global const float *vertices;
    global const int *triangles;
    global const int *first_patch;
    global const uchar *depth;
} Mesh;

static inline Point minus(Point p, Point q)
{
    const Point r = {p.x - q.x, p.y - q.y, p.z - q.z};
    return r;
}

static inline double inner(Point p, Point q)
{
    return p.x * q.x + p.y * q.y + p.z * q.z;
}

static inline Point cross_of(Point p, Point q)
{
    const Point r = {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
    return r;
}

static inline Point middle_of(Point p, Point q)
{
    const Point r = {0.5 * (p.x + q.x), 0.5 * (p.y + q.y), 0.5 * (p.z + q.z)};
    return r;
}

static inline float squared_edge(Point p, Point q)
{
    const Point edge = minus(p, q);
    return (float)inner(edge, edge);
}

/* The triangle of a patch, not before triangle `from`: steps of doubling length, then halving. Triangles without a
 * patch do not exist. */
static inline int triangle_of(global const int *first_patch, int n_triangles, int patch, int from)
{
    int low = from, step = 1;
    while (low + step < n_triangles && first_patch[low + step] <= patch) {
        low += step;
        step *= 2;
    }
    /* first_patch[low] <= patch < first_patch[low + step], where that is one */
    for (; step > 0; step /= 2) {
        if (low + step < n_triangles && first_patch[low + step] <= patch) low += step;
    }
    return low;
}

/* Corners of patch `code` of a triangle, steps 1 to 5 of docs/method/patches.md from code to place. */
static inline Corners corners_of(Mesh mesh, int triangle, int code)
{
    Corners at;
    for (int k = 0; k < 3; ++k) {
        global const float *v = mesh.vertices + 3 * (size_t)mesh.triangles[3 * (size_t)triangle + k];
        const Point p = {v[0], v[1], v[2]};
        at.v[k] = p;
    }
    float q01 = squared_edge(at.v[1], at.v[0]), q12 = squared_edge(at.v[2], at.v[1]),
          q20 = squared_edge(at.v[0], at.v[2]);
    for (int bit = mesh.depth[triangle] - 1; bit >= 0; --bit) {
        Point a = at.v[2], b = at.v[0], c = at.v[1];
        float qab = q20, qbc = q01, qca = q12;
        if (q01 >= q12 && q01 >= q20) {
            a = at.v[0], b = at.v[1], c = at.v[2];
            qab = q01, qbc = q12, qca = q20;
        } else if (q12 >= q20) {
            a = at.v[1], b = at.v[2], c = at.v[0];
            qab = q12, qbc = q20, qca = q01;
        }
        const Point m = middle_of(a, b);
        const float qcm = (2.0f * qca + 2.0f * qbc - qab) / 4.0f;
        const int second = (code >> bit) & 1;
        at.v[0] = second ? m : a;
        at.v[1] = second ? b : m;
        at.v[2] = c;
        q01 = qab / 4.0f;
        q12 = second ? qbc : qcm;
        q20 = second ? qcm : qca;
    }
    return at;
}

/* Reference distances of all patches.
 * One work-item is a chunk of patches. NDRange (chunks), any local size.
 * n_points (T) int, table (n, 3) double, see `spread_table`. Writes distance (P) double, m^2, every entry. */
kernel void measure_references(global const float *vertices, global const int *triangles,
                               global const int *first_patch, global const uchar *depth, int n_triangles,
                               int n_patches, int chunk, global const int *n_points, global const double *table,
                               global double *distance)
{
    const Mesh mesh = {vertices, triangles, first_patch, depth};
    const long first = (long)get_global_id(0) * chunk;
    const int end = (int)min(first + chunk, (long)n_patches);
    int triangle = 0;
    for (int patch = (int)first; patch < end; ++patch) {
        triangle = triangle_of(first_patch, n_triangles, patch, triangle);
        const Corners at = corners_of(mesh, triangle, patch - first_patch[triangle]);
        const Point e = minus(at.v[1], at.v[0]), f = minus(at.v[2], at.v[0]);
        global const double *factor = table + 3 * (size_t)n_points[triangle];
        distance[patch] = inner(e, e) * factor[0] + inner(e, f) * factor[1] + inner(f, f) * factor[2];
    }
}

/* Sums over points: how many, of positions and of weights. */
typedef struct {
    double n, square, weight, weighted_square;
    Point sum, weighted;
} Moments;

/* The point itself joins; `p` from the first vertex. */
static inline void join(Moments *all, Point p, double w)
{
    const double square = inner(p, p);
    all->n += 1.0;
    all->square += square;
    all->weight += w;
    all->weighted_square += w * square;
    all->sum.x += p.x, all->sum.y += p.y, all->sum.z += p.z;
    all->weighted.x += w * p.x, all->weighted.y += w * p.y, all->weighted.z += w * p.z;
}

/* w = 2 - |n . d|, d the direction from the sensor to a vertex, n the direction of `normal`; 2 where either is none. */
static inline double weight_of(Point normal, Point away)
{
    const double squares = inner(normal, normal) * inner(away, away);
    return squares > 0.0 ? 2.0 - fabs(inner(normal, away)) / sqrt(squares) : 2.0;
}

/* Mean distances and reference distances, summed over runs of a position's patches.
 * One work-item is a run: entries run[2 r] to run[2 r + 1] - 1, all of position of_run[r]. NDRange (runs), any local
 * size. positions (S, 3) double m, as rounded to float32; entries as in `PatchReturns` and `ReturnMoments`.
 * Writes out (runs, 3) double: mean distances m^2, references m^2, areas m^2. Deterministic: a run is summed in order. */
kernel void sum_distribution(global const float *vertices, global const int *triangles, global const int *first_patch,
                             global const uchar *depth, int n_triangles, global const double *triangle_area,
                             global const double *distance, global const double *positions, global const int *run,
                             global const int *of_run, global const int *patch, global const int *n_returns,
                             global const double *point_sum, global const double *square_sum,
                             global const double *weight_sum, global const double *weighted_point_sum,
                             global const double *weighted_square_sum, global double *out)
{
    const Mesh mesh = {vertices, triangles, first_patch, depth};
    const size_t me = get_global_id(0);
    global const double *from = positions + 3 * (size_t)of_run[me];
    const Point origin = {from[0], from[1], from[2]};
    double mean = 0.0, reference = 0.0, area = 0.0;
    int triangle = 0;
    for (size_t i = run[2 * me]; i < (size_t)run[2 * me + 1]; ++i) {
        triangle = triangle_of(first_patch, n_triangles, patch[i], triangle);
        const Corners at = corners_of(mesh, triangle, patch[i] - first_patch[triangle]);
        const Point e = minus(at.v[1], at.v[0]), f = minus(at.v[2], at.v[0]), normal = cross_of(e, f);
        const Point none = {0.0, 0.0, 0.0};
        Moments all = {n_returns[i], square_sum[i], weight_sum[i], weighted_square_sum[i],
                       {point_sum[3 * i], point_sum[3 * i + 1], point_sum[3 * i + 2]},
                       {weighted_point_sum[3 * i], weighted_point_sum[3 * i + 1], weighted_point_sum[3 * i + 2]}};
        join(&all, none, weight_of(normal, minus(at.v[0], origin)));
        join(&all, e, weight_of(normal, minus(at.v[1], origin)));
        join(&all, f, weight_of(normal, minus(at.v[2], origin)));
        const double pairs =
            all.n * all.weighted_square - 2.0 * inner(all.weighted, all.sum) + all.square * all.weight;
        mean += pairs / (all.n * (all.n - 1.0));
        reference += distance[patch[i]];
        area += triangle_area[triangle] / (double)(1 << mesh.depth[triangle]);
    }
    out[3 * me] = mean;
    out[3 * me + 1] = reference;
    out[3 * me + 2] = area;
}
