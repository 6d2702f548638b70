/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code for the arithmetic of a scan (scan.h): the operations between two functions at once, for places side by
 * side in registers. Values that nothing else reads stay there. */
#pragma once

#include "base/clones.h"
#include "symbolic/program_forms.h"
#include <stddef.h>

enum { KMP_ROW_FIRST = 1, KMP_ROW_LAST = 2 }; /* stages of a program that depend on places */

/** Values by slot depend on arguments and on places, values by place depend only on places. All other values are equal
 * in all lanes. */
typedef enum kmp_row_base { KMP_ROW_BY_SLOT, KMP_ROW_BY_PLACE, KMP_ROW_EQUAL, KMP_ROW_BASES } kmp_row_base;

/** The place of a value: numbers after the first of its base. */
typedef struct kmp_row_address {
    kmp_row_base base;
    int32_t at;
} kmp_row_address;

/** From the first slot, the first place, and the values that are equal in all lanes. */
typedef void KMP_MACHINE_CODE kmp_row_routine(double *slots, const double *places, const double *equal);

/** The instructions by slot in [first, end). */
typedef struct kmp_row_piece {
    int first, end;
    kmp_row_routine *run;
} kmp_row_piece;

/** The code of a program, which owns it. */
typedef struct kmp_row_code {
    kmp_program_form form;
    int lanes; /* that a call computes: 4 or 8 */
    int count;
    kmp_row_piece *piece; /* in the program's order */
} kmp_row_code;

/** The code for rows of `width` numbers; all scans of a program with this width have these addresses of values. NULL:
 * there is none on this machine, or no memory. */
const kmp_row_code *kmp_row_code_of(const kmp_program *program, size_t width, const kmp_row_address *address);
