/* SPDX-License-Identifier: BSD-3-Clause */
/* Studies of the command: each is the functions of its result and the files that options ask for; cli_run_study runs
 * any of them. */
#pragma once

#include "command.h"

#include <stddef.h>

#define AT(member) offsetof(cli_settings, member)

/* A study whose result is a `type` of the library. `call` makes *result for the job j with the settings s. Then follow
 * the function of its table, or NULL, and its files: the option that has the path, and the function that writes there.
 */
#define STUDY(name, type, call, ...)                                                                                   \
    static kempe_status name##_make(const cli_job *j, const cli_settings *s, type **result)                            \
    {                                                                                                                  \
        (void)j, (void)s;                                                                                              \
        return call;                                                                                                   \
    }                                                                                                                  \
    static kempe_status name##_compute(const cli_job *j, void **object)                                                \
    {                                                                                                                  \
        type *result = NULL;                                                                                           \
        kempe_status status = name##_make(j, j->settings, &result);                                                    \
        *object = result;                                                                                              \
        return status;                                                                                                 \
    }                                                                                                                  \
    static kempe_status name##_print(const cli_job *j, const void *object, kempe_format format, char **text)           \
    {                                                                                                                  \
        (void)j;                                                                                                       \
        return type##_print(object, format, text);                                                                     \
    }                                                                                                                  \
    static void name##_free(void *object)                                                                              \
    {                                                                                                                  \
        type##_free(object);                                                                                           \
    }                                                                                                                  \
    const cli_study cli_##name##_study = {                                                                             \
        .compute = name##_compute, .print = name##_print, .free = name##_free, __VA_ARGS__};

/* The function of the library that writes a result to a file, for results of any type. */
#define WRITER(function)                                                                                               \
    static kempe_status any_##function(const cli_job *j, void *object, const char *path)                               \
    {                                                                                                                  \
        (void)j;                                                                                                       \
        return function(object, path);                                                                                 \
    }

/* The table of a result by its name. */
#define TABLE(type, name)                                                                                              \
    static kempe_status type##_rows(const cli_job *j, const void *object, bool drawn, kempe_table **table)             \
    {                                                                                                                  \
        (void)j, (void)drawn;                                                                                          \
        return type##_table(object, name, table);                                                                      \
    }

/* Files that `--report` and `--animation` ask for: none in a build without the wing, where cli_run_study refuses the
 * option. */
#ifdef KEMPE_REPORT
#define REPORT(function)                                                                                               \
    {                                                                                                                  \
        AT(report), any_##function                                                                                     \
    }
#define REPORT_WRITER WRITER
#else
#define REPORT(function)                                                                                               \
    {                                                                                                                  \
        0, NULL                                                                                                        \
    }
#define REPORT_WRITER(function)
#endif
#ifdef KEMPE_PICTURE
#define ANIMATION(function)                                                                                            \
    {                                                                                                                  \
        AT(animation), any_##function                                                                                  \
    }
#define ANIMATION_WRITER WRITER
#else
#define ANIMATION(function)                                                                                            \
    {                                                                                                                  \
        0, NULL                                                                                                        \
    }
#define ANIMATION_WRITER(function)
#endif

/* The studies, by the file that has them. Studies of a wing of the library are in builds with that wing. */
extern const cli_study cli_check_study, cli_assembly_study, cli_branches_study, cli_simulate_study, cli_compare_study;
extern const cli_study cli_kinematics_study, cli_inverse_study, cli_modes_study, cli_response_study, cli_cycles_study,
    cli_equilibrium_study, cli_linearize_study, cli_comfort_study, cli_sensitivity_study; /* analysis_studies.c */
extern const cli_study cli_contact_study;                                                 /* rail_studies.c */
extern const cli_study cli_count_study, cli_code_study;                                   /* exchange_studies.c */
extern const cli_study cli_fit_study, cli_optimize_study, cli_ensemble_study;             /* ensemble_studies.c */
kempe_status cli_generate(const cli_job *j), cli_fmu(const cli_job *j),
    cli_reduce(const cli_job *j);                   /* exchange_studies.c */
kempe_status cli_gather(const cli_job *j);          /* ensemble_studies.c */
kempe_status cli_language_server(const cli_job *j); /* language_studies.c */
kempe_status cli_workbench(const cli_job *j);       /* workbench_studies.c */
