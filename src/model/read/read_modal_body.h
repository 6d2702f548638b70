/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies whose modes are in a file. */
#pragma once

#include "model/data/flexible.h"
#include "model/flexible/modal_body.h"
#include "model/read/reading.h"

/** A body from a file while it is read: its places are stations, the first one the station of its joint. */
typedef struct kmp_modal_reading {
    const char *path, *body; /* "body 'blade'" */
    kmp_modal_body modal;
    const char **names; /* of the first `named` places, the interfaces */
    int named;
    int *node; /* of the other places */
    kmp_stiffening stiffening;
    const char *doubt; /* what the file lacks; NULL: nothing */
    bool damped;       /* the model has damping, in place of the file's */
} kmp_modal_reading;

/** Reads `file`, `interfaces`, `modes`, `scale` and `stiffening` of a body: in its frame, with the origin at the first
 * interface. NULL: errors are reported. */
kmp_modal_reading *kmp_read_modal_body(kmp_reader *r, const kmp_yaml *map, const char *body, kmp_flexible_frame frame);

/** Reads the place of a point by `interface` or `node`, and its offset. */
void kmp_read_modal_point(kmp_reader *r, kmp_modal_reading *m, const kmp_yaml *node, const char *what,
                          kmp_point *point);

/** Compares the mass of the model's body with the mass of the file. */
void kmp_check_modal_mass(kmp_reader *r, const kmp_modal_reading *m, const kmp_yaml *mass);
