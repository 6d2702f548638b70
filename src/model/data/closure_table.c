/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/closure_table.h"
#include <string.h>

static const kmp_closure_number rows[] = {
#define KMP_CLOSURE_NUMBER(kind, key, unit, rule, hint, ...) {#kind, #key, unit, KMP_FIELD_##rule, hint},
#define KMP_COUPLING_NUMBER(kind, joint_key, unit, key, ...) {#kind, #key, unit, KMP_FIELD_ANY, ""},
#include "model/data/closure_numbers.def"
};

const kmp_closure_number *kmp_closure_number_of(const char *kind)
{
    int found = kmp_name_find(KMP_NAMES_OF(rows), kind);
    return found < 0 ? NULL : &rows[found];
}

const kmp_number *kmp_closure_length(const kmp_closure *closure)
{
    const kmp_closure_number *row = kmp_closure_number_of(closure->kind);
    return row && closure->number.value > 0 && strcmp(row->unit, "m") == 0 ? &closure->number : NULL;
}
