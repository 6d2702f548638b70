/* SPDX-License-Identifier: BSD-3-Clause */
/* Tyre property files (.tir): sections of keys and values, with the units of the file. */
#pragma once

#include "model/data/tyre.h"
#include "model/read/reading.h"

/** Keys that kmp_tir_file.unused names at most. */
enum { KMP_TIR_FIRST_UNUSED = 6 };

typedef struct kmp_tir_file {
    double value[KMP_TIR_COUNT]; /* SI */
    bool given[KMP_TIR_COUNT];
    kmp_tyre_form form;
    int mode;           /* USE_MODE, not negative; -1: not given */
    bool right;         /* of which side it was measured */
    const char *unused; /* the first keys that the equations do not use; NULL: none */
    int unused_count;   /* of all of them */
} kmp_tir_file;

/** The file that a node names. False after an error. */
bool kmp_tir_read(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_tir_file *tir);
