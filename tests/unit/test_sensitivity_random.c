/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: not_sanitized */
/* Motions of random mechanisms by parameters that stand in masses, lengths, springs, bushings and drives alike: forward
 * against adjoint, and against runs with moved parameters. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "model/data/body.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <stdbool.h>

enum { MOST = 64, MODELS = 1000, LEVELS = 4, PARAMETERS = 2 };

static const char *const names[PARAMETERS] = {"a", "b"};
static const double values[PARAMETERS] = {1.25, 0.875};

#define T_END 0.05

/* The start values are given by name, so that the assembled state has derivatives. false: it does not close. */
static bool hold_all(kempe_context *context, const char *text, kmp_text *out)
{
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_assembly *a = NULL;
    kmp_partition part = {0};
    bool ok = kempe_model_read_text(context, text, "random", &model) == KEMPE_OK &&
              kempe_system_new(model, &system) == KEMPE_OK && kempe_assembly_new(system, &a) == KEMPE_OK && a->closed;
    kmp_evaluator *eval = ok ? kmp_eval_new(system, "tape") : NULL;
    if (eval) {
        kmp_eval_closure(eval, 0, a->q);
        ok = kmp_partition_init(&part, system, eval->jacobian, NULL, 0) == KEMPE_OK && part.p > 0;
        kmp_text_printf(out, "%sstart: {hold: [", text);
        for (int k = 0; k < part.p; k++)
            kmp_text_printf(out, "%s%s", k ? ", " : "", kmp_model_motion(model, part.u[k])->name);
        kmp_text_put(out, "], q: {");
        for (int k = 0; k < system->n; k++)
            kmp_text_printf(out, "%s%s: %.17g", k ? ", " : "", kmp_model_motion(model, k)->name, a->q[k]);
        kmp_text_put(out, "}}\n");
    }
    kmp_partition_free(&part);
    kmp_eval_free(eval);
    kempe_assembly_free(a);
    kempe_system_free(system);
    kempe_model_free(model);
    return ok;
}

static bool make_text(kempe_context *context, uint64_t seed, unsigned flags, kmp_text *out)
{
    kmp_text text = {0};
    random_model bare = {.context = context};
    enum { BODIES = 4 };
    put_frame(&text, seed, BODIES, flags);
    bool ok = kempe_model_read_text(context, text.s, "random", &bare.model) == KEMPE_OK;
    if (ok) {
        if (flags & MODEL_LOOPS)
            put_loops(&text, bare.model, seed, BODIES, flags);
        kmp_text_put(&text, "forces:\n");
        put_springs(&text, BODIES, flags);
        put_efforts(&text, &bare, flags);
        put_bushings(&text, BODIES, flags);
        if (flags & MODEL_DRIVES)
            put_drive(&text, bare.model, flags);
    }
    kempe_model_free(bare.model);
    ok = ok && hold_all(context, text.s, out);
    kmp_text_free(&text);
    return ok;
}

static kempe_sensitivity *find(const kempe_model *model, const char *method)
{
    kempe_sensitivity *s = NULL;
    kempe_run_options run = {0};
    kempe_sensitivity_options options = {
        .parameters = "a,b", .outputs = method ? "q" : "q,qd", .method = method, .run = &run};
    run.rtol = 1e-11;
    run.t_end = T_END;
    run.output_step = T_END;
    if (kempe_sensitivity_new(model, &options, &s) == KEMPE_OK)
        return s;
    kempe_sensitivity_free(s);
    return NULL;
}

/* q and qd at the end. */
static bool ends_at(kempe_context *context, const char *text, int k, double step, double *end)
{
    char number[40];
    (void)snprintf(number, sizeof number, "%.17g", values[k] + step);
    const kempe_setting set = {names[k], number};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    run.rtol = run.atol = 1e-12;
    run.t_end = run.output_step = T_END;
    run.no_convergence_check = 1;
    bool ok = kempe_model_read_text_set(context, text, "random", &set, 1, &model) == KEMPE_OK &&
              kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK;
    for (int i = 0; ok && i < system->n; i++) {
        end[i] = kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1)[i];
        end[system->n + i] = kempe_trajectory_qd(t, kempe_trajectory_row_count(t) - 1)[i];
    }
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    return ok;
}

/* The best of differences extrapolated once, beside the largest of q or of qd. */
static double against_runs(kempe_context *context, const char *text, const kempe_sensitivity *s, int k)
{
    int count = s->columns, last = s->rows - 1;
    double plus[2 * MOST], minus[2 * MOST], before[2 * MOST] = {0}, size[2] = {1e-3, 1e-3}, best = INFINITY,
                                                       step = 4e-3;
    for (int c = 0; c < count; c++)
        size[2 * c / count] = fmax(size[2 * c / count], fabs(kmp_sensitivity_slope(s, last, c, k)));
    for (int level = 0; level < LEVELS; level++, step /= 2) {
        double worst = 0;
        if (!ends_at(context, text, k, step, plus) || !ends_at(context, text, k, -step, minus))
            return INFINITY;
        for (int c = 0; c < count; c++) {
            double now = (plus[c] - minus[c]) / (2 * step);
            double off = fabs((4 * now - before[c]) / 3 - kmp_sensitivity_slope(s, last, c, k)) / size[2 * c / count];
            worst = off <= worst ? worst : off;
            before[c] = now;
        }
        best = level > 0 && !(worst > best) ? worst : best;
    }
    return best;
}

static bool check_model(uint64_t seed, unsigned flags)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kmp_text text = {0};
    kempe_sensitivity *all = NULL;
    if (make_text(context, seed, flags, &text) && kempe_model_read_text(context, text.s, "random", &model) == KEMPE_OK)
        all = find(model, NULL);
    if (all) {
        kempe_sensitivity *one = find(model, "forward"), *other = find(model, "adjoint");
        int last = all->rows - 1;
        CHECK(one && other);
        for (int c = 0; one && other && c < one->columns; c++)
            for (int k = 0; k < PARAMETERS; k++) {
                double x = kmp_sensitivity_slope(one, one->rows - 1, c, k);
                double y = kmp_sensitivity_slope(other, other->rows - 1, c, k);
                CHECK(fabs(x - y) <= 1e-7 * (1e-3 + fabs(x)));
                CHECK(fabs(x - kmp_sensitivity_slope(all, last, c, k)) <= 1e-9 * (1e-3 + fabs(x)));
            }
        for (int k = 0; k < PARAMETERS; k++) {
            double off = against_runs(context, text.s, all, k);
            if (!(off < 1e-6))
                printf("seed %d by %s: off by %.1e\n", (int)seed, names[k], off);
            CHECK(off < 1e-6);
        }
        kempe_sensitivity_free(one);
        kempe_sensitivity_free(other);
    }
    bool done = all;
    kempe_sensitivity_free(all);
    kmp_text_free(&text);
    kempe_model_free(model);
    kempe_context_free(context);
    return done;
}

static void check_models(uint64_t seed, unsigned flags, int wanted)
{
    int tried = 0;
    for (int left = MODELS; left > 0 && tried < wanted; left--, seed++)
        tried += check_model(seed, flags | MODEL_PLAIN | MODEL_SYMBOLS | MODEL_DAMPING | MODEL_FORCES);
    CHECK(tried == wanted);
}

static void closed_mechanisms(void)
{
    check_models(40, MODEL_LOOPS, 3);
}

static void driven_mechanisms(void)
{
    check_models(80, MODEL_LOOPS | MODEL_DRIVES, 2);
}

static void open_trees(void)
{
    check_models(120, 0, 2);
}

/* Rates that nothing gives are the least that fit, translations over the characteristic length L, which a parameter may
 * be: of da + 2 ds = 1 they are da = 1/(1 + 4 L^2), ds = 2 L^2/(1 + 4 L^2). */
static void least_rates_move_with_the_characteristic_length(void)
{
    const double l = 0.6, sum = 1 + 4 * l * l;
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(
              context,
              "kempe: 1\nparameters: {a: 0.6, b: 1}\nbodies:\n"
              "  a: {joint: {revolute: z, at: ground}, mass: b, com: [0.15, 0, 0], inertia: {zz: 0.01}, "
              "points: {B: [a, 0, 0]}}\n"
              "  s: {joint: {prismatic: x, at: a.B}, mass: 1}\n"
              "loops: {T: {constraint: \"q(a) + 2*q(s) - t\"}}\nstart: {q: {a: 0.5, s: -0.25}, hold: [a]}\n",
              "random", &model) == KEMPE_OK);
    kempe_sensitivity *s = model ? find(model, NULL) : NULL;
    CHECK(s != NULL);
    if (s) {
        CHECK_NEAR(kmp_sensitivity_value(s, 0, 2), 1 / sum, 1e-12);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 2, 0), -8 * l / (sum * sum), 1e-12);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 3, 0), 4 * l / (sum * sum), 1e-12);
        CHECK(kmp_sensitivity_slope(s, 0, 2, 1) == 0);
    }
    kempe_sensitivity_free(s);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(closed_mechanisms);
    TEST(driven_mechanisms);
    TEST(open_trees);
    TEST(least_rates_move_with_the_characteristic_length);
    return check_report();
}
