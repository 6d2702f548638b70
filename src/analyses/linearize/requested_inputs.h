/* SPDX-License-Identifier: BSD-3-Clause */
/* The inputs of state spaces, as users request them. */
#pragma once

#include <kempe/kempe.h>

typedef enum kmp_requested_kind {
    KMP_REQUESTED_EFFORT,    /* on a coordinate */
    KMP_REQUESTED_FORCE,     /* at a point, along an axis of the ground */
    KMP_REQUESTED_DRIVE,     /* the value of a drive's function */
    KMP_REQUESTED_INPUT,     /* of the model */
    KMP_REQUESTED_PARAMETER, /* not looked up */
} kmp_requested_kind;

/** Something that acts on a model. */
typedef struct kmp_requested_input {
    kmp_requested_kind kind;
    int index, axis; /* coordinate, point, closure or input; x, y, z of a force */
    char *name;      /* "force(b.P.x)" */
} kmp_requested_input;

typedef struct kmp_requested_inputs {
    int count;
    kmp_requested_input *input;
} kmp_requested_inputs;

/** Reads "effort(A),force(b.P.x),force(b.P),drive(m),k": the third of these is three inputs. KEMPE_E_ARGUMENT: the
 * invalid word. */
kempe_status kmp_requested_inputs_read(const kempe_model *model, const char *words, kmp_requested_inputs *inputs);
void kmp_requested_inputs_free(kmp_requested_inputs *inputs);
