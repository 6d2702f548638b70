/* SPDX-License-Identifier: BSD-3-Clause */
/* Runs with many contacts that leave out, for a while, those that the motion cannot reach: the same motion, impacts and
 * log as with all of them, also where a contact comes near that was not foreseen. */
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/validity.h"
#include "integrators/run/events.h"
#include "integrators/run/methods.h"
#include "integrators/run/near_runs.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "model/data/body.h"
#include "model/data/run_settings.h"
#include "scene_text.h"
#include "testing.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SIDE = 4, BALLS = SIDE * SIDE, ROWS = 21, MOST = 1000 };

/* -- scenes ------------------------------------------------------------------------------------------------ */

/* Balls between four walls, each of which may touch each other one. `end`: of the mapping of a contact; `more`: further
 * sections of the model. */
static void put_balls(scene *s, const char *gravity, const char *end, const char *more)
{
    static const char *const wall[] = {"ground.A, normal: x", "ground.A, normal: y", "ground.B, normal: -x",
                                       "ground.B, normal: -y"};
    s->length = 0;
    put(s, "kempe: 1\ngravity: %s\nground: {points: {A: [0, 0, 0], B: [%g, %g, 0]}}\nbodies:\n", gravity, 0.5 * SIDE,
        0.5 * SIDE);
    for (int i = 0; i < BALLS; i++)
        put(s,
            "  s%d: {joint: {name: j%d, planar: z, at: ground}, mass: 1, inertia: {zz: 0.004}, points: {C: [0, 0, "
            "0]}}\n",
            i, i);
    put(s, "contacts:\n");
    for (int i = 0; i < BALLS; i++) {
        for (int w = 0; w < 4; w++)
            put(s, "  w%d_%d: {sphere: s%d.C, radius: 0.1, on: {plane: %s}, %s}\n", i, w, i, wall[w], end);
        for (int k = 0; k < i; k++)
            put(s, "  c%d_%d: {sphere: s%d.C, radius: 0.1, on: {sphere: s%d.C, radius: 0.1}, %s}\n", i, k, i, k, end);
    }
    put(s, "%sstart:\n  q: {", more);
    for (int i = 0; i < BALLS; i++)
        put(s, "j%d.1: %g, j%d.2: %g%s", i, 0.25 + 0.5 * (i % SIDE), i, 0.25 + 0.5 * (i / SIDE),
            i < BALLS - 1 ? ", " : "}\n  qd: {");
    for (int i = 0; i < BALLS; i++)
        put(s, "j%d.1: %.4f, j%d.2: %.4f%s", i, cos(i * i + 1), i, sin(i * i + 1), i < BALLS - 1 ? ", " : "}\n");
}

/* -- runs -------------------------------------------------------------------------------------------------- */

typedef struct run_rows {
    int width, count;
    double row[ROWS][MOST], work;
    kmp_run_report report;
    kempe_status status;
} run_rows;

static int keep(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    run_rows *r = user;
    (void)t, (void)qd, (void)qdd, (void)lambda; /* they follow q */
    memcpy(r->row[r->count++], q, (size_t)r->width * sizeof *q);
    r->work = work;
    return 0;
}

/* A run of the model until its end; `whole`: with all contacts all the time. */
static void simulate(const loaded *l, bool whole, int rows, kmp_run_log *log, run_rows *found)
{
    double times[ROWS];
    const double end = kmp_model_run(l->model)->t_end;
    for (int k = 0; k < rows; k++)
        times[k] = end * k / (rows - 1);
    kmp_run_spec spec = {.formulation = "reduced",
                         .rtol = 1e-8,
                         .atol = 1e-8,
                         .t_end = end,
                         .times = times,
                         .time_count = rows,
                         .log = log};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_near_may_pay(l->system, &spec));
    *found = (run_rows){.width = 3 * l->system->n};
    CHECK(found->width + l->system->m <= MOST);
    found->status = (whole ? kmp_run_whole : kmp_run)(l->system, &spec, NULL, keep, found, &found->report);
    if (found->status != KEMPE_OK)
        printf("  ends at t = %g: %s\n", found->report.t, found->report.reason ? found->report.reason : "");
    kmp_free(found->report.reason);
    found->report.reason = NULL;
}

static double apart(const run_rows *a, int i, const run_rows *b, int k, int n)
{
    double most = 0;
    for (int j = 0; j < n; j++)
        most = fmax(most, fabs(a->row[i][j] - b->row[k][j]));
    return most;
}

/* Both runs of a scene: the same places, impacts, changes and work. Returns the impacts. */
static long both(const scene *s, double bound)
{
    static run_rows pieces, whole;
    loaded l = load_text(s->text);
    simulate(&l, false, ROWS, NULL, &pieces);
    simulate(&l, true, ROWS, NULL, &whole);
    CHECK(pieces.status == KEMPE_OK && whole.status == KEMPE_OK);
    CHECK(pieces.count == ROWS && whole.count == ROWS);
    for (int k = 0; k < ROWS; k++)
        CHECK_NEAR(apart(&pieces, k, &whole, k, l.system->n), 0, bound);
    CHECK(pieces.report.impacts == whole.report.impacts);
    CHECK_NEAR(pieces.work, whole.work, 1e-6);
    CHECK(pieces.report.steps != whole.report.steps); /* pieces were made */
    unload(&l);
    return pieces.report.impacts;
}

static scene s;

/* Balls that rub each other and the walls. */
static void with_friction(void)
{
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2", "");
    put(&s, "run: {t_end: 0.8}\n");
    CHECK(both(&s, 1e-6) > 20);
    put_balls(&s, "[0.3, -9.81, 0]", "restitution: 0.3, friction: 0.3", "");
    put(&s, "run: {t_end: 0.35}\n");
    CHECK(both(&s, 1e-6) > 10);
}

/* A push that begins when nothing foretells it: contacts are reached that were far away. */
static void unforeseen(void)
{
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2",
              "forces: {f: {joint: j0.1, force: \"if(t > 0.2, 4000*exp(-((t - 0.22)/0.004)^2), 0)\"}}\n");
    put(&s, "run: {t_end: 0.35}\n");
    CHECK(both(&s, 1e-6) > 5);
}

/* The words of a motion are those of its attempts that count, each once: a table that every piece leaves, and one that
 * only a motion through walls would leave. */
static void words_of_attempts(void)
{
    static run_rows all;
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2",
              "tables: {late: {x: [0, 0.1], y: [0, 1e-9], method: linear}, far: {x: [-0.1, 2.1], y: [0, 1e-9], method: "
              "linear}}\n"
              "forces: {f: {joint: j0.1, force: \"if(t > 0.2, 40000*exp(-((t - 0.22)/0.004)^2), 0) + late(t) + "
              "far(q(j0.1))\"}}\n");
    put(&s, "run: {t_end: 0.26}\n");
    loaded l = load_text(s.text);
    simulate(&l, false, ROWS, NULL, &all);
    CHECK(all.status == KEMPE_OK);
    const char *doubts = kmp_context_doubts(l.context), *first = strstr(doubts, "table 'late'");
    CHECK(first && !strstr(first + 1, "table 'late'"));
    CHECK(!strstr(doubts, "table 'far'"));
    unload(&l);
}

/* Rows at other times are of the same motion, and the log has its impacts in the order of their times. */
static void rows_and_log(void)
{
    static run_rows many, few;
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2", "");
    put(&s, "run: {t_end: 0.6}\n");
    loaded l = load_text(s.text);
    kmp_run_log log = {.context = l.context};
    simulate(&l, false, ROWS, &log, &many);
    simulate(&l, false, 2, NULL, &few);
    CHECK(few.count == 2 && apart(&many, ROWS - 1, &few, 1, l.system->n) < 1e-6);
    CHECK(few.report.impacts == many.report.impacts && log.count >= many.report.impacts);
    for (int k = 1; k < log.kept; k++)
        CHECK(log.entries[k].t >= log.entries[k - 1].t);
    kmp_run_log_free(&log);
    unload(&l);
}

/* A force that ends: the run has its rows until then, and the reason. */
static void one_that_fails(void)
{
    static run_rows all;
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2",
              "forces: {f: {joint: j3.3, torque: \"1e-3*sqrt(0.35 - t)\"}}\n");
    put(&s, "run: {t_end: 0.6}\n");
    loaded l = load_text(s.text);
    simulate(&l, false, ROWS, NULL, &all);
    CHECK(all.status == KEMPE_E_FAILED || all.status == KEMPE_STOPPED);
    CHECK(all.report.t > 0.3 && all.report.t < 0.36);
    CHECK(all.count == 1 + (int)(all.report.t / 0.6 * (ROWS - 1)));
    unload(&l);
}

/* Models with a past or states are run whole: to the last bit as with all contacts. */
static void with_a_past(void)
{
    static const char soft[] =
        "  soft: {sphere: s4.C, radius: 0.1, on: {plane: ground.A, normal: y}, law: hunt_crossley, "
        "stiffness: 1e4, damping: 0.2}\n";
    static const char *const more[] = {
        "states: {d: {delay: q(j4.1), time: 0.05}}\nforces: {f: {joint: j4.1, force: \"-500*(d - 0.8)\"}}\n",
        "states: {y: {rate: \"-3*y + q(j4.1)\", start: 0}}\nforces: {f: {joint: j4.1, force: \"-5*y\"}}\n",
        "states: {d: {sample: 0.03, next: q(j4.1), start: 0}}\nforces: {f: {joint: j4.1, force: \"-500*(d - 0.8)\"}}\n",
        "states: {h: {hysteresis: q(j4.1), limits: [0.7, 0.75]}}\nforces: {f: {joint: j4.1, force: \"-20*h\"}}\n",
        soft};
    static run_rows pieces, whole;
    for (size_t k = 0; k < sizeof more / sizeof *more; k++) {
        put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2", more[k]);
        put(&s, "run: {t_end: 0.3}\n");
        loaded l = load_text(s.text);
        simulate(&l, false, ROWS, NULL, &pieces);
        simulate(&l, true, ROWS, NULL, &whole);
        CHECK(pieces.status == KEMPE_OK && pieces.count == whole.count);
        CHECK(pieces.report.steps == whole.report.steps);
        for (int row = 0; row < pieces.count; row++)
            CHECK(memcmp(pieces.row[row], whole.row[row], sizeof *pieces.row) == 0);
        unload(&l);
    }
}

/* The condition that ends a run ends it, and counts as requested. */
static void until_a_condition(void)
{
    static run_rows all;
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2", "");
    put(&s, "run: {t_end: 0.6, until: \"q(j5.1) > 0.8\"}\n");
    loaded l = load_text(s.text);
    simulate(&l, false, ROWS, NULL, &all);
    CHECK(all.report.ended && all.report.requested && all.report.t < 0.6);
    unload(&l);
}

/* On a dae a state may overlap by the errors of steps, at which no run could start: it has no pieces. */
static void on_a_dae(void)
{
    put_balls(&s, "[0, 0, 0]", "restitution: 1, friction: 0.2", "");
    loaded l = load_text(s.text);
    kmp_run_spec spec = {.formulation = "dae", .rtol = 1e-6, .atol = 1e-6, .t_end = 1};
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK && !kmp_near_may_pay(l.system, &spec));
    spec = (kmp_run_spec){.formulation = "projected", .rtol = 1e-6, .atol = 1e-6, .t_end = 1};
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK && kmp_near_may_pay(l.system, &spec));
    unload(&l);
}

/* Balls that turn in space about an axis at which the angles of the joint are singular. */
static void in_space(void)
{
    enum { N = 6 };
    static run_rows pieces, whole;
    s.length = 0;
    put(&s, "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
    for (int i = 0; i < N; i++)
        put(&s,
            "  b%d: {joint: {name: j%d, free: x, at: ground}, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: 0.004}, "
            "points: {C: [0, 0, 0]}}\n",
            i, i);
    put(&s, "contacts:\n");
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < i; k++)
            put(&s,
                "  c%d_%d: {sphere: b%d.C, radius: 0.1, on: {sphere: b%d.C, radius: 0.1}, restitution: 1, friction: "
                "0.2}\n",
                i, k, i, k);
        for (int w = 0; w < 3; w++)
            put(&s,
                "  w%d_%d: {sphere: b%d.C, radius: 0.1, on: {plane: ground.O, normal: %c}, restitution: 1, friction: "
                "0.2}\n",
                i, w, i, "xyz"[w]);
    }
    put(&s, "start: {q: {");
    for (int i = 0; i < N; i++)
        put(&s, "j%d.1: %g, j%d.2: %g, j%d.3: %g, j%d.5: 90 deg%s", i, 0.3 + 0.3 * i, i, 0.4 + 0.2 * (i % 2), i,
            0.3 + 0.3 * (i % 3), i, i < N - 1 ? ", " : "}, qd: {");
    for (int i = 0; i < N; i++)
        put(&s, "j%d.1: %.4f, j%d.2: %.4f, j%d.3: %.4f, j%d.4: %g%s", i, cos(3 * i), i, sin(2 * i), i, cos(5 * i + 1),
            i, 3.0 + i, i < N - 1 ? ", " : "}}\n");
    put(&s, "run: {t_end: 1}\n");
    loaded l = load_text(s.text);
    simulate(&l, false, ROWS, NULL, &pieces);
    simulate(&l, true, ROWS, NULL, &whole);
    CHECK(pieces.status == KEMPE_OK && whole.status == KEMPE_OK);
    CHECK(pieces.report.impacts == whole.report.impacts && pieces.report.impacts > 3);
    CHECK_NEAR(apart(&pieces, ROWS - 1, &whole, ROWS - 1, l.system->n), 0, 1e-5);
    unload(&l);
}

/* Friction on a contact that touches without a load has a level that is zero but for rounding, also where a piece
 * begins. */
static void loads_of_rounding(void)
{
    put_balls(&s, "[0, -9.81, 0]", "restitution: 0, friction: 0.2", "");
    loaded l = load_text(s.text);
    const kmp_events *events = &l.system->events;
    kmp_condition_past *past = kmp_calloc((size_t)events->count, sizeof *past);
    int levels = 0;
    kmp_event_tracker_begin_past(l.system, past);
    for (int k = 0; k < events->count; k++) {
        if (events->condition[k].validity != KMP_VALIDITY_LEVEL)
            continue;
        levels++;
        CHECK(!kmp_condition_invalid(&events->condition[k], -3e-17, past[k].largest));
        CHECK(kmp_condition_invalid(&events->condition[k], -1e-7, past[k].largest));
    }
    CHECK(levels > BALLS);
    kmp_free(past);
    unload(&l);
}

int main(void)
{
    TEST(with_friction);
    TEST(unforeseen);
    TEST(words_of_attempts);
    TEST(rows_and_log);
    TEST(one_that_fails);
    TEST(with_a_past);
    TEST(until_a_condition);
    TEST(on_a_dae);
    TEST(in_space);
    TEST(loads_of_rounding);
    return check_report();
}
