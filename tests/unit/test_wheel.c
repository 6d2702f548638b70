/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels on rails: the gap against the least distance of both surfaces in space, its derivatives against differences,
 * left and right, closed forms, and both forms of contact against each other. */
#include "base/text.h"
#include "derived.h"
#include "dynamics/equations.h"
#include "model/data/model.h"
#include "model/data/wheels.h"
#include "model/read/loads.h"
#include "rail/wheel/patch.h"
#include "symbolic/table_function.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>

static kempe_context *context;

/* -- models -------------------------------------------------------------------------------------- */

enum { X, Y, Z, YAW, ROLL, SPIN, COORDINATES };

static const char *const head = "kempe: 1\n"
                                "gravity: [0, 0, -9.81]\n"
                                "profiles:\n"
                                "  W: %s\n"
                                "  R: {csv: ../../examples/profiles/%s.csv, y: y, z: z}\n"
                                "tracks: {line: {at: ground.O, rail: R, gauge: 1435 mm, inclination: 1/40%s}}\n"
                                "ground: {points: {O: [0, 0, 0]}}\n"
                                "bodies:\n"
                                "  set:\n"
                                "    joint: {name: S, motions: [T1, T2, T3, R3, R1, R2], at: ground}\n"
                                "    mass: 1250\n"
                                "    inertia: {xx: 700, yy: 100, zz: 700}\n"
                                "    points: {L: [0, 0.75, 0], R: [0, -0.75, 0]}\n"
                                "wheels:\n"
                                "  L: {on: line.left, at: set.L, profile: W, radius: 0.46, %s}\n"
                                "  R: {on: line.right, at: set.R, profile: W, radius: 0.46, %s}\n"
                                "run: {t_end: 1, outputs: [contact(L), contact(R), force(L), force(R)]}\n";

static kempe_model *read_text(const char *text)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/wheels.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

static kempe_model *read_on(const char *profile, const char *rail, const char *gauged, const char *contact)
{
    kmp_text text = {0};
    kmp_text_printf(&text, head, profile, rail, gauged, contact, contact);
    kempe_model *model = text.failed ? NULL : read_text(text.s);
    kmp_text_free(&text);
    return model;
}

static kempe_model *read_set(const char *profile, const char *contact)
{
    kmp_text file = {0};
    kmp_text_printf(&file, "{csv: ../../examples/profiles/%s.csv, y: y, z: z}", profile);
    kempe_model *model = file.failed ? NULL : read_on(file.s, "uic60", "", contact);
    kmp_text_free(&file);
    return model;
}

static bool derive(derived *d, const kempe_model *m, unsigned sets)
{
    bool ok = derived_init(d, m, sets, KMP_SCHEME_COMPOSITE, false);
    CHECK(ok);
    return ok;
}

static state random_pose(void)
{
    state s = {0};
    s.q[Y] = between(-0.004, 0.004);
    s.q[Z] = 0.46 + between(-1e-3, 1e-3);
    s.q[YAW] = between(-0.05, 0.05);
    s.q[ROLL] = between(-0.005, 0.005);
    s.q[SPIN] = between(-3, 3);
    for (int k = 0; k < COORDINATES; k++)
        s.qd[k] = between(-1, 1);
    s.qd[X] = 10;
    s.qd[SPIN] = 10 / 0.46 + between(-0.1, 0.1);
    return s;
}

/* -- the least distance in space ------------------------------------------------------------------ */

/* A wheel at a pose, axes of the track. */
typedef struct solid {
    const kmp_table *wheel, *rail;
    double centre[3], axle[3], down[3], aside[3]; /* the axle outwards; two more axes across it */
    double out;                                   /* 1: outwards is along y, -1: against it */
} solid;

static void turn(double angle, int a, int b, double v[3])
{
    double c = cos(angle), s = sin(angle), x = v[a], y = v[b];
    v[a] = c * x - s * y;
    v[b] = s * x + c * y;
}

/* R3, then R1: the spin changes nothing. */
static void to_ground(const state *s, double v[3])
{
    turn(s->q[ROLL], 1, 2, v);
    turn(s->q[YAW], 0, 1, v);
}

static solid solid_of(const kempe_model *m, int wheel, const state *s)
{
    double out = m->wheels[wheel].side == KMP_TRACK_LEFT ? 1 : -1;
    solid b = {.wheel = m->wheels[wheel].profile->height,
               .rail = m->tracks[0].rail,
               .centre = {0, 0.75 * out, 0},
               .axle = {0, out, 0},
               .down = {0, 0, -1},
               .aside = {1, 0, 0},
               .out = out};
    to_ground(s, b.centre);
    to_ground(s, b.axle);
    to_ground(s, b.down);
    to_ground(s, b.aside);
    for (int k = 0; k < 3; k++)
        b.centre[k] += s->q[k];
    return b;
}

static double gap_at(const solid *b, double s, double angle, double *slope)
{
    double r = 0.46 - kmp_table_value(b->wheel, 0, s), p[3];
    for (int k = 0; k < 3; k++)
        p[k] = b->centre[k] + s * b->axle[k] + r * (cos(angle) * b->down[k] + sin(angle) * b->aside[k]);
    *slope = kmp_table_value(b->rail, 1, b->out * p[1]);
    return p[2] - kmp_table_value(b->rail, 0, b->out * p[1]);
}

/* A grid over the part of the wheel that can touch, then ever finer ones around the best of each. Along the normal. */
static double least_gap(const solid *b, double from, double to)
{
    enum { POINTS = 200, TURNS = 60, NARROWER = 30 };
    double s = (from + to) / 2, ds = (to - from) / 2, angle = 0, da = 0.3, best = INFINITY, slope = 0;
    for (int round = 0; round < NARROWER; round++) {
        double s0 = s, a0 = angle;
        int points = round == 0 ? POINTS : 8, turns = round == 0 ? TURNS : 8;
        for (int i = -points; i <= points; i++)
            for (int k = -turns; k <= turns; k++) {
                double at, x = s0 + ds * i / points, y = a0 + da * k / turns, gap = gap_at(b, x, y, &at);
                if (gap < best) {
                    best = gap;
                    s = x;
                    angle = y;
                    slope = at;
                }
            }
        ds *= round == 0 ? 3.0 / POINTS : 0.4;
        da *= round == 0 ? 3.0 / TURNS : 0.4;
    }
    return best / sqrt(1 + slope * slope);
}

static void against_space(const char *profile)
{
    kempe_model *m = read_set(profile, "contact: rigid, creep: none");
    derived d;
    if (!m || !derive(&d, m, KMP_SET_CLOSURE))
        return;
    double worst = 0;
    for (int k = 0; k < 24; k++) {
        state s = random_pose();
        if (k % 2) { /* where the point of contact jumps on the tread, from a basin narrower than a few millimetres */
            s.q[Y] /= 10;
            s.q[YAW] /= 50;
            s.q[ROLL] /= 50;
        }
        derived_eval(&d, &s);
        for (int w = 0; w < 2; w++) {
            solid b = solid_of(m, w, &s);
            worst = check_max(worst, fabs(d.h[w] - least_gap(&b, -0.05, 0.05)));
        }
    }
    /* the search finds the place to the root of rounding, and with it the angle: of gaps of a millimetre */
    CHECK(worst < 1e-10);
    if (!(worst < 1e-10))
        printf("%s: %.3g\n", profile, worst);
    derived_free(&d);
    kempe_model_free(m);
}

static void gap_in_space(void)
{
    against_space("s1002");
    against_space("cone20");
}

/* -- derivatives --------------------------------------------------------------------------------- */

static const char *const elastic = "contact: elastic, creep: polach, damping: 0.3";

/* (f(x + d) - f(x - d)) / 2 d, and once more at half the step: the h^2 is gone. */
static void difference(derived *d, const state *at, int coordinate, bool rate, const double *const *of, int count,
                       double *out)
{
    memset(out, 0, (size_t)count * sizeof *out);
    for (int half = 0; half < 2; half++)
        for (int side = 1; side >= -1; side -= 2) {
            double step = (half ? 1e-6 : 2e-6) * side;
            state s = *at;
            (rate ? s.qd : s.q)[coordinate] += step;
            derived_eval(d, &s);
            for (int i = 0; i < count; i++)
                out[i] += (half ? 4.0 / 3 : -1.0 / 3) * (*of)[i] / (2 * step);
        }
}

static void rows_by_differences(void)
{
    kempe_model *m = read_set("s1002", "contact: rigid, creep: none");
    derived d;
    if (!m || !derive(&d, m, KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL))
        return;
    double worst[2] = {0, 0};
    for (int k = 0; k < 10; k++) {
        state s = random_pose();
        double row[2 * COORDINATES], jdqd[2], slope[2], sum[2] = {0, 0};
        derived_eval(&d, &s);
        memcpy(row, d.jacobian, sizeof row);
        memcpy(jdqd, d.jdqd, sizeof jdqd);
        for (int c = 0; c < COORDINATES; c++) {
            difference(&d, &s, c, false, &d.h, 2, slope);
            for (int w = 0; w < 2; w++)
                worst[0] = fmax(worst[0], fabs(slope[w] - row[w * COORDINATES + c]));
            difference(&d, &s, c, false, &d.hdot, 2, slope);
            for (int w = 0; w < 2; w++)
                sum[w] += slope[w] * s.qd[c];
        }
        for (int w = 0; w < 2; w++)
            worst[1] = fmax(worst[1], fabs(sum[w] - jdqd[w]) / (1 + fabs(jdqd[w])));
    }
    CHECK(worst[0] < 1e-8 && worst[1] < 1e-6);
    if (!(worst[0] < 1e-8 && worst[1] < 1e-6))
        printf("J %.3g, jdqd %.3g\n", worst[0], worst[1]);
    derived_free(&d);
    kempe_model_free(m);
}

static void tangents_by_differences(void)
{
    kempe_model *m = read_set("s1002", elastic);
    derived d;
    const unsigned sets = KMP_SET_INVERSE | KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD;
    if (!m || !derive(&d, m, sets))
        return;
    int few = 0;
    double worst = 0;
    for (int k = 0; k < 10; k++) {
        state s = random_pose();
        double by[2][COORDINATES * COORDINATES], slope[COORDINATES];
        s.q[Z] = 0.4598 - 1e-4 * k / 10;
        s.q[YAW] /= 10;
        double here = 0;
        derived_eval(&d, &s);
        memcpy(by[0], d.inverse_q, sizeof by[0]);
        memcpy(by[1], d.inverse_qd, sizeof by[1]);
        for (int rate = 0; rate < 2; rate++)
            for (int c = 0; c < COORDINATES; c++) {
                double size = 0, error = 0;
                difference(&d, &s, c, rate, &d.inverse, COORDINATES, slope);
                for (int i = 0; i < COORDINATES; i++) {
                    size = check_max(size, fabs(slope[i]));
                    error = check_max(error, fabs(slope[i] - by[rate][i * COORDINATES + c]));
                }
                here = check_max(here, error / (1e3 + size));
            }
        few += here > 1e-5;
        worst = check_max(worst, here);
    }
    /* within a step there may be a knot of a profile, where the derivative of the curvature jumps */
    CHECK(few <= 2 && worst < 1e-2);
    if (!(few <= 2 && worst < 1e-2))
        printf("tangents %.3g, %d poses\n", worst, few);
    derived_free(&d);
    kempe_model_free(m);
}

/* -- left and right ------------------------------------------------------------------------------- */

static void mirrored(void)
{
    kempe_model *m = read_set("s1002", elastic);
    derived d;
    if (!m || !derive(&d, m, KMP_SET_OUTPUT))
        return;
    /* along, across and out of the plane: what a mirror turns round */
    static const int turned[KMP_CONTACT_SHOWN] = {0, 0, 0, 0, 0, 1, 1, 0, 1, 1, 0, 0, 0};
    int contacts = kmp_wheel_contacts(&m->wheels[0]), width = contacts * KMP_CONTACT_SHOWN;
    bool same = true, pressed = false;
    for (int k = 0; k < 10; k++) {
        state s = random_pose(), other;
        double left[KMP_WHEEL_ZONES * KMP_CONTACT_SHOWN];
        s.q[Z] = 0.4597;
        other = s;
        for (int c = 0; c < 3; c++) {
            static const int odd[3] = {Y, YAW, ROLL};
            other.q[odd[c]] = -s.q[odd[c]];
            other.qd[odd[c]] = -s.qd[odd[c]];
        }
        derived_eval(&d, &s);
        memcpy(left, d.shown, (size_t)width * sizeof *left);
        derived_eval(&d, &other);
        for (int i = 0; i < width; i++) {
            double right = d.shown[width + i];
            same = same && left[i] == (turned[i % KMP_CONTACT_SHOWN] ? -right : right);
            pressed = pressed || (i % KMP_CONTACT_SHOWN == 3 && left[i] > 0);
        }
    }
    CHECK(same && pressed);
    derived_free(&d);
    kempe_model_free(m);
}

/* -- closed forms --------------------------------------------------------------------------------- */

/* A cone on a round rail: both slopes are alike where they touch. */
static void cone_on_arc(void)
{
    enum { POINTS = 401 };
    const double radius = 0.3, slope = 0.05, width = 0.03;
    kmp_text text = {0};
    kmp_text_put(&text,
                 "kempe: 1\nprofiles:\n  W: {y: [-0.05, -0.02, 0.02, 0.05], z: [-0.0025, -0.001, 0.001, 0.0025]}\n"
                 "  R: {");
    for (int list = 0; list < 2; list++) {
        kmp_text_put(&text, list ? "], z: [" : "y: [");
        for (int i = 0; i < POINTS; i++) {
            double y = width * (2.0 * i / (POINTS - 1) - 1);
            kmp_text_put(&text, i > 0 ? ", " : "");
            kmp_text_number(&text, list ? sqrt(radius * radius - y * y) - radius : y);
        }
    }
    kmp_text_put(&text, "]}\ntracks: {line: {at: ground.O, rail: R, gauge: 1435 mm, gauge_depth: 1 mm}}\n"
                        "ground: {points: {O: [0, 0, 0]}}\nbodies:\n  w:\n    joint: {name: S, motions: [T1, T2, T3], "
                        "at: ground}\n    mass: 1\n    points: {C: [0, 0, 0]}\n"
                        "wheels: {L: {on: line.left, at: w.C, profile: W, radius: 0.5, contact: rigid, creep: none}}\n"
                        "run: {t_end: 1, outputs: [contact(L)]}\n");
    kempe_model *m = text.failed ? NULL : read_text(text.s);
    derived d;
    kmp_text_free(&text);
    if (!m || !derive(&d, m, KMP_SET_CLOSURE | KMP_SET_OUTPUT))
        return;
    CHECK(m->wheels[0].zone_count == 1);
    state s = {.q = {0, 0.74, 0.51}};
    derived_eval(&d, &s);
    double lean = atan(slope), y = m->tracks[0].rail_at - radius * sin(lean), z = radius * (cos(lean) - 1);
    double gap = (0.51 - 0.5 + slope * (y - 0.74) - z) * cos(lean);
    CHECK_NEAR(d.h[0], gap, 1e-12);
    CHECK_NEAR(d.shown[0], y - 0.74, 1e-9);
    CHECK_NEAR(d.shown[1], y, 1e-9);
    CHECK_NEAR(d.shown[2], lean, 1e-9);
    derived_free(&d);
    kempe_model_free(m);
}

/* -- more zones than there is room for ------------------------------------------------------------- */

static char lines[1000];

static void on_log(void *user, kempe_level level, const char *line)
{
    size_t length = strlen(lines);
    (void)user;
    (void)snprintf(lines + length, sizeof lines - length, "%d %s\n", (int)level, line + strlen(KEMPE_ROOT));
}

/* A wheel with a wave of 3 mm and 0.1 mm: its crests, at odd multiples of 1.5 mm, touch a round rail one
 * after the other, at three rolls. */
static kempe_model *read_wave(double from, double to)
{
    enum { POINTS = 601 };
    kmp_text text = {0}, profile = {0};
    for (int list = 0; list < 2; list++) {
        kmp_text_put(&profile, list ? "], z: [" : "{y: [");
        for (int i = 0; i < POINTS; i++) {
            double y = from + (to - from) * i / (POINTS - 1);
            kmp_text_put(&profile, i > 0 ? ", " : "");
            kmp_text_number(&profile, list ? 1e-4 * cos(y * 2 * acos(-1) / 3e-3) + 0.02 * y : y);
        }
    }
    kmp_text_put(&profile, "]}");
    kmp_text_printf(&text, head, profile.s, "circular", ", gauge_depth: 5 mm", "contact: rigid",
                    "contact: rigid, zones: [[0, 10 mm]]");
    lines[0] = '\0';
    kempe_context_set_log(context, on_log, NULL);
    kempe_model *model = read_text(text.s);
    kempe_context_set_log(context, NULL, NULL);
    kmp_text_free(&profile);
    kmp_text_free(&text);
    return model;
}

static void more_zones_than_room(void)
{
    kempe_model *model = read_wave(-0.0495, 0.0495);
    CHECK(model && model->wheels[0].zone_count == KMP_WHEEL_ZONES);
    CHECK_TEXT(lines, "2 /tests/models/wheels.yaml:15:3: wheel 'L' would touch its rail in 34 zones, and has at most "
                      "8: the contact may jump at omitted borders; use "
                      "a smoother profile, or give 'zones'\n");
    kempe_model_free(model);
    model = read_wave(-0.0075, 0.0075);
    CHECK(model && model->wheels[0].zone_count == 6);
    CHECK_TEXT(lines, "");
    kempe_model_free(model);
}

/* A block of a wheel and its rail has room for so many arguments, and one more is told. */
static void arguments_end(void)
{
    kmp_graph *g = kmp_graph_new(), *local = kmp_graph_new();
    kmp_ref list[KMP_PAIR_ARGUMENTS];
    int count = 0;
    for (uint32_t k = 0; k < KMP_PAIR_ARGUMENTS; k++)
        (void)kmp_pair_argument(g, local, kmp_input(g, KMP_IN_Q, k), list, &count);
    CHECK(count == KMP_PAIR_ARGUMENTS && !kmp_graph_failed(g) && !kmp_graph_failed(local));
    (void)kmp_pair_argument(g, local, kmp_const(g, 3), list, &count);
    CHECK(!kmp_graph_failed(g) && !kmp_graph_failed(local));
    (void)kmp_pair_argument(g, local, kmp_input(g, KMP_IN_QD, 0), list, &count);
    CHECK(count == KMP_PAIR_ARGUMENTS && kmp_graph_failed(g) && kmp_graph_failed(local));
    kmp_graph_free(g);
    kmp_graph_free(local);
}

/* Outputs of a rigid wheel need multipliers: kinematics leaves them out. */
static void shown_with_loads(void)
{
    static const char *const forms[2] = {"contact: elastic", "contact: rigid, creep: none"};
    for (int rigid = 0; rigid < 2; rigid++) {
        kempe_model *m = read_set("cone20", forms[rigid]);
        CHECK(m && m->output_count == 4);
        for (int k = 0; m && k < m->output_count; k++)
            CHECK(kmp_output_has_loads(m, &m->outputs[k]) == rigid);
        kempe_model_free(m);
    }
}

/* -- both forms ----------------------------------------------------------------------------------- */

/* Heights and rolls at which f (of two) vanishes, by Newton's method with differences. */
static void settle(derived *d, state *s, const double *const *f, const int component[2])
{
    static const int unknown[2] = {Z, ROLL};
    for (int k = 0; k < 60; k++) {
        double at[2], a[2][2];
        for (int j = 0; j < 2; j++) {
            double column[COORDINATES];
            difference(d, s, unknown[j], false, f, component[1] + 1, column);
            a[0][j] = column[component[0]];
            a[1][j] = column[component[1]];
        }
        derived_eval(d, s);
        at[0] = (*f)[component[0]];
        at[1] = (*f)[component[1]];
        double det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        double step[2] = {(a[1][1] * at[0] - a[0][1] * at[1]) / det, (a[0][0] * at[1] - a[1][0] * at[0]) / det};
        double size = fmax(fabs(step[0]), fabs(step[1]));
        for (int j = 0; j < 2; j++)
            s->q[unknown[j]] -= step[j] * fmin(1, 1e-5 / size);
    }
    derived_eval(d, s);
}

/* Pressed down by its weight, a little to the side, cones on round rails; a number of the left wheel's contact that is
 * pressed. */
static double resting(const char *contact, int number, double *weight)
{
    static const char cone[] = "{y: [-0.03, -0.015, 0, 0.015, 0.03], z: [-0.0015, -0.00075, 0, 0.00075, 0.0015]}";
    kempe_model *m = read_on(cone, "circular", ", gauge_depth: 5 mm", contact);
    derived d;
    static const int rows[2] = {0, 1}, efforts[2] = {Z, ROLL};
    if (!m || !derive(&d, m, KMP_SET_CLOSURE | KMP_SET_BIAS | KMP_SET_OUTPUT))
        return NAN;
    state s = {.q = {0, 0.002, 0.4601}};
    bool rigid = d.m > 0;
    if (!rigid)
        s.q[Z] = 0.4599;
    settle(&d, &s, rigid ? &d.h : &d.bias, rigid ? rows : efforts);
    if (rigid) { /* J' lambda = C of Z and ROLL */
        const double *j = d.jacobian;
        double a = j[Z], b = j[COORDINATES + Z], c = j[ROLL], e = j[COORDINATES + ROLL];
        double det = a * e - b * c, z = d.bias[Z], r = d.bias[ROLL];
        s.lambda[0] = (z * e - b * r) / det;
        s.lambda[1] = (a * r - c * z) / det;
        derived_eval(&d, &s);
    }
    int contacts = kmp_wheel_contacts(&m->wheels[0]), width = contacts * KMP_CONTACT_SHOWN, pressed = 0;
    for (int k = 0; k < contacts; k++)
        if (d.shown[k * KMP_CONTACT_SHOWN + 3] > 0)
            pressed = k;
    double value = d.shown[pressed * KMP_CONTACT_SHOWN + number];
    *weight = d.shown[2 * width + 2] + d.shown[2 * width + 8];
    derived_free(&d);
    kempe_model_free(m);
    return value;
}

/* Both forms differ in proportion to the penetration, and where it vanishes by what the least spread of an elastic
 * wheel leaves: on rails whose spline is no circle to the last, less than a micrometre. */
static void stiffer(void)
{
    static const int numbers[2] = {0, 3}; /* s, N */
    static const double left[2] = {1e-6, 1e-3};
    double weight;
    for (int k = 0; k < 2; k++) {
        double truth = resting("contact: rigid, creep: none", numbers[k], &weight);
        CHECK_NEAR(weight, 1250 * 9.81, 1e-6);
        double soft = resting("contact: elastic, creep: none, stiffness: 1e9", numbers[k], &weight) - truth;
        CHECK_NEAR(weight, 1250 * 9.81, 1e-5);
        double hard = resting("contact: elastic, creep: none, stiffness: 1e10", numbers[k], &weight) - truth;
        CHECK_NEAR(weight, 1250 * 9.81, 1e-5);
        double hardest = resting("contact: elastic, creep: none, stiffness: 1e14", numbers[k], &weight) - truth;
        CHECK_NEAR(soft / hard, pow(10, 2.0 / 3), 0.01);
        CHECK(fabs(soft) > 2 * left[k] && fabs(hardest) < left[k]);
    }
}

int main(void)
{
    context = kempe_context_new();
    TEST(gap_in_space);
    TEST(rows_by_differences);
    TEST(tangents_by_differences);
    TEST(mirrored);
    TEST(cone_on_arc);
    TEST(more_zones_than_room);
    TEST(arguments_end);
    TEST(shown_with_loads);
    TEST(stiffer);
    kempe_context_free(context);
    return check_report();
}
