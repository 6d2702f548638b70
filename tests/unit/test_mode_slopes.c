/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of equilibria and eigenvalues by parameters: against closed forms, and against two-sided differences with
 * a sweep of steps, the equilibrium found anew and the eigenvalues solved anew on either side; eigenvalues that are
 * equal, with as many vectors and with fewer; what nothing holds. */
#include "analyses/equilibrium/equilibrium_study.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/modes/eigenmodes.h"
#include "loaded.h"
#include "model/data/parameter.h"
#include "model/data/variant.h"
#include <complex.h>

enum { MOST = 64 };

typedef struct rig {
    loaded m;
    kmp_variant *variant;
    kempe_system *system;
    kmp_linear linear;
    kmp_slopes *slopes;
    kmp_second_derivatives bend;
    kmp_state_sensitivity shift;
    kmp_spectrum spectrum;
    kmp_mode_slopes modes;
    int count, n, p;
    const char *names[MOST];
    double values[MOST], q[MOST], lambda[MOST];
    int u[MOST];
    kempe_status status; /* of the shift */
} rig;

static void set_values(rig *r, const double *values)
{
    kmp_text why = {0};
    CHECK(kmp_variant_set(r->variant, values, &why) == KEMPE_OK && kmp_system_rescale(r->system));
    kmp_text_free(&why);
    kmp_linear_renew_parameters(&r->linear);
}

/* From the equilibrium near by. */
static void settle(rig *r)
{
    static kmp_search search;
    double q[MOST];
    search = (kmp_search){.newton = true};
    memcpy(q, r->q, sizeof q);
    CHECK(kmp_linear_choose(&r->linear, 0, q, NULL, 0) == KEMPE_OK);
    CHECK(kmp_equilibrium_find(&r->linear, 0, q, &search) == KEMPE_OK);
    kmp_linear_matrices(&r->linear);
}

static void solve_modes(rig *r)
{
    kmp_spectrum_free(&r->spectrum);
    CHECK(kmp_spectrum_init(&r->spectrum, r->p, r->linear.mass, NULL, r->linear.damping, r->linear.stiffness, false) ==
          0);
}

/* names: with commas; settles from the assembled start, or stays there. */
static bool open_rig(rig *r, loaded m, const char *names, bool equilibrium)
{
    static char copy[512];
    kmp_operating *start = NULL;
    *r = (rig){.m = m};
    (void)snprintf(copy, sizeof copy, "%s", names);
    for (char *name = strtok(copy, ","); name; name = strtok(NULL, ","))
        r->names[r->count++] = name;
    CHECK(kmp_variant_new(m.model, r->count, r->names, &r->variant) == KEMPE_OK);
    CHECK(r->variant && kempe_system_new(kmp_variant_model(r->variant), &r->system) == KEMPE_OK);
    if (!r->system)
        return false;
    for (int k = 0; k < r->count; k++)
        for (int i = 0; i < kmp_model_parameter_count(m.model); i++)
            if (strcmp(kmp_model_parameter(m.model, i)->name, r->names[k]) == 0)
                r->values[k] = kmp_model_parameter(m.model, i)->number.value;
    CHECK(kmp_linear_init(&r->linear, r->system, "native") == KEMPE_OK);
    CHECK(kmp_slopes_new(r->system, "native", r->count, r->names, false, &r->slopes) == KEMPE_OK);
    CHECK(kmp_second_derivatives_init(&r->bend, r->system, kmp_backend_find("native"), r->count, r->names) == KEMPE_OK);
    CHECK(kmp_state_sensitivity_init(&r->shift, r->system, r->count, r->names) == KEMPE_OK);
    bool ok = kmp_operating_new(r->system, equilibrium ? NULL : "start", NULL, &start) == KEMPE_OK &&
              kmp_operating_take(start, &r->linear, NULL, 0) == KEMPE_OK;
    if (!ok)
        printf("%s\n", kempe_context_message(m.context));
    CHECK(ok);
    if (!ok)
        return false;
    r->n = r->system->n;
    r->p = r->linear.p;
    memcpy(r->q, r->linear.q, (size_t)r->n * sizeof *r->q);
    kmp_operating_free(start);
    if (equilibrium)
        settle(r);
    kmp_linear_matrices(&r->linear);
    memcpy(r->q, r->linear.q, (size_t)r->n * sizeof *r->q);
    memcpy(r->lambda, r->linear.lambda, (size_t)r->system->m * sizeof *r->lambda);
    solve_modes(r);
    r->status = kmp_state_sensitivity_at(&r->shift, &r->linear, r->slopes,
                                         equilibrium ? KMP_KEEP_EQUILIBRIUM : KMP_KEEP_RATES, NULL, NULL);
    if (r->status == KEMPE_OK)
        CHECK(kmp_mode_slopes_init(&r->modes, &r->linear, &r->bend, &r->shift, &r->spectrum) == KEMPE_OK);
    return r->status == KEMPE_OK;
}

static void close_rig(rig *r)
{
    kmp_mode_slopes_free(&r->modes);
    kmp_spectrum_free(&r->spectrum);
    kmp_state_sensitivity_free(&r->shift);
    kmp_second_derivatives_free(&r->bend);
    kmp_slopes_free(r->slopes);
    kmp_linear_free(&r->linear);
    kempe_system_free(r->system);
    kmp_variant_free(r->variant);
    unload(&r->m);
}

static double complex eigenvalue(const rig *r, int i)
{
    return r->spectrum.re[i] + r->spectrum.im[i] * I;
}

static double complex slope(const rig *r, int i, int k)
{
    return r->modes.re[i * r->count + k] + r->modes.im[i * r->count + k] * I;
}

/* The eigenvalue above the axis with the number that it has by modulus. */
static int above(const rig *r, int number)
{
    for (int i = 0; i < r->spectrum.count; i++)
        if (r->spectrum.im[i] > 0 && number-- == 0)
            return i;
    CHECK(false);
    return 0;
}

/* -- differences ------------------------------------------------------------------------------------- */

typedef struct snapshot {
    double q[MOST], lambda[MOST];
    double complex s[2 * MOST];
} snapshot;

/* With parameter k changed by step; eigenvalues by who is nearest to where the slope leads. */
static void look(rig *r, int k, double step, const double complex *from, snapshot *x)
{
    double values[MOST];
    memcpy(values, r->values, sizeof values);
    values[k] += step;
    set_values(r, values);
    settle(r);
    solve_modes(r);
    memcpy(x->q, r->linear.q, (size_t)r->n * sizeof(double));
    memcpy(x->lambda, r->linear.lambda, (size_t)r->system->m * sizeof(double));
    for (int i = 0; i < r->spectrum.count; i++) {
        double complex expected = from[i] + step * slope(r, i, k);
        x->s[i] = eigenvalue(r, 0);
        for (int j = 1; j < r->spectrum.count; j++)
            if (cabs(eigenvalue(r, j) - expected) < cabs(x->s[i] - expected))
                x->s[i] = eigenvalue(r, j);
    }
}

static double off(int count, const double *plus, const double *minus, double step, double value, const double *exact)
{
    double worst = 0, size = 1e-300;
    for (int i = 0; i < count; i++) {
        size = check_max(size, fmax(fabs(exact[i]), 1e-2 * fabs(plus[i]) / value));
        worst = check_max(worst, fabs((plus[i] - minus[i]) / (2 * step) - exact[i]));
    }
    return worst / size;
}

/* All that moves with parameter k, by the best step for each: worst of q and of lambda beside the largest slope (or a
 * hundredth of what they are over what the parameter is), of an eigenvalue's beside the largest of all. */
static void against_differences(rig *r, int k, double within)
{
    static snapshot plus, minus;
    double complex from[2 * MOST];
    double best_q = INFINITY, best_lambda = INFINITY, best_s[2 * MOST], size = 0, worst = 0;
    int count = r->spectrum.count;
    for (int i = 0; i < count; i++) {
        from[i] = eigenvalue(r, i);
        best_s[i] = INFINITY;
        if (r->modes.kind[i] == KMP_MODE_SIMPLE)
            size = check_max(size, cabs(slope(r, i, k)));
    }
    for (double relative = 1e-2; relative > 1e-6; relative /= 4) {
        double value = fmax(fabs(r->values[k]), 1e-3), step = relative * value;
        look(r, k, step, from, &plus);
        look(r, k, -step, from, &minus);
        best_q = fmin(best_q, off(r->n, plus.q, minus.q, step, value, r->shift.q + k * r->n));
        best_lambda = fmin(
            best_lambda, off(r->system->m, plus.lambda, minus.lambda, step, value, r->shift.lambda + k * r->system->m));
        for (int i = 0; i < count; i++)
            if (r->modes.kind[i] == KMP_MODE_SIMPLE)
                best_s[i] = fmin(best_s[i], cabs((plus.s[i] - minus.s[i]) / (2 * step) - slope(r, i, k)) / size);
    }
    set_values(r, r->values);
    settle(r);
    solve_modes(r);
    for (int i = 0; i < count; i++)
        if (r->modes.kind[i] == KMP_MODE_SIMPLE)
            worst = check_max(worst, best_s[i]);
    printf("   %-12s q %.1e  lambda %.1e  eigenvalues %.1e\n", r->names[k], best_q, best_lambda, worst);
    CHECK(best_q < within && best_lambda < within && worst < within);
}

static void check_model(loaded m, const char *names, double within)
{
    static rig r;
    if (open_rig(&r, m, names, true))
        for (int k = 0; k < r.count; k++)
            against_differences(&r, k, within);
    else
        printf("%s\n", kempe_context_message(r.m.context));
    CHECK(r.status == KEMPE_OK);
    close_rig(&r);
}

/* -- models ------------------------------------------------------------------------------------------ */

#define FOUR_BAR                                                                                                       \
    "kempe: 1\ngravity: [0, -9.81, 0]\n"                                                                               \
    "parameters: {crank: 0.3, coupler: 0.8, rocker: 0.7, base: 0.9, k: 30, rest: 1, c: 0.4, m: 1}\n"                   \
    "ground: {points: {O: [0, 0, 0], D: [base, 0, 0]}}\n"                                                              \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {revolute: z, at: ground.O}, mass: 1, com: [crank/2, 0, 0], inertia: {zz: crank^2/12}, "             \
    "points: {B: [crank, 0, 0]}}\n"                                                                                    \
    "  b: {joint: {revolute: z, at: a.B}, mass: m, com: [coupler/2, 0, 0], inertia: {zz: m*coupler^2/12}, "            \
    "points: {C: [coupler, 0, 0]}}\n"                                                                                  \
    "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [rocker/2, 0, 0], inertia: {zz: 0.04}, "                  \
    "points: {C: [rocker, 0, 0]}}\n"                                                                                   \
    "loops: {C: {ball: [b.C, c.C]}}\n"                                                                                 \
    "forces: {k: {joint: a, spring: {stiffness: k, rest: rest, damping: c}}}\n"                                        \
    "start: {q: {a: 60 deg, b: -32 deg, c: 106 deg}, hold: [a]}\n"

static void a_four_bar_with_a_spring(void)
{
    check_model(load_text(FOUR_BAR), "crank,coupler,rocker,base,k,rest,c,m", 1e-7);
}

static void a_suspension(void)
{
    check_model(load("examples/suspension/suspension.yaml"), "rear_k,rear_c,tyre,bar,height", 1e-7);
}

static void a_stewart_platform(void)
{
    check_model(load("examples/stewart/stewart.yaml"), "k,c,lower,across2", 1e-7);
}

/* -- closed forms ------------------------------------------------------------------------------------ */

/* omega = sqrt(g/l), and its derivatives. */
static void a_pendulum(void)
{
    static rig r;
    CHECK(open_rig(&r,
                   load_text("kempe: 1\nparameters: {l: 0.7, g: 9.81, m: 3}\ngravity: [0, -g, 0]\n"
                             "bodies: {a: {joint: {revolute: z, at: ground}, mass: m, com: [0, -l, 0]}}\n"),
                   "l,g,m", true));
    int i = above(&r, 0);
    double omega = sqrt(9.81 / 0.7);
    CHECK_NEAR(cimag(eigenvalue(&r, i)), omega, 1e-14);
    CHECK_NEAR(cimag(slope(&r, i, 0)), -omega / (2 * 0.7), 1e-14);
    CHECK_NEAR(cimag(slope(&r, i, 1)), omega / (2 * 9.81), 1e-14);
    CHECK(cabs(slope(&r, i, 2)) < 1e-15);
    CHECK(creal(slope(&r, i, 0)) == 0);
    close_rig(&r);
}

/* omega^2 of two masses in a row: the roots of m1 m2 x^2 - (m1 k2 + m2 (k1 + k2)) x + k1 k2, m1 below. */
static double complex quarter_car(int which, const double complex v[4])
{
    double complex m1 = v[0], m2 = v[1], k1 = v[2], k2 = v[3];
    double complex b = m1 * k2 + m2 * (k1 + k2), root = csqrt(b * b - 4 * m1 * m2 * k1 * k2);
    return csqrt((b + (which ? root : -root)) / (2 * m1 * m2));
}

/* Derivatives by a complex step: no difference is taken. */
static void a_quarter_car(void)
{
    static rig r;
    const double v[4] = {40, 250, 160000, 16000};
    CHECK(open_rig(&r,
                   load_text("kempe: 1\nparameters: {m1: 40, m2: 250, k1: 160000, k2: 16000}\ngravity: [0, 0, -9.81]\n"
                             "bodies:\n"
                             "  wheel: {joint: {prismatic: z, at: ground}, mass: m1}\n"
                             "  car: {joint: {prismatic: z, at: wheel}, mass: m2}\n"
                             "forces: {tyre: {joint: wheel, spring: {stiffness: k1}}, "
                             "spring: {joint: car, spring: {stiffness: k2}}}\n"),
                   "m1,m2,k1,k2", true));
    for (int which = 0; which < 2; which++)
        for (int k = 0; k < 4; k++) {
            double complex at[4] = {v[0], v[1], v[2], v[3]};
            at[k] += 1e-30 * I;
            double exact = cimag(quarter_car(which, at)) / 1e-30, found = cimag(slope(&r, above(&r, which), k));
            CHECK(fabs(found / exact - 1) < 1e-12);
        }
    /* how deep it stands: -(m1 + m2) g/k1 and -m2 g/k2 */
    CHECK_NEAR(r.shift.q[0 * 2 + 0] * 160000 / 9.81, -1, 1e-12);
    CHECK_NEAR(r.shift.q[2 * 2 + 0] * 160000 * 160000 / (290 * 9.81), 1, 1e-12);
    CHECK_NEAR(r.shift.q[1 * 2 + 1] * 16000 / 9.81, -1, 1e-12);
    CHECK_NEAR(r.shift.q[3 * 2 + 1] * 16000. * 16000 / (250 * 9.81), 1, 1e-12);
    close_rig(&r);
}

/* k (q - a) + m g l cos q = 0: dq/dp by the implicit function. */
static void a_lever_on_a_spring(void)
{
    static rig r;
    CHECK(open_rig(&r,
                   load_text("kempe: 1\nparameters: {l: 0.4, m: 2, k: 20, a: 0.5}\ngravity: [0, -9.81, 0]\n"
                             "bodies: {a: {joint: {revolute: z, at: ground}, mass: m, com: [l, 0, 0]}}\n"
                             "forces: {k: {joint: a, spring: {stiffness: k, rest: a}}}\nstart: {q: {a: 0.2}}\n"),
                   "l,m,k,a", true));
    double q = r.q[0], by_q = 20 - 2 * 9.81 * 0.4 * sin(q);
    const double by[4] = {2 * 9.81 * cos(q), 9.81 * 0.4 * cos(q), q - 0.5, -20};
    CHECK(fabs(20 * (q - 0.5) + 2 * 9.81 * 0.4 * cos(q)) < 1e-13);
    for (int k = 0; k < 4; k++) {
        CHECK_NEAR(r.shift.q[k], -by[k] / by_q, 1e-13);
        CHECK(r.shift.qd[k] == 0 && fabs(r.shift.residual[k]) < 1e-13);
    }
    /* omega^2 = by_q/(m l^2): its total derivative by the rest angle, which nothing but q sees */
    double dq = r.shift.q[3], omega = sqrt(by_q / (2 * 0.4 * 0.4));
    CHECK_NEAR(cimag(slope(&r, above(&r, 0), 3)), -2 * 9.81 * 0.4 * cos(q) * dq / (2 * omega * 2 * 0.4 * 0.4), 1e-12);
    close_rig(&r);
}

/* A ball on an arm l from the axis of a shaft that turns at w, a rod of the same length from it to a sleeve: steady at
 * the height h = (m + 2 M) g/(m w^2) below the hinge, whatever l is. */
#define GOVERNOR                                                                                                       \
    "kempe: 1\nparameters: {w: 8, l: 0.5, m: 2, M: 0.7, g: 9.81, c: 3}\ngravity: [0, 0, -g]\n"                         \
    "bodies:\n"                                                                                                        \
    "  shaft: {joint: {revolute: z, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {T: [0, 0, 1]}}\n"   \
    "  arm: {joint: {revolute: y, at: shaft.T}, mass: m, com: [l, 0, 0], points: {E: [l, 0, 0]}}\n"                    \
    "  sleeve: {joint: {prismatic: z, at: shaft}, mass: M, points: {P: [0, 0, 0]}}\n"                                  \
    "loops: {rod: {rod: [arm.E, sleeve.P], length: l}}\n"                                                              \
    "drives: {spin: {joint: shaft, angle: w*t}}\n"                                                                     \
    "forces: {c: {joint: sleeve, force: '-c*qd(sleeve)'}}\n"                                                           \
    "start: {q: {arm: 50 deg, sleeve: 0.2}}\n"

static void a_governor(void)
{
    static rig r;
    CHECK(open_rig(&r, load_text(GOVERNOR), "w,l,m,M,c", true));
    double h = (2 + 2 * 0.7) * 9.81 / (2 * 64), c = h / 0.5, s = sqrt(1 - c * c);
    CHECK_NEAR(r.q[1], asin(c), 1e-12);
    const double by_h[5] = {-2 * h / 8, 0, -2 * 0.7 * 9.81 / (4 * 64), 2 * 9.81 / (2 * 64), 0};
    for (int k = 0; k < 5; k++) {
        double arm = (by_h[k] - (k == 1 ? c : 0)) / (0.5 * s); /* h = l sin(arm) */
        CHECK_NEAR(r.shift.q[k * r.n + 1], arm, 1e-12);
        CHECK_NEAR(r.shift.q[k * r.n + 2], -2 * by_h[k], 1e-12);
        CHECK_NEAR(r.shift.qd[k * r.n], k == 0 ? 1 : 0, 1e-14);
        against_differences(&r, k, 1e-8);
    }
    close_rig(&r);
}

/* -- equal eigenvalues, and none ---------------------------------------------------------------------- */

/* Two equal pendulums: by the length of one of them one of both frequencies moves, by that of both both do. */
static void equal_ones(void)
{
    static rig r;
    CHECK(open_rig(&r,
                   load_text("kempe: 1\nparameters: {l: 0.7, both: 1, k: 0}\ngravity: [0, -9.81, 0]\n"
                             "bodies:\n"
                             "  a: {joint: {revolute: z, at: ground}, mass: 3, com: [0, -l*both, 0]}\n"
                             "  b: {joint: {revolute: z, at: ground}, mass: 3, com: [0, -0.7*both, 0]}\n"
                             "forces: {k: {joint: a, torque: 'k*(q(b) - q(a))'}, l: {joint: b, torque: 'k*(q(a) - "
                             "q(b))'}}\n"),
                   "l,both,k", true));
    int i = above(&r, 0), j = above(&r, 1);
    double omega = sqrt(9.81 / 0.7), inertia = 3 * 0.7 * 0.7;
    CHECK(r.modes.kind[i] == KMP_MODE_REPEATED && r.modes.kind[j] == KMP_MODE_REPEATED);
    const double exact[3][2] = {{-omega / 1.4, 0}, {-omega / 2, -omega / 2}, {0, 2 / (2 * omega * inertia)}};
    for (int k = 0; k < 3; k++) {
        double a = cimag(slope(&r, i, k)), b = cimag(slope(&r, j, k));
        CHECK_NEAR(fmin(a, b), exact[k][0], 1e-12);
        CHECK_NEAR(fmax(a, b), exact[k][1], 1e-12);
    }
    close_rig(&r);
}

/* Damped just so that both roots meet: there is no derivative. */
static void equal_ones_with_one_vector(void)
{
    static rig r;
    CHECK(open_rig(&r,
                   load_text("kempe: 1\nparameters: {k: 4, c: 4}\ngravity: [0, 0, 0]\n"
                             "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
                             "forces: {k: {joint: a, spring: {stiffness: k, damping: c}}}\n"),
                   "k,c", true));
    for (int i = 0; i < 2; i++)
        CHECK(r.modes.kind[i] == KMP_MODE_DEFECTIVE && isnan(r.modes.re[2 * i]) && isnan(r.modes.im[2 * i + 1]));
    close_rig(&r);
}

/* A coordinate without restoring force stays where it is, unless the parameter pushes it. */
static void what_nothing_holds(void)
{
    static rig r;
    const char *const model = "kempe: 1\nparameters: {push: 0, k: 5}\ngravity: [0, -1, 0]\n"
                              "bodies:\n"
                              "  free: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                              "  held: {joint: {prismatic: y, at: free}, mass: 2}\n"
                              "forces: {k: {joint: held, spring: {stiffness: k}}, f: {joint: free, force: push}}\n";
    CHECK(open_rig(&r, load_text(model), "k", false));
    close_rig(&r);
    CHECK(open_rig(&r, load_text(model), "k", true));
    CHECK(r.shift.q[0] == 0);
    CHECK_NEAR(r.shift.q[1], 2.0 / 25, 1e-14);
    CHECK(r.modes.kind[0] == KMP_MODE_ZERO && isnan(r.modes.re[0]));
    close_rig(&r);
    CHECK(!open_rig(&r, load_text(model), "k,push", true));
    CHECK(r.status == KEMPE_E_FAILED && strstr(kempe_context_message(r.m.context), "'free'") &&
          strstr(kempe_context_message(r.m.context), "'push'"));
    close_rig(&r);
}

int main(void)
{
    TEST(a_pendulum);
    TEST(a_quarter_car);
    TEST(a_lever_on_a_spring);
    TEST(a_four_bar_with_a_spring);
    TEST(a_suspension);
    TEST(a_stewart_platform);
    TEST(a_governor);
    TEST(equal_ones);
    TEST(equal_ones_with_one_vector);
    TEST(what_nothing_holds);
    return check_report();
}
