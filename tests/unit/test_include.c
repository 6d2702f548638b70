/* SPDX-License-Identifier: BSD-3-Clause */
/* Included models: what they become, and that their equations are those of the model written out. */
#include "derived.h"
#include "dynamics/equations.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdlib.h>

static kempe_context *context;

static const char plain[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\ntables: {push: {x: [0, 1, 2], y: [0, 1, 0]}}\nbodies:\n"
    "  trunk: {joint: {name: T, prismatic: x, at: ground}, mass: 9, points: {front: [0.5, 0, 0], "
    "lg: [0.5, 0, 0.3], lh: [0.5, 0.1, 0.3], la: [0.8, 0, 0.3], rh: [0, 0.1, 0], ra: [0.4, 0, 0]}}\n"
    "  left_thigh: {joint: {revolute: z, at: trunk.lh}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.09/12}, "
    "points: {knee: [0.3, 0, 0]}}\n"
    "  left_shin: {joint: {revolute: z, at: left_thigh.knee}, mass: 0.5, inertia: {zz: 0.01}, "
    "points: {foot: [0.3, 0, 0]}}\n"
    "  left_wheel: {joint: {revolute: z, at: trunk.lg}, inertia: {zz: 0.02}}\n"
    "  right_thigh: {joint: {revolute: z, at: trunk.rh}, mass: 2, com: [0.2, 0, 0], inertia: {zz: 0.32/12}, "
    "points: {knee: [0.4, 0, 0]}}\n"
    "  right_shin: {joint: {revolute: z, at: right_thigh.knee}, mass: 1, inertia: {zz: 0.01}, "
    "points: {foot: [0.4, 0, 0]}}\n"
    "  right_wheel: {joint: {revolute: z, at: trunk}, inertia: {zz: 0.02}}\n"
    "loops:\n  tie: {rod: [left_shin.foot, right_shin.foot], length: 1}\n"
    "  left_rope: {rod: [left_shin.foot, trunk.la], length: 0.45}\n"
    "  right_rope: {rod: [right_shin.foot, trunk.ra], length: 0.6}\n"
    "forces:\n  a: {joint: left_shin, torque: \"push(t) - 0.1*qd(left_shin) + q(left_thigh)\"}\n"
    "  b: {joint: right_shin, torque: \"push(t) - 0.1*qd(right_shin) + 2*q(right_thigh)\"}\n";

static kempe_model *read_walker(void)
{
    kempe_model *m = NULL;
    if (kempe_model_read(context, KEMPE_ROOT "/tests/models/walker.yaml", &m) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(m != NULL);
    return m;
}

static void names(void)
{
    static const char *const motions[] = {"T", "left_H", "left_K", "left_W", "right_H", "right_K", "right_W"};
    kempe_model *m = read_walker();
    if (!m)
        return;
    CHECK(m->motion_count == 7 && m->closure_count == 3 && m->force_count == 2 && m->sensor_count == 2);
    for (int k = 0; k < 7; k++)
        CHECK_TEXT(m->motions[k].name, motions[k]);
    CHECK_TEXT(m->closures[0].name, "tie");
    CHECK_TEXT(m->closures[2].name, "right_rope");
    CHECK_TEXT(m->parameters[3].name, "left_m");
    CHECK_NEAR(m->start.q[0].value, 0.25, 0);
    CHECK(m->start.q[1].value == 0.5 && m->start.q[4].value == 0.5 && m->start.hold[3] && m->start.hold[6]);
    CHECK(m->run.t_end == 1 && m->outputs[1].kind == KMP_OUTPUT_SENSOR && m->outputs[1].index == 0);
    kempe_model_free(m);
}

/* Of n coordinates and m rows. Frees the model. */
static void same_equations(kempe_model *m, const char *text, int n, int rows)
{
    const unsigned sets = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD;
    kempe_model *written = NULL;
    derived a, b;
    CHECK(kempe_model_read_text(context, text, "plain", &written) == KEMPE_OK);
    if (!m || !written)
        return;
    CHECK(derived_init(&a, m, sets, KMP_SCHEME_COMPOSITE, false));
    CHECK(derived_init(&b, written, sets, KMP_SCHEME_COMPOSITE, false));
    random_seed(2);
    state s = random_state_vectors();
    derived_eval(&a, &s);
    derived_eval(&b, &s);
    CHECK(a.m == rows && b.m == rows && m->motion_count == n && written->motion_count == n);
    for (int k = 0; k < n * n; k++)
        CHECK_NEAR(a.mass[k], b.mass[k], 1e-13);
    for (int k = 0; k < n; k++)
        CHECK_NEAR(a.bias[k], b.bias[k], 1e-12);
    for (int k = 0; k < rows; k++) {
        CHECK_NEAR(a.h[k], b.h[k], 1e-14);
        CHECK_NEAR(a.jdqd[k], b.jdqd[k], 1e-12);
    }
    derived_free(&a);
    derived_free(&b);
    kempe_model_free(m);
    kempe_model_free(written);
}

static void equations(void)
{
    same_equations(read_walker(), plain, 7, 3);
}

/* A file included at a section of a flexible body: its ground moves and turns with this section. At the section that
 * the joint holds, a place without a station is one of the body's axes. */
static void at_a_section(void)
{
    static const char rod[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\n%sbodies:\n"
        "  rod: {joint: {name: T, revolute: z, at: ground}, flexible: {beam: {length: 0.8, young: 7e8, density: 2700, "
        "section: {rectangle: [12 mm, 8 mm]}}, shapes: {y: 2}, %s}, points: {%s}}\n%s";
    static const char leg[] =
        "  a_thigh: {joint: {revolute: z, at: rod.lh}, mass: 2, com: [0.2, 0, 0], inertia: {zz: 0.32/12}, "
        "points: {knee: [0.4, 0, 0]}}\n"
        "  a_shin: {joint: {revolute: z, at: a_thigh.knee}, mass: 1, inertia: {zz: 0.01}, points: {foot: [0.4, 0, "
        "0]}}\n"
        "  a_wheel: {joint: {revolute: z, at: rod.lg}, inertia: {zz: 0.02}}\n"
        "loops: {rope: {rod: [a_shin.foot, rod.la], length: 0.6}}\n"
        "forces: {b: {joint: a_shin, torque: \"push(t) - 0.1*qd(a_shin) + 2*q(a_thigh)\"}}\n";
    static const char push[] = "tables: {push: {x: [0, 1, 2], y: [0, 1, 0]}}\n";
    static const struct {
        const char *way, *include, *points, *written;
    } cases[] = {
        {"frame: chord", "at: rod.P, offset: [10 mm, 20 mm, 0]", "P: {station: 0.5, offset: [0, 30 mm, 0]}",
         "lg: {station: 0.5, offset: [10 mm, 50 mm, 0]}, lh: {station: 0.5, offset: [10 mm, 150 mm, 0]}, "
         "la: {station: 0.5, offset: [410 mm, 50 mm, 0]}"},
        {"frame: clamped", "at: rod, offset: [0, 20 mm, 0]", "P: [0, 1, 0]",
         "lg: [0, 20 mm, 0], lh: [0, 120 mm, 0], la: {station: 0, offset: [400 mm, 20 mm, 0]}"},
        {"segments: 3", "at: rod.P", "P: {station: 0.5, offset: [0, 30 mm, 0]}",
         "lg: {station: 0.5, offset: [0, 30 mm, 0]}, lh: {station: 0.5, offset: [0, 130 mm, 0]}, "
         "la: {station: 0.5, offset: [400 mm, 30 mm, 0]}"},
    };
    for (int k = 0; k < 3; k++) {
        char include[200], text[2000];
        kempe_model *m = NULL;
        (void)snprintf(include, sizeof include, "include: [{file: leg.yaml, prefix: a_, %s}]\n", cases[k].include);
        (void)snprintf(text, sizeof text, rod, include, cases[k].way, cases[k].points, "");
        if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer", &m) != KEMPE_OK)
            printf("%s\n", kempe_context_message(context));
        (void)snprintf(text, sizeof text, rod, push, cases[k].way, cases[k].written, leg);
        CHECK(m != NULL);
        same_equations(m, text, 6, 1);
    }
}

/* A parameter of an included model can be set from the command line under its full name. */
static void settings(void)
{
    const kempe_setting setting = {"right_m", "5"};
    kempe_model *m = NULL;
    CHECK(kempe_model_read_set(context, KEMPE_ROOT "/tests/models/walker.yaml", &setting, 1, &m) == KEMPE_OK);
    CHECK(m && m->bodies[5].mass.value == 2.5 + 2.5 * (strcmp(m->bodies[5].name, "right_thigh") == 0));
    kempe_model_free(m);
}

/* A start that the model and an included one say: the model has the last word, with a prefix and without. */
static void starts(void)
{
    static const char *const includes[] = {"{file: started.yaml, prefix: a_}", "{file: started.yaml}",
                                           "{file: starts.yaml, prefix: a_}"};
    static const char *const prefix[] = {"a_", "", "a_b_"};
    for (int k = 0; k < 3; k++) {
        char text[400];
        kempe_model *m = NULL;
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ninclude: [%s]\nstart: {q: {%sA: 0.7, %sB: 0.5}, qd: {%sA: 5}, goals: {%sG: 3}}\n",
                       includes[k], prefix[k], prefix[k], prefix[k], prefix[k]);
        if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer", &m) != KEMPE_OK)
            printf("%s\n", kempe_context_message(context));
        CHECK(m != NULL);
        if (!m)
            return;
        const kmp_start *start = &m->start;
        CHECK(start->q[0].value == 0.7 && start->qd[0].value == 5 && start->hold[0]);
        CHECK(start->q[1].value == 0.5 && start->qd[1].value == (k == 2 ? -1 : 4)); /* the one in between */
        CHECK(start->goal_count == 1 && start->goals[0].motion == 2 && start->goals[0].value[0].value == 3);
        kempe_model_free(m);
    }
}

/* Two that neither include the other: a mistake, unless the model says it. */
static void contradictions(void)
{
    static const char two[] = "kempe: 1\ninclude: [{file: started.yaml}, {file: parts/restarted.yaml}]\n";
    char text[400];
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text(context, two, KEMPE_ROOT "/tests/models/outer", &m) == KEMPE_E_INPUT && !m);
    CHECK(strstr(kempe_context_message(context), "restarted.yaml:3:13: start q: 'A' is given twice, also in ") != NULL);
    CHECK(strstr(kempe_context_message(context), "restarted.yaml:3:28: start goals: 'G' is given twice, also in ") !=
          NULL);
    CHECK(strstr(kempe_context_message(context), "started.yaml:7, and") != NULL);
    (void)snprintf(text, sizeof text, "%sstart: {q: {A: 0.7}, goals: {G: 3}}\n", two);
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer", &m) == KEMPE_OK);
    CHECK(m && m->start.q[0].value == 0.7 && m->start.goal_count == 1 && m->start.goals[0].value[0].value == 3);
    kempe_model_free(m);
}

static kempe_model *read_outer(const char *text)
{
    kempe_model *m = NULL;
    if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer", &m) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(m != NULL);
    return m;
}

/* Values of parameters of a file that an included file includes: before the values that this one sets. */
static void deep_settings(void)
{
    int thighs = 0;
    kempe_model *m = read_outer("kempe: 1\nparameters: {k: 3}\n"
                                "include: [{file: walker.yaml, prefix: w_, set: {right_m: k, left_l: 0.7, m: 8}}]\n");
    for (int k = 0; m && k < m->body_count; k++) {
        const kmp_body *body = &m->bodies[k];
        const bool left = strcmp(body->name, "w_left_thigh") == 0, right = strcmp(body->name, "w_right_thigh") == 0;
        CHECK(strcmp(body->name, "w_trunk") != 0 || body->mass.value == 8);
        CHECK(!left || (body->mass.value == 1 && body->com[0].value == 0.35));
        CHECK(!right || (body->mass.value == 3 && body->com[0].value == 0.2));
        thighs += left || right;
    }
    CHECK(thighs == 2);
    kempe_model_free(m);
    m = NULL;
    CHECK(kempe_model_read_text(context, "kempe: 1\ninclude: [{file: walker.yaml, set: {right_n: 5}}]\n",
                                KEMPE_ROOT "/tests/models/outer", &m) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "walker.yaml' has no parameter 'right_n'"));
}

/* An empty value of the model withdraws that of an included file; elsewhere a value is needed. */
static void withdrawn_starts(void)
{
    kempe_model *m = read_outer("kempe: 1\ninclude: [{file: started.yaml, prefix: a_}]\n"
                                "start: {q: {a_A: null}, qd: {a_A: , a_B: 2}, goals: {a_G: null}}\n");
    if (m) {
        CHECK(!m->start.q_given[0] && m->start.q[0].value == 0 && !m->start.qd_given[0] && !m->start.hold[0]);
        CHECK(m->start.qd_given[1] && m->start.qd[1].value == 2 && m->start.goal_count == 0);
        kempe_model_free(m);
    }
    m = read_outer("kempe: 1\ninclude: [{file: started.yaml}]\nstart: {q: {A: null}, hold: [A]}\n");
    CHECK(m && m->start.hold[0]); /* the model holds it itself */
    kempe_model_free(m);
    m = NULL;
    CHECK(kempe_model_read_text(context,
                                "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                                "start: {q: {a: }}\n",
                                "alone", &m) == KEMPE_E_INPUT);
}

int main(void)
{
    context = kempe_context_new();
    TEST(names);
    TEST(equations);
    TEST(at_a_section);
    TEST(settings);
    TEST(starts);
    TEST(contradictions);
    TEST(deep_settings);
    TEST(withdrawn_starts);
    kempe_context_free(context);
    return check_report();
}
