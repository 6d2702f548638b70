/* SPDX-License-Identifier: BSD-3-Clause */
/* States that change at events, in small motions: they are constant, so that results are those of a model with a number
 * in their place, and closed forms. */
#include "known_matrices.h"
#include "loaded.h"
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>

/* A damper whose factor is D, beside a lag w: 2 x'' + D/2 x' + k x = D + u. The state D, or `value` in its place,
 * begins with y0. */
#define DAMPER(state, value, more)                                                                                     \
    "kempe: 1\n"                                                                                                       \
    "parameters: {k: 40, y0: 3}\n"                                                                                     \
    "inputs: {u: {}}\n"                                                                                                \
    "states: {" state "w: {rate: (q(x) - w)/0.1}" more "}\n"                                                           \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"                                             \
    "forces: {f: {joint: x, force: " value " + u - k*q(x) - 0.5*" value "*qd(x)}}\n"
#define EVENT "D: {start: y0, when: q(x) > 0.5, next: 9}, "

static double cell(const kempe_table *table, int row, const char *column)
{
    int k = table ? kempe_table_find(table, column) : -1;
    return k < 0 || row >= kempe_table_row_count(table) ? NAN : kempe_table_number(table, row, k);
}

/* A, B, M and N of (x, x', w): D is no state of them. A parameter of its start value
 * acts as one in its place: at the equilibrium by the load D. */
static void state_space(void)
{
    static const known_matrix cases[] = {{KEMPE_MATRIX_A, 3, 3, {0, -20, 10, 1, -0.75, 0, 0, 0, -10}},
                                         {KEMPE_MATRIX_B, 3, 2, {0, 0.5, 0, 0, 0.5, 0}},
                                         {KEMPE_MATRIX_C, 2, 3, {1, 0, 0, 0, 0, 0}},
                                         {KEMPE_MATRIX_D, 2, 2, {0, 0, 0, 1}},
                                         {KEMPE_MATRIX_L, 2, 2, {-1, 0, -1, 0}},
                                         {KEMPE_MATRIX_M, 2, 2, {2, 0, 0, 1}},
                                         {KEMPE_MATRIX_G, 2, 2, {1.5, 0, 0, 10}},
                                         {KEMPE_MATRIX_K, 2, 2, {40, -10, 0, 0}},
                                         {KEMPE_MATRIX_N, 3, 2, {1, 0, 0, 0, 0, 1}}};
    loaded l = load_text(DAMPER(EVENT, "D", ""));
    const kempe_linearize_options options = {.inputs = "u,y0", .outputs = "q(x),D"};
    kempe_linearization *x = NULL;
    char *text = NULL;
    CHECK(l.system && kempe_linearization_new(l.system, &options, &x) == KEMPE_OK);
    check_matrices(x, sizeof cases / sizeof *cases, cases, 1e-13);
    CHECK(x && kempe_linearization_y(x)[1] == 3);
    CHECK(x && kempe_linearization_print(x, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"held\":") && strstr(text, "\"D\": 3"));
    kempe_text_free(text);
    kempe_linearization_free(x);
    unload(&l);
}

/* Cells of equal columns are equal. */
static void compare(const kempe_table *held, const kempe_table *constant)
{
    CHECK(held && constant && kempe_table_row_count(held) == kempe_table_row_count(constant));
    for (int c = 0; constant && c < kempe_table_column_count(constant); c++) {
        const char *column = kempe_table_column_name(constant, c);
        CHECK(held && kempe_table_find(held, column) >= 0);
        for (int k = 0; k < kempe_table_row_count(constant); k++) {
            const double want = cell(constant, k, column), found = cell(held, k, column);
            if (!isnan(want) || !isnan(found))
                CHECK_NEAR(found, want, 1e-11 * fmax(1, fabs(want)));
        }
    }
}

/* Modes and responses of the two models, the first with the state. */
static void compare_models(const char *const text[2])
{
    loaded l[2];
    kempe_modes *modes[2] = {0};
    kempe_response *response[2] = {0};
    kempe_table *rows[2] = {0}, *frequencies[2] = {0};
    const kempe_response_options options = {.inputs = "u,y0", .outputs = "q(x)", .frequencies = "0:4:40", .linear = 1};
    for (int j = 0; j < 2; j++) {
        l[j] = load_text(text[j]);
        CHECK(l[j].system && kempe_modes_new(l[j].system, NULL, &modes[j]) == KEMPE_OK);
        CHECK(l[j].system && kempe_response_new(l[j].system, &options, &response[j]) == KEMPE_OK);
        CHECK(modes[j] && kempe_modes_table(modes[j], "modes", &rows[j]) == KEMPE_OK);
        CHECK(response[j] && kempe_response_table(response[j], "rows", &frequencies[j]) == KEMPE_OK);
    }
    compare(rows[0], rows[1]);
    compare(frequencies[0], frequencies[1]);
    for (int j = 0; j < 2; j++) {
        kempe_table_free(rows[j]);
        kempe_table_free(frequencies[j]);
        kempe_modes_free(modes[j]);
        kempe_response_free(response[j]);
        unload(&l[j]);
    }
}

/* Beside states with a rate, beside samples, a relay with hysteresis, and alone. */
static void as_a_number(void)
{
    static const char *const models[][2] = {
        {DAMPER(EVENT, "D", ""), DAMPER("", "y0", "")},
        {DAMPER("D: {start: y0, hysteresis: q(x), limits: [0.01, 0.5], values: [2, 3]}, ", "D", ""),
         DAMPER("", "y0", "")},
        {DAMPER(EVENT, "D", ", s: {sample: 0.1, next: q(x)}"), DAMPER("", "y0", ", s: {sample: 0.1, next: q(x)}")}};
    for (size_t i = 0; i < sizeof models / sizeof *models; i++)
        compare_models(models[i]);
}

/* x'' + 16 x = D/2: the eigenvalues are exactly on the axis, as without the state. */
static void conservative(void)
{
    loaded l = load_text("kempe: 1\nstates: {D: {start: 1, when: q(x) > 0.5, next: 2}}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {f: {joint: x, force: D - 32*q(x)}}\n");
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
    CHECK(table && kempe_table_row_count(table) == 2 && kempe_modes_zero_count(modes) == 0);
    CHECK(cell(table, 0, "re") == 0 && cell(table, 1, "re") == 0);
    CHECK_NEAR(cell(table, 0, "im"), 4, 1e-14);
    CHECK(cell(table, 0, "re.D") == 0 && cell(table, 0, "im.D") == 0);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* s = -D/8 + i sqrt(k/2 - (D/8)^2) with D = y0: derivatives of a mode by the start value of the state. */
static void sensitivity(void)
{
    loaded l = load_text(DAMPER(EVENT, "D", ""));
    const kempe_sensitivity_options options = {.of = "modes", .parameters = "y0,k"};
    kempe_sensitivity *s = NULL;
    kempe_table *table = NULL;
    CHECK(l.model && kempe_sensitivity_new(l.model, &options, &s) == KEMPE_OK);
    CHECK(s && kempe_sensitivity_table(s, "rows", &table) == KEMPE_OK);
    const double D = 3, im = sqrt(20 - D * D / 64);
    CHECK_NEAR(cell(table, 0, "mode.1.re"), -D / 8, 1e-13);
    CHECK_NEAR(cell(table, 0, "mode.1.im"), im, 1e-13);
    CHECK_NEAR(cell(table, 0, "mode.1.re/y0"), -1 / 8.0, 1e-13);
    CHECK_NEAR(cell(table, 0, "mode.1.im/y0"), -D / 64 / im, 1e-13);
    CHECK_NEAR(cell(table, 0, "mode.1.im/k"), 0.25 / im, 1e-13);
    kempe_table_free(table);
    kempe_sensitivity_free(s);
    unload(&l);
}

/* The upper limit of hysteresis is at k = 15, where x = 3/k = 0.2: a sweep ends at that value, or before the one at
 * which the state is another one. */
static void sweep(void)
{
    static const struct {
        const char *sweep, *reason;
        int rows;
    } cases[] = {{"k=40:10:7", "the state 'D' switches exactly at this point", 5},
                 {"k=40:10:4", "'D' begins with 3, but its input requires 4 there", 3}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        loaded l = load_text(DAMPER("D: {start: 3, hysteresis: q(x), limits: [0.01, 0.2], values: [3, 4]}, ", "D", ""));
        const kempe_modes_options options = {.sweep = cases[i].sweep};
        kempe_modes *modes = NULL;
        kempe_table *rows = NULL;
        char *text = NULL;
        CHECK(l.system && kempe_modes_new(l.system, &options, &modes) == KEMPE_STOPPED);
        CHECK(modes && kempe_modes_table(modes, "rows", &rows) == KEMPE_OK);
        CHECK(rows && kempe_table_row_count(rows) == cases[i].rows && cell(rows, cases[i].rows - 1, "k") == 20);
        CHECK(modes && kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK);
        CHECK(text && strstr(text, "Held: D = 3: this state changes at events, and is constant in small motions"));
        CHECK(text && strstr(text, cases[i].reason));
        kempe_text_free(text);
        kempe_table_free(rows);
        kempe_modes_free(modes);
        unload(&l);
    }
}

/* All coordinates of small motions are held: there are no modes. */
static void nothing_moves(void)
{
    loaded l = load_text("kempe: 1\nstates: {D: {start: 1, when: q(x) > 0.5, next: 2}}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "drives: {d: {joint: x, locked: yes}}\n");
    kempe_modes *modes = NULL;
    char *text = NULL;
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "no modes") && strstr(text, "Held: D = 1"));
    kempe_text_free(text);
    kempe_modes_free(modes);
    unload(&l);
}

int main(void)
{
    TEST(state_space);
    TEST(as_a_number);
    TEST(conservative);
    TEST(sensitivity);
    TEST(sweep);
    TEST(nothing_moves);
    return check_report();
}
