/* The tree: a bounding volume hierarchy of eight children a node, walked front to back.
 *
 * Layout     node i: boxes[(i * 6 + k) * 8 + j], k = x0 y0 z0 x1 y1 z1 of child j, metres, local frame;
 *            children[i * 8 + j] >= 0: a node; < 0: block ~child. An unused child has a box that is inside out
 *            (1e30 .. -1e30): no test passes it. Node 0 is the root.
 * Stack      A level leaves at most 7 siblings behind. STACK is the host's figure for this tree: 7 * levels + 1.
 *
 * Define   meaning                                                       example
 * PREFETCH 1 where the device takes hints about memory (a CPU) and    -DPREFETCH=1
 *          the tree does not fit into its caches; else 0, as without
 * STACK    entries of the stack a work-item, from the tree's depth       -DSTACK=64
 */
#ifndef TLSPLAN_TREE_H
#define TLSPLAN_TREE_H
#include "block.h"

#ifndef PREFETCH
#define PREFETCH 0
#endif

#define NODE_CHILDREN 8
#define NO_CHILD 0x7fffffff

/* Ask for what will be met next, where the tree is larger than a processor's caches: a walk through 2.6 million triangles
 * waits for memory half of its time. */
static inline void fetch_ahead(int child, global const float *boxes, global const float *geometry,
                               global const int *children, global const int *triangles)
{
#if PREFETCH
#define FETCH_LINE(p) __builtin_prefetch((const void *)(size_t)(p)) /* OpenCL's `prefetch` does nothing in PoCL */
    if (child >= 0) {
        global const float *b = boxes + (size_t)child * (6 * NODE_CHILDREN);
        for (int k = 0; k < 6 * NODE_CHILDREN; k += 16) FETCH_LINE(b + k);
        FETCH_LINE(children + (size_t)child * NODE_CHILDREN);
    } else {
        global const float *g = geometry + (size_t)~child * (BLOCK_FLOATS * BLOCK_LANES);
        for (int k = 0; k < BLOCK_FLOATS * BLOCK_LANES; k += 16) FETCH_LINE(g + k);
        FETCH_LINE(triangles + (size_t)~child * BLOCK_LANES);
    }
#endif
}

/* Entries are written eight at a time, so that there is room above the top. The low three bits of a key name the child's
 * lane in its node, the rest is the key of the order: squared distance (tiles) or entry range (rays), metres, as the bits
 * of a positive float, too small by up to seven ulp: something may be looked at in vain, nothing is missed. */
typedef struct {
    int key[STACK + NODE_CHILDREN];
    int from[STACK + NODE_CHILDREN]; /* the node, or what the walk finds it by */
    int size;
} Stack;

/* One step of the sorting network: lanes that differ in bit j; `upper` is where the smaller one belongs. */
#define EXCHANGE(x, swapped, upper)                                                                                   \
    do {                                                                                                              \
        const int8 other = swapped, greater = MOST(x, other), smaller = LEAST(x, other);                              \
        x = PICK((int8)upper, smaller, greater);                                                                      \
    } while (0)

/* Greatest first. Batcher's bitonic network. */
static inline int8 sort8(int8 x)
{
    EXCHANGE(x, x.s10325476, (0, -1, -1, 0, 0, -1, -1, 0));
    EXCHANGE(x, x.s23016745, (0, 0, -1, -1, -1, -1, 0, 0));
    EXCHANGE(x, x.s10325476, (0, -1, 0, -1, -1, 0, -1, 0));
    EXCHANGE(x, x.s45670123, (0, 0, 0, 0, -1, -1, -1, -1));
    EXCHANGE(x, x.s23016745, (0, 0, -1, -1, 0, 0, -1, -1));
    EXCHANGE(x, x.s10325476, (0, -1, 0, -1, 0, -1, 0, -1));
    return x;
}

/* Minus the number of lanes in a mask. */
static inline int minus_count8(int8 mask)
{
    const int4 half4 = mask.lo + mask.hi;
    const int2 half2 = half4.lo + half4.hi;
    return half2.x + half2.y;
}

static inline int8 named_keys(float8 key)
{
    return (as_int8(key) & ~7) | (int8)(0, 1, 2, 3, 4, 5, 6, 7);
}

/* Push children by their keys in order, greatest first; those not `kept` come last. `from` is what they are found by. */
static inline void push_sorted(Stack *stack, int from, int8 kept, int8 sorted)
{
    STORE8I(sorted, stack->key + stack->size);
    STORE8I((int8)(from), stack->from + stack->size);
    stack->size -= minus_count8(kept);
}

/* Push the children in `keep`, nearer ones higher. Equal keys: the lower lane is nearer, always the same one. No branch
 * depends on the data: a processor's wrong guess costs as much as all of this. */
static inline void push_children(Stack *stack, int from, int8 keep, float8 key)
{
    push_sorted(stack, from, keep, sort8(PICK(keep, named_keys(key), (int8)(-1))));
}

/* Take the nearest child off a stack of nodes; NO_CHILD where it is empty. */
static inline int pop_child(Stack *stack, global const int *children)
{
    if (stack->size == 0) return NO_CHILD;
    const int at = --stack->size;
    return children[stack->from[at] * NODE_CHILDREN + (stack->key[at] & 7)];
}

#endif
