/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Comparison of formulations, integrators and tolerances: error against a reference, residuals, work and time.
 */
#ifndef KEMPE_COMPARE_H
#define KEMPE_COMPARE_H

#include <kempe/table.h>

KEMPE_BEGIN

typedef struct kempe_comparison kempe_comparison;

/** Lists are comma-separated. NULL takes the standard values, and for a stiff model all implicit integrators. */
typedef struct kempe_compare_options {
    size_t size;              /* sizeof this struct; 0: its size in version 0.1 */
    const char *rtols;        /* "1e-4,1e-6,.." */
    const char *formulations; /* "reduced,projected,dae" */
    const char *forms;        /* "integrated,newton,index1,.." */
    const char *integrators;  /* "dop853,radau,.." */
    const char *reference;    /* CSV; NULL: Kempe makes its own from several formulations and integrators */
    double t_end;             /* end of the runs, s; 0: as in a run */
    double budget_s;          /* processor time of all runs together; runs that exceed it are left out; 0: 60 */
    const char *linear;       /* linear solvers of the integrators that take one: "klu,umfpack,dense"; NULL: auto */
    const char *bodies; /* models of the flexible bodies, "rigid,none,first,full,segments:16", compared with the last
                           one, by the default method; NULL: none */
} kempe_compare_options;

KEMPE_API kempe_status kempe_comparison_new(const kempe_system *system, const kempe_compare_options *run,
                                            kempe_comparison **comparison);
KEMPE_API void kempe_comparison_free(kempe_comparison *comparison);
KEMPE_API kempe_status kempe_comparison_print(const kempe_comparison *comparison, kempe_format format, char **text);

/** Tables: "runs": formulation, form, integrator, linear solver (empty: chosen by Kempe), rtol, status, reason, errors
 * against the reference, residuals, energy, work, times, memory, and the difference from the run at the next tighter
 * tolerance. "levels", the methods at equal error: formulation, form, integrator, linear solver, error; rtol, cpu_s,
 * ratio to the fastest, steps and evaluations, unknown where a method does not attain the error. "bodies", the models
 * of flexible bodies: their word, status, reason, coordinates, steps, cpu_s, build_s; the output with the largest error
 * over the range of its unit, that error, this part, and the unit. KEMPE_E_ARGUMENT: another name. */
KEMPE_API kempe_status kempe_comparison_table(const kempe_comparison *comparison, const char *name,
                                              kempe_table **table);

/** Writes a self-contained HTML page: summary, plots, animation of the mechanism, all runs. The recommended run and the
 * best run of each other formulation are repeated with monitoring. KEMPE_E_IO: the path cannot be written. */
KEMPE_API kempe_status kempe_comparison_write_report(const kempe_comparison *comparison, const char *path);

KEMPE_END
#endif
