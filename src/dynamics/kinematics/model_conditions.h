/* SPDX-License-Identifier: BSD-3-Clause */
/* The conditions of a model, which its equations and its runs share. */
#pragma once

#include "dynamics/kinematics/friction_roles.h"
#include "model/language/expression.h"
#include "symbolic/graph.h"

/** A condition of validity: where its value is negative the motion is doubted for this reason, once, without an event.
 */
typedef enum kmp_validity {
    KMP_VALIDITY_NONE,
    KMP_VALIDITY_TABLE,      /* the motion is beyond an end of a table, which has no input */
    KMP_VALIDITY_LEVEL,      /* a level of friction would push */
    KMP_VALIDITY_DEFLECTION, /* a flexible body deflects beyond what its shapes are right for */
    KMP_VALIDITY_ROTATION,   /* a flexible body without terms of second order turns faster than they may be left out */
    KMP_VALIDITY_END
} kmp_validity;

/** A condition: a comparison or a sign in an expression, or one of an element. */
typedef struct kmp_condition {
    const void *of; /* the expression or part of the model that has it: `of` and number identify it */
    int number;
    const kmp_expr *expr; /* NULL: of an element */
    char *text;           /* of an element: its name in the log */
    bool ends;            /* runs end where its value becomes negative; it has no input */
    bool kink;            /* of abs, min or max: the active branch; both branches are equal where it changes */
    bool bend;            /* of abs, min, max or straight lines in a closure: J may jump with it */
    bool rough;           /* its change is not noted; a step that meets it is made again up to it */
    bool silent;          /* its change is not noted */
    kmp_validity validity;
    bool late;          /* a kink whose value depends on accelerations or multipliers */
    bool by_rates;      /* its value depends on qd */
    bool at_start;      /* a run warns of it; the log has it where it holds at the start, too */
    bool measured;      /* the log has the largest value that it had while it was true */
    kmp_role role;      /* of a friction element; otherwise KMP_ROLE_NONE */
    double lag;         /* of an element: it changes where its value has passed zero by this amount; 0: at zero */
    const char *advice; /* where it ends runs, or prevents continuation by changing back and forth; NULL: none */
} kmp_condition;

/** The conditions of a model, numbered in the order of their creation: comparisons and signs of variable quantities. A
 * program for integration takes them as inputs KMP_IN_MODE, which are constant during a step, so that it is smooth. A
 * change of a condition is an event. */
typedef struct kmp_events {
    int count;
    kmp_condition *condition;
    int *place, places; /* 1 + number of each condition by a hash of `of` and `number`, 0: free; 0 places: not kept */
} kmp_events;

/** Arguments of tables whose points may be left, in outputs: the number of the table, the variable, its value. */
typedef struct kmp_table_use {
    int table, variable;
    kmp_ref at;
} kmp_table_use;
