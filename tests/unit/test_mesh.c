/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes: the same block in three formats, fine surfaces against the closed forms of shapes, meshes that are thinned.
 */
#include "loaded.h"
#include "model/data/body.h"
#include "model/data/mesh.h"
#include "picture/motion_picture.h"
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

/* -- in models --------------------------------------------------------------------------------------- */

/* Mass, centre and inertia of the body of a model with this shape. */
static void properties(const char *shape, double p[10])
{
    char text[1024];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\nparameters: {rho: 7850, mm: 1 mm}\nbodies:\n  a: {joint: {revolute: z, at: ground}, shape: %s}\n",
        shape);
    loaded l = load_text_as(text, KEMPE_ROOT "/tests/models/mesh.yaml");
    if (l.model) {
        const kmp_body *b = kmp_model_body(l.model, 1);
        p[0] = b->mass.value;
        for (int k = 0; k < 3; k++)
            p[1 + k] = b->com[k].value;
        for (int k = 0; k < 6; k++)
            p[4 + k] = b->inertia[k].value;
    }
    unload(&l);
}

static void compare(const double a[10], const double b[10], double tolerance)
{
    double scale[10] = {b[0], 1, 1, 1}, size = check_max(b[4], check_max(b[5], b[6]));
    for (int k = 0; k < 10; k++)
        CHECK_NEAR(a[k] / (k > 3 ? size : scale[k]), b[k] / (k > 3 ? size : scale[k]), tolerance);
}

/* A mesh has the masses of the box, in each format, placed, turned, scaled and as a hole. */
static void formats(void)
{
    static const char *const files[] = {"block.obj", "block.stl", "block_binary.stl"};
    double mesh[10] = {0}, box[10] = {1};
    char shape[512];
    for (int k = 0; k < 3; k++) {
        (void)snprintf(shape, sizeof shape, "{mesh: %s, scale: mm, density: rho}", files[k]);
        properties(shape, mesh);
        properties("{box: [0.4, 0.1, 0.05], at: [0.2, 0.05, 0.025], density: rho}", box);
        compare(mesh, box, 1e-14);
        (void)snprintf(
            shape, sizeof shape,
            "[{mesh: %s, scale: 2*mm, at: [1, 2, 3], axes: {x: [1, 2, 2], y: [-2, -1, 2]}, mass: 3}, {mesh: %s, "
            "scale: 1 mm, at: [1.1, 2.1, 3.1], axes: {x: [1, 2, 2], y: [-2, -1, 2]}, mass: 0.1, hole: yes}]",
            files[k], files[k]);
        properties(shape, mesh);
        /* the centre of a block is R (0.2, 0.05, 0.025), with columns (1, 2, 2)/3, (-2, -1, 2)/3, (2, -2, 1)/3 */
        properties(
            "[{box: [0.8, 0.2, 0.1], at: [1 + 0.3/3, 2 + 0.6/3, 3 + 1.05/3], axes: {x: [1, 2, 2], y: [-2, -1, 2]}, "
            "mass: 3}, {box: [0.4, 0.1, 0.05], at: [1.1 + 0.15/3, 2.1 + 0.3/3, 3.1 + 0.525/3], axes: {x: [1, 2, 2], "
            "y: [-2, -1, 2]}, mass: 0.1, hole: yes}]",
            box);
        compare(mesh, box, 1e-13);
    }
}

/* -- surfaces of revolution -------------------------------------------------------------------------- */

enum { SIDES = 240, MOST_RINGS = 400 };

typedef struct surface {
    kmp_mesh mesh;
    double vertex[SIDES * MOST_RINGS + 2][3];
    int triangle[2 * SIDES * MOST_RINGS][3];
} surface;

static surface made;

static int add_vertex(double x, double y, double z)
{
    double *v = made.vertex[made.mesh.vertex_count];
    v[0] = x, v[1] = y, v[2] = z;
    return made.mesh.vertex_count++;
}

static void add_triangle(int a, int b, int c)
{
    int *t = made.triangle[made.mesh.triangle_count++];
    t[0] = a, t[1] = b, t[2] = c;
}

/* Rings [radius, height] upwards about z, between poles at the heights of the first and the last one. */
static void revolve(int rings, double (*const profile)[2])
{
    made.mesh = (kmp_mesh){.path = "made", .vertex = made.vertex, .triangle = made.triangle};
    int low = add_vertex(0, 0, profile[0][1]);
    for (int i = 0; i < rings; i++)
        for (int k = 0; k < SIDES; k++)
            add_vertex(profile[i][0] * cos(2 * pi * k / SIDES), profile[i][0] * sin(2 * pi * k / SIDES), profile[i][1]);
    int high = add_vertex(0, 0, profile[rings - 1][1]);
    for (int k = 0; k < SIDES; k++) {
        int next = (k + 1) % SIDES;
        add_triangle(low, 1 + next, 1 + k);
        for (int i = 0; i + 1 < rings; i++) {
            int a = 1 + i * SIDES, b = a + SIDES;
            add_triangle(a + k, a + next, b + k);
            add_triangle(a + next, b + next, b + k);
        }
        add_triangle(high, 1 + (rings - 1) * SIDES + k, 1 + (rings - 1) * SIDES + next);
    }
}

static void revolve_capsule(double r, double half)
{
    static double profile[MOST_RINGS][2];
    int rings = 0, steps = 120;
    for (int i = 1; i <= steps; i++, rings++) {
        profile[rings][0] = r * sin(pi / 2 * i / steps);
        profile[rings][1] = -half - r * cos(pi / 2 * i / steps);
    }
    for (int i = half > 0 ? steps : steps - 1; i >= 1; i--, rings++) {
        profile[rings][0] = r * sin(pi / 2 * i / steps);
        profile[rings][1] = half + r * cos(pi / 2 * i / steps);
    }
    revolve(rings, profile);
}

/* The inscribed surface has a little less: errors of (2 pi / SIDES)^2. */
static void expect(const char *shape, double tolerance)
{
    double wanted[10] = {0}, found[10];
    kmp_mesh_volume v;
    kmp_text why = {0};
    properties(shape, wanted);
    bool good = kmp_mesh_enclose(&made.mesh, &v, &why);
    CHECK(good && !v.inward);
    if (!good)
        printf("%s\n", why.s);
    found[0] = v.volume;
    memcpy(found + 1, v.centre, sizeof v.centre);
    memcpy(found + 4, v.inertia, sizeof v.inertia);
    compare(found, wanted, tolerance);
    kmp_text_free(&why);
}

static void closed_forms(void)
{
    double cylinder[2][2] = {{0.2, -0.5}, {0.2, 0.5}};
    revolve(2, cylinder);
    expect("{cylinder: 1, radius: 0.2, density: 1}", 5e-4);
    double area = SIDES / 2.0 * sin(2 * pi / SIDES) / pi; /* of the polygon beside its circle */
    kmp_mesh_volume v;
    kmp_text why = {0};
    CHECK(kmp_mesh_enclose(&made.mesh, &v, &why));
    CHECK_NEAR(v.volume, pi * 0.04 * area, 1e-14);
    revolve_capsule(0.3, 0);
    expect("{sphere: 0.3, density: 1}", 1e-3);
    revolve_capsule(0.2, 0.4);
    expect("{capsule: 0.8, radius: 0.2, density: 1}", 1e-3);
    kmp_text_free(&why);
}

/* A mesh whose triangles face inwards encloses the same. */
static void inward(void)
{
    kmp_mesh_volume out, in;
    kmp_text why = {0};
    revolve_capsule(0.2, 0.4);
    CHECK(kmp_mesh_enclose(&made.mesh, &out, &why));
    for (int k = 0; k < made.mesh.triangle_count; k++) {
        int a = made.triangle[k][0];
        made.triangle[k][0] = made.triangle[k][1];
        made.triangle[k][1] = a;
    }
    CHECK(kmp_mesh_enclose(&made.mesh, &in, &why) && in.inward);
    CHECK_NEAR(in.volume / out.volume, 1, 1e-11); /* so many roundings */
    CHECK_NEAR(in.inertia[0] / out.inertia[0], 1, 1e-11);
    kmp_text_free(&why);
}

/* A copy of the surface at a distance, of another size, whose triangles face inwards. */
static void add_turned(double scale, double aside)
{
    const int vertices = made.mesh.vertex_count, triangles = made.mesh.triangle_count;
    for (int k = 0; k < vertices; k++) {
        const double *x = made.vertex[k];
        add_vertex(scale * x[0] + aside, scale * x[1], scale * x[2]);
    }
    for (int k = 0; k < triangles; k++) {
        const int *t = made.triangle[k];
        add_triangle(vertices + t[1], vertices + t[0], vertices + t[2]);
    }
}

/* A part whose triangles face inwards is a hollow in another part; one apart from all others is inside out. */
static void parts_of_a_mesh(void)
{
    double cylinder[2][2] = {{0.2, -0.5}, {0.2, 0.5}};
    kmp_mesh_volume whole, v;
    kmp_text why = {0};
    revolve(2, cylinder);
    CHECK(kmp_mesh_enclose(&made.mesh, &whole, &why));
    add_turned(0.5, 0.02);
    CHECK(kmp_mesh_enclose(&made.mesh, &v, &why) && !v.inward);
    CHECK_NEAR(v.volume / whole.volume, 1 - 0.125, 1e-11);
    static const double scales[] = {0.5, 1, 2};
    for (int k = 0; k < 3; k++) {
        revolve(2, cylinder);
        add_turned(scales[k], 1);
        CHECK(!kmp_mesh_enclose(&made.mesh, &v, &why));
        CHECK(why.s && strstr(why.s, "face the other way than the rest: the part is inside out"));
        kmp_text_free(&why);
    }
}

/* -- thinned ----------------------------------------------------------------------------------------- */

/* All vertices stay near the capsule, and the corners of a block where they are. */
static void thinned(void)
{
    static const int most[] = {200, 2000, 20000};
    kmp_arena arena = {0};
    kmp_mesh thin;
    revolve_capsule(0.2, 0.4);
    for (int i = 0; i < 3; i++) {
        double worst = 0;
        CHECK(kmp_mesh_thin(&arena, &made.mesh, most[i], &thin));
        CHECK(thin.triangle_count <= most[i] && thin.triangle_count > most[i] / 4);
        for (int k = 0; k < thin.vertex_count; k++) {
            const double *p = thin.vertex[k];
            double over = fmax(fabs(p[2]) - 0.4, 0);
            worst = check_max(worst, fabs(sqrt(p[0] * p[0] + p[1] * p[1] + over * over) - 0.2));
        }
        CHECK(worst < 2.0 / sqrt(most[i]) * 0.2);
    }
    CHECK(kmp_mesh_thin(&arena, &made.mesh, made.mesh.triangle_count, &thin) && thin.vertex == made.mesh.vertex);
    kmp_arena_free(&arena);
}

/* A cube of many squares keeps its corners and its volume. */
static void thinned_block(void)
{
    kmp_arena arena = {0};
    kmp_mesh mesh, thin;
    kmp_text text = {0}, why = {0};
    enum { N = 40 };
    for (int face = 0; face < 6; face++)
        for (int i = 0; i <= N; i++)
            for (int k = 0; k <= N; k++) {
                double at[3];
                at[face / 2] = face % 2;
                at[(face / 2 + 1) % 3] = (double)i / N;
                at[(face / 2 + 2) % 3] = (double)k / N;
                kmp_text_printf(&text, "v %.9g %.9g %.9g\n", at[0], at[1], at[2]);
            }
    for (int face = 0; face < 6; face++)
        for (int i = 0; i < N; i++)
            for (int k = 0; k < N; k++) {
                int a = 1 + (face * (N + 1) + i) * (N + 1) + k, b = a + N + 1;
                if (face % 2)
                    kmp_text_printf(&text, "f %d %d %d %d\n", a, b, b + 1, a + 1);
                else
                    kmp_text_printf(&text, "f %d %d %d %d\n", a, a + 1, b + 1, b);
            }
    CHECK(kmp_mesh_read(&arena, "cube.OBJ", text.s, text.length, &mesh, &why));
    CHECK(mesh.vertex_count == 6 * N * N + 2 && mesh.triangle_count == 12 * N * N);
    kmp_mesh_volume v = {.volume = 0};
    CHECK(kmp_mesh_enclose(&mesh, &v, &why));
    CHECK_NEAR(v.volume, 1, 2e-12); /* a rounding for each triangle */
    CHECK_NEAR(v.inertia[1] * 6, 1, 4e-12);
    CHECK(kmp_mesh_thin(&arena, &mesh, 300, &thin) && thin.triangle_count <= 300);
    double low = 1, high = 0;
    for (int k = 0; k < 3 * thin.vertex_count; k++) {
        low = fmin(low, thin.vertex[k / 3][k % 3]);
        high = fmax(high, thin.vertex[k / 3][k % 3]);
    }
    CHECK(fabs(low) < 1e-3 && fabs(high - 1) < 1e-3);
    kmp_text_free(&text);
    kmp_text_free(&why);
    kmp_arena_free(&arena);
}

int main(void)
{
    TEST(formats);
    TEST(closed_forms);
    TEST(inward);
    TEST(parts_of_a_mesh);
    TEST(thinned);
    TEST(thinned_block);
    return check_report();
}
