/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 4 */
/* Sensitivities see what a run sees, and say when their digits do not hold: events that lie within a step, against the
 * exact motion; an ill-conditioned motion, forward and backward; an interrupt; ensembles of such motions. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "testing.h"
#include <kempe/ensemble.h>
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <kempe/table.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    int warnings;
    char words[1024]; /* of the last warning */
} scene;

static void listen(void *user, kempe_level level, const char *line)
{
    scene *s = user;
    if (level != KEMPE_LOG_WARNING)
        return;
    s->warnings++;
    (void)snprintf(s->words, sizeof s->words, "%s", line);
}

static void open_scene(scene *s, const char *text)
{
    *s = (scene){.context = kempe_context_new()};
    CHECK(kempe_model_read_text(s->context, text, "model.yaml", &s->model) == KEMPE_OK);
    kempe_context_set_log(s->context, listen, s);
}

static void close_scene(scene *s)
{
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

/* -- windows ----------------------------------------------------------------------------------------- */

enum { WIDTHS = 8, PLACES = 3 };

/* A unit mass on a spring k, with a force -f within |q - c| < w besides. */
typedef struct window {
    double k, f, c, w;
} window;

static const double window_start = -1, window_end = 6;

/* The first t > 0 at which centre + a cos(omega t + phase) is at `bound`, INFINITY when it never is. */
static double time_to(double centre, double a, double omega, double phase, double bound)
{
    const double pi = acos(-1), turn = 2 * pi;
    double cosine = (bound - centre) / a, first = INFINITY;
    if (!(fabs(cosine) < 1))
        return INFINITY;
    for (int side = -1; side <= 1; side += 2) {
        double angle = fmod(side * acos(cosine) - phase, turn);
        angle += angle < 1e-9 ? turn : 0; /* where it is now does not count */
        angle -= angle > turn ? turn : 0;
        first = fmin(first, (angle < 1e-9 ? turn : angle) / omega);
    }
    return first;
}

/* q at the end, exactly: one swing after the other, each about a centre of its own. */
static double exact_end(const window *x)
{
    double t = 0, q = window_start, v = 0, omega = sqrt(x->k);
    bool inside = fabs(q - x->c) < x->w;
    while (t < window_end) {
        double centre = inside ? -x->f / x->k : 0;
        double a = hypot(q - centre, v / omega), phase = atan2(-v / omega, q - centre);
        double next =
            fmin(time_to(centre, a, omega, phase, x->c - x->w), time_to(centre, a, omega, phase, x->c + x->w));
        double h = fmin(next, window_end - t);
        q = centre + a * cos(omega * h + phase);
        v = -a * omega * sin(omega * h + phase);
        inside = h < window_end - t ? !inside : inside;
        t += h;
    }
    return q;
}

/* dq/dk and dq/df, of differences of the exact motion. */
static void exact_slopes(const window *x, double slope[2])
{
    for (int p = 0; p < 2; p++) {
        double coarse = 0, step = 1e-4;
        for (int pass = 0; pass < 2; pass++, step /= 2) {
            window plus = *x, minus = *x;
            *(p ? &plus.f : &plus.k) += step;
            *(p ? &minus.f : &minus.k) -= step;
            double difference = (exact_end(&plus) - exact_end(&minus)) / (2 * step);
            slope[p] = pass ? (4 * difference - coarse) / 3 : difference;
            coarse = difference;
        }
    }
}

/* True if both methods give the value and the slopes, or warn. */
static void check_window(const window *x, double rtol)
{
    char text[1024];
    double exact[2], end = exact_end(x);
    exact_slopes(x, exact);
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nname: window\nparameters: {k: %.17g, f: %.17g}\nbodies:\n"
                   "  m: {joint: {name: A, prismatic: x, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n"
                   "forces:\n  s: {joint: A, force: \"-k*q(A)\"}\n"
                   "  w: {joint: A, force: \"-if(abs(q(A) - (%.17g)) < %.17g, f, 0)\"}\nstart: {q: {A: %g}}\n",
                   x->k, x->f, x->c, x->w, window_start);
    scene s;
    open_scene(&s, text);
    for (int method = 0; method < 2; method++) {
        kempe_sensitivity *found = NULL;
        kempe_sensitivity_options options = {.parameters = "k,f",
                                             .outputs = "q(A)",
                                             .method = method ? "adjoint" : "forward",
                                             .run = &(kempe_run_options){.rtol = rtol, .t_end = window_end}};
        s.warnings = 0;
        CHECK(kempe_sensitivity_new(s.model, &options, &found) == KEMPE_OK);
        int last = found->rows - 1;
        double off = fabs(kmp_sensitivity_value(found, last, 0) - end);
        for (int p = 0; p < 2; p++)
            off = fmax(off, fabs(kmp_sensitivity_slope(found, last, 0, p) - exact[p]) / (1 + fabs(exact[p])));
        if (!(off <= 100 * rtol) && s.warnings == 0)
            printf("  c = %g, w = %g, %s: off by %.2g without a word\n", x->c, x->w, options.method, off);
        CHECK(off <= 100 * rtol || s.warnings > 0);
        kempe_sensitivity_free(found);
    }
    close_scene(&s);
}

static void windows_within_a_step(void)
{
    static const double width[WIDTHS] = {0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.04, 0.01}, place[PLACES] = {0, 0.1, -0.3};
    for (int i = 0; i < WIDTHS; i++)
        for (int k = 0; k < PLACES; k++)
            check_window(&(window){1, 5, place[k], width[i]}, 1e-5);
}

/* -- what does not hold ------------------------------------------------------------------------------ */

/* A cart on a spring with a pole that stands all but upright: each time it comes up again errors grow. */
static const char cart_pole[] =
    "kempe: 1\nname: cart pole\ngravity: [0, -9.81, 0]\nparameters: {m: 0.3, a: 0.001}\nbodies:\n"
    "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, "
    "points: {P: [0, 0, 0]}}\n"
    "  pole: {joint: {name: p, revolute: z, at: cart.P}, mass: m, com: [0, 0.5, 0], inertia: {zz: 0.001}}\n"
    "forces: {k: {joint: x, force: -10*q(x)}}\nstart: {q: {p: a}}\n";

static double slope_of_cart(scene *s, const char *method, double t_end, double rtol, int once, const char *wanted)
{
    kempe_sensitivity *found = NULL;
    kempe_sensitivity_options options = {
        .parameters = "m",
        .outputs = "q(x)",
        .method = method,
        .run = &(kempe_run_options){
            .rtol = rtol, .t_end = t_end, .output_step = t_end, .integrator = "dop853", .no_convergence_check = once}};
    char *json = NULL;
    s->warnings = 0;
    s->words[0] = '\0';
    bool doubted = strstr(wanted, "not converged") != NULL;
    CHECK(kempe_sensitivity_new(s->model, &options, &found) == (doubted ? KEMPE_UNTRUSTED : KEMPE_OK));
    CHECK(kempe_sensitivity_print(found, KEMPE_JSON, &json) == KEMPE_OK);
    CHECK(json && strstr(json, wanted) != NULL);
    double slope = kmp_sensitivity_slope(found, found->rows - 1, 0, 0);
    kempe_text_free(json);
    kempe_sensitivity_free(found);
    return slope;
}

static void an_unstable_cart_pole_is_reported(void)
{
    scene s;
    open_scene(&s, cart_pole);
    double truth = slope_of_cart(&s, "forward", 60, 1e-13, 1, "\"convergence\": null");
    CHECK_NEAR(truth, -15.9277, 1e-3);
    CHECK(s.warnings == 0);
    static const char *const methods[] = {"forward", "adjoint"};
    for (int k = 0; k < 2; k++) {
        double slope = slope_of_cart(&s, methods[k], 60, 1e-6, 0, "\"result\": \"not converged\"");
        CHECK(fabs(slope - truth) > 0.1 * fabs(truth));
        CHECK(s.warnings == 1 && strstr(s.words, "do not trust the motion") && strstr(s.words, "'q.x/m'"));
        (void)slope_of_cart(&s, methods[k], 60, 1e-6, 1, "\"convergence\": null");
        CHECK(s.warnings == 0);
        slope = slope_of_cart(&s, methods[k], 2, 1e-8, 0, "\"result\": \"converged\"");
        CHECK(s.warnings == 0);
    }
    close_scene(&s);
}

/* A motion in good order whose derivatives have more error than a hundred tolerances: the warning says how much. */
static void an_error_is_told_with_its_size(void)
{
    static const double rtol[] = {1e-4, 1e-8};
    for (int k = 0; k < 2; k++) {
        scene s = {.context = kempe_context_new()};
        kempe_sensitivity *found = NULL, *truth = NULL;
        kempe_run_options run = {.rtol = rtol[k], .t_end = 5, .integrator = "dop853"};
        kempe_sensitivity_options options = {.parameters = "base", .outputs = "lambda(C)", .run = &run};
        CHECK(kempe_model_read(s.context, KEMPE_ROOT "/examples/four_bar/four_bar.yaml", &s.model) == KEMPE_OK);
        kempe_context_set_log(s.context, listen, &s);
        CHECK(kempe_sensitivity_new(s.model, &options, &found) == KEMPE_OK);
        CHECK(s.warnings == (k == 0));
        const char *at = strstr(s.words, "has a relative error of ");
        run.rtol = 1e-11;
        run.no_convergence_check = 1;
        CHECK(kempe_sensitivity_new(s.model, &options, &truth) == KEMPE_OK);
        double worst = 0;
        for (int c = 0; found && truth && c < 2; c++) {
            double size = 0;
            for (int row = 0; row < truth->rows; row++) {
                double exact = kmp_sensitivity_slope(truth, row, c, 0);
                size = fmax(size, fabs(exact));
                worst = fmax(worst, fabs(kmp_sensitivity_slope(found, row, c, 0) - exact) / size);
            }
        }
        CHECK(k == 0 ? worst > 100 * rtol[k] && at : worst <= 100 * rtol[k] && !at);
        if (at)
            CHECK(strtod(at + 24, NULL) >= 0.5 * worst); /* of all numbers the largest */
        kempe_sensitivity_free(found);
        kempe_sensitivity_free(truth);
        close_scene(&s);
    }
}

static void checkpoints_are_refused(void)
{
    scene s;
    open_scene(&s, cart_pole);
    for (int k = 0; k < 2; k++) {
        kempe_sensitivity *found = NULL;
        kempe_run_options run = {.t_end = 1};
        kempe_sensitivity_options options = {.parameters = "m", .outputs = "q(x)", .run = &run};
        *(k ? &run.resume : &run.checkpoint) = "run.csv";
        CHECK(kempe_sensitivity_new(s.model, &options, &found) == KEMPE_E_ARGUMENT);
        CHECK(strstr(kempe_context_message(s.context), "sensitivities have no checkpoints"));
    }
    close_scene(&s);
}

static void ensembles_of_it_are_reported(void)
{
    scene s;
    open_scene(&s, cart_pole);
    static const char *const names[] = {"m"};
    static const double rows[] = {0.2, 0.25, 0.3, 0.35};
    for (int k = 0; k < 3; k++) {
        kempe_values *values = NULL;
        kempe_ensemble *many = NULL;
        kempe_ensemble_result *batch = NULL;
        const kempe_run_options run = {.rtol = 1e-6, .t_end = k < 2 ? 60 : 2, .no_convergence_check = k == 1};
        s.warnings = 0;
        CHECK(kempe_values_new(s.model, 1, names, 4, rows, &values) == KEMPE_OK);
        CHECK(kempe_ensemble_new(s.model, values, &many) == KEMPE_OK);
        CHECK(kempe_ensemble_run(many, &run, 0, &batch) == (k == 0 ? KEMPE_UNTRUSTED : KEMPE_OK));
        CHECK(s.warnings == (k == 0));
        CHECK(k > 0 || strstr(s.words, "of 4 instances"));
        kempe_table *instances = NULL;
        CHECK(kempe_ensemble_result_table(batch, "instances", &instances) == KEMPE_OK);
        CHECK_TEXT(kempe_table_word(instances, 2, kempe_table_find(instances, "verdict")), k == 0   ? "not converged"
                                                                                           : k == 1 ? ""
                                                                                                    : "converged");
        kempe_table_free(instances);
        kempe_ensemble_result_free(batch);
        kempe_ensemble_free(many);
        kempe_values_free(values);
    }
    close_scene(&s);
}

/* -- an interrupt ------------------------------------------------------------------------------------ */

static void an_interrupt_ends_it(void)
{
    static const char *const methods[] = {"forward", "adjoint"};
    for (int k = 0; k < 2; k++) {
        scene s;
        open_scene(&s, cart_pole);
        kempe_sensitivity *found = NULL;
        kempe_sensitivity_options options = {
            .parameters = "m", .outputs = "q(x)", .method = methods[k], .run = &(kempe_run_options){.t_end = 60}};
        kempe_context_interrupt(s.context);
        CHECK(kempe_sensitivity_new(s.model, &options, &found) == KEMPE_STOPPED);
        kempe_sensitivity_free(found);
        close_scene(&s);
    }
}

/* -- inputs with samples --------------------------------------------------------------------------------- */

/* Two pendulums in a loop with the ground, driven by inputs of three kinds. One condition follows a held input, another
 * one the motion and a line that moves. */
static const char sampled[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 3, f: 2, d: 0.2}\ninputs:\n"
    "  held: {t: [0.2, 0.41, 0.83], value: [0, 2, -1], method: hold, unit: N*m}\n"
    "  bent: {t: [0, 0.5, 1.1], value: [0.1, 0.4, -0.2], method: linear}\n"
    "  smooth: {t: [0, 0.4, 0.8, 1.2, 1.6], value: [0, 1, 0, -1, 0], method: cubic, unit: N*m}\n"
    "ground: {points: {B: [1, 0, 0]}}\nbodies:\n"
    "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.05}, "
    "points: {P: [0.3, 0, 0]}}\n"
    "  b: {joint: {name: C, revolute: z, at: a.P}, mass: 1, com: [0.45, 0, 0], inertia: {zz: 0.1}, "
    "points: {Q: [0.9, 0, 0]}}\n"
    "  c: {joint: {name: R, revolute: z, at: ground.B}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.05}, "
    "points: {Q: [0.6, 0, 0]}}\n"
    "loops: {q: {ball: [b.Q, c.Q]}}\n"
    "forces:\n"
    "  motor: {joint: A, torque: \"k*(held + smooth) - d*qd(A) - if(held > 1, k*q(A), 0)\"}\n"
    "  line: {joint: R, torque: \"-if(q(R) - 1.5 > bent, f + 20*(q(R) - 1.5 - bent), 0)\"}\n"
    "start: {q: {A: 0.5, C: 0.5, R: 1.5}, qd: {A: 1}, hold: [A]}\n";

/* The last row's number c of a run with other parameters. */
static double end_of_sampled(const double values[3], int integral, int c)
{
    char word[3][32];
    kempe_setting set[3] = {{"k", word[0]}, {"f", word[1]}, {"d", word[2]}};
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_sensitivity *found = NULL;
    for (int p = 0; p < 3; p++)
        (void)snprintf(word[p], sizeof word[p], "%.17g", values[p]);
    CHECK(kempe_model_read_text_set(context, sampled, "model.yaml", set, 3, &model) == KEMPE_OK);
    kempe_sensitivity_options options = {
        .parameters = "k",
        .outputs = "q(A),qd(R)",
        .integral = integral,
        .run = &(kempe_run_options){.rtol = 1e-12, .t_end = 1.5, .no_convergence_check = 1}};
    CHECK(kempe_sensitivity_new(model, &options, &found) == KEMPE_OK);
    double end = found ? kmp_sensitivity_value(found, found->rows - 1, c) : NAN;
    kempe_sensitivity_free(found);
    kempe_model_free(model);
    kempe_context_free(context);
    return end;
}

static double difference_of_sampled(int p, int integral, int c)
{
    double values[2][3] = {{3, 2, 0.2}, {3, 2, 0.2}}, h = 1e-4;
    values[0][p] += h;
    values[1][p] -= h;
    return (end_of_sampled(values[0], integral, c) - end_of_sampled(values[1], integral, c)) / (2 * h);
}

static void inputs_with_samples(void)
{
    static const char *const methods[] = {"forward", "adjoint"}, *const integrators[] = {"dop853", "radau9"};
    scene s;
    open_scene(&s, sampled);
    for (int way = 0; way < 8; way++) {
        kempe_sensitivity *found = NULL;
        kempe_sensitivity_options options = {
            .parameters = "k,f,d",
            .outputs = "q(A),qd(R)",
            .integral = way & 1,
            .method = methods[way >> 1 & 1],
            .run = &(kempe_run_options){.rtol = 1e-10, .t_end = 1.5, .integrator = integrators[way >> 2]}};
        CHECK(kempe_sensitivity_new(s.model, &options, &found) == KEMPE_OK);
        for (int c = 0; found && c < 2; c++)
            for (int p = 0; p < 3; p++)
                CHECK_NEAR(kmp_sensitivity_slope(found, found->rows - 1, c, p), difference_of_sampled(p, way & 1, c),
                           2e-6);
        kempe_sensitivity_free(found);
    }
    CHECK(s.warnings == 0);
    close_scene(&s);
}

/* A slide of mass 3 under a force u (1 + sin t), and a hook that a drive moves to w + 0.2 t against a spring: constant
 * inputs are parameters, by both methods and in equilibria. */
static const char constants[] =
    "kempe: 1\ninputs: {u: {unit: N, default: 3}, w: {unit: m, default: 0.1}, v: {t: [0, 1], value: [0, 1], method: "
    "linear}}\n"
    "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 2}, "
    "b: {joint: {name: y, prismatic: y, at: a}, mass: 1}}\n"
    "drives: {lift: {joint: y, displacement: w + 0.2*t}}\n"
    "forces: {press: {joint: y, spring: {stiffness: 50, rest: 0.05}}, push: {joint: x, force: u + u*sin(t) + 0*v}}\n"
    "start: {q: {x: 0.1}, qd: {x: 0}, hold: [x]}\n";

static void inputs_that_are_constant(void)
{
    /* x = 0.1 + u/3 (t^2/2 + t - sin t), and its integral; the integral of w + 0.2 t. */
    const double x_u = (1.5 - sin(1)) / 3, integral_u = (1.0 / 6 + 0.5 - 1 + cos(1)) / 3;
    scene s;
    open_scene(&s, constants);
    for (int way = 0; way < 4; way++) {
        kempe_sensitivity *found = NULL;
        kempe_sensitivity_options options = {.parameters = "u,w",
                                             .outputs = "q(x),lambda(lift),q(y)",
                                             .integral = way & 1,
                                             .method = way >> 1 ? "adjoint" : "forward",
                                             .run = &(kempe_run_options){.rtol = 1e-11, .atol = 1e-11, .t_end = 1}};
        const double exact[3][2] = {{way & 1 ? integral_u : x_u, 0}, {0, 50}, {0, 1}};
        CHECK(kempe_sensitivity_new(s.model, &options, &found) == KEMPE_OK);
        for (int c = 0; found && c < 3; c++)
            for (int p = 0; p < 2; p++)
                CHECK_NEAR(kmp_sensitivity_slope(found, found->rows - 1, c, p), exact[c][p], 1e-9);
        kempe_sensitivity_free(found);
    }
    kempe_sensitivity *found = NULL;
    CHECK(kempe_sensitivity_new(s.model, &(kempe_sensitivity_options){.parameters = "u,v"}, &found) ==
          KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_context_message(s.context), "input 'v' has samples"));
    CHECK(kempe_sensitivity_new(s.model, &(kempe_sensitivity_options){.parameters = "u,u"}, &found) ==
          KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_context_message(s.context), "'u' is given twice"));
    close_scene(&s);
}

/* A stiff body on a base that is driven, seen through four lags: Newton's matrix by differences, also of the integrals
 * of states, whose errors are not controlled. */
static const char lags[] =
    "kempe: 1\nparameters: {k: 4e4, c: 30, tau: 0.05}\n"
    "states: {a: {rate: \"(q(x) - a)/tau\"}, b: {rate: (a - b)/tau}, d: {rate: (b - d)/tau}, e: {rate: (d - e)/tau}}\n"
    "bodies:\n  base: {joint: {name: B, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
    "  body: {joint: {name: x, prismatic: x, at: base.P}, mass: 1}\n"
    "drives: {m: {joint: B, displacement: 0.01*sin(t)}}\n"
    "forces: {s: {joint: x, spring: {stiffness: k, damping: 4000}}, f: {joint: x, force: \"c*e + 10*cos(3*t)\"}}\n";

static void states_of_a_stiff_motion(void)
{
    static const double rtol[] = {1e-8, 1e-10};
    scene s;
    open_scene(&s, lags);
    for (int k = 0; k < 2; k++) {
        kempe_sensitivity *found[2] = {NULL, NULL};
        for (int way = 0; way < 2; way++) {
            kempe_sensitivity_options options = {.parameters = "k,c,tau",
                                                 .outputs = "q(x),e",
                                                 .run = &(kempe_run_options){.rtol = way ? 1e-11 : rtol[k],
                                                                             .t_end = 0.2,
                                                                             .integrator = way ? "dop853" : "radau",
                                                                             .no_convergence_check = 1}};
            CHECK(kempe_sensitivity_new(s.model, &options, &found[way]) == KEMPE_OK);
        }
        for (int c = 0; found[0] && found[1] && c < 2; c++)
            for (int p = 0; p < 3; p++) {
                const double exact = kmp_sensitivity_slope(found[1], found[1]->rows - 1, c, p);
                CHECK_NEAR(kmp_sensitivity_slope(found[0], found[0]->rows - 1, c, p), exact,
                           100 * rtol[k] * fabs(exact));
            }
        kempe_sensitivity_free(found[0]);
        kempe_sensitivity_free(found[1]);
    }
    close_scene(&s);
}

int main(void)
{
    TEST(states_of_a_stiff_motion);
    TEST(windows_within_a_step);
    TEST(an_unstable_cart_pole_is_reported);
    TEST(an_error_is_told_with_its_size);
    TEST(checkpoints_are_refused);
    TEST(ensembles_of_it_are_reported);
    TEST(inputs_with_samples);
    TEST(inputs_that_are_constant);
    TEST(an_interrupt_ends_it);
    return check_report();
}
