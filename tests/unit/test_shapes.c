/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass properties of shapes: against point masses with the moments of the solid, turned and moved by the test itself;
 * holes; a motion against one with typed numbers. */
#include "loaded.h"
#include "model/data/model.h"
#include <kempe/check.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

typedef struct properties {
    double mass, com[3], inertia[6]; /* about the com */
} properties;

static properties of_model(const kempe_model *model, int body)
{
    const kmp_body *b = &model->bodies[body];
    properties p = {.mass = b->mass.value};
    for (int k = 0; k < 3; k++)
        p.com[k] = b->com[k].value;
    for (int k = 0; k < 6; k++)
        p.inertia[k] = b->inertia[k].value;
    return p;
}

/* -- clouds of point masses -------------------------------------------------------------------------- */

enum { MOST = 20000 };

typedef struct cloud {
    int count;
    double mass[MOST], at[MOST][3];
} cloud;

static cloud points;

static void put(double mass, double x, double y, double z)
{
    points.mass[points.count] = mass;
    points.at[points.count][0] = x;
    points.at[points.count][1] = y;
    points.at[points.count++][2] = z;
}

/* A cuboid has the moments of the eight points of Gauss's rule. */
static void put_box(double mass, double a, double b, double c)
{
    double s = sqrt(1.0 / 12);
    for (int k = 0; k < 8; k++)
        put(mass / 8, (k & 1 ? s : -s) * a, (k & 2 ? s : -s) * b, (k & 4 ? s : -s) * c);
}

/* An ellipsoid has those of six points at sqrt(3/5) of its radii. */
static void put_ellipsoid(double mass, const double r[3])
{
    for (int k = 0; k < 6; k++) {
        double at[3] = {0};
        at[k / 2] = (k % 2 ? 1 : -1) * sqrt(0.6) * r[k / 2];
        put(mass / 6, at[0], at[1], at[2]);
    }
}

static void put_ball(double mass, double r)
{
    put_ellipsoid(mass, (const double[3]){r, r, r});
}

/* A disc has those of four points at r / sqrt(2); z: its height, of a slice. */
static void put_disc(double mass, double r, double z)
{
    for (int k = 0; k < 4; k++)
        put(mass / 4, (k < 2 ? (k ? 1 : -1) * r * sqrt(0.5) : 0), (k >= 2 ? (k == 3 ? 1 : -1) * r * sqrt(0.5) : 0), z);
}

static void put_cylinder(double mass, double r, double length)
{
    for (int k = 0; k < 2; k++)
        put_disc(mass / 2, r, (k ? 1 : -1) * length * sqrt(1.0 / 12));
}

/* Slices along the axis of a capsule by the midpoint rule, with an error of 1e-7. */
static void put_capsule(double density, double r, double length)
{
    int slices = MOST / 8;
    double high = length + 2 * r, step = high / slices;
    for (int k = 0; k < slices; k++) {
        double z = (k + 0.5) * step - high / 2, over = fmax(fabs(z) - length / 2, 0), wide = sqrt(r * r - over * over);
        put_disc(density * pi * wide * wide * step, wide, z);
    }
}

/* Turns the points from `from` on by columns x, y, z, and moves them. */
static void move(int from, double m[3][3], const double to[3])
{
    for (int k = from; k < points.count; k++) {
        double v[3];
        memcpy(v, points.at[k], sizeof v);
        for (int i = 0; i < 3; i++)
            points.at[k][i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2] + to[i];
    }
}

static properties of_cloud(void)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    properties p = {.mass = 0};
    for (int k = 0; k < points.count; k++) {
        p.mass += points.mass[k];
        for (int i = 0; i < 3; i++)
            p.com[i] += points.mass[k] * points.at[k][i];
    }
    for (int i = 0; i < 3; i++)
        p.com[i] /= p.mass;
    for (int k = 0; k < points.count; k++) {
        double d[3], square = 0;
        for (int i = 0; i < 3; i++) {
            d[i] = points.at[k][i] - p.com[i];
            square += d[i] * d[i];
        }
        for (int i = 0; i < 6; i++)
            p.inertia[i] += points.mass[k] * ((i < 3 ? square : 0) - d[row[i]] * d[column[i]]);
    }
    return p;
}

static void compare(const properties *a, const properties *b, double tolerance)
{
    double size = fmax(b->inertia[0], fmax(b->inertia[1], b->inertia[2]));
    CHECK_NEAR(a->mass / b->mass, 1, tolerance);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(a->com[k], b->com[k], tolerance);
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(a->inertia[k] / size, b->inertia[k] / size, tolerance);
}

/* -- single shapes ----------------------------------------------------------------------------------- */

static loaded with_shape(const char *points_text, const char *shape)
{
    char text[2048];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\nparameters: {rho: 7850, l: 0.4}\nbodies:\n  a: {joint: {free: z, at: ground}, points: {%s}, "
        "shape: %s}\n",
        points_text, shape);
    return load_text(text);
}

/* The shape against the cloud, which is then emptied. */
static void expect(const char *points_text, const char *shape, double tolerance)
{
    int before = check_failures;
    loaded l = with_shape(points_text, shape);
    if (l.model) {
        properties is = of_model(l.model, 1), wanted = of_cloud();
        compare(&is, &wanted, tolerance);
    }
    if (check_failures > before)
        printf("  shape %s\n", shape);
    unload(&l);
    points.count = 0;
}

static double level[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static double upright_x[3][3] = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}; /* z becomes x */
/* Columns (1, 2, 2)/3, (-2, -1, 2)/3 and (2, -2, 1)/3. */
static double skew[3][3] = {{1.0 / 3, -2.0 / 3, 2.0 / 3}, {2.0 / 3, -1.0 / 3, -2.0 / 3}, {2.0 / 3, 2.0 / 3, 1.0 / 3}};

static void test_single(void)
{
    const double there[3] = {0.2, -0.1, 0.3};
    double v = 7850;
    put_box(v * 0.4 * 0.1 * 0.05, 0.4, 0.1, 0.05);
    expect("", "{box: [l, 0.1 m, 50 mm], density: rho}", 1e-15);
    put_box(3, 0.4, 0.1, 0.05);
    move(0, skew, there);
    expect("", "{box: [0.4, 0.1, 0.05], mass: 3, at: [0.2, -0.1, 0.3], axes: {x: [1, 2, 2], y: [-2, -1, 2]}}", 1e-14);
    put_box(3, 0.4, 0.1, 0.05);
    move(0, skew, there);
    expect("P: {at: [0.2, -0.1, 0.3], axes: {x: [1, 2, 2], y: [-2, -1, 2]}}", "{box: [0.4, 0.1, 0.05], mass: 3, at: P}",
           1e-14);
    put_ball(v * 4 / 3 * pi * 0.001, 0.1);
    move(0, level, there);
    expect("", "{sphere: 10 cm, density: rho, at: [0.2, -0.1, 0.3]}", 1e-14);
    put_ellipsoid(v * 4 / 3 * pi * 0.1 * 0.2 * 0.05, (const double[3]){0.1, 0.2, 0.05});
    move(0, skew, there);
    expect("",
           "{ellipsoid: [0.1, l/2, 0.05], density: rho, at: [0.2, -0.1, 0.3], axes: {x: [1, 2, 2], y: [-2, -1, 2]}}",
           1e-14);
}

static void test_round(void)
{
    const double there[3] = {0.2, -0.1, 0.3}, origin[3] = {0};
    double v = 7850, area = pi * 0.02 * 0.02;
    put_cylinder(v * area * 0.4, 0.02, 0.4);
    expect("", "{cylinder: l, radius: 20 mm, density: rho}", 1e-14);
    put_cylinder(v * area * 0.4, 0.02, 0.4);
    move(0, upright_x, there);
    expect("", "{cylinder: l, radius: 20 mm, axis: x, at: [0.2, -0.1, 0.3], density: rho}", 1e-14);
    put_cylinder(v * area * 0.3, 0.02, 0.3);
    move(0, skew, there); /* half of 0.3 along (2, -2, 1)/3 on either side of the centre */
    expect("P: [0.1, 0, 0.25], Q: [0.3, -0.2, 0.35]", "{cylinder: [P, Q], radius: 20 mm, density: rho}", 1e-14);
    put_capsule(v, 0.02, 0.3);
    move(0, skew, there);
    expect("P: [0.1, 0, 0.25]", "{capsule: [P, [0.3, -0.2, 0.35]], radius: 20 mm, density: rho}", 2e-6);
    put_capsule(v, 0.05, 0.02);
    move(0, skew, origin);
    expect("", "{capsule: 2 cm, radius: 50 mm, axis: [2, -2, 1], density: rho}", 2e-6);
}

/* A capsule is a cylinder and two hemispheres; of a mass, in the parts of their volumes. */
static void test_capsule_closed(void)
{
    double r = 0.05, l = 0.3, rod = pi * r * r * l, ball = 4 * pi / 3 * r * r * r, m = 2 / (rod + ball);
    loaded a = with_shape("", "{capsule: 0.3, radius: 0.05, mass: 2}");
    if (a.model) {
        properties p = of_model(a.model, 1);
        double across = rod * (r * r / 4 + l * l / 12) + ball * (0.4 * r * r + l * l / 4 + 3 * l * r / 8);
        CHECK(p.mass == 2);
        CHECK_NEAR(p.inertia[0] / (m * across), 1, 1e-15);
        CHECK(p.inertia[1] == p.inertia[0] && p.inertia[3] == 0 && p.inertia[4] == 0 && p.inertia[5] == 0);
        CHECK_NEAR(p.inertia[2] / (m * r * r * (rod / 2 + 0.4 * ball)), 1, 1e-15);
    }
    unload(&a);
}

/* -- several shapes ---------------------------------------------------------------------------------- */

static void test_composite(void)
{
    const double there[3] = {50.2, -0.1, 0.3}, other[3] = {50, 0.2, 0}, third[3] = {50.01, 0.2, 0};
    int from = 0;
    put_box(2, 0.4, 0.1, 0.05);
    move(from, skew, there);
    from = points.count;
    put_ball(1.5, 0.1);
    move(from, level, other);
    from = points.count;
    put_cylinder(-0.5, 0.02, 0.1);
    move(from, upright_x, third);
    expect("",
           "[{box: [0.4, 0.1, 0.05], mass: 2, at: [50.2, -0.1, 0.3], axes: {x: [1, 2, 2], y: [-2, -1, 2]}}, "
           "{sphere: 0.1, mass: 1.5, at: [50, 0.2, 0]}, {sphere: 9, colour: red}, "
           "{cylinder: 0.1, radius: 0.02, axis: x, mass: 0.5, at: [50.01, 0.2, 0], hole: yes}]",
           1e-13);
}

/* A tube: its closed form. */
static void test_tube(void)
{
    double outer = 0.05, inner = 0.04, l = 0.3, density = 2700, m = density * pi * l * (outer * outer - inner * inner);
    loaded a = with_shape("", "[{cylinder: 0.3, radius: 0.05, density: 2700}, "
                              "{cylinder: 0.3, radius: 0.04, density: 2700, hole: yes}]");
    if (a.model) {
        properties p = of_model(a.model, 1);
        CHECK_NEAR(p.mass / m, 1, 1e-14);
        CHECK_NEAR(p.inertia[2] / (m * (outer * outer + inner * inner) / 2), 1, 1e-14);
        CHECK_NEAR(p.inertia[0] / (m * (3 * (outer * outer + inner * inner) + l * l) / 12), 1, 1e-14);
    }
    unload(&a);
}

/* A line is thin rods, each with the moments of two points. */
static void test_line(void)
{
    const double corner[4][3] = {{0, 0, 0}, {0.3, 0, 0}, {0.3, 0.4, 0}, {0.3, 0.4, 0.5}}, length[3] = {0.3, 0.4, 0.5};
    for (int k = 0; k < 3; k++)
        for (int side = 0; side < 2; side++) {
            double s = 0.5 + (side ? 1 : -1) * sqrt(1.0 / 12), at[3];
            for (int i = 0; i < 3; i++)
                at[i] = (1 - s) * corner[k][i] + s * corner[k + 1][i];
            put(2.4 / 1.2 * length[k] / 2, at[0], at[1], at[2]);
        }
    expect("P: [0.3, 0, 0]", "{line: [[0, 0, 0], P, [0.3, 0.4, 0], [0.3, 0.4, 0.5]], mass: 2.4}", 1e-14);
}

/* -- motion ------------------------------------------------------------------------------------------ */

static const char two_links[] = "kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                                "  a: {joint: {name: A, universal: [y, z], at: ground}, points: {E: [0.4, 0, 0]}, %s}\n"
                                "  b: {joint: {name: B, revolute: y, at: a.E}, %s}\nstart: {q: {A.1: 0.2, B: 1}, qd: "
                                "{A.2: 3}}\nrun: {t_end: 0.5}\n";

static void last_row(const char *a, const char *b, double q[3])
{
    char text[4096];
    (void)snprintf(text, sizeof text, two_links, a, b);
    loaded l = load_text(text);
    kempe_trajectory *t = NULL;
    CHECK(l.system && kempe_simulate(l.system, NULL, &t) == KEMPE_OK);
    if (t)
        memcpy(q, kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1), 3 * sizeof *q);
    kempe_trajectory_free(t);
    unload(&l);
}

static void typed(const properties *p, char *text, size_t size)
{
    (void)snprintf(text, size,
                   "mass: %.17g, com: [%.17g, %.17g, %.17g], inertia: {xx: %.17g, yy: %.17g, zz: %.17g, xy: %.17g, xz: "
                   "%.17g, yz: %.17g}",
                   p->mass, p->com[0], p->com[1], p->com[2], p->inertia[0], p->inertia[1], p->inertia[2], p->inertia[3],
                   p->inertia[4], p->inertia[5]);
}

/* The numbers are the same, and so is every bit of the motion. */
static void test_motion(void)
{
    static const char first[] = "shape: {box: [0.4, 0.1, 0.05], at: [0.2, 0, 0], axes: {x: [1, 2, 2]}, density: 7850}";
    static const char second[] = "shape: [{capsule: [[0, 0, 0], [0.3, 0.1, 0]], radius: 0.02, density: 2700}, "
                                 "{sphere: 0.05, at: [0.3, 0.1, 0], mass: 1}]";
    char text[4096], a[1024], b[1024];
    double shaped[3] = {0}, given[3] = {1, 1, 1};
    (void)snprintf(text, sizeof text, two_links, first, second);
    loaded l = load_text(text);
    if (l.model) {
        properties p = of_model(l.model, 1), q = of_model(l.model, 2);
        typed(&p, a, sizeof a);
        typed(&q, b, sizeof b);
        last_row(first, second, shaped);
        last_row(a, b, given);
        CHECK(memcmp(shaped, given, sizeof given) == 0);
    }
    unload(&l);
}

/* -- pictures alone ---------------------------------------------------------------------------------- */

static void test_without_mass(void)
{
    loaded l =
        load_text("kempe: 1\nground: {points: {O: [1, 0, 0]}, shape: [{box: [1, 1, 0.1], at: O}, {sphere: 0.1}]}\n"
                  "bodies: {a: {joint: {revolute: z, at: ground}, mass: 2, inertia: {zz: 3}, shape: {sphere: 1, "
                  "colour: '#0A1b2c', opacity: 0.5}}}\n");
    if (l.model) {
        const kmp_shape *s = l.model->shapes;
        properties p = of_model(l.model, 1);
        CHECK(l.model->shape_count == 3 && p.mass == 2 && p.inertia[2] == 3 && !l.model->bodies[1].by_shape);
        CHECK(s[0].body == 1 && s[0].colour == 0x0a1b2c && s[0].opacity == 0.5);
        CHECK(s[1].body == 0 && s[1].at[0].value == 1 && s[1].colour == -1 && s[2].at[0].value == 0);
    }
    unload(&l);
}

/* The shapes of an included ground move with the body that it is put on; they change nothing of its mass. */
static void test_included(void)
{
    loaded l = load_text_as("kempe: 1\ninclude: [{file: shapes.yaml, prefix: p_, at: base, offset: [1, 2, 3]}]\n"
                            "bodies: {base: {joint: {prismatic: z, at: ground}, mass: 2}}\n",
                            KEMPE_ROOT "/tests/models/including.yaml");
    int found = 0;
    for (int k = 0; l.model && k < l.model->shape_count; k++) {
        const kmp_shape *s = &l.model->shapes[k];
        if (s->body != kmp_name_find(KMP_BODY_NAMES(l.model), "base"))
            continue;
        found++;
        CHECK(s->at[0].value == 1 && s->at[1].value == 2 && !s->heavy);
        CHECK_NEAR(s->at[2].value, s->kind == KMP_SHAPE_BOX ? 2.2 : 3, 1e-15);
    }
    CHECK(found == 2);
    CHECK(l.model && l.model->bodies[1].mass.value == 2);
    unload(&l);
}

/* -- what is printed --------------------------------------------------------------------------------- */

static void expect_text(kempe_status status, char **given, const char *part)
{
    char *text = *given;
    CHECK(status == KEMPE_OK && text);
    if (text && !check_says(text, part))
        CHECK_TEXT(text, part);
    kempe_text_free(text);
}

static void test_printed(void)
{
    loaded l = with_shape("P: [0, 0, 1]", "[{sphere: 0.5, at: P, mass: 2}, {box: [1, 1, 1], colour: '#010203'}]");
    kempe_check *check = NULL;
    char *text = NULL;
    if (l.system && kempe_check_new(l.system, &check) == KEMPE_OK) {
        expect_text(kempe_check_print(check, KEMPE_TEXT, &text), &text,
                    "mass by shapes       a: 2 kg, centre [0, 0, 1] m, inertia xx 0.2 yy 0.2 zz 0.2 kg m^2\n");
        expect_text(kempe_check_print(check, KEMPE_JSON, &text), &text,
                    "\"mass_by_shapes\": [\n    {\n      \"body\": \"a\"");
        expect_text(kempe_model_print(l.model, KEMPE_TEXT, &text), &text,
                    "    shape sphere: radius 0.5, at [0, 0, 1], mass 2\n    shape box: size [1, 1, 1], at [0, 0, 0], "
                    "colour #010203\n");
        expect_text(kempe_model_print(l.model, KEMPE_JSON, &text), &text,
                    "{\"body\": \"a\", \"kind\": \"sphere\", \"radius\": 0.5, \"at\": [0, 0, 1], \"mass\": 2}");
    }
    kempe_check_free(check);
    unload(&l);
}

int main(void)
{
    TEST(test_single);
    TEST(test_round);
    TEST(test_capsule_closed);
    TEST(test_composite);
    TEST(test_tube);
    TEST(test_line);
    TEST(test_motion);
    TEST(test_without_mass);
    TEST(test_included);
    TEST(test_printed);
    return check_report();
}
