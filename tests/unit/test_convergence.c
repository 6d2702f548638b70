/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 5 */
/* wings: rail */
/* No run ends well with a wrong answer and without a word: what makes errors grow warns, what does not keeps silent. */
#include "loaded.h"
#include "output/convergence.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    int warnings;
    char words[1024]; /* of the last warning */
} scene;

static void listen(void *user, kempe_level level, const char *line)
{
    scene *s = user;
    if (level != KEMPE_LOG_WARNING)
        return;
    s->warnings++;
    snprintf(s->words, sizeof s->words, "%s", line);
}

static scene *open_scene(scene *s, const char *text, const char *path)
{
    loaded l = text ? load_text(text) : load(path);
    *s = (scene){.context = l.context, .model = l.model, .system = l.system};
    kempe_context_set_log(s->context, listen, s);
    return s;
}

static void close_scene(scene *s)
{
    loaded l = {s->context, s->model, s->system};
    unload(&l);
}

static kempe_status run(scene *s, const kempe_run_options *options, kempe_trajectory **trajectory)
{
    s->warnings = 0;
    s->words[0] = '\0';
    return kempe_simulate(s->system, options, trajectory);
}

/* The second run as the JSON report has it. */
static void check_json(const kempe_trajectory *trajectory, const char *wanted)
{
    char *text = NULL;
    CHECK(kempe_trajectory_print(trajectory, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, wanted) != NULL);
    kempe_text_free(text);
}

static const char *const formulations[] = {"reduced", "projected", "dae"};

/* -- motions that amplify ---------------------------------------------------------------------------- */

#define DOUBLE_PENDULUM(run)                                                                                           \
    "kempe: 1\nname: double\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"                      \
    "  a:\n    joint: {name: a, revolute: z, at: ground.O}\n    mass: 1\n    com: [0.5, 0, 0]\n"                       \
    "    inertia: {zz: 0.1}\n    points: {P: [1, 0, 0]}\n"                                                             \
    "  b:\n    joint: {name: b, revolute: z, at: a.P}\n    mass: 1\n    com: [0.5, 0, 0]\n    inertia: {zz: 0.1}\n"    \
    "start: {q: {a: 2, b: 0.5}}\nrun: " run "\n"

static void chaos_is_reported(void)
{
    scene s;
    open_scene(&s, DOUBLE_PENDULUM("{t_end: 60, output_step: 0.5, rtol: 1e-8}"), NULL);
    for (int k = 0; k < 3; k++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options options = {.formulation = formulations[k],
                                     .integrator = independent_integrator(formulations[k])};
        CHECK(run(&s, &options, &trajectory) == KEMPE_UNTRUSTED);
        CHECK(s.warnings == 1 && strstr(s.words, "do not trust the motion beyond t = "));
        check_json(trajectory, "\"result\": \"not converged\"");
        kempe_trajectory_free(trajectory);
    }
    close_scene(&s);
}

/* The warning before errors have grown, and once only. */
static void a_short_run_keeps_silent(void)
{
    scene s;
    open_scene(&s, DOUBLE_PENDULUM("{t_end: 1, rtol: 1e-8}"), NULL);
    for (int once = 0; once < 2; once++)
        for (int k = 0; k < 3; k++) {
            kempe_trajectory *trajectory = NULL;
            kempe_run_options options = {.formulation = formulations[k],
                                         .integrator = independent_integrator(formulations[k]),
                                         .no_convergence_check = once};
            CHECK(run(&s, &options, &trajectory) == KEMPE_OK && s.warnings == 0);
            check_json(trajectory, once ? "\"convergence\": null" : "\"result\": \"converged\"");
            kempe_trajectory_free(trajectory);
        }
    close_scene(&s);
}

/* The second run of a coarse one is finer. */
static void coarse_runs_are_checked_by_finer_ones(void)
{
    scene s;
    kempe_trajectory *trajectory = NULL;
    open_scene(&s, DOUBLE_PENDULUM("{t_end: 1}"), NULL);
    kempe_run_options options = {.rtol = 1e-4};
    CHECK(run(&s, &options, &trajectory) == KEMPE_OK && s.warnings == 0);
    check_json(trajectory, "\"rtol\": 1e-06");
    kempe_trajectory_free(trajectory);
    close_scene(&s);
}

/* -- angles of a rotation ----------------------------------------------------------------------------- */

/* Angles (a, b, c) and (a + pi, pi - b, c + pi) are one rotation, and so are full turns; others are as far apart as the
 * nearest form. */
static void forms_of_a_rotation_are_no_difference(void)
{
    scene s;
    const double pi = acos(-1), q[6] = {0, 0, 0, 0.3, 20, -0.2}, qd[6] = {0};
    open_scene(&s,
               "kempe: 1\nname: ball\nbodies:\n  ball: {joint: {name: b, free: x, at: ground}, mass: 1, "
               "inertia: {xx: 1, yy: 1, zz: 1}}\n",
               NULL);
    for (int turns = -2; turns <= 2; turns++)
        for (int k = 0; k < 2; k++) {
            double off = 0.01 * k;
            double other[6] = {0, 0, 0, 0.3 + pi, pi * (1 + 2 * turns) - 20 - off, -0.2 - pi};
            kmp_convergence found = {.known = true, .limit = 1e-6, .stopped = NAN};
            kmp_convergence_state(&found, 1, s.system, q, qd, other, qd);
            CHECK(fabs(found.apart - off) < 1e-12 && kmp_convergence_holds(&found) == (k == 0));
            CHECK(found.form == 4 && found.form_t == 1);
        }
    double other[6] = {0, 0, 0, 0.3 + pi, 20, -0.2}; /* half a turn about one axis is another rotation */
    kmp_convergence found = {.known = true, .limit = 1e-6, .stopped = NAN};
    kmp_convergence_state(&found, 1, s.system, q, qd, other, qd);
    CHECK(found.apart > 1 && !kmp_convergence_holds(&found));
    close_scene(&s);
}

/* -- states that change at events ------------------------------------------------------------------- */

#define OSCILLATOR(state)                                                                                              \
    "kempe: 1\nname: oscillator\nbodies:\n  a: {joint: {name: a, prismatic: x, at: ground}, mass: 1}\n"                \
    "forces: {k: {joint: a, force: \"-(pi/2)^2*q(a)\"}}\nstates: {n: " state "}\n"                                     \
    "start: {q: {a: 1}}\nrun: {t_end: 40, output_step: 1}\n"

/* True if a run gives no warning; any other is that it has not converged. */
static bool keeps_silent(const char *text, const char *path, const kempe_run_options *options)
{
    scene s;
    kempe_trajectory *trajectory = NULL;
    open_scene(&s, text, path);
    kempe_status status = run(&s, options, &trajectory);
    bool silent = s.warnings == 0, told = s.warnings == 1 && strstr(s.words, "do not trust the motion beyond t = ");
    CHECK(silent ? status == KEMPE_OK : told && status == KEMPE_UNTRUSTED);
    kempe_trajectory_free(trajectory);
    close_scene(&s);
    return silent;
}

/* The coordinate is cos(pi t/2): every other row is at an event, located in both runs within their errors. */
static void times_of_events_are_no_difference(void)
{
    CHECK(keeps_silent(OSCILLATOR("{when: \"q(a) < 0\", next: n + 1}"), NULL, &(kempe_run_options){.rtol = 1e-9}));
    CHECK(keeps_silent(OSCILLATOR("{when: \"q(a) < 0\", next: 1 - n}"), NULL, &(kempe_run_options){.rtol = 1e-9}));
}

/* A state that doubles a difference at each of its events, which the coordinate does not show. */
static void a_state_that_amplifies_is_reported(void)
{
    CHECK(!keeps_silent(
        OSCILLATOR("{start: 0.3, when: \"sin(6*pi*q(a)) < 0\", next: \"4*n*(1 - n)*(1 - 1e-3*qd(a)^2)\"}"), NULL,
        &(kempe_run_options){.rtol = 1e-9}));
}

/* The state of a contact has another rate from its beginning on. With friction the coordinates agree for a revolution,
 * without it not for two. */
static void a_loose_pin_is_judged_by_its_motion(void)
{
    CHECK(keeps_silent(NULL, "examples/loose_pin/loose_pin.yaml", &(kempe_run_options){0}));
    CHECK(!keeps_silent(NULL, "tests/models/compliant_pin.yaml", &(kempe_run_options){.t_end = 0.024, .rtol = 1e-9}));
}

/* -- lengths that differ by a thousand --------------------------------------------------------------- */

/* Small pivots everywhere are no change point: no warning, no zone with its 1e-9, closures shut and energy kept. */
static void long_levers_are_no_change_point(void)
{
    scene s;
    double end[6];
    open_scene(&s, NULL, "tests/models/levers.yaml");
    for (int k = 0; k < 3; k++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options options = {
            .formulation = formulations[k], .integrator = independent_integrator(formulations[k]), .rtol = 1e-12};
        CHECK(run(&s, &options, &trajectory) == KEMPE_OK && s.warnings == 0);
        int last = kempe_trajectory_row_count(trajectory) - 1;
        const double *q = kempe_trajectory_q(trajectory, last);
        for (int i = 0; i < 6; i++)
            if (k == 0)
                end[i] = q[i];
            else
                CHECK_NEAR(q[i], end[i], (k == 1 ? 1e-11 : 1e-9) * fmax(1, fabs(end[i])));
        kempe_trajectory_free(trajectory);
    }
    close_scene(&s);
}

/* If rounding of h and of J qd requires corrections beyond the tolerance, the projected formulation continues. */
static void rounding_refuses_no_step(void)
{
    const struct {
        const char *path;
        double t_end;
    } cases[] = {{"tests/models/long_slider.yaml", 0.02}, {"tests/models/long_whip.yaml", 0.02}};
    for (int k = 0; k < 2; k++) {
        scene s;
        kempe_trajectory *trajectory = NULL;
        kempe_run_options options = {.formulation = "projected", .rtol = 1e-12, .t_end = cases[k].t_end};
        open_scene(&s, NULL, cases[k].path);
        CHECK(run(&s, &options, &trajectory) == KEMPE_OK && s.warnings == 0);
        kempe_trajectory_free(trajectory);
        close_scene(&s);
    }
}

/* -- closures that hold nothing ---------------------------------------------------------------------- */

/* A rod across the only direction in which its end moves: its gradient vanishes wherever it is closed, and what is left
 * of it is rounding. No formulation may end well with the rod broken. */
static void a_rod_across_is_named(void)
{
    scene s;
    open_scene(&s,
               "kempe: 1\nname: across\ngravity: [0, -9.81, 0]\n"
               "ground: {points: {A: [-0.75107224411441575, -0.44013173241939274, 0],\n"
               "  B: [0.12027312264528445, -0.5175687335724628, 0]}}\nbodies:\n"
               "  a:\n    joint: {name: a, prismatic: y, at: ground.A}\n    mass: 1\n"
               "    points: {P: [0.46892225298556345, -0.43677254954843181, 0]}\n"
               "  b:\n    joint: {name: b, prismatic: y, at: a.P}\n    mass: 2\n"
               "    points: {P: [-0.097576886225863246, 0.58673024208423863, 0]}\n"
               "loops:\n  L: {rod: [b.P, ground.B], length: 0.5}\n"
               "start: {q: {a: 0.060607, b: -0.295587}, qd: {a: 0.7}}\nrun: {t_end: 0.5, rtol: 1e-10}\n",
               NULL);
    for (int k = 0; k < 3; k++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options options = {.formulation = formulations[k],
                                     .integrator = independent_integrator(formulations[k])};
        kempe_status status = run(&s, &options, &trajectory);
        if (status == KEMPE_UNTRUSTED)
            CHECK(s.warnings > 0 && strstr(s.words, "the loops open by"));
        else
            CHECK(status == KEMPE_E_FAILED && strstr(kempe_context_message(s.context), "constraint equation 'L.1'"));
        kempe_trajectory_free(trajectory);
    }
    close_scene(&s);
}

/* A structure has no energy but rounding: its balance is not off, and that nothing moves is a note, no warning. */
static void a_structure_at_rest_keeps_silent(void)
{
    scene s;
    open_scene(&s,
               "kempe: 1\nname: truss\ngravity: [0, -9.81, 0]\n"
               "ground: {points: {A: [0, 0, 0], B: [0.7, 0.1, 0]}}\nbodies:\n"
               "  a:\n    joint: {name: a, revolute: z, at: ground.A}\n    mass: 1\n    com: [0.3, 0, 0]\n"
               "    inertia: {zz: 0.1}\n    points: {P: [0.61, 0, 0]}\n"
               "  b:\n    joint: {name: b, revolute: z, at: ground.B}\n    mass: 1\n    com: [0.2, 0, 0]\n"
               "    inertia: {zz: 0.1}\n    points: {P: [0.53, 0, 0]}\n"
               "loops: {C: {ball: [a.P, b.P]}}\nstart: {q: {a: 0.8, b: 1.9}}\nrun: {t_end: 0.5}\n",
               NULL);
    for (int k = 0; k < 3; k++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options options = {
            .formulation = formulations[k], .integrator = independent_integrator(formulations[k]), .rtol = 1e-10};
        CHECK(run(&s, &options, &trajectory) == KEMPE_OK && s.warnings == 0);
        kempe_trajectory_free(trajectory);
    }
    close_scene(&s);
}

/* A mass on a spring that a force shakes, in a model without any length. A motion of nanometres may be coarser than the
 * tolerances of metres: it is right, or not trusted. */
static void a_motion_without_lengths_is_judged_by_its_range(void)
{
    const double k = 1, m = 1e-9, w = 2e4, own = sqrt(k / m);
    int trusted = 0;
    for (int power = 0; power >= -15; power -= 3)
        for (int fine = 0; fine < 2; fine++) {
            char text[400];
            const double force = pow(10, power), size = force / (k - m * w * w);
            snprintf(text, sizeof text,
                     "kempe: 1\nname: shaken\nbodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: %g}}\n"
                     "forces: {k: {joint: x, spring: {stiffness: %g}}, f: {joint: x, force: \"%g*sin(%g*t)\"}}\n"
                     "run: {t_end: 0.01}\n",
                     m, k, force, w);
            scene s;
            open_scene(&s, text, NULL);
            kempe_trajectory *trajectory = NULL;
            kempe_run_options options = {.atol = fine ? 1e-9 * force : 0};
            kempe_status status = run(&s, &options, &trajectory);
            CHECK(status == (s.warnings > 0 ? KEMPE_UNTRUSTED : KEMPE_OK) && (!fine || status == KEMPE_OK));
            trusted += status == KEMPE_OK;
            double error = 0;
            for (int row = 0; row < kempe_trajectory_row_count(trajectory); row++) {
                const double t = kempe_trajectory_time(trajectory, row);
                const double x = size * (sin(w * t) - w / own * sin(own * t));
                error = fmax(error, fabs(kempe_trajectory_q(trajectory, row)[0] - x));
            }
            CHECK(status == KEMPE_UNTRUSTED || error <= 1e-3 * size);
            kempe_trajectory_free(trajectory);
            close_scene(&s);
        }
    CHECK(trusted > 6);
}

/* Two gear wheels with play: their size follows from their inertia, at any scale. */
static void the_size_of_rotors_follows_from_their_inertia(void)
{
    double angle[3] = {0};
    for (int k = 0; k < 3; k++) {
        char text[900];
        const double size = pow(10, -4.5 * k), mass = size * size * size, inertia = mass * size * size;
        snprintf(text, sizeof text,
                 "kempe: 1\nname: wheels\nground: {points: {O: [0, 0, 0], P: [%.17g, 0, 0]}}\nbodies:\n"
                 "  a: {joint: {revolute: z, at: ground.O}, mass: %.17g, inertia: {zz: %.17g}}\n"
                 "  b: {joint: {revolute: z, at: ground.P}, mass: %.17g, inertia: {zz: %.17g}}\n"
                 "gears: {g: {between: [a, b], radius: [%.17g, %.17g], backlash: %.17g, restitution: 0.4}}\n"
                 "forces: {m: {joint: a, torque: \"%.17g*sin(20*t)\"}, l: {joint: b, torque: \"-%.17g*qd(b)\"}}\n"
                 "run: {t_end: 1, rtol: 1e-10}\n",
                 0.3 * size, mass, 0.02 * inertia, mass, 0.05 * inertia, 0.1 * size, 0.2 * size, 1e-3 * size, inertia,
                 0.1 * inertia);
        scene s;
        open_scene(&s, text, NULL);
        kempe_trajectory *trajectory = NULL;
        kempe_run_options options = {0};
        CHECK(run(&s, &options, &trajectory) == KEMPE_OK);
        angle[k] = trajectory ? kempe_trajectory_q(trajectory, kempe_trajectory_row_count(trajectory) - 1)[0] : 0;
        kempe_trajectory_free(trajectory);
        close_scene(&s);
    }
    CHECK_NEAR(angle[1], angle[0], 1e-8);
    CHECK_NEAR(angle[2], angle[0], 1e-8);
}

/* -- parts of a run ---------------------------------------------------------------------------------- */

/* Number after a key of the convergence check, 0 where there is none. */
static double of_check(const kempe_trajectory *trajectory, const char *key)
{
    char *text = NULL;
    CHECK(kempe_trajectory_print(trajectory, KEMPE_JSON, &text) == KEMPE_OK);
    const char *check = text ? strstr(text, "\"convergence\": {") : NULL, *end = check ? strchr(check, '}') : NULL,
               *at = check ? strstr(check, key) : NULL;
    double value = at && at < end ? strtod(at + strlen(key) + 3, NULL) : 0;
    kempe_text_free(text);
    return value;
}

/* The errors of parts of a run, added up, are about the difference of the whole one; a run that parts do not accept is
 * repeated as a whole. */
static void long_runs_on_rails_are_checked_by_parts(void)
{
    scene s;
    kempe_trajectory *parts = NULL, *whole = NULL, *doubtful = NULL;
    open_scene(&s, NULL, "examples/bogie_track/bogie_track.yaml");
    kempe_run_options options = {.t_end = 12};
    CHECK(run(&s, &options, &parts) == KEMPE_OK && s.warnings == 0);
    options.full_convergence_check = 1;
    CHECK(run(&s, &options, &whole) == KEMPE_OK && s.warnings == 0);
    const double total = of_check(parts, "total"), difference = of_check(whole, "difference");
    CHECK(of_check(parts, "parts") > 2 && of_check(parts, "checked") > 0 && of_check(parts, "checked") < 3);
    CHECK(of_check(parts, "rtol") == of_check(whole, "rtol"));
    CHECK(total >= of_check(parts, "difference") && total > difference / 30 && total < 30 * difference);
    CHECK(of_check(whole, "parts") == 0);
    check_json(parts, "\"result\": \"converged\"");
    options = (kempe_run_options){.t_end = 0.3, .rtol = 3e-13}; /* a finer run is impossible */
    CHECK(run(&s, &options, &doubtful) == KEMPE_OK);
    CHECK(of_check(doubtful, "parts") == 0 && of_check(doubtful, "rtol") > 1e-11);
    kempe_trajectory_free(parts);
    kempe_trajectory_free(whole);
    kempe_trajectory_free(doubtful);
    close_scene(&s);
}

/* The largest relative difference of the second rows, as the check has it. */
static double first_difference(const kempe_trajectory *trajectory, const kempe_trajectory *other, int n)
{
    const double *x = kempe_trajectory_q(trajectory, 1), *y = kempe_trajectory_q(other, 1);
    double most = 0;
    for (int k = 0; k < n; k++)
        most = fmax(most, fabs(x[k] - y[k]) / fmax(fabs(x[k]), 1));
    return most;
}

/* The first steps of this run have larger errors than parts of later ones: they are in the total. */
static void the_beginning_is_a_part(void)
{
    scene s;
    kempe_trajectory *parts = NULL, *exact = NULL;
    open_scene(&s, NULL, "examples/bogie_track/bogie_track.yaml");
    kempe_run_options options = {.rtol = 1e-8, .t_end = 5, .formulation = "reduced"};
    CHECK(run(&s, &options, &parts) == KEMPE_OK && of_check(parts, "parts") > 2);
    options = (kempe_run_options){
        .rtol = 1e-11, .t_end = 0.02, .formulation = "reduced", .integrator = "radau", .no_convergence_check = 1};
    CHECK(run(&s, &options, &exact) == KEMPE_OK);
    const double begin = first_difference(parts, exact, s.system->n);
    CHECK(begin > 1e-9 && of_check(parts, "total") > begin / 2);
    kempe_trajectory_free(parts);
    kempe_trajectory_free(exact);
    close_scene(&s);
}

/* Wheels that lift off and strike again amplify errors: the whole run is repeated, and its doubt is reported. The two
 * runs come apart by ten thousand times their tolerance and more; last bits decide by how much, 46 um on x86-64, 5 um
 * on arm64.
 */
static void lost_contact_needs_the_whole_run(void)
{
    scene s;
    kempe_trajectory *jumps = NULL;
    open_scene(&s, NULL, "examples/manchester/manchester.yaml");
    const int before = s.warnings;
    const kempe_run_options options = {0};
    CHECK(run(&s, &options, &jumps) == KEMPE_UNTRUSTED && s.warnings > before);
    CHECK(of_check(jumps, "parts") == 0 && of_check(jumps, "apart") > 1e4 * of_check(jumps, "rtol"));
    check_json(jumps, "\"result\": \"not converged\"");
    kempe_trajectory_free(jumps);
    close_scene(&s);
}

int main(void)
{
    TEST(long_runs_on_rails_are_checked_by_parts);
    TEST(the_beginning_is_a_part);
    TEST(lost_contact_needs_the_whole_run);
    TEST(chaos_is_reported);
    TEST(forms_of_a_rotation_are_no_difference);
    TEST(a_short_run_keeps_silent);
    TEST(coarse_runs_are_checked_by_finer_ones);
    TEST(times_of_events_are_no_difference);
    TEST(a_state_that_amplifies_is_reported);
    TEST(a_loose_pin_is_judged_by_its_motion);
    TEST(long_levers_are_no_change_point);
    TEST(rounding_refuses_no_step);
    TEST(a_rod_across_is_named);
    TEST(a_structure_at_rest_keeps_silent);
    TEST(a_motion_without_lengths_is_judged_by_its_range);
    TEST(the_size_of_rotors_follows_from_their_inertia);
    return check_report();
}
