/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Models written in other formats: read again they have the same mass matrix and bias at a hundred random states, and
 * the same accelerations where their loops are closed. Parts that cannot be written are named. */
#include "foreign_models.h"
#include <kempe/workspace.h>
#include <math.h>

enum { STATES = 100, MOST = 64 };

static kempe_context *context;

/* -- evaluation ---------------------------------------------------------------------------------------- */

typedef struct reading {
    kempe_model *model;
    kempe_system *system;
    kempe_workspace *work;
    int n;
} reading;

static bool begin(reading *r)
{
    bool good = r->model && kempe_system_new(r->model, &r->system) == KEMPE_OK &&
                kempe_workspace_new(r->system, &r->work) == KEMPE_OK;
    r->n = good ? kempe_model_coordinate_count(r->model) : 0;
    if (!good)
        printf("%s\n", kempe_context_message(context));
    return good;
}

static void end(reading *r)
{
    kempe_workspace_free(r->work);
    kempe_system_free(r->system);
    kempe_model_free(r->model);
}

/* The coordinate of a name J or J.k, which is J, J.k, J_k, J_joint or J_k_joint in the file that was written; -1: none.
 */
static int find(const reading *r, const char *name)
{
    char other[2][200];
    snprintf(other[0], sizeof other[0], "%s", name);
    for (char *s = other[0]; *s; s++)
        *s = *s == '.' ? '_' : *s;
    snprintf(other[1], sizeof other[1], "%.190s_joint", other[0]);
    for (int k = 0; k < r->n; k++) {
        const char *own = kempe_model_coordinate_name(r->model, k);
        if (strcmp(own, name) == 0 || strcmp(own, other[0]) == 0 || strcmp(own, other[1]) == 0)
            return k;
    }
    return -1;
}

static double random_number(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / (1 << 23) - 1;
}

/* -- round trips --------------------------------------------------------------------------------------- */

typedef struct trip {
    const char *file, *format;
    bool forces; /* its bias is the same */
    bool loops;  /* its loops are written */
} trip;

static void compare(const trip *t, const reading *own, const reading *other, const int *map)
{
    unsigned seed = 1;
    double worst = 0, most = 0, bias = 0, off = 0;
    for (int state = 0; state < STATES; state++) {
        double q[2][MOST], qd[2][MOST], qdd[2][MOST];
        for (int k = 0; k < own->n; k++) {
            q[1][map[k]] = q[0][k] = random_number(&seed);
            qd[1][map[k]] = qd[0][k] = random_number(&seed);
        }
        bool good = kempe_workspace_evaluate(own->work, 0, q[0], qd[0]) == KEMPE_OK &&
                    kempe_workspace_evaluate(other->work, 0, q[1], qd[1]) == KEMPE_OK;
        CHECK(good);
        for (int i = 0; good && i < own->n; i++) {
            for (int j = 0; j < own->n; j++) {
                double m = kempe_workspace_mass(own->work)[i * own->n + j];
                most = fmax(most, fabs(m));
                worst = fmax(worst, fabs(m - kempe_workspace_mass(other->work)[map[i] * own->n + map[j]]));
            }
            double c = kempe_workspace_bias(own->work)[i];
            most = fmax(most, fabs(c));
            bias = fmax(bias, fabs(c - kempe_workspace_bias(other->work)[map[i]]));
        }
        if (!t->loops || !t->forces || kempe_workspace_close(own->work, 0, q[0], qd[0], NULL) != KEMPE_OK)
            continue;
        for (int k = 0; k < own->n; k++) {
            q[1][map[k]] = q[0][k];
            qd[1][map[k]] = qd[0][k];
        }
        good = kempe_workspace_forward_dynamics(own->work, 0, q[0], qd[0], NULL, qdd[0], NULL) == KEMPE_OK &&
               kempe_workspace_forward_dynamics(other->work, 0, q[1], qd[1], NULL, qdd[1], NULL) == KEMPE_OK;
        for (int k = 0; good && k < own->n; k++)
            off = fmax(off, fabs(qdd[0][k] - qdd[1][map[k]]) / (1 + fabs(qdd[0][k])));
    }
    printf("   %s as %s: M %.1e, C %.1e, accelerations %.1e\n", strrchr(t->file, '/') + 1, t->format, worst / most,
           bias / most, off);
    CHECK(worst <= 1e-12 * most);
    CHECK(!t->forces || bias <= 1e-12 * most);
    CHECK(off <= 1e-8);
}

static void go(const trip *t)
{
    reading own = {0}, other = {0};
    char *text = NULL;
    int map[MOST], found = 0;
    CHECK(kempe_model_read(context, t->file, &own.model) == KEMPE_OK);
    CHECK(own.model && kempe_model_export(own.model, t->format, &text) == KEMPE_OK);
    if (text && kempe_model_read_text(context, text, "r.xml", &other.model) != KEMPE_OK)
        printf("%s as %s: %s\n", t->file, t->format, kempe_context_message(context));
    bool good = text && begin(&own) && begin(&other);
    CHECK(good && own.n == other.n && own.n <= MOST);
    for (int k = 0; good && own.n == other.n && k < own.n; k++) {
        map[k] = find(&other, kempe_model_coordinate_name(own.model, k));
        found += map[k] >= 0;
    }
    CHECK(found == own.n);
    if (good && found == own.n)
        compare(t, &own, &other, map);
    kempe_text_free(text);
    end(&own);
    end(&other);
}

#define MODEL(name)   KEMPE_ROOT "/tests/models/" name
#define EXAMPLE(name) KEMPE_ROOT "/examples/" name "/" name ".yaml"

static void there_and_back(void)
{
    static const trip trips[] = {
        {MODEL("folding_arm.yaml"), "urdf+", false, false}, {MODEL("folding_arm.yaml"), "sdf", false, false},
        {MODEL("geared_leg.yaml"), "urdf+", true, false},   {MODEL("geared_leg.yaml"), "sdf", true, false},
        {EXAMPLE("four_bar"), "urdf+", false, true},        {EXAMPLE("four_bar"), "sdf", true, true},
        {EXAMPLE("stewart"), "urdf+", false, true},         {EXAMPLE("stewart"), "sdf", false, true},
        {MODEL("folding_arm.yaml"), "mjcf", false, false},  {MODEL("geared_leg.yaml"), "mjcf", true, false},
        {EXAMPLE("four_bar"), "mjcf", true, true},          {EXAMPLE("stewart"), "mjcf", false, true},
        {MODEL("armed_linkage.yaml"), "mjcf", true, true},  {EXAMPLE("stephenson"), "sdf", true, true},
        {EXAMPLE("parallel_robot"), "sdf", true, true},     {MODEL("tendon_ropes.yaml"), "mjcf", true, false},
    };
    for (size_t k = 0; k < sizeof trips / sizeof *trips; k++)
        go(&trips[k]);
}

/* -- pictures ------------------------------------------------------------------------------------------ */

/* The lines of shapes of a printed model, without those of kinds that a format does not have. */
static char *shape_lines(const kempe_model *model, const char *without)
{
    char *text = NULL, *out = calloc(1, 10000);
    CHECK(model && kempe_model_print(model, KEMPE_TEXT, &text) == KEMPE_OK);
    for (const char *line = text; out && line && *line; line += strcspn(line, "\n"), line += *line == '\n') {
        size_t length = strcspn(line, "\n") + 1, indent = strspn(line, " ");
        if (strncmp(line + indent, "shape ", 6) == 0 && strncmp(line + indent + 6, "line", 4) != 0 &&
            strncmp(line + indent + 6, without, strlen(without)) != 0)
            strncat(out, line, length);
    }
    kempe_text_free(text);
    return out;
}

/* Checks that two texts are the same but for the rounding of their numbers. */
static void check_alike(const char *a, const char *b)
{
    const char *first[2] = {a, b};
    while (*a && *b) {
        char *ends[2];
        double x = strtod(a, &ends[0]), y = strtod(b, &ends[1]);
        bool numbers = ends[0] > a && ends[1] > b;
        if (numbers ? fabs(x - y) > 1e-14 : *a != *b)
            break;
        a = numbers ? ends[0] : a + 1;
        b = numbers ? ends[1] : b + 1;
    }
    if (*a || *b)
        CHECK_TEXT(first[1], first[0]);
}

static void pictures_and_points(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n  a:\n    joint: {revolute: y, at: ground}\n    mass: 1\n"
        "    inertia: {xx: 1, yy: 1, zz: 1}\n    points: {tip: {at: [0.4, 0.1, 0], axes: {x: [1, 2, 3]}}}\n    shape:\n"
        "      - {box: [0.1, 0.2, 0.3], at: [1, 2, 3], axes: {z: [1, 1, 0]}, colour: red}\n"
        "      - {cylinder: 0.5, radius: 0.1, axis: [1, 2, 2]}\n"
        "      - {capsule: 0.5, radius: 0.1, axis: x, at: [0, 0, 1], colour: '#123456'}\n"
        "      - {sphere: 0.3, at: [4, 3, 2]}\n      - {ellipsoid: [0.1, 0.2, 0.3], axes: {x: [0, 1, 1]}}\n"
        "      - {mesh: leg/trunk.stl, scale: 0.001, at: [0, 1, 0], axes: {z: [1, 0, 1]}}\n"
        "      - {line: [[0, 0, 0], [1, 0, 0]]}\n";
    static const struct {
        const char *format, *without, *point;
    } cases[] = {{"urdf+", "ellipsoid", NULL}, {"sdf", "none", "a_tip"}, {"mjcf", "none", "a_tip"}};
    static const char *const place = KEMPE_ROOT "/tests/models/m.xml";
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        kempe_model *own = NULL, *other = NULL;
        char *written = NULL, *shown = NULL, *lines[2];
        CHECK(kempe_model_read_text(context, text, place, &own) == KEMPE_OK);
        CHECK(own && kempe_model_export(own, cases[k].format, &written) == KEMPE_OK);
        CHECK(written && kempe_model_read_text(context, written, place, &other) == KEMPE_OK);
        lines[0] = shape_lines(own, cases[k].without);
        lines[1] = shape_lines(other, cases[k].without);
        if (lines[0] && lines[1])
            check_alike(lines[0], lines[1]);
        CHECK(other && kempe_model_print(other, KEMPE_TEXT, &shown) == KEMPE_OK);
        CHECK(shown && (!cases[k].point || strstr(shown, "point a_tip [0.4, 0.1, 0], axes")));
        free(lines[0]);
        free(lines[1]);
        kempe_text_free(shown);
        kempe_text_free(written);
        kempe_model_free(own);
        kempe_model_free(other);
    }
}

/* -- messages ------------------------------------------------------------------------------------------ */

static void what_is_left_out(void)
{
    static const char text[] =
        "kempe: 1\nbodies:\n  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: "
        "[1, 0, "
        "0]}}\nground: {points: {Q: [2, 0, 0]}}\nloops: {L: {point_on_line: [ground.Q, a.P], axis: x}}\nforces: {s: "
        "{spring: [ground.Q, a.P], stiffness: 1}, k: {joint: A, spring: {stiffness: 2, damping: 3}}}\nstart: {q: {A: "
        "1}}\n";
    kempe_model *model = NULL;
    char *written = NULL;
    CHECK(kempe_model_read_text(context, text, "m.yaml", &model) == KEMPE_OK);
    foreign_lines[0] = '\0';
    kempe_context_set_log(context, foreign_on_log, NULL);
    CHECK(model && kempe_model_export(model, "urdf+", &written) == KEMPE_OK);
    kempe_context_set_log(context, NULL, NULL);
    CHECK_TEXT(foreign_lines,
               "2 m.yaml: the spring of joint 'A' is not written: URDF+ has no springs\n"
               "2 m.yaml: gravity [0, 0, 0] is not written: readers of URDF+ take [0, 0, -9.81]\n"
               "2 m.yaml: loop 'L' is not written: URDF+ has no closure of kind 'point_on_line' as it is here\n"
               "2 m.yaml: force 's' is not written: URDF+ has no such force\n"
               "2 m.yaml: the start of coordinate 'A' is not written: URDF+ has no start values\n");
    kempe_text_free(written);
    written = NULL;
    CHECK(kempe_context_set_strict(context, 1) == KEMPE_OK);
    CHECK(kempe_model_export(model, "sdf", &written) == KEMPE_E_INPUT && !written);
    CHECK_TEXT(kempe_context_message(context),
               "m.yaml: loop 'L' is not written: SDFormat has no closure of kind 'point_on_line' as it is here\n"
               "m.yaml: force 's' is not written: SDFormat has no such force\n"
               "m.yaml: the start of coordinate 'A' is not written: SDFormat has no start values");
    CHECK(kempe_context_set_strict(context, 0) == KEMPE_OK);
    CHECK(kempe_model_export(model, "obj", &written) == KEMPE_E_ARGUMENT && !written);
    CHECK_TEXT(kempe_context_message(context), "unknown format 'obj'; there are urdf+, sdf, mjcf, yaml");
    kempe_model_free(model);
}

/* A rope over a sheave with a groove is no tendon of MuJoCo, and a damped one no spring that only pulls. */
static void ropes_that_are_left_out(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, 0]\nground: {points: {A: [-1, 0, 0], C: [0, -0.1, 0]}}\nbodies:\n"
        "  b: {joint: {name: x, prismatic: y, at: ground}, mass: 1, points: {P: [1, -1, 0]}}\nropes:\n"
        "  grooved: {along: [ground.A, {round: ground.C, radius: 0.1, turn: right}, b.P]}\n"
        "  damped: {along: [ground.A, b.P], stiffness: 1, damping: 0.1}\n  limit: {along: [ground.A, b.P], length: "
        "3}\n";
    kempe_model *model = NULL;
    char *written = NULL;
    CHECK(kempe_model_read_text(context, text, "m.yaml", &model) == KEMPE_OK);
    foreign_lines[0] = '\0';
    kempe_context_set_log(context, foreign_on_log, NULL);
    CHECK(model && kempe_model_export(model, "mjcf", &written) == KEMPE_OK);
    kempe_context_set_log(context, NULL, NULL);
    CHECK_TEXT(foreign_lines, "2 m.yaml: force 'grooved' is not written: MJCF has no such force\n"
                              "2 m.yaml: force 'damped' is not written: MJCF has no such force\n"
                              "2 m.yaml: the path of rope 'grooved' is not written: MJCF has no such path\n"
                              "2 m.yaml: the path of rope 'damped' is not written: MJCF has no such path\n");
    CHECK(written && strstr(written, "<spatial name=\"limit\" range=\"0 3\" limited=\"true\">"));
    kempe_text_free(written);
    kempe_model_free(model);
}

/* The model as JSON, which has all of it but the name of its file. */
static char *whole(const kempe_model *model)
{
    char *text = NULL;
    CHECK(kempe_model_print(model, KEMPE_JSON, &text) == KEMPE_OK);
    return text;
}

/* Files in other formats as documents of Kempe's language, which give the same model. */
static void own_language(void)
{
    static const char *const paths[] = {"examples/robot_leg/robot_leg.urdf", "tests/models/closed_arm.urdf",
                                        "tests/models/geared_leg.urdf",      "tests/models/gantry.mjcf",
                                        "tests/models/tied_gripper.mjcf",    "tests/models/folding_arm.sdf"};
    CHECK(kempe_context_set_left_out(context, "armature") == KEMPE_OK); /* of a ball joint */
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        kempe_model *model = NULL, *again = NULL;
        char *text = NULL, *a = NULL, *b = NULL, label[256];
        CHECK(kempe_model_read(context, paths[k], &model) == KEMPE_OK &&
              kempe_model_export(model, "yaml", &text) == KEMPE_OK);
        CHECK(text && strncmp(text, "kempe: 1\n", 9) == 0);
        CHECK(text && kempe_model_read_text(context, text, paths[k], &again) != KEMPE_OK); /* its ending is foreign */
        snprintf(label, sizeof label, "%s.yaml", paths[k]);
        CHECK(text && kempe_model_read_text(context, text, label, &again) == KEMPE_OK);
        a = model ? whole(model) : NULL;
        b = again ? whole(again) : NULL;
        CHECK(a && b && strcmp(a, b) == 0);
        kempe_text_free(a);
        kempe_text_free(b);
        kempe_text_free(text);
        kempe_model_free(again);
        kempe_model_free(model);
    }
    kempe_model *own = NULL;
    char *text = NULL;
    CHECK(kempe_model_read(context, "examples/four_bar/four_bar.yaml", &own) == KEMPE_OK);
    CHECK(kempe_model_export(own, "yaml", &text) == KEMPE_E_ARGUMENT && !text);
    CHECK_TEXT(kempe_context_message(context),
               "'examples/four_bar/four_bar.yaml' is in Kempe's language already: copy the file");
    kempe_model_free(own);
}

static void flexible_bodies(void)
{
    static const char *const formats[] = {"urdf+", "sdf", "mjcf"}, *const names[] = {"URDF", "SDFormat", "MJCF"};
    kempe_model *model = NULL;
    char *text = NULL, expected[128];
    CHECK(kempe_model_read_text(context,
                                "kempe: 1\nbodies: {rod: {joint: {revolute: z, at: ground}, flexible: "
                                "{beam: {length: 1, rhoA: 1, EIz: 1}, shapes: {y: 1}}}}\n",
                                "rod.yaml", &model) == KEMPE_OK);
    for (int k = 0; k < 3 && model; k++) {
        CHECK(kempe_model_export(model, formats[k], &text) == KEMPE_E_ARGUMENT && !text);
        (void)snprintf(expected, sizeof expected, "body 'rod' is flexible: %s", names[k]);
        CHECK(strncmp(kempe_context_message(context), expected, strlen(expected)) == 0);
    }
    kempe_model_free(model);
}

int main(void)
{
    context = kempe_context_new();
    TEST(there_and_back);
    TEST(pictures_and_points);
    TEST(what_is_left_out);
    TEST(ropes_that_are_left_out);
    TEST(own_language);
    TEST(flexible_bodies);
    kempe_context_free(context);
    return check_report();
}
