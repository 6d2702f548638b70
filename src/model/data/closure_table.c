/* SPDX-License-Identifier: BSD-3-Clause */
/* Look-ups in the tables of closures: kinds by name, numbers by key. */
#include "model/data/closure_table.h"
#include <string.h>

const kmp_closure_row kmp_closure_table[KMP_CLOSURE_KINDS] = {
    {.name = ""},
#define KMP_CLOSURE(name, needs, force, moment, pressing, balls, figure, urdf, sdf)                                    \
    {#name, KMP_NEEDS_##needs, pressing, balls, KMP_FIGURE_##figure, urdf, sdf},
#define KMP_INNER_CLOSURE KMP_CLOSURE
#include "model/data/closure.h"
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
};

kmp_closure_kind kmp_closure_kind_find(const char *name)
{
    int found = kmp_name_find(KMP_NAMES_OF(kmp_closure_table), name);
    return found < 0 ? KMP_CLOSURE_NONE : (kmp_closure_kind)found;
}

static const kmp_closure_number numbers[KMP_CLOSURE_KINDS] = {
#define KMP_CLOSURE_NUMBER(kind, key, unit, rule, hint, ...)                                                           \
    [KMP_CLOSURE_##kind] = {#key, unit, KMP_FIELD_##rule, hint},
#define KMP_COUPLING_NUMBER(kind, joint_key, unit, key, ...) [KMP_CLOSURE_##kind] = {#key, unit, KMP_FIELD_ANY, ""},
#include "model/data/closure_numbers.def"
#include "model/language/expression.h"
#include "model/language/nearest.h"
};

const kmp_closure_number *kmp_closure_number_of(kmp_closure_kind kind)
{
    return kind < KMP_CLOSURE_KINDS && numbers[kind].key ? &numbers[kind] : NULL;
}

const kmp_number *kmp_closure_length(const kmp_closure *closure)
{
    const kmp_closure_number *row = kmp_closure_number_of(closure->kind);
    return row && closure->number.value > 0 && strcmp(row->unit, "m") == 0 ? &closure->number : NULL;
}
