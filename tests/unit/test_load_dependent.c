/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on what closures transmit: M qdd + C(lambda) = J' lambda, against formulas and an integration of
 * its own, on all formulations. */
#include "constraints/partition/reduction.h"
#include "integrators/formulations/formulation.h"
#include "integrators/formulations/reduced_jacobian.h"
#include "loaded.h"
#include "model/data/run_settings.h"
#include "studies/simulate/trajectory.h"
#include <kempe/settings.h>
#include <kempe/workspace.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A block in the plane on two feet under a slope of gravity; `FORCES` follow. */
#define BLOCK                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "name: block\n"                                                                                                    \
    "gravity: [5, 0, -9.81]\n"                                                                                         \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  block: {joint: {planar: y, at: ground}, mass: 2, inertia: {yy: 0.1},\n"                                         \
    "          points: {A: [-0.1, 0, -0.05], B: [0.1, 0, -0.05]}}\n"                                                   \
    "loops:\n"                                                                                                         \
    "  A: {point_on_plane: [ground.O, block.A], axis: z}\n"                                                            \
    "  B: {point_on_plane: [ground.O, block.B], axis: z}\n"

static const char rough[] =
    BLOCK "forces:\n"
          "  a: {at: block.A, force: [\"-0.3*abs(lambda(A))*tanh(qd(block.2)/0.01)\", 0, 0]}\n"
          "  b: {at: block.B, force: [\"-0.3*abs(lambda(B.1))*tanh(qd(block.2)/0.01)\", 0, 0]}\n"
          "sensors: {load: lambda(A) + lambda(B)}\n"
          "start: {qd: {block.2: 1}}\n"
          "run: {t_end: 1, output_step: 0.25, outputs: [qd, sensor(load), lambda]}\n";

static void equations(void)
{
    loaded l = load_text(rough);
    if (l.system) {
        CHECK(l.system->m == 2 && l.system->load_row_count == 2);
        CHECK(l.system->load_rows[0] == 0 && l.system->load_rows[1] == 1);
        CHECK(l.system->load_jacobian.count >= 2);
        CHECK(l.system->motion->stages == KMP_STAGE_WORKING + 1);
    }
    unload(&l);
}

/* -- complaints -------------------------------------------------------------------------------------- */

static void complains(const char *text, const char *sentence)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {0};
    run.t_end = 1;
    kempe_status status = kempe_model_read_text(context, text, "model.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_simulate(system, &run, &trajectory);
    CHECK(status != KEMPE_OK);
    const char *said = trajectory ? kempe_trajectory_reason(trajectory) : kempe_context_message(context);
    CHECK(strstr(said, sentence) != NULL);
    if (!strstr(said, sentence))
        printf("%s\n", said);
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void absent_row(void)
{
    complains("kempe: 1\n"
              "bodies:\n"
              "  a: {joint: {revolute: y, at: ground}, mass: 1, points: {P: [1, 0, 0]}}\n"
              "  b: {joint: {revolute: y, at: ground}, mass: 1, points: {P: [1, 0, 0]}}\n"
              "loops:\n"
              "  close: {ball: [a.P, b.P]}\n"
              "forces:\n"
              "  f: {joint: a, torque: \"lambda(close.3)\"}\n",
              "model.yaml:8:3: force 'f' depends on lambda(close.3), but 'close' has 2 multipliers: equations that no "
              "coordinate changes have none");
}

/* One plane twice: the share of each closure in the load is unknown. */
static void shared_load(void)
{
    complains(BLOCK "  C: {point_on_plane: [ground.O, block.A], axis: z}\n"
                    "forces:\n"
                    "  f: {at: block.A, force: [\"0.1*lambda(A)\", 0, 0]}\n",
              "force 'f' depends on the multiplier of constraint equation 'A.1', which is not unique: 'C.1' is "
              "redundant with it");
    complains(BLOCK "  C: {point_on_plane: [ground.O, block.A], axis: z}\n"
                    "forces:\n"
                    "  f: {at: block.A, force: [\"0.1*lambda(C)\", 0, 0]}\n",
              "force 'f' depends on the multiplier of constraint equation 'C.1', which is not unique: 'A.1' is "
              "redundant with it");
}

/* The load is what the force takes from it: N = W + N. */
static void no_solution(void)
{
    complains(BLOCK "forces:\n"
                    "  lift: {at: block.A, force: [0, 0, \"-lambda(A)\"]}\n",
              "force 'lift' depends on the multiplier of constraint equation 'A.1', and at t = 0 s no consistent value "
              "of both "
              "is found: reduce the friction, or increase its 'speed'");
}

static void articulated(void)
{
    loaded l = {.context = kempe_context_new()};
    kempe_system *system = NULL;
    CHECK(kempe_model_read_text(l.context, rough, "model.yaml", &l.model) == KEMPE_OK);
    CHECK(kempe_system_new_with_algorithm(l.model, "articulated", &system) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context),
                 "force 'a' depends on the multiplier of constraint equation 'A.1'") != NULL);
    unload(&l);
}

/* -- runs -------------------------------------------------------------------------------------------- */

typedef struct way {
    const char *formulation, *form, *integrator;
} way;

static kempe_trajectory *simulate(const kempe_system *system, const way *by, double rtol)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {0};
    run.formulation = by->formulation;
    run.form = by->form;
    run.integrator = by->integrator;
    run.rtol = rtol;
    run.t_end = kmp_model_run(system->model)->t_end;
    run.output_step = kmp_model_run(system->model)->output_step;
    run.no_convergence_check = 1;
    CHECK(kempe_simulate(system, &run, &trajectory) == KEMPE_OK);
    return trajectory;
}

/* The number of entries of a kind in the log of a run, with this text or any. */
static int has_entry(const kempe_trajectory *run, const char *kind, const char *text)
{
    int count = 0;
    for (int k = 0; k < run->log.kept; k++)
        count += strcmp(run->log.entries[k].kind, kind) == 0 && (!*text || strcmp(run->log.entries[k].text, text) == 0);
    return count;
}

/* On an incline of slope 5/9.81 with friction 0.3 the block is accelerated by 5 - 0.3 * 9.81, and its feet carry what
 * keeps it from tipping: 0.05 m above the plane its weight and friction make a moment. */
static void rough_incline(void)
{
    static const way savings[] = {{"reduced", "integrated", "dop853"}, {"reduced", "newton", "dop853"},
                                  {"reduced", "newton", "radau5"},     {"projected", "none", "dop853"},
                                  {"projected", "none", "radau"},      {"reduced", "newton", "ida"},
                                  {"dae", "stabilized1", "ida"}};
    loaded l = load_text(rough);
    for (size_t k = 0; l.system && k < sizeof savings / sizeof *savings; k++) {
        kempe_trajectory *run = simulate(l.system, &savings[k], 1e-10);
        int last = run ? kempe_trajectory_row_count(run) - 1 : 0;
        CHECK(last == 4);
        for (int row = 0; row <= last && run; row++) {
            double t = kempe_trajectory_time(run, row);
            const double *lambda = kempe_trajectory_lambda(run, row);
            CHECK_NEAR(kempe_trajectory_qd(run, row)[1], 1 + (5 - 0.3 * 9.81) * t, 1e-9);
            CHECK_NEAR(kempe_trajectory_qdd(run, row)[1], 5 - 0.3 * 9.81, 1e-12);
            CHECK_NEAR(lambda[0] + lambda[1], 2 * 9.81, 1e-12);
            /* about the centre of mass: 0.1 (B - A) = 0.05 * friction */
            CHECK_NEAR(0.1 * (lambda[1] - lambda[0]), 0.05 * 0.3 * 2 * 9.81, 1e-12);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* A chain of eleven links hangs from the ground and pushes a slider that rubs by its load: with more than eight degrees
 * of freedom the saddle system is written out, also in lanes; by the newton form all is evaluated by parts. */
static void many_freedoms(void)
{
    enum { LINKS = 11, ROOM = 4096 };
    static const way ways[] = {
        {"reduced", "newton", "dop853"}, {"reduced", "integrated", "dop853"}, {"reduced", "integrated", "radau"}};
    char text[ROOM];
    double angle = 1.2, turn = -2 * angle / (LINKS - 1), reach = 0;
    int used = snprintf(text, ROOM, "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n");
    for (int i = 0; i < LINKS; i++) {
        char at[16] = "ground";
        if (i > 0)
            (void)snprintf(at, sizeof at, "b%d.E", i - 1);
        used += snprintf(text + used, (size_t)(ROOM - used),
                         "  b%d: {joint: {name: A%d, revolute: z, at: %s}, mass: 1, com: [0.05, 0, 0], inertia: {zz: "
                         "0.001}, points: {E: [0.1, 0, 0]}}\n",
                         i, i, at);
        reach += 0.1 * cos(angle + i * turn);
    }
    used += snprintf(text + used, (size_t)(ROOM - used),
                     "  s: {joint: {name: x, prismatic: x, at: ground}, mass: 0.8, points: {P: [0, 0, 0]}}\n"
                     "loops: {C: {ball: [b%d.E, s.P]}}\nforces: {rub: {joint: x, force: "
                     "\"-0.3*sqrt(lambda(C.2)^2 + 1)*tanh(qd(x)/0.5)\"}}\nrun: {t_end: 0.2, output_step: 0.05}\n"
                     "start: {q: {x: %.17g, A0: %.17g",
                     LINKS - 1, reach, angle);
    for (int i = 1; i < LINKS; i++)
        used += snprintf(text + used, (size_t)(ROOM - used), ", A%d: %.17g", i, turn);
    CHECK(snprintf(text + used, (size_t)(ROOM - used), "}}\n") + used < ROOM);
    loaded l = load_text(text);
    kempe_trajectory *by_parts = NULL;
    for (size_t k = 0; l.system && k < sizeof ways / sizeof *ways; k++) {
        kempe_trajectory *run = simulate(l.system, &ways[k], 1e-10);
        int last = run ? kempe_trajectory_row_count(run) - 1 : 0;
        CHECK(last == 4);
        for (int row = 0; row <= last && run && by_parts; row++) {
            CHECK(check_apart(LINKS + 1, kempe_trajectory_q(run, row), kempe_trajectory_q(by_parts, row)) < 1e-8);
            CHECK(check_apart(2, kempe_trajectory_lambda(run, row), kempe_trajectory_lambda(by_parts, row)) < 1e-6);
        }
        if (k > 0)
            kempe_trajectory_free(run);
        else
            by_parts = run;
    }
    kempe_trajectory_free(by_parts);
    unload(&l);
}

/* -- a slider-crank whose guide rubs, integrated here ------------------------------------------------- */

enum { STEPS = 40000 };

typedef struct crank {
    double phi, rate; /* of the crank; the rod follows */
} crank;

/* Lagrange's equations of both bars by their absolute angles a and b, clockwise from x. Both accelerations and the load
 * N, which pushes up, are linear in the friction F along -x: N = n0 + n1 F, and F = rub sqrt(N^2 + 1) makes it the root
 * of (N - n0)^2 = (n1 rub)^2 (N^2 + 1) on the side where N - n0 has the sign of n1 rub. Returns the load. */
static double accelerate(double phi, double rate, double *crank_acceleration)
{
    const double r = 0.3, l = 0.7, m1 = 2, m2 = 1.5, g = 9.81, mu = 0.2;
    double b = asin(-r * sin(phi) / l), bd = -r * cos(phi) * rate / (l * cos(b));
    double aa = 0.02 + m1 * r * r / 4 + m2 * r * r, bb = 0.07 + m2 * l * l / 4, h = m2 * r * l / 2;
    double c = cos(phi - b), s = sin(phi - b);
    double rub = mu * tanh((-r * sin(phi) * rate - l * sin(b) * bd) / 0.05);
    double m[3][5] = {
        {aa, h * c, r * cos(phi), 6 - 0.5 * rate + (m1 / 2 + m2) * g * r * cos(phi) - h * s * bd * bd, r * sin(phi)},
        {h * c, bb, l * cos(b), m2 * g * l / 2 * cos(b) + h * s * rate * rate, l * sin(b)},
        {r * cos(phi), l * cos(b), 0, r * sin(phi) * rate * rate + l * sin(b) * bd * bd, 0}};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            double f = i == k ? 0 : m[i][k] / m[k][k];
            for (int j = k; j < 5; j++)
                m[i][j] -= f * m[k][j];
        }
    double n0 = m[2][3] / m[2][2], k = m[2][4] / m[2][2] * rub, k2 = k * k;
    double root = sqrt(n0 * n0 * k2 + k2 - k2 * k2) * (k < 0 ? -1 : 1), load = (n0 + root) / (1 - k2);
    *crank_acceleration = (m[0][3] + m[0][4] * rub * sqrt(load * load + 1)) / m[0][0];
    return load;
}

static void step(crank *x, double dt)
{
    double k[4], d[4];
    d[0] = x->rate;
    (void)accelerate(x->phi, d[0], &k[0]);
    for (int i = 1; i < 4; i++) {
        double part = i == 3 ? dt : dt / 2;
        d[i] = x->rate + part * k[i - 1];
        (void)accelerate(x->phi + part * d[i - 1], d[i], &k[i]);
    }
    x->phi += dt / 6 * (d[0] + 2 * d[1] + 2 * d[2] + d[3]);
    x->rate += dt / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3]);
}

static void prescribed(void)
{
    static const way savings[] = {{"reduced", "integrated", "dop853"}, {"reduced", "newton", "dop853"},
                                  {"projected", "none", "dop853"},     {"projected", "none", "radau"},
                                  {"reduced", "newton", "radau9"},     {"reduced", "newton", "ida"},
                                  {"dae", "stabilized1", "ida"}};
    loaded l = load("tests/models/guide_friction.yaml");
    crank x = {0.3, 4};
    double acceleration;
    for (int k = 0; k < STEPS; k++)
        step(&x, 2.0 / STEPS);
    for (size_t k = 0; l.system && k < sizeof savings / sizeof *savings; k++) {
        bool sharp = strcmp(savings[k].integrator, "dop853") == 0;
        kempe_trajectory *run = simulate(l.system, &savings[k], sharp ? 1e-12 : 1e-10);
        int last = run ? kempe_trajectory_row_count(run) - 1 : 0;
        if (run) {
            CHECK_NEAR(kempe_trajectory_q(run, last)[0], x.phi, sharp ? 1e-9 : 1e-6);
            CHECK_NEAR(kempe_trajectory_qd(run, last)[0], x.rate, sharp ? 1e-9 : 1e-6);
            CHECK_NEAR(kempe_trajectory_lambda(run, last)[0], accelerate(x.phi, x.rate, &acceleration),
                       sharp ? 1e-8 : 1e-5);
            CHECK(run->verdict.drift_rel < 1e-7);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* -- Newton ------------------------------------------------------------------------------------------ */

typedef struct bench {
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_reduction red;
} bench;

/* At a closed state of the slider-crank. */
static void set_up(bench *b, const loaded *l, double phi, double rate)
{
    double rod = asin(-0.3 * sin(phi) / 0.7), q[2] = {phi, rod - phi}, qd[2], ud = rate;
    b->eval = kmp_eval_new(l->system, "tape");
    kmp_eval_closure(b->eval, 0, q);
    CHECK(kmp_partition_init(&b->part, l->system, b->eval->jacobian, (int[]){0}, 1) == KEMPE_OK);
    CHECK(kmp_reduction_init(&b->red, b->eval, &b->part) == KEMPE_OK);
    CHECK(kmp_reduction_factor(&b->red) == 0);
    kmp_reduction_tangent(&b->red);
    kmp_reduction_rates(&b->red, &ud, qd);
    kmp_eval_mass(b->eval);
    kmp_eval_bias(b->eval, qd);
}

static void take_down(bench *b)
{
    kmp_reduction_free(&b->red);
    kmp_partition_free(&b->part);
    kmp_eval_free(b->eval);
}

/* Whatever it begins with, and by reduction or by the saddle system. */
static void same_root(void)
{
    static const double from[] = {0, 1, -1, 30, -1e6, 1e9, 1e-300};
    loaded l = load("tests/models/guide_friction.yaml");
    for (double phi = 0.1; l.system && phi < 6; phi += 0.7) {
        bench b;
        double expected, load = accelerate(phi, 5, &expected), udd;
        set_up(&b, &l, phi, 5);
        for (size_t k = 0; k < sizeof from / sizeof *from; k++) {
            kmp_eval_bias_with(b.eval, &from[k]);
            CHECK(kmp_reduction_accelerate(&b.red, &udd) == 0);
            CHECK_NEAR(udd, expected, 1e-12);
            CHECK_NEAR(b.eval->nu[0], load, 1e-12);
            kmp_saddle saddle;
            double qdd[2], lambda;
            CHECK(kmp_saddle_init(&saddle, b.eval, &b.part) && kmp_saddle_factor(&saddle) == 0);
            kmp_eval_bias_with(b.eval, &from[k]);
            kmp_saddle_accelerations(&saddle, qdd, &lambda);
            CHECK_NEAR(qdd[0], expected, 1e-12);
            CHECK_NEAR(lambda, load, 1e-12);
            kmp_saddle_free(&saddle);
        }
        take_down(&b);
    }
    unload(&l);
}

/* A force that is no multiple of the load, on a floor that carries a weight. */
static void not_linear(void)
{
    loaded l = load_text("kempe: 1\n"
                         "gravity: [0, 0, -9.81]\n"
                         "bodies:\n"
                         "  a: {joint: {prismatic: z, at: ground}, mass: 2, points: {P: [0, 0, 0]}}\n"
                         "ground: {points: {O: [0, 0, 0]}}\n"
                         "loops: {floor: {point_on_plane: [ground.O, a.P], axis: z}}\n"
                         "forces: {soft: {joint: a, force: \"-0.02*lambda(floor)^2 - 3*lambda(floor)\"}}\n");
    /* N = W + 0.02 N^2 + 3 N is solved by two numbers; both lead to themselves */
    double w = 2 * 9.81, q = 0, qd = 0, qdd, lambda = 0;
    kempe_workspace *ws = NULL;
    if (l.system && kempe_workspace_new(l.system, &ws) == KEMPE_OK) {
        CHECK(kempe_workspace_forward_dynamics(ws, 0, &q, &qd, NULL, &qdd, &lambda) == KEMPE_OK);
        CHECK_NEAR(qdd, 0, 1e-12);
        CHECK_NEAR(w + 0.02 * lambda * lambda + 3 * lambda - lambda, 0, 1e-12);
    }
    kempe_workspace_free(ws);
    unload(&l);
}

/* A friction torque by the size of a reaction, a root of squares without derivative at no load: its one solution is
 * found. */
static void root_of_squares(void)
{
    loaded l = load("tests/models/rubbing_pin.yaml");
    kempe_trajectory *run = NULL;
    kempe_run_options options = {.no_convergence_check = 1};
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_OK);
    if (run) {
        const double *lambda = kempe_trajectory_lambda(run, 0);
        CHECK_NEAR(kempe_trajectory_qdd(run, 0)[0], 3.466369352439077, 1e-13);
        CHECK_NEAR(0.1 * hypot(lambda[0], lambda[1]), 0.3866477953177883, 1e-13);
        CHECK(has_entry(run, "solutions", "") == 0);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* Friction of a slider by its own load, friction.md, F7 with mu = 10 at 300 degrees: two solutions in one direction,
 * which the log tells, and none in the other. */
static void two_solutions(void)
{
    loaded l = load("tests/models/rubbing_guide.yaml");
    kempe_trajectory *run = NULL;
    kempe_run_options options = {.no_convergence_check = 1};
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_OK);
    if (run) {
        CHECK_NEAR(0.8 * 9.81 - kempe_trajectory_lambda(run, 0)[1], 6.1066, 1e-5);
        CHECK(has_entry(run, "solutions",
                        "force 'f' has two solutions: with 1.74139 and with 47.2918 for the "
                        "multiplier of constraint equation 'C.2'; the run begins with the first") == 1);
    }
    kempe_trajectory_free(run);
    unload(&l);
    l = load_set("tests/models/rubbing_guide.yaml", (const kempe_setting[]){{"w", "-15"}}, 1);
    run = NULL;
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "no consistent value of both is found"));
    kempe_trajectory_free(run);
    unload(&l);
}

/* Forward dynamics for programs of users: with efforts of theirs, and where the load is shared. */
static void workspace(void)
{
    loaded l = load("tests/models/guide_friction.yaml");
    kempe_workspace *ws = NULL;
    double q[2] = {0.4, asin(-0.3 * sin(0.4) / 0.7) - 0.4}, qd[2] = {3, 0}, qdd[2], lambda, expected, effort[2] = {0};
    qd[1] = -0.3 * cos(0.4) * 3 / (0.7 * cos(q[0] + q[1])) - 3;
    if (l.system && kempe_workspace_new(l.system, &ws) == KEMPE_OK) {
        CHECK(kempe_workspace_forward_dynamics(ws, 0, q, qd, effort, qdd, &lambda) == KEMPE_OK);
        CHECK_NEAR(lambda, accelerate(0.4, 3, &expected), 1e-12);
        CHECK_NEAR(qdd[0], expected, 1e-12);
        const double *m = kempe_workspace_mass(ws), *c = kempe_workspace_bias(ws), *j = kempe_workspace_jacobian(ws);
        for (int i = 0; i < 2; i++)
            CHECK_NEAR(m[i] * qdd[0] + m[i + 2] * qdd[1] + c[i], j[i] * lambda, 1e-11);
        effort[0] = 10; /* what the crank is turned by beside */
        CHECK(kempe_workspace_forward_dynamics(ws, 0, q, qd, effort, qdd, &lambda) == KEMPE_OK);
        CHECK(qdd[0] > expected + 10);
        for (int i = 0; i < 2; i++)
            CHECK_NEAR(m[i] * qdd[0] + m[i + 2] * qdd[1] + c[i], j[i] * lambda + effort[i], 1e-11);
    }
    kempe_workspace_free(ws);
    unload(&l);
    l = load_text(BLOCK "  C: {point_on_plane: [ground.O, block.A], axis: z}\n"
                        "forces:\n"
                        "  f: {at: block.A, force: [\"0.1*lambda(C)\", 0, 0]}\n");
    double at[3] = {0.05, 0, 0}, still[3] = {0}, fall[3], loads[3];
    ws = NULL;
    if (l.system && kempe_workspace_new(l.system, &ws) == KEMPE_OK) {
        CHECK(kempe_workspace_forward_dynamics(ws, 0, at, still, NULL, fall, loads) == KEMPE_E_FAILED);
        CHECK(strstr(kempe_workspace_message(ws), "which is not unique because of redundant constraints") != NULL);
    }
    kempe_workspace_free(ws);
    unload(&l);
}

/* -- the Jacobian of the reduced equations ------------------------------------------------------------ */

static double reduced(bench *b, double u, double ud, bool given, double udd)
{
    double q[2] = {u, asin(-0.3 * sin(u) / 0.7) - u}, qd[2], out = udd;
    kmp_eval_closure(b->eval, 0, q);
    CHECK(kmp_reduction_factor(&b->red) == 0);
    kmp_reduction_tangent(&b->red);
    kmp_reduction_rates(&b->red, &ud, qd);
    kmp_eval_mass(b->eval);
    kmp_eval_bias(b->eval, qd);
    if (given)
        kmp_reduction_residual(&b->red, &udd, &out);
    else
        CHECK(kmp_reduction_accelerate(&b->red, &out) == 0);
    return out;
}

static void jacobian(void)
{
    loaded l = load("tests/models/guide_friction.yaml");
    for (double phi = 0.4; l.system && phi < 6; phi += 1.1) {
        const double e = 1e-5, rate = 0.2, given = 3;
        bench b;
        kmp_reduced_jacobian j;
        double m[4] = {0}, q[2] = {phi, asin(-0.3 * sin(phi) / 0.7) - phi}, qd[2];
        set_up(&b, &l, phi, rate);
        CHECK(kmp_reduced_jacobian_init(&j, &b.red) == KEMPE_OK);
        double by_u = (reduced(&b, phi + e, rate, false, 0) - reduced(&b, phi - e, rate, false, 0)) / (2 * e);
        double by_ud = (reduced(&b, phi, rate + e, false, 0) - reduced(&b, phi, rate - e, false, 0)) / (2 * e);
        double udd = reduced(&b, phi, rate, false, 0);
        kmp_reduction_rates(&b.red, &rate, qd);
        kmp_reduced_jacobian_eval(&j, 0, q, qd, &udd, 2, m);
        CHECK_NEAR(m[1], by_u, 1e-6);
        CHECK_NEAR(m[3], by_ud, 1e-6);
        by_u = (reduced(&b, phi + e, rate, true, given) - reduced(&b, phi - e, rate, true, given)) / (2 * e);
        by_ud = (reduced(&b, phi, rate + e, true, given) - reduced(&b, phi, rate - e, true, given)) / (2 * e);
        double by_udd = (reduced(&b, phi, rate, true, given + e) - reduced(&b, phi, rate, true, given - e)) / (2 * e);
        (void)reduced(&b, phi, rate, true, given);
        memset(m, 0, sizeof m);
        kmp_reduced_jacobian_of_residual(&j, 0, 7, q, qd, &given, 2, m);
        CHECK_NEAR(m[1], by_u, 1e-6);
        CHECK_NEAR(m[3], by_ud + 7 * by_udd, 1e-6);
        kmp_reduced_jacobian_free(&j);
        take_down(&b);
    }
    unload(&l);
}

int main(void)
{
    TEST(equations);
    TEST(absent_row);
    TEST(shared_load);
    TEST(no_solution);
    TEST(articulated);
    TEST(rough_incline);
    TEST(many_freedoms);
    TEST(prescribed);
    TEST(same_root);
    TEST(not_linear);
    TEST(root_of_squares);
    TEST(two_solutions);
    TEST(workspace);
    TEST(jacobian);
    return check_report();
}
