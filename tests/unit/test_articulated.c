/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 2 */
/* Runs by articulated bodies against runs by M and C: the same rows on every formulation that can go by either, on
 * trees and with loops, with what happens on the way: exchanges, redundant rows, change points, events, charts, forces
 * of a program. The choice between the two, and refusals. */
#include "backend/machine.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/motion.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "output/reference.h"
#include "takes_bodies.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <kempe/settings.h>
#include <kempe/workspace.h>
#include <pthread.h>
#include <time.h>

enum { LARGEST = 64, LONG = 160 };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *by[2]; /* by M and C, by articulated bodies */
} scene;

static const char *const words[2] = {"composite", "articulated"};

static void finish(scene *s)
{
    CHECK(s->model);
    for (int k = 0; k < 2 && s->model; k++)
        if (kempe_system_new_with_algorithm(s->model, words[k], &s->by[k]) != KEMPE_OK) {
            printf("%s\n", kempe_context_message(s->context));
            CHECK(s->by[k]);
        }
    CHECK(!takes_bodies(s->by[0]));
    CHECK(takes_bodies(s->by[1]));
}

static scene read_file(const char *path)
{
    char full[512];
    scene s = {.context = kempe_context_new()};
    snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    CHECK(kempe_model_read(s.context, full, &s.model) == KEMPE_OK);
    finish(&s);
    return s;
}

static scene read_text(const char *text)
{
    scene s = {.context = kempe_context_new()};
    if (kempe_model_read_text(s.context, text, "text", &s.model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    finish(&s);
    return s;
}

static void unload(scene *s)
{
    kempe_system_free(s->by[0]);
    kempe_system_free(s->by[1]);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

/* -- runs --------------------------------------------------------------------------------------------- */

enum { TIMES = 8 };

/* q, qd, qdd and lambda at some times, and what came on the way. */
typedef struct rows {
    int n, m, count;
    double value[TIMES][4][LARGEST], work[TIMES];
    unsigned long allocations[2]; /* at the first and the last row */
    kmp_run_report report;
    long notes;
} rows;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    rows *r = user;
    (void)t;
    memcpy(r->value[r->count][0], q, (size_t)r->n * sizeof *q);
    memcpy(r->value[r->count][1], qd, (size_t)r->n * sizeof *q);
    memcpy(r->value[r->count][2], qdd, (size_t)r->n * sizeof *q);
    memcpy(r->value[r->count][3], lambda, (size_t)r->m * sizeof *q);
    r->work[r->count] = work;
    r->allocations[r->count > 0] = kmp_memory_count();
    r->count++;
    return 0;
}

static rows run(const kempe_system *s, const char *formulation, const char *form, double rtol, double t_end)
{
    rows r = {.n = s->n, .m = s->m};
    double times[TIMES];
    kmp_run_log log = {.context = s->context};
    for (int k = 0; k < TIMES; k++)
        times[k] = t_end * k / (TIMES - 1);
    kmp_run_spec spec = {.formulation = formulation,
                         .form = form,
                         .integrator = "dop853",
                         .rtol = rtol,
                         .t_end = t_end,
                         .time_count = TIMES,
                         .times = times,
                         .log = &log};
    CHECK(s->n <= LARGEST && s->m <= LARGEST);
    CHECK(kmp_run_resolve(s, &spec) == KEMPE_OK);
    if (kmp_run(s, &spec, NULL, take_row, &r, &r.report) != KEMPE_OK) {
        printf("%s: %s\n", formulation, r.report.reason ? r.report.reason : kempe_context_message(s->context));
        CHECK(!r.report.reason);
    }
    CHECK(r.count == TIMES);
    kmp_free(r.report.reason);
    r.report.reason = NULL;
    r.notes = log.count;
    kmp_run_log_free(&log);
    return r;
}

/* Largest difference of one quantity, in units of its largest entry, at least 1. */
static double difference(const rows *a, const rows *b, int quantity)
{
    int width = quantity == 3 ? a->m : a->n;
    double off = 0, size = 1;
    for (int k = 0; k < a->count; k++)
        for (int i = 0; i < width; i++) {
            double x = a->value[k][quantity][i], y = b->value[k][quantity][i];
            off = isfinite(y) ? fmax(off, fabs(x - y)) : INFINITY;
            size = check_max(size, fabs(x));
        }
    return off / size;
}

static const char *const savings[3][2] = {{"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}};

/* On all formulations; `multipliers`: they are unique. */
static void compare(const char *name, const scene *s, double rtol, double t_end, double tolerance, bool multipliers)
{
    if (!s->by[0] || !s->by[1])
        return;
    for (int way = 0; way < 3; way++) {
        rows a = run(s->by[0], savings[way][0], savings[way][1], rtol, t_end);
        rows b = run(s->by[1], savings[way][0], savings[way][1], rtol, t_end);
        double off[4];
        for (int k = 0; k < 4; k++)
            off[k] = difference(&a, &b, k);
        printf("   %-22s %-9s q %.1e qd %.1e qdd %.1e lambda %.1e; %ld and %ld steps\n", name, savings[way][way < 2],
               off[0], off[1], off[2], off[3], a.report.steps, b.report.steps);
        CHECK(off[0] <= tolerance && off[1] <= tolerance && off[2] <= 10 * tolerance);
        CHECK(!multipliers || off[3] <= 10 * tolerance);
        for (int k = 0; k < a.count; k++)
            CHECK_NEAR(b.work[k], a.work[k], 10 * tolerance);
        CHECK(a.report.exchanges == b.report.exchanges && a.notes == b.notes);
        if (b.notes == 0 && b.report.centrings == 0)
            CHECK(b.allocations[0] == b.allocations[1]);
    }
}

static void compare_file(const char *path, double rtol, double t_end, double tolerance, bool multipliers)
{
    scene s = read_file(path);
    compare(strrchr(path, '/') + 1, &s, rtol, t_end, tolerance, multipliers);
    unload(&s);
}

static void examples_come_out_the_same(void)
{
    compare_file("examples/andrews/andrews.yaml", 1e-11, 0.03, 1e-11, true);
    compare_file("examples/slider_crank_spatial/slider_crank_spatial.yaml", 1e-11, 0.1, 1e-10, true);
    compare_file("examples/stewart/stewart.yaml", 1e-11, 0.5, 1e-11, true);
    compare_file("examples/parallel_robot/parallel_robot_spatial.yaml", 1e-11, 0.3, 1e-11, true);
    compare_file("examples/stephenson/stephenson.yaml", 1e-11, 0.5, 1e-10, true);
    compare_file("examples/double_wishbone/double_wishbone.yaml", 1e-10, 0.2, 1e-9, true);
}

/* The driven ones do work by their multipliers; Bennett's has more rows than rank. */
static void driven_and_overconstrained(void)
{
    compare_file("examples/driven_slider_crank/driven_slider_crank.yaml", 1e-11, 0.5, 1e-11, true);
    compare_file("examples/bennett/bennett.yaml", 1e-11, 0.5, 1e-10, false);
    compare_file("tests/models/bricard_balls.yaml", 1e-11, 0.5, 1e-8, false);
}

static void armatures(void)
{
    compare_file("tests/models/armed_linkage.yaml", 1e-11, 0.5, 1e-10, true);
}

static void exchanges_and_change_points(void)
{
    scene s = read_file("examples/four_bar/four_bar_spatial.yaml");
    rows r = run(s.by[1], "reduced", "integrated", 1e-10, 1);
    CHECK(r.report.exchanges > 0);
    compare("four_bar_spatial", &s, 1e-11, 1, 1e-10, true);
    unload(&s);
    s = read_file("examples/n_four_bar/n_four_bar.yaml");
    r = run(s.by[1], "reduced", "integrated", 1e-10, 3);
    CHECK(r.notes > 0); /* it goes straight over the flat position, there by M and C */
    compare("n_four_bar", &s, 1e-11, 3, 1e-7, false);
    unload(&s);
}

static void conditions_and_charts(void)
{
    scene s = read_file("tests/models/pendulum_stops.yaml");
    rows r = run(s.by[1], "reduced", "integrated", 1e-11, 1);
    CHECK(r.report.events > 0);
    compare("pendulum_stops", &s, 1e-11, 1, 1e-9, true);
    unload(&s);
    s = read_text("kempe: 1\nname: ball\ngravity: [0, 0, -9.81]\nbodies:\n"
                  "  a: {joint: {name: J, spherical: x, at: ground}, mass: 1, com: [0.05, 0.02, -0.5], "
                  "inertia: {xx: 0.1, yy: 0.12, zz: 0.03}}\nstart: {qd: {J.1: 1.9, J.2: 6, J.3: 1.25}}\n");
    r = run(s.by[1], "reduced", "integrated", 1e-11, 2);
    CHECK(r.report.centrings > 0);
    compare("pendulum on a ball", &s, 1e-11, 2, 1e-8, true);
    unload(&s);
}

static void by_the_references(void)
{
    static const struct {
        const char *model, *reference;
        double tolerance;
    } list[] = {{"examples/andrews/andrews.yaml", "examples/andrews/reference.csv", 1e-9},
                {"examples/four_bar/four_bar.yaml", "examples/four_bar/reference.csv", 1e-8},
                {"examples/slider_crank/slider_crank.yaml", "examples/slider_crank/reference.csv", 1e-9}};
    for (size_t e = 0; e < sizeof list / sizeof *list; e++) {
        char path[512];
        scene s = read_file(list[e].model);
        kmp_reference reference;
        snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, list[e].reference);
        CHECK(kmp_reference_read(s.by[1], path, &reference) == KEMPE_OK);
        double end = reference.t[reference.rows - 1];
        for (int way = 0; way < 3; way++) {
            rows r = run(s.by[1], savings[way][0], savings[way][1], 1e-12, end);
            double off = 0;
            for (int i = 0; i < r.n; i++) {
                double ref = reference.value[KMP_QUANTITY_Q][(reference.rows - 1) * r.n + i];
                off = isnan(ref) ? off : fmax(off, fabs(r.value[TIMES - 1][0][i] - ref) / fmax(fabs(ref), 1));
            }
            printf("   %-45s %-9s %.1e\n", list[e].model, savings[way][way < 2], off);
            CHECK(off <= list[e].tolerance);
        }
        kmp_samples_free(&reference);
        unload(&s);
    }
}

/* -- trees ---------------------------------------------------------------------------------------------- */

/* N joints in a chain or a binary tree, of several kinds, rotations about any axis. */
static void put_tree(kmp_text *text, int n, bool binary)
{
    static const char *const joints[] = {"revolute: z", "revolute: [1, 2, 2]", "prismatic: x", "revolute: y"};
    kmp_text_put(text, "kempe: 1\nname: tree\ngravity: [3, -9, 2]\nbodies:\n");
    for (int b = 1; b <= n; b++) {
        int parent = binary ? b / 2 : b - 1;
        kmp_text_printf(text, "  b%d: {joint: {%s, at: ", b, joints[b % 4]);
        kmp_text_printf(text, parent ? "b%d.P" : "ground", parent);
        kmp_text_put(text, "}, mass: 1.5, com: [0.1, 0.05, 0.15], inertia: {xx: 0.04, yy: 0.05, zz: 0.06}, "
                           "points: {P: [0.2, 0.1, 0.3]}}\n");
    }
    kmp_text_put(text, "forces:\n");
    for (int b = 1; b <= n; b++)
        kmp_text_printf(text, "  f%d: {joint: b%d, spring: {stiffness: 200, damping: 0.3}}\n", b, b);
}

static void trees_need_no_matrix(void)
{
    for (int binary = 0; binary < 2; binary++) {
        kmp_text text = {0};
        put_tree(&text, 20, binary);
        scene s = read_text(text.s);
        kmp_text_free(&text);
        CHECK(s.by[1]->m == 0);
        compare(binary ? "binary tree" : "chain", &s, 1e-11, 0.2, 1e-10, true);
        unload(&s);
    }
}

/* -- the workspace ------------------------------------------------------------------------------------- */

/* Accelerations, multipliers and the values of the same state, at states beside the start and under efforts. */
static void compare_workspaces(const scene *s)
{
    enum { STATES = 5 };
    kempe_workspace *ws[2] = {NULL, NULL};
    kempe_assembly *a = NULL;
    int n = s->by[0]->n, m = s->by[0]->m;
    double q[LARGEST], qd[LARGEST], Q[LARGEST], qdd[2][LARGEST], lambda[2][LARGEST];
    CHECK(kempe_assembly_new(s->by[0], &a) == KEMPE_OK);
    for (int k = 0; k < 2; k++)
        CHECK(kempe_workspace_new(s->by[k], &ws[k]) == KEMPE_OK);
    for (int state = 0; state < STATES; state++) {
        for (int i = 0; i < n; i++) {
            q[i] = a->q[i] + 0.02 * state * sin(state + i) * s->by[0]->scale[i];
            qd[i] = cos(state - i) * s->by[0]->scale[i];
            Q[i] = sin(3 * i);
        }
        CHECK(kempe_workspace_close(ws[0], 0, q, qd, NULL) == KEMPE_OK);
        for (int k = 0; k < 2; k++) {
            unsigned long before = kmp_memory_count();
            CHECK(kempe_workspace_forward_dynamics(ws[k], 0, q, qd, state % 2 ? Q : NULL, qdd[k], lambda[k]) ==
                  KEMPE_OK);
            CHECK(kmp_memory_count() == before);
        }
        for (int i = 0; i < n; i++)
            CHECK_NEAR(qdd[1][i], qdd[0][i], 1e-8 * (1 + fabs(qdd[0][i])));
        for (int r = 0; r < m; r++)
            CHECK_NEAR(lambda[1][r], lambda[0][r], 1e-8 * (1 + fabs(lambda[0][r])));
        for (int i = 0; i < n * n; i++)
            CHECK_NEAR(kempe_workspace_mass(ws[1])[i], kempe_workspace_mass(ws[0])[i], 1e-10);
        CHECK_NEAR(kempe_workspace_kinetic(ws[1]), kempe_workspace_kinetic(ws[0]), 1e-9);
        CHECK_NEAR(kempe_workspace_potential(ws[1]), kempe_workspace_potential(ws[0]), 1e-9);
    }
    kempe_assembly_free(a);
    kempe_workspace_free(ws[0]);
    kempe_workspace_free(ws[1]);
}

static void the_workspace_goes_by_either(void)
{
    static const char *const paths[] = {"examples/four_bar/four_bar.yaml", "examples/andrews/andrews.yaml",
                                        "tests/models/bennett_balls.yaml"}; /* the last has redundant rows */
    for (int k = 0; k < 3; k++) {
        scene s = read_file(paths[k]);
        compare_workspaces(&s);
        unload(&s);
    }
    kmp_text text = {0};
    put_tree(&text, 20, true);
    scene s = read_text(text.s);
    kmp_text_free(&text);
    compare_workspaces(&s);
    unload(&s);
}

/* Seconds of a call, the least of many. */
static double time_of_forward(const kempe_system *system)
{
    static double q[LONG], qd[LONG], qdd[LONG];
    kempe_workspace *ws = NULL;
    double least = INFINITY;
    CHECK(system->n <= LONG && kempe_workspace_new(system, &ws) == KEMPE_OK);
    for (int i = 0; i < system->n; i++)
        q[i] = 0.1 * sin(i);
    for (int k = 0; k < 40; k++) {
        clock_t from = clock();
        for (int call = 0; call < 4; call++)
            CHECK(kempe_workspace_forward_dynamics(ws, 0, q, qd, NULL, qdd, NULL) == KEMPE_OK);
        least = fmin(least, (double)(clock() - from) / 4 / CLOCKS_PER_SEC);
    }
    kempe_workspace_free(ws);
    return least;
}

/* M of so many coordinates alone takes longer than the accelerations without it. */
static void a_long_chain_costs_the_workspace_less(void)
{
    kmp_text text = {0};
    put_tree(&text, LONG, false);
    scene s = read_text(text.s);
    kmp_text_free(&text);
    double by_mass = time_of_forward(s.by[0]), by_bodies = time_of_forward(s.by[1]);
    printf("  %d coordinates: %.0f us by M and C, %.0f by articulated bodies\n", LONG, 1e6 * by_mass, 1e6 * by_bodies);
    CHECK(by_bodies < 0.5 * by_mass);
    unload(&s);
}

/* Seconds of an evaluation of M, C, h, J and jdqd by the workspace, and of the same by the tape, the least of many. */
static void time_evaluations(const kempe_system *system, double *by_workspace, double *by_tape)
{
    const double q[LARGEST] = {0}, qd[LARGEST] = {0};
    kempe_workspace *ws = NULL;
    kmp_evaluator *tape = kmp_eval_new(system, "tape");
    *by_workspace = *by_tape = INFINITY;
    CHECK(tape && system->n <= LARGEST && kempe_workspace_new(system, &ws) == KEMPE_OK);
    for (int k = 0; k < 400; k++) {
        clock_t from = clock();
        for (int call = 0; call < 10; call++)
            CHECK(kempe_workspace_evaluate(ws, 0, q, qd) == KEMPE_OK);
        clock_t between = clock();
        for (int call = 0; call < 10; call++) {
            kmp_eval_closure(tape, 0, q);
            kmp_eval_mass(tape);
            kmp_eval_bias(tape, qd);
        }
        *by_workspace = fmin(*by_workspace, (double)(between - from) / 10 / CLOCKS_PER_SEC);
        *by_tape = fmin(*by_tape, (double)(clock() - between) / 10 / CLOCKS_PER_SEC);
    }
    kempe_workspace_free(ws);
    kmp_eval_free(tape);
}

/* As runs do, where the machine has any. */
static void the_workspace_runs_machine_code(void)
{
    double by_workspace, by_tape;
    if (strcmp(kmp_backend_default(), "tape") == 0)
        return;
    scene s = read_file("examples/limousine/limousine.yaml");
    time_evaluations(s.by[0], &by_workspace, &by_tape);
    printf("  an evaluation: %.1f us by the workspace, %.1f by the tape\n", 1e6 * by_workspace, 1e6 * by_tape);
    CHECK(by_workspace < 0.8 * by_tape);
    unload(&s);
}

/* -- which of the two ---------------------------------------------------------------------------------- */

/* A chain that auto writes by bodies, with what comes behind it. */
static kempe_system *chain_with(kempe_context *context, kempe_model **model, const char *more)
{
    kmp_text text = {0};
    kempe_system *system = NULL;
    put_tree(&text, 24, false);
    char *forces = strstr(text.s, "forces:");
    size_t bodies = (size_t)(forces - text.s);
    kmp_text all = {0};
    kmp_text_printf(&all, "%.*s%s", (int)bodies, text.s, more);
    if (kempe_model_read_text(context, all.s, "text", model) != KEMPE_OK ||
        kempe_system_new(*model, &system) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(system);
    kmp_text_free(&text);
    kmp_text_free(&all);
    return system;
}

/* True if `auto` chooses articulated bodies. */
static bool auto_takes(const char *path)
{
    scene s = read_file(path);
    kempe_system *system = NULL;
    CHECK(kempe_system_new_with_algorithm(s.model, "auto", &system) == KEMPE_OK);
    bool taken = takes_bodies(system);
    kempe_system_free(system);
    unload(&s);
    return taken;
}

static void auto_takes_what_costs_less(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = chain_with(context, &model, "");
    CHECK(takes_bodies(system));
    kempe_system_free(system);
    kempe_model_free(model);
    CHECK(!auto_takes("examples/andrews/andrews.yaml"));
    CHECK(!auto_takes("examples/stewart/stewart.yaml"));
    CHECK(!auto_takes("examples/n_four_bar/n_four_bar_40.yaml")); /* 80 rows on 81 coordinates */
    /* twenty loops that stand beside each other leave M^-1 J' thin */
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nname: beside\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
    for (int k = 0; k < 20; k++)
        kmp_text_printf(
            &text,
            "  a%d: {joint: {revolute: z, at: ground}, mass: 1, com: [0.2, 0, 0], points: {P: [0.4, 0, 0]}}\n"
            "  b%d: {joint: {revolute: z, at: a%d.P}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, points: "
            "{P: [1, 0, 0]}}\n",
            k, k, k);
    kmp_text_put(&text, "loops:\n");
    for (int k = 0; k < 20; k++)
        kmp_text_printf(&text, "  l%d: {point_on_line: [ground.O, b%d.P], axis: x}\n", k, k);
    model = NULL;
    CHECK(kempe_model_read_text(context, text.s, "text", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && takes_bodies(system));
    kmp_text_free(&text);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

typedef struct asking {
    const kempe_system *system;
    const kmp_program *program;
} asking;

static void *ask(void *self)
{
    asking *a = self;
    CHECK(kmp_motion_need_bodies(a->system) == KEMPE_OK);
    a->program = a->system->bodies->program;
    return NULL;
}

/* They are derived for runs that may take them, once for all threads. */
static void they_are_made_at_their_first_use(void)
{
    enum { THREADS = 4 };
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = chain_with(context, &model, "");
    kmp_run_spec spec = {.integrator = "radau5", .t_end = 0.01};
    kmp_run_report report = {0};
    CHECK(kmp_run_resolve(system, &spec) == KEMPE_OK);
    CHECK(kmp_run(system, &spec, NULL, NULL, NULL, &report) == KEMPE_OK && !report.by_bodies);
    CHECK(!atomic_load(&system->bodies->made));
    pthread_t thread[THREADS];
    asking asked[THREADS];
    for (int k = 0; k < THREADS; k++) {
        asked[k] = (asking){system, NULL};
        CHECK(pthread_create(&thread[k], NULL, ask, &asked[k]) == 0);
    }
    for (int k = 0; k < THREADS; k++) {
        CHECK(pthread_join(thread[k], NULL) == 0);
        CHECK(asked[k].program && asked[k].program == system->bodies->program);
    }
    kempe_system_free(system);
    system = NULL;
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && !atomic_load(&system->bodies->made));
    rows r = run(system, "reduced", "integrated", 1e-8, 0.01);
    CHECK(r.report.by_bodies && atomic_load(&system->bodies->made));
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* The word of a model holds where the call gives none; M column by column gives the same run. */
static void words_of_a_model(void)
{
    scene s = read_text("kempe: 1\nname: word\ngravity: [0, -9.81, 0]\nbodies:\n"
                        "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], points: {P: [1, 0, 0]}}\n"
                        "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [0.3, 0, 0]}\n"
                        "run: {algorithm: articulated}\n");
    kempe_system *own = NULL, *ner = NULL;
    CHECK(kempe_system_new(s.model, &own) == KEMPE_OK && takes_bodies(own));
    CHECK(kempe_system_new_with_algorithm(s.model, "ner", &ner) == KEMPE_OK && !takes_bodies(ner));
    rows a = run(s.by[0], "reduced", "integrated", 1e-11, 1), b = run(ner, "reduced", "integrated", 1e-11, 1);
    rows c = run(own, "reduced", "integrated", 1e-11, 1);
    CHECK(difference(&a, &b, 0) < 1e-10 && !b.report.by_bodies);
    CHECK(difference(&a, &c, 0) < 1e-10 && c.report.by_bodies);
    kempe_system_free(own);
    kempe_system_free(ner);
    unload(&s);
}

/* Universal and spherical joints as two and three motions have links without mass between them. */
static void massless_links_between(void)
{
    scene s =
        read_text("kempe: 1\nname: joints\ngravity: [0, 0, -9.81]\nbodies:\n"
                  "  a: {joint: {universal: [x, y], at: ground}, mass: 1, com: [0.1, 0.2, 0.5], inertia: {xx: 0.1, "
                  "yy: 0.12, zz: 0.03}, points: {P: [0, 0, 1]}}\n"
                  "  b: {joint: {spherical: x, at: a.P}, mass: 1, com: [0.1, 0.3, 0.5], inertia: {xx: 0.1, yy: "
                  "0.12, zz: 0.03}}\n");
    compare("massless links", &s, 1e-11, 0.3, 1e-9, true);
    unload(&s);
}

/* -- what it refuses ------------------------------------------------------------------------------------ */

static void massless_ends_fall_back(void)
{
    static const char hook[] = "  hook: {joint: {revolute: z, at: b24.P}}\n"
                               "loops:\n  G: {coupler: {hook: 1, b24: -1}}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = chain_with(context, &model, hook), *none = NULL;
    CHECK(!takes_bodies(system));
    CHECK_TEXT(kempe_context_message(context), "");
    CHECK(kempe_system_new_with_algorithm(model, "articulated", &none) == KEMPE_E_FAILED && !none);
    CHECK_TEXT(kempe_context_message(context),
               "the O(N) scheme divides by the inertia that a coordinate moves, and coordinate 'hook' of body 'hook' "
               "moves none; give the bodies it moves an inertia about its axis, or use M and C");
    CHECK(kempe_system_new_with_algorithm(model, "articulate", &none) == KEMPE_E_ARGUMENT && !none);
    CHECK_TEXT(kempe_context_message(context), "unknown algorithm 'articulate'; available: auto, composite, plain, "
                                               "ner, articulated; did you mean 'articulated'?");
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* Two joints about almost the same axis, and a loop that makes their motion definite: what is left of the inertia
 * behind the second is rounding. */
static void rounding_is_no_inertia(void)
{
    static const char twice[] =
        "  c: {joint: {revolute: z, at: ground}, points: {P: [1e-12, 0, 0]}}\n"
        "  d: {joint: {revolute: z, at: c.P}, mass: 1, com: [0.3, 0.2, 0], inertia: {zz: 0.1}}\n"
        "loops:\n  G: {coupler: {c: 1, d: -1}}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = chain_with(context, &model, twice), *forced = NULL, *plain = NULL;
    CHECK(takes_bodies(system));
    CHECK(kempe_system_new_with_algorithm(model, "composite", &plain) == KEMPE_OK);
    if (system && plain) {
        rows a = run(plain, "reduced", "integrated", 1e-9, 0.05), b = run(system, "reduced", "integrated", 1e-9, 0.05);
        CHECK(memcmp(a.value, b.value, sizeof a.value) == 0);
    }
    CHECK(kempe_system_new_with_algorithm(model, "articulated", &forced) == KEMPE_OK);
    kmp_run_spec spec = {.t_end = 0.05};
    kmp_run_report report = {0};
    CHECK(forced && kmp_run_resolve(forced, &spec) == KEMPE_OK);
    CHECK(forced && kmp_run(forced, &spec, NULL, NULL, NULL, &report) == KEMPE_E_FAILED);
    printf("   %s\n", report.reason ? report.reason : "");
    CHECK(
        report.reason &&
        strstr(report.reason, "algorithm articulated: with open loops some motion has almost no inertia at the start"));
    kmp_free(report.reason);
    kempe_system_free(system);
    kempe_system_free(plain);
    kempe_system_free(forced);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* T + V of a row, by M and C. */
static double energy_of(kempe_workspace *ws, const kempe_trajectory *t, int row)
{
    CHECK(kempe_workspace_evaluate(ws, kempe_trajectory_time(t, row), kempe_trajectory_q(t, row),
                                   kempe_trajectory_qd(t, row)) == KEMPE_OK);
    return kempe_workspace_kinetic(ws) + kempe_workspace_potential(ws);
}

/* A load at the end of a chain of light links, level at the start: by M and C and by articulated bodies accelerations
 * differ by the condition of M, and both solve the system to rounding. */
static void a_bad_condition_is_no_reason_against_them(void)
{
    enum { LINKS = 50 };
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nname: load\ngravity: [0, -9.81, 0]\nbodies:\n");
    for (int k = 0; k < LINKS; k++) {
        char at[16] = "ground";
        if (k > 0)
            snprintf(at, sizeof at, "b%d.T", k - 1);
        kmp_text_printf(&text,
                        "  b%d: {joint: {revolute: z, at: %s}, mass: %g, com: [0.05, 0, 0], inertia: {zz: %g}, "
                        "points: {T: [0.1, 0, 0]}}\n",
                        k, at, k < LINKS - 1 ? 1e-3 : 1e3, k < LINKS - 1 ? 1e-6 : 1.0);
    }
    static const char *const algorithms[] = {"auto", "articulated"};
    for (int way = 0; way < 2; way++) {
        const kempe_run_options options = {
            .t_end = 0.1, .rtol = 1e-9, .integrator = "dop853", .no_convergence_check = 1};
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        kempe_system *system = NULL;
        kempe_trajectory *t = NULL;
        kempe_workspace *ws = NULL;
        char *printed = NULL;
        CHECK(kempe_model_read_text(context, text.s, "load", &model) == KEMPE_OK);
        CHECK(kempe_system_new_with_algorithm(model, algorithms[way], &system) == KEMPE_OK);
        CHECK(system && kempe_simulate(system, &options, &t) == KEMPE_OK);
        CHECK(kempe_trajectory_print(t, KEMPE_TEXT, &printed) == KEMPE_OK);
        CHECK(printed && strstr(printed, "articulated-body algorithm"));
        CHECK(kempe_workspace_new(system, &ws) == KEMPE_OK);
        const double fall = 1e3 * 9.81 * 0.05; /* the size of what is exchanged */
        CHECK_NEAR(energy_of(ws, t, kempe_trajectory_row_count(t) - 1) / fall, energy_of(ws, t, 0) / fall, 1e-9);
        kempe_text_free(printed);
        kempe_workspace_free(ws);
        kempe_trajectory_free(t);
        kempe_system_free(system);
        kempe_model_free(model);
        kempe_context_free(context);
    }
    kmp_text_free(&text);
}

/* It comes to rest where the first joint moves nothing with the loop open. */
static void bodies_are_left_where_rounding_shows(void)
{
    scene s = read_text("kempe: 1\nname: rest\nbodies:\n"
                        "  c: {joint: {revolute: z, at: ground}, points: {P: [0.3, 0, 0]}}\n"
                        "  d: {joint: {revolute: z, at: c.P}, mass: 1, com: [0.3, 0, 0]}\n"
                        "loops:\n  G: {coupler: {c: 1, d: -1}}\n"
                        "forces:\n  s: {joint: c, spring: {stiffness: 20, damping: 8}}\n"
                        "start: {q: {c: 1, d: 1}}\n");
    for (int way = 0; way < 3; way++) {
        rows a = run(s.by[0], savings[way][0], savings[way][1], 1e-9, 12),
             b = run(s.by[1], savings[way][0], savings[way][1], 1e-9, 12);
        printf("   %-9s q %.1e; %ld and %ld steps\n", savings[way][way < 2], difference(&a, &b, 0), a.report.steps,
               b.report.steps);
        CHECK(b.report.by_bodies && b.notes == 1 && a.notes == 0);
        CHECK(difference(&a, &b, 0) < 1e-8 && difference(&a, &b, 2) < 1e-6);
        CHECK(b.report.steps < 2 * a.report.steps);
    }
    unload(&s);
}

/* A bead on a thin rod, whose inertia about its own axis with the loop open goes to zero as the bead slides to the rod.
 * The loop holds the rod. */
static void the_workspace_leaves_bodies_where_digits_are_lost(void)
{
    scene s = read_text(
        "kempe: 1\nname: thin\ngravity: [0, -9.81, 0]\nbodies:\n"
        "  arm: {mass: 2, inertia: {xx: 0.02, yy: 0.02, zz: 0.02}, joint: {revolute: z, at: ground},\n"
        "    points: {P: [0.3, 0.1, 0], Q: {at: [0.5, 0.2, 0.1], axes: {x: [1, 0.4, 0.3], y: [-0.2, 1, 0.5]}}}}\n"
        "  rod: {mass: 1, com: [0.3, 0, 0], inertia: {as_given: yes, xx: 1e-12, yy: 0.03, zz: 0.03},\n"
        "    joint: {motions: [T1, T2, T3, R3, R2, R1], at: arm.P}, points: {O: [0, 0, 0],\n"
        "      R: {at: [0.2, 0.1, 0.1], axes: {x: [1, 0.4, 0.3], y: [-0.2, 1, 0.5]}}}}\n"
        "  bead: {mass: 0.1, joint: {prismatic: y, at: rod.O}}\n"
        "loops:\n  held: {weld: [arm.Q, rod.R]}\n"
        "start: {q: {bead: 0.1, arm: 0.3}}\n");
    kempe_assembly *a = NULL;
    kempe_workspace *ws[2] = {NULL, NULL};
    double qdd[2][8], lambda[2][6], worst = 0;
    CHECK(kempe_assembly_new(s.by[0], &a) == KEMPE_OK);
    for (int k = 0; k < 2; k++)
        CHECK(kempe_workspace_new(s.by[k], &ws[k]) == KEMPE_OK);
    for (double bead = 0.1; bead > 1e-5; bead *= 0.7) {
        double q[8], qd[8] = {1, 1, 1, 1, 1, 1, 1, 1};
        memcpy(q, a->q, sizeof q);
        q[7] = bead;
        CHECK(kempe_workspace_close(ws[0], 0, q, qd, NULL) == KEMPE_OK);
        for (int k = 0; k < 2; k++)
            CHECK(kempe_workspace_forward_dynamics(ws[k], 0, q, qd, NULL, qdd[k], lambda[k]) == KEMPE_OK);
        for (int i = 0; i < 8; i++)
            worst = fmax(worst, fabs(qdd[1][i] - qdd[0][i]) / 12.6);
    }
    printf("   accelerations differ by %.1e\n", worst);
    CHECK(worst < 1e-10); /* 5e-10 where only pivots below 1e-8 of others were left */
    kempe_assembly_free(a);
    kempe_workspace_free(ws[0]);
    kempe_workspace_free(ws[1]);
    unload(&s);
}

/* Five hundred couplers in a row: all are eliminated at the ground, each beside its neighbours alone. */
static void many_rows_are_carried(void)
{
    enum { MANY = 502 };
    kmp_text text = {0};
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    const kempe_run_options options = {.integrator = "dop853", .t_end = 1, .output_step = 1};
    kmp_text_put(&text, "kempe: 1\nname: many\nbodies:\n");
    for (int k = 0; k < MANY; k++)
        kmp_text_printf(&text, "  b%d: {joint: {prismatic: x, at: ground}, mass: 1}\n", k);
    kmp_text_put(&text, "loops:\n");
    for (int k = 0; k + 1 < MANY; k++)
        kmp_text_printf(&text, "  l%d: {coupler: {b%d: 1, b%d: -1}}\n", k, k, k + 1);
    kmp_text_printf(&text, "forces:\n  f: {joint: b7, force: %d}\n", MANY);
    CHECK(kempe_model_read_text(context, text.s, "text", &model) == KEMPE_OK);
    CHECK(kempe_system_new_with_algorithm(model, "articulated", &system) == KEMPE_OK && takes_bodies(system));
    long operations = kmp_program_count(system->bodies->program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
    printf("   %d couplers: %ld operations\n", MANY - 1, operations);
    CHECK(operations < 30L * MANY);
    CHECK(kempe_simulate(system, &options, &t) == KEMPE_OK);
    for (int k = 0; t && k < MANY; k++)
        CHECK_NEAR(kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1)[k], 0.5, 1e-10);
    kmp_text_free(&text);
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* -- choices of rows ------------------------------------------------------------------------------------ */

/* Two systems with other rows of a loop that is given twice share an evaluator: each has its own multipliers, also
 * after the other one has been made. */
static void choices_of_rows_stay_apart(void)
{
    scene s = read_text("kempe: 1\nname: twice\nground: {points: {G: [1, 0, 0]}}\ngravity: [0, -9.81, 0]\nbodies:\n"
                        "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.2, 0, 0], inertia: {zz: 0.1}, "
                        "points: {P: [0.5, 0, 0]}}\n"
                        "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, "
                        "points: {P: [1, 0, 0]}}\n"
                        "  c: {joint: {revolute: z, at: ground.G}, mass: 1, com: [0.2, 0, 0], inertia: {zz: 0.1}, "
                        "points: {P: [0.5, 0, 0]}}\n"
                        "loops:\n  k: {ball: [b.P, c.P]}\n  l: {ball: [b.P, c.P]}\n"
                        "start: {q: {a: 1, b: -1, c: 1}}\n");
    kmp_evaluator *eval = kmp_eval_new(s.by[1], "tape");
    const double q[3] = {1, -1, 1}, qd[3] = {0};
    double qdd[2][3], lambda[2][4];
    int kept[2][2] = {{0, 1}, {2, 3}}, left[2][2] = {{2, 3}, {0, 1}};
    kmp_saddle saddle[2];
    kmp_partition part[2];
    CHECK(s.by[1]->m == 4 && kmp_eval_add_articulated(eval) == KEMPE_OK);
    kmp_eval_set_by_bodies(eval, true);
    for (int k = 0; k < 2; k++) {
        part[k] = (kmp_partition){.n = 3, .m = 4, .r = 2, .p = 1, .rows = kept[k], .redundant = left[k]};
        CHECK(kmp_saddle_init(&saddle[k], eval, &part[k]));
    }
    for (int turn = 0; turn < 2; turn++)
        for (int k = 0; k < 2; k++) {
            kmp_eval_closure(eval, 0, q);
            kmp_eval_mass(eval);
            kmp_eval_bias(eval, qd);
            CHECK(kmp_saddle_factor(&saddle[k]) == 0);
            kmp_saddle_accelerations(&saddle[k], qdd[k], lambda[k]);
        }
    for (int i = 0; i < 3; i++)
        CHECK_NEAR(qdd[0][i], qdd[1][i], 1e-12);
    for (int r = 0; r < 2; r++) {
        CHECK(fabs(lambda[0][r]) > 1e-3 && lambda[0][2 + r] == 0 && lambda[1][r] == 0);
        CHECK_NEAR(lambda[0][r], lambda[1][2 + r], 1e-12);
    }
    for (int k = 0; k < 2; k++)
        kmp_saddle_free(&saddle[k]);
    kmp_eval_free(eval);
    unload(&s);
}

/* -- a program's force ---------------------------------------------------------------------------------- */

static int brake(void *user, double t, const double *q, const double *qd, double *effort)
{
    for (int i = 0; i < *(const int *)user; i++)
        effort[i] += sin(3 * t) - 0.1 * qd[i] - 0.2 * q[i];
    return 0;
}

static void forces_of_a_program(void)
{
    scene s = read_file("examples/parallel_robot/parallel_robot_spatial.yaml");
    for (int k = 0; k < 2; k++)
        kempe_system_set_force(s.by[k], brake, &s.by[k]->n);
    compare("with a force", &s, 1e-11, 0.3, 1e-9, true);
    unload(&s);
}

int main(void)
{
    TEST(examples_come_out_the_same);
    TEST(driven_and_overconstrained);
    TEST(armatures);
    TEST(exchanges_and_change_points);
    TEST(conditions_and_charts);
    TEST(by_the_references);
    TEST(trees_need_no_matrix);
    TEST(the_workspace_goes_by_either);
    TEST(a_long_chain_costs_the_workspace_less);
    TEST(the_workspace_runs_machine_code);
    TEST(auto_takes_what_costs_less);
    TEST(they_are_made_at_their_first_use);
    TEST(words_of_a_model);
    TEST(massless_links_between);
    TEST(massless_ends_fall_back);
    TEST(rounding_is_no_inertia);
    TEST(a_bad_condition_is_no_reason_against_them);
    TEST(bodies_are_left_where_rounding_shows);
    TEST(the_workspace_leaves_bodies_where_digits_are_lost);
    TEST(many_rows_are_carried);
    TEST(choices_of_rows_stay_apart);
    TEST(forces_of_a_program);
    return check_report();
}
