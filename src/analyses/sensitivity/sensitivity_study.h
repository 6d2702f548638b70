/* SPDX-License-Identifier: BSD-3-Clause */
/* Objects of differentiation by parameters: rows of sensitivities.def, and the table of their results. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "analyses/sensitivity/forward.h"
#include "model/data/force.h"
#include "model/data/variant.h"
#include "output/convergence.h"
#include "studies/simulate/observed.h"
#include <kempe/sensitivity.h>

typedef struct kmp_sensitivity_kind kmp_sensitivity_kind;

struct kempe_sensitivity {
    const kmp_sensitivity_kind *kind;
    const kempe_model *model; /* the given one, or the averaged one of its sampled states */
    kempe_system *given;      /* only with `averaged` */
    kmp_averaged *averaged;   /* NULL: the model is the given one */
    kempe_context *context;
    const char *backend;                      /* NULL before it has been chosen */
    const kempe_sensitivity_options *options; /* while it is found */
    const kempe_run_options *run;             /* likewise */
    kmp_variant *variant;
    kempe_system *system; /* of the variant */
    bool integral;        /* the columns are time integrals */
    bool differences;     /* derivatives are differences of runs */
    double slope_error;   /* of these: the largest change of one at twice the step; otherwise 0 */
    unsigned *parts;      /* the requested ones of its outputs; NULL: all */
    kmp_arena arena;      /* of names, note and parameters */
    int count;            /* parameters */
    char **name;
    double *parameter, *size; /* values; sizes, by which tolerances are scaled: the value, 1 where it is zero */
    kmp_columns outputs;      /* all columns of the system */
    int *chosen;              /* columns: the requested ones of them */
    int columns;
    char **column, **unit;
    int rows;
    double *at, *cell; /* rows; rows of kmp_sensitivity_width: a value per column, then count derivatives per column */
    kempe_status status;
    char *reason;   /* "" when ok */
    char *warnings; /* of the computation, one per line */
    char *note;     /* a note in addition to the numbers; NULL: none */
    const char *method, *integrator;
    double rtol, atol, t_end; /* 0: none */
    kempe_slope_work work;
    bool unchecked;        /* without that check, as requested */
    kmp_convergence again; /* of integrated values */
    char *again_name;      /* of the number at its index */
    double backwards;      /* steps */
    double backwards_s;    /* their processor time */
    double kept;           /* bytes */
    double again_s;        /* of the check */
    double build_s, cpu_s; /* a kind adds to the first the time of further derivation */
};

struct kmp_sensitivity_kind {
    const char *name, *row; /* the abscissa of a row: "t", NULL for a single row */
    bool integrals;         /* it has some, and methods */
    kempe_status (*find)(kempe_sensitivity *s);
    void (*outputs)(const kempe_model *model, kmp_text *words); /* the default ones; NULL: the model's */
    bool rests; /* of a state at rest, where sampled states are averaged ones (analyses/derivatives/averaged.h) */
    bool plain; /* columns without a unit are plain numbers; otherwise they are numbers of an unknown one */
    bool holds; /* of a state at rest, where states that change at events are constant */
};

static inline size_t kmp_sensitivity_width(const kempe_sensitivity *s)
{
    return (size_t)s->columns * (1 + (size_t)s->count);
}

static inline double kmp_sensitivity_value(const kempe_sensitivity *s, int row, int column)
{
    return s->cell[(size_t)row * kmp_sensitivity_width(s) + (size_t)column];
}

static inline double kmp_sensitivity_slope(const kempe_sensitivity *s, int row, int column, int k)
{
    return kmp_sensitivity_value(s, row, s->columns + column * s->count + k);
}

/** A column of that name and unit, before there are rows. false: no memory. */
bool kmp_sensitivity_add_column(kempe_sensitivity *s, const char *name, const char *unit);

/** The columns of the requested outputs. false: no memory. */
bool kmp_sensitivity_choose(kempe_sensitivity *s);

/** Fills a row of the chosen columns from q, qd, qdd, lambda and `shown` further outputs, and their derivatives, blocks
 * for each parameter. */
typedef struct kmp_sensitivity_source {
    const double *value[KMP_QUANTITIES + 1], *slope[KMP_QUANTITIES + 1];
    int shown;
} kmp_sensitivity_source;
void kmp_sensitivity_fill(const kempe_sensitivity *s, const kmp_sensitivity_source *source, double *row);

/** A row, to be filled; NULL: no memory. */
double *kmp_sensitivity_add_row(kempe_sensitivity *s, double at);

/** The object before its rows: names, equations, sizes. Both options belong to the caller. `differences`: rolling in
 * space is not an error, and derivatives are then differences of runs. */
kempe_status kmp_sensitivity_begin(const kempe_model *model, const kempe_sensitivity_options *options,
                                   const kempe_run_options *run, bool differences, kempe_sensitivity **sensitivity);

/** Trajectories with their derivatives at the same times, each with other values of the parameters: the equations are
 * derived once. */
typedef struct kmp_slope_runs kmp_slope_runs;

#define KMP_SENSITIVITY(name) extern const kmp_sensitivity_kind kmp_sensitivity_##name;
#include "analyses/sensitivity/sensitivities.def"
#undef KMP_SENSITIVITY
