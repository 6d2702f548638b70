/* SPDX-License-Identifier: BSD-3-Clause */
/* The pipeline: what Kempe does with a model, in order. Everything else serves one of these steps, or calls them.
 *
 *     model file --read--> model --derive--> equations --schedule--> program --run--> trajectory --judge--> verdict
 *
 * read       kmp_model_read_file (model/read/reader.c): the document, then its sections in the order in which they
 * refer to each other; the model is then frozen derive     kmp_equations_derive (dynamics/choose_variants.c): M, C, h,
 * J and Jdot qd as one graph of expressions schedule   kmp_program_new (symbolic/program.c): straight-line code in
 * stages; kmp_system_new makes all that a run needs run        kmp_run (integrators/run/run.c): a formulation makes an
 * ODE or a DAE of the programs, an integrator advances it, decisions between steps are those of integrators/decide
 * judge      kmp_verdict_of (output/verdict.c): residuals, energy, a reference; then the same motion at another
 * tolerance
 */
#include "pipeline.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/inexact/nearest_exact.h"
#include "model/data/variant.h"
#include "model/read/reading.h"
#include "studies/compare/compare_study.h"
#include "studies/simulate/simulation.h"
#include <kempe/check.h>
#include <kempe/compare.h>

/* -- read -------------------------------------------------------------------------------------------- */

kempe_status kempe_model_read(kempe_context *context, const char *path, kempe_model **model)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, model, "model");
    kmp_context_begin(context);
    return kmp_model_read_file(context, path, NULL, 0, model);
}

/* -- derive and schedule ------------------------------------------------------------------------------ */

kempe_status kempe_system_new(const kempe_model *model, kempe_system **system)
{
    KMP_WANTED_BOTH(model, system);
    return kmp_system_new(model, NULL, system);
}

/* -- run and judge ------------------------------------------------------------------------------------- */

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

/* -- examined, and by several methods -------------------------------------------------------------------- */

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
