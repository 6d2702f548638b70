/* SPDX-License-Identifier: BSD-3-Clause */
/* Graphs of joints: which are cut, and what is said of it. */
#include "constraints/kinds/kind.h"
#include "joint_graphs.h"
#include "testing.h"
#include <kempe/check.h>

/* -- the choice ---------------------------------------------------------------------------------------------- */

static int rows_of(const kmp_closure_kind *kind)
{
    return kind->force->rows + kind->moment->rows;
}

static void check_choice(const char *tail, const char *cut, const char *why)
{
    kempe_model *model = read_two(four_bar, tail);
    CHECK(model && model->cut_count == 1);
    if (model && model->cut_count == 1) {
        CHECK_TEXT(model->cuts[0].joint, cut);
        CHECK_TEXT(model->cuts[0].why, why);
        CHECK(model->cuts[0].rows == rows_of(kmp_closure_kind_find(model->cuts[0].closure)));
    }
    kempe_model_free(model);
}

#define HINGES                                                                                                         \
    "joints:\n  A: {revolute: [ground.O, crank.O]}\n  B: {revolute: [crank.B, coupler.O]}\n"                           \
    "  C: {revolute: [coupler.C, rocker.C]}\n"

static void test_choice(void)
{
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\n", "C",
                 "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nstart: {q: {C: 1}}\n", "B",
                 "it has no start value, unlike C; it is farther from the ground than A, D");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O]}\n", "D", "it has fewer rows than A, B, C");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O]}\nrun: {outputs: [lambda(D), q(D.2), reaction(A)]}\n",
                 "D", "it has fewer rows than A, B, C");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O], cut: no}\nrun: {independent: [C]}\n", "B",
                 "it is farther from the ground than A; not to be cut: D (cut: no), C (it is given as independent)");
    check_choice(HINGES "  D: {screw: [ground.D, rocker.O], pitch: 1 mm}\nstart: {hold: [C]}\n"
                        "drives: {m: {joint: A, locked: yes}}\n",
                 "B",
                 "the others of its loop are not to be cut: A (drive 'm' moves it), D (a screw cannot be cut), C "
                 "(the start holds it)");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nrun: {outputs: [q(C), reaction(A)]}\n"
                        "sensors: {s: q(C) + moment(B).z, r: qd(C)}\n",
                 "C", "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nalgebraic: {pull: 2*reaction(A).x}\n", "A",
                 "the expression 2*reaction(A).x needs its reaction");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nstates: {s: {rate: reaction(B).y - s}}\n", "B",
                 "the expression reaction(B).y - s needs its reaction");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nrun: {until: reaction(A).x > q(C)}\n", "C",
                 "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O], cut: yes}\n", "D", "the model prescribes it (cut: yes)");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O], cut: no}\n"
                        "loops: {G: {coupler: {B: 1, C: 2}}}\n",
                 "A",
                 "the others of its loop are not to be cut: D (cut: no), C (loop 'G' depends on it), B (loop 'G' "
                 "depends on it)");
}

/* The rows of cuts.def that give the number of rows of their closures. */
static void test_rows(void)
{
    joint_kind kind;
    for (int k = 0; joint_kind_at(k, &kind); k++)
        if (kind.closure) {
            const kmp_closure_kind *closure = kmp_closure_kind_find(kind.closure);
            CHECK(closure && rows_of(closure) == kind.rows);
            CHECK(6 - (int)strlen(kind.chain) / 2 == kind.rows);
        }
}

/* -- start values --------------------------------------------------------------------------------------------- */

static void hear(void *user, kempe_level level, const char *line)
{
    char *said = user;
    if (level == KEMPE_LOG_WARNING)
        snprintf(said, 256, "%s", line);
}

static void test_start_of_cut(void)
{
    char said[256] = "";
    kempe_context_set_log(context, hear, said);
    kempe_model *model = read_two(four_bar, HINGES "  D: {revolute: [ground.D, rocker.O]}\nstart: {q: {A: 1, B: 2, C: "
                                                   "3, D: 4}, qd: {C: 5}}\n");
    kempe_context_set_log(context, NULL, NULL);
    CHECK_TEXT(said, "joint 'C' is cut and has no coordinate: its start value is not used (cut: no keeps the joint)");
    CHECK(model && model->cut_count == 1 && model->cuts[0].start_unused);
    if (model)
        for (int k = 0; k < 3; k++)
            CHECK(model->start.q[k].value == (model->motions[k].name[0] - 'A' + 1));
    kempe_model_free(model);
}

/* A loop that can never close, by the links that it has whatever their origins are. */
static void test_too_short(void)
{
    static const char text[] = "kempe: 1\nground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\nbodies:\n"
                               "  a: {mass: 1, inertia: {zz: 1}, points: {P: [10, 0, 0], Q: [10.5, 0, 0]}}\n"
                               "  b: {mass: 1, inertia: {zz: 1}, points: {P: [-7, 0, 0], Q: [-4, 0, 0]}}\n"
                               "  c: {mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0], Q: [1.25, 0, 0]}}\n"
                               "joints:\n  A: {revolute: [ground.O, a.P]}\n  B: {revolute: [a.Q, b.P]}\n"
                               "  C: {revolute: [b.Q, c.Q]}\n  D: {revolute: [ground.D, c.P]}\n";
    kempe_model *model = read_text(text);
    kempe_system *system = NULL;
    kempe_check *check = NULL;
    char *said = NULL;
    CHECK(model && kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(system && kempe_check_new(system, &check) != KEMPE_E_MEMORY);
    CHECK(check && kempe_check_print(check, KEMPE_TEXT, &said) == KEMPE_OK);
    CHECK(said && strstr(said, "joint C (revolute) is cut"));
    CHECK(said && strstr(said, "loop 'C' can never close: body 'b' spans 3 m from P to Q, the other links at most 1.75 "
                               "m: 1.25 m are missing"));
    kempe_text_free(said);
    kempe_check_free(check);
    kempe_system_free(system);
    kempe_model_free(model);
}

/* Included graphs: names with prefixes, and their ground on a body. */
static void test_included(void)
{
    static const char *const joints[] = {"T", "l_A", "l_B", "r_A", "r_B"};
    kempe_model *model = read_file("tests/models/two_bars.yaml");
    if (!model)
        return;
    CHECK(model->body_count == 6 && model->cut_count == 2);
    for (int b = 1; b < model->body_count; b++)
        CHECK_TEXT(model->bodies[b].joint, joints[b - 1]);
    CHECK_TEXT(model->cuts[0].joint, "l_C");
    CHECK_TEXT(model->cuts[1].joint, "r_C");
    CHECK_TEXT(model->cuts[0].why, "it has fewer rows than l_A; not to be cut: l_B (force 'l_brake' acts on it)");
    CHECK_TEXT(model->cuts[1].why, "it has fewer rows than r_A; not to be cut: r_B (force 'r_brake' acts on it)");
    CHECK(model->bodies[2].reversed && !model->bodies[3].reversed);
    kempe_model_free(model);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_choice);
    TEST(test_rows);
    TEST(test_start_of_cut);
    TEST(test_too_short);
    TEST(test_included);
    kempe_context_free(context);
    return check_report();
}
