/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse dynamics: against the multipliers of drives, closed forms, the balance of power, forward dynamics there and
 * back, and the conditions of least norm solved as one dense system. */
#include "analyses/dense/singular_values.h"
#include "analyses/inverse/inverse_dynamics.h"
#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "inverted.h"
#include "linalg/dense/lapack.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "symbolic/table_function.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <kempe/workspace.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* -- singular values ------------------------------------------------------------------------------------------ */

static void singular_values(void)
{
    const double a[] = {3, 0, 4, 5, 0, 0}; /* 2 x 3: rows (3 4 0), (0 5 0) */
    kmp_singular svd;
    kmp_arena arena = {0};
    CHECK(kmp_singular_init(&svd, &arena, 2, 3) && kmp_singular_decompose(&svd, a));
    CHECK_NEAR(svd.s[0] * svd.s[1], 15, 1e-14); /* sqrt det A A' */
    CHECK_NEAR(svd.s[0] * svd.s[0] + svd.s[1] * svd.s[1], 50, 1e-14);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 2; k++)
                sum += svd.u[i + 2 * k] * svd.s[k] * svd.vt[k + 2 * j];
            CHECK_NEAR(sum, a[i + 2 * j], 1e-14);
        }
    CHECK(!kmp_singular_decompose(&svd, (double[]){NAN, 0, 0, 0, 0, 0}));
    kmp_arena_free(&arena);
}

/* -- drives ------------------------------------------------------------------------------------------ */

/* Actuators where the drives are: their efforts are the drives' multipliers, the loops' multipliers the same. */
static void as_drives_of(loaded m, const char *path, double t_end)
{
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.t_end = t_end, .output_step = t_end / 20}, KEMPE_OK);
    kempe_trajectory *t = simulate(&m, t_end, t_end / 20, 1e-10);
    double worst = 0, size = 0;
    CHECK(r && t && r->rows == kempe_trajectory_row_count(t));
    for (int row = 0; r && t && row < r->rows; row++) {
        const double *lambda = kempe_trajectory_lambda(t, row), *mine = lambda_at(r, row);
        CHECK(r->t[row] == kempe_trajectory_time(t, row));
        for (int k = 0, drive = 0, loop = 0; k < m.system->m; k++) {
            const kmp_closure *c = kmp_model_closure(m.model, m.system->rows[k].closure);
            bool drives = c->kind == KMP_CLOSURE_drive || c->kind == KMP_CLOSURE_lock;
            double x = drives ? tau_at(r, row)[drive++] : mine[loop++];
            worst = check_max(worst, fabs(x - lambda[k]));
            size = check_max(size, fabs(lambda[k]));
        }
    }
    CHECK(size > 1 && worst < 1e-12 * size);
    if (!(worst < 1e-12 * size))
        printf("%s: %.2e of %.2e\n", path, worst, size);
    CHECK(r && kempe_inverse_residual(r) < 1e-14);
    kempe_trajectory_free(t);
    kempe_inverse_free(r);
    unload(&m);
}

static void as_drives(const char *path, double t_end)
{
    as_drives_of(load(path), path, t_end);
}

/* A driven four-bar with a cylinder at its rocker, whose pressure and valve are states, and a digital controller. */
static void with_states_in_a_loop(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\n"
        "states:\n"
        "  p: {start: 5, rate: 40*(valve - 0.3*qd(D)) - p}\n"
        "  valve: {rate: (u - valve)/0.02}\n"
        "  u: {sample: 0.05, next: 2*sin(t) - 0.5*p}\n"
        "ground: {points: {D: [0.9, 0, 0]}}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.3, 0, 0]}}\n"
        "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.05}, points: "
        "{C: [0.8, 0, 0]}}\n"
        "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.04}, points: {C: [0.7, 0, "
        "0]}}\n"
        "loops: {C: {ball: [rod.C, rocker.C]}}\nforces: {cylinder: {joint: D, torque: 0.3*p}}\n"
        "drives: {d: {joint: A, angle: 1.5 + 2*t}}\n"
        "start: {q: {A: 1.5, B: -62 deg, D: 106 deg}, hold: [A]}\nrun: {rtol: 1e-10}\n";
    as_drives_of(load_text(text), "states in a loop", 1.5);
}

/* Of six rows of rank two other rows are kept as the mechanism turns: the rows of one place become dependent. */
static void other_rows_are_kept(void)
{
    loaded m = load("examples/bennett/bennett.yaml");
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.t_end = 4, .output_step = 0.1}, KEMPE_OK);
    kempe_trajectory *t = simulate(&m, 4, 0.1, 1e-10);
    int motor = m.system->m - 1;
    while (motor > 0 && !kmp_closure_is_drive(kmp_model_closure(m.model, m.system->rows[motor].closure)))
        motor--;
    CHECK(r && t && r->rows == kempe_trajectory_row_count(t));
    for (int row = 0; r && t && row < r->rows; row++)
        CHECK_NEAR(tau_at(r, row)[0], kempe_trajectory_lambda(t, row)[motor], 1e-10);
    kempe_trajectory_free(t);
    kempe_inverse_free(r);
    unload(&m);
}

static void efforts_are_the_multipliers_of_drives(void)
{
    as_drives("examples/driven_slider_crank/driven_slider_crank.yaml", 2);
    as_drives("examples/stewart/driven.yaml", 1);
    with_states_in_a_loop();
    other_rows_are_kept();
}

/* -- closed forms ------------------------------------------------------------------------------------ */

/* examples/driven_slider_crank at the crank's angle: the slider, the torque at the crank, and the rod's force on the
 * slider along x, from I(angle)/2 rate^2 and the powers of the forces. */
typedef struct slider_crank {
    double slope, torque, push;
} slider_crank;

static slider_crank closed_form(double angle, double rate)
{
    const double r = 0.2, l = 0.5, rho = 5, mc = rho * r, mr = rho * l, ms = 3, g = 9.81;
    double s = sin(angle), c = cos(angle), phi = asin(r * s / l); /* the rod goes down by phi */
    double p1 = r * c / (l * cos(phi)), p2 = (l * sin(phi) * p1 * p1 - r * s) / (l * cos(phi));
    double xs1 = -r * s - l * sin(phi) * p1, xs2 = -r * c - l * (cos(phi) * p1 * p1 + sin(phi) * p2);
    double xc1 = -r * s - l / 2 * sin(phi) * p1, xc2 = -r * c - l / 2 * (cos(phi) * p1 * p1 + sin(phi) * p2);
    double yc1 = r * c - l / 2 * cos(phi) * p1, yc2 = -r * s + l / 2 * (sin(phi) * p1 * p1 - cos(phi) * p2);
    double half = mr * (xc1 * xc2 + yc1 * yc2) + rho * l * l * l / 12 * p1 * p2 + ms * xs1 * xs2; /* I'/2 */
    double v = xs1 * rate, force = -40 * v - 6 * v / sqrt(v * v + 1e-4);
    return (slider_crank){xs1, half * rate * rate + g * (mc * r / 2 * c + mr * yc1) - force * xs1,
                          ms * xs2 * rate * rate - force};
}

/* A cylinder of constant inflow under a driven load: p = 1e5 + B/V (Q t - A x), and the place at the last sample. */
#define CYLINDER                                                                                                       \
    "kempe: 1\ngravity: [0, 0, -9.81]\nstates:\n"                                                                      \
    "  p: {start: 1e5, rate: 1e11*(1e-5 - 2e-3*qd(x))}\n  u: {sample: 0.1, next: q(x)}\n"                              \
    "bodies: {m: {joint: {name: x, prismatic: z, at: ground}, mass: 20}}\n"                                            \
    "forces: {cylinder: {joint: x, force: 2e-3*p + 7*u}}\n"

static double effort_of_cylinder(double t)
{
    double x = 0.01 * sin(3 * t), p = 1e5 + 1e11 * (1e-5 * t - 2e-3 * x);
    double sample = t > 0 ? 0.1 * (ceil(10 * t - 1e-9) - 1) : 0;
    return -20 * 0.09 * sin(3 * t) + 20 * 9.81 - 2e-3 * p - 7 * 0.01 * sin(3 * sample);
}

static void compare_cylinder(const kempe_inverse *r, int rows)
{
    CHECK(r && r->rows == rows && r->balance.freedoms == 1 && r->balance.hold > 0.99);
    for (int row = 0; r && row < r->rows; row++)
        CHECK_NEAR(tau_at(r, row)[0], effort_of_cylinder(r->t[row]), 1e-6);
}

/* Along drives, along a table with the states, at the start; a table without them is refused. */
static void cylinder_by_hand(void)
{
    loaded m = load_text(CYLINDER "drives: {d: {joint: x, displacement: 0.01*sin(3*t)}}\nrun: {rtol: 1e-11}\n");
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.t_end = 1, .output_step = 0.125}, KEMPE_OK);
    compare_cylinder(r, 9);
    kempe_inverse_free(r);
    unload(&m);
    m = load_text(CYLINDER);
    r = invert(&m, &(kempe_inverse_options){.actuators = "x"}, KEMPE_OK);
    compare_cylinder(r, 1);
    kempe_inverse_free(r);
    char path[] = "/tmp/kempe-cylinder-XXXXXX";
    int descriptor = mkstemp(path);
    FILE *file = descriptor >= 0 ? fdopen(descriptor, "w") : NULL;
    CHECK(file != NULL);
    for (int k = -1; file && k <= 8; k++) {
        double t = 0.125 * k, x = 0.01 * sin(3 * t);
        if (k < 0)
            fprintf(file, "t,q.x,qd.x,qdd.x,state.p,state.u\n");
        else
            fprintf(file, "%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", t, x, 0.03 * cos(3 * t), -0.09 * sin(3 * t),
                    1e5 + 1e11 * (1e-5 * t - 2e-3 * x), t > 0 ? 0.01 * sin(0.3 * (ceil(10 * t - 1e-9) - 1)) : 0);
    }
    if (file)
        (void)fclose(file);
    r = invert(&m, &(kempe_inverse_options){.actuators = "x", .motion = path}, KEMPE_OK);
    compare_cylinder(r, 9);
    kempe_inverse_free(r);
    file = fopen(path, "w");
    if (file) {
        fprintf(file, "t,q.x\n0,0\n1,1\n");
        (void)fclose(file);
    }
    r = invert(&m, &(kempe_inverse_options){.actuators = "x", .motion = path}, KEMPE_E_INPUT);
    CHECK(!r && strstr(kempe_context_message(m.context), "column state.p has no value") != NULL);
    (void)remove(path);
    unload(&m);
}

static void slider_crank_by_hand(void)
{
    loaded m = load("examples/driven_slider_crank/driven_slider_crank.yaml");
    kempe_inverse *r = invert(&m, NULL, KEMPE_OK);
    kempe_table *rows = NULL;
    char name[] = "/tmp/kempe_inverse_XXXXXX", path[sizeof name + 4];
    for (int row = 0; r && row < r->rows; row++) {
        slider_crank x = closed_form(q_at(r, row)[0], qd_at(r, row)[0]);
        CHECK_NEAR(tau_at(r, row)[0], x.torque, 2e-13);
        CHECK_NEAR(lambda_at(r, row)[0], x.push, 1e-12);
        CHECK_NEAR(power_at(r, row)[0], x.torque * 2 * M_PI, 1e-12);
    }
    write_text(&m, name, "");
    snprintf(path, sizeof path, "%s.csv", name);
    CHECK(r && kempe_inverse_table(r, "rows", &rows) == KEMPE_OK && kempe_table_write(rows, path) == KEMPE_OK);
    CHECK_TEXT(kempe_table_unit(rows, kempe_table_find(rows, "tau.crank")), "N m");
    CHECK(kempe_inverse_table(r, "columns", &rows) == KEMPE_E_ARGUMENT);
    kempe_table_free(rows);
    kempe_inverse_free(r);
    /* its own table is a motion again */
    r = invert(&m, &(kempe_inverse_options){.motion = path}, KEMPE_OK);
    for (int row = 0; r && row < r->rows; row++)
        CHECK_NEAR(tau_at(r, row)[0], closed_form(q_at(r, row)[0], qd_at(r, row)[0]).torque, 2e-13);
    unlink(path);
    unlink(name);
    kempe_inverse_free(r);
    unload(&m);
}

/* Crank and slider together: (torque, force) of least w1 torque^2 + w2 (force length)^2 with torque + slope force
 * given.
 */
static void shared_by_hand(void)
{
    loaded m = load("examples/driven_slider_crank/driven_slider_crank.yaml");
    const char *const words[] = {NULL, "crank=9", "slider=0.25,crank=2"};
    const double weights[][2] = {{1, 1}, {9, 1}, {2, 0.25}};
    double length = m.system->length;
    for (int w = 0; w < 3; w++) {
        kempe_inverse *r =
            invert(&m, &(kempe_inverse_options){.actuators = "crank,slider", .weights = words[w]}, KEMPE_OK);
        CHECK(r && kempe_inverse_dof(r) == 1 && kempe_inverse_rank(r) == 1);
        for (int row = 0; r && row < r->rows; row++) {
            slider_crank x = closed_form(q_at(r, row)[0], qd_at(r, row)[0]);
            double a = 1 / weights[w][0], b = x.slope / (weights[w][1] * length * length);
            double share = x.torque / (a + b * x.slope);
            CHECK_NEAR(tau_at(r, row)[0], share * a, 1e-12);
            CHECK_NEAR(tau_at(r, row)[1], share * b, 1e-12);
        }
        kempe_inverse_free(r);
    }
    unload(&m);
}

static double energy_at(const loaded *m, const kempe_inverse *r, int row)
{
    kempe_workspace *ws = NULL;
    CHECK(kempe_workspace_new(m->system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_evaluate(ws, r->t[row], q_at(r, row), qd_at(r, row)) == KEMPE_OK);
    double energy = kempe_workspace_kinetic(ws) + kempe_workspace_potential(ws);
    kempe_workspace_free(ws);
    return energy;
}

/* The work of the torque, by Simpson's rule, is the energy that came in. */
static void power_is_the_rate_of_energy(void)
{
    loaded m = load_four_bar(driven);
    kempe_inverse *r = invert(&m, NULL, KEMPE_OK);
    CHECK(r && r->rows == 1001);
    double work = 0, begin = energy_at(&m, r, 0), worst = 0, range = 0;
    for (int row = 2; r && row < r->rows; row += 2) {
        work += 1e-3 / 3 * (power_at(r, row - 2)[0] + 4 * power_at(r, row - 1)[0] + power_at(r, row)[0]);
        if (row % 100 == 0) {
            double gained = energy_at(&m, r, row) - begin;
            worst = check_max(worst, fabs(gained - work));
            range = check_max(range, fabs(gained));
        }
    }
    CHECK(range > 1 && worst < 1e-9 * range);
    kempe_inverse_free(r);
    unload(&m);
}

/* -- forward and back -------------------------------------------------------------------------------- */

/* Efforts as functions of time. */
typedef struct player {
    int count;
    const int *coordinate;
    kmp_table *effort[MOST];
} player;

static int play(void *user, double t, const double *q, const double *qd, double *effort)
{
    const player *p = user;
    (void)q, (void)qd;
    for (int k = 0; k < p->count; k++)
        effort[p->coordinate[k]] += kmp_table_value(p->effort[k], 0, t);
    return 0;
}

/* The platform led along its drives; the forces of the legs so found, put into the free platform, make the same
 * motion. */
static void the_platform_comes_back(void)
{
    loaded led = load("examples/stewart/driven.yaml"), free_one = load("examples/stewart/stewart.yaml");
    const char *const legs = "slide1,slide2,slide3,slide4,slide5,slide6";
    kempe_inverse *r =
        invert(&led, &(kempe_inverse_options){.actuators = legs, .t_end = 1, .output_step = 5e-4}, KEMPE_OK);
    int slides[6], rows = r ? r->rows : 0;
    player p = {.count = 6, .coordinate = slides};
    double *t = calloc((size_t)rows, sizeof *t), *tau = calloc((size_t)rows, sizeof *tau), worst = 0;
    CHECK(rows == 2001 && t && tau);
    for (int k = 0; k < 6; k++) {
        for (int row = 0; row < rows; row++) {
            t[row] = r->t[row];
            tau[row] = tau_at(r, row)[k];
        }
        slides[k] = r->actuators.coordinate[k];
        CHECK_TEXT(kempe_model_coordinate_name(free_one.model, slides[k]),
                   kempe_model_coordinate_name(led.model, slides[k]));
        p.effort[k] = kmp_table_new(KMP_TABLE_CUBIC, rows, t, tau);
    }
    kempe_system_set_force(free_one.system, play, &p);
    kempe_trajectory *x = simulate(&free_one, 1, 0.05, 1e-12);
    for (int row = 0; x && row < kempe_trajectory_row_count(x); row++)
        for (int k = 0; k < 24; k++)
            worst = check_max(worst, fabs(kempe_trajectory_q(x, row)[k] - q_at(r, 100 * row)[k]));
    CHECK(worst < 1e-10);
    if (getenv("KEMPE_SHOW"))
        printf("platform: %.2e\n", worst);
    for (int k = 0; k < 6; k++)
        kmp_table_free(p.effort[k]);
    free(t);
    free(tau);
    kempe_trajectory_free(x);
    kempe_inverse_free(r);
    unload(&led);
    unload(&free_one);
}

/* Written, read, inverted. With one actuator of two freedoms as well, where it was the only one. */
static void known_efforts_come_back(void)
{
    const struct {
        const char *text, *actuators;
        bool both;
        int rank;
    } cases[] = {{in_plane, "a1,b1", true, 2},
                 {in_space, "a1,b1", true, 2},
                 {in_plane, "a1", false, 1},
                 {in_space, "a1", false, 1}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        char path[] = "/tmp/kempe_inverse_XXXXXX";
        loaded m = load_here(cases[c].text);
        double worst = 0;
        write_robot(&m, cases[c].both, path);
        kempe_inverse *r =
            invert(&m, &(kempe_inverse_options){.motion = path, .actuators = cases[c].actuators}, KEMPE_OK);
        CHECK(r && kempe_inverse_dof(r) == 2 && kempe_inverse_rank(r) == cases[c].rank);
        CHECK(r && r->rows == 101 && kempe_inverse_residual(r) < 1e-12);
        for (int row = 0; r && row < r->rows; row++) {
            const double *tau = tau_at(r, row);
            worst = check_max(worst, fabs(tau[0] - 7 * sin(4 * r->t[row])));
            if (cases[c].both)
                worst = check_max(worst, fabs(tau[1] - 3 + 2 * qd_at(r, row)[6]));
        }
        CHECK(worst < 1e-10);
        if (getenv("KEMPE_SHOW"))
            printf("known efforts: %.2e\n", worst);
        unlink(path);
        kempe_inverse_free(r);
        unload(&m);
    }
}

/* Forces and moments of a weld that holds a box on an arm: as a run's outputs have them. */
static void reactions_are_the_outputs(void)
{
    loaded m = load_text("kempe: 1\ngravity: [1, -9, 2]\nbodies:\n"
                         "  arm: {joint: {revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, "
                         "points: {P: [1, 0, 0.2]}}\n"
                         "  box: {joint: {free: x, at: ground}, mass: 2, com: [0.1, 0.2, 0.3], inertia: {xx: 0.1, yy: "
                         "0.1, zz: 0.1}, points: {Q: [0, 0, 0]}}\n"
                         "loops: {W: {weld: [arm.P, box.Q]}}\nstart: {q: {arm: 0.3}, hold: [arm], qd: {arm: 2}}\n"
                         "run: {outputs: [reaction(W), moment(W)]}\n");
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.actuators = "arm"}, KEMPE_OK);
    kmp_evaluator *eval = kmp_eval_new(m.system, "tape");
    double size[2] = {0};
    CHECK(r && r->loads.loops == 1);
    if (r) {
        const double *shown = kmp_eval_shown(eval, 0, q_at(r, 0), qd_at(r, 0), qdd_at(r, 0), lambda_at(r, 0));
        for (int k = 0; k < 6; k++) {
            CHECK_NEAR(kmp_inverse_part(r, 0, k < 3 ? r->at.force : r->at.moment)[k % 3], shown[k], 1e-13);
            size[k / 3] += fabs(shown[k]);
        }
    }
    CHECK(size[0] > 1 && size[1] > 1);
    kmp_eval_free(eval);
    kempe_inverse_free(r);
    unload(&m);
}

/* Friction that slips along a line between an arm and the ground: its multiplier is its force, and the hinge carries
 * it. It does not count as a redundant closure. */
static void friction_by_hand(void)
{
    loaded m = load_text(
        "kempe: 1\nground: {points: {W: [0.5, 0.4, 0]}}\nbodies:\n"
        "  arm: {joint: {name: A, revolute: z, at: ground}, mass: 2, com: [0.3, 0, 0], inertia: {zz: 0.1}, points: {S: "
        "[0.4, 0.1, 0]}}\n"
        "forces: {rope: {sliding: 'distance(arm.S, ground.W)', friction: {force: 5}}}\n"
        "drives: {d: {joint: A, angle: 0.2 + 3*t}}\nrun: {t_end: 2, output_step: 0.1}\n");
    kempe_inverse *r = invert(&m, NULL, KEMPE_OK);
    kempe_table *rows = NULL;
    char *text = NULL;
    CHECK(r && kempe_inverse_table(r, "rows", &rows) == KEMPE_OK);
    const int column = kempe_table_find(rows, "reaction.A.x");
    CHECK(column > 0);
    for (int row = 0; r && row < r->rows; row++) {
        const double angle = 0.2 + 3 * r->t[row], c = cos(angle), s = sin(angle);
        const double place[2] = {0.4 * c - 0.1 * s, 0.4 * s + 0.1 * c};
        const double way[2] = {place[0] - 0.5, place[1] - 0.4}, size = hypot(way[0], way[1]);
        const double rate = 3 * (way[1] * place[0] - way[0] * place[1]) / size, pull = rate > 0 ? -5 : 5;
        const double force[2] = {pull * way[0] / size, pull * way[1] / size};
        CHECK_NEAR(lambda_at(r, row)[0], pull, 1e-14);
        CHECK_NEAR(tau_at(r, row)[0], -(place[0] * force[1] - place[1] * force[0]), 1e-13);
        CHECK_NEAR(kempe_table_number(rows, row, column), -2 * 9 * 0.3 * c - force[0], 1e-12);
        CHECK_NEAR(kempe_table_number(rows, row, column + 1), -2 * 9 * 0.3 * s - force[1], 1e-12);
    }
    CHECK(r && kempe_inverse_print(r, KEMPE_TEXT, &text) == KEMPE_OK && !strstr(text, "redundant"));
    kempe_text_free(text);
    kempe_table_free(rows);
    kempe_inverse_free(r);
    unload(&m);
}

/* Friction by the load of a joint of the tree: the joint carries its load itself, no actuator does. A sledge on a
 * guide: m a + mu m g against its motion. */
static void friction_by_a_load(void)
{
    loaded m =
        load_text("kempe: 1\ngravity: [0, 0, -10]\nbodies: {sledge: {joint: {name: s, prismatic: x, at: ground}, "
                  "mass: 2}}\nforces: {rub: {joint: s, friction: {mu: 0.3}}}\n"
                  "drives: {d: {joint: s, displacement: 0.5*sin(2*t)}}\nrun: {t_end: 3, output_step: 0.1}\n");
    kempe_inverse *r = invert(&m, NULL, KEMPE_OK);
    kempe_check *check = NULL;
    char *text = NULL;
    CHECK(kempe_check_new(m.system, &check) == KEMPE_OK && kempe_check_print(check, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "driven by 'd'\n"));
    kempe_text_free(text);
    kempe_check_free(check);
    CHECK(r && r->actuators.count == 1 && kempe_inverse_dof(r) == 1);
    for (int row = 0; r && row < r->rows; row++) {
        const double t = r->t[row], rub = cos(2 * t) > 0 ? 6 : -6;
        CHECK_NEAR(tau_at(r, row)[0], -4 * sin(2 * t) + rub, 1e-12);
    }
    kempe_inverse_free(r);
    /* At a state an open tree does not have the load; the actuator does. */
    kempe_workspace *ws = NULL;
    const char *const name = "s";
    const double q[3] = {0}, qd[3] = {0, 0, 1}, qdd[3] = {0, 0, 1.5};
    double tau = NAN, force[3];
    CHECK(m.system->n == 3 && kempe_workspace_new_with_friction(m.system, "slip", &ws) == KEMPE_OK);
    CHECK(kempe_workspace_inverse_dynamics(ws, 0, q, qd, qdd, force) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_workspace_message(ws), "a force depends on the multiplier of constraint equation 's_load1.1'"));
    kempe_workspace_free(ws);
    unload(&m);
    m = load_text("kempe: 1\ngravity: [0, 0, -10]\nbodies: {sledge: {joint: {name: s, prismatic: x, at: ground}, mass: "
                  "2}}\nforces: {rub: {joint: s, friction: {mu: 0.3}}}\nstart: {qd: {s: 1}}\n");
    CHECK(kempe_workspace_new_with_friction(m.system, "slip", &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_actuators(ws, 1, &name, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_actuator_forces(ws, 0, q, qd, qdd, &tau, NULL) == KEMPE_OK);
    CHECK_NEAR(tau, 2 * 1.5 + 6, 1e-12);
    kempe_workspace_free(ws);
    r = invert(&m, &(kempe_inverse_options){.actuators = "s"}, KEMPE_OK); /* of the start: there is no drive */
    CHECK(r && r->motion == KMP_INVERSE_START);
    if (r)
        CHECK_NEAR(tau_at(r, 0)[0], 6, 1e-12);
    kempe_inverse_free(r);
    unload(&m);
}

/* -- more and fewer actuators than freedoms ---------------------------------------------------------- */

/* The conditions of least norm as one system: W tau = S' mu, J mu = 0, S tau + J' lambda = M qdd + C. */
static void solve_dense(const loaded *m, const kempe_inverse *r, int row, const double *weight, double *tau)
{
    const kempe_system *s = m->system;
    int n = s->n, rows = s->m, a = r->actuators.count, size = a + rows + n;
    kmp_evaluator *eval = kmp_eval_new(s, "tape");
    double *matrix = calloc((size_t)(size * size), sizeof *matrix), *rhs = calloc((size_t)size, sizeof *rhs);
    double *x = calloc((size_t)size, sizeof *x), *mass = calloc((size_t)(n * n), sizeof *mass);
    kmp_eval_closure(eval, r->t[row], q_at(r, row));
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd_at(r, row));
    kmp_eval_dense_mass(eval, mass);
    for (int i = 0; i < n; i++) {
        rhs[a + rows + i] = eval->bias[i];
        for (int k = 0; k < n; k++)
            rhs[a + rows + i] += mass[i + k * n] * qdd_at(r, row)[k];
    }
    for (int k = 0; k < a; k++) {
        int at = r->actuators.coordinate[k];
        matrix[k + k * size] = weight[k] * s->scale[at] * s->scale[at];
        matrix[k + (a + rows + at) * size] = -1;
        matrix[a + rows + at + k * size] = 1;
    }
    for (int e = 0; e < s->jacobian.count; e++) {
        int i = s->jacobian.row[e], k = s->jacobian.col[e];
        matrix[a + i + (a + rows + k) * size] = eval->jacobian[e];
        matrix[a + rows + k + (a + i) * size] = eval->jacobian[e];
    }
    CHECK(kmp_least_squares(size, size, matrix, rhs, 1e-12, x) > 0);
    memcpy(tau, x, (size_t)a * sizeof *tau);
    kmp_eval_free(eval);
    free(matrix);
    free(rhs);
    free(x);
    free(mass);
}

/* Four cranks of two freedoms, in the plane and in space, where rows are redundant. */
static void least_norm_by_one_dense_system(void)
{
    const double weights[2][4] = {{1, 1, 1, 1}, {1, 5, 1, 0.2}};
    const char *const words[2] = {NULL, "b1=5,b2=0.2"}, *const text[2] = {in_plane, in_space};
    for (int c = 0; c < 2; c++) {
        char path[] = "/tmp/kempe_inverse_XXXXXX";
        loaded m = load_here(text[c]);
        write_robot(&m, true, path);
        for (int w = 0; w < 2; w++) {
            double worst = 0, size = 0, other = 0, tau[4];
            kempe_inverse_options options = {.actuators = "a1,b1,a2,b2", .motion = path, .weights = words[w]};
            kempe_inverse *r = invert(&m, &options, KEMPE_OK);
            CHECK(r && kempe_inverse_rank(r) == 2 && kempe_inverse_residual(r) < 1e-14);
            for (int row = 0; r && row < r->rows; row += 20) {
                solve_dense(&m, r, row, weights[w], tau);
                for (int k = 0; k < 4; k++) {
                    worst = check_max(worst, fabs(tau[k] - tau_at(r, row)[k]));
                    size = check_max(size, fabs(tau[k]));
                }
                other = check_max(other, fabs(tau[1] - tau[3]));
            }
            CHECK(worst < 1e-11 * size);
            CHECK((other < 1e-11 * size) == (w == 0)); /* crank and bar share evenly without weights */
            kempe_inverse_free(r);
        }
        unlink(path);
        unload(&m);
    }
}

/* b1 was driven, and a1 alone cannot do that: said with what is left, which is b1's effort by the other coordinate. */
static void too_few_actuators_are_reported(void)
{
    char path[] = "/tmp/kempe_inverse_XXXXXX", *text = NULL;
    loaded m = load_here(in_plane);
    write_robot(&m, true, path);
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.motion = path, .actuators = "a1"}, KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(m.context), "they act on 1 of 2 degrees of freedom"));
    CHECK(r && r->rows == 101 && kempe_inverse_rank(r) == 1);
    CHECK(kempe_inverse_outcome(r) == KEMPE_OUTCOME_FAILED);
    CHECK_TEXT(kempe_inverse_reason(r), kempe_context_message(m.context));
    CHECK(kempe_inverse_print(r, KEMPE_JSON, &text) == KEMPE_OK && strstr(text, "\"efforts\": \"least squares\""));
    kempe_text_free(text);
    kempe_inverse_free(r);
    unlink(path);
    unload(&m);
}

/* At its dead centre the slider cannot turn the crank, whose weight stays. */
static void out_of_reach_of_the_actuator(void)
{
    loaded m = load("examples/driven_slider_crank/driven_slider_crank.yaml");
    kempe_inverse_options options = {.actuators = "slider", .t_end = 0.5, .output_step = 0.1};
    kempe_inverse *r = invert(&m, &options, KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(m.context), "0 of 1"));
    CHECK(r && kempe_inverse_rank(r) == 0 && tau_at(r, 0)[0] == 0 && tau_at(r, 5)[0] == 0);
    for (int row = 1; r && row < 5; row++) {
        slider_crank x = closed_form(q_at(r, row)[0], qd_at(r, row)[0]);
        CHECK_NEAR(tau_at(r, row)[0], x.torque / x.slope, 1e-12);
    }
    kempe_inverse_free(r);
    unload(&m);
}

static void expect_failure(const loaded *m, const kempe_inverse_options *options, kempe_status status,
                           const char *words)
{
    kempe_inverse *r = NULL;
    CHECK(kempe_inverse_new(m->system, options, &r) == status);
    const char *message = kempe_context_message(m->context);
    if (!strstr(message, words)) {
        printf("wanted '%s' in: %s\n", words, message);
        check_failures++;
    }
    CHECK((r != NULL) == (status == KEMPE_E_FAILED));
    kempe_inverse_free(r);
}

static void expect_table_failure(const loaded *m, const char *text, kempe_status status, const char *words)
{
    char path[] = "/tmp/kempe_inverse_XXXXXX";
    write_text(m, path, text);
    expect_failure(m, &(kempe_inverse_options){.motion = path, .actuators = "a"}, status, words);
    unlink(path);
}

/* Actuators have the forces of drives: a force that depends on the multiplier of a drive is not known. */
static void loads_of_drives(void)
{
    loaded m = load_text("kempe: 1\nbodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 2}\n"
                         "  b: {joint: {name: y, prismatic: y, at: a}, mass: 1}\n"
                         "drives: {d: {joint: x, displacement: sin(2*t)}, e: {joint: y, displacement: sin(3*t)}}\n"
                         "forces: {f: {joint: y, force: 0.5*lambda(d)}}\nrun: {t_end: 1}\n");
    const char *const name = "y";
    kempe_workspace *ws = NULL;
    expect_failure(&m, NULL, KEMPE_E_ARGUMENT, "a force depends on the multiplier of 'd', a drive or a lock");
    CHECK(kempe_workspace_new(m.system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_actuators(ws, 1, &name, NULL) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_workspace_message(ws), "a force depends on the multiplier of 'd', a drive or a lock"));
    kempe_workspace_free(ws);
    unload(&m);
}

static void what_is_wrong_is_said(void)
{
    loaded m = load_four_bar("");
    expect_failure(&m, NULL, KEMPE_E_ARGUMENT, "1 degree of freedom; --actuators");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a,x"}, KEMPE_E_ARGUMENT, "actuators: unknown coordinate");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a,a"}, KEMPE_E_ARGUMENT, "is given twice");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a", .weights = "b=2"}, KEMPE_E_ARGUMENT,
                   "'b' is not an actuator");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a", .weights = "a=-2"}, KEMPE_E_ARGUMENT,
                   "positive number");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a", .weights = "a=1:2"}, KEMPE_E_ARGUMENT,
                   "positive number");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a", .output_step = -1}, KEMPE_E_ARGUMENT,
                   "output_step = -1");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a", .backend = "gpu"}, KEMPE_E_ARGUMENT,
                   "back end 'gpu'");
    expect_failure(&m, &(kempe_inverse_options){.actuators = "a", .independent = "a,b"}, KEMPE_E_FAILED,
                   "2 independent coordinates");
    expect_table_failure(&m, "t,q.a\n", KEMPE_E_INPUT, "the file has no rows");
    expect_table_failure(&m, "t,qd.a\n0,1\n", KEMPE_E_INPUT, "column q.NAME is missing");
    expect_table_failure(&m, "t,q.a,qd.a\n0,1,2\n1,1,\n", KEMPE_E_INPUT, "column qd.a has no value at t = 1 s");
    expect_table_failure(&m, "t,q.d\n0,1\n", KEMPE_E_INPUT, ":1:3: ");
    unload(&m);
    m = load_here(in_plane);
    char path[] = "/tmp/kempe_inverse_XXXXXX";
    write_text(&m, path, "t,q.a1,q.a2\n0,-2.6,-2.6\n1,-2.5,-2.5\n");
    expect_failure(&m, &(kempe_inverse_options){.motion = path, .actuators = "a1"}, KEMPE_E_FAILED,
                   "do not determine all others: 1 more is required, such as '");
    unlink(path);
    unload(&m);
    m = load_here("kempe: 1\ninclude: [{file: examples/parallel_robot/parallel_robot.yaml}]\n"
                  "drives: {m: {joint: a1, angle: \"t - 150 deg\"}}\nrun: {t_end: 1}\n");
    expect_failure(&m, NULL, KEMPE_E_FAILED, "the drives do not determine the motion of all coordinates: '");
    unload(&m);
}

int main(void)
{
    TEST(singular_values);
    TEST(efforts_are_the_multipliers_of_drives);
    TEST(slider_crank_by_hand);
    TEST(cylinder_by_hand);
    TEST(shared_by_hand);
    TEST(power_is_the_rate_of_energy);
    TEST(the_platform_comes_back);
    TEST(known_efforts_come_back);
    TEST(reactions_are_the_outputs);
    TEST(friction_by_hand);
    TEST(friction_by_a_load);
    TEST(least_norm_by_one_dense_system);
    TEST(too_few_actuators_are_reported);
    TEST(out_of_reach_of_the_actuator);
    TEST(loads_of_drives);
    TEST(what_is_wrong_is_said);
    return check_report();
}
