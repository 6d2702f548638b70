/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Formulations, integrators and tolerances side by side: error against a reference, residuals kept, work done, time.
 */
#ifndef KEMPE_COMPARE_H
#define KEMPE_COMPARE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct kempe_comparison kempe_comparison;

/** Lists are comma-separated. NULL takes the standard ones, and for a stiff model all implicit integrators. */
typedef struct kempe_compare_options {
    const char *rtols; /* "1e-4,1e-6,.." */
    const char *formulations;
    const char *forms;
    const char *integrators;
    const char *reference; /* CSV; NULL: Kempe makes its own from several formulations and integrators */
    double t_end;
    double budget_s; /* of the processor, for all runs together; what there is no time for is left out; 0: 60 */
} kempe_compare_options;

KEMPE_API kempe_compare_options kempe_compare_run_default(void);
KEMPE_API kempe_status kempe_compare(const kempe_system *system, const kempe_compare_options *run,
                                     kempe_comparison **comparison);
KEMPE_API void kempe_comparison_free(kempe_comparison *comparison);
KEMPE_API kempe_status kempe_comparison_print(const kempe_comparison *comparison, kempe_format format, char **text);
KEMPE_API kempe_status kempe_comparison_write_csv(const kempe_comparison *comparison, const char *path);

/** One page of HTML that needs nothing beside itself: the verdict, plots, the mechanism moving, all runs. The run that
 * is advised and the best of each other formulation are made once more and watched. KEMPE_E_IO when the path cannot be
 * written, or as kempe_report_check. */
KEMPE_API kempe_status kempe_comparison_write_report(const kempe_comparison *comparison, const char *path);

/** Whether reports can be made here: three.js and Chart.js are taken from /usr/share/javascript, or from the folder
 * that the environment variable KEMPE_JAVASCRIPT names. KEMPE_E_IO: which is missing, and what to install. */
KEMPE_API kempe_status kempe_report_check(kempe_context *context);

#ifdef __cplusplus
}
#endif
#endif
