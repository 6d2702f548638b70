/* SPDX-License-Identifier: BSD-3-Clause */
/* Saved states of an instance. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/fmu_variables.h"

/* A saved state: hash of the model, its bytes, then the pieces below, whose sum is checked. */
typedef struct kempe_fmu_head {
    char hash[24];
    size_t bytes;
    unsigned long sum;
    int kind;
} kempe_fmu_head;

/* The bytes of a state. `to`: saves it there; `from`: restores it, the simulator before what it is to take; NULL: does
 * not. */
static size_t transfer(kempe_fmu *fmu, unsigned char *to, const unsigned char *from)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator *s = &fmu->simulator;
    const struct {
        void *at;
        size_t bytes;
    } piece[] = {{fmu->part.kept, (size_t)kempe_simulator_saved_numbers(s) * sizeof(double)},
                 {&fmu->now, sizeof fmu->now},
                 {&s->settings, sizeof s->settings},
                 {fmu->part.x, 2 * (size_t)e->freedom * sizeof(double)},
                 {fmu->part.start, 2 * (size_t)e->coordinates * sizeof(double)},
                 {s->p, (size_t)e->parameters * sizeof(double)},
                 {s->u, 3 * (size_t)e->inputs * sizeof(double)}};
    size_t used = sizeof(kempe_fmu_head);
    if (to)
        kempe_simulator_save(s, fmu->part.kept);
    for (size_t i = 0; i < sizeof piece / sizeof *piece; used += piece[i++].bytes) {
        if (to && piece[i].bytes)
            memcpy(to + used, piece[i].at, piece[i].bytes);
        else if (from && piece[i].bytes)
            memcpy(piece[i].at, from + used, piece[i].bytes);
        if (from && i == 0)
            kempe_simulator_restore(s, fmu->part.kept);
    }
    return used;
}

size_t kempe_fmu_state_bytes(kempe_fmu *fmu)
{
    return transfer(fmu, NULL, NULL);
}

/* Adler's sum of the bytes after the head. */
static unsigned long sum_of(const unsigned char *state, size_t size)
{
    unsigned long a = 1, b = 0;
    for (size_t i = sizeof(kempe_fmu_head); i < size;) {
        const size_t end = size - i > 5000 ? i + 5000 : size; /* no overflow of 32 bits before the remainder */
        for (; i < end; i++) {
            a += state[i];
            b += a;
        }
        a %= 65521;
        b %= 65521;
    }
    return b << 16 | a;
}

/* The head of a state of this unit with the bytes after it. */
static kempe_fmu_head head_of(kempe_fmu *fmu, const unsigned char *state)
{
    kempe_fmu_head head;
    memset(&head, 0, sizeof head);
    (void)snprintf(head.hash, sizeof head.hash, "%s", fmu->model->equations->hash);
    head.bytes = kempe_fmu_state_bytes(fmu);
    head.sum = sum_of(state, head.bytes);
    head.kind = fmu->kind;
    return head;
}

void kempe_fmu_save(kempe_fmu *fmu, unsigned char *to)
{
    (void)transfer(fmu, to, NULL);
    const kempe_fmu_head head = head_of(fmu, to);
    memcpy(to, &head, sizeof head);
}

kempe_fmu_status kempe_fmu_check_state(kempe_fmu *fmu, const unsigned char *bytes, size_t size)
{
    const int fits = bytes && size == kempe_fmu_state_bytes(fmu);
    kempe_fmu_head head;
    if (fits)
        head = head_of(fmu, bytes);
    if (!fits || memcmp(bytes, &head, sizeof head) != 0)
        return FAIL("The %lu bytes are not a state of this unit: a state belongs to the model and the kind of instance "
                    "that it was taken from.",
                    (unsigned long)size);
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_restore(kempe_fmu *fmu, const unsigned char *from)
{
    const kempe_fmu_status status = kempe_fmu_check_state(fmu, from, kempe_fmu_state_bytes(fmu));
    if (!from || status != KEMPE_FMU_OK)
        return KEMPE_FMU_ERROR;
    (void)transfer(fmu, NULL, from);
    return KEMPE_FMU_OK;
}
