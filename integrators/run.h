/* SPDX-License-Identifier: BSD-3-Clause */
/* One run: assembles, sets a road and an integrator together by name, advances, delivers rows. */
#ifndef KMP_INTEGRATORS_RUN_H
#define KMP_INTEGRATORS_RUN_H

#include "constraints/assemble.h"
#include "dynamics/system.h"

typedef struct kmp_run_spec {
    const char *road, *form, *integrator, *linear, *backend; /* names; all given, see kmp_run_resolve */
    double rtol, atol;                                       /* atol: of an angle */
    double t_end;
    int time_count; /* when to deliver rows: ascending, within [0, t_end] */
    const double *times;
    const int *u; /* wished independent coordinates */
    int u_count;
} kmp_run_spec;

/** A row delivered at a time: q, qd, qdd (n), lambda (m) and the work done so far by non-conservative forces (J).
 * Nonzero ends the run with KEMPE_E_MEMORY. */
typedef int kmp_row_fn(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                       double work);

typedef struct kmp_run_report {
    char *reason;      /* sentence, NULL when all went well; the caller frees it (kmp_free) */
    double t;          /* reached */
    double rate_scale; /* 1/s: how the absolute tolerance of rates follows from that of coordinates */
    long steps, rejected, refused, rhs, newton, factorizations, exchanges;
    double cpu_s, build_s; /* integration alone; preparing this run (deriving for the dae road included) */
} kmp_run_report;

/** Fills what is NULL or 0 from the model and from Kempe's defaults and checks the names against the tables of roads
 * and integrators. KEMPE_E_ARGUMENT: which name is unknown, and what there is. */
kempe_status kmp_run_resolve(const kempe_system *system, kmp_run_spec *spec);

/** Runs. KEMPE_OK, KEMPE_STOPPED or KEMPE_E_FAILED with report->reason; other errors by message. `start` may be given
 * (an assembly made before), else the model is assembled here. */
kempe_status kmp_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row,
                     void *user, kmp_run_report *report);

/** The ways to run: row k of the table of roads, forms and integrators that go together; NULL after the last. */
typedef struct kmp_way {
    const char *road, *form, *integrator;
} kmp_way;
const kmp_way *kmp_way_get(int k);

#endif
