/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of the model language: from lists and from a CSV file, as numbers and in equations. */
#include "derived.h"
#include "model/model.h"
#include "symbolic/table_function.h"
#include "testing.h"

static kempe_context *context;

static const char head[] =
    "kempe: 1\nparameters: {half: 0.5}\ntables:\n"
    "  cube: {csv: lift.csv, x: angle, y: lift}\n"
    "  speed: {csv: lift.csv, x: angle, y: speed, method: linear}\n"
    "  line: {x: [0, half, 100 cm], y: [0, 1, 4], method: linear}\n"
    "bodies: {a: {joint: {prismatic: x, at: ground}, mass: line(0.75), com: [cube(1.5), 0, 0]}}\n";

static kempe_model *read_with(const char *rest)
{
    char text[2048];
    kempe_model *model = NULL;
    (void)snprintf(text, sizeof text, "%s%s", head, rest);
    if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/label.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

static void constants(void)
{
    kempe_model *m = read_with("");
    if (!m)
        return;
    CHECK_NEAR(m->bodies[1].mass.value, 2.5, 1e-15);
    CHECK_NEAR(m->bodies[1].com[0].value, 3.375, 1e-14); /* the spline of a cubic is that cubic */
    CHECK(m->table_count == 3 && m->tables[1].table->count == 4 && m->tables[1].table->y[2] == -3);
    char *text = NULL;
    CHECK(kempe_model_print(m, KEMPE_TEXT, &text) == KEMPE_OK &&
          strstr(text, "  cube: spline, 4 points, x from 0 to 2\n") != NULL);
    kempe_text_free(text);
    CHECK(kempe_model_print(m, KEMPE_JSON, &text) == KEMPE_OK && strstr(text, "\"y\": [0, 1, 4]") != NULL);
    kempe_text_free(text);
    kempe_model_free(m);
}

/* In a force and in a drive: value, and through h_t and gamma its first two derivatives. */
static void equations(void)
{
    derived d;
    kempe_model *m =
        read_with("forces: {f: {joint: a, force: \"cube(q(a))\"}}\ndrives: {m: {joint: a, displacement: cube(t)}}\n");
    if (!m)
        return;
    CHECK(derived_init(&d, m, KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD, KMP_SCHEME_COMPOSITE, false));
    state s = {.t = 1.25, .q = {0.75}, .qd = {2}};
    derived_eval(&d, &s);
    CHECK_NEAR(d.bias[0], -0.75 * 0.75 * 0.75, 1e-14);
    CHECK_NEAR(d.h[0], 0.75 - 1.25 * 1.25 * 1.25, 1e-14);
    CHECK_NEAR(d.h_t[0], -3 * 1.25 * 1.25, 1e-13);
    CHECK_NEAR(d.jdqd[0], -6 * 1.25, 1e-12);
    derived_free(&d);
    kempe_model_free(m);
}

static void bad_sheets(void)
{
    static const char text[] = "kempe: 1\ntables: {b: {csv: bad.csv, x: x, y: y}, f: {csv: flat.csv, x: x, y: y}}\n"
                               "bodies: {a: {joint: {revolute: z, at: ground}}}\n";
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/malformed/label", &m) == KEMPE_E_INPUT && !m);
    const char *said = kempe_context_message(context);
    CHECK(strstr(said, "/bad.csv:3:3: a number is expected here, not 'two'\n") != NULL);
    CHECK(strstr(said, "/bad.csv:4:1: column 2 is missing in this line\n") != NULL);
    CHECK(strstr(said, "/flat.csv:4:1: table 'f': x must increase: 1 comes after 1") != NULL);
}

int main(void)
{
    context = kempe_context_new();
    TEST(constants);
    TEST(equations);
    TEST(bad_sheets);
    kempe_context_free(context);
    return check_report();
}
