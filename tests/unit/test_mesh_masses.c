/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Masses of bodies in MJCF by meshes, against the moments of a tetrahedron and of its faces in closed form; meshes that
 * give none. MuJoCo's numbers: tests/oracle/robots. */
#include "foreign_models.h"
#include <kempe/workspace.h>
#include <math.h>

static kempe_context *context;

/* A tetrahedron with a corner at the origin and edges a, b, c along the axes, of a file in mm; a small ball far away.
 */
static const double edge[3] = {0.1, 0.05, 0.02}, ball = 0.5, radius = 0.1, height = 1;

static void write_model(char *text, size_t size, const char *asset)
{
    snprintf(text, size,
             "<mujoco><asset><mesh name='m' file='leg/trunk.stl' %s/></asset><worldbody><body name='b'><freejoint/>"
             "<geom type='mesh' mesh='m' density='2000'/><geom size='0.1' pos='0 0 1' mass='0.5'/></body></worldbody>"
             "</mujoco>",
             asset);
}

/* The mass matrix of a free body at zero: mass, first moments, and moments of inertia about the origin. */
static void check_mass(const char *asset, double mass, const double first[3], const double second[6])
{
    char text[600];
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *work = NULL;
    const double q[6] = {0}, qd[6] = {0}, whole = mass + ball, z = first[2] + ball * height;
    write_model(text, sizeof text, asset);
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/m.mjcf", &model) == KEMPE_OK);
    CHECK(model && kempe_system_new(model, &system) == KEMPE_OK && kempe_workspace_new(system, &work) == KEMPE_OK);
    CHECK(work && kempe_workspace_evaluate(work, 0, q, qd) == KEMPE_OK);
    const double *M = work ? kempe_workspace_mass(work) : NULL;
    for (int k = 0; M && k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double turning = second[i] + second[j] + ball * 0.4 * radius * radius + (k < 2 ? ball * height * height : 0);
        CHECK_NEAR(M[7 * k], whole, 1e-15);
        CHECK_NEAR(M[7 * (k + 3)], turning, 1e-15);
        CHECK_NEAR(M[6 * (i + 3) + j + 3], -second[3 + (k == 2 ? 0 : k == 1 ? 1 : 2)], 1e-16);
    }
    if (M) { /* the velocity of the centre for a rotation about y is along x by z, along z by -x */
        CHECK_NEAR(M[6 * 0 + 4], z, 1e-15);
        CHECK_NEAR(M[6 * 2 + 4], -first[0], 1e-15);
        CHECK_NEAR(M[6 * 2 + 3], first[1], 1e-15);
    }
    kempe_workspace_free(work);
    kempe_system_free(system);
    kempe_model_free(model);
}

/* Signs of the edges where the mesh is mirrored. */
static void check_solid(const char *asset, const double e[3])
{
    double m = 2000 * fabs(e[0] * e[1] * e[2]) / 6, first[3], second[6];
    for (int k = 0; k < 3; k++) {
        int i = k == 2 ? 1 : 0, j = k == 0 ? 1 : 2; /* x y, x z, y z */
        first[k] = m * e[k] / 4;
        second[k] = m * e[k] * e[k] / 10;
        second[3 + k] = m * e[i] * e[j] / 20;
    }
    check_mass(asset, m, first, second);
}

static void solids(void)
{
    static const double mirrored[3] = {0.1, 0.05, -0.02}, uneven[3] = {0.2, 0.05, 0.06};
    check_solid("scale='0.001 0.001 0.001'", edge);
    check_solid("scale='0.001 0.001 0.001' inertia='exact'", edge);
    check_solid("scale='0.001 0.001 -0.001'", mirrored);
    check_solid("scale='0.001 0.001 -0.001' inertia='exact'", mirrored);
    check_solid("scale='0.002 0.001 0.003' inertia='legacy'", uneven);
}

static void shells(void)
{
    const double *e = edge, face[3] = {e[1] * e[2] / 2, e[0] * e[2] / 2, e[0] * e[1] / 2};
    const double slanted = sqrt(face[0] * face[0] + face[1] * face[1] + face[2] * face[2]), rho = 2000;
    double first[3], second[6];
    for (int k = 0; k < 3; k++) {
        int i = k == 2 ? 1 : 0, j = k == 0 ? 1 : 2, across = 3 - i - j;
        double area =
            face[(k + 1) % 3] + face[(k + 2) % 3] + slanted; /* of the faces that e[k] is an edge or side of */
        first[k] = rho * area * e[k] / 3;
        second[k] = rho * area * e[k] * e[k] / 6;
        second[3 + k] = rho * (face[across] + slanted) * e[i] * e[j] / 12;
    }
    check_mass("scale='0.001 0.001 0.001' inertia='shell'", rho * (face[0] + face[1] + face[2] + slanted), first,
               second);
}

/* The mesh is moved by -p and turned by the inverse of a quarter turn about z: x to -y, y to x. */
static void references(void)
{
    const double e[3] = {0.05, -0.1, 0.02}, m = 2000 * 0.1 * 0.05 * 0.02 / 6, p[3] = {0.01, -0.03, 0.02};
    double first[3], second[6];
    for (int k = 0; k < 3; k++) {
        int i = k == 2 ? 1 : 0, j = k == 0 ? 1 : 2;
        first[k] = m * (e[k] / 4 - p[k]);
        second[k] = m * (e[k] * e[k] / 10 - 2 * p[k] * e[k] / 4 + p[k] * p[k]);
        second[3 + k] = m * (e[i] * e[j] / 20 - (p[i] * e[j] + p[j] * e[i]) / 4 + p[i] * p[j]);
    }
    check_mass("scale='0.001 0.001 0.001' refpos='30 10 20' refquat='0.70710678118654757 0 0 0.70710678118654757'", m,
               first, second);
}

static void what_gives_no_mass(void)
{
    static const struct {
        const char *asset, *said;
    } cases[] = {
        {"inertia='convex'", "its inertia 'convex' is not computed; available: exact, legacy, shell"},
        {"file='nowhere.stl'", "the file 'nowhere.stl' is not found"},
        {"scale='0 1 1' inertia='exact'", "the mesh encloses no volume"},
        {"scale='0 0 1'", "the mesh has no extent"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[600], wanted[400];
        const char *file = strstr(cases[k].asset, "file=") ? "" : "file='leg/trunk.stl' ";
        snprintf(text, sizeof text,
                 "<mujoco><asset><mesh name='m' %s%s/></asset><worldbody><body name='b'><freejoint/>\n<geom "
                 "type='mesh' mesh='m' group='3'/></body></worldbody></mujoco>",
                 file, cases[k].asset);
        snprintf(wanted, sizeof wanted,
                 KEMPE_ROOT
                 "/tests/models/m.mjcf:2:1: the body 'b' has its mass from a mesh, and %s: give it an element "
                 "'inertial'",
                 cases[k].said);
        foreign_refuse(context, KEMPE_ROOT "/tests/models/m.mjcf", text, wanted);
    }
}

int main(void)
{
    context = kempe_context_new();
    TEST(solids);
    TEST(shells);
    TEST(references);
    TEST(what_gives_no_mass);
    kempe_context_free(context);
    return check_report();
}
