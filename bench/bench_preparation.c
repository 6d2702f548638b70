/* SPDX-License-Identifier: BSD-3-Clause */
/* Time from a model's file to the first step of its run, by stage: bench_preparation [MODEL ..], milliseconds of
 * processor time. Each model is prepared without a cache, with an empty one, and with what that has left; a line has
 * the round with the least total of some. Exit code 1: Andrews' mechanism takes more than 1 ms with a filled cache.
 *
 * The linker leads calls of the stages through the functions below (--wrap, bench/CMakeLists.txt). A stage within
 * another one counts for itself alone. */
#include "bench.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/tangent.h"
#include "constraints/evaluation/tangent_record.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/system_record.h"
#include "integrators/run/run.h"
#include "studies/simulate/trajectory.h"
#include "wrapped.h"
#include <dirent.h>
#include <kempe/cache.h>
#include <kempe/check.h>
#include <string.h>
#include <unistd.h>

enum { ROUNDS = 3, MOST_ANDREWS = 1 };

typedef enum stage { READ, DERIVE, SHORTEN, SCHEDULE, ENCODE, START, CACHE, REST, STAGES } stage;

static const char *const stages[STAGES] = {"read", "derive", "shorten", "schedule", "encode", "start", "cache", "rest"};

static struct {
    stage current;
    double since, spent[STAGES];
} at;

static int enter(stage to)
{
    int from = (int)at.current;
    double now = bench_now();
    at.spent[from] += now - at.since;
    at.since = now;
    at.current = to;
    return from;
}

static void leave(int from)
{
    (void)enter((stage)from);
}

TIMED(DERIVE, kempe_status, kmp_system_new_by, (const kempe_model *model, const char *word, kempe_system **system),
      (model, word, system))
TIMED(DERIVE, kempe_status, kmp_equations_derive,
      (kmp_equations * eq, const kempe_model *model, const kmp_derivation_request *scene), (eq, model, scene))
TIMED(SHORTEN, bool, kmp_equations_shorten, (const kmp_equations *eq, int count, kmp_ref *outputs),
      (eq, count, outputs))
TIMED(SCHEDULE, kmp_program *, kmp_program_new,
      (kmp_graph * g, int groups, const int *count, const kmp_ref *const *outputs), (g, groups, count, outputs))
TIMED(ENCODE, kmp_machine *, kmp_machine_new, (const kmp_program *program, const kmp_backend *backend),
      (program, backend))
TIMED(START, kempe_status, kmp_assemble_start, (const kempe_system *system, kempe_assembly **assembly),
      (system, assembly))
TIMED(START, kempe_status, kempe_assembly_new, (const kempe_system *system, kempe_assembly **assembly),
      (system, assembly))
TIMED(CACHE, kempe_system *, kmp_system_recall, (const kempe_model *model, const char *word), (model, word))
TIMED(CACHE, bool, kmp_tangents_recall, (kmp_tangents * tangents, const kempe_system *system, unsigned values),
      (tangents, system, values))
TIMED_VOID(CACHE, kmp_system_keep, (kempe_system * system), (system))
TIMED_VOID(CACHE, kmp_tangents_keep, (const kmp_tangents *tangents, const kempe_system *system, unsigned values),
           (tangents, system, values))
TIMED(DERIVE, kempe_status, kmp_tangents_init,
      (kmp_tangents * tangents, const kempe_system *system, const kmp_backend *backend, unsigned values),
      (tangents, system, backend, values))

/* -- rounds ------------------------------------------------------------------------------------------ */

static char folder[] = "/tmp/kempe_bench_XXXXXX";

static void empty_folder(void)
{
    char path[1024];
    DIR *d = opendir(folder);
    for (const struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        if (e->d_name[0] != '.')
            (void)unlink(path);
    }
    if (d)
        closedir(d);
}

static void give_up(const char *path, const kempe_context *context)
{
    fprintf(stderr, "%s: %s\n", path, kempe_context_message(context));
    exit(1);
}

/* From the file to the first step; false: the model has no run. */
static bool prepare(const char *path, const char *cache)
{
    static const kempe_run_options options = {.t_end = 1};
    bench b = {.context = kempe_context_new()};
    kmp_arena arena = {0};
    kmp_run_spec spec;
    kmp_runner *runner = NULL;
    (void)kempe_context_set_cache(b.context, cache);
    memset(at.spent, 0, sizeof at.spent);
    at.current = REST;
    at.since = bench_now();
    int from = enter(READ);
    if (kempe_model_read(b.context, path, &b.model))
        give_up(path, b.context);
    leave(from);
    if (kempe_system_new(b.model, &b.system))
        give_up(path, b.context);
    bool runs = kmp_spec_of(b.system, &options, &arena, &spec) == KEMPE_OK &&
                kmp_runner_new(b.system, &spec, NULL, &runner) == KEMPE_OK;
    (void)enter(REST);
    kmp_runner_free(runner);
    kmp_arena_free(&arena);
    bench_free(&b);
    return runs;
}

static double total_of(const double spent[STAGES])
{
    double total = 0;
    for (int k = 0; k < STAGES; k++)
        total += spent[k];
    return total;
}

/* The round with the least total. */
static double best_of(const char *path, const char *cache, bool fill)
{
    double best[STAGES] = {0}, least = 0;
    for (int round = 0; round < ROUNDS; round++) {
        if (fill)
            empty_folder();
        (void)prepare(path, cache);
        if (round == 0 || total_of(at.spent) < least) {
            least = total_of(at.spent);
            memcpy(best, at.spent, sizeof best);
        }
    }
    for (int k = 0; k < STAGES; k++)
        printf(" %8.2f", 1e3 * best[k]);
    printf(" %8.2f\n", 1e3 * least);
    return 1e3 * least;
}

static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool show(const char *path)
{
    static const char *const states[] = {"none", "empty", "filled"};
    double total = 0;
    for (int state = 0; state < 3; state++) {
        printf("%-30s %-7s", state ? "" : name_of(path), states[state]);
        total = best_of(path, state ? folder : NULL, state == 1);
    }
    fflush(stdout);
    return strstr(path, "andrews.yaml") == NULL || total <= MOST_ANDREWS;
}

int main(int argc, char **argv)
{
    bool good = mkdtemp(folder);
    printf("%-30s %-7s", "ms", "cache");
    for (int k = 0; k < STAGES; k++)
        printf(" %8s", stages[k]);
    printf(" %8s\n", "total");
    for (int k = 1; good && k < argc; k++)
        good = show(argv[k]) && good;
    empty_folder();
    (void)rmdir(folder);
    return good ? 0 : 1;
}
