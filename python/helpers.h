/* SPDX-License-Identifier: BSD-3-Clause */
/* C parts of the Python package: interrupts of long computations, the hash of a model, and evaluation of many states
 * without Python between them. generate_bindings.py reads the declarations. */
#pragma once

#include <kempe/derivatives.h>
#include <kempe/output_handles.h>
#include <kempe/stepper.h>
#include <kempe/workspace.h>

/** The state that a guarded computation restores at its end. */
typedef struct python_guard {
    kempe_context *context, *outer;
} python_guard;

/** From here on SIGINT also interrupts the context; NULL: nothing changes. Guards may be nested. Python's own handler
 * is called as well. Only for the main thread. */
void python_guard_begin(python_guard *guard, kempe_context *context);

/** Restores the handler. An interrupt that the computation did not see is withdrawn: Python raises KeyboardInterrupt
 * for it. Returns the status that it is given. */
kempe_status python_guard_end(python_guard *guard, kempe_status status);

/** The log of a context goes to Python's python_log from now on; notes only while they are wanted. */
void python_listen(kempe_context *context, void *user);
void python_want_notes(int wanted);

/** Versions of SUNDIALS and KLU, the back end of this processor, names of integrators and linear solvers;
 * libraries of searches that were there when it was built. */
const char *python_sundials(void);
const char *python_klu(void);
const char *python_backend(void);
const char *python_integrators(void);
const char *python_linear_solvers(void);
const char *python_searches(void);

/** The hash of a model with all its files and values, as a result folder has it: 64 characters and a zero. */
kempe_status python_model_hash(const kempe_model *model, char *hash);

/** The entries of a document in the model language as JSON: every scalar is a text, an empty one null. */
kempe_status python_document(kempe_context *context, const char *text, const char *label, char **json);

/** The start of a model as JSON: `q` and `qd` with the coordinates whose values are given, `hold` without
 * deformations, `goals`, `statics`, and `states` with all values. */
kempe_status python_start(const kempe_model *model, char **json);

/** Many states: `count` rows of q, qd, ..; NULL as for a single state. `t` has a value for each row, or one for all
 * (t_step 0). Results, matrices column-major, are rows too; NULL: not wanted. */
typedef struct python_states {
    int count, n, m, t_step;
    const double *t, *q, *qd, *qdd, *Q;
    double *mass, *bias, *h, *jacobian, *jdqd; /* n x n, n, m, m x n, m */
    double *accelerations, *multipliers;       /* n, m */
    double *forces;                            /* n */
    double *qdd_q, *qdd_qd, *qdd_Q;            /* kempe_workspace_derivatives */
    double *lambda_q, *lambda_qd, *lambda_Q;
    double *udd_u, *udd_ud, *udd_Q, *q_u, *qd_u;
    double *qdd_p, *lambda_p, *udd_p, *q_p, *qd_p;
    double *y, *y_q, *y_qd, *y_Q, *y_p, *y_u, *y_ud, *y_up;
    const double *by_qdd, *by_lambda, *by_y, *by_q, *by_qd; /* weights, for Hessians */
    int direction_count;
    const kempe_state_direction *directions; /* of all states */
    double *hessians;                        /* direction_count x direction_count */
    double *logarithm, *by_u, *by_uu;        /* of the determinant of the loops: 1, p, p x p */
    kempe_context *guarded;                  /* SIGINT ends the computation; NULL: it does not */
    int failed;                              /* the first state that failed; -1: none */
} python_states;

/** M, C, h, J, jdqd of every state; accelerations and multipliers, their derivatives and Hessians; generalized forces.
 * Each ends at the first state that fails, with its status. */
kempe_status python_evaluate_states(kempe_workspace *workspace, python_states *states);
kempe_status python_forward_states(kempe_workspace *workspace, python_states *states);
kempe_status python_derivative_states(kempe_workspace *workspace, python_states *states);
kempe_status python_hessian_states(kempe_workspace *workspace, python_states *states);
kempe_status python_determinant_states(kempe_workspace *workspace, python_states *states);
kempe_status python_inverse_states(kempe_workspace *workspace, python_states *states);

/** One state at a time, to compare. */
kempe_status python_evaluate_each(kempe_workspace *workspace, python_states *states);
kempe_status python_forward_each(kempe_workspace *workspace, python_states *states);

/** Steppers of one system that go one after another to separate times, with inputs that are constant meanwhile.
 * A stepper whose time is NaN stays where it is. Each has its status: a failure of one is none of the others. */
typedef struct python_steppers {
    int count, input_count, value_count;
    kempe_stepper *const *steppers;
    kempe_outputs *outputs;
    const int *inputs;                /* numbers of the inputs that are set */
    const double *actions;            /* count x input_count; NULL: no input is set */
    const double *t;                  /* count */
    double *values;                   /* count x value_count: outputs where each stepper is then */
    int *statuses;                    /* count */
    kempe_context *context, *guarded; /* of the system; the same where SIGINT ends the computation, or NULL */
} python_steppers;

/** KEMPE_STOPPED: an interrupt, after which some steppers have not moved; otherwise KEMPE_OK or the first status that
 * is neither KEMPE_E_FAILED nor KEMPE_STOPPED. */
kempe_status python_advance_steppers(const python_steppers *together);
