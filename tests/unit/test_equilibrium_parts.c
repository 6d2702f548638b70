/* SPDX-License-Identifier: BSD-3-Clause */
/* Equilibria of many parts that share nothing: each part rests as it does alone, what friction holds is an interval of
 * its part, and the work grows as the number of parts. */
#include "base/memory.h"
#include "loaded.h"
#include "scene_text.h"
#include <kempe/equilibrium.h>
#include <kempe/modes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define HEAD "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"

/* Balls with friction over a plane, at heights of their own, or at rest on it. */
static scene balls(int count, bool resting)
{
    scene s = {.length = 0};
    put(&s, HEAD);
    for (int i = 0; i < count; i++)
        put(&s,
            "  s%d: {joint: {name: j%d, planar: z, at: ground}, mass: %d, inertia: {zz: 0.004}, points: {C: [0, 0, "
            "0]}}\n",
            i, i, 1 + i);
    put(&s, "contacts:\n");
    for (int i = 0; i < count; i++)
        put(&s,
            "  c%d: {sphere: s%d.C, radius: 0.1, on: {plane: ground.O, normal: y}, restitution: 0.5, friction: 0.3}\n",
            i, i);
    put(&s, "start:\n  q: {");
    for (int i = 0; i < count; i++)
        put(&s, "j%d.1: %g, j%d.2: %g%s", i, 0.3 * i, i, resting ? 0.1 : 0.3 + 0.02 * ((7 * i) % count),
            i < count - 1 ? ", " : "}\n");
    return s;
}

/* Slides with friction, each on its own spring, and a pendulum between them. */
static scene slides(int count)
{
    scene s = {.length = 0};
    put(&s, HEAD);
    for (int i = 0; i < count; i++)
        put(&s, "  b%d: {joint: {name: x%d, prismatic: x, at: ground}, mass: 1}\n", i, i);
    put(&s, "  bob: {joint: {name: th, revolute: z, at: ground}, mass: 1, com: [0, -0.5, 0]}\nforces:\n");
    for (int i = 0; i < count; i++)
        put(&s,
            "  k%d: {joint: x%d, spring: {stiffness: %d}}\n"
            "  rub%d: {joint: x%d, friction: {force: 2}}\n",
            i, i, 10 * (1 + i), i, i);
    return s;
}

static kempe_equilibrium *find(const loaded *l)
{
    kempe_equilibrium *e = NULL;
    kempe_context_set_log(l->context, NULL, NULL);
    CHECK(l->system && kempe_equilibrium_new(l->system, NULL, &e) == KEMPE_OK);
    if (!e)
        printf("%s\n", kempe_context_message(l->context));
    return e;
}

static double number_in(const kempe_table *table, const char *column, int row)
{
    const int c = table ? kempe_table_find(table, column) : -1;
    return c >= 0 && row < kempe_table_row_count(table) ? kempe_table_number(table, row, c) : NAN;
}

/* The interval of each slide is 2 F / k wide, whatever the others have. */
static void each_slide_has_its_interval(void)
{
    enum { COUNT = 5 };
    scene s = slides(COUNT);
    loaded l = load_text(s.text);
    kempe_equilibrium *e = find(&l);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "rest", &table) == KEMPE_OK);
    CHECK(table && kempe_table_row_count(table) == 2 * COUNT);
    for (int row = 0; row < 2 * COUNT; row++) {
        char name[16];
        (void)snprintf(name, sizeof name, "x%d", row / 2);
        const double end = (row % 2 ? 2.0 : -2.0) / (10 * (1 + row / 2));
        CHECK_NEAR(number_in(table, "value", row), end, 1e-11);
        if (table && row < kempe_table_row_count(table)) {
            CHECK_TEXT(kempe_table_word(table, row, kempe_table_find(table, "coordinate")), name);
            CHECK_TEXT(kempe_table_word(table, row, kempe_table_find(table, "element")) + 3, name + 1);
            CHECK_TEXT(kempe_table_word(table, row, kempe_table_find(table, "end")), "slips");
        }
        for (int k = 0; k < COUNT; k++) { /* the others stay */
            (void)snprintf(name, sizeof name, "q.x%d", k);
            CHECK_NEAR(number_in(table, name, row), k == row / 2 ? end : 0, 1e-11);
        }
    }
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* Balls that fall from different heights rest on the plane, each with its weight. */
static void each_ball_rests(void)
{
    enum { COUNT = 7 };
    scene s = balls(COUNT, false);
    loaded l = load_text(s.text);
    kempe_equilibrium *e = find(&l);
    kempe_table *contacts = NULL, *equilibria = NULL;
    CHECK(e && kempe_equilibrium_table(e, "contacts", &contacts) == KEMPE_OK);
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &equilibria) == KEMPE_OK);
    for (int i = 0; i < COUNT; i++) {
        char name[16];
        (void)snprintf(name, sizeof name, "q.j%d.2", i);
        CHECK_NEAR(number_in(contacts, "gap", i), 0, 1e-11);
        CHECK_NEAR(number_in(contacts, "force", i), 9.81 * (1 + i), 1e-9);
        CHECK_NEAR(number_in(equilibria, name, 0), 0.1, 1e-11);
    }
    kempe_table_free(contacts);
    kempe_table_free(equilibria);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A part without an equilibrium is named, with the forces that move it. */
static void a_part_may_have_none(void)
{
    scene s = balls(3, false);
    char *last = strstr(s.text, "  c1:");
    CHECK(last);
    if (last)
        memset(last, ' ', (size_t)(strchr(last, '\n') - last));
    loaded l = load_text(s.text);
    kempe_equilibrium *e = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_E_FAILED);
    const char *said = kempe_context_message(l.context);
    CHECK(strstr(said, "nothing restrains 'j1.2'"));
    CHECK(strstr(said, "gravity -19.62 N"));
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A pendulum that begins upright does not stay there because a ball beside it falls. */
static void a_part_leaves_what_is_not_stable(void)
{
    loaded l = load_text(
        HEAD "  bob: {joint: {name: th, revolute: z, at: ground}, mass: 1, com: [0, 0.5, 0]}\n"
             "  ball: {joint: {name: y, prismatic: y, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
             "contacts: {c: {sphere: ball.C, radius: 0.1, on: {plane: ground.O, normal: y}, restitution: 0.5}}\n"
             "start: {q: {y: 0.5}}\n");
    kempe_equilibrium *e = find(&l);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    CHECK_NEAR(fabs(number_in(table, "q.th", 0)), 3.14159265358979323846, 1e-9);
    CHECK_NEAR(number_in(table, "q.y", 0), 0.1, 1e-11);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A part may turn in charts: a pendulum on a ball joint hangs down, from a start beyond its singular position, and a
 * body with a ball at its tip lies on it. */
static void parts_turn_in_charts(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                  "  bob: {joint: {name: S, spherical: x, at: ground}, mass: 1, inertia: {xx: 0.1, yy: 0.2, zz: "
                  "0.3}, com: [0, 0, 0.5]}\n"
                  "  rod: {joint: {name: F, free: x, at: ground}, mass: 1, inertia: {xx: 0.1, yy: 0.2, zz: 0.3}, "
                  "points: {T: [0, 0, 0.3]}}\n"
                  "  ball: {joint: {name: y, prismatic: z, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
                  "contacts:\n"
                  "  c: {sphere: ball.C, radius: 0.1, on: {plane: ground.O, normal: z}, restitution: 0.5}\n"
                  "  d: {sphere: rod.T, radius: 0.1, on: {plane: ground.O, normal: z}, restitution: 0.5}\n"
                  "start: {q: {y: 0.5, F.3: 2, S.1: 1.2, S.2: 1.55, F.4: 0.3, F.5: 0.2}}\n");
    kempe_equilibrium *e = find(&l);
    kempe_table *contacts = NULL, *equilibria = NULL;
    CHECK(e && kempe_equilibrium_table(e, "contacts", &contacts) == KEMPE_OK);
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &equilibria) == KEMPE_OK);
    const double down = cos(number_in(equilibria, "q.S.1", 0)) * cos(number_in(equilibria, "q.S.2", 0));
    const double tip = cos(number_in(equilibria, "q.F.4", 0)) * cos(number_in(equilibria, "q.F.5", 0));
    CHECK_NEAR(down, -1, 1e-12);
    CHECK_NEAR(tip, 1, 1e-12);
    CHECK_NEAR(number_in(equilibria, "q.F.3", 0), -0.2, 1e-11);
    CHECK_NEAR(number_in(contacts, "force", 0), 9.81, 1e-9);
    CHECK_NEAR(number_in(contacts, "force", 1), 9.81, 1e-9);
    kempe_table_free(contacts);
    kempe_table_free(equilibria);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* Allocations of a study of so many balls. */
static double work_of(int count, bool resting, bool modes)
{
    scene s = balls(count, resting);
    loaded l = load_text(s.text);
    kempe_equilibrium *e = NULL;
    kempe_modes *m = NULL;
    kempe_context_set_log(l.context, NULL, NULL);
    const unsigned long before = kmp_memory_count();
    CHECK(l.system &&
          (modes ? kempe_modes_new(l.system, NULL, &m) : kempe_equilibrium_new(l.system, NULL, &e)) == KEMPE_OK);
    const unsigned long work = kmp_memory_count() - before;
    kempe_modes_free(m);
    kempe_equilibrium_free(e);
    unload(&l);
    return (double)work;
}

/* Twice as many parts take twice the work. */
static void work_grows_with_the_parts(void)
{
    for (int resting = 0; resting < 2; resting++)
        for (int modes = 0; modes < 2; modes++) {
            const double few = work_of(12, resting, modes), many = work_of(24, resting, modes);
            printf("  %s of %s: %.0f and %.0f allocations\n", modes ? "modes" : "equilibrium",
                   resting ? "resting balls" : "falling balls", few, many);
            CHECK(many < 2.4 * few);
        }
}

int main(void)
{
    TEST(each_slide_has_its_interval);
    TEST(each_ball_rests);
    TEST(a_part_may_have_none);
    TEST(a_part_leaves_what_is_not_stable);
    TEST(parts_turn_in_charts);
    TEST(work_grows_with_the_parts);
    return check_report();
}
