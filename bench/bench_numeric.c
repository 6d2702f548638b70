/* SPDX-License-Identifier: BSD-3-Clause */
/* One mechanism's dynamics in six ways: by a plain numeric program (numeric.h), by Kempe's tape and its machine code,
 * by the C that Kempe writes, and by the classical non-recursive form, in C with the same simplifications (classical.h)
 * and as a numeric program (numeric_classical.h). Values are held together first; then all are timed in turns, and
 * ratios are medians of the ratios of a turn; the last two are those of the non-recursive form to the recursive one, in
 * operations and in time as C. Without arguments: ROBOTRAN's models in the folder KEMPE_MBS and some of Kempe's own;
 * forces of the models are left out.
 *
 *     bench numeric [--task 0..2] [--evaluations N] [FILE...]    with N: each N times, no times taken: to be counted */
#include "bench/classical.h"
#include "bench/loaded_equations.h"
#include "bench/numeric_classical.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "model/data/model.h"

#include "backend/machine.h"
#include "bench.h"
#include "studies/show/sets.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>

enum { STATES = 16, TURNS = 101, WAYS = 6, TASKS = 3 };

typedef struct state {
    double *q, *qd, *qdd;
} state;

/* Results of a task; the numeric program fills the lower triangle of M. */
typedef struct values {
    double *mass, *bias, *h, *jacobian, *jdqd;
} values;

typedef enum task_kind { MOTION, INVERSE, CLOSED } task_kind;

static const char *const task_sets[TASKS] = {"M_C", "invdyn", "M+C+h+J+jdqd"};
static const char *const task_names[TASKS] = {"M, c", "inverse dynamics", "M, c, h, J, jdqd"};

/* One model and task, with all that computes it. */
typedef struct stand {
    const kempe_model *model;
    task_kind task;
    kmp_equations eq;
    numeric numeric;
    numeric_closures closures;
    numeric_classical plain;
    int entries;
    kmp_assignment *entry; /* all of the sets */
    int *at;               /* of an entry: its place in the tape's outputs, -1: zero */
    kmp_program *program;
    kmp_machine *tape, *native;
    emitted emitted, classical;
    long operations, classical_operations;
    values by_numbers, by_code, by_classical, by_plain;
    state states[STATES];
    const double *by_tape, *by_native;
} stand;

/* -- one evaluation each: functions that a tool finds by their names ---------------------------------- */

#define WAY __attribute__((noinline)) static void

WAY run_numeric(stand *s, const state *x)
{
    values *v = &s->by_numbers;
    if (s->task == INVERSE)
        numeric_inverse(&s->numeric, x->q, x->qd, x->qdd, v->bias);
    else
        numeric_motion(&s->numeric, x->q, x->qd, v->mass, v->bias);
    if (s->task == CLOSED)
        numeric_close(&s->closures, x->qd, v->h, v->jacobian, v->jdqd);
}

static const double *run_machine(kmp_machine *machine, task_kind task, const state *x)
{
    kmp_machine_set(machine, KMP_IN_Q, x->q);
    kmp_machine_set(machine, KMP_IN_QD, x->qd);
    if (task == INVERSE)
        kmp_machine_set(machine, KMP_IN_QDD, x->qdd);
    return kmp_machine_run(machine, 1);
}

WAY run_tape(stand *s, const state *x)
{
    s->by_tape = run_machine(s->tape, s->task, x);
}

WAY run_native(stand *s, const state *x)
{
    s->by_native = run_machine(s->native, s->task, x);
}

static void run_code(const emitted *e, task_kind task, const state *x, values *v)
{
    if (task == MOTION)
        e->function.motion(0, x->q, x->qd, v->mass, v->bias);
    else if (task == INVERSE)
        e->function.inverse(0, x->q, x->qd, x->qdd, v->bias);
    else
        e->function.closed(0, x->q, x->qd, v->mass, v->bias, v->h, v->jacobian, v->jdqd);
}

WAY run_emitted(stand *s, const state *x)
{
    run_code(&s->emitted, s->task, x, &s->by_code);
}

WAY run_classical(stand *s, const state *x)
{
    run_code(&s->classical, s->task, x, &s->by_classical);
}

WAY run_classical_numeric(stand *s, const state *x)
{
    values *v = &s->by_plain;
    numeric_classical_motion(&s->plain, &s->numeric, x->q, x->qd, v->mass, v->bias);
    if (s->task == CLOSED)
        numeric_close(&s->closures, x->qd, v->h, v->jacobian, v->jdqd);
}

/* The last two have no inverse dynamics. */
enum { NUMERIC, TAPE, NATIVE, CODE, CLASSICAL, CLASSICAL_NUMERIC };
static void (*const savings[WAYS])(stand *, const state *) = {run_numeric, run_tape,      run_native,
                                                              run_emitted, run_classical, run_classical_numeric};

static int variants_of(const stand *s)
{
    return s->task == INVERSE ? CLASSICAL : WAYS;
}

/* -- making ------------------------------------------------------------------------------------------ */

static unsigned sets_of(task_kind task)
{
    const unsigned motion = 1u << KMP_EQ_M | 1u << KMP_EQ_C;
    if (task == INVERSE)
        return 1u << KMP_EQ_INVDYN;
    return task == MOTION ? motion : motion | 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_JDQD;
}

static kmp_derivation_request scene_of(task_kind task)
{
    return (kmp_derivation_request){.sets = kmp_sets_derive(sets_of(task)), .loops_alone = true};
}

static void stop(const stand *s, const char *what)
{
    fprintf(stderr, "%s: %s: %s. %s\n", s->model->name, task_names[s->task], what,
            kempe_context_message(s->model->context));
    exit(1);
}

static kmp_machine *new_machine(const kmp_program *program, const char *name)
{
    const double time = 0;
    kmp_machine *machine = kmp_machine_new(program, kmp_backend_find(name));
    if (machine) {
        kmp_machine_set(machine, KMP_IN_TIME, &time);
        (void)kmp_machine_run(machine, 0);
    }
    return machine;
}

/* As `kempe show` and `kempe simulate` have it: entries that are zero are no outputs. */
static void make_machines(stand *s)
{
    int kept = 0;
    s->entries = kmp_sets_size(&s->eq, sets_of(s->task));
    s->entry = KMP_NEW(kmp_assignment, s->entries);
    s->at = KMP_NEW(int, s->entries);
    kmp_ref *out = KMP_NEW(kmp_ref, s->entries);
    if (!s->entry || !s->at || !out)
        stop(s, "no memory");
    kmp_sets_put(&s->eq, sets_of(s->task), s->entry);
    for (int k = 0; k < s->entries; k++) {
        s->at[k] = s->entry[k].value == KMP_ZERO ? -1 : kept;
        if (s->at[k] >= 0)
            out[kept++] = s->entry[k].value;
    }
    if (kmp_equations_shorten(&s->eq, kept, out))
        s->program = kmp_program_new(s->eq.graph, 1, &kept, (const kmp_ref *const *)&out);
    s->tape = s->program ? new_machine(s->program, "tape") : NULL;
    s->native = s->program ? new_machine(s->program, "native") : NULL;
    if (!s->tape || !s->native)
        stop(s, "no memory");
    s->operations = kmp_program_count(s->program, 0, 1).paper;
    kmp_free(out);
}

/* The sets with M and C by virtual power. */
static kmp_program *classical_program(const stand *s)
{
    kmp_equations eq;
    kmp_derivation_request scene = scene_of(s->task);
    kmp_program *program = NULL;
    if (kmp_equations_derive(&eq, s->model, &scene) != KEMPE_OK)
        return NULL;
    kmp_wrench *none = KMP_NEW(kmp_wrench, eq.tree.count);
    memset(eq.dynamics.mass, 0, (size_t)eq.n * (size_t)eq.n * sizeof *eq.dynamics.mass);
    memset(eq.dynamics.bias, 0, (size_t)eq.n * sizeof *eq.dynamics.bias);
    if (none && classical_derive(&eq.tree, none, eq.dynamics.mass, eq.dynamics.bias))
        program = kmp_sets_program(&eq, sets_of(s->task));
    kmp_free(none);
    kmp_equations_free(&eq);
    return program;
}

static values new_values(int n, int m)
{
    return (values){.mass = KMP_NEW(double, n *n),
                    .bias = KMP_NEW(double, n),
                    .h = KMP_NEW(double, m),
                    .jacobian = KMP_NEW(double, m *n),
                    .jdqd = KMP_NEW(double, m)};
}

static void free_values(values *v)
{
    kmp_free(v->mass);
    kmp_free(v->bias);
    kmp_free(v->h);
    kmp_free(v->jacobian);
    kmp_free(v->jdqd);
}

/* Angles of 1 rad about the start, rates of 1. */
static void make_states(stand *s)
{
    int n = s->eq.n;
    for (int k = 0; k < STATES; k++) {
        state *x = &s->states[k];
        *x = (state){KMP_NEW(double, n), KMP_NEW(double, n), KMP_NEW(double, n)};
        for (int i = 0; i < n; i++) {
            x->q[i] = s->model->start.q[i].value + sin(0.7 * (i + 1) * (k + 1));
            x->qd[i] = cos(1.3 * (i + 1) * (k + 1));
            x->qdd[i] = 2 * sin(1.9 * (i + 1) * (k + 1));
        }
    }
}

/* false: the task is none of this model's. */
static bool stand_init(stand *s, const kempe_model *model, task_kind task)
{
    kmp_derivation_request scene = scene_of(task);
    *s = (stand){.model = model, .task = task};
    if (kmp_equations_derive(&s->eq, model, &scene) != KEMPE_OK)
        stop(s, "not derived");
    if (!numeric_init(&s->numeric, &s->eq.tree) || !numeric_classical_init(&s->plain, &s->numeric))
        stop(s, "no memory");
    if (task == CLOSED && (s->eq.m == 0 || !numeric_closures_init(&s->closures, &s->numeric, &s->eq.tree, s->eq.m,
                                                                  s->eq.closures.rows))) {
        numeric_classical_free(&s->plain);
        numeric_free(&s->numeric);
        kmp_equations_free(&s->eq);
        return false;
    }
    make_machines(s);
    make_states(s);
    s->by_numbers = new_values(s->eq.n, s->eq.m);
    s->by_code = new_values(s->eq.n, s->eq.m);
    s->by_classical = new_values(s->eq.n, s->eq.m);
    s->by_plain = new_values(s->eq.n, s->eq.m);
    if (!emitted_init(&s->emitted, model, task_sets[task], NULL))
        stop(s, "written C failed");
    if (task == INVERSE)
        return true;
    kmp_program *classical = classical_program(s);
    if (classical)
        s->classical_operations = kmp_program_count(classical, 0, 1).paper;
    if (!classical || !emitted_init(&s->classical, model, task_sets[task], classical))
        stop(s, "the classical form failed");
    return true;
}

static void stand_free(stand *s)
{
    for (int k = 0; k < STATES; k++) {
        kmp_free(s->states[k].q);
        kmp_free(s->states[k].qd);
        kmp_free(s->states[k].qdd);
    }
    free_values(&s->by_numbers);
    free_values(&s->by_code);
    free_values(&s->by_classical);
    free_values(&s->by_plain);
    emitted_free(&s->emitted);
    emitted_free(&s->classical);
    kmp_machine_free(s->tape);
    kmp_machine_free(s->native);
    kmp_program_free(s->program);
    kmp_free(s->entry);
    kmp_free(s->at);
    numeric_closures_free(&s->closures);
    numeric_classical_free(&s->plain);
    numeric_free(&s->numeric);
    kmp_equations_free(&s->eq);
}

/* -- values ------------------------------------------------------------------------------------------ */

/* The entry of a set, called as kmp_sets_put calls it. */
static double value_of(const stand *s, const values *v, const kmp_assignment *a)
{
    int n = s->eq.n;
    switch (a->set[0]) {
    case 'M':
        return v->mass[a->row * n + a->col];
    case 'C':
    case 'i':
        return v->bias[a->row];
    case 'h':
        return v->h[a->row];
    case 'J':
        return v->jacobian[a->row * n + a->col];
    default:
        return v->jdqd[a->row];
    }
}

/* The size of what an entry is a part of: of M the root of both diagonal entries, else the largest one of its set. */
static double size_of(const stand *s, const values *v, int entry)
{
    const kmp_assignment *a = &s->entry[entry];
    double size = 0;
    int n = s->eq.n;
    if (a->set[0] == 'M')
        return sqrt(v->mass[a->row * n + a->row] * v->mass[a->col * n + a->col]);
    for (int k = 0; k < s->entries; k++)
        if (s->entry[k].set[0] == a->set[0])
            size = fmax(size, fabs(value_of(s, v, &s->entry[k])));
    return size;
}

static double difference(const stand *s, const values *v, int entry, double of_tape)
{
    double off = fabs(value_of(s, v, &s->entry[entry]) - of_tape);
    return off == 0 ? 0 : off / size_of(s, v, entry);
}

/* The largest relative difference from the tape; written C must have the tape's bits. */
static double compare(stand *s)
{
    const values *all[WAYS] = {&s->by_numbers, NULL, NULL, NULL, &s->by_classical, &s->by_plain};
    double off = 0;
    for (int k = 0; k < STATES; k++) {
        for (int w = 0; w < variants_of(s); w++)
            savings[w](s, &s->states[k]);
        for (int e = 0; e < s->entries; e++) {
            double of_tape = s->at[e] < 0 ? 0 : s->by_tape[s->at[e]];
            if (value_of(s, &s->by_code, &s->entry[e]) != of_tape ||
                (s->at[e] >= 0 && s->by_native[s->at[e]] != of_tape))
                stop(s, "written C or machine code has other bits than the tape");
            for (int w = 0; w < variants_of(s); w++)
                off = all[w] ? fmax(off, difference(s, all[w], e, of_tape)) : off;
        }
    }
    if (!(off <= 1e-12))
        stop(s, "values differ by more than 1e-12");
    return off;
}

/* -- times ------------------------------------------------------------------------------------------- */

static double time_of(stand *s, int way, int count)
{
    double begin = bench_now();
    for (int k = 0; k < count; k++)
        savings[way](s, &s->states[k % STATES]);
    return (bench_now() - begin) / count;
}

/* So many evaluations that written C takes a fifth of a millisecond. */
static int choose_count(stand *s)
{
    int count = STATES;
    while (time_of(s, CODE, count) * count < 2e-4)
        count *= 2;
    return count;
}

static double ratio_of(const double a[TURNS], const double b[TURNS])
{
    double ratio[TURNS];
    for (int k = 0; k < TURNS; k++)
        ratio[k] = a[k] / b[k];
    return bench_median(TURNS, ratio);
}

static void take_times(stand *s)
{
    static double time[WAYS][TURNS];
    double sorted[TURNS], ns[WAYS] = {0}, off = compare(s);
    int count = choose_count(s);
    for (int turn = 0; turn < TURNS; turn++)
        for (int w = 0; w < variants_of(s); w++)
            time[w][turn] = time_of(s, w, count);
    for (int w = 0; w < variants_of(s); w++) {
        memcpy(sorted, time[w], sizeof sorted);
        ns[w] = 1e9 * bench_median(TURNS, sorted);
    }
    printf("  %-17s %6ld %6.0f %6.0f %6.0f %6.0f %5.2f %5.2f %5.2f %5.2f", task_names[s->task], s->operations,
           ns[NUMERIC], ns[TAPE], ns[NATIVE], ns[CODE], ratio_of(time[NUMERIC], time[TAPE]),
           ratio_of(time[NUMERIC], time[NATIVE]), ratio_of(time[NUMERIC], time[CODE]),
           ratio_of(time[TAPE], time[CODE]));
    if (s->task == INVERSE)
        printf(" | %6s %6s %6s %5s %5s %5s", "", "", "", "", "", "");
    else
        printf(" | %6ld %6.0f %6.0f %5.2f %5.2f %5.2f", s->classical_operations, ns[CLASSICAL_NUMERIC], ns[CLASSICAL],
               ratio_of(time[CLASSICAL_NUMERIC], time[CLASSICAL]),
               (double)s->classical_operations / (double)s->operations, ratio_of(time[CLASSICAL], time[CODE]));
    printf(" | %.0e\n", off);
    (void)fflush(stdout);
}

static void evaluate(stand *s, int evaluations)
{
    for (int w = 0; w < variants_of(s); w++)
        for (int k = 0; k < evaluations; k++)
            savings[w](s, &s->states[k % STATES]);
}

/* -- models ------------------------------------------------------------------------------------------ */

/* The model without its forces: the tree and its closures. */
static void run_model(kempe_context *context, const char *path, int evaluations, unsigned tasks)
{
    kempe_model *model = NULL;
    if (kempe_model_read(context, path, &model) != KEMPE_OK) {
        fprintf(stderr, "%s\n", kempe_context_message(context));
        exit(1);
    }
    kempe_model bare = *model;
    bare.force_count = 0;
    if (evaluations == 0)
        printf("%s: %d coordinates\n", model->name, model->motion_count);
    for (int k = 0; k < TASKS; k++) {
        stand s;
        if (!(tasks & 1u << k) || !stand_init(&s, &bare, (task_kind)k))
            continue;
        if (evaluations == 0)
            take_times(&s);
        else
            evaluate(&s, evaluations);
        stand_free(&s);
    }
    kempe_model_free(model);
}

static void put_head(void)
{
    printf("  %-17s %-57s | %-39s | %s\n", "", "recursive", "non-recursive", "largest");
    printf("  %-17s %6s %6s %6s %6s %6s %5s %5s %5s %5s | %6s %6s %6s %5s %5s %5s | %s\n", "", "+-*/", "num ns", "tape",
           "native", "C", "num/t", "num/n", "num/C", "t/C", "+-*/", "num ns", "C", "num/C", "+-*/", "C", "difference");
}

static void run_all(kempe_context *context)
{
    static const char *const files[] = {"car44", "roadster52", "humanoid29", "limousine63"};
    static const char *const own[] = {"examples/andrews/andrews.yaml", "examples/stewart/stewart.yaml",
                                      "examples/n_four_bar/n_four_bar_40.yaml", "tests/models/suspension5.yaml",
                                      "tests/models/pendulum9.yaml"};
    const char *folder = getenv("KEMPE_MBS");
    char path[1024];
    for (size_t k = 0; k < sizeof own / sizeof *own; k++)
        run_model(context, own[k], 0, ~0u);
    for (size_t k = 0; folder && k < sizeof files / sizeof *files; k++) {
        snprintf(path, sizeof path, "%s/%s.mbs", folder, files[k]);
        run_model(context, path, 0, ~0u);
    }
    if (!folder)
        printf("KEMPE_MBS names no folder of .mbs files\n");
}

#ifndef BENCH_NUMERIC
#define BENCH_NUMERIC bench_numeric /* compiled a second time with other options: bench_numeric_o2 */
#endif
int BENCH_NUMERIC(int argc, char **argv)
{
    kempe_context *context = kempe_context_new();
    int evaluations = 0, first = 1;
    unsigned tasks = ~0u;
    if (!context)
        return 1;
    for (; first + 1 < argc && argv[first][0] == '-'; first += 2) {
        if (strcmp(argv[first], "--evaluations") == 0)
            evaluations = atoi(argv[first + 1]);
        else if (strcmp(argv[first], "--task") == 0)
            tasks = 1u << atoi(argv[first + 1]);
    }
    if (evaluations == 0)
        put_head();
    if (first == argc)
        run_all(context);
    for (int k = first; k < argc; k++)
        run_model(context, argv[k], evaluations, tasks);
    kempe_context_free(context);
    return 0;
}
