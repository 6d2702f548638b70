/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Roads, integrators and tolerances side by side: error against a reference, residuals kept, work done, time.
 */
#ifndef KEMPE_COMPARE_H
#define KEMPE_COMPARE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct kempe_comparison kempe_comparison;

/** Lists are comma-separated. NULL takes the standard ones, and for a stiff model all implicit integrators. */
typedef struct kempe_compare_run {
    const char *rtols; /* "1e-4,1e-6,.." */
    const char *roads;
    const char *forms;
    const char *integrators;
    const char *reference; /* CSV; NULL: Kempe makes its own from several roads and integrators */
    double t_end;
    double budget_s; /* of the processor, for all runs together; what there is no time for is left out; 0: 60 */
} kempe_compare_run;

KEMPE_API kempe_compare_run kempe_compare_run_default(void);
KEMPE_API kempe_status kempe_compare(const kempe_system *system, const kempe_compare_run *run,
                                     kempe_comparison **comparison);
KEMPE_API void kempe_comparison_free(kempe_comparison *comparison);
KEMPE_API kempe_status kempe_comparison_print(const kempe_comparison *comparison, kempe_format format, char **text);
KEMPE_API kempe_status kempe_comparison_write_csv(const kempe_comparison *comparison, const char *path);

#ifdef __cplusplus
}
#endif
#endif
