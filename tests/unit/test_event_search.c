/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions that hold for a part of a step only: none is missed, on any formulation, by any integrator, and none is
 * seen that is not there. A mass without forces goes on at 1 m/s, so that steps become as long as the run and the
 * conditions' forces, too weak to matter, happen at places known beforehand; a mass on a spring swings as a cosine. */
#include "base/memory.h"
#include "integrators/events/event_pieces.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "testing.h"
#include <math.h>
#include <stdlib.h>

enum { MOST = 64, ROWS = 61 };

typedef struct seen {
    int count;
    double t[MOST];
    double q, qd; /* at the end */
} seen;

static seen *watching;

/* "t = 1.31811622: event: 'w': .. became true" or the like: the time is what counts. */
static void take_note(void *user, kempe_level level, const char *line)
{
    const char *at = strstr(line, "t = ");
    (void)user;
    if (level != KEMPE_LOG_INFO || !strstr(line, " became ") || !at || watching->count >= MOST)
        return;
    watching->t[watching->count++] = strtod(at + 4, NULL);
}

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    seen *s = user;
    (void)t, (void)qdd, (void)lambda, (void)work;
    s->q = q[0];
    s->qd = qd[0];
    return 0;
}

static const char *const model = "kempe: 1\n"
                                 "bodies: {m: {joint: {name: A, prismatic: x, at: ground}, mass: 1}}\n"
                                 "forces:\n"
                                 "  spring: {joint: A, force: \"-(%s)*q(A)\"}\n"
                                 "  w: {joint: A, force: \"%s\"}\n"
                                 "  x: {joint: A, force: \"%s\"}\n"
                                 "start: {q: {A: %s}, qd: {A: %s}}\n"
                                 "run: {t_end: 6, rtol: 1e-6, until: [\"%s\"]}\n";

static loaded moving(bool swings, const char *force, const char *other, const char *until)
{
    char text[2048];
    (void)snprintf(text, sizeof text, model, swings ? "1" : "1e-30", force, other, swings ? "-1" : "0",
                   swings ? "0" : "1", until);
    return load_text(text);
}

static kempe_status run(const loaded *s, const kmp_method *method, double rtol, seen *found)
{
    double times[ROWS];
    kmp_run_report report;
    kmp_run_spec spec = {.formulation = method->formulation,
                         .form = method->form,
                         .integrator = method->integrator,
                         .rtol = rtol,
                         .t_end = 6,
                         .times = times,
                         .time_count = ROWS};
    for (int k = 0; k < ROWS; k++)
        times[k] = 6.0 * k / (ROWS - 1);
    CHECK(kmp_run_resolve(s->system, &spec) == KEMPE_OK);
    *found = (seen){0};
    watching = found;
    kempe_context_set_log(s->context, take_note, NULL);
    kempe_status status = kmp_run(s->system, &spec, NULL, take_row, found, &report);
    if (status == KEMPE_E_FAILED)
        printf("  %s %s: %s\n", method->formulation, method->integrator, report.reason ? report.reason : "");
    CHECK(report.events == found->count || found->count == MOST);
    kmp_free(report.reason);
    return status;
}

/* By every way, at the times given, to `off`. */
static void changes_at(const loaded *s, int count, const double *t, double rtol, double off)
{
    kmp_method method;
    seen found;
    for (int k = 0; kmp_method_get(k, &method); k++) {
        CHECK(run(s, &method, rtol, &found) == KEMPE_OK);
        if (found.count != count)
            printf("  %s %s %s: %d events instead of %d\n", method.formulation, method.form ? method.form : "",
                   method.integrator, found.count, count);
        CHECK(found.count == count);
        for (int i = 0; i < count && i < found.count; i++)
            CHECK_NEAR(found.t[i], t[i], off);
    }
}

/* Windows of the place and of the time, narrow and narrower, two in a step, and one that points would miss. */
static void windows(void)
{
    static const struct {
        const char *force;
        int count;
        double t[8];
    } cases[] = {
        {"if(abs(q(A) - 2) < 0.25, 1e-9, 0)", 2, {1.75, 2.25}},
        {"if(abs(q(A) - 2) < 1e-3, 1e-9, 0)", 2, {1.999, 2.001}},
        {"if(abs(q(A) - 3) < 1e-6, 1e-9, 0)", 2, {2.999999, 3.000001}},
        {"if(abs(t - 3.3) < 1e-5, 1e-9, 0)", 2, {3.29999, 3.30001}},
        {"if((q(A) - 2)^2 < 1e-6, 1e-9, 0)", 2, {1.999, 2.001}},
        {"if(min(abs(q(A) - 2), abs(q(A) - 2.5)) < 1e-3, 1e-9, 0)", 4, {1.999, 2.001, 2.499, 2.501}},
        {"if(max(2 - q(A), q(A) - 2.01) < 0, 1e-9, 0)", 2, {2, 2.01}},
        {"if((q(A) - 2)*(q(A) - 2.001)*(q(A) - 2.002)*(q(A) - 2.003) < 0, 1e-9, 0)", 4, {2, 2.001, 2.002, 2.003}},
        {"if(exp(-1e6*(q(A) - 4)^2) > 0.5, 1e-9, 0)", 2, {4 - 8.325546111576978e-4, 4 + 8.325546111576978e-4}},
        {"if(atan2(q(A) - 2, 1e-3) < if(q(A) > 2.5, 9, -9), 1e-9, 0)", 2, {2.5, 2.5}},
        {"if(abs(q(A) - 2) < 1e-3, if(t > 2, 1e-9, 2e-9), 0)", 3, {1.999, 2, 2.001}},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        printf("  %s\n", cases[k].force);
        loaded s = moving(false, cases[k].force, "0", "t > 7");
        changes_at(&s, cases[k].count, cases[k].t, 1e-6, 1e-7);
        unload(&s);
    }
}

/* A wave of which a step spans many periods: each change of sign. */
static void many_in_a_step(void)
{
    double t[24];
    for (int k = 0; k < 24; k++)
        t[k] = 0.25 * (k + 1) - 0.125;
    loaded s = moving(false, "if(cos(4*pi*q(A)) < 0, 1e-9, 0)", "0", "t > 7");
    changes_at(&s, 24, t, 1e-6, 1e-7);
    unload(&s);
}

/* Conditions in conditions: the inner window is at 0.5 where q > 0.3 and at 0.1 before. */
static void nested(void)
{
    const double t[] = {0.09, 0.11, 0.3, 0.49, 0.51}, two[] = {1, 1.5, 2.5, 3};
    loaded s = moving(false, "if(abs(q(A) - if(q(A) > 0.3, 0.5, 0.1)) < 0.01, 1e-9, 0)", "0", "t > 7");
    changes_at(&s, 5, t, 1e-6, 1e-7);
    unload(&s);
    s = moving(false, "if(abs(q(A) - 2) < 1, if(abs(q(A) - 2) < 0.5, 1e-9, 2e-9), 0)", "0", "t > 7");
    changes_at(&s, 4, two, 1e-6, 1e-7);
    unload(&s);
}

/* Two conditions that change at the same instant, and a narrow one beside a wide one. */
static void several_at_once(void)
{
    const double t[] = {2, 2, 2.001}, order[] = {1, 1.999, 2.001, 3};
    loaded s = moving(false, "if(abs(q(A) - 2.0005) < 0.0005, 1e-9, 0)", "if(t > 2, 1e-9, 0)", "t > 7");
    changes_at(&s, 3, t, 1e-6, 1e-7);
    unload(&s);
    s = moving(false, "if(abs(q(A) - 2) < 1, 1e-9, 0)", "if(abs(t - 2) < 0.001, 1e-9, 0)", "t > 7");
    changes_at(&s, 4, order, 1e-6, 1e-7);
    unload(&s);
}

/* On a spring q = -cos t: windows of the rate; an end that is just passed, and one that is just not reached. */
static void of_a_swing(void)
{
    const double pi = acos(-1.0), rate[] = {asin(0.5) - 1.1547e-6, asin(0.5) + 1.1547e-6, pi - asin(0.5) - 1.1547e-6,
                                            pi - asin(0.5) + 1.1547e-6};
    const double top[] = {pi - acos(1 - 1e-4), pi + acos(1 - 1e-4)};
    loaded s = moving(true, "if(abs(qd(A) - 0.5) < 1e-6, 1e-9, 0)", "0", "t > 7");
    changes_at(&s, 4, rate, 1e-9, 1e-5);
    unload(&s);
    s = moving(true, "if(q(A) > 1 - 1e-4, 1e-9, 0)", "0", "t > 7");
    changes_at(&s, 2, top, 1e-8, 1e-3);
    unload(&s);
    s = moving(true, "if(q(A) > 1 + 1e-4, 1e-9, 0)", "0", "t > 7");
    changes_at(&s, 0, NULL, 1e-8, 0);
    unload(&s);
}

/* A condition that ends a run is found in a window too; one that never holds ends nothing. */
static void ends(void)
{
    kmp_method method;
    seen found;
    loaded s = moving(false, "0", "0", "abs(q(A) - 2) < 1e-4");
    for (int k = 0; kmp_method_get(k, &method); k++) {
        CHECK(run(&s, &method, 1e-6, &found) == KEMPE_STOPPED);
        CHECK_NEAR(found.q, 2 - 1e-4, 1e-7);
    }
    unload(&s);
}

static const char *const with_unknown = "kempe: 1\n"
                                        "algebraic: {u: {of: {y: 0}, zero: \"y + 0.1*sin(y) - q(A)\"}}\n"
                                        "bodies: {m: {joint: {name: A, prismatic: x, at: ground}, mass: 1}}\n"
                                        "forces: {w: {joint: A, force: \"if(abs(y - 2) < 1e-3, 1e-9, 0)\"}}\n"
                                        "start: {q: {A: 0}, qd: {A: 1}}\n"
                                        "run: {t_end: 6, rtol: 1e-6}\n";

/* A window of what an implicit block solves for. */
static void of_an_unknown(void)
{
    const double t[] = {1.999 + 0.1 * sin(1.999), 2.001 + 0.1 * sin(2.001)};
    loaded s = load_text(with_unknown);
    changes_at(&s, 2, t, 1e-6, 1e-7);
    unload(&s);
}

static const char *const driven = "kempe: 1\n"
                                  "bodies:\n"
                                  "  m: {joint: {name: A, prismatic: x, at: ground}, mass: 2}\n"
                                  "  n: {joint: {name: B, prismatic: y, at: ground}, mass: 1}\n"
                                  "drives: {d: {joint: A, displacement: \"sin(t)\"}}\n"
                                  "start: {q: {A: 0}, qd: {A: 1}}\n"
                                  "run: {t_end: 6, rtol: 1e-6, until: [\"abs(lambda(d) - 1) < 1e-3\"]}\n";

/* A multiplier within a window ends the run: 2 sin t = -1 within 1e-3. Forms that do not have them exactly are
 * left out. */
static void of_a_multiplier(void)
{
    kmp_method method;
    seen found;
    loaded s = load_text(driven);
    for (int k = 0; kmp_method_get(k, &method); k++) {
        if (strcmp(method.formulation, "dae") == 0 && strcmp(method.form, "stabilized1") != 0)
            continue;
        CHECK(run(&s, &method, 1e-6, &found) == KEMPE_STOPPED);
        CHECK_NEAR(found.q, -0.4995, 1e-5);
    }
    unload(&s);
}

/* Looking costs no steps and few evaluations: a condition that stays away takes the steps of a run without one, and
 * less than one evaluation a step more. */
static void what_is_far_costs_little(void)
{
    loaded without = moving(true, "0", "0", "t > 7"),
           with = moving(true, "if(abs(q(A) - 5) < 0.1, 1, 0)", "0", "t > 7");
    kmp_run_report a, b;
    double end = 600;
    kmp_run_spec spec = {.rtol = 1e-8, .t_end = 6, .times = &end};
    seen found;
    CHECK(kmp_run_resolve(without.system, &spec) == KEMPE_OK);
    CHECK(kmp_run(without.system, &spec, NULL, take_row, &found, &a) == KEMPE_OK);
    CHECK(kmp_run(with.system, &spec, NULL, take_row, &found, &b) == KEMPE_OK);
    printf("  %ld evaluations without, %ld with, in %ld steps\n", a.rhs, b.rhs, b.steps);
    CHECK(a.steps == b.steps && b.rhs <= a.rhs + b.steps);
    kmp_free(a.reason);
    kmp_free(b.reason);
    unload(&without);
    unload(&with);
}

/* The peaks of sin a + sin 2a / 2 are 1.299038: over 1591 turns in a step of 10 s a condition is decided for a limit
 * near them, and named for one that is nearer. */
static void near_peaks(void)
{
    static const struct {
        const char *limit;
        kempe_status status;
    } rows[] = {{"1.3", KEMPE_OK}, {"1.2990382", KEMPE_UNTRUSTED}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char text[600];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nbodies: {d: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}},\n"
                       "  m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                       "forces: {f: {joint: x, force: \"if(sin(q(A)) + 0.5*sin(2*q(A)) > %s, 1, 0)\"}}\n"
                       "start: {qd: {A: 1000}}\nrun: {t_end: 100}\n",
                       rows[k].limit);
        loaded l = load_text(text);
        kempe_trajectory *t = NULL;
        const kempe_run_options ask = {.no_convergence_check = 1};
        CHECK(l.system && kempe_simulate(l.system, &ask, &t) == rows[k].status);
        char *said = kmp_context_warnings(l.context);
        CHECK(said && (strstr(said, "'f': sin(q(A)) + 0.5*sin(2*q(A)) > ") != NULL) == (k > 0));
        kmp_free(said);
        kempe_trajectory_free(t);
        unload(&l);
    }
}

/* -- values by cancellation ------------------------------------------------------------------------------ */

/* A distance of two bodies that move together, or nearly: bounds of their places alone know it to a metre a second. */
typedef struct pair {
    double distance, rate, bend; /* at t = 0 */
    double width;                /* of the last piece */
    int looks;
} pair;

static int look_at_pair(void *self, double t, kmp_event_probe *probe)
{
    pair *p = self;
    p->looks++;
    probe->t = t;
    probe->change[0] = p->distance + t * (p->rate + t * p->bend) + 1e-16 * sin(1e7 * t);
    return 0;
}

static void bind_pair(void *self, const kmp_step_piece *piece, const bool *open)
{
    (void)open;
    ((pair *)self)->width = piece->b->t - piece->a->t;
}

static kmp_bound bound_of_pair(const void *self, int k)
{
    const pair *p = self;
    (void)k;
    return (kmp_bound){-p->width, p->width, -1, 1};
}

static bool always(const void *self, int k)
{
    (void)self, (void)k;
    return true;
}

static bool never(const void *self, int k)
{
    (void)self, (void)k;
    return false;
}

static int end_of_pair(void *self, const kmp_event_probe *a, const kmp_event_probe *b, bool *found)
{
    (void)self, (void)a;
    *found = b->change[0] < 0;
    return 0;
}

static bool search_pair(pair *p)
{
    static const kmp_piece_site site = {look_at_pair, bind_pair, bound_of_pair, always, never, end_of_pair};
    static bool open[KMP_SEARCH_DEPTH + 1], third[1];
    static double change[KMP_SEARCH_LOOKS];
    kmp_piece_search s = {.site = &site, .self = p, .conditions = 1, .third = third, .open = open};
    bool found = false;
    for (int i = 0; i < KMP_SEARCH_LOOKS; i++)
        s.look[i].change = &change[i];
    p->looks = 0;
    for (int i = 0; i < 2; i++)
        CHECK(look_at_pair(p, 0.03 * i, &s.look[i]) == 0);
    CHECK(kmp_pieces_search(&s, &found) == 0 && s.undecided == 0);
    return found;
}

/* A distance that stays is known from few places, and one that changes is found however small it is. */
static void by_cancellation(void)
{
    pair stays = {.distance = 6.5e-13}, comes = {.distance = 6.5e-13, .rate = -6.5e-11},
         turns = {.distance = 6.5e-13, .rate = -2e-10, .bend = 5e-9}, large = {.distance = 1e-5};
    CHECK(!search_pair(&stays) && stays.looks <= 12);
    CHECK(search_pair(&comes));
    CHECK(search_pair(&turns));
    CHECK(!search_pair(&large) && large.looks > 1000); /* no cancellation: by the bounds alone */
}

int main(void)
{
    TEST(windows);
    TEST(many_in_a_step);
    TEST(nested);
    TEST(several_at_once);
    TEST(of_a_swing);
    TEST(ends);
    TEST(of_an_unknown);
    TEST(of_a_multiplier);
    TEST(what_is_far_costs_little);
    TEST(near_peaks);
    TEST(by_cancellation);
    return check_report();
}
