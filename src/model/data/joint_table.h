/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of joints.def and of cuts.def. */
#pragma once

#include "model/language/nearest.h"

#include <stdbool.h>

typedef struct kmp_joint_row {
    const char *name, *chain;
    bool closure; /* it has no chain, and is cut at all times */
} kmp_joint_row;

extern const kmp_joint_row kmp_joint_rows[];
extern const kmp_name_list kmp_joint_names;

/** The kinds of joints that are closures at all times, and the row of one. */
extern const kmp_name_list kmp_always_cut_names;
const kmp_joint_row *kmp_always_cut_row(int kind);

/** The number of motions of a chain. */
int kmp_joint_motions(const kmp_joint_row *row);

/** The key of the number that couples two motions; NULL: there is none. */
const char *kmp_joint_key(const kmp_joint_row *row);

typedef enum kmp_cut_axes { KMP_CUT_NONE, KMP_CUT_SAME, KMP_CUT_BOTH } kmp_cut_axes;

typedef struct kmp_cut_row {
    const char *joint, *closure;
    int rows;
    kmp_cut_axes axes;
} kmp_cut_row;

/** The row of a kind of joint; NULL: it cannot be cut. */
const kmp_cut_row *kmp_cut_row_of(const char *joint);
