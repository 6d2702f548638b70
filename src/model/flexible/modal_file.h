/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of the format kempe-flexible-1: a body with modes as arrays in an .npz. */
#pragma once

#include "model/flexible/modal_body.h"

/** Units of a file in SI; 0: the file says them. */
typedef struct kmp_modal_units {
    double length, mass;
} kmp_modal_units;

/** The content of a file. `first`: it has terms of second order. */
typedef struct kmp_modal_file {
    kmp_modal_body body;
    const char **names; /* of the body's places */
    bool first;
} kmp_modal_file;

/** Units of length, mass and time in SI, from words such as "m kg s" and "mm t s". False: they are others. */
bool kmp_modal_units_find(const char *words, double units[3]);

/** Reads and checks all arrays, into the arena. False: `why` names the array, the number and what to do; or there is no
 * memory. */
bool kmp_modal_file_read(kmp_arena *arena, const char *bytes, size_t length, const kmp_modal_units *units,
                         kmp_modal_file *file, kmp_text *why);
