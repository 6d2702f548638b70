/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * The flow of a mechanism with its exact derivatives: the motion over an interval as a function of start values and
 * parameters. The equations are derived once, and each evaluation is a run. With the coordinates and rates of the start
 * as variables, one interval is a step of an optimiser or of a predictive controller,
 *
 *     x(T) = f(x(0), p),      df/dx and df/dp,
 *
 * through contacts, friction that sticks, switching closures and states that change at events (saltation matrices).
 *
 *     kempe_flow_options ask = {.variables = "q.A,q.B,qd.A,qd.B,force", .outputs = "q,qd", .run = &run};
 *     const double t[] = {0.01};
 *     kempe_flow *flow;
 *     kempe_flow_new(model, &ask, 1, t, &flow);
 *     kempe_flow_at(flow, variables, x, jacobian);
 *
 * The independent coordinates of a mechanism with loops must be the held ones of its start (start: hold).
 */
#ifndef KEMPE_FLOW_H
#define KEMPE_FLOW_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_flow kempe_flow;

typedef struct kempe_flow_options {
    size_t size;                  /* sizeof this struct; 0: its size in version 0.1 */
    const char *variables;        /* "q.A,qd.A,force": start values, parameters, constant inputs; NULL: parameters */
    const char *outputs;          /* "q,qd,position(b.P)"; NULL: as in the model */
    const kempe_run_options *run; /* tolerances, integrator, independent, back end; NULL: as in the model */
} kempe_flow_options;

/** Derives the equations of a model with the variables kept symbolic. An input among them is constant over the
 * interval. The motion begins at t = 0, and values are
 * given at the ascending times t (count; s). The model must outlive the flow. A flow is used by one thread at a time.
 * KEMPE_E_ARGUMENT: a name does not exist or cannot vary, a time is wrong, the run has an option that
 * flows do not take, or a body rolls in space. */
KEMPE_API kempe_status kempe_flow_new(const kempe_model *model, const kempe_flow_options *options, int count,
                                      const double *t, kempe_flow **flow);
KEMPE_API void kempe_flow_free(kempe_flow *flow);

/** The number of variables, the name of the k-th, and its value in the model (SI). */
KEMPE_API int kempe_flow_variable_count(const kempe_flow *flow);
KEMPE_API const char *kempe_flow_variable(const kempe_flow *flow, int k);
KEMPE_API double kempe_flow_variable_value(const kempe_flow *flow, int k);

/** The number of values at each time, and the name of the k-th: `q.A`. */
KEMPE_API int kempe_flow_count(const kempe_flow *flow);
KEMPE_API const char *kempe_flow_name(const kempe_flow *flow, int k);

/** Runs with these variables: values (times x values, a row for each time) and jacobian (times x values x variables;
 * NULL: not requested), both within the tolerances of the run, which are not checked by a second run. KEMPE_E_FAILED:
 * the motion does not reach the last time, or has no derivative at an event; the message has the reason.
 * KEMPE_E_INPUT: the model cannot have these values. KEMPE_STOPPED: interrupted. */
KEMPE_API kempe_status kempe_flow_at(kempe_flow *flow, const double *variables, double *values, double *jacobian);

KEMPE_END
#endif
