/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of values in expressions in addition to coordinates: algebraic variables, which are solved wherever they are
 * needed, and expressions under a name. */
#ifndef KMP_MODEL_ALGEBRAIC_H
#define KMP_MODEL_ALGEBRAIC_H

#include "model/expressions/expression.h"
#include <stdbool.h>

enum { KMP_UNKNOWNS_MOST = 6 };

typedef struct kmp_unknowns {
    const char *name;
    int count; /* 0: an expression under a name */
    bool late; /* depends on multipliers: read after the closures */
    const char *unknown[KMP_UNKNOWNS_MOST];
    kmp_number guess[KMP_UNKNOWNS_MOST];
    const kmp_expr *zero[KMP_UNKNOWNS_MOST]; /* one per variable; a named expression is the first; NULL: not read */
    const kmp_expr *leaves;                  /* all that occurs in them but operations, added up; NULL: nothing yet */
} kmp_unknowns;

/** The names that expressions use: of the variables, or of the expression. */
static inline kmp_name_list kmp_unknown_names(const kmp_unknowns *u)
{
    return u->count > 0 ? KMP_NAMES(u->unknown, u->count) : KMP_NAMES(&u->name, 1);
}

#endif
