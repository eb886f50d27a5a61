/* The tree: a bounding volume hierarchy of eight children a node, walked front to back.
 *
 * Layout     node i: boxes[(i * 6 + k) * 8 + j], k = x0 y0 z0 x1 y1 z1 of child j, metres, local frame;
 *            children[i * 8 + j] >= 0: a node; < 0: block ~child. An unused child has a box that is inside out
 *            (1e30 .. -1e30): no test passes it. Node 0 is the root.
 * Stack      A level leaves at most 7 siblings behind. STACK is the host's figure for this tree: 7 * levels + 1.
 *
 * Define   meaning                                                       example
 * STACK    entries of the stack a work-item, from the tree's depth       -DSTACK=64
 */
#ifndef TLSPLAN_TREE_H
#define TLSPLAN_TREE_H
#include "lanes.h"

#define NODE_CHILDREN 8

typedef struct {
    int child[STACK];
    float near2[STACK]; /* key of the order: squared distance (tiles) or entry range (rays), metres */
    int size;
} Stack;

/* Push the children in `keep`, the nearest on top. Equal keys: the higher lane on top, always the same one. */
static inline void push_children(Stack *stack, global const int *children, int node, int8 keep, float8 key)
{
    const int *kept = (const int *)&keep;
    const float *keys = (const float *)&key;
    const int bottom = stack->size;
    int size = bottom;
    for (int j = 0; j < NODE_CHILDREN; ++j) {
        if (!kept[j]) continue;
        int at = size++;
        while (at > bottom && stack->near2[at - 1] < keys[j]) {
            stack->near2[at] = stack->near2[at - 1];
            stack->child[at] = stack->child[at - 1];
            --at;
        }
        stack->near2[at] = keys[j];
        stack->child[at] = children[node * NODE_CHILDREN + j];
    }
    stack->size = size;
}

#endif
