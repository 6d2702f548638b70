/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 3 */
/* Random mechanisms with loops, drives, bushings, springs and dampers near a closed state: what follows of a small
 * change of the independent coordinates and of the parameters against differences of the state found anew; the same
 * backwards; eigenvalues' derivatives against differences of eigenvalues. */
#include "analyses/modes/eigenmodes.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "model/data/force.h"
#include "model/data/variant.h"
#include "random_model.h"
#include "testing.h"
#include <complex.h>
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <stdbool.h>

enum { MOST = 64, MODELS = 1000, LEVELS = 6, PARAMETERS = 2 };

static const char *const names[PARAMETERS] = {"a", "b"};
static const double values[PARAMETERS] = {1.25, 0.875};

typedef struct rig {
    random_model m;
    kmp_variant *variant;
    kempe_system *system;
    kmp_slopes *slopes;
    kmp_linear linear;
    double t, q[MOST], ud[MOST], udd[MOST];
} rig;

static void close_rig(rig *r)
{
    if (r->linear.eval)
        kmp_linear_free(&r->linear);
    kmp_slopes_free(r->slopes);
    kempe_system_free(r->system);
    kmp_variant_free(r->variant);
    random_model_free(&r->m);
}

/* Springs whose ends a closure holds together pull nowhere. */
static bool springs_have_length(const kempe_model *model, const double *q)
{
    for (int k = 0; k < kmp_model_force_count(model); k++)
        if (kmp_model_force(model, k)->kind == KMP_FORCE_SPRING &&
            plain_distance(model, q, kmp_model_force(model, k)->point) < 1e-3)
            return false;
    return true;
}

/* false: the loops do not close, or nothing is left to move. */
static bool open_rig(rig *r, uint64_t seed, unsigned flags)
{
    kempe_assembly *a = NULL;
    *r = (rig){.m = random_model_new(seed, 5, flags)};
    CHECK(r->m.model != NULL);

    if (!r->m.model)
        return false;
    bool made = kmp_variant_new(r->m.model, PARAMETERS, names, &r->variant) == KEMPE_OK &&
                kempe_system_new(kmp_variant_model(r->variant), &r->system) == KEMPE_OK;
    if (!made) /* a closure that does not depend on coordinates */
        CHECK(strstr(kempe_context_message(r->m.context), "not on coordinates") != NULL ||
              strstr(kempe_context_message(r->m.context), "for all coordinates") != NULL);
    if (!made)
        return false;
    bool ok = kempe_assembly_new(r->system, &a) == KEMPE_OK && a->closed && springs_have_length(r->m.model, a->q);
    CHECK(kmp_linear_init(&r->linear, r->system, "tape") == KEMPE_OK);
    CHECK(kmp_slopes_new(r->system, "tape", PARAMETERS, names, false, &r->slopes) == KEMPE_OK);
    if (ok && a->chart)
        kmp_eval_set_charts(r->linear.eval, a->chart);
    ok = ok && kmp_linear_choose(&r->linear, 0, a->inner_q ? a->inner_q : a->q, NULL, 0) == KEMPE_OK && r->linear.p > 0;
    for (int k = 0; k < MOST; k++) {
        r->ud[k] = between(-1, 1);
        r->udd[k] = between(-1, 1);
    }
    ok = ok && kmp_linear_at(&r->linear, 0, a->inner_q ? a->inner_q : a->q, r->ud, r->udd) == KEMPE_OK;
    if (ok)
        memcpy(r->q, r->linear.q, (size_t)r->linear.n * sizeof(double));
    kempe_assembly_free(a);
    return ok;
}

static void set_values(rig *r, const double *x)
{
    kmp_text why = {0};
    CHECK(kmp_variant_set(r->variant, x, &why) == KEMPE_OK && kmp_system_rescale(r->system));
    kmp_text_free(&why);
    kmp_linear_renew_parameters(&r->linear);
    kmp_slopes_renew_parameters(r->slopes);
}

/* -- differences ------------------------------------------------------------------------------------- */

typedef struct state {
    double part[5][MOST];
} state;

static void part_sizes(const kmp_linear *l, int size[5])
{
    const int all[5] = {l->n, l->n, l->n, l->m, l->p};
    memcpy(size, all, sizeof all);
}

/* A step along a change of u, ud, udd (p each) and of the parameters. */
static bool look(rig *r, const double *change, const double *parameter, double step, state *x)
{
    kmp_linear *l = &r->linear;
    double q[MOST], ud[MOST], udd[MOST], moved[PARAMETERS];
    memcpy(q, r->q, sizeof q);
    for (int k = 0; k < l->p; k++) {
        q[l->part.u[k]] += step * change[k];
        ud[k] = r->ud[k] + step * change[l->p + k];
        udd[k] = r->udd[k] + step * change[2 * l->p + k];
    }
    for (int k = 0; k < PARAMETERS; k++)
        moved[k] = values[k] + step * parameter[k];
    set_values(r, moved);
    bool ok = kmp_linear_at(l, 0, q, ud, udd) == KEMPE_OK;
    const double *from[5] = {l->q, l->qd, l->qdd, l->lambda, l->residual};
    int size[5];
    part_sizes(l, size);
    for (int k = 0; k < 5; k++)
        memcpy(x->part[k], from[k], (size_t)size[k] * sizeof(double));
    return ok;
}

/* Steps halved, extrapolated once; the best of each part, beside the largest of it and of what it is the change of. */
static double against_differences(rig *r, const double *change, const double *parameter, const state *exact)
{
    static state plus, minus, now, before;
    double best[5], size[5], worst = 0, step = 4e-3;
    int count[5];
    part_sizes(&r->linear, count);
    for (int k = 0; k < 5; k++) {
        best[k] = INFINITY;
        size[k] = 1e-9;
    }
    for (int level = 0; level < LEVELS; level++, step /= 2, before = now) {
        if (!look(r, change, parameter, step, &plus) || !look(r, change, parameter, -step, &minus)) {
            step /= 4;
            level--;
            if (step < 1e-7)
                return INFINITY;
            continue;
        }
        for (int k = 0; k < 5; k++) {
            double off = 0;
            for (int i = 0; i < count[k]; i++) {
                now.part[k][i] = (plus.part[k][i] - minus.part[k][i]) / (2 * step);
                size[k] = fmax(size[k], fmax(fabs(plus.part[k][i]), fabs(exact->part[k][i])));
                double now_off = fabs((4 * now.part[k][i] - before.part[k][i]) / 3 - exact->part[k][i]);
                off = now_off <= off ? off : now_off;
            }
            best[k] = level > 0 && !(off > best[k]) ? off : best[k];
        }
    }
    set_values(r, values);
    CHECK(kmp_linear_at(&r->linear, 0, r->q, r->ud, r->udd) == KEMPE_OK);
    for (int k = 0; k < 5; k++)
        worst = best[k] / size[k] <= worst ? worst : best[k] / size[k]; /* NaN stays */
    return worst;
}

/* -- forwards and backwards -------------------------------------------------------------------------- */

static void follow(rig *r, const double *change, int parameter, state *out)
{
    kmp_linear *l = &r->linear;
    double equations[4 * MOST];
    kmp_change c = {.u = change, .ud = change + l->p, .udd = change + 2 * l->p};
    if (parameter >= 0) {
        kmp_instant at = kmp_linear_instant(l);
        kmp_slopes_at(r->slopes, &at);
        c = kmp_slopes_change(r->slopes, parameter, equations);
        c.u = change;
        c.ud = change + l->p;
        c.udd = change + 2 * l->p;
    }
    kmp_linear_follow(l, &c, &(kmp_response){out->part[0], out->part[1], out->part[2], out->part[3], out->part[4]});
}

static void check_backwards(kmp_linear *l)
{
    double x[7][MOST], w[5][MOST], back[7][MOST], left = 0, right = 0, size = 0;
    state y;
    for (int i = 0; i < 7 * MOST; i++)
        x[i / MOST][i % MOST] = between(-1, 1);
    for (int i = 0; i < 5 * MOST; i++)
        w[i / MOST][i % MOST] = between(-1, 1);
    kmp_linear_follow(l, &(kmp_change){x[0], x[1], x[2], x[3], x[4], x[5], x[6]},
                      &(kmp_response){y.part[0], y.part[1], y.part[2], y.part[3], y.part[4]});
    kmp_linear_back(l, &(kmp_weights){w[0], w[1], w[2], w[3], w[4]},
                    &(kmp_changes_weight){back[0], back[1], back[2], back[3], back[4], back[5], back[6]});
    const int rows[] = {l->n, l->n, l->n, l->m, l->p}, given[] = {l->p, l->p, l->p, l->m, l->m, l->m, l->n};
    for (int k = 0; k < 5; k++)
        for (int i = 0; i < rows[k]; i++) {
            left += w[k][i] * y.part[k][i];
            size += fabs(w[k][i] * y.part[k][i]);
        }
    for (int k = 0; k < 7; k++)
        for (int i = 0; i < given[k]; i++)
            right += back[k][i] * x[k][i];
    CHECK(fabs(left - right) <= 1e-10 * size);
}

/* The number of them that move. */
static void near_random_states(unsigned flags, uint64_t seed, int wanted)
{
    int tried = 0;
    for (int left = MODELS; left > 0 && tried < wanted; left--, seed++) {
        static rig r;
        if (open_rig(&r, seed, flags)) {
            double change[3 * MOST] = {0}, none[3 * MOST] = {0}, parameter[PARAMETERS] = {0};
            state exact;
            for (int k = 0; k < 3 * r.linear.p; k++)
                change[k] = between(-1, 1);
            follow(&r, change, -1, &exact);
            double by_state = against_differences(&r, change, parameter, &exact), by_parameter = 0;
            for (int k = 0; k < PARAMETERS; k++) {
                parameter[k] = 1;
                follow(&r, none, k, &exact);
                by_parameter = check_max(by_parameter, against_differences(&r, none, parameter, &exact));
                parameter[k] = 0;
            }
            if (!(by_state < 1e-7 && by_parameter < 1e-7))
                printf("seed %d, n %d, m %d, r %d: by the state %.1e, by parameters %.1e\n", (int)seed, r.linear.n,
                       r.linear.m, r.linear.red.r, by_state, by_parameter);
            CHECK(by_state < 1e-7 && by_parameter < 1e-7);
            check_backwards(&r.linear);
            tried++;
        }
        close_rig(&r);
    }
    CHECK(tried == wanted);
}

static void plain_mechanisms(void)
{
    near_random_states(MODEL_LOOPS | MODEL_PLAIN | MODEL_FORCES | MODEL_DAMPING | MODEL_SYMBOLS | MODEL_BUSHINGS, 100,
                       15);
}

static void driven_mechanisms(void)
{
    near_random_states(MODEL_LOOPS | MODEL_PLAIN | MODEL_FORCES | MODEL_DAMPING | MODEL_SYMBOLS | MODEL_BUSHINGS |
                           MODEL_DRIVES,
                       200, 15);
}

static void any_joints_and_closures(void)
{
    near_random_states(MODEL_LOOPS | MODEL_FORCES | MODEL_DAMPING | MODEL_SYMBOLS | MODEL_BUSHINGS, 300, 10);
}

static void open_trees(void)
{
    near_random_states(MODEL_FORCES | MODEL_DAMPING | MODEL_SYMBOLS | MODEL_BUSHINGS, 400, 10);
}

/* -- eigenvalues ------------------------------------------------------------------------------------- */

static bool solve(rig *r, kmp_spectrum *s)
{
    kmp_linear *l = &r->linear;
    if (kmp_linear_at_motion(l, 0, r->q, r->ud) != KEMPE_OK)
        return false;
    kmp_linear_matrices(l);
    return kmp_spectrum_init(s, l->p, l->mass, NULL, l->damping, l->stiffness, false) == 0;
}

/* The eigenvalue nearest to one. */
static double complex nearest(const kmp_spectrum *s, double complex to)
{
    double complex best = INFINITY;
    for (int i = 0; i < s->count; i++) {
        double complex x = s->re[i] + s->im[i] * I;
        best = cabs(x - to) < cabs(best - to) ? x : best;
    }
    return best;
}

static int compared, met; /* eigenvalues */

static double complex slope_of(const kmp_mode_slopes *slopes, int i, int k)
{
    return slopes->re[i * PARAMETERS + k] + slopes->im[i * PARAMETERS + k] * I;
}

/* True if differences by `step` can judge eigenvalue i: it meets no other one within a hundred steps. */
static bool stands_apart(const kmp_spectrum *at, const kmp_mode_slopes *slopes, int i, int k, double step)
{
    bool apart = slopes->kind[i] == KMP_MODE_SIMPLE;
    for (int j = 0; j < at->count; j++) {
        double gap = hypot(at->re[j] - at->re[i], at->im[j] - at->im[i]);
        apart = apart && (j == i || gap > 100 * step * cabs(slope_of(slopes, j, k) - slope_of(slopes, i, k)));
    }
    return apart;
}

/* Differences of separate eigenvalues, beside the largest derivative. */
static double eigenvalues_off(rig *r, const kmp_spectrum *at, const kmp_mode_slopes *slopes, int k)
{
    double best[2 * MOST], size = 1e-9, worst = 0, step = 1e-3;
    double complex before[2 * MOST];
    for (int level = 0; level < LEVELS; level++, step /= 2) {
        kmp_spectrum side[2] = {{0}};
        for (int i = 0; i < 2; i++) {
            double moved[PARAMETERS];
            memcpy(moved, values, sizeof moved);
            moved[k] += i ? -step : step;
            set_values(r, moved);
            CHECK(solve(r, &side[i]));
        }
        for (int i = 0; i < at->count; i++) {
            double complex s = at->re[i] + at->im[i] * I;
            double complex ds = slope_of(slopes, i, k);
            double complex now = (nearest(&side[0], s + step * ds) - nearest(&side[1], s - step * ds)) / (2 * step);
            double off = cabs((4 * now - before[i]) / 3 - ds);
            best[i] = level == 0 ? INFINITY : !(off > best[i]) ? off : best[i];
            before[i] = now;
            size = slopes->kind[i] == KMP_MODE_SIMPLE ? fmax(size, cabs(ds)) : size;
        }
        kmp_spectrum_free(&side[0]);
        kmp_spectrum_free(&side[1]);
    }
    set_values(r, values);
    for (int i = 0; i < at->count; i++, met++)
        if (stands_apart(at, slopes, i, k, step) && ++compared)
            worst = best[i] / size <= worst ? worst : best[i] / size;
    return worst;
}

static double check_eigenvalues(rig *r)
{
    kmp_spectrum spectrum;
    kmp_second_derivatives bend;
    kmp_state_sensitivity shift;
    kmp_mode_slopes slopes;
    double worst = 0;
    if (!solve(r, &spectrum))
        return -1;
    CHECK(kmp_second_derivatives_init(&bend, r->system, kmp_backend_find("tape"), PARAMETERS, names) == KEMPE_OK);
    CHECK(kmp_state_sensitivity_init(&shift, r->system, PARAMETERS, names) == KEMPE_OK);
    CHECK(kmp_state_sensitivity_at(&shift, &r->linear, r->slopes, KMP_KEEP_RATES, NULL, NULL) == KEMPE_OK);
    CHECK(kmp_mode_slopes_init(&slopes, &r->linear, &bend, &shift, &spectrum) == KEMPE_OK);
    for (int k = 0; k < PARAMETERS; k++) {
        double off = eigenvalues_off(r, &spectrum, &slopes, k);
        worst = off <= worst ? worst : off;
    }
    kmp_mode_slopes_free(&slopes);
    kmp_state_sensitivity_free(&shift);
    kmp_second_derivatives_free(&bend);
    kmp_spectrum_free(&spectrum);
    return worst;
}

static void eigenvalues_move_with_parameters(void)
{
    unsigned flags = MODEL_LOOPS | MODEL_PLAIN | MODEL_FORCES | MODEL_DAMPING | MODEL_SYMBOLS;
    int tried = 0, left = MODELS;
    for (uint64_t seed = 500; left > 0 && tried < 8; left--, seed++) {
        static rig r;
        if (open_rig(&r, seed, flags | (seed % 2 ? MODEL_DRIVES : 0) | (seed % 3 ? MODEL_BUSHINGS : 0))) {
            double worst = check_eigenvalues(&r);
            if (!(worst < 1e-6))
                printf("seed %d: %.1e\n", (int)seed, worst);
            CHECK(worst < 1e-6);
            tried += worst >= 0;
        }
        close_rig(&r);
    }
    CHECK(tried == 8);
    CHECK(3 * compared > 2 * met);
}

int main(void)
{
    TEST(plain_mechanisms);
    TEST(driven_mechanisms);
    TEST(any_joints_and_closures);
    TEST(open_trees);
    TEST(eigenvalues_move_with_parameters);
    return check_report();
}
