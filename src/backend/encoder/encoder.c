/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/encoder/encoder.h"
#include "base/memory.h"

void kmp_written_begin(kmp_written_code *c)
{
    c->begin = c->size;
    c->saved = 0;
    c->next_held = 0;
    for (int k = 0; k < KMP_CODE_HELD; k++)
        c->held[k].base = -1;
}

uint8_t *kmp_written_room(kmp_written_code *c, size_t bytes)
{
    if (c->size + bytes > c->capacity) {
        size_t capacity = c->capacity ? 2 * c->capacity : c->expected + 4096;
        uint8_t *code = c->failed ? NULL : kmp_realloc(c->code, capacity, 1);
        if (!code) {
            c->failed = true;
            return NULL;
        }
        c->code = code;
        c->capacity = capacity;
    }
    return c->code + c->size;
}

void kmp_written_free(kmp_written_code *c)
{
    kmp_free(c->code);
    *c = (kmp_written_code){.encoder = c->encoder, .form = c->form};
}
