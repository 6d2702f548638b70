/* SPDX-License-Identifier: BSD-3-Clause */
/* Look-ups in the tables of joints and of cut joints. */
#include "model/data/joint_table.h"
#include <string.h>

const kmp_joint_row kmp_joint_rows[] = {
#define KMP_JOINT(name, chain) {#name, chain, false},
#include "model/data/joints.def"
#undef KMP_JOINT
};

static const kmp_cut_row cuts[] = {
#define KMP_CUT(joint, closure, rows, axes) {#joint, #closure, rows, KMP_CUT_##axes},
#define KMP_ALWAYS_CUT                      KMP_CUT
#include "model/data/cuts.def"
#undef KMP_CUT
};

static const kmp_joint_row always_cut[] = {
#define KMP_CUT(...)
#define KMP_ALWAYS_CUT(joint, ...) {#joint, "", true},
#include "model/data/cuts.def"
#undef KMP_CUT
};

const kmp_name_list kmp_always_cut_names = {always_cut, sizeof *always_cut, sizeof always_cut / sizeof *always_cut};

const kmp_name_list kmp_joint_names = {kmp_joint_rows, sizeof *kmp_joint_rows,
                                       sizeof kmp_joint_rows / sizeof *kmp_joint_rows};

const kmp_joint_row *kmp_always_cut_row(int kind)
{
    return &always_cut[kind];
}

int kmp_joint_motions(const kmp_joint_row *row)
{
    return (int)strcspn(row->chain, "=") / 2;
}

const char *kmp_joint_key(const kmp_joint_row *row)
{
    const char *sign = strchr(row->chain, '=');
    return sign ? sign + 1 : NULL;
}

const kmp_cut_row *kmp_cut_row_of(const char *joint)
{
    int found = kmp_name_find(KMP_NAMES_OF(cuts), joint);
    return found < 0 ? NULL : &cuts[found];
}
