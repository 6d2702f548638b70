/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of closure_kinds.def and closure_numbers.def: all that depends on the kind of a closure. */
#pragma once

#include "model/data/closure.h"
#include "model/data/force_table.h"

typedef enum kmp_closure_needs {
    KMP_NEEDS_NOTHING,
    KMP_NEEDS_NUMBER,
    KMP_NEEDS_AXIS,
    KMP_NEEDS_SAME_AXIS,
    KMP_NEEDS_TWO_AXES,
    KMP_NEEDS_SHAFTS,
    KMP_NEEDS_FOLLOWER,
    KMP_NEEDS_CURVE,
    KMP_NEEDS_TERMS,
    KMP_NEEDS_EXPRESSION,
    KMP_NEEDS_GEARS,
    KMP_NEEDS_COUPLING,
    KMP_NEEDS_DRIVE,
    KMP_NEEDS_WHEEL,
    KMP_NEEDS_MODES
} kmp_closure_needs;

typedef enum kmp_closure_figure { KMP_FIGURE_POINTS, KMP_FIGURE_HINGE, KMP_FIGURE_LINE } kmp_closure_figure;

typedef struct kmp_closure_row {
    const char *name;
    kmp_closure_needs needs;
    int pressing, balls;
    kmp_closure_figure figure;
    const char *urdf, *sdf; /* NULL: none */
} kmp_closure_row;

extern const kmp_closure_row kmp_closure_table[KMP_CLOSURE_KINDS];

/** KMP_CLOSURE_NONE when no kind has that name. */
kmp_closure_kind kmp_closure_kind_find(const char *name);

static inline const kmp_closure_row *kmp_closure_row_of(const kmp_closure *closure)
{
    return &kmp_closure_table[closure->kind < KMP_CLOSURE_KINDS ? closure->kind : KMP_CLOSURE_NONE];
}

/** The word for its kind. */
static inline const char *kmp_closure_word(const kmp_closure *closure)
{
    return kmp_closure_row_of(closure)->name;
}

/** True if it prescribes a coordinate: a drive or a lock. */
static inline bool kmp_closure_is_drive(const kmp_closure *closure)
{
    return kmp_closure_row_of(closure)->needs == KMP_NEEDS_DRIVE;
}

/** True for the row of friction that sticks or of a rigid contact (kmp_force_has_modes). */
static inline bool kmp_closure_is_of_modes(const kmp_closure *closure)
{
    return kmp_closure_row_of(closure)->needs == KMP_NEEDS_MODES;
}

/** True for the row of friction that sticks (kmp_force_sticks). */
static inline bool kmp_closure_is_friction(const kmp_closure *closure)
{
    return closure->kind == KMP_CLOSURE_friction;
}

typedef struct kmp_closure_number {
    const char *key, *unit;
    kmp_field_rule rule;
    const char *hint;
} kmp_closure_number;

/** Returns the number that a kind of closure takes; NULL if it takes none. */
const kmp_closure_number *kmp_closure_number_of(kmp_closure_kind kind);

/** A closure's number if that is a positive length, which is characteristic of the mechanism; NULL: it has none. */
const kmp_number *kmp_closure_length(const kmp_closure *closure);
