/* SPDX-License-Identifier: BSD-3-Clause */
/* Saved states of an instance. A part of kempe_fmu.c. */
#ifndef FMU_SAVED_H
#define FMU_SAVED_H

#include "generate/runtime/fmu/fmu_variables.h"

/* A saved state: hash of the model, its bytes, then the pieces below, whose sum is checked. */
typedef struct kempe_fmu_head {
    char hash[24];
    size_t bytes;
    unsigned long sum;
    int kind;
} kempe_fmu_head;

typedef struct kempe_fmu_piece {
    void *at;
    size_t bytes;
} kempe_fmu_piece;

enum { KEMPE_FMU_PIECES = 6 };

static void list_pieces(kempe_fmu *fmu, kempe_fmu_piece *piece)
{
    const kempe_equations *e = fmu->model->equations;
    const kempe_fmu_piece all[KEMPE_FMU_PIECES] = {{&fmu->now, sizeof fmu->now},
                                                   {&fmu->simulator.settings, sizeof fmu->simulator.settings},
                                                   {fmu->part.x, 2 * (size_t)e->freedom * sizeof(double)},
                                                   {fmu->part.start, 2 * (size_t)e->coordinates * sizeof(double)},
                                                   {fmu->simulator.p, (size_t)e->parameters * sizeof(double)},
                                                   {fmu->simulator.u, 3 * (size_t)e->inputs * sizeof(double)}};
    memcpy(piece, all, sizeof all);
}

static size_t simulator_bytes(const kempe_fmu *fmu)
{
    return (size_t)kempe_simulator_saved_numbers(&fmu->simulator) * sizeof(double);
}

size_t kempe_fmu_state_bytes(kempe_fmu *fmu)
{
    kempe_fmu_piece piece[KEMPE_FMU_PIECES];
    size_t bytes = sizeof(kempe_fmu_head) + simulator_bytes(fmu);
    list_pieces(fmu, piece);
    for (int i = 0; i < KEMPE_FMU_PIECES; i++)
        bytes += piece[i].bytes;
    return bytes;
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
    kempe_fmu_piece piece[KEMPE_FMU_PIECES];
    unsigned char *state = to;
    list_pieces(fmu, piece);
    to += sizeof(kempe_fmu_head);
    kempe_simulator_save(&fmu->simulator, fmu->part.kept);
    memcpy(to, fmu->part.kept, simulator_bytes(fmu));
    to += simulator_bytes(fmu);
    for (int i = 0; i < KEMPE_FMU_PIECES; to += piece[i++].bytes)
        if (piece[i].bytes)
            memcpy(to, piece[i].at, piece[i].bytes);
    const kempe_fmu_head head = head_of(fmu, state);
    memcpy(state, &head, sizeof head);
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
    kempe_fmu_piece piece[KEMPE_FMU_PIECES];
    const kempe_fmu_status status = kempe_fmu_check_state(fmu, from, kempe_fmu_state_bytes(fmu));
    if (!from || status != KEMPE_FMU_OK)
        return KEMPE_FMU_ERROR;
    list_pieces(fmu, piece);
    from += sizeof(kempe_fmu_head);
    memcpy(fmu->part.kept, from, simulator_bytes(fmu));
    kempe_simulator_restore(&fmu->simulator, fmu->part.kept);
    from += simulator_bytes(fmu);
    for (int i = 0; i < KEMPE_FMU_PIECES; from += piece[i++].bytes)
        if (piece[i].bytes)
            memcpy(piece[i].at, from, piece[i].bytes);
    return KEMPE_FMU_OK;
}

#endif
