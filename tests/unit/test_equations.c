/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow once 7 */
/* The equations of random spatial mechanisms against each other and against plain mechanics: Lagrange's equations by
 * differences, kinematics by rotation matrices. */
#include "base/text.h"
#include "constraints/evaluation/evaluator.h"
#include "derived.h"
#include "distance.h"
#include "dynamics/equations.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "random_model.h"
#include "symbolic/table_function.h"
#include "testing.h"

enum { MODELS = 128, ALL_SETS = 255 };

/* Chains, trees, loops, symbols, friction: by the number. */
static random_model model_number(int k)
{
    return random_model_new((uint64_t)(k + 1), 1 + k % 5, (unsigned)k * 7 % 16);
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
        CHECK_CLOSE(3 * d->eq.outputs.position_count, symbolic.position, d->position, 1e-13);
    }
    derived_free(&symbolic);
}

static void test_kept_parameters(void)
{
    for_all_models(symbols_are_numbers);
}

/* -- against plain mechanics ---------------------------------------------------------------------------- */

/* Welded to the ground, where its weight has no say. */
static bool is_fixed(const kempe_model *model, int body)
{
    while (body > 0 && model->bodies[body].motion_count == 0)
        body = model->bodies[body].parent;
    return body == 0;
}

/* Potential energy of gravity and springs. */
static double plain_potential(const kempe_model *model, const double *q)
{
    pose p[MODEL_MAX_BODIES];
    double v = 0, com[3], x[3], gravity[3];
    plain_poses(model, q, p);
    number_values(model->gravity, gravity);
    for (int b = 1; b < model->body_count; b++) {
        number_values(model->bodies[b].com, com);
        pose_apply(&p[b], com, x);
        for (int k = 0; k < 3; k++)
            v -= is_fixed(model, b) ? 0 : model->bodies[b].mass.value * gravity[k] * x[k];
    }
    for (int k = 0; k < model->force_count; k++) {
        const kmp_force *f = &model->forces[k];
        if (f->kind != KMP_FORCE_SPRING)
            continue;
        double stretch = plain_distance(model, q, f->point) - f->free_length.value;
        v += f->stiffness.value * stretch * stretch / 2;
    }
    return v;
}

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
    CHECK(d->eq.outputs.position_count == 2 * (r->model->body_count - 1));
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

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static double cross_square(const double a[3], const double b[3])
{
    double c[3];
    cross(a, b, c);
    return dot(c, c);
}

/* Vectors of a closure's residuals, in ground axes. */
typedef struct geometry {
    double d[3], e[2][3], axes[2][3][3];
} geometry;

static geometry plain_geometry(const kempe_model *model, const pose *p, const kmp_closure *closure)
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    geometry x;
    double at[2][3];
    for (int side = 0; side < 2; side++) {
        plain_point(model, p, closure->point[side], at[side]);
        plain_direction(model, p, closure->point[side], closure->axis[side], x.e[side]);
        for (int k = 0; k < 3; k++)
            plain_direction(model, p, closure->point[side], unit[k], x.axes[side][k]);
    }
    for (int k = 0; k < 3; k++)
        x.d[k] = at[1][k] - at[0][k];
    return x;
}

/* sin^2 of the angle between two frames: the skew part is the sum of half the cross products of their axes. */
static double skew_square(const geometry *x)
{
    double sum[3] = {0}, c[3];
    for (int k = 0; k < 3; k++) {
        cross(x->axes[0][k], x->axes[1][k], c);
        for (int i = 0; i < 3; i++)
            sum[i] += c[i] / 2;
    }
    return dot(sum, sum);
}

static double square(double x)
{
    return x * x;
}

/* A direction across an axis, in its point's axes: that axis turned from its largest component to the next one. */
static void beside(const double e[3], double a[3])
{
    int k = fabs(e[2]) >= fabs(e[0]) && fabs(e[2]) >= fabs(e[1]) ? 2
            : fabs(e[1]) >= fabs(e[0])                           ? 1
                                                                 : 0,
        i = (k + 1) % 3;
    const double size = hypot(e[k], e[i]);
    a[(k + 2) % 3] = 0;
    a[k] = -e[i] / size;
    a[i] = e[k] / size;
}

/* 2 tan(twist/2), the twist from where the least rotation from e1 to e2 takes a direction across e1, by Rodrigues. */
static double twist_of(const kempe_model *model, const pose *p, const kmp_closure *c, const geometry *x)
{
    double own[3], a[2][3], n[3], nn[3], moved[3], side[3];
    for (int k = 0; k < 2; k++) {
        beside(c->axis[k], own);
        plain_direction(model, p, c->point[k], own, a[k]);
    }
    cross(x->e[0], x->e[1], n); /* sin times the axis of that rotation */
    cross(n, a[0], moved);
    cross(n, moved, nn);
    for (int i = 0; i < 3; i++)
        moved[i] += a[0][i] + nn[i] / (1 + dot(x->e[0], x->e[1]));
    cross(moved, a[1], side);
    return 2 * tan(atan2(dot(side, x->e[1]), dot(moved, a[1])) / 2);
}

/* The curves of random_model.h. */
static double curve_square(const kmp_closure *c, double x, double y, double z)
{
    if (c->table)
        return square(y - kmp_table_value(c->table->table, 0, x));
    if (c->curve_side[0] == 0)
        return c->curve_count == 1 ? square(x * x / 4 + y * y - z * x - 1)
                                   : square(x * y - z * z + 0.3) + square(sin(x) + y * z);
    return square(y - 0.4 * x * x + sin(x)) + (c->curve_count == 2 ? square(z - cos(x) * x) : 0);
}

/* h.h, which does not depend on the choice of axes; negative: not known here. */
static double plain_square(const kempe_model *model, const double *q, const kmp_closure *c)
{
    pose p[MODEL_MAX_BODIES];
    const kmp_closure_kind kind = c->kind;
    plain_poses(model, q, p);
    if (c->point[0] < 0) {
        double sum = c->constant ? -c->constant->value : 0;
        for (int k = 0; k < c->term_count; k++)
            sum += c->terms[k].factor.value * q[c->terms[k].motion];
        if (kind == KMP_CLOSURE_screw)
            sum = q[c->motion] - c->number.value * q[c->motion + 1] / (8 * atan(1));
        return kind == KMP_CLOSURE_constraint ? -1 : sum * sum;
    }
    geometry x = plain_geometry(model, p, c);
    double gap = dot(x.d, x.d), line = cross_square(x.e[0], x.d), parallel = cross_square(x.e[0], x.e[1]);
    double along = dot(x.axes[0][0], x.d);
    if (kind == KMP_CLOSURE_ball)
        return gap;
    if (kind == KMP_CLOSURE_rod)
        return square((gap - square(c->number.value)) / 2);
    if (kind == KMP_CLOSURE_revolute)
        return gap + parallel;
    if (kind == KMP_CLOSURE_universal)
        return gap + square(dot(x.e[0], x.e[1]));
    if (kind == KMP_CLOSURE_constant_velocity)
        return gap + square(twist_of(model, p, c, &x));
    if (kind == KMP_CLOSURE_cylindrical)
        return line + parallel;
    if (kind == KMP_CLOSURE_planar)
        return square(dot(x.e[0], x.d)) + parallel;
    if (kind == KMP_CLOSURE_prismatic)
        return line + skew_square(&x);
    if (kind == KMP_CLOSURE_weld)
        return gap + skew_square(&x);
    if (kind == KMP_CLOSURE_point_on_line)
        return line;
    if (kind == KMP_CLOSURE_point_on_plane)
        return square(dot(x.e[0], x.d));
    if (kind == KMP_CLOSURE_point_on_curve)
        return curve_square(c, along, dot(x.axes[0][1], x.d), dot(x.axes[0][2], x.d));
    return -1;
}

/* True near twists of half a turn, or shafts that point against each other, where rows of constant velocity have no
 * bounds; the state has been evaluated. */
static bool is_at_pole(const random_model *r, const derived *d)
{
    const double most = 1e3;
    bool found = false;
    for (int k = 0; k < d->m; k++)
        for (int i = 0;
             i < d->n && r->model->closures[d->eq.closures.rows[k].closure].kind == KMP_CLOSURE_constant_velocity; i++)
            found = found || !(fabs(d->jacobian[k * d->n + i]) < most);
    return found;
}

/* The kinds that occurred. */
static char met[256];

static void closures(int number, const random_model *r, derived *d)
{
    state s = random_state_vectors();
    derived_eval(d, &s);
    if (is_at_pole(r, d))
        return;
    for (int c = 0; c < r->model->closure_count; c++) {
        const kmp_closure *closure = &r->model->closures[c];
        double sum = 0, expected = plain_square(r->model, s.q, closure);
        for (int k = 0; k < d->m; k++)
            if (d->eq.closures.rows[k].closure == c)
                sum += d->h[k] * d->h[k];
        if (!strstr(met, kmp_closure_word(closure)))
            snprintf(met + strlen(met), sizeof met - strlen(met), " %s", kmp_closure_word(closure));
        double size = sqrt(sum), wanted = sqrt(fmax(expected, 0));
        if (expected >= 0)
            CHECK_CLOSE(1, &size, &wanted, 1e-12);
        else
            CHECK(closure->kind == KMP_CLOSURE_constraint);
    }
}

/* lambda' J qd of a closure to the ground is the power of its force and moment on the second body. */
static void check_wrench(int number, const random_model *r, derived *d, const state *s, int c)
{
    const kempe_model *model = r->model;
    const kmp_closure *closure = &model->closures[c];
    pose p[MODEL_MAX_BODIES], rate[MODEL_MAX_BODIES];
    posed user = {model};
    double rates[32], at[3], v[3], own[3], w[3], power = 0, expected;
    int body = model->points[closure->point[1]].body;
    derived_eval(d, s);
    derived_jacobian_times(d, s->qd, rates);
    for (int k = 0; k < d->m; k++)
        power += d->eq.closures.rows[k].closure == c ? s->lambda[k] * rates[k] : 0;
    plain_poses(model, s->q, p);
    difference(pose_field, &user, d->n, s->q, s->qd, 12 * model->body_count, &rate[0].r[0][0]);
    number_values(model->points[closure->point[1]].at, at);
    pose_apply(&rate[body], at, v);
    spin_in_body(&p[body], &rate[body], own);
    for (int i = 0; i < 3; i++)
        w[i] = p[body].r[i][0] * own[0] + p[body].r[i][1] * own[1] + p[body].r[i][2] * own[2];
    const double *moment = d->shown + 3 * d->eq.outputs.position_count + 3 * c;
    expected = dot(d->reaction + 3 * c, v) + dot(moment, w);
    CHECK_CLOSE(1, &power, &expected, 1e-9);
}

static void wrenches(int number, const random_model *r, derived *d)
{
    state s = random_state_vectors();
    for (int c = 0; c < r->model->closure_count; c++) {
        const int *point = r->model->closures[c].point;
        if (point[0] >= 0 && r->model->points[point[0]].body == 0)
            check_wrench(number, r, d, &s, c);
    }
}

static void test_closures(void)
{
    for_all_models(closures);
    for_all_models(wrenches);
    /* followers on cams are in test_cams.c */
#define KMP_CLOSURE(name, ...) CHECK(KMP_CLOSURE_##name == KMP_CLOSURE_follower || strstr(met, #name));
#include "model/data/closure_kinds.def"
#include <kempe/kempe.h>
#include <stdbool.h>
#undef KMP_CLOSURE
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
    enum { MOST_ROWS = 32 };
    at_rate a = {r, d, random_state_vectors()};
    const state s = a.s;
    double column[MOST_ROWS], expected[MOST_ROWS], gamma[MOST_ROWS], zero[MOST_ROWS] = {0};
    derived_eval(d, &s);
    if (is_at_pole(r, d))
        return;
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

/* -- the evaluator ----------------------------------------------------------------------------------------- */

/* The staged programs and their sparse patterns give what the sets give. */
static void evaluator_agrees(int number, const random_model *r, derived *d)
{
    static double mass[MODEL_MAX_N * MODEL_MAX_N], jacobian[MODEL_MAX_N * MODEL_MAX_N];
    kempe_system *system = NULL;
    CHECK(kempe_system_new(r->model, &system) == KEMPE_OK);
    kmp_evaluator *eval = kmp_eval_new(system, "tape");
    state s = random_state_vectors();
    double product[MODEL_MAX_N], other[MODEL_MAX_N] = {0}, kinetic = 0;
    kmp_eval_closure(eval, s.t, s.q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, s.qd);
    kmp_eval_dense_mass(eval, mass);
    kmp_eval_dense_jacobian(eval, jacobian);
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
    CHECK_NEAR(kmp_eval_kinetic(eval, s.qd), kinetic, 1e-12);
    CHECK_CLOSE(d->m, eval->h, d->h, 1e-12);
    CHECK_CLOSE(d->n, eval->bias, d->bias, 1e-12);
    CHECK_CLOSE(d->m, eval->jdqd, d->jdqd, 1e-12);
    CHECK_NEAR(kmp_eval_potential(eval, s.t, s.q), *d->potential, 1e-12);
    CHECK_NEAR(kmp_eval_power_here(eval, s.qd), *d->power, 1e-12);
    CHECK_NEAR(kmp_eval_power(eval, s.t, s.q, s.qd), *d->power, 1e-12);
    CHECK_CLOSE(3 * r->model->closure_count, kmp_eval_reactions(eval, s.t, s.q, s.lambda), d->reaction, 1e-12);
    const double *shown = kmp_eval_shown(eval, s.t, s.q, s.qd, s.qdd, s.lambda);
    CHECK_CLOSE(d->eq.outputs.shown_count, shown, d->shown, 1e-12);
    kmp_eval_free(eval);
    kempe_system_free(system);
}

static void test_evaluator(void)
{
    for_all_models(evaluator_agrees);
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
    TEST(test_evaluator);
    TEST(test_deep_chains);
    return check_report();
}
