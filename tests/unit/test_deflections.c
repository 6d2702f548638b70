/* SPDX-License-Identifier: BSD-3-Clause */
/* Sweeps with deformations in balance: a cantilever that is turned, a slow run, rates beside differences of rows,
 * static starts at the same positions, and what is refused. */
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/kinematics.h>
#include <kempe/table.h>
#include <math.h>
#include <stdlib.h>

static kempe_status sweep_as(const loaded *l, const kempe_kinematics_options *how, kempe_kinematics **k)
{
    *k = NULL;
    CHECK(l->system != NULL);
    return l->system ? kempe_kinematics_new(l->system, how, k) : KEMPE_E_FAILED;
}

/* The rows of a sweep that must be complete. */
static kempe_table *rows_of(const loaded *l, const char *range, const char *elastic)
{
    const kempe_kinematics_options how = {.sweep = range, .elastic = elastic};
    kempe_kinematics *k = NULL;
    kempe_table *table = NULL;
    const kempe_status status = sweep_as(l, &how, &k);
    if (status != KEMPE_OK)
        printf("%s: %s\n", range, kempe_context_message(l->context));
    CHECK(status == KEMPE_OK && kempe_kinematics_table(k, "rows", &table) == KEMPE_OK);
    kempe_kinematics_free(k);
    return table;
}

static double number(const kempe_table *t, int row, const char *column)
{
    const int at = t ? kempe_table_find(t, column) : -1;
    CHECK(at >= 0);
    return at >= 0 ? kempe_table_number(t, row, at) : NAN;
}

/* -q L^4/8 E I cos(A) of a stiff beam, and its derivatives. */
static void cantilever_is_turned(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, -10, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
                  "    flexible: {beam: {length: 2, rhoA: 3, EIz: 5e6}, shapes: {y: 3}, raw: yes}\n");
    const double tip = -30 * 16 / (8 * 5e6);
    kempe_table *t = rows_of(&l, "A=0 deg:180 deg:13", "static");
    for (int row = 0; row < 13 && t; row++) {
        static const char *const columns[] = {"q.rod.y", "qd.rod.y", "qdd.rod.y"};
        const double a = number(t, row, "q.A"), exact[] = {tip * cos(a), -tip * sin(a), -tip * cos(a)};
        for (int c = 0; c < 3; c++) {
            double sum = 0; /* each power of x is one at the end */
            for (int k = 1; k <= 3; k++) {
                char name[32];
                (void)snprintf(name, sizeof name, "%s%d", columns[c], k);
                sum += number(t, row, name);
            }
            CHECK_NEAR((sum - exact[c]) / tip, 0, 1e-4); /* the weight along the axis takes 3e-5 of the stiffness */
        }
        CHECK(row != 0 || fabs(number(t, row, "qd.rod.y1")) > 0);
    }
    kempe_table_free(t);
    t = rows_of(&l, "A=0 deg:180 deg:13", NULL);
    CHECK_NEAR(number(t, 6, "q.rod.y1"), 0, 0);
    kempe_table_free(t);
    unload(&l);
}

#define CRANK(drives)                                                                                                  \
    "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                      \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {E: [0.2, 0, 0]}}\n"    \
    "  rod:\n    joint: {name: B, revolute: z, at: crank.E}\n"                                                         \
    "    flexible: {beam: {length: 0.5, young: 7e9, density: 2700, section: {rectangle: [0.006, 0.02]}}, "             \
    "shapes: {y: 2}, frame: chord}\n    points: {tip: {station: 0.5}}\n"                                               \
    "  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"                        \
    "loops: {C: {ball: [rod.tip, slider.P]}}\nforces: {s: {joint: X, force: 200*(0.5 - q(X))}}\n" drives               \
    "start: {elastic: static, q: {A: 1, B: -1.3, X: 0.6}, hold: [A]}\n"

/* The rod of a slow slider-crank under its weight and a spring that pushes along it. Inertia has parts of (w/first
 * frequency)^2. The drive is released where its coordinate is swept. */
static void slow_run(void)
{
    loaded l = load_text(CRANK("drives: {turn: {joint: A, angle: 1 + 0.2*(1 - cos(pi*t/40))}}\n"));
    const kempe_run_options run = {.t_end = 20, .output_step = 20, .rtol = 1e-10, .no_convergence_check = 1};
    kempe_trajectory *trajectory = NULL;
    CHECK(l.system && kempe_simulate(l.system, &run, &trajectory) == KEMPE_OK);
    const char *const ranges[] = {"t=0:40:3", "A=1:1.4:3"};
    for (int k = 0; k < 2 && trajectory; k++) {
        static const char *const columns[] = {"rod.y1", "rod.y2", "X"};
        static const double small[] = {1e-8, 1e-10, 1e-8};
        kempe_table *t = rows_of(&l, ranges[k], "static");
        for (int c = 0; c < 3; c++) {
            char q[16], qd[16];
            (void)snprintf(q, sizeof q, "q.%s", columns[c]);
            (void)snprintf(qd, sizeof qd, "qd.%s", columns[c]);
            const int at = coordinate_named(&l, columns[c]), last = kempe_trajectory_row_count(trajectory) - 1;
            CHECK_NEAR(number(t, 1, q), kempe_trajectory_q(trajectory, last)[at], small[c]);
            CHECK_NEAR(number(t, 1, qd) * (k == 0 ? 1 : 0.2 * acos(-1) / 40), kempe_trajectory_qd(trajectory, last)[at],
                       small[c]);
        }
        CHECK(fabs(number(t, 1, "q.rod.y1")) > 1e-5);
        kempe_table_free(t);
    }
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* Rates and accelerations beside differences of the rows next to them, and rows beside static starts there. */
static void check_rows(const loaded *l, const char *range, int count, const char *const names[], double within)
{
    kempe_table *t = rows_of(l, range, "static");
    const int n = t ? (int)kempe_table_row_count(t) : 0;
    for (int c = 0; c < count && n > 2; c++) {
        char q[64], qd[64], qdd[64];
        double rate = 0, acceleration = 0, off = 0, off_again = 0;
        (void)snprintf(q, sizeof q, "q.%s", names[c]);
        (void)snprintf(qd, sizeof qd, "qd.%s", names[c]);
        (void)snprintf(qdd, sizeof qdd, "qdd.%s", names[c]);
        for (int row = 1; row < n - 1; row++) {
            const double h = number(t, row, "t") - number(t, row - 1, "t"), before = number(t, row - 1, q),
                         here = number(t, row, q), after = number(t, row + 1, q);
            rate = fmax(rate, fabs(number(t, row, qd)));
            acceleration = fmax(acceleration, fabs(number(t, row, qdd)));
            off = fmax(off, fabs((after - before) / (2 * h) - number(t, row, qd)));
            off_again = fmax(off_again, fabs((after - 2 * here + before) / (h * h) - number(t, row, qdd)));
        }
        CHECK(rate > 0 && off <= within * rate && off_again <= within * acceleration);
        if (!(off <= within * rate && off_again <= within * acceleration))
            printf("%s: %g of %g, %g of %g\n", names[c], off, rate, off_again, acceleration);
    }
    kempe_table_free(t);
}

/* A beam that bends and twists on a hub; a body from a file in a loop, driven by the time and by its motor; a rod in a
 * loop. */
static void rates(void)
{
    static const char *const beam[] = {"rod.y1", "rod.z1", "rod.phi1"};
    loaded l = load_text(
        "kempe: 1\ngravity: [0, -9.81, 3]\nbodies:\n"
        "  hub: {joint: {name: A, revolute: y, at: ground}, mass: 1, inertia: {yy: 0.1}, points: {E: [0.1, 0, 0]}}\n"
        "  rod:\n    joint: {name: B, revolute: z, at: hub.E}\n"
        "    flexible: {beam: {length: 0.6, young: 7e9, density: 2700, section: {rectangle: [0.01, 0.03]}, "
        "poisson: 0.33}, shapes: {y: 1, z: 1, torsion: 1}}\n    points: {tip: {station: 0.6}}\n"
        "  ball: {joint: {weld: yes, at: rod.tip}, mass: 0.2, com: [0, 0, 0.05], inertia: {xx: 1e-4, yy: "
        "1e-4, zz: 1e-4}}\n");
    check_rows(&l, "A=0.4:0.6:81,B=0.1:0.3", 3, beam, 1e-5);
    unload(&l);
    static const char *const blade[] = {"blade.mode1", "blade.mode2", "blade.mode3", "hinge"};
    l = load("examples/flexible_blade/flexible_blade.yaml");
    check_rows(&l, "t=0.01:0.02:201", 4, blade, 1e-5);
    check_rows(&l, "motor=0.4:0.6:101", 4, blade, 1e-5);
    unload(&l);
    l = load_text(CRANK(""));
    static const char *const rod[] = {"rod.y1", "B", "X"};
    check_rows(&l, "A=1:1.2:101", 3, rod, 1e-5);
    unload(&l);
}

/* Pieces of segments, at the angle of the start without rates. */
static void as_the_start(void)
{
    char text[1024];
    for (int k = 0; k < 2; k++) {
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
            "    flexible: {beam: {length: 0.6, young: 7e9, density: 2700, section: {rectangle: [0.004, 0.03]}}, "
            "shapes: {y: 1}, segments: 4}\nstart: {elastic: static, q: {A: %g}}\n",
            k == 0 ? 0.2 : 0.7);
        loaded l = load_text(text);
        kempe_assembly *a = NULL;
        kempe_table *t = rows_of(&l, "A=0.2:0.7:3", "static");
        CHECK(l.system && kempe_assembly_new(l.system, &a) == KEMPE_OK);
        CHECK_NEAR(number(t, 2 * k, "q.rod_z2"), a ? kempe_assembly_q(a)[coordinate_named(&l, "rod_z2")] : NAN, 1e-12);
        CHECK(fabs(number(t, 0, "q.rod_z2")) > 1e-4);
        kempe_assembly_free(a);
        kempe_table_free(t);
        unload(&l);
    }
}

#define ROD                                                                                                            \
    "kempe: 1\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"                                       \
    "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 1}, raw: yes}\n"                                  \
    "    points: {tip: {station: 1}}\n"

static void what_is_refused(void)
{
    static const struct {
        const char *text, *range, *hold, *elastic, *words;
    } row[] = {{ROD, "A=0:1", NULL, "loose", "elastic: 'held' or 'static' is expected, not 'loose'"},
               {ROD, "A=0:1", "rod.y1", "static", "elastic: 'static' needs a flexible body"},
               {ROD "drives: {d: {joint: A, angle: t}}\nforces: {f: {joint: rod.y1, force: sin(t)}}\n", "t=0:1", NULL,
                "static", "depend on time"},
               {ROD "forces: {f: {joint: A, friction: {torque: 3}}}\n", "A=0:1", NULL, "static",
                "friction 'f' changes between stick and slip"}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        loaded l = load_text(row[k].text);
        const kempe_kinematics_options how = {.sweep = row[k].range, .hold = row[k].hold, .elastic = row[k].elastic};
        kempe_kinematics *sweep;
        CHECK(sweep_as(&l, &how, &sweep) == KEMPE_E_ARGUMENT);
        if (!strstr(kempe_context_message(l.context), row[k].words))
            CHECK_TEXT(kempe_context_message(l.context), row[k].words);
        kempe_kinematics_free(sweep);
        unload(&l);
    }
}

/* A pull 20 q(A) exp(y/m) N has a balance against 40 N/m up to 40/e N, at A = 0.736; and a dead centre ends the rows
 * before it. */
static void what_ends(void)
{
    loaded l = load_text(ROD "forces: {pull: {joint: rod.y1, force: 20*q(A)*exp(q(rod.y1)/1 m)}}\n");
    kempe_kinematics *k;
    CHECK(sweep_as(&l, &(kempe_kinematics_options){.sweep = "A=0:1:101", .elastic = "static"}, &k) == KEMPE_E_FAILED);
    CHECK(k && strstr(kempe_kinematics_reason(k), "at A = 0.74 rad the flexible bodies find no balance"));
    kempe_table *t = NULL;
    CHECK(k && kempe_kinematics_table(k, "rows", &t) == KEMPE_OK && kempe_table_row_count(t) == 74);
    kempe_table_free(t);
    kempe_kinematics_free(k);
    unload(&l);
    l = load_text(ROD "forces: {push: {joint: rod.y1, force: 0.1 + 50*q(rod.y1)}}\n");
    CHECK(sweep_as(&l, &(kempe_kinematics_options){.sweep = "A=0:1:11", .elastic = "static"}, &k) == KEMPE_UNTRUSTED);
    CHECK(k && kempe_kinematics_outcome(k) == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
    kempe_kinematics_free(k);
    unload(&l);
    l = load_text(CRANK(""));
    char *said = NULL;
    CHECK(sweep_as(&l, &(kempe_kinematics_options){.sweep = "X=0.6:0.8:21", .elastic = "static"}, &k) == KEMPE_STOPPED);
    CHECK(k && kempe_kinematics_table(k, "rows", &t) == KEMPE_OK && kempe_table_row_count(t) == 10);
    CHECK(k && kempe_kinematics_print(k, KEMPE_TEXT, &said) == KEMPE_OK);
    CHECK(said && strstr(said, "it is computed with the deformations of the start"));
    free(said);
    kempe_table_free(t);
    kempe_kinematics_free(k);
    unload(&l);
}

int main(void)
{
    TEST(cantilever_is_turned);
    TEST(slow_run);
    TEST(rates);
    TEST(as_the_start);
    TEST(what_is_refused);
    TEST(what_ends);
    return check_report();
}
