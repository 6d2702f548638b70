/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* Tracks: rails as the model has them, and where a cross-section is. */
#include "model/data/model.h"
#include "sections.h"

static kempe_context *context;

static kempe_model *read_text(const char *text)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/track.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

/* -- rails --------------------------------------------------------------------------------------- */

static const double head_radius = 0.05;

/* A round rail head, the middle of its top at the origin, from y = -40 mm to 40 mm. */
static void put_round(kmp_text *text, int count, bool descending)
{
    for (int list = 0; list < 2; list++) {
        kmp_text_put(text, list ? "], z: [" : "y: [");
        for (int i = 0; i < count; i++) {
            int k = descending ? count - 1 - i : i;
            double y = 0.04 * (2.0 * k / (count - 1) - 1);
            kmp_text_put(text, i > 0 ? ", " : "");
            kmp_text_number(text, list ? sqrt(head_radius * head_radius - y * y) - head_radius : y);
        }
    }
    kmp_text_put(text, "]");
}

static kempe_model *read_rails(const char *tracks)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nprofiles:\n  up: {");
    put_round(&text, 401, false);
    kmp_text_put(&text, "}\n  down: {");
    put_round(&text, 401, true);
    kmp_text_printf(&text, "}\n  sheet: {csv: rail.csv, y: y, z: z, unit: mm}\n%s", tracks);
    kmp_text_put(&text, "ground: {points: {O: {at: [1, 2, 3], axes: {x: y, z: [0.6, 0, 0.8]}}}}\n"
                        "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n");
    kempe_model *model = text.failed ? NULL : read_text(text.s);
    kmp_text_free(&text);
    return model;
}

/* A rail head that is a circle stays one when it is turned: its middle, and so its height, are known. */
static void round_rail(void)
{
    kempe_model *m = read_rails("tracks:\n  line: {at: ground.O, rail: up, gauge: 1435 mm, inclination: 1/20}\n"
                                "  same: {at: ground.O, rail: down, gauge: 1435 mm, inclination: 1/20}\n"
                                "  deep: {at: ground.O, rail: down, gauge: 1, gauge_depth: 10 mm}\n");
    if (!m)
        return;
    const double depth[3] = {0.014, 0.014, 0.01}, slope[3] = {0.05, 0.05, 0}, gauge[3] = {1.435, 1.435, 1};
    for (int k = 0; k < 3; k++) {
        const kmp_track *t = &m->tracks[k];
        double middle = gauge[k] / 2 + sqrt(2 * head_radius * depth[k] - depth[k] * depth[k]), worst = 0;
        CHECK_NEAR(t->rail_at, middle - head_radius * slope[k] / sqrt(1 + slope[k] * slope[k]), 1e-10);
        for (double y = -0.035; y < 0.035; y += 0.00037) {
            double z = kmp_table_value(t->rail, 0, middle + y);
            worst = check_max(worst, fabs(z - (sqrt(head_radius * head_radius - y * y) - head_radius)));
        }
        CHECK(worst < 1e-10);
        CHECK_NEAR(kmp_table_value(t->rail, 0, gauge[k] / 2), -depth[k], 1e-13);
    }
    CHECK(kmp_table_equal(m->profiles[0].height, m->profiles[1].height));
    CHECK(m->profiles[2].height->count == 7 && m->profiles[2].height->y[1] == -0.009);
    kempe_model_free(m);
}

/* Half an ellipse but for half a degree at its ends: of slopes 32 between the last points, 16 before. */
static void put_ellipse(kmp_text *text)
{
    const double degree = acos(-1) / 180;
    for (int list = 0; list < 2; list++) {
        kmp_text_put(text, list ? "], z: [" : "y: [");
        for (int k = 0; k < 180; k++) {
            double angle = (k - 89.5) * degree;
            kmp_text_put(text, k > 0 ? ", " : "");
            kmp_text_number(text, list ? 0.02 * (cos(angle) - 1) : 0.036 * sin(angle));
        }
    }
    kmp_text_put(text, "]");
}

/* Overhanging parts of a turned rail are left out, on the inner side; without them nothing is. */
static void overhanging(void)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nprofiles: {arch: {");
    put_ellipse(&text);
    kmp_text_put(&text,
                 "}}\ntracks:\n  even: {at: ground.O, rail: arch, gauge: 1.4}\n"
                 "  leaning: {at: ground.O, rail: arch, gauge: 1.4, inclination: 1/20}\n"
                 "ground: {points: {O: [0, 0, 0]}}\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n");
    kempe_model *m = text.failed ? NULL : read_text(text.s);
    kmp_text_free(&text);
    if (!m)
        return;
    const kmp_table *even = m->tracks[0].rail, *leaning = m->tracks[1].rail;
    CHECK(even->count == 180 && leaning->count == 179);
    const kmp_table *arch = m->profiles[0].height;
    CHECK_NEAR(leaning->x[0] - m->tracks[1].rail_at, (arch->x[1] - 0.05 * arch->y[1]) / hypot(1, 0.05), 1e-14);
    kempe_model_free(m);
}

/* Columns in a unit that makes them infinite: what is wrong is said where it stands. */
static void large_sheet(void)
{
    kempe_model *m = NULL;
    const char *text = "kempe: 1\nprofiles: {a: {csv: large.csv, y: y, z: z, unit: km}}\n"
                       "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n";
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/track.yaml", &m) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "/large.csv:4:1: profile 'a': (inf, 0) m is not finite") != NULL);
    kempe_model_free(m);
}

/* -- places -------------------------------------------------------------------------------------- */

static void straight(void)
{
    kempe_model *m = read_rails("tracks:\n  line: {at: ground.O, rail: up, gauge: 1435 mm}\n");
    if (!m)
        return;
    section s;
    const double p[3] = {4, 7, 1}, z[3] = {0.6, 0, 0.8}, left[3] = {-0.8, 0, 0.6};
    if (!section_init(&s, m, &m->tracks[0]))
        return;
    section_at(&s, p);
    const double *v = s.value;
    CHECK_NEAR(v[0], 5, 1e-15);
    const double origin[3] = {1, 7, 3};
    for (int k = 0; k < 3; k++) {
        CHECK_NEAR(v[1 + k], origin[k], 1e-15);
        CHECK_NEAR(v[4 + k], k == 1, 1e-15);
        CHECK_NEAR(v[7 + k], left[k], 1e-15);
        CHECK_NEAR(v[10 + k], z[k], 1e-15);
    }
    for (int k = 13; k < 17; k++)
        CHECK(v[k] == 0);
    section_free(&s);
    kempe_model_free(m);
}

/* -- what is printed ----------------------------------------------------------------------------- */

static void printed(void)
{
    kempe_model *m = read_rails("tracks:\n  line: {at: ground.O, rail: sheet, gauge: 1435 mm, inclination: 1/40}\n"
                                "  bent: {at: ground.O, rail: sheet, gauge: 1, course: [{straight: 5}, {transition: 3},"
                                " {right: 5, radius: 9, cant: 0.1}, {transition: 1}]}\n");
    char *text = NULL;
    if (!m)
        return;
    CHECK(kempe_model_print(m, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(strstr(text, "  sheet: 7 points, y from -0.036 to 0.036\n") != NULL);
    CHECK(strstr(text, "  line: at ground.O, rail sheet, gauge 1.435 at 0.014 below the top, inclination 0.025\n"));
    kempe_text_free(text);
    CHECK(kempe_model_print(m, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(strstr(text,
                 "\"sheet\": {\"y\": [-0.036, -0.03, -0.02, 0, 0.02, 0.03, 0.036], \"z\": [-0.028, -0.009, -0.001, 0, "
                 "-0.001, -0.009, -0.028]}"));
    CHECK(strstr(text,
                 "\"line\": {\"at\": \"ground.O\", \"rail\": \"sheet\", \"gauge\": 1.435, \"gauge_depth\": 0.014, "
                 "\"inclination\": 0.025}"));
    kempe_text_free(text);
    kempe_model_free(m);
}

int main(void)
{
    context = kempe_context_new();
    TEST(round_rail);
    TEST(overhanging);
    TEST(large_sheet);
    TEST(straight);
    TEST(printed);
    kempe_context_free(context);
    return check_report();
}
