/* SPDX-License-Identifier: BSD-3-Clause */
/* Bushings between points of random mechanisms: what they add to the equations against their potential and their rates,
 * written down once more with rotation matrices and the angle of a rotation; a mass that hangs on one; three springs;
 * both bodies changed for each other; energy. */
#include "analyses/equilibrium/equilibrium_study.h"
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/evaluator.h"
#include "derived.h"
#include "distance.h"
#include "dynamics/equations.h"
#include "loaded.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "random_model.h"
#include "studies/simulate/trajectory.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>

enum { MODELS = 48, ROWS = 6 };

/* -- plain mechanics --------------------------------------------------------------------------------- */

/* Axes of both points in ground axes as columns, and d in those of the first. */
typedef struct seen {
    double axes[2][3][3], d[3];
} seen;

static seen look(const kempe_model *model, const kmp_force *f, const double *q)
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    pose p[MODEL_MAX_BODIES];
    double at[2][3];
    seen s = {0};
    plain_poses(model, q, p);
    for (int side = 0; side < 2; side++) {
        plain_point(model, p, f->point[side], at[side]);
        for (int k = 0; k < 3; k++)
            plain_direction(model, p, f->point[side], unit[k], s.axes[side][k]);
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            s.d[k] += s.axes[0][k][i] * (at[1][i] - at[0][i]);
    return s;
}

/* r = axes of the second in those of the first. */
static void turned(const seen *s, double r[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            r[i][j] = 0;
            for (int k = 0; k < 3; k++)
                r[i][j] += s->axes[0][i][k] * s->axes[1][j][k];
        }
}

static double angle_of(double r[3][3])
{
    return acos(fmax(-1, fmin(1, (r[0][0] + r[1][1] + r[2][2] - 1) / 2)));
}

/* The axial vector of r - r', halved. */
static void axial(double r[3][3], double s[3])
{
    for (int i = 0; i < 3; i++)
        s[i] = (r[(i + 2) % 3][(i + 1) % 3] - r[(i + 1) % 3][(i + 2) % 3]) / 2;
}

/* preload d + k d^2 / 2 and kr psi^2 / 2, psi = 2 sin(a/2) n. */
static double potential_of(const kmp_force *f, const seen *s)
{
    double r[3][3], n[3], v = 0;
    turned(s, r);
    axial(r, n);
    double angle = angle_of(r), factor = angle > 1e-8 ? 2 * sin(angle / 2) / sin(angle) : 1;
    for (int i = 0; i < 3; i++) {
        double psi = factor * n[i];
        v += f->preload[i].value * s->d[i] + f->along[i].value * s->d[i] * s->d[i] / 2 +
             f->about[i].value * psi * psi / 2;
    }
    return v;
}

typedef struct at_state {
    const kempe_model *model;
    int first; /* the bushings are the last forces */
    double rest[2][3][3];
} at_state;

/* The potential of all; then of each d, and the turn since `rest`, all in the axes of the first point. */
static void shape(void *user, const double *q, double *out)
{
    const at_state *a = user;
    out[0] = 0;
    for (int k = a->first; k < a->model->force_count; k++) {
        const kmp_force *f = &a->model->forces[k];
        double r[3][3], since[3][3] = {{0}}, *x = out + 1 + ROWS * (k - a->first);
        seen s = look(a->model, f, q);
        turned(&s, r);
        out[0] += potential_of(f, &s);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                for (int l = 0; l < 3; l++)
                    since[i][j] += r[i][l] * a->rest[k - a->first][j][l];
        memcpy(x, s.d, sizeof s.d);
        axial(since, x + 3);
    }
}

static double damping_of(const kmp_force *f, int row)
{
    return row < 3 ? f->along_damping[row].value : f->about_damping[row - 3].value;
}

/* A state where no bushing is near half a turn; false: not found. */
static bool find_state(at_state *a, state *s)
{
    for (int trial = 0; trial < 50; trial++) {
        bool good = true;
        *s = random_state_vectors();
        for (int k = a->first; k < a->model->force_count; k++) {
            seen x = look(a->model, &a->model->forces[k], s->q);
            turned(&x, a->rest[k - a->first]);
            good = good && angle_of(a->rest[k - a->first]) < 2;
        }
        if (good)
            return true;
    }
    return false;
}

/* Contributions of the bushings to C, to the potential and to the power. */
static void added_is(int number, at_state *a, const derived *with, const derived *without, const state *s)
{
    enum { MOST = 1 + 2 * ROWS };
    double rate[MOST], slope[MOST], bias[MODEL_MAX_N], added[MODEL_MAX_N], power = 0, values[MOST];
    int n = with->n;
    difference(shape, a, n, s->q, s->qd, MOST, rate);
    for (int i = 0; i < n; i++) {
        double e[MODEL_MAX_N] = {0};
        e[i] = 1;
        difference(shape, a, n, s->q, e, MOST, slope);
        bias[i] = slope[0];
        added[i] = with->bias[i] - without->bias[i];
        for (int k = 1; k < MOST; k++)
            bias[i] += damping_of(&a->model->forces[a->first + (k - 1) / ROWS], (k - 1) % ROWS) * rate[k] * slope[k];
    }
    for (int k = 1; k < MOST; k++)
        power -= damping_of(&a->model->forces[a->first + (k - 1) / ROWS], (k - 1) % ROWS) * rate[k] * rate[k];
    shape(a, s->q, values);
    double size = 1, worst = 0;
    for (int i = 0; i < n; i++) {
        size = check_max(size, fabs(bias[i]));
        worst = check_max(worst, fabs(added[i] - bias[i]));
    }
    if (!(worst <= 1e-8 * size))
        printf("model %d: generalised forces differ by %.3g of %.3g\n", number, worst, size);
    CHECK(worst <= 1e-8 * size);
    CHECK_NEAR(*with->potential - *without->potential, values[0], 1e-11);
    CHECK_NEAR(*with->power - *without->power, power, 1e-8);
}

static bool as_potential_and_rates(int number)
{
    unsigned flags = MODEL_FORCES | (number % 2 ? MODEL_DAMPING : 0) | (number % 3 ? 0 : MODEL_SYMBOLS) |
                     (number % 5 ? 0 : MODEL_LOOPS);
    random_model r[2] = {random_model_new((uint64_t)number + 1, 1 + number % 4, flags),
                         random_model_new((uint64_t)number + 1, 1 + number % 4, flags | MODEL_BUSHINGS)};
    derived d[2];
    bool ok = r[0].model && r[1].model;
    CHECK(ok);
    ok = ok && derived_init(&d[0], r[0].model, KMP_SET_BIAS | KMP_SET_ENERGY, KMP_SCHEME_COMPOSITE, false);
    if (ok && derived_init(&d[1], r[1].model, KMP_SET_BIAS | KMP_SET_ENERGY, KMP_SCHEME_COMPOSITE, number % 3 == 0)) {
        at_state a = {.model = r[1].model, .first = r[1].model->force_count - 2};
        state s;
        ok = find_state(&a, &s);
        if (ok) {
            derived_eval(&d[0], &s);
            derived_eval(&d[1], &s);
            added_is(number, &a, &d[1], &d[0], &s);
        }
        derived_free(&d[1]);
    }
    if (r[0].model && d[0].machine)
        derived_free(&d[0]);
    random_model_free(&r[0]);
    random_model_free(&r[1]);
    return ok;
}

static void forces_are_those_of_the_potential(void)
{
    int used = 0;
    for (int number = 0; number < MODELS; number++)
        used += as_potential_and_rates(number);
    CHECK(4 * used >= 3 * MODELS);
}

/* -- single ones -------------------------------------------------------------------------------------- */

#define FREE_BODY                                                                                                      \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "parameters: {k: 4000, m: 3}\n"                                                                                    \
    "ground: {points: {P: {at: [0.1, 0.2, 0.3], axes: {z: [0, 1, 1], x: [1, 0, 0]}}, R: [0.1, 0.2, 0.3], "             \
    "X: [50.1, 0.2, 0.3], Y: [0.1, 50.2, 0.3], Z: [0.1, 0.2, 50.3]}}\n"                                                \
    "bodies: {b: {joint: {free: x, at: ground}, mass: m, inertia: {xx: 0.1, yy: 0.2, zz: 0.25}, points: {Q: [0, 0, "   \
    "0.2], C: [0, 0, 0]}}}\n"

static bool bias_at(const char *forces, const double *q, double *bias)
{
    char text[2048];
    kmp_linear l;
    (void)snprintf(text, sizeof text, FREE_BODY "forces: {%s}\n", forces);
    loaded m = load_text(text);
    bool ok = m.system && kmp_linear_init(&l, m.system, "tape") == KEMPE_OK;
    CHECK(ok);
    ok = ok && kmp_linear_choose(&l, 0, q, NULL, 0) == KEMPE_OK && kmp_linear_at(&l, 0, q, NULL, NULL) == KEMPE_OK;
    for (int k = 0; ok && k < 6; k++)
        bias[l.part.u[k]] = l.residual[k];
    if (m.system)
        kmp_linear_free(&l);
    unload(&m);
    return ok;
}

/* Its point Q, 0.2 above its origin, is m g / k under R, whatever turns it back. */
static void a_mass_hangs_at_its_weight_over_the_stiffness(void)
{
    double q[6] = {0.1, 0.2, 0.1 - 3 * 9.81 / 4000, 0, 0, 0}, bias[6];
    CHECK(bias_at("s: {bushing: [ground.R, b.Q], stiffness: k, rotational_stiffness: [3, 4, 5]}", q, bias));
    for (int k = 0; k < 6; k++)
        CHECK(fabs(bias[k]) < 1e-12);
    CHECK(bias_at("s: {bushing: [b.Q, ground.R], stiffness: [1, 2, k], rotational_stiffness: 7}", q, bias));
    for (int k = 0; k < 6; k++)
        CHECK(fabs(bias[k]) < 1e-12);
    q[2] = 0.1; /* its weight as preload: the second point is pulled back with it */
    CHECK(bias_at("s: {bushing: [ground.R, b.Q], stiffness: k, preload: [0, 0, -9.81*m]}", q, bias));
    for (int k = 0; k < 6; k++)
        CHECK(fabs(bias[k]) < 1e-12);
}

/* Springs of length L along the axes: the same to d/L. */
static void it_is_three_springs_where_they_are_long(void)
{
    double q[6] = {0.103, 0.198, 0.101, 0.02, -0.01, 0.03}, one[6], three[6];
    CHECK(bias_at("s: {bushing: [ground.R, b.Q], stiffness: [k, 2*k, 3*k]}, g: {at: b.C, force: [0, 0, 9.81*m]}", q,
                  one));
    CHECK(
        bias_at("x: {spring: [ground.X, b.Q], stiffness: k, free_length: 50}, y: {spring: [ground.Y, b.Q], stiffness: "
                "2*k, free_length: 50}, z: {spring: [ground.Z, b.Q], stiffness: 3*k, free_length: 50}, g: {at: b.C, "
                "force: [0, 0, 9.81*m]}",
                q, three));
    CHECK(fabs(one[0]) > 1);
    CHECK(distance(6, one, three) < 5e-4);
}

/* Rotations are the same seen from either body: from P, whose axes are turned, to Q, and from Q to P. */
static void turning_back_is_mutual(void)
{
    double q[6] = {0, 0, 0, 0.4, -0.9, 0.7}, one[6], other[6];
    CHECK(bias_at("s: {bushing: [ground.P, b.Q], rotational_stiffness: [30, 10, 2]}", q, one));
    CHECK(bias_at("s: {bushing: [b.Q, ground.P], rotational_stiffness: [30, 10, 2]}", q, other));
    CHECK(fabs(one[3]) > 0.1 && distance(6, one, other) < 1e-14);
}

/* k sin(angle) about one axis, of one number and of three, up to far beyond a right angle. */
static void about_one_axis_it_is_the_sine(void)
{
    for (double angle = -3; angle < 3.1; angle += 0.75) {
        double q[6] = {0, 0, 0, angle, 0, 0}, bias[6];
        CHECK(bias_at("s: {bushing: [ground.R, b.Q], rotational_stiffness: 5}", q, bias));
        CHECK_NEAR(bias[3], 5 * sin(angle), 1e-14);
        CHECK(bias_at("s: {bushing: [ground.R, b.Q], rotational_stiffness: [5, 1, 1]}", q, bias));
        CHECK_NEAR(bias[3], 5 * sin(angle), 1e-13);
    }
}

/* -- a car ------------------------------------------------------------------------------------------- */

/* Upwards; the bushings between posts and wheels are the model's outputs. */
static double tyres(const kempe_model *model, const kmp_linear *l)
{
    double sum = 0;
    const double *shown = kmp_eval_shown(l->eval, 0, l->q, l->qd, l->qdd, l->lambda);
    for (int o = 0; o < model->output_count; shown += kmp_output_width(model, &model->outputs[o]), o++)
        sum += model->outputs[o].kind == KMP_OUTPUT_FORCE ? shown[2] : 0;
    return sum;
}

static void a_car_stands_on_its_tyres(void)
{
    loaded m = load("examples/limousine/limousine.yaml");
    kempe_assembly *a = NULL;
    kmp_linear l;
    static kmp_search search = {.newton = true};
    double q[MODEL_MAX_N], weight = 0;
    CHECK(kempe_assembly_new(m.system, &a) == KEMPE_OK && kmp_linear_init(&l, m.system, "tape") == KEMPE_OK);
    memcpy(q, a->q, (size_t)l.n * sizeof *q);
    CHECK(kmp_linear_choose(&l, 0, q, NULL, 0) == KEMPE_OK && l.n == 63);
    CHECK(kmp_equilibrium_find(&l, 0, q, &search) == KEMPE_OK);
    for (int k = 1; k < m.model->body_count; k++)
        weight += 9.81 * m.model->bodies[k].mass.value;
    CHECK(weight > 18000);
    CHECK_NEAR(tyres(m.model, &l) / weight, 1, 1e-10);
    kmp_linear_free(&l);
    kempe_assembly_free(a);
    unload(&m);
}

/* -- a run ----------------------------------------------------------------------------------------------- */

static double drift(const char *damping)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_setting settings[] = {{"c", damping}, {"rc", damping}};
    double worst = INFINITY;
    kempe_run_options run = {.rtol = 1e-12, .t_end = 0.03};
    if (kempe_model_read_set(context, KEMPE_ROOT "/tests/models/bushings.yaml", settings, 2, &model) == KEMPE_OK &&
        kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK)
        worst = t->verdict.drift_rel;
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return worst;
}

static void energy_is_balanced(void)
{
    CHECK(drift("0") < 1e-9);
    CHECK(drift("0.5") < 1e-9);
}

int main(void)
{
    TEST(forces_are_those_of_the_potential);
    TEST(a_mass_hangs_at_its_weight_over_the_stiffness);
    TEST(it_is_three_springs_where_they_are_long);
    TEST(turning_back_is_mutual);
    TEST(about_one_axis_it_is_the_sine);
    TEST(a_car_stands_on_its_tyres);
    TEST(energy_is_balanced);
    return check_report();
}
