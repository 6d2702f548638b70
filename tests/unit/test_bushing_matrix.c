/* SPDX-License-Identifier: BSD-3-Clause */
/* Bushings with matrices: the frequencies of a rotor (reference J8); diagonal ones against three numbers; symmetric
 * ones against the slope of their potential, written down once more; nonsymmetric ones against the whirl in closed
 * form. */
#include "closed_form.h"
#include "loaded.h"
#include "model/data/variant.h"
#include "studies/simulate/trajectory.h"
#include <complex.h>
#include <kempe/modes.h>
#include <kempe/workspace.h>
#include <math.h>
#include <stdlib.h>

#define BODY                                                                                                           \
    "kempe: 1\n"                                                                                                       \
    "parameters: {k: 2e7}\n"                                                                                           \
    "ground: {points: {O: [0, 0, 0], T: {at: [0.1, 0.2, 0.3], axes: {z: [0, 1, 1], x: [1, 0, 0]}}}}\n"                 \
    "bodies: {b: {joint: {free: x, at: ground}, mass: 10, inertia: {xx: 0.2, yy: 0.2, zz: 0.3}, points: {C: [0, 0, "   \
    "0]}}}\n"

/* -- frequencies ----------------------------------------------------------------------------------------- */

/* k_x,thy: a displacement along x and a rotation about y; the plane y-z has the same by symmetry, with the other sign.
 * Every second eigenvalue is the conjugate of the one before it; those of the free directions are lower. */
static void rotor_on_one_bearing(void)
{
    static const double expected[] = {66.6435359210457, 66.6435359210457, 226.462557883695, 226.462557883695};
    loaded l = load_text(
        BODY "forces: {s: {bushing: [ground.O, b.C], matrix: [[k, 0, 0, 0, -3e5, 0], [0, k, 0, 3e5, 0, 0], "
             "[0, 0, 1e3, 0, 0, 0], [0, 3e5, 0, 4e4, 0, 0], [-3e5, 0, 0, 0, 4e4, 0], [0, 0, 0, 0, 0, 1]]}}\n");
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    CHECK(kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
    const int column = table ? kempe_table_find(table, "frequency") : -1;
    CHECK(table && column >= 0 && kempe_table_row_count(table) == 12);
    for (int k = 0; table && column >= 0 && k < 4; k++)
        CHECK_NEAR(kempe_table_number(table, 4 + 2 * k, column), expected[k], 1e-12);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* -- forces ------------------------------------------------------------------------------------------------ */

/* The part of the forces in the bias, and their potential. */
static bool added(const char *forces, const double *q, const double *qd, double bias[6], double *potential)
{
    const char *const texts[2] = {forces, ""};
    bool ok = true;
    for (int k = 0; k < 2; k++) {
        char text[4096];
        kempe_workspace *ws = NULL;
        (void)snprintf(text, sizeof text, BODY "forces: {%s}\n", texts[k]);
        loaded l = load_text(text);
        bool good = l.system && kempe_workspace_new(l.system, &ws) == KEMPE_OK &&
                    kempe_workspace_evaluate(ws, 0, q, qd) == KEMPE_OK;
        for (int i = 0; good && i < 6; i++)
            bias[i] = k == 0 ? kempe_workspace_bias(ws)[i] : bias[i] - kempe_workspace_bias(ws)[i];
        if (good && k == 0 && potential)
            *potential = kempe_workspace_potential(ws);
        kempe_workspace_free(ws);
        unload(&l);
        ok = ok && good;
    }
    CHECK(ok);
    return ok;
}

static const double at[6] = {0.02, -0.03, 0.05, 0.4, -0.7, 0.9}, moving[6] = {0.3, -0.5, 0.2, 1.1, -0.6, 0.8};

/* Bytes of the keys with three numbers, with and without rates, also in turned axes. */
static void diagonal_ones_are_three_numbers(void)
{
    static const char *const points[] = {"ground.O", "ground.T"};
    for (int k = 0; k < 4; k++) {
        char keys[1000], matrix[1000];
        double a[6], b[6], v[2];
        (void)snprintf(
            keys, sizeof keys,
            "s: {bushing: [%s, b.C], stiffness: [100, 200, 300], rotational_stiffness: [7, 8, 9], damping: [1, "
            "2, 3], rotational_damping: 4, preload: [1, 2, 3]}",
            points[k % 2]);
        (void)snprintf(
            matrix, sizeof matrix,
            "s: {bushing: [%s, b.C], matrix: [[100, 0, 0, 0, 0, 0], [0, 200, 0, 0, 0, 0], [0, 0, 300, 0, 0, 0], "
            "[0, 0, 0, 7, 0, 0], [0, 0, 0, 0, 8, 0], [0, 0, 0, 0, 0, 9]], damping_matrix: [[1, 0, 0, 0, 0, 0], "
            "[0, 2, 0, 0, 0, 0], [0, 0, 3, 0, 0, 0], [0, 0, 0, 4, 0, 0], [0, 0, 0, 0, 4, 0], [0, 0, 0, 0, 0, "
            "4]], preload: [1, 2, 3]}",
            points[k % 2]);
        if (added(keys, at, k < 2 ? NULL : moving, a, &v[0]) && added(matrix, at, k < 2 ? NULL : moving, b, &v[1]))
            CHECK(memcmp(a, b, sizeof a) == 0 && v[0] == v[1] && fabs(a[0]) > 1);
    }
}

/* -- potential ----------------------------------------------------------------------------------------------- */

static const double full[6][6] = {{100, 10, -20, 3, -30, 5}, {10, 200, 15, 25, 2, -4}, {-20, 15, 300, -6, 7, 8},
                                  {3, 25, -6, 50, 4, -3},    {-30, 2, 7, 4, 60, 5},    {5, -4, 8, -3, 5, 70}};

static void put_matrix(char *to, size_t size, const char *key, double m[6][6])
{
    size_t used = (size_t)snprintf(to, size, "%s: [", key);
    for (int k = 0; k < 36; k++)
        used += (size_t)snprintf(to + used, size - used, "%s%.17g%s",
                                 k % 6 ? ", "
                                 : k   ? ", ["
                                       : "[",
                                 m[k / 6][k % 6], k % 6 == 5 ? "]" : "");
    (void)snprintf(to + used, size - used, "]");
}

/* The rotation matrix of three rotations about x, y, z in turn. */
static void rotation(const double *a, double r[3][3])
{
    const double cx = cos(a[0]), sx = sin(a[0]), cy = cos(a[1]), sy = sin(a[1]), cz = cos(a[2]), sz = sin(a[2]);
    const double of[3][3] = {{cy * cz, -cy * sz, sy},
                             {cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy},
                             {sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy}};
    memcpy(r, of, sizeof of);
}

/* d, and 2 sin(a/2) about the axis: the axis and the angle from the trace and the skew part. */
static void displacement(const double *q, double x[6])
{
    double r[3][3], n[3], size = 0;
    rotation(q + 3, r);
    for (int i = 0; i < 3; i++) {
        n[i] = r[(i + 2) % 3][(i + 1) % 3] - r[(i + 1) % 3][(i + 2) % 3];
        size = hypot(size, n[i]);
        x[i] = q[i];
    }
    const double angle = acos((r[0][0] + r[1][1] + r[2][2] - 1) / 2);
    for (int i = 0; i < 3; i++)
        x[3 + i] = 2 * sin(angle / 2) * n[i] / size;
}

static double energy(const double *q)
{
    double x[6], v = 0;
    displacement(q, x);
    for (int k = 0; k < 36; k++)
        v += full[k / 6][k % 6] * x[k / 6] * x[k % 6] / 2;
    return v;
}

static void a_symmetric_one_has_a_potential(void)
{
    char matrix[1000], force[1200];
    double bias[6], v, turned[6][6];
    memcpy(turned, full, sizeof full);
    put_matrix(matrix, sizeof matrix, "matrix", turned);
    (void)snprintf(force, sizeof force, "s: {bushing: [ground.O, b.C], %s}", matrix);
    if (!added(force, at, NULL, bias, &v))
        return;
    CHECK_NEAR(v, energy(at), 1e-12);
    for (int k = 0; k < 6; k++) {
        const double h = 1e-3;
        double q[6], f[4];
        for (int i = 0; i < 4; i++) {
            memcpy(q, at, sizeof q);
            q[k] += (i < 2 ? h : 2 * h) * (i % 2 ? 1 : -1);
            f[i] = energy(q);
        }
        CHECK_NEAR(bias[k], (8 * (f[1] - f[0]) - (f[3] - f[2])) / (12 * h), 1e-9);
    }
}

/* The same matrix as nonsymmetric has the same force, and no potential. */
static void a_nonsymmetric_one_has_none(void)
{
    char matrix[1000], force[1200];
    double bias[2][6], v[2], turned[6][6];
    memcpy(turned, full, sizeof full);
    put_matrix(matrix, sizeof matrix, "matrix", turned);
    for (int k = 0; k < 2; k++) {
        (void)snprintf(force, sizeof force, "s: {bushing: [ground.O, b.C], %s%s}", matrix,
                       k ? ", nonsymmetric: yes" : "");
        if (!added(force, at, NULL, bias[k], &v[k]))
            return;
    }
    CHECK(memcmp(bias[0], bias[1], sizeof bias[0]) == 0 && v[0] > 1 && v[1] == 0);
}

/* -- damping ---------------------------------------------------------------------------------------------------- */

/* Of small rotations the angular velocity is the rates of the coordinates: the bias is C qd. */
static void damping_acts_on_the_rates(void)
{
    char matrix[1000], force[1200];
    double bias[6], m[6][6];
    const double rest[6] = {0};
    memcpy(m, full, sizeof full);
    m[0][4] = 11; /* nonsymmetric */
    put_matrix(matrix, sizeof matrix, "damping_matrix", m);
    (void)snprintf(force, sizeof force, "s: {bushing: [ground.O, b.C], %s, nonsymmetric: yes}", matrix);
    if (!added(force, rest, moving, bias, NULL))
        return;
    for (int i = 0; i < 6; i++) {
        double sum = 0;
        for (int j = 0; j < 6; j++)
            sum += m[i][j] * moving[j];
        CHECK_NEAR(bias[i], sum, 1e-13);
    }
}

/* -- whirl ------------------------------------------------------------------------------------------------------- */

/* An oil film with k_xy = -k_yx = c: m z'' = -(k - i c) z of z = x + i y, which grows. The energy that it gives is in
 * the balance. By three formulations. */
static void whirl_in_closed_form(void)
{
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    loaded l =
        load_text("kempe: 1\nparameters: {c: 300}\nground: {points: {O: [0, 0, 0]}}\n"
                  "bodies: {b: {joint: {name: b, planar: z, at: ground}, mass: 2, inertia: {zz: 1}, points: {C: [0, "
                  "0, 0]}}}\n"
                  "forces: {film: {bushing: [ground.O, b.C], nonsymmetric: yes, matrix: [[5000, c, 0, 0, 0, 0], [-c, "
                  "5000, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, "
                  "1]]}}\n"
                  "start: {q: {b.1: 0.01}}\n");
    const double t_end = 1;
    const double complex z = 0.01 * ccos(csqrt((5000 - I * 300) / 2) * t_end);
    for (int k = 0; k < 3; k++) {
        const kempe_run_options options = {
            .formulation = formulations[k], .rtol = 1e-11, .t_end = t_end, .no_convergence_check = 1};
        kempe_trajectory *run = NULL;
        CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_OK);
        if (run) {
            const double *q = kempe_trajectory_q(run, kempe_trajectory_row_count(run) - 1);
            CHECK_NEAR(q[0] / cabs(z), creal(z) / cabs(z), 1e-7);
            CHECK_NEAR(q[1] / cabs(z), cimag(z) / cabs(z), 1e-7);
            CHECK(cabs(z) > 0.02 && run->verdict.drift_rel < 1e-7);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* x of it, by the cross stiffness. */
static void whirls(double c, double end[2])
{
    const double complex w = csqrt((5000 - I * c) / 2);
    end[0] = 0.01 * creal(ccos(w));
    end[1] = 0.01 * creal(-w * csin(w));
}

static void instances_and_derivatives(void)
{
    const char *text =
        "kempe: 1\nparameters: {c: 300}\nground: {points: {O: [0, 0, 0]}}\n"
        "bodies: {b: {joint: {name: b, planar: z, at: ground}, mass: 2, inertia: {zz: 1}, points: {C: [0, 0, "
        "0]}}}\n"
        "forces: {film: {bushing: [ground.O, b.C], nonsymmetric: yes, matrix: [[5000, c, 0, 0, 0, 0], [-c, "
        "5000, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, "
        "1]]}}\n"
        "start: {q: {b.1: 0.01}}\nrun: {t_end: 1, rtol: 1e-11, atol: 1e-13}\n";
    instances_are(text, "c", 300, 0, whirls, 1e-9);
    slopes_are(text, "forward", "q(b.1),qd(b.1)", 300, 1, whirls, 1e-6);
    slopes_are(text, "adjoint", "q(b.1),qd(b.1)", 300, 1, whirls, 1e-6);
}

/* -- what is refused ------------------------------------------------------------------------------------------------
 */

#define UNIT          "[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]"
#define BUSHING(keys) BODY "forces: {s: {bushing: [ground.O, b.C], " keys "}}\n"

static char warning[500];

static void take_warning(void *user, kempe_level level, const char *text)
{
    (void)user;
    if (level == KEMPE_LOG_WARNING && strstr(text, "semidefinite"))
        (void)snprintf(warning, sizeof warning, "%s", text);
}

static void refused(void)
{
    load_rejected(
        BUSHING("matrix: [[2, 1, 0, 0, 0, 0], [0.5, 2, 0, 0, 0, 0], " UNIT),
        "the matrix of force 's' is not symmetric: entry 12 is 1, and entry 21 is 0.5; make them equal, or say "
        "'nonsymmetric: yes'");
    load_rejected(BUSHING("stiffness: 3, matrix: [[2, 1, 0, 0, 0, 0], [1, 2, 0, 0, 0, 0], " UNIT),
                  "force 's': 'stiffness' and a matrix exclude each other");
    load_rejected(BUSHING("rotational_damping: 3, matrix: [[2, 1, 0, 0, 0, 0], [1, 2, 0, 0, 0, 0], " UNIT),
                  "force 's': 'rotational_damping' and a matrix exclude each other");
    load_rejected(BUSHING("nonsymmetric: yes"), "force 's': nonsymmetric belongs to a 'matrix'");
    load_rejected(BUSHING("matrix: [[2, 1, 0, 0, 0], [1, 2, 0, 0, 0, 0], " UNIT),
                  "row 1 of the matrix of force 's' must be a list of 6 items, not 5");
    load_rejected(BUSHING("matrix: [[2, 1, 0, 0, 0, 0], [1, 2, 0, 0, 0, 2 s], " UNIT),
                  "entry 26 of the matrix of force 's': expected N, got s");
    load_rejected(BODY "forces: {s: {spring: [ground.O, b.C], stiffness: 1, matrix: 3}}\n",
                  "the key 'matrix' does not belong");
}

/* [[2, 3], [3, 2]] has the eigenvalues 5 and -1. */
static void indefinite(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_context_set_log(context, take_warning, NULL);
    CHECK(kempe_model_read_text(context, BUSHING("matrix: [[2, 3, 0, 0, 0, 0], [3, 2, 0, 0, 0, 0], " UNIT), "m.yaml",
                                &model) == KEMPE_OK);
    CHECK(strstr(warning,
                 "the matrix of force 's' is not positive semidefinite: its least eigenvalue is -1 in SI units"));
    warning[0] = 0;
    kempe_model_free(model);
    model = NULL;
    CHECK(kempe_model_read_text(context, BUSHING("matrix: [[2, 2, 0, 0, 0, 0], [2, 2, 0, 0, 0, 0], " UNIT), "m.yaml",
                                &model) == KEMPE_OK);
    CHECK(!warning[0]);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* A value of a parameter by which the matrix is no longer symmetric. */
static void varied(void)
{
    loaded l = load_text(BUSHING("matrix: [[2, k, 0, 0, 0, 0], [2e7, 2e14, 0, 0, 0, 0], " UNIT));
    const char *const name = "k";
    const double value = 3;
    kempe_model *other = NULL;
    CHECK(l.model && kmp_variant_instance(l.model, 1, &name, &value, &other) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "force 's': entries 12 and 21 of its matrix differ"));
    kempe_model_free(other);
    unload(&l);
}

int main(void)
{
    TEST(rotor_on_one_bearing);
    TEST(diagonal_ones_are_three_numbers);
    TEST(a_symmetric_one_has_a_potential);
    TEST(a_nonsymmetric_one_has_none);
    TEST(damping_acts_on_the_rates);
    TEST(whirl_in_closed_form);
    TEST(instances_and_derivatives);
    TEST(refused);
    TEST(indefinite);
    TEST(varied);
    return check_report();
}
