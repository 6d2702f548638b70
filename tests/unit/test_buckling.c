/* SPDX-License-Identifier: BSD-3-Clause */
/* The part of the stiffness that loads take: columns, lateral buckling and struts beside published factors and digits
 * of another program; sentences of check and of runs. */
#include "constraints/closing/load_margin.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char lines[4000];

static void keep_line(void *user, kempe_level level, const char *line)
{
    (void)user;
    (void)level;
    (void)snprintf(lines + strlen(lines), sizeof lines - strlen(lines), "%s\n", line);
}

/* At the start. */
static double taken(const char *text)
{
    double part[4] = {NAN, NAN, NAN, NAN};
    loaded l = load_text(text);
    kempe_assembly *a = NULL;
    CHECK(l.system && kempe_assembly_new(l.system, &a) == KEMPE_OK);
    kmp_load_margin *margin = NULL;
    CHECK(a && kmp_load_margin_new(l.system, kempe_assembly_q(a), kempe_assembly_qd(a), &margin) == KEMPE_OK && margin);
    if (margin)
        kmp_load_margin_at(margin, 0, kempe_assembly_q(a), kempe_assembly_qd(a), NULL, part);
    kmp_load_margin_free(margin);
    kempe_assembly_free(a);
    unload(&l);
    return part[0];
}

#define CANTILEVER(force)                                                                                              \
    "kempe: 1\ngravity: [0, 0, 0]\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"                              \
    "    flexible: {beam: {length: 1, rhoA: 1, %s}, shapes: {%s}}\n    points: {tip: {station: 1}}\n"                  \
    "forces: {end: {at: rod.tip, force: " force "}}\n"

/* P L^2/E I of a column with 1 to 6 powers of x, and F L^2/sqrt(E I G J) of a beam that bends sideways. */
static void columns_and_beams(void)
{
    static const struct {
        int n;
        double column, beam;
    } row[] = {{1, 3, 0},
               {2, 2.4859616991199, 4.4849706262},
               {3, 2.4677381625246, 4.0499829606},
               {4, 2.4674044697466, 4.0163149038},
               {6, 2.4674011003648, 4.0126152734}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        char text[1024], shapes[64];
        (void)snprintf(shapes, sizeof shapes, "y: %d", row[k].n);
        (void)snprintf(text, sizeof text, CANTILEVER("[-10, 0, 0]"), "EIz: 10", shapes);
        CHECK_NEAR(1 / taken(text), row[k].column, 1e-12);
        (void)snprintf(shapes, sizeof shapes, "y: %d, torsion: %d", row[k].n, row[k].n);
        (void)snprintf(text, sizeof text, CANTILEVER("[0, 0, 6]"), "EIz: 9, GJ: 4, rhoI: 0.01", shapes);
        if (row[k].beam > 0)
            CHECK_NEAR(1 / taken(text), row[k].beam, 1e-10);
    }
}

/* Between pins: pi^2 E I/L^2, by the force of a slider that a loop transmits. */
static void strut(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
        "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 6}, frame: chord}\n"
        "    points: {tip: {station: 1}}\n"
        "  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [1, 0, 0]}}\n"
        "loops: {C: {ball: [rod.tip, slider.P]}}\nforces: {end: {at: slider.P, force: [-40, 0, 0]}}\n";
    CHECK_NEAR(1 / taken(text), pow(acos(-1), 2) / 4, 1e-5);
}

/* A column under its weight: rho A g L^3/E I = 7.8373. It takes no notice of a pull. */
static void weight_and_pull(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ngravity: [-1, 0, 0]\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                   "    flexible: {beam: {length: 1, rhoA: 1, EIz: 1}, shapes: {y: 6}}\n");
    CHECK_NEAR(1 / taken(text), 7.83734744, 1e-6);
    (void)snprintf(text, sizeof text, CANTILEVER("[10, 0, 0]"), "EIz: 10", "y: 4");
    CHECK(taken(text) < 0);
}

/* Without terms of second order a rotation takes (rate/first frequency)^2. */
static void rotation(void)
{
    static const char text[] =
        "kempe: 1\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
        "    flexible: {beam: {length: 1, rhoA: 1, EIz: 1}, shapes: {y: 6}, stiffening: none}\nstart: {qd: {A: 1}}\n";
    CHECK_NEAR(taken(text), 1 / pow(3.516015268500151, 2), 1e-10);
}

/* check examines a mechanism without states, friction that sticks and forces, but the loads are those of the model. */
static void states_and_friction(void)
{
    static const char *const more[] = {
        "states: {s: {rate: 1 - s, start: 0.5}}\nforces: {end: {at: rod.tip, force: ['-100*s', 0, 0]}}\n",
        "forces: {end: {at: rod.tip, force: [-50, 0, 0]}, f: {joint: A, friction: {torque: 3}}}\n"};
    for (int k = 0; k < 2; k++) {
        char text[1024], *said = NULL;
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
                       "    flexible: {beam: {length: 1, rhoA: 1, EIz: 100}, shapes: {y: 4}}\n"
                       "    points: {tip: {station: 1}}\n%s",
                       more[k]);
        loaded l = load_text(text);
        kempe_check *check = NULL;
        CHECK(l.system && kempe_check_new(l.system, &check) == KEMPE_OK &&
              kempe_check_print(check, KEMPE_TEXT, &said) == KEMPE_OK);
        CHECK(said && strstr(said, "it buckles at 4.935 times the loads of the start"));
        free(said);
        kempe_check_free(check);
        unload(&l);
    }
}

static void sentences(void)
{
    static const struct {
        const char *force, *said, *warned;
    } row[] = {{"[-10, 0, 0]", "it buckles at 2.467 times the loads of the start", ""},
               {"[-20, 0, 0]", "warning: it buckles at 1.234 times the loads of the start", ""},
               {"[-30, 0, 0]", "warning: it buckles under the loads of the start, at 0.822 times these",
                "flexible body 'rod' buckles: at t = 0 s its loads take 1.22 times its stiffness"}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, 0]\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                       "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 4}}\n"
                       "    points: {tip: {station: 1}}\nforces: {end: {at: rod.tip, force: %s}}\n",
                       row[k].force);
        loaded l = load_text(text);
        const kempe_run_options run = {.t_end = 0.01, .rtol = 1e-6};
        kempe_check *check = NULL;
        kempe_trajectory *t = NULL;
        char *said = NULL;
        lines[0] = '\0';
        kempe_context_set_log(l.context, keep_line, NULL);
        CHECK(l.system && kempe_check_new(l.system, &check) == KEMPE_OK &&
              kempe_check_print(check, KEMPE_TEXT, &said) == KEMPE_OK);
        CHECK(said && strstr(said, row[k].said));
        const kempe_status trust = row[k].warned[0] ? KEMPE_UNTRUSTED : KEMPE_OK; /* it stays straight */
        CHECK(l.system && kempe_simulate(l.system, &run, &t) == trust);
        CHECK(row[k].warned[0] ? strstr(lines, row[k].warned) != NULL : strstr(lines, "buckles") == NULL);
        free(said);
        kempe_trajectory_free(t);
        kempe_check_free(check);
        unload(&l);
    }
}

int main(void)
{
    TEST(columns_and_beams);
    TEST(strut);
    TEST(weight_and_pull);
    TEST(rotation);
    TEST(states_and_friction);
    TEST(sentences);
    return check_report();
}
