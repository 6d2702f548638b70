/* SPDX-License-Identifier: BSD-3-Clause */
/* Limit cycles through the public header: tables of a normal form with a closed form, pictures, and wrong options. */
#include "loaded.h"
#include <kempe/limit_cycles.h>
#include <kempe/modes.h>
#include <kempe/table.h>
#include <stdlib.h>

static double number(const kempe_table *table, int row, const char *name)
{
    return kempe_table_number(table, row, kempe_table_find(table, name));
}

static kempe_table *table_of(const kempe_limit_cycles *cycles, const char *name)
{
    kempe_table *table = NULL;
    CHECK(kempe_limit_cycles_table(cycles, name, &table) == KEMPE_OK);
    return table;
}

/* r' = r (mu + r^2 - r^4): r^2 = (1 -+ sqrt(1 + 4 mu)) / 2. */
static void check_rows(const kempe_limit_cycles *cycles)
{
    kempe_table *rows = table_of(cycles, "rows"), *states = table_of(cycles, "states");
    int count = kempe_table_row_count(rows);
    CHECK(count == kempe_limit_cycles_count(cycles, 0) && kempe_table_row_count(states) == count);
    for (int k = 1; k < count; k++) {
        double mu = number(rows, k, "mu"), r = number(rows, k, "state.x.amplitude");
        double x = number(states, k, "state.x"), y = number(states, k, "state.y");
        CHECK_NEAR(r * r * (1 - r * r), -mu, 1e-8);
        CHECK_NEAR(x * x + y * y, r * r, 1e-8);
        CHECK_NEAR(number(rows, k, "state.x.max"), r, 1e-8);
        CHECK_NEAR(number(rows, k, "period"), 2 * acos(-1) / 3, 1e-8);
    }
    kempe_table_free(states);
    kempe_table_free(rows);
}

static void normal_form(void)
{
    loaded l = load("tests/models/bautin.yaml");
    kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "mu=-0.5:0.25:7"};
    kempe_limit_cycles *cycles = NULL;
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    CHECK(kempe_limit_cycles_branch_count(cycles) == 1);
    if (cycles) {
        kempe_table *critical = table_of(cycles, "critical"), *equilibria = table_of(cycles, "equilibria");
        CHECK(kempe_table_row_count(critical) == 1 && kempe_table_row_count(equilibria) == 7);
        CHECK_NEAR(number(critical, 0, "mu"), 0, 1e-12);
        CHECK_NEAR(number(critical, 0, "frequency"), 3 / (2 * acos(-1)), 1e-12);
        CHECK_NEAR(number(equilibria, 0, "growth"), -0.5, 1e-12);
        kempe_table_free(critical);
        kempe_table_free(equilibria);
        check_rows(cycles);
        kempe_table *none = NULL;
        CHECK(kempe_limit_cycles_table(cycles, "points", &none) == KEMPE_E_ARGUMENT && !none);
        char *text = NULL;
        CHECK(kempe_limit_cycles_print(cycles, KEMPE_TEXT, &text) == KEMPE_OK && text && strstr(text, "fold"));
        kempe_text_free(text);
        kempe_limit_cycles_free(cycles);
    }
    unload(&l);
}

/* Rates of a conservative motion: cycles of all amplitudes at one value. */
static void centre(void)
{
    static const char text[] = "kempe: 1\n"
                               "name: centre\n"
                               "parameters: {d: 0}\n"
                               "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                               "forces: {f: {joint: x, force: \"-q(x) - q(x)^3 + d*qd(x)\"}}\n";
    loaded l = load_text(text);
    kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "d=-0.1:0.1:3"};
    kempe_limit_cycles *cycles = NULL;
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    if (cycles) {
        char *said = NULL;
        CHECK(kempe_limit_cycles_print(cycles, KEMPE_TEXT, &said) == KEMPE_OK && strstr(said, "conservative"));
        kempe_text_free(said);
    }
    kempe_limit_cycles_free(cycles);
    unload(&l);
}

static void refused(void)
{
    static const struct {
        const char *sweep, *outputs, *words;
    } wrong[] = {{NULL, NULL, "--sweep"},          {"nu=0:1:3", NULL, "nu"},
                 {"mu=0:0:3", NULL, "two ends"},   {"mu=0:1:3,w=1:2", NULL, "only one"},
                 {"q.s=0:1:3", NULL, "parameter"}, {"mu=-0.1:0.1:3", "state(z)", "z"}};
    loaded l = load("tests/models/bautin.yaml");
    for (size_t k = 0; l.system && k < sizeof wrong / sizeof *wrong; k++) {
        kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = wrong[k].sweep, .outputs = wrong[k].outputs};
        kempe_limit_cycles *cycles = NULL;
        kempe_status status = kempe_limit_cycles_new(l.system, &ask, &cycles);
        CHECK(status == KEMPE_E_ARGUMENT || status == KEMPE_E_INPUT);
        CHECK(!cycles && strstr(kempe_context_message(l.context), wrong[k].words));
    }
    unload(&l);
}

/* Simulations of each value: no cycle below the Hopf point, that of van der Pol's oscillator above it. */
static void settled(void)
{
    loaded l = load_text("kempe: 1\n"
                         "name: oscillator\n"
                         "parameters: {a: 0.1}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: x, force: \"(a - q(x)^2)*qd(x) - q(x)\"}}\n"
                         "start: {q: {x: 0.1}}\n");
    kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "a=-1:1:3", .settle = 200};
    kempe_limit_cycles *cycles = NULL;
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    CHECK(kempe_limit_cycles_branch_count(cycles) == 2 && kempe_limit_cycles_count(cycles, 1) == 3);
    if (cycles) {
        kempe_table *rows = table_of(cycles, "rows"), *states = table_of(cycles, "states");
        CHECK(kempe_table_row_count(rows) == 6);
        CHECK_TEXT(kempe_table_word(rows, 0, kempe_table_find(rows, "point")), "rest");
        CHECK_TEXT(kempe_table_word(rows, 2, kempe_table_find(rows, "stability")), "stable");
        CHECK_NEAR(number(rows, 2, "q.x.amplitude"), 2.00861986, 1e-4);
        CHECK_NEAR(number(rows, 2, "period"), 6.66328686, 1e-4);
        kempe_table_free(rows);
        kempe_table_free(states);
    }
    kempe_limit_cycles_free(cycles);
    unload(&l);
}

static void count_warnings(void *user, kempe_level level, const char *line)
{
    (void)line;
    *(int *)user += level == KEMPE_LOG_WARNING;
}

/* A start at an equilibrium, which is unstable above a = 0: nothing moves, and no stability follows. */
static void nothing_is_disturbed(void)
{
    loaded l = load_text("kempe: 1\n"
                         "parameters: {a: 0.1}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: x, force: \"(a - q(x)^2)*qd(x) - q(x)\"}}\n");
    kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "a=-1:1:3", .settle = 20};
    kempe_limit_cycles *cycles = NULL;
    int warnings = 0;
    kempe_context_set_log(l.context, count_warnings, &warnings);
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    CHECK(warnings == 1);
    if (cycles) {
        kempe_table *rows = table_of(cycles, "rows");
        CHECK_TEXT(kempe_table_word(rows, 2, kempe_table_find(rows, "point")), "rest");
        CHECK_TEXT(kempe_table_word(rows, 2, kempe_table_find(rows, "stability")), "undecided");
        kempe_table_free(rows);
    }
    kempe_limit_cycles_free(cycles);
    unload(&l);
}

/* The same oscillator with a slider that it drives twice as far, and a start that gives both: simulations go on from
 * each other without it. */
static void settled_with_closures(void)
{
    loaded l = load_text("kempe: 1\n"
                         "name: driven slider\n"
                         "parameters: {a: 0.1}\n"
                         "bodies:\n"
                         "  m: {joint: {name: x, prismatic: x, at: ground}, mass: 0.5}\n"
                         "  n: {joint: {name: z, prismatic: x, at: ground}, mass: 0.125}\n"
                         "loops: {K: {constraint: \"q(z) - 2*q(x)\"}}\n"
                         "forces: {f: {joint: x, force: \"(a - q(x)^2)*qd(x) - q(x)\"}}\n"
                         "start: {q: {x: 0.1, z: 0.2}, qd: {x: 0, z: 0}, hold: [x, z]}\n");
    kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "a=0.5:1:2", .settle = 200, .outputs = "q(x)"};
    kempe_limit_cycles *cycles = NULL;
    int warnings = 0;
    kempe_context_set_log(l.context, count_warnings, &warnings);
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    CHECK(cycles && warnings == 0);
    if (cycles) {
        kempe_table *rows = table_of(cycles, "rows");
        CHECK(kempe_table_row_count(rows) == 4);
        CHECK_NEAR(number(rows, 1, "q.x.amplitude"), 2.00861986, 1e-4);
        CHECK_NEAR(number(rows, 2, "period"), 6.66328686, 1e-4);
        kempe_table_free(rows);
    }
    kempe_limit_cycles_free(cycles);
    unload(&l);
}

/* A wheelset on rails whose speed a load holds: its column in rows and of modes. */
static void held_speed(void)
{
    loaded l = load("examples/restrained_wheelset/hunting_wheelset.yaml");
    kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "V=100:102:3", .outputs = "q(y)", .most = 3};
    kempe_modes_options sweep = {.sweep = "V=100:102:3"};
    kempe_limit_cycles *cycles = NULL;
    kempe_modes *modes = NULL;
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    CHECK(l.system && kempe_modes_new(l.system, &sweep, &modes) == KEMPE_OK);
    if (cycles && modes) {
        kempe_table *rows = table_of(cycles, "rows"), *locus = NULL;
        CHECK(kempe_modes_table(modes, "rows", &locus) == KEMPE_OK);
        int load = kempe_table_find(rows, "load.x"), held = kempe_table_find(locus, "load.x");
        CHECK(load >= 0 && held >= 0);
        CHECK_TEXT(kempe_table_unit(rows, load), "N");
        CHECK_TEXT(kempe_table_unit(locus, held), "N");
        CHECK_NEAR(kempe_table_number(rows, 0, load), kempe_table_number(locus, 1, held), 1e-3);
        CHECK(kempe_table_number(rows, 1, load) > kempe_table_number(rows, 0, load));
        kempe_table_free(rows);
        kempe_table_free(locus);
    }
    kempe_modes_free(modes);
    kempe_limit_cycles_free(cycles);
    unload(&l);
}

int main(void)
{
    TEST(held_speed);
    TEST(settled);
    TEST(nothing_is_disturbed);
    TEST(settled_with_closures);
    TEST(normal_form);
    TEST(centre);
    TEST(refused);
    return check_report();
}
