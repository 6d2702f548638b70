/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow once 4 */
/* Spherical joints pass every orientation: the maps between charts against differences, tumbling bodies against Euler's
 * closed form, the same motion in angles that never become singular, loops cut elsewhere. */
#include "base/text.h"
#include "constraints/closing/assembly_modes.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/evaluation/charts.h"
#include "loaded.h"
#include "model/data/body.h"
#include "studies/simulate/trajectory.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <kempe/kempe.h>
#include <kempe/stepper.h>
#include <stdbool.h>
#include <stdlib.h>

typedef double matrix[3][3];

/* -- runs -------------------------------------------------------------------------------------------- */

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_trajectory *t;
    kempe_status status;
} scene;

static scene scene_of(const char *text)
{
    loaded l = strchr(text, '\n') ? load_text(text) : load(text);
    return (scene){
        .context = l.context, .model = l.model, .system = l.system, .status = l.system ? KEMPE_OK : KEMPE_E_INPUT};
}

static void scene_free(scene *s)
{
    loaded l = {s->context, s->model, s->system};
    kempe_trajectory_free(s->t);
    unload(&l);
}

/* A formulation "projected", or formulation and form or integrator as "reduced/newton/bdf". */
static kempe_run_options run_of(const char *way, double t_end, double every, double rtol, char room[64])
{
    kempe_run_options run = {0};
    run.t_end = t_end;
    run.output_step = every;
    run.rtol = rtol;
    snprintf(room, 64, "%s", way);
    char *form = strchr(room, '/'), *integrator = form ? strchr(form + 1, '/') : NULL;
    if (form)
        *form++ = '\0';
    if (integrator)
        *integrator++ = '\0';
    run.formulation = room;
    run.form = form && *form ? form : NULL;
    run.integrator = integrator;
    return run;
}

static scene simulate(const char *text, const char *way, double t_end, double every, double rtol)
{
    char room[64];
    kempe_run_options run = run_of(way, t_end, every, rtol, room);
    scene s = scene_of(text);
    if (s.status == KEMPE_OK)
        s.status = kempe_simulate(s.system, &run, &s.t);
    if (s.status != KEMPE_OK)
        printf("%s: %s\n", way, kempe_context_message(s.context));
    return s;
}

static int last(const scene *s)
{
    return s->t ? kempe_trajectory_row_count(s->t) - 1 : -1;
}

/* True at the end of a run whose repeat may differ, where small errors grow: of angles near their singular position,
 * of turns about the axis in the middle. The test has its own bounds of the errors. */
static bool ends(const scene *s)
{
    bool differs = s->status == KEMPE_UNTRUSTED && s->t && strstr(s->t->warnings, "do not trust the motion beyond");
    return s->status == KEMPE_OK || differs;
}

/* -- orientations ------------------------------------------------------------------------------------ */

static void turned(const double e[3], double angle, matrix r)
{
    double s = sin(angle), c = cos(angle);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            r[i][k] = (1 - c) * e[i] * e[k] + (i == k ? c : 0);
    for (int i = 0; i < 3; i++) {
        r[i][(i + 1) % 3] -= s * e[(i + 2) % 3];
        r[i][(i + 2) % 3] += s * e[(i + 1) % 3];
    }
}

static void product(matrix a, matrix b, matrix out)
{
    matrix r = {{0}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                r[i][j] += a[i][k] * b[k][j];
    memcpy(out, r, sizeof r);
}

/* Rotation matrix of three rotations from motion `first` on, and the angular velocity before them. */
static void orientation(const kempe_model *model, int first, const double *q, const double *qd, matrix r, double w[3])
{
    matrix one = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, step;
    memcpy(r, one, sizeof one);
    memset(w, 0, 3 * sizeof *w);
    for (int k = first; k < first + 3; k++) {
        const double *e = kmp_model_motion(model, k)->axis;
        for (int i = 0; i < 3; i++)
            w[i] += qd[k] * (r[i][0] * e[0] + r[i][1] * e[1] + r[i][2] * e[2]);
        turned(e, q[k], step);
        product(r, step, r);
    }
}

static void in_body(matrix r, const double w[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = r[0][i] * w[0] + r[1][i] * w[1] + r[2][i] * w[2];
}

static double worst(int n, const double *a, const double *b)
{
    double most = 0;
    for (int k = 0; k < n; k++)
        most = check_max(most, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
    return most;
}

/* -- the maps ---------------------------------------------------------------------------------------- */

static double number(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 23) - 1;
}

static const struct {
    const char *joint;
    bool before; /* where its chart stands */
} sequences[] = {{"spherical: z, at: ground", true},
                 {"motions: [R3, R1, R3], at: ground", true},
                 {"free: y, at: ground", true},
                 {"motions: [R1, T1, {R: [1, 2, 2]}, {R: [2, 1, -2]}, {R: [2, -2, 1]}], at: ground", false},
                 {"motions: [R1, T1, {R: [1, 2, 2]}, {R: [2, 1, -2]}, {R: [1, 2, 2]}], at: ground", false}};
enum { SEQUENCES = sizeof sequences / sizeof *sequences };

static scene body_on(const char *joint)
{
    kmp_text text = {0};
    kmp_text_printf(&text,
                    "kempe: 1\nbodies: {a: {joint: {name: J, %s}, mass: 1, com: [0.1, 0.2, 0.3], inertia: {xx: 1, yy: "
                    "2, zz: 2.5, xy: 0.1}}}\n",
                    joint);
    scene s = scene_of(text.s);
    kmp_text_free(&text);
    return s;
}

/* Rotation and angular velocity of the joint in a chart. */
static void whole(const scene *s, const double *chart, const double *q, const double *qd, matrix r, double w[3])
{
    matrix c;
    double v[3];
    memcpy(c, chart, sizeof c);
    orientation(s->model, s->system->chart_first[0], q, qd, r, w);
    if (!s->system->chart_before[0]) {
        product(r, c, r);
        return;
    }
    product(c, r, r);
    for (int i = 0; i < 3; i++)
        v[i] = c[i][0] * w[0] + c[i][1] * w[1] + c[i][2] * w[2];
    memcpy(w, v, sizeof v);
}

/* The angular acceleration of the motion q + h qd + h^2/2 qdd in a chart, by differences. */
static void acceleration(const scene *s, const double *chart, const double *q, const double *qd, const double *qdd,
                         double wd[3])
{
    const double h = 1e-6;
    double at[6], rate[6], w[2][3];
    matrix r;
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < s->system->n; i++) {
            at[i] = q[i] + (side ? h : -h) * qd[i];
            rate[i] = qd[i] + (side ? h : -h) * qdd[i];
        }
        whole(s, chart, at, rate, r, w[side]);
    }
    for (int i = 0; i < 3; i++)
        wd[i] = (w[1][i] - w[0][i]) / (2 * h);
}

/* Centring leaves the rotation, its rate and its acceleration alone; going back to the user's angles does too. */
static void check_maps(const scene *s, unsigned *state)
{
    int n = s->system->n, first = s->system->chart_first[0];
    double q[6], qd[6], qdd[6], chart[9], q0[6], qd0[6], qdd0[6], w[3], w0[3], wd[3], wd0[3];
    matrix r, r0;
    kmp_charts_reset(s->system, chart);
    for (int pass = 0; pass < 2; pass++) { /* from the user's chart, and on from another one */
        for (int i = 0; i < n; i++) {
            q[i] = q0[i] = 3 * number(state);
            qd[i] = qd0[i] = number(state);
            qdd[i] = qdd0[i] = number(state);
        }
        whole(s, chart, q, qd, r0, w0);
        acceleration(s, chart, q, qd, qdd, wd0);
        double regular = kmp_chart_regular(s->system, 0, q);
        kmp_chart_center(s->system, 0, chart, q, qd, qdd);
        whole(s, chart, q, qd, r, w);
        acceleration(s, chart, q, qd, qdd, wd);
        CHECK(worst(9, &r[0][0], &r0[0][0]) < 4e-15 && worst(3, w, w0) < 2e-14 && worst(3, wd, wd0) < 1e-8);
        CHECK_NEAR(kmp_chart_regular(s->system, 0, q), 1, 1e-15);
        CHECK(q[s->system->chart_before[0] ? first : first + 2] == 0 && !kmp_chart_is_own(chart, 0));
        CHECK(fabs(qd[first + 1]) < 1e-14); /* about the outer axes alone */
        if (pass > 0 || regular < 0.05)
            continue;
        double far = kmp_chart_show(s->system, 0, chart, q0 + first, q, qd, qdd);
        CHECK(far < 1e-13 && worst(n, q, q0) < 1e-13 && worst(n, qd, qd0) < 1e-12 && worst(n, qdd, qdd0) < 1e-10);
    }
}

static void test_maps(void)
{
    unsigned state = 7;
    for (int k = 0; k < SEQUENCES; k++) {
        scene s = body_on(sequences[k].joint);
        CHECK(s.status == KEMPE_OK && s.system->chart_count == 1);
        CHECK(s.system->chart_before[0] == sequences[k].before);
        for (int trial = 0; trial < 50; trial++)
            check_maps(&s, &state);
        scene_free(&s);
    }
}

/* At the singular angles themselves the rates that they allow come back, the least ones, and all is finite. */
static void test_singular_map(void)
{
    scene s = body_on(sequences[0].joint);
    double q[3] = {0.3, 1.5707963267948966, -0.4}, qd[3] = {0, 2, 0}, chart[9], shown[3], rate[3], qdd[3] = {1, 2, 3};
    matrix r, a;
    double w[3], v[3];
    kmp_charts_reset(s.system, chart);
    whole(&s, chart, q, qd, r, w);
    memcpy(shown, q, sizeof q);
    memcpy(rate, qd, sizeof qd);
    kmp_chart_center(s.system, 0, chart, shown, rate, NULL);
    (void)kmp_chart_show(s.system, 0, chart, q, shown, rate, qdd);
    CHECK(worst(3, shown, q) < 1e-15 && worst(3, rate, qd) < 1e-14);
    CHECK(isfinite(qdd[0]) && isfinite(qdd[1]) && isfinite(qdd[2]));
    double other[3] = {0, 0, 0}, spin[3] = {1, 0, 1}; /* across the plane that the axes span there */
    kmp_chart_center(s.system, 0, chart, other, spin, NULL);
    (void)kmp_chart_show(s.system, 0, chart, q, other, spin, qdd);
    whole(&s, chart, other, spin, a, v);
    for (int i = 0; i < 3; i++)
        CHECK(isfinite(other[i]) && isfinite(spin[i]) && isfinite(qdd[i]));
    scene_free(&s);
}

/* Who asks for an angle keeps the joint as it is. */
static void test_who_is_centred(void)
{
    static const struct {
        const char *more;
        int charts;
    } cases[] = {{"", 1},
                 {"forces: {f: {joint: J.2, spring: {stiffness: 1}}}\n", 0},
                 {"forces: {f: {joint: J.2, torque: 1}}\n", 0},
                 {"forces: {f: {on: a, torque: [0, 0, -qd(J.1)]}}\n", 0},
                 {"drives: {d: {joint: J.3, angle: 0}}\n", 0},
                 {"sensors: {s: q(J.1)}\n", 0},
                 {"loops: {c: {constraint: \"q(J.1) + q(J.3)\"}}\n", 0},
                 {"run: {outputs: [q(J.2)]}\n", 1}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\nbodies: {a: {joint: {name: J, spherical: z, at: ground}, mass: 1, inertia: {xx: 1, "
                        "yy: 1, zz: 1}}}\n%s",
                        cases[k].more);
        scene s = scene_of(text.s);
        CHECK(s.status == KEMPE_OK);
        if (s.system && s.system->chart_count != cases[k].charts)
            printf("%s", cases[k].more);
        CHECK(s.system && s.system->chart_count == cases[k].charts);
        scene_free(&s);
        kmp_text_free(&text);
    }
    scene oblique = body_on("motions: [R3, {R: [1, 0, 1]}, R1], at: ground");
    CHECK(oblique.system && oblique.system->chart_count == 0);
    scene_free(&oblique);
}

/* -- a body that tumbles ----------------------------------------------------------------------------- */

/* Jacobi's functions by the arithmetic-geometric mean (Abramowitz and Stegun, 16.4). */
static void jacobi(double u, double m, double *sn, double *cn, double *dn)
{
    double a[16] = {1}, c[16] = {sqrt(m)}, b = sqrt(1 - m);
    int n = 0;
    for (; n < 15 && fabs(c[n]) > 1e-16; n++) {
        a[n + 1] = (a[n] + b) / 2;
        c[n + 1] = (a[n] - b) / 2;
        b = sqrt(a[n] * b);
    }
    double phi = ldexp(a[n] * u, n), before = phi;
    for (; n > 0; n--) {
        before = phi;
        phi = (phi + asin(c[n] / a[n] * sin(phi))) / 2;
    }
    *sn = sin(phi);
    *cn = cos(phi);
    *dn = fabs(cos(before - phi)) > 0.1 ? *cn / cos(before - phi) : sqrt(1 - m * *sn * *sn);
}

/* Angular velocity in the axes of a body of inertia (i1 < i2 < i3) that begins with (w1, 0, w3) and L^2 > 2 E i2
 * (Landau and Lifshitz, Mechanics, 37). */
static void euler(const double inertia[3], double w1, double w3, double t, double w[3])
{
    double i1 = inertia[0], i2 = inertia[1], i3 = inertia[2];
    double e2 = i1 * w1 * w1 + i3 * w3 * w3, l2 = i1 * i1 * w1 * w1 + i3 * i3 * w3 * w3, sn, cn, dn;
    double m = (i2 - i1) * (e2 * i3 - l2) / ((i3 - i2) * (l2 - e2 * i1));
    jacobi(t * sqrt((i3 - i2) * (l2 - e2 * i1) / (i1 * i2 * i3)), m, &sn, &cn, &dn);
    w[0] = w1 * cn;
    w[1] = sqrt((e2 * i3 - l2) / (i2 * (i3 - i2))) * sn;
    w[2] = w3 * dn;
}

static const double inertia[3] = {1, 2, 3}, first_w[3] = {1.9, 0, 1.25}; /* the axis of 2 flips over */

/* Errors of the angular velocity in the body and of L in space, over all rows. */
static void tumbling_error(const scene *s, double *spin, double *momentum)
{
    int first = s->system->chart_first[0];
    double l0[3];
    *spin = *momentum = 0;
    for (int row = 0; row <= last(s); row++) {
        matrix r;
        double w[3], in[3], expected[3], l[3] = {0};
        orientation(s->model, first, kempe_trajectory_q(s->t, row), kempe_trajectory_qd(s->t, row), r, w);
        in_body(r, w, in);
        euler(inertia, first_w[0], first_w[2], kempe_trajectory_time(s->t, row), expected);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                l[i] += r[i][k] * inertia[k] * in[k];
        if (row == 0)
            memcpy(l0, l, sizeof l);
        *spin = fmax(*spin, worst(3, in, expected));
        *momentum = fmax(*momentum, worst(3, l, l0));
    }
}

static void test_tumbling(void)
{
    static const struct {
        const char *joint, *start;
    } joints[] = {{"spherical: x, at: ground", "qd: {J.1: 1.9, J.2: 0, J.3: 1.25}"},
                  {"free: x, at: ground", "qd: {J.4: 1.9, J.5: 0, J.6: 1.25}"},
                  {"motions: [R3, R1, R3], at: ground", "qd: {J.1: 0, J.2: 1.9, J.3: 1.25}"}}; /* singular there */
    static const struct {
        const char *way;
        double rtol, allowed;
    } savings[] = {{"reduced/integrated", 1e-12, 2e-10},   {"reduced/newton", 1e-12, 2e-10},
                   {"reduced/newton/adams", 1e-11, 1e-6},  {"reduced/newton/bdf", 1e-9, 1e-4},
                   {"reduced/newton/radau5", 1e-9, 1e-5},  {"reduced/newton/radau9", 1e-9, 1e-5},
                   {"reduced/newton/dirk", 1e-8, 1e-4},    {"projected/none/dop853", 1e-12, 2e-10},
                   {"projected/none/radau", 1e-13, 2e-10}, {"reduced/integrated/radau", 1e-13, 2e-10},
                   {"dae/stabilized1", 1e-10, 2e-5},       {"dae/ggl", 1e-9, 1e-4}};
    for (size_t j = 0; j < sizeof joints / sizeof *joints; j++)
        for (size_t k = 0; k < sizeof savings / sizeof *savings; k++) {
            kmp_text text = {0};
            double spin, momentum;
            kmp_text_printf(
                &text,
                "kempe: 1\nbodies: {a: {joint: {name: J, %s}, mass: 1, inertia: {xx: 1, yy: 2, zz: 3}}}\nstart: {%s}\n",
                joints[j].joint, joints[j].start);
            scene s = simulate(text.s, savings[k].way, 30, 0.1, savings[k].rtol);
            CHECK(ends(&s) && last(&s) == 300);
            if (s.t) {
                tumbling_error(&s, &spin, &momentum);
                if (getenv("CHARTS_PRINT"))
                    printf("%-20s %-24s w %.2e L %.2e energy %.2e centred %ld steps %ld\n", joints[j].joint,
                           savings[k].way, spin, momentum, s.t->verdict.drift_rel, s.t->report.centrings,
                           s.t->report.steps);
                CHECK(spin < savings[k].allowed && momentum < savings[k].allowed &&
                      s.t->verdict.drift_rel < savings[k].allowed);
                CHECK(s.t->report.centrings > 0);
            }
            scene_free(&s);
            kmp_text_free(&text);
        }
}

/* -- the same in other angles ------------------------------------------------------------------------- */

/* A heavy top that begins upright below its ball with the angular velocity w: the angles of axis a, which some sensor
 * keeps as they are when it is to. */
static void top_text(kmp_text *text, char a, const double w[3], bool kept)
{
    int first = a - 'x';
    kmp_text_printf(text,
                    "kempe: 1\ngravity: [0, 0, -9.81]\n"
                    "bodies: {a: {joint: {name: J, spherical: %c, at: ground}, mass: 1, com: [0, 0.02, -0.5], "
                    "inertia: {xx: 0.1, yy: 0.12, zz: 0.05}}}\nstart: {qd: {J.1: %.17g, J.2: %.17g, J.3: %.17g}}\n%s",
                    a, w[first], w[(first + 1) % 3], w[(first + 2) % 3], kept ? "sensors: {s: q(J.2)}\n" : "");
}

static void end_of(const scene *s, matrix r, double w[3])
{
    orientation(s->model, 0, kempe_trajectory_q(s->t, last(s)), kempe_trajectory_qd(s->t, last(s)), r, w);
}

/* z, x, y are singular where the body has turned by 90 degrees about x; x, y, z are far from it there. */
static void test_through_singular_angles(void)
{
    static const double spins[2][3] = {{9, 0, 0}, {9, 0.3, 0.4}};
    static const struct {
        const char *way;
        double rtol, allowed;
    } savings[] = {{"reduced", 1e-12, 1e-10},
                   {"reduced/newton/dopri5", 1e-10, 1e-8},
                   {"projected", 1e-12, 1e-10},
                   {"reduced/newton/erk", 1e-11, 1e-8},
                   {"dae/stabilized1", 1e-10, 1e-6},
                   {"dae/index1/ida", 1e-9, 1e-5},
                   {"dae", 1e-12, 1e-10}};
    for (int k = 0; k < 2; k++) {
        kmp_text kept = {0}, text = {0};
        matrix expected, r;
        double v[3], w[3];
        top_text(&kept, 'x', spins[k], true);
        top_text(&text, 'z', spins[k], false);
        scene other = simulate(kept.s, "projected", 1, 0.1, 1e-13);
        CHECK(other.status == KEMPE_OK && other.t && other.t->report.centrings == 0);
        if (other.t)
            end_of(&other, expected, v);
        for (size_t i = 0; other.t && i < sizeof savings / sizeof *savings; i++) {
            scene s = simulate(text.s, savings[i].way, 1, 0.1, savings[i].rtol);
            CHECK(s.status == KEMPE_OK && s.t && s.t->report.centrings > 0);
            if (s.status == KEMPE_OK) {
                end_of(&s, r, w);
                if (getenv("CHARTS_PRINT"))
                    printf("%-24s R %.2e w %.2e energy %.2e centred %ld steps %ld (%ld)\n", savings[i].way,
                           worst(9, &r[0][0], &expected[0][0]), worst(3, w, v), s.t->verdict.drift_rel,
                           s.t->report.centrings, s.t->report.steps, other.t->report.steps);
                CHECK(strstr(s.t->log.entries[0].text, "inner angles of joint 'J' chosen again"));
                CHECK(worst(9, &r[0][0], &expected[0][0]) < savings[i].allowed);
                CHECK(worst(3, w, v) < 10 * savings[i].allowed);
                CHECK(s.t->verdict.drift_rel < 10 * savings[i].allowed);
            }
            scene_free(&s);
        }
        scene_free(&other);
        kmp_text_free(&kept);
        kmp_text_free(&text);
    }
}

/* A body on springs that carries a wheel: its chart stands behind its rotations, and both move as in other angles. */
static void carrier_text(kmp_text *text, char a, bool kept)
{
    const double w[3] = {9, 0.3, 0.4};
    int first = a - 'x';
    kmp_text_printf(
        text,
        "kempe: 1\ngravity: [0, 0, -9.81]\n"
        "ground: {points: {A: [1, 0.2, 1], B: [-1, 0, 1]}}\n"
        "bodies:\n"
        "  a: {joint: {name: J, spherical: %c, at: ground}, mass: 1, com: [0.05, 0.02, -0.5], inertia: {xx: "
        "0.1, yy: 0.12, zz: 0.05, xy: 0.01}, points: {P: [0.2, 0, 0], Q: [-0.3, 0, 0.1], W: {at: [0.1, 0, "
        "-0.3], axes: {z: [1, 2, 2], x: [2, 1, -2]}}}}\n"
        "  b: {joint: {name: W, revolute: [1, 0, 1], at: a.W}, mass: 0.5, com: [0.1, 0, 0.05], inertia: {xx: "
        "0.02, yy: 0.02, zz: 0.03}, points: {R: [0.1, 0.1, 0]}}\n"
        "forces:\n"
        "  f: {spring: [ground.A, a.P], stiffness: 3, damping: 0.1}\n"
        "  g: {spring: [ground.B, a.Q], stiffness: 2}\n"
        "  h: {spring: [a.Q, b.R], stiffness: 2}\n"
        "  i: {at: a.P, force: [0.1, 0.2, 0.1]}\n"
        "start: {qd: {J.1: %.17g, J.2: %.17g, J.3: %.17g, W: 2}}\n%s",
        a, w[first], w[(first + 1) % 3], w[(first + 2) % 3], kept ? "sensors: {s: q(J.2)}\n" : "");
}

static void test_carrier(void)
{
    static const char *const savings[] = {"reduced", "projected", "reduced/newton/bdf", "dae/stabilized1"};
    static const double allowed[] = {1e-9, 1e-9, 1e-4, 1e-5}, rtol[] = {1e-12, 1e-12, 1e-9, 1e-10};
    kmp_text kept = {0}, text = {0};
    matrix expected, r;
    double v[3], w[3];
    carrier_text(&kept, 'x', true);
    carrier_text(&text, 'z', false);
    scene other = simulate(kept.s, "projected", 1, 0.1, 1e-13);
    CHECK(other.status == KEMPE_OK);
    for (int i = 0; other.t && i < 4; i++) {
        scene s = simulate(text.s, savings[i], 1, 0.1, rtol[i]);
        CHECK(s.status == KEMPE_OK && !s.system->chart_before[0] && s.t && s.t->report.centrings > 0);
        if (s.status == KEMPE_OK) {
            end_of(&other, expected, v);
            end_of(&s, r, w);
            const double *q = kempe_trajectory_q(s.t, last(&s)), *p = kempe_trajectory_q(other.t, last(&other));
            if (getenv("CHARTS_PRINT"))
                printf("%-24s R %.2e w %.2e wheel %.2e energy %.2e centred %ld\n", savings[i],
                       worst(9, &r[0][0], &expected[0][0]), worst(3, w, v), fabs(q[3] - p[3]), s.t->verdict.drift_rel,
                       s.t->report.centrings);
            CHECK(worst(9, &r[0][0], &expected[0][0]) < allowed[i] && worst(3, w, v) < 10 * allowed[i]);
            CHECK(fabs(q[3] - p[3]) < allowed[i] && s.t->verdict.drift_rel < allowed[i]);
        }
        scene_free(&s);
    }
    scene_free(&other);
    kmp_text_free(&kept);
    kmp_text_free(&text);
}

/* Output coordinates are continuous and do not depend on how often they are read; the stepper gives the same
 * numbers. */
static void test_angles_go_on(void)
{
    static const double spins[2][3] = {{9, 0, 0}, {9, 0.3, 0.4}};
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        top_text(&text, 'z', spins[k], false);
        scene fine = simulate(text.s, "reduced", 3, 2e-4, 1e-11), coarse = simulate(text.s, "reduced", 3, 0.5, 1e-11);
        CHECK(ends(&fine) && coarse.status == KEMPE_OK);
        int rows = last(&fine) + 1;
        for (int row = 1; row < rows; row++) {
            const double *a = kempe_trajectory_q(fine.t, row - 1), *b = kempe_trajectory_q(fine.t, row);
            const double *ad = kempe_trajectory_qd(fine.t, row - 1), *bd = kempe_trajectory_qd(fine.t, row);
            for (int i = 0; i < 3; i++) /* as far as the rates go, but for how they change within */
                CHECK(fabs(b[i] - a[i] - 1e-4 * (ad[i] + bd[i])) < 1e-4 + 1e-4 * fabs(bd[i] - ad[i]));
        }
        for (int row = 0; row <= last(&coarse); row++)
            CHECK(memcmp(kempe_trajectory_q(coarse.t, row), kempe_trajectory_q(fine.t, 2500 * row),
                         3 * sizeof(double)) == 0);
        if (k == 0) { /* in its plane it turns over and over */
            const double *q = kempe_trajectory_q(fine.t, rows - 1);
            CHECK(q[1] > 12 && fabs(q[0]) < 1e-8 && fabs(q[2]) < 1e-8);
        }
        kempe_stepper *stepper = NULL;
        char room[64];
        kempe_run_options run = run_of("reduced", 3, 0.5, 1e-11, room);
        run.output_step = 0;
        CHECK(kempe_stepper_new(fine.system, &run, &stepper) == KEMPE_OK);
        for (int row = 0; stepper && row <= last(&coarse); row++) {
            CHECK(kempe_stepper_advance(stepper, kempe_trajectory_time(coarse.t, row)) == KEMPE_OK);
            CHECK(memcmp(kempe_stepper_q(stepper), kempe_trajectory_q(coarse.t, row), 3 * sizeof(double)) == 0);
            CHECK(memcmp(kempe_stepper_qd(stepper), kempe_trajectory_qd(coarse.t, row), 3 * sizeof(double)) == 0);
            CHECK(memcmp(kempe_stepper_qdd(stepper), kempe_trajectory_qdd(coarse.t, row), 3 * sizeof(double)) == 0);
        }
        kempe_stepper_free(stepper);
        scene_free(&fine);
        scene_free(&coarse);
        kmp_text_free(&text);
    }
}

/* A flywheel turns many times within a step, about an axis of the angles by which it is integrated: they are linear in
 * time, and the same for any number of rows. */
static void test_many_turns_in_a_step(void)
{
    static const char TEXT[] = "kempe: 1\ngravity: [0, 0, 0]\nbodies: {a: {joint: {name: J, spherical: z, at: ground}, "
                               "mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}}}\n"
                               "start: {q: {J.2: 1.5}, qd: {J.3: 100}}\n";
    static const char *const ways[] = {"reduced/integrated/dop853", "reduced/integrated/radau", "projected"};
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        scene fine = simulate(TEXT, ways[k], 1, 1e-3, 1e-6), coarse = simulate(TEXT, ways[k], 1, 1, 1e-6);
        CHECK(ends(&fine) && ends(&coarse));
        const double *a = kempe_trajectory_q(fine.t, last(&fine)), *b = kempe_trajectory_q(coarse.t, last(&coarse));
        CHECK(fabs(b[2] - 100) < 1e-3 && memcmp(a, b, 3 * sizeof *a) == 0);
        scene_free(&fine);
        scene_free(&coarse);
    }
}

/* Past the singular position by some 1e-4 rad, from one step to the next: the second angle turns back before it, while
 * the others turn by half a turn. */
static void test_turns_back(void)
{
    static const double spin[3] = {9, 1e-3, 0};
    kmp_text text = {0};
    top_text(&text, 'z', spin, false);
    scene s = simulate(text.s, "reduced", 1, 0.05, 1e-10);
    CHECK(s.status == KEMPE_OK && s.t && s.t->report.centrings > 0);
    double most = 0, turned_by = 0;
    for (int row = 0; row <= last(&s); row++) {
        most = check_max(most, fabs(kempe_trajectory_q(s.t, row)[1]));
        turned_by = check_max(turned_by, fabs(kempe_trajectory_q(s.t, row)[0]));
    }
    CHECK(most > 1.2 && most < 1.5707963267948966 && turned_by > 3);
    scene_free(&s);
    kmp_text_free(&text);
}

/* A run that goes on from a checkpoint behind a centring ends where the whole run does, its angles included. */
static void test_resume(void)
{
    static const double spin[3] = {9, 0.3, 0.4};
    char path[] = "charts.checkpoint", room[64];
    kmp_text text = {0};
    top_text(&text, 'z', spin, false);
    scene whole_run = simulate(text.s, "reduced", 2, 0.1, 1e-12), half = scene_of(text.s), rest = scene_of(text.s);
    kempe_run_options run = run_of("reduced", 0.9, 0.1, 1e-12, room);
    run.checkpoint = path;
    CHECK(kempe_simulate(half.system, &run, &half.t) == KEMPE_OK && half.t->report.centrings > 0);
    run.checkpoint = NULL;
    run.resume = path;
    run.t_end = 2;
    CHECK(kempe_simulate(rest.system, &run, &rest.t) == KEMPE_OK && rest.t->report.centrings > 0);
    CHECK(last(&rest) == last(&whole_run));
    for (int row = 0; rest.t && whole_run.t && row <= last(&rest); row++) {
        CHECK(worst(3, kempe_trajectory_q(rest.t, row), kempe_trajectory_q(whole_run.t, row)) < 1e-9);
        CHECK(worst(3, kempe_trajectory_qd(rest.t, row), kempe_trajectory_qd(whole_run.t, row)) < 1e-7);
    }
    CHECK(rest.t && rest.t->verdict.drift_rel < 1e-10);
    (void)remove(path);
    scene_free(&whole_run);
    scene_free(&half);
    scene_free(&rest);
    kmp_text_free(&text);
}

/* -- loops ------------------------------------------------------------------------------------------- */

/* A spatial four-bar of two balls: the coupler hangs on the crank's or on the rocker's. The crank is driven from rest,
 * two turns. */
static const char four_bar[] =
    "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {R: [1, 0, 0]}}\n"
    "bodies:\n"
    "  crank: {joint: {name: C, revolute: z, at: ground}, mass: 1, inertia: {xx: 0.01, yy: 0.01, zz: 0.02}, points: "
    "{P: "
    "[0.2, 0, 0]}}\n"
    "  rocker: {joint: {name: R, revolute: y, at: ground.R}, mass: 1, com: [0, 0, 0.3], inertia: {xx: 0.03, yy: 0.03, "
    "zz: 0.01}, points: {Q: [0, 0, 0.6]}}\n"
    "  coupler: {joint: {name: B, %s}, mass: 1, com: [%s], "
    "inertia: {xx: 0.0424, yy: 0.1, zz: 0.0676, xz: -0.0432}, points: {E: [%s]}}\n"
    "loops: {K: {ball: [coupler.E, %s]}}\n"
    "%s";

static void loop_text(kmp_text *text, const char *joint, bool on_crank, const char *more)
{
    kmp_text_printf(text, four_bar, joint, on_crank ? "0.4, 0, 0.3" : "-0.4, 0, -0.3",
                    on_crank ? "0.8, 0, 0.6" : "-0.8, 0, -0.6", on_crank ? "rocker.Q" : "crank.P", more);
}

static void test_loop(void)
{
    static const char driven[] = "drives: {d: {joint: C, angle: 3*t^2}}\n";
    static const char falling[] = "start: {q: {C: 0.3}, hold: [C]}\nforces: {f: {on: crank, torque: [0, 0, 2]}}\n";
    static const struct {
        const char *way;
        double rtol, allowed;
    } savings[] = {{"reduced/integrated", 1e-11, 1e-8},
                   {"reduced/newton", 1e-11, 1e-8},
                   {"projected", 1e-11, 1e-8},
                   {"reduced/newton/adams", 1e-11, 1e-6},
                   {"dae/stabilized1", 1e-10, 1e-5}};
    for (int moves = 0; moves < 2; moves++) {
        const char *more = moves ? falling : driven;
        kmp_text cut = {0}, text = {0};
        loop_text(&cut, "spherical: x, at: rocker.Q", false, more);
        loop_text(&text, "spherical: y, at: crank.P", true, more);
        scene other = simulate(cut.s, "projected", 2, 0.1, 1e-12);
        for (size_t i = 0; i < sizeof savings / sizeof *savings; i++) {
            scene s = simulate(text.s, savings[i].way, 2, 0.1, savings[i].rtol);
            CHECK(ends(&s) && other.status == KEMPE_OK);
            if (ends(&s) && other.status == KEMPE_OK) {
                double q = 0, qd = 0;
                for (int row = 0; row <= last(&s); row++) {
                    q = check_max(q, worst(2, kempe_trajectory_q(s.t, row), kempe_trajectory_q(other.t, row)));
                    qd = check_max(qd, worst(2, kempe_trajectory_qd(s.t, row), kempe_trajectory_qd(other.t, row)));
                }
                if (getenv("CHARTS_PRINT"))
                    printf("%d %-24s q %.2e qd %.2e energy %.2e h %.2e centred %ld (%ld) steps %ld (%ld)\n", moves,
                           savings[i].way, q, qd, s.t->verdict.drift_rel, s.t->verdict.h_max, s.t->report.centrings,
                           other.t->report.centrings, s.t->report.steps, other.t->report.steps);
                CHECK(q < savings[i].allowed && qd < 30 * savings[i].allowed && s.t->report.centrings > 0);
                CHECK(s.t->verdict.drift_rel < 10 * savings[i].allowed && s.t->verdict.h_max < 1e-10 + savings[i].rtol);
            }
            scene_free(&s);
        }
        scene_free(&other);
        kmp_text_free(&cut);
        kmp_text_free(&text);
    }
}

/* -- starts at singular angles ----------------------------------------------------------------------- */

/* The start is rough and just where the ball's angles are singular: it is assembled, and moves as from elsewhere. */
static void test_singular_start(void)
{
    static const char more[] = "start: {q: {C: -pi/2, R: -0.3, B.1: 0.1, B.2: pi/2, B.3: -0.05}, hold: [C]}\n";
    kmp_text cut = {0}, text = {0};
    loop_text(&cut, "spherical: x, at: rocker.Q", false, "start: {q: {C: -pi/2, R: -0.3}, hold: [C]}\n");
    loop_text(&text, "spherical: y, at: crank.P", true, more);
    scene other = simulate(cut.s, "reduced", 1, 0.1, 1e-12), s = simulate(text.s, "reduced", 1, 0.1, 1e-12);
    CHECK(s.status == KEMPE_OK && other.status == KEMPE_OK);
    for (int row = 0; s.t && other.t && row <= last(&s); row++)
        CHECK(worst(2, kempe_trajectory_q(s.t, row), kempe_trajectory_q(other.t, row)) < 1e-9);
    kempe_check *check = NULL;
    CHECK(s.system && kempe_check_new(s.system, &check) == KEMPE_OK);
    kempe_check_free(check);
    scene_free(&s);
    scene_free(&other);
    kmp_text_free(&cut);
    kmp_text_free(&text);
}

/* The spatial slider-crank with its rod on the crank by angles that are singular at the start: z, x, z. */
static const char singular_rod[] =
    "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {A: [0, 0.1, 0.12], X: [0.2, 0, 0]}}\n"
    "bodies:\n"
    "  crank: {joint: {name: A, revolute: x, at: ground.A}, mass: 0.12, inertia: {xx: 1e-4, yy: 1e-5, zz: 1e-4}, "
    "points: {P: [0, 0, 0.08]}}\n"
    "  slider: {joint: {name: S, prismatic: x, at: ground.X}, mass: 2, points: {U: [0, 0, 0]}}\n"
    "  rod: {joint: {name: B, motions: [R3, R1, R3], at: crank.P}, mass: 0.5, com: [0.1, -0.05, -0.1], inertia: {xx: "
    "0.0024, yy: 0.0036, zz: 0.0024, xy: 0.0008, xz: 0.0016, yz: -0.0008}, points: {E: [0.2, -0.1, -0.2]}}\n"
    "loops: {U: {universal: [slider.U, rod.E], axes: [z, [-1, -2, 0]]}}\n"
    "start: {qd: {A: 6}, hold: [A]}\n";

/* Its published digits; rank, modes and limits are those of the mechanism, not of its angles. */
static void test_singular_loop(void)
{
    scene s = simulate(singular_rod, "reduced", 2, 0.1, 1e-13);
    kempe_check *check = NULL;
    kempe_branches *branches = NULL;
    CHECK(s.status == KEMPE_OK);
    if (s.status == KEMPE_OK) {
        CHECK_NEAR(kempe_trajectory_q(s.t, last(&s))[0], 20.1566346080908167, 1e-10);
        CHECK_NEAR(kempe_trajectory_qd(s.t, last(&s))[0], 9.39187990729243264, 1e-10);
        CHECK(kempe_check_new(s.system, &check) == KEMPE_OK && check->part.r == 4);
        CHECK(kempe_branches_new(s.system, 1, &branches) == KEMPE_OK);
    }
    if (check && branches) {
        const kmp_limits *limits = &check->diagnosis.limits;
        CHECK(limits->cycle && abs(limits->range[0].turns) == 1 && limits->range[2].unseen);
        CHECK_NEAR(limits->range[1].low, -0.0150481115611, 1e-10);
        CHECK(branches->kept[0] && !branches->kept[2] && !branches->kept[3] && !branches->kept[4]);
        CHECK(kempe_branches_count(branches) == 4);
    }
    kempe_branches_free(branches);
    kempe_check_free(check);
    scene_free(&s);
}

/* The rows written otherwise, x + 180 degrees, 180 degrees - y, z - 180 degrees: no error. */
static void test_compared_words(void)
{
    static const double spin[3] = {9, 0.3, 0.4}, pi = 3.14159265358979324;
    kmp_text text = {0};
    top_text(&text, 'x', spin, false);
    scene s = simulate(text.s, "reduced", 1, 0.1, 1e-11);
    double t[11], values[3][33];
    kmp_reference reference = {.rows = 11, .t = t, .value = {values[0], values[1], values[2], NULL}};
    CHECK(s.status == KEMPE_OK && last(&s) == 10);
    for (int row = 0; s.t && row <= last(&s); row++) {
        const double *q = kempe_trajectory_q(s.t, row), *qd = kempe_trajectory_qd(s.t, row);
        const double *qdd = kempe_trajectory_qdd(s.t, row);
        t[row] = kempe_trajectory_time(s.t, row);
        for (int i = 0; i < 3; i++) {
            values[0][3 * row + i] = i == 1 ? pi - q[1] : q[i] + (i == 0 ? pi : -pi);
            values[1][3 * row + i] = i == 1 ? -qd[1] : qd[i];
            values[2][3 * row + i] = i == 1 ? -qdd[1] : qdd[i];
        }
    }
    kmp_evaluator *eval = kmp_eval_new(s.system, "tape");
    kmp_verdict verdict = kmp_verdict_of(&s.t->table, eval, &reference);
    for (int k = 0; k < 3; k++)
        CHECK(verdict.error[k] < 1e-11);
    values[0][32] += 1e-3; /* an error stays one */
    verdict = kmp_verdict_of(&s.t->table, eval, &reference);
    CHECK(verdict.error[0] > 1e-5 && verdict.error[0] < 1e-2);
    kmp_eval_free(eval);
    scene_free(&s);
    kmp_text_free(&text);
}

static int no_effort(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user, (void)t, (void)q, (void)qd, (void)effort;
    return 0;
}

/* A force of the user's own sees the coordinates: they stay. */
static void test_users_force(void)
{
    static const double spin[3] = {9, 0.3, 0.4};
    kmp_text text = {0};
    char room[64];
    kempe_run_options run = run_of("reduced", 1, 0.1, 1e-8, room);
    top_text(&text, 'z', spin, false);
    scene s = scene_of(text.s);
    kempe_system_set_force(s.system, no_effort, NULL);
    CHECK(kmp_charts_count(s.system) == 0 && s.system->chart_count == 1);
    kempe_status status = kempe_simulate(s.system, &run, &s.t);
    CHECK(s.t && s.t->report.centrings == 0 && (status == KEMPE_OK || status == KEMPE_E_FAILED));
    scene_free(&s);
    kmp_text_free(&text);
}

/* Two bodies that are welded twice, on a free root: rows of its chart alone, which rounding opens, or which never
 * close. */
static void test_rows_of_charts_alone(void)
{
    static const char *const places[] = {"[-9, 4.4e-11, 1]", "[-9, 0.5, 1]"};
    for (int k = 0; k < 2; k++) {
        char text[900];
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        kempe_system *system = NULL;
        snprintf(
            text, sizeof text,
            "kempe: 1\nbodies:\n  a: {joint: {free: x, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: "
            "{P: {at: [0, 0, 10], axes: {x: [4.8965888601467475e-12, 0, -1], y: [0, 1, 0]}}, Q: [1, 0, 1]}}\n"
            "  b: {joint: {name: B, weld: yes, at: a.P}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {Q: "
            "{at: [9, 0, 1], axes: {x: [0, 0, 1], y: [0, 1, 0]}}, R: %s}}\n"
            "loops: {W: {weld: [a.Q, b.Q]}}\n",
            places[k]);
        if (k == 1)
            memcpy(strstr(text, "b.Q"), "b.R", 3);
        CHECK(kempe_model_read_text(context, text, "m.yaml", &model) == KEMPE_OK);
        kempe_status status = model ? kempe_system_new(model, &system) : KEMPE_E_BUG;
        CHECK(status == (k == 0 ? KEMPE_OK : KEMPE_E_INPUT));
        CHECK(k == 0 || strstr(kempe_context_message(context), "closure 'W' cannot be satisfied: its component"));
        kempe_system_free(system);
        kempe_model_free(model);
        kempe_context_free(context);
    }
}

/* The end of a run is one of the user's angles, although a run without it counts them from another orientation. */
static void test_end_by_an_angle(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                         "  rod: {joint: {name: S, spherical: x, at: ground}, mass: 1, com: [0.5, 0, 0.1], "
                         "inertia: {xx: 0.1, yy: 0.2, zz: 0.25}}\n"
                         "start: {q: {S.1: 0.3, S.2: 1.2, S.3: 0.1}, qd: {S.1: 0.4, S.2: 1.5, S.3: 0.5}}\n"
                         "run: {t_end: 2, until: \"q(S.1) > 1\"}\n");
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(l.system, NULL, &t) == KEMPE_OK);
    if (t) {
        const int last = kempe_trajectory_row_count(t) - 1;
        CHECK_NEAR(kempe_trajectory_q(t, last)[0], 1, 1e-9);
        for (int row = 0; row < last; row++)
            CHECK(kempe_trajectory_q(t, row)[0] < 1);
    }
    kempe_trajectory_free(t);
    unload(&l);
}

int main(void)
{
    TEST(test_maps);
    TEST(test_rows_of_charts_alone);
    TEST(test_singular_map);
    TEST(test_who_is_centred);
    TEST(test_tumbling);
    TEST(test_through_singular_angles);
    TEST(test_carrier);
    TEST(test_angles_go_on);
    TEST(test_many_turns_in_a_step);
    TEST(test_turns_back);
    TEST(test_resume);
    TEST(test_loop);
    TEST(test_singular_start);
    TEST(test_singular_loop);
    TEST(test_compared_words);
    TEST(test_users_force);
    TEST(test_end_by_an_angle);
    return check_report();
}
