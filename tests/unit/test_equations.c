/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations of random spatial mechanisms against each other and against plain mechanics: Lagrange's equations by
 * differences, kinematics by rotation matrices. */
#include "check.h"
#include "constraints/plant.h"
#include "derived.h"
#include "random_model.h"

enum { MODELS = 64, ALL_SETS = 255 };

/* Chains, trees, loops, symbols, friction: by the number. */
static random_model model_number(int k)
{
    return random_model_new((uint64_t)(k + 1), 1 + k % 5, (unsigned)k * 7 % 16);
}

/* |a - b| in units of the largest of b, at least 1. */
static double distance(int n, const double *a, const double *b)
{
    double off = 0, size = 1;
    for (int k = 0; k < n; k++) {
        off = fmax(off, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
        size = fmax(size, fabs(b[k]));
    }
    return off / size;
}

#define CHECK_CLOSE(n, a, b, tolerance)                                                                                \
    do {                                                                                                               \
        double check_d = distance(n, a, b);                                                                            \
        if (!(check_d <= (tolerance))) {                                                                               \
            check_failures++;                                                                                          \
            printf("%s:%d: model %d: %s and %s differ by %.3g relative\n", __FILE__, __LINE__, number, #a, #b,         \
                   check_d);                                                                                           \
        }                                                                                                              \
    } while (0)

/* Runs a check on every model that has equations. */
typedef void model_check(int number, const random_model *r, derived *d);

static void for_all_models(model_check *check)
{
    int used = 0;
    for (int number = 0; number < MODELS; number++) {
        derived d;
        random_model r = model_number(number);
        CHECK(r.model != NULL);
        if (r.model && derived_init(&d, r.model, ALL_SETS, KMP_SCHEME_COMPOSITE, false)) {
            check(number, &r, &d);
            derived_free(&d);
            used++;
        }
        random_model_free(&r);
    }
    CHECK(4 * used >= 3 * MODELS);
}

/* -- formalisms against each other --------------------------------------------------------------------- */

/* Cholesky's pivots are positive. */
static bool is_positive(const derived *d)
{
    double l[MODEL_MAX_N][MODEL_MAX_N] = {{0}};
    for (int i = 0; i < d->n; i++)
        for (int k = 0; k <= i; k++) {
            double sum = d->mass[i * d->n + k];
            for (int j = 0; j < k; j++)
                sum -= l[i][j] * l[k][j];
            if (k == i && !(sum > 0))
                return false;
            l[i][k] = k == i ? sqrt(sum) : sum / l[k][k];
        }
    return true;
}

static void mass_both_ways(int number, const random_model *r, derived *d)
{
    derived ner;
    bool ok = derived_init(&ner, r->model, KMP_SET_MASS, KMP_SCHEME_NER, false);
    CHECK(ok);
    for (int k = 0; ok && k < 5; k++) {
        state s = random_state_vectors();
        derived_eval(d, &s);
        derived_eval(&ner, &s);
        CHECK_CLOSE(d->n * d->n, ner.mass, d->mass, 1e-12);
        CHECK(is_positive(d));
    }
    derived_free(&ner);
}

static void test_mass_schemes(void)
{
    for_all_models(mass_both_ways);
}

/* R = M qdd + C - J' lambda */
static void residual_is_the_law(int number, const random_model *r, derived *d)
{
    double law[MODEL_MAX_N], force[MODEL_MAX_N];
    (void)r;
    for (int k = 0; k < 5; k++) {
        state s = random_state_vectors();
        if (k == 0)
            memset(s.lambda, 0, sizeof s.lambda);
        derived_eval(d, &s);
        derived_mass_times(d, s.qdd, law);
        derived_transposed(d, s.lambda, force);
        for (int i = 0; i < d->n; i++)
            law[i] += d->bias[i] - force[i];
        CHECK_CLOSE(d->n, d->residual, law, 1e-12);
        derived_transposed(d, s.mu, force);
        CHECK_CLOSE(d->n, d->jt_mu, force, 1e-13);
    }
}

static void test_inverse_dynamics(void)
{
    for_all_models(residual_is_the_law);
}

static void symbols_are_numbers(int number, const random_model *r, derived *d)
{
    derived symbolic;
    bool ok = derived_init(&symbolic, r->model, ALL_SETS, KMP_SCHEME_COMPOSITE, true);
    CHECK(ok && symbolic.m == d->m);
    for (int k = 0; ok && k < 3; k++) {
        state s = random_state_vectors();
        derived_eval(d, &s);
        derived_eval(&symbolic, &s);
        CHECK_CLOSE(d->n * d->n, symbolic.mass, d->mass, 1e-13);
        CHECK_CLOSE(d->n, symbolic.bias, d->bias, 1e-13);
        CHECK_CLOSE(d->m, symbolic.h, d->h, 1e-13);
        CHECK_CLOSE(d->m * d->n, symbolic.jacobian, d->jacobian, 1e-13);
        CHECK_CLOSE(d->m, symbolic.jdqd, d->jdqd, 1e-13);
        CHECK_CLOSE(d->n, symbolic.residual, d->residual, 1e-13);
        CHECK_CLOSE(1, symbolic.potential, d->potential, 1e-13);
        CHECK_CLOSE(1, symbolic.power, d->power, 1e-13);
        CHECK_CLOSE(3 * d->eq.position_count, symbolic.position, d->position, 1e-13);
    }
    derived_free(&symbolic);
}

static void test_kept_parameters(void)
{
    for_all_models(symbols_are_numbers);
}

/* -- against plain mechanics ---------------------------------------------------------------------------- */

static void energies(int number, const random_model *r, derived *d)
{
    double product[MODEL_MAX_N], kinetic = 0;
    state s = random_state_vectors();
    derived_eval(d, &s);
    derived_mass_times(d, s.qd, product);
    for (int i = 0; i < d->n; i++)
        kinetic += s.qd[i] * product[i] / 2;
    double plain = plain_kinetic(r->model, s.q, s.qd), potential = plain_potential(r->model, s.q);
    CHECK_CLOSE(1, &kinetic, &plain, 1e-9);
    for (int k = 0; k < r->effort_count; k++)
        if (r->efforts[k].conservative)
            potential -= r->efforts[k].a * s.q[r->efforts[k].motion];
    CHECK_CLOSE(1, d->potential, &potential, 1e-12);
}

static void test_energies(void)
{
    for_all_models(energies);
}

static void places(int number, const random_model *r, derived *d)
{
    state s = random_state_vectors();
    pose p[MODEL_MAX_BODIES];
    derived_eval(d, &s);
    plain_poses(r->model, s.q, p);
    CHECK(d->eq.position_count == 2 * (r->model->body_count - 1));
    for (int k = 0, o = 0; k < r->model->output_count; k++) {
        double x[3];
        if (r->model->outputs[k].kind != KMP_OUTPUT_POSITION)
            continue;
        plain_point(r->model, p, r->model->outputs[k].index, x);
        CHECK_CLOSE(3, d->position + 3 * o, x, 1e-13);
        o++;
    }
}

static void test_positions(void)
{
    for_all_models(places);
}

typedef struct at_rate {
    const random_model *r;
    derived *d;
    state s;
} at_rate;

/* M qd, at the rates of the state. */
static void momentum(void *user, const double *q, double *out)
{
    at_rate *a = user;
    memcpy(a->s.q, q, (size_t)a->d->n * sizeof *q);
    derived_eval(a->d, &a->s);
    derived_mass_times(a->d, a->s.qd, out);
}

/* Kinetic energy at the same rates, less the plain potential; then the lengths of springs. */
static void lagrangian(void *user, const double *q, double *out)
{
    at_rate *a = user;
    const kempe_model *model = a->r->model;
    double p[MODEL_MAX_N];
    momentum(user, q, p);
    out[0] = -plain_potential(model, q);
    for (int i = 0; i < a->d->n; i++)
        out[0] += a->s.qd[i] * p[i] / 2;
    for (int k = 0; k < model->force_count; k++)
        out[1 + k] = model->forces[k].kind == KMP_FORCE_SPRING ? plain_distance(model, q, model->forces[k].point) : 0;
}

/* C = d/dt (M qd) at constant qd - dL/dq - Q, with Q of damping and efforts; power = that Q . qd. */
static void lagrange(int number, const random_model *r, derived *d)
{
    enum { MOST_FORCES = 8 };
    const kempe_model *model = r->model;
    at_rate a = {r, d, random_state_vectors()};
    const state s = a.s;
    double bias[MODEL_MAX_N], slope[1 + MOST_FORCES], rate[1 + MOST_FORCES], power = 0;
    difference(momentum, &a, d->n, s.q, s.qd, d->n, bias);
    difference(lagrangian, &a, d->n, s.q, s.qd, 1 + model->force_count, rate);
    for (int k = 0; k < model->force_count; k++)
        power -= model->forces[k].damping.value * rate[1 + k] * rate[1 + k];
    for (int i = 0; i < d->n; i++) {
        double e[MODEL_MAX_N] = {0};
        e[i] = 1;
        difference(lagrangian, &a, d->n, s.q, e, 1 + model->force_count, slope);
        bias[i] -= slope[0];
        for (int k = 0; k < model->force_count; k++)
            bias[i] += model->forces[k].damping.value * rate[1 + k] * slope[1 + k];
    }
    for (int k = 0; k < r->effort_count; k++) {
        const effort *f = &r->efforts[k];
        double value = effort_value(f, s.t, s.q, s.qd);
        bias[f->motion] -= value;
        power += f->conservative ? 0 : value * s.qd[f->motion];
    }
    derived_eval(d, &s);
    CHECK_CLOSE(d->n, d->bias, bias, 1e-8);
    CHECK_CLOSE(1, d->power, &power, 1e-8);
}

static void test_lagrange(void)
{
    for_all_models(lagrange);
}

/* -- closures -------------------------------------------------------------------------------------------- */

static void closures(int number, const random_model *r, derived *d)
{
    state s = random_state_vectors();
    derived_eval(d, &s);
    for (int c = 0; c < r->model->closure_count; c++) {
        const kmp_closure *closure = &r->model->closures[c];
        double length = closure->length.value, gap = plain_distance(r->model, s.q, closure->point);
        double square = 0, lambda = 0, force = 0;
        for (int k = 0; k < d->m; k++)
            if (d->eq.rows[k].closure == c) {
                square += d->h[k] * d->h[k];
                lambda += s.lambda[k] * s.lambda[k];
            }
        for (int k = 0; k < 3; k++)
            force += d->reaction[3 * c + k] * d->reaction[3 * c + k];
        bool rod = strcmp(closure->kind, "rod") == 0;
        double expected = rod ? fabs(gap * gap - length * length) / 2 : gap, size = sqrt(square);
        /* A dropped row of a ball is zero; the rod's force is lambda times the distance. */
        double pull = sqrt(lambda) * (rod ? gap : 1), felt = sqrt(force);
        CHECK_CLOSE(1, &size, &expected, 1e-13);
        CHECK_CLOSE(1, &felt, &pull, 1e-13);
    }
}

static void test_closures(void)
{
    for_all_models(closures);
}

static void residual_field(void *user, const double *q, double *out)
{
    at_rate *a = user;
    memcpy(a->s.q, q, (size_t)a->d->n * sizeof *q);
    derived_eval(a->d, &a->s);
    memcpy(out, a->d->h, (size_t)a->d->m * sizeof *out);
}

/* J qd, at the rates of the state. */
static void rate_field(void *user, const double *q, double *out)
{
    at_rate *a = user;
    memcpy(a->s.q, q, (size_t)a->d->n * sizeof *q);
    derived_eval(a->d, &a->s);
    derived_jacobian_times(a->d, a->s.qd, out);
}

static void closure_rates(int number, const random_model *r, derived *d)
{
    enum { MOST_ROWS = 16 };
    at_rate a = {r, d, random_state_vectors()};
    const state s = a.s;
    double column[MOST_ROWS], expected[MOST_ROWS], gamma[MOST_ROWS], zero[MOST_ROWS] = {0};
    for (int k = 0; k < d->n; k++) {
        double e[MODEL_MAX_N] = {0};
        e[k] = 1;
        difference(residual_field, &a, d->n, s.q, e, d->m, expected);
        derived_eval(d, &s);
        for (int i = 0; i < d->m; i++)
            column[i] = d->jacobian[i * d->n + k];
        CHECK_CLOSE(d->m, column, expected, 1e-9);
    }
    difference(rate_field, &a, d->n, s.q, s.qd, d->m, gamma);
    derived_eval(d, &s);
    derived_jacobian_times(d, s.qd, expected);
    CHECK_CLOSE(d->m, d->jdqd, gamma, 1e-8);
    CHECK_CLOSE(d->m, d->hdot, expected, 1e-13);
    CHECK_CLOSE(d->m, d->h_t, zero, 0);
}

static void test_closure_rates(void)
{
    for_all_models(closure_rates);
}

/* -- the plant --------------------------------------------------------------------------------------------- */

/* The staged programs and their sparse patterns give what the sets give. */
static void plant_agrees(int number, const random_model *r, derived *d)
{
    static double mass[MODEL_MAX_N * MODEL_MAX_N], jacobian[MODEL_MAX_N * MODEL_MAX_N];
    kempe_system *system = NULL;
    CHECK(kempe_system_new(r->model, &system) == KEMPE_OK);
    kmp_plant *plant = kmp_plant_new(system, "tape");
    state s = random_state_vectors();
    double product[MODEL_MAX_N], other[MODEL_MAX_N] = {0}, kinetic = 0;
    kmp_plant_closure(plant, s.t, s.q);
    kmp_plant_mass(plant);
    kmp_plant_bias(plant, s.qd);
    kmp_plant_dense_mass(plant, mass);
    kmp_plant_dense_jacobian(plant, jacobian);
    derived_eval(d, &s);
    derived_mass_times(d, s.qdd, product);
    for (int i = 0; i < d->n * d->n; i++)
        other[i % d->n] += mass[i] * s.qdd[i / d->n];
    CHECK_CLOSE(d->n, other, product, 1e-12);
    for (int i = 0; i < d->m * d->n; i++)
        CHECK_NEAR(jacobian[i], d->jacobian[i % d->m * d->n + i / d->m], 1e-12);
    derived_mass_times(d, s.qd, product);
    for (int i = 0; i < d->n; i++)
        kinetic += s.qd[i] * product[i] / 2;
    CHECK_NEAR(kmp_plant_kinetic(plant, s.qd), kinetic, 1e-12);
    CHECK_CLOSE(d->m, plant->h, d->h, 1e-12);
    CHECK_CLOSE(d->n, plant->bias, d->bias, 1e-12);
    CHECK_CLOSE(d->m, plant->jdqd, d->jdqd, 1e-12);
    CHECK_NEAR(kmp_plant_potential(plant, s.t, s.q), *d->potential, 1e-12);
    CHECK_NEAR(kmp_plant_power(plant, s.t, s.q, s.qd), *d->power, 1e-12);
    CHECK_CLOSE(3 * r->model->closure_count, kmp_plant_reactions(plant, s.t, s.q, s.lambda), d->reaction, 1e-12);
    CHECK_CLOSE(3 * d->eq.position_count, kmp_plant_positions(plant, s.t, s.q), d->position, 1e-12);
    kmp_plant_free(plant);
    kempe_system_free(system);
}

static void test_plant(void)
{
    for_all_models(plant_agrees);
}

/* -- deep trees --------------------------------------------------------------------------------------------- */

/* A chain of `bodies` with a spring and a rod from its tip to the ground. */
static kempe_model *deep_chain(kempe_context *context, int bodies, const char *motion)
{
    kmp_text text = {0};
    kempe_model *model = NULL;
    kmp_text_put(&text, "kempe: 1\ngravity: [1, -2, 3]\nground: {points: {P: [1, 0.5, 0.3]}}\nbodies:\n");
    for (int b = 1; b <= bodies; b++) {
        kmp_text_printf(&text, "  b%d: {joint: {motions: [%s], at: ", b, motion);
        if (b == 1)
            kmp_text_put(&text, "ground.P");
        else
            kmp_text_printf(&text, "b%d.P", b - 1);
        kmp_text_put(&text, "}, mass: 0.1, com: [0.05, 0.01, 0], points: {P: [0.1, 0.02, 0]}}\n");
    }
    kmp_text_printf(&text, "loops: {R: {rod: [ground.P, b%d.P], length: 1}}\n", bodies);
    kmp_text_printf(&text, "forces: {s: {spring: [ground.P, b%d.P], stiffness: 10, free_length: 0.5}}\n", bodies);
    CHECK(kempe_model_read_text(context, text.s, "deep", &model) == KEMPE_OK);
    kmp_text_free(&text);
    return model;
}

static void potential_field(void *user, const double *q, double *out)
{
    const kempe_model *model = user;
    double gap = plain_distance(model, q, model->closures[0].point);
    out[0] = plain_potential(model, q);
    out[1] = gap * gap / 2;
}

/* At rest C is the slope of the potential. */
static void check_deep_chain(int number, const char *motion)
{
    derived d;
    kempe_context *context = kempe_context_new();
    kempe_model *model = deep_chain(context, number, motion);
    double bias[MODEL_MAX_N], jacobian[MODEL_MAX_N], slope[2];
    const unsigned sets = KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD;
    bool ok = derived_init(&d, model, sets, KMP_SCHEME_COMPOSITE, false);
    CHECK(ok && d.m == 1);
    state s = {0};
    random_seed(3);
    for (int k = 0; k < d.n; k++)
        s.q[k] = between(-0.3, 0.3);
    for (int k = 0; k < d.n; k++) {
        double e[MODEL_MAX_N] = {0};
        e[k] = 1;
        difference(potential_field, model, d.n, s.q, e, 2, slope);
        bias[k] = slope[0];
        jacobian[k] = slope[1];
    }
    derived_eval(&d, &s);
    CHECK_CLOSE(d.n, d.bias, bias, 1e-8);
    CHECK_CLOSE(d.n, d.jacobian, jacobian, 1e-8);
    at_rate a = {NULL, &d, random_state_vectors()};
    difference(rate_field, &a, d.n, s.q, a.s.qd, 1, slope);
    memcpy(a.s.q, s.q, sizeof s.q);
    derived_eval(&d, &a.s);
    CHECK_CLOSE(1, d.jdqd, slope, 1e-6);
    derived_free(&d);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void test_deep_chains(void)
{
    check_deep_chain(20, "R3");
    check_deep_chain(75, "R3");
    check_deep_chain(20, "R3, R1");
    check_deep_chain(38, "R3, R1");
}

int main(void)
{
    TEST(test_mass_schemes);
    TEST(test_inverse_dynamics);
    TEST(test_kept_parameters);
    TEST(test_energies);
    TEST(test_positions);
    TEST(test_lagrange);
    TEST(test_closures);
    TEST(test_closure_rates);
    TEST(test_plant);
    TEST(test_deep_chains);
    return check_report();
}
