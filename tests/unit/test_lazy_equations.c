/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 4 */
/* wings: exchange */
/* M and C that wait for their first use: runs by articulated bodies need none, and what takes their place equals them.
 */
#include "base/memory.h"
#include "bench/trees.h"
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/motion.h"
#include "loaded.h"
#include "random.h"
#include "studies/simulate/trajectory.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <kempe/table.h>
#include <kempe/workspace.h>
#include <math.h>
#include <pthread.h>
#include <string.h>

static const char file[] = "tests/models/three_bogies.yaml";

enum { STATES = 4, MOST = 80 };

static bool waits(const loaded *l)
{
    return l->system && l->system->late && !kmp_motion_is_made(l->system) && !l->system->motion;
}

static kempe_trajectory *run(const kempe_system *s, const char *integrator)
{
    const kempe_run_options options = {.formulation = "reduced",
                                       .integrator = integrator,
                                       .rtol = 1e-6,
                                       .t_end = 1e-3,
                                       .output_step = 5e-4,
                                       .no_convergence_check = 1};
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(s, &options, &t) == KEMPE_OK);
    return t;
}

/* -- who waits --------------------------------------------------------------------------------------- */

/* Models without equations solved by iteration, small ones, and those of which M and C are requested. */
static void others_do_not_wait(void)
{
    static const char *const files[] = {"examples/limousine/limousine.yaml", "examples/bogie_track/bogie_track.yaml"};
    for (size_t k = 0; k < sizeof files / sizeof *files; k++) {
        loaded l = load(files[k]);
        CHECK(l.system && !l.system->late && l.system->motion);
        unload(&l);
    }
    loaded l = load(file);
    kempe_system *by_mass = NULL;
    CHECK(waits(&l) && kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
    CHECK(by_mass && !by_mass->late && by_mass->motion);
    kempe_system_free(by_mass);
    unload(&l);
}

/* -- runs --------------------------------------------------------------------------------------------- */

static double apart(const kempe_trajectory *a, const kempe_trajectory *b, int n)
{
    int row = kempe_trajectory_row_count(a) - 1;
    double most = row == kempe_trajectory_row_count(b) - 1 ? 0 : INFINITY;
    for (int i = 0; i < n && most < INFINITY; i++)
        most = fmax(most, fabs(kempe_trajectory_q(a, row)[i] - kempe_trajectory_q(b, row)[i]));
    return most;
}

/* An explicit run needs none of them, an implicit one does; both follow the motion by M and C. */
static void runs_by_bodies_need_none(void)
{
    loaded l = load(file);
    kempe_system *by_mass = NULL;
    CHECK(waits(&l) && kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
    kempe_trajectory *t = run(l.system, "dop853"), *other = run(by_mass, "dop853");
    CHECK(waits(&l) && l.system->bodies->program);
    CHECK(apart(t, other, l.system->n) < 1e-9);
    CHECK(t->verdict.drift_rel < 1e-6 && fabs(t->verdict.drift_rel - other->verdict.drift_rel) < 1e-9);
    kempe_trajectory *implicit = run(l.system, "radau5"), *implicit_by_mass = run(by_mass, "radau5");
    CHECK(kmp_motion_is_made(l.system) && l.system->motion);
    CHECK(apart(implicit, implicit_by_mass, l.system->n) < 1e-9);
    kempe_trajectory_free(t);
    kempe_trajectory_free(other);
    kempe_trajectory_free(implicit);
    kempe_trajectory_free(implicit_by_mass);
    kempe_system_free(by_mass);
    unload(&l);
}

/* -- values ------------------------------------------------------------------------------------------- */

static void place(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd);
}

static int push(void *user, double t, const double *q, const double *qd, double *effort)
{
    for (int i = 0; i < *(const int *)user; i++)
        effort[i] = 300 * cos(t) - 200 * qd[i] + q[i];
    return 0;
}

/* M, C and jdqd, their power and energy, with efforts of the user and given ones. */
static void check_values(kempe_system *s, const kempe_assembly *at, bool pushed)
{
    int n = s->n;
    double qd[MOST], given[MOST];
    kmp_evaluator *weighing = kmp_eval_new_for(s, "tape", NULL, KMP_EVAL_WEIGHS);
    CHECK(weighing && weighing->weighs_only && kmp_eval_add_articulated(weighing) == KEMPE_OK);
    CHECK(!kmp_motion_is_made(s));
    kmp_evaluator *whole = kmp_eval_new(s, "tape");
    CHECK(whole && !whole->weighs_only && kmp_motion_is_made(s));
    random_seed(3);
    for (int k = 0; k < STATES; k++) {
        for (int i = 0; i < n; i++) {
            qd[i] = at->qd[i] + 0.1 * between(-1, 1);
            given[i] = between(-50, 50);
        }
        kempe_system_set_force(s, pushed ? push : NULL, &n);
        place(weighing, 0.1 * k, at->q, qd);
        place(whole, 0.1 * k, at->q, qd);
        kmp_eval_set_effort(weighing, pushed ? given : NULL);
        kmp_eval_set_effort(whole, pushed ? given : NULL);
        CHECK(check_apart(s->mass.count, weighing->mass, whole->mass) < 1e-12);
        CHECK(check_apart(n, weighing->bias, whole->bias) < 1e-9);
        CHECK(check_apart(s->m, weighing->jdqd, whole->jdqd) < 1e-9);
        CHECK(check_apart(s->jacobian.count, weighing->jacobian, whole->jacobian) < 1e-12);
        double power = kmp_eval_power_here(weighing, qd), other = kmp_eval_power_here(whole, qd);
        CHECK(fabs(power - other) <= 1e-9 * fabs(other) && fabs(other) > 0);
        power = kmp_eval_kinetic(weighing, qd);
        CHECK(fabs(power - kmp_eval_kinetic(whole, qd)) <= 1e-12 * power);
    }
    CHECK(kmp_eval_add_composite(weighing) == KEMPE_OK && !weighing->weighs_only);
    place(weighing, 0.3, at->q, qd);
    place(whole, 0.3, at->q, qd);
    CHECK(memcmp(weighing->mass, whole->mass, (size_t)s->mass.count * sizeof(double)) == 0);
    CHECK(memcmp(weighing->bias, whole->bias, (size_t)n * sizeof(double)) == 0);
    kmp_eval_free(weighing);
    kmp_eval_free(whole);
    kempe_system_set_force(s, NULL, NULL);
}

static void values_are_those_of_m_and_c(void)
{
    for (int pushed = 0; pushed < 2; pushed++) {
        loaded l = load(file);
        kempe_assembly *start = NULL;
        CHECK(waits(&l) && kempe_assembly_new(l.system, &start) == KEMPE_OK);
        if (start)
            check_values(l.system, start, pushed);
        kempe_assembly_free(start);
        unload(&l);
    }
}

/* -- large trees ---------------------------------------------------------------------------------------- */

/* A tree of joints of all axes, with springs, dampers, armatures and a force that depends on time. */
static loaded load_tree(tree_shape shape, int n)
{
    kmp_text text = {0};
    char *bodies = tree_text(shape, n);
    kmp_text_put(&text, bodies);
    kmp_text_put(&text, "forces:\n");
    for (int b = 1; b <= n; b += 3)
        kmp_text_printf(&text, "  s%d: {joint: q%d, spring: {stiffness: 40, rest: 0.1, damping: 0.3}}\n", b, b);
    kmp_text_printf(&text, "  e: {joint: q%d, force: 3 * sin(20 * t)}\n", n);
    kmp_text_put(&text, "start: {qd: {q1: 0.2, q2: -0.1, q5: 0.3}}\n");
    loaded l = load_text(text.s);
    kmp_text_free(&text);
    kmp_free(bodies);
    return l;
}

/* Energies and power by links are those by M, at random states; M is then made, with the entries of a system that does
 * not wait. */
static void check_links(const loaded *l, const kempe_system *by_mass)
{
    kempe_system *s = l->system;
    int n = s->n;
    double q[MOST], qd[MOST];
    CHECK(n <= MOST && s->late->by_links && s->mass.count == 0);
    kmp_evaluator *links = kmp_eval_new_for(s, "tape", NULL, KMP_EVAL_WEIGHS), *whole = kmp_eval_new(by_mass, "tape");
    CHECK(links && kmp_eval_goes_by_links(links) && whole && kmp_eval_add_articulated(links) == KEMPE_OK);
    kmp_eval_set_by_bodies(links, true);
    random_seed(5);
    for (int k = 0; k < STATES; k++) {
        for (int i = 0; i < n; i++) {
            q[i] = between(-1, 1);
            qd[i] = between(-1, 1);
        }
        place(links, 0.1 * k, q, qd);
        place(whole, 0.1 * k, q, qd);
        double x = kmp_eval_kinetic(links, qd), y = kmp_eval_kinetic(whole, qd);
        CHECK(fabs(x - y) <= 1e-13 * y);
        x = kmp_eval_potential(links, 0.1 * k, q);
        y = kmp_eval_potential(whole, 0.1 * k, q);
        CHECK(fabs(x - y) <= 1e-12 * fabs(y));
        x = kmp_eval_power(links, 0.1 * k, q, qd);
        y = kmp_eval_power(whole, 0.1 * k, q, qd);
        CHECK(fabs(x - y) <= 1e-12 * fabs(y));
    }
    kmp_eval_free(links);
    kmp_eval_free(whole);
    kempe_workspace *ws[2] = {NULL, NULL};
    CHECK(!kmp_motion_is_made(s) && kempe_workspace_new(s, &ws[0]) == KEMPE_OK && kmp_motion_is_made(s));
    CHECK(kempe_workspace_new(by_mass, &ws[1]) == KEMPE_OK && s->mass.count == by_mass->mass.count);
    for (int k = 0; k < 2; k++)
        CHECK(kempe_workspace_evaluate(ws[k], 0, q, qd) == KEMPE_OK);
    CHECK(check_apart(n * n, kempe_workspace_mass(ws[0]), kempe_workspace_mass(ws[1])) < 1e-13);
    CHECK(check_apart(n, kempe_workspace_bias(ws[0]), kempe_workspace_bias(ws[1])) < 1e-12);
    CHECK_NEAR(kempe_workspace_kinetic(ws[0]), kempe_workspace_kinetic(ws[1]), 1e-12);
    kempe_workspace_free(ws[0]);
    kempe_workspace_free(ws[1]);
}

static void large_trees_go_by_links(void)
{
    for (int shape = 0; shape < TREE_SHAPES; shape++) {
        loaded l = load_tree((tree_shape)shape, 60);
        kempe_system *by_mass = NULL;
        CHECK(waits(&l) && kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
        kempe_trajectory *t = run(l.system, "dop853"), *other = run(by_mass, "dop853");
        kempe_table *table = NULL;
        CHECK(waits(&l) && apart(t, other, l.system->n) < 1e-10);
        CHECK(fabs(t->verdict.drift_rel - other->verdict.drift_rel) < 1e-11);
        CHECK(kempe_trajectory_table(t, "rows", &table) == KEMPE_OK && waits(&l)); /* nor do tables need M */
        int n = l.system->n;
        kempe_system_set_force(l.system, push, &n);
        kempe_system_set_force(by_mass, push, &n);
        kempe_trajectory *pushed = run(l.system, "dop853"), *other_pushed = run(by_mass, "dop853");
        CHECK(waits(&l) && apart(pushed, other_pushed, n) < 1e-10 && apart(pushed, t, n) > 1e-6);
        kempe_trajectory_free(pushed);
        kempe_trajectory_free(other_pushed);
        kempe_system_set_force(l.system, NULL, NULL);
        kempe_system_set_force(by_mass, NULL, NULL);
        check_links(&l, by_mass);
        kempe_trajectory *implicit = run(l.system, "radau5");
        CHECK(apart(implicit, other, l.system->n) < 1e-6);
        kempe_table_free(table);
        kempe_trajectory_free(t);
        kempe_trajectory_free(other);
        kempe_trajectory_free(implicit);
        kempe_system_free(by_mass);
        unload(&l);
    }
}

/* Two joints about one axis at the end of a long chain, the first of which moves no mass: no algorithm determines its
 * motion, and M, which waits, is made to say so. */
static void massless_joints_of_large_trees_are_named(void)
{
    kmp_text text = {0};
    char *bodies = tree_text(TREE_LINEAR, 60);
    kmp_text_put(&text, bodies);
    kmp_text_put(&text, "  c: {joint: {revolute: z, at: b60}}\n"
                        "  d: {joint: {revolute: z, at: c}, mass: 1, com: [0.3, 0.2, 0], inertia: {zz: 0.1}}\n");
    loaded l = load_text(text.s);
    const kempe_run_options options = {.t_end = 1e-3};
    kempe_trajectory *t = NULL;
    CHECK(waits(&l) && l.system->late->by_links);
    CHECK(kempe_simulate(l.system, &options, &t) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "the motion of 'c' together with 'd' moves no mass"));
    kempe_trajectory_free(t);
    unload(&l);
    kmp_text_free(&text);
    kmp_free(bodies);
}

/* A chain of two thousand links is prepared in a number of operations in proportion to them. */
static void operations_grow_with_the_links(void)
{
    long count[2];
    for (int k = 0; k < 2; k++) {
        loaded l = load_tree(TREE_LINEAR, k ? 2000 : 200);
        CHECK(waits(&l) && kmp_motion_need_bodies(l.system) == KEMPE_OK && l.system->bodies->program);
        count[k] = kmp_program_count(l.system->bodies->program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper +
                   kmp_program_count(l.system->judge, KMP_STAGE_POTENTIAL, KMP_STAGE_POWER).paper;
        kempe_check *check = NULL;
        CHECK(kempe_check_new(l.system, &check) == KEMPE_OK && waits(&l)); /* nor does a check of a large one need M */
        kempe_check_free(check);
        unload(&l);
    }
    printf("  operations of 200 and 2000 links: %ld, %ld\n", count[0], count[1]);
    CHECK((double)count[1] < 10.5 * (double)count[0]);
}

/* M and C are made once by several threads, and have as many operations as those of a system that does not wait. */
static void *need(void *system)
{
    CHECK(kmp_motion_need(system) == KEMPE_OK);
    return NULL;
}

static void threads_share_them(void)
{
    enum { THREADS = 3 };
    loaded l = load(file);
    pthread_t threads[THREADS];
    for (int k = 0; k < THREADS; k++)
        CHECK(pthread_create(&threads[k], NULL, need, l.system) == 0);
    for (int k = 0; k < THREADS; k++)
        CHECK(pthread_join(threads[k], NULL) == 0);
    kempe_system *by_mass = NULL;
    CHECK(kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
    long late = kmp_program_count(l.system->motion, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
    long own = kmp_program_count(by_mass->motion, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
    printf("  operations by M and C: %ld, of a system that does not wait %ld\n", late, own);
    CHECK(late <= own);
    kempe_system_free(by_mass);
    unload(&l);
}

int main(void)
{
    TEST(others_do_not_wait);
    TEST(runs_by_bodies_need_none);
    TEST(values_are_those_of_m_and_c);
    TEST(large_trees_go_by_links);
    TEST(massless_joints_of_large_trees_are_named);
    TEST(operations_grow_with_the_links);
    TEST(threads_share_them);
    return check_report();
}
