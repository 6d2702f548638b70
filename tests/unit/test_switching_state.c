/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions at a state where a condition changes: a spring that is stiffer in one direction has no frequency, but a
 * condition that changes no matrix leaves the result as it is. An equilibrium is stable if it is so on all sides. */
#include "loaded.h"
#include <kempe/equilibrium.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

static loaded load_law(const char *force)
{
    static char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\n"
                   "parameters: {F: 0}\n"
                   "tables: {line: {x: [-1, 0, 1], y: [-100, 0, 400], method: linear, outside: linear}}\n"
                   "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {f: {joint: x, force: \"%s\"}, g: {joint: x, force: F}}\n",
                   force);
    return load_text(text);
}

/* Laws; true: the matrices of both sides, or the forces, differ. */
static const struct {
    const char *law;
    bool stiffness, other;
} laws[] = {
    {"-if(q(x) < 0, 100, 400)*q(x)", true, true},
    {"-100*q(x) - 300*max(q(x), 0)", true, true},
    {"-100*q(x) - 50*abs(q(x))", true, true},
    {"-100*q(x) - 3*dead_zone(q(x), 0, 1)", true, true},
    {"-line(q(x))", true, true},
    {"-100*q(x) - if(qd(x) > 0, 2, 5)*qd(x)", false, true},
    {"-100*q(x) - 5*max(qd(x), 0)", false, true},
    {"-100*q(x) - 3*sign(qd(x))", true, true},
    {"-100*q(x) - qd(x)*abs(qd(x))", false, false},
    {"-100*q(x) - if(q(x) > 0, q(x)^2, 0)", false, false},
    {"-100*q(x) - if(q(x) > 0, 3, 3)*q(x)", false, false},
    {"-100*q(x) - if(t > 0, 2, 5)*qd(x)", false, false},
    {"-100*q(x) - max(q(x) - 0.001, 0)", false, false},
};

static void small_motions_of_one_side_are_doubted(void)
{
    for (int k = 0; k < (int)(sizeof laws / sizeof *laws); k++) {
        loaded l = load_law(laws[k].law);
        const kempe_status want = laws[k].other ? KEMPE_UNTRUSTED : KEMPE_OK;
        kempe_modes *modes = NULL;
        kempe_linearization *linear = NULL;
        kempe_response *response = NULL;
        kempe_sensitivity *slopes = NULL;
        const kempe_response_options frequencies = {.inputs = "effort(x)", .outputs = "q(x)", .frequencies = "0.1:1:3"};
        const kempe_sensitivity_options of = {.of = "equilibrium", .parameters = "F", .outputs = "q(x)"};
        CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == want);
        CHECK(l.system && kempe_linearization_new(l.system, NULL, &linear) == want);
        CHECK(l.system && kempe_response_new(l.system, &frequencies, &response) == want);
        CHECK(l.system &&
              kempe_sensitivity_new(l.model, &of, &slopes) == (laws[k].stiffness ? KEMPE_UNTRUSTED : KEMPE_OK));
        kempe_modes_free(modes);
        kempe_linearization_free(linear);
        kempe_response_free(response);
        kempe_sensitivity_free(slopes);
        unload(&l);
    }
}

/* The question leaves the state and its matrices as they were: they belong to the side of the equilibrium. */
static void the_matrices_stay(void)
{
    loaded l = load_law("-if(q(x) < 0, 100, 400)*q(x) - 2*qd(x)");
    kempe_linearization *linear = NULL;
    int rows = 0, columns = 0;
    CHECK(l.system && kempe_linearization_new(l.system, NULL, &linear) == KEMPE_UNTRUSTED);
    const double *K = linear ? kempe_linearization_matrix(linear, KEMPE_MATRIX_K, &rows, &columns) : NULL;
    CHECK(K && rows == 1 && columns == 1 && K[0] == 400);
    kempe_linearization_free(linear);
    unload(&l);
}

/* Elastic teeth without load and play: exactly there no flank presses, and next to it one of them does. */
static void unloaded_teeth_are_a_spring(void)
{
    loaded l = load_text("kempe: 1\n"
                         "parameters: {T: 0}\n"
                         "ground: {points: {O: [0, 0, 0], P: [0.09, 0, 0]}}\n"
                         "bodies:\n"
                         "  A: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.01}}\n"
                         "  B: {joint: {revolute: z, at: ground.P}, mass: 1, inertia: {zz: 0.02}}\n"
                         "gears: {g: {between: [A, B], teeth: [20, 40], stiffness: 1e6, damping: 10}}\n"
                         "forces: {s: {joint: A, spring: {stiffness: 50}}, t: {joint: B, torque: T}}\n"
                         "run: {outputs: [q(B), reaction(g)]}\n");
    const double r[2] = {0.03, 0.06}, k = 1e6, c = 10;
    const kempe_linearize_options ask = {.inputs = "effort(B)", .outputs = "reaction(g).y"};
    kempe_linearization *linear = NULL;
    kempe_equilibrium *rest = NULL;
    kempe_sensitivity *slopes = NULL;
    int rows = 0, columns = 0;
    CHECK(l.system && kempe_linearization_new(l.system, &ask, &linear) == KEMPE_OK);
    const double *K = linear ? kempe_linearization_matrix(linear, KEMPE_MATRIX_K, &rows, &columns) : NULL;
    const double *G = linear ? kempe_linearization_matrix(linear, KEMPE_MATRIX_G, &rows, &columns) : NULL;
    const double *C = linear ? kempe_linearization_matrix(linear, KEMPE_MATRIX_C, &rows, &columns) : NULL;
    for (int i = 0; K && G && i < 2; i++)
        for (int j = 0; j < 2; j++) {
            CHECK_NEAR(K[i + 2 * j], k * r[i] * r[j] + (i + j == 0 ? 50 : 0), 1e-6);
            CHECK_NEAR(G[i + 2 * j], c * r[i] * r[j], 1e-9);
        }
    for (int j = 0; C && j < 2; j++)
        CHECK_NEAR(fabs(C[j]), k * r[j], 1e-4);
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &rest) == KEMPE_OK);
    CHECK(rest && strcmp(kempe_equilibrium_stability(rest, 0), "stable") == 0);
    const kempe_sensitivity_options of = {.of = "equilibrium", .parameters = "T", .outputs = "q(B)"};
    CHECK(l.model && kempe_sensitivity_new(l.model, &of, &slopes) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(slopes && kempe_sensitivity_table(slopes, "rows", &table) == KEMPE_OK);
    const double *by_T = table ? kempe_table_values(table, kempe_table_column_count(table) - 1) : NULL;
    CHECK(by_T != NULL);
    if (by_T)
        CHECK_NEAR(by_T[0], 1 / (k * r[1] * r[1]) + r[0] * r[0] / (r[1] * r[1] * 50), 1e-12);
    kempe_linearization_free(linear);
    kempe_equilibrium_free(rest);
    kempe_sensitivity_free(slopes);
    kempe_table_free(table);
    unload(&l);
}

/* Laws with the word of their equilibrium at 0: a motion that leaves on one side decides, and growth on one side that
 * returns on the other decides nothing. */
static void stability_is_of_all_sides(void)
{
    static const struct {
        const char *law, *word;
    } cases[] = {
        {"-if(q(x) < 0, -50, 100)*q(x) - qd(x)", "unstable"},
        {"-if(q(x) < 0, 100, -50)*q(x) - qd(x)", "unstable"},
        {"-if(q(x) < 0, 100, 400)*q(x) - qd(x)", "stable"},
        {"-if(q(x) < 0, 100, 0)*q(x) - qd(x)", "neutral"},
        {"-if(q(x) < 0, 0, 100)*q(x) - qd(x)", "neutral"},
        {"-50*abs(q(x))", "unstable"},
        {"50*abs(q(x))", "unstable"},
        {"-100*q(x) - 150*min(q(x), 0) - qd(x)", "stable"},
        {"-100*q(x) + 150*min(q(x), 0) - qd(x)", "unstable"},
        {"-100*q(x) - if(qd(x) < 0, 2, -1)*qd(x)", "undecided"},
        {"-100*q(x) - if(qd(x) < 0, -1, 2)*qd(x)", "undecided"},
    };
    for (int k = 0; k < (int)(sizeof cases / sizeof *cases); k++) {
        loaded l = load_law(cases[k].law);
        kempe_equilibrium *rest = NULL;
        const bool open = strcmp(cases[k].word, "undecided") == 0;
        CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &rest) == (open ? KEMPE_UNTRUSTED : KEMPE_OK));
        CHECK_TEXT(rest ? kempe_equilibrium_stability(rest, 0) : "", cases[k].word);
        CHECK(!rest || !open || kempe_equilibrium_is_stable(rest, 0) == -1);
        kempe_equilibrium_free(rest);
        unload(&l);
    }
}

/* Two coordinates and a closure: the sprung arm of a loop that is pushed over on one side of its middle. */
static void stability_of_a_mechanism_is_of_all_sides(void)
{
    for (int side = 0; side < 2; side++) {
        static char text[1024];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\n"
            "ground: {points: {O: [0, 0, 0], P: [1, 0, 0]}}\n"
            "bodies:\n"
            "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [0, 1, 0]}}\n"
            "  b: {joint: {name: B, revolute: z, at: ground.P}, mass: 1, inertia: {zz: 1}, points: {E: [0, 1, 0]}}\n"
            "  c: {joint: {name: C, revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}, points: {E: [1, 0, 0]}}\n"
            "loops: {E: {ball: [c.E, b.E]}}\n"
            "forces: {f: {joint: B, torque: '-if(q(A) < 0, %d, %d)*q(B) - qd(A)'}}\n",
            side == 0 ? -50 : 100, side == 0 ? 100 : -50);
        loaded l = load_text(text);
        kempe_equilibrium *rest = NULL;
        CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &rest) == KEMPE_OK);
        CHECK_TEXT(rest ? kempe_equilibrium_stability(rest, 0) : "", "unstable");
        kempe_equilibrium_free(rest);
        unload(&l);
    }
}

int main(void)
{
    TEST(small_motions_of_one_side_are_doubted);
    TEST(the_matrices_stay);
    TEST(unloaded_teeth_are_a_spring);
    TEST(stability_is_of_all_sides);
    TEST(stability_of_a_mechanism_is_of_all_sides);
    return check_report();
}
