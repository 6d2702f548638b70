/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 6 */
/* wings: exchange */
/* Drawings whose closures are redundant but for their last digit: taken as the mechanism that is meant, on every
 * formulation, with the misfit told; what is no rounding stays as it is, to the last bit. */
#include "constraints/closing/assemble.h"
#include "constraints/closing/rounding.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/evaluation/intended_rank.h"
#include "loaded.h"
#include "model/data/start.h"
#include "studies/simulate/trajectory.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/settings.h>

static char last_warning[1024];

static void keep_warning(void *user, kempe_level level, const char *line)
{
    (void)user;
    if (level == KEMPE_LOG_WARNING)
        (void)snprintf(last_warning, sizeof last_warning, "%s", line);
}

/* The drawing with a tolerance in metres; NAN: the default. */
static loaded draw(const char *path, double tolerance)
{
    char full[1024];
    loaded l = {.context = kempe_context_new()};
    last_warning[0] = '\0';
    kempe_context_set_log(l.context, keep_warning, NULL);
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    CHECK(kempe_model_read(l.context, full, &l.model) == KEMPE_OK);
    if (!isnan(tolerance))
        CHECK(kempe_model_set_closure_tolerance(l.model, tolerance) == KEMPE_OK);
    return load_finish(l);
}

/* q at the end of 1 s. */
static void run(const loaded *l, const char *formulation, const char *form, double *q)
{
    kempe_run_options settings = {0};
    kempe_trajectory *t = NULL;
    settings.formulation = formulation;
    settings.form = form;
    settings.t_end = 1;
    settings.output_step = 0.1;
    settings.rtol = 1e-9;
    settings.no_convergence_check = true;
    CHECK(kempe_simulate(l->system, &settings, &t) == KEMPE_OK);
    if (t && t->status == KEMPE_OK)
        memcpy(q, kempe_trajectory_q(t, t->table.rows - 1), (size_t)l->system->n * sizeof *q);
    CHECK(t && t->verdict.h_max < 1e-8);
    CHECK(t && t->verdict.misfit * l->system->length <= l->system->closure_tolerance);
    kempe_trajectory_free(t);
}

static const char *const formulations[][2] = {
    {"reduced", "integrated"}, {"reduced", "newton"}, {"dae", "stabilized1"}, {"projected", NULL}};

static int freedoms(const loaded *l)
{
    kempe_check *check = NULL;
    CHECK(kempe_check_new(l->system, &check) == KEMPE_OK);
    int p = check ? check->part.p : -1;
    kempe_check_free(check);
    return p;
}

/* -- what is meant ----------------------------------------------------------------------------------- */

static void runs_as_meant(const char *path, int p, const char *exact, double near)
{
    loaded l = draw(path, NAN), e = draw(exact ? exact : path, NAN);
    double q[16] = {0}, first[16] = {0};
    CHECK(l.system->mended && !kmp_rounding_of(l.system));
    CHECK(strstr(last_warning, "accepted as rounding") || strcmp(path, exact ? exact : path) != 0);
    CHECK(freedoms(&l) == p);
    if (exact)
        run(&e, "reduced", "integrated", first);
    for (size_t k = 0; k < sizeof formulations / sizeof *formulations; k++) {
        run(&l, formulations[k][0], formulations[k][1], k == 0 && !exact ? first : q);
        for (int i = 0; i < l.system->n && (k > 0 || exact); i++)
            CHECK_NEAR(q[i], first[i], near);
    }
    unload(&l);
    unload(&e);
}

static void a_drawing_runs_as_the_mechanism_that_is_meant(void)
{
    runs_as_meant("tests/models/rounded_four_bar.yaml", 1, NULL, 1e-4);
    runs_as_meant("tests/models/rounded_lamp.yaml", 2, NULL, 1e-4);
    runs_as_meant("tests/models/rounded_bennett.yaml", 1, "tests/models/exact_bennett.yaml", 2e-5);
}

static void the_warning_names_closure_and_both_numbers(void)
{
    loaded l = draw("tests/models/rounded_four_bar.yaml", NAN);
    CHECK(strstr(last_warning, "closure 'C' is open by 8.2e-07 m as drawn"));
    CHECK(strstr(last_warning, "closure_tolerance 0.00048 m"));
    unload(&l);
}

/* -- what is not ------------------------------------------------------------------------------------- */

static void refuses(double tolerance, const char *said)
{
    loaded l = draw("tests/models/rounded_four_bar.yaml", tolerance);
    kempe_assembly *a = NULL;
    CHECK(!l.system->mended && kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "found is 8.233e-07 m and 6.479e-05 deg, with its arc 1.223e-06 m"));
    CHECK(strstr(kempe_context_message(l.context), said));
    kempe_assembly_free(a);
    unload(&l);
}

static void a_misfit_above_the_tolerance_is_an_error_with_both_numbers(void)
{
    refuses(0, "more than the closure_tolerance of 0 m");
    refuses(1e-7, "more than the closure_tolerance of 1e-07 m");
}

/* The assembled state, bit by bit, with the tolerance and without. */
static void stays_as_it_is(const char *path, const char *text)
{
    loaded with = text ? load_text(text) : draw(path, NAN), without = {.context = kempe_context_new()};
    char full[1024];
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path ? path : "");
    CHECK((text ? kempe_model_read_text(without.context, text, "model.yaml", &without.model)
                : kempe_model_read(without.context, full, &without.model)) == KEMPE_OK);
    CHECK(kempe_model_set_closure_tolerance(without.model, 0) == KEMPE_OK);
    without = load_finish(without);
    kempe_assembly *a = NULL, *b = NULL;
    CHECK(kempe_assembly_new(with.system, &a) == KEMPE_OK && kempe_assembly_new(without.system, &b) == KEMPE_OK);
    CHECK(!with.system->mended && !kmp_rounding_of(with.system));
    CHECK(a && b && memcmp(a->q, b->q, (size_t)with.system->n * sizeof *a->q) == 0);
    kempe_assembly_free(a);
    kempe_assembly_free(b);
    unload(&with);
    unload(&without);
}

/* All bars nearly in line: a pivot of J is small here, and grows as the mechanism moves. */
static void a_small_pivot_that_is_real_is_no_rounding(void)
{
    char text[1024];
    stays_as_it_is("tests/models/near_parallelogram.yaml", NULL);
    stays_as_it_is("tests/models/parallelogram_flat.yaml", NULL);
    for (double off = 1e-1; off > 1e-6; off /= 10) {
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\nground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\nbodies:\n"
            "  a: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [0.3, 0, 0]}}\n"
            "  b: {joint: {revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}, points: {E: [0.9, 0, 0]}}\n"
            "  c: {joint: {revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {E: [0.21, 0, 0]}}\n"
            "loops: {C: {ball: [b.E, c.E]}}\nstart: {q: {a: %.9g, b: %.9g, c: 0.3}, hold: [a]}\n",
            off, -off);
        stays_as_it_is(NULL, text);
    }
}

/* A four-bar of half a millimetre on an arm of a metre cannot open by more than a few of its lengths. */
static void a_small_loop_is_no_rounding(void)
{
    stays_as_it_is(
        NULL,
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  arm: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [1, 0, 0], D: [1.0005, "
        "0, 0]}}\n"
        "  a: {joint: {revolute: z, at: arm.E}, mass: 1, inertia: {zz: 1}, points: {E: [0.00015, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}, points: {E: [0.0004, 0, 0]}}\n"
        "  c: {joint: {revolute: z, at: arm.D}, mass: 1, inertia: {zz: 1}, points: {E: [0.00025, 0, 0]}}\n"
        "  far: {joint: {revolute: z, at: arm.E}, mass: 1, inertia: {zz: 1}, points: {E: [1, 0, 0]}}\n"
        "loops: {C: {ball: [b.E, c.E]}}\nstart: {q: {a: 1, b: -0.7, c: 1.6}}\n");
}

/* A pin on a crank of 0.4 mm: its rod has a small effect, and holds it. Its place has one digit more than rounding
 * explains. */
static void a_real_closure_of_small_effect_is_no_rounding(void)
{
    stays_as_it_is(
        NULL,
        "kempe: 1\nground: {points: {O: [0, 0, 0], D: [1.20417, 0.40233, 0]}}\nbodies:\n"
        "  a: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {P: [-0.00021, 0.00035, 0], "
        "E: [0.71443, 0.10267, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}}\n"
        "  c: {joint: {revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}}\n"
        "loops: {R: {rod: [a.P, ground.D], length: 1.2696913}, K: {coupler: {b: 1, c: 1}}}\n");
}

/* A rope that gets longer with time, almost across its slider, beside a closure with a far larger pivot. Motions with
 * the rope held as it is cannot show that it opens. */
static void a_moving_closure_is_no_rounding(void)
{
    const char *text =
        "kempe: 1\nground: {points: {Q: [0, 0, 0]}}\nbodies:\n"
        "  a: {joint: {prismatic: x, at: ground}, mass: 1, points: {P: [0, 1, 0]}}\n"
        "  b: {joint: {revolute: x, at: ground}, mass: 2, inertia: {xx: 1}, points: {C: [0, 0, 0]}}\n"
        "  c: {joint: {prismatic: y, at: ground}, mass: 1, points: {P: {at: [0, 2, 0], axes: {z: [1, 0, 0]}}}}\n"
        "ropes:\n"
        "  slow: {along: [ground.Q, a.P], slack: no, length: \"1.00000005 m + 0.0001 m/s * t\"}\n"
        "  wound: {along: [{drum: b.C, radius: 1 m, axis: x, turn: left}, c.P], slack: no}\n"
        "start: {q: {a: 0.0003}}\nrun: {t_end: 1}\n";
    stays_as_it_is(NULL, text);
    loaded l = load_text(text);
    kempe_trajectory *t = NULL;
    const kempe_run_options settings = {0};
    CHECK(kempe_simulate(l.system, &settings, &t) == KEMPE_OK);
    const double length = 1.00010005, *end = t ? kempe_trajectory_q(t, t->table.rows - 1) : NULL;
    CHECK(end && fabs(end[0] - sqrt(length * length - 1)) < 1e-9);
    kempe_trajectory_free(t);
    unload(&l);
}

/* Closed to the twelfth digit only, and held: no step is refused, and no other formulation taken. */
static void what_cannot_move_is_not_stepped(void)
{
    loaded l = draw("tests/models/rounded_and_fixed.yaml", NAN);
    kempe_run_options settings = {0};
    kempe_trajectory *t = NULL;
    settings.no_convergence_check = true;
    CHECK(kempe_simulate(l.system, &settings, &t) == KEMPE_OK);
    CHECK(t && t->status == KEMPE_OK && t->report.refused == 0 && t->report.steps < 20);
    kempe_trajectory_free(t);
    unload(&l);
}

/* -- rows that stay open ----------------------------------------------------------------------------- */

/* A drawing for which no other points and axes are looked for: rows stay open, within the tolerance, on all
 * formulations.
 */
static void dropped_rows_stay_open_within_the_tolerance(void)
{
    static const char *const paths[] = {"tests/models/rounded_lamp.yaml", "tests/models/rounded_bennett.yaml"};
    for (int k = 0; k < 2; k++) {
        loaded l = draw(paths[k], NAN);
        double q[16], first[16];
        kempe_system_free(l.system);
        CHECK(kmp_system_new_by(l.model, NULL, &l.system) == KEMPE_OK && !l.system->mended);
        for (size_t way = 0; way < sizeof formulations / sizeof *formulations; way++) {
            run(&l, formulations[way][0], formulations[way][1], way == 0 ? first : q);
            for (int i = 0; i < l.system->n && way > 0; i++)
                CHECK_NEAR(q[i], first[i], 1e-3);
        }
        CHECK(kmp_rounding_of(l.system) && freedoms(&l) == (k == 0 ? 2 : 1));
        unload(&l);
    }
}

/* A trial of a rank from the start; true if the loops close with it. */
static bool try_rank(const loaded *l, int rank, kmp_rounding_trial *t)
{
    const kempe_system *s = l->system;
    double q[128];
    for (int k = 0; k < s->n; k++)
        q[k] = kmp_model_start(s->model)->q[k].value;
    kmp_guess guess = {q, kmp_model_start(s->model)->hold, 0, false, rank};
    kempe_assembly *a = NULL;
    CHECK(kmp_assemble_from(s, &guess, &a) == KEMPE_OK);
    *t = (kmp_rounding_trial){.rank = rank, .tolerance = s->closure_tolerance / s->length};
    bool closed = a && a->closed;
    if (closed) {
        t->dropped = a->dropped;
        CHECK(kmp_rounding_try(t, s, a->inner_q ? a->inner_q : a->q, a->chart));
    }
    kempe_assembly_free(a);
    return closed;
}

/* Rows that open everywhere with a rank open with each smaller one, real pivots and rounded ones alike. */
static void a_refuted_rank_leaves_no_smaller_one(void)
{
    static const char *const paths[] = {
        "tests/models/rounded_lamp.yaml",   "tests/models/rounded_bennett.yaml", "tests/models/rounded_four_bar.yaml",
        "tests/models/rounded_sarrus.yaml", "tests/models/two_arms.yaml",        "examples/suspension/suspension.yaml",
        "examples/tram/tram.yaml"};
    int held = 0, refuted = 0;
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        loaded l = draw(paths[k], NAN);
        kempe_system_free(l.system);
        CHECK(kmp_system_new_by(l.model, NULL, &l.system) == KEMPE_OK);
        kmp_rounding_trial t;
        bool holds = false; /* a smaller rank does */
        for (int rank = 1; rank < l.system->m; rank++)
            if (try_rank(&l, rank, &t)) {
                CHECK(!(holds && t.refuted) && !(t.holds && t.refuted));
                holds = holds || t.holds;
                held += t.holds;
                refuted += t.refuted;
            }
        unload(&l);
    }
    CHECK(held > 0 && refuted > 0);
}

/* A planar loop whose points are not quite at one height. */
static void rows_that_nothing_moves_have_the_tolerance_too(void)
{
    static const char text[] =
        "kempe: 1\n%sground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\nbodies:\n"
        "  a: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [0.3, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}, points: {E: [0.9, 0, 0.000001]}}\n"
        "  c: {joint: {revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {E: [0.5, 0, 0]}}\n"
        "loops: {C: {ball: [b.E, c.E]}}\nstart: {q: {a: 1, b: -0.6, c: 1.6}}\n";
    char full[1024];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    (void)snprintf(full, sizeof full, text, "");
    loaded l = load_text(full);
    CHECK(l.system && l.system->m == 2 && l.system->misfit[0] > 0);
    unload(&l);
    (void)snprintf(full, sizeof full, text, "closure_tolerance: 0\n");
    CHECK(kempe_model_read_text(context, full, "model.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "1e-06 for all coordinates") &&
          strstr(kempe_context_message(context), "closure_tolerance of 0 m"));
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(a_drawing_runs_as_the_mechanism_that_is_meant);
    TEST(the_warning_names_closure_and_both_numbers);
    TEST(a_misfit_above_the_tolerance_is_an_error_with_both_numbers);
    TEST(a_small_pivot_that_is_real_is_no_rounding);
    TEST(a_small_loop_is_no_rounding);
    TEST(a_real_closure_of_small_effect_is_no_rounding);
    TEST(a_moving_closure_is_no_rounding);
    TEST(what_cannot_move_is_not_stepped);
    TEST(dropped_rows_stay_open_within_the_tolerance);
    TEST(a_refuted_rank_leaves_no_smaller_one);
    TEST(rows_that_nothing_moves_have_the_tolerance_too);
    return check_report();
}
