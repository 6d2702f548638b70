/* SPDX-License-Identifier: BSD-3-Clause */
/* Sweeps of coordinates against closed forms, and against themselves: rates against differences, dead centres, branches
 * kept, what is told of drives that are too few or too many. */
#include "analyses/kinematics/position_sweep.h"
#include "analyses/kinematics/sweep.h"
#include "loaded.h"
#include <kempe/kempe.h>
#include <kempe/kinematics.h>
#include <kempe/settings.h>
#include <stdbool.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

/* -- a four-bar -------------------------------------------------------------------------------------- */

typedef struct bars {
    double crank, coupler, rocker, base;
    int above; /* +1, -1: side of the line from the crank's end to D on which the joint lies */
} bars;

/* Freudenstein's four-bar: the angles of coupler (from the ground's x) and rocker, their first and second derivatives
 * at a crank that turns with 1 rad/s, from a e^(i theta) + b e^(i psi) = d + c e^(i phi). */
typedef struct angles {
    double psi, phi, psi1, phi1, psi2, phi2;
} angles;

static angles solve_four_bar(const bars *m, double theta)
{
    double a = m->crank, b = m->coupler, c = m->rocker;
    double x = a * cos(theta) - m->base, y = a * sin(theta), f = hypot(x, y); /* from D to the crank's end */
    angles r;
    r.phi = atan2(y, x) - m->above * acos((f * f + c * c - b * b) / (2 * f * c));
    r.psi = atan2(c * sin(r.phi) - y, c * cos(r.phi) - x);
    double s = sin(r.phi - r.psi), k = cos(r.phi - r.psi);
    r.phi1 = a * sin(theta - r.psi) / (c * s);
    r.psi1 = a * sin(theta - r.phi) / (b * s);
    r.phi2 = (a * cos(theta - r.psi) + b * r.psi1 * r.psi1 - c * r.phi1 * r.phi1 * k) / (c * s);
    r.psi2 = -(c * r.phi1 * r.phi1 - a * cos(theta - r.phi) - b * r.psi1 * r.psi1 * k) / (b * s);
    return r;
}

static char *four_bar_text(const bars *b, double theta)
{
    static char text[2000];
    angles r = solve_four_bar(b, theta); /* the branch */
    (void)snprintf(text, sizeof text,
                   "kempe: 1\n"
                   "ground: {points: {D: [%.17g, 0, 0]}}\n"
                   "bodies:\n"
                   "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, "
                   "points: {B: [%.17g, 0, 0]}}\n"
                   "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, "
                   "points: {C: [%.17g, 0, 0], P: [%.17g, 0.2, 0]}}\n"
                   "  c: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, "
                   "points: {C: [%.17g, 0, 0]}}\n"
                   "loops: {C: {ball: [b.C, c.C]}}\n"
                   "start: {q: {A: %.17g, B: %.17g, D: %.17g}, hold: [A]}\n"
                   "run: {outputs: [q, lambda, position(b.P), velocity(b.P), acceleration(b.P)]}\n",
                   b->base, b->crank, b->coupler, b->coupler / 2, b->rocker, theta, r.psi - theta, r.phi);
    return text;
}

/* a - b in whole turns less. */
static double turned(double a, double b)
{
    return remainder(a - b, 2 * PI);
}

static kempe_kinematics *sweep(const loaded *m, const char *drive, const char *hold, kempe_status expected)
{
    kempe_kinematics *k = NULL;
    kempe_kinematics_options options = {.sweep = drive, .hold = hold};
    kempe_status status = kempe_kinematics_new(m->system, &options, &k);
    if (status != expected)
        printf("%s: %d, %s\n", drive, (int)status, kempe_context_message(m->context));
    CHECK(status == expected);
    return k;
}

static const double *q_at(const kempe_kinematics *k, int row)
{
    return k->q + (ptrdiff_t)row * k->system->n;
}

static const double *qd_at(const kempe_kinematics *k, int row)
{
    return k->qd + (ptrdiff_t)row * k->system->n;
}

static const double *qdd_at(const kempe_kinematics *k, int row)
{
    return k->qdd + (ptrdiff_t)row * k->system->n;
}

/* The cell of a row in the table of a sweep. */
static double cell(const kempe_kinematics *k, int row, const char *column)
{
    kempe_table *table = NULL;
    CHECK(kempe_kinematics_table(k, "rows", &table) == KEMPE_OK && kempe_table_row_count(table) == k->count);
    double value = kempe_table_number(table, row, kempe_table_find(table, column));
    kempe_table_free(table);
    return value;
}

static double time_at(const kempe_kinematics *k, int row)
{
    return k->time < 0 ? k->s[row] / k->rate : kmp_sweep_parameter_value(&k->parameter[k->time], k->s[row]);
}

/* All rows on the closed form of their branch, angles without a jump. */
static void check_four_bar(const bars *b, const char *drive, int rows)
{
    loaded m = load_text(four_bar_text(b, 1));
    kempe_kinematics *k = sweep(&m, drive, NULL, KEMPE_OK);
    CHECK(k && k->count == rows && k->dead_count == 0);
    double worst[4] = {0};
    for (int row = 0; k && row < k->count; row++) {
        const double *q = q_at(k, row), *qd = qd_at(k, row);
        const double *qdd = qdd_at(k, row);
        double way = qd[0] > 0 ? 1 : -1;
        angles r = solve_four_bar(b, q[0]);
        worst[0] = fmax(worst[0], fmax(fabs(turned(q[0] + q[1], r.psi)), fabs(turned(q[2], r.phi))));
        worst[1] = fmax(worst[1], fmax(fabs(qd[0] + qd[1] - way * r.psi1), fabs(qd[2] - way * r.phi1)));
        worst[2] = fmax(worst[2], fmax(fabs(qdd[0] + qdd[1] - r.psi2), fabs(qdd[2] - r.phi2)));
        worst[3] = fmax(worst[3], fabs(q[2] - q_at(k, 0)[2]));
        CHECK(qd[0] == way && qdd[0] == 0);
    }
    CHECK(worst[0] < 1e-13 && worst[1] < 1e-12 && worst[2] < 1e-12 && worst[3] < PI); /* the rocker swings */
    kempe_kinematics_free(k);
    unload(&m);
}

static const bars crank_rocker = {0.3, 0.8, 0.7, 0.9, 1}, crossed = {0.3, 0.8, 0.7, 0.9, -1};

static void a_four_bar_follows_its_closed_form(void)
{
    check_four_bar(&crank_rocker, "A=0 deg:360 deg", 361);
    check_four_bar(&crossed, "A=0 deg:360 deg", 361);
}

static void the_branch_is_kept_whatever_the_number_of_rows(void)
{
    const bars lively = {0.3, 0.72, 0.49, 0.9, 1}, other = {0.3, 0.72, 0.49, 0.9, -1}; /* nearly a change point */
    check_four_bar(&crank_rocker, "A=0 deg:360 deg:3600", 3600);
    check_four_bar(&crank_rocker, "A=0 deg:360 deg:13", 13);
    check_four_bar(&crossed, "A=0 deg:720 deg:13", 13);
    check_four_bar(&crossed, "A=720 deg:0 deg:4", 4);
    check_four_bar(&lively, "A=0 deg:720 deg:13", 13);
    check_four_bar(&lively, "A=0 deg:720 deg:3600", 3600);
    check_four_bar(&other, "A=0 deg:-7200 deg:3", 3);
}

/* -1 .. 1, always the same ones. */
static double chance(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)*state / 2147483648.0 - 1;
}

/* The first angle beyond `from` at which the crank's end is as far from D as coupler and rocker reach, stretched or
 * folded; `to` when there is none before it. */
static double stop_of(const bars *b, double from, double to)
{
    double reach[] = {b->coupler + b->rocker, fabs(b->coupler - b->rocker)}, stop = to;
    double up = to > from ? 1 : -1;
    for (int k = 0; k < 4; k++) {
        double cosine =
            (b->crank * b->crank + b->base * b->base - reach[k / 2] * reach[k / 2]) / 2 / b->crank / b->base;
        if (fabs(cosine) > 1)
            continue;
        double angle = k % 2 ? acos(cosine) : -acos(cosine), turns = (from - angle) / (2 * PI);
        angle += 2 * PI * (up > 0 ? ceil(turns) : floor(turns));
        if (up * (angle - stop) < 0)
            stop = angle;
    }
    return stop;
}

/* 1 at right angles between coupler and rocker, 0 where they are in one line: how errors of rounding grow. */
static double regular(const bars *b, double theta)
{
    angles r = solve_four_bar(b, theta);
    return fabs(sin(r.phi - r.psi));
}

/* True if a sweep of the crank stays on its branch and ends where the closed form does. */
static bool keeps_branch(const bars *b, double from, double to, int rows)
{
    loaded m = load_text(four_bar_text(b, from));
    kempe_kinematics *k = NULL;
    char drive[100];
    (void)snprintf(drive, sizeof drive, "A=%.17g:%.17g:%d", from, to, rows);
    kempe_kinematics_options options = {.sweep = drive};
    double stop = stop_of(b, from, to);
    kempe_status status = kempe_kinematics_new(m.system, &options, &k);
    bool good = k && status == (stop == to ? KEMPE_OK : KEMPE_STOPPED) && k->change_count == 0;
    for (int row = 0; good && row < k->count; row++) {
        const double *q = q_at(k, row);
        good = fabs(turned(q[2], solve_four_bar(b, q[0]).phi)) < 1e-12 / fmax(regular(b, q[0]), 1e-6);
    }
    if (good && stop != to)
        good = k->dead_count == 1 && fabs(k->dead[0].value - stop) < 1e-13 / fmax(fabs(sin(stop)), 1e-5);
    if (!good)
        printf("%.17g %.17g %.17g %.17g %d, %s: %s\n", b->crank, b->coupler, b->rocker, b->base, b->above, drive,
               kempe_context_message(m.context));
    kempe_kinematics_free(k);
    unload(&m);
    return good;
}

/* Half of them come near to a change point, by a length between 1e-2 and 1e-8. */
static bars random_bars(unsigned *state, int kind)
{
    bars b = {0.55 + 0.45 * chance(state), 0.55 + 0.45 * chance(state), 0.55 + 0.45 * chance(state), 0, 1};
    double delta = (kind & 4 ? 1 : -1) * pow(10, -5 + 3 * chance(state));
    b.base = kind % 4 == 0   ? b.coupler + b.rocker - b.crank + delta
             : kind % 4 == 1 ? b.crank + fabs(b.coupler - b.rocker) + delta
                             : 0.55 + 0.45 * chance(state);
    b.above = chance(state) > 0 ? 1 : -1;
    return b;
}

static void near_other_branches_the_branch_is_kept(void)
{
    unsigned state = 7;
    int tried = 0;
    for (int k = 0; tried < 200; k++) {
        bars b = random_bars(&state, k);
        double from = PI * chance(&state), to = from + 14 * chance(&state);
        double far = hypot(b.crank * cos(from) - b.base, b.crank * sin(from));
        if (b.base < 0.05 || far > b.coupler + b.rocker - 1e-3 || far < fabs(b.coupler - b.rocker) + 1e-3)
            continue;
        tried++;
        CHECK(keeps_branch(&b, from, to, k % 3 ? 5 : 100));
    }
}

/* Rows at any number are the same states. */
static void rows_do_not_depend_on_their_number(void)
{
    loaded m = load_text(four_bar_text(&crank_rocker, 1));
    kempe_kinematics *few = sweep(&m, "A=0 deg:720 deg:13", NULL, KEMPE_OK);
    kempe_kinematics *many = sweep(&m, "A=0 deg:720 deg:3601", NULL, KEMPE_OK);
    for (int row = 0; few && many && row < 13; row++)
        for (int i = 0; i < 3; i++) {
            CHECK_NEAR(q_at(few, row)[i], q_at(many, 300 * row)[i], 1e-14);
            CHECK_NEAR(qdd_at(few, row)[i], qdd_at(many, 300 * row)[i], 1e-13);
        }
    kempe_kinematics_free(few);
    kempe_kinematics_free(many);
    unload(&m);
}

static void speed_scales_rates(void)
{
    loaded m = load_text(four_bar_text(&crank_rocker, 1));
    kempe_kinematics *slow = sweep(&m, "A=360 deg:0 deg:37", NULL, KEMPE_OK), *fast = NULL;
    kempe_kinematics_options options = {.sweep = "A=0:2:5", .speed = "3", .points = 5};
    CHECK(kempe_kinematics_new(m.system, &options, &fast) == KEMPE_OK);
    CHECK_NEAR(qd_at(fast, 2)[0], 3, 1e-15);
    CHECK_NEAR(qd_at(fast, 2)[2], 3 * solve_four_bar(&crank_rocker, 1).phi1, 1e-13);
    CHECK_NEAR(qdd_at(fast, 2)[2], 9 * solve_four_bar(&crank_rocker, 1).phi2, 1e-13);
    CHECK_NEAR(time_at(fast, 2), 1.0 / 3, 1e-15);
    CHECK_NEAR(qd_at(slow, 9)[0], -1, 1e-15); /* backwards */
    kempe_kinematics_free(slow);
    kempe_kinematics_free(fast);
    unload(&m);
}

/* Position outputs are the point; velocity and acceleration their rates; lambda is left out. */
static void outputs_come_along(void)
{
    loaded m = load_text(four_bar_text(&crank_rocker, 1));
    kempe_kinematics *k = sweep(&m, "A=0 deg:360 deg:73", NULL, KEMPE_OK);
    CHECK(k && k->width == 9);
    const double *q = q_at(k, 20);
    double psi = q[0] + q[1];
    angles r = solve_four_bar(&crank_rocker, q[0]);
    CHECK_NEAR(cell(k, 20, "position.b.P.x"), 0.3 * cos(q[0]) + 0.4 * cos(psi) - 0.2 * sin(psi), 1e-15);
    CHECK_NEAR(cell(k, 20, "velocity.b.P.x"), -0.3 * sin(q[0]) - r.psi1 * (0.4 * sin(psi) + 0.2 * cos(psi)), 1e-14);
    CHECK_NEAR(cell(k, 20, "acceleration.b.P.x"),
               -0.3 * cos(q[0]) - r.psi2 * (0.4 * sin(psi) + 0.2 * cos(psi)) -
                   r.psi1 * r.psi1 * (0.4 * cos(psi) - 0.2 * sin(psi)),
               1e-13);
    CHECK_NEAR(cell(k, 20, "t"), q[0], 1e-15);
    CHECK(cell(k, 20, "qdd.D") == qdd_at(k, 20)[2] && isnan(cell(k, 20, "lambda.C.1")));
    kempe_kinematics_free(k);
    unload(&m);
}

/* -- dead centres ------------------------------------------------------------------------------------ */

/* Positions with crank and coupler in one line: the triangle of base, rocker and their sum or difference. */
static double rocker_limit(const bars *b, double sum)
{
    return PI - acos((b->base * b->base + b->rocker * b->rocker - sum * sum) / (2 * b->base * b->rocker));
}

static void a_driven_rocker_has_two_dead_centres(void)
{
    loaded m = load_text(four_bar_text(&crank_rocker, 1));
    kempe_kinematics *k = sweep(&m, "D=0 deg:180 deg:721", NULL, KEMPE_STOPPED);
    double high = rocker_limit(&crank_rocker, crank_rocker.coupler - crank_rocker.crank);
    double low = rocker_limit(&crank_rocker, crank_rocker.coupler + crank_rocker.crank);
    CHECK(k && k->dead_count == 2);
    const kmp_dead_centre *first = &k->dead[0], *last = &k->dead[1];
    CHECK(!first->largest && last->largest && first->s < last->s);
    CHECK_NEAR(first->value, low, 4e-15);
    CHECK_NEAR(last->value, high, 4e-15);
    CHECK(first->determined < 1e-13 && last->determined < 1e-13 && last->margin > 0.5);
    CHECK(strstr(first->instead, "A") && !strstr(first->instead, "D"));
    kempe_table *dead = NULL;
    CHECK(kempe_kinematics_table(k, "dead_centres", &dead) == KEMPE_OK && kempe_table_row_count(dead) == 2);
    CHECK_TEXT(kempe_table_word(dead, 0, kempe_table_find(dead, "coordinate")), "D");
    CHECK_TEXT(kempe_table_word(dead, 1, kempe_table_find(dead, "extreme")), "greatest");
    CHECK(kempe_table_number(dead, 1, kempe_table_find(dead, "value")) == last->value);
    kempe_table_free(dead);
    CHECK(fabs(sin(k->dead[1].q[1])) < 1e-14); /* in one line */
    double step = PI / 720;
    CHECK(k->count == (int)floor(high / step) - (int)ceil(low / step) + 1);
    CHECK_NEAR(q_at(k, 0)[2], ceil(low / step) * step, 1e-14);
    for (int row = 0; row < k->count; row++) {
        const double *q = q_at(k, row), *qd = qd_at(k, row);
        angles r = solve_four_bar(&crank_rocker, q[0]);
        CHECK(fabs(turned(r.phi, q[2])) < 1e-13 && fabs(qd[0] * r.phi1 - 1) < 1e-10);
    }
    kempe_kinematics_free(k);
    unload(&m);
}

static void a_slider_stops_at_its_dead_centres(void)
{
    static const char format[] =
        "kempe: 1\nground: {points: {S: [0, 0, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, "
        "points: {B: [0.2, 0, 0]}}\n"
        "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, "
        "points: {C: [0.5, 0, 0]}}\n"
        "  s: {joint: {name: S, prismatic: x, at: ground.S}, mass: 1, points: {C: [0, 0, 0]}}\n"
        "loops: {C: {ball: [b.C, s.C]}}\n"
        "start: {q: {A: 1, B: -1.4, S: 0.6}, hold: [A]}\n";
    loaded m = load_text(format);
    kempe_kinematics *k = sweep(&m, "S=0:1:101", NULL, KEMPE_STOPPED);
    CHECK(k && k->dead_count == 2);
    CHECK_NEAR(k->dead[0].value, 0.3, 1e-15);
    CHECK_NEAR(k->dead[1].value, 0.7, 1e-15);
    CHECK(strstr(kempe_kinematics_reason(k), "'S' becomes no larger than 0.7"));
    CHECK(strstr(kempe_kinematics_reason(k), "'S' becomes no smaller than 0.3"));
    for (int row = 0; row < k->count; row++) {
        double x = q_at(k, row)[2], a = q_at(k, row)[0];
        double expected = acos(fmin((x * x + 0.04 - 0.25) / (0.4 * x), 1));
        CHECK(fabs(sin(expected)) < 1e-6 || fabs(a - expected) < 1e-13 / fabs(sin(expected)));
    }
    kempe_kinematics_free(k);
    k = sweep(&m, "S=0.3:0.7:41", NULL, KEMPE_OK); /* from one to the other: both are rows, without rates */
    CHECK(k && k->count == 41 && k->dead_count == 2);
    CHECK(isnan(qd_at(k, 0)[0]) && isnan(qdd_at(k, 40)[0]));
    CHECK(isfinite(qd_at(k, 1)[0]) && isfinite(qd_at(k, 39)[0]));
    CHECK_NEAR(q_at(k, 0)[0], PI, 1e-7);
    CHECK(fabs(q_at(k, 40)[0]) < 1e-7);
    kempe_kinematics_free(k);
    kempe_kinematics *none = sweep(&m, "S=0.8:1:3", NULL, KEMPE_E_FAILED);
    CHECK(none && none->count == 0 && none->dead_count == 1);
    CHECK(strstr(kempe_context_message(m.context), "'S' becomes no larger than 0.7"));
    kempe_kinematics_free(none);
    k = sweep(&m, "S=0.6:0.2:5", NULL, KEMPE_STOPPED); /* downwards: to the least */
    CHECK(k && k->dead_count == 1 && !k->dead[0].largest);
    CHECK(k->count == 3 || k->count == 4);
    kempe_kinematics_free(k);
    unload(&m);
}

/* -- change points ----------------------------------------------------------------------------------- */

static void a_parallelogram_goes_straight_on(void)
{
    loaded m = load("tests/models/parallelogram.yaml");
    kempe_kinematics *k = sweep(&m, "A=90 deg:810 deg:25", NULL, KEMPE_OK); /* flat ones among the rows */
    CHECK(k && k->change_count == 4);
    for (int c = 0; c < 4; c++)
        CHECK_NEAR(k->change[c].s, (90 + 180 * c) / 720.0, 1e-8);
    for (int row = 0; row < k->count; row++) {
        const double *q = q_at(k, row);
        CHECK(fabs(q[2] - q[0]) < 1e-11 && fabs(q[1] + q[0]) < 1e-11);
        CHECK(fabs(qd_at(k, row)[2] - 1) < 1e-8);
    }
    kempe_kinematics_free(k);
    k = sweep(&m, "A=180 deg:540 deg:3", NULL, KEMPE_OK); /* begins and ends on one */
    CHECK(k && k->count == 3 && fabs(q_at(k, 0)[2] - PI) < 1e-11);
    kempe_kinematics_free(k);
    unload(&m);
}

/* The other branch, crossed: tan(phi/2) = -4 tan(theta/2). */
static void an_antiparallelogram_stays_crossed(void)
{
    loaded m = load("tests/models/antiparallelogram.yaml");
    kempe_kinematics *k = sweep(&m, "theta=1:15:57", NULL, KEMPE_OK);
    CHECK(k && k->change_count == 4);
    for (int row = 0; row < k->count; row++) {
        const double *q = q_at(k, row);
        CHECK(fabs(turned(q[2], 2 * atan2(-4 * sin(q[0] / 2), cos(q[0] / 2)))) < 1e-11);
    }
    kempe_kinematics_free(k);
    unload(&m);
}

/* A base longer by delta: no change point but a dead centre, however near it looks, until rounding hides it. */
static void near_a_change_point_the_branch_turns(void)
{
    static const char *const delta[] = {"1e-3", "1e-6", "1e-9"};
    for (int d = 0; d < 3; d++) {
        char path[1024];
        kempe_setting longer = {"delta", delta[d]};
        loaded m = {.context = kempe_context_new()};
        (void)snprintf(path, sizeof path, "%s/tests/models/near_parallelogram.yaml", KEMPE_ROOT);
        CHECK(kempe_model_read_set(m.context, path, &longer, 1, &m.model) == KEMPE_OK);
        CHECK(kempe_system_new(m.model, &m.system) == KEMPE_OK);
        kempe_kinematics *k = sweep(&m, "A=90 deg:450 deg", NULL, KEMPE_STOPPED);
        CHECK(k && k->dead_count == 1 && k->change_count == 0);
        double base = 0.8 + atof(delta[d]); /* coupler and rocker in one line: a triangle of 0.3, base and 1.1 */
        double cosine = (0.09 + base * base - 1.21) / (2 * 0.3 * base);
        CHECK_NEAR(cos(k->dead[0].value), cosine, 1e-14);
        CHECK_NEAR(k->dead[0].value, acos(cosine), 1e-9);
        kempe_kinematics_free(k);
        unload(&m);
    }
}

/* -- rates against differences ----------------------------------------------------------------------- */

/* Every row's qd and qdd against central differences of the rows beside it, of fourth order. */
static void check_differences(const char *path, const char *drive, const char *hold, double tolerance)
{
    loaded m = load(path);
    kempe_kinematics *k = sweep(&m, drive, hold, KEMPE_OK);
    int n = kempe_model_coordinate_count(m.model);
    double rates = 0, accelerations = 0, most = 0;
    for (int row = 2; k && row < k->count - 2; row++) {
        double h = time_at(k, row + 1) - time_at(k, row);
        for (int i = 0; i < n; i++) {
            double qd = 0, qdd = 0;
            static const double weight[] = {1. / 12, -8. / 12, 0, 8. / 12, -1. / 12};
            for (int d = 0; d < 5; d++) {
                qd += weight[d] * q_at(k, row + d - 2)[i] / h;
                qdd += weight[d] * qd_at(k, row + d - 2)[i] / h;
            }
            rates = check_max(rates, fabs(qd - qd_at(k, row)[i]));
            accelerations = check_max(accelerations, fabs(qdd - qdd_at(k, row)[i]));
            most = check_max(most, fabs(qdd));
        }
    }
    if (!(rates < tolerance) || !(accelerations < tolerance) || most == 0)
        printf("%s: rates off by %.2e, accelerations by %.2e of %.2e\n", path, rates, accelerations, most);
    CHECK(rates < tolerance && accelerations < tolerance && most > 1e-3);
    kempe_kinematics_free(k);
    unload(&m);
}

static void rates_are_differences_along_the_sweep(void)
{
    check_differences("examples/stephenson/stephenson.yaml", "A=0 deg:360 deg:1441", NULL, 1e-8);
    check_differences("examples/andrews/andrews.yaml", "beta=0 deg:720 deg:2881", NULL, 1e-8);
    check_differences("examples/chebyshev/chebyshev.yaml", "crank=0 deg:360 deg:1441", NULL, 1e-7);
    check_differences("examples/chebyshev/chebyshev.yaml", "t=0:8:1441", NULL, 1e-8);
    check_differences("examples/driven_slider_crank/driven_slider_crank.yaml", "t=0:1:1001", NULL, 1e-5);
    check_differences("examples/bennett/bennett.yaml", "t=0:3:2001", NULL, 1e-5); /* redundant rows */
    check_differences("examples/stewart/stewart.yaml", "slide1=0:0.1:101,slide3=0:-0.05,slide6=0:0.02",
                      "slide2,slide4,slide5", 1e-8);
}

/* -- time and the model's own drives ----------------------------------------------------------------- */

static const char two_drives[] = "kempe: 1\n"
                                 "ground: {points: {D: [1, 0, 0]}}\n"
                                 "bodies:\n"
                                 "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, "
                                 "points: {B: [0.4, 0, 0]}}\n"
                                 "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, "
                                 "points: {C: [0.8, 0, 0]}}\n"
                                 "  c: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, "
                                 "points: {E: [0.4, 0, 0]}}\n"
                                 "  e: {joint: {name: E, revolute: z, at: c.E}, mass: 1, inertia: {zz: 1}, "
                                 "points: {C: [0.8, 0, 0]}}\n"
                                 "loops: {C: {ball: [b.C, e.C]}, L: {rod: [b.C, ground.D], length: %s}}\n"
                                 "drives: {motor: {joint: A, angle: \"1 + 2*t + t^2\"}}\n"
                                 "start: {q: {A: 1, B: -0.5, D: 2, E: 0.4}}\n"
                                 "run: {outputs: [q]}\n";

/* A crank is driven; a rod that grows with time, and a motor that turns, stand as they are at t = 0. */
static void what_moves_in_time_stands_still(void)
{
    char moving[2000], still[2000];
    (void)snprintf(moving, sizeof moving, two_drives, "\"0.6 + 0.3*t + t^2\"");
    (void)snprintf(still, sizeof still, two_drives, "0.6");
    loaded a = load_text(moving), b = load_text(still);
    kempe_kinematics *x = sweep(&a, "motor=0.7:1.4:15", NULL, KEMPE_OK), *y = sweep(&b, "A=0.7:1.4:15", NULL, KEMPE_OK);
    for (int row = 0; x && y && row < 15; row++)
        for (int i = 0; i < 4; i++) {
            CHECK_NEAR(q_at(x, row)[i], q_at(y, row)[i], 1e-13);
            CHECK_NEAR(qd_at(x, row)[i], qd_at(y, row)[i], 1e-12);
            CHECK_NEAR(qdd_at(x, row)[i], qdd_at(y, row)[i], 1e-11);
        }
    kempe_kinematics_free(x);
    kempe_kinematics_free(y);
    x = sweep(&a, "t=0:0.1:101", NULL, KEMPE_OK); /* and with time both move */
    CHECK_NEAR(q_at(x, 100)[0], 1.21, 1e-15);
    CHECK_NEAR(qd_at(x, 100)[0], 2.2, 1e-13);
    CHECK_NEAR(qdd_at(x, 100)[0], 2, 1e-12);
    kempe_kinematics_free(x);
    unload(&a);
    unload(&b);
}

/* A slider driven beyond its reach locks at the dead centres of the mechanism. */
static void a_drive_locks(void)
{
    loaded m = load("tests/models/locked_slider_crank.yaml");
    kempe_kinematics *k = sweep(&m, "t=-1:2:301", NULL, KEMPE_STOPPED);
    CHECK(k && k->dead_count == 2);
    CHECK_NEAR(k->dead[0].value, -0.5, 1e-14); /* where -0.1 - 0.2 t is 0, and -0.4 */
    CHECK_NEAR(k->dead[1].value, 1.5, 1e-14);
    CHECK_TEXT(kmp_kinematics_name(k, &k->parameter[k->first]), "t");
    CHECK(strstr(kempe_kinematics_reason(k), "locks"));
    CHECK(k->count == 201 && time_at(k, 0) == -0.5);
    CHECK_NEAR(qd_at(k, 100)[2], -0.2, 1e-15);
    kempe_kinematics_free(k);
    unload(&m);
}

static void an_interrupt_ends_it(void)
{
    loaded m = load_text(four_bar_text(&crank_rocker, 1));
    kempe_context_interrupt(m.context);
    kempe_kinematics *k = sweep(&m, "A=0:6", NULL, KEMPE_STOPPED);
    CHECK(k && k->count == 0);
    CHECK_TEXT(kempe_kinematics_reason(k), "interrupted");
    kempe_kinematics_free(k);
    unload(&m);
}

/* -- several ----------------------------------------------------------------------------------------- */

/* Ranges of a tree, whose last step ends at s = 1 itself. */
static void two_joints_move_together(void)
{
    loaded l =
        load_text("kempe: 1\nbodies:\n  a: {joint: {name: A, revolute: y, at: ground}, mass: 1, inertia: {yy: 1}, "
                  "points: {E: [1, 0, 0]}}\n"
                  "  b: {joint: {name: B, revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}}\n");
    for (int k = 0; k < 40; k++) {
        char range[80];
        (void)snprintf(range, sizeof range, "A=0.4:%g:81,B=0.1:%g", 0.5 + 0.1 * (k % 8), 0.2 + 0.1 * (k / 8));
        kempe_kinematics *swept = sweep(&l, range, NULL, KEMPE_OK);
        CHECK(swept && swept->count == 81);
        kempe_kinematics_free(swept);
    }
    unload(&l);
}

/* Six legs are driven; from the platform's pose their lengths again. */
static void a_stewart_platform_agrees_with_its_inverse(void)
{
    loaded m = load("examples/stewart/stewart.yaml");
    kempe_kinematics *k = sweep(&m,
                                "slide1=0:0.1:41,slide2=0.02:-0.1,slide3=0:0.05,slide4=0.03,slide5=0:0.12,"
                                "slide6=-0.02:0.04",
                                NULL, KEMPE_OK);
    static const double from[] = {-10, 10, 110, 130, 230, 250}, to[] = {-50, 50, 70, 170, 190, 290};
    double worst = 0;
    for (int row = 0; k && row < k->count; row++) {
        const double *q = q_at(k, row);
        double s = row / 40.0, wanted[] = {0.1 * s, 0.02 - 0.12 * s, 0.05 * s, 0.03, 0.12 * s, -0.02 + 0.06 * s};
        double cx = cos(q[3]), sx = sin(q[3]), cy = cos(q[4]), sy = sin(q[4]), cz = cos(q[5]), sz = sin(q[5]);
        for (int leg = 0; leg < 6; leg++) {
            double a = from[leg] * PI / 180, b = to[leg] * PI / 180, x = 0.5 * cos(b), y = 0.5 * sin(b);
            double x1 = cz * x - sz * y, y1 = sz * x + cz * y; /* R1 R2 R3 of (x, y, 0) */
            double x2 = cy * x1, z2 = -sy * x1;
            double dx = q[0] + x2 - cos(a), dy = q[1] + cx * y1 - sx * z2 - sin(a), dz = q[2] + 1 + sx * y1 + cx * z2;
            double rest = sqrt(pow(x - cos(a), 2) + pow(y - sin(a), 2) + 1);
            worst = check_max(worst, fabs(sqrt(dx * dx + dy * dy + dz * dz) - rest - wanted[leg]));
        }
    }
    CHECK(k && k->count == 41 && worst < 1e-14);
    kempe_kinematics_free(k);
    unload(&m);
}

/* Four legs move at once until the platform's pose is determined by them no longer. */
static void legs_stop_together(void)
{
    loaded m = load("examples/stewart/stewart.yaml");
    kempe_kinematics *k =
        sweep(&m, "slide1=0:0.9,slide2=0:0.5,slide3=0:-0.9,slide4=0,slide5=0:0.2,slide6=0", NULL, KEMPE_STOPPED);
    CHECK(k && k->dead_count == 1 && k->count > 100);
    const kmp_dead_centre *dead = &k->dead[0];
    CHECK(dead->determined < 1e-12 && dead->margin > 0.1 && dead->s < 1);
    CHECK_NEAR(k->dead[0].q[8], 0.9 * dead->s, 1e-14); /* slide1 */
    CHECK(strstr(kempe_kinematics_reason(k), "cannot continue together"));
    kempe_kinematics_free(k);
    unload(&m);
}

/* -- corners ------------------------------------------------------------------------------------------- */

/* A four-bar whose crank stands at 1 rad up to t = 0.5 and turns with 2 rad/s from then on: by a kink, or by samples
 * that end at t = 1. Forwards and backwards; a row at the corner has the rates before it. */
static void a_drive_that_sets_off(void)
{
    static const char *const drives[] = {
        "drives: {m: {joint: A, angle: \"1 + 2*max(0, t - 0.5)\"}}\n",
        "drives: {m: {joint: A, angle: 1 + u}}\ninputs: {u: {t: [0, 0.5, 1], value: [0, 0, 1], method: linear}}\n"};
    for (int k = 0; k < 4; k++) {
        char text[3000];
        (void)snprintf(text, sizeof text, "%s%s", four_bar_text(&crank_rocker, 1), drives[k % 2]);
        loaded m = load_text(text);
        kempe_kinematics *found = sweep(&m, k < 2 ? "t=0:1:11" : "t=1:0:11", NULL, KEMPE_OK);
        CHECK(found && found->count == 11);
        for (int row = 0; found && row < found->count; row++) {
            const double t = time_at(found, row), rate = t > 0.55 ? 2 : 0;
            const angles r = solve_four_bar(&crank_rocker, 1 + 2 * fmax(0, t - 0.5));
            CHECK_NEAR(turned(q_at(found, row)[2], r.phi), 0, 1e-13);
            CHECK_NEAR(qd_at(found, row)[0], rate, 1e-12);
            CHECK_NEAR(qd_at(found, row)[2], rate * r.phi1, 1e-12);
        }
        kempe_kinematics_free(found);
        unload(&m);
    }
}

/* The path of a constraint with a kink is followed on both sides; a jump ends it. */
static void a_constraint_with_a_kink(void)
{
    static const char bodies[] = "kempe: 1\nbodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                                 "  b: {joint: {name: y, prismatic: y, at: ground}, mass: 1}\n"
                                 "loops: {c: {constraint: \"q(y) - %s\"}}\n";
    char text[1000];
    (void)snprintf(text, sizeof text, bodies, "3*abs(q(x) - 0.1)");
    loaded m = load_text(text);
    kempe_kinematics *k = sweep(&m, "x=-0.45:0.5:20", NULL, KEMPE_OK);
    CHECK(k && k->count == 20);
    for (int row = 0; k && row < k->count; row++) {
        const double x = q_at(k, row)[0] - 0.1;
        CHECK_NEAR(q_at(k, row)[1], 3 * fabs(x), 1e-14);
        CHECK_NEAR(fabs(x) > 0.01 ? qd_at(k, row)[1] : 3, x < -0.01 ? -3 : 3, 1e-13);
    }
    kempe_kinematics_free(k);
    unload(&m);
    (void)snprintf(text, sizeof text, bodies, "if(q(x) < 0.1, 0, 0.1)");
    m = load_text(text);
    k = sweep(&m, "x=0:0.5:11", NULL, KEMPE_E_FAILED);
    CHECK(k && strstr(kempe_kinematics_reason(k), "the position changes abruptly"));
    kempe_kinematics_free(k);
    unload(&m);
}

/* -- what is told ------------------------------------------------------------------------------------ */

static void refused(const loaded *m, kempe_kinematics_options options, kempe_status status, const char *said)
{
    kempe_kinematics *k = NULL;
    kempe_status got = kempe_kinematics_new(m->system, &options, &k);
    if (got != status || !strstr(kempe_context_message(m->context), said))
        printf("%s: %s\n", options.sweep ? options.sweep : "", kempe_context_message(m->context));
    CHECK(got == status && strstr(kempe_context_message(m->context), said) && !k);
}

static void what_cannot_be_driven_is_reported(void)
{
    loaded bar = load_text(four_bar_text(&crank_rocker, 1)), stewart = load("examples/stewart/stewart.yaml");
    loaded driven = load("examples/driven_slider_crank/driven_slider_crank.yaml");
    loaded flat = load("tests/models/parallelogram_flat.yaml");
    refused(&bar, (kempe_kinematics_options){0}, KEMPE_E_ARGUMENT, "the swept coordinate is missing");
    refused(&bar, (kempe_kinematics_options){.sweep = "A"}, KEMPE_E_ARGUMENT, "NAME=A:B");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=1"}, KEMPE_E_ARGUMENT, "nothing is swept");
    refused(&bar, (kempe_kinematics_options){.sweep = "X=0:1"}, KEMPE_E_ARGUMENT, "'X' is not a coordinate");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1,A=0:2"}, KEMPE_E_ARGUMENT, "'A' is swept or held twice");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1:3,D=0:1:4"}, KEMPE_E_ARGUMENT, "3 and 4");
    refused(&bar, (kempe_kinematics_options){.sweep = "t=0:1", .speed = "2"}, KEMPE_E_ARGUMENT,
            "a speed and a range of t");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1", .hold = "t"}, KEMPE_E_ARGUMENT,
            "the time cannot be held");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1", .release = "C"}, KEMPE_E_ARGUMENT, "'C' is not a drive");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1", .points = 1}, KEMPE_E_ARGUMENT, "1 rows");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1", .backend = "none"}, KEMPE_E_ARGUMENT, "none");
    refused(&bar, (kempe_kinematics_options){.sweep = "A=0:1", .hold = "D"}, KEMPE_E_FAILED, "1 too many");
    refused(&bar, (kempe_kinematics_options){.sweep = "t=0:1"}, KEMPE_E_FAILED, "sweep or hold 1 more, for instance");
    refused(&stewart, (kempe_kinematics_options){.sweep = "slide1=0:1"}, KEMPE_E_FAILED, "sweep or hold 5 more");
    refused(
        &stewart,
        (kempe_kinematics_options){.sweep = "slide1=0:0.1", .hold = "leg1.1,leg1.2,platform.1,platform.2,platform.3"},
        KEMPE_E_FAILED, "is determined by the other");
    refused(&driven, (kempe_kinematics_options){.sweep = "slider=0:1"}, KEMPE_E_FAILED, "no degree of freedom");
    refused(&driven, (kempe_kinematics_options){.sweep = "slider=0:1", .release = "motor"}, KEMPE_E_FAILED,
            "it is at a dead centre");
    refused(&flat, (kempe_kinematics_options){.sweep = "A=0:1"}, KEMPE_E_FAILED, "degrees of freedom");
    unload(&bar);
    unload(&stewart);
    unload(&driven);
    unload(&flat);
}

int main(void)
{
    TEST(a_four_bar_follows_its_closed_form);
    TEST(the_branch_is_kept_whatever_the_number_of_rows);
    TEST(near_other_branches_the_branch_is_kept);
    TEST(rows_do_not_depend_on_their_number);
    TEST(speed_scales_rates);
    TEST(outputs_come_along);
    TEST(a_driven_rocker_has_two_dead_centres);
    TEST(a_slider_stops_at_its_dead_centres);
    TEST(a_parallelogram_goes_straight_on);
    TEST(an_antiparallelogram_stays_crossed);
    TEST(near_a_change_point_the_branch_turns);
    TEST(rates_are_differences_along_the_sweep);
    TEST(what_moves_in_time_stands_still);
    TEST(a_drive_locks);
    TEST(an_interrupt_ends_it);
    TEST(two_joints_move_together);
    TEST(legs_stop_together);
    TEST(a_stewart_platform_agrees_with_its_inverse);
    TEST(a_drive_that_sets_off);
    TEST(a_constraint_with_a_kink);
    TEST(what_cannot_be_driven_is_reported);
    return check_report();
}
