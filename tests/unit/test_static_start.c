/* SPDX-License-Identifier: BSD-3-Clause */
/* Deformations of the start in balance with their loads: closed forms of cantilevers, columns near and beyond
 * buckling, links of a robot that its drives accelerate, pieces of segments, and what is refused. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "loaded.h"
#include "run_ends.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/ensemble.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <kempe/table.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static char lines[4000];

static void keep_line(void *user, kempe_level level, const char *line)
{
    (void)user;
    (void)level;
    (void)snprintf(lines + strlen(lines), sizeof lines - strlen(lines), "%s\n", line);
}

/* A number of the first and of the last row. */
static void take_as(kempe_status status, const char *text, double t_end, const char *outputs, int count, double first[],
                    double last[])
{
    loaded l = load_text(text);
    const kempe_run_options run = {.t_end = t_end, .output_step = t_end, .rtol = 1e-10, .no_convergence_check = 1};
    lines[0] = '\0';
    kempe_context_set_log(l.context, keep_line, NULL);
    run_ends(&l, &run, status, outputs, count, first, last);
    unload(&l);
}

static void take(const char *text, double t_end, const char *outputs, int count, double first[], double last[])
{
    take_as(KEMPE_OK, text, t_end, outputs, count, first, last);
}

#define ROD(beam, shapes, more)                                                                                        \
    "kempe: 1\ngravity: [0, -10, 0]\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n    flexible:\n"             \
    "      beam: {" beam "}\n      shapes: {" shapes "}\n" more                                                        \
    "    points: {tip: {station: 2}, mid: {station: 1}}\nstart: {elastic: static}\n"

/* v = F L^3/3 E I - q L^4/8 E I, and no motion from there. */
static void cantilever_hangs(void)
{
    static const char text[] =
        ROD("length: 2, rhoA: 3, EIz: 5000", "y: 3", "") "forces: {end: {at: rod.tip, force: [0, 7, 0]}}\n";
    const double exact = 7 * 8 / (3 * 5000.0) - 30 * 16 / (8 * 5000.0);
    double first[9], last[9];
    take(text, 0.5, "position(rod.tip),section(rod.mid)", 9, first, last);
    CHECK_NEAR(first[1], exact, 1e-15);
    CHECK_NEAR(last[1], exact, 1e-12);
    CHECK_NEAR(first[8], 7 - 30 * 0.5, 1e-3); /* of second order: the tip is nearer by 2e-5 m */
    take(text, 1e-6, "qdd(rod.y1),qdd(rod.y2),qdd(rod.y3)", 3, first, last);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(first[k], 0, 1e-12);
}

/* A column with the load P at its end, F L^3/3 E I 3 (tan u - u)/u^3 with u^2 = P L^2/E I: digits of another program
 * for four powers of x. Beyond pi^2 E I/4 L^2 no balance is stable. */
static void columns_bend(void)
{
    static const struct {
        double push, tip; /* of the force 0.1 N */
    } row[] = {{5, 4.169204832594e-3}, {15, 8.430142701060e-3}};
    double first[3], last[3];
    char text[1024];
    for (int k = 0; k < 3; k++) {
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, 0]\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                       "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 4}}\n"
                       "    points: {tip: {station: 1}}\nforces: {end: {at: rod.tip, force: [%.17g, %.17g, 0]}}\n"
                       "start: {elastic: static, q: {rod.y1: %g}}\n",
                       k < 2 ? -row[k].push : -30.0, k < 2 ? 1e-5 : 0.0, k < 2 ? 0.0 : 1e-6);
        take_as(k < 2 ? KEMPE_OK : KEMPE_UNTRUSTED, text, 1e-6, "position(rod.tip)", 3, first, last);
        if (k < 2)
            CHECK_NEAR(first[1] * 1e4 / row[k].tip, 1, 1e-8);
        CHECK((k < 2) == !strstr(lines, "but not in a stable one: a flexible body buckles under less than these"));
    }
}

/* Rods of a five-bar robot that its motors accelerate from rest, between pins under the load -rho A a of the
 * accelerations of both ends: v = L^4/E I (q0 (x - 2 x^3 + x^4)/24 + q1 (7 x - 10 x^3 + 3 x^5)/360). */
static void robot_is_loaded_by_its_drives(void)
{
    static const char text[] =
        "kempe: 1\nground: {points: {O_l: [0, 0, 0], O_r: [0.5, 0, 0]}}\nbodies:\n"
        "  a: {joint: {name: A, revolute: z, at: ground.O_l}, mass: 0.1, inertia: {zz: 0.0125}, points: {E: [0.25, 0, "
        "0]}}\n"
        "  l:\n    joint: {name: B, revolute: z, at: a.E}\n"
        "    flexible: {beam: {length: 0.45, rhoA: 0.32, EIz: 6}, shapes: {y: 4}, frame: chord}\n"
        "    points: {O: {station: 0}, end: {station: 450 mm}, mid: {station: 225 mm}}\n"
        "  b: {joint: {name: C, revolute: z, at: ground.O_r}, mass: 0.1, inertia: {zz: 0.0125}, points: {E: [0.25, 0, "
        "0]}}\n"
        "  r:\n    joint: {name: D, revolute: z, at: b.E}\n"
        "    flexible: {beam: {length: 0.45, rhoA: 0.32, EIz: 6}, shapes: {y: 4}, frame: chord}\n"
        "    points: {O: {station: 0}, end: {station: 450 mm}, mid: {station: 225 mm}}\n"
        "loops: {P: {ball: [l.end, r.end]}}\n"
        "drives: {left: {joint: A, angle: '2.2 - 0.05*sin(8*t)^2'}, right: {joint: C, angle: '0.9 + "
        "0.04*sin(8*t)^2'}}\n"
        "start: {elastic: static, q: {B: -1.7381865298439, D: 1.7640981195929}}\n";
    double first[20], last[20];
    take(text, 1e-6,
         "position(l.O),position(l.end),acceleration(l.O),acceleration(l.end),deflection(l.mid),qdd(l.y1),qdd(l.y4)",
         17, first, last);
    const double dx = first[3] - first[0], dy = first[4] - first[1], length = hypot(dx, dy);
    double load[2];
    for (int k = 0; k < 2; k++)
        load[k] = -0.32 * (-dy * first[6 + 3 * k] + dx * first[7 + 3 * k]) / length;
    const double mid = load[0] * 5 / 384 + (load[1] - load[0]) * (7.0 / 2 - 10.0 / 8 + 3.0 / 32) / 360;
    CHECK_NEAR(length, 0.45, 1e-6);
    CHECK(fabs(load[0]) > 1e-2 && fabs(first[13]) > 1e-6);
    CHECK_NEAR(first[13] / (pow(0.45, 4) / 6 * mid), 1, 2e-3); /* the pull along the rod stiffens it */
    CHECK_NEAR(first[15], 0, 1e-9);
    CHECK_NEAR(first[16], 0, 1e-9);
}

/* N - 1 joints in the middle of equal parts, with (N - 1) E I/L, bend by the moments of a force at the end. */
static void pieces_bend(void)
{
    static const char text[] = "kempe: 1\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                               "    flexible: {beam: {length: 2, rhoA: 3, EIz: 5000}, shapes: {y: 1}, segments: 8}\n"
                               "    points: {tip: {station: 2}}\nforces: {end: {at: rod_7.tip, force: [0, 1e-3, 0]}}\n"
                               "start: {elastic: static}\n";
    double first[3], last[3], exact = 0;
    for (int k = 1; k < 8; k++)
        exact += 1e-3 * pow(2 * (7.5 - k) / 7, 2) / (7 * 5000 / 2.0);
    take(text, 1e-3, "position(rod_7.tip)", 3, first, last);
    CHECK_NEAR(first[1] / exact, 1, 1e-9);
    CHECK_NEAR(last[1] / exact, 1, 1e-6);
    CHECK_NEAR(exact / (1e-3 * 8 / (3 * 5000)), 1, 1.01 / (4 * 7 * 7)); /* 1 - 1/(4 n^2) of n parts */
}

/* A joint that holds stays where it is, whatever else has a start value, and so does its rate. */
static void held_joints_stay(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                  "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {E: "
                  "[0.2, 0, 0]}}\n  rod:\n    joint: {name: B, revolute: z, at: crank.E}\n"
                  "    flexible: {beam: {length: 0.5, young: 7e8, density: 2700, section: {rectangle: [0.01, "
                  "0.02]}}, shapes: {y: 2}, frame: chord}\n    points: {tip: {station: 0.5}}\n"
                  "  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                  "loops: {C: {ball: [rod.tip, slider.P]}}\n"
                  "start: {elastic: static, q: {A: 1, B: -1.3, X: 0.6}, hold: [A], qd: {A: 3}}\n");
    kempe_assembly *a = NULL;
    CHECK(l.system && kempe_assembly_new(l.system, &a) == KEMPE_OK);
    CHECK_NEAR(a ? kempe_assembly_q(a)[coordinate_named(&l, "A")] : NAN, 1, 0);
    CHECK_NEAR(a ? kempe_assembly_qd(a)[coordinate_named(&l, "A")] : NAN, 3, 0);
    CHECK(a && fabs(kempe_assembly_q(a)[coordinate_named(&l, "rod.y1")]) > 1e-4);
    kempe_assembly_free(a);
    unload(&l);
}

/* Each instance of an ensemble has its own balance. */
static void instances_hang(void)
{
    static const char *const names[] = {"B"};
    static const double values[] = {2000, 4000, 8000};
    loaded l = load_text("kempe: 1\ngravity: [0, -10, 0]\nparameters: {B: 5000}\nbodies:\n  rod:\n"
                         "    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: 2, rhoA: 3, EIz: B}, shapes: {y: 3}, raw: yes}\n"
                         "    points: {tip: {station: 2}}\nstart: {elastic: static}\n"
                         "run: {t_end: 0.1}\n");
    const kempe_run_options run = {.t_end = 0.1, .rtol = 1e-10};
    kempe_values *set = NULL;
    kempe_ensemble *e = NULL;
    kempe_ensemble_result *batch = NULL;
    CHECK(l.model && kempe_values_new(l.model, 1, names, 3, values, &set) == KEMPE_OK &&
          kempe_ensemble_new(l.model, set, &e) == KEMPE_OK && kempe_ensemble_run(e, &run, 0, &batch) == KEMPE_OK);
    for (int k = 0; k < 3 && batch; k++) {
        CHECK(kempe_ensemble_result_outcome(batch, k) == KEMPE_OUTCOME_COMPLETE);
        const double *q = kempe_ensemble_result_q(batch, k);
        double tip = 0; /* each power of x is one at the end */
        for (int i = 0; i < 3; i++)
            tip += q ? q[i] : NAN;
        CHECK_NEAR(tip * values[k] / (-30 * 16 / 8.0), 1, 1e-9);
    }
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload(&l);
}

/* The tip of the first one hangs by 0.3 of its length, that of the last one by 0.2 of a length that is not the model's.
 */
static void instances_deflect_far(void)
{
    static const char *const names[] = {"B", "L"};
    static const double values[] = {100, 2, 5000, 2, 0.15, 0.2};
    static const kempe_outcome outcomes[] = {KEMPE_OUTCOME_NOT_TRUSTWORTHY, KEMPE_OUTCOME_COMPLETE,
                                             KEMPE_OUTCOME_NOT_TRUSTWORTHY};
    static const char *const verdicts[] = {"deflected too far", "converged", "deflected too far"};
    loaded l = load_text("kempe: 1\ngravity: [0, -10, 0]\nparameters: {B: 5000, L: 2}\nbodies:\n  rod:\n"
                         "    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: L, rhoA: 3, EIz: B}, shapes: {y: 3}, raw: yes}\n"
                         "    points: {tip: {station: L}}\nstart: {elastic: static}\n");
    const kempe_run_options run = {.t_end = 0.1, .rtol = 1e-10};
    kempe_values *set = NULL;
    kempe_ensemble *e = NULL;
    kempe_ensemble_result *batch = NULL;
    kempe_table *table = NULL;
    lines[0] = '\0';
    kempe_context_set_log(l.context, keep_line, NULL);
    CHECK(l.model && kempe_values_new(l.model, 2, names, 3, values, &set) == KEMPE_OK &&
          kempe_ensemble_new(l.model, set, &e) == KEMPE_OK &&
          kempe_ensemble_run(e, &run, 0, &batch) == KEMPE_UNTRUSTED);
    CHECK(batch && kempe_ensemble_result_table(batch, "instances", &table) == KEMPE_OK);
    for (int k = 0; k < 3 && table; k++) {
        CHECK(kempe_ensemble_result_outcome(batch, k) == outcomes[k]);
        CHECK_TEXT(kempe_table_word(table, k, kempe_table_find(table, "verdict")), verdicts[k]);
    }
    CHECK(strstr(lines, "do not trust 2 of 3 instances: a flexible body of instance 1 deflects by more than 0.1"));
    kempe_table_free(table);
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload(&l);
}

/* A push bends the beam within the run, the first one by 0.16 of its length; at the end the beam is nearly straight. */
static void instances_deflect_on_the_way(void)
{
    static const char *const names[] = {"B"};
    static const double values[] = {300, 600};
    loaded l = load_text("kempe: 1\nparameters: {B: 600}\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: 2, rhoA: 3, EIz: B}, shapes: {y: 1}, stiffening: none, "
                         "damping: {ratio: 0.3}}\n    points: {tip: {station: 2}}\n"
                         "forces: {f: {at: rod.tip, force: [0, '40*sin(pi*t)^2', 0]}}\n");
    const kempe_run_options run = {.t_end = 1};
    kempe_values *set = NULL;
    kempe_ensemble *e = NULL;
    CHECK(l.model && kempe_values_new(l.model, 1, names, 2, values, &set) == KEMPE_OK &&
          kempe_ensemble_new(l.model, set, &e) == KEMPE_OK);
    for (int lanes = 0; e && lanes < 2; lanes++) {
        kempe_ensemble_result *batch = NULL;
        CHECK(kempe_ensemble_run(e, &run, lanes, &batch) == KEMPE_UNTRUSTED);
        CHECK(batch && kempe_ensemble_result_outcome(batch, 0) == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
        CHECK(batch && kempe_ensemble_result_outcome(batch, 1) == KEMPE_OUTCOME_COMPLETE);
        const double *q = batch ? kempe_ensemble_result_q(batch, 0) : NULL;
        CHECK(q && fabs(q[0]) < 0.02 * 2);
        kempe_ensemble_result_free(batch);
    }
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload(&l);
}

/* A pull P exp(y/0.05 m) against the stiffness 40 N/m has a stable balance up to y = 0.05 m, that at y = 0.1 m with P =
 * 4 exp(-2) N is none, and there is no balance beyond 2/e N. */
static void instances_are_pulled(void)
{
    static const char *const names[] = {"P", "q.rod.y1"};
    static const double values[] = {0.5, 0, 0.541341132946451, 0.1, 1, 0};
    static const kempe_outcome outcomes[] = {KEMPE_OUTCOME_COMPLETE, KEMPE_OUTCOME_NOT_TRUSTWORTHY,
                                             KEMPE_OUTCOME_FAILED};
    loaded l = load_text("kempe: 1\nparameters: {P: 0.25}\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 1}, raw: yes}\n"
                         "forces: {pull: {joint: rod.y1, force: P*exp(q(rod.y1)/0.05 m)}}\nstart: {elastic: static}\n");
    const kempe_run_options run = {.t_end = 0.01, .rtol = 1e-8};
    kempe_values *set = NULL;
    kempe_ensemble *e = NULL;
    kempe_ensemble_result *batch = NULL;
    lines[0] = '\0';
    kempe_context_set_log(l.context, keep_line, NULL);
    CHECK(l.model && kempe_values_new(l.model, 2, names, 3, values, &set) == KEMPE_OK &&
          kempe_ensemble_new(l.model, set, &e) == KEMPE_OK &&
          kempe_ensemble_run(e, &run, 0, &batch) == KEMPE_UNTRUSTED);
    for (int k = 0; k < 3 && batch; k++)
        CHECK(kempe_ensemble_result_outcome(batch, k) == outcomes[k]);
    CHECK(batch && strstr(kempe_ensemble_result_reason(batch, 2), "the flexible bodies find no balance"));
    CHECK(
        strstr(lines, "do not trust 1 of 3 instances: the deformations of instance 2 start in a balance that is not"));
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload(&l);
}

/* Derivatives of -q L^4/8 E I; rates of a balance that does not change are zero. */
static void balance_has_derivatives(void)
{
    static const char *const of[] = {"trajectory", "reactions"};
    loaded l = load_text("kempe: 1\ngravity: [0, -g, 0]\nparameters: {B: 5000, g: 10}\nbodies:\n  rod:\n"
                         "    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: 2, rhoA: 3, EIz: B}, shapes: {y: 3}}\n"
                         "    points: {tip: {station: 2}}\nstart: {elastic: static}\n");
    for (int k = 0; k < 2; k++) {
        const kempe_run_options run = {.t_end = 0.1, .rtol = 1e-10};
        const kempe_sensitivity_options how = {.parameters = "B,g",
                                               .outputs = "position(rod.tip).y,velocity(rod.tip).y",
                                               .of = of[k],
                                               .at = k == 1 ? "start" : NULL,
                                               .run = k == 0 ? &run : NULL};
        kempe_sensitivity *s = NULL;
        CHECK(l.system && kempe_sensitivity_new(l.model, &how, &s) == KEMPE_OK);
        for (int row = 0; s && row<s->rows; row += s->rows> 1 ? s->rows - 1 : 1) {
            CHECK_NEAR(kmp_sensitivity_slope(s, row, 0, 0), 30 * 16 / 8.0 / (5000.0 * 5000.0), 1e-15);
            CHECK_NEAR(kmp_sensitivity_slope(s, row, 0, 1), -3 * 16 / (8 * 5000.0), 1e-12);
            CHECK_NEAR(kmp_sensitivity_slope(s, row, 1, 1), 0, 1e-10);
        }
        kempe_sensitivity_free(s);
    }
    unload(&l);
}

static void what_is_refused(void)
{
    load_rejected("kempe: 1\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
                  "    flexible: {beam: {length: 2, rhoA: 3, EIz: 1}, shapes: {y: 3}}\n"
                  "start: {elastic: static, goals: {A: 1}}\n",
                  "goals are met before the deformations move into balance");
    load_rejected("kempe: 1\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
                  "    flexible: {beam: {length: 2, rhoA: 3, EIz: 1}, shapes: {y: 3}}\nstart: {elastic: loose}\n",
                  "start elastic");
}

/* A rod to a cantilever: its length is reached by bending alone. */
static void deformations_that_close_have_no_derivative(void)
{
    loaded l = load_text("kempe: 1\nparameters: {EI: 20}\nground: {points: {A: [1, 1, 0]}}\nbodies:\n  rod:\n"
                         "    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: 1, rhoA: 1, EIz: EI}, shapes: {y: 2}, raw: yes}\n"
                         "    points: {tip: {station: 1}}\n"
                         "loops: {stay: {rod: [rod.tip, ground.A], length: 0.98}}\n");
    kempe_sensitivity *s = NULL;
    const kempe_sensitivity_options how = {.run = &(kempe_run_options){.t_end = 0.01}, .parameters = "EI"};
    CHECK(l.system && kempe_sensitivity_new(l.model, &how, &s) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "deformations help to close its loops"));
    kempe_sensitivity_free(s);
    unload(&l);
}

int main(void)
{
    TEST(cantilever_hangs);
    TEST(columns_bend);
    TEST(robot_is_loaded_by_its_drives);
    TEST(pieces_bend);
    TEST(held_joints_stay);
    TEST(instances_hang);
    TEST(instances_are_pulled);
    TEST(instances_deflect_far);
    TEST(instances_deflect_on_the_way);
    TEST(balance_has_derivatives);
    TEST(deformations_that_close_have_no_derivative);
    TEST(what_is_refused);
    return check_report();
}
