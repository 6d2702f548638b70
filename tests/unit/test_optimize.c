/* SPDX-License-Identifier: BSD-3-Clause */
/* Optima against closed forms: of values at the end and at a time, of extremes, with limits, with exact slopes and
 * without; slopes against differences; trials that do not run; interrupts; threads. */
#include "ensemble/optimize/constrained_minimum.h"
#include "ensemble/optimize/optimize_study.h"
#include "loaded.h"
#include <kempe/optimize.h>
#include <stdlib.h>

static kempe_status optimize(const loaded *l, kempe_optimum_options ask, kempe_optimum **optimum)
{
    const kempe_run_options run = {.rtol = 1e-10};
    ask.run = &run;
    *optimum = NULL;
    kempe_status status = kempe_optimum_new(l->model, &ask, optimum);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    return status;
}

/* A mass on a spring and a damper that is thrown: x = v/w e^(-d t) sin w t. */
static const char *const swing = "kempe: 1\n"
                                 "parameters: {k: 50, c: 0.8}\n"
                                 "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                                 "forces: {spring: {joint: x, force: -k*q(x) - c*qd(x)}}\n"
                                 "start: {q: {x: 0}, qd: {x: 1}}\n"
                                 "run: {t_end: 1}\n";

static double swing_at(double k, double c, double t)
{
    double d = c / 4, w = sqrt(k / 2 - d * d);
    return exp(-d * t) * sin(w * t) / w;
}

/* The largest deflection of the undamped spring, v sqrt(m/k), is 0.16 at k = m (v/0.16)^2 = 78.125. */
static void finds_a_spring(void)
{
    const char *const methods[] = {"slopes", "values"};
    loaded l = load_text(swing);
    for (int m = 0; m < 2; m++) {
        kempe_optimum *o = NULL;
        CHECK(optimize(&l,
                       (kempe_optimum_options){.minimize = "k + 0*q(x)",
                                               .limits = "max(q(x)) <= 0.16",
                                               .parameters = "k:10:200",
                                               .method = methods[m]},
                       &o) == KEMPE_OK);
        double damped = kempe_optimum_value(o, 0);
        CHECK_TEXT(kempe_optimum_method(o), methods[m]);
        CHECK(kempe_optimum_is_kept(o) == 1);
        /* The damped extreme: at tan w t = w/d it is v sqrt(m/k) e^(-d t). */
        double d = 0.2, w = sqrt(damped / 2 - d * d), t = atan2(w, d) / w;
        CHECK_NEAR(swing_at(damped, 0.8, t), 0.16, 2e-6);
        CHECK_NEAR(kempe_optimum_quantity(o), damped, 1e-8);
        kempe_optimum_free(o);
    }
    unload(&l);
}

/* The largest place of a point of a rotor that makes some 160 turns in the steps of a run is its radius at any speed.
 */
static void turns_within_steps(void)
{
    loaded l =
        load_text("kempe: 1\nparameters: {w: 100}\nbodies: {disk: {joint: {name: A, revolute: z, at: ground}, mass: 1, "
                  "inertia: {zz: 0.01}, points: {P: [0.1, 0, 0]}}}\nstart: {qd: {A: w}}\nrun: {t_end: 10}\n");
    kempe_optimum *o = NULL;
    CHECK(optimize(&l, (kempe_optimum_options){.maximize = "max(position(disk.P).x)", .parameters = "w:90:110"}, &o) ==
          KEMPE_OK);
    CHECK_NEAR(o ? kempe_optimum_quantity(o) : NAN, 0.1, 1e-8);
    kempe_optimum_free(o);
    unload(&l);
}

/* The values at two times, and an extreme, with their slopes by k and c against differences of the closed form. */
static void slopes_are_exact(void)
{
    const char *const names[] = {"k", "c"};
    const double x[] = {50, 0.8};
    const kempe_run_options run = {.rtol = 1e-11};
    loaded l = load_text(swing);
    kmp_objective o;
    double values[8], slopes[16];
    CHECK(kmp_objective_init(&o, l.model, 2, names, "q(x)", "at(q(x), 0.25) < 1, min(q(x)) > -1", &run) == KEMPE_OK);
    CHECK(o.runs != NULL && o.list->run.values == 4);
    CHECK(kmp_objective_slopes(&o, x, values, slopes) == KEMPE_OK);
    double d = 0.2, w = sqrt(25 - d * d), t_min = (atan2(w, d) + acos(-1)) / w;
    const double times[] = {1, 0.25, t_min}, steps[] = {1e-3, 1e-4};
    for (int v = 0; v < 3; v++) {
        CHECK_NEAR(values[v], swing_at(50, 0.8, times[v]), 1e-8);
        for (int p = 0; p < 2; p++) {
            double up = swing_at(50 + (p == 0) * steps[p], 0.8 + (p == 1) * steps[p], times[v]);
            double down = swing_at(50 - (p == 0) * steps[p], 0.8 - (p == 1) * steps[p], times[v]);
            CHECK_NEAR(slopes[v * 2 + p], (up - down) / (2 * steps[p]), 1e-8);
        }
    }
    kmp_objective_free(&o);
    static const char *const without[] = {"range(q(x))", "rms(qdd(x))", "mean(energy.total)", "duration(q(x) < 0)"};
    for (int k = 0; k < 4; k++) {
        CHECK(kmp_objective_init(&o, l.model, 2, names, without[k], NULL, &run) == KEMPE_OK);
        CHECK(o.runs == NULL && strstr(o.obstacle, without[k]) && strstr(o.obstacle, "has no exact derivative"));
        kmp_objective_free(&o);
    }
    unload(&l);
}

/* The integral of a power of the closed form, by Simpson's rule. */
static double swing_integral(double k, double c, int power, double from, double to)
{
    enum { PARTS = 2000 };
    double sum = 0;
    for (int i = 0; i <= PARTS; i++) {
        const double x = swing_at(k, c, from + (to - from) * i / PARTS), weight = i % PARTS == 0 ? 1 : i % 2 ? 4 : 2;
        sum += weight * (power == 2 ? x * x : x);
    }
    return sum * (to - from) / (3 * PARTS);
}

/* Means and integrals over time, of the whole run and of a part of it: values and slopes of the closed form. */
static void slopes_of_integrals_are_exact(void)
{
    const char *const names[] = {"k", "c"};
    const double x[] = {50, 0.8}, steps[] = {1e-2, 1e-3};
    const kempe_run_options run = {.rtol = 1e-11};
    loaded l = load_text(swing);
    kmp_objective o;
    double values[8], slopes[16];
    CHECK(kmp_objective_init(&o, l.model, 2, names, "rms(q(x))",
                             "mean(q(x)) < 1, integral(q(x)^2) < 9, rms(q(x)) from 0.3 s to 0.7 s < 9, "
                             "mean(q(x)) from 0.5 s < 9",
                             &run) == KEMPE_OK);
    CHECK(o.runs != NULL && kmp_objective_slopes(&o, x, values, slopes) == KEMPE_OK);
    static const struct {
        int power;
        bool root, mean;
        double from, to;
    } quantities[] = {{2, true, true, 0, 1},
                      {1, false, true, 0, 1},
                      {2, false, false, 0, 1},
                      {2, true, true, 0.3, 0.7},
                      {1, false, true, 0.5, 1}};
    for (int v = 0; v < 5; v++) {
        double at[5];
        for (int i = 0; i < 5; i++) {
            const double k = x[0] + (i == 1 ? steps[0] : i == 2 ? -steps[0] : 0);
            const double c = x[1] + (i == 3 ? steps[1] : i == 4 ? -steps[1] : 0);
            at[i] = swing_integral(k, c, quantities[v].power, quantities[v].from, quantities[v].to) /
                    (quantities[v].mean ? quantities[v].to - quantities[v].from : 1);
            at[i] = quantities[v].root ? sqrt(at[i]) : at[i];
        }
        CHECK_NEAR(values[v], at[0], 1e-9);
        CHECK_NEAR(values[v], o.row[o.list->run.of[v].first_value], 1e-9);
        for (int p = 0; p < 2; p++)
            CHECK_NEAR(slopes[v * 2 + p], (at[1 + 2 * p] - at[2 + 2 * p]) / (2 * steps[p]), 1e-8);
    }
    kmp_objective_free(&o);
    unload(&l);
}

/* Slopes against central differences of the integrals that ensembles take from the dense output, which share nothing
 * with the states of the slopes: through loops, kinks, impacts, multipliers, positions of points and states. */
static void slopes_of_integrals_are_differences(void)
{
    static const char ball[] =
        "kempe: 1\nparameters: {h: 1, e: 0.8}\ngravity: [-10, 0, 0]\nbodies: {m: {joint: {name: x, prismatic: x, at: "
        "ground}, mass: 1}}\ncontacts: {floor: {joint: x, lower: 0, restitution: e}}\nstart: {q: {x: h}}\n"
        "run: {t_end: 1.1}\n";
    static const char heater[] = /* with a relay */
        "kempe: 1\nparameters: {gain: 30, loss: 2}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: "
        "1}}\nstates:\n  T: {rate: 'gain*heat - loss*(T - 15)', start: 18}\n  heat: {hysteresis: T, limits: [20, 25], "
        "values: [1, 0]}\n  sum: {sample: 10 ms, next: 'sum + 0.01*(T - 22)'}\nforces: {f: {joint: x, force: '-50*q(x) "
        "- 0.3*qd(x) + T - 20 + sum'}}\nrun: {t_end: 2}\n";
    static const struct {
        const char *path, *text; /* of one of both */
        const char *names[2], *quantity;
        double x[2], t_end;
    } cases[] = {
        {NULL, ball, {"h", "e"}, "mean(q(x))", {1, 0.8}, 1.1},
        {NULL, ball, {"h", "e"}, "rms(qd(x))", {1, 0.8}, 1.1},
        {NULL, ball, {"h", "e"}, "integral(max(q(x) - 0.2, 0)) from 0.2 s to 1 s", {1, 0.8}, 1.1},
        {"examples/four_bar/four_bar.yaml", NULL, {"base", "crank"}, "mean(abs(qd(rocker)))", {0.9, 0.3}, 0.5},
        {"examples/four_bar/four_bar.yaml", NULL, {"base", "crank"}, "rms(position(coupler.C).y)", {0.9, 0.3}, 0.5},
        {"examples/four_bar/four_bar.yaml", NULL, {"base", "crank"}, "rms(lambda(C.1)) from 0.1 s", {0.9, 0.3}, 0.5},
        {NULL, heater, {"gain", "loss"}, "mean(T)", {30, 2}, 2},
        {NULL, heater, {"gain", "loss"}, "rms(q(x) + 0.1*sum)", {30, 2}, 2},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = cases[k].path ? load(cases[k].path) : load_text(cases[k].text);
        const kempe_run_options run = {.rtol = 1e-11, .t_end = cases[k].t_end};
        kmp_objective o;
        double values[4], slopes[8], row[3], unused[8];
        const bool made = kmp_objective_init(&o, l.model, 2, cases[k].names, cases[k].quantity, NULL, &run) == KEMPE_OK;
        CHECK(made && o.runs);
        if (!made || !o.runs)
            printf("%s: %s\n", cases[k].quantity, made ? o.obstacle : kempe_context_message(l.context));
        if (!made)
            continue;
        CHECK(o.runs && kmp_objective_slopes(&o, cases[k].x, values, slopes) == KEMPE_OK);
        CHECK_NEAR(values[0], o.row[0], 1e-9);
        for (int p = 0; p < 2 && o.runs; p++) {
            const double step = 1e-4;
            for (int side = 0; side < 2; side++) {
                double x[2] = {cases[k].x[0], cases[k].x[1]};
                x[p] += side ? step : -step;
                CHECK(kmp_objective_slopes(&o, x, row, unused) == KEMPE_OK);
                row[1 + side] = o.row[0];
            }
            const double difference = (row[2] - row[1]) / (2 * step);
            CHECK_NEAR(slopes[p], difference, 1e-6);
        }
        kmp_objective_free(&o);
        unload(&l);
    }
}

/* A quantity without a value at the start: the message has the quantity, and why the run ended before. */
static void a_quantity_without_a_value_is_named(void)
{
    static const struct {
        const char *minimize, *words;
        int starts;
    } cases[] = {{"at(q(x), 3)", "the start gives no value: 'at(q(x), 3)' has no value: the run ends as requested", 1},
                 {"first(t > 9)", "none of the starts gives a value: 'first(t > 9)' has no value", 2}};
    loaded l = load_text("kempe: 1\nparameters: {v: 1}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: "
                         "1}}\nstart: {qd: {x: v}}\nrun: {t_end: 5, until: 'q(x) > 1'}\n");
    for (int k = 0; k < 2; k++) {
        kempe_optimum *o = NULL;
        CHECK(optimize(&l,
                       (kempe_optimum_options){
                           .minimize = cases[k].minimize, .parameters = "v:0.5:4", .starts = cases[k].starts},
                       &o) == KEMPE_E_FAILED);
        CHECK(check_says(kempe_context_message(l.context), cases[k].words));
    }
    unload(&l);
}

/* A condition ends the run at a time that depends on the parameter, which slopes refuse: without a method the search
 * goes on without them, and its result says why. */
static void ends_leave_values(void)
{
    loaded l = load_text("kempe: 1\nparameters: {v: 1}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: "
                         "1}}\nstart: {qd: {x: v}}\nrun: {t_end: 5, until: 'q(x) > 1'}\n");
    kempe_optimum *o = NULL;
    char *text = NULL;
    CHECK(optimize(&l, (kempe_optimum_options){.minimize = "mean((t - 0.25)^2)", .parameters = "v:0.5:4"}, &o) ==
          KEMPE_OK);
    CHECK_TEXT(kempe_optimum_method(o), "values");
    CHECK_NEAR(kempe_optimum_value(o, 0), 1 / 0.375, 1e-4); /* T^2/3 - T/4 + 1/16, T = 1/v */
    CHECK(kempe_optimum_print(o, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(check_says(text, "without derivatives (COBYLA): the run ends as requested: q(x) > 1"));
    kempe_text_free(text);
    kempe_optimum_free(o);
    CHECK(
        optimize(&l,
                 (kempe_optimum_options){.minimize = "mean((t - 0.25)^2)", .parameters = "v:0.5:4", .method = "slopes"},
                 &o) == KEMPE_E_FAILED);
    kempe_optimum_free(o);
    unload(&l);
}

/* A ball that falls is fastest, and lowest, at its impact, whose time depends on its height: no derivative of the
 * motion at one time is that of these values. In front of the impact, and by the restitution, there is one. */
static void extremes_at_events(void)
{
    const char *const names[] = {"h", "e", "w"};
    const double x[] = {1, 0.8, 0};
    const kempe_run_options run = {.rtol = 1e-10, .t_end = 0.8};
    loaded l = load_text("kempe: 1\nparameters: {h: 1, e: 0.8, w: 0}\ngravity: [-10, 0, 0]\nbodies: {m: {joint: {name: "
                         "x, prismatic: x, at: ground}, mass: 1}}\ncontacts: {floor: {joint: x, lower: w, restitution: "
                         "e}}\nstart: {q: {x: h}}\n");
    static const char *const words[] = {"min(qd(x))", "max(qd(x))", "min(q(x))", "min(q(x) + 0.1*t)", "max(q(x)*t)"};
    for (int k = 0; k < 5; k++) {
        kmp_objective o;
        double values[8], slopes[24];
        CHECK(kmp_objective_init(&o, l.model, 3, names, words[k], NULL, &run) == KEMPE_OK);
        CHECK(o.runs != NULL);
        CHECK(kmp_objective_slopes(&o, x, values, slopes) == KEMPE_OK);
        CHECK((isnan(values[0]) != 0) == (k < 4));
        CHECK(k == 4 || (o.refusal && strstr(o.refusal, "is taken at an event at t = 0.44721359")));
        kmp_objective_free(&o);
    }
    unload(&l);
}

/* A shot over level ground: the range v^2 sin(2 a)/g is largest at 45 deg, and with a limit on the height, which is
 * v^2 sin^2(a)/(2 g), where that is reached. */
static const char *const shot = "kempe: 1\n"
                                "gravity: [0, 0, -10]\n"
                                "parameters: {a: 0.3, v: 10}\n"
                                "bodies:\n"
                                "  x: {joint: {name: x, prismatic: x, at: ground}}\n"
                                "  ball: {joint: {name: z, prismatic: z, at: x}, mass: 1}\n"
                                "start: {q: {x: 0, z: 0}, qd: {x: v*cos(a), z: v*sin(a)}}\n"
                                "run: {t_end: 1}\n";

static void finds_an_angle(void)
{
    loaded l = load_text(shot);
    kempe_optimum *o = NULL;
    /* At t = 1 the distance from a point: least where the path goes through it. */
    CHECK(optimize(&l,
                   (kempe_optimum_options){
                       .minimize = "(q(x) - 6)^2 + (q(z) - 3)^2", .parameters = "a:0.1:1.5,v:1:20", .starts = 3},
                   &o) == KEMPE_OK);
    CHECK_TEXT(kempe_optimum_method(o), "slopes");
    CHECK_NEAR(kempe_optimum_value(o, 0), atan2(8, 6), 1e-4);
    CHECK_NEAR(kempe_optimum_value(o, 1), 10, 1e-4);
    kempe_optimum_free(o);
    /* The largest x at the end whose height stays below 3 m: v = 10 gives sin^2 a = 0.6. */
    CHECK(optimize(&l,
                   (kempe_optimum_options){
                       .maximize = "q(z)", .limits = "max(q(z)) < 3; q(x) > 2", .parameters = "a:0.1:1.5"},
                   &o) == KEMPE_OK);
    CHECK(kempe_optimum_is_kept(o) == 1);
    CHECK_NEAR(sin(kempe_optimum_value(o, 0)), sqrt(0.6), 1e-5);
    CHECK_NEAR(kempe_optimum_quantity(o), 10 * sqrt(0.6) - 5, 1e-5);
    kempe_optimum_free(o);
    /* No angle keeps both limits. */
    CHECK(optimize(&l,
                   (kempe_optimum_options){
                       .maximize = "q(z)", .limits = "max(q(z)) < 1; q(x) < 2", .parameters = "a:0.1:1.5"},
                   &o) == KEMPE_UNTRUSTED);
    CHECK(kempe_optimum_is_kept(o) == 0);
    kempe_optimum_free(o);
    unload(&l);
}

/* -- a coupler curve --------------------------------------------------------------------------------- */

static int row_count(const kempe_optimum *o, const char *name)
{
    kempe_table *table = NULL;
    CHECK(kempe_optimum_table(o, name, &table) == KEMPE_OK);
    int count = kempe_table_row_count(table);
    kempe_table_free(table);
    return count;
}

/* The four-bar of Chebyshev's lambda linkage from its curve: 1, 2.5, 2.5, 2 and (5, 0). */
static void finds_a_coupler_curve(void)
{
    const double known[] = {1, 2.5, 2.5, 2, 5, 0};
    loaded l = load("tests/models/coupler_curve.yaml");
    kempe_optimum *o = NULL;
    CHECK(
        optimize(&l,
                 (kempe_optimum_options){.minimize = "miss",
                                         .parameters = "crank:0.5:1.5,coupler:1.5:4,rocker:1.5:4,base:1.2:3,along:2:7,"
                                                       "across:-1:1",
                                         .starts = 4},
                 &o) == KEMPE_OK);
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(kempe_optimum_value(o, k), known[k], 1e-6);
    CHECK(row_count(o, "starts") == 4 && row_count(o, "parameters") == 6 && row_count(o, "history") > 40);
    kempe_optimum_free(o);
    unload(&l);
}

/* -- interrupts -------------------------------------------------------------------------------------- */

static int countdown;

static void interrupt_late(void *user, const kempe_progress *progress)
{
    if (strcmp(progress->unit, "searches") == 0 && --countdown == 0)
        kempe_context_interrupt(user);
}

static void keeps_the_best(void)
{
    loaded l = load_text(shot);
    kempe_optimum *o = NULL;
    countdown = 4;
    kempe_context_set_progress(l.context, 0, interrupt_late, l.context);
    CHECK(optimize(&l,
                   (kempe_optimum_options){.minimize = "(q(x) - 6)^2 + (q(z) - 3)^2", .parameters = "a:0.1:1.5,v:1:20"},
                   &o) == KEMPE_STOPPED);
    CHECK(o != NULL && kempe_optimum_quantity(o) < 20);
    kempe_optimum_free(o);
    unload(&l);
}

/* -- threads ----------------------------------------------------------------------------------------- */

static bool equal_tables(const kempe_optimum *a, const kempe_optimum *b, const char *name)
{
    kempe_table *of[2] = {NULL, NULL};
    char *text[2] = {NULL, NULL};
    CHECK(kempe_optimum_table(a, name, &of[0]) == KEMPE_OK && kempe_optimum_table(b, name, &of[1]) == KEMPE_OK);
    for (int k = 0; k < 2; k++)
        CHECK(kempe_table_print(of[k], KEMPE_JSON, &text[k]) == KEMPE_OK);
    bool same = strcmp(text[0], text[1]) == 0;
    for (int k = 0; k < 2; k++) {
        kempe_text_free(text[k]);
        kempe_table_free(of[k]);
    }
    return same;
}

/* There is no shot above 15 m/s, so that places of the pool and trials fail, too. */
static void threads_change_nothing(void)
{
    const char *const methods[] = {"slopes", "values"};
    loaded l = load_text("kempe: 1\n"
                         "parameters: {a: 0.3, v: 10}\n"
                         "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "start: {q: {x: 0}, qd: {x: 'v*cos(a) + 0*sqrt(15 - v)'}}\n"
                         "run: {t_end: 1}\n");
    int refused = 0;
    for (int m = 0; m < 2; m++) {
        kempe_optimum *o[3] = {NULL, NULL, NULL};
        for (int k = 0; k < 3; k++) {
            const kempe_run_options run = {.rtol = 1e-10, .threads = k == 0 ? 1 : 2 * k + 1};
            CHECK(kempe_optimum_new(l.model,
                                    &(kempe_optimum_options){.minimize = "(q(x) - 20)^2 + a",
                                                             .limits = "max(q(x)) < 30",
                                                             .parameters = "a:0.1:1.5,v:1:20",
                                                             .starts = 7,
                                                             .method = methods[m],
                                                             .run = &run},
                                    &o[k]) == KEMPE_OK);
        }
        for (int k = 1; k < 3; k++)
            CHECK(equal_tables(o[0], o[k], "starts") && equal_tables(o[0], o[k], "history") &&
                  equal_tables(o[0], o[k], "parameters"));
        CHECK(row_count(o[0], "starts") == 7);
        refused += o[0]->refused;
        for (int k = 0; k < 3; k++)
            kempe_optimum_free(o[k]);
    }
    CHECK(refused > 0);
    unload(&l);
}

/* A count below 1 is 0: one that is 1 is not within the limit. */
static void counts_are_whole(void)
{
    loaded l = load_text("kempe: 1\n"
                         "parameters: {v: 16}\n"
                         "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "start: {qd: {x: v}}\nrun: {t_end: 1}\n");
    const struct {
        const char *limit;
        kempe_status status;
    } cases[] = {{"count(q(x) > 10) < 1", KEMPE_UNTRUSTED},
                 {"count(q(x) > 10) > 1", KEMPE_UNTRUSTED},
                 {"count(q(x) > 10) < 1.5", KEMPE_OK},
                 {"count(q(x) > 10) <= 1", KEMPE_OK},
                 {"count(q(x) > 10) >= 1", KEMPE_OK}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        kempe_optimum *o = NULL;
        const kempe_optimum_options options = {
            .minimize = "q(x)", .limits = cases[k].limit, .parameters = "v:15:20", .method = "values"};
        CHECK(kempe_optimum_new(l.model, &options, &o) == cases[k].status);
        kempe_optimum_free(o);
    }
    unload(&l);
}

int main(void)
{
    if (!kmp_minimum_available)
        return 0;
    TEST(finds_a_spring);
    TEST(counts_are_whole);
    TEST(turns_within_steps);
    TEST(slopes_are_exact);
    TEST(slopes_of_integrals_are_exact);
    TEST(slopes_of_integrals_are_differences);
    TEST(ends_leave_values);
    TEST(a_quantity_without_a_value_is_named);
    TEST(extremes_at_events);
    TEST(finds_an_angle);
    TEST(finds_a_coupler_curve);
    TEST(keeps_the_best);
    TEST(threads_change_nothing);
    return check_report();
}
