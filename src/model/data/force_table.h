/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of force_kinds.def, for functions that read, print or describe force elements. */
#pragma once

#include "model/data/force.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef enum kmp_field_rule { KMP_FIELD_ANY, KMP_FIELD_NOT_NEGATIVE, KMP_FIELD_POSITIVE } kmp_field_rule;

/** True if a value keeps a rule; "be positive", "not be negative". */
bool kmp_field_fits(kmp_field_rule rule, double value);
const char *kmp_field_rule_words(kmp_field_rule rule);

typedef struct kmp_force_row {
    const char *name, *place, *word;
    int width;
} kmp_force_row;

typedef struct kmp_force_field {
    kmp_force_kind kind;
    const char *key;
    size_t offset; /* of its numbers in kmp_force */
    int size;
    double effort, coordinate, time;
    bool required;
    kmp_field_rule rule;
} kmp_force_field;

extern const kmp_force_row kmp_force_rows[KMP_FORCE_KINDS];
extern const kmp_force_field kmp_force_fields[];
extern const int kmp_force_field_count;

/** The numbers of a field in a force, `size` of them. */
kmp_number *kmp_force_number(kmp_force *force, int field);
const kmp_number *kmp_force_get(const kmp_force *force, int field);

/** `key` as the file has it: "effort" is `torque` for a rotation, `force` for a translation. */
const char *kmp_force_key(const kempe_model *model, const kmp_force *force, const char *key);

/** Point k of an element between points: 0 and through_count + 1 are its ends. */
int kmp_force_point(const kmp_force *force, int k);

/** True if the kind acts between two points; and if it pulls along their line. */
bool kmp_force_is_between(kmp_force_kind kind);
bool kmp_force_is_line(kmp_force_kind kind);

/** True if it has no single value, but three components. */
bool kmp_force_has_components(const kmp_force *force);

/** False for a number that the element does not have: an end of stops, what an expression replaces. */
bool kmp_force_has(const kmp_force *force, int field);
