/* SPDX-License-Identifier: BSD-3-Clause */
/* Products M x in place of M: long mechanisms with loops and few independent coordinates are run without M. The
 * products equal those with M, in space too, with redundant rows, drives, and forces of a program; and the operations
 * grow with the bodies. */
#include "base/text.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/motion.h"
#include "loaded.h"
#include "random.h"
#include "studies/simulate/trajectory.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <math.h>
#include <string.h>

enum { CELLS = 24, MOST = 2 * CELLS + 2 };

/* Lifts: in the plane; with closures that are given twice; on a base that turns and carriage that slides, with
 * armatures and products of inertia; driven at its first joint, in time; with forces that switch. */
typedef enum lift { LIFT_PLANE, LIFT_TWICE, LIFT_SPACE, LIFT_DRIVEN, LIFT_SWITCHED, LIFTS, LIFT_RUBBING } lift;

static void put_bodies(kmp_text *text, lift kind, int cells)
{
    const char *inertia = kind == LIFT_SPACE ? "{xx: 0.02, yy: 0.1, zz: 0.0833, xy: 0.003, yz: 0.002}" : "{zz: 0.0833}";
    if (kind == LIFT_SPACE)
        kmp_text_put(text, "  base: {joint: {name: b, revolute: x, at: ground}, mass: 2, inertia: {xx: 0.3}}\n"
                           "  cart: {joint: {name: x, prismatic: y, at: base}, mass: 3}\n");
    for (int i = 0; i < cells; i++) {
        kmp_text_printf(text, "  l%d: {joint: {name: a%d, revolute: z, at: ", i, i);
        if (i == 0)
            kmp_text_put(text, kind == LIFT_SPACE ? "cart" : "ground");
        else
            kmp_text_printf(text, "l%d.E", i - 1);
        kmp_text_printf(text, "%s}, mass: 1, com: [0.5, 0.01, 0.02], inertia: %s, ",
                        kind == LIFT_SPACE && i % 3 == 0 ? ", armature: 0.05" : "", inertia);
        kmp_text_printf(text,
                        "points: {M: [0.5, 0, 0], E: [1, 0, 0]}}\n"
                        "  r%d: {joint: {name: c%d, revolute: z, at: l%d.M}, mass: 1, inertia: %s, "
                        "points: {A: [-0.5, 0, 0], E: [0.5, 0, 0]}}\n",
                        i, i, i, inertia);
    }
}

static void put_start(kmp_text *text, int cells)
{
    const double angle = 0.5;
    kmp_text_put(text, "start: {q: {");
    for (int i = 0; i < cells; i++) {
        double direction = i % 2 == 0 ? angle : M_PI - angle, before = i == 0 ? 0 : M_PI - direction;
        kmp_text_printf(text, "%sa%d: %.17g, c%d: %.17g", i > 0 ? ", " : "", i, direction - before, i,
                        M_PI - 2 * direction);
    }
    kmp_text_put(text, "}}\n");
}

static loaded load_lift(lift kind, int cells)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\ngravity: [1, -9, 2]\nbodies:\n");
    put_bodies(&text, kind, cells);
    kmp_text_put(&text, "loops:\n");
    for (int i = 1; i < cells; i++)
        kmp_text_printf(&text, "  k%d: {ball: [r%d.A, r%d.E]}\n", i, i, i - 1);
    if (kind == LIFT_TWICE)
        kmp_text_put(&text, "  again: {ball: [r3.A, r2.E]}\n");
    kmp_text_put(&text, "forces:\n");
    for (int i = 1; i < cells; i += 3)
        kmp_text_printf(&text, "  s%d: {joint: a%d, spring: {stiffness: 40, rest: 0.1, damping: 0.3}}\n", i, i);
    if (kind == LIFT_SWITCHED)
        kmp_text_put(&text, "  switch: {joint: a0, torque: \"if(q(a0) < 0.49, 400, 0) - 20*abs(q(c0) - 2.13)\"}\n");
    if (kind == LIFT_RUBBING)
        kmp_text_put(&text, "  rub: {joint: a0, friction: {torque: 2}}\n");
    if (kind == LIFT_DRIVEN)
        kmp_text_put(&text, "drives:\n  d: {joint: a0, angle: 0.5 + 0.1*sin(3*t)}\n");
    put_start(&text, cells);
    loaded l = load_text(text.s);
    kmp_text_free(&text);
    return l;
}

static bool goes_by_products(const loaded *l)
{
    return l->system && l->system->late && l->system->late->by_products && !kmp_motion_is_made(l->system);
}

static kempe_trajectory *run(const kempe_system *s, const char *formulation, const char *integrator)
{
    const kempe_run_options options = {.formulation = formulation,
                                       .integrator = integrator,
                                       .rtol = 1e-10,
                                       .t_end = 0.2,
                                       .output_step = 0.1,
                                       .no_convergence_check = 1};
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(s, &options, &t) == KEMPE_OK);
    return t;
}

/* The largest difference of q and qd at the ends, and of the multipliers, each over its size. */
static double apart(const kempe_trajectory *a, const kempe_trajectory *b, int n, int m)
{
    int row = kempe_trajectory_row_count(a) - 1;
    double most = row == kempe_trajectory_row_count(b) - 1 ? 0 : INFINITY, size = 1, load = 0;
    for (int i = 0; i < n && most < INFINITY; i++) {
        most = check_max(most, fabs(kempe_trajectory_q(a, row)[i] - kempe_trajectory_q(b, row)[i]));
        most = check_max(most, fabs(kempe_trajectory_qd(a, row)[i] - kempe_trajectory_qd(b, row)[i]));
    }
    for (int i = 0; i < m && most < INFINITY; i++) {
        size = check_max(size, fabs(kempe_trajectory_lambda(b, row)[i]));
        load = check_max(load, fabs(kempe_trajectory_lambda(a, row)[i] - kempe_trajectory_lambda(b, row)[i]));
    }
    return check_max(most, load / size);
}

static int push(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user;
    effort[0] = 30 * cos(t) - 2 * qd[0] + q[1];
    return 0;
}

static void set_push(loaded *l, kempe_system *by_mass, kempe_force_fn *force)
{
    kempe_system_set_force(l->system, force, NULL);
    kempe_system_set_force(by_mass, force, NULL);
}

typedef struct method {
    const char *formulation, *integrator;
} method;

/* The same motion by a method with products and with M. */
static void run_both(const loaded *l, const kempe_system *by_mass, method m)
{
    kempe_trajectory *t = run(l->system, m.formulation, m.integrator);
    kempe_trajectory *other = run(by_mass, m.formulation, m.integrator);
    CHECK(apart(t, other, l->system->n, l->system->m) < 1e-8);
    CHECK(fabs(t->verdict.drift_rel - other->verdict.drift_rel) < 1e-8);
    kempe_trajectory_free(t);
    kempe_trajectory_free(other);
}

/* Runs whose integrators need no derivatives make no M, with their events, tables and energies; others make it. */
static void runs_equal_those_by_mass(void)
{
    static const method methods[] = {{"reduced", "dop853"},   {"reduced", "radau"},   {"reduced", "adams"},
                                     {"projected", "dop853"}, {"projected", "radau"}, {"dae", "radau"}};
    for (int kind = 0; kind < LIFTS; kind++) {
        loaded l = load_lift((lift)kind, CELLS);
        kempe_system *by_mass = NULL;
        CHECK(goes_by_products(&l) && kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
        for (size_t k = 0; k < sizeof methods / sizeof *methods; k++)
            for (int pushed = 0; pushed < 2; pushed++) {
                set_push(&l, by_mass, pushed ? push : NULL);
                run_both(&l, by_mass, methods[k]);
                CHECK(goes_by_products(&l));
            }
        set_push(&l, by_mass, NULL);
        run_both(&l, by_mass, (method){"dae", "ida"});
        CHECK(!goes_by_products(&l));
        kempe_system_free(by_mass);
        unload(&l);
    }
}

/* M, unit vector by unit vector, C, jdqd and energies at random states, which no loop closes. */
static void values_equal_those_by_mass(void)
{
    random_seed(7);
    for (int kind = 0; kind < LIFTS; kind++) {
        loaded l = load_lift((lift)kind, CELLS);
        kempe_system *by_mass = NULL;
        CHECK(goes_by_products(&l) && kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
        int n = l.system->n;
        kmp_evaluator *eval[2] = {kmp_eval_new_for(l.system, "tape", NULL, KMP_EVAL_WEIGHS),
                                  kmp_eval_new(by_mass, "tape")};
        CHECK(n <= MOST && eval[0] && eval[0]->by_products && eval[1]);
        double q[MOST], qd[MOST], mass[2][MOST * MOST], kinetic[2], potential[2];
        for (int i = 0; i < n; i++) {
            q[i] = between(-1, 1);
            qd[i] = between(-1, 1);
        }
        for (int k = 0; k < 2; k++) {
            kmp_eval_closure(eval[k], 0.1, q);
            kmp_eval_mass(eval[k]);
            kmp_eval_bias(eval[k], qd);
            kmp_eval_dense_mass(eval[k], mass[k]);
            kmp_eval_energies(eval[k], qd, &kinetic[k], &potential[k]);
        }
        CHECK(check_apart(n * n, mass[0], mass[1]) < 1e-13);
        CHECK(check_apart(n, eval[0]->bias, eval[1]->bias) < 1e-12);
        CHECK(check_apart(l.system->m, eval[0]->jdqd, eval[1]->jdqd) < 1e-12);
        CHECK_NEAR(kinetic[0], kinetic[1], 1e-12 * kinetic[1]);
        CHECK_NEAR(potential[0], potential[1], 1e-12 * fabs(potential[1]));
        CHECK(goes_by_products(&l) && kmp_eval_add_composite(eval[0]) == KEMPE_OK && !eval[0]->by_products);
        CHECK(kmp_motion_is_made(l.system) && l.system->mass.count == by_mass->mass.count);
        kmp_eval_free(eval[0]);
        kmp_eval_free(eval[1]);
        kempe_system_free(by_mass);
        unload(&l);
    }
}

/* Accelerations, multipliers and corrections at states far from that of the chosen coordinates, by their residuals in
 * the system with M. */
static void saddles_equal_those_by_mass(void)
{
    random_seed(11);
    int others = 0;
    for (int kind = 0; kind < LIFTS; kind++) {
        loaded l = load_lift((lift)kind, CELLS);
        kempe_system *by_mass = NULL;
        CHECK(goes_by_products(&l) && kempe_system_new_with_algorithm(l.model, "composite", &by_mass) == KEMPE_OK);
        kmp_evaluator *eval[2] = {kmp_eval_new_for(l.system, "tape", NULL, KMP_EVAL_WEIGHS),
                                  kmp_eval_new(by_mass, "tape")};
        kempe_assembly *start = NULL;
        CHECK(eval[0] && eval[1] && kempe_assembly_new(l.system, &start) == KEMPE_OK);
        const double *closed = kempe_assembly_q(start);
        kmp_partition part;
        kmp_saddle saddle[2];
        double q[MOST], qd[MOST], qdd[MOST], lambda[2 * MOST], dx[2][MOST];
        const int n = l.system->n;
        kmp_eval_closure(eval[0], 0, closed);
        CHECK(l.system->m <= 2 * MOST && kmp_partition_init(&part, l.system, eval[0]->jacobian, NULL, 0) == KEMPE_OK);
        for (int k = 0; k < 2; k++)
            CHECK(kmp_saddle_init(&saddle[k], eval[k], &part));
        CHECK(saddle[0].kind == KMP_SADDLE_BY_PRODUCTS && saddle[1].kind != KMP_SADDLE_BY_PRODUCTS);
        for (int state = 0; state < 20; state++) {
            for (int i = 0; i < n; i++) {
                q[i] = closed[i] + between(-0.5, 0.5);
                qd[i] = between(-1, 1);
            }
            for (int k = 0; k < 2; k++) {
                kmp_eval_closure(eval[k], 0.1, q);
                kmp_eval_mass(eval[k]);
                kmp_eval_bias(eval[k], qd);
                CHECK(kmp_saddle_factor(&saddle[k]) == 0);
                kmp_saddle_solve(&saddle[k], NULL, eval[k]->h, dx[k], NULL);
            }
            kmp_saddle_accelerations(&saddle[0], qdd, lambda);
            CHECK(kmp_saddle_backward_error(&saddle[1], qdd, lambda) < 1e-12);
            CHECK(check_apart(n, dx[0], dx[1]) < 1e-8);
            const int *u = saddle[0].reduction->part.u;
            others += memcmp(u, part.u, (size_t)part.p * sizeof *u) != 0;
        }
        for (int k = 0; k < 2; k++) {
            kmp_saddle_free(&saddle[k]);
            kmp_eval_free(eval[k]);
        }
        kmp_partition_free(&part);
        kempe_assembly_free(start);
        kempe_system_free(by_mass);
        unload(&l);
    }
    CHECK(others > 0); /* other coordinates were taken */
}

/* Small mechanisms have M at once, and friction that sticks needs it. */
static void others_have_mass(void)
{
    loaded small = load_lift(LIFT_PLANE, 10), rubbing = load_lift(LIFT_RUBBING, CELLS);
    CHECK(small.system && !small.system->late && small.system->motion);
    CHECK(rubbing.system && (!rubbing.system->late || !rubbing.system->late->by_products));
    unload(&small);
    unload(&rubbing);
}

/* Operations of a right-hand side but for the linear algebra, and of energies. A check of a large one needs no M. */
static void operations_grow_with_the_cells(void)
{
    long count[2];
    for (int k = 0; k < 2; k++) {
        loaded l = load_lift(LIFT_PLANE, k ? 1000 : 100);
        CHECK(goes_by_products(&l));
        count[k] = kmp_program_count(l.system->late->weighing, KMP_STAGE_CLOSURE, KMP_STAGE_PRODUCT).paper +
                   kmp_program_count(l.system->judge, KMP_STAGE_POTENTIAL, KMP_STAGE_POWER).paper;
        kempe_check *check = NULL;
        CHECK(k > 0 || (kempe_check_new(l.system, &check) == KEMPE_OK && goes_by_products(&l)));
        kempe_check_free(check);
        unload(&l);
    }
    printf("  operations of 100 and 1000 cells: %ld, %ld\n", count[0], count[1]);
    CHECK((double)count[1] < 10.5 * (double)count[0]);
}

int main(void)
{
    TEST(runs_equal_those_by_mass);
    TEST(values_equal_those_by_mass);
    TEST(saddles_equal_those_by_mass);
    TEST(others_have_mass);
    TEST(operations_grow_with_the_cells);
    return check_report();
}
