/* SPDX-License-Identifier: BSD-3-Clause */
/* Runs of one model as bench/before_after asks for them by lines on standard input; compiled once for each build,
 * with the settings that the command `kempe` makes for its process.
 *
 *     bench_before_after MODEL.yaml
 *
 * It writes `ok` and the coordinates' names. A line `FORMULATION FORM INTEGRATOR RTOL T_END ROWS LIMIT_S REPEATS FILE`
 * makes REPEATS runs with ROWS equidistant rows each, ended after LIMIT_S of processor time; "-" is a default. The
 * answer is `STATUS CPU_S TOTAL_S STEPS REJECTED REFUSED RHS JACOBIANS FACTORIZATIONS H_MAX RUN_S`: CPU_S the least
 * integration time, TOTAL_S the processor time of the program's own thread since the start of its own code, RUN_S its
 * least processor time in a call of kempe_simulate, with all that it prepares. q at all rows goes to FILE unless it is
 * "-", as doubles. The variable KEMPE_CACHE names the folder of prepared equations, in libraries that have one. */
#include "own_process.h"

#include <kempe/kempe.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#ifdef KEMPE_VERSION_MAJOR
#include <kempe/cache.h>

static void use_cache(kempe_context *context)
{
    char *folder = kempe_cache_folder();
    (void)kempe_context_set_cache(context, folder);
    kempe_text_free(folder);
}
#else /* older public headers: members of the options had other names there */
#define kempe_run_options    kempe_run
#define formulation          road
#define output_step          every
#define no_convergence_check once
#define use_cache(context)   (void)(context)
#endif

typedef struct loaded {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} loaded;

static kempe_context *running;
static volatile sig_atomic_t again;
static double began;

/* Once more when the run does not end by itself: so does the program. */
static void end_run(int signal)
{
    (void)signal;
    if (again)
        _exit(1);
    again = 1;
    kempe_context_interrupt(running);
}

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t); /* runs have one thread; those of BLAS wait, or spin */
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static loaded load(const char *path)
{
    loaded l = {kempe_context_new(), NULL, NULL};
    use_cache(l.context);
    if (kempe_model_read(l.context, path, &l.model) || kempe_system_new(l.model, &l.system)) {
        fprintf(stderr, "%s\n", kempe_context_message(l.context));
        exit(1);
    }
    running = l.context;
    return l;
}

static void unload(loaded *l)
{
    kempe_system_free(l->system);
    kempe_model_free(l->model);
    kempe_context_free(l->context);
}

static void limit(double s)
{
    struct itimerval t = {{s > 0, 0}, {(time_t)s, (suseconds_t)(1e6 * (s - floor(s)))}};
    (void)setitimer(ITIMER_VIRTUAL, &t, NULL);
}

static double number(const char *json, const char *key)
{
    const char *at = strstr(json, key);
    return at ? strtod(at + strlen(key), NULL) : NAN;
}

static void write_rows(const char *path, const kempe_trajectory *t, int n)
{
    FILE *file = strcmp(path, "-") ? fopen(path, "wb") : NULL;
    for (int k = 0; file && k < kempe_trajectory_row_count(t); k++)
        fwrite(kempe_trajectory_q(t, k), sizeof(double), (size_t)n, file);
    if (file)
        fclose(file);
}

/* One run: its times replace larger ones in *cpu and *all, and *json the text of the run before. */
static const char *run_once(const loaded *l, const kempe_run_options *options, double limit_s, const char *path,
                            double *cpu, double *all, char **json)
{
    kempe_trajectory *t = NULL;
    again = 0;
    limit(limit_s);
    double before = now();
    kempe_status status = kempe_simulate(l->system, options, &t);
    *all = fmin(*all, now() - before);
    limit(0);
    kempe_text_free(*json);
    *json = NULL;
    if (t && kempe_trajectory_print(t, KEMPE_JSON, json) == KEMPE_OK)
        *cpu = fmin(*cpu, number(*json, "\"cpu_s\": "));
    if (status == KEMPE_OK)
        write_rows(path, t, kempe_model_coordinate_count(l->model));
    kempe_trajectory_free(t);
    return status == KEMPE_OK ? "ok" : status == KEMPE_STOPPED ? "stopped" : "failed";
}

static const char *given(const char *word)
{
    return strcmp(word, "-") ? word : NULL;
}

static void answer(loaded *l, const char *model, const char *line)
{
    char formulation_name[32], form[32], integrator[32], path[512];
    double rtol, t_end, limit_s, cpu = INFINITY, all = INFINITY;
    int rows, repeats;
    char *json = NULL;
    const char *status = "failed";
    if (sscanf(line, "%31s %31s %31s %lf %lf %d %lf %d %511s", formulation_name, form, integrator, &rtol, &t_end, &rows,
               &limit_s, &repeats, path) != 9)
        exit(1);
    kempe_run_options options = {.formulation = given(formulation_name),
                                 .form = given(form),
                                 .integrator = given(integrator),
                                 .rtol = rtol,
                                 .t_end = t_end,
                                 .output_step = t_end / rows,
                                 .no_convergence_check = 1};
    for (int k = 0; k < repeats && (k == 0 || strcmp(status, "ok") == 0); k++)
        status = run_once(l, &options, limit_s, path, &cpu, &all, &json);
    const char *text = json ? json : "";
    printf("%s %.9g %.9g %.0f %.0f %.0f %.0f %.0f %.0f %.3g %.9g\n", status, cpu, now() - began,
           number(text, "\"steps\": "), number(text, "\"rejected\": "), number(text, "\"refused\": "),
           number(text, "\"rhs\": "), number(text, "\"jacobians\": "), number(text, "\"factorizations\": "),
           number(text, "\"h_max\": "), all);
    kempe_text_free(json);
    if (strcmp(status, "stopped") == 0) { /* an interrupt of older libraries ends all later runs of its context */
        unload(l);
        *l = load(model);
    }
}

int main(int argc, char **argv)
{
    char line[1024];
    began = now();
    if (argc != 2)
        return 1;
    cli_own_process();
    loaded l = load(argv[1]);
    printf("ok");
    for (int k = 0; k < kempe_model_coordinate_count(l.model); k++)
        printf(" %s", kempe_model_coordinate_name(l.model, k));
    printf("\n");
    fflush(stdout);
    signal(SIGVTALRM, end_run);
    while (fgets(line, sizeof line, stdin)) {
        answer(&l, argv[1], line);
        fflush(stdout);
    }
    unload(&l);
    return 0;
}
