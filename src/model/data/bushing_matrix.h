/* SPDX-License-Identifier: BSD-3-Clause */
/* Stiffness and damping of a bushing as matrices of all six directions: three along, then three about the axes of its
 * first point. */
#pragma once

#include "model/language/expression.h"
#include <stdbool.h>

enum { KMP_BUSHING_SIZE = 6 };

/** Matrices that a bushing may have, in the order of `of`. */
typedef enum kmp_bushing_kind { KMP_BUSHING_STIFFNESS, KMP_BUSHING_DAMPING, KMP_BUSHING_KINDS } kmp_bushing_kind;

/** Entries row by row; zeros where a matrix is absent. */
typedef struct kmp_bushing_matrix {
    kmp_number of[KMP_BUSHING_KINDS][KMP_BUSHING_SIZE * KMP_BUSHING_SIZE];
    bool given[KMP_BUSHING_KINDS];
    bool nonsymmetric; /* it may be: its elastic part has no potential */
} kmp_bushing_matrix;

/** The keys of the matrices, and "11" to "66" of their entries. */
extern const char *const kmp_bushing_keys[KMP_BUSHING_KINDS];
extern const char *const kmp_bushing_entries[KMP_BUSHING_SIZE * KMP_BUSHING_SIZE];

/** An entry above the diagonal that differs from its opposite one, where the matrices must be symmetric; -1: none. */
int kmp_bushing_uneven(const kmp_bushing_matrix *matrix, kmp_bushing_kind kind);

/** The number of the opposite entry. */
int kmp_bushing_opposite(int entry);
