/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism for which impacts are decided, in addition to the site of friction (friction_site.h), which has the
 * same `self` and statuses. Rows of friction and contacts are not held. Generated simulators have this file too. */
#pragma once

#include <stdbool.h>

/* Reasons of an impact that has no solution. */
typedef enum kmp_impact_failure {
    KMP_IMPACT_FORCED,    /* closures force surfaces into each other */
    KMP_IMPACT_UNDECIDED, /* rounding prevents a decision */
    KMP_IMPACT_ALTERNATES /* the bounds of friction do not settle */
} kmp_impact_failure;

struct kmp_impact_run;

typedef struct kmp_impact_site {
    bool driven; /* closures depend on time: their impulses do work */
    /** Rows of J at (t, q), count x n, with the present inputs. */
    void (*rows)(void *self, double t, const double *q, int count, const int *row, double *g);
    /** Prepares P and inertia at q. */
    int (*invert)(void *self, double t, const double *q);
    /** Changes of the rates by an impulse along a row, P g, after `invert`. */
    int (*way)(void *self, const double *g, double *way);
    /** Inertia at q. */
    void (*weigh)(void *self, double t, const double *q);
    /** The kinetic energy with this inertia. */
    double (*kinetic)(const void *self, const double *qd);
    /** Returns a status of failure, with a sentence. `which`: the elements that take part. */
    int (*fail)(void *self, kmp_impact_failure failure, double t, int count, const int *which);
    /** Notes for a log; NULL: they are not read. The impacts of an element accumulate at the time `end`; an impact of
     * the gain of energy, J; one that would gain this energy (NAN: whose rebound an element without a limit holds) is
     * taken without restitution. */
    void (*report_sequence)(void *self, int element, double t, double since, double end);
    void (*report_impact)(void *self, const struct kmp_impact_run *p, double t, double before, double gain);
    void (*report_plastic)(void *self, double t, double gain);
} kmp_impact_site;
