/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 4 */
/* Trajectories' derivatives by parameters: the period of a pendulum against elliptic integrals; runs with moved
 * parameters, along another formulation, two-sided with a sweep of steps and extrapolated; one method against the
 * other; conditions that change on the way; what has no derivative. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <stdbool.h>
#include <stdlib.h>

enum { MOST = 16, STEPS = 6 };

static kempe_model *read_model(kempe_context *context, const char *text, const kempe_setting *set, int count)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read_text_set(context, text, "model.yaml", set, count, &model);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(status == KEMPE_OK);
    return model;
}

/* -- a pendulum -------------------------------------------------------------------------------------- */

/* Complete elliptic integrals of modulus k, by the arithmetic-geometric mean. */
static void elliptic(double k, double *first, double *second)
{
    double a = 1, b = sqrt(1 - k * k), c = k, sum = c * c / 2, power = 1;
    for (int i = 0; i < 40 && fabs(c) > 1e-17; i++) {
        c = (a - b) / 2;
        double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
        sum += power * c * c;
        power *= 2;
    }
    *first = acos(-1) / (2 * a);
    *second = *first * (1 - sum);
}

/* A quarter of the period T = 4 sqrt(l/g) K(sin(A/2)) ends where q = 0: dt/dp = -(dq/dp)/qd there. */
static void period_of_a_pendulum(void)
{
    static const char text[] = "kempe: 1\nname: pendulum\ngravity: [0, -g, 0]\nparameters: {g: 9.81, l: 0.7, A: 2}\n"
                               "bodies: {a: {joint: {revolute: z, at: ground}, mass: 1.3, com: [0, -l, 0]}}\n"
                               "start: {q: {a: A}}\n";
    const double g = 9.81, l = 0.7, amplitude = 2, k = sin(amplitude / 2);
    double K, E;
    elliptic(k, &K, &E);
    const double quarter = sqrt(l / g) * K, by_k = (E / (1 - k * k) - K) / k;
    const double exact[] = {-quarter / (2 * g), quarter / (2 * l), sqrt(l / g) * by_k * cos(amplitude / 2) / 2};
    kempe_context *c = kempe_context_new();
    kempe_model *model = read_model(c, text, NULL, 0);
    for (int method = 0; method < 2; method++) {
        kempe_run_options run = {0};
        kempe_sensitivity_options options = {
            .outputs = "q(a),qd(a)", .method = method ? "adjoint" : "forward", .run = &run};
        kempe_sensitivity *s = NULL;
        run.rtol = 1e-12;
        run.t_end = quarter;
        CHECK(kempe_sensitivity_new(model, &options, &s) == KEMPE_OK);
        int last = s->rows - 1;
        CHECK(fabs(kmp_sensitivity_value(s, last, 0)) < 1e-10);
        for (int p = 0; p < 3; p++) {
            double slope = -kmp_sensitivity_slope(s, last, 0, p) / kmp_sensitivity_value(s, last, 1);
            CHECK(fabs(slope / exact[p] - 1) < 1e-9);
        }
        kempe_sensitivity_free(s);
    }
    kempe_model_free(model);
    kempe_context_free(c);
}

/* -- against runs ------------------------------------------------------------------------------------ */

typedef struct trial {
    const char *text, *parameters, *outputs, *integrator, *formulation;
    double t_end, within, first_step;
    bool one_way;          /* forward alone: nothing goes back there */
    bool amplified;        /* by about 2000 tolerances, so that the repeat at another one may doubt it */
    const char *integrand; /* NULL: the outputs */
} trial;

/* q and qd at the end, of a run with parameter `name` at `value`. */
static bool ends_at(const trial *x, const char *name, double value, double *end)
{
    char number[40];
    (void)snprintf(number, sizeof number, "%.17g", value);
    const kempe_setting set = {name, number};
    kempe_context *c = kempe_context_new();
    kempe_model *model = read_model(c, x->text, &set, 1);
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    run.rtol = 1e-13;
    run.t_end = x->t_end;
    run.output_step = x->t_end;
    run.formulation = x->formulation;
    run.integrator = x->integrator;
    run.no_convergence_check = 1;
    bool ok = kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK;
    if (!ok)
        printf("%s\n", kempe_context_message(c));
    int n = kempe_model_coordinate_count(model);
    for (int i = 0; ok && i < n; i++) {
        end[i] = kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1)[i];
        end[n + i] = kempe_trajectory_qd(t, kempe_trajectory_row_count(t) - 1)[i];
    }
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(c);
    return ok;
}

/* Two-sided differences of steps halved, extrapolated once: the best of them by each column. */
static void check_parameter(const trial *x, const kempe_sensitivity *s, int p, double value)
{
    const char *name = s->name[p];
    int columns = s->columns, last = s->rows - 1;
    double best[4 * MOST], before[4 * MOST], size[2] = {1e-9, 1e-9}, plus[4 * MOST], minus[4 * MOST];
    CHECK(columns <= 4 * MOST);
    for (int c = 0; c < columns; c++) {
        best[c] = INFINITY;
        size[2 * c / columns] = fmax(size[2 * c / columns], fabs(kmp_sensitivity_slope(s, last, c, p)));
    }
    double step = x->first_step * fmax(fabs(value), 1e-3);
    for (int k = 0; k < STEPS; k++, step /= 2) {
        if (!ends_at(x, name, value + step, plus) || !ends_at(x, name, value - step, minus))
            break;
        for (int c = 0; c < columns; c++) {
            double now = (plus[c] - minus[c]) / (2 * step), slope = kmp_sensitivity_slope(s, last, c, p);
            if (k > 0)
                best[c] = fmin(best[c], fabs((4 * now - before[c]) / 3 - slope));
            before[c] = now;
        }
    }
    for (int c = 0; c < columns; c++) {
        if (!(best[c] <= x->within * size[2 * c / columns]))
            printf("  %s by %s: %.10g, off by %.2g\n", s->column[c], name, kmp_sensitivity_slope(s, last, c, p),
                   best[c]);
        CHECK(best[c] <= x->within * size[2 * c / columns]);
    }
}

/* Differences of the last rows, beside the largest of a parameter. */
static void check_same(const kempe_sensitivity *a, const kempe_sensitivity *b, double within)
{
    int last = a->rows - 1, end = b->rows - 1;
    for (int p = 0; p < a->count; p++) {
        for (int c = 0; c < a->columns; c++) {
            double x = kmp_sensitivity_slope(a, last, c, p), y = kmp_sensitivity_slope(b, end, c, p);
            if (!(fabs(x - y) <= within * (1 + fabs(x))))
                printf("  %s by %s: %.12g and %.12g\n", a->column[c], a->name[p], x, y);
            CHECK(fabs(x - y) <= within * (1 + fabs(x)));
        }
    }
}

static kempe_sensitivity *find(kempe_context *context, kempe_model *model, const trial *x, const char *method,
                               int integral)
{
    kempe_sensitivity *s = NULL;
    kempe_run_options run = {0};
    kempe_sensitivity_options options = {
        .parameters = x->parameters, .outputs = x->outputs, .method = method, .integral = integral, .run = &run};
    run.rtol = 1e-12;
    run.t_end = x->t_end;
    run.output_step = x->t_end;
    run.integrator = x->integrator;
    kempe_status status = kempe_sensitivity_new(model, &options, &s);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(status == KEMPE_OK || (x->amplified && status == KEMPE_UNTRUSTED));
    return s;
}

/* Forward at the end against differences; adjoint against that; integrals of one against those of the other. */
static void check_trial(const trial *x)
{
    kempe_context *c = kempe_context_new();
    kempe_model *model = read_model(c, x->text, NULL, 0);
    trial every = *x;
    every.outputs = "q,qd";
    kempe_sensitivity *all = find(c, model, &every, NULL, 0), *forward = find(c, model, x, "forward", 0);
    kempe_sensitivity *adjoint = x->one_way ? NULL : find(c, model, x, "adjoint", 0);
    if (all && forward && (adjoint || x->one_way)) {
        CHECK_TEXT(adjoint ? kempe_sensitivity_method(adjoint) : "adjoint", "adjoint");
        if (adjoint)
            check_same(forward, adjoint, 1e-8);
        for (int p = 0; p < all->count; p++)
            check_parameter(x, all, p, all->parameter[p]);
    }
    kempe_sensitivity_free(forward);
    kempe_sensitivity_free(adjoint);
    every.outputs = x->integrand ? x->integrand : x->outputs;
    forward = x->one_way ? NULL : find(c, model, &every, "forward", 1);
    adjoint = x->one_way ? NULL : find(c, model, &every, "adjoint", 1);
    if (forward && adjoint)
        check_same(forward, adjoint, 1e-8);
    kempe_sensitivity_free(all);
    kempe_sensitivity_free(forward);
    kempe_sensitivity_free(adjoint);
    kempe_model_free(model);
    kempe_context_free(c);
}

/* -- mechanisms -------------------------------------------------------------------------------------- */

/* An example's text with others in the places of some words: pairs, NULL ends them. To be freed. */
static char *example(const char *name, const char *const *words)
{
    char path[1024];
    (void)snprintf(path, sizeof path, "%s/examples/%s/%s.yaml", KEMPE_ROOT, name, name);
    FILE *file = fopen(path, "rb");
    enum { ROOM = 1 << 15 };
    char *text = calloc(ROOM, 1), *other = calloc(ROOM, 1);
    CHECK(file && text && other);
    if (file && text)
        CHECK(fread(text, 1, ROOM / 2, file) > 0);
    for (; file && text && other && *words; words += 2) {
        char *at = strstr(text, words[0]);
        CHECK(at != NULL);
        if (!at)
            continue;
        (void)snprintf(other, ROOM, "%.*s%s%s", (int)(at - text), text, words[1], at + strlen(words[0]));
        memcpy(text, other, ROOM);
    }
    if (file)
        (void)fclose(file);
    free(other);
    return text;
}

/* u is exchanged five times; the differences are of runs that have no u. */
static void a_four_bar_that_turns(void)
{
    char *text = example("four_bar", (const char *const[]){NULL});
    for (int k = 0; k < 2; k++)
        check_trial(&(trial){.text = text,
                             .parameters = "crank,base,rocker_mass",
                             .outputs = "position(coupler.C).x,lambda",
                             .integrator = k ? "radau" : "dop853",
                             .formulation = "projected",
                             .t_end = 0.6,
                             .within = 1e-8,
                             .first_step = 1e-3});
    free(text);
}

static void a_slider_crank_through_its_dead_centres(void)
{
    char *text = example("slider_crank", (const char *const[]){NULL});
    check_trial(&(trial){.text = text,
                         .parameters = "r,l,slider_mass",
                         .outputs = "q(slider),energy.total",
                         .formulation = "projected",
                         .t_end = 1.5,
                         .within = 1e-8,
                         .first_step = 1e-4});
    free(text);
}

static void andrews(void)
{
    static const char *const words[] = {"gravity: [0, 0, 0]",
                                        "gravity: [0, 0, 0]\nparameters: {k: 4530, r: 0.007, m: 0.04325}",
                                        "stiffness: 4530",
                                        "stiffness: k",
                                        "F: [0.007",
                                        "F: [r",
                                        "mass: 0.04325",
                                        "mass: m",
                                        NULL};
    char *text = example("andrews", words);
    check_trial(&(trial){.text = text,
                         .parameters = "k,r,m",
                         .outputs = "q(Phi),reaction(E4)",
                         .t_end = 0.02,
                         .within = 1e-7,
                         .first_step = 1e-4});
    free(text);
}

/* Stiff; springs in place of loops, so that rates decay fast and implicit methods are wanted. */
static void a_governor_along_radau(void)
{
    static const char *const integrators[] = {"radau", "radau9"};
    for (int k = 0; k < 2; k++) {
        char *text = example("governor", (const char *const[]){NULL});
        check_trial(&(trial){.text = text,
                             .parameters = "b,m",
                             .outputs = "q(slider),qd(shaft)",
                             .integrator = integrators[k],
                             .t_end = 0.3,
                             .within = 1e-7,
                             .first_step = 3e-3});
        free(text);
    }
}

/* Two freedoms, of which one rate is given: the other rates are the least that fit, and so are their derivatives. The
 * position follows from two coordinates held. A spherical joint, and a rod that moves. */
static const char five_bar[] =
    "kempe: 1\nname: five\ngravity: [0, -9.81, 0]\n"
    "parameters: {l1: 0.5, l2: 0.7, b: 0.6, m: 1.2, w: 1, a0: 2.0, f: 0.05}\n"
    "ground: {points: {O: [0, 0, 0], D: [b, 0, 0]}}\nbodies:\n"
    "  a: {joint: {revolute: z, at: ground.O}, mass: m, com: [l1/2, 0, 0], inertia: {zz: 0.01}, "
    "points: {E: [l1, 0, 0]}}\n"
    "  b: {joint: {revolute: z, at: a.E}, mass: m, com: [l2/2, 0, 0], inertia: {zz: 0.01}, points: {E: [l2, 0, 0]}}\n"
    "  c: {joint: {revolute: z, at: ground.D}, mass: m, com: [l1/2, 0, 0], inertia: {zz: 0.01}, "
    "points: {E: [l1, 0, 0]}}\n"
    "  d: {joint: {revolute: z, at: c.E}, mass: m, com: [l2/2, 0, 0], inertia: {zz: 0.01}, points: {E: [l2, 0, 0]}}\n"
    "loops: {L: {ball: [b.E, d.E]}}\n"
    "forces: {f: {joint: c, torque: -f*qd(c)}}\n"
    "start: {q: {a: a0, b: -1.2, c: 1.0, d: 1}, qd: {a: w}%s}\n";

static void rates_of_least_norm(void)
{
    char text[4096];
    (void)snprintf(text, sizeof text, five_bar, ", hold: [a, c]");
    check_trial(&(trial){.text = text,
                         .parameters = "l2,b,w,a0,f",
                         .outputs = "qdd(c),position(b.E)",
                         .t_end = 0.35,
                         .within = 1e-7,
                         .first_step = 1e-4});
}

/* A closed guess with nothing held: assembly moves the dependent coordinates of its own choice. Loops that move. */
static void a_closed_guess_and_a_drive(void)
{
    char *text = example("four_bar", (const char *const[]){", hold: [crank]", "", NULL});
    check_trial(&(trial){
        .text = text, .parameters = "base", .outputs = "q(rocker)", .t_end = 0.2, .within = 1e-7, .first_step = 1e-5});
    free(text);
    /* A held coordinate that is driven: the drive has it. */
    text =
        example("four_bar",
                (const char *const[]){"start: {", "drives: {turn: {joint: crank, angle: 3*t + t^2}}\nstart: {", NULL});
    CHECK(strstr(text, "hold: [crank]") != NULL);
    check_trial(&(trial){.text = text,
                         .parameters = "base,crank",
                         .outputs = "q(rocker),lambda(turn)",
                         .t_end = 0.3,
                         .within = 1e-7,
                         .first_step = 1e-5});
    free(text);
    text = example("driven_slider_crank", (const char *const[]){NULL});
    check_trial(&(trial){.text = text,
                         .parameters = "r,speed",
                         .outputs = "qd(slider),lambda",
                         .t_end = 0.93,
                         .within = 1e-9,
                         .first_step = 1e-3});
    free(text);
}

/* -- conditions -------------------------------------------------------------------------------------- */

/* Two links that run into a stop, whose force jumps, again and again. */
static const char stop[] =
    "kempe: 1\nname: stop\ngravity: [0, -9.81, 0]\nparameters: {l: 0.5, m: 1.2, k: 300, d: 2, hi: 0.8, f: 3}\nbodies:\n"
    "  a: {joint: {revolute: z, at: ground}, mass: m, com: [0, -l, 0], inertia: {zz: 0.01}, points: {E: [0, -2*l, "
    "0]}}\n"
    "  b: {joint: {revolute: z, at: a.E}, mass: m, com: [0, -l, 0], inertia: {zz: 0.01}}\n"
    "forces: {s: {joint: a, torque: \"if(q(a) > hi, -k*(q(a) - hi) - d*qd(a) - f, 0)\"}}\n"
    "start: {q: {a: -1, b: 0.4}, qd: {a: 0.5}}\n";

static void conditions_that_change(void)
{
    for (int k = 0; k < 2; k++)
        check_trial(&(trial){.text = stop,
                             .parameters = "l,k,hi,f",
                             .outputs = "q(b),qdd(a),force(s)",
                             .integrator = k ? "radau" : "dop853",
                             .t_end = 1.2,
                             .within = 1e-7,
                             .first_step = 1e-4});
}

/* -- deformations in balance at the start ------------------------------------------------------------- */

/* A rod between a crank and a slider, with a spring; a beam that bends in two planes and twists on a hub that turns,
 * with an end mass; pieces of segments. */
static void starts_in_balance(void)
{
    static const struct {
        const char *text, *parameters, *outputs;
        double t_end;
    } row[] = {
        {"kempe: 1\nname: rod\ngravity: [0, -g, 0]\n"
         "parameters: {E: 7e9, rho: 2700, h: 0.02, g: 9.81, k: 300, w: 3, a: 0.2}\nbodies:\n"
         "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {E: [a, 0, 0]}}\n"
         "  rod:\n    joint: {name: B, revolute: z, at: crank.E}\n"
         "    flexible: {beam: {length: 0.5, young: E, density: rho, section: {rectangle: [h, 0.02]}}, shapes: {y: 2}, "
         "frame: chord, raw: yes}\n    points: {tip: {station: 0.5}}\n"
         "  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
         "loops: {C: {ball: [rod.tip, slider.P]}}\nforces: {s: {joint: X, force: k*(0.5 - q(X))}}\n"
         "start: {elastic: static, q: {A: 1, B: -1.3, X: 0.6}, hold: [A], qd: {A: w}}\n",
         "E,rho,h,g,k,w,a", "lambda(C),q(X)", 0.03},
        {"kempe: 1\nname: beam\ngravity: [0, -g, 0.3*g]\nparameters: {E: 7e9, rho: 2700, h: 0.02, g: 9.81, w: 3}\n"
         "bodies:\n  hub: {joint: {name: A, revolute: y, at: ground}, mass: 1, inertia: {yy: 0.1}, points: {E: [0.1, "
         "0, "
         "0]}}\n  rod:\n    joint: {name: B, revolute: z, at: hub.E}\n"
         "    flexible: {beam: {length: 0.6, young: E, density: rho, section: {rectangle: [h, 0.03]}, poisson: 0.33}, "
         "shapes: {y: 1, z: 1, torsion: 1}, raw: yes}\n    points: {tip: {station: 0.6}}\n"
         "  ball: {joint: {weld: yes, at: rod.tip}, mass: 0.2, com: [0, 0, 0.05], inertia: {xx: 1e-4, yy: 1e-4, zz: "
         "1e-4}}\nstart: {elastic: static, q: {A: 0.4, B: 0.1}, qd: {A: w}}\n",
         "E,rho,h,g,w", "position(rod.tip)", 0.02},
        {"kempe: 1\nname: pieces\ngravity: [0, -g, 0]\nparameters: {E: 7e9, g: 9.81, a0: 0.3}\nbodies:\n  rod:\n"
         "    joint: {name: A, revolute: z, at: ground}\n"
         "    flexible: {beam: {length: 0.6, young: E, density: 2700, section: {rectangle: [0.02, 0.03]}}, shapes: {y: "
         "1},"
         " segments: 4}\n    points: {tip: {station: 0.6}}\nstart: {elastic: static, q: {A: a0}, qd: {A: 2}}\n",
         "E,g,a0", "position(rod_3.tip)", 0.02}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++)
        check_trial(&(trial){.text = row[k].text,
                             .parameters = row[k].parameters,
                             .outputs = row[k].outputs,
                             .t_end = row[k].t_end,
                             .within = 1e-7,
                             .first_step = 1e-3});
}

/* A robot that its drives accelerate; and a body from a file in a spatial loop. */
static void examples_in_balance(void)
{
    char *text = example("flexible_robot",
                         (const char *const[]){"thickness: 3 mm}",
                                               "thickness: 3 mm, E: 70 GPa, m: 1.2}\n"
                                               "gravity: [0, -9.81, 0]",
                                               "young: 70 GPa", "young: E", "damping: {ratio: 0.01}", "raw: yes",
                                               "mass: 1.2", "mass: m", "start: {", "start: {elastic: static, ", NULL});
    check_trial(&(trial){.text = text,
                         .parameters = "pace,E,m",
                         .outputs = "position(tool.Q),lambda",
                         .t_end = 0.01,
                         .within = 1e-6,
                         .first_step = 1e-3});
    free(text);
    text = example("flexible_blade",
                   (const char *const[]){"-9.81]", "-g]", "{pace: 40}", "{pace: 40, g: 9.81, l: 320 mm}", "320 mm}}",
                                         "l}}", "file: ", "file: " KEMPE_ROOT "/examples/flexible_blade/", "start: {",
                                         "start: {elastic: static, ", NULL});
    check_trial(&(trial){.text = text,
                         .parameters = "pace,g,l",
                         .outputs = "position(blade.P),lambda(rod)",
                         .t_end = 0.004,
                         .within = 1e-6,
                         .first_step = 1e-3});
    free(text);
}

/* -- singular places --------------------------------------------------------------------------------- */

/* A body on a spherical joint that is centred twice on its way, or from the start on; slopes are of the joint's own
 * angles all the while, those of its motion in space are the same in all. */
static void angles_that_are_centred(void)
{
    static const char top[] =
        "kempe: 1\nname: top\ngravity: [0, 0, -9.81]\nparameters: {l: 0.4, m: 1.3, j: 0.03, w: 6}\nbodies:\n"
        "  a: {joint: {name: S, spherical: z, at: ground}, mass: m, com: [l, 0, 0.1], points: {P: [l, 0.1, 0]}, "
        "inertia: {xx: j, yy: 0.05, zz: 0.03}}\n"
        "start: {q: {S.2: %g}, qd: {S.1: 1, S.2: w, S.3: 2}}\n";
    for (int k = 0; k < 3; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text, top, k == 1 ? 1.25 : 0.0);
        check_trial(&(trial){.text = text,
                             .parameters = "l,m,j,w",
                             .outputs = k == 1 ? "velocity(a.P),qdd" : "q,qd,qdd,position(a.P)",
                             .integrator = k == 2 ? "radau" : "dop853",
                             .integrand = "position(a.P),energy.kinetic",
                             .t_end = 1.5,
                             .within = 1e-8,
                             .first_step = 4e-4});
    }
}

/* A joint turned on to where its own angles are singular: an integral of these ends, all other results go on. */
static void angles_that_are_kept(void)
{
    static const char text[] = "kempe: 1\nname: over\ngravity: [0, 0, 0]\nparameters: {m: 1}\nbodies:\n"
                               "  a: {joint: {name: S, spherical: z, at: ground}, mass: m, com: [0, 0, 0.1], "
                               "inertia: {xx: 0.05, yy: 0.05, zz: 0.05}}\nstart: {qd: {S.1: 0.02, S.2: 3}}\n";
    for (int k = 0; k < 4; k++) {
        kempe_context *c = kempe_context_new();
        kempe_model *model = read_model(c, text, NULL, 0);
        kempe_sensitivity *s = NULL;
        kempe_sensitivity_options options = {.outputs = k == 3 ? "energy.kinetic" : "qd(S.2)",
                                             .method = k == 1 ? "adjoint" : "forward",
                                             .integral = k > 1,
                                             .run = &(kempe_run_options){.t_end = 1}};
        CHECK(kempe_sensitivity_new(model, &options, &s) == (k == 2 ? KEMPE_E_FAILED : KEMPE_OK));
        CHECK(k != 2 || strstr(kempe_context_message(c), "spherical joint 'S' approach their singular position"));
        kempe_sensitivity_free(s);
        kempe_model_free(model);
        kempe_context_free(c);
    }
}

/* A parallelogram that lies flat four times; %s: the length of its last link. */
static const char flat[] =
    "kempe: 1\nname: flat\ngravity: [0, -9.81, 0]\nparameters: {m: 1, mc: 0.7, d: 0.3, w: -1, g: 1}\n"
    "ground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\nbodies:\n"
    "  a: {joint: {revolute: z, at: ground.O}, mass: m, com: [0.5, 0, 0], inertia: {zz: 0.08}, "
    "points: {E: [1, 0, 0]}}\n"
    "  c: {joint: {revolute: z, at: a.E}, mass: mc, com: [0.5, 0, 0], inertia: {zz: 0.08}, points: {E: [1, 0, 0]}}\n"
    "  b: {joint: {revolute: z, at: ground.D}, mass: g, com: [0.5, 0, 0], inertia: {zz: 0.08}, "
    "points: {E: [%s, 0, 0]}}\n"
    "loops: {L: {ball: [c.E, b.E]}}\nforces: {f: {joint: a, torque: -d*qd(a)}}\n"
    "start: {q: {a: 1.5707963267948966, c: -1.5707963267948966, b: 1.5707963267948966}, qd: {a: w}, hold: [a]}\n";

/* A parameter that moves no closure there is smooth through change points. A length has no derivative beyond, and the
 * adjoint does not pass one. */
static void change_points(void)
{
    char text[2048];
    (void)snprintf(text, sizeof text, flat, "1");
    for (int k = 0; k < 2; k++)
        check_trial(&(trial){.text = text,
                             .parameters = "m,mc,d,w",
                             .outputs = "lambda",
                             .integrator = k ? "radau" : "dop853",
                             .t_end = k ? 2.9 : 3,
                             .within = 2e-7,
                             .first_step = 1e-3,
                             .one_way = true,
                             .amplified = true});
    static const char *const sentence[] = {"reaches a change point near t = 0.72", "parameters of its closures",
                                           "the forward method may"};
    for (int k = 0; k < 2; k++) {
        kempe_context *c = kempe_context_new();
        (void)snprintf(text, sizeof text, flat, k ? "1" : "g");
        kempe_model *model = read_model(c, text, NULL, 0);
        kempe_sensitivity_options options = {.parameters = "g",
                                             .outputs = "q(a)",
                                             .method = k ? "adjoint" : "forward",
                                             .run = &(kempe_run_options){.t_end = 3}};
        kempe_sensitivity *s = NULL;
        CHECK(kempe_sensitivity_new(model, &options, &s) == KEMPE_E_FAILED);
        CHECK(strstr(kempe_context_message(c), sentence[0]) && strstr(kempe_context_message(c), sentence[k + 1]));
        kempe_sensitivity_free(s);
        kempe_model_free(model);
        kempe_context_free(c);
    }
}

/* -- what cannot be had ------------------------------------------------------------------------------ */

static void expect(const char *text, const kempe_sensitivity_options *requested, kempe_status status,
                   const char *sentence)
{
    kempe_context *c = kempe_context_new();
    kempe_model *model = read_model(c, text, NULL, 0);
    kempe_sensitivity *s = NULL;
    kempe_sensitivity_options options = *requested;
    kempe_run_options run = requested->run ? *requested->run : (kempe_run_options){0};
    run.t_end = 0.1;
    options.run = &run;
    CHECK(kempe_sensitivity_new(model, &options, &s) == status && !s);
    if (!strstr(kempe_context_message(c), sentence))
        CHECK_TEXT(kempe_context_message(c), sentence);
    kempe_model_free(model);
    kempe_context_free(c);
}

/* A start that holds some of the coordinates: without closures, and where no closure depends on the others. */
static const char partly_held[] =
    "kempe: 1\nparameters: {k: 3, l: 0.4, y0: 0.2, f: 1}\nground: {points: {D: [0.5, 0, 0]}}\nbodies:\n"
    "  a: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
    "  b: {joint: {name: B, revolute: x, at: a.P}, mass: 1, inertia: {xx: 0.1}, com: [0, 0.1, 0]}\n%s"
    "forces: {s: {joint: x, force: -k*q(x)}, g: {joint: y, force: -f - q(y)}, h: {joint: B, torque: cos(q(B))}}\n"
    "start: {q: {x: 0.1, y: y0}, hold: [y], qd: {B: 1}}\n";

static void some_are_held(void)
{
    static const char *const loops[] = {"", "loops: {R: {rod: [a.P, ground.D], length: l}}\n"};
    for (int k = 0; k < 2; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text, partly_held, loops[k]);
        check_trial(&(trial){.text = text,
                             .parameters = k ? "k,l,y0,f" : "k,y0,f",
                             .outputs = "q(x),qd(B)",
                             .t_end = 0.3,
                             .within = 1e-7,
                             .first_step = 1e-4});
    }
}

static void refusals(void)
{
    static const char bare[] = "kempe: 1\nname: bare\nparameters: {half: 0.5, twice: 2*half, ax: 1}\nbodies:\n"
                               "  a: {joint: {revolute: [0, 0, ax], at: ground}, mass: 1, com: [twice, 0, 0]}\n";
    char text[4096];
    expect(stop, &(kempe_sensitivity_options){.of = "colour"}, KEMPE_E_ARGUMENT,
           "sensitivities of 'colour' are unknown; available: trajectory");
    expect(stop, &(kempe_sensitivity_options){.method = "backward"}, KEMPE_E_ARGUMENT, "available: forward, adjoint");
    expect(stop, &(kempe_sensitivity_options){.parameters = "l,kk"}, KEMPE_E_ARGUMENT,
           "the model has no parameter 'kk'; did you mean 'k'?");
    expect(stop, &(kempe_sensitivity_options){.parameters = " , "}, KEMPE_E_ARGUMENT,
           "no parameter is given for the derivatives");
    expect(stop, &(kempe_sensitivity_options){.outputs = "q(z)"}, KEMPE_E_ARGUMENT, "z");
    expect(stop, &(kempe_sensitivity_options){.run = &(kempe_run_options){.integrator = "ida"}}, KEMPE_E_ARGUMENT,
           "integrator 'ida' does not support sensitivities; available: dop853, dopri5, radau, radau5, radau9");
    expect(bare, &(kempe_sensitivity_options){.parameters = "ax"}, KEMPE_E_ARGUMENT,
           "parameter 'ax' cannot be a variable of the equations");
    (void)snprintf(text, sizeof text, five_bar, "");
    expect(text, &(kempe_sensitivity_options){0}, KEMPE_E_FAILED, "it holds 0 of 2 degrees of freedom");
    (void)snprintf(text, sizeof text, five_bar, ", hold: [a], goals: {c: 1.1}");
    expect(text, &(kempe_sensitivity_options){0}, KEMPE_E_FAILED, "it is the position nearest to goals");
}

int main(void)
{
    TEST(period_of_a_pendulum);
    TEST(a_four_bar_that_turns);
    TEST(a_slider_crank_through_its_dead_centres);
    TEST(andrews);
    TEST(a_governor_along_radau);
    TEST(rates_of_least_norm);
    TEST(a_closed_guess_and_a_drive);
    TEST(some_are_held);
    TEST(conditions_that_change);
    TEST(starts_in_balance);
    TEST(examples_in_balance);
    TEST(angles_that_are_centred);
    TEST(angles_that_are_kept);
    TEST(change_points);
    TEST(refusals);
    return check_report();
}
