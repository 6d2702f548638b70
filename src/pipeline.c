/* SPDX-License-Identifier: BSD-3-Clause */
/* The pipeline: what Kempe does with a model, in order. Everything else serves one of these steps, or calls them.
 *
 *     model file --read--> model --derive--> equations --schedule--> program --run--> trajectory --judge--> verdict
 *
 * The heading of each step has the function that enters it, and its file; docs/overview.md shows them as a picture.
 */
#include "pipeline.h"
#include "constraints/diagnosis/diagnose.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/inexact/nearest_exact.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "model/read/reader.h"
#include "studies/compare/compare_study.h"
#include "studies/simulate/trajectory.h"
#include <kempe/check.h>
#include <kempe/compare.h>

/* -- read: kmp_model_read_file, src/model/read/reader.c ------------------------------------------------------------ */

/* The document, then its sections in the order in which they refer to each other. The model is then frozen. */
kempe_status kempe_model_read(kempe_context *context, const char *path, kempe_model **model)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, model, "model");
    kmp_context_begin(context);
    return kmp_model_read_file(context, path, NULL, 0, model);
}

/* -- derive: kmp_equations_derive, src/dynamics/choose_variants.c -------------------------------------------------- */
/* -- schedule: kmp_program_new, src/symbolic/program.c ------------------------------------------------------------- */

/* M, C, h, J and Jdot qd as one graph of expressions, in the variant with the fewest operations; the graph as
 * straight-line programs in stages. A drawing with rounded numbers is replaced by the exact mechanism that it means. */
kempe_status kempe_system_new(const kempe_model *model, kempe_system **system)
{
    KMP_WANTED_BOTH(model, system);
    return kmp_system_new(model, NULL, system);
}

/* -- run: kmp_run, integrators/run/run.c --------------------------------------------------------------------------- */
/* -- judge: kmp_verdict_of, src/output/verdict.c ------------------------------------------------------------------- */

/* A formulation makes an ODE or a DAE of the programs, and an integrator advances it. Residuals, energy and a reference
 * judge the trajectory, then the same motion at another tolerance. */
kempe_status kmp_simulate(const kempe_system *system, const kempe_run_options *options, kempe_trajectory **trajectory)
{
    KMP_OPTIONS(system->context, kempe_run_options, options);
    kmp_simulation simulation;
    kempe_status status = kmp_simulation_begin(&simulation, system, options);
    if (status == KEMPE_OK) {
        status = kmp_simulation_run(&simulation);
        status = kmp_simulation_judge(&simulation, status);
    }
    return kmp_simulation_end(&simulation, status, trajectory);
}

kempe_status kempe_simulate(const kempe_system *system, const kempe_run_options *run, kempe_trajectory **trajectory)
{
    KMP_WANTED_BOTH(system, trajectory);
    kmp_model_begin_forces(system->model);
    kempe_status status = kmp_context_verdict(system->context, kmp_simulate(system, run, trajectory));
    if (status == KEMPE_UNTRUSTED)
        (*trajectory)->status = status;
    return status;
}

/* -- what a model means, and several methods next to each other ---------------------------------------------------- */

kempe_status kempe_check_new(const kempe_system *system, kempe_check **check)
{
    KMP_WANTED_BOTH(system, check);
    kmp_model_begin_forces(system->model);
    return kmp_check(system, check);
}

kempe_status kempe_comparison_new(const kempe_system *system, const kempe_compare_options *options,
                                  kempe_comparison **comparison)
{
    KMP_WANTED_BOTH(system, comparison);
    kmp_model_begin_forces(system->model);
    return kmp_compare(system, options, comparison);
}
