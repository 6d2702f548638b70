/* SPDX-License-Identifier: BSD-3-Clause */
/* One adapter for the time integrators of SUNDIALS: an ODE or a DAE behind its vectors, matrices and callbacks, steps
 * that the formulation may reject, dense output, counters and failures. A package is a row that names its functions. */
#pragma once

#include "constraints/sundials_compat.h"
#include "integrators/steppers/solver.h"
#include <stdbool.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>

typedef struct kmp_sun kmp_sun;

/** A flag of a package, as a sentence. `shorter`: a shorter step may help, which the package does not try itself. */
typedef struct kmp_sun_flag {
    int flag;
    const char *meaning;
    bool shorter;
} kmp_sun_flag;

#define KMP_SUN_TOO_FINE "the tolerance is finer than double precision can follow"
#define KMP_SUN_NOT_SMOOTH                                                                                             \
    "the error test failed repeatedly down to the smallest step; the solution may not be smooth here"
#define KMP_SUN_NOT_FACTORED  "the iteration matrix could not be factored"
#define KMP_SUN_NOT_EVALUATED "the right-hand side could not be evaluated, even with the smallest step"
#define KMP_SUN_OUT_OF_MEMORY "out of memory"

/** The flags of a package for ODEs, CV or ARK, and the end of the table. */
#define KMP_SUN_ODE_FLAGS(package, not_converged, may_be_shorter)                                                      \
    {package##_TOO_MUCH_ACC, KMP_SUN_TOO_FINE, false}, {package##_ERR_FAILURE, KMP_SUN_NOT_SMOOTH, false},             \
        {package##_CONV_FAILURE, not_converged " down to the smallest step", false},                                   \
        {package##_LSETUP_FAIL, KMP_SUN_NOT_FACTORED, false}, {package##_LSOLVE_FAIL, KMP_SUN_NOT_FACTORED, false},    \
        {package##_FIRST_RHSFUNC_ERR, KMP_SUN_NOT_EVALUATED, may_be_shorter},                                          \
        {package##_REPTD_RHSFUNC_ERR, KMP_SUN_NOT_EVALUATED, may_be_shorter},                                          \
        {package##_UNREC_RHSFUNC_ERR, KMP_SUN_NOT_EVALUATED, may_be_shorter},                                          \
        {package##_MEM_FAIL, KMP_SUN_OUT_OF_MEMORY, false},                                                            \
    {                                                                                                                  \
        0, NULL, false                                                                                                 \
    }

/** Reads one counter; NULL: there is none. A set of counters is in the order of kmp_solver_work. */
typedef int kmp_sun_counter(void *memory, long *count);
enum { KMP_SUN_COUNTERS = sizeof(kmp_solver_work) / sizeof(long) };

/** Functions return flags of the package: negative ones are failures. */
typedef struct kmp_sun_package {
    const char *name;
    const kmp_sun_flag *flags; /* ends with the row without text */
    int refused;               /* flag of a step that cannot become any shorter */
    char *(*flag_name)(long flag);
    void (*release)(void **memory);

    /** Makes s->memory (NULL: no memory) and sets it up. */
    int (*configure)(kmp_sun *s);

    /** Starts at t with the vectors of s; discards the history and the counters. */
    int (*begin)(kmp_sun *s, double t);

    /** Restarts one-step methods at (t, y), keeping counters and step control; NULL: not available. */
    int (*reset)(void *memory, double t, N_Vector y);
    int (*set_first_step)(void *memory, double h);
    int (*set_end)(void *memory, double t);

    /** The length of the next step; NULL: it need not be known. */
    int (*planned)(void *memory, double *h);
    int (*advance)(kmp_sun *s, double *t);
    int (*derivative)(void *memory, double t, int order, N_Vector out);

    /** The degree of the last step's polynomial; NULL: at most KMP_SUN_DEGREE. */
    int (*degree)(void *memory, int *degree);
} kmp_sun_package;

/** Highest degree of ARKODE's interpolants, and of the interpolants of all packages. */
enum { KMP_SUN_DEGREE = 5, KMP_SUN_MOST_DEGREE = 12 };

/** The user data of all callbacks. */
struct kmp_sun {
    kmp_solver base; /* first */
    const kmp_solver_kind *kind;
    const kmp_sun_package *package;
    kmp_sun_counter *const *counter;
    int n;
    SUNContext sun;
    void *memory;
    N_Vector y, yp, out;          /* yp: of a DAE */
    SUNMatrix matrix;             /* dense for an ODE, sparse for a DAE; NULL for explicit methods */
    SUNLinearSolver linear;       /* dense for an ODE, sparse for a DAE; NULL for explicit methods */
    SUNNonlinearSolver iteration; /* a package's own choice; NULL: its default */
    void *controller;             /* of the steps; NULL: the package's own */
    double *y_old, *yp_old;       /* n: at the start of a step */
    double *dy, *w;               /* n */
    double *node;                 /* 2 (KMP_SUN_MOST_DEGREE + 1) n: y, and yp, at nodes of a received step */
    int degree;                   /* of that step */
    bool received;                /* the last step is another solver's */
    bool halted;                  /* the formulation gave up in a callback */
    bool moved;                   /* the formulation has corrected y: reset before the next step */
    struct {
        double before, node[5]; /* integrands where the last step but one began, and at the nodes of the last */
        bool close;             /* at all nodes, otherwise at the ends */
        double h, given, size;  /* length of the last step; the package's value; sum of sizes of all parts */
        double t, rate;         /* the last evaluation */
        long steps, spent;      /* since creation; the ones of them that were integrated closely */
    } integral;                 /* the last of y, where the package does not control its error */
    kmp_solver_work more;       /* work not counted by the package: earlier starts, evaluations, rejected steps */
};

/* Callbacks; user is the kmp_sun. KMP_RETRY becomes a recoverable failure, KMP_HALT a fatal one. */
int kmp_sun_rhs(sunrealtype t, N_Vector y, N_Vector dy, void *user);
int kmp_sun_jacobian(sunrealtype t, N_Vector y, N_Vector dy, SUNMatrix j, void *user, N_Vector w1, N_Vector w2,
                     N_Vector w3);

/** s->out filled with the absolute tolerances, for a package to copy. */
N_Vector kmp_sun_atol(kmp_sun *s);

/* Functions common to all kinds. */
void *kmp_sun_create(const kmp_solver_kind *kind, const kmp_solver_setup *setup);
void kmp_sun_release(void *solver);
kempe_status kmp_sun_start(void *solver, double t, const double *y, const double *yp, double t_end, double h0);
kempe_status kmp_sun_extend(void *solver, double t_end);
kempe_status kmp_sun_step(void *solver);

/** Takes the last step of a one-step method back: the next one has the length h. */
void kmp_sun_undo(void *solver, double h);
kempe_status kmp_sun_dense(void *solver, double t, double *y, double *yp);
void kmp_sun_transfer(void *solver, kmp_number_stream *stream);

/** The functions of a kind, whose method is a kmp_sun_package. */
#define KMP_SUN_FUNCTIONS                                                                                              \
    .create = kmp_sun_create, .release = kmp_sun_release, .start = kmp_sun_start, .extend = kmp_sun_extend,            \
    .step = kmp_sun_step, .dense = kmp_sun_dense, .transfer = kmp_sun_transfer

/** Writes the pattern of a DAE's matrix. */
void kmp_sun_put_pattern(const kmp_dae *dae, SUNMatrix a);

/** A serial vector of n numbers with Kempe's arithmetic, and its clones. For a small mechanism the
 * vector operations of an implicit integrator between two evaluations cost more than the equations. NULL: no memory.
 * N_VDestroy frees it. */
N_Vector kmp_vector_new(sunindextype n, SUNContext context);
