/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a model that share nothing: which there are, that each moves as it does alone, to the last bit, and that the
 * work grows as their number. */
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "model/data/body.h"
#include "model/data/islands.h"
#include "model/data/run_settings.h"
#include "scene_text.h"
#include "testing.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST = 12, ROWS = 41, COORDINATES = 3 * MOST };

/* -- scenes ------------------------------------------------------------------------------------------------ */

static double height(int i)
{
    return 0.3 + 0.02 * ((7 * i) % MOST);
}

/* The balls first .. last over a plane; they bounce with friction and roll in the end. */
static scene balls(int first, int last, const char *more)
{
    scene s = {.length = 0};
    put(&s, "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
    for (int i = first; i <= last; i++)
        put(&s,
            "  s%d: {joint: {name: j%d, planar: z, at: ground}, mass: 1, inertia: {zz: 0.004}, points: {C: [0, 0, "
            "0]}}\n",
            i, i);
    put(&s, "contacts:\n");
    for (int i = first; i <= last; i++)
        put(&s,
            "  c%d: {sphere: s%d.C, radius: 0.1, on: {plane: ground.O, normal: y}, restitution: 0.5, friction: 0.3}\n",
            i, i);
    put(&s, "%s", more);
    put(&s, "start:\n  q: {");
    for (int i = first; i <= last; i++)
        put(&s, "j%d.1: %g, j%d.2: %.17g%s", i, 0.3 * i, i, height(i), i < last ? ", " : "}\n  qd: {");
    for (int i = first; i <= last; i++)
        put(&s, "j%d.1: 0.5%s", i, i < last ? ", " : "}\n");
    put(&s, "run: {t_end: 1, rtol: 1e-6}\n");
    return s;
}

/* -- runs -------------------------------------------------------------------------------------------------- */

typedef struct run_rows {
    int n, m, count;
    double row[ROWS][3 * COORDINATES + 2 * COORDINATES], work;
    kmp_run_report report;
    kempe_status status;
} run_rows;

static int keep(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    run_rows *r = user;
    (void)t, (void)qd, (void)qdd, (void)lambda; /* they follow q */
    memcpy(r->row[r->count++], q, (size_t)(3 * r->n + r->m) * sizeof *q);
    r->work = work;
    return 0;
}

/* A run of the model; `whole`: as one mechanism. */
static void simulate(const loaded *l, bool whole, kmp_run_log *log, run_rows *found)
{
    double times[ROWS];
    const double end = kmp_model_run(l->model)->t_end;
    for (int k = 0; k < ROWS; k++)
        times[k] = end * k / (ROWS - 1);
    kmp_run_spec spec = {.formulation = "reduced",
                         .integrator = "dop853",
                         .rtol = 1e-6,
                         .atol = 1e-6,
                         .t_end = end,
                         .times = times,
                         .time_count = ROWS,
                         .log = log};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    *found = (run_rows){.n = l->system->n, .m = l->system->m};
    CHECK(3 * found->n + found->m <= 5 * COORDINATES);
    found->status = (whole ? kmp_run_whole : kmp_run)(l->system, &spec, NULL, keep, found, &found->report);
    if (found->status != KEMPE_OK)
        printf("  ends at t = %g: %s\n", found->report.t, found->report.reason ? found->report.reason : "");
    kmp_free(found->report.reason);
    found->report.reason = NULL;
}

static int parts_of(const char *text)
{
    loaded l = load_text(text);
    kmp_islands *islands = NULL;
    CHECK(l.model && kmp_islands_new(l.model, NULL, &islands) == KEMPE_OK);
    const int count = islands ? islands->count : -1;
    kmp_islands_free(islands);
    unload(&l);
    return count;
}

/* -- which parts ------------------------------------------------------------------------------------------- */

/* Two balls are one part where anything connects them. */
static void connections(void)
{
    static const struct {
        const char *more;
        int parts;
    } scenes[] = {
        {"", 4},
        {"forces: {s: {spring: [s0.C, s1.C], stiffness: 1}}\n", 3},
        {"forces: {s: {joint: j0.1, force: \"0.1*q(j2.1)\"}}\n", 3},
        {"forces: {s: {joint: j0.1, force: \"0.1*distance(s1.C, s2.C)\"}}\n", 2},
        {"forces: {s: {joint: j0.1, force: \"0.1*sin(t)\"}}\n", 4},
        {"loops: {k: {constraint: \"q(j3.3)\"}}\nforces: {s: {joint: j0.1, force: \"0.01*lambda(k.1)\"}}\n", 3},
        {"loops: {k: {rod: [s0.C, s3.C], length: 0.91}}\n", 3},
        {"loops: {k: {constraint: \"q(j0.3) - q(j1.3)\"}}\n", 3},
        {"  d: {gap: q(j1.1) - q(j0.1) - 0.1, restitution: 0}\n", 3},
        {"inputs: {u: {unit: N}}\nforces: {s: {joint: j0.1, force: \"0.1*u\"}}\n", 4},
        {"states: {y: {rate: \"-y\"}}\n", 0},
    };
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        const scene s = balls(0, 3, scenes[k].more);
        const int parts = parts_of(s.text);
        if (parts != scenes[k].parts)
            printf("  %s: %d parts\n", scenes[k].more, parts);
        CHECK(parts == scenes[k].parts);
    }
    const scene one = balls(2, 2, "");
    CHECK(parts_of(one.text) == 0);
}

/* Elements without contacts are one part; a body welded to the ground belongs to all. */
static void rest_and_fixed(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n"
        "  floor: {joint: {name: f, weld: yes, at: ground}, mass: 1, points: {P: [0, -0.5, 0]}}\n"
        "  p: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, com: [0.5, 0, 0], points: {T: [1, 0, 0]}}\n"
        "  r: {joint: {name: b, revolute: z, at: p.T}, mass: 1, com: [0.5, 0, 0]}\n"
        "  w: {joint: {name: c, prismatic: x, at: ground}, mass: 1}\n"
        "  u: {joint: {name: d, prismatic: y, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
        "  v: {joint: {name: e, prismatic: y, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
        "contacts:\n"
        "  k: {sphere: u.C, radius: 0.1, on: {plane: floor.P, normal: y}, restitution: 0.5}\n"
        "  l: {sphere: v.C, radius: 0.1, on: {plane: floor.P, normal: y}, restitution: 0.5}\n"
        "start: {qd: {c: 1}}\nrun: {t_end: 0.5}\n";
    loaded l = load_text(text);
    kmp_islands *islands = NULL;
    CHECK(kmp_islands_new(l.model, NULL, &islands) == KEMPE_OK && islands->count == 3);
    CHECK(kmp_model_motion_count(islands->island[0].model) == 3 && kmp_model_body_count(islands->island[0].model) == 5);
    for (int i = 1; i < 3; i++)
        CHECK(kmp_model_motion_count(islands->island[i].model) == 1 &&
              kmp_model_body_count(islands->island[i].model) == 3);
    kmp_islands_free(islands);
    static run_rows parts, whole;
    simulate(&l, false, NULL, &parts);
    simulate(&l, true, NULL, &whole);
    CHECK(parts.status == KEMPE_OK && whole.status == KEMPE_OK && parts.count == ROWS && whole.count == ROWS);
    for (int k = 0; k < ROWS; k++)
        for (int i = 0; i < parts.n; i++)
            CHECK_NEAR(parts.row[k][i], whole.row[k][i], 2e-5);
    unload(&l);
}

/* -- motions ----------------------------------------------------------------------------------------------- */

/* Each ball among others moves to the last bit as it does alone, with its multipliers; the work is the sum. */
static void as_alone(void)
{
    static run_rows all, one;
    const scene s = balls(0, MOST - 1, "");
    loaded l = load_text(s.text);
    simulate(&l, false, NULL, &all);
    CHECK(all.status == KEMPE_OK && all.count == ROWS);
    long steps = 0, rhs = 0, events = 0, impacts = 0;
    double work = 0;
    for (int i = 0; i < MOST; i++) {
        const scene alone = balls(i, i, "");
        loaded a = load_text(alone.text);
        simulate(&a, false, NULL, &one);
        CHECK(one.status == KEMPE_OK && one.count == ROWS && one.n == 3 && one.m == 2);
        bool same = true;
        for (int k = 0; k < ROWS; k++) {
            for (int j = 0; j < 9; j++)
                same = same && one.row[k][j] == all.row[k][j / 3 * all.n + 3 * i + j % 3];
            for (int r = 0; r < 2; r++) /* contacts are listed before their friction */
                same = same && one.row[k][9 + r] == all.row[k][3 * all.n + 2 * i + r];
        }
        CHECK(same);
        steps += one.report.steps;
        rhs += one.report.rhs;
        events += one.report.events;
        impacts += one.report.impacts;
        work += one.work;
        unload(&a);
    }
    CHECK(all.report.steps == steps && all.report.rhs == rhs);
    CHECK(all.report.events == events && all.report.impacts == impacts && impacts > 15 * MOST);
    CHECK_NEAR(all.work, work, 1e-12);
    unload(&l);
}

/* Balls with inputs, whose samples end the steps of each: as alone, to the last bit. */
static void with_inputs(void)
{
    static const char inputs[] = "inputs: {u: {t: [0, 0.2, 0.5, 1], value: [0, 1, -1, 2], method: linear}}\n";
    static run_rows all, one;
    char more[512];
    (void)snprintf(more, sizeof more, "%sforces: {%s, %s}\n", inputs, "g0: {joint: j0.1, force: \"0.3*u\"}",
                   "g1: {joint: j1.1, force: \"0.5*u\"}");
    const scene s = balls(0, 2, more);
    loaded l = load_text(s.text);
    CHECK(parts_of(s.text) == 3);
    simulate(&l, false, NULL, &all);
    CHECK(all.status == KEMPE_OK && all.count == ROWS);
    for (int i = 0; i < 3; i++) {
        (void)snprintf(more, sizeof more, i < 2 ? "%sforces: {g: {joint: j%d.1, force: \"%g*u\"}}\n" : "%s", inputs, i,
                       i == 0 ? 0.3 : 0.5);
        const scene alone = balls(i, i, more);
        loaded a = load_text(alone.text);
        simulate(&a, false, NULL, &one);
        CHECK(one.status == KEMPE_OK && one.count == ROWS);
        bool same = true;
        for (int k = 0; k < ROWS; k++)
            for (int j = 0; j < 9; j++)
                same = same && one.row[k][j] == all.row[k][j / 3 * all.n + 3 * i + j % 3];
        CHECK(same);
        unload(&a);
    }
    unload(&l);
}

/* The same scene in steps of its own as one mechanism: events and motions agree to the tolerance. */
static void as_one(void)
{
    static run_rows parts, whole;
    const scene s = balls(0, 3, "");
    loaded l = load_text(s.text);
    simulate(&l, false, NULL, &parts);
    simulate(&l, true, NULL, &whole);
    CHECK(parts.status == KEMPE_OK && whole.status == KEMPE_OK);
    CHECK(parts.report.impacts == whole.report.impacts && parts.report.changes == whole.report.changes);
    CHECK(parts.report.steps < whole.report.steps * 2);
    for (int k = 0; k < ROWS; k++)
        for (int i = 0; i < parts.n; i++)
            CHECK_NEAR(parts.row[k][i], whole.row[k][i], 1e-8);
    unload(&l);
}

/* Entries of the log come in the order of their times, whichever part they are of. */
static void log_in_order(void)
{
    static run_rows all;
    const scene s = balls(0, MOST - 1, "");
    loaded l = load_text(s.text);
    kmp_run_log log = {.context = l.context};
    simulate(&l, false, &log, &all);
    CHECK(log.count >= all.report.impacts && log.kept > 15 * MOST);
    for (int k = 1; k < log.kept; k++)
        CHECK(log.entries[k].t >= log.entries[k - 1].t);
    kmp_run_log_free(&log);
    unload(&l);
}

/* Balls that turn in space: angles that are centred at the start are those of each part. */
static void in_space(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {name: A, free: x, at: ground}, mass: 1, inertia: {xx: 0.004, yy: 0.005, zz: 0.006}, points: {C: "
        "[0, 0, 0]}}\n"
        "  b: {joint: {name: B, free: x, at: ground}, mass: 1, inertia: {xx: 0.004, yy: 0.005, zz: 0.006}, points: {C: "
        "[0, 0, 0]}}\n"
        "contacts:\n"
        "  k: {sphere: a.C, radius: 0.1, on: {plane: ground.O, normal: z}, restitution: 0.5, friction: 0.3}\n"
        "  l: {sphere: b.C, radius: 0.1, on: {plane: ground.O, normal: z}, restitution: 0.5, friction: 0.3}\n"
        "start: {q: {A.3: 0.3, B.1: 1, B.3: 0.4, B.5: 90 deg}, qd: {A.1: 0.5, B.2: 0.3, B.4: 5, B.6: 1}}\n"
        "run: {t_end: 0.6}\n";
    static run_rows parts, whole;
    loaded l = load_text(text);
    CHECK(parts_of(text) == 2);
    simulate(&l, false, NULL, &parts);
    simulate(&l, true, NULL, &whole);
    CHECK(parts.status == KEMPE_OK && whole.status == KEMPE_OK && parts.count == ROWS);
    CHECK(parts.report.impacts == whole.report.impacts && parts.report.centrings > 0);
    for (int k = 0; k < ROWS; k++)
        for (int i = 0; i < parts.n; i++)
            CHECK_NEAR(parts.row[k][i], whole.row[k][i], 1e-4);
    unload(&l);
}

/* A part that cannot go on ends the run: its rows and its log are those that all parts have until then. */
static void one_that_fails(void)
{
    static run_rows all;
    kmp_run_log log = {0};
    scene s = balls(0, 2, "forces: {s: {joint: j1.3, torque: \"1e-3*sqrt(0.35 - t)\"}}\n");
    loaded l = load_text(s.text);
    CHECK(parts_of(s.text) == 3);
    log.context = l.context;
    simulate(&l, false, &log, &all);
    CHECK(all.status == KEMPE_E_FAILED || all.status == KEMPE_STOPPED);
    CHECK(all.report.t > 0.3 && all.report.t < 0.36);
    CHECK(all.count == 1 + (int)(all.report.t * (ROWS - 1)));
    CHECK(log.kept > 0);
    for (int k = 0; k < log.kept; k++)
        CHECK(log.entries[k].t <= all.report.t);
    kmp_run_log_free(&log);
    unload(&l);
}

int main(void)
{
    TEST(connections);
    TEST(rest_and_fixed);
    TEST(as_alone);
    TEST(with_inputs);
    TEST(as_one);
    TEST(log_in_order);
    TEST(in_space);
    TEST(one_that_fails);
    return check_report();
}
