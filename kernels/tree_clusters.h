/* Boxes of clusters, side by side: boxes (6, stride), x0 y0 z0 x1 y1 z1, metres, local frame; cluster i in column PAD + i.
 *
 * Define   meaning                                                                                  example
 * PAD      columns before the first and after the last cluster, which packets may read              -DPAD=32
 */
#ifndef TLSPLAN_TREE_CLUSTERS_H
#define TLSPLAN_TREE_CLUSTERS_H

/* What lies beside n clusters: read and not looked at, but nothing should be read that was never written. */
static inline void clear_pads(global float *boxes, int stride, int n)
{
    for (int k = 0; k < 6; ++k) {
        global float *row = boxes + k * stride;
        for (int i = 0; i < PAD; ++i) row[i] = row[PAD + n + i] = 0.0f;
    }
}

#endif
