/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 2 */
/* The formalisms against each other on random trees, with and without loops: implicit and semi-explicit recursive
 * Newton/Euler, composite bodies, the O(N) scheme, the same with full matrices, the classical virtual power, and plain
 * numeric programs. */
#include "base/text.h"
#include "bench/classical.h"
#include "bench/numeric_classical.h"
#include "bench/plain_articulated.h"
#include "derived.h"
#include "distance.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>
#include <stdlib.h>

enum { MODELS = 96, MOTION = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL };

static void check_close(int number, const char *what, double off, double tolerance)
{
    if (!(off <= tolerance)) {
        check_failures++;
        printf("model %d: %s: off by %.3g, allowed %.3g\n", number, what, off, tolerance);
    }
}

/* Chains and trees of every kind of joint, with forces and symbols; odd ones with loops. */
static random_model model_number(int k)
{
    return random_model_new((uint64_t)(1000 + k), 1 + k % 6, (unsigned)k % 16);
}

/* -- the O(N) scheme ----------------------------------------------------------------------------------- */

/* M x + C - J' lambda; in units of what is added up. */
static double balance(const derived *d, const double *x, const double *lambda, const double *bias)
{
    double mx[STATE_MAX], jt[STATE_MAX], worst = 0, size = 1;
    derived_mass_times(d, x, mx);
    derived_transposed(d, lambda, jt);
    for (int k = 0; k < d->n; k++) {
        worst = check_max(worst, fabs(mx[k] + bias[k] - jt[k]));
        for (int i = 0; i < d->n; i++)
            size = check_max(size, fabs(d->mass[(i > k ? i : k) * d->n + (i > k ? k : i)] * x[i]));
        size = check_max(size, fabs(bias[k]));
    }
    return isfinite(worst) ? worst / size : INFINITY;
}

/* Leaves rows out until those that are kept are independent: one after the other, in the order of their elimination. */
static void keep_independent(derived *closed, state *s)
{
    bool independent = false;
    while (!independent) {
        derived_eval(closed, s);
        int worst = -1;
        double largest = 0; /* a row that coordinates move only by rounding has a diagonal of its square */
        for (int r = 0; r < closed->m; r++)
            largest = s->kept[r] > 0 ? fmax(largest, closed->diagonals[r]) : largest;
        for (int r = 0; r < closed->m; r++)
            if (s->kept[r] > 0 &&
                !(closed->pivots[r] > 1e-9 * closed->diagonals[r] && closed->diagonals[r] > 1e-24 * largest)) {
                const bool before = worst < 0 || !isfinite(closed->pivots[worst]);
                worst = before && (worst < 0 || isfinite(closed->pivots[r])) ? r : worst;
            }
        independent = worst < 0;
        if (worst >= 0)
            s->kept[worst] = 0;
    }
}

/* Accelerations without closures, and with the multipliers of independent ones: M qdd + C = J' lambda, J qdd + jdqd =
 * 0; the correction of violations, M x = J' y, J x = -mu, as the implicit residual by Newton/Euler has the
 * accelerations. */
static void check_accelerations(int number, derived *fast, derived *closed, derived *full, state *s)
{
    double zero[STATE_MAX] = {0}, rows[STATE_MAX], *qdd = s->qdd;
    int n = full->n, m = full->m;
    derived_eval(fast, s);
    derived_eval(full, s);
    check_close(number, "free accelerations", balance(full, fast->accelerations, zero, full->bias), 1e-12);
    keep_independent(closed, s);
    memcpy(qdd, closed->accelerations, (size_t)n * sizeof *qdd);
    memcpy(s->lambda, closed->multipliers, (size_t)m * sizeof *s->lambda);
    derived_eval(full, s);
    check_close(number, "accelerations with multipliers", balance(full, qdd, s->lambda, full->bias), 1e-10);
    derived_jacobian_times(full, qdd, rows);
    for (int r = 0; r < m; r++) {
        double size = fmax(1, fabs(full->jdqd[r]));
        for (int k = 0; k < n; k++)
            size = fmax(size, fabs(full->jacobian[r * n + k] * qdd[k]));
        CHECK(s->kept[r] > 0 || s->lambda[r] == 0);
        check_close(number, "rows", s->kept[r] * fabs(rows[r] + full->jdqd[r]) / size, 1e-10);
    }
    derived_jacobian_times(full, closed->correction, rows);
    for (int r = 0; r < m; r++) {
        double size = 1;
        for (int k = 0; k < n; k++)
            size = fmax(size, fabs(full->jacobian[r * n + k] * closed->correction[k]));
        check_close(number, "corrections", s->kept[r] * fabs(rows[r] + s->mu[r]) / size, 1e-10);
    }
    double size = 1;
    for (int k = 0; k < n; k++)
        size = check_max(size, fabs(full->bias[k]));
    for (int k = 0; k < n; k++)
        for (int i = 0; i <= k; i++)
            size = check_max(size, fabs(full->mass[k * n + i] * qdd[i]));
    check_close(number, "implicit residual", distance(n, full->residual, zero) / size, 1e-10);
}

static void check_scheme(int number, const kempe_model *model, int *used)
{
    derived fast, closed, full;
    if (!derived_init(&fast, model, KMP_SET_ACCELERATION, KMP_SCHEME_COMPOSITE, false))
        return;
    CHECK(derived_init_closed(&closed, model));
    CHECK(derived_init(&full, model, MOTION, number % 2 ? KMP_SCHEME_NER : KMP_SCHEME_COMPOSITE, false));
    state s = random_state_vectors();
    check_accelerations(number, &fast, &closed, &full, &s);
    derived_free(&fast);
    derived_free(&closed);
    derived_free(&full);
    ++*used;
}

static void accelerations_in_order_n(void)
{
    int used = 0;
    for (int number = 0; number < MODELS; number++) {
        random_model r = model_number(number);
        CHECK(r.model != NULL);
        if (r.model)
            check_scheme(number, r.model, &used);
        random_model_free(&r);
    }
    CHECK(10 * used >= 7 * MODELS);
    printf("   %d of %d models\n", used, MODELS);
}

/* -- the classical form -------------------------------------------------------------------------------- */

/* M and C of virtual power as a program of their own: n x n and n outputs. */
static bool classical_init(derived *d, const kempe_model *model)
{
    *d = (derived){.n = model->motion_count};
    if (kmp_equations_init(&d->eq, model, 0, KMP_SCHEME_COMPOSITE, false) != KEMPE_OK)
        return false;
    kmp_forces forces;
    kmp_forces_init(&forces, &d->eq.tree, false, NULL);
    CHECK(classical_derive(&d->eq.tree, forces.applied, d->eq.dynamics.mass, d->eq.dynamics.bias));
    for (int k = 0; k < d->n; k++)
        d->eq.dynamics.bias[k] = kmp_sub(d->eq.graph, d->eq.dynamics.bias[k], forces.effort[k]);
    const int count[2] = {d->n * d->n, d->n};
    const kmp_ref *const groups[2] = {d->eq.dynamics.mass, d->eq.dynamics.bias};
    d->program = kmp_program_new(d->eq.graph, 2, count, groups);
    d->machine = kmp_machine_new(d->program, kmp_backend_find("tape"));
    return true;
}

static void check_classical(int number, const kempe_model *model)
{
    derived plain, full;
    if (!derived_init(&full, model, KMP_SET_MASS | KMP_SET_BIAS, KMP_SCHEME_COMPOSITE, false))
        return;
    CHECK(classical_init(&plain, model));
    state s = random_state_vectors();
    derived_eval(&full, &s);
    kmp_machine_set(plain.machine, KMP_IN_TIME, &s.t);
    kmp_machine_set(plain.machine, KMP_IN_Q, s.q);
    kmp_machine_set(plain.machine, KMP_IN_QD, s.qd);
    (void)kmp_machine_run(plain.machine, 0);
    check_close(number, "mass", distance(full.n * full.n, kmp_machine_run(plain.machine, 1), full.mass), 1e-12);
    check_close(number, "bias", distance(full.n, kmp_machine_run(plain.machine, 2), full.bias), 1e-12);
    derived_free(&plain);
    derived_free(&full);
}

static void virtual_power(void)
{
    for (int number = 0; number < MODELS; number++) {
        random_model r = model_number(number);
        if (r.model)
            check_classical(number, r.model);
        random_model_free(&r);
    }
}

/* -- the numeric programs ------------------------------------------------------------------------------ */

/* h, J and jdqd, where all closures are of kinds that it has. */
static bool check_numeric_closures(int number, const derived *d, const numeric *p, const state *s)
{
    static double h[STATE_MAX], jacobian[STATE_MAX * STATE_MAX], jdqd[STATE_MAX];
    numeric_closures closures;
    if (d->m == 0 || !numeric_closures_init(&closures, p, &d->eq.tree, d->m, d->eq.closures.rows))
        return false;
    memset(jacobian, 0, sizeof jacobian);
    numeric_close(&closures, s->qd, h, jacobian, jdqd);
    check_close(number, "numeric h", distance(d->m, h, d->h), 1e-12);
    check_close(number, "numeric J", distance(d->m * d->n, jacobian, d->jacobian), 1e-12);
    check_close(number, "numeric jdqd", distance(d->m, jdqd, d->jdqd), 1e-12);
    numeric_closures_free(&closures);
    return true;
}

/* The residual is the inverse dynamics where lambda is zero. Forces are left out. Returns whether closures were held
 * together too. */
static bool check_numeric(int number, const kempe_model *model)
{
    static double mass[STATE_MAX * STATE_MAX], bias[STATE_MAX], moved[STATE_MAX];
    kempe_model bare = *model;
    derived d = {0};
    numeric p;
    numeric_classical plain;
    kmp_derivation_request scene = {.sets = MOTION, .loops_alone = true};
    bare.force_count = 0;
    if (kmp_equations_derive(&d.eq, &bare, &scene) != KEMPE_OK)
        return false;
    derived_finish(&d);
    CHECK(numeric_init(&p, &d.eq.tree));
    state s = random_state_vectors();
    memset(s.lambda, 0, sizeof s.lambda);
    derived_eval(&d, &s);
    memset(mass, 0, sizeof mass);
    numeric_motion(&p, s.q, s.qd, mass, bias);
    check_close(number, "numeric M", distance(d.n * d.n, mass, d.mass), 1e-12);
    check_close(number, "numeric C", distance(d.n, bias, d.bias), 1e-12);
    bool closed = check_numeric_closures(number, &d, &p, &s);
    numeric_inverse(&p, s.q, s.qd, s.qdd, moved);
    CHECK(numeric_classical_init(&plain, &p));
    numeric_classical_motion(&plain, &p, s.q, s.qd, mass, bias);
    check_close(number, "non-recursive numeric M", distance(d.n * d.n, mass, d.mass), 1e-12);
    check_close(number, "non-recursive numeric C", distance(d.n, bias, d.bias), 1e-12);
    numeric_classical_free(&plain);
    check_close(number, "numeric inverse dynamics", distance(d.n, moved, d.residual), 1e-12);
    numeric_free(&p);
    derived_free(&d);
    return closed;
}

static void plain_numeric(void)
{
    static const char *const files[] = {"car44", "roadster52", "humanoid29", "limousine63"};
    const char *folder = getenv("KEMPE_MBS");
    kempe_context *context = kempe_context_new();
    int closed = 0;
    CHECK(kempe_context_set_left_out(context, "extforce,link") == KEMPE_OK); /* whose laws are in user code */
    for (int number = 0; number < MODELS; number++) {
        random_model r = model_number(number);
        if (r.model)
            (void)check_numeric(number, r.model);
        random_model_free(&r);
    }
    for (int k = 0; k < 4 + 4; k++) {
        static const char *const own[] = {"examples/andrews/andrews.yaml", "examples/stewart/stewart.yaml",
                                          "examples/n_four_bar/n_four_bar_40.yaml", "tests/models/suspension5.yaml"};
        char path[512];
        kempe_model *model = NULL;
        if (k < 4)
            snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, own[k]);
        else
            snprintf(path, sizeof path, "%s/%s.mbs", folder ? folder : "", files[k - 4]);
        if (kempe_model_read(context, path, &model) == KEMPE_OK)
            closed += check_numeric(MODELS + k, model);
        else
            CHECK(k >= 4 && !folder);
        kempe_model_free(model);
    }
    printf("   closures of %d models\n", closed);
    CHECK(closed >= (folder ? 7 : 4));
    kempe_context_free(context);
}

/* -- O(N) with full matrices --------------------------------------------------------------------------- */

static bool plain_init(derived *d, const kempe_model *model)
{
    *d = (derived){.n = model->motion_count};
    if (kmp_equations_init(&d->eq, model, 0, KMP_SCHEME_COMPOSITE, false) != KEMPE_OK)
        return false;
    kmp_forces forces;
    kmp_forces_init(&forces, &d->eq.tree, false, NULL);
    CHECK(plain_articulated(&d->eq.tree, forces.applied, forces.effort, d->eq.articulated.accelerations));
    const kmp_ref *const group = d->eq.articulated.accelerations;
    d->program = kmp_program_new(d->eq.graph, 1, &d->n, &group);
    d->machine = kmp_machine_new(d->program, kmp_backend_find("tape"));
    return true;
}

static void check_plain(int number, const kempe_model *model, int *used)
{
    double zero[STATE_MAX] = {0};
    derived plain, fast, full;
    if (!derived_init(&fast, model, KMP_SET_ACCELERATION, KMP_SCHEME_COMPOSITE, false))
        return;
    derived_free(&fast);
    CHECK(derived_init(&full, model, KMP_SET_MASS | KMP_SET_BIAS, KMP_SCHEME_COMPOSITE, false));
    CHECK(plain_init(&plain, model));
    state s = random_state_vectors();
    derived_eval(&full, &s);
    kmp_machine_set(plain.machine, KMP_IN_TIME, &s.t);
    kmp_machine_set(plain.machine, KMP_IN_Q, s.q);
    kmp_machine_set(plain.machine, KMP_IN_QD, s.qd);
    (void)kmp_machine_run(plain.machine, 0);
    check_close(number, "6 x 6", balance(&full, kmp_machine_run(plain.machine, 1), zero, full.bias), 1e-12);
    derived_free(&plain);
    derived_free(&full);
    ++*used;
}

static void full_matrices(void)
{
    int used = 0;
    for (int number = 0; number < MODELS; number++) {
        random_model r = model_number(number);
        if (r.model)
            check_plain(number, r.model, &used);
        random_model_free(&r);
    }
    CHECK(10 * used >= 7 * MODELS);
}

static kempe_model *model_of(kempe_context *context, const char *bodies)
{
    kmp_text text = {0};
    kempe_model *model = NULL;
    kmp_text_printf(&text, "kempe: 1\nname: m\ngravity: [0, 0, -9.81]\nbodies:\n%s", bodies);
    if (kempe_model_read_text(context, text.s, "m.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model);
    kmp_text_free(&text);
    return model;
}

/* -- ways to write it ---------------------------------------------------------------------------------- */

/* All of them, wherever, at once or after others. */
static void pick_ways(kmp_savings *savings, const kempe_model *model)
{
    for (int k = 0; k < model->motion_count; k++) {
        savings->stay[k] = (uint8_t)pick(2);
        savings->about[k] = (uint8_t)pick(2);
        savings->origin[k] = (uint8_t)pick(KMP_ORIGINS);
        savings->give[k] = (uint8_t)pick(KMP_GIVE_ALL + 1);
        savings->lump[k] = (uint8_t)pick(KMP_GIVE_ALL + 1);
    }
    for (int k = 0; k < 4 * model->closure_count; k++)
        savings->point[k] = (uint8_t)pick(3);
}

static void check_ways(int number, const kempe_model *model)
{
    enum { SETS = MOTION | KMP_SET_INVERSE | KMP_SET_ACCELERATION };
    kmp_savings savings;
    CHECK(kmp_savings_init(&savings, model));
    pick_ways(&savings, model);
    const bool keep = number % 2;
    kmp_derivation_request scene = {
        .sets = SETS, .keep = keep ? KMP_KEEP_PARAMETERS : KMP_KEEP_NOTHING, .savings = &savings, .returns = true};
    scene.scheme = number % 3 ? KMP_SCHEME_COMPOSITE : KMP_SCHEME_NER;
    derived other = {0}, plain;
    kmp_savings first;
    CHECK(kmp_savings_init(&first, model));
    if (number % 4 < 2)
        kmp_savings_copy(&first, &savings, model);
    memcpy(first.point, savings.point, 4 * (size_t)model->closure_count);
    scene.savings = &first;
    bool derives = kmp_equations_derive_once(&other.eq, model, &scene) == KEMPE_OK;
    scene.savings = &savings;
    if (derives && number % 4 > 1)
        CHECK(kmp_equations_derive_again(&other.eq, &scene) == KEMPE_OK);
    kmp_savings_free(&savings);
    kmp_savings_free(&first);
    if (!derives)
        return;
    derived_finish(&other);
    CHECK(derived_init(&plain, model, SETS, KMP_SCHEME_COMPOSITE, keep));
    state s = random_state_vectors();
    int n = plain.n, m = plain.m;
    derived_eval(&other, &s);
    derived_eval(&plain, &s);
    check_close(number, "M", distance(n * n, other.mass, plain.mass), 1e-12);
    check_close(number, "C", distance(n, other.bias, plain.bias), 1e-12);
    check_close(number, "residual", distance(n, other.residual, plain.residual), 1e-12);
    check_close(number, "h", distance(m, other.h, plain.h), 1e-12);
    check_close(number, "J", distance(m * n, other.jacobian, plain.jacobian), 1e-12);
    check_close(number, "jdqd", distance(m, other.jdqd, plain.jdqd), 1e-12);
    double none[STATE_MAX] = {0};
    check_close(number, "qdd", balance(&plain, other.accelerations, none, plain.bias), 1e-12);
    derived_free(&other);
    derived_free(&plain);
}

/* Forces and torques on bodies act at centres of mass, wherever the origins are. */
static void bias_of(const kempe_model *model, const kmp_derivation_request *scene, const state *s, const double *input,
                    double *bias)
{
    kmp_equations eq;
    CHECK(kmp_equations_derive_once(&eq, model, scene) == KEMPE_OK);
    const kmp_ref *outputs = eq.dynamics.bias;
    kmp_program *p = kmp_program_new(eq.graph, 1, &eq.n, &outputs);
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    kmp_machine_set(machine, KMP_IN_TIME, &s->t);
    kmp_machine_set(machine, KMP_IN_Q, s->q);
    kmp_machine_set(machine, KMP_IN_QD, s->qd);
    kmp_machine_set(machine, KMP_IN_FORCE, input);
    kmp_machine_set(machine, KMP_IN_TORQUE, input + 1);
    (void)kmp_machine_run(machine, 0);
    memcpy(bias, kmp_machine_run(machine, 1), (size_t)eq.n * sizeof *bias);
    kmp_machine_free(machine);
    kmp_program_free(p);
    kmp_equations_free(&eq);
}

static void inputs_agree(void)
{
    double input[3 * STATE_MAX + 1], plain[STATE_MAX], other[STATE_MAX];
    for (int number = 0; number < MODELS; number += 3) {
        random_model r = model_number(number);
        kmp_savings savings = {0};
        CHECK(r.model && kmp_savings_init(&savings, r.model));
        kmp_derivation_request scene = {.sets = KMP_SET_BIAS, .body_inputs = true, .savings = &savings};
        state s = random_state_vectors();
        for (int k = 0; k < 3 * STATE_MAX + 1; k++)
            input[k] = between(-5, 5);
        bias_of(r.model, &scene, &s, input, plain);
        pick_ways(&savings, r.model);
        bias_of(r.model, &scene, &s, input, other);
        check_close(number, "C with inputs", distance(r.model->motion_count, other, plain), 1e-12);
        kmp_savings_free(&savings);
        random_model_free(&r);
    }
}

static void ways_agree(void)
{
    for (int number = 0; number < MODELS; number++) {
        random_model r = model_number(number);
        if (r.model)
            check_ways(number, r.model);
        random_model_free(&r);
    }
}

/* Operations of M and C together, numbers kept; those at run time alone. */
static long count_of(const kempe_model *model, const kmp_savings *savings, kmp_savings *found)
{
    kmp_derivation_request scene = {.sets = KMP_SET_MASS | KMP_SET_BIAS, .keep = KMP_KEEP_NUMBERS, .savings = savings};
    kmp_equations eq;
    CHECK(kmp_equations_derive(&eq, model, &scene) == KEMPE_OK);
    const int sizes[2] = {eq.n * eq.n, eq.n};
    const kmp_ref *const groups[2] = {eq.dynamics.mass, eq.dynamics.bias};
    kmp_program *p = kmp_program_new(eq.graph, 2, sizes, groups);
    long count = kmp_program_count(p, 1, 2).paper;
    if (found)
        kmp_savings_copy(found, &eq.savings, model);
    kmp_program_free(p);
    kmp_equations_free(&eq);
    return count;
}

/* Two bodies in space: each way alone where it helps, and the search takes base parameters by itself. */
static void base_parameters_pay(void)
{
    static const char bodies[] =
        "  a: {joint: {revolute: x, at: ground}, mass: 1, com: [1, 2, 3], inertia: {xx: 5, yy: 6, "
        "zz: 7, xy: 1}, points: {P: [3, 1, 2]}}\n"
        "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [1, 2, 4], inertia: {xx: 5, yy: 6, "
        "zz: 7, xz: 1}, points: {P: [0, 0, 2]}}\n"
        "  c: {joint: {revolute: y, at: b.P}, mass: 1, com: [1, 2, 4], inertia: {xx: 5, yy: 6, "
        "zz: 7, xz: 1}}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *model = model_of(context, bodies);
    kmp_savings savings = {0}, found = {0};
    if (!model || !kmp_savings_init(&savings, model) || !kmp_savings_init(&found, model)) {
        CHECK(false);
        return;
    }
    long plain = count_of(model, &savings, NULL);
    savings.give[1] = savings.give[2] = KMP_GIVE_ALL;
    long given = count_of(model, &savings, NULL);
    savings.lump[1] = savings.lump[2] = KMP_GIVE_ALL;
    long lumped = count_of(model, &savings, NULL);
    savings.origin[1] = KMP_ORIGIN_CHILD; /* the joint of c is on the axis of b's */
    long moved = count_of(model, &savings, NULL);
    long best = count_of(model, NULL, &found);
    printf("   %ld operations, %ld %ld %ld with one way more, %ld found\n", plain, given, lumped, moved, best);
    CHECK(given < plain && lumped < given && moved < lumped);
    CHECK(10 * best < 9 * plain);
    CHECK(found.give[1] == KMP_GIVE_ALL && found.lump[2] & KMP_GIVE_MASS);
    kmp_savings_free(&savings);
    kmp_savings_free(&found);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* In the plane nothing is turned twice: chains of parallel axes are written in axes that stay. */
static void parallel_axes_stay(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = model_of(context, "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 2, 0], "
                                           "inertia: {zz: 2}, points: {P: [3, 1, 0]}}\n"
                                           "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [1, 2, 0], "
                                           "inertia: {zz: 2}, points: {P: [3, 2, 0]}}\n"
                                           "  c: {joint: {revolute: z, at: b.P}, mass: 1, com: [0, 2, 0], "
                                           "inertia: {zz: 2}, points: {P: [3, 2, 0]}}\n"
                                           "  d: {joint: {revolute: z, at: c.P}, mass: 1, com: [3, 2, 0], "
                                           "inertia: {zz: 2}}\n");
    long count[3] = {0, 0, 0};
    kmp_savings plain = {0}, found = {0};
    CHECK(model && kmp_savings_init(&plain, model) && kmp_savings_init(&found, model));
    for (int k = 0; model && k < 3; k++) { /* turning axes, what is found, and that beside turning axes */
        kmp_derivation_request scene = {
            .sets = KMP_SET_MASS | KMP_SET_BIAS, .savings = k == 1 ? NULL : &plain, .returns = k == 2};
        kmp_equations eq;
        CHECK(kmp_equations_derive(&eq, model, &scene) == KEMPE_OK);
        scene.savings = &found;
        if (k == 2)
            CHECK(kmp_equations_derive_again(&eq, &scene) == KEMPE_OK);
        const int sizes[2] = {eq.n * eq.n, eq.n};
        const kmp_ref *const groups[2] = {eq.dynamics.mass, eq.dynamics.bias};
        kmp_program *p = kmp_program_new(eq.graph, 2, sizes, groups);
        count[k] = kmp_program_count(p, 0, 2).paper;
        CHECK(eq.savings.stay[3] == (k > 0));
        kmp_savings_copy(&found, &eq.savings, model);
        kmp_program_free(p);
        kmp_equations_free(&eq);
    }
    kmp_savings_free(&plain);
    kmp_savings_free(&found);
    CHECK(count[2] == count[1]);
    printf("   %ld operations, %ld in turning axes\n", count[1], count[0]);
    CHECK(10 * count[1] < 9 * count[0]);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* -- what it refuses ----------------------------------------------------------------------------------- */

static void refused(const char *bodies, const char *sentence)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = model_of(context, bodies);
    kmp_equations eq = {0};
    if (model) {
        kempe_status status = kmp_equations_init(&eq, model, KMP_SET_ACCELERATION, KMP_SCHEME_COMPOSITE, false);
        CHECK(status == KEMPE_E_FAILED);
        CHECK_TEXT(kempe_context_message(context), sentence);
    }
    kempe_model_free(model);
    kempe_context_free(context);
}

static void massless_ends(void)
{
    refused("  a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0]}\n"
            "  b: {joint: {revolute: y, at: a}}\n",
            "the O(N) scheme divides by the inertia that a coordinate moves, and coordinate 'b' of body 'b' moves "
            "none; give the bodies it moves an inertia about its axis, or use M and C");
    refused("  a: {joint: {prismatic: x, at: ground}}\n",
            "the O(N) scheme divides by the inertia that a coordinate moves, and coordinate 'a' of body 'a' moves "
            "none; give the bodies it moves a mass, or use M and C");
    /* two joints about one axis: what is left behind the second is nothing about it */
    refused("  a: {joint: {revolute: z, at: ground}}\n"
            "  b: {joint: {revolute: z, at: a}, mass: 1, com: [1, 0, 0]}\n",
            "the O(N) scheme divides by the inertia that a coordinate moves, and coordinate 'a' of body 'a' moves "
            "none; give the bodies it moves an inertia about its axis, or use M and C");
}

/* -- growth -------------------------------------------------------------------------------------------- */

static kempe_model *chain(kempe_context *context, int bodies)
{
    kmp_text text = {0};
    for (int b = 1; b <= bodies; b++) {
        kmp_text_printf(&text, "  b%d: {joint: {%s: %s", b, b % 2 ? "revolute" : "prismatic", b % 4 < 2 ? "z" : "x");
        kmp_text_printf(&text, b > 1 ? ", at: b%d.P" : ", at: ground", b - 1);
        kmp_text_put(&text, "}, mass: 1.5, com: [0.1, 0.2, 0.3], inertia: {xx: 0.4, yy: 0.5, zz: 0.6}, "
                            "points: {P: [0.3, 0.1, 0.2]}}\n");
    }
    kempe_model *model = model_of(context, text.s);
    kmp_text_free(&text);
    return model;
}

static long operations(kempe_context *context, int bodies)
{
    kempe_model *model = chain(context, bodies);
    kmp_equations eq;
    long count = -1;
    if (model && kmp_equations_init(&eq, model, KMP_SET_ACCELERATION, KMP_SCHEME_COMPOSITE, false) == KEMPE_OK) {
        const kmp_ref *group = eq.articulated.accelerations;
        kmp_program *p = kmp_program_new(eq.graph, 1, &eq.n, &group);
        count = kmp_program_count(p, 1, 1).paper;
        kmp_program_free(p);
        kmp_equations_free(&eq);
    }
    kempe_model_free(model);
    return count;
}

/* Each further pair of bodies adds the same number of operations. */
static void operations_grow_linearly(void)
{
    kempe_context *context = kempe_context_new();
    long twenty = operations(context, 20), forty = operations(context, 40), sixty = operations(context, 60);
    printf("   %ld, %ld, %ld operations\n", twenty, forty, sixty);
    CHECK(twenty > 0 && sixty - forty == forty - twenty);
    kempe_context_free(context);
}

/* -- a second set of equations ------------------------------------------------------------------------- */

static long acceleration_operations(const kempe_model *model, const kmp_savings *first, kmp_savings *taken)
{
    const kmp_derivation_request scene = {.sets = KMP_SET_ACCELERATION, .efforts = true, .first = first};
    kmp_equations eq;
    CHECK(kmp_equations_derive(&eq, model, &scene) == KEMPE_OK);
    const kmp_ref *const group = eq.articulated.accelerations;
    kmp_program *p = kmp_program_new(eq.graph, 1, &eq.n, &group);
    long count = kmp_program_count(p, 1, 1).paper;
    kmp_savings_copy(taken, &eq.savings, model);
    kmp_program_free(p);
    kmp_equations_free(&eq);
    return count;
}

/* In a large mechanism accelerations take the variants that M and C have, which are about as good as those of a search
 * of their own. */
static void a_second_set_takes_the_variants_of_the_first(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = chain(context, 50);
    kmp_savings found = {0}, taken = {0}, none = {0};
    kmp_equations eq;
    const kmp_derivation_request scene = {.sets = KMP_SET_MASS | KMP_SET_BIAS, .found = &found};
    CHECK(kmp_savings_init(&taken, model) && kmp_savings_init(&none, model));
    CHECK(kmp_equations_derive(&eq, model, &scene) == KEMPE_OK);
    CHECK(found.patterns & 1 && kmp_savings_same(&found, &eq.savings, model));
    kmp_equations_free(&eq);
    long own = acceleration_operations(model, NULL, &taken);
    long given = acceleration_operations(model, &found, &taken);
    CHECK(kmp_savings_same(&taken, &found, model));
    long begun = acceleration_operations(model, &none, &taken); /* the first pattern is tried in addition */
    CHECK(taken.patterns == 1);
    printf("   %ld operations, %ld with those of M and C, %ld with the first pattern\n", own, given, begun);
    CHECK(given > 0 && 100 * given <= 101 * own && begun >= own);
    kmp_savings_free(&found);
    kmp_savings_free(&taken);
    kmp_savings_free(&none);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(a_second_set_takes_the_variants_of_the_first);
    TEST(accelerations_in_order_n);
    TEST(virtual_power);
    TEST(plain_numeric);
    TEST(full_matrices);
    TEST(ways_agree);
    TEST(inputs_agree);
    TEST(base_parameters_pay);
    TEST(parallel_axes_stay);
    TEST(massless_ends);
    TEST(operations_grow_linearly);
    return check_report();
}
