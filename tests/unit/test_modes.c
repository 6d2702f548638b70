/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 4 */
/* Modes against closed forms, against each other in other independent coordinates, against a companion matrix, and
 * against simulations that begin on one; and what becomes of them when a parameter varies. */
#include "analyses/modes/locus.h"
#include "analyses/modes/modes_print.h"
#include "analyses/modes/modes_study.h"
#include "base/text.h"
#include "loaded.h"
#include "model/data/body.h"
#include "testing.h"
#include <complex.h>
#include <kempe/kempe.h>
#include <kempe/modes.h>
#include <kempe/settings.h>
#include <stdbool.h>
#include <stdlib.h>

enum { MOST = 64 };

/* A cell of a table of the modes. */
static double cell(const kempe_modes *modes, const char *name, int row, const char *column)
{
    kempe_table *table = NULL;
    CHECK(kempe_modes_table(modes, name, &table) == KEMPE_OK);
    double value = kempe_table_number(table, row, kempe_table_find(table, column));
    kempe_table_free(table);
    return value;
}

static kempe_modes *modes_of(const loaded *m, kempe_modes_options options)
{
    kempe_modes *modes = NULL;
    kempe_status status = kempe_modes_new(m->system, &options, &modes);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(m->context));
    CHECK(status == KEMPE_OK && modes);
    return modes;
}

/* -- closed forms ------------------------------------------------------------------------------------ */

/* The root of (mb s^2 + c s + k) (mw s^2 + c s + k + kt) = (c s + k)^2 that is next to s. */
static double complex quarter_root(double complex s, const double v[5])
{
    double mb = v[0], mw = v[1], k = v[2], c = v[3], kt = v[4];
    for (int i = 0; i < 50; i++) {
        double complex body = mb * s * s + c * s + k, wheel = mw * s * s + c * s + k + kt, both = c * s + k;
        double complex f = body * wheel - both * both;
        double complex slope = (2 * mb * s + c) * wheel + body * (2 * mw * s + c) - 2 * c * both;
        s -= f / slope;
    }
    return s;
}

static void a_quarter_car_is_its_quartic(void)
{
    const double v[5] = {320, 40, 18e3, 1.2e3, 180e3};
    loaded m = load("examples/quarter_car/quarter_car.yaml");
    kempe_modes *modes = modes_of(&m, (kempe_modes_options){0});
    double complex sum = 0, product = 1;
    CHECK(modes->modes.count == 4 && kempe_modes_zero_count(modes) == 0 && !kempe_modes_is_unstable(modes));
    for (int k = 0; k < 4; k++) {
        double complex s = modes->modes.spectrum.re[k] + I * modes->modes.spectrum.im[k], root = quarter_root(s, v);
        CHECK(cabs(s - root) <= 1e-12 * cabs(root));
        CHECK_NEAR(cell(modes, "modes", k, "frequency"), fabs(cimag(root)) / (2 * acos(-1)), 1e-12);
        CHECK_NEAR(cell(modes, "modes", k, "damping"), -creal(root) / cabs(root), 1e-12);
        sum += root;
        product *= root;
        /* how far the body goes, beside the wheel: body = wheel + relative */
        const double *re = (modes->modes.shown_re + k * modes->modes.n),
                     *im = (modes->modes.shown_im + k * modes->modes.n);
        double complex wheel = re[0] + I * im[0], body = wheel + re[1] + I * im[1];
        double complex ratio = (v[3] * root + v[2]) / (v[0] * root * root + v[3] * root + v[2]);
        CHECK(cabs(body / wheel - ratio) <= 1e-11 * cabs(ratio));
    }
    /* all four: what Vieta says of the quartic */
    CHECK(cabs(sum + v[3] * (1 / v[0] + 1 / v[1])) <= 1e-12 * cabs(sum));
    CHECK(cabs(product - v[2] * v[4] / (v[0] * v[1])) <= 1e-12 * cabs(product));
    /* at rest it has sunk by its weight */
    CHECK_NEAR(modes->q[0], 0.32 - (v[0] + v[1]) * 9.81 / v[4], 1e-12);
    CHECK_NEAR(modes->q[1], 0.7 - v[0] * 9.81 / v[2], 1e-12);
    kempe_modes_free(modes);
    unload(&m);
}

/* Upright on a torsion spring: m l^2 s^2 + k - m g l = 0. */
static void an_inverted_pendulum_falls_where_its_spring_is_weak(void)
{
    for (int weak = 0; weak < 2; weak++) {
        char text[400];
        double m = 2, l = 0.7, g = 9.81, k = m * g * l * (weak ? 0.9 : 1.3);
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, -%.17g, 0]\nbodies:\n  a: {joint: {revolute: z, at: ground}, mass: "
                       "%.17g, com: [0, %.17g, 0]}\nforces: {s: {joint: a, spring: {stiffness: %.17g}}}\n",
                       g, m, l, k);
        loaded a = load_text(text);
        kempe_modes *modes = modes_of(&a, (kempe_modes_options){.at = "start"});
        double square = (k - m * g * l) / (m * l * l);
        CHECK(modes->modes.count == 2 && kempe_modes_is_unstable(modes) == weak);
        CHECK_NEAR(weak ? modes->modes.spectrum.re[0] : modes->modes.spectrum.im[0], sqrt(fabs(square)), 1e-13);
        CHECK((weak ? modes->modes.spectrum.im[0] : modes->modes.spectrum.re[0]) == 0);
        CHECK(modes->modes.spectrum.re[1] == -modes->modes.spectrum.re[0]);
        kempe_modes_free(modes);
        unload(&a);
    }
}

/* A table that may go and turn in its plane, on two upright rods of length l: where it stands its weight pulls along no
 * freedom and does not change, and the spring alone would hold it. It falls because the rods' forces turn with them
 * (geometric stiffness, lambda times the second derivatives of h): s^2 = g / l - k / m. */
static void a_loaded_four_bar_falls_by_its_closures(void)
{
    for (int weak = 0; weak < 2; weak++) {
        char text[1200];
        double m = 30, l = 0.5, g = 9.81, k = m * g / l * (weak ? 0.8 : 1.1);
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, -%.17g, 0]\nground: {points: {O: [0, 0, 0], P: [1, 0, 0]}}\nbodies:\n"
                       "  table: {joint: {motions: [T1, T2, R3], at: ground, coordinates: [x, y, turn]}, mass: %.17g, "
                       "com: [0.3, 0.1, 0], inertia: {zz: 2}, points: {L: [0, 0, 0], R: [1, 0, 0]}}\n"
                       "loops: {left: {rod: [ground.O, table.L], length: %.17g}, right: {rod: [ground.P, table.R], "
                       "length: %.17g}}\n"
                       "forces: {s: {joint: table.1, spring: {stiffness: %.17g}}}\nstart: {q: {y: %.17g}, hold: [x]}\n",
                       g, m, l, l, k, l);
        loaded a = load_text(text);
        kempe_modes *modes = modes_of(&a, (kempe_modes_options){.at = "start"});
        double square = k / m - g / l;
        CHECK(modes->modes.count == 2 && kempe_modes_is_unstable(modes) == weak);
        CHECK_NEAR(weak ? modes->modes.spectrum.re[0] : modes->modes.spectrum.im[0], sqrt(fabs(square)), 1e-12);
        kempe_modes_free(modes);
        unload(&a);
    }
}

/* A cart runs freely, and a bob hangs on it: the cart's zeros are exact and double, s^2 = -(1 + m/M) g / l. */
static void what_is_cyclic_is_exactly_zero(void)
{
    loaded m = load_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                         "  cart: {joint: {prismatic: x, at: ground}, mass: 3}\n"
                         "  bob: {joint: {revolute: z, at: cart}, mass: 1, com: [0, -0.4, 0]}\n");
    kempe_modes *modes = modes_of(&m, (kempe_modes_options){0});
    char *text = NULL;
    CHECK(modes->modes.count == 4 && kempe_modes_zero_count(modes) == 2);
    for (int k = 0; k < 2; k++) {
        CHECK(modes->modes.spectrum.re[k] == 0 && modes->modes.spectrum.im[k] == 0);
        CHECK((modes->modes.shown_re + k * modes->modes.n)[1] == 0 &&
              (modes->modes.shown_re + k * modes->modes.n)[0] > 0);
        CHECK(isnan(cell(modes, "modes", k, "frequency")) && isnan(cell(modes, "modes", k, "damping")));
    }
    CHECK(modes->modes.spectrum.re[2] == 0);
    CHECK_NEAR(modes->modes.spectrum.im[2], sqrt((1 + 1.0 / 3) * 9.81 / 0.4), 1e-13);
    CHECK(kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK &&
          strstr(text, "neutral: 1 free motion, no mode grows\n") && strstr(text, "\n  Free motion along cart"));
    kempe_text_free(text);
    kempe_modes_free(modes);
    unload(&m);
    m = load("examples/suspension/suspension.yaml"); /* four wheels turn freely */
    modes = modes_of(&m, (kempe_modes_options){0});
    CHECK(kempe_modes_zero_count(modes) == 8 && modes->modes.spectrum.im[8] > 0);
    kempe_modes_free(modes);
    unload(&m);
}

/* -- other independent coordinates ------------------------------------------------------------------- */

/* Both spectra, each of one with the nearest of the other: the largest distance of zeros, or of the others. */
static double apart(const kmp_modes *a, const kmp_modes *b, bool zeros)
{
    int n = a->count, column[MOST];
    double cost[MOST * MOST] = {0}, worst = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            cost[i + j * n] = hypot(a->spectrum.re[i] - b->spectrum.re[j], a->spectrum.im[i] - b->spectrum.im[j]);
    CHECK(kmp_assign(n, cost, column) == 0);
    for (int i = 0; i < n; i++)
        if ((i < a->spectrum.zeros) == zeros)
            worst = check_max(worst, cost[i + column[i] * n]);
    return worst / kmp_modes_size(a);
}

/* Every dependent coordinate takes the place of the first independent one that it can. Returns the number of those that
 * could. */
static int compare_choices(const loaded *m)
{
    kmp_operating_family *family = NULL;
    kmp_modes first = {0};
    int wish[MOST], tried = 0;
    CHECK(kmp_operating_family_new(m->system, &(kmp_operating_family_options){0}, &family) == KEMPE_OK);
    CHECK(kmp_operating_family_go(family, 0, &first) == KEMPE_OK);
    family->options.wish = wish;
    family->options.wish_count = first.p;
    for (int k = 0; k < first.n; k++) {
        bool independent = false, done = false;
        for (int i = 0; i < first.p; i++)
            independent = independent || first.u[i] == k;
        for (int i = 0; i < first.p && !independent && !done; i++) {
            kmp_modes other = {0};
            memcpy(wish, first.u, (size_t)first.p * sizeof *wish);
            wish[i] = k;
            done = kmp_operating_family_go(family, 0, &other) == KEMPE_OK;
            if (!done)
                continue;
            CHECK(memcmp(other.u, first.u, (size_t)first.p * sizeof *wish) != 0);
            CHECK(apart(&first, &other, false) <= 1e-9);
            CHECK(apart(&first, &other, true) <= 1e-6);
            CHECK(other.spectrum.zeros == first.spectrum.zeros);
            kmp_modes_free(&other);
            tried++;
        }
    }
    kmp_modes_free(&first);
    kmp_operating_family_free(family);
    return tried;
}

static void eigenvalues_do_not_depend_on_u(void)
{
    static const char *const paths[] = {
        "examples/andrews/andrews.yaml",       "examples/stewart/stewart.yaml",
        "examples/suspension/suspension.yaml", "examples/stephenson/stephenson.yaml",
        "examples/four_bar/four_bar.yaml",     "tests/models/guide_friction_carrier.yaml"}; /* Mr is not symmetric */
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        loaded m = load(paths[k]);
        int tried = compare_choices(&m);
        printf("  %s: %d other choices\n", paths[k], tried);
        CHECK(tried >= 2);
        unload(&m);
    }
}

/* Eigenvalues by a companion matrix: on the imaginary axis to 1e-10 of the largest. */
static void undamped_ones_are_on_the_axis(void)
{
    static const char *const paths[] = {"examples/four_bar/four_bar.yaml", "examples/andrews/andrews.yaml",
                                        "examples/stephenson/stephenson.yaml", "tests/models/leg.yaml"};
    int tried = 0;
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        loaded m = load(paths[k]);
        kmp_operating_family *family = NULL;
        kmp_modes modes;
        if (kmp_operating_family_new(m.system, &(kmp_operating_family_options){0}, &family) == KEMPE_OK &&
            kmp_operating_family_go(family, 0, &modes) == KEMPE_OK) {
            const kmp_linear *l = &family->linear;
            kmp_spectrum s;
            CHECK(kmp_spectrum_init(&s, l->p, l->mass, NULL, l->damping, l->stiffness, true) == 0);
            for (int c = 0; c < s.count; c++) {
                CHECK(!s.conservative || modes.spectrum.re[c] == 0);
                CHECK(!s.conservative || fabs(s.re[c]) <= 1e-10 * kmp_modes_size(&modes));
                CHECK(hypot(s.re[c] - modes.spectrum.re[c], s.im[c] - modes.spectrum.im[c]) <=
                      1e-9 * kmp_modes_size(&modes));
            }
            tried += s.conservative;
            kmp_spectrum_free(&s);
            kmp_modes_free(&modes);
        }
        kmp_operating_family_free(family);
        unload(&m);
    }
    CHECK(tried >= 3);
}

/* -- forces of multipliers --------------------------------------------------------------------------- */

/* A wheelset with worn profiles on rails of their own, rigid: its contacts lie on curves. */
static const char worn[] =
    "kempe: 1\ngravity: [0, 0, -9.81]\nprofiles:\n"
    "  tread: {csv: " KEMPE_ROOT "/examples/profiles/s1002.csv, y: y, z: z}\n"
    "  head: {csv: " KEMPE_ROOT "/examples/profiles/uic60_manchester.csv, y: y, z: z}\n"
    "tracks: {line: {at: ground.O, rail: head, gauge: 1435 mm, gauge_depth: 14 mm, inclination: 1/40}}\n"
    "ground: {points: {O: [0, 0, 0]}}\nbodies:\n"
    "  hanger: {joint: {motions: [T1, T2, T3, R3, R1], coordinates: [x, y, z, yaw, roll], at: ground.O}}\n"
    "  wheelset: {joint: {name: spin, revolute: y, at: hanger}, mass: 1500, inertia: {xx: 700, yy: 100, zz: 700}, "
    "points: {L: [0, 0.75, 0], R: [0, -0.75, 0]}}\n"
    "wheels:\n"
    "  L: {on: line.left, at: wheelset.L, profile: tread, radius: 0.46, contact: rigid, creep: linear}\n"
    "  R: {on: line.right, at: wheelset.R, profile: tread, radius: 0.46, contact: rigid, creep: linear}\n"
    "forces: {weight: {joint: z, force: -1e5}, shift: {joint: y, force: -2e5*q(y)}, turn: {joint: yaw, torque: "
    "-2e6*q(yaw)}}\n"
    "start: {q: {z: 0.46}, hold: [y, yaw], qd: {x: 20, spin: 43.481181}}\n";

/* Eigenvalues other than 0, each beside itself: |s - its nearest of the other| over |s|, or over the rounding of the
 * largest. */
static double far_apart(const kmp_modes *a, const kmp_modes *b)
{
    double worst = 0, round = 1e-5 * kmp_modes_noise(a);
    for (int i = a->spectrum.zeros; i < a->count; i++) {
        double least = INFINITY, size = hypot(a->spectrum.re[i], a->spectrum.im[i]);
        for (int k = 0; k < b->count; k++)
            least = fmin(least, hypot(a->spectrum.re[i] - b->spectrum.re[k], a->spectrum.im[i] - b->spectrum.im[k]));
        worst = check_max(worst, least / check_max(size, 1e9 * round));
    }
    return worst;
}

/* |(s^2 M + s G + K) x| or, transposed, of y conjugate, each row over the root of its mass, beside the sizes of what it
 * is the sum of; largest over modes. */
static double left_over(const kmp_linear *l, const kmp_spectrum *s, bool left)
{
    double worst = 0;
    int p = l->p;
    const double *re = left ? s->y_re : s->x_re, *im = left ? s->y_im : s->x_im;
    for (int c = s->zeros; c < s->count; c++) {
        double complex z = s->re[c] + I * s->im[c];
        double rest = 0, size = 0;
        for (int i = 0; i < p; i++) {
            double complex sum = 0;
            double parts = 0, unit = sqrt(l->mass[i + i * p]);
            for (int k = 0; k < p; k++) {
                int e = left ? k + i * p : i + k * p;
                double complex v = re[k + c * p] + (left ? -I : I) * im[k + c * p];
                double complex m = z * z * l->mass[e] * v, g = z * l->damping[e] * v, q = l->stiffness[e] * v;
                sum += m + g + q;
                parts += cabs(m) + cabs(g) + cabs(q);
            }
            rest = check_max(rest, cabs(sum) / unit);
            size = check_max(size, parts / unit);
        }
        worst = check_max(worst, rest / size);
    }
    return worst;
}

/* The largest |y^H (2 s M + G) x - 1|. */
static double off_one(const kmp_linear *l, const kmp_spectrum *s)
{
    double worst = 0;
    int p = l->p;
    for (int c = s->zeros; c < s->count; c++) {
        double complex sum = 0;
        for (int i = 0; i < p; i++)
            for (int k = 0; k < p; k++) {
                double complex x = s->x_re[k + c * p] + I * s->x_im[k + c * p];
                double complex y = s->y_re[i + c * p] - I * s->y_im[i + c * p];
                double complex z = s->re[c] + I * s->im[c];
                sum += y * (2 * z * l->mass[i + k * p] + l->damping[i + k * p]) * x;
            }
        worst = check_max(worst, cabs(sum - 1));
    }
    return worst;
}

/* The asymmetry of Mr, relative to its largest entry. */
static double skew(const kmp_linear *l)
{
    double most = 0, off = 0;
    for (int i = 0; i < l->p; i++)
        for (int k = 0; k < l->p; k++) {
            most = check_max(most, fabs(l->mass[i + k * l->p]));
            off = check_max(off, fabs(l->mass[i + k * l->p] - l->mass[k + i * l->p]));
        }
    return off / most;
}

/* If creep depends on the multipliers of contact, Mr is not symmetric: the eigenvalues are those of Mr all the same.
 * They depend on no choice of u, though y or roll may be one. */
static void rigid_wheels_do_not_depend_on_u(const loaded *m, int zeros)
{
    kmp_operating_family *family = NULL;
    kmp_modes first = {0}, other = {0};
    int y = coordinate_named(m, "y"), roll = coordinate_named(m, "roll"), wish[MOST];
    CHECK(kmp_operating_family_new(m->system, &(kmp_operating_family_options){.word = "start"}, &family) == KEMPE_OK);
    CHECK(kmp_operating_family_go(family, 0, &first) == KEMPE_OK);
    memcpy(wish, first.u, (size_t)first.p * sizeof *wish);
    for (int i = 0; i < first.p; i++)
        wish[i] = wish[i] == y ? roll : wish[i];
    CHECK(memcmp(wish, first.u, (size_t)first.p * sizeof *wish) != 0);
    family->options.wish = wish;
    family->options.wish_count = first.p;
    CHECK(kmp_operating_family_go(family, 0, &other) == KEMPE_OK);
    CHECK(skew(&family->linear) > 1e-6);
    CHECK(left_over(&family->linear, &other.spectrum, false) < 1e-11);
    CHECK(left_over(&family->linear, &other.spectrum, true) < 1e-11);
    CHECK(off_one(&family->linear, &other.spectrum) < 1e-9);
    printf("  %d modes, skew %.1e, left over %.1e and %.1e, off one %.1e, apart %.1e\n", other.count,
           skew(&family->linear), left_over(&family->linear, &other.spectrum, false),
           left_over(&family->linear, &other.spectrum, true), off_one(&family->linear, &other.spectrum),
           far_apart(&first, &other));
    CHECK(first.spectrum.zeros == zeros && other.spectrum.zeros == zeros && !other.spectrum.conservative);
    CHECK(far_apart(&first, &other) <= 1e-9 && far_apart(&other, &first) <= 1e-9);
    kmp_modes_free(&first);
    kmp_modes_free(&other);
    kmp_operating_family_free(family);
}

static void forces_of_multipliers_leave_u_free(void)
{
    const kempe_setting middle[] = {{"aside", "0"}, {"spin", "40"}};
    loaded m = load("examples/restrained_wheelset/wheelset_on_rails.yaml");
    rigid_wheels_do_not_depend_on_u(&m, 3);
    unload(&m);
    m = load_set("examples/rolling_wheel/independent.yaml", middle, 2);
    rigid_wheels_do_not_depend_on_u(&m, 4);
    unload(&m);
    m = load_text(worn);
    rigid_wheels_do_not_depend_on_u(&m, 3);
    unload(&m);
}

/* -- a simulation that begins on a mode -------------------------------------------------------------- */

/* A double pendulum with a slider on a rod between its arms, dampers and a spring: nonlinear, closed. */
static const char swing[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {D: [0.9, 0, 0]}}\nbodies:\n"
    "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.01}, "
    "points: {B: [0.3, 0, 0]}}\n"
    "  b: {joint: {revolute: z, at: a.B}, mass: 1, com: [0.4, 0.1, 0], inertia: {zz: 0.05}, "
    "points: {C: [0.8, 0, 0]}}\n"
    "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.04}, "
    "points: {C: [0.7, 0, 0]}}\n"
    "  d: {joint: {revolute: z, at: c.C}, mass: 0.5, com: [0, -0.3, 0], inertia: {zz: 0.01}}\n"
    "loops: {C: {ball: [b.C, c.C]}}\n"
    "forces: {k: {joint: a, spring: {stiffness: 30, damping: 0.4, rest: 1}}, "
    "e: {joint: d, spring: {stiffness: 0.2, damping: 0.05}}}\n";

/* The largest |q(t) - q0 - size Re(shape e^(s t))| over two periods of eigenvalue k, begun there. */
static double departure(const kempe_modes *modes, int n, int k, double size)
{
    const double *q = modes->q, *re = (modes->modes.shown_re + k * modes->modes.n),
                 *im = (modes->modes.shown_im + k * modes->modes.n);
    double complex s = modes->modes.spectrum.re[k] + I * modes->modes.spectrum.im[k];
    static const char *const names[] = {"a", "b", "c", "d"};
    kmp_text text = {0};
    kmp_text_printf(&text, "%sstart: {hold: [a, d], q: {", swing);
    for (int i = 0; i < n; i++)
        kmp_text_printf(&text, "%s%s: %.17g", i ? ", " : "", names[i], q[i] + size * re[i]);
    kmp_text_put(&text, "}, qd: {");
    for (int i = 0; i < n; i++)
        kmp_text_printf(&text, "%s%s: %.17g", i ? ", " : "", names[i], size * creal(s * (re[i] + I * im[i])));
    kmp_text_put(&text, "}}\n");
    loaded m = load_text(text.s);
    kempe_run_options run = {0};
    kempe_trajectory *trajectory = NULL;
    double worst = 0, t_end = 4 * acos(-1) / fabs(cimag(s));
    run.rtol = run.atol = 1e-12;
    run.t_end = t_end;
    run.output_step = t_end / 50;
    run.no_convergence_check = 1;
    CHECK(kempe_simulate(m.system, &run, &trajectory) == KEMPE_OK);
    for (int row = 0; row < kempe_trajectory_row_count(trajectory); row++) {
        double complex grown = cexp(s * kempe_trajectory_time(trajectory, row));
        for (int i = 0; i < n; i++)
            worst = check_max(
                worst, fabs(kempe_trajectory_q(trajectory, row)[i] - q[i] - size * creal(grown * (re[i] + I * im[i]))));
    }
    kempe_trajectory_free(trajectory);
    unload(&m);
    kmp_text_free(&text);
    return worst;
}

static void a_simulation_begun_on_a_mode_stays_on_it(void)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "%sstart: {hold: [a], q: {a: 1.5, b: -1, c: 1.9, d: -2}}\n", swing);
    loaded m = load_text(text.s);
    kempe_modes *modes = modes_of(&m, (kempe_modes_options){0});
    CHECK(modes->modes.count == 4 && modes->modes.spectrum.im[0] > 0 && modes->modes.spectrum.im[2] > 0);
    for (int k = 0; k < 4; k += 2) {
        double far = departure(modes, 4, k, 2e-3), near = departure(modes, 4, k, 1e-3),
               nearer = departure(modes, 4, k, 1e-4);
        CHECK(far > 3.8 * near && far < 4.2 * near);
        CHECK(nearer < 1e-3 * 1e-4 * 100);
        CHECK(near > 90 * nearer && near < 110 * nearer);
    }
    kempe_modes_free(modes);
    unload(&m);
    kmp_text_free(&text);
}

/* -- what varies ------------------------------------------------------------------------------------- */

/* Vc^2 = 4 f^2 b^2 A B / (4 f^2 A^2 b cone/r0 - b^2 (I ky - m kpsi)^2), A = I + m b^2, B = kpsi + ky b^2; there it
 * swings with B / A (Routh-Hurwitz of the two equations). */
static void a_wheelset_hunts_above_its_critical_speed(void)
{
    double m = 1250, I_z = 700, b = 0.75, cone = 0.05, r0 = 0.45, f = 1e7, ky = 2.5e5, kpsi = 2e6;
    double A = I_z + m * b * b, B = kpsi + ky * b * b, cross = I_z * ky - m * kpsi;
    double speed = sqrt(4 * f * f * b * b * A * B / (4 * f * f * A * A * b * cone / r0 - b * b * cross * cross));
    loaded w = load("examples/restrained_wheelset/restrained_wheelset.yaml");
    kempe_modes *modes = modes_of(&w, (kempe_modes_options){.sweep = "V=40:140:6"});
    CHECK_NEAR(speed, 103.91441171838, 1e-12);
    CHECK(modes->locus.critical_count == 1 && modes->locus.reached == 6);
    CHECK_NEAR(modes->locus.critical[0].value, speed, 1e-10);
    CHECK_NEAR(cell(modes, "critical", 0, "frequency") * 2 * acos(-1), sqrt(B / A), 1e-9);
    CHECK(!kempe_modes_is_unstable(modes)); /* at its own 80 m/s */
    for (int k = 0; k < 6; k++)
        for (int c = 0; c < 4; c++) {
            double complex s =
                modes->locus.re[c + k * modes->locus.count] + I * modes->locus.im[c + k * modes->locus.count];
            double v = modes->locus.value[k];
            double complex y = m * s * s + 2 * f * s / v + ky, psi = I_z * s * s + 2 * f * b * b * s / v + kpsi;
            double complex det = y * psi + 4 * f * f * b * cone / r0;
            CHECK(cabs(det) <= 1e-10 * (cabs(y) * cabs(psi) + 4 * f * f * b * cone / r0));
        }
    kempe_modes_free(modes);
    modes = modes_of(&w, (kempe_modes_options){.sweep = "V=140:90:4"}); /* downwards it ceases */
    CHECK(modes->locus.critical_count == 1);
    CHECK_NEAR(modes->locus.critical[0].value, speed, 1e-10);
    kempe_modes_free(modes);
    unload(&w);
}

/* A disc with moments A, A, C on a universal joint with springs k, spinning with W: A s^2 -+ i C W s + k = 0. */
static void a_rotor_splits_its_frequencies(void)
{
    double A = 0.2, C = 0.3, k = 50;
    loaded m = load_text("kempe: 1\nbodies:\n"
                         "  gimbal: {joint: {name: x, revolute: x, at: ground}, mass: 0}\n"
                         "  fork: {joint: {name: y, revolute: y, at: gimbal}, mass: 0}\n"
                         "  disc: {joint: {name: spin, revolute: z, at: fork}, mass: 1, inertia: {xx: 0.2, yy: 0.2, "
                         "zz: 0.3}}\n"
                         "forces: {kx: {joint: x, spring: {stiffness: 50}}, ky: {joint: y, spring: {stiffness: 50}}}\n"
                         "start: {qd: {spin: 10}}\n");
    kempe_modes *modes =
        modes_of(&m, (kempe_modes_options){.at = "start", .sweep = "qd.spin=0:60:31", .orders = "1,2"});
    CHECK(modes->locus.critical_count == 0 && modes->locus.reached == 31);
    CHECK(kempe_modes_zero_count(modes) == 2);
    int up = 0, down = 0;
    for (int c = 0; c < 6; c++) {
        double before = modes->locus.im[c + 1 * modes->locus.count],
               after = modes->locus.im[c + 30 * modes->locus.count];
        if (!(after > 0))
            continue;
        for (int j = 0; j < 31; j++) {
            double half = C * modes->locus.value[j] / (2 * A), root = sqrt(half * half + k / A);
            CHECK_NEAR(modes->locus.im[c + j * modes->locus.count], after > before ? root + half : root - half, 1e-11);
            CHECK(fabs(modes->locus.re[c + j * modes->locus.count]) <= 1e-10 * root);
        }
        up += after > before;
        down += after < before;
    }
    CHECK(up == 1 && down == 1);
    kempe_modes_free(modes);
    unload(&m);
}

/* Real and imaginary part of the eigenvalue k of a result that is neither zero nor in the lower half plane. */
static int nonzero(const kempe_modes *modes, double *re, double *im)
{
    int count = 0;
    for (int k = kempe_modes_zero_count(modes); k < modes->modes.count; k++)
        if (modes->modes.spectrum.im[k] >= 0) {
            re[count] = modes->modes.spectrum.re[k];
            im[count++] = modes->modes.spectrum.im[k];
        }
    return count;
}

/* A start that moves leads to the steady motion: the shaft keeps the rate of the start, which no force decides, and the
 * arm stands as in the test of the steady height. A sweep of the start follows it. */
static void a_start_that_goes_round_is_steady(void)
{
    double l = 0.3, g = 9.81;
    loaded a = load_text("kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {W: 7}\nbodies:\n"
                         "  shaft: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 0.02}}\n"
                         "  arm: {joint: {revolute: -y, at: shaft}, mass: 0.4, com: [0, 0, -0.3]}\n"
                         "start: {q: {arm: 1}, qd: {shaft: W}}\n");
    kempe_modes *modes = modes_of(&a, (kempe_modes_options){.sweep = "W=7:20:14"});
    kempe_modes *named = modes_of(&a, (kempe_modes_options){.rates = "shaft=7"});
    double re[2][8], im[2][8];
    CHECK_NEAR(modes->qd[0], 7, 0);
    CHECK_NEAR(fabs(modes->q[1]), acos(g / (l * 49)), 1e-10);
    CHECK(modes->locus.reached == 14);
    for (int k = 0; k < modes->locus.reached; k++) {
        double W = modes->locus.value[k];
        CHECK_NEAR(fabs(modes->locus.q[2 * k + 1]), acos(g / (l * W * W)), 1e-9);
    }
    int count = nonzero(modes, re[0], im[0]);
    CHECK(count == 1 && nonzero(named, re[1], im[1]) == 1);
    CHECK_NEAR(im[0][0], im[1][0], 1e-9);
    kempe_modes_free(named);
    kempe_modes_free(modes);
    modes = modes_of(&a, (kempe_modes_options){.rates = "shaft=0"});
    CHECK(modes->qd[0] == 0 && modes->q[1] == 0); /* a rest is found where it is named */
    kempe_modes_free(modes);
    unload(&a);
}

static double rate_of(const kempe_modes *modes, const char *name)
{
    for (int i = 0; i < modes->system->n; i++)
        if (strcmp(kmp_model_motion(modes->system->model, i)->name, name) == 0)
            return modes->qd[i];
    return NAN;
}

/* A wagon that rolls freely: its speed is that of the start, and its spins follow. A sweep of the speed has the
 * critical one. */
static void a_wagon_that_rolls_is_steady(void)
{
    loaded a = load("examples/curving/curving.yaml");
    kempe_modes *modes = modes_of(&a, (kempe_modes_options){.sweep = "V=30:50:3"});
    CHECK(rate_of(modes, "x") == 15);
    CHECK_NEAR(rate_of(modes, "fspin"), 15 / 0.46, 1e-3 * 15 / 0.46);
    CHECK(kempe_modes_zero_count(modes) == 4); /* three positions, and the speed */
    CHECK(modes->locus.critical_count == 1 && modes->locus.critical[0].grows_above);
    kempe_modes_free(modes);
    unload(&a);
}

/* The tram on its straight track: eigenvalues do not depend on the car whose way is the independent one. */
static void a_tram_runs_with_any_choice_of_its_way(void)
{
    static const char *const ways[] = {"a_x", "b_x", "c_x"};
    loaded a = load("examples/tram/tram.yaml");
    double re[3][96], im[3][96];
    int count[3];
    kempe_modes *first = modes_of(&a, (kempe_modes_options){0});
    for (int k = 0; k < 3; k++) {
        char list[1024] = "";
        for (int i = 0; i < first->modes.moving; i++) {
            const char *name = kmp_model_motion(a.model, first->modes.u[i])->name;
            size_t used = strlen(list);
            (void)snprintf(list + used, sizeof list - used, "%s%s", i ? "," : "",
                           strcmp(name, "c_x") == 0 ? ways[k] : name);
        }
        CHECK(strstr(list, ways[k]) != NULL);
        kempe_modes *modes = modes_of(&a, (kempe_modes_options){.independent = list});
        CHECK_NEAR(rate_of(modes, ways[k]), 10, 0.01);
        CHECK(kempe_modes_zero_count(modes) == 13);
        count[k] = nonzero(modes, re[k], im[k]);
        kempe_modes_free(modes);
    }
    kempe_modes_free(first);
    CHECK(count[0] > 20 && count[1] == count[0] && count[2] == count[0]);
    for (int k = 1; k < 3; k++)
        for (int i = 0; i < count[0] && i < count[k]; i++)
            CHECK(hypot(re[k][i] - re[0][i], im[k][i] - im[0][i]) <= 1e-7 * hypot(re[0][i], im[0][i]));
    unload(&a);
}

/* A bob of mass m on an arm of length l that a shaft of moment J carries round with W, freely: it stands where
 * cos = g / (l W^2), and swings there with p = (J + m l^2 sin^2) W kept, s^2 = -U'' / (m l^2),
 * U = p^2 / (2 (J + m l^2 sin^2)) - m g l cos. */
static void a_governor_swings_about_its_steady_height(void)
{
    double m = 0.4, l = 0.3, g = 9.81, J = 0.02;
    loaded a = load_text("kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                         "  shaft: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 0.02}}\n"
                         "  arm: {joint: {revolute: -y, at: shaft}, mass: 0.4, com: [0, 0, -0.3]}\n"
                         "start: {q: {arm: 1}}\n");
    kempe_modes *modes = modes_of(&a, (kempe_modes_options){.rates = "shaft=7:20:14", .orders = "1"});
    CHECK(modes->locus.reached == 14 && kempe_modes_zero_count(modes) == 2);
    CHECK(modes->qd[0] == 7 && modes->locus.critical_count == 0);
    CHECK_NEAR(fabs(modes->q[1]), acos(g / (l * 49)), 1e-10);
    for (int k = 0; k < 14; k++) {
        double W = modes->locus.value[k], c = g / (l * W * W), s = sqrt(1 - c * c), most = 0;
        double D = J + m * l * l * s * s, D1 = 2 * m * l * l * s * c, D2 = 2 * m * l * l * (c * c - s * s), p = D * W;
        double U2 = p * p * (D1 * D1 / (D * D * D) - D2 / (2 * D * D)) + m * g * l * c;
        for (int b = 0; b < 4; b++) {
            most = check_max(most, modes->locus.im[b + k * modes->locus.count]);
            CHECK(fabs(modes->locus.re[b + k * modes->locus.count]) <= 1e-10 * W);
        }
        CHECK_NEAR(most, sqrt(U2 / (m * l * l)), 1e-9);
    }
    kempe_modes_free(modes);
    modes = modes_of(&a, (kempe_modes_options){.at = "equilibrium shaft=7"});
    CHECK(modes->qd[0] == 7);
    CHECK_NEAR(fabs(modes->q[1]), acos(g / (l * 49)), 1e-10);
    kempe_modes_free(modes);
    modes = NULL; /* the arm cannot go on round against its weight */
    CHECK(kempe_modes_new(a.system, &(kempe_modes_options){.rates = "arm=1"}, &modes) == KEMPE_E_FAILED && !modes);
    CHECK(strstr(kempe_context_message(a.context), "'arm'") != NULL);
    unload(&a);
}

/* Two oscillators that know nothing of each other change places between two values: only their shapes tell which is
 * which. */
static void curves_that_cross_go_on_as_themselves(void)
{
    loaded m =
        load_text("kempe: 1\nparameters: {k: 20}\nbodies:\n"
                  "  a: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                  "  b: {joint: {prismatic: y, at: ground}, mass: 1}\n"
                  "forces: {a: {joint: a, spring: {stiffness: k}}, b: {joint: b, spring: {stiffness: 50 - k}}}\n");
    kempe_modes *modes = modes_of(&m, (kempe_modes_options){.sweep = "k=20:31:2"});
    for (int c = 0; c < 4; c++) {
        double before = fabs(modes->locus.im[c + 0 * modes->locus.count]),
               after = fabs(modes->locus.im[c + 1 * modes->locus.count]);
        CHECK_NEAR(before * before, c < 2 ? 20 : 30, 1e-12);
        CHECK_NEAR(after * after, c < 2 ? 31 : 19, 1e-12);
    }
    kempe_modes_free(modes);
    unload(&m);
}

/* A conservative one: real parts are exactly zero up to where it buckles. */
static void buckling_is_found_by_halves(void)
{
    loaded m = load_text("kempe: 1\ngravity: [0, -10, 0]\nparameters: {k: 20}\nbodies:\n"
                         "  a: {joint: {revolute: z, at: ground}, mass: 2, com: [0, 0.5, 0]}\n"
                         "forces: {s: {joint: a, spring: {stiffness: k}}}\n");
    kempe_modes *modes = modes_of(&m, (kempe_modes_options){.at = "start", .sweep = "k=3:20:10"});
    CHECK(modes->locus.critical_count == 1);
    CHECK_NEAR(modes->locus.critical[0].value, 10, 1e-10);
    CHECK(cell(modes, "critical", 0, "frequency") < 1e-4 || isnan(cell(modes, "critical", 0, "frequency")));
    kempe_modes_free(modes);
    unload(&m);
}

static void what_is_asked_wrongly_is_reported(void)
{
    static const struct {
        kempe_modes_options options;
        kempe_status status;
        const char *word;
    } cases[] = {{{.at = "strat"}, KEMPE_E_ARGUMENT, "'strat'"},
                 {{.independent = "hub"}, KEMPE_E_ARGUMENT, "'hub'"},
                 {{.sweep = "bdy=1:2"}, KEMPE_E_ARGUMENT, "did you mean 'body'"},
                 {{.sweep = "body=1"}, KEMPE_E_ARGUMENT, "two ends"},
                 {{.sweep = "body=1:2:1"}, KEMPE_E_ARGUMENT, "2 to 1000000"},
                 {{.sweep = "body=1:2,wheel=1:2"}, KEMPE_E_ARGUMENT, "only one quantity"},
                 {{.sweep = "body=x"}, KEMPE_E_ARGUMENT, "body"},
                 {{.orders = "1,-2"}, KEMPE_E_ARGUMENT, "'-2'"},
                 {{.rates = "whel=1"}, KEMPE_E_ARGUMENT, "did you mean 'wheel'"},
                 {{.rates = "wheel=1,wheel=2"}, KEMPE_E_ARGUMENT, "twice"},
                 {{.rates = "wheel=1:2,body=2:3"}, KEMPE_E_ARGUMENT, "one of them"},
                 {{.rates = "wheel=1:2", .sweep = "body=2:3"}, KEMPE_E_ARGUMENT, "only one quantity"},
                 {{.rates = "wheel=1", .at = "start"}, KEMPE_E_ARGUMENT, "belong to an equilibrium"}};
    loaded m = load("examples/quarter_car/quarter_car.yaml");
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        kempe_modes *modes = NULL;
        CHECK(kempe_modes_new(m.system, &cases[k].options, &modes) == cases[k].status && !modes);
        bool said = strstr(kempe_context_message(m.context), cases[k].word) != NULL;
        if (!said)
            printf("%s\n", kempe_context_message(m.context));
        CHECK(said);
    }
    /* negative masses end it where they begin */
    kempe_modes *modes = NULL;
    CHECK(kempe_modes_new(m.system, &(kempe_modes_options){.sweep = "body=100:-100:5"}, &modes) == KEMPE_STOPPED &&
          modes);
    CHECK(modes->locus.reached == 3 || modes->locus.reached == 2);
    char *text = NULL;
    CHECK(kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK &&
          strstr(text, "Stopped: 'body' was swept from 100 to"));
    kempe_text_free(text);
    kempe_modes_free(modes);
    unload(&m);
    m = load_text("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                  "drives: {d: {joint: a, locked: yes}}\n");
    modes = NULL;
    CHECK(kempe_modes_new(m.system, &(kempe_modes_options){.at = "start"}, &modes) == KEMPE_OK && modes);
    CHECK(kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK &&
          strstr(text, ": complete, no modes: closures, drives or friction") && strstr(text, "0 degrees of freedom"));
    kempe_text_free(text);
    CHECK(kempe_modes_print(modes, KEMPE_JSON, &text) == KEMPE_OK && strstr(text, "\"stability\": \"none\""));
    kempe_text_free(text);
    kempe_modes_free(modes);
    unload(&m);
}

/* Whose moment has no limit at half a turn: the mass is blamed for nothing. */
static void a_bushing_turned_by_half_a_turn_is_reported(void)
{
    loaded m = load_text("kempe: 1\nground: {points: {P: [0, 0, 0]}}\nbodies:\n"
                         "  a: {joint: {motions: [{R: [1, 2, 3]}], at: ground.P}, mass: 1, inertia: {xx: 1, yy: 1, zz: "
                         "1}, points: {P: {at: [0, 0, 0], "
                         "axes: {x: -x, z: z}}}}\n"
                         "forces: {u: {bushing: [ground.P, a.P], rotational_stiffness: [1, 2, 3]}}\n");
    kempe_modes *modes = NULL;
    CHECK(kempe_modes_new(m.system, &(kempe_modes_options){.at = "start"}, &modes) == KEMPE_E_FAILED && !modes);
    CHECK(strstr(kempe_context_message(m.context), "the forces along 'a' or their derivatives are not finite") != NULL);
    unload(&m);
}

/* Shares that are equal but for rounding keep the order of their coordinates, also on both sides of a number that
 * decimal rounding divides; other shares are sorted. */
static void equal_shares_are_in_order(void)
{
    enum { N = 6 };
    static const struct {
        double share[N];
        int order[N], count;
    } cases[] = {
        {{0.1, 0.2500005, 0.4, 0.2500005, 0, 0}, {2, 1, 3, 0}, 4},
        {{0.1, 0.2500005 * (1 - 1e-15), 0.4, 0.2500005 * (1 + 1e-15), 0, 0}, {2, 1, 3, 0}, 4},
        {{0.1, 0.2500005 * (1 + 1e-15), 0.4, 0.2500005 * (1 - 1e-15), 0, 0}, {2, 1, 3, 0}, 4},
        {{0.25 * (1 - 1.5e-6), 0.25 * (1 - 0.8e-6), 0.25, 0.25 * (1 - 0.8e-6 - 1e-4), 0, 0}, {0, 1, 2, 3}, 4},
        {{0.25, 0.25 * (1 + 1e-4), -0.3, 0.3 * (1 + 1e-14), 0.3 * (1 - 1e-14), -0.1}, {2, 3, 4, 1, 0, 5}, 6},
        {{0.02 * (1 - 1e-15), 0.02 * (1 + 1e-15), 0.0199, 0.94, 0, 0}, {3, 0, 1}, 3},
        {{0}, {0}, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int most = 0; most <= N; most++) {
            int order[N];
            const int count = kmp_modes_order_shares(N, cases[i].share, most, order);
            CHECK(count == (cases[i].count < most ? cases[i].count : most));
            for (int k = 0; k < count; k++)
                CHECK(order[k] == cases[i].order[k]);
        }
}

int main(void)
{
    TEST(a_quarter_car_is_its_quartic);
    TEST(an_inverted_pendulum_falls_where_its_spring_is_weak);
    TEST(a_loaded_four_bar_falls_by_its_closures);
    TEST(what_is_cyclic_is_exactly_zero);
    TEST(eigenvalues_do_not_depend_on_u);
    TEST(undamped_ones_are_on_the_axis);
    TEST(forces_of_multipliers_leave_u_free);
    TEST(a_simulation_begun_on_a_mode_stays_on_it);
    TEST(a_wheelset_hunts_above_its_critical_speed);
    TEST(a_rotor_splits_its_frequencies);
    TEST(a_governor_swings_about_its_steady_height);
    TEST(a_start_that_goes_round_is_steady);
    TEST(a_wagon_that_rolls_is_steady);
    TEST(a_tram_runs_with_any_choice_of_its_way);
    TEST(curves_that_cross_go_on_as_themselves);
    TEST(equal_shares_are_in_order);
    TEST(buckling_is_found_by_halves);
    TEST(what_is_asked_wrongly_is_reported);
    TEST(a_bushing_turned_by_half_a_turn_is_reported);
    return check_report();
}
