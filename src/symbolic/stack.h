/* SPDX-License-Identifier: BSD-3-Clause */
/* A stack of node ids, for traversals without recursion. */
#pragma once

#include "base/memory.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct kmp_stack {
    uint32_t *id; /* to be freed with kmp_free */
    uint32_t top, capacity;
} kmp_stack;

/** False: no memory. */
static inline bool kmp_push(kmp_stack *stack, uint32_t id)
{
    if (stack->top == stack->capacity) {
        uint32_t capacity = stack->capacity ? 2 * stack->capacity : 256;
        uint32_t *grown = kmp_realloc(stack->id, capacity, sizeof *grown);
        if (!grown)
            return false;
        stack->id = grown;
        stack->capacity = capacity;
    }
    stack->id[stack->top++] = id;
    return true;
}
