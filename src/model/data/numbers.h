/* SPDX-License-Identifier: BSD-3-Clause */
/* All numbers of a model that its equations and its start may contain, with their names. */
#pragma once

#include "model/data/force_table.h"

/** A number: "crank" "mass" NULL, "crank" "com" "x", "gravity" "" "x". False ends the walk. */
typedef bool kmp_number_visit(void *user, const kmp_number *number, const char *owner, const char *key,
                              const char *part);

/** Visits all numbers; false if a visit has ended the walk. */
bool kmp_numbers_visit(const kempe_model *model, kmp_number_visit *visit, void *user);

/** The rows of wheel_numbers.def. */
typedef struct kmp_wheel_field {
    const char *key;
    size_t offset; /* in kmp_wheel */
    kmp_field_rule rule;
} kmp_wheel_field;

enum {
#define KMP_WHEEL_NUMBER(member, rule) KMP_WHEEL_##member,
#include "model/data/wheel_numbers.def"
#undef KMP_WHEEL_NUMBER
    KMP_WHEEL_FIELDS
};
extern const kmp_wheel_field kmp_wheel_fields[KMP_WHEEL_FIELDS];

/** Numbers of a tyre: the rows of tyre_numbers.def; offsets in kmp_tyre. */
enum {
#define KMP_TYRE_NUMBER(member, rule) KMP_TYRE_##member,
#include "model/data/tyre_numbers.def"
#undef KMP_TYRE_NUMBER
    KMP_TYRE_FIELDS
};
extern const kmp_wheel_field kmp_tyre_fields[KMP_TYRE_FIELDS];
struct kmp_tyre;
const kmp_number *kmp_tyre_get(const struct kmp_tyre *tyre, int field);

/** Elements of a tensor of inertia, as the keys of a body name them. */
extern const char *const kmp_inertia_names[6];
