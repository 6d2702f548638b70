/* SPDX-License-Identifier: BSD-3-Clause */
/* What derivatives by parameters are found of: rows of sensitivities.def, a file each, and the table that they leave.
 */
#ifndef KMP_STUDIES_SENSITIVITY_SENSITIVITY_H
#define KMP_STUDIES_SENSITIVITY_SENSITIVITY_H

#include "derivatives/parameter_slopes.h"
#include "model/variant.h"
#include "output/convergence.h"
#include "studies/simulate/columns.h"
#include <kempe/sensitivity.h>

typedef struct kmp_sensitivity_kind kmp_sensitivity_kind;

struct kempe_sensitivity {
    const kmp_sensitivity_kind *kind;
    const kempe_model *model;
    kempe_context *context;
    const kempe_sensitivity_options *ask; /* while it is found */
    kmp_variant *variant;
    kempe_system *system; /* of the variant */
    unsigned *parts;      /* of its outputs those that were asked for; NULL: all */
    int count;            /* parameters */
    char **name;
    double *parameter, *size; /* values; sizes, by which tolerances are scaled: the value, 1 where it is zero */
    int columns;
    char **column, **unit;
    int rows, room;
    double *at, *value, *slope; /* rows; rows x columns; rows x columns x count */
    kempe_status status;
    char *reason;   /* "" when ok */
    char *warnings; /* of the computation, one a line */
    char *note;     /* what is to be said beside the numbers; NULL: nothing */
    const char *method, *integrator;
    double rtol, atol, t_end; /* 0: none */
    kempe_slope_work work;
    kmp_convergence again; /* of those that are integrated */
    char *again_name;      /* of the number at its index */
    double backwards;      /* steps */
    double kept;           /* bytes */
    double again_s;        /* of the check */
    double build_s, cpu_s; /* a kind adds to the first what it takes to derive more */
};

struct kmp_sensitivity_kind {
    const char *name, *row; /* what a row stands at: "t", NULL where there is but one */
    bool integrals;         /* it has some, and methods */
    kempe_status (*find)(kempe_sensitivity *s);
    void (*outputs)(const kempe_model *model, kmp_text *words); /* where none are asked for; NULL: the model's */
};

/** A column of that name and unit, before there are rows. false: no memory. */
bool kmp_sensitivity_add_column(kempe_sensitivity *s, const char *name, const char *unit);

/** A row, to be filled: *value has a place a column, *slope count a column. false: no memory. */
bool kmp_sensitivity_add_row(kempe_sensitivity *s, double at, double **value, double **slope);

#define KMP_SENSITIVITY(name) extern const kmp_sensitivity_kind kmp_sensitivity_##name;
#include "studies/sensitivity/sensitivities.def"
#undef KMP_SENSITIVITY

#endif
